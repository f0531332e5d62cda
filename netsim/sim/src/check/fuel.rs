//! Fuel against places, by what the world knows and not by what peers say of their ways home:
//! plans end where their UAV can come home from (S10), bids offer no more than that, and
//! everybody who had the fuel for it comes home before its reserve is touched (`fuel`).
//!
//! The way home of the judge is the shortest that there can be: the straight line in the wind
//! at cruise, or the route round the zones with the wind behind it all the way. It knows no
//! turns. Where no line leads home, for a wind against it, there is no way.

use super::flight::{FlightCheck, Flyer, at_base, milliseconds};
use super::{Clocks, Findings, PeerSnapshot, Snapshot};
use crate::spec::Spec;
use crate::weather::{ESTIMATE_MARGIN_MPS, Weather};
use skein_flight::trajectory::wind::{Course, Wind};
use skein_geometry::Segment;
use skein_geometry::frame::Point;
use skein_geometry::math::atan2;
use skein_peer::Beliefs;
use skein_peer::offload::MissionGeometry;
use skein_peer::wire::message::Order;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A plan may be longer than the fuel by this much, milliseconds: ETA and fuel are
/// rounded to a millisecond and taken at two percepts half a second apart; a late
/// computer has its percepts later.
const ROUNDING_MS: u64 = 1_000;

/// So long after a change of the wind a UAV may reckon by the one before, milliseconds: it finds
/// it out by its own flight, and looks at its plan once a period.
const WIND_KNOWN_MS: u64 = 10_000;

/// The router's way round zones is this share of itself at least: the shortest there is has
/// no turns in it.
const SHORTEST: f64 = 0.9;

/// A tank that lost more than this beyond what was flown, milliseconds, was emptied by a fault.
const LEAK_MS: u64 = 1_000;

/// What is known of the fuel of a UAV.
#[derive(Clone, Copy, Debug)]
struct Tank {
    reserve_ms: u64,
    cruise_mps: f64,
}

/// Somebody who had the fuel to come home.
#[derive(Clone, Copy, Debug)]
struct Able {
    base: Point,
    revision: u32,
    at_ms: u64,
    fuel_ms: u64,
    told: bool,
}

/// What the fuel of one run was used for.
#[derive(Clone, Debug)]
pub struct FuelCheck {
    tanks: BTreeMap<u16, Tank>,
    weather: Weather,
    /// Winds in which a way home may be reckoned now.
    winds: Vec<Wind>,
    looked_ms: u64,
    grounds: BTreeMap<(u32, u64), Arc<MissionGeometry>>,
    /// Lengths of routes home from boundaries of loops, metres, where zones lie across.
    routes_m: BTreeMap<(u32, u64, usize), Option<f64>>,
    /// Since when a plan has been longer than the fuel.
    short_since_ms: BTreeMap<u16, u64>,
    over: Clocks<u16>,
    able: BTreeMap<u16, Able>,
}

impl FuelCheck {
    /// The check of a scenario.
    #[must_use]
    pub fn new(spec: &Spec) -> Self {
        let tank = |u: &crate::spec::UavSpec| Tank {
            reserve_ms: milliseconds(u.airframe.reserve_s),
            cruise_mps: u.airframe.cruise_mps,
        };
        Self {
            tanks: spec.uavs.iter().map(|u| (u.id, tank(u))).collect(),
            weather: spec.wind.clone(),
            winds: vec![spec.wind.first],
            looked_ms: 0,
            grounds: BTreeMap::new(),
            routes_m: BTreeMap::new(),
            short_since_ms: BTreeMap::new(),
            over: Clocks::default(),
            able: BTreeMap::new(),
        }
    }

    /// A loop was derived.
    pub fn on_loop(&mut self, geometry: &Arc<MissionGeometry>) {
        let key = (geometry.mission.revision, geometry.coverage_loop.hash());
        self.grounds
            .entry(key)
            .or_insert_with(|| Arc::clone(geometry));
    }

    /// A process ends or stands still: nobody flies its airframe.
    pub fn on_silent(&mut self, id: u16) {
        self.short_since_ms.remove(&id);
        self.over.stop(id);
        self.able.remove(&id);
    }

    /// How far an estimated wind may be wrong, m/s.
    fn error_mps(&self) -> f64 {
        let estimated = self.weather.estimated;
        estimated.map_or(0.0, |_| ESTIMATE_MARGIN_MPS)
    }

    /// Time passes, and maybe the wind changes. Who had the fuel to come home in the wind before
    /// may have stayed out for what it then was, and lacks it in this one.
    fn note_wind(&mut self, now_ms: u64) {
        if self.weather.since_ms(now_ms) > self.looked_ms {
            self.able.clear();
        }
        self.looked_ms = now_ms;
        let from_ms = now_ms.saturating_sub(WIND_KNOWN_MS);
        self.winds = self.weather.between(from_ms, now_ms).collect();
    }

