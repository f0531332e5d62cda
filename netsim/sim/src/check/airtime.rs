//! Bytes on the air: over 10 s no peer transmits more than its share of the channel it is
//! in (S9), beacons included.

use super::{Clocks, Findings, Snapshot};
use skein_peer::protocol::relay::OVERHEAD_BYTES;
use std::collections::{BTreeMap, VecDeque};

/// Over so long a time a share is kept.
const WINDOW_MS: u64 = 10_000;

/// The part of the fair share that a peer may use, percent: beyond half of the air, most of
/// it is collisions between those who do not hear each other.
const SHARE_PERCENT: u64 = 45;

/// A bucket that was full when the window began: two seconds of the share, at least one of
/// the largest records.
const BURST_MIN_BYTES: u64 = 4_096 + OVERHEAD_BYTES as u64;

/// A beacon a period, of which one collides: so long a radio is not counted.
const COUNTED_PERIODS: u64 = 2;

/// Judged up to so many radios: from 13 in one earshot on, beacons with all their gossip
/// alone exceed the share at 64 kbit/s (docs/protocol.md §9).
const MAX_RADIOS: usize = 13;

/// What the peers of one run transmitted.
#[derive(Clone, Debug)]
pub struct AirtimeCheck {
    rate_bps: u64,
    sent: BTreeMap<u16, VecDeque<(u64, u64)>>,
    sharers: BTreeMap<u16, VecDeque<(u64, u64)>>,
    over: Clocks<u16>,
}

impl AirtimeCheck {
    /// The checks on a channel of this bit rate.
    #[must_use]
    pub fn new(rate_bps: u32) -> Self {
        Self {
            rate_bps: u64::from(rate_bps),
            sent: BTreeMap::new(),
            sharers: BTreeMap::new(),
            over: Clocks::default(),
        }
    }

    /// A peer puts so many bytes on the air, its own or another's.
    pub fn on_transmission(&mut self, now_ms: u64, id: u16, bytes: usize) {
        let cost = (bytes + OVERHEAD_BYTES) as u64;
        self.sent.entry(id).or_default().push_back((now_ms, cost));
    }

    /// Judges what everybody sent within the window, by the fewest radios in its earshot
    /// (itself included) meanwhile. One of them it may miss: it counts those whose beacons
    /// it heard in the last four periods.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let now_ms = snapshot.now_ms;
        let old = |t: &(u64, u64)| t.0 + WINDOW_MS < now_ms;
        for id in snapshot.graph.ids() {
            let heard = u64::from(snapshot.graph.neighbours(*id)) + 1;
            let sharers = self.sharers.entry(*id).or_default();
            sharers.push_back((now_ms, heard));
            // Whoever came into earshot lately is counted once a beacon of its got through.
            let before = |t: &(u64, u64)| {
                t.0 + WINDOW_MS + COUNTED_PERIODS * snapshot.bounds.period_ms < now_ms
            };
            while sharers.front().is_some_and(before) {
                sharers.pop_front();
            }
            let fewest = sharers.iter().map(|s| s.1).min().unwrap_or(1);
            let sent = self.sent.entry(*id).or_default();
            while sent.front().is_some_and(old) {
                sent.pop_front();
            }
            let bytes: u64 = sent.iter().map(|s| s.1).sum();
            let share_ps = self.rate_bps / 8 * SHARE_PERCENT / 100 / (fewest - 1).max(1);
            let most = share_ps * WINDOW_MS / 1000 + (2 * share_ps).max(BURST_MIN_BYTES);
            if bytes <= most || snapshot.graph.ids().len() > MAX_RADIOS {
                self.over.stop(*id);
                continue;
            }
            self.over.start(*id, now_ms);
            if self.over.tell_once(*id) {
                found.broken("S9", now_ms, Some(*id), || {
                    format!(
                        "sent {bytes} bytes in {} s among {fewest} radios (bound {most})",
                        WINDOW_MS / 1000
                    )
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;

    #[test]
    fn a_peer_that_sends_more_than_its_share_is_found() {
        for (bytes_ps, radios, broken) in [(1_500, 3, false), (2_500, 3, true), (2_500, 14, false)]
        {
            let mut check = AirtimeCheck::new(64_000);
            let (mut story, mut found) = (Story::new(0), Findings::new(1));
            let views: Vec<_> = (1..=radios).map(|id| (id, speaking())).collect();
            for t in 0..15 {
                check.on_transmission(t * 1000, 1, bytes_ps);
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(
                found.counts.contains_key("S9"),
                broken,
                "{bytes_ps} among {radios}"
            );
        }
    }
}
