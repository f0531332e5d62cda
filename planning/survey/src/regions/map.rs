//! The lane-cell map: which cells may be flown, and how far apart they are when a UAV
//! moves to one of the four neighbours at a time (D2.7 §3.6.2).
//!
//! Cells are numbered densely with a blocked border, and rows are a power of two apart,
//! so that a neighbour is an addition and a row is a shift.

use thiserror::Error;

/// A cell's number on its map.
pub type Cell = u32;

/// No cell: the border's first corner, which no map ever frees.
pub const NOWHERE: Cell = 0;

/// The number of moves to a cell that cannot be reached.
pub const UNREACHED: u32 = u32::MAX;

/// Rows times columns may not exceed this: numbers of cells and sums of moves over all
/// UAVs stay within 32 bits.
const MOST_CELLS: u64 = 1 << 28;

/// Why there is no map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum MapError {
    /// The map is larger than cell numbers allow; nothing was built.
    #[error("a map of {rows} by {cols} cells is too large")]
    TooLarge {
        /// Rows asked for.
        rows: u32,
        /// Columns asked for.
        cols: u32,
    },
}

/// Which cells are free.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LaneMap {
    rows: u32,
    cols: u32,
    shift: u32,
    free: Vec<bool>,
    n_free: usize,
}

impl LaneMap {
    /// A map in which `free(row, column)` says which cells may be flown.
    ///
    /// # Errors
    /// When the map is too large to number its cells.
    pub fn new(
        rows: u32,
        cols: u32,
        mut free: impl FnMut(u32, u32) -> bool,
    ) -> Result<Self, MapError> {
        let too_large = MapError::TooLarge { rows, cols };
        let width = u64::from(cols) + 2;
        Self::check(rows, cols)?;
        let padded = width.next_power_of_two() * (u64::from(rows) + 2);
        let size = usize::try_from(padded).map_err(|_| too_large)?;
        let mut map = Self {
            rows,
            cols,
            shift: width.next_power_of_two().trailing_zeros(),
            free: vec![false; size],
            n_free: 0,
        };
        for row in 0..rows {
            for col in 0..cols {
                if free(row, col) {
                    let at = map.number(row, col) as usize;
                    map.free[at] = true;
                    map.n_free += 1;
                }
            }
        }
        Ok(map)
    }

    /// Whether a map of this size can be made.
    ///
    /// # Errors
    /// When it is too large to number its cells.
    pub fn check(rows: u32, cols: u32) -> Result<(), MapError> {
        let width = u64::from(cols) + 2;
        if width
            .next_power_of_two()
            .saturating_mul(u64::from(rows) + 2)
            > MOST_CELLS
        {
            return Err(MapError::TooLarge { rows, cols });
        }
        Ok(())
    }

    fn number(&self, row: u32, col: u32) -> Cell {
        ((row + 1) << self.shift) + col + 1
    }

    /// The number of a free cell.
    #[must_use]
    pub fn cell(&self, row: u32, col: u32) -> Option<Cell> {
        let inside = row < self.rows && col < self.cols;
        let cell = if inside {
            self.number(row, col)
        } else {
            NOWHERE
        };
        self.is_free(cell).then_some(cell)
    }

    /// Row and column of a cell, from 0.
    #[must_use]
    pub fn place(&self, cell: Cell) -> (u32, u32) {
        let (row, col) = (cell >> self.shift, cell & ((1 << self.shift) - 1));
        (row.wrapping_sub(1), col.wrapping_sub(1))
    }

    /// Whether a cell may be flown.
    #[must_use]
    pub fn is_free(&self, cell: Cell) -> bool {
        self.free.get(cell as usize).copied().unwrap_or(false)
    }

    /// Rows of the map.
    #[must_use]
    pub fn rows(&self) -> u32 {
        self.rows
    }

    /// Columns of the map.
    #[must_use]
    pub fn cols(&self) -> u32 {
        self.cols
    }

    /// How many cells are free.
    #[must_use]
    pub fn n_free(&self) -> usize {
        self.n_free
    }

