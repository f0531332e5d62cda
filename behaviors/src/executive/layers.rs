//! The heights of a volume that is flown in layers (D2.7 §1.2.2, executive layer): whether the
//! UAV is where its layer is seen from, and what it flies until it is.
//!
//! | it is | cells | track |
//! |---|---|---|
//! | within its layer | are seen and flown | as the goal says |
//! | on the way to it | are not seen, whatever is in the picture | for legs: to a circle where they begin |
//! | held up there by others for [`PATIENCE_MS`] | likewise | on along the loop, where others are |
//! | at a height at which another one stays near by | likewise | a circle where it is |
//!
//! Which height comes next is the reactive layer's (`reactive::climb`).

use super::transit::{Move, Place};
use super::{Aim, Executive, Kind, Played};
use crate::percept::Percept;
use crate::reactive::climb::Climb;

/// Who got no higher for so long flies on, milliseconds: whoever circles above it may do so for
/// as long as it flies.
pub const PATIENCE_MS: u64 = 20_000;

/// Where a UAV is on its way to its layer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layered {
    climb: Climb,
    /// Whether it was within its layer at the last percept.
    is_there: bool,
    /// The height at the last percept, metres.
    height_m: f64,
    /// Since when it got no higher or lower, milliseconds.
    stays_since_ms: u64,
    /// Whether it flies on since it was held up.
    is_held_up: bool,
    /// Whether it has to circle where it is, since another one near by stays at its height.
    shares: bool,
}

impl Executive {
    /// The same, flying to its slot in a layer first, and seeing cells from there alone.
    #[must_use]
    pub fn with_layer(mut self, climb: Climb) -> Self {
        self.layered = Some(Layered {
            height_m: self.height_m,
            climb,
            is_there: false,
            stays_since_ms: 0,
            is_held_up: false,
            shares: false,
        });
        self
    }

    /// Whether it is on its way to its layer.
    #[must_use]
    pub fn changes_layer(&self) -> bool {
        self.layered.as_ref().is_some_and(|l| !l.is_there)
    }

    /// To which height it flies now, metres above the origin; on its way to another layer the
    /// next at which it may stay.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        self.height_m
    }

    /// How long it takes to its layer if nobody is in the way, milliseconds.
    pub(super) fn to_layer_ms(&self) -> u32 {
        let left_s = |l: &Layered| l.climb.left_s(l.height_m);
        let left_s = self.layered.as_ref().map_or(0.0, left_s);
        super::prediction::whole_ms((left_s * 1000.0).ceil())
    }

    /// Takes note of its height, and of who is near: where to it may climb.
    pub(super) fn note_height(&mut self, percept: &Percept) {
        let Some(layered) = &mut self.layered else {
            return;
        };
        if !percept.height_m.is_finite() {
            return;
        }
        self.height_m = layered.climb.next_m(percept, self.aim == Aim::Legs);
        let shared = core::mem::replace(&mut layered.shares, layered.climb.shares(percept));
        let moves = (self.height_m - percept.height_m).abs() > 0.1;
        if moves || layered.stays_since_ms == 0 {
            layered.stays_since_ms = percept.time_ms;
        }
        layered.height_m = percept.height_m;
        let was = (layered.is_there, layered.is_held_up);
        // It circles from here on.
        self.replan |= !was.0 && layered.shares && !shared;
        layered.is_there = layered.climb.is_in_layer(percept.height_m);
        let stays_ms = percept.time_ms.saturating_sub(layered.stays_since_ms);
        // Once it flies on it does so until it is there: who circles is met again.
        layered.is_held_up = !layered.is_there && (was.1 || stays_ms >= PATIENCE_MS);
        if was != (layered.is_there, layered.is_held_up) && self.aim == Aim::Legs {
            self.replan = true;
        }
    }

    /// What was flown since the last percept, as far as cells count that were seen on it; `None`
    /// where none count, and `Some(None)` where those of this percept alone do.
    pub(super) fn played_in_layer(&self, percept: &Percept) -> Option<Option<&Played>> {
        let played = self.played.as_ref();
        let Some(layered) = &self.layered else {
            return Some(played);
        };
        let counts = |p: &Percept| layered.climb.is_in_layer(p.height_m);
        counts(percept).then(|| played.filter(|p| counts(&p.percept)))
    }

    /// What is flown until it is at its layer; `None` where it is, or its goal asks for no cells.
    pub(super) fn wait_for_layer(
        &mut self,
        at: &Place,
        is_open: &dyn Fn(u16) -> bool,
    ) -> Option<Vec<Move>> {
        let layered = self.layered.as_ref().filter(|l| !l.is_there)?;
        if !matches!(self.aim, Aim::Legs | Aim::Detour) {
            return None;
        }
        if layered.shares {
            return Some(self.transit.way_to_loiter(at));
        }
        if layered.is_held_up
            && let Some(moves) = self.transit.way_round(at)
        {
            return Some(moves);
        }
        if let Some(Kind::Loiter(circle)) = self.stretches.back().map(|s| s.kind) {
            return Some(vec![Move::Loiter(circle)]);
        }
        let first = self.queue.iter().find(|visit| is_open(visit.cell))?;
        let begins = self.transit.entry(first.cell, first.direction);
        let begins = self.transit.place(begins, first.direction).pose.position();
        let way = self.transit.way_to_wait_at(at, begins);
        Some(way.unwrap_or_else(|| self.transit.way_to_loiter(at)))
    }
}
