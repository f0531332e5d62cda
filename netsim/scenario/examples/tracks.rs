//! Targets that are followed in a mission, beside the same runs without the operator:
//! `cargo run -p skein-scenario --example tracks -- track 1,3,8 0..20 deaths`.
//!
//! The arguments are a scenario, numbers of UAVs, seeds, what goes wrong meanwhile, and how many
//! UAVs are asked to stay with each target (1). What goes wrong: `none`,
//! `deaths` (whoever follows is killed, twice at most, 150 and 350 s after the beginning) or
//! `storm` (what the storm of the seed draws). Prints a line a run, and one a number of UAVs:
//! the share of time in sight, how far off its stand-off and its place, the time from a loss
//! until another had the target, the makespan over that without the task, the bytes, and the
//! rules broken.

mod shared;

use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::fault_generator;
use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, failure_free_makespan_ms, run};
use skein_netsim::swarm::{Outcome, Swarm};
use skein_peer::output::Status;
use skein_scenario::Seeds;
use std::collections::BTreeMap;
use std::process::ExitCode;

/// Whoever follows at these times is killed, milliseconds.
const DEATHS_MS: [u64; 2] = [150_000, 350_000];

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let arg = |i: usize, default: &str| args.get(i).map_or(default, String::as_str).to_owned();
    let seeds = match shared::seeds(&arg(2, "0..3")) {
        Ok(seeds) => seeds,
        Err(code) => return code,
    };
    for n in arg(1, "3").split(',').filter_map(|n| n.parse::<u16>().ok()) {
        match shared::scenario(&arg(0, "track"), n, None) {
            Ok(mut scenario) => {
                let beside = arg(4, "1").parse().unwrap_or(1);
                watched_by(&mut scenario.spec.faults, beside);
                compare(n, &Prepared::new(scenario.spec), &seeds, &arg(3, "none"));
            }
            Err(code) => return code,
        }
    }
    ExitCode::SUCCESS
}

/// Asks for so many UAVs for each target: tasks at one place are of one target.
fn watched_by(faults: &mut Vec<TimedFault>, watchers: u32) {
    let mut more = Vec::new();
    for fault in faults.iter() {
        let Fault::AddTask { task } = &fault.fault else {
            continue;
        };
        for nth in 2..=watchers {
            let mut task = task.clone();
            task.name = task.name.map(|name| format!("{name}.{nth}"));
            more.push(TimedFault {
                at_ms: fault.at_ms,
                fault: Fault::AddTask { task },
            });
        }
    }
    faults.extend(more);
    faults.sort_by_key(|f| f.at_ms);
}

/// Kills of whoever follows at those times, found by flying until then.
fn deaths(prepared: &Prepared, seed: u64, mut faults: Vec<TimedFault>) -> Vec<TimedFault> {
    for at_ms in DEATHS_MS {
        let mut swarm = Swarm::new(prepared, seed, faults.clone(), false);
        swarm.run_until(at_ms);
        let follows = |id: &u16| swarm.beliefs(*id).is_some_and(|b| b.follows.is_some());
        let found = prepared.spec.uavs.iter().map(|u| u.id).find(follows);
        if let Some(peer) = found {
            let fault = Fault::Kill { peer };
            faults.push(TimedFault { at_ms, fault });
            faults.sort_by_key(|f| f.at_ms);
        }
    }
    faults
}

/// Where the time goes after a death, seconds from it: until a peer that lives suspects it,
/// until one believes it down, until another has the task, until another is where the target
/// was lost, until another has it in sight; and the least that was possible.
#[derive(Clone, Copy, Debug, Default)]
struct Parts {
    suspected: Option<f64>,
    down: Option<f64>,
    given: Option<f64>,
    there: Option<f64>,
    seen: Option<f64>,
    /// How far off the nearest of the others was, metres.
    away_m: f64,
    /// What it takes the nearest to have it in its picture, after the least silence that is
    /// taken for a death.
    bound: f64,
}

/// Who is so near to where the target was lost is there, metres.
const THERE_M: f64 = 60.0;

/// The death of whoever follows is suspected after this silence at the earliest, seconds: k1
/// periods.
const SILENCE_S: f64 = 4.0;

