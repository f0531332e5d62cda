//! What a UAV that flies by promises could fly next: on after what is in force, or aside
//! out of another one's way (D2.7 §1.3).
//!
//! Everything here is a question; nothing changes what is flown.

use super::super::transit::{CellVisit, Move, Place};
use super::super::{Aim, Executive};
use super::{Extension, PROMISED_MOST_S, PROMISED_S, circle_at, place_in, whole_ms};
use crate::event::Event;
use crate::reactive::follow::Track;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{TAU, sin_cos};
use skein_geometry::{Curve, Segment};
use std::collections::{BTreeSet, VecDeque};

/// Ways off the loop are promised in parts of this length, metres: at the end of each it may
/// wait.
const PART_M: f64 = 40.0;

/// Cells whose way is longer are flown in such parts, too, metres.
const LONG_M: f64 = 2.0 * PART_M;

/// So long before it takes off an airframe is told so, milliseconds: two percepts, of which
/// one may be lost.
const ROLL_MS: u64 = 400;

/// What is shorter is rounding, metres.
const SHORT_M: f64 = 1e-3;

/// How far aside a UAV moves that is in another's way, in circles of its own.
const ASIDE_CIRCLES: [f64; 3] = [2.0, 3.5, 6.0];

/// In so many directions.
const ASIDE_COURSES: u32 = 8;

/// Where a UAV flies that takes off before it has cells to see: straight on, else to a side, in
/// eighths of a turn from where it heads.
const OUT_COURSES: [f64; 5] = [0.0, 1.0, -1.0, 2.0, -2.0];

impl Executive {
    /// Flights that could follow on what is in force, turning off at least `lead_ms` after a
    /// time, the best first. Cells that cannot be reached from anywhere on its circle are given
    /// up: where a circle has room there need be none for a turn off every place of it.
    pub fn extensions(
        &mut self,
        at_ms: u64,
        lead_ms: u64,
        is_open: &dyn Fn(u16) -> bool,
    ) -> Vec<Extension> {
        let (mut ways, mut unreached) = (Vec::new(), Vec::new());
        for (cut_m, cut) in self.cuts(at_ms, lead_ms) {
            if self.clears_launcher() {
                ways.extend(self.ways_out(cut_m, cut));
                continue;
            }
            let mut events = Vec::new();
            ways.push(self.way(cut_m, cut, is_open, &mut events));
            unreached.push(Unreached::of(&events));
        }
        let from_all = unreached.into_iter().reduce(|all, here| all.and(&here));
        self.refuse(at_ms, &from_all.unwrap_or_default());
        let mut ways: Vec<Way> = ways.into_iter().filter(|w| !w.moves.is_empty()).collect();
        ways.sort_by(|a, b| (a.cut_m + a.idle_m).total_cmp(&(b.cut_m + b.idle_m)));
        // Who stands takes off then.
        let waits_ms = self
            .launches_in_ms()
            .map_or(0, |least_ms| least_ms.max(lead_ms + ROLL_MS));
        self.offer(&ways, at_ms + waits_ms)
    }

    /// Tells of what cannot be reached: of a cell once that was so wherever it looked for a
    /// whole circle, of one who stands at once.
    fn refuse(&mut self, at_ms: u64, unreached: &Unreached) {
        let circle_s = TAU * self.circle_radius_m() / self.speed_mps();
        let stands = self.stands();
        let Some(c) = &mut self.contingency else {
            return;
        };
        let before = core::mem::take(&mut c.unreached);
        let mut cells = Vec::new();
        for cell in &unreached.cells {
            let since_ms = before.get(cell).copied().unwrap_or(at_ms);
            if stands || at_ms >= since_ms + whole_ms(circle_s) {
                cells.push(*cell);
            } else {
                c.unreached.insert(*cell, since_ms);
            }
        }
        if !cells.is_empty() {
            self.pending.push(Event::Refused { cells });
        }
        if unreached.point {
            self.pending.push(Event::Refused { cells: Vec::new() });
        }
    }

    /// Ways out of another UAV's way, the shortest first.
    #[must_use]
    pub fn ways_aside(&self, at_ms: u64, lead_ms: u64) -> Vec<Extension> {
        let Some((cut_m, cut)) = self.cuts(at_ms, lead_ms).into_iter().next_back() else {
            return Vec::new();
        };
        let mut ways: Vec<Curve> = Vec::new();
        for circles in ASIDE_CIRCLES {
            for k in 0..ASIDE_COURSES {
                let turn = TAU * f64::from(k) / f64::from(ASIDE_COURSES);
                let so_far_m = circles * 2.0 * self.circle_radius_m();
                ways.extend(self.way_off(cut.pose, turn, so_far_m));
            }
        }
        ways.sort_by(|a, b| a.length_m().total_cmp(&b.length_m()));
        let way = |curve: Curve| Way {
            moves: vec![Move::Route(curve)],
            ..Way::new(cut_m, cut)
        };
        let mut offered = Vec::new();
        for way in ways.into_iter().map(way) {
            self.offer_part(&way, 1, at_ms, &mut offered);
        }
        offered
    }

