//! Co-located depots: assign the farthest cells first. Each UAV in turn flies out to the
//! farthest cells that are left, over a corridor one cell wide that it covers on the way
//! and that no other UAV then needs, and takes the cells round there.
//!
//! From one base this is what makes more UAVs pay: a loop divided into arcs wastes every
//! way out (D2.7 §3.6.5), a corridor wastes nothing.
//!
//! Left to others: evening the times, and cells flown twice inside a region.

use super::insertion::insert_missing;
use super::map::{Cell, LaneMap, NOWHERE};
use super::partition::NOBODY;
use super::plan::Task;
use super::spanning::{Tree, region_loops};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// What a step of a corridor costs: along the edge of what is left, so that the rest
/// stays in one piece; through its middle; over what another UAV covers.
const EDGE: u32 = 4;
const MIDDLE: u32 = 5;
const COVERED: u32 = 7;

/// Cells that are cut off from all roots are taken along up to this many; more are worth
/// another UAV's way over covered cells.
const POCKET: usize = 40;

/// A UAV goes on to another region only with more moves left than this.
const WORTH_A_HOP: u32 = 8;

struct Peel<'a> {
    task: &'a Task,
    map: &'a LaneMap,
    offset: (u32, u32),
    /// By cell: moves from the nearest root.
    far: Vec<u32>,
    /// By cell: its region; and whether it lies in a corridor.
    owner: Vec<u32>,
    /// By cell: the cost of a corridor's step onto it; 0 where it is blocked.
    step: Vec<u32>,
    corridor: Vec<bool>,
    /// By UAV: the corridor, and the cells where regions are entered.
    ways: Vec<Vec<Cell>>,
    backs: Vec<Vec<Cell>>,
    entries: Vec<Vec<Cell>>,
    n_regions: u32,
    /// The cells taken so far.
    taken: Vec<Cell>,
    /// By cell: its place on the way of the UAV at hand.
    on_way: Vec<u32>,
    /// For searches: the cost to a cell in the last search that reached it, and its link.
    cost: Vec<(u32, u32, Cell)>,
    search: u32,
}

/// Orders in which each UAV flies about `moves` moves, and the number of cells that were
/// left for want of moves and given to neighbours.
#[must_use]
pub fn orders(task: &Task, offset: (u32, u32), moves: u32) -> (Vec<Vec<Cell>>, usize) {
    let map = &task.map;
    let mut peel = Peel {
        task,
        map,
        offset,
        far: map.distances(&task.roots),
        owner: vec![NOBODY; map.table_len()],
        step: steps(map),
        corridor: vec![false; map.table_len()],
        ways: vec![Vec::new(); task.n_uavs()],
        backs: vec![Vec::new(); task.n_uavs()],
        entries: vec![Vec::new(); task.n_uavs()],
        n_regions: 0,
        taken: Vec::new(),
        on_way: vec![u32::MAX; map.table_len()],
        cost: vec![(0, 0, NOWHERE); map.table_len()],
        search: 0,
    };
    let mut by_distance: Vec<Cell> = map.cells().collect();
    by_distance.sort_by_key(|c| (Reverse(peel.far[*c as usize]), *c));
    let mut idle = vec![true; task.n_uavs()];
    let mut farthest = by_distance.iter().copied();
    for _ in 0..task.n_uavs() {
        let Some(goal) = farthest.find(|c| peel.owner[*c as usize] == NOBODY) else {
            break;
        };
        let Some((uav, way)) = peel.way_to(goal, &idle) else {
            continue;
        };
        idle[uav] = false;
        let from = peel.taken.len();
        let fastest = task.speeds.iter().copied().max().unwrap_or(1);
        let mine = u64::from(moves) * u64::from(task.speeds[uav]) / u64::from(fastest.max(1));
        peel.take(uav, goal, way, u32::try_from(mine).unwrap_or(u32::MAX));
        peel.take_pockets(from);
    }
    let left = by_distance
        .iter()
        .filter(|c| peel.owner[**c as usize] == NOBODY)
        .count();
    (peel.finish(), left)
}

