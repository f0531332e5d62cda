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

/// Below this a trial is no longer worth watching.
const MIN_SCALE: f64 = 0.5;

/// Steps behind plan at which the scale is lowered: 1 s of scenario time. Less is
/// made up for.
const MAX_BEHIND: f64 = 10.0;

/// By how much it is lowered at once.
const SLOWER: f64 = 0.8;

/// How long peers may take to answer a percept, milliseconds of scenario time,
/// before the scale is lowered: the peer's own clock runs at most that far ahead.
const MAX_DELAY_MS: u64 = 1_000;

/// Late answers in a row before the scale is lowered: one may be a paused process.
const LATE_ANSWERS: u32 = 40;

/// Steps without trouble after which the scale is raised again by a tenth, up to what
/// was asked for: 10 s of scenario time, longer than any burst of planning.
const CALM_STEPS: u32 = 100;

/// By how much it is raised at once.
const FASTER: f64 = 1.1;

/// Steps between two times that the scale is lowered: the first must show before the
/// second can be judged.
const SETTLE_STEPS: u32 = 20;

/// When the next step is due.
#[derive(Debug)]
pub struct Pacer {
    asked: f64,
    calm: u32,
    scale: f64,
    lowest: f64,
    next: Instant,
    late: u32,
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
            late: 0,
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

    /// An airframe got no setpoint for so long that it loiters by itself, though its
    /// computer runs; tells whether the scale was lowered.
    pub fn starved(&mut self) -> bool {
        self.calm >= SETTLE_STEPS && self.slow_down()
    }

    /// A peer answered a percept with that delay; tells whether the scale was lowered.
    pub fn answered(&mut self, delay_ms: u64) -> bool {
        self.longest_delay_ms = self.longest_delay_ms.max(delay_ms);
        if delay_ms <= MAX_DELAY_MS {
            self.late = 0;
            return false;
        }
        self.late += 1;
        self.late >= LATE_ANSWERS && self.slow_down()
    }

    fn slow_down(&mut self) -> bool {
        self.late = 0;
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
    fn answers_that_stay_late_slow_down_and_a_single_one_does_not() {
        let mut pacer = Pacer::new(5.0, Instant::now());
        assert!(!pacer.answered(5_000));
        assert!(!pacer.answered(10));
        let lowered = (0..LATE_ANSWERS).filter(|_| pacer.answered(5_000)).count();
        assert_eq!(lowered, 1);
        assert!((pacer.scale() - 4.0).abs() < 1e-9);
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
