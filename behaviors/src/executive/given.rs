//! A flight that was planned before: lines and arcs over the ground, flown from place to
//! place at an airspeed (D2.7 §1.2.3, executive layer; the trajectories are §2.4's).
//!
//! How far it can be flown is found out when it is given, and again when the wind changes:
//! up to the first piece that lacks its proof, bends tighter than the airframe can follow
//! or leads against too strong a wind. There, or before where there is room for a circle,
//! the UAV waits. The pieces go onto the track one by one like cells, so following, proof
//! and envelope are those of every other goal.
//!
//! # Guarantees
//! Nothing of the flight is left out: whoever comes off it returns to where it left it.

use super::transit::{Move, Place, Transit};
use super::{Aim, Executive, Kind, ON_TRACK_M, ON_TRACK_RAD};
use crate::event::{Event, Unflyable};
use crate::reactive::air::Air;
use serde::{Deserialize, Serialize};
use skein_flight::airframe::Airframe;
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::Pose;
use skein_geometry::math::wrap_pi;
use skein_geometry::{Curve, Segment};

/// Distance of the places at which a circle is tried before a flight must stop, metres:
/// half a second of flight or less.
const STOP_STEP_M: f64 = 5.0;

/// What is left out of a flight at its end, metres: rounding.
const ROUNDING_M: f64 = 1e-6;

/// To this the place is found where a proof ends, metres.
const PROOF_STEP_M: f64 = 1e-3;

/// Bends may be tighter than what can be followed by this share: rounding.
const ROUNDING: f64 = 1e-6;

/// Places back along a flight at which a UAV that cannot wait at its end tries to.
const WAITING_TRIES: u8 = 24;

/// A trajectory to be flown: a curve over the ground, and how fast.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GivenFlight {
    /// Lines and arcs that join without a bend.
    pub curve: Curve,
    /// The airspeed that it was planned for, m/s: at most the cruise is flown, and no more
    /// than its turns allow in the wind.
    pub airspeed_mps: f64,
    /// Whether the UAV lands at its end: then no room to wait is asked for there, and the
    /// envelope does not look beyond it.
    pub lands: bool,
}

/// How far a flight can be flown, and why no farther.
type Reach = (f64, Option<Unflyable>);

/// A flight and how much of it was flown.
#[derive(Clone, Debug)]
pub(super) struct Given {
    flight: GivenFlight,
    /// Arc length at the end of each piece, metres.
    ends_m: Vec<f64>,
    /// How far its pieces join and are proved clear.
    proved: Reach,
    /// Arc length of what is flown or on the track, metres.
    next_m: f64,
    /// How far it will be flown, and why no farther.
    reach: Reach,
}

impl Given {
    fn new(flight: GivenFlight, transit: &Transit) -> Self {
        let mut end_m = 0.0;
        let pieces = flight.curve.segments().iter();
        let ends_m = pieces.map(|s| {
            end_m += s.length_m;
            end_m
        });
        let ends_m: Vec<f64> = ends_m.collect();
        let mut given = Self {
            ends_m,
            flight,
            proved: (0.0, None),
            next_m: 0.0,
            reach: (0.0, None),
        };
        let is_clear = |s: Segment| transit.is_cleared(&at(s.start), &Move::Piece(s, 0.0));
        given.proved = given.until(|before, s| {
            if !joins(before, s) {
                return Some(Unflyable::Gap);
            }
            (!is_clear(*s)).then_some(Unflyable::NearZone)
        });
        if let (from_m, Some(Unflyable::NearZone)) = given.proved
            && let Some(s) = given.piece_at(from_m)
        {
            given.proved.0 += longest_m(&s, is_clear);
        }
        given
    }

    /// The piece that begins or goes on so many metres along the flight.
    fn piece_at(&self, at_m: f64) -> Option<Segment> {
        let is_behind = |end_m: &f64| *end_m <= at_m + ROUNDING_M;
        let i = self.ends_m.partition_point(is_behind);
        self.flight.curve.segments().get(i).copied()
    }

    /// Where the first piece begins that something keeps from being flown.
    fn until(&self, why: impl Fn(Option<&Segment>, &Segment) -> Option<Unflyable>) -> Reach {
        let mut before = None;
        let mut from_m = 0.0;
        for (s, end_m) in self.flight.curve.segments().iter().zip(&self.ends_m) {
            if let Some(why) = why(before, s) {
                return (from_m, Some(why));
            }
            (before, from_m) = (Some(s), *end_m);
        }
        (from_m, None)
    }

