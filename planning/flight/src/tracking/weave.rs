//! Sinusoids whose mean progress is that of a slower target (D2.7 §3.7.2, after Lee,
//! Huang, Vaughn, Xiao, Hedrick, Zennaro and Sengupta, "Strategies of path-planning for a
//! UAV to track a ground vehicle", 2003).
//!
//! Of a curve y = A sin(2πx/D) with A′ = 2πA/D the length is σ times its progress with
//!
//! σ = (2/π) √(1 + A′²) E(A′²/(1 + A′²)),
//!
//! so the ratio of speeds determines A′ alone, and A and D grow together: how far depends
//! on what the airframe turns, 2πA′/D ≤ 1/R at the crests. D2.7 calls the period
//! arbitrary; it has this least value. (It prints ẏ = A cos(…) ẋ, where A′ is meant.)
//! The curve lies in the air: so a wind changes nothing of it but the target's drift.

use crate::trajectory::timed::elliptic::{first_kind, second_kind};
use skein_geometry::math::{FRAC_PI_2, PI, TAU, asin, atan2, hypot, sin_cos};

/// Crests are a tenth wider than the airframe could turn: what is left steers.
const CREST_ROOM: f64 = 1.1;

/// The shortest wave in radii of turn: flat sinusoids are not flown as a tremble.
const SHORTEST_RADII: f64 = 3.0;

/// The largest ratio that is answered: above, weaves are hundreds of radii wide, and
/// nobody who can circle flies them.
pub const LARGEST_RATIO: f64 = 6.0;

/// Newton's steps for a slope: five to ten do, but where there is next to none, for there each
/// brings it nearer by half.
const STEPS: u8 = 60;

/// A sinusoid in the air mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weave {
    /// A′, the slope where it crosses its middle line.
    pub slope: f64,
    /// Half its width A, metres.
    pub amplitude_m: f64,
    /// Its period D along the middle line, metres.
    pub length_m: f64,
}

/// The length of a sinusoid of slope A′ over its progress.
#[must_use]
pub fn ratio_of(slope: f64) -> f64 {
    let square = slope * slope;
    second_kind(FRAC_PI_2, square / (1.0 + square)) * (1.0 + square).sqrt() / FRAC_PI_2
}

/// How that grows with the slope: by as much as it is more than the mean of the cosine of the
/// direction, over the slope.
fn growth_of(slope: f64, ratio: f64) -> f64 {
    let square = slope * slope;
    let cosine = first_kind(square / (1.0 + square)) / (1.0 + square).sqrt() / FRAC_PI_2;
    (ratio - cosine) / slope
}

impl Weave {
    /// The narrowest weave at `ratio`, airspeed over the target's speed through the air,
    /// for a turn radius; `None` for a target that outruns the UAV, a ratio above
    /// [`LARGEST_RATIO`] or a number that is none.
    #[must_use]
    pub fn of(ratio: f64, turn_radius_m: f64) -> Option<Self> {
        if !(1.0..=LARGEST_RATIO).contains(&ratio) {
            return None;
        }
        // The length of a wave is at least that of its ascents: σ ≥ 2A′/π. It is a convex
        // function of A′, so from there on each step ends above the slope that is sought.
        let mut slope = FRAC_PI_2 * ratio;
        for _ in 0..STEPS {
            let reached = ratio_of(slope);
            let next = slope - (reached - ratio) / growth_of(slope, reached);
            if !(0.0 < next && next < slope) {
                break;
            }
            slope = next;
        }
        let crest_m = TAU * slope * turn_radius_m * CREST_ROOM;
        let length_m = crest_m.max(SHORTEST_RADII * turn_radius_m);
        Some(Self {
            slope,
            amplitude_m: slope * length_m / TAU,
            length_m,
        })
    }

    /// The direction beside the middle line at a phase, radians, how fast it turns by the
    /// phase, and the place beside the line, metres.
    #[must_use]
    pub fn at(&self, phase_rad: f64) -> (f64, f64, f64) {
        let (sine, cosine) = sin_cos(phase_rad);
        let rise = self.slope * cosine;
        let turning = -self.slope * sine / (1.0 + rise * rise);
        (atan2(rise, 1.0), turning, self.amplitude_m * sine)
    }

    /// How fast the phase grows at a phase and an airspeed, rad/s.
    #[must_use]
    pub fn phase_rate_radps(&self, phase_rad: f64, airspeed_mps: f64) -> f64 {
        let (_, cosine) = sin_cos(phase_rad);
        let rise = self.slope * cosine;
        airspeed_mps / (1.0 + rise * rise).sqrt() * TAU / self.length_m
    }

    /// How far a UAV at a phase is ahead of a target that makes as much progress as it does in
    /// the mean, metres; nothing where it crosses the middle line.
    #[must_use]
    pub fn ahead_m(&self, phase_rad: f64) -> f64 {
        self.ahead_of_m(phase_rad, ratio_of(self.slope))
    }

