//! The incomplete elliptic integral of the second kind, which is what lengths of
//! trochoids and times along circles in wind come to, and the complete one of the first kind,
//! by which it grows.
//!
//! By Carlson's symmetric integrals (NIST Digital Library of Mathematical Functions,
//! 19.25.9 and 19.36): duplication until the arguments are alike, then a series.

use skein_geometry::math::{PI, sin, sin_cos};

/// Arguments this much alike leave a sixth-order rest below 1e-18.
const ALIKE: f64 = 1e-3;

/// Duplications: each brings the arguments four times nearer, so this many suffice
/// for any that differ by less than 10^15.
const DUPLICATIONS: u8 = 40;

/// Above this the modulus counts as one, where the integral is a sine.
const ONE: f64 = 1.0 - 1e-13;

/// Nodes and weights of Gauss and Legendre for eight places of an interval, by halves.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_27),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Sums replace the integral up to this modulus. Its nearest branch point then lies
/// 0.88 off the real axis, four half strips away, and a sum of eight errs by 1e-14.
const SMOOTH: f64 = 0.5;

/// Width of a strip, radians.
const STRIP_RAD: f64 = 0.44;

/// More strips than this cost more than the closed form.
const STRIPS: f64 = 8.0;

/// E(to | m) − E(from | m): by sums where they are quicker, which they are for the arcs
/// of routes in winds that can be flown in.
pub(super) fn second_kind_between(from: f64, to: f64, m: f64) -> f64 {
    let strips = ((to - from).abs() / STRIP_RAD).ceil().max(1.0);
    if m > SMOOTH || strips > STRIPS {
        return second_kind(to, m) - second_kind(from, m);
    }
    let half = (to - from) / (2.0 * strips);
    let height = |phi: f64| {
        let s = sin(phi);
        (1.0 - m * s * s).sqrt()
    };
    let (mut sum, mut i) = (0.0, 0.0);
    while i < strips {
        let middle = from + half * (2.0 * i + 1.0);
        for (node, weight) in GAUSS {
            sum += weight * (height(middle - half * node) + height(middle + half * node));
        }
        i += 1.0;
    }
    sum * half
}

/// K(m): the integral of 1/√(1 − m sin²) over a quarter turn, for 0 ≤ m < 1.
pub(crate) fn first_kind(m: f64) -> f64 {
    first(0.0, 1.0 - m)
}

/// E(φ | m): the integral of √(1 − m sin²) from 0 to `phi`, for 0 ≤ m ≤ 1.
pub(crate) fn second_kind(phi: f64, m: f64) -> f64 {
    if phi.abs() <= PI / 2.0 {
        return within(phi, m);
    }
    by_halves(phi, m)
}

/// The same of any φ, by how many half turns it holds.
fn by_halves(phi: f64, m: f64) -> f64 {
    let halves = (phi / PI).round();
    2.0 * halves * within(PI / 2.0, m) + within(phi - halves * PI, m)
}

/// For |φ| ≤ π/2.
fn within(phi: f64, m: f64) -> f64 {
    if m >= ONE {
        return sin(phi);
    }
    let (s, c) = sin_cos(phi);
    let (x, y) = (c * c, 1.0 - m * s * s);
    s * first(x, y) - m / 3.0 * s * s * s * second(x, y)
}

/// R_F(x, y, 1).
fn first(x: f64, y: f64) -> f64 {
    let (mut x, mut y, mut z) = (x, y, 1.0);
    for _ in 0..DUPLICATIONS {
        let mean = (x + y + z) / 3.0;
        let (dx, dy) = (1.0 - x / mean, 1.0 - y / mean);
        let dz = -dx - dy;
        if dx.abs().max(dy.abs()).max(dz.abs()) < ALIKE {
            let (e2, e3) = (dx * dy - dz * dz, dx * dy * dz);
            let series = 1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0;
            return series / mean.sqrt();
        }
        let (a, b, c) = (x.sqrt(), y.sqrt(), z.sqrt());
        let shift = a * b + b * c + c * a;
        (x, y, z) = ((x + shift) / 4.0, (y + shift) / 4.0, (z + shift) / 4.0);
    }
    1.0 / ((x + y + z) / 3.0).sqrt()
}

/// R_D(x, y, 1).
fn second(x: f64, y: f64) -> f64 {
    let (mut x, mut y, mut z) = (x, y, 1.0);
    let (mut sum, mut weight) = (0.0, 1.0);
    for _ in 0..DUPLICATIONS {
        let mean = (x + y + 3.0 * z) / 5.0;
        let (dx, dy) = (1.0 - x / mean, 1.0 - y / mean);
        let dz = -(dx + dy) / 3.0;
        if dx.abs().max(dy.abs()).max(dz.abs()) < ALIKE {
            let (xy, zz) = (dx * dy, dz * dz);
            let (e2, e3) = (xy - 6.0 * zz, (3.0 * xy - 8.0 * zz) * dz);
            let (e4, e5) = (3.0 * (xy - zz) * zz, xy * zz * dz);
            let series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0
                - 3.0 * e4 / 22.0
                - 9.0 * e2 * e3 / 52.0
                + 3.0 * e5 / 26.0;
            return 3.0 * sum + weight * series / (mean * mean.sqrt());
        }
        let (a, b, c) = (x.sqrt(), y.sqrt(), z.sqrt());
        let shift = a * b + b * c + c * a;
        sum += weight / (c * (z + shift));
        weight /= 4.0;
        (x, y, z) = ((x + shift) / 4.0, (y + shift) / 4.0, (z + shift) / 4.0);
    }
    3.0 * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_values() {
        // The quarter perimeter of an ellipse with half axes 1 and 1/2 (m = 3/4).
        assert!((second_kind(PI / 2.0, 0.75) - 1.211_056_027_568_459_4).abs() < 1e-14);
        assert!((second_kind(1.0, 0.0) - 1.0).abs() < 1e-15);
        assert!((second_kind(2.0, 1.0) - (2.0 - sin(2.0))).abs() < 1e-15);
        // A quarter of the period of a pendulum let go at a right angle (m = 1/2).
        assert!((first_kind(0.5) - 1.854_074_677_301_372).abs() < 1e-14);
        assert!((first_kind(0.0) - PI / 2.0).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn of_a_quarter_turn_or_less_it_is_the_same_to_the_bit(share in -1.0f64..1.0, m in 0.0f64..1.0) {
            for phi in [PI / 2.0, -PI / 2.0, share * PI / 2.0] {
                prop_assert_eq!(second_kind(phi, m).to_bits(), by_halves(phi, m).to_bits());
            }
        }

        #[test]
        fn sums_are_the_closed_form(from in -8.0f64..8.0, wide in -5.0f64..5.0, m in 0.0f64..0.7) {
            let closed = second_kind(from + wide, m) - second_kind(from, m);
            prop_assert!((second_kind_between(from, from + wide, m) - closed).abs() < 2e-14 * 20.0);
        }

        #[test]
        fn it_is_the_integral(phi in -8.0f64..8.0, m in 0.0f64..0.999) {
            let f = |a: f64| (1.0 - m * sin(a) * sin(a)).sqrt();
            let n = 40_000;
            let h = phi / f64::from(n);
            let mut sum = f(0.0) + f(phi);
            for i in 1..n {
                sum += f(h * f64::from(i)) * if i % 2 == 1 { 4.0 } else { 2.0 };
            }
            prop_assert!((second_kind(phi, m) - sum * h / 3.0).abs() < 1e-10);
        }
    }
}
