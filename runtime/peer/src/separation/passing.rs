//! Statements of approach conflicts that a third UAV passes on: two that sense each other and
//! have a house between their radios settle what they fly all the same.
//!
//! | what was heard at first hand | what follows |
//! |---|---|
//! | an offer, still open after a while, that somebody else who is heard has not accepted | passed on once; again when its author says it again |
//! | an answer to an open offer that was passed on, or that stays open for a while | passed on once, with what its author flies |
//! | the same passed on by another | nothing: once is enough |
//!
//! # Guarantees
//! At most one hop more. What is settled among those in reach of each other is passed on by nobody.

use crate::PeerId;
use crate::wire::message::Record;
use std::collections::BTreeMap;

/// Whoever hears an offer itself has answered it within this time, milliseconds.
const ANSWERED_MS: u64 = 300;

/// Third ones pass it on one after the other, so far apart, milliseconds: the next hears the one
/// before it.
const STAGGER_MS: u64 = 200;

/// Of so many one is always first.
const TURNS: u64 = 3;

/// Who was not heard for so long is not there to be told, milliseconds.
const LATELY_MS: u64 = 6_000;

/// A statement that may be passed on.
#[derive(Clone, Debug)]
struct Kept {
    record: Record,
    heard_ms: u64,
    is_passed: bool,
}

/// What one other UAV said at first hand.
#[derive(Clone, Debug, Default)]
struct Other {
    heard_ms: u64,
    /// What it flies and offers, whole.
    whole: Option<Kept>,
    /// The version of the offer that is open, of which the whole statement has the motions, and
    /// whether that was passed on for it.
    offer: Option<(u32, bool)>,
    /// Its last statement that accepts anything.
    answer: Option<Kept>,
    accepts: Vec<(PeerId, u32)>,
}

/// What a statement says, as far as passing it on goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gist<'a> {
    /// Whether it has the motions.
    pub is_whole: bool,
    /// The version on offer.
    pub offers: Option<u32>,
    /// What it accepts of whom.
    pub accepts: &'a [(PeerId, u32)],
}

/// What was heard and may have to be passed on.
#[derive(Clone, Debug, Default)]
pub(super) struct Passing {
    others: BTreeMap<u16, Other>,
}

impl Kept {
    fn fresh(record: &Record, heard_ms: u64) -> Self {
        Self {
            record: record.clone(),
            heard_ms,
            is_passed: false,
        }
    }
}

impl Passing {
    /// A statement was heard that made so many hops.
    pub fn hear(&mut self, now_ms: u64, record: &Record, gist: Gist<'_>, hops: u8) {
        let other = self.others.entry(record.author).or_default();
        if hops > 0 {
            for kept in [&mut other.whole, &mut other.answer].into_iter().flatten() {
                kept.is_passed |= kept.record.seq == record.seq;
            }
            if let Some((version, is_passed)) = &mut other.offer {
                *is_passed |= gist.is_whole && gist.offers == Some(*version);
            }
            return;
        }
        other.heard_ms = now_ms;
        let fresh = || Kept::fresh(record, now_ms);
        if gist.is_whole {
            other.whole = Some(fresh());
        }
        other.offer = match gist.offers {
            Some(version) if gist.is_whole => Some((version, false)),
            offers => other.offer.filter(|(known, _)| Some(*known) == offers),
        };
        other.answer = (!gist.accepts.is_empty()).then(fresh);
        other.accepts = gist.accepts.to_vec();
    }

    /// Forgets what one said: it begins anew.
    pub fn forget(&mut self, id: u16) {
        self.others.remove(&id);
    }

