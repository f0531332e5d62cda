//! The event queue of virtual time: by time, then by the order of a tick, then by
//! the sequence in which events were scheduled, so that no tie is left to chance.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// What comes first among events of the same millisecond: faults act, the radio
/// carries, disks and planners answer, sensors sense, peers decide, checks run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Faults of the scenario.
    Act,
    /// Receptions.
    Radio,
    /// Answers of disks and planners.
    Answer,
    /// Percepts.
    Sense,
    /// Timers of the peers.
    Decide,
    /// The checks.
    Judge,
}

#[derive(Debug)]
struct Entry<E> {
    key: (u64, Phase, u64),
    event: E,
}

impl<E> PartialEq for Entry<E> {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}
impl<E> Eq for Entry<E> {}
impl<E> PartialOrd for Entry<E> {
    fn partial_cmp(&self, other: &Self) -> Option<core::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl<E> Ord for Entry<E> {
    fn cmp(&self, other: &Self) -> core::cmp::Ordering {
        self.key.cmp(&other.key)
    }
}

/// Events to come.
#[derive(Debug)]
pub struct Queue<E> {
    heap: BinaryHeap<Reverse<Entry<E>>>,
    sequence: u64,
}

impl<E> Default for Queue<E> {
    fn default() -> Self {
        Self {
            heap: BinaryHeap::new(),
            sequence: 0,
        }
    }
}

impl<E> Queue<E> {
    /// Schedules `event`.
    pub fn push(&mut self, at_ms: u64, phase: Phase, event: E) {
        self.sequence += 1;
        self.heap.push(Reverse(Entry {
            key: (at_ms, phase, self.sequence),
            event,
        }));
    }

    /// When the next event is due, and in which phase.
    #[must_use]
    pub fn next(&self) -> Option<(u64, Phase)> {
        self.heap.peek().map(|e| (e.0.key.0, e.0.key.1))
    }

    /// Takes the next event and its time.
    pub fn pop(&mut self) -> Option<(u64, E)> {
        self.heap.pop().map(|Reverse(e)| (e.key.0, e.event))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_come_by_time_then_phase_then_sequence() {
        let mut q = Queue::default();
        q.push(5, Phase::Judge, 'e');
        q.push(5, Phase::Decide, 'c');
        q.push(5, Phase::Decide, 'd');
        q.push(5, Phase::Act, 'b');
        q.push(4, Phase::Judge, 'a');
        let order: String = std::iter::from_fn(|| q.pop().map(|(_, c)| c)).collect();
        assert_eq!(order, "abcde");
    }
}
