//! The boustrophedon decomposition of a lane-cell map (D2.7 §3.6.1): rows or columns are
//! the sweep lines, runs of free cells are their free parts.
//!
//! For comparison with the planners of [`skein_survey::regions`]: the same events, the
//! same zig-zag, with moves between neighbours instead of straight passes. The nearest
//! corner of a cell that is not covered yet comes next; the closed walk is then divided
//! as the loop of a spanning tree is.

use super::free_entry;
use skein_survey::regions::map::{Cell, LaneMap, Router};
use skein_survey::regions::{Plan, Task};

/// Free positions of one line, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    line: u32,
    first: u32,
    last: u32,
}

/// A cell of the decomposition: one run on each of a range of lines.
type Block = Vec<Run>;

/// Lines of a map: its rows, or its columns.
#[derive(Clone, Copy)]
struct Lines<'a> {
    map: &'a LaneMap,
    columns: bool,
}

impl Lines<'_> {
    fn cell(&self, line: u32, at: u32) -> Option<Cell> {
        if self.columns {
            self.map.cell(at, line)
        } else {
            self.map.cell(line, at)
        }
    }

    /// The free runs of a line.
    fn runs(&self, line: u32) -> Vec<Run> {
        let n = if self.columns {
            self.map.rows()
        } else {
            self.map.cols()
        };
        let mut runs: Vec<Run> = Vec::new();
        for at in (0..n).filter(|at| self.cell(line, *at).is_some()) {
            match runs.last_mut() {
                Some(run) if run.last + 1 == at => run.last = at,
                _ => runs.push(Run {
                    line,
                    first: at,
                    last: at,
                }),
            }
        }
        runs
    }

    /// The decomposition: a run goes on with a block if it touches no other run of the
    /// line before, and that one no other run of its own line.
    fn blocks(&self) -> Vec<Block> {
        let n = if self.columns {
            self.map.cols()
        } else {
            self.map.rows()
        };
        let mut blocks: Vec<Block> = Vec::new();
        let mut before: Vec<(Run, usize)> = Vec::new();
        for line in 0..n {
            let runs = self.runs(line);
            let touch = |p: &Run, q: &Run| p.first <= q.last && q.first <= p.last;
            let mut now = Vec::with_capacity(runs.len());
            for run in &runs {
                let mut behind = before.iter().filter(|(p, _)| touch(p, run));
                let goes_on = match (behind.next(), behind.next()) {
                    (Some((p, block)), None) => {
                        let alone = runs.iter().filter(|q| touch(p, q)).count() == 1;
                        alone.then_some(*block)
                    }
                    _ => None,
                };
                let block = goes_on.unwrap_or_else(|| {
                    blocks.push(Vec::new());
                    blocks.len() - 1
                });
                blocks[block].push(*run);
                now.push((*run, block));
            }
            before = now;
        }
        blocks
    }
}

/// Which way through a block: from its last line back, and against the direction of its
/// first run.
#[derive(Clone, Copy, Debug)]
struct Entry {
    block: usize,
    from_last: bool,
    backward: bool,
}

/// The closed walk over all cells that `task.roots[0]` reaches, by rows or by columns,
/// whichever is shorter: each cell a neighbour of the next, the last one of the first.
#[must_use]
pub fn closed_walk(task: &Task) -> Vec<Cell> {
    let walk = |columns| {
        let lines = Lines {
            map: &task.map,
            columns,
        };
        walk_of(lines, task)
    };
    let (rows, columns) = (walk(false), walk(true));
    if columns.len() < rows.len() {
        columns
    } else {
        rows
    }
}

/// The closed boustrophedon walk divided into arcs to which each UAV flies straight.
///
/// # Guarantees
/// Covers every cell that the first root reaches.
#[must_use]
pub fn plan(task: &Task) -> Plan {
    free_entry::along(task, &closed_walk(task))
}

