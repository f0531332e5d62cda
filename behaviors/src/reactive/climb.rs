//! Heights of a volume that is flown in layers, and how UAVs change from one layer to another
//! past each other (D2.7 §1.2.2, §1.3; reactive layer).
//!
//! In each layer each UAV has a slot of its own, so many of them one above the other. A UAV that
//! changes layers goes from one *rest* to the next: its own slots, and the heights half-way
//! between two slots, where nobody cruises and one at a time may stay. Nobody agrees on anything:
//! it goes on when those whom it senses leave it the room.
//!
//! | another UAV that is sensed | from a rest to one beyond it |
//! |---|---|
//! | between them in height, or less than half a slot beyond, and so near that it could come there meanwhile | stays |
//! | at the height of that rest, however far away | the one after it, two beyond at most |
//! | between them and no cruiser, for less than 20 s | stays: it may go there, too |
//! | likewise, up to three ways beyond that rest and of a lower number; or behind who leaves its own slot | stays |
//! | whoever may be there unseen: there is no sensor, or it holds no more | stays |
//! | any other | goes |
//!
//! Whose own slot another one holds for good, one that flies under the same number, makes for the
//! nearer of the two rests beside it that are in its layer.
//!
//! # Guarantees
//! Of UAVs that follow this law with the same slots, sense each other without delay and climb at
//! no less than they say, any two are half a slot apart in height or farther apart on the ground
//! than they can approach each other meanwhile: who cruises keeps its slot, who passes a slot
//! does so where its owner is not, and no two stay at one rest. Of two who begin at once for one
//! rest one waits: who is behind, who leaves its slot, or who has the higher number. Who was
//! taken for stuck and was not may come to the rest of another: see [`Climb::shares`].
//!
//! # Complexity
//! A few comparisons for each UAV that is sensed, and one for each slot.

use crate::percept::Percept;
use crate::traffic::Sighting;
use std::collections::BTreeMap;

/// Nearer than this to a height a UAV is at it, metres.
pub const AT_M: f64 = 0.5;

/// So long after a percept what it says may still be acted on, seconds: setpoints are refused
/// later.
const LATE_S: f64 = 1.0;

/// Who keeps a slot for so long cruises there, milliseconds: who passes one does not stay.
const CRUISES_MS: u64 = 1_000;

/// Who keeps another height for so long is stuck there, milliseconds: others go past.
pub const STUCK_MS: u64 = 20_000;

/// Of so many rests ahead the first that is free is taken.
const LOOKS_AHEAD: usize = 3;

/// Nearer than this two that stay at one height circle where they are, metres.
const SHARED_M: f64 = 300.0;

/// The heights at which a fleet flies a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Slots {
    /// The lowest slot of each layer, ascending, metres above the origin.
    pub layers_m: Vec<f64>,
    /// From one slot to the next above it, metres.
    pub step_m: f64,
    /// How many there are in each layer.
    pub count: u16,
}

/// How one UAV gets to its slot.
#[derive(Clone, Debug, PartialEq)]
pub struct Climb {
    slots: Slots,
    /// Its number, by which of two one yields.
    id: u16,
    /// Its own slot above the lowest of a layer, metres.
    offset_m: f64,
    /// Which layer is flown.
    layer: usize,
    /// How fast it climbs, m/s.
    climb_mps: f64,
    /// The fastest of the fleet, m/s.
    fastest_mps: f64,
    /// To which rest it is on its way, metres.
    to_m: Option<f64>,
    /// At which height others are, decimetres, and since when, milliseconds.
    others: BTreeMap<u16, (i32, u64)>,
}

impl Slots {
    /// All of a layer's slots, with so much beyond both ends, metres.
    #[must_use]
    pub fn band_m(&self, layer: usize, beyond_m: f64) -> Option<(f64, f64)> {
        let low_m = *self.layers_m.get(layer)?;
        let high_m = low_m + self.step_m * f64::from(self.count.saturating_sub(1));
        Some((low_m - beyond_m, high_m + beyond_m))
    }

