//! Where a UAV may be when it sees a piece whole: poses from which the frame holds it,
//! with a straight before and after, clear of the zones (D2.7 §3.3).
//!
//! Left to others: which of them is flown ([`super::chain`]).

use super::StationsProblem;
use super::targets::along;
use crate::coverage::ring::patch::{Corners, frame_holds, middle};
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{TAU, sin_cos, wrap_pi};

/// Headings offered at each piece.
const HEADINGS: u8 = 16;

/// Poses offered for a piece beside a zone, the nearest to its middle first.
const MOST: usize = 24;

/// The camera must see the piece for this long around the pose, metres of flight.
const SLACK_M: f64 = 2.0;

/// The straight before and after the pose, metres: a third of a second of flight to
/// level the wings.
const RUN_M: f64 = 5.0;

/// How finely places beside the middle of a piece are sampled where a zone is near.
const STEP_M: f64 = 4.0;
const FINE_HEADINGS: u8 = 48;

/// The poses at which station `n` may be seen.
///
/// # Errors
/// A clause that says why there is none.
pub(super) fn stands(problem: &StationsProblem<'_>, n: usize) -> Result<Vec<Pose>, &'static str> {
    let station = &problem.stations[n];
    let at = middle(station);
    let lens = Lens::of(problem);
    // Along the piece and all round from there: a straight road is flown straight.
    let plain = all_round(HEADINGS).map(|h| Pose::new(at, wrap_pi(along(station) + h)));
    let clear: Vec<Pose> = plain
        .filter(|&pose| lens.holds(station, pose) && problem.flown.flyable(&run(pose)))
        .collect();
    if !clear.is_empty() {
        return Ok(clear);
    }
    let beside = beside(problem, station, &lens);
    if beside.is_empty() {
        let inside = |p: &Point| problem.flown.zones.distance_m(*p) <= 0.0;
        return Err(if station.iter().all(inside) {
            "inside a no-fly zone"
        } else if lens.ever_holds(station) {
            "no straight pass that sees all of it keeps clear of the no-fly zones"
        } else {
            "larger than what one frame of the camera holds"
        });
    }
    Ok(beside)
}

fn all_round(headings: u8) -> impl Iterator<Item = f64> {
    (0..headings).map(move |i| TAU * f64::from(i) / f64::from(headings))
}

/// Poses around the middle of the piece, the nearest first.
fn beside(problem: &StationsProblem<'_>, station: &Corners, lens: &Lens) -> Vec<Pose> {
    let at = middle(station);
    let mut found: Vec<(f64, Pose)> = Vec::new();
    for h in all_round(FINE_HEADINGS) {
        let (s, c) = sin_cos(h);
        let (forward, left) = (Vector::new(c, s), Vector::new(-s, c));
        for a in offsets(lens.across_m) {
            for b in offsets(lens.along_m) {
                let pose = Pose::new(at + left * a + forward * b, h);
                if lens.holds(station, pose)
                    && problem.flown.zones.distance_m(pose.position()) >= problem.flown.clearance_m
                {
                    found.push((a.abs() + b.abs(), pose));
                }
            }
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let found = || found.iter().map(|(_, pose)| *pose);
    let flyable = |pose: &Pose| problem.flown.flyable(&run(*pose));
    let mut poses: Vec<Pose> = found().filter(flyable).take(MOST).collect();
    if poses.len() == MOST && !poses.iter().any(|pose| has_room(problem, *pose)) {
        // The nearest all lie where nobody can turn: half of them for such that do not.
        poses.truncate(MOST / 2);
        let roomy = found().filter(|pose| has_room(problem, *pose));
        poses.extend(roomy.filter(flyable).take(MOST - MOST / 2));
    }
    poses
}

/// Whether a UAV can come from a circle and leave on one: the straight half a lane before the pose
/// and after is clear, and at each of its ends a circle on one side.
fn has_room(problem: &StationsProblem<'_>, pose: Pose) -> bool {
    let flown = problem.flown;
    let (r, half_m) = (flown.turn_radius_m, flown.lane_spacing_m / 2.0);
    let (at, ahead) = (pose.position(), pose.direction());
    let left = Vector::new(-ahead.y, ahead.x);
    let is_circled = |end: Point| {
        let sides = [left, -left].map(|side| flown.zones.distance_m(end + side * r));
        sides.iter().any(|m| *m >= r + flown.clearance_m)
    };
    [at - ahead * half_m, at + ahead * half_m]
        .iter()
        .all(|end| is_circled(*end))
        && flown
            .zones
            .is_clear(&straight(pose, half_m), flown.clearance_m)
}

/// Zero, and both sides outwards in steps up to the limit.
fn offsets(limit_m: f64) -> Vec<f64> {
    let mut all = vec![0.0];
    let mut at = STEP_M;
    while at < limit_m {
        all.extend([at, -at]);
        at += STEP_M;
    }
    all
}

/// Half a frame, less what a UAV strays.
struct Lens {
    across_m: f64,
    along_m: f64,
}

impl Lens {
    fn of(p: &StationsProblem<'_>) -> Self {
        Self {
            across_m: p.flown.footprint_across_m - p.flown.tracking_error_m,
            along_m: p.flown.footprint_along_m - p.flown.tracking_error_m - SLACK_M,
        }
    }

    fn holds(&self, station: &Corners, pose: Pose) -> bool {
        frame_holds(station, pose, self.across_m, self.along_m)
    }

    /// Whether the frame holds the piece at any heading, zones aside.
    fn ever_holds(&self, station: &Corners) -> bool {
        let at = middle(station);
        all_round(FINE_HEADINGS).any(|h| self.holds(station, Pose::new(at, h)))
    }
}

/// The short straight through a pose.
pub(super) fn run(pose: Pose) -> Curve {
    straight(pose, RUN_M)
}

/// The straight so far before a pose and after it.
fn straight(pose: Pose, half_m: f64) -> Curve {
    let start = Pose::new(
        pose.position() - pose.direction() * half_m,
        pose.heading_rad,
    );
    Curve::from_pieces(start, &[(0.0, 2.0 * half_m)])
}
