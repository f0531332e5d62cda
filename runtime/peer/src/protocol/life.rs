//! A life begins: incarnation, probation, and what a peer does when it hears of
//! another life of its own.
//!
//! | state | event | next state | output |
//! |---|---|---|---|
//! | born | start | promised | the journal's incarnation plus one is stored |
//! | promised | stored | listening | the life begins; probation of 3 T runs from the start |
//! | promised | the store failed | as before the promise | stored again: if there is no life yet after one tick, two, four, up to 64, else when it hears of itself again |
//! | listening | its own id at this or a higher life | promised | that plus one is stored |
//! | listening | 3 T are over | speaking | beacons |
//! | speaking | its own id at a higher life, or a heartbeat or a record of this life that it never sent | promised | that plus one |
//! | speaking | another boot nonce under its id in this life or a later one, above its own | silenced | an alarm |
//! | speaking | the same, below its own | as for its own id in that life | an alarm |
//!
//! Without the last but one row a peer that lost its disk would be a zombie nobody
//! believes. A silenced peer flies its plan to the end.

use crate::Incarnation;
use crate::effect::{Effect, Effects, Promise};
use crate::input::Time;
use crate::journal::Entry;
use crate::output::Report;
use crate::timers::{Timer, Timers};

/// A new life only listens for this many beacon periods: long enough to hear a
/// neighbour's gossip about an earlier life at 30 % loss with 97 % certainty, and
/// what it missed is caught by the rule that works at any time.
pub const PROBATION_PERIODS: u64 = 3;

/// A life heard of that is further ahead than this is no life of a peer: at one restart an
/// hour it takes a year to get there.
pub const LIFE_STEP: Incarnation = 10_000;

/// After a life could not be stored for the n-th time it is tried again 2^(n-1) ticks later,
/// but no later than so many: each time is an alarm.
const RETRY_MAX_TICKS: u32 = 64;

/// Where a life stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Life {
    incarnation: Incarnation,
    /// The life that is being made durable.
    promised: Option<Incarnation>,
    nonce: u32,
    silenced: bool,
    double_told: bool,
    /// Whether a life heard of was promised since the last tick.
    raised: bool,
    /// Ticks until a first life that could not be stored is tried again, and how many there
    /// were the last time.
    retry: (u32, u32),
}

impl Life {
    /// The life that is durable; 0 before the first.
    pub fn incarnation(&self) -> Incarnation {
        self.incarnation
    }

    /// Tells two peers under one id apart.
    pub fn nonce(&self) -> u32 {
        self.nonce
    }

    /// Whether a life has begun and its probation is over.
    pub fn has_voice(&self, now: Time, timers: &Timers) -> bool {
        self.incarnation > 0 && self.promised.is_none() && timers.is_due(Timer::Probation, now)
    }

    /// Whether the peer may speak: it has a voice, and no double took it.
    pub fn speaks(&self, now: Time, timers: &Timers) -> bool {
        self.has_voice(now, timers) && !self.silenced
    }

    /// The first input: `durable` is the life that the journal ended with.
    pub fn start(
        &mut self,
        now: Time,
        period_ms: u64,
        timers: &mut Timers,
        nonce: u32,
        durable: Incarnation,
    ) -> Effects {
        assert_eq!(self.promised, None, "a peer starts once");
        self.nonce = nonce;
        timers.set(Timer::Probation, now.plus_ms(PROBATION_PERIODS * period_ms));
        self.promise(durable.saturating_add(1))
    }

    fn promise(&mut self, incarnation: Incarnation) -> Effects {
        if self.promised.is_some_and(|p| p >= incarnation) {
            return Effects::new();
        }
        assert!(incarnation >= self.incarnation, "lives only grow");
        self.promised = Some(incarnation);
        let entry = Entry::Life(incarnation);
        vec![Effect::Store(Promise::Life(incarnation), entry)]
    }

    /// A promised life is durable and may be spoken of.
    pub fn is_durable(&mut self, incarnation: Incarnation) -> Effects {
        if self.promised != Some(incarnation) {
            return Effects::new();
        }
        self.promised = None;
        self.incarnation = incarnation;
        vec![
            Effect::Live(incarnation),
            Effect::Report(Report::Booted { incarnation }),
        ]
    }

    /// A promised life could not be made durable.
    pub fn is_broken(&mut self, incarnation: Incarnation) {
        self.promised = self.promised.filter(|p| *p != incarnation);
        let ticks = (2 * self.retry.1).clamp(1, RETRY_MAX_TICKS);
        self.retry = (ticks, ticks);
    }

    /// Somebody speaks of this peer's own id in the given life, perhaps with a heartbeat or
    /// a record that this peer never said in it. A life far ahead of its own
    /// is not believed, and one is taken between two ticks: lives that were made up cannot
    /// use all of them up.
    pub fn hear_of_myself(&mut self, incarnation: Incarnation, never_said: bool) -> Effects {
        let mine = self.promised.unwrap_or(0).max(self.incarnation);
        let used_twice = incarnation == self.incarnation && never_said;
        if self.silenced {
            return Effects::new();
        }
        if incarnation > mine
            || (incarnation == mine && used_twice)
            || (self.incarnation == 0 && incarnation >= mine)
        {
            if incarnation - mine.min(incarnation) > LIFE_STEP || self.raised {
                return Effects::new();
            }
            self.raised = true;
            self.promise(incarnation.saturating_add(1))
        } else {
            Effects::new()
        }
    }

