//! Outlines of zones, holes, fences and areas: rings of straight edges, and circles.

use crate::boxes::{Bounds, Tree};
use crate::path::{Near, Path, to_segment};
use crate::plane::Point;
use core::cmp::Ordering;
use std::collections::BinaryHeap;
use thiserror::Error;

/// The most corners of a ring.
pub const MOST_CORNERS: usize = 200_000;

/// Corners nearer to each other than this are one, metres.
const COINCIDENT_M: f64 = 1e-6;

/// Why points are no ring.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RingError {
    /// Too few or too many.
    #[error("a ring has 3 to {MOST_CORNERS} different corners, found {0}")]
    Corners(usize),
    /// Not a number, or infinite.
    #[error("corner {0} is no point of the plane")]
    NotFinite(usize),
    /// It encloses nothing.
    #[error("the ring encloses no area")]
    NoArea,
    /// What is inside cannot be told.
    #[error("the ring crosses itself: its edge after corner {0} and the one after corner {1}")]
    Crossing(usize, usize),
}

/// A closed line of straight edges that does not cross itself, counter-clockwise.
#[derive(Clone, Debug)]
pub struct Ring {
    corners: Vec<Point>,
    bounds: Bounds,
    tree: Tree,
}

impl Ring {
    /// Checks corners, in either direction, the first repeated at the end or not.
    ///
    /// # Errors
    /// [`RingError`] names the corners by their number from 1.
    pub fn new(points: Vec<Point>) -> Result<Self, RingError> {
        if let Some(i) = points
            .iter()
            .position(|p| !(p.x.is_finite() && p.y.is_finite()))
        {
            return Err(RingError::NotFinite(i + 1));
        }
        let mut corners = points;
        corners.dedup_by(|p, q| p.distance(*q) < COINCIDENT_M);
        while corners.len() > 1 && corners[0].distance(corners[corners.len() - 1]) < COINCIDENT_M {
            corners.pop();
        }
        if !(3..=MOST_CORNERS).contains(&corners.len()) {
            return Err(RingError::Corners(corners.len()));
        }
        let area_m2 = twice_area(&corners) / 2.0;
        if area_m2.abs() < 1e-6 {
            return Err(RingError::NoArea);
        }
        if area_m2 < 0.0 {
            corners.reverse();
        }
        let n = corners.len();
        let boxes: Vec<Bounds> = (0..n)
            .map(|i| Bounds::of(&[corners[i], corners[(i + 1) % n]]))
            .collect();
        let ring = Self {
            bounds: Bounds::of(&corners),
            tree: Tree::new(&boxes),
            corners,
        };
        match ring.self_crossing() {
            Some((i, j)) => Err(RingError::Crossing(i + 1, j + 1)),
            None => Ok(ring),
        }
    }

    /// Its corners, counter-clockwise, the first not repeated.
    #[must_use]
    pub fn corners(&self) -> &[Point] {
        &self.corners
    }

    /// Its area, square metres.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        twice_area(&self.corners) / 2.0
    }

    fn edge(&self, i: usize) -> (Point, Point) {
        (self.corners[i], self.corners[(i + 1) % self.corners.len()])
    }

    fn self_crossing(&self) -> Option<(usize, usize)> {
        let mut found = None;
        for i in 0..self.corners.len() {
            let (a, b) = self.edge(i);
            let (path, own) = (Path::line(a, b), Bounds::of(&[a, b]));
            self.tree.visit(
                |bounds| path.at_least(&own, bounds) <= 0.0,
                |j| {
                    let (c, d) = self.edge(j);
                    if j > i && cross_in_the_middle(a, b, c, d) {
                        found = Some((i, j));
                    }
                    found.is_none()
                },
            );
            if found.is_some() {
                break;
            }
        }
        found
    }

    /// By the edges that a ray to the east meets.
    fn contains(&self, p: Point) -> bool {
        let mut winding = 0;
        self.tree.visit(
            |bounds| bounds.low.y <= p.y && p.y <= bounds.high.y && bounds.high.x >= p.x,
            |i| {
                let (a, b) = self.edge(i);
                if (a.y <= p.y) != (b.y <= p.y) {
                    let left = b.minus(a).cross(p.minus(a)) > 0.0;
                    let up = b.y > a.y;
                    if up == left {
                        winding += if up { 1 } else { -1 };
                    }
                }
                true
            },
        );
        winding != 0
    }
}

/// Twice the signed area, positive when counter-clockwise.
fn twice_area(corners: &[Point]) -> f64 {
    let o = corners.first().copied().unwrap_or_default();
    let n = corners.len();
    (0..n)
        .map(|i| corners[i].minus(o).cross(corners[(i + 1) % n].minus(o)))
        .sum()
}

