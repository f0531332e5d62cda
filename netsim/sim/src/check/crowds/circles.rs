//! Who stays above what is too dense, where the mission of an event says so (`crowd-circle`,
//! `crowd-linger`, `crowd-many`; D2.7 §3.1), and how long what is too dense is in a picture.
//!
//! | what | beside |
//! |---|---|
//! | a sector is too dense by what all UAVs of a component were told, and one of them beside another could fly there | whether one of them says that it circles, and had something too dense in its picture within a round |
//! | a UAV says that it circles | likewise |
//! | so many UAVs are to fly circles | how many the mission says, and that one is left |
//!
//! # Where the bounds come from
//! That it is too dense is known, the circle is offered for and won: each takes a record to all, and
//! single cases may take three times as long, as for all tasks. Then who won ends its cell and flies
//! there, from wherever it is, as for relay positions, and round once: no circle is wider than three
//! times the turn radius. What somebody else knows to have eased is left at once; a round and two
//! records later at most.

use super::super::flight::{FlightCheck, Flyer, milliseconds};
use super::super::{Clocks, Findings, Grade, PeerSnapshot, Snapshot};
use super::truth;
use crate::world::camera::Picture;
use serde::{Deserialize, Serialize};
use skein_geometry::NoFlyZones;
use skein_geometry::frame::Point;
use skein_geometry::math::TAU;
use skein_peer::crowd::{CrowdWatch, ThenWatch};
use skein_peer::gathering::Sector;
use skein_peer::wire::message::Order;
use skein_peer::wire::tasks::Progress;
use skein_peer::{Mission, circled_sector};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A single case may take so many bounds, as of all tasks.
const FACTOR: u64 = 3;

/// A circle is heard of, offered for, and won: each takes a record to all.
const WAYS: u64 = 3;

/// From when a UAV is given a circle to when it flies there, milliseconds.
const SET_OUT_MS: u64 = 60_000;

/// Who has not the fuel for so long there need not go, milliseconds.
const STAY_MS: u64 = 180_000;

/// No circle is wider than so many turn radii.
const WIDEST: f64 = 3.0;

/// What is in a picture is looked at once a second.
const LOOK_MS: u64 = 1_000;

/// For how long what was too dense was in a picture.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Watched {
    /// So long sectors were known to be too dense, added up, milliseconds.
    pub dense_ms: u64,
    /// And so long of that they were in somebody's picture.
    pub pictured_ms: u64,
    /// How long after something was known to be too dense somebody circled above, milliseconds.
    pub after_ms: Vec<u64>,
    /// For so long somebody circled.
    pub circled_ms: u64,
}

/// What came of circles in one run.
#[derive(Clone, Debug, Default)]
pub struct CircleCheck {
    watch: Option<Arc<CrowdWatch>>,
    revision: u32,
    zones: Option<Arc<NoFlyZones>>,
    /// How far from zones sectors are above which there is room for a circle, metres.
    room_m: f64,
    /// When each UAV had each sector in its picture that was too dense.
    pictured: BTreeMap<(u16, u16), u64>,
    none: Clocks<u16>,
    lingers: Clocks<u16>,
    many: Clocks<u16>,
    /// Since when something was too dense, and nobody circled since.
    waits_ms: Option<u64>,
    circles_now: bool,
    last_ms: u64,
    watched: Watched,
}

impl CircleCheck {
    /// The operator has a mission.
    pub fn on_mission(&mut self, mission: &Mission) {
        let watch = mission.crowd.clone();
        if watch != self.watch {
            *self = Self::default();
        }
        self.watch = watch;
        self.revision = mission.revision;
        self.zones = mission.no_fly_zones().ok();
        self.room_m = mission.clearance_m() + 2.0 * WIDEST * mission.turn_radius_m();
    }

    /// One look of a UAV, that knows these sectors to be too dense.
    pub fn on_look(&mut self, now_ms: u64, uav: u16, picture: &Picture, dense: &[u16]) {
        let Some(watch) = &self.watch else { return };
        let side_m = f64::from(watch.sector_m);
        for sector in dense {
            let Some(low) = watch.low(*sector) else {
                continue;
            };
            let corners = truth::corners(low, side_m);
            if corners.iter().all(|p| picture.shows(*p, 1.0)) {
                self.pictured.insert((uav, *sector), now_ms);
            }
        }
    }

