//! What the fuel allows, by place: from wherever a plan leaves a UAV it must come home with its
//! reserve (D2.7 §2.3.1, §3.6.5).
//!
//! What the way home takes is known at each boundary of the loop (`way_home.rs`).
//! Everything here is a question; nothing changes what is flown.
//!
//! # Guarantees
//! A cell that [`Executive::within_endurance`] lets stay ends where the way home is known, and
//! with at least what that takes, turns included, beside the reserve.

use super::Executive;
use super::prediction::{UNREACHABLE_MS, whole_ms};
use super::transit::{Move, Place, Transit};
use super::way_home::{WaysHome, flown_s, is_straight_clear, straight_s};
use crate::percept::Percept;
use skein_flight::coverage::ring::Direction;
use skein_flight::coverage::ring::backtracking::Leg;
use skein_flight::trajectory::dubins::shortest;
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::PI;
use std::cell::Cell;

/// The least time for a turn at each end of the way home, seconds: two full circles of
/// 30 m at 13 m/s; more where turning round twice takes longer.
const TURNS_S: f64 = 30.0;

/// Turning round takes so many radii: a bulb.
const TURN_ROUND_RADII: f64 = 7.0 * PI / 3.0;

/// Both ways along the loop.
const BOTH: [Direction; 2] = [Direction::Forward, Direction::Backward];

/// Where a UAV returns to, and what that takes.
#[derive(Clone, Debug)]
pub(super) struct Home {
    at: Point,
    ways: WaysHome,
    /// From each boundary of the loop, with a turn at each end, milliseconds; none where there
    /// is no way.
    each_ms: Vec<Option<u32>>,
    /// Whether there is a way from each of them.
    from_everywhere: bool,
    /// A turn at each end, milliseconds.
    turns_ms: u32,
    /// The way last looked for off the loop: from where, and what it takes.
    off_loop: Cell<Option<(Pose, Option<u32>)>>,
}

impl Home {
    pub(super) fn new(transit: &Transit, at: Point, ways: WaysHome) -> Self {
        let home = Self {
            at,
            ways,
            each_ms: Vec::new(),
            from_everywhere: true,
            turns_ms: 0,
            off_loop: Cell::default(),
        };
        home.in_air_of(transit)
    }

    /// The same in another wind.
    pub(super) fn in_air_of(mut self, transit: &Transit) -> Self {
        let turns_s = turns_s(transit);
        let each_s = self.ways.each_s(transit).into_iter();
        self.each_ms = each_s.map(|s| known_ms(s + turns_s)).collect();
        self.from_everywhere = self.each_ms.iter().all(Option::is_some);
        self.turns_ms = known_ms(turns_s).unwrap_or(UNREACHABLE_MS);
        self.off_loop.take();
        self
    }

    fn from(&self, boundary: u16) -> Option<u32> {
        self.each_ms.get(usize::from(boundary)).copied().flatten()
    }

    /// From a pose in sight of the home.
    fn straight_ms(&self, transit: &Transit, from: Point) -> Option<u32> {
        let is_clear = is_straight_clear(transit, from, self.at);
        let takes_s = is_clear.then(|| straight_s(transit, self.at - from))?;
        known_ms(takes_s)?.checked_add(self.turns_ms)
    }

    /// The way to the home, and a circle there, along the loop, to a boundary from which another one is known: where
    /// none leads there from elsewhere.
    pub(super) fn by_loop(&self, transit: &Transit, from: &Place, to: Point) -> Option<Vec<Move>> {
        if to != self.at || self.each_ms.iter().all(Option::is_none) {
            return None;
        }
        let boundary = match from.boundary {
            Some((boundary, _)) => boundary,
            None => transit.way_on(from.pose)?.0,
        };
        let mut found = BOTH.map(|d| (self.ways.next_known(boundary, d), d));
        let away = |to: &Option<(u16, usize)>| to.map_or(usize::MAX, |(_, cells)| cells);
        found.sort_by_key(|(to, _)| away(to));
        found.into_iter().find_map(|(to, direction)| {
            let (to, _) = to?;
            let last = transit.place(to, direction);
            let mut moves = transit.connect(from, to, direction)?;
            moves.extend(transit.way_to_wait_at(&last, self.at)?);
            Some(moves)
        })
    }

