//! `skein peer`: one peer, from its configuration file to its end.

use crate::{cli, exit};
use clap::Args;
use skein_node::bus::BusError;
use skein_node::journal::JournalError;
use skein_node::{NodeConfig, NodeError};
use std::path::PathBuf;
use std::process::ExitCode;

/// Runs one peer until it is told to end: by SIGTERM, or by the world that it flies in.
///
/// A trial starts its peers like this. `configs/peer.json5` explains every field of
/// the configuration; what is wrong in it is named with line and column.
#[derive(Debug, Args)]
pub struct PeerArgs {
    /// The peer's configuration.
    #[arg(long, value_name = "FILE")]
    pub config: PathBuf,
}

/// Runs the verb.
///
/// # Errors
/// When there is no runtime.
pub fn run(args: &PeerArgs) -> anyhow::Result<ExitCode> {
    let config = match NodeConfig::load(&args.config) {
        Ok(config) => config,
        Err(error) => {
            eprintln!("error: {error}");
            return Ok(ExitCode::from(exit::CONFIG_INVALID));
        }
    };
    abort_on_panic();
    let ended = cli::runtime()?.block_on(skein_node::run(config, cli::asked_to_stop()));
    Ok(match ended {
        Ok(()) => ExitCode::from(exit::OK),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(code(&error))
        }
    })
}

fn code(error: &NodeError) -> u8 {
    match error {
        NodeError::Journal(JournalError::InUse(_) | JournalError::Io { .. })
        | NodeError::Bus(
            BusError::InUse(_) | BusError::NotLoopback(_) | BusError::Configuration { .. },
        ) => exit::CONFIG_INVALID,
        NodeError::Console(_) | NodeError::Standing(_) => exit::CONFIG_INVALID,
        NodeError::World(_) | NodeError::Bus(BusError::NoPeer { .. }) => exit::NO_PEERS,
        NodeError::Bus(BusError::Open { .. }) => exit::INTERNAL,
    }
}

/// A peer that lost one of its threads is worse than one that is gone: others notice
/// only the second.
fn abort_on_panic() {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        report(info);
        std::process::abort();
    }));
}
