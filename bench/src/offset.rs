//! `bench offset`: random star polygons grown by a radius, every outline measured
//! against its zone by a check of its own (D2.7 §2.3.1).

use super::figures::{Times, timed};
use crate::measure::to_piece_m;
use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use serde::Serialize;
use skein_geometry::frame::Point;
use skein_geometry::math::{PI, TAU, sin_cos};
use skein_geometry::offset::{Growth, Piece, Zone, grow, grow_exact};
use skein_geometry::random::SplitMix64;

/// An outline is a violation from this share of the radius below it, so that nobody
/// is blamed for the last bits of a distance.
const ROUNDING: f64 = 1e-9;

/// Random star polygons with radii of 100 to 500 m, or hostile rings.
#[derive(Debug, Args)]
pub struct OffsetArgs {
    /// How many polygons.
    #[arg(long, default_value_t = 100_000, value_name = "N")]
    pub n: usize,
    /// Vertices of each.
    #[arg(long, default_value_t = 8, value_name = "V")]
    pub vertices: usize,
    /// Safety radius, metres.
    #[arg(long, default_value_t = 30.0, value_name = "R")]
    pub radius_m: f64,
    /// What the polygons are.
    #[arg(long, value_enum, default_value_t = Kind::Star)]
    pub kind: Kind,
    /// Where the random numbers begin.
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    pub seed: u64,
    /// Outlines of lines and true arcs instead of tangent polygons.
    #[arg(long)]
    pub arcs: bool,
    /// Grow the same polygons with another library, too.
    #[cfg(feature = "rivals")]
    #[arg(long, value_enum)]
    pub against: Option<Rival>,
}

/// Kinds of polygons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Simple rings round a centre.
    Star,
    /// Vertices anywhere: rings that cross themselves.
    Wild,
    /// Vertices on a coarse grid: spikes, contacts, repeats.
    Grid,
}

/// Libraries to compare with.
#[cfg(feature = "rivals")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Rival {
    /// The buffer of the `geo` crate.
    Geo,
}

#[derive(Serialize)]
struct Figures {
    /// Outlines nearer than the radius, and nearer than 0.99 times the radius.
    violations: usize,
    violations_1_percent: usize,
    refused: usize,
    /// Least and largest distance of an outline from its zone, in radii.
    min_ratio: f64,
    max_ratio: f64,
    max_overshoot_m: f64,
    #[serde(flatten)]
    times: Times,
}

#[derive(Serialize)]
struct Answer {
    n: usize,
    vertices: usize,
    radius_m: f64,
    /// Polygons that were put right, for example because they cross themselves.
    repaired: usize,
    max_margin_m: f64,
    #[serde(flatten)]
    figures: Figures,
    #[serde(skip_serializing_if = "Option::is_none")]
    rival: Option<Figures>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ratio: Option<f64>,
}

