//! The body of one peer: the asynchronous shell around the mind, and the only user
//! of Zenoh.
//!
//! | module | what it does |
//! |---|---|
//! | [`config`] | reads the peer's file, naming every mistake |
//! | [`bus`] | single-hop links to neighbours: the only `use zenoh` |
//! | [`radio`] | what the air does to each message |
//! | [`clock`] | scenario time |
//! | [`journal`] | what must not be forgotten |
//! | [`vehicle`] | percepts up, setpoints down |
//! | [`simulator`] | a vehicle in a simulated world |
//! | [`drive`] | waits for one thing, makes it one input, drains the outputs |
//!
//! The whole lifecycle is [`run`].

pub mod bus;
pub mod clock;
pub mod config;
pub mod drive;
pub mod fields;
pub mod journal;
pub mod radio;
pub mod simulator;
pub mod vehicle;

pub use config::{ConfigError, NodeConfig, VehicleConfig};

use bus::{Bus, BusError};
use clock::Clock;
use drive::Driver;
use journal::{Journal, JournalError};
use radio::Radio;
use simulator::{Simulated, StreamError};
use skein_link::frame::ToWorld;
use skein_peer::{Input, Peer};
use std::net::SocketAddr;
use std::time::{Instant, SystemTime, UNIX_EPOCH};
use vehicle::NoVehicle;

/// Why a node did not start.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// Its journal cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// Its links cannot be opened.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Its vehicle cannot be reached.
    #[error(transparent)]
    Vehicle(#[from] StreamError),
}

/// Runs one peer until its vehicle's stream ends or `stop` does.
///
/// Needs a multi-threaded Tokio runtime; Zenoh refuses the other kind.
///
/// # Errors
/// When something it needs is not there; nothing has been said or flown then.
pub async fn run(config: NodeConfig, stop: impl Future<Output = ()>) -> Result<(), NodeError> {
    let id = config.bus.id;
    let nonce = nonce();
    let (journal, replayed) = Journal::open(&config.journal)?;
    if replayed.torn_bytes > 0 {
        tracing::warn!(
            bytes = replayed.torn_bytes,
            "the journal's torn tail was cut off"
        );
    }
    let bus = Bus::open(&config.bus).await?;
    tracing::info!(
        id,
        locator = bus.locator(),
        records = replayed.records.len(),
        "up"
    );
    let start = Input::Start {
        persisted: replayed.records,
        nonce,
    };
    let mind = Peer::new(config.peer);
    let mut radio = Radio::open(id, nonce);
    match config.vehicle {
        VehicleConfig::Simulator { address, token } => {
            let (vehicle, clock) = join(address, token, &bus, &mut radio, id).await?;
            Driver::new(mind, vehicle, clock, radio, bus, journal)
                .run(start, stop)
                .await;
        }
        VehicleConfig::None => {
            let clock = Clock::free(Instant::now());
            Driver::new(mind, NoVehicle, clock, radio, bus, journal)
                .run(start, stop)
                .await;
        }
    }
    tracing::info!(id, "down");
    Ok(())
}

/// Joins a simulated world, which from then on rules clock and radio.
async fn join(
    address: SocketAddr,
    token: String,
    bus: &Bus,
    radio: &mut Radio,
    id: u16,
) -> Result<(Simulated, Clock), StreamError> {
    let hello = ToWorld::Hello {
        id,
        pid: std::process::id(),
        token,
        locator: bus.locator().to_owned(),
    };
    let (vehicle, welcome) = Simulated::join(address, hello).await?;
    radio.join(welcome.seed);
    Ok((
        vehicle,
        Clock::following(welcome.time_ms, welcome.scale, Instant::now()),
    ))
}

/// Differs from boot to boot: the time of the boot and the process, mixed.
fn nonce() -> u32 {
    let time = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |d| d.as_nanos() as u64);
    let mixed = skein_link::fate::mix(time ^ u64::from(std::process::id()).rotate_left(32));
    (mixed >> 32) as u32
}
