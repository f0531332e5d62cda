//! The UAVs of a scenario with their airframes, and its ground station. Leaves launch poses
//! that are spread round the coverage loop to `resolve`, which has the loop.

use super::shared::{MAX_HEIGHT_M, position};
use crate::request::{Launch, Overrides};
use skein_flight::airframe::Airframe;
use skein_geometry::frame::Pose;
use skein_geometry::math::{FRAC_PI_2, wrap_pi};
use skein_interop::airframe;
use skein_interop::json::{Error, Fields, Node, suggestion};
use skein_netsim::spec::GroundStationSpec;
use skein_peer::wire::limits::PEERS_MAX;
use skein_peer::wire::tasks::{CAMERA_ALONE, SENSORS, sensor_of_name};

/// Most UAVs of one scenario: a peer knows no more others.
#[allow(clippy::cast_possible_truncation, reason = "256")]
const MAX_UAVS: u16 = PEERS_MAX as u16;

/// Time between two take-offs where none is stated, seconds: a crew of two with a catapult.
const TAKEOFF_INTERVAL_S: f64 = 2.0;

/// One UAV, perhaps without its launch pose yet.
#[derive(Clone, Debug)]
pub(crate) struct Member {
    /// Where the file states where it begins, such as `fleet.uavs[2].launch`.
    pub(crate) field: String,
    pub(crate) id: u16,
    pub(crate) airframe: Airframe,
    /// `None` when spread round the loop, or at the base.
    pub(crate) launch: Option<Pose>,
    /// When it takes off at its place, or at the base where it has none, milliseconds, if
    /// it does.
    pub(crate) takeoff_ms: Option<u32>,
    pub(crate) height_m: f64,
    /// What it carries, a bit for each sensor.
    pub(crate) sensors: u32,
}

/// The flying peers of a scenario.
#[derive(Clone, Debug)]
pub(crate) struct Fleet {
    pub(crate) key: String,
    /// What any two keep between them by agreement, all at one height, metres; 0 where each
    /// has a height of its own.
    pub(crate) separation_m: f64,
    /// From one UAV's height slot to the next above it, metres.
    pub(crate) slot_step_m: f64,
    /// How far UAVs sense obstacles that are on no map, metres, where the file says so.
    pub(crate) obstacle_range_m: Option<f64>,
    /// How far UAVs sense each other, metres, where the file says so.
    pub(crate) traffic_range_m: Option<f64>,
    pub(crate) members: Vec<Member>,
}

/// Airframes by name, in the order of the file.
type Airframes = Vec<(String, Airframe)>;

fn airframes(node: &Node<'_>, level_m: f64) -> Result<Airframes, Error> {
    let members = node.members()?;
    if members.is_empty() {
        return Err(node.wrong("there is no airframe; name at least one"));
    }
    members
        .iter()
        .map(|(name, n)| Ok(((*name).to_owned(), airframe::read(n, Some(level_m))?)))
        .collect()
}