    /// What was too dense, and who was there.
    #[must_use]
    pub fn watched(&self) -> Watched {
        self.watched.clone()
    }

    /// Looks at all components.
    pub fn on_snapshot(
        &mut self,
        snapshot: &Snapshot<'_>,
        flyers: (&BTreeMap<u16, Flyer>, &FlightCheck),
        found: &mut Findings,
    ) {
        let Some(watch) = self.watch.clone() else {
            return;
        };
        self.measure(snapshot);
        if watch.then != ThenWatch::Circle {
            return;
        }
        let mut seen = [const { BTreeSet::new() }; 3];
        for members in snapshot.graph.components() {
            let peers = snapshot.speaking_uavs(&members);
            let flies = |m: &&PeerSnapshot| !m.view.finished && m.view.revision >= self.revision;
            let Some(first) = peers.first().filter(|_| peers.iter().all(flies)) else {
                continue;
            };
            let Some(whole_ms) = snapshot.stability.component_since_ms(first.id) else {
                continue;
            };
            let since_ms = peers.iter().map(|m| m.since_ms).fold(whole_ms, u64::max);
            let here = Here {
                key: first.id,
                peers,
                since_ms,
            };
            self.look_for_nobody(snapshot, &here, flyers, (&mut seen[0], found));
            self.look_for_idlers(snapshot, &here, flyers.0, (&mut seen[1], found));
            self.look_for_many(snapshot, &here, watch.circles_max, (&mut seen[2], found));
        }
        let [none, lingers, many] = seen;
        self.none.retain(|k| none.contains(k));
        self.lingers.retain(|k| lingers.contains(k));
        self.many.retain(|k| many.contains(k));
    }

    /// How long what is too dense is in a picture, and how long after that somebody circles.
    fn measure(&mut self, snapshot: &Snapshot<'_>) {
        let now_ms = snapshot.now_ms;
        let step_ms = now_ms.saturating_sub(self.last_ms);
        self.last_ms = now_ms;
        let uavs = snapshot.peers.iter().filter(|m| m.uav && m.view.speaks);
        let uavs: Vec<&PeerSnapshot> = uavs.filter(|m| !m.view.finished).collect();
        let dense: BTreeSet<u16> = uavs.iter().flat_map(|m| dense_of(&m.view.crowd)).collect();
        let of_late = self.pictured.iter();
        let of_late = of_late.filter(|(_, ms)| **ms + LOOK_MS >= now_ms);
        let in_picture: BTreeSet<u16> = of_late.map(|((_, n), _)| *n).collect();
        let count = |n: usize| u64::try_from(n).unwrap_or(0);
        self.watched.dense_ms += step_ms * count(dense.len());
        let pictured = dense.intersection(&in_picture).count();
        self.watched.pictured_ms += step_ms * count(pictured);
        let circles = uavs.iter().any(|m| {
            circle_of(m).is_some_and(is_there) && dense.iter().any(|n| in_picture.contains(n))
        });
        if dense.is_empty() {
            (self.waits_ms, self.circles_now) = (None, false);
            return;
        }
        self.watched.circled_ms += if circles { step_ms } else { 0 };
        let since_ms = *self.waits_ms.get_or_insert(now_ms);
        if circles && !core::mem::replace(&mut self.circles_now, true) {
            self.watched.after_ms.push(now_ms - since_ms);
        }
    }

    /// How long one round takes at most, milliseconds.
    fn round_ms(flyer: Option<&Flyer>) -> u64 {
        let Some(f) = flyer else { return 0 };
        milliseconds(TAU * WIDEST * f.turn_radius_m / f.slowest_mps.max(0.1))
    }

    /// Whether a UAV had something in its picture within a round that it knows to be too dense.
    fn has_pictured(&self, now_ms: u64, m: &PeerSnapshot, round_ms: u64) -> bool {
        let mut dense = dense_of(&m.view.crowd);
        dense.any(|n| {
            let at_ms = self.pictured.get(&(m.id, n));
            at_ms.is_some_and(|ms| ms + round_ms >= now_ms)
        })
    }

