//! Stories told to an account as a driver would, and the same run accounted for twice.

use super::report::{KillReport, RestartReport};
use super::*;
use crate::fault::{Fault, TimedFault};
use crate::history::What;
use crate::prepared::Prepared;
use crate::runs::{self, Wanted};
use crate::world::{World, fixture};
use skein_flight::coverage::ring::Direction;
use skein_flight::coverage::ring::backtracking::Leg;
use skein_peer::PeerId;

/// Cells `first` to `first + count` of the ring, and what is held besides.
fn claim(first: u16, count: u16, held: &[u16]) -> Report {
    Report::Claim {
        counter: 1,
        epoch: 1,
        take: 0,
        legs: vec![Leg {
            first,
            count,
            direction: Direction::Forward,
        }],
        held: held.to_vec(),
        eta_ms: 0,
    }
}

fn ready(revision: u32, loop_hash: u64) -> Report {
    Report::Ready {
        revision,
        loop_hash,
        cells: 20,
    }
}

fn believes(peer: u16, incarnation: u32, status: Status) -> Report {
    Report::Membership {
        peer: PeerId(peer),
        incarnation,
        status,
    }
}

/// Two UAVs of 10 m/s and a ground station; twenty cells of 100 m, half for each.
fn two() -> Account {
    let mut a = Account::new(Setting {
        scenario: "two".to_owned(),
        seed: 7,
        uavs: BTreeMap::from([(1, 10.0), (2, 10.0)]),
        takeoffs_ms: BTreeMap::new(),
        work_m: 2_000.0,
        needed_share: 0.0,
        max_visit_ms: None,
        visits: std::collections::BTreeSet::new(),
    });
    for peer in [1, 2, 100] {
        a.started(0, peer);
        a.reported(0, peer, &Report::Booted { incarnation: 1 });
        a.reported(0, peer, &ready(1, 9));
    }
    for (by, of) in [(1, 2), (2, 1), (100, 1), (100, 2)] {
        a.reported(0, by, &believes(of, 1, Status::Alive));
    }
    a.reported(0, 1, &claim(0, 10, &[]));
    a.reported(0, 2, &claim(10, 10, &[]));
    a
}

/// The report of an account over a world in which nobody moved.
fn concluded(a: &Account, now_ms: u64) -> RunReport {
    let spec = fixture::square(2);
    let world = World::new(&spec, 1);
    a.conclude(Ending {
        now_ms,
        judge: world.judge(),
        nearest_intruder_m: world.intruders().nearest_m(),
        nearest_obstacle_m: world.unmapped().nearest_m(),
        link_cuts: (1, 2, 3),
        violations: None,
        details: Details::Live(Live::default()),
    })
}

#[test]
fn a_takeover_is_told_by_whom_how_much_and_when() {
    let mut a = two();
    a.reported(1_000, 1, &Report::Covered { cells: vec![0, 1] });
    let held = a.ended(2_000, 1, Cause::Killed);
    assert_eq!((held.cells, held.second_hand), (8, false));
    a.reported(9_000, 2, &believes(1, 1, Status::Suspect));
    a.reported(11_000, 2, &believes(1, 1, Status::Down));
    a.reported(12_000, 100, &believes(1, 1, Status::Down));
    let line = a.reported(12_500, 2, &claim(2, 18, &[])).unwrap();
    assert_eq!(
        line,
        "uav2 takes over 8 cells of uav1, 10.5 s after its end"
    );
    a.reported(20_000, 2, &Report::Covered { cells: vec![2, 3] });
    let r = concluded(&a, 30_000);
    let k = &r.kills[0];
    assert_eq!((k.peer, k.at_ms, k.cells_held, k.left), (1, 2_000, 8, 0));
    assert!((k.share_held - 0.8).abs() < 1e-9);
    assert_eq!((k.detected_by, k.detection_ms), (Some(2), Some(9_000)));
    assert_eq!(k.detections_ms, BTreeMap::from([(2, 9_000), (100, 10_000)]));
    assert_eq!(k.takeover_ms, Some(10_500));
    assert_eq!(k.taken_over_by.len(), 1);
    assert_eq!(k.flown_by, BTreeMap::from([(2, 2)]));
    assert_eq!(a.taken_over(), 8);
    // 40 m before the death, 1,980 m alone.
    assert_eq!(r.work_bound_ms, Some(2_000 + 196_000));
}

#[test]
fn what_nobody_takes_over_is_left() {
    let mut a = two();
    a.ended(0, 1, Cause::Killed);
    a.reported(5_000, 2, &claim(5, 10, &[]));
    a.reported(6_000, 2, &Report::Covered { cells: vec![4] });
    let k = &concluded(&a, 9_000).kills[0];
    assert_eq!((k.left, k.seen_in_passing, k.takeover_ms), (4, 1, None));
    assert_eq!(k.detection_ms, None, "nobody said that it noticed");
}

