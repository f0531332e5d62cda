//! Built-in trials whose missions look for something, or escort it: what comes of that.

use crate::{Overrides, load_builtin};
use skein_netsim::Prepared;
use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::runs::{Wanted, run};
use skein_netsim::swarm::{Outcome, Swarm};

fn prepared(name: &str, uavs: u16) -> Prepared {
    let over = Overrides {
        peers: Some(uavs),
        ..Overrides::default()
    };
    Prepared::new(load_builtin(name, &over).unwrap().spec)
}

/// A run in which whoever follows at these times is killed.
fn flown(name: &str, uavs: u16, seed: u64, killed_at_ms: &[u64]) -> Outcome {
    let prepared = prepared(name, uavs);
    let mut faults = prepared.spec.faults.clone();
    for &at_ms in killed_at_ms {
        let mut swarm = Swarm::new(&prepared, seed, faults.clone(), false);
        swarm.run_until(at_ms);
        let follows = |id: &u16| swarm.beliefs(*id).is_some_and(|b| b.follows.is_some());
        let ids = prepared.spec.uavs.iter().map(|u| u.id);
        let peer = ids.into_iter().find(follows).unwrap();
        let fault = Fault::Kill { peer };
        faults.push(TimedFault { at_ms, fault });
    }
    run(&prepared, seed, faults, Wanted::default())
}

fn passed(outcome: &Outcome) {
    let broken = outcome.violations();
    let report = &outcome.report;
    assert!(report.passed, "{:?} {broken:?}", report.reasons);
}

#[test]
fn what_drives_is_followed_until_services_are_there_and_what_else_drives_is_told() {
    let outcome = flown("watchers", 3, 2, &[]);
    passed(&outcome);
    let told = &outcome.report.detections;
    let of = |looks: &'static str| told.iter().filter(move |d| d.looks == looks);
    // Each once, though three fly over them for minutes; and nothing of the bus that stands.
    assert_eq!((of("lorry").count(), of("car").count()), (1, 1), "{told:?}");
    assert_eq!(told.len(), 2);
    let lorry = of("lorry").next().unwrap();
    assert!(lorry.to_follow && lorry.vehicle == Some(0) && lorry.off_mm < 8_500);
    assert!(
        (200_000..245_000).contains(&lorry.sight_ms),
        "{}",
        lorry.line()
    );
    let car = of("car").next().unwrap();
    assert!(!car.to_follow && car.followed_ms.is_none() && car.vehicle == Some(1));
    // Then who followed it covers again: all is seen, and all are finished.
    assert_eq!(outcome.report.finished.len(), 3);
}

#[test]
fn a_search_ends_when_it_is_found_and_it_is_watched_by_one_uav_and_of_many() {
    for uavs in [1, 3, 8] {
        let outcome = flown("search", uavs, 4, &[]);
        passed(&outcome);
        let report = &outcome.report;
        let [bus] = &report.detections[..] else {
            panic!("{:?}", report.detections);
        };
        assert!(
            bus.looks == "bus" && bus.vehicle == Some(0),
            "{}",
            bus.line()
        );
        assert!(bus.sight_ms > 560_000, "{}", bus.line());
        // Not everything was seen, and nobody flew on for that.
        let c = &report.coverage;
        assert!(c.covered_cells < c.coverable_cells);
        assert!(report.found_ms.unwrap() < bus.told_ms + 10_000);
        assert_eq!(report.finished.len(), usize::from(uavs));
    }
}

#[test]
fn who_watches_what_was_found_and_is_killed_is_relieved_by_another_from_home() {
    let outcome = flown("search", 3, 4, &[300_000]);
    passed(&outcome);
    let told = &outcome.report.detections;
    assert_eq!(told.len(), 1, "{told:?}");
    let without = outcome.report.end_ms - told[0].told_ms - told[0].sight_ms;
    assert!(without < 90_000, "{}", told[0].line());
}

#[test]
fn a_convoy_is_escorted_by_one_uav_and_of_many_and_again_after_a_loss() {
    for (uavs, killed_at_ms) in [(1, None), (3, None), (8, None), (3, Some(150_000))] {
        let killed: Vec<u64> = killed_at_ms.into_iter().collect();
        let outcome = flown("convoy", uavs, 6, &killed);
        passed(&outcome);
        let [task] = &outcome.report.tasks[..] else {
            panic!("{:?}", outcome.report.tasks);
        };
        let seen = task.tracked.as_ref().unwrap();
        assert!(seen.first_ms.unwrap() < 60_000, "{}", task.line());
        let least = if killed.is_empty() { 90 } else { 50 };
        assert!(
            seen.sight_ms * 100 > seen.wanted_ms * least,
            "{}",
            task.line()
        );
        assert!((475_000..500_000).contains(&outcome.report.end_ms));
    }
}
