//! Airframes and the UAVs that fly them. Leaves launch poses that are spread round
//! the coverage loop to `resolve`, which has the loop.

use crate::document::{Fields, Node, suggestion};
use crate::error::ScenarioError;
use crate::read::terrain::{MAX_HEIGHT_M, position};
use crate::resolve::Overrides;
use skein_flight::airframe::Airframe;
use skein_geometry::frame::Pose;
use skein_geometry::math::{FRAC_PI_2, tan, wrap_pi};

/// Most UAVs of one scenario: peers are numbered in 16 bits and the simulator is
/// built for thousands.
const MAX_UAVS: u16 = 4000;

/// Longest flight that is accepted, seconds: a week.
const MAX_ENDURANCE_S: f64 = 604_800.0;

/// One UAV, perhaps without its launch pose yet.
#[derive(Debug)]
pub(crate) struct Member {
    pub(crate) id: u16,
    pub(crate) airframe: Airframe,
    /// `None` when spread round the loop.
    pub(crate) launch: Option<Pose>,
    pub(crate) height_m: f64,
}

/// The flying peers of a scenario.
#[derive(Debug)]
pub(crate) struct Fleet {
    pub(crate) key: String,
    pub(crate) members: Vec<Member>,
}

/// Airframes by name, in the order of the file.
pub(crate) type Airframes = Vec<(String, Airframe)>;

pub(crate) fn airframes(node: &Node<'_>, level_m: f64) -> Result<Airframes, ScenarioError> {
    let members = node.members()?;
    if members.is_empty() {
        return Err(node.wrong("there is no airframe; name at least one"));
    }
    members
        .iter()
        .map(|(name, n)| Ok(((*name).to_owned(), airframe(n, level_m)?)))
        .collect()
}

fn airframe(node: &Node<'_>, level_m: f64) -> Result<Airframe, ScenarioError> {
    let f = node.fields(&[
        "stall_mps",
        "cruise_mps",
        "max_mps",
        "bank_deg",
        "endurance_s",
        "reserve_s",
        "camera",
        "footprint",
    ])?;
    let speed = |name, example| f.need(name, example)?.number(1.0, 150.0, "m/s");
    let (stall_mps, cruise_mps, max_mps) = (
        speed("stall_mps", "9")?,
        speed("cruise_mps", "14")?,
        speed("max_mps", "18")?,
    );
    if stall_mps >= cruise_mps {
        return Err(f.need("cruise_mps", "14")?.wrong(format!(
            "{cruise_mps} m/s is not above the stall speed of {stall_mps} m/s: it would fall"
        )));
    }
    if cruise_mps > max_mps {
        return Err(f.need("max_mps", "18")?.wrong(format!(
            "{max_mps} m/s is below the cruise speed of {cruise_mps} m/s"
        )));
    }
    let endurance_s = f
        .need("endurance_s", "5400")?
        .number(1.0, MAX_ENDURANCE_S, "seconds")?;
    let reserve_s = f.number_or("reserve_s", 0.0, 0.0, MAX_ENDURANCE_S, "seconds")?;
    if reserve_s >= endurance_s {
        let at = f.get("reserve_s").unwrap_or(node);
        return Err(at.wrong(format!(
            "a reserve of {reserve_s} s leaves nothing of an endurance of {endurance_s} s"
        )));
    }
    let (across_m, along_m) = footprint(&f, level_m)?;
    Ok(Airframe {
        stall_mps,
        cruise_mps,
        max_mps,
        max_bank_rad: f
            .need("bank_deg", "45")?
            .number(1.0, 80.0, "degrees")?
            .to_radians(),
        endurance_s,
        reserve_s,
        footprint_across_m: across_m,
        footprint_along_m: along_m,
    })
}

/// Half the footprint at the lowest flight level, across and along the track.
fn footprint(f: &Fields<'_>, level_m: f64) -> Result<(f64, f64), ScenarioError> {
    if let Some(node) = f.get("footprint") {
        if f.get("camera").is_some() {
            return Err(node.wrong("give either the camera or its footprint, not both"));
        }
        let g = node.fields(&["across_m", "along_m"])?;
        let side = |name| {
            g.need(name, "100")?
                .number(1.0, 10_000.0, "metres, the whole side at level_m")
        };
        return Ok((side("across_m")? / 2.0, side("along_m")? / 2.0));
    }
    let g = f
        .need("camera", "{ fov_across_deg: 100, fov_along_deg: 80 }")?
        .fields(&["fov_across_deg", "fov_along_deg"])?;
    let half = |name| -> Result<f64, ScenarioError> {
        let fov_deg = g
            .need(name, "90")?
            .number(1.0, 160.0, "degrees, the whole angle")?;
        Ok(level_m * tan(fov_deg.to_radians() / 2.0))
    };
    Ok((half("fov_across_deg")?, half("fov_along_deg")?))
}

fn airframe_named(node: &Node<'_>, airframes: &Airframes) -> Result<Airframe, ScenarioError> {
    let name = node.text()?;
    airframes
        .iter()
        .find(|(n, _)| n == name)
        .map(|(_, a)| *a)
        .ok_or_else(|| {
            let known: Vec<&str> = airframes.iter().map(|(n, _)| n.as_str()).collect();
            node.wrong(format!(
                "no airframe is named \"{name}\"; {}",
                suggestion(name, &known)
            ))
        })
}

