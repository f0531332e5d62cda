//! Obstacles that no map shows, as UAVs sense them and tell each other (D2.7 §1.2.3): whoever knows
//! of one has a no-fly zone more, and so everybody flies round what one of them has seen.
//!
//! | event | what follows |
//! |---|---|
//! | the UAV senses an obstacle that no zone of the mission holds | known, two metres wider than it is sensed; said at once |
//! | an obstacle of another | known |
//! | something is known that no zone of the mission holds | the mission gets a zone round it and counts one revision more: the same mission, whoever derives it |
//! | nobody who is believed alive says something that is known | whoever knows it says it after two intervals, and after one more for each with a lower number |
//! | an operator takes such a zone out, and a UAV still senses what stands there | known anew, as found once more |
//! | more is sensed than can be known | the envelope keeps clear of it alone |
//!
//! # Guarantees
//! Merges in any order: what is known is a union, of [`FOUND_MAX`] the first in their order.
//! Who knows the same and holds the same mission of the operator's derives the same mission.

use crate::cooperation::Situation;
use crate::effect::Effect;
use crate::input::Time;
use crate::mission::{Mission, PointMm};
use crate::mission_edit::is_found;
use crate::output::Status;
use crate::revision::FOUND_SHIFT;
use crate::wire::codec::Body;
use crate::wire::obstacle::{AGAIN_MAX, FOUND_MAX, Found, FoundObstacles};
use skein_behaviors::obstacle::{Obstacle, Obstacles};
use skein_geometry::Polygon;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{PI, sin_cos};
use std::collections::{BTreeMap, BTreeSet};

/// What is sensed is kept clear of as if it were so much wider, decimetres: the next UAV senses it
/// a little elsewhere.
pub const MARGIN_DM: u16 = 20;

/// Sides of the zone round an obstacle.
const SIDES: u32 = 8;

/// Zones round found obstacles are named so, and no other is.
pub const FOUND_PREFIX: &str = "found_";

/// Whose word is remembered, at most.
const AUTHORS_MAX: usize = 256;

/// So many intervals it waits before it says what nobody who lives says, and at most so many more.
const WAIT_INTERVALS: u64 = 2;
const RANKS_MAX: u64 = 8;

impl Found {
    /// An obstacle as it is told, [`MARGIN_DM`] wider than it is sensed, found for the first time.
    #[must_use]
    pub fn of(sensed: &Obstacle) -> Self {
        Self {
            again: 0,
            east_dm: sensed.east_dm,
            north_dm: sensed.north_dm,
            radius_dm: sensed.radius_dm.saturating_add(MARGIN_DM),
        }
    }
}

/// The name of the zone round one.
#[must_use]
pub fn zone_name(f: &Found) -> String {
    let (east, north, radius, again) = (f.east_dm, f.north_dm, f.radius_dm, f.again);
    format!("{FOUND_PREFIX}{east}_{north}_{radius}_{again}")
}

/// The zone round one: what touches it from outside.
#[must_use]
#[allow(clippy::cast_possible_truncation, reason = "some kilometres")]
pub fn zone_round(f: &Found) -> Vec<PointMm> {
    let half = PI / f64::from(SIDES);
    let out_mm = (f64::from(f.radius_dm) * 100.0 / sin_cos(half).1).ceil();
    let corner = |k: u32| {
        let (s, c) = sin_cos(half * f64::from(2 * k + 1));
        let mm = |dm: i32, share: f64| dm.saturating_mul(100) + (out_mm * share).round() as i32;
        (mm(f.east_dm, c), mm(f.north_dm, s))
    };
    (0..SIDES).map(corner).collect()
}

/// What it does with them, for a person.
#[must_use]
pub fn sentence(mission: &Mission) -> String {
    let n = mission.zones_round_found();
    let revision = mission.revision;
    format!("flies round {n} obstacles that are on no map, revision {revision}")
}

/// What one peer knows of obstacles that are on no map.
#[derive(Debug, Default)]
pub(crate) struct KnownObstacles {
    known: BTreeSet<Found>,
    /// What others say.
    told: BTreeMap<u16, BTreeSet<Found>>,
    /// What it says itself in this life.
    said: BTreeSet<Found>,
    /// What it sensed itself.
    sensed: BTreeSet<Found>,
    untold_since: Option<Time>,
    /// Sensed, and kept clear of without a zone of the mission.
    heeded: Vec<Obstacle>,
    /// What was sensed at the last look, and in which revision: nothing new comes of it again.
    looked: Option<(Obstacles, u32)>,
}

impl KnownObstacles {
    /// A life begins, or this peer falls silent: nothing is said in it yet.
    pub fn begin_life(&mut self) {
        self.said.clear();
        self.untold_since = None;
    }

    /// What is known.
    pub fn known(&self) -> &BTreeSet<Found> {
        &self.known
    }

    /// Whether the same was sensed at the last look, on the same mission.
    pub fn is_as_before(&mut self, sensed: &Obstacles, mission: &Mission) -> bool {
        let look = Some((*sensed, mission.revision));
        core::mem::replace(&mut self.looked, look) == look
    }

    /// The UAV senses these while this mission is the newest; whether one of them is news.
    pub fn sense(&mut self, sensed: &Obstacles, mission: &Mission) -> bool {
        let mut is_news = false;
        for obstacle in sensed.sensed() {
            let holds = |f: &&Found| is_within(obstacle, &f.obstacle());
            let alike: Vec<Found> = self.known.iter().filter(holds).copied().collect();
            if alike.iter().any(|f| !mission.is_dismissed(f)) || mission.holds(obstacle) {
                continue;
            }
            let found = Found {
                again: alike.iter().map(|f| f.again + 1).max().unwrap_or(0),
                ..Found::of(obstacle)
            };
            if found.again <= AGAIN_MAX && found.is_valid() && self.know(found) {
                self.sensed.insert(found);
                is_news = true;
            }
        }
        is_news
    }

