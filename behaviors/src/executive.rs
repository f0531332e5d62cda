//! The executive layer: flies legs of the coverage loop one after the other, and
//! goes to a point when told to, or flies what was planned before (D2.7 §1.2.3,
//! executive layer).
//!
//! An [`Executive`] keeps a track some seconds long in front of the UAV and lengthens
//! it cell by cell. Ways between cells come from [`transit`], what the camera saw from
//! [`camera`], the way to a given circle from [`circle`], rounds of the loop from [`circuit`], the way along a contour that is seen from [`tracing`], turns after a moving target from [`pursuit`], out of the way of aircraft that are no members from `evasion`, a flight between cells and what it
//! is for from [`detour`], where a gimbal turns from `gaze`, expectations for the peer from [`prediction`], what the fuel allows
//! from [`endurance`], what stays of a flight when the
//! goal changes from `goal_change`, to which height it flies from [`layers`], how far a given flight reaches from [`given`], the proof of each stretch from `clearance_check`;
//! following the track and the safety of every setpoint are the reactive layer's.
//!
//! | goal | track | events |
//! |---|---|---|
//! | hold | the nearest circle with room | none |
//! | legs | open cells in order, then a circle | `Seen`, `Refused`, `PlanDone` once |
//! | point | a route, then a circle | `Refused` without cells if there is no route |
//! | circle | a route to the given circle, then that | likewise |
//! | round | a route onto the loop, then the loop, forward, without end | `Refused` without cells if there is no route |
//! | trace | turns along the contour that it sees; round until it sees one | likewise |
//! | follow | none: turns that follow the target, from percept to percept | none |
//! | given | a route to its start, its pieces, then a circle | `CutShort` where it ends early, `PlanDone` once |
//! | detour | the cell that is flown, a given flight, then legs | those of both, `DetourFlown` once |
//!
//! # Guarantees
//! An open cell of the legs is flown until it is seen or refused. Equal inputs give
//! equal outputs.
//!
//! # Complexity
//! A step costs a projection, a few footprint tests and the envelope; the router is
//! asked only where the next open cell does not follow on the loop.

pub mod camera;
pub mod circle;
pub mod circuit;
mod clearance_check;

pub mod detour;
pub mod endurance;
mod evasion;
mod gaze;
pub mod given;
mod goal_change;
pub mod layers;
pub mod new_zones;
pub mod passes;
pub mod prediction;
pub mod promised;
pub mod pursuit;
pub mod tracing;
mod transfer;
pub mod transit;
mod way_home;

use crate::event::Event;
use crate::percept::Percept;
use crate::reactive::air::{self, Air};
use crate::reactive::envelope::{Envelope, is_finite};
use crate::reactive::follow::{HORIZON_S, Offset, Track};
use crate::reactive::well_clear::WellClear;
use crate::setpoint::{Setpoint, Side};
use camera::{Played, look};
use endurance::Home;
use given::Given;
pub use given::GivenFlight;
pub use prediction::UNREACHABLE_MS;
use serde::{Deserialize, Serialize};
use skein_flight::airframe::Airframe;
use skein_flight::coverage::ring::backtracking::{Leg, OffLoop};
use skein_flight::coverage::ring::{CoverageLoop, Direction};
use skein_flight::route::Router;
use skein_flight::tracking::buildings::Town;
use skein_flight::trajectory::timed::Objective;
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::Point;
use skein_geometry::math::TAU;
use skein_geometry::{Curve, Segment};
use std::collections::VecDeque;
use std::sync::Arc;
use transit::{CellVisit, Move, Place, Transit};
use way_home::WaysHome;

/// How far a UAV may stray from its curve unless the mission says otherwise, metres.
pub const DEFAULT_TRACKING_ERROR_M: f64 = 2.0;

/// A UAV farther off its track than this plans anew from where it is, metres: three
/// times what following allows, so only a failsafe or a long silence gets there.
const LOST_M: f64 = 6.0;

/// The same for its heading, radians.
const LOST_RAD: f64 = 0.8;

