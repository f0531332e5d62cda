//! The bound of narrow places (D2.7 §3.6): every excursion beyond a gate visits the gate
//! on its way, and many UAVs through a narrow gate visit its cells again and again.
//!
//! The cells at least `d` moves from the roots fall into parts; parts of all `d` form a
//! tree. From far to near it is counted how many visits a part takes at least and how
//! many UAVs those keep busy until a given time.
//!
//! Left to others: parity and dead ends ([`pairs`](super::pairs)).

use super::super::map::{Cell, UNREACHED};
use super::super::plan::Task;

/// Tables of distances to every part beyond this many entries in all would be too large;
/// the nearest root then stands for all, and the bound is looser.
const MOST_TABLE: usize = 1 << 24;

/// A part of the cells at least so many moves from every root.
struct Part {
    depth: u32,
    /// Its cells at exactly this depth.
    rim: u64,
    /// The part that it lies in, one move nearer to the roots; itself at depth 0.
    parent: usize,
}

/// The tree of parts.
pub(super) struct Gates {
    /// Far ones first.
    parts: Vec<Part>,
    /// By part: moves of each UAV to it, near ones first; one entry for all UAVs when
    /// the table would be too large.
    ways: Vec<u32>,
    /// Entries a part in `ways`.
    n_ways: usize,
    n_uavs: u64,
    closed: bool,
    /// Loads of the parts while a time is tried.
    loads: Vec<Load>,
}

/// What the parts inside a part come to.
#[derive(Clone, Copy, Default)]
struct Load {
    visits: u64,
    excursions: u64,
}

impl Gates {
    pub(super) fn new(task: &Task) -> Self {
        let moves = task.map.distances(&task.roots);
        let mut by_depth: Vec<Vec<Cell>> = Vec::new();
        for cell in task.map.cells() {
            let d = moves[cell as usize];
            if d != UNREACHED {
                let d = d as usize;
                if d >= by_depth.len() {
                    by_depth.resize(d + 1, Vec::new());
                }
                by_depth[d].push(cell);
            }
        }
        let (parts, part_of) = parts(task, &moves, &by_depth);
        let n_ways = if task.n_uavs().saturating_mul(parts.len()) <= MOST_TABLE {
            task.n_uavs()
        } else {
            1
        };
        let ways = ways(task, &parts, &part_of, n_ways);
        Self {
            loads: vec![Load::default(); parts.len()],
            parts,
            ways,
            n_ways,
            n_uavs: task.n_uavs() as u64,
            closed: task.closed,
        }
    }