#[test]
fn cells_that_others_list_already_need_no_taking_over() {
    let mut a = two();
    a.reported(1_000, 2, &claim(8, 12, &[]));
    a.ended(2_000, 1, Cause::ComputerKilled);
    a.reported(3_000, 2, &claim(0, 20, &[]));
    let k = &concluded(&a, 9_000).kills[0];
    assert_eq!((k.cells_held, k.listed_already), (10, 2));
    assert_eq!(k.taken_over_by[0].cells, 8);
}

#[test]
fn a_death_of_a_peer_that_had_taken_over_is_second_hand() {
    let mut a = two();
    a.ended(2_000, 1, Cause::Killed);
    a.reported(3_000, 2, &claim(0, 20, &[]));
    assert!(a.ended(4_000, 2, Cause::Killed).second_hand);
    assert_eq!(
        a.ended(5_000, 2, Cause::Killed),
        Held::default(),
        "nobody dies twice"
    );
    assert_eq!(concluded(&a, 9_000).kills.len(), 2);
}

#[test]
fn only_the_life_that_ended_can_be_detected_and_only_until_the_next() {
    let mut a = two();
    a.reported(500, 100, &believes(1, 1, Status::Down));
    a.ended(1_000, 1, Cause::ComputerKilled);
    a.reported(2_000, 100, &believes(1, 1, Status::Down));
    a.restarted(5_000, 1, false);
    a.reported(6_000, 2, &believes(1, 1, Status::Down));
    let k = &concluded(&a, 9_000).kills[0];
    // The station held it for down before; the other one found out after its return.
    assert!(k.detections_ms.is_empty(), "{k:?}");
}

#[test]
fn a_restart_counts_as_useful_only_in_its_new_life() {
    let mut a = two();
    a.ended(1_000, 1, Cause::ComputerKilled);
    a.restarted(2_000, 1, true);
    a.reported(2_100, 1, &claim(0, 3, &[]));
    a.reported(2_500, 1, &Report::Booted { incarnation: 2 });
    a.reported(9_000, 1, &claim(0, 3, &[]));
    let r = &concluded(&a, 9_000).restarts[0];
    assert_eq!(
        (r.incarnation_before, r.incarnation_after),
        (Some(1), Some(2))
    );
    assert_eq!(r.productive_ms, Some(7_000));
}

#[test]
fn a_peer_that_comes_back_takes_its_own_cells_back() {
    let mut a = two();
    a.ended(1_000, 1, Cause::ComputerKilled);
    a.restarted(2_000, 1, false);
    a.reported(2_500, 1, &ready(1, 9));
    a.reported(3_000, 1, &claim(0, 6, &[]));
    a.reported(9_000, 2, &claim(6, 14, &[]));
    let k = &concluded(&a, 9_000).kills[0];
    assert_eq!((k.taken_back, k.taken_over_by[0].cells), (6, 4));
    assert_eq!((k.left, k.takeover_ms), (0, Some(8_000)));
}

#[test]
fn what_a_newer_mission_replaced_nobody_took_over() {
    let mut a = two();
    a.ended(1_000, 1, Cause::Killed);
    a.reported(2_000, 2, &ready(2, 10));
    a.reported(3_000, 2, &Report::Covered { cells: vec![0] });
    let k = &concluded(&a, 9_000).kills[0];
    assert_eq!((k.superseded, k.takeover_ms), (10, None));
}

#[test]
fn another_time_round_begins_with_everything_open() {
    let mut a = two();
    a.reported(
        1_000,
        1,
        &Report::Covered {
            cells: (0..10).collect(),
        },
    );
    a.reported(2_000, 1, &ready(2, 10));
    a.reported(2_100, 1, &claim(0, 10, &[]));
    // On the loop before: not comparable any more.
    a.reported(2_200, 2, &claim(0, 20, &[]));
    assert_eq!(a.ended(3_000, 1, Cause::Killed).cells, 10);
    assert_eq!(concluded(&a, 4_000).kills[0].listed_already, 0);
}