    /// From any pose: straight, else by a route, else by the loop.
    fn off_loop_ms(&self, transit: &Transit, from: Pose) -> Option<u32> {
        if let Some(ms) = self.straight_ms(transit, from.position()) {
            return Some(ms);
        }
        if let Some((_, ms)) = self.off_loop.get().filter(|(pose, _)| *pose == from) {
            return ms;
        }
        // Where nobody comes home from the loop a search would end in vain, and late.
        if self.each_ms.iter().all(Option::is_none) {
            return None;
        }
        let routed_ms = || {
            let route = transit.transfer_to_point(from, self.at).ok()?;
            known_ms(flown_s(transit, transit.air().air_length_m(&route)))
        };
        let by_loop_ms = || {
            let (boundary, _, way_m) = transit.way_on(from)?;
            self.from(boundary)?
                .checked_add(known_ms(flown_s(transit, way_m))?)
        };
        let ms = routed_ms()
            .and_then(|ms| ms.checked_add(self.turns_ms))
            .or_else(by_loop_ms);
        self.off_loop.set(Some((from, ms)));
        ms
    }
}

/// What turning takes at both ends of the way home, seconds.
fn turns_s(transit: &Transit) -> f64 {
    let round_s = if transit.air().is_calm() {
        flown_s(transit, TURN_ROUND_RADII * transit.turn_radius_m())
    } else {
        transit.turn_round_s()
    };
    TURNS_S.max(2.0 * round_s)
}

/// Milliseconds, rounded up; none where it takes as long as what cannot be done.
fn known_ms(s: f64) -> Option<u32> {
    let ms = whole_ms((s * 1000.0).ceil());
    (ms < UNREACHABLE_MS).then_some(ms)
}

/// Why a plan is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// What would be left at the end of the cell is not enough for the way home.
    Fuel,
    /// There is no way home from where the cell ends.
    NoWayHome,
}

/// How much of a plan can be flown by a UAV that then comes home.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Within {
    /// The open cells up to the first that cannot, each with when it is done, milliseconds from
    /// the last percept.
    pub cells: Vec<(u16, u32)>,
    /// The first that cannot, and why.
    pub cut: Option<(u16, Cut)>,
    /// What could be flown besides before the first of them, and all would still be within the
    /// endurance, milliseconds.
    pub spare_ms: u32,
}

impl Executive {
    /// What the way home may take from anywhere on the loop from where there is one,
    /// milliseconds.
    #[must_use]
    pub fn home_ms(&self) -> u32 {
        let each = self.home.as_ref().map(|home| home.each_ms.iter().flatten());
        each.and_then(|ms| ms.max()).copied().unwrap_or(0)
    }

    /// What the way home may take from a boundary of the loop, turns included, milliseconds:
    /// none where zones or the wind leave no way. Nothing where no home is known.
    #[must_use]
    pub fn home_from_ms(&self, boundary: u16) -> Option<u32> {
        self.home
            .as_ref()
            .map_or(Some(0), |home| home.from(boundary))
    }

    /// What the way home may take from where the UAV is, milliseconds: straight where it sees
    /// the home, else from the next boundary that it flies to, else by a route from the end of
    /// what it flies. None where there is no way.
    #[must_use]
    pub fn home_now_ms(&self) -> Option<u32> {
        let Some(home) = &self.home else {
            return Some(0);
        };
        let Some(here) = self.here() else {
            return Some(self.home_ms());
        };
        let (transit, at) = (&self.transit, here.pose.position());
        if let Some(ms) = home.straight_ms(transit, at) {
            return Some(ms);
        }
        if self.replan {
            return home.off_loop_ms(transit, here.pose);
        }
        let flown = &self.stretches;
        let on_loop = flown
            .iter()
            .find_map(|s| Some((s.end_m, home.from(s.end.boundary?.0)?)));
        let at_end = || {
            let last = flown.back()?;
            Some((last.end_m, home.off_loop_ms(transit, last.end.pose)?))
        };
        match on_loop.or_else(at_end) {
            Some((end_m, ms)) => ms.checked_add(self.ms(self.air_m_until(end_m))),
            None => home.off_loop_ms(transit, here.pose),
        }
    }

