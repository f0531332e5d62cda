//! Built-in trials whose missions look for something, or escort it: what comes of that.

use crate::{Overrides, load_builtin};
use skein_netsim::Prepared;
use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::runs::{Wanted, run};
use skein_netsim::swarm::{Outcome, Swarm};
use skein_peer::Beliefs;
use skein_peer::criteria::coloured;
use skein_peer::wire::tasks::Progress;
use std::sync::Arc;

fn prepared(name: &str, uavs: u16) -> Prepared {
    let over = Overrides {
        peers: Some(uavs),
        ..Overrides::default()
    };
    Prepared::new(load_builtin(name, &over).unwrap().spec)
}

fn flown(name: &str, uavs: u16, seed: u64) -> Outcome {
    let prepared = prepared(name, uavs);
    let faults = prepared.spec.faults.clone();
    run(&prepared, seed, faults, Wanted::default())
}

fn passed(outcome: &Outcome) {
    let broken = outcome.violations();
    let report = &outcome.report;
    assert!(report.passed, "{:?} {broken:?}", report.reasons);
}

#[test]
fn what_drives_is_followed_until_services_are_there_and_what_else_drives_is_told() {
    let outcome = flown("lookout", 3, 2);
    passed(&outcome);
    let told = &outcome.report.detections;
    let of = |looks: &'static str| told.iter().filter(move |d| d.looks == looks);
    // Each once, though three fly over them for minutes; and nothing of the bus that stands.
    assert_eq!((of("lorry").count(), of("car").count()), (1, 1), "{told:?}");
    assert_eq!(told.len(), 2);
    let lorry = of("lorry").next().unwrap();
    assert!(lorry.to_follow && lorry.vehicle == Some(0) && lorry.off_mm < 8_500);
    // In sight until services have reached it, long before the longest time.
    let (from_ms, served_ms) = (lorry.followed_ms.unwrap(), lorry.served_ms.unwrap());
    assert!(served_ms < from_ms + 400_000, "{}", lorry.line());
    assert!(
        (served_ms - from_ms).abs_diff(lorry.sight_ms) < 30_000,
        "{}",
        lorry.line()
    );
    let car = of("car").next().unwrap();
    assert!(!car.to_follow && car.followed_ms.is_none() && car.vehicle == Some(1));
    assert_eq!(car.served_ms, None);
    // Then who followed it covers again: all is seen, and all are finished.
    assert_eq!(outcome.report.finished.len(), 3);
}

#[test]
fn a_search_ends_when_it_is_found_and_it_is_watched_by_one_uav_and_of_many() {
    for uavs in [1, 3, 8] {
        let outcome = flown("search", uavs, 4);
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
        // Until a party on foot has come 600 m.
        let served_ms = bus.served_ms.unwrap();
        let walked_ms = served_ms - bus.told_ms;
        assert!((380_000..430_000).contains(&walked_ms), "{}", bus.line());
        assert!(bus.sight_ms + 30_000 > walked_ms, "{}", bus.line());
        assert!(report.end_ms < served_ms + 20_000, "{}", bus.line());
        // Not everything was seen, and nobody flew on for that.
        let c = &report.coverage;
        assert!(c.covered_cells < c.coverable_cells);
        assert!(report.found_ms.unwrap() < bus.told_ms + 10_000);
        assert_eq!(report.finished.len(), usize::from(uavs));
    }
}

/// Where no services come one watches for as long as the mission says.
#[test]
fn without_services_what_was_found_is_watched_for_its_time() {
    let mut spec = load_builtin("search", &Overrides::default()).unwrap().spec;
    spec.services.clear();
    let faults = spec.faults.clone();
    let outcome = run(&Prepared::new(spec), 4, faults, Wanted::default());
    passed(&outcome);
    let bus = &outcome.report.detections[0];
    assert!(
        bus.sight_ms > 560_000 && bus.served_ms.is_none(),
        "{}",
        bus.line()
    );
}

/// The ground station is down while services come: once it is back its operator says that they
/// are there.
#[test]
fn who_comes_while_the_ground_station_is_down_is_heard_of_when_it_is_back() {
    let prepared = prepared("search", 3);
    let mut faults = prepared.spec.faults.clone();
    faults.push(TimedFault {
        at_ms: 540_000,
        fault: Fault::Kill { peer: 100 },
    });
    faults.push(TimedFault {
        at_ms: 640_000,
        fault: Fault::Restart {
            peer: 100,
            fresh_disk: false,
        },
    });
    let outcome = run(&prepared, 4, faults, Wanted::default());
    passed(&outcome);
    let bus = &outcome.report.detections[0];
    let served_ms = bus.served_ms.unwrap();
    assert!((640_000..700_000).contains(&served_ms), "{}", bus.line());
    assert!(outcome.report.end_ms < served_ms + 20_000, "{}", bus.line());
}

