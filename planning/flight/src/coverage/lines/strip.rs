//! Strips wider than a swath become parallel lanes (D2.7 §3.5: "line search and strip
//! search yield the same problem").

use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{atan2, tan};

/// The most lanes of one strip: more means that a unit is wrong.
pub const MAX_LANES: usize = 10_000;

/// The lanes that see a strip of `width_m` around the polyline `centre` with a swath of
/// `swath_m`, from right to left, each in the direction of the polyline.
///
/// One lane, the polyline itself, where the swath is as wide as the strip. `None` when a
/// figure is no sensible number, the polyline has no length, or more than [`MAX_LANES`]
/// would be needed.
///
/// # Guarantees
/// Every point within half the width of the polyline, but not beyond its two ends, is
/// within half a swath of a lane, also round sharp bends.
#[must_use]
pub fn lanes(centre: &[Point], width_m: f64, swath_m: f64) -> Option<Vec<Vec<Point>>> {
    let mut way: Vec<Point> = Vec::with_capacity(centre.len());
    for &p in centre {
        if !(p.x.is_finite() && p.y.is_finite()) {
            return None;
        }
        if way.last().is_none_or(|q| (p - q).norm() > 1e-9) {
            way.push(p);
        }
    }
    // Written so that a value that is no number fails too.
    let sensible = width_m >= 0.0 && width_m.is_finite() && swath_m > 0.0;
    if !sensible || way.len() < 2 || width_m / swath_m > MAX_LANES as f64 {
        return None;
    }
    let count = (width_m / swath_m).ceil().max(1.0);
    let spacing = width_m / count;
    let lanes = (0..count as usize).map(|i| {
        let offset = spacing * (i as f64 + 0.5) - width_m / 2.0;
        if count < 1.5 {
            way.clone()
        } else {
            lane(&way, offset, spacing, width_m / 2.0)
        }
    });
    Some(lanes.collect())
}

/// The polyline `way` moved to its left by `offset`.
///
/// Around a bend the two pieces of a lane part where the outer edges of their swaths,
/// half a `spacing` farther out than the lane, meet: outside they run on, but no farther
/// than `half_m`, as nothing of the strip lies beyond; inside they are cut, if both are
/// long enough, and otherwise stay whole and overlap.
fn lane(way: &[Point], offset: f64, spacing: f64, half_m: f64) -> Vec<Point> {
    let pieces: Vec<(Point, Vector, f64)> = way
        .windows(2)
        .map(|w| {
            let along = w[1] - w[0];
            let length = along.norm();
            let u = along / length;
            (w[0] + Vector::new(-u.y, u.x) * offset, u, length)
        })
        .collect();
    let mut lane = Vec::with_capacity(way.len());
    lane.push(pieces[0].0);
    for pair in pieces.windows(2) {
        let ((from, u, length), (next, v, next_length)) = (pair[0], pair[1]);
        let end = from + u * length;
        let bend = atan2(u.x * v.y - u.y * v.x, u.dot(&v));
        let outward = if bend >= 0.0 { -offset } else { offset };
        let run = (outward + spacing / 2.0) * tan(bend.abs() / 2.0);
        let run = if run >= 0.0 {
            run.min(half_m)
        } else if -run <= 0.5 * length.min(next_length) {
            run
        } else {
            0.0
        };
        let (out, back) = (end + u * run, next - v * run);
        lane.push(out);
        if (out - back).norm() > 1e-9 {
            lane.push(back);
        }
    }
    if let Some(&(from, u, length)) = pieces.last() {
        lane.push(from + u * length);
    }
    lane
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::random::SplitMix64;

    fn to_piece_m(p: Point, a: Point, b: Point) -> f64 {
        let d = b - a;
        let t = ((p - a).dot(&d) / d.norm_squared().max(1e-18)).clamp(0.0, 1.0);
        (p - (a + d * t)).norm()
    }

    #[test]
    fn every_point_of_a_winding_strip_is_seen() {
        let mut random = SplitMix64::new(51);
        let mut asked = 0;
        for _ in 0..60 {
            let n = 2 + random.below(5);
            let way: Vec<Point> = (0..n)
                .map(|_| Point::new(400.0 * random.unit(), 400.0 * random.unit()))
                .collect();
            let width_m = 10.0 + 90.0 * random.unit();
            let swath_m = width_m / (0.5 + 6.0 * random.unit());
            let lanes = lanes(&way, width_m, swath_m).unwrap();
            assert_eq!(lanes.len(), (width_m / swath_m).ceil() as usize);
            for _ in 0..2000 {
                let p = Point::new(600.0 * random.unit() - 100.0, 600.0 * random.unit() - 100.0);
                let to_way = way.windows(2).map(|w| to_piece_m(p, w[0], w[1]));
                let inside = to_way.fold(f64::INFINITY, f64::min) <= width_m / 2.0;
                // Behind the first and beyond the last point is not of the strip.
                let behind = (p - way[0]).dot(&(way[1] - way[0])) < 0.0
                    && (p - way[0]).norm() <= width_m / 2.0;
                let (last, before) = (way[n - 1], way[n - 2]);
                let past =
                    (p - last).dot(&(last - before)) > 0.0 && (p - last).norm() <= width_m / 2.0;
                if !inside || behind || past {
                    continue;
                }
                asked += 1;
                let seen = lanes.iter().flat_map(|l| l.windows(2));
                let nearest = seen
                    .map(|w| to_piece_m(p, w[0], w[1]))
                    .fold(f64::INFINITY, f64::min);
                assert!(nearest <= swath_m / 2.0 + 1e-6, "{p:?} {way:?} {nearest}");
            }
        }
        assert!(asked > 5_000, "{asked}");
    }

    #[test]
    fn narrow_strips_are_flown_along_their_middle_and_nonsense_is_refused() {
        let way = [Point::new(0.0, 0.0), Point::new(100.0, 0.0)];
        assert_eq!(lanes(&way, 20.0, 30.0), Some(vec![way.to_vec()]));
        assert_eq!(lanes(&way, 0.0, 30.0).unwrap().len(), 1);
        let two = lanes(&way, 60.0, 30.0).unwrap();
        assert!((two[0][0].y + 15.0).abs() < 1e-9 && (two[1][1].y - 15.0).abs() < 1e-9);
        assert!(lanes(&way[..1], 60.0, 30.0).is_none());
        assert!(lanes(&way, f64::NAN, 30.0).is_none());
        assert!(lanes(&way, 60.0, 0.0).is_none());
        assert!(lanes(&way, 1e9, 1.0).is_none());
    }
}
