//! One loop divided into arcs to which each UAV flies straight (after "MSTC*", Tang, Sun
//! and Zhang, ICRA 2021; D2.7 §3.6.5 lets UAVs only follow the loop). The simple planner that the default has
//! to beat, and where only one loop makes sense.

use super::mstc::{closed_walk, places};
use skein_survey::regions::map::{Cell, LaneMap};
use skein_survey::regions::plan::{Plan, Task};
use skein_survey::regions::spanning::Tree;

/// Where on the loop the first arc is tried to begin.
const OFFSETS: usize = 17;

/// Distance tables beyond this many entries in all would be too large; straight
/// distances then balance the arcs, and only the balance suffers.
const MOST_TABLE: usize = 1 << 26;

/// Divides one loop into arcs so that the longest of way and arc is shortest, among
/// seventeen places to begin.
///
/// # Guarantees
/// Covers every cell.
///
/// # Complexity
/// O(k N) for the distances, then O(k log N) for each offset.
#[must_use]
pub fn free_entry(task: &Task) -> Plan {
    along(task, &closed_walk(task, Tree::BreadthFirst))
}

/// The same for any closed walk over all cells: each cell a neighbour of the next, the
/// last one of the first.
#[must_use]
pub fn along(task: &Task, walk: &[Cell]) -> Plan {
    if walk.is_empty() {
        return Plan {
            paths: task.roots.iter().map(|r| vec![*r]).collect(),
        };
    }
    let ways = Ways::new(task);
    let places = places(task, walk);
    let mut order: Vec<usize> = (0..task.n_uavs()).collect();
    order.sort_by_key(|i| (places[*i], *i));
    let n = walk.len();
    let mut best: Option<(u64, Vec<Arc>)> = None;
    for i in 0..OFFSETS {
        // Within one arc: a shift by a whole arc is another order of equal UAVs.
        let begin = (places[order[0]] + i * n / (OFFSETS * order.len())) % n;
        let splitter = Splitter {
            task,
            walk,
            ways: &ways,
            order: &order,
            begin,
        };
        let most = best.as_ref().map(|b| b.0);
        if let Some(found) = splitter.least(most) {
            best = Some(found);
        }
    }
    let arcs = best.map(|b| b.1).unwrap_or_default();
    let mut orders = vec![Vec::new(); task.n_uavs()];
    for arc in arcs {
        orders[arc.uav] = (0..arc.len).map(|i| walk[(arc.from + i) % n]).collect();
    }
    task.fly(&orders)
}

#[derive(Clone, Copy, Debug)]
struct Arc {
    uav: usize,
    from: usize,
    len: usize,
}

/// Moves from each root to any cell.
struct Ways<'a> {
    map: &'a LaneMap,
    roots: &'a [Cell],
    tables: Vec<Vec<u32>>,
}

impl<'a> Ways<'a> {
    fn new(task: &'a Task) -> Self {
        let entries = task.n_uavs().saturating_mul(task.map.table_len());
        let exact = entries <= MOST_TABLE;
        let table = |root: &Cell| task.map.distances(&[*root]);
        Self {
            map: &task.map,
            roots: &task.roots,
            tables: if exact {
                task.roots.iter().map(table).collect()
            } else {
                Vec::new()
            },
        }
    }

    fn moves(&self, uav: usize, to: Cell) -> u64 {
        let moves = match self.tables.get(uav) {
            Some(table) => table[to as usize],
            None => self.map.straight(self.roots[uav], to),
        };
        u64::from(moves)
    }
}

struct Splitter<'a> {
    task: &'a Task,
    walk: &'a [Cell],
    ways: &'a Ways<'a>,
    order: &'a [usize],
    begin: usize,
}

impl Splitter<'_> {
    /// The least time in which all arcs are flown, below `most` if given, and the arcs.
    /// The unit of time is that of one move of the fastest UAV.
    fn least(&self, most: Option<u64>) -> Option<(u64, Vec<Arc>)> {
        let fastest = u64::from(self.task.speeds.iter().copied().max().unwrap_or(1));
        let mut good = match most {
            Some(most) => most.checked_sub(1)?,
            None => 4 * self.walk.len() as u64 * fastest,
        };
        let mut arcs = self.arcs(good, fastest)?;
        let mut low = 0;
        while low < good {
            let middle = low.midpoint(good);
            match self.arcs(middle, fastest) {
                Some(found) => (good, arcs) = (middle, found),
                None => low = middle + 1,
            }
        }
        Some((good, arcs))
    }

    /// Arcs that are all flown in `time / fastest`, greedily as long as each UAV can.
    fn arcs(&self, time: u64, fastest: u64) -> Option<Vec<Arc>> {
        let n = self.walk.len();
        let mut done = 0;
        let mut arcs = Vec::with_capacity(self.order.len());
        for &uav in self.order {
            if done == n {
                break;
            }
            let from = (self.begin + done) % n;
            let moves = time * u64::from(self.task.speeds[uav]) / fastest;
            let moves = moves.min(u64::from(self.task.endurance[uav]));
            let way = self.ways.moves(uav, self.walk[from]);
            let Some(left) = moves.checked_sub(way) else {
                continue;
            };
            let len = usize::try_from(left + 1)
                .unwrap_or(usize::MAX)
                .min(n - done);
            let len = if self.task.closed {
                self.home(uav, from, len, moves, way)
            } else {
                len
            };
            arcs.push(Arc { uav, from, len });
            done += len;
        }
        (done == n).then_some(arcs)
    }

    /// The longest arc of at most `len` cells after which the UAV still gets home.
    fn home(&self, uav: usize, from: usize, len: usize, moves: u64, way: u64) -> usize {
        let n = self.walk.len();
        let fits = |len: usize| {
            let last = self.walk[(from + len - 1) % n];
            way + len as u64 - 1 + self.ways.moves(uav, last) <= moves
        };
        // One more cell lengthens arc and way home by at most two moves, so that the
        // excess says how many cells to give back at least.
        let mut len = len;
        while len > 0 && !fits(len) {
            let last = self.walk[(from + len - 1) % n];
            let excess = way + len as u64 - 1 + self.ways.moves(uav, last) - moves;
            len = len.saturating_sub(usize::try_from(excess.div_ceil(2)).unwrap_or(len));
        }
        len
    }
}
