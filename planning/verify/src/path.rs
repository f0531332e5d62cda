//! Lines and arcs as pieces of a flight, and their exact distances from lines and circles.

use crate::boxes::Bounds;
use crate::plane::Point;
use core::f64::consts::{FRAC_PI_2, PI};
use libm::{acos, atan2, cos, sin, sqrt};

const TURN: f64 = 2.0 * PI;

/// Arcs of larger radius are flown as chords: their centre would have no digits left.
const WIDEST_ARC_M: f64 = 1e10;

/// How far chords of such arcs may be off, metres.
const CHORD_M: f64 = 1e-5;

/// The most whole turns of one piece.
pub const MOST_TURNS: f64 = 20.0;

/// The longest piece, metres: no flight of a mission of 20 km is longer.
pub const LONGEST_M: f64 = 1e7;

/// The least and the largest radius of an arc, metres.
pub const RADII_M: (f64, f64) = (1e-3, 1e15);

/// The largest coordinate, metres.
const FARTHEST_M: f64 = 1e6;

/// A piece of a flight, in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Where it begins.
    pub start: Point,
    /// Course at its beginning, radians counter-clockwise from east.
    pub heading_rad: f64,
    /// Its length, metres.
    pub length_m: f64,
    /// Radius of its arc, positive for a right turn; `None` for a straight line.
    pub radius_m: Option<f64>,
    /// Whether the camera works on it.
    pub sees: bool,
}

impl Piece {
    /// A straight line between two points.
    #[must_use]
    pub fn between(a: Point, b: Point, sees: bool) -> Self {
        let way = b.minus(a);
        Self {
            start: a,
            heading_rad: atan2(way.y, way.x),
            length_m: way.norm(),
            radius_m: None,
            sees,
        }
    }

    /// Why it cannot be measured, if so.
    #[must_use]
    pub fn problem(&self) -> Option<String> {
        let within = |x: f64, most: f64| x.abs() <= most;
        if !(within(self.start.x, FARTHEST_M) && within(self.start.y, FARTHEST_M)) {
            return Some("it begins at no point of the plane".to_owned());
        }
        if !within(self.heading_rad, 1e6) {
            return Some(format!("{} is no heading", self.heading_rad));
        }
        if !(0.0..=LONGEST_M).contains(&self.length_m) {
            return Some(format!("{} m is no length", self.length_m));
        }
        let r = self.radius_m?.abs();
        if !(RADII_M.0..=RADII_M.1).contains(&r) {
            return Some(format!("{r} m is no radius"));
        }
        (self.length_m / r > MOST_TURNS * TURN).then(|| {
            format!(
                "{} m round a radius of {r} m are more than {MOST_TURNS} turns",
                self.length_m
            )
        })
    }

    /// How far it turns to the left in all, radians.
    #[must_use]
    pub fn turned_rad(&self) -> f64 {
        self.radius_m.map_or(0.0, |r| -self.length_m / r)
    }

    /// Where it is after so many metres.
    #[must_use]
    pub fn at(&self, s_m: f64) -> Point {
        let half = self.radius_m.map_or(0.0, |r| -s_m / r) / 2.0;
        // The chord of an arc; a form without the centre loses nothing on wide arcs.
        let chord_m = if half.abs() < 1e-9 {
            s_m
        } else {
            s_m * sin(half) / half
        };
        let course = self.heading_rad + half;
        self.start
            .plus(Point::new(cos(course), sin(course)), chord_m)
    }

    /// Where it ends.
    #[must_use]
    pub fn end(&self) -> Point {
        self.at(self.length_m)
    }

    /// Course at its end, radians counter-clockwise from east.
    #[must_use]
    pub fn end_heading_rad(&self) -> f64 {
        self.heading_rad + self.turned_rad()
    }

