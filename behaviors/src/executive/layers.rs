//! The heights of a volume that is flown in layers (D2.7 §1.2.2, executive layer): whether the
//! UAV is where its layer is seen from, and what it flies until it is.
//!
//! | it is | cells | track |
//! |---|---|---|
//! | within its layer | are seen and flown | as the goal says |
//! | on the way to it | are not seen, whatever is in the picture | for legs: to a circle where they begin |
//! | held up there by others for [`PATIENCE_MS`] | likewise | on along the loop, where others are |
//! | at a height at which another one stays near by | likewise | a circle where it is |
//!
//! Which height comes next is the reactive layer's (`reactive::climb`).

use super::transit::{Move, Place};
use super::{Aim, Executive, Kind, Played};
use crate::percept::Percept;
use crate::reactive::climb::Climb;

/// Who got no higher for so long flies on, milliseconds: whoever circles above it may do so for
/// as long as it flies.
pub const PATIENCE_MS: u64 = 20_000;

/// Where a UAV is on its way to its layer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layered {
    climb: Climb,
    /// Whether it was within its layer at the last percept.
    is_there: bool,
    /// The height at the last percept, metres.
    height_m: f64,
    /// Since when it got no higher or lower, milliseconds.
    stays_since_ms: u64,
    /// Whether it flies on since it was held up.
    is_held_up: bool,
    /// Whether it has to circle where it is, since another one near by stays at its height.
    shares: bool,
}

impl Executive {
    /// The same, flying to its slot in a layer first, and seeing cells from there alone.
    #[must_use]
    pub fn with_layer(mut self, climb: Climb) -> Self {
        self.layered = Some(Layered {
            height_m: self.height_m,
            climb,
            is_there: false,
            stays_since_ms: 0,
            is_held_up: false,
            shares: false,
        });
        self
    }

    /// Whether it is on its way to its layer.
    #[must_use]
    pub fn changes_layer(&self) -> bool {
        self.layered.as_ref().is_some_and(|l| !l.is_there)
    }

