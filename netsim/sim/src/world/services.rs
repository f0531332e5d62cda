//! Services on the ground of a world (D2.7 §3.7: until ground services reach it): units that
//! drive to what the ground station knows to be followed.
//!
//! | event | what follows |
//! |---|---|
//! | the ground station has a call, and a unit is free | the nearest goes there, along its streets where it has some |
//! | what is called for was seen elsewhere | the unit drives there instead |
//! | it is within [`REACHED_M`] of the vehicle that looks so and is nearest to where it is called | that is served: it stops, and the unit stays with it for a while |
//! | the call is over | the unit is free, and waits where it is |
//!
//! # Guarantees
//! Units know what the ground station knows, and what stands beside them. Where a ground station
//! asks again for what was served it is told so again. Nothing is drawn.

use super::vehicles::Vehicles;
use crate::spec::ServiceSpec;
use skein_geometry::frame::Point;
use skein_geometry::math::seconds;
use skein_peer::Call;
use skein_peer::mission::point_m;
use skein_peer::wire::tasks::TaskId;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Units move in steps of this, milliseconds.
const STEP_MS: u64 = 250;

/// A unit has reached what is so near, metres: along a street and across it.
pub const REACHED_M: f64 = 20.0;

/// It is the one that is called for if it is no farther from where that is said to be, metres.
const MEANT_M: f64 = 40.0;

/// A way is planned anew where its end is farther than this from what is called for, metres.
const ELSEWHERE_M: f64 = 4.0;

/// A unit stays with what it serves for so long, milliseconds.
const STAYS_MS: u64 = 60_000;

/// Who has not taken note that something is served is told so again after this, milliseconds.
const AGAIN_MS: u64 = 10_000;

/// Which call: the task, in the revision in which it was asked for.
type Which = (TaskId, u32);

/// All units of a world, and what they do.
#[derive(Clone, Debug, Default)]
pub struct Services {
    specs: Arc<[ServiceSpec]>,
    units: Vec<Unit>,
    calls: Vec<Call>,
    /// What was served, and when the ground station was told so last, milliseconds.
    served: BTreeMap<Which, Option<u64>>,
    moved_ms: u64,
}

/// One unit.
#[derive(Clone, Debug)]
struct Unit {
    at: Point,
    goes_to: Option<Which>,
    /// Where its way ends, and the rest of that, in order.
    end: Point,
    way: Vec<Point>,
    /// It stays where it is until then, milliseconds.
    busy_ms: u64,
}

impl Services {
    /// All at their bases.
    #[must_use]
    pub(super) fn new(specs: &[ServiceSpec]) -> Self {
        let unit = |s: &ServiceSpec| Unit {
            at: s.base,
            goes_to: None,
            end: s.base,
            way: Vec::new(),
            busy_ms: 0,
        };
        Self {
            units: specs.iter().map(unit).collect(),
            specs: specs.into(),
            ..Self::default()
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.units.is_empty()
    }

    /// Where the units are, metres.
    pub fn places(&self) -> impl Iterator<Item = Point> + '_ {
        self.units.iter().map(|u| u.at)
    }

    /// The ground station has these calls; gives those that are served, and it was not told so
    /// just now.
    pub(super) fn called(&mut self, calls: &[Call]) -> Vec<Call> {
        self.calls = calls.to_vec();
        let now_ms = self.moved_ms;
        let mut news = Vec::new();
        for call in calls {
            let Some(told) = self.served.get_mut(&which(call)) else {
                continue;
            };
            if told.is_none_or(|at| now_ms >= at + AGAIN_MS) {
                *told = Some(now_ms);
                news.push(call.clone());
            }
        }
        news
    }

    /// Moves them on beside the vehicles.
    pub(super) fn drive(&mut self, to_ms: u64, vehicles: &mut Vehicles) {
        if self.units.is_empty() {
            return;
        }
        while self.moved_ms + STEP_MS <= to_ms {
            self.moved_ms += STEP_MS;
            self.send();
            for nth in 0..self.units.len() {
                self.step(nth, vehicles);
            }
        }
    }

    fn call(&self, of: Which) -> Option<&Call> {
        self.calls.iter().find(|c| which(c) == of)
    }