/// Grows `n` polygons, one call each.
///
/// # Errors
/// When the radius or the number of vertices is out of range.
pub fn run(args: &OffsetArgs) -> Result<String> {
    let growth = Growth::new(args.radius_m)?;
    ensure!(args.radius_m > 0.0, "--radius-m must be above 0");
    ensure!(
        (3..=100_000).contains(&args.vertices),
        "--vertices must be from 3 to 100000"
    );
    let mut tally = Tally::new(args);
    let (mut repairs, mut max_margin_m) = (0, 0.0f64);
    #[cfg(feature = "rivals")]
    let mut rival = args.against.map(|_| Tally::new(args));
    let mut random = SplitMix64::new(args.seed);
    for _ in 0..args.n {
        let zone = [draw(args, &mut random)];
        let answer = if args.arcs {
            let (answer, us) = timed(|| grow_exact(&zone, args.radius_m));
            answer.map(|g| {
                let loops = g.regions.iter().flat_map(|r| r.loops()).map(chords);
                (loops.collect(), g.united_m, !g.repairs.is_empty(), us)
            })
        } else {
            let (answer, us) = timed(|| grow(&zone, &growth));
            answer.map(|g| {
                let rings: Vec<Vec<Point>> = g
                    .regions
                    .iter()
                    .flat_map(|r| r.rings())
                    .map(<[Point]>::to_vec)
                    .collect();
                (rings, g.margin_m, !g.repairs.is_empty(), us)
            })
        };
        match answer {
            Ok((rings, margin_m, repaired, us)) => {
                repairs += usize::from(repaired);
                max_margin_m = max_margin_m.max(margin_m);
                let rings: Vec<&[Point]> = rings.iter().map(Vec::as_slice).collect();
                tally.add(&zone[0], &rings, us);
            }
            Err(_) => tally.refused += 1,
        }
        #[cfg(feature = "rivals")]
        if let Some(rival) = &mut rival {
            geo_rival::grow(&zone[0], args.radius_m, rival);
        }
    }
    let figures = tally.sum_up();
    #[cfg(feature = "rivals")]
    let rival = rival.map(Tally::sum_up);
    #[cfg(not(feature = "rivals"))]
    let rival: Option<Figures> = None;
    Ok(serde_json::to_string(&Answer {
        n: args.n,
        vertices: args.vertices,
        radius_m: args.radius_m,
        repaired: repairs,
        max_margin_m,
        ratio: rival
            .as_ref()
            .map(|r| figures.times.mean_us / r.times.mean_us),
        figures,
        rival,
    })?)
}

/// Chords of half a circle that are measured in its place.
const CHORDS: f64 = 512.0;

/// Polylines with their corners on the arcs; their chords are nearer to the zone by
/// the sagitta, less than a share of 5e-6 of the radius for half a circle.
fn chords(pieces: &[Piece]) -> Vec<Point> {
    let mut ring = Vec::new();
    for p in pieces {
        let n = match p {
            Piece::Line { .. } => 1,
            Piece::Arc { .. } => (p.turn_rad() / PI * CHORDS).ceil().max(1.0) as usize,
        };
        ring.extend((0..n).map(|i| p.at(i as f64 / n as f64)));
    }
    ring
}

/// Errors and times of one library.
struct Tally {
    radius_m: f64,
    arcs: bool,
    violations: usize,
    violations_1_percent: usize,
    refused: usize,
    least_m: f64,
    most_m: f64,
    each_us: Vec<f64>,
}

impl Tally {
    fn new(args: &OffsetArgs) -> Self {
        Self {
            radius_m: args.radius_m,
            arcs: args.arcs,
            violations: 0,
            violations_1_percent: 0,
            refused: 0,
            least_m: f64::INFINITY,
            most_m: 0.0,
            each_us: Vec::with_capacity(args.n),
        }
    }

    /// Measures an outline: the distance of its edges from the zone, and of its
    /// vertices, which are its farthest points.
    fn add(&mut self, zone: &Zone, rings: &[&[Point]], us: f64) {
        self.each_us.push(us);
        let ring = &zone.outer;
        let n = ring.len();
        let mut least = f64::INFINITY;
        for outline in rings {
            for i in 0..outline.len() {
                let (c, d) = (outline[i], outline[(i + 1) % outline.len()]);
                let mut from_vertex = f64::INFINITY;
                for k in 0..n {
                    let (a, b) = (ring[k], ring[(k + 1) % n]);
                    let end = to_piece_m(c, a, b);
                    from_vertex = from_vertex.min(end);
                    least = least.min(end).min(to_piece_m(a, c, d));
                    if cross(a, b, c, d) {
                        least = 0.0;
                    }
                }
                self.most_m = self.most_m.max(from_vertex);
            }
        }
        // An outline that keeps its distance may still not be around the zone.
        let enclosed: i32 = rings.iter().map(|r| winding(r, ring[0])).sum();
        self.least_m = self.least_m.min(least);
        let sagitta = if self.arcs { 5e-6 } else { 0.0 };
        let below = |share: f64| usize::from(least < self.radius_m * share || enclosed != 1);
        self.violations += below(1.0 - ROUNDING - sagitta);
        self.violations_1_percent += below(0.99);
    }

