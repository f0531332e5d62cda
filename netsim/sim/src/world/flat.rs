//! The world's own plane geometry: points in rings, distances, clipped areas
//! (D2.7 §2.3.1). It shares no code with the planner, so that one wrong formula
//! cannot both plan a path and approve it.

use skein_geometry::frame::Point;

/// An axis-aligned box, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// South-west corner.
    pub min: Point,
    /// North-east corner.
    pub max: Point,
}

impl Bounds {
    /// The smallest box around some points; inverted (empty) around none.
    #[must_use]
    pub fn around(points: &[Point]) -> Self {
        let mut b = Self {
            min: Point::new(f64::INFINITY, f64::INFINITY),
            max: Point::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
        };
        for p in points {
            b.include(*p);
        }
        b
    }

    /// Grows the box until it holds `p`.
    pub fn include(&mut self, p: Point) {
        self.min = Point::new(self.min.x.min(p.x), self.min.y.min(p.y));
        self.max = Point::new(self.max.x.max(p.x), self.max.y.max(p.y));
    }

    /// The box with a margin on every side.
    #[must_use]
    pub fn grown(&self, margin_m: f64) -> Self {
        Self {
            min: Point::new(self.min.x - margin_m, self.min.y - margin_m),
            max: Point::new(self.max.x + margin_m, self.max.y + margin_m),
        }
    }

    /// Distance between two boxes, zero when they meet, metres.
    #[must_use]
    pub fn distance_m(&self, other: &Self) -> f64 {
        let dx = (other.min.x - self.max.x)
            .max(self.min.x - other.max.x)
            .max(0.0);
        let dy = (other.min.y - self.max.y)
            .max(self.min.y - other.max.y)
            .max(0.0);
        (dx * dx + dy * dy).sqrt()
    }
}

/// Twice the signed area of the triangle `a b c`, positive when it turns left.
#[must_use]
pub fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

/// The edges of a ring whose first vertex is not repeated.
pub fn edges(ring: &[Point]) -> impl Iterator<Item = (Point, Point)> + '_ {
    ring.iter()
        .copied()
        .zip(ring.iter().copied().cycle().skip(1))
}

/// Whether a point lies inside a ring (even-odd rule). A point exactly on the border
/// may count as either; distances, not this test, decide grazing cases.
#[must_use]
pub fn in_ring(p: Point, ring: &[Point]) -> bool {
    let mut inside = false;
    for (a, b) in edges(ring) {
        if (a.y > p.y) != (b.y > p.y) {
            let left = turn(a, b, p) > 0.0;
            inside ^= left == (b.y > a.y);
        }
    }
    inside
}

