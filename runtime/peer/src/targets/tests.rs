//! Targets of two peers that see, tell and hear.

use super::*;
use crate::task::{CoverageTask, LineTask};
use skein_behaviors::sightings::{Sighted, Sightings};
use skein_flight::tracking::buildings::{Building, Buildings};
use skein_flight::tracking::streets::Streets;
use skein_geometry::Polygon;
use skein_geometry::frame::Pose;

const TASK: Sought = (
    TaskId {
        author: 100,
        number: 0,
    },
    1,
);

fn percept(now_ms: u64, at: Point, seen: &[(f64, f64, u8)]) -> Percept {
    let sighted = |(x, y, kind): &(f64, f64, u8)| Sighted {
        east_mm: mm(*x),
        north_mm: mm(*y),
        spread_mm: 700,
        kind: *kind,
    };
    Percept {
        time_ms: now_ms,
        pose: Pose::new(at, 0.0),
        sightings: Sightings::new(seen.iter().map(sighted)),
        contour: skein_behaviors::contour::ContourLook::default(),
        crowd: skein_behaviors::crowd::CrowdLook::default(),
        attitude: None,
        height_m: 60.0,
        airspeed_mps: 13.0,
        wind_east_mps: 0.0,
        wind_north_mps: 0.0,
        wind_unknown: false,
        endurance_s: 1_000.0,
        takes_off_in_ms: 0,
        launch_ready: false,
        failsafe: false,
        circles_per_m: None,
        circles_in_ms: 0,
        traffic: skein_behaviors::traffic::Traffic::default(),
        obstacles: skein_behaviors::obstacle::Obstacles::default(),
    }
}

fn targets(me: u16) -> Targets {
    Targets::new(me, Some(crate::testing::airframe()))
}

/// Looks from above a car that drives east at 5 m/s from (100, 50).
fn watched(t: &mut Targets, from_ms: u64, to_ms: u64) {
    for now_ms in (from_ms..to_ms).step_by(200) {
        let x = 100.0 + now_ms as f64 / 200.0;
        t.on_percept(&percept(now_ms, Point::new(x, 50.0), &[(x, 50.0, 1)]));
    }
}

fn said(effects: &[Effect]) -> Vec<(u16, Target)> {
    let of = |e: &Effect| match e {
        Effect::Speak(subject, Body::Target(t)) => Some((*subject, *t)),
        _ => None,
    };
    effects.iter().filter_map(of).collect()
}

#[test]
fn without_a_detector_nothing_is_kept_and_nothing_said() {
    let mut t = targets(1);
    let mut p = percept(5_000, Point::origin(), &[]);
    p.sightings = Sightings::default();
    t.on_percept(&p);
    assert_eq!(t.now_ms, 0);
    assert!(t.tell(Time(9_000), 1_000, Some(TASK)).is_empty());
}

#[test]
fn what_is_followed_is_told_with_its_task_and_found_by_who_hears_it() {
    let (mut one, mut two) = (targets(1), targets(2));
    watched(&mut one, 1_000, 9_000);
    assert_eq!(
        one.follow(TASK, Point::new(5_000.0, 0.0), 9.0),
        None,
        "too far"
    );
    one.follow(TASK, Point::new(200.0, 50.0), 0.0).unwrap();
    assert!(one.unseen_ms(TASK).unwrap() == 0);
    let told = said(&one.tell(Time(60_000), 1_000, Some(TASK)));
    let [(0, target)] = told[..] else {
        panic!("{told:?}")
    };
    assert_eq!((target.task_by, target.task, target.revision), (100, 0, 1));
    Body::Target(target).check().unwrap();
    // Nothing new, nothing said; and no more than once an interval.
    assert!(one.tell(Time(62_000), 1_000, Some(TASK)).is_empty());
    watched(&mut one, 9_000, 9_400);
    assert!(one.tell(Time(60_500), 1_000, Some(TASK)).is_empty());
    assert_eq!(said(&one.tell(Time(62_000), 1_000, Some(TASK))).len(), 1);
    // The other is elsewhere, and sees nothing of it.
    two.hear(Time(0), 1, &target);
    assert_eq!(two.known(TASK), None, "it has no clock yet");
    two.on_percept(&percept(9_100, Point::new(900.0, 900.0), &[]));
    two.hear(Time(0), 1, &target);
    let known = two.known(TASK).unwrap();
    let truth = Point::new(100.0 + 9_100.0 / 200.0, 50.0);
    assert!((known.motion.position - truth).norm() < 5.0, "{known:?}");
    assert!(two.unseen_ms(TASK).is_none());
    // Long after it is still known where it was seen last.
    two.on_percept(&percept(99_000, Point::new(900.0, 900.0), &[]));
    let late = two.known(TASK).unwrap();
    assert!(late.unseen_s > 80.0);
    assert!((late.motion.position - truth).norm() < 60.0, "{late:?}");
}