/// Whether two segments cross with all ends clearly off the other one: rings of maps touch
/// themselves, and that leaves no doubt about their inside.
fn cross_in_the_middle(a: Point, b: Point, c: Point, d: Point) -> bool {
    let off = |p: Point, from: Point, to: Point| {
        let way = to.minus(from);
        way.cross(p.minus(from)) / way.norm().max(f64::MIN_POSITIVE)
    };
    let apart = |x: f64, y: f64| x.abs().min(y.abs()) > COINCIDENT_M && (x > 0.0) != (y > 0.0);
    apart(off(c, a, b), off(d, a, b)) && apart(off(a, c, d), off(b, c, d))
}

/// A closed outline.
#[derive(Clone, Debug)]
pub enum Outline {
    /// Straight edges.
    Ring(Ring),
    /// A circle.
    Circle {
        /// Its middle.
        middle: Point,
        /// Its radius, metres.
        radius_m: f64,
    },
}

impl Outline {
    pub(crate) fn bounds(&self) -> Bounds {
        match self {
            Self::Ring(ring) => ring.bounds,
            Self::Circle { middle, radius_m } => Bounds {
                low: middle.plus(Point::new(1.0, 1.0), -radius_m),
                high: middle.plus(Point::new(1.0, 1.0), *radius_m),
            },
        }
    }

    /// Whether a point is inside.
    #[must_use]
    pub fn contains(&self, p: Point) -> bool {
        match self {
            Self::Ring(ring) => ring.contains(p),
            Self::Circle { middle, radius_m } => p.distance(*middle) < *radius_m,
        }
    }

    /// How far a point is from the line, on either side, metres.
    #[must_use]
    pub fn to_border(&self, p: Point) -> f64 {
        match self {
            Self::Ring(ring) => {
                let at = Bounds::of(&[p]);
                let mut least_m = f64::INFINITY;
                ring.tree.nearest(
                    least_m,
                    |bounds| at.distance(bounds),
                    |i, limit_m| {
                        let (a, b) = ring.edge(i);
                        least_m = limit_m.min(to_segment(p, a, b));
                        least_m
                    },
                );
                least_m
            }
            Self::Circle { middle, radius_m } => (p.distance(*middle) - radius_m).abs(),
        }
    }

    /// The distance of a path from the line, if it is at most `limit_m`.
    fn near(&self, path: &Path, limit_m: f64) -> Option<Near> {
        match self {
            Self::Ring(ring) => {
                let own = path.bounds();
                let mut found: Option<Near> = None;
                ring.tree.nearest(
                    limit_m,
                    |bounds| path.at_least(&own, bounds),
                    |i, limit_m| {
                        let (a, b) = ring.edge(i);
                        let near = path.to_segment(a, b);
                        if near.distance_m <= limit_m {
                            found = Some(near);
                            near.distance_m
                        } else {
                            limit_m
                        }
                    },
                );
                found
            }
            Self::Circle { middle, radius_m } => {
                let near = path.to_circle(*middle, *radius_m);
                (near.distance_m <= limit_m).then_some(near)
            }
        }
    }

    /// Where along a path the line is met.
    fn met(&self, path: &Path) -> Vec<f64> {
        match self {
            Self::Ring(ring) => {
                let own = path.bounds();
                let mut all = Vec::new();
                ring.tree.visit(
                    |bounds| path.at_least(&own, bounds) <= 0.0,
                    |i| {
                        let (a, b) = ring.edge(i);
                        all.extend(path.meets_segment(a, b));
                        true
                    },
                );
                all
            }
            Self::Circle { middle, radius_m } => path.meets_circle(*middle, *radius_m),
        }
    }

    /// How a path lies to the side on which nobody may fly. `None` where it is on the
    /// other side and further away than `limit_m`.
    pub(crate) fn trespass(
        &self,
        path: &Path,
        own: &Bounds,
        forbidden: Side,
        limit_m: f64,
    ) -> Option<Trespass> {
        let apart_m = own.distance(&self.bounds());
        if forbidden == Side::Inside && apart_m > limit_m {
            return None;
        }
        let length_m = path.length_m();
        let mut stops = vec![0.0, length_m];
        if apart_m <= 0.0 {
            stops.extend(self.met(path));
        }
        stops.sort_by(f64::total_cmp);
        let mut there_m = 0.0;
        let mut first_m = None;
        let mut deepest: Option<Near> = None;
        for stretch in stops.windows(2) {
            let (from_m, to_m) = (stretch[0], stretch[1]);
            // Where nothing moves at all there is one stretch, and it has no length.
            if to_m - from_m <= 0.0 && length_m > 0.0 {
                continue;
            }
            let middle = path.at(f64::midpoint(from_m, to_m));
            if self.contains(middle) != (forbidden == Side::Inside) {
                continue;
            }
            there_m += to_m - from_m;
            first_m = first_m.or(Some(from_m));
            let deep = self.farthest(path, from_m, to_m);
            if deepest.is_none_or(|d| deep.distance_m > d.distance_m) {
                deepest = Some(deep);
            }
        }
        if let Some(deep) = deepest {
            return Some(Trespass {
                clear_m: -deep.distance_m,
                along_m: deep.along_m,
                there_m,
                first_m: first_m.unwrap_or(0.0),
            });
        }
        self.near(path, limit_m).map(|near| Trespass {
            clear_m: near.distance_m,
            along_m: near.along_m,
            there_m: 0.0,
            first_m: near.along_m,
        })
    }

