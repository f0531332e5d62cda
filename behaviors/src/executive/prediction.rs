//! What an executive expects of its own flight: forecast, durations, endurance
//! (D2.7 §3.6.5 needs them from every UAV that shares a loop).
//!
//! Everything here is a question; nothing changes what is flown.

use super::transit::{CellVisit, Move, Place};
use super::{Aim, Executive, Forecast, Kind};
use skein_flight::coverage::ring::Direction;
use skein_flight::coverage::ring::backtracking::{Leg, OffLoop};
use skein_geometry::frame::Pose;
use skein_geometry::math::PI;
use std::collections::VecDeque;

/// Told instead of a time when there is no way: a day, beyond any endurance.
pub const UNREACHABLE_MS: u32 = 86_400_000;

/// Time added to a turn, milliseconds: a setpoint and its corrections.
const TURN_MARGIN_MS: f64 = 1000.0;

/// One stretch of the flight to come.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Item {
    /// The cell that it serves, if it does.
    visit: Option<CellVisit>,
    /// The cell that it flies, served or passed.
    cell: Option<(u16, Direction)>,
    /// Whether it is of the given flight.
    given: bool,
    /// Distance through the air from here to its end, metres.
    end_m: f64,
    /// Where it ends.
    end: Place,
}

impl Executive {
    /// Where the UAV will be `window_ms` from its last percept, at the end of a cell.
    ///
    /// The cell that it is in is always finished first. A UAV without legs is
    /// foretold at the boundary that it reaches soonest, and where it is. Where there is no way at
    /// all, or no percept yet, the release is [`UNREACHABLE_MS`].
    #[must_use]
    pub fn forecast(&self, window_ms: u32, is_open: &dyn Fn(u16) -> bool) -> Forecast {
        let Some(from) = self.here() else {
            return Self::nowhere();
        };
        let (kept, items) = self.ahead(&from, is_open);
        let finish_ms = self.last_visit_ms(&items);
        let mut cells = Vec::new();
        let mut anchor: Option<(Place, f64)> = None;
        let mut before_m = 0.0;
        for (i, item) in items.iter().enumerate() {
            let in_it = i == 0 && kept > 0;
            let fits = self.when_ms(item.end_m) <= window_ms;
            match (item.visit, item.cell) {
                (Some(visit), _) if in_it || fits => {
                    if is_open(visit.cell) {
                        cells.push(visit.cell);
                    }
                    anchor = Some((item.end, item.end_m));
                }
                (None, Some(_)) if in_it => anchor = Some((item.end, item.end_m)),
                (Some(visit), _) => {
                    // The way to it is begun, so that is where it will be next.
                    let entry = self.transit.place(
                        self.transit.entry(visit.cell, visit.direction),
                        visit.direction,
                    );
                    anchor = anchor.or(Some((entry, before_m)));
                    break;
                }
                _ => {}
            }
            before_m = item.end_m;
        }
        let on_loop = anchor.and_then(|(place, m)| place.boundary.map(|b| (b, m)));
        let is_in_a_cell = kept > 0 && items.first().is_some_and(|i| i.cell.is_some());
        // From the end of a detour it may leave for anywhere.
        let detour = items.iter().rev().find(|i| i.given);
        let detour = detour.filter(|_| self.aim == Aim::Detour);
        let (free, free_m) = detour.map_or((from.pose, 0.0), |i| (i.end.pose, i.end_m));
        let off_loop =
            (cells.is_empty() && !is_in_a_cell).then(|| OffLoop::of(free, self.when_ms(free_m)));
        let way_on = || self.transit.way_on(free);
        let found = on_loop.or_else(|| way_on().map(|(b, d, m)| ((b, d), free_m + m)));
        match found {
            Some(((anchor, heading), m)) => Forecast {
                cells,
                anchor,
                heading,
                release_ms: self.when_ms(m),
                off_loop,
                finish_ms,
            },
            None => Forecast {
                finish_ms,
                ..Self::nowhere()
            },
        }
    }

