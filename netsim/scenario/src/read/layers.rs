//! The layers of a mission (D2.7 §1.2.2): `mission.layers_m`, and what a fleet needs to fly them.
//! Whether their heights leave room for each other is the mission's own check.

use super::Stated;
use super::fleet::Fleet;
use super::shared::MAX_HEIGHT_M;
use super::targets::Asked;
use crate::request::AreaPlanner;
use skein_interop::json::{Error, Node};
use skein_netsim::spec::StormSpec;
use skein_peer::Mission;
use skein_peer::layers::{LAYERS_MAX, Layers};
use std::sync::Arc;

/// How far UAVs that fly in layers sense each other, metres: transponders are received for some
/// kilometres.
pub(crate) const SENSED_M: f64 = 5_000.0;

/// Reads `mission.layers_m`: heights above home, rising, the first of them the flight level.
pub(crate) fn of_mission(mission: &Node<'_>, level_m: f64) -> Result<Vec<f64>, Error> {
    let Some(list) = mission.get("layers_m")? else {
        return Ok(Vec::new());
    };
    let items = list.items()?;
    if items.is_empty() || items.len() > LAYERS_MAX {
        return Err(list.wrong(format!(
            "has {} layers; expected 1 to {LAYERS_MAX}, or the field left out where all is flown at level_m",
            items.len()
        )));
    }
    let mut heights: Vec<f64> = Vec::with_capacity(items.len());
    for item in &items {
        let height_m = item.number(0.0, MAX_HEIGHT_M, "metres above home")?;
        match heights.last() {
            None if (height_m - level_m).abs() > 1e-9 => {
                return Err(item.wrong(format!(
                    "the lowest layer is the flight level, from which the camera's footprint is reckoned; expected {level_m}, or level_m: {height_m}"
                )));
            }
            Some(below_m) if height_m <= *below_m => {
                return Err(item.wrong(format!(
                    "{height_m} m are not above the layer before, at {below_m} m; expected rising heights"
                )));
            }
            _ => heights.push(height_m),
        }
    }
    Ok(heights)
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, and readers limit it"
)]
fn mm(m: f64) -> u32 {
    (m * 1000.0).round() as u32
}

/// The layers of the mission; none where all is flown at one height.
pub(crate) fn of_fleet(heights_m: &[f64], fleet: &Fleet) -> Option<Arc<Layers>> {
    let fastest = fleet.members.iter().map(|m| m.airframe.max_mps);
    (!heights_m.is_empty()).then(|| {
        Arc::new(Layers {
            heights_mm: heights_m.iter().copied().map(mm).collect(),
            slot_mm: mm(fleet.slot_step_m),
            slots: u16::try_from(fleet.members.len()).unwrap_or(u16::MAX),
            fastest_mmps: mm(fastest.fold(0.0, f64::max)),
        })
    })
}

/// In how many laps everything is seen that often: each goes through all layers.
pub(crate) fn laps(s: &Stated) -> Result<u16, Error> {
    let layers = u16::try_from(s.layers_m.len().max(1)).unwrap_or(u16::MAX);
    s.laps.checked_mul(layers).ok_or_else(|| {
        let text = format!("{} laps through {layers} layers are too many", s.laps);
        s.places.wrong("laps", text)
    })
}

/// What flying in layers asks for besides the layers themselves.
pub(crate) fn check(s: &Stated, mission: &Mission) -> Result<(), Error> {
    let Some(layers) = &mission.layers else {
        return Ok(());
    };
    let wrong = |field: &str, text: String| Err(s.places.wrong(field, text));
    if s.fleet.separation_m > 0.0 {
        let text = "UAVs that keep apart at one height cannot fly in layers; leave it out, so that each has a slot in each layer";
        return wrong("fleet.separation_m", text.into());
    }
    if s.asked != Asked::Area(AreaPlanner::Lanes) {
        let text = "an area in lanes is flown in layers; expected an area, and planner: \"lanes\"";
        return wrong("mission.layers_m", text.into());
    }
    let slots = s.fleet.members.iter().enumerate();
    let slot_m = |i: usize| s.terrain.level_m + s.fleet.slot_step_m * i as f64;
    let mut elsewhere = slots.filter(|(i, m)| (m.height_m - slot_m(*i)).abs() > 1e-6);
    if let Some((i, member)) = elsewhere.next() {
        let text = format!(
            "UAV {} has a slot of its own in each layer, {} m above its lowest; leave its height_m out",
            member.id,
            s.fleet.slot_step_m * i as f64
        );
        return wrong(&format!("fleet.uavs[{i}].height_m"), text);
    }
    let kept_m = s.fleet.slot_step_m / 2.0;
    if s.run.min_separation_m > kept_m {
        let text = format!(
            "who changes layers passes others by half a slot, {kept_m} m; expected no more, or a larger fleet.slot_step_m"
        );
        return wrong("checks.min_separation_m", text);
    }
    match layers.check().and_then(|()| mission.check_layers()) {
        Ok(()) => Ok(()),
        Err(text) => wrong("mission.layers_m", text),
    }
}

