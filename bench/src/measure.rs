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

/// Crossing parity of a ray to the right.
#[must_use]
pub fn is_inside(p: Point, ring: &[Point]) -> bool {
    let mut inside = false;
    for (i, a) in ring.iter().enumerate() {
        let b = ring[(i + 1) % ring.len()];
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y) {
            inside = !inside;
        }
    }
    inside
}
