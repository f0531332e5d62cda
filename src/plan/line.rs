//! `plan line`: tours of a team along all lines of a file; wide strips in lanes
//! (D2.7 §3.5).

use super::errands::{self, Solver, Wishes};
use super::tours::{TourArgs, Way, Ways};
use anyhow::{Context, Result};
use clap::Args;
use skein_flight::coverage::lines::{plan, strip};
use skein_geometry::frame::Point;
use skein_interop::targets::{LineTarget, read};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Tours of a team along all lines of a file, the longest as short as can be found.
///
/// Lines of GeoJSON (property `width_m` makes one a strip) or corridor scans of a
/// QGroundControl `.plan`. Lines that share a point hang together there, as roads do. The
/// property `sensor` names the sensor that a line is to be seen with.
#[derive(Debug, Args)]
pub struct LineArgs {
    /// A QGroundControl `.plan` or GeoJSON.
    pub file: PathBuf,
    /// Team, wind and form of the result.
    #[command(flatten)]
    pub tours: TourArgs,
    /// Sensor, objective and heights.
    #[command(flatten)]
    pub wishes: Wishes,
}

/// Plans, and returns the text to print.
///
/// # Errors
/// When the file or a flag is wrong; the error names the place.
pub fn run(args: &LineArgs) -> Result<String> {
    let solver: Solver = |lines, team, metric, steps| plan(lines, team, metric, steps);
    errands::run(ways(args)?, &args.tours, &args.wishes, solver)
}

/// What there is to fly along.
pub(super) fn ways(args: &LineArgs) -> Result<Ways> {
    let text = std::fs::read_to_string(&args.file)
        .with_context(|| format!("cannot read {}", args.file.display()))?;
    let targets = read(&text).with_context(|| args.file.display().to_string())?;
    let mut notices: Vec<String> = targets.notices.iter().map(ToString::to_string).collect();
    if !targets.points.is_empty() {
        let n = targets.points.len();
        notices.push(format!(
            "{n} point(s) ignored: `plan visit` plans for points"
        ));
    }
    let first = targets.lines.first().map(|l| l.way[0]);
    let mut ways = Ways::new(&args.tours, targets.home.or(first), notices, &args.file)?;
    let mut narrow: Vec<&LineTarget> = Vec::new();
    for line in &targets.lines {
        let sensor = args.wishes.sensor_for(line.sensor.as_ref());
        let swath_m = ways.swath_m(&args.tours, sensor, &line.pointer)?;
        if line.width_m <= swath_m {
            narrow.push(line);
            continue;
        }
        let centre = plane(&ways, line)?;
        let lanes = strip::lanes(&centre, line.width_m, swath_m).with_context(|| {
            format!(
                "{}: a strip {} m wide has no lanes of --swath-m {}",
                line.pointer, line.width_m, swath_m
            )
        })?;
        for lane in lanes {
            ways.push(&lane, &line.pointer, sensor);
        }
    }
    network(&mut ways, &narrow, &args.wishes)?;
    Ok(ways)
}

fn plane(ways: &Ways, line: &LineTarget) -> Result<Vec<Point>> {
    let points = line.way.iter().map(|&p| ways.point(p, &line.pointer));
    points.collect()
}