#[test]
fn of_registers_the_newest_counts_whatever_the_order() {
    let mut one = targets(1);
    watched(&mut one, 1_000, 4_000);
    one.follow(TASK, Point::new(115.0, 50.0), 0.0).unwrap();
    let first = said(&one.tell(Time(10_000), 1_000, Some(TASK)))[0].1;
    watched(&mut one, 4_000, 6_000);
    let second = said(&one.tell(Time(12_000), 1_000, Some(TASK)))[0].1;
    let heard = |order: &[Target]| {
        let mut two = targets(2);
        two.on_percept(&percept(6_000, Point::new(900.0, 900.0), &[]));
        order.iter().for_each(|t| two.hear(Time(0), 1, t));
        two.known(TASK)
    };
    let both = heard(&[first, second]);
    assert!(both.is_some());
    assert_eq!(both, heard(&[second, first]));
    assert_eq!(both, heard(&[second, second, first, first]));
}

#[test]
fn what_is_of_another_time_or_no_covariance_is_left_out() {
    let mut one = targets(1);
    watched(&mut one, 1_000, 4_000);
    one.follow(TASK, Point::new(115.0, 50.0), 0.0).unwrap();
    let told = said(&one.tell(Time(10_000), 1_000, Some(TASK)))[0].1;
    let mut two = targets(2);
    two.on_percept(&percept(4_000, Point::new(900.0, 900.0), &[]));
    let ahead = Target {
        seen_ms: 7_000,
        ..told
    };
    two.hear(Time(0), 1, &ahead);
    two.hear(Time(0), 2, &told);
    assert_eq!(two.known(TASK), None);
    for (author, number) in (3..200).zip(0..) {
        two.hear(Time(0), author, &Target { number, ..told });
        two.hear(
            Time(0),
            author,
            &Target {
                task: 1 + number as u16,
                number: number + 1,
                ..told
            },
        );
    }
    for (name, used, cap) in two.loads() {
        assert!(used <= cap, "{name}: {used}");
    }
}

