//! The way along a contour that no map shows: a road, or the edge of a fire, by what the camera
//! sees of it (D2.7 §3.1, executive layer). The turns are [`skein_flight::tracing`]'s.
//!
//! | what is known of the contour | what is flown |
//! |---|---|
//! | nothing | the coverage loop, round and round |
//! | a piece of it that the UAV saw, or that it was told of | a route onto it, then along it |
//! | what the picture shows, beside it | short arcs along it; those beyond what is shown are laid anew with each look |
//! | it ends, in the picture or unseen | straight on, then arcs that widen |
//! | nothing was found so | back along it, if either way will do; else a route to what was told, or round |
//! | who flies before it along it is far too near | a circle, as in [`super::circuit`] |
//! | an arc comes too near to a zone | a route to where it goes on beyond |
//!
//! # Guarantees
//! No arc is laid that has no proof of the clearance of routes, and of a circle at its end. Equal inputs give equal outputs.
//!
//! # Complexity
//! A percept costs its look times what is kept of the last ones, and some ten arcs.

use super::transit::{Move, Place};
use super::{Aim, Executive, Kind};
use crate::executive::circuit::Gaps;
use crate::percept::Percept;
use skein_flight::tracing::lead::{BEYOND_M, Lead, SEEK_ARCS, seek_arc};
use skein_flight::tracing::thread::{Look, Mark, Thread};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::cos;
use skein_geometry::polyline::{length_m, nearest};
use skein_geometry::{Curve, Segment};

/// An arc along the contour, metres.
const ARC_M: f64 = 8.0;

/// What is laid farther ahead than this is laid anew with each look, metres: a second of flight.
const KEPT_M: f64 = 16.0;

/// Who is farther from the contour than this flies a route onto it, metres.
const BESIDE_M: f64 = 60.0;

/// Places ahead to which such a route is tried, metres apart, and so many of them: beyond a zone.
const TRIED_M: f64 = 40.0;
const TRIES: u32 = 10;

/// What was seen longer ago leads no more, milliseconds: the edge of a fire moves on.
const OLD_MS: u64 = 60_000;

/// What others told of a contour.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Told {
    /// Pieces of it, each in an order in which it may be flown.
    pub pieces: Vec<Vec<Point>>,
    /// Whether it is flown towards west and south where either way will do.
    pub backward: bool,
}

/// How far somebody is with a contour.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tracing {
    thread: Thread,
    lead: Option<Lead>,
    /// So many arcs of a search are laid.
    sought: u16,
    /// Whether the contour encloses something: then it is flown one way alone.
    sided: bool,
    /// Its search was in vain so often since it saw something new.
    in_vain: u16,
    told: Told,
    /// A piece that was seen while something else was flown, and when.
    found: Option<(Look, u64)>,
    passed: Vec<Mark>,
    now_ms: u64,
    /// Whether the last stretch that was laid is a circle to let somebody get away.
    circled: bool,
    /// Whether it was seen since the UAV set out for it.
    begun: bool,
}

impl Tracing {
    fn is_fresh(&self) -> bool {
        let seen_ms = self.thread.seen_ms();
        seen_ms.is_some_and(|ms| ms + OLD_MS >= self.now_ms)
    }

    fn prefers(&self) -> Vector {
        let east = Vector::new(1.0, 0.01);
        if self.told.backward { -east } else { east }
    }

    fn lead_anew(&mut self) {
        self.lead = Lead::new(self.thread.line());
        self.sought = 0;
    }

    /// Begins with what it was told of, or saw before: the nearest piece of it.
    fn begin_with_told(&mut self, from: Point) {
        let found = self.found.take();
        let found = found.filter(|(_, ms)| ms + OLD_MS >= self.now_ms);
        if let Some((look, ms)) = found {
            self.thread.end();
            self.thread.see((ms, from), &look, self.prefers(), true);
            self.lead_anew();
            return;
        }
        let near_m = |piece: &Vec<Point>| {
            let away = piece.iter().map(|p| (p - from).norm());
            away.fold(f64::MAX, f64::min)
        };
        let pieces = self.told.pieces.iter().filter(|p| p.len() > 1);
        let nearest = pieces.min_by(|a, b| near_m(a).total_cmp(&near_m(b)));
        self.lead = nearest.cloned().and_then(|mut piece| {
            let way = piece[piece.len() - 1] - piece[0];
            if !self.sided && way.dot(&self.prefers()) < 0.0 {
                piece.reverse();
            }
            Lead::new(piece)
        });
        self.sought = 0;
    }
}

impl Executive {
    /// How many stretches stay when a contour is traced from now on.
    pub(super) fn begin_trace(&mut self) -> usize {
        if self.aim == Aim::Trace && !self.replan {
            return self.stretches.len();
        }
        self.tracing.thread.end();
        self.tracing.lead = None;
        self.tracing.sought = 0;
        self.tracing.in_vain = 0;
        self.tracing.begun = false;
        0
    }