    /// When all legs are flown, milliseconds from the last percept: of the forecast that alone.
    #[must_use]
    pub fn finish_ms(&self, is_open: &dyn Fn(u16) -> bool) -> u32 {
        let ahead = self.here().map(|from| self.ahead(&from, is_open));
        let finish_ms = ahead.map_or(0, |(_, items)| self.last_visit_ms(&items));
        debug_assert_eq!(finish_ms, self.forecast(0, is_open).finish_ms);
        finish_ms
    }

    /// All that is still to fly from a place on, and how much of it was kept from the last plan.
    fn ahead(&self, from: &Place, is_open: &dyn Fn(u16) -> bool) -> (usize, Vec<Item>) {
        let kept = if self.replan { 0 } else { self.stretches.len() };
        let mut items = self.items(from, kept, self.waiting(kept), is_open);
        let (place, flown_m) = items.last().map_or((*from, 0.0), |i| (i.end, i.end_m));
        if self.aim == Aim::Given
            && let Some((end, air_m)) = self.given_ahead(&place, kept)
        {
            items.push(Item {
                visit: None,
                cell: None,
                given: true,
                end_m: flown_m + air_m,
                end,
            });
        }
        (kept, items)
    }

    fn last_visit_ms(&self, items: &[Item]) -> u32 {
        let counts = |i: &&Item| i.visit.is_some() || i.given;
        let last = items.iter().rev().find(counts);
        last.map_or(0, |i| self.when_ms(i.end_m))
    }

    fn nowhere() -> Forecast {
        Forecast {
            cells: Vec::new(),
            anchor: 0,
            heading: Direction::Forward,
            release_ms: UNREACHABLE_MS,
            off_loop: None,
            finish_ms: 0,
        }
    }

    /// The boundary of the loop that is reached soonest from somewhere.
    #[must_use]
    pub fn anchor_from(&self, pose: Pose) -> Option<u16> {
        self.transit.way_on(pose).map(|(boundary, ..)| boundary)
    }

    /// When each open cell of `legs` would be done if they became the goal now, in
    /// the order of flight, milliseconds from the last percept. Cells that cannot be
    /// reached are left out.
    #[must_use]
    pub fn schedule(&self, legs: &[Leg], is_open: &dyn Fn(u16) -> bool) -> Vec<(u16, u32)> {
        let visits = self.visited(legs, is_open).into_iter();
        visits.map(|(visit, ms, _)| (visit.cell, ms)).collect()
    }

    /// The same, with the place where each of them ends.
    pub(super) fn visited(
        &self,
        legs: &[Leg],
        is_open: &dyn Fn(u16) -> bool,
    ) -> Vec<(CellVisit, u32, Place)> {
        let Some(from) = self.here() else {
            return Vec::new();
        };
        let (kept, queue) = if self.aim == Aim::Detour {
            self.detoured(true, self.visits(legs), is_open)
        } else {
            self.continued(self.visits(legs), is_open)
        };
        let items = self.items(&from, kept, queue, is_open);
        items
            .iter()
            .filter_map(|i| Some((i.visit?, self.when_ms(i.end_m), i.end)))
            .collect()
    }

    /// Mean speed over the ground along the whole loop, m/s: cruise in calm air.
    #[must_use]
    pub fn loop_speed_mps(&self) -> f64 {
        let air = self.transit.air();
        if air.is_calm() {
            self.transit.airframe.cruise_mps
        } else {
            self.transit.loop_share() * air.airspeed_mps
        }
    }

    /// Time to turn round where it is, milliseconds: in calm air the turn to the reversed
    /// pose takes 7π/3 radii, in a wind as long as the worst course makes it.
    #[must_use]
    pub fn turn_ms(&self) -> u32 {
        let way_m = if self.transit.air().is_calm() {
            7.0 * PI / 3.0 * self.transit.turn_radius_m()
        } else {
            self.transit.turn_round_s() * self.speed_mps()
        };
        self.ms(way_m).saturating_add(whole_ms(TURN_MARGIN_MS))
    }

