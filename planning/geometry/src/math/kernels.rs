//! Sine, cosine and the angle of a vector without branches, for loops that solve
//! many Dubins words: a compiler can put several of them side by side.
//!
//! Only sums, products, quotients and square roots are used, all exact by
//! IEEE 754, so every machine gets the same bits, lane by lane or one by one.
//! The polynomials interpolate at Chebyshev nodes; the error of each, evaluated
//! to 50 digits with the coefficients as rounded here, stands beside it.

use super::{FRAC_PI_2, PI, TAU, wrap_tau};

/// Adding and subtracting it rounds to the nearest whole number: at 1.5 · 2^52
/// neighbouring numbers are 1 apart.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// The first 33 bits of π/2: times a whole number below 2^20 it is exact.
const HALF_PI_HEAD: f64 = 1.570_796_326_734_125_6;

/// What [`HALF_PI_HEAD`] leaves of π/2, to 1e-26.
const HALF_PI_TAIL: f64 = 6.077_100_506_506_192e-11;

/// Angles up to here are reduced by [`HALF_PI_HEAD`] exactly, radians.
const LARGEST_RAD: f64 = 1e6;

/// tan(π/8): below it the series of the arc tangent is used as it stands.
const TAN_PI_8: f64 = 0.414_213_562_373_095_03;

/// (sin x / x − 1) / x² in x², |x| ≤ π/4; relative error of the sine 1.8e-17.
const SIN: [f64; 6] = [
    -0.166_666_666_666_666_66,
    0.008_333_333_333_330_948,
    -0.000_198_412_698_367_567_74,
    2.755_731_610_161_787_4e-6,
    -2.505_113_165_023_518e-8,
    1.591_811_526_326_597_4e-10,
];

/// (cos x − 1 + x²/2) / x⁴ in x², |x| ≤ π/4; error of the cosine 9e-19.
const COS: [f64; 6] = [
    0.041_666_666_666_666_664,
    -0.001_388_888_888_888_739_8,
    2.480_158_729_876_456e-5,
    -2.755_731_727_114_514_4e-7,
    2.087_614_614_655_861e-9,
    -1.138_262_364_746_760_4e-11,
];

/// (atan z / z − 1) / z² in z², |z| ≤ tan(π/8); relative error 6.8e-18.
const ATAN: [f64; 11] = [
    -0.333_333_333_333_333_3,
    0.199_999_999_999_955_2,
    -0.142_857_142_846_665_42,
    0.111_111_110_152_562_92,
    -0.090_909_045_781_210_85,
    0.076_921_831_907_606_51,
    -0.066_645_114_464_602_2,
    0.058_581_489_047_951_24,
    -0.050_854_496_960_392_584,
    0.039_231_657_085_083_686,
    -0.019_176_885_636_589_053,
];

/// Sine and cosine, within 3e-16 of the truth for every finite angle below 1e6;
/// larger angles are taken modulo 2π first.
#[must_use]
pub fn sin_cos(a_rad: f64) -> (f64, f64) {
    if a_rad.abs() > LARGEST_RAD {
        return near_sin_cos(wrap_tau(a_rad));
    }
    near_sin_cos(a_rad)
}

/// [`sin_cos`] for angles below 1e6, without a branch.
#[inline(always)]
#[must_use]
pub fn near_sin_cos(a_rad: f64) -> (f64, f64) {
    let shifted = a_rad * core::f64::consts::FRAC_2_PI + ROUND;
    let turns = shifted - ROUND;
    let quarter = shifted.to_bits();
    let x = (a_rad - turns * HALF_PI_HEAD) - turns * HALF_PI_TAIL;
    let z = x * x;
    let z2 = z * z;
    let odd = (SIN[0] + z * SIN[1]) + z2 * ((SIN[2] + z * SIN[3]) + z2 * (SIN[4] + z * SIN[5]));
    let even = (COS[0] + z * COS[1]) + z2 * ((COS[2] + z * COS[3]) + z2 * (COS[4] + z * COS[5]));
    let s = x + x * z * odd;
    let c = 1.0 - (0.5 * z - z2 * even);
    // Quarter turns 1 and 3 swap the two, 2 and 3 turn the sine's sign, 1 and 2 the cosine's.
    // In masks, because comparing whole numbers keeps some machines from lanes.
    let swap = 0u64.wrapping_sub(quarter & 1);
    let exchanged = (s.to_bits() ^ c.to_bits()) & swap;
    let s = f64::from_bits(s.to_bits() ^ exchanged);
    let c = f64::from_bits(c.to_bits() ^ exchanged);
    let sign = |v: f64, flip: u64| f64::from_bits(v.to_bits() ^ (flip << 63));
    (
        sign(s, (quarter >> 1) & 1),
        sign(c, ((quarter >> 1) ^ quarter) & 1),
    )
}

