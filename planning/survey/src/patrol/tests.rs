use super::*;
use crate::flight::Leg;
use crate::flown::straight;
use proptest::prelude::*;
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::PI;

/// Ticks a second of the simulation.
const FINE: u32 = 64;

/// The longest times between two visits of any unit of a tour, flown tick by tick: from
/// `from_s` to `to_s`, each UAV where `place(uav, t_s)` says. `seen` is when each unit was
/// seen last before.
fn flown(
    n: u32,
    k: usize,
    (from_s, to_s): (f64, f64),
    seen: &mut [Option<f64>],
    place: impl Fn(usize, f64) -> Option<f64>,
) -> f64 {
    let mut worst: f64 = 0.0;
    let ticks = ((to_s - from_s) * f64::from(FINE)) as u64;
    for tick in 0..=ticks {
        let t = from_s + tick as f64 / f64::from(FINE);
        for uav in 0..k {
            let Some(at) = place(uav, t) else { continue };
            let unit = (at as usize) % n as usize;
            if let Some(last) = seen[unit] {
                worst = worst.max(t - last);
            }
            seen[unit] = Some(t);
        }
    }
    for last in seen {
        worst = worst.max(to_s - last.expect("a unit that nobody ever saw"));
    }
    worst
}

/// A patrol that has begun: its courses.
fn begun(n: u32, turn: u32, uavs: &[Uav]) -> (Patrol, Vec<Course>) {
    let patrol = patrol_within(n, turn, uavs).unwrap();
    // Launch points somewhere off the tour.
    let cost = |uav: usize, place: u32| f64::from(place.abs_diff(uav as u32 * 7 % n)) + 3.0;
    let (patrol, stations) = spread(n, &patrol, cost);
    let speeds: Vec<u32> = uavs.iter().map(|u| u.speed).collect();
    let courses = patrol.courses(&speeds, &stations);
    (patrol, courses)
}

fn team(speeds: &[u32]) -> Vec<Uav> {
    let uav = |v: &u32| Uav {
        speed: *v,
        longest_s: f64::INFINITY,
    };
    speeds.iter().map(uav).collect()
}