/// Of two buses the mission looks for the one that would be found later; a look in twenty takes
/// either for something else.
#[test]
fn a_search_for_a_colour_passes_others_by() {
    let found = |colour: Option<u8>| {
        let mut spec = load_builtin("search", &Overrides::default()).unwrap().spec;
        for (v, colour) in spec.vehicles.iter_mut().zip([7, 1]) {
            (v.kind, v.confused_permille) = (coloured(3, colour), 50);
        }
        let mut mission = (*spec.mission).clone();
        mission.detections[0].colour = colour;
        spec.mission = Arc::new(mission);
        let faults = spec.faults.clone();
        let outcome = run(&Prepared::new(spec), 4, faults, Wanted::default());
        passed(&outcome);
        let [bus] = &outcome.report.detections[..] else {
            panic!("{:?}", outcome.report.detections);
        };
        (bus.looks.clone(), bus.vehicle)
    };
    assert_eq!(found(None), ("yellow bus".to_owned(), Some(0)));
    assert_eq!(found(Some(1)), ("white bus".to_owned(), Some(1)));
}

#[test]
fn when_who_watches_what_was_found_is_killed_another_is_given_it_though_all_are_home() {
    let prepared = prepared("search", 3);
    let mut faults = prepared.spec.faults.clone();
    let holders = |swarm: &Swarm| {
        let views = [1, 2, 3].map(|id| (id, swarm.beliefs(id)));
        let holds = |b: &Beliefs| {
            let mut all = b.tasks.iter();
            all.any(|(.., p)| matches!(p, Progress::Committed | Progress::Begun))
        };
        let all = views
            .into_iter()
            .filter(|(_, b)| b.as_ref().is_some_and(holds));
        all.map(|(id, _)| id).collect::<Vec<u16>>()
    };
    let mut swarm = Swarm::new(&prepared, 4, faults.clone(), false);
    swarm.run_until(300_000);
    let [watches] = holders(&swarm)[..] else {
        panic!("one watches");
    };
    faults.push(TimedFault {
        at_ms: 300_000,
        fault: Fault::Kill { peer: watches },
    });
    let mut swarm = Swarm::new(&prepared, 4, faults.clone(), false);
    let given = |swarm: &Swarm| holders(swarm).into_iter().find(|&id| id != watches);
    while given(&swarm).is_none() {
        assert!(swarm.now_ms() < 330_000, "another goes there");
        swarm.run_until(swarm.now_ms() + 1000);
    }
    let next = given(&swarm).unwrap();
    assert!(swarm.beliefs(next).unwrap().relays);
    // And sees it: what is lost besides what is lost when nobody is killed is the time until
    // another is given it, its way there at the 14.5 m/s of a swift, and its turns and the
    // shadows of its own round over it.
    let at = swarm.pose(next).unwrap().position();
    let away_m = (swarm.vehicles().next().unwrap() - at).norm();
    let may_ms = swarm.now_ms() - 300_000 + (away_m / 14.5 * 1000.0) as u64 + 15_000;
    let unseen_ms = |faults: Vec<TimedFault>| {
        let outcome = run(&prepared, 4, faults, Wanted::default());
        passed(&outcome);
        let bus = &outcome.report.detections[0];
        let wanted_ms = bus.served_ms.unwrap() - bus.told_ms;
        println!("{}", bus.line());
        wanted_ms.saturating_sub(bus.sight_ms)
    };
    let (anyway_ms, lost_ms) = (unseen_ms(prepared.spec.faults.clone()), unseen_ms(faults));
    assert!(
        lost_ms < anyway_ms + may_ms,
        "{lost_ms} ms unseen, {anyway_ms} without the loss, {away_m:.0} m away"
    );
}

/// The only UAV stands still while the convoy leaves: it looks for it along the road that it is to
/// see, and not about the place where it was.
#[test]
fn a_convoy_that_has_left_is_caught_up_with_along_its_road() {
    let prepared = prepared("convoy", 1);
    let faults = vec![
        TimedFault {
            at_ms: 835,
            fault: Fault::Pause { peer: 1 },
        },
        TimedFault {
            at_ms: 48_000,
            fault: Fault::Resume { peer: 1 },
        },
    ];
    for seed in 1..4 {
        let outcome = run(&prepared, seed, faults.clone(), Wanted::default());
        passed(&outcome);
        let task = &outcome.report.tasks[0];
        let seen = task.tracked.as_ref().unwrap();
        // 270 m ahead by then, at 5 m/s; 14.5 m/s come up to it in half a minute.
        assert!(seen.first_ms.unwrap() < 48_000 + 50_000, "{}", task.line());
        assert!(seen.sight_ms * 10 > seen.wanted_ms * 7, "{}", task.line());
    }
}

#[test]
fn a_convoy_is_escorted_by_one_uav_and_of_many() {
    for uavs in [1, 3, 8] {
        let outcome = flown("convoy", uavs, 6);
        passed(&outcome);
        let [task] = &outcome.report.tasks[..] else {
            panic!("{:?}", outcome.report.tasks);
        };
        let seen = task.tracked.as_ref().unwrap();
        assert!(seen.first_ms.unwrap() < 60_000, "{}", task.line());
        assert!(seen.sight_ms * 100 > seen.wanted_ms * 90, "{}", task.line());
        assert!((475_000..500_000).contains(&outcome.report.end_ms));
    }
}
