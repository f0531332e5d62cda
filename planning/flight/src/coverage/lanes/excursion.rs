//! Cells that no 2×2 block holds: seen singly, from a straight pass that begins
//! and ends at a boundary of the closed loop (D2.7 §3.6.2, where they are dropped).
//!
//! A pass is a viewing pose with a short straight before and after it. Its poses
//! are sampled, coarsely first; every curve made from them is checked exactly.

use crate::coverage::ring::{CellId, Grid, LoopProblem};
use crate::route::Router;
use crate::trajectory::dubins;
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{TAU, sin_cos};

/// A closed curve from a boundary of the loop past a cell and back.
#[derive(Clone, Debug)]
pub(super) struct Excursion {
    /// Which gate it leaves from and returns to.
    pub gate: usize,
    /// The whole curve.
    pub curve: Curve,
    /// Where along it the camera sees the whole cell, metres.
    pub view_m: f64,
}

/// How passes are sampled, and how many gates are tried.
struct Effort {
    headings: u16,
    lateral_step_m: f64,
    along_offsets: &'static [f64],
    /// The camera must see the whole cell for this long around the viewing pose.
    slack_m: f64,
    gates: usize,
}

/// Plain headings and the nearest gates: enough for most cells beside a zone.
const FIRST: Effort = Effort {
    headings: 8,
    lateral_step_m: 6.0,
    along_offsets: &[0.0],
    slack_m: 2.0,
    gates: 12,
};

/// Every 7.5° and 2 m, so that a cell is given up only when a sample of a pass
/// this fine finds no room; gates within several lanes.
const SECOND: Effort = Effort {
    headings: 48,
    lateral_step_m: 2.0,
    along_offsets: &[0.0, 0.5, -0.5, 1.0, -1.0],
    slack_m: 0.0,
    gates: 24,
};

/// Pairs of gate and pass that are completed at most, shortest bound first. A
/// pair that fails is blocked by a zone; so many failures leave only the router.
const MAX_PAIRS: usize = 2_000;

/// Passes and gates handed to the router when no Dubins word is clear.
const ROUTED_PASSES: usize = 8;
/// See [`ROUTED_PASSES`].
const ROUTED_GATES: usize = 6;

/// The straight before and after the viewing pose, in lane spacings: 6 m at 48 m,
/// half a second of flight to level the wings.
const RUN_PER_SPACING: f64 = 0.125;

/// A straight with the viewing pose in its middle.
#[derive(Clone, Copy, Debug)]
struct Pass {
    view: Pose,
    run_m: f64,
}

impl Pass {
    fn shifted(&self, by_m: f64) -> Pose {
        let d = self.view.direction();
        Pose::new(self.view.position() + d * by_m, self.view.heading_rad)
    }

    fn start(&self) -> Pose {
        self.shifted(-self.run_m)
    }

    fn end(&self) -> Pose {
        self.shifted(self.run_m)
    }

    fn curve(&self) -> Curve {
        Curve::from_pieces(self.start(), &[(0.0, 2.0 * self.run_m)])
    }
}

/// Finds excursions from the gates of a loop.
pub(super) struct Finder<'a> {
    problem: &'a LoopProblem,
    grid: Grid,
    gates: &'a [Pose],
    router: Router,
}

impl<'a> Finder<'a> {
    /// Prepares the search.
    pub(super) fn new(
        problem: &'a LoopProblem,
        grid: Grid,
        gates: &'a [Pose],
        router: Router,
    ) -> Self {
        Self {
            problem,
            grid,
            gates,
            router,
        }
    }

    /// Whether the loop can be reached from the launch point.
    pub(super) fn launch_reaches_some(&self) -> bool {
        self.problem.launch_reaches(&self.router, self.gates)
    }

    /// The shortest excursion found that sees the whole cell.
    ///
    /// # Errors
    /// A sentence that says why there is none.
    pub(super) fn find(&self, cell: CellId) -> Result<Excursion, String> {
        let zones = &self.problem.zones;
        if self
            .grid
            .corners(cell)
            .iter()
            .all(|&c| zones.distance_m(c) <= 0.0)
        {
            return Err("inside a no-fly zone".to_owned());
        }
        let gates = self.gates_by_distance(cell);
        let first = self.passes(cell, &FIRST);
        if let Some(found) = self.by_words(&first, &gates[..gates.len().min(FIRST.gates)]) {
            return Ok(found);
        }
        let passes = self.passes(cell, &SECOND);
        if passes.is_empty() {
            return Err(
                "no straight pass that sees all of it keeps clear of the no-fly zones".to_owned(),
            );
        }
        self.by_words(&passes, &gates[..gates.len().min(SECOND.gates)])
            .or_else(|| self.by_routes(&passes, &gates))
            .ok_or_else(|| "no flyable curve links a pass over it with the loop".to_owned())
    }

