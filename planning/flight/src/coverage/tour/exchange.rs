//! Exchanges of two and three legs of a closed tour, among near places (a tool of D2.7
//! §3.4 and §3.5).
//!
//! Lin, "Computer solutions of the traveling salesman problem", 1965,
//! <https://doi.org/10.1002/j.1538-7305.1965.tb04146.x>: legs are exchanged while that
//! helps. Which exchanges are looked at is cut down as Lin and Kernighan do it, 1973,
//! <https://doi.org/10.1287/opre.21.2.498>: each new leg leads to a near place, and what
//! was gained so far stays above zero. Runs that move elsewhere, turned or not (Or's
//! exchange), are among them. Leaves to `kicks` what is done where none helps.

use crate::coverage::metric::Metric;
use std::collections::VecDeque;

/// Near places that the first new leg of an exchange may lead to.
const NEIGHBOURS: usize = 10;

/// Near places that the second new leg may lead to.
const SECOND_NEIGHBOURS: usize = 5;

/// A closed tour as an array of nodes, with its search for exchanges.
///
/// Nodes are the places of the first order, numbered from 0. A leg of negative cost is
/// never given up: so lines are kept that must be flown along.
pub(super) struct Exchange<'a, M> {
    metric: &'a M,
    names: Vec<usize>,
    order: Vec<u32>,
    /// Where each node stands in `order`.
    at: Vec<u32>,
    /// By node, its near nodes, the nearest first, and their costs.
    near: Vec<(u32, f64)>,
    width: usize,
    least_gain: f64,
    waiting: Vec<bool>,
    queue: VecDeque<u32>,
    /// Reversals since the last [`Exchange::keep`].
    journal: Vec<(u32, u32)>,
}

/// New legs and the legs given up for them: `t[0]`–`t[1]`, `t[2]`–`t[3]` and so on go.
#[derive(Clone, Copy, Debug)]
struct Move {
    gain: f64,
    t: [u32; 6],
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// One stretch is turned.
    Two,
    /// A stretch is turned, then another.
    Three,
    /// Two stretches in a row are turned, each in its place.
    BothTurned,
    /// Two stretches in a row change places.
    Swapped,
}

impl<'a, M: Metric> Exchange<'a, M> {
    /// Starts from the places in this order.
    pub(super) fn new(names: Vec<usize>, metric: &'a M, least_gain: f64) -> Self {
        let n = names.len();
        let numbers = || 0..u32::try_from(n).unwrap_or(u32::MAX);
        let width = NEIGHBOURS.min(n.saturating_sub(1));
        Self {
            metric,
            near: neighbours(&names, metric, width),
            width,
            names,
            order: numbers().collect(),
            at: numbers().collect(),
            least_gain,
            waiting: vec![true; n],
            queue: numbers().collect(),
            journal: Vec::new(),
        }
    }

    /// How many places there are.
    pub(super) fn len(&self) -> usize {
        self.order.len()
    }

    /// The places of these nodes.
    pub(super) fn places(&self, nodes: &[u32]) -> Vec<usize> {
        nodes.iter().map(|&v| self.names[v as usize]).collect()
    }

    /// The node at a position, cyclically.
    pub(super) fn node(&self, position: usize) -> u32 {
        self.order[position % self.order.len()]
    }

    pub(super) fn cost(&self, a: u32, b: u32) -> f64 {
        self.metric
            .cost(self.names[a as usize], self.names[b as usize])
    }

    /// The mean cost of the legs that may be given up, and whether there are others.
    pub(super) fn mean_leg(&self) -> (f64, bool) {
        let n = self.len();
        let legs = (0..n).map(|i| self.cost(self.order[i], self.order[(i + 1) % n]));
        let free: Vec<f64> = legs.filter(|c| *c >= 0.0).collect();
        let mean = free.iter().sum::<f64>() / free.len().max(1) as f64;
        (mean, free.len() < n)
    }

    /// The nodes in the order of the tour.
    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    /// The changes so far are final.
    pub(super) fn keep(&mut self) {
        self.journal.clear();
    }

    /// Takes back all changes since the last [`Exchange::keep`].
    pub(super) fn take_back(&mut self) {
        while let Some((i, len)) = self.journal.pop() {
            self.turn(i as usize, len as usize);
        }
    }

    /// Exchanges are sought at this node again.
    pub(super) fn look_at(&mut self, v: u32) {
        if !core::mem::replace(&mut self.waiting[v as usize], true) {
            self.queue.push_back(v);
        }
    }

    /// Exchanges legs until no exchange helps; what was gained.
    pub(super) fn descend(&mut self) -> f64 {
        let mut gained = 0.0;
        while let Some(v) = self.queue.pop_front() {
            self.waiting[v as usize] = false;
            while let Some(found) = self.best_from(v) {
                gained += found.gain;
                self.carry_out(found);
            }
        }
        gained
    }

