//! Stories of whole swarms on the small fixture, with every check running.

use super::*;
use crate::fault::Fault;
use crate::world::fixture;
use skein_flight::trajectory::wind::Wind;

/// The fixture without its zone: every cell of it is on the loop.
fn prepared(n_uavs: u16) -> Prepared {
    let mut spec = fixture::square(n_uavs);
    spec.zones.clear();
    let mut mission = (*spec.mission).clone();
    mission.zones.clear();
    spec.mission = Arc::new(mission);
    Prepared::new(spec)
}

fn at(at_ms: u64, fault: Fault) -> TimedFault {
    TimedFault { at_ms, fault }
}

fn completed(o: &Outcome) {
    assert!(
        o.completed && o.coverage >= 1.0,
        "seed {}: {:?}",
        o.seed,
        o.violations
    );
}

#[test]
fn three_peers_cover_the_square_and_all_know() {
    let o = prepared(3).run(1, Vec::new(), true);
    completed(&o);
    assert!(o.violation_counts.is_empty(), "{:?}", o.violations);
    let finished = o.entries.iter().filter(|e| {
        matches!(
            &e.what,
            What::Report {
                report: Report::Finished { .. },
                ..
            }
        )
    });
    assert!(finished.count() >= 3);
    assert!(o.bytes > 0 && o.peer_ms >= 3 * o.makespan_ms.unwrap());
}

#[test]
fn a_wind_costs_time_and_nothing_else() {
    let calm = prepared(3).run(1, Vec::new(), false);
    for wind in [Wind::new(2.0, 1.0), Wind::new(-1.5, 2.0)] {
        let mut spec = fixture::square(3);
        spec.wind = wind;
        let o = Prepared::new(spec).run(1, vec![at(60_000, Fault::Kill { peer: 2 })], false);
        assert!(o.completed, "{:?}", o.violations);
        assert!(o.violation_counts.is_empty(), "{:?}", o.violations);
        assert!(o.makespan_ms > calm.makespan_ms);
    }
}

#[test]
fn the_same_seed_gives_the_same_history_and_another_seed_another() {
    let prepared = prepared(3);
    let faults = vec![
        at(30_000, Fault::Kill { peer: 2 }),
        at(0, Fault::Loss { permille: 200 }),
    ];
    let run = |seed: u64| {
        let o = prepared.run(seed, faults.clone(), false);
        (o.history_hash, o.events)
    };
    let first = run(7);
    assert_eq!(first, run(7));
    assert_ne!(first.0, run(8).0);
}

#[test]
fn the_section_of_a_killed_peer_is_taken_over_and_the_story_says_by_whom() {
    let o = prepared(4).run(2, vec![at(40_000, Fault::Kill { peer: 3 })], false);
    completed(&o);
    assert_eq!(o.takeovers.len(), 1);
    let t = &o.takeovers[0];
    assert_eq!((t.dead, t.died_ms), (3, 40_000));
    assert!(
        t.cells > 0 && t.by.values().sum::<u32>() >= t.cells,
        "{t:?}"
    );
    assert!(t.detected_ms.unwrap() > 40_000 && t.taken_ms.unwrap() >= t.detected_ms.unwrap());
    assert!(
        !o.detect_ms.is_empty() && o.detect_ms.iter().all(|ms| *ms < 13_000),
        "{:?}",
        o.detect_ms
    );
}

#[test]
fn a_paused_peer_goes_on_and_a_partition_heals() {
    let faults = vec![
        at(
            20_000,
            Fault::Partition {
                groups: vec![vec![1, 2], vec![3, 4, fixture::GROUND_ID]],
            },
        ),
        at(35_000, Fault::Pause { peer: 4 }),
        at(45_000, Fault::Resume { peer: 4 }),
        at(50_000, Fault::Heal),
    ];
    let o = prepared(4).run(3, faults, true);
    completed(&o);
    let split = o
        .entries
        .iter()
        .any(|e| matches!(&e.what, What::Components(parts) if parts.len() > 1));
    assert!(split);
}

#[test]
fn a_restarted_computer_comes_back_in_a_higher_life_with_disk_and_without() {
    for fresh_disk in [false, true] {
        let faults = vec![
            at(20_000, Fault::KillComputer { peer: 1 }),
            at(
                30_000,
                Fault::Restart {
                    peer: 1,
                    fresh_disk,
                },
            ),
        ];
        let mut swarm = Swarm::new(&prepared(3), 4, faults, false);
        swarm.run_until(45_000);
        let view = swarm.view(1).unwrap();
        assert!(
            view.incarnation > 1 && view.speaks,
            "fresh disk {fresh_disk}: {view:?}"
        );
        completed(&swarm.run());
    }
}

#[test]
fn faults_that_do_not_fit_change_nothing() {
    let faults = vec![
        at(
            1_000,
            Fault::Restart {
                peer: 1,
                fresh_disk: true,
            },
        ),
        at(2_000, Fault::Resume { peer: 2 }),
        at(3_000, Fault::Kill { peer: 77 }),
        at(4_000, Fault::Heal),
    ];
    let o = prepared(2).run(5, faults, false);
    completed(&o);
    assert_eq!((o.dead, o.kills), (0, 0));
}

#[test]
fn who_is_out_of_fuel_is_gone_and_an_impossible_mission_ends_at_its_longest_time() {
    let mut spec = fixture::square(2);
    spec.max_time_s = 60;
    let o = Prepared::new(spec).run(1, Vec::new(), false);
    assert!(!o.completed && o.end_ms <= 60_000);
    assert_eq!(o.violation_counts.get("L5"), Some(&1));
}
