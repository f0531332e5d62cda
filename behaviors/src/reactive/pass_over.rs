//! Passing over aircraft that are no members (D2.7 §1.2.3, reactive layer): a unilateral rule for
//! UAVs whose way over the ground was promised to others.
//!
//! Where UAVs fly at one height, what is above is nobody's. What an intruder does next nobody
//! knows; it is taken to fly straight on. Where it comes near what is flown next, the lowest height
//! is flown from which it stays far enough below, or above; once nobody comes near any more the
//! UAV comes down again. The way over the ground stays what was promised.
//!
//! # Guarantees
//! None, if an intruder is faster, turns, or comes from nearer than [`least_range_m`]; measured in
//! docs/protocol.md §11. Nobody comes below the height of its mission.
//!
//! # Complexity
//! As long as nobody is near a look at each intruder; else O(intruders² · samples), some ten
//! thousand arithmetic steps.

use super::well_clear::{KEPT_HEIGHT_M, KEPT_M};
use crate::traffic::Aircraft;
use skein_geometry::frame::Point;

/// Who comes nearer over the ground is looked at, metres.
const NEAR_M: f64 = 1.3 * KEPT_M;

/// Where nothing is promised yet a UAV may get beside what is reckoned with by so much, m/s, and at
/// most, metres.
const BESIDE_MPS: f64 = 4.0;
const BESIDE_MOST_M: f64 = 30.0;

/// What is asked for in height, metres: heights are held to some.
const ASKED_M: f64 = KEPT_HEIGHT_M + 1.0;

/// And where another height is chosen, metres.
const OVER_M: f64 = KEPT_HEIGHT_M + 4.0;

/// So long it takes until a climb begins, seconds.
const REACTION_S: f64 = 2.0;

/// Most that is looked ahead, seconds, and in which steps.
const AHEAD_MOST_S: f64 = 60.0;
const STEP_S: f64 = 0.5;

/// How a UAV flies.
#[derive(Clone, Copy, Debug)]
pub struct Level {
    /// How high it is, metres.
    pub height_m: f64,
    /// At which height its mission is flown, metres.
    pub level_m: f64,
    /// How fast it climbs and descends, m/s.
    pub climb_mps: f64,
}

/// So long it takes to pass over one, seconds: from as far below as counts to above it.
#[must_use]
pub fn passes_s(climb_mps: f64) -> f64 {
    REACTION_S + (ASKED_M + OVER_M) / climb_mps.max(0.1)
}

/// How far ahead is looked, seconds: twice as long, where two come one after the other.
fn ahead_s(climb_mps: f64) -> f64 {
    (2.0 * passes_s(climb_mps)).min(AHEAD_MOST_S)
}

/// How far aircraft have to be sensed for a UAV to pass over one that flies straight at it,
/// metres.
#[must_use]
pub fn least_range_m(own_mps: f64, climb_mps: f64, their_mps: f64) -> f64 {
    NEAR_M + (own_mps + their_mps) * ahead_s(climb_mps)
}