    /// Calls that nobody goes to are given to the nearest who are free, the first call first.
    fn send(&mut self) {
        for nth in 0..self.units.len() {
            let unit = &self.units[nth];
            let is_over = |of: Which| self.call(of).is_none() || self.served.contains_key(&of);
            if unit.goes_to.is_some_and(is_over) {
                self.units[nth].goes_to = None;
                self.units[nth].way.clear();
            }
        }
        for nth in 0..self.calls.len() {
            let (of, at) = (which(&self.calls[nth]), point_m(self.calls[nth].at_mm));
            let is_taken = self.units.iter().any(|u| u.goes_to == Some(of));
            if is_taken || self.served.contains_key(&of) {
                continue;
            }
            let free = self.units.iter_mut();
            let free = free.filter(|u| u.goes_to.is_none() && u.busy_ms <= self.moved_ms);
            let nearest = free.min_by(|a, b| (a.at - at).norm().total_cmp(&(b.at - at).norm()));
            if let Some(unit) = nearest {
                (unit.goes_to, unit.end) = (Some(of), unit.at);
            }
        }
    }

    /// One unit for one step.
    fn step(&mut self, nth: usize, vehicles: &mut Vehicles) {
        let Some(of) = self.units[nth].goes_to else {
            return;
        };
        let Some((to, looks)) = self.call(of).map(|c| (point_m(c.at_mm), c.looks)) else {
            return;
        };
        let (spec, unit) = (&self.specs[nth], &mut self.units[nth]);
        if (unit.end - to).norm() > ELSEWHERE_M {
            (unit.end, unit.way) = (to, spec.way(unit.at, to));
        }
        unit.drive(spec.speed_mps * seconds(STEP_MS));
        if vehicles.stop_near((to, MEANT_M), (unit.at, REACHED_M), looks) {
            unit.busy_ms = self.moved_ms + STAYS_MS;
            unit.goes_to = None;
            unit.way.clear();
            self.served.insert(of, None);
        }
    }
}

fn which(call: &Call) -> Which {
    (call.task, call.revision)
}

impl Unit {
    /// Moves along its way, metres.
    fn drive(&mut self, mut left_m: f64) {
        while let Some(next) = self.way.first().copied() {
            let to = next - self.at;
            let to_m = to.norm();
            if to_m > left_m {
                self.at += to * (left_m / to_m);
                return;
            }
            left_m -= to_m;
            self.at = next;
            self.way.remove(0);
        }
    }
}