/// Nearer to its track than this a UAV plans anew from the track, not from its own pose:
/// a Dubins curve that corrects a millimetre costs a full circle.
const ON_TRACK_M: f64 = 0.5;
const ON_TRACK_RAD: f64 = 0.1;

/// A wind that changed by less is the same wind, m/s: following takes it as an error
/// and the times told are off by two percent.
const NOTICED_MPS: f64 = 0.3;

/// A cell that was flown this often and not seen is given up.
const MAX_TRIES: u8 = 3;

/// Progress may exceed what the airspeed explains by this much, metres.
const WINDOW_M: f64 = 5.0;

/// Percepts later than this do not widen the search on the track, seconds: within it
/// the track ahead has been flown.
const WINDOW_S: f64 = 3.0;

/// Cells remembered as reported: the peer may close a cell a few percepts later.
const RECENT: usize = 16;

/// What a UAV is doing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Goal {
    /// Loiter where it is.
    Hold,
    /// Fly these legs in order, then loiter.
    Legs(Vec<Leg>),
    /// Fly to this point, then loiter around it.
    Point(Point),
    /// Fly to this circle and stay on it.
    Circle(Segment),
    /// Fly round the loop, forward, again and again, evenly spaced among those who do.
    Round,
    /// Fly along the contour that it sees, evenly spaced among those who do; round the loop
    /// until it sees one.
    Trace,
    /// Follow the target that it is told of, this far from it, metres; hold while it is told of
    /// none.
    Follow(f64),
    /// Fly this from its start to its end, then loiter.
    Given(GivenFlight),
    /// Fly this once the cell that is being flown is done, then these legs, then loiter.
    Detour(GivenFlight, Vec<Leg>),
}

/// Where the UAV will be when it has flown for a while under its present goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Cells it will have flown by then, in order.
    pub cells: Vec<u16>,
    /// The boundary of the loop where it will be, or which it can next reach.
    pub anchor: u16,
    /// Which way along the loop it flies there.
    pub heading: Direction,
    /// When it is there, milliseconds from now.
    pub release_ms: u32,
    /// Where it is, if nothing keeps it from leaving for anywhere, at once or when it takes
    /// off: it is in no cell, and will serve none that soon.
    pub off_loop: Option<OffLoop>,
    /// When all legs, or the given flight, are flown, milliseconds from now.
    pub finish_ms: u32,
}

/// The goal, without its legs, which are in the queue, and the flight that was given.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Aim {
    Hold,
    Legs,
    Point(Point),
    Circle(Segment),
    Round,
    Trace,
    Follow,
    Given,
    Detour,
}

impl Aim {
    /// Whether a given flight is part of it.
    fn gives(self) -> bool {
        matches!(self, Self::Given | Self::Detour)
    }
}

/// What a stretch of the track is for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Serve(CellVisit),
    Pass(u16, Direction),
    Route,
    /// A piece of the given flight, from and to so many metres along it.
    Piece {
        from_m: f64,
        to_m: f64,
    },
    Loiter(Segment),
}

impl Kind {
    fn visit(&self) -> Option<CellVisit> {
        match self {
            Self::Serve(visit) => Some(*visit),
            _ => None,
        }
    }

    fn cell(&self) -> Option<(u16, Direction)> {
        match self {
            Self::Serve(visit) => Some((visit.cell, visit.direction)),
            Self::Pass(cell, direction) => Some((*cell, *direction)),
            _ => None,
        }
    }
}

/// A stretch of the track.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    kind: Kind,
    /// Arc length of the track at its end, metres.
    end_m: f64,
    end: Place,
}

