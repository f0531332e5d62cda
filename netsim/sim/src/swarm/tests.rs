//! Stories of whole swarms on the small fixture, with every check running.

use super::*;
use crate::account::Cause;
use crate::fault::{Fault, Order};
use crate::runs::{self, Wanted};
use crate::world::fixture;
use skein_flight::mount::Mount;
use skein_flight::trajectory::wind::Wind;
use skein_peer::{CoverageTask, PointTask};

/// The fixture without its zone: every cell of it is on the loop.
fn prepared(n_uavs: u16) -> Prepared {
    let mut spec = fixture::square(n_uavs);
    spec.zones.clear();
    let mut mission = (*spec.mission).clone();
    mission.zones.clear();
    spec.mission = Arc::new(mission);
    Prepared::new(spec)
}

fn run(prepared: &Prepared, seed: u64, faults: Vec<TimedFault>, events: bool) -> Outcome {
    let wanted = Wanted {
        events,
        baseline: false,
    };
    runs::run(prepared, seed, faults, wanted)
}

fn at(at_ms: u64, fault: Fault) -> TimedFault {
    TimedFault { at_ms, fault }
}

fn completed(o: &Outcome) {
    let r = &o.report;
    assert!(
        r.completed && r.coverage.covered_share >= 1.0,
        "seed {}: {:?} {:?}",
        r.seed,
        r.reasons,
        o.violations()
    );
}

/// Completed, and no rule broken.
fn passed(o: &Outcome) {
    completed(o);
    assert!(
        o.report.passed,
        "{:?} {:?}",
        o.report.reasons,
        o.violations()
    );
}

/// Where all share one channel the last claims and covered cells wait for long. Everybody
/// must hear all the same that all is seen, and soon.
#[test]
fn a_crowd_in_one_earshot_ends_its_mission_and_says_so() {
    let crowd = prepared(48);
    let o = run(&crowd, 1, Vec::new(), false);
    completed(&o);
    let (seen_ms, end_ms) = (o.report.makespan_ms.unwrap(), o.report.end_ms);
    assert_eq!(o.report.finished.len(), 48);
    assert!(
        end_ms <= seen_ms + 90_000,
        "seen after {seen_ms} ms, said after {end_ms} ms"
    );
}

#[test]
fn three_peers_cover_the_square_and_all_know() {
    let o = run(&prepared(3), 1, Vec::new(), true);
    passed(&o);
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
    let r = &o.report;
    assert!(r.radio.bytes_sent > 0 && r.peer_ms >= 3 * r.makespan_ms.unwrap());
    assert_eq!(r.finished, [1, 2, 3]);
    // Nobody can be faster than the bound, and a calm swarm is not twice as slow.
    let ratio = r.makespan_over_work_bound.unwrap();
    assert!((1.0..2.0).contains(&ratio), "{ratio}");
}

#[test]
fn a_wind_costs_time_and_nothing_else() {
    let calm = run(&prepared(3), 1, Vec::new(), false);
    for wind in [Wind::new(2.0, 1.0), Wind::new(-1.5, 2.0)] {
        let mut spec = fixture::square(3);
        spec.wind = wind.into();
        let o = run(
            &Prepared::new(spec),
            1,
            vec![at(60_000, Fault::Kill { peer: 2 })],
            false,
        );
        passed(&o);
        assert!(o.report.makespan_ms > calm.report.makespan_ms);
    }
}

#[test]
fn the_same_seed_gives_the_same_history_and_another_seed_another() {
    let prepared = prepared(3);
    let faults = vec![
        at(30_000, Fault::Kill { peer: 2 }),
        at(0, Fault::Loss { permille: 200 }),
    ];
    let hash = |seed: u64| {
        let o = run(&prepared, seed, faults.clone(), false);
        (o.history_hash, o.report.simulated.unwrap().events)
    };
    let first = hash(7);
    assert_eq!(first, hash(7));
    assert_ne!(first.0, hash(8).0);
}

