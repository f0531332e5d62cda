//! From what was seen to the verdict.

use crate::ledger::secs;
use crate::trial::Trial;
use crate::verdict::Verdict;
use skein_link::Reason;
use std::collections::BTreeMap;

impl Trial<'_> {
    /// Draws the verdict; call it when everybody is gone.
    pub(crate) fn verdict(&self) -> Verdict {
        let coverage = self.world.coverage(self.spec.min_coverable);
        let live = self.live_uavs();
        let (finished, unfinished): (Vec<u16>, Vec<u16>) =
            live.iter().partition(|id| self.ledger.is_finished(**id));
        let kills = self.ledger.kills();
        let zone_entries = self.world.zone_entries();
        let mut failures = self.ledger.failures.clone();
        if coverage.covered < coverage.coverable {
            failures.push(format!(
                "{} coverable cells were not seen",
                coverage.coverable - coverage.covered
            ));
        }
        if coverage.coverable_share < coverage.needed_share {
            failures.push(format!(
                "only {:.1} % of the area is coverable, {:.1} % are asked for",
                coverage.coverable_share * 100.0,
                coverage.needed_share * 100.0
            ));
        }
        if zone_entries > 0 {
            failures.push(format!("no-fly zones were entered {zone_entries} times"));
        }
        if live.is_empty() {
            failures.push("no UAV is left".to_owned());
        }
        if !unfinished.is_empty() {
            failures.push(format!(
                "{} live UAVs do not hold the mission finished",
                unfinished.len()
            ));
        }
        let radio = &self.ledger.radio;
        let components = &self.ledger.components;
        Verdict {
            scenario: self.spec.name.clone(),
            seed: self.seed,
            passed: failures.is_empty(),
            failures,
            time_s: secs(self.now_ms),
            wall_s: self.flown.as_secs_f64(),
            time_scale: self.spec.time_scale,
            lowest_time_scale: self.pacer.lowest(),
            coverage,
            zone_entries,
            separation_m: self.world.separation_m(),
            kills,
            restarts: self.ledger.restarts(),
            splits: components.splits,
            merges: components.merges,
            most_components: components.most,
            link_cuts: self.world.link_cuts(),
            messages_lost: radio
                .lost
                .iter()
                .map(|(r, n)| (reason(*r).to_owned(), *n))
                .collect(),
            messages_sent: radio.sent,
            bytes_sent: radio.sent_bytes,
            messages_received: radio.received,
            multi_hop: radio.multi_hop,
            relayed_by: radio.relayed_by.iter().copied().collect::<BTreeMap<_, _>>(),
            overrun: radio.overrun,
            finished,
            unfinished,
            setpoint_delay_ms: self.setpoint_delay_ms,
            alarms: self.ledger.alarms.clone(),
        }
    }
}

fn reason(reason: Reason) -> &'static str {
    match reason {
        Reason::Range => "range",
        Reason::Sight => "sight",
        Reason::Cut => "fault",
        Reason::Loss => "loss",
        Reason::QueueAge => "queue age",
        Reason::Collision => "collision",
    }
}
