//! Of a mission that is flown in layers each cell was seen from within each layer before anybody
//! calls the mission finished, and its UAVs keep apart while they change layers (S1).

use super::Findings;
use crate::world::{Approach, LayerSeen};
use skein_peer::Mission;

/// The rule `layers`.
#[derive(Clone, Debug, Default)]
pub struct LayerCheck {
    told: bool,
}

impl LayerCheck {
    /// A UAV says that this mission is finished; `seen` is what cameras saw of its laps, by the
    /// true heights of those who looked: nothing where all is flown at one height.
    pub fn on_finished(
        &mut self,
        (now_ms, id): (u64, u16),
        mission: &Mission,
        seen: &[LayerSeen],
        found: &mut Findings,
    ) {
        // What ends by time or by an order need not have been seen.
        let ends = mission.cancelled || mission.ends_after_s().is_some();
        if self.told || ends {
            return;
        }
        let Some(layer) = seen.iter().find(|l| l.seen_ms.is_none()) else {
            return;
        };
        self.told = true;
        let LayerSeen {
            lap,
            height_m,
            lacking,
            ..
        } = *layer;
        found.broken("layers", now_ms, Some(id), || {
            format!(
                "calls the mission finished, and {lacking} cells of lap {lap} were not seen from the layer at {height_m} m"
            )
        });
    }
}

/// Whether two that came near are judged: where they keep apart by agreement or while they change
/// layers, but for two of one number, which have one slot.
#[must_use]
pub fn is_judged(mission: &Mission, approach: &Approach, of: impl Fn(u16) -> u16) -> bool {
    let in_layers = mission.layers.is_some() && of(approach.a) != of(approach.b);
    mission.separation_mm > 0 || in_layers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::fixture;
    use skein_peer::layers::Layers;
    use std::sync::Arc;

    fn mission() -> Mission {
        Mission {
            layers: Some(Arc::new(Layers {
                heights_mm: vec![45_000, 100_000],
                slot_mm: 5_000,
                slots: 2,
                fastest_mmps: 20_000,
            })),
            further_laps: 1,
            ..(*fixture::square(2).mission).clone()
        }
    }

    fn seen(second_ms: Option<u64>) -> [LayerSeen; 2] {
        let layer = |lap, height_m, seen_ms: Option<u64>| LayerSeen {
            lap,
            height_m,
            seen_ms,
            lacking: if seen_ms.is_some() { 0 } else { 3 },
        };
        [layer(1, 45.0, Some(9_000)), layer(2, 100.0, second_ms)]
    }

    #[test]
    fn who_calls_a_volume_finished_of_which_a_layer_was_not_seen_breaks_the_rule() {
        let check = |mission: &Mission, second_ms| {
            let (mut check, mut found) = (LayerCheck::default(), Findings::new(1));
            for id in [1, 2] {
                check.on_finished((20_000, id), mission, &seen(second_ms), &mut found);
            }
            found.violations
        };
        assert!(check(&mission(), Some(19_000)).is_empty());
        let broken = check(&mission(), None);
        assert_eq!(broken.len(), 1, "{broken:?}");
        let text = &broken[0].text;
        assert!(
            text.contains("3 cells of lap 2") && text.contains("100 m"),
            "{text}"
        );
        let ended = Mission {
            cancelled: true,
            ..mission()
        };
        assert!(check(&ended, None).is_empty());
    }

    #[test]
    fn those_who_pass_each_other_between_layers_are_judged_but_for_twins() {
        let near = Approach {
            at_ms: 1,
            a: 1,
            b: 9,
            distance_m: 1.0,
        };
        let flat = (*fixture::square(2).mission).clone();
        assert!(!is_judged(&flat, &near, |id| id));
        assert!(is_judged(&mission(), &near, |id| id));
        assert!(!is_judged(&mission(), &near, |id| if id == 9 {
            1
        } else {
            id
        }));
    }
}
