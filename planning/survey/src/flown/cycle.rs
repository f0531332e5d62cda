//! Stops flown round and round: what begins with the first of them ends there, on the same
//! course.

use super::chain::{Terminal, fly_between, is_clear};
use super::{Flown, Stand, Stop, length_m};
use crate::flight::Leg;
use skein_flight::route::Router;
use skein_flight::trajectory::dubins;

/// Stands of the first stop that are tried.
const MOST_STANDS: usize = 4;

/// A flight that ends nearer than this to where it began is closed, metres.
const CLOSED_M: f64 = 1e-3;

/// A closed flight.
#[derive(Clone, Debug)]
pub struct Cycle {
    /// What is flown: the last leg ends where the first begins, on the same course.
    pub legs: Vec<Leg>,
    /// The stops that no curve joins to the others.
    pub left: Vec<usize>,
}

impl Cycle {
    fn length_m(&self) -> f64 {
        length_m(&self.legs)
    }
}

/// What is flown over stops in this order, and from the last of them to the first; `None`
/// where no stop can be flown round and round.
///
/// Every curve keeps the router's limits, and all join without a bend.
pub fn fly_round(router: &Router, stops: &[Stop]) -> Option<Cycle> {
    let all: Vec<usize> = (0..stops.len()).collect();
    let (first, cycle) = (0..stops.len()).find_map(|first| {
        let order = rotated(&all, first);
        let mut stands = stands(router, stops, &order);
        stands.truncate(MOST_STANDS);
        let found = stands
            .iter()
            .find_map(|i| closed(router, stops, &order, *i))?;
        Some((first, found))
    })?;
    // The stand of the first stop was chosen by its neighbours alone: once more from the
    // other side, with that of the stop there as it was found.
    let order = rotated(&all, first);
    let Some((half, stand)) = cycle.1.get(cycle.1.len() / 2).copied() else {
        return Some(cycle.0);
    };
    let again = closed(router, stops, &rotated(&order, half), stand);
    let better = again
        .filter(|(c, _)| (c.left.len(), c.length_m()) < (cycle.0.left.len(), cycle.0.length_m()));
    Some(better.unwrap_or(cycle).0)
}

/// The same order, beginning with a stop.
fn rotated(order: &[usize], first: usize) -> Vec<usize> {
    let at = order.iter().position(|s| *s == first).unwrap_or(0);
    let (before, after) = order.split_at(at);
    after.iter().chain(before).copied().collect()
}

/// The stands of the first stop of an order that are clear, those first that lie well
/// between those of the stops beside it.
fn stands(router: &Router, stops: &[Stop], order: &[usize]) -> Vec<usize> {
    let radius_m = router.limits().turn_radius_m;
    let (Some(first), Some(last)) = (order.first(), order.last()) else {
        return Vec::new();
    };
    let next = order.get(1).unwrap_or(first);
    let least = |stop: usize, cost: &dyn Fn(&Stand) -> f64| {
        let each = stops[stop].stands.iter().map(cost);
        each.fold(f64::INFINITY, f64::min)
    };
    let clear = stops[*first].stands.iter().enumerate();
    let mut all: Vec<(f64, usize)> = clear
        .filter(|(_, stand)| is_clear(router, stand))
        .map(|(i, stand)| {
            let on = least(*next, &|s| dubins::length_m(stand.to, s.from, radius_m));
            let back = least(*last, &|s| dubins::length_m(s.to, stand.from, radius_m));
            (on + back, i)
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    all.into_iter().map(|(_, i)| i).collect()
}

/// Stops in an order, the first flown by this stand; and the other stops that are flown,
/// each with its stand.
fn closed(
    router: &Router,
    stops: &[Stop],
    order: &[usize],
    stand: usize,
) -> Option<(Cycle, Vec<(usize, usize)>)> {
    let (first, others) = order.split_first()?;
    let own = &stops[*first].stands[stand];
    let rest: Vec<Stop> = others.iter().map(|s| stops[*s].clone()).collect();
    let ends = (Terminal::Pose(own.to), Terminal::Pose(own.from));
    let Flown {
        legs, order, left, ..
    } = fly_between(router, ends, &rest);
    let closes = legs.last().and_then(|leg| leg.curve.end())?;
    if (closes.position() - own.from.position()).norm() > CLOSED_M {
        return None;
    }
    let mut all = vec![Leg {
        curve: own.curve.clone(),
        sees: stops[*first].sees,
    }];
    all.extend(legs);
    let cycle = Cycle {
        legs: all,
        left: left.into_iter().map(|i| others[i]).collect(),
    };
    let flown = order.into_iter().map(|(i, stand)| (others[i], stand));
    Some((cycle, flown.collect()))
}