/// The executive of one UAV.
#[derive(Clone, Debug)]
pub struct Executive {
    transit: Transit,
    height_m: f64,
    envelope: Envelope,
    aim: Aim,
    /// Cells will be given to it soon.
    expects_cells: bool,
    /// Cells to be served after those on the track.
    queue: VecDeque<CellVisit>,
    /// What was planned before and is to be flown.
    given: Option<Given>,
    track: Track,
    stretches: VecDeque<Stretch>,
    /// Whether the track is to be given up at the next step.
    replan: bool,
    /// Whether the end of the legs has been reported.
    end_reported: bool,
    /// Whether it has been reported that a detour is flown.
    detour_reported: bool,
    /// What is looked for besides the cells of the loop.
    watched: Option<detour::Watched>,
    played: Option<Played>,
    recent: VecDeque<u16>,
    /// Events that came up between two steps.
    pending: Vec<Event>,
    /// How it gets home, and what that takes.
    home: Option<Home>,
    /// How late it may be noticed that the fuel is due, milliseconds.
    late_ms: u32,
    /// What it flies where nothing else was agreed, if it flies by promises.
    contingency: Option<promised::Contingency>,
    /// Of whom it follows, if it does.
    pursuit: Option<pursuit::Pursuit>,
    /// Buildings and streets, where they are known.
    town: Option<Arc<Town>>,
    /// Whether it circles because there was no way to where it is to go.
    stranded: bool,
    /// How it keeps its place among those who fly round the loop.
    circuit: circuit::Circuit,
    /// What it sees of a contour.
    tracing: tracing::Tracing,
    /// How often cells were missed.
    passes: passes::Passes,
    /// At which heights it flies, where those change.
    layered: Option<layers::Layered>,
    /// How it makes way for aircraft that are no members.
    well_clear: WellClear,
    /// Whether it flies higher than its mission, over an aircraft that is no member.
    passes_over: bool,
}

impl Executive {
    /// An executive that holds until it is given a goal.
    #[must_use]
    pub fn new(
        airframe: Airframe,
        height_m: f64,
        coverage_loop: Arc<CoverageLoop>,
        router: Arc<Router>,
    ) -> Self {
        let envelope = Self::envelope(airframe, &router, DEFAULT_TRACKING_ERROR_M);
        let mut transit = Transit::new(coverage_loop, router, airframe);
        transit.set_air(Air::calm(envelope.airspeed_mps(airframe.cruise_mps)));
        Self {
            transit,
            height_m,
            envelope,
            aim: Aim::Hold,
            expects_cells: false,
            queue: VecDeque::new(),
            given: None,
            track: Track::default(),
            stretches: VecDeque::new(),
            replan: true,
            end_reported: false,
            detour_reported: false,
            watched: None,
            played: None,
            recent: VecDeque::with_capacity(RECENT),
            pending: Vec::new(),
            home: None,
            late_ms: 0,
            contingency: None,
            pursuit: None,
            town: None,
            stranded: false,
            circuit: circuit::Circuit::default(),
            tracing: tracing::Tracing::default(),
            passes: passes::Passes::default(),
            layered: None,
            well_clear: WellClear::default(),
            passes_over: false,
        }
    }

    /// The same with an objective for its transfers off the loop and its airspeed.
    #[must_use]
    pub fn with_objective(mut self, objective: Objective) -> Self {
        self.transit = self.transit.with_objective(objective);
        let wind = self.transit.air().wind;
        self.set_air(wind);
        self
    }

    /// The same with a place to which it must be able to return before its reserve.
    #[must_use]
    pub fn with_home(mut self, home: Point) -> Self {
        let ways = WaysHome::new(&self.transit, home);
        self.home = Some(Home::new(&self.transit, home, ways));
        self
    }

    /// The same with what it knows of buildings, by which its circles about targets go, and of
    /// streets, along which these drive on.
    #[must_use]
    pub fn with_town(mut self, town: Option<Arc<Town>>) -> Self {
        self.town = town;
        self
    }

    /// The same with how late it may be noticed that the fuel is due, milliseconds: so much
    /// more is kept.
    #[must_use]
    pub fn with_late_ms(mut self, late_ms: u32) -> Self {
        self.late_ms = late_ms;
        self
    }

    /// The same, with the tracking error of the mission, metres: the envelope lets
    /// flights come this much nearer to zones than curves may.
    #[must_use]
    pub fn with_tracking_error_m(mut self, tracking_error_m: f64) -> Self {
        self.envelope = Self::envelope(
            self.transit.airframe,
            &self.transit.router,
            tracking_error_m,
        );
        self.transit.tracking_error_m = tracking_error_m;
        self
    }