    /// Another process beacons under this id, in this life or a later one, with another boot
    /// nonce: the one with the lower nonce is silent from now on, and the other takes a life
    /// above both. If each took one above the other's they would do so for ever.
    pub fn hear_double(&mut self, nonce: u32, incarnation: Incarnation) -> Effects {
        assert_ne!(nonce, self.nonce, "an echo is no double");
        self.silenced |= nonce > self.nonce;
        let mut effects = self.hear_of_myself(incarnation, false);
        if !core::mem::replace(&mut self.double_told, true) {
            let text = "another peer speaks under this id";
            effects.push(Effect::Alarm(text.into()));
        }
        effects
    }

    /// A first life that could not be stored is tried again.
    pub fn tick(&mut self, durable: Incarnation) -> Effects {
        self.raised = false;
        if self.incarnation == 0 && self.promised.is_none() {
            self.retry.0 = self.retry.0.saturating_sub(1);
            if self.retry.0 > 0 {
                return Effects::new();
            }
            self.promise(durable.saturating_add(1))
        } else {
            Effects::new()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stored(effects: &Effects) -> Vec<Incarnation> {
        let life = |e: &Effect| match e {
            Effect::Store(Promise::Life(i), _) => Some(*i),
            _ => None,
        };
        effects.iter().filter_map(life).collect()
    }

    /// A life that was started and is durable.
    fn living(incarnation: Incarnation) -> Life {
        let mut life = Life::default();
        let effects = life.start(Time(0), 1000, &mut Timers::default(), 7, incarnation - 1);
        assert_eq!(stored(&effects), [incarnation]);
        assert_eq!(life.is_durable(incarnation).len(), 2);
        life
    }

    #[test]
    fn a_life_speaks_once_it_is_durable_and_has_listened() {
        let (mut life, mut timers) = (Life::default(), Timers::default());
        life.start(Time(500), 1000, &mut timers, 7, 4);
        assert!(!life.speaks(Time(9000), &timers), "not durable yet");
        assert!(life.is_durable(4).is_empty(), "another life was promised");
        life.is_durable(5);
        assert!(!life.speaks(Time(3499), &timers));
        assert!(life.speaks(Time(3500), &timers));
    }

    #[test]
    fn a_peer_heard_of_in_a_later_life_takes_the_one_after() {
        let mut life = living(2);
        assert!(life.hear_of_myself(2, false).is_empty(), "an echo");
        assert!(life.hear_of_myself(1, true).is_empty(), "an earlier life");
        assert_eq!(
            stored(&life.hear_of_myself(2, true)),
            [3],
            "a heartbeat or a record never sent"
        );
        assert!(life.hear_of_myself(6, false).is_empty(), "one a tick");
        life.tick(2);
        assert_eq!(stored(&life.hear_of_myself(6, false)), [7]);
        assert!(life.hear_of_myself(5, false).is_empty(), "7 is promised");
        assert!(
            life.is_durable(3).is_empty(),
            "an earlier promise is overtaken"
        );
        assert_eq!(life.is_durable(7).len(), 2);
        assert_eq!(life.incarnation(), 7);
        life.tick(7);
        assert!(life.hear_of_myself(u32::MAX, false).is_empty(), "made up");
    }

    #[test]
    fn of_two_under_one_id_the_lower_nonce_is_silent() {
        let timers = Timers::default();
        let mut life = living(2);
        let mut probation_over = timers.clone();
        probation_over.set(Timer::Probation, Time(0));
        life.hear_double(6, 2);
        assert!(life.speaks(Time(1), &probation_over));
        life.hear_double(8, 2);
        assert!(!life.speaks(Time(1), &probation_over));
        assert!(
            life.has_voice(Time(1), &probation_over),
            "it goes on planning"
        );
    }

    #[test]
    fn of_two_in_different_lives_only_one_takes_another_life() {
        let (mut low, mut high) = (living(1), living(2));
        low.nonce = 3;
        assert!(stored(&low.hear_double(7, 2)).is_empty() && low.silenced);
        low.tick(1);
        assert!(
            stored(&low.hear_of_myself(5, true)).is_empty(),
            "others speak of the one that is heard"
        );
        let effects = high.hear_double(3, 4);
        assert_eq!((stored(&effects), effects.len()), (vec![5], 2));
        high.is_durable(5);
        high.tick(5);
        assert!(high.hear_double(3, 4).is_empty(), "told once");
    }

    #[test]
    fn a_first_life_that_was_not_stored_is_promised_again() {
        let mut life = Life::default();
        life.start(Time(0), 1000, &mut Timers::default(), 7, 4);
        assert!(life.tick(4).is_empty());
        life.is_broken(5);
        assert_eq!(stored(&life.tick(4)), [5]);
    }

    #[test]
    fn a_life_far_above_its_own_is_not_believed_of_itself() {
        for (heard, taken) in [
            (5 + LIFE_STEP, vec![6 + LIFE_STEP]),
            (6 + LIFE_STEP, vec![]),
            (u32::MAX, vec![]),
        ] {
            let mut life = living(5);
            assert_eq!(stored(&life.hear_of_myself(heard, false)), taken);
        }
    }
}
