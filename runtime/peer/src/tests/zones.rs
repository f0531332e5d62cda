//! No-fly zones, missions begun anew and ended: what an operator changes in flight.

use super::{covered, with_operator};
use crate::Input;
use crate::input::Command;
use crate::mission::{Mission, PointMm, mm};
use crate::testing::{GROUND_STATION, Harness, airframe, mission};
use crate::why::Reason;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::random::SplitMix64;
use skein_geometry::{Curve, NoFlyZones, Polygon};
use std::sync::Arc;

fn command(h: &mut Harness, mission: Mission) {
    let command = Command::Mission(Arc::new(mission));
    h.feed(GROUND_STATION, Input::Command(command));
}

/// The mission that is flown, changed, as the next revision.
fn revise(h: &mut Harness, change: impl FnOnce(&Mission) -> Mission) {
    let newest = h.newest_mission(GROUND_STATION).unwrap();
    let revision = h.next_revision(GROUND_STATION);
    let changed = change(&newest);
    command(
        h,
        Mission {
            revision,
            ..changed
        },
    );
}

/// A square whose middle lies so far ahead of a pose, a little to its left.
fn square_ahead(pose: Pose, ahead_m: f64, left_m: f64, half_m: f64) -> Vec<PointMm> {
    let (sin, cos) = (pose.heading_rad.sin(), pose.heading_rad.cos());
    let middle = (
        pose.east_m + ahead_m * cos - left_m * sin,
        pose.north_m + ahead_m * sin + left_m * cos,
    );
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(a, b)| (mm(middle.0 + half_m * a), mm(middle.1 + half_m * b)))
        .to_vec()
}

fn polygon(ring: &[PointMm]) -> Polygon {
    Polygon::new(ring.iter().copied().map(crate::mission::point_m).collect()).unwrap()
}

fn is_inside(zone: &Polygon, at: Point) -> bool {
    zone.distance_m(at) <= 0.0
}

fn told(h: &Harness, id: u16, what: &str) -> bool {
    h.alarms(id).iter().any(|a| a.contains(what))
}

/// Whether a tightest turn keeps out of a zone that is begun after a while of straight flight,
/// or of any turn.
fn can_turn_away(pose: Pose, zone: &Polygon, meanwhile_m: f64) -> bool {
    let radius_m = 23.5;
    let zones = NoFlyZones::new(vec![zone.clone()]);
    let turns = |before: f64| {
        [1.0, -1.0].iter().any(|side| {
            let half = (side / radius_m, 3.15 * radius_m);
            let pieces = [(before / radius_m, meanwhile_m), half, half];
            zones.is_clear(&Curve::from_pieces(pose, &pieces), 2.0)
        })
    };
    [0.0, 1.0, -1.0].into_iter().all(turns)
}

/// The plan is not derived yet, and never will be: the envelope keeps out of the zone.
#[test]
fn a_zone_on_the_track_is_turned_away_from_before_there_are_routes_round_it() {
    let mut warned = 0;
    for start_s in [16, 20, 24, 28, 32] {
        let mut h = with_operator(1, mission(1, 10, 6));
        h.run_s(start_s);
        h.seat(1).planner_withholds = true;
        let ring = square_ahead(h.pose(1), 85.0, 0.0, 25.0);
        let zone = polygon(&ring);
        revise(&mut h, |m| m.with_zone("fire", &ring).unwrap());
        assert!(
            !h.run_until(60, |h| is_inside(&zone, h.pose(1).position())),
            "from {start_s} s"
        );
        assert_eq!(h.beliefs(1).revision, 1, "its loop is not derived");
        warned += u32::from(told(&h, 1, "ahead on the track: turning away"));
    }
    assert!(warned > 1, "{warned}");
}

