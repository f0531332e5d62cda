//! Which crossings between cells a shortest path can use at all.
//!
//! A shortest path enters no convex cell twice, so it is a simple path in the
//! graph of cells, and a simple path stays in the blocks (biconnected parts)
//! between its ends. Everything else (bays, culs-de-sac, chains of rooms behind
//! one door) is skipped by comparing a mark.

use super::{HalfEdge, NONE};

/// The blocks of the graph of cells, as a forest: cell, its block, the block's top cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blocks {
    /// The block through which a cell hangs on its parent; [`NONE`] for a root.
    pub above: Vec<u32>,
    /// The cell nearest to the root in each block.
    pub top: Vec<u32>,
    /// How many blocks lie between a cell and its root.
    depth: Vec<u32>,
    /// The root cell of each cell's component.
    root: Vec<u32>,
}

/// A cell on the way down of the depth-first walk.
struct Visit {
    cell: u32,
    /// The half-edge through which it was entered, seen from the parent.
    entry: u32,
    /// The next half-edge to look at.
    next: u32,
}

/// The state of Tarjan's walk.
struct Walk<'a> {
    edges: &'a mut [HalfEdge],
    starts: &'a [u32],
    order: Vec<u32>,
    low: Vec<u32>,
    clock: u32,
    path: Vec<Visit>,
    open: Vec<u32>,
    blocks: Blocks,
}

impl Blocks {
    /// Finds the blocks and writes each crossing's block into its half-edges.
    pub fn of(edges: &mut [HalfEdge], starts: &[u32]) -> Self {
        let n = starts.len() - 1;
        let mut walk = Walk {
            edges,
            starts,
            order: vec![NONE; n],
            low: vec![NONE; n],
            clock: 0,
            path: Vec::new(),
            open: Vec::new(),
            blocks: Self {
                above: vec![NONE; n],
                top: Vec::new(),
                depth: vec![0; n],
                root: vec![NONE; n],
            },
        };
        let mut by_order = Vec::with_capacity(n);
        for cell in 0..n as u32 {
            if walk.order[cell as usize] == NONE {
                walk.from(cell, &mut by_order);
            }
        }
        let mut blocks = walk.blocks;
        // Parents were found before their children, so one pass sets all depths.
        for &cell in &by_order {
            let block = blocks.above[cell as usize];
            if block != NONE {
                let top = blocks.top[block as usize];
                blocks.depth[cell as usize] = blocks.depth[top as usize] + 1;
            }
        }
        blocks
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.top.len()
    }

    /// Whether two cells are connected.
    pub fn joined(&self, a: u32, b: u32) -> bool {
        self.root[a as usize] == self.root[b as usize]
    }

    /// The root cell of the component with the most cells.
    pub fn largest_part(&self) -> u32 {
        let mut sizes = vec![0u32; self.root.len()];
        for &root in &self.root {
            sizes[root as usize] += 1;
        }
        let largest = (0..sizes.len()).max_by_key(|&c| (sizes[c], std::cmp::Reverse(c)));
        largest.unwrap_or(0) as u32
    }

    /// Calls `mark` with each block between two connected cells, and its top cell.
    pub fn between(&self, mut a: u32, mut b: u32, mut mark: impl FnMut(u32, u32)) {
        while a != b {
            if self.depth[a as usize] < self.depth[b as usize] {
                std::mem::swap(&mut a, &mut b);
            }
            let block = self.above[a as usize];
            if block == NONE {
                return;
            }
            a = self.top[block as usize];
            mark(block, a);
        }
    }
}

impl Walk<'_> {
    /// Walks one component, without recursion: corridors may be long.
    fn from(&mut self, root: u32, by_order: &mut Vec<u32>) {
        self.enter(root, NONE, root, by_order);
        while let Some(visit) = self.path.last_mut() {
            let (cell, entry, e) = (visit.cell, visit.entry, visit.next);
            if e == self.starts[cell as usize + 1] {
                self.leave();
                continue;
            }
            visit.next += 1;
            let twin = self.edges[e as usize].twin;
            // Back over the very crossing that led here says nothing.
            if twin == NONE || twin == entry {
                continue;
            }
            let other = self.edges[twin as usize].cell;
            let seen = self.order[other as usize];
            if seen == NONE {
                self.open.push(e);
                self.enter(other, e, root, by_order);
            } else if seen < self.order[cell as usize] {
                self.open.push(e);
                let low = &mut self.low[cell as usize];
                *low = seen.min(*low);
            }
        }
    }

    fn enter(&mut self, cell: u32, entry: u32, root: u32, by_order: &mut Vec<u32>) {
        self.order[cell as usize] = self.clock;
        self.low[cell as usize] = self.clock;
        self.clock += 1;
        self.blocks.root[cell as usize] = root;
        by_order.push(cell);
        self.path.push(Visit {
            cell,
            entry,
            next: self.starts[cell as usize],
        });
    }

    /// Ends the last cell of the path; closes a block if nothing below reaches higher.
    fn leave(&mut self) {
        let Some(child) = self.path.pop() else { return };
        let Some(parent) = self.path.last().map(|v| v.cell) else {
            return;
        };
        let low = self.low[child.cell as usize];
        if low < self.order[parent as usize] {
            let above = &mut self.low[parent as usize];
            *above = low.min(*above);
            return;
        }
        let block = self.blocks.top.len() as u32;
        self.blocks.top.push(parent);
        while let Some(e) = self.open.pop() {
            let twin = self.edges[e as usize].twin;
            self.edges[e as usize].block = block;
            self.edges[twin as usize].block = block;
            // A tree crossing was opened by the walk downwards: its far cell hangs here.
            let (near, far) = (self.edges[e as usize].cell, self.edges[twin as usize].cell);
            if self.order[far as usize] > self.order[near as usize] {
                self.blocks.above[far as usize] = block;
            }
            if e == child.entry {
                return;
            }
        }
    }
}
