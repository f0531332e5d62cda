//! How UAVs fly in the wind of their mission: the radius of turns, what a crabbing camera
//! sees, the pace along the loop, its energy, the way home, who cannot fly at all
//! (D2.7 §2.4.2).
//!
//! Estimates for feasibility; what is flown is the executive's.

use skein_flight::airframe::Airframe;
use skein_flight::coverage::ring::{CoverageLoop, Direction};
use skein_flight::trajectory::Trajectory;
use skein_flight::trajectory::wind::{Performance, Wind, turn_round_s};
use skein_netsim::spec::{Spec, UavSpec};

/// Turning round on the spot, in turn radii: the shortest curve from a pose to its
/// reverse is 7/3 of a half circle.
const TURN_ROUND_RADII: f64 = 7.0 / 3.0 * core::f64::consts::PI;

/// The radius that turns over the ground should have for an airframe, metres: in calm
/// air that of its cruise; in a wind wide enough to follow them downwind at cruise, or
/// as wide as lanes allow, for a wider turn lets it fly faster.
pub(crate) fn turn_radius_m(airframe: &Airframe, wind: Wind, spacing_m: f64) -> f64 {
    let calm_m = airframe.min_turn_radius_m();
    if wind.speed_mps() <= 0.0 {
        return calm_m;
    }
    let at_cruise_m = airframe.ground_turn_radius_m(airframe.cruise_mps, wind.speed_mps());
    calm_m.max(at_cruise_m.min(0.5 * spacing_m))
}

/// The airspeed at which turns of a radius over the ground are flown in the wind, m/s.
pub(crate) fn turning_mps(airframe: &Airframe, wind_mps: f64, radius_m: f64) -> f64 {
    if wind_mps <= 0.0 {
        return airframe.cruise_mps;
    }
    let wanted = airframe.airspeed_for_turns_mps(radius_m, wind_mps);
    wanted.max(airframe.least_airspeed_mps())
}

fn airspeed_mps(u: &UavSpec, spec: &Spec) -> f64 {
    let radius_m = spec.mission.turn_radius_m();
    turning_mps(
        &u.airframe,
        spec.wind.strongest_held().speed_mps(),
        radius_m,
    )
}

/// Half the footprint across and along the course that the camera sees for certain,
/// metres: in a wind the nose, and the picture with it, is turned from the course by up
/// to the angle whose sine is the wind's share of the airspeed. The largest such
/// rectangle of the picture's own proportions.
pub(crate) fn footprint_m(airframe: &Airframe, wind: Wind, radius_m: f64) -> (f64, f64) {
    let (across_m, along_m) = (airframe.footprint_across_m, airframe.footprint_along_m);
    let airspeed_mps = turning_mps(airframe, wind.speed_mps(), radius_m);
    if airframe.airspeed_for_turns_mps(radius_m, wind.speed_mps()) < airspeed_mps {
        // The wind itself will be refused, which tells more than a camera that is too small.
        return (across_m, along_m);
    }
    let s = (wind.speed_mps() / airspeed_mps).min(1.0);
    let c = (1.0 - s * s).sqrt();
    let share = (across_m / (across_m * c + along_m * s))
        .min(along_m / (along_m * c + across_m * s))
        .min(1.0);
    (across_m * share, along_m * share)
}

/// How fast a UAV gets on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pace {
    /// Along the loop over the ground, on average over both ways round, m/s; zero where
    /// the wind forbids a part of it.
    pub(crate) loop_mps: f64,
    /// Over the ground on the worst course, m/s; not positive where it makes no way.
    pub(crate) least_mps: f64,
    /// Time to turn round, seconds.
    pub(crate) turn_s: f64,
}

