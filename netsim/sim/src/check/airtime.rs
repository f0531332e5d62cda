//! Bytes on the air: over 10 s no peer transmits more than its share of the channel it is
//! in (S9), beacons included, at any number of radios.

use super::{Clocks, Findings, PeerSnapshot, Snapshot};
use skein_peer::protocol::airtime::{BURST_PERIODS, Filling, LENT_PERCENT, SHARE_PERCENT, ms_of};
use std::collections::{BTreeMap, VecDeque};

/// Over so long a time a share is kept.
const WINDOW_MS: u64 = 10_000;

/// Whoever comes into earshot is heard within the longest interval: until then a peer spends as
/// one of those who were there before.
const BEFORE_MS: u64 = 16_000;

/// One in so many radios may be missed, the first that it said lost: where many come into one
/// earshot at once they collide.
const MISSED_OF: u64 = 30;

/// What the peers of one run transmitted.
#[derive(Clone, Debug)]
pub struct AirtimeCheck {
    rate_bps: u64,
    period_ms: u64,
    burst_ms: u64,
    sent: BTreeMap<u16, VecDeque<(u64, u64)>>,
    frames: BTreeMap<u16, Filling>,
    /// When each last sent a beacon or a heartbeat.
    beats: BTreeMap<u16, u64>,
    sharers: BTreeMap<u16, VecDeque<(u64, u64)>>,
    /// When somebody in its component last followed an older mission.
    ahead: BTreeMap<u16, u64>,
    over: Clocks<u16>,
}

impl AirtimeCheck {
    /// The checks on a channel of this bit rate, at beacon period T.
    #[must_use]
    pub fn new(rate_bps: u32, period_ms: u64) -> Self {
        Self {
            rate_bps: u64::from(rate_bps),
            period_ms,
            burst_ms: BURST_PERIODS * period_ms,
            sent: BTreeMap::new(),
            frames: BTreeMap::new(),
            beats: BTreeMap::new(),
            sharers: BTreeMap::new(),
            ahead: BTreeMap::new(),
            over: Clocks::default(),
        }
    }

    /// A peer puts so many bytes on the air, its own or another's. What it puts there in
    /// one instant shares headers.
    pub fn on_transmission(&mut self, now_ms: u64, id: u16, bytes: usize) {
        let cost = self.frames.entry(id).or_default().add(now_ms, bytes) as u64;
        self.sent.entry(id).or_default().push_back((now_ms, cost));
    }

    /// What it sent last was a beacon or a heartbeat of this interval. A heartbeat that
    /// comes less than two fifths of it after the last one answers a suspicion, which has a
    /// reserve of its own: others come half-way, ±10 %.
    pub fn on_beat(&mut self, now_ms: u64, id: u16, interval: u8, heartbeat: bool) {
        let before = self.beats.insert(id, now_ms);
        let early_ms = 2 * ms_of(interval, self.period_ms) / 5;
        if heartbeat && before.is_some_and(|t| now_ms < t + early_ms) {
            self.sent.entry(id).or_default().pop_back();
        }
    }

