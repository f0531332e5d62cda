//! Distances measured again, by code that shares nothing with the planners it checks.

use skein_geometry::frame::Point;

pub use skein_survey::measure::to_piece_m;

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
