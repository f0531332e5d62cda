//! All passes of an area: headings, cells, lanes, passes along borders (D2.7 §3.6.1).
//!
//! The area is cut along the heading that promises the shortest tour among those with the
//! least altitudes; then each cell may turn its lanes, if it stays one cell that way and
//! its passes and turns get shorter. Leaves the order of the passes to others.

use super::cells::{Cell, decompose};
use super::direction::{half_turn, sweep_directions};
use super::frame::{Axes, Edge, Kind, Ring, edges};
use super::lanes::{Ground, Leftover, chosen, lanes};
use super::ways::Ways;
use super::{
    CellPlan, Decomposition, Directions, ExactError, ExactProblem, MOST_PASSES, Measures, Pass,
};
use crate::frame::Point;
use crate::geometry::offset::{Growth, Region, Zone, grow};
use crate::math::{PI, atan2};

/// What lanes keep beyond the clearance, so that their ends are outside of the outlines
/// that the ways between them go round, metres.
const GAP_M: f64 = 5e-4;

/// Round corners of grown zones in pieces of at most this turn: eight a circle. Few
/// borders make few cells and few passes along them; a corner is at most 8.3 % of the
/// clearance farther out than it must be.
const OVERSHOOT: f64 = 0.083;

/// Headings of the whole area that are laid out and compared.
const HEADINGS: usize = 6;

/// Headings of a cell that are compared.
const CELL_HEADINGS: usize = 12;

/// The passes of an area in no particular order.
pub(super) struct Layout {
    pub(super) passes: Vec<Pass>,
    pub(super) cells: Vec<CellPlan>,
    pub(super) border_passes: usize,
    /// What is to be seen, square metres.
    pub(super) area_m2: f64,
    /// The zones grown by the clearance.
    zones: Vec<Region>,
}

/// The borders of an area in the plane.
struct Borders<'a> {
    area: &'a [Point],
    holes: Vec<&'a [Point]>,
    zones: Vec<&'a [Point]>,
    /// Those of the zones that bound anything inside, outer rings only.
    obstacles: Vec<&'a [Point]>,
}

impl<'a> Borders<'a> {
    fn new(problem: &'a ExactProblem, grown: &'a [Region]) -> Self {
        let (low, high) = problem.area.bounds();
        let near = |ring: &&[Point]| {
            ring.iter()
                .any(|p| p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y)
        };
        Self {
            area: problem.area.vertices(),
            holes: problem.holes.iter().map(|h| h.vertices()).collect(),
            zones: grown.iter().flat_map(Region::rings).collect(),
            obstacles: grown
                .iter()
                .map(|r| r.outer.as_slice())
                .filter(near)
                .collect(),
        }
    }

    fn edges(&self, axes: Axes) -> Vec<Edge> {
        let ring = |kind: Kind| move |points: &&'a [Point]| Ring { points, kind };
        let mut rings = vec![Ring {
            points: self.area,
            kind: Kind::Area,
        }];
        rings.extend(self.holes.iter().map(ring(Kind::Hole)));
        rings.extend(self.zones.iter().map(ring(Kind::Zone)));
        edges(&rings, axes)
    }

    fn zone_edges(&self, axes: Axes) -> Vec<Edge> {
        let rings: Vec<Ring<'_>> = self
            .zones
            .iter()
            .map(|points| Ring {
                points,
                kind: Kind::Zone,
            })
            .collect();
        edges(&rings, axes)
    }

    /// Everything whose altitude counts in Huang's sum.
    fn hulls(&self) -> Vec<&'a [Point]> {
        let mut rings = vec![self.area];
        rings.extend(&self.holes);
        rings.extend(&self.obstacles);
        rings
    }
}

/// A cell with its passes.
struct Covered {
    heading_rad: f64,
    cell: Cell,
    lanes: Vec<Pass>,
    leftovers: Vec<Leftover>,
}

impl Covered {
    fn new(cell: Cell, heading_rad: f64, zones: &[Edge], measures: &Measures) -> Self {
        let mut leftovers = Vec::new();
        let lanes = lanes(
            &cell,
            Axes::new(heading_rad),
            &Ground { zones },
            measures,
            &mut leftovers,
        );
        Self {
            heading_rad,
            cell,
            lanes,
            leftovers,
        }
    }

    /// What its passes and their turns will take about, metres.
    fn estimate_m(&self, measures: &Measures) -> f64 {
        let more = chosen(self.leftovers.clone(), &self.lanes, measures);
        let all = self.lanes.iter().chain(&more);
        all.map(|p| p.length_m() + measures.turn_m()).sum()
    }
}

impl Measures {
    /// What a turn from lane to lane takes about, metres.
    fn turn_m(&self) -> f64 {
        (PI * self.turn_radius_m).max(self.lane_spacing_m)
    }
}