    /// How far apart the numbers of two cells in the same column of neighbouring rows
    /// are.
    #[must_use]
    pub fn stride(&self) -> u32 {
        1 << self.shift
    }

    /// One more than the largest cell number: how long a table by cell is.
    #[must_use]
    pub fn table_len(&self) -> usize {
        self.free.len()
    }

    /// The numbers east, south, west and north of a free cell, blocked ones too.
    #[must_use]
    pub fn around(&self, cell: Cell) -> [Cell; 4] {
        let stride = self.stride();
        [cell + 1, cell + stride, cell - 1, cell - stride]
    }

    /// The free neighbours of a free cell.
    pub fn neighbours(&self, cell: Cell) -> impl Iterator<Item = Cell> + '_ {
        self.around(cell)
            .into_iter()
            .filter(|c| self.free[*c as usize])
    }

    /// All free cells, row by row.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + '_ {
        (0u32..)
            .zip(&self.free)
            .filter(|(_, f)| **f)
            .map(|(c, _)| c)
    }

    /// Whether two cells are neighbours by number.
    #[must_use]
    pub fn adjacent(&self, a: Cell, b: Cell) -> bool {
        let apart = a.abs_diff(b);
        apart == 1 || apart == self.stride()
    }

    /// Moves between two cells if nothing were in the way.
    #[must_use]
    pub fn straight(&self, a: Cell, b: Cell) -> u32 {
        let mask = self.stride() - 1;
        (a >> self.shift).abs_diff(b >> self.shift) + (a & mask).abs_diff(b & mask)
    }

    /// Moves from the nearest of `roots` to each cell, by cell number; [`UNREACHED`]
    /// elsewhere.
    #[must_use]
    pub fn distances(&self, roots: &[Cell]) -> Vec<u32> {
        let mut moves = vec![UNREACHED; self.table_len()];
        let mut layer: Vec<Cell> = Vec::new();
        for &root in roots {
            if self.is_free(root) && moves[root as usize] == UNREACHED {
                moves[root as usize] = 0;
                layer.push(root);
            }
        }
        let mut next = Vec::new();
        let mut depth = 0;
        while !layer.is_empty() {
            depth += 1;
            for &cell in &layer {
                for near in self.around(cell) {
                    if self.free[near as usize] && moves[near as usize] == UNREACHED {
                        moves[near as usize] = depth;
                        next.push(near);
                    }
                }
            }
            layer.clear();
            core::mem::swap(&mut layer, &mut next);
        }
        moves
    }

    /// The same map with only the cells that can be reached from `roots`.
    #[must_use]
    pub fn reachable(&self, roots: &[Cell]) -> Self {
        let free: Vec<bool> = self
            .distances(roots)
            .iter()
            .map(|d| *d != UNREACHED)
            .collect();
        Self {
            n_free: free.iter().filter(|f| **f).count(),
            free,
            ..*self
        }
    }
}

/// Shortest ways on one map, with the tables that a search needs kept between calls.
///
/// The search always expands a cell of the least possible total: on a grid that total
/// stays the same towards the goal and grows by two away from it, so that two stacks
/// replace a queue, and an open field costs no more than the way itself.
#[derive(Clone, Debug)]
pub struct Router<'a> {
    map: &'a LaneMap,
    /// By cell: the search that reached it last, and from where.
    seen: Vec<(u32, Cell)>,
    search: u32,
    /// Cells of the present total and of the next, with where they were reached from.
    open: Vec<(Cell, Cell)>,
    later: Vec<(Cell, Cell)>,
}

impl<'a> Router<'a> {
    /// A router for a map.
    #[must_use]
    pub fn new(map: &'a LaneMap) -> Self {
        Self {
            map,
            seen: vec![(0, NOWHERE); map.table_len()],
            search: 0,
            open: Vec::new(),
            later: Vec::new(),
        }
    }

