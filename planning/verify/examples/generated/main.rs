//! Plans generated sites and recounts each plan.
//!
//! `cargo run --release -p skein-verify --example generated -- 0..10000 [exact|approximate]
//! [quick]` prints a line for each site whose plan breaks a rule or whose planning panics, and a
//! summary; the exit code is 1 if there is one. `-- write 17 DIR` writes the files of a site,
//! and prints how `skein plan cover` is asked for it.

#![allow(clippy::print_stdout, reason = "an example prints")]

mod planned;

use planned::{Outcome, outcome};
use skein_survey::area::{Planner, Planners};
use skein_verify::generate::{PLANE, Site};
use std::collections::BTreeMap;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook};
use std::process::ExitCode;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Sites that are told one by one for each rule.
const MOST_TOLD: usize = 10;

#[derive(Default)]
struct Tally {
    planned: usize,
    no_trajectory: usize,
    refused: BTreeMap<String, (usize, u64)>,
    broken: BTreeMap<&'static str, (usize, u64)>,
    wrong: usize,
    panics: Vec<u64>,
    least_share: Option<(f64, u64)>,
    slowest: Option<(Duration, u64)>,
}

impl Tally {
    fn add(&mut self, seed: u64, site: &Site, outcome: Outcome) {
        match outcome {
            Outcome::Refused(why) => self.refused.entry(why).or_insert((0, seed)).0 += 1,
            Outcome::NoTrajectory => {
                self.planned += 1;
                self.no_trajectory += 1;
            }
            Outcome::Recounted(report) => {
                self.planned += 1;
                if let Some(share) = report.covered_share
                    && self.least_share.is_none_or(|(least, _)| share < least)
                {
                    self.least_share = Some((share, seed));
                }
                if report.holds() {
                    return;
                }
                self.wrong += 1;
                let mut rules: Vec<&str> =
                    report.violations.iter().map(|v| v.rule.name()).collect();
                rules.sort_unstable();
                rules.dedup();
                let mut tell = false;
                for rule in &rules {
                    let (n, _) = self.broken.entry(rule).or_insert((0, seed));
                    *n += 1;
                    tell |= *n <= MOST_TOLD;
                }
                if tell {
                    println!("seed {seed} ({})", site.kind);
                    for v in report.violations.iter().take(3) {
                        let who = v.flight.as_deref().unwrap_or("all");
                        println!("  {}: {who}: {}", v.rule.name(), v.text);
                    }
                }
            }
        }
    }

    fn print(&self, seeds: &Range<u64>, took: Duration) {
        let refused: usize = self.refused.values().map(|(n, _)| n).sum();
        for (why, (n, seed)) in &self.refused {
            println!("refused {n:>6}  {why} (first {seed})");
        }
        for (rule, (n, seed)) in &self.broken {
            println!("broken  {n:>6}  {rule} (first {seed})");
        }
        let share = self.least_share.map_or("none".to_owned(), |(share, seed)| {
            format!("{:.2} % (seed {seed})", 100.0 * share)
        });
        let slowest = self.slowest.map_or("none".to_owned(), |(time, seed)| {
            format!("{:.1} s (seed {seed})", time.as_secs_f64())
        });
        println!(
            "seeds {}..{}: {} planned ({} without a trajectory), {refused} refused, {} with a violation, {} panics; least share {share}; {:.1} s, slowest {slowest}",
            seeds.start,
            seeds.end,
            self.planned,
            self.no_trajectory,
            self.wrong,
            self.panics.len(),
            took.as_secs_f64()
        );
    }
}

fn run(seeds: &Range<u64>, planners: Planners, quick: bool) -> bool {
    let said: Arc<Mutex<String>> = Arc::default();
    let heard = said.clone();
    set_hook(Box::new(move |info| {
        if let Ok(mut said) = heard.lock() {
            *said = info.to_string();
        }
    }));
    let began = Instant::now();
    let mut tally = Tally::default();
    for seed in seeds.clone() {
        let site = Site::of(seed);
        let at = Instant::now();
        match catch_unwind(AssertUnwindSafe(|| outcome(&site, planners, quick))) {
            Ok(outcome) => tally.add(seed, &site, outcome),
            Err(_) => {
                tally.panics.push(seed);
                let said = said.lock().map(|s| s.clone()).unwrap_or_default();
                println!("seed {seed} ({}) panics: {said}", site.kind);
            }
        }
        let took = at.elapsed();
        if tally.slowest.is_none_or(|(slowest, _)| took > slowest) {
            tally.slowest = Some((took, seed));
        }
    }
    tally.print(seeds, began.elapsed());
    tally.wrong == 0 && tally.panics.is_empty()
}

fn write(seed: u64, dir: &str) -> std::io::Result<()> {
    let site = Site::of(seed);
    std::fs::create_dir_all(dir)?;
    for (name, text) in [("geojson", site.geojson()), ("plan", site.plan())] {
        std::fs::write(format!("{dir}/{seed}.{name}"), format!("{text}\n"))?;
    }
    let m = &site.manner;
    let at = PLANE.place(site.launch);
    let ahead = m
        .look_ahead_m
        .map_or(String::new(), |a| format!(" --look-ahead-m {a}"));
    println!("# {}", site.kind);
    println!(
        "skein plan cover {dir}/{seed}.plan --k {} --launch {},{} --swath-m {} --turn-radius-m {} --clearance-m {} --speed-mps {}{ahead}",
        m.n_uavs, at.lat_deg, at.lon_deg, m.swath_m, m.turn_radius_m, m.clearance_m, m.speed_mps
    );
    Ok(())
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    if let ["write", seed, dir] = args.as_slice()
        && let Ok(seed) = seed.parse()
    {
        return match write(seed, dir) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{dir}: {error}");
                ExitCode::from(2)
            }
        };
    }
    let range = |text: &str| {
        let (from, to) = text.split_once("..")?;
        Some(from.parse().ok()?..to.parse().ok()?)
    };
    let asked = args.first().and_then(|text| range(text));
    let (quick, kinds) = match args.split_last() {
        Some((&"quick", before)) => (true, before),
        _ => (false, args.as_slice()),
    };
    let planners = match kinds.get(1) {
        None => Some(Planners::Both),
        Some(&"exact") => Some(Planners::Only(Planner::Exact)),
        Some(&"approximate") => Some(Planners::Only(Planner::Approximate)),
        Some(_) => None,
    };
    let (Some(seeds), Some(planners)) = (asked, planners) else {
        eprintln!(
            "usage: generated FROM..TO [exact|approximate] [quick], or generated write SEED DIR"
        );
        return ExitCode::from(2);
    };
    if run(&seeds, planners, quick) {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
