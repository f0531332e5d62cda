//! How to get from here to the next cell, or to a place to loiter: the moves that the
//! executive strings together (D2.7 §1.2.3, executive layer; routes are §2.3, §2.4).
//!
//! Pure questions about the loop, the zones and a pose; what is flown and when is
//! the executive's.

use crate::reactive::air::Air;
use skein_flight::airframe::Airframe;
use skein_flight::coverage::ring::{CoverageLoop, Direction};
use skein_flight::route::{RouteError, Router};
use skein_flight::trajectory::timed::Objective;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{PI, TAU};
use skein_geometry::{Curve, NoFlyZones, Segment};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::Arc;

/// Boundaries ahead on the loop at which a UAV tries to turn round or to loiter. Zones
/// that cut off one boundary cut off its neighbours too, so more are not worth it.
const MAX_TRIES_AHEAD: usize = 8;

/// Nearest boundaries to which a way onto the loop is tried.
const MAX_JOIN_TRIES: usize = 8;

/// Nearest boundaries from which a way to a point is tried, and at which a loiter is.
const MAX_NEAREST_TRIES: usize = 6;

/// Lengths of the piece flown to get out of a zone's clearance, metres: from what a
/// tracking error needs to a half turn.
const ESCAPES_M: [f64; 4] = [5.0, 15.0, 35.0, 75.0];

/// How far it is at most straight out of a zone that a UAV is in, after a turn, metres.
const WAYS_OUT_M: [f64; 9] = [10.0, 25.0, 50.0, 75.0, 100.0, 150.0, 225.0, 350.0, 500.0];

/// Turns before that, quarters of a half one.
const TURNS_OUT: [f64; 9] = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0, -4.0];

/// A way out of a zone's clearance may come this much nearer to it at first, metres:
/// what rounding and a bend take.
pub(super) const ESCAPE_SLACK_M: f64 = 0.25;

/// Loiters are flown with this many times the least radius where there is room, so
/// that following them has authority on both sides.
const LOITER_RADII: [f64; 2] = [1.2, 1.0];

/// Headings that are tried at a point with little room for a circle.
const WAITING_HEADINGS: u32 = 32;

/// Distances are compared with this much leniency, metres.
const ROUNDING_M: f64 = 1e-6;

/// A cell of the plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellVisit {
    /// Which cell of the loop.
    pub cell: u16,
    /// Which way it is flown.
    pub direction: Direction,
    /// How often it was flown without being seen.
    pub tries: u8,
}

/// Where a stretch begins or ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The pose.
    pub pose: Pose,
    /// The boundary of the loop this is, and which way along the loop it faces, if it is one.
    pub boundary: Option<(u16, Direction)>,
}

/// One stretch to fly.
#[derive(Clone, Debug, PartialEq)]
pub enum Move {
    /// A cell, to see it.
    Serve(CellVisit),
    /// What is left of a cell of which the way was flown in parts, to see it.
    Rest(CellVisit, Curve),
    /// A cell, because it is on the way.
    Pass(u16, Direction),
    /// A curve off the loop.
    Route(Curve),
    /// A piece of a given flight, and where along that it ends, metres.
    Piece(Segment, f64),
    /// A full circle, to be flown again and again.
    Loiter(Segment),
}

impl Move {
    /// The visit that it serves.
    #[must_use]
    pub fn serves(&self) -> Option<CellVisit> {
        match self {
            Self::Serve(visit) | Self::Rest(visit, _) => Some(*visit),
            _ => None,
        }
    }
}

/// The loop, the zones and the airframe, as far as ways depend on them.
#[derive(Clone, Debug)]
pub struct Transit {
    /// The loop.
    pub coverage_loop: Arc<CoverageLoop>,
    /// Routes off the loop.
    pub router: Arc<Router>,
    /// Who flies.
    pub airframe: Airframe,
    /// The wind, and the airspeed flown in it.
    air: Air,
    /// Distances through the air along each cell, forward and backward, metres;
    /// empty in calm air, where they are the lengths.
    cells_air_m: Vec<[f64; 2]>,
    /// What transfers off the loop should spend little of.
    pub(super) objective: Objective,
    /// How far a UAV may stray from a curve, metres.
    pub(super) tracking_error_m: f64,
    /// What passing each cell costs, forward and backward, metres; empty where that is
    /// the cell's length.
    pub(super) cells_cost_m: Vec<[f64; 2]>,
    /// Routes found last, in this air, the latest first: forecasts ask for the same ones between
    /// two percepts, and as long as the plan stays.
    routes: RefCell<VecDeque<FoundRoute>>,
}

/// Between which poses, and the route if there is one.
type FoundRoute = (Pose, Pose, Result<Curve, RouteError>);

/// So many of them are kept: a plan leaves the loop a few times.
const ROUTES_KEPT: usize = 8;

