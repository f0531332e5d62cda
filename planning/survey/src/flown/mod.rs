//! What a UAV flies from its start over stops in a given order and back: lines and arcs
//! that join without a bend and keep clear of zones and fences all along (D2.7 §2.3, §2.4).
//!
//! | file | what it holds |
//! |---|---|
//! | `airspace` | zones, and fences turned inside out, as one kind of zones |
//! | `chain` | which way each stop is flown, and the curves between them |
//! | `cycle` | stops flown round and round |
//! | `ends` | how far a straight pass may reach before a wall |
//! | `polyline` | a line with corners as stretches that can be flown |
//!
//! Every curve comes from [`skein_flight::route::Router`], by which the swarm flies too: a
//! turn is to either side, in a bulb or after a longer run-out, whichever is shortest and
//! proved clear. A stop that no such curve leads to is left out and told. Leaves to others
//! which stops there are, in which order, and who flies them.

mod airspace;
mod chain;
mod cycle;
mod ends;
mod polyline;
#[cfg(test)]
mod tests;

use crate::flight::Leg;
pub use airspace::{Airspace, AirspaceError};
pub use chain::{Node, fly, fly_to};
pub use cycle::{Cycle, fly_round};
pub use ends::{Fineness, clear_ahead_m, turnable, turnable_by};
pub use polyline::stretches;
use skein_flight::trajectory::Trajectory;
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{FRAC_PI_2, PI, TAU};
use skein_geometry::{Curve, Segment};

/// Courses over a point that are compared: every 22.5°.
const COURSES: u8 = 16;

/// What is flown straight over a point, metres.
const OVER_M: f64 = 1.0;

/// A run-out is left out only if that is shorter by so many times its length.
const RUN_OUT_WORTH: f64 = 20.0;

/// Arcs become chords of at most this turn in a track of points, radians.
const CHORD_RAD: f64 = FRAC_PI_2 / 6.0;

/// Something to be flown over.
#[derive(Clone, Debug)]
pub struct Stop {
    /// The ways in which it may be flown, the wanted one first.
    pub stands: Vec<Stand>,
    /// Whether the camera works on it.
    pub sees: bool,
}

/// One way of flying over a stop.
#[derive(Clone, Debug)]
pub struct Stand {
    /// Where it begins.
    pub from: Pose,
    /// Where it ends.
    pub to: Pose,
    /// What lies between.
    pub curve: Curve,
    /// What of it is not seen from at its beginning and its end, metres.
    pub unseen_m: (f64, f64),
    /// It is flown only if that is shorter by more than this, metres.
    pub dearer_m: f64,
}

impl Stand {
    /// A curve as it is; `None` for one of no length.
    pub fn along(curve: Curve) -> Option<Self> {
        let (from, to) = curve.start().zip(curve.end())?;
        Some(Self {
            from,
            to,
            curve,
            unseen_m: (0.0, 0.0),
            dearer_m: 0.0,
        })
    }

    fn reversed(&self) -> Self {
        Self {
            from: self.to.reversed(),
            to: self.from.reversed(),
            curve: self.curve.reversed(),
            unseen_m: (self.unseen_m.1, self.unseen_m.0),
            dearer_m: self.dearer_m,
        }
    }

    /// Its curve in parts, each with whether it is seen from; what is not seen from is
    /// straight.
    fn parts(&self) -> [(Curve, bool); 3] {
        let (first_m, last_m) = self.unseen_m;
        let (from, to) = (self.from, self.to);
        let seen_from = from.position() + from.direction() * first_m;
        let seen_to = to.position() - to.direction() * last_m;
        let seen = if first_m + last_m > 0.0 {
            straight(seen_from, seen_to)
        } else {
            self.curve.clone()
        };
        [
            (straight(from.position(), seen_from), false),
            (seen, true),
            (straight(seen_to, to.position()), false),
        ]
    }
}

impl Stop {
    /// A curve to be seen from, in this direction rather than the other.
    pub fn along(curve: Curve) -> Option<Self> {
        let stand = Stand::along(curve)?;
        let back = stand.reversed();
        Some(Self {
            stands: vec![stand, back],
            sees: true,
        })
    }

