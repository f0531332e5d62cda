//! A* over the circles round the corners, from a pose to a pose or a point (D2.7
//! §2.3.2 for curves that a fixed wing flies).
//!
//! A route leaves on the left or right turning circle of its start, runs over lines
//! and wheels, and ends on a turning circle of its goal. Lines and arcs are measured
//! against the zones only when the search comes to them; a whole route is measured
//! once more before it is handed out, and the next best is taken if it fails.

use super::tangent_circles::{Circle, Line, Wheels};
use super::{Goal, RouteLimits};
use skein_geometry::NoFlyZones;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{TAU, wrap_tau};
use skein_geometry::{Curve, Segment};
use std::cmp::Ordering;
use std::collections::{BTreeSet, BinaryHeap};

/// Arrivals on circles at most: a question that needs more costs tens of
/// milliseconds and has always had no answer.
const MAX_ARRIVALS: usize = 4096;

/// Lines opened at most: keeps a question's memory below 30 MB on any map.
const MAX_STEPS: usize = 200_000;

/// A turn this little short of a full circle is rounding, radians: a tenth of a
/// millimetre on a turn of a kilometre.
const FULL_TURN_RAD: f64 = 1e-7;

/// Pieces shorter than this are left out, metres.
const NO_PIECE_M: f64 = 1e-6;

/// A search over the wheels of one router.
pub(super) struct Search<'a> {
    pub zones: &'a NoFlyZones,
    pub limits: RouteLimits,
    pub wheels: &'a Wheels,
}

/// A way that has come to a circle.
#[derive(Clone, Debug)]
struct Arrival {
    circle: Circle,
    at: Point,
    heading_rad: f64,
    length_m: f64,
    /// Where it came from, how far it turned there and the line it took.
    from: Option<(usize, f64, Line)>,
    /// How far it may turn on: known clear up to the first, blocked from the second.
    clear_rad: f64,
    blocked_rad: f64,
}

/// A line from an arrival onwards, not yet measured.
#[derive(Clone, Copy, Debug)]
struct Step {
    bound_m: f64,
    number: usize,
    arrival: usize,
    turned_rad: f64,
    line: Line,
    next: Next,
}

#[derive(Clone, Copy, Debug)]
enum Next {
    /// A directed wheel, from a place in the list of lines of another.
    Wheel(u32, Option<(u32, usize)>),
    /// The goal, after an arc on a circle of it.
    Goal(Circle, f64),
}

/// The open steps, arrivals so far, and what is done.
struct State {
    open: BinaryHeap<Step>,
    arrivals: Vec<Arrival>,
    taken: BTreeSet<(u32, usize)>,
    pushed: usize,
    limit_m: f64,
}

