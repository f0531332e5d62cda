//! The bound of pairs (D2.7 §3.6): a path never visits two cells in a row of which no two
//! are neighbours, so that at most every second visit falls on such a set; where it is
//! large, the rest of the map is flown again. Parity, dead ends and combs are such sets.
//!
//! A cell that alone holds pockets to the map is visited once more for each of them.

use super::super::map::{Cell, LaneMap, NOWHERE};
use super::super::plan::Task;

/// Visits to the set of cells without neighbours that takes most of them.
///
/// # Complexity
/// O(N √N) at most, near O(N) on maps.
pub(super) fn visits(task: &Task) -> u64 {
    let needs = if task.closed {
        doors(task)
    } else {
        let mut needs = vec![0; task.map.table_len()];
        for cell in task.map.cells() {
            needs[cell as usize] = 1;
        }
        needs
    };
    let total: u64 = task.map.cells().map(|c| u64::from(needs[c as usize])).sum();
    total - Pairing::new(&task.map, needs).most()
}

/// By cell: visits at least. A closed walk passes a cell before, between and after the
/// pockets that only this cell connects with the roots.
fn doors(task: &Task) -> Vec<u32> {
    let map = &task.map;
    let mut needs = vec![0; map.table_len()];
    let mut rooted = vec![false; map.table_len()];
    for cell in map.cells() {
        needs[cell as usize] = 1;
    }
    for root in &task.roots {
        rooted[*root as usize] = true;
    }
    // Depth-first numbers, and the least number that a cell and what was found from it
    // touch. The roots all touch number 1, as if one more cell joined them.
    let mut number = vec![0u32; map.table_len()];
    let mut low = vec![0u32; map.table_len()];
    let mut count = 1;
    let mut stack: Vec<(Cell, Cell, usize)> = Vec::new();
    for root in map
        .cells()
        .filter(|c| rooted[*c as usize])
        .collect::<Vec<_>>()
    {
        if number[root as usize] != 0 {
            continue;
        }
        stack.push((root, NOWHERE, 0));
        while let Some((cell, from, side)) = stack.pop() {
            if side == 0 {
                count += 1;
                number[cell as usize] = count;
                low[cell as usize] = if rooted[cell as usize] { 1 } else { count };
            }
            if side == 4 {
                if from != NOWHERE {
                    let pocket = low[cell as usize] >= number[from as usize];
                    needs[from as usize] += u32::from(pocket);
                    low[from as usize] = low[from as usize].min(low[cell as usize]);
                }
                continue;
            }
            stack.push((cell, from, side + 1));
            let near = map.around(cell)[side];
            if !map.is_free(near) {
                continue;
            }
            if number[near as usize] == 0 {
                stack.push((near, cell, 0));
            } else if near != from {
                low[cell as usize] = low[cell as usize].min(number[near as usize]);
            }
        }
    }
    for root in &task.roots {
        // A round that begins at a door closes there: one visit less.
        if core::mem::replace(&mut rooted[*root as usize], false) {
            needs[*root as usize] = (needs[*root as usize] - 1).max(1);
        }
    }
    needs
}

/// The largest multiset of pairs of neighbours in which no cell is more often than it is
/// needed, by shortest augmenting ways (after Dinic).
struct Pairing<'a> {
    map: &'a LaneMap,
    /// By cell: how often it may still be paired.
    left: Vec<u32>,
    /// By light cell and side: pairs with that neighbour.
    pairs: Vec<[u32; 4]>,
    /// By light cell: its layer in the search at hand, and the next side to try.
    layer: Vec<(u32, u8)>,
}

impl<'a> Pairing<'a> {
    fn new(map: &'a LaneMap, needs: Vec<u32>) -> Self {
        Self {
            map,
            left: needs,
            pairs: vec![[0; 4]; map.table_len()],
            layer: vec![(0, 0); map.table_len()],
        }
    }

    fn light(&self, cell: Cell) -> bool {
        let (row, col) = self.map.place(cell);
        (row + col).is_multiple_of(2)
    }

