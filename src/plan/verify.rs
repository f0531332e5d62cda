//! `plan verify`: plans recounted by geometry that no planner uses, by [`skein_verify`].

use crate::exit;
use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use skein_verify::load::{File, load};
use skein_verify::recount::{Settings, recount};
use skein_verify::report;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Whether plans hold: zones, fences, joints, radii, lengths, times and the share seen are
/// recounted by geometry that no planner uses.
///
/// Plans are the JSON of `skein plan`, QGroundControl `.plan` and lines of GeoJSON; several
/// are taken for one team. Exit code 0: everything holds, 3: something does not, 2: a file
/// or a flag is wrong.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// The plans.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// The area with its zones and fences: GeoJSON or a QGroundControl `.plan`.
    #[arg(long, value_name = "FILE")]
    pub area: PathBuf,
    /// More zones: every polygon of the file. May be repeated.
    #[arg(long, value_name = "FILE")]
    pub zones: Vec<PathBuf>,
    /// Distance to be kept from zones and holes, metres; by default what the plan says.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub clearance_m: Option<f64>,
    /// Distance to be kept from inclusion fences, metres; by default the clearance.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub fence_clearance_m: Option<f64>,
    /// Turn radius, metres; by default what the plan says. Of straight legs the corners that
    /// cannot be rounded are told.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub turn_radius_m: Option<f64>,
    /// Width of the ground that is seen, metres; by default what the plan says.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub swath_m: Option<f64>,
    /// How far the camera sees before and behind, metres; by default what the plan says, or
    /// half the swath.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub look_ahead_m: Option<f64>,
    /// Airspeed, m/s; by default what the plan says.
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    pub speed_mps: Option<f64>,
    /// Holes of the area may be flown over; without it they are kept out of.
    #[arg(long)]
    pub cross_holes: bool,
    /// The least share of the area to be seen, from 0 to 1.
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub min_share: Option<f64>,
    /// How much nearer or tighter than asked for is no violation, metres.
    #[arg(
        long,
        default_value_t = 0.001,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub tolerance_m: f64,
    /// How the result is printed.
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Forms of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// A line for each violation, then what was recounted.
    Text,
    /// One JSON object.
    Json,
}

/// Recounts, and prints what was found.
///
/// # Errors
/// When stdout cannot be written.
pub fn run(args: &VerifyArgs) -> io::Result<ExitCode> {
    match told(args) {
        Ok((text, holds)) => {
            exit::print(text)?;
            let code = if holds {
                exit::OK
            } else {
                exit::CONFIG_INVALID
            };
            Ok(ExitCode::from(code))
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            Ok(ExitCode::from(exit::USAGE))
        }
    }
}

fn read(path: &Path) -> Result<File> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {name}"))?;
    Ok(File { name, text })
}

/// The text to print, and whether everything holds.
fn told(args: &VerifyArgs) -> Result<(String, bool)> {
    let all = |paths: &[PathBuf]| paths.iter().map(|p| read(p)).collect::<Result<Vec<_>>>();
    let (plans, zones) = (all(&args.files)?, all(&args.zones)?);
    let area = read(&args.area)?;
    let (plan, ground) = load(&plans, Some(&area), &zones)?;
    let settings = Settings {
        clearance_m: args.clearance_m,
        fence_clearance_m: args.fence_clearance_m,
        turn_radius_m: args.turn_radius_m,
        swath_m: args.swath_m,
        look_ahead_m: args.look_ahead_m,
        speed_mps: args.speed_mps,
        cross_holes: args.cross_holes,
        min_share: args.min_share,
        tolerance_m: args.tolerance_m,
    };
    let report = recount(&plan, &ground, &settings)?;
    let text = match args.format {
        Format::Text => report::text(&report),
        Format::Json => report::json(&report).to_string(),
    };
    Ok((text, report.holds()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: VerifyArgs,
    }

    fn verify(more: &[&str]) -> Result<(String, bool)> {
        let data = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/configs/data/px4_multicopter_mission_geofence_avoid.plan"
        );
        let args = [&["verify", data, "--area", data], more].concat();
        told(&Cli::try_parse_from(args).unwrap().args)
    }

    #[test]
    fn the_mission_of_another_program_is_told_to_cross_its_own_fences() {
        let (text, holds) = verify(&[]).unwrap();
        assert!(
            !holds && text.contains("inside zone exclusion fence"),
            "{text}"
        );
        let (told, _) = verify(&["--format", "json"]).unwrap();
        let told: serde_json::Value = serde_json::from_str(&told).unwrap();
        assert_eq!(told["holds"], false);
        assert!(told["violations"][0]["at"]["along_m"].is_number());
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (more, says) in [
            (&["--clearance-m", "-1"][..], "--clearance-m"),
            (&["--min-share", "0.5"], "--min-share"),
            (&["--zones", "/nowhere.geojson"], "cannot read /nowhere"),
        ] {
            let error = format!("{:#}", verify(more).unwrap_err());
            assert!(error.contains(says), "{error}");
        }
    }
}
