//! Which spanning tree the lanes of an area follow, when the scenario leaves it open: the
//! one whose loop takes the least energy in the mission's wind (D2.7 §3.6.2).
//!
//! Energy knows both what turns cost (a banked wing carries more than the weight) and
//! what the wind costs (lanes across it are sooner flown than lanes along it). Peers do
//! not choose: the mission names the tree.

use crate::document::{Fields, Node};
use crate::error::ScenarioError;
use crate::flight_model::turning_mps;
use skein_flight::airframe::Airframe;
use skein_flight::coverage::area::{CoverageLoop, Direction, Tree};
use skein_flight::trajectory::timed::Trajectory;
use skein_flight::trajectory::wind::Wind;
use skein_peer::mission::Mission;
use skein_peer::offload::MissionGeometry;
use std::sync::Arc;

/// Another tree has to save this share of the energy at least: smaller differences are
/// those of excursions, and a mission should not change its lanes for them.
const WORTH: f64 = 0.01;

/// The fields of `lanes`.
const LANES: &[&str] = &["spacing_m", "clearance_m", "tracking_error_m", "tree"];

/// What a scenario says of its lanes.
pub(crate) fn lanes<'a>(f: &Fields<'a>) -> Result<Fields<'a>, ScenarioError> {
    f.need("lanes", "{ spacing_m: 48 }")?.fields(LANES)
}

/// The tree that `lanes` names; none when the scenario leaves it open.
pub(crate) fn stated(lanes: &Fields<'_>) -> Result<Option<Tree>, ScenarioError> {
    let Some(node) = lanes.get("tree") else {
        return Ok(None);
    };
    let name = node.text()?;
    if name == "best" {
        return Ok(None);
    }
    let found = Tree::ALL.into_iter().find(|t| t.name() == name);
    found.map(Some).ok_or_else(|| unknown(node, name))
}

fn unknown(node: &Node<'_>, name: &str) -> ScenarioError {
    let names: Vec<String> = Tree::ALL
        .iter()
        .map(|t| format!("\"{}\"", t.name()))
        .collect();
    node.wrong(format!(
        "is \"{name}\"; expected \"best\" or one of {}",
        names.join(", ")
    ))
}

/// The mission with the tree whose loop takes the least energy, and its ground; as it is
/// for missions without lanes of a tree.
pub(crate) fn cheapest(
    mission: Arc<Mission>,
    ground: Arc<MissionGeometry>,
    airframes: &[Airframe],
    wind: Wind,
) -> (Arc<Mission>, Arc<MissionGeometry>) {
    if !mission.task.is_area() {
        return (mission, ground);
    }
    let radius_m = f64::from(mission.turn_radius_mm) / 1000.0;
    let energy = |ground: &MissionGeometry| {
        let the_loop = &ground.coverage_loop;
        // What is not seen at all is no saving.
        let unseen = the_loop.uncoverable().len();
        Some((unseen, loop_energy_s(the_loop, airframes, wind, radius_m)?))
    };
    let Some(own) = energy(&ground) else {
        return (mission, ground);
    };
    // The mission's own tree is one of the two; only the other one is built.
    let tree = if runs_east(&ground.coverage_loop) {
        Tree::North
    } else {
        Tree::East
    };
    let other = Arc::new(Mission {
        tree,
        ..(*mission).clone()
    });
    match other.geometry() {
        Ok(across)
            if energy(&across)
                .is_some_and(|(unseen, s)| (unseen, s) < (own.0, own.1 * (1.0 - WORTH))) =>
        {
            (other, across)
        }
        _ => (mission, ground),
    }
}

/// Whether more of a loop runs east and west than north and south.
fn runs_east(the_loop: &CoverageLoop) -> bool {
    let headings = (0..the_loop.len()).map(|i| the_loop.boundary(i).direction());
    headings.map(|d| d.x.abs() - d.y.abs()).sum::<f64>() >= 0.0
}

/// Energy to fly a loop once, in seconds of level cruise, averaged over airframes and
/// both ways round; `None` where the wind forbids a part of it.
pub(crate) fn loop_energy_s(
    the_loop: &CoverageLoop,
    airframes: &[Airframe],
    wind: Wind,
    radius_m: f64,
) -> Option<f64> {
    let mut kinds: Vec<(Airframe, f64)> = Vec::new();
    for a in airframes {
        match kinds.iter_mut().find(|k| k.0 == *a) {
            Some(kind) => kind.1 += 1.0,
            None => kinds.push((*a, 1.0)),
        }
    }
    let mut sum = 0.0;
    for (airframe, count) in &kinds {
        let airspeed_mps = turning_mps(airframe, wind.speed_mps(), radius_m);
        for i in 0..the_loop.len() {
            for way in [Direction::Forward, Direction::Backward] {
                let flown = Trajectory::along(&the_loop.curve(i, way), airspeed_mps, wind).ok()?;
                sum += count * flown.energy_s(airframe);
            }
        }
    }
    Some(sum / (2.0 * airframes.len().max(1) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forecast;
    use crate::resolve::{Overrides, Scenario, parse_with};

    /// The harbour basin, 768 by 576 m, with these lanes and this wind.
    fn basin(tree: &str, wind: &str) -> Result<Scenario, ScenarioError> {
        let text = crate::builtin_text("patrol").unwrap();
        let lanes = format!("lanes: {{ tree: \"{tree}\", spacing_m: 56, tracking_error_m: 2 }}");
        let text = text
            .replace("lanes: { spacing_m: 48, tracking_error_m: 3 }", &lanes)
            .replace("level_m: 45", &format!("{wind} level_m: 75"));
        parse_with(
            "basin.json5",
            &text,
            &crate::builtin_files(),
            &Overrides::default(),
        )
    }

    #[test]
    fn lanes_lie_across_the_wind_and_along_the_longer_side_without_one() {
        let tree = |tree: &str, wind: &str| basin(tree, wind).unwrap().spec.mission.tree;
        assert_eq!(tree("best", ""), Tree::Longer);
        assert_eq!(
            tree("best", "wind: { from_deg: 0, speed_mps: 4 },"),
            Tree::Longer
        );
        let east_wind = "wind: { from_deg: 90, speed_mps: 4 },";
        assert_eq!(tree("best", east_wind), Tree::North);
        assert_eq!(tree("longer", east_wind), Tree::Longer);
        assert_eq!(tree("depth_first", east_wind), Tree::DepthFirst);
        let energy_s = |tree: &str| {
            let told = forecast(&basin(tree, east_wind).unwrap()).unwrap();
            told.energy_s.unwrap()
        };
        assert!(energy_s("best") < (1.0 - WORTH) * energy_s("longer"));
    }

    #[test]
    fn an_unknown_tree_is_named_with_its_place() {
        let error = basin("palm", "").unwrap_err().to_string();
        assert!(
            error.contains("basin.json5:") && error.contains("lanes.tree"),
            "{error}"
        );
        assert!(
            error.contains("palm") && error.contains("depth_first"),
            "{error}"
        );
    }
}
