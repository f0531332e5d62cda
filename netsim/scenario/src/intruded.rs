//! Built-in trials in an airspace that others use as well: what comes of that.

use crate::read::testing;
use skein_netsim::Prepared;
use skein_netsim::runs::{Wanted, run};
use skein_netsim::swarm::Outcome;

/// The trial with so many UAVs, in calm but for the one that is lost, where there is another; with
/// their sensors, or without.
fn flown(uavs: u16, seed: u64, senses: bool) -> Outcome {
    testing::flown("airspace", uavs, seed, |spec| {
        if !senses {
            spec.traffic_range_m = 0.0;
        }
    })
}

/// The same trial, of a fleet that flies like that, with its sensors, or without.
fn of_fleet(replaced: &[(&str, &str)], seed: u64, senses: bool) -> Outcome {
    let text = crate::builtin::text("airspace").unwrap().to_owned();
    let text = replaced.iter().fold(text, |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    });
    let mut spec = crate::parse("airspace.json5", &text, &crate::builtin::files()).unwrap();
    if !senses {
        spec.traffic_range_m = 0.0;
    }
    let prepared = Prepared::new(spec);
    let faults = prepared.spec.faults.clone();
    run(&prepared, seed, faults, Wanted::default())
}

#[test]
fn who_keeps_a_promised_way_at_one_height_passes_over_intruders() {
    let at_one_height = [
        ("slot_step_m: 8", "separation_m: 30"),
        ("wind: { from_deg: 240, speed_mps: 3 },", ""),
        ("rate_bps: 64000", "rate_bps: 1000000"),
    ];
    for seed in 1..4 {
        let outcome = of_fleet(&at_one_height, seed, true);
        let (report, broken) = (&outcome.report, outcome.violations());
        assert!(report.passed, "{seed}: {:?} {broken:?}", report.reasons);
        let nearest_m = report.nearest_intruder_m.unwrap_or(f64::INFINITY);
        assert!(nearest_m >= 50.0, "{seed}: {nearest_m}");
        assert!(report.nearest_approach_m.unwrap() >= 30.0);
    }
    let blind = of_fleet(&at_one_height, 1, false);
    assert!(blind.violations().iter().any(|v| v.check == "S13"));
}

#[test]
fn in_layers_way_is_made_too() {
    let in_layers = [
        (
            "level_m: 60,",
            "level_m: 60, mission: { layers_m: [60, 120], diagram: \"volume\" },",
        ),
        ("min_separation_m: 6", "min_separation_m: 4"),
    ];
    for seed in 1..3 {
        let outcome = of_fleet(&in_layers, seed, true);
        let (report, broken) = (&outcome.report, outcome.violations());
        assert!(report.passed, "{seed}: {:?} {broken:?}", report.reasons);
        let nearest_m = report.nearest_intruder_m.unwrap();
        assert!(nearest_m >= 50.0, "{seed}: {nearest_m}");
    }
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