impl Transit {
    /// A transit for calm air at cruise.
    #[must_use]
    pub fn new(coverage_loop: Arc<CoverageLoop>, router: Arc<Router>, airframe: Airframe) -> Self {
        Self {
            coverage_loop,
            router,
            airframe,
            air: Air::calm(airframe.cruise_mps),
            cells_air_m: Vec::new(),
            objective: Objective::Time,
            tracking_error_m: super::DEFAULT_TRACKING_ERROR_M,
            cells_cost_m: Vec::new(),
            routes: RefCell::default(),
        }
    }

    /// The same with another objective.
    #[must_use]
    pub fn with_objective(mut self, objective: Objective) -> Self {
        self.objective = objective;
        self.set_air(self.air);
        self
    }

    /// The wind, and the airspeed flown in it.
    #[must_use]
    pub fn air(&self) -> &Air {
        &self.air
    }

    /// From now on lengths are distances through this air.
    pub fn set_air(&mut self, air: Air) {
        self.air = air;
        self.routes.take();
        self.cells_air_m.clear();
        if !air.is_calm() {
            self.cells_air_m = self.each_cell(|curve| air.air_length_m(curve));
        }
        self.cells_cost_m = match self.objective {
            Objective::Time => self.cells_air_m.clone(),
            Objective::Distance => Vec::new(),
            Objective::Energy => self.each_cell(|curve| self.cost_m(curve)),
        };
    }

    /// Something of each cell's curve, forward and backward.
    fn each_cell(&self, of: impl Fn(&Curve) -> f64) -> Vec<[f64; 2]> {
        let c = &self.coverage_loop;
        let both = [Direction::Forward, Direction::Backward];
        let cells = 0..c.len();
        cells.map(|i| both.map(|d| of(&c.curve(i, d)))).collect()
    }

    /// Length of a cell that is only passed, metres.
    pub(super) fn travel_m(&self, cell: u16) -> f64 {
        f64::from(self.coverage_loop.cells()[usize::from(cell)].travel_mm) / 1000.0
    }

    /// Distance through the air along a cell that is only passed, metres; infinite where the
    /// wind forbids it.
    pub(super) fn passed_m(&self, cell: u16, direction: Direction) -> f64 {
        if self.coverage_loop.cells()[usize::from(cell)].excursion {
            return 0.0;
        }
        let through_air_m = self.cell_air_m(cell, direction);
        through_air_m.unwrap_or_else(|| self.travel_m(cell))
    }

    /// Length of the whole loop over the ground over that through the air, both ways; 0
    /// where the wind forbids a part of it.
    #[must_use]
    pub fn loop_share(&self) -> f64 {
        if self.cells_air_m.is_empty() {
            return 1.0;
        }
        let air_m: f64 = self.cells_air_m.iter().map(|both| both[0] + both[1]).sum();
        let cells = self.coverage_loop.cells();
        let ground_m: f64 = cells.iter().map(|c| f64::from(c.service_mm) / 1000.0).sum();
        2.0 * ground_m / air_m
    }

    /// Distance through the air along a cell, if there is a wind, metres.
    fn cell_air_m(&self, cell: u16, direction: Direction) -> Option<f64> {
        let both = self.cells_air_m.get(usize::from(cell))?;
        Some(match direction {
            Direction::Forward => both[0],
            Direction::Backward => both[1],
        })
    }

    fn len(&self) -> usize {
        self.coverage_loop.len()
    }

    /// The boundary where a cell is entered.
    #[must_use]
    pub fn entry(&self, cell: u16, direction: Direction) -> u16 {
        match direction {
            Direction::Forward => cell,
            Direction::Backward => self.after(cell),
        }
    }

    /// The boundary where a cell is left.
    #[must_use]
    pub fn exit(&self, cell: u16, direction: Direction) -> u16 {
        self.entry(cell, direction.opposite())
    }

    fn after(&self, index: u16) -> u16 {
        let next = usize::from(index) + 1;
        if next >= self.len() { 0 } else { index + 1 }
    }

    fn before(&self, index: u16) -> u16 {
        if index == 0 {
            u16::try_from(self.len() - 1).unwrap_or(u16::MAX)
        } else {
            index - 1
        }
    }

    /// The place at a boundary.
    #[must_use]
    pub fn place(&self, boundary: u16, direction: Direction) -> Place {
        let pose = self
            .coverage_loop
            .boundary_towards(usize::from(boundary), direction);
        Place {
            pose,
            boundary: Some((boundary, direction)),
        }
    }