    /// What others told of the contour, and which way it is flown.
    pub fn tell_contour(&mut self, told: Told) {
        self.tracing.told = told;
    }

    /// Who flies before and behind it along the contour, as far as is known.
    pub fn keep_even_along(&mut self, gaps: Option<Gaps>) {
        if self.aim == Aim::Trace {
            self.circuit.set_gaps(gaps);
        }
    }

    /// What it saw of a contour and has left behind since the last call, in the order of flight,
    /// and whether the contour encloses something on the left.
    pub fn take_traced(&mut self) -> (Vec<Mark>, bool) {
        (std::mem::take(&mut self.tracing.passed), self.tracing.sided)
    }

    /// Whether it flies along a contour that it sees.
    #[must_use]
    pub fn is_tracing(&self) -> bool {
        let t = &self.tracing;
        self.aim == Aim::Trace && t.begun && t.lead.is_some() && t.sought == 0
    }

    /// Takes in a look: what is laid ahead is laid anew by it.
    pub(super) fn see_contour(&mut self, percept: &Percept) {
        if percept.contour.is_absent() {
            return;
        }
        self.tracing.now_ms = percept.time_ms;
        let look = percept.contour.look();
        let (now_ms, from) = (percept.time_ms, percept.pose.position());
        let t = &mut self.tracing;
        if !look.pieces.is_empty() {
            t.sided = look.sided;
        }
        if self.aim != Aim::Trace {
            if look.pieces.iter().any(|p| p.len() > 2) {
                t.found = Some((look, now_ms));
            }
            return;
        }
        let was_sought = t.sought;
        let had_thread = !t.thread.is_empty();
        let is_beyond = |lead: &Lead| lead.beside(from).along_m > lead.length_m();
        let seeks = was_sought > 0 || !t.is_fresh() || t.lead.as_ref().is_some_and(is_beyond);
        // Who comes onto what it was told of flies it as that runs.
        let prefers = match &t.lead {
            Some(lead) if !had_thread => lead.pose_at(lead.beside(from).along_m).direction(),
            _ => t.prefers(),
        };
        let went_on = t.thread.see((now_ms, from), &look, prefers, seeks);
        let passed = t.thread.take_passed();
        t.passed.extend(passed);
        if !went_on {
            return;
        }
        // A look at what lies behind tells a seeker nothing new.
        let line = t.thread.line();
        if was_sought > 0 && had_thread {
            let before = t.lead.as_ref().map_or(0.0, Lead::length_m);
            let after = Lead::new(line).map_or(0.0, |l| l.length_m());
            let end = t.lead.as_ref().map(|l| l.pose_at(l.length_m()).position());
            let new_end = t.thread.line().last().copied();
            let moved_m = end.zip(new_end).map_or(f64::MAX, |(a, b)| (b - a).norm());
            if moved_m < 2.0 * ARC_M && after <= before + 2.0 * ARC_M {
                return;
            }
        }
        t.in_vain = 0;
        t.begun = true;
        t.lead_anew();
        t.circled = false;
        self.lay_anew();
    }

    /// Takes off what is laid beyond the next second of flight.
    fn lay_anew(&mut self) {
        if self.replan || self.stretches.is_empty() {
            return;
        }
        let until_m = self.track.at_m() + KEPT_M;
        let is_on_loop = self
            .stretches
            .iter()
            .any(|s| matches!(s.kind, Kind::Pass(..)));
        let is_circle = matches!(
            self.stretches.front().map(|s| s.kind),
            Some(Kind::Loiter(_))
        );
        if is_on_loop || is_circle {
            self.replan = true;
            return;
        }
        let within = self
            .stretches
            .iter()
            .take_while(|s| s.end_m <= until_m)
            .count();
        self.keep(within.max(1));
    }

    /// What follows at the end of a track along the contour.
    pub(super) fn way_along(&mut self, at: &Place) -> Option<Vec<Move>> {
        if self.tracing.lead.is_none() {
            self.tracing.begin_with_told(at.pose.position());
        }
        let radius_m = self.transit.turn_radius_m();
        let Some(lead) = self.tracing.lead.clone() else {
            return self.transit.way_round(at);
        };
        if let Some(circle) = self.room_along(at) {
            return Some(vec![Move::Loiter(circle)]);
        }
        let beside = lead.beside(at.pose.position());
        if beside.along_m >= lead.length_m() + BEYOND_M || self.tracing.sought > 0 {
            return self.seek(at, radius_m);
        }
        let on = lead.pose_at(beside.along_m);
        let faces = cos(at.pose.heading_rad - on.heading_rad);
        if beside.off_m > BESIDE_M || faces < 0.0 {
            return self
                .onto(at, &lead, beside.along_m)
                .or_else(|| self.give_up(at));
        }
        let arc = lead.arc(at.pose, radius_m, ARC_M);
        if self.is_arc_clear(&arc) {
            return Some(vec![laid(arc)]);
        }
        let beyond_m = self.beyond_zone_m(&lead, beside.along_m);
        self.onto(at, &lead, beyond_m).or_else(|| self.give_up(at))
    }

