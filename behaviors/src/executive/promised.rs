//! Flies only what was promised to others: at one height with them (D2.7 §1.3).
//!
//! The track is what is in force: a flight with a time for each place, and at its end a
//! circle for ever, the contingency. Nothing is appended that was not agreed; where nothing
//! was agreed in time the circle is flown, again and again, and the flight goes on from
//! there. What this UAV would rather fly is asked from [`Executive::extensions`]; whether
//! it may, is settled among the peers, and then [`Executive::agree`] puts it on the track.
//!
//! | what happens | what is flown | what is wanted |
//! |---|---|---|
//! | it stands ready to be launched | nothing | to take off on the way to its first cell, or off the place where cells are still to be given |
//! | first percept in the air without that, or off the track | a circle from here, imposed on others | all that the goal asks for |
//! | an extension is agreed | it, then its circle | what follows it |
//! | another goal | as before | to turn off as soon as can be, but after what both goals share |
//! | nothing agreed until the track ends | the circle | to leave the circle, at its end or across |
//!
//! # Guarantees
//! In still air a UAV is at the place that was promised for a moment within what following
//! strays. A circle keeps the tracking margin from the zones, or an extension that ends in
//! it is not offered.
//!
//! # Complexity
//! Extensions cost a few hundred metres of the way that the goal asks for, from three
//! places at most, and a proof of clearance for each stretch.

mod extensions;
mod held;
mod launcher;

use super::transit::{CellVisit, Move, Place};
use super::{Aim, Executive, Kind, Played, Stretch};
use crate::event::Event;
use crate::percept::Percept;
use crate::reactive::air::{self, Air};
use crate::reactive::envelope::{Envelope, is_finite};
use crate::reactive::follow::{HORIZON_S, Offset};
use crate::reactive::promise::{CATCH_UP_S, MOST_SHARE};
use crate::setpoint::Setpoint;
use skein_flight::separation::detour::stretches;
use skein_flight::separation::motion::{STRETCHES_MAX, heading_e7, to_mm, to_signed_mm};
use skein_flight::separation::{End, MotionPlan, Stretch as Promised};
use skein_geometry::frame::Pose;
use skein_geometry::math::TAU;
use skein_geometry::{Curve, Segment};
use std::collections::{BTreeMap, VecDeque};

/// How far ahead a flight is promised, seconds: two of them that may meet within it, and the
/// circle at its end, are nearly always in each other's earshot.
pub const PROMISED_S: f64 = 9.0;

/// And at most, where there is no room for a circle earlier, seconds.
pub const PROMISED_MOST_S: f64 = 20.0;

/// What is promised is lengthened when it lasts no longer than this, seconds: several
/// exchanges of messages before it ends.
const REFILL_S: f64 = 5.5;

/// The circle of the contingency is flown with this many times the least radius, so that
/// following it has authority on both sides.
pub const CIRCLE_RADII: f64 = 1.2;

/// What flying by promises needs to know.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Contingency {
    /// Where on the track it has to be at some time: arc length, metres, and milliseconds.
    schedule: Option<(f64, u64)>,
    /// The circle after the end of the track: 1/m, positive to the left.
    bend_per_m: f64,
    /// What of the track beyond this arc length is not wanted any more, metres.
    wanted_m: f64,
    /// What is in force was imposed, and is to be told.
    imposed: bool,
    /// It waits where the goal wants it to.
    arrived: bool,
    /// Counts goals that want another flight than the one before.
    goals: u32,
    /// What of the way that was agreed in part comes next. From a place on a turn a new way
    /// to the same cell may be a circle longer, for a rounding.
    rest: Vec<Move>,
    /// The circle in which that ends.
    rest_arrives: Option<f64>,
    /// Cells of the goal that it cannot reach from where it looked lately, and since when.
    unreached: BTreeMap<u16, u64>,
    /// Where it stands ready to be launched, and no flight from there is agreed.
    stands: Option<Pose>,
    /// No way from there was clear when it was looked for last.
    held_up: bool,
}