    /// Whether there is room for a circle above a sector.
    fn has_room(&self, sector: u16) -> Option<Point> {
        let at = self.watch.as_ref()?.middle(sector)?;
        let away_m = self.zones.as_ref()?.distance_m(at);
        (away_m >= self.room_m).then_some(at)
    }

    fn look_for_nobody(
        &mut self,
        snapshot: &Snapshot<'_>,
        here: &Here<'_>,
        (flyers, flight): (&BTreeMap<u16, Flyer>, &FlightCheck),
        (seen, found): (&mut BTreeSet<u16>, &mut Findings),
    ) {
        let now_ms = snapshot.now_ms;
        let able: Vec<&&PeerSnapshot> = here.peers.iter().filter(|m| can_fly(m)).collect();
        let knows = |m: &PeerSnapshot| dense_of(&m.view.crowd).collect::<BTreeSet<u16>>();
        let mut all = here.peers.iter().map(|m| knows(m));
        let first = all.next().unwrap_or_default();
        let dense = all.fold(first, |a, b| a.intersection(&b).copied().collect());
        let places: Vec<Point> = dense.iter().filter_map(|n| self.has_room(*n)).collect();
        let circles = here.peers.iter().any(|m| {
            let round_ms = Self::round_ms(flyers.get(&m.id));
            circle_of(m).is_some_and(is_there) && self.has_pictured(now_ms, m, round_ms)
        });
        let farthest_ms = |m: &PeerSnapshot| {
            let (at, flyer) = (m.at?, flyers.get(&m.id)?);
            let ways = places.iter();
            ways.map(|p| flight.longest_home_ms(at, *p, *flyer)).max()
        };
        // Who has its section to fly keeps the fuel for that.
        let has_fuel = |m: &&PeerSnapshot| {
            let needs_ms = 2 * farthest_ms(m).unwrap_or(u64::MAX / 4) + STAY_MS;
            u64::from(m.view.spendable_ms) >= u64::from(m.eta_ms) + needs_ms
        };
        let could = able.len() > 1 && able.iter().any(|m| has_fuel(m));
        if !could || places.is_empty() || circles {
            return;
        }
        seen.insert(here.key);
        let began_ms = self.none.start(here.key, now_ms);
        let from_ms = began_ms.max(here.since_ms);
        let way_ms = able
            .iter()
            .filter_map(|m| Some(farthest_ms(m)? + Self::round_ms(flyers.get(&m.id))));
        let way_ms = way_ms.max().unwrap_or(0);
        let bound_ms = FACTOR * WAYS * snapshot.bounds.spread_ms() + SET_OUT_MS + way_ms;
        let limit_ms = snapshot.grown_ms(bound_ms, from_ms);
        let took_ms = now_ms.saturating_sub(from_ms);
        let graded = snapshot.grade() <= Grade::Light;
        if graded && took_ms > limit_ms && self.none.tell_once(here.key) {
            let sectors: Vec<u16> = dense.into_iter().collect();
            found.broken("crowd-circle", now_ms, Some(here.key), || {
                format!("all in its component know that sectors {sectors:?} are too dense, {} could circle there, and nobody does for {took_ms} ms (bound {bound_ms} ms)", able.len())
            });
        }
    }

    fn look_for_idlers(
        &mut self,
        snapshot: &Snapshot<'_>,
        here: &Here<'_>,
        flyers: &BTreeMap<u16, Flyer>,
        (seen, found): (&mut BTreeSet<u16>, &mut Findings),
    ) {
        let now_ms = snapshot.now_ms;
        for m in &here.peers {
            let round_ms = Self::round_ms(flyers.get(&m.id));
            let circles = circle_of(m).is_some_and(is_there);
            if !circles || self.has_pictured(now_ms, m, round_ms) {
                continue;
            }
            seen.insert(m.id);
            let from_ms = self.lingers.start(m.id, now_ms).max(m.since_ms);
            let took_ms = now_ms.saturating_sub(from_ms);
            let bound_ms = 2 * snapshot.bounds.spread_ms() + round_ms;
            let limit_ms = snapshot.grown_ms(bound_ms, from_ms);
            let graded = snapshot.grade() <= Grade::Light;
            if graded && took_ms > limit_ms && self.lingers.tell_once(m.id) {
                found.broken("crowd-linger", now_ms, Some(m.id), || {
                    format!("says that it circles above what is too dense, and has had nothing of that in its picture for {took_ms} ms beyond a round (bound {bound_ms} ms)")
                });
            }
        }
    }

