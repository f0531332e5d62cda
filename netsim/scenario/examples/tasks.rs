//! Tasks that are asked for in flight, beside the same runs without any:
//! `cargo run -p skein-scenario --example tasks -- helsinki 1,2,3,8,20 0..5 6 deaths`.
//!
//! The arguments are a scenario, numbers of UAVs, seeds, tasks a run, and what goes wrong
//! meanwhile: `none`, `deaths` (a quarter of the UAVs are killed, one every twenty seconds from
//! the 60th on) or `storm` (what the storm of the seed draws). A sixth argument, `base` or
//! `spread`, says where the UAVs begin, a seventh, how many relay positions are asked for
//! besides; `own` for those of the scenario. Prints a line a number of UAVs: the share of
//! tasks that was seen, the time from the request until that, the makespan over that without
//! tasks, the bytes, what was done more than once, and the rules broken; with relay positions a
//! second one: the share of the time in which each was held, and in which the ground station
//! knew of more, or of less, of what was seen than without them.

mod shared;

use skein_geometry::random::SplitMix64;
use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::fault_generator;
use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, failure_free_makespan_ms, run};
use skein_peer::input::NewTask;
use skein_peer::mission::mm;
use skein_peer::wire::tasks::TaskKind;
use skein_scenario::Seeds;
use std::collections::BTreeMap;
use std::process::ExitCode;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let arg = |i: usize, default: &str| args.get(i).map_or(default, String::as_str).to_owned();
    let seeds = match shared::seeds(&arg(2, "0..3")) {
        Ok(seeds) => seeds,
        Err(code) => return code,
    };
    let (n_tasks, wrong) = (arg(3, "6").parse().unwrap_or(6), arg(4, "none"));
    for n in arg(1, "8").split(',').filter_map(|n| n.parse::<u16>().ok()) {
        let launch = args.get(5).and_then(|word| word.parse().ok());
        let prepared = match shared::scenario(&arg(0, "helsinki"), n, launch) {
            Ok(scenario) => Prepared::new(scenario.spec),
            Err(code) => return code,
        };
        compare(&prepared, &seeds, (n_tasks, &arg(6, "0")), &wrong);
    }
    ExitCode::SUCCESS
}

