//! What a UAV does about a target that it lost (D2.7 §3.7): where it was seen last, where it may
//! be by now, where the camera looks for it and where the UAV flies.
//!
//! | event | what follows |
//! |---|---|
//! | a target is seen | it is remembered where, and how it moved |
//! | a target is not seen for a second | chances begin where it was seen last: on the streets, or over the ground where none are known |
//! | a look | chances go on; what all cameras showed, and no building hid, is less likely |
//! | nothing is told of it any more | it is lost, and wanted all the same |
//! | another one turns up that was first seen since, near enough | that is it |

use super::Town;
use super::camera::Camera;
use skein_flight::tracking::chance::ChanceMap;
use skein_flight::tracking::follower::TargetMotion;
use skein_flight::tracking::fusion::Fused;
use skein_flight::tracking::handover::Wanted;
use skein_flight::tracking::lookout::{Looker, fly_to, point_at};
use skein_flight::tracking::streets::{LastSeen, StreetChances, Streets};
use skein_flight::tracking::tracks::TargetName;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::seconds;
use std::collections::BTreeMap;

/// What a look leaves of the chance that it is there after all: nine of ten are recognised, but
/// looks that follow each other are alike.
const LEFT: f64 = 0.7;

/// A camera is pointed elsewhere so often, milliseconds: it takes as long to turn.
const GLANCE_MS: u64 = 600;

/// Where to fly is chosen so often, milliseconds; over the ground looks are counted then.
const CHOICE_MS: u64 = 1_000;

/// As long as the target is with this chance about where it should be the UAV flies on with that,
/// and only its camera searches.
const FLIES_ON: f64 = 0.5;

/// A target that was lost may have gone so far at once, metres, and so fast, m/s.
const STRAYS_M: f64 = 40.0;
const STRAYS_MPS: f64 = 26.0;

/// Who is seen within so long of its last sight is the same although it has another name,
/// milliseconds.
const OVERLAP_MS: u64 = 1_000;

/// Who was watched for so long is no false alarm, milliseconds.
const ESTABLISHED_MS: u64 = 3_000;

/// The share that a look has in the usual speed of a target, and from what on it drives, m/s.
const SHARE: f64 = 0.05;
const DRIVES_MPS: f64 = 3.0;

/// Who was out of sight is seen again by so many sightings, each within this of that before,
/// milliseconds.
const AGAIN: u32 = 3;
const AGAIN_MS: u64 = 1_000;

/// Two names at one place within this are of one target, metres.
const TWIN_M: f64 = 30.0;

/// No more targets are remembered.
const MOST: usize = 64;

/// A target that was seen.
#[derive(Clone, Copy, Debug)]
struct Known {
    first_ms: u64,
    last: LastSeen,
    /// Who was where it was when it was seen last: another name of the same, most likely.
    twin: Option<TargetName>,
    /// Sightings since it was out of sight: how many, when the last was, and where.
    again: Option<(u32, u64, Point)>,
}

/// The targets that were seen, by name.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    known: BTreeMap<TargetName, Known>,
}

impl Memory {
    /// Takes in what all know; `is_seen` says of a name whether a UAV saw it, and not only the
    /// operator.
    pub(super) fn learn(
        &mut self,
        targets: &[Fused],
        is_seen: &dyn Fn(TargetName) -> bool,
        now_ms: u64,
    ) {
        for t in targets.iter().filter(|t| is_seen(t.name)) {
            let before = self.known.get(&t.name).copied();
            let at = t.estimate.position();
            let twin = targets
                .iter()
                .find(|u| u.name != t.name && (u.estimate.position() - at).norm() <= TWIN_M);
            match before.map(|k| k.seen(t, now_ms)) {
                Some(None) => {}
                Some(Some(known)) => {
                    let twin = twin.map(|u| u.name);
                    self.known.insert(t.name, Known { twin, ..known });
                }
                None if self.known.len() < MOST => {
                    let known = Known {
                        first_ms: t.seen_ms,
                        last: last_seen(t, t.estimate.velocity_mps().norm(), now_ms),
                        twin: twin.map(|u| u.name),
                        again: None,
                    };
                    self.known.insert(t.name, known);
                }
                None => {}
            }
        }
        self.find(targets);
    }