/// A name that may stand in a key.
pub(crate) fn word(node: &Node<'_>) -> Result<String, ScenarioError> {
    let text = node.text()?;
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if text.is_empty() || text.len() > 32 || !text.chars().all(fits) {
        return Err(node.wrong("expected 1 to 32 letters, digits, - or _"));
    }
    Ok(text.to_owned())
}

pub(crate) fn read(
    node: &Node<'_>,
    airframes: &Airframes,
    name: &str,
    level_m: f64,
    ground_id: Option<u16>,
    over: &Overrides,
) -> Result<Fleet, ScenarioError> {
    let f = node.fields(&["key", "slot_step_m", "count", "airframes", "launch", "uavs"])?;
    let key = f.get("key").map_or(Ok(name.to_owned()), word)?;
    let step_m = f.number_or("slot_step_m", 5.0, 0.0, 500.0, "metres")?;
    let top_m = |n: usize| level_m + step_m * n.saturating_sub(1) as f64;
    let members = match f.get("uavs") {
        Some(list) => {
            for other in ["count", "airframes", "launch"] {
                if let Some(n) = f.get(other) {
                    return Err(n.wrong("belongs to a generated fleet; a fleet with a list of uavs has no such field"));
                }
            }
            listed(list, airframes, level_m, step_m, ground_id, over)?
        }
        None => generated(&f, airframes, level_m, step_m, ground_id, over)?,
    };
    if top_m(members.len()) > MAX_HEIGHT_M {
        return Err(node.wrong(format!(
            "the highest slot is at {} m; expected at most {MAX_HEIGHT_M} m",
            top_m(members.len())
        )));
    }
    Ok(Fleet { key, members })
}

fn generated(
    f: &Fields<'_>,
    airframes: &Airframes,
    level_m: f64,
    step_m: f64,
    ground_id: Option<u16>,
    over: &Overrides,
) -> Result<Vec<Member>, ScenarioError> {
    let in_file = f.need("count", "8")?.small(1, MAX_UAVS, "UAVs")?;
    let count = over.peers.unwrap_or(in_file);
    if count == 0 || count > MAX_UAVS {
        return Err(f.node().wrong(format!(
            "{count} UAVs were asked for; expected 1 to {MAX_UAVS}"
        )));
    }
    let names = f.need("airframes", "[\"swift\"]")?;
    let kinds = names
        .items()?
        .iter()
        .map(|n| airframe_named(n, airframes))
        .collect::<Result<Vec<_>, _>>()?;
    if kinds.is_empty() {
        return Err(names.wrong("the list is empty; name at least one airframe"));
    }
    if let Some(launch) = f.get("launch")
        && launch.text()? != "spread"
    {
        return Err(launch.wrong(
            "expected \"spread\" (evenly round the coverage loop); for chosen places list the uavs",
        ));
    }
    let ids = (1..=u16::MAX).filter(|id| Some(*id) != ground_id);
    let members = ids
        .zip(kinds.iter().cycle())
        .take(usize::from(count))
        .enumerate();
    Ok(members
        .map(|(i, (id, airframe))| Member {
            id,
            airframe: *airframe,
            launch: None,
            height_m: level_m + step_m * i as f64,
        })
        .collect())
}

fn listed(
    list: &Node<'_>,
    airframes: &Airframes,
    level_m: f64,
    step_m: f64,
    ground_id: Option<u16>,
    over: &Overrides,
) -> Result<Vec<Member>, ScenarioError> {
    let items = list.items()?;
    if items.is_empty() {
        return Err(list.wrong("there is no UAV; list at least one"));
    }
    if let Some(n) = over.peers
        && usize::from(n) != items.len()
    {
        return Err(list.wrong(format!(
            "{} UAVs are listed by name, so their number cannot be changed to {n}; use a fleet with a count",
            items.len()
        )));
    }
    let mut members: Vec<Member> = Vec::with_capacity(items.len());
    for (i, item) in items.iter().enumerate() {
        let f = item.fields(&["id", "airframe", "launch", "height_m"])?;
        let id_node = f.need("id", "1")?;
        let id = id_node.small(1, u16::MAX, "a peer's number")?;
        if ground_id == Some(id) || members.iter().any(|m| m.id == id) {
            return Err(id_node.wrong(format!(
                "the number {id} is already taken; every peer has its own"
            )));
        }
        let g = f
            .need("launch", "{ east_m: 0, north_m: 0, heading_deg: 90 }")?
            .fields(&["east_m", "north_m", "heading_deg"])?;
        let compass_deg =
            g.need("heading_deg", "90")?
                .number(0.0, 360.0, "degrees clockwise from north")?;
        let launch = Pose::new(position(&g)?, wrap_pi(FRAC_PI_2 - compass_deg.to_radians()));
        let height_m = match f.get("height_m") {
            Some(n) => n.number(level_m, MAX_HEIGHT_M, "metres, not below level_m")?,
            None => level_m + step_m * i as f64,
        };
        let airframe = airframe_named(f.need("airframe", "\"swift\"")?, airframes)?;
        members.push(Member {
            id,
            airframe,
            launch: Some(launch),
            height_m,
        });
    }
    members.sort_by_key(|m| m.id);
    Ok(members)
}
