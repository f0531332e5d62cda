//! Built-in trials where something stands that is on no map: what comes of that.

use crate::read::testing;
use skein_netsim::swarm::Outcome;

/// The trial with so many UAVs, in calm but for the one that is lost, where there is another; with
/// their sensors, or without.
fn flown(uavs: u16, seed: u64, senses: bool) -> Outcome {
    testing::flown("cranes", uavs, seed, |spec| {
        if !senses {
            spec.obstacle_range_m = 0.0;
        }
    })
}

#[test]
fn what_stands_on_no_map_is_flown_round_by_one_uav_and_by_many_and_the_rest_is_seen() {
    for (uavs, seeds) in [(1, 1..2), (2, 1..2), (5, 1..4), (8, 1..2)] {
        for seed in seeds {
            let outcome = flown(uavs, seed, true);
            let (report, broken) = (&outcome.report, outcome.violations());
            assert!(
                report.passed,
                "{uavs} {seed}: {:?} {broken:?}",
                report.reasons
            );
            let found = report.obstacles_found.unwrap();
            assert!((2..=4).contains(&found), "{uavs} {seed}: {found} found");
            let nearest_m = report.nearest_obstacle_m.unwrap();
            assert!(nearest_m > 10.0, "{uavs} {seed}: {nearest_m}");
        }
    }
}

/// The same flights without sensors: so that what is judged can fail.
#[test]
fn without_a_sensor_uavs_fly_into_what_stands_there_and_the_judge_says_so() {
    let broken = |seed: u64| {
        let outcome = flown(5, seed, false);
        let told = outcome.violations().iter().any(|v| v.check == "S14");
        told && !outcome.report.passed && outcome.report.obstacles_found == Some(0)
    };
    assert!((1..4).all(broken));
}
