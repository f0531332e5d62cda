//! All passes of an area: headings, cells, lanes, passes into pockets (D2.7 §3.6.1).
//!
//! The area is cut along the heading that promises the shortest tour among those with the
//! least altitudes; then each cell may turn its lanes, if it stays one cell that way and
//! its passes and turns get shorter. Leaves the order of the passes to others.

use super::cells::{Cell, decompose};
use super::common::common_lanes;
use super::direction::{half_turn, sweep_directions};
use super::frame::{Axes, Edge, Kind, Ring, edges};
use super::lanes::{FreeSpace, Leftover, Sheet, choose, lanes};
use super::ways::Ways;
use super::{
    CellPlan, Decomposition, Directions, MOST_PASSES, Measures, Pass, PassesError, PassesProblem,
};
use skein_geometry::frame::Point;
use skein_geometry::math::PI;
use skein_geometry::offset::{Growth, Region, Zone, grow};
use std::sync::Arc;

/// What lanes keep beyond the clearance, so that their ends are outside of the outlines
/// that the ways between them go round, metres.
const GAP_M: f64 = 5e-4;

/// Round corners of grown zones in pieces of at most this turn: eight a circle. Few
/// borders make few cells and few passes along them; a corner is at most 8.3 % of the
/// clearance farther out than it must be.
const OVERSHOOT: f64 = 0.083;

/// Headings of the whole area that are laid out and compared.
const HEADINGS: usize = 6;

/// Where the first of the common strips begins, as a share of what whole lanes leave.
pub const SHIFTS: [f64; 4] = [0.5, 0.0, 1.0, 0.25];

/// Headings of a cell that are compared.
const CELL_HEADINGS: usize = 12;

/// The passes of an area in no particular order.
#[derive(Debug)]
pub struct Layout {
    /// The passes.
    pub passes: Vec<Pass>,
    /// The cells.
    pub cells: Vec<CellPlan>,
    /// How many of the passes see pockets at borders of zones.
    pub pocket_passes: usize,
    /// What is to be seen, square metres.
    pub area_m2: f64,
    zones: GrownZones,
}

/// The zones of an area grown by the clearance: the same however passes are laid among them.
#[derive(Clone, Debug)]
pub struct GrownZones {
    /// With what lanes keep beyond the clearance: what lanes are laid among.
    outlines: Arc<[Region]>,
    /// By the clearance alone: what ways lead round.
    zones: Arc<[Region]>,
}

impl GrownZones {
    /// Grows the zones of a problem; its directions do not matter.
    ///
    /// # Errors
    /// [`PassesError`] when a figure of the problem is not usable, or zones cannot be grown.
    pub fn new(problem: &PassesProblem) -> Result<Self, PassesError> {
        problem.check()?;
        let grown = |more_m| {
            let zones: Vec<Zone> = problem.zones.zones().iter().map(Zone::from).collect();
            let growth = Growth::new(problem.clearance_m + more_m)?.with_overshoot(OVERSHOOT)?;
            Ok::<_, PassesError>(Arc::from(grow(&zones, &growth)?.regions))
        };
        Ok(Self {
            outlines: grown(GAP_M)?,
            zones: grown(0.0)?,
        })
    }

