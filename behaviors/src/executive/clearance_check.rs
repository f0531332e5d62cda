//! The certificate of every stretch that is put on a track (D2.7 §2.3.1).
//!
//! Cells, routes, turns, trochoids as the arcs that stand for them, and loiters: each is
//! measured exactly against the zones as they are, and must keep the tracking margin
//! from them, so that a UAV which strays by that much is still outside. Whoever is
//! nearer already, blown there or lost, must come no nearer on its way out. A given flight
//! must keep the whole clearance: nearer the envelope would stop it. A stretch
//! without proof is not flown: its cell is refused, its route is replaced by the circle
//! here that keeps farthest.

use super::Event;
use super::circle::halves;
use super::transit::{ESCAPE_SLACK_M, Move, Place, Transit};
use skein_geometry::Segment;
use skein_geometry::frame::Pose;

/// A given flight may come this much nearer than the clearance, metres: whoever planned it
/// rounded, too.
const GIVEN_SLACK_M: f64 = 1e-3;

impl Transit {
    /// Distance from the zones that a stretch beginning at a pose must keep, metres.
    #[must_use]
    pub fn margin_m(&self, from: &Pose) -> f64 {
        let here_m = self.router.zones().distance_m(from.position()) - ESCAPE_SLACK_M;
        self.tracking_error_m.min(here_m.max(0.0))
    }

    /// Distance from the zones that a given flight must keep, metres.
    fn given_margin_m(&self) -> f64 {
        let clearance_m = self.router.limits().clearance_m - GIVEN_SLACK_M;
        clearance_m.max(self.tracking_error_m)
    }

    /// Whether a move that begins at a place is proved to keep the margin.
    #[must_use]
    pub fn is_cleared(&self, from: &Place, step: &Move) -> bool {
        let (zones, margin_m) = (self.router.zones(), self.margin_m(&from.pose));
        let c = &self.coverage_loop;
        match step {
            Move::Serve(visit) => {
                zones.is_clear(&c.curve(usize::from(visit.cell), visit.direction), margin_m)
            }
            Move::Pass(cell, d) => zones.is_clear(&c.curve(usize::from(*cell), *d), margin_m),
            Move::Route(curve) | Move::Rest(_, curve) => zones.is_clear(curve, margin_m),
            Move::Piece(piece, _) => zones.is_segment_clear(piece, self.given_margin_m()),
            Move::Loiter(circle) => zones.is_clear(&halves(circle), margin_m),
        }
    }

    /// Whether a circle keeps off the zones by what its flight may stray, twice: one that is
    /// flown for as long as it takes.
    #[must_use]
    pub fn has_room_for(&self, circle: &Segment) -> bool {
        let zones = self.router.zones();
        zones.is_clear(&halves(circle), 2.0 * self.tracking_error_m)
    }

    /// Of moves that follow each other from a place, what may be flown. Where one lacks
    /// its proof, the cell they lead to is refused; without a cell it is held instead.
    pub(super) fn cleared(
        &self,
        at: &Place,
        moves: Vec<Move>,
        events: &mut Vec<Event>,
    ) -> Vec<Move> {
        let mut place = *at;
        let all = moves.iter().all(|step| {
            let cleared = self.is_cleared(&place, step);
            place = self.end_of(&place, step);
            cleared
        });
        if all {
            return moves;
        }
        let cells: Vec<u16> = moves
            .iter()
            .filter_map(|step| Some(step.serves()?.cell))
            .collect();
        if cells.is_empty() {
            return vec![self.stay(at)];
        }
        events.push(Event::Refused { cells });
        Vec::new()
    }
}