    /// The least time of a straight flight, seconds; infinite where the wind allows none.
    fn straight_s(&self, tank: Tank, from: Point, to: Point) -> f64 {
        let way = to - from;
        if way.norm() <= 0.0 {
            return 0.0;
        }
        let course = Course(atan2(way.y, way.x));
        let made_mps = |wind: &Wind| {
            let mps = wind.ground_speed_mps(course, tank.cruise_mps)?;
            Some(mps + self.error_mps()).filter(|mps| *mps > 0.0)
        };
        let fastest_mps = self.winds.iter().filter_map(made_mps).fold(0.0, f64::max);
        way.norm() / fastest_mps
    }

    /// The least time home from a boundary of a loop, milliseconds.
    fn home_ms(
        &mut self,
        tank: Tank,
        ground: &MissionGeometry,
        boundary: usize,
        base: Point,
    ) -> u64 {
        let from = ground.coverage_loop.boundary(boundary);
        let straight_s = self.straight_s(tank, from.position(), base);
        let router = &ground.router;
        let line = Segment::straight(from.position(), base);
        // A mission that moves only its base keeps what it has of routes to the one before.
        let is_its_base = (ground.mission.base_m() - base).norm() < 0.01;
        if !is_its_base || router.zones().is_segment_clear(&line, 0.0) {
            return milliseconds(straight_s);
        }
        let key = (
            ground.mission.revision,
            ground.coverage_loop.hash(),
            boundary,
        );
        let length_m = *self.routes_m.entry(key).or_insert_with(|| {
            let both = [from, from.reversed()].into_iter();
            let routes = both.filter_map(|pose| router.route_to_point(pose, base).ok());
            let lengths = routes.map(|route| route.length_m());
            lengths.min_by(f64::total_cmp)
        });
        let winds_mps = self.winds.iter().map(|w| w.speed_mps()).fold(0.0, f64::max);
        let fastest_mps = tank.cruise_mps + winds_mps + self.error_mps();
        let round_s = length_m.map_or(0.0, |m| SHORTEST * m / fastest_mps);
        milliseconds(straight_s.max(round_s))
    }

    /// The most that a bid may offer from now on, milliseconds: what its author has left, less
    /// the way home from the farthest cell that is open in its eyes.
    #[must_use]
    pub fn may_offer_ms(&self, id: u16, view: &Beliefs, fuel_s: f64, base: Point) -> Option<u64> {
        let tank = *self.tanks.get(&id)?;
        let ground = self.grounds.get(&(view.revision, view.loop_hash))?;
        let lp = &ground.coverage_loop;
        let is_open = |i: &usize| {
            let covered = u16::try_from(*i).is_ok_and(|c| view.covered.contains(c));
            lp.cells()[*i].needed && !covered
        };
        let home_s = |i: usize| {
            let ends = [i, (i + 1) % lp.len()];
            let each = ends.map(|b| self.straight_s(tank, lp.boundary(b).position(), base));
            each[0].min(each[1])
        };
        let farthest_s = (0..lp.len())
            .filter(is_open)
            .map(home_s)
            .fold(0.0, f64::max);
        let left_ms = milliseconds(fuel_s).saturating_sub(tank.reserve_ms);
        Some(left_ms.saturating_sub(milliseconds(farthest_s)))
    }

    /// Looks at everybody's plan and tank; `base` tells where the mission of a revision ends.
    pub fn on_snapshot(
        &mut self,
        snapshot: &Snapshot<'_>,
        base: impl Fn(u32) -> Option<Point>,
        flyers: (&BTreeMap<u16, Flyer>, &FlightCheck),
        found: &mut Findings,
    ) {
        self.note_wind(snapshot.now_ms);
        for m in snapshot.peers.iter().filter(|m| m.uav) {
            let (tank, base) = (self.tanks.get(&m.id).copied(), base(m.view.revision));
            let (Some(tank), Some(base), Some(fuel_ms)) = (tank, base, m.fuel_ms) else {
                self.on_silent(m.id);
                continue;
            };
            self.check_plan(snapshot, m, (tank, fuel_ms, base), found);
            self.check_return(snapshot, m, (tank, fuel_ms, base), flyers, found);
        }
    }