    /// Whether there is enough left to fly what a task asks for, once the cell that is flown is
    /// done, and to come home from its end.
    #[must_use]
    pub fn returns_from(&self, flown: &Curve, percept: &Percept) -> bool {
        let (Some(home), Some(here)) = (&self.home, self.here()) else {
            return true;
        };
        let front = self.stretches.front().filter(|_| !self.replan);
        let in_cell = front.filter(|s| s.kind.cell().is_some());
        let (from, before_m) = in_cell.map_or((here.pose, 0.0), |s| {
            (s.end.pose, self.air_m_until(s.end_m))
        });
        let transit = &self.transit;
        let router = &transit.router;
        let here_m = router.zones().distance_m(from.position());
        let takes_ms = || {
            let (start, end) = flown.start().zip(flown.end())?;
            // No route begins where a zone came near: the UAV gets away from it first.
            let there = if here_m < router.limits().clearance_m {
                shortest(from, start, transit.turn_radius_m())
            } else {
                transit.route(from, start).ok()?
            };
            let air_m = [&there, flown].map(|curve| transit.air().air_length_m(curve));
            let flown_ms = self.ms(before_m + air_m.iter().sum::<f64>());
            home.off_loop_ms(transit, end)?.checked_add(flown_ms)
        };
        takes_ms().is_some_and(|ms| ms <= self.left_ms(percept))
    }

    /// Flight time that is left above the reserve, and what is kept because it may be noticed
    /// late that the fuel is due, milliseconds.
    #[must_use]
    pub fn left_ms(&self, percept: &Percept) -> u32 {
        whole_ms((percept.endurance_s - self.transit.airframe.reserve_s) * 1000.0)
            .saturating_sub(self.late_ms)
    }

    /// What is kept beside the reserve where the UAV is: for the way home, and because it may be
    /// noticed late that the fuel is due, milliseconds.
    #[must_use]
    pub fn kept_ms(&self) -> u32 {
        let home_ms = self.home_now_ms().unwrap_or(UNREACHABLE_MS);
        home_ms.saturating_add(self.late_ms)
    }

    /// What may be flown before the UAV must turn home from where it is, milliseconds; 0 where
    /// there is no way home.
    #[must_use]
    pub fn spendable_ms(&self, percept: &Percept) -> u32 {
        let home_ms = self.home_now_ms().unwrap_or(UNREACHABLE_MS);
        self.left_ms(percept).saturating_sub(home_ms)
    }

    /// Whether the UAV must turn home now. Who has no way home flies on until its reserve: a
    /// wind may drop, and to turn would not help.
    #[must_use]
    pub fn fuel_is_due(&self, percept: &Percept) -> bool {
        self.left_ms(percept) <= self.home_now_ms().unwrap_or(0)
    }

    /// What may be flown wherever among the open cells it ends, milliseconds: what is left less
    /// the longest way home from any of them; 0 where there is none from one of them.
    #[must_use]
    pub fn offered_ms(&self, percept: &Percept, is_open: &dyn Fn(u16) -> bool) -> u32 {
        let home_ms = |cell: u16| {
            let ends = BOTH.map(|d| self.home_from_ms(self.transit.exit(cell, d)));
            ends.map(|ms| ms.unwrap_or(UNREACHABLE_MS))
                .into_iter()
                .max()
        };
        let longest_ms = self.open_cells(is_open).filter_map(home_ms).max();
        self.left_ms(percept)
            .saturating_sub(longest_ms.unwrap_or(0))
    }

    /// Open cells, at an end of which there is no way home.
    #[must_use]
    pub fn n_without_way_home(&self, is_open: &dyn Fn(u16) -> bool) -> usize {
        // Asked for with each percept, and there are ways nearly always.
        if self.home.as_ref().is_none_or(|home| home.from_everywhere) {
            return 0;
        }
        let has_none = |cell: &u16| {
            BOTH.into_iter()
                .any(|d| self.home_from_ms(self.transit.exit(*cell, d)).is_none())
        };
        self.open_cells(is_open).filter(has_none).count()
    }

