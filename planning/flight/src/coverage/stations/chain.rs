//! Which pose each station is seen at, and the curves between them: the shortest
//! closed chain over the poses offered, with the curves checked against the zones only
//! where the chain runs (D2.7 §2.4.3, §3.4).
//!
//! A closed chain is cut open at a station whose pose an open chain has chosen, so the
//! answer is the shortest through that pose, not always the shortest of all.

use super::Visit;
use crate::coverage::ring::LoopProblem;
use crate::route::Router;
use crate::trajectory::dubins;
use skein_geometry::Curve;
use skein_geometry::frame::Pose;
use skein_geometry::math::TAU;
use std::collections::{BTreeMap, BTreeSet};

/// Routes that are searched for one leg; the pairs of poses left over count as
/// blocked. Each takes up to milliseconds.
const ROUTES_A_LEG: u8 = 6;

/// Where a station that was left out is put into the chain after all: so many ways by a pose of
/// it, the shortest first, are held against the zones, and for so many routes are searched.
const DETOURS: usize = 128;
const ROUTED_DETOURS: usize = 12;

/// Two poses closer than this are the same: what joins them is a full circle.
const SAME_M: f64 = 1e-2;
const SAME_RAD: f64 = 1e-3;

/// What is known of flying from one pose to another.
#[derive(Clone, Debug)]
enum Leg {
    /// The shortest Dubins curve, not yet held against the zones.
    Guess(f64),
    /// A curve that keeps clear.
    Clear(Curve),
    /// None was found.
    Blocked,
}

impl Leg {
    fn cost_m(&self) -> f64 {
        match self {
            Self::Guess(m) => *m,
            Self::Clear(curve) => curve.length_m(),
            Self::Blocked => f64::INFINITY,
        }
    }
}

/// What is known of all ways from the poses of one station to those of the next.
#[derive(Clone, Debug, Default)]
struct Legs {
    each: Vec<Leg>,
    /// How long each is as far as is known, metres: nothing else is looked at so often.
    costs_m: Vec<f64>,
}

impl Legs {
    fn of(each: Vec<Leg>) -> Self {
        let costs_m = each.iter().map(Leg::cost_m).collect();
        Self { each, costs_m }
    }

    fn set(&mut self, nth: usize, leg: Leg) {
        self.costs_m[nth] = leg.cost_m();
        self.each[nth] = leg;
    }

    fn open(&self) -> usize {
        self.costs_m.iter().filter(|m| m.is_finite()).count()
    }
}

/// Stations in order, with the poses they may be seen at.
pub(super) struct Chain<'a> {
    problem: &'a LoopProblem,
    router: &'a Router,
    stands: Vec<(usize, Vec<Pose>)>,
    /// By station of departure: poses of departure times poses of arrival.
    legs: Vec<Legs>,
    tries: Vec<u8>,
    /// By station: how often a leg from or to it was blocked.
    blame: BTreeMap<usize, u32>,
    /// What was left out, with one more chance when the other end of the leg that was
    /// blocked is left out, too.
    left: Vec<Left>,
    /// What came back: the second time it is left out for good.
    returned: BTreeSet<usize>,
    /// Where each station stands in the order.
    rank: BTreeMap<usize, usize>,
}

/// A station that was left out.
struct Left {
    station: usize,
    stands: Vec<Pose>,
    other: usize,
}

impl<'a> Chain<'a> {
    pub(super) fn new(
        problem: &'a LoopProblem,
        router: &'a Router,
        stands: Vec<(usize, Vec<Pose>)>,
    ) -> Self {
        let mut chain = Self {
            problem,
            router,
            legs: Vec::new(),
            tries: vec![0; stands.len()],
            blame: BTreeMap::new(),
            left: Vec::new(),
            returned: BTreeSet::new(),
            rank: stands.iter().map(|s| s.0).zip(0..).collect(),
            stands,
        };
        chain.legs = (0..chain.stands.len()).map(|i| chain.guesses(i)).collect();
        chain
    }

