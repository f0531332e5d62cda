//! What was said of a run so far, for any number of readers. Bounded: a page that comes late
//! still gets the run from its beginning, with fewer frames where the run was long.

use crate::words::{self, Hello};
use skein_recording::{Record, Sink};
use skein_view::History;
use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;

/// Bytes that are kept, in words as they are sent: 40 minutes of a hundred UAVs, some hours of
/// eight.
const KEPT_BYTES: usize = 48 << 20;

/// Words that a reader is given at once, so that no reader holds the lock for long.
const AT_ONCE: usize = 128;

/// One word, as it is sent.
#[derive(Clone, Debug)]
pub(crate) struct Word {
    /// Counts all words, those that were thinned out too.
    pub(crate) number: u64,
    pub(crate) json: Arc<str>,
    /// May be left out where room is short.
    spare: bool,
}

#[derive(Debug, Default)]
struct Log {
    /// Rounds and tasks, which are sent whole with each change.
    history: History,
    words: VecDeque<Word>,
    bytes: usize,
    /// Number of the last word; 0 before the first.
    last: u64,
}

/// The words of one run.
#[derive(Debug)]
pub struct Feed {
    log: Mutex<Log>,
    /// Number of the last word.
    last: watch::Sender<u64>,
    limit_bytes: usize,
}

impl Feed {
    /// Of a run that has not begun.
    #[must_use]
    pub fn new(hello: &Hello) -> Arc<Self> {
        Self::with_limit(hello, KEPT_BYTES)
    }

    fn with_limit(hello: &Hello, limit_bytes: usize) -> Arc<Self> {
        let feed = Self {
            log: Mutex::default(),
            last: watch::Sender::new(0),
            limit_bytes,
        };
        feed.push(words::hello(hello), false);
        Arc::new(feed)
    }

    /// Takes a word of the model.
    pub fn give(&self, record: &Record) {
        let (json, spare) = words::of(record);
        self.push(json, spare);
        let changed = self.log().history.hear(record);
        for changed in changed {
            self.push(words::changed(&changed), false);
        }
    }

    /// A sink of this feed.
    #[must_use]
    pub fn sink(self: &Arc<Self>) -> FeedSink {
        FeedSink(Arc::clone(self))
    }

    fn push(&self, json: String, spare: bool) {
        let mut log = self.log();
        log.last += 1;
        log.bytes += json.len();
        let number = log.last;
        log.words.push_back(Word {
            number,
            json: json.into(),
            spare,
        });
        if log.bytes > self.limit_bytes {
            log.thin(self.limit_bytes);
        }
        drop(log);
        self.last.send_replace(number);
    }

    /// Words behind that one, some at once.
    pub(crate) fn after(&self, number: u64) -> Vec<Word> {
        let log = self.log();
        let from = log.words.partition_point(|w| w.number <= number);
        log.words.iter().skip(from).take(AT_ONCE).cloned().collect()
    }

    /// Tells when there are more words.
    pub(crate) fn follow(&self) -> watch::Receiver<u64> {
        self.last.subscribe()
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        // A reader that panicked has changed nothing.
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Log {
    /// Leaves out every second frame of the older half, and, where frames are not what takes the
    /// room, the oldest tenth of all words but the first two, greeting and scene.
    fn thin(&mut self, limit_bytes: usize) {
        let half = self.words.len() / 2;
        let mut nth = 0usize;
        let mut at = 0usize;
        self.words.retain(|word| {
            at += 1;
            nth += usize::from(word.spare);
            at > half || !word.spare || nth % 2 == 1
        });
        self.bytes = self.words.iter().map(|w| w.json.len()).sum();
        if self.bytes > limit_bytes / 8 * 7 {
            let n = self.words.len();
            self.words.drain(2.min(n)..(2 + n / 10).min(n));
            self.bytes = self.words.iter().map(|w| w.json.len()).sum();
        }
    }
}

/// Gives a feed what a driver says.
#[derive(Clone, Debug)]
pub struct FeedSink(Arc<Feed>);

impl Sink for FeedSink {
    fn take(&mut self, record: &Record) -> io::Result<()> {
        self.0.give(record);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::words::Mode;
    use skein_recording::model::Knowledge;
    use skein_recording::{Frame, Scene};

    fn feed(limit_bytes: usize) -> Arc<Feed> {
        let hello = Hello {
            mode: Mode::Sim,
            knowledge: Knowledge::World,
            title: "t".to_owned(),
            command: "c".to_owned(),
        };
        Feed::with_limit(&hello, limit_bytes)
    }

    fn all(feed: &Feed) -> Vec<Word> {
        let mut all: Vec<Word> = Vec::new();
        loop {
            let more = feed.after(all.last().map_or(0, |w| w.number));
            if more.is_empty() {
                return all;
            }
            all.extend(more);
        }
    }

    #[test]
    fn who_comes_late_gets_all_in_order() {
        let feed = feed(KEPT_BYTES);
        let scene = Scene::default();
        feed.sink().take(&Record::Scene(Box::new(scene))).unwrap();
        for time_ms in 0..300 {
            let frame = Frame {
                time_ms,
                ..Frame::default()
            };
            feed.sink().take(&Record::Frame(frame)).unwrap();
        }
        let all = all(&feed);
        let numbers: Vec<u64> = all.iter().map(|w| w.number).collect();
        assert_eq!(numbers, (1..=302).collect::<Vec<_>>());
        assert!(all[0].json.contains("hello") && all[1].json.contains("scene"));
        assert_eq!(*feed.follow().borrow(), 302);
    }

    #[test]
    fn a_long_run_loses_frames_and_keeps_its_beginning() {
        let feed = feed(20_000);
        feed.give(&Record::Scene(Box::default()));
        for time_ms in 0..2_000 {
            feed.give(&Record::Frame(Frame {
                time_ms,
                ..Frame::default()
            }));
        }
        let all = all(&feed);
        let bytes: usize = all.iter().map(|w| w.json.len()).sum();
        assert!(bytes <= 20_000, "{bytes}");
        assert!(all.len() > 50);
        assert!(all[0].json.contains("hello") && all[1].json.contains("scene"));
        assert_eq!(all.last().unwrap().number, 2_002);
        assert!(all.is_sorted_by(|a, b| a.number < b.number));
    }

    #[test]
    fn a_round_is_told_anew_with_each_bid() {
        use skein_recording::model::event::{Bid, Event, Origin, What};
        let feed = feed(KEPT_BYTES);
        let told = |uav, what| {
            feed.give(&Record::Event(Event {
                time_ms: 5,
                origin: Origin::Peer,
                uav: Some(uav),
                text: String::new(),
                what,
            }));
        };
        let (counter, members) = (3, vec![1, 2]);
        let repair = Some(false);
        told(
            2,
            What::Round {
                counter,
                members,
                repair,
            },
        );
        let bids = vec![Bid {
            by: 2,
            anchor: 9,
            release_ms: 0,
            endurance_ms: 0,
            eta_ms: 0,
        }];
        told(2, What::Bids { counter, bids });
        let words = all(&feed);
        let rounds: Vec<&Word> = (words.iter())
            .filter(|w| w.json.contains("\"k\":\"round\""))
            .collect();
        assert_eq!(rounds.len(), 2);
        assert!(!rounds[0].json.contains("\"anchor\":9"));
        assert!(rounds[1].json.contains("\"anchor\":9"));
    }
}