    fn envelope(airframe: Airframe, router: &Router, tracking_error_m: f64) -> Envelope {
        let least_m = (router.limits().clearance_m - tracking_error_m).max(0.0);
        Envelope::new(airframe, Arc::clone(router.zones()), least_m)
    }

    /// Answers a percept with a setpoint, already passed through the envelope; where its gimbal
    /// turns is not in it yet.
    fn steer(
        &mut self,
        percept: &Percept,
        is_open: &dyn Fn(u16) -> bool,
    ) -> (Setpoint, Vec<Event>) {
        let mut events = std::mem::take(&mut self.pending);
        if !is_finite(&percept.pose) {
            return (
                self.envelope
                    .check(percept, self.setpoint(percept, Vec::new())),
                events,
            );
        }
        self.note_wind(percept);
        if percept.takes_off_in_ms > 0 {
            return (self.on_ground(percept), events);
        }
        if self.promises(percept) {
            return self.step_promised(percept, is_open, events);
        }
        self.report_seen(percept, is_open, &mut events);
        self.report_sighted(percept, &mut events);
        if let Some(setpoint) = self.evade(percept) {
            return (setpoint, events);
        }
        if let Some(setpoint) = self.pursue(percept) {
            return (setpoint, events);
        }
        let offset = self.progress(percept);
        self.see_contour(percept);
        self.count_misses(is_open, &mut events);
        self.skip_closed(is_open);
        if self.replan || self.stretches.is_empty() {
            self.leave_track();
        }
        let start = self.start(percept, offset);
        self.lengthen(start, is_open, &mut events);
        self.report_end(&mut events);
        let offset = if self.replan {
            self.restart(percept)
        } else {
            offset
        };
        let speed = self.speed_mps();
        let limit = self.transit.airframe.max_turn_rate_radps(speed);
        let still = Offset {
            cross_m: 0.0,
            heading_rad: 0.0,
        };
        let offset = offset.unwrap_or(still);
        let steps = air::steps(&self.track, offset, &self.flown_air(), limit);
        let setpoint = self.setpoint(percept, steps);
        let looks_s = self.lands_in_s().unwrap_or(HORIZON_S);
        let setpoint = self.envelope.check_until(percept, setpoint, looks_s);
        self.plays(percept, &setpoint);
        (setpoint, events)
    }

    /// This is commanded from a percept on; where its gimbal turns is not in it yet.
    fn plays(&mut self, percept: &Percept, setpoint: &Setpoint) {
        self.played = Some(Played {
            percept: *percept,
            steps: setpoint.steps.clone(),
            airspeed_mps: setpoint.airspeed_mps,
            gimbal: Vec::new(),
        });
    }

    /// No track is kept: whatever comes next begins where the UAV is.
    fn leave_track(&mut self) {
        self.replan = true;
        self.requeue();
    }

    /// Before it takes off: it sees nothing, and plans from where it stands once it flies.
    fn on_ground(&mut self, percept: &Percept) -> Setpoint {
        let bare = self.setpoint(percept, Vec::new());
        let setpoint = if let Some(launch) = self.on_launcher(percept) {
            Setpoint { launch, ..bare }
        } else {
            self.leave_track();
            self.envelope.check(percept, bare)
        };
        self.played = Some(Played {
            percept: *percept,
            steps: Vec::new(),
            airspeed_mps: setpoint.airspeed_mps,
            gimbal: Vec::new(),
        });
        setpoint
    }

    fn setpoint(&self, percept: &Percept, steps: Vec<crate::setpoint::Steer>) -> Setpoint {
        Setpoint {
            from_ms: percept.time_ms,
            airspeed_mps: self.speed_mps(),
            height_m: self.height_m,
            steps,
            loiter: Side::Left,
            gimbal: Vec::new(),
            launch: crate::setpoint::Launch::Stay,
            promised: None,
        }
    }

    /// The airspeed that is commanded, m/s.
    fn speed_mps(&self) -> f64 {
        self.flown_air().airspeed_mps
    }