    /// S10: nobody plans to where it could not come home from.
    fn check_plan(
        &mut self,
        snapshot: &Snapshot<'_>,
        m: &PeerSnapshot,
        (tank, fuel_ms, base): (Tank, u64, Point),
        found: &mut Findings,
    ) {
        let now_ms = snapshot.now_ms;
        let late_ms = snapshot.late_ms(m.id, now_ms);
        // Who is told to hold flies no plan; it looks at it when it is told to go on.
        let plan = Some(&m.view.plan).filter(|_| m.view.order != Order::Hold);
        let ground = self.grounds.get(&(m.view.revision, m.view.loop_hash));
        let ground = ground.cloned();
        let ends = ground.zip(plan).and_then(|(ground, plan)| {
            let ends = ends_of(plan, ground.coverage_loop.len())?;
            let home_ms = ends.map(|b| self.home_ms(tank, &ground, b, base));
            Some(home_ms[0].min(home_ms[1]))
        });
        let left_ms = fuel_ms.saturating_sub(tank.reserve_ms) + ROUNDING_MS + late_ms;
        let short = ends.filter(|home_ms| u64::from(m.eta_ms).saturating_add(*home_ms) > left_ms);
        // A plan may become too long while it is flown; its peer looks once a period, so that
        // of two snapshots running one is after that.
        let Some(home_ms) = short else {
            self.short_since_ms.remove(&m.id);
            self.over.stop(m.id);
            return;
        };
        let since_ms = *self.short_since_ms.entry(m.id).or_insert(now_ms);
        let took_ms = snapshot.lived_ms(m.id, since_ms);
        if took_ms <= snapshot.bounds.period_ms / 2 + late_ms {
            return;
        }
        self.over.start(m.id, now_ms);
        if self.over.tell_once(m.id) {
            found.broken("S10", now_ms, Some(m.id), || {
                format!(
                    "plans {} ms and {home_ms} ms home with {} ms above its reserve",
                    m.eta_ms,
                    fuel_ms.saturating_sub(tank.reserve_ms)
                )
            });
        }
    }

    /// Whoever had the fuel to come home with its reserve does.
    fn check_return(
        &mut self,
        snapshot: &Snapshot<'_>,
        m: &PeerSnapshot,
        (tank, fuel_ms, base): (Tank, u64, Point),
        (flyers, flight): (&BTreeMap<u16, Flyer>, &FlightCheck),
        found: &mut Findings,
    ) {
        let now_ms = snapshot.now_ms;
        let (Some(at), Some(flyer)) = (m.at, flyers.get(&m.id)) else {
            return;
        };
        // Who holds by order stays until that is over, and who is home has come home.
        let is_held = m.view.order == Order::Hold || m.view.loop_hash == 0;
        if is_held || at_base(at, base, *flyer) {
            self.able.remove(&m.id);
            return;
        }
        let is_same = |able: &&mut Able| {
            let flown_ms = now_ms.saturating_sub(able.at_ms);
            let lost_ms = able.fuel_ms.saturating_sub(fuel_ms);
            able.base == base && able.revision == m.view.revision && lost_ms <= flown_ms + LEAK_MS
        };
        let late_ms = snapshot.late_ms(m.id, now_ms);
        let Some(able) = self.able.get_mut(&m.id).filter(is_same) else {
            let enough_ms = flight.longest_home_ms(at, base, *flyer) + late_ms;
            let fresh = Able {
                base,
                revision: m.view.revision,
                at_ms: now_ms,
                fuel_ms,
                told: false,
            };
            if fuel_ms >= tank.reserve_ms.saturating_add(enough_ms) {
                self.able.insert(m.id, fresh);
            } else {
                self.able.remove(&m.id);
            }
            return;
        };
        (able.at_ms, able.fuel_ms) = (now_ms, fuel_ms);
        let touched_ms = tank.reserve_ms.saturating_sub(fuel_ms);
        if touched_ms > ROUNDING_MS + late_ms && !able.told {
            able.told = true;
            let away_m = (at - base).norm();
            found.broken("fuel", now_ms, Some(m.id), || {
                format!("has {fuel_ms} ms left, less than its reserve, {away_m:.0} m from its base")
            });
        }
    }
}

