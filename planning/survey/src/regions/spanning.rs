//! Closed loops over all cells of a map, from a spanning tree over its 2×2 blocks
//! (D2.7 §3.6.2, algorithm 5), with every cell that no whole block holds attached:
//! D2.7 discards those, which on real maps loses 7 to 99 % of the area.
//!
//! A loop is kept as the cell that comes next to each cell. Where the next one is not a
//! neighbour the loop *hops*: it flies over cells that it has already seen. Several
//! loops are made at once when the cells carry labels (one region a UAV).
//!
//! `skein-flight` has another spanning-tree loop (`coverage::lanes`), and both are wanted.
//! That one is made of curves: whole blocks, whose quarter arcs a fixed wing flies, and
//! excursions, each proved clear of the zones. This one counts moves: it holds every cell,
//! hops, makes several loops at once, and takes milliseconds for a million cells. A walk
//! round a tree is all that they share.
//!
//! Gabriely and Rimon, "Spanning-tree based coverage of continuous areas by a mobile
//! robot", 2001, <https://doi.org/10.1023/A:1016610507833>.
//!
//! Left to others: which tree turns least in which wind, and the curves.

use super::loop_repair::{Mender, detour};
use super::map::{Cell, LaneMap, NOWHERE};

/// Which spanning tree connects the blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tree {
    /// Depth-first: long winding lanes.
    DepthFirst,
    /// Breadth-first: branches that lead straight away from the root.
    BreadthFirst,
    /// Minimum with cheap edges along the rows: lanes along the rows.
    Rows,
    /// Minimum with cheap edges along the columns: lanes along the columns.
    Columns,
}

/// Where the block grid may begin, row and column.
const OFFSETS: [(u32, u32); 4] = [(0, 0), (0, 1), (1, 0), (1, 1)];

/// Other offsets are tried when one in so many moves is over a cell that was seen before:
/// walls that slant or scatter leave much out, and by chance less at another offset.
const MUCH: u64 = 50;

/// On maps of this many cells at most: four loops over more take longer than a tenth of a
/// second.
const FEW: usize = 500_000;

/// The next cell of each cell on its loop.
#[derive(Clone, Debug)]
pub struct Loops {
    /// By cell number; [`NOWHERE`] where no loop passes.
    pub next: Vec<Cell>,
}

impl Loops {
    /// The cells of the loop through `start` in order, from `start`.
    #[must_use]
    pub fn from(&self, start: Cell) -> Vec<Cell> {
        let mut cells = Vec::new();
        let mut at = start;
        loop {
            cells.push(at);
            at = self.next[at as usize];
            if at == start || at == NOWHERE {
                return cells;
            }
        }
    }
}

/// One closed loop over all cells that are reachable from `root`, in order from `root`.
///
/// # Guarantees
/// Each reachable cell is there once. Without cells outside whole blocks, and with
/// blocks that hang together, each cell is a neighbour of the next.
///
/// # Complexity
/// O(N).
#[must_use]
pub fn closed_loop(map: &LaneMap, root: Cell, tree: Tree) -> Vec<Cell> {
    if !map.is_free(root) {
        return Vec::new();
    }
    let offset = best_offset(map);
    let builder = Builder::new(map, |_, _| true);
    builder.build(offset, tree, &[root], false).from(root)
}

/// The same loop with less flown twice: cells that it leaves out are brought together
/// along it, and other offsets of the blocks are tried where much is left.
///
/// # Complexity
/// O(N), about twice the time of [`closed_loop`], and eight times where much is left.
#[must_use]
pub fn lean_loop(map: &LaneMap, root: Cell, tree: Tree) -> Vec<Cell> {
    if !map.is_free(root) {
        return Vec::new();
    }
    let best = best_offset(map);
    let loops = |offset| Builder::new(map, |_, _| true).build(offset, tree, &[root], true);
    let mut found = loops(best);
    let mut twice = flown_twice(map, &found);
    if twice * MUCH > map.n_free() as u64 && map.n_free() <= FEW {
        for offset in OFFSETS.into_iter().filter(|o| *o != best) {
            let other = loops(offset);
            let more = flown_twice(map, &other);
            if more < twice {
                (found, twice) = (other, more);
            }
        }
    }
    found.from(root)
}

