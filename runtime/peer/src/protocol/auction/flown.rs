//! What tasks are worth to a UAV: flown time along Dubins curves (D2.7 §2.4.1, §3.4, §3.5).
//!
//! A task counts its worth at the moment at which it is done, less the later that is: after
//! [`HALF_TIME_MS`] one half, after three times as long a quarter, and never nothing, so that
//! even the last of a hundred tasks is better done sooner. What goes on (a target, a relay)
//! counts at arrival. Who holds something until somebody ends it does nothing after that, and
//! has no section meanwhile, so that the fuel for it is free.
//!
//! A place is flown over on the course on which it lies from the last one. Who has a section
//! comes back to where it left it, and a task counts so much less as that way is long. Air
//! that moves is left out, and zones where no router is known: bids compare UAVs, and what is
//! flown is planned by the executive.

use super::settlement::Flying;
use crate::PeerId;
use crate::wire::tasks::{Offer, Task, TaskId, TaskKind, TaskPlace};
use skein_flight::route::Router;
use skein_flight::trajectory::dubins::{length_m, shortest};
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::atan2;
use std::cell::RefCell;
use std::collections::BTreeMap;

/// After so long a task is worth half, milliseconds.
pub const HALF_TIME_MS: u64 = 60_000;

/// Who takes what is held until somebody ends it must be able to stay there for so long,
/// milliseconds: it takes others half a minute to hear of it, to settle and to come.
pub const LEAST_HELD_MS: u64 = 120_000;

/// Bids are in millionths of [`Task::worth`].
const MILLION: u64 = 1_000_000;

/// Nearer than this there is no course from one place to the next, metres.
const SAME_PLACE_M: f64 = 0.001;

/// What tasks are worth by flown time.
#[derive(Clone, Copy, Debug)]
pub struct FlownTime;

/// A UAV in the course of its order.
#[derive(Clone, Copy, Debug)]
pub struct Airborne {
    pose: Pose,
    time_ms: u64,
    /// Whether it stays where it is until somebody says otherwise.
    stays: bool,
    offer: Offer,
}

fn point(p: TaskPlace) -> Point {
    crate::mission::point_m((p.east_mm, p.north_mm))
}

fn course(from: Point, to: Point) -> Option<f64> {
    let way = to - from;
    (way.norm() > SAME_PLACE_M).then(|| atan2(way.y, way.x))
}

/// The time that a way takes at a speed, milliseconds, rounded up.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "ways are within some hundred kilometres, and conversions saturate"
)]
fn flight_ms(way_m: f64, speed_mmps: u32) -> u64 {
    (way_m * MILLION as f64 / f64::from(speed_mmps)).ceil() as u64
}

/// What is left of a worth after a time.
#[must_use]
pub fn value(worth: u16, after_ms: u64) -> u32 {
    let full = u64::from(worth) * MILLION;
    let left = full * HALF_TIME_MS / HALF_TIME_MS.saturating_add(after_ms);
    u32::try_from(left).unwrap_or(u32::MAX)
}

impl Airborne {
    /// Flies over places: where it is then.
    fn along(&self, places: &[TaskPlace], ways: &impl Ways) -> Option<(Pose, u64)> {
        let speed_mmps = self.offer.speed_mmps;
        let first = point(*places.first()?);
        let next = places.get(1).and_then(|p| course(first, point(*p)));
        let here = self.pose.position();
        let heading_rad = next.or_else(|| course(here, first));
        let heading_rad = heading_rad.unwrap_or(self.pose.heading_rad);
        let entry = Pose::new(first, heading_rad);
        let radius_m = f64::from(self.offer.radius_mm.max(1)) / 1000.0;
        let mut way_m = ways.length_m(self.pose, entry, radius_m);
        let mut pose = entry;
        for pair in places.windows(2) {
            let (a, b) = (point(pair[0]), point(pair[1]));
            way_m += (b - a).norm();
            pose = Pose::new(b, course(a, b).unwrap_or(pose.heading_rad));
        }
        Some((pose, self.time_ms + flight_ms(way_m, speed_mmps)))
    }

    /// The straight way back to where it was asked, milliseconds.
    fn back_ms(&self, from: Pose) -> u64 {
        let left = crate::mission::point_m((self.offer.east_mm, self.offer.north_mm));
        flight_ms((left - from.position()).norm(), self.offer.speed_mmps)
    }

