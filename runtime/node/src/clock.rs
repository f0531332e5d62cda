//! The peer's clock: scenario time, as the world's frames tell it (D2.7 §1.2: all
//! layers share one time base).
//!
//! Between two frames it runs on by the monotonic clock of the machine, times the
//! scale of the last frame. Without a world it is the monotonic clock itself.
//! It leaves skew and drift to the world, which may send them in its frames.

use skein_peer::Time;
use std::time::{Duration, Instant};

/// How far the clock may run past the last frame, milliseconds of scenario time:
/// five frames of the world. A peer whose world stands still stands still too,
/// instead of declaring everybody dead.
pub const MAX_AHEAD_MS: u64 = 500;

/// Scenario time at the peer.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    frame_ms: u64,
    frame_at: Instant,
    scale: f64,
    limit_ms: Option<u64>,
    latest_ms: u64,
}

impl Clock {
    /// A clock without a world: real time since now.
    #[must_use]
    pub fn free(at: Instant) -> Self {
        Self {
            frame_ms: 0,
            frame_at: at,
            scale: 1.0,
            limit_ms: None,
            latest_ms: 0,
        }
    }

    /// A clock that follows a world whose time is `time_ms`, at `scale` scenario
    /// seconds a second.
    #[must_use]
    pub fn following(time_ms: u64, scale: f64, at: Instant) -> Self {
        Self {
            frame_ms: time_ms,
            frame_at: at,
            scale,
            limit_ms: Some(MAX_AHEAD_MS),
            latest_ms: time_ms,
        }
    }

    /// Takes the time of a frame that arrived at `at`.
    pub fn tick(&mut self, time_ms: u64, scale: f64, at: Instant) {
        self.latest_ms = self.now(at).0;
        self.frame_ms = time_ms;
        self.frame_at = at;
        self.scale = scale;
    }

    /// The time at `at`. Never earlier than any time told before.
    pub fn now(&mut self, at: Instant) -> Time {
        let ran = at.saturating_duration_since(self.frame_at).as_secs_f64() * 1000.0 * self.scale;
        // Beyond 2^53 ms the machine has other troubles; the cast saturates.
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative, saturates"
        )]
        let ran_ms = ran as u64;
        let ran_ms = self.limit_ms.map_or(ran_ms, |limit| ran_ms.min(limit));
        self.latest_ms = self.latest_ms.max(self.frame_ms.saturating_add(ran_ms));
        Time(self.latest_ms)
    }

    /// Whether it waits for the world at `at`: the last frame is too long ago.
    #[must_use]
    pub fn stands_still(&self, at: Instant) -> bool {
        let ran_s = at.saturating_duration_since(self.frame_at).as_secs_f64();
        #[allow(clippy::cast_precision_loss, reason = "half a second")]
        let limit_s = self.limit_ms.map(|limit| limit as f64 / 1000.0);
        limit_s.is_some_and(|limit| ran_s * self.scale >= limit)
    }

    /// How long to wait from `at` until `target`; `None` when only another frame can
    /// bring the clock there.
    pub fn wait_until(&mut self, target: Time, at: Instant) -> Option<Duration> {
        if self.now(at) >= target {
            return Some(Duration::ZERO);
        }
        let ahead_ms = target.0 - self.frame_ms.min(target.0);
        if self.limit_ms.is_some_and(|limit| ahead_ms > limit) {
            return None;
        }
        #[allow(clippy::cast_precision_loss, reason = "a wait in milliseconds")]
        let wall = Duration::from_secs_f64((ahead_ms as f64 / 1000.0 / self.scale).min(86_400.0));
        let due = self.frame_at + wall;
        // One step more than none, so that a rounded wait never spins.
        Some(
            due.saturating_duration_since(at)
                .max(Duration::from_micros(200)),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(n: u64) -> Duration {
        Duration::from_millis(n)
    }

    #[test]
    fn it_runs_on_by_the_scale_and_stops_when_the_world_does() {
        let t0 = Instant::now();
        let mut clock = Clock::following(10_000, 8.0, t0);
        assert_eq!(clock.now(t0 + ms(20)), Time(10_160));
        assert_eq!(clock.now(t0 + ms(5_000)), Time(10_000 + MAX_AHEAD_MS));
        assert_eq!(clock.wait_until(Time(10_600), t0 + ms(5_000)), None);
        assert!(!clock.stands_still(t0 + ms(20)) && clock.stands_still(t0 + ms(63)));
    }

    #[test]
    fn it_never_runs_back_when_the_world_slows_down() {
        let t0 = Instant::now();
        let mut clock = Clock::following(0, 10.0, t0);
        assert_eq!(clock.now(t0 + ms(40)), Time(400));
        clock.tick(100, 1.0, t0 + ms(40));
        assert_eq!(clock.now(t0 + ms(41)), Time(400));
        assert_eq!(clock.now(t0 + ms(400)), Time(460));
    }

    #[test]
    fn a_wait_ends_when_the_clock_is_there() {
        let t0 = Instant::now();
        let mut clock = Clock::following(1_000, 4.0, t0);
        let wait = clock.wait_until(Time(1_200), t0).unwrap();
        assert!(clock.now(t0 + wait + ms(1)) >= Time(1_200));
        assert_eq!(clock.wait_until(Time(900), t0), Some(Duration::ZERO));
    }

    #[test]
    fn without_a_world_nothing_holds_it() {
        let t0 = Instant::now();
        let mut clock = Clock::free(t0);
        assert_eq!(clock.now(t0 + ms(90_000)), Time(90_000));
        assert!(!clock.stands_still(t0 + ms(90_000)));
    }
}