    /// Where a stretch of a path is farthest from the line. No distance changes by more than
    /// the way flown, so halves that cannot be farther are left alone. The halves that may
    /// be the farthest are cut first: what the limit on cuts leaves open is then no more than
    /// about a 4000th of the stretch, also where a path keeps one distance for long.
    fn farthest(&self, path: &Path, from_m: f64, to_m: f64) -> Near {
        let at = |along_m: f64| Near {
            distance_m: self.to_border(path.at(along_m)),
            along_m,
        };
        let stretch = |from_m: f64, to_m: f64| {
            let middle = at(f64::midpoint(from_m, to_m));
            Stretch {
                at_most_m: middle.distance_m + (to_m - from_m) / 2.0,
                from_m,
                to_m,
                middle,
            }
        };
        let farther = |a: Near, b: Near| {
            if b.distance_m > a.distance_m { b } else { a }
        };
        let whole = stretch(from_m, to_m);
        let mut best = farther(at(from_m), whole.middle);
        let mut open = BinaryHeap::from([whole]);
        for _ in 0..2000 {
            let Some(widest) = open.pop() else {
                break;
            };
            if widest.at_most_m <= best.distance_m + 1e-3 {
                break;
            }
            let middle_m = widest.middle.along_m;
            for half in [
                stretch(widest.from_m, middle_m),
                stretch(middle_m, widest.to_m),
            ] {
                best = farther(best, half.middle);
                open.push(half);
            }
        }
        best
    }
}

/// A stretch of a path, ordered by how far from a line it may come.
struct Stretch {
    at_most_m: f64,
    from_m: f64,
    to_m: f64,
    middle: Near,
}

impl Ord for Stretch {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.at_most_m.total_cmp(&other.at_most_m)).then(other.from_m.total_cmp(&self.from_m))
    }
}

impl PartialOrd for Stretch {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Stretch {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Stretch {}

/// A side of an outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Inside,
    Outside,
}

/// How a path lies to where nobody may fly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Trespass {
    /// The least distance, negative by how deep it is in.
    pub(crate) clear_m: f64,
    /// Where along the path that is.
    pub(crate) along_m: f64,
    /// How much of it is in.
    pub(crate) there_m: f64,
    /// Where it is in first; where it is nearest if it is not.
    pub(crate) first_m: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::Piece;
    use proptest::prelude::*;

    pub(crate) fn ring(points: &[(f64, f64)]) -> Outline {
        let points = points.iter().map(|(x, y)| Point::new(*x, *y)).collect();
        Outline::Ring(Ring::new(points).unwrap())
    }

    fn of(outline: &Outline, piece: Piece, forbidden: Side) -> Trespass {
        let path = piece.paths()[0].1;
        outline
            .trespass(&path, &path.bounds(), forbidden, f64::INFINITY)
            .unwrap()
    }

    fn line(a: (f64, f64), b: (f64, f64)) -> Piece {
        Piece::between(Point::new(a.0, a.1), Point::new(b.0, b.1), false)
    }