    /// The height of each slot, metres.
    fn all_m(&self) -> impl Iterator<Item = f64> + '_ {
        let of = move |low_m: &f64| {
            let low_m = *low_m;
            (0..self.count).map(move |k| low_m + self.step_m * f64::from(k))
        };
        self.layers_m.iter().flat_map(of)
    }

    /// The longest way from one rest to the next, metres.
    fn stride_m(&self) -> f64 {
        let gaps = self
            .gaps_m()
            .map(|(low_m, high_m, parts)| (high_m - low_m) / f64::from(parts.max(1)));
        gaps.fold(self.step_m, f64::max)
    }

    /// The free heights between two layers, half a slot beyond either, and in how many parts.
    fn gaps_m(&self) -> impl Iterator<Item = (f64, f64, u32)> + '_ {
        let half_m = self.step_m / 2.0;
        let pairs = self.layers_m.iter().zip(self.layers_m.iter().skip(1));
        pairs.enumerate().map(move |(layer, (low_m, next_m))| {
            let top_m = self.band_m(layer, 0.0).map_or(*low_m, |band| band.1);
            let (from_m, to_m) = (top_m + half_m, next_m - half_m);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a cast of a float saturates"
            )]
            let parts = ((to_m - from_m + AT_M) / self.step_m).max(0.0) as u32;
            (from_m, to_m, parts)
        })
    }

    /// Where nobody cruises, ascending: half-way between two slots of a layer, below the lowest
    /// and above the highest of all, and between two layers in steps of a slot or more.
    fn between_m(&self) -> Vec<f64> {
        let half_m = self.step_m / 2.0;
        let mut all = Vec::new();
        for low_m in &self.layers_m {
            let within = 1..self.count.max(1);
            all.extend(within.map(|k| low_m + self.step_m * f64::from(k) - half_m));
        }
        for (from_m, to_m, parts) in self.gaps_m() {
            if parts == 0 {
                all.push(from_m.midpoint(to_m));
                continue;
            }
            let part_m = (to_m - from_m) / f64::from(parts);
            all.extend((0..=parts).map(|k| from_m + part_m * f64::from(k)));
        }
        let last = self.layers_m.len().saturating_sub(1);
        all.extend(self.layers_m.first().map(|low_m| low_m - half_m));
        all.extend(self.band_m(last, half_m).map(|band| band.1));
        all.sort_by(f64::total_cmp);
        all
    }
}

/// What others leave of a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Room {
    Free,
    /// Somebody is at its end.
    Taken,
    /// Somebody is too near, or may go there.
    Wait,
}

impl Climb {
    /// The way of the UAV with this number to its slot in a layer; `offset_m` is how far its
    /// slot is above the lowest of each layer; the speeds are how fast it climbs and how fast the
    /// fastest of the fleet flies, m/s.
    #[must_use]
    pub fn new(
        slots: Slots,
        (id, offset_m): (u16, f64),
        layer: usize,
        (climb_mps, fastest_mps): (f64, f64),
    ) -> Self {
        Self {
            layer: layer.min(slots.layers_m.len().saturating_sub(1)),
            slots,
            id,
            offset_m,
            climb_mps: climb_mps.max(0.1),
            fastest_mps,
            to_m: None,
            others: BTreeMap::new(),
        }
    }

    /// The height of its slot, metres above the origin.
    #[must_use]
    pub fn slot_m(&self) -> f64 {
        let low_m = self.slots.layers_m.get(self.layer).copied();
        low_m.unwrap_or(0.0) + self.offset_m
    }

    /// Whether what is seen from a height counts for the layer that is flown.
    #[must_use]
    pub fn is_in_layer(&self, height_m: f64) -> bool {
        let band = self.slots.band_m(self.layer, 2.0 * AT_M);
        band.is_some_and(|(low_m, high_m)| (low_m..=high_m).contains(&height_m))
    }