impl Contingency {
    /// Nothing is flown yet.
    pub(super) fn new() -> Self {
        Self {
            schedule: None,
            bend_per_m: 0.0,
            wanted_m: f64::INFINITY,
            imposed: false,
            arrived: false,
            goals: 0,
            rest: Vec::new(),
            rest_arrives: None,
            unreached: BTreeMap::new(),
            stands: None,
            held_up: false,
        }
    }
}

/// A flight that could follow on what is in force.
#[derive(Clone, Debug, PartialEq)]
pub struct Extension {
    /// All of it, with what is in force until it turns off.
    pub plan: MotionPlan,
    /// When it turns off, milliseconds.
    pub branch_ms: u64,
    cut: Place,
    cut_m: f64,
    moves: Vec<Move>,
    bend_per_m: f64,
    arrives: bool,
    /// Which of the goals it was made for.
    goals: u32,
    rest: Vec<Move>,
    rest_arrives: Option<f64>,
}

impl Extension {
    /// Whether it gets to a cell that is to be seen, or to where it is to wait.
    #[must_use]
    pub fn gets_there(&self) -> bool {
        self.arrives || self.moves.iter().any(|step| step.serves().is_some())
    }
}

impl Executive {
    /// The same, flying by promises.
    #[must_use]
    pub fn with_promises(mut self) -> Self {
        let stray_m = self.transit.tracking_error_m;
        let zones = std::sync::Arc::clone(self.transit.router.zones());
        self.envelope = Envelope::new(self.transit.airframe, zones, stray_m);
        self.contingency = Some(Contingency::new());
        self
    }

    /// Whether what is in force was imposed since this was last asked, because the UAV was
    /// not, or not where, it was to be.
    pub fn take_imposed(&mut self) -> bool {
        self.contingency
            .as_mut()
            .is_some_and(|c| core::mem::replace(&mut c.imposed, false))
    }

    /// Whether the airframe still flies what others were promised before this computer began
    /// anew: it knows neither that way nor whom it keeps clear of, so it lets it be flown to the
    /// circle at its end, which the percept tells.
    #[must_use]
    pub fn leaves_alone(&self, percept: &Percept) -> bool {
        let begins = self
            .contingency
            .as_ref()
            .is_some_and(|c| c.schedule.is_none());
        begins && percept.failsafe && percept.circles_in_ms > 0
    }

    /// Answers a percept as [`Executive::step`] does, on what is in force alone.
    pub(super) fn step_promised(
        &mut self,
        percept: &Percept,
        is_open: &dyn Fn(u16) -> bool,
        mut events: Vec<Event>,
    ) -> (Setpoint, Vec<Event>) {
        self.report_seen(percept, is_open, &mut events);
        let mut offset = self.progress(percept);
        let scheduled = self.contingency.as_ref().and_then(|c| c.schedule);
        if scheduled.is_none() || self.is_off(offset, percept.time_ms) {
            offset = self.goes_on(percept);
            if offset.is_none() {
                self.impose(percept);
            }
        }
        self.replan = false;
        self.count_promised_misses(is_open, &mut events);
        self.circle_on();
        self.report_end(&mut events);
        let still = Offset {
            cross_m: 0.0,
            heading_rad: 0.0,
        };
        let airspeed_mps = self.catching_up_mps(percept.time_ms);
        let air = Air {
            airspeed_mps,
            ..*self.transit.air()
        };
        let limit = self.transit.airframe.max_turn_rate_radps(airspeed_mps);
        let steps = air::steps(&self.track, offset.unwrap_or(still), &air, limit);
        let bend_per_m = self.contingency.as_ref().map_or(0.0, |c| c.bend_per_m);
        let wanted = Setpoint {
            airspeed_mps,
            height_m: self.passes_at_m(percept, bend_per_m),
            ..self.setpoint(percept, steps)
        };
        let setpoint = self.envelope.check(percept, wanted);
        self.played = Some(Played {
            percept: *percept,
            steps: setpoint.steps.clone(),
            airspeed_mps: setpoint.airspeed_mps,
            gimbal: Vec::new(),
        });
        (setpoint, events)
    }

