//! What peers say against what they promised: versions never go back (S3), one
//! speaker a key (S4), no promise before it is durable (S7), and a journal that gives
//! back the state it was written from (S11).

use super::{Findings, Handicaps, Snapshot};
use skein_peer::Beliefs;
use skein_peer::cells::CellSet;
use skein_peer::journal::{Durable, Entry};
use skein_peer::protocol::runs::cells_of;
use skein_peer::wire::codec::{self, Body};
use skein_peer::wire::kinds::Kind;
use skein_peer::wire::message::{Bid, Claim, Epoch, Record, Stamp};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A transmission that a peer wrote itself, read back.
#[derive(Clone, Debug)]
pub struct Said {
    /// The envelope.
    pub record: Record,
    /// The body.
    pub body: Body,
    /// The section, where it is a claim.
    pub claim: Option<Arc<Claim>>,
}

impl Said {
    /// Reads bytes that a peer of ours published; `None` when they cannot be read.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let record = codec::decode_record(bytes).ok()?;
        let kind = Kind::of_number(record.kind)?;
        let body = codec::decode_body(kind, &record.body).ok()?;
        let claim = match &body {
            Body::Claim(claim) => Some(Arc::new(claim.clone())),
            _ => None,
        };
        Some(Self {
            record,
            body,
            claim,
        })
    }

    /// Whether it says what is covered or who will fly what.
    #[must_use]
    pub fn tells_of_cells(&self) -> bool {
        matches!(self.body, Body::Claim(_) | Body::Cover(_) | Body::Bid(_))
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Versions {
    incarnation: u32,
    counter: u32,
    epoch: Epoch,
    /// The loop whose epoch that is: another loop begins with none.
    loop_hash: u64,
}

/// What the records of one run were found to be.
#[derive(Clone, Debug, Default)]
pub struct RecordCheck {
    /// By author and key: life, highest number, hash of what was said under it.
    spoken: BTreeMap<(u16, u8, u16), (u32, u32, u64)>,
    versions: BTreeMap<u16, Versions>,
    durable: BTreeMap<u16, (usize, Durable)>,
    own: BTreeMap<u16, Own>,
}

/// Cells that a process saw itself on its loop, with when.
#[derive(Clone, Debug, Default)]
struct Own {
    loop_hash: u64,
    seen: Vec<(u64, u16)>,
}

/// Own coverage is made durable every five cells: a crash costs at most the last four.
const UNSAVED_CELLS: usize = 4;

/// And what is being written, milliseconds: a sync takes at most 20 ms, and no more than
/// one a kind of promise is under way.
const WRITING_MS: u64 = 1_000;

impl RecordCheck {
    /// A process starts: it has seen nothing itself yet.
    pub fn on_boot(&mut self, id: u16) {
        self.own.remove(&id);
    }

    /// A peer works on this loop from now on.
    pub fn on_loop(&mut self, id: u16, loop_hash: u64) {
        let own = self.own.entry(id).or_default();
        if own.loop_hash != loop_hash {
            *own = Own {
                loop_hash,
                seen: Vec::new(),
            };
        }
    }

    /// A peer's camera saw cells.
    pub fn on_covered(&mut self, now_ms: u64, id: u16, cells: &[u16]) {
        let own = self.own.entry(id).or_default();
        own.seen.extend(cells.iter().map(|c| (now_ms, *c)));
    }

    /// The disk of a peer was erased: what it promised is forgotten, and unless somebody
    /// in reach remembers its last life it has no way to know that it had one.
    pub fn on_erased(&mut self, id: u16) {
        self.spoken.retain(|(author, _, _), _| *author != id);
        self.durable.remove(&id);
        self.versions.remove(&id);
    }

    /// A peer says something of its own. `journal` is what its disk holds for
    /// certain, `covered` tells of each cell whether a camera has seen it.
    pub fn on_said(
        &mut self,
        now_ms: u64,
        id: u16,
        said: &Said,
        bytes_hash: u64,
        (journal, covered): (&[Vec<u8>], &CellSet),
        found: &mut Findings,
    ) {
        let r = &said.record;
        if r.author != id {
            found.broken("S4", now_ms, Some(id), || {
                format!("spoke under the name of peer {}", r.author)
            });
            return;
        }
        self.check_speaker(now_ms, r, bytes_hash, found);
        self.check_promises(now_ms, id, said, (journal, covered), found);
    }

    fn check_speaker(&mut self, now_ms: u64, r: &Record, bytes_hash: u64, found: &mut Findings) {
        let key = (r.author, r.kind, r.subject);
        let Some((life, seq, hash)) = self.spoken.insert(key, (r.incarnation, r.seq, bytes_hash))
        else {
            return;
        };
        let fits = match r.incarnation.cmp(&life) {
            core::cmp::Ordering::Less => false,
            core::cmp::Ordering::Equal => r.seq > seq || (r.seq == seq && hash == bytes_hash),
            core::cmp::Ordering::Greater => true,
        };
        if !fits {
            found.broken("S4", now_ms, Some(r.author), || {
                format!(
                    "kind {} subject {}: version ({}, {}) after ({life}, {seq})",
                    r.kind, r.subject, r.incarnation, r.seq
                )
            });
        }
    }

    fn check_promises(
        &mut self,
        now_ms: u64,
        id: u16,
        said: &Said,
        (journal, covered): (&[Vec<u8>], &CellSet),
        found: &mut Findings,
    ) {
        let known = self.durable.get(&id);
        let stale = known.is_none_or(|(n, _)| *n != journal.len());
        let new_life = known.is_none_or(|(_, d)| d.incarnation != said.record.incarnation);
        let promise = matches!(said.body, Body::Claim(_) | Body::Bid(_));
        // Replaying costs a pass over the journal, so it is done only when a promise is spoken.
        if stale && (promise || new_life) {
            self.durable
                .insert(id, (journal.len(), Durable::replay(journal).0));
        }
        let Some((_, durable)) = self.durable.get(&id) else {
            return;
        };
        if said.record.incarnation > durable.incarnation {
            found.broken("S7", now_ms, Some(id), || {
                format!(
                    "speaks in life {}, its disk holds {}",
                    said.record.incarnation, durable.incarnation
                )
            });
        }
        match &said.body {
            Body::Bid(bid) if !promised_bid(journal, bid) => {
                found.broken("S7", now_ms, Some(id), || {
                    format!(
                        "bids in round {}, which its disk does not hold",
                        bid.round.counter
                    )
                });
            }
            Body::Claim(claim) => {
                if let Some(text) = unpromised(claim, journal, covered) {
                    found.broken("S7", now_ms, Some(id), || text);
                }
            }
            _ => {}
        }
    }

    /// A process ended: its journal gives back what it believed to be durable.
    pub fn on_crash(
        &mut self,
        now_ms: u64,
        id: u16,
        (believed, journal, untold): (&Durable, &[Vec<u8>], usize),
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        // Of the last writes a late computer, or one that stood still, had not been told yet.
        let told = &journal[..journal.len().saturating_sub(untold)];
        let (replayed, unread) = Durable::replay(told);
        if replayed != *believed || unread > 0 {
            found.broken("S11", now_ms, Some(id), || {
                format!("replaying {} records ({unread} unread) gives {replayed:?}, it believed {believed:?}", journal.len())
            });
        }
        let (replayed, _) = Durable::replay(journal);
        self.check_own_coverage(now_ms, id, &replayed, handicaps, found);
    }

    /// What a process saw itself is in its journal, but for the last few cells. Cells that
    /// it saw while one write was under way come with the next one; those that could not be
    /// written come with the first cell that is seen once the disk works.
    fn check_own_coverage(
        &self,
        now_ms: u64,
        id: u16,
        durable: &Durable,
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        let Some(own) = self.own.get(&id) else {
            return;
        };
        let Some(works_ms) = handicaps.writes_since_ms(id, now_ms) else {
            return;
        };
        let is_old = |seen_ms: u64| {
            let mut times = own.seen.iter().map(|(t, _)| *t);
            let Some(seen_ms) = times.find(|t| *t >= seen_ms.max(works_ms)) else {
                return false;
            };
            let write_ms = handicaps.write_ms(id, seen_ms, now_ms);
            let late_ms = handicaps.late_ms(id, seen_ms, now_ms);
            write_ms.is_some_and(|w| seen_ms + WRITING_MS + 2 * w + late_ms < now_ms)
        };
        let known = CellSet::decode_rle(durable.cells, &durable.covered)
            .ok()
            .filter(|_| durable.loop_hash == own.loop_hash);
        let written = |c: u16| known.as_ref().is_some_and(|k| k.contains(c));
        let old = own.seen.iter().filter(|(t, _)| is_old(*t));
        let lost = old.filter(|(_, c)| !written(*c)).count();
        if lost > UNSAVED_CELLS {
            found.broken("S11", now_ms, Some(id), || {
                format!("saw {lost} cells that its journal does not hold (at most {UNSAVED_CELLS})")
            });
        }
    }

    /// Versions never go back, within a life and across restarts with a disk.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        for m in snapshot.peers {
            let now = versions(&m.view);
            let old = self.versions.insert(m.id, now).unwrap_or_default();
            // A boot that has not read its journal yet has no life.
            if now.incarnation == 0 {
                self.versions.insert(m.id, old);
                continue;
            }
            let loop_known = m.view.loop_hash != 0;
            let back = now.incarnation < old.incarnation
                || (loop_known && now.counter < old.counter)
                || (now.loop_hash == old.loop_hash && now.epoch < old.epoch);
            if !loop_known {
                self.versions.insert(
                    m.id,
                    Versions {
                        incarnation: now.incarnation,
                        ..old
                    },
                );
            }
            if back {
                found.broken("S3", snapshot.now_ms, Some(m.id), || {
                    format!("went back from {old:?} to {now:?}")
                });
            }
        }
    }
}

