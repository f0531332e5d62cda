//! What waits at a station for the channel: by priority, then by age (D2.7 §2.2).
//!
//! A newer value of a key takes the place of an older one; what has waited too long is
//! dropped. The simulated channel and a live node queue by the same rules. When the
//! channel is free is left to them.

/// Most frames in one queue: the default age of 2 s at 64 kbit/s lets 16,000 bytes out,
/// and no record is smaller than 40 bytes.
pub const MAX_QUEUE: usize = 400;

/// What can wait in a [`SendQueue`].
pub trait Queued {
    /// Names what the frame is about.
    type Key: PartialEq + ?Sized;
    /// Which frames go first: the lower.
    type Priority: Ord;

    /// A newer frame of the same key replaces a waiting older one.
    fn key(&self) -> &Self::Key;
    /// Which frames go first.
    fn priority(&self) -> Self::Priority;
    /// Worth sending for this long, milliseconds.
    fn lifetime_ms(&self) -> u32;
    /// Its bytes, headers left out.
    fn n_bytes(&self) -> usize;
}

/// A frame that waits.
#[derive(Clone, Debug)]
pub struct Waiting<F> {
    /// The frame.
    pub frame: F,
    /// When it was handed over, microseconds.
    pub queued_us: u64,
    /// When its place in the queue was taken.
    place_us: u64,
}

/// What became of others when a frame was handed over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pushed {
    /// An older value of its key was replaced.
    pub replaced: bool,
    /// The queue was full, and the last in line was dropped.
    pub dropped: bool,
}

/// The queue of one station.
#[derive(Clone, Debug)]
pub struct SendQueue<F> {
    waiting: Vec<Waiting<F>>,
}

impl<F> Default for SendQueue<F> {
    fn default() -> Self {
        Self {
            waiting: Vec::new(),
        }
    }
}

impl<F: Queued> SendQueue<F> {
    /// Hands a frame over.
    pub fn push(&mut self, now_us: u64, frame: F) -> Pushed {
        let old = self
            .waiting
            .iter()
            .position(|w| w.frame.key() == frame.key());
        let place_us = old.map_or(now_us, |at| self.waiting.remove(at).place_us);
        let rank = (frame.priority(), place_us);
        let at = self
            .waiting
            .partition_point(|w| (w.frame.priority(), w.place_us) <= rank);
        let waiting = Waiting {
            frame,
            queued_us: now_us,
            place_us,
        };
        self.waiting.insert(at, waiting);
        let dropped = self.waiting.len() > MAX_QUEUE;
        if dropped {
            // The last in line would be the first to grow too old.
            self.waiting.pop();
        }
        Pushed {
            replaced: old.is_some(),
            dropped,
        }
    }

    /// Drops what has waited longer than its lifetime, or than `max_age_ms`; says how
    /// many frames that were.
    pub fn expire(&mut self, now_us: u64, max_age_ms: u32) -> usize {
        let before = self.waiting.len();
        self.waiting.retain(|w| {
            let limit_ms = w.frame.lifetime_ms().min(max_age_ms);
            now_us <= w.queued_us + u64::from(limit_ms) * 1000
        });
        before - self.waiting.len()
    }

    /// The frame that goes first.
    #[must_use]
    pub fn first(&self) -> Option<&F> {
        self.waiting.first().map(|w| &w.frame)
    }

    /// Takes the frame that goes first.
    pub fn pop(&mut self) -> Option<Waiting<F>> {
        (!self.waiting.is_empty()).then(|| self.waiting.remove(0))
    }

    /// Takes the frame that goes first and, in their order, those that share its
    /// transmission; gives the bytes of all, headers left out. `joined_bytes` tells them for
    /// so many and one more frame of so many, if both can go together.
    pub fn pop_transmission(
        &mut self,
        joined_bytes: impl Fn(usize, usize) -> Option<usize>,
    ) -> Option<(Vec<Waiting<F>>, usize)> {
        let first = self.pop()?;
        let mut n_bytes = first.frame.n_bytes();
        let joins = |w: &mut Waiting<F>| {
            let joined = joined_bytes(n_bytes, w.frame.n_bytes());
            n_bytes = joined.unwrap_or(n_bytes);
            joined.is_some()
        };
        let mut all = vec![first];
        all.extend(self.waiting.extract_if(.., joins));
        Some((all, n_bytes))
    }

    /// Drops everything.
    pub fn clear(&mut self) {
        self.waiting.clear();
    }

    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// How many frames wait.
    #[must_use]
    pub fn len(&self) -> usize {
        self.waiting.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Debug, PartialEq, Eq)]
    struct Word(&'static str, u8, u32, u8);

    impl Queued for Word {
        type Key = str;
        type Priority = u8;

        fn key(&self) -> &str {
            self.0
        }

        fn priority(&self) -> u8 {
            self.1
        }

        fn lifetime_ms(&self) -> u32 {
            self.2
        }

        fn n_bytes(&self) -> usize {
            self.0.len()
        }
    }

    fn drain(queue: &mut SendQueue<Word>) -> Vec<(&'static str, u8)> {
        std::iter::from_fn(|| queue.pop())
            .map(|w| (w.frame.0, w.frame.3))
            .collect()
    }

    #[test]
    fn the_urgent_go_first_and_then_the_old() {
        let mut q = SendQueue::default();
        for (at_us, word) in [
            (1, Word("cover", 4, 9000, 0)),
            (2, Word("beacon", 3, 9000, 0)),
            (3, Word("claim", 1, 9000, 0)),
            (4, Word("bid", 1, 9000, 0)),
        ] {
            assert_eq!(q.push(at_us, word), Pushed::default());
        }
        let order = [("claim", 0), ("bid", 0), ("beacon", 0), ("cover", 0)];
        assert_eq!(drain(&mut q), order);
    }

    #[test]
    fn a_newer_value_keeps_the_place_of_the_older_and_lives_from_now() {
        let mut q = SendQueue::default();
        q.push(0, Word("a", 1, 10, 0));
        q.push(5_000, Word("b", 1, 10, 0));
        let pushed = q.push(8_000, Word("a", 1, 10, 1));
        assert!(pushed.replaced && !pushed.dropped);
        assert_eq!(q.expire(15_001, 1000), 1, "b waited more than 10 ms");
        assert_eq!(q.expire(18_000, 1000), 0, "a waited 10 ms");
        assert_eq!(drain(&mut q), [("a", 1)]);
    }

    #[test]
    fn the_queues_own_age_limits_lifetimes() {
        let mut q = SendQueue::default();
        q.push(0, Word("a", 1, u32::MAX, 0));
        assert_eq!(q.expire(2_000_000, 2000), 0);
        assert_eq!(q.expire(2_000_001, 2000), 1);
        assert!(q.is_empty());
    }

    #[test]
    fn a_full_queue_drops_the_last_in_line() {
        let names: Vec<&'static str> = (0..=MAX_QUEUE)
            .map(|n| &*Box::leak(n.to_string().into_boxed_str()))
            .collect();
        let mut q = SendQueue::default();
        let mut dropped = 0;
        for (n, name) in (0u64..).zip(&names) {
            dropped += u32::from(q.push(n, Word(name, 1, 9, 0)).dropped);
        }
        assert_eq!((dropped, q.len()), (1, MAX_QUEUE));
        assert_eq!(q.first().map(|w| w.0), Some("0"));
    }
}