/// Distance from a point to a segment, metres.
#[must_use]
pub fn point_segment_m(p: Point, a: Point, b: Point) -> f64 {
    let (ab, ap) = (b - a, p - a);
    let len2 = ab.norm_squared();
    let t = if len2 > 0.0 {
        (ap.dot(&ab) / len2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (ap - ab * t).norm()
}

/// Whether two closed segments share a point.
#[must_use]
pub fn segments_meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    let (d1, d2) = (turn(c, d, a), turn(c, d, b));
    let (d3, d4) = (turn(a, b, c), turn(a, b, d));
    let apart = |x: f64, y: f64| (x > 0.0 && y > 0.0) || (x < 0.0 && y < 0.0);
    if apart(d1, d2) || apart(d3, d4) {
        return false;
    }
    // Collinear segments pass both tests; their boxes tell whether they overlap.
    let meet = |p: f64, q: f64, r: f64, s: f64| p.min(q) <= r.max(s) && r.min(s) <= p.max(q);
    meet(a.x, b.x, c.x, d.x) && meet(a.y, b.y, c.y, d.y)
}

/// Distance between two segments, zero when they meet, metres.
#[must_use]
pub fn segment_segment_m(a: Point, b: Point, c: Point, d: Point) -> f64 {
    if segments_meet(a, b, c, d) {
        return 0.0;
    }
    point_segment_m(a, c, d)
        .min(point_segment_m(b, c, d))
        .min(point_segment_m(c, a, b))
        .min(point_segment_m(d, a, b))
}

/// Distance from a segment to a filled ring, zero when it enters or touches, metres.
#[must_use]
pub fn segment_ring_m(a: Point, b: Point, ring: &[Point]) -> f64 {
    if in_ring(a, ring) {
        return 0.0;
    }
    edges(ring)
        .map(|(c, d)| segment_segment_m(a, b, c, d))
        .fold(f64::INFINITY, f64::min)
}

/// Distance from a point to a filled ring, zero inside, metres.
#[must_use]
pub fn point_ring_m(p: Point, ring: &[Point]) -> f64 {
    segment_ring_m(p, p, ring)
}

/// Distance from a circle (the curve, not the disc) to a filled ring, zero when the
/// curve enters it, metres.
#[must_use]
pub fn circle_ring_m(centre: Point, radius_m: f64, ring: &[Point]) -> f64 {
    if in_ring(centre + nalgebra::Vector2::new(radius_m, 0.0), ring) {
        return 0.0;
    }
    edges(ring)
        .map(|(a, b)| {
            let near = point_segment_m(centre, a, b);
            let far = (a - centre).norm().max((b - centre).norm());
            (near - radius_m).max(radius_m - far).max(0.0)
        })
        .fold(f64::INFINITY, f64::min)
}

/// Area of a ring, square metres, positive when counter-clockwise.
#[must_use]
pub fn area_m2(ring: &[Point]) -> f64 {
    edges(ring).map(|(a, b)| a.x * b.y - a.y * b.x).sum::<f64>() / 2.0
}

/// The part of a ring inside a box, clipped side by side. A ring that falls apart
/// comes back as one ring with edges of no width along the box, which add no area.
#[must_use]
pub fn clip(ring: &[Point], to: &Bounds) -> Vec<Point> {
    let mut out = ring.to_vec();
    let sides: [(bool, f64, f64); 4] = [
        (true, to.min.x, 1.0),
        (true, to.max.x, -1.0),
        (false, to.min.y, 1.0),
        (false, to.max.y, -1.0),
    ];
    for (is_x, limit, sign) in sides {
        let depth = |p: Point| sign * (if is_x { p.x } else { p.y } - limit);
        let mut next = Vec::with_capacity(out.len() + 4);
        for (a, b) in edges(&out) {
            let (da, db) = (depth(a), depth(b));
            if da >= 0.0 {
                next.push(a);
            }
            if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
                next.push(a + (b - a) * (da / (da - db)));
            }
        }
        out = next;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn p(x: f64, y: f64) -> Point {
        Point::new(x, y)
    }

    fn notch() -> Vec<Point> {
        vec![
            p(0.0, 0.0),
            p(10.0, 0.0),
            p(10.0, 10.0),
            p(5.0, 3.0),
            p(0.0, 10.0),
        ]
    }

    #[test]
    fn clipped_area_agrees_with_counting_points() {
        let ring = notch();
        let to = Bounds {
            min: p(2.0, 2.0),
            max: p(8.0, 7.0),
        };
        let step = 0.02;
        let mut n = 0u32;
        for i in 0..300 {
            for j in 0..250 {
                let q = p(
                    2.0 + (f64::from(i) + 0.5) * step,
                    2.0 + (f64::from(j) + 0.5) * step,
                );
                n += u32::from(in_ring(q, &ring));
            }
        }
        let counted = f64::from(n) * step * step;
        assert!(
            (area_m2(&clip(&ring, &to)) - counted).abs() < 0.05,
            "{counted}"
        );
        let whole = Bounds {
            min: p(-1.0, -1.0),
            max: p(11.0, 11.0),
        };
        assert!((area_m2(&clip(&ring, &whole)) - area_m2(&ring)).abs() < 1e-12);
    }

    #[test]
    fn distances_agree_with_sampling() {
        let ring = notch();
        for (a, b) in [
            (p(-3.0, 5.0), p(-1.0, 12.0)),
            (p(5.0, 12.0), p(5.0, 4.0)),
            (p(12.0, -2.0), p(13.0, 20.0)),
            (p(1.0, 1.0), p(2.0, 1.5)),
        ] {
            let mut least = f64::INFINITY;
            for i in 0..=400 {
                let q = a + (b - a) * (f64::from(i) / 400.0);
                if in_ring(q, &ring) {
                    least = 0.0;
                }
                for (c, d) in edges(&ring) {
                    least = least.min(point_segment_m(q, c, d));
                }
            }
            let got = segment_ring_m(a, b, &ring);
            assert!((got - least).abs() < 0.05, "{a} {b}: {got} {least}");
        }
    }

    #[test]
    fn a_circle_around_a_ring_is_clear_of_it() {
        let ring = notch();
        assert!((circle_ring_m(p(5.0, 5.0), 20.0, &ring) - (20.0 - 50f64.sqrt())).abs() < 1e-12);
        assert!(circle_ring_m(p(5.0, -5.0), 5.0, &ring) < 1e-12);
        assert!(circle_ring_m(p(5.0, 1.5), 0.5, &ring) < 1e-12);
        assert!((circle_ring_m(p(20.0, 0.0), 4.0, &ring) - 6.0).abs() < 1e-12);
    }
}