/// Follows what comes after each death for ten minutes.
fn parts(prepared: &Prepared, seed: u64, faults: &[TimedFault]) -> Vec<Parts> {
    let mut told = Vec::new();
    for fault in faults.iter().filter(|f| DEATHS_MS.contains(&f.at_ms)) {
        let Fault::Kill { peer } = fault.fault else {
            continue;
        };
        let mut swarm = Swarm::new(prepared, seed, faults.to_vec(), false);
        swarm.run_until(fault.at_ms - 1);
        let beliefs = swarm.beliefs(peer);
        let Some(says) = beliefs.and_then(|b| b.follows).filter(|f| f.sees) else {
            continue;
        };
        let said = skein_peer::mission::point_m(says.at_mm);
        let lost = swarm
            .vehicles()
            .min_by(|a, b| (a - said).norm().total_cmp(&(b - said).norm()))
            .unwrap_or(said);
        let mut p = Parts {
            away_m: f64::INFINITY,
            bound: f64::INFINITY,
            ..Parts::default()
        };
        let others = || prepared.spec.uavs.iter().filter(|u| u.id != peer);
        for u in others() {
            let Some(pose) = swarm.pose(u.id) else {
                continue;
            };
            let away_m = (pose.position() - lost).norm();
            let flown_m = (away_m - u.airframe.footprint_across_m).max(0.0);
            p.away_m = p.away_m.min(away_m);
            p.bound = p.bound.min(SILENCE_S + flown_m / u.airframe.cruise_mps);
        }
        for step in 1..1200_u64 {
            swarm.run_until(fault.at_ms + step * 500);
            let now = Some(step as f64 / 2.0);
            for u in others() {
                let Some(b) = swarm.beliefs(u.id) else {
                    continue;
                };
                let of = b.peers.get(&skein_peer::PeerId(peer)).map(|(_, s)| *s);
                if of != Some(Status::Alive) {
                    p.suspected = p.suspected.or(now);
                }
                if of == Some(Status::Down) {
                    p.down = p.down.or(now);
                }
                // Who stays beside holds a task of its own.
                let beside = b.follows.is_some_and(|f| f.task == says.task);
                let holds = beside || b.tasks.iter().any(|(id, _, _)| *id == says.task);
                let holds = b.relays && holds;
                if !holds {
                    continue;
                }
                p.given = p.given.or(now);
                let pose = swarm.pose(u.id);
                if pose.is_some_and(|pose| (pose.position() - lost).norm() <= THERE_M) {
                    p.there = p.there.or(now);
                }
                if b.follows.is_some_and(|f| f.sees) {
                    p.there = p.there.or(now);
                    p.seen = p.seen.or(now);
                }
            }
            if p.seen.is_some() {
                break;
            }
        }
        told.push(p);
    }
    told
}

/// Prints every five seconds what whoever follows says of it, and where vehicles are.
fn watch(prepared: &Prepared, seed: u64, faults: Vec<TimedFault>) {
    let mut swarm = Swarm::new(prepared, seed, faults, false);
    for at_s in (10..900).step_by(5) {
        swarm.run_until(at_s * 1000);
        let cars: Vec<String> = swarm
            .vehicles()
            .map(|v| format!("({:.0}, {:.0})", v.x, v.y))
            .collect();
        for u in &prepared.spec.uavs {
            let Some(b) = swarm.beliefs(u.id) else {
                continue;
            };
            if let Some(pose) = swarm.pose(u.id).filter(|_| b.relays) {
                println!(
                    "  {at_s} s: uav{} at ({:.0}, {:.0}) {:?} {:?}; vehicles {}",
                    u.id,
                    pose.east_m,
                    pose.north_m,
                    b.tasks,
                    b.follows.map(|f| (f.at_mm, f.sees)),
                    cars.join(" ")
                );
            }
        }
    }
}

fn bytes(o: &Outcome, kind: Option<&str>) -> u64 {
    let Some(simulated) = o.report.simulated.as_ref() else {
        return 0;
    };
    let of = |(k, bytes): (&String, &u64)| kind.is_none_or(|kind| kind == k).then_some(*bytes);
    simulated.bytes_by_kind.iter().filter_map(of).sum()
}