/// Angle of the vector `(x, y)` counter-clockwise from `(1, 0)`, radians in
/// [0, 2π], within 1e-15; zero for the zero vector, 2π for a hair below the axis.
#[inline(always)]
#[must_use]
pub fn angle_tau(y: f64, x: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = if ay > ax { (ax, ay) } else { (ay, ax) };
    let steep = low > TAN_PI_8 * high;
    let rise = if steep { low - high } else { low };
    let run = if steep { low + high } else { high };
    // The smallest normal number keeps 0/0 away and changes nothing else.
    let z = rise / (run + f64::MIN_POSITIVE);
    let a = (if steep { PI / 4.0 } else { 0.0 }) + atan_small(z);
    let a = if ay > ax { FRAC_PI_2 - a } else { a };
    let a = if x < 0.0 { PI - a } else { a };
    if y < 0.0 { TAU - a } else { a }
}

/// Arc tangent for |z| ≤ tan(π/8).
#[inline(always)]
fn atan_small(z: f64) -> f64 {
    let s = z * z;
    let s2 = s * s;
    let s4 = s2 * s2;
    let low = (ATAN[0] + s * ATAN[1]) + s2 * (ATAN[2] + s * ATAN[3]);
    let mid = (ATAN[4] + s * ATAN[5]) + s2 * (ATAN[6] + s * ATAN[7]);
    let high = (ATAN[8] + s * ATAN[9]) + s2 * ATAN[10];
    z + z * s * (low + s4 * (mid + s4 * high))
}

/// The same angle in (−π, π], for angles below 1e6, without a branch.
#[inline(always)]
#[must_use]
pub fn near_pi(a_rad: f64) -> f64 {
    let turns = (a_rad * (1.0 / TAU) + ROUND) - ROUND;
    (a_rad - turns * (4.0 * HALF_PI_HEAD)) - turns * (4.0 * HALF_PI_TAIL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math;
    use proptest::prelude::*;

    #[test]
    fn quarter_turns_and_axes_are_right() {
        for i in -9i32..=9 {
            let a = f64::from(i) * FRAC_PI_2;
            let (s, c) = sin_cos(a);
            assert!((s - math::sin(a)).abs() < 1e-17 && (c - math::cos(a)).abs() < 1e-17);
        }
        assert!(angle_tau(0.0, 0.0).abs() < 1e-300);
        assert!((angle_tau(0.0, -1.0) - PI).abs() < 1e-300);
        assert!((angle_tau(1.0, 0.0) - FRAC_PI_2).abs() < 1e-300);
        assert!((angle_tau(-1.0, 0.0) - 3.0 * FRAC_PI_2).abs() < 1e-15);
        assert!((angle_tau(-1e-20, 1.0) - TAU).abs() < 1e-15);
        assert!(sin_cos(f64::NAN).0.is_nan() && angle_tau(f64::NAN, 1.0).is_nan());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn sine_and_cosine_agree_with_the_library(a in -20.0f64..20.0, far in -9e5f64..9e5) {
            for x in [a, far, a * 1e-6, 1e9 + far] {
                let (s, c) = sin_cos(x);
                let bound = if x.abs() > LARGEST_RAD { 1e-6 } else { 3e-16 };
                prop_assert!((s - math::sin(x)).abs() < bound && (c - math::cos(x)).abs() < bound, "{x}");
            }
        }

        #[test]
        fn angles_agree_with_the_library(a in -4.0f64..4.0, r in 1e-6f64..1e6, tiny in -1e-9f64..1e-9) {
            for (y, x) in [(r * math::sin(a), r * math::cos(a)), (r * tiny, a), (a, r * tiny)] {
                let library = math::atan2(y, x);
                let wanted = if library < 0.0 { library + TAU } else { library };
                prop_assert!((angle_tau(y, x) - wanted).abs() < 1.8e-15, "{y} {x}");
                prop_assert!((0.0..=TAU).contains(&angle_tau(y, x)));
            }
        }

        #[test]
        fn half_open_turns_keep_the_direction(a in -4000.0f64..4000.0) {
            let b = near_pi(a);
            prop_assert!(b.abs() <= PI + 1e-12);
            prop_assert!(math::wrap_pi(a - b).abs() < 1e-12);
        }
    }
}
