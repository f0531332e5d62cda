//! Which missions' pieces are held of an author, and which of them are lent.
//!
//! | pieces of one author | what follows |
//! |---|---|
//! | of the newest mission that is held whole and that this peer follows, or a later one | held; all that is older is dropped |
//! | of newer ones | held, of so many revisions as a peer collects ([`MAX_PARTIAL`]), the newest |
//! | of a mission of which a newer one's piece came within [`FORMER_AFTER_PIECES`] | not said: whoever lacks it is to get the newer one |
//! | of several missions that are lacked | said in turn, a piece of each |
//!
//! The former mission stays until the newer one is whole: its author may be gone after the first
//! piece, and who begins anew then gets what all others follow.

use super::{Mission, PIECE_INTERVALS, RecordKey, Relay, is_piece, piece_of};
use crate::input::Time;
use crate::library::MAX_PARTIAL;
use crate::wire::kinds::Kind;
use crate::wire::message::MissionChunk;
use std::collections::{BTreeMap, BTreeSet};

/// A newer mission comes no more once so many of its pieces would have been due.
const FORMER_AFTER_PIECES: u64 = 4;

/// All keys of one author's pieces.
fn pieces_of(author: u16) -> core::ops::RangeInclusive<RecordKey> {
    let kind = Kind::Mission.number();
    (author, kind, 0, 0)..=(author, kind, u16::MAX, u32::MAX)
}

/// Author and revision.
fn mission_key(key: &RecordKey) -> (u16, u32) {
    (key.0, key.3)
}

impl Relay {
    /// Drops the pieces of an author that nobody needs from here any more.
    pub(super) fn keep_missions(&mut self, author: u16) {
        let former = self.former(author);
        let since = former.unwrap_or(0);
        let pieces = self.held.range(pieces_of(author)).map(|(key, _)| key.3);
        let newer: BTreeSet<u32> = pieces.filter(|revision| *revision > since).collect();
        let oldest = newer.iter().rev().nth(MAX_PARTIAL - 1);
        let from = oldest.map_or(since, |revision| since.max(*revision));
        self.forget(author, |held| {
            let revision = held.mission.map(|m| m.0);
            revision.is_some_and(|r| r < from) && revision != former
        });
    }

    /// The same of all authors.
    pub(super) fn keep_all_missions(&mut self) {
        let authors = self.held.keys().filter(|key| is_piece(key));
        let authors: BTreeSet<u16> = authors.map(|key| key.0).collect();
        for author in authors {
            self.keep_missions(author);
        }
    }

    /// The newest mission of an author that is held whole and that this peer follows, or one
    /// after it: what it follows is known to be one.
    fn former(&self, author: u16) -> Option<u32> {
        let mut held: BTreeMap<Mission, (usize, u16)> = BTreeMap::new();
        for (key, piece) in self.held.range(pieces_of(author)) {
            let mission = piece.mission.filter(|m| m.0 <= self.follows);
            if let Some(mission) = mission.filter(|_| key.2 < piece.pieces) {
                let (count, of) = held.entry(mission).or_default();
                *count += 1;
                *of = piece.pieces.max(*of);
            }
        }
        let whole = held.iter().filter(|(_, (n, of))| *n == usize::from(*of));
        whole.map(|(mission, _)| mission.0).max()
    }

    /// Whether a piece is new in its revision: pieces of an earlier one are held, and what it has
    /// at its place is not this.
    pub(super) fn is_changed(&self, key: &RecordKey, piece: Option<&MissionChunk>) -> bool {
        let Some(piece) = piece else {
            return false;
        };
        let mut held = self.held.range(pieces_of(key.0));
        let is_revised = held.any(|(k, _)| k.3 < key.3);
        let earlier = self.held.range((key.0, key.1, key.2, 0)..*key);
        let mut earlier = earlier.filter_map(|(_, h)| piece_of(Kind::Mission, &h.record));
        is_revised && !earlier.any(|e| e.bytes == piece.bytes)
    }

    /// The newest mission of an author of which a piece came lately; 0 where none did.
    pub(super) fn coming(&self, now: Time, author: u16) -> u32 {
        let quiet_ms = FORMER_AFTER_PIECES * PIECE_INTERVALS * self.air.interval_ms();
        let pieces = self.held.range(pieces_of(author));
        let coming = pieces.filter(|(_, held)| now.since_ms(held.came) < quiet_ms);
        coming.map(|(key, _)| key.3).max().unwrap_or(0)
    }

    /// The same of each author of whom pieces are held.
    pub(super) fn all_coming(&self, now: Time) -> BTreeMap<u16, u32> {
        let authors = self.held.keys().filter(|key| is_piece(key));
        let authors: BTreeSet<u16> = authors.map(|key| key.0).collect();
        let coming = |author| (author, self.coming(now, author));
        authors.into_iter().map(coming).collect()
    }

    /// A piece of a mission came: those of its author's older ones wait no more.
    pub(super) fn outdate(&mut self, author: u16, revision: u32) {
        let older = |key: &RecordKey| key.0 == author && key.3 < revision;
        for key in self.queue.pieces().into_iter().filter(older) {
            self.queue.remove(&key);
        }
    }

    /// Of the pieces that have waited for their random time the one that goes first; of several
    /// missions one of that which was on the air longest ago.
    pub(super) fn first_piece(&self, now: Time) -> Option<RecordKey> {
        let waiting = || self.queue.ripe_pieces(now);
        let turn = |key: &RecordKey| (self.held.get(key).map(|held| held.turn(key)), *key);
        let first = mission_key(&waiting().next()?);
        let mut alone = true;
        // As a rule they are all of one mission, and one look is enough.
        let all = waiting().inspect(|key| alone &= mission_key(key) == first);
        let of_all = all.min_by_key(turn);
        if alone {
            return of_all;
        }
        let goes_on = self.longest_unsaid(waiting());
        let of_one = waiting().filter(|key| goes_on == Some(mission_key(key)));
        of_one.min_by_key(turn)
    }

    /// Of which mission among these no piece was on the air for longest.
    fn longest_unsaid(&self, waiting: impl Iterator<Item = RecordKey>) -> Option<(u16, u32)> {
        let missions: BTreeSet<(u16, u32)> = waiting.map(|key| mission_key(&key)).collect();
        let said = |(author, revision): &(u16, u32)| {
            let pieces = self.held.range(pieces_of(*author));
            let said = pieces.filter(|(key, held)| key.3 == *revision && held.copies > 0);
            said.map(|(_, held)| held.sent).max()
        };
        missions.into_iter().min_by_key(|m| (said(m), *m))
    }
}