    /// How long it takes to its layer if nobody is in the way, seconds.
    #[must_use]
    pub fn left_s(&self, height_m: f64) -> f64 {
        if self.is_in_layer(height_m) {
            return 0.0;
        }
        (self.slot_m() - height_m).abs() / self.climb_mps
    }

    /// Within which distance nobody may be on a way of so many metres up or down, metres.
    #[must_use]
    pub fn clear_m(&self, way_m: f64) -> f64 {
        let takes_s = way_m.abs() / self.climb_mps + LATE_S;
        self.slots.step_m + 2.0 * self.fastest_mps * takes_s
    }

    /// Whether another one that stays at its height is so near that both have to circle where
    /// they are.
    #[must_use]
    pub fn shares(&self, percept: &Percept) -> bool {
        let here = percept.pose.position();
        percept.traffic.seen().any(|s| {
            let apart_m = (s.height_m() - percept.height_m).abs();
            apart_m < self.apart_m() && (s.at() - here).norm() <= SHARED_M
        })
    }

    /// The height to fly to now, metres above the origin: a rest, or where it is. It descends
    /// only where it `may`.
    #[must_use]
    pub fn next_m(&mut self, percept: &Percept, may_descend: bool) -> f64 {
        self.note_others(percept);
        let (at_m, own_m) = (percept.height_m, self.slot_m());
        let is_at = |to_m: f64| (at_m - to_m).abs() <= AT_M;
        if is_at(own_m) {
            self.to_m = None;
            return own_m;
        }
        // Between two rests it goes on: it looked before it began.
        if let Some(to_m) = self.to_m.filter(|to| !is_at(*to)) {
            return to_m;
        }
        let slot_m = self.free_m(percept);
        if is_at(slot_m) {
            self.to_m = None;
            return slot_m;
        }
        let upwards = slot_m > at_m;
        let mut rests = self.rests_m();
        if !upwards {
            rests.reverse();
        }
        let resting = rests.iter().position(|r| is_at(*r));
        let beyond = |r: &f64| if upwards { *r > at_m } else { *r < at_m };
        let Some(resting) = resting else {
            let next_m = rests.iter().copied().find(beyond);
            let next_m = next_m.filter(|_| upwards || may_descend).unwrap_or(at_m);
            self.to_m = Some(next_m);
            return next_m;
        };
        let rest_m = rests[resting];
        self.to_m = Some(rest_m);
        if !upwards && !may_descend {
            return rest_m;
        }
        let within = |r: &&f64| {
            if upwards {
                **r <= slot_m
            } else {
                **r >= slot_m
            }
        };
        let ahead = rests[resting + 1..].iter().take_while(within);
        for to_m in ahead.take(LOOKS_AHEAD) {
            match self.room(percept, rest_m, *to_m) {
                Room::Free => {
                    self.to_m = Some(*to_m);
                    return *to_m;
                }
                Room::Taken => {}
                Room::Wait => break,
            }
        }
        rest_m
    }

    /// The height that it makes for, metres: its slot, or a rest beside that if another one stays
    /// there for good and its layer has such a rest.
    fn free_m(&self, percept: &Percept) -> f64 {
        let (slot_m, half_m) = (self.slot_m(), self.slots.step_m / 2.0);
        let is_held = percept.traffic.seen().any(|other| {
            let is_there = (other.height_m() - slot_m).abs() < self.apart_m();
            is_there && self.stays_ms(other.id, percept.time_ms) >= STUCK_MS
        });
        if !is_held {
            return slot_m;
        }
        let beside = [slot_m - half_m, slot_m + half_m].into_iter();
        let away_m = |m: &f64| (m - percept.height_m).abs();
        let nearer = |a: &f64, b: &f64| away_m(a).total_cmp(&away_m(b));
        let within = beside.filter(|m| self.is_in_layer(*m));
        within.min_by(nearer).unwrap_or(slot_m)
    }

