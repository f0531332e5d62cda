//! What is flown against what is wanted: who holds or waits stays where it is (`hold`);
//! who is finished and to come home by its mission, ordered home, out of fuel or silent for a twin flies home (`home`).

use super::{Clocks, Findings, PeerSnapshot, Snapshot};
use crate::world::flat::{self, segment_ring_m};
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_peer::diagram::StateGoal;
use skein_peer::wire::message::Order;
use std::collections::BTreeMap;

/// Turning into a circle from any heading takes less than one turn and a half: so long a
/// peer that begins to hold may still drift, in turns at its least radius.
const SETTLE_TURNS: f64 = 1.5;

/// A circle at the least radius is no wider than two radii; a second circle lies beside it
/// when the side was changed for the sake of a zone, and half of one is room for the wind.
pub(crate) const HOLD_RADII: f64 = 5.0;

/// The way home is at most so many times the straight one, where no zone lies across that:
/// turns, and the curve at the end.
const DETOUR: f64 = 2.0;

/// Who stays when all is over is looked at for so long, milliseconds.
const STAY_MS: u64 = 180_000;

/// And before it begins a peer turns round, and looks four times a period, seconds.
const HOME_SLACK_S: f64 = 30.0;

/// What a UAV can do over the ground.
#[derive(Clone, Copy, Debug)]
pub struct Flyer {
    /// The least radius of a turn, at cruise and over the ground, metres.
    pub turn_radius_m: f64,
    /// Its speed at cruise against the wind, m/s.
    pub slowest_mps: f64,
    /// Its speed at cruise with the wind, m/s.
    pub fastest_mps: f64,
    /// How far from where all are to be it may wait, metres: circles of those who listen for a
    /// station there are as wide as the widest UAV of the fleet turns, and where all fly at one
    /// height others may leave it room beside theirs alone.
    pub waits_within_m: f64,
}

/// Somebody who is to be home by then.
#[derive(Clone, Copy, Debug)]
struct Homing {
    due_ms: u64,
    base: Point,
    told: bool,
}

/// Somebody who is to stay where it is.
#[derive(Clone, Copy, Debug)]
struct Holding {
    since_ms: u64,
    /// On which loop, by which revision of the mission: with another one a flight is begun anew,
    /// and another circle with it; a new zone may lie where that was, off the loop.
    mission: (u64, u32),
    /// Where it was once it had settled.
    place: Option<Point>,
    /// For how long it was looked at since.
    for_ms: u64,
}

/// What the flights of one run were found to be.
#[derive(Clone, Debug)]
pub struct FlightCheck {
    flyers: BTreeMap<u16, Flyer>,
    zones: Vec<Polygon>,
    clearance_m: f64,
    homing: BTreeMap<u16, Homing>,
    holding: BTreeMap<u16, Holding>,
    told: Clocks<u16>,
    /// UAV milliseconds spent able and without anything to fly, while cells were open.
    pub idle_ms: u64,
}

impl FlightCheck {
    /// The checks of these UAVs, that keep a clearance from zones.
    #[must_use]
    pub fn new(flyers: BTreeMap<u16, Flyer>, zones: Vec<Polygon>, clearance_m: f64) -> Self {
        Self {
            flyers,
            zones,
            clearance_m,
            homing: BTreeMap::new(),
            holding: BTreeMap::new(),
            told: Clocks::default(),
            idle_ms: 0,
        }
    }

    /// A mission has these zones: ways round them count, too.
    pub fn on_zones(&mut self, zones: impl Iterator<Item = Vec<Point>>) {
        for zone in zones.filter_map(|ring| Polygon::new(ring).ok()) {
            if !self.zones.iter().any(|z| z.vertices() == zone.vertices()) {
                self.zones.push(zone);
            }
        }
    }

    /// A process ends or stands still: its airframe loiters where it is.
    pub fn on_silent(&mut self, id: u16) {
        self.homing.remove(&id);
        self.holding.remove(&id);
        self.told.stop(id);
    }