    fn most(mut self) -> u64 {
        let light: Vec<Cell> = self.map.cells().filter(|c| self.light(*c)).collect();
        let mut most = 0;
        while self.layers(&light) {
            for &cell in &light {
                while self.left[cell as usize] > 0 && self.augment(cell) {
                    most += 1;
                }
            }
        }
        most
    }

    /// Numbers the light cells by the pairs to be undone before they can be paired; false
    /// when no dark cell that is left over can be reached.
    fn layers(&mut self, light: &[Cell]) -> bool {
        let mut open = Vec::new();
        for &cell in light {
            let start = self.left[cell as usize] > 0;
            self.layer[cell as usize] = (u32::from(start), 0);
            if start {
                open.push(cell);
            }
        }
        let mut found = false;
        let mut done = 0;
        while let Some(&cell) = open.get(done) {
            done += 1;
            let next = self.layer[cell as usize].0 + 1;
            for dark in self.map.around(cell) {
                if !self.map.is_free(dark) {
                    continue;
                }
                found |= self.left[dark as usize] > 0;
                for (side, other) in self.map.around(dark).into_iter().enumerate() {
                    if self.map.is_free(other)
                        && self.pairs[other as usize][opposite(side)] > 0
                        && self.layer[other as usize].0 == 0
                    {
                        self.layer[other as usize].0 = next;
                        open.push(other);
                    }
                }
            }
        }
        found
    }

    /// Pairs a light cell once more, undoing pairs layer by layer.
    fn augment(&mut self, start: Cell) -> bool {
        // By step: a light cell, the side of its dark neighbour, and the side on which
        // that one's present partner lies.
        let mut way: Vec<(Cell, usize, usize)> = Vec::new();
        let mut cell = start;
        loop {
            match self.step(cell) {
                Step::Free(side) => {
                    let dark = self.map.around(cell)[side];
                    self.left[dark as usize] -= 1;
                    self.left[start as usize] -= 1;
                    self.pairs[cell as usize][side] += 1;
                    for &(from, side, back) in &way {
                        let dark = self.map.around(from)[side];
                        let partner = self.map.around(dark)[back];
                        self.pairs[from as usize][side] += 1;
                        self.pairs[partner as usize][opposite(back)] -= 1;
                    }
                    return true;
                }
                Step::Undo(side, back) => {
                    way.push((cell, side, back));
                    let dark = self.map.around(cell)[side];
                    cell = self.map.around(dark)[back];
                }
                Step::None => {
                    let Some((before, ..)) = way.pop() else {
                        return false;
                    };
                    cell = before;
                }
            }
        }
    }

    /// What a light cell can do next; sides that lead nowhere are not tried again.
    fn step(&mut self, cell: Cell) -> Step {
        let (layer, first) = self.layer[cell as usize];
        for tried in first..16 {
            let (side, back) = (usize::from(tried / 4), usize::from(tried % 4));
            let dark = self.map.around(cell)[side];
            if !self.map.is_free(dark) {
                continue;
            }
            if self.left[dark as usize] > 0 {
                self.layer[cell as usize].1 = tried;
                return Step::Free(side);
            }
            let other = self.map.around(dark)[back];
            if self.map.is_free(other)
                && self.pairs[other as usize][opposite(back)] > 0
                && self.layer[other as usize].0 == layer + 1
            {
                // Tried once: if it leads on, the next way begins with the next choice.
                self.layer[cell as usize].1 = tried + 1;
                return Step::Undo(side, back);
            }
        }
        self.layer[cell as usize].1 = 16;
        Step::None
    }
}

enum Step {
    /// The neighbour on this side is free.
    Free(usize),
    /// The neighbour on this side can be freed from its partner on that side of it.
    Undo(usize, usize),
    None,
}

/// Sides as in [`LaneMap::around`]: the other side of an edge.
fn opposite(side: usize) -> usize {
    (side + 2) % 4
}