    /// Takes note of the wind: curves over the ground must stay flyable in it, and
    /// what they cost changes.
    fn note_wind(&mut self, percept: &Percept) {
        let wind = Wind::new(percept.wind_east_mps, percept.wind_north_mps);
        let changed_mps = (wind.velocity() - self.transit.air().wind.velocity()).norm();
        if changed_mps.is_nan() || changed_mps < NOTICED_MPS {
            return;
        }
        self.set_air(wind);
    }

    fn set_air(&mut self, wind: Wind) {
        let radius_m = self.transit.router.limits().turn_radius_m;
        let (airframe, objective) = (&self.transit.airframe, self.transit.objective);
        let wanted = self
            .given_airspeed_mps(wind)
            .unwrap_or_else(|| Air::airspeed_for_mps(objective, airframe, wind, radius_m));
        let airspeed_mps = self.envelope.airspeed_mps(wanted);
        self.transit.set_air(Air { wind, airspeed_mps });
        if let Some(home) = self.home.take() {
            self.home = Some(home.in_air_of(&self.transit));
        }
        self.assess_given();
    }

    /// Reports the cells that the camera saw since the last percept.
    fn report_seen(
        &mut self,
        percept: &Percept,
        is_open: &dyn Fn(u16) -> bool,
        events: &mut Vec<Event>,
    ) {
        let mut seen = Vec::new();
        let Some(before) = self.played_in_layer(percept) else {
            return;
        };
        let transit = &self.transit;
        look(
            &*transit.coverage_loop,
            &transit.airframe,
            before,
            percept,
            is_open,
            &mut seen,
        );
        if seen.is_empty() {
            return;
        }
        for &cell in &seen {
            if !self.recent.contains(&cell) {
                if self.recent.len() == RECENT {
                    self.recent.pop_front();
                }
                self.recent.push_back(cell);
            }
        }
        self.passes.seen += u32::try_from(seen.len()).unwrap_or(0);
        events.push(Event::Seen(seen));
    }

    /// Follows the UAV on its track; asks for a new one when it is lost.
    fn progress(&mut self, percept: &Percept) -> Option<Offset> {
        #[allow(clippy::cast_precision_loss, reason = "clamped right after")]
        let since_s = self
            .played
            .as_ref()
            .map_or(WINDOW_S, |p| {
                percept.time_ms.saturating_sub(p.percept.time_ms) as f64 / 1000.0
            })
            .min(WINDOW_S);
        let wind_mps = self.transit.air().wind.speed_mps();
        let window_m = (self.transit.airframe.max_mps + wind_mps) * since_s + WINDOW_M;
        let pose = self.flown_air().over_ground(percept.pose);
        let offset = self.track.advance(&pose, window_m);
        let lost =
            offset.is_none_or(|o| o.cross_m.abs() > LOST_M || o.heading_rad.abs() > LOST_RAD);
        self.replan = self.replan || lost;
        offset
    }

    /// Takes stretches off that are behind; cells flown and not seen are flown again.
    fn count_misses(&mut self, is_open: &dyn Fn(u16) -> bool, events: &mut Vec<Event>) {
        let mut missed = None;
        while let Some(front) = self.stretches.front().copied() {
            if front.end_m > self.track.at_m() || missed.is_some() {
                break;
            }
            self.stretches.pop_front();
            missed = front
                .kind
                .visit()
                .filter(|visit| is_open(visit.cell) && !self.recent.contains(&visit.cell));
        }
        let Some(visit) = missed else { return };
        self.passes.miss(&visit);
        let tries = visit.tries + 1;
        if tries >= MAX_TRIES {
            events.push(Event::Refused {
                cells: vec![visit.cell],
            });
            return;
        }
        self.requeue();
        self.queue.push_front(CellVisit { tries, ..visit });
        self.replan = true;
    }

    /// Puts the cells on the track back into the queue and takes the stretches off.
    fn requeue(&mut self) {
        self.requeue_given();
        for s in self.stretches.drain(..).rev() {
            if let Some(visit) = s.kind.visit() {
                self.queue.push_front(visit);
            }
        }
    }