    #[test]
    fn a_line_through_a_square_is_in_it_for_its_width() {
        let square = ring(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]);
        let through = of(&square, line((-5.0, 4.0), (20.0, 4.0)), Side::Inside);
        assert!((through.there_m - 10.0).abs() < 1e-9 && (through.first_m - 5.0).abs() < 1e-9);
        assert!((through.clear_m + 4.0).abs() < 2e-3, "{through:?}");
        // The same square as a fence: in for 5 m and for 10 m, 10 m off at the end.
        let fence = of(&square, line((-5.0, 4.0), (20.0, 4.0)), Side::Outside);
        assert!((fence.there_m - 15.0).abs() < 1e-9 && fence.first_m.abs() < 1e-9);
        assert!((fence.clear_m + 10.0).abs() < 2e-3, "{fence:?}");
        // Along an edge it is neither in nor clear.
        let along = of(&square, line((-5.0, 10.0), (20.0, 10.0)), Side::Inside);
        assert!(along.clear_m.abs() < 1e-9, "{along:?}");
        // All of it inside.
        let within = of(&square, line((2.0, 4.0), (8.0, 4.0)), Side::Inside);
        assert!((within.there_m - 6.0).abs() < 1e-9);
        let kept = of(&square, line((2.0, 4.0), (8.0, 4.0)), Side::Outside);
        assert!((kept.clear_m - 2.0).abs() < 1e-9);
    }

    #[test]
    fn a_circle_is_a_zone_and_a_fence() {
        let circle = Outline::Circle {
            middle: Point::new(0.0, 0.0),
            radius_m: 100.0,
        };
        let beside = of(&circle, line((-200.0, 106.0), (200.0, 106.0)), Side::Inside);
        assert!((beside.clear_m - 6.0).abs() < 1e-9 && (beside.along_m - 200.0).abs() < 1e-9);
        let through = of(&circle, line((-200.0, 60.0), (200.0, 60.0)), Side::Inside);
        assert!((through.there_m - 160.0).abs() < 1e-9);
        assert!((through.clear_m + 40.0).abs() < 2e-3);
        // Round the middle at 70 m: 30 m from the fence all the way.
        let round = Piece {
            start: Point::new(70.0, 0.0),
            heading_rad: core::f64::consts::FRAC_PI_2,
            length_m: 400.0,
            radius_m: Some(-70.0),
            sees: false,
        };
        assert!((of(&circle, round, Side::Outside).clear_m - 30.0).abs() < 1e-9);
    }

    #[test]
    fn rings_that_are_none_are_refused() {
        let bad = |points: &[(f64, f64)]| {
            let points = points.iter().map(|(x, y)| Point::new(*x, *y)).collect();
            Ring::new(points).unwrap_err()
        };
        let bow = [(0.0, 0.0), (10.0, 10.0), (10.0, 0.0), (0.0, 10.0)];
        assert!(matches!(
            bad(&bow),
            RingError::NoArea | RingError::Crossing(1, 3)
        ));
        let pentagram: Vec<(f64, f64)> = (0..5)
            .map(|i| libm::sincos(f64::from(i * 2) * 72.0_f64.to_radians()))
            .collect();
        assert!(matches!(bad(&pentagram), RingError::Crossing(..)));
        assert_eq!(bad(&[]), RingError::Corners(0));
        assert_eq!(
            bad(&[(0.0, 0.0), (0.0, 0.0), (1.0, 1.0)]),
            RingError::Corners(2)
        );
        assert_eq!(
            bad(&[(0.0, 0.0), (5.0, 5.0), (9.0, 9.0)]),
            RingError::NoArea
        );
        assert_eq!(
            bad(&[(0.0, f64::NAN), (5.0, 5.0), (9.0, 9.0)]),
            RingError::NotFinite(1)
        );
    }

    proptest! {
        #[test]
        fn where_a_path_is_agrees_with_dense_samples(
            start in (-80.0..80.0f64, -80.0..80.0f64),
            heading in -4.0..4.0f64,
            length in 1.0..300.0f64,
            radius in prop_oneof![Just(None), (20.0..200.0f64).prop_map(Some), (-200.0..-20.0f64).prop_map(Some)],
            spokes in prop::collection::vec(10.0..60.0f64, 3..20),
        ) {
            // A star-shaped ring round the origin.
            let n = spokes.len();
            let star: Vec<(f64, f64)> = spokes.iter().enumerate().map(|(i, r)| {
                let (s, c) = libm::sincos(i as f64 * core::f64::consts::TAU / n as f64);
                (r * c, r * s)
            }).collect();
            let star = ring(&star);
            let piece = Piece { start: Point::new(start.0, start.1), heading_rad: heading, length_m: length, radius_m: radius, sees: false };
            let samples = 4000;
            let step = length / f64::from(samples);
            for side in [Side::Inside, Side::Outside] {
                let (mut there, mut clear) = (0.0, f64::INFINITY);
                for i in 0..samples {
                    let p = piece.at(step * (f64::from(i) + 0.5));
                    let into = star.contains(p) == (side == Side::Inside);
                    there += if into { step } else { 0.0 };
                    let off = star.to_border(p);
                    clear = f64::min(clear, if into { -off } else { off });
                }
                let (mut sum, mut least) = (0.0, f64::INFINITY);
                for (_, path) in piece.paths() {
                    let found = star.trespass(&path, &path.bounds(), side, f64::INFINITY).unwrap();
                    sum += found.there_m;
                    least = f64::min(least, found.clear_m);
                }
                prop_assert!((sum - there).abs() < 40.0 * step, "{side:?} {sum} {there}");
                prop_assert!((least - clear).abs() < step + 2e-3, "{side:?} {least} {clear}");
            }
        }
    }
}
