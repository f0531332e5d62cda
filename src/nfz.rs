//! `skein nfz`: no-fly zones that are added and removed in flight.

use crate::console::{AtArgs, Refusal, look, say};
use crate::exit;
use crate::places::{corner, numbers, origin, pairs, place, words};
use crate::plan::zone_input::{self, Polygons};
use clap::{ArgGroup, Args, Subcommand};
use serde_json::{Value, json};
use skein_console::{Command, NewZone};
use skein_geometry::frame::{Origin, Point};
use skein_interop::place::{LatLon, Side, circle_ring, to_plane};
use skein_peer::Overview;
use skein_peer::mission::{PointMm, ring_mm};
use std::path::PathBuf;
use std::process::ExitCode;

/// Adds and removes no-fly zones in flight.
///
/// A zone is spoken with the next revision of the mission, which every peer passes on. A UAV
/// whose track leads into it turns away as soon as it holds the revision; one that is inside
/// leaves. Cells that can no longer be seen are no longer asked for, until the zone is removed.
/// Without flags the ground station of the only running trial is meant.
#[derive(Debug, Args)]
pub struct NfzArgs {
    /// What happens.
    #[command(subcommand)]
    pub what: What,
    /// Which ground station.
    #[command(flatten)]
    pub at: AtArgs,
}

/// What happens.
#[derive(Debug, Subcommand)]
pub enum What {
    /// Adds a zone, or those of a file.
    Add(AddArgs),
    /// Removes a zone that was added.
    Remove {
        /// Its name.
        name: String,
    },
    /// The zones that were added.
    List {
        /// As one line of JSON.
        #[arg(long)]
        json: bool,
    },
}

/// A zone.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("shape").required(true).args(["file", "circle", "polygon"]))]
pub struct AddArgs {
    /// Every polygon of a GeoJSON file, or every exclusion fence of a QGroundControl plan.
    pub file: Option<PathBuf>,
    /// A circle: latitude and longitude of its centre in degrees, and its radius in metres.
    #[arg(long, value_name = "LAT,LON,RADIUS_M", value_parser = circle, allow_hyphen_values = true)]
    pub circle: Option<(LatLon, f64)>,
    /// A polygon by its corners, latitude and longitude in degrees.
    #[arg(long, value_name = "LAT,LON", value_parser = corner, num_args = 3..)]
    pub polygon: Option<Vec<LatLon>>,
    /// What it is called from now on; without it `zone-1` and so on. Several zones of a file
    /// are numbered: NAME-1, NAME-2.
    #[arg(long, value_name = "NAME")]
    pub id: Option<String>,
}

fn circle(text: &str) -> Result<(LatLon, f64), String> {
    let found = match numbers(text).as_deref() {
        Some([lat_deg, lon_deg, radius_m]) if (1.0..=20_000.0).contains(radius_m) => {
            place(*lat_deg, *lon_deg).map(|centre| (centre, *radius_m))
        }
        _ => None,
    };
    found.ok_or_else(|| {
        "write degrees north and east and 1 to 20000 metres, for example 60.1655,24.9355,40"
            .to_owned()
    })
}

/// Runs the verb.
///
/// # Errors
/// When there is no runtime or stdout cannot be written.
pub fn run(args: &NfzArgs) -> anyhow::Result<ExitCode> {
    match &args.what {
        What::Remove { name } => say(&args.at, &Command::RemoveZone(name.clone())),
        What::Add(add) => {
            let overview = match look::<Overview>(&args.at, None, &Command::Show)? {
                Ok((overview, _)) => overview,
                Err(refusal) => return Ok(refusal.told()),
            };
            match zones(add, origin(&overview)) {
                Ok(zones) => say(&args.at, &Command::AddZones(zones)),
                Err(refusal) => Ok(refusal.told()),
            }
        }
        What::List { json } => match look::<Overview>(&args.at, None, &Command::Show)? {
            Ok((overview, _)) => {
                if *json {
                    exit::print(as_json(&overview))?;
                } else {
                    exit::print(as_text(&overview))?;
                }
                Ok(ExitCode::from(exit::OK))
            }
            Err(refusal) => Ok(refusal.told()),
        },
    }
}

