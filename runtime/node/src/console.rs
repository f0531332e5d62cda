//! The operator at a ground station: orders and missions, and whether they can be flown.
//!
//! | the operator says | what follows |
//! |---|---|
//! | an order | it is spoken in this life of the peer and in every later one, until the next |
//! | a mission | it is checked, gets the next revision and is spoken |
//! | another base, a no-fly zone more or less, the end | the newest mission with that change, likewise |
//! | a task more or less | it is checked, kept and spoken |
//! | what there is, or why | it is answered, and nothing follows |
//!
//! What was said is kept over restarts of the ground station ([`crate::standing`]).
//!
//! The [`LocalConsole`] is a port on 127.0.0.1 ([`skein_console`]) that asks for a
//! token. A mission is refused here if it does not fit the swarm in the air or cannot
//! be flown at all: by radio there is nobody to refuse it.

use skein_console::{Asked, Command, Port, Token, TokenError};
use skein_peer::Mission;
use skein_peer::library::chunks;
use std::future::Future;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

/// What the driver needs of a console.
pub trait Console: Send {
    /// The next command, and where its answer goes. Cancel-safe.
    fn next(&mut self) -> impl Future<Output = Asked<Command>> + Send;
}

/// Perhaps no console.
impl<C: Console> Console for Option<C> {
    async fn next(&mut self) -> Asked<Command> {
        match self {
            Some(console) => console.next().await,
            None => std::future::pending().await,
        }
    }
}

/// Where a console listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConsoleConfig {
    /// The port on 127.0.0.1; 0 for any that is free.
    pub port: u16,
    /// Where its token is written.
    pub token_file: PathBuf,
}

/// Why there is no console.
#[derive(Debug, thiserror::Error)]
pub enum ConsoleError {
    /// There is no token, or it cannot be written.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// The port cannot be had.
    #[error("the console cannot listen on 127.0.0.1:{port}: {cause}")]
    Port {
        /// Which.
        port: u16,
        /// Why.
        cause: std::io::Error,
    },
}

/// The console of an operator on the same machine.
#[derive(Debug)]
pub struct LocalConsole {
    port: Port<Command>,
}

impl LocalConsole {
    /// Listens, and writes a new token where only this user can read it.
    ///
    /// # Errors
    /// When there is no port or no token.
    pub async fn open(config: &ConsoleConfig) -> Result<Self, ConsoleError> {
        let token = Token::draw()?;
        let port = Port::listen(config.port, token.clone())
            .await
            .map_err(|cause| ConsoleError::Port {
                port: config.port,
                cause,
            })?;
        token.write(&config.token_file)?;
        Ok(Self { port })
    }

    /// Where it listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.port.address()
    }
}

impl Console for LocalConsole {
    async fn next(&mut self) -> Asked<Command> {
        match self.port.next().await {
            Some(asked) => asked,
            None => std::future::pending().await,
        }
    }
}

/// The mission that a request asks for, where `newest` is the one that is held.
///
/// # Errors
/// A sentence that says why there is none.
pub fn edited(request: Command, newest: Option<&Mission>) -> Result<Mission, String> {
    let held =
        |what: &str| newest.ok_or_else(|| format!("the ground station holds no mission {what}"));
    let edited = match request {
        Command::Mission(mission) => {
            let mission = Arc::unwrap_or_clone(mission);
            match newest {
                Some(old) => mission.revising(old),
                None => Ok(mission),
            }
        }
        Command::Submit(mission) => {
            let mission = Arc::unwrap_or_clone(mission);
            Ok(match newest {
                Some(old) => mission.submitted_after(old),
                None => mission,
            })
        }
        Command::Cancel => held("that could end")?.cancelled(),
        Command::Base(base) => Ok(Mission {
            base,
            ..held("whose base could move")?.clone()
        }),
        Command::AddZones(zones) => {
            let mut mission = held("that a zone could be added to")?.clone();
            for zone in zones {
                let name = zone.name.unwrap_or_else(|| mission.free_zone_name());
                mission = mission
                    .with_zone(&name, &zone.ring)
                    .map_err(|e| e.to_string())?;
            }
            Ok(mission)
        }
        Command::RemoveZone(name) => held("with zones")?.without_zone(&name),
        // Answered before, without a mission.
        Command::Order(_)
        | Command::OrderOne(..)
        | Command::Task(_)
        | Command::Show
        | Command::Hint(..)
        | Command::Why => {
            return Err("no mission follows from that".to_owned());
        }
    };
    edited.map_err(|e| e.to_string())
}

/// Whether a mission fits the swarm that flies `running`: positions count from the same
/// origin, and no airframe is asked for more than it was launched for.
///
/// # Errors
/// A sentence that says what does not fit.
pub fn fits(mission: &Mission, running: Option<&Mission>) -> Result<(), String> {
    chunks(mission).map_err(|too_large| too_large.to_string())?;
    let Some(running) = running else {
        return Ok(());
    };
    let origin = |m: &Mission| (m.origin_lat_e7, m.origin_lon_e7);
    if origin(mission) != origin(running) {
        let degrees = |e7: i32| f64::from(e7) / 1e7;
        return Err(format!(
            "its origin is not that of the swarm, {} {}: every position would be another",
            degrees(running.origin_lat_e7),
            degrees(running.origin_lon_e7),
        ));
    }
    let least = [
        (
            "turn radius",
            mission.turn_radius_mm,
            running.turn_radius_mm,
        ),
        (
            "tracking error",
            mission.tracking_error_mm,
            running.tracking_error_mm,
        ),
    ];
    for (what, is, needs) in least {
        if is < needs {
            return Err(format!(
                "it reckons with a {what} of {is} mm; the UAVs in the air need {needs} mm"
            ));
        }
    }
    let most = [
        (
            "across",
            mission.footprint_across_mm,
            running.footprint_across_mm,
        ),
        (
            "along",
            mission.footprint_along_mm,
            running.footprint_along_mm,
        ),
    ];
    for (what, is, has) in most {
        if is > has {
            return Err(format!(
                "it reckons with half a footprint of {is} mm {what} the track; the UAVs in the air see {has} mm"
            ));
        }
    }
    Ok(())
}

/// Whether a mission can be flown: derives the loop as every UAV will. May take seconds.
///
/// # Errors
/// A sentence that says why not.
pub fn can_be_flown(mission: &Arc<Mission>) -> Result<(), String> {
    let geometry = mission.geometry().map_err(|e| e.to_string())?;
    geometry.base_is_clear()
}
