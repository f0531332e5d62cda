//! The body of one peer: the asynchronous shell around the pure core, and the only user
//! of Zenoh.
//!
//! | module | what it does |
//! |---|---|
//! | [`config`] | reads the peer's file, naming every mistake |
//! | [`vehicle`] | trait: senses and flies |
//! | [`world`] | trait: rules clock and radio; absent in flight |
//! | [`console`] | trait: the operator of a ground station; and a port on 127.0.0.1 that is one |
//! | [`transport`] | trait: single-hop links to neighbours |
//! | [`simulator`] | a vehicle and a world, simulated: the only file that knows its frames |
//! | [`bus`] | a transport over Zenoh: the only `use zenoh` |
//! | [`radio`] | what the air does to each message that comes in |
//! | [`outgoing`] | what waits for the channel to go out |
//! | [`clock`] | scenario time |
//! | [`journal`] | what must not be forgotten |
//! | [`standing`] | what the operator said last, kept over restarts |
//! | [`drive`] | waits for one thing, makes it one input, drains the outputs |
//!
//! The whole lifecycle is [`run`].

pub mod bus;
pub mod clock;
pub mod config;
pub mod console;
pub mod drive;
pub mod journal;
pub mod outgoing;
pub mod radio;
pub mod simulator;
pub mod standing;
#[cfg(test)]
mod testing;
pub mod transport;
pub mod vehicle;
pub mod world;

pub use config::{ConfigError, NodeConfig};

use bus::{Bus, BusError};
use clock::Clock;
use console::{ConsoleError, LocalConsole};
use drive::{Driver, Equipment, Surroundings};
use journal::{Journal, JournalError};
use radio::Radio;
use simulator::{Hello, Joined, StreamError};
use skein_link::medium::Channel;
use skein_peer::protocol::airtime::{FRAME_BYTES, OVERHEAD_BYTES, PART_BYTES};
use skein_peer::{Input, Peer, Role};
use standing::{Standing, StandingError};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Why a node did not start.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// Its journal cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// Its links cannot be opened.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Its console cannot be opened.
    #[error(transparent)]
    Console(#[from] ConsoleError),
    /// What its operator said last cannot be read.
    #[error(transparent)]
    Standing(#[from] StandingError),
    /// Its world cannot be reached.
    #[error(transparent)]
    World(#[from] StreamError),
}

/// Runs one peer until its world ends or `stop` does.
///
/// Needs a multi-threaded Tokio runtime; Zenoh refuses the other kind.
///
/// # Errors
/// When something it needs is not there; nothing has been said or flown then.
pub async fn run(mut config: NodeConfig, stop: impl Future<Output = ()>) -> Result<(), NodeError> {
    let id = config.bus.id;
    let nonce = nonce();
    let (journal, replayed) = Journal::open(&config.journal)?;
    if replayed.torn_bytes > 0 {
        tracing::warn!(
            bytes = replayed.torn_bytes,
            "the journal was cut off behind its last whole record"
        );
    }
    // At the console of a UAV nobody says anything that had to be kept.
    let is_operated = config.console.is_some() && config.peer.role == Role::GroundStation;
    let standing = is_operated
        .then(|| Standing::open(&config.journal, config.peer.mission.as_deref()))
        .transpose()?;
    let revised = standing.as_ref().and_then(Standing::mission);
    config.peer.mission = revised.or(config.peer.mission);
    let bus = Bus::open(&config.bus).await?;
    if config.peer.role == Role::GroundStation {
        bus.serve_schemas(&config.bus.fleet).await?;
    }
    let console = match &config.console {
        Some(config) => Some(LocalConsole::open(config).await?),
        None => None,
    };
    tracing::info!(
        id,
        locator = bus.locator(),
        console = ?console.as_ref().map(LocalConsole::address),
        records = replayed.records.len(),
        "up"
    );
    let channel = Channel {
        rate_bps: config.peer.rate_bps,
        overhead_bytes: OVERHEAD_BYTES,
        part_bytes: PART_BYTES,
        frame_bytes: FRAME_BYTES,
        queue_age_ms: config.queue_age_ms,
    };
    let mut radio = Radio::open(id, nonce, channel);
    let mut clock = Clock::free(Instant::now());
    let (mut vehicle, mut world) = (None, None);
    if let Some(simulator) = &config.simulator {
        let hello = Hello {
            id,
            locator: bus.locator().to_owned(),
            console: console.as_ref().map(LocalConsole::address),
        };
        let Joined {
            vehicle: v,
            world: w,
            welcome,
        } = simulator::join(simulator, hello).await?;
        radio = Radio::in_world(id, nonce, channel, welcome.seed);
        clock = Clock::following(welcome.time_ms, welcome.scale, Instant::now());
        (vehicle, world) = (Some(v), Some(w));
    }
    let around = Surroundings {
        vehicle,
        world,
        console,
        transport: bus,
    };
    let equipment = Equipment {
        clock,
        radio,
        journal,
        standing,
    };
    let start = Input::Start {
        persisted: replayed.records,
        nonce,
    };
    Driver::new(Peer::new(config.peer), around, equipment)
        .run(start, stop)
        .await;
    tracing::info!(id, "down");
    Ok(())
}

/// Differs from boot to boot: the time of the boot and the process, mixed.
fn nonce() -> u32 {
    let time = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |d| d.as_nanos() as u64);
    let mixed = skein_link::fate::mix(time ^ u64::from(std::process::id()).rotate_left(32));
    (mixed >> 32) as u32
}