    /// A cell that was seen while the UAV was on its way there is no goal any more.
    fn skip_closed(&mut self, is_open: &dyn Fn(u16) -> bool) {
        let Some(front) = self.stretches.front() else {
            return;
        };
        if front.kind.visit().is_some() || matches!(front.kind, Kind::Loiter(_)) {
            return;
        }
        // What was given is flown whole; cells that closed behind it are skipped then.
        if self.has_pieces() {
            return;
        }
        let target = self.stretches.iter().find_map(|s| s.kind.visit());
        if target.is_some_and(|visit| !is_open(visit.cell)) {
            if front.kind == Kind::Route {
                self.replan = true;
            } else {
                let rest: Vec<CellVisit> = self
                    .stretches
                    .iter()
                    .skip(1)
                    .filter_map(|s| s.kind.visit())
                    .collect();
                self.keep(1);
                for visit in rest.into_iter().rev() {
                    self.queue.push_front(visit);
                }
            }
        }
    }

    /// Where the next stretch begins: at the end of the track, or where a new track is
    /// to begin.
    fn start(&self, percept: &Percept, offset: Option<Offset>) -> Place {
        if let Some(last) = self.stretches.back() {
            return last.end;
        }
        let near = offset
            .is_some_and(|o| o.cross_m.abs() < ON_TRACK_M && o.heading_rad.abs() < ON_TRACK_RAD);
        let here = self.flown_air().over_ground(percept.pose);
        let pose = self.track.pose().filter(|_| near).unwrap_or(here);
        Place {
            pose,
            boundary: None,
        }
    }

    /// Lengthens the track until it reaches beyond the horizon of a setpoint.
    fn lengthen(&mut self, start: Place, is_open: &dyn Fn(u16) -> bool, events: &mut Vec<Event>) {
        if self.stretches.is_empty() {
            self.track.clear();
        }
        let fastest_mps = self.transit.airframe.max_mps + self.transit.air().wind.speed_mps();
        let least_m = fastest_mps * (HORIZON_S + 0.5);
        let mut at = start;
        while self.track.left_m() < least_m {
            let moves = self.next_moves(&at, is_open, events);
            let is_piece = |step: &Move| matches!(step, Move::Piece(..));
            let goes_on = moves.iter().any(is_piece);
            let cleared = self.transit.cleared(&at, moves, events);
            if goes_on && !cleared.iter().any(is_piece) {
                self.not_cleared();
            }
            for step in cleared {
                at = self.push(&at, step);
            }
        }
    }

    /// What follows at the end of the track.
    fn next_moves(
        &mut self,
        at: &Place,
        is_open: &dyn Fn(u16) -> bool,
        events: &mut Vec<Event>,
    ) -> Vec<Move> {
        if let Some(moves) = self.given_moves(at) {
            return moves;
        }
        if let Some(moves) = self.wait_for_layer(at, is_open) {
            return moves;
        }
        if matches!(self.aim, Aim::Legs | Aim::Detour) {
            let mut cells = Vec::new();
            let next = self.transit.next(at, &mut self.queue, is_open, &mut cells);
            if !cells.is_empty() {
                events.push(Event::Refused { cells });
            }
            if let Some((mut moves, visit)) = next {
                moves.push(Move::Serve(visit));
                return moves;
            }
        }
        // Who flies round circles once, to let who is ahead get away.
        let stays = !matches!(self.aim, Aim::Round | Aim::Trace) || self.stranded;
        if let Some(Kind::Loiter(circle)) = self.stretches.back().map(|s| s.kind)
            && stays
        {
            return self.circled(at, circle);
        }
        if let Some(moves) = self.back_to_wait(at) {
            return moves;
        }
        match self.way_to_aim(at) {
            Some(moves) => {
                self.stranded = false;
                return moves;
            }
            None if matches!(
                self.aim,
                Aim::Point(_) | Aim::Circle(_) | Aim::Round | Aim::Trace
            ) =>
            {
                events.push(Event::Refused { cells: Vec::new() });
                self.stranded = true;
            }
            None => {}
        }
        self.transit.way_to_loiter(at)
    }

