//! `skein hint`: which way an emergency vehicle is to take.

use crate::console::{AtArgs, Refusal, look};
use crate::exit;
use crate::places::{corner, origin, pairs, words};
use clap::Args;
use serde_json::json;
use skein_console::Command;
use skein_geometry::frame::Origin;
use skein_interop::place::{LatLon, TooFar, to_plane};
use skein_peer::Overview;
use skein_peer::hint::WayHint;
use skein_peer::mission::{PointMm, mm};
use std::process::ExitCode;

/// A place that is farther from the mission's streets is told to be, metres.
const OFF_M: f64 = 50.0;

/// The quickest way along the streets of the mission, by what the swarm has seen of them.
///
/// Streets that were watched count with the speeds that were seen on them, those of late the most;
/// others with the usual speed of the mission. What is blocked is driven round where there is a
/// way round. Asking changes nothing, and no UAV flies for it: what the mission itself asks for
/// stands in `skein why` and in the report. Wants a mission that brings streets
/// (`mission.streets`); without flags the ground station of the only running trial is asked.
#[derive(Debug, Args)]
pub struct HintArgs {
    /// Latitude and longitude in degrees of where the vehicle is.
    #[arg(value_name = "FROM", value_parser = corner)]
    pub from: LatLon,
    /// Likewise of where it is to go.
    #[arg(value_name = "TO", value_parser = corner)]
    pub to: LatLon,
    /// As one line of JSON, with the way's line in degrees.
    #[arg(long)]
    pub json: bool,
    /// Which ground station.
    #[command(flatten)]
    pub at: AtArgs,
}

/// Runs the verb.
///
/// # Errors
/// When there is no runtime or stdout cannot be written.
pub fn run(args: &HintArgs) -> anyhow::Result<ExitCode> {
    let overview = match look::<Overview>(&args.at, None, &Command::Show)? {
        Ok((overview, _)) => overview,
        Err(refusal) => return Ok(refusal.told()),
    };
    let origin = origin(&overview);
    let (from, to) = match (in_plane(origin, args.from), in_plane(origin, args.to)) {
        (Ok(from), Ok(to)) => (from, to),
        (Err(far), _) | (_, Err(far)) => return Ok(Refusal::of_input(far).told()),
    };
    let way = match look::<WayHint>(&args.at, None, &Command::Hint(from, to))? {
        Ok((way, _)) => way,
        Err(refusal) => return Ok(refusal.told()),
    };
    if args.json {
        let line = pairs(origin, &way.line);
        exit::print(json!({ "hint": way.hint, "line_deg": line, "off_m": way.off_m }))?;
        return Ok(ExitCode::from(exit::OK));
    }
    exit::print(way.hint.sentence())?;
    exit::print(words(origin, &way.line))?;
    for (off_m, what) in [(way.off_m.0, "begins"), (way.off_m.1, "ends")] {
        if off_m > OFF_M {
            exit::print(format!(
                "it {what} {off_m:.0} m from the place that was given"
            ))?;
        }
    }
    Ok(ExitCode::from(exit::OK))
}

/// Millimetres from the mission's origin.
fn in_plane(origin: Origin, place: LatLon) -> Result<PointMm, TooFar> {
    let at = to_plane(origin, place)?;
    Ok((mm(at.x), mm(at.y)))
}
