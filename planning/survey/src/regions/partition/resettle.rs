//! Regions settled anew where borders cannot move (D2.7 §3.6.3: an even share each): a
//! region in a dead end, or behind a door, has no neighbour that could take half of it.
//! Then a small region is dissolved among its neighbours, and its UAV gets half of the
//! largest one.
//!
//! Left to others: which UAV flies which region in the end, and the borders.

use super::{NOBODY, Partition};

/// A region is divided when it has more to fly than this many eighths of the mean.
const LARGE: i64 = 9;

/// Small regions tried for each large one before it stays whole.
const SMALL_TRIED: usize = 3;

/// Ends of a region from which halves are tried, each as far as can be from the one before.
const ENDS_TRIED: usize = 3;

/// Highest power of times that counts: the largest of many weighs most.
const POWER: u32 = 6;

/// Part of a region: its pieces, and their cells.
#[derive(Default)]
struct Part {
    pieces: Vec<u32>,
    cells: i64,
}

/// What a try may have to put back.
struct State {
    owner: Vec<u32>,
    seed: Vec<u32>,
    entry: Vec<i64>,
    size: Vec<i64>,
    waste: Vec<i64>,
}

impl Partition<'_> {
    /// Dissolves small regions and divides large ones, as many at once as helps when
    /// regions are then given to the UAVs that they suit.
    pub(super) fn resettle(&mut self) {
        let mut at_once = 2 * self.seed.len();
        while at_once > 0 {
            let before = self.state();
            let unevenness = self.unevenness(&before);
            let done = self.resettle_some(at_once);
            if done == 0 {
                return;
            }
            self.reassign();
            self.balance();
            let now = self.state();
            if self.unevenness(&now) >= unevenness {
                self.restore(before);
                at_once = done / 2;
            }
        }
    }

    fn state(&self) -> State {
        State {
            owner: self.owner.clone(),
            seed: self.seed.clone(),
            entry: self.entry.clone(),
            size: self.size.clone(),
            waste: self.waste.clone(),
        }
    }

    fn restore(&mut self, state: State) {
        self.owner = state.owner;
        self.seed = state.seed;
        self.entry = state.entry;
        self.size = state.size;
        self.waste = state.waste;
    }

    /// How many were resettled, of at most so many.
    fn resettle_some(&mut self, most_times: usize) -> usize {
        let n = self.seed.len();
        for time in 0..most_times {
            let mut by_load: Vec<(i64, usize)> = (0..n).map(|u| (self.load(u), u)).collect();
            by_load.sort_unstable();
            let sum: i64 = by_load.iter().map(|l| l.0).sum();
            let Some(&(most, large)) = by_load.last() else {
                return time;
            };
            if most * 8 * n as i64 <= sum * LARGE {
                return time;
            }
            let small = by_load.iter().take(SMALL_TRIED.min(n - 1));
            if !small
                .into_iter()
                .any(|(_, small)| self.try_resettle(large, *small))
            {
                return time;
            }
        }
        most_times
    }

    /// The powers of the times, in 64ths of the mean of `reference`.
    fn unevenness(&self, reference: &State) -> i128 {
        let n = self.seed.len();
        let moves =
            |u: usize| (reference.entry[u] + reference.size[u] + reference.waste[u]) * self.pace[u];
        let sum: i64 = (0..n).map(moves).sum();
        let mean = i128::from((sum / n.max(1) as i64).max(1));
        let loads = (0..n).map(|u| i128::from(self.load(u)) * 64 / mean);
        loads.map(|l| l.min(1 << 16).pow(POWER)).sum()
    }

    /// Gives half of a large region to the UAV of a small one, whose own goes to its
    /// neighbours; false if that was no gain and all is as before.
    fn try_resettle(&mut self, large: usize, small: usize) -> bool {
        let before = self.state();
        let unevenness = self.unevenness(&before);
        if self.dissolve(small) {
            let half = self.half(large);
            if !half.pieces.is_empty() {
                self.settle_half(large, small, &half);
                let entry = self.entry[small];
                // UAVs in between may each go a little farther instead.
                self.entry[small] = entry.min(self.entry[large]);
                let after = self.unevenness(&before);
                self.entry[small] = entry;
                if after < unevenness {
                    return true;
                }
            }
        }
        self.restore(before);
        false
    }

    /// Gives a region's pieces to its neighbours; false if some have none.
    fn dissolve(&mut self, uav: usize) -> bool {
        let me = u32::try_from(uav).unwrap_or(NOBODY);
        let left = self.disperse(me, self.pieces_of(me));
        self.size[uav] = 0;
        self.waste[uav] = 0;
        self.entry[uav] = 0;
        self.seed[uav] = NOBODY;
        left.is_empty()
    }

    fn pieces_of(&self, uav: u32) -> Vec<u32> {
        let owned = (0u32..).zip(&self.owner).filter(|(_, o)| **o == uav);
        owned.map(|(piece, _)| piece).collect()
    }

    /// The most even half of a region that leaves the rest in one piece: what is nearest
    /// to one of its ends, with what only that connects with the rest.
    fn half(&mut self, uav: usize) -> Part {
        let mut best = Part::default();
        let mut best_off = i64::MAX;
        let mut end = self.seed[uav];
        for _ in 0..ENDS_TRIED {
            self.search += 1;
            end = self.flood(end).pieces.last().copied().unwrap_or(end);
            let half = self.half_from(uav, end);
            let off = (2 * half.cells - self.size[uav]).abs();
            if off < best_off && !half.pieces.is_empty() && half.cells < self.size[uav] {
                (best, best_off) = (half, off);
            }
        }
        best
    }

    fn half_from(&mut self, uav: usize, end: u32) -> Part {
        self.search += 1;
        let order = self.flood(end).pieces;
        let mut half = Part::default();
        for piece in &order {
            if 2 * half.cells >= self.size[uav] {
                break;
            }
            half.cells += self.cells(*piece);
            half.pieces.push(*piece);
        }
        self.search += 1;
        for piece in &half.pieces {
            self.seen[*piece as usize] = self.search;
        }
        // What lies beyond: its largest part stays, the others join this half.
        let mut parts: Vec<Part> = Vec::new();
        for start in &order[half.pieces.len()..] {
            if self.seen[*start as usize] != self.search {
                parts.push(self.flood(*start));
            }
        }
        parts.sort_by_key(|part| part.cells);
        parts.pop();
        for part in parts {
            half.cells += part.cells;
            half.pieces.extend(part.pieces);
        }
        half
    }

    /// What is connected with a piece in its region, in the order of distance from it, but
    /// for what this search has seen.
    fn flood(&mut self, start: u32) -> Part {
        let region = self.owner[start as usize];
        self.seen[start as usize] = self.search;
        let mut reached = Part {
            pieces: vec![start],
            cells: 0,
        };
        let mut done = 0;
        while let Some(&at) = reached.pieces.get(done) {
            done += 1;
            reached.cells += self.cells(at);
            for link in self.near(at) {
                let to = self.links[link] as usize;
                if self.owner[to] == region && self.seen[to] != self.search {
                    self.seen[to] = self.search;
                    reached.pieces.push(self.links[link]);
                }
            }
        }
        reached
    }

    /// Passes half of a region to a UAV that has none.
    fn settle_half(&mut self, large: usize, small: usize, half: &Part) {
        let to = u32::try_from(small).unwrap_or(NOBODY);
        let waste = self.waste[large];
        for piece in &half.pieces {
            self.owner[*piece as usize] = to;
        }
        self.waste[small] = waste * half.cells / self.size[large].max(1);
        self.waste[large] -= self.waste[small];
        self.size[small] = half.cells;
        self.size[large] -= half.cells;
        for uav in [large, small] {
            let me = u32::try_from(uav).unwrap_or(NOBODY);
            let ways = self.pieces_of(me).into_iter();
            if let Some((way, piece)) = ways.map(|p| (self.way(uav, p), p)).min() {
                (self.entry[uav], self.seed[uav]) = (way, piece);
            }
        }
    }
}
