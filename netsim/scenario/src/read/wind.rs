//! The wind of a scenario, as forecasts tell it: where it comes from, and how fast.

use skein_flight::trajectory::wind::Wind;
use skein_geometry::math::sin_cos;
use skein_interop::json::{Error, Node};

pub(crate) fn read(node: &Node<'_>) -> Result<Wind, Error> {
    let f = node.fields(&["from_deg", "speed_mps"])?;
    let from_deg = f
        .need("from_deg", "270")?
        .number(0.0, 360.0, "degrees clockwise from north")?;
    let speed_mps = f.need("speed_mps", "3")?.number(0.0, 50.0, "m/s")?;
    let (s, c) = sin_cos(from_deg.to_radians());
    Ok(Wind::new(-speed_mps * s, -speed_mps * c))
}
