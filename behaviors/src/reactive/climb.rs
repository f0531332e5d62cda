//! Heights of a volume that is flown in layers, and how UAVs change from one layer to another
//! past each other (D2.7 §1.2.2, §1.3; reactive layer).
//!
//! In each layer each UAV has a slot of its own, so many of them one above the other. A UAV that
//! changes layers goes from one *rest* to the next: its own slots, and the heights half-way
//! between two slots, where nobody cruises. Nobody agrees on anything: it goes on when those
//! whom it senses leave it the room.
//!
//! | another UAV that is sensed | from a rest to the next |
//! |---|---|
//! | is so far away that it cannot come near before the next rest is reached | goes |
//! | is at least half a slot below or above all of the way | goes |
//! | has a lower number and is less than half a slot and one way between two rests beyond its end | waits |
//! | is nearer | waits |
//! | may be there unseen: there is no sensor, or it reads no more than it can hold | waits |
//!
//! # Guarantees
//! Of UAVs that follow this law with the same slots, sense each other without delay and climb at
//! no less than they say, any two are half a slot apart in height or farther apart on the ground
//! than they can approach each other meanwhile: whoever begins later sees where the other is,
//! each goes no farther than the next rest before it looks again, and of two who begin at once the one
//! with the higher number leaves room for all that the other may do. Who flies at its own slot
//! yields to nobody.
//!
//! # Complexity
//! A few comparisons for each UAV that is sensed, and one for each slot between two rests.

use crate::percept::Percept;
use crate::traffic::Sighting;

/// Nearer than this to a height a UAV is at it, metres.
pub const AT_M: f64 = 0.5;

/// So long after a percept what it says may still be acted on, seconds: setpoints are refused
/// later.
const LATE_S: f64 = 1.0;

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
}

impl Slots {
    /// All of a layer's slots, with so much beyond both ends, metres.
    #[must_use]
    pub fn band_m(&self, layer: usize, beyond_m: f64) -> Option<(f64, f64)> {
        let low_m = *self.layers_m.get(layer)?;
        let high_m = low_m + self.step_m * f64::from(self.count.saturating_sub(1));
        Some((low_m - beyond_m, high_m + beyond_m))
    }

    /// How far around it a UAV has to see nobody between two rests, metres, where it climbs at
    /// this rate.
    #[must_use]
    pub fn clear_m(&self, climb_mps: f64, fastest_mps: f64) -> f64 {
        let takes_s = self.stride_m() / climb_mps.max(0.1) + LATE_S;
        self.step_m + 2.0 * fastest_mps * takes_s
    }

    /// The longest way from one rest to the next, metres.
    fn stride_m(&self) -> f64 {
        let gaps = self.gaps_m().map(|(low_m, high_m, parts)| (high_m - low_m) / f64::from(parts.max(1)));
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

impl Climb {
    /// The way of the UAV with this number to its slot in a layer; `offset_m` is how far its
    /// slot is above the lowest of each layer.
    #[must_use]
    pub fn new(slots: Slots, (id, offset_m): (u16, f64), layer: usize, speeds_mps: (f64, f64)) -> Self {
        let (climb_mps, fastest_mps) = speeds_mps;
        Self {
            layer: layer.min(slots.layers_m.len().saturating_sub(1)),
            slots,
            id,
            offset_m,
            climb_mps,
            fastest_mps,
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
        (self.slot_m() - height_m).abs() / self.climb_mps.max(0.1)
    }

    /// The height to fly to now, metres above the origin: the next rest, or where it is.
    #[must_use]
    pub fn next_m(&self, percept: &Percept) -> f64 {
        let (at_m, to_m) = (percept.height_m, self.slot_m());
        if (at_m - to_m).abs() <= AT_M {
            return to_m;
        }
        let rests = self.rests_m();
        let upwards = to_m > at_m;
        let resting = rests.iter().copied().find(|r| (r - at_m).abs() <= AT_M);
        let beyond = |r: &f64| if upwards { *r > at_m + AT_M } else { *r < at_m - AT_M };
        let mut next = rests.iter().copied().filter(beyond);
        let next_m = if upwards { next.next() } else { next.next_back() };
        let next_m = next_m.unwrap_or(to_m);
        match resting {
            // Between two rests it goes on: it looked before it began.
            Some(rest_m) if !self.has_room(percept, rest_m, next_m) => rest_m,
            _ => next_m,
        }
    }

    /// Where it may stay while others pass, ascending: half-way between two slots, and its own.
    fn rests_m(&self) -> Vec<f64> {
        let mut rests = self.slots.between_m();
        rests.extend(self.slots.layers_m.iter().map(|low| low + self.offset_m));
        rests.sort_by(f64::total_cmp);
        rests.dedup_by(|b, a| (*b - *a).abs() < AT_M);
        rests
    }

    /// Whether those who are sensed leave it the way from a rest to the next.
    fn has_room(&self, percept: &Percept, from_m: f64, to_m: f64) -> bool {
        let traffic = &percept.traffic;
        let clear_m = self.slots.clear_m(self.climb_mps, self.fastest_mps);
        if traffic.range_m < clear_m {
            return false;
        }
        let here = percept.pose.position();
        let is_near = |s: &&Sighting| (s.at() - here).norm() <= clear_m;
        // Beyond the last one that it holds there may be others as near.
        if traffic.is_full() && traffic.seen().all(|s| is_near(&s)) {
            return false;
        }
        let (step_m, stride_m) = (self.slots.step_m, self.slots.stride_m());
        let (low_m, high_m) = (from_m.min(to_m), from_m.max(to_m));
        let upwards = to_m > from_m;
        traffic.seen().filter(is_near).all(|other| {
            let ahead_m = if other.id < self.id { stride_m } else { 0.0 };
            let (below_m, above_m) = if upwards { (0.0, ahead_m) } else { (ahead_m, 0.0) };
            // A slot is half a step from where a rest is: who is there keeps enough.
            let apart_m = step_m / 2.0 - AT_M / 2.0;
            let height_m = other.height_m();
            height_m <= low_m - apart_m - below_m || height_m >= high_m + apart_m + above_m
        })
    }
}