impl ServiceSpec {
    /// From a place to a place: along streets where they lead there, and straight to the street
    /// and from it.
    fn way(&self, from: Point, to: Point) -> Vec<Point> {
        let streets = self.streets.as_ref();
        let along = streets.and_then(|net| {
            let legs = net.quickest(from, to, &|_| 1.0 / self.speed_mps.max(0.1))?;
            Some(net.line(&legs))
        });
        let mut way = along.unwrap_or_default();
        way.push(to);
        way
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pursuit::roads::Roads;
    use crate::pursuit::vehicle::Behaviour;
    use crate::spec::{Spec, VehicleSpec};
    use crate::world::{World, fixture};
    use skein_flight::streets::network::Network;

    fn unit(base: Point, streets: Option<Network>) -> ServiceSpec {
        ServiceSpec {
            base,
            speed_mps: 10.0,
            streets: streets.map(Arc::new),
        }
    }

    /// A car that drives along a road, and units.
    fn scene(services: Vec<ServiceSpec>) -> World {
        let road = vec![Point::new(0.0, 300.0), Point::new(460.0, 300.0)];
        let spec = Spec {
            vehicles: vec![VehicleSpec {
                roads: Arc::new(Roads::of(&[road]).unwrap()),
                start: Some(Point::new(0.0, 300.0)),
                behaviour: Behaviour::Drives,
                speed_mps: 8.0,
                kind: 1,
                confused_permille: 0,
            }],
            services,
            ..fixture::square(1)
        };
        World::new(&spec, 3)
    }

    fn call(number: u16, at: Point) -> Call {
        Call {
            task: TaskId { author: 1, number },
            revision: 1,
            name: format!("car-1.{number}"),
            looks: 1,
            at_mm: (skein_peer::mission::mm(at.x), skein_peer::mission::mm(at.y)),
        }
    }

    /// Until when it drives if the station knows where the car is, milliseconds.
    fn served_ms(world: &mut World, known: impl Fn(Point) -> Point) -> Option<u64> {
        for t in 1..400 {
            world.advance(t * 500);
            let car = world.vehicles().places().next().unwrap();
            if !world.dispatch(&[call(0, known(car))]).is_empty() {
                return Some(t * 500);
            }
        }
        None
    }

    #[test]
    fn a_unit_drives_after_what_is_called_for_and_that_stops() {
        let mut world = scene(vec![unit(Point::new(460.0, 0.0), None)]);
        let at_ms = served_ms(&mut world, |car| car).unwrap();
        // 300 m away at 10 m/s at least.
        assert!((28_000..80_000).contains(&at_ms), "{at_ms}");
        world.advance(at_ms + 10_000);
        let stood = world.vehicles().places().next().unwrap();
        world.advance(at_ms + 30_000);
        assert_eq!(world.vehicles().places().next().unwrap(), stood);
        // And is said to be served for as long as the station asks, now and then.
        assert_eq!(world.dispatch(&[call(0, stood)]).len(), 1);
        assert!(world.dispatch(&[call(0, stood)]).is_empty());
        assert!(world.dispatch(&[call(1, stood)]).is_empty());
    }

    #[test]
    fn who_is_sent_to_where_nothing_is_serves_nothing() {
        let mut world = scene(vec![unit(Point::new(460.0, 0.0), None)]);
        assert_eq!(served_ms(&mut world, |_| Point::new(200.0, 80.0)), None);
        let at = world.services().places().next().unwrap();
        assert!((at - Point::new(200.0, 80.0)).norm() < 1.0, "{at}");
        // Nor what it drives past on its way, though it may be taken for what is called for.
        let slow = ServiceSpec {
            speed_mps: 0.5,
            ..unit(Point::new(230.0, 300.0), None)
        };
        let mut world = scene(vec![slow]);
        assert_eq!(served_ms(&mut world, |_| Point::new(230.0, 600.0)), None);
        let car = world.vehicles().places().next().unwrap();
        world.advance(400_000);
        assert_ne!(world.vehicles().places().next().unwrap(), car);
        // Nor what looks otherwise.
        let mut world = scene(vec![unit(Point::new(200.0, 280.0), None)]);
        let bus = Call {
            looks: 3,
            ..call(0, Point::new(200.0, 300.0))
        };
        for t in 1..200 {
            world.advance(t * 500);
            assert!(world.dispatch(std::slice::from_ref(&bus)).is_empty());
        }
    }

    #[test]
    fn streets_are_driven_where_there_are_some() {
        let corner = vec![
            Point::new(0.0, 0.0),
            Point::new(400.0, 0.0),
            Point::new(400.0, 300.0),
        ];
        let way = unit(Point::new(0.0, 0.0), Some(Network::of(&[(0, corner)])))
            .way(Point::new(0.0, 5.0), Point::new(405.0, 290.0));
        let length_m: f64 = way.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        assert!(length_m > 680.0, "{length_m} {way:?}");
        let straight = unit(Point::new(0.0, 0.0), None);
        assert_eq!(
            straight.way(Point::new(0.0, 0.0), Point::new(9.0, 9.0)),
            [Point::new(9.0, 9.0)]
        );
    }

    #[test]
    fn two_calls_are_two_units_and_the_nearest_goes() {
        let (west, east) = (Point::new(0.0, 0.0), Point::new(460.0, 0.0));
        let mut world = scene(vec![unit(west, None), unit(east, None)]);
        let calls = [
            call(0, Point::new(440.0, 50.0)),
            call(1, Point::new(430.0, 60.0)),
        ];
        world.dispatch(&calls);
        world.advance(2_000);
        let at: Vec<Point> = world.services().places().collect();
        assert!((at[1] - east).norm() > 15.0 && (at[0] - west).norm() > 15.0);
        assert!((at[1] - Point::new(440.0, 50.0)).norm() < (east - Point::new(440.0, 50.0)).norm());
        // Without calls they wait where they are.
        world.dispatch(&[]);
        world.advance(9_000);
        assert_eq!(world.services().places().collect::<Vec<_>>(), at);
    }
}
