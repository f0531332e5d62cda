//! What the operator of a scenario does while it is flown: adds and removes no-fly zones and
//! gives orders, each at its time. Whether the mission can still be flown then is asked by
//! [`check`], once there is a mission.

use super::faults::{Known, at_ms, order};
use super::shared::Notices;
use super::tasks;
use super::terrain::{self, Terrain};
use crate::files::Files;
use skein_interop::json::{Error, Node, Places};
use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::spec::Spec;
use skein_netsim::world::Survey;
use skein_peer::Mission;
use skein_peer::input::NewTask;
use skein_peer::mission::ring_mm;
use skein_peer::mission_edit::{ZONE_NAME_MAX_BYTES, is_zone_name};
use skein_peer::wire::tasks::sensor_name;
use std::collections::BTreeSet;
use std::sync::Arc;

/// What the operator can do, one at a time.
const DOINGS: [&str; 6] = [
    "nfz_add",
    "nfz_remove",
    "task_add",
    "task_cancel",
    "task_done",
    "order",
];

/// What the operator does at some time, and where the file says so.
#[derive(Clone, Debug)]
pub(crate) struct Act {
    path: String,
    pub(crate) timed: TimedFault,
}

/// Reads the schedule; it comes back ascending by time.
pub(crate) fn read(
    list: &Node<'_>,
    (terrain, files): (&Terrain, &Files<'_>),
    known: &Known<'_>,
    notices: &mut Notices,
) -> Result<Vec<Act>, Error> {
    let mut acts = Vec::new();
    for item in list.items()? {
        let mut fields = vec!["at_s", "uav"];
        fields.extend(DOINGS);
        let f = item.fields(&fields)?;
        let at_ms = at_ms(&f, "at_s", known)?;
        let given: Vec<_> = DOINGS
            .into_iter()
            .filter_map(|name| Some((name, f.get(name)?)))
            .collect();
        let [(name, node)] = given[..] else {
            return Err(item.wrong(format!(
                "does one thing at a time; expected one of {}",
                DOINGS.join(", ")
            )));
        };
        let fault = match name {
            "nfz_add" => added(node, (terrain, files), notices)?,
            "nfz_remove" => Fault::RemoveZone {
                name: zone_name(node)?,
            },
            "task_add" => tasks::added(node)?,
            "task_cancel" => Fault::CancelTask {
                name: tasks::task_name(node)?,
            },
            "task_done" => Fault::DoneTask {
                name: tasks::task_name(node)?,
            },
            _ => Fault::Order {
                order: order(node)?,
                uav: f.get("uav").map(|uav| known.uav(uav)).transpose()?,
            },
        };
        if let (Some(uav), true) = (f.get("uav"), name != "order") {
            return Err(uav.wrong("says to whom an order is given, so it needs order"));
        }
        if known.peers.is_some() && known.ground.is_none() {
            return Err(item.wrong("there is no ground station to speak it"));
        }
        for fault in tasks::for_all_watchers(node, fault)? {
            acts.push(Act {
                path: node.path(),
                timed: TimedFault { at_ms, fault },
            });
        }
    }
    acts.sort_by_key(|act| act.timed.at_ms);
    Ok(acts)
}

fn added(
    node: &Node<'_>,
    (terrain, files): (&Terrain, &Files<'_>),
    notices: &mut Notices,
) -> Result<Fault, Error> {
    let f = node.fields(&["id", "zone"])?;
    let zone = f.need(
        "zone",
        "{ circle: { east_m: 250, north_m: 250, radius_m: 40 } }",
    )?;
    let mut polygons = terrain::zone(zone, terrain.origin, files, notices)?;
    match (polygons.pop(), polygons.len()) {
        (Some(one), 0) => Ok(Fault::AddZone {
            name: zone_name(f.need("id", "\"fire\"")?)?,
            ring: ring_mm(one.vertices()),
        }),
        (last, n) => Err(zone.wrong(format!(
            "holds {} zones; one is added at a time",
            n + usize::from(last.is_some())
        ))),
    }
}

fn zone_name(node: &Node<'_>) -> Result<String, Error> {
    let name = node.text()?;
    if is_zone_name(name) {
        Ok(name.to_owned())
    } else {
        Err(node.wrong(format!(
            "{name:?} is no name of a zone; expected 1 to {ZONE_NAME_MAX_BYTES} letters, digits, '-', '_' or '.'"
        )))
    }
}

/// Whether the mission can be flown after each change of its zones, and as much of it be
/// covered as the scenario asks for.
pub(crate) fn check(acts: &[Act], spec: &Spec, places: &Places) -> Result<(), Error> {
    let mut mission = (*spec.mission).clone();
    let mut asked: BTreeSet<String> = BTreeSet::new();
    for act in acts {
        let wrong = |why: String| places.wrong(&act.path, why);
        let changed = match &act.timed.fault {
            Fault::AddZone { name, ring } => mission.with_zone(name, ring),
            Fault::RemoveZone { name } => mission.without_zone(name),
            Fault::AddTask { task } => {
                let name = task.name.clone().unwrap_or_default();
                if !asked.insert(name.clone()) {
                    return Err(wrong(format!("a task {name:?} was asked for before")));
                }
                can_be_done(task, &mission, spec).map_err(wrong)?;
                continue;
            }
            Fault::CancelTask { name } | Fault::DoneTask { name } => {
                if !asked.contains(name) {
                    return Err(wrong(format!("no task {name:?} was asked for before")));
                }
                continue;
            }
            _ => continue,
        };
        mission = changed.map_err(|e| wrong(e.to_string()))?;
        can_be_flown(&mission, spec).map_err(wrong)?;
    }
    Ok(())
}

/// Whether some UAV of the fleet could do a task.
fn can_be_done(task: &NewTask, mission: &Mission, spec: &Spec) -> Result<(), String> {
    let asked = task.asked(0, 1)?;
    Arc::new(mission.clone()).can_do(&asked)?;
    if spec.uavs.iter().any(|u| u.carries(task.sensor)) {
        return Ok(());
    }
    let needed = sensor_name(task.sensor);
    Err(format!(
        "no UAV of the fleet carries {needed}; say who does in fleet.sensors"
    ))
}

fn can_be_flown(mission: &Mission, spec: &Spec) -> Result<(), String> {
    let mission = Arc::new(mission.clone());
    let geometry = mission.geometry().map_err(|e| e.to_string())?;
    geometry.base_is_clear()?;
    let survey = Survey::of_mission(spec, &mission).map_err(|e| e.to_string())?;
    let left_out = survey.left_out(&geometry).len();
    if left_out > 0 {
        return Err(format!(
            "the planner finds no way to {left_out} cells that could still be seen"
        ));
    }
    let share = survey.coverable_share();
    if share < spec.min_coverable {
        return Err(format!(
            "only {:.1} % of the area can be covered then, {:.1} % are asked for",
            share * 100.0,
            spec.min_coverable * 100.0
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::Survey;
    use crate::{Files, Overrides};
    use std::path::PathBuf;

    /// The default scenario with this schedule.
    fn field(operator: &str) -> Result<crate::Scenario, String> {
        let text = include_str!("../../../../configs/trials/helsinki.json5");
        assert!(text.contains("operator: [],"));
        // The default asks for nearly all of its area.
        let text = text.replace("min_coverable: 0.97", "min_coverable: 0.9");
        let text = text.replacen("operator: [],", &format!("operator: {operator},"), 1);
        let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/trials"));
        let (files, over) = (Files::Directory(beside), Overrides::default());
        crate::parse_with("s.json5", &text, &files, &over).map_err(|e| e.to_string())
    }

    /// A zone beside a road with two lanes, of which one picture shows pieces of both.
    #[test]
    fn a_zone_is_added_to_a_mission_for_lines_where_all_is_still_seen() {
        let text = include_str!("../../../../configs/trials/convoy.json5");
        let lanes = "[[60, 70], [340, 120], [620, 230]], [[60, 60], [340, 110]";
        let text = text.replacen("[[60, 60], [340, 110]", lanes, 1);
        let zone = "circle: { east_m: 600, north_m: 0, radius_m: 12 }";
        let added = format!("[{{ at_s: 60, nfz_add: {{ id: 'a', zone: {{ {zone} }} }} }}]");
        let text = text.replacen("faults: []", &format!("faults: [], operator: {added}"), 1);
        let (files, over) = (Files::Directory(PathBuf::new()), Overrides::default());
        let read = crate::parse_with("s.json5", &text, &files, &over).map_err(|e| e.to_string());
        let (spec, geometry) = read.map(|s| (s.spec, s.geometry)).unwrap();
        let survey = Survey::new(&spec);
        assert!(survey.n_coverable() > geometry.coverage_loop.len());
        let planned = survey.clone().as_planned(&geometry);
        assert_eq!(planned.n_coverable(), survey.n_coverable());
        // The loop of a mission for one lane leaves out the other one.
        let one = crate::load_builtin("convoy", &over).unwrap();
        let left_out = survey.left_out(&one.geometry).len();
        assert!((5..planned.n_coverable()).contains(&left_out), "{left_out}");
    }

    #[test]
    fn a_schedule_is_read_and_what_is_wrong_is_named_with_its_place() {
        let zone = "zone: { circle: { east_m: 300, north_m: 250, radius_m: 30 } }";
        let good = format!(
            "[{{ at_s: 90, nfz_remove: 'a' }}, {{ at_s: 60, nfz_add: {{ id: 'a', {zone} }} }}, {{ at_s: 70, order: 'hold' }}]"
        );
        let scenario = field(&good).unwrap();
        let spoken: Vec<u64> = scenario
            .spec
            .faults
            .iter()
            .filter(|f| f.fault.is_spoken())
            .map(|f| f.at_ms)
            .collect();
        assert_eq!(spoken, [60_000, 70_000, 90_000]);
        for (wrong, why) in [
            ("[{ at_s: 60 }]".to_owned(), "does one thing at a time"),
            (
                "[{ at_s: 60, order: 'hold', nfz_remove: 'a' }]".to_owned(),
                "does one thing at a time",
            ),
            (
                "[{ at_s: 60, order: 'hold', uav: 99 }]".to_owned(),
                "operator[0].uav: no peer has the number 99",
            ),
            (
                "[{ at_s: 60, nfz_remove: 'a', uav: 1 }]".to_owned(),
                "operator[0].uav: says to whom an order is given",
            ),
            (
                "[{ at_s: 60, nfz_remove: 'a' }]".to_owned(),
                "operator[0].nfz_remove: no added zone is named \"a\"; there are: none",
            ),
            (
                format!("[{{ at_s: 60, nfz_add: {{ id: 'a b', {zone} }} }}]"),
                "is no name of a zone",
            ),
            (
                "[{ at_s: 60, nfz_add: { id: 'a', zone: { ring_m: [[0, 0], [9, 9], [9, 0], [0, 9]] } } }]".to_owned(),
                "operator[0].nfz_add.zone.ring_m",
            ),
            (
                "[{ at_s: 60, nfz_add: { id: 'a', zone: { circle: { east_m: 300, north_m: 250, radius_m: 200 } } } }]".to_owned(),
                "can be covered then",
            ),
            (
                "[{ at_s: 60, nfz_add: { id: 'a', zone: { circle: { east_m: 528, north_m: 480, radius_m: 20 } } } }]".to_owned(),
                "the launch point lies inside a no-fly zone",
            ),
            (
                format!("[{{ at_s: 60, nfz_add: {{ id: 'a', {zone} }} }}, {{ at_s: 61, nfz_add: {{ id: 'a', {zone} }} }}]"),
                "operator[1].nfz_add: a zone \"a\" is there already",
            ),
        ] {
            let said = field(&wrong).unwrap_err();
            assert!(said.contains(why), "{wrong}: {said}");
        }
    }
}
