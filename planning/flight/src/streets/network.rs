//! A network of streets: crossings, the stretches between them, and the turns at crossings.
//!
//! Lines that share a point hang together there. Where three or more stretches meet, or one ends,
//! is a crossing. Crossings that are joined by a stretch shorter than [`JOINED_M`] are one: maps
//! draw the two sides of an avenue apart, and no camera tells in which part of a junction a
//! vehicle is.
//!
//! # Guarantees
//! Numbers follow from the lines alone, whatever their order: stretches are sorted by the square
//! of `SQUARE_M` that their middle is in, so neighbours have near numbers.
//!
//! # Complexity
//! O(n log n) for n points.

use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;
use std::collections::{BTreeMap, BTreeSet};

/// Crossings that a shorter stretch joins are one, metres: what errors of places and the width of
/// an avenue come to.
pub const JOINED_M: f64 = 25.0;

/// The squares by which stretches are sorted, metres: a picture or two.
const SQUARE_M: f64 = 250.0;

/// Places at which it is asked whether a stretch is in a picture are no farther apart, metres.
const PLACE_M: f64 = 10.0;

/// A stretch of a street between two crossings.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Which street, by the number that its lines came with: that of the longest part.
    pub street: u16,
    /// The crossings at its ends.
    pub ends: [u16; 2],
    /// Its middle line, from the first end to the second, metres.
    pub way: Vec<Point>,
    /// How long that is, metres.
    pub length_m: f64,
}

/// A way over a crossing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Turn {
    /// From which stretch.
    pub from: u16,
    /// Over which crossing.
    pub over: u16,
    /// To which stretch.
    pub to: u16,
}

/// A place in the middle of a short part of a stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Of which stretch.
    pub edge: u16,
    /// Where, metres.
    pub at: Point,
    /// How long the part is, metres.
    pub length_m: f64,
}

/// Streets that hang together where they share a crossing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Network {
    crossings: Vec<Point>,
    edges: Vec<Edge>,
    /// Of each crossing the stretches that end there.
    at: Vec<Vec<u16>>,
    turns: Vec<Turn>,
    places: Vec<Place>,
    /// Of each stretch the first of its places.
    first: Vec<usize>,
}

/// A point by its bits: lines of one map share points exactly.
type Key = (i64, i64);

#[allow(
    clippy::cast_possible_truncation,
    reason = "float to integer casts saturate"
)]
fn key(p: Point) -> Key {
    // To the millimetre, as missions have them.
    let mm = |v: f64| (v * 1e3).round() as i64;
    (mm(p.x), mm(p.y))
}

/// The points of all lines, and which of them are joined by a line of which street.
#[derive(Debug, Default)]
struct Graph {
    places: BTreeMap<Key, Point>,
    joined: BTreeMap<Key, BTreeMap<Key, u16>>,
}

impl Graph {
    fn of(lines: &[(u16, Vec<Point>)]) -> Self {
        let mut all = Self::default();
        for (street, line) in lines {
            let mut before: Option<Key> = None;
            for p in line.iter().filter(|p| p.x.is_finite() && p.y.is_finite()) {
                let at = key(*p);
                all.places.entry(at).or_insert(*p);
                if let Some(b) = before.filter(|b| *b != at) {
                    for (from, to) in [(b, at), (at, b)] {
                        let known = all.joined.entry(from).or_default().entry(to);
                        let least = known.or_insert(*street);
                        *least = (*least).min(*street);
                    }
                }
                before = Some(at);
            }
        }
        all
    }

    fn degree(&self, at: Key) -> usize {
        self.joined.get(&at).map_or(0, BTreeMap::len)
    }

    /// The stretch from a point over a neighbour to where it ends.
    fn chain(&self, from: Key, over: Key) -> Vec<Key> {
        let mut way = vec![from, over];
        loop {
            let (before, at) = (way[way.len() - 2], way[way.len() - 1]);
            if at == from || self.degree(at) != 2 {
                return way;
            }
            let next = self.joined.get(&at).into_iter().flat_map(BTreeMap::keys);
            let Some(next) = next.copied().find(|k| *k != before) else {
                return way;
            };
            way.push(next);
        }
    }