    /// The circle by which it lets who is ahead along the contour get away, one at a time.
    fn room_along(&mut self, at: &Place) -> Option<Segment> {
        if self.tracing.circled || self.tracing.sought > 0 {
            return None;
        }
        let nearer_m = self.gaps()?.nearer_m();
        let circle = self.transit.roomy_circle(&at.pose)?;
        let longest_m = self.transit.air().longest_m(circle.length_m);
        let waits = nearer_m > super::circuit::CIRCLES * longest_m;
        self.tracing.circled = waits;
        waits.then_some(circle)
    }

    /// How far along it is clear of zones again, metres; a little on where none is on it.
    fn beyond_zone_m(&self, lead: &Lead, from_m: f64) -> f64 {
        let zones = self.transit.router.zones();
        let clearance_m = self.transit.router.limits().clearance_m;
        let steps = (0..TRIES * 4).map(|k| from_m + 0.25 * TRIED_M * f64::from(k));
        let is_clear = |m: &f64| zones.distance_m(lead.pose_at(*m).position()) > clearance_m;
        let mut blocked = steps.skip_while(is_clear);
        blocked.find(is_clear).unwrap_or(from_m + TRIED_M)
    }

    /// A route onto the contour from so far along it on, or onto where it goes on.
    fn onto(&self, at: &Place, lead: &Lead, from_m: f64) -> Option<Vec<Move>> {
        let tried = (0..TRIES).map(|k| lead.pose_at(from_m + TRIED_M * f64::from(k)));
        let mut roomy = tried.filter(|pose| self.transit.has_room(pose));
        let way = roomy.find_map(|pose| self.transit.route(at.pose, pose).ok())?;
        (way.length_m() > 0.0).then(|| vec![Move::Route(way)])
    }

    /// Arcs that widen; after the last of them the other way, or what else is known.
    fn seek(&mut self, at: &Place, radius_m: f64) -> Option<Vec<Move>> {
        while self.tracing.sought < SEEK_ARCS {
            let arc = seek_arc(at.pose, self.tracing.sought, radius_m);
            self.tracing.sought += 1;
            if self.is_arc_clear(&arc) {
                return Some(vec![laid(arc)]);
            }
        }
        self.give_up(at)
    }

    /// It is not found here.
    fn give_up(&mut self, at: &Place) -> Option<Vec<Move>> {
        let t = &mut self.tracing;
        t.in_vain += 1;
        let turns_back = !t.sided && t.in_vain < 3 && !t.thread.is_empty();
        if turns_back {
            t.thread.turn_back();
            t.lead_anew();
        } else {
            t.thread.end();
            t.lead = None;
            t.sought = 0;
        }
        t.begun = false;
        let passed = t.thread.take_passed();
        t.passed.extend(passed);
        let lead = t.lead.clone();
        let back = lead.and_then(|lead| {
            let along_m = lead.beside(at.pose.position()).along_m;
            self.onto(at, &lead, along_m.min(lead.length_m()))
        });
        back.or_else(|| self.transit.way_round(at))
    }

    /// Whether an arc keeps the clearance of routes, and leaves room to turn off at its end.
    fn is_arc_clear(&self, arc: &Segment) -> bool {
        let limits = self.transit.router.limits();
        let zones = self.transit.router.zones();
        zones.is_segment_clear(arc, limits.clearance_m) && self.transit.has_room(&arc.end())
    }
}

fn laid(arc: Segment) -> Move {
    let mut curve = Curve::empty();
    curve.push(arc);
    Move::Route(curve)
}

/// How far along a closed contour each of some places is, where it is beside it.
#[must_use]
pub fn gaps_along(ring: &[Point], mine: Pose, others: &[(Pose, f64)]) -> Option<Gaps> {
    let closed: Vec<Point> = ring.iter().chain(ring.first()).copied().collect();
    let whole_m = length_m(&closed);
    let along = |pose: &Pose| {
        let (along_m, off_m, way) = nearest(&closed, pose.position())?;
        let faces = way.dot(&pose.direction()) > 0.0;
        (off_m <= 2.0 * BESIDE_M && faces).then_some(along_m)
    };
    let at_m = along(&mine)?;
    let ahead = others.iter().filter_map(|(pose, flown_m)| {
        let to_m = along(pose)? + flown_m - at_m;
        Some(to_m.rem_euclid(whole_m))
    });
    let ahead: Vec<f64> = ahead.collect();
    let ahead_m = ahead.iter().copied().min_by(f64::total_cmp)?;
    let farthest_m = ahead.iter().copied().max_by(f64::total_cmp)?;
    Some(Gaps {
        ahead_m,
        behind_m: whole_m - farthest_m,
    })
}

#[cfg(test)]
mod tests;