    /// The airspeed at which all bends are followed that can be, m/s.
    fn airspeed_mps(&self, airframe: &Airframe, wind: Wind, radius_m: f64) -> f64 {
        let tightest_m = tightest_m(airframe, wind);
        let bends = self.flight.curve.segments().iter();
        let bends = bends.map(|s| 1.0 / s.curvature_per_m.abs());
        let followed = bends.filter(|r| *r >= tightest_m * (1.0 - ROUNDING));
        let least_m = followed.fold(radius_m, f64::min);
        let wanted_mps = self.flight.airspeed_mps.min(airframe.cruise_mps);
        wanted_mps.min(airspeed_for_turns_mps(airframe, wind, least_m))
    }

    /// How far it can be flown in this air.
    fn reach_in(&self, transit: &Transit) -> Reach {
        let air = transit.air();
        let most_per_m = (1.0 + ROUNDING) / tightest_m(&transit.airframe, air.wind);
        let weather = self.until(|_, s| {
            let one = single(*s);
            if s.curvature_per_m.abs() > most_per_m {
                return Some(Unflyable::Bend);
            }
            (!air.air_length_m(&one).is_finite()).then_some(Unflyable::Wind)
        });
        let (first, second) = (self.proved, weather);
        let (until_m, why) = if second.0 < first.0 { second } else { first };
        // What is flown or on the track already is behind.
        (until_m.max(self.next_m), why)
    }

    /// The piece that follows what is on the track, and where along the flight it ends.
    fn next(&self) -> Option<(Segment, f64)> {
        if self.next_m >= self.reach.0 - ROUNDING_M {
            return None;
        }
        let is_behind = |end_m: &f64| *end_m <= self.next_m + ROUNDING_M;
        let i = self.ends_m.partition_point(is_behind);
        let (s, end_m) = (self.flight.curve.segments().get(i)?, self.ends_m.get(i)?);
        let to_m = end_m.min(self.reach.0);
        let from_m = s.length_m - (end_m - self.next_m);
        let piece = Segment {
            start: s.pose_at(from_m),
            length_m: to_m - self.next_m,
            ..*s
        };
        Some((piece, to_m))
    }

    /// What is still to be flown after the first so many metres.
    fn rest(&self, from_m: f64) -> Curve {
        let (until, _) = self.flight.curve.split_at(self.reach.0);
        until.split_at(from_m).1
    }
}

/// How much of a piece is clear from its beginning, metres, to the millimetre.
fn longest_m(s: &Segment, is_clear: impl Fn(Segment) -> bool) -> f64 {
    let (mut low_m, mut high_m) = (0.0, s.length_m);
    while high_m - low_m > PROOF_STEP_M {
        let length_m = f64::midpoint(low_m, high_m);
        if is_clear(Segment { length_m, ..*s }) {
            low_m = length_m;
        } else {
            high_m = length_m;
        }
    }
    low_m
}

/// Whether a piece is one, and follows on the one before.
fn joins(before: Option<&Segment>, s: &Segment) -> bool {
    let end = s.end();
    let sum = s.start.east_m + s.start.north_m + end.east_m + end.north_m + end.heading_rad;
    let is_piece = sum.is_finite() && s.length_m >= 0.0 && s.curvature_per_m.is_finite();
    is_piece && before.is_none_or(|b| is_near(&b.end(), &s.start))
}

/// Whether two poses are one for following.
fn is_near(a: &Pose, b: &Pose) -> bool {
    let off_m = (a.position() - b.position()).norm();
    let off_rad = wrap_pi(a.heading_rad - b.heading_rad).abs();
    off_m < ON_TRACK_M && off_rad < ON_TRACK_RAD
}

fn at(pose: Pose) -> Place {
    Place {
        pose,
        boundary: None,
    }
}

fn single(s: Segment) -> Curve {
    let mut curve = Curve::empty();
    curve.push(s);
    curve
}

/// The airspeed at which turns of a radius over the ground can be followed in a wind, in
/// calm air up to the steepest bank, m/s.
fn airspeed_for_turns_mps(airframe: &Airframe, wind: Wind, radius_m: f64) -> f64 {
    if Air::calm(airframe.cruise_mps).with(wind).is_calm() {
        return (radius_m / airframe.turn_radius_m(1.0)).sqrt();
    }
    airframe.airspeed_for_turns_mps(radius_m, wind.speed_mps())
}