/// Moves of the loops beyond one for each cell, at least.
fn flown_twice(map: &LaneMap, loops: &Loops) -> u64 {
    let links = map.cells().map(|c| (c, loops.next[c as usize]));
    let links = links.filter(|(a, b)| *b != NOWHERE && a != b);
    let moves = links.map(|(a, b)| u64::from(map.straight(a, b)) - 1);
    moves.sum()
}

/// One loop a region: `regions` gives each cell's region, and the loop of a region
/// passes the cells of that region that its root reaches within it.
#[must_use]
pub fn region_loops(
    map: &LaneMap,
    regions: &[u32],
    offset: (u32, u32),
    tree: Tree,
    roots: &[Cell],
) -> Loops {
    let same = |a: Cell, b: Cell| regions[a as usize] == regions[b as usize];
    Builder::new(map, same).build(offset, tree, roots, false)
}

/// The row and column offset of the block grid with the most whole blocks.
#[must_use]
pub fn best_offset(map: &LaneMap) -> (u32, u32) {
    let stride = map.stride();
    let mut counts = [0usize; 4];
    for cell in map.cells() {
        if map.is_free(cell + 1) && map.is_free(cell + stride) && map.is_free(cell + stride + 1) {
            let (row, col) = map.place(cell);
            counts[((row & 1) * 2 + (col & 1)) as usize] += 1;
        }
    }
    let best = (0..4).max_by_key(|i| (counts[*i], 4 - i)).unwrap_or(0);
    OFFSETS[best]
}

/// Tree edges of a block, one bit a side.
const EAST: u8 = 1;
const SOUTH: u8 = 2;
const WEST: u8 = 4;
const NORTH: u8 = 8;
/// The block is whole.
const WHOLE: u8 = 16;
/// The block is in the tree.
const SEEN: u8 = 32;

struct Builder<'a, F: Fn(Cell, Cell) -> bool> {
    map: &'a LaneMap,
    /// Whether two neighbours belong to the same region.
    same: F,
    next: Vec<Cell>,
    /// By cell: a member of the same loop nearer to the loop's name.
    name: Vec<Cell>,
}

impl<'a, F: Fn(Cell, Cell) -> bool> Builder<'a, F> {
    fn new(map: &'a LaneMap, same: F) -> Self {
        Self {
            map,
            same,
            next: vec![NOWHERE; map.table_len()],
            name: vec![NOWHERE; map.table_len()],
        }
    }

    fn build(mut self, offset: (u32, u32), tree: Tree, roots: &[Cell], lean: bool) -> Loops {
        let mut blocks = self.blocks(offset);
        self.forest(&mut blocks, tree);
        let loose: Vec<Cell> = self
            .map
            .cells()
            .filter(|c| self.next[*c as usize] == NOWHERE)
            .collect();
        let mut work = loose.clone();
        self.attach_pairs(&mut work);
        for cell in loose {
            if self.next[cell as usize] != NOWHERE {
                self.merge_around(cell);
            }
            for near in self.map.around(cell) {
                if self.map.is_free(near) && self.next[near as usize] != NOWHERE {
                    self.merge_around(near);
                }
            }
        }
        if lean {
            self.mend();
        }
        self.grow(roots);
        Loops { next: self.next }
    }

    /// Brings cells that are still left out together in pairs, which cost nothing.
    fn mend(&mut self) {
        let next = &self.next;
        let loose = self.map.cells().filter(|c| next[*c as usize] == NOWHERE);
        let loose: Vec<Cell> = loose.collect();
        if loose.len() > 1 {
            let same = &self.same;
            Mender::new(self.map, same, &mut self.next).mend(&loose);
        }
    }

    fn linked(&self, a: Cell, b: Cell) -> bool {
        self.map.is_free(b) && (self.same)(a, b)
    }

    /// By the block's north-west cell: whether it is whole.
    fn blocks(&self, offset: (u32, u32)) -> Vec<u8> {
        let stride = self.map.stride();
        let mut blocks = vec![0; self.map.table_len()];
        let mut row = offset.0;
        while row + 1 < self.map.rows() {
            let mut at = ((row + 1) * stride) + 1 + offset.1;
            let mut col = offset.1;
            while col + 1 < self.map.cols() {
                let whole = self.map.is_free(at)
                    && self.linked(at, at + 1)
                    && self.linked(at, at + stride)
                    && self.linked(at, at + stride + 1);
                blocks[at as usize] = if whole { WHOLE } else { 0 };
                at += 2;
                col += 2;
            }
            row += 2;
        }
        blocks
    }