    /// The airspeed that takes an error along the track away, m/s.
    fn catching_up_mps(&self, at_ms: u64) -> f64 {
        let speed_mps = self.speed_mps();
        let behind_m = self.scheduled_m(at_ms) - self.track.at_m();
        let most_mps = MOST_SHARE * speed_mps;
        let faster_mps = most_mps.min(self.in_turns_mps(speed_mps) - speed_mps);
        speed_mps + (behind_m / CATCH_UP_S).clamp(-most_mps, faster_mps.max(0.0))
    }

    /// The airspeed at which the turns ahead can just be flown, m/s: who hurries in them
    /// flies wide, and is later still.
    fn in_turns_mps(&self, speed_mps: f64) -> f64 {
        let ahead = self.track.ahead(speed_mps * HORIZON_S);
        let bends = ahead.segments().iter().map(|s| s.curvature_per_m.abs());
        let bend_per_m = bends.fold(0.0, f64::max);
        let limit_per_m = 1.0 / self.transit.airframe.turn_radius_m(speed_mps);
        if bend_per_m > 0.0 {
            speed_mps * (limit_per_m / bend_per_m).sqrt()
        } else {
            f64::INFINITY
        }
    }

    /// The arc length at which it has to be at a time, metres.
    fn scheduled_m(&self, at_ms: u64) -> f64 {
        let schedule = self.contingency.as_ref().and_then(|c| c.schedule);
        let (at_m, since_ms) = schedule.unwrap_or((self.track.at_m(), at_ms));
        #[allow(clippy::cast_precision_loss, reason = "far below 2^53 milliseconds")]
        let since_s = at_ms.saturating_sub(since_ms) as f64 / 1e3;
        at_m + self.speed_mps() * since_s
    }

    /// A circle from here is in force, whatever others say.
    fn impose(&mut self, percept: &Percept) {
        self.requeue();
        self.track.clear();
        let at = Place {
            pose: percept.pose,
            boundary: None,
        };
        // Where its airframe flies a circle that others were promised, that stays.
        let on_circle = percept.failsafe && percept.circles_in_ms == 0;
        let promised_per_m = percept.circles_per_m.filter(|_| on_circle);
        let bend_per_m = promised_per_m.unwrap_or_else(|| match self.transit.stay(&at) {
            Move::Loiter(circle) => circle.curvature_per_m,
            _ => 1.0 / self.circle_radius_m(),
        });
        let schedule = Some((self.track.at_m(), percept.time_ms));
        let goals = self.contingency.as_ref().map_or(0, |c| c.goals + 1);
        self.contingency = Some(Contingency {
            schedule,
            bend_per_m,
            imposed: true,
            goals,
            ..Contingency::new()
        });
        self.push_circle(at);
        let _ = self.track.advance(&percept.pose, 0.0);
    }

    /// How far anybody of this mission gets on what it promises, at the fastest cruise of
    /// them all, metres.
    #[must_use]
    pub fn reach_m(&self, fastest_mps: f64) -> f64 {
        reach_m(fastest_mps, self.transit.turn_radius_m())
    }

    fn circle_radius_m(&self) -> f64 {
        CIRCLE_RADII * self.transit.turn_radius_m()
    }

    /// One more circle of the contingency, at whose end it is where it began.
    fn push_circle(&mut self, at: Place) {
        let bend_per_m = self.contingency.as_ref().map_or(0.0, |c| c.bend_per_m);
        let circle = circle_at(&at.pose, bend_per_m);
        let mut curve = Curve::empty();
        curve.push(circle);
        self.track.extend(&curve);
        self.stretches.push_back(Stretch {
            kind: Kind::Loiter(circle),
            end_m: self.track.end_m(),
            end: at,
        });
    }

    /// Where the track ends before a setpoint does, the circle follows.
    fn circle_on(&mut self) {
        let least_m = self.transit.airframe.max_mps * (HORIZON_S + 0.1);
        while self.track.left_m() < least_m {
            let Some(end) = self.stretches.back().map(|s| s.end) else {
                return;
            };
            self.push_circle(end);
        }
    }