/// The height to fly to, metres; each of `ways` tells where it may be over the ground after so many
/// seconds, for certain as long as what is promised lasts.
#[must_use]
pub fn height_m(
    own: &Level,
    aircraft: &[Aircraft],
    ways: &[&dyn Fn(f64) -> Point],
    promised_s: f64,
) -> f64 {
    let ahead_s = ahead_s(own.climb_mps);
    let times = (0..).map(|k| STEP_S * f64::from(k));
    let times: Vec<f64> = times.take_while(|t| *t <= ahead_s).collect();
    let flown: Vec<Vec<Point>> = ways
        .iter()
        .map(|way| times.iter().map(|t| way(*t)).collect())
        .collect();
    let mut near: Vec<&Aircraft> = Vec::new();
    let mut meets: Vec<(f64, f64)> = Vec::new();
    for a in aircraft {
        // Between two samples it may come nearer.
        let near_m = NEAR_M + a.velocity_mps().norm() * STEP_S;
        let comes_near = |k: usize| {
            let there = a.at() + a.velocity_mps() * times[k];
            let beside_m = BESIDE_MPS * (times[k] - promised_s).max(0.0);
            let near_m = near_m + beside_m.min(BESIDE_MOST_M);
            flown.iter().any(|way| (way[k] - there).norm() < near_m)
        };
        let met = (0..times.len()).filter(|k| comes_near(*k));
        let before = meets.len();
        meets.extend(met.map(|k| (times[k], a.height_m())));
        if meets.len() > before {
            near.push(a);
        }
    }
    if near.is_empty() {
        return own.level_m;
    }
    let keeps_m = |to_m: f64, until_s: f64| {
        let met = meets.iter().filter(|(t, _)| *t <= until_s);
        let apart = met.map(|(t, height_m)| {
            let most_m = own.climb_mps * t;
            let flown_m = own.height_m + (to_m - own.height_m).clamp(-most_m, most_m);
            (flown_m - height_m).abs()
        });
        apart.fold(f64::INFINITY, f64::min)
    };
    let mut heights: Vec<f64> = near
        .iter()
        .flat_map(|a| [a.height_m() - OVER_M, a.height_m() + OVER_M])
        .chain([own.height_m])
        .filter(|h| *h > own.level_m)
        .chain([own.level_m])
        .collect();
    heights.sort_by(f64::total_cmp);
    if let Some(clear) = heights.iter().find(|h| keeps_m(**h, ahead_s) >= ASKED_M) {
        return *clear;
    }
    // Whoever comes first goes before.
    let soon_s = passes_s(own.climb_mps);
    let worth = |h: &f64| (keeps_m(*h, soon_s).min(ASKED_M), keeps_m(*h, ahead_s));
    let widest = heights.iter().rev().max_by(|a, b| {
        let (a, b) = (worth(a), worth(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    widest.copied().unwrap_or(own.level_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::aircraft;
    use skein_geometry::frame::Vector;
    use skein_geometry::math::{TAU, sin_cos};
    use skein_geometry::random::SplitMix64;

    /// Flies straight on among aircraft that cross; how near one came over the ground while it was
    /// nearer in height than is kept, and how high the UAV flew at most.
    fn flies(seed: u64, climb_mps: f64, passes: bool) -> (f64, f64, f64) {
        let mut random = SplitMix64::new(seed);
        let mut own = Level {
            height_m: 60.0,
            level_m: 60.0,
            climb_mps,
        };
        let crossings = (0..3).map(|k| {
            let meets_s = 70.0 + 60.0 * f64::from(k) + 20.0 * random.unit();
            let (s, c) = sin_cos(TAU * random.unit());
            let v = Vector::new(c, s) * (15.0 + 35.0 * random.unit());
            let beside = Vector::new(-s, c) * (60.0 * random.unit() - 30.0);
            let there = Point::new(13.0 * meets_s, 0.0) + beside;
            (there - v * meets_s, v, 50.0 + 30.0 * random.unit())
        });
        let crossings: Vec<(Point, Vector, f64)> = crossings.collect();
        let range_m = least_range_m(13.0, climb_mps, 50.0);
        let (mut nearest_m, mut most_m, mut least_m) = (f64::INFINITY, 0.0_f64, f64::INFINITY);
        for k in 0..1_300_u32 {
            let t = 0.2 * f64::from(k);
            let here = Point::new(13.0 * t, 0.0);
            let all = crossings.iter().map(|(from, v, h)| (from + v * t, *v, *h));
            let all: Vec<(Point, Vector, f64)> = all.collect();
            let sensed = all.iter().filter(|(at, ..)| (at - here).norm() < range_m);
            let sensed: Vec<Aircraft> = sensed.map(|(at, v, h)| aircraft(*at, *v, *h)).collect();
            let to_m = if passes {
                height_m(
                    &own,
                    &sensed,
                    &[&|s| here + Vector::new(13.0 * s, 0.0)],
                    9.0,
                )
            } else {
                own.level_m
            };
            let step_m = 0.2 * climb_mps;
            own.height_m += (to_m - own.height_m).clamp(-step_m, step_m);
            most_m = most_m.max(own.height_m);
            least_m = least_m.min(own.height_m);
            for (at, _, h) in &all {
                if (h - own.height_m).abs() < KEPT_HEIGHT_M {
                    nearest_m = nearest_m.min((at - here).norm());
                }
            }
        }
        assert!((own.height_m - own.level_m).abs() < 1e-9, "it comes down");
        (nearest_m, most_m, least_m)
    }

    #[test]
    fn who_keeps_its_way_passes_over_and_comes_down_again() {
        let mut climbed = 0;
        for seed in 0..400 {
            let climb_mps = [1.5, 3.0, 5.0][(seed % 3) as usize];
            let (nearest_m, most_m, least_m) = flies(seed, climb_mps, true);
            assert!(nearest_m > KEPT_M, "{seed}: {nearest_m} m");
            assert!(
                least_m >= 60.0 && most_m < 120.0,
                "{seed}: {least_m} {most_m}"
            );
            climbed += u32::from(most_m > 60.5);
        }
        assert!(climbed > 200, "{climbed}");
        let near = (0..40).filter(|seed| flies(*seed, 3.0, false).0 < KEPT_M);
        assert!(near.count() > 20, "who does nothing meets them");
    }

    #[test]
    fn nobody_climbs_for_what_passes_far_away_or_high_above() {
        let own = Level {
            height_m: 60.0,
            level_m: 60.0,
            climb_mps: 3.0,
        };
        let place = |s: f64| Point::new(13.0 * s, 0.0);
        let across = |north_m: f64, height_m: f64| {
            aircraft(Point::new(100.0, north_m), Vector::new(0.0, 30.0), height_m)
        };
        let fly = |a: Aircraft| height_m(&own, &[a], &[&place], f64::INFINITY);
        assert!(fly(across(-230.0, 60.0)) > 75.0, "it meets this one");
        for other in [
            across(-230.0, 79.0),
            across(-900.0, 60.0),
            across(90.0, 60.0),
        ] {
            assert!((fly(other) - 60.0).abs() < 1e-9, "{other:?}");
        }
    }
}