    /// The side and the number of each neighbouring block.
    fn sides(&self, block: Cell) -> [(u8, u8, Cell); 4] {
        let two = 2 * self.map.stride();
        [
            (EAST, WEST, block + 2),
            (SOUTH, NORTH, block + two),
            (WEST, EAST, block.wrapping_sub(2)),
            (NORTH, SOUTH, block.wrapping_sub(two)),
        ]
    }

    /// Spans the blocks by trees and lays the loops round them.
    fn forest(&mut self, blocks: &mut [u8], tree: Tree) {
        let anchors: Vec<Cell> = self
            .map
            .cells()
            .filter(|c| blocks[*c as usize] & WHOLE != 0)
            .collect();
        match tree {
            Tree::Rows => self.join_by_direction(blocks, &anchors, [EAST, SOUTH]),
            Tree::Columns => self.join_by_direction(blocks, &anchors, [SOUTH, EAST]),
            Tree::DepthFirst | Tree::BreadthFirst => self.search(blocks, &anchors, tree),
        }
        for &at in &anchors {
            self.lay(blocks[at as usize], at);
        }
    }

    fn search(&mut self, blocks: &mut [u8], anchors: &[Cell], tree: Tree) {
        let mut open = std::collections::VecDeque::new();
        for &start in anchors {
            if blocks[start as usize] & SEEN != 0 {
                continue;
            }
            blocks[start as usize] |= SEEN;
            self.name[start as usize] = start;
            open.push_back((start, 0u8, NOWHERE));
            while let Some((at, side, from)) = if tree == Tree::DepthFirst {
                open.pop_back()
            } else {
                open.pop_front()
            } {
                // A depth-first edge counts when its far end is popped first by it.
                if from != NOWHERE {
                    if blocks[at as usize] & SEEN != 0 {
                        continue;
                    }
                    blocks[at as usize] |= SEEN | opposite(side);
                    blocks[from as usize] |= side;
                    self.name[at as usize] = start;
                }
                for (out, _, to) in self.sides(at) {
                    let state = blocks.get(to as usize).copied().unwrap_or(0);
                    if state & (WHOLE | SEEN) == WHOLE && (self.same)(at, to) {
                        open.push_back((to, out, at));
                    }
                }
            }
        }
    }

    /// Kruskal's tree with two weights: all edges along the first direction before any
    /// along the second.
    fn join_by_direction(&mut self, blocks: &mut [u8], anchors: &[Cell], order: [u8; 2]) {
        for &at in anchors {
            self.name[at as usize] = at;
        }
        for side in order {
            let step = if side == EAST {
                2
            } else {
                2 * self.map.stride()
            };
            for &at in anchors {
                let to = at + step;
                let whole = blocks.get(to as usize).copied().unwrap_or(0) & WHOLE != 0;
                if whole && (self.same)(at, to) && self.unite(at, to) {
                    blocks[at as usize] |= side;
                    blocks[to as usize] |= opposite(side);
                }
            }
        }
    }

    /// Links the four cells of a block clockwise, and out of it where the tree leads.
    fn lay(&mut self, sides: u8, at: Cell) {
        let stride = self.map.stride();
        let (ne, sw, se) = (at + 1, at + stride, at + stride + 1);
        let pick = |side: u8, out: Cell, on: Cell| if sides & side != 0 { out } else { on };
        self.next[at as usize] = pick(NORTH, at - stride, ne);
        self.next[ne as usize] = pick(EAST, ne + 1, se);
        self.next[se as usize] = pick(SOUTH, se + stride, sw);
        self.next[sw as usize] = pick(WEST, sw - 1, at);
        let name = self.name[at as usize];
        for cell in [ne, sw, se] {
            self.name[cell as usize] = name;
        }
    }

    fn find(&mut self, cell: Cell) -> Cell {
        let mut at = cell;
        loop {
            let up = self.name[at as usize];
            if up == at {
                return at;
            }
            // Halving the way keeps later searches short.
            self.name[at as usize] = self.name[up as usize];
            at = up;
        }
    }