    /// Whether everybody who is to be home is.
    #[must_use]
    pub fn all_home(&self, snapshot_peers: &[PeerSnapshot]) -> bool {
        snapshot_peers.iter().filter(|m| m.uav).all(|m| {
            let homing = self.homing.get(&m.id);
            let stays = self.holding.get(&m.id).filter(|_| m.view.finished);
            let is_seen = stays.is_none_or(|h| h.for_ms >= STAY_MS);
            is_seen && homing.is_none_or(|h| h.told || self.is_home(m, h))
        })
    }

    fn is_home(&self, m: &PeerSnapshot, homing: &Homing) -> bool {
        let (Some(at), Some(flyer)) = (m.at, self.flyers.get(&m.id)) else {
            return true;
        };
        at_base(at, homing.base, *flyer)
    }

    /// Judges where everybody is; `base` tells where the mission of a revision ends, and `wanted`
    /// what the mission of a UAV asks of it now.
    pub fn on_snapshot(
        &mut self,
        snapshot: &Snapshot<'_>,
        base: impl Fn(u32) -> Option<Point>,
        wanted: impl Fn(u16) -> Option<StateGoal>,
        found: &mut Findings,
    ) {
        let open = !snapshot.covered.is_full();
        for m in snapshot.peers.iter().filter(|m| m.uav) {
            if open && m.view.able && m.view.plan.is_empty() {
                self.idle_ms += snapshot.bounds.period_ms;
            }
            let Some((at, flyer)) = m.at.zip(self.flyers.get(&m.id).copied()) else {
                continue;
            };
            let returns = m.view.order == Order::ReturnToBase;
            let spent = m.view.is_fuel_due || m.view.spendable_ms == 0 && !m.view.able;
            let spent = m.view.loop_hash != 0 && spent;
            let silent = m.view.is_silent;
            let finished = |goal| m.view.finished && wanted(m.id) == Some(goal);
            let goes = returns || finished(StateGoal::Home) || spent || silent;
            let goes = goes && m.view.order != Order::Hold;
            match base(m.view.revision).filter(|_| goes && (m.view.speaks || silent)) {
                Some(base) => self.judge_homing(snapshot.now_ms, m, (at, base), flyer, found),
                None => {
                    self.homing.remove(&m.id);
                }
            }
            let stays = finished(StateGoal::Hold) && !goes;
            let holds = m.view.order == Order::Hold || stays;
            if holds && m.view.loop_hash != 0 {
                self.judge_holding(snapshot.now_ms, m, at, flyer, found);
            } else {
                self.holding.remove(&m.id);
            }
        }
    }

    /// How long a way between two places is at most, metres: a zone across the straight one
    /// may be part of a wall of all of them, so it leads along all of their edges.
    fn longest_way_m(&self, from: Point, to: Point) -> f64 {
        let edges = self.zones.iter().map(Polygon::vertices);
        let across = edges
            .clone()
            .any(|z| segment_ring_m(from, to, z) < self.clearance_m);
        let round_m = |ring: &[Point]| flat::edges(ring).map(|(a, b)| (b - a).norm()).sum::<f64>();
        let along_m: f64 = edges
            .map(|z| round_m(z) + core::f64::consts::TAU * self.clearance_m)
            .sum();
        DETOUR * (to - from).norm() + if across { along_m } else { 0.0 }
    }

    /// How long the way home takes at most, with the turn before it, milliseconds.
    #[must_use]
    pub fn longest_home_ms(&self, from: Point, base: Point, flyer: Flyer) -> u64 {
        let way_s = self.longest_way_m(from, base) / flyer.slowest_mps.max(0.1);
        milliseconds(way_s + HOME_SLACK_S)
    }

    fn judge_homing(
        &mut self,
        now_ms: u64,
        m: &PeerSnapshot,
        (at, base): (Point, Point),
        flyer: Flyer,
        found: &mut Findings,
    ) {
        let away_m = (at - base).norm();
        let fresh = Homing {
            due_ms: now_ms.saturating_add(self.longest_home_ms(at, base, flyer)),
            base,
            told: false,
        };
        let homing = self.homing.entry(m.id).or_insert(fresh);
        if homing.base != base {
            *homing = fresh;
        } else if m.view.evades {
            // From where it makes way to it has to come back.
            homing.due_ms = homing.due_ms.max(fresh.due_ms);
        }
        let homing = *homing;
        if now_ms > homing.due_ms && !self.is_home(m, &homing) && !homing.told {
            if let Some(h) = self.homing.get_mut(&m.id) {
                h.told = true;
            }
            found.broken("home", now_ms, Some(m.id), || {
                format!("is to fly home and is still {away_m:.0} m away from it")
            });
        }
    }

