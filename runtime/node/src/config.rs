//! The configuration file of a peer; `configs/peer.json5` explains every field.
//!
//! Everything that can be wrong is wrong here, with line and column, before a
//! socket or a journal is opened.

use crate::bus::{BusConfig, loopback_address};
use crate::console::ConsoleConfig;
use crate::fields::{FieldError, Fields, Text};
use crate::simulator::SimulatorConfig;
use skein_peer::config::{Airframe, Objective};
use skein_peer::{Mission, PeerConfig, PeerId, Role};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
    Field(#[from] FieldError),
}

impl NodeConfig {
    /// Reads the file at `path`; file names in it count from its own place.
    ///
    /// # Errors
    /// With the place of the first mistake.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let text = read(path)?;
        let base = path.parent().unwrap_or(Path::new("."));
        Self::parse(Text { path, text: &text }, base)
    }

    fn parse(text: Text<'_>, base: &Path) -> Result<Self, ConfigError> {
        let mut f = text.object()?;
        let id = small(f.integer("id", 0, u64::from(u16::MAX))?);
        let role = role(&mut f)?;
        let fleet = fleet(&mut f)?;
        let airframe = f.optional_object("airframe")?.map(airframe).transpose()?;
        if role == Role::Uav && airframe.is_none() {
            return Err(f.error("a peer of role \"uav\" needs an airframe").into());
        }
        let peer = PeerConfig {
            id: PeerId(id),
            role,
            fleet: fleet.clone(),
            beacon_period_ms: small(f.integer("beacon_period_ms", 100, 60_000)?),
            rate_bps: small(f.integer("rate_bps", 300, 1_000_000_000)?),
            airframe,
            objective: objective(&mut f)?,
            height_m: f.number("height_m", -1_000.0, 20_000.0)?,
            mission: mission(&mut f, base)?,
            seed: f.integer("seed", 0, u64::MAX)?,
        };
        let queue_age_ms = small(f.integer("queue_age_ms", 1, 60_000)?);
        let bus = BusConfig {
            id,
            fleet,
            listen: endpoint(f.string("listen")?)?,
            links: f
                .strings("links")?
                .into_iter()
                .map(endpoint)
                .collect::<Result<_, _>>()?,
            lease_ms: small(f.integer("lease_ms", 100, 60_000)?),
        };
        let journal = base.join(f.string("journal")?.0);
        let simulator = f.optional_object("vehicle")?.map(vehicle).transpose()?;
        if role == Role::Uav && simulator.is_none() {
            return Err(f.error("a peer of role \"uav\" needs a vehicle").into());
        }
        let console = f
            .optional_object("console")?
            .map(|c| console(c, base))
            .transpose()?;
        if role == Role::Uav && console.is_some() {
            let why = "only a peer of role \"ground\" has a console; its operator speaks for all";
            return Err(f.error(why).into());
        }
        f.done()?;
        Ok(Self {
            peer,
            bus,
            journal,
            simulator,
            console,
            queue_age_ms,
        })
    }
}

fn read(path: &Path) -> Result<String, ConfigError> {
    std::fs::read_to_string(path).map_err(|cause| ConfigError::Unreadable {
        path: path.to_owned(),
        cause,
    })
}

/// Narrows what bounds already keep small.
fn small<T: TryFrom<u64> + Default>(n: u64) -> T {
    T::try_from(n).unwrap_or_default()
}

fn wrong(mut error: FieldError, expected: &str) -> FieldError {
    error.what = format!("{}; expected {expected}", error.what);
    error
}

fn role(f: &mut Fields<'_>) -> Result<Role, FieldError> {
    let (text, at) = f.string("role")?;
    match text.as_str() {
        "uav" => Ok(Role::Uav),
        "ground" => Ok(Role::GroundStation),
        _ => Err(wrong(at, "\"uav\" or \"ground\"")),
    }
}

/// What legs should spend little of; time unless it says otherwise.
fn objective(f: &mut Fields<'_>) -> Result<Objective, FieldError> {
    let Some((text, at)) = f.optional_string("objective")? else {
        return Ok(Objective::Time);
    };
    match text.as_str() {
        "time" => Ok(Objective::Time),
        "distance" => Ok(Objective::Distance),
        "energy" => Ok(Objective::Energy),
        _ => Err(wrong(at, "\"time\", \"distance\" or \"energy\"")),
    }
}

fn fleet(f: &mut Fields<'_>) -> Result<String, FieldError> {
    let (text, at) = f.string("fleet")?;
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !text.is_empty() && text.len() <= 32 && text.chars().all(plain) {
        Ok(text)
    } else {
        Err(wrong(at, "1 to 32 letters, digits, '-' or '_'"))
    }
}

