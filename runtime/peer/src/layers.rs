//! The layers of a mission (D2.7 §1.2.2, a path of dimension 3): heights at each of which the
//! whole area is seen once, a lap for each, the lowest first. A part of its record, so that all
//! fly the same lap at the same heights. How a UAV gets from one to the next is
//! `skein_behaviors::reactive::climb`'s.
//!
//! | lap of the mission | height |
//! |---|---|
//! | 0 | the lowest layer |
//! | one more | the next layer; after the highest the lowest again |
//!
//! The footprint, and the loop with it, are those of the lowest layer: one loop serves all of
//! them, and from higher up pictures overlap by more.

use crate::mission::Mission;
use serde::{Deserialize, Serialize};
use skein_behaviors::reactive::climb::{AT_M, Slots};
use skein_geometry::hash::Fnv;

/// Most layers of a mission: at the least distance of two they reach as high as small fixed
/// wings fly.
pub const LAYERS_MAX: usize = 16;

/// The highest slot, mm above the origin.
pub const HEIGHT_MAX_MM: u32 = 5_000_000;

/// The least height between two slots, mm: half of it is what a UAV that changes layers keeps
/// from those whom it passes, and heights are held by half a metre.
pub const SLOT_MIN_MM: u32 = 4_000;

/// Beyond the slots of a layer what is seen still counts for it, metres, by whoever judges; a UAV
/// itself counts half as much.
pub const BAND_M: f64 = 4.0 * AT_M;

/// The heights of a mission that is flown in layers. Whole numbers alone, as all of a mission.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Layers {
    /// The lowest slot of each layer above the origin, rising, mm.
    pub heights_mm: Vec<u32>,
    /// From one UAV's slot to the next above it, mm.
    pub slot_mm: u32,
    /// How many slots each layer has: UAVs of the fleet.
    pub slots: u16,
    /// The fastest airspeed of the fleet, mm/s.
    pub fastest_mmps: u32,
}

/// Which layer is flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Layer {
    /// Which it is, from 0.
    pub nth: usize,
    /// Of how many.
    pub of: usize,
    /// Its lowest slot above the origin, mm.
    pub height_mm: u32,
}

fn metres(mm: u32) -> f64 {
    f64::from(mm) / 1000.0
}

impl Layers {
    /// Which layer a lap is flown in, from 0.
    #[must_use]
    pub fn of_lap(&self, lap: u16) -> usize {
        usize::from(lap) % self.heights_mm.len().max(1)
    }

    /// The slots, in metres.
    #[must_use]
    pub fn slots(&self) -> Slots {
        Slots {
            layers_m: self.heights_mm.iter().copied().map(metres).collect(),
            step_m: metres(self.slot_mm),
            count: self.slots,
        }
    }

    /// The fastest airspeed of the fleet, m/s.
    #[must_use]
    pub fn fastest_mps(&self) -> f64 {
        metres(self.fastest_mmps)
    }

    /// Between which heights what is seen counts, for each layer, metres.
    #[must_use]
    pub fn bands_m(&self) -> Vec<(f64, f64)> {
        let slots = self.slots();
        let all = 0..self.heights_mm.len();
        all.filter_map(|layer| slots.band_m(layer, BAND_M))
            .collect()
    }

    /// What is wrong with it, if anything.
    ///
    /// # Errors
    /// What was expected.
    pub fn check(&self) -> Result<(), String> {
        let n = self.heights_mm.len();
        if n == 0 || n > LAYERS_MAX {
            return Err(format!("expected 1 to {LAYERS_MAX} layers, found {n}"));
        }
        if self.slots == 0 || self.fastest_mmps == 0 || self.slot_mm < SLOT_MIN_MM {
            return Err(format!(
                "slots of two UAVs are {} m apart; expected {} m or more, half of which is kept from those who are passed",
                metres(self.slot_mm),
                metres(SLOT_MIN_MM)
            ));
        }
        let thick_mm = u64::from(self.slot_mm) * u64::from(self.slots - 1);
        let least_mm = thick_mm + u64::from(self.slot_mm);
        for pair in self.heights_mm.windows(2) {
            let (low_mm, high_mm) = (u64::from(pair[0]), u64::from(pair[1]));
            if high_mm <= low_mm {
                return Err(format!(
                    "the layer at {} m follows that at {} m; expected rising heights",
                    metres(pair[1]),
                    metres(pair[0])
                ));
            }
            if high_mm - low_mm < least_mm {
                #[allow(clippy::cast_precision_loss, reason = "a height")]
                let least_m = least_mm as f64 / 1000.0;
                return Err(format!(
                    "the layers at {} m and {} m leave no room for a slot of each of {} UAVs, {} m apart; expected layers {least_m} m apart, fewer UAVs or a smaller slot_step_m",
                    metres(pair[0]),
                    metres(pair[1]),
                    self.slots,
                    metres(self.slot_mm)
                ));
            }
        }
        let top_mm = u64::from(self.heights_mm[n - 1]) + thick_mm;
        if top_mm > u64::from(HEIGHT_MAX_MM) {
            return Err(format!(
                "the highest slot is above {} m; expected lower layers",
                metres(HEIGHT_MAX_MM)
            ));
        }
        Ok(())
    }

