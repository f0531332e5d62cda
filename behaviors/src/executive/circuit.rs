//! Round the coverage loop for as long as somebody says so, evenly spaced among those who do the
//! same (D2.7 §3.6.6, executive layer): the way onto the loop, and the airspeed.
//!
//! | those before and behind it | airspeed |
//! |---|---|
//! | nobody is heard of, or it is not on the loop yet | as in all flight |
//! | the next one ahead is farther than the next one behind, or as far | as in all flight |
//! | nearer | less, by [`SLOWER_PER_S`] for each metre of difference, and no less than is safe |
//! | nearer by more than two circles and a half | the same, and a circle at the next boundary with room |
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
//! A look at the others costs a few operations for each of them and each cell of the loop.

use super::transit::{Move, Place, Transit};
use super::{Aim, Executive, Kind};
use crate::reactive::air::Air;
use skein_flight::coverage::ring::Direction;
use skein_geometry::Segment;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::cos;

/// By how much slower somebody flies for each metre by which who is ahead is nearer than who is
/// behind, m/s: differences between n UAVs are halved in some n²/π² · 14 s.
pub const SLOWER_PER_S: f64 = 0.05;

/// A circle takes twice its length from the difference; one more may be under way.
const CIRCLES: f64 = 2.5;

/// Farther from the loop than this somebody is not on it, metres: two lanes.
const OFF_M: f64 = 100.0;

/// What a heading against the loop counts as, metres beside: lanes flown to and fro lie beside
/// or upon one another.
const AGAINST_M: f64 = 60.0;

/// In a wind the airspeed stays at least so many times as high.
const WINDS: f64 = 2.0;

/// Another one who flies round the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fellow {
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

/// How a UAV keeps its place among others.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Circuit {
    gaps: Option<Gaps>,
}