    /// No plan has a longest path of fewer moves.
    pub(super) fn least(&mut self, at_least: u32) -> u32 {
        let mut low = u64::from(at_least);
        let mut high = low;
        while !self.can(high) {
            low = high + 1;
            high = 2 * high + 1;
            if high >= u64::from(u32::MAX) {
                return u32::try_from(low).unwrap_or(u32::MAX);
            }
        }
        while low < high {
            let middle = low.midpoint(high);
            if self.can(middle) {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        u32::try_from(low).unwrap_or(u32::MAX)
    }

    /// Whether the count leaves room for a plan of `time` moves.
    fn can(&mut self, time: u64) -> bool {
        self.loads.fill(Load::default());
        for i in 0..self.parts.len() {
            let Some(load) = self.load(i, time) else {
                return false;
            };
            let parent = self.parts[i].parent;
            if parent != i {
                let above = &mut self.loads[parent];
                above.visits += load.visits;
                above.excursions += load.excursions;
            }
        }
        true
    }

    /// What part `i` comes to at least; `None` when the UAVs cannot do that in `time`.
    fn load(&self, i: usize, time: u64) -> Option<Load> {
        let part = &self.parts[i];
        let inside = self.loads[i];
        let mut room = 0u64;
        for uavs in 1..=self.n_uavs {
            let slot = usize::try_from(uavs - 1).ok()?.min(self.n_ways - 1);
            room += self.room(self.ways[i * self.n_ways + slot], time)?;
            // Whoever returns visits the rim between any two excursions further in, and
            // before the first and after the last; a round that begins on the rim closes.
            let passes = if self.closed && part.depth > 0 {
                inside.excursions + uavs
            } else {
                inside.excursions.max(uavs)
            };
            let passes = if part.depth == 0 {
                inside.excursions
            } else {
                passes
            };
            let visits = inside.visits + part.rim.max(passes);
            if visits <= room {
                return Some(Load {
                    visits,
                    excursions: uavs,
                });
            }
        }
        None
    }

    /// Visits that a UAV can make in `time` in a part that is `way` moves from it.
    fn room(&self, way: u32, time: u64) -> Option<u64> {
        if way == UNREACHED {
            return None;
        }
        let way = u64::from(way);
        let room = if !self.closed {
            (time + 1).checked_sub(way)
        } else if way == 0 {
            // One cell alone needs no move, even there and back.
            Some(time.max(1))
        } else {
            (time + 1).checked_sub(2 * way)
        };
        room.filter(|r| *r > 0)
    }
}

/// The parts, far ones first, and the part of each cell that lies on a rim.
fn parts(task: &Task, moves: &[u32], by_depth: &[Vec<Cell>]) -> (Vec<Part>, Vec<u32>) {
    let map = &task.map;
    let mut name: Vec<Cell> = (0u32..).take(map.table_len()).collect();
    let mut parts: Vec<Part> = Vec::new();
    let mut part_of = vec![UNREACHED; map.table_len()];
    let mut of_name = vec![UNREACHED; map.table_len()];
    let mut depth = u32::try_from(by_depth.len()).unwrap_or(UNREACHED);
    for rim in by_depth.iter().rev() {
        depth -= 1;
        for &cell in rim {
            for near in map.neighbours(cell) {
                if moves[near as usize] >= depth {
                    unite(&mut name, cell, near);
                }
            }
        }
        let first = parts.len();
        for &cell in rim {
            let whole = find(&mut name, cell) as usize;
            let known = of_name[whole];
            if known == UNREACHED || (known as usize) < first {
                of_name[whole] = u32::try_from(parts.len()).unwrap_or(UNREACHED);
                parts.push(Part {
                    depth,
                    rim: 0,
                    parent: parts.len(),
                });
            }
            let part = of_name[whole];
            part_of[cell as usize] = part;
            parts[part as usize].rim += 1;
            for near in map.neighbours(cell) {
                if moves[near as usize] == depth + 1 {
                    parts[part_of[near as usize] as usize].parent = part as usize;
                }
            }
        }
    }
    (parts, part_of)
}

/// Moves of each UAV to each part.
fn ways(task: &Task, parts: &[Part], part_of: &[u32], n_ways: usize) -> Vec<u32> {
    if n_ways < task.n_uavs() {
        return parts.iter().map(|p| p.depth).collect();
    }
    let mut ways = vec![UNREACHED; parts.len() * n_ways];
    for (uav, root) in task.roots.iter().enumerate() {
        let moves = task.map.distances(&[*root]);
        for cell in task.map.cells() {
            let part = part_of[cell as usize];
            if part != UNREACHED {
                let way = &mut ways[part as usize * n_ways + uav];
                *way = (*way).min(moves[cell as usize]);
            }
        }
    }
    for part in ways.chunks_mut(n_ways.max(1)) {
        part.sort_unstable();
    }
    ways
}

fn find(name: &mut [Cell], cell: Cell) -> Cell {
    let mut at = cell;
    while name[at as usize] != at {
        // Halving the way keeps later searches short.
        name[at as usize] = name[name[at as usize] as usize];
        at = name[at as usize];
    }
    at
}

fn unite(name: &mut [Cell], a: Cell, b: Cell) {
    let (a, b) = (find(name, a), find(name, b));
    name[a.max(b) as usize] = a.min(b);
}
