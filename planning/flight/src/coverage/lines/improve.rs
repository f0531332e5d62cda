//! Ruin and recreate over tours of a team, with annealing: lines are taken out in runs and
//! put back where they cost least, until the longest tour stops shrinking (D2.7 §3.5).
//!
//! Schrimpf, Schneider, Stamm-Wilbrandt and Dueck, "Record breaking optimization results
//! using the ruin and recreate principle", 2000, <https://doi.org/10.1006/jcph.1999.6413>;
//! Kirkpatrick, Gelatt and Vecchi, "Optimization by simulated annealing", 1983,
//! <https://doi.org/10.1126/science.220.4598.671>.
//!
//! The search is a fixed number of steps of a fixed stream of choices: the same plan on
//! every machine. Leaves the first plan to `postman` and `split`.

use super::network::{Line, Traversal, Uav};
use crate::coverage::metric::Metric;
use skein_geometry::math;
use skein_geometry::random::SplitMix64;

/// Neighbours of a line that are looked at when it is put back.
const NEIGHBOURS: usize = 24;

/// Mean number of lines taken out in a step: enough to reshape a corner of the map,
/// few enough for some hundred thousand steps a second.
const REMOVED: usize = 10;

/// The longest run of lines taken from one tour.
const LONGEST_RUN: usize = 10;

/// Weight of the part of the objective that grows with the 32nd power of a tour's length
/// over the longest. A metre of the longest tour then counts 17 times as much as one of a
/// short tour, and twice as much at nine tenths of it: a plan may grow in total when its
/// longest tour shrinks. With the 8th power tours of ten UAVs stayed 1.5 % longer.
const STEEP: f64 = 0.5;

/// How many seconds of flight one second beyond endurance weighs.
const BEYOND_ENDURANCE: f64 = 10.0;

/// Losses accepted at first when a search begins far from a good plan, in mean deadheads
/// a line.
pub(super) const WARM: f64 = 0.3;

/// The same when it goes on from a good plan.
pub(super) const LUKEWARM: f64 = 0.1;

/// Losses accepted at last.
const COLD: f64 = 0.003;

/// No line.
const NONE: u32 = u32::MAX;

/// What the search is about.
pub(super) struct Search<'a, M> {
    lines: &'a [Line],
    team: &'a [Uav],
    metric: &'a M,
    lower_bound: f64,
    /// For each line the lines nearest to it.
    near: Vec<Vec<u32>>,
}

/// Lines and tours as rings: every tour is a cyclic list through a node of its own.
///
/// Nodes `0..n` are lines, node `n + t` is the depot of tour `t`.
#[derive(Clone)]
struct Rings {
    next: Vec<u32>,
    prev: Vec<u32>,
    tour: Vec<u32>,
    /// Where each node is entered and left as it is flown now.
    enter: Vec<usize>,
    leave: Vec<usize>,
    backward: Vec<bool>,
    length: Vec<f64>,
}

struct Engine<'a, M> {
    search: &'a Search<'a, M>,
    now: Rings,
    target: f64,
    random: SplitMix64,
    out: Vec<u32>,
    /// Changes of this step, to take them back: lines taken out and lines put in.
    journal: Vec<Change>,
}

#[derive(Clone, Copy)]
enum Change {
    Out {
        line: u32,
        after: u32,
        backward: bool,
    },
    In {
        line: u32,
    },
}

impl<'a, M: Metric> Search<'a, M> {
    /// Prepares the search; no makespan below `lower_bound` is possible.
    pub(super) fn new(lines: &'a [Line], team: &'a [Uav], metric: &'a M, lower_bound: f64) -> Self {
        Self {
            lines,
            team,
            metric,
            lower_bound,
            near: neighbours(lines, metric),
        }
    }

    /// Improves `tours` in `steps` steps that begin as bold as `warm`; the first aim is
    /// the makespan, the second the total.
    pub(super) fn run(&self, tours: &mut [Vec<Traversal>], steps: usize, warm: f64, seed: u64) {
        let n = self.lines.len();
        if n < 2 || steps == 0 {
            return;
        }
        let mut engine = Engine::new(self, tours, seed);
        let best = engine.anneal(steps, warm);
        for (t, tour) in tours.iter_mut().enumerate() {
            *tour = best
                .line_of(t, n)
                .map(|line| Traversal {
                    line,
                    backward: best.backward[line],
                })
                .collect();
        }
    }
}

