//! Which spanning tree the lanes of an area follow, when the scenario leaves it open: the
//! one whose loop takes the least energy in the mission's wind (D2.7 §3.6.2).
//!
//! Energy knows both what turns cost (a banked wing carries more than the weight) and
//! what the wind costs (lanes across it are sooner flown than lanes along it). Peers do
//! not choose: the mission names the tree.

use crate::flight_model::loop_energy_s;
use skein_flight::airframe::Airframe;
use skein_flight::coverage::ring::{CoverageLoop, Tree};
use skein_flight::trajectory::wind::Wind;
use skein_peer::Mission;
use skein_peer::offload::MissionGeometry;
use std::sync::Arc;

/// Another tree has to save this share of the energy at least: smaller differences are
/// those of excursions, and a mission should not change its lanes for them.
const WORTH: f64 = 0.01;

/// The geometry of the mission with the tree whose loop takes the least energy; as it is
/// for missions without lanes of a tree.
pub(crate) fn cheapest(
    geometry: Arc<MissionGeometry>,
    airframes: &[Airframe],
    wind: Wind,
) -> Arc<MissionGeometry> {
    let mission = &geometry.mission;
    if !mission.task.is_area() {
        return geometry;
    }
    let radius_m = mission.turn_radius_m();
    let energy = |geometry: &MissionGeometry| {
        let the_loop = &geometry.coverage_loop;
        // What is not seen at all is no saving.
        let unseen = the_loop.uncoverable().len();
        Some((unseen, loop_energy_s(the_loop, airframes, wind, radius_m)?))
    };
    let Some(own) = energy(&geometry) else {
        return geometry;
    };
    // The mission's own tree is one of the two; only the other one is built.
    let tree = if runs_east(&geometry.coverage_loop) {
        Tree::North
    } else {
        Tree::East
    };
    let other = Arc::new(Mission {
        tree,
        ..(**mission).clone()
    });
    match other.geometry() {
        Ok(across)
            if energy(&across)
                .is_some_and(|(unseen, s)| (unseen, s) < (own.0, own.1 * (1.0 - WORTH))) =>
        {
            across
        }
        _ => geometry,
    }
}

/// Whether more of a loop runs east and west than north and south.
fn runs_east(the_loop: &CoverageLoop) -> bool {
    let headings = (0..the_loop.len()).map(|i| the_loop.boundary(i).direction());
    headings.map(|d| d.x.abs() - d.y.abs()).sum::<f64>() >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ScenarioError;
    use crate::request::Overrides;
    use crate::resolve::{Scenario, parse_with};

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
            let told = basin(tree, east_wind).unwrap().forecast();
            told.unwrap().energy_s.unwrap()
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