    /// Two runs in a row change places (the double bridge): the first lies between the
    /// nodes `first`, the second between `second`, and `around` are the nodes beside them.
    pub(super) fn swap_runs(&mut self, around: [u32; 2], first: [u32; 2], second: [u32; 2]) {
        let ([v, y], [w, p], [q, x]) = (around, first, second);
        self.carry_out(Move {
            gain: 0.0,
            t: [v, w, x, y, p, q],
            kind: Kind::Swapped,
        });
    }

    fn next(&self, v: u32, ahead: bool) -> u32 {
        let (i, n) = (self.at[v as usize] as usize, self.order.len());
        let j = match (ahead, i) {
            (true, _) if i + 1 == n => 0,
            (true, _) => i + 1,
            (false, 0) => n - 1,
            (false, _) => i - 1,
        };
        self.order[j]
    }

    /// Places from `from` to `to` along the tour.
    fn gap(&self, from: u32, to: u32, ahead: bool) -> usize {
        let (i, j) = (
            self.at[from as usize] as usize,
            self.at[to as usize] as usize,
        );
        let (i, j) = if ahead { (i, j) } else { (j, i) };
        if j >= i {
            j - i
        } else {
            j + self.order.len() - i
        }
    }

    /// The best exchange found that gives up a leg at `v`.
    fn best_from(&self, v: u32) -> Option<Move> {
        let mut best = Move {
            gain: self.least_gain,
            t: [v; 6],
            kind: Kind::Two,
        };
        for ahead in [true, false] {
            let w = self.next(v, ahead);
            let freed = self.cost(v, w);
            for i in 0..self.width {
                let (x, new) = self.near[w as usize * self.width + i];
                let gain = freed - new;
                if gain <= self.least_gain {
                    break;
                }
                if x != v {
                    self.turned(ahead, [v, w, x], gain, &mut best);
                    self.cut_out(ahead, [v, w, x], gain, &mut best);
                }
            }
        }
        (best.gain > self.least_gain).then_some(best)
    }

    /// Gives up (v, w) and the leg before `x` for (w, x): a tour with one stretch turned,
    /// and from there the same once more.
    fn turned(&self, ahead: bool, [v, w, x]: [u32; 3], gain: f64, best: &mut Move) {
        let y = self.next(x, !ahead);
        if y == w {
            return;
        }
        let gain = gain + self.cost(x, y);
        let closed = gain - self.cost(y, v);
        if closed > best.gain {
            *best = Move {
                gain: closed,
                t: [v, w, x, y, v, v],
                kind: Kind::Two,
            };
        }
        let stretch = self.gap(w, y, ahead);
        for i in 0..self.width.min(SECOND_NEIGHBOURS) {
            let (p, new) = self.near[y as usize * self.width + i];
            let gain = gain - new;
            if gain <= best.gain.min(self.least_gain) {
                break;
            }
            if p == x || p == v {
                continue;
            }
            // The neighbour of `p` towards `v` as the tour is with the stretch turned.
            let inside = self.gap(w, p, ahead) <= stretch;
            let q = self.next(p, inside == ahead);
            if q == y {
                continue;
            }
            let closed = gain + self.cost(p, q) - self.cost(q, v);
            if closed > best.gain {
                *best = Move {
                    gain: closed,
                    t: [v, w, x, y, p, q],
                    kind: Kind::Three,
                };
            }
        }
    }

    /// Gives up (v, w) and the leg after `x` for (w, x): the stretch between is a ring of
    /// its own, which is cut open anywhere and put in between.
    fn cut_out(&self, ahead: bool, [v, w, x]: [u32; 3], gain: f64, best: &mut Move) {
        let y = self.next(x, ahead);
        if x == v || y == v && self.order.len() < 4 {
            return;
        }
        let gain = gain + self.cost(x, y);
        let stretch = self.gap(w, x, ahead);
        for i in 0..self.width.min(SECOND_NEIGHBOURS) {
            let (p, new) = self.near[y as usize * self.width + i];
            let gain = gain - new;
            if gain <= self.least_gain {
                break;
            }
            let along = self.gap(w, p, ahead);
            if along > stretch {
                continue;
            }
            if along < stretch {
                let q = self.next(p, ahead);
                let closed = gain + self.cost(p, q) - self.cost(q, v);
                if closed > best.gain {
                    *best = Move {
                        gain: closed,
                        t: [v, w, x, y, p, q],
                        kind: Kind::Swapped,
                    };
                }
            }
            if along > 0 {
                let q = self.next(p, !ahead);
                let closed = gain + self.cost(p, q) - self.cost(q, v);
                if closed > best.gain {
                    *best = Move {
                        gain: closed,
                        t: [v, w, x, y, p, q],
                        kind: Kind::BothTurned,
                    };
                }
            }
        }
    }