    /// The stations as they are flown, and the numbers of those that nothing reaches.
    pub(super) fn solve(mut self) -> (Vec<Visit>, Vec<usize>) {
        while !self.stands.is_empty() {
            match self.choose() {
                Some(poses) => {
                    if let Some(visits) = self.realise(&poses) {
                        return self.put_in(visits);
                    }
                }
                None => self.give_up(),
            }
        }
        (Vec::new(), self.left.iter().map(|l| l.station).collect())
    }

    /// What was left out has no way from or to those beside it in the order: it is flown between
    /// two others, if there is a way. The stations as they are flown, and the numbers of those
    /// that nothing reaches.
    fn put_in(&self, mut visits: Vec<Visit>) -> (Vec<Visit>, Vec<usize>) {
        let mut left: Vec<&Left> = self.left.iter().collect();
        // One that is put in may lead to the next.
        loop {
            let before = left.len();
            left.retain(|l| match self.detour(&visits, &l.stands) {
                Some((at, there, onward)) => {
                    visits[at].onward = there;
                    let station = l.station;
                    visits.insert(at + 1, Visit { station, onward });
                    false
                }
                None => true,
            });
            if left.is_empty() || left.len() == before {
                return (visits, left.iter().map(|l| l.station).collect());
            }
        }
    }

    /// After which visit a station is flown at one of these poses, and the curves there and on.
    fn detour(&self, visits: &[Visit], stands: &[Pose]) -> Option<(usize, Curve, Curve)> {
        let r = self.problem.turn_radius_m;
        let guess_m = |from: Pose, to: Pose| {
            if same(from, to) {
                TAU * r
            } else {
                dubins::length_m(from, to, r)
            }
        };
        let starts: Vec<Pose> = visits.iter().filter_map(|v| v.onward.start()).collect();
        let mut ways = Vec::with_capacity(starts.len() * stands.len());
        for (at, &from) in starts.iter().enumerate() {
            let to = starts[(at + 1) % starts.len()];
            for &by in stands {
                let more_m = guess_m(from, by) + guess_m(by, to) - visits[at].onward.length_m();
                ways.push((more_m, at, from, by, to));
            }
        }
        ways.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (routes, tries) in [(false, DETOURS), (true, ROUTED_DETOURS)] {
            for &(_, at, from, by, to) in ways.iter().take(tries) {
                let Some(there) = self.linked(from, by, routes) else {
                    continue;
                };
                if let Some(onward) = self.linked(by, to, routes) {
                    return Some((at, there, onward));
                }
            }
        }
        None
    }

    fn next(&self, i: usize) -> usize {
        (i + 1) % self.stands.len()
    }

    fn guesses(&self, i: usize) -> Legs {
        let r = self.problem.turn_radius_m;
        let (from, to) = (&self.stands[i].1, &self.stands[self.next(i)].1);
        let mut legs = Vec::with_capacity(from.len() * to.len());
        for &a in from {
            for &b in to {
                let length_m = if same(a, b) {
                    TAU * r
                } else {
                    dubins::length_m(a, b, r)
                };
                legs.push(Leg::Guess(length_m));
            }
        }
        Legs::of(legs)
    }

    fn leg(&self, i: usize, a: usize, b: usize) -> &Leg {
        &self.legs[i].each[a * self.stands[self.next(i)].1.len() + b]
    }

    /// How long the legs from one pose are as far as is known, metres, by pose of arrival.
    fn costs_m(&self, i: usize, a: usize) -> &[f64] {
        let to = self.stands[self.next(i)].1.len();
        &self.legs[i].costs_m[a * to..(a + 1) * to]
    }

    /// A pose for each station, or nothing where some leg has no way left.
    fn choose(&self) -> Option<Vec<usize>> {
        let n = self.stands.len();
        // Where the chain is cut open the choice is made by a chain that is open there
        // and closes half way round.
        let half = n / 2;
        let (_, open) = self.pass(half, None, false).or_else(|| {
            let starts = 0..self.stands[half].1.len();
            starts.filter_map(|b| self.pass(half, Some(b), true)).next()
        })?;
        let closed = self.pass(0, Some(open[0]), true).map(|(_, poses)| poses);
        closed.or_else(|| {
            (0..self.stands[0].1.len())
                .filter_map(|a| self.pass(0, Some(a), true))
                .min_by(|x, y| x.0.total_cmp(&y.0))
                .map(|(_, poses)| poses)
        })
    }

