//! A region for each UAV: connected, holding its root, and as large as it can fly in the
//! common time (D2.7 §3.6.3–3.6.4 divide by trees; here nothing is covered twice).
//!
//! Regions are made of *pieces*: the connected free cells of one 2×2 block, so that a
//! loop round a region's blocks covers it without a repeat. All regions grow at once;
//! then pieces pass across borders from regions with too much to regions with too little,
//! regions that no border can even are settled anew, and regions go to the UAVs that they
//! suit.
//!
//! Left to others: which pieces may pass, which regions are settled anew, the path through
//! a region, and the balance of single cells.

pub(super) mod assign;
mod border_moves;
mod resettle;

use super::map::{Cell, LaneMap, NOWHERE, UNREACHED};
use super::plan::Task;
use super::root_distances::Home;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Regions of a task.
#[derive(Clone, Debug)]
pub struct Regions {
    /// By cell number: the UAV whose region it is; [`NOBODY`] for blocked cells.
    pub owner: Vec<u32>,
    /// By UAV: the cell at which it enters its region; `None` for an empty region.
    pub entry: Vec<Option<Cell>>,
}

/// The owner of cells that belong to no region.
pub const NOBODY: u32 = u32::MAX;

/// A region is small below one part in this many of an even share.
const SMALL: i64 = 16;

/// More UAVs than this keep the regions that they grew: the time to assign them grows with
/// the cube.
const MOST_ASSIGNED: usize = 256;

/// Times that regions are given to the UAVs that they suit before their borders move
/// against the grain.
const ASSIGNED: usize = 2;

/// Cells a UAV below which regions that are far from even are worth assigning: with long
/// arcs work is peeled off instead.
const SHORT: usize = 100;

/// Units of time in one move of the fastest UAV.
const PACE: i64 = 16;

/// The connected free cells of one block.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    cells: [Cell; 4],
    n: u32,
}

pub(super) struct Partition<'a> {
    task: &'a Task,
    home: &'a Home,
    /// By cell: its piece.
    piece_of: Vec<u32>,
    pieces: Vec<Piece>,
    /// By piece: neighbouring pieces, from `links[first[i]]` on.
    first: Vec<u32>,
    links: Vec<u32>,
    owner: Vec<u32>,
    /// By region: the piece where it begins, moves to get there, and its cells.
    seed: Vec<u32>,
    entry: Vec<i64>,
    size: Vec<i64>,
    /// By region: moves that its path was seen to take beyond one a cell and the way.
    waste: Vec<i64>,
    /// By region: time of one move.
    pace: Vec<i64>,
    /// For searches: the last search that saw a piece.
    seen: Vec<u32>,
    search: u32,
    /// Pieces that are to change hands together, and pieces that a search has found.
    part: Vec<u32>,
    found: Vec<u32>,
}

/// Divides a task's cells among its UAVs, with blocks at `offset`.
///
/// # Guarantees
/// Each free cell belongs to one region; a region is connected.
///
/// # Complexity
/// O(N log N) to grow, O(N) for each of at most 400 sweeps.
#[must_use]
pub fn regions(task: &Task, offset: (u32, u32)) -> Regions {
    Partition::grown(task, &Home::new(task), offset).regions()
}

impl<'a> Partition<'a> {
    /// Regions that all grew at once, evened by cells.
    pub(super) fn grown(task: &'a Task, home: &'a Home, offset: (u32, u32)) -> Self {
        let mut p = Self::new(task, home, offset);
        p.sow();
        p.grow();
        p.balance();
        p
    }

    /// Gives regions to the UAVs that they suit, and shakes the borders: what is shut in
    /// between others has to pass through them.
    pub(super) fn shake(&mut self) {
        for _ in 0..ASSIGNED {
            self.resettle();
            self.reassign();
            self.balance();
        }
        let short = self.task.map.n_free() < SHORT * self.seed.len();
        for _ in 0..ASSIGNED {
            if short || !self.hopeless() {
                self.reassign();
                self.balance();
            }
        }
        if self.hopeless() {
            return;
        }
        self.anneal();
        self.balance();
        self.reassign();
        self.balance();
    }

