//! The runs of a prepared scenario: with its own faults, with drawn ones, without any.

use crate::account::RunReport;
use crate::check::Violation;
use crate::fault::{Fault, TimedFault};
use crate::fault_generator;
use crate::omniscient_baseline;
use crate::prepared::Prepared;
use crate::swarm::{Outcome, Swarm};
use crate::troubles::Struck;

/// The seed of the run without faults: the same for every seed that is asked for, so
/// that a seed draws the same storm alone and in a batch.
const FAILURE_FREE_SEED: u64 = 0;

/// The makespan of a run is compared with the omniscient baseline where at most this many
/// UAVs were killed for good, or a quarter of all: that is what the product promises a figure
/// for.
const COMPARED_KILLS: usize = 3;

/// What a run is asked for besides its seed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// The main events, for a timeline.
    pub events: bool,
    /// The makespan beside that of the omniscient baseline, which costs about as much as
    /// the run itself.
    pub baseline: bool,
}

/// Runs once with these faults. A panic becomes a violation of S12 that names the seed.
#[must_use]
pub fn run(prepared: &Prepared, seed: u64, faults: Vec<TimedFault>, wanted: Wanted) -> Outcome {
    watched(prepared, seed, faults, wanted, None)
}

/// The same, looked at before its first event, every so often and at its end: nothing of it
/// depends on that.
#[must_use]
pub fn watched(
    prepared: &Prepared,
    seed: u64,
    faults: Vec<TimedFault>,
    wanted: Wanted,
    watch: Option<&mut Watch<'_>>,
) -> Outcome {
    // A baseline knows of one mission and of one UAV under each id.
    let replaced =
        |f: &TimedFault| f.fault.changes_mission() || matches!(f.fault, Fault::Twin { .. });
    let comparable = COMPARED_KILLS.max(prepared.spec.uavs.len() / 4);
    let compare = wanted.baseline
        && fault_generator::kills(&faults) as usize <= comparable
        && !faults.iter().any(replaced);
    let compared = compare.then(|| faults.clone());
    let mut outcome = guarded(prepared, seed, faults, (wanted.events, watch));
    if let Some(faults) = compared
        && outcome.report.makespan_ms.is_some()
    {
        outcome
            .report
            .compare(omniscient_baseline::makespan_ms(prepared, seed, &faults));
    }
    outcome
}

/// Looks at a swarm while it runs.
pub struct Watch<'a> {
    /// How often, milliseconds of scenario time.
    pub every_ms: u64,
    /// What is done with what is seen.
    pub look: &'a mut dyn FnMut(&Swarm),
}

/// Runs a seed with the scenario's own faults.
#[must_use]
pub fn planned(prepared: &Prepared, seed: u64, wanted: Wanted) -> Outcome {
    run(prepared, seed, prepared.spec.faults.clone(), wanted)
}

/// Runs a seed with the faults its storm draws; `failure_free_ms` is the
/// [makespan without faults](failure_free_makespan_ms).
#[must_use]
pub fn storm(prepared: &Prepared, seed: u64, failure_free_ms: u64, wanted: Wanted) -> Outcome {
    let storm = fault_generator::draw(&prepared.spec, seed, failure_free_ms);
    let prepared = prepared.with_uavs(storm.uavs);
    let mut outcome = run(&prepared, seed, storm.faults, wanted);
    let ran = |s: &&Struck| s.at_ms < outcome.report.end_ms;
    outcome.struck = storm.struck.iter().filter(ran).map(|s| s.name).collect();
    outcome
}

/// What happens to which UAVs in a seed: the scenario's own faults, or those of its storm where
/// the makespan without faults is given.
#[must_use]
pub fn faults_of(
    prepared: &Prepared,
    seed: u64,
    failure_free_ms: Option<u64>,
) -> (Prepared, Vec<TimedFault>) {
    let storm = failure_free_ms.map(|ms| fault_generator::draw(&prepared.spec, seed, ms));
    match storm {
        Some(storm) => (prepared.with_uavs(storm.uavs), storm.faults),
        None => (prepared.clone(), prepared.spec.faults.clone()),
    }
}

/// The swarm of a seed at some time, or at its end if that is sooner: with the scenario's own
/// faults, or with those of its storm where the makespan without faults is given.
#[must_use]
pub fn until(prepared: &Prepared, seed: u64, failure_free_ms: Option<u64>, at_ms: u64) -> Swarm {
    let (prepared, faults) = faults_of(prepared, seed, failure_free_ms);
    let mut swarm = Swarm::new(&prepared, seed, faults, false);
    swarm.run_until(at_ms);
    swarm
}

/// How long the mission takes without faults, milliseconds; the scenario's longest
/// time when it does not end.
#[must_use]
pub fn failure_free_makespan_ms(prepared: &Prepared) -> u64 {
    let longest_ms = u64::from(prepared.spec.max_time_s) * 1000;
    Swarm::new(prepared, FAILURE_FREE_SEED, Vec::new(), false)
        .run()
        .report
        .makespan_ms
        .unwrap_or(longest_ms)
}

fn guarded(
    prepared: &Prepared,
    seed: u64,
    faults: Vec<TimedFault>,
    (keep, watch): (bool, Option<&mut Watch<'_>>),
) -> Outcome {
    let run = std::panic::AssertUnwindSafe(|| {
        let swarm = Swarm::new(prepared, seed, faults, keep);
        match watch {
            Some(watch) => swarm.run_watched(watch.every_ms, watch.look),
            None => swarm.run(),
        }
    });
    std::panic::catch_unwind(run).unwrap_or_else(|payload| {
        let text = payload
            .downcast_ref::<&str>()
            .map(ToString::to_string)
            .or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "a panic without words".to_owned());
        let violation = Violation {
            check: "S12".into(),
            seed,
            time_ms: 0,
            peer: None,
            text,
        };
        Outcome {
            report: RunReport::of_a_panic(prepared.spec.name.clone(), seed, violation),
            ..Outcome::default()
        }
    })
}