    /// Less than this in height keeps nobody apart, metres: whoever rests half a slot away does.
    fn apart_m(&self) -> f64 {
        (self.slots.step_m - AT_M) / 2.0
    }

    /// Where it may stay while others pass, ascending: half-way between two slots, and its own.
    fn rests_m(&self) -> Vec<f64> {
        let mut rests = self.slots.between_m();
        rests.extend(self.slots.layers_m.iter().map(|low| low + self.offset_m));
        rests.sort_by(f64::total_cmp);
        rests.dedup_by(|b, a| (*b - *a).abs() < AT_M);
        rests
    }

    fn note_others(&mut self, percept: &Percept) {
        let now_ms = percept.time_ms;
        let seen = |id: &u16| percept.traffic.seen().any(|s| s.id == *id);
        self.others.retain(|id, _| seen(id));
        for s in percept.traffic.seen() {
            let known = self.others.entry(s.id).or_insert((s.height_dm, now_ms));
            if known.0.abs_diff(s.height_dm) > 1 {
                *known = (s.height_dm, now_ms);
            }
        }
    }

    /// What those who are sensed leave of the way from a rest to another.
    fn room(&self, percept: &Percept, from_m: f64, to_m: f64) -> Room {
        let traffic = &percept.traffic;
        let clear_m = self.clear_m(to_m - from_m);
        let (stride_m, apart_m) = (self.slots.stride_m(), self.apart_m());
        let contended_m = LOOKS_AHEAD as f64 * stride_m + apart_m;
        if traffic.range_m < clear_m || self.may_hide(percept, contended_m + stride_m) {
            return Room::Wait;
        }
        let here = percept.pose.position();
        let side = if to_m > from_m { 1.0 } else { -1.0 };
        let leaves_slot = self.slots.all_m().any(|s| (s - from_m).abs() <= AT_M);
        let mut room = Room::Free;
        for other in traffic.seen() {
            // How far beyond its end, and behind its beginning.
            let beyond_m = side * (other.height_m() - to_m);
            let behind_m = side * (from_m - other.height_m());
            let is_on_it = beyond_m < apart_m && behind_m < apart_m;
            if is_on_it && (other.at() - here).norm() <= clear_m {
                return Room::Wait;
            }
            if beyond_m.abs() < apart_m {
                room = Room::Taken;
                continue;
            }
            if !self.may_come(other, percept.time_ms) {
                continue;
            }
            let is_between = beyond_m < 0.0 && behind_m < 0.0;
            let comes_against = beyond_m > 0.0 && beyond_m < contended_m && other.id < self.id;
            let comes_after = leaves_slot && behind_m >= 0.0 && behind_m < contended_m;
            if is_between || comes_against || comes_after {
                return Room::Wait;
            }
        }
        room
    }

    /// Whether somebody may be within so many metres of its height whom the sensor does not hold.
    fn may_hide(&self, percept: &Percept, within_m: f64) -> bool {
        let heights = percept.traffic.seen().map(Sighting::height_m);
        let farthest_m = heights.map(|h| (h - percept.height_m).abs());
        percept.traffic.is_full() && farthest_m.fold(0.0, f64::max) < within_m
    }

    /// For how long another one is at its height, milliseconds.
    fn stays_ms(&self, id: u16, now_ms: u64) -> u64 {
        let since_ms = self.others.get(&id).map_or(now_ms, |o| o.1);
        now_ms.saturating_sub(since_ms)
    }

    /// Whether another one may be about to change its height: it neither cruises nor is stuck.
    fn may_come(&self, other: &Sighting, now_ms: u64) -> bool {
        let stays_ms = self.stays_ms(other.id, now_ms);
        let is_at_slot = || {
            let mut slots = self.slots.all_m();
            slots.any(|s| (s - other.height_m()).abs() <= AT_M)
        };
        stays_ms < STUCK_MS && !(stays_ms >= CRUISES_MS && is_at_slot())
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "heights are told exactly")]
mod tests {
    use super::*;
    use crate::testing::percept_at;
    use crate::traffic::{TRAFFIC_MAX, Traffic};
    use proptest::prelude::*;
    use skein_geometry::frame::{Point, Pose};
    use skein_geometry::math::sin_cos;