    /// Who is lost and was found again under another name is not lost any more.
    fn find(&mut self, targets: &[Fused]) {
        let is_told = |name: &TargetName| targets.iter().any(|t| t.name == *name);
        let lost: Vec<(TargetName, LastSeen, Option<TargetName>)> = self
            .known
            .iter()
            .filter(|(name, _)| !is_told(name))
            .map(|(name, k)| (*name, k.last, k.twin))
            .collect();
        for (name, last, twin) in lost {
            let is_it = |k: &Known| {
                let since_s = seconds(k.last.at_ms.saturating_sub(last.at_ms));
                let reach_m = STRAYS_M + STRAYS_MPS * since_s;
                k.first_ms + OVERLAP_MS >= last.at_ms
                    && k.last.at_ms > last.at_ms
                    && (k.last.at - last.at).norm() <= reach_m
            };
            let is_twin = |n: &TargetName, k: &Known| {
                twin == Some(*n) && k.last.at_ms + OVERLAP_MS >= last.at_ms
            };
            let mut others = self.known.iter().filter(|(n, _)| **n != name);
            let heir = others.find(|(n, k)| is_twin(n, k) || is_it(k));
            let Some(heir) = heir.map(|(n, _)| *n) else {
                continue;
            };
            self.known.remove(&name);
            if let Some(k) = self.known.get_mut(&heir) {
                k.last.usual_mps = k.last.usual_mps.max(last.usual_mps);
            }
        }
    }

    /// Where one that was out of sight may just have been seen.
    pub(super) fn again(&self, name: TargetName, now_ms: u64) -> Option<Point> {
        let (_, ms, at) = self.known.get(&name)?.again?;
        (ms + AGAIN_MS >= now_ms).then_some(at)
    }

    /// What was known of a target when it was seen last.
    pub(super) fn of(&self, name: TargetName) -> Option<LastSeen> {
        self.known.get(&name).map(|k| k.last)
    }

    /// Those of whom nothing is told any more, the latest first: such as were watched for a
    /// while, for false alarms are not. Where none ever was, whatever was seen may be one.
    pub(super) fn lost(&self, targets: &[Fused]) -> Vec<Wanted> {
        let is_told = |name: &TargetName| targets.iter().any(|t| t.name == *name);
        let is_any = !self.known.values().any(Known::is_established);
        let mut lost: Vec<(&TargetName, &Known)> = self
            .known
            .iter()
            .filter(|(name, k)| !is_told(name) && (is_any || k.is_established()))
            .collect();
        lost.sort_by_key(|(name, k)| (core::cmp::Reverse(k.last.at_ms), **name));
        let wanted = lost.into_iter().map(|(name, k)| Wanted {
            name: *name,
            at: k.last.at,
        });
        wanted.collect()
    }
}

/// What was seen of a target, as it was when it was seen.
fn last_seen(t: &Fused, usual_mps: f64, now_ms: u64) -> LastSeen {
    let unseen_s = seconds(now_ms.saturating_sub(t.seen_ms));
    let velocity_mps = t.estimate.velocity_mps();
    LastSeen {
        at_ms: t.seen_ms,
        at: t.estimate.position() - velocity_mps * unseen_s,
        spread_m: t.estimate.spread_m(),
        velocity_mps,
        usual_mps,
    }
}

impl Known {
    /// What is known after a look; nothing if that did not show it. Who was out of sight is
    /// seen again when it was so often: a false alarm is not it.
    fn seen(&self, t: &Fused, now_ms: u64) -> Option<Self> {
        let (before_ms, many) = match self.again {
            Some((many, ms, _)) => (ms, many),
            None => (self.last.at_ms, AGAIN),
        };
        if t.seen_ms <= before_ms {
            return None;
        }
        let many = if t.seen_ms > before_ms + AGAIN_MS {
            1
        } else {
            (many + 1).min(AGAIN)
        };
        if many < AGAIN {
            let again = Some((many, t.seen_ms, t.estimate.position()));
            return Some(Self { again, ..*self });
        }
        let (mps, usual_mps) = (t.estimate.velocity_mps().norm(), self.last.usual_mps);
        let usual_mps = if mps > DRIVES_MPS {
            usual_mps + SHARE * (mps - usual_mps)
        } else {
            usual_mps
        };
        Some(Self {
            last: last_seen(t, usual_mps, now_ms),
            again: None,
            ..*self
        })
    }

    /// Whether it was watched for so long that it is no false alarm.
    fn is_established(&self) -> bool {
        self.last.at_ms >= self.first_ms + ESTABLISHED_MS
    }
}

