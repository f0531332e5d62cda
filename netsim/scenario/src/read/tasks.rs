//! Tasks that the operator of a scenario asks for in flight: a place, a line or an area, within
//! a time, for a sensor; or a relay position or a target to follow, for a time.

use super::shared::position;
use skein_interop::json::{Error, Node, suggestion};
use skein_netsim::fault::Fault;
use skein_peer::input::NewTask;
use skein_peer::mission::mm;
use skein_peer::wire::tasks::{
    SENSORS, TASK_NAME_MAX_BYTES, TASK_PLACES_MAX, TaskKind, WORTH_MAX, is_task_name,
    sensor_of_name,
};
use skein_peer::{BROUGHT_MAX, WATCHERS_MAX};

/// What a task is worth unless the file says so.
pub(crate) const WORTH: u16 = 100;

/// How far around a place is to be seen unless the file says so, metres.
pub(crate) const RADIUS_M: f64 = 10.0;

/// How far from a relay position a UAV may be that holds it unless the file says so, metres.
pub(crate) const RELAY_RADIUS_M: f64 = 100.0;

/// Reads `mission.tasks`: what begins with it, as an operator would ask for it.
pub(crate) fn of_mission(mission: &Node<'_>) -> Result<Vec<NewTask>, Error> {
    let Some(list) = mission.get("tasks")? else {
        return Ok(Vec::new());
    };
    let items = list.items()?;
    if items.len() > BROUGHT_MAX {
        return Err(list.wrong(format!(
            "has {} tasks; expected {BROUGHT_MAX} at most",
            items.len()
        )));
    }
    items.iter().map(asked).collect()
}

/// Reads `task_add`.
pub(crate) fn added(node: &Node<'_>) -> Result<Fault, Error> {
    Ok(Fault::AddTask { task: asked(node)? })
}

fn asked(node: &Node<'_>) -> Result<NewTask, Error> {
    let f = node.fields(&[
        "id",
        "point",
        "line",
        "area",
        "relay",
        "track",
        "radius_m",
        "stand_off_m",
        "watchers",
        "within_s",
        "for_s",
        "needs",
        "worth",
    ])?;
    let place = |node: &Node<'_>| {
        let at = position(&node.fields(&["east_m", "north_m"])?)?;
        Ok(vec![(mm(at.x), mm(at.y))])
    };
    let given = ["point", "line", "area", "relay", "track"];
    let given = given.iter().filter_map(|name| Some((*name, f.get(name)?)));
    let given: Vec<_> = given.collect();
    let (kind, places) = match given[..] {
        [("point", point)] => (TaskKind::Pinpoint, place(point)?),
        [("line", line)] => (TaskKind::Line, places(line, 2)?),
        [("area", area)] => (TaskKind::Area, places(area, 3)?),
        [("relay", relay)] => (TaskKind::Relay, place(relay)?),
        [("track", track)] => (TaskKind::Track, place(track)?),
        _ => {
            return Err(node.wrong(
                "expected either point: { east_m: 250, north_m: 250 }, line: [{ east_m: 0, north_m: 0 }, ...], area: [three corners or more], relay: { east_m: 250, north_m: 250 } or track: { east_m: 250, north_m: 250 }",
            ));
        }
    };
    let is_held = kind.goes_on();
    let (usual_m, lasts, other) = if is_held {
        (RELAY_RADIUS_M, "for_s", "within_s")
    } else {
        (RADIUS_M, "within_s", "for_s")
    };
    if let Some(other) = f.get(other) {
        return Err(other.wrong(format!(
            "a {} says {lasts}",
            match kind {
                TaskKind::Relay => "relay",
                TaskKind::Track => "track",
                _ => "point, line or area",
            }
        )));
    }
    // Of a target to follow a radius is how far from it a UAV stays; 0 for half of what its
    // camera sees to either side.
    let (radius, usual_m, other) = if kind == TaskKind::Track {
        ("stand_off_m", 0.0, "radius_m")
    } else {
        ("radius_m", usual_m, "stand_off_m")
    };
    if let Some(other) = f.get(other) {
        return Err(other.wrong(format!("this task says {radius}")));
    }
    let radius_m = f.number_or(radius, usual_m, 0.0, 1_000.0, "metres")?;
    let within_ms = f.get(lasts).map(|n| {
        let within_s = n.number(1.0, 86_400.0, "seconds")?;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most a day"
        )]
        let within_ms = (within_s * 1000.0).round() as u32;
        Ok(within_ms)
    });
    let sensor = f.get("needs").map(|n| {
        let name = n.text()?;
        sensor_of_name(name).ok_or_else(|| {
            let known = suggestion(name, &SENSORS);
            n.wrong(format!("no sensor is named \"{name}\"; {known}"))
        })
    });
    let task = NewTask {
        name: Some(task_name(f.need("id", "\"gate\"")?)?),
        kind,
        places,
        radius_mm: mm(radius_m).unsigned_abs(),
        worth: f.small_or("worth", WORTH, 1, WORTH_MAX, "the worth of a task")?,
        within_ms: within_ms.transpose()?,
        sensor: sensor.transpose()?.unwrap_or(0),
    };
    Ok(task)
}