    fn open_cells<'a>(&'a self, is_open: &'a dyn Fn(u16) -> bool) -> impl Iterator<Item = u16> {
        let cells = self.transit.coverage_loop.cells();
        let needed = (0u16..).zip(cells).filter(|(_, cell)| cell.needed);
        needed.map(|(i, _)| i).filter(|i| is_open(*i))
    }

    /// How much of a plan can be flown if it became the goal now, and the way home from where
    /// it ends: the one question of whoever adopts, takes or keeps cells.
    #[must_use]
    pub fn within_endurance(
        &self,
        legs: &[Leg],
        is_open: &dyn Fn(u16) -> bool,
        percept: &Percept,
    ) -> Within {
        let left_ms = self.left_ms(percept);
        let mut within = Within {
            spare_ms: self.spendable_ms(percept),
            ..Within::default()
        };
        for (visit, done_ms, end) in self.visited(legs, is_open) {
            let home_ms = match end.boundary {
                Some((boundary, _)) => self.home_from_ms(boundary),
                None => Some(0),
            };
            let spare_ms = home_ms.map(|ms| left_ms.checked_sub(done_ms.saturating_add(ms)));
            let cut = match spare_ms {
                Some(Some(ms)) => {
                    within.spare_ms = within.spare_ms.min(ms);
                    within.cells.push((visit.cell, done_ms));
                    continue;
                }
                Some(None) => Cut::Fuel,
                None => Cut::NoWayHome,
            };
            within.cut = Some((visit.cell, cut));
            break;
        }
        within
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Event;
    use crate::executive::Goal;
    use crate::testing::{Wing, airframe, loop_and_router, rectangle, square};
    use proptest::prelude::*;
    use skein_geometry::Polygon;

    /// How late the peer of these tests looks at its fuel, milliseconds.
    const LATE_MS: u32 = 1000;

    struct Flight {
        executive: Executive,
        wing: Wing,
        open: Vec<bool>,
        tank_s: f64,
        home: Point,
    }

    impl Flight {
        /// At a boundary of a loop round zones, with so much above the reserve.
        fn new(zones: &[Polygon], home: Point, boundary: usize, above_s: f64) -> Self {
            let (coverage_loop, router) = loop_and_router(10, 8, zones.to_vec());
            let n = coverage_loop.len();
            let wing = Wing::new(coverage_loop.boundary(boundary % n));
            let executive = Executive::new(airframe(), 90.0, coverage_loop, router)
                .with_late_ms(LATE_MS)
                .with_home(home);
            Self {
                executive,
                wing,
                open: vec![true; n],
                tank_s: airframe().reserve_s + above_s,
                home,
            }
        }

        fn percept(&self) -> Percept {
            #[allow(clippy::cast_precision_loss, reason = "a flight of minutes")]
            let flown_s = self.wing.time_ms as f64 / 1000.0;
            Percept {
                endurance_s: self.tank_s - flown_s,
                ..self.wing.percept()
            }
        }

        fn step(&mut self) {
            let (percept, open) = (self.percept(), self.open.clone());
            let is_open = |c: u16| open[usize::from(c)];
            let (setpoint, events) = self.executive.step(&percept, &is_open);
            for event in events {
                if let Event::Seen(cells) = event {
                    cells
                        .iter()
                        .for_each(|c| self.open[usize::from(*c)] = false);
                }
            }
            self.wing.setpoint = Some(setpoint);
            self.wing.fly(200);
        }

        fn within(&self, leg: Leg) -> Within {
            let is_open = |c: u16| self.open[usize::from(c)];
            let percept = self.percept();
            self.executive.within_endurance(&[leg], &is_open, &percept)
        }

        fn goal(&mut self, goal: Goal) {
            let open = self.open.clone();
            self.executive.set_goal(goal, &|c| open[usize::from(c)]);
        }

        fn away_m(&self) -> f64 {
            (self.wing.pose.position() - self.home).norm()
        }

        /// Flies as much of a leg as it can, waits until its fuel is due, and flies home: with
        /// how much above the reserve it comes there, seconds.
        fn returns_with_s(&mut self, leg: Leg) -> f64 {
            let done = u16::try_from(self.within(leg).cells.len()).unwrap();
            self.goal(Goal::Legs(vec![Leg { count: done, ..leg }]));
            for n in 0u32.. {
                // Its peer looks once in a while.
                if n.is_multiple_of(5) && self.executive.fuel_is_due(&self.percept()) {
                    break;
                }
                self.step();
            }
            self.goal(Goal::Point(self.home));
            let above_s = |f: &Self| f.percept().endurance_s - airframe().reserve_s;
            while self.away_m() > 60.0 && above_s(self) > -60.0 {
                self.step();
            }
            above_s(self)
        }
    }

    fn leg(first: u16, count: u16, backward: bool) -> Leg {
        let direction = if backward {
            Direction::Backward
        } else {
            Direction::Forward
        };
        Leg {
            first,
            count,
            direction,
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Whatever it was given, in whatever wind and round whatever walls: it is home before
        /// it needs its reserve.
        #[test]
        fn whoever_turns_home_when_its_fuel_is_due_comes_home_with_its_reserve(
            walls in prop::collection::vec(
                (0.0..400.0f64, 0.0..330.0f64, 10.0..200.0f64, 10.0..200.0f64), 0..3),
            home in (-250.0..700.0f64, -250.0..-20.0f64),
            wind in (-4.0..4.0f64, -4.0..4.0f64),
            (boundary, count, backward) in (0usize..60, 1u16..40, any::<bool>()),
            above_s in 60.0..260.0f64,
        ) {
            let zones: Vec<Polygon> = walls
                .iter()
                .map(|&(x, y, width, height)| rectangle(x, y, width, height))
                .collect();
            let mut f = Flight::new(&zones, Point::new(home.0, home.1), boundary, above_s);
            let n = u16::try_from(f.open.len()).unwrap();
            f.wing.wind_mps = wind;
            f.step();
            prop_assume!(!f.executive.fuel_is_due(&f.percept()));
            let first = u16::try_from(boundary).unwrap() % n;
            let above_s = f.returns_with_s(leg(first, count.min(n), backward));
            prop_assert!(above_s >= 0.0, "{above_s} s above its reserve, {} m away", f.away_m());
        }
    }

    #[test]
    fn a_plan_is_cut_by_where_each_of_its_cells_ends() {
        let home = Point::new(-60.0, -60.0);
        let mut f = Flight::new(&[square(180.0, 150.0, 60.0)], home, 0, 400.0);
        f.step();
        let n = u16::try_from(f.open.len()).unwrap();
        let all = f.within(leg(0, n, false));
        let (cut, why) = all.cut.unwrap();
        assert_eq!(why, Cut::Fuel);
        let left_ms = f.executive.left_ms(&f.percept());
        let ends_ms = |cell: u16, done_ms: u32| {
            let after = f.executive.transit.exit(cell, Direction::Forward);
            done_ms + f.executive.home_from_ms(after).unwrap()
        };
        for (cell, done_ms) in &all.cells {
            assert!(ends_ms(*cell, *done_ms) <= left_ms);
        }
        let times = f.executive.schedule(&[leg(0, n, false)], &|_| true);
        let (_, late_ms) = times.iter().find(|(c, _)| *c == cut).unwrap();
        assert!(ends_ms(cut, *late_ms) > left_ms);
        // Some of it ends later than one figure for the whole loop would allow.
        let last_ms = all.cells.last().unwrap().1;
        assert!(last_ms > left_ms - f.executive.home_ms(), "{last_ms}");
    }

    #[test]
    fn to_where_there_is_no_way_home_nothing_is_planned() {
        let mut f = Flight::new(&[], Point::new(240.0, 190.0), 0, 3000.0);
        f.wing.wind_mps = (30.0, 0.0);
        f.step();
        let n = u16::try_from(f.open.len()).unwrap();
        let within = f.within(leg(0, n, false));
        for (cell, _) in &within.cells {
            let after = f.executive.transit.exit(*cell, Direction::Forward);
            assert!(f.executive.home_from_ms(after).is_some());
        }
        assert_eq!(f.executive.offered_ms(&f.percept(), &|_| true), 0);
    }

    #[test]
    fn the_loop_leads_to_where_a_way_home_is_known() {
        let home = Point::new(240.0, -200.0);
        let wall = [rectangle(-300.0, -80.0, 1000.0, 20.0)];
        let f = Flight::new(&wall, home, 0, 400.0);
        let (transit, known) = (&f.executive.transit, f.executive.home.as_ref().unwrap());
        let mut along = 0;
        for boundary in (0..u16::try_from(f.open.len()).unwrap()).step_by(7) {
            for direction in BOTH {
                let from = transit.place(boundary, direction);
                let moves = known.by_loop(transit, &from, home).unwrap();
                along += usize::from(matches!(moves[0], Move::Pass(..)));
                let mut at = from;
                for step in &moves {
                    assert!(transit.is_cleared(&at, step), "from {boundary}: {step:?}");
                    at = transit.end_of(&at, step);
                }
                assert!(matches!(moves.last(), Some(Move::Loiter(_))));
                assert!((at.pose.position() - home).norm() < 100.0);
            }
        }
        assert!(along > 4, "{along}");
        let elsewhere = Point::new(0.0, 0.0);
        let from = transit.place(0, Direction::Forward);
        assert!(known.by_loop(transit, &from, elsewhere).is_none());
    }
}