    fn unite(&mut self, a: Cell, b: Cell) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        let (low, high) = (a.min(b), a.max(b));
        self.name[high as usize] = low;
        low != high
    }

    /// Lengthens a loop by two neighbours that lie beside one of its edges: no cell is
    /// flown twice for them. `work` is cells that may be one of such a pair.
    fn attach_pairs(&mut self, work: &mut Vec<Cell>) {
        while let Some(x) = work.pop() {
            if self.next[x as usize] != NOWHERE {
                continue;
            }
            if let Some(y) = self.attach_pair(x, None) {
                for cell in [x, y] {
                    for near in self.map.around(cell) {
                        if self.map.is_free(near) && self.next[near as usize] == NOWHERE {
                            work.push(near);
                        }
                    }
                }
            }
        }
    }

    /// Attaches a cell and a neighbour of it to a loop: to one of `mine`, if given.
    fn attach_pair(&mut self, x: Cell, mine: Option<&[bool]>) -> Option<Cell> {
        let around = self.map.around(x);
        for (i, y) in around.into_iter().enumerate() {
            if !self.linked(x, y) || self.next[y as usize] != NOWHERE {
                continue;
            }
            for u in [around[(i + 1) % 4], around[(i + 3) % 4]] {
                // The unit square x, y, v, u.
                let v = (u + y).wrapping_sub(x);
                if !self.linked(x, u) || !self.linked(y, v) {
                    continue;
                }
                if mine.is_some_and(|mine| !mine[u as usize]) {
                    continue;
                }
                let Some([from, first, second, to]) = detour(&self.next, (u, v), (x, y)) else {
                    continue;
                };
                self.next[from as usize] = first;
                self.next[first as usize] = second;
                self.next[second as usize] = to;
                self.name[x as usize] = self.name[u as usize];
                self.name[y as usize] = self.name[u as usize];
                return Some(y);
            }
        }
        None
    }

    /// Joins the loop that leaves `u` to another loop that runs the other way beside it,
    /// across a unit square: no cell is flown twice for it.
    fn merge_around(&mut self, u: Cell) {
        for x in self.map.around(u) {
            let v = self.next[u as usize];
            if !self.map.adjacent(u, v) {
                return;
            }
            if x == v || !self.linked(u, x) || self.next[x as usize] == NOWHERE {
                continue;
            }
            let y = (v + x).wrapping_sub(u);
            if self.map.is_free(y)
                && self.next[y as usize] == x
                && self.linked(v, y)
                && self.unite(u, x)
            {
                self.next[u as usize] = x;
                self.next[y as usize] = v;
            }
        }
    }

    /// Reaches everything that is left from the roots: loops by a hop across and back,
    /// single cells by a step aside.
    fn grow(&mut self, roots: &[Cell]) {
        let mut open = Vec::new();
        for &root in roots {
            if self.next[root as usize] == NOWHERE {
                self.next[root as usize] = root;
                self.name[root as usize] = root;
            }
            self.push_loop(root, &mut open);
        }
        let mut mine = vec![false; self.map.table_len()];
        for cell in &open {
            mine[*cell as usize] = true;
        }
        let mut done = 0;
        let mut pairs = Vec::new();
        while let Some(&u) = open.get(done) {
            done += 1;
            for w in self.map.around(u) {
                if !self.linked(u, w) || mine[w as usize] {
                    continue;
                }
                let from = open.len();
                if self.next[w as usize] == NOWHERE {
                    self.next[w as usize] = w;
                    self.name[w as usize] = w;
                }
                self.push_loop(w, &mut open);
                self.unite(u, w);
                self.next.swap(u as usize, w as usize);
                // Pairs beside the new edges come free.
                for i in from..open.len() {
                    mine[open[i] as usize] = true;
                }
                if open.len() - from == 1 {
                    pairs.extend(
                        self.map
                            .around(w)
                            .into_iter()
                            .filter(|c| self.map.is_free(*c)),
                    );
                    self.take_pairs(&mut pairs, &mut open, &mut mine);
                }
            }
        }
    }

    fn take_pairs(&mut self, pairs: &mut Vec<Cell>, open: &mut Vec<Cell>, mine: &mut [bool]) {
        while let Some(x) = pairs.pop() {
            if self.next[x as usize] != NOWHERE {
                continue;
            }
            if let Some(y) = self.attach_pair(x, Some(mine)) {
                for cell in [x, y] {
                    mine[cell as usize] = true;
                    open.push(cell);
                    pairs.extend(
                        self.map
                            .around(cell)
                            .into_iter()
                            .filter(|c| self.map.is_free(*c)),
                    );
                }
            }
        }
    }

    fn push_loop(&self, start: Cell, open: &mut Vec<Cell>) {
        let mut at = start;
        loop {
            open.push(at);
            at = self.next[at as usize];
            if at == start {
                return;
            }
        }
    }
}

