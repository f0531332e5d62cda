//! Roads as a graph on which vehicles drive (D2.7 §1.5.2).
//!
//! Lines that share a point meet there. A vehicle drives on from where it is and chooses at
//! each crossing; only in a dead end does it turn round.

use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{TAU, atan2, tan, wrap_pi};
use skein_geometry::random::SplitMix64;
use std::collections::BTreeMap;

/// Points nearer than this are one, metres.
const JOINED_M: f64 = 0.5;

/// Streets shorter than this in all are no town: nobody can drive there, metres.
const LEAST_M: f64 = 200.0;

/// A street map.
#[derive(Clone, Debug, Default)]
pub struct Roads {
    places: Vec<Point>,
    neighbours: Vec<Vec<usize>>,
    /// Of each place, from each neighbour to each: the tangent of half the turn there.
    turns: Vec<Vec<f64>>,
}

/// The tangent of half the turn from one piece of road into the next, at most that of a hairpin.
fn half_turn(before: Vector, after: Vector) -> f64 {
    let turn_rad = wrap_pi(atan2(after.y, after.x) - atan2(before.y, before.x)).abs();
    tan((turn_rad / 2.0).min(TAU / 4.0 - 0.05)).max(1e-6)
}

impl Roads {
    /// Joins lines of points. Of parts that do not hang together the largest is kept; `None`
    /// if nothing is left on which to drive.
    #[must_use]
    pub fn of(lines: &[Vec<Point>]) -> Option<Self> {
        let mut all = Self::default();
        let mut known: BTreeMap<(i64, i64), usize> = BTreeMap::new();
        for line in lines {
            let mut before = None;
            for p in line.iter().filter(|p| p.x.is_finite() && p.y.is_finite()) {
                let at = *known.entry(key(p)).or_insert_with(|| {
                    all.places.push(*p);
                    all.neighbours.push(Vec::new());
                    all.places.len() - 1
                });
                if let Some(b) = before.filter(|b| *b != at) {
                    all.join(b, at);
                }
                before = Some(at);
            }
        }
        let largest = all.largest_part();
        (largest.length_m() >= LEAST_M).then_some(largest)
    }

    /// Number of places.
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Its streets as lines of two points.
    #[must_use]
    pub fn lines(&self) -> Vec<Vec<Point>> {
        let of = |a: usize| {
            let ahead = self.neighbours[a].iter().filter(move |b| a < **b);
            ahead.map(move |b| vec![self.places[a], self.places[*b]])
        };
        (0..self.places.len()).flat_map(of).collect()
    }

    /// A place by its number.
    pub(super) fn place(&self, n: usize) -> Point {
        self.places[n]
    }

    /// Places one can drive to from a place.
    pub(super) fn next_of(&self, n: usize) -> &[usize] {
        &self.neighbours[n]
    }

    /// Some place from which one can drive, and one to drive to.
    pub(super) fn draw(&self, random: &mut SplitMix64) -> (usize, usize) {
        let from = random.below(self.places.len());
        let next = &self.neighbours[from];
        (from, next[random.below(next.len())])
    }