#[test]
fn who_is_lost_is_looked_for_all_over_and_taken_up_again_where_it_may_be() {
    let mut one = targets(1);
    watched(&mut one, 1_000, 6_000);
    one.follow(TASK, Point::new(125.0, 50.0), 0.0).unwrap();
    let lost_at = one.known(TASK).unwrap().motion.position;
    // It flies to where it looks next, at 14 m/s.
    let mut at = lost_at;
    let (mut farthest_m, mut places) = (0.0_f64, Vec::<Point>::new());
    for now_ms in (6_000..300_000).step_by(200) {
        let looked = percept(now_ms, at, &[]);
        one.on_percept(&looked);
        let known = one.known(TASK).unwrap();
        if !known.is_lost() {
            continue;
        }
        let looked_for = (TASK, Point::new(125.0, 50.0), 9.0);
        let aim = one
            .look_for(looked_for, &looked, &CoverageTask::Area, &|p| p.y > -200.0)
            .unwrap();
        assert!(aim.position.y > -200.0 && aim.velocity_mps.norm() < 1e-9);
        if places.last() != Some(&aim.position) {
            places.push(aim.position);
        }
        let to = aim.position - at;
        at += to * (2.8 / to.norm().max(2.8));
        farthest_m = farthest_m.max((aim.position - lost_at).norm());
    }
    // Ahead first, then all over.
    assert!(places[0].x > lost_at.x, "{:?}", places[0]);
    assert!(places.len() > 8 && farthest_m > 250.0, "{places:?}");
    // A car of the same kind, by now.
    for now_ms in (300_000..303_000).step_by(200) {
        one.on_percept(&percept(
            now_ms,
            Point::new(250.0, 100.0),
            &[(250.0, 100.0, 1)],
        ));
    }
    let known = one.known(TASK).unwrap();
    assert!((known.motion.position - Point::new(250.0, 100.0)).norm() < 5.0);
    assert!(one.unseen_ms(TASK).unwrap() < 500);
    // Whom nobody has seen is looked for about the place that was asked for.
    let mut other = targets(2);
    let looked = percept(9_000, Point::origin(), &[]);
    other.on_percept(&looked);
    let place = Point::new(300.0, 300.0);
    let aim = other.look_for((TASK, place, 4.0), &looked, &CoverageTask::Area, &|_| true);
    assert!((aim.unwrap().position - place).norm() < 100.0);
}

/// A street from west to east along y = 50, one across it at x = 300, and a house of 30 m beside
/// the first.
fn town(west_m: f64, south_m: f64) -> Arc<Town> {
    let line = |ends: [(f64, f64); 3]| ends.map(|(x, y)| Point::new(x, y)).to_vec();
    let corner = |x: f64, y: f64| Point::new(west_m + x, south_m + y);
    let ring = [(0.0, 0.0), (40.0, 0.0), (40.0, 20.0), (0.0, 20.0)];
    let house = Building {
        footprint: Polygon::new(ring.map(|(x, y)| corner(x, y)).to_vec()).unwrap(),
        roof_m: 30.0,
    };
    let along = line([(-200.0, 50.0), (300.0, 50.0), (900.0, 50.0)]);
    let across = line([(300.0, -500.0), (300.0, 50.0), (300.0, 600.0)]);
    Arc::new(Town {
        buildings: Buildings::of([house]),
        streets: Streets::of(&[along, across]),
    })
}

#[test]
fn who_is_lost_where_streets_are_told_is_looked_for_along_them_and_given_up_where_none_can_look() {
    let mut one = targets(1);
    one.knows(Some(&town(-900.0, -900.0)));
    watched(&mut one, 1_000, 6_000);
    one.follow(TASK, Point::new(125.0, 50.0), 0.0).unwrap();
    let (mut at, mut places) = (Point::new(130.0, 50.0), Vec::<Point>::new());
    for now_ms in (6_000..300_000).step_by(200) {
        // It never comes so far that it sees the streets beyond: they are given up, not flown to
        // for ever.
        at.x = at.x.min(280.0);
        let looked = percept(now_ms, at, &[]);
        one.on_percept(&looked);
        if !one.known(TASK).unwrap().is_lost() {
            continue;
        }
        let looked_for = (TASK, Point::new(125.0, 50.0), 9.0);
        let aim = one.look_for(looked_for, &looked, &CoverageTask::Area, &|_| true);
        let aim = aim.unwrap();
        let to = aim.position - at;
        at += to * (2.8 / to.norm().max(2.8));
        let p = aim.position;
        // To the middle of what a square of the flight holds, for there may be a crossing.
        let off_m = (p.y - 50.0).abs().min((p.x - 300.0).abs());
        assert!(off_m < 30.0, "{p:?} is on no street");
        if places.last() != Some(&p) {
            places.push(p);
        }
    }
    let goes = |is_there: &dyn Fn(&Point) -> bool| places.iter().any(is_there);
    assert!(places[0].x > 130.0, "ahead first: {:?}", places[0]);
    assert!(goes(&|p| p.x > 400.0) && places.len() > 8, "{places:?}");
}