impl Rings {
    fn line_of(&self, t: usize, n: usize) -> impl Iterator<Item = usize> + '_ {
        let mut at = self.next[n + t] as usize;
        core::iter::from_fn(move || {
            let here = at;
            at = self.next[at] as usize;
            (here < n).then_some(here)
        })
    }
}

impl<'a, M: Metric> Engine<'a, M> {
    fn new(search: &'a Search<'a, M>, tours: &[Vec<Traversal>], seed: u64) -> Self {
        let n = search.lines.len();
        let nodes = n + tours.len();
        let mut now = Rings {
            next: vec![NONE; nodes],
            prev: vec![NONE; nodes],
            tour: vec![NONE; nodes],
            enter: vec![0; nodes],
            leave: vec![0; nodes],
            backward: vec![false; nodes],
            length: vec![0.0; tours.len()],
        };
        for (t, tour) in tours.iter().enumerate() {
            let depot = n + t;
            now.tour[depot] = t as u32;
            now.enter[depot] = search.team[t].depot;
            now.leave[depot] = search.team[t].depot;
            let mut last = depot;
            for pass in tour {
                let i = pass.line;
                now.next[last] = i as u32;
                now.prev[i] = last as u32;
                now.tour[i] = t as u32;
                now.backward[i] = pass.backward;
                now.enter[i] = pass.start(search.lines);
                now.leave[i] = pass.end(search.lines);
                last = i;
            }
            now.next[last] = depot as u32;
            now.prev[depot] = last as u32;
            now.length[t] =
                super::network::tour_cost(tour, search.lines, search.team[t].depot, search.metric);
        }
        Self {
            search,
            now,
            target: 0.0,
            random: SplitMix64::new(seed),
            out: Vec::new(),
            journal: Vec::new(),
        }
    }

    fn gap(&self, a: u32, b: u32) -> f64 {
        let (from, to) = (self.now.leave[a as usize], self.now.enter[b as usize]);
        self.search.metric.cost(from, to)
    }

    fn service(&self, line: u32) -> f64 {
        self.search.lines[line as usize].cost[usize::from(self.now.backward[line as usize])]
    }

    /// What a tour of this length adds to the objective.
    fn score(&self, t: usize, length: f64) -> f64 {
        let uav = &self.search.team[t];
        let x = length / (self.target.min(uav.endurance) * uav.speed).max(f64::MIN_POSITIVE);
        let x2 = x * x;
        let x4 = x2 * x2;
        let x8 = x4 * x4;
        let x16 = x8 * x8;
        length * (1.0 + STEEP * x16 * x16)
    }

    fn objective(&self) -> f64 {
        (0..self.now.length.len())
            .map(|t| self.score(t, self.now.length[t]))
            .sum()
    }

    /// The longest time, with what is beyond endurance counted many times.
    fn makespan(&self) -> f64 {
        self.now
            .length
            .iter()
            .zip(self.search.team)
            .map(|(l, u)| {
                let time = l / u.speed;
                // Beyond endurance a tour is worse than any that can be flown.
                time + BEYOND_ENDURANCE * (time - u.endurance).max(0.0)
            })
            .fold(0.0, f64::max)
    }

    fn take_out(&mut self, line: u32) {
        let (prev, next) = (self.now.prev[line as usize], self.now.next[line as usize]);
        let t = self.now.tour[line as usize] as usize;
        let change =
            self.gap(prev, next) - self.gap(prev, line) - self.service(line) - self.gap(line, next);
        self.now.length[t] += change;
        self.now.next[prev as usize] = next;
        self.now.prev[next as usize] = prev;
        self.now.tour[line as usize] = NONE;
        self.journal.push(Change::Out {
            line,
            after: prev,
            backward: self.now.backward[line as usize],
        });
    }

