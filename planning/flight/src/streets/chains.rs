//! Lines of a map made ready for a mission: cut where streets meet, of one part that hangs
//! together, and without the points that change nothing.

use super::network::{length_m, stretches};
use skein_geometry::frame::Point;
use std::collections::{BTreeMap, BTreeSet};

/// A line is thinned so that it strays no farther, metres: less than a lane.
const THINNED_M: f64 = 1.5;

/// Stretches of lines, cut where streets meet, the largest part of those that hang together, and
/// thinned.
#[must_use]
pub fn chains(lines: &[(u16, Vec<Point>)]) -> Vec<(u16, Vec<Point>)> {
    let all = stretches(lines);
    let kept = largest(&all);
    let kept = kept.into_iter().map(|i| (all[i].0, thinned(&all[i].1)));
    kept.collect()
}

/// Points by which lines hang together.
fn key(p: Point) -> (u64, u64) {
    (p.x.to_bits(), p.y.to_bits())
}

/// Of the parts that hang together the longest, by numbers of lines.
fn largest(all: &[(u16, Vec<Point>)]) -> Vec<usize> {
    let mut ends: BTreeMap<(u64, u64), Vec<usize>> = BTreeMap::new();
    for (i, (_, way)) in all.iter().enumerate() {
        for p in [way[0], way[way.len() - 1]] {
            ends.entry(key(p)).or_default().push(i);
        }
    }
    let mut left: BTreeSet<usize> = (0..all.len()).collect();
    let mut best: (f64, Vec<usize>) = (-1.0, Vec::new());
    while let Some(start) = left.pop_first() {
        let mut part = vec![start];
        let mut next = 0;
        while let Some(i) = part.get(next).copied() {
            next += 1;
            let way = &all[i].1;
            for p in [way[0], way[way.len() - 1]] {
                for other in &ends[&key(p)] {
                    if left.remove(other) {
                        part.push(*other);
                    }
                }
            }
        }
        let long_m = part.iter().map(|i| length_m(&all[*i].1)).sum();
        if long_m > best.0 {
            part.sort_unstable();
            best = (long_m, part);
        }
    }
    best.1
}

/// Douglas and Peucker's simplification; ends stay.
fn thinned(way: &[Point]) -> Vec<Point> {
    let (Some(first), Some(last)) = (way.first(), way.last()) else {
        return Vec::new();
    };
    let off = |p: &Point| {
        let along = last - first;
        let length_m = along.norm();
        if length_m < 1e-9 {
            return (p - first).norm();
        }
        let share = (along.dot(&(p - first)) / (length_m * length_m)).clamp(0.0, 1.0);
        (first + along * share - p).norm()
    };
    let inner = way
        .iter()
        .enumerate()
        .skip(1)
        .take(way.len().saturating_sub(2));
    let farthest = inner.max_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    match farthest.filter(|(_, p)| off(p) > THINNED_M) {
        None => vec![*first, *last],
        Some((i, _)) => {
            let mut both = thinned(&way[..=i]);
            both.pop();
            both.extend(thinned(&way[i..]));
            both
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_part_is_kept_and_thinned() {
        let p = Point::new;
        let lines = vec![
            (
                0,
                vec![p(0.0, 0.0), p(50.0, 0.4), p(100.0, 0.0), p(150.0, 40.0)],
            ),
            (1, vec![p(100.0, -80.0), p(100.0, 0.0), p(100.0, 90.0)]),
            (2, vec![p(900.0, 0.0), p(960.0, 0.0)]),
        ];
        let kept = chains(&lines);
        assert_eq!(kept.len(), 4);
        assert!(kept.iter().all(|(_, way)| way.len() == 2));
        assert!(kept.iter().all(|(street, _)| *street < 2));
    }
}
