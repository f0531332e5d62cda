//! What is known of each track beside it, from look to look, though names change.

use skein_flight::tracking::tracks::{TargetName, Track, Tracks};
use std::collections::BTreeMap;

/// What was known of a track, under its name or the one that it had; `begun_ms` says when that
/// track began.
pub(crate) fn carried<T>(
    before: &mut BTreeMap<TargetName, T>,
    begun_ms: fn(&T) -> u64,
    tracks: &Tracks,
    t: &Track,
) -> Option<T> {
    let known = before.remove(&t.name);
    known.or_else(|| renamed(before, begun_ms, tracks, t))
}

/// What was known of it alone: whoever was given the name of one that was lost may be another,
/// and where that one was says nothing of how this one moves.
pub(crate) fn carried_alone<T>(
    before: &mut BTreeMap<TargetName, T>,
    begun_ms: fn(&T) -> u64,
    tracks: &Tracks,
    t: &Track,
) -> Option<T> {
    let known = before.remove(&t.name);
    let own = known.filter(|known| begun_ms(known) == t.begun_ms());
    own.or_else(|| renamed(before, begun_ms, tracks, t))
}

/// What was known of it under a name that nobody has any more.
fn renamed<T>(
    before: &mut BTreeMap<TargetName, T>,
    begun_ms: fn(&T) -> u64,
    tracks: &Tracks,
    t: &Track,
) -> Option<T> {
    let gone = |name: &TargetName| !tracks.all().iter().any(|t| t.name == *name);
    let mut same = before.iter().filter(|(_, a)| begun_ms(a) == t.begun_ms());
    let name = same.find(|(name, _)| gone(name)).map(|(name, _)| *name)?;
    before.remove(&name)
}
