//! Shortest paths by the visibility graph (D2.7 §2.3.2).
//!
//! The graph of the obstacles is built once by a radial sweep round every convex
//! corner and kept; a question adds its two ends by a sweep each and is answered by
//! A*. Only bitangents are kept, edges that touch the obstacles at both ends
//! without entering them when prolonged: a shortest path has no others between its
//! bends. Orientation is exact, so the answer does not depend on how obstacles
//! touch, on collinear or repeated vertices, or on where the origin is. What a UAV
//! can fly of it is [`skein_flight::route::Router`]'s question.

mod obstacles;
mod sweep;
#[cfg(test)]
mod tests;

use obstacles::{Obstacles, index};
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_geometry::hash::Fingerprint;
use skein_geometry::offset::Region;
use skein_geometry::polygon::{MAX_COORDINATE_M, side};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use sweep::{Sweep, same};

/// A shortest path: from the start over the bends to the goal.
#[derive(Clone, Debug, PartialEq)]
pub struct TautPath {
    /// Start, bends, goal; a single point when start and goal are the same.
    pub points: Vec<Point>,
    /// Length, metres.
    pub length_m: f64,
}

/// The visibility graph of a set of obstacles, ready for questions.
///
/// Forbidden is the open interior of each obstacle: paths may run along edges, and
/// through a point in which obstacles only touch.
#[derive(Clone, Debug)]
pub struct VisibilityGraph {
    obstacles: Obstacles,
    /// The vertices that are convex and not inside an obstacle.
    corners: Vec<u32>,
    /// Corner `i` sees `targets[begins[i]..begins[i + 1]]`, with lengths in metres.
    begins: Vec<u32>,
    targets: Vec<(u32, f64)>,
}

/// Nothing has come this way yet.
const NOBODY: u32 = u32::MAX;

impl VisibilityGraph {
    /// The graph of the given obstacles, which may touch and overlap.
    ///
    /// # Complexity
    /// O(k n log n) for k convex corners among n vertices. Overlapping obstacles are
    /// handled, with a share of edges that grows linearly each; their union is faster.
    #[must_use]
    pub fn new(obstacles: &[Polygon]) -> Self {
        Self::of_rings(
            obstacles
                .iter()
                .enumerate()
                .map(|(i, p)| (index(i), p.vertices())),
        )
    }

    /// As [`VisibilityGraph::new`], of regions with holes, as
    /// [`grow`](skein_geometry::offset::grow) makes them.
    #[must_use]
    pub fn round(regions: &[Region]) -> Self {
        let rings = |(i, r)| Region::rings(r).map(move |ring| (index(i), ring));
        Self::of_rings(regions.iter().enumerate().flat_map(rings))
    }