/// The tightest turn over the ground that can be followed in a wind, as slowly as is
/// commanded, metres.
fn tightest_m(airframe: &Airframe, wind: Wind) -> f64 {
    let least_mps = airframe.least_airspeed_mps();
    if Air::calm(least_mps).with(wind).is_calm() {
        return airframe.turn_radius_m(least_mps);
    }
    airframe.ground_turn_radius_m(least_mps, wind.speed_mps())
}

impl Executive {
    /// Takes up a flight; returns whether it is the one that is being flown.
    pub(super) fn give(&mut self, flight: GivenFlight) -> bool {
        if self.aim.gives()
            && let Some(given) = &self.given
            && given.flight == flight
        {
            return true;
        }
        self.take_back();
        self.given = Some(Given::new(flight, &self.transit));
        self.set_air(self.transit.air().wind);
        false
    }

    /// Forgets the flight that was given.
    pub(super) fn take_back(&mut self) {
        if self.given.take().is_none() {
            return;
        }
        // What of it is on the track is flown until the next step, as any other way.
        for s in &mut self.stretches {
            if matches!(s.kind, Kind::Piece { .. }) {
                s.kind = Kind::Route;
            }
        }
        self.set_air(self.transit.air().wind);
    }

    /// The airspeed of the flight that was given, if there is one, m/s.
    pub(super) fn given_airspeed_mps(&self, wind: Wind) -> Option<f64> {
        let radius_m = self.transit.router.limits().turn_radius_m;
        let given = self.given.as_ref()?;
        Some(given.airspeed_mps(&self.transit.airframe, wind, radius_m))
    }

    /// Finds out anew how far the given flight can be flown, and tells where it ends early.
    pub(super) fn assess_given(&mut self) {
        let Some(given) = &self.given else { return };
        let (until_m, mut why) = given.reach_in(&self.transit);
        let goes_on = !given.flight.lands && until_m > given.next_m;
        if why.is_none() && goes_on && self.is_dead_end(given, until_m) {
            why = Some(Unflyable::NoRoom);
        }
        let stop_m = why.map_or(until_m, |_| self.stop_before_m(given, until_m));
        self.cut_short((stop_m, why));
    }

    /// Whether nobody can wait so far along a flight, nor find a way from there to where it
    /// can.
    fn is_dead_end(&self, given: &Given, at_m: f64) -> bool {
        let end = given.flight.curve.pose_at(at_m).map(at);
        end.is_some_and(|end| {
            !self.transit.has_room(&end.pose) && self.back_from(given, &end, at_m).is_none()
        })
    }

    /// The last place up to `until_m` at which there is room for a circle; where it is now
    /// if there is none.
    fn stop_before_m(&self, given: &Given, until_m: f64) -> f64 {
        let has_room = |m: f64| {
            let pose = given.flight.curve.pose_at(m);
            pose.is_some_and(|pose| self.transit.has_room(&pose))
        };
        let mut at_m = until_m;
        while at_m > given.next_m {
            if has_room(at_m) {
                return at_m;
            }
            at_m -= STOP_STEP_M;
        }
        given.next_m
    }

    /// From now on the given flight reaches so far.
    fn cut_short(&mut self, reach: Reach) {
        let Some(given) = &mut self.given else { return };
        if given.reach.0 < reach.0 {
            self.end_reported = false;
        }
        let is_news = given.reach != reach;
        given.reach = reach;
        if let (at_m, Some(why)) = reach
            && is_news
        {
            self.pending.push(Event::CutShort { at_m, why });
        }
    }

    /// What follows of the given flight at the end of the track, with the way to it.
    pub(super) fn given_moves(&mut self, from: &Place) -> Option<Vec<Move>> {
        let given = self.given.as_ref().filter(|_| self.aim.gives())?;
        let (piece, to_m) = given.next()?;
        let step = Move::Piece(piece, to_m);
        if is_near(&from.pose, &piece.start) {
            return Some(vec![step]);
        }
        match self.transit.route(from.pose, piece.start) {
            Ok(way) => Some(vec![Move::Route(way), step]),
            Err(_) => {
                self.cut_short((given.next_m, Some(Unflyable::NoWay)));
                None
            }
        }
    }

    /// A piece was put on the track: what is next follows it.
    pub(super) fn is_on_track(&mut self, to_m: f64) {
        if let Some(given) = &mut self.given {
            given.next_m = to_m;
        }
    }