    /// What this UAV, with the rank `turn` among all, passes on now.
    pub fn due(&mut self, now_ms: u64, turn: u64) -> Vec<Record> {
        let wait_ms = ANSWERED_MS + STAGGER_MS * (turn % TURNS);
        let is_late = |kept: &Kept| now_ms.saturating_sub(kept.heard_ms) >= wait_ms;
        // Offers that somebody in reach has not accepted.
        let open: BTreeMap<u16, (u32, bool)> = self
            .others
            .iter()
            .filter_map(|(id, o)| {
                let (version, is_passed) = o.offer?;
                let is_due = is_passed || o.whole.as_ref().is_some_and(is_late);
                Some((*id, (version, is_due)))
            })
            .collect();
        let lacks = |id: u16, version: u32| {
            self.others.iter().any(|(b, o)| {
                let is_there = now_ms.saturating_sub(o.heard_ms) <= LATELY_MS;
                *b != id && is_there && !o.accepts.contains(&(PeerId(id), version))
            })
        };
        let unanswered: Vec<u16> = open
            .iter()
            .filter(|(id, (version, is_due))| *is_due && lacks(**id, *version))
            .map(|(id, _)| *id)
            .collect();
        let mut passed = Vec::new();
        for id in unanswered {
            if let Some(other) = self.others.get_mut(&id)
                && let (Some((_, is_passed)), Some(whole)) = (&mut other.offer, &other.whole)
                && !core::mem::replace(is_passed, true)
            {
                passed.push(whole.record.clone());
            }
        }
        for other in self.others.values_mut() {
            let answers = |(to, version): &(PeerId, u32)| {
                open.get(&to.0)
                    .is_some_and(|(v, is_due)| v == version && *is_due)
            };
            if !other.accepts.iter().any(answers) {
                continue;
            }
            // Who never heard its author knows nothing that the answer speaks of.
            let both = [&mut other.whole, &mut other.answer].into_iter().flatten();
            for kept in both.filter(|kept| !kept.is_passed) {
                if !passed
                    .iter()
                    .any(|p: &Record| (p.author, p.seq) == (kept.record.author, kept.record.seq))
                {
                    passed.push(kept.record.clone());
                }
                kept.is_passed = true;
            }
        }
        passed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(author: u16, seq: u32) -> Record {
        Record {
            author,
            incarnation: 1,
            seq,
            kind: 10,
            subject: 0,
            body: Vec::new(),
            signature: Vec::new(),
        }
    }

    /// Says that one offers a version and accepts another one's, whole or in brief.
    fn gist(is_whole: bool, offers: Option<u32>, accepts: &[(PeerId, u32)]) -> Gist<'_> {
        Gist {
            is_whole,
            offers,
            accepts,
        }
    }

    fn told(passing: &mut Passing, now_ms: u64) -> Vec<(u16, u32)> {
        let due = passing.due(now_ms, 0);
        due.iter().map(|r| (r.author, r.seq)).collect()
    }

    /// Peer 2 offers its version 7; peer 3 is there.
    fn offered() -> Passing {
        let mut passing = Passing::default();
        passing.hear(0, &record(3, 1), gist(true, None, &[]), 0);
        passing.hear(0, &record(2, 1), gist(true, Some(7), &[]), 0);
        passing
    }

    #[test]
    fn an_offer_that_stays_open_goes_on_once_and_so_does_its_answer() {
        let mut passing = offered();
        assert_eq!(told(&mut passing, 200), [], "it may be answered yet");
        assert_eq!(told(&mut passing, 400), [(2, 1)]);
        assert_eq!(told(&mut passing, 600), []);
        // The other answers: with what it flies, since who asks may never have heard it.
        let accepts = [(PeerId(2), 7)];
        passing.hear(700, &record(3, 2), gist(false, None, &accepts), 0);
        assert_eq!(told(&mut passing, 800), [(3, 1), (3, 2)]);
        assert_eq!(told(&mut passing, 1_000), []);
        // Who asks again has not heard the answer.
        passing.hear(1_100, &record(2, 2), gist(true, Some(7), &[]), 0);
        passing.hear(1_200, &record(3, 3), gist(false, None, &accepts), 0);
        assert_eq!(told(&mut passing, 1_300), []);
        assert_eq!(told(&mut passing, 1_500), [(3, 3)]);
    }

    #[test]
    fn what_is_settled_or_passed_on_by_another_goes_no_further() {
        // It flies what it offered.
        let mut passing = offered();
        passing.hear(200, &record(2, 2), gist(false, None, &[]), 0);
        assert_eq!(told(&mut passing, 900), []);
        // All that are there have accepted.
        let mut passing = offered();
        let accepts = [(PeerId(2), 7)];
        passing.hear(100, &record(3, 2), gist(false, None, &accepts), 0);
        let all = told(&mut passing, 900);
        assert!(!all.contains(&(2, 1)), "{all:?}");
        assert!(
            all.contains(&(3, 2)),
            "the answer may have been lost: {all:?}"
        );
        // Another one was faster.
        let mut passing = offered();
        passing.hear(300, &record(2, 1), gist(true, Some(7), &[]), 1);
        assert_eq!(told(&mut passing, 900), []);
        // Nobody else was heard lately.
        let mut passing = offered();
        passing.hear(20_000, &record(2, 2), gist(true, Some(8), &[]), 0);
        assert_eq!(told(&mut passing, 20_900), []);
    }

    #[test]
    fn third_ones_take_turns_and_what_begins_anew_is_forgotten() {
        for (turn, at_ms) in [(0, 300), (1, 500), (2, 700), (3, 300)] {
            let mut passing = offered();
            assert!(passing.due(at_ms - 100, turn).is_empty(), "{turn}");
            assert_eq!(passing.due(at_ms, turn).len(), 1, "{turn}");
        }
        let mut passing = offered();
        passing.forget(2);
        assert_eq!(told(&mut passing, 900), []);
    }
}