    /// Evens the regions again, now that their paths are known to take `moves`: a region
    /// of corridors and corners takes more than its cells.
    pub(super) fn even(&mut self, moves: &[i64]) {
        for (uav, moves) in moves.iter().enumerate() {
            let seen = moves - self.entry[uav] - self.size[uav];
            // Half the difference at a time: the borders that move change the waste too.
            self.waste[uav] = self.waste[uav].midpoint(seen);
        }
        self.resettle();
        self.balance();
        self.reassign();
        self.balance();
    }

    /// Gives each region to the UAV that it suits, so that the times are most even.
    fn reassign(&mut self) {
        let n = self.seed.len();
        if n > MOST_ASSIGNED || self.seed.contains(&NOBODY) {
            return;
        }
        // By UAV and region: the way to the nearest piece, and that piece.
        let mut nearest = vec![(i64::MAX, NOBODY); n * n];
        for (uav, ways) in nearest.chunks_mut(n).enumerate() {
            for (piece, owner) in (0u32..).zip(&self.owner) {
                if let Some(way) = ways.get_mut(*owner as usize) {
                    *way = (*way).min((self.way(uav, piece), piece));
                }
            }
        }
        let time = |uav: usize, region: usize| {
            let moves = nearest[uav * n + region].0 + self.size[region] + self.waste[region];
            moves * self.pace[uav] / PACE
        };
        let region_of = assign::assign(n, |uav, region| time(uav, region).pow(2));
        let mut uav_of = vec![NOBODY; n];
        let (size, waste) = (self.size.clone(), self.waste.clone());
        for (uav, region) in region_of.iter().enumerate() {
            uav_of[*region] = u32::try_from(uav).unwrap_or(NOBODY);
            (self.entry[uav], self.seed[uav]) = nearest[uav * n + region];
            self.size[uav] = size[*region];
            self.waste[uav] = waste[*region];
        }
        for owner in &mut self.owner {
            *owner = uav_of.get(*owner as usize).copied().unwrap_or(NOBODY);
        }
    }

    /// Moves that the way of a UAV to a piece costs it.
    fn way(&self, uav: usize, piece: u32) -> i64 {
        let root = self.task.roots[uav];
        let moves = |cell: &Cell| self.moves(root, *cell);
        let least = self.pieces[piece as usize].cells().iter().map(moves).min();
        let ways = if self.task.closed { 2 } else { 1 };
        ways * i64::from(least.unwrap_or(0))
    }

    fn moves(&self, root: Cell, cell: Cell) -> u32 {
        let known = self.home.moves(root, cell);
        known.unwrap_or_else(|| self.task.map.straight(root, cell))
    }

    pub(super) fn new(task: &'a Task, home: &'a Home, offset: (u32, u32)) -> Self {
        let map = &task.map;
        let (piece_of, pieces) = cut(map, offset);
        let (mut first, mut links) = (vec![0], Vec::new());
        for (i, piece) in (0u32..).zip(&pieces) {
            let from = links.len();
            for cell in &piece.cells[..piece.n as usize] {
                for near in map.neighbours(*cell) {
                    let other = piece_of[near as usize];
                    if other != i && !links[from..].contains(&other) {
                        links.push(other);
                    }
                }
            }
            first.push(u32::try_from(links.len()).unwrap_or(u32::MAX));
        }
        let fastest = i64::from(task.speeds.iter().copied().max().unwrap_or(1));
        let n = pieces.len();
        Self {
            task,
            home,
            piece_of,
            pieces,
            first,
            links,
            owner: vec![NOBODY; n],
            seed: vec![NOBODY; task.n_uavs()],
            entry: vec![0; task.n_uavs()],
            size: vec![0; task.n_uavs()],
            waste: vec![0; task.n_uavs()],
            pace: task
                .speeds
                .iter()
                .map(|v| PACE * fastest / i64::from((*v).max(1)))
                .collect(),
            seen: vec![0; n],
            search: 0,
            part: Vec::new(),
            found: Vec::new(),
        }
    }