    /// The place nearest to a given one, and one to drive to from there.
    pub(super) fn nearest(&self, to: Point, random: &mut SplitMix64) -> (usize, usize) {
        let away = |n: &usize| (self.places[*n] - to).norm();
        let all = 0..self.places.len();
        let from = all.min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0);
        let next = &self.neighbours[from];
        (from, next[random.below(next.len())])
    }

    fn join(&mut self, a: usize, b: usize) {
        for (from, to) in [(a, b), (b, a)] {
            if !self.neighbours[from].contains(&to) {
                self.neighbours[from].push(to);
            }
        }
    }

    fn length_m(&self) -> f64 {
        let both: f64 = (0..self.places.len())
            .flat_map(|a| self.neighbours[a].iter().map(move |b| (a, *b)))
            .map(|(a, b)| (self.places[a] - self.places[b]).norm())
            .sum();
        both / 2.0
    }

    /// The part with the most places.
    fn largest_part(&self) -> Self {
        let mut part = vec![usize::MAX; self.places.len()];
        let mut sizes = Vec::new();
        for start in 0..self.places.len() {
            if part[start] != usize::MAX {
                continue;
            }
            let mut open = vec![start];
            part[start] = sizes.len();
            let mut size = 0_usize;
            while let Some(at) = open.pop() {
                size += 1;
                for next in &self.neighbours[at] {
                    if part[*next] == usize::MAX {
                        part[*next] = sizes.len();
                        open.push(*next);
                    }
                }
            }
            sizes.push(size);
        }
        let Some(best) = (0..sizes.len()).max_by_key(|i| (sizes[*i], usize::MAX - i)) else {
            return Self::default();
        };
        let kept: Vec<usize> = (0..part.len()).filter(|i| part[*i] == best).collect();
        let renumbered: BTreeMap<usize, usize> = kept
            .iter()
            .enumerate()
            .map(|(new, old)| (*old, new))
            .collect();
        let neighbours = kept.iter().map(|old| {
            let next = self.neighbours[*old].iter();
            next.filter_map(|n| renumbered.get(n).copied()).collect()
        });
        let places: Vec<Point> = kept.iter().map(|i| self.places[*i]).collect();
        let neighbours: Vec<Vec<usize>> = neighbours.collect();
        let turns = neighbours.iter().zip(&places).map(|(next, at)| {
            let all = next
                .iter()
                .flat_map(|from| next.iter().map(move |to| (*from, *to)));
            all.map(|(from, to)| half_turn(at - places[from], places[to] - at))
                .collect()
        });
        Self {
            turns: turns.collect(),
            neighbours,
            places,
        }
    }

    /// The tangent of half the turn at a place, from one neighbour to another or back to it.
    pub(super) fn half_turn(&self, from: usize, at: usize, to: usize) -> f64 {
        let next = &self.neighbours[at];
        let nth = |of: usize| next.iter().position(|n| *n == of);
        match (nth(from), nth(to)) {
            (Some(i), Some(j)) => self.turns[at][i * next.len() + j],
            _ => half_turn(
                self.places[at] - self.places[from],
                self.places[to] - self.places[at],
            ),
        }
    }
}

/// The square that a point lies in.
fn key(p: &Point) -> (i64, i64) {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "float to integer casts saturate"
    )]
    let square = |v: f64| (v / JOINED_M).round() as i64;
    (square(p.x), square(p.y))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Streets in squares of `side_m`, `n` each way.
    pub(crate) fn grid(n: u32, side_m: f64) -> Vec<Vec<Point>> {
        let at = |i: u32, k: u32| Point::new(f64::from(i) * side_m, f64::from(k) * side_m);
        let along = (0..=n).map(|k| (0..=n).map(|i| at(i, k)).collect());
        let across = (0..=n).map(|i| (0..=n).map(|k| at(i, k)).collect());
        along.chain(across).collect()
    }

    #[test]
    fn crossings_join_and_islands_are_left_out() {
        let mut lines = grid(3, 100.0);
        lines.push(vec![Point::new(9e3, 0.0), Point::new(9.1e3, 0.0)]);
        let roads = Roads::of(&lines).unwrap();
        assert_eq!(roads.len(), 16);
        assert!((roads.length_m() - 2_400.0).abs() < 1e-9);
        let most = (0..16).map(|i| roads.next_of(i).len()).max();
        assert_eq!(most, Some(4));
    }

    #[test]
    fn no_streets_are_no_town() {
        assert!(Roads::of(&[]).is_none());
        assert!(Roads::of(&[vec![Point::new(0.0, 0.0); 5]]).is_none());
        assert!(Roads::of(&[vec![Point::new(f64::NAN, 0.0), Point::new(1.0, 0.0)]]).is_none());
    }
}