fn airframe_named(node: &Node<'_>, airframes: &Airframes) -> Result<Airframe, Error> {
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

pub(crate) fn ground_station(node: &Node<'_>) -> Result<GroundStationSpec, Error> {
    let f = node.fields(&["id", "east_m", "north_m", "height_m"])?;
    Ok(GroundStationSpec {
        id: f.small_or("id", 100, 1, u16::MAX - 1, "a peer's number")?,
        position: position(&f)?,
        height_m: f.number_or("height_m", 2.0, 0.0, MAX_HEIGHT_M, "metres")?,
    })
}

/// The airframes and the fleet that flies them.
pub(crate) fn read(
    f: &Fields<'_>,
    name: &str,
    level_m: f64,
    ground_id: Option<u16>,
    over: &Overrides,
) -> Result<Fleet, Error> {
    let airframes = &airframes(f.need("airframes", "{ swift: { ... } }")?, level_m)?;
    let intruders = f.get("intruders").map_or(Ok(Vec::new()), Node::items)?;
    let meets_others = !intruders.is_empty();
    let node = f.need(
        "fleet",
        "{ count: 8, airframes: [\"swift\"], launch: \"spread\" }",
    )?;
    let f = node.fields(&[
        "key",
        "slot_step_m",
        "separation_m",
        "traffic_range_m",
        "obstacle_range_m",
        "count",
        "airframes",
        "sensors",
        "launch",
        "takeoff_interval_s",
        "uavs",
    ])?;
    let key = f.get("key").map_or(Ok(name.to_owned()), Node::word)?;
    let separation_m = match f.get("separation_m") {
        Some(node) => node.number(1.0, 1_000.0, "metres")?,
        None => 0.0,
    };
    let default_step_m = if separation_m > 0.0 { 0.0 } else { 5.0 };
    let step_m = f.number_or("slot_step_m", default_step_m, 0.0, 500.0, "metres")?;
    if let Some(node) = f
        .get("slot_step_m")
        .filter(|_| separation_m > 0.0 && step_m > 0.0)
    {
        return Err(node.wrong(
            "UAVs with a separation_m fly at one height; leave slot_step_m out, or separation_m",
        ));
    }
    let top_m = |n: usize| level_m + step_m * n.saturating_sub(1) as f64;
    let mut members = match f.get("uavs") {
        Some(list) => {
            for other in ["count", "airframes", "launch", "takeoff_interval_s"] {
                if let Some(n) = f.get(other) {
                    return Err(n.wrong("belongs to a generated fleet; a fleet with a list of uavs has no such field"));
                }
            }
            listed(list, airframes, level_m, step_m, ground_id, over)?
        }
        None => generated(&f, airframes, level_m, step_m, ground_id, over)?,
    };
    if let Some(node) = f.get("sensors") {
        let carried = sensors(node)?;
        let members = members.iter_mut().zip(carried.iter().cycle());
        members.for_each(|(m, carried)| m.sensors = *carried);
    }
    if top_m(members.len()) > MAX_HEIGHT_M {
        return Err(node.wrong(format!(
            "the highest slot is at {} m; expected at most {MAX_HEIGHT_M} m",
            top_m(members.len())
        )));
    }
    let range = f.get("traffic_range_m");
    let traffic_range_m = range
        .map(|n| n.number(0.0, 20_000.0, "metres"))
        .transpose()?;
    if let Some(node) = range.filter(|_| separation_m <= 0.0 && !meets_others) {
        return Err(node.wrong(
            "only UAVs that fly at one height sense each other; give separation_m too, or intruders",
        ));
    }
    let obstacle_range_m = f
        .get("obstacle_range_m")
        .map(|n| n.number(0.0, 20_000.0, "metres"))
        .transpose()?;
    Ok(Fleet {
        key,
        obstacle_range_m,
        separation_m,
        slot_step_m: step_m,
        traffic_range_m,
        members,
    })
}

/// What UAVs carry, one after the other: lists of names that go round like airframes.
fn sensors(node: &Node<'_>) -> Result<Vec<u32>, Error> {
    let lists = node.items()?;
    if lists.is_empty() {
        return Err(node.wrong("the list is empty; leave it out where all carry a camera alone"));
    }
    let one = |list: &Node<'_>| {
        let names = list.items()?;
        names.iter().try_fold(0, |carried, name| {
            let text = name.text()?;
            let sensor = sensor_of_name(text);
            let sensor = sensor.ok_or_else(|| {
                name.wrong(format!(
                    "no sensor is named \"{text}\"; {}",
                    suggestion(text, &SENSORS)
                ))
            })?;
            Ok(carried | 1 << (sensor - 1))
        })
    };
    lists.iter().map(one).collect()
}

/// How a generated fleet gets into the air.
enum Takeoffs {
    /// It is there, evenly round the loop.
    Spread,
    /// One after the other at the base.
    Base,
    /// Likewise at several places, a part of the fleet at each.
    Places(Vec<(String, Pose)>),
}

impl From<Launch> for Takeoffs {
    fn from(launch: Launch) -> Self {
        match launch {
            Launch::Spread => Self::Spread,
            Launch::Base => Self::Base,
        }
    }
}

fn takeoffs(f: &Fields<'_>, over: Option<Launch>) -> Result<Takeoffs, Error> {
    let node = match (over, f.get("launch")) {
        (Some(asked), _) => return Ok(asked.into()),
        (None, None) => return Ok(Takeoffs::Base),
        (None, Some(node)) => node,
    };
    if let Ok(items) = node.items() {
        if items.is_empty() {
            return Err(node.wrong("the list is empty; name at least one place"));
        }
        let place = |n: &Node<'_>| {
            let at = position(&n.fields(&["east_m", "north_m"])?)?;
            Ok((n.path(), Pose::new(at, 0.0)))
        };
        return Ok(Takeoffs::Places(
            items.iter().map(place).collect::<Result<_, Error>>()?,
        ));
    }
    let launch: Result<Launch, _> = node.text()?.parse();
    launch.map(Takeoffs::from).map_err(|e| {
        node.wrong(format!(
            "{e}, or a list of places as [{{ east_m: 0, north_m: 0 }}, ...]; for a place of each UAV list the uavs"
        ))
    })
}

