//! What it costs to fly from the end of one pass to the next, and the order of passes
//! (D2.7 §3.6.1, application of the decomposition).
//!
//! Places are the two ends of each pass and the launch point. Leaving a pass over one end
//! and entering another over one of its ends is a Dubins curve between two poses; flown
//! backwards it is the same curve, so that the cost is symmetric. Where a zone lies
//! between, the shortest way round it takes the place of the straight line.

use super::Pass;
use crate::coverage::metric::Metric;
use crate::route::mesh::Mesh;
use crate::route::two_point::Search;
use crate::trajectory::dubins;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{PI, atan2};
use skein_geometry::offset::Region;
use std::cell::RefCell;

/// How far beyond everything the plane of the ways ends, metres: wide enough to pass
/// round the outermost zone.
const OUTSKIRTS_M: f64 = 1_000.0;

/// The ways between passes.
#[derive(Debug)]
pub struct Ways {
    mesh: Option<Mesh>,
    zones: Vec<Boxed>,
}

/// A border of a zone with the low and the high corner of the box round it.
type Boxed = (Point, Point, Vec<Point>);

impl Ways {
    /// Ways round grown zones for places within `reach_m` of the origin.
    pub(super) fn new(zones: &[Region], reach_m: f64) -> Self {
        let mut reach_m = reach_m;
        for p in zones.iter().flat_map(|z| &z.outer) {
            reach_m = reach_m.max(p.coords.amax());
        }
        let half_m = reach_m + OUTSKIRTS_M;
        let border = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Point::new(x * half_m, y * half_m));
        let mut rings: Vec<&[Point]> = vec![&border];
        rings.extend(zones.iter().flat_map(Region::rings));
        // Grown zones are disjoint and simple, so that there is a mesh; without one the
        // lengths of ways are those of straight lines, and only the order suffers.
        let mesh = if zones.is_empty() {
            None
        } else {
            Mesh::from_rings(&rings).ok()
        };
        let zones = zones
            .iter()
            .flat_map(Region::rings)
            .map(|ring| {
                let (mut low, mut high) = (ring[0], ring[0]);
                for p in ring {
                    low = Point::new(low.x.min(p.x), low.y.min(p.y));
                    high = Point::new(high.x.max(p.x), high.y.max(p.y));
                }
                (low, high, ring.to_vec())
            })
            .collect();
        Self { mesh, zones }
    }

    /// The points of a flight from place to place in this order, with the bends round
    /// zones between them.
    pub(super) fn track(&self, places: impl Iterator<Item = Point>) -> Vec<Point> {
        let mut search = self.mesh.as_ref().map(Search::new);
        let mut track: Vec<Point> = Vec::new();
        let mut way = Vec::new();
        for p in places {
            let bends = track
                .last()
                .is_some_and(|from| self.is_blocked(*from, p))
                .then_some(())
                .and(search.as_mut());
            if let (Some(search), Some(&from)) = (bends, track.last())
                && search.shortest_into(from, p, &mut way)
                && way.len() > 2
            {
                track.extend(&way[1..way.len() - 1]);
            }
            track.push(p);
        }
        track
    }

    /// Whether any way leads from one place to the other.
    #[must_use]
    pub fn joins(&self, a: Point, b: Point) -> bool {
        let search = self.mesh.as_ref().map(Search::new);
        search.is_none_or(|mut s| s.distance_m(a, b).is_some())
    }

    /// Whether the straight line crosses a border of a zone.
    fn is_blocked(&self, a: Point, b: Point) -> bool {
        self.blocking(a, b).next().is_some()
    }

    /// The borders of zones that the straight line crosses.
    fn blocking(&self, a: Point, b: Point) -> impl Iterator<Item = &Boxed> {
        let (low, high) = (
            Point::new(a.x.min(b.x), a.y.min(b.y)),
            Point::new(a.x.max(b.x), a.y.max(b.y)),
        );
        self.zones.iter().filter(move |(l, h, ring)| {
            l.x <= high.x && low.x <= h.x && l.y <= high.y && low.y <= h.y && crosses(a, b, ring)
        })
    }
}