fn versions(v: &Beliefs) -> Versions {
    Versions {
        incarnation: v.incarnation,
        counter: v.counter,
        epoch: v.epoch,
        loop_hash: v.loop_hash,
    }
}

/// What a claim lists that no section of the journal's last life does, as a sentence about
/// the newest. A later one may be durable while a claim waits for its turn on the air.
fn unpromised(said: &Claim, journal: &[Vec<u8>], covered: &CellSet) -> Option<String> {
    let mut newest = None;
    for entry in of_last_life(journal) {
        if let Entry::Claim(claim) = entry {
            let text = unpersisted(said, Some(&claim), covered)?;
            newest.get_or_insert(text);
        }
    }
    newest.or_else(|| unpersisted(said, None, covered))
}

/// Whether a journal holds this bid, promised in the journal's last life. A later one may
/// follow it, while it waits for its turn on the air.
fn promised_bid(journal: &[Vec<u8>], bid: &Bid) -> bool {
    of_last_life(journal).any(|entry| matches!(&entry, Entry::Bid(kept) if kept == bid))
}

/// What a journal's last life wrote, the newest first.
fn of_last_life(journal: &[Vec<u8>]) -> impl Iterator<Item = Entry> {
    let entries = journal.iter().rev().filter_map(|r| Entry::decode(r));
    entries.take_while(|entry| !matches!(entry, Entry::Life(_)))
}