    /// All stretches, each once, with its street.
    fn chains(&self) -> Vec<(u16, Vec<Key>)> {
        let mut done: BTreeSet<(Key, Key)> = BTreeSet::new();
        let mut chains = Vec::new();
        let ends = self.joined.keys().filter(|k| self.degree(**k) != 2);
        // What is left then are rings without a crossing.
        for from in ends.chain(self.joined.keys()) {
            for over in self.joined.get(from).into_iter().flat_map(BTreeMap::keys) {
                if done.contains(&(*from, *over)) {
                    continue;
                }
                let chain = self.chain(*from, *over);
                for w in chain.windows(2) {
                    done.insert((w[0], w[1]));
                    done.insert((w[1], w[0]));
                }
                chains.push((self.street(&chain), chain));
            }
        }
        chains
    }

    /// The street that most of a stretch is of.
    fn street(&self, chain: &[Key]) -> u16 {
        let mut lengths: BTreeMap<u16, f64> = BTreeMap::new();
        for w in chain.windows(2) {
            let street = self.joined.get(&w[0]).and_then(|to| to.get(&w[1]));
            let length_m = (self.places[&w[1]] - self.places[&w[0]]).norm();
            *lengths.entry(street.copied().unwrap_or(0)).or_default() += length_m;
        }
        let longest = lengths.iter().max_by(|a, b| a.1.total_cmp(b.1));
        longest.map_or(0, |(street, _)| *street)
    }

    fn line(&self, chain: &[Key]) -> Vec<Point> {
        chain.iter().map(|k| self.places[k]).collect()
    }
}