    fn near(&self, piece: u32) -> core::ops::Range<usize> {
        self.first[piece as usize] as usize..self.first[piece as usize + 1] as usize
    }

    fn load(&self, uav: usize) -> i64 {
        (self.entry[uav] + self.size[uav] + self.waste[uav]) * self.pace[uav]
    }

    fn cells(&self, piece: u32) -> i64 {
        i64::from(self.pieces[piece as usize].n)
    }

    /// Gives each UAV the nearest piece that nobody has yet.
    fn sow(&mut self) {
        for uav in 0..self.task.n_uavs() {
            if self.task.map.is_free(self.task.roots[uav]) {
                self.settle(uav);
            }
        }
    }

    /// Begins a region at the unclaimed piece that is nearest to its root.
    fn settle(&mut self, uav: usize) -> bool {
        let root = self.task.roots[uav];
        self.search += 1;
        let mut queue = vec![self.piece_of[root as usize]];
        self.seen[queue[0] as usize] = self.search;
        let mut done = 0;
        while let Some(&at) = queue.get(done) {
            done += 1;
            if self.owner[at as usize] == NOBODY {
                self.owner[at as usize] = u32::try_from(uav).unwrap_or(NOBODY);
                self.begin_at(uav, at);
                self.size[uav] = self.cells(at);
                return true;
            }
            for i in self.near(at) {
                let to = self.links[i];
                if self.seen[to as usize] != self.search {
                    self.seen[to as usize] = self.search;
                    queue.push(to);
                }
            }
        }
        false
    }

    fn begin_at(&mut self, uav: usize, piece: u32) {
        self.seed[uav] = piece;
        self.entry[uav] = self.way(uav, piece);
    }

    /// The region with least to fly takes the next piece, nearest to its seed. A region
    /// that is shut in while still small begins anew outside.
    fn grow(&mut self) {
        let share = self.task.map.n_free() as i64 / self.seed.len().max(1) as i64;
        let mut turns: BinaryHeap<Reverse<(i64, usize)>> = BinaryHeap::new();
        let mut fringes: Vec<BinaryHeap<Reverse<(u32, u32)>>> = Vec::new();
        for uav in 0..self.seed.len() {
            let mut fringe = BinaryHeap::new();
            if self.seed[uav] != NOBODY {
                fringe.extend(
                    self.near(self.seed[uav])
                        .map(|i| Reverse((1, self.links[i]))),
                );
            }
            turns.push(Reverse((self.load(uav), uav)));
            fringes.push(fringe);
        }
        while let Some(Reverse((_, uav))) = turns.pop() {
            let mut taken = self.take(uav, &mut fringes[uav]);
            if !taken && self.size[uav] < share / SMALL {
                let old = self.seed[uav];
                taken = self.settle(uav);
                if taken {
                    let seed = self.seed[uav];
                    self.give_away(uav, old, seed);
                    fringes[uav].extend(self.near(seed).map(|i| Reverse((1, self.links[i]))));
                }
            }
            if taken {
                turns.push(Reverse((self.load(uav), uav)));
            }
        }
    }

    /// Takes the next free piece of a fringe.
    fn take(&mut self, uav: usize, fringe: &mut BinaryHeap<Reverse<(u32, u32)>>) -> bool {
        while let Some(Reverse((depth, piece))) = fringe.pop() {
            if self.owner[piece as usize] != NOBODY {
                continue;
            }
            self.owner[piece as usize] = u32::try_from(uav).unwrap_or(NOBODY);
            self.size[uav] += self.cells(piece);
            for i in self.near(piece) {
                let to = self.links[i];
                if self.owner[to as usize] == NOBODY {
                    fringe.push(Reverse((depth + 1, to)));
                }
            }
            return true;
        }
        false
    }