    fn sum_up(self) -> Figures {
        Figures {
            violations: self.violations,
            violations_1_percent: self.violations_1_percent,
            refused: self.refused,
            min_ratio: self.least_m / self.radius_m,
            max_ratio: self.most_m / self.radius_m,
            max_overshoot_m: self.most_m - self.radius_m,
            times: Times::of(self.each_us),
        }
    }
}

fn cross(a: Point, b: Point, c: Point, d: Point) -> bool {
    let left = |p: Point, q: Point, x: Point| (q - p).perp(&(x - p)) > 0.0;
    left(a, b, c) != left(a, b, d) && left(c, d, a) != left(c, d, b)
}

fn winding(ring: &[Point], p: Point) -> i32 {
    let mut count = 0;
    for i in 0..ring.len() {
        let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
        let left = (b - a).perp(&(p - a)) > 0.0;
        if a.y <= p.y && b.y > p.y && left {
            count += 1;
        } else if b.y <= p.y && a.y > p.y && !left {
            count -= 1;
        }
    }
    count
}

fn draw(args: &OffsetArgs, random: &mut SplitMix64) -> Zone {
    let n = args.vertices;
    let outer = (0..n)
        .map(|i| match args.kind {
            Kind::Star => {
                let (s, c) = sin_cos(TAU * i as f64 / n as f64);
                let r = 100.0 + 400.0 * random.unit();
                Point::new(r * c, r * s)
            }
            Kind::Wild => Point::new(500.0 * random.unit(), 500.0 * random.unit()),
            Kind::Grid => Point::new(
                60.0 * (8.0 * random.unit()).floor(),
                60.0 * (8.0 * random.unit()).floor(),
            ),
        })
        .collect();
    Zone {
        outer,
        holes: Vec::new(),
    }
}

#[cfg(feature = "rivals")]
mod geo_rival {
    use super::{Point, Tally, Zone, timed};
    use geo::{Buffer, Coord, LineString, Polygon};

    /// Grows with the defaults of `geo`; the conversion is not timed.
    pub fn grow(zone: &Zone, radius_m: f64, tally: &mut Tally) {
        let ring: LineString<f64> = zone
            .outer
            .iter()
            .map(|p| Coord { x: p.x, y: p.y })
            .collect();
        let polygon = Polygon::new(ring, Vec::new());
        let (grown, us) = timed(|| polygon.buffer(radius_m));
        let open = |r: &LineString<f64>| -> Vec<Point> {
            let n = r.0.len().saturating_sub(1);
            r.0[..n].iter().map(|c| Point::new(c.x, c.y)).collect()
        };
        let rings: Vec<Vec<Point>> = grown
            .iter()
            .flat_map(|p| core::iter::once(p.exterior()).chain(p.interiors()))
            .map(open)
            .collect();
        let rings: Vec<&[Point]> = rings.iter().map(Vec::as_slice).collect();
        tally.add(zone, &rings, us);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_outline_is_too_near_whatever_the_rings() {
        for kind in [Kind::Star, Kind::Wild, Kind::Grid] {
            let text = run(&OffsetArgs {
                n: 300,
                vertices: 9,
                radius_m: 30.0,
                kind,
                seed: 7,
                arcs: false,
                #[cfg(feature = "rivals")]
                against: None,
            })
            .unwrap();
            let answer: serde_json::Value = serde_json::from_str(&text).unwrap();
            assert_eq!(answer["violations"], 0, "{kind:?} {text}");
            assert_eq!(answer["refused"], 0, "{kind:?} {text}");
            assert!(answer["min_ratio"].as_f64().unwrap() >= 1.0, "{text}");
        }
    }
}