    /// A piece of the given flight was not cleared when it was to go onto the track.
    pub(super) fn not_cleared(&mut self) {
        if let Some(given) = &self.given {
            self.cut_short((given.next_m, Some(Unflyable::NearZone)));
        }
    }

    /// Where along the given flight it goes on if all stretches but the first `kept` are
    /// given up, metres.
    fn goes_on_m(&self, given: &Given, kept: usize) -> f64 {
        let first = self.stretches.iter().skip(kept).find_map(|s| {
            let Kind::Piece { from_m, to_m } = s.kind else {
                return None;
            };
            let left_m = (s.end_m - self.track.at_m()).max(0.0);
            Some((to_m - left_m).max(from_m))
        });
        first.unwrap_or(given.next_m)
    }

    /// The track is given up: the flight goes on where the UAV is on it.
    pub(super) fn requeue_given(&mut self) {
        let Some(given) = &self.given else { return };
        let next_m = self.goes_on_m(given, 0);
        if let Some(given) = &mut self.given {
            given.next_m = next_m;
        }
    }

    /// Whether something of a given flight is not on the track yet, or not flown.
    pub(super) fn is_given_left(&self) -> bool {
        self.given.as_ref().is_some_and(|g| g.next().is_some()) || self.has_pieces()
    }

    /// Whether something of a given flight is on the track.
    pub(super) fn has_pieces(&self) -> bool {
        let is_piece = |kind: &Kind| matches!(kind, Kind::Piece { .. });
        self.stretches.iter().any(|s| is_piece(&s.kind))
    }

    /// Whether something of a given flight is not on the track yet.
    pub(super) fn is_given_waiting(&self) -> bool {
        self.given.as_ref().is_some_and(|g| g.next().is_some())
    }

    /// In how many seconds the UAV lands, if all that is left of a given flight is on the
    /// track.
    pub(super) fn lands_in_s(&self) -> Option<f64> {
        let given = self.given.as_ref()?;
        if !given.flight.lands || given.reach.1.is_some() || given.next().is_some() {
            return None;
        }
        let is_piece = |s: &&super::Stretch| matches!(s.kind, Kind::Piece { .. });
        let last = self.stretches.iter().rev().find(is_piece)?;
        Some(self.air_m_until(last.end_m) / self.speed_mps())
    }

    /// Where the given flight will end that goes on from a place after the first `kept`
    /// stretches, and the distance through the air to there, metres.
    pub(super) fn given_ahead(&self, from: &Place, kept: usize) -> Option<(Place, f64)> {
        let given = self.given.as_ref().filter(|_| self.aim.gives())?;
        let rest = given.rest(self.goes_on_m(given, kept));
        let (start, end) = rest.start().zip(rest.end())?;
        let mut air_m = self.transit.air().air_length_m(&rest);
        if !is_near(&from.pose, &start) {
            let way = self.transit.route(from.pose, start).ok()?;
            air_m += self.transit.air().air_length_m(&way);
        }
        Some((at(end), air_m))
    }

    /// The way back along the given flight to a place where there is room to wait.
    pub(super) fn back_to_wait(&self, from: &Place) -> Option<Vec<Move>> {
        let given = self.given.as_ref().filter(|_| self.aim.gives())?;
        // After the legs of a detour it is not on the flight any more.
        let is_piece = |s: &super::Stretch| matches!(s.kind, Kind::Piece { .. });
        let left_it = self.aim == Aim::Detour && !self.stretches.back().is_some_and(is_piece);
        if left_it || self.transit.has_room(&from.pose) {
            return None;
        }
        self.back_from(given, from, given.next_m)
    }

    /// The same from so many metres along it.
    fn back_from(&self, given: &Given, from: &Place, at_m: f64) -> Option<Vec<Move>> {
        let step_m = self.transit.turn_radius_m();
        let back_m = |i: u8| at_m - f64::from(i) * step_m;
        let places = (1..=WAITING_TRIES).map(back_m).filter(|m| *m >= 0.0);
        let poses = places.filter_map(|m| given.flight.curve.pose_at(m));
        let both = poses.flat_map(|pose| [pose.reversed(), pose]);
        let mut roomy = both.filter(|pose| self.transit.has_room(pose));
        roomy.find_map(|pose| {
            let way = self.transit.route(from.pose, pose).ok()?;
            let mut moves = vec![Move::Route(way)];
            moves.extend(self.transit.way_to_loiter(&at(pose)));
            Some(moves)
        })
    }
}

#[cfg(test)]
mod tests;
