//! Passes for what lanes leave unseen: ground beside walls that lanes cannot come near to
//! with room for a turn.
//!
//! What is unseen is looked for by samples, group by group; passes along the edges nearby,
//! along lanes and across them are tried, and the one that sees most for what it takes is
//! flown too, until none sees much more.

use super::courses::apart_rad;
use super::flights::span;
use super::sight::{Footprint, Points};
use crate::flown::{Fineness, straight, turnable_by};
use skein_flight::coverage::passes::{Pass, PassesProblem};
use skein_flight::route::Router;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{FRAC_PI_2, atan2, sin_cos};
use skein_geometry::polygon::point_to_line_m;

/// Samples across a lane.
const SAMPLES_A_LANE: f64 = 8.0;

/// Samples of an area at most.
const MOST_SAMPLES: f64 = 30_000.0;

/// A pass must see at least this share of what it could see of a square lane.
const LEAST_SHARE: f64 = 0.04;

/// Edges that give courses to a group.
const MOST_EDGES: usize = 6;

/// Lines across a group at most for one course.
const MOST_LINES: f64 = 12.0;

/// Groups of unseen ground are at most as wide as this, in lanes.
const GROUP_LANES: f64 = 4.0;

/// Courses nearer to each other than this are one, radians.
const SAME_RAD: f64 = 0.02;

/// Where a line across a group is tried beside its place, in eighths of a lane; the first
/// few where plans are only compared.
const SHIFTS: [f64; 9] = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0, -4.0];

/// Of the places of a line, how many are tried where plans are only compared.
const FEW_SHIFTS: usize = 3;

/// Passes beside `passes` that see what these do not, as far as turns find room, and how many
/// were tried; `is_open` says where somebody can be at all.
pub(super) fn fill(
    problem: &PassesProblem,
    router: &Router,
    lattice: &Lattice,
    passes: &[Pass],
    is_open: impl Fn(Point) -> bool,
    thorough: bool,
) -> (Vec<Pass>, usize) {
    let (shifts, fineness) = if thorough {
        (SHIFTS.len(), Fineness::FULL)
    } else {
        (FEW_SHIFTS, Fineness::COARSE)
    };
    let (mut added, mut tried) = (Vec::new(), 0);
    for mut group in lattice.unseen(problem, passes) {
        let pool = candidates(
            problem,
            router,
            &group,
            (&is_open, shifts, fineness),
            &mut tried,
        );
        let mut pool: Vec<(Pass, f64)> = pool
            .into_iter()
            .map(|p| (p, p.length_m() + problem.turn_m()))
            .collect();
        loop {
            let best = pool.iter().map(|(p, cost_m)| {
                let n = group
                    .points
                    .iter()
                    .filter(|q| sees(problem, p, **q))
                    .count();
                (n, *p, n as f64 / cost_m)
            });
            let enough = |n: usize| n as f64 >= group.least;
            let best = best.filter(|(n, ..)| enough(*n));
            let Some((_, pass, _)) = best.max_by(|a, b| a.2.total_cmp(&b.2)) else {
                break;
            };
            group.points.retain(|q| !sees(problem, &pass, *q));
            pool.retain(|(p, _)| *p != pass);
            added.push(pass);
        }
    }
    (added, tried)
}

fn sees(problem: &PassesProblem, pass: &Pass, p: Point) -> bool {
    pass.sees(p, problem.lane_spacing_m / 2.0, problem.look_ahead_m)
}

/// Unseen ground that hangs together.
struct Group {
    points: Vec<Point>,
    /// As few points are not worth a pass.
    least: f64,
}

/// Samples of what is to be seen, in rows and columns.
pub(super) struct Lattice {
    low: Point,
    pitch_m: f64,
    columns: usize,
    rows: usize,
    /// The samples that are to be seen, column by column, and the place of each.
    wanted: Points,
    places: Vec<usize>,
}

