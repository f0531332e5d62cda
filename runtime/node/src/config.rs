//! The configuration file of a peer; `configs/peer.json5` explains every field.
//!
//! Everything that can be wrong is wrong here, with line and column, before a
//! socket or a journal is opened.

use crate::bus::{BusConfig, loopback_address};
use crate::console::ConsoleConfig;
use crate::simulator::SimulatorConfig;
use skein_interop::airframe;
use skein_interop::json::{Document, Error, Fields, Node, Place, suggestion};
use skein_peer::config::{Launch, Objective};
use skein_peer::wire::tasks::{CAMERA_ALONE, SENSORS, sensor_of_name};
use skein_peer::{Mission, PeerConfig, PeerId, Role};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// All fields of a peer's configuration.
const FIELDS: &[&str] = &[
    "id",
    "role",
    "fleet",
    "beacon_period_ms",
    "rate_bps",
    "queue_age_ms",
    "height_m",
    "sensors",
    "airframe",
    "objective",
    "mission",
    "launches",
    "seed",
    "journal",
    "listen",
    "links",
    "lease_ms",
    "vehicle",
    "console",
];

/// Everything one node needs to know.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeConfig {
    /// What the mind is told.
    pub peer: PeerConfig,
    /// What the bus is told.
    pub bus: BusConfig,
    /// Where promises are kept.
    pub journal: PathBuf,
    /// The world that it flies in, if that is a simulated one.
    pub simulator: Option<SimulatorConfig>,
    /// Where an operator can speak to it.
    pub console: Option<ConsoleConfig>,
    /// What waited longer than this for the channel is not sent, milliseconds.
    pub queue_age_ms: u32,
}

/// Why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{path}: {cause}")]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// Its content is wrong.
    #[error(transparent)]
    Field(#[from] Error),
}

/// What a UAV carries, by names.
fn sensors(node: &Node<'_>) -> Result<u32, Error> {
    let one = |carried: u32, name: &Node<'_>| {
        let text = name.text()?;
        let sensor = sensor_of_name(text).ok_or_else(|| {
            let known = suggestion(text, &SENSORS);
            name.wrong(format!("no sensor is named \"{text}\"; {known}"))
        })?;
        Ok(carried | 1 << (sensor - 1))
    };
    node.items()?.iter().try_fold(0, one)
}

impl NodeConfig {
    /// Reads the file at `path`; file names in it count from its own place.
    ///
    /// # Errors
    /// With the place of the first mistake.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let base = path.parent().unwrap_or(Path::new("."));
        Self::parse(&path.display().to_string(), &read(path)?, base)
    }

    fn parse(file: &str, text: &str, base: &Path) -> Result<Self, ConfigError> {
        let document = Document::parse("peer", file, text)?;
        let f = document.root().fields(FIELDS)?;
        let id = f.need("id", "1")?.small(0, u16::MAX, "a peer's number")?;
        let role = f
            .need("role", "\"uav\"")?
            .one_of(&[("uav", Role::Uav), ("ground", Role::GroundStation)])?;
        let fleet = f.need("fleet", "\"skein\"")?.word()?;
        let airframe = f
            .given("airframe")
            .map(|node| airframe::read(node, None))
            .transpose()?;
        if role == Role::Uav && airframe.is_none() {
            return Err(f
                .node()
                .wrong("a peer of role \"uav\" needs an airframe")
                .into());
        }
        let milliseconds = |name, low, high| {
            f.need(name, "1000")?
                .whole(low, high, "a whole number of milliseconds")
        };
        let peer = PeerConfig {
            id: PeerId(id),
            role,
            fleet: fleet.clone(),
            beacon_period_ms: milliseconds("beacon_period_ms", 100, 60_000)?,
            rate_bps: f
                .need("rate_bps", "64000")?
                .whole(300, 1_000_000_000, "bit/s")?,
            airframe,
            objective: f
                .given("objective")
                .map_or(Ok(Objective::Time), airframe::objective)?,
            height_m: f
                .need("height_m", "60")?
                .number(-1_000.0, 20_000.0, "metres")?,
            mission: mission(&f, base)?,
            launches: f
                .given("launches")
                .map_or_else(|| Ok(Arc::from([])), launches)?,
            sensors: f.given("sensors").map_or(Ok(CAMERA_ALONE), sensors)?,
            seed: f.need("seed", "1")?.count(0, u64::MAX, "any number")?,
        };
        let links = f.need("links", "[]")?.items()?;
        let bus = BusConfig {
            id,
            fleet,
            listen: endpoint(f.need("listen", "\"tcp/127.0.0.1:0\"")?)?,
            links: links.iter().map(endpoint).collect::<Result<_, _>>()?,
            lease_ms: milliseconds("lease_ms", 100, 60_000)?,
        };
        let simulator = f.given("vehicle").map(vehicle).transpose()?;
        if role == Role::Uav && simulator.is_none() {
            return Err(f
                .node()
                .wrong("a peer of role \"uav\" needs a vehicle")
                .into());
        }
        let console = f.given("console");
        Ok(Self {
            peer,
            bus,
            journal: base.join(f.need("journal", "\"uav1.journal\"")?.text()?),
            simulator,
            console: console.map(|node| console_at(node, base)).transpose()?,
            queue_age_ms: milliseconds("queue_age_ms", 1, 60_000)?,
        })
    }
}

