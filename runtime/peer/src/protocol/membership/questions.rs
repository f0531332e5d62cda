//! Who is asked for and who is answered for at once, from peer to peer, where gossip would
//! take an interval a hop.

use super::extent::Patience;
use super::known::{HeardHeartbeat, Known};
use crate::input::Time;
use crate::output::Status;
use std::collections::BTreeMap;

/// A later heartbeat of who is suspected is asked for after each sixth of the time to refute that,
/// from the second on: most suspicions are refuted by gossip within the first two, and over a thin
/// bridge single questions are lost.
const ASKS: u64 = 6;
const ASKS_PATIENT: u64 = 1;

/// Of who is not suspected one is asked for after each tenth of the bound from the sixth on: few
/// heartbeats of the living are as old, and four tenths are time enough for an answer.
const AGES: u64 = 10;
const AGES_PATIENT: u64 = 5;

/// Who hears of somebody from a neighbour that hears that one asks first.
const NEAR_HOPS: u8 = 2;

/// With each hop more one asks this part of the longest interval later, of so many hops at most.
const TURNS: u64 = 4;
const FARTHER_MAX: u8 = 3;

/// What was heard from so many neighbours meanwhile is not said again: one copy is not enough
/// where three in ten are lost.
const COPIES_HEARD: u8 = 2;

/// An answer that nobody is heard passing on is said again so often: questions come from many at
/// once, and where they meet an answer is often lost.
const REPEATS: u8 = 2;

/// A heartbeat of others, which this peer is to say at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Waiting {
    /// The count that is asked for, or that a later one answers.
    pub(super) count: u32,
    /// Whether a later one is known here.
    pub(super) answers: bool,
    /// When it is said.
    at: Time,
    copies: u8,
    /// Which later count this peer answered, how often it may say so again, and when.
    again: Option<Again>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Again {
    count: u32,
    repeats: u8,
    at: Time,
}

impl Waiting {
    /// Whether it is still to be said of who is known so.
    pub(super) fn holds(&self, now: Time, known: &Known) -> bool {
        let count = known.freshest.count;
        if self.answers {
            count > self.count && known.status == Status::Alive
        } else {
            count == self.count && (known.status != Status::Down || known.is_sought(now))
        }
    }

    /// When it is said, or said again.
    fn due(&self) -> Time {
        self.again.map_or(self.at, |again| again.at)
    }
}

/// How urgent it is to hear of a peer: 0 while gossip has time.
pub(super) fn urgency(
    heard: &HeardHeartbeat,
    patience: &Patience,
    verdict_ms: u64,
    now: Time,
) -> u8 {
    let suspected_ms = heard.suspected.map_or(0, |age| age.ms(now));
    let by_suspicion = (ASKS * suspected_ms / verdict_ms.max(1)).saturating_sub(ASKS_PATIENT);
    let by_age = (AGES * heard.age.ms(now) / patience.bound_ms.max(1)).saturating_sub(AGES_PATIENT);
    u8::try_from(by_suspicion.max(by_age)).unwrap_or(u8::MAX)
}

/// What this peer is to say at once.
#[derive(Clone, Debug, Default)]
pub(super) struct Questions {
    waiting: BTreeMap<u16, Waiting>,
    /// Somebody waits who did not when this was last asked.
    is_new: bool,
}

impl Questions {
    /// Nobody knows a later heartbeat than this one here; whoever does is to say it. Whoever is
    /// nearer to the one asked for asks first: its question goes on from there, and its answer
    /// reaches the others.
    pub(super) fn ask(&mut self, now: Time, known: &Known, patience: &Patience) {
        let hops = known.distance(now, patience.interval_ms);
        let farther = hops.saturating_sub(NEAR_HOPS).min(FARTHER_MAX);
        let at = now.plus_ms(u64::from(farther) * patience.interval_ms / TURNS);
        self.insert(known.freshest.id, known.freshest.count, false, at);
    }

    /// Somebody knows none later than this count, and this peer does.
    pub(super) fn answer(&mut self, id: u16, count: u32) {
        self.insert(id, count, true, Time(0));
    }

    fn insert(&mut self, id: u16, count: u32, answers: bool, at: Time) {
        let waiting = Waiting {
            count,
            answers,
            at,
            copies: 0,
            again: None,
        };
        let before = self.waiting.get(&id);
        if before.is_none_or(|w| w.answers != answers) {
            self.waiting.insert(id, waiting);
            self.is_new = true;
        }
    }

    /// A neighbour tells of somebody who is so many hops from here: whether that is what this peer
    /// was to say. Not if who hears that one is on the other side: a question goes towards the
    /// one asked for, and counts as said by who is as near, or once by who is nearer; an answer
    /// goes away from there, and counts as said by who is as far.
    pub(super) fn hear(
        &mut self,
        told: &HeardHeartbeat,
        is_question: bool,
        hops: impl FnOnce() -> u8,
    ) {
        let Some(waiting) = self.waiting.get_mut(&told.id) else {
            return;
        };
        let (teller_hops, hops) = (told.hops.saturating_sub(1), hops());
        let is_elsewhere = if waiting.answers {
            teller_hops < hops
        } else {
            teller_hops > hops
        };
        if is_elsewhere {
            return;
        }
        if let Some(again) = waiting.again {
            // What others tell of it anyway is no sign that the answer was heard.
            if told.count == again.count && told.suspected.is_none() {
                self.waiting.remove(&told.id);
            }
            return;
        }
        let same = if waiting.answers {
            told.count > waiting.count && told.suspected.is_none()
        } else {
            is_question && told.count == waiting.count
        };
        if same {
            waiting.copies += 1;
            // Whoever is nearer hears the answer first, and says it.
            if !waiting.answers && teller_hops < hops {
                waiting.copies = COPIES_HEARD;
            }
            if waiting.copies >= COPIES_HEARD {
                self.waiting.remove(&told.id);
            }
        }
    }

    pub(super) fn take_new(&mut self) -> bool {
        std::mem::take(&mut self.is_new)
    }

    /// At most so many of those that are due.
    pub(super) fn take(&mut self, now: Time, max: usize) -> BTreeMap<u16, Waiting> {
        let due = self.waiting.iter().filter(|(_, w)| w.due() <= now);
        let due: Vec<u16> = due.map(|(id, _)| *id).take(max).collect();
        let taken = due.into_iter();
        let taken = taken.filter_map(|id| Some((id, self.waiting.remove(&id)?)));
        taken.collect()
    }

    /// The answers that were said, and that nobody was heard passing on yet.
    pub(super) fn answered(&self) -> impl Iterator<Item = (u16, Waiting)> + '_ {
        let answered = self.waiting.iter().filter(|(_, w)| w.again.is_some());
        answered.map(|(id, waiting)| (*id, *waiting))
    }

    /// An answer was said, with this count. If nobody else is heard saying so it is said again
    /// then.
    pub(super) fn said(&mut self, id: u16, waiting: Waiting, count: u32, again_at: Time) {
        let left = waiting.again.map_or(REPEATS, |again| again.repeats);
        if waiting.copies > 0 || left == 0 {
            return;
        }
        let again = Some(Again {
            count,
            repeats: left - 1,
            at: again_at,
        });
        self.waiting.insert(id, Waiting { again, ..waiting });
    }

    /// When the next of those that wait is due; at once is the beginning of time.
    pub(super) fn next(&self) -> Option<Time> {
        self.waiting.values().map(Waiting::due).min()
    }
}