impl Lattice {
    /// Samples of an area without its holes and zones as they are drawn.
    pub(super) fn new(problem: &PassesProblem) -> Self {
        let (low, high) = problem.area.bounds();
        let size = high - low;
        let pitch_m =
            (problem.lane_spacing_m / SAMPLES_A_LANE).max((size.x * size.y / MOST_SAMPLES).sqrt());
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a cast of a float saturates, and samples are bounded"
        )]
        let count = |m: f64| ((m / pitch_m).ceil().max(1.0) as usize).min(MOST_SAMPLES as usize);
        let mut lattice = Self {
            low,
            pitch_m,
            columns: count(size.x),
            rows: count(size.y),
            wanted: Points::new(Vec::new()),
            places: Vec::new(),
        };
        let is_wanted = |p: Point| {
            problem.area.contains(p)
                && problem.zones.distance_m(p) > 0.0
                && !problem.holes.iter().any(|h| h.contains(p))
        };
        let all = 0..lattice.columns * lattice.rows;
        lattice.places = all.filter(|k| is_wanted(lattice.at(*k))).collect();
        let points = lattice.places.iter().map(|k| lattice.at(*k));
        lattice.wanted = Points::new(points.collect());
        lattice
    }

    fn at(&self, place: usize) -> Point {
        let (i, j) = (place / self.rows, place % self.rows);
        self.low + Vector::new(i as f64 + 0.5, j as f64 + 0.5) * self.pitch_m
    }

    /// The samples that no pass sees, in groups of neighbours.
    fn unseen(&self, problem: &PassesProblem, passes: &[Pass]) -> Vec<Group> {
        let footprint = Footprint {
            across_m: problem.lane_spacing_m / 2.0,
            along_m: problem.look_ahead_m,
        };
        let seen = self.wanted.seen(passes.iter(), footprint);
        let mut open = vec![false; self.columns * self.rows];
        for (place, seen) in self.places.iter().zip(seen) {
            open[*place] = seen == 0;
        }
        self.groups(problem.lane_spacing_m, open)
    }

    fn groups(&self, lane_m: f64, mut open: Vec<bool>) -> Vec<Group> {
        let per_lane = lane_m / self.pitch_m;
        let least = (LEAST_SHARE * per_lane * per_lane).max(2.0);
        let widest = GROUP_LANES * per_lane;
        let (columns, rows) = (self.columns, self.rows);
        let mut groups = Vec::new();
        for first in 0..open.len() {
            if !open[first] {
                continue;
            }
            open[first] = false;
            let (mut queue, mut points) = (vec![first], Vec::new());
            while let Some(k) = queue.pop() {
                let (i, j) = (k / rows, k % rows);
                points.push(self.at(k));
                let near = [
                    (i.wrapping_sub(1), j),
                    (i + 1, j),
                    (i, j.wrapping_sub(1)),
                    (i, j + 1),
                ];
                for (x, y) in near {
                    let far =
                        x.abs_diff(first / rows).max(y.abs_diff(first % rows)) as f64 > widest;
                    if x < columns && y < rows && !far && open[x * rows + y] {
                        open[x * rows + y] = false;
                        queue.push(x * rows + y);
                    }
                }
            }
            if points.len() as f64 >= least {
                groups.push(Group { points, least });
            }
        }
        groups
    }
}