impl Search<'_> {
    /// The shortest route over at least one wheel that is shorter than `limit_m`.
    pub fn run(&self, from: Pose, goal: Goal, limit_m: f64) -> Option<Curve> {
        let mut state = State {
            open: BinaryHeap::new(),
            arrivals: Vec::new(),
            taken: BTreeSet::new(),
            pushed: 0,
            limit_m,
        };
        for side in [1.0, -1.0] {
            state.arrivals.push(Arrival {
                circle: Circle::beside(from, self.limits.turn_radius_m, side),
                at: from.position(),
                heading_rad: from.heading_rad,
                length_m: 0.0,
                from: None,
                clear_rad: 0.0,
                blocked_rad: f64::INFINITY,
            });
            self.expand_start(&mut state, goal.position());
        }
        let ends = goal.circles(self.limits.turn_radius_m);
        while let Some(step) = state.open.pop() {
            if state.arrivals.len() >= MAX_ARRIVALS {
                return None;
            }
            match step.next {
                Next::Wheel(node, place) => {
                    if place.is_some_and(|p| state.taken.contains(&p))
                        || !self.is_clear(&mut state, &step, place)
                    {
                        continue;
                    }
                    state.taken.extend(place);
                    let arrival = self.arrive(&state, &step, node);
                    state.arrivals.push(arrival);
                    self.expand(&mut state, node, goal, &ends);
                }
                Next::Goal(circle, last_rad) => {
                    if self.is_clear(&mut state, &step, None) {
                        let curve = self.curve(&state, &step, &circle, last_rad);
                        if self.zones.is_clear(&curve, self.limits.clearance_m) {
                            return Some(curve);
                        }
                    }
                }
            }
        }
        None
    }

    fn arrive(&self, state: &State, step: &Step, node: u32) -> Arrival {
        let before = &state.arrivals[step.arrival];
        let arc_m = step.turned_rad * before.circle.radius_m;
        Arrival {
            circle: self.wheels.circle(node),
            at: step.line.end(),
            heading_rad: step.line.heading_rad(),
            length_m: before.length_m + arc_m + step.line.length_m,
            from: Some((step.arrival, step.turned_rad, step.line)),
            clear_rad: 0.0,
            blocked_rad: f64::INFINITY,
        }
    }

    /// Lines from the newest arrival, a circle of the start, to all wheels.
    fn expand_start(&self, state: &mut State, goal: Point) {
        let circle = state.arrivals[state.arrivals.len() - 1].circle;
        for node in 0..self.wheels.len() {
            if let Some(line) = circle.line_to(&self.wheels.circle(node))
                && self.wheels.touches(node, line.direction)
            {
                let rest_m = (goal - line.end()).norm();
                state.push(line, line.heading_rad(), rest_m, Next::Wheel(node, None));
            }
        }
    }

    /// Lines from the newest arrival, on a wheel, to other wheels and to the goal.
    fn expand(&self, state: &mut State, node: u32, goal: Goal, ends: &[Circle]) {
        let arrival = &state.arrivals[state.arrivals.len() - 1];
        let (circle, heading_rad) = (arrival.circle, arrival.heading_rad);
        let reach_rad = self.wheels.reach_rad(node) + FULL_TURN_RAD;
        let turns = |to_rad: f64| turn(circle.side * (to_rad - heading_rad)) <= reach_rad;
        for (k, tangent) in self.wheels.lines(node).iter().enumerate() {
            if !tangent.is_known_blocked()
                && turns(tangent.heading_rad)
                && !state.taken.contains(&(node, k))
            {
                let rest_m = (goal.position() - tangent.line.end()).norm();
                let next = Next::Wheel(tangent.to, Some((node, k)));
                state.push(tangent.line, tangent.heading_rad, rest_m, next);
            }
        }
        for end in ends {
            let Some(line) = circle.line_to(end) else {
                continue;
            };
            let to_rad = line.heading_rad();
            if self.wheels.touches(node, line.direction) && turns(to_rad) {
                let last_rad = goal
                    .heading_rad()
                    .map_or(0.0, |h| turn(end.side * (h - to_rad)));
                let next = Next::Goal(*end, last_rad);
                state.push(line, to_rad, last_rad * end.radius_m, next);
            }
        }
    }

    /// Whether the arc before the line, the line, and what follows keep clear.
    fn is_clear(&self, state: &mut State, step: &Step, place: Option<(u32, usize)>) -> bool {
        let keep_m = self.limits.clearance_m;
        let line_is_clear = match place {
            Some((node, k)) => self.wheels.lines(node)[k].is_clear(self.zones, keep_m),
            None => self.zones.is_segment_clear(&step.line.segment(), keep_m),
        };
        let arrival = &mut state.arrivals[step.arrival];
        line_is_clear && self.may_turn(arrival, step.turned_rad)
    }

    fn may_turn(&self, arrival: &mut Arrival, turned_rad: f64) -> bool {
        if turned_rad <= arrival.clear_rad || turned_rad * arrival.circle.radius_m < NO_PIECE_M {
            return true;
        }
        if turned_rad >= arrival.blocked_rad {
            return false;
        }
        let pose = Pose::new(arrival.at, arrival.heading_rad);
        let arc = arc(&arrival.circle, pose, turned_rad);
        let clear = self.zones.is_segment_clear(&arc, self.limits.clearance_m);
        if clear {
            arrival.clear_rad = turned_rad;
        } else {
            arrival.blocked_rad = turned_rad;
        }
        clear
    }

    /// The whole route of a step that comes to the goal.
    fn curve(&self, state: &State, step: &Step, circle: &Circle, last_rad: f64) -> Curve {
        let last_pose = Pose::new(step.line.end(), step.line.heading_rad());
        let mut pieces = Vec::new();
        if circle.radius_m > 0.0 {
            pieces.push(arc(circle, last_pose, last_rad));
        }
        let mut way = Some((step.arrival, step.turned_rad, step.line));
        while let Some((i, turned_rad, line)) = way {
            let arrival = &state.arrivals[i];
            let pose = Pose::new(arrival.at, arrival.heading_rad);
            pieces.push(line.segment());
            pieces.push(arc(&arrival.circle, pose, turned_rad));
            way = arrival.from;
        }
        let mut curve = Curve::empty();
        for piece in pieces.into_iter().rev() {
            if piece.length_m >= NO_PIECE_M {
                curve.push(piece);
            }
        }
        curve
    }
}

impl State {
    /// Opens a line from the newest arrival; `rest_m` bounds what follows it.
    fn push(&mut self, line: Line, heading_rad: f64, rest_m: f64, next: Next) {
        let arrival = self.arrivals.len() - 1;
        let a = &self.arrivals[arrival];
        let turned_rad = turn(a.circle.side * (heading_rad - a.heading_rad));
        let bound_m = a.length_m + turned_rad * a.circle.radius_m + line.length_m + rest_m;
        if bound_m < self.limit_m && self.pushed < MAX_STEPS {
            self.pushed += 1;
            self.open.push(Step {
                bound_m,
                number: self.pushed,
                arrival,
                turned_rad,
                line,
                next,
            });
        }
    }
}

fn arc(circle: &Circle, start: Pose, turned_rad: f64) -> Segment {
    Segment {
        start,
        curvature_per_m: circle.side / circle.radius_m,
        length_m: turned_rad * circle.radius_m,
    }
}

/// An angle to turn, in [0, 2π), without full turns that are only rounding.
fn turn(a_rad: f64) -> f64 {
    let t = wrap_tau(a_rad);
    if t > TAU - FULL_TURN_RAD { 0.0 } else { t }
}

impl Ord for Step {
    /// The smallest bound is the greatest, ties by age.
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .bound_m
            .total_cmp(&self.bound_m)
            .then(other.number.cmp(&self.number))
    }
}

impl PartialOrd for Step {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Step {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Step {}
