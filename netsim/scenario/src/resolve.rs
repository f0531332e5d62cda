//! From a scenario's text to a [`Scenario`] with nothing left open: each step of the line
//! once, the loop derived on the way and handed on.

use crate::choose_tree::cheapest;
use crate::error::{Finding, ScenarioError, Severity};
use crate::feasibility::{self, Summary, blamed};
use crate::files::Files;
use crate::forecast::{self, Forecast};
use crate::mission::{check_obstacles, mission, obstacle_range_m, traffic_range_m};
use crate::read::fleet::{Fleet, Member};
use crate::read::targets::Asked;
use crate::read::{self, Stated, layers, operator};
use crate::request::{AreaPlanner, Overrides};
use skein_geometry::frame::Pose;
use skein_netsim::fault::TimedFault;
use skein_netsim::spec::{Spec, UavSpec};
use skein_netsim::world::Survey;
use skein_peer::offload::MissionGeometry;
use std::sync::Arc;

/// A scenario, resolved, and all that was noticed on the way.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// What a run needs.
    pub spec: Spec,
    /// The coverage loop and the routes that follow from the mission.
    pub geometry: Arc<MissionGeometry>,
    /// What can be seen of its area, by the world's own geometry.
    pub survey: Survey,
    /// What it amounts to.
    pub summary: Summary,
    /// Notes and warnings, with their places; no errors.
    pub findings: Vec<Finding>,
    stated: Stated,
}

/// Resolves a scenario from its text; `file` names it in errors.
///
/// # Errors
/// [`ScenarioError`] names the place of what is wrong, in form or in meaning.
pub fn parse_with(
    file: &str,
    text: &str,
    files: &Files<'_>,
    over: &Overrides,
) -> Result<Scenario, ScenarioError> {
    Scenario::of(read::scenario(file, text, files, over)?)
}

impl Scenario {
    fn of(stated: Stated) -> Result<Self, ScenarioError> {
        let mission = Arc::new(mission(&stated)?);
        let geometry = mission
            .geometry()
            .map_err(|e| stated.places.wrong(blamed(&e), e.to_string()))?;
        let geometry = if stated.lanes.tree.is_none() {
            let fleet = &stated.fleet.members;
            let airframes: Vec<_> = fleet.iter().map(|m| m.airframe).collect();
            cheapest(geometry, &airframes, stated.wind.first)
        } else {
            geometry
        };
        let spec = spec(&stated, &geometry);
        check_obstacles(&stated, &spec)?;
        let survey = Survey::new(&spec);
        let (found, summary) = feasibility::with_geometry(&spec, &geometry, &survey);
        let mut findings = stated.findings.clone();
        for finding in found {
            let plan = (stated.faults_of.as_ref()).filter(|_| finding.field.starts_with("faults"));
            if finding.severity == Severity::Error {
                return Err(match plan {
                    Some(plan) => ScenarioError::Unreadable {
                        file: plan.clone(),
                        problem: format!("{}: {}", finding.field, finding.problem),
                    },
                    None => stated.places.wrong(&finding.field, finding.problem).into(),
                });
            }
            // What stands in a plan has no place in the scenario.
            let own = plan.is_none();
            findings.push(Finding {
                place: own.then(|| stated.places.locate(&finding.field)),
                ..finding
            });
        }
        operator::check(&stated.operator, &spec, &stated.places)?;
        Ok(Self {
            spec,
            geometry,
            survey,
            summary,
            findings,
            stated,
        })
    }

    /// What covering an area is expected to take; `None` for points and lines.
    #[must_use]
    pub fn forecast(&self) -> Option<Forecast> {
        forecast::forecast(&self.spec, &self.geometry, &self.summary)
    }

    /// The forecast of both planners, or why one of them has none. Empty for points and
    /// lines.
    #[must_use]
    pub fn side_by_side(&self) -> Vec<(AreaPlanner, Result<Forecast, ScenarioError>)> {
        let Some(own) = AreaPlanner::of(&self.spec.mission.task) else {
            return Vec::new();
        };
        let told = AreaPlanner::ALL.map(|planner| {
            let told = if planner == own {
                Ok(self.forecast())
            } else {
                self.planned_by(planner).map(|other| other.forecast())
            };
            told.transpose().map(|told| (planner, told))
        });
        told.into_iter().flatten().collect()
    }

    /// The same scenario over an area, planned by this planner.
    fn planned_by(&self, planner: AreaPlanner) -> Result<Self, ScenarioError> {
        Self::of(Stated {
            asked: Asked::Area(planner),
            ..self.stated.clone()
        })
    }
}

fn spec(s: &Stated, geometry: &MissionGeometry) -> Spec {
    Spec {
        name: s.name.clone(),
        fleet: s.fleet.key.clone(),
        mission: Arc::clone(&geometry.mission),
        buildings: s.terrain.buildings.clone(),
        zones: s.terrain.zones.clone(),
        uavs: launch(&s.fleet, geometry),
        ground: s.ground_station.clone(),
        wind: s.wind.clone(),
        objective: s.objective,
        radio: s.radio,
        beacon_period_ms: s.run.beacon_period_ms,
        percept_period_ms: s.run.percept_period_ms,
        time_scale: s.run.time_scale,
        max_time_s: s.run.max_time_s,
        min_coverable: s.run.min_coverable,
        max_visit_s: s.run.max_visit_s,
        min_separation_m: s.run.min_separation_m.max(s.fleet.separation_m),
        traffic_range_m: traffic_range_m(s, &geometry.mission),
        vehicles: s.vehicles.clone(),
        services: s.services.clone(),
        intruders: s.intruders.clone(),
        obstacles: s.obstacles.clone(),
        obstacle_range_m: obstacle_range_m(s, &geometry.mission),
        contour: s.contour.clone(),
        crowd: s.crowd_there.clone(),
        faults: with_operator(s),
        storm: layers::storm(s),
        seed: s.run.seed,
    }
}

