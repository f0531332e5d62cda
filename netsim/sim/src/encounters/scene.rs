//! Scenes: who begins where, and wants to go where.

use super::{all_apart, beside};
use skein_flight::airframe::{Airframe, CLIMB_MPS};
use skein_flight::mount::Mount;
use skein_flight::separation::motion::{heading_e7, to_mm, to_signed_mm};
use skein_flight::separation::{Detours, End, Motion, MotionPlan, Stretch};
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::TAU;
use skein_geometry::random::SplitMix64;
use skein_peer::PeerId;

/// Straight flight that everybody has agreed on before the scene begins, seconds; the
/// first of these that leaves room for all loiters.
const AGREED_S: [f64; 5] = [10.0, 7.5, 5.0, 2.5, 0.0];

/// After this long an error of place at the beginning is caught up, milliseconds: four time
/// constants.
pub(super) const SETTLED_MS: u64 = 8_000;

/// Radius of the circle of the reference figures, metres.
const CIRCLE_M: f64 = 600.0;

/// Bank limit of the reference figures, radians: 30 degrees.
const BANK_RAD: f64 = TAU / 12.0;

/// Who flies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// So many on a circle, each to the opposite side, 20 m/s.
    Circle(u16),
    /// Two whose straight ways bring them within two separations of each other somewhere on
    /// the way, from any side, each 16 to 24 m/s.
    Pair,
}

/// How one UAV begins.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Begin {
    pub id: PeerId,
    pub airframe: Airframe,
    /// Where it is: up to a metre beside what it has promised.
    pub pose: Pose,
    pub motion: Motion,
    pub goal: Point,
    /// Flying time of the direct way at cruise, seconds.
    pub direct_s: f64,
}

impl Scene {
    /// The fastest airframe that may fly in it.
    pub(super) fn fastest(self) -> Airframe {
        match self {
            Self::Circle(_) => airframe(20.0),
            Self::Pair => airframe(24.0),
        }
    }

    /// Begins a run; `None` if there is no room for everybody's loiter.
    pub(super) fn begin(self, seed: u64) -> Option<Vec<Begin>> {
        let mut random = SplitMix64::new(seed);
        let drawn: Vec<(Pose, Point, Airframe)> = match self {
            Self::Circle(n) => (0..n).map(|i| on_circle(i, n, &mut random)).collect(),
            Self::Pair => pair(&mut random).to_vec(),
        };
        let agreed = AGREED_S.iter().find_map(|agreed_s| {
            let motions: Option<Vec<Motion>> = drawn
                .iter()
                .map(|(pose, _, airframe)| agreed(*pose, airframe, *agreed_s))
                .collect();
            motions.filter(|m| all_apart(m))
        })?;
        let begins = drawn.into_iter().zip(agreed).zip(1..);
        begins
            .map(|(((pose, goal, airframe), motion), id)| {
                let detours = Detours {
                    airframe,
                    separation_m: super::SEPARATION_M,
                };
                let direct_s = detours.direct(pose, goal)?.duration_s;
                let mut pose = pose;
                pose.east_m += 2.0 * random.unit() - 1.0;
                pose.north_m += 2.0 * random.unit() - 1.0;
                Some(Begin {
                    id: PeerId(id),
                    airframe,
                    pose,
                    motion,
                    goal,
                    direct_s,
                })
            })
            .collect()
    }
}

/// A fixed wing with the limits of the reference figures, at a cruise of its own.
fn airframe(cruise_mps: f64) -> Airframe {
    Airframe {
        stall_mps: 0.65 * cruise_mps,
        cruise_mps,
        max_mps: 1.3 * cruise_mps,
        max_bank_rad: BANK_RAD,
        endurance_s: 3_600.0,
        reserve_s: 300.0,
        footprint_across_m: 40.0,
        footprint_along_m: 30.0,
        mount: Mount::Level,
        climb_mps: CLIMB_MPS,
    }
}

fn on_circle(i: u16, n: u16, random: &mut SplitMix64) -> (Pose, Point, Airframe) {
    let around_rad = TAU * f64::from(i) / f64::from(n);
    let centre = Point::new(0.0, 0.0);
    let mut draw = |most: f64| most * (2.0 * random.unit() - 1.0);
    let start = beside(centre, around_rad, CIRCLE_M + draw(10.0), draw(10.0));
    let goal = beside(centre, around_rad, -CIRCLE_M, 0.0);
    let heading_rad = around_rad + TAU / 2.0 + draw(0.1);
    (Pose::new(start, heading_rad), goal, airframe(20.0))
}

/// Two that come near the origin at about the same time.
fn pair(random: &mut SplitMix64) -> [(Pose, Point, Airframe); 2] {
    let meet_s = 15.0 + 35.0 * random.unit();
    [0, 1].map(|_| {
        let mut draw = |least: f64, most: f64| least + (most - least) * random.unit();
        let airframe = airframe(draw(16.0, 24.0));
        let course_rad = draw(0.0, TAU);
        let miss_m = draw(-50.0, 50.0);
        let back_m = airframe.cruise_mps * (meet_s + draw(-2.0, 2.0));
        let centre = Point::new(0.0, 0.0);
        let start = beside(centre, course_rad, -back_m, miss_m);
        let goal = beside(centre, course_rad, draw(300.0, 900.0), miss_m);
        (Pose::new(start, course_rad), goal, airframe)
    })
}

/// What somebody who flies has agreed on before: straight on, then a loiter to the right.
fn agreed(pose: Pose, airframe: &Airframe, straight_s: f64) -> Option<Motion> {
    let mps = airframe.cruise_mps;
    let radius_m = airframe.ground_turn_radius_m(mps, 0.0);
    let straight = Stretch {
        radius_mm: 0,
        length_mm: to_mm(mps * straight_s),
        airspeed_mmps: to_mm(mps),
    };
    let motion = Motion::new(MotionPlan {
        start_ms: 0,
        east_mm: to_signed_mm(pose.east_m),
        north_mm: to_signed_mm(pose.north_m),
        heading_e7: heading_e7(pose.heading_rad),
        stretches: vec![straight],
        end: End::Loiter {
            radius_mm: to_signed_mm(-radius_m),
            airspeed_mmps: to_mm(mps),
        },
    });
    motion.ok()
}
