//! A flight between two cells of a plan, and what it is for (D2.7 §1.2.3, §3.2): the UAV
//! finishes the cell that it is in, flies what it was given, and goes on with its legs.
//!
//! What has to be seen on the way is watched until somebody says otherwise, wherever the
//! UAV flies meanwhile.

use super::camera::look;
use super::transit::CellVisit;
use super::{Executive, Kind};
use crate::event::Event;
use crate::percept::Percept;
use skein_flight::coverage::ring::patch::Corners;
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

/// Pieces that are looked for besides the cells of the loop.
#[derive(Clone, Debug)]
pub struct Watched {
    /// The corners of each.
    pub pieces: Arc<[Corners]>,
    /// Of them those that were seen, by index.
    pub seen: BTreeSet<u16>,
}

impl Watched {
    /// Nothing of these pieces was seen yet.
    #[must_use]
    pub fn new(pieces: Arc<[Corners]>) -> Self {
        Self {
            pieces,
            seen: BTreeSet::new(),
        }
    }
}

impl Executive {
    /// From now on looks for these pieces, or for none.
    pub fn watch(&mut self, watched: Option<Watched>) {
        self.watched = watched;
    }

    /// What is looked for.
    #[must_use]
    pub fn watched(&self) -> Option<&Watched> {
        self.watched.as_ref()
    }

    /// Reports pieces of what is watched that the camera saw since the last percept.
    pub(super) fn report_sighted(&mut self, percept: &Percept, events: &mut Vec<Event>) {
        let Some(watched) = &mut self.watched else {
            return;
        };
        let (airframe, played) = (&self.transit.airframe, self.played.as_ref());
        let known = &watched.seen;
        let is_open = |piece: u16| !known.contains(&piece);
        let mut seen = Vec::new();
        look(
            &*watched.pieces,
            airframe,
            played,
            percept,
            &is_open,
            &mut seen,
        );
        if seen.is_empty() {
            return;
        }
        watched.seen.extend(seen);
        let count = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
        events.push(Event::Sighted {
            seen: count(watched.seen.len()),
            of: count(watched.pieces.len()),
        });
    }

    /// How many stretches stay when a detour and then `visits` become the plan, and which
    /// visits then wait. `same` says that the detour is the one that is being flown.
    pub(super) fn detoured(
        &self,
        same: bool,
        mut visits: VecDeque<CellVisit>,
        is_open: &dyn Fn(u16) -> bool,
    ) -> (usize, VecDeque<CellVisit>) {
        visits.retain(|visit| is_open(visit.cell));
        if self.replan {
            return (0, visits);
        }
        let is_piece = |kind: &Kind| matches!(kind, Kind::Piece { .. });
        let last_piece = self.stretches.iter().rposition(|s| is_piece(&s.kind));
        let last_piece = last_piece.filter(|_| same);
        let kept = match last_piece {
            Some(last) => last + 1,
            None if same && !self.is_given_waiting() => return self.continued(visits, is_open),
            // The cell that the UAV is in is finished first.
            None => usize::from(
                self.stretches
                    .front()
                    .is_some_and(|s| s.kind.cell().is_some()),
            ),
        };
        let before = self.stretches.iter().take(kept);
        let served: BTreeSet<u16> = before
            .filter_map(|s| s.kind.visit().map(|v| v.cell))
            .collect();
        visits.retain(|visit| !served.contains(&visit.cell));
        if last_piece.is_some() {
            return (self.matching(kept, &mut visits), visits);
        }
        (kept, visits)
    }
}

#[cfg(test)]
mod tests;
