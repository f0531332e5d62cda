//! Tasks other than coverage, asked for in flight: who does them, what is said, and that all
//! cells are seen all the same.

use super::{add, covered, edit, point, record, with_operator};
use crate::input::{NewTask, TaskEdit};
use crate::output::{Report, TaskNews};
use crate::task_desk::TaskView;
use crate::testing::{GROUND_STATION, Harness, mission};
use crate::why::Reason;
use crate::wire::codec::Body;
use crate::wire::kinds::Kind;
use crate::wire::tasks::{Progress, TaskKind, TaskState};

fn view(h: &Harness, at: u16, name: &str) -> Option<TaskView> {
    let tasks = h.why(at).tasks;
    tasks.into_iter().find(|t| t.name == name)
}

fn state(h: &Harness, at: u16, name: &str) -> Option<TaskState> {
    view(h, at, name).map(|t| t.state)
}

/// Who says to have seen all of a task.
fn doers(h: &mut Harness, uavs: u16, name: &str) -> Vec<u16> {
    let seen = |(_, r): &(u64, Report)| matches!(r, Report::Task { name: n, news: TaskNews::Seen, .. } if n == name);
    let times = |h: &mut Harness, id| h.seat(id).reports.iter().filter(|r| seen(r)).count();
    (1..=uavs).flat_map(|id| vec![id; times(h, id)]).collect()
}

fn all_finished(h: &Harness, uavs: impl IntoIterator<Item = u16>) -> bool {
    uavs.into_iter().all(|id| h.beliefs(id).finished)
}

#[test]
fn one_uav_does_a_task_between_its_cells_and_says_who_did_it() {
    let mut h = with_operator(1, mission(1, 8, 4));
    h.run_s(20);
    let before = covered(&h, 1);
    add(&mut h, point("gate", 560.0, 250.0));
    assert!(h.run_until(30, |h| h.why(1).work.unwrap().reason == Reason::Task));
    assert!(h.run_until(120, |h| state(h, GROUND_STATION, "gate")
        == Some(TaskState::Done)));
    assert!(covered(&h, 1) >= before);
    let told = view(&h, GROUND_STATION, "gate").unwrap();
    assert_eq!((told.done_by, told.held_by.len()), (Some(1), 0));
    assert!(told.over_after_ms.unwrap() < 120_000);
    assert!(h.run_until(400, |h| all_finished(h, [1])));
    assert_eq!(doers(&mut h, 1, "gate"), [1]);
}

#[test]
fn of_two_the_nearer_does_it_and_both_keep_their_sections() {
    let mut h = with_operator(2, mission(1, 10, 6));
    h.run_s(30);
    let at = h.pose(2).position();
    add(&mut h, point("near-2", at.x, at.y));
    assert!(h.run_until(120, |h| state(h, 1, "near-2") == Some(TaskState::Done)));
    assert_eq!(doers(&mut h, 2, "near-2"), [2]);
    assert!(h.run_until(600, |h| all_finished(h, [1, 2])));
    assert_eq!(
        h.beliefs(1).covered.count(),
        h.beliefs(1).covered.capacity()
    );
}

#[test]
fn while_no_task_is_open_nothing_is_said_of_tasks() {
    let mut h = with_operator(3, mission(1, 8, 6));
    h.run_s(60);
    let said = |h: &mut Harness| {
        (1..=3)
            .map(|id| h.count_said(id, Kind::Bundle))
            .sum::<usize>()
    };
    assert_eq!(said(&mut h), 0);
    add(&mut h, point("a", 100.0, 100.0));
    assert!(h.run_until(200, |h| state(h, GROUND_STATION, "a")
        == Some(TaskState::Done)));
    h.run_s(10);
    let after = said(&mut h);
    assert!(after > 0 && after <= 15, "{after}");
    h.run_s(60);
    assert_eq!(said(&mut h), after);
}

