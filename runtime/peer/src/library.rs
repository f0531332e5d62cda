//! How a mission comes: in pieces, in any order, over and over; and what is held of those that
//! are not whole yet. Of the next revision of a mission most is as it was before, so what is held
//! fills what has not come.

use crate::mission::Mission;
use crate::wire::limits::{CHUNK_MAX_BYTES, CHUNKS_MAX};
use crate::wire::message::{Lacking, MissionChunk};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most revisions whose pieces are collected at one time; the oldest is forgotten.
pub const MAX_PARTIAL: usize = 4;

/// The mission is too large to be spoken: nothing of it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the mission is too large to be spoken: {bytes} bytes, at most {most} fit")]
pub struct TooLarge {
    bytes: usize,
    most: usize,
}

/// The body of a mission in pieces.
///
/// # Errors
/// [`TooLarge`] where it takes more pieces than may be spoken.
pub fn chunks(mission: &Mission) -> Result<Vec<MissionChunk>, TooLarge> {
    let most = usize::from(CHUNKS_MAX) * CHUNK_MAX_BYTES;
    // Nothing but a want of memory keeps a mission of integers from being encoded.
    let bytes = cbor4ii::serde::to_vec(Vec::new(), mission).map_err(|_| TooLarge {
        bytes: usize::MAX,
        most,
    })?;
    let pieces = bytes.chunks(CHUNK_MAX_BYTES);
    let too_large = TooLarge {
        bytes: bytes.len(),
        most,
    };
    let count = u16::try_from(pieces.len()).map_err(|_| too_large)?;
    if count > CHUNKS_MAX {
        return Err(too_large);
    }
    let content_hash = mission.content_hash();
    let chunk = |piece: &[u8]| MissionChunk {
        revision: mission.revision,
        content_hash,
        chunks: count,
        bytes: piece.to_vec(),
    };
    Ok(pieces.map(chunk).collect())
}

/// The missions a peer holds whole, and the pieces of those it does not.
#[derive(Clone, Debug, Default)]
pub struct Library {
    whole: Option<Arc<Mission>>,
    /// The pieces of that one, once they were asked for.
    held: Option<Vec<MissionChunk>>,
    partial: BTreeMap<(u32, u64), BTreeMap<u16, MissionChunk>>,
    /// Of which mission the last piece was that completed none.
    latest: Option<(u32, u64)>,
}

impl Library {
    /// A library that begins with the mission found on disk, if any.
    #[must_use]
    pub fn new(mission: Option<Arc<Mission>>) -> Self {
        Self {
            whole: mission,
            ..Self::default()
        }
    }

    /// The mission that is newer than the revision followed and is being collected, or held
    /// whole: its revision, its hash, and a bit for each piece that is lacking. Of several that
    /// are collected the one of which the last piece was, so that a made-up one hides none.
    #[must_use]
    pub fn lacking(&self, follows: u32) -> Option<(u32, u64, Vec<u8>)> {
        let latest = self.latest.as_ref();
        let latest = latest.and_then(|key| self.partial.get_key_value(key));
        let partial = latest.or_else(|| self.partial.last_key_value());
        let partial = partial.filter(|(key, _)| key.0 > follows);
        let of = |(key, pieces): (&(u32, u64), &BTreeMap<u16, MissionChunk>)| {
            let count = pieces.values().next().map_or(0, |piece| piece.chunks);
            let bits = Lacking::bits(count, |piece| !pieces.contains_key(&piece));
            (key.0, key.1, bits)
        };
        let whole = || {
            let whole = self.whole.as_ref().filter(|w| w.revision > follows)?;
            Some((whole.revision, whole.content_hash(), Vec::new()))
        };
        partial.map(of).or_else(whole)
    }

    /// The newest whole mission.
    #[must_use]
    pub fn newest(&self) -> Option<Arc<Mission>> {
        self.whole.clone()
    }

    /// Takes a whole mission if it is newer than the one held.
    pub fn offer(&mut self, mission: Arc<Mission>) {
        if self
            .whole
            .as_ref()
            .is_none_or(|w| mission.revision > w.revision)
        {
            self.partial
                .retain(|(revision, _), _| *revision > mission.revision);
            (self.whole, self.held) = (Some(mission), None);
        }
    }

