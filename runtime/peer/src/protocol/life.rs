//! A life begins: incarnation, probation, and what a peer does when it hears of
//! another life of its own, or of a twin: another process under its id.
//!
//! | state | event | next state | output |
//! |---|---|---|---|
//! | born | start | promised | the journal's incarnation plus one is stored |
//! | promised | stored | listening | the life begins; probation of 3 T runs from the start |
//! | promised | the store failed | as before the promise | stored again: if there is no life yet, or none of its own, after one tick, two, four, up to 64, else when it hears of itself again |
//! | listening | its own id at this or a higher life | promised | that plus one is stored |
//! | listening | 3 T are over | speaking | beacons |
//! | listening | a twin lives | silent | an alarm |
//! | speaking | a twin lives in a later life; or in this one with more heartbeats, or as many and a higher boot nonce | silent | an alarm; the plan is dropped |
//! | speaking | a twin lives in this life, with fewer | promised | that plus one is stored |
//! | speaking | its own id at a higher life, or a heartbeat or a record of this life that it never sent | promised | that plus one |
//! | silent | a twin was not alive for as long as it takes all to hold it for down | promised | one above all lives heard of is stored; 3 T of listening |
//!
//! Without the last but one row a peer that lost its disk would be a zombie nobody
//! believes. A twin *lives* if its beacon or heartbeat is heard, or if gossip tells of a
//! heartbeat that this process cannot have sent: its age is less than half of the time for
//! which this process has been there, or, where it does not speak, has been quiet;
//! and who was silent for k1 T' may be out of reach.
//! Half, since ages are summed by clocks of others.

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

/// Another process under this peer's id, as its own beacon or heartbeat shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Twin {
    /// Its life.
    pub incarnation: Incarnation,
    /// Its count of heartbeats.
    pub heartbeat: u32,
    /// Its boot nonce, which only beacons tell.
    pub nonce: Option<u32>,
}

/// Why a peer is silent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Silence {
    /// When the twin last was alive.
    alive: Time,
    /// Whether it was last heard from where this peer is itself.
    here: bool,
}

