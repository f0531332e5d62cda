//! Which way each stop of a flight is flown, and the curves between them.
//!
//! The shortest chain over all ways of flying the stops is found with Dubins curves as if
//! nothing was in the way; the curves of that chain are then searched for among zones, and
//! where there is none, or a longer one, the chain is found anew. A stop that no curve
//! joins to its neighbours is taken out, and put back wherever in the flight there are
//! curves to it.

use super::{COURSES, Flown, Stand, Stop};
use crate::flight::Leg;
use skein_flight::route::Router;
use skein_flight::trajectory::dubins;
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{TAU, atan2, wrap_pi};
use std::collections::BTreeMap;

/// Chains that are tried for each stop.
const CHAINS_A_STOP: usize = 4;

/// Places in a flight where a stop that was taken out is tried again.
const PLACES_TRIED: usize = 24;

/// What a way round something takes to find, in ways that nothing is in the way of.
const WORK_AROUND: u64 = 40;

/// A stop and the way in which it is flown; none for the start.
pub type Node = Option<(usize, usize)>;

/// Where a flight begins or ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Terminal {
    /// There, on any course.
    Place(Point),
    /// There, on this course.
    Pose(Pose),
}

impl Terminal {
    fn position(self) -> Point {
        match self {
            Self::Place(p) => p,
            Self::Pose(pose) => pose.position(),
        }
    }
}

/// The curves that were looked for.
struct Ways<'a> {
    router: &'a Router,
    stops: &'a [Stop],
    start: Terminal,
    end: Terminal,
    known: BTreeMap<(Node, Node), Option<Curve>>,
    /// What was done so far, in ways that nothing is in the way of.
    work: u64,
}