    fn look_for_many(
        &mut self,
        snapshot: &Snapshot<'_>,
        here: &Here<'_>,
        circles_max: u16,
        (seen, found): (&mut BTreeSet<u16>, &mut Findings),
    ) {
        let now_ms = snapshot.now_ms;
        let able = here.peers.iter().filter(|m| can_fly(m)).count();
        let claims = here.peers.iter().filter(|m| {
            let claim = circle_of(m);
            claim.is_some_and(|p| matches!(p, Progress::Committed | Progress::Begun))
        });
        let circles = claims.count();
        let most = usize::from(circles_max).min(able.saturating_sub(1));
        if circles <= most {
            return;
        }
        seen.insert(here.key);
        let from_ms = self.many.start(here.key, now_ms).max(here.since_ms);
        let took_ms = now_ms.saturating_sub(from_ms);
        let bound_ms = FACTOR * WAYS * snapshot.bounds.spread_ms();
        let limit_ms = snapshot.grown_ms(bound_ms, from_ms);
        let graded = snapshot.grade() <= Grade::Light;
        if graded && took_ms > limit_ms && self.many.tell_once(here.key) {
            found.broken("crowd-many", now_ms, Some(here.key), || {
                format!("in its component {circles} UAVs are to circle, of {able} that can fly, for {took_ms} ms; expected {most} at most (bound {bound_ms} ms)")
            });
        }
    }
}

/// The UAVs of a component, none of which is through with the mission, and since when all run.
struct Here<'a> {
    key: u16,
    peers: Vec<&'a PeerSnapshot>,
    since_ms: u64,
}

/// What a peer knows to be too dense.
fn dense_of(crowd: &[(u16, Sector)]) -> impl Iterator<Item = u16> + '_ {
    crowd
        .iter()
        .filter(|(_, s)| s.dense().is_some())
        .map(|(n, _)| *n)
}

/// Whether a UAV patrols, or circles, and could do either.
fn can_fly(m: &PeerSnapshot) -> bool {
    let flies = m.view.able || m.view.relays;
    flies && !m.view.is_fuel_due && m.view.order == Order::Resume
}

/// How far a UAV is with a circle that it is to fly.
fn circle_of(m: &PeerSnapshot) -> Option<Progress> {
    let mut claims = m.view.tasks.iter();
    let is_claim = |p: &Progress| !matches!(p, Progress::Tentative | Progress::Done);
    let claim = claims.find(|(id, _, p)| circled_sector(*id).is_some() && is_claim(p));
    claim.map(|(.., progress)| *progress)
}

/// Whether it says that it is there.
fn is_there(progress: Progress) -> bool {
    matches!(progress, Progress::Begun | Progress::Leaving)
}

#[cfg(test)]
mod tests {
    use super::super::super::testing::{Story, speaking};
    use super::*;
    use skein_geometry::frame::Pose;
    use skein_peer::Beliefs;
    use skein_peer::gathering::Verdict;
    use skein_peer::wire::tasks::{TASKS_MAX, TaskId};
    use skein_peer::{BROUGHT_MAX, MISSION};

    /// The sector about (50, 50) m of four by four.
    const SECTOR: u16 = 10;

    fn mission() -> Mission {
        let mut mission = (*crate::world::fixture::square(1).mission).clone();
        mission.crowd = Some(Arc::new(CrowdWatch {
            then: ThenWatch::Circle,
            ..super::super::tests::watch()
        }));
        mission
    }

    /// What a UAV says: whether the sector is too dense, and how far it is with a circle.
    fn says(is_dense: bool, circle: Option<Progress>) -> Beliefs {
        let dense = is_dense.then_some((1_000, 1));
        let sector = Sector {
            look: None,
            verdict: Some(Verdict {
                at_ms: 1_000,
                dense,
            }),
        };
        let id = TaskId {
            author: MISSION,
            number: TASKS_MAX + u16::try_from(BROUGHT_MAX).unwrap() + SECTOR,
        };
        Beliefs {
            crowd: vec![(SECTOR, sector)],
            tasks: circle.map(|p| (id, 7, p)).into_iter().collect(),
            able: circle.is_none(),
            relays: circle.is_some(),
            ..speaking()
        }
    }

