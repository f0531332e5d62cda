//! `bench clearance`: taut routes at growing distance from the zones against the route
//! of most distance, that along the Voronoi edges (D2.7 §2.3.1).

use super::figures::{Times, timed};
use anyhow::{Context, Result, ensure};
use clap::Args;
use serde::Serialize;
use skein_flight::route::mesh::{Mesh, delaunay};
use skein_flight::route::two_point::Search;
use skein_geometry::frame::Point;
use skein_geometry::offset::{Growth, Region, Zone, grow};
use skein_geometry::random::SplitMix64;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// From zone to zone, metres.
const PITCH_M: f64 = 100.0;

/// The least way between two zones, metres.
const GAP_M: f64 = 8.0;

/// Distance of samples on outlines, metres: Voronoi edges are right to about its square
/// over the distance of zones, centimetres.
const STEP_M: f64 = 1.0;

/// Distances kept, metres: from none to all but half the narrowest gap.
const OFFSETS_M: [f64; 6] = [0.0, 0.5, 1.0, 2.0, 3.0, 3.9];

/// The largest field: a million samples.
const MAX_SIDE: usize = 64;

/// A field of octagons.
#[derive(Clone, Copy, Debug, Args)]
pub struct ClearanceArgs {
    /// Zones a side.
    #[arg(long, value_name = "N", default_value_t = 12)]
    pub side: usize,
    /// Share of the area that is zone, above 0 and up to 0.5.
    #[arg(long, value_name = "SHARE")]
    pub density: f64,
    /// Pairs of places.
    #[arg(long, value_name = "N", default_value_t = 200)]
    pub n: usize,
}

#[derive(Serialize)]
struct Answer {
    n: usize,
    zones: usize,
    density: f64,
    /// Distances kept by the taut routes, metres.
    offsets_m: Vec<f64>,
    /// Mean length over that of the straight line, by distance kept.
    taut_over_straight: Vec<f64>,
    /// The same for the route of most distance.
    voronoi_over_straight: f64,
    /// Share of pairs where the taut route is the shorter one, by distance kept.
    taut_is_shorter: Vec<f64>,
    /// Mean of the least distance from zones along the route of most distance, metres.
    voronoi_least_m: f64,
    /// Growing and meshing, and a question, at the last distance.
    build_ms: f64,
    #[serde(flatten)]
    times: Times,
}

/// Compares the lengths of both kinds of routes.
///
/// # Errors
/// When a flag is out of range.
pub fn run(args: &ClearanceArgs) -> Result<String> {
    ensure!(
        args.density > 0.0 && args.density <= 0.5,
        "--density must be above 0 and up to 0.5, found {}",
        args.density
    );
    ensure!(
        (2..=MAX_SIDE).contains(&args.side),
        "--side must be 2 to {MAX_SIDE}"
    );
    let (border, zones) = field(args.side, args.density);
    let graph = Voronoi::of(&border, &zones)?;
    let pairs = graph.pairs(args.n, args.side as f64 * PITCH_M);
    ensure!(
        !pairs.is_empty(),
        "no two places are far enough from all zones"
    );
    let voronoi: Vec<(f64, f64)> = pairs
        .iter()
        .map(|&[a, b]| {
            graph
                .route(a, b)
                .context("the Voronoi edges are not connected")
        })
        .collect::<Result<_>>()?;
    let ends: Vec<[Point; 2]> = pairs
        .iter()
        .map(|p| p.map(|i| graph.nodes[i as usize].at))
        .collect();
    let straight_m = |[a, b]: &[Point; 2]| (b - a).norm();
    let n = pairs.len() as f64;
    let mut answer = Answer {
        n: pairs.len(),
        zones: zones.len(),
        density: args.density,
        offsets_m: OFFSETS_M.to_vec(),
        taut_over_straight: Vec::new(),
        voronoi_over_straight: voronoi
            .iter()
            .zip(&ends)
            .map(|(v, e)| v.0 / straight_m(e))
            .sum::<f64>()
            / n,
        taut_is_shorter: Vec::new(),
        voronoi_least_m: voronoi.iter().map(|v| v.1).sum::<f64>() / n,
        build_ms: 0.0,
        times: Times::of(Vec::new()),
    };
    for offset_m in OFFSETS_M {
        let (mesh, build_us) = timed(|| grown_mesh(&border, &zones, offset_m));
        let mesh = mesh?;
        let mut search = Search::new(&mesh);
        let mut lengths = Vec::with_capacity(ends.len());
        let mut each_us = Vec::with_capacity(ends.len());
        for &[a, b] in &ends {
            let (length_m, us) = timed(|| search.distance_m(a, b));
            lengths.push(length_m.context("no route between two places of the Voronoi edges")?);
            each_us.push(us);
        }
        let ratios = lengths.iter().zip(&ends).map(|(m, e)| m / straight_m(e));
        answer.taut_over_straight.push(ratios.sum::<f64>() / n);
        let shorter = lengths
            .iter()
            .zip(&voronoi)
            .filter(|(m, v)| **m < v.0)
            .count();
        answer.taut_is_shorter.push(shorter as f64 / n);
        answer.build_ms = build_us / 1e3;
        answer.times = Times::of(each_us);
    }
    Ok(serde_json::to_string(&answer)?)
}

