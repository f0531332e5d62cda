//! Exact area coverage: an area with holes cut into cells that a zig-zag covers, and the
//! passes of all cells on one closed tour (D2.7 §3.6.1). `skein-survey` shares them out
//! among a team (3.6.3).
//!
//! | file | what it holds |
//! |---|---|
//! | `frame` | the turned frame of the sweep, on a grid |
//! | `cells` | boustrophedon and trapezoidal decomposition |
//! | `direction` | Huang's sweep direction |
//! | `lanes` | lanes of a cell, and passes into pockets |
//! | `common` | lanes common to all cells of one heading |
//! | `layout` | all passes of an area: directions, cells, lanes |
//! | `ways` | what it costs to fly from pass to pass |
//!
//! The sensor is a rectangle that flies along: half a lane spacing to either side,
//! [`PassesProblem::look_ahead_m`] before and behind. Left to others: the curves between
//! passes, winds, and the approximate planners (`area`, `grid`).
//!
//! ```
//! use skein_flight::coverage::passes::{PassesProblem, plan};
//! use skein_geometry::frame::Point;
//! use skein_geometry::Polygon;
//! let corners = [(0.0, 0.0), (400.0, 0.0), (400.0, 200.0), (0.0, 200.0)];
//! let area = Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec())?;
//! let problem = PassesProblem::new(area, 50.0, 20.0, Point::new(0.0, 0.0));
//! let plan = plan(&problem)?;
//! // Four lanes along the longer side; they see half a spacing beyond their ends.
//! assert_eq!(plan.passes.len(), 4);
//! assert!(plan.passes_m > 1350.0 && plan.passes_m < 1500.0, "{}", plan.passes_m);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cells;
mod common;
mod direction;
mod frame;
mod lanes;
mod layout;
mod ways;

use crate::coverage::lines::{self, Line, LineError, Uav};
use crate::coverage::metric::Matrix;
pub use cells::Decomposition;
pub use direction::{altitudes_m, sweep_directions};
pub use layout::{GrownZones, Layout, SHIFTS};
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::atan2;
use skein_geometry::offset::OffsetError;
use skein_geometry::{NoFlyZones, Polygon};
use std::sync::Arc;
use thiserror::Error;
pub use ways::{Places, Ways};

/// Areas that need more passes are refused: the order of so many takes some seconds, and
/// the costs between all their ends 70 MB. An area of 20 km by 20 km at lanes of 20 m has
/// a thousand.
const MOST_PASSES: usize = 1_500;

/// Ways round zones are searched for between places nearer than this, in turns; others
/// are guessed, but for those that are flown.
pub const NEAR_TURNS: f64 = 3.0;

/// Steps of improvement of a plan unless the caller says otherwise.
pub const DEFAULT_STEPS: usize = 2_000;

/// A straight piece of flight on which the ground beside it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pass {
    /// Where it begins.
    pub from: Point,
    /// Where it ends.
    pub to: Point,
}

impl Pass {
    /// Its length, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        (self.to - self.from).norm()
    }

    /// The same, flown the other way.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            from: self.to,
            to: self.from,
        }
    }

    /// The heading in which it is flown, radians counter-clockwise from east.
    #[must_use]
    pub fn heading_rad(&self) -> f64 {
        let d = self.to - self.from;
        atan2(d.y, d.x)
    }

    /// Where it begins and where it heads.
    #[must_use]
    pub fn start(&self) -> Pose {
        Pose::new(self.from, self.heading_rad())
    }

    /// Where it ends and where it heads.
    #[must_use]
    pub fn end(&self) -> Pose {
        Pose::new(self.to, self.heading_rad())
    }

    /// Whether a rectangle of these half sides that flies along sees `p`.
    #[must_use]
    pub fn sees(&self, p: Point, across_m: f64, along_m: f64) -> bool {
        /// Rounding of the measures of a point on the rectangle's border, metres.
        const ROUNDING_M: f64 = 1e-6;
        let d = self.to - self.from;
        let length = d.norm();
        let v = p - self.from;
        let along = v.dot(&d) / length.max(f64::MIN_POSITIVE);
        let across = d.perp(&v) / length.max(f64::MIN_POSITIVE);
        across.abs() <= across_m + ROUNDING_M
            && along >= -along_m - ROUNDING_M
            && along <= length + along_m + ROUNDING_M
    }
}

/// How lanes are laid.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Directions {
    /// What promises the shortest tour: lanes common to all cells in one of the headings
    /// with the least altitudes, or lanes cell by cell.
    #[default]
    Best,
    /// Lanes cell by cell, each cell in the heading that is best for it.
    PerCell,
    /// Lanes cell by cell, all in Huang's direction: the document's own planner.
    Huang,
    /// All lanes in this heading, radians counter-clockwise from east.
    Fixed(f64),
    /// Lanes common to all cells in one heading, from a place of the first one on.
    Shifted {
        /// The heading, radians counter-clockwise from east.
        heading_rad: f64,
        /// Where the first lane begins, as a share of what whole lanes leave of the area.
        shift: f64,
    },
}

