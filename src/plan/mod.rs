//! `plan`: a plan for a person, from files as other programs write them; and whether one
//! holds.
//!
//! Arguments in, a request to [`skein_survey`], text out: the planning is there. What is
//! recounted is by [`skein_verify`], which shares nothing with it.

mod area_input;
mod args;
mod corners;
pub mod cover;
mod landing;
pub mod line;
mod output;
pub mod patrol;
pub mod route;
mod site;
mod size;
mod target_input;
mod team_input;
mod tour_args;
mod upload;
pub mod verify;
mod view;
pub mod visit;
pub(crate) mod zone_input;

use crate::exit;
use anyhow::{Context, Result, ensure};
use clap::{Args, Subcommand};
use skein_geometry::frame::Origin;
use skein_interop::place::LatLon;
use std::io;
use std::process::ExitCode;

/// Why a UAV stays that could take part: because of its endurance, if it has one that does
/// not reach as far as `way_s`, there and back, says, or if something is left that nobody flies.
fn why_home(endurance_s: Option<f64>, way_s: f64, left: bool) -> String {
    match endurance_s {
        Some(endurance_s) if way_s > endurance_s => format!(
            "has not the endurance: the way there and back takes {way_s:.0} s, and it has {endurance_s:.0} s"
        ),
        Some(endurance_s) if left => format!(
            "has not the endurance: {endurance_s:.0} s are too few for anything that is left"
        ),
        _ => "is not needed: the others are done as soon without it".to_owned(),
    }
}

/// What to plan.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// The kind of plan.
    #[command(subcommand)]
    pub subject: Box<Subject>,
}

/// The kinds of plans.
#[derive(Debug, Subcommand)]
pub enum Subject {
    /// The shortest way from one place to another round the no-fly zones of a file.
    Route(route::RouteArgs),
    /// Flights of a team that cover an area.
    Cover(cover::CoverArgs),
    /// Tours of a team along all lines of a file.
    Line(line::LineArgs),
    /// Tours of a team over all points of a file.
    Visit(visit::VisitArgs),
    /// Points, lines or an area seen again and again by a team.
    Patrol(patrol::PatrolArgs),
    /// Whether plans hold, ours or another program's, by geometry that no planner uses.
    Verify(verify::VerifyArgs),
}

/// Plans or recounts a plan, and prints it; a file that is missing or malformed is named.
///
/// # Errors
/// When stdout cannot be written.
pub fn run(args: &PlanArgs) -> io::Result<ExitCode> {
    exit::answer(match args.subject.as_ref() {
        Subject::Route(args) => route::run(args),
        Subject::Cover(args) => cover::run(args),
        Subject::Line(args) => line::run(args),
        Subject::Visit(args) => visit::run(args),
        Subject::Patrol(args) => patrol::run(args),
        Subject::Verify(args) => return verify::run(args),
    })
}

/// Reads `LAT,LON` in degrees.
fn lat_lon(text: &str) -> Result<LatLon> {
    let (lat, lon) = text
        .split_once(',')
        .with_context(|| format!("{text:?} is not LAT,LON, for example 47.3975,8.5460"))?;
    let degrees = |part: &str, what: &str, limit: f64| -> Result<f64> {
        let n: f64 = part
            .trim()
            .parse()
            .with_context(|| format!("{:?} is no {what} in degrees", part.trim()))?;
        ensure!(
            n.abs() <= limit,
            "a {what} of {n} is beyond {limit} degrees"
        );
        Ok(n)
    };
    Ok(LatLon {
        lat_deg: degrees(lat, "latitude", 90.0)?,
        lon_deg: degrees(lon, "longitude", 180.0)?,
    })
}

/// The most that is planned at, degrees north or south: nearer to a pole longitudes run
/// together, and places of the plane have none that could be written down.
const MOST_LAT_DEG: f64 = 89.0;

/// The plane that touches at a place.
fn plane_at(at: LatLon) -> Result<Origin> {
    ensure!(
        at.lat_deg.abs() <= MOST_LAT_DEG,
        "the launch point at {:.7}, {:.7} is too near to a pole: {MOST_LAT_DEG} degrees of latitude are the most",
        at.lat_deg,
        at.lon_deg
    );
    Ok(Origin {
        lat_deg: at.lat_deg,
        lon_deg: at.lon_deg,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_a_latitude_and_a_longitude() {
        let at = lat_lon("-33.5, 151.25").unwrap();
        assert!((at.lat_deg + 33.5).abs() < 1e-12 && (at.lon_deg - 151.25).abs() < 1e-12);
        for (bad, says) in [
            ("33.5", "is not LAT,LON"),
            ("x,1", "\"x\" is no latitude"),
            ("1,", "\"\" is no longitude"),
            ("91,1", "beyond 90"),
            ("1,181", "beyond 180"),
            ("NaN,1", "beyond 90"),
        ] {
            let error = lat_lon(bad).unwrap_err().to_string();
            assert!(error.contains(says), "{bad}: {error}");
        }
    }
}