/// The zones that are to be added, in the plane of the mission.
fn zones(args: &AddArgs, origin: Origin) -> Result<Vec<NewZone>, Refusal> {
    let at = |p: LatLon| to_plane(origin, p).map_err(Refusal::of_input);
    let one = |ring: Vec<Point>| {
        vec![NewZone {
            name: args.id.clone(),
            ring: ring_mm(&ring),
        }]
    };
    if let Some((centre, radius_m)) = args.circle {
        return Ok(one(circle_ring(at(centre)?, radius_m, Side::Outside)));
    }
    if let Some(corners) = &args.polygon {
        let ring: Result<Vec<Point>, Refusal> = corners.iter().map(|p| at(*p)).collect();
        return ring.map(one);
    }
    let Some(file) = &args.file else {
        return Ok(Vec::new());
    };
    let read = zone_input::read(file, origin, Polygons::All);
    let read = read.map_err(|e| Refusal::of_input(format!("{e:#}")))?;
    for notice in &read.notices {
        eprintln!("note: {}: {notice}", file.display());
    }
    let n = read.keep_out.len();
    if n == 0 {
        let why = format!(
            "{}: no polygon and no exclusion fence in it",
            file.display()
        );
        return Err(Refusal::of_input(why));
    }
    let named = |(k, zone): (usize, &skein_survey::zones::NamedZone)| NewZone {
        name: args.id.as_ref().map(|id| match n {
            1 => id.clone(),
            _ => format!("{id}-{}", k + 1),
        }),
        ring: ring_mm(&zone.zone.zone.outer),
    };
    Ok(read.keep_out.iter().enumerate().map(named).collect())
}

fn as_json(overview: &Overview) -> Value {
    let origin = origin(overview);
    let zone = |(name, ring): (&String, &Vec<PointMm>)| json!({ "name": name, "corners_lat_lon_deg": pairs(origin, ring) });
    let zones: Vec<Value> = overview.added_zones.iter().map(zone).collect();
    json!({ "revision": overview.revision, "zones": zones })
}

fn as_text(overview: &Overview) -> String {
    if overview.added_zones.is_empty() {
        return format!("revision {}: no zone was added", overview.revision);
    }
    let origin = origin(overview);
    let line = |(name, ring): (&String, &Vec<PointMm>)| format!("{name}  {}", words(origin, ring));
    let lines: Vec<String> = overview.added_zones.iter().map(line).collect();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::typed;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        nfz: NfzArgs,
    }

    const ORIGIN: Origin = Origin {
        lat_deg: 60.0,
        lon_deg: 25.0,
    };

    fn added(text: &str) -> Result<Vec<NewZone>, String> {
        let cli = Cli::try_parse_from(typed(text)).map_err(|e| e.to_string())?;
        match cli.nfz.what {
            What::Add(add) => zones(&add, ORIGIN).map_err(|r| format!("{r:?}")),
            other => Err(format!("{other:?}")),
        }
    }

    #[test]
    fn shapes_are_read_as_people_write_them() {
        let circle = added("nfz add --circle 60.001,25,40 --id fire").unwrap();
        assert_eq!(circle[0].name.as_deref(), Some("fire"));
        let far = |p: &PointMm| {
            let (east, north) = (f64::from(p.0) / 1e3, f64::from(p.1) / 1e3 - 111.4);
            east.hypot(north)
        };
        // The circle lies within its ring.
        assert!(
            circle[0]
                .ring
                .iter()
                .all(|p| (39.5..43.0).contains(&far(p)))
        );
        let ring = added("nfz add --polygon 60,25 60.001,25 60,25.001 --id flag-after").unwrap();
        assert_eq!((ring[0].ring.len(), ring[0].ring[0]), (3, (0, 0)));
        let far = added("nfz add --polygon -33,-70 -33.1,-70 -33,-70.1");
        assert!(far.unwrap_err().contains("km"));
        for wrong in [
            "nfz add",
            "nfz add --circle 60,25",
            "nfz add --circle 60,25,0.5",
            "nfz add --circle 91,25,50",
            "nfz add --circle 60,25,NaN",
            "nfz add --polygon 60,25 60.001,25",
            "nfz add --circle 60,25,40 file.geojson",
            "nfz remove",
        ] {
            assert!(added(wrong).is_err(), "{wrong}");
        }
    }
}
