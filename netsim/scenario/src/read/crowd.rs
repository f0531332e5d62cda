//! A mass event (D2.7 §3.1): what a mission watches of it, `mission.crowd`; and the people who are
//! there, `crowd`.

use super::shared::places;
use skein_geometry::frame::MAX_MISSION_RADIUS_M;
use skein_interop::json::{Error, Fields, Node};
use skein_netsim::spec::{CrowdSpec, Field, GroupSpec, MoveSpec};
use skein_peer::crowd::{CrowdWatch, ThenWatch};
use skein_peer::wire::tasks::WORTH_MAX;
use std::sync::Arc;

/// The side of a sector unless the file says so, metres.
const SECTOR_M: u16 = 20;

/// How often what is seen is told, and what is too dense looked at, unless the file says so,
/// seconds.
const INTERVAL_S: u16 = 20;
const LOOK_S: u16 = 60;

/// Too dense unless the file says so, people to a square metre: who stands closer is no longer free
/// to turn round (Fruin 1987).
const DENSE_PER_M2: f64 = 3.5;

/// What has eased has so much less than what is too dense.
const EASED: f64 = 0.8;

/// What a look is worth unless the file says so.
const WORTH: u16 = 100;

/// Most people of a scenario: each second the world moves all of them.
const PEOPLE_MAX: u32 = 20_000;

/// Most groups of them, and most ways of one.
const GROUPS_MAX: usize = 64;
const MOVES_MAX: usize = 16;

/// Nobody stands closer than this, people to a square metre.
const CLOSEST_PER_M2: f64 = 10.0;

/// The longest day, seconds.
const DAY_S: u32 = 86_400;

const BOX: &str = "{ west_m: 0, south_m: 0, east_m: 200, north_m: 100 }";

/// Corners of a rectangle that is given by its sides, metres.
fn sides(node: &Node<'_>) -> Result<Field, Error> {
    let f = node.fields(&["west_m", "south_m", "east_m", "north_m"])?;
    let side = |name: &str| {
        let far_m = MAX_MISSION_RADIUS_M;
        f.need(name, "100")?
            .number(-far_m, far_m, "metres from the origin")
    };
    let (low, high) = (
        (side("west_m")?, side("south_m")?),
        (side("east_m")?, side("north_m")?),
    );
    if low.0 >= high.0 || low.1 >= high.1 {
        return Err(node.wrong("the rectangle has no area: expected west < east and south < north"));
    }
    Ok(Field { low, high })
}