#[test]
fn a_run_passes_only_when_the_world_the_peers_and_the_driver_agree() {
    let spec = fixture::square(2);
    let mut world = World::new(&spec, 1);
    let mut a = two();
    for peer in [1, 2] {
        a.reported(1_000, peer, &Report::Finished { revision: 1 });
    }
    a.covered(1_000);
    world.advance(1_000);
    let unseen = concluded(&a, 2_000);
    assert!(unseen.completed && !unseen.passed);
    assert!(
        unseen.reasons.iter().all(|r| r.contains("were not seen")),
        "{:?}",
        unseen.reasons
    );
    // A newer mission is to be finished again.
    a.reported(2_000, 2, &ready(2, 9));
    let r = concluded(&a, 3_000);
    assert_eq!((r.finished, r.unfinished), (vec![1], vec![2]));
    assert!(!r.completed);
    a.failed("uav9 ended by itself".to_owned());
    for peer in [1, 2] {
        a.ended(4_000, peer, Cause::Killed);
    }
    let r = concluded(&a, 5_000);
    for reason in ["uav9 ended by itself", "no UAV is left"] {
        assert!(r.reasons.iter().any(|t| t == reason), "{:?}", r.reasons);
    }
}

#[test]
fn radios_of_all_lives_add_up_to_bytes_a_second_and_peer() {
    let mut a = two();
    let life = RadioCounters {
        sent: 10,
        sent_bytes: 3_000,
        received: 20,
        multi_hop: 4,
        relayed_by: vec![(2, 4)],
        bytes_by_link: vec![((2, 1), 700), ((3, 1), 90)],
        lost: vec![(skein_link::Reason::Range, 5)],
        ..RadioCounters::default()
    };
    a.radio(&life);
    a.radio(&life);
    a.ended(5_000, 2, Cause::Killed);
    let r = concluded(&a, 10_000).radio;
    assert_eq!((r.sent, r.received, r.multi_hop), (20, 40, 8));
    assert_eq!(r.relayed_by, BTreeMap::from([(2, 8)]));
    assert_eq!(r.bytes_by_link[&2], BTreeMap::from([(1, 1400)]));
    assert_eq!(r.bytes_by_link[&3], BTreeMap::from([(1, 180)]));
    assert_eq!(r.lost["range"], 10);
    assert_eq!(r.link_cuts["fault"], 3);
    // 6,000 bytes in 10 + 5 + 10 seconds.
    assert!((r.bytes_per_peer_s - 240.0).abs() < 1e-9);
}

#[test]
fn both_drivers_write_the_same_fields_in_json_and_the_same_lines_of_text() {
    let a = two();
    let live = concluded(&a, 1_000);
    let simulated = RunReport {
        driver: Driver::Sim,
        live: None,
        simulated: Some(Simulated::default()),
        ..live.clone()
    };
    let keys = |r: &RunReport| {
        let text = serde_json::to_string(r).unwrap();
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        let keys: Vec<String> = value.as_object().unwrap().keys().cloned().collect();
        (keys, value["driver"].clone())
    };
    let ((live_keys, live_driver), (sim_keys, sim_driver)) = (keys(&live), keys(&simulated));
    assert_eq!(live_keys, sim_keys);
    assert_eq!((live_driver, sim_driver), ("live".into(), "sim".into()));
    let words = |r: &RunReport| {
        let text = r.to_string();
        let first = |l: &str| l.split_whitespace().next().unwrap_or("").to_owned();
        text.lines().map(first).collect::<Vec<_>>()
    };
    let mut of_sim = words(&simulated);
    assert_eq!(of_sim.pop().as_deref(), Some("history"));
    assert_eq!(of_sim, words(&live));
}

/// What a live trial has: reports, faults, and nothing else of the peers.
#[test]
fn an_account_of_the_reports_alone_agrees_with_the_simulators() {
    let mut spec = fixture::square(4);
    spec.zones.clear();
    let mut mission = (*spec.mission).clone();
    mission.zones.clear();
    spec.mission = std::sync::Arc::new(mission);
    let prepared = Prepared::new(spec);
    let at = |at_ms: u64, fault: Fault| TimedFault { at_ms, fault };
    let faults = vec![
        at(30_000, Fault::Kill { peer: 3 }),
        at(36_000, Fault::KillComputer { peer: 1 }),
        at(
            50_000,
            Fault::Restart {
                peer: 1,
                fresh_disk: true,
            },
        ),
    ];
    let wanted = Wanted {
        events: true,
        baseline: false,
    };
    let outcome = runs::run(&prepared, 5, faults, wanted);
    let mut account = Account::new(prepared.setting(5));
    for peer in [1, 2, 3, 4, fixture::GROUND_ID] {
        account.started(0, peer);
    }
    for e in &outcome.entries {
        match &e.what {
            What::Report { peer, report } => {
                account.reported(e.time_ms, *peer, report);
            }
            What::Fault(Fault::Kill { peer }) => {
                account.ended(e.time_ms, *peer, Cause::Killed);
            }
            What::Fault(Fault::KillComputer { peer }) => {
                account.ended(e.time_ms, *peer, Cause::ComputerKilled);
            }
            What::Fault(Fault::Restart { peer, fresh_disk }) => {
                account.restarted(e.time_ms, *peer, *fresh_disk);
            }
            What::Covered => account.covered(e.time_ms),
            What::Components(parts) => {
                account.connected(parts);
            }
            _ => {}
        }
    }
    let again = concluded(&account, outcome.report.end_ms);
    let first = &outcome.report;
    assert!(
        first.passed,
        "{:?} {:?}",
        first.reasons,
        outcome.violations()
    );
    assert_eq!(first.kills.len(), 2);
    assert!(first.kills.iter().all(|k| !k.detections_ms.is_empty()));
    assert!(first.restarts[0].productive_ms.is_some(), "{first:?}");
    assert_eq!(again.kills, first.kills);
    assert_eq!(again.restarts, first.restarts);
    assert_eq!(again.finished, first.finished);
    assert_eq!(again.makespan_ms, first.makespan_ms);
    assert_eq!(
        (again.swarm.splits, again.swarm.most_components),
        (first.swarm.splits, first.swarm.most_components)
    );
}