    fn link(&mut self, line: u32, after: u32, backward: bool) {
        let i = line as usize;
        let l = self.search.lines[i];
        self.now.backward[i] = backward;
        (self.now.enter[i], self.now.leave[i]) = if backward { (l.b, l.a) } else { (l.a, l.b) };
        let next = self.now.next[after as usize];
        let t = self.now.tour[after as usize];
        self.now.prev[i] = after;
        self.now.next[i] = next;
        self.now.next[after as usize] = line;
        self.now.prev[next as usize] = line;
        self.now.tour[i] = t;
    }

    fn put_in(&mut self, line: u32, after: u32, backward: bool) {
        let next = self.now.next[after as usize];
        let t = self.now.tour[after as usize] as usize;
        let before = self.gap(after, next);
        self.link(line, after, backward);
        self.now.length[t] +=
            self.gap(after, line) + self.service(line) + self.gap(line, next) - before;
        self.journal.push(Change::In { line });
    }

    /// Takes back everything of this step; `length` is what the tours measured before.
    fn take_back(&mut self, length: &[f64]) {
        while let Some(change) = self.journal.pop() {
            match change {
                Change::In { line } => {
                    let i = line as usize;
                    let (prev, next) = (self.now.prev[i], self.now.next[i]);
                    self.now.next[prev as usize] = next;
                    self.now.prev[next as usize] = prev;
                    self.now.tour[i] = NONE;
                }
                Change::Out {
                    line,
                    after,
                    backward,
                } => self.link(line, after, backward),
            }
        }
        self.now.length.copy_from_slice(length);
    }

    /// Takes out runs of lines around one line, one run from each tour at most.
    fn ruin(&mut self) {
        self.out.clear();
        let n = self.search.lines.len();
        let seed = self.seed_line() as u32;
        let wanted = 1 + self.random.below(2 * REMOVED);
        let mut hit: Vec<u32> = Vec::new();
        let mut around = vec![seed];
        around.extend(&self.search.near[seed as usize]);
        for line in around {
            if self.out.len() >= wanted.min(n) {
                break;
            }
            let t = self.now.tour[line as usize];
            if t == NONE || hit.contains(&t) {
                continue;
            }
            hit.push(t);
            let run = 1 + self.random.below(LONGEST_RUN.min(wanted));
            let mut at = line;
            for _ in 0..self.random.below(run) {
                let prev = self.now.prev[at as usize];
                if prev as usize >= n {
                    break;
                }
                at = prev;
            }
            for _ in 0..run {
                let next = self.now.next[at as usize];
                self.take_out(at);
                self.out.push(at);
                if next as usize >= n {
                    break;
                }
                at = next;
            }
        }
    }

    /// A line to start from: of the longest tour in every other step.
    fn seed_line(&mut self) -> usize {
        let n = self.search.lines.len();
        let any = self.random.below(n);
        if self.random.below(2) == 0 {
            return any;
        }
        let longest = (0..self.now.length.len()).max_by(|&a, &b| {
            let time = |t: usize| self.now.length[t] / self.search.team[t].speed;
            time(a).total_cmp(&time(b))
        });
        // A few draws find one; the longest tour holds a fair share of the lines.
        for _ in 0..8 {
            let line = self.random.below(n);
            if Some(self.now.tour[line] as usize) == longest {
                return line;
            }
        }
        any
    }

    fn recreate(&mut self) {
        match self.random.below(3) {
            0 => self.random.shuffle(&mut self.out),
            1 => {
                let lines = self.search.lines;
                self.out.sort_unstable_by(|&a, &b| {
                    let cost = |l: u32| lines[l as usize].cost[0];
                    cost(b).total_cmp(&cost(a)).then(a.cmp(&b))
                });
            }
            _ => {
                if self.random.below(2) == 0 {
                    self.out.reverse();
                }
            }
        }
        for i in 0..self.out.len() {
            let line = self.out[i];
            let (after, backward) = self.best_place(line);
            self.put_in(line, after, backward);
        }
    }