impl Layout {
    /// Lays out the passes of an area.
    pub(super) fn new(problem: &ExactProblem) -> Result<Self, ExactError> {
        problem.check()?;
        let outlines = grown(problem, GAP_M)?;
        let borders = Borders::new(problem, &outlines);
        let measures = problem.measures();
        let headings: Vec<f64> = match problem.directions {
            Directions::Fixed(heading) => vec![half_turn(heading)],
            Directions::Huang => first(&borders, 1),
            Directions::PerCell => first(&borders, HEADINGS),
        };
        let mut best: Option<(f64, Vec<Covered>)> = None;
        for heading in headings {
            let mut covered = sweep(&borders, heading, problem.decomposition, &measures)?;
            if problem.directions == Directions::PerCell {
                for cell in &mut covered {
                    turn(cell, &borders, &measures);
                }
            }
            let cost: f64 = covered.iter().map(|c| c.estimate_m(&measures)).sum();
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, covered));
            }
        }
        let covered = best.map(|b| b.1).unwrap_or_default();
        Self::assemble(covered, &borders, &measures, grown(problem, 0.0)?)
    }

    fn assemble(
        covered: Vec<Covered>,
        borders: &Borders<'_>,
        measures: &Measures,
        zones: Vec<Region>,
    ) -> Result<Self, ExactError> {
        let mut passes = Vec::new();
        let mut cells = Vec::new();
        let mut leftovers = Vec::new();
        for c in covered {
            let axes = Axes::new(c.heading_rad);
            cells.push(CellPlan {
                ring: c.cell.ring().into_iter().map(|p| axes.back(p)).collect(),
                area_m2: c.cell.area_m2(),
                heading_rad: c.heading_rad,
                lanes: c.lanes.len(),
            });
            passes.extend(c.lanes);
            leftovers.extend(c.leftovers);
        }
        let more = chosen(leftovers, &passes, measures);
        let border_passes = more.len();
        passes.extend(more.into_iter().map(|p| stretched(p, borders, measures)));
        if passes.is_empty() {
            return Err(ExactError::Nothing);
        }
        if passes.len() > MOST_PASSES {
            return Err(ExactError::TooMany);
        }
        Ok(Self {
            passes,
            area_m2: cells.iter().map(|c| c.area_m2).sum(),
            cells,
            border_passes,
            zones,
        })
    }

    /// The ways between passes and from and to the launch points.
    pub(super) fn ways(&self, launches: &[Point]) -> Result<Ways, ExactError> {
        if launches
            .iter()
            .any(|p| self.zones.iter().any(|z| z.contains(*p)))
        {
            return Err(ExactError::Launch);
        }
        let ends = self.passes.iter().flat_map(|p| [p.from, p.to]);
        let reach_m = ends
            .chain(launches.iter().copied())
            .map(|p| p.coords.amax())
            .fold(0.0, f64::max);
        Ok(Ways::new(&self.zones, reach_m))
    }
}

fn grown(problem: &ExactProblem, more_m: f64) -> Result<Vec<Region>, ExactError> {
    let zones: Vec<Zone> = problem.zones.zones().iter().map(Zone::from).collect();
    let growth = Growth::new(problem.clearance_m + more_m)?.with_overshoot(OVERSHOOT)?;
    Ok(grow(&zones, &growth)?.regions)
}

/// The headings with the least altitudes.
fn first(borders: &Borders<'_>, n: usize) -> Vec<f64> {
    let all = sweep_directions(&borders.hulls());
    all.into_iter().take(n).map(|(h, _)| h).collect()
}

/// The whole area in lanes of one heading.
fn sweep(
    borders: &Borders<'_>,
    heading_rad: f64,
    kind: Decomposition,
    measures: &Measures,
) -> Result<Vec<Covered>, ExactError> {
    let axes = Axes::new(heading_rad);
    let zones = borders.zone_edges(axes);
    let cells = decompose(&borders.edges(axes), kind);
    let lanes: f64 = cells
        .iter()
        .map(|c| ((c.right() - c.left()) / measures.lane_spacing_m).ceil())
        .sum();
    if lanes > MOST_PASSES as f64 {
        return Err(ExactError::TooMany);
    }
    Ok(cells
        .into_iter()
        .map(|c| Covered::new(c, heading_rad, &zones, measures))
        .collect())
}

/// Turns the lanes of a cell to the heading of one of its sides where that is shorter.
fn turn(covered: &mut Covered, borders: &Borders<'_>, measures: &Measures) {
    if covered.lanes.len() < 2 {
        return;
    }
    let axes = Axes::new(covered.heading_rad);
    let ring: Vec<Point> = covered
        .cell
        .ring()
        .into_iter()
        .map(|p| axes.back(p))
        .collect();
    let mut least = covered.estimate_m(measures);
    for (heading_rad, _) in sweep_directions(&[&ring]).into_iter().take(CELL_HEADINGS) {
        let axes = Axes::new(heading_rad);
        let own = [Ring {
            points: &ring,
            kind: Kind::Area,
        }];
        let cells = decompose(&edges(&own, axes), Decomposition::Boustrophedon);
        let [cell] = cells.as_slice() else {
            continue;
        };
        let turned = Covered::new(
            cell.clone(),
            heading_rad,
            &borders.zone_edges(axes),
            measures,
        );
        let cost = turned.estimate_m(measures);
        if cost < least {
            least = cost;
            *covered = turned;
        }
    }
}

/// A pass along a border prolonged to the shortest length.
fn stretched(pass: Pass, borders: &Borders<'_>, measures: &Measures) -> Pass {
    if pass.length_m() >= measures.shortest_pass_m {
        return pass;
    }
    let d = pass.to - pass.from;
    let axes = Axes::new(atan2(d.y, d.x));
    let zones = borders.zone_edges(axes);
    let (from, to) = (axes.into(pass.from), axes.into(pass.to));
    let ground = Ground { zones: &zones };
    let (low, high) = ground.stretched(from.x, from.y, to.y, measures.shortest_pass_m);
    Pass {
        from: axes.back(Point::new(from.x, low)),
        to: axes.back(Point::new(from.x, high)),
    }
}
