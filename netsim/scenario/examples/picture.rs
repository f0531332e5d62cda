//! Flies a scenario in virtual time and draws what happened as an SVG on stdout: the
//! area, its no-fly zones, each cell in the colour of the UAV that saw it first, the
//! tracks, and where UAVs were lost.
//!
//! ```sh
//! cargo run --release -p skein-scenario --example picture -- helsinki > picture.svg
//! ```
//!
//! After the scenario's name or file, a seed may follow.

use skein_flight::coverage::ring::CoverageLoop;
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_netsim::Prepared;
use skein_netsim::history::What;
use skein_netsim::swarm::Swarm;
use skein_peer::Report;
use skein_scenario::Overrides;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::process::ExitCode;
use std::sync::Arc;

/// Tracks are sampled this often, milliseconds.
const SAMPLE_MS: u64 = 500;

/// Points of a track that lie nearer to a straight line than this are left out, metres.
const STRAIGHT_M: f64 = 0.4;

/// Room round the area, and for one line of text, metres of a picture 1,000 m wide.
const MARGIN_M: f64 = 70.0;

/// Colours that can be told apart on white and on black, also by the colour-blind.
const COLOURS: [&str; 8] = [
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#a59a00", "#8a63d2",
];

/// What is drawn of one UAV.
#[derive(Default)]
struct Flight {
    /// One track a life of the airframe.
    tracks: Vec<Vec<Point>>,
    /// Cells that it saw before all others.
    cells: Vec<u16>,
    /// Where it was lost.
    lost: Vec<Point>,
}

fn main() -> ExitCode {
    let mut words = std::env::args().skip(1);
    let name = words.next();
    let seed = words.next().map(|s| s.parse::<u64>());
    let seed = match seed.transpose() {
        Ok(seed) => seed,
        Err(e) => return refuse(&format!("the seed: {e}")),
    };
    let over = Overrides {
        seed,
        ..Overrides::default()
    };
    match skein_scenario::open(name.as_deref(), &over) {
        Ok(scenario) => {
            let loop_of = Arc::clone(&scenario.geometry.coverage_loop);
            print!("{}", fly(&Prepared::new(scenario.spec), &loop_of));
            ExitCode::SUCCESS
        }
        Err(e) => refuse(&e.to_string()),
    }
}

fn refuse(why: &str) -> ExitCode {
    eprintln!("error: {why}");
    ExitCode::FAILURE
}

/// Runs the scenario with its own seed and faults, and draws it.
fn fly(prepared: &Prepared, loop_of: &CoverageLoop) -> String {
    let spec = &prepared.spec;
    let mut swarm = Swarm::new(prepared, spec.seed, spec.faults.clone(), true);
    let mut flights: BTreeMap<u16, Flight> = BTreeMap::new();
    let mut aloft: BTreeMap<u16, bool> = BTreeMap::new();
    let mut goes_on = true;
    while goes_on {
        goes_on = swarm.run_until(swarm.now_ms() + SAMPLE_MS);
        for uav in &spec.uavs {
            let flight = flights.entry(uav.id).or_default();
            let was_aloft = aloft.entry(uav.id).or_default();
            let pose = swarm.pose(uav.id);
            if let Some(pose) = pose {
                if !*was_aloft {
                    flight.tracks.push(Vec::new());
                }
                if let Some(track) = flight.tracks.last_mut() {
                    track.push(Point::new(pose.east_m, pose.north_m));
                }
            }
            if *was_aloft && pose.is_none() {
                let last = flight.tracks.last().and_then(|t| t.last()).copied();
                flight.lost.extend(last);
            }
            *was_aloft = pose.is_some();
        }
    }
    let mut makespan_s = None;
    let mut seen = BTreeSet::new();
    for entry in swarm.history().entries() {
        match &entry.what {
            What::Report {
                peer,
                report: Report::Covered { cells },
            } => {
                let first = cells.iter().filter(|c| seen.insert(**c));
                flights.entry(*peer).or_default().cells.extend(first);
            }
            What::Covered => makespan_s = Some(entry.time_ms / 1000),
            _ => {}
        }
    }
    draw(prepared, loop_of, &flights, makespan_s)
}