    /// The lines and arcs of at most one turn that it consists of, and where each begins
    /// along it.
    pub(crate) fn paths(&self) -> Vec<(f64, Path)> {
        let pieces = match self.radius_m {
            None => 1.0,
            Some(r) if r.abs() > WIDEST_ARC_M => (self.length_m / sqrt(8.0 * r.abs() * CHORD_M))
                .ceil()
                .max(1.0),
            Some(_) => (self.turned_rad().abs() / TURN)
                .ceil()
                .clamp(1.0, MOST_TURNS),
        };
        let step_m = self.length_m / pieces;
        let mut out = Vec::new();
        let mut k = 0.0;
        while k < pieces {
            let from_m = k * step_m;
            let path = match self.radius_m {
                Some(r) if r.abs() <= WIDEST_ARC_M => {
                    Path::arc(self.at(from_m), self.heading_rad - from_m / r, step_m, r)
                }
                _ => Path::line(self.at(from_m), self.at(from_m + step_m)),
            };
            out.push((from_m, path));
            k += 1.0;
        }
        out
    }
}

/// A line or an arc of at most one turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Path {
    /// From one point to another.
    Line { a: Point, b: Point },
    /// Round a centre, `sweep_rad` counter-clockwise from the direction `from_rad`.
    Arc {
        centre: Point,
        radius_m: f64,
        from_rad: f64,
        sweep_rad: f64,
    },
}

/// A distance, and how far along the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Near {
    pub(crate) distance_m: f64,
    pub(crate) along_m: f64,
}

impl Near {
    fn least(self, distance_m: f64, along_m: f64) -> Self {
        if distance_m < self.distance_m {
            Self {
                distance_m,
                along_m,
            }
        } else {
            self
        }
    }
}

