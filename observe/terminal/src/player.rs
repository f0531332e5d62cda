//! Which words of a run are due: those of a trial as they come, those of a simulated run at a
//! speed that can be chosen.

use skein_recording::Record;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

/// Words that are taken at once, so that keys are looked at between.
const AT_ONCE: usize = 20_000;

/// Speeds, scenario seconds per second.
const SPEEDS: [u32; 9] = [1, 2, 4, 8, 16, 32, 64, 128, 256];

/// How a run goes by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// As its words come.
    Live,
    /// At so many scenario seconds per second.
    Play(u32),
}

/// Gives words when they are due.
#[derive(Debug)]
pub(crate) struct Player {
    words: Receiver<Record>,
    pub(crate) pace: Pace,
    pub(crate) paused: bool,
    /// Milliseconds of scenario time.
    clock_ms: f64,
    /// Taken from the line, and not due yet.
    next: Option<Record>,
    /// Nothing comes any more.
    pub(crate) over: bool,
}

impl Player {
    pub(crate) fn new(words: Receiver<Record>, pace: Pace) -> Self {
        Self {
            words,
            pace,
            paused: false,
            clock_ms: 0.0,
            next: None,
            over: false,
        }
    }

    /// What is due after so much more time.
    pub(crate) fn due(&mut self, passed: Duration) -> Vec<Record> {
        if let Pace::Play(speed) = self.pace
            && !self.paused
        {
            self.clock_ms += passed.as_secs_f64() * 1000.0 * f64::from(speed);
        }
        let mut due = Vec::new();
        while due.len() < AT_ONCE {
            match self.next.take().map_or_else(|| self.words.try_recv(), Ok) {
                Ok(record) if self.is_due(&record) => due.push(record),
                Ok(record) => {
                    self.next = Some(record);
                    break;
                }
                Err(TryRecvError::Empty) => {
                    self.wait_for(due.last());
                    break;
                }
                Err(TryRecvError::Disconnected) => {
                    self.over = true;
                    break;
                }
            }
        }
        due
    }

    fn is_due(&self, record: &Record) -> bool {
        self.pace == Pace::Live || record.time_ms() as f64 <= self.clock_ms
    }

    /// A simulation that is slower than its picture sets the clock.
    fn wait_for(&mut self, last: Option<&Record>) {
        if let Some(last) = last {
            self.clock_ms = self.clock_ms.min(last.time_ms() as f64 + 1000.0);
        }
    }

    /// Faster or slower by so many steps.
    pub(crate) fn faster(&mut self, steps: isize) {
        if let Pace::Play(speed) = self.pace {
            let at = SPEEDS.partition_point(|s| *s < speed);
            let to = at.saturating_add_signed(steps).min(SPEEDS.len() - 1);
            self.pace = Pace::Play(SPEEDS[to]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_recording::Frame;
    use std::sync::mpsc::channel;

    fn player(pace: Pace) -> Player {
        let (words, out) = channel();
        for time_ms in [0, 500, 1000, 9000] {
            let frame = Frame {
                time_ms,
                ..Frame::default()
            };
            words.send(Record::Frame(frame)).unwrap();
        }
        Player::new(out, pace)
    }

    #[test]
    fn a_simulated_run_goes_by_at_its_speed_and_stands_still_when_paused() {
        let mut player = player(Pace::Play(2));
        let second = Duration::from_secs(1);
        assert_eq!(player.due(Duration::ZERO).len(), 1);
        assert_eq!(player.due(Duration::from_millis(300)).len(), 1);
        player.paused = true;
        assert_eq!(player.due(second).len(), 0);
        player.paused = false;
        assert_eq!(player.due(second).len(), 1);
        player.faster(1);
        assert_eq!(player.pace, Pace::Play(4));
        assert_eq!(player.due(second * 2).len(), 1);
        assert!(player.over);
        player.faster(-9);
        assert_eq!(player.pace, Pace::Play(1));
    }

    #[test]
    fn a_trial_goes_by_as_it_comes() {
        let mut player = player(Pace::Live);
        assert_eq!(player.due(Duration::ZERO).len(), 4);
        assert!(player.over);
    }
}
