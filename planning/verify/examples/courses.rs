//! Whether any course that is asked for beats the search of courses, on generated sites.
//!
//! `cargo run --release -p skein-verify --example courses -- 30600..30616 [UAVs]`

#[path = "generated/planned.rs"]
#[allow(dead_code, reason = "plans are only compared here")]
mod planned;

use skein_survey::area::{self, AreaRequest, DEFAULT_STEPS, Figures, Planner, Planners};
use skein_verify::generate::Site;
use std::process::ExitCode;
use std::time::Instant;

/// Courses that are asked for: every 5°.
const COURSES: u32 = 36;

/// Later by more than this counts as beaten.
const BEATEN: f64 = 0.005;

fn figures(request: &AreaRequest) -> Option<Figures> {
    Some(area::plan(request).ok()?.figures)
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let seeds = args.first().and_then(|text| {
        let (a, b) = text.split_once("..")?;
        Some(a.parse::<u64>().ok()?..b.parse().ok()?)
    });
    let uavs: Result<usize, _> = args.get(1).map_or("3", String::as_str).parse();
    let (Some(seeds), Ok(uavs)) = (seeds, uavs) else {
        eprintln!("use: courses FROM..TO [UAVS]");
        return ExitCode::from(2);
    };
    let (mut compared, mut beaten, mut worst, mut slowest_s) = (0, 0, 0.0_f64, 0.0_f64);
    for seed in seeds {
        let mut site = Site::of(seed);
        site.manner.n_uavs = uavs;
        let Ok(request) = planned::request(&site, Planners::Only(Planner::Exact)) else {
            continue;
        };
        let free = AreaRequest {
            steps: DEFAULT_STEPS,
            ..request
        };
        let began = Instant::now();
        let Some(own) = figures(&free) else { continue };
        slowest_s = slowest_s.max(began.elapsed().as_secs_f64());
        let asked = (0..COURSES).filter_map(|i| {
            let heading_rad = Some((f64::from(i) * 180.0 / f64::from(COURSES)).to_radians());
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
        println!(
            "{seed}: {:.1} s, {:.2} % seen, {:.1} % later than the best course asked for ({})",
            own.makespan_s,
            100.0 * own.covered_share,
            100.0 * later,
            site.kind
        );
    }
    println!(
        "{compared} compared, {beaten} beaten by more than {:.1} %, worst {:.1} %; slowest {slowest_s:.1} s",
        100.0 * BEATEN,
        100.0 * worst
    );
    ExitCode::SUCCESS
}