    /// The shortest chain that begins at pose `a` of station `first`, or at any of its poses, and
    /// goes once round: back to the same pose when `closed`, else to any. Of chains as short as
    /// each other that which begins at the first pose, then that which ends there.
    fn pass(&self, first: usize, a: Option<usize>, closed: bool) -> Option<(f64, Vec<usize>)> {
        let n = self.stands.len();
        let poses = self.stands[first].1.len();
        let is_start = |pose: usize| a.is_none_or(|a| a == pose);
        let cost_of = |pose| if is_start(pose) { 0.0 } else { f64::INFINITY };
        // How far from where each pose is reached.
        let mut cost: Vec<(f64, usize)> = (0..poses).map(|pose| (cost_of(pose), pose)).collect();
        let mut back: Vec<Vec<usize>> = Vec::with_capacity(n);
        for step in 0..n {
            let i = (first + step) % n;
            let to = self.stands[self.next(i)].1.len();
            let mut best = vec![(f64::INFINITY, usize::MAX); to];
            let mut came = vec![0; to];
            let reached = cost.iter().enumerate().filter(|(_, c)| c.0.is_finite());
            for (from, &(so_far, start)) in reached {
                let ways = best.iter_mut().zip(&mut came).zip(self.costs_m(i, from));
                for ((slot, came), leg_m) in ways {
                    let total = so_far + leg_m;
                    if total < slot.0 || total <= slot.0 && start < slot.1 {
                        (*slot, *came) = ((total, start), from);
                    }
                }
            }
            cost = best;
            back.push(came);
        }
        let by_cost = |x: &usize, y: &usize| {
            let (x, y) = (cost[*x], cost[*y]);
            x.0.total_cmp(&y.0).then(x.1.cmp(&y.1))
        };
        let end = match a.filter(|_| closed) {
            Some(a) => a,
            None => (0..cost.len()).min_by(by_cost)?,
        };
        let cost = cost.into_iter().map(|c| c.0).collect::<Vec<f64>>();
        if !cost[end].is_finite() {
            return None;
        }
        let mut poses = vec![0; n];
        let mut at = end;
        for step in (0..n).rev() {
            at = back[step][at];
            poses[(first + step) % n] = at;
        }
        Some((cost[end], poses))
    }

    /// Holds the legs of a choice against the zones. The curves, or nothing when some
    /// leg turned out longer than guessed or blocked: then the choice is made again.
    fn realise(&mut self, poses: &[usize]) -> Option<Vec<Visit>> {
        let n = self.stands.len();
        let mut as_guessed = true;
        for i in 0..n {
            let (a, b) = (poses[i], poses[self.next(i)]);
            if let Leg::Guess(guess_m) = *self.leg(i, a, b) {
                let leg = self.flown(i, a, b);
                as_guessed &= leg.cost_m() <= guess_m + 1e-6;
                let at = a * self.stands[self.next(i)].1.len() + b;
                self.legs[i].set(at, leg);
            }
        }
        if !as_guessed {
            return None;
        }
        let visit = |i: usize| match self.leg(i, poses[i], poses[self.next(i)]) {
            Leg::Clear(onward) => Some(Visit {
                station: self.stands[i].0,
                onward: onward.clone(),
            }),
            _ => None,
        };
        (0..n).map(visit).collect()
    }

    /// A curve from pose to pose that keeps clear: a Dubins word, else a route round
    /// the zones.
    fn flown(&mut self, i: usize, a: usize, b: usize) -> Leg {
        let (from, to) = (self.stands[i].1[a], self.stands[self.next(i)].1[b]);
        if let Some(direct) = self.linked(from, to, false) {
            return Leg::Clear(direct);
        }
        if same(from, to) || self.tries[i] == ROUTES_A_LEG {
            return Leg::Blocked;
        }
        self.tries[i] += 1;
        self.routed(from, to).map_or(Leg::Blocked, Leg::Clear)
    }

