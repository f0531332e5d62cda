//! Rounds: how sections are negotiated, from immutable bids alone.
//!
//! A round names its members. Each member speaks one bid in it; whoever holds
//! all of them computes the same division, so there is no leader and no vote.
//!
//! | state | event | next state | output |
//! |---|---|---|---|
//! | any | a higher round that names me | open (that round) | a bid is wanted |
//! | open | my bid is durable | open | it may be spoken |
//! | open | a bid of this round | open, or complete with the last one | |
//! | open | a bid of a lower round | open | ignored: it is dead |
//! | complete | decided | closed | the counter stays |
//! | any | a round that does not name me, or is far above all counters | same | only its counter is remembered, in steps |
//! | any | a round of an earlier revision than that which led back to this loop | same | only its counter is remembered |
//!
//! Rounds are ordered by (counter, number of members, hash of members and loop);
//! a higher one abandons a lower one, and bids of different rounds never mix.

use crate::wire::limits::DURATION_MAX_MS;
use crate::wire::message::{Bid, Epoch, Member, Round};
use skein_geometry::hash::{Fnv, folded};
use std::collections::BTreeMap;
use std::hash::Hash;

/// The order of rounds.
pub type RoundOrder = (u32, usize, u32);

/// Where a round stands in the order of rounds. The waiting time is not part of it.
#[must_use]
pub fn order_of(round: &Round) -> RoundOrder {
    let mut h = Fnv::new();
    (
        &round.members,
        round.revision,
        round.loop_hash,
        round.repair,
    )
        .hash(&mut h);
    (round.counter, round.members.len(), folded(h.finish()))
}

/// The highest round that names this peer, with the bids held.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct OpenRound {
    /// The round; its waiting time is the longest heard.
    pub round: Round,
    /// Held bids by member, this peer's own only once it is durable.
    pub bids: BTreeMap<u16, Bid>,
}

/// What a heard bid changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeardBid {
    /// Nothing, or only the counter.
    Nothing,
    /// No honest peer opens its round, and why.
    Refused(&'static str),
    /// It opened a higher round that names this peer: a bid is wanted.
    BidWanted,
    /// It belongs to the open round.
    Added,
}

/// All that a peer remembers of rounds.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Rounds {
    me: Member,
    counter: u32,
    open: Option<OpenRound>,
    closed: Option<RoundOrder>,
    silent: BTreeMap<Member, u8>,
    /// Rounds of earlier revisions of the mission are of an earlier stay on this loop.
    since_revision: u32,
    /// By so much what is heard may still raise the counter in this period.
    may_rise: u32,
    longest_wait_ms: u32,
}

impl Rounds {
    /// No round yet; `counter` is what the journal promised.
    #[must_use]
    pub fn new(me: Member, counter: u32) -> Self {
        Self {
            me,
            counter,
            open: None,
            closed: None,
            silent: BTreeMap::new(),
            since_revision: 0,
            may_rise: COUNTER_STEP,
            longest_wait_ms: DURATION_MAX_MS,
        }
    }

    /// A mission of this revision leads to this loop from another one: bids of rounds of earlier
    /// ones are what was said when it was flown before.
    pub fn begin_at(&mut self, revision: u32) {
        self.since_revision = revision;
    }

    /// A period begins, in which rounds of others are waited for no longer than this.
    pub fn new_period(&mut self, longest_wait_ms: u32) {
        self.may_rise = COUNTER_STEP;
        self.longest_wait_ms = longest_wait_ms;
    }

    /// The highest counter seen anywhere.
    #[must_use]
    pub fn counter(&self) -> u32 {
        self.counter
    }

    /// Remembers a counter heard of; in one period at most [`COUNTER_STEP`] above what was
    /// known. Returns whether it is believed.
    pub fn hear_counter(&mut self, counter: u32) -> bool {
        let rise = counter.saturating_sub(self.counter).min(self.may_rise);
        self.may_rise -= rise;
        self.counter += rise;
        counter <= self.counter
    }

