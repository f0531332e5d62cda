//! Durations bounded from below or from both sides: a new life listens first (`probation`),
//! nobody is suspected or given up too soon (`haste`), a suspicion is answered at once
//! (`refute`), claims are repeated (`cadence`).

use super::{Clocks, Findings, Handicaps, Snapshot};
use skein_peer::Incarnation;
use skein_peer::output::Status;
use skein_peer::protocol::airtime::ms_of;
use skein_peer::wire::message::Beacon;
use std::collections::BTreeMap;

/// A claim is spoken again after 10 intervals for each eight that its author knows, up to a
/// quarter of one later so as not to be in step with others; the peer looks four times a
/// period. In quarters of an interval.
const CLAIM_QUARTERS: u64 = 4 * 10 + 1 + 1;

/// Clocks count whole milliseconds, and a timer is set a few times in a duration.
const ROUNDING_MS: u64 = 5;

/// k1 = 4 + D/4 at the least diameter 1, in quarters of an interval.
const LEAST_K1_QUARTERS: u64 = 16 + 1;

/// k2 = 4 + D/2 at the least diameter 1, in quarters of an interval.
const LEAST_K2_QUARTERS: u64 = 16 + 2;

/// A heartbeat as a neighbour received it from its author.
#[derive(Clone, Copy, Debug)]
struct Heard {
    incarnation: Incarnation,
    at_ms: u64,
    /// The shortest interval that its author announced since, milliseconds.
    interval_ms: u64,
}

/// What the durations of one run were found to be.
#[derive(Clone, Debug)]
pub struct CadenceCheck {
    period_ms: u64,
    booted_ms: BTreeMap<u16, u64>,
    /// By author and receiver.
    heard: BTreeMap<(u16, u16), Heard>,
    /// The highest life in which anybody ever heard each peer: who heard it may stand still.
    lives: BTreeMap<u16, Incarnation>,
    /// The same for the earlier processes of each peer.
    outlived: BTreeMap<u16, Incarnation>,
    /// What each peer's last beacon announced, milliseconds.
    announced: BTreeMap<u16, u64>,
    /// The longest since its last claim.
    slowest: BTreeMap<u16, u64>,
    accused: Clocks<u16>,
    /// In which life each was accused last.
    accused_in: BTreeMap<u16, Incarnation>,
    claims: Clocks<u16>,
}

impl CadenceCheck {
    /// The checks at beacon period T.
    #[must_use]
    pub fn new(period_ms: u64) -> Self {
        Self {
            period_ms,
            booted_ms: BTreeMap::new(),
            heard: BTreeMap::new(),
            lives: BTreeMap::new(),
            outlived: BTreeMap::new(),
            announced: BTreeMap::new(),
            slowest: BTreeMap::new(),
            accused: Clocks::default(),
            accused_in: BTreeMap::new(),
            claims: Clocks::default(),
        }
    }

    /// A process starts.
    pub fn on_boot(&mut self, now_ms: u64, id: u16) {
        self.on_silent(id);
        self.booted_ms.insert(id, now_ms);
        if let Some(life) = self.lives.get(&id) {
            self.outlived.insert(id, *life);
        }
    }

    /// A process ends, stands still, or goes on with another clock: what it heard before
    /// says nothing about its patience any more.
    pub fn on_silent(&mut self, id: u16) {
        self.heard.retain(|(_, rx), _| *rx != id);
        self.accused.stop(id);
        self.claims.stop(id);
    }

    /// A peer puts something on the air, its own or another's: not before it has listened
    /// for 3 T by its clock.
    pub fn on_transmission(
        &mut self,
        now_ms: u64,
        id: u16,
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        let Some(&booted_ms) = self.booted_ms.get(&id) else {
            return;
        };
        let listens_ms = 3 * self.period_ms;
        let listened_ms = handicaps.shown_ms(id, booted_ms, now_ms);
        if listened_ms + ROUNDING_MS < listens_ms {
            found.broken("probation", now_ms, Some(id), || {
                format!(
                    "speaks {listened_ms} ms after its start, it is to listen for {listens_ms} ms"
                )
            });
        }
        // Once is told once: what follows in this life is no further news.
        if listened_ms > listens_ms {
            self.booted_ms.remove(&id);
        }
    }