impl Peel<'_> {
    fn is_left(&self, cell: Cell) -> bool {
        self.map.is_free(cell) && self.owner[cell as usize] == NOBODY
    }

    /// The cheapest corridor to `goal` and the idle UAV that begins there.
    fn way_to(&mut self, goal: Cell, idle: &[bool]) -> Option<(usize, Vec<Cell>)> {
        let mut waiting = vec![];
        for (uav, root) in self.task.roots.iter().enumerate() {
            if idle[uav] {
                waiting.push((*root, uav));
            }
        }
        waiting.sort_unstable();
        self.cheapest(goal, |at| {
            let first = waiting.partition_point(|w| w.0 < at);
            let (root, uav) = waiting.get(first)?;
            (*root == at).then_some(*uav)
        })
    }

    /// The cheapest corridor that ends at `goal` and begins where `is_there` says so.
    fn cheapest<T>(
        &mut self,
        goal: Cell,
        is_there: impl Fn(Cell) -> Option<T>,
    ) -> Option<(T, Vec<Cell>)> {
        self.search += 1;
        self.cost[goal as usize] = (self.search, 0, NOWHERE);
        // A step nearer to the roots costs at least EDGE: cells are taken up by what the
        // whole corridor costs at least. Buckets by that, as many as it can grow in a
        // step, used in turn.
        let mut open: Vec<Vec<Cell>> = vec![Vec::new(); (COVERED + EDGE) as usize + 1];
        let mut total = EDGE * self.far[goal as usize];
        open[total as usize % (COVERED + EDGE + 1) as usize].push(goal);
        let mut empty = 0;
        while empty < open.len() {
            let bucket = total as usize % open.len();
            let Some(at) = open[bucket].pop() else {
                total += 1;
                empty += 1;
                continue;
            };
            empty = 0;
            let cost = self.cost[at as usize].1;
            if cost + EDGE * self.far[at as usize] < total {
                continue;
            }
            if let Some(found) = is_there(at) {
                let mut way = Vec::new();
                let mut step = at;
                while step != NOWHERE {
                    way.push(step);
                    step = self.cost[step as usize].2;
                }
                return Some((found, way));
            }
            for near in self.map.around(at) {
                let step = self.step[near as usize];
                if step == 0 {
                    continue;
                }
                let through = cost + step;
                let slot = &mut self.cost[near as usize];
                if slot.0 != self.search || through < slot.1 {
                    *slot = (self.search, through, at);
                    let bucket = (through + EDGE * self.far[near as usize]) as usize % open.len();
                    open[bucket].push(near);
                }
            }
        }
        None
    }

    /// Makes a cell part of the region at hand; corridors past it become costlier or
    /// cheaper.
    fn claim(&mut self, cell: Cell) {
        self.owner[cell as usize] = self.n_regions;
        self.step[cell as usize] = COVERED;
        self.taken.push(cell);
        for near in self.map.around(cell) {
            if self.step[near as usize] == MIDDLE {
                self.step[near as usize] = EDGE;
            }
        }
    }

    /// Cells of the block of `cell` that are left and reachable from it inside.
    fn piece(&self, cell: Cell) -> Vec<Cell> {
        let block = |c: Cell| {
            let (row, col) = self.map.place(c);
            ((row + self.offset.0) / 2, (col + self.offset.1) / 2)
        };
        let mut piece = vec![cell];
        let mut done = 0;
        while let Some(&at) = piece.get(done) {
            done += 1;
            for near in self.map.around(at) {
                if self.is_left(near) && block(near) == block(cell) && !piece.contains(&near) {
                    piece.push(near);
                }
            }
        }
        piece
    }

    /// Gives a UAV the way to `goal`, what lies round it, and then what is left nearest
    /// to that, as long as it has moves.
    fn take(&mut self, uav: usize, goal: Cell, way: Vec<Cell>, moves: u32) {
        for (i, cell) in (0u32..).zip(&way) {
            self.on_way[*cell as usize] = i;
        }
        let mut before = u32::try_from(way.len()).unwrap_or(u32::MAX);
        let moves = moves.saturating_sub(self.detour(&way));
        let mut spent = self.take_round(goal, &mut before, moves);
        for cell in &way {
            self.on_way[*cell as usize] = u32::MAX;
        }
        let prefix = &way[..(before as usize).min(way.len())];
        let mut here = way.get(before as usize).copied();
        let mine = self.lay(prefix);
        self.ways[uav] = mine;
        if self.task.closed
            && let Some(entry) = here
        {
            self.n_regions += 1;
            let back = self.way_back(entry, self.task.roots[uav]);
            let length = u32::try_from(back.len()).unwrap_or(u32::MAX);
            spent += length.saturating_sub(before);
            self.backs[uav] = self.lay(&back);
        }
        while let Some(entry) = here {
            self.entries[uav].push(entry);
            self.n_regions += 1;
            let next = self.nearest_left(entry);
            here = next
                .filter(|(_, d)| spent + self.ways_each() * d + WORTH_A_HOP < moves)
                .map(|(next, mut d)| {
                    spent += self.take_round(next, &mut d, moves - spent);
                    next
                });
        }
        self.n_regions += 1;
    }

    /// Makes what is left on a way a corridor; the cells of it.
    fn lay(&mut self, way: &[Cell]) -> Vec<Cell> {
        let mut mine = Vec::new();
        for cell in way {
            if self.is_left(*cell) {
                self.claim(*cell);
                self.corridor[*cell as usize] = true;
                mine.push(*cell);
            }
        }
        mine
    }

    /// The cheapest corridor from a region's entry to the root.
    fn way_back(&mut self, entry: Cell, root: Cell) -> Vec<Cell> {
        let mut way = self
            .cheapest(entry, |at| (at == root).then_some(()))
            .map(|(_, way)| way)
            .unwrap_or_default();
        way.reverse();
        if way.first() == Some(&entry) {
            way.remove(0);
        }
        way
    }

    /// By how much the way back will be longer than this way out.
    fn detour(&mut self, way: &[Cell]) -> u32 {
        let (true, Some((root, goal))) = (self.task.closed, way.first().zip(way.last())) else {
            return 0;
        };
        let (root, goal) = (*root, *goal);
        let steps: Vec<u32> = way.iter().map(|c| self.step[*c as usize]).collect();
        for cell in way {
            self.step[*cell as usize] = COVERED;
        }
        let back = self.way_back(goal, root);
        for (cell, step) in way.iter().zip(steps) {
            self.step[*cell as usize] = step;
        }
        u32::try_from(back.len().saturating_sub(way.len())).unwrap_or(u32::MAX)
    }

    /// How often a UAV flies the way to its region.
    fn ways_each(&self) -> u32 {
        if self.task.closed { 2 } else { 1 }
    }

    /// Takes cells round `goal`, far ones first, until they and the way `before` them
    /// come to `moves`; the way ends where it first meets them.
    fn take_round(&mut self, goal: Cell, before: &mut u32, moves: u32) -> u32 {
        let ways = self.ways_each();
        let mut cells = 0;
        let mut open: BinaryHeap<(i64, Reverse<Cell>, i64)> = BinaryHeap::new();
        open.push((0, Reverse(goal), 0));
        while let Some((_, Reverse(cell), depth)) = open.pop() {
            if !self.is_left(cell) {
                continue;
            }
            if *before * ways + cells >= moves {
                break;
            }
            for part in self.piece(cell) {
                self.claim(part);
                cells += 1;
                *before = (*before).min(self.on_way[part as usize]);
                for near in self.map.around(part) {
                    if self.is_left(near) {
                        let score = i64::from(self.far[near as usize]) - (depth + 1);
                        open.push((score, Reverse(near), depth + 1));
                    }
                }
            }
        }
        *before * ways + cells
    }

    /// The cell that is left nearest to `from`, and the moves to it.
    fn nearest_left(&mut self, from: Cell) -> Option<(Cell, u32)> {
        self.search += 1;
        let mut open = vec![(from, 0)];
        self.cost[from as usize].0 = self.search;
        let mut done = 0;
        while let Some(&(at, d)) = open.get(done) {
            done += 1;
            if self.is_left(at) {
                return Some((at, d));
            }
            for near in self.map.around(at) {
                if self.map.is_free(near) && self.cost[near as usize].0 != self.search {
                    self.cost[near as usize].0 = self.search;
                    open.push((near, d + 1));
                }
            }
        }
        None
    }

    /// Takes along the small parts of what is left that the cells just taken cut off.
    fn take_pockets(&mut self, from: usize) {
        self.search += 1;
        let mut i = from;
        while let Some(&cell) = self.taken.get(i) {
            i += 1;
            for near in self.map.around(cell) {
                if !self.is_left(near) || self.cost[near as usize].0 == self.search {
                    continue;
                }
                let mut pocket = vec![near];
                self.cost[near as usize].0 = self.search;
                if self.flood(&mut pocket) {
                    for cell in pocket {
                        self.claim(cell);
                    }
                    self.n_regions += 1;
                }
            }
        }
    }

    /// Adds what is left round the first cell; false if that is more than a pocket.
    fn flood(&mut self, pocket: &mut Vec<Cell>) -> bool {
        let mut done = 0;
        let mut small = true;
        while let Some(&at) = pocket.get(done) {
            done += 1;
            if done > POCKET {
                return false;
            }
            for near in self.map.around(at) {
                if !self.is_left(near) {
                    continue;
                }
                if self.cost[near as usize].0 != self.search {
                    self.cost[near as usize].0 = self.search;
                    pocket.push(near);
                } else if !pocket.contains(&near) {
                    // Part of something that was found to be large before.
                    small = false;
                }
            }
        }
        small
    }

    /// Corridors, then loops round what each UAV takes, then what neither reached.
    fn finish(mut self) -> Vec<Vec<Cell>> {
        for cell in self.map.cells() {
            if self.corridor[cell as usize] {
                self.owner[cell as usize] = NOBODY;
            }
        }
        let entries: Vec<Cell> = self.entries.iter().flatten().copied().collect();
        let loops = region_loops(
            self.map,
            &self.owner,
            self.offset,
            Tree::DepthFirst,
            &entries,
        );
        let mut orders = Vec::new();
        for ((way, back), entries) in self.ways.iter().zip(&self.backs).zip(&self.entries) {
            let mut order = way.clone();
            for entry in entries {
                order.extend(loops.from(*entry));
            }
            order.extend(back);
            orders.push(order);
        }
        insert_missing(self.task, orders)
    }
}

/// The cost of a corridor's step onto each cell while nothing is taken yet.
fn steps(map: &LaneMap) -> Vec<u32> {
    let mut steps = vec![0; map.table_len()];
    for cell in map.cells() {
        let inside = map.neighbours(cell).count() == 4;
        steps[cell as usize] = if inside { MIDDLE } else { EDGE };
    }
    steps
}