/// Reads `mission.crowd`.
pub(crate) fn of_mission(mission: &Node<'_>) -> Result<Option<Arc<CrowdWatch>>, Error> {
    let Some(node) = mission.get("crowd")? else {
        return Ok(None);
    };
    let f = node.fields(&[
        "area",
        "sector_m",
        "interval_s",
        "dense_per_m2",
        "eased_per_m2",
        "then",
        "look_every_s",
        "worth",
        "circles_max",
    ])?;
    let at = f.need("area", BOX)?;
    let area = sides(at)?;
    let sector_m = f.small_or("sector_m", SECTOR_M, 1, 1_000, "metres")?;
    let long = |low: f64, high: f64| -> Result<u16, Error> {
        let n = (high - low) / f64::from(sector_m);
        if (n - n.round()).abs() > 1e-9 || n > f64::from(u16::MAX) {
            return Err(at.wrong(format!(
                "is {:.1} m by {:.1} m; expected whole sectors of {sector_m} m",
                area.high.0 - area.low.0,
                area.high.1 - area.low.1
            )));
        }
        Ok(whole(n.round()))
    };
    let corner = |m: f64| -> Result<i32, Error> {
        if (m - m.round()).abs() > 1e-9 {
            return Err(at.wrong("expected sides at multiples of 10 m"));
        }
        #[allow(clippy::cast_possible_truncation, reason = "missions end at 20 km")]
        let m = m.round() as i32;
        Ok(m)
    };
    let per_m2 = |name: &str, usual: f64| -> Result<u16, Error> {
        let density = f.number_or(name, usual, 0.01, CLOSEST_PER_M2, "people to 1 m²")?;
        Ok(whole((100.0 * density).round()))
    };
    let dense_e2 = per_m2("dense_per_m2", DENSE_PER_M2)?;
    let eased_e2 = per_m2("eased_per_m2", EASED * f64::from(dense_e2) / 100.0)?;
    let then = f.get("then").map_or(Ok(ThenWatch::Notify), |n| {
        n.one_of(&ThenWatch::ALL.map(|t| (t.name(), t)))
    })?;
    let watch = CrowdWatch {
        west_m: corner(area.low.0)?,
        south_m: corner(area.low.1)?,
        sector_m,
        cols: long(area.low.0, area.high.0)?,
        rows: long(area.low.1, area.high.1)?,
        interval_s: f.small_or("interval_s", INTERVAL_S, 1, 3_600, "seconds")?,
        dense_e2,
        eased_e2,
        then,
        look_every_s: f.small_or("look_every_s", LOOK_S, 1, u16::MAX, "seconds")?,
        worth: f.small_or("worth", WORTH, 1, WORTH_MAX, "the worth of a task")?,
        circles_max: f.small_or("circles_max", 1, 1, u16::MAX, "circles at once")?,
    };
    match watch.check() {
        Ok(()) => Ok(Some(Arc::new(watch))),
        Err((field, text)) => Err(f.get(field).unwrap_or(&node).wrong(text)),
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn whole(v: f64) -> u16 {
    v as u16
}

/// Reads `crowd`.
pub(crate) fn read(node: &Node<'_>) -> Result<CrowdSpec, Error> {
    let f = node.fields(&["groups", "vary_people", "vary_s"])?;
    let list = f.need("groups", "[{ people: 500, stands: { … } }]")?;
    let items = list.items()?;
    if items.len() > GROUPS_MAX {
        return Err(list.wrong(format!(
            "has {} groups; expected {GROUPS_MAX} at most",
            items.len()
        )));
    }
    let groups: Vec<GroupSpec> = items.iter().map(group).collect::<Result<_, _>>()?;
    let all: u32 = groups.iter().map(|g| g.people).sum();
    if all > PEOPLE_MAX {
        return Err(list.wrong(format!("are {all} people; expected {PEOPLE_MAX} at most")));
    }
    let share = f.number_or("vary_people", 0.0, 0.0, 0.5, "of the people of a group")?;
    let vary_s = f.whole_or("vary_s", 0, 0, 3_600, "seconds")?;
    Ok(CrowdSpec {
        groups,
        vary_permille: whole((1_000.0 * share).round()),
        vary_ms: 1_000 * vary_s,
    })
}

/// Somewhere to stand for so many.
fn stands(f: &Fields<'_>, name: &str, people: u32) -> Result<Field, Error> {
    let node = f.need(name, BOX)?;
    let field = sides(node)?;
    let m2 = (field.high.0 - field.low.0) * (field.high.1 - field.low.1);
    if f64::from(people) > CLOSEST_PER_M2 * m2 {
        return Err(node.wrong(format!(
            "are {people} people on {m2:.0} m²; nobody stands closer than {CLOSEST_PER_M2} to 1 m²"
        )));
    }
    Ok(field)
}

fn group(node: &Node<'_>) -> Result<GroupSpec, Error> {
    let f = node.fields(&["people", "stands", "goes"])?;
    let people = f.need("people", "500")?.whole(1, PEOPLE_MAX, "people")?;
    let moves = match f.get("goes") {
        Some(list) => {
            let items = list.items()?;
            if items.len() > MOVES_MAX {
                return Err(list.wrong(format!(
                    "has {} ways; expected {MOVES_MAX} at most",
                    items.len()
                )));
            }
            let all = items.iter().map(|item| goes(item, people));
            all.collect::<Result<Vec<_>, _>>()?
        }
        None => Vec::new(),
    };
    if let (Some(list), false) = (f.get("goes"), moves.is_sorted_by_key(|m| m.from_ms)) {
        return Err(list.wrong("expected one way after the other: from_s ascending"));
    }
    Ok(GroupSpec {
        people,
        at: stands(&f, "stands", people)?,
        moves,
    })
}

fn goes(node: &Node<'_>, people: u32) -> Result<MoveSpec, Error> {
    let f = node.fields(&["from_s", "over_s", "way_m", "to", "speed_mps"])?;
    let from_s = f.need("from_s", "120")?.whole(0, DAY_S, "seconds")?;
    Ok(MoveSpec {
        from_ms: 1_000 * u64::from(from_s),
        over_ms: 1_000 * u64::from(f.whole_or("over_s", 60, 0, DAY_S, "seconds")?),
        way: f.get("way_m").map_or(Ok(Vec::new()), places)?,
        to: stands(&f, "to", people)?,
        speed_mps: f.number_or("speed_mps", 1.2, 0.2, 3.0, "m/s")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Overrides;
    use crate::read::testing::mission_of;

    fn with(crowd: &str) -> Result<Arc<CrowdWatch>, String> {
        let read = mission_of(&format!("{{ crowd: {crowd} }}"));
        read.map(|m| m.crowd.clone().unwrap())
    }

    #[test]
    fn an_event_is_read_or_refused_with_place_and_remedy() {
        let area = "area: { west_m: 200, south_m: 200, east_m: 400, north_m: 280 }";
        let read = with(&format!("{{ {area}, dense_per_m2: 2.5, then: 'look' }}")).unwrap();
        assert_eq!((read.cols, read.rows, read.sector_m), (10, 4, 20));
        assert_eq!((read.dense_e2, read.eased_e2), (250, 200));
        assert_eq!((read.then, read.look_every_s), (ThenWatch::Look, 60));
        let read = with(&format!("{{ {area}, then: 'circle', circles_max: 2 }}")).unwrap();
        assert_eq!((read.then, read.circles_max), (ThenWatch::Circle, 2));
        let of = |sides: &str| format!("{{ area: {{ {sides} }} }}");
        for (crowd, why) in [
            ("{ }".to_owned(), "mission.crowd"),
            (
                of("west_m: 200, south_m: 200, east_m: 100, north_m: 280"),
                "has no area",
            ),
            (
                of("west_m: 200, south_m: 200, east_m: 410, north_m: 280"),
                "whole sectors of 20 m",
            ),
            (
                of("west_m: 205, south_m: 200, east_m: 405, north_m: 280"),
                "multiples of 10 m",
            ),
            (
                of("west_m: -3000, south_m: 200, east_m: -2980, north_m: 280"),
                "outside of the mission's area",
            ),
            (
                of("west_m: 0, south_m: 0, east_m: 900, north_m: 900"),
                "45 by 45 sectors",
            ),
            (format!("{{ {area}, sector_m: 25 }}"), "mission.crowd"),
            (format!("{{ {area}, sector_m: 80 }}"), "mission.crowd"),
            (format!("{{ {area}, dense_per_m2: -1 }}"), "dense_per_m2"),
            (
                format!("{{ {area}, dense_per_m2: 2, eased_per_m2: 2 }}"),
                "again and again",
            ),
            (format!("{{ {area}, interval_s: 2 }}"), "interval_s"),
            (format!("{{ {area}, look_every_s: 2 }}"), "look_every_s"),
            (format!("{{ {area}, then: 'shout' }}"), "then"),
            (
                format!("{{ {area}, then: 'look', circles_max: 2 }}"),
                "alone",
            ),
            (
                format!("{{ {area}, then: 'circle', circles_max: 9 }}"),
                "1 to 8 circles",
            ),
            (format!("{{ {area}, norm: 3 }}"), "norm"),
        ] {
            let said = with(&crowd).unwrap_err();
            assert!(said.contains(why), "{crowd}: {said}");
        }
    }

    #[test]
    fn people_are_read_or_refused_with_place_and_remedy() {
        let read = |crowd: &str| {
            let text = include_str!("../../../../configs/trials/helsinki.json5");
            let crowd = format!("vehicles: [], crowd: {crowd},");
            let text = text.replacen("vehicles: [],", &crowd, 1);
            let files = crate::builtin::files();
            let read = crate::parse_with("s.json5", &text, &files, &Overrides::default());
            read.map(|s| s.spec.crowd).map_err(|e| e.to_string())
        };
        let yard = "{ west_m: 0, south_m: 0, east_m: 20, north_m: 20 }";
        let one = read(&format!(
            "{{ groups: [{{ people: 300, stands: {yard}, goes: [{{ from_s: 60, to: {yard} }}] }}], vary_s: 10, vary_people: 0.1 }}"
        ));
        let spec = one.unwrap().unwrap();
        assert_eq!((spec.groups[0].people, spec.vary_permille), (300, 100));
        assert_eq!(spec.groups[0].moves[0].over_ms, 60_000);
        for (crowd, why) in [
            ("{ }".to_owned(), "groups"),
            (
                format!("{{ groups: [{{ people: 0, stands: {yard} }}] }}"),
                "people",
            ),
            ("{ groups: [{ people: 9 }] }".to_owned(), "stands"),
            (
                format!("{{ groups: [{{ people: 5000, stands: {yard} }}] }}"),
                "nobody stands closer",
            ),
            (
                format!(
                    "{{ groups: [{{ people: 9, stands: {yard}, goes: [{{ from_s: 9, to: {yard} }}, {{ from_s: 8, to: {yard} }}] }}] }}"
                ),
                "ascending",
            ),
            (
                format!(
                    "{{ groups: [{{ people: 9, stands: {yard}, goes: [{{ from_s: 9, to: {yard}, speed_mps: 9 }}] }}] }}"
                ),
                "speed_mps",
            ),
        ] {
            let said = read(&crowd).unwrap_err();
            assert!(said.contains(why), "{crowd}: {said}");
        }
    }
}