/// Adds lines that hang together where they share a point: each is cut there.
fn network(ways: &mut Ways, lines: &[&LineTarget], wishes: &Wishes) -> Result<()> {
    // Coordinates are told apart at the seventh decimal, a centimetre.
    #[allow(clippy::cast_possible_truncation, reason = "at most 1.8e9")]
    let key = |deg: f64| (deg * 1e7).round() as i64;
    let mut places: BTreeMap<(i64, i64), (usize, usize)> = BTreeMap::new();
    let mut numbered = Vec::new();
    for line in lines {
        let mut way = Vec::new();
        for &p in &line.way {
            let at = (key(p.lat_deg), key(p.lon_deg));
            let known = places.get(&at).map(|k| k.0);
            let place = match known {
                Some(place) => place,
                None => ways.place(ways.point(p, &line.pointer)?),
            };
            if way.last() == Some(&place) {
                continue;
            }
            places.entry(at).or_insert((place, 0)).1 += 1;
            way.push(place);
        }
        numbered.push((way, *line));
    }
    let mut uses = vec![0; ways.at.len()];
    for (place, count) in places.into_values() {
        uses[place] = count;
    }
    for (way, line) in numbered {
        let mut piece = Vec::new();
        for (i, &p) in way.iter().enumerate() {
            piece.push(p);
            let last = i + 1 == way.len();
            if piece.len() > 1 && (last || uses[p] > 1) {
                ways.ways.push(Way {
                    places: std::mem::replace(&mut piece, vec![p]),
                    name: line.pointer.clone(),
                    sensor: wishes.sensor_for(line.sensor.as_ref()).map(str::to_owned),
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: LineArgs,
    }

    fn args(dir: &std::path::Path, text: &str, more: &[&str]) -> LineArgs {
        let file = dir.join("lines.geojson");
        std::fs::write(&file, text).unwrap();
        let file = file.display().to_string();
        let all = ["line", &file].into_iter().chain(more.iter().copied());
        Cli::try_parse_from(all).unwrap().args
    }

    const CROSS: &str = r#"{"type":"FeatureCollection","features":[
        {"type":"Feature","geometry":{"type":"LineString","coordinates":[[8.54,47.40],[8.55,47.40],[8.56,47.40]]}},
        {"type":"Feature","geometry":{"type":"LineString","coordinates":[[8.55,47.39],[8.55,47.40],[8.55,47.41]]}},
        {"type":"Feature","properties":{"width_m":150},"geometry":{"type":"LineString","coordinates":[[8.54,47.42],[8.56,47.42]]}}]}"#;

    #[test]
    fn crossing_roads_are_cut_and_wide_strips_become_lanes() {
        let dir = std::env::temp_dir().join(format!("skein-plan-line-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let one = args(&dir, CROSS, &["--swath-m", "50"]);
        let told: serde_json::Value = serde_json::from_str(&run(&one).unwrap()).unwrap();
        // Four arms of the cross and three lanes.
        assert_eq!(told["targets"], 7);
        assert_eq!(told["tours"][0]["passes"].as_array().unwrap().len(), 7);
        let team = args(
            &dir,
            CROSS,
            &["--k", "2", "--wind-mps", "5", "--format", "geojson"],
        );
        let map: serde_json::Value = serde_json::from_str(&run(&team).unwrap()).unwrap();
        assert_eq!(map["features"].as_array().unwrap().len(), 2);
        assert!(map["makespan_s"].as_f64() >= map["lower_bound_s"].as_f64());
        let out = dir.join("plans").display().to_string();
        let split = args(
            &dir,
            CROSS,
            &["--k", "2", "--format", "plan", "--out", &out],
        );
        let told = run(&split).unwrap();
        assert!(told.contains("uav-2.plan"));
        let text = std::fs::read_to_string(dir.join("plans/uav-1.plan")).unwrap();
        assert!(skein_interop::plan::read(&text).unwrap().waypoints.len() > 2);
        for (more, says) in [
            (&["--k", "0"][..], "--k must be"),
            (&["--wind-mps", "20"], "--wind-mps"),
            (&["--k", "2", "--format", "plan"], "--out DIR"),
            (&["--out", "plans"], "add --format plan"),
            (&["--depot", "x"], "--depot"),
            (&["--swath-m", "0"], "/features/"),
        ] {
            let error = format!("{:#}", run(&args(&dir, CROSS, more)).unwrap_err());
            assert!(error.contains(says), "{error}");
        }
        let none = r#"{"type":"FeatureCollection","features":[]}"#;
        assert!(run(&args(&dir, none, &[])).is_err());
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
