//! The upper bound: a choice of headings made better within a window about it.
//!
//! All waypoints move at once: a shortest path over a few headings beside each
//! present one, in ever smaller steps. One waypoint at a time would stop where two
//! neighbours must turn together, as they must where a word begins or ends.

use super::air::Air;
use skein_geometry::frame::Vector;

/// Headings tried at a waypoint: the present one and one to either side.
const WINDOW: usize = 3;

/// The least step, radians: half of its square a waypoint is far below any gap.
const LAST_STEP_RAD: f64 = 4e-3;

/// What may be moved: legs in turn radii, and the headings that are given.
pub(super) struct Polish<'a> {
    pub air: Air,
    pub legs: &'a [Vector],
    /// By waypoint, whether the heading is given.
    pub fixed: &'a [bool],
    pub closed: bool,
}

impl Polish<'_> {
    /// Improves `headings`, beginning with steps of `step_rad`; the length in turn
    /// radii.
    pub fn run(&self, headings: &mut [f64], step_rad: f64) -> f64 {
        let mut step = step_rad;
        let mut length = self.length(headings);
        while step > LAST_STEP_RAD {
            let shorter = self.step(headings, step, length);
            // A step that gained much may gain again.
            if length - shorter < step * step {
                step *= 0.5;
            }
            length = shorter;
        }
        length
    }

    /// Length of the chain, turn radii.
    pub fn length(&self, headings: &[f64]) -> f64 {
        self.legs
            .iter()
            .enumerate()
            .map(|(i, v)| {
                self.air
                    .cost(*v, headings[i], headings[(i + 1) % headings.len()])
            })
            .sum()
    }

    fn options(&self, headings: &[f64], i: usize, step: f64) -> [f64; WINDOW] {
        let mut options = [headings[i]; WINDOW];
        if !self.fixed[i] {
            for (k, o) in options.iter_mut().enumerate() {
                *o += step * (k as f64 - 1.0);
            }
        }
        options
    }

    /// The best headings within a window of a step to either side.
    fn step(&self, headings: &mut [f64], step: f64, length: f64) -> f64 {
        let count = headings.len();
        let options: Vec<[f64; WINDOW]> = (0..count)
            .map(|i| self.options(headings, i, step))
            .collect();
        let tables: Vec<[[f64; WINDOW]; WINDOW]> = self
            .legs
            .iter()
            .enumerate()
            .map(|(i, v)| {
                let to = options[(i + 1) % count];
                options[i].map(|a| to.map(|b| self.air.cost(*v, a, b)))
            })
            .collect();
        let mut best = (length, None);
        for start in 0..WINDOW {
            let (cost, way) = shortest(&tables, start, self.closed);
            if cost < best.0 - 1e-12 {
                best = (cost, Some(way));
            }
        }
        if let Some(way) = best.1 {
            for (i, h) in headings.iter_mut().enumerate() {
                *h = options[i][way[i]];
            }
        }
        best.0
    }
}

/// The shortest way from option `start` of the first waypoint, in a loop back to it.
fn shortest(tables: &[[[f64; WINDOW]; WINDOW]], start: usize, closed: bool) -> (f64, Vec<usize>) {
    let mut costs = [f64::INFINITY; WINDOW];
    costs[start] = 0.0;
    let mut came = Vec::with_capacity(tables.len());
    for table in tables {
        let mut next = [(f64::INFINITY, 0); WINDOW];
        for (a, row) in table.iter().enumerate() {
            for (n, c) in next.iter_mut().zip(row) {
                if costs[a] + c < n.0 {
                    *n = (costs[a] + c, a);
                }
            }
        }
        costs = next.map(|n| n.0);
        came.push(next.map(|n| n.1));
    }
    let mut at = if closed {
        start
    } else {
        (0..WINDOW)
            .min_by(|&a, &b| costs[a].total_cmp(&costs[b]))
            .unwrap_or(0)
    };
    let cost = costs[at];
    let mut way = vec![at];
    for from in came.iter().rev() {
        at = from[at];
        way.push(at);
    }
    way.reverse();
    (cost, way)
}
