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
            bands_m: bands
                .map(|(at_m, (low_m, high_m))| (at_m, low_m, high_m))
                .collect(),
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

    /// Whether it counts for that lap or for one before it.
    pub(super) fn counts_until(&self, lap: u16) -> bool {
        let layers = u16::try_from(self.bands_m.len()).unwrap_or(u16::MAX);
        (1..=lap.min(layers.max(1))).any(|earlier| self.counts(earlier)) || self.counts(lap)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::camera::{Camera, Eye};
    use crate::world::fixture::{airframe, polygon, square};
    use crate::world::motion::Piece;
    use crate::world::no_fly::TurnAway;
    use crate::world::{Fact, Judge, Survey};
    use skein_flight::coverage::ring::CellId;
    use skein_flight::trajectory::wind::Wind;
    use skein_geometry::frame::{Point, Pose};
    use std::sync::Arc;

    /// The fixture's area at 45 m and at 100 m, with slots of two UAVs.
    fn judge() -> Judge {
        judge_with(&[])
    }

    /// The same with these zones.
    fn judge_with(zones: &[&[(i32, i32)]]) -> Judge {
        Judge::new(survey(480_000, zones)).with_laps(2)
    }

    /// What is to be seen of an area that reaches so far to the east, millimetres.
    fn survey(east_mm: i32, zones: &[&[(i32, i32)]]) -> Arc<Survey> {
        let mut spec = square(1);
        spec.zones = zones.iter().map(|z| polygon(z)).collect();
        let mut mission = (*spec.mission).clone();
        mission.zones = zones.iter().map(|z| z.to_vec()).collect();
        mission.area = vec![(0, 0), (east_mm, 0), (east_mm, 48_000), (0, 48_000)];
        mission.layers = Some(Arc::new(Layers {
            heights_mm: vec![45_000, 100_000],
            slot_mm: 5_000,
            slots: 2,
            fastest_mmps: 16_000,
        }));
        mission.further_laps = 1;
        spec.mission = Arc::new(mission);
        Arc::new(Survey::new(&spec))
    }

    /// The operator leaves of an area what was seen already: that layer is done.
    #[test]
    fn of_a_smaller_area_that_was_seen_the_layer_is_done() {
        let mut judge = judge();
        assert!((5..10).contains(&along_for(&mut judge, 45.0, 1_000, 24_000)));
        let turn = TurnAway::of(&square(1).mission);
        judge.revise(survey(240_000, &[]), (None, 0, 1, false), 2, turn);
        let seen = judge.layers();
        assert!(seen[0].seen_ms.is_some_and(|t| t < 26_000), "{seen:?}");
        assert_eq!((seen[1].seen_ms, seen[1].lacking), (None, 5));
        assert_eq!(along(&mut judge, 100.0, 100_000), 5);
        assert!(judge.complete() && judge.layers()[1].seen_ms.is_some());
    }

    /// Flies along the only lane at a height.
    fn along(judge: &mut Judge, height_m: f64, at_ms: u64) -> usize {
        along_for(judge, height_m, at_ms, 42_000)
    }

    fn along_for(judge: &mut Judge, height_m: f64, at_ms: u64, for_ms: u64) -> usize {
        let (airframe, camera) = (airframe(), Camera::new(&airframe()));
        let piece = Piece {
            from_ms: at_ms,
            to_ms: at_ms + for_ms,
            start: Pose::new(Point::new(-30.0, 24.0), 0.0),
            speed_mps: 13.0,
            turn_rate_radps: 0.0,
            wind: Wind::CALM,
        };
        let mut facts = Vec::new();
        judge.watch(
            1,
            Eye::new(&airframe, &camera, height_m),
            &piece,
            &mut facts,
        );
        facts
            .iter()
            .filter(|f| matches!(f, Fact::Seen { .. }))
            .count()
    }

    /// What need not be seen may be seen after all else of its layer was: it counts for that.
    #[test]
    fn a_cell_that_is_behind_counts_from_its_own_layer() {
        let zone = [
            (440_000, -200_000),
            (700_000, -200_000),
            (700_000, 250_000),
            (440_000, 250_000),
        ];
        let (mut judge, last) = (judge_with(&[&zone]), CellId { col: 9, row: 0 });
        let cells = judge.survey().cells();
        assert!(
            cells
                .iter()
                .any(|c| c.id == last && c.uncoverable.is_some())
        );
        along_for(&mut judge, 45.0, 1_000, 36_000);
        assert!(judge.layers()[0].seen_ms.is_some() && !judge.saw(1, last, 1));
        along(&mut judge, 100.0, 100_000);
        assert!(!judge.saw(1, last, 1), "from another layer");
        along(&mut judge, 45.0, 200_000);
        assert!(judge.saw(1, last, 1) && !judge.saw(1, last, 2));
        along(&mut judge, 100.0, 300_000);
        assert!(judge.saw(1, last, 2));
    }

    #[test]
    fn pictures_count_from_within_the_layer_of_the_lap_alone() {
        let mut judge = judge();
        let first = CellId { col: 0, row: 0 };
        for outside_m in [42.9, 52.1, 100.0] {
            assert_eq!(along(&mut judge, outside_m, 1_000), 0, "{outside_m}");
        }
        assert!(!judge.saw(1, first, 1));
        assert_eq!(judge.layers()[0].lacking, 10);
        // In the middle of this flight the first lap ends: what is seen after it counts for none.
        assert_eq!(along(&mut judge, 48.0, 100_000), 10);
        assert!(judge.saw(1, first, 1) && !judge.saw(1, first, 2) && !judge.complete());
        assert_eq!(along(&mut judge, 45.0, 200_000), 0);
        assert_eq!(along(&mut judge, 104.0, 300_000), 10);
        assert!(judge.saw(1, first, 2) && judge.complete());
        let seen = judge.layers();
        assert_eq!((seen.len(), seen[0].lap, seen[1].lap), (2, 1, 2));
        assert!(seen[0].seen_ms.is_some_and(|t| t > 130_000 && t < 145_000));
        assert!(seen[1].seen_ms.is_some_and(|t| t > 330_000 && t < 345_000));
        assert_eq!(
            judge.longest_gap_ms(),
            None,
            "nothing is seen again from there"
        );
    }
}
