//! The wind of a run: the same everywhere, and from time to time another one (D2.7 §1.5.2).
//! Whether UAVs are told of it, or have to estimate it, belongs to it.

use skein_behaviors::Percept;
use skein_flight::trajectory::wind::Wind;
use skein_geometry::random::{SplitMix64, mix};

/// A wind that begins at a time, and lasts until the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// When, milliseconds.
    pub at_ms: u64,
    /// The wind from then on.
    pub wind: Wind,
}

/// How wrong airspeeds are where UAVs estimate the wind: of each UAV by a share that stays, drawn
/// evenly up to this, and at each percept by noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirspeedErrors {
    /// The largest share, 0 to 0.1.
    pub scale: f64,
    /// The standard deviation of the noise, m/s.
    pub noise_mps: f64,
}

/// The wind of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weather {
    /// The wind at time 0.
    pub first: Wind,
    /// What changes it, ascending by time.
    pub changes: Vec<Change>,
    /// Present where UAVs estimate the wind by their airspeed, heading and way over the ground;
    /// otherwise they are told it, as by an autopilot that does so for them.
    pub estimated: Option<AirspeedErrors>,
}

/// An estimated wind may be told to be stronger than any that blows by so much, m/s: turns are
/// laid out for that.
pub const ESTIMATE_MARGIN_MPS: f64 = 0.8;

impl From<Wind> for Weather {
    fn from(first: Wind) -> Self {
        Self {
            first,
            ..Self::default()
        }
    }
}

impl Weather {
    /// The wind at a time.
    #[must_use]
    pub fn at(&self, now_ms: u64) -> Wind {
        let begun = self.changes.partition_point(|c| c.at_ms <= now_ms);
        begun
            .checked_sub(1)
            .map_or(self.first, |last| self.changes[last].wind)
    }

    /// Since when it has been that, milliseconds.
    #[must_use]
    pub fn since_ms(&self, now_ms: u64) -> u64 {
        let begun = self.changes.partition_point(|c| c.at_ms <= now_ms);
        begun
            .checked_sub(1)
            .map_or(0, |last| self.changes[last].at_ms)
    }