    /// Where a move ends.
    #[must_use]
    pub fn end_of(&self, from: &Place, step: &Move) -> Place {
        match step {
            Move::Serve(visit) | Move::Rest(visit, _) => {
                self.place(self.exit(visit.cell, visit.direction), visit.direction)
            }
            Move::Pass(cell, direction) => self.place(self.exit(*cell, *direction), *direction),
            Move::Route(curve) => Place {
                pose: curve.end().unwrap_or(from.pose),
                boundary: None,
            },
            Move::Piece(piece, _) | Move::Loiter(piece) => Place {
                pose: piece.end(),
                boundary: None,
            },
        }
    }

    /// Distance through the air of a move, metres: in calm air its length.
    #[must_use]
    pub fn length_m(&self, step: &Move) -> f64 {
        let cells = self.coverage_loop.cells();
        match step {
            Move::Serve(visit) => self
                .cell_air_m(visit.cell, visit.direction)
                .unwrap_or_else(|| f64::from(cells[usize::from(visit.cell)].service_mm) / 1000.0),
            Move::Pass(cell, direction) => self
                .cell_air_m(*cell, *direction)
                .unwrap_or_else(|| self.travel_m(*cell)),
            Move::Route(curve) | Move::Rest(_, curve) => self.air.air_length_m(curve),
            Move::Piece(piece, _) => {
                let mut curve = Curve::empty();
                curve.push(*piece);
                self.air.air_length_m(&curve)
            }
            Move::Loiter(circle) => self.air.longest_m(circle.length_m),
        }
    }

    /// The way from `from` to the next cell of `queue` that is open and can be
    /// reached, and that cell; cells that cannot be reached go to `refused`. `None` when
    /// the queue holds nothing more to fly.
    pub fn next(
        &self,
        from: &Place,
        queue: &mut VecDeque<CellVisit>,
        is_open: &dyn Fn(u16) -> bool,
        refused: &mut Vec<u16>,
    ) -> Option<(Vec<Move>, CellVisit)> {
        while let Some(visit) = queue.pop_front() {
            if usize::from(visit.cell) >= self.len() || !is_open(visit.cell) {
                continue;
            }
            match self.connect(
                from,
                self.entry(visit.cell, visit.direction),
                visit.direction,
            ) {
                Some(way) => return Some((way, visit)),
                None => refused.push(visit.cell),
            }
        }
        None
    }

    /// The way from `from` to a boundary, looking `direction`: along the loop where
    /// that is not longer than a direct route, else direct, else with a turn
    /// elsewhere. `None` when there is no clear way.
    #[must_use]
    pub fn connect(&self, from: &Place, to: u16, direction: Direction) -> Option<Vec<Move>> {
        // Most cells of a plan begin where the one before ends.
        if from.boundary == Some((to, direction)) {
            return Some(Vec::new());
        }
        let goal = self.place(to, direction);
        let straight_m = (goal.pose.position() - from.pose.position()).norm();
        let ahead = from
            .boundary
            .filter(|(_, d)| *d == direction)
            .map(|(b, _)| b);
        // Straight along the loop nothing can be shorter: no need to ask the router.
        if let Some(moves) = ahead.and_then(|b| self.along(b, direction, to, straight_m + 1e-3)) {
            return Some(moves);
        }
        if let Ok(curve) = self.route(from.pose, goal.pose) {
            let most_m = self.cost_m(&curve) + 1e-3;
            let along = ahead.and_then(|b| self.unless_costlier(b, direction, to, most_m));
            return Some(along.unwrap_or_else(|| vec![Move::Route(curve)]));
        }
        if let Some(moves) = ahead.and_then(|b| self.along(b, direction, to, f64::INFINITY)) {
            return Some(moves);
        }
        match from.boundary {
            Some((b, d)) => self.turn_then_along(b, d, to, direction),
            None => self.join_then_along(from, to, direction),
        }
    }

    /// The cells between two boundaries in one direction, unless they are longer
    /// than `most_m`. Excursions need not be flown to get past them.
    fn along(&self, from: u16, direction: Direction, to: u16, most_m: f64) -> Option<Vec<Move>> {
        self.pass(from, direction, to, most_m, &|cell| self.travel_m(cell))
    }

    /// The same, unless they cost more than `most_m`.
    fn unless_costlier(
        &self,
        from: u16,
        direction: Direction,
        to: u16,
        most_m: f64,
    ) -> Option<Vec<Move>> {
        self.pass(from, direction, to, most_m, &|cell| {
            self.passing_m(cell, direction)
        })
    }

    fn pass(
        &self,
        from: u16,
        direction: Direction,
        to: u16,
        most_m: f64,
        price_m: &dyn Fn(u16) -> f64,
    ) -> Option<Vec<Move>> {
        let cells = self.coverage_loop.cells();
        let mut moves = Vec::new();
        let mut length_m = 0.0;
        let mut at = from;
        while at != to {
            let cell = match direction {
                Direction::Forward => at,
                Direction::Backward => self.before(at),
            };
            let c = &cells[usize::from(cell)];
            if !c.excursion {
                length_m += price_m(cell);
                moves.push(Move::Pass(cell, direction));
            }
            if length_m > most_m || moves.len() > cells.len() {
                return None;
            }
            at = self.exit(cell, direction);
        }
        Some(moves)
    }