    /// The ways round them between launch points and places within `reach_m` of the origin.
    ///
    /// # Errors
    /// [`PassesError::Launch`] when a launch point lies in a grown zone.
    pub fn ways(&self, launches: &[Point], reach_m: f64) -> Result<Ways, PassesError> {
        let inside = |p: &Point| self.zones.iter().any(|z| z.contains(*p));
        if launches.iter().any(inside) {
            return Err(PassesError::Launch);
        }
        let reaches = launches.iter().map(|p| p.coords.amax());
        Ok(Ways::new(&self.zones, reaches.fold(reach_m, f64::max)))
    }
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
    fn new(problem: &'a PassesProblem, grown: &'a [Region]) -> Self {
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

/// A cell with lanes of its own.
struct Covered {
    heading_rad: f64,
    cell: Cell,
    lanes: Vec<Pass>,
    leftovers: Vec<Leftover>,
}

impl Covered {
    fn new(cell: Cell, heading_rad: f64, zones: &[Edge], measures: &Measures) -> Self {
        let mut leftovers = Vec::new();
        let sheet = Sheet {
            axes: Axes::new(heading_rad),
            free_space: &FreeSpace { zones },
            measures,
        };
        let lanes = lanes(&cell, &sheet, &mut leftovers);
        Self {
            heading_rad,
            cell,
            lanes,
            leftovers,
        }
    }

    /// What its passes and their turns will take about, metres.
    fn estimate_m(&self, measures: &Measures) -> f64 {
        let mut passes = self.lanes.clone();
        choose(&self.leftovers, &mut passes, measures);
        estimate_m(&passes, measures)
    }
}

impl Measures {
    /// What a turn from lane to lane takes about, metres.
    pub(super) fn turn_m(&self) -> f64 {
        (PI * self.turn_radius_m).max(self.lane_spacing_m)
    }
}

/// What passes and their turns will take about, metres.
fn estimate_m(passes: &[Pass], measures: &Measures) -> f64 {
    let each = |p: &Pass| p.length_m() + measures.turn_m();
    passes.iter().map(each).sum()
}

/// All passes of an area in one of the ways to lay them.
#[derive(Default)]
struct Draft {
    passes: Vec<Pass>,
    cells: Vec<CellPlan>,
    /// How many passes are beside the lanes.
    extra: usize,
}

impl Draft {
    /// Lanes cell by cell.
    fn by_cell(covered: Vec<Covered>, measures: &Measures) -> Self {
        let mut draft = Self::default();
        let mut leftovers = Vec::new();
        for c in covered {
            let lanes = c.lanes.len();
            draft.cells.push(cell_plan(&c.cell, c.heading_rad, lanes));
            draft.passes.extend(c.lanes);
            leftovers.extend(c.leftovers);
        }
        draft.add(&leftovers, measures);
        draft
    }

    /// Lanes of one heading that are common to all cells.
    fn common(
        cells: &[Cell],
        heading_rad: f64,
        zones: &[Edge],
        measures: &Measures,
        shift: f64,
    ) -> Self {
        let sheet = Sheet {
            axes: Axes::new(heading_rad),
            free_space: &FreeSpace { zones },
            measures,
        };
        let found = common_lanes(cells, &sheet, shift);
        let mut draft = Self {
            passes: found.lanes,
            cells: cells.iter().map(|c| cell_plan(c, heading_rad, 0)).collect(),
            extra: 0,
        };
        draft.add(&found.corners, measures);
        draft.add(&found.pockets, measures);
        draft
    }

    /// Adds the passes that see what the present ones do not.
    fn add(&mut self, leftovers: &[Leftover], measures: &Measures) {
        let before = self.passes.len();
        choose(leftovers, &mut self.passes, measures);
        self.extra += self.passes.len() - before;
    }
}

fn cell_plan(cell: &Cell, heading_rad: f64, lanes: usize) -> CellPlan {
    let axes = Axes::new(heading_rad);
    CellPlan {
        ring: cell.ring().into_iter().map(|p| axes.back(p)).collect(),
        area_m2: cell.area_m2(),
        heading_rad,
        lanes,
    }
}

impl Layout {
    /// Lays out the passes of an area.
    ///
    /// # Errors
    /// [`PassesError`]; nothing is laid out then.
    pub fn new(problem: &PassesProblem) -> Result<Self, PassesError> {
        Self::among(problem, &GrownZones::new(problem)?)
    }

    /// As [`Layout::new`], with the zones of the problem grown already.
    ///
    /// # Errors
    /// [`PassesError`]; nothing is laid out then.
    pub fn among(problem: &PassesProblem, zones: &GrownZones) -> Result<Self, PassesError> {
        problem.check()?;
        let borders = Borders::new(problem, &zones.outlines);
        let measures = problem.measures();
        let mut best: Option<(f64, Draft)> = None;
        let mut offer = |draft: Draft| {
            let cost = estimate_m(&draft.passes, &measures);
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, draft));
            }
        };
        let headings: Vec<f64> = match problem.directions {
            Directions::Fixed(heading_rad) | Directions::Shifted { heading_rad, .. } => {
                vec![half_turn(heading_rad)]
            }
            Directions::Huang => first(&borders, 1),
            Directions::PerCell | Directions::Best => first(&borders, HEADINGS),
        };
        let shifts = match &problem.directions {
            Directions::Best | Directions::Fixed(_) => SHIFTS.as_slice(),
            Directions::Shifted { shift, .. } => std::slice::from_ref(shift),
            Directions::PerCell | Directions::Huang => &[],
        };
        for heading in headings {
            let sweep = Sweep::new(&borders, heading, problem.decomposition, &measures)?;
            for shift in shifts {
                let zones = &sweep.zones;
                offer(Draft::common(
                    &sweep.cells,
                    heading,
                    zones,
                    &measures,
                    *shift,
                ));
            }
            if matches!(problem.directions, Directions::Shifted { .. }) {
                continue;
            }
            let mut covered = sweep.covered(&measures);
            if matches!(problem.directions, Directions::Best | Directions::PerCell) {
                for cell in &mut covered {
                    turn(cell, &borders, &measures);
                }
            }
            offer(Draft::by_cell(covered, &measures));
        }
        let draft = best.map(|b| b.1).unwrap_or_default();
        if draft.passes.is_empty() {
            return Err(PassesError::Nothing);
        }
        Self::assemble(draft, zones)
    }

    /// Passes that were laid in another way, among the same zones.
    ///
    /// # Errors
    /// [`PassesError`], as for passes that are laid here; there may be none.
    pub fn of_passes(zones: &GrownZones, passes: Vec<Pass>) -> Result<Self, PassesError> {
        let draft = Draft {
            passes,
            ..Draft::default()
        };
        Self::assemble(draft, zones)
    }

    fn assemble(draft: Draft, zones: &GrownZones) -> Result<Self, PassesError> {
        let Draft {
            passes,
            cells,
            extra,
        } = draft;
        if passes.len() > MOST_PASSES {
            return Err(PassesError::TooMany);
        }
        Ok(Self {
            passes,
            area_m2: cells.iter().map(|c| c.area_m2).sum(),
            cells,
            pocket_passes: extra,
            zones: zones.clone(),
        })
    }

    /// The ways between passes and from and to the launch points.
    ///
    /// # Errors
    /// [`PassesError::Launch`] when a launch point lies in a grown zone.
    pub fn ways(&self, launches: &[Point]) -> Result<Ways, PassesError> {
        let ends = self.passes.iter().flat_map(|p| [p.from, p.to]);
        let reach_m = ends.map(|p| p.coords.amax()).fold(0.0, f64::max);
        self.zones.ways(launches, reach_m)
    }
}