/// What is to be seen, and how.
#[derive(Clone, Debug)]
pub struct PassesProblem {
    /// The area to see.
    pub area: Polygon,
    /// Parts of it that need not be seen; lanes may cross them.
    pub holes: Vec<Polygon>,
    /// Where nobody may fly.
    pub zones: Arc<NoFlyZones>,
    /// Distance that every pass keeps from the zones, metres. What is nearer to a zone
    /// is not planned for.
    pub clearance_m: f64,
    /// Width of the ground that a pass sees, metres.
    pub lane_spacing_m: f64,
    /// How far a pass sees beyond its ends, metres.
    pub look_ahead_m: f64,
    /// Smallest turn radius, metres.
    pub turn_radius_m: f64,
    /// Passes are prolonged to this length where zones let them, metres.
    pub shortest_pass_m: f64,
    /// Where tours begin and end.
    pub launch: Point,
    /// Headings of lanes.
    pub directions: Directions,
    /// The decomposition.
    pub decomposition: Decomposition,
    /// Steps of improvement; the same steps give the same plan everywhere.
    pub steps: usize,
}

impl PassesProblem {
    /// An area without holes and zones, seen by a square footprint as wide as the lanes.
    #[must_use]
    pub fn new(area: Polygon, lane_spacing_m: f64, turn_radius_m: f64, launch: Point) -> Self {
        Self {
            area,
            holes: Vec::new(),
            zones: Arc::new(NoFlyZones::new(Vec::new())),
            clearance_m: 0.0,
            lane_spacing_m,
            look_ahead_m: lane_spacing_m / 2.0,
            turn_radius_m,
            shortest_pass_m: lane_spacing_m / 2.0,
            launch,
            directions: Directions::default(),
            decomposition: Decomposition::default(),
            steps: DEFAULT_STEPS,
        }
    }

    /// What a turn from lane to lane takes about, metres.
    #[must_use]
    pub fn turn_m(&self) -> f64 {
        self.measures().turn_m()
    }

    fn measures(&self) -> Measures {
        Measures {
            lane_spacing_m: self.lane_spacing_m,
            look_ahead_m: self.look_ahead_m,
            shortest_pass_m: self.shortest_pass_m,
            turn_radius_m: self.turn_radius_m,
        }
    }

    fn check(&self) -> Result<(), PassesError> {
        let positive = |x: f64, what| {
            if x.is_finite() && x > 0.0 {
                Ok(())
            } else {
                Err(PassesError::Number(what))
            }
        };
        positive(self.lane_spacing_m, "lane spacing")?;
        positive(self.turn_radius_m, "turn radius")?;
        positive(self.shortest_pass_m, "shortest pass")?;
        let not_negative = |x: f64, what| {
            if x.is_finite() && x >= 0.0 {
                Ok(())
            } else {
                Err(PassesError::Number(what))
            }
        };
        not_negative(self.clearance_m, "clearance")?;
        not_negative(self.look_ahead_m, "look ahead")?;
        let most_m = skein_geometry::polygon::MAX_COORDINATE_M;
        // A number that is none fails both.
        if !(self.launch.x.abs() <= most_m && self.launch.y.abs() <= most_m) {
            return Err(PassesError::Number("launch point"));
        }
        let figures = match self.directions {
            Directions::Fixed(heading_rad) => [heading_rad, 0.0],
            Directions::Shifted { heading_rad, shift } => [heading_rad, shift],
            Directions::Best | Directions::PerCell | Directions::Huang => [0.0; 2],
        };
        if !figures[0].is_finite() {
            return Err(PassesError::Number("heading"));
        }
        if !(0.0..=1.0).contains(&figures[1]) {
            return Err(PassesError::Number("shift of the lanes"));
        }
        let (low, high) = self.area.bounds();
        let lanes = (high - low).norm() / self.lane_spacing_m;
        if lanes > MOST_PASSES as f64 {
            return Err(PassesError::TooMany);
        }
        Ok(())
    }
}

/// The lengths that lanes are laid by.
#[derive(Clone, Copy, Debug)]
struct Measures {
    lane_spacing_m: f64,
    look_ahead_m: f64,
    shortest_pass_m: f64,
    turn_radius_m: f64,
}