/// Whatever lies where: who can still turn away when it holds the zone does.
#[test]
fn who_can_turn_away_from_a_new_zone_does() {
    let mut random = SplitMix64::new(20);
    let mut draw = |low: f64, high: f64| {
        let share = random.unit();
        low + share * (high - low)
    };
    let (mut tried, mut warned) = (0, 0);
    for _ in 0..24 {
        let mut h = with_operator(1, mission(1, 8, 6));
        h.run_s(draw(12.0, 60.0) as u64);
        let half_m = draw(10.0, 50.0);
        let ahead_m = half_m + draw(30.0, 90.0);
        let ring = square_ahead(h.pose(1), ahead_m, draw(-40.0, 40.0), half_m);
        let zone = polygon(&ring);
        revise(&mut h, |m| m.with_zone("z", &ring).unwrap());
        // The moment in which the UAV holds it, and what it flies until it has answered.
        if !h.run_until(10, |h| h.beliefs(1).revision == 2) {
            continue;
        }
        if !can_turn_away(h.pose(1), &zone, 1.2 * airframe().cruise_mps) {
            continue;
        }
        tried += 1;
        warned += u32::from(told(&h, 1, "no-fly zone"));
        let pose = h.pose(1);
        assert!(
            !h.run_until(90, |h| is_inside(&zone, h.pose(1).position())),
            "from {pose:?} into {ring:?}"
        );
    }
    assert!(tried >= 12 && warned >= 2, "{tried} {warned}");
}

#[test]
fn who_is_inside_a_new_zone_leaves_it_and_does_not_come_back() {
    for (half_m, longest_s) in [(25.0, 10), (60.0, 16)] {
        let mut h = with_operator(1, mission(1, 10, 6));
        h.run_s(25);
        let ring = square_ahead(h.pose(1), 0.0, half_m / 3.0, half_m);
        let zone = polygon(&ring);
        revise(&mut h, |m| m.with_zone("z", &ring).unwrap());
        let inside = |h: &Harness| is_inside(&zone, h.pose(1).position());
        assert!(h.run_until(longest_s, |h| !inside(h)), "{half_m} m");
        assert!(!h.run_until(120, inside), "{half_m} m: in again");
        // Out of a small one it flies before it hears of it.
        let warned = told(&h, 1, "lies round this UAV: leaving it");
        assert!(warned || half_m < 30.0, "{:?}", h.alarms(1));
    }
}

/// Cells in the zone are asked for no longer, and asked for again when it is removed; what was
/// covered before stays covered.
#[test]
fn a_zone_takes_cells_away_and_its_removal_brings_them_back() {
    let mut h = with_operator(2, mission(1, 8, 6));
    h.run_s(25);
    let before = covered(&h, 1);
    assert!(before > 2);
    let far = [
        (240_000, 120_000),
        (380_000, 120_000),
        (380_000, 260_000),
        (240_000, 260_000),
    ];
    revise(&mut h, |m| m.with_zone("z", &far).unwrap());
    assert!(h.run_until(10, |h| (1..=2).all(|id| h.beliefs(id).revision == 2)));
    let work = h.why(1).work.unwrap();
    assert!(work.cells < 48 && work.covered + 4 >= before, "{work:?}");
    assert!(h.run_until(400, |h| (1..=2).all(|id| h.beliefs(id).finished)));
    revise(&mut h, |m| m.without_zone("z").unwrap());
    assert!(h.run_until(10, |h| (1..=2).all(|id| h.beliefs(id).revision == 3)));
    let work = h.why(1).work.unwrap();
    assert!(
        work.cells == 48 && work.covered < 48 && work.covered > 30,
        "{work:?}"
    );
    assert!(h.run_until(300, |h| (1..=2).all(|id| h.beliefs(id).finished)));
    assert_eq!(h.why(1).work.unwrap().covered, 48);
}

/// A zone that was put over covered cells by mistake costs nothing of what is known of them.
#[test]
fn what_was_seen_under_a_zone_is_known_still_when_the_zone_is_removed() {
    let mut h = with_operator(2, mission(1, 8, 6));
    assert!(h.run_until(300, |h| h.beliefs(1).covered.count() > 40));
    let before = h.beliefs(1).covered.clone();
    let zone = [
        (240_000, 120_000),
        (380_000, 120_000),
        (380_000, 260_000),
        (240_000, 260_000),
    ];
    revise(&mut h, |m| m.with_zone("z", &zone).unwrap());
    assert!(h.run_until(10, |h| h.beliefs(1).revision == 2));
    assert!(h.beliefs(1).covered.count() < before.count());
    revise(&mut h, |m| m.without_zone("z").unwrap());
    assert!(h.run_until(10, |h| h.beliefs(1).revision == 3));
    let mut forgotten = before;
    forgotten.subtract(&h.beliefs(1).covered);
    assert_eq!(forgotten.count(), 0, "{forgotten:?}");
}