fn endpoint((text, at): (String, FieldError)) -> Result<String, FieldError> {
    match loopback_address(&text) {
        Ok(_) => Ok(text),
        Err(_) => Err(wrong(
            at,
            "tcp/127.0.0.1:PORT; nothing listens or connects beyond 127.0.0.1",
        )),
    }
}

fn airframe(mut f: Fields<'_>) -> Result<Airframe, FieldError> {
    let stall_mps = f.number("stall_mps", 1.0, 300.0)?;
    let cruise_mps = f.number("cruise_mps", stall_mps, 300.0)?;
    let result = Airframe {
        stall_mps,
        cruise_mps,
        max_mps: f.number("max_mps", cruise_mps, 300.0)?,
        max_bank_rad: f.number("max_bank_deg", 5.0, 75.0)?.to_radians(),
        endurance_s: f.number("endurance_s", 1.0, 1e6)?,
        reserve_s: f.number("reserve_s", 0.0, 1e6)?,
        footprint_across_m: f.number("footprint_across_m", 0.1, 10_000.0)?,
        footprint_along_m: f.number("footprint_along_m", 0.1, 10_000.0)?,
    };
    if result.reserve_s >= result.endurance_s {
        return Err(f.error("reserve_s leaves nothing of endurance_s to fly"));
    }
    f.done()?;
    Ok(result)
}

/// A port on this machine and no other.
fn local(field: (String, FieldError)) -> Result<SocketAddr, FieldError> {
    let (text, at) = field;
    match text.parse::<SocketAddr>() {
        Ok(a) if a.ip() == Ipv4Addr::LOCALHOST => Ok(a),
        _ => Err(wrong(at, "127.0.0.1:PORT")),
    }
}

fn vehicle(mut f: Fields<'_>) -> Result<SimulatorConfig, FieldError> {
    let address = local(f.string("simulator")?)?;
    let token = f.string("token")?.0;
    f.done()?;
    Ok(SimulatorConfig { address, token })
}

fn console(mut f: Fields<'_>, base: &Path) -> Result<ConsoleConfig, FieldError> {
    let port = local(f.string("listen")?)?.port();
    let token_file = base.join(f.string("token_file")?.0);
    f.done()?;
    Ok(ConsoleConfig { port, token_file })
}

fn mission(f: &mut Fields<'_>, base: &Path) -> Result<Option<Arc<Mission>>, ConfigError> {
    let Some((name, _)) = f.optional_string("mission")? else {
        return Ok(None);
    };
    let path = base.join(name);
    let text = read(&path)?;
    let mission = serde_json::from_str(&text).map_err(|e| FieldError {
        path,
        line: e.line(),
        column: e.column(),
        what: e.to_string(),
    })?;
    Ok(Some(Arc::new(mission)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXAMPLE: &str = include_str!("../../../configs/peer.json5");

    fn parse(text: &str) -> Result<NodeConfig, ConfigError> {
        NodeConfig::parse(
            Text {
                path: Path::new("peer.json5"),
                text,
            },
            Path::new("/nowhere"),
        )
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
            ("height_m:", "heigth_m:", "the field height_m is missing"),
            (
                "endurance_s: 2400",
                "endurance_s: 0",
                "expected a number from 1",
            ),
            ("cruise_mps: 13", "cruise_mps: NaN", "cruise_mps"),
            (
                "lease_ms: 500",
                "lease_ms: 500, leas_ms: 1",
                "unknown field leas_ms",
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
            if !message.contains("missing") {
                assert!(
                    error.contains(&format!("peer.json5:{line}:")),
                    "{wrong}: {error}"
                );
            }
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
    fn a_console_is_for_a_ground_station_and_stays_on_this_machine() {
        let console = "{ listen: \"127.0.0.1:4100\", token_file: \"secret\" }";
        let config = parse(&ground(console)).unwrap();
        let expected = ConsoleConfig {
            port: 4100,
            token_file: "/nowhere/secret".into(),
        };
        assert_eq!(config.console, Some(expected));
        let uav = EXAMPLE.replace("console: null", &format!("console: {console}"));
        let error = parse(&uav).unwrap_err().to_string();
        assert!(error.contains("only a peer of role \"ground\""), "{error}");
        for (right, wrong, message) in [
            ("127.0.0.1:4100", "0.0.0.0:4100", "expected 127.0.0.1:PORT"),
            ("127.0.0.1:4100", "127.0.0.1", "expected 127.0.0.1:PORT"),
            ("token_file:", "file:", "token_file is missing"),
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