/// What is asked for once for each UAV that is to stay with a target (`watchers`).
pub(crate) fn for_all_watchers(node: &Node<'_>, fault: Fault) -> Result<Vec<Fault>, Error> {
    let Fault::AddTask { task } = fault else {
        return Ok(vec![fault]);
    };
    let asked = node.get("watchers")?;
    if let Some(n) = asked.as_ref().filter(|_| task.kind != TaskKind::Track) {
        return Err(n.wrong("is said of a target to follow alone"));
    }
    let most = u32::from(WATCHERS_MAX);
    let watchers = asked.map_or(Ok(1), |n| n.whole(1, most, "UAVs that follow one target"))?;
    let watchers = u8::try_from(watchers).unwrap_or(WATCHERS_MAX);
    let nth = |task: NewTask| match task.name.as_deref().filter(|name| !is_task_name(name)) {
        Some(name) => Err(node.wrong(format!("the name {name:?} of the UAV beside is too long"))),
        None => Ok(Fault::AddTask { task }),
    };
    let all = task.for_watchers(watchers).into_iter();
    all.map(nth).collect()
}

fn places(line: &Node<'_>, least: usize) -> Result<Vec<(i32, i32)>, Error> {
    let items = line.items()?;
    if !(least..=TASK_PLACES_MAX).contains(&items.len()) {
        return Err(line.wrong(format!(
            "has {} places; expected {least} to {TASK_PLACES_MAX}",
            items.len()
        )));
    }
    let place = |n: &Node<'_>| {
        let at = position(&n.fields(&["east_m", "north_m"])?)?;
        Ok((mm(at.x), mm(at.y)))
    };
    items.iter().map(place).collect()
}