    /// Which rules are broken by what UAVs say for so long, the first of which has something in its
    /// picture.
    fn broken(views: &[Beliefs], pictured: bool, seconds: u64) -> (Vec<&'static str>, Watched) {
        let (mut story, mut found) = (Story::new(0), Findings::new(1));
        let mut check = CircleCheck::default();
        check.on_mission(&mission());
        let flyer = Flyer {
            turn_radius_m: 30.0,
            fastest_mps: 15.0,
            waits_within_m: 150.0,
            slowest_mps: 12.0,
        };
        let flyers: BTreeMap<u16, Flyer> = (1..=3).map(|id| (id, flyer)).collect();
        let flight = FlightCheck::new(flyers.clone(), Vec::new(), 10.0);
        let views: Vec<(u16, Beliefs)> = (1..).zip(views.iter().cloned()).collect();
        for (id, _) in &views {
            story.place(*id, Point::new(100.0, 50.0));
        }
        let picture = Picture::level(Pose::new(Point::new(50.0, 50.0), 0.0), (25.0, 25.0));
        for s in 0..seconds {
            if pictured {
                check.on_look(1_000 * s, 1, &picture, &[SECTOR]);
            }
            story.snapshot(1_000 * s, &views, |snapshot| {
                check.on_snapshot(snapshot, (&flyers, &flight), &mut found);
            });
        }
        (found.counts.keys().copied().collect(), check.watched())
    }

    #[test]
    fn what_is_too_dense_has_somebody_above_where_two_can_fly() {
        let patrols = || says(true, None);
        let circles = || says(true, Some(Progress::Begun));
        let (rules, _) = broken(&[patrols(), patrols()], false, 400);
        assert_eq!(rules, ["crowd-circle"]);
        // It has time to fly there.
        assert!(broken(&[patrols(), patrols()], false, 100).0.is_empty());
        let few = |mut view: Beliefs| {
            view.spendable_ms = 100_000;
            view
        };
        let dry = [few(patrols()), few(patrols())];
        assert!(broken(&dry, false, 400).0.is_empty());
        // Alone it patrols; where it has eased, nobody is wanted; who does not know asks nobody.
        assert!(broken(&[patrols()], false, 400).0.is_empty());
        assert!(
            broken(&[patrols(), says(false, None)], false, 400)
                .0
                .is_empty()
        );
        let (rules, watched) = broken(&[circles(), patrols()], true, 400);
        assert!(rules.is_empty(), "{rules:?}");
        assert_eq!((watched.after_ms, watched.pictured_ms), (vec![0], 399_000));
        // Under way it is nowhere yet.
        let under_way = says(true, Some(Progress::Committed));
        assert_eq!(
            broken(&[under_way, patrols()], true, 400).0,
            ["crowd-circle"]
        );
    }

    #[test]
    fn who_circles_has_it_in_its_picture_and_leaves_once_it_has_eased() {
        let circles = |is_dense| says(is_dense, Some(Progress::Begun));
        let patrols = |is_dense| says(is_dense, None);
        let (rules, _) = broken(&[circles(true), patrols(true)], false, 400);
        assert_eq!(rules, ["crowd-circle", "crowd-linger"]);
        let (rules, _) = broken(&[circles(false), patrols(false)], true, 400);
        assert_eq!(rules, ["crowd-linger"]);
        assert!(
            broken(&[circles(false), patrols(false)], true, 30)
                .0
                .is_empty()
        );
    }

    #[test]
    fn no_more_circle_than_the_mission_says_and_one_patrols() {
        let circles = || says(true, Some(Progress::Begun));
        let (rules, _) = broken(&[circles(), circles(), says(true, None)], true, 400);
        assert!(rules.contains(&"crowd-many"), "{rules:?}");
        assert_eq!(broken(&[circles()], true, 400).0, ["crowd-many"]);
        assert!(broken(&[circles()], true, 20).0.is_empty());
    }
}