    const STEP_M: f64 = 5.0;

    fn slots(count: u16) -> Slots {
        Slots {
            layers_m: vec![60.0, 100.0, 147.0],
            step_m: STEP_M,
            count,
        }
    }

    fn climb(id: u16, layer: usize) -> Climb {
        let offset_m = STEP_M * f64::from(id - 1);
        Climb::new(slots(8), (id, offset_m), layer, (3.0, 20.0))
    }

    fn other(id: u16, east_m: f64, height_m: f64) -> Sighting {
        #[allow(clippy::cast_possible_truncation, reason = "small numbers")]
        let dm = |m: f64| (m * 10.0).round() as i32;
        Sighting {
            id,
            east_dm: dm(east_m),
            north_dm: 0,
            height_dm: dm(height_m),
        }
    }

    fn percept(time_ms: u64, height_m: f64, others: &[Sighting]) -> Percept {
        Percept {
            height_m,
            traffic: Traffic::new(5_000.0, others.iter().copied()),
            ..percept_at(Pose::new(Point::new(0.0, 0.0), 0.0), time_ms)
        }
    }

    /// Where a UAV goes that has seen these others for a while.
    fn goes(mut climb: Climb, height_m: f64, others: &[Sighting]) -> f64 {
        let _ = climb.next_m(&percept(1_000, height_m, others), true);
        climb.to_m = None;
        climb.next_m(&percept(3_000, height_m, others), true)
    }

    #[test]
    fn alone_it_climbs_from_rest_to_rest_and_stays_at_its_slot() {
        let mut climb = climb(3, 1);
        let (mut height_m, mut rests) = (70.0, vec![70.0]);
        for n in 0..400 {
            let next_m = climb.next_m(&percept(n * 200, height_m, &[]), false);
            if rests.last() != Some(&next_m) {
                rests.push(next_m);
            }
            height_m += f64::clamp(next_m - height_m, -0.6, 0.6);
        }
        assert_eq!(rests[..4], [70.0, 72.5, 77.5, 82.5], "{rests:?}");
        assert_eq!(rests.last(), Some(&110.0), "{rests:?}");
        assert!(climb.is_in_layer(110.0) && climb.is_in_layer(99.5) && !climb.is_in_layer(98.5));
        assert!(climb.is_in_layer(135.9) && !climb.is_in_layer(136.5));
        // What comes down waits until it is asked for there.
        let mut down = self::climb(3, 0);
        assert_eq!(down.next_m(&percept(0, 110.0, &[]), false), 110.0);
        assert_eq!(down.next_m(&percept(200, 110.0, &[]), true), 107.5);
        // Who begins between two rests goes on to the next.
        assert_eq!(
            self::climb(3, 1).next_m(&percept(0, 74.0, &[]), false),
            77.5
        );
    }

    #[test]
    fn who_is_near_is_waited_for_and_who_is_far_is_passed() {
        let at_rest = |others: &[Sighting]| goes(climb(3, 1), 72.5, others);
        assert_eq!(
            at_rest(&[other(4, 40.0, 75.0)]),
            72.5,
            "on its way, and near"
        );
        assert_eq!(
            at_rest(&[other(4, 200.0, 75.0)]),
            77.5,
            "on its way, and far"
        );
        assert_eq!(at_rest(&[other(5, 40.0, 80.0)]), 77.5, "half a slot beyond");
        assert_eq!(
            at_rest(&[other(3, 40.0, 70.0)]),
            72.5 + 5.0,
            "half a slot behind"
        );
        assert_eq!(
            at_rest(&[other(4, 900.0, 77.5)]),
            72.5,
            "at its end, and may go on"
        );
        // Nobody else is there for good.
        let mut stuck = climb(3, 1);
        let others = [other(4, 900.0, 77.5)];
        let _ = stuck.next_m(&percept(0, 72.5, &others), false);
        assert_eq!(stuck.next_m(&percept(STUCK_MS, 72.5, &others), false), 82.5);
        // Without a sensor, or where it holds no more, nobody goes.
        let mut blind = climb(3, 1);
        let mut unseen = percept(0, 72.5, &[]);
        unseen.traffic = Traffic::default();
        assert_eq!(blind.next_m(&unseen, false), 72.5);
        let crowd: Vec<Sighting> = (10..10 + TRAFFIC_MAX)
            .map(|id| other(u16::try_from(id).unwrap(), 900.0, 70.0))
            .collect();
        assert_eq!(goes(climb(3, 1), 72.5, &crowd), 72.5);
        assert_eq!(goes(climb(3, 1), 72.5, &crowd[1..]), 77.5);
    }

