//! The shortest curve of bounded curvature between two poses (D2.7 §2.4.1).

use super::Curve;
use crate::frame::Pose;

/// The shortest Dubins curve from `from` to `to` with turns of `radius_m`.
#[must_use]
pub fn shortest(from: Pose, to: Pose, radius_m: f64) -> Curve {
    let _ = (from, to, radius_m);
    todo!("planning helper")
}

/// All Dubins words that exist between two poses, shortest first (ties by word).
#[must_use]
pub fn all(from: Pose, to: Pose, radius_m: f64) -> Vec<Curve> {
    let _ = (from, to, radius_m);
    todo!("planning helper")
}
