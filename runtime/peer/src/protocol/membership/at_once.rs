//! What is asked for and answered at once, from peer to peer (decisions 72, 76, and 163
//! to 165).

use super::known::{HeardHeartbeat, Known};
use super::questions::urgency;
use super::{Membership, Patience};
use crate::input::Time;
use crate::protocol::airtime::ms_of;
use crate::wire::message::Fresh;
use core::cmp::Reverse;
use std::collections::BTreeSet;

/// Whoever knows a later heartbeat of somebody says so at once, once in so many intervals.
const ANSWER_INTERVALS: u64 = 2;

/// Who is sought is asked for again after so many of the longest intervals.
const SEEK_INTERVALS: u64 = 3;

/// With what is said at once so many others go at most: eight heartbeats of others are about as
/// long as the headers of a transmission and the heartbeat of its author.
const BESIDE_MAX: usize = 8;

/// How urgently somebody is asked for, whether it is sought, and what a neighbour gains that is
/// behind: of whom nothing is to be said beside.
const NO_RANK: (u8, bool, Option<(u64, u64)>) = (0, false, None);

impl Membership {
    /// Somebody asks for a heartbeat later than one that is known here, or says what this peer
    /// was to say.
    pub(super) fn hear_question(&mut self, now: Time, told: &HeardHeartbeat, limits: Patience) {
        // Who holds somebody for down whom this peer hears is far from that one.
        if !self.is_far(now) && told.age.ms(now) <= limits.bound_ms {
            return;
        }
        let verdict_ms = limits.verdict_ms(ms_of(told.interval, self.period_ms));
        let is_question = urgency(told, &limits, verdict_ms, now) > 0;
        let known = self.known.get(&told.id);
        let hops = || known.map_or(0, |k| k.distance(now, limits.interval_ms));
        self.questions.hear(told, is_question, hops);
        let again_ms = ANSWER_INTERVALS * self.own_interval_ms();
        if is_question
            && let Some(known) = self.known.get_mut(&told.id)
            && known.answers(now, told, again_ms)
        {
            self.questions.answer(told.id, told.count);
        }
    }

    /// Somebody came back who was held for down: all others who are may have come with it, and
    /// are asked for until the bound is over.
    pub(super) fn seek(&mut self, now: Time, bound_ms: u64) {
        for known in self.known.values_mut() {
            known.seek(now, now.plus_ms(bound_ms));
        }
    }

    /// Notes who is to be asked for now.
    pub(super) fn ask_at_once(&mut self, now: Time, patience: &Patience) {
        let is_far = self.is_far(now);
        let again_ms = SEEK_INTERVALS * patience.interval_ms;
        for known in self.known.values_mut() {
            let asks = is_far && known.asks_at_once(now, patience, self.period_ms);
            if asks || known.seeks_at_once(now, again_ms) {
                self.questions.ask(now, known, patience);
            }
        }
    }

    /// Whether something is to be said at once that was not when this was last asked.
    pub fn take_question(&mut self) -> bool {
        self.questions.take_new()
    }

    /// When something is to be said at once, the past if now, unless nothing is.
    #[must_use]
    pub fn question_at(&self) -> Option<Time> {
        self.questions.next()
    }

    /// What is to be said at once: heartbeats that are asked for, and those that answer. With them
    /// go answers that nobody was heard passing on, what is still asked for, and those of whom a
    /// neighbour knows less: where transmissions are lost, each that arrives brings all that is
    /// waited for.
    pub fn tell_at_once(&mut self, now: Time, max: usize) -> Vec<Fresh> {
        let (interval_ms, own_ms) = (self.interval_ms(), self.own_interval_ms());
        let mut said = BTreeSet::new();
        for (id, waiting) in self.questions.take(now, max) {
            let known = self.known.get_mut(&id);
            let Some(known) = known.filter(|k| waiting.holds(now, k)) else {
                continue;
            };
            if waiting.answers {
                known.answered_at = now;
                let (count, again_at) = (known.freshest.count, now.plus_ms(own_ms));
                self.questions.said(id, waiting, count, again_at);
            }
            said.insert(id);
        }
        if !said.is_empty() {
            self.say_beside(now, &mut said, max);
        }
        let say = |id| {
            let known = self.known.get_mut(&id)?;
            known.tell(now);
            if known.freshest.suspected.is_some() {
                known.tell_news(now, own_ms);
            }
            Some(known.fresh(now, interval_ms))
        };
        said.into_iter().filter_map(say).collect()
    }

    /// Adds to those of whom something is said at once some who go with them.
    fn say_beside(&mut self, now: Time, said: &mut BTreeSet<u16>, max: usize) {
        let most = max.min(said.len() + BESIDE_MAX);
        let patience = self.patience(now);
        let again = self.questions.answered();
        let again = again.filter(|(id, w)| self.known.get(id).is_some_and(|k| w.holds(now, k)));
        let again = again.map(|(id, _)| id);
        let rank = |k: &Known| {
            let is_asked = k.asked > 0;
            let urgency = is_asked.then(|| k.urgency(now, &patience, self.period_ms));
            let is_behind = k.is_believed() && k.is_wanted(now);
            let want = is_behind.then(|| k.want(now));
            (urgency.unwrap_or(0), k.is_sought(now), want)
        };
        let others = self.known.iter().map(|(id, k)| (rank(k), *id));
        let mut others: Vec<_> = others.filter(|(rank, _)| *rank > NO_RANK).collect();
        others.sort_by_key(|(rank, id)| (Reverse(*rank), *id));
        for id in again.chain(others.into_iter().map(|(_, id)| id)) {
            if said.len() < most {
                said.insert(id);
            }
        }
    }
}