    /// A peer puts its own beacon or heartbeat on the air: whoever suspects it is answered.
    pub fn on_beacon_spoken(&mut self, id: u16, interval: u8) {
        self.accused.stop(id);
        let interval_ms = ms_of(interval, self.period_ms);
        self.announced.insert(id, interval_ms);
        let slowest = self.slowest.entry(id).or_default();
        *slowest = interval_ms.max(*slowest);
        for (_, heard) in self.heard.range_mut((id, 0)..=(id, u16::MAX)) {
            heard.interval_ms = heard.interval_ms.min(interval_ms);
        }
    }

    /// A peer says its claim again.
    pub fn on_claim(&mut self, now_ms: u64, id: u16) {
        self.claims.stop(id);
        self.claims.start(id, now_ms);
        self.slowest.insert(id, self.interval_ms(id));
    }

    fn interval_ms(&self, id: u16) -> u64 {
        self.announced.get(&id).copied().unwrap_or(self.period_ms)
    }

    /// A running peer receives a heartbeat from its author, that arrived then, with what
    /// its author announced. A process that lost its disk and begins a life that an earlier
    /// one has spoken in counts its heartbeats from the first again: they are older than what
    /// was heard, and prove nothing, until it is reminded and takes a later life.
    pub fn on_heartbeat_heard(
        &mut self,
        arrived_ms: u64,
        by: u16,
        (author, incarnation): (u16, Incarnation),
        interval: u8,
    ) {
        if self.outlived.get(&author) >= Some(&incarnation) {
            return;
        }
        let life = self.lives.entry(author).or_default();
        *life = incarnation.max(*life);
        let said_ms = ms_of(interval, self.period_ms);
        // While this one was on its way the author may have announced a shorter one.
        let latest_ms = self.announced.get(&author).copied();
        let heard = Heard {
            incarnation,
            at_ms: arrived_ms,
            interval_ms: latest_ms.map_or(said_ms, |ms| ms.min(said_ms)),
        };
        self.heard.insert((author, by), heard);
    }

    /// A running peer receives a beacon from its author, that arrived then; `life` is the
    /// receiver's own.
    pub fn on_beacon_heard(
        &mut self,
        (now_ms, arrived_ms): (u64, u64),
        (by, speaks_as, life): (u16, u16, Incarnation),
        (author, incarnation): (u16, Incarnation),
        beacon: &Beacon,
    ) {
        self.on_heartbeat_heard(arrived_ms, by, (author, incarnation), beacon.interval);
        let of_me = beacon.gossip.iter().filter(|g| g.id == speaks_as);
        for told in of_me.filter(|g| g.incarnation == life) {
            if told.suspected_ds.is_some() {
                self.accused.start(by, now_ms);
                self.accused_in.insert(by, life);
            } else {
                // Somebody believes it again: there is nothing to answer any more.
                self.accused.stop(by);
            }
        }
    }