/// The faults, and what the operator does: both happen at their times.
fn with_operator(s: &Stated) -> Vec<TimedFault> {
    let acts = s.operator.iter().map(|act| act.timed.clone());
    let mut all: Vec<TimedFault> = s.faults.iter().cloned().chain(acts).collect();
    all.sort_by_key(|f| f.at_ms);
    all
}

/// Gives every UAV its launch pose: its own, at the base, or evenly spread round the loop.
fn launch(fleet: &Fleet, geometry: &MissionGeometry) -> Vec<UavSpec> {
    let n = geometry.coverage_loop.len();
    let k = fleet.members.len();
    let on_loop = |i: usize| -> Pose { geometry.coverage_loop.boundary(i * n / k) };
    let at_base = Pose::new(geometry.mission.base_m(), 0.0);
    let uav = |(i, m): (usize, &Member)| UavSpec {
        id: m.id,
        airframe: m.airframe,
        launch: match (m.launch, m.takeoff_ms) {
            (Some(pose), _) => pose,
            (None, Some(_)) => at_base,
            (None, None) => on_loop(i),
        },
        takeoff_ms: m.takeoff_ms.unwrap_or(0),
        in_air: m.takeoff_ms.is_none(),
        height_m: m.height_m,
        sensors: m.sensors,
        twin_of: None,
        aboard: false,
    };
    fleet.members.iter().enumerate().map(uav).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_peer::CoverageTask;

    #[test]
    fn both_planners_of_a_field_are_told_and_targets_have_none() {
        let over = Overrides::default();
        let field = crate::open(Some("field"), &over).unwrap();
        let told = field.side_by_side();
        assert_eq!(told.len(), 2);
        let told: Vec<Forecast> = told.into_iter().map(|(_, f)| f.unwrap()).collect();
        for f in &told {
            assert!((0.85..=1.0).contains(&f.seen_share), "{f:?}");
            // What 5 UAVs fly together is more than what the last one takes; turns make
            // the energy more than the time at cruise.
            assert!(
                f.makespan_s > 0.0 && f.energy_s.unwrap() > f.makespan_s,
                "{f:?}"
            );
            assert!(f.energy_s.unwrap() > f.loop_m / 20.0, "{f:?}");
        }
        assert!((told[0].loop_m - told[1].loop_m).abs() > 1.0);
        let points = crate::open(Some("points"), &over).unwrap();
        assert!(points.side_by_side().is_empty());
    }

    #[test]
    fn faults_of_a_plan_replace_those_of_the_scenario_and_are_blamed_by_its_name() {
        let scenario = crate::load_builtin("helsinki", &Overrides::default()).unwrap();
        let own = scenario.spec.clone();
        let peers = own.uavs.iter().map(|u| u.id).collect();
        let with = |name: &str, faults: &str| {
            let text = format!("{{ faults: [{faults}] }}");
            Scenario::of(Stated {
                faults: crate::chaos_plan(name, &text, Some(&peers))?,
                faults_of: Some(name.to_owned()),
                ..scenario.stated.clone()
            })
        };
        assert!(own.faults.len() > 2);
        assert!(with("none.json5", "").unwrap().spec.faults.is_empty());
        let one = with("one.json5", "{ at_s: 9, kind: 'kill', peer: 3 }").unwrap();
        assert_eq!(one.spec.faults.len(), 1);
        assert_eq!(one.spec.uavs, own.uavs);
        let nobody = with("nobody.json5", "{ at_s: 9, kind: 'kill', peer: 33 }");
        let why = nobody.unwrap_err().to_string();
        assert!(why.contains("nobody.json5:1:"), "{why}");
        let all: Vec<String> = (1..=8)
            .map(|peer| format!("{{ at_s: 1, kind: 'kill', peer: {peer} }}"))
            .collect();
        let told = match with("all.json5", &all.join(", ")) {
            Ok(s) => s.findings.iter().map(|f| f.problem.clone()).collect(),
            Err(why) => why.to_string(),
        };
        assert!(!told.contains("helsinki.json5"), "{told}");
    }

    #[test]
    fn a_planner_is_for_areas() {
        let over = Overrides {
            planner: Some(AreaPlanner::Exact),
            ..Overrides::default()
        };
        let error = crate::open(Some("roads"), &over).unwrap_err().to_string();
        assert!(
            error.contains("points and lines have one planner each"),
            "{error}"
        );
        let field = crate::open(Some("field"), &over).unwrap();
        assert_eq!(field.spec.mission.task, CoverageTask::Exact);
        // Exact passes see nothing nearer to a zone than the clearance.
        let error = crate::open(Some("helsinki"), &over).unwrap_err();
        let wanted = "only 94.2 % of the area can be covered, 97.0 % are asked for";
        assert!(error.to_string().ends_with(wanted), "{error}");
    }
}