    /// Where `line` costs least: beside a neighbour, or at an end of a tour.
    fn best_place(&mut self, line: u32) -> (u32, bool) {
        let n = self.search.lines.len() as u32;
        let mut best = (f64::INFINITY, n, false);
        for t in 0..self.now.length.len() as u32 {
            self.try_place(line, n + t, &mut best);
            let last = self.now.prev[(n + t) as usize];
            if last < n {
                self.try_place(line, last, &mut best);
            }
        }
        for i in 0..self.search.near[line as usize].len() {
            let other = self.search.near[line as usize][i];
            if self.now.tour[other as usize] == NONE || self.random.below(64) == 0 {
                continue;
            }
            self.try_place(line, other, &mut best);
            let prev = self.now.prev[other as usize];
            self.try_place(line, prev, &mut best);
        }
        (best.1, best.2)
    }

    fn try_place(&self, line: u32, after: u32, best: &mut (f64, u32, bool)) {
        let now = &self.now;
        let t = now.tour[after as usize] as usize;
        let next = now.next[after as usize];
        let (from, to) = (now.leave[after as usize], now.enter[next as usize]);
        let metric = self.search.metric;
        let l = self.search.lines[line as usize];
        let ahead = metric.cost(from, l.a) + l.cost[0] + metric.cost(l.b, to);
        let back = metric.cost(from, l.b) + l.cost[1] + metric.cost(l.a, to);
        let backward = back < ahead;
        let more = ahead.min(back) - metric.cost(from, to);
        let length = now.length[t];
        let cost = self.score(t, length + more) - self.score(t, length);
        if cost < best.0 {
            *best = (cost, after, backward);
        }
    }

    /// Simulated annealing; the best tours found.
    fn anneal(&mut self, steps: usize, warm: f64) -> Rings {
        let mut best = self.now.clone();
        let mut best_key = (self.makespan(), self.now.length.iter().sum::<f64>());
        self.aim(best_key.0);
        let total: f64 = self.search.lines.iter().map(|l| l.cost[0]).sum();
        let scale = (best_key.1 - total).max(0.01 * total) / self.search.lines.len() as f64;
        let cooling = math::exp(math::ln(COLD / warm) / steps as f64);
        let mut heat = warm * scale;
        let mut score = self.objective();
        let mut length = self.now.length.clone();
        for _ in 0..steps {
            self.journal.clear();
            self.ruin();
            self.recreate();
            let new_score = self.objective();
            // Accepts a loss with the probability exp(-loss / heat).
            let slack = -heat * math::ln(self.random.unit().max(1e-12));
            if new_score < score + slack {
                score = new_score;
                length.copy_from_slice(&self.now.length);
                let key = (self.makespan(), self.now.length.iter().sum::<f64>());
                let gain = 1e-9 * best_key.0;
                if key.0 < best_key.0 - gain
                    || (key.0 < best_key.0 + gain && key.1 < best_key.1 - gain)
                {
                    best_key = key;
                    best.clone_from(&self.now);
                    self.aim(key.0);
                    score = self.objective();
                }
            } else {
                self.take_back(&length);
            }
            heat *= cooling;
        }
        best
    }

    fn aim(&mut self, makespan: f64) {
        self.target = makespan.max(self.search.lower_bound);
    }
}

/// For each line the lines nearest to it, by their ends.
fn neighbours(lines: &[Line], metric: &impl Metric) -> Vec<Vec<u32>> {
    let n = lines.len();
    let mut row: Vec<(f64, u32)> = Vec::with_capacity(n);
    (0..n)
        .map(|i| {
            row.clear();
            for (j, other) in lines.iter().enumerate() {
                if i == j {
                    continue;
                }
                let l = lines[i];
                let near = metric
                    .cost(l.a, other.a)
                    .min(metric.cost(l.a, other.b))
                    .min(metric.cost(l.b, other.a))
                    .min(metric.cost(l.b, other.b));
                row.push((near, j as u32));
            }
            let order = |x: &(f64, u32), y: &(f64, u32)| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1));
            if row.len() > NEIGHBOURS {
                row.select_nth_unstable_by(NEIGHBOURS - 1, order);
                row.truncate(NEIGHBOURS);
            }
            row.sort_unstable_by(order);
            row.iter().map(|r| r.1).collect()
        })
        .collect()
}
