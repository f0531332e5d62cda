//! Lines from place to place.

use crate::frame::{Point, Vector};

/// The nearest place of a polyline to a point: metres along it, metres from it, and the
/// direction there. `None` where it has no piece.
#[must_use]
pub fn nearest(line: &[Point], to: Point) -> Option<(f64, f64, Vector)> {
    let mut best: Option<(f64, f64, Vector)> = None;
    let mut along_m = 0.0;
    for both in line.windows(2) {
        let way = both[1] - both[0];
        let length_m = way.norm();
        if length_m > 0.0 {
            let direction = way / length_m;
            let on_m = (to - both[0]).dot(&direction).clamp(0.0, length_m);
            let off_m = (to - (both[0] + direction * on_m)).norm();
            if best.is_none_or(|(_, least_m, _)| off_m < least_m) {
                best = Some((along_m + on_m, off_m, direction));
            }
        }
        along_m += length_m;
    }
    best
}

/// The length of a polyline, metres.
#[must_use]
pub fn length_m(line: &[Point]) -> f64 {
    line.windows(2).map(|b| (b[1] - b[0]).norm()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_place_is_told_by_how_far_along_and_beside_it_is() {
        let line = [(0.0, 0.0), (3.0, 0.0), (3.0, 4.0)].map(|(x, y)| Point::new(x, y));
        assert!((length_m(&line) - 7.0).abs() < 1e-12);
        let (along_m, off_m, way) = nearest(&line, Point::new(5.0, 2.0)).unwrap();
        assert!((along_m - 5.0).abs() < 1e-12 && (off_m - 2.0).abs() < 1e-12);
        assert!((way - Vector::new(0.0, 1.0)).norm() < 1e-12);
        assert!(nearest(&line[..1], Point::origin()).is_none());
    }
}