    /// Remembers the counter of a round.
    ///
    /// # Errors
    /// Why it is none that an honest peer opens.
    pub fn believe(&mut self, round: &Round) -> Result<(), &'static str> {
        if self.hear_counter(round.counter) {
            Ok(())
        } else {
            Err("a round that is far ahead of all that was heard of")
        }
    }

    /// The open round, if there is one.
    #[must_use]
    pub fn open(&self) -> Option<&OpenRound> {
        self.open.as_ref()
    }

    /// A bid by its author, who speaks in the given life.
    pub fn hear(&mut self, author: Member, bid: &Bid) -> HeardBid {
        let round = &bid.round;
        if let Err(why) = self.believe(round) {
            return HeardBid::Refused(why);
        }
        if !round.members.contains(&self.me)
            || !round.members.contains(&author)
            || author == self.me
            || round.revision < self.since_revision
        {
            return HeardBid::Nothing;
        }
        let order = order_of(round);
        if self.closed.is_some_and(|c| order <= c) {
            return HeardBid::Nothing;
        }
        // Its author may take somebody slow for alive whom this peer holds for down.
        let wait_ms = round.wait_ms.min(self.longest_wait_ms);
        match &mut self.open {
            Some(open) if order_of(&open.round) == order => {
                open.round.wait_ms = open.round.wait_ms.max(wait_ms);
                self.silent.remove(&author);
                match open.bids.entry(author.id) {
                    std::collections::btree_map::Entry::Occupied(_) => HeardBid::Nothing,
                    std::collections::btree_map::Entry::Vacant(v) => {
                        v.insert(bid.clone());
                        HeardBid::Added
                    }
                }
            }
            Some(open) if order_of(&open.round) > order => HeardBid::Nothing,
            _ => {
                self.silent.remove(&author);
                let bids = BTreeMap::from([(author.id, bid.clone())]);
                let round = Round {
                    wait_ms,
                    ..round.clone()
                };
                self.open = Some(OpenRound { round, bids });
                HeardBid::BidWanted
            }
        }
    }

    /// Opens a round of this peer's own making, one above every counter seen.
    /// `members` must hold this peer; whoever was silent in two rounds running is
    /// left out. The bid is wanted next.
    pub fn start(
        &mut self,
        mut members: Vec<Member>,
        revision: u32,
        loop_hash: u64,
        repair: bool,
        wait_ms: u32,
    ) {
        members
            .retain(|m| *m == self.me || self.silent.get(m).copied().unwrap_or(0) < SILENT_ROUNDS);
        members.sort_unstable();
        assert!(members.contains(&self.me), "a peer opens rounds of its own");
        self.counter = self.counter.saturating_add(1);
        let round = Round {
            counter: self.counter,
            members,
            revision,
            loop_hash,
            repair,
            wait_ms,
        };
        self.open = Some(OpenRound {
            round,
            bids: BTreeMap::new(),
        });
    }

    /// This peer's own bid is durable. Returns whether it belongs to the open round.
    pub fn bid(&mut self, bid: Bid) -> bool {
        let order = order_of(&bid.round);
        match &mut self.open {
            Some(open) if order_of(&open.round) == order => {
                open.bids.insert(self.me.id, bid);
                true
            }
            _ => false,
        }
    }

    /// The open round with all its bids, if none is missing, and its epoch.
    #[must_use]
    pub fn complete(&self) -> Option<(Epoch, &OpenRound)> {
        let open = self.open.as_ref()?;
        if open
            .round
            .members
            .iter()
            .any(|m| !open.bids.contains_key(&m.id))
        {
            return None;
        }
        Some((epoch_of(open), open))
    }

    /// Members of the open round whose bid is missing.
    #[must_use]
    pub fn missing(&self) -> Vec<Member> {
        self.open.as_ref().map_or_else(Vec::new, |open| {
            open.round
                .members
                .iter()
                .filter(|m| !open.bids.contains_key(&m.id))
                .copied()
                .collect()
        })
    }

    /// The open round ended in a decision: it is closed, and nobody counts as
    /// silent any more, also who was left out of it: the next round asks all.
    pub fn close(&mut self) {
        if let Some(open) = self.open.take() {
            self.closed = Some(order_of(&open.round));
            self.silent.clear();
        }
    }

    /// The open round ended without a decision: its missing members were silent
    /// once more.
    pub fn give_up(&mut self) {
        for m in self.missing() {
            if m != self.me {
                let s = self.silent.entry(m).or_default();
                *s = s.saturating_add(1);
            }
        }
        if let Some(open) = self.open.take() {
            self.closed = Some(order_of(&open.round));
        }
    }

    /// From now on this peer is `me`; the open round, which it joined before, is void.
    pub fn set_me(&mut self, me: Member) {
        self.me = me;
        self.open = None;
    }
}

