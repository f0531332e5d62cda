//! `skein why`: what a peer does and why.

use crate::chaos::peer;
use crate::console::{AtArgs, look};
use crate::exit;
use clap::Args;
use skein_console::Command;
use skein_peer::Why;
use std::process::ExitCode;

/// What a peer does and why, told from its own state.
///
/// Its goal and the reason for it, its plan and claims with their stamps, the last round with
/// the bids that it knows, its fuel and what it needs to return, whom it suspects or believes
/// dead and since when, and what happened last. Asking changes nothing. The peer of the only
/// running trial is asked at its own console; with `--at` that console is given instead. Of a
/// simulated run `skein sim --why` tells the same.
#[derive(Debug, Args)]
pub struct WhyArgs {
    /// Which peer: `3` or `uav3`.
    #[arg(value_parser = peer)]
    pub uav: u16,
    /// As one line of JSON.
    #[arg(long)]
    pub json: bool,
    /// Which console.
    #[command(flatten)]
    pub at: AtArgs,
}

/// Runs the verb.
///
/// # Errors
/// When there is no runtime or stdout cannot be written.
pub fn run(args: &WhyArgs) -> anyhow::Result<ExitCode> {
    let (why, line) = match look::<Why>(&args.at, Some(args.uav), &Command::Why)? {
        Ok(found) => found,
        Err(refusal) => return Ok(refusal.told()),
    };
    if why.id != args.uav {
        eprintln!("error: peer {} answers there, not {}", why.id, args.uav);
        return Ok(ExitCode::from(exit::NO_PEERS));
    }
    if args.json {
        exit::print(line)?;
    } else {
        exit::print(why)?;
    }
    Ok(ExitCode::from(exit::OK))
}