    /// Adds all of it to a hash.
    pub(crate) fn hash(&self, h: &mut Fnv) {
        h.write_i64(i64::try_from(self.heights_mm.len()).unwrap_or(i64::MAX));
        for mm in &self.heights_mm {
            h.write_i64(i64::from(*mm));
        }
        h.write_i64(i64::from(self.slot_mm));
        h.write_i64(i64::from(self.slots));
        h.write_i64(i64::from(self.fastest_mmps));
    }

    /// Identifies its heights among the loops of one area: what was seen at others says nothing.
    pub(crate) fn bits(&self) -> u64 {
        let mut h = Fnv::new();
        self.hash(&mut h);
        h.finish()
    }
}

/// What a mission in layers is.
impl Mission {
    /// The layer that its lap is flown in; none where all is flown at one.
    #[must_use]
    pub fn layer(&self) -> Option<Layer> {
        let layers = self.layers.as_ref()?;
        let nth = layers.of_lap(self.lap);
        Some(Layer {
            nth,
            of: layers.heights_mm.len(),
            height_mm: *layers.heights_mm.get(nth)?,
        })
    }

    /// Dimension of what is to be seen (D2.7 §1.2.2): 3 in layers.
    #[must_use]
    pub fn dimension(&self) -> u8 {
        if self.layers.is_some() {
            3
        } else {
            self.task.dimension()
        }
    }

    /// Whether everything is to be seen more than once; in layers more than once in each.
    pub(crate) fn sees_again(&self) -> bool {
        let Some(layers) = &self.layers else {
            return self.is_patrol();
        };
        let laps = usize::from(self.lap) + usize::from(self.further_laps) + 1;
        laps > layers.heights_mm.len()
    }