/// How long a line is, metres.
#[must_use]
pub fn length_m(way: &[Point]) -> f64 {
    way.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// The place of a line that is so far along, metres.
#[must_use]
pub fn along(way: &[Point], mut m: f64) -> Option<Point> {
    for w in way.windows(2) {
        let part_m = (w[1] - w[0]).norm();
        if m <= part_m && part_m > 0.0 {
            return Some(w[0] + (w[1] - w[0]) * (m / part_m));
        }
        m -= part_m;
    }
    way.last().copied()
}

/// Lines cut where streets meet: each a stretch with its street.
#[must_use]
pub fn stretches(lines: &[(u16, Vec<Point>)]) -> Vec<(u16, Vec<Point>)> {
    let graph = Graph::of(lines);
    let chains = graph.chains();
    chains.iter().map(|(s, c)| (*s, graph.line(c))).collect()
}

/// Which crossings are one: the least of each group.
#[derive(Debug, Default)]
struct Groups(BTreeMap<Key, Key>);

impl Groups {
    fn find(&self, mut k: Key) -> Key {
        while let Some(up) = self.0.get(&k).filter(|up| **up != k) {
            k = *up;
        }
        k
    }

    fn join(&mut self, a: Key, b: Key) {
        let (a, b) = (self.find(a), self.find(b));
        self.0.insert(a.max(b), a.min(b));
    }
}

impl Network {
    /// The network of lines, each with the number of its street. More than 65,535 of anything
    /// make no network: whoever makes a mission bounds them far below.
    #[must_use]
    pub fn of(lines: &[(u16, Vec<Point>)]) -> Self {
        let graph = Graph::of(lines);
        let mut groups = Groups::default();
        let mut kept: Vec<(u16, Vec<Key>, Vec<Point>, f64)> = Vec::new();
        let mut members: BTreeSet<Key> = BTreeSet::new();
        for (street, chain) in graph.chains() {
            let way = graph.line(&chain);
            let long_m = length_m(&way);
            let (from, to) = (chain[0], chain[chain.len() - 1]);
            members.extend([from, to]);
            if long_m < JOINED_M {
                groups.join(from, to);
            } else {
                kept.push((street, chain, way, long_m));
            }
        }
        // A group is where the middle of its members is, if a stretch ends there.
        let mut sums: BTreeMap<Key, (Point, f64)> = BTreeMap::new();
        for k in &members {
            let (sum, n) = sums
                .entry(groups.find(*k))
                .or_insert((Point::origin(), 0.0));
            *sum += graph.places[k].coords;
            *n += 1.0;
        }
        let ends = |chain: &[Key]| [chain[0], chain[chain.len() - 1]].map(|k| groups.find(k));
        let used: BTreeSet<Key> = kept.iter().flat_map(|(_, c, ..)| ends(c)).collect();
        let number: BTreeMap<Key, u16> = used.iter().copied().zip(0_u16..).collect();
        let crossings = used.iter().map(|k| {
            let (sum, n) = sums[k];
            sum / n
        });
        let mut all = Self {
            crossings: crossings.collect(),
            ..Self::default()
        };
        let edge = |(street, chain, way, length_m): (u16, Vec<Key>, Vec<Point>, f64)| Edge {
            street,
            ends: ends(&chain).map(|k| number.get(&k).copied().unwrap_or(0)),
            way,
            length_m,
        };
        all.edges = kept.into_iter().map(edge).collect();
        all.edges.sort_by_cached_key(|e| {
            let middle = along(&e.way, e.length_m / 2.0).unwrap_or_default();
            #[allow(
                clippy::cast_possible_truncation,
                reason = "float to integer casts saturate"
            )]
            let square = |v: f64| (v / SQUARE_M).floor() as i64;
            let first = (key(e.way[0]), key(e.way[e.way.len() - 1]));
            (square(middle.y), square(middle.x), key(middle), first)
        });
        all.join();
        all
    }

    /// What follows from crossings and stretches.
    fn join(&mut self) {
        self.at = vec![Vec::new(); self.crossings.len()];
        for (n, e) in (0_u16..).zip(&self.edges) {
            let once: BTreeSet<u16> = e.ends.into_iter().collect();
            once.into_iter()
                .for_each(|end| self.at[usize::from(end)].push(n));
            self.first.push(self.places.len());
            self.places.extend(places(n, e));
        }
        for (over, edges) in (0_u16..).zip(&self.at) {
            if edges.len() < 3 {
                continue;
            }
            for (from, to) in edges
                .iter()
                .flat_map(|f| edges.iter().map(move |t| (*f, *t)))
            {
                if from != to {
                    self.turns.push(Turn { from, over, to });
                }
            }
        }
        self.turns.sort_unstable();
    }

    /// The stretches, by number.
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Where the crossings are, by number, metres.
    #[must_use]
    pub fn crossings(&self) -> &[Point] {
        &self.crossings
    }

    /// The stretches that end at a crossing.
    #[must_use]
    pub fn at(&self, crossing: u16) -> &[u16] {
        self.at
            .get(usize::from(crossing))
            .map_or(&[], Vec::as_slice)
    }

    /// The ways over crossings of three stretches or more, ascending: their place is their number.
    #[must_use]
    pub fn turns(&self) -> &[Turn] {
        &self.turns
    }

    /// The number of a turn.
    #[must_use]
    pub fn turn(&self, turn: Turn) -> Option<usize> {
        self.turns.binary_search(&turn).ok()
    }

    /// The crossing that two stretches share; of two that which is nearer to a place.
    #[must_use]
    pub fn between(&self, (a, b): (u16, u16), near: Point) -> Option<u16> {
        let of = |n: u16| self.edges.get(usize::from(n)).map(|e| e.ends);
        let (a, b) = (of(a)?, of(b)?);
        let away_m = |end: &u16| {
            let at = self.crossings.get(usize::from(*end));
            at.map_or(f64::INFINITY, |at| (at - near).norm())
        };
        let shared = a.into_iter().filter(|end| b.contains(end));
        shared.min_by(|a, b| away_m(a).total_cmp(&away_m(b)).then(a.cmp(b)))
    }

    /// Places in the middle of short parts of all stretches, in the order of these.
    #[must_use]
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// The number of the place of a stretch that is nearest to so far along it, metres.
    #[must_use]
    pub fn place_along(&self, edge: u16, m: f64) -> Option<usize> {
        let e = self.edges.get(usize::from(edge))?;
        let first = *self.first.get(usize::from(edge))?;
        let n = parts(e.length_m);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, and is bounded next"
        )]
        let nth = (m / e.length_m * f64::from(n)).floor().max(0.0) as usize;
        Some(first + nth.min(usize::try_from(n).ok()?.saturating_sub(1)))
    }

    /// How long all streets are together, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.edges.iter().map(|e| e.length_m).sum()
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, and is at least one"
)]
fn parts(length_m: f64) -> u32 {
    (length_m / PLACE_M).ceil().max(1.0) as u32
}