/// Why there is no plan. Nothing was planned then.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PassesError {
    /// A length is no number, negative or zero.
    #[error("the {0} is not a usable number")]
    Number(&'static str),
    /// More passes than a mission may have.
    #[error("the area needs more than {MOST_PASSES} passes: wider lanes or a smaller area")]
    TooMany,
    /// The zones could not be grown by the clearance.
    #[error("the no-fly zones could not be grown by the clearance: {0}")]
    Zones(#[from] OffsetError),
    /// Holes and zones leave nothing of the area.
    #[error("nothing of the area can be seen: holes, no-fly zones and clearance fill it")]
    Nothing,
    /// The launch point lies inside a zone or its clearance.
    #[error("the launch point lies inside a no-fly zone or its clearance")]
    Launch,
    /// The team or its figures are not usable.
    #[error("no tours for this team: {0}")]
    Team(#[from] LineError),
}

/// A cell with its lanes.
#[derive(Clone, Debug, PartialEq)]
pub struct CellPlan {
    /// The ring round the cell, counter-clockwise, metres.
    pub ring: Vec<Point>,
    /// Area, square metres.
    pub area_m2: f64,
    /// Heading of its lanes, radians counter-clockwise from east.
    pub heading_rad: f64,
    /// How many lanes it has of its own; 0 where lanes are common to all cells.
    pub lanes: usize,
}

/// One closed tour over an area.
#[derive(Clone, Debug, PartialEq)]
pub struct PassesPlan {
    /// The passes in the order of flight, from the launch point back to it.
    pub passes: Vec<Pass>,
    /// The whole flight: launch point, ends of passes and bends round zones between them,
    /// launch point.
    pub track: Vec<Point>,
    /// The cells.
    pub cells: Vec<CellPlan>,
    /// Passes at borders of zones for what no lane sees; they are in `passes` too.
    pub pocket_passes: usize,
    /// Length of all passes, metres.
    pub passes_m: f64,
    /// Length of the whole tour with its turns and the ways from and to the launch
    /// point, metres.
    pub length_m: f64,
    /// No tour is shorter: what is seen, over the lane spacing, metres.
    pub lower_bound_m: f64,
}

/// Plans one closed tour of straight passes that sees the whole area.
///
/// # Guarantees
/// Every pass keeps the clearance from every zone. Every point of the area farther from
/// all zones than the clearance (and what the outlines of grown zones add to it) is seen,
/// up to 0.2 % of a lane spacing at the ends of lanes. Each pass is flown once.
///
/// # Complexity
/// Near-linear decomposition; for p passes O(p²) ways and the steps of improvement.
///
/// # Errors
/// [`PassesError`]; nothing is planned then.
pub fn plan(problem: &PassesProblem) -> Result<PassesPlan, PassesError> {
    let layout = Layout::new(problem)?;
    let ways = layout.ways(&[problem.launch])?;
    let places = Places::new(
        &ways,
        &layout.passes,
        &[problem.launch],
        problem.turn_radius_m,
    );
    let n = layout.passes.len();
    let near_m = NEAR_TURNS * problem.turn_m();
    let guess = |a, b| places.guess_m(a, b, near_m);
    let lines = lines(&layout.passes);
    let alone = [Uav::at(2 * n)];
    let costs = Matrix::of(2 * n + 1, &guess);
    let found = lines::plan_passes(&lines, &alone, &costs, problem.steps)?;
    let order: Vec<lines::Traversal> = found.tours.into_iter().flat_map(|t| t.passes).collect();
    let length_m = lines::tour_cost(&order, &lines, 2 * n, &places);
    let passes = in_order(&layout.passes, &order);
    Ok(PassesPlan {
        track: track(&ways, problem.launch, &passes),
        passes,
        pocket_passes: layout.pocket_passes,
        passes_m: layout.passes.iter().map(Pass::length_m).sum(),
        length_m,
        lower_bound_m: layout.area_m2 / problem.lane_spacing_m,
        cells: layout.cells,
    })
}

/// The whole flight over `passes` from a launch point and back.
#[must_use]
pub fn track(ways: &Ways, launch: Point, passes: &[Pass]) -> Vec<Point> {
    let ends = passes.iter().flat_map(|p| [p.from, p.to]);
    ways.track([launch].into_iter().chain(ends).chain([launch]))
}

/// Each pass as a line: pass `i` leads from place `2 i` to place `2 i + 1`.
#[must_use]
pub fn lines(passes: &[Pass]) -> Vec<Line> {
    passes
        .iter()
        .enumerate()
        .map(|(i, p)| Line::new(2 * i, 2 * i + 1, p.length_m()))
        .collect()
}

/// The passes in the order and the directions in which their lines are flown.
#[must_use]
pub fn in_order(passes: &[Pass], order: &[lines::Traversal]) -> Vec<Pass> {
    order
        .iter()
        .map(|p| {
            let pass = passes[p.line];
            if p.backward { pass.reversed() } else { pass }
        })
        .collect()
}

#[cfg(test)]
mod tests;