    /// Ways off a launcher that lead nowhere yet, those straight on first.
    fn ways_out(&self, cut_m: f64, cut: Place) -> Vec<Way> {
        let so_far_m = PROMISED_S * self.speed_mps();
        let off = |eighths: f64| self.way_off(cut.pose, eighths * TAU / 8.0, so_far_m);
        let way = |curve: Curve| {
            let mut way = Way {
                idle_m: curve.length_m(),
                ..Way::new(cut_m, cut)
            };
            way.push(Move::Route(curve));
            way
        };
        OUT_COURSES.into_iter().filter_map(off).map(way).collect()
    }

    /// The way to a place so far off, metres, that is reached on the same course when it turns by
    /// an angle first.
    fn way_off(&self, from: Pose, turn_rad: f64, so_far_m: f64) -> Option<Curve> {
        let (s, c) = sin_cos(turn_rad);
        let ahead = from.direction();
        let d = Vector::new(ahead.x * c - ahead.y * s, ahead.x * s + ahead.y * c);
        let to = from.position() + d * so_far_m;
        let there = Pose::new(to, from.heading_rad + turn_rad);
        self.transit.router.route(from, there).ok()
    }

    /// Where it could turn off: after what is still wanted; else as soon as can be, and
    /// where it circles also at the end of a circle.
    fn cuts(&self, at_ms: u64, lead_ms: u64) -> Vec<(f64, Place)> {
        if let Some(pose) = self.standing_at() {
            let boundary = None;
            return vec![(self.track.at_m(), Place { pose, boundary })];
        }
        let Some(c) = self.contingency.as_ref().filter(|c| c.schedule.is_some()) else {
            return Vec::new();
        };
        let soonest_m = self.scheduled_m(at_ms + lead_ms);
        let flight_end_m = self.flight_end_m();
        let keep_m = c.wanted_m.min(flight_end_m);
        let mut ends = self.stretches.iter().filter(|s| s.end_m <= keep_m + 1e-6);
        if let Some(last) = ends.next_back().filter(|s| s.end_m >= soonest_m) {
            return vec![(last.end_m, last.end)];
        }
        let mut cuts = Vec::new();
        if soonest_m > flight_end_m {
            let circle_m = TAU / c.bend_per_m.abs();
            let rounds = ((soonest_m - flight_end_m) / circle_m).ceil();
            if let Some(end) = self.stretches.back().map(|s| s.end) {
                cuts.push((flight_end_m + rounds * circle_m, end));
            }
        }
        if let Some(pose) = self.on_track(soonest_m) {
            let boundary = None;
            cuts.push((soonest_m, Place { pose, boundary }));
        }
        cuts
    }

    /// The way that the goal asks for from a place on, for as long as is promised.
    fn way(
        &self,
        cut_m: f64,
        cut: Place,
        is_open: &dyn Fn(u16) -> bool,
        events: &mut Vec<Event>,
    ) -> Way {
        let mut way = Way::new(cut_m, cut);
        match self.aim {
            Aim::Hold
            | Aim::Circle(_)
            | Aim::Round
            | Aim::Trace
            | Aim::Follow
            | Aim::Given
            | Aim::Detour => {}
            Aim::Legs => self.way_along_legs(&mut way, is_open, events),
            Aim::Point(p) => self.way_to_point(&mut way, p, events),
        }
        way
    }

