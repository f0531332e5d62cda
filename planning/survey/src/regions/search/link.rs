//! Other links in place of a hop (D2.7 §3.6): what lies between is flown the other way
//! round, or two UAVs exchange what they fly after it.

use super::super::map::Cell;
use super::super::map::NOWHERE;
use super::{IDLE_REVERSAL, Search, Spot, TOO_LONG};

/// One try in so many to exchange tails is made: most cost a count of both for nothing.
const TAILS: usize = 8;

impl Search<'_> {
    /// Replaces the hop between `a` and `b` by a link from one of them to a neighbour `x`
    /// in the same order, and flies what lies between the other way round.
    pub(super) fn try_reversal(&mut self, spot: Spot) {
        let uav = spot.uav;
        let (a, b) = (self.before(spot), self.after(spot));
        let from_a =
            b == NOWHERE || spot.index == self.orders[uav].len() || self.random.bits() & 1 == 0;
        let Some(x) = self.random_near(if from_a { a } else { b }) else {
            return;
        };
        let (owner, at) = self.at[x as usize];
        if owner as usize != uav {
            if self.random.below(TAILS) == 0 {
                self.try_tails(spot, x, from_a);
            }
            return;
        }
        // The other spot whose link is cut: after x when x joins a, before x otherwise.
        let other = Spot {
            uav,
            index: at as usize + usize::from(from_a),
        };
        if other.index == spot.index {
            return;
        }
        let (p, q) = (self.before(other), self.after(other));
        let (low, high) = (spot.index.min(other.index), spot.index.max(other.index));
        if self.task.closed && high > self.orders[uav].len() {
            return;
        }
        let old = i64::from(self.exact(a, b)) + i64::from(self.exact(p, q));
        let allowed = self.allowance();
        let least = self.least(a, p) + self.least(b, q);
        if self.change(uav, least - old) > allowed {
            return;
        }
        let new = self.fresh(a, p, old) + self.fresh(b, q, old);
        let delta = i64::from(new) - old;
        if self.change(uav, delta) > allowed || (delta >= 0 && high - low > IDLE_REVERSAL) {
            return;
        }
        self.orders[uav][low..high].reverse();
        self.index(uav, low, high);
        self.moves[uav] += delta;
        self.list_ends(uav, low, high);
    }

    /// Two UAVs exchange what they fly after the hop and after (or from) `x`.
    fn try_tails(&mut self, spot: Spot, x: Cell, from_a: bool) {
        let uav = spot.uav;
        let (other, at) = self.at[x as usize];
        let other = Spot {
            uav: other as usize,
            index: at as usize + usize::from(!from_a),
        };
        let (a, b) = (self.before(spot), self.after(spot));
        let (p, q) = (self.before(other), self.after(other));
        let (mine, theirs) = (
            self.orders[uav].len() - spot.index,
            self.orders[other.uav].len() - other.index,
        );
        // Only tails of about the same length can pay; their exact lengths cost a count.
        if self.task.closed || mine.abs_diff(theirs) > 40 || mine + theirs > 4 * IDLE_REVERSAL {
            return;
        }
        let (old, old_other) = (self.exact(a, b), self.exact(p, q));
        let both = i64::from(old) + i64::from(old_other);
        let (link_a, link_b) = (self.fresh(a, q, both), self.fresh(p, b, both));
        if link_a + link_b >= TOO_LONG {
            return;
        }
        let (tail, other_tail) = (self.tail(spot), self.tail(other));
        let delta = i64::from(link_a) + other_tail - i64::from(old) - tail;
        let delta_other = i64::from(link_b) + tail - i64::from(old_other) - other_tail;
        let allowed = self.allowance();
        if self.change(uav, delta) + self.change(other.uav, delta_other) > allowed {
            return;
        }
        let tail = self.orders[uav].split_off(spot.index);
        let other_tail = self.orders[other.uav].split_off(other.index);
        self.orders[uav].extend(other_tail);
        self.orders[other.uav].extend(tail);
        self.moves[uav] += delta;
        self.moves[other.uav] += delta_other;
        for s in [spot, other] {
            let len = self.orders[s.uav].len();
            self.index(s.uav, s.index, len);
            self.list_ends(s.uav, s.index, len);
            for i in s.index..len {
                self.list_border(self.orders[s.uav][i]);
            }
        }
    }

    /// Moves after the first cell after a spot.
    fn tail(&mut self, spot: Spot) -> i64 {
        let mut moves = 0;
        for i in spot.index + 1..self.orders[spot.uav].len() {
            let (a, b) = (self.orders[spot.uav][i - 1], self.orders[spot.uav][i]);
            moves += i64::from(self.exact(a, b));
        }
        moves
    }
}
