//! Round the coverage loop for as long as somebody says so, evenly spaced among those who do the
//! same (D2.7 §3.6.6, executive layer): the way onto the loop, and the airspeed.
//!
//! | those before and behind it | airspeed |
//! |---|---|
//! | nobody is heard of, or it is not on the loop yet | as in all flight |
//! | the next one ahead is farther than the next one behind, or as far | as in all flight |
//! | nearer | less, by [`SLOWER_PER_S`] for each metre of difference, and no less than is safe |
//! | nearer by more than two circles and a half | the same, and a circle at the next boundary with room, where that still holds when the circle begins |
//!
//! Who circles is where its circle ends, less what is left of it: beside the loop it keeps its
//! place in the order, so that of two who are near one another one circles, and not both in turn.
//!
//! Nobody flies faster than it would alone, so the slowest sets the pace of all, and all who
//! fly evenly fly at full speed. Distances are counted through the air along the loop: in a wind
//! what is even is the time between two of them.
//!
//! # Guarantees
//! What is flown is the loop, forward, from the boundary where it was joined on. Equal inputs
//! give equal outputs.
//!
//! # Complexity
//! A look at the others costs a few operations for each of them and each 15 m of the loop.

use super::transit::{CellVisit, Move, Place, Transit};
use super::{Aim, Executive, Kind, Stretch};
use crate::reactive::air::Air;
use skein_flight::coverage::ring::Direction;
use skein_geometry::Segment;
use skein_geometry::frame::Pose;
use skein_geometry::math::{cos, wrap_pi, wrap_tau};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, TAU};

/// By how much slower somebody flies for each metre by which who is ahead is nearer than who is
/// behind, m/s: differences between n UAVs are halved in some n²/π² · 14 s.
pub const SLOWER_PER_S: f64 = 0.05;

/// A circle takes twice its length from the difference; one more may be under way.
pub(super) const CIRCLES: f64 = 2.5;

/// Places on the loop are no farther apart, metres.
const MARK_M: f64 = 15.0;

/// Farther from the loop than this somebody is not on it, metres: two lanes.
const OFF_M: f64 = 100.0;

/// Whose heading is farther from that of the loop circles, or turns round to fly it.
const CIRCLING_RAD: f64 = FRAC_PI_4;

/// What a heading against the loop counts as, metres beside: lanes flown to and fro lie beside
/// or upon one another.
const AGAINST_M: f64 = 60.0;

/// In a wind the airspeed stays at least so many times as high.
const WINDS: f64 = 2.0;

/// Where the loop leads along the same ground twice somebody stays on the part on which it was,
/// until another one is nearer by so much, metres.
const SAME_M: f64 = 30.0;

/// No farther along the loop than this from one look to the next, metres.
const MOVED_M: f64 = 300.0;

/// Another one who flies round the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fellow {
    /// Which one it is.
    pub id: u16,
    /// Where it was, and where its nose pointed.
    pub pose: Pose,
    /// How long ago, milliseconds.
    pub age_ms: u32,
}

/// Who flies before and behind somebody, as metres through the air along the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaps {
    /// To the next one ahead.
    pub ahead_m: f64,
    /// From the next one behind.
    pub behind_m: f64,
}

impl Gaps {
    /// By how much nearer who is ahead is than who is behind, metres; 0 where it is not.
    #[must_use]
    pub fn nearer_m(&self) -> f64 {
        (self.behind_m - self.ahead_m).max(0.0)
    }

    /// The airspeed at which a UAV flies on that would fly at `full_mps` alone, m/s.
    #[must_use]
    pub fn airspeed_mps(&self, full_mps: f64) -> f64 {
        full_mps - SLOWER_PER_S * self.nearer_m()
    }
}

/// A place on the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mark {
    pose: Pose,
    cell: u16,
    /// How much of the cell is before it.
    share: f64,
}

/// How long the loop is, and where each of its cells begins, through the present air.
#[derive(Debug)]
struct Measured<'a> {
    transit: &'a Transit,
    marks: &'a [Mark],
    begins_m: Vec<f64>,
    whole_m: f64,
}

