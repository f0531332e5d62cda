//! What stays of a flight when its goal changes (D2.7 §1.2.3, executive layer).
//!
//! New legs that go on where the UAV is must not disturb the flight; others are taken
//! up at the next percept, or at the end of the cell where that is no detour.

use super::circuit::Circuit;
use super::transit::{CellVisit, Place};
use super::{Aim, Executive, Goal, Kind, Stretch};
use skein_flight::coverage::ring::backtracking::Leg;
use std::collections::VecDeque;

impl Executive {
    /// Replaces the goal. Legs already under way go on where they are if the new
    /// legs begin with the cell being flown in the same direction.
    ///
    /// `is_open` tells which cells of the loop still need service: cells that do
    /// not are passed, or flown round by a direct route where that is shorter.
    pub fn set_goal(&mut self, goal: Goal, is_open: &dyn Fn(u16) -> bool) {
        let mut begins_with = None;
        let goal = match goal {
            // By promises nothing but cells is flown.
            Goal::Detour(_, legs) if self.contingency.is_some() => Goal::Legs(legs),
            Goal::Circle(_) | Goal::Round | Goal::Trace | Goal::Follow(_)
                if self.contingency.is_some() =>
            {
                Goal::Hold
            }
            goal => goal,
        };
        if !matches!(goal, Goal::Given(_) | Goal::Detour(..)) {
            self.take_back();
        }
        if !matches!(goal, Goal::Follow(_)) {
            self.end_pursuit();
        }
        let (aim, kept, queue) = match goal {
            Goal::Legs(legs) => {
                let visits = self.visits(&legs);
                begins_with = visits.iter().find(|visit| is_open(visit.cell)).copied();
                let (kept, queue) = if self.contingency.is_some() {
                    self.agreed_continued(visits, is_open)
                } else {
                    self.continued(visits, is_open)
                };
                (Aim::Legs, kept, queue)
            }
            Goal::Hold => (
                Aim::Hold,
                // Who circles where it was told to stays there.
                self.loitering(matches!(self.aim, Aim::Hold | Aim::Circle(_))),
                VecDeque::new(),
            ),
            Goal::Point(p) => {
                let same = self.aim == Aim::Point(p) && !self.replan;
                (
                    Aim::Point(p),
                    if same { self.stretches.len() } else { 0 },
                    VecDeque::new(),
                )
            }
            Goal::Circle(circle) => {
                let same = self.aim == Aim::Circle(circle) && !self.replan;
                (
                    Aim::Circle(circle),
                    if same { self.stretches.len() } else { 0 },
                    VecDeque::new(),
                )
            }
            Goal::Round => (Aim::Round, self.rounded(), VecDeque::new()),
            Goal::Trace => (Aim::Trace, self.begin_trace(), VecDeque::new()),
            Goal::Follow(stand_off_m) => {
                self.begin_pursuit(stand_off_m);
                (Aim::Follow, 0, VecDeque::new())
            }
            Goal::Given(flight) => {
                let same = self.give(flight) && !self.replan;
                (
                    Aim::Given,
                    if same { self.stretches.len() } else { 0 },
                    VecDeque::new(),
                )
            }
            Goal::Detour(flight, legs) => {
                let same = self.give(flight);
                self.detour_reported &= same;
                let (kept, queue) = self.detoured(same, self.visits(&legs), is_open);
                (Aim::Detour, kept, queue)
            }
        };
        self.end_reported = false;
        if !matches!(aim, Aim::Round | Aim::Trace) {
            self.circuit = Circuit::default();
        }
        let same_aim = self.aim == aim;
        self.stranded &= same_aim;
        self.aim = aim;
        if self.contingency.is_some() {
            if !same_aim {
                self.aim_anew();
            }
            self.queue = queue;
            let kept = if self.replan { 0 } else { kept };
            self.unwant_beyond(kept, false);
            if kept > 0 {
                self.serve_first(begins_with);
            }
            return;
        }
        self.replan = self.replan || kept == 0;
        if kept > 0 {
            self.keep(kept);
            self.serve_first(begins_with);
            self.queue = queue;
            self.lengthen_now(is_open);
        } else {
            // What is on the track is no longer wanted; it is flown until the next step.
            for s in &mut self.stretches {
                if let Kind::Serve(visit) = s.kind {
                    s.kind = Kind::Pass(visit.cell, visit.direction);
                }
            }
            self.queue = queue;
        }
    }

