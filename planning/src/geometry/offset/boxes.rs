//! Which boxes overlap: a sweep over their western sides.
//!
//! Carries the pair searches of the offset (D2.7 §2.3.1); what an overlapping pair
//! means is left to the caller.

use crate::frame::Point;

/// Below this many pairs two lists are compared without sorting: a sort of a few
/// dozen boxes costs about as much as a thousand comparisons.
const FEW_PAIRS: usize = 2048;

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

/// Calls `each` for every box of `left` that overlaps one of `right`.
///
/// # Errors
/// The first error of `each`, which ends the search.
pub(super) fn overlaps_between<E>(
    left: &[Bounds],
    right: &[Bounds],
    mut each: impl FnMut(u32, u32) -> Result<(), E>,
) -> Result<(), E> {
    if left.len() * right.len() <= FEW_PAIRS {
        for a in left {
            for b in right {
                if a.meets(b) {
                    each(a.id, b.id)?;
                }
            }
        }
        return Ok(());
    }
    let (mut left, mut right) = (left.to_vec(), right.to_vec());
    sort(&mut left);
    sort(&mut right);
    let (mut i, mut j) = (0, 0);
    // Each pair is found once: from the box that begins first.
    while i < left.len() && j < right.len() {
        if left[i].west <= right[j].west {
            let a = left[i];
            for b in right[j..].iter().take_while(|b| b.west <= a.east) {
                if a.meets(b) {
                    each(a.id, b.id)?;
                }
            }
            i += 1;
        } else {
            let b = right[j];
            for a in left[i..].iter().take_while(|a| a.west <= b.east) {
                if a.meets(&b) {
                    each(a.id, b.id)?;
                }
            }
            j += 1;
        }
    }
    Ok(())
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

    proptest! {
        #[test]
        fn both_sweeps_find_what_comparing_all_finds(a in boxes(90), b in boxes(90)) {
            let (a, b) = (list(&a), list(&b));
            let mut want: Vec<(u32, u32)> = Vec::new();
            for x in &a {
                want.extend(b.iter().filter(|y| x.meets(y)).map(|y| (x.id, y.id)));
            }
            let mut got = Vec::new();
            overlaps_between(&a, &b, |i, j| { got.push((i, j)); Ok::<(), ()>(()) }).unwrap();
            got.sort_unstable();
            want.sort_unstable();
            prop_assert_eq!(got, want);

            let mut own = a.clone();
            sort(&mut own);
            let mut got = Vec::new();
            overlaps(&own, |i, j| { got.push((i.min(j), i.max(j))); Ok::<(), ()>(()) }).unwrap();
            got.sort_unstable();
            let mut want = Vec::new();
            for (i, x) in a.iter().enumerate() {
                want.extend(a[i + 1..].iter().filter(|y| x.meets(y)).map(|y| (x.id, y.id)));
            }
            prop_assert_eq!(got, want);
        }
    }
}