    /// Judges what everybody sent within the window, by the fewest radios in its earshot
    /// (itself included) meanwhile and for so long before that all are heard of, of which it
    /// may miss one, or one in thirty. To the share of that time comes what a full bucket held
    /// when it began, and one record: the largest goes when the bucket is full, and what it
    /// lacked is owed. Whoever follows a newer mission than somebody in its component may have
    /// borrowed its part of what all may use, and a period of it.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let now_ms = snapshot.now_ms;
        let old = |t: &(u64, u64)| t.0 + WINDOW_MS < now_ms;
        let older = |t: &(u64, u64)| t.0 + WINDOW_MS + BEFORE_MS < now_ms;
        for id in snapshot.graph.ids() {
            let borrows = self.borrows(*id, snapshot);
            let heard = u64::from(snapshot.graph.neighbours(*id)) + 1;
            let sharers = self.sharers.entry(*id).or_default();
            sharers.push_back((now_ms, heard));
            while sharers.front().is_some_and(older) {
                sharers.pop_front();
            }
            let fewest = sharers.iter().map(|s| s.1).min().unwrap_or(1);
            let sent = self.sent.entry(*id).or_default();
            while sent.front().is_some_and(old) {
                sent.pop_front();
            }
            let bytes: u64 = sent.iter().map(|s| s.1).sum();
            let largest = sent.iter().map(|s| s.1).max().unwrap_or(0);
            let counted = |radios: u64| radios - (radios / MISSED_OF).max(1);
            let share_ps =
                |radios: u64| self.rate_bps / 8 * SHARE_PERCENT / 100 / counted(radios).max(1);
            let burst = share_ps(fewest) * self.burst_ms / 1000;
            // A clock that jumps within the window fills the bucket once more.
            let from_ms = now_ms.saturating_sub(WINDOW_MS);
            let shown_ms = snapshot.handicaps.shown_ms(*id, from_ms, now_ms);
            let jumped_ms = shown_ms.saturating_sub(WINDOW_MS);
            let jumped = (share_ps(fewest) * jumped_ms / 1000).min(burst);
            let lent_ps = share_ps(1) * LENT_PERCENT / 100;
            let lent_ms = if borrows {
                WINDOW_MS + self.period_ms
            } else {
                0
            };
            let lent = lent_ps * lent_ms / 1000;
            let most = share_ps(fewest) * WINDOW_MS / 1000 + burst + jumped + lent + largest;
            if bytes <= most {
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

impl AirtimeCheck {
    /// Whether a peer may have borrowed within the window: its neighbours lend until their next
    /// beacons tell that they follow its mission.
    fn borrows(&mut self, id: u16, snapshot: &Snapshot<'_>) -> bool {
        let now_ms = snapshot.now_ms;
        let revision = |p: &PeerSnapshot| p.view.revision;
        let mine = snapshot.peers.iter().find(|p| p.id == id).map(revision);
        let is_behind = |p: &PeerSnapshot| {
            mine.is_some_and(|mine| revision(p) < mine) && snapshot.graph.joined(id, p.id)
        };
        if snapshot.peers.iter().any(is_behind) {
            self.ahead.insert(id, now_ms);
        }
        let ahead = self.ahead.get(&id);
        ahead.is_some_and(|t| now_ms <= t + WINDOW_MS + BEFORE_MS)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use crate::fault::Fault;
    use skein_peer::protocol::airtime::OVERHEAD_BYTES;

    #[test]
    fn a_peer_that_sends_more_than_its_share_is_found_at_any_number() {
        for (bytes_ps, radios, broken) in [
            (1_800, 3, false),
            (3_000, 3, true),
            (200, 14, false),
            (400, 14, true),
            (40, 50, false),
            (120, 50, true),
        ] {
            let mut check = AirtimeCheck::new(64_000, 1000);
            let (mut story, mut found) = (Story::new(0), Findings::new(1));
            let views: Vec<_> = (1..=radios).map(|id| (id, speaking())).collect();
            for t in 0..15 {
                check.on_transmission(t * 1000, 1, bytes_ps - OVERHEAD_BYTES);
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(
                found.counts.contains_key("S9"),
                broken,
                "{bytes_ps} among {radios}"
            );
        }
    }

    #[test]
    fn a_clock_that_jumps_fills_the_bucket_once_more() {
        for (jump_ms, broken) in [(0, true), (30_000, false)] {
            let mut check = AirtimeCheck::new(64_000, 1000);
            let (mut story, mut found) = (Story::new(0), Findings::new(1));
            if jump_ms > 0 {
                let (peer, ahead_ms) = (1, jump_ms);
                let fault = Fault::ClockJump { peer, ahead_ms };
                story.handicaps.on_fault(13_000, &fault);
            }
            let views: Vec<_> = (1..=5).map(|id| (id, speaking())).collect();
            for t in 0..20 {
                // A share is 900 bytes a second, a bucket three seconds of it.
                for _ in 0..if t == 14 { 7 } else { 1 } {
                    check.on_transmission(t * 1000, 1, 900 - OVERHEAD_BYTES);
                }
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(found.counts.contains_key("S9"), broken, "{jump_ms}");
        }
    }

    #[test]
    fn who_comes_into_earshot_counts_once_it_can_have_been_heard() {
        // A share among twelve is 327 bytes a second, one among six is 720.
        for (lasts_s, broken) in [(20, false), (40, true)] {
            let mut check = AirtimeCheck::new(64_000, 1000);
            let (mut story, mut found) = (Story::new(0), Findings::new(1));
            let views: Vec<_> = (1..=12).map(|id| (id, speaking())).collect();
            for t in 0..20 + lasts_s {
                let there = if t < 20 { 6 } else { 12 };
                check.on_transmission(t * 1000, 1, 680 - OVERHEAD_BYTES);
                story.snapshot(t * 1000, &views[..there], |s| {
                    check.on_snapshot(s, &mut found)
                });
            }
            assert_eq!(found.counts.contains_key("S9"), broken, "{lasts_s}");
        }
    }

    #[test]
    fn answers_to_a_suspicion_are_not_counted() {
        let mut check = AirtimeCheck::new(64_000, 1000);
        let (mut story, mut found) = (Story::new(0), Findings::new(1));
        let views: Vec<_> = (1..=50).map(|id| (id, speaking())).collect();
        for t in 0..60 {
            check.on_transmission(t * 250, 1, 50);
            check.on_beat(t * 250, 1, 4, true);
            story.snapshot(t * 250, &views, |s| check.on_snapshot(s, &mut found));
        }
        assert!(found.counts.is_empty());
    }
}
