//! Which pieces of missions neighbours lack, and what they lend for them.
//!
//! | what is heard of a neighbour | what it lacks |
//! |---|---|
//! | a beacon of an older revision than a piece held here | that piece, unless it says which it lacks of that very mission |
//! | what it lacks of that mission | those pieces |
//! | a beacon of that revision or a newer one | none |
//! | nothing for ten of its intervals | nothing is known |
//!
//! Whoever lacks pieces lends a part of its share of the air, in even parts, to those neighbours
//! that follow the newer revision ([`super::super::airtime`]).

use crate::input::Time;
use crate::wire::limits::PEERS_MAX;
use crate::wire::message::Lacking;
use std::collections::BTreeMap;

/// Of which mission a piece is: revision and hash of the content.
pub(super) type Mission = (u32, u64);

/// What is lent counts for so many intervals of the lender: it says so with every second beacon
/// at least, and one may be missed.
const LENT_INTERVALS: u64 = 4;

#[derive(Clone, Debug)]
struct Neighbour {
    follows: u32,
    until: Time,
    interval_ms: u64,
    /// When it last told what it follows or lacks.
    told: Time,
    lacks: Option<Lacking>,
}

impl Neighbour {
    fn lacks(&self, mission: Mission, piece: u16) -> bool {
        let told = self.lacks.as_ref();
        let told = told.filter(|l| (l.revision, l.content_hash) == mission);
        self.follows < mission.0 && told.is_none_or(|l| l.lacks(piece))
    }
}

/// What is known of each neighbour.
#[derive(Clone, Debug, Default)]
pub(super) struct Wants {
    neighbours: BTreeMap<u16, Neighbour>,
}

impl Wants {
    /// A neighbour's beacon shows a revision.
    pub(super) fn on_beacon(&mut self, now: Time, id: u16, follows: u32, spans_ms: (u64, u64)) {
        if self.neighbours.len() >= PEERS_MAX {
            self.neighbours.retain(|_, n| n.until > now);
        }
        if self.neighbours.len() >= PEERS_MAX && !self.neighbours.contains_key(&id) {
            return;
        }
        let (interval_ms, lasts_ms) = spans_ms;
        let known = self.neighbours.remove(&id);
        let told = known.as_ref().map(|n| n.told);
        let lacks = known.and_then(|n| n.lacks);
        let lacks = lacks.filter(|l| l.revision > follows);
        let neighbour = Neighbour {
            follows,
            until: now.plus_ms(lasts_ms),
            interval_ms,
            // Who said which pieces it lacks says so again.
            told: told.filter(|_| lacks.is_some()).unwrap_or(now),
            lacks,
        };
        self.neighbours.insert(id, neighbour);
    }

    /// A neighbour says which pieces it lacks, in one transmission with its beacon.
    pub(super) fn on_lacking(&mut self, now: Time, id: u16, lacking: &Lacking) {
        if let Some(n) = self.neighbours.get_mut(&id) {
            n.told = now;
            n.lacks = Some(lacking.clone()).filter(|l| l.revision > n.follows);
        }
    }

    fn present(&self, now: Time) -> impl Iterator<Item = &Neighbour> {
        self.neighbours.values().filter(move |n| n.until > now)
    }

    /// Whether any neighbour lacks a piece.
    pub(super) fn is_wanted(&self, now: Time, mission: Mission, piece: u16) -> bool {
        self.present(now).any(|n| n.lacks(mission, piece))
    }

    /// How many lack a piece still that was on the air at a time, as they told since.
    pub(super) fn lacking(
        &self,
        now: Time,
        (mission, piece): (Mission, u16),
        said: Option<Time>,
    ) -> usize {
        let since = |n: &&Neighbour| said.is_none_or(|said| n.told > said);
        let lack = self.present(now).filter(since);
        lack.filter(|n| n.lacks(mission, piece)).count()
    }

    /// The newest revision that any of them follows.
    pub(super) fn newest(&self, now: Time) -> u32 {
        let follow = self.present(now).map(|n| n.follows);
        follow.max().unwrap_or(0)
    }

    /// How many follow this revision or a newer one.
    pub(super) fn holders(&self, now: Time, revision: u32) -> u16 {
        let follow = self.present(now).filter(|n| n.follows >= revision);
        u16::try_from(follow.count()).unwrap_or(u16::MAX)
    }

    /// How many neighbours' loans are this peer's, which follows a revision itself, thousandths.
    pub(super) fn lent_permille(&self, now: Time, mine: u32) -> u64 {
        let lent = |n: &Neighbour| {
            let lately = now.since_ms(n.told) < LENT_INTERVALS * n.interval_ms;
            let lacks = n.lacks.as_ref().filter(|l| lends(l) && l.revision <= mine);
            lacks
                .filter(|_| lately)
                .map(|l| 1000 / u64::from(l.holders))
        };
        self.present(now).filter_map(lent).sum()
    }
}

/// Whether its author lends a part of its share for what it lacks.
pub(super) fn lends(lacking: &Lacking) -> bool {
    lacking.holders > 0 && !lacking.pieces.is_empty()
}