    fn gates_by_distance(&self, cell: CellId) -> Vec<usize> {
        let centre = self.grid.centre(cell);
        let mut order: Vec<(f64, usize)> = self
            .gates
            .iter()
            .enumerate()
            .map(|(i, g)| ((g.position() - centre).norm_squared(), i))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order.into_iter().map(|(_, i)| i).collect()
    }

    /// Passes that see the cell, keep clear and leave room to turn away.
    fn passes(&self, cell: CellId, effort: &Effort) -> Vec<Pass> {
        let p = self.problem;
        let d = self.grid.lane_spacing_m;
        let (across_m, along_m) = (
            p.footprint_across_m - p.tracking_error_m,
            p.footprint_along_m - p.tracking_error_m,
        );
        let centre = self.grid.centre(cell);
        if p.zones.distance_m(centre) + across_m.max(along_m) < p.clearance_m {
            return Vec::new();
        }
        let mut found = Vec::new();
        for i in 0..effort.headings {
            let heading_rad = TAU * f64::from(i) / f64::from(effort.headings);
            let (s, c) = sin_cos(heading_rad);
            // Half the side of the square as the camera sees it, turned.
            let half = d / 2.0 * (s.abs() + c.abs());
            let (wide, long) = (across_m - half, along_m - half);
            if wide < 0.0 || long < effort.slack_m {
                continue;
            }
            let (forward, left) = (Vector::new(c, s), Vector::new(-s, c));
            for lateral in offsets(wide, effort.lateral_step_m) {
                for along in effort.along_offsets {
                    let along = (long - effort.slack_m) * along;
                    let at: Point = centre + left * lateral + forward * along;
                    if p.zones.distance_m(at) < p.clearance_m {
                        continue;
                    }
                    let pass = Pass {
                        view: Pose::new(at, heading_rad),
                        run_m: RUN_PER_SPACING * d,
                    };
                    if p.flyable(&pass.curve()) {
                        found.push(pass);
                    }
                }
            }
        }
        found
    }

    /// Joins gates and passes by Dubins words, the shortest whole first.
    fn by_words(&self, passes: &[Pass], gates: &[usize]) -> Option<Excursion> {
        let r = self.problem.turn_radius_m;
        let mut pairs: Vec<(f64, usize, usize)> = Vec::with_capacity(passes.len() * gates.len());
        for (i, pass) in passes.iter().enumerate() {
            for &g in gates {
                let gate = self.gates[g];
                let bound =
                    dubins::length_m(gate, pass.start(), r) + dubins::length_m(pass.end(), gate, r);
                pairs.push((bound, g, i));
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut best: Option<(f64, Excursion)> = None;
        for &(bound, g, i) in pairs.iter().take(MAX_PAIRS) {
            let run_m = 2.0 * passes[i].run_m;
            if best
                .as_ref()
                .is_some_and(|(length, _)| bound + run_m >= *length)
            {
                break;
            }
            let word = |from: Pose, to: Pose| {
                dubins::all(from, to, r)
                    .into_iter()
                    .find(|c| self.problem.flyable(c))
            };
            if let Some(e) = self.joined(g, &passes[i], word)
                && best
                    .as_ref()
                    .is_none_or(|(length, _)| e.curve.length_m() < *length)
            {
                best = Some((e.curve.length_m(), e));
            }
        }
        best.map(|(_, e)| e)
    }

    /// Joins them by routes round the zones: the first that works.
    fn by_routes(&self, passes: &[Pass], gates: &[usize]) -> Option<Excursion> {
        let stride = passes.len().div_ceil(ROUTED_PASSES).max(1);
        for pass in passes.iter().step_by(stride) {
            for &g in gates.iter().take(ROUTED_GATES) {
                let route = |from: Pose, to: Pose| self.problem.routed(&self.router, from, to);
                if let Some(e) = self.joined(g, pass, route) {
                    return Some(e);
                }
            }
        }
        None
    }

    fn joined(
        &self,
        gate: usize,
        pass: &Pass,
        link: impl Fn(Pose, Pose) -> Option<Curve>,
    ) -> Option<Excursion> {
        let at = self.gates[gate];
        let mut curve = link(at, pass.start())?;
        let back = link(pass.end(), at)?;
        let view_m = curve.length_m() + pass.run_m;
        curve.extend(&pass.curve());
        curve.extend(&back);
        Some(Excursion {
            gate,
            curve,
            view_m,
        })
    }
}

/// Zero, then both sides outwards in steps, up to and with the limit.
fn offsets(limit_m: f64, step_m: f64) -> Vec<f64> {
    let mut all = vec![0.0];
    let mut at = step_m;
    while at < limit_m {
        all.extend([at, -at]);
        at += step_m;
    }
    all.extend([limit_m, -limit_m]);
    all
}