/// How a UAV keeps its place among others.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Circuit {
    /// None before the loop is flown round.
    marks: Vec<Mark>,
    gaps: Option<Gaps>,
    /// Where it was on the loop at the last look, and the others, metres.
    here_m: Option<f64>,
    places_m: BTreeMap<u16, f64>,
}

impl Circuit {
    /// Who is before and behind it, where that is not counted along the loop.
    pub(super) fn set_gaps(&mut self, gaps: Option<Gaps>) {
        self.gaps = gaps;
    }
}

impl Transit {
    /// What follows at the end of a track that leads round the loop: its next cell, or the way
    /// onto it. `None` where there is no way to it.
    #[must_use]
    pub fn way_round(&self, from: &Place) -> Option<Vec<Move>> {
        match from.boundary {
            Some((boundary, Direction::Forward)) => {
                Some(vec![Move::Pass(boundary, Direction::Forward)])
            }
            _ => {
                let ((boundary, direction), way) = self.join(from.pose, &[Direction::Forward])?;
                Some(vec![Move::Route(way), Move::Pass(boundary, direction)])
            }
        }
    }

    /// Places along the loop, for who looks where somebody is on it.
    fn marks(&self) -> Vec<Mark> {
        let cells = 0..self.coverage_loop.len();
        let each = cells.zip(0u16..).flat_map(|(i, cell)| {
            let curve = self.coverage_loop.curve(i, Direction::Forward);
            let length_m = curve.length_m();
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a cell is no longer than an area"
            )]
            let steps = (length_m / MARK_M).ceil().clamp(1.0, 1e5) as u32;
            (0..steps).filter_map(move |k| {
                let share = f64::from(k) / f64::from(steps);
                let pose = curve.pose_at(share * length_m)?;
                Some(Mark { pose, cell, share })
            })
        });
        each.collect()
    }

    /// Distance through the air along a cell that is flown whole, forward, metres.
    fn forward_m(&self, cell: u16) -> f64 {
        let direction = Direction::Forward;
        self.length_m(&Move::Serve(CellVisit {
            cell,
            direction,
            tries: 0,
        }))
    }

    /// The loop as it is in the present air.
    fn measured<'a>(&'a self, marks: &'a [Mark]) -> Measured<'a> {
        let mut whole_m = 0.0;
        let cells = (0..self.coverage_loop.len()).zip(0u16..);
        let begins_m = cells.map(|(_, cell)| {
            let begins_m = whole_m;
            whole_m += self.forward_m(cell);
            begins_m
        });
        Measured {
            transit: self,
            marks,
            begins_m: begins_m.collect(),
            whole_m,
        }
    }
}

impl Measured<'_> {
    /// How far along the loop a pose is, through the air, metres. `None` where it is not on it.
    /// Who circles there has that much less of it behind it as is left of its circle. Where it was
    /// at the last look tells parts apart that lie beside or upon one another.
    fn along_m(&self, pose: Pose, was_m: Option<f64>) -> Option<f64> {
        let near = near(self.marks, pose);
        let best = least(near.iter().copied())?;
        let same = was_m.and_then(|was_m| {
            let is_same = |(_, mark): &(f64, &Mark)| {
                let off_m = (self.begins_at_m(mark) - was_m).rem_euclid(self.whole_m);
                off_m.min(self.whole_m - off_m) <= MOVED_M
            };
            least(near.iter().copied().filter(is_same))
        });
        let (_, mark) = same.filter(|s| s.0 <= best.0 + SAME_M).unwrap_or(best);
        let off = pose.position() - mark.pose.position();
        let on_m = off.dot(&mark.pose.direction()).clamp(-MARK_M, MARK_M);
        let left_m = self.transit.wide_circle_m() * circle_left(&mark.pose, pose);
        Some(self.begins_at_m(mark) + on_m - left_m)
    }

    /// How far along the loop a mark is, through the air, metres.
    fn begins_at_m(&self, mark: &Mark) -> f64 {
        let before_m = mark.share * self.transit.forward_m(mark.cell);
        self.begins_m[usize::from(mark.cell)] + before_m
    }

    /// Who is next ahead of somebody so far along the loop and who behind, where the others were
    /// at these places at the last look; these become those of now. `None` where nobody else is on
    /// it.
    fn gaps(
        &self,
        at_m: f64,
        others: &[Fellow],
        places_m: &mut BTreeMap<u16, f64>,
    ) -> Option<Gaps> {
        let speed_mps = self.transit.air().airspeed_mps;
        let were_m = std::mem::take(places_m);
        let ahead_m = |other: &Fellow| {
            let then_m = self.along_m(other.pose, were_m.get(&other.id).copied())?;
            places_m.insert(other.id, then_m);
            let now_m = then_m + speed_mps * f64::from(other.age_ms) / 1000.0;
            Some((now_m - at_m).rem_euclid(self.whole_m))
        };
        let all: Vec<f64> = others.iter().filter_map(ahead_m).collect();
        let ahead_m = all.iter().copied().min_by(f64::total_cmp)?;
        let farthest_m = all.iter().copied().max_by(f64::total_cmp)?;
        Some(Gaps {
            ahead_m,
            behind_m: self.whole_m - farthest_m,
        })
    }
}

