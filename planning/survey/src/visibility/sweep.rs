//! The radial sweep: which corners a point sees (D2.7 §2.3.2, algorithms 1 and 2).
//!
//! A ray turns once round the point. Its status holds, nearest first, the edges
//! that it properly crosses; a vertex is seen when the nearest does not come
//! before it. Two corrections to the printed algorithms: edges enter and leave
//! the status at *every* vertex, seen or not; and of vertices in one direction the
//! farther are hidden by a nearer one exactly if the ray goes on into an obstacle
//! there. All comparisons are exact, so touching, collinear and coinciding
//! vertices need no tolerance. Edges that cross others have no place in an order
//! and are compared one by one.

use super::obstacles::{Obstacles, index};
use skein_geometry::frame::Point;
use skein_geometry::polygon::side;
use std::cmp::Ordering;

/// The sweep with its working memory, which is kept from point to point.
#[derive(Clone, Debug, Default)]
pub(super) struct Sweep {
    /// Vertices in the order in which the ray meets them.
    events: Vec<(f64, u32)>,
    /// For each edge the exact side of the centre: 1 if the ray meets its first
    /// vertex first, −1 if its last, 0 if the edge points at the centre.
    turn: Vec<i8>,
    status: Vec<u32>,
    /// Edges under the ray that cross others, in no order.
    unordered: Vec<u32>,
    /// Vertices at the centre.
    here: Vec<u32>,
    /// Edges on which the centre lies between the ends.
    under: Vec<u32>,
    winding: Vec<i32>,
    on_border: Vec<bool>,
}

impl Sweep {
    /// The convex corners that `p` sees and at which the line of sight is tangent to
    /// their obstacle, in the order of the sweep. False from inside an obstacle.
    pub fn look_around(&mut self, o: &Obstacles, p: Point, seen: &mut Vec<u32>) -> bool {
        self.corners_seen(o, p, None, seen)
    }

    /// As [`Sweep::look_around`] from the corner `own` at `p`: only lines that are
    /// tangent there too are kept.
    pub fn corners_seen(
        &mut self,
        o: &Obstacles,
        p: Point,
        own: Option<usize>,
        seen: &mut Vec<u32>,
    ) -> bool {
        seen.clear();
        if !self.start(o, p) {
            return false;
        }
        self.sort_events(o, p);
        let mut i = 0;
        while i < self.events.len() {
            let mut j = i + 1;
            while j < self.events.len() && self.same_direction(o, p, i, j) {
                j += 1;
            }
            for k in i..j {
                self.close_edges(o, k);
            }
            self.look(o, p, own, i..j, seen);
            for k in i..j {
                self.open_edges(o, k);
            }
            i = j;
        }
        true
    }

    /// Reads all edges once: what lies at the centre, and what the ray crosses just
    /// before it points east. False if the centre is inside an obstacle.
    fn start(&mut self, o: &Obstacles, p: Point) -> bool {
        self.turn.clear();
        self.status.clear();
        self.unordered.clear();
        self.here.clear();
        self.under.clear();
        self.winding.clear();
        self.winding.resize(o.count, 0);
        self.on_border.clear();
        self.on_border.resize(o.count, false);
        let mut crossed = Vec::new();
        for (i, &a) in o.vertices.iter().enumerate() {
            let b = o.after(i);
            let s = side(p, a, b);
            self.turn.push(s);
            let obstacle = o.obstacle[i] as usize;
            if same(a, p) {
                self.here.push(index(i));
                self.on_border[obstacle] = true;
            } else if s == 0 && !same(b, p) && between(a, b, p) {
                self.under.push(index(i));
                self.on_border[obstacle] = true;
            }
            if a.y <= p.y && p.y < b.y && s > 0 {
                self.winding[obstacle] += 1;
            } else if b.y <= p.y && p.y < a.y && s < 0 {
                self.winding[obstacle] -= 1;
            }
            let (first, last) = if s > 0 { (a, b) } else { (b, a) };
            if s != 0 && first.y < p.y && last.y >= p.y {
                crossed.push(index(i));
            }
        }
        let outside = |(w, b): (&i32, &bool)| *b || *w == 0;
        if !self.winding.iter().zip(&self.on_border).all(outside) {
            return false;
        }
        for e in crossed {
            self.insert(o, e);
        }
        true
    }

    fn sort_events(&mut self, o: &Obstacles, p: Point) {
        self.events.clear();
        for (i, v) in o.vertices.iter().enumerate() {
            let (dx, dy) = (v.x - p.x, v.y - p.y);
            let share = dx / (dx.abs() + dy.abs());
            if !same(*v, p) {
                // Grows with the angle: 0 to 2 above the centre, 2 to 4 below.
                let key = if upper(p, *v) {
                    1.0 - share
                } else {
                    3.0 + share
                };
                self.events.push((key, index(i)));
            }
        }
        self.events
            .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // The key is rounded; where it errs, neighbours change places.
        for i in 1..self.events.len() {
            let mut j = i;
            while j > 0 && self.order(o, p, j - 1, j) == Ordering::Greater {
                self.events.swap(j - 1, j);
                j -= 1;
            }
        }
    }

    fn vertex(&self, event: usize) -> usize {
        self.events[event].1 as usize
    }

    /// The exact order of two events: by direction, then by distance, then by number.
    fn order(&self, o: &Obstacles, p: Point, i: usize, j: usize) -> Ordering {
        let (vi, vj) = (self.vertex(i), self.vertex(j));
        let (a, b) = (o.vertices[vi], o.vertices[vj]);
        let above = upper(p, b).cmp(&upper(p, a));
        above.then_with(|| {
            side(p, a, b)
                .cmp(&0)
                .reverse()
                .then_with(|| along(p, a, b))
                .then(vi.cmp(&vj))
        })
    }