#[test]
fn the_task_of_a_uav_that_dies_is_done_by_another() {
    let mut h = with_operator(2, mission(1, 10, 6));
    h.run_s(20);
    add(&mut h, point("far", 900.0, 600.0));
    let flies = |h: &Harness, id| h.why(id).work.is_some_and(|w| w.reason == Reason::Task);
    assert!(h.run_until(30, |h| flies(h, 1) || flies(h, 2)));
    let (first, other) = if flies(&h, 1) { (1, 2) } else { (2, 1) };
    h.stop(first);
    assert!(h.run_until(60, |h| flies(h, other)));
    assert!(h.run_until(200, |h| state(h, GROUND_STATION, "far")
        == Some(TaskState::Done)));
    let told = view(&h, GROUND_STATION, "far").unwrap();
    assert_eq!(told.done_by, Some(other));
    assert!(h.run_until(800, |h| all_finished(h, [other])));
}

#[test]
fn a_task_that_is_cancelled_or_late_is_left_and_the_mission_ends() {
    for late in [false, true] {
        let mut h = with_operator(1, mission(1, 6, 4));
        h.run_s(15);
        let within_ms = late.then_some(12_000);
        add(
            &mut h,
            NewTask {
                within_ms,
                ..point("far", 2_500.0, 0.0)
            },
        );
        assert!(h.run_until(11, |h| h.why(1).work.unwrap().reason == Reason::Task));
        if !late {
            edit(&mut h, TaskEdit::Cancel("far".into()));
        }
        assert!(h.run_until(20, |h| h.why(1).work.unwrap().reason == Reason::Plan));
        let over = if late {
            TaskState::Expired
        } else {
            TaskState::Cancelled
        };
        for id in [1, GROUND_STATION] {
            assert_eq!(state(&h, id, "far"), Some(over));
        }
        assert!(h.run_until(400, |h| all_finished(h, [1])));
        assert_eq!(doers(&mut h, 1, "far"), Vec::<u16>::new());
    }
}

#[test]
fn what_needs_a_sensor_that_nobody_carries_is_said_and_keeps_nobody() {
    let mut h = with_operator(2, mission(1, 6, 4));
    h.run_s(15);
    add(
        &mut h,
        NewTask {
            sensor: 2,
            ..point("heat", 100.0, 100.0)
        },
    );
    assert!(h.run_until(300, |h| all_finished(h, [1, 2])));
    let told = view(&h, GROUND_STATION, "heat").unwrap();
    assert_eq!(told.nobody_can.as_deref(), Some("no UAV carries infrared"));
    let said = h.seat(1).reports.iter().filter(|(_, r)| {
        matches!(r, Report::Task { news: TaskNews::NobodyCan(why), .. } if why.contains("infrared"))
    });
    assert_eq!(said.count(), 1);
}

#[test]
fn who_has_finished_and_is_asked_again_flies_once_more() {
    let mut h = with_operator(2, mission(1, 4, 4));
    assert!(h.run_until(300, |h| all_finished(h, [1, 2])));
    add(&mut h, point("again", 100.0, 100.0));
    assert!(h.run_until(30, |h| !all_finished(h, [1, 2])));
    assert!(h.run_until(200, |h| all_finished(h, [1, 2])));
    assert_eq!(state(&h, GROUND_STATION, "again"), Some(TaskState::Done));
    assert_eq!(doers(&mut h, 2, "again").len(), 1);
}

#[test]
fn a_line_is_flown_along_and_many_tasks_are_shared() {
    let mut h = with_operator(3, mission(1, 8, 8));
    h.run_s(20);
    add(
        &mut h,
        NewTask {
            kind: TaskKind::Line,
            places: vec![(20_000, 500_000), (200_000, 520_000), (350_000, 460_000)],
            radius_mm: 2_000,
            ..point("road", 0.0, 0.0)
        },
    );
    for k in 0..6 {
        add(&mut h, point(&format!("p{k}"), 60.0 * f64::from(k), -80.0));
    }
    let names: Vec<String> = (0..6)
        .map(|k| format!("p{k}"))
        .chain(["road".into()])
        .collect();
    let done = |h: &Harness| {
        let done = |n: &String| state(h, GROUND_STATION, n) == Some(TaskState::Done);
        names.iter().all(done)
    };
    assert!(h.run_until(500, done), "{:?}", h.why(GROUND_STATION).tasks);
    assert!(h.run_until(900, |h| all_finished(h, [1, 2, 3])));
    for name in &names {
        assert_eq!(doers(&mut h, 3, name).len(), 1, "{name}");
    }
}

