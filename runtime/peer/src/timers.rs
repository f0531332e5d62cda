//! Timers: every deadline of a peer, in one table.
//!
//! A timer has one owner, which alone sets and stops it. Three of them wake the peer
//! ([`Timers::next_timeout`]); the others are looked at when [`Timer::Tick`] is due, so
//! that what they stand for happens at most a quarter of a beacon period late. How long
//! something *has held* (an orphan, an idle plan) is no deadline: its bound moves with
//! the diameter and the rank, so the part that watches it keeps the instant it began.

use crate::input::Time;

/// A deadline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timer {
    /// All parts look at the time. Wakes the peer.
    Tick,
    /// The next beacon, with or without gossip. Wakes the peer.
    Beacon,
    /// The next beacon with gossip: one interval after the last, ±10 %.
    FullBeacon,
    /// What is asked for at once is to be said. Wakes the peer.
    Question,
    /// While it runs, a suspicion against this peer is answered.
    Refutation,
    /// The probation of a life ends: it may speak.
    Probation,
    /// The own claim is to be spoken.
    Claim,
    /// The covered cells are to be spoken.
    Cover,
    /// The state is to be spoken.
    State,
    /// The end of the mission is to be spoken.
    Finished,
    /// Cells given away and not taken over expire.
    HeldCells,
    /// All is covered; the next lap begins.
    NextLap,
}

impl Timer {
    /// All timers, in the order of the table.
    pub const ALL: [Self; 12] = [
        Self::Tick,
        Self::Beacon,
        Self::FullBeacon,
        Self::Question,
        Self::Refutation,
        Self::Probation,
        Self::Claim,
        Self::Cover,
        Self::State,
        Self::Finished,
        Self::HeldCells,
        Self::NextLap,
    ];

    /// Those for which the driver is asked to come back.
    pub const WAKING: [Self; 3] = [Self::Tick, Self::Beacon, Self::Question];
}

/// When each timer runs out; none that is stopped does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Timers {
    at: [Option<Time>; Timer::ALL.len()],
}

impl Timers {
    /// Sets a timer, whatever it was set to.
    pub fn set(&mut self, timer: Timer, at: Time) {
        self.at[timer as usize] = Some(at);
    }

    /// Sets a timer unless it runs out earlier already.
    pub fn set_earlier(&mut self, timer: Timer, at: Time) {
        let slot = &mut self.at[timer as usize];
        *slot = Some(slot.map_or(at, |known| known.min(at)));
    }

    /// Stops a timer.
    pub fn stop(&mut self, timer: Timer) {
        self.at[timer as usize] = None;
    }

    /// When a timer runs out, if it is set.
    #[must_use]
    pub fn at(&self, timer: Timer) -> Option<Time> {
        self.at[timer as usize]
    }

    /// Whether a timer has run out.
    #[must_use]
    pub fn is_due(&self, timer: Timer, now: Time) -> bool {
        self.at(timer).is_some_and(|at| now >= at)
    }

    /// Whether a timer is set and has not run out.
    #[must_use]
    pub fn is_running(&self, timer: Timer, now: Time) -> bool {
        self.at(timer).is_some_and(|at| now < at)
    }

    /// Whether a timer has run out; stops it if so.
    pub fn take_due(&mut self, timer: Timer, now: Time) -> bool {
        let due = self.is_due(timer, now);
        if due {
            self.stop(timer);
        }
        due
    }

    /// The earliest timer that wakes the peer.
    #[must_use]
    pub fn next_timeout(&self) -> Option<Time> {
        Timer::WAKING.into_iter().filter_map(|t| self.at(t)).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_a_place_for_each_timer() {
        for (i, timer) in Timer::ALL.into_iter().enumerate() {
            assert_eq!(timer as usize, i);
        }
    }

    #[test]
    fn timers_run_out_once_and_only_three_wake() {
        let mut timers = Timers::default();
        timers.set(Timer::Claim, Time(5));
        assert_eq!(timers.next_timeout(), None);
        timers.set(Timer::Beacon, Time(9));
        timers.set(Timer::Tick, Time(7));
        assert_eq!(timers.next_timeout(), Some(Time(7)));
        timers.set_earlier(Timer::Claim, Time(6));
        assert!(timers.is_running(Timer::Claim, Time(4)));
        assert!(timers.take_due(Timer::Claim, Time(5)));
        assert!(!timers.take_due(Timer::Claim, Time(5)));
        timers.set_earlier(Timer::Claim, Time(8));
        timers.set_earlier(Timer::Claim, Time(3));
        assert_eq!(timers.at(Timer::Claim), Some(Time(3)));
    }
}