impl Ways<'_> {
    fn stand(&self, node: (usize, usize)) -> &Stand {
        &self.stops[node.0].stands[node.1]
    }

    /// Where the way between two stops begins and ends.
    fn terminals(&self, from: Node, to: Node) -> (Terminal, Terminal) {
        let from = from.map_or(self.start, |a| Terminal::Pose(self.stand(a).to));
        let to = to.map_or(self.end, |b| Terminal::Pose(self.stand(b).from));
        (from, to)
    }

    /// What the way between two stops takes at least, or takes as far as it is known; none
    /// where there is no way.
    fn cost_m(&self, from: Node, to: Node) -> Option<f64> {
        if let Some(known) = self.known.get(&(from, to)) {
            return known.as_ref().map(Curve::length_m);
        }
        let radius_m = self.router.limits().turn_radius_m;
        Some(match self.terminals(from, to) {
            (Terminal::Pose(a), Terminal::Pose(b)) => dubins::length_m(a, b, radius_m),
            (a, b) => (b.position() - a.position()).norm(),
        })
    }

    /// The curve from one to the other, searched for when it is first asked for.
    fn curve(&mut self, from: Node, to: Node) -> Option<&Curve> {
        if !self.known.contains_key(&(from, to)) {
            let thought_m = self.cost_m(from, to);
            let curve = self.searched(from, to);
            let found_m = curve.as_ref().map(Curve::length_m);
            let is_end = from.is_none() || to.is_none();
            let as_thought = found_m
                .zip(thought_m)
                .is_some_and(|(f, t)| is_end || f <= t + 1e-6);
            self.work += if as_thought { 1 } else { WORK_AROUND };
            self.known.insert((from, to), curve);
        }
        self.known.get(&(from, to)).and_then(Option::as_ref)
    }

    fn searched(&self, from: Node, to: Node) -> Option<Curve> {
        let found = match self.terminals(from, to) {
            (Terminal::Pose(a), Terminal::Pose(b)) => self.router.route(a, b),
            (Terminal::Pose(a), Terminal::Place(b)) => self.router.route_to_point(a, b),
            // Flown backwards from the stop: at its start a UAV may head anywhere.
            (Terminal::Place(a), Terminal::Pose(b)) => {
                let way = self.router.route_to_point(b.reversed(), a);
                way.map(|curve| curve.reversed())
            }
            (Terminal::Place(a), Terminal::Place(b)) => return self.direct(a, b),
        };
        found.ok()
    }

    /// From the start to the end over nothing, on any course at both.
    fn direct(&self, start: Point, end: Point) -> Option<Curve> {
        if start == end {
            return Some(Curve::empty());
        }
        let d = end - start;
        let ahead_rad = atan2(d.y, d.x);
        let course = |i: u8| ahead_rad + TAU * f64::from(i) / f64::from(COURSES);
        let from = |i: u8| Pose::new(start, wrap_pi(course(i)));
        let all = (0..COURSES).filter_map(|i| self.router.route_to_point(from(i), end).ok());
        all.min_by(|a, b| a.length_m().total_cmp(&b.length_m()))
    }

    /// Whether there is a way between two stops, however they are flown.
    fn joins(&mut self, from: Option<usize>, to: Option<usize>) -> bool {
        let nodes = |stop: Option<usize>, stops: &[Stop]| -> Vec<Node> {
            stop.map_or(vec![None], |s| {
                (0..stops[s].stands.len()).map(|i| Some((s, i))).collect()
            })
        };
        let (from, to) = (nodes(from, self.stops), nodes(to, self.stops));
        from.iter()
            .any(|a| to.iter().any(|b| self.curve(*a, *b).is_some()))
    }

    /// The shortest chain over stops in this order as far as ways are known; the two
    /// neighbours between which there is none where there is no chain.
    fn chain(&self, order: &[usize]) -> Result<Vec<Node>, usize> {
        // By stand of the stop reached: what it takes to there, and from which stand.
        let mut rows: Vec<Vec<(f64, usize)>> = Vec::with_capacity(order.len() + 1);
        let mut before: Vec<(Node, f64)> = vec![(None, 0.0)];
        for (k, stop) in order.iter().map(|s| Some(*s)).chain([None]).enumerate() {
            let stands = stop.map_or(1, |s| self.stops[s].stands.len());
            let node = |i: usize| stop.map(|s| (s, i));
            let row: Vec<(f64, usize)> = (0..stands)
                .map(|i| {
                    let own_m = node(i).map_or(0.0, |n| {
                        let stand = self.stand(n);
                        stand.curve.length_m() + stand.dearer_m
                    });
                    let each = before.iter().enumerate().filter_map(|(j, (from, m))| {
                        m.is_finite().then_some(())?;
                        Some((m + own_m + self.cost_m(*from, node(i))?, j))
                    });
                    let best = each.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                    best.unwrap_or((f64::INFINITY, 0))
                })
                .collect();
            if row.iter().all(|(m, _)| m.is_infinite()) {
                return Err(k);
            }
            before = row
                .iter()
                .enumerate()
                .map(|(i, r)| (node(i), r.0))
                .collect();
            rows.push(row);
        }
        let mut nodes: Vec<Node> = Vec::with_capacity(order.len());
        let mut at = 0;
        for k in (0..order.len()).rev() {
            at = rows[k + 1][at].1;
            nodes.push(Some((order[k], at)));
        }
        nodes.reverse();
        Ok(nodes)
    }

    /// The chain over stops in this order with all its curves found.
    fn joined(&mut self, order: &mut Vec<usize>, left: &mut Vec<usize>) -> Vec<Node> {
        let mut tries = CHAINS_A_STOP * (order.len() + 4);
        while !order.is_empty() {
            match self.chain(order) {
                Ok(nodes) if tries > 0 => {
                    tries -= 1;
                    if self.find_all(&nodes) {
                        return nodes;
                    }
                }
                // What was found last is not the shortest, but all of it can be flown: or
                // the flight ends where it cannot.
                Ok(nodes) => return self.as_far_as_known(order, left, nodes),
                Err(k) => self.leave_out(order, left, k),
            }
        }
        Vec::new()
    }

    /// Searches for the curves of a chain. Returns whether the chain still is the
    /// shortest: all of its curves are as long as was thought.
    fn find_all(&mut self, nodes: &[Node]) -> bool {
        let mut as_thought = true;
        let ends = [None].into_iter().chain(nodes.iter().copied());
        let starts: Vec<Node> = ends.collect();
        for (k, from) in starts.iter().enumerate() {
            let to = nodes.get(k).copied().flatten();
            let thought_m = self.cost_m(*from, to).unwrap_or(f64::INFINITY);
            let found_m = self.curve(*from, to).map_or(f64::INFINITY, Curve::length_m);
            // Ways from and to a place are straight as far as is thought.
            let is_place = |end: Terminal| matches!(end, Terminal::Place(_));
            let is_end =
                (from.is_none() && is_place(self.start)) || (to.is_none() && is_place(self.end));
            as_thought &= found_m.is_finite() && (is_end || found_m <= thought_m + 1e-6);
        }
        as_thought
    }

    /// The stops of a chain up to the first way that is not there, all of it as found.
    fn as_far_as_known(
        &mut self,
        order: &mut Vec<usize>,
        left: &mut Vec<usize>,
        nodes: Vec<Node>,
    ) -> Vec<Node> {
        let mut kept: Vec<Node> = Vec::new();
        for node in nodes {
            let from = kept.last().copied().flatten();
            let there = self.curve(from, node).is_some() && self.curve(node, None).is_some();
            match node {
                Some(_) if there => kept.push(node),
                Some((stop, _)) => left.push(stop),
                None => {}
            }
        }
        order.clear();
        order.extend(kept.iter().flatten().map(|n| n.0));
        kept
    }

    /// Takes out the stop that is to blame for a missing way to place `k` of the order.
    fn leave_out(&mut self, order: &mut Vec<usize>, left: &mut Vec<usize>, k: usize) {
        let at = |i: Option<usize>| i.and_then(|i| order.get(i).copied());
        let (before, after) = (at(k.checked_sub(1)), at(Some(k)));
        let (first, last) = (at(k.checked_sub(2)), at(Some(k + 1)));
        let culprit = match (before, after) {
            (Some(_), Some(b)) => {
                if self.joins(before, last) {
                    (k, b)
                } else if self.joins(first, after) {
                    (k - 1, order[k - 1])
                } else {
                    (k, b)
                }
            }
            (None, Some(b)) => (k, b),
            (Some(a), None) => (k - 1, a),
            (None, None) => return,
        };
        order.remove(culprit.0);
        left.push(culprit.1);
    }

    /// Puts a stop back where it makes the flight least longer; returns whether it could.
    fn put_back(&mut self, nodes: &mut Vec<Node>, stop: usize) -> bool {
        let mut places: Vec<(f64, usize, usize)> = Vec::new();
        for k in 0..=nodes.len() {
            let from = k.checked_sub(1).and_then(|i| nodes[i]);
            let to = nodes.get(k).copied().flatten();
            for i in 0..self.stops[stop].stands.len() {
                let node = Some((stop, i));
                if let (Some(there), Some(on)) = (self.cost_m(from, node), self.cost_m(node, to)) {
                    let direct_m = self.cost_m(from, to).unwrap_or(0.0);
                    places.push((there + on - direct_m, k, i));
                }
            }
        }
        places.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, k, i) in places.into_iter().take(PLACES_TRIED) {
            let from = k.checked_sub(1).and_then(|i| nodes[i]);
            let to = nodes.get(k).copied().flatten();
            let node = Some((stop, i));
            if self.curve(from, node).is_some() && self.curve(node, to).is_some() {
                nodes.insert(k, node);
                return true;
            }
        }
        false
    }
}