    /// A curve from pose to pose that keeps clear: a Dubins word, else, where that is asked for, a
    /// route round the zones.
    fn linked(&self, from: Pose, to: Pose, routes: bool) -> Option<Curve> {
        let r = self.problem.turn_radius_m;
        if same(from, to) {
            let circles = [1.0, -1.0].map(|turn| Curve::from_pieces(from, &[(turn / r, TAU * r)]));
            return circles.into_iter().find(|c| self.problem.flyable(c));
        }
        let shortest = dubins::shortest(from, to, r);
        if self.problem.flyable(&shortest) {
            return Some(shortest);
        }
        routes.then(|| self.routed(from, to)).flatten()
    }

    fn routed(&self, from: Pose, to: Pose) -> Option<Curve> {
        let way = self.router.route(from, to).ok();
        way.filter(|c| self.problem.flyable(c))
    }

    /// Leaves out one end of a leg that has no way left, the one that was in the way more often;
    /// or the station at which no way in meets a way out. What was left out because of it comes
    /// back, once.
    fn give_up(&mut self) {
        let n = self.stands.len();
        let open = |i: &usize| self.legs[*i].open();
        let i = (0..n).min_by_key(open).unwrap_or(0);
        let parted = if open(&i) > 0 { self.parted() } else { None };
        let (out, other) = if let Some(parted) = parted {
            (parted, self.stands[self.next(parted)].0)
        } else {
            let (a, b) = (self.stands[i].0, self.stands[self.next(i)].0);
            for end in [a, b] {
                *self.blame.entry(end).or_default() += 1;
            }
            if self.blame[&a] > self.blame[&b] {
                (i, b)
            } else {
                (self.next(i), a)
            }
        };
        let (station, stands) = self.leave_out(out);
        let back: Vec<Left>;
        (back, self.left) = std::mem::take(&mut self.left)
            .into_iter()
            .partition(|l| l.other == station && !self.returned.contains(&l.station));
        for l in back {
            self.blame.remove(&l.station);
            self.returned.insert(l.station);
            self.put_back(l.station, l.stands);
        }
        self.left.push(Left {
            station,
            stands,
            other,
        });
    }

    /// Where every leg has ways left, the station at which a chain from the first one ends: none
    /// of the poses that are reached there leads on.
    fn parted(&self) -> Option<usize> {
        let mut reached = vec![true; self.stands[0].1.len()];
        (0..self.stands.len()).find(|&i| {
            let onward = (0..self.stands[self.next(i)].1.len()).map(|b| {
                let mut from = reached.iter().enumerate().filter(|(_, is)| **is);
                from.any(|(a, _)| self.costs_m(i, a)[b].is_finite())
            });
            reached = onward.collect();
            !reached.contains(&true)
        })
    }

    fn leave_out(&mut self, i: usize) -> (usize, Vec<Pose>) {
        let out = self.stands.remove(i);
        self.legs.remove(i);
        self.tries.remove(i);
        let n = self.stands.len();
        if n > 0 {
            self.renew((i + n - 1) % n);
        }
        out
    }

    fn put_back(&mut self, station: usize, stands: Vec<Pose>) {
        let rank = self.rank[&station];
        let i = self.stands.partition_point(|s| self.rank[&s.0] < rank);
        self.stands.insert(i, (station, stands));
        self.legs.insert(i, Legs::default());
        self.tries.insert(i, 0);
        let n = self.stands.len();
        self.renew(i);
        self.renew((i + n - 1) % n);
    }

    /// Forgets what is known of a leg whose other end has changed.
    fn renew(&mut self, i: usize) {
        self.tries[i] = 0;
        self.legs[i] = self.guesses(i);
    }
}

fn same(a: Pose, b: Pose) -> bool {
    (a.position() - b.position()).norm() < SAME_M
        && skein_geometry::math::wrap_pi(a.heading_rad - b.heading_rad).abs() < SAME_RAD
}
