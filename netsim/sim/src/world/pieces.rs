//! Pieces of targets as the judge sees them: which lie near a camera, and which its
//! picture holds whole (D2.7 §3.3).

use super::camera::Picture;
use super::flat::Bounds;
use skein_geometry::frame::Point;
use std::collections::BTreeMap;

/// Side of the squares by which pieces are looked up, metres: about as far as a camera
/// of a small UAV sees.
const SQUARE_M: f64 = 64.0;

/// Pieces by number.
#[derive(Clone, Debug)]
pub struct Pieces {
    rings: Vec<[Point; 4]>,
    /// Where the first corner of each lies.
    within: BTreeMap<(i64, i64), Vec<usize>>,
}

fn square_of(p: Point) -> (i64, i64) {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a cast of a float saturates"
    )]
    let index = |v: f64| (v / SQUARE_M).floor() as i64;
    (index(p.x), index(p.y))
}

impl Pieces {
    /// Pieces with these corners.
    #[must_use]
    pub fn new(rings: Vec<[Point; 4]>) -> Self {
        let mut within: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
        for (n, ring) in rings.iter().enumerate() {
            within.entry(square_of(ring[0])).or_default().push(n);
        }
        Self { rings, within }
    }

    /// The corners of all pieces.
    #[must_use]
    pub fn rings(&self) -> &[[Point; 4]] {
        &self.rings
    }

    /// Pieces that may lie within `reach_m` of a place.
    pub fn near(&self, at: Point, reach_m: f64) -> impl Iterator<Item = usize> + '_ {
        let around = Bounds { min: at, max: at }.grown(reach_m);
        let (low, high) = (square_of(around.min), square_of(around.max));
        (low.0..=high.0)
            .flat_map(move |x| (low.1..=high.1).map(move |y| (x, y)))
            .filter_map(|key| self.within.get(&key))
            .flatten()
            .copied()
    }

    /// Whether a picture holds a piece whole.
    #[must_use]
    pub fn held(&self, n: usize, picture: &Picture) -> bool {
        picture.holds(&self.rings[n])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::frame::Pose;

    #[test]
    fn a_turned_picture_holds_what_lies_along_it() {
        let at = |x: f64, y: f64| Point::new(x, y);
        let road = [at(70.0, 0.0), at(110.0, 0.0), at(110.0, 4.0), at(70.0, 4.0)];
        let pieces = Pieces::new(vec![road]);
        let east = Pose::new(at(90.0, 0.0), 0.0);
        assert!(pieces.held(0, &Picture::level(east, (5.0, 21.0))));
        assert!(!pieces.held(0, &Picture::level(east, (5.0, 19.0))));
        let north = Pose::new(at(90.0, 0.0), core::f64::consts::FRAC_PI_2);
        assert!(!pieces.held(0, &Picture::level(north, (5.0, 21.0))));
        assert!(pieces.held(0, &Picture::level(north, (21.0, 5.0))));
        assert_eq!(pieces.near(at(60.0, 10.0), 30.0).count(), 1);
        assert_eq!(pieces.near(at(-60.0, 10.0), 30.0).count(), 0);
    }
}