    fn carry_out(&mut self, found: Move) {
        let t = found.t;
        match found.kind {
            Kind::Two => self.exchange(t[0], t[1], t[3]),
            Kind::Three => {
                self.exchange(t[0], t[1], t[3]);
                self.exchange(t[0], t[3], t[5]);
            }
            Kind::BothTurned => {
                self.exchange(t[0], t[1], t[5]);
                self.exchange(t[1], t[4], t[2]);
            }
            Kind::Swapped => {
                self.exchange(t[0], t[1], t[2]);
                self.exchange(t[0], t[2], t[5]);
                self.exchange(t[2], t[4], t[1]);
            }
        }
        for v in t {
            self.look_at(v);
        }
    }

    /// Gives up the legs (a, b) and the one beyond `d` for one from `a` to `d` and one from
    /// `b` on: turns the stretch from `b` to `d`, where `b` follows `a`, ahead or back.
    fn exchange(&mut self, a: u32, b: u32, d: u32) {
        let (from, to) = if self.next(a, true) == b {
            (b, d)
        } else {
            (d, b)
        };
        let len = self.gap(from, to, true) + 1;
        self.reverse(self.at[from as usize] as usize, len);
    }

    /// Turns the places from position `i` on, `len` of them, cyclically; the shorter
    /// side of the tour is turned, which is the same closed tour.
    fn reverse(&mut self, i: usize, len: usize) {
        let n = self.order.len();
        let (mut i, mut len) = (i % n, len);
        if 2 * len > n {
            i = (i + len) % n;
            len = n - len;
        }
        self.journal.push((i as u32, len as u32));
        self.turn(i, len);
    }

    fn turn(&mut self, i: usize, len: usize) {
        let n = self.order.len();
        let (mut x, mut y) = (i, i + len + n - 1);
        while y >= n {
            y -= n;
        }
        for _ in 0..len / 2 {
            self.order.swap(x, y);
            self.at[self.order[x] as usize] = x as u32;
            self.at[self.order[y] as usize] = y as u32;
            x = if x + 1 == n { 0 } else { x + 1 };
            y = if y == 0 { n - 1 } else { y - 1 };
        }
    }
}

/// By place, the `width` nearest others, the nearest first; legs that are kept anyway
/// lead to no near place.
fn neighbours(names: &[usize], metric: &impl Metric, width: usize) -> Vec<(u32, f64)> {
    let n = names.len();
    let mut near = Vec::with_capacity(n * width);
    let mut row: Vec<(u32, f64)> = Vec::with_capacity(n);
    let order = |x: &(u32, f64), y: &(u32, f64)| x.1.total_cmp(&y.1).then(x.0.cmp(&y.0));
    for i in 0..n {
        row.clear();
        row.extend((0..n).filter(|&j| j != i).map(|j| {
            let cost = metric.cost(names[i], names[j]);
            (j as u32, if cost < 0.0 { f64::INFINITY } else { cost })
        }));
        if row.len() > width && width > 0 {
            row.select_nth_unstable_by(width - 1, order);
            row.truncate(width);
        }
        row.sort_unstable_by(order);
        near.extend_from_slice(&row);
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coverage::metric::{Matrix, Straight};
    use crate::coverage::tour::closed_cost;
    use skein_geometry::frame::Point;
    use skein_geometry::random::SplitMix64;

    #[test]
    fn every_exchange_gains_what_it_says_and_is_taken_back() {
        let mut random = SplitMix64::new(33);
        for round in 0..400 {
            let n = 4 + random.below(12);
            // Places that coincide are ordinary.
            let mut draw = || (10.0 * random.unit()).floor();
            let at: Vec<Point> = (0..n).map(|_| Point::new(draw(), draw())).collect();
            let m = Matrix::of(n, &Straight(&at));
            let mut exchange = Exchange::new((0..n).collect(), &m, 1e-9);
            let cost = |e: &Exchange<'_, Matrix>| closed_cost(&e.places(e.order()), &m);
            let start = exchange.order().to_vec();
            for _ in 0..1000 {
                let from = (0..n as u32).find_map(|v| exchange.best_from(v));
                let Some(found) = from else { break };
                let before = cost(&exchange);
                exchange.carry_out(found);
                let gain = before - cost(&exchange);
                assert!(
                    (gain - found.gain).abs() < 1e-6,
                    "round {round}: {gain} {found:?}"
                );
            }
            assert!((0..n as u32).all(|v| exchange.best_from(v).is_none()));
            exchange.take_back();
            assert_eq!(exchange.order(), start);
        }
    }
}