    fn has(&self, sensor: u8) -> bool {
        let bit = u32::from(sensor).checked_sub(1);
        bit.is_none_or(|bit| self.offer.sensors >> bit.min(31) & 1 == 1)
    }
}

/// How far it is from one pose to another.
trait Ways {
    /// The way with turns of this radius, metres.
    fn length_m(&self, from: Pose, to: Pose, radius_m: f64) -> f64;
}

impl Ways for FlownTime {
    fn length_m(&self, from: Pose, to: Pose, radius_m: f64) -> f64 {
        length_m(from, to, radius_m)
    }
}

/// How many ways are remembered at once: those between some hundred places.
const REMEMBERED_MAX: usize = 1 << 14;

/// From where to where, and the turn radius, to the last bit.
type AskedWay = ([u64; 3], [u64; 3], u64);

/// Ways round the zones of one mission that were asked for before: the same places come up in
/// settlement after settlement.
#[derive(Debug, Default)]
pub struct AskedWays(RefCell<BTreeMap<AskedWay, f64>>);

impl AskedWays {
    fn remembered_m(&self, way: AskedWay, ask_m: impl FnOnce() -> f64) -> f64 {
        if let Some(way_m) = self.0.borrow().get(&way) {
            return *way_m;
        }
        let way_m = ask_m();
        let mut asked = self.0.borrow_mut();
        if asked.len() >= REMEMBERED_MAX {
            asked.clear();
        }
        asked.insert(way, way_m);
        way_m
    }
}

/// What tasks are worth by flown time round the no-fly zones of a mission: all who hold the
/// same zones get the same.
#[derive(Clone, Copy, Debug)]
pub struct RoutedTime<'a> {
    router: &'a Router,
    asked: &'a AskedWays,
}

impl<'a> RoutedTime<'a> {
    /// Ways by this router, of which `asked` remembers those of no other one; where it knows none
    /// they are reckoned as if there were no zones, and whoever is to fly them finds out.
    #[must_use]
    pub fn new(router: &'a Router, asked: &'a AskedWays) -> Self {
        Self { router, asked }
    }
}

impl Ways for RoutedTime<'_> {
    fn length_m(&self, from: Pose, to: Pose, radius_m: f64) -> f64 {
        let zones = self.router.zones();
        if zones.zones().is_empty() {
            return length_m(from, to, radius_m);
        }
        let exact = |p: Pose| [p.east_m, p.north_m, p.heading_rad].map(f64::to_bits);
        let asked = (exact(from), exact(to), radius_m.to_bits());
        self.asked.remembered_m(asked, || {
            let straight = shortest(from, to, radius_m);
            if zones.is_clear(&straight, self.router.limits().clearance_m) {
                return straight.length_m();
            }
            let routed = self.router.route(from, to);
            routed.map_or(straight.length_m(), |way| way.length_m())
        })
    }
}

impl Flying for RoutedTime<'_> {
    type At = Airborne;

    fn begin(&self, who: PeerId, offer: &Offer) -> Airborne {
        FlownTime.begin(who, offer)
    }

    fn then(&self, at: &Airborne, _: TaskId, task: &Task) -> Option<(Airborne, u32)> {
        flown(at, task, self)
    }
}

impl Flying for FlownTime {
    type At = Airborne;

    fn begin(&self, _: PeerId, offer: &Offer) -> Airborne {
        let at = crate::mission::point_m((offer.east_mm, offer.north_mm));
        Airborne {
            pose: Pose::new(at, f64::from(offer.course_e4) / 10_000.0),
            time_ms: 0,
            stays: false,
            offer: *offer,
        }
    }

    fn then(&self, at: &Airborne, _: TaskId, task: &Task) -> Option<(Airborne, u32)> {
        flown(at, task, self)
    }
}