    fn judge_holding(
        &mut self,
        now_ms: u64,
        m: &PeerSnapshot,
        at: Point,
        flyer: Flyer,
        found: &mut Findings,
    ) {
        let (id, mission) = (m.id, (m.view.loop_hash, m.view.revision));
        let fresh = Holding {
            since_ms: now_ms,
            mission,
            place: None,
            for_ms: 0,
        };
        let holding = self.holding.entry(id).or_insert(fresh);
        if holding.mission != mission {
            *holding = fresh;
        }
        let settle_s = SETTLE_TURNS * core::f64::consts::TAU * flyer.turn_radius_m
            / flyer.slowest_mps.max(0.1);
        if now_ms < holding.since_ms + milliseconds(settle_s) {
            return;
        }
        let place = *holding.place.get_or_insert(at);
        holding.for_ms = now_ms - holding.since_ms;
        let away_m = (at - place).norm();
        let most_m = HOLD_RADII * flyer.turn_radius_m;
        if away_m <= most_m {
            self.told.stop(id);
            return;
        }
        self.told.start(id, now_ms);
        if self.told.tell_once(id) {
            found.broken("hold", now_ms, Some(id), || {
                format!("is to hold and is {away_m:.0} m from where it held (bound {most_m:.0} m)")
            });
        }
    }
}

/// Whether somebody who loiters at a base may be here.
#[must_use]
pub fn at_base(at: Point, base: Point, flyer: Flyer) -> bool {
    (at - base).norm() <= flyer.waits_within_m
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "casts from floats saturate, and a flight is not negative"
)]
pub(super) fn milliseconds(s: f64) -> u64 {
    (s * 1000.0) as u64
}

#[cfg(test)]
mod tests {
    use super::super::rules::flyer;
    use super::super::testing::{Story, speaking};
    use super::*;
    use crate::world::fixture;
    use core::cell::Cell;
    use skein_peer::Beliefs;