/// The boundary where a plan ends; both of its last cell where its way along the loop is not
/// known.
fn ends_of(plan: &[u16], cells: usize) -> Option<[usize; 2]> {
    let last = usize::from(*plan.last()?) % cells.max(1);
    let next = (last + 1) % cells.max(1);
    let before = plan.len().checked_sub(2).map(|i| usize::from(plan[i]));
    Some(match before {
        Some(before) if (before + 1) % cells == last => [next, next],
        Some(before) if before == next => [last, last],
        _ => [last, next],
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use crate::geometry_cache::GeometryCache;
    use crate::world::fixture;
    use skein_peer::cells::CellSet;

    /// UAV 1 of the fixture at its farthest corner, 474 m or 36 s from its base.
    struct Case {
        check: FuelCheck,
        flight: FlightCheck,
        flyers: BTreeMap<u16, Flyer>,
        story: Story,
        found: Findings,
        view: Beliefs,
        base: Point,
        far: u16,
        far_at: Point,
    }

    impl Case {
        fn new(wind: Wind) -> Self {
            let mut spec = fixture::square(1);
            spec.wind = wind.into();
            let geometry = GeometryCache::default().of(&spec.mission).unwrap();
            let lp = &geometry.coverage_loop;
            let base = spec.mission.base_m();
            let away_m = |i: &usize| (lp.boundary(*i).position() - base).norm();
            let far = (0..lp.len()).max_by(|a, b| away_m(a).total_cmp(&away_m(b)));
            let far = far.unwrap();
            let mut check = FuelCheck::new(&spec);
            check.on_loop(&geometry);
            let flyer = Flyer {
                turn_radius_m: 23.0,
                slowest_mps: 13.0,
                fastest_mps: 16.0,
                waits_within_m: 115.0,
            };
            let flyers = BTreeMap::from([(1, flyer)]);
            let view = Beliefs {
                loop_hash: lp.hash(),
                covered: CellSet::new(u16::try_from(lp.len()).unwrap()),
                ..speaking()
            };
            Self {
                check,
                flight: FlightCheck::new(flyers.clone(), Vec::new(), 8.0),
                flyers,
                story: Story::new(0),
                found: Findings::new(1),
                view,
                base,
                far: u16::try_from(far).unwrap(),
                far_at: lp.boundary(far).position(),
            }
        }

        /// What is broken by a plan that ends in the far corner, so long from now, with so much
        /// fuel above the reserve.
        fn planned(&mut self, eta_s: u32, above_s: u64) -> bool {
            self.view.plan = vec![self.far.saturating_sub(2), self.far - 1];
            self.story.eta_ms = eta_s * 1000;
            self.flown(&[(0, self.base, 60 + above_s), (1, self.base, 59 + above_s)]);
            self.found.counts.contains_key("S10")
        }

        /// The UAV is at these times at these places with so much fuel, seconds.
        fn flown(&mut self, at: &[(u64, Point, u64)]) {
            for (time_s, place, fuel_s) in at {
                self.story.place(1, *place);
                self.story.fuel(1, fuel_s * 1000);
                let views = [(1, self.view.clone())];
                let (check, found, base) = (&mut self.check, &mut self.found, self.base);
                let flyers = (&self.flyers, &self.flight);
                self.story.snapshot(time_s * 1000, &views, |s| {
                    check.on_snapshot(s, |_| Some(base), flyers, found);
                });
            }
        }
    }

    #[test]
    fn a_plan_that_ends_where_the_fuel_does_not_reach_home_from_is_found() {
        assert!(!Case::new(Wind::CALM).planned(100, 140));
        assert!(Case::new(Wind::CALM).planned(100, 130));
        // Who is told to hold flies none.
        let mut held = Case::new(Wind::CALM);
        held.view.order = Order::Hold;
        assert!(!held.planned(100, 130));
    }

    #[test]
    fn against_the_wind_the_way_home_is_longer_and_may_be_none() {
        let way = |mut c: Case| c.planned(100, 140);
        assert!(way(Case::new(Wind::new(3.0, 2.0))));
        assert!(Case::new(Wind::new(20.0, 15.0)).planned(100, 3000));
        assert!(!way(Case::new(Wind::new(-3.0, -2.0))));
    }

    #[test]
    fn who_had_the_fuel_to_come_home_and_touches_its_reserve_on_the_way_is_found() {
        let late = |first_s: u64, lost_s: u64| {
            let mut c = Case::new(Wind::CALM);
            let far = c.far_at;
            let then_s = 58 + lost_s;
            c.flown(&[
                (0, far, first_s),
                (1, far, first_s - 1),
                (1 + first_s - then_s, far, then_s - lost_s),
            ]);
            c.found.counts.contains_key("fuel")
        };
        assert!(late(400, 0));
        // It never had enough, or lost it on the way.
        assert!(!late(100, 0));
        assert!(!late(400, 50));
        let mut home = Case::new(Wind::CALM);
        home.flown(&[
            (0, home.far_at, 400),
            (341, home.base, 59),
            (400, home.base, 0),
        ]);
        assert!(home.found.counts.is_empty());
    }

    #[test]
    fn bids_may_offer_what_is_left_but_for_the_farthest_open_cell() {
        let mut c = Case::new(Wind::CALM);
        let offered = |c: &Case| c.check.may_offer_ms(1, &c.view, 260.0, c.base).unwrap();
        let of_all = offered(&c);
        assert!((160_000..170_000).contains(&of_all), "{of_all}");
        let n = c.view.covered.capacity();
        c.view.covered = CellSet::of(n, (0..n).filter(|i| *i != 0));
        assert!(offered(&c) > of_all + 10_000);
    }
}