fn walk_of(lines: Lines<'_>, task: &Task) -> Vec<Cell> {
    let map = lines.map;
    let Some(&root) = task.roots.first() else {
        return Vec::new();
    };
    let blocks = lines.blocks();
    let mut corners: Vec<(Cell, Entry)> = Vec::with_capacity(4 * blocks.len());
    for (block, runs) in blocks.iter().enumerate() {
        for (from_last, backward) in [(false, false), (false, true), (true, false), (true, true)] {
            let run = if from_last { runs.last() } else { runs.first() };
            let at = run.and_then(|r| lines.cell(r.line, if backward { r.last } else { r.first }));
            let entry = Entry {
                block,
                from_last,
                backward,
            };
            corners.extend(at.map(|cell| (cell, entry)));
        }
    }
    // The first corners at a cell, by cell: several blocks never share one.
    corners.sort_by_key(|c| (c.0, c.1.block));
    let mut nearest = Nearest::new(map);
    let mut router = Router::new(map);
    let mut done = vec![false; blocks.len()];
    let mut walk = Vec::new();
    let mut at = root;
    while let Some(entry) = nearest.entry(at, &corners, &done) {
        done[entry.block] = true;
        let mut append = |cell: Cell| {
            if walk.is_empty() {
                walk.push(cell);
            } else if cell != at {
                router.append_way(at, cell, &mut walk);
            }
            at = cell;
        };
        let runs = &blocks[entry.block];
        let mut backward = entry.backward;
        for i in 0..runs.len() {
            let run = runs[if entry.from_last {
                runs.len() - 1 - i
            } else {
                i
            }];
            let positions = run.first..=run.last;
            let cells = positions.filter_map(|p| lines.cell(run.line, p));
            if backward {
                cells.rev().for_each(&mut append);
            } else {
                cells.for_each(&mut append);
            }
            backward = !backward;
        }
    }
    if let (Some(&first), Some(&last)) = (walk.first(), walk.last())
        && first != last
    {
        router.append_way(last, first, &mut walk);
        walk.pop();
    }
    walk
}

/// Breadth-first search for the nearest corner.
struct Nearest<'a> {
    map: &'a LaneMap,
    seen: Vec<u32>,
    search: u32,
}

impl<'a> Nearest<'a> {
    fn new(map: &'a LaneMap) -> Self {
        Self {
            map,
            seen: vec![0; map.table_len()],
            search: 0,
        }
    }

    /// The entry of a block that is not done which is the fewest moves away.
    fn entry(&mut self, from: Cell, corners: &[(Cell, Entry)], done: &[bool]) -> Option<Entry> {
        self.search += 1;
        let mut layer = vec![from];
        let mut next = Vec::new();
        self.seen[from as usize] = self.search;
        while !layer.is_empty() {
            for &cell in &layer {
                let first = corners.partition_point(|c| c.0 < cell);
                let here = corners[first..].iter().take_while(|c| c.0 == cell);
                if let Some((_, entry)) = here.into_iter().find(|c| !done[c.1.block]) {
                    return Some(*entry);
                }
                for near in self.map.around(cell) {
                    if self.map.is_free(near) && self.seen[near as usize] != self.search {
                        self.seen[near as usize] = self.search;
                        next.push(near);
                    }
                }
            }
            layer.clear();
            core::mem::swap(&mut layer, &mut next);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn an_open_field_is_one_zigzag() {
        let map = LaneMap::new(4, 6, |_, _| true).unwrap();
        let root = map.cell(0, 0).unwrap();
        let task = Task::new(&map, &[root], false).unwrap();
        // All cells and two on the way back to the first: the walk is closed.
        assert_eq!(closed_walk(&task).len(), 26);
        assert_eq!(plan(&task).makespan_moves(), 25);
        let lines = Lines {
            map: &map,
            columns: false,
        };
        assert_eq!(lines.blocks().len(), 1);
    }

    #[test]
    fn a_hole_makes_four_blocks() {
        let hole = |r: u32, c: u32| (2..4).contains(&r) && (2..4).contains(&c);
        let map = LaneMap::new(6, 6, |r, c| !hole(r, c)).unwrap();
        for columns in [false, true] {
            let lines = Lines { map: &map, columns };
            assert_eq!(lines.blocks().len(), 4);
        }
    }

    proptest! {
        #[test]
        fn every_cell_is_covered_by_moves_between_neighbours(
            free in prop::collection::vec(prop::bool::weighted(0.75), 120),
            picks in prop::collection::vec(any::<prop::sample::Index>(), 1..5),
            closed in any::<bool>(),
        ) {
            let map = LaneMap::new(10, 12, |r, c| free[(r * 12 + c) as usize]).unwrap();
            let cells: Vec<Cell> = map.cells().collect();
            prop_assume!(!cells.is_empty());
            let map = map.reachable(&[cells[picks[0].index(cells.len())]]);
            let cells: Vec<Cell> = map.cells().collect();
            let roots: Vec<Cell> = picks.iter().map(|p| cells[p.index(cells.len())]).collect();
            let task = Task::new(&map, &roots, closed).unwrap();
            for columns in [false, true] {
                let lines = Lines { map: &map, columns };
                let in_blocks: usize = lines
                    .blocks()
                    .iter()
                    .flatten()
                    .map(|r| (r.last - r.first + 1) as usize)
                    .sum();
                prop_assert_eq!(in_blocks, cells.len());
            }
            let plan = plan(&task);
            prop_assert_eq!(plan.n_covered(&task), cells.len());
            for (path, root) in plan.paths.iter().zip(&roots) {
                prop_assert_eq!(path[0], *root);
                prop_assert!(path.windows(2).all(|w| map.adjacent(w[0], w[1]) && map.is_free(w[1])));
            }
        }
    }
}
