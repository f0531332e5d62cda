//! Repair of a closed loop: cells that it leaves out are shifted along it until two of
//! them meet (D2.7 §3.6.2): two neighbours beside the loop join it for nothing, where a single cell
//! costs a step aside and back.
//!
//! A loop on a grid passes as many cells of one colour of the chessboard as of the other,
//! so a cell left out can only leave with one of the other colour. Where it lies is free:
//! a loop that turns round it can pass it instead of the cell at the corner, and a bump
//! of two cells can be taken back and laid over it. Each such shift keeps the loop closed.
//!
//! Left to others: the loop ([`super::spanning`]), and the cells that find no other.

use super::map::{Cell, LaneMap, NOWHERE};

/// Places that one cell is shifted to before it is given up: most that find another do so
/// within twenty, and a search costs a few microseconds.
const PLACES: usize = 96;

/// Rounds over all cells that are left out: each pair that goes makes room for others.
const ROUNDS: usize = 2;

/// Loops that are mended.
pub(super) struct Mender<'a, F: Fn(Cell, Cell) -> bool> {
    map: &'a LaneMap,
    /// Whether two neighbours belong to the same region.
    same: F,
    next: &'a mut [Cell],
    prev: Vec<Cell>,
    /// What each change replaced: a cell, what came after it and what before.
    log: Vec<(Cell, Cell, Cell)>,
    /// By cell: the last search that shifted a cell there.
    seen: Vec<u32>,
    search: u32,
    left: usize,
}

impl<'a, F: Fn(Cell, Cell) -> bool> Mender<'a, F> {
    pub(super) fn new(map: &'a LaneMap, same: F, next: &'a mut [Cell]) -> Self {
        let mut prev = vec![NOWHERE; next.len()];
        for (cell, to) in (0u32..).zip(next.iter()) {
            if *to != NOWHERE {
                prev[*to as usize] = cell;
            }
        }
        Self {
            map,
            same,
            seen: vec![0; next.len()],
            next,
            prev,
            log: Vec::new(),
            search: 0,
            left: 0,
        }
    }

    /// Brings cells that are left out together, as far as that is found.
    pub(super) fn mend(&mut self, cells: &[Cell]) {
        for _ in 0..ROUNDS {
            let mut any = false;
            for &cell in cells {
                if self.is_out(cell) {
                    any |= self.shift_away(cell);
                }
            }
            if !any {
                break;
            }
        }
    }

    fn shift_away(&mut self, cell: Cell) -> bool {
        self.search += 1;
        self.left = PLACES;
        self.log.clear();
        self.seen[cell as usize] = self.search;
        self.settle(cell)
    }

    fn is_out(&self, cell: Cell) -> bool {
        self.map.is_free(cell) && self.next[cell as usize] == NOWHERE
    }

    fn linked(&self, a: Cell, b: Cell) -> bool {
        self.map.is_free(b) && (self.same)(a, b)
    }

    /// Finds another for a cell that is left out, by shifting it if need be.
    fn settle(&mut self, out: Cell) -> bool {
        if self.join_with_any(out) {
            return true;
        }
        for u in self.map.around(out) {
            if !self.linked(out, u) || self.next[u as usize] == NOWHERE {
                continue;
            }
            let mark = self.log.len();
            for way in 0..3 {
                let Some(now_out) = self.shift(out, u, way) else {
                    continue;
                };
                if self.seen[now_out as usize] != self.search && self.left > 0 {
                    self.seen[now_out as usize] = self.search;
                    self.left -= 1;
                    if self.settle(now_out) {
                        return true;
                    }
                }
                self.undo(mark);
            }
        }
        false
    }

    /// Shifts a cell that is left out by way of its neighbour `u` on the loop; says which
    /// cell is left out then.
    fn shift(&mut self, out: Cell, u: Cell, way: usize) -> Option<Cell> {
        if way == 0 {
            return self.cut_corner(out, u);
        }
        // A bump of `u` and the one after it, or before it.
        let other = if way == 1 {
            self.next[u as usize]
        } else {
            self.prev[u as usize]
        };
        let (x, y) = if way == 1 { (u, other) } else { (other, u) };
        let (a, b) = (self.prev[x as usize], self.next[y as usize]);
        if !self.map.adjacent(a, b) || a == y || b == x || !self.linked(a, b) {
            return None;
        }
        let mark = self.log.len();
        self.link(a, b);
        self.drop(x);
        self.drop(y);
        if self.join(out, u) {
            return Some(other);
        }
        self.undo(mark);
        None
    }

    /// The loop goes from `u` over `out` instead of the next cell.
    fn cut_corner(&mut self, out: Cell, u: Cell) -> Option<Cell> {
        let corner = self.next[u as usize];
        let to = self.next[corner as usize];
        if to == u || !self.map.adjacent(out, to) || !self.linked(out, to) {
            return None;
        }
        if !self.map.adjacent(u, corner) || !self.map.adjacent(corner, to) {
            return None;
        }
        self.drop(corner);
        self.link(u, out);
        self.link(out, to);
        Some(corner)
    }

    fn join_with_any(&mut self, x: Cell) -> bool {
        let around = self.map.around(x);
        around
            .into_iter()
            .any(|y| self.is_out(y) && self.linked(x, y) && self.join(x, y))
    }

    /// Lays the loop over two neighbours that are left out, from an edge beside them.
    fn join(&mut self, x: Cell, y: Cell) -> bool {
        let across = if x.abs_diff(y) == 1 {
            self.map.stride()
        } else {
            1
        };
        for (u, v) in [(x + across, y + across), (x - across, y - across)] {
            if !self.linked(x, u) || !self.linked(y, v) {
                continue;
            }
            let Some([from, first, second, to]) = detour(self.next, (u, v), (x, y)) else {
                continue;
            };
            self.link(from, first);
            self.link(first, second);
            self.link(second, to);
            return true;
        }
        false
    }

    fn touch(&mut self, cell: Cell) {
        let at = cell as usize;
        self.log.push((cell, self.next[at], self.prev[at]));
    }

    fn link(&mut self, a: Cell, b: Cell) {
        self.touch(a);
        self.next[a as usize] = b;
        self.touch(b);
        self.prev[b as usize] = a;
    }

    fn drop(&mut self, cell: Cell) {
        self.touch(cell);
        self.next[cell as usize] = NOWHERE;
        self.prev[cell as usize] = NOWHERE;
    }

    fn undo(&mut self, mark: usize) {
        while self.log.len() > mark {
            if let Some((cell, next, prev)) = self.log.pop() {
                self.next[cell as usize] = next;
                self.prev[cell as usize] = prev;
            }
        }
    }
}

/// The loop's edge between `u` and `v`, whichever way it is flown, led over `x` beside
/// `u` and `y` beside `v`: the four cells in order of flight, if there is that edge.
pub(super) fn detour(
    next: &[Cell],
    (u, v): (Cell, Cell),
    (x, y): (Cell, Cell),
) -> Option<[Cell; 4]> {
    if next[u as usize] == v {
        Some([u, x, y, v])
    } else if next[v as usize] == u {
        Some([v, y, x, u])
    } else {
        None
    }
}