/// Reads the name of a task.
pub(crate) fn task_name(node: &Node<'_>) -> Result<String, Error> {
    let name = node.text()?;
    if is_task_name(name) {
        Ok(name.to_owned())
    } else {
        Err(node.wrong(format!(
            "{name:?} is no name of a task; expected 1 to {TASK_NAME_MAX_BYTES} letters, digits, '-', '_' or '.'"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Files, Overrides};
    use std::path::PathBuf;

    /// The default scenario with this schedule, and these sensors.
    fn asked(operator: &str, sensors: &str) -> Result<crate::Scenario, String> {
        let text = include_str!("../../../../configs/trials/helsinki.json5");
        let fleet = "    airframes: [\"swift\", \"scout\"],\n";
        assert!(text.contains("operator: [],") && text.contains(fleet));
        let text = text.replacen("operator: [],", &format!("operator: {operator},"), 1);
        let text = text.replacen(fleet, &format!("{fleet}    {sensors}\n"), 1);
        let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/trials"));
        let (files, over) = (Files::Directory(beside), Overrides::default());
        crate::parse_with("s.json5", &text, &files, &over).map_err(|e| e.to_string())
    }

    #[test]
    fn tasks_are_read_and_what_is_wrong_is_named_with_its_place() {
        let point = "point: { east_m: 120, north_m: 340 }";
        let good = format!(
            "[{{ at_s: 80, task_add: {{ id: 'gate', {point}, needs: 'infrared', within_s: 60 }} }}, {{ at_s: 90, task_cancel: 'gate' }}]"
        );
        let carried = "sensors: [['camera'], ['camera', 'infrared']],";
        let scenario = asked(&good, carried).unwrap();
        let relay = "relay: { east_m: 300, north_m: 200 }";
        let link = format!("[{{ at_s: 9, task_add: {{ id: 'link', {relay}, for_s: 300 }} }}]");
        let linked = asked(&link, "").unwrap().spec;
        let tasks = linked.faults.iter().filter_map(|f| match &f.fault {
            Fault::AddTask { task } => Some((task.kind, task.radius_mm, task.within_ms)),
            _ => None,
        });
        let tasks: Vec<_> = tasks.collect();
        assert_eq!(tasks, [(TaskKind::Relay, 100_000, Some(300_000))]);
        let beside = "track: { east_m: 300, north_m: 200 }, watchers: 2";
        let beside = format!("[{{ at_s: 9, task_add: {{ id: 'car', {beside} }} }}]");
        let beside = asked(&beside, "").unwrap().spec.faults;
        let named = beside.iter().filter_map(|f| match &f.fault {
            Fault::AddTask { task } => Some((task.name.clone()?, task.places[0], task.worth)),
            _ => None,
        });
        let place = (300_000, 200_000);
        let both = [
            ("car".to_owned(), place, 100),
            ("car.2".to_owned(), place, 50),
        ];
        assert_eq!(named.collect::<Vec<_>>(), both);
        let carriers = scenario.spec.uavs.iter().filter(|u| u.carries(2)).count();
        assert_eq!((carriers, scenario.spec.uavs.len()), (4, 8));
        let spoken = scenario.spec.faults.iter().filter(|f| f.fault.is_spoken());
        assert_eq!(spoken.count(), 2);
        let add = |what: &str| format!("[{{ at_s: 80, task_add: {{ {what} }} }}]");
        for (wrong, sensors, why) in [
            (
                good.clone(),
                "",
                "operator[0].task_add: no UAV of the fleet carries infrared",
            ),
            (
                good,
                "sensors: [['eyes']],",
                "fleet.sensors[0][0]: no sensor is named \"eyes\"",
            ),
            (add("id: 'gate'"), "", "expected either point"),
            (
                add(&format!("id: 'a', {relay}, within_s: 9")),
                "",
                "within_s: a relay says for_s",
            ),
            (
                add("id: 'a', area: [{ east_m: 9, north_m: 9 }, { east_m: 9, north_m: 99 }]"),
                "",
                "has 2 places; expected 3 to",
            ),
            (
                add(&format!("id: 'a', {point}, {relay}")),
                "",
                "expected either point",
            ),
            (
                add(&format!("id: 'a', {relay}, radius_m: 9")),
                "",
                "expected a radius of at least",
            ),
            (
                add("id: 'a', relay: { east_m: 9000, north_m: 0 }"),
                "",
                "expected one nearer to the base",
            ),
            (
                add(&format!("id: 'a', {point}, watchers: 2")),
                "",
                "watchers: is said of a target to follow alone",
            ),
            (
                add(&format!("id: 'a b', {point}")),
                "",
                "is no name of a task",
            ),
            (
                add(&format!("id: 'a', {point}, needs: 'eyes'")),
                "",
                "no sensor is named",
            ),
            (
                add(&format!("id: 'a', {point}, radius_m: 300")),
                "",
                "larger than what one frame",
            ),
            (
                add("id: 'a', line: [{ east_m: 1, north_m: 1 }]"),
                "",
                "has 1 places",
            ),
            (
                "[{ at_s: 9, task_cancel: 'x' }]".into(),
                "",
                "no task \"x\" was asked for before",
            ),
        ] {
            let said = asked(&wrong, sensors).map(drop).unwrap_err();
            assert!(said.contains(why), "{wrong}: {said}");
        }
    }
}