    /// Flies on until it can turn round, turns, and follows the loop.
    fn turn_then_along(
        &self,
        at: u16,
        looking: Direction,
        to: u16,
        direction: Direction,
    ) -> Option<Vec<Move>> {
        if looking == direction {
            return None;
        }
        let mut moves = Vec::new();
        let mut b = at;
        for _ in 0..MAX_TRIES_AHEAD.min(self.len()) {
            let back = self.place(b, direction);
            if let Ok(turn) = self.route(self.place(b, looking).pose, back.pose) {
                moves.push(Move::Route(turn));
                moves.extend(self.along(b, direction, to, f64::INFINITY)?);
                return Some(moves);
            }
            let next = match looking {
                Direction::Forward => self.after(b),
                Direction::Backward => self.before(b),
            };
            moves.extend(self.along(b, looking, next, f64::INFINITY)?);
            b = next;
        }
        None
    }

    /// Joins the loop near by, looking the right way, and follows it.
    fn join_then_along(&self, from: &Place, to: u16, direction: Direction) -> Option<Vec<Move>> {
        let (b, curve) = self.join(from.pose, &[direction])?;
        let mut moves = vec![Move::Route(curve)];
        moves.extend(self.along(b.0, direction, to, f64::INFINITY)?);
        Some(moves)
    }

    /// The shortest of the routes to the nearest boundaries.
    pub(super) fn join(
        &self,
        from: Pose,
        directions: &[Direction],
    ) -> Option<((u16, Direction), Curve)> {
        let mut best: Option<((u16, Direction), Curve, f64)> = None;
        for b in self.nearest(from.position(), MAX_JOIN_TRIES) {
            for d in directions {
                if let Ok(curve) = self.route(from, self.place(b, *d).pose) {
                    let m = self.cost_m(&curve);
                    if best.as_ref().is_none_or(|(_, _, least)| m < *least) {
                        best = Some(((b, *d), curve, m));
                    }
                }
            }
        }
        best.map(|(b, c, _)| (b, c))
    }

    /// The cheapest way onto the loop: the boundary, which way it looks, and the
    /// distance through the air to it, metres. `None` when no boundary near by can be reached.
    #[must_use]
    pub fn way_on(&self, from: Pose) -> Option<(u16, Direction, f64)> {
        let both = [Direction::Forward, Direction::Backward];
        self.join(from, &both)
            .map(|((b, d), c)| (b, d, self.air.air_length_m(&c)))
    }

    /// The boundaries nearest to a point, nearest first, ties by index.
    #[must_use]
    pub fn nearest(&self, p: Point, count: usize) -> Vec<u16> {
        let mut all: Vec<(f64, u16)> = (0..self.len())
            .map(|i| (self.coverage_loop.boundary(i).position() - p).norm_squared())
            .zip(0u16..)
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        all.truncate(count);
        all.into_iter().map(|(_, b)| b).collect()
    }

    /// A clear route; from inside a zone's clearance with a piece that leads out of
    /// it first.
    pub(super) fn route(&self, from: Pose, to: Pose) -> Result<Curve, RouteError> {
        let is_this = |(a, b, _): &&FoundRoute| (*a, *b) == (from, to);
        if let Some((_, _, route)) = self.routes.borrow().iter().find(is_this) {
            return route.clone();
        }
        let route = match self.transfer(from, to) {
            Err(e) if e != RouteError::GoalInZone && self.is_tight(&from) => {
                self.escape(from, |out| self.transfer(out, to)).ok_or(e)
            }
            answer => answer,
        };
        let mut routes = self.routes.borrow_mut();
        routes.truncate(ROUTES_KEPT - 1);
        routes.push_front((from, to, route.clone()));
        route
    }

    /// As [`Transit::connect`], to a point, whatever the heading there: by a direct
    /// route, else by the loop to one of the boundaries nearest to the point.
    #[must_use]
    pub fn connect_to_point(&self, from: &Place, to: Point) -> Option<Vec<Move>> {
        let direct = match self.transfer_to_point(from.pose, to) {
            Err(_) if self.is_tight(&from.pose) => {
                self.escape(from.pose, |out| self.transfer_to_point(out, to))
            }
            answer => answer.ok(),
        };
        if let Some(curve) = direct {
            return Some(vec![Move::Route(curve)]);
        }
        for b in self.nearest(to, MAX_NEAREST_TRIES) {
            for d in [Direction::Forward, Direction::Backward] {
                if let Ok(last) = self.transfer_to_point(self.place(b, d).pose, to)
                    && let Some(mut moves) = self.connect(from, b, d)
                {
                    moves.push(Move::Route(last));
                    return Some(moves);
                }
            }
        }
        None
    }