    /// Takes stretches off that are behind; cells flown and not seen are wanted again.
    fn count_promised_misses(&mut self, is_open: &dyn Fn(u16) -> bool, events: &mut Vec<Event>) {
        while let Some(front) = self.stretches.front().copied() {
            if front.end_m > self.track.at_m() {
                return;
            }
            self.stretches.pop_front();
            let visit = front.kind.visit();
            let missed = visit.filter(|v| is_open(v.cell) && !self.recent.contains(&v.cell));
            let Some(visit) = missed else { continue };
            self.passes.miss(&visit);
            let tries = visit.tries + 1;
            if tries >= super::MAX_TRIES {
                let cells = vec![visit.cell];
                events.push(Event::Refused { cells });
                continue;
            }
            self.unwant_beyond(0, true);
            self.queue.push_front(CellVisit { tries, ..visit });
        }
    }

    /// What lies on the track after the first `kept` stretches is only flown if nothing
    /// else is agreed in time; its cells go back to the queue where they are to be served.
    pub(super) fn unwant_beyond(&mut self, kept: usize, requeue: bool) {
        let all = kept >= self.flight_stretches();
        let wanted_m = match kept
            .checked_sub(1)
            .and_then(|last| self.stretches.get(last))
        {
            _ if all => f64::INFINITY,
            Some(last) => last.end_m,
            None => self.track.at_m(),
        };
        for s in self.stretches.iter_mut().skip(kept).rev() {
            if let Kind::Serve(visit) = s.kind {
                s.kind = Kind::Pass(visit.cell, visit.direction);
                if requeue {
                    self.queue.push_front(visit);
                }
            }
        }
        if let Some(c) = &mut self.contingency {
            c.wanted_m = wanted_m;
            c.goals += u32::from(!all);
            if !all {
                c.rest.clear();
            }
        }
    }

    /// How many stretches of what is in force lead where `visits` do, and which visits then
    /// wait: those agreed are flown in their order, whatever circle comes before them.
    pub(super) fn agreed_continued(
        &self,
        mut visits: VecDeque<CellVisit>,
        is_open: &dyn Fn(u16) -> bool,
    ) -> (usize, VecDeque<CellVisit>) {
        visits.retain(|visit| is_open(visit.cell));
        let mut kept = 0;
        for (i, s) in self.stretches.iter().enumerate() {
            let Some(visit) = s.kind.visit() else {
                continue;
            };
            let place = (visit.cell, visit.direction);
            let next = visits.front().map(|next| (next.cell, next.direction));
            if next == Some(place) {
                visits.pop_front();
            } else if is_open(visit.cell) {
                break;
            }
            kept = i + 1;
        }
        // What comes next of a way that was agreed in part leads there.
        let rest = self.contingency.as_ref().map(|c| c.rest.as_slice());
        let leads_to = rest.unwrap_or_default().iter().find_map(Move::serves);
        let same = |next: &CellVisit| leads_to.is_some_and(|v| is_same(&v, next));
        if visits.front().is_some_and(same) {
            return (self.flight_stretches(), visits);
        }
        if kept == 0
            && let (Some(front), Some(next)) = (self.stretches.front(), visits.front())
            && front.kind.cell() == Some((next.cell, next.direction))
        {
            // It is in the cell already, on its way to another one.
            visits.pop_front();
            kept = 1;
        }
        (kept, visits)
    }

    /// The aim is another one: what was offered for the last is not wanted.
    pub(super) fn aim_anew(&mut self) {
        if let Some(c) = &mut self.contingency {
            c.arrived = false;
            c.goals += 1;
            c.rest.clear();
        }
    }