    /// As [`VisibilityGraph::new`], of rings with the number of the obstacle that each
    /// belongs to: outer rings counter-clockwise, rings of holes clockwise.
    pub fn of_rings<'a>(rings: impl Iterator<Item = (u32, &'a [Point])>) -> Self {
        let obstacles = Obstacles::new(rings);
        let mut sweep = Sweep::default();
        let mut seen = Vec::new();
        let mut corners = Vec::new();
        let mut begins = vec![0];
        let mut targets = Vec::new();
        // Where the corner with a vertex's number stands in `corners`.
        let mut place = vec![NOBODY; obstacles.len()];
        for (v, place) in place.iter_mut().enumerate() {
            let at = obstacles.vertices[v];
            if obstacles.turn[v] <= 0 || !sweep.corners_seen(&obstacles, at, Some(v), &mut seen) {
                continue;
            }
            *place = index(corners.len());
            corners.push(index(v));
            targets.extend(
                seen.iter()
                    .map(|&w| (w, (obstacles.vertices[w as usize] - at).norm())),
            );
            begins.push(index(targets.len()));
        }
        // Being seen is mutual, so whoever is seen has a place.
        for (target, _) in &mut targets {
            *target = place[*target as usize];
        }
        Self {
            obstacles,
            corners,
            begins,
            targets,
        }
    }

    /// The same number for the same graph, on every machine: processes that built
    /// their own compare it.
    #[must_use]
    pub fn content_hash(&self) -> u64 {
        let corners = self.corners.iter().copied();
        let mut content = Fingerprint::of("graph")
            .with_indices(corners)
            .with_indices(self.begins.iter().copied());
        for &p in &self.obstacles.vertices {
            content = content.with_point(p);
        }
        for &(target, length_m) in &self.targets {
            content = content.with(u64::from(target)).with_number(length_m);
        }
        content.hash()
    }

    /// How many corners the graph has.
    #[must_use]
    pub fn corners(&self) -> usize {
        self.corners.len()
    }

    /// How many bitangents the graph has, each counted once.
    #[must_use]
    pub fn edges(&self) -> usize {
        self.targets.len() / 2
    }

    /// The shortest path that enters no obstacle. `None` if an end is inside one or
    /// farther than [`MAX_COORDINATE_M`] from the origin, or if the obstacles part the two.
    ///
    /// # Complexity
    /// O(n log n) for the two sweeps, and A* over the graph.
    #[must_use]
    pub fn shortest(&self, from: Point, to: Point) -> Option<TautPath> {
        let on_map = |c: &f64| c.abs() <= MAX_COORDINATE_M;
        if ![from.x, from.y, to.x, to.y].iter().all(on_map) {
            return None;
        }
        let mut sweep = Sweep::default();
        let mut near_goal = Vec::new();
        let mut near_start = Vec::new();
        if !sweep.look_around(&self.obstacles, to, &mut near_goal)
            || !sweep.look_around(&self.obstacles, from, &mut near_start)
        {
            return None;
        }
        if same(from, to) {
            return Some(TautPath {
                points: vec![from],
                length_m: 0.0,
            });
        }
        if self.is_free(&sweep, from, to) {
            return Some(TautPath {
                points: vec![from, to],
                length_m: (to - from).norm(),
            });
        }
        self.search(from, to, &near_start, &near_goal)
    }

    /// Whether the straight line from the last sweep's centre to `to` is free.
    fn is_free(&self, sweep: &Sweep, from: Point, to: Point) -> bool {
        let o = &self.obstacles;
        if sweep.leaves_inwards(o, to) {
            return false;
        }
        !(0..o.len()).any(|i| {
            let (a, b) = (o.vertices[i], o.after(i));
            let (sa, sb) = (side(from, to, a), side(from, to, b));
            if sa == 0 {
                // A vertex on the line hides what is beyond it if the line enters there.
                let ahead = (a - from).dot(&(to - from)) > 0.0;
                let before_goal = (a - to).dot(&(from - to)) > 0.0;
                return ahead && before_goal && !same(a, from) && o.enters_behind(from, i);
            }
            sa * sb < 0 && side(a, b, from) * side(a, b, to) < 0
        })
    }

    /// A* from corner to corner.
    fn search(
        &self,
        from: Point,
        to: Point,
        near_start: &[u32],
        near_goal: &[u32],
    ) -> Option<TautPath> {
        let n = self.corners.len();
        let at = |c: u32| self.obstacles.vertices[self.corners[c as usize] as usize];
        let place = |v: &u32| self.corners.binary_search(v).ok().map(index);
        let mut to_goal = vec![f64::INFINITY; n];
        for c in near_goal.iter().filter_map(place) {
            to_goal[c as usize] = (to - at(c)).norm();
        }
        let mut best = vec![f64::INFINITY; n];
        let mut parent = vec![NOBODY; n];
        let mut done = vec![false; n];
        let mut open = BinaryHeap::new();
        for c in near_start.iter().filter_map(place) {
            best[c as usize] = (at(c) - from).norm();
            open.push(Reverse(Open(best[c as usize] + (to - at(c)).norm(), c)));
        }
        let (mut length_m, mut last) = (f64::INFINITY, NOBODY);
        while let Some(Reverse(Open(bound_m, c))) = open.pop() {
            if bound_m >= length_m {
                break;
            }
            let i = c as usize;
            if std::mem::replace(&mut done[i], true) {
                continue;
            }
            if best[i] + to_goal[i] < length_m {
                (length_m, last) = (best[i] + to_goal[i], c);
            }
            let (begin, end) = (self.begins[i] as usize, self.begins[i + 1] as usize);
            for &(next, edge_m) in &self.targets[begin..end] {
                let g = best[i] + edge_m;
                if g < best[next as usize] {
                    best[next as usize] = g;
                    parent[next as usize] = c;
                    open.push(Reverse(Open(g + (to - at(next)).norm(), next)));
                }
            }
        }
        if last == NOBODY {
            return None;
        }
        let mut points = vec![to];
        while last != NOBODY {
            push_bend(&mut points, at(last));
            last = parent[last as usize];
        }
        push_bend(&mut points, from);
        points.reverse();
        Some(TautPath { points, length_m })
    }
}

/// Appends a point; the one before it goes if the path is straight there.
fn push_bend(points: &mut Vec<Point>, p: Point) {
    if let [.., a, b] = points[..]
        && side(a, b, p) == 0
    {
        points.pop();
    }
    points.push(p);
}

/// A corner in the open list, by its bound and then by its number.
#[derive(Clone, Copy, Debug)]
struct Open(f64, u32);

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}
