//! Whether any course that is asked for beats the search of courses, on generated sites, or,
//! on those without zones and fences, a lawnmower: all lanes of a course to and fro, cut at equal
//! times.
//!
//! `cargo run --release -p skein-verify --example courses -- 30600..30616 [UAVs] [quick]`

#[path = "generated/planned.rs"]
#[allow(dead_code, reason = "plans are only compared here")]
mod planned;

use skein_flight::coverage::passes::{Directions, Layout, Pass, PassesProblem};
use skein_flight::route::{RouteLimits, Router};
use skein_flight::trajectory::dubins;
use skein_geometry::NoFlyZones;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{PI, sin_cos};
use skein_survey::area::{self, AreaRequest, DEFAULT_STEPS, Figures, Planner, Planners};
use skein_verify::generate::Site;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

/// Courses that are asked for: every 5°.
const COURSES: u32 = 36;

/// Later by more than this counts as beaten.
const BEATEN: f64 = 0.005;

fn figures(request: &AreaRequest) -> Option<Figures> {
    Some(area::plan(request).ok()?.figures)
}

/// Rounds in which the time of a cut is halved in on.
const HALVINGS: usize = 40;

/// The time of the lawnmower on a course, seconds; turns keep from nothing.
fn lawnmower_s(request: &AreaRequest, heading_rad: f64) -> Option<f64> {
    let uav = request.team.first()?;
    let lane_m = uav.swath_m(None, request.altitude_m)?;
    let problem = PassesProblem {
        look_ahead_m: request.look_ahead_m.unwrap_or(lane_m / 2.0),
        directions: Directions::Fixed(heading_rad),
        ..PassesProblem::new(
            request.area.clone(),
            lane_m,
            uav.turn_radius_m,
            Point::origin(),
        )
    };
    let (sin, cos) = sin_cos(heading_rad);
    let along = |p: Point| p.x * cos + p.y * sin;
    let across = |p: &Pass| p.from.y * cos - p.from.x * sin;
    let mut passes = Layout::new(&problem).ok()?.passes;
    passes.sort_by(|a, b| across(a).total_cmp(&across(b)));
    let mut lanes: Vec<Vec<Pass>> = Vec::new();
    for pass in passes {
        let forth = along(pass.from) <= along(pass.to);
        let pass = if forth { pass } else { pass.reversed() };
        match lanes.last_mut() {
            Some(lane) if across(&pass) - across(&lane[0]) < lane_m / 2.0 => lane.push(pass),
            _ => lanes.push(vec![pass]),
        }
    }
    let snake = |odd: usize| -> Vec<Pass> {
        let lane = |(i, lane): (usize, &Vec<Pass>)| {
            let mut lane = lane.clone();
            lane.sort_by(|a, b| along(a.from).total_cmp(&along(b.from)));
            if i % 2 == odd {
                lane = lane.iter().rev().map(|p| p.reversed()).collect();
            }
            lane
        };
        lanes.iter().enumerate().flat_map(lane).collect()
    };
    let turn = |a: Pose, b: Pose| dubins::shortest(a, b, uav.turn_radius_m).length_m();
    // From the launch point in any heading and back in any: with a turn at the pass.
    let router = Router::new(
        Arc::new(NoFlyZones::new(Vec::new())),
        RouteLimits {
            turn_radius_m: uav.turn_radius_m,
            clearance_m: 0.0,
        },
    );
    let from_start_m = |pose: Pose| {
        let way = router.route_to_point(pose, uav.start);
        way.map_or(f64::INFINITY, |way| way.length_m())
    };
    let way = |pass: &Pass| from_start_m(pass.start().reversed());
    let home = |pass: &Pass| from_start_m(pass.end());
    let time_s = |snake: &[Pass]| {
        let pose = |p: Point, pass: &Pass| Pose::new(p, pass.heading_rad());
        let joins: Vec<f64> = snake
            .windows(2)
            .map(|w| turn(pose(w[0].to, &w[0]), pose(w[1].from, &w[1])))
            .collect();
        // How many pieces there are of at most so many metres.
        let pieces = |most_m: f64| {
            let (mut n, mut flown_m) = (1, None::<f64>);
            for (i, pass) in snake.iter().enumerate() {
                let on = flown_m.map(|m| m + joins[i - 1] + pass.length_m());
                flown_m = match on {
                    Some(m) if m + home(pass) <= most_m => Some(m),
                    on => {
                        n += usize::from(on.is_some());
                        Some(way(pass) + pass.length_m())
                    }
                };
                if way(pass) + pass.length_m() + home(pass) > most_m {
                    return usize::MAX;
                }
            }
            n
        };
        let each = snake.iter().map(|p| way(p) + p.length_m() + home(p));
        let (mut low, mut high) = (0.0, each.sum::<f64>() + joins.iter().sum::<f64>());
        for _ in 0..HALVINGS {
            let most_m = f64::midpoint(low, high);
            if pieces(most_m) <= request.team.len() {
                high = most_m;
            } else {
                low = most_m;
            }
        }
        high / uav.speed_mps
    };
    Some(time_s(&snake(0)).min(time_s(&snake(1))))
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let seeds = args.first().and_then(|text| {
        let (a, b) = text.split_once("..")?;
        Some(a.parse::<u64>().ok()?..b.parse().ok()?)
    });
    let uavs: Result<usize, _> = args.get(1).map_or("3", String::as_str).parse();
    let (Some(seeds), Ok(uavs)) = (seeds, uavs) else {
        eprintln!("use: courses FROM..TO [UAVS] [quick]");
        return ExitCode::from(2);
    };
    let quick = args.get(2).is_some_and(|a| a == "quick");
    let (mut open_sites, mut sooner) = (0, 0.0_f64);
    let (mut compared, mut beaten, mut worst, mut slowest_s) = (0, 0, 0.0_f64, 0.0_f64);
    for seed in seeds {
        let mut site = Site::of(seed);
        site.manner.n_uavs = uavs;
        let Ok(request) = planned::request(&site, Planners::Only(Planner::Exact), false) else {
            continue;
        };
        let free = AreaRequest {
            steps: DEFAULT_STEPS,
            quick,
            ..request
        };
        let began = Instant::now();
        let Some(own) = figures(&free) else { continue };
        slowest_s = slowest_s.max(began.elapsed().as_secs_f64());
        let asked = (0..COURSES).filter_map(|i| {
            let heading_rad = Some(f64::from(i) * PI / f64::from(COURSES));
            let asked = AreaRequest {
                heading_rad,
                ..free.clone()
            };
            figures(&asked)
        });
        let as_much = asked.filter(|f| f.covered_share >= own.covered_share);
        let best_s = as_much.map(|f| f.makespan_s).fold(f64::INFINITY, f64::min);
        let later = (own.makespan_s / best_s - 1.0).max(0.0);
        compared += 1;
        beaten += u32::from(later > BEATEN);
        worst = worst.max(later);
        let open = site.zones.is_empty() && site.holes.is_empty() && site.fences.is_empty();
        let heading_rad = |i| f64::from(i) * PI / f64::from(COURSES);
        let mown = if open {
            let mown = (0..COURSES).filter_map(|i| lawnmower_s(&free, heading_rad(i)));
            let mown_s = mown.fold(f64::INFINITY, f64::min);
            sooner = sooner.max((own.makespan_s / mown_s - 1.0).max(0.0));
            open_sites += 1;
            format!(", {:.3} times the lawnmower", own.makespan_s / mown_s)
        } else {
            String::new()
        };
        println!(
            "{seed}: {:.1} s, {:.2} % seen, {:.1} % later than the best course asked for{mown} ({})",
            own.makespan_s,
            100.0 * own.covered_share,
            100.0 * later,
            site.kind
        );
    }
    println!(
        "{open_sites} of them without zones: {:.1} % later than the lawnmower at most",
        100.0 * sooner
    );
    println!(
        "{compared} compared, {beaten} beaten by more than {:.1} %, worst {:.1} %; slowest {slowest_s:.1} s",
        100.0 * BEATEN,
        100.0 * worst
    );
    ExitCode::SUCCESS
}
