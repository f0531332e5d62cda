//! A run in the formats of other programs.

use crate::cells::Cells;
use crate::foxglove::{self, colour, feature};
use crate::model::{Record, Ring, Scene};
use crate::sink::Collected;
use crate::tracks;
use serde::Serialize;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::{self, Write};

/// The columns of [`csv`].
pub const COLUMNS: [&str; 17] = [
    "time_ms",
    "uav",
    "state",
    "east_m",
    "north_m",
    "lat_deg",
    "lon_deg",
    "height_m",
    "heading_deg",
    "airspeed_mps",
    "fuel_left_s",
    "cells_left",
    "nearest_other_m",
    "failsafe",
    "component",
    "covered_cells",
    "coverable_cells",
];

/// One row for each UAV and frame; what is not known is empty. `component` counts the parts of
/// the swarm of the frame from 0.
///
/// # Errors
/// When it cannot be written.
pub fn csv(run: &Collected, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "{}", COLUMNS.join(","))?;
    for frame in &run.frames {
        for uav in &frame.uavs {
            let pose = |of: fn(&crate::model::frame::Pose) -> f64| text(uav.pose.as_ref().map(of));
            let in_part = |part: &Vec<u16>| part.contains(&uav.id);
            let component = frame.components.iter().position(in_part);
            let row = [
                frame.time_ms.to_string(),
                uav.id.to_string(),
                uav.state.word().to_owned(),
                pose(|p| p.place.east_m),
                pose(|p| p.place.north_m),
                pose(|p| p.place.lat_deg),
                pose(|p| p.place.lon_deg),
                pose(|p| p.height_m),
                pose(|p| p.heading_deg),
                pose(|p| p.airspeed_mps),
                text(uav.fuel_left_s),
                uav.cells_left.to_string(),
                text(uav.nearest_other_m),
                uav.failsafe.to_string(),
                text(component),
                frame.covered_cells.to_string(),
                frame.coverable_cells.to_string(),
            ];
            writeln!(out, "{}", row.join(","))?;
        }
    }
    Ok(())
}

fn text(value: Option<impl ToString>) -> String {
    value.map_or_else(String::new, |v| v.to_string())
}

/// One object a line, each with its `type`, in the order of time.
///
/// # Errors
/// When it cannot be written.
pub fn jsonl(run: &Collected, out: &mut dyn Write) -> io::Result<()> {
    for record in in_order(run) {
        match &record {
            Record::Scene(scene) => line(out, "scene", scene)?,
            Record::Frame(frame) => line(out, "frame", frame)?,
            Record::Event(event) => line(out, "event", event)?,
            Record::FailureFree(run) => line(out, "failure_free", run)?,
            Record::End(end) => line(out, "end", end)?,
        }
    }
    Ok(())
}

fn line(out: &mut dyn Write, word: &str, value: &impl Serialize) -> io::Result<()> {
    let mut value = serde_json::to_value(value)?;
    value["type"] = word.into();
    serde_json::to_writer(&mut *out, &value)?;
    out.write_all(b"\n")
}

/// The words of a run in the order of their times; at one time the scene is first, then events.
#[must_use]
pub fn in_order(run: &Collected) -> Vec<Record> {
    let scenes = run
        .scenes
        .iter()
        .map(|s| Record::Scene(Box::new(s.clone())));
    let events = run.events.iter().cloned().map(Record::Event);
    let frames = run.frames.iter().cloned().map(Record::Frame);
    // It holds from the start on, and follows the first scene.
    let compared = run.failure_free.iter().cloned().map(Record::FailureFree);
    let mut all: Vec<Record> = (scenes.chain(compared))
        .chain(events)
        .chain(frames)
        .collect();
    all.sort_by_key(Record::time_ms);
    all.extend(run.end.clone().map(Record::End));
    all
}

/// Who had which cell at the end, and of which scene: the last one.
#[must_use]
pub fn cells_at_end(run: &Collected) -> Cells {
    let mut cells = Cells::default();
    in_order(run).iter().for_each(|record| cells.hear(record));
    cells
}

/// Site, cells at the end, tracks and losses, as one collection of GeoJSON; positions are
/// longitude, latitude and height in metres above the origin.
#[must_use]
pub fn geojson(run: &Collected) -> Value {
    let Some(scene) = run.scenes.last() else {
        return foxglove::collection(Vec::new());
    };
    let mut all = foxglove::site(scene);
    all.extend(foxglove::cells(scene, &cells_at_end(run), |_| true));
    for (uav, lives) in tracks::of(&run.frames) {
        for (life, track) in (1u32..).zip(&lives) {
            let at = |(_, p): &tracks::Fix| [p.place.lon_deg, p.place.lat_deg, p.height_m];
            let line: Vec<[f64; 3]> = track.iter().map(at).collect();
            // A line of GeoJSON has two positions at least.
            if line.len() < 2 {
                continue;
            }
            let (from, to) = (track.first(), track.last());
            let ms = |fix: Option<&tracks::Fix>| fix.map(|f| f.0);
            all.push(feature(
                json!({ "type": "LineString", "coordinates": line }),
                json!({
                    "kind": "track", "uav": uav, "life": life,
                    "from_ms": ms(from), "to_ms": ms(to),
                    "style": { "color": colour(scene, uav) },
                }),
            ));
        }
    }
    for (uav, (time_ms, pose)) in tracks::losses(&run.frames) {
        let at = [pose.place.lon_deg, pose.place.lat_deg, pose.height_m];
        all.push(feature(
            json!({ "type": "Point", "coordinates": at }),
            json!({ "kind": "lost", "uav": uav, "time_ms": time_ms }),
        ));
    }
    foxglove::collection(all)
}

