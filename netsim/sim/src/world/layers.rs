//! Which heights count for which lap of a mission that is flown in layers (D2.7 §1.2.2), by the
//! true height of who looks, whatever a peer says.

use skein_peer::layers::Layers;
use std::collections::BTreeMap;

/// What came of a lap that is flown in a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerSeen {
    /// Which lap, from 1.
    pub lap: u16,
    /// From which height on what is seen counts for it: the lowest slot, metres.
    pub height_m: f64,
    /// When the last of its cells was seen, milliseconds.
    pub seen_ms: Option<u64>,
    /// How many of its cells were not seen yet.
    pub lacking: usize,
}

/// The layers of one mission, and when all of each lap was seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LayerBook {
    /// The lowest slot of each layer, and between which heights what is seen counts, metres;
    /// nothing where all heights count.
    bands_m: Vec<(f64, f64, f64)>,
    /// When all of a lap, from 1, was seen, milliseconds.
    done_ms: BTreeMap<u16, u64>,
    /// From where somebody looks now, metres.
    from_m: f64,
}

impl LayerBook {
    /// The layers of a mission; none where all is flown at one height.
    pub(super) fn of(layers: Option<&Layers>) -> Self {
        let Some(layers) = layers else {
            return Self::default();
        };
        let lowest = layers.slots().layers_m;
        let bands = lowest.into_iter().zip(layers.bands_m());
        Self {
            bands_m: bands.map(|(at_m, (low_m, high_m))| (at_m, low_m, high_m)).collect(),
            ..Self::default()
        }
    }

    /// Takes over when laps were seen, if it is of the same heights; says whether it is.
    pub(super) fn goes_on(&mut self, other: &Self) -> bool {
        if self.bands_m != other.bands_m {
            return false;
        }
        for (lap, at_ms) in &other.done_ms {
            self.done_ms.entry(*lap).or_insert(*at_ms);
        }
        true
    }

    /// Somebody looks from this height.
    pub(super) fn looks_from(&mut self, height_m: f64) {
        self.from_m = height_m;
    }

    /// Whether all is flown at one height.
    pub(super) fn is_flat(&self) -> bool {
        self.bands_m.is_empty()
    }

    fn of_lap(&self, lap: u16) -> Option<(f64, f64, f64)> {
        let nth = usize::from(lap.saturating_sub(1)).checked_rem(self.bands_m.len())?;
        self.bands_m.get(nth).copied()
    }

    /// Whether what is seen from there counts for a lap, from 1.
    pub(super) fn counts(&self, lap: u16) -> bool {
        let band = self.of_lap(lap);
        band.is_none_or(|(_, low_m, high_m)| (low_m..=high_m).contains(&self.from_m))
    }

    /// All of a lap was seen.
    pub(super) fn done(&mut self, lap: u16, at_ms: u64) {
        if !self.bands_m.is_empty() {
            self.done_ms.entry(lap).or_insert(at_ms);
        }
    }

    /// What came of each of so many laps, of which one is under way: how many of how many cells
    /// were seen in it.
    pub(super) fn seen(&self, so_far: (u16, usize, usize), laps: u16) -> Vec<LayerSeen> {
        let (now, n_covered, n_coverable) = so_far;
        let one = |lap: u16| {
            let (height_m, ..) = self.of_lap(lap)?;
            let seen_ms = self.done_ms.get(&lap).copied();
            let lacking = match seen_ms {
                Some(_) => 0,
                None if lap == now => n_coverable - n_covered,
                None => n_coverable,
            };
            Some(LayerSeen {
                lap,
                height_m,
                seen_ms,
                lacking,
            })
        };
        (1..=laps).filter_map(one).collect()
    }
}
