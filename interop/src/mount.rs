//! How a camera is held, as people write it beside its angles of view.

use crate::airframe::degrees;
use crate::json::{Error, Node};
use skein_flight::mount::{Gimbal, Mount};

/// Limits of gimbals that are accepted, degrees to either side.
pub const LIMIT_DEG: (f64, f64) = (1.0, 90.0);

/// Rates of gimbals that are accepted, degrees a second.
pub const RATE_DPS: (f64, f64) = (1.0, 1000.0);

/// Reads how a camera is held.
///
/// # Errors
/// [`Error`] names the value that is none, or out of its limits.
pub fn read(node: &Node<'_>) -> Result<Mount, Error> {
    if node.text().is_ok() {
        return node.one_of(&[("level", Mount::Level), ("fixed", Mount::Fixed)]);
    }
    let example = "{ roll_deg: 55, pitch_deg: 40, rate_dps: 120 }";
    let g = node.fields(&["gimbal"])?;
    let g = g.need("gimbal", example)?;
    let g = g.fields(&["roll_deg", "pitch_deg", "rate_dps"])?;
    let angle = |name, (low, high), unit| -> Result<f64, Error> {
        let angle = g.need(name, "60")?.number(low, high, unit)?;
        Ok(angle.to_radians())
    };
    Ok(Mount::Gimbal(Gimbal {
        roll_rad: angle("roll_deg", LIMIT_DEG, "degrees")?,
        pitch_rad: angle("pitch_deg", LIMIT_DEG, "degrees")?,
        rate_radps: angle("rate_dps", RATE_DPS, "degrees a second")?,
    }))
}

/// The mount as [`read`] takes it; what is read back is the same to the last bit.
#[must_use]
pub fn to_json(mount: &Mount) -> serde_json::Value {
    match mount {
        Mount::Level => "level".into(),
        Mount::Fixed => "fixed".into(),
        Mount::Gimbal(g) => serde_json::json!({ "gimbal": {
            "roll_deg": degrees(g.roll_rad),
            "pitch_deg": degrees(g.pitch_rad),
            "rate_dps": degrees(g.rate_radps),
        } }),
    }
}
