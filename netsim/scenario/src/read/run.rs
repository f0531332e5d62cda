//! How a run goes: its times, its seed, and what is asked of its end.

use crate::request::Overrides;
use skein_interop::json::{Error, Fields};

/// Shortest beacon period in wall time, seconds: the transport's own timers run in
/// wall time and must stay faster than the protocol's.
const MIN_WALL_BEACON_S: f64 = 0.1;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Run {
    pub(crate) seed: u64,
    /// Scenario seconds per second of wall time in a trial.
    pub(crate) time_scale: f64,
    pub(crate) max_time_s: u32,
    pub(crate) beacon_period_ms: u32,
    pub(crate) percept_period_ms: u32,
    /// Share of the area that must be coverable.
    pub(crate) min_coverable: f64,
    pub(crate) min_separation_m: f64,
    /// How soon what the operator asks for is to be seen, seconds.
    pub(crate) max_visit_s: Option<u32>,
}

pub(crate) fn read(f: &Fields<'_>, over: &Overrides) -> Result<Run, Error> {
    let max_time_s = f.whole_or("max_time_s", 6000, 1, 604_800, "seconds")?;
    let (time_scale, beacon_period_ms) = times(f, over)?;
    let seed = f.whole_or("seed", 1, 0, u32::MAX, "any number")?;
    let (min_coverable, min_separation_m, max_visit_s) = checks(f)?;
    Ok(Run {
        seed: over.seed.unwrap_or(u64::from(seed)),
        time_scale,
        max_time_s,
        beacon_period_ms,
        percept_period_ms: f.whole_or("percept_period_ms", 200, 20, 1000, "milliseconds")?,
        min_coverable,
        min_separation_m,
        max_visit_s,
    })
}

/// Time scale and beacon period, which limit each other.
fn times(f: &Fields<'_>, over: &Overrides) -> Result<(f64, u32), Error> {
    let in_file = f.number_or("time_scale", 1.0, 0.1, 10.0, "scenario seconds per second")?;
    let time_scale = over.time_scale.unwrap_or(in_file);
    if !(0.1..=10.0).contains(&time_scale) {
        return Err(f.node().wrong(format!(
            "a time scale of {time_scale} was asked for; expected 0.1 to 10"
        )));
    }
    let beacon_s = f.number_or("beacon_period_s", 1.0, 0.1, 60.0, "seconds")?;
    if beacon_s / time_scale < MIN_WALL_BEACON_S - 1e-9 {
        let at = f.get("beacon_period_s").unwrap_or(f.node());
        return Err(at.wrong(format!(
            "{beacon_s} s at time scale {time_scale} are less than {MIN_WALL_BEACON_S} s of wall time; lower time_scale to {:.1}",
            beacon_s / MIN_WALL_BEACON_S
        )));
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0.1 and 60 s"
    )]
    Ok((time_scale, (beacon_s * 1000.0).round() as u32))
}

fn checks(f: &Fields<'_>) -> Result<(f64, f64, Option<u32>), Error> {
    let Some(node) = f.get("checks") else {
        return Ok((0.97, 0.0, None));
    };
    let f = node.fields(&["min_coverable", "min_separation_m", "max_visit_s"])?;
    Ok((
        f.number_or("min_coverable", 0.97, 0.0, 1.0, "as a share of the area")?,
        f.number_or("min_separation_m", 0.0, 0.0, 10_000.0, "metres")?,
        f.get("max_visit_s")
            .map(|n| n.whole(1, 86_400, "seconds"))
            .transpose()?,
    ))
}