/// Where on a segment a point is nearest to, from 0 at `a` to 1 at `b`.
fn foot(p: Point, a: Point, b: Point) -> f64 {
    let way = b.minus(a);
    let len2 = way.dot(way);
    if len2 > 0.0 {
        (p.minus(a).dot(way) / len2).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// How far a point is from a segment.
pub(crate) fn to_segment(p: Point, a: Point, b: Point) -> f64 {
    p.distance(a.plus(b.minus(a), foot(p, a, b)))
}

/// Where two segments cross, as shares of both.
fn crossing(a: Point, b: Point, c: Point, d: Point) -> Option<(f64, f64)> {
    let (u, v, w) = (b.minus(a), d.minus(c), c.minus(a));
    let across = u.cross(v);
    if across.abs() <= f64::MIN_POSITIVE {
        return None;
    }
    let (s, t) = (w.cross(v) / across, w.cross(u) / across);
    let within = |x: f64| (0.0..=1.0).contains(&x);
    (within(s) && within(t)).then_some((s, t))
}

impl Path {
    pub(crate) fn line(a: Point, b: Point) -> Self {
        Self::Line { a, b }
    }

    fn arc(start: Point, heading_rad: f64, length_m: f64, radius_m: f64) -> Self {
        // The centre is to the right of the course where the radius is positive.
        let side = if radius_m > 0.0 { -1.0 } else { 1.0 };
        let to_centre = heading_rad + side * FRAC_PI_2;
        let radius_m = radius_m.abs();
        Self::Arc {
            centre: start.plus(Point::new(cos(to_centre), sin(to_centre)), radius_m),
            radius_m,
            from_rad: to_centre + PI,
            sweep_rad: side * (length_m / radius_m).min(TURN),
        }
    }

    pub(crate) fn length_m(&self) -> f64 {
        match *self {
            Self::Line { a, b } => a.distance(b),
            Self::Arc {
                radius_m,
                sweep_rad,
                ..
            } => radius_m * sweep_rad.abs(),
        }
    }

    /// Where it is after so many metres.
    pub(crate) fn at(&self, s_m: f64) -> Point {
        match *self {
            Self::Line { a, b } => {
                let length_m = a.distance(b);
                let share = if length_m > 0.0 { s_m / length_m } else { 0.0 };
                a.plus(b.minus(a), share)
            }
            Self::Arc {
                centre,
                radius_m,
                from_rad,
                sweep_rad,
            } => {
                let at = from_rad + s_m / radius_m * sweep_rad.signum();
                centre.plus(Point::new(cos(at), sin(at)), radius_m)
            }
        }
    }

    /// How far along an arc a direction from its centre lies, if it is on it.
    fn along_m(&self, direction_rad: f64) -> Option<f64> {
        let Self::Arc {
            radius_m,
            from_rad,
            sweep_rad,
            ..
        } = *self
        else {
            return None;
        };
        let turned = ((direction_rad - from_rad) * sweep_rad.signum()).rem_euclid(TURN);
        (turned <= sweep_rad.abs()).then_some(turned * radius_m)
    }

    /// The box around it.
    pub(crate) fn bounds(&self) -> Bounds {
        match *self {
            Self::Line { a, b } => Bounds::of(&[a, b]),
            Self::Arc {
                centre, radius_m, ..
            } => {
                let mut all = Bounds::of(&[self.at(0.0), self.at(self.length_m())]);
                let compass = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)];
                for (x, y) in compass {
                    if self.along_m(atan2(y, x)).is_some() {
                        all.add(centre.plus(Point::new(x, y), radius_m));
                    }
                }
                all
            }
        }
    }

    /// No point of a box is nearer to it than this.
    pub(crate) fn at_least(&self, own: &Bounds, other: &Bounds) -> f64 {
        let apart = own.distance(other);
        let beside = match *self {
            Self::Line { a, b } => {
                let way = b.minus(a);
                let length_m = way.norm();
                if length_m > 0.0 {
                    let side = |p: Point| way.cross(p.minus(a)) / length_m;
                    let sides = other.corners().map(side);
                    let low = sides.iter().copied().fold(f64::INFINITY, f64::min);
                    let high = sides.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    low.max(-high)
                } else {
                    0.0
                }
            }
            Self::Arc {
                centre, radius_m, ..
            } => {
                let here = Bounds::of(&[centre]);
                let corners = other.corners().map(|p| p.distance(centre));
                let far = corners.into_iter().fold(0.0, f64::max);
                (here.distance(other) - radius_m).max(radius_m - far)
            }
        };
        // A micrometre for rounding.
        (apart.max(beside) - 1e-6).max(0.0)
    }

    /// Its distance from a segment, exactly.
    pub(crate) fn to_segment(self, c: Point, d: Point) -> Near {
        let length_m = self.length_m();
        let start = Near {
            distance_m: to_segment(self.at(0.0), c, d),
            along_m: 0.0,
        };
        let mut near = start.least(to_segment(self.at(length_m), c, d), length_m);
        match self {
            Self::Line { a, b } => {
                if let Some((s, _)) = crossing(a, b, c, d) {
                    return near.least(0.0, s * length_m);
                }
                for p in [c, d] {
                    let share = foot(p, a, b);
                    near = near.least(p.distance(a.plus(b.minus(a), share)), share * length_m);
                }
            }
            Self::Arc {
                centre, radius_m, ..
            } => {
                for along_m in self.meets_segment(c, d) {
                    near = near.least(0.0, along_m);
                }
                // Both ends of the segment, and its point nearest to the centre: from
                // there the shortest way leads along the radius.
                for p in [c, d, c.plus(d.minus(c), foot(centre, c, d))] {
                    let out = p.minus(centre);
                    if let Some(along_m) = self.along_m(atan2(out.y, out.x)) {
                        near = near.least((out.norm() - radius_m).abs(), along_m);
                    }
                }
            }
        }
        near
    }

    /// Where along it a segment is met.
    pub(crate) fn meets_segment(&self, c: Point, d: Point) -> Vec<f64> {
        match *self {
            Self::Line { a, b } => {
                let met = crossing(a, b, c, d);
                met.map(|(s, _)| s * a.distance(b)).into_iter().collect()
            }
            Self::Arc {
                centre, radius_m, ..
            } => {
                let way = d.minus(c);
                let length_m = way.norm();
                if length_m <= 0.0 {
                    return Vec::new();
                }
                let unit = Point::new(way.x / length_m, way.y / length_m);
                let middle_m = centre.minus(c).dot(unit);
                let off_m = centre.minus(c).cross(unit);
                let half2 = (radius_m - off_m) * (radius_m + off_m);
                if half2 < 0.0 {
                    return Vec::new();
                }
                let half_m = sqrt(half2);
                let on = [middle_m - half_m, middle_m + half_m].into_iter();
                on.filter(|t| (0.0..=length_m).contains(t))
                    .filter_map(|t| {
                        let out = c.plus(unit, t).minus(centre);
                        self.along_m(atan2(out.y, out.x))
                    })
                    .collect()
            }
        }
    }

    /// Where along it a circle is met.
    pub(crate) fn meets_circle(&self, middle: Point, circle_m: f64) -> Vec<f64> {
        match *self {
            Self::Line { a, b } => {
                let length_m = a.distance(b);
                if length_m <= 0.0 {
                    return Vec::new();
                }
                let unit = Point::new((b.x - a.x) / length_m, (b.y - a.y) / length_m);
                let (t, off) = (middle.minus(a).dot(unit), middle.minus(a).cross(unit));
                let half2 = (circle_m - off) * (circle_m + off);
                if half2 < 0.0 {
                    return Vec::new();
                }
                let on = [t - sqrt(half2), t + sqrt(half2)].into_iter();
                on.filter(|t| (0.0..=length_m).contains(t)).collect()
            }
            Self::Arc {
                centre, radius_m, ..
            } => {
                let way = middle.minus(centre);
                let apart_m = way.norm();
                let c = (radius_m * radius_m + apart_m * apart_m - circle_m * circle_m)
                    / (2.0 * radius_m * apart_m);
                if !(-1.0..=1.0).contains(&c) {
                    return Vec::new();
                }
                let (to, half) = (atan2(way.y, way.x), acos(c));
                let on = [to - half, to + half].into_iter();
                on.filter_map(|a| self.along_m(a)).collect()
            }
        }
    }

    /// Its distance from a circle's line, exactly.
    pub(crate) fn to_circle(self, middle: Point, circle_m: f64) -> Near {
        let off = |along_m: f64| (self.at(along_m).distance(middle) - circle_m).abs();
        let mut near = Near {
            distance_m: off(0.0),
            along_m: 0.0,
        };
        near = near.least(off(self.length_m()), self.length_m());
        for along_m in self.meets_circle(middle, circle_m) {
            near = near.least(0.0, along_m);
        }
        let turning = match self {
            Self::Line { a, b } => vec![foot(middle, a, b) * self.length_m()],
            Self::Arc { centre, .. } => {
                let way = middle.minus(centre);
                let to = atan2(way.y, way.x);
                let both = [to, to + PI].into_iter();
                both.filter_map(|a| self.along_m(a)).collect()
            }
        };
        for along_m in turning {
            near = near.least(off(along_m), along_m);
        }
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn piece(x: f64, y: f64, heading_rad: f64, length_m: f64, radius_m: Option<f64>) -> Piece {
        Piece {
            start: Point::new(x, y),
            heading_rad,
            length_m,
            radius_m,
            sees: false,
        }
    }

    #[test]
    fn a_right_turn_has_a_positive_radius() {
        let quarter = piece(0.0, 0.0, FRAC_PI_2, 50.0 * FRAC_PI_2, Some(50.0));
        assert!(quarter.end().distance(Point::new(50.0, 50.0)) < 1e-9);
        assert!(quarter.end_heading_rad().abs() < 1e-12);
        let left = piece(0.0, 0.0, FRAC_PI_2, 50.0 * FRAC_PI_2, Some(-50.0));
        assert!(left.end().distance(Point::new(-50.0, 50.0)) < 1e-9);
    }

    #[test]
    fn an_arc_grazes_a_corner() {
        // Half a turn to the left round the origin, from (50, 0) over (0, 50).
        let arc = piece(50.0, 0.0, FRAC_PI_2, 50.0 * PI, Some(-50.0)).paths()[0].1;
        // A corner that points at it from above, 3 m away at its highest place.
        let corner = Point::new(0.0, 53.0);
        for far in [Point::new(30.0, 90.0), Point::new(-30.0, 90.0)] {
            let near = arc.to_segment(corner, far);
            assert!((near.distance_m - 3.0).abs() < 1e-12, "{near:?}");
            assert!((near.along_m - 25.0 * PI).abs() < 1e-9);
        }
        // The other half does not come there.
        let other = piece(-50.0, 0.0, -FRAC_PI_2, 50.0 * PI, Some(-50.0)).paths()[0].1;
        assert!(other.to_segment(corner, Point::new(30.0, 90.0)).distance_m > 50.0);
    }

    #[test]
    fn wide_and_many_arcs_are_flown_in_parts() {
        let wide = piece(0.0, 0.0, 0.0, 20_000.0, Some(1e13));
        assert!(
            wide.paths()
                .iter()
                .all(|(_, p)| matches!(p, Path::Line { .. }))
        );
        let (from, last) = *wide.paths().last().unwrap();
        assert!(last.at(wide.length_m - from).distance(wide.end()) < 1e-6);
        let many = piece(0.0, 0.0, 0.0, 3.5 * TURN * 40.0, Some(-40.0));
        assert_eq!(many.paths().len(), 4);
        for (from, path) in many.paths() {
            let gap = path.at(0.0).distance(many.at(from));
            assert!(gap < 1e-9, "{gap}");
        }
    }

    proptest! {
        #[test]
        fn exact_distances_are_those_of_dense_samples(
            start in (-80.0..80.0f64, -80.0..80.0f64),
            heading in -4.0..4.0f64,
            length in 0.0..300.0f64,
            radius in prop_oneof![Just(None), (5.0..200.0f64).prop_map(Some), (-200.0..-5.0f64).prop_map(Some)],
            c in (-100.0..100.0f64, -100.0..100.0f64),
            d in (-100.0..100.0f64, -100.0..100.0f64),
            circle in 1.0..120.0f64,
        ) {
            let piece = piece(start.0, start.1, heading, length, radius);
            let (c, d) = (Point::new(c.0, c.1), Point::new(d.0, d.1));
            let n = 3000;
            let step = length / f64::from(n);
            let (mut line, mut ring) = (f64::INFINITY, f64::INFINITY);
            let mut box_least = f64::INFINITY;
            let other = Bounds::of(&[c, d]);
            for i in 0..=n {
                let p = piece.at(step * f64::from(i));
                line = line.min(to_segment(p, c, d));
                ring = ring.min((p.distance(c) - circle).abs());
                box_least = box_least.min(Bounds::of(&[p]).distance(&other));
            }
            let (mut to_line, mut to_ring, mut bound) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
            for (from, path) in piece.paths() {
                let near = path.to_segment(c, d);
                prop_assert!((to_segment(piece.at(from + near.along_m), c, d) - near.distance_m).abs() < 1e-6);
                to_line = to_line.min(near.distance_m);
                to_ring = to_ring.min(path.to_circle(c, circle).distance_m);
                bound = bound.min(path.at_least(&path.bounds(), &other));
            }
            prop_assert!(to_line <= line + 1e-9 && line <= to_line + step + 1e-9, "{to_line} {line}");
            prop_assert!(to_ring <= ring + 1e-9 && ring <= to_ring + step + 1e-9, "{to_ring} {ring}");
            prop_assert!(bound <= box_least + 1e-9, "{bound} {box_least}");
        }
    }
}