/// The distance of a point from a straight piece, and how much of that piece is before the
/// nearest point of it.
fn beside(p: Point, (from, to): (Point, Point)) -> (f64, f64) {
    let (along, d) = (to - from, p - from);
    let squared = along.norm_squared();
    let share = if squared > 0.0 {
        (d.dot(&along) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    ((d - along * share).norm(), share)
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

    /// Distance through the air along a cell, forward, metres.
    fn forward_m(&self, cell: u16) -> f64 {
        self.length_m(&Move::Pass(cell, Direction::Forward))
    }

    /// How far along the loop a pose is, through the air, and how long the loop is, metres.
    /// `None` where it is not on the loop.
    fn along_loop_m(&self, pose: Pose) -> Option<(f64, f64)> {
        let cells = self.coverage_loop.len();
        let (mut whole_m, mut best) = (0.0, None);
        for (cell, i) in (0..cells).zip(0u16..) {
            let from = self.coverage_loop.boundary(cell);
            let to = self.coverage_loop.boundary((cell + 1) % cells);
            let length_m = self.forward_m(i);
            let (off_m, share) = beside(pose.position(), (from.position(), to.position()));
            let turned_rad = pose.heading_rad - from.heading_rad;
            let turned_by =
                (1.0 - share) * cos(turned_rad) + share * cos(pose.heading_rad - to.heading_rad);
            let cost_m = off_m + AGAINST_M * (1.0 - turned_by);
            if off_m <= OFF_M && best.is_none_or(|(least_m, _)| cost_m < least_m) {
                best = Some((cost_m, whole_m + share * length_m));
            }
            whole_m += length_m;
        }
        best.map(|(_, at_m)| (at_m, whole_m))
    }

    /// Who is next ahead of a pose on the loop and who behind. `None` where it is not on the
    /// loop, or nobody else is.
    #[must_use]
    pub fn gaps(&self, pose: Pose, others: &[Fellow]) -> Option<Gaps> {
        let (at_m, whole_m) = self.along_loop_m(pose)?;
        let speed_mps = self.air().airspeed_mps;
        let ahead_m = |other: &Fellow| {
            let (then_m, _) = self.along_loop_m(other.pose)?;
            let now_m = then_m + speed_mps * f64::from(other.age_ms) / 1000.0;
            Some((now_m - at_m).rem_euclid(whole_m))
        };
        let all = || others.iter().filter_map(ahead_m);
        let ahead_m = all().min_by(f64::total_cmp)?;
        let farthest_m = all().max_by(f64::total_cmp)?;
        Some(Gaps {
            ahead_m,
            behind_m: whole_m - farthest_m,
        })
    }
}

impl Executive {
    /// Where the others are who fly round the loop as this UAV does: it keeps as far behind the
    /// one ahead as before the one behind. Nothing changes for who flies by another goal.
    pub fn keep_even(&mut self, others: &[Fellow]) {
        let Some(here) = self.played.as_ref().map(|p| p.percept.pose) else {
            return;
        };
        let is_round = self.aim == Aim::Round;
        self.circuit.gaps = is_round.then(|| self.transit.gaps(here, others)).flatten();
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
    use skein_geometry::frame::Vector;
    use skein_geometry::math::sin;

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
            pose: on(&executive, 8),
            age_ms: 0,
        };
        let mut speed = |others: &[Fellow]| {
            executive.keep_even(others);
            executive.flown_air().airspeed_mps
        };
        assert_eq!(speed(&[behind, far]), full_mps);
        assert_eq!(speed(&[]), full_mps);
        let away = Fellow {
            pose: Pose::new(Point::new(-900.0, -900.0), 0.0),
            age_ms: 0,
        };
        assert_eq!(speed(&[away]), full_mps);
    }

    /// Four who begin side by side: the largest gap over an even one, after some laps.
    #[test]
    fn who_begin_together_end_evenly_spaced() {
        let mut all: Vec<(Wing, Executive)> = (0..4)
            .map(|k| {
                let wing = Wing::new(Pose::new(Point::new(-40.0 * f64::from(k), -20.0), 0.0));
                let executive = round(&wing);
                (wing, executive)
            })
            .collect();
        let gaps = |all: &[(Wing, Executive)]| {
            let at: Vec<(f64, f64)> = all
                .iter()
                .map(|(w, e)| e.transit.along_loop_m(w.pose).unwrap())
                .collect();
            let whole_m = at[0].1;
            let to_next = |m: f64| {
                let others = at.iter().map(|o| (o.0 - m).rem_euclid(whole_m));
                others.filter(|d| *d > 0.0).fold(whole_m, f64::min)
            };
            at.iter().map(|a| to_next(a.0)).fold(0.0, f64::max) / (whole_m / 4.0)
        };
        let mut begun = None;
        for step in 0..12_000 {
            let poses: Vec<Pose> = all.iter().map(|(w, _)| w.pose).collect();
            for (i, (wing, executive)) in all.iter_mut().enumerate() {
                if step % 5 == 0 {
                    let others = poses.iter().enumerate().filter(|(j, _)| *j != i);
                    let fellow = |(_, pose): (usize, &Pose)| Fellow {
                        pose: *pose,
                        age_ms: 400,
                    };
                    let others: Vec<Fellow> = others.map(fellow).collect();
                    executive.keep_even(&others);
                }
                let (setpoint, _) = executive.step(&wing.percept(), &|_| false);
                wing.setpoint = Some(setpoint);
                wing.fly(200);
            }
            if step == 300 {
                begun = Some(gaps(&all));
            }
        }
        assert!(begun.is_some_and(|g| g > 2.5), "{begun:?}");
        let ended = gaps(&all);
        assert!(ended < 1.1, "{ended}");
    }

    #[test]
    fn a_heading_tells_which_of_two_ways_on_one_line_is_flown() {
        let pose = Pose::new(Point::new(0.0, 0.0), 0.0);
        let wing = Wing::new(pose);
        let executive = round(&wing);
        for boundary in [3, 20, 41] {
            let there = on(&executive, boundary);
            let (at_m, whole_m) = executive.transit.along_loop_m(there).unwrap();
            let until: f64 = (0..u16::try_from(boundary).unwrap())
                .map(|c| executive.transit.forward_m(c))
                .sum();
            let off_m = (at_m - until).rem_euclid(whole_m);
            assert!(off_m.min(whole_m - off_m) < 1.0, "{at_m} {until}");
            let east = Pose::new(
                there.position()
                    + 2.0 * Vector::new(cos(there.heading_rad), sin(there.heading_rad)),
                there.heading_rad,
            );
            let (on_m, _) = executive.transit.along_loop_m(east).unwrap();
            assert!((on_m - at_m).rem_euclid(whole_m) < 5.0);
        }
    }
}
