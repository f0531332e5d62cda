//! Loiter or weave (D2.7 §3.7.2): the mode with the smaller predicted distance, not a fixed
//! ratio of speeds.
//!
//! A loiter as wide as was asked for is flown as long as it can be. Where the target is too
//! fast for that, the wider circle that can be flown is compared with the weave.
//!
//! | mode | least circle / asked | circle / weave | next |
//! |---|---|---|---|
//! | loiter | above [`TOO_WIDE`] | above [`LEAVE_LOITER`] | weave |
//! | loiter | otherwise | | loiter |
//! | weave | below [`FITS`] | | loiter |
//! | weave | | below [`LEAVE_WEAVE`] | loiter |
//! | weave | otherwise | | weave |
//!
//! Between the thresholds the mode stays. At one airspeed the band is 1.3 m/s of the target's
//! speed wide, for there the weave's width changes by a third with each m/s. So what is
//! compared is the speed's mean over some seconds ([`MEAN_S`]): of an estimate that trembles by
//! 0.5 m/s that trembles by 0.1.

use super::flyable::least_radius_m;
use super::weave::Weave;
use crate::airframe::Airframe;
use serde::{Deserialize, Serialize};

/// A circle is too wide if it is so many times the asked one.
pub const TOO_WIDE: f64 = 1.1;

/// A circle fits again if it is below so many times the asked one.
pub const FITS: f64 = 0.95;

/// A loiter that is too wide and so many times as far as a weave is left for it.
pub const LEAVE_LOITER: f64 = 1.35;

/// A weave is left for a loiter of at most so many times its distance.
pub const LEAVE_WEAVE: f64 = 0.85;

/// The time constant of the mean speed that modes are chosen by, seconds.
pub const MEAN_S: f64 = 2.0;

/// A loiter flies this much faster than its target, so that its slowest part over the
/// target does not stretch for ever.
const FASTER: f64 = 1.35;

/// A weave flies at least this much faster than its target: what is left closes up.
const AHEAD: f64 = 1.005;

/// Circles are a little wider than the least, so that there is something left to steer.
const ROOM: f64 = 1.03;

/// How a target is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// A circle about it.
    Loiter,
    /// A sinusoid along its way; straight where the target is as fast as the UAV.
    Weave,
}

/// The airspeeds that may be flown, m/s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Airspeeds {
    /// The least.
    pub least_mps: f64,
    /// The most.
    pub most_mps: f64,
}

impl Airspeeds {
    /// All that an airframe has.
    #[must_use]
    pub fn of(airframe: &Airframe) -> Self {
        Self {
            least_mps: airframe.least_airspeed_mps(),
            most_mps: airframe.max_mps,
        }
    }

    /// For a loiter about a target that drifts through the air, m/s: the slower, the
    /// tighter.
    #[must_use]
    pub fn of_loiter_mps(&self, drift_mps: f64) -> f64 {
        (FASTER * drift_mps).max(self.least_mps).min(self.most_mps)
    }

    /// For a weave along with it, m/s: as slow as the target, if the wing bears it.
    #[must_use]
    pub fn of_weave_mps(&self, drift_mps: f64) -> f64 {
        (AHEAD * drift_mps).max(self.least_mps).min(self.most_mps)
    }
}

/// How far each mode would be from the target at most, metres; `None` if it cannot be flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prospect {
    /// The distance that was asked for.
    pub stand_off_m: f64,
    /// The least radius that can be flown.
    pub least_radius_m: Option<f64>,
    /// Loitering: the radius that was asked for, or the least.
    pub loiter_m: Option<f64>,
    /// Weaving.
    pub weave_m: Option<f64>,
}

impl Prospect {
    /// For a target that drifts at `drift_mps` and is to be kept at `stand_off_m`.
    #[must_use]
    pub fn of(
        airframe: &Airframe,
        airspeeds: &Airspeeds,
        drift_mps: f64,
        stand_off_m: f64,
    ) -> Self {
        let loiter_mps = airspeeds.of_loiter_mps(drift_mps);
        let least_m = least_radius_m(airframe, loiter_mps, drift_mps, 0.0);
        let least_radius_m = least_m.map(|m| ROOM * m);
        let weave_mps = airspeeds.of_weave_mps(drift_mps);
        let weave = Weave::of(weave_mps / drift_mps, airframe.turn_radius_m(weave_mps));
        Self {
            stand_off_m,
            least_radius_m,
            loiter_m: least_radius_m.map(|m| m.max(stand_off_m)),
            weave_m: weave.map(|w| w.farthest_m()),
        }
    }

    /// The mode after `now`.
    #[must_use]
    pub fn next(&self, now: Mode) -> Mode {
        match (self.least_radius_m, self.weave_m) {
            (Some(circle_m), Some(weave_m)) => {
                let too_wide = circle_m > TOO_WIDE * self.stand_off_m;
                let fits = circle_m <= FITS * self.stand_off_m;
                match now {
                    Mode::Loiter if too_wide && circle_m > LEAVE_LOITER * weave_m => Mode::Weave,
                    Mode::Weave if fits || circle_m <= LEAVE_WEAVE * weave_m => Mode::Loiter,
                    stays => stays,
                }
            }
            (Some(_), None) => Mode::Loiter,
            // Also who is outrun: it goes after the target.
            (None, _) => Mode::Weave,
        }
    }
}