    /// Whether a pose is inside the clearance of a zone.
    fn is_tight(&self, pose: &Pose) -> bool {
        self.router.zones().distance_m(pose.position()) < self.router.limits().clearance_m + 1e-6
    }

    /// The shortest single piece that comes no nearer to the zones than `from` is
    /// (less what rounding takes) and from whose end `onward` finds a way; from inside of
    /// a zone, which a new mission may have put round a UAV, the way out of it.
    fn escape(
        &self,
        from: Pose,
        onward: impl Fn(Pose) -> Result<Curve, RouteError>,
    ) -> Option<Curve> {
        let zones = self.router.zones();
        if zones.distance_m(from.position()) <= 0.0 {
            return self.way_out(from, onward);
        }
        let least_m = zones.distance_m(from.position()) - ESCAPE_SLACK_M;
        let bend = 1.0 / self.router.limits().turn_radius_m;
        for length_m in ESCAPES_M {
            for curvature_per_m in [0.0, bend, -bend] {
                let piece = Segment {
                    start: from,
                    curvature_per_m,
                    length_m,
                };
                if least_m <= 0.0 || zones.segment_distance_m(&piece) < least_m {
                    continue;
                }
                if let Ok(rest) = onward(piece.end()) {
                    let mut out = Curve::empty();
                    out.push(piece);
                    out.extend(&rest);
                    return Some(out);
                }
            }
        }
        None
    }

    /// A turn and a straight line that lead out of the zones in which a pose is and keep clear
    /// of all others, so that little of them is flown; from its end `onward` finds a way.
    fn way_out(
        &self,
        from: Pose,
        onward: impl Fn(Pose) -> Result<Curve, RouteError>,
    ) -> Option<Curve> {
        let (at, limits) = (from.position(), self.router.limits());
        let zones = self.router.zones().zones().iter();
        let others = NoFlyZones::new(zones.filter(|z| z.distance_m(at) > 0.0).cloned().collect());
        let turn_m = |turn: f64| 0.25 * PI * turn.abs() * limits.turn_radius_m;
        let mut ways: Vec<(f64, f64)> = WAYS_OUT_M
            .into_iter()
            .flat_map(|length_m| TURNS_OUT.map(|turn| (length_m, turn)))
            .collect();
        ways.sort_by(|a, b| (a.0 + turn_m(a.1)).total_cmp(&(b.0 + turn_m(b.1))));
        ways.into_iter().find_map(|(length_m, turn)| {
            let bend = turn.signum() / limits.turn_radius_m;
            let pieces = [(bend, turn_m(turn)), (0.0, length_m)];
            let pieces = &pieces[usize::from(turn == 0.0)..];
            let mut out = Curve::from_pieces(from, pieces);
            let end = out.segments().last()?.end();
            let is_out = self.router.zones().distance_m(end.position()) > limits.clearance_m;
            if !is_out || !others.is_clear(&out, self.tracking_error_m) {
                return None;
            }
            out.extend(&onward(end).ok()?);
            Some(out)
        })
    }

    /// The way to a circle that keeps clear of the zones, and that circle: here, else
    /// on along the loop, else at the nearest boundary with room. Where there is no
    /// such place, the circle here that keeps farthest.
    #[must_use]
    pub fn way_to_loiter(&self, from: &Place) -> Vec<Move> {
        if let Some(here) = self.roomy_circle(&from.pose) {
            return vec![Move::Loiter(here)];
        }
        let mut moves = Vec::new();
        let mut at = from.boundary;
        while let Some((b, d)) = at.filter(|_| moves.len() < MAX_TRIES_AHEAD) {
            let next = match d {
                Direction::Forward => self.after(b),
                Direction::Backward => self.before(b),
            };
            moves.extend(self.along(b, d, next, f64::INFINITY).unwrap_or_default());
            if let Some(circle) = self.roomy_circle(&self.place(next, d).pose) {
                moves.push(Move::Loiter(circle));
                return moves;
            }
            at = Some((next, d)).filter(|_| next != b);
        }
        for b in self.nearest(from.pose.position(), MAX_NEAREST_TRIES) {
            for d in [Direction::Forward, Direction::Backward] {
                if let Some(circle) = self.roomy_circle(&self.place(b, d).pose)
                    && let Ok(curve) = self.route(from.pose, circle.start)
                {
                    return vec![Move::Route(curve), Move::Loiter(circle)];
                }
            }
        }
        vec![self.stay(from)]
    }

