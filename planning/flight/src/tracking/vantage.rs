//! The circle from which a target is hidden least by buildings (D2.7 §3.7.1).
//!
//! From h above the target at a distance r over the ground the line of sight climbs by h/r. A
//! front of the height H that stands w beside the target hides it from where the line of sight
//! crosses it below the roof: at an angle φ to the street if w/|sin φ| · h/r < H. So of a circle
//! about it the share 1 − (2/π) arcsin(min(1, w h/(r H))) lies behind that front: nothing where
//! tan ε = h/r ≥ H/w, and the less the steeper. Such shadows are what Shaferman and Shima,
//! "Unmanned aerial vehicles cooperative tracking of moving ground target in urban
//! environments" (2008), keep out of, and Kim and Crassidis, "UAV path planning for maximum
//! visibility of ground targets in an urban area" (2010), plan by.
//!
//! Streets end and bend, and fronts are not alike, so the formula only tells what to try:
//! smaller circles, and such whose middle lies aside. Of each the law itself is flown ahead
//! ([`Follower::ahead`]), for as long as it can be told where the target will be, and lines of
//! sight are counted, nearer ones more. So what is compared is what the airframe can fly from where it
//! is, in this wind.
//!
//! | circle that is flown | best of the others | next |
//! |---|---|---|
//! | – | – | that of the stand-off |
//! | any | better by `BETTER` | that one |
//! | any | otherwise | it stays |
//!
//! Circles that are not the stand-off's cost a little (`OTHER`, `ASIDE`), more than it takes
//! to change, so that where nothing hides the target the stand-off is flown again.
//!
//! # Guarantees
//! No circle is smaller than can be flown, nor does it reach beyond the camera's range. The same
//! calls give the same circle.
//!
//! # Complexity
//! Once in [`EACH_MS`] [`RADII`] · [`PLACES`] circles at most of [`STEPS`] steps of the law, and
//! `SAMPLES` lines of sight for each way that the target may drive; those that would not be better
//! if they saw it all the time are left out.

use super::flyable::least_radius_m;
use super::follower::{Follower, StandOff, TargetMotion};
use super::streets::Streets;
use crate::trajectory::wind::Wind;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::exp;

/// Circles are compared this often, milliseconds.
pub const EACH_MS: u64 = 1_000;

/// Radii that are tried, as shares of the stand-off.
const SHARES: [f64; RADII] = [1.0, 0.8, 0.6, 0.45];

/// So many.
pub const RADII: usize = 4;

/// Middles that are tried: at the target, before and behind it, and to either side.
pub const PLACES: usize = 5;

/// Middles lie aside by this share of the stand-off.
const FAR: f64 = 0.4;

/// Lines of sight are looked at so many seconds apart.
const SAMPLE_S: f64 = 2.0;
/// So many lines of sight of each circle and way.
pub const SAMPLES: usize = 12;

/// The law is flown ahead by so many steps for each of these, of 0.25 s.
const PARTS: usize = 8;

/// So many steps in all.
pub const STEPS: usize = SAMPLES * PARTS;

/// Sight in so many seconds counts less by the factor e: by then the target turned off.
const FADES_S: f64 = 15.0;

/// A circle is left for one with so much more of sight.
const BETTER: f64 = 0.04;

/// What a circle of another radius costs of sight, for as much smaller than the stand-off as
/// that is wide, and one whose middle is aside by it.
const OTHER: f64 = 0.1;
const ASIDE: f64 = 0.1;

/// Circles are this much wider than the least that can be flown.
const ROOM: f64 = 1.03;

/// What a follower knows of what it sees.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Whether from a pose in its own height the ground at a place is seen.
    pub sees: &'a dyn Fn(Pose, Point) -> bool,
    /// How far a circle of a radius, metres, about a place lies aside of it for zones.
    pub aside: &'a dyn Fn(Point, f64) -> Vector,
    /// How far away over the ground its camera recognises a target, metres.
    pub reach_m: f64,
    /// Streets, where they are known.
    pub streets: Option<&'a Streets>,
}

/// A circle about a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Its radius, metres.
    pub radius_m: f64,
    /// Its middle, metres east and north of the target.
    pub beside: Vector,
}