/// The headings with the least altitudes.
fn first(borders: &Borders<'_>, n: usize) -> Vec<f64> {
    let all = sweep_directions(&borders.hulls());
    all.into_iter().take(n).map(|(h, _)| h).collect()
}

/// The whole area swept in one heading.
struct Sweep {
    heading_rad: f64,
    cells: Vec<Cell>,
    zones: Vec<Edge>,
}

impl Sweep {
    fn new(
        borders: &Borders<'_>,
        heading_rad: f64,
        kind: Decomposition,
        measures: &Measures,
    ) -> Result<Self, PassesError> {
        let axes = Axes::new(heading_rad);
        let cells = decompose(&borders.edges(axes), kind);
        let lanes: f64 = cells
            .iter()
            .map(|c| ((c.right() - c.left()) / measures.lane_spacing_m).ceil())
            .sum();
        if lanes > MOST_PASSES as f64 {
            return Err(PassesError::TooMany);
        }
        Ok(Self {
            heading_rad,
            cells,
            zones: borders.zone_edges(axes),
        })
    }

    /// Each cell in lanes of its own.
    fn covered(&self, measures: &Measures) -> Vec<Covered> {
        let cells = self.cells.iter().cloned();
        cells
            .map(|c| Covered::new(c, self.heading_rad, &self.zones, measures))
            .collect()
    }
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
