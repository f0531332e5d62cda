//! The incomplete elliptic integral of the second kind, which is what lengths of
//! trochoids and times along circles in wind come to.
//!
//! By Carlson's symmetric integrals (NIST Digital Library of Mathematical Functions,
//! 19.25.9 and 19.36): duplication until the arguments are alike, then a series.

use crate::math::{PI, sin, sin_cos};

/// Arguments this much alike leave a sixth-order rest below 1e-18.
const ALIKE: f64 = 1e-3;

/// Duplications: each brings the arguments four times nearer, so this many suffice
/// for any that differ by less than 10^15.
const DUPLICATIONS: u8 = 40;

/// Above this the modulus counts as one, where the integral is a sine.
const ONE: f64 = 1.0 - 1e-13;

/// E(φ | m): the integral of √(1 − m sin²) from 0 to `phi`, for 0 ≤ m ≤ 1.
pub(super) fn second_kind(phi: f64, m: f64) -> f64 {
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
    }

    proptest! {
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