/// The circle that is flown, and when it was chosen, milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vantage {
    chosen: Option<Circle>,
    looked_ms: Option<u64>,
}

impl Vantage {
    /// The circle to fly from now on; nothing where a follower is to be at one place beside its
    /// target, or knows no number of it.
    pub fn choose(
        &mut self,
        follower: &Follower,
        (pose, wind): (Pose, Wind),
        target: &TargetMotion,
        view: &View<'_>,
        now_ms: u64,
    ) -> Option<Circle> {
        let StandOff::Distance(stand_off_m) = follower.settings().stand_off else {
            return None;
        };
        let is_sound = target.position.x.is_finite() && target.velocity_mps.norm().is_finite();
        if !is_sound {
            return None;
        }
        let asked = Circle {
            radius_m: stand_off_m,
            beside: Vector::zeros(),
        };
        let flown = self.chosen.unwrap_or(asked);
        if self.looked_ms.is_some_and(|ms| now_ms < ms + EACH_MS) {
            return Some(flown);
        }
        self.looked_ms = Some(now_ms);
        let scene = Scene::of(follower, (pose, wind), target, view);
        let worth = |c: &Circle| scene.worth(c, stand_off_m);
        let mut best = (flown, worth(&flown) + BETTER);
        for circle in scene.tried(stand_off_m) {
            // One that is not better though all of it sees the target need not be flown ahead.
            if less_cost(1.0, &circle, stand_off_m) <= best.1 {
                continue;
            }
            let worth = worth(&circle);
            if worth > best.1 {
                best = (circle, worth);
            }
        }
        self.chosen = Some(best.0);
        self.chosen
    }
}

/// All that circles are compared by.
struct Scene<'a> {
    follower: &'a Follower,
    pose: Pose,
    wind: Wind,
    view: &'a View<'a>,
    velocity_mps: Vector,
    /// Places of the target at each sample, by each way that it may drive.
    ways: Vec<Vec<Point>>,
    /// How it moves at each step of the law, by the first of them.
    moves: Vec<TargetMotion>,
}

impl<'a> Scene<'a> {
    fn of(
        follower: &'a Follower,
        (pose, wind): (Pose, Wind),
        target: &TargetMotion,
        view: &'a View<'a>,
    ) -> Self {
        let (at, velocity_mps) = (target.position, target.velocity_mps);
        let known = view
            .streets
            .map(|s| s.ways(at, velocity_mps, SAMPLE_S, SAMPLES));
        let mut ways = known.unwrap_or_default();
        if ways.is_empty() {
            let straight = |k: f64| at + velocity_mps * (k * SAMPLE_S);
            ways.push(numbers(SAMPLES).map(|k| straight(k + 1.0)).collect());
        }
        let mut moves = Vec::with_capacity(STEPS);
        let mut from = at;
        for to in ways.first().map_or(&[][..], Vec::as_slice) {
            let along = to - from;
            moves.extend(numbers(PARTS).map(|k| TargetMotion {
                position: from + along * (k / whole(PARTS)),
                velocity_mps: along / SAMPLE_S,
                acceleration_mps2: Vector::zeros(),
            }));
            from = *to;
        }
        Self {
            follower,
            pose,
            wind,
            view,
            velocity_mps,
            ways,
            moves,
        }
    }

    /// Circles that can be flown and from which the camera reaches the target.
    fn tried(&self, stand_off_m: f64) -> Vec<Circle> {
        let settings = self.follower.settings();
        let drift_mps = (self.velocity_mps - self.wind.velocity()).norm();
        let airspeed_mps = settings.airspeeds.of_loiter_mps(drift_mps);
        let least_m = least_radius_m(&settings.airframe, airspeed_mps, drift_mps, 0.0);
        let least_m = least_m.map_or(stand_off_m, |m| (ROOM * m).min(stand_off_m));
        let mps = self.velocity_mps.norm();
        let ahead = if mps > 1.0 {
            self.velocity_mps / mps
        } else {
            Vector::new(1.0, 0.0)
        };
        let left = Vector::new(-ahead.y, ahead.x);
        let mut circles = Vec::with_capacity(RADII * PLACES);
        let mut wider_m = f64::INFINITY;
        for share in SHARES {
            let radius_m = (share * stand_off_m).max(least_m);
            if radius_m >= wider_m {
                continue;
            }
            wider_m = radius_m;
            let far_m = (FAR * stand_off_m).min((self.view.reach_m - radius_m).max(0.0));
            for way in [Vector::zeros(), ahead, -ahead, left, -left] {
                circles.push(Circle {
                    radius_m,
                    beside: way * far_m,
                });
            }
        }
        circles
    }

