//! The only source of transcendental functions in the core.
//!
//! `std` hands `sin` to whatever C library the platform has, which may round
//! differently; peers must agree to the bit, so these go through `libm`.
//! Square roots, sums and products are exact by IEEE 754 and need no care.

pub mod kernels;

pub use core::f64::consts::{FRAC_PI_2, PI, TAU};

/// Sine of an angle in radians.
#[must_use]
pub fn sin(a_rad: f64) -> f64 {
    libm::sin(a_rad)
}

/// Cosine of an angle in radians.
#[must_use]
pub fn cos(a_rad: f64) -> f64 {
    libm::cos(a_rad)
}

/// Sine and cosine of an angle in radians.
#[must_use]
pub fn sin_cos(a_rad: f64) -> (f64, f64) {
    (libm::sin(a_rad), libm::cos(a_rad))
}

/// Tangent of an angle in radians.
#[must_use]
pub fn tan(a_rad: f64) -> f64 {
    libm::tan(a_rad)
}

/// Angle of the vector `(x, y)`, radians in (−π, π].
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Arc cosine, radians in [0, π]; the argument is clamped to [−1, 1].
#[must_use]
pub fn acos(c: f64) -> f64 {
    libm::acos(c.clamp(-1.0, 1.0))
}

/// Arc sine, radians in [−π/2, π/2]; the argument is clamped to [−1, 1].
#[must_use]
pub fn asin(s: f64) -> f64 {
    libm::asin(s.clamp(-1.0, 1.0))
}

/// Natural logarithm.
#[must_use]
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// The exponential function.
#[must_use]
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// Length of the vector `(x, y)`.
#[must_use]
pub fn hypot(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// The same angle in [0, 2π).
#[must_use]
pub fn wrap_tau(a_rad: f64) -> f64 {
    let r = a_rad - TAU * (a_rad / TAU).floor();
    if (0.0..TAU).contains(&r) { r } else { 0.0 }
}

/// The same angle in (−π, π].
#[must_use]
pub fn wrap_pi(a_rad: f64) -> f64 {
    let r = wrap_tau(a_rad);
    if r > PI { r - TAU } else { r }
}

/// Milliseconds of a clock as seconds.
#[must_use]
#[allow(
    clippy::cast_precision_loss,
    reason = "clocks stay far below 2^53 milliseconds"
)]
pub fn seconds(ms: u64) -> f64 {
    ms as f64 / 1e3
}
