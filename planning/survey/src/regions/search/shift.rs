//! A few cells move to another place (D2.7 §3.6): into a hop, away from one, or across the
//! border between two UAVs.

use super::super::map::{Cell, NOWHERE};
use super::{IDLE_REVERSAL, Search, Spot};

/// Cells moved together at most.
const SEGMENT: usize = 4;

impl Search<'_> {
    /// Fills a hop with a few cells from elsewhere that begin beside it.
    pub(super) fn try_fill(&mut self, spot: Spot) {
        let (a, b) = (self.before(spot), self.after(spot));
        let beside = if b == NOWHERE || self.random.bits() & 1 == 0 {
            a
        } else {
            b
        };
        let Some(x) = self.random_near(beside) else {
            return;
        };
        let (uav, at) = self.at[x as usize];
        let len = 1 + self.random.below(SEGMENT);
        let ahead = self.random.bits() & 1 == 0;
        let at = at as usize;
        let low = if ahead {
            at
        } else {
            (at + 1).saturating_sub(len)
        };
        self.try_shift(uav as usize, low, len, spot);
    }

    /// Moves a few cells beside a hop to elsewhere.
    pub(super) fn try_move_from(&mut self, spot: Spot) {
        let len = 1 + self.random.below(SEGMENT);
        let low = if self.random.bits() & 1 == 0 {
            spot.index
        } else {
            spot.index.saturating_sub(len)
        };
        self.try_segment(spot.uav, low, len);
    }

    /// Moves a few cells at a border from the later UAV to the earlier one.
    pub(super) fn try_border(&mut self) {
        if self.borders.is_empty() {
            return;
        }
        let pick = self.random.below(self.borders.len());
        let cell = self.borders[pick];
        let first = self.random.below(4);
        let around = self.task.map.around(cell);
        let own = self.at[cell as usize].0;
        let other = (0..4)
            .map(|i| around[(first + i) % 4])
            .find(|near| self.task.map.is_free(*near) && self.at[*near as usize].0 != own);
        let Some(near) = other else {
            self.bordering[cell as usize] = false;
            self.borders.swap_remove(pick);
            return;
        };
        let (one, two) = (self.urgency(cell), self.urgency(near));
        let (x, near) = if one >= two {
            (cell, near)
        } else {
            (near, cell)
        };
        let (uav, low) = self.at[x as usize];
        let low = low as usize;
        let len = 1 + self.random.below(SEGMENT);
        let low = if self.random.bits() & 1 == 0 {
            low
        } else {
            (low + 1).saturating_sub(len)
        };
        self.try_beside(uav as usize, low, len, near);
    }

    /// How much the UAV that flies a cell wants to get rid of cells: a time, and first of
    /// all what is beyond its endurance.
    fn urgency(&self, cell: Cell) -> (i64, i64) {
        let uav = self.at[cell as usize].0 as usize;
        let over = self.moves[uav] - i64::from(self.task.endurance[uav]);
        (over.max(0), self.moves[uav] * self.pace[uav])
    }

    /// Moves cells `low..low + len` of an order beside a neighbour of one of their ends.
    fn try_segment(&mut self, uav: usize, low: usize, len: usize) {
        let high = (low + len).min(self.orders[uav].len());
        if low >= high {
            return;
        }
        let end = if self.random.bits() & 1 == 0 {
            low
        } else {
            high - 1
        };
        let Some(near) = self.random_near(self.orders[uav][end]) else {
            return;
        };
        self.try_beside(uav, low, len, near);
    }

    fn try_beside(&mut self, uav: usize, low: usize, len: usize, near: Cell) {
        let (owner, at) = self.at[near as usize];
        let index = at as usize + usize::from(self.random.bits() & 1 == 0);
        self.try_shift(
            uav,
            low,
            len,
            Spot {
                uav: owner as usize,
                index,
            },
        );
    }

    /// Moves cells `low..low + len` of an order to a spot outside them, whichever way
    /// round is shorter.
    fn try_shift(&mut self, uav: usize, low: usize, len: usize, to: Spot) {
        let high = (low + len).min(self.orders[uav].len());
        if low >= high || (to.uav == uav && to.index >= low && to.index <= high) {
            return;
        }
        if self.task.closed && to.index > self.orders[to.uav].len() {
            return;
        }
        let (first, last) = (self.orders[uav][low], self.orders[uav][high - 1]);
        let (p, n) = (
            self.before(Spot { uav, index: low }),
            self.after(Spot { uav, index: high }),
        );
        let (a, b) = (self.before(to), self.after(to));
        let allowed = self.allowance();
        let inside = self.inside(uav, low, high);
        let opened = i64::from(self.exact(a, b));
        let taken = i64::from(self.exact(p, first)) + i64::from(self.exact(last, n)) + inside;
        let (joined, turned) = (
            self.least(a, first) + self.least(last, b),
            self.least(a, last) + self.least(first, b),
        );
        // What it would come to if nothing were in the way: most trials end here.
        let added = joined.min(turned) + inside - opened;
        if self.both(uav, self.least(p, n) - taken, to.uav, added) > allowed {
            return;
        }
        let old = taken + opened;
        let kept = i64::from(self.fresh(p, n, old)) - taken;
        let joined = i64::from(self.fresh(a, first, old)) + i64::from(self.fresh(last, b, old));
        let turned = i64::from(self.fresh(a, last, old)) + i64::from(self.fresh(first, b, old));
        let added = joined.min(turned) + inside - opened;
        if self.both(uav, kept, to.uav, added) > allowed
            || (to.uav == uav && to.index.abs_diff(low) > 2 * IDLE_REVERSAL)
        {
            return;
        }
        self.moves[uav] += kept;
        self.moves[to.uav] += added;
        self.shift(uav, low, high, to, turned < joined);
    }

    fn inside(&mut self, uav: usize, low: usize, high: usize) -> i64 {
        let mut moves = 0;
        for i in low + 1..high {
            let (a, b) = (self.orders[uav][i - 1], self.orders[uav][i]);
            moves += i64::from(self.exact(a, b));
        }
        moves
    }

    fn shift(&mut self, uav: usize, low: usize, high: usize, to: Spot, turned: bool) {
        let len = high - low;
        if turned {
            self.orders[uav][low..high].reverse();
        }
        if to.uav == uav {
            let index = if to.index > low {
                self.orders[uav][low..to.index].rotate_left(len);
                self.index(uav, low, to.index);
                to.index - len
            } else {
                self.orders[uav][to.index..high].rotate_right(len);
                self.index(uav, to.index, high);
                to.index
            };
            self.list_ends(uav, index, index + len);
            let gap = if to.index > low { low } else { high };
            self.list_ends(uav, gap, gap);
            return;
        }
        let mut cells = [NOWHERE; SEGMENT];
        cells[..len].copy_from_slice(&self.orders[uav][low..high]);
        self.orders[uav].drain(low..high);
        let from_len = self.orders[uav].len();
        self.index(uav, low, from_len);
        self.orders[to.uav].splice(to.index..to.index, cells[..len].iter().copied());
        let to_len = self.orders[to.uav].len();
        self.index(to.uav, to.index, to_len);
        self.list_ends(uav, low, low);
        self.list_ends(to.uav, to.index, to.index + len);
        for cell in &cells[..len] {
            self.list_border(*cell);
        }
    }
}