    /// The way to a point, and a circle that keeps clear of the zones: through the point
    /// whatever the heading there, where room is scarce with a heading that has some, else
    /// [`Transit::way_to_loiter`] from there. `None` where there is no way to the point.
    #[must_use]
    pub fn way_to_wait_at(&self, from: &Place, to: Point) -> Option<Vec<Move>> {
        let mut moves = self.connect_to_point(from, to)?;
        let steps = moves.iter();
        let end = steps.fold(*from, |place, step| self.end_of(&place, step));
        if self.roomy_circle(&end.pose).is_none() {
            let headings =
                (0..WAITING_HEADINGS).map(|k| f64::from(k) * TAU / f64::from(WAITING_HEADINGS));
            let ways = headings.filter_map(|heading_rad| {
                let circle = self.roomy_circle(&Pose::new(to, heading_rad))?;
                Some((self.route(from.pose, circle.start).ok()?, circle))
            });
            let shortest = ways.min_by(|(a, _), (b, _)| a.length_m().total_cmp(&b.length_m()));
            if let Some((way, circle)) = shortest {
                return Some(vec![Move::Route(way), Move::Loiter(circle)]);
            }
        }
        moves.extend(self.way_to_loiter(&end));
        Some(moves)
    }

    /// The least radius over the ground that is flown, metres: the mission's, more where
    /// the wind demands it.
    #[must_use]
    pub fn turn_radius_m(&self) -> f64 {
        let least_m = if self.air.is_calm() {
            self.airframe.min_turn_radius_m()
        } else {
            let wind_mps = self.air.wind.speed_mps();
            let airspeed_mps = self.air.airspeed_mps;
            self.airframe.ground_turn_radius_m(airspeed_mps, wind_mps)
        };
        self.router.limits().turn_radius_m.max(least_m)
    }

    /// The circle here that keeps farthest from the zones.
    #[must_use]
    pub fn stay(&self, at: &Place) -> Move {
        Move::Loiter(self.circle(&at.pose).0)
    }

    /// Whether a circle through a pose keeps clear of the zones.
    #[must_use]
    pub fn has_room(&self, pose: &Pose) -> bool {
        self.roomy_circle(pose).is_some()
    }

    /// A circle through a pose that keeps clear of the zones, if there is one.
    pub(super) fn roomy_circle(&self, pose: &Pose) -> Option<Segment> {
        let (circle, room_m) = self.circle(pose);
        (room_m >= self.router.limits().clearance_m - ROUNDING_M).then_some(circle)
    }

    /// How long a circle is where there is room for a wide one, metres.
    pub(super) fn wide_circle_m(&self) -> f64 {
        TAU * LOITER_RADII[0] * self.turn_radius_m()
    }