fn compare(prepared: &Prepared, seeds: &Seeds, (n_tasks, relays): (usize, &str), wrong: &str) {
    let (mut held_ms, mut wanted_ms, mut sooner, mut later, mut alike) = (0, 0, 0u32, 0u32, 0u32);
    let free_ms = failure_free_makespan_ms(prepared);
    let (mut asked, mut seen, mut over, mut again, mut completed) = (0, 0, 0, 0, 0);
    let (mut took_ms, mut ratios, mut bytes) = (Vec::new(), Vec::new(), Vec::new());
    let mut broken: BTreeMap<String, u64> = BTreeMap::new();
    for seed in seeds.from..seeds.to {
        let (prepared, faults) = faults(prepared, seed, free_ms, wrong);
        let mut with = faults.clone();
        with.extend(tasks(&prepared, seed, free_ms, n_tasks));
        with.extend(relay_positions(&prepared, seed, free_ms, relays));
        with.sort_by_key(|f| f.at_ms);
        let asked_for = with.clone();
        let plain = run(&prepared, seed, faults, Wanted::default());
        if let Ok(text) = std::env::var("WHY") {
            let (id, at_s) = text.split_once('@').unwrap_or((&text, "500"));
            let mut swarm = skein_netsim::swarm::Swarm::new(&prepared, seed, with.clone(), false);
            swarm.run_until(at_s.parse::<u64>().unwrap_or(500) * 1000);
            if let Some(why) = swarm.why(id.parse().unwrap_or(1)) {
                println!("{why}");
            }
        }
        let tasked = run(&prepared, seed, with, Wanted::default());
        let said = |o: &skein_netsim::swarm::Outcome| {
            let simulated = o.report.simulated.as_ref();
            let kinds = simulated.map(|s| s.bytes_by_kind.values().sum::<u64>());
            kinds.unwrap_or(0)
        };
        completed += u32::from(tasked.report.completed);
        for v in tasked.violations() {
            println!("  seed {seed}: {} at {} ms: {}", v.check, v.time_ms, v.text);
            *broken.entry(v.check.clone().into_owned()).or_default() += 1;
        }
        let end_ms = tasked.report.end_ms;
        let until_ms = tasked.report.makespan_ms.unwrap_or(end_ms);
        held_ms += tasked.relays_held_ms.values().sum::<u64>();
        let lasts_ms = |f: &TimedFault| match &f.fault {
            Fault::AddTask { task } if task.kind == TaskKind::Relay => {
                let lasts_ms = task.within_ms.map_or(u64::MAX, u64::from);
                end_ms.saturating_sub(f.at_ms).min(lasts_ms)
            }
            _ => 0,
        };
        wanted_ms += asked_for.iter().map(lasts_ms).sum::<u64>();
        let both = tasked.ground_lacks.iter().zip(&plain.ground_lacks);
        let until = usize::try_from(until_ms / 1000).unwrap_or(usize::MAX);
        for (a, b) in both.take(until).filter_map(|(a, b)| Some((*a)?).zip(*b)) {
            match a.cmp(&b) {
                std::cmp::Ordering::Less => sooner += 1,
                std::cmp::Ordering::Equal => alike += 1,
                std::cmp::Ordering::Greater => later += 1,
            }
        }
        let is_relay = |name: &str| {
            let mut all = asked_for.iter();
            all.any(|f| matches!(&f.fault, Fault::AddTask { task } if task.kind == TaskKind::Relay && task.name.as_deref() == Some(name)))
        };
        for t in &tasked.report.tasks {
            if is_relay(&t.name) {
                println!("  seed {seed}: {}", t.line());
                continue;
            }
            asked += 1;
            seen += u32::from(t.seen_ms.is_some());
            over += u32::from(t.seen_ms.is_none() && t.nobody_can.is_some());
            again += u32::try_from(t.done_by.len().saturating_sub(1)).unwrap_or(0);
            took_ms.extend(t.seen_ms.map(|ms| ms.saturating_sub(t.asked_ms) as f64));
            if t.done_by.len() > 1 {
                println!(
                    "  seed {seed}: {} done by {:?}, flown by {:?}",
                    t.name, t.done_by, t.flown_by
                );
            }
            if t.seen_ms.is_none() {
                println!("  seed {seed}: {}", t.line());
            }
        }
        if let (Some(a), Some(b)) = (tasked.report.makespan_ms, plain.report.makespan_ms) {
            ratios.push(a as f64 / b as f64);
        }
        bytes.push(said(&tasked) as f64 / said(&plain).max(1) as f64);
    }
    let runs = seeds.to - seeds.from;
    println!(
        "{} UAVs, {wrong}: {completed} of {runs} completed; {seen} of {asked} tasks seen, {over} said to be beyond all, {again} done again; seen after {:.0} s (p50), {:.0} s (p95); makespan x{:.3} (p50), x{:.3} (p95); bytes x{:.3}; broken {broken:?}",
        prepared.spec.uavs.len(),
        part(&mut took_ms, 0.5) / 1000.0,
        part(&mut took_ms, 0.95) / 1000.0,
        part(&mut ratios, 0.5),
        part(&mut ratios, 0.95),
        part(&mut bytes, 0.5),
    );
    if wanted_ms > 0 {
        let all = f64::from(sooner + later + alike).max(1.0);
        println!(
            "  relay positions held {:.1} % of the time that they were asked for; the ground station knew more than without in {:.1} % of the periods, as much in {:.1} %, less in {:.1} %",
            held_ms as f64 / wanted_ms as f64 * 100.0,
            f64::from(sooner) / all * 100.0,
            f64::from(alike) / all * 100.0,
            f64::from(later) / all * 100.0,
        );
    }
}