    /// To which height it flies now, metres above the origin; on its way to another layer the
    /// next at which it may stay.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        self.height_m
    }

    /// How long it takes to its layer if nobody is in the way, milliseconds.
    pub(super) fn to_layer_ms(&self) -> u32 {
        let left_s = |l: &Layered| l.climb.left_s(l.height_m);
        let left_s = self.layered.as_ref().map_or(0.0, left_s);
        super::prediction::whole_ms((left_s * 1000.0).ceil())
    }

    /// Takes note of its height, and of who is near: where to it may climb.
    pub(super) fn note_height(&mut self, percept: &Percept) {
        let Some(layered) = &mut self.layered else {
            return;
        };
        if !percept.height_m.is_finite() {
            return;
        }
        self.height_m = layered.climb.next_m(percept, self.aim == Aim::Legs);
        let shared = core::mem::replace(&mut layered.shares, layered.climb.shares(percept));
        let moves = (self.height_m - percept.height_m).abs() > 0.1;
        if moves || layered.stays_since_ms == 0 {
            layered.stays_since_ms = percept.time_ms;
        }
        layered.height_m = percept.height_m;
        let was = (layered.is_there, layered.is_held_up);
        // It circles from here on.
        self.replan |= !was.0 && layered.shares && !shared;
        layered.is_there = layered.climb.is_in_layer(percept.height_m);
        let stays_ms = percept.time_ms.saturating_sub(layered.stays_since_ms);
        // Once it flies on it does so until it is there: who circles is met again.
        layered.is_held_up = !layered.is_there && (was.1 || stays_ms >= PATIENCE_MS);
        if was != (layered.is_there, layered.is_held_up) && self.aim == Aim::Legs {
            self.replan = true;
        }
    }

    /// What was flown since the last percept, as far as cells count that were seen on it; `None`
    /// where none count, and `Some(None)` where those of this percept alone do.
    pub(super) fn played_in_layer(&self, percept: &Percept) -> Option<Option<&Played>> {
        let played = self.played.as_ref();
        let Some(layered) = &self.layered else {
            return Some(played);
        };
        let counts = |p: &Percept| layered.climb.is_in_layer(p.height_m);
        counts(percept).then(|| played.filter(|p| counts(&p.percept)))
    }

    /// What is flown until it is at its layer; `None` where it is, or its goal asks for no cells.
    pub(super) fn wait_for_layer(
        &mut self,
        at: &Place,
        is_open: &dyn Fn(u16) -> bool,
    ) -> Option<Vec<Move>> {
        let layered = self.layered.as_ref().filter(|l| !l.is_there)?;
        if !matches!(self.aim, Aim::Legs | Aim::Detour) {
            return None;
        }
        if layered.shares {
            return Some(self.transit.way_to_loiter(at));
        }
        if layered.is_held_up
            && let Some(moves) = self.transit.way_round(at)
        {
            return Some(moves);
        }
        if let Some(Kind::Loiter(circle)) = self.stretches.back().map(|s| s.kind) {
            return Some(vec![Move::Loiter(circle)]);
        }
        let first = self.queue.iter().find(|visit| is_open(visit.cell))?;
        let begins = self.transit.entry(first.cell, first.direction);
        let begins = self.transit.place(begins, first.direction).pose.position();
        let way = self.transit.way_to_wait_at(at, begins);
        Some(way.unwrap_or_else(|| self.transit.way_to_loiter(at)))
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "heights are told exactly")]
mod tests {
    use crate::event::Event;
    use crate::executive::{Executive, Goal};
    use crate::percept::Percept;
    use crate::reactive::climb::{Climb, STUCK_MS, Slots};
    use crate::testing::{Wing, airframe, loop_and_router};
    use crate::traffic::{Sighting, Traffic};
    use skein_flight::coverage::ring::Direction;
    use skein_flight::coverage::ring::backtracking::Leg;
    use skein_geometry::frame::{Point, Pose};

    struct Flight {
        executive: Executive,
        wing: Wing,
        height_m: f64,
        open: Vec<bool>,
        /// At which heights cells were seen, metres.
        seen_m: Vec<f64>,
        refused: usize,
    }

    impl Flight {
        /// The UAV with number 2 of four, in the first of two layers, with legs in the second.
        fn new() -> Self {
            let slots = Slots {
                layers_m: vec![60.0, 100.0],
                step_m: 5.0,
                count: 4,
            };
            let (coverage_loop, router) = loop_and_router(6, 4, Vec::new());
            let open = vec![true; coverage_loop.len()];
            let climb = Climb::new(slots, (2, 5.0), 1, (3.0, 18.0));
            let mut executive =
                Executive::new(airframe(), 65.0, coverage_loop, router).with_layer(climb);
            let legs = vec![Leg {
                first: 3,
                count: 6,
                direction: Direction::Forward,
            }];
            executive.set_goal(Goal::Legs(legs), &|_| true);
            Self {
                executive,
                wing: Wing::new(Pose::new(Point::new(-60.0, -40.0), 0.4)),
                height_m: 65.0,
                open,
                seen_m: Vec::new(),
                refused: 0,
            }
        }

        /// Flies for so long beside another one that is straight above or below, if any.
        fn fly(&mut self, for_s: u64, beside: Option<(u16, f64)>) {
            for _ in 0..for_s * 5 {
                let at = self.wing.percept().pose;
                #[allow(clippy::cast_possible_truncation, reason = "small numbers")]
                let other = beside.map(|(id, height_m)| Sighting {
                    id,
                    east_dm: (at.east_m * 10.0) as i32,
                    north_dm: (at.north_m * 10.0) as i32,
                    height_dm: (height_m * 10.0) as i32,
                });
                let percept = Percept {
                    height_m: self.height_m,
                    traffic: Traffic::new(5_000.0, other),
                    ..self.wing.percept()
                };
                let open = self.open.clone();
                let is_open = |c: u16| open[usize::from(c)];
                let (setpoint, events) = self.executive.step(&percept, &is_open);
                for event in events {
                    match event {
                        Event::Seen(cells) => {
                            for cell in cells {
                                self.open[usize::from(cell)] = false;
                                self.seen_m.push(self.height_m);
                            }
                        }
                        Event::Refused { .. } => self.refused += 1,
                        _ => {}
                    }
                }
                self.height_m += (setpoint.height_m - self.height_m).clamp(-0.6, 0.6);
                self.wing.setpoint = Some(setpoint);
                self.wing.fly(200);
            }
        }
    }