    /// Whether there is something to ask others for: at a time, in milliseconds.
    #[must_use]
    pub fn wants_more(&self, at_ms: u64) -> bool {
        if self.stands() {
            let has_cells = self.aim == Aim::Legs && !self.queue.is_empty();
            return has_cells || self.clears_launcher();
        }
        // On the ground there is no place yet from which to turn off.
        let begun = |c: &&Contingency| c.schedule.is_some_and(|(_, from_ms)| from_ms <= at_ms);
        let Some(c) = self.contingency.as_ref().filter(begun) else {
            return false;
        };
        let at_m = self.scheduled_m(at_ms);
        let end_m = self.flight_end_m();
        let is_unwanted = c.wanted_m < end_m;
        let is_short = end_m - at_m < REFILL_S * self.speed_mps();
        (is_unwanted || is_short) && self.is_under_way()
    }

    /// Whether there is anything to fly to that is not agreed yet.
    #[must_use]
    pub fn is_under_way(&self) -> bool {
        match self.aim {
            Aim::Hold
            | Aim::Circle(_)
            | Aim::Round
            | Aim::Trace
            | Aim::Follow
            | Aim::Given
            | Aim::Detour => false,
            Aim::Legs => !self.queue.is_empty(),
            Aim::Point(_) => self.contingency.as_ref().is_some_and(|c| !c.arrived),
        }
    }

    /// Whether it circles at a time, in milliseconds: all that was agreed is flown.
    #[must_use]
    pub fn circles(&self, at_ms: u64) -> bool {
        !self.stands() && self.flight_end_m() <= self.scheduled_m(at_ms)
    }

    /// Where on the track the circle of the contingency begins, metres; the beginning of the
    /// present one where it circles already.
    pub(super) fn flight_end_m(&self) -> f64 {
        match self.stretches.get(self.flight_stretches()) {
            Some(Stretch {
                kind: Kind::Loiter(circle),
                end_m,
                ..
            }) => end_m - circle.length_m,
            _ => self.track.end_m(),
        }
    }

    /// How many stretches come before the circles at the end of the track.
    pub(super) fn flight_stretches(&self) -> usize {
        let circles = self.stretches.iter().rev();
        let circles = circles.take_while(|s| matches!(s.kind, Kind::Loiter(_)));
        self.stretches.len() - circles.count()
    }

    /// What is in force, from a time on.
    #[must_use]
    pub fn in_force(&self, at_ms: u64) -> Option<MotionPlan> {
        let c = self.contingency.as_ref().filter(|c| c.schedule.is_some())?;
        let from_m = self.scheduled_m(at_ms).min(self.track.end_m());
        let flight = self.track.between(from_m, self.flight_end_m());
        self.plan(at_ms, self.on_track(from_m)?, &flight, c.bend_per_m)
    }

    /// Whether an extension that was offered still leads where the goal does.
    #[must_use]
    pub fn suits(&self, extension: &Extension) -> bool {
        let same_goal = self.contingency.as_ref().map(|c| c.goals) == Some(extension.goals);
        let mut queued = self.queue.iter().map(|visit| (visit.cell, visit.direction));
        let served = extension.moves.iter().filter_map(Move::serves);
        let mut served = served.map(|visit| (visit.cell, visit.direction));
        same_goal && served.all(|visit| queued.any(|q| q == visit))
    }

    /// An extension was agreed: it is flown.
    pub fn agree(&mut self, extension: Extension) {
        self.leave_launcher(extension.plan.start_ms);
        while self.track.end_m() < extension.cut_m {
            let Some(end) = self.stretches.back().map(|s| s.end) else {
                return;
            };
            self.push_circle(end);
        }
        self.cut(extension.cut_m, extension.cut);
        let mut at = extension.cut;
        for step in extension.moves {
            let step = match (step.serves(), step) {
                (Some(visit), step) => match (place_in(&self.queue, &visit), step) {
                    (Some(i), step) => {
                        self.queue.remove(i);
                        step
                    }
                    (None, Move::Rest(_, rest)) => Move::Route(rest),
                    (None, _) => Move::Pass(visit.cell, visit.direction),
                },
                (None, step) => step,
            };
            at = self.push(&at, step);
        }
        if let Some(c) = &mut self.contingency {
            c.bend_per_m = extension.bend_per_m;
            c.wanted_m = f64::INFINITY;
            c.arrived = extension.arrives;
            c.rest = extension.rest;
            c.rest_arrives = extension.rest_arrives;
        }
        self.circle_on();
    }