/// Chances of where a target is.
#[derive(Clone, Debug)]
enum Chances {
    /// On streets.
    Streets(StreetChances),
    /// Anywhere on the ground.
    Ground(Box<ChanceMap>),
}

/// A search for a target.
#[derive(Clone, Debug)]
pub(super) struct Search {
    last: LastSeen,
    chances: Chances,
    looked_ms: u64,
    glanced_ms: u64,
    chosen_ms: u64,
    glance: Option<Point>,
    aim: Option<Point>,
    /// Whether the target is likely where it should be.
    flies_on: bool,
}

impl Search {
    /// Begins where the target was seen last.
    pub(super) fn new(last: &LastSeen, streets: Option<&Streets>) -> Self {
        let on_streets = streets.and_then(|s| StreetChances::new(s, last));
        let chances = on_streets.map_or_else(
            || {
                let map = ChanceMap::new(last.at_ms, last.at, last.spread_m, last.velocity_mps);
                Chances::Ground(Box::new(map))
            },
            Chances::Streets,
        );
        Self {
            last: *last,
            chances,
            looked_ms: 0,
            glanced_ms: 0,
            chosen_ms: 0,
            glance: None,
            aim: None,
            flies_on: true,
        }
    }

    /// Whether it is the search for a target since it was seen last.
    pub(super) fn is_of(&self, last: &LastSeen) -> bool {
        self.last == *last
    }

    /// Where the camera looks.
    pub(super) fn glance(&self) -> Option<Point> {
        self.glance
    }

    /// Where it flies to.
    pub(super) fn aim(&self) -> Option<Point> {
        self.aim
    }

    /// The target as it is flown after: it stands where most is to be looked at. Nothing while it
    /// is flown after as it should be.
    pub(super) fn motion(&self) -> Option<TargetMotion> {
        self.aim
            .filter(|_| !self.flies_on)
            .map(|position| TargetMotion {
                position,
                velocity_mps: Vector::zeros(),
                acceleration_mps2: Vector::zeros(),
            })
    }

    /// The chances at this time, less what these cameras show.
    pub(super) fn look(&mut self, cameras: &[Camera], town: &Town<'_>, now_ms: u64) {
        let shows = |p: Point| cameras.iter().any(|c| c.sees(p, town.buildings));
        match (&mut self.chances, town.streets) {
            (Chances::Streets(chances), Some(streets)) => {
                chances.go_on(streets, now_ms);
                chances.look(streets, LEFT, &shows);
            }
            (Chances::Ground(map), _) => {
                if self.looked_ms + CHOICE_MS <= now_ms {
                    self.looked_ms = now_ms;
                    map.go_on(now_ms);
                    map.look(&shows);
                }
            }
            (Chances::Streets(_), None) => {}
        }
    }

    fn places(&self, town: &Town<'_>) -> Vec<(Point, f64)> {
        match (&self.chances, town.streets) {
            (Chances::Streets(chances), Some(streets)) => chances.places(streets),
            (Chances::Ground(map), _) => map.places(),
            (Chances::Streets(_), None) => Vec::new(),
        }
    }