    #[test]
    fn cells_are_seen_from_within_the_layer_alone_and_none_is_given_up_on_the_way() {
        let mut flight = Flight::new();
        let left_ms = {
            flight.fly(1, None);
            flight.executive.to_layer_ms()
        };
        assert!((11_000..14_000).contains(&left_ms), "{left_ms}");
        let told_ms = flight.executive.finish_ms(&|_| true);
        assert!(told_ms > left_ms + 6 * 48 * 1_000 / 13, "{told_ms}");
        flight.fly(8, None);
        assert!(flight.executive.changes_layer() && flight.seen_m.is_empty());
        flight.fly(60, None);
        assert!(!flight.executive.changes_layer() && flight.height_m == 105.0);
        assert!(flight.seen_m.len() >= 6, "{:?}", flight.seen_m);
        assert!(
            flight.seen_m.iter().all(|m| *m >= 99.0),
            "{:?}",
            flight.seen_m
        );
        assert_eq!(flight.refused, 0);
        assert!((3..9).all(|c| !flight.open[c]));
    }

    /// Who cruises above it is waited for in a circle where the cells begin; who stays there for
    /// good is left behind along the loop.
    #[test]
    fn who_is_held_up_circles_and_then_flies_on() {
        let mut flight = Flight::new();
        let above = Some((3, 70.0));
        flight.fly(12, above);
        assert_eq!(flight.height_m, 67.5);
        assert!(flight.seen_m.is_empty() && flight.refused == 0);
        let held = flight.executive.layered.as_ref().unwrap();
        assert!(!held.is_held_up && !held.shares);
        flight.fly(super::PATIENCE_MS / 1000, above);
        assert!(flight.executive.layered.as_ref().unwrap().is_held_up);
        let before = flight.wing.pose.position();
        flight.fly(12, above);
        let flown_m = (flight.wing.pose.position() - before).norm();
        assert!(flown_m > 60.0, "{flown_m}");
        flight.fly(STUCK_MS / 1000 + 60, None);
        assert!(!flight.executive.changes_layer());
        assert!((3..9).all(|c| !flight.open[c]) && flight.refused == 0);
    }

    /// One that flies under its number is at its slot for good.
    #[test]
    fn whose_slot_is_held_sees_its_cells_from_beside_it() {
        let mut flight = Flight::new();
        flight.fly(STUCK_MS / 1000 + 60, Some((9, 105.0)));
        assert!(!flight.executive.changes_layer() && flight.height_m == 102.5);
        assert!((3..9).all(|c| !flight.open[c]) && flight.refused == 0);
    }

    #[test]
    fn what_has_no_cells_for_it_keeps_its_height_where_others_climb_and_never_descends() {
        let mut flight = Flight::new();
        flight.executive.set_goal(Goal::Hold, &|_| true);
        flight.fly(30, None);
        assert_eq!(flight.height_m, 105.0, "upwards it goes at once");
        let mut above = Flight::new();
        above.executive.set_goal(Goal::Hold, &|_| true);
        above.height_m = 137.5;
        above.fly(10, None);
        assert!(
            above.height_m >= 117.0 && above.height_m <= 137.5,
            "{}",
            above.height_m
        );
        let rests_m = above.height_m;
        above.fly(30, None);
        assert_eq!(above.height_m, rests_m);
    }
}