/// Who is launched where and when.
fn launches(node: &Node<'_>) -> Result<Arc<[Launch]>, Error> {
    let fields = ["id", "east_mm", "north_mm", "takeoff_ms", "speed_mmps"];
    let launch = |item: &Node<'_>| {
        let f = item.fields(&fields)?;
        let mm = |name| {
            let mm = f.need(name, "0")?.number(-20e6, 20e6, "millimetres")?;
            #[allow(
                clippy::cast_possible_truncation,
                reason = "twenty kilometres in millimetres fit"
            )]
            let mm = mm.round() as i32;
            Ok::<i32, Error>(mm)
        };
        Ok(Launch {
            id: f.need("id", "1")?.small(0, u16::MAX, "a peer's number")?,
            east_mm: mm("east_mm")?,
            north_mm: mm("north_mm")?,
            takeoff_ms: f
                .need("takeoff_ms", "0")?
                .whole(0, 86_400_000, "milliseconds")?,
            speed_mmps: f
                .need("speed_mmps", "13000")?
                .whole(1, 200_000, "millimetres a second")?,
        })
    };
    node.items()?.iter().map(launch).collect()
}

fn read(path: &Path) -> Result<String, ConfigError> {
    std::fs::read_to_string(path).map_err(|cause| ConfigError::Unreadable {
        path: path.to_owned(),
        cause,
    })
}

fn endpoint(node: &Node<'_>) -> Result<String, Error> {
    let text = node.text()?;
    loopback_address(text)
        .map(|_| text.to_owned())
        .map_err(|_| {
            node.wrong(format!(
                "is \"{text}\"; expected tcp/127.0.0.1:PORT; nothing listens or connects beyond 127.0.0.1"
            ))
        })
}

/// A port on this machine and no other.
fn local(node: &Node<'_>) -> Result<SocketAddr, Error> {
    let text = node.text()?;
    match text.parse::<SocketAddr>() {
        Ok(a) if a.ip() == Ipv4Addr::LOCALHOST => Ok(a),
        _ => Err(node.wrong(format!("is \"{text}\"; expected 127.0.0.1:PORT"))),
    }
}

fn vehicle(node: &Node<'_>) -> Result<SimulatorConfig, Error> {
    let f = node.fields(&["simulator", "token"])?;
    Ok(SimulatorConfig {
        address: local(f.need("simulator", "\"127.0.0.1:4000\"")?)?,
        token: f.need("token", "\"...\"")?.text()?.to_owned(),
    })
}

fn console_at(node: &Node<'_>, base: &Path) -> Result<ConsoleConfig, Error> {
    let f = node.fields(&["listen", "token_file"])?;
    Ok(ConsoleConfig {
        port: local(f.need("listen", "\"127.0.0.1:0\"")?)?.port(),
        token_file: base.join(f.need("token_file", "\"console.token\"")?.text()?),
    })
}