    /// Where the camera looks and where the UAV flies from now on; others fly to `others`.
    pub(super) fn choose(
        &mut self,
        camera: &Camera,
        town: &Town<'_>,
        (others, again): (&[Point], Option<Point>),
        expected: Option<Point>,
        now_ms: u64,
    ) {
        let glances = self.glanced_ms + GLANCE_MS <= now_ms;
        let flies = self.chosen_ms + CHOICE_MS <= now_ms;
        if !glances && !flies {
            self.glance = again.or(self.glance);
            return;
        }
        let places = self.places(town);
        let from = camera.at();
        if glances {
            self.glanced_ms = now_ms;
            let reach_m = camera.reach_m();
            let shown: Vec<(Point, f64)> = places
                .iter()
                .copied()
                .filter(|(p, _)| {
                    (p - from).norm() <= reach_m && !camera.is_hidden(*p, town.buildings)
                })
                .collect();
            let next = point_at(&shown, &|p| camera.shows_m(p));
            self.glance = next.or(self.aim).or(Some(self.last.at));
        }
        self.glance = again.or(self.glance);
        if flies {
            self.chosen_ms = now_ms;
            let looker = Looker {
                at: from,
                airspeed_mps: super::airframe().cruise_mps,
                reach_m: camera.reach_m(),
            };
            self.aim = fly_to(&places, &looker, self.aim, others).or(self.aim);
            self.flies_on = expected.is_some_and(|at| {
                let near = |p: &&(Point, f64)| (p.0 - at).norm() <= looker.reach_m / 2.0;
                let sum: f64 = places.iter().filter(near).map(|(_, chance)| chance).sum();
                sum >= FLIES_ON
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix4, Vector4};
    use skein_flight::tracking::estimate::Estimate;
    use skein_flight::tracking::tracks::Kind;

    fn name(number: u32) -> TargetName {
        TargetName { author: 1, number }
    }

    /// What is told of a target that drives east at 8 m/s, seen `unseen_ms` ago.
    fn told(number: u32, x: f64, now_ms: u64, unseen_ms: u64) -> Fused {
        Fused {
            name: name(number),
            kind: Kind(1),
            estimate: Estimate {
                time_ms: now_ms,
                state: Vector4::new(x, 0.0, 8.0, 0.0),
                covariance: Matrix4::identity(),
            },
            seen_ms: now_ms - unseen_ms,
            authors: 1,
        }
    }

    /// Target 1 was seen until a time, milliseconds.
    fn seen_until(until_ms: u64) -> Memory {
        let mut memory = Memory::default();
        for ms in (0..=until_ms).step_by(200) {
            memory.learn(&[told(1, 8.0 * seconds(ms), ms, 0)], &|_| true, ms);
        }
        memory
    }

    fn lost(memory: &Memory, targets: &[Fused]) -> Vec<TargetName> {
        memory.lost(targets).iter().map(|w| w.name).collect()
    }

    #[test]
    fn one_sighting_is_a_false_alarm_and_three_are_the_target() {
        let mut memory = seen_until(4_000);
        let before = memory.of(name(1)).unwrap();
        assert!((before.at.x - 32.0).abs() < 1e-9 && before.at_ms == 4_000);
        for (nth, ms) in [9_000, 9_200, 9_400].into_iter().enumerate() {
            assert_eq!(memory.of(name(1)), Some(before), "{nth}");
            memory.learn(&[told(1, 90.0, ms, 0)], &|_| true, ms);
            let again = memory.again(name(1), ms);
            assert_eq!(again.is_some(), nth < 2);
        }
        assert_eq!(memory.of(name(1)).unwrap().at_ms, 9_400);
        // Two with a pause between them are two false alarms.
        let mut memory = seen_until(4_000);
        for ms in [9_000, 12_000, 15_000] {
            memory.learn(&[told(1, 90.0, ms, 0)], &|_| true, ms);
        }
        assert_eq!(memory.of(name(1)), Some(before));
    }

    #[test]
    fn who_is_lost_is_wanted_until_it_is_found_under_another_name() {
        let mut memory = seen_until(4_000);
        assert_eq!(lost(&memory, &[]), vec![name(1)]);
        // A false alarm far away is not it, nor is it wanted once it is over.
        memory.learn(&[told(2, 900.0, 6_000, 0)], &|_| true, 6_000);
        assert_eq!(lost(&memory, &[]), vec![name(1)]);
        memory.learn(&[told(3, 100.0, 9_000, 0)], &|_| true, 9_000);
        let found = [told(3, 100.0, 9_000, 0)];
        assert!(!lost(&memory, &found).contains(&name(1)));
    }

    #[test]
    fn two_names_at_one_place_are_one_target() {
        let mut memory = Memory::default();
        for ms in (0..=8_000).step_by(200) {
            let x = 8.0 * seconds(ms);
            let both = [told(1, x, ms, 0), told(2, x + 5.0, ms, 0)];
            memory.learn(&both, &|_| true, ms);
        }
        let left = [told(1, 72.0, 9_000, 0)];
        memory.learn(&left, &|_| true, 9_000);
        assert!(lost(&memory, &left).is_empty());
        // Two that were apart were two.
        let mut memory = Memory::default();
        for ms in (0..=8_000).step_by(200) {
            let x = 8.0 * seconds(ms);
            let both = [told(1, x, ms, 0), told(2, x + 200.0, ms, 0)];
            memory.learn(&both, &|_| true, ms);
        }
        memory.learn(&left, &|_| true, 9_000);
        assert_eq!(lost(&memory, &left), vec![name(2)]);
    }

    #[test]
    fn what_only_the_operator_told_of_is_not_remembered() {
        let mut memory = Memory::default();
        memory.learn(&[told(1, 0.0, 0, 0)], &|_| false, 0);
        assert!(lost(&memory, &[]).is_empty() && memory.of(name(1)).is_none());
    }
}
