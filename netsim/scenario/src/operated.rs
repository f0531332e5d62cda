//! What the operator of a built-in trial asks for while it is flown, and what comes of it.

use crate::{Overrides, load_builtin};
use skein_netsim::Prepared;
use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::runs::{Wanted, run};
use skein_netsim::swarm::{Outcome, Swarm};
use skein_peer::input::NewTask;
use skein_peer::wire::tasks::TaskKind;

/// The relay trial with so many UAVs: as it is, and without its operator.
fn relayed(uavs: u16) -> [Outcome; 2] {
    let over = Overrides {
        peers: Some(uavs),
        ..Overrides::default()
    };
    let prepared = Prepared::new(load_builtin("relay", &over).unwrap().spec);
    let asked = prepared.spec.faults.clone();
    [asked, Vec::new()].map(|faults| run(&prepared, 1, faults, Wanted::default()))
}

/// Of the periods in which both lasted, in how many the first ground station knew more and
/// in how many less, percent.
fn sooner([with, without]: &[Outcome; 2]) -> (usize, usize) {
    let both = with.ground_lacks.iter().zip(&without.ground_lacks);
    let both: Vec<(u16, u16)> = both.filter_map(|(a, b)| Some(((*a)?, (*b)?))).collect();
    let share = |is: fn(&(u16, u16)) -> bool| {
        both.iter().filter(|p| is(p)).count() * 100 / both.len().max(1)
    };
    (share(|(a, b)| a < b), share(|(a, b)| a > b))
}

#[test]
fn a_relay_position_tells_the_ground_station_of_what_it_cannot_hear() {
    for uavs in [1, 3, 8] {
        let runs = relayed(uavs);
        for outcome in &runs {
            let broken = outcome.violations();
            assert!(outcome.report.completed && broken.is_empty(), "{broken:?}");
        }
        let held_ms: u64 = runs[0].relays_held_ms.values().sum();
        let (more, less) = sooner(&runs);
        println!("{uavs} UAVs: held for {held_ms} ms, {more} % more, {less} % less");
        if uavs == 1 {
            assert_eq!(held_ms, 0, "one UAV alone covers first");
            continue;
        }
        assert!(held_ms * 2 > runs[0].report.end_ms, "{held_ms}");
        assert!(more >= 40 && less <= 10, "{more} % more, {less} % less");
        assert_eq!(runs[0].report.relaying.len(), 1);
    }
}

#[test]
fn an_area_is_seen_in_one_flight_and_what_is_told_of_it_is_true() {
    let scenario = load_builtin("relay", &Overrides::default()).unwrap();
    let prepared = Prepared::new(scenario.spec);
    let task = NewTask {
        name: Some("yard".to_owned()),
        kind: TaskKind::Area,
        // South of what is covered, beside the no-fly zone.
        places: vec![
            (280_000, 380_000),
            (430_000, 380_000),
            (430_000, 520_000),
            (340_000, 560_000),
        ],
        radius_mm: 0,
        worth: 100,
        within_ms: None,
        sensor: 0,
    };
    let asked = TimedFault {
        at_ms: 8_000,
        fault: Fault::AddTask { task },
    };
    let outcome = run(&prepared, 2, vec![asked], Wanted::default());
    let broken = outcome.violations();
    assert!(outcome.report.completed && broken.is_empty(), "{broken:?}");
    let [told] = &outcome.report.tasks[..] else {
        panic!("{:?}", outcome.report.tasks);
    };
    assert!(
        told.seen_ms.is_some() && told.done_by.len() == 1,
        "{}",
        told.line()
    );
    assert_eq!(told.flown_by.len(), 1, "{}", told.line());
}

/// The track trial with so many UAVs: as it is, or with whoever follows at these times killed.
fn tracked(uavs: u16, seed: u64, killed_at_ms: &[u64]) -> Outcome {
    tracked_by(uavs, 1, seed, killed_at_ms)
}

/// Likewise, with so many UAVs asked for to stay with the car.
fn tracked_by(uavs: u16, watchers: u32, seed: u64, killed_at_ms: &[u64]) -> Outcome {
    let over = Overrides {
        peers: Some(uavs),
        ..Overrides::default()
    };
    let prepared = Prepared::new(load_builtin("track", &over).unwrap().spec);
    let mut faults = prepared.spec.faults.clone();
    let asked = faults.iter().find_map(|f| match &f.fault {
        Fault::AddTask { task } => Some((f.at_ms, task.clone())),
        _ => None,
    });
    let (asked_ms, task) = asked.unwrap();
    faults.extend((2..=watchers).map(|nth| TimedFault {
        at_ms: asked_ms,
        fault: Fault::AddTask {
            task: NewTask {
                name: Some(format!("car.{nth}")),
                ..task.clone()
            },
        },
    }));
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

#[test]
fn a_car_is_followed_and_by_another_when_its_follower_is_killed() {
    let outcome = tracked(3, 5, &[150_000]);
    let broken = outcome.violations();
    assert!(outcome.report.completed && broken.is_empty(), "{broken:?}");
    let [told] = &outcome.report.tasks[..] else {
        panic!("{:?}", outcome.report.tasks);
    };
    let seen = told.tracked.as_ref().unwrap();
    assert!(told.held_by.len() >= 2, "{}", told.line());
    assert!(seen.sight_ms > 150_000, "{}", told.line());
    assert!(!seen.retaken_ms.is_empty(), "{}", told.line());
    assert!(seen.stand_off_rms_mm < 15_000, "{}", told.line());
    assert!(seen.place_rms_mm < 12_000, "{}", told.line());
}

#[test]
fn who_stays_with_it_beside_has_it_at_once_when_its_follower_is_killed() {
    let outcome = tracked_by(4, 2, 5, &[150_000]);
    let broken = outcome.violations();
    assert!(outcome.report.completed && broken.is_empty(), "{broken:?}");
    let told = &outcome.report.tasks[0];
    let seen = told.tracked.as_ref().unwrap();
    assert!(seen.twice_ms > 120_000, "{}", told.line());
    assert!(
        seen.retaken_ms.iter().all(|ms| *ms <= 10_000),
        "{}",
        told.line()
    );
    assert!(
        seen.sight_ms * 100 >= seen.wanted_ms * 97,
        "{}",
        told.line()
    );
}

#[test]
fn one_uav_alone_covers_first_and_eight_cover_while_one_follows() {
    for uavs in [1, 8] {
        let outcome = tracked(uavs, 3, &[]);
        let broken = outcome.violations();
        assert!(outcome.report.completed && broken.is_empty(), "{broken:?}");
        let told = &outcome.report.tasks[0];
        let covered_ms = outcome.report.makespan_ms.unwrap();
        let first_ms = told.tracked.as_ref().and_then(|t| t.first_ms).unwrap();
        assert_eq!(first_ms > covered_ms, uavs == 1, "{}", told.line());
    }
}