fn mission(f: &Fields<'_>, base: &Path) -> Result<Option<Arc<Mission>>, ConfigError> {
    let Some(node) = f.given("mission") else {
        return Ok(None);
    };
    let path = base.join(node.text()?);
    let text = read(&path)?;
    // The record itself, as peers speak it: its form is the type's own.
    let mission = serde_json::from_str(&text).map_err(|e| Error {
        place: Place {
            file: path.display().to_string(),
            line: e.line(),
            column: e.column(),
        },
        field: "mission".to_owned(),
        problem: e.to_string(),
    })?;
    Ok(Some(Arc::new(mission)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXAMPLE: &str = include_str!("../../../configs/peer.json5");

    fn parse(text: &str) -> Result<NodeConfig, ConfigError> {
        NodeConfig::parse("peer.json5", text, Path::new("/nowhere"))
    }

    #[test]
    fn the_explained_example_is_valid() {
        let config = parse(EXAMPLE).unwrap();
        assert_eq!(config.peer.role, Role::Uav);
        assert!(config.simulator.is_some() && config.console.is_none());
    }

    #[test]
    fn a_mistake_is_named_with_its_place() {
        let cases = [
            (
                "role: \"uav\"",
                "role: \"boat\"",
                "expected \"uav\" or \"ground\"",
            ),
            (
                "listen: \"tcp/127.0.0.1:0\"",
                "listen: \"tcp/0.0.0.0:0\"",
                "beyond 127.0.0.1",
            ),
            ("height_m:", "heigth_m:", "did you mean height_m?"),
            (
                "endurance_s: 2400",
                "endurance_s: 0",
                "airframe.endurance_s: 0 is out of range; expected seconds between 1",
            ),
            (
                "cruise_mps: 13",
                "cruise_mps: NaN",
                "airframe.cruise_mps: NaN is not",
            ),
            (
                "bank_deg: 45",
                "bank_deg: 81",
                "airframe.bank_deg: 81 is out",
            ),
            (
                "footprint: { across_m: 60,",
                "footprint_across_m: 30, footprint: { across_m: 60,",
                "airframe.footprint_across_m: unknown field",
            ),
            (
                "lease_ms: 500",
                "lease_ms: 500, leas_ms: 1",
                "leas_ms: unknown field; did you mean lease_ms?",
            ),
            (
                "beacon_period_ms: 1000",
                "beacon_period_ms: -1",
                "whole number",
            ),
            ("seed: 1,", "seed: 1 ]", "peer.json5:"),
            (
                "objective: \"time\"",
                "objective: \"fun\"",
                "expected \"time\", \"distance\" or \"energy\"",
            ),
        ];
        for (right, wrong, message) in cases {
            assert!(EXAMPLE.contains(right), "the example holds {right}");
            let text = EXAMPLE.replace(right, wrong);
            let line = 1 + text[..text.find(wrong).unwrap()].matches('\n').count();
            let error = parse(&text).unwrap_err().to_string();
            assert!(error.contains(message), "{wrong}: {error}");
            assert!(
                error.starts_with(&format!("peer.json5:{line}:")),
                "{wrong}: {error}"
            );
        }
    }

    /// The example, as a ground station.
    fn ground(console: &str) -> String {
        let start = EXAMPLE.find("  airframe: {").unwrap();
        let end = EXAMPLE.find("  // What its ways off the loop").unwrap();
        let mut text = EXAMPLE.to_owned();
        text.replace_range(start..end, "  airframe: null,\n");
        text.replace("role: \"uav\"", "role: \"ground\"")
            .replace("console: null", &format!("console: {console}"))
    }

    #[test]
    fn a_console_stays_on_this_machine() {
        let console = "{ listen: \"127.0.0.1:4100\", token_file: \"secret\" }";
        let config = parse(&ground(console)).unwrap();
        let expected = ConsoleConfig {
            port: 4100,
            token_file: "/nowhere/secret".into(),
        };
        assert_eq!(config.console, Some(expected));
        let uav = EXAMPLE.replace("console: null", &format!("console: {console}"));
        assert_eq!(parse(&uav).unwrap().console.map(|c| c.port), Some(4100));
        for (right, wrong, message) in [
            ("127.0.0.1:4100", "0.0.0.0:4100", "expected 127.0.0.1:PORT"),
            ("127.0.0.1:4100", "127.0.0.1", "expected 127.0.0.1:PORT"),
            ("token_file:", "file:", "console.file: unknown field"),
        ] {
            let error = parse(&ground(&console.replace(right, wrong))).unwrap_err();
            assert!(error.to_string().contains(message), "{wrong}: {error}");
        }
    }

    #[test]
    fn a_missing_mission_file_is_named() {
        let text = EXAMPLE.replace("mission: null", "mission: \"gone.json\"");
        assert!(parse(&text).unwrap_err().to_string().contains("gone.json"));
    }
}
