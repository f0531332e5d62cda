//! A line with corners as stretches that a fixed wing flies: soft corners are cut by an
//! arc, at sharp ones a stretch ends and the next one begins.

use super::straight;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{PI, atan2, cos, sin_cos};
use skein_geometry::{Curve, Segment};

/// Turns of less than this are none, radians: rounding.
const STRAIGHT_RAD: f64 = 1e-9;

/// An arc that turns more than this is no rounded corner, radians: the line leads back.
const SHARP_RAD: f64 = 0.9 * PI;

/// The stretches of a line, in order: each begins and ends on the line, follows it, and
/// cuts a corner by an arc of the turn radius where that strays no more than `stray_m`
/// from the corner and both edges are long enough.
pub fn stretches(line: &[Point], turn_radius_m: f64, stray_m: f64) -> Vec<Curve> {
    let mut points: Vec<Point> = line.to_vec();
    points.dedup_by(|p, q| (*p - *q).norm() < 1e-6);
    let edges: Vec<(Point, Point, f64)> = points
        .windows(2)
        .map(|w| (w[0], w[1], (w[1] - w[0]).norm()))
        .collect();
    let mut done = Vec::new();
    let mut curve = Curve::empty();
    // What of the present edge an arc before has taken.
    let mut taken_m = 0.0;
    for (i, (a, b, length_m)) in edges.iter().enumerate() {
        let u = (b - a) / *length_m;
        let next = edges.get(i + 1);
        let turn_rad = next.map_or(0.0, |(c, d, _)| {
            let v = d - c;
            atan2(u.perp(&v), u.dot(&v))
        });
        let half = turn_rad.abs() / 2.0;
        // Half of an edge is each corner's own, and what the one before has left over.
        let room_m = next.map_or(0.0, |(_, _, next_m)| (length_m - taken_m).min(next_m / 2.0));
        let cut_m = if turn_rad.abs() < SHARP_RAD {
            let (s, c) = sin_cos(half);
            turn_radius_m * s / c
        } else {
            f64::INFINITY
        };
        let strays_m = turn_radius_m * (1.0 / cos(half.min(SHARP_RAD)) - 1.0);
        let is_cut = next.is_some() && cut_m <= room_m && strays_m <= stray_m;
        let from = a + u * taken_m;
        let cut_m = if is_cut { cut_m } else { 0.0 };
        curve.extend(&straight(from, b - u * cut_m));
        taken_m = cut_m;
        if is_cut {
            if turn_rad.abs() > STRAIGHT_RAD {
                let at = b - u * cut_m;
                curve.push(Segment {
                    start: Pose::new(at, atan2(u.y, u.x)),
                    curvature_per_m: turn_rad.signum() / turn_radius_m,
                    length_m: turn_radius_m * turn_rad.abs(),
                });
            }
        } else {
            done.push(std::mem::take(&mut curve));
        }
    }
    done.retain(|c| !c.is_empty());
    done
}
