//! Aircraft that are no members: sensed by one, made way for by another.

use crate::testing::{Harness, mission};
use crate::wire::kinds::Kind;
use skein_behaviors::traffic::Aircraft;

/// Comes straight at UAV 2, which flies at 70 m and has no sensor, within half a minute.
fn comes_at_the_second(h: &Harness) -> Aircraft {
    let at = h.pose(2).position();
    let now_s = i32::try_from(h.now_ms() / 1_000).unwrap();
    #[allow(clippy::cast_possible_truncation, reason = "some kilometres")]
    let dm = |m: f64| (10.0 * m).round() as i32;
    Aircraft {
        east_dm: dm(at.x) + 300 * (25 + now_s),
        north_dm: dm(at.y),
        height_dm: 700,
        east_dmps: -300,
        north_dmps: 0,
    }
}

/// Whether UAV 2 evades, and how near it came, where the first senses the aircraft, or nobody.
fn meets(senses: bool) -> (bool, f64) {
    let mut h = Harness::new(2, mission(1, 12, 10));
    // All percepts are of one clock.
    for id in [1, 2] {
        h.seat(id).clock_ms = 0;
        h.start(id);
    }
    h.run_s(20);
    let aircraft = comes_at_the_second(&h);
    if senses {
        h.seat(1).aircraft = vec![aircraft];
    }
    let (mut evades, mut nearest_m) = (false, f64::INFINITY);
    for _ in 0..200 {
        let before_ms = h.now_ms();
        h.run_until(1, |h| h.now_ms() > before_ms);
        evades |= h.beliefs(2).evades;
        let on_dm = i32::try_from(h.now_ms() * 3 / 10).unwrap();
        let there = Aircraft {
            east_dm: aircraft.east_dm - on_dm,
            ..aircraft
        };
        nearest_m = nearest_m.min((there.at() - h.pose(2).position()).norm());
    }
    if senses {
        assert!(h.count_said(1, Kind::Aircraft) > 2);
        assert_eq!(h.count_said(2, Kind::Aircraft), 0);
    }
    (evades, nearest_m)
}

#[test]
fn way_is_made_for_what_another_senses() {
    let (evades, nearest_m) = meets(true);
    assert!(evades && nearest_m > 50.0, "{evades} {nearest_m}");
    let (evades, without_m) = meets(false);
    assert!(!evades && without_m < nearest_m, "{evades} {without_m}");
}