    /// The share of sight from a circle, less what it costs.
    fn worth(&self, circle: &Circle, stand_off_m: f64) -> f64 {
        let mut follower = self.follower.clone();
        follower.circle(Some(circle.radius_m));
        let mut moves = Vec::with_capacity(self.moves.len());
        for part in self.moves.chunks(PARTS) {
            let middle = part[0].position + circle.beside;
            let aside = (self.view.aside)(middle, circle.radius_m);
            moves.extend(part.iter().map(|m| TargetMotion {
                position: m.position + circle.beside + aside,
                ..*m
            }));
        }
        let step_s = SAMPLE_S / whole(PARTS);
        let flown = follower.ahead(self.pose, self.wind, step_s, &moves);
        let (mut seen, mut all) = (0.0, 0.0);
        let fades = exp(-SAMPLE_S / FADES_S);
        let mut counts = 1.0;
        for (nth, pose) in flown.iter().skip(PARTS - 1).step_by(PARTS).enumerate() {
            let from = pose.position();
            let mut before: Option<(Point, bool)> = None;
            for way in &self.ways {
                let Some(at) = way.get(nth).copied() else {
                    continue;
                };
                // Ways are one until they part.
                let sees = match before {
                    Some((same, sees)) if same == at => sees,
                    _ => (at - from).norm() <= self.view.reach_m && (self.view.sees)(*pose, at),
                };
                before = Some((at, sees));
                seen += if sees { counts } else { 0.0 };
                all += counts;
            }
            counts *= fades;
        }
        let sight = seen / f64::max(all, f64::MIN_POSITIVE);
        less_cost(sight, circle, stand_off_m)
    }
}

/// A share of sight, less what it costs to fly a circle that is not the stand-off's.
fn less_cost(sight: f64, circle: &Circle, stand_off_m: f64) -> f64 {
    let smaller = (stand_off_m - circle.radius_m).abs() / stand_off_m.max(1.0);
    let aside = circle.beside.norm() / stand_off_m.max(1.0);
    sight - OTHER * smaller - ASIDE * aside
}

/// 0, 1, 2 and so on, so many.
fn numbers(count: usize) -> impl Iterator<Item = f64> {
    (0_u32..).map(f64::from).take(count)
}