/// A unit is seen somewhere in it, at some tick.
fn coarse(speeds: &[u32]) -> f64 {
    1.0 / f64::from(*speeds.iter().min().unwrap()) + 2.0 / f64::from(FINE)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn nobody_waits_longer_than_promised(
        n in 5u32..60,
        turn in 0u32..8,
        speeds in prop::collection::vec(1u32..6, 1..6),
    ) {
        let (patrol, courses) = begun(n, turn, &team(&speeds));
        let place = |uav: usize, t: f64| courses[uav].place(f64::from(n), t).map(|p| p.0);
        let mut seen = vec![None; n as usize];
        flown(n, speeds.len(), (0.0, patrol.revisit_s * 2.0 + 1.0), &mut seen, place);
        let from = patrol.revisit_s * 2.0 + 1.0;
        let to = from + 3.0 * patrol.revisit_s + 1.0;
        let worst = flown(n, speeds.len(), (from, to), &mut seen, place);
        let coarse = coarse(&speeds);
        prop_assert!(worst <= patrol.revisit_s + coarse, "{worst} {patrol:?}");
        prop_assert!(worst >= patrol.revisit_s - 2.0 * coarse, "{worst} {patrol:?}");
        let bound = revisit_bound(n, &speeds);
        prop_assert!(patrol.revisit_s >= bound - 1e-9);
        let slow = f64::from(*speeds.iter().min().unwrap());
        let turns = f64::from(turn) * speeds.len() as f64 / f64::from(speeds.iter().sum::<u32>());
        prop_assert!(patrol.revisit_s <= 2.0 * (bound + turns) + 2.0 / slow);
        if speeds.iter().all(|v| *v == speeds[0]) {
            prop_assert!(patrol.revisit_s - bound < 1.0 / slow);
        }
    }

    #[test]
    fn after_failures_no_wait_is_longer_than_told(
        n in 20u32..80,
        turn in 0u32..8,
        back in prop::option::of(0u32..12),
        speeds in prop::collection::vec(1u32..6, 2..7),
        t_s in 40.0f64..100.0,
        picks in prop::collection::vec(any::<prop::sample::Index>(), 1..3),
    ) {
        let round = f64::from(n);
        let uavs = team(&speeds);
        let (_, courses) = begun(n, turn, &uavs);
        let lost: Vec<usize> = picks.iter().map(|p| p.index(speeds.len())).collect();
        let joins = |uav: usize| ((uav as u32 * 5) % n, 2.5 + uav as f64);
        let Some(change) = after_losses((n, turn), &uavs, &courses, t_s, &lost, joins, |_| back.map(f64::from)) else {
            prop_assert!((0..speeds.len()).all(|i| lost.contains(&i)));
            return Ok(());
        };
        // Long before, so that the past is there; the failure is at 0 s.
        let k = speeds.len();
        let mut seen = vec![None; n as usize];
        let past = |uav: usize, t: f64| courses[uav].place(round, t + t_s).map(|p| p.0);
        flown(n, k, (-3.0 * round, -1e-6), &mut seen, past);
        let now = |uav: usize, t: f64| {
            let since = change.courses[uav].since_s()?;
            // On the way to its place a UAV sees nothing that is counted.
            (t >= since).then(|| change.courses[uav].place(round, t).unwrap().0)
        };
        let coarse = coarse(&speeds);
        let until = change.steady_s + 2.0 * round;
        let worst = flown(n, k, (0.0, until), &mut seen, now);
        prop_assert!(worst <= change.gap_s + coarse, "{worst} {change:?}");
        let after = flown(n, k, (until, until + round), &mut seen, now);
        prop_assert!(after <= change.patrol.revisit_s + coarse);
        for i in lost {
            prop_assert_eq!(change.courses[i], Course::Rest);
        }
    }

    #[test]
    fn one_failure_among_equals_is_made_good_within_a_spacing(
        n in 1_000u32..1_000_000,
        k in 2usize..40,
        lost in any::<prop::sample::Index>(),
        t_s in 0.0f64..1e6,
    ) {
        let (uavs, lost) = (team(&vec![10; k]), lost.index(k));
        let (_, courses) = begun(n, 0, &uavs);
        let change = after_losses((n, 0), &uavs, &courses, t_s, &[lost], |_| (0, 0.0), |_| None).unwrap();
        let spacing_s = f64::from(n) / 10.0 / k as f64;
        prop_assert!(change.steady_s <= spacing_s + 0.2);
        prop_assert!(change.gap_s <= 2.0 * spacing_s + 0.2);
        // Whoever is right behind the gap does not wait.
        prop_assert!(change.loiter_s.iter().filter(|l| **l > 0.1).count() <= k.saturating_sub(2));
        // Spacing is even.
        let mut at: Vec<f64> = change
            .courses
            .iter()
            .filter_map(|c| Some(c.place(f64::from(n), change.steady_s)?.0))
            .collect();
        at.sort_by(f64::total_cmp);
        for i in 0..at.len() {
            let next = if i + 1 == at.len() { at[0] + f64::from(n) } else { at[i + 1] };
            prop_assert!((next - at[i] - f64::from(n) / (k - 1) as f64).abs() <= 2.5);
        }
    }

    #[test]
    fn spacing_is_even_again(
        n in 10u32..500,
        places in prop::collection::vec(0u32..500, 1..9),
    ) {
        let delays = respace(n, &places);
        prop_assert!(delays.contains(&0));
        prop_assert!(delays.iter().all(|d| *d < n));
        // Falling behind may take a UAV backwards past the tour's first unit.
        let mut now: Vec<u32> = places
            .iter()
            .zip(&delays)
            .map(|(p, d)| (p % n + n - d) % n)
            .collect();
        now.sort_unstable();
        let k = now.len() as u32;
        for i in 0..now.len() {
            let next = if i + 1 == now.len() { now[0] + n } else { now[i + 1] };
            prop_assert!((next - now[i]).abs_diff(n / k) <= 1);
        }
    }
}

#[test]
fn mixed_speeds_take_the_better_pattern() {
    // Round: 3 at 2 are 6, 4 at 1 are 4. To and fro: 10 / 2 are 5.
    let p = patrol(120, &[1, 2, 3, 4]).unwrap();
    let uavs = vec![1, 2, 3];
    assert_eq!(p.pattern, Pattern::Round { uavs, speed: 2 });
    assert!((p.revisit_s - 20.0).abs() < 1e-12);
    // One fast and many slow: 2 n / 14 beats n / 7 by no rounding only.
    let p = patrol(140, &[7, 1, 3, 2, 1]).unwrap();
    assert!((p.revisit_s - 20.0).abs() < 1e-9, "{p:?}");
    assert!(patrol(10, &[0]).is_none());
    assert!(patrol(10, &[]).is_none());
}

