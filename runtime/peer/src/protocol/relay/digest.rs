//! Which versions of an author's records are held, in sixteen bits.
//!
//! | bits | what |
//! |---|---|
//! | 0..4 | the number of its state |
//! | 4..7 | that of its claim |
//! | 7..9 | that of its bid |
//! | 9..16 | a hash of all numbers and of that of the beacon that tells it |
//!
//! The last bits of a number tell neighbouring versions apart for certain, so two digests
//! tell of which kinds the versions differ, and only these are said again: a lost state,
//! which people read, does not bring back the claims and the bids of its author. What the hash of
//! one beacon does not tell apart that of the next one does.

use crate::wire::kinds::Kind;
use skein_geometry::hash::Fnv;

/// Of which kinds the last bits are told: kind, lowest bit, how many bits.
const TOLD: [(Kind, u32, u32); 3] = [(Kind::State, 0, 4), (Kind::Claim, 4, 3), (Kind::Bid, 7, 2)];

/// What is not told by kind is hashed, from this bit on.
const HASH_FROM: u32 = 9;

fn mask(bits: u32) -> u16 {
    (1 << bits) - 1
}

/// The digest of records `(number of the kind, subject, seq)`, in ascending order, as the beacon
/// of this number tells it.
pub(super) fn of(versions: impl Iterator<Item = (u8, u16, u32)>, beacon: u32) -> u16 {
    let mut hash = Fnv::new();
    hash.write(&beacon.to_le_bytes());
    let mut digest = 0;
    for (kind, subject, seq) in versions {
        hash.write(&[kind]);
        hash.write(&subject.to_le_bytes());
        hash.write(&seq.to_le_bytes());
        let [low, high, ..] = seq.to_le_bytes();
        for (_, from, bits) in TOLD.into_iter().filter(|(k, ..)| k.number() == kind) {
            digest ^= (u16::from_le_bytes([low, high]) & mask(bits)) << from;
        }
    }
    let parts = hash.finish().to_le_bytes();
    let folded = parts
        .chunks(2)
        .fold(0, |a, part| a ^ u16::from_le_bytes([part[0], part[1]]));
    digest ^ (folded << HASH_FROM)
}

/// Whether digests tell of this kind by itself whether its versions differ.
pub(super) fn is_told(kind: Kind) -> bool {
    TOLD.iter().any(|(k, ..)| *k == kind)
}

/// Whether two digests may be of different versions of a kind. Where they differ and no kind
/// is told to, any may.
pub(super) fn differs(kind: Kind, mine: u16, theirs: u16) -> bool {
    let differing = mine ^ theirs;
    let told = differing & mask(HASH_FROM);
    let of_kind = TOLD.iter().find(|(k, ..)| *k == kind);
    match of_kind {
        Some((_, from, bits)) if told != 0 => told & (mask(*bits) << from) != 0,
        // Kinds of which the hash alone tells: it differs also where those that are told do.
        _ => differing != 0,
    }
}