    /// Whether its layers can be flown.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn check_layers(&self) -> Result<(), String> {
        let Some(layers) = &self.layers else {
            return Ok(());
        };
        layers.check()?;
        let laps = usize::from(self.lap) + usize::from(self.further_laps) + 1;
        if !self.cancelled && !laps.is_multiple_of(layers.heights_mm.len()) {
            return Err(format!(
                "{laps} laps do not see each of {} layers as often",
                layers.heights_mm.len()
            ));
        }
        if !self.task.is_area() {
            return Err(
                "an area in lanes is flown in layers; not exact passes, points or lines".into(),
            );
        }
        if self.separation_mm > 0 {
            return Err(
                "UAVs that keep apart at one height cannot fly in layers; leave separation_m out"
                    .into(),
            );
        }
        if self.goes_round() || self.traces() {
            return Err("what is flown in layers ends with the highest; expected a diagram that does not go on".into());
        }
        let looks = [
            ("detections", !self.detections.is_empty()),
            ("counts", !self.counts.is_empty()),
            ("streets", self.streets.is_some()),
            ("crowds", self.crowd.is_some()),
        ];
        if let Some((what, _)) = looks.iter().find(|(_, asked)| *asked) {
            return Err(format!(
                "{what} are told from one height; leave them out, or the layers"
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::sync::Arc;

    /// What is changed, and a part of what is said of it.
    type Case<T> = (fn(&mut T), &'static str);

    pub(crate) fn three() -> Layers {
        Layers {
            heights_mm: vec![60_000, 100_000, 140_000],
            slot_mm: 5_000,
            slots: 8,
            fastest_mmps: 20_000,
        }
    }

    fn mission() -> Mission {
        Mission {
            layers: Some(Arc::new(three())),
            further_laps: 2,
            ..crate::testing::mission(1, 6, 4)
        }
    }

    #[test]
    fn each_lap_has_its_layer_and_the_highest_is_followed_by_the_lowest() {
        let mut m = mission();
        m.further_laps = 5;
        m.check_layers().unwrap();
        let heights: Vec<u32> = (0..6)
            .map(|n| {
                let lap = if n == 0 {
                    m.clone()
                } else {
                    m.later_lap(1 + n).unwrap()
                };
                assert_eq!(lap.dimension(), 3);
                lap.check_layers().unwrap();
                lap.layer().unwrap().height_mm / 1000
            })
            .collect();
        assert_eq!(heights, [60, 100, 140, 60, 100, 140]);
        assert!(m.sees_again() && !mission().sees_again());
        let bands = three().bands_m();
        assert_eq!(bands[1], (98.0, 137.0));
        assert!(bands.windows(2).all(|b| b[0].1 < b[1].0));
    }

    #[test]
    fn layers_that_cannot_be_flown_are_refused_with_what_was_expected() {
        let cases: [Case<Layers>; 8] = [
            (|l| l.heights_mm.clear(), "found 0"),
            (
                |l| l.heights_mm = (1..=17).map(|n| n * 50_000).collect(),
                "found 17",
            ),
            (|l| l.heights_mm[1] = 60_000, "expected rising heights"),
            (
                |l| l.heights_mm[1] = 50_000,
                "the layer at 50 m follows that at 60 m",
            ),
            (|l| l.heights_mm[1] = 99_999, "expected layers 40 m apart"),
            (|l| l.slots = 9, "each of 9 UAVs"),
            (|l| l.slot_mm = 3_999, "expected 4 m or more"),
            (|l| l.heights_mm[2] = 4_970_000, "expected lower layers"),
        ];
        for (change, wanted) in cases {
            let mut layers = three();
            change(&mut layers);
            let why = layers.check().unwrap_err();
            assert!(why.contains(wanted), "{why}");
        }
        assert_eq!(three().check(), Ok(()));
        let missions: [Case<Mission>; 4] = [
            (|m| m.further_laps = 3, "4 laps do not see each of 3 layers"),
            (|m| m.task = crate::CoverageTask::Exact, "not exact passes"),
            (|m| m.separation_mm = 30_000, "leave separation_m out"),
            (
                |m| m.detections.push(crate::criteria::Criterion::default()),
                "detections",
            ),
        ];
        for (change, wanted) in missions {
            let mut m = mission();
            change(&mut m);
            let why = m.check_layers().unwrap_err();
            assert!(why.contains(wanted), "{why}");
            assert!(Arc::new(m).geometry().is_err());
        }
        assert_eq!(mission().check_layers(), Ok(()));
    }

    /// On the wire it is said where there are layers, and by whole numbers.
    #[test]
    fn what_has_no_layers_says_nothing_of_them_and_what_has_is_heard_as_it_was_said() {
        let bytes = |m: &Mission| -> Vec<u8> {
            let pieces = crate::library::chunks(m).unwrap();
            pieces.into_iter().flat_map(|p| p.bytes).collect()
        };
        let tells = |m: &Mission| bytes(m).windows(6).any(|w| w == b"layers");
        let (flat, volume) = (crate::testing::mission(1, 6, 4), mission());
        assert!(!tells(&flat) && tells(&volume));
        let heard: Mission = cbor4ii::serde::from_slice(&bytes(&volume)).unwrap();
        assert_eq!(heard, volume);
        // Three layers cost a mission some eighty bytes.
        let flat = Mission {
            layers: None,
            ..volume.clone()
        };
        assert!((60..100).contains(&(bytes(&volume).len() - bytes(&flat).len())));
    }

    /// What was seen at one height says nothing of another, though the cells are the same.
    #[test]
    fn other_heights_are_another_loop() {
        let hash = |m: Mission| Arc::new(m).geometry().unwrap().coverage_loop.hash();
        let mut higher = three();
        higher.heights_mm[2] += 1_000;
        let higher = Mission {
            layers: Some(Arc::new(higher)),
            ..mission()
        };
        assert_ne!(higher.content_hash(), mission().content_hash());
        assert_ne!(hash(higher), hash(mission()));
        let without = Mission {
            layers: None,
            ..mission()
        };
        assert_ne!(hash(without), hash(mission()));
        let second = mission().next_lap().unwrap();
        let known = Arc::new(mission())
            .geometry()
            .unwrap()
            .coverage_loop
            .hash_in_lap(0, 1);
        assert_eq!(hash(second), known, "whoever hears of a later lap can tell");
    }
}
