//! What waits to be sent, and whose turn it is.

use super::{RecordKey, is_piece};
use crate::input::Time;
use crate::output::Priority;
use core::cell::Cell;
use std::collections::BTreeMap;

/// Most transmissions waiting: all records of one neighbourhood once.
pub const MAX_QUEUE: usize = 128;

/// Whether a record goes before what is due sooner: those that do come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Standing {
    /// Nobody else can say it, and it was not said yet.
    First,
    /// This peer's coverage: as much of the others goes before more of it.
    Coverage,
    /// Its turn comes when it is due.
    Due,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    pub(super) from: Time,
    pub(super) until: Time,
    /// By when it is to be sent.
    pub(super) due: Time,
    pub(super) priority: Priority,
    pub(super) standing: Standing,
}

/// Whose turn it is among those that have waited for their random time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    /// None where all still wait.
    pub(super) first: Option<(RecordKey, Priority)>,
    /// When the random time of another one is over.
    pub(super) next: Time,
}

/// The queue of a relay: one entry per key.
#[derive(Clone, Debug)]
pub(super) struct Queue {
    waiting: BTreeMap<RecordKey, Waiting>,
    /// Before this no lifetime is over.
    first_until: Time,
    pieces: usize,
    /// So many bytes of what is due go before more coverage.
    owed_bytes: usize,
    /// As it was last asked for; nothing where the queue changed since.
    turn: Cell<Option<Turn>>,
}