#[allow(clippy::cast_precision_loss, reason = "a few")]
fn whole(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::super::flyable::tests::airframe;
    use super::super::follower::{Settings, fly};
    use super::super::mode::Airspeeds;
    use super::*;
    use crate::tracking::field::Field;

    /// How high the UAV flies above the target, and fronts along an east-west street, metres.
    const HEIGHT_M: f64 = 120.0;
    const FRONT_M: f64 = 35.0;
    const HALF_M: f64 = 12.0;

    fn follower() -> Follower {
        Follower::new(Settings {
            airframe: airframe(),
            airspeeds: Airspeeds::of(&airframe()),
            field: Field::HOPF,
            stand_off: StandOff::Distance(150.0),
        })
    }

    fn target(at: Point, mps: f64) -> TargetMotion {
        TargetMotion {
            position: at,
            velocity_mps: Vector::new(mps, 0.0),
            acceleration_mps2: Vector::zeros(),
        }
    }

    /// Where there are no zones.
    fn free(_: Point, _: f64) -> Vector {
        Vector::zeros()
    }

    /// Whether the line of sight clears the fronts to both sides of the street.
    fn canyon(from: Pose, at: Point) -> bool {
        let beside_m = (from.north_m - at.y).abs();
        if beside_m <= HALF_M {
            return true;
        }
        HEIGHT_M * HALF_M / beside_m >= FRONT_M
    }

    /// The share of sight over ten minutes after a target, by the circle that is chosen or by
    /// that of the stand-off, how often it changed, and the least radius.
    fn flown(mps: f64, sees: &dyn Fn(Pose, Point) -> bool, chooses: bool) -> (f64, u32, f64) {
        let (mut follower, mut vantage) = (follower(), Vantage::default());
        let mut pose = Pose::new(Point::new(-150.0, 0.0), 1.0);
        let (mut seen, mut changes, mut least_m) = (0.0, 0, f64::INFINITY);
        let mut before = None;
        for k in 0..3_000_u64 {
            #[allow(clippy::cast_precision_loss, reason = "some thousands")]
            let mut motion = target(Point::new(mps * 0.2 * k as f64, 0.0), mps);
            seen += f64::from(u8::from(sees(pose, motion.position))) / 3_000.0;
            if chooses {
                let view = View {
                    sees,
                    aside: &free,
                    reach_m: 219.0,
                    streets: None,
                };
                let by = (pose, Wind::CALM);
                let circle = vantage
                    .choose(&follower, by, &motion, &view, k * 200)
                    .unwrap();
                changes += u32::from(before.is_some_and(|b| b != circle));
                before = Some(circle);
                least_m = least_m.min(circle.radius_m);
                follower.circle(Some(circle.radius_m));
                motion.position += circle.beside;
            }
            for c in follower.commands(pose, Wind::CALM, &motion, 0.2, None) {
                pose = fly(&pose, &c, Wind::CALM);
            }
        }
        (seen, changes, least_m)
    }

    #[test]
    fn in_a_street_between_fronts_more_is_seen_and_the_circle_can_be_flown() {
        for mps in [0.0, 6.0] {
            let (asked, ..) = flown(mps, &canyon, false);
            let (chosen, changes, least_m) = flown(mps, &canyon, true);
            assert!(chosen > asked + 0.08, "{mps}: {asked} {chosen}");
            // Not more than once in five seconds.
            assert!(changes <= 120, "{mps}: {changes} changes");
            let airspeeds = Airspeeds::of(&airframe());
            let flyable_m = least_radius_m(&airframe(), airspeeds.of_loiter_mps(mps), mps, 0.0);
            assert!(least_m >= flyable_m.unwrap(), "{least_m}");
        }
    }

    #[test]
    fn where_nothing_hides_the_stand_off_is_flown() {
        let (seen, changes, least_m) = flown(6.0, &|_, _| true, true);
        assert!(seen > 0.999 && changes == 0 && (least_m - 150.0).abs() < 1e-9);
        // And again once what hid it is behind.
        let (mut vantage, follower) = (Vantage::default(), follower());
        let pose = Pose::new(Point::new(0.0, -150.0), 0.0);
        let mut choose = |sees: &dyn Fn(Pose, Point) -> bool, now_ms| {
            let view = View {
                sees,
                aside: &free,
                reach_m: 219.0,
                streets: None,
            };
            let target = target(Point::origin(), 0.0);
            vantage.choose(&follower, (pose, Wind::CALM), &target, &view, now_ms)
        };
        let hidden = choose(&canyon, 0).unwrap();
        assert!(
            hidden.radius_m < 150.0 || hidden.beside.norm() > 0.0,
            "{hidden:?}"
        );
        // Between two choices it stays.
        assert_eq!(choose(&|_, _| true, 900), Some(hidden));
        let open = choose(&|_, _| true, 1_000).unwrap();
        assert_eq!((open.radius_m, open.beside), (150.0, Vector::zeros()));
    }

    #[test]
    fn a_target_of_no_number_and_a_place_beside_have_no_circle() {
        let view = View {
            sees: &|_, _| true,
            aside: &free,
            reach_m: 219.0,
            streets: None,
        };
        let pose = (Pose::new(Point::origin(), 0.0), Wind::CALM);
        let nowhere = target(Point::new(f64::NAN, 0.0), 3.0);
        let choose = |f: &Follower, t| Vantage::default().choose(f, pose, t, &view, 0);
        assert_eq!(choose(&follower(), &nowhere), None);
        let beside = Follower::new(Settings {
            stand_off: StandOff::bearing(0.0, 50.0),
            ..*follower().settings()
        });
        assert_eq!(choose(&beside, &target(Point::origin(), 3.0)), None);
    }
}