fn compare(n: u16, prepared: &Prepared, seeds: &Seeds, wrong: &str) {
    let free_ms = failure_free_makespan_ms(prepared);
    let (mut wanted, mut sight, mut runs, mut completed) = (0, 0, 0_u32, 0_u32);
    let (mut retaken, mut ratios, mut stand_off, mut place) = (vec![], vec![], vec![], vec![]);
    let (mut more, mut targets, mut lost, mut twice) = (vec![], vec![], 0, 0);
    let mut broken: BTreeMap<String, u64> = BTreeMap::new();
    let mut after: Vec<Parts> = vec![];
    for seed in seeds.from..seeds.to {
        let own = prepared.spec.faults.clone();
        let (prepared, faults) = match wrong {
            "storm" => {
                let storm = fault_generator::draw(&prepared.spec, seed, free_ms);
                (prepared.with_uavs(storm.uavs), storm.faults)
            }
            _ => (prepared.clone(), Vec::new()),
        };
        let mut with: Vec<TimedFault> = faults.iter().cloned().chain(own).collect();
        with.sort_by_key(|f| f.at_ms);
        if wrong == "deaths" {
            with = deaths(&prepared, seed, with);
        }
        let is_asked = |f: &&TimedFault| !matches!(f.fault, Fault::AddTask { .. });
        let without: Vec<TimedFault> = with.iter().filter(is_asked).cloned().collect();
        if std::env::var_os("WATCH").is_some() {
            watch(&prepared, seed, with.clone());
        }
        for p in parts(&prepared, seed, &with) {
            println!("  seed {seed}: {p:?}");
            after.push(p);
        }
        let plain = run(&prepared, seed, without, Wanted::default());
        let tasked = run(&prepared, seed, with, Wanted::default());
        runs += 1;
        completed += u32::from(tasked.report.completed);
        for v in tasked.violations() {
            println!("  seed {seed}: {} at {} ms: {}", v.check, v.time_ms, v.text);
            *broken.entry(v.check.clone().into_owned()).or_default() += 1;
        }
        for t in &tasked.report.tasks {
            println!("  seed {seed}: {}", t.line());
            let Some(tracked) = &t.tracked else { continue };
            wanted += tracked.wanted_ms;
            sight += tracked.sight_ms;
            twice += tracked.twice_ms;
            lost += t.lost;
            retaken.extend(tracked.retaken_ms.iter().map(|ms| *ms as f64 / 1e3));
            if tracked.sight_ms > 0 {
                stand_off.push(tracked.stand_off_rms_mm as f64 / 1e3);
                place.push(tracked.place_rms_mm as f64 / 1e3);
            }
        }
        if let (Some(a), Some(b)) = (tasked.report.makespan_ms, plain.report.makespan_ms) {
            ratios.push(a as f64 / b.max(1) as f64);
        }
        more.push(bytes(&tasked, None) as f64 / bytes(&plain, None).max(1) as f64);
        let lasted_s = tasked.report.end_ms as f64 / 1e3;
        targets.push(bytes(&tasked, Some("target")) as f64 * 8.0 / lasted_s.max(1.0));
    }
    println!(
        "{n} UAVs, {wrong}: {completed} of {runs} complete, in sight {:.1} % of {} s (of two {:.1} %), lost {lost} times, {:.1} m off the stand-off, {:.1} m off its place, had again after {} losses: {}, makespan {}, bytes {}, targets {} bit/s, broken {broken:?}",
        100.0 * sight as f64 / wanted.max(1) as f64,
        wanted / 1000,
        100.0 * twice as f64 / wanted.max(1) as f64,
        middle(&stand_off),
        middle(&place),
        retaken.len(),
        spread(&retaken),
        spread(&ratios),
        spread(&more),
        spread(&targets),
    );
    if !after.is_empty() {
        print_parts(&after);
    }
}

/// Where the time went, middle and most of each part, and how many had it in time.
fn print_parts(all: &[Parts]) {
    let of = |pick: &dyn Fn(&Parts) -> Option<f64>| {
        let list: Vec<f64> = all.iter().filter_map(pick).collect();
        format!("{} of {}", spread(&list), list.len())
    };
    let over = |p: &Parts| Some(p.seen? - p.bound);
    let within = |s: f64| {
        all.iter()
            .filter(|p| p.seen.is_some_and(|x| x <= s))
            .count()
    };
    println!(
        "  after {} deaths: nearest {} m off, suspected {}, down {}, given {}, there {}, in sight {}; bound {}, over it {}; within 10 s {}",
        all.len(),
        of(&|p| Some(p.away_m)),
        of(&|p| p.suspected),
        of(&|p| p.down),
        of(&|p| Some(p.given? - p.down?)),
        of(&|p| Some(p.there? - p.given?)),
        of(&|p| Some(p.seen? - p.there?)),
        of(&|p| Some(p.bound)),
        of(&over),
        within(10.0),
    );
}

fn sorted(list: &[f64]) -> Vec<f64> {
    let mut list = list.to_vec();
    list.sort_by(f64::total_cmp);
    list
}

fn middle(list: &[f64]) -> f64 {
    sorted(list).get(list.len() / 2).copied().unwrap_or(0.0)
}

/// The middle one, and the largest.
fn spread(list: &[f64]) -> String {
    let most = sorted(list).last().copied().unwrap_or(0.0);
    format!("{:.2} (at most {most:.2})", middle(list))
}
