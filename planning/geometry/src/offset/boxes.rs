//! Which boxes overlap: a sweep over their western sides.
//!
//! Carries the pair searches of the offset (D2.7 §2.3.1); what an overlapping pair
//! means is left to the caller.

use crate::frame::Point;

/// An axis-parallel box with the number of the thing it surrounds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) west: f64,
    pub(super) east: f64,
    pub(super) south: f64,
    pub(super) north: f64,
    pub(super) id: u32,
}

impl Bounds {
    /// The box round two points.
    #[inline]
    pub(super) fn of(a: Point, b: Point, id: u32) -> Self {
        // Comparisons instead of `f64::min`: coordinates are numbers here, and
        // this way each side is one instruction.
        let (west, east) = if a.x < b.x { (a.x, b.x) } else { (b.x, a.x) };
        let (south, north) = if a.y < b.y { (a.y, b.y) } else { (b.y, a.y) };
        Self {
            west,
            east,
            south,
            north,
            id,
        }
    }

    /// The smallest box round all points; `None` without points.
    pub(super) fn around(points: &[Point], id: u32) -> Option<Self> {
        let mut all = Self::of(*points.first()?, *points.first()?, id);
        for p in points {
            all.west = all.west.min(p.x);
            all.east = all.east.max(p.x);
            all.south = all.south.min(p.y);
            all.north = all.north.max(p.y);
        }
        Some(all)
    }

    /// The box with every side moved outward.
    pub(super) fn grown(self, by_m: f64) -> Self {
        Self {
            west: self.west - by_m,
            east: self.east + by_m,
            south: self.south - by_m,
            north: self.north + by_m,
            id: self.id,
        }
    }

    /// The box round both, with the number of this one.
    fn and(&self, other: &Self) -> Self {
        Self {
            west: self.west.min(other.west),
            east: self.east.max(other.east),
            south: self.south.min(other.south),
            north: self.north.max(other.north),
            id: self.id,
        }
    }

    /// Whether `p` is inside or on the border.
    pub(super) fn holds(&self, p: Point) -> bool {
        self.west <= p.x && p.x <= self.east && self.south <= p.y && p.y <= self.north
    }

    #[inline]
    fn meets(&self, other: &Self) -> bool {
        // Without short circuits: four comparisons cost less than a missed branch.
        (self.west <= other.east)
            & (other.west <= self.east)
            & (self.south <= other.north)
            & (other.south <= self.north)
    }
}

/// Sorts by western sides, ties by number, so that every machine sweeps alike.
pub(super) fn sort(boxes: &mut [Bounds]) {
    boxes.sort_unstable_by(|a, b| a.west.total_cmp(&b.west).then(a.id.cmp(&b.id)));
}

/// Calls `each` for every pair of overlapping boxes of a sorted list.
///
/// # Errors
/// The first error of `each`, which ends the sweep.
pub(super) fn overlaps<E>(
    sorted: &[Bounds],
    mut each: impl FnMut(u32, u32) -> Result<(), E>,
) -> Result<(), E> {
    for (i, a) in sorted.iter().enumerate() {
        for b in &sorted[i + 1..] {
            if b.west > a.east {
                break;
            }
            if (b.south <= a.north) & (a.south <= b.north) {
                each(a.id, b.id)?;
            }
        }
    }
    Ok(())
}

/// Calls `each` for every box of `left` that overlaps one of `right`, both sorted.
///
/// # Errors
/// The first error of `each`, which ends the search.
pub(super) fn overlaps_between<E>(
    left: &[Bounds],
    right: &[Bounds],
    mut each: impl FnMut(&Bounds, &Bounds) -> Result<(), E>,
) -> Result<(), E> {
    let (mut i, mut j) = (0, 0);
    // Each pair is found once: from the box that begins first.
    while i < left.len() && j < right.len() {
        if left[i].west <= right[j].west {
            let a = &left[i];
            for b in right[j..].iter().take_while(|b| b.west <= a.east) {
                if a.meets(b) {
                    each(a, b)?;
                }
            }
            i += 1;
        } else {
            let b = &right[j];
            for a in left[i..].iter().take_while(|a| a.west <= b.east) {
                if a.meets(b) {
                    each(a, b)?;
                }
            }
            j += 1;
        }
    }
    Ok(())
}

/// Edges in one chain, at most: half a circle of the usual step.
const LONGEST_CHAIN: usize = 16;

/// The edges of closed polylines in chains that never turn back from east to west, so
/// that no chain meets itself, and small, so that a box tells something.
#[derive(Debug)]
pub(super) struct Chains {
    /// One box an edge; edge i begins at point i.
    edges: Vec<Bounds>,
    /// One box a chain, sorted.
    chains: Vec<Bounds>,
    /// The first edge of each chain, and one more for the end.
    first: Vec<u32>,
}

impl Chains {
    /// Cuts polylines, given as for the rings of `Raw`, into chains whose boxes are
    /// at most `largest_m` wide and high together, or one edge.
    pub fn new(points: &[Point], ends: &[usize], largest_m: f64) -> Self {
        let mut out = Self {
            edges: Vec::with_capacity(points.len()),
            chains: Vec::with_capacity(points.len() / 2),
            first: Vec::with_capacity(points.len() / 2),
        };
        let mut begin = 0;
        for &end in ends {
            let ring = &points[begin..end];
            out.cut(ring, begin, largest_m);
            begin = end;
        }
        out.first.push(number(points.len()));
        sort(&mut out.chains);
        out
    }

