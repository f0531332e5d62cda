//! Scenario time against wall time: steps at a fixed scenario period, slower when
//! the machine cannot keep up.

use std::time::Duration;
use tokio::time::Instant;

/// Scenario time between two steps of the world, milliseconds: 10 Hz, the rate at
/// which links are worth computing for UAVs at 15 m/s.
pub const STEP_MS: u64 = 100;

/// Scenario seconds per second at most: a beacon period of 1 s must take 100 ms of
/// wall time, because the transport's own timers know no scenario time.
pub const MAX_SCALE: f64 = 10.0;

/// Below this a trial is no longer worth watching: a minute of flight takes twenty.
const MIN_SCALE: f64 = 0.05;

/// Steps behind plan at which the scale is lowered: 1 s of scenario time. Less is
/// made up for.
const MAX_BEHIND: f64 = 10.0;

/// By how much it is lowered at once.
const SLOWER: f64 = 0.8;

/// How long a UAV may owe the answer to a percept, milliseconds of scenario time, before
/// time stands still for it. An airframe loiters by itself a second after its last
/// setpoint: of that the period of percepts, half a second in large swarms, is spent in
/// any case, and what is left must do for two steps of the world.
const MAX_OWED_MS: u64 = 300;

/// How long time stands still for those who owe an answer, at most. A process that has
/// nothing to say for so long does not wait for a processor: it hangs, and the others fly on.
const MAX_HOLD: Duration = Duration::from_secs(2);

/// While time stands still it is looked at again after this long.
const LOOK_AGAIN: Duration = Duration::from_millis(2);

/// The share of transmissions that may reach a node too late for its channel, in
/// thousandths of those of the last second: more, and the radio is not the scenario's.
const MAX_LATE_PERMILLE: u64 = 20;

/// Steps without trouble after which the scale is raised again by a tenth, up to what
/// was asked for: 10 s of scenario time, longer than any burst of planning.
const CALM_STEPS: u32 = 100;

/// By how much it is raised at once.
const FASTER: f64 = 1.1;

/// Steps between two times that the scale is lowered: the first must show before the
/// second can be judged.
const SETTLE_STEPS: u32 = 20;

/// What the world does when a step is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// It moves on.
    Step,
    /// It stands still for those who owe an answer.
    Hold,
    /// It moves on without them: they had their time.
    Abandon,
}

/// When the next step is due.
#[derive(Debug)]
pub struct Pacer {
    asked: f64,
    calm: u32,
    scale: f64,
    lowest: f64,
    next: Instant,
    /// Since when time stands still.
    held_since: Option<Instant>,
    held: Duration,
    longest_delay_ms: u64,
}

impl Pacer {
    /// Starts now.
    #[must_use]
    pub fn new(scale: f64, now: Instant) -> Self {
        let scale = scale.clamp(MIN_SCALE, MAX_SCALE);
        Self {
            asked: scale,
            calm: 0,
            scale,
            lowest: scale,
            next: now,
            held_since: None,
            held: Duration::ZERO,
            longest_delay_ms: 0,
        }
    }

    /// Scenario seconds per second at present.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The lowest scale so far.
    #[must_use]
    pub fn lowest(&self) -> f64 {
        self.lowest
    }

    /// How long time stood still so far.
    #[must_use]
    pub fn held(&self) -> Duration {
        self.held
    }

    /// The longest delay of an answer so far, milliseconds of scenario time.
    #[must_use]
    pub fn longest_delay_ms(&self) -> u64 {
        self.longest_delay_ms
    }

    /// When the next step is due.
    #[must_use]
    pub fn next(&self) -> Instant {
        self.next
    }

    fn period(&self) -> Duration {
        Duration::from_secs_f64(STEP_MS as f64 / 1000.0 / self.scale)
    }

    /// A step is due; somebody has owed an answer for `owed_ms` of scenario time.
    pub fn due(&mut self, now: Instant, owed_ms: u64) -> Due {
        if owed_ms < MAX_OWED_MS {
            if let Some(since) = self.held_since.take() {
                self.held += now.saturating_duration_since(since);
                // What is lost is not made up for.
                self.next = now;
            }
            return Due::Step;
        }
        let since = *self.held_since.get_or_insert(now);
        if now.saturating_duration_since(since) >= MAX_HOLD {
            return Due::Abandon;
        }
        self.next = now + LOOK_AGAIN;
        Due::Hold
    }