/// The storm of a scenario: in layers there is a slot for each UAV of the fleet, and for no more.
pub(crate) fn storm(s: &Stated) -> StormSpec {
    let mut storm = s.storm;
    if !s.layers_m.is_empty() {
        (storm.troubles.max_uavs, storm.troubles.max_crowd) = (0, 0);
    }
    storm
}

#[cfg(test)]
mod tests {
    use crate::{Overrides, Scenario};

    const TRIAL: &str = include_str!("../../../../configs/trials/volume.json5");

    fn with(changes: &[(&str, &str)]) -> Result<Scenario, String> {
        let text = changes.iter().fold(TRIAL.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        });
        let files = crate::builtin::files();
        let read = crate::parse_with("v.json5", &text, &files, &Overrides::default());
        read.map_err(|e| e.to_string())
    }

    /// What is changed, and the place and a part of what is said of it.
    type Case = (
        &'static [(&'static str, &'static str)],
        &'static str,
        &'static str,
    );

    const LAYERS: &str = "layers_m: [60, 160, 260]";

    #[test]
    fn what_cannot_be_flown_in_layers_is_refused_with_its_place() {
        let cases: [Case; 14] = [
            (
                &[(LAYERS, "layers_m: []")],
                "mission.layers_m",
                "has 0 layers",
            ),
            (&[(LAYERS, "layers_m: 60")], "mission.layers_m", "list"),
            (
                &[(LAYERS, "layers_m: [70, 160]")],
                "mission.layers_m[0]",
                "expected 60, or level_m: 70",
            ),
            (
                &[(LAYERS, "layers_m: [60, 60]")],
                "mission.layers_m[1]",
                "expected rising heights",
            ),
            (
                &[(LAYERS, "layers_m: [60, 50]")],
                "mission.layers_m[1]",
                "not above the layer before",
            ),
            (
                &[(LAYERS, "layers_m: [60, 5001]")],
                "mission.layers_m[1]",
                "5000",
            ),
            (
                &[(LAYERS, "layers_m: [60, 70]")],
                "mission.layers_m",
                "expected layers 15 m apart",
            ),
            (
                &[
                    ("slot_step_m: 5", "slot_step_m: 3.9"),
                    ("min_separation_m: 2", "min_separation_m: 1"),
                ],
                "mission.layers_m",
                "expected 4 m or more",
            ),
            (
                &[("min_separation_m: 2", "min_separation_m: 3")],
                "checks.min_separation_m",
                "2.5 m",
            ),
            (
                &[(
                    "launch: \"base\", slot_step_m: 5",
                    "launch: \"spread\", separation_m: 30",
                )],
                "fleet.separation_m",
                "a slot in each layer",
            ),
            (
                &[("seed: 1,", "seed: 1, planner: \"exact\",")],
                "mission.layers_m",
                "planner: \"lanes\"",
            ),
            (
                &[("diagram: \"volume\"", "diagram: \"patrol\"")],
                "mission.layers_m",
                "a diagram that does not go on",
            ),
            (
                &[(
                    "diagram: \"volume\"",
                    "counts: [{ name: \"a\", what: \"passing\", circle: { east_m: 100, north_m: 100, radius_m: 10 } }]",
                )],
                "mission.layers_m",
                "counts are told from one height",
            ),
            (
                &[("seed: 1,", "seed: 1, laps: 2,")],
                "mission.diagram",
                "the mission has laps",
            ),
        ];
        for (changes, place, says) in cases {
            let why = with(changes).map(drop).unwrap_err();
            assert!(
                why.contains(place) && why.contains(says),
                "{changes:?}: {why}"
            );
        }
    }

    #[test]
    fn each_lap_goes_through_all_layers_and_each_uav_has_a_slot_in_each() {
        let plain = with(&[(", diagram: \"volume\"", "")]).unwrap().spec;
        let layers = plain.mission.layers.clone().unwrap();
        assert_eq!(layers.heights_mm, [60_000, 160_000, 260_000]);
        assert_eq!(
            (layers.slot_mm, layers.slots, layers.fastest_mmps),
            (5_000, 3, 20_000)
        );
        assert!(plain.mission.diagram.is_none() && plain.mission.further_laps == 2);
        assert!((plain.uavs[0].airframe.climb_mps - 3.5).abs() < 1e-9);
        // A storm brings no UAVs for whom there is no slot.
        let troubles = plain.storm.troubles;
        assert_eq!((troubles.max_uavs, troubles.max_crowd), (0, 0));
        let twice = with(&[
            (", diagram: \"volume\"", ""),
            ("seed: 1,", "seed: 1, laps: 2,"),
        ]);
        assert_eq!(twice.unwrap().spec.mission.further_laps, 5);
        let alone = with(&[(LAYERS, "layers_m: [60]")])
            .unwrap()
            .spec
            .mission
            .further_laps;
        assert_eq!(alone, 0);
    }
}
