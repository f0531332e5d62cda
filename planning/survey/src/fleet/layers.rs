//! Heights for UAVs whose flights come near to each other (D2.7 §3.6: UAVs that share
//! cells): one layer for all that stay apart, as few layers as a simple rule finds.
//!
//! What counts is where flights lead, not when: UAVs that wait, or that are blown off
//! their times, are still apart. Leaves to the caller what a layer is in metres.

use skein_geometry::frame::Point;
use skein_geometry::polygon::line_to_line_m;
use std::collections::{BTreeMap, BTreeSet};

/// UAVs that start from one place are not told apart within so many separations of it:
/// they all come together there, and leave one after the other.
pub const LAUNCH_SEPARATIONS: f64 = 2.0;

/// Pieces that all flights are cut into at most, about: they are compared with their
/// neighbours.
const MOST_PIECES: f64 = 100_000.0;

/// Flights that come this much nearer than the separation are still apart: rounding of
/// neighbouring lanes, metres.
const ROUNDING_M: f64 = 1e-6;

/// By UAV: its layer, from 0. `tracks` are the corners of flights, each from its start.
///
/// Two UAVs are of one launch when their starts are nearer than the separation; the discs
/// of [`LAUNCH_SEPARATIONS`] round both starts do not count for them then. The UAVs with
/// the most neighbours are given the lowest free layer first.
///
/// # Guarantees
/// Two UAVs of one layer come no nearer than `separation_m`, but in the discs of their
/// common launch. A separation of 0 or none puts all into layer 0.
#[must_use]
pub fn layers(tracks: &[Vec<Point>], separation_m: f64) -> Vec<usize> {
    let mut near = vec![Vec::new(); tracks.len()];
    for (a, b) in conflicts(tracks, separation_m) {
        near[a].push(b);
        near[b].push(a);
    }
    let mut order: Vec<usize> = (0..tracks.len()).collect();
    order.sort_by(|a, b| near[*b].len().cmp(&near[*a].len()).then(a.cmp(b)));
    let mut layer: Vec<Option<usize>> = vec![None; tracks.len()];
    for uav in order {
        let taken: BTreeSet<usize> = near[uav].iter().filter_map(|n| layer[*n]).collect();
        layer[uav] = (0..=tracks.len()).find(|l| !taken.contains(l));
    }
    layer.into_iter().map(Option::unwrap_or_default).collect()
}

/// The pairs of UAVs whose flights come nearer than the separation outside of their
/// common launch, ascending.
#[must_use]
pub fn conflicts(tracks: &[Vec<Point>], separation_m: f64) -> Vec<(usize, usize)> {
    if !(separation_m.is_finite() && separation_m > 0.0) {
        return Vec::new();
    }
    let total_m: f64 = tracks.iter().flat_map(|t| t.windows(2)).map(length_m).sum();
    if !total_m.is_finite() {
        return Vec::new();
    }
    let side_m = (2.0 * separation_m).max(total_m / MOST_PIECES);
    let mut cells: BTreeMap<(i64, i64), Vec<Piece>> = BTreeMap::new();
    for (uav, track) in tracks.iter().enumerate() {
        for (a, b) in pieces(track, side_m) {
            cells
                .entry(cell(a + (b - a) * 0.5, side_m))
                .or_default()
                .push(Piece { uav, ends: [a, b] });
        }
    }
    let mut found = BTreeSet::new();
    for ((x, y), here) in &cells {
        // Middles of pieces that come nearer than the separation are at most one and a
        // half sides apart.
        let around = (-2..=2).flat_map(|dx| (-2..=2).map(move |dy| (x + dx, y + dy)));
        for there in around.filter_map(|at| cells.get(&at)).flatten() {
            for own in here.iter().filter(|p| p.uav < there.uav) {
                let pair = (own.uav, there.uav);
                if found.contains(&pair) {
                    continue;
                }
                let discs = launch(&tracks[pair.0], &tracks[pair.1], separation_m);
                if comes_near(own.ends, there.ends, &discs, separation_m - ROUNDING_M) {
                    found.insert(pair);
                }
            }
        }
    }
    found.into_iter().collect()
}

/// A straight piece of a flight.
struct Piece {
    uav: usize,
    ends: [Point; 2],
}

/// The discs that do not count for two UAVs: middles and radius.
struct Discs {
    middles: Vec<Point>,
    radius_m: f64,
}

fn launch(one: &[Point], other: &[Point], separation_m: f64) -> Discs {
    let starts = one.first().zip(other.first());
    let common = starts.filter(|(a, b)| (*a - *b).norm() < separation_m);
    Discs {
        middles: common.map_or_else(Vec::new, |(a, b)| vec![*a, *b]),
        radius_m: LAUNCH_SEPARATIONS * separation_m,
    }
}

fn length_m(leg: &[Point]) -> f64 {
    (leg[1] - leg[0]).norm()
}

fn cell(p: Point, side_m: f64) -> (i64, i64) {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a cast of a float saturates"
    )]
    let number = |x: f64| (x / side_m).floor() as i64;
    (number(p.x), number(p.y))
}

/// A flight in straight pieces of at most this length; one that stays is a point.
fn pieces(track: &[Point], most_m: f64) -> Vec<(Point, Point)> {
    let mut all = Vec::new();
    for leg in track.windows(2) {
        let n = (length_m(leg) / most_m).ceil().max(1.0);
        let at = |i: f64| leg[0] + (leg[1] - leg[0]) * (i / n);
        let mut i = 0.0;
        while i < n {
            all.push((at(i), at(i + 1.0)));
            i += 1.0;
        }
    }
    // A UAV that does not fly is on the ground: in nobody's way.
    all
}