    /// Moves of a shortest way between two free cells, or `None` above `most`.
    pub fn moves(&mut self, from: Cell, to: Cell, most: u32) -> Option<u32> {
        let mut total = self.map.straight(from, to);
        self.search += 1;
        self.later.clear();
        self.open.clear();
        self.open.push((from, from));
        while total <= most {
            while let Some((cell, link)) = self.open.pop() {
                let slot = &mut self.seen[cell as usize];
                if slot.0 == self.search {
                    continue;
                }
                *slot = (self.search, link);
                if cell == to {
                    return Some(total);
                }
                let here = self.map.straight(cell, to);
                for near in self.map.around(cell) {
                    if !self.map.free[near as usize] || self.seen[near as usize].0 == self.search {
                        continue;
                    }
                    if self.map.straight(near, to) < here {
                        self.open.push((near, cell));
                    } else {
                        self.later.push((near, cell));
                    }
                }
            }
            if self.later.is_empty() {
                return None;
            }
            core::mem::swap(&mut self.open, &mut self.later);
            total += 2;
        }
        None
    }

    /// Appends the cells of a shortest way after `from` up to and with `to`; nothing
    /// when there is none or both are the same.
    pub fn append_way(&mut self, from: Cell, to: Cell, way: &mut Vec<Cell>) {
        if self.map.adjacent(from, to) {
            way.push(to);
        } else if from != to && self.moves(to, from, UNREACHED).is_some() {
            // The search ran backwards, so that the links lead forwards.
            let mut at = from;
            while at != to {
                at = self.seen[at as usize].1;
                way.push(at);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn map(picture: &[&str]) -> LaneMap {
        let rows = picture.len() as u32;
        let cols = picture[0].len() as u32;
        let free = |r: u32, c: u32| picture[r as usize].as_bytes()[c as usize] == b'.';
        LaneMap::new(rows, cols, free).unwrap()
    }

    #[test]
    fn numbers_and_places_agree() {
        let m = map(&["..#", "#..", ".#."]);
        assert_eq!(m.n_free(), 6);
        for cell in m.cells() {
            let (r, c) = m.place(cell);
            assert_eq!(m.cell(r, c), Some(cell));
        }
        assert_eq!(m.cell(0, 2), None);
        assert_eq!(m.cell(3, 0), None);
        assert!(!m.is_free(u32::MAX));
    }

    #[test]
    fn distances_go_round_walls_and_ways_are_as_long() {
        let m = map(&["...", ".#.", ".#."]);
        let (a, b) = (m.cell(2, 0).unwrap(), m.cell(2, 2).unwrap());
        assert_eq!(m.distances(&[a])[b as usize], 6);
        let mut router = Router::new(&m);
        assert_eq!(router.moves(a, b, 5), None);
        assert_eq!(router.moves(a, b, 6), Some(6));
        let mut way = vec![a];
        router.append_way(a, b, &mut way);
        assert_eq!(way.len(), 7);
        assert!(way.windows(2).all(|w| m.adjacent(w[0], w[1])));
    }

    proptest! {
        #[test]
        fn ways_are_as_long_as_the_distances(
            free in prop::collection::vec(prop::bool::weighted(0.7), 81),
            pick in any::<prop::sample::Index>(),
        ) {
            let m = LaneMap::new(9, 9, |r, c| free[(r * 9 + c) as usize]).unwrap();
            let cells: Vec<Cell> = m.cells().collect();
            prop_assume!(!cells.is_empty());
            let from = cells[pick.index(cells.len())];
            let distances = m.distances(&[from]);
            let mut router = Router::new(&m);
            for to in cells {
                let d = distances[to as usize];
                prop_assert_eq!(router.moves(from, to, UNREACHED - 1), (d != UNREACHED).then_some(d));
                if d > 0 && d != UNREACHED {
                    prop_assert_eq!(router.moves(from, to, d - 1), None);
                }
            }
        }
    }

    #[test]
    fn only_what_can_be_reached_is_kept() {
        let m = map(&["..#.", "#.#."]);
        let root = m.cell(0, 0).unwrap();
        assert_eq!(m.reachable(&[root]).n_free(), 3);
        assert_eq!(m.reachable(&[]).n_free(), 0);
    }

    #[test]
    fn a_map_beyond_the_numbers_is_refused() {
        assert!(LaneMap::new(1 << 20, 1 << 20, |_, _| true).is_err());
    }
}