#[test]
fn the_section_of_a_killed_peer_is_taken_over_and_the_story_says_by_whom() {
    let o = run(
        &prepared(4),
        2,
        vec![at(40_000, Fault::Kill { peer: 3 })],
        false,
    );
    completed(&o);
    assert_eq!(o.report.kills.len(), 1);
    let k = &o.report.kills[0];
    assert_eq!((k.peer, k.at_ms, k.cause), (3, 40_000, Cause::Killed));
    let taken: usize = k.taken_over_by.iter().map(|t| t.cells).sum();
    assert!(k.cells_held > 0 && k.left == 0, "{k:?}");
    assert_eq!(taken + k.listed_already + k.seen_in_passing, k.cells_held);
    assert!(k.takeover_ms.unwrap() >= k.detection_ms.unwrap(), "{k:?}");
    // Three UAVs and the ground station find out.
    assert_eq!(k.detections_ms.len(), 4, "{k:?}");
    assert!(k.detections_ms.values().all(|ms| *ms < 13_000), "{k:?}");
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
    let o = run(&prepared(4), 3, faults, true);
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
    let o = run(&prepared(2), 5, faults, false);
    completed(&o);
    assert_eq!((o.dead, o.report.kills.len()), (0, 0));
}

#[test]
fn an_impossible_mission_ends_at_its_longest_time() {
    let mut spec = fixture::square(2);
    spec.max_time_s = 60;
    let o = run(&Prepared::new(spec), 1, Vec::new(), false);
    assert!(!o.report.completed && o.report.end_ms <= 60_000);
    assert_eq!(o.report.violations.unwrap().counts.get("L5"), Some(&1));
}

#[test]
fn whoever_flies_home_in_time_has_landed_when_its_fuel_ends_and_the_others_finish() {
    let short = Fault::ShortFuel {
        peer: 2,
        lasts_ms: 130_000,
    };
    let o = run_with(3, 1, vec![at(0, short)]);
    passed(&o);
    assert!(o.report.end_ms > 130_000);
    let k = &o.report.kills[0];
    assert_eq!((k.peer, k.cause), (2, Cause::Landed), "{k:?}");
    assert!(
        (129_000..131_000).contains(&k.at_ms) && k.left == 0,
        "{k:?}"
    );
}

#[test]
fn whoever_runs_out_of_fuel_on_its_way_is_lost_and_the_run_has_failed() {
    let short = Fault::ShortFuel {
        peer: 2,
        lasts_ms: 60_000,
    };
    let faults = vec![at(0, short), at(20_000, Fault::KillComputer { peer: 2 })];
    let o = run_with(3, 1, faults);
    completed(&o);
    let lost = |r: &String| r.contains("uav2 is lost");
    assert!(o.report.reasons.iter().any(lost), "{:?}", o.report.reasons);
}