/// What is heard in one period raises one's own counter by so many at most, and a bid of
/// a round beyond that is refused. A peer opens four rounds a period at most, so whoever
/// comes back from a partition, or begins on an empty disk, catches up 250 times as fast
/// as a swarm can run ahead; and counters that were made up use all of them up in seven
/// weeks of periods of a second, not at once.
pub const COUNTER_STEP: u32 = 1_000;

/// A member that was silent in so many rounds running is left out of the next.
pub const SILENT_ROUNDS: u8 = 2;

/// The epoch of a complete round: its counter, then the round's place in the order of
/// rounds, then the hash of its sorted bids, so that of two rounds with one
/// counter the higher one has the higher epoch.
#[must_use]
pub fn epoch_of(open: &OpenRound) -> Epoch {
    let mut h = Fnv::new();
    for (id, s) in &open.bids {
        (id, order_of(&s.round)).hash(&mut h);
        (
            s.anchor,
            s.backward,
            s.release_ms,
            s.speed_mmps,
            s.turn_ms,
            s.endurance_ms,
        )
            .hash(&mut h);
        (
            &s.covered,
            &s.commits,
            &s.off_loop,
            s.eta_ms,
            s.calm,
            s.progressed,
        )
            .hash(&mut h);
    }
    let (counter, members, order) = order_of(&open.round);
    let members = u32::try_from(members.min(255)).unwrap_or(255);
    let hash = (members << 24) | (order >> 20 << 12) | (folded(h.finish()) & 0xfff);
    Epoch { counter, hash }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn member(id: u16) -> Member {
        Member { id, incarnation: 1 }
    }

    fn bid(round: &Round, anchor: u16) -> Bid {
        Bid {
            round: round.clone(),
            anchor,
            backward: false,
            release_ms: 0,
            speed_mmps: 13_000,
            turn_ms: 10_000,
            endurance_ms: 1_000_000,
            covered: Vec::new(),
            commits: Vec::new(),
            off_loop: Vec::new(),
            eta_ms: 0,
            calm: false,
            progressed: false,
        }
    }

    fn round(counter: u32, ids: &[u16]) -> Round {
        Round {
            counter,
            members: ids.iter().map(|i| member(*i)).collect(),
            revision: 1,
            loop_hash: 7,
            repair: true,
            wait_ms: 5000,
        }
    }

    #[test]
    fn all_members_compute_the_same_epoch_in_any_order_of_arrival() {
        let r = round(1, &[1, 2, 3]);
        let mut epochs = Vec::new();
        for (me, order) in [(1, [2, 3]), (2, [3, 1]), (3, [1, 2])] {
            let mut rounds = Rounds::new(member(me), 0);
            let mut wanted = 0;
            for id in order {
                if rounds.hear(member(id), &bid(&r, id)) == HeardBid::BidWanted {
                    wanted += 1;
                    assert!(rounds.complete().is_none());
                    assert!(rounds.bid(bid(&r, me)));
                }
            }
            assert_eq!(wanted, 1);
            epochs.push(rounds.complete().unwrap().0);
        }
        assert!(epochs.windows(2).all(|w| w[0] == w[1]));
    }

    #[test]
    fn a_higher_round_abandons_a_lower_one_for_good() {
        let (low, high) = (round(1, &[1, 2]), round(2, &[1, 2]));
        let mut rounds = Rounds::new(member(1), 0);
        rounds.hear(member(2), &bid(&low, 0));
        assert_eq!(rounds.hear(member(2), &bid(&high, 0)), HeardBid::BidWanted);
        assert!(
            !rounds.bid(bid(&low, 1)),
            "a bid for a dead round is not spoken"
        );
        assert_eq!(rounds.hear(member(2), &bid(&low, 0)), HeardBid::Nothing);
        assert!(rounds.complete().is_none());
    }

    #[test]
    fn the_same_round_started_twice_is_one_round() {
        let mut a = Rounds::new(member(1), 4);
        let mut b = Rounds::new(member(2), 4);
        let members = vec![member(2), member(1)];
        a.start(members.clone(), 1, 7, true, 5000);
        b.start(members, 1, 7, true, 9000);
        let ra = a.open().unwrap().round.clone();
        let rb = b.open().unwrap().round.clone();
        a.bid(bid(&ra, 1));
        assert_eq!(a.hear(member(2), &bid(&rb, 2)), HeardBid::Added);
        assert!(a.complete().is_some());
        assert_eq!(a.open().unwrap().round.wait_ms, 9000);
    }

    #[test]
    fn who_is_silent_twice_is_left_out() {
        let mut a = Rounds::new(member(1), 0);
        for _ in 0..2 {
            a.start(vec![member(1), member(2)], 1, 7, true, 5000);
            assert_eq!(a.open().unwrap().round.members.len(), 2);
            a.give_up();
        }
        a.start(vec![member(1), member(2)], 1, 7, true, 5000);
        assert_eq!(a.open().unwrap().round.members, [member(1)]);
    }

    #[test]
    fn a_round_that_does_not_name_me_only_raises_the_counter() {
        let mut a = Rounds::new(member(1), 0);
        let r = round(9, &[2, 3]);
        assert_eq!(a.hear(member(2), &bid(&r, 0)), HeardBid::Nothing);
        assert!(a.open().is_none());
        assert_eq!(a.counter(), 9);
    }

    #[test]
    fn what_was_bid_when_this_loop_was_flown_before_is_no_round_of_today() {
        let mut a = Rounds::new(member(1), 19);
        a.begin_at(3);
        let mut r = round(10, &[1, 2]);
        for revision in 1..3 {
            r.revision = revision;
            assert_eq!(a.hear(member(2), &bid(&r, 0)), HeardBid::Nothing);
            assert!(a.open().is_none());
        }
        r.revision = 3;
        assert_eq!(a.hear(member(2), &bid(&r, 0)), HeardBid::BidWanted);
    }

    #[test]
    fn a_made_up_counter_raises_the_own_in_steps_and_its_round_is_refused() {
        let mut a = Rounds::new(member(1), 5);
        let far = bid(&round(u32::MAX, &[1, 2]), 0);
        for _ in 0..50 {
            assert!(matches!(a.hear(member(2), &far), HeardBid::Refused(_)));
            assert!(!a.hear_counter(u32::MAX));
        }
        assert_eq!(a.counter(), 5 + COUNTER_STEP);
        a.new_period(9000);
        a.start(vec![member(1), member(2)], 1, 7, true, 5000);
        let mine = a.open().unwrap().round.clone();
        a.bid(bid(&mine, 1));
        assert_eq!(a.hear(member(2), &bid(&mine, 2)), HeardBid::Added);
        a.close();
        let mut slow = round(mine.counter + 1, &[1, 2]);
        slow.wait_ms = 9001;
        assert_eq!(a.hear(member(2), &bid(&slow, 2)), HeardBid::BidWanted);
        assert_eq!(a.open().unwrap().round.wait_ms, 9000);
        // Nor does a later bid of it make anybody wait.
        let mut slower = bid(&slow, 3);
        slower.round.wait_ms = u32::MAX;
        let mut three = Rounds::new(member(1), mine.counter);
        three.new_period(9000);
        slow.members.push(member(3));
        slower.round.members.push(member(3));
        assert_eq!(three.hear(member(2), &bid(&slow, 2)), HeardBid::BidWanted);
        assert_eq!(three.hear(member(3), &slower), HeardBid::Added);
        assert_eq!(three.open().unwrap().round.wait_ms, 9000);
    }

    /// A round that is complete in the eyes of its first member.
    fn complete(round: &Round, anchor: u16) -> Epoch {
        let mut rounds = Rounds::new(round.members[0], 0);
        for member in &round.members[1..] {
            rounds.hear(*member, &bid(round, anchor));
        }
        assert!(rounds.bid(bid(round, anchor)));
        rounds.complete().unwrap().0
    }

    #[test]
    fn of_two_rounds_with_one_counter_the_higher_one_has_the_higher_epoch() {
        let mut rounds: Vec<Round> = Vec::new();
        for loop_hash in 0..60 {
            for ids in [&[1, 2][..], &[1, 2, 3], &[1, 3]] {
                rounds.push(Round {
                    loop_hash,
                    ..round(5, ids)
                });
            }
        }
        rounds.sort_by_key(order_of);
        // Of the order's hash twelve bits are left in an epoch.
        let coarse = |r: &Round| {
            let (counter, members, hash) = order_of(r);
            (counter, members, hash >> 20)
        };
        let apart = rounds.windows(2).filter(|w| coarse(&w[0]) < coarse(&w[1]));
        let mut compared = 0;
        for pair in apart {
            assert!(complete(&pair[0], 0) < complete(&pair[1], 0), "{pair:?}");
            compared += 1;
        }
        assert!(compared > 150, "{compared}");
        assert!(complete(&round(6, &[1, 2]), 0) > complete(&round(5, &[1, 2, 3]), 0));
    }

    /// All members have to compute the same, and journals keep it: other numbers are another
    /// version of the format.
    #[test]
    fn the_epoch_of_a_round_is_a_hash_of_its_bids() {
        let r = round(5, &[1, 2]);
        let epochs = [0, 1, 2].map(|anchor| complete(&r, anchor).hash);
        assert_eq!(order_of(&r), (5, 2, 3_341_732_236));
        assert_eq!(epochs, [46_607_233, 46_607_986, 46_607_417]);
    }

    #[test]
    fn a_bid_of_somebody_who_is_no_member_or_of_this_peer_itself_counts_for_nothing() {
        let r = round(3, &[1, 2]);
        for author in [1, 3] {
            let mut rounds = Rounds::new(member(1), 0);
            assert_eq!(rounds.hear(member(author), &bid(&r, 0)), HeardBid::Nothing);
            assert!(rounds.open().is_none());
        }
        // A second bid of the same author changes nothing: the first is the one.
        let mut rounds = Rounds::new(member(1), 0);
        assert_eq!(rounds.hear(member(2), &bid(&r, 4)), HeardBid::BidWanted);
        assert_eq!(rounds.hear(member(2), &bid(&r, 9)), HeardBid::Nothing);
        assert_eq!(rounds.open().unwrap().bids[&2].anchor, 4);
        assert_eq!(rounds.missing(), [member(1)]);
        // What is closed does not open again.
        assert!(rounds.bid(bid(&r, 1)) && rounds.missing().is_empty());
        rounds.close();
        assert_eq!(rounds.hear(member(2), &bid(&r, 4)), HeardBid::Nothing);
        assert!(rounds.open().is_none());
    }
}