fn places(edge: u16, e: &Edge) -> impl Iterator<Item = Place> + '_ {
    let n = parts(e.length_m);
    let each_m = e.length_m / f64::from(n);
    (0..n).filter_map(move |i| {
        Some(Place {
            edge,
            at: along(&e.way, (f64::from(i) + 0.5) * each_m)?,
            length_m: each_m,
        })
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Streets in squares of `side_m`, `n` each way.
    pub(crate) fn grid(n: u32, side_m: f64) -> Vec<(u16, Vec<Point>)> {
        let at = |i: u32, k: u32| Point::new(f64::from(i) * side_m, f64::from(k) * side_m);
        let along = (0..=n).map(|k| (0..=n).map(|i| at(i, k)).collect());
        let across = (0..=n).map(|i| (0..=n).map(|k| at(i, k)).collect());
        (0..).zip(along.chain(across)).collect()
    }

    #[test]
    fn lines_meet_where_they_share_a_point_and_are_numbered_whatever_their_order() {
        let mut lines = grid(2, 100.0);
        let net = Network::of(&lines);
        // Corners are no crossings: two stretches meet there.
        assert_eq!((net.crossings().len(), net.edges().len()), (5, 8));
        assert!((net.length_m() - 1_200.0).abs() < 1e-9);
        assert_eq!(net.turns().len(), 12 + 4 * 6);
        lines.reverse();
        for (_, line) in &mut lines {
            line.reverse();
        }
        let again = Network::of(&lines);
        let lengths = |n: &Network| n.edges().iter().map(|e| e.street).collect::<Vec<_>>();
        assert_eq!(lengths(&net), lengths(&again));
        assert_eq!(net.turns(), again.turns());
    }

    #[test]
    fn crossings_that_are_near_each_other_are_one() {
        // An avenue of two sides, crossed by a street.
        let p = Point::new;
        let lines = vec![
            (0, vec![p(0.0, 0.0), p(200.0, 0.0), p(400.0, 0.0)]),
            (0, vec![p(0.0, 12.0), p(200.0, 12.0), p(400.0, 12.0)]),
            (
                1,
                vec![
                    p(200.0, -150.0),
                    p(200.0, 0.0),
                    p(200.0, 12.0),
                    p(200.0, 150.0),
                ],
            ),
        ];
        let net = Network::of(&lines);
        assert_eq!(net.edges().len(), 6);
        let middle = net
            .crossings()
            .iter()
            .filter(|c| c.x > 150.0 && c.x < 250.0);
        let middle: Vec<&Point> = middle.filter(|c| c.y.abs() < 50.0).collect();
        assert_eq!(middle.len(), 1);
        assert!((middle[0].y - 6.0).abs() < 1e-9);
    }

    #[test]
    fn a_ring_without_a_crossing_is_a_stretch() {
        let p = Point::new;
        let ring = vec![p(0.0, 0.0), p(100.0, 0.0), p(100.0, 100.0), p(0.0, 0.0)];
        let net = Network::of(&[(3, ring)]);
        assert_eq!((net.edges().len(), net.crossings().len()), (1, 1));
        assert_eq!(net.edges()[0].ends, [0, 0]);
        assert_eq!(net.edges()[0].street, 3);
    }

    #[test]
    fn places_are_along_all_of_it() {
        let net = Network::of(&grid(1, 95.0));
        let sum: f64 = net.places().iter().map(|p| p.length_m).sum();
        assert!((sum - net.length_m()).abs() < 1e-6);
        for (i, e) in (0_u16..).zip(net.edges()) {
            let last = net.place_along(i, e.length_m).unwrap();
            assert_eq!(net.places()[last].edge, i);
            let first = net.place_along(i, 0.0).unwrap();
            assert_eq!(net.places()[first].edge, i);
            assert!(first == 0 || net.places()[first - 1].edge == i - 1);
        }
    }
}