#[test]
fn storms_of_every_kind_of_trouble_break_no_rule() {
    let prepared = prepared(5);
    let free_ms = runs::failure_free_makespan_ms(&prepared);
    let mut struck = std::collections::BTreeSet::new();
    for seed in 4..64 {
        let o = runs::storm(&prepared, seed, free_ms, Wanted::default());
        assert!(
            o.report.passed,
            "{seed}: {:?} {:?}",
            o.report.reasons,
            o.violations()
        );
        struck.extend(o.struck);
    }
    let all = crate::troubles::KINDS.iter().map(|k| k.name);
    let missing: Vec<&str> = all.filter(|kind| !struck.contains(kind)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn another_mission_in_flight_is_covered_and_checked_to_the_end() {
    let half = vec![(0, 0), (240_000, 0), (240_000, 384_000), (0, 384_000)];
    let block = vec![
        (96_000, 144_000),
        (126_000, 144_000),
        (126_000, 174_000),
        (96_000, 174_000),
    ];
    let whole = fixture::square(5).mission.area.clone();
    for (area, zones, cells) in [(half, Vec::new(), 40), (whole, vec![block], 80)] {
        let task = None;
        let fault = Fault::Revise { area, zones, task };
        let o = run_with(
            5,
            3,
            vec![at(30_000, fault), at(60_000, Fault::Kill { peer: 2 })],
        );
        passed(&o);
        assert_eq!(o.report.coverage.cells, cells);
        assert_eq!(o.report.work_bound_ms, None);
    }
    // Beyond the first area, and targets in place of it.
    let beyond = vec![
        (240_000, 0),
        (720_000, 0),
        (720_000, 384_000),
        (240_000, 384_000),
    ];
    let point = |at| PointTask {
        at,
        radius_mm: 2_000,
    };
    let points = [(50_000, 60_000), (300_000, 90_000), (600_000, 200_000)].map(point);
    let points = CoverageTask::Points(points.to_vec());
    for (task, cells) in [(None, 80), (Some(points), 3)] {
        let (area, zones) = (beyond.clone(), Vec::new());
        let fault = Fault::Revise { area, zones, task };
        let o = run_with(5, 3, vec![at(30_000, fault)]);
        passed(&o);
        assert_eq!(o.report.coverage.cells, cells);
    }
    // What cannot be flown an operator's console refuses.
    let nowhere = Fault::Revise {
        area: vec![(0, 0), (10, 0), (0, 10)],
        zones: Vec::new(),
        task: None,
    };
    let o = run_with(5, 3, vec![at(30_000, nowhere)]);
    passed(&o);
    assert_eq!(o.report.coverage.cells, 80);
}

/// What is asked for follows the zones that the operator adds and takes away, and nobody enters
/// one that it could turn away from.
#[test]
fn a_zone_that_is_added_in_flight_is_kept_clear_of_and_opens_its_cells_again() {
    let ring = vec![
        (96_000, 144_000),
        (126_000, 144_000),
        (126_000, 174_000),
        (96_000, 174_000),
    ];
    let add = |at_ms| {
        let (name, ring) = ("fire".to_owned(), ring.clone());
        at(at_ms, Fault::AddZone { name, ring })
    };
    let gone = |at_ms| {
        at(
            at_ms,
            Fault::RemoveZone {
                name: "fire".to_owned(),
            },
        )
    };
    let whole = run_with(5, 3, vec![]).report.coverage.coverable_cells;
    for (faults, reopened) in [
        (vec![add(30_000)], false),
        (
            vec![add(30_000), at(60_000, Fault::Kill { peer: 2 })],
            false,
        ),
        (vec![add(20_000), gone(45_000)], true),
        // What is not there cannot be taken away.
        (vec![gone(20_000)], true),
    ] {
        for seed in [3, 4] {
            let o = run_with(5, seed, faults.clone());
            passed(&o);
            let coverable = o.report.coverage.coverable_cells;
            assert!(
                coverable <= whole && (!reopened || coverable == whole),
                "{coverable} of {whole}"
            );
        }
    }
}

fn run_with(n_uavs: u16, seed: u64, faults: Vec<TimedFault>) -> Outcome {
    run(&prepared(n_uavs), seed, faults, true)
}

/// Reports of one kind by one peer, as far as `wanted` takes them.
fn reports(o: &Outcome, by: u16, wanted: impl Fn(&Report) -> bool) -> Vec<u64> {
    let of = |e: &crate::history::Entry| match &e.what {
        What::Report { peer, report } if *peer == by && wanted(report) => Some(e.time_ms),
        _ => None,
    };
    o.entries.iter().filter_map(of).collect()
}

#[test]
fn a_peer_whose_disk_takes_no_writes_says_so_and_is_of_use_again_when_it_does() {
    let faults = vec![
        at(20_000, Fault::FailStores { peer: 2, one_in: 1 }),
        at(50_000, Fault::HealStores { peer: 2 }),
    ];
    let o = run_with(3, 6, faults);
    passed(&o);
    let alarms = reports(
        &o,
        2,
        |r| matches!(r, Report::Alarm { text } if text.contains("journal")),
    );
    assert!(!alarms.is_empty(), "a write failed and nobody was told");
    assert!(
        alarms.iter().all(|t| (20_000..51_000).contains(t)),
        "{alarms:?}"
    );
}

#[test]
fn who_could_write_down_no_life_joins_nobody_until_it_can() {
    let faults = vec![
        at(
            0,
            Fault::FailStores {
                peer: 100,
                one_in: 1,
            },
        ),
        at(40_000, Fault::HealStores { peer: 100 }),
    ];
    let o = run_with(2, 6, faults);
    passed(&o);
    let has_station = |e: &crate::history::Entry| match &e.what {
        What::Components(all) => Some((e.time_ms, all.iter().flatten().any(|id| *id == 100))),
        _ => None,
    };
    let seen: Vec<(u64, bool)> = o.entries.iter().filter_map(has_station).collect();
    let first_ms = seen
        .iter()
        .find(|(t, there)| *there && *t > 1_000)
        .map(|s| s.0);
    assert!(first_ms.is_some_and(|t| t >= 40_000), "{seen:?}");
}

#[test]
fn what_a_slow_disk_holds_up_is_spoken_late_and_breaks_no_rule() {
    let slow = Fault::SlowStores {
        peer: 2,
        delay_ms: 3_000,
    };
    let claims = |o: &Outcome| {
        reports(
            o,
            2,
            |r| matches!(r, Report::Claim { legs, .. } if !legs.is_empty()),
        )
    };
    let (quick, late) = (
        run_with(3, 6, Vec::new()),
        run_with(3, 6, vec![at(0, slow)]),
    );
    passed(&quick);
    passed(&late);
    let (quick, late) = (claims(&quick), claims(&late));
    // Its bid and its section are written before they are spoken.
    assert!(late[0] > quick[0] + 3_000, "{late:?} {quick:?}");
}

#[test]
fn a_slow_computer_slows_the_swarm_and_breaks_no_rule() {
    let slow = Fault::SlowComputer {
        peer: 3,
        delay_ms: 700,
    };
    let quick = Fault::SlowComputer {
        peer: 3,
        delay_ms: 0,
    };
    let o = run_with(3, 8, vec![at(15_000, slow.clone()), at(45_000, quick)]);
    passed(&o);
    // Late ends are late: with a computer that stays slow the last report comes later.
    let ready = |o: &Outcome| reports(o, 3, |r| matches!(r, Report::Ready { .. }))[0];
    let slow = run_with(3, 8, vec![at(0, slow)]);
    completed(&slow);
    assert!(
        ready(&slow) >= ready(&o) + 500,
        "{} {}",
        ready(&slow),
        ready(&o)
    );
}

#[test]
fn clocks_that_drift_and_jump_end_nobody() {
    let faults = vec![
        at(
            5_000,
            Fault::ClockDrift {
                peer: 1,
                ppm: 20_000,
            },
        ),
        at(
            5_000,
            Fault::ClockDrift {
                peer: 2,
                ppm: -20_000,
            },
        ),
        at(
            30_000,
            Fault::ClockJump {
                peer: 3,
                ahead_ms: 1_500,
            },
        ),
    ];
    let o = run_with(3, 9, faults);
    passed(&o);
    assert!(o.false_downs().is_empty(), "{:?}", o.false_downs());
}

#[test]
fn a_peer_that_is_heard_and_hears_nobody_comes_back() {
    let deaf = |tx: u16| {
        at(
            30_000,
            Fault::Cut {
                a: tx,
                b: 3,
                one_way: true,
            },
        )
    };
    let mut faults: Vec<TimedFault> = [1, 2, fixture::GROUND_ID].map(deaf).into();
    faults.push(at(50_000, Fault::Heal));
    let o = run_with(3, 10, faults);
    completed(&o);
    // It took the others for dead, and they knew it alive all the time.
    let downs = |by: u16| reports(&o, by, is_down).len();
    assert!(downs(3) >= 2, "{}", downs(3));
    assert_eq!(downs(1) + downs(2), 0);
}

fn is_down(r: &Report) -> bool {
    use skein_peer::output::Status;
    matches!(
        r,
        Report::Membership {
            status: Status::Down,
            ..
        }
    )
}

#[test]
fn an_order_to_hold_stops_the_work_until_it_is_to_go_on() {
    let faults = vec![
        at(
            30_000,
            Fault::Order {
                order: Order::Hold,
                uav: None,
            },
        ),
        at(
            90_000,
            Fault::Order {
                order: Order::Resume,
                uav: None,
            },
        ),
    ];
    let mut swarm = Swarm::new(&prepared(3), 11, faults, false);
    let covered = |s: &mut Swarm, until_ms: u64| {
        s.run_until(until_ms);
        s.air.judge().n_covered()
    };
    let (early, held, late) = (
        covered(&mut swarm, 29_000),
        covered(&mut swarm, 45_000),
        covered(&mut swarm, 89_000),
    );
    assert!(early > 0 && early <= held);
    assert_eq!(held, late, "all UAVs circle");
    let o = swarm.run();
    completed(&o);
    assert!(o.report.makespan_ms.unwrap() > 90_000);
}

#[test]
fn an_order_to_return_brings_all_uavs_to_the_base() {
    let order = Order::ReturnToBase;
    let mut swarm = Swarm::new(
        &prepared(3),
        12,
        vec![at(30_000, Fault::Order { order, uav: None })],
        false,
    );
    swarm.run_until(120_000);
    let (east_mm, north_mm) = swarm.operator.mission().base;
    for id in [1, 2, 3] {
        let pose = swarm.pose(id).unwrap();
        let away_m = (pose.east_m - f64::from(east_mm) / 1000.0)
            .hypot(pose.north_m - f64::from(north_mm) / 1000.0);
        // Two turn radii of the fixture's airframe, and room for the way in.
        assert!(away_m < 120.0, "uav{id} is {away_m:.0} m from the base");
    }
}

/// One of three is told to return and later to go on; the others fly its part meanwhile.
#[test]
fn an_order_to_one_brings_it_home_while_the_others_finish_its_part() {
    let to = |order| Fault::Order {
        order,
        uav: Some(2),
    };
    let faults = vec![at(30_000, to(Order::ReturnToBase))];
    let mut swarm = Swarm::new(&prepared(3), 14, faults.clone(), false);
    swarm.run_until(40_000);
    let beliefs = |swarm: &Swarm, id| {
        let peer = swarm.peers[swarm.peer_idx(id).unwrap()].peer.as_ref();
        peer.unwrap().beliefs()
    };
    assert!(beliefs(&swarm, 2).plan.is_empty() && beliefs(&swarm, 2).order == Order::ReturnToBase);
    assert_eq!(beliefs(&swarm, 1).order, Order::Resume);
    passed(&swarm.run());
    // And with three again.
    let again = vec![faults[0].clone(), at(70_000, to(Order::Resume))];
    passed(&Swarm::new(&prepared(3), 14, again, false).run());
}

#[test]
fn a_ground_station_that_is_restarted_takes_part_again() {
    for fresh_disk in [false, true] {
        let station = fixture::GROUND_ID;
        let faults = vec![
            at(25_000, Fault::Kill { peer: station }),
            at(
                40_000,
                Fault::Restart {
                    peer: station,
                    fresh_disk,
                },
            ),
        ];
        let o = run_with(3, 13, faults);
        passed(&o);
        let k = &o.report.kills[0];
        assert_eq!((k.peer, k.cells_held), (station, 0));
        assert_eq!(k.detections_ms.len(), 3, "{k:?}");
        let ready = reports(&o, station, |r| matches!(r, Report::Ready { .. }));
        assert!(ready.iter().any(|t| *t > 40_000), "{ready:?}");
    }
}

#[test]
fn a_peer_that_stands_still_is_silent_and_is_missed() {
    let faults = vec![
        at(30_000, Fault::Pause { peer: 4 }),
        at(60_000, Fault::Resume { peer: 4 }),
    ];
    let o = run(&prepared(4), 3, faults, true);
    completed(&o);
    let missed = o.entries.iter().any(|e| {
        let told = match &e.what {
            What::Report { report, .. } => report,
            _ => return false,
        };
        matches!(told, Report::Membership { peer, status, .. }
            if peer.0 == 4 && *status == skein_peer::output::Status::Down)
    });
    assert!(missed, "nobody missed it");
}

fn twin(peer: u16, aboard: bool) -> Fault {
    Fault::Twin { peer, aboard }
}

/// Who is silent since a twin speaks, and who speaks again after it, by number.
fn voices(o: &Outcome) -> Vec<(u16, bool)> {
    let told = o.entries.iter().filter_map(|e| match &e.what {
        What::Report { peer, report } => match report {
            Report::Silenced => Some((*peer, false)),
            Report::Booted { .. } => Some((*peer, true)),
            _ => None,
        },
        _ => None,
    });
    // A life that begins before is no news.
    let mut silent = std::collections::BTreeSet::new();
    told.filter(|(peer, voice)| {
        if *voice {
            silent.remove(peer)
        } else {
            silent.insert(*peer)
        }
    })
    .collect()
}

#[test]
fn a_second_uav_under_one_id_is_silent_and_the_mission_goes_on() {
    for seed in 1..4 {
        let o = run(&prepared(4), seed, vec![at(40_000, twin(2, false))], true);
        passed(&o);
        // The number of the twin is the first one that is free.
        assert_eq!(voices(&o), [(5, false)], "seed {seed}");
        let reports = |e: &&crate::history::Entry| {
            matches!(
                &e.what,
                What::Report {
                    peer: 5,
                    report: Report::Claim { .. }
                }
            )
        };
        assert!(!o.entries.iter().any(|e| reports(&e)));
    }
}

#[test]
fn a_twin_takes_the_place_of_one_that_is_lost() {
    let faults = vec![
        at(30_000, twin(2, false)),
        at(60_000, Fault::Kill { peer: 2 }),
    ];
    let o = run(&prepared(3), 2, faults, true);
    passed(&o);
    assert_eq!(voices(&o), [(4, false), (4, true)]);
    let covers = |e: &crate::history::Entry| {
        matches!(
            &e.what,
            What::Report {
                peer: 4,
                report: Report::Covered { .. }
            }
        )
    };
    assert!(o.entries.iter().any(covers), "it works under the id");
}

#[test]
fn twins_on_two_sides_of_a_partition_both_speak_until_it_heals() {
    let split = |groups: Vec<Vec<u16>>| Fault::Partition { groups };
    let faults = vec![
        at(20_000, split(vec![vec![1, 2, 100], vec![3, 4, 5]])),
        at(21_000, twin(2, false)),
        at(80_000, Fault::Heal),
    ];
    let o = run(&prepared(4), 5, faults, true);
    passed(&o);
    let silenced: Vec<(u16, bool)> = voices(&o).into_iter().filter(|v| !v.1).collect();
    assert_eq!(silenced.len(), 1, "{:?}", voices(&o));
}

/// Two programs in one airframe: the first goes on flying it, and nobody notices the second.
#[test]
fn a_second_program_in_an_airframe_is_silent_and_flies_nothing() {
    for seed in 1..4 {
        let o = run(&prepared(4), seed, vec![at(40_000, twin(2, true))], true);
        passed(&o);
        assert_eq!(voices(&o), [(5, false)], "seed {seed}");
        assert_eq!(o.dead, 0);
    }
}

#[test]
fn a_second_program_takes_over_the_airframe_when_the_first_one_ends() {
    let covers = |o: &Outcome, from_ms: u64| {
        let by_second = |e: &crate::history::Entry| {
            let covered = matches!(
                &e.what,
                What::Report {
                    peer: 4,
                    report: Report::Covered { .. }
                }
            );
            covered && e.time_ms > from_ms
        };
        o.entries.iter().any(by_second)
    };
    for (fault, voices_of) in [
        // The program alone: the other one comes back in a later life, in the same airframe.
        (Fault::KillComputer { peer: 2 }, vec![(4, false), (4, true)]),
        // It stands still for a while, and finds that it has been replaced.
        (
            Fault::Pause { peer: 2 },
            vec![(4, false), (4, true), (2, false)],
        ),
        // With the airframe both are gone.
        (Fault::Kill { peer: 2 }, vec![(4, false)]),
    ] {
        let faults = vec![
            at(20_000, twin(2, true)),
            at(35_000, fault.clone()),
            at(80_000, Fault::Resume { peer: 2 }),
        ];
        let o = run(&prepared(3), 2, faults, true);
        passed(&o);
        assert_eq!(voices(&o), voices_of, "{fault}");
        let goes_on = voices_of.contains(&(4, true));
        assert_eq!(covers(&o, 60_000), goes_on, "{fault}");
    }
}

#[test]
fn no_program_is_started_in_an_airframe_that_is_gone() {
    let faults = vec![
        at(20_000, Fault::Kill { peer: 2 }),
        at(30_000, twin(2, true)),
    ];
    let o = run(&prepared(3), 2, faults, true);
    passed(&o);
    let booted = |e: &crate::history::Entry| {
        matches!(
            &e.what,
            What::Report {
                peer: 4,
                report: Report::Booted { .. }
            }
        )
    };
    assert!(!o.entries.iter().any(booted));
    assert_eq!(o.dead, 1);
}

/// Cameras fixed to the airframe, and peers who know it or take them for level.
fn with_fixed_cameras(know_it: bool) -> Vec<String> {
    let mut spec = fixture::square(2);
    spec.zones.clear();
    let mut mission = (*spec.mission).clone();
    mission.zones.clear();
    spec.mission = Arc::new(mission);
    for u in &mut spec.uavs {
        u.airframe.mount = Mount::Fixed;
    }
    let prepared = Prepared::new(spec);
    let mut swarm = Swarm::new(&prepared, 1, Vec::new(), false);
    for peer in swarm.peers.iter_mut().filter(|_| !know_it) {
        if let Some(airframe) = &mut peer.config.airframe {
            airframe.mount = Mount::Level;
        }
    }
    swarm.run_until(300_000);
    assert!(swarm.covered_share() > 0.2, "{}", swarm.covered_share());
    let broken = swarm.checker().found.counts.keys();
    broken.map(|rule| (*rule).to_string()).collect()
}

/// The loop is seen in turns, too, where a fixed camera looks elsewhere: who ignores its bank
/// marks what no camera saw, and who does not says nothing wrong.
#[test]
fn who_ignores_the_bank_claims_what_no_camera_saw() {
    assert!(with_fixed_cameras(false).iter().any(|rule| rule == "S6"));
    let knowing = with_fixed_cameras(true);
    assert!(!knowing.iter().any(|rule| rule == "S6"), "{knowing:?}");
}

/// The fixture in two layers, with sensors that see all others.
fn in_layers(n_uavs: u16) -> Spec {
    let mut spec = (*prepared(n_uavs).spec).clone();
    let mut mission = (*spec.mission).clone();
    mission.further_laps = 1;
    mission.layers = Some(Arc::new(skein_peer::layers::Layers {
        heights_mm: vec![45_000, 85_000],
        slot_mm: 5_000,
        slots: n_uavs,
        fastest_mmps: 16_000,
    }));
    spec.mission = Arc::new(mission);
    (spec.traffic_range_m, spec.min_separation_m) = (5_000.0, 2.0);
    spec
}

#[test]
fn a_volume_is_seen_layer_by_layer_and_climbs_are_judged() {
    for n_uavs in [1, 3] {
        let o = run(&Prepared::new(in_layers(n_uavs)), 1, Vec::new(), false);
        passed(&o);
        let seen: Vec<u64> = o.report.layers.iter().filter_map(|l| l.seen_ms).collect();
        assert!(seen.len() == 2 && seen[0] + 60_000 < seen[1], "{seen:?}");
    }
}

/// Peers that know nothing of layers see all twice from one height, and say that they are done.
#[test]
fn who_marks_cells_at_the_wrong_height_breaks_the_rule() {
    let layered = Prepared::new(in_layers(2));
    let mut flat = in_layers(2);
    let mission = skein_peer::Mission {
        layers: None,
        ..(*flat.mission).clone()
    };
    flat.mission = Arc::new(mission);
    flat.max_time_s = 900;
    let mut swarm = Swarm::new(&Prepared::new(flat), 1, Vec::new(), false);
    swarm.air = Air::new(&layered, 1);
    let o = swarm.run();
    let counts = &o.report.violations.as_ref().unwrap().counts;
    assert!(
        counts.contains_key("layers") && counts.contains_key("S6"),
        "{counts:?}"
    );
    let told = o.violations().iter().find(|v| v.check == "layers").unwrap();
    assert!(
        told.text
            .contains("80 cells of lap 2 were not seen from the layer at 85 m"),
        "{told}"
    );
    assert!(
        !o.report.passed
            && o.report.layers[0].seen_ms.is_some()
            && o.report.layers[1].lacking == 80
    );
}
