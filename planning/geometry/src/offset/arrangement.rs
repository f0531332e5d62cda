//! The boundary of the region round which closed polylines wind at least once.
//!
//! Signs of turns are exact; degenerate contacts are reported, not resolved, because
//! the caller moves every vertex a little and asks again. Whether the answer means
//! what it should is left to the certificate (D2.7 §2.3.1).

use super::boxes::{Bounds, Chains};
use super::raw::{Raw, Source};
use super::shape::{double_area, small, winding};
use crate::frame::Point;
use crate::polygon::side;
use robust::{Coord, orient2d};

/// Loops that enclose less than this are rounding, square metres.
const SPECK_M2: f64 = 1e-9;

/// Two pieces meet in a way that has no sign, or the windings do not add up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Degenerate(pub(super) Source);

/// Closed loops, one after the other.
#[derive(Debug, Default)]
pub(super) struct Loops {
    pub(super) points: Vec<Point>,
    /// One past the last vertex of each loop.
    pub(super) ends: Vec<usize>,
}

impl Loops {
    /// The vertices of every loop.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[Point]> {
        let mut first = 0;
        self.ends.iter().map(move |&end| {
            let ring = &self.points[first..end];
            first = end;
            ring
        })
    }

    fn push(&mut self, p: Point, first: usize, merge_m: f64) {
        let near = |q: &Point| (p - q).norm_squared() <= merge_m * merge_m;
        if !self.points[first..].last().is_some_and(near) {
            self.points.push(p);
        }
    }

    /// Ends the loop that began at `first`; drops it when it encloses nothing.
    fn close(&mut self, first: usize, merge_m: f64) {
        while self.points.len() > first + 1
            && (self.points[first] - self.points[self.points.len() - 1]).norm_squared()
                <= merge_m * merge_m
        {
            self.points.pop();
        }
        let ring = &self.points[first..];
        if ring.len() < 3 || double_area(ring).abs() < 2.0 * SPECK_M2 {
            self.points.truncate(first);
        } else {
            self.ends.push(self.points.len());
        }
    }
}

/// One of the two edges at a crossing.
#[derive(Clone, Copy, Debug)]
struct Entry {
    edge: u32,
    /// Where on the edge, 0 to 1.
    t: f64,
    at: Point,
    /// Twice the number of the crossing, plus one for its second edge.
    key: u32,
    /// What is added to the winding on the right when the other edge is passed.
    step: i32,
}

/// The loops of the boundary, the region on their left.
///
/// `chain_m` is the size of neighbouring edges that are looked at together, and
/// `merge_m` the length below which an edge of the boundary is dropped.
///
/// # Complexity
/// A sweep over the boxes of n edges, then O(k log k) for k crossings.
///
/// # Errors
/// [`Degenerate`] when a turn has no sign or the windings contradict each other.
pub(super) fn positive_region(raw: &Raw, chain_m: f64, merge_m: f64) -> Result<Loops, Degenerate> {
    let next = successors(raw);
    let entries = crossings(raw, &next, chain_m)?;
    let arrangement = Arrangement::new(raw, next, entries);
    let right = arrangement.windings()?;
    arrangement.trace(&right, merge_m)
}

fn successors(raw: &Raw) -> Vec<u32> {
    let mut next: Vec<u32> = (1..=small(raw.points.len())).collect();
    let mut first = 0;
    for &end in &raw.ends {
        next[end - 1] = first;
        first = small(end);
    }
    next
}

fn turn(a: Point, b: Point, c: Point) -> f64 {
    let coord = |p: Point| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// All proper crossings, two entries each, sorted by edge and place on it.
fn crossings(raw: &Raw, next: &[u32], chain_m: f64) -> Result<Vec<Entry>, Degenerate> {
    let p = &raw.points;
    let chains = Chains::new(p, &raw.ends, chain_m);
    let mut entries: Vec<Entry> = Vec::new();
    let mut count = 0;
    chains.overlaps(|e, f| {
        if next[e as usize] == f || next[f as usize] == e {
            return Ok(());
        }
        let (a, b) = (p[e as usize], p[next[e as usize] as usize]);
        let (c, d) = (p[f as usize], p[next[f as usize] as usize]);
        let (sc, sd) = (turn(a, b, c), turn(a, b, d));
        if sc * sd > 0.0 {
            return Ok(());
        }
        let (sa, sb) = (turn(c, d, a), turn(c, d, b));
        if sa * sb > 0.0 {
            return Ok(());
        }
        let signs = [sc, sd, sa, sb];
        if signs.iter().any(|s| s.abs() <= 0.0) {
            return Err(Degenerate(raw.source[e as usize]));
        }
        let t = sa / (sa - sb);
        let at = a + (b - a) * t;
        let step = if sd > 0.0 { -1 } else { 1 };
        entries.push(Entry {
            edge: e,
            t,
            at,
            key: count,
            step,
        });
        entries.push(Entry {
            edge: f,
            t: sc / (sc - sd),
            at,
            key: count + 1,
            step: -step,
        });
        count += 2;
        Ok(())
    })?;
    entries.sort_unstable_by(|x, y| {
        x.edge
            .cmp(&y.edge)
            .then(x.t.total_cmp(&y.t))
            .then(x.key.cmp(&y.key))
    });
    Ok(entries)
}

struct Arrangement<'a> {
    raw: &'a Raw,
    next: Vec<u32>,
    entries: Vec<Entry>,
    /// For each edge its first entry; one more for the end.
    first: Vec<u32>,
    /// For each key where its entry is.
    slot: Vec<u32>,
}