/// Area, zones and tracks as KML; heights are relative to the ground.
#[must_use]
pub fn kml(run: &Collected) -> String {
    let mut out = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>\n",
    );
    if let Some(scene) = run.scenes.last() {
        let title = format!("{}, seed {}", scene.scenario, scene.seed);
        let _ = writeln!(out, "<name>{}</name>", escaped(&title));
        placemark(&mut out, "area", "#222222", &polygon(&scene.area));
        for zone in &scene.zones {
            placemark(&mut out, &zone.name, "#dd1111", &polygon(&zone.ring));
        }
        flown(&mut out, scene, run);
    }
    out.push_str("</Document></kml>\n");
    out
}

fn flown(out: &mut String, scene: &Scene, run: &Collected) {
    for (uav, lives) in tracks::of(&run.frames) {
        for track in lives {
            let at = |(_, p): &tracks::Fix| {
                format!("{},{},{}", p.place.lon_deg, p.place.lat_deg, p.height_m)
            };
            let line: Vec<String> = track.iter().map(at).collect();
            let shape = format!(
                "<LineString><altitudeMode>relativeToGround</altitudeMode><coordinates>{}</coordinates></LineString>",
                line.join(" ")
            );
            placemark(out, &format!("uav{uav}"), colour(scene, uav), &shape);
        }
    }
}

fn polygon(ring: &Ring) -> String {
    let corners = foxglove::closed(ring);
    let corners: Vec<String> = corners.iter().map(|[x, y]| format!("{x},{y}")).collect();
    format!(
        "<Polygon><outerBoundaryIs><LinearRing><coordinates>{}</coordinates></LinearRing></outerBoundaryIs></Polygon>",
        corners.join(" ")
    )
}

fn placemark(out: &mut String, name: &str, colour: &str, shape: &str) {
    // KML writes alpha, blue, green, red.
    let part = |at: usize| colour.get(at..at + 2).unwrap_or("00");
    let (red, green, blue) = (part(1), part(3), part(5));
    let _ = writeln!(
        out,
        "<Placemark><name>{}</name><Style><LineStyle><color>ff{blue}{green}{red}</color><width>2</width></LineStyle><PolyStyle><color>40{blue}{green}{red}</color></PolyStyle></Style>{shape}</Placemark>",
        escaped(name)
    );
}

/// Text as XML and HTML hold it.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated;
    use skein_netsim::Prepared;
    use skein_netsim::runs::Wanted;
    use skein_netsim::world::fixture::square_losing;

    fn run() -> Collected {
        let mut spec = square_losing(2, 2, 20_000);
        spec.name = "a <square> & more".to_owned();
        let mut run = Collected::default();
        let wanted = Wanted::default();
        simulated::fly(&Prepared::new(spec), 3, None, wanted, &mut run).unwrap();
        run
    }

    #[test]
    fn a_row_of_csv_is_a_uav_in_a_frame() {
        let run = run();
        let mut out = Vec::new();
        csv(&run, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
        assert_eq!(rows[0], COLUMNS);
        assert_eq!(rows.len(), 1 + 2 * run.frames.len());
        assert!(rows.iter().all(|r| r.len() == COLUMNS.len()));
        let last = rows.last().unwrap();
        assert_eq!((last[1], last[2], last[3]), ("2", "lost", ""));
        let pose = run.frames[7].uavs[0].pose.unwrap();
        assert_eq!(rows[1 + 14][5], pose.place.lat_deg.to_string());
    }

    #[test]
    fn lines_of_json_are_in_order_and_read_back() {
        let run = run();
        let mut out = Vec::new();
        jsonl(&run, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<Value> = text
            .lines()
            .map(|l| serde_json::from_str(l).unwrap())
            .collect();
        assert_eq!(lines[0]["type"], "scene");
        assert_eq!(lines.last().unwrap()["type"], "end");
        let n = run.scenes.len() + run.frames.len() + run.events.len() + 1;
        assert_eq!(lines.len(), n);
        let times = lines.iter().map(|l| l["time_ms"].as_u64().unwrap());
        assert!(times.collect::<Vec<_>>().is_sorted());
    }

    #[test]
    fn geojson_has_site_cells_tracks_and_losses() {
        let run = run();
        let value = geojson(&run);
        let features = value["features"].as_array().unwrap();
        let kind = |word: &str| {
            let of = |f: &&Value| f["properties"]["kind"] == word;
            features.iter().filter(of).count()
        };
        assert_eq!((kind("track"), kind("lost")), (2, 1));
        let covered: u64 = (features.iter())
            .filter(|f| f["properties"]["status"] == "covered")
            .map(|f| f["properties"]["cells"].as_u64().unwrap())
            .sum();
        let needed = run.scenes[0].cells.iter().filter(|c| c.needed).count();
        assert!(covered >= needed as u64);
        let ring = features[0]["geometry"]["coordinates"][0]
            .as_array()
            .unwrap();
        assert_eq!(ring.first(), ring.last());
        // Longitude comes first.
        let lon = run.scenes[0].area.lat_lon_deg[0][1];
        assert_eq!(ring[0][0].as_f64(), Some(lon));
    }

    #[test]
    fn kml_holds_every_track_and_no_bare_markup() {
        let text = kml(&run());
        assert!(text.contains("a &lt;square&gt; &amp; more"));
        assert_eq!(text.matches("<LineString>").count(), 2);
        assert_eq!(
            text.matches("<Placemark>").count(),
            text.matches("</Placemark>").count()
        );
    }
}