/// The relay positions of the scenario itself, or so many in the box around the area, each for
/// a tenth to a half of the failure-free makespan, asked for in its first half.
fn relay_positions(prepared: &Prepared, seed: u64, free_ms: u64, many: &str) -> Vec<TimedFault> {
    let spec = &prepared.spec;
    if many == "own" {
        let faults = spec.faults.iter();
        return faults.filter(|f| f.fault.is_spoken()).cloned().collect();
    }
    let mut random = SplitMix64::new(seed ^ 0x7265_6c61);
    let within = skein_netsim::world::flat::Bounds::around(&spec.mission.area_m());
    let mut asked = Vec::new();
    for n in 0..many.parse().unwrap_or(0) {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "some minutes"
        )]
        let mut ms =
            |least: f64, more: f64| (free_ms as f64 * (least + more * random.unit())) as u32;
        let (at_ms, within_ms) = (ms(0.0, 0.5), ms(0.1, 0.4));
        let drawn = (0..100).find_map(|_| {
            let (x, y) = (random.unit() * 1.2 - 0.1, random.unit() * 1.2 - 0.1);
            let size = within.max - within.min;
            let task = NewTask {
                name: Some(format!("relay-{n}")),
                kind: TaskKind::Relay,
                places: vec![(mm(within.min.x + size.x * x), mm(within.min.y + size.y * y))],
                radius_mm: 100_000,
                worth: 100,
                within_ms: Some(within_ms),
                sensor: 0,
            };
            let fits = task
                .asked(0, 1)
                .is_ok_and(|t| spec.mission.can_do(&t).is_ok());
            fits.then_some(task)
        });
        asked.extend(drawn.map(|task| TimedFault {
            at_ms: u64::from(at_ms),
            fault: Fault::AddTask { task },
        }));
    }
    asked
}

/// The value that a share of all does not exceed; 0 of none.
fn part(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values
        .get((last as f64 * share).round() as usize)
        .copied()
        .unwrap_or(0.0)
}

fn faults(
    prepared: &Prepared,
    seed: u64,
    free_ms: u64,
    wrong: &str,
) -> (Prepared, Vec<TimedFault>) {
    match wrong {
        "storm" => {
            let storm = fault_generator::draw(&prepared.spec, seed, free_ms);
            (prepared.with_uavs(storm.uavs), storm.faults)
        }
        "deaths" => {
            let ids = prepared.spec.uavs.iter().map(|u| u.id);
            let some = prepared.spec.uavs.len() / 4;
            let killed = ids.skip(1).step_by(3).take(some).zip(0u64..);
            let kill = |(peer, nth)| TimedFault {
                at_ms: 60_000 + 20_000 * nth,
                fault: Fault::Kill { peer },
            };
            (prepared.clone(), killed.map(kill).collect())
        }
        _ => (prepared.clone(), Vec::new()),
    }
}

/// Places, and one line in four, in the box around the area and a little beyond, between a tenth
/// and six tenths of the failure-free makespan.
fn tasks(prepared: &Prepared, seed: u64, free_ms: u64, n: usize) -> Vec<TimedFault> {
    let mission = &prepared.spec.mission;
    let area = mission.area_m();
    let mut random = SplitMix64::new(seed ^ 0x7461_736b);
    let low = |of: fn(&skein_geometry::frame::Point) -> f64| {
        area.iter().map(of).fold(f64::INFINITY, f64::min)
    };
    let high = |of: fn(&skein_geometry::frame::Point) -> f64| {
        area.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
    };
    let (west, east) = (low(|p| p.x), high(|p| p.x));
    let (south, north) = (low(|p| p.y), high(|p| p.y));
    let mut asked = Vec::new();
    while asked.len() < n {
        let is_line = random.unit() < 0.25;
        let mut place = || {
            let (x, y) = (random.unit() * 1.2 - 0.1, random.unit() * 1.2 - 0.1);
            (
                mm(west + (east - west) * x),
                mm(south + (north - south) * y),
            )
        };
        let places = (0..if is_line { 2 } else { 1 }).map(|_| place()).collect();
        let task = NewTask {
            name: Some(format!("task-{}", asked.len())),
            kind: if is_line {
                TaskKind::Line
            } else {
                TaskKind::Pinpoint
            },
            places,
            radius_mm: if is_line { 2_000 } else { 10_000 },
            worth: 100,
            within_ms: None,
            sensor: 0,
        };
        let fits = task.asked(0, 1).is_ok_and(|t| mission.can_do(&t).is_ok());
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "some minutes"
        )]
        let at_ms = (free_ms as f64 * (0.1 + 0.5 * random.unit())) as u64;
        if fits {
            asked.push(TimedFault {
                at_ms,
                fault: Fault::AddTask { task },
            });
        }
    }
    asked
}