#[test]
fn a_cancelled_mission_sends_all_home_and_one_that_is_submitted_begins_with_nothing_covered() {
    let mut h = with_operator(2, mission(1, 6, 4));
    h.run_s(30);
    let before = covered(&h, 1);
    assert!(before > 2);
    revise(&mut h, |m| m.cancelled().unwrap());
    assert!(h.run_until(10, |h| (1..=2).all(|id| h.beliefs(id).finished)));
    assert!((1..=2).all(|id| h.beliefs(id).plan.is_empty()));
    let work = h.why(1).work.unwrap();
    assert_eq!((work.reason, work.cells), (Reason::Cancelled, 0));
    let away_m = |h: &Harness, id| (h.pose(id).position() - Point::new(-60.0, -60.0)).norm();
    assert!(h.run_until(90, |h| (1..=2).all(|id| away_m(h, id) < 80.0)));
    revise(&mut h, |old| mission(1, 6, 4).submitted_after(old));
    assert!(h.run_until(10, |h| (1..=2).all(|id| h.beliefs(id).revision == 3)));
    let work = h.why(1).work.unwrap();
    assert!(work.covered == 0 && work.cells == 24, "{work:?}");
    assert!(h.run_until(300, |h| (1..=2).all(|id| h.beliefs(id).finished)));
    assert_eq!(h.why(1).work.unwrap().covered, 24);
    // Nor does the journal bring back what an earlier flight of the same area covered.
    h.stop(2);
    revise(&mut h, |old| mission(1, 6, 4).submitted_after(old));
    h.start(2);
    assert!(h.run_until(10, |h| h.beliefs(1).revision == 4));
    assert!(h.why(1).work.unwrap().covered < 4);
    assert!(h.run_until(40, |h| h.beliefs(2).revision == 4));
    let covered = [1, 2].map(|id| h.why(id).work.unwrap().covered);
    assert!(
        covered[1] <= covered[0] + 2 && covered[0] < 20,
        "{covered:?}"
    );
}

#[test]
fn why_tells_what_a_peer_does_and_changes_nothing() {
    let run = |asks: bool| {
        let mut h = with_operator(3, mission(1, 8, 6));
        for _ in 0..40 {
            h.run_s(1);
            if asks {
                let why = h.why(1);
                assert!(why.events.len() <= 20 && why.others.len() <= 3);
                drop((why.to_string(), h.why(GROUND_STATION).to_string()));
            }
        }
        h
    };
    let (asked, quiet) = (run(true), run(false));
    assert_eq!(asked.beliefs(1), quiet.beliefs(1));
    assert_eq!(asked.pose(1), quiet.pose(1));
    let mut h = asked;
    let why = h.why(1);
    let work = why.work.clone().unwrap();
    assert_eq!((why.id, why.speaks, work.reason), (1, true, Reason::Plan));
    let round = why.round.clone().expect("a round was held");
    assert_eq!((round.members.len(), round.bids.len()), (3, 3));
    let flight = why.flight.unwrap();
    let spent_s = flight.reserve_s + flight.return_s + flight.spendable_s;
    assert!((spent_s - flight.endurance_s).abs() < 0.01, "{flight:?}");
    let text = why.to_string();
    for word in [
        "does      flies its section",
        "claims",
        "bid of 2",
        "fuel",
        "round",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    let bytes = cbor4ii::serde::to_vec(Vec::new(), &why).unwrap();
    assert_eq!(
        cbor4ii::serde::from_slice::<crate::Why>(&bytes).unwrap(),
        why
    );
    // Whom it believes dead, and since when.
    h.stop(3);
    h.run_s(40);
    let why = h.why(1);
    let third = why.others.iter().find(|o| o.id == 3).unwrap();
    assert_eq!(third.status, crate::output::Status::Down);
    assert!(third.since_ms.is_some_and(|ms| ms > 10_000), "{third:?}");
    assert!(why.events.iter().any(|e| e.text == "believes peer 3 down"));
    assert!(why.to_string().contains("peer 3    down for"));
}
