//! Obstacles as flat rings of vertices, the form in which the sweep reads them
//! (D2.7 §2.3.2).
//!
//! Every ring has its obstacle on the left: outer rings run counter-clockwise,
//! rings round a hole clockwise. Obstacles may touch, overlap and share vertices;
//! what is forbidden is the open interior of each.

use skein_geometry::frame::Point;
use skein_geometry::polygon::side;

/// Vertices, edges and what the sweep asks about them. Edge `i` runs from vertex
/// `i` to vertex `next[i]`.
#[derive(Clone, Debug, Default)]
pub(super) struct Obstacles {
    pub vertices: Vec<Point>,
    pub next: Vec<u32>,
    pub previous: Vec<u32>,
    /// Which obstacle a vertex belongs to.
    pub obstacle: Vec<u32>,
    /// The exact turn at a vertex: 1 where the obstacle is convex.
    pub turn: Vec<i8>,
    /// Edges that properly cross another: overlapping obstacles have them, and no
    /// order along a ray holds for them.
    pub crossing: Vec<bool>,
    /// How many obstacles there are.
    pub count: usize,
}

impl Obstacles {
    /// Collects rings, each with the number of its obstacle.
    pub fn new<'a>(rings: impl Iterator<Item = (u32, &'a [Point])>) -> Self {
        let mut all = Self::default();
        for (obstacle, ring) in rings {
            let (first, n) = (all.vertices.len(), ring.len());
            for (i, &p) in ring.iter().enumerate() {
                all.vertices.push(p);
                all.next.push(index(first + (i + 1) % n));
                all.previous.push(index(first + (i + n - 1) % n));
                all.obstacle.push(obstacle);
            }
            all.count = all.count.max(obstacle as usize + 1);
        }
        all.turn = (0..all.vertices.len())
            .map(|i| side(all.before(i), all.vertices[i], all.after(i)))
            .collect();
        all.crossing = all.find_crossings();
        all
    }

    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// The vertex after vertex `i` on its ring.
    pub fn after(&self, i: usize) -> Point {
        self.vertices[self.next[i] as usize]
    }

    /// The vertex before vertex `i` on its ring.
    pub fn before(&self, i: usize) -> Point {
        self.vertices[self.previous[i] as usize]
    }

    /// Whether going on from `from` straight through vertex `i` leads at once into
    /// the open interior of its obstacle.
    pub fn enters_behind(&self, from: Point, i: usize) -> bool {
        let v = self.vertices[i];
        let out = side(from, v, self.after(i)) < 0;
        let back = side(from, v, self.before(i)) > 0;
        if self.turn[i] < 0 {
            out || back
        } else {
            out && back
        }
    }

    /// Whether setting out from vertex `i` towards `to` leads at once into the open
    /// interior of its obstacle.
    pub fn enters_towards(&self, i: usize, to: Point) -> bool {
        let v = self.vertices[i];
        let out = side(v, self.after(i), to) > 0;
        let back = side(self.before(i), v, to) > 0;
        if self.turn[i] < 0 {
            out || back
        } else {
            out && back
        }
    }

    /// Whether the line through `from` and vertex `i` only touches the obstacle at
    /// that vertex: both neighbours are on one side of it.
    pub fn is_tangent(&self, from: Point, i: usize) -> bool {
        let v = self.vertices[i];
        side(from, v, self.before(i)) * side(from, v, self.after(i)) >= 0
    }

    /// Marks the edges that properly cross another.
    fn find_crossings(&self) -> Vec<bool> {
        let mut crossing = vec![false; self.len()];
        let ends = |i: u32| (self.vertices[i as usize], self.after(i as usize));
        let mut by_west: Vec<u32> = (0..index(self.len())).collect();
        let west = |i: u32| {
            let (a, b) = ends(i);
            a.x.min(b.x)
        };
        by_west.sort_by(|&i, &j| west(i).total_cmp(&west(j)).then(i.cmp(&j)));
        for (k, &i) in by_west.iter().enumerate() {
            let (a, b) = ends(i);
            let (east, south, north) = (a.x.max(b.x), a.y.min(b.y), a.y.max(b.y));
            for &j in &by_west[k + 1..] {
                if west(j) > east {
                    break;
                }
                let (c, d) = ends(j);
                if c.y.max(d.y) < south || c.y.min(d.y) > north {
                    continue;
                }
                if side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0 {
                    crossing[i as usize] = true;
                    crossing[j as usize] = true;
                }
            }
        }
        crossing
    }
}

/// Vertices are counted in 32 bits; more than that do not fit a mission's memory.
pub(super) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}