/// Tasks change while it is far along a line: another one is nearer to where that begins.
#[test]
fn who_is_in_the_midst_of_a_line_flies_it_to_its_end() {
    let mut h = with_operator(2, mission(1, 6, 4));
    assert!(h.run_until(400, |h| all_finished(h, [1, 2])));
    add(
        &mut h,
        NewTask {
            kind: TaskKind::Line,
            places: vec![(20_000, 440_000), (2_500_000, 440_000)],
            radius_mm: 2_000,
            ..point("road", 0.0, 0.0)
        },
    );
    let begun = |h: &Harness| {
        let held = view(h, GROUND_STATION, "road").map(|road| road.held_by);
        let mut held = held.into_iter().flatten();
        held.find(|t| t.progress == Progress::Begun).map(|t| t.uav)
    };
    assert!(h.run_until(300, |h| begun(h).is_some()));
    let first = begun(&h).unwrap();
    h.run_s(80);
    assert_eq!(begun(&h), Some(first));
    let at = h.pose(first).position();
    add(
        &mut h,
        NewTask {
            worth: 1,
            ..point("by-the-way", at.x, at.y)
        },
    );
    assert!(h.run_until(500, |h| state(h, GROUND_STATION, "road")
        == Some(TaskState::Done)));
    assert_eq!(doers(&mut h, 2, "road"), [first]);
    let left = |(_, r): &(u64, Report)| matches!(r, Report::Task { name, news: TaskNews::Left, .. } if name == "road");
    assert!(!h.seat(first).reports.iter().any(left));
}

#[test]
fn words_that_cannot_be_carried_out_are_refused_with_the_reason() {
    let mut h = with_operator(1, mission(1, 6, 4));
    h.run_s(10);
    add(&mut h, point("gate", 100.0, 100.0));
    for (task, why) in [
        (TaskEdit::Add(point("gate", 1.0, 1.0)), "is open already"),
        (
            TaskEdit::Add(point("a b", 1.0, 1.0)),
            "is no name of a task",
        ),
        (TaskEdit::Cancel("door".into()), "there are: gate"),
        (TaskEdit::Done("door".into()), "there are: gate"),
        (
            TaskEdit::Add(NewTask {
                radius_mm: 90_000,
                ..point("wide", 0.0, 0.0)
            }),
            "larger than what one frame of the camera holds",
        ),
        (
            TaskEdit::Add(NewTask {
                worth: 0,
                ..point("none", 0.0, 0.0)
            }),
            "worth",
        ),
        (
            TaskEdit::Add(NewTask {
                kind: TaskKind::Track,
                ..point("truck", 15_000.0, 0.0)
            }),
            "expected one nearer to the base",
        ),
    ] {
        edit(&mut h, task);
        let alarm = h.alarms(GROUND_STATION).pop().unwrap_or_default();
        assert!(alarm.contains(why), "{alarm}");
    }
}

#[test]
fn who_cancels_the_first_task_of_a_target_cancels_those_beside_it() {
    let mut h = with_operator(1, mission(1, 8, 6));
    h.run_s(10);
    let car = |name: &str, east_m: f64| NewTask {
        kind: TaskKind::Track,
        radius_mm: 0,
        ..point(name, east_m, 100.0)
    };
    for (name, east_m) in [
        ("car", 100.0),
        ("car.2", 100.0),
        ("car.3", 100.0),
        ("van", 90.0),
    ] {
        add(&mut h, car(name, east_m));
    }
    let open = |h: &Harness| {
        ["car", "car.2", "car.3", "van"]
            .map(|n| state(h, GROUND_STATION, n) == Some(TaskState::Open))
    };
    edit(&mut h, TaskEdit::Cancel("car.2".into()));
    assert_eq!(open(&h), [true, false, true, true]);
    edit(&mut h, TaskEdit::Cancel("car".into()));
    assert_eq!(open(&h), [false, false, false, true]);
}

