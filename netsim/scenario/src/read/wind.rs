//! The wind of a scenario, as forecasts tell it: where it comes from, how fast, when it changes,
//! and whether UAVs have to find it out themselves.

use skein_flight::trajectory::wind::Wind;
use skein_geometry::math::sin_cos;
use skein_interop::json::{Error, Node};
use skein_netsim::weather::{AirspeedErrors, Change, Weather};

/// A wind that goes over into another one does so in steps of at most this, m/s.
const STEP_MPS: f64 = 0.25;

/// Most times at which a wind changes.
const CHANGES_MAX: usize = 64;

pub(crate) fn read(node: &Node<'_>) -> Result<Weather, Error> {
    let f = node.fields(&["from_deg", "speed_mps", "changes", "airspeed_error"])?;
    let first = blowing(&f)?;
    let mut changes = Vec::new();
    let mut before = (0.0, first);
    let items = f.get("changes").map_or(Ok(Vec::new()), |n| n.items())?;
    if let Some(extra) = items.get(CHANGES_MAX) {
        return Err(extra.wrong(format!(
            "the wind changes {} times; expected at most {CHANGES_MAX}",
            items.len()
        )));
    }
    for item in &items {
        let f = item.fields(&["at_s", "over_s", "from_deg", "speed_mps"])?;
        let at = f.need("at_s", "300")?;
        let at_s = at.number(0.0, 1e6, "s")?;
        let over_s = f
            .get("over_s")
            .map_or(Ok(0.0), |n| n.number(0.0, 3600.0, "s"))?;
        if at_s <= before.0 {
            return Err(at.wrong(format!(
                "the wind changes at {at_s} s, and the one before has come at {} s; expected a later time",
                before.0
            )));
        }
        let to = blowing(&f)?;
        changes.extend(steps((at_s, over_s), before.1, to));
        before = (at_s + over_s, to);
    }
    Ok(Weather {
        first,
        changes,
        estimated: f.get("airspeed_error").map(errors).transpose()?,
    })
}

/// What is said of one wind.
fn blowing(f: &skein_interop::json::Fields<'_>) -> Result<Wind, Error> {
    let from_deg = f
        .need("from_deg", "270")?
        .number(0.0, 360.0, "degrees clockwise from north")?;
    let speed_mps = f.need("speed_mps", "3")?.number(0.0, 50.0, "m/s")?;
    let (s, c) = sin_cos(from_deg.to_radians());
    Ok(Wind::new(-speed_mps * s, -speed_mps * c))
}

/// How one wind goes over into another one.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times and counts that were checked"
)]
fn steps((at_s, over_s): (f64, f64), from: Wind, to: Wind) -> Vec<Change> {
    let by = to.velocity() - from.velocity();
    let n = if over_s > 0.0 {
        (by.norm() / STEP_MPS).ceil().max(1.0)
    } else {
        1.0
    };
    let step = |k: u32| {
        let share = f64::from(k) / n;
        let velocity = from.velocity() + by * share;
        Change {
            at_ms: ((at_s + over_s * share) * 1000.0).round() as u64,
            wind: Wind::new(velocity.x, velocity.y),
        }
    };
    (1..=n as u32).map(step).collect()
}

fn errors(node: &Node<'_>) -> Result<AirspeedErrors, Error> {
    let f = node.fields(&["scale_percent", "noise_mps"])?;
    let scale_percent =
        f.need("scale_percent", "3")?
            .number(0.0, 5.0, "percent of the airspeed")?;
    Ok(AirspeedErrors {
        scale: scale_percent / 100.0,
        noise_mps: f.need("noise_mps", "0.3")?.number(0.0, 2.0, "m/s")?,
    })
}
