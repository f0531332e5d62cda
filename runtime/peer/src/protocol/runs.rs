//! Runs: how the cells of a section are written into a claim, in order of flight
//! (D2.7 §3.6.5). Leaves which cells these are to [`super::sections`].

use crate::cells::CellSet;
use crate::wire::message::{CellRun, ListedRun, Stamp};
use skein_flight::coverage::ring::Direction;
use skein_flight::coverage::ring::backtracking::Leg;

/// A cell that this peer will fly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PlannedCell {
    /// Which cell of the loop.
    pub cell: u16,
    /// Which way it is flown.
    pub direction: Direction,
    /// By what right it is listed.
    pub stamp: Stamp,
}

/// Packs cells of a loop.
pub(super) struct Packer<'a> {
    /// How many cells the loop has.
    pub(super) cells: u16,
    /// Cells that nobody needs to fly any more: runs may bridge them.
    pub(super) covered: &'a CellSet,
}

impl Packer<'_> {
    /// Packs cells into at most `max_runs` runs, bridging gaps of covered cells; returns
    /// the runs and how many of the cells they hold.
    pub(super) fn pack(&self, cells: &[PlannedCell], max_runs: usize) -> (Vec<ListedRun>, usize) {
        let mut runs: Vec<(PlannedCell, u16)> = Vec::new();
        for (i, p) in cells.iter().enumerate() {
            if let Some((first, count)) = runs.last_mut()
                && let Some(reach) = self.reach(first, *count, p)
            {
                *count = reach;
            } else if runs.len() == max_runs {
                return (runs.iter().map(|r| self.listing(r)).collect(), i);
            } else {
                runs.push((*p, 1));
            }
        }
        assert!(runs.len() <= max_runs, "runs keep to their cap");
        (runs.iter().map(|r| self.listing(r)).collect(), cells.len())
    }

    /// The length of the run `first, count` after `next` joins it, if it can.
    fn reach(&self, first: &PlannedCell, count: u16, next: &PlannedCell) -> Option<u16> {
        if (first.direction, first.stamp) != (next.direction, next.stamp) {
            return None;
        }
        let n = self.cells;
        let step = |from: u16, to: u16| along(to, n - from, n);
        let offset = if first.direction == Direction::Backward {
            step(next.cell, first.cell)
        } else {
            step(first.cell, next.cell)
        };
        if offset < count {
            return None;
        }
        let bridged = (count..offset).all(|k| {
            let c = if first.direction == Direction::Backward {
                step(k, first.cell)
            } else {
                along(first.cell, k, n)
            };
            self.covered.contains(c)
        });
        bridged.then_some(offset + 1)
    }

    fn listing(&self, (first, count): &(PlannedCell, u16)) -> ListedRun {
        let n = self.cells;
        let start = if first.direction == Direction::Backward {
            along(first.cell, n - (count - 1) % n, n)
        } else {
            first.cell
        };
        ListedRun {
            run: CellRun {
                first: start,
                count: *count,
            },
            backward: first.direction == Direction::Backward,
            stamp: first.stamp,
        }
    }
}

/// The cells of a run on a loop of `n`, in forward order.
pub fn cells_of(run: CellRun, n: u16) -> impl Iterator<Item = u16> {
    let first = run.first % n.max(1);
    // What reaches beyond the last cell goes on at the first.
    let before_the_seam = n - first;
    let nth = move |k: u16| {
        if k < before_the_seam {
            first + k
        } else {
            k - before_the_seam
        }
    };
    (0..run.count.min(n)).map(nth)
}

/// The cell so many cells after another, on a loop of `n`.
fn along(from: u16, by: u16, n: u16) -> u16 {
    let to = (u32::from(from) + u32::from(by)) % u32::from(n.max(1));
    u16::try_from(to).unwrap_or(0)
}

/// The direction that the wire writes as a flag.
#[must_use]
pub fn direction_of(backward: bool) -> Direction {
    if backward {
        Direction::Backward
    } else {
        Direction::Forward
    }
}

