//! Built-in trials in an airspace that others use as well: what comes of that.

use crate::{Overrides, load_builtin};
use skein_netsim::Prepared;
use skein_netsim::fault::Fault;
use skein_netsim::runs::{Wanted, run};
use skein_netsim::swarm::Outcome;

/// The trial with so many UAVs, in calm but for the one that is lost, where there is another; with
/// their sensors, or without.
fn flown(uavs: u16, seed: u64, senses: bool) -> Outcome {
    let over = Overrides {
        peers: Some(uavs),
        ..Overrides::default()
    };
    let mut spec = load_builtin("airspace", &over).unwrap().spec;
    if !senses {
        spec.traffic_range_m = 0.0;
    }
    let prepared = Prepared::new(spec);
    let mut faults = prepared.spec.faults.clone();
    faults.retain(|f| !matches!(f.fault, Fault::Kill { peer } if peer > uavs || uavs == 1));
    run(&prepared, seed, faults, Wanted::default())
}

#[test]
fn way_is_made_for_intruders_by_one_uav_and_by_many_and_all_is_seen() {
    for (uavs, seeds) in [(1, 1..2), (2, 1..2), (5, 1..4), (8, 1..2)] {
        for seed in seeds {
            let outcome = flown(uavs, seed, true);
            let broken = outcome.violations();
            assert!(
                outcome.report.passed,
                "{uavs} {seed}: {:?} {broken:?}",
                outcome.report.reasons
            );
            let nearest_m = outcome.report.nearest_intruder_m.unwrap();
            assert!(nearest_m >= 50.0, "{uavs} {seed}: {nearest_m}");
        }
    }
}

/// The same flights without sensors: so that what is judged can fail.
#[test]
fn without_a_sensor_intruders_come_near_and_the_judge_says_so() {
    let broken = |seed: u64| {
        let outcome = flown(5, seed, false);
        let told = outcome.violations().iter().any(|v| v.check == "S13");
        told && !outcome.report.passed
    };
    assert!((1..6).all(broken));
}