    /// Where the UAV is on its track, or is where it has none, over the ground; none before the
    /// first percept.
    #[must_use]
    pub fn pose(&self) -> Option<Pose> {
        self.here().map(|place| place.pose)
    }

    /// Where the flight to come begins.
    pub(super) fn here(&self) -> Option<Place> {
        let pose = self
            .transit
            .air()
            .over_ground(self.played.as_ref()?.percept.pose);
        Some(Place {
            pose: if self.replan {
                pose
            } else {
                self.track.pose().unwrap_or(pose)
            },
            boundary: None,
        })
    }

    /// Cells to be served that are not on the first `kept` stretches.
    fn waiting(&self, kept: usize) -> VecDeque<CellVisit> {
        let dropped = self
            .stretches
            .iter()
            .skip(kept)
            .filter_map(|s| s.kind.visit());
        dropped.chain(self.queue.iter().copied()).collect()
    }

    /// The first `kept` stretches, then the way along `queue`.
    fn items(
        &self,
        from: &Place,
        kept: usize,
        mut queue: VecDeque<CellVisit>,
        is_open: &dyn Fn(u16) -> bool,
    ) -> Vec<Item> {
        let mut items = Vec::with_capacity(kept + queue.len());
        let mut place = *from;
        let mut end_m = 0.0;
        // By promises a UAV may circle and fly on.
        let goes_on = self.contingency.is_some();
        let flown = kept.min(self.flight_stretches());
        for s in self
            .stretches
            .iter()
            .take(flown)
            .take_while(|s| goes_on || !matches!(s.kind, Kind::Loiter(_)))
        {
            end_m = self.air_m_until(s.end_m);
            place = s.end;
            items.push(Item {
                visit: s.kind.visit(),
                cell: s.kind.cell(),
                given: matches!(s.kind, Kind::Piece { .. }),
                end_m,
                end: place,
            });
        }
        if self.aim == Aim::Detour
            && let Some((end, air_m)) = self.given_ahead(&place, kept)
        {
            (place, end_m) = (end, end_m + air_m);
            items.push(Item {
                visit: None,
                cell: None,
                given: true,
                end_m,
                end,
            });
        }
        let mut refused = Vec::new();
        while let Some((way, visit)) = self.transit.next(&place, &mut queue, is_open, &mut refused)
        {
            for step in way.into_iter().chain([Move::Serve(visit)]) {
                end_m += self.transit.length_m(&step);
                place = self.transit.end_of(&place, &step);
                let (visit, cell) = match &step {
                    Move::Serve(h) | Move::Rest(h, _) => (Some(*h), Some((h.cell, h.direction))),
                    Move::Pass(c, d) => (None, Some((*c, *d))),
                    Move::Route(_) | Move::Piece(..) | Move::Loiter(_) => (None, None),
                };
                items.push(Item {
                    visit,
                    cell,
                    given: false,
                    end_m,
                    end: place,
                });
            }
        }
        items
    }

    /// Distance through the air to a place on the track, metres.
    pub(super) fn air_m_until(&self, end_m: f64) -> f64 {
        let ground_m = (end_m - self.track.at_m()).max(0.0);
        let air = self.transit.air();
        if air.is_calm() {
            ground_m
        } else {
            air.air_length_m(&self.track.ahead(ground_m))
        }
    }

    /// When it has flown so many metres through the air, milliseconds from the last percept.
    fn when_ms(&self, length_m: f64) -> u32 {
        let ground_ms = self
            .played
            .as_ref()
            .map_or(0, |p| p.percept.takes_off_in_ms);
        self.ms(length_m)
            .saturating_add(ground_ms)
            .saturating_add(self.to_layer_ms())
            .min(UNREACHABLE_MS)
    }

    /// Time to fly so many metres through the air, milliseconds, rounded up.
    pub(super) fn ms(&self, length_m: f64) -> u32 {
        whole_ms((length_m / self.speed_mps() * 1000.0).ceil()).min(UNREACHABLE_MS)
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
pub(super) fn whole_ms(ms: f64) -> u32 {
    ms as u32
}