/// Whether two pieces come nearer than the separation outside of the discs.
fn comes_near(one: [Point; 2], other: [Point; 2], discs: &Discs, separation_m: f64) -> bool {
    let apart_m = |[a, b]: [Point; 2], [c, d]: [Point; 2]| line_to_line_m(a, b, c, d);
    if apart_m(one, other) >= separation_m {
        return false;
    }
    let (ours, theirs) = (outside(one, discs), outside(other, discs));
    ours.iter()
        .any(|a| theirs.iter().any(|b| apart_m(*a, *b) < separation_m))
}

/// What of a piece lies outside of all discs.
fn outside(piece: [Point; 2], discs: &Discs) -> Vec<[Point; 2]> {
    let d = piece[1] - piece[0];
    let mut kept: Vec<(f64, f64)> = vec![(0.0, 1.0)];
    for middle in &discs.middles {
        let v = piece[0] - middle;
        let radius = discs.radius_m;
        let (a, b, c) = (
            d.norm_squared(),
            v.dot(&d),
            v.norm_squared() - radius * radius,
        );
        let root = b * b - a * c;
        let inside = if a <= f64::MIN_POSITIVE {
            if c <= 0.0 { (0.0, 1.0) } else { continue }
        } else if root <= 0.0 {
            continue;
        } else {
            ((-b - root.sqrt()) / a, (-b + root.sqrt()) / a)
        };
        kept = kept
            .into_iter()
            .flat_map(|(from, to)| [(from, to.min(inside.0)), (from.max(inside.1), to)])
            .filter(|(from, to)| from <= to)
            .collect();
    }
    let at = |t: f64| piece[0] + d * t;
    kept.into_iter()
        .map(|(from, to)| [at(from), at(to)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn track(points: &[(f64, f64)]) -> Vec<Point> {
        points.iter().map(|&(x, y)| Point::new(x, y)).collect()
    }

    #[test]
    fn flights_side_by_side_share_a_layer_and_crossing_ones_do_not() {
        let along = |y: f64| track(&[(0.0, y), (1000.0, y), (0.0, y)]);
        let tracks = [along(0.0), along(100.0), along(200.0)];
        assert_eq!(layers(&tracks, 99.0), [0, 0, 0]);
        assert_eq!(layers(&tracks, 101.0), [1, 0, 1]);
        assert_eq!(layers(&tracks, 500.0).iter().max(), Some(&2));
        let across = track(&[(500.0, -900.0), (500.0, 900.0)]);
        assert_eq!(conflicts(&[along(0.0), across], 10.0), [(0, 1)]);
        assert_eq!(layers(&tracks, 0.0), [0, 0, 0]);
        assert_eq!(layers(&tracks, f64::NAN), [0, 0, 0]);
    }

    #[test]
    fn the_launch_is_common_ground_and_a_uav_at_home_is_in_nobodys_way() {
        let north = track(&[(0.0, 0.0), (0.0, 900.0)]);
        let east = track(&[(0.0, 0.0), (900.0, 0.0)]);
        let home = track(&[(0.0, 400.0)]);
        assert_eq!(layers(&[north.clone(), east, home], 60.0), [0, 0, 0]);
        // Beside each other beyond the disc of the launch.
        let near = track(&[(0.0, 0.0), (40.0, 900.0)]);
        assert_eq!(conflicts(&[north, near], 60.0), [(0, 1)]);
    }

    proptest! {
        #[test]
        fn uavs_of_one_layer_stay_apart(
            starts in prop::collection::vec((-300.0..300.0f64, -300.0..300.0f64), 2),
            ways in prop::collection::vec(
                prop::collection::vec((-400.0..400.0f64, -400.0..400.0f64), 1..5), 2..9),
            separation_m in 5.0..120.0f64,
        ) {
            let tracks: Vec<Vec<Point>> = ways.iter().enumerate().map(|(i, way)| {
                let mut way = track(way);
                let (x, y) = starts[i % 2];
                way.insert(0, Point::new(x, y));
                way.push(Point::new(x, y));
                way
            }).collect();
            let layers = layers(&tracks, separation_m);
            let samples: Vec<Vec<Point>> = tracks.iter().map(|t| {
                pieces(t, 4.0).into_iter().map(|(a, b)| a + (b - a) * 0.37).collect()
            }).collect();
            for i in 0..tracks.len() {
                for j in 0..i {
                    let launch = launch(&tracks[i], &tracks[j], separation_m);
                    let counts = |p: &&Point| launch.middles.iter().all(|m| (**p - m).norm() > launch.radius_m);
                    let mut least = f64::INFINITY;
                    for p in samples[i].iter().filter(counts) {
                        for q in samples[j].iter().filter(counts) {
                            least = least.min((p - q).norm());
                        }
                    }
                    if layers[i] == layers[j] {
                        prop_assert!(least >= separation_m - 2.0 * ROUNDING_M, "{i} {j}: {least}");
                    }
                    let apart = launch.middles.is_empty();
                    if apart && conflicts(&tracks[..=i], separation_m).contains(&(j, i)) {
                        // Samples are at most 4 m apart on either flight.
                        prop_assert!(least <= separation_m + 12.0, "{i} {j}: {least}");
                    }
                }
            }
        }
    }
}