    /// The same, whose length over its progress is known.
    fn ahead_of_m(&self, phase_rad: f64, ratio: f64) -> f64 {
        let square = self.slope * self.slope;
        let of_length = second_kind(phase_rad, square / (1.0 + square)) * (1.0 + square).sqrt();
        (phase_rad - of_length / ratio) * self.length_m / TAU
    }

    /// The phase of a place beside the middle line, metres, climbing from it to the left or
    /// coming back.
    #[must_use]
    pub fn phase_at(&self, beside_m: f64, climbs: bool) -> f64 {
        let rising = asin(beside_m / self.amplitude_m.max(f64::MIN_POSITIVE));
        if climbs { rising } else { PI - rising }
    }

    /// How far a UAV on it comes from a target that goes along the middle line as fast as
    /// the UAV makes progress, metres.
    #[must_use]
    pub fn farthest_m(&self) -> f64 {
        const PARTS: u32 = 16;
        // It is alike to both sides and both ways: a quarter tells all.
        let ratio = ratio_of(self.slope);
        let far = |k: u32| {
            let phase = FRAC_PI_2 * f64::from(k) / f64::from(PARTS);
            hypot(self.at(phase).2, self.ahead_of_m(phase, ratio))
        };
        (0..=PARTS).map(far).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_ratios() {
        // By scipy's ellipe and brentq.
        for (ratio, slope) in [
            (1.05, 0.4555),
            (1.15, 0.816),
            (1.3, 1.208),
            (1.5, 1.646),
            (2.0, 2.60),
            (3.0, 4.33),
        ] {
            let w = Weave::of(ratio, 70.0).unwrap();
            assert!((w.slope - slope).abs() < 6e-3 * slope, "{ratio} {w:?}");
        }
        let flat = Weave::of(1.0, 70.0).unwrap();
        assert!(flat.amplitude_m < 1e-4);
        assert_eq!(Weave::of(0.99, 70.0), None);
        assert_eq!(Weave::of(f64::NAN, 70.0), None);
        assert_eq!(Weave::of(LARGEST_RATIO + 0.1, 70.0), None);
    }

    #[test]
    fn steps_suffice_from_flat_to_steep() {
        for k in 0..=500 {
            let ratio = 1.0 + (LARGEST_RATIO - 1.0) * (f64::from(k) / 500.0).powi(8);
            let w = Weave::of(ratio, 70.0).unwrap();
            let off = ratio_of(w.slope) - ratio;
            assert!(off.abs() < 4e-15 * ratio, "{ratio}: {off}");
        }
    }

    proptest! {
        #[test]
        fn progress_is_that_of_the_target(ratio in 1.0..5.9_f64, radius in 20.0..200.0_f64) {
            let w = Weave::of(ratio, radius).unwrap();
            // The mean of the cosine by time is the progress over the length.
            let n = 20_000;
            let length: f64 = (0..n)
                .map(|k| {
                    let (_, c) = sin_cos(TAU * (f64::from(k) + 0.5) / f64::from(n));
                    (1.0 + w.slope * w.slope * c * c).sqrt() / f64::from(n)
                })
                .sum();
            prop_assert!((length - ratio).abs() < 1e-6, "{length}");
        }

        #[test]
        fn no_crest_is_sharper_than_a_turn(ratio in 1.0..5.9_f64, phase in 0.0..TAU) {
            let radius = 70.0;
            let w = Weave::of(ratio, radius).unwrap();
            let rate = w.at(phase).1 * w.phase_rate_radps(phase, 1.0);
            prop_assert!(rate.abs() * radius <= 1.0 / CREST_ROOM + 1e-9);
        }

        /// How far ahead it is follows from how fast the phase grows.
        #[test]
        fn ahead_is_progress_less_the_targets(ratio in 1.0..5.9_f64, phase in 0.0..6.0_f64) {
            let w = Weave::of(ratio, 60.0).unwrap();
            let h = 1e-5;
            let growth = (w.ahead_m(phase + h) - w.ahead_m(phase - h)) / (2.0 * h);
            // Progress a radian is D/2π; meanwhile the target goes V/σ times the time.
            let target = 1.0 / ratio / w.phase_rate_radps(phase, 1.0);
            prop_assert!((growth - (w.length_m / TAU - target)).abs() < 1e-4 * w.length_m);
            let (_, _, beside) = w.at(phase);
            let climbs = sin_cos(phase).1 >= 0.0;
            let back = w.phase_at(beside, climbs);
            prop_assert!((w.at(back).2 - beside).abs() < 1e-6 * w.amplitude_m.max(1.0));
        }

        #[test]
        fn slower_targets_take_wider_weaves(ratio in 1.0..5.0_f64, more in 0.01..0.5_f64) {
            let (a, b) = (Weave::of(ratio, 50.0).unwrap(), Weave::of(ratio + more, 50.0).unwrap());
            prop_assert!(b.farthest_m() > a.farthest_m());
            prop_assert!(a.farthest_m() >= 0.99 * a.amplitude_m - 1e-6);
        }
    }
}