    fn way_along_legs(
        &self,
        way: &mut Way,
        is_open: &dyn Fn(u16) -> bool,
        events: &mut Vec<Event>,
    ) {
        let mut queue: VecDeque<CellVisit> = self.queue.clone();
        let (mut at, mut length_m) = (way.cut, 0.0);
        for step in self.rest_from(way.cut_m, is_open) {
            if let Some(visit) = step.serves()
                && let Some(i) = place_in(&queue, &visit)
            {
                queue.remove(i);
            }
            length_m += self.transit.length_m(&step);
            at = self.transit.end_of(&at, &step);
            way.moves.push(step);
        }
        while length_m < PROMISED_MOST_S * self.speed_mps() {
            let mut cells = Vec::new();
            let next = self.transit.next(&at, &mut queue, is_open, &mut cells);
            if !cells.is_empty() {
                events.push(Event::Refused { cells });
            }
            let Some((mut moves, visit)) = next else {
                return;
            };
            moves.push(Move::Serve(visit));
            for step in self.transit.cleared(&at, moves, events) {
                let step_m = self.transit.length_m(&step);
                length_m += step_m;
                if step.serves().is_none() {
                    way.idle_m += step_m;
                }
                at = self.transit.end_of(&at, &step);
                if matches!(step, Move::Loiter(_)) {
                    return;
                }
                match step {
                    Move::Serve(visit) if step_m > LONG_M => {
                        let whole = self.curve_of(&Move::Serve(visit));
                        let mut parts: Vec<Curve> = parts(&whole).collect();
                        let last = parts.pop();
                        way.moves.extend(parts.into_iter().map(Move::Route));
                        way.moves.extend(last.map(|rest| Move::Rest(visit, rest)));
                    }
                    other => way.push(other),
                }
            }
        }
    }

    fn way_to_point(&self, way: &mut Way, to: Point, events: &mut Vec<Event>) {
        let rest = self.rest_from(way.cut_m, &|_| true);
        if let Some(arrives) = self.contingency.as_ref().and_then(|c| c.rest_arrives)
            && !rest.is_empty()
        {
            way.idle_m = rest.iter().map(|step| self.transit.length_m(step)).sum();
            way.moves = rest;
            way.arrives = Some(arrives);
            return;
        }
        let Some(moves) = self.transit.way_to_wait_at(&way.cut, to) else {
            events.push(Event::Refused { cells: Vec::new() });
            return;
        };
        for step in self.transit.cleared(&way.cut, moves, events) {
            if let Move::Loiter(circle) = step {
                way.arrives = Some(circle.curvature_per_m);
                return;
            }
            way.idle_m += self.transit.length_m(&step);
            way.push(step);
        }
    }

    /// What comes next of the way that was agreed in part, if it turns off at its end and the
    /// goal still leads there.
    fn rest_from(&self, cut_m: f64, is_open: &dyn Fn(u16) -> bool) -> Vec<Move> {
        let Some(c) = self
            .contingency
            .as_ref()
            .filter(|c| c.wanted_m.is_infinite())
        else {
            return Vec::new();
        };
        let round_m = TAU / c.bend_per_m.abs();
        let rounds = (cut_m - self.flight_end_m()) / round_m;
        let at_its_end = (rounds - rounds.round()).abs() * round_m < SHORT_M;
        let mut queued = self.queue.iter().map(|visit| (visit.cell, visit.direction));
        let served = c.rest.iter().filter_map(Move::serves);
        let mut served = served.map(|visit| (visit.cell, visit.direction));
        let leads_on = served.all(|visit| is_open(visit.0) && queued.any(|q| q == visit));
        if at_its_end && leads_on {
            c.rest.clone()
        } else {
            Vec::new()
        }
    }

    /// Offers parts of the ways, each with a circle to either side at its end: those in which
    /// a cell is served before others, those of shorter ways before those of longer ones, and
    /// of each what lasts as long as is promised, then shorter parts, then longer ones.
    fn offer(&self, ways: &[Way], at_ms: u64) -> Vec<Extension> {
        let promised_m = PROMISED_S * self.speed_mps();
        let mut ends: Vec<(bool, usize, f64, usize)> = Vec::new();
        for (nth, way) in ways.iter().enumerate() {
            let (mut length_m, mut is_idle) = (0.0, true);
            for (i, step) in way.moves.iter().enumerate() {
                length_m += self.transit.length_m(step);
                is_idle &= step.serves().is_none();
                let late_m = (promised_m - length_m).abs();
                let rank_m = if length_m > promised_m {
                    promised_m + late_m
                } else {
                    late_m
                };
                ends.push((is_idle, nth, rank_m, i + 1));
            }
        }
        ends.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
        let mut offered = Vec::new();
        for (_, nth, _, count) in ends {
            if let Some(way) = ways.get(nth) {
                self.offer_part(way, count, at_ms, &mut offered);
            }
        }
        offered
    }