/// The border, and octagons of one size, turned and shifted at random.
fn field(side: usize, density: f64) -> (Vec<Point>, Vec<Vec<Point>>) {
    let mut random = SplitMix64::new(4);
    // An octagon in a circle of radius r covers 2 √2 r².
    let radius = PITCH_M * (density / (2.0 * core::f64::consts::SQRT_2)).sqrt();
    let radius = radius.min((PITCH_M - GAP_M) / 2.0);
    let room = (PITCH_M - GAP_M) / 2.0 - radius;
    let octagon = |i: usize| {
        let mut shift = || (2.0 * random.unit() - 1.0) * room;
        let x = ((i % side) as f64 + 0.5) * PITCH_M + shift();
        let y = ((i / side) as f64 + 0.5) * PITCH_M + shift();
        let turn = random.unit();
        let corner = |k: u32| {
            let a = core::f64::consts::TAU * (f64::from(k) + turn) / 8.0;
            Point::new(x + radius * a.cos(), y + radius * a.sin())
        };
        (0..8).map(corner).collect()
    };
    let zones = (0..side * side).map(octagon).collect();
    let size = side as f64 * PITCH_M;
    let border = [(0.0, 0.0), (size, 0.0), (size, size), (0.0, size)];
    (border.map(|(x, y)| Point::new(x, y)).to_vec(), zones)
}

/// The mesh of what keeps a distance from the zones; the border may be touched.
fn grown_mesh(border: &[Point], zones: &[Vec<Point>], offset_m: f64) -> Result<Mesh> {
    let drawn: Vec<Zone> = zones
        .iter()
        .map(|ring| Zone {
            outer: ring.clone(),
            holes: Vec::new(),
        })
        .collect();
    let grown = grow(&drawn, &Growth::new(offset_m)?)?;
    let rings: Vec<&[Point]> = std::iter::once(border)
        .chain(grown.regions.iter().flat_map(Region::rings))
        .collect();
    Ok(Mesh::from_rings(&rings)?)
}

/// A corner of the Voronoi diagram of the outlines.
struct Node {
    at: Point,
    /// Distance from the nearest outline, metres.
    room_m: f64,
    neighbours: Vec<u32>,
}

/// Voronoi edges between samples of different outlines: as far from zones as can be.
struct Voronoi {
    nodes: Vec<Node>,
}