#[test]
fn who_cannot_fly_one_period_rests() {
    let uav = |speed, longest_s| Uav { speed, longest_s };
    // Once round takes 100 s: the second one cannot, the others can.
    let p = patrol_within(1000, 0, &[uav(10, 200.0), uav(10, 99.0), uav(10, 100.0)]).unwrap();
    assert_eq!(
        p.pattern,
        Pattern::Round {
            uavs: vec![0, 2],
            speed: 10
        }
    );
    // Nobody can fly round, but each of three can fly its third to and fro.
    let p = patrol_within(1000, 0, &[uav(10, 70.0); 3]).unwrap();
    assert!(matches!(p.pattern, Pattern::Arcs { .. }), "{p:?}");
    assert!((66.0..67.0).contains(&p.revisit_s));
    assert!(patrol_within(1000, 0, &[uav(10, 60.0); 3]).is_none());
    // Turns at both ends take 10 s, and the slowest does nothing but turn.
    let p = patrol_within(1000, 50, &[uav(10, 80.0), uav(10, 80.0), uav(10, 80.0)]).unwrap();
    assert!((76.0..77.0).contains(&p.revisit_s), "{p:?}");
    assert!(patrol_within(1000, 50, &[uav(10, 70.0); 3]).is_none());
    let p = patrol_within(1000, 200, &[uav(100, 50.0), uav(1, 1e9)]).unwrap();
    assert!(!p.pattern.flies(1), "{p:?}");
}

fn legs(corners: &[(f64, f64)]) -> Vec<Leg> {
    let at = |c: &(f64, f64)| Point::new(c.0, c.1);
    let next = corners.iter().cycle().skip(1);
    let sides = corners.iter().zip(next);
    let leg = |(a, b)| Leg {
        curve: straight(at(a), at(b)),
        sees: true,
    };
    sides.map(leg).collect()
}

fn length_m(legs: &[Leg]) -> f64 {
    legs.iter().map(|leg| leg.curve.length_m()).sum()
}

#[test]
fn a_tour_is_measured_cut_and_asked() {
    let at = |x: f64, y: f64| Point::new(x, y);
    let corners = [(0.0, 0.0), (100.0, 0.0), (100.0, 50.0), (0.0, 50.0)];
    let tour = Tour::new(&legs(&corners), Curve::length_m).unwrap();
    assert_eq!(tour.len_mm(), 300_000);
    let near = |p: Point, q: Point| (p - q).norm() < 1e-6;
    assert!(near(tour.point(125_000), at(100.0, 25.0)));
    assert!(near(tour.point(300_000), at(0.0, 0.0)));
    assert_eq!(tour.nearest(at(120.0, 20.0)), 120_000);
    let over = tour.stretch(275_000, 50_000);
    assert!(over.len() == 1 && (length_m(&over) - 50.0).abs() < 1e-9);
    let pieces = over[0].curve.segments();
    assert!(near(pieces[0].start.position(), at(0.0, 25.0)));
    assert!(near(pieces[1].start.position(), at(0.0, 0.0)));
    assert!(near(over[0].curve.end().unwrap().position(), at(25.0, 0.0)));
    let round = tour.stretch(10_000, 300_000);
    assert!((length_m(&round) - 300.0).abs() < 1e-9);
    let cost = Curve::length_m;
    assert_eq!(Tour::new(&[], cost), Err(TourError::Empty));
    assert_eq!(
        Tour::new(&legs(&[(1.0, 1.0); 3]), cost),
        Err(TourError::Empty)
    );
    let far = legs(&[(0.0, 0.0), (1.0, 0.0)]);
    assert!(matches!(
        Tour::new(&far, |_| 1e9),
        Err(TourError::TooLong(_))
    ));
}

#[test]
fn arcs_of_a_tour_are_cut_to_the_millimetre_and_are_whole_again() {
    let turn = (1.0 / 30.0, 30.0 * PI);
    let oval = Curve::from_pieces(
        Pose::new(Point::origin(), 0.0),
        &[(0.0, 80.0), turn, (0.0, 80.0), turn],
    );
    let tour = Tour::new(
        &[Leg {
            curve: oval.clone(),
            sees: true,
        }],
        Curve::length_m,
    )
    .unwrap();
    let n = tour.len_mm();
    for (from, len) in [(0, n), (90_001, 140_000), (200_000, n), (n - 1, 5)] {
        let cut = tour.stretch(from, len);
        assert!((length_m(&cut) - f64::from(len) / 1000.0).abs() < 2e-3);
        let curve = &cut[0].curve;
        let told = (curve.largest_gap_m(), curve.segments().len());
        assert!(told.0 < 1e-6 && told.1 <= 6, "{from} {len}: {told:?}");
        let end = curve.end().unwrap().position();
        assert!((end - tour.point(from + len)).norm() < 2e-3);
        assert!((curve.max_curvature_per_m() - 1.0 / 30.0).abs() < 1e-12 || len == 5);
    }
    let high = tour.nearest(Point::new(120.0, 30.0));
    assert!((tour.point(high) - Point::new(110.0, 30.0)).norm() < 0.3);
}