    /// Offers the first moves of a way.
    fn offer_part(&self, way: &Way, count: usize, at_ms: u64, offered: &mut Vec<Extension>) {
        let moves: Vec<Move> = way.moves.iter().take(count).cloned().collect();
        let end = |at: Place, step: &Move| self.transit.end_of(&at, step);
        let at = moves.iter().fold(way.cut, end);
        let arrives = way.arrives.filter(|_| count == way.moves.len());
        let least = 1.0 / self.circle_radius_m();
        let sides = arrives.map_or([-least, least], |bend| [bend, -bend]);
        let from_m = self.scheduled_m(at_ms);
        let Some(start) = self.standing_at().or_else(|| self.on_track(from_m)) else {
            return;
        };
        let mut flight = self.flown(from_m, way.cut_m);
        for step in &moves {
            flight.extend(&self.curve_of(step));
        }
        if flight.length_m() > PROMISED_MOST_S * self.speed_mps() {
            return;
        }
        for bend_per_m in sides {
            if !self.transit.has_room_for(&circle_at(&at.pose, bend_per_m)) {
                continue;
            }
            let Some(plan) = self.plan(at_ms, start, &flight, bend_per_m) else {
                continue;
            };
            let until_s = (way.cut_m - from_m).max(0.0) / self.speed_mps();
            let rolls_ms = if self.stands() { ROLL_MS } else { 0 };
            offered.push(Extension {
                plan,
                branch_ms: (at_ms + whole_ms(until_s)).saturating_sub(rolls_ms),
                cut: way.cut,
                cut_m: way.cut_m,
                moves: moves.clone(),
                bend_per_m,
                arrives: arrives.is_some(),
                rest: way.moves.iter().skip(count).cloned().collect(),
                rest_arrives: way.arrives.filter(|_| arrives.is_none()),
                goals: self.contingency.as_ref().map_or(0, |c| c.goals),
            });
        }
    }

    /// What is in force between two arc lengths, with circles where they lie beyond it.
    fn flown(&self, from_m: f64, until_m: f64) -> Curve {
        let mut flown = self.track.between(from_m, until_m);
        let end_m = self.track.end_m();
        if until_m > end_m
            && let (Some(end), Some(c)) = (self.track.end(), &self.contingency)
        {
            let begun = circle_at(&end, c.bend_per_m).pose_at((from_m - end_m).max(0.0));
            flown.push(Segment {
                length_m: until_m - end_m.max(from_m),
                ..circle_at(&begun, c.bend_per_m)
            });
        }
        flown
    }

    fn curve_of(&self, step: &Move) -> Curve {
        let coverage_loop = &self.transit.coverage_loop;
        match step {
            Move::Serve(visit) => coverage_loop.curve(usize::from(visit.cell), visit.direction),
            Move::Pass(cell, direction) => coverage_loop.curve(usize::from(*cell), *direction),
            Move::Route(curve) | Move::Rest(_, curve) => curve.clone(),
            Move::Loiter(piece) | Move::Piece(piece, _) => {
                let mut curve = Curve::empty();
                curve.push(*piece);
                curve
            }
        }
    }
}

/// What cannot be reached from a place.
#[derive(Default)]
struct Unreached {
    cells: BTreeSet<u16>,
    /// The point that the goal asks for.
    point: bool,
}

impl Unreached {
    fn of(events: &[Event]) -> Self {
        let mut unreached = Self::default();
        for event in events {
            if let Event::Refused { cells } = event {
                unreached.point |= cells.is_empty();
                unreached.cells.extend(cells);
            }
        }
        unreached
    }

    /// What cannot be reached from another place either.
    fn and(&self, other: &Self) -> Self {
        Self {
            cells: &self.cells & &other.cells,
            point: self.point && other.point,
        }
    }
}

/// A way from a place on.
struct Way {
    cut_m: f64,
    cut: Place,
    moves: Vec<Move>,
    /// How much of it serves no cell, metres.
    idle_m: f64,
    /// The circle in which it ends, if it gets there.
    arrives: Option<f64>,
}

impl Way {
    /// One without any move yet.
    fn new(cut_m: f64, cut: Place) -> Self {
        Self {
            cut_m,
            cut,
            moves: Vec::new(),
            idle_m: 0.0,
            arrives: None,
        }
    }

    /// One move more; ways off the loop in parts.
    fn push(&mut self, step: Move) {
        match step {
            // From where it is to where it is there is nothing to fly.
            Move::Route(curve) if curve.length_m() < SHORT_M => {}
            Move::Route(curve) => self.moves.extend(parts(&curve).map(Move::Route)),
            other => self.moves.push(other),
        }
    }
}

/// A curve in parts of [`PART_M`], the last one longer rather than short.
fn parts(curve: &Curve) -> impl Iterator<Item = Curve> {
    let length_m = curve.length_m();
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a curve of some kilometres"
    )]
    let count = ((length_m / PART_M) as u32).max(1);
    let each_m = length_m / f64::from(count);
    let whole = Track::new(curve);
    (0..count).map(move |k| whole.between(each_m * f64::from(k), each_m * f64::from(k + 1)))
}