#[test]
fn every_field_of_the_report_is_explained() {
    let mut a = two();
    a.ended(2_000, 1, Cause::Killed);
    a.reported(2_500, 2, &claim(0, 20, &[]));
    a.restarted(3_000, 1, true);
    let report = RunReport {
        simulated: Some(Simulated::default()),
        violations: Some(Violations::default()),
        ..concluded(&a, 5_000)
    };
    let text = serde_json::to_string(&report).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let explained = include_str!("../../../../docs/report.md");
    let mut unexplained = Vec::new();
    let names =
        |v: &serde_json::Value| -> Vec<String> { v.as_object().unwrap().keys().cloned().collect() };
    let objects = [
        &value,
        &value["coverage"],
        &value["kills"][0],
        &value["kills"][0]["taken_over_by"][0],
        &value["restarts"][0],
        &value["swarm"],
        &value["radio"],
        &value["violations"],
        &value["simulated"],
        &value["live"],
        &value["live"]["processes"],
    ];
    for name in objects.into_iter().flat_map(names) {
        if !explained.contains(&format!("`{name}`")) {
            unexplained.push(name);
        }
    }
    assert!(
        unexplained.is_empty(),
        "docs/report.md lacks {unexplained:?}"
    );
}

/// Two who search for as long as a mission takes come upon what they are to follow; one alone may
/// not.
#[test]
fn what_nobody_ever_followed_fails_a_run_unless_one_uav_is_left_of_several() {
    let killed = |peer| KillReport {
        peer,
        at_ms: 10_000,
        ..KillReport::default()
    };
    let again = RestartReport {
        peer: 2,
        at_ms: 20_000,
        ..RestartReport::default()
    };
    let task = TaskReport {
        tracked: Some(crate::check::tracks::Tracked::default()),
        ..TaskReport::default()
    };
    for (uavs, lost, restarts, fails) in [
        (3, &[][..], vec![], true),
        (3, &[1], vec![], true),
        (3, &[1, 2], vec![], false),
        (3, &[1, 2], vec![again], true),
        (1, &[], vec![], true),
    ] {
        let mut report = RunReport {
            uavs: (1..=uavs).collect(),
            over_ms: Some(600_000),
            kills: lost.iter().map(|peer| killed(*peer)).collect(),
            restarts,
            tasks: vec![task.clone()],
            finished: vec![3],
            ..RunReport::default()
        };
        report.judge(&[]);
        let told = report.reasons.iter().any(|r| r.contains("ever saw"));
        assert_eq!(told, fails, "{uavs} {lost:?} {:?}", report.reasons);
    }
}

#[test]
fn less_to_cover_than_asked_for_fails_a_run_unless_the_mission_was_changed_in_flight() {
    let mut report = RunReport {
        makespan_ms: Some(1),
        finished: vec![1],
        ..RunReport::default()
    };
    for (coverable_share, revised, passes) in [
        (0.97, false, true),
        (0.969, false, false),
        (0.969, true, true),
    ] {
        let coverage = &mut report.coverage;
        (coverage.coverable_share, coverage.needed_share) = (coverable_share, 0.97);
        coverage.revised = revised;
        report.judge(&[]);
        assert_eq!(report.passed, passes, "{coverable_share} {revised}");
    }
    let told = report.to_string();
    let line = "96.9 % of the area (97.0 % asked for; changed in flight)";
    assert!(told.contains(line), "{told}");
}
