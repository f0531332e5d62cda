//! The radio of a scenario.

use super::faults::permille;
use skein_interop::json::{Error, Node};
use skein_netsim::spec::RadioSpec;

pub(crate) fn read(node: &Node<'_>) -> Result<RadioSpec, Error> {
    let f = node.fields(&[
        "range_m",
        "rate_bps",
        "loss_percent",
        "delay_ms",
        "queue_age_ms",
    ])?;
    Ok(RadioSpec {
        range_m: f.need("range_m", "500")?.number(1.0, 1e6, "metres")?,
        rate_bps: f.whole_or("rate_bps", 64_000, 1200, 1_000_000_000, "bit/s")?,
        loss_permille: f.get("loss_percent").map_or(Ok(0), permille)?,
        delay_ms: f.small_or("delay_ms", 5, 0, 10_000, "milliseconds")?,
        queue_age_ms: f.whole_or("queue_age_ms", 2000, 1, 60_000, "milliseconds")?,
    })
}
