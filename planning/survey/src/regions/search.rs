//! Local search over the orders in which UAVs come to their cells: fewer cells flown
//! twice, and equal times (the improvement behind D2.7 §3.6.4–3.6.5's divisions).
//!
//! An order visits each cell once; where two cells in a row are not neighbours, the UAV
//! *hops* over cells that are covered anyway. All waste of a plan is in its hops and in
//! unequal times, so every trial begins at a hop, at an end of an order, or at a border
//! between two UAVs. Trials that neither gain nor lose are taken: hops wander until two
//! of them meet and vanish.
//!
//! Left to others: the changes themselves (`link`, `shift`), the first orders, and when
//! to stop.

mod link;
mod shift;

use super::map::{Cell, NOWHERE, Router};
use super::plan::Task;
use super::root_distances::Home;
use skein_geometry::random::SplitMix64;
use std::sync::Arc;

/// New links longer by this than all links that they replace are not considered: the
/// search for their length would cost more than they ever gain.
const LONGER: u32 = 12;

/// A reversal that gains nothing is taken only up to this many cells, since its cost
/// grows with them.
const IDLE_REVERSAL: usize = 1000;

/// What a link that is too long counts as.
const TOO_LONG: u32 = 1 << 20;

/// Remembered distances: a power of two, direct-mapped, about the size of a core's
/// second cache.
const REMEMBERED: usize = 1 << 15;

/// Prices of time: a unit of time of any UAV costs this, besides what lateness costs.
const TIME_PRICE: i64 = 16;

/// How far before the target the pressure towards it still grows, in units of time: a
/// move of the earliest UAV keeps a price, so that it is not wasted for nothing.
const EARLY: i64 = 6;

/// How far behind the target it still grows: one part in so many of the target, or so
/// many units of time, or up to the last UAV. Beyond, it would buy balance with waste.
const LATE_PART: i64 = 12;
const LATE_LEAST: i64 = 16;

/// Price of a move beyond the endurance: more than any pressure towards the target.
const OVER_PRICE: i64 = 1 << 16;

/// Orders under improvement.
pub struct Search<'a> {
    task: &'a Task,
    router: Router<'a>,
    orders: Vec<Vec<Cell>>,
    /// By cell: whose order, and where in it.
    at: Vec<(u32, u32)>,
    /// By UAV: moves.
    moves: Vec<i64>,
    /// By UAV: time of a move, the fastest UAV's being [`PACE`].
    pace: Vec<i64>,
    /// Cells that may be beside a hop, and whether a cell is listed.
    hops: Vec<Cell>,
    listed: Vec<bool>,
    /// Cells that may be at a border between two UAVs, and whether a cell is listed.
    borders: Vec<Cell>,
    bordering: Vec<bool>,
    random: SplitMix64,
    remembered: Vec<(Cell, Cell, u32)>,
    /// Moves between the roots and every cell, when UAVs return.
    home: Arc<Home>,
    /// The common time aimed at.
    target: i64,
    /// How late the pressure still grows.
    late: i64,
    /// Highest loss accepted, in price units per 256ths of a draw.
    heat: i64,
}

/// Units of time in one move of the fastest UAV: a slower one's move is rounded to them.
pub const PACE: i64 = 16;

/// A place in an order: whose, and how many cells before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Spot {
    uav: usize,
    index: usize,
}

impl<'a> Search<'a> {
    /// A search that begins with `orders`; each cell of the task in exactly one of them.
    #[must_use]
    pub fn new(task: &'a Task, orders: Vec<Vec<Cell>>) -> Self {
        Self::with(task, Arc::new(Home::new(task)), orders)
    }

    /// The same, with the ways home known.
    pub(super) fn with(task: &'a Task, home: Arc<Home>, orders: Vec<Vec<Cell>>) -> Self {
        let n = task.map.table_len();
        let fastest = i64::from(task.speeds.iter().copied().max().unwrap_or(1));
        let mut search = Self {
            task,
            router: Router::new(&task.map),
            at: vec![(0, 0); n],
            moves: vec![0; orders.len()],
            pace: task
                .speeds
                .iter()
                .map(|v| PACE * fastest / i64::from((*v).max(1)))
                .collect(),
            hops: Vec::new(),
            listed: vec![false; n],
            borders: task.map.cells().collect(),
            bordering: task.map.cells().fold(vec![false; n], |mut all, c| {
                all[c as usize] = true;
                all
            }),
            random: SplitMix64::new(n as u64),
            remembered: vec![(NOWHERE, NOWHERE, 0); REMEMBERED],
            home,
            target: 0,
            late: 16,
            heat: 0,
            orders,
        };
        for uav in 0..search.orders.len() {
            search.index(uav, 0, search.orders[uav].len());
            search.recount(uav);
        }
        search.aim();
        search
    }