    /// Ends the track at an arc length.
    fn cut(&mut self, cut_m: f64, at: Place) {
        while let Some(last) = self.stretches.back() {
            let begins_m = self
                .stretches
                .len()
                .checked_sub(2)
                .and_then(|i| self.stretches.get(i))
                .map_or(f64::NEG_INFINITY, |before| before.end_m);
            if last.end_m <= cut_m + 1e-6 {
                break;
            }
            if begins_m >= cut_m - 1e-6 {
                self.stretches.pop_back();
                continue;
            }
            if let Some(last) = self.stretches.back_mut() {
                last.end_m = cut_m;
                last.end = at;
            }
            break;
        }
        self.track.truncate(cut_m);
    }

    /// The pose at an arc length, on the circle where that lies beyond the flight.
    fn on_track(&self, at_m: f64) -> Option<Pose> {
        let bend_per_m = self.contingency.as_ref()?.bend_per_m;
        let beyond_m = at_m - self.track.end_m();
        if beyond_m <= 0.0 {
            return self.track.pose_at(at_m);
        }
        Some(circle_at(&self.track.end()?, bend_per_m).pose_at(beyond_m))
    }

    /// A flight as it is promised: none if it takes more stretches than that holds.
    fn plan(&self, at_ms: u64, start: Pose, flight: &Curve, bend_per_m: f64) -> Option<MotionPlan> {
        let speed_mps = self.speed_mps();
        let mut merged: Vec<Promised> = Vec::new();
        for s in stretches(flight, speed_mps) {
            match merged.last_mut() {
                Some(last) if last.radius_mm == s.radius_mm => last.length_mm += s.length_mm,
                _ => merged.push(s),
            }
        }
        (merged.len() <= STRETCHES_MAX).then(|| MotionPlan {
            start_ms: at_ms,
            east_mm: to_signed_mm(start.east_m),
            north_mm: to_signed_mm(start.north_m),
            heading_e7: heading_e7(start.heading_rad),
            stretches: merged,
            end: End::Loiter {
                radius_mm: to_signed_mm(1.0 / bend_per_m),
                airspeed_mmps: to_mm(speed_mps),
            },
        })
    }

    /// Whether a pose is so far off the track that it is not followed any more.
    fn is_lost(&self, offset: Option<Offset>) -> bool {
        offset.is_none_or(|o| {
            o.cross_m.abs() > super::LOST_M || o.heading_rad.abs() > super::LOST_RAD
        })
    }

    /// Whether it flies by promises, and a percept has something to say of the flight.
    pub(super) fn promises(&self, percept: &Percept) -> bool {
        self.contingency.is_some() && is_finite(&percept.pose) && percept.takes_off_in_ms == 0
    }
}

/// Whether two visits are to one cell in one direction.
fn is_same(a: &CellVisit, b: &CellVisit) -> bool {
    (a.cell, a.direction) == (b.cell, b.direction)
}

/// Where in a queue a visit is.
fn place_in(queue: &VecDeque<CellVisit>, visit: &CellVisit) -> Option<usize> {
    queue.iter().position(|q| is_same(q, visit))
}

/// How far a UAV gets from where it is on what it promises, its circle included, metres.
#[must_use]
pub fn reach_m(airspeed_mps: f64, turn_radius_m: f64) -> f64 {
    PROMISED_MOST_S * airspeed_mps + 2.0 * CIRCLE_RADII * turn_radius_m
}

/// A whole circle that begins at a pose.
fn circle_at(pose: &Pose, bend_per_m: f64) -> Segment {
    Segment {
        start: *pose,
        curvature_per_m: bend_per_m,
        length_m: TAU / bend_per_m.abs(),
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn whole_ms(seconds: f64) -> u64 {
    (seconds * 1e3) as u64
}

#[cfg(test)]
mod tests;
