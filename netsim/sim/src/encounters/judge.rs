//! The nearest approach of all pairs, in continuous time.

use skein_geometry::frame::Point;
use skein_peer::PeerId;
use std::collections::{BTreeMap, BTreeSet};

/// Measures from places alone. Between two looks relative motion counts as straight: a turn
/// of 0.6 g bends it by 2 mm in 50 ms.
pub(super) struct Judge {
    least_m: f64,
    nearest_m: f64,
    losses: u32,
    within: BTreeSet<(PeerId, PeerId)>,
    before: BTreeMap<PeerId, Point>,
}

impl Judge {
    pub(super) fn new(least_m: f64) -> Self {
        Self {
            least_m,
            nearest_m: f64::INFINITY,
            losses: 0,
            within: BTreeSet::new(),
            before: BTreeMap::new(),
        }
    }

    /// Where everybody who flies is now.
    pub(super) fn observe(&mut self, flying: impl Iterator<Item = (PeerId, Point)>) {
        let now: BTreeMap<PeerId, Point> = flying.collect();
        for (a, a_now) in &now {
            for (b, b_now) in now.range(PeerId(a.0.saturating_add(1))..) {
                let apart = b_now - a_now;
                let was = match (self.before.get(a), self.before.get(b)) {
                    (Some(a_was), Some(b_was)) => b_was - a_was,
                    _ => apart,
                };
                let moved = apart - was;
                let share = (-was.dot(&moved) / moved.norm_squared().max(f64::MIN_POSITIVE))
                    .clamp(0.0, 1.0);
                let nearest_m = (was + moved * share).norm();
                self.nearest_m = self.nearest_m.min(nearest_m);
                if nearest_m < self.least_m && self.within.insert((*a, *b)) {
                    self.losses += 1;
                }
                if apart.norm() >= self.least_m {
                    self.within.remove(&(*a, *b));
                }
            }
        }
        self.before = now;
    }

    pub(super) fn losses(&self) -> u32 {
        self.losses
    }

    pub(super) fn nearest_m(&self) -> f64 {
        self.nearest_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_that_cross_between_two_looks_are_found() {
        let mut judge = Judge::new(50.0);
        let looks = [(-60.0, 60.0), (60.0, -60.0), (-60.0, 60.0)];
        for (a, b) in looks {
            let places = [
                (PeerId(1), Point::new(a, 0.0)),
                (PeerId(2), Point::new(b, 10.0)),
            ];
            judge.observe(places.into_iter());
        }
        assert!((judge.nearest_m() - 10.0).abs() < 1e-9);
        assert_eq!(judge.losses(), 2, "they parted in between");
    }
}