/// The straight way home from the farthest boundary of the loop with a turn at each end,
/// seconds; detours round zones are not in it. The executive reckons likewise, course by
/// course (`Executive::return_ms`).
pub(crate) fn return_s(pace: &Pace, spec: &Spec, the_loop: &CoverageLoop) -> f64 {
    let base = spec.mission.base_m();
    let far_m = (0..the_loop.len())
        .map(|i| (the_loop.boundary(i).position() - base).norm())
        .fold(0.0, f64::max);
    far_m / pace.least_mps.max(0.0) + 2.0 * pace.turn_s
}

impl Pace {
    /// The pace of a UAV in the wind of its scenario.
    pub(crate) fn of(u: &UavSpec, spec: &Spec, the_loop: &CoverageLoop) -> Self {
        let wind = spec.wind.strongest();
        let (v, w) = (airspeed_mps(u, spec), wind.speed_mps());
        if w <= 0.0 {
            let radius_m = u.airframe.min_turn_radius_m();
            return Self {
                loop_mps: v,
                least_mps: v,
                turn_s: TURN_ROUND_RADII * radius_m / v,
            };
        }
        let uav = Performance::of(&u.airframe, v);
        Self {
            loop_mps: loop_mps(the_loop, v, wind),
            least_mps: v - w,
            turn_s: turn_round_s(uav, wind).unwrap_or(f64::INFINITY),
        }
    }
}

/// Mean speed over the ground along the loop, both ways, m/s.
fn loop_mps(the_loop: &CoverageLoop, airspeed_mps: f64, wind: Wind) -> f64 {
    let both = [Direction::Forward, Direction::Backward];
    let (mut way_m, mut time_s) = (0.0, 0.0);
    for i in 0..the_loop.len() {
        for direction in both {
            let curve = the_loop.curve(i, direction);
            way_m += curve.length_m();
            time_s += Trajectory::along(&curve, airspeed_mps, wind)
                .map_or(f64::INFINITY, |t| t.duration_s());
        }
    }
    way_m / time_s
}

/// Energy to fly a loop once, in seconds of level cruise, averaged over airframes and
/// both ways round; `None` where the wind forbids a part of it.
pub(crate) fn loop_energy_s(
    the_loop: &CoverageLoop,
    airframes: &[Airframe],
    wind: Wind,
    radius_m: f64,
) -> Option<f64> {
    let mut kinds: Vec<(Airframe, f64)> = Vec::new();
    for a in airframes {
        match kinds.iter_mut().find(|k| k.0 == *a) {
            Some(kind) => kind.1 += 1.0,
            None => kinds.push((*a, 1.0)),
        }
    }
    let mut sum = 0.0;
    for (airframe, count) in &kinds {
        let airspeed_mps = turning_mps(airframe, wind.speed_mps(), radius_m);
        for i in 0..the_loop.len() {
            for way in [Direction::Forward, Direction::Backward] {
                let flown = Trajectory::along(&the_loop.curve(i, way), airspeed_mps, wind).ok()?;
                sum += count * flown.energy_s(airframe);
            }
        }
    }
    Some(sum / (2.0 * airframes.len().max(1) as f64))
}