    /// Begins anew from other orders of the same cells; chance goes on where it was.
    pub(super) fn restart(&mut self, orders: Vec<Vec<Cell>>) {
        self.orders = orders;
        for uav in 0..self.orders.len() {
            self.index(uav, 0, self.orders[uav].len());
            self.recount(uav);
            for index in 0..self.orders[uav].len() {
                self.list_border(self.orders[uav][index]);
            }
        }
        self.aim();
    }

    /// The orders.
    #[must_use]
    pub fn orders(&self) -> &[Vec<Cell>] {
        &self.orders
    }

    /// Moves of each UAV.
    #[must_use]
    pub fn moves(&self) -> &[i64] {
        &self.moves
    }

    /// The time of the last UAV, in 1 / [`PACE`] of the fastest UAV's move.
    #[must_use]
    pub fn makespan(&self) -> i64 {
        let times = self.moves.iter().zip(&self.pace).map(|(m, p)| m * p);
        times.max().unwrap_or(0)
    }

    /// How good the orders are, less is better: moves beyond the endurance of all UAVs,
    /// then the makespan.
    #[must_use]
    pub fn score(&self) -> (i64, i64) {
        let each = self.moves.iter().zip(&self.task.endurance);
        let over = each.map(|(m, e)| (m - i64::from(*e)).max(0)).sum();
        (over, self.makespan())
    }

    fn index(&mut self, uav: usize, from: usize, to: usize) {
        for i in from..to {
            self.at[self.orders[uav][i] as usize] = (uav as u32, i as u32);
        }
    }

    fn recount(&mut self, uav: usize) {
        let mut moves = 0;
        for i in 0..=self.orders[uav].len() {
            let spot = Spot { uav, index: i };
            let (a, b) = (self.before(spot), self.after(spot));
            let d = self.exact(a, b);
            if d > 1 {
                self.list(a);
                self.list(b);
            }
            moves += i64::from(d);
        }
        self.moves[uav] = moves;
        if let Some(&last) = self.orders[uav].last() {
            self.list(last);
        }
    }

    /// Aims at the mean of the times.
    pub fn aim(&mut self) {
        let work: f64 = self.moves.iter().map(|m| *m as f64).sum();
        let speed: f64 = self.pace.iter().map(|p| 1.0 / *p as f64).sum();
        self.target = if speed > 0.0 {
            (work / speed) as i64
        } else {
            0
        };
        // Up to the last UAV: what is too much for it has to pass through others that are
        // late as well.
        self.late = (self.target / PACE / LATE_PART)
            .max(LATE_LEAST)
            .max((self.makespan() - self.target) / PACE);
    }

    /// Sets the greatest loss that is sometimes accepted, in thousandths of a move.
    pub fn heat(&mut self, milli_moves: i64) {
        self.heat = milli_moves * TIME_PRICE;
    }

    /// The cell before a spot: the root at the beginning.
    fn before(&self, spot: Spot) -> Cell {
        match spot.index.checked_sub(1) {
            Some(i) => self.orders[spot.uav][i],
            None => self.task.roots[spot.uav],
        }
    }

    /// The cell after a spot: at the end the root if the UAV returns, or none.
    fn after(&self, spot: Spot) -> Cell {
        let order = &self.orders[spot.uav];
        match order.get(spot.index) {
            Some(cell) => *cell,
            None if self.task.closed => self.task.roots[spot.uav],
            None => NOWHERE,
        }
    }

    fn list(&mut self, cell: Cell) {
        if cell != NOWHERE && !self.listed[cell as usize] {
            self.listed[cell as usize] = true;
            self.hops.push(cell);
        }
    }

    fn exact(&mut self, a: Cell, b: Cell) -> u32 {
        self.distance(a, b, u32::MAX - 1)
    }

    /// Moves between two cells at least.
    fn least(&self, a: Cell, b: Cell) -> i64 {
        if a == NOWHERE || b == NOWHERE {
            return 0;
        }
        i64::from(self.task.map.straight(a, b))
    }

    /// Moves of a link that takes the place of links of `old` moves in all.
    fn fresh(&mut self, a: Cell, b: Cell, old: i64) -> u32 {
        self.distance(a, b, u32::try_from(old).unwrap_or(0) + LONGER)
    }

    /// Moves between two cells, [`TOO_LONG`] above `most`; none to or from nowhere.
    fn distance(&mut self, a: Cell, b: Cell, most: u32) -> u32 {
        if a == b || a == NOWHERE || b == NOWHERE {
            return 0;
        }
        if self.task.map.adjacent(a, b) {
            return 1;
        }
        if self.task.map.straight(a, b) > most {
            return TOO_LONG;
        }
        if let Some(moves) = self.home.moves(a, b) {
            return if moves > most { TOO_LONG } else { moves };
        }
        let (low, high) = (a.min(b), a.max(b));
        let mixed = (low.wrapping_mul(0x9E37_79B1)) ^ high.wrapping_mul(0x85EB_CA6B);
        let slot = (mixed >> 17) as usize % REMEMBERED;
        let (x, y, d) = self.remembered[slot];
        if (x, y) == (low, high) {
            if d < TOO_LONG {
                return if d > most { TOO_LONG } else { d };
            }
            // Only known to be more than what was once asked for.
            if most <= d - TOO_LONG {
                return TOO_LONG;
            }
        }
        let moves = self.router.moves(a, b, most);
        self.remembered[slot] = (low, high, moves.unwrap_or(TOO_LONG.saturating_add(most)));
        moves.unwrap_or(TOO_LONG)
    }