    fn cut(&mut self, ring: &[Point], begin: usize, largest_m: f64) {
        let (mut length, mut east) = (LONGEST_CHAIN, false);
        for (i, &a) in ring.iter().enumerate() {
            let b = *ring.get(i + 1).unwrap_or(&ring[0]);
            let edge = Bounds::of(a, b, number(begin + i));
            self.edges.push(edge);
            let eastward = a.x < b.x || (a.x <= b.x && a.y < b.y);
            let fits = i > 0 && length < LONGEST_CHAIN && eastward == east;
            let joined = self.chains.last().filter(|_| fits).map(|c| c.and(&edge));
            match joined {
                Some(c) if (c.east - c.west) + (c.north - c.south) <= largest_m => {
                    if let Some(last) = self.chains.last_mut() {
                        *last = c;
                    }
                    length += 1;
                }
                _ => {
                    let chain = Bounds {
                        id: number(self.first.len()),
                        ..edge
                    };
                    self.first.push(edge.id);
                    self.chains.push(chain);
                    (length, east) = (1, eastward);
                }
            }
        }
    }

    fn edges_of(&self, chain: &Bounds) -> &[Bounds] {
        let i = chain.id as usize;
        &self.edges[self.first[i] as usize..self.first[i + 1] as usize]
    }

    /// Calls `each` for every pair of edges of different chains whose boxes overlap.
    ///
    /// # Errors
    /// The first error of `each`, which ends the search.
    pub(super) fn overlaps<E>(
        &self,
        mut each: impl FnMut(u32, u32) -> Result<(), E>,
    ) -> Result<(), E> {
        for (i, a) in self.chains.iter().enumerate() {
            for b in &self.chains[i + 1..] {
                if b.west > a.east {
                    break;
                }
                if (b.south <= a.north) & (a.south <= b.north) {
                    for e in self.edges_of(a).iter().filter(|e| e.meets(b)) {
                        for f in self.edges_of(b).iter().filter(|f| f.meets(e)) {
                            each(e.id, f.id)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Calls `each` for every box of a sorted list and every edge that overlap.
    ///
    /// # Errors
    /// The first error of `each`, which ends the search.
    pub(super) fn overlaps_with<E>(
        &self,
        sorted: &[Bounds],
        mut each: impl FnMut(u32, u32) -> Result<(), E>,
    ) -> Result<(), E> {
        overlaps_between(sorted, &self.chains, |a, chain| {
            self.edges_of(chain)
                .iter()
                .filter(|e| e.meets(a))
                .try_for_each(|e| each(a.id, e.id))
        })
    }
}

fn number(i: usize) -> u32 {
    super::shape::small(i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn list(raw: &[(f64, f64, f64, f64)]) -> Vec<Bounds> {
        raw.iter()
            .enumerate()
            .map(|(i, &(x, y, w, h))| {
                Bounds::of(Point::new(x, y), Point::new(x + w, y + h), i as u32)
            })
            .collect()
    }

    fn boxes(n: usize) -> impl Strategy<Value = Vec<(f64, f64, f64, f64)>> {
        proptest::collection::vec((0.0..100.0, 0.0..100.0, 0.0..20.0, 0.0..20.0), 0..n)
    }

    fn pairs(found: impl FnOnce(&mut dyn FnMut(u32, u32))) -> Vec<(u32, u32)> {
        let mut all = Vec::new();
        found(&mut |i, j| all.push((i, j)));
        all.sort_unstable();
        all
    }

    proptest! {
        #[test]
        fn sweeps_find_what_comparing_all_finds(a in boxes(90), b in boxes(90)) {
            let (mut a, mut b) = (list(&a), list(&b));
            sort(&mut a);
            sort(&mut b);
            let got = pairs(|add| overlaps_between(&a, &b, |x, y| { add(x.id, y.id); Ok::<(), ()>(()) }).unwrap());
            let want = pairs(|add| for x in &a {
                b.iter().filter(|y| x.meets(y)).for_each(|y| add(x.id, y.id));
            });
            prop_assert_eq!(got, want);
            let got = pairs(|add| overlaps(&a, |i, j| { add(i, j); Ok::<(), ()>(()) }).unwrap());
            let want = pairs(|add| for (i, x) in a.iter().enumerate() {
                a[i + 1..].iter().filter(|y| x.meets(y)).for_each(|y| add(x.id, y.id));
            });
            prop_assert_eq!(got, want);
        }

        #[test]
        fn chains_find_every_pair_of_edges_that_are_not_in_one_chain(
            p in proptest::collection::vec((0.0..100.0, 0.0..100.0), 3..60),
            q in proptest::collection::vec((0.0..9.0, 0.0..9.0), 3..60),
            largest_m in 0.0..150.0,
        ) {
            let points: Vec<Point> = p.iter().chain(&q).map(|&(x, y)| Point::new(x, y)).collect();
            let ends = [p.len(), points.len()];
            let chains = Chains::new(&points, &ends, largest_m);
            let mut chain_of = Vec::new();
            for c in 0..chains.chains.len() {
                chain_of.extend((chains.first[c]..chains.first[c + 1]).map(|_| c));
            }
            prop_assert_eq!(chain_of.len(), points.len());
            let got = pairs(|add| chains.overlaps(|i, j| { add(i.min(j), i.max(j)); Ok::<(), ()>(()) }).unwrap());
            let edges = &chains.edges;
            let want = pairs(|add| for i in 0..edges.len() {
                for j in i + 1..edges.len() {
                    if chain_of[i] != chain_of[j] && edges[i].meets(&edges[j]) {
                        add(i as u32, j as u32);
                    }
                }
            });
            prop_assert_eq!(got, want);
        }
    }
}
