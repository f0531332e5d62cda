//! Ways beside the wanted one that keep clear of zones (D2.7 §2.3.1, §3.7).
//!
//! The envelope of the reactive layer has the last word: it turns a flight into a zone
//! into a loiter. An orbit that leads through a zone is bent before it comes to that. If the
//! wanted way of the next seconds keeps clear and leaves room for a loiter at its end, it is
//! flown; otherwise the held turn that deviates least from it and does.

use super::flyable::turn_rate_radps;
use super::follower::{Command, fly};
use crate::airframe::Airframe;
use crate::trajectory::wind::{Heading, Wind};
use skein_geometry::NoFlyZones;
use skein_geometry::Segment;
use skein_geometry::clearance::loiter_clear;
use skein_geometry::frame::Pose;

/// How far ahead the wanted way has to be clear, seconds.
pub const LOOK_S: f64 = 6.0;

/// Turns that are tried are held for so long, seconds.
const HOLD_S: f64 = 4.0;

/// Turns are tried in so many shares of the hardest one, to either side.
const SHARES: i32 = 8;

/// Zones and the distance to be kept from them.
#[derive(Clone, Copy, Debug)]
pub struct Guard<'a> {
    /// The zones.
    pub zones: &'a NoFlyZones,
    /// What has to stay between them and the UAV, metres.
    pub clearance_m: f64,
}

impl Guard<'_> {
    /// The turn rate to hold instead of the wanted way, rad/s; `None` if that may be flown, or
    /// nothing is better: then the envelope decides.
    #[must_use]
    pub fn bend(
        &self,
        airframe: &Airframe,
        pose: Pose,
        wind: Wind,
        wanted: &[Command],
    ) -> Option<f64> {
        if self.zones.zones().is_empty() || self.is_clear(airframe, pose, wind, wanted) {
            return None;
        }
        let first = wanted.first()?;
        let airspeed_mps = first.airspeed_mps;
        let most = turn_rate_radps(airframe, airspeed_mps);
        let mut tried: Vec<f64> = (-SHARES..=SHARES)
            .map(|k| most * f64::from(k) / f64::from(SHARES))
            .collect();
        // What is wanted over the time for which a turn is held.
        let lasting: f64 = wanted.iter().map(|c| c.lasts_s).sum();
        let turned: f64 = wanted.iter().map(|c| c.turn_rate_radps * c.lasts_s).sum();
        let mean = turned / lasting.max(f64::MIN_POSITIVE);
        tried.sort_by(|a, b| (a - mean).abs().total_cmp(&(b - mean).abs()));
        tried.into_iter().find(|rate| {
            let part = Command {
                lasts_s: HOLD_S / 16.0,
                turn_rate_radps: *rate,
                ..*first
            };
            self.is_clear(airframe, pose, wind, &[part; 16])
        })
    }

    /// Whether a way keeps clear, and a circle over the ground at its end does.
    fn is_clear(&self, airframe: &Airframe, pose: Pose, wind: Wind, way: &[Command]) -> bool {
        let mut at = pose;
        for c in way {
            let next = fly(&at, c, wind);
            let chord = Segment::straight(at.position(), next.position());
            // An arc strays from its chord by its angle times its length over eight.
            let turned_rad = (c.turn_rate_radps * c.lasts_s).abs();
            let stray_m = turned_rad * c.airspeed_mps * c.lasts_s / 8.0;
            if !self
                .zones
                .is_segment_clear(&chord, self.clearance_m + stray_m)
            {
                return false;
            }
            at = next;
        }
        let airspeed_mps = way.last().map_or(airframe.cruise_mps, |c| c.airspeed_mps);
        let course = wind.course_of(Heading(at.heading_rad), airspeed_mps).0;
        let radius_m = airframe.ground_turn_radius_m(airspeed_mps, wind.speed_mps());
        loiter_clear(
            self.zones,
            Pose::new(at.position(), course),
            radius_m,
            self.clearance_m,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::field::Field;
    use crate::tracking::flyable::tests::airframe;
    use crate::tracking::follower::{Follower, Settings, StandOff, TargetMotion};
    use crate::tracking::mode::Airspeeds;
    use skein_geometry::Polygon;
    use skein_geometry::frame::{Point, Vector};

    fn block(x: f64, y: f64, side: f64) -> Polygon {
        let corners = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)];
        Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap()
    }

    /// The least distance to the zones over ten minutes, and that to the orbit.
    fn flown(zones: &NoFlyZones, wind: Wind, guarded: bool) -> (f64, f64) {
        let mut follower = Follower::new(Settings {
            airframe: airframe(),
            airspeeds: Airspeeds::of(&airframe()),
            field: Field::HOPF,
            stand_off: StandOff::Distance(150.0),
        });
        let target = TargetMotion {
            position: Point::new(0.0, 0.0),
            velocity_mps: Vector::zeros(),
            acceleration_mps2: Vector::zeros(),
        };
        let guard = Guard {
            zones,
            clearance_m: 10.0,
        };
        let mut pose = Pose::new(Point::new(-400.0, 0.0), 0.0);
        let (mut nearest_m, mut on, mut all) = (f64::INFINITY, 0.0, 0.0);
        for k in 0..3_000 {
            let with = guarded.then_some(&guard);
            for c in follower.commands(pose, wind, &target, 0.2, with) {
                pose = fly(&pose, &c, wind);
                nearest_m = nearest_m.min(zones.distance_m(pose.position()));
            }
            if k > 500 {
                let off_m = (pose.position() - target.position).norm() - 150.0;
                on += f64::from(u8::from(off_m.abs() < 2.0));
                all += 1.0;
            }
        }
        (nearest_m, on / all)
    }

    #[test]
    fn an_orbit_bends_round_a_zone_and_comes_back() {
        let zones = NoFlyZones::new(vec![block(120.0, -30.0, 60.0)]);
        for wind in [Wind::CALM, Wind::new(3.0, -2.0)] {
            let (through_m, whole) = flown(&zones, wind, false);
            assert!(through_m < 1e-9 && whole > 0.99, "{through_m} {whole}");
            let (nearest_m, on) = flown(&zones, wind, true);
            assert!(nearest_m >= 10.0 - 1e-6, "{wind:?}: {nearest_m} m");
            assert!(on > 0.25, "{wind:?}: on the orbit for {on} of the time");
        }
    }

    #[test]
    fn a_clear_orbit_is_flown_as_without_zones() {
        let zones = NoFlyZones::new(vec![block(400.0, 400.0, 50.0)]);
        let (nearest_m, on) = flown(&zones, Wind::CALM, true);
        assert!(nearest_m > 100.0 && on > 0.99, "{nearest_m} {on}");
    }
}