    /// A belief changed. Whoever was heard is not suspected before k1 and not given up
    /// before k1 + k2 of its intervals, whoever says so: a suspicion counts from a heartbeat that is
    /// no older than the last one heard from its author. Each waits by its own clock;
    /// what is passed on was measured by others', which drift, and a late computer suspects
    /// somebody whose heartbeat waits for it.
    pub fn on_belief(
        &mut self,
        now_ms: u64,
        (observer, subject): (u16, u16),
        (incarnation, status): (Incarnation, Status),
        (diameter, handicaps): (u64, &Handicaps),
        found: &mut Findings,
    ) {
        let quarters = match status {
            Status::Alive => return,
            Status::Suspect => LEAST_K1_QUARTERS,
            Status::Down => LEAST_K1_QUARTERS + LEAST_K2_QUARTERS,
        };
        let heard = self.heard.get(&(subject, observer));
        let Some(heard) = heard.filter(|h| h.incarnation == incarnation) else {
            return;
        };
        let patience_ms = quarters * heard.interval_ms / 4;
        let passed_on_ms = handicaps.grown_ms(patience_ms, heard.at_ms, now_ms) - patience_ms;
        let since = (heard.at_ms, now_ms);
        let jumped_ms = handicaps.taken_for_listening_ms(observer, since, self.period_ms);
        let slack_ms = 100 * (diameter + 1) + passed_on_ms + jumped_ms;
        // What others measured they measured by clocks that are as fast as the slack allows, but
        // this one's slowness is not theirs.
        let lived_ms = handicaps.lived_ms(observer, heard.at_ms, now_ms);
        let silent_ms = lived_ms.max(now_ms.saturating_sub(heard.at_ms));
        if silent_ms + slack_ms < patience_ms {
            found.broken("haste", now_ms, Some(observer), || {
                format!(
                    "holds peer {subject} for {status:?} {silent_ms} ms after it heard it, it is to wait {patience_ms} ms"
                )
            });
        }
    }