impl Voronoi {
    fn of(border: &[Point], zones: &[Vec<Point>]) -> Result<Self> {
        let (mut samples, mut outline) = (Vec::new(), Vec::new());
        // Each side of the border is an outline of its own.
        let sides = (0..4).map(|i| [border[i], border[(i + 1) % 4]]);
        for (i, [a, b]) in sides.enumerate() {
            sample(&[a, b], false, &mut samples);
            outline.resize(samples.len(), i);
        }
        for (i, zone) in zones.iter().enumerate() {
            sample(zone, true, &mut samples);
            outline.resize(samples.len(), 4 + i);
        }
        let triangles = delaunay(&samples)?;
        let mut nodes = Vec::with_capacity(triangles.len());
        let mut sides: BTreeMap<[usize; 2], u32> = BTreeMap::new();
        for t in &triangles {
            let node = nodes.len() as u32;
            let at = circumcentre(t.map(|i| samples[i]));
            nodes.push(Node {
                at,
                room_m: (at - samples[t[0]]).norm(),
                neighbours: Vec::new(),
            });
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                if outline[a] == outline[b] {
                    continue;
                }
                if let Some(other) = sides.insert([a.min(b), a.max(b)], node) {
                    nodes[other as usize].neighbours.push(node);
                    nodes[node as usize].neighbours.push(other);
                }
            }
        }
        Ok(Self { nodes })
    }

    /// Corners with room for all distances, near random places; ends of routes of
    /// either kind, so that both answer the same question.
    fn pairs(&self, n: usize, size_m: f64) -> Vec<[u32; 2]> {
        let mut random = SplitMix64::new(5);
        let widest_m = OFFSETS_M.iter().copied().fold(0.0, f64::max);
        let fit: Vec<u32> = (0..)
            .zip(&self.nodes)
            .filter(|(_, v)| v.room_m > widest_m + 0.1 && !v.neighbours.is_empty())
            .map(|(i, _)| i)
            .collect();
        let mut near = || {
            let p = Point::new(size_m * random.unit(), size_m * random.unit());
            let away = |i: &u32| (self.nodes[*i as usize].at - p).norm_squared();
            fit.iter()
                .copied()
                .min_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)))
        };
        (0..n)
            .filter_map(|_| Some([near()?, near()?]))
            .filter(|[a, b]| {
                let d = self.nodes[*a as usize].at - self.nodes[*b as usize].at;
                d.norm() > PITCH_M
            })
            .collect()
    }

    /// Length of the shortest route along the edges, and its least distance from zones.
    fn route(&self, from: u32, to: u32) -> Option<(f64, f64)> {
        let mut best = vec![(f64::INFINITY, from); self.nodes.len()];
        best[from as usize] = (0.0, from);
        let mut queue = BinaryHeap::from([(Reverse(0u64), from)]);
        while let Some((Reverse(bits), i)) = queue.pop() {
            let length_m = f64::from_bits(bits);
            if i == to {
                break;
            }
            if length_m > best[i as usize].0 {
                continue;
            }
            let node = &self.nodes[i as usize];
            for &j in &node.neighbours {
                let there_m = length_m + (self.nodes[j as usize].at - node.at).norm();
                if there_m < best[j as usize].0 {
                    best[j as usize] = (there_m, i);
                    // Lengths are not negative, so their bits sort as they do.
                    queue.push((Reverse(there_m.to_bits()), j));
                }
            }
        }
        let mut at = to;
        let mut least_m = self.nodes[to as usize].room_m;
        while at != from && best[at as usize].0.is_finite() {
            at = best[at as usize].1;
            least_m = least_m.min(self.nodes[at as usize].room_m);
        }
        (at == from).then_some((best[to as usize].0, least_m))
    }
}

/// Points along a ring or a line, no farther apart than the step.
fn sample(line: &[Point], closed: bool, into: &mut Vec<Point>) {
    let n = if closed { line.len() } else { line.len() - 1 };
    for i in 0..n {
        let (a, b) = (line[i], line[(i + 1) % line.len()]);
        let steps = ((b - a).norm() / STEP_M).ceil().max(1.0);
        into.extend((0..steps as u32).map(|k| a + (b - a) * (f64::from(k) / steps)));
    }
}

fn circumcentre([a, b, c]: [Point; 3]) -> Point {
    let (u, v) = (b - a, c - a);
    let twice = 2.0 * u.perp(&v);
    let (uu, vv) = (u.norm_squared(), v.norm_squared());
    let x = (v.y * uu - u.y * vv) / twice;
    let y = (u.x * vv - v.x * uu) / twice;
    Point::new(a.x + x, a.y + y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cautious_distance_is_shorter_than_the_most_distance() {
        let args = ClearanceArgs {
            side: 4,
            density: 0.15,
            n: 20,
        };
        let answer: serde_json::Value = serde_json::from_str(&run(&args).unwrap()).unwrap();
        let ratios: Vec<f64> = answer["taut_over_straight"]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap())
            .collect();
        assert!(ratios.is_sorted() && ratios[0] >= 1.0, "{ratios:?}");
        assert!(answer["voronoi_over_straight"].as_f64().unwrap() > ratios[5]);
        assert!(answer["voronoi_least_m"].as_f64().unwrap() > 3.9);
        for density in [0.0, 0.6, f64::NAN] {
            assert!(run(&ClearanceArgs { density, ..args }).is_err());
        }
    }
}