    /// A step was made at `now`; tells whether the scale was lowered.
    pub fn stepped(&mut self, now: Instant) -> bool {
        self.next += self.period();
        self.calm = self.calm.saturating_add(1);
        let behind = now.saturating_duration_since(self.next);
        if behind > self.period().mul_f64(MAX_BEHIND) {
            self.next = now;
            return self.slow_down();
        }
        if self.calm >= CALM_STEPS && self.scale < self.asked {
            self.calm = 0;
            self.scale = (self.scale * FASTER).min(self.asked);
        }
        false
    }

    /// Time had to stand still, or an airframe loiters by itself although its computer
    /// runs; tells whether the scale was lowered.
    pub fn starved(&mut self) -> bool {
        self.calm >= SETTLE_STEPS && self.slow_down()
    }

    /// So many transmissions reached the nodes in the last second, so many of them too
    /// late; tells whether the scale was lowered.
    pub fn heard(&mut self, arrived: u64, late: u64) -> bool {
        late.saturating_mul(1000) > arrived.saturating_mul(MAX_LATE_PERMILLE) && self.starved()
    }

    /// A peer answered a percept with that delay.
    pub fn answered(&mut self, delay_ms: u64) {
        self.longest_delay_ms = self.longest_delay_ms.max(delay_ms);
    }

    fn slow_down(&mut self) -> bool {
        self.calm = 0;
        let before = self.scale;
        self.scale = (self.scale * SLOWER).max(MIN_SCALE);
        self.lowest = self.lowest.min(self.scale);
        self.scale < before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_keeps_up_changes_nothing_and_a_long_lag_slows_down() {
        let start = Instant::now();
        let mut pacer = Pacer::new(10.0, start);
        assert!(!pacer.stepped(start));
        assert_eq!(pacer.next(), start + Duration::from_millis(10));
        assert!(!pacer.stepped(start + Duration::from_millis(90)));
        assert!(pacer.stepped(start + Duration::from_millis(500)));
        assert!((pacer.lowest() - 8.0).abs() < 1e-9);
        assert_eq!(
            pacer.next(),
            start + Duration::from_millis(500),
            "what is lost is not made up for"
        );
    }

    #[test]
    fn time_stands_still_for_who_owes_an_answer_but_not_for_ever() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut pacer = Pacer::new(1.0, start);
        assert_eq!(pacer.due(at(0), MAX_OWED_MS - 1), Due::Step);
        assert_eq!(pacer.due(at(100), MAX_OWED_MS), Due::Hold);
        assert_eq!(pacer.next(), at(100) + LOOK_AGAIN);
        assert_eq!(pacer.due(at(1_300), MAX_OWED_MS), Due::Hold);
        // The answer came: the world goes on from here, at its own pace.
        assert_eq!(pacer.due(at(1_400), 0), Due::Step);
        assert_eq!(pacer.held(), Duration::from_millis(1_300));
        assert!(!pacer.stepped(at(1_400)));
        assert_eq!(pacer.next(), at(1_500));
        // It never comes: they are abandoned, and owe nothing any more.
        assert_eq!(pacer.due(at(1_500), 9_000), Due::Hold);
        assert_eq!(pacer.due(at(3_499), 9_000), Due::Hold);
        assert_eq!(pacer.due(at(3_500), 9_000), Due::Abandon);
        assert_eq!(pacer.due(at(3_500), 0), Due::Step);
        assert_eq!(pacer.held(), Duration::from_millis(3_300));
    }

    #[test]
    fn late_transmissions_slow_down_and_a_few_do_not() {
        let start = Instant::now();
        let mut pacer = Pacer::new(1.0, start);
        for _ in 0..SETTLE_STEPS {
            pacer.stepped(pacer.next());
        }
        assert!(!pacer.heard(0, 0) && !pacer.heard(1_000, 20));
        assert!(pacer.heard(1_000, 21));
        assert!(!pacer.heard(1_000, 900), "the first has not shown yet");
        assert!((pacer.scale() - 0.8).abs() < 1e-9);
    }

    #[test]
    fn starved_airframes_slow_down_once_and_calm_brings_the_scale_back() {
        let start = Instant::now();
        let mut pacer = Pacer::new(10.0, start);
        let mut now = start;
        for _ in 0..SETTLE_STEPS {
            pacer.stepped(now);
            now = pacer.next();
        }
        assert!(pacer.starved());
        assert!(!pacer.starved(), "the first has not shown yet");
        assert!((pacer.scale() - 8.0).abs() < 1e-9);
        for _ in 0..5 * CALM_STEPS {
            pacer.stepped(now);
            now = pacer.next();
        }
        assert!((pacer.scale() - 10.0).abs() < 1e-9);
        assert!((pacer.lowest() - 8.0).abs() < 1e-9);
    }
}