    /// Gives the pieces of a region around `old` to the neighbours, but for `kept`.
    fn give_away(&mut self, uav: usize, old: u32, kept: u32) {
        let Ok(me) = u32::try_from(uav) else { return };
        if old == NOBODY {
            return;
        }
        let mut mine = vec![old];
        let mut done = 0;
        self.search += 1;
        self.seen[old as usize] = self.search;
        self.seen[kept as usize] = self.search;
        while let Some(&at) = mine.get(done) {
            done += 1;
            for i in self.near(at) {
                let to = self.links[i];
                if self.owner[to as usize] == me && self.seen[to as usize] != self.search {
                    self.seen[to as usize] = self.search;
                    mine.push(to);
                }
            }
        }
        // Where nobody else is near the pieces are free again.
        for piece in self.disperse(me, mine) {
            self.owner[piece as usize] = NOBODY;
        }
    }

    /// Gives pieces to the neighbours that they touch, those with least to fly first, and
    /// what these shut in then; what no neighbour can have is left.
    fn disperse(&mut self, from: u32, mut pieces: Vec<u32>) -> Vec<u32> {
        let mut before = usize::MAX;
        while pieces.len() < before {
            before = pieces.len();
            pieces.retain(|piece| {
                let heirs = self
                    .near(*piece)
                    .map(|i| self.owner[self.links[i] as usize]);
                let heirs = heirs.filter(|o| *o != from && *o != NOBODY);
                let Some(to) = heirs.min_by_key(|o| self.load(*o as usize)) else {
                    return true;
                };
                self.owner[*piece as usize] = to;
                let heir = to as usize;
                self.size[heir] += self.cells(*piece);
                let way = self.way(heir, *piece);
                if way < self.entry[heir] {
                    (self.entry[heir], self.seed[heir]) = (way, *piece);
                }
                false
            });
        }
        pieces
    }

    /// Whether the regions are still so uneven that sweeps will not help.
    pub(super) fn hopeless(&self) -> bool {
        let loads = (0..self.seed.len()).map(|u| self.load(u));
        let sum: i64 = loads.clone().sum();
        let most = loads.max().unwrap_or(0);
        most * 2 * self.seed.len() as i64 > sum * 3
    }

    /// The regions by cell.
    pub(super) fn regions(&self) -> Regions {
        let map = &self.task.map;
        let mut owner = vec![NOBODY; map.table_len()];
        for cell in map.cells() {
            owner[cell as usize] = self.owner[self.piece_of[cell as usize] as usize];
        }
        let mut entry = Vec::new();
        for (uav, root) in self.task.roots.iter().enumerate() {
            let seed = self.seed[uav];
            entry.push((seed != NOBODY).then(|| {
                let piece = &self.pieces[seed as usize];
                let cells = piece.cells[..piece.n as usize].iter().copied();
                cells
                    .min_by_key(|c| (self.moves(*root, *c), *c))
                    .unwrap_or(NOWHERE)
            }));
        }
        Regions { owner, entry }
    }
}

impl Piece {
    /// Its cells.
    #[must_use]
    pub fn cells(&self) -> &[Cell] {
        &self.cells[..self.n as usize]
    }
}

/// Cuts the free cells into the connected parts of blocks.
#[must_use]
pub fn cut(map: &LaneMap, offset: (u32, u32)) -> (Vec<u32>, Vec<Piece>) {
    let mut piece_of = vec![UNREACHED; map.table_len()];
    let mut pieces: Vec<Piece> = Vec::new();
    let block = |cell: Cell| {
        let (row, col) = map.place(cell);
        ((row + offset.0) / 2, (col + offset.1) / 2)
    };
    for cell in map.cells() {
        if piece_of[cell as usize] != UNREACHED {
            continue;
        }
        let id = u32::try_from(pieces.len()).unwrap_or(UNREACHED);
        let mut piece = Piece {
            cells: [cell; 4],
            n: 1,
        };
        piece_of[cell as usize] = id;
        let mut done = 0;
        while done < piece.n {
            let at = piece.cells[done as usize];
            done += 1;
            for near in map.neighbours(at) {
                if piece_of[near as usize] == UNREACHED && block(near) == block(cell) {
                    piece_of[near as usize] = id;
                    piece.cells[piece.n as usize] = near;
                    piece.n += 1;
                }
            }
        }
        pieces.push(piece);
    }
    (piece_of, pieces)
}