/// What is flown over stops in this order, from a start and back to it.
///
/// Every curve keeps the router's limits, and all join without a bend; stops that no curve
/// leads to are told in [`Flown::left`].
pub fn fly(router: &Router, start: Point, stops: &[Stop]) -> Flown {
    fly_to(router, (start, start), stops)
}

/// As [`fly`], from one place to another one.
pub fn fly_to(router: &Router, (start, end): (Point, Point), stops: &[Stop]) -> Flown {
    let ends = (Terminal::Place(start), Terminal::Place(end));
    fly_between(router, ends, stops)
}

/// As [`fly`], from one place or pose to another one.
pub fn fly_between(router: &Router, (start, end): (Terminal, Terminal), stops: &[Stop]) -> Flown {
    let mut ways = Ways {
        router,
        stops,
        start,
        end,
        known: BTreeMap::new(),
        work: 0,
    };
    let flies = |s: &usize| stops[*s].stands.iter().any(|x| is_clear(router, x));
    let (mut order, mut left): (Vec<usize>, Vec<usize>) = (0..stops.len()).partition(flies);
    let blocked = left.len();
    let mut nodes = ways.joined(&mut order, &mut left);
    for stop in left.split_off(blocked) {
        if !ways.put_back(&mut nodes, stop) {
            left.push(stop);
        }
    }
    left.sort_unstable();
    let mut flown = Flown {
        order: nodes.iter().copied().flatten().collect(),
        left,
        legs: Vec::new(),
        ways: Vec::new(),
        work: 0,
    };
    let mut from: Node = None;
    for node in nodes.iter().copied().chain([None]) {
        let way = ways.curve(from, node).cloned().unwrap_or_default();
        push(&mut flown.legs, way, false);
        if let Some(n) = node {
            for (curve, sees) in ways.stand(n).parts() {
                push(&mut flown.legs, curve, sees && stops[n.0].sees);
            }
        }
        from = node;
    }
    flown.work = ways.work;
    let ways = ways.known.into_iter();
    let told = ways.map(|((a, b), curve)| (a, b, curve.map(|c| c.length_m())));
    flown.ways = told.collect();
    flown
}

fn push(legs: &mut Vec<Leg>, curve: Curve, sees: bool) {
    if !curve.is_empty() {
        legs.push(Leg { curve, sees });
    }
}

/// Whether a way of flying over a stop keeps clear itself.
pub(super) fn is_clear(router: &Router, stand: &Stand) -> bool {
    let keep_m = router.limits().clearance_m;
    router.zones().is_clear(&stand.curve, keep_m)
}