    /// The way to where it is to stay, or round; `None` where there is none, or it is to stay
    /// nowhere.
    fn way_to_aim(&mut self, at: &Place) -> Option<Vec<Move>> {
        match self.aim {
            Aim::Point(p) => self.transit.way_to_wait_at(at, p).or_else(|| {
                let home = self.home.as_ref()?;
                home.by_loop(&self.transit, at, p)
            }),
            Aim::Circle(circle) => self.transit.way_to_circle(at, &circle),
            Aim::Round => {
                let circle = self.waits_for_room(at).map(|c| vec![Move::Loiter(c)]);
                circle.or_else(|| self.transit.way_round(at))
            }
            Aim::Trace => self.way_along(at),
            _ => None,
        }
    }

    /// What follows a circle: the same again; of who had no way to where it is to go another way
    /// there, from a third of the circle on each time, since each pose has ways of its own.
    fn circled(&mut self, at: &Place, circle: Segment) -> Vec<Move> {
        if !self.stranded {
            return vec![Move::Loiter(circle)];
        }
        if let Some(moves) = self.way_to_aim(at) {
            self.stranded = false;
            return moves;
        }
        vec![Move::Loiter(Segment {
            start: at.pose,
            length_m: TAU / (3.0 * circle.curvature_per_m.abs()),
            ..circle
        })]
    }

    /// Appends a move to the track.
    fn push(&mut self, at: &Place, step: Move) -> Place {
        let end = self.transit.end_of(at, &step);
        let coverage_loop = &self.transit.coverage_loop;
        let kind = match step {
            Move::Serve(visit) => {
                let cell = usize::from(visit.cell);
                self.track
                    .extend(&coverage_loop.curve(cell, visit.direction));
                Kind::Serve(visit)
            }
            Move::Rest(visit, curve) => {
                self.track.extend(&curve);
                Kind::Serve(visit)
            }
            Move::Pass(cell, direction) => {
                self.track
                    .extend(&coverage_loop.curve(usize::from(cell), direction));
                Kind::Pass(cell, direction)
            }
            Move::Route(curve) => {
                self.track.extend(&curve);
                Kind::Route
            }
            Move::Piece(piece, to_m) => {
                let from_m = to_m - piece.length_m;
                let mut curve = Curve::empty();
                curve.push(piece);
                self.track.extend(&curve);
                self.is_on_track(to_m);
                Kind::Piece { from_m, to_m }
            }
            Move::Loiter(circle) => {
                let mut curve = Curve::empty();
                curve.push(circle);
                self.track.extend(&curve);
                Kind::Loiter(circle)
            }
        };
        self.stretches.push_back(Stretch {
            kind,
            end_m: self.track.end_m(),
            end,
        });
        end
    }

    /// Where the UAV is on a track that has just been made anew.
    fn restart(&mut self, percept: &Percept) -> Option<Offset> {
        self.replan = false;
        let pose = self.flown_air().over_ground(percept.pose);
        self.track.advance(&pose, WINDOW_M)
    }

    /// Reports the end of the legs or of the given flight, once.
    fn report_end(&mut self, events: &mut Vec<Event>) {
        let is_left = |s: &Stretch| s.kind.visit().is_some();
        let legs = || self.queue.is_empty() && !self.stretches.iter().any(is_left);
        let is_detour_flown = self.aim == Aim::Detour && !self.is_given_left();
        if is_detour_flown && !self.detour_reported {
            self.detour_reported = true;
            events.push(Event::DetourFlown);
        }
        let are_flown = match self.aim {
            Aim::Legs => legs(),
            Aim::Given => !self.is_given_left(),
            Aim::Detour => is_detour_flown && legs(),
            Aim::Hold | Aim::Point(_) | Aim::Circle(_) | Aim::Round | Aim::Trace | Aim::Follow => {
                false
            }
        };
        if are_flown && !self.end_reported {
            self.end_reported = true;
            events.push(Event::PlanDone);
        }
    }
}

#[cfg(test)]
mod tests;