    /// Takes a piece. Returns whether it completed a newer mission.
    ///
    /// # Errors
    /// A sentence when the pieces do not give the mission they claim to be; they
    /// are forgotten, and the mission held stays in force.
    pub fn chunk(&mut self, index: u16, chunk: &MissionChunk) -> Result<bool, String> {
        let known = self.whole.as_ref().map_or(0, |w| w.revision);
        if chunk.revision <= known
            || chunk.chunks == 0
            || chunk.chunks > CHUNKS_MAX
            || index >= chunk.chunks
        {
            return Ok(false);
        }
        let key = (chunk.revision, chunk.content_hash);
        let pieces = self.partial.entry(key).or_default();
        pieces.insert(index, chunk.clone());
        self.latest = Some(key);
        if pieces.len() < usize::from(chunk.chunks) {
            // A piece that is as before completes nothing that the one before it did not.
            let is_new = !self.is_as_before(key, index);
            if let Some(mission) = is_new.then(|| self.filled(key)).flatten() {
                self.take(mission);
                return Ok(true);
            }
            while self.partial.len() > MAX_PARTIAL {
                self.partial.pop_first();
            }
            return Ok(false);
        }
        let bytes: Vec<u8> = pieces
            .values()
            .flat_map(|c| c.bytes.iter().copied())
            .collect();
        self.partial.remove(&key);
        let mission: Mission = cbor4ii::serde::from_slice(&bytes)
            .map_err(|e| format!("mission revision {} cannot be read: {e}", chunk.revision))?;
        if mission.content_hash() != chunk.content_hash || mission.revision != chunk.revision {
            return Err(format!(
                "mission revision {} is not what its hash says",
                chunk.revision
            ));
        }
        self.take(mission);
        Ok(true)
    }

    /// Takes what the pieces gave, and after it whatever it fills: all that is new in a later
    /// revision may have come before the one that has the rest.
    fn take(&mut self, mission: Mission) {
        self.offer(Arc::new(mission));
        let filled = |library: &mut Self| {
            let newest_first: Vec<(u32, u64)> = library.partial.keys().rev().copied().collect();
            newest_first.into_iter().find_map(|key| library.filled(key))
        };
        while let Some(mission) = filled(self) {
            self.offer(Arc::new(mission));
        }
    }

    /// Cuts the mission that is held whole into its pieces, once.
    fn cut_whole(&mut self) {
        let whole = self.whole.as_deref();
        let pieces = || whole.and_then(|w| chunks(w).ok()).unwrap_or_default();
        self.held.get_or_insert_with(pieces);
    }

    /// Whether a piece that came is what the mission held whole has at its place.
    fn is_as_before(&mut self, key: (u32, u64), index: u16) -> bool {
        self.cut_whole();
        let held = self.held.as_ref();
        let before = held.and_then(|held| held.get(usize::from(index)));
        let came = self.partial.get(&key).and_then(|pieces| pieces.get(&index));
        came.map(|piece| &piece.bytes) == before.map(|piece| &piece.bytes)
    }

    /// The mission of which pieces came, where they and, for the others, the pieces of the mission
    /// that is held give what its hash says: most of a revision is as it was before.
    fn filled(&mut self, key: (u32, u64)) -> Option<Mission> {
        self.cut_whole();
        let (pieces, held) = (self.partial.get(&key)?, self.held.as_ref()?);
        let count = pieces.values().next()?.chunks;
        let mut bytes = Vec::new();
        for i in 0..count {
            let piece = pieces.get(&i).or_else(|| held.get(usize::from(i)))?;
            bytes.extend_from_slice(&piece.bytes);
        }
        let mission: Mission = cbor4ii::serde::from_slice(&bytes).ok()?;
        (mission.content_hash() == key.1 && mission.revision == key.0).then_some(mission)
    }
}

