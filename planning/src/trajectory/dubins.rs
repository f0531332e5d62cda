//! The shortest curve of bounded curvature between two poses (D2.7 §2.4.1).

use super::Curve;
use crate::frame::Pose;
use crate::math::{PI, TAU, acos, atan2, hypot, sin_cos, wrap_tau};

/// The shortest Dubins curve from `from` to `to` with turns of `radius_m`.
#[must_use]
pub fn shortest(from: Pose, to: Pose, radius_m: f64) -> Curve {
    all(from, to, radius_m).into_iter().next().unwrap_or_default()
}

/// All Dubins words that exist between two poses, shortest first (ties by word).
#[must_use]
pub fn all(from: Pose, to: Pose, radius_m: f64) -> Vec<Curve> {
    let r = radius_m;
    let mut out: Vec<(f64, Curve)> = Vec::with_capacity(6);
    let mut add = |pieces: [(f64, f64); 3]| {
        let curve = Curve::from_pieces(from, &pieces);
        let end = curve.end().unwrap_or(from);
        if (end.position() - to.position()).norm() < 1e-3 {
            out.push((pieces.iter().map(|p| p.1).sum(), curve));
        }
    };
    let (s0, c0) = sin_cos(from.heading_rad);
    let (s1, c1) = sin_cos(to.heading_rad);
    for first in [1.0, -1.0] {
        for last in [1.0, -1.0] {
            let a = (from.east_m - first * r * s0, from.north_m + first * r * c0);
            let b = (to.east_m - last * r * s1, to.north_m + last * r * c1);
            let (dx, dy) = (b.0 - a.0, b.1 - a.1);
            let d = hypot(dx, dy);
            let theta = atan2(dy, dx);
            if first * last > 0.0 {
                let line = if d < 1e-9 { from.heading_rad } else { theta };
                let alpha = turn(first, line - from.heading_rad);
                let gamma = turn(first, to.heading_rad - line);
                add([(first / r, alpha * r), (0.0, d), (first / r, gamma * r)]);
                if d <= 4.0 * r {
                    let beta = TAU - 2.0 * libm::asin((d / (4.0 * r)).min(1.0));
                    ccc(from, to, r, first, theta, d, beta, &mut add);
                }
            } else if d >= 2.0 * r {
                let line = theta + first * acos(2.0 * r / d) * -1.0 + first * PI / 2.0;
                let straight = (d * d - 4.0 * r * r).max(0.0).sqrt();
                let alpha = turn(first, line - from.heading_rad);
                let gamma = turn(last, to.heading_rad - line);
                add([(first / r, alpha * r), (0.0, straight), (last / r, gamma * r)]);
            }
        }
    }
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out.into_iter().map(|o| o.1).collect()
}

/// A turn by `angle_rad` in the sense of `side`, radians in [0, 2π).
fn turn(side: f64, angle_rad: f64) -> f64 {
    let t = wrap_tau(side * angle_rad);
    if t > TAU - 1e-9 { 0.0 } else { t }
}

/// Three turns: out, the long way round in between, in.
#[allow(clippy::too_many_arguments, reason = "one place, one meaning each")]
fn ccc(from: Pose, to: Pose, r: f64, side: f64, theta: f64, d: f64, beta: f64, add: &mut impl FnMut([(f64, f64); 3])) {
    let lean = acos(d / (4.0 * r));
    for sign in [1.0, -1.0] {
        let middle = theta + sign * lean;
        let out = middle + side * PI / 2.0;
        let alpha = turn(side, out - from.heading_rad);
        let into = out - side * beta;
        for b in [beta, TAU - beta] {
            let gamma = turn(side, to.heading_rad - (out - side * b));
            add([(side / r, alpha * r), (-side / r, b * r), (side / r, gamma * r)]);
        }
        let _ = into;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_ends_where_it_should_and_the_shortest_is_short() {
        let mut x = 12345u64;
        let mut draw = |scale: f64| {
            x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (x >> 11) as f64 / (1u64 << 53) as f64 * scale
        };
        for _ in 0..3000 {
            let from = Pose { east_m: 0.0, north_m: 0.0, heading_rad: draw(TAU) };
            let to = Pose { east_m: draw(10.0) - 5.0, north_m: draw(10.0) - 5.0, heading_rad: draw(TAU) };
            let words = all(from, to, 1.0);
            assert!(words.len() >= 2, "{to:?}");
            for w in &words {
                let e = w.end().unwrap();
                assert!((e.position() - to.position()).norm() < 1e-3);
                assert!(crate::math::wrap_pi(e.heading_rad - to.heading_rad).abs() < 1e-3);
                assert!(w.largest_gap_m() < 1e-9);
            }
            assert!(words[0].length_m() >= (to.position() - from.position()).norm() - 1e-9);
            assert!(words[0].length_m() <= (to.position() - from.position()).norm() + 7.4);
        }
    }

    #[test]
    fn turning_round_on_the_spot_takes_seven_thirds_of_a_half_circle() {
        let from = Pose { east_m: 0.0, north_m: 0.0, heading_rad: 0.3 };
        let w = shortest(from, from.reversed(), 10.0);
        assert!((w.length_m() - 10.0 * 7.0 * PI / 3.0).abs() < 1e-6, "{}", w.length_m());
    }
}