    fn know(&mut self, found: Found) -> bool {
        let is_news = self.known.insert(found);
        if self.known.len() > FOUND_MAX {
            return self.known.pop_last() != Some(found);
        }
        is_news
    }

    /// Another says these; whether one of them is news.
    pub fn hear(&mut self, author: u16, told: &FoundObstacles) -> bool {
        if self.told.len() < AUTHORS_MAX || self.told.contains_key(&author) {
            let all = told.found.iter().copied().collect();
            self.told.insert(author, all);
        }
        let news = told.found.iter().map(|f| self.know(*f));
        news.fold(false, |any, one| any | one)
    }

    /// Those of them that are sensed and that no zone of this mission holds, where they are not the
    /// same as at the last look: the envelope is to keep clear of all these.
    pub fn unmapped(&mut self, sensed: &Obstacles, mission: &Mission) -> Option<Vec<Obstacle>> {
        let outside = sensed.sensed().filter(|o| !mission.holds(o)).copied();
        let mut outside: Vec<Obstacle> = outside.collect();
        outside.sort_unstable();
        let is_other = outside != self.heeded;
        if is_other {
            self.heeded.clone_from(&outside);
        }
        is_other.then_some(outside)
    }

    /// Another executive flies, which keeps clear of the zones of its mission alone.
    pub fn heed_anew(&mut self) {
        self.heeded.clear();
        self.looked = None;
    }

    /// Says what nobody else does.
    pub fn tick(&mut self, s: &Situation<'_>) -> Option<Effect> {
        if self.known.is_empty() || !s.speaks {
            return None;
        }
        let is_down = |id: u16| {
            let status = s.membership.status(id);
            status.is_some_and(|(_, status)| status == Status::Down)
        };
        let others = self.told.iter().filter(|(id, _)| !is_down(**id));
        let others: Vec<&BTreeSet<Found>> = others.map(|(_, told)| told).collect();
        let is_told =
            |f: &&Found| self.said.contains(*f) || others.iter().any(|told| told.contains(*f));
        let untold: Vec<&Found> = self.known.iter().filter(|f| !is_told(f)).collect();
        if untold.is_empty() {
            self.untold_since = None;
            return None;
        }
        let since = *self.untold_since.get_or_insert(s.now);
        let is_own = untold.iter().any(|f| self.sensed.contains(*f));
        let before = s.membership.live().filter(|(id, _)| *id < s.me.id).count();
        let rank = u64::try_from(before).unwrap_or(RANKS_MAX).min(RANKS_MAX);
        let waits_ms = (WAIT_INTERVALS + rank) * s.membership.interval_ms();
        if !is_own && s.now.since_ms(since) < waits_ms {
            return None;
        }
        self.untold_since = None;
        self.said.clone_from(&self.known);
        let found = self.known.iter().copied().collect();
        Some(Effect::Speak(0, Body::Obstacles(FoundObstacles { found })))
    }
}

/// Whether the one is all within the other.
fn is_within(inner: &Obstacle, outer: &Obstacle) -> bool {
    (inner.at() - outer.at()).norm() + inner.radius_m() <= outer.radius_m()
}

impl Mission {
    /// How many of its zones stand round what was found.
    #[must_use]
    pub fn zones_round_found(&self) -> usize {
        let names = self.added_zones.keys();
        names.filter(|name| is_found(name)).count()
    }

    /// Whether an operator took out the zone round it.
    #[must_use]
    pub fn is_dismissed(&self, f: &Found) -> bool {
        self.dismissed.contains(&zone_name(f))
    }

    /// Whether one of its zones holds all of an obstacle.
    #[must_use]
    pub fn holds(&self, obstacle: &Obstacle) -> bool {
        let radius_m = obstacle.radius_m();
        let rim = |k: u32| {
            let (s, c) = sin_cos(2.0 * PI * f64::from(k) / f64::from(SIDES));
            obstacle.at() + Vector::new(c, s) * radius_m
        };
        let mut rings = self.zones_m();
        rings.any(|ring| {
            let zone = Polygon::new(ring);
            let is_inside = |zone: &Polygon, at: Point| zone.distance_m(at) <= 0.0;
            zone.is_ok_and(|zone| (0..SIDES).all(|k| is_inside(&zone, rim(k))))
        })
    }

    /// The same with a zone round each of these that has none, and so many revisions later; none
    /// where all have one, or where the mission does not count what is found.
    #[must_use]
    pub fn with_found(&self, found: &BTreeSet<Found>) -> Option<Self> {
        let room = self.room_for_found()?;
        let named = found.iter().map(|f| (zone_name(f), f));
        let is_there =
            |name: &String| self.added_zones.contains_key(name) || self.dismissed.contains(name);
        let new: Vec<(String, &Found)> = named.filter(|(name, _)| !is_there(name)).collect();
        let count = u32::try_from(new.len()).unwrap_or(u32::MAX);
        if count == 0 || count > room {
            return None;
        }
        let mut changed = self.clone();
        changed.revision += count << FOUND_SHIFT;
        let zones = new.into_iter().map(|(name, f)| (name, zone_round(f)));
        changed.added_zones.extend(zones);
        Some(changed)
    }
}
