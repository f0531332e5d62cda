//! The executive layer: flies legs of the coverage loop one after the other, and
//! goes to a point when told to.

use crate::event::Event;
use crate::percept::Percept;
use crate::setpoint::Setpoint;
use serde::{Deserialize, Serialize};
use skein_planning::airframe::Airframe;
use skein_planning::coverage::area::backtracking::Leg;
use skein_planning::coverage::area::{CoverageLoop, Direction};
use skein_planning::frame::Point;
use skein_planning::path::Router;
use std::sync::Arc;

/// What a UAV is doing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Goal {
    /// Loiter where it is.
    Hold,
    /// Fly these legs in order, then loiter.
    Legs(Vec<Leg>),
    /// Fly to this point, then loiter around it.
    Point(Point),
}

/// Where the UAV will be when it has flown for a while under its present goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Cells it will have served by then, in order.
    pub cells: Vec<u16>,
    /// The boundary of the loop where it will be, or which it can next reach.
    pub anchor: u16,
    /// Which way it looks there.
    pub heading: Direction,
    /// When it is there, milliseconds from now.
    pub release_ms: u32,
    /// When all legs are flown, milliseconds from now.
    pub finish_ms: u32,
}

/// The executive of one UAV.
#[derive(Clone, Debug)]
pub struct Executive {
    airframe: Airframe,
    height_m: f64,
    coverage_loop: Arc<CoverageLoop>,
    router: Arc<Router>,
}

impl Executive {
    /// An executive that holds until it is given a goal.
    #[must_use]
    pub fn new(airframe: Airframe, height_m: f64, coverage_loop: Arc<CoverageLoop>, router: Arc<Router>) -> Self {
        Self { airframe, height_m, coverage_loop, router }
    }

    /// Replaces the goal. Legs already under way go on where they are if the new
    /// legs begin with the cell being flown in the same direction.
    ///
    /// `is_open` tells which cells of the loop still need service: cells that do
    /// not are passed, or flown round by a direct route where that is shorter.
    pub fn set_goal(&mut self, goal: Goal, is_open: &dyn Fn(u16) -> bool) {
        let _ = (goal, is_open);
        todo!("behaviors helper")
    }

    /// Answers a percept with a setpoint, already passed through the envelope.
    pub fn step(&mut self, percept: &Percept, is_open: &dyn Fn(u16) -> bool) -> (Setpoint, Vec<Event>) {
        let _ = (percept, is_open, &self.airframe, self.height_m, &self.coverage_loop, &self.router);
        todo!("behaviors helper")
    }

    /// Where the UAV will be `window_ms` from its last percept, at the end of a cell.
    #[must_use]
    pub fn forecast(&self, window_ms: u32, is_open: &dyn Fn(u16) -> bool) -> Forecast {
        let _ = (window_ms, is_open);
        todo!("behaviors helper")
    }

    /// When all legs are flown, milliseconds from the last percept.
    #[must_use]
    pub fn finish_ms(&self, is_open: &dyn Fn(u16) -> bool) -> u32 {
        self.forecast(0, is_open).finish_ms
    }

    /// Predicted flight time of legs from the present state, milliseconds.
    #[must_use]
    pub fn leg_time_ms(&self, legs: &[Leg], is_open: &dyn Fn(u16) -> bool) -> u32 {
        let _ = (legs, is_open);
        todo!("behaviors")
    }

    /// Flight time left above the reserve, milliseconds.
    #[must_use]
    pub fn spendable_ms(&self, percept: &Percept) -> u32 {
        let _ = percept;
        todo!("behaviors")
    }

    /// Time of a turn to the opposite heading at the same place, milliseconds.
    #[must_use]
    pub fn turn_ms(&self) -> u32 {
        todo!("behaviors")
    }
}
