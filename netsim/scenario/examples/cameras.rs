//! What cameras see at the first pass, and how far their pictures are from where the plan has
//! them, held in several ways over the same gusts and the same faults:
//! `cargo run --release -p skein-scenario --example cameras -- 1,3,8 1..20 storm`.
//!
//! The trial `gimbal` is flown with each mount, by lanes and by exact passes; lanes with a fixed
//! camera, which a scenario refuses, for comparison. The third argument is `storm` or `calm`.
//! Exit code 1 if a rule was broken in any of the others.

#[allow(dead_code, reason = "each example begins as it needs")]
mod shared;

use skein_flight::mount::Mount;
use skein_netsim::FootprintErrors;
use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Watch, failure_free_makespan_ms, faults_of, watched};
use skein_netsim::spec::Spec;
use skein_netsim::swarm::Swarm;
use skein_scenario::{AreaPlanner, Overrides, open};
use std::process::ExitCode;

const TRIAL: &str = include_str!("../../../configs/trials/gimbal.json5");
const HELD: &str = "{ gimbal: { roll_deg: 55, pitch_deg: 35, rate_dps: 120 } }";

/// What exact passes are flown with instead.
const WIDER: [(&str, &str); 3] = [
    ("min_coverable: 0.95", "min_coverable: 0.85"),
    ("spacing_m: 84", "spacing_m: 72"),
    (
        "fov_across_deg: 99.2, fov_along_deg: 88.4",
        "fov_across_deg: 104, fov_along_deg: 98",
    ),
];

/// A row of the table: how the camera is held, the planner, whether it is fixed in spite of it.
const ROWS: [(&str, AreaPlanner, &str); 6] = [
    ("level", AreaPlanner::Lanes, "\"level\""),
    ("gimbal", AreaPlanner::Lanes, HELD),
    ("fixed (refused)", AreaPlanner::Lanes, "\"level\""),
    ("level", AreaPlanner::Exact, "\"level\""),
    ("gimbal", AreaPlanner::Exact, HELD),
    ("fixed", AreaPlanner::Exact, "\"fixed\""),
];

fn main() -> ExitCode {
    told().unwrap_or_else(|code| code)
}

fn told() -> Result<ExitCode, ExitCode> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let arg = |i: usize, default: &str| args.get(i).map_or(default, String::as_str).to_owned();
    let numbers = arg(0, "3");
    let seeds = shared::seeds(&arg(1, "1..4"))?;
    let storms = arg(2, "calm") == "storm";
    let mut passed = true;
    println!(
        "| UAVs | planner | camera | runs, passed | done, s | cells seen | at first | off, mean | p99 | max |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for uavs in numbers.split(',').filter_map(|n| n.parse().ok()) {
        for (camera, planner, mount) in ROWS {
            let refused = camera.contains("refused");
            let mut spec = spec(uavs, planner, mount)?;
            if refused {
                spec.uavs
                    .iter_mut()
                    .for_each(|u| u.airframe.mount = Mount::Fixed);
            }
            let prepared = Prepared::new(spec);
            let free_ms = storms.then(|| failure_free_makespan_ms(&prepared));
            let mut row = Row::default();
            for seed in seeds.from..seeds.to {
                row.fly(&prepared, seed, free_ms, !refused);
            }
            passed &= refused || row.passed == row.runs;
            println!("| {uavs} | {} | {camera} | {row} |", planner.name());
        }
    }
    Ok(if passed {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// The trial with its cameras held otherwise.
fn spec(uavs: u16, planner: AreaPlanner, mount: &str) -> Result<Spec, ExitCode> {
    let refuse = |why: &dyn core::fmt::Display| {
        eprintln!("{why}");
        ExitCode::from(2)
    };
    let text = TRIAL.replace(HELD, mount);
    let text = match planner {
        AreaPlanner::Lanes => text,
        // Exact passes see what is clear of the zones, and a fixed camera is sure of less: lanes
        // are narrower and views wider, for all that fly them.
        AreaPlanner::Exact => WIDER
            .iter()
            .fold(text, |text, (from, to)| text.replace(from, to)),
    };
    let path = std::env::temp_dir().join(format!("skein-cameras-{}.json5", std::process::id()));
    std::fs::write(&path, text).map_err(|e| refuse(&e))?;
    let over = Overrides {
        peers: Some(uavs),
        planner: Some(planner),
        ..Overrides::default()
    };
    let scenario = open(path.to_str(), &over).map_err(|e| refuse(&e));
    // It is of no use any more, read or not.
    let _ = std::fs::remove_file(&path);
    Ok(scenario?.spec)
}

/// What all seeds of a row came to.
#[derive(Default)]
struct Row {
    runs: u32,
    passed: u32,
    done_s: f64,
    seen: u32,
    missed: u32,
    looks: u64,
    sum_m: f64,
    p99_m: f64,
    max_m: f64,
}

impl Row {
    fn fly(&mut self, prepared: &Prepared, seed: u64, free_ms: Option<u64>, told: bool) {
        let (prepared, faults) = match free_ms {
            Some(_) => faults_of(prepared, seed, free_ms),
            None => (prepared.clone(), Vec::new()),
        };
        let mut errors = FootprintErrors::default();
        let mut look = |swarm: &Swarm| errors = swarm.checker().footprint_errors();
        let mut watch = Watch {
            every_ms: 1_000,
            look: &mut look,
        };
        let wanted = skein_netsim::runs::Wanted::default();
        let outcome = watched(&prepared, seed, faults, wanted, Some(&mut watch));
        for v in outcome.violations().iter().filter(|_| told) {
            eprintln!(
                "seed {seed} {} at {} ms, {:?}: {}",
                v.check, v.time_ms, v.peer, v.text
            );
        }
        if told && !outcome.report.passed {
            eprintln!("seed {seed}: {:?}", outcome.report.reasons);
        }
        self.runs += 1;
        self.passed += u32::from(outcome.report.passed);
        self.done_s += outcome
            .report
            .makespan_ms
            .map_or(f64::NAN, |ms| ms as f64 / 1e3);
        self.seen += errors.seen;
        self.missed += errors.missed;
        self.looks += errors.looks;
        self.sum_m += errors.mean_m * errors.looks as f64;
        self.p99_m += errors.p99_m * errors.looks as f64;
        self.max_m = self.max_m.max(errors.max_m);
    }
}

impl core::fmt::Display for Row {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let looks = self.looks.max(1) as f64;
        write!(
            f,
            "{}, {} | {:.0} | {} | {:.2} % | {:.1} m | {:.1} m | {:.1} m",
            self.runs,
            self.passed,
            self.done_s / f64::from(self.runs.max(1)),
            self.seen,
            100.0 * (1.0 - f64::from(self.missed) / f64::from(self.seen.max(1))),
            self.sum_m / looks,
            self.p99_m / looks,
            self.max_m
        )
    }
}
