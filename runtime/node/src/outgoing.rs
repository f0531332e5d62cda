//! What this peer says, on its way to the transport: no faster than the channel, the
//! urgent first, and nothing that is out of date.
//!
//! The rules of waiting are those of the simulated channel ([`skein_link::queue`]). What
//! leaves at once shares headers as there, and holds the channel as long; that others hold
//! it too is left to the air.

use skein_link::SendQueue;
use skein_link::medium::Channel;
use skein_link::queue::Queued;
use skein_peer::{Priority, Time};
use std::collections::VecDeque;

/// What a peer wants to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The natural key; a newer record of the same key replaces a waiting older one.
    pub key: String,
    /// The record.
    pub bytes: Vec<u8>,
    /// Hops the record has made before this transmission.
    pub hops: u8,
    /// Which frames go first.
    pub priority: Priority,
    /// Dropped when it could not be sent within this time, milliseconds.
    pub lifetime_ms: u32,
}

impl Queued for Frame {
    type Key = str;
    type Priority = Priority;

    fn key(&self) -> &str {
        &self.key
    }

    fn priority(&self) -> Priority {
        self.priority
    }

    fn lifetime_ms(&self) -> u32 {
        self.lifetime_ms
    }

    fn n_bytes(&self) -> usize {
        self.bytes.len()
    }
}

/// The frames of one peer that wait for the channel.
#[derive(Debug)]
pub struct Outgoing {
    queue: SendQueue<Frame>,
    channel: Channel,
    /// The last frame has left by then, microseconds.
    free_us: u64,
    /// What shares the transmission of the frame that left last.
    leaving: VecDeque<Frame>,
    dropped: u64,
}

impl Outgoing {
    /// Nothing waits.
    #[must_use]
    pub fn new(channel: Channel) -> Self {
        Self {
            queue: SendQueue::default(),
            channel,
            free_us: 0,
            leaving: VecDeque::new(),
            dropped: 0,
        }
    }

    /// Takes what is to be sent.
    pub fn push(&mut self, now: Time, frame: Frame) {
        let pushed = self.queue.push(now.0.saturating_mul(1000), frame);
        self.dropped += u64::from(pushed.dropped);
    }

    /// The next frame that may leave now, with what shares its transmission right after it.
    pub fn pop(&mut self, now: Time) -> Option<Frame> {
        if let Some(frame) = self.leaving.pop_front() {
            return Some(frame);
        }
        let now_us = now.0.saturating_mul(1000);
        self.dropped += self.queue.expire(now_us, self.channel.queue_age_ms) as u64;
        if now_us < self.free_us {
            return None;
        }
        let joined_bytes = |filled, n_bytes| self.channel.joined_bytes(filled, n_bytes);
        let (all, n_bytes) = self.queue.pop_transmission(joined_bytes)?;
        self.leaving.extend(all.into_iter().map(|w| w.frame));
        let airtime_us = self.channel.airtime_us(n_bytes);
        // The clock counts whole milliseconds: of a queue that never ran empty the
        // frames follow each other without a gap.
        let begun_us = self.free_us.max(now_us.saturating_sub(999));
        self.free_us = begun_us.saturating_add(airtime_us);
        self.leaving.pop_front()
    }

    /// When the next frame may leave; none while nothing waits.
    #[must_use]
    pub fn next_due(&self) -> Option<Time> {
        if !self.leaving.is_empty() {
            return Some(Time(0));
        }
        (!self.queue.is_empty()).then(|| Time(self.free_us.div_ceil(1000)))
    }

    /// Frames that were never sent because they waited too long, so far.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outgoing(rate_bps: u32, queue_age_ms: u32) -> Outgoing {
        Outgoing::new(Channel {
            rate_bps,
            overhead_bytes: 0,
            part_bytes: 4,
            frame_bytes: 150,
            queue_age_ms,
        })
    }

    fn frame(key: &str, priority: Priority, lifetime_ms: u32) -> Frame {
        Frame {
            key: key.to_owned(),
            bytes: vec![0; 100],
            hops: 0,
            priority,
            lifetime_ms,
        }
    }

    /// Lets everything leave that may, second after second; keys and times.
    fn sent(out: &mut Outgoing, from_ms: u64, to_ms: u64) -> Vec<(u64, String)> {
        let mut sent = Vec::new();
        for t in from_ms..to_ms {
            while let Some(f) = out.pop(Time(t)) {
                sent.push((t, f.key));
            }
        }
        sent
    }

    #[test]
    fn frames_leave_at_the_rate_of_the_channel_and_the_urgent_go_first() {
        // 800 bits at 64 kbit/s are 12.5 ms.
        let mut out = outgoing(64_000, 2_000);
        for (key, priority) in [
            ("cover", Priority::Telemetry),
            ("beacon", Priority::Beacon),
            ("claim", Priority::Claim),
        ] {
            out.push(Time(100), frame(key, priority, 1_000));
        }
        assert_eq!(out.next_due(), Some(Time(0)));
        let all = sent(&mut out, 100, 200);
        let expected = [(100, "claim"), (112, "beacon"), (125, "cover")];
        assert_eq!(all, expected.map(|(t, k)| (t, k.to_owned())));
        assert_eq!((out.next_due(), out.dropped()), (None, 0));
    }

    #[test]
    fn what_fits_into_one_transmission_leaves_at_once() {
        let mut out = outgoing(64_000, 2_000);
        let of = |key: &str, n_bytes: usize| Frame {
            bytes: vec![0; n_bytes],
            ..frame(key, Priority::Claim, 1_000)
        };
        for (key, n_bytes) in [("first", 100), ("long", 80), ("short", 40), ("none", 4)] {
            out.push(Time(0), of(key, n_bytes));
        }
        // 144 bytes take 18 ms: what is left does not fit.
        let all = sent(&mut out, 0, 100);
        let expected = [(0, "first"), (0, "short"), (18, "long"), (18, "none")];
        assert_eq!(all, expected.map(|(t, k)| (t, k.to_owned())));
    }

    #[test]
    fn what_could_not_leave_within_its_lifetime_never_does() {
        let mut out = outgoing(64_000, 2_000);
        out.push(Time(0), frame("first", Priority::Beacon, 5));
        out.push(Time(0), frame("short", Priority::Beacon, 5));
        out.push(Time(0), frame("long", Priority::Beacon, 5_000));
        assert_eq!(sent(&mut out, 0, 1), [(0, "first".to_owned())]);
        assert_eq!(sent(&mut out, 1, 50), [(13, "long".to_owned())]);
        assert_eq!(out.dropped(), 1);
        // After a pause of the process nothing old is left to be said.
        out.push(Time(50), frame("old", Priority::Claim, 60_000));
        assert_eq!(out.pop(Time(9_000)), None);
        assert_eq!(out.dropped(), 2);
    }

    #[test]
    fn a_newer_record_of_the_same_key_replaces_what_waits() {
        let mut out = outgoing(64_000, 2_000);
        out.push(Time(0), frame("state", Priority::Telemetry, 1_000));
        let newer = Frame {
            hops: 7,
            ..frame("state", Priority::Telemetry, 1_000)
        };
        out.push(Time(1), newer);
        assert_eq!(out.pop(Time(1)).map(|f| f.hops), Some(7));
        assert_eq!((out.pop(Time(50)), out.dropped()), (None, 0));
    }
}
