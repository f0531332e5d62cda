//! Who flies where on the tour of a patrol, and what each of the team flies at first.

use super::pattern::Pattern;
use super::team_patrol::{
    AfterLosses, GoesOn, Losses, PatrolError, PatrolFlight, PatrolPlan, PatrolRequest,
    PatrolStation,
};
use super::team_tour::Course;
use super::{
    Change, Patrol, Stand, Station, Tour, Uav as PatrolUav, after_losses, patrol_within,
    revisit_bound, spread,
};
use crate::flight::Leg;
use crate::flown::{Air, length_m, time_s, track};
use crate::team::Uav;
use skein_flight::coverage::metric::InWind;
use skein_flight::trajectory::dubins;
use skein_geometry::Curve;
use skein_geometry::frame::Pose;

/// Speeds that differ by less than this are the same, m/s.
const SAME_SPEED_MPS: f64 = 1e-9;

/// Times that arcs are laid anew for turns that turned out longer.
const TURN_ROUNDS: usize = 4;

/// Times that a UAV whose endurance was too short is asked again with the ways to its
/// station.
const ENDURANCE_ROUNDS: usize = 8;

/// The tour in millimetres with the team beside it.
pub(super) struct Watch<'a> {
    request: &'a PatrolRequest,
    course: Course,
    tour: Tour,
    /// By UAV, millimetres a second.
    speeds: Vec<u32>,
    /// By UAV: its nearest place on the tour, and the way there.
    nearest: Vec<(u32, f64)>,
    uavs: Vec<PatrolUav>,
}

/// A patrol from its beginning on.
struct Flown {
    patrol: Patrol,
    stations: Vec<Station>,
    /// By UAV; none for one that rests.
    flights: Vec<Option<First>>,
    /// When all are at their stations, seconds.
    steady_s: f64,
}

/// What a UAV flies at first.
struct First {
    legs: Vec<Leg>,
    speed_mps: f64,
    way_s: f64,
    home_s: f64,
    period_s: f64,
}