/// A listed cell that no durable section lists at that stamp, as a sentence.
/// A run may bridge cells covered meanwhile: to fly over those is no promise.
fn unpersisted(said: &Claim, durable: Option<&Claim>, covered: &CellSet) -> Option<String> {
    // Runs are cyclic: the same cell may be named with and without a lap.
    let n = covered.capacity().max(1);
    let mut promised: BTreeMap<u16, Stamp> = BTreeMap::new();
    if let Some(d) = durable {
        for l in d.plan.iter().chain(&d.held) {
            for cell in cells_of(l.run, n) {
                let s = promised.entry(cell).or_insert(l.stamp);
                *s = (*s).max(l.stamp);
            }
        }
    }
    for l in &said.plan {
        for cell in cells_of(l.run, n) {
            let bridged = covered.contains(cell);
            if !bridged && promised.get(&cell).is_none_or(|s| *s < l.stamp) {
                return Some(format!(
                    "lists cell {cell} at {:?}, its disk holds {:?}",
                    l.stamp,
                    promised.get(&cell)
                ));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_peer::wire::message::{CellRun, ListedRun};

    fn claim(counter: u32, count: u16) -> Claim {
        Claim {
            plan: vec![ListedRun {
                run: CellRun { first: 3, count },
                backward: false,
                stamp: Stamp {
                    epoch: Epoch { counter, hash: 0 },
                    take: 0,
                    id: 1,
                },
            }],
            ..Claim::default()
        }
    }

    #[test]
    fn a_claim_may_have_waited_for_its_turn_while_a_later_one_became_durable() {
        let open = CellSet::new(20);
        let entry = |c: Claim| Entry::Claim(c).encode();
        let life = Entry::Life(2).encode();
        let journal = [
            entry(claim(9, 9)),
            life,
            entry(claim(4, 5)),
            entry(claim(5, 2)),
        ];
        assert_eq!(unpromised(&claim(4, 5), &journal, &open), None);
        assert_eq!(unpromised(&claim(5, 2), &journal, &open), None);
        assert!(unpromised(&claim(4, 6), &journal, &open).is_some());
        assert!(
            unpromised(&claim(9, 9), &journal, &open).is_some(),
            "an earlier life"
        );
        assert!(unpromised(&claim(4, 5), &journal[..2], &open).is_some());
    }

    #[test]
    fn a_section_may_shrink_but_not_grow_beyond_what_is_durable() {
        let durable = claim(4, 5);
        let open = CellSet::new(20);
        let covered = CellSet::of(20, [8]);
        assert_eq!(unpersisted(&claim(4, 5), Some(&durable), &open), None);
        assert_eq!(unpersisted(&claim(4, 2), Some(&durable), &open), None);
        assert!(unpersisted(&claim(4, 6), Some(&durable), &open).is_some());
        assert_eq!(unpersisted(&claim(4, 6), Some(&durable), &covered), None);
        assert!(unpersisted(&claim(5, 5), Some(&durable), &open).is_some());
        assert!(unpersisted(&claim(4, 1), None, &open).is_some());
    }

    #[test]
    fn a_key_has_one_speaker_whose_numbers_rise() {
        let said = |incarnation, seq, body: &[u8]| Record {
            author: 1,
            incarnation,
            seq,
            kind: 2,
            subject: 0,
            body: body.to_vec(),
            signature: Vec::new(),
        };
        type Case<'a> = (&'a [(u32, u32, u64)], u64);
        let cases: [Case<'_>; 4] = [
            (&[(1, 1, 5), (1, 2, 6), (2, 1, 7)], 0),
            (&[(1, 2, 5), (1, 2, 5)], 0),
            (&[(1, 2, 5), (1, 2, 6)], 1),
            (&[(2, 1, 5), (1, 9, 6)], 1),
        ];
        for (sequence, broken) in cases {
            let (mut c, mut found) = (RecordCheck::default(), Findings::new(1));
            for (life, seq, hash) in sequence {
                c.check_speaker(0, &said(*life, *seq, b"x"), *hash, &mut found);
            }
            assert_eq!(found.counts.get("S4").copied().unwrap_or(0), broken);
        }
    }
}