/// The places on the loop about a pose, and how far off each counts as, metres.
fn near(marks: &[Mark], pose: Pose) -> Vec<(f64, &Mark)> {
    let cost_m = |mark: &Mark| {
        let off = pose.position() - mark.pose.position();
        (off.dot(&off) <= OFF_M * OFF_M).then(|| {
            let turned = cos(pose.heading_rad - mark.pose.heading_rad);
            off.norm() + AGAINST_M * (1.0 - turned)
        })
    };
    let costs = marks.iter().filter_map(|m| Some((cost_m(m)?, m)));
    costs.collect()
}

/// The nearest of such places, of equals the first.
fn least<'a>(near: impl Iterator<Item = (f64, &'a Mark)>) -> Option<(f64, &'a Mark)> {
    near.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// What share of its circle somebody has left who circles beside the loop; 0 for who flies along
/// it.
fn circle_left(on: &Pose, pose: Pose) -> f64 {
    let turned_rad = wrap_pi(pose.heading_rad - on.heading_rad);
    if turned_rad.abs() < CIRCLING_RAD {
        return 0.0;
    }
    let off = pose.position() - on.position();
    let is_left = on.direction().perp(&off) >= 0.0;
    let flown_rad = wrap_tau(if is_left { turned_rad } else { -turned_rad });
    1.0 - flown_rad / TAU
}

impl Executive {
    /// Where the others are who fly round the loop as this UAV does: it keeps as far behind the
    /// one ahead as before the one behind. Nothing changes for who flies by another goal.
    pub fn keep_even(&mut self, others: &[Fellow]) {
        let Some(here) = self.played.as_ref().map(|p| p.percept.pose) else {
            return;
        };
        if self.aim != Aim::Round {
            return;
        }
        if self.circuit.marks.is_empty() {
            self.circuit.marks = self.transit.marks();
        }
        let measured = self.transit.measured(&self.circuit.marks);
        let was_m = self.circuit.here_m;
        let along_m = match self.stretches.front() {
            Some(Stretch {
                kind: Kind::Loiter(_),
                end_m,
                end,
            }) => {
                let end_along_m = measured.along_m(end.pose, was_m);
                end_along_m.map(|m| m - self.air_m_until(*end_m))
            }
            _ => measured.along_m(here, was_m),
        };
        let places_m = &mut self.circuit.places_m;
        self.circuit.gaps = along_m.and_then(|m| measured.gaps(m, others, places_m));
        self.circuit.here_m = along_m;
        self.give_up_circle();
    }

    /// A circle that is not begun is flown only as long as it lacks room.
    fn give_up_circle(&mut self) {
        let is_circle = |s: &Stretch| matches!(s.kind, Kind::Loiter(_));
        let ahead = self.stretches.iter().skip(1).position(is_circle);
        let Some(kept) = ahead.map(|i| i + 1) else {
            return;
        };
        if self.waits_for_room(&self.stretches[kept - 1].end).is_none() {
            self.keep(kept);
        }
    }

    /// Who is before and behind it, where it flies round the loop and knows of others.
    #[must_use]
    pub fn gaps(&self) -> Option<Gaps> {
        self.circuit.gaps
    }

    /// The wind, and the airspeed that is flown in it now.
    pub(super) fn flown_air(&self) -> Air {
        let air = *self.transit.air();
        let Some(gaps) = self.circuit.gaps else {
            return air;
        };
        let least_mps = WINDS * air.wind.speed_mps();
        let wanted_mps = gaps.airspeed_mps(air.airspeed_mps).max(least_mps);
        Air {
            airspeed_mps: self.envelope.airspeed_mps(wanted_mps).min(air.airspeed_mps),
            ..air
        }
    }

    /// The circle by which it lets who is ahead get away, where that is far too near.
    pub(super) fn waits_for_room(&self, at: &Place) -> Option<Segment> {
        at.boundary?;
        let nearer_m = self.circuit.gaps?.nearer_m();
        let circle = self.transit.roomy_circle(&at.pose)?;
        let longest_m = self.transit.air().longest_m(circle.length_m);
        (nearer_m > CIRCLES * longest_m).then_some(circle)
    }

    /// How many stretches stay when the loop is flown round from now on: the cell that is flown,
    /// where it is flown forward.
    pub(super) fn rounded(&mut self) -> usize {
        for s in &mut self.stretches {
            if let Kind::Serve(visit) = s.kind {
                s.kind = Kind::Pass(visit.cell, visit.direction);
            }
        }
        let front = self.stretches.front().map(|s| s.kind);
        let goes_on = matches!(front, Some(Kind::Pass(_, Direction::Forward)));
        match self.aim {
            _ if self.replan => 0,
            Aim::Round => self.stretches.len(),
            _ => usize::from(goes_on),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Goal;
    use crate::testing::{Wing, airframe, loop_and_router, square};
    use skein_geometry::frame::Point;
    use std::f64::consts::PI;

    fn round(wing: &Wing) -> Executive {
        let (coverage_loop, router) = loop_and_router(12, 10, vec![square(200.0, 100.0, 80.0)]);
        let mut executive = Executive::new(airframe(), 90.0, coverage_loop, router);
        executive.step(&wing.percept(), &|_| false);
        executive.set_goal(Goal::Round, &|_| false);
        executive
    }

    fn on(executive: &Executive, boundary: usize) -> Pose {
        executive.transit.coverage_loop.boundary(boundary)
    }

    #[test]
    fn who_flies_round_passes_each_cell_again_and_again() {
        let mut wing = Wing::new(Pose::new(Point::new(-60.0, -40.0), 0.3));
        let mut executive = round(&wing);
        let cells = executive.transit.coverage_loop.len();
        let mut passed: Vec<u16> = Vec::new();
        for _ in 0..6_000 {
            let (setpoint, _) = executive.step(&wing.percept(), &|_| false);
            wing.setpoint = Some(setpoint);
            wing.fly(200);
            let kind = executive.stretches.front().map(|s| s.kind);
            if let Some(Kind::Pass(cell, Direction::Forward)) = kind
                && passed.last() != Some(&cell)
            {
                passed.push(cell);
            }
        }
        assert!(passed.len() > 3 * cells / 2, "{} of {cells}", passed.len());
        for both in passed.windows(2) {
            assert_eq!(usize::from(both[1]), (usize::from(both[0]) + 1) % cells);
        }
    }

    #[test]
    fn who_is_nearer_to_the_one_ahead_flies_slower_and_nobody_faster() {
        let mut wing = Wing::new(Pose::new(Point::new(0.0, 0.0), 0.0));
        let mut executive = round(&wing);
        wing.pose = on(&executive, 10);
        executive.step(&wing.percept(), &|_| false);
        let fellow = |boundary| Fellow {
            id: 2 + boundary as u16,
            pose: on(&executive, boundary),
            age_ms: 0,
        };
        let (near, far) = (fellow(12), fellow(40));
        let full_mps = executive.transit.air().airspeed_mps;
        let mut speed = |others: &[Fellow]| {
            executive.keep_even(others);
            executive.flown_air().airspeed_mps
        };
        assert!(speed(&[near, far]) < full_mps);
        assert!(speed(&[near]) < full_mps);
        // The same two seen from the other side: who is behind is nearer.
        let behind = Fellow {
            id: 1,
            pose: on(&executive, 8),
            age_ms: 0,
        };
        let mut speed = |others: &[Fellow]| {
            executive.keep_even(others);
            executive.flown_air().airspeed_mps
        };
        let is_full = |mps: f64| (mps - full_mps).abs() < 1e-9;
        assert!(is_full(speed(&[behind, far])));
        assert!(is_full(speed(&[])));
        let away = Fellow {
            id: 1,
            pose: Pose::new(Point::new(-900.0, -900.0), 0.0),
            age_ms: 0,
        };
        assert!(is_full(speed(&[away])));
    }

    /// The largest gap between those who fly round over an even one; infinite while one of them is
    /// not on the loop.
    fn unevenness(all: &[(Wing, Executive)]) -> f64 {
        let marks = all[0].1.transit.marks();
        let measured = all[0].1.transit.measured(&marks);
        let whole_m = measured.whole_m;
        let at = all.iter().map(|(w, _)| measured.along_m(w.pose, None));
        let Some(at) = at.collect::<Option<Vec<f64>>>() else {
            return f64::INFINITY;
        };
        let to_next = |m: f64| {
            let others = at.iter().map(|o| (o - m).rem_euclid(whole_m));
            others.filter(|d| *d > 0.0).fold(whole_m, f64::min)
        };
        let widest_m = at.iter().map(|a| to_next(*a)).fold(0.0, f64::max);
        #[allow(clippy::cast_precision_loss, reason = "a few")]
        let n = all.len() as f64;
        widest_m * n / whole_m
    }

    /// All fly for a step of 200 ms; where `told` says so they hear where each other one was
    /// `age_ms` ago.
    fn fly(all: &mut [(Wing, Executive)], told: Option<&[Fellow]>) {
        for (i, (wing, executive)) in all.iter_mut().enumerate() {
            if let Some(told) = told {
                let others = told.iter().enumerate().filter(|(j, _)| *j != i);
                let others: Vec<Fellow> = others.map(|(_, fellow)| *fellow).collect();
                executive.keep_even(&others);
            }
            let (setpoint, _) = executive.step(&wing.percept(), &|_| false);
            wing.setpoint = Some(setpoint);
            wing.fly(200);
        }
    }

    fn told(all: &[(Wing, Executive)], age_ms: u32) -> Vec<Fellow> {
        let fellow = |(id, (wing, _)): (u16, &(Wing, Executive))| Fellow {
            id,
            pose: wing.pose,
            age_ms,
        };
        (0..).zip(all).map(fellow).collect()
    }

    #[test]
    fn who_begin_together_end_evenly_spaced() {
        let mut all: Vec<(Wing, Executive)> = (0..4)
            .map(|k| {
                let wing = Wing::new(Pose::new(Point::new(-40.0 * f64::from(k), -20.0), 0.0));
                let executive = round(&wing);
                (wing, executive)
            })
            .collect();
        let mut begun = None;
        for step in 0..12_000 {
            let fellows = (step % 5 == 0).then(|| told(&all, 400));
            fly(&mut all, fellows.as_deref());
            if step == 300 {
                begun = Some(unevenness(&all));
            }
        }
        assert!(begun.is_some_and(|g| g > 2.5), "{begun:?}");
        let ended = unevenness(&all);
        assert!(ended < 1.1, "{ended}");
    }

    /// Two near one another, one of whom turns round first, and who hear each other late: the one
    /// who is behind circles, and not both in turn.
    #[test]
    fn of_two_who_are_near_one_circles() {
        let any = round(&Wing::new(Pose::new(Point::new(0.0, 0.0), 0.0)));
        let at = on(&any, 10);
        let begin = |pose: Pose| {
            let wing = Wing::new(pose);
            let executive = round(&wing);
            (wing, executive)
        };
        let mut slowest = 0;
        for ahead_m in (-6..=6).map(|k| 25.0 * f64::from(k) + 3.0) {
            for (turned_rad, late) in [(0.0, 2), (0.0, 16), (PI, 2), (PI, 8), (PI, 16)] {
                let there = at.position() + ahead_m * at.direction();
                let other = Pose::new(there, at.heading_rad + turned_rad);
                let mut all = vec![begin(at), begin(other)];
                let mut heard = Vec::new();
                let mut steps = 0;
                while unevenness(&all) > 1.5 && steps < 3_000 {
                    if steps % late == 0 {
                        heard = told(&all, 0);
                    }
                    let age_ms = 200 * (steps % late);
                    let aged = heard.iter().map(|f: &Fellow| Fellow { age_ms, ..*f });
                    let aged: Vec<Fellow> = aged.collect();
                    fly(&mut all, Some(&aged));
                    steps += 1;
                }
                slowest = slowest.max(steps);
            }
        }
        // Where both circle, some pairs take above 600.
        assert!(slowest < 600, "{slowest}");
    }

    /// Where the loop leads along the same ground twice, it is one place that changes by little:
    /// an airspeed that follows from two in turn would change with each look.
    #[test]
    fn who_flies_where_the_loop_leads_twice_stays_on_one_of_the_two() {
        let wing = Wing::new(Pose::new(Point::new(0.0, 0.0), 0.0));
        let executive = round(&wing);
        let marks = executive.transit.marks();
        let measured = executive.transit.measured(&marks);
        let whole_m = measured.whole_m;
        // The second half of the loop is laid upon the first, a metre beside.
        let half = marks.len() / 2;
        let twice: Vec<Mark> = (0..2 * half)
            .map(|i| {
                let on = marks[i % half].pose;
                let d = on.direction();
                let left = skein_geometry::frame::Vector::new(-d.y, d.x);
                let beside_m = if i < half { 0.0 } else { 1.0 };
                let at = on.position() + left * beside_m;
                Mark {
                    pose: Pose::new(at, on.heading_rad),
                    ..marks[i]
                }
            })
            .collect();
        let measured = Measured {
            marks: &twice,
            ..measured
        };
        for first in [half / 4, half + half / 4] {
            let mut was_m = Some(measured.begins_at_m(&twice[first]));
            let mut swapped = 0;
            for ahead in 1..40 {
                let on = twice[half / 4 + ahead].pose;
                let d = on.direction();
                let left = skein_geometry::frame::Vector::new(-d.y, d.x);
                let at = on.position() + left * f64::from(u8::from(ahead % 2 == 0));
                let pose = Pose::new(at, on.heading_rad);
                let is_m = measured.along_m(pose, was_m).unwrap();
                let moved_m = (is_m - was_m.unwrap()).rem_euclid(whole_m);
                let moved_m = moved_m.min(whole_m - moved_m);
                assert!(moved_m < MOVED_M, "{first} {ahead}: {moved_m}");
                let alone_m = measured.along_m(pose, None).unwrap();
                swapped += u32::from((alone_m - is_m).abs() > 300.0);
                was_m = Some(is_m);
            }
            assert!(swapped > 10, "{swapped}");
        }
    }

    /// Where an excursion leaves the loop it comes back: its beginning and its end are one place.
    #[test]
    fn a_place_on_the_loop_is_as_far_along_as_the_cells_before_it() {
        let wing = Wing::new(Pose::new(Point::new(0.0, 0.0), 0.0));
        let executive = round(&wing);
        let marks = executive.transit.marks();
        let measured = executive.transit.measured(&marks);
        let (along, whole_m) = (
            |pose| measured.along_m(pose, None).unwrap(),
            measured.whole_m,
        );
        let cells = executive.transit.coverage_loop.cells();
        let (mut until_m, mut looked) = (0.0, 0);
        for (cell, i) in cells.iter().zip(0u16..) {
            let there = on(&executive, usize::from(i));
            let before = executive.transit.coverage_loop.len() + usize::from(i) - 1;
            let beside = cells[before % cells.len()].excursion || cell.excursion;
            if !beside {
                let at_m = along(there);
                let off_m = (at_m - until_m).rem_euclid(whole_m);
                assert!(off_m.min(whole_m - off_m) < 1.0, "{i}: {at_m} {until_m}");
                let at = there.position() + 2.0 * there.direction();
                let ahead = Pose::new(at, there.heading_rad);
                let on_m = (along(ahead) - at_m).rem_euclid(whole_m);
                assert!(on_m > 0.5 && on_m < 4.0, "{i}: {on_m}");
                looked += 1;
            }
            until_m += executive.transit.forward_m(i);
        }
        assert!(looked > cells.len() / 2, "{looked}");
    }
}