    /// A track that was cut off goes on before the next percept, by which the UAV may
    /// have flown past its end.
    fn lengthen_now(&mut self, is_open: &dyn Fn(u16) -> bool) {
        let Some(end) = self.stretches.back().map(|s| s.end) else {
            return;
        };
        let mut events = std::mem::take(&mut self.pending);
        self.lengthen(end, is_open, &mut events);
        events.append(&mut self.pending);
        self.pending = events;
    }

    /// A cell that was only passed is to be served from now on.
    fn serve_first(&mut self, begins_with: Option<CellVisit>) {
        if let (Some(front), Some(visit)) = (self.stretches.front_mut(), begins_with)
            && front.kind == Kind::Pass(visit.cell, visit.direction)
        {
            front.kind = Kind::Serve(visit);
        }
    }

    /// All stretches if they are a loiter and may stay, else none.
    fn loitering(&self, may_stay: bool) -> usize {
        let is = matches!(
            self.stretches.front().map(|s| s.kind),
            Some(Kind::Loiter(_))
        );
        if is && may_stay && !self.replan {
            self.stretches.len()
        } else {
            0
        }
    }

    /// The cells of legs, in order of flight.
    pub(super) fn visits(&self, legs: &[Leg]) -> VecDeque<CellVisit> {
        let n = self.transit.coverage_loop.len();
        legs.iter()
            .flat_map(|l| {
                l.cells(n).map(|cell| CellVisit {
                    cell,
                    direction: l.direction,
                    tries: 0,
                })
            })
            .collect()
    }

    /// How many stretches stay when `visits` become the plan, and which visits then wait.
    pub(super) fn continued(
        &self,
        mut visits: VecDeque<CellVisit>,
        is_open: &dyn Fn(u16) -> bool,
    ) -> (usize, VecDeque<CellVisit>) {
        let first = visits.front().map(|visit| (visit.cell, visit.direction));
        visits.retain(|visit| is_open(visit.cell));
        let Some(next) = visits.front().copied() else {
            return (self.loitering(true), visits);
        };
        let Some(front) = self.stretches.front().filter(|_| !self.replan) else {
            return (0, visits);
        };
        let next_cell = Some((next.cell, next.direction));
        if front.kind.cell() == next_cell {
            visits.pop_front();
            return (self.matching(1, &mut visits), visits);
        }
        if front.kind == Kind::Route {
            return (self.matching(0, &mut visits), visits);
        }
        if front.kind.cell().is_none() {
            return (0, visits);
        }
        let finishes = first.is_some()
            && front.kind.cell() == first
            && !is_open(front.kind.cell().map_or(0, |c| c.0));
        if finishes || self.is_shorter_after(front, &next) {
            return (self.matching(1, &mut visits), visits);
        }
        (0, visits)
    }

    /// Of the stretches after the first `kept`, those stay too that lead to the cells
    /// that `visits` wants next; these are taken off it.
    pub(super) fn matching(&self, mut kept: usize, visits: &mut VecDeque<CellVisit>) -> usize {
        for (i, s) in self.stretches.iter().enumerate().skip(kept) {
            let Some(visit) = s.kind.visit() else {
                continue;
            };
            if visits
                .front()
                .is_none_or(|next| (next.cell, next.direction) != (visit.cell, visit.direction))
            {
                break;
            }
            visits.pop_front();
            kept = i + 1;
        }
        kept
    }

    /// Whether finishing the stretch that is flown first costs no way to `next`.
    fn is_shorter_after(&self, front: &Stretch, next: &CellVisit) -> bool {
        let entry = self.transit.entry(next.cell, next.direction);
        let length_m = |from: &Place| {
            let moves = self.transit.connect(from, entry, next.direction)?;
            Some(moves.iter().map(|m| self.transit.length_m(m)).sum::<f64>())
        };
        let Some(after_m) = length_m(&front.end) else {
            return false;
        };
        let Some(pose) = self.track.pose() else {
            return false;
        };
        let now_m = length_m(&Place {
            pose,
            boundary: None,
        });
        let finish_m = self.air_m_until(front.end_m);
        now_m.is_none_or(|m| finish_m + after_m <= m + 1.0)
    }

    /// Gives up all stretches but the first `count`.
    pub(super) fn keep(&mut self, count: usize) {
        self.stretches.truncate(count);
        if let Some(last) = self.stretches.back() {
            self.track.truncate(last.end_m);
        }
    }
}