/// The time between two take-offs at one place, milliseconds.
fn takeoff_interval_ms(f: &Fields<'_>) -> Result<u32, Error> {
    let interval_s = f.number_or(
        "takeoff_interval_s",
        TAKEOFF_INTERVAL_S,
        0.0,
        600.0,
        "seconds",
    )?;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 600,000"
    )]
    let interval_ms = (interval_s * 1000.0).round() as u32;
    Ok(interval_ms)
}

impl Takeoffs {
    /// Of the `i`-th of `n` UAVs: where it is stated, the place if it has one, and which
    /// take-off there is its own.
    fn of(&self, i: usize, n: usize) -> (Option<String>, Option<Pose>, Option<usize>) {
        match self {
            Self::Spread => (None, None, None),
            Self::Base => (None, None, Some(i)),
            Self::Places(places) => {
                // Parts as even as can be: the first of each is the least i whose place it is.
                let place = i * places.len() / n;
                let first = (place * n).div_ceil(places.len());
                let (field, pose) = &places[place];
                (Some(field.clone()), Some(*pose), Some(i - first))
            }
        }
    }
}

fn generated(
    f: &Fields<'_>,
    airframes: &Airframes,
    level_m: f64,
    step_m: f64,
    ground_id: Option<u16>,
    over: &Overrides,
) -> Result<Vec<Member>, Error> {
    let in_file = f.need("count", "8")?.small(
        1,
        MAX_UAVS,
        "the number of UAVs, of which one peer knows at most 256,",
    )?;
    let count = over.peers.unwrap_or(in_file);
    if count == 0 || count > MAX_UAVS {
        return Err(f.node().wrong(format!(
            "{count} UAVs were asked for; expected 1 to {MAX_UAVS}, the most that one peer knows of"
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
    let takeoffs = takeoffs(f, over.launch)?;
    let interval_ms = takeoff_interval_ms(f)?;
    if let Takeoffs::Places(places) = &takeoffs
        && places.len() > usize::from(count)
    {
        return Err(f.need("launch", "\"base\"")?.wrong(format!(
            "{count} UAVs cannot take off at {} places; list as many places as UAVs at most",
            places.len()
        )));
    }
    let ids = (1..u16::MAX).filter(|id| Some(*id) != ground_id);
    let members = ids
        .zip(kinds.iter().cycle())
        .take(usize::from(count))
        .enumerate();
    let member = |(i, (id, airframe)): (usize, (u16, &Airframe))| {
        let (place, launch, nth) = takeoffs.of(i, usize::from(count));
        let nth = nth.map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        Member {
            field: place.unwrap_or_else(|| f.node().path()),
            id,
            airframe: *airframe,
            launch,
            takeoff_ms: nth.map(|n| interval_ms.saturating_mul(n)),
            height_m: level_m + step_m * i as f64,
            sensors: CAMERA_ALONE,
        }
    };
    Ok(members.map(member).collect())
}

fn listed(
    list: &Node<'_>,
    airframes: &Airframes,
    level_m: f64,
    step_m: f64,
    ground_id: Option<u16>,
    over: &Overrides,
) -> Result<Vec<Member>, Error> {
    let items = list.items()?;
    if items.is_empty() {
        return Err(list.wrong("there is no UAV; list at least one"));
    }
    if items.len() > usize::from(MAX_UAVS) {
        return Err(list.wrong(format!(
            "{} UAVs are too many: one peer knows of at most {MAX_UAVS}",
            items.len()
        )));
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
        let id = id_node.small(1, u16::MAX - 1, "a peer's number")?;
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
            field: format!("{}.launch", item.path()),
            id,
            airframe,
            launch: Some(launch),
            takeoff_ms: None,
            height_m,
            sensors: CAMERA_ALONE,
        });
    }
    members.sort_by_key(|m| m.id);
    Ok(members)
}
