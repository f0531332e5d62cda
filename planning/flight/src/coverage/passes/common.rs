//! Lanes that are common to all cells of one heading: no cell pays for a lane that it
//! does not fill (D2.7 §3.6.1, the zig-zag motions).
//!
//! Cell by cell, the width of a cell is rounded up to whole lanes. Here the strips are
//! those of the whole area, and a strip may lie in several cells: its lane is flown where
//! any of them has something to see. Where a cell has a corner of the strip to itself,
//! and a zone keeps the lane from looking into it, a side pass sees that corner; then
//! come the pockets beside the ends of lanes ([`super::lanes`]).

use super::Pass;
use super::cells::Cell;
use super::lanes::{Leftover, OFF_BORDER_M, SLACK, Sheet, Strip, UNSEEN_END, shares, trimmed};
use skein_geometry::frame::Point;

/// Lanes, and what they do not see.
#[derive(Clone, Debug, Default)]
pub(super) struct CommonLanes {
    pub(super) lanes: Vec<Pass>,
    /// Corners of strips, to be looked into by side passes.
    pub(super) corners: Vec<Leftover>,
    /// Pockets beside the ends of lanes.
    pub(super) pockets: Vec<Leftover>,
}

/// The lanes of all cells; `shift` in [0, 1] says where the first strip begins within
/// what whole lanes leave.
pub(super) fn common_lanes(cells: &[Cell], sheet: &Sheet<'_>, shift: f64) -> CommonLanes {
    let left = cells.iter().map(Cell::left).fold(f64::INFINITY, f64::min);
    let right = cells
        .iter()
        .map(Cell::right)
        .fold(f64::NEG_INFINITY, f64::max);
    let spacing_m = sheet.measures.lane_spacing_m;
    let n = ((right - left) / spacing_m - SLACK).ceil().max(0.0);
    let start = left - (n * spacing_m - (right - left)).max(0.0) * shift;
    let mut found = CommonLanes::default();
    let mut i = 0.0;
    while i < n {
        let (from, to) = (start + i * spacing_m, start + (i + 1.0) * spacing_m);
        i += 1.0;
        let parts: Vec<Strip<'_>> = cells
            .iter()
            .filter(|c| c.right() > from && c.left() < to)
            .map(|c| Strip::of(c, from.max(c.left()), to.min(c.right())))
            .collect();
        let work = Work {
            x: from.midpoint(to).clamp(left, right),
            parts,
            sheet,
        };
        work.lay(&mut found);
    }
    found
}

/// One strip of the whole area.
struct Work<'a> {
    x: f64,
    parts: Vec<Strip<'a>>,
    sheet: &'a Sheet<'a>,
}

impl Work<'_> {
    fn lay(&self, into: &mut CommonLanes) {
        let look_m = self.sheet.measures.look_ahead_m;
        let extents = union(self.parts.iter().map(Strip::extent).collect(), 0.0);
        let wanted: Vec<(f64, f64)> = extents.into_iter().map(|e| trimmed(e, look_m)).collect();
        let mut lanes = Vec::new();
        for free in self.sheet.free_space.free(self.x) {
            let here = wanted
                .iter()
                .map(|w| (w.0.max(free.0), w.1.min(free.1)))
                .filter(|(low, high)| high >= low)
                .collect();
            // Going on straight is shorter than turning away and coming back.
            lanes.extend(union(here, self.sheet.measures.turn_m()));
        }
        let passes = lanes.iter().map(|l| self.sheet.pass(self.x, l.0, l.1));
        into.lanes.extend(passes);
        for part in &self.parts {
            self.look_into(part, &lanes, into);
        }
    }

    /// What the strip's lanes leave unseen of one cell's part of it.
    fn look_into(&self, part: &Strip<'_>, lanes: &[(f64, f64)], into: &mut CommonLanes) {
        let reach =
            self.sheet.measures.look_ahead_m + UNSEEN_END * self.sheet.measures.lane_spacing_m;
        let side_x = if part.from <= self.x && self.x <= part.to {
            self.x
        } else if part.to - part.from > 2.0 * OFF_BORDER_M {
            self.x
                .clamp(part.from + OFF_BORDER_M, part.to - OFF_BORDER_M)
        } else {
            return;
        };
        let (floor, ceiling) = part.core(side_x);
        let seen = lanes.iter().map(|l| (l.0 - reach, l.1 + reach));
        let mut seen = union(seen.collect(), 0.0);
        let mut low = floor;
        let mut corners = Vec::new();
        for &(a, b) in seen.iter().chain(&[(ceiling, ceiling)]) {
            let high = a.min(ceiling);
            if high > low {
                corners.push((low, high));
            }
            low = low.max(b);
        }
        for &(low, high) in &corners {
            let x = part.from.midpoint(part.to);
            let samples = shares(high - low, self.sheet.measures).flat_map(|t| {
                let y = low + (high - low) * t;
                [part.from, x, part.to].map(|x| (x, y))
            });
            into.corners.push(Leftover {
                pass: self.sheet.pass(side_x, low, high),
                samples: samples
                    .filter(|(x, y)| part.holds(*x, *y))
                    .map(|(x, y)| self.sheet.axes.back(Point::new(x, y)))
                    .collect(),
            });
        }
        // A side pass that turns out to be needless sees nothing beyond its ends.
        seen.extend(corners);
        let seen = union(seen, 0.0);
        let of_core = |s: &&(f64, f64)| s.1 >= floor && s.0 <= ceiling;
        let bottom = seen.iter().find(of_core).map_or(floor, |s| s.0);
        let top = seen.iter().rev().find(of_core).map_or(ceiling, |s| s.1);
        part.pockets(
            side_x,
            (bottom + reach, top - reach),
            self.sheet,
            &mut into.pockets,
        );
    }
}

/// Intervals joined where they overlap or are at most `gap` apart.
fn union(mut intervals: Vec<(f64, f64)>, gap: f64) -> Vec<(f64, f64)> {
    intervals.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut joined: Vec<(f64, f64)> = Vec::new();
    for (low, high) in intervals {
        match joined.last_mut() {
            Some(last) if low <= last.1 + gap => last.1 = last.1.max(high),
            _ => joined.push((low, high)),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_joined_over_small_gaps() {
        let all = vec![(5.0, 6.0), (0.0, 1.0), (0.5, 2.0), (2.5, 3.0)];
        assert_eq!(union(all.clone(), 0.0).len(), 3);
        assert_eq!(union(all.clone(), 0.6).len(), 2);
        assert_eq!(union(all, 9.0), vec![(0.0, 6.0)]);
    }
}