fn opposite(side: u8) -> u8 {
    match side {
        EAST => WEST,
        SOUTH => NORTH,
        WEST => EAST,
        _ => SOUTH,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn hops(map: &LaneMap, order: &[Cell]) -> usize {
        let last = order.last().copied().unwrap();
        let pairs = order
            .windows(2)
            .map(|w| (w[0], w[1]))
            .chain([(last, order[0])]);
        pairs.filter(|(a, b)| !map.adjacent(*a, *b)).count()
    }

    #[test]
    fn whole_blocks_make_a_loop_without_a_hop() {
        for tree in [
            Tree::DepthFirst,
            Tree::BreadthFirst,
            Tree::Rows,
            Tree::Columns,
        ] {
            // A ring of blocks: all trees are paths here, and one edge is left out.
            let map =
                LaneMap::new(12, 16, |r, c| !(4..8).contains(&r) || !(6..10).contains(&c)).unwrap();
            let root = map.cell(3, 3).unwrap();
            let order = closed_loop(&map, root, tree);
            assert_eq!(order.len(), map.n_free());
            assert_eq!(hops(&map, &order), 0, "{tree:?}");
        }
    }

    #[test]
    fn lanes_follow_the_direction_of_the_tree() {
        let map = LaneMap::new(20, 20, |_, _| true).unwrap();
        let turns = |tree| {
            let order = closed_loop(&map, map.cell(0, 0).unwrap(), tree);
            let bends = order.windows(3).filter(|w| w[1] + w[1] != w[0] + w[2]);
            bends.count()
        };
        assert!(turns(Tree::Rows) < 50, "{}", turns(Tree::Rows));
        assert!(turns(Tree::Columns) < 50, "{}", turns(Tree::Columns));
    }

    /// Walls that slant, with holes in them.
    fn slanting() -> LaneMap {
        LaneMap::new(60, 60, |r, c| (r + c) % 23 > 4 || (r * c) % 7 == 0).unwrap()
    }

    #[test]
    fn mending_leaves_fewer_cells_to_step_aside_for() {
        let map = slanting();
        let root = map.cells().next().unwrap();
        let mut builder = Builder::new(&map, |_, _| true);
        let mut blocks = builder.blocks((0, 0));
        builder.forest(&mut blocks, Tree::Rows);
        let loose = |b: &Builder<_>| {
            map.cells()
                .filter(|c| b.next[*c as usize] == NOWHERE)
                .count()
        };
        let mut work: Vec<Cell> = map
            .cells()
            .filter(|c| builder.next[*c as usize] == NOWHERE)
            .collect();
        builder.attach_pairs(&mut work);
        let before = loose(&builder);
        builder.mend();
        let after = loose(&builder);
        assert!(after < before, "{after} of {before}");
        // Two at a time, one of each colour.
        assert_eq!((before - after) % 2, 0);
        builder.grow(&[root]);
        let order = Loops { next: builder.next }.from(root);
        assert_eq!(order.len(), map.reachable(&[root]).n_free());
    }

    proptest! {
        #[test]
        fn each_reachable_cell_is_there_once(
            free in prop::collection::vec(prop::bool::weighted(0.8), 24 * 22),
            pick in any::<prop::sample::Index>(),
            tree in prop::sample::select(vec![
                Tree::DepthFirst, Tree::BreadthFirst, Tree::Rows, Tree::Columns
            ]),
        ) {
            let map = LaneMap::new(24, 22, |r, c| free[(r * 22 + c) as usize]).unwrap();
            let cells: Vec<Cell> = map.cells().collect();
            prop_assume!(!cells.is_empty());
            let root = cells[pick.index(cells.len())];
            let reachable: Vec<Cell> = map.reachable(&[root]).cells().collect();
            for laid in [closed_loop, lean_loop] {
                let mut order = laid(&map, root, tree);
                prop_assert_eq!(order[0], root);
                order.sort_unstable();
                prop_assert_eq!(&order, &reachable);
            }
        }
    }
}
