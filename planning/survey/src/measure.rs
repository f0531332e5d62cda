//! Distances measured again, by code that shares nothing with the planners it checks.

use skein_geometry::frame::Point;

/// From a point to the piece of a line between two others, metres.
#[must_use]
pub fn to_piece_m(p: Point, a: Point, b: Point) -> f64 {
    let along = b - a;
    let square = along.norm_squared();
    let t = if square > 0.0 {
        ((p - a).dot(&along) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p - (a + along * t)).norm()
}