/// Of how many pieces the nearer end of a mission is away: what changes from one revision to the
/// next is at its ends, so they go first.
#[must_use]
pub fn pieces_from_end(index: u16, count: u16) -> u16 {
    index.min(count.saturating_sub(1).saturating_sub(index))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mission(revision: u32, vertices: i32) -> Mission {
        Mission {
            area: (0..vertices).map(|i| (i * 1000, i * i)).collect(),
            ..crate::testing::mission(revision, 1, 1)
        }
    }

    #[test]
    fn a_mission_in_pieces_is_put_together_in_any_order() {
        let m = mission(2, 500);
        let pieces = chunks(&m).unwrap();
        assert!(pieces.len() > 2);
        let mut library = Library::new(Some(Arc::new(mission(1, 4))));
        for (i, piece) in pieces.iter().enumerate().rev() {
            let done = library.chunk(u16::try_from(i).unwrap(), piece).unwrap();
            assert_eq!(done, i == 0);
        }
        assert_eq!(*library.newest().unwrap(), m);
    }

    /// What an operator changes in flight is at the ends of a mission: who holds the revision before
    /// needs these pieces alone, in any order.
    #[test]
    fn who_holds_the_revision_before_needs_what_is_new() {
        let before = mission(1, 500);
        let all = |m: &Mission| chunks(m).unwrap();
        let held = all(&before);
        let zone = (0..32).map(|n| (n * 1_000_000, n * n * 1_000)).collect();
        let changed = [
            Mission {
                base: (7, 8),
                ..before.clone()
            },
            Mission {
                cancelled: true,
                ..before.clone()
            },
            Mission {
                lap: 1,
                further_laps: 3,
                ..before.clone()
            },
            Mission {
                added_zones: [("fire".to_owned(), zone)].into(),
                ..before.clone()
            },
        ];
        for next in changed {
            let next = Mission {
                revision: 2,
                ..next
            };
            let pieces = all(&next);
            let new = (0u16..).zip(&pieces).filter(|(i, piece)| {
                held.get(usize::from(*i))
                    .is_none_or(|h| h.bytes != piece.bytes)
            });
            let mut new: Vec<(u16, &MissionChunk)> = new.collect();
            assert!((1..=5).contains(&new.len()) && pieces.len() > 12);
            assert!(new.iter().all(|(i, p)| pieces_from_end(*i, p.chunks) < 3));
            for _ in 0..2 {
                let mut library = Library::new(Some(Arc::new(before.clone())));
                // One that is as before brings nothing.
                assert_eq!(library.chunk(6, &pieces[6]), Ok(false));
                let done = new.iter().map(|(i, piece)| library.chunk(*i, piece));
                assert_eq!(done.filter(|done| *done == Ok(true)).count(), 1);
                assert_eq!(*library.newest().unwrap(), next);
                assert_eq!(library.lacking(1).unwrap().2, Vec::<u8>::new());
                // The one after it is filled with this one.
                let after = Mission {
                    revision: 3,
                    base: (9, 9),
                    ..next.clone()
                };
                let newer = (0u16..).zip(all(&after)).zip(&pieces);
                let newer = newer.filter(|((_, piece), before)| piece.bytes != before.bytes);
                let done = newer.map(|((i, piece), _)| library.chunk(i, &piece));
                assert_eq!(done.filter(|done| *done == Ok(true)).count(), 1);
                assert_eq!(*library.newest().unwrap(), after);
                new.reverse();
            }
            // Who holds another one collects them all.
            let mut other = before.clone();
            other.area.reverse();
            let mut library = Library::new(Some(Arc::new(other)));
            for (i, piece) in &new {
                assert_eq!(library.chunk(*i, piece), Ok(false));
            }
            assert_eq!(library.newest().unwrap().revision, 1);
        }
    }

    /// Who begins anew hears of the mission before and of what is new in any order.
    #[test]
    fn what_is_new_may_come_before_the_revision_that_has_the_rest() {
        let mut library = Library::new(Some(Arc::new(mission(1, 4))));
        let revised = |of: &Mission, east_mm| Mission {
            revision: of.revision + 1,
            base: (east_mm, 0),
            ..of.clone()
        };
        let second = mission(2, 500);
        let third = revised(&second, 7);
        let fourth = revised(&third, 8);
        let [old, newer, newest] = [&second, &third, &fourth].map(|m| chunks(m).unwrap());
        let pieces = || (0u16..).zip(&newest).zip(newer.iter().zip(&old));
        // Of the newest what is new in it, of the one before what is new in that one.
        for ((i, newest), (newer, old)) in pieces() {
            let pairs = [(newest, newer), (newer, old)];
            for (piece, _) in pairs.into_iter().filter(|(p, b)| p.bytes != b.bytes) {
                assert_eq!(library.chunk(i, piece), Ok(false));
            }
        }
        assert_eq!(library.newest().unwrap().revision, 1);
        for ((i, _), (_, old)) in pieces() {
            let is_last = i + 1 == old.chunks;
            assert_eq!(library.chunk(i, old), Ok(is_last));
        }
        assert_eq!(*library.newest().unwrap(), fourth);
        assert!(library.partial.is_empty());
    }

    #[test]
    fn a_forged_piece_is_refused_and_the_old_mission_stays() {
        let m = mission(2, 4);
        let mut pieces = chunks(&m).unwrap();
        pieces[0].content_hash ^= 1;
        let mut library = Library::new(Some(Arc::new(mission(1, 4))));
        assert!(library.chunk(0, &pieces[0]).is_err());
        assert_eq!(library.newest().unwrap().revision, 1);
    }

    #[test]
    fn only_a_newer_mission_replaces_the_one_held() {
        let mut library = Library::new(Some(Arc::new(mission(3, 4))));
        for (revision, held) in [(2, (3, 4)), (3, (3, 4)), (5, (5, 5)), (4, (5, 5))] {
            library.offer(Arc::new(mission(revision, 5)));
            let newest = library.newest().unwrap();
            assert_eq!((newest.revision, newest.area.len()), held);
        }
    }

    #[test]
    fn the_largest_mission_that_can_be_spoken_is_heard_and_a_larger_one_is_not_said() {
        let pieces = |vertices: i32| chunks(&mission(2, vertices)).map(|p| p.len());
        let (mut fits, mut too_large) = (100_i32, 40_000);
        while too_large - fits > 1 {
            let tried = fits.midpoint(too_large);
            match pieces(tried) {
                Ok(_) => fits = tried,
                Err(_) => too_large = tried,
            }
        }
        assert_eq!(pieces(fits), Ok(usize::from(CHUNKS_MAX)));
        let why = pieces(too_large).unwrap_err();
        assert!(why.bytes > 65_536 && why.bytes < 65_600, "{why}");
        assert!(why.to_string().ends_with("at most 65536 fit"), "{why}");
        let m = mission(2, fits);
        let mut library = Library::new(None);
        for (i, piece) in (0u16..).zip(&chunks(&m).unwrap()) {
            assert_eq!(library.chunk(i, piece), Ok(i + 1 == CHUNKS_MAX));
        }
        assert_eq!(*library.newest().unwrap(), m);
    }

    #[test]
    fn pieces_that_belong_to_no_mission_are_not_kept() {
        let piece = chunks(&mission(7, 500)).unwrap().remove(0);
        assert!(piece.chunks > 2);
        let mut library = Library::new(Some(Arc::new(mission(6, 4))));
        let of = |revision, chunks| MissionChunk {
            revision,
            chunks,
            ..piece.clone()
        };
        for (index, piece) in [
            (0, of(6, 3)),
            (0, of(7, 0)),
            (0, of(7, CHUNKS_MAX + 1)),
            (3, of(7, 3)),
        ] {
            assert_eq!(library.chunk(index, &piece), Ok(false));
            assert!(library.partial.is_empty(), "{index} {piece:?}");
        }
        // Of unfinished missions those of the newest revisions are kept.
        for revision in 7..20 {
            assert_eq!(library.chunk(0, &of(revision, 3)), Ok(false));
        }
        let kept: Vec<u32> = library.partial.keys().map(|k| k.0).collect();
        assert_eq!(kept, [16, 17, 18, 19]);
        library.offer(Arc::new(mission(17, 4)));
        let kept: Vec<u32> = library.partial.keys().map(|k| k.0).collect();
        assert_eq!(
            kept,
            [18, 19],
            "what is older than a whole one is forgotten"
        );
    }
}