#[test]
fn what_was_done_on_the_ground_nobody_flies_for() {
    let mut h = with_operator(2, mission(1, 8, 4));
    h.run_s(20);
    add(&mut h, point("far", 2_500.0, 0.0));
    let flies = |h: &Harness| {
        let works = |id| h.why(id).work.unwrap().reason == Reason::Task;
        works(1) || works(2)
    };
    assert!(h.run_until(20, flies));
    edit(&mut h, TaskEdit::Done("far".into()));
    assert!(h.run_until(15, |h| !flies(h)));
    h.run_s(3);
    for id in [1, 2, GROUND_STATION] {
        let told = view(&h, id, "far").unwrap();
        assert_eq!(
            (told.state, told.done_by),
            (TaskState::Done, Some(GROUND_STATION))
        );
    }
    edit(&mut h, TaskEdit::Done("far".into()));
    assert!(
        h.alarms(GROUND_STATION)
            .pop()
            .unwrap()
            .contains("is over already")
    );
    assert!(h.run_until(600, |h| all_finished(h, [1, 2])));
    assert_eq!(doers(&mut h, 2, "far"), Vec::<u16>::new());
}

/// What a UAV that is gone asked for stays done when the station that said so begins anew, and
/// for whoever hears of the task later.
#[test]
fn what_was_said_to_be_done_stays_so_over_lives() {
    let mut h = with_operator(2, mission(1, 8, 4));
    h.run_s(20);
    let task = NewTask {
        kind: TaskKind::Track,
        radius_mm: 0,
        ..point("bus-9.0", 300.0, 100.0)
    };
    let asks = record(9, 1, 1, 0, &Body::Task(task.asked(0, 1).unwrap()));
    for id in [1, GROUND_STATION] {
        h.inject(id, asks.clone());
    }
    assert_eq!(state(&h, GROUND_STATION, "bus-9.0"), Some(TaskState::Open));
    edit(&mut h, TaskEdit::Done("bus-9.0".into()));
    let said = h.operators_tasks(GROUND_STATION);
    assert_eq!((said.asked.len(), said.done.len()), (0, 1));
    h.run_s(5);
    h.inject(2, asks.clone());
    assert_eq!(state(&h, 2, "bus-9.0"), Some(TaskState::Done));
    // Both begin another life, and hear of the task before they hear that it is done, or after.
    h.stop(GROUND_STATION);
    h.stop(2);
    h.run_s(3);
    h.start(GROUND_STATION);
    h.start(2);
    assert!(h.run_until(30, |h| h.speaks(GROUND_STATION) && h.speaks(2)));
    h.inject(2, asks.clone());
    assert_eq!(state(&h, 2, "bus-9.0"), Some(TaskState::Open));
    edit(&mut h, TaskEdit::Again(said.clone()));
    assert!(h.operators_tasks(GROUND_STATION) == said);
    assert!(h.run_until(10, |h| state(h, 2, "bus-9.0") == Some(TaskState::Done)));
    h.inject(GROUND_STATION, asks);
    assert_eq!(state(&h, GROUND_STATION, "bus-9.0"), Some(TaskState::Done));
    assert!(h.run_until(600, |h| all_finished(h, [1, 2])));
}

/// What was asked for before is said by the station that begins anew, also where it hears of that
/// from its operator a while after it speaks; who comes later knows of it as well.
#[test]
fn what_was_asked_for_before_is_said_to_who_comes_later() {
    let mut h = with_operator(2, mission(1, 8, 4));
    h.run_s(20);
    // Nobody carries what it needs, so it stays open.
    let task = NewTask {
        sensor: 5,
        ..point("far", 300.0, 100.0)
    };
    add(&mut h, task);
    let said = h.operators_tasks(GROUND_STATION);
    h.run_s(2);
    h.stop(GROUND_STATION);
    h.stop(2);
    h.run_s(3);
    h.start(GROUND_STATION);
    assert!(h.run_until(30, |h| h.speaks(GROUND_STATION)));
    h.run_s(3);
    edit(&mut h, TaskEdit::Again(said));
    h.run_s(3);
    h.start(2);
    assert!(h.run_until(20, |h| state(h, 2, "far") == Some(TaskState::Open)));
}