/// Passes over a group that can be flown to and from.
fn candidates(
    problem: &PassesProblem,
    router: &Router,
    group: &Group,
    (is_open, shifts, fineness): (&impl Fn(Point) -> bool, usize, Fineness),
    tried: &mut usize,
) -> Vec<Pass> {
    let lane_m = problem.lane_spacing_m;
    let mut found = Vec::new();
    for course_rad in courses(problem, group) {
        let (s, c) = sin_cos(course_rad);
        let (along, across) = (Vector::new(c, s), Vector::new(-s, c));
        let ((u0, u1), (v0, v1)) = (span(&group.points, along), span(&group.points, across));
        let lines = ((v1 - v0) / lane_m).ceil().clamp(1.0, MOST_LINES);
        let mut i = 0.5;
        while i < lines {
            let v = v0 + (v1 - v0) * i / lines;
            for shift in SHIFTS.into_iter().take(shifts) {
                let middle = across * (v + shift * lane_m / SAMPLES_A_LANE);
                let ahead_m = problem.look_ahead_m.min((u1 - u0) / 2.0);
                let at = |u: f64| Point::from(along * u + middle);
                let pass = Pass {
                    from: at(u0 + ahead_m),
                    to: at((u1 - ahead_m).max(u0 + ahead_m + 1.0)),
                };
                // What is left of it sees no more.
                let n = group.points.iter().filter(|q| sees(problem, &pass, **q));
                if (n.count() as f64) < group.least {
                    continue;
                }
                *tried += 1;
                let open = clear_part(router, pass).filter(|p| is_open(p.from));
                found.extend(open.and_then(|p| turnable_by(router, p, fineness)));
            }
            i += 1.0;
        }
    }
    found
}

/// The longest part of a pass that keeps clear, by pieces of an eighth of a lane or more.
fn clear_part(router: &Router, pass: Pass) -> Option<Pass> {
    const PIECES: u8 = 24;
    let at = |k: u8| pass.from + (pass.to - pass.from) * (f64::from(k) / f64::from(PIECES));
    let keep_m = router.limits().clearance_m;
    let is_free = |from: u8, to: u8| {
        let piece = straight(at(from), at(to));
        router.zones().is_clear(&piece, keep_m)
    };
    if is_free(0, PIECES) {
        return Some(pass);
    }
    let is_clear = |k: u8| is_free(k, k + 1);
    let (mut best, mut begin) = ((0, 0), None);
    for k in 0..=PIECES {
        if k < PIECES && is_clear(k) {
            begin = begin.or(Some(k));
        } else if let Some(b) = begin.take()
            && k - b > best.1 - best.0
        {
            best = (b, k);
        }
    }
    (best.1 > best.0).then(|| Pass {
        from: at(best.0),
        to: at(best.1),
    })
}

/// Courses for a group: along and across it, and along the edges nearby.
fn courses(problem: &PassesProblem, group: &Group) -> Vec<f64> {
    let n = group.points.len() as f64;
    let sum = |f: &dyn Fn(&Point) -> f64| group.points.iter().map(f).sum::<f64>() / n;
    let middle = Point::new(sum(&|p| p.x), sum(&|p| p.y));
    let (xx, yy) = (
        sum(&|p| (p.x - middle.x).powi(2)),
        sum(&|p| (p.y - middle.y).powi(2)),
    );
    let xy = sum(&|p| (p.x - middle.x) * (p.y - middle.y));
    let main_rad = 0.5 * atan2(2.0 * xy, xx - yy);
    let mut courses = vec![main_rad, main_rad + FRAC_PI_2];
    let near = |(a, b): &(Point, Point)| {
        let distances = group.points.iter().map(|p| point_to_line_m(*p, *a, *b));
        distances.fold(f64::INFINITY, f64::min) <= problem.lane_spacing_m
    };
    let polygons = problem.zones.zones().iter().chain([&problem.area]);
    let mut edges: Vec<(Point, Point)> = polygons.flat_map(|z| z.edges()).filter(near).collect();
    let length_m = |e: &(Point, Point)| (e.1 - e.0).norm();
    edges.sort_by(|a, b| length_m(b).total_cmp(&length_m(a)));
    for (a, b) in edges {
        let d = b - a;
        let rad = atan2(d.y, d.x);
        let same = |c: &f64| apart_rad(rad, *c) < SAME_RAD;
        if !courses.iter().any(same) && courses.len() < 2 + MOST_EDGES {
            courses.push(rad);
        }
    }
    courses
}
