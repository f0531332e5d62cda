//! Who stays above what became too dense, and for how long.

use super::{record, with_operator};
use crate::crowd::{CrowdWatch, ThenWatch};
use crate::mission::Mission;
use crate::testing::{GROUND_STATION, Harness, mission};
use crate::why::Reason;
use crate::wire::codec::Body;
use crate::wire::crowd::{CrowdDense, CrowdRow, CrowdTile, SECTORS_EACH, Sure};
use crate::wire::message::Order;
use skein_geometry::frame::Point;
use std::sync::Arc;

/// The sector about (210, 70) m, and one that no circle above it holds, about (110, 150) m.
pub(super) const SECTOR: u16 = 17;
const OTHER: u16 = 32;

/// An event of 140 m by 120 m.
pub(super) fn watch(then: ThenWatch, circles_max: u16) -> Option<Arc<CrowdWatch>> {
    Some(Arc::new(CrowdWatch {
        west_m: 100,
        south_m: 60,
        cols: 7,
        rows: 6,
        then,
        circles_max,
        ..crate::crowd::tests::event()
    }))
}

fn circling(circles_max: u16) -> Mission {
    Mission {
        crowd: watch(ThenWatch::Circle, circles_max),
        ..mission(1, 8, 6)
    }
}

/// Somebody who is there no more tells all that a sector is too dense, or has eased.
pub(super) fn tell(h: &mut Harness, mission: &Mission, (sector, is_dense): (u16, bool)) {
    let time_s = h.now_ms() / 1_000;
    let within = u8::try_from(sector % SECTORS_EACH).unwrap();
    let row = CrowdRow {
        sector: within,
        people: if is_dense { 1_600 } else { 100 },
        low: if is_dense { 1_500 } else { 90 },
        high: if is_dense { 1_700 } else { 110 },
        seen_by: 9,
        sure: if is_dense { Sure::Dense } else { Sure::Eased },
        ..CrowdRow::default()
    };
    let dense = CrowdDense {
        sector: within,
        dense_s: 0,
        by: 9,
    };
    let tile = CrowdTile {
        crowd: mission.crowd_hash(),
        time_s,
        rows: vec![row],
        dense: is_dense.then_some(dense).into_iter().collect(),
    };
    let seq = u32::try_from(time_s).unwrap() + 1;
    let bytes = record(9, 1, seq, sector / SECTORS_EACH, &Body::Crowd(tile));
    for id in [1, 2, 3, GROUND_STATION] {
        if h.speaks(id) {
            h.inject(id, bytes.clone());
        }
    }
}

fn circles(h: &Harness, id: u16) -> bool {
    let work = h.why(id).work;
    work.is_some_and(|w| w.reason == Reason::Relay)
}

fn away_m(h: &Harness, id: u16, mission: &Mission, sector: u16) -> f64 {
    let at: Point = mission.crowd.as_ref().unwrap().middle(sector).unwrap();
    (h.pose(id).position() - at).norm()
}

/// The one that circles, once one does.
fn holder(h: &mut Harness, mission: &Mission, sector: u16, most_s: u64) -> u16 {
    let radius_m = 1.2 * mission.turn_radius_m() + 5.0;
    let holds = |h: &Harness| {
        let mut ids = [1, 2, 3].into_iter().filter(|id| h.speaks(*id));
        ids.find(|id| circles(h, *id) && away_m(h, *id, mission, sector) < radius_m)
    };
    assert!(h.run_until(most_s, |h| holds(h).is_some()));
    holds(h).unwrap()
}

#[test]
fn one_stays_above_until_it_has_eased_and_the_others_patrol() {
    let mission = circling(1);
    let mut h = with_operator(3, mission.clone());
    h.run_s(20);
    assert!((1..=3).all(|id| !circles(&h, id)));
    tell(&mut h, &mission, (SECTOR, true));
    let one = holder(&mut h, &mission, SECTOR, 60);
    // Where else it is too dense, nobody circles: the mission says one.
    tell(&mut h, &mission, (OTHER, true));
    for _ in 0..40 {
        h.run_s(1);
        let away_m = away_m(&h, one, &mission, SECTOR);
        assert!(away_m < 1.2 * mission.turn_radius_m() + 5.0, "{away_m}");
    }
    let others: Vec<u16> = (1..=3).filter(|id| *id != one).collect();
    assert!(others.iter().all(|id| !circles(&h, *id)));
    assert!(h.beliefs(one).relays && !h.beliefs(one).able);
    // Once the first has eased the other has its turn.
    tell(&mut h, &mission, (SECTOR, false));
    let next = holder(&mut h, &mission, OTHER, 60);
    tell(&mut h, &mission, (OTHER, false));
    assert!(h.run_until(10, |h| !circles(h, next)));
    h.run_s(20);
    assert!((1..=3).all(|id| !circles(&h, id)));
    // It goes on with what is left to be seen, or is through with it as the others are.
    let b = h.beliefs(next);
    assert!(!b.relays && (b.able || b.finished), "{b:?}");
}

#[test]
fn who_is_lost_or_recalled_is_relieved_and_the_last_one_patrols() {
    let mission = circling(1);
    let mut h = with_operator(3, mission.clone());
    h.run_s(20);
    tell(&mut h, &mission, (SECTOR, true));
    let one = holder(&mut h, &mission, SECTOR, 60);
    h.stop(one);
    let two = holder(&mut h, &mission, SECTOR, 90);
    assert_ne!(one, two);
    h.order_one(GROUND_STATION, two, Order::ReturnToBase);
    // The last one covers on, as before it was told.
    for _ in 0..60 {
        h.run_s(1);
        let last = (1..=3).find(|id| *id != one && *id != two).unwrap();
        assert!(!circles(&h, last));
    }
}

#[test]
fn as_many_circle_as_the_mission_says_and_all_but_one_can() {
    let mission = circling(2);
    for (uavs, wanted) in [(3, 2), (2, 1), (1, 0)] {
        let mut h = with_operator(uavs, mission.clone());
        h.run_s(20);
        tell(&mut h, &mission, (SECTOR, true));
        tell(&mut h, &mission, (OTHER, true));
        let count = |h: &Harness| (1..=uavs).filter(|id| circles(h, *id)).count();
        assert!(h.run_until(60, |h| count(h) >= wanted), "{uavs}");
        for _ in 0..40 {
            h.run_s(1);
            assert!(count(&h) <= wanted, "{uavs}");
        }
        assert_eq!(count(&h), wanted);
    }
}

#[test]
fn an_event_that_nobody_could_circle_above_is_refused() {
    let said = |m: Mission| m.check_crowd().unwrap_err().to_string();
    assert!(circling(1).check_crowd().is_ok());
    let apart = Mission {
        separation_mm: 10_000,
        ..circling(1)
    };
    assert!(said(apart).contains("kept apart by agreement"));
    let mut diagram = crate::diagram::Diagram::coverage();
    diagram.states.retain(|s| s.name != "relay");
    diagram.transitions.retain(|t| &*t.to != "relay");
    let elsewhere = Mission {
        diagram: Some(Arc::new(diagram)),
        ..circling(1)
    };
    let text = said(elsewhere);
    assert!(text.contains("goal \"relay\""), "{text}");
}