/// Nobody has seen it yet: it was to be on a line of the mission, and drives along that; or it was
/// not, or no longer.
#[test]
fn who_was_to_be_on_a_line_of_the_mission_is_looked_for_along_it_and_then_anywhere() {
    let way = vec![(0, 50_000), (1_000_000, 50_000)];
    let line = LineTask {
        way,
        width_mm: 8_000,
    };
    let asks_for = CoverageTask::Lines(vec![line]);
    let looked_for = |place: Point| {
        let mut one = targets(1);
        let mut at = Point::new(-200.0, 0.0);
        let mut places = Vec::<(u64, Point)>::new();
        for now_ms in (1_000..500_000).step_by(200) {
            let looked = percept(now_ms, at, &[]);
            one.on_percept(&looked);
            let aim = one.look_for((TASK, place, 60.0), &looked, &asks_for, &|_| true);
            let aim = aim.unwrap().position;
            at += (aim - at) * (2.8 / (aim - at).norm().max(2.8));
            places.push((now_ms, aim));
        }
        places
    };
    let is_beside = |p: Point| (p.y - 50.0).abs() > 30.0 || p.x < -30.0 || p.x > 1_030.0;
    // The line and back, at 13 m/s, and a minute.
    let on_line = looked_for(Point::new(20.0, 60.0));
    let left = on_line.iter().find(|(_, p)| is_beside(*p));
    let left_ms = left.unwrap().0;
    assert!(left_ms > 214_000, "{left_ms}");
    assert!(on_line.iter().any(|(_, p)| p.x > 900.0));
    let off_line = looked_for(Point::new(20.0, 200.0));
    assert!(is_beside(off_line[0].1), "{:?}", off_line[0]);
}

/// Who stands behind a house is not missed by who looks past it.
#[test]
fn a_track_behind_a_house_is_kept_and_one_in_the_open_is_not() {
    // The house begins 2 m north of the car; the UAV is north of it, the car in its picture.
    let kept = |town: Option<&Arc<Town>>| {
        let mut one = targets(1);
        one.knows(town);
        watched(&mut one, 1_000, 6_000);
        one.follow(TASK, Point::new(125.0, 50.0), 0.0).unwrap();
        for now_ms in (6_000..8_400).step_by(200) {
            one.on_percept(&percept(now_ms, Point::new(135.0, 76.0), &[]));
        }
        one.unseen_ms(TASK).is_some()
    };
    assert!(kept(Some(&town(110.0, 52.0))) && !kept(None));
    assert!(!kept(Some(&town(-900.0, 52.0))));
}

#[test]
fn who_has_no_camera_knows_where_a_target_was_heard_to_be_last() {
    let mut ground = Targets::new(100, None);
    let told = |seen_ms: u64, task: u16, east_mm: i32| Target {
        task_by: 2,
        task,
        revision: 1,
        seen_ms,
        east_mm,
        east_mmps: 4_000,
        ..Target::default()
    };
    let of = |number| (TaskId { author: 2, number }, 1);
    let at = |ground: &Targets, ms, number| ground.heard_at(Time(ms), of(number)).map(|p| p.x);
    assert_eq!(at(&ground, 0, 3), None);
    ground.hear(Time(1_000), 2, &told(50_000, 3, 10_000));
    ground.hear(Time(1_000), 2, &told(50_000, 0, 99_000));
    assert_eq!(at(&ground, 1_000, 3), Some(10.0));
    assert_eq!(at(&ground, 3_000, 3), Some(18.0));
    // Not for long, and not once another was heard.
    assert_eq!(at(&ground, 60_000, 3), Some(30.0));
    ground.hear(Time(2_000), 4, &told(51_000, 3, 16_000));
    assert_eq!(at(&ground, 2_000, 3), Some(16.0));
    // Bounded, and what was heard longest ago goes first.
    for n in 10..10 + 2 * BOUND_MAX as u16 {
        ground.hear(Time(u64::from(n) * 1_000), 2, &told(52_000, n, 0));
    }
    assert_eq!((ground.heard.len(), at(&ground, 0, 3)), (BOUND_MAX, None));
}