    /// The circle through a pose that keeps farthest from the zones, and how far; a
    /// wide one if that keeps clear.
    fn circle(&self, pose: &Pose) -> (Segment, f64) {
        let zones = self.router.zones();
        let clearance_m = self.router.limits().clearance_m;
        let least_m = self.turn_radius_m();
        let mut best: Option<(Segment, f64)> = None;
        for factor in LOITER_RADII {
            for side in [1.0, -1.0] {
                let radius_m = factor * least_m;
                let half = Segment {
                    start: *pose,
                    curvature_per_m: side / radius_m,
                    length_m: 0.5 * TAU * radius_m,
                };
                let other = Segment {
                    start: half.end(),
                    ..half
                };
                let room_m = zones
                    .segment_distance_m(&half)
                    .min(zones.segment_distance_m(&other));
                if best.is_none_or(|(_, m)| room_m > m) {
                    best = Some((
                        Segment {
                            length_m: TAU * radius_m,
                            ..half
                        },
                        room_m,
                    ));
                }
            }
            if best.is_some_and(|(_, m)| m >= clearance_m - ROUNDING_M) {
                break;
            }
        }
        best.unwrap_or((
            Segment {
                start: *pose,
                curvature_per_m: 1.0 / least_m,
                length_m: TAU * least_m,
            },
            0.0,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{CLEARANCE_M, LANE_M, airframe, loop_and_router, square};
    use Direction::{Backward, Forward};
    use skein_geometry::Polygon;

    fn transit(cols: u32, rows: u32, zones: Vec<Polygon>) -> Transit {
        let (coverage_loop, router) = loop_and_router(cols, rows, zones);
        Transit::new(coverage_loop, router, airframe())
    }

    fn visit(cell: u16) -> CellVisit {
        CellVisit {
            cell,
            direction: Forward,
            tries: 0,
        }
    }

    /// The moves follow each other without a gap, and end at a boundary looking a way.
    fn assert_leads_to(t: &Transit, from: &Place, moves: &[Move], to: u16, direction: Direction) {
        let end = moves.iter().fold(*from, |at, step| {
            let start = match step {
                Move::Route(curve) => curve.start(),
                _ => None,
            };
            let gap_m = start.map_or(0.0, |s| (s.position() - at.pose.position()).norm());
            assert!(gap_m < 1e-6, "a gap of {gap_m} m");
            t.end_of(&at, step)
        });
        let goal = t.place(to, direction).pose;
        let off_m = (end.pose.position() - goal.position()).norm();
        assert!(off_m < 1e-3, "ends {off_m} m beside");
        let turn_rad = skein_geometry::math::wrap_pi(end.pose.heading_rad - goal.heading_rad);
        assert!(turn_rad.abs() < 1e-3, "looks {turn_rad} rad aside");
    }

    #[test]
    fn a_cell_is_left_where_the_next_one_is_entered() {
        let t = transit(6, 4, vec![]);
        let n = u16::try_from(t.coverage_loop.len()).unwrap();
        for cell in 0..n {
            let next = (cell + 1) % n;
            assert_eq!(t.exit(cell, Forward), t.entry(next, Forward));
            assert_eq!(t.entry(cell, Forward), t.exit(cell, Backward));
        }
    }

    #[test]
    fn neighbours_on_the_loop_need_no_way_between_them() {
        let t = transit(6, 4, vec![]);
        let from = t.place(t.exit(3, Forward), Forward);
        let moves = t.connect(&from, t.entry(4, Forward), Forward).unwrap();
        assert!(moves.is_empty(), "{moves:?}");
    }

    #[test]
    fn every_boundary_is_reached_from_every_other_one() {
        let t = transit(6, 4, vec![square(118.0, 70.0, 20.0)]);
        let n = u16::try_from(t.coverage_loop.len()).unwrap();
        for from in (0..n).step_by(3) {
            for to in (0..n).step_by(5) {
                for (d, e) in [(Forward, Forward), (Forward, Backward), (Backward, Forward)] {
                    let place = t.place(from, d);
                    let moves = t.connect(&place, to, e).expect("a way");
                    assert_leads_to(&t, &place, &moves, to, e);
                }
            }
        }
    }

    #[test]
    fn a_way_along_the_loop_is_taken_only_where_it_is_not_longer() {
        let t = transit(6, 4, vec![]);
        let n = u16::try_from(t.coverage_loop.len()).unwrap();
        let length_m = |moves: &[Move]| moves.iter().map(|m| t.length_m(m)).sum::<f64>();
        let (mut along, mut direct) = (0, 0);
        for first in 0..n {
            for count in [1, 2, 5, n / 2] {
                let from = t.place(first, Forward);
                let moves = t.connect(&from, (first + count) % n, Forward).unwrap();
                let cells = (0..count).map(|k| (first + k) % n);
                let around: Vec<Move> = cells.map(|c| Move::Pass(c, Forward)).collect();
                let (way_m, around_m) = (length_m(&moves), length_m(&around));
                assert!(
                    way_m <= around_m + 1e-6,
                    "{first} {count}: {way_m} {around_m}"
                );
                let passes = moves.iter().all(|m| matches!(m, Move::Pass(..)));
                *(if passes { &mut along } else { &mut direct }) += 1;
            }
        }
        assert!(along > 0 && direct > 0, "{along} {direct}");
        // Back where it came from it has to turn.
        let back = t.connect(&t.place(0, Forward), 0, Backward).unwrap();
        assert!(back.iter().any(|m| matches!(m, Move::Route(_))));
    }

    #[test]
    fn cells_that_are_closed_are_left_out_and_the_next_open_one_is_served() {
        let t = transit(6, 4, vec![]);
        let from = t.place(0, Forward);
        let mut queue: VecDeque<CellVisit> = (0..4).map(visit).collect();
        let mut refused = Vec::new();
        let (_, served) = t
            .next(&from, &mut queue, &|c| c >= 2, &mut refused)
            .unwrap();
        assert_eq!(served, visit(2));
        assert_eq!(queue, [visit(3)]);
        assert!(refused.is_empty());
        queue.clear();
        assert!(t.next(&from, &mut queue, &|_| true, &mut refused).is_none());
    }

    #[test]
    fn a_place_to_hold_keeps_clear_of_the_zones() {
        let t = transit(6, 4, vec![square(118.0, 70.0, 20.0)]);
        for boundary in 0..u16::try_from(t.coverage_loop.len()).unwrap() {
            let moves = t.way_to_loiter(&t.place(boundary, Forward));
            let Some(Move::Loiter(circle)) = moves.last() else {
                panic!("no circle at {boundary}: {moves:?}")
            };
            let piece = (circle.curvature_per_m, 0.5 * circle.length_m);
            let circle = Curve::from_pieces(circle.start, &[piece, piece]);
            assert!(t.router.zones().is_clear(&circle, CLEARANCE_M - 1e-6));
        }
    }

    /// A new mission may put a zone round a UAV: it leaves it and does not stay there.
    #[test]
    fn who_is_in_a_zone_leaves_it_once_and_keeps_clear_of_all_others() {
        let far = square(10.0, 10.0, 20.0);
        for side_m in [60.0, 160.0] {
            let zone = square(100.0, 40.0, side_m);
            let t = transit(12, 8, vec![zone.clone(), far.clone()]);
            for k in 0..16 {
                let at = Point::new(110.0 + 2.0 * f64::from(k), 50.0 + f64::from(k));
                let pose = Pose::new(at, 0.41 * f64::from(k) - PI);
                let from = Place {
                    pose,
                    boundary: None,
                };
                let home = Point::new(-60.0, -60.0);
                let circle = t.way_to_loiter(&from);
                let ways = [t.connect_to_point(&from, home).unwrap(), circle];
                for moves in ways {
                    let Some(Move::Route(way)) = moves.first() else {
                        panic!("{moves:?}");
                    };
                    assert!(t.is_cleared(&from, &moves[0]));
                    let places = (0..).map(|d| f64::from(d) * 0.5);
                    let places = places.take_while(|d| *d < way.length_m());
                    let places: Vec<Point> =
                        places.map(|d| way.pose_at(d).unwrap().position()).collect();
                    let inside = |p: &&Point| zone.distance_m(**p) <= 0.0;
                    let first = places.iter().take_while(inside).count();
                    assert_eq!(first, places.iter().filter(inside).count(), "in again");
                    assert!(places.iter().all(|p| far.distance_m(*p) > 1.5));
                }
            }
        }
    }

    /// Between two walls, with room for one circle across: whatever way it comes from, a UAV
    /// waits there and not where the walls end.
    #[test]
    fn who_waits_in_a_gate_comes_with_a_heading_that_has_room() {
        let t = transit(12, 8, Vec::new());
        let half_m = t.turn_radius_m() + t.router.limits().clearance_m + 4.0;
        let gate = Point::new(250.0, 180.0);
        let wall = |west: f64| {
            let at = |east: f64, north: f64| Point::new(gate.x + west + east, gate.y + north);
            let ring = vec![at(0.0, -4.0), at(200.0, -4.0), at(200.0, 4.0), at(0.0, 4.0)];
            Polygon::new(ring).unwrap()
        };
        let t = transit(12, 8, vec![wall(half_m), wall(-half_m - 200.0)]);
        let mut elsewhere = 0;
        for k in 0..16 {
            let turned = 0.4 * f64::from(k);
            let from = Place {
                pose: Pose::new(
                    Point::new(gate.x + 90.0 * turned.cos(), gate.y + 130.0 * turned.sin()),
                    turned,
                ),
                boundary: None,
            };
            if t.router.zones().distance_m(from.pose.position()) < t.router.limits().clearance_m {
                continue;
            }
            let moves = t.way_to_wait_at(&from, gate).unwrap();
            let [Move::Route(_), Move::Loiter(circle)] = moves.as_slice() else {
                panic!("{moves:?}");
            };
            assert!((circle.start.position() - gate).norm() < 0.01, "{k}");
            assert!(moves.iter().all(|step| t.is_cleared(&from, step)), "{k}");
            let straight = t.connect_to_point(&from, gate).unwrap();
            let end = straight
                .iter()
                .fold(from, |place, step| t.end_of(&place, step));
            elsewhere += usize::from(!matches!(
                t.way_to_loiter(&end).as_slice(),
                [Move::Loiter(_)]
            ));
        }
        assert!(elsewhere > 3, "{elsewhere}");
    }

    #[test]
    fn the_nearest_boundaries_come_in_order() {
        let t = transit(6, 4, vec![]);
        let p = Point::new(2.2 * LANE_M, 1.7 * LANE_M);
        let away_m = |b: &u16| (t.place(*b, Forward).pose.position() - p).norm();
        let nearest: Vec<f64> = t.nearest(p, 24).iter().map(away_m).collect();
        assert_eq!(nearest.len(), 24);
        assert!(nearest.is_sorted());
    }

    #[test]
    fn a_pose_beside_the_loop_is_led_onto_it() {
        let t = transit(6, 4, vec![]);
        let pose = Pose::new(Point::new(-120.0, 60.0), 0.25 * PI);
        let (boundary, direction, way_m) = t.way_on(pose).unwrap();
        let from = Place {
            pose,
            boundary: None,
        };
        let moves = t.connect(&from, boundary, direction).unwrap();
        assert_leads_to(&t, &from, &moves, boundary, direction);
        let length_m: f64 = moves.iter().map(|m| t.length_m(m)).sum();
        assert!((length_m - way_m).abs() < 1.0, "{length_m} {way_m}");
    }
}