    #[test]
    fn whose_slot_another_one_holds_flies_beside_it() {
        let holder = [other(9, 900.0, 110.0)];
        let held = |id: u16, height_m: f64, since_ms: u64| {
            let mut climb = climb(id, 1);
            let others = [other(9, 900.0, climb.slot_m())];
            let _ = climb.next_m(&percept(0, height_m, &others), true);
            climb.to_m = None;
            climb.next_m(&percept(since_ms, height_m, &others), true)
        };
        // From below and from above the nearer side; the lowest and the highest keep to the layer.
        for (id, from_m, next_m) in [
            (3, 107.5, 107.5),
            (3, 112.5, 112.5),
            (3, 117.5, 112.5),
            (1, 97.5, 102.5),
            (8, 137.5, 132.5),
        ] {
            assert_eq!(held(id, from_m, STUCK_MS), next_m, "{id} at {from_m}");
        }
        // Who may be passing by is waited for, and a slot that is free again is gone to.
        assert_eq!(held(3, 107.5, STUCK_MS - 1), 107.5);
        let mut freed = climb(3, 1);
        let _ = freed.next_m(&percept(0, 107.5, &holder), true);
        assert_eq!(
            freed.next_m(&percept(STUCK_MS, 107.5, &holder), true),
            107.5
        );
        assert_eq!(
            freed.next_m(&percept(STUCK_MS + 200, 107.5, &[]), true),
            110.0
        );
        // Where one UAV alone has a slot there is nothing beside it.
        let mut alone = Climb::new(slots(1), (1, 0.0), 1, (3.0, 20.0));
        let holder = [other(9, 900.0, 100.0)];
        for time_ms in [0, STUCK_MS] {
            assert_eq!(alone.next_m(&percept(time_ms, 97.5, &holder), true), 97.5);
        }
    }

    #[test]
    fn of_two_who_could_go_to_one_rest_one_waits() {
        // Between two slots somebody may go on; who leaves its slot lets those behind it go first.
        assert_eq!(goes(climb(3, 1), 70.0, &[other(7, 900.0, 67.5)]), 70.0);
        assert_eq!(goes(climb(2, 1), 67.5, &[other(3, 900.0, 70.0)]), 72.5);
        // Who comes against it: the higher number waits.
        assert_eq!(goes(climb(3, 1), 72.5, &[other(2, 900.0, 82.5)]), 72.5);
        assert_eq!(goes(climb(3, 1), 72.5, &[other(4, 900.0, 82.5)]), 77.5);
        let both = climb(3, 1);
        assert!(both.shares(&percept(0, 72.5, &[other(4, 200.0, 73.0)])));
        assert!(!both.shares(&percept(0, 72.5, &[other(4, 400.0, 73.0)])));
        assert!(!both.shares(&percept(0, 72.5, &[other(4, 200.0, 75.0)])));
    }