    /// Judges what is overdue.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let now_ms = snapshot.now_ms;
        for m in snapshot.peers {
            if !m.view.speaks {
                self.accused.stop(m.id);
                self.claims.stop(m.id);
                continue;
            }
            // The answer waits a random eighth of the interval, and a quarter after the
            // last beacon; then the peer looks when it said it would. Twice that is a half.
            let answers_ms = self.interval_ms(m.id) / 2;
            // In a life that an earlier process spoke in it has no answer but a later one, which
            // is on the disk first.
            let begins_anew = self.outlived.get(&m.id) >= self.accused_in.get(&m.id);
            let late = self.accused.since(m.id).is_some_and(|t| {
                let write_ms = if begins_anew {
                    snapshot.handicaps.write_ms(m.id, t, now_ms)
                } else {
                    Some(0)
                };
                let late_ms = snapshot.late_ms(m.id, t);
                write_ms.is_some_and(|w| snapshot.lived_ms(m.id, t) > answers_ms + late_ms + w)
            });
            if late && self.accused.tell_once(m.id) {
                found.broken("refute", now_ms, Some(m.id), || {
                    "heard that it is suspected and did not answer within half of its interval"
                        .to_owned()
                });
            }
            if !m.uav || m.view.loop_hash == 0 {
                self.claims.stop(m.id);
                continue;
            }
            let slowest_ms = self.slowest.get(&m.id).copied().unwrap_or(0);
            let since_ms = self.claims.start(m.id, now_ms).max(m.since_ms);
            let interval_ms = slowest_ms.max(self.period_ms);
            let eights = (m.view.peers.len() as u64 / 8).max(1);
            let bound_ms =
                CLAIM_QUARTERS * eights * interval_ms / 4 + snapshot.late_ms(m.id, since_ms);
            let silent_ms = snapshot.lived_ms(m.id, since_ms);
            if silent_ms > bound_ms + ROUNDING_MS && self.claims.tell_once(m.id) {
                found.broken("cadence", now_ms, Some(m.id), || {
                    format!("has not said its claim for {silent_ms} ms (bound {bound_ms} ms)")
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use crate::fault::Fault;
    use skein_peer::Beliefs;
    use skein_peer::wire::message::Gossip;

    fn check() -> (CadenceCheck, Findings) {
        (CadenceCheck::new(1000), Findings::new(1))
    }

    fn beacon(suspects: Option<u16>) -> Beacon {
        let gossip = suspects.map(|id| Gossip {
            id,
            incarnation: 1,
            heartbeat: 9,
            age_ds: 40,
            hops: 1,
            interval: 4,
            suspected_ds: Some(1),
            able: true,
            max_seq: 0,
            digest: 0,
        });
        Beacon {
            heartbeat: 3,
            east_mm: 0,
            north_mm: 0,
            heading_e4: 0,
            able: true,
            ground_station: false,
            finished: false,
            nonce: 7,
            counter: 0,
            eccentricity: 1,
            interval: 4,
            sharers: 2,
            revision: 1,
            loop_hash: 3,
            cover_digest: 0,
            gossip: gossip.into_iter().collect(),
            fresh: Vec::new(),
        }
    }

    #[test]
    fn speaking_before_the_end_of_the_probation_is_found() {
        for (at_ms, broken) in [(2_900, true), (3_000, false)] {
            let (mut c, mut found) = check();
            c.on_boot(10_000, 1);
            c.on_transmission(10_000 + at_ms, 1, &Handicaps::default(), &mut found);
            assert_eq!(found.counts.contains_key("probation"), broken, "{at_ms}");
        }
    }

    /// A heartbeat was on its way when its author announced that it speaks more often.
    #[test]
    fn a_shorter_interval_counts_from_when_it_is_announced() {
        for (announced, broken) in [(4, false), (5, true)] {
            let (mut c, mut found) = check();
            c.on_beacon_spoken(2, announced);
            c.on_heartbeat_heard(50_000, 1, (2, 4), 5);
            let (down, healthy) = ((4, Status::Down), Handicaps::default());
            c.on_belief(59_000, (1, 2), down, (1, &healthy), &mut found);
            assert_eq!(found.counts.contains_key("haste"), broken, "{announced}");
        }
    }

    #[test]
    fn a_suspicion_or_a_death_too_soon_after_a_heartbeat_is_found() {
        for (status, after_ms, broken) in [
            (Status::Suspect, 3_900, true),
            (Status::Suspect, 4_250, false),
            (Status::Down, 7_200, true),
            (Status::Down, 8_750, false),
            (Status::Alive, 1, false),
        ] {
            let (mut c, mut found) = check();
            c.on_beacon_heard((50_000, 50_000), (1, 1, 1), (2, 4), &beacon(None));
            let now_ms = 50_000 + after_ms;
            let healthy = Handicaps::default();
            c.on_belief(now_ms, (1, 2), (3, Status::Down), (1, &healthy), &mut found);
            assert!(found.counts.is_empty(), "another life");
            c.on_belief(now_ms, (1, 2), (4, status), (1, &healthy), &mut found);
            assert_eq!(
                found.counts.contains_key("haste"),
                broken,
                "{status:?} {after_ms}"
            );
        }
    }

    #[test]
    fn a_jump_of_the_clock_counts_as_silence_up_to_one_look_at_the_time() {
        // A jump by less than half a period and a look is noticed by nobody.
        for (peer, ahead_ms, after_ms, broken) in [
            (1, 20_000, 3_700, true),
            (1, 20_000, 3_850, false),
            (1, 740, 3_350, false),
            (1, 760, 3_350, true),
            (3, 740, 3_350, false),
        ] {
            let (mut c, mut found) = check();
            let mut jumps = Handicaps::default();
            c.on_beacon_heard((50_000, 50_000), (1, 1, 1), (2, 4), &beacon(None));
            jumps.on_fault(52_000, &Fault::ClockJump { peer, ahead_ms });
            let suspects = (4, Status::Suspect);
            c.on_belief(50_000 + after_ms, (1, 2), suspects, (1, &jumps), &mut found);
            let is_found = found.counts.contains_key("haste");
            assert_eq!(is_found, broken, "{peer} {ahead_ms} {after_ms}");
        }
    }

    /// Who gives somebody up may have been told by one whose clock is fast; that its own is slow
    /// takes nothing from that.
    #[test]
    fn a_slow_clock_believes_what_a_fast_one_measured() {
        for (after_ms, broken) in [(8_360, true), (8_390, false)] {
            let (mut c, mut found) = check();
            let mut drifts = Handicaps::default();
            for (peer, ppm) in [(1, -20_000), (3, 20_000)] {
                drifts.on_fault(10_000, &Fault::ClockDrift { peer, ppm });
            }
            c.on_beacon_heard((50_000, 50_000), (1, 1, 1), (2, 4), &beacon(None));
            let down = (4, Status::Down);
            c.on_belief(50_000 + after_ms, (1, 2), down, (1, &drifts), &mut found);
            assert_eq!(found.counts.contains_key("haste"), broken, "{after_ms}");
        }
    }

    #[test]
    fn what_a_process_without_its_disk_says_in_an_old_life_proves_nothing() {
        let healthy = Handicaps::default();
        for (life, stood_still, broken) in [
            (4, false, false),
            (5, false, true),
            (4, true, false),
            (5, true, true),
        ] {
            let (mut c, mut found) = check();
            c.on_beacon_heard((50_000, 50_000), (1, 1, 1), (2, 4), &beacon(None));
            if stood_still {
                c.on_silent(1);
            }
            c.on_boot(70_000, 2);
            c.on_beacon_heard((80_000, 80_000), (1, 1, 1), (2, life), &beacon(None));
            c.on_belief(
                81_000,
                (1, 2),
                (life, Status::Down),
                (1, &healthy),
                &mut found,
            );
            let is_found = found.counts.contains_key("haste");
            assert_eq!(is_found, broken, "{life} {stood_still}");
        }
    }

    #[test]
    fn a_suspicion_that_its_subject_leaves_unanswered_is_found() {
        for answers in [false, true] {
            let (mut c, mut found) = check();
            let mut story = Story::new(0);
            c.on_beacon_heard((10_100, 10_100), (1, 1, 1), (2, 1), &beacon(Some(1)));
            if answers {
                c.on_beacon_spoken(1, 4);
            }
            let views = [(1, speaking())];
            story.snapshot(11_000, &views, |s| c.on_snapshot(s, &mut found));
            assert_eq!(found.counts.contains_key("refute"), !answers);
        }
    }

    #[test]
    fn who_begins_a_later_life_answers_once_that_is_on_its_disk() {
        for (outlived, slow, broken) in [
            (false, true, true),
            (true, false, true),
            (true, true, false),
        ] {
            let (mut c, mut found) = check();
            let mut story = Story::new(0);
            if slow {
                let fault = Fault::SlowStores {
                    peer: 1,
                    delay_ms: 660,
                };
                story.handicaps.on_fault(9_000, &fault);
            }
            if outlived {
                c.on_heartbeat_heard(5_000, 3, (1, 1), 4);
                c.on_boot(8_000, 1);
            }
            c.on_beacon_heard((10_100, 10_100), (1, 1, 1), (2, 1), &beacon(Some(1)));
            // It has begun the later one by then, and said nothing in it.
            let later = Beliefs {
                incarnation: 2,
                ..speaking()
            };
            story.snapshot(11_000, &[(1, later)], |s| {
                c.on_snapshot(s, &mut found);
            });
            let is_found = found.counts.contains_key("refute");
            assert_eq!(is_found, broken, "{outlived} {slow}");
            let mut much_later = Findings::new(1);
            story.snapshot(16_000, &[(1, speaking())], |s| {
                c.on_snapshot(s, &mut much_later)
            });
            assert!(is_found || much_later.counts.contains_key("refute"));
        }
    }

    #[test]
    fn a_claim_that_is_not_said_again_is_found() {
        for again_ms in [Some(9_000), None] {
            let (mut c, mut found) = check();
            let mut story = Story::new(0);
            let views = [(1, speaking())];
            for t in 0..14 {
                if again_ms == Some(t * 1000) {
                    c.on_claim(t * 1000, 1);
                }
                story.snapshot(t * 1000, &views, |s| c.on_snapshot(s, &mut found));
            }
            assert_eq!(
                found.counts.contains_key("cadence"),
                again_ms.is_none(),
                "{again_ms:?}"
            );
        }
    }
}