    fn same_direction(&self, o: &Obstacles, p: Point, i: usize, j: usize) -> bool {
        let (a, b) = (o.vertices[self.vertex(i)], o.vertices[self.vertex(j)]);
        upper(p, a) == upper(p, b) && side(p, a, b) == 0
    }

    /// Which vertices of one direction are seen.
    fn look(
        &self,
        o: &Obstacles,
        p: Point,
        own: Option<usize>,
        events: std::ops::Range<usize>,
        seen: &mut Vec<u32>,
    ) {
        let towards = o.vertices[self.vertex(events.start)];
        if self.leaves_inwards(o, towards) {
            return;
        }
        let mut i = events.start;
        while i < events.end {
            let at = o.vertices[self.vertex(i)];
            if self.is_behind_an_edge(o, at) {
                return;
            }
            let mut j = i;
            let mut hides = false;
            while j < events.end && same(o.vertices[self.vertex(j)], at) {
                let v = self.vertex(j);
                if o.turn[v] > 0
                    && o.is_tangent(p, v)
                    && own.is_none_or(|own| o.is_tangent(at, own))
                {
                    seen.push(index(v));
                }
                hides |= o.enters_behind(p, v);
                j += 1;
            }
            if hides {
                return;
            }
            i = j;
        }
    }

    /// Whether the way from the centre to `towards` enters an obstacle at once.
    pub fn leaves_inwards(&self, o: &Obstacles, towards: Point) -> bool {
        let vertices = self.here.iter().map(|&v| v as usize);
        let edges = self.under.iter().map(|&e| e as usize);
        vertices.clone().any(|v| o.enters_towards(v, towards))
            || edges
                .clone()
                .any(|e| side(o.vertices[e], o.after(e), towards) > 0)
    }

    fn is_behind_an_edge(&self, o: &Obstacles, at: Point) -> bool {
        let behind = |&e: &u32| {
            let (a, b) = self.ends(o, e);
            side(a, b, at) < 0
        };
        self.status.first().is_some_and(behind) || self.unordered.iter().any(behind)
    }

    /// The ends of an edge in the order in which the ray meets them.
    fn ends(&self, o: &Obstacles, e: u32) -> (Point, Point) {
        let e = e as usize;
        if self.turn[e] > 0 {
            (o.vertices[e], o.after(e))
        } else {
            (o.after(e), o.vertices[e])
        }
    }

    /// Removes the edges whose last vertex the ray has reached.
    fn close_edges(&mut self, o: &Obstacles, event: usize) {
        let v = self.vertex(event);
        if self.turn[v] < 0 {
            self.remove(index(v));
        }
        let before = o.previous[v];
        if self.turn[before as usize] > 0 {
            self.remove(before);
        }
    }

    /// Inserts the edges that begin where the ray has arrived.
    fn open_edges(&mut self, o: &Obstacles, event: usize) {
        let v = self.vertex(event);
        if self.turn[v] > 0 {
            self.insert(o, index(v));
        }
        let before = o.previous[v];
        if self.turn[before as usize] < 0 {
            self.insert(o, before);
        }
    }

    fn insert(&mut self, o: &Obstacles, e: u32) {
        if o.crossing[e as usize] {
            self.unordered.push(e);
        } else {
            let at = self.status.partition_point(|&f| self.is_nearer(o, f, e));
            self.status.insert(at, e);
        }
    }

    fn remove(&mut self, e: u32) {
        for list in [&mut self.status, &mut self.unordered] {
            if let Some(i) = list.iter().position(|&f| f == e) {
                list.remove(i);
                return;
            }
        }
    }

    /// Whether edge `e` is before edge `f` on every ray that crosses both.
    fn is_nearer(&self, o: &Obstacles, e: u32, f: u32) -> bool {
        let ((a, b), (c, d)) = (self.ends(o, e), self.ends(o, f));
        // The centre is to the left of both.
        match (side(a, b, c), side(a, b, d)) {
            (0, 0) => e < f,
            (s, t) if s <= 0 && t <= 0 => true,
            (s, t) if s >= 0 && t >= 0 => false,
            _ => side(c, d, a) >= 0 && side(c, d, b) >= 0,
        }
    }
}

/// Whether a direction comes in the first half turn from east.
fn upper(p: Point, v: Point) -> bool {
    v.y > p.y || (v.y >= p.y && v.x > p.x)
}

/// Whether two points are one and the same; zeros of either sign are equal.
pub(super) fn same(a: Point, b: Point) -> bool {
    (a.x - b.x).abs() <= 0.0 && (a.y - b.y).abs() <= 0.0
}

/// Whether `p`, a point of the line `a b`, is on the piece between them.
fn between(a: Point, b: Point, p: Point) -> bool {
    p.x >= a.x.min(b.x) && p.x <= a.x.max(b.x) && p.y >= a.y.min(b.y) && p.y <= a.y.max(b.y)
}

/// The order of two points on one ray from `p`: exact, by their coordinates.
fn along(p: Point, a: Point, b: Point) -> Ordering {
    let nearer = |from: f64, a: f64, b: f64| {
        if a > from || b > from {
            a.total_cmp(&b)
        } else {
            b.total_cmp(&a)
        }
    };
    nearer(p.x, a.x, b.x).then_with(|| nearer(p.y, a.y, b.y))
}