fn draw(
    prepared: &Prepared,
    loop_of: &CoverageLoop,
    flights: &BTreeMap<u16, Flight>,
    makespan_s: Option<u64>,
) -> String {
    let spec = &prepared.spec;
    let corners = || {
        let ids = loop_of.cells().iter().map(|c| c.id);
        ids.filter_map(|id| loop_of.patches().corners(id)).flatten()
    };
    let (mut low, mut high) = (Point::new(0.0, 0.0), Point::new(0.0, 0.0));
    for (i, p) in corners().enumerate() {
        if i == 0 {
            (low, high) = (p, p);
        }
        low = Point::new(low.x.min(p.x), low.y.min(p.y));
        high = Point::new(high.x.max(p.x), high.y.max(p.y));
    }
    let scale = 1000.0 / (high.x - low.x).max(1.0);
    let at = |p: Point| Point::new((p.x - low.x) * scale, (high.y - p.y) * scale);
    let (width, height) = (1000.0, (high.y - low.y) * scale);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{:.0} {:.0} {:.0} {:.0}\" font-family=\"sans-serif\" font-size=\"22\">\n{STYLE}",
        -MARGIN_M,
        -MARGIN_M,
        width + 2.0 * MARGIN_M,
        height + 3.0 * MARGIN_M,
    );
    let page = "<rect class=\"page\" x=\"-70\" y=\"-70\" width=\"100%\" height=\"100%\"/>";
    let _ = writeln!(svg, "{page}");
    let inside = |p: &&Polygon| {
        let (a, b) = p.bounds();
        a.x > low.x && b.x < high.x && a.y > low.y && b.y < high.y
    };
    let outline = |p: &Polygon| ring(p.vertices().iter().map(|v| at(*v)));
    let buildings = spec.buildings.iter().map(|b| &b.footprint).filter(inside);
    let _ = writeln!(
        svg,
        "<path class=\"building\" d=\"{}\"/>",
        join(buildings.map(outline))
    );
    for (colour, flight) in colours(flights) {
        let squares = flight.cells.iter().filter_map(|c| {
            let cell = loop_of.cells().get(usize::from(*c))?;
            Some(ring(
                loop_of.patches().corners(cell.id)?.into_iter().map(at),
            ))
        });
        let _ = writeln!(
            svg,
            "<path fill=\"{colour}\" fill-opacity=\"0.3\" d=\"{}\"/>",
            join(squares)
        );
    }
    let _ = writeln!(
        svg,
        "<path class=\"zone\" d=\"{}\"/>",
        join(spec.zones.iter().map(outline))
    );
    for (colour, flight) in colours(flights) {
        let tracks = flight.tracks.iter().map(|t| {
            let points: Vec<Point> = t.iter().map(|p| at(*p)).collect();
            line(simplified(&points).into_iter())
        });
        let _ = writeln!(
            svg,
            "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"3.5\" stroke-linejoin=\"round\" d=\"{}\"/>",
            join(tracks)
        );
    }
    for p in flights.values().flat_map(|f| &f.lost) {
        let p = at(*p);
        let _ = writeln!(
            svg,
            "<path class=\"lost\" d=\"M{:.0} {:.0}l28 28m0-28l-28 28\"/>",
            p.x - 14.0,
            p.y - 14.0
        );
    }
    if let Some(station) = &spec.ground {
        let p = at(station.position);
        let _ = writeln!(
            svg,
            "<path class=\"ink\" d=\"M{:.0} {:.0}l14 24h-28z\"/>",
            p.x,
            p.y - 14.0
        );
    }
    legend(&mut svg, prepared, flights, makespan_s, height);
    svg.push_str("</svg>\n");
    svg
}

/// Colours follow the reader's: light or dark.
const STYLE: &str = "<style>.page{fill:#fff}.ink{fill:#222}.building{fill:#888;fill-opacity:.22}\
.zone{fill:#d11;fill-opacity:.45;stroke:#d11;stroke-width:3}\
.lost{fill:none;stroke:#111;stroke-width:7}\
@media(prefers-color-scheme:dark){.page{fill:#0d1117}.ink{fill:#ddd}.lost{stroke:#fff}}</style>\n";

fn legend(
    svg: &mut String,
    prepared: &Prepared,
    flights: &BTreeMap<u16, Flight>,
    makespan_s: Option<u64>,
    height: f64,
) {
    let spec = &prepared.spec;
    let seen: usize = flights.values().map(|f| f.cells.len()).sum();
    let lost: usize = flights.values().map(|f| f.lost.len()).sum();
    let end = makespan_s.map_or("not all is covered".to_owned(), |s| {
        format!("all is covered after {s} s")
    });
    let _ = writeln!(
        svg,
        "<text class=\"ink\" x=\"0\" y=\"-28\">{}, seed {}: {} UAVs, {lost} of them lost; {seen} cells of the loop, {end}</text>",
        spec.name,
        spec.seed,
        spec.uavs.len()
    );
    #[allow(clippy::cast_precision_loss, reason = "a few dozen UAVs")]
    let step = 1000.0 / flights.len().max(1) as f64;
    let mut x = 0.0;
    for ((colour, flight), id) in colours(flights).zip(flights.keys()) {
        let y = height + 40.0;
        let _ = writeln!(
            svg,
            "<rect fill=\"{colour}\" x=\"{x:.0}\" y=\"{:.0}\" width=\"20\" height=\"20\"/><text class=\"ink\" x=\"{:.0}\" y=\"{:.0}\">{id}: {}</text>",
            y - 18.0,
            x + 28.0,
            y,
            flight.cells.len()
        );
        x += step;
    }
    let _ = writeln!(
        svg,
        "<text class=\"ink\" x=\"0\" y=\"{:.0}\">UAV: cells that it saw first. ×: lost. Red: no-fly zones. Triangle: ground station</text>",
        height + 80.0
    );
}

/// Each flight with its colour.
fn colours(flights: &BTreeMap<u16, Flight>) -> impl Iterator<Item = (&'static str, &Flight)> {
    COLOURS.into_iter().cycle().zip(flights.values())
}

fn join(parts: impl Iterator<Item = String>) -> String {
    parts.collect()
}

/// A path through points, in whole units.
fn line(points: impl Iterator<Item = Point>) -> String {
    let mut words: Vec<String> = points.map(|p| format!("{:.0} {:.0}", p.x, p.y)).collect();
    words.dedup();
    format!("M{}", words.join("L"))
}

/// The same, closed.
fn ring(points: impl Iterator<Item = Point>) -> String {
    line(points) + "z"
}

/// The points without those that lie on a straight line with others (Douglas and
/// Peucker 1973).
fn simplified(points: &[Point]) -> Vec<Point> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return Vec::new();
    };
    let along = last - first;
    let length = along.norm();
    let off = |p: &Point| {
        let d = p - first;
        if length > 1.0 {
            (along.x * d.y - along.y * d.x).abs() / length
        } else {
            d.norm()
        }
    };
    let farthest = (0..points.len()).max_by(|a, b| off(&points[*a]).total_cmp(&off(&points[*b])));
    match farthest {
        Some(i) if off(&points[i]) > STRAIGHT_M => {
            let mut out = simplified(&points[..=i]);
            out.pop();
            out.extend(simplified(&points[i..]));
            out
        }
        _ => vec![*first, *last],
    }
}
