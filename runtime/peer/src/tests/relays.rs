//! Relay positions: who holds one and for how long, and that all cells are seen all the same.

use super::with_operator;
use crate::Input;
use crate::input::{Command, NewTask, TaskEdit};
use crate::mission::mm;
use crate::output::{Report, TaskNews};
use crate::testing::{GROUND_STATION, Harness, mission};
use crate::why::Reason;
use crate::wire::message::Order;
use crate::wire::tasks::{TaskKind, TaskState};

/// Where the relay positions of these stories are, and how far a holder may be from them, metres.
const PLACE: (f64, f64) = (150.0, -90.0);
const WITHIN_M: f64 = 60.0;

fn relay(name: &str, (east_m, north_m): (f64, f64)) -> NewTask {
    NewTask {
        name: Some(name.to_owned()),
        kind: TaskKind::Relay,
        places: vec![(mm(east_m), mm(north_m))],
        radius_mm: mm(WITHIN_M).unsigned_abs(),
        worth: 100,
        within_ms: None,
        sensor: 0,
    }
}

fn edit(h: &mut Harness, edit: TaskEdit) {
    h.feed(GROUND_STATION, Input::Command(Command::Task(edit)));
}

fn ask(h: &mut Harness) {
    edit(h, TaskEdit::Add(relay("link", PLACE)));
}

fn relays(h: &Harness, id: u16) -> bool {
    let work = h.why(id).work;
    work.is_some_and(|w| w.reason == Reason::Relay)
}

fn away_m(h: &Harness, id: u16) -> f64 {
    let at = h.pose(id).position();
    (at.x - PLACE.0).hypot(at.y - PLACE.1)
}

fn times(h: &mut Harness, id: u16, wanted: &TaskNews) -> usize {
    let is = |r: &Report| matches!(r, Report::Task { news, .. } if news == wanted);
    h.seat(id).reports.iter().filter(|(_, r)| is(r)).count()
}

/// The one that holds the position, once one does.
fn holder(h: &mut Harness, ids: &[u16], most_s: u64) -> u16 {
    let holds = |h: &Harness| {
        let mut ids = ids.iter().copied();
        ids.find(|id| relays(h, *id) && away_m(h, *id) < WITHIN_M)
    };
    assert!(h.run_until(most_s, |h| holds(h).is_some()));
    holds(h).unwrap()
}

#[test]
fn who_wins_gives_its_section_up_and_holds_the_place_while_the_others_cover() {
    let mut h = with_operator(3, mission(1, 10, 6));
    h.run_s(20);
    ask(&mut h);
    let one = holder(&mut h, &[1, 2, 3], 90);
    h.run_s(10);
    let b = h.beliefs(one);
    assert!(b.plan.is_empty() && !b.able && b.relays && !b.finished);
    let others: Vec<u16> = (1..=3).filter(|id| *id != one).collect();
    // Nobody's cells are left behind.
    let mut listed: Vec<u16> = others.iter().flat_map(|id| h.beliefs(*id).plan).collect();
    listed.extend(h.beliefs(others[0]).covered.iter());
    listed.sort_unstable();
    listed.dedup();
    assert_eq!(listed.len(), usize::from(b.covered.capacity()));
    let mut farthest_m = 0.0_f64;
    for _ in 0..400 {
        h.run_s(1);
        farthest_m = farthest_m.max(away_m(&h, one));
    }
    assert!(farthest_m < WITHIN_M, "{farthest_m}");
    assert!(others.iter().all(|id| h.beliefs(*id).finished));
    assert!(h.beliefs(one).covered.is_full() && !h.beliefs(one).finished);
    assert_eq!(times(&mut h, one, &TaskNews::Holds), 1);
    edit(&mut h, TaskEdit::Cancel("link".into()));
    assert!(h.run_until(20, |h| h.beliefs(one).finished));
    assert_eq!(times(&mut h, one, &TaskNews::Left), 1);
}

#[test]
fn who_is_relieved_by_the_end_of_its_time_covers_again() {
    let mut h = with_operator(2, mission(1, 12, 8));
    h.run_s(20);
    let within_ms = Some(60_000);
    edit(
        &mut h,
        TaskEdit::Add(NewTask {
            within_ms,
            ..relay("link", PLACE)
        }),
    );
    let one = holder(&mut h, &[1, 2], 55);
    assert!(h.run_until(60, |h| !relays(h, one)));
    let expired = h.why(one).tasks.into_iter().find(|t| t.name == "link");
    assert_eq!(expired.unwrap().state, TaskState::Expired);
    assert!(h.run_until(60, |h| !h.beliefs(one).plan.is_empty()));
    assert!(h.run_until(900, |h| (1..=2).all(|id| h.beliefs(id).finished)));
}