impl<'a> Arrangement<'a> {
    fn new(raw: &'a Raw, next: Vec<u32>, entries: Vec<Entry>) -> Self {
        let mut first = vec![0; next.len() + 1];
        let mut slot = vec![0; entries.len()];
        for (i, e) in entries.iter().enumerate() {
            first[e.edge as usize + 1] += 1;
            slot[e.key as usize] = small(i);
        }
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        Self {
            raw,
            next,
            entries,
            first,
            slot,
        }
    }

    /// The other edge's entry at the same crossing.
    fn twin(&self, entry: usize) -> usize {
        self.slot[(self.entries[entry].key ^ 1) as usize] as usize
    }

    /// The winding on the right, after each entry and, after those, at the begin of
    /// each polyline.
    fn windings(&self) -> Result<Vec<i32>, Degenerate> {
        let mut right = vec![0; self.entries.len()];
        let mut begins = Vec::with_capacity(self.raw.ends.len());
        let mut first = 0;
        let boxes = self.ring_boxes();
        for (ring, &end) in self.raw.ends.iter().enumerate() {
            let start = (first..end)
                .min_by(|&i, &j| {
                    let (a, b) = (self.raw.points[i], self.raw.points[j]);
                    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
                })
                .unwrap_or(first);
            let mut now = self.begin(ring, first, end, start, &boxes)?;
            begins.push(now);
            let began = now;
            for edge in (start..end).chain(first..start) {
                for k in self.first[edge]..self.first[edge + 1] {
                    now += self.entries[k as usize].step;
                    right[k as usize] = now;
                }
            }
            if now != began {
                return Err(Degenerate(self.raw.source[first]));
            }
            first = end;
        }
        right.extend(begins);
        Ok(right)
    }

    fn ring_boxes(&self) -> Vec<Option<Bounds>> {
        let mut first = 0;
        self.raw
            .ends
            .iter()
            .map(|&end| {
                let b = Bounds::around(&self.raw.points[first..end], 0);
                first = end;
                b
            })
            .collect()
    }

    /// The winding to the right of the edge that leaves a ring's western vertex.
    fn begin(
        &self,
        ring: usize,
        first: usize,
        end: usize,
        start: usize,
        boxes: &[Option<Bounds>],
    ) -> Result<i32, Degenerate> {
        let p = &self.raw.points;
        let previous = if start == first { end - 1 } else { start - 1 };
        let v = p[start];
        // All of the ring lies east: what is outside is on the right of a left turn
        // and on the left of a right turn.
        let mut now = match side(p[previous], v, p[self.next[start] as usize]) {
            0 => return Err(Degenerate(self.raw.source[start])),
            s if s > 0 => 0,
            _ => -1,
        };
        let mut from = 0;
        for (other, &to) in self.raw.ends.iter().enumerate() {
            if other != ring && boxes[other].is_some_and(|b| b.holds(v)) {
                now += winding(&p[from..to], v);
            }
            from = to;
        }
        Ok(now)
    }

    /// Follows the edges whose right side is outside. Behind a crossing the boundary
    /// goes on along the other edge: there the windings are 0, 1, 2, 1 all around.
    fn trace(&self, right: &[i32], merge_m: f64) -> Result<Loops, Degenerate> {
        let mut loops = Loops::default();
        let mut seen = vec![false; self.entries.len()];
        for begin in 0..self.entries.len() {
            if right[begin] == 0 && !seen[begin] {
                let first = loops.points.len();
                self.follow(begin, right, &mut seen, |p| loops.push(p, first, merge_m))?;
                loops.close(first, merge_m);
            }
        }
        let mut first = 0;
        for (ring, &end) in self.raw.ends.iter().enumerate() {
            let alone = self.first[first] == self.first[end];
            if alone && right[self.entries.len() + ring] == 0 {
                let begin = loops.points.len();
                for &p in &self.raw.points[first..end] {
                    loops.push(p, begin, merge_m);
                }
                loops.close(begin, merge_m);
            }
            first = end;
        }
        Ok(loops)
    }

    fn follow(
        &self,
        begin: usize,
        right: &[i32],
        seen: &mut [bool],
        mut each: impl FnMut(Point),
    ) -> Result<(), Degenerate> {
        let mut at = begin;
        loop {
            seen[at] = true;
            each(self.entries[at].at);
            let mut edge = self.entries[at].edge as usize;
            let mut k = at + 1;
            // Ends: the polyline of this edge has at least the entry we stand on.
            while k >= self.first[edge + 1] as usize {
                edge = self.next[edge] as usize;
                each(self.raw.points[edge]);
                k = self.first[edge] as usize;
            }
            at = self.twin(k);
            if at == begin {
                return Ok(());
            }
            if right[at] != 0 || seen[at] {
                return Err(Degenerate(self.raw.source[edge]));
            }
        }
    }
}
