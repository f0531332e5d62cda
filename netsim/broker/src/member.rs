//! One peer of a trial, as the trial sees it: process, files, line, links.

use crate::process::{Process, Processes};
use crate::stream::Line;
use skein_link::LinkState;
use skein_link::RadioCounters;
use skein_netsim::spec::{GroundStationSpec, Spec, UavSpec};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// After this much wall time without a byte a transport gives its neighbour up,
/// milliseconds. Short, because a trial runs faster than life; below it, starved
/// processes on two cores would lose their links.
pub const LEASE_MS: u32 = 500;

/// What has become of a peer's computer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Computer {
    /// Its process runs.
    Runs,
    /// Its process stands still.
    Paused,
    /// Its process was ended on purpose.
    Off,
    /// Its process ended by itself.
    Crashed,
}

/// One peer.
#[derive(Debug)]
pub struct Member {
    /// Its number.
    pub id: u16,
    /// Whether it flies.
    pub flies: bool,
    /// Whether its airframe is still there.
    pub airborne: bool,
    /// Its computer.
    pub computer: Computer,
    /// Its process.
    pub process: Option<Process>,
    /// The way to it, once it said hello.
    pub line: Option<Line>,
    /// Where its transport listens.
    pub locator: Option<String>,
    /// The links it was told last.
    pub told: Option<Vec<(u16, LinkState)>>,
    /// What its radio did in this life.
    pub radio: RadioCounters,
    /// Whether it said goodbye.
    pub left: bool,
    files: Files,
}

#[derive(Clone, Debug)]
struct Files {
    config: PathBuf,
    journal: PathBuf,
    log: PathBuf,
    console_token: PathBuf,
}

impl Member {
    /// A peer that has not been started, with its files in `dir`.
    #[must_use]
    pub fn new(dir: &Path, id: u16, flies: bool) -> Self {
        let file = |what: &str| dir.join(format!("uav{id}.{what}"));
        Self {
            id,
            flies,
            airborne: flies,
            computer: Computer::Off,
            process: None,
            line: None,
            locator: None,
            told: None,
            radio: RadioCounters::default(),
            left: false,
            files: Files {
                config: file("json5"),
                journal: file("journal"),
                log: file("log"),
                console_token: file("token"),
            },
        }
    }

    /// Whether its radio works at present.
    #[must_use]
    pub fn on_air(&self) -> bool {
        self.computer == Computer::Runs && self.line.is_some()
    }

    /// The file with its configuration.
    #[must_use]
    pub fn config(&self) -> &Path {
        &self.files.config
    }

    /// The file with the token of its console, if it has one.
    #[must_use]
    pub fn console_token(&self) -> &Path {
        &self.files.console_token
    }

    /// The last line of its log, for errors.
    #[must_use]
    pub fn last_words(&self) -> String {
        let text = std::fs::read_to_string(&self.files.log).unwrap_or_default();
        let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
        // A panic says where in one line and why in the next.
        let panic = lines.iter().rposition(|l| l.contains("panicked at"));
        let last = match panic {
            Some(at) => lines[at..]
                .iter()
                .take(2)
                .copied()
                .collect::<Vec<_>>()
                .join(" "),
            None => lines
                .last()
                .copied()
                .unwrap_or("it left no message")
                .to_owned(),
        };
        format!("{last} (see {})", self.files.log.display())
    }

    /// Starts its process.
    ///
    /// # Errors
    /// When it cannot be started.
    pub fn start(&mut self, processes: &Processes) -> std::io::Result<()> {
        self.line = None;
        self.told = None;
        self.left = false;
        self.process = Some(processes.launch(&self.files.config, &self.files.log)?);
        self.computer = Computer::Runs;
        Ok(())
    }

    /// Takes its journal away.
    pub fn wipe(&self) {
        let _ = std::fs::remove_file(&self.files.journal);
    }

    /// The number of its process, if it has one.
    #[must_use]
    pub fn pid(&self) -> Option<u32> {
        self.process.as_ref().map(Process::pid)
    }
}

/// What a peer's configuration needs besides the scenario.
#[derive(Debug)]
pub struct Surroundings<'a> {
    /// The scenario.
    pub spec: &'a Spec,
    /// Seed of the run.
    pub seed: u64,
    /// Where the world listens.
    pub world: SocketAddr,
    /// Proves that the peer belongs to it.
    pub token: &'a str,
    /// The proxies that lead to peers of higher numbers.
    pub links: Vec<SocketAddr>,
}

impl Surroundings<'_> {
    /// The configuration of a UAV.
    #[must_use]
    pub fn uav(&self, uav: &UavSpec) -> serde_json::Value {
        let a = &uav.airframe;
        let airframe = serde_json::json!({
            "stall_mps": a.stall_mps,
            "cruise_mps": a.cruise_mps,
            "max_mps": a.max_mps,
            "max_bank_deg": a.max_bank_rad.to_degrees(),
            "endurance_s": a.endurance_s,
            "reserve_s": a.reserve_s,
            "footprint_across_m": a.footprint_across_m,
            "footprint_along_m": a.footprint_along_m,
        });
        self.config(uav.id, "uav", uav.height_m, airframe)
    }

    /// The configuration of the ground station.
    #[must_use]
    pub fn ground(&self, ground: &GroundStationSpec) -> serde_json::Value {
        let mut config = self.config(
            ground.id,
            "ground",
            ground.height_m,
            serde_json::Value::Null,
        );
        config["console"] = serde_json::json!({
            "listen": "127.0.0.1:0",
            "token_file": format!("uav{}.token", ground.id),
        });
        config
    }

    fn config(
        &self,
        id: u16,
        role: &str,
        height_m: f64,
        airframe: serde_json::Value,
    ) -> serde_json::Value {
        let links: Vec<String> = self.links.iter().map(|a| format!("tcp/{a}")).collect();
        serde_json::json!({
            "id": id,
            "role": role,
            "fleet": self.spec.fleet,
            "beacon_period_ms": self.spec.beacon_period_ms,
            "rate_bps": self.spec.radio.rate_bps,
            "queue_age_ms": self.spec.radio.queue_age_ms,
            "height_m": height_m,
            "airframe": airframe,
            "objective": self.spec.objective,
            "mission": "mission.json",
            "seed": skein_link::fate::mix(self.seed ^ (u64::from(id) << 40)),
            "journal": format!("uav{id}.journal"),
            "listen": "tcp/127.0.0.1:0",
            "links": links,
            "lease_ms": LEASE_MS,
            "vehicle": { "simulator": self.world.to_string(), "token": self.token },
        })
    }
}