impl<'a> Watch<'a> {
    pub(super) fn new(request: &'a PatrolRequest, course: Course) -> Result<Self, PatrolError> {
        let wind = request.wind_mps;
        let base_mps = request.team.first().map_or(0.0, |u| u.speed_mps);
        let alike = |u: &Uav| (u.speed_mps - base_mps).abs() < SAME_SPEED_MPS;
        if wind.norm() >= SAME_SPEED_MPS && !request.team.iter().all(alike) {
            return Err(PatrolError::UnlikeInWind);
        }
        InWind::new(&[], base_mps, wind)?;
        let air = request.air(base_mps);
        let tour = Tour::new(&course.legs, |curve| air_m(&air, curve))?;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a cast of a float saturates"
        )]
        let whole = |u: &Uav| ((u.speed_mps * 1000.0).round() as u32).max(1);
        let speeds = request.team.iter().map(whole).collect();
        let mut watch = Self {
            nearest: Vec::new(),
            uavs: Vec::new(),
            request,
            course,
            tour,
            speeds,
        };
        for (i, uav) in request.team.iter().enumerate() {
            let place = watch.tour.nearest(uav.start);
            let on = watch.tour.pose(place);
            let way_s = watch.time_s(&watch.way(i, on)?, uav.speed_mps);
            let home_s = watch.time_s(&watch.home(i, on)?, uav.speed_mps);
            watch.nearest.push((place, way_s));
            watch.uavs.push(PatrolUav {
                speed: watch.speeds[i],
                longest_s: uav.endurance_s.unwrap_or(f64::INFINITY) - way_s - home_s,
            });
        }
        Ok(watch)
    }

    fn name(&self, uav: usize) -> &str {
        &self.request.team[uav].name
    }

    fn time_s(&self, curve: &Curve, airspeed_mps: f64) -> f64 {
        self.request.air(airspeed_mps).time_s(curve)
    }

    /// What the straight way from a UAV's launch point to a place of the tour would take.
    fn straight_s(&self, uav: usize, place: u32) -> f64 {
        let uav = &self.request.team[uav];
        (self.tour.point(place) - uav.start).norm() / uav.speed_mps
    }

    /// The way from a UAV's launch point onto the tour.
    fn way(&self, uav: usize, on: Pose) -> Result<Curve, PatrolError> {
        // Flown backwards from there: at its launch point a UAV may head anywhere.
        Ok(self.home(uav, on.reversed())?.reversed())
    }

    /// The way from the tour back to a UAV's launch point.
    fn home(&self, uav: usize, from: Pose) -> Result<Curve, PatrolError> {
        let start = self.request.team[uav].start;
        let way = self.course.router.route_to_point(from, start);
        way.map_err(|_| PatrolError::NoWay(self.name(uav).to_owned()))
    }

    /// A turn back at the end of an arc, and what it takes; none where there is no room.
    fn turn(&self, at: Pose) -> Option<(Curve, f64)> {
        let curve = self.course.router.route(at, at.reversed()).ok()?;
        let takes_m = air_m(&self.request.air(self.base_mps()), &curve);
        Some((curve, takes_m))
    }

    /// A turn back where there is room, metres.
    fn free_turn_m(&self) -> f64 {
        let there = Pose::new(self.tour.point(0), 0.0);
        let radius_m = self.course.router.limits().turn_radius_m;
        dubins::length_m(there, there.reversed(), radius_m)
    }

    /// The longest turn back at the ends of arcs, metres; infinite where there is no room.
    fn widest_turn_m(&self, arcs: &[(u32, u32)]) -> f64 {
        let n = u64::from(self.tour.len_mm());
        let ends = arcs.iter().filter(|a| a.1 > 0).flat_map(|(from, len)| {
            let on = |at: u64| self.tour.pose(u32::try_from(at % n).unwrap_or(0));
            let end = on(u64::from(*from) + u64::from(*len));
            [end, on(u64::from(*from)).reversed()]
        });
        let turns = ends.map(|end| self.turn(end).map_or(f64::INFINITY, |t| t.1));
        turns.fold(0.0, f64::max)
    }

    fn base_mps(&self) -> f64 {
        self.request.team.first().map_or(0.0, |u| u.speed_mps)
    }

    /// Who flies where; with the turns at the ends of arcs as long as they are.
    fn stationed(&self) -> Result<(Patrol, Vec<Station>), PatrolError> {
        let n = self.tour.len_mm();
        let mut turn_m = self.free_turn_m();
        for _ in 0..TURN_ROUNDS {
            let Some(patrol) = patrol_within(n, millimetres(turn_m), &self.uavs) else {
                return Err(self.nobody(turn_m));
            };
            let (patrol, stations) = spread(n, &patrol, |uav, place| self.straight_s(uav, place));
            let Pattern::Arcs { arcs, turn } = &patrol.pattern else {
                return Ok((patrol, stations));
            };
            turn_m = self.widest_turn_m(arcs);
            if millimetres(turn_m) <= *turn {
                return Ok((patrol, stations));
            }
            if turn_m.is_infinite() {
                break;
            }
        }
        let patrol = patrol_within(n, u32::MAX, &self.uavs);
        let patrol = patrol.filter(|p| matches!(p.pattern, Pattern::Round { .. }));
        let patrol = patrol.ok_or(PatrolError::NoTurn)?;
        Ok(spread(n, &patrol, |uav, place| self.straight_s(uav, place)))
    }

    fn nobody(&self, turn_m: f64) -> PatrolError {
        let n = self.tour.len_mm();
        let fastest = self.speeds.iter().max().copied().unwrap_or(1);
        let sum: f64 = self.speeds.iter().map(|v| f64::from(*v)).sum();
        let flown = f64::from(n) + 1000.0 * turn_m * self.speeds.len() as f64;
        PatrolError::Nobody {
            round_s: f64::from(n) / f64::from(fastest),
            arc_s: 2.0 * flown / sum.max(1.0),
            longest_s: self.uavs.iter().map(|u| u.longest_s).fold(0.0, f64::max),
        }
    }

    /// The pattern, and how it begins.
    fn flown(&self) -> Result<Flown, PatrolError> {
        let (patrol, stations) = self.stationed()?;
        let mut flights: Vec<Option<First>> = (0..self.uavs.len()).map(|_| None).collect();
        for s in &stations {
            flights[s.uav] = Some(self.first(&patrol, s)?);
        }
        let ways = flights.iter().flatten().map(|f| f.way_s);
        let steady_s = ways.fold(0.0, f64::max);
        Ok(Flown {
            patrol,
            stations,
            flights,
            steady_s,
        })
    }

    /// What a UAV flies at first: to its station, one period, and home.
    fn first(&self, patrol: &Patrol, at: &Station) -> Result<First, PatrolError> {
        let (n, uav) = (self.tour.len_mm(), at.uav);
        let begin = self.tour.pose(at.place);
        let way = self.way(uav, begin)?;
        let mut speed_mps = self.request.team[uav].speed_mps;
        let (over, end) = match &patrol.pattern {
            Pattern::Round { speed, .. } => {
                speed_mps = speed_mps.min(f64::from(*speed) / 1000.0);
                (self.tour.stretch(at.place, n), begin)
            }
            Pattern::Arcs { arcs, .. } => {
                let (from, len) = arcs[uav];
                let forth = self.tour.stretch(from, len);
                let end = forth.last().and_then(|leg| leg.curve.end());
                let turn = end.and_then(|end| self.turn(end));
                let (turn, _) = turn.ok_or(PatrolError::NoTurn)?;
                let back = backwards(&forth);
                let turn = Leg {
                    curve: turn,
                    sees: false,
                };
                let over = forth.into_iter().chain([turn]).chain(back);
                (over.collect(), begin.reversed())
            }
        };
        let home = self.home(uav, end)?;
        let (way_s, home_s) = (self.time_s(&way, speed_mps), self.time_s(&home, speed_mps));
        let unseen = |curve: Curve| Leg { curve, sees: false };
        let legs = [unseen(way)].into_iter().chain(over).chain([unseen(home)]);
        Ok(First {
            legs: legs.filter(|leg| !leg.curve.is_empty()).collect(),
            speed_mps,
            way_s,
            home_s,
            period_s: patrol.period_s(n, uav, &self.speeds),
        })
    }

    /// The patrol of those whose endurance lasts for one period and the ways.
    pub(super) fn plan(mut self) -> Result<PatrolPlan, PatrolError> {
        let mut round = 0;
        loop {
            let flown = self.flown()?;
            let mut over = false;
            round += 1;
            for (uav, first) in flown.flights.iter().enumerate() {
                let Some(first) = first else { continue };
                let endurance_s = self.request.team[uav].endurance_s;
                let left_s = endurance_s.unwrap_or(f64::INFINITY) - first.way_s - first.home_s;
                if left_s < first.period_s {
                    let tired = round > ENDURANCE_ROUNDS;
                    self.uavs[uav].longest_s = if tired { f64::NEG_INFINITY } else { left_s };
                    over = true;
                }
            }
            if !over {
                return self.told(&flown);
            }
        }
    }

    /// What the caller gets.
    fn told(&self, flown: &Flown) -> Result<PatrolPlan, PatrolError> {
        let n = self.tour.len_mm();
        let mut notices = self.course.notices.clone();
        notices.extend(self.too_short(&flown.patrol));
        let losses = self.request.losses.as_ref();
        let uavs = 0..self.uavs.len();
        Ok(PatrolPlan {
            over: self.course.kind,
            tour_m: f64::from(n) / 1000.0,
            pattern: flown.patrol.pattern.clone(),
            revisit_s: flown.patrol.revisit_s,
            revisit_bound_s: revisit_bound(n, &self.speeds),
            steady_s: flown.steady_s,
            uavs: uavs.map(|uav| self.flight(flown, uav)).collect(),
            after_losses: losses.map(|l| self.after(l, flown)).transpose()?,
            notices,
        })
    }

    /// Who rests because its endurance is short.
    fn too_short(&self, patrol: &Patrol) -> Vec<String> {
        let n = self.tour.len_mm();
        let round_s = |uav: usize| match patrol.pattern {
            Pattern::Round { speed, .. } if self.speeds[uav] < speed => None,
            Pattern::Round { speed, .. } => Some(f64::from(n) / f64::from(speed)),
            Pattern::Arcs { .. } => Some(patrol.revisit_s),
        };
        let short = (0..self.uavs.len()).filter_map(|uav| {
            let (needs_s, has_s) = (round_s(uav)?, self.uavs[uav].longest_s);
            (!patrol.pattern.flies(uav) && needs_s > has_s).then(|| {
                format!(
                    "{} rests: one period takes {needs_s:.0} s, its endurance leaves {:.0} s besides the ways there and back",
                    self.name(uav),
                    has_s.max(0.0)
                )
            })
        });
        short.collect()
    }

    /// One UAV: its station, and what it flies at first.
    fn flight(&self, flown: &Flown, uav: usize) -> PatrolFlight {
        let n = self.tour.len_mm();
        let own = &self.request.team[uav];
        let mut flight = PatrolFlight {
            name: own.name.clone(),
            legs: Vec::new(),
            path: vec![own.start],
            altitude_m: self.request.altitude_m,
            speed_mps: own.speed_mps,
            turn_radius_m: own.turn_radius_m,
            length_m: 0.0,
            station: None,
        };
        let at = flown.stations.iter().find(|s| s.uav == uav);
        let (Some(at), Some(first)) = (at, &flown.flights[uav]) else {
            return flight;
        };
        let arc_m = match &flown.patrol.pattern {
            Pattern::Round { .. } => None,
            Pattern::Arcs { arcs, .. } => Some(f64::from(arcs[uav].1) / 1000.0),
        };
        flight.path = track(&first.legs, own.start);
        flight.length_m = length_m(&first.legs);
        flight.speed_mps = first.speed_mps;
        flight.legs.clone_from(&first.legs);
        flight.station = Some(PatrolStation {
            place_m: f64::from(at.place) / 1000.0,
            phase: f64::from(at.place) / f64::from(n),
            way_s: first.way_s,
            wait_s: flown.steady_s - first.way_s,
            period_s: first.period_s,
            time_s: time_s(&first.legs, &self.request.air(first.speed_mps)),
            arc_m,
        });
        flight
    }

    /// How the others go on.
    fn after(&self, losses: &Losses, flown: &Flown) -> Result<AfterLosses, PatrolError> {
        let named = |name: &String| {
            let known = self.request.team.iter().position(|u| u.name == *name);
            known.ok_or_else(|| PatrolError::Unknown(name.clone()))
        };
        let lost: Vec<usize> = losses.names.iter().map(named).collect::<Result<_, _>>()?;
        let n = self.tour.len_mm();
        let change = self.change(losses.after_s, &lost, flown)?;
        let left: Vec<u32> = (0..self.speeds.len())
            .map(|i| if lost.contains(&i) { 0 } else { self.speeds[i] })
            .collect();
        let flies = |uav: &usize| change.stands[*uav].is_some();
        let uavs = (0..self.uavs.len()).filter(flies);
        Ok(AfterLosses {
            lost: lost.iter().map(|i| self.name(*i).to_owned()).collect(),
            pattern: change.patrol.pattern.clone(),
            revisit_s: change.patrol.revisit_s,
            revisit_bound_s: revisit_bound(n, &left),
            steady_s: change.steady_s,
            gap_s: change.gap_s,
            uavs: uavs.map(|uav| self.goes_on(flown, &change, uav)).collect(),
        })
    }

    /// What follows a failure; with the turns at the ends of arcs as long as they are.
    fn change(&self, t_s: f64, lost: &[usize], flown: &Flown) -> Result<Change, PatrolError> {
        let n = self.tour.len_mm();
        let before = flown.patrol.courses(&self.speeds, &flown.stations);
        let joins = |uav: usize| self.nearest[uav];
        let back = |stand: &Stand| self.turn(self.on_tour(stand)).map(|t| t.1 * 1000.0);
        let turned = |turn| after_losses((n, turn), &self.uavs, &before, t_s, lost, joins, back);
        let mut turn = match flown.patrol.pattern {
            Pattern::Arcs { turn, .. } => turn,
            Pattern::Round { .. } => millimetres(self.free_turn_m()),
        };
        for _ in 0..TURN_ROUNDS {
            let change = turned(turn).ok_or(PatrolError::NobodyLeft)?;
            let Pattern::Arcs { arcs, .. } = &change.patrol.pattern else {
                return Ok(change);
            };
            let turn_m = self.widest_turn_m(arcs);
            if millimetres(turn_m) <= turn {
                return Ok(change);
            }
            if turn_m.is_infinite() {
                break;
            }
            turn = millimetres(turn_m);
        }
        let change = turned(u32::MAX).ok_or(PatrolError::NobodyLeft)?;
        match change.patrol.pattern {
            Pattern::Round { .. } => Ok(change),
            Pattern::Arcs { .. } => Err(PatrolError::NoTurn),
        }
    }

    /// Where a UAV is on the tour, and where it looks.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a place on the tour"
    )]
    fn on_tour(&self, stand: &Stand) -> Pose {
        let pose = self.tour.pose(stand.place as u32);
        if stand.forward { pose } else { pose.reversed() }
    }

    /// What a UAV flies to the tour if it joins, and to its new arc.
    fn legs_there(&self, flown: &Flown, change: &Change, uav: usize) -> Vec<Leg> {
        let Some(stand) = &change.stands[uav] else {
            return Vec::new();
        };
        let unseen = |curve| Leg { curve, sees: false };
        let on = self.on_tour(stand);
        let joins = flown.flights[uav].is_none();
        let way = joins.then(|| self.way(uav, on).ok()).flatten();
        let mut legs: Vec<Leg> = way.map(unseen).into_iter().collect();
        let Some(comes) = change.to_arc[uav] else {
            return legs;
        };
        if comes.turns {
            legs.extend(self.turn(on).map(|turn| unseen(turn.0)));
        }
        let n = f64::from(self.tour.len_mm());
        let from = if comes.forward {
            stand.place
        } else {
            stand.place - comes.along
        };
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "places and lengths on the tour"
        )]
        let along = (from.rem_euclid(n) as u32, comes.along as u32);
        let stretch = self.tour.stretch(along.0, along.1);
        if comes.forward {
            legs.extend(stretch);
        } else {
            legs.extend(backwards(&stretch));
        }
        legs
    }

    /// What one of those who are left does.
    fn goes_on(&self, flown: &Flown, change: &Change, uav: usize) -> GoesOn {
        let n = self.tour.len_mm();
        let place = change.stands[uav].map_or(0.0, |s| s.place);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a place on the tour"
        )]
        let at = self.tour.point(place as u32);
        let legs = self.legs_there(flown, change, uav);
        let since_s = change.courses[uav].since_s().unwrap_or(0.0);
        let arc = |arcs: &[(u32, u32)]| {
            let (from, len) = arcs[uav];
            (f64::from(from) / 1000.0, f64::from(len) / 1000.0)
        };
        GoesOn {
            name: self.name(uav).to_owned(),
            place_m: place / 1000.0,
            at,
            joins: flown.flights[uav].is_none(),
            legs,
            way_s: since_s - change.loiter_s[uav],
            loiter_s: change.loiter_s[uav],
            period_s: change.patrol.period_s(n, uav, &self.speeds),
            arc_m: match &change.patrol.pattern {
                Pattern::Arcs { arcs, .. } => Some(arc(arcs)),
                Pattern::Round { .. } => None,
            },
        }
    }
}

/// Legs flown from their end to their beginning.
fn backwards(legs: &[Leg]) -> Vec<Leg> {
    let back = legs.iter().rev().map(|leg| Leg {
        curve: leg.curve.reversed(),
        sees: leg.sees,
    });
    back.collect()
}

/// What a way takes through the air, metres: the mean of both directions. In a wind that is
/// up to what vanishes on a closed flight.
fn air_m(air: &Air, curve: &Curve) -> f64 {
    (air.time_s(curve) + air.time_s(&curve.reversed())) / 2.0 * air.airspeed_mps
}

/// Whole millimetres of at least so many metres.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn millimetres(length_m: f64) -> u32 {
    (length_m * 1000.0).ceil() as u32
}