impl Queue {
    pub(super) fn new() -> Self {
        Self {
            waiting: BTreeMap::new(),
            first_until: Time(u64::MAX),
            pieces: 0,
            owed_bytes: 0,
            turn: Cell::new(None),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }

    pub(super) fn contains(&self, key: &RecordKey) -> bool {
        self.waiting.contains_key(key)
    }

    /// Since when something waits that goes before what is due sooner.
    pub(super) fn first_due(&self, key: &RecordKey) -> Option<Time> {
        let waiting = self.waiting.get(key);
        waiting
            .filter(|w| w.standing == Standing::First)
            .map(|w| w.due)
    }

    /// Whether such a thing has waited for so long.
    pub(super) fn waits_first(&self, now: Time, ms: u64) -> bool {
        let mut first = self.waiting.values();
        first.any(|w| w.standing == Standing::First && w.due.plus_ms(ms) <= now)
    }

    /// Makes room for one more, if need be in place of the least urgent.
    pub(super) fn make_room(&mut self, key: &RecordKey) {
        if self.len() >= MAX_QUEUE && !self.contains(key) {
            let last = self
                .waiting
                .iter()
                .max_by_key(|(k, w)| (w.priority, w.from, **k))
                .map(|(k, _)| *k);
            if let Some(k) = last {
                self.remove(&k);
            }
        }
    }

    pub(super) fn insert(&mut self, key: RecordKey, waiting: Waiting) {
        self.first_until = self.first_until.min(waiting.until);
        let before = self.waiting.insert(key, waiting);
        self.pieces += usize::from(is_piece(&key) && before.is_none());
        self.turn.set(None);
        assert!(self.len() <= MAX_QUEUE, "the queue keeps to its cap");
    }

    pub(super) fn remove(&mut self, key: &RecordKey) {
        if self.waiting.remove(key).is_some() {
            self.pieces -= usize::from(is_piece(key));
            self.turn.set(None);
        }
    }

    /// It is sent, and waits no more; so many bytes of it are paid from this peer's share.
    pub(super) fn sent(&mut self, key: &RecordKey, share_bytes: usize) {
        match self.waiting.get(key).map(|w| w.standing) {
            Some(Standing::Coverage) => self.owed_bytes = share_bytes,
            Some(Standing::Due) => self.owed_bytes = self.owed_bytes.saturating_sub(share_bytes),
            Some(Standing::First) | None => {}
        }
        self.remove(key);
    }

    /// All of one author are void.
    pub(super) fn remove_author(&mut self, author: u16) {
        let keys = self.waiting.keys().filter(|k| k.0 == author);
        let keys: Vec<RecordKey> = keys.copied().collect();
        for key in keys {
            self.remove(&key);
        }
    }

    /// Drops those whose lifetime is over.
    pub(super) fn expire(&mut self, now: Time) {
        if now <= self.first_until {
            return;
        }
        let over = self.waiting.iter().filter(|(_, w)| w.until < now);
        let over: Vec<RecordKey> = over.map(|(k, _)| *k).collect();
        for key in over {
            self.remove(&key);
        }
        let untils = self.waiting.values().map(|w| w.until);
        self.first_until = untils.min().unwrap_or(Time(u64::MAX));
    }

    /// The pieces of missions among them.
    pub(super) fn pieces(&self) -> Vec<RecordKey> {
        if self.pieces == 0 {
            return Vec::new();
        }
        let keys = self.waiting.keys().filter(|k| is_piece(k));
        keys.copied().collect()
    }

    /// The pieces among those that have waited for their random time.
    pub(super) fn ripe_pieces(&self, now: Time) -> impl Iterator<Item = RecordKey> {
        let none = self.pieces == 0;
        let waiting = self.waiting.iter().take_while(move |_| !none);
        let pieces = waiting.filter(move |(k, w)| is_piece(k) && w.from <= now);
        pieces.map(|(k, _)| *k)
    }

    /// Two that wait change places.
    pub(super) fn swap(&mut self, a: &RecordKey, b: &RecordKey) {
        if a != b
            && let (Some(of_a), Some(of_b)) = (self.waiting.get(a), self.waiting.get(b))
        {
            let (of_a, of_b) = (*of_a, *of_b);
            self.waiting.insert(*a, of_b);
            self.waiting.insert(*b, of_a);
            self.turn.set(None);
        }
    }

    pub(super) fn n_pieces(&self) -> usize {
        self.pieces
    }

    /// Asked for with every input, and looked up among all only after something changed.
    pub(super) fn turn(&self, now: Time) -> Turn {
        let known = self.turn.get().filter(|t| now < t.next);
        let turn = known.unwrap_or_else(|| {
            let later = self.waiting.values().map(|w| w.from).filter(|t| *t > now);
            Turn {
                first: self.first(now, |_| false),
                next: later.min().unwrap_or(Time(u64::MAX)),
            }
        });
        self.turn.set(Some(turn));
        turn
    }

    /// What goes next: it is its turn, or it rides with what goes now.
    pub(super) fn first(
        &self,
        now: Time,
        rides: impl Fn(&RecordKey) -> bool,
    ) -> Option<(RecordKey, Priority)> {
        let may_go = |(k, w): &(&RecordKey, &Waiting)| w.from <= now || rides(k);
        let goes = self.waiting.iter().filter(may_go);
        let yields = |w: &Waiting| w.standing == Standing::Coverage && self.owed_bytes > 0;
        goes.min_by_key(|(k, w)| (w.from > now, yields(w), w.standing, w.due, **k))
            .map(|(k, w)| (*k, w.priority))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::kinds::Kind;
    use skein_geometry::random::SplitMix64;

    fn waiting(standing: Standing) -> Waiting {
        Waiting {
            from: Time(0),
            until: Time(9_000),
            due: Time(0),
            priority: Priority::Claim,
            standing,
        }
    }

    /// A peer learns of so much coverage that it has some to tell all the time, and passes on
    /// what others claim.
    #[test]
    fn coverage_and_what_is_due_share_the_air_evenly() {
        let mut queue = Queue::new();
        let coverage: RecordKey = (1, Kind::Cover.number(), 0, 0);
        queue.insert(coverage, waiting(Standing::Coverage));
        for author in 2..=9 {
            let claim = (author, Kind::Claim.number(), 0, 0);
            queue.insert(claim, waiting(Standing::Due));
        }
        let mut order = Vec::new();
        while let Some((key, _)) = queue.turn(Time(1)).first {
            order.push(key.0);
            queue.sent(&key, if key == coverage { 160 } else { 60 });
            if order.len() < 8 {
                queue.insert(coverage, waiting(Standing::Coverage));
            }
        }
        assert_eq!(order, [1, 2, 3, 4, 1, 5, 6, 7, 1, 8, 9], "by bytes");
        // What was said first still goes before both.
        queue.insert(coverage, waiting(Standing::Coverage));
        queue.insert((2, Kind::Claim.number(), 0, 0), waiting(Standing::Due));
        queue.insert((1, Kind::Claim.number(), 0, 0), waiting(Standing::First));
        let first = queue.turn(Time(1)).first.map(|(key, _)| key.1);
        assert_eq!(first, Some(Kind::Claim.number()));
    }

    #[test]
    fn the_turn_that_is_kept_is_the_one_that_is_looked_up() {
        let mut bits = SplitMix64::new(1);
        let mut below = |n: u64| bits.bits() % n;
        let mut queue = Queue::new();
        let (mut kept, mut full) = (0, 0);
        for now in (0..60_000).map(|step| Time(step * 7)) {
            let kind = [Kind::Claim, Kind::Cover, Kind::Mission][below(3) as usize];
            let key = (below(20) as u16, kind.number(), below(4) as u16, 0);
            let from = now.plus_ms(below(2_000));
            let waiting = Waiting {
                from,
                until: from.plus_ms(below(9_000)),
                due: from.plus_ms(below(3) * 500),
                priority: kind.priority(),
                standing: [Standing::First, Standing::Coverage, Standing::Due][below(3) as usize],
            };
            match below(16) {
                0..4 => {
                    queue.make_room(&key);
                    queue.insert(key, waiting);
                }
                4 if below(2) == 0 => queue.remove(&key),
                4 => queue.sent(&key, below(200) as usize),
                5 if below(100) == 0 => queue.remove_author(key.0),
                _ => queue.expire(now),
            }
            full += usize::from(queue.len() == MAX_QUEUE);
            kept += u32::from(queue.turn.get().is_some());
            let turn = queue.turn(now);
            assert_eq!(turn.first, queue.first(now, |_| false));
            let later = queue.waiting.values().map(|w| w.from);
            let next = later.filter(|from| *from > now).min();
            assert_eq!(turn.next, next.unwrap_or(Time(u64::MAX)));
            assert_eq!(queue.n_pieces(), queue.pieces().len());
            let least = queue.waiting.values().map(|w| w.until).min();
            assert!(least.is_none_or(|until| queue.first_until <= until));
        }
        assert!(kept > 20_000 && full > 100, "{kept} {full}");
    }
}