    /// Peer 1 at so many metres from base after each second; what is broken.
    fn flown(
        change: impl Fn(&mut Beliefs),
        away_m: impl Fn(u64) -> f64,
    ) -> BTreeMap<&'static str, u64> {
        flown_round(Vec::new(), StateGoal::Home, change, away_m)
    }

    fn flown_round(
        zones: Vec<Polygon>,
        wanted: StateGoal,
        change: impl Fn(&mut Beliefs),
        away_m: impl Fn(u64) -> f64,
    ) -> BTreeMap<&'static str, u64> {
        let flyer = Flyer {
            turn_radius_m: 20.0,
            slowest_mps: 10.0,
            fastest_mps: 14.0,
            waits_within_m: 100.0,
        };
        let mut check = FlightCheck::new(BTreeMap::from([(1, flyer)]), zones, 10.0);
        let (mut story, mut found) = (Story::new(300), Findings::new(1));
        for t in 0..200 {
            let mut view = speaking();
            change(&mut view);
            // Another mission comes, and a zone of it off the loop.
            view.loop_hash += u64::from(t >= 100);
            view.revision = if t < 60 { 1 } else { 2 };
            story.place(1, Point::new(away_m(t), 0.0));
            let views = [(1, view)];
            story.snapshot(t * 1000, &views, |s| {
                let base = |_| Some(Point::new(0.0, 0.0));
                check.on_snapshot(s, base, |_| Some(wanted), &mut found);
            });
        }
        found.counts
    }

    /// Where nobody hears the station all try circles as wide as the widest of them turns.
    #[test]
    fn who_turns_in_less_room_waits_no_nearer_to_the_base() {
        let mut spec = fixture::square(2);
        spec.uavs[0].airframe.cruise_mps /= 2.0;
        let [narrow, wide] = [0, 1].map(|n| flyer(&spec.uavs[n], &spec));
        assert!(narrow.turn_radius_m < wide.turn_radius_m / 3.0);
        assert!((narrow.waits_within_m - wide.waits_within_m).abs() < 1e-9);
        let (base, radius_m) = (Point::new(0.0, 0.0), spec.mission.turn_radius_m());
        assert!(radius_m >= wide.turn_radius_m);
        assert!(at_base(Point::new(4.0 * radius_m, 0.0), base, narrow));
        let beyond = Point::new(wide.waits_within_m + 1.0, 0.0);
        assert!(!at_base(beyond, base, wide));
    }

    #[test]
    fn whoever_is_to_fly_home_and_does_not_is_found() {
        let wanted: [fn(&mut Beliefs); 5] = [
            |b| b.finished = true,
            |b| b.order = Order::ReturnToBase,
            |b| (b.spendable_ms, b.able) = (0, false),
            |b| b.is_fuel_due = true,
            |b| (b.is_silent, b.speaks) = (true, false),
        ];
        let arrives = |t: u64| 600.0 - 10.0 * f64::from(u8::try_from(t.min(55)).unwrap());
        for change in wanted {
            assert!(flown(change, arrives).is_empty());
            assert!(flown(change, |_| 600.0).contains_key("home"));
        }
        assert!(flown(|_| {}, |_| 600.0).is_empty());
    }

    /// It is at home, makes way for an aircraft when it is due there, and comes back.
    #[test]
    fn who_makes_way_for_an_aircraft_has_time_to_come_back() {
        let broken = |evades: bool, back: bool| {
            let second = Cell::new(0);
            let change = |b: &mut Beliefs| {
                second.set(second.get() + 1);
                b.finished = true;
                b.evades = evades && (100..110).contains(&second.get());
            };
            let away_m = |t: u64| match t {
                100..120 => 300.0,
                120.. if !back => 300.0,
                _ => 0.0,
            };
            flown(change, away_m).contains_key("home")
        };
        assert!(!broken(true, true));
        assert!(broken(false, true), "it strays");
        assert!(broken(true, false), "it does not come back");
    }

    #[test]
    fn a_wall_across_the_way_home_gives_time_to_fly_round_it() {
        let wall = |x: f64| {
            let corner = |dx: f64, y: f64| Point::new(x + dx, y);
            let ring = [(0.0, -100.0), (10.0, -100.0), (10.0, 100.0), (0.0, 100.0)];
            Polygon::new(ring.map(|(dx, y)| corner(dx, y)).to_vec()).unwrap()
        };
        let late = |t: u64| if t < 170 { 600.0 } else { 0.0 };
        let finished = |b: &mut Beliefs| b.finished = true;
        assert!(flown_round(vec![wall(300.0)], StateGoal::Home, finished, late).is_empty());
        for zones in [Vec::new(), vec![wall(900.0)]] {
            assert!(flown_round(zones, StateGoal::Home, finished, late).contains_key("home"));
        }
    }

    /// A mission may say that who is finished stays.
    #[test]
    fn who_is_finished_and_to_stay_stays() {
        let finished = |b: &mut Beliefs| b.finished = true;
        let stays =
            |away_m: fn(u64) -> f64| flown_round(Vec::new(), StateGoal::Hold, finished, away_m);
        assert!(stays(|_| 600.0).is_empty());
        let leaves = |t: u64| 600.0 - 3.0 * f64::from(u8::try_from(t).unwrap());
        assert!(stays(leaves).contains_key("hold"));
    }

    #[test]
    fn whoever_is_to_hold_and_flies_on_is_found() {
        let hold = |b: &mut Beliefs| b.order = Order::Hold;
        let circles = |t: u64| if t.is_multiple_of(2) { 500.0 } else { 540.0 };
        assert!(flown(hold, circles).is_empty());
        let flies_on = |t: u64| 10.0 * f64::from(u8::try_from(t).unwrap());
        assert!(flown(hold, flies_on).contains_key("hold"));
        assert!(flown(|_| {}, flies_on).is_empty());
        // Another mission may come with another circle, and with one only.
        let moves_at = |s: u64| move |t: u64| if t < s { 500.0 } else { 605.0 };
        assert!(flown(hold, moves_at(100)).is_empty());
        assert!(flown(hold, moves_at(60)).is_empty());
        assert!(flown(hold, moves_at(50)).contains_key("hold"));
        assert!(flown(hold, moves_at(80)).contains_key("hold"));
        assert!(flown(hold, moves_at(140)).contains_key("hold"));
    }
}