    /// What the times cost, a move of the fastest UAV as the unit: each the same, the
    /// square of what is off the target, and what is beyond the endurance dearly.
    fn price(&self, uav: usize, moves: i64) -> i64 {
        let time = moves * self.pace[uav];
        let off = (time - self.target) / PACE;
        // Beyond both limits the pressure grows no more.
        let near = off.clamp(-EARLY, self.late);
        let over = (moves - i64::from(self.task.endurance[uav])).max(0);
        time * TIME_PRICE / PACE + near * (2 * off - near) + over * OVER_PRICE
    }

    fn change(&self, uav: usize, delta: i64) -> i64 {
        self.price(uav, self.moves[uav] + delta) - self.price(uav, self.moves[uav])
    }

    /// The change of price when two UAVs' moves change; they may be the same.
    fn both(&self, uav: usize, delta: i64, other: usize, other_delta: i64) -> i64 {
        if uav == other {
            self.change(uav, delta + other_delta)
        } else {
            self.change(uav, delta) + self.change(other, other_delta)
        }
    }

    /// The loss that this trial may make.
    fn allowance(&mut self) -> i64 {
        if self.heat == 0 {
            return 0;
        }
        // A geometric draw: each further unit of heat is half as likely.
        let bits = self.random.bits();
        i64::from(bits.trailing_zeros().min(12)) * self.heat * ((bits >> 40) & 255) as i64 / 256_000
    }

    /// Tries `steps` changes.
    pub fn run(&mut self, steps: usize) {
        for _ in 0..steps {
            match self.random.below(32) {
                0..=11 => self.try_hop(),
                12 => self.try_end(),
                _ => self.try_border(),
            }
        }
    }

    /// Lengthens the order of any UAV at its end: an idle one gets work by this alone.
    fn try_end(&mut self) {
        let uav = self.random.below(self.orders.len());
        let index = self.orders[uav].len();
        if !self.task.closed || index == 0 {
            self.try_fill(Spot { uav, index });
        }
    }

    /// A change at a hop or an end.
    fn try_hop(&mut self) {
        if self.hops.is_empty() {
            return;
        }
        let pick = self.random.below(self.hops.len());
        let cell = self.hops[pick];
        let Some(spot) = self.hop_at(cell) else {
            self.listed[cell as usize] = false;
            self.hops.swap_remove(pick);
            return;
        };
        match self.random.below(4) {
            0 | 1 => self.try_reversal(spot),
            2 => self.try_fill(spot),
            _ => self.try_move_from(spot),
        }
    }

    /// The spot of a hop beside a cell, or the end of its order.
    fn hop_at(&mut self, cell: Cell) -> Option<Spot> {
        let (uav, index) = self.at[cell as usize];
        let (uav, index) = (uav as usize, index as usize);
        if self.orders[uav].get(index) != Some(&cell) {
            return None;
        }
        let (before, after) = (
            Spot { uav, index },
            Spot {
                uav,
                index: index + 1,
            },
        );
        let flip = self.random.bits() & 1 == 0;
        for spot in if flip {
            [before, after]
        } else {
            [after, before]
        } {
            let (a, b) = (self.before(spot), self.after(spot));
            let end = b == NOWHERE;
            if end || (a != b && !self.task.map.adjacent(a, b)) {
                return Some(spot);
            }
        }
        None
    }

    fn random_near(&mut self, cell: Cell) -> Option<Cell> {
        let side = self.random.below(4);
        let near = self.task.map.around(cell)[side];
        self.task.map.is_free(near).then_some(near)
    }

    fn list_ends(&mut self, uav: usize, low: usize, high: usize) {
        for index in [low, high] {
            let spot = Spot { uav, index };
            let (a, b) = (self.before(spot), self.after(spot));
            if b == NOWHERE || (a != b && !self.task.map.adjacent(a, b)) {
                self.list(a);
                self.list(b);
            }
        }
    }

    /// Lists a cell that has changed hands, and its neighbours, as at a border.
    fn list_border(&mut self, cell: Cell) {
        for near in self.task.map.around(cell).into_iter().chain([cell]) {
            if self.task.map.is_free(near) && !self.bordering[near as usize] {
                self.bordering[near as usize] = true;
                self.borders.push(near);
            }
        }
    }
}