/// Whether the line meets the ring properly or at a vertex of it.
fn crosses(a: Point, b: Point, ring: &[Point]) -> bool {
    let d = b - a;
    let height = |p: &Point| d.perp(&(p - a));
    let mut before = height(&ring[ring.len() - 1]);
    let mut q = ring[ring.len() - 1];
    for p in ring {
        let now = height(p);
        if (before > 0.0) != (now > 0.0) {
            // Where the edge crosses the line's line, as a share of the way from a to b.
            let at = q + (p - q) * (before / (before - now));
            let t = (at - a).dot(&d);
            if t >= 0.0 && t <= d.norm_squared() {
                return true;
            }
        }
        before = now;
        q = *p;
    }
    false
}

/// The places of a set of passes and the costs between them, metres.
pub struct Places<'a> {
    ways: &'a Ways,
    search: RefCell<Option<Search<'a>>>,
    at: Vec<Point>,
    /// The heading in which a pass is left over each end.
    out_rad: Vec<f64>,
    turn_radius_m: f64,
}

impl<'a> Places<'a> {
    /// Place `2 i` is the beginning of pass `i`, `2 i + 1` its end; then come the launch
    /// points.
    #[must_use]
    pub fn new(ways: &'a Ways, passes: &[Pass], launches: &[Point], turn_radius_m: f64) -> Self {
        let mut at = Vec::with_capacity(2 * passes.len() + launches.len());
        let mut out_rad = Vec::with_capacity(2 * passes.len());
        for pass in passes {
            let d = pass.to - pass.from;
            let heading = atan2(d.y, d.x);
            at.extend([pass.from, pass.to]);
            out_rad.extend([heading + PI, heading]);
        }
        at.extend(launches);
        Self {
            ways,
            search: RefCell::new(ways.mesh.as_ref().map(Search::new)),
            at,
            out_rad,
            turn_radius_m,
        }
    }

    /// Length of the shortest way of a point, metres.
    fn taut_m(&self, a: Point, b: Point) -> f64 {
        let straight = (b - a).norm();
        if !self.ways.is_blocked(a, b) {
            return straight;
        }
        let mut search = self.search.borrow_mut();
        let around = search.as_mut().and_then(|s| s.distance_m(a, b));
        around.unwrap_or(straight)
    }

    /// As [`Metric::cost`], but where a zone lies between places that are farther apart
    /// than `near_m`, the way round it is guessed from its size and not searched for:
    /// hardly any such way is flown, and nearly all pairs of places are far apart.
    pub fn guess_m(&self, a: usize, b: usize, near_m: f64) -> f64 {
        let (p, q) = (self.at[a], self.at[b]);
        let straight = (q - p).norm();
        let ends = self.out_rad.len();
        if straight <= near_m || a >= ends || b >= ends {
            return self.cost(a, b);
        }
        let blocking = self.ways.blocking(p, q);
        let round: f64 = blocking
            .map(|(low, high, _)| (high.x - low.x) + (high.y - low.y))
            .sum();
        straight + round + self.turns_m(a, b).max(0.0)
    }

    /// What the turns at both ends add to a straight line, metres.
    fn turns_m(&self, a: usize, b: usize) -> f64 {
        let (Some(&out), Some(&back)) = (self.out_rad.get(a), self.out_rad.get(b)) else {
            return 0.0;
        };
        let from = Pose::new(self.at[a], out);
        let to = Pose::new(self.at[b], back + PI);
        dubins::length_m(from, to, self.turn_radius_m) - (self.at[b] - self.at[a]).norm()
    }
}

impl Metric for Places<'_> {
    fn cost(&self, a: usize, b: usize) -> f64 {
        if a == b {
            return 0.0;
        }
        self.taut_m(self.at[a], self.at[b]) + self.turns_m(a, b).max(0.0)
    }
}
