//! Distances between numbered places, as pinpoint and line coverage ask for them
//! (D2.7 §3.4: "edges cost correspond to shortest path distances between these points").
//!
//! Anything that can say how far it is from one place to another is a [`Metric`]:
//! straight lines, straight lines in a wind, a matrix of flown distances.

use skein_geometry::frame::{Point, Vector};
use thiserror::Error;

/// The symmetric cost of flying from one of a set of numbered places to another.
///
/// Costs are finite, not negative, and zero from a place to itself; the guarantees of
/// the planners hold when they obey the triangle inequality.
/// Any `Fn(usize, usize) -> f64` is a metric.
pub trait Metric {
    /// The cost between places `a` and `b`, metres (or whatever unit the caller plans in).
    fn cost(&self, a: usize, b: usize) -> f64;
}

impl<F: Fn(usize, usize) -> f64> Metric for F {
    fn cost(&self, a: usize, b: usize) -> f64 {
        self(a, b)
    }
}

/// Straight lines between points of the plane.
#[derive(Clone, Copy, Debug)]
pub struct Straight<'a>(pub &'a [Point]);

impl Metric for Straight<'_> {
    fn cost(&self, a: usize, b: usize) -> f64 {
        let (p, q) = (self.0[a], self.0[b]);
        let (x, y) = (p.x - q.x, p.y - q.y);
        (x * x + y * y).sqrt()
    }
}

/// Flight times along straight lines in a constant wind, up to a part that vanishes on
/// closed tours.
///
/// At airspeed `v` in wind `w` the displacement `d` takes
/// `(sqrt((v² − w²)|d|² + (d·w)²) − d·w) / (v² − w²)` seconds. The second term is the
/// same for every way between two places, so it sums to zero on a closed tour, and the
/// first is a norm: **on closed tours a constant wind is symmetric**.
#[derive(Clone, Copy, Debug)]
pub struct InWind<'a> {
    points: &'a [Point],
    wind: Vector,
    /// `v² − w²`, above zero.
    margin: f64,
}

/// A wind in which a UAV cannot fly every course.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "wind of {wind_mps:.1} m/s against an airspeed of {airspeed_mps:.1} m/s: no closed tour can be flown"
)]
pub struct TooWindy {
    /// Wind speed, m/s.
    pub wind_mps: f64,
    /// Airspeed, m/s.
    pub airspeed_mps: f64,
}

impl<'a> InWind<'a> {
    /// Times between `points` at an airspeed, m/s, in a wind blowing towards `wind_mps`, m/s.
    ///
    /// # Errors
    /// [`TooWindy`] unless the airspeed is above the wind.
    pub fn new(points: &'a [Point], airspeed_mps: f64, wind_mps: Vector) -> Result<Self, TooWindy> {
        let margin = airspeed_mps * airspeed_mps - wind_mps.norm_squared();
        // Written so that a value that is no number fails too.
        if margin > 0.0 && airspeed_mps > 0.0 && margin.is_finite() {
            Ok(Self {
                points,
                wind: wind_mps,
                margin,
            })
        } else {
            Err(TooWindy {
                wind_mps: wind_mps.norm(),
                airspeed_mps,
            })
        }
    }

    /// The time that the straight flight really takes, seconds: differs by direction.
    #[must_use]
    pub fn one_way_s(&self, from: usize, to: usize) -> f64 {
        self.cost(from, to) - self.along(from, to)
    }

    /// The part of the time that vanishes on closed tours, seconds, with the sign of a
    /// tail wind.
    #[must_use]
    pub fn along(&self, from: usize, to: usize) -> f64 {
        (self.points[to] - self.points[from]).dot(&self.wind) / self.margin
    }
}

impl Metric for InWind<'_> {
    fn cost(&self, a: usize, b: usize) -> f64 {
        let d = self.points[b] - self.points[a];
        let tail = d.dot(&self.wind);
        (self.margin * d.norm_squared() + tail * tail).sqrt() / self.margin
    }
}

/// Costs written down once, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    n: usize,
    costs: Vec<f64>,
}

impl Matrix {
    /// Writes down the costs between `n` places; each pair is asked for once.
    #[must_use]
    pub fn of(n: usize, metric: &impl Metric) -> Self {
        let mut costs = vec![0.0; n * n];
        for a in 0..n {
            for b in a + 1..n {
                let cost = metric.cost(a, b);
                costs[a * n + b] = cost;
                costs[b * n + a] = cost;
            }
        }
        Self { n, costs }
    }

    /// The matrix of shortest ways over any places: obeys the triangle inequality
    /// whatever the costs were.
    ///
    /// # Complexity
    /// O(n³).
    #[cfg(test)]
    pub(crate) fn closure(mut self) -> Self {
        let n = self.n;
        for via in 0..n {
            let row: Vec<f64> = self.costs[via * n..(via + 1) * n].to_vec();
            for a in 0..n {
                let to_via = self.costs[a * n + via];
                for (cost, from_via) in self.costs[a * n..(a + 1) * n].iter_mut().zip(&row) {
                    *cost = cost.min(to_via + from_via);
                }
            }
        }
        self
    }

    /// The number of places.
    #[must_use]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether there are no places.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }
}

impl Metric for Matrix {
    fn cost(&self, a: usize, b: usize) -> f64 {
        self.costs[a * self.n + b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_closed_tours_wind_is_symmetric_and_adds_up_to_true_times() {
        let points = [
            Point::new(0.0, 0.0),
            Point::new(900.0, 100.0),
            Point::new(400.0, 700.0),
        ];
        let wind = Vector::new(6.0, -3.0);
        let m = InWind::new(&points, 15.0, wind).unwrap();
        let (mut norm_s, mut true_s, mut back_s) = (0.0, 0.0, 0.0);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            norm_s += m.cost(a, b);
            true_s += m.one_way_s(a, b);
            back_s += m.one_way_s(b, a);
            // Ground speed along the course, from the wind triangle.
            let d = points[b] - points[a];
            let u = d.normalize();
            let across = u.x * wind.y - u.y * wind.x;
            let speed = u.dot(&wind) + (15.0_f64 * 15.0 - across * across).sqrt();
            assert!((m.one_way_s(a, b) - d.norm() / speed).abs() < 1e-9);
        }
        assert!((norm_s - true_s).abs() < 1e-9 && (norm_s - back_s).abs() < 1e-9);
        assert!(InWind::new(&points, 6.0, wind).is_err());
        assert!(InWind::new(&points, f64::NAN, wind).is_err());
    }

    #[test]
    fn the_closure_obeys_the_triangle_inequality() {
        let weird = |a: usize, b: usize| ((a * 7 + b * 7) % 11 + (a * b) % 5 + 1) as f64;
        let m = Matrix::of(9, &weird).closure();
        for a in 0..9 {
            for b in 0..9 {
                for c in 0..9 {
                    assert!(m.cost(a, c) <= m.cost(a, b) + m.cost(b, c) + 1e-12);
                }
                if a != b {
                    assert!(m.cost(a, b) <= weird(a, b));
                }
            }
        }
    }
}