    /// A straight line to be seen from that runs out so far at its beginning and its end;
    /// without that where nothing else can be flown.
    pub fn run_out((from, to): (Point, Point), unseen_m: (f64, f64)) -> Option<Self> {
        let mut stop = Self::along(straight(from, to))?;
        let (first_m, last_m) = unseen_m;
        if first_m + last_m <= 0.0 {
            return Some(stop);
        }
        let ahead = stop.stands[0].from.direction();
        let longer = straight(from - ahead * first_m, to + ahead * last_m);
        let stand = Stand {
            unseen_m,
            ..Stand::along(longer)?
        };
        for plain in &mut stop.stands {
            plain.dearer_m = RUN_OUT_WORTH * (first_m + last_m);
        }
        let back = stand.reversed();
        stop.stands.splice(0..0, [stand, back]);
        Some(stop)
    }

    /// A point to be flown over straight, on any course.
    pub fn over(point: Point) -> Self {
        let stands = (0..COURSES).filter_map(|i| {
            let course_rad = TAU * f64::from(i) / f64::from(COURSES) - PI;
            let half = Pose::new(point, course_rad).direction() * (OVER_M / 2.0);
            Stand::along(straight(point - half, point + half))
        });
        Self {
            stands: stands.collect(),
            sees: true,
        }
    }
}

/// A straight line as a curve; empty where both ends are the same.
pub fn straight(from: Point, to: Point) -> Curve {
    let mut curve = Curve::empty();
    let line = Segment::straight(from, to);
    if line.length_m > 0.0 {
        curve.push(line);
    }
    curve
}

/// The air that a UAV flies through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Airspeed, m/s.
    pub airspeed_mps: f64,
    /// The wind, where it blows to, m/s.
    pub wind_mps: Vector,
}

impl Air {
    /// What a turn radius through the air becomes over the ground where the wind is from
    /// behind, metres.
    pub fn ground_radius_m(&self, turn_radius_m: f64) -> f64 {
        let faster = 1.0 + self.wind_mps.norm() / self.airspeed_mps;
        turn_radius_m * faster * faster
    }

    /// How long a curve takes, seconds; infinite where the wind is too strong.
    pub fn time_s(&self, curve: &Curve) -> f64 {
        if self.wind_mps.norm() <= 0.0 {
            return curve.length_m() / self.airspeed_mps;
        }
        let wind = Wind::new(self.wind_mps.x, self.wind_mps.y);
        Trajectory::along(curve, self.airspeed_mps, wind).map_or(f64::INFINITY, |t| t.duration_s())
    }
}

/// One UAV's flight over its stops.
#[derive(Clone, Debug, Default)]
pub struct Flown {
    /// What is flown, from the start and back; empty where no stop is.
    pub legs: Vec<Leg>,
    /// The stops that are flown in order, each with the number of its stand.
    pub order: Vec<(usize, usize)>,
    /// The stops that no curve leads to or back from.
    pub left: Vec<usize>,
    /// The ways that were looked for between stops, each with its stand, none for the
    /// start; and how long they are where they are there, metres.
    pub ways: Vec<(Node, Node, Option<f64>)>,
    /// What it took to find them, in ways that nothing is in the way of.
    pub work: u64,
}

impl Flown {
    /// Length over the ground, metres.
    pub fn length_m(&self) -> f64 {
        length_m(&self.legs)
    }

    /// The distance through the air while it is flown, metres: what it takes times the
    /// airspeed.
    pub fn air_m(&self, air: &Air) -> f64 {
        time_s(&self.legs, air) * air.airspeed_mps
    }

    /// Its points: the ends of all pieces, and of arcs enough that chords stand for them.
    pub fn track(&self, start: Point) -> Vec<Point> {
        track(&self.legs, start)
    }
}

/// Length of legs over the ground, metres.
pub fn length_m(legs: &[Leg]) -> f64 {
    legs.iter().map(|leg| leg.curve.length_m()).sum()
}

/// How long legs take, seconds; infinite where the wind is too strong.
pub fn time_s(legs: &[Leg], air: &Air) -> f64 {
    if air.wind_mps.norm() <= 0.0 {
        return length_m(legs) / air.airspeed_mps;
    }
    legs.iter().map(|leg| air.time_s(&leg.curve)).sum()
}

/// The points of legs: the ends of all pieces, and of arcs enough that chords stand for
/// them.
pub fn track(legs: &[Leg], start: Point) -> Vec<Point> {
    let mut track = vec![start];
    for s in legs.iter().flat_map(|l| l.curve.segments()) {
        let chords = (s.length_m * s.curvature_per_m.abs() / CHORD_RAD).ceil();
        let mut i = 1.0;
        while i <= chords.max(1.0) {
            let at_m = s.length_m * i / chords.max(1.0);
            track.push(s.pose_at(at_m).position());
            i += 1.0;
        }
    }
    track
}