/// The mode that is flown, and the mean speed that it goes by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Switch {
    /// The mode, and the target's mean speed through the air, m/s; nothing before the first
    /// look.
    state: Option<(Mode, f64)>,
    /// How often it changed.
    changes: u32,
}

impl Switch {
    /// Takes in the speed of a target through the air over the last `over_s` seconds, and
    /// tells the mode and what each would come to.
    pub fn update(
        &mut self,
        airframe: &Airframe,
        airspeeds: &Airspeeds,
        drift_mps: f64,
        stand_off_m: f64,
        over_s: f64,
    ) -> (Mode, Prospect) {
        let mean_mps = match self.state {
            Some((_, m)) if m.is_finite() => m + (drift_mps - m) * (over_s / MEAN_S).min(1.0),
            _ => drift_mps,
        };
        let prospect = Prospect::of(airframe, airspeeds, mean_mps, stand_off_m);
        let mode = match self.state {
            Some((was, _)) => prospect.next(was),
            None => prospect.next(Mode::Loiter),
        };
        self.changes += u32::from(self.state.is_some_and(|(was, _)| was != mode));
        self.state = Some((mode, mean_mps));
        (mode, prospect)
    }

    /// How often the mode has changed.
    #[must_use]
    pub fn changes(&self) -> u32 {
        self.changes
    }

    /// The mode that is flown, once there is one.
    #[must_use]
    pub fn mode(&self) -> Option<Mode> {
        self.state.map(|(mode, _)| mode)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::flyable::tests::airframe;
    use proptest::prelude::*;
    use skein_geometry::random::SplitMix64;

    fn one_speed() -> Airspeeds {
        Airspeeds {
            least_mps: 20.0,
            most_mps: 20.0,
        }
    }

    fn at(drift_mps: f64, stand_off_m: f64) -> Prospect {
        Prospect::of(&airframe(), &one_speed(), drift_mps, stand_off_m)
    }

    #[test]
    fn slow_targets_are_circled_and_fast_ones_accompanied() {
        assert_eq!(at(2.0, 120.0).next(Mode::Weave), Mode::Loiter);
        assert_eq!(at(18.0, 120.0).next(Mode::Loiter), Mode::Weave);
        // Faster than the UAV: nothing holds, and it goes after.
        let outrun = at(25.0, 120.0);
        assert_eq!((outrun.loiter_m, outrun.weave_m), (None, None));
        assert_eq!(outrun.next(Mode::Loiter), Mode::Weave);
        assert_eq!(at(f64::NAN, 120.0).next(Mode::Loiter), Mode::Weave);
        // A still target has no way to weave along.
        assert_eq!(at(0.0, 120.0).next(Mode::Weave), Mode::Loiter);
    }

    #[test]
    fn at_one_airspeed_the_modes_meet_where_their_distances_do() {
        // 20 m/s and 30°: by hand at a ratio of 1.5, where both come to some 200 m.
        let p = at(20.0 / 1.5, 100.0);
        let (loiter_m, weave_m) = (p.loiter_m.unwrap(), p.weave_m.unwrap());
        assert!((loiter_m - 1.03 * 196.0).abs() < 2.0, "{loiter_m}");
        assert!((190.0..230.0).contains(&weave_m), "{weave_m}");
    }

    #[test]
    fn an_estimate_that_trembles_does_not_switch_to_and_fro() {
        let mut random = SplitMix64::new(5);
        // Whatever the speed, also just where a mode is left.
        for tenths in (60..190).step_by(5) {
            let drift_mps = f64::from(tenths) / 10.0;
            let mut switch = Switch::default();
            for _ in 0..1_000 {
                // Up to 1.75 m/s, in the mean 0.5.
                let noise: f64 = (0..4).map(|_| random.unit() - 0.5).sum();
                let seen_mps = drift_mps + 0.87 * noise;
                switch.update(&airframe(), &one_speed(), seen_mps, 100.0, 0.2);
            }
            assert!(
                switch.changes() <= 1,
                "{drift_mps} m/s: {}",
                switch.changes()
            );
        }
    }

    proptest! {
        /// What may be flown slower is not farther away.
        #[test]
        fn a_choice_of_airspeeds_never_harms(drift in 0.0..19.0_f64, stand_off in 50.0..300.0_f64) {
            let free = Airspeeds::of(&airframe());
            let best = |s: &Airspeeds| {
                let p = Prospect::of(&airframe(), s, drift, stand_off);
                let both = [p.loiter_m, p.weave_m.map(|m| m.max(stand_off))];
                both.into_iter().flatten().fold(f64::INFINITY, f64::min)
            };
            prop_assert!(best(&free) <= best(&one_speed()) * 1.02 + 1e-9);
        }
    }
}