    /// All winds that blow from one time to another.
    pub fn between(&self, from_ms: u64, to_ms: u64) -> impl Iterator<Item = Wind> + '_ {
        let begun = |now_ms| self.changes.partition_point(|c| c.at_ms <= now_ms);
        let later = &self.changes[begun(from_ms)..begun(to_ms.max(from_ms))];
        core::iter::once(self.at(from_ms)).chain(later.iter().map(|c| c.wind))
    }

    /// When the wind changes next after a time, milliseconds.
    #[must_use]
    pub fn next_after_ms(&self, now_ms: u64) -> Option<u64> {
        let begun = self.changes.partition_point(|c| c.at_ms <= now_ms);
        self.changes.get(begun).map(|c| c.at_ms)
    }

    /// All winds, in the order in which they blow.
    pub fn winds(&self) -> impl Iterator<Item = Wind> + '_ {
        let later = self.changes.iter().map(|c| c.wind);
        core::iter::once(self.first).chain(later)
    }

    /// The strongest wind.
    #[must_use]
    pub fn strongest(&self) -> Wind {
        let stronger = |a: Wind, b: Wind| {
            if b.speed_mps() > a.speed_mps() { b } else { a }
        };
        self.winds().fold(self.first, stronger)
    }

    /// The strongest wind that UAVs may take it for.
    #[must_use]
    pub fn strongest_held(&self) -> Wind {
        let most = self.strongest();
        let mps = most.speed_mps();
        match self.estimated {
            None => most,
            Some(_) if mps > 0.0 => {
                let grown = 1.0 + ESTIMATE_MARGIN_MPS / mps;
                Wind::new(most.east_mps * grown, most.north_mps * grown)
            }
            Some(_) => Wind::new(ESTIMATE_MARGIN_MPS, 0.0),
        }
    }

    /// A percept as a UAV has it whose number this is, in a run of this seed.
    #[must_use]
    pub fn sensed(&self, percept: Percept, seed: u64, uav: u16) -> Percept {
        let Some(errors) = self.estimated else {
            return percept;
        };
        let of_uav = mix(seed ^ u64::from(uav) << 32);
        let scale = errors.scale * (2.0 * SplitMix64::new(of_uav).unit() - 1.0);
        let mut random = SplitMix64::new(mix(of_uav ^ percept.time_ms));
        let noise_mps = errors.noise_mps * random.normal();
        Percept {
            airspeed_mps: (percept.airspeed_mps * (1.0 + scale) + noise_mps).max(0.0),
            wind_east_mps: 0.0,
            wind_north_mps: 0.0,
            wind_unknown: true,
            ..percept
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::motion::kinematic::Kinematic;
    use skein_geometry::frame::{Point, Pose};

    fn shifting() -> Weather {
        let change = |at_ms, east_mps| Change {
            at_ms,
            wind: Wind::new(east_mps, 0.0),
        };
        Weather {
            first: Wind::new(0.0, 2.0),
            changes: vec![change(10_000, 5.0), change(20_000, -1.0)],
            estimated: None,
        }
    }

    #[test]
    fn each_wind_blows_until_the_next_one() {
        let w = shifting();
        let east = [0, 9_999, 10_000, 19_999, 20_000, 90_000].map(|t| w.at(t).east_mps);
        assert_eq!(
            east.map(f64::to_bits),
            [0.0, 0.0, 5.0, 5.0, -1.0, -1.0].map(f64::to_bits)
        );
        let since = [0, 9_999, 10_000, 30_000].map(|t| w.since_ms(t));
        assert_eq!(since, [0, 0, 10_000, 20_000]);
        let blow = |from_ms, to_ms| w.between(from_ms, to_ms).count();
        assert_eq!(
            [blow(0, 9_999), blow(0, 10_000), blow(10_000, 90_000)],
            [1, 2, 2]
        );
        let next = [0, 9_999, 10_000, 20_000].map(|t| w.next_after_ms(t));
        assert_eq!(next, [Some(10_000), Some(10_000), Some(20_000), None]);
        assert!((w.strongest().speed_mps() - 5.0).abs() < 1e-12);
        assert!((w.strongest_held().speed_mps() - 5.0).abs() < 1e-12);
    }

    #[test]
    fn who_estimates_is_told_no_wind_and_an_airspeed_with_its_errors() {
        let errors = AirspeedErrors {
            scale: 0.03,
            noise_mps: 0.3,
        };
        let w = Weather {
            estimated: Some(errors),
            ..shifting()
        };
        assert!((w.strongest_held().speed_mps() - 5.8).abs() < 1e-12);
        let flies = Kinematic::new(
            crate::world::fixture::airframe(),
            Pose::new(Point::new(0.0, 0.0), 0.0),
            45.0,
            0,
        );
        let true_one = flies.percept().unwrap();
        let at = |uav, time_ms| {
            let p = Percept {
                time_ms,
                airspeed_mps: 15.0,
                wind_east_mps: 5.0,
                ..true_one
            };
            w.sensed(p, 7, uav)
        };
        assert!(at(1, 0).wind_unknown && at(1, 0).wind_east_mps.abs() < 1e-12);
        assert_eq!(at(1, 200), at(1, 200));
        let n = 400_u32;
        let mean = |uav| {
            (0..n)
                .map(|k| at(uav, 200 * u64::from(k)).airspeed_mps)
                .sum::<f64>()
                / f64::from(n)
        };
        let biases = [1, 2, 3, 4].map(|uav| mean(uav) - 15.0);
        assert!(biases.iter().all(|b| b.abs() < 0.45 + 0.06), "{biases:?}");
        assert!(biases.iter().any(|b| b.abs() > 0.1), "{biases:?}");
        let first = at(1, 0).airspeed_mps;
        assert!((1..50).any(|k| (at(1, 200 * k).airspeed_mps - first).abs() > 0.3));
    }
}