/// What to say when the wind carries a UAV away, or out of the turns of the loop even
/// at its slowest.
pub(crate) fn too_windy(spec: &Spec) -> Option<String> {
    let wind_mps = spec.wind.strongest_held().speed_mps();
    if wind_mps <= 0.0 {
        return None;
    }
    let blows = match spec.wind.estimated {
        None => format!("a wind of {wind_mps:.1} m/s"),
        Some(_) => format!(
            "a wind of {:.1} m/s, taken for {wind_mps:.1} m/s at most by who estimates it,",
            spec.wind.strongest().speed_mps()
        ),
    };
    let drifting = spec.uavs.iter().find(|u| airspeed_mps(u, spec) <= wind_mps);
    if let Some(u) = drifting {
        return Some(format!(
            "{blows} carries UAV {} away, which flies {:.1} m/s through the air; expected less wind than that",
            u.id,
            airspeed_mps(u, spec)
        ));
    }
    let radius_m = spec.mission.turn_radius_m();
    let spare_mps = |u: &UavSpec| {
        let slowest_mps = u.airframe.least_airspeed_mps();
        u.airframe.airspeed_for_turns_mps(radius_m, wind_mps) - slowest_mps
    };
    let worst = spec
        .uavs
        .iter()
        .min_by(|a, b| spare_mps(a).total_cmp(&spare_mps(b)))?;
    let most_mps = wind_mps + spare_mps(worst);
    (most_mps < wind_mps).then(|| {
        let a = &worst.airframe;
        let wide_m = a.ground_turn_radius_m(a.least_airspeed_mps(), wind_mps);
        format!(
            "{blows} carries UAV {} out of turns of {radius_m} m even at its slowest; at most {:.1} m/s, or wider lanes: {:.0} m",
            worst.id,
            most_mps.max(0.0),
            (2.0 * wide_m).ceil()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::math::sin_cos;
    use skein_netsim::world::fixture;

    fn with(wind: Wind) -> Spec {
        let mut spec = fixture::square(3);
        spec.wind = wind.into();
        spec
    }

    #[test]
    fn winds_that_carry_away_or_out_of_turns_are_told_with_the_uav() {
        assert_eq!(too_windy(&with(Wind::CALM)), None);
        assert_eq!(too_windy(&with(Wind::new(0.0, 2.0))), None);
        let out_of_turns = too_windy(&with(Wind::new(0.0, -7.0))).unwrap();
        assert!(
            out_of_turns.contains("UAV 1 out of turns of 23 m"),
            "{out_of_turns}"
        );
        let away = too_windy(&with(Wind::new(-30.0, 0.0))).unwrap();
        assert!(away.contains("carries UAV 1 away"), "{away}");
    }

    #[test]
    fn the_pace_on_a_closed_loop_is_less_in_any_wind() {
        let calm = with(Wind::CALM);
        let ground = calm.mission.geometry().unwrap();
        let the_loop = &ground.coverage_loop;
        let pace = |spec: &Spec| Pace::of(&spec.uavs[0], spec, the_loop);
        let before = pace(&calm);
        for i in 0..8 {
            let (s, c) = sin_cos(f64::from(i) * 0.8);
            let spec = with(Wind::new(2.5 * c, 2.5 * s));
            let now = pace(&spec);
            assert!(
                now.loop_mps < before.loop_mps && now.loop_mps > now.least_mps,
                "{now:?}"
            );
            assert!(now.turn_s.is_finite() && now.turn_s > 0.0);
            assert!(return_s(&now, &spec, the_loop) > return_s(&before, &calm, the_loop));
        }
        let storm = with(Wind::new(40.0, 0.0));
        assert!(pace(&storm).loop_mps <= 0.0 && pace(&storm).turn_s.is_infinite());
    }

    #[test]
    fn a_crabbing_camera_sees_a_smaller_rectangle_for_certain() {
        let a = fixture::airframe();
        let (across_m, along_m) = footprint_m(&a, Wind::CALM, 23.0);
        assert!((across_m - a.footprint_across_m).abs() < 1e-12);
        assert!((along_m - a.footprint_along_m).abs() < 1e-12);
        let wind = Wind::new(1.5, -2.0);
        let (across_m, along_m) = footprint_m(&a, wind, 23.0);
        let most_rad = (2.5 / turning_mps(&a, 2.5, 23.0)).asin();
        let mut touches = false;
        for i in -10..=10 {
            let (s, c) = sin_cos(most_rad * f64::from(i) / 10.0);
            for side in [1.0, -1.0] {
                let (x, y) = (across_m, side * along_m);
                let (out, ahead) = ((x * c + y * s).abs(), (y * c - x * s).abs());
                assert!(out <= a.footprint_across_m + 1e-9 && ahead <= a.footprint_along_m + 1e-9);
                touches |= ahead > a.footprint_along_m - 1e-6;
            }
        }
        assert!(touches, "no smaller than need be");
    }
}
