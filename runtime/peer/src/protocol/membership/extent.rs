//! How slow and how wide the swarm is, as far as a peer knows, and how long it waits for that
//! before it believes what.

use super::known::{Known, Weight};
use crate::input::Time;
use crate::protocol::airtime::ms_of;

/// Hops and eccentricities count for so many of the longest intervals after they were
/// heard: what a neighbour says of others comes round, and what is lost comes again.
pub(super) const HOP_INTERVALS: u64 = 10;

/// How slow and how wide the swarm is, as far as this peer knows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// The longest interval that anybody alive announced, T', quarters of T.
    pub(super) interval: u8,
    /// Who announced it, unless this peer did.
    interval_by: Option<u16>,
    /// The most hops that anybody alive is away, or says that somebody is.
    pub(super) hops: u8,
    /// Whose hops these are: of several the one of whom they were heard last.
    hops_by: Option<u16>,
    /// Unless something else is heard it is so until then.
    pub(super) until: Time,
}

impl Extent {
    /// Of those alive, where this peer announces an interval, in quarters of a period T.
    pub(super) fn measured<'a>(
        living: impl Iterator<Item = &'a Known> + Clone,
        own_interval: u8,
        period_ms: u64,
        now: Time,
    ) -> Self {
        let slowest = living.clone().max_by_key(|k| k.freshest.interval);
        let slowest = slowest.map(|k| k.freshest);
        let slowest = slowest.filter(|h| h.interval > own_interval);
        let interval = slowest.map_or(own_interval, |h| h.interval);
        let window_ms = window_ms(interval, period_ms);
        let each: Vec<(&Known, Weight)> = living.map(|k| (k, k.weight(now, window_ms))).collect();
        let hops = each.iter().map(|(_, w)| w.hops.max(w.eccentricity)).max();
        let hops = hops.unwrap_or(0);
        // Until then nobody is farther, and somebody is as far.
        let mut nearer = Time(u64::MAX);
        let mut as_far: Option<(Time, u16)> = None;
        for (known, weight) in each {
            let last = known.last_within(hops);
            let said = known.info.heard.filter(|_| weight.eccentricity == hops);
            let is_as_far = (weight.hops == hops).then_some(last).max(said);
            if weight.hops > 0 {
                nearer = nearer.min(last);
            }
            as_far = as_far.max(is_as_far.map(|since| (since, known.freshest.id)));
        }
        let as_far = as_far.filter(|_| hops > 0);
        let until = as_far.map_or(nearer, |(since, _)| nearer.min(since));
        Self {
            interval,
            interval_by: slowest.map(|h| h.id),
            hops,
            hops_by: as_far.map(|(_, id)| id),
            until: until.plus_ms(window_ms),
        }
    }

    /// Whether it may be something else now that one peer weighs something else: it stays what
    /// it is unless that one's was the most or is more. Of who comes back what was heard before
    /// it went counts again.
    pub(super) fn depends_on(&self, id: u16, before: Weight, after: Weight) -> bool {
        let was_most = [self.interval_by, self.hops_by].contains(&Some(id));
        let is_more = after.interval > self.interval
            || after.hops > self.hops
            || after.eccentricity > self.hops;
        before != after && (was_most || is_more || before == Weight::default())
    }
}

/// Hops and eccentricities count for so long, where the longest interval is so many quarters
/// of a period T.
pub(super) fn window_ms(interval: u8, period_ms: u64) -> u64 {
    HOP_INTERVALS * ms_of(interval, period_ms)
}

/// How long a peer waits before it believes what, at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    /// The longest interval announced, T'.
    pub(super) interval_ms: u64,
    /// k1, quarters.
    k1_quarters: u64,
    /// Time to refute a suspicion: k2 T' + (D - 1) T'/2, twice the latter where the air is full.
    refute_ms: u64,
    /// No living peer's heartbeat is older: (k1 + k2 + D + 2) T'.
    pub(super) bound_ms: u64,
}

impl Patience {
    /// Where the longest interval is T' and the diameter D. A peer whose own loop ran late
    /// doubts its verdicts first: both factors double. What refutes a suspicion may be lost between
    /// two hops, and often is where T' is longer than a period T, so many share the air.
    pub(super) fn new(interval_ms: u64, period_ms: u64, diameter: u64, doubts: bool) -> Self {
        let doubt = if doubts { 2 } else { 1 };
        let k1_quarters = doubt * (16 + diameter);
        let k2_ms = doubt * interval_ms * (8 + diameter) / 2;
        let travel_ms = (diameter + 2) * interval_ms;
        let halves = if interval_ms > period_ms { 2 } else { 1 };
        let detours_ms = halves * diameter.saturating_sub(1) * interval_ms / 2;
        Self {
            interval_ms,
            k1_quarters,
            refute_ms: k2_ms + detours_ms,
            bound_ms: interval_ms * k1_quarters / 4 + k2_ms + travel_ms,
        }
    }

    /// Silence after which is suspected who announced such an interval I: k1 I.
    pub(super) fn k1_ms(&self, interval_ms: u64) -> u64 {
        interval_ms * self.k1_quarters / 4
    }

    /// Time to refute a suspicion of who announced such an interval: k2 T' or more, and as much
    /// more as it is suspected sooner than the slowest would be. Where many are on the way what a
    /// heartbeat takes is counted in the longest interval, whoever sent it.
    pub(super) fn verdict_ms(&self, interval_ms: u64) -> u64 {
        let sooner_ms = self.interval_ms.saturating_sub(interval_ms);
        self.refute_ms + self.k1_ms(sooner_ms)
    }
}