    #[test]
    fn rests_are_half_a_slot_from_slots_and_a_slot_from_each_other() {
        for count in 1..=8 {
            let slots = slots(count);
            let between = slots.between_m();
            for rest in &between {
                let nearest = slots.all_m().map(|s| (s - rest).abs());
                assert!(
                    nearest.fold(f64::INFINITY, f64::min) >= STEP_M / 2.0 - 1e-9,
                    "{rest}"
                );
            }
            let ways: Vec<f64> = between.windows(2).map(|w| w[1] - w[0]).collect();
            let most_m = slots.stride_m();
            assert!(
                ways.iter()
                    .all(|m| (STEP_M - AT_M..=most_m + 1e-9).contains(m)),
                "{count}: {ways:?}"
            );
        }
    }

    /// A UAV that flies from place to place as fast as any, and changes layers meanwhile.
    struct Flyer {
        climb: Climb,
        at: Point,
        course_rad: f64,
        height_m: f64,
        climb_mps: f64,
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        /// However they fly, all get to their layer, and nobody comes near to another.
        #[test]
        fn all_arrive_and_keep_apart(
            courses in proptest::collection::vec((0.0..1.0_f64, 0.0..1.0_f64, -0.6..0.6_f64), 8),
            laps in proptest::collection::vec(0_usize..3, 8),
            late in 0_usize..8,
        ) {
            let side_m = 700.0;
            let mut flyers: Vec<Flyer> = (1..).zip(&courses).zip(&laps).map(|((id, c), from)| {
                let from = (*from).min(1);
                let slot_m = slots(8).layers_m[from] + STEP_M * f64::from(id - 1);
                Flyer {
                    climb: climb(id, from + 1),
                    at: Point::new(c.0 * side_m, c.1 * side_m),
                    course_rad: 6.0 * c.0,
                    height_m: slot_m,
                    climb_mps: 3.0,
                }
            }).collect();
            for tick in 0..4_000_u64 {
                let now_ms = tick * 100;
                let all: Vec<Sighting> = (1..).zip(&flyers).map(|(id, f)| Sighting {
                    north_dm: other(0, f.at.y, 0.0).east_dm,
                    ..other(id, f.at.x, f.height_m)
                }).collect();
                for (i, f) in flyers.iter_mut().enumerate() {
                    // One of them is later than the others, as after a partition.
                    let waits = i == late && now_ms < 60_000;
                    if (tick as usize + i).is_multiple_of(2) && !waits {
                        let others = all.iter().copied().filter(|s| usize::from(s.id) != i + 1);
                        let told = Percept {
                            pose: Pose::new(f.at, f.course_rad),
                            traffic: Traffic::new(5_000.0, others),
                            ..percept(now_ms, f.height_m, &[])
                        };
                        let next_m = f.climb.next_m(&told, true);
                        let way_m = 0.2 * f.climb_mps;
                        f.height_m += f64::clamp(next_m - f.height_m, -way_m, way_m);
                    }
                    let (s, c) = sin_cos(f.course_rad);
                    f.at = Point::new(f.at.x + 1.4 * c, f.at.y + 1.4 * s);
                    f.course_rad += 0.1 * courses[i].2;
                    let is_out = !(0.0..=side_m).contains(&f.at.x) || !(0.0..=side_m).contains(&f.at.y);
                    if is_out {
                        let to = Point::new(side_m / 2.0, side_m / 2.0) - f.at;
                        f.course_rad = skein_geometry::math::atan2(to.y, to.x) + courses[i].2;
                    }
                }
                for (i, a) in flyers.iter().enumerate() {
                    for b in &flyers[i + 1..] {
                        let (flat_m, high_m) = ((a.at - b.at).norm(), a.height_m - b.height_m);
                        let apart_m = (flat_m * flat_m + high_m * high_m).sqrt();
                        prop_assert!(apart_m >= STEP_M / 2.0 - AT_M, "{apart_m} m at {now_ms} ms");
                    }
                }
            }
            for f in &flyers {
                prop_assert!((f.height_m - f.climb.slot_m()).abs() <= AT_M, "{} of {}", f.height_m, f.climb.slot_m());
            }
        }
    }
}