/// The cells of listings in order of flight.
#[must_use]
pub fn unpack(listings: &[ListedRun], n: u16) -> Vec<PlannedCell> {
    let counts = listings.iter().map(|l| usize::from(l.run.count.min(n)));
    let mut out = Vec::with_capacity(counts.sum());
    for l in listings {
        let direction = direction_of(l.backward);
        let from = out.len();
        out.extend(cells_of(l.run, n).map(|cell| PlannedCell {
            cell,
            direction,
            stamp: l.stamp,
        }));
        if l.backward {
            out[from..].reverse();
        }
    }
    out
}

/// Planned cells as legs: runs of neighbouring cells flown the same way.
#[must_use]
pub fn legs_of(plan: &[PlannedCell], n: u16) -> Vec<Leg> {
    let mut legs: Vec<Leg> = Vec::new();
    let mut last = 0;
    for p in plan {
        let next = match p.direction {
            Direction::Backward => along(last, n.saturating_sub(1), n),
            Direction::Forward => along(last, 1, n),
        };
        match legs.last_mut() {
            Some(leg) if leg.direction == p.direction && next == p.cell => leg.count += 1,
            _ => legs.push(Leg {
                first: p.cell,
                count: 1,
                direction: p.direction,
            }),
        }
        last = p.cell;
    }
    legs
}

#[cfg(test)]
mod tests {
    use super::*;
    use Direction::{Backward, Forward};

    #[test]
    fn the_largest_loops_are_gone_round_as_small_ones() {
        for n in [2, 40_000, u16::MAX] {
            assert_eq!(along(n - 1, 1, n), 0);
            assert_eq!(along(0, n - 1, n), n - 1);
            assert_eq!(along(n - 1, n - 1, n), n - 2);
        }
    }

    #[test]
    fn packing_and_unpacking_keep_order_and_direction() {
        let covered = CellSet::new(10);
        let packer = Packer {
            cells: 10,
            covered: &covered,
        };
        let cell = |(cell, direction): &(u16, Direction)| PlannedCell {
            cell: *cell,
            direction: *direction,
            stamp: Stamp::default(),
        };
        let flown = [
            (8, Forward),
            (9, Forward),
            (0, Forward),
            (4, Backward),
            (3, Backward),
            (6, Forward),
        ];
        let cells: Vec<PlannedCell> = flown.iter().map(cell).collect();
        let (listings, packed) = packer.pack(&cells, 16);
        assert_eq!((listings.len(), packed), (3, 6));
        assert_eq!(unpack(&listings, 10), cells);
        // Backward across the seam, too.
        let back: Vec<PlannedCell> = [(1, Backward), (0, Backward), (9, Backward)]
            .iter()
            .map(cell)
            .collect();
        let (listings, packed) = packer.pack(&back, 16);
        assert_eq!((listings.len(), packed), (1, 3));
        assert_eq!((listings[0].run.first, listings[0].run.count), (9, 3));
        assert_eq!(unpack(&listings, 10), back);
        // What does not fit is left out from its first run on.
        assert_eq!(packer.pack(&cells, 2).1, 5);
        // A covered cell between two others is bridged.
        let covered = CellSet::of(10, [1]);
        let packer = Packer {
            cells: 10,
            covered: &covered,
        };
        let gap: Vec<PlannedCell> = [(0, Forward), (2, Forward)].iter().map(cell).collect();
        assert_eq!(packer.pack(&gap, 16).0.len(), 1);
    }

    #[test]
    fn neighbouring_cells_flown_alike_are_one_leg_across_the_seam_too() {
        let plan = |cells: &[u16], direction| -> Vec<PlannedCell> {
            let planned = |cell: &u16| PlannedCell {
                cell: *cell,
                direction,
                stamp: Stamp::default(),
            };
            cells.iter().map(planned).collect()
        };
        let leg = |first, count, direction| Leg {
            first,
            count,
            direction,
        };
        let back = plan(&[7, 6, 2, 1, 0, 9, 8], Backward);
        assert_eq!(
            legs_of(&back, 10),
            [leg(7, 2, Backward), leg(2, 5, Backward)]
        );
        let on = plan(&[8, 9, 0, 2], Forward);
        assert_eq!(legs_of(&on, 10), [leg(8, 3, Forward), leg(2, 1, Forward)]);
    }
}