/// Where a life stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Life {
    incarnation: Incarnation,
    /// The life that is being made durable.
    promised: Option<Incarnation>,
    nonce: u32,
    silent: Option<Silence>,
    /// Why it was silent before the life that is being made durable.
    was_silent: Option<Silence>,
    /// Since when this process runs.
    started: Time,
    /// Since when it has said nothing, where it does not speak.
    quiet: Time,
    /// The highest life under this id that was heard of.
    heard: Incarnation,
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

    /// Tells twins in one life apart.
    pub fn nonce(&self) -> u32 {
        self.nonce
    }

    /// Whether the peer may speak: a life has begun, its probation is over, and no twin
    /// took its voice.
    pub fn speaks(&self, now: Time, timers: &Timers) -> bool {
        self.promised.is_none() && self.silent.is_none() && !self.listens(now, timers)
    }

    /// Whether it has not spoken yet, or not since it was silent.
    fn listens(&self, now: Time, timers: &Timers) -> bool {
        self.incarnation == 0 || !timers.is_due(Timer::Probation, now)
    }

    /// Whether it is silent because of a twin.
    pub fn is_silent(&self) -> bool {
        self.silent.is_some()
    }

    /// Whether the twin speaks from where this peer is itself: it may sit in the same
    /// airframe, which cannot be flown by two.
    pub fn shares_airframe(&self) -> bool {
        self.silent.is_some_and(|s| s.here)
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
        (self.started, self.quiet) = (now, now);
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
    pub fn on_durable(&mut self, incarnation: Incarnation) -> Effects {
        if self.promised != Some(incarnation) {
            return Effects::new();
        }
        self.promised = None;
        self.was_silent = None;
        self.retry = (0, 0);
        self.incarnation = incarnation;
        let mut effects = vec![Effect::Live(incarnation)];
        // Who fell silent meanwhile speaks in a later one.
        if self.silent.is_none() {
            effects.push(Effect::Report(Report::Booted { incarnation }));
        }
        effects
    }

    /// A promised life could not be made durable.
    pub fn on_broken(&mut self, incarnation: Incarnation) {
        self.promised = self.promised.filter(|p| *p != incarnation);
        let ticks = (2 * self.retry.1).clamp(1, RETRY_MAX_TICKS);
        self.retry = (ticks, ticks);
        // The life that it has is shared with another process: it does not speak in that.
        self.silent = self.silent.or(self.was_silent.take());
    }

    /// Whether a life that could not be stored is to be tried again by now.
    fn tries_again(&mut self) -> bool {
        self.retry.0 = self.retry.0.saturating_sub(1);
        self.retry.0 == 0
    }

    /// Whether a life is so far above its own that it is not believed.
    fn is_made_up(&self, incarnation: Incarnation) -> bool {
        let mine = self.promised.unwrap_or(0).max(self.incarnation);
        incarnation.saturating_sub(mine) > LIFE_STEP
    }

    /// Somebody speaks of this peer's own id in the given life, perhaps with a heartbeat or
    /// a record that this peer never said in it. A life far ahead of its own
    /// is not believed, and one is taken between two ticks: lives that were made up cannot
    /// use all of them up.
    pub fn hear_of_myself(&mut self, incarnation: Incarnation, never_said: bool) -> Effects {
        if self.is_made_up(incarnation) {
            return Effects::new();
        }
        self.heard = self.heard.max(incarnation);
        let mine = self.promised.unwrap_or(0).max(self.incarnation);
        let used_twice = incarnation == self.incarnation && never_said;
        let another = incarnation > mine
            || (incarnation == mine && used_twice)
            || (self.incarnation == 0 && incarnation >= mine);
        if !another || self.raised || self.silent.is_some() {
            return Effects::new();
        }
        self.raised = true;
        self.promise(incarnation.saturating_add(1))
    }

    /// Another process speaks under this id, perhaps from where this peer is (`here`), which
    /// has sent so many heartbeats itself. Of two that speak the one with the later life
    /// goes on, since others believe it; in one life the one with more heartbeats, which
    /// is the elder, and takes a life above: its records cannot be told from those of the other.
    pub fn hear_twin(
        &mut self,
        (now, timers): (Time, &Timers),
        twin: Twin,
        heartbeat: u32,
        here: bool,
    ) -> Effects {
        if self.is_made_up(twin.incarnation) {
            return Effects::new();
        }
        self.heard = self.heard.max(twin.incarnation);
        let theirs = (twin.incarnation, twin.heartbeat);
        let mine = (self.incarnation, heartbeat);
        // A heartbeat of this life that this peer may have sent itself tells nothing.
        if twin.nonce.is_none() && twin.incarnation == self.incarnation && theirs <= mine {
            return Effects::new();
        }
        let outranked = (theirs, twin.nonce) > (mine, Some(self.nonce));
        if outranked || self.silent.is_some() || self.listens(now, timers) {
            return self.fall_silent((now, timers), Silence { alive: now, here });
        }
        self.hear_of_myself(twin.incarnation, true)
    }

    /// Others tell of a heartbeat under this id that is so old; what is older than `lately_ms`
    /// may be out of reach. This peer sent so many
    /// itself, and perhaps never sent that one or a record that was told of with it.
    pub fn hear_of_heartbeat(
        &mut self,
        (now, timers): (Time, &Timers),
        (incarnation, heartbeat): (Incarnation, u32),
        (age_ms, lately_ms): (u64, u64),
        (sent, never_said): (u32, bool),
    ) -> Effects {
        let quiet = self.silent.is_some() || self.listens(now, timers);
        let since = if quiet { self.quiet } else { self.started };
        let is_young = age_ms <= lately_ms && age_ms.saturating_mul(2) < now.since_ms(since);
        let theirs = (incarnation, heartbeat) > (self.incarnation, sent);
        if is_young && (quiet || theirs) && !self.is_made_up(incarnation) {
            self.heard = self.heard.max(incarnation);
            let alive = Time(now.0.saturating_sub(age_ms));
            // Others tell of it: on one computer it would be heard.
            let here = self.shares_airframe();
            return self.fall_silent((now, timers), Silence { alive, here });
        }
        self.hear_of_myself(incarnation, never_said || heartbeat > sent)
    }

    fn fall_silent(&mut self, (now, timers): (Time, &Timers), because: Silence) -> Effects {
        if let Some(before) = &mut self.silent {
            before.alive = before.alive.max(because.alive);
            before.here = because.here;
            return Effects::new();
        }
        if !self.listens(now, timers) {
            self.quiet = now;
        }
        self.silent = Some(because);
        let text = "another process speaks under this id: this one is silent and flies to base";
        vec![
            Effect::Silent,
            Effect::Report(Report::Silenced),
            Effect::Alarm(text.into()),
        ]
    }

    /// For so long this peer did not listen, or its clock jumped: what is told to be young
    /// may be of before.
    pub fn was_late(&mut self, late_ms: u64) {
        for time in [&mut self.started, &mut self.quiet] {
            *time = time.plus_ms(late_ms);
        }
        if let Some(silence) = &mut self.silent {
            silence.alive = silence.alive.plus_ms(late_ms);
        }
    }

    /// A life that could not be stored is tried again. Who was silent begins a life
    /// when its twin was not alive for longer than `patience_ms`.
    pub fn tick(
        &mut self,
        now: Time,
        (period_ms, patience_ms): (u64, u64),
        timers: &mut Timers,
        durable: Incarnation,
    ) -> Effects {
        self.raised = false;
        if self
            .silent
            .is_some_and(|s| now.since_ms(s.alive) > patience_ms)
        {
            if !self.tries_again() {
                return Effects::new();
            }
            self.was_silent = self.silent.take();
            timers.set(Timer::Probation, now.plus_ms(PROBATION_PERIODS * period_ms));
            let above = self.heard.max(self.incarnation).saturating_add(1);
            return self.promise(above);
        }
        if self.incarnation == 0 && self.promised.is_none() {
            if !self.tries_again() {
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

    /// A tick of a peer whose journal ended with life 4.
    fn tick(life: &mut Life) -> Effects {
        life.tick(Time(0), (1000, 12_000), &mut Timers::default(), 4)
    }

    #[test]
    fn who_was_silent_stays_so_until_its_next_life_is_durable() {
        let mut life = living(2);
        let twin = Twin {
            incarnation: 3,
            heartbeat: 9,
            nonce: Some(1),
        };
        let mut timers = Timers::default();
        let _ = life.hear_twin((Time(60_000), &timers), twin, 4, false);
        assert!(life.is_silent());
        let mut at_ms = 80_000;
        let mut tick = |life: &mut Life, timers: &mut Timers| {
            at_ms += 250;
            stored(&life.tick(Time(at_ms), (1000, 12_000), timers, 2))
        };
        assert_eq!(tick(&mut life, &mut timers), [4]);
        // The disk takes no writes: it is tried again, less and less often, and nothing is said.
        let mut tries = 0;
        for _ in 0..40 {
            life.on_broken(4);
            assert!(life.is_silent() && !life.speaks(Time(200_000), &timers));
            while tick(&mut life, &mut timers).is_empty() {}
            tries += 1;
            if tries == 4 {
                break;
            }
        }
        assert!(life.retry.1 >= 8, "{:?}", life.retry);
        assert!(!life.on_durable(4).is_empty());
        assert!(!life.is_silent() && life.speaks(Time(200_000), &timers));
    }

    /// A life that was started and is durable.
    fn living(incarnation: Incarnation) -> Life {
        let mut life = Life::default();
        let effects = life.start(Time(0), 1000, &mut Timers::default(), 7, incarnation - 1);
        assert_eq!(stored(&effects), [incarnation]);
        assert_eq!(life.on_durable(incarnation).len(), 2);
        life
    }

    #[test]
    fn a_life_speaks_once_it_is_durable_and_has_listened() {
        let (mut life, mut timers) = (Life::default(), Timers::default());
        life.start(Time(500), 1000, &mut timers, 7, 4);
        assert!(!life.speaks(Time(9000), &timers), "not durable yet");
        assert!(life.on_durable(4).is_empty(), "another life was promised");
        life.on_durable(5);
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
        tick(&mut life);
        assert_eq!(stored(&life.hear_of_myself(6, false)), [7]);
        assert!(life.hear_of_myself(5, false).is_empty(), "7 is promised");
        assert!(
            life.on_durable(3).is_empty(),
            "an earlier promise is overtaken"
        );
        assert_eq!(life.on_durable(7).len(), 2);
        assert_eq!(life.incarnation(), 7);
        tick(&mut life);
        assert!(life.hear_of_myself(u32::MAX, false).is_empty(), "made up");
    }

    /// The time, with a probation that is over or goes on for ever.
    fn at(ms: u64, speaks: bool) -> (Time, Timers) {
        let mut timers = Timers::default();
        timers.set(Timer::Probation, Time(if speaks { 0 } else { u64::MAX }));
        (Time(ms), timers)
    }

    fn twin(incarnation: Incarnation, heartbeat: u32, nonce: Option<u32>) -> Twin {
        Twin {
            incarnation,
            heartbeat,
            nonce,
        }
    }

    #[test]
    fn of_twins_the_later_life_goes_on_then_the_elder_then_the_higher_nonce() {
        // In life 2 with 40 heartbeats and nonce 7.
        for (heard, silent, life) in [
            (twin(3, 1, Some(1)), true, None),
            (twin(1, 900, Some(9)), false, None),
            (twin(2, 41, Some(1)), true, None),
            (twin(2, 39, Some(9)), false, Some(3)),
            (twin(2, 40, Some(8)), true, None),
            (twin(2, 40, Some(6)), false, Some(3)),
            // A heartbeat tells no nonce: what it may have sent itself tells nothing.
            (twin(2, 41, None), true, None),
            (twin(2, 40, None), false, None),
            (twin(2, 39, None), false, None),
            (twin(1, 900, None), false, None),
            (twin(3 + LIFE_STEP, 1, Some(9)), false, None),
        ] {
            let mut of = living(2);
            let (now, timers) = at(60_000, true);
            let effects = of.hear_twin((now, &timers), heard, 40, false);
            assert_eq!(of.is_silent(), silent, "{heard:?}");
            assert_eq!(of.speaks(now, &timers), !silent && life.is_none());
            assert_eq!(stored(&effects).first().copied(), life, "{heard:?}");
        }
    }

    #[test]
    fn who_has_not_spoken_yet_is_silent_for_any_twin_that_is_heard() {
        let mut of = living(9);
        let (now, timers) = at(1_000, false);
        let effects = of.hear_twin((now, &timers), twin(1, 3, None), 0, true);
        assert!(of.is_silent() && of.shares_airframe());
        assert!(matches!(effects[..], [Effect::Silent, ..]));
        // It is told once, and where the twin was heard last.
        let again = of.hear_twin((now, &timers), twin(1, 4, None), 0, false);
        assert!(again.is_empty() && !of.shares_airframe());
    }

    #[test]
    fn a_heartbeat_sent_since_this_process_is_there_is_that_of_a_twin() {
        for (speaks, theirs, age_ms, silent, life) in [
            // It runs for 10 s, in life 2 with 15 heartbeats.
            (true, (3, 1), 4_900, true, None),
            (true, (3, 1), 5_000, false, Some(4)),
            (true, (2, 16), 4_900, true, None),
            (true, (2, 16), 5_000, false, Some(3)),
            (true, (2, 15), 0, false, None),
            (true, (1, 99), 0, false, None),
            (true, (3 + LIFE_STEP, 1), 0, false, None),
            (false, (1, 99), 4_900, true, None),
            (false, (1, 99), 5_000, false, None),
            (false, (3, 1), 5_000, false, Some(4)),
        ] {
            let mut of = living(2);
            let (now, timers) = at(10_000, speaks);
            let effects =
                of.hear_of_heartbeat((now, &timers), theirs, (age_ms, 4_950), (15, false));
            assert_eq!(of.is_silent(), silent, "{theirs:?} {age_ms}");
            assert_eq!(stored(&effects).first().copied(), life, "{theirs:?}");
        }
    }

    #[test]
    fn a_twin_that_was_silent_for_long_may_be_out_of_reach() {
        for (age_ms, silent) in [(4_500, true), (4_501, false)] {
            let mut of = living(2);
            let now = at(90_000, true);
            let effects =
                of.hear_of_heartbeat((now.0, &now.1), (3, 1), (age_ms, 4_500), (15, false));
            assert_eq!(
                (of.is_silent(), stored(&effects).is_empty()),
                (silent, silent)
            );
        }
    }

    #[test]
    fn a_life_that_becomes_durable_after_its_peer_fell_silent_is_not_spoken() {
        let mut of = living(2);
        let (now, mut timers) = at(60_000, true);
        assert_eq!(stored(&of.hear_of_myself(3, false)), [4]);
        of.hear_twin((now, &timers), twin(3, 1, Some(9)), 40, false);
        assert!(matches!(of.on_durable(4)[..], [Effect::Live(4)]));
        assert!(of.is_silent() && !of.speaks(now, &timers));
        let back = of.tick(Time(72_001), (1000, 12_000), &mut timers, 4);
        assert_eq!(stored(&back), [5]);
    }

    #[test]
    fn who_was_late_does_not_take_its_own_past_for_a_twin() {
        let mut of = living(2);
        of.was_late(8_000);
        let (now, timers) = at(10_000, true);
        of.hear_of_heartbeat((now, &timers), (3, 1), (1_500, 4_500), (15, false));
        assert!(!of.is_silent());
    }

    #[test]
    fn a_silent_peer_comes_back_above_all_lives_heard_of_and_listens_first() {
        let mut of = living(2);
        let (now, mut timers) = at(60_000, true);
        of.hear_twin((now, &timers), twin(3, 1, Some(9)), 40, false);
        of.hear_of_heartbeat((Time(61_000), &timers), (5, 1), (400, 4_500), (40, false));
        assert!(of.hear_of_myself(6, false).is_empty(), "others are told");
        let tick = |of: &mut Life, ms, timers: &mut Timers| {
            stored(&of.tick(Time(ms), (1000, 12_000), timers, 2))
        };
        assert!(tick(&mut of, 72_600, &mut timers).is_empty());
        assert_eq!(tick(&mut of, 72_601, &mut timers), [7]);
        of.on_durable(7);
        assert!(!of.speaks(Time(75_600), &timers) && of.speaks(Time(75_601), &timers));
        // What it said itself before it was silent is no twin.
        let mine = of.hear_of_heartbeat(
            (Time(74_000), &timers),
            (2, 40),
            (14_000, 15_000),
            (0, false),
        );
        assert!(mine.is_empty() && !of.is_silent());
    }

    #[test]
    fn a_first_life_that_was_not_stored_is_promised_again() {
        let mut life = Life::default();
        life.start(Time(0), 1000, &mut Timers::default(), 7, 4);
        assert!(tick(&mut life).is_empty());
        life.on_broken(5);
        assert_eq!(stored(&tick(&mut life)), [5]);
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