/// Where a task leaves a UAV, and what it is worth when it is done then.
fn flown(at: &Airborne, task: &Task, ways: &impl Ways) -> Option<(Airborne, u32)> {
    if at.offer.speed_mmps == 0 || at.stays || !at.has(task.sensor) || !at.offer.flies(task.kind) {
        return None;
    }
    // An area is begun at a corner, and its time says how long it takes.
    let way = match task.kind {
        TaskKind::Area => task.places.get(..1)?,
        _ => &task.places[..],
    };
    let mut flown = at.along(way, ways)?;
    if task.kind == TaskKind::Line {
        let back: Vec<TaskPlace> = task.places.iter().rev().copied().collect();
        let back = at.along(&back, ways).filter(|b| b.1 < flown.1);
        flown = back.unwrap_or(flown);
    }
    let (pose, there_ms) = flown;
    let time_ms = there_ms + u64::from(task.stay_ms);
    // From where it was asked it knows that it can return.
    let back_ms = at.back_ms(pose);
    let endurance_ms = u64::from(at.offer.endurance_ms);
    let (needs_ms, has_ms) = if task.is_held() {
        let freed_ms = u64::from(at.offer.section_ms);
        (time_ms + LEAST_HELD_MS + back_ms, endurance_ms + freed_ms)
    } else {
        (time_ms + back_ms, endurance_ms)
    };
    if needs_ms > has_ms {
        return None;
    }
    let returns_ms = if at.offer.section_ms == 0 { 0 } else { back_ms };
    let counts_ms = if task.kind.goes_on() {
        there_ms
    } else {
        time_ms
    };
    let next = Airborne {
        pose,
        time_ms,
        stays: task.is_held(),
        ..*at
    };
    Some((next, value(task.worth, counts_ms + returns_ms)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::tasks::{EVERY_KIND, TRACKS};

    const OFFER: Offer = Offer {
        east_mm: 0,
        north_mm: 0,
        course_e4: 0,
        speed_mmps: 20_000,
        radius_mm: 70_000,
        endurance_ms: 600_000,
        sensors: 0b10,
        section_ms: 0,
        takes: EVERY_KIND,
    };

    fn at(east_m: i32, north_m: i32) -> TaskPlace {
        TaskPlace {
            east_mm: east_m * 1000,
            north_mm: north_m * 1000,
        }
    }

    fn task(kind: TaskKind, places: &[TaskPlace]) -> Task {
        Task {
            revision: 1,
            kind,
            places: places.to_vec(),
            sensor: 0,
            worth: 100,
            ..Task::default()
        }
    }

    fn fly(offer: Offer, task: &Task) -> Option<(u64, u32)> {
        let from = FlownTime.begin(PeerId(1), &offer);
        let (at, value) = FlownTime.then(&from, TaskId::default(), task)?;
        Some((at.time_ms, value))
    }

    #[test]
    fn a_place_straight_ahead_takes_its_distance() {
        let ahead = task(TaskKind::Pinpoint, &[at(1200, 0)]);
        // A minute away it is worth half.
        assert_eq!(fly(OFFER, &ahead), Some((60_000, 50_000_000)));
        let (behind_ms, _) = fly(OFFER, &task(TaskKind::Pinpoint, &[at(-1200, 0)])).unwrap();
        // The way back costs half a circle of 70 m more or less.
        assert!((60_000..80_000).contains(&behind_ms), "{behind_ms}");
        assert_eq!(
            fly(OFFER, &task(TaskKind::Pinpoint, &[at(0, 0)])),
            Some((0, 100_000_000))
        );
    }

    #[test]
    fn a_line_is_flown_from_the_nearer_end() {
        let line = [at(400, 0), at(800, 0)];
        let mut back = line;
        back.reverse();
        let forth = fly(OFFER, &task(TaskKind::Line, &line));
        assert_eq!(forth, fly(OFFER, &task(TaskKind::Line, &back)));
        assert_eq!(forth.map(|f| f.0), Some(40_000));
    }

    #[test]
    fn what_goes_on_counts_from_arrival_and_an_area_when_it_is_seen() {
        let stays = |kind| {
            let mut task = task(kind, &[at(1200, 0)]);
            task.stay_ms = 60_000;
            fly(OFFER, &task)
        };
        assert_eq!(stays(TaskKind::Track), Some((120_000, 50_000_000)));
        assert_eq!(stays(TaskKind::Relay), stays(TaskKind::Track));
        assert_eq!(stays(TaskKind::Area), Some((120_000, 33_333_333)));
    }

    #[test]
    fn what_is_held_until_somebody_ends_it_is_the_last_of_an_order_and_needs_time_to_stay() {
        let relay = task(TaskKind::Relay, &[at(1200, 0)]);
        let from = FlownTime.begin(PeerId(1), &OFFER);
        let (there, value) = FlownTime.then(&from, TaskId::default(), &relay).unwrap();
        assert_eq!((there.time_ms, value), (60_000, 50_000_000));
        let ahead = task(TaskKind::Pinpoint, &[at(1300, 0)]);
        assert!(FlownTime.then(&there, TaskId::default(), &ahead).is_none());
        // A minute there, two minutes to stay, a minute back.
        let lasts = |endurance_ms, section_ms| Offer {
            endurance_ms,
            section_ms,
            ..OFFER
        };
        assert!(fly(lasts(239_999, 0), &relay).is_none());
        assert!(fly(lasts(240_000, 0), &relay).is_some());
        // Who holds it has no section to fly.
        assert!(fly(lasts(40_000, 200_000), &relay).is_some());
        assert!(fly(lasts(40_000, 200_000), &ahead).is_none());
    }

    #[test]
    fn an_area_takes_its_time_from_its_first_corner_on() {
        let mut area = task(TaskKind::Area, &[at(1200, 0), at(1400, 0), at(1400, 300)]);
        area.stay_ms = 60_000;
        assert_eq!(fly(OFFER, &area), Some((120_000, 33_333_333)));
    }

    #[test]
    fn who_lacks_the_sensor_the_time_or_the_wings_takes_nothing() {
        let mut near = task(TaskKind::Pinpoint, &[at(100, 0)]);
        for (sensor, can) in [(0, true), (1, false), (2, true), (32, false)] {
            near.sensor = sensor;
            assert_eq!(fly(OFFER, &near).is_some(), can, "sensor {sensor}");
        }
        let grounded = Offer {
            speed_mmps: 0,
            ..OFFER
        };
        assert_eq!(fly(grounded, &near), None);
        let far = task(TaskKind::Pinpoint, &[at(12_001, 0)]);
        assert_eq!(fly(OFFER, &far), None);
        // Its mission is over for all but targets.
        let follows = Offer {
            takes: TRACKS,
            ..OFFER
        };
        near.sensor = 0;
        assert_eq!(fly(follows, &near), None);
        assert!(fly(follows, &task(TaskKind::Track, &[at(100, 0)])).is_some());
        assert!(fly(follows, &task(TaskKind::Relay, &[at(100, 0)])).is_none());
        let nowhere = task(TaskKind::Pinpoint, &[]);
        assert_eq!(fly(OFFER, &nowhere), None);
    }

    #[test]
    fn ways_round_zones_are_remembered_by_their_ends_and_their_radius() {
        use skein_flight::route::RouteLimits;
        use skein_geometry::Polygon;
        use skein_geometry::clearance::NoFlyZones;
        let wall = [
            (500.0, -100.0),
            (540.0, -100.0),
            (540.0, 100.0),
            (500.0, 100.0),
        ];
        let wall = Polygon::new(wall.map(|(x, y)| Point::new(x, y)).to_vec());
        let zones = NoFlyZones::new(vec![wall.unwrap()]);
        let limits = RouteLimits {
            turn_radius_m: 70.0,
            clearance_m: 10.0,
        };
        let router = Router::new(std::sync::Arc::new(zones), limits);
        let asked = AskedWays::default();
        let routed = RoutedTime::new(&router, &asked);
        let (from, to) = (Pose::new(Point::origin(), 0.0), Point::new(1200.0, 0.0));
        let beyond = routed.length_m(from, Pose::new(to, 0.0), 70.0);
        assert!((1200.5..1300.0).contains(&beyond), "{beyond}");
        assert_eq!(asked.0.borrow().len(), 1);
        let again = routed.length_m(from, Pose::new(to, 0.0), 70.0);
        assert_eq!(again.to_bits(), beyond.to_bits());
        assert_eq!(asked.0.borrow().len(), 1);
        // Back over its own course, with two circles.
        let behind = Pose::new(Point::new(-300.0, 0.0), 0.0);
        let wide = routed.length_m(from, behind, 70.0);
        let tight = routed.length_m(from, behind, 20.0);
        assert!(tight < wide, "{tight} {wide}");
        assert_eq!(asked.0.borrow().len(), 3);
        for k in 0..=REMEMBERED_MAX {
            let _ = asked.remembered_m(([k as u64; 3], [0; 3], 0), || 1.0);
        }
        assert!(asked.0.borrow().len() <= REMEMBERED_MAX);
    }
}
