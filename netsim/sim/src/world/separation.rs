//! How near UAVs come to each other (D2.7 §2.3.1).

use super::fact::{Approach, Fact};
use super::obstacles::Place;
use std::collections::BTreeMap;

/// Approaches so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Separation {
    closest: Option<Approach>,
    too_close: BTreeMap<(u16, u16), bool>,
}

impl Separation {
    /// The closest approach so far.
    pub(super) fn closest(&self) -> Option<Approach> {
        self.closest
    }

    /// Compares all airborne UAVs at one moment; `limit_m` is the separation below
    /// which an approach becomes a fact, once until the two part again.
    pub(super) fn observe(
        &mut self,
        at_ms: u64,
        airborne: &[(u16, Place)],
        limit_m: f64,
        facts: &mut Vec<Fact>,
    ) {
        let closest_m = self.closest.map_or(f64::INFINITY, |c| c.distance_m);
        // Those who came too close are asked whether they have parted.
        let reach_m = if self.too_close.is_empty() {
            closest_m.max(limit_m)
        } else {
            f64::INFINITY
        };
        for (i, j) in pairs_within(airborne, reach_m) {
            let ((a, pa), (b, pb)) = (&airborne[i], &airborne[j]);
            let approach = Approach {
                at_ms,
                a: *a,
                b: *b,
                distance_m: pa.distance_m(pb),
            };
            if self
                .closest
                .is_none_or(|c| approach.distance_m < c.distance_m)
            {
                self.closest = Some(approach);
            }
            if approach.distance_m < limit_m {
                let was = self.too_close.insert((*a, *b), true);
                if was != Some(true) {
                    facts.push(Fact::TooClose(approach));
                }
            } else if !self.too_close.is_empty() {
                self.too_close.remove(&(*a, *b));
            }
        }
    }
}

/// The pairs that are at most so far apart from west to east, in order.
fn pairs_within(airborne: &[(u16, Place)], reach_m: f64) -> Vec<(usize, usize)> {
    let east_m = |i: &usize| airborne[*i].1.at.x;
    let mut by_east: Vec<usize> = (0..airborne.len()).collect();
    by_east.sort_unstable_by(|i, j| east_m(i).total_cmp(&east_m(j)));
    let mut pairs = Vec::new();
    for (k, i) in by_east.iter().enumerate() {
        let near = by_east[k + 1..].iter();
        let near = near.take_while(|j| east_m(j) - east_m(i) <= reach_m);
        pairs.extend(near.map(|j| (*i.min(j), *i.max(j))));
    }
    pairs.sort_unstable();
    pairs
}