#[test]
fn the_position_of_a_uav_that_dies_is_held_by_another() {
    let mut h = with_operator(3, mission(1, 10, 6));
    h.run_s(20);
    ask(&mut h);
    let one = holder(&mut h, &[1, 2, 3], 90);
    h.stop(one);
    let others: Vec<u16> = (1..=3).filter(|id| *id != one).collect();
    let next = holder(&mut h, &others, 90);
    let last = others.into_iter().find(|id| *id != next).unwrap();
    assert!(h.run_until(900, |h| h.beliefs(last).finished));
    assert!(relays(&h, next));
}

#[test]
fn whose_fuel_will_be_due_is_relieved_and_leaves_once_another_is_there() {
    let mut h = with_operator(3, mission(1, 12, 8));
    h.run_s(20);
    ask(&mut h);
    let one = holder(&mut h, &[1, 2, 3], 90);
    h.run_s(10);
    h.seat(one).fuel_s = 240.0;
    let mut without_s = 0;
    let mut handed_over = false;
    for _ in 0..200 {
        h.run_s(1);
        let held = (1..=3).any(|id| away_m(&h, id) < WITHIN_M && relays(&h, id));
        without_s += u32::from(!held);
        handed_over |= (1..=3).any(|id| id != one && relays(&h, id)) && !relays(&h, one);
    }
    assert_eq!((without_s, handed_over), (0, true));
    assert_eq!(times(&mut h, one, &TaskNews::Leaving), 1);
    let left_s = h.seat(one).fuel_s;
    assert!(left_s > 0.0, "{left_s}");
    assert_eq!(times(&mut h, one, &TaskNews::Left), 1);
}

#[test]
fn one_uav_alone_covers_first() {
    let mut h = with_operator(1, mission(1, 6, 4));
    h.run_s(15);
    ask(&mut h);
    let why = |h: &Harness| {
        let tasks = h.why(GROUND_STATION).tasks;
        tasks.into_iter().find_map(|t| t.nobody_can)
    };
    let full = |h: &Harness| h.beliefs(1).covered.is_full();
    while !full(&h) {
        h.run_s(1);
        assert!(!relays(&h, 1) || full(&h));
    }
    assert!(why(&h).is_none(), "the ground station does not settle");
    let told = |r: &Report| matches!(r, Report::Task { news: TaskNews::NobodyCan(why), .. } if why.contains("left to cover"));
    assert!(h.seat(1).reports.iter().any(|(_, r)| told(r)));
    // Then nothing is kept from anybody.
    holder(&mut h, &[1], 90);
}

#[test]
fn the_last_one_that_can_cover_lets_go_of_its_position() {
    let mut h = with_operator(2, mission(1, 10, 6));
    h.run_s(20);
    ask(&mut h);
    let one = holder(&mut h, &[1, 2], 90);
    h.stop(3 - one);
    assert!(h.run_until(60, |h| !relays(h, one) && !h.beliefs(one).plan.is_empty()));
    assert!(h.run_until(900, |h| h.beliefs(one).covered.is_full()));
}

#[test]
fn of_two_positions_two_uavs_hold_one_until_all_is_covered() {
    let mut h = with_operator(2, mission(1, 10, 6));
    h.run_s(20);
    ask(&mut h);
    edit(&mut h, TaskEdit::Add(relay("other", (300.0, -90.0))));
    holder(&mut h, &[1, 2], 90);
    while !h.beliefs(1).covered.is_full() {
        h.run_s(1);
        assert!(!(relays(&h, 1) && relays(&h, 2)) || h.beliefs(2).covered.is_full());
    }
    assert!(h.run_until(90, |h| relays(h, 1) && relays(h, 2)));
}

#[test]
fn who_is_told_to_return_leaves_its_position_to_others() {
    let mut h = with_operator(3, mission(1, 10, 6));
    h.run_s(20);
    ask(&mut h);
    let one = holder(&mut h, &[1, 2, 3], 90);
    h.order_one(GROUND_STATION, one, Order::ReturnToBase);
    let others: Vec<u16> = (1..=3).filter(|id| *id != one).collect();
    holder(&mut h, &others, 90);
    assert!(!relays(&h, one));
    // Who is told to hold stays where it is: on its circle.
    let next = others.iter().copied().find(|id| relays(&h, *id)).unwrap();
    h.run_s(20);
    assert_eq!(times(&mut h, next, &TaskNews::Holds), 1);
    h.order_one(GROUND_STATION, next, Order::Hold);
    h.run_s(60);
    assert!(away_m(&h, next) < WITHIN_M);
}

#[test]
fn a_zone_over_the_position_moves_the_circle_aside() {
    let mut h = with_operator(3, mission(1, 10, 6));
    h.run_s(20);
    ask(&mut h);
    let one = holder(&mut h, &[1, 2, 3], 90);
    let mut revised = mission(h.next_revision(GROUND_STATION), 10, 6);
    revised.zones = vec![vec![
        (150_000, -60_000),
        (180_000, -60_000),
        (180_000, -40_000),
        (150_000, -40_000),
    ]];
    h.feed(
        GROUND_STATION,
        Input::Command(Command::Mission(std::sync::Arc::new(revised))),
    );
    h.run_s(60);
    assert!(relays(&h, one) && away_m(&h, one) < WITHIN_M);
}
