//! Huang's sweep direction: the lanes with the fewest turns (D2.7 §3.6.1).
//!
//! The number of lanes of a cell is its altitude across the lanes over their spacing, and
//! a sweep with one direction meets, in all, the altitude of the border and that of every
//! hole: S(θ) = d_B(θ) + Σ d_Hi(θ). Between two directions in which some hull has an edge
//! the sum is a sum of arcs of sines, concave, so that its minimum is at such an edge.
//!
//! Huang, "Optimal line-sweep-based decompositions for coverage algorithms", 2001,
//! <https://doi.org/10.1109/ROBOT.2001.932525>.

use super::frame::Axes;
use skein_geometry::frame::Point;
use skein_geometry::math::{PI, atan2, wrap_pi};
use skein_geometry::polygon::side;

/// Directions nearer than this are the same, radians: a tenth of a millimetre on a
/// kilometre.
const SAME_RAD: f64 = 1e-7;

/// The sum of the altitudes of `rings` across lanes of a heading, metres.
#[must_use]
pub fn altitudes_m(rings: &[&[Point]], heading_rad: f64) -> f64 {
    let axes = Axes::new(heading_rad);
    rings
        .iter()
        .map(|ring| {
            let xs = ring.iter().map(|p| axes.into(*p).x);
            let (low, high) = xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
                (l.min(x), h.max(x))
            });
            (high - low).max(0.0)
        })
        .sum()
}

/// Headings of lanes with their sum of altitudes, the least first: one for each direction
/// of an edge of a hull of `rings`, in (−π/2, π/2].
///
/// # Guarantees
/// The first is the least of all headings.
///
/// # Complexity
/// O(n log n + h²) for n vertices and h edges of hulls.
#[must_use]
pub fn sweep_directions(rings: &[&[Point]]) -> Vec<(f64, f64)> {
    let hulls: Vec<Vec<Point>> = rings.iter().map(|r| hull(r)).collect();
    let mut headings: Vec<f64> = hulls
        .iter()
        .flat_map(|h| {
            (0..h.len()).map(|i| {
                let d = h[(i + 1) % h.len()] - h[i];
                half_turn(atan2(d.y, d.x))
            })
        })
        .collect();
    headings.sort_by(f64::total_cmp);
    headings.dedup_by(|a, b| (*a - *b).abs() < SAME_RAD);
    let views: Vec<&[Point]> = hulls.iter().map(Vec::as_slice).collect();
    let mut all: Vec<(f64, f64)> = headings
        .into_iter()
        .map(|h| (h, altitudes_m(&views, h)))
        .collect();
    all.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.total_cmp(&b.0)));
    all
}

/// The same line's direction in (−π/2, π/2].
pub(super) fn half_turn(a_rad: f64) -> f64 {
    let a = wrap_pi(a_rad);
    if a > PI / 2.0 {
        a - PI
    } else if a <= -PI / 2.0 {
        a + PI
    } else {
        a
    }
}

/// The convex hull, counter-clockwise, without points on its edges (monotone chain).
fn hull(points: &[Point]) -> Vec<Point> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup_by(|a, b| a.x.total_cmp(&b.x).is_eq() && a.y.total_cmp(&b.y).is_eq());
    if sorted.len() < 3 {
        return sorted;
    }
    let half = |points: &mut dyn Iterator<Item = Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for p in points {
            while chain.len() > 1 && side(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut ring = half(&mut sorted.iter().copied());
    ring.extend(half(&mut sorted.iter().rev().copied()));
    ring
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_geometry::math::{TAU, cos, sin};

    fn star(x: f64, y: f64, radii: &[f64], turn: f64) -> Vec<Point> {
        let n = radii.len();
        (0..n)
            .map(|i| {
                let a = TAU * i as f64 / n as f64 + turn;
                Point::new(x + radii[i] * cos(a), y + radii[i] * sin(a))
            })
            .collect()
    }

    proptest! {
        #[test]
        fn no_heading_has_less_altitude_than_the_best_edge(
            border in prop::collection::vec(300.0f64..900.0, 5..12),
            holes in prop::collection::vec(
                (-150.0f64..150.0, -150.0f64..150.0, prop::collection::vec(5.0f64..60.0, 3..8), 0.0f64..6.0), 0..5),
        ) {
            let mut rings = vec![star(0.0, 0.0, &border, 0.0)];
            rings.extend(holes.iter().map(|(x, y, radii, turn)| star(*x, *y, radii, *turn)));
            let views: Vec<&[Point]> = rings.iter().map(Vec::as_slice).collect();
            let found = sweep_directions(&views)[0];
            prop_assert!((altitudes_m(&views, found.0) - found.1).abs() < 1e-6);
            // Every hundredth of a degree.
            let least = (0..18_000)
                .map(|i| altitudes_m(&views, PI * f64::from(i) / 18_000.0))
                .fold(f64::INFINITY, f64::min);
            prop_assert!(found.1 <= least + 1e-9, "{} {}", found.1, least);
        }
    }

    #[test]
    fn a_long_field_is_swept_along_its_length() {
        let field =
            [(0.0, 0.0), (400.0, 0.0), (400.0, 100.0), (0.0, 100.0)].map(|(x, y)| Point::new(x, y));
        let all = sweep_directions(&[&field]);
        assert!(all[0].0.abs() < 1e-12 && (all[0].1 - 100.0).abs() < 1e-9);
        assert_eq!(all.len(), 2);
    }
}
