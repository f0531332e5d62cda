//! What is counted at the sites of a mission beside what truly passes and stands there (`count`,
//! `count-sight`, `count-idle`, `occupancy`; D2.7 §3.1): by where vehicles and UAVs are. Of a UAV
//! two things alone are believed: at which sites it says that it counts, and what it counted.
//!
//! | what | beside |
//! |---|---|
//! | that it counts at a site | whether all of that is in its picture |
//! | vehicles that it saw drive in | those that did, while it counted |
//! | vehicles that it saw stand | those that did, when it looked last |
//! | for how long all together counted | for how long the site was well in the picture of one who could, no building that the mission tells before it |

use super::Findings;
use crate::account::secs;
use crate::world::camera::Picture;
use serde::{Deserialize, Serialize};
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_peer::Mission;
use skein_peer::count_site::{CountSite, Counted};
use skein_peer::counting::SiteCount;
use skein_peer::wire::count::Count;
use std::collections::{BTreeMap, BTreeSet};

/// A vehicle has left a site when it is so far outside, metres.
const LEFT_M: f64 = 3.0;

/// Slower than this a vehicle stands, m/s; and slower than this it may be taken for one that does:
/// nobody tells more exactly by a second of looks.
const STANDS_MPS: f64 = 0.5;
const MAY_STAND_MPS: f64 = 3.0;

/// A count is off by no more than this, this share of what passed, the root of how many were near
/// the outline when it was begun or ended, and how many are now; this times the root of how often it
/// was begun at least. A UAV's place is off by two metres, a standard deviation each way, and so is
/// all that it sees for minutes: who drives over the outline just then is on the wrong side of a
/// beginning or an end. Such errors even out over many UAVs, but not where one that is farther off
/// looks again and again at a place where vehicles wait: it may be off by all who were as near.
const OFF: f64 = 2.0;
const OFF_SHARE: f64 = 0.1;
const OFF_BEGUN: f64 = 1.2;

/// Near an outline is who is no farther from it, metres.
const NEAR_M: f64 = 6.0;

/// A UAV is farther off than it takes itself to be in one case of ninety, metres: three standard
/// deviations. Whoever stands near the outline may be on the other side of it for such a one.
const DISPLACED_M: f64 = 6.0;

/// Who stands is off by no more than this, and this share of who stands.
const OCCUPANCY_OFF: f64 = 1.5;
const OCCUPANCY_OFF_SHARE: f64 = 0.1;

/// The space-mean speed is off by no more than this, m/s, and this share, where vehicles were
/// there for so long together, milliseconds.
const SPEED_OFF_MPS: f64 = 0.8;
const SPEED_OFF_SHARE: f64 = 0.1;
const SPEED_FROM_MS: u64 = 20_000;

/// Speeds are measured over so long, milliseconds.
const PACE_MS: u64 = 500;

/// Well in the picture is what is in so much of half of it, each way.
const WELL: f64 = 0.8;

/// For so much of the time that a site is well in a picture somebody counts at least, less some.
const WATCHED_SHARE: f64 = 0.7;
const WATCHED_LESS_MS: u64 = 5_000;

/// Looks that are farther apart are none of one watch, milliseconds.
const GAP_MS: u64 = 1_000;

/// What is counted at one site, and what truly is there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CountReport {
    /// Its name.
    pub name: String,
    /// Whether it is who stands there that counts.
    pub is_lot: bool,
    /// How many there is room for; 0 where that is not said.
    pub capacity: u16,
    /// What the ground station, or where there is none who knows most, knew last.
    pub known: SiteCount,
    /// What all UAVs counted in all their lives, told or not: vehicles, and for how long, ms.
    pub counted: (u32, u64),
    /// Vehicles that truly drove in while a UAV counted.
    pub passed_in_pictures: u32,
    /// Their true space-mean speed, m/s.
    pub speed_in_pictures_mps: Option<f64>,
    /// Vehicles that truly drove in all the time, and for how long that was, ms.
    pub passed: (u32, u64),
    /// Their true space-mean speed, m/s.
    pub speed_mps: Option<f64>,
    /// For how long it was well in a picture of somebody who could count, ms.
    pub pictured_ms: u64,
    /// Who truly stood there when the look that is known last was taken.
    pub stood_then: Option<u16>,
    /// Who truly stands there now.
    pub stands: u16,
}

impl CountReport {
    /// The true volume of all the time, vehicles an hour.
    #[must_use]
    pub fn true_volume_per_h(&self) -> f64 {
        f64::from(self.passed.0) * 3_600.0 / secs(self.passed.1.max(1))
    }

    /// Whether the true volume is in the range that is told with the estimate; none where nobody
    /// watched.
    #[must_use]
    pub fn holds(&self) -> Option<bool> {
        let (low, high) = self.known.volume_range_per_h()?;
        Some((low..=high).contains(&self.true_volume_per_h()))
    }

    /// Estimate beside truth, for a person.
    #[must_use]
    pub fn line(&self) -> String {
        let site = CountSite {
            name: self.name.clone(),
            what: if self.is_lot {
                Counted::Standing
            } else {
                Counted::Passing
            },
            ring: Vec::new(),
            capacity: self.capacity,
        };
        let told = self.known.sentence(&site);
        if self.is_lot {
            let then = self
                .stood_then
                .map_or_else(String::new, |n| format!("; truly {n} then"));
            return format!("{told}{then}, {} at the end", self.stands);
        }
        let speed = |mps: Option<f64>| mps.map_or_else(String::new, |v| format!(", {v:.1} m/s"));
        format!(
            "{told}; truly {} while it was counted{}, and {:.0} an hour all the time{}",
            self.passed_in_pictures,
            speed(self.speed_in_pictures_mps),
            self.true_volume_per_h(),
            speed(self.speed_mps)
        )
    }
}

/// What truly drove at one site.
#[derive(Clone, Copy, Debug, Default)]
struct Driven {
    passed: u32,
    spent_ms: u64,
    driven_m: f64,
}

impl Driven {
    fn speed_mps(&self) -> Option<f64> {
        (self.spent_ms > 0).then(|| self.driven_m / secs(self.spent_ms))
    }

    /// What all vehicles did at one site since the last look.
    fn take(&mut self, steps: &[Step], site: usize, apart_ms: u64) {
        let bit = 1_u32 << site;
        for step in steps {
            self.passed += u32::from(step.entered & bit > 0);
            if step.stayed & bit > 0 {
                self.spent_ms += apart_ms;
                self.driven_m += step.moved_m;
            }
        }
    }

    fn add(&mut self, more: &Self) {
        self.passed += more.passed;
        self.spent_ms += more.spent_ms;
        self.driven_m += more.driven_m;
    }
}

/// A site with its outline.
#[derive(Clone, Debug)]
struct Site {
    site: CountSite,
    outline: Polygon,
    middle: Point,
    radius_m: f64,
}

impl Site {
    fn contains(&self, p: Point) -> bool {
        (p - self.middle).norm() <= self.radius_m && self.outline.contains(p)
    }

    /// Who stands there, as a UAV may see it that takes itself to be so far off, metres: who is
    /// that near to the outline may be on the other side of it for one that is off by more than
    /// usual.
    fn stood(&self, places: &[Point], speeds: &[f64], displaced_m: f64) -> Stood {
        let off_m = if displaced_m > DISPLACED_M {
            displaced_m
        } else {
            0.0
        };
        let mut stood = Stood::default();
        for (at, mps) in places.iter().zip(speeds) {
            let may_be = (*at - self.middle).norm() <= self.radius_m + off_m;
            if *mps >= MAY_STAND_MPS || !may_be {
                continue;
            }
            let (is_in, stands) = (self.contains(*at), *mps < STANDS_MPS);
            let is_near = off_m > 0.0 && self.outline.outline_distance_m(*at) <= off_m;
            for (count, counts) in [
                (&mut stood.there, is_in && stands),
                (&mut stood.least, is_in && stands && !is_near),
                (&mut stood.most, is_in || is_near),
            ] {
                *count = count.saturating_add(u16::from(counts));
            }
        }
        stood
    }
}

/// Vehicles beside the sites, from one look to the next.
#[derive(Clone, Debug, Default)]
struct Beside {
    now_ms: u64,
    places: Vec<Point>,
    /// Of each vehicle, in which sites it is; a bit each.
    inside: Vec<u32>,
}

/// How one vehicle moved at the sites since the last look.
struct Step {
    entered: u32,
    stayed: u32,
    moved_m: f64,
}

impl Beside {
    fn step(&mut self, now_ms: u64, truth: &[Point], sites: &[Site]) -> (u64, Vec<Step>) {
        let apart_ms = now_ms.saturating_sub(self.now_ms);
        let is_first = self.places.len() != truth.len();
        if is_first {
            self.inside = vec![0; truth.len()];
            self.places = truth.to_vec();
        }
        let mut steps = Vec::with_capacity(truth.len());
        for (at, (before, inside)) in truth
            .iter()
            .zip(self.places.iter_mut().zip(&mut self.inside))
        {
            let (mut now_in, was_in) = (*inside, *inside);
            for (i, site) in sites.iter().enumerate() {
                let bit = 1_u32 << i;
                if site.contains(*at) {
                    now_in |= bit;
                } else if site.outline.outline_distance_m(*at) > LEFT_M {
                    now_in &= !bit;
                }
            }
            let within = |p: Point| {
                let all = sites.iter().enumerate();
                all.fold(0, |set, (i, s)| set | u32::from(s.contains(p)) << i)
            };
            let moved_m = (*at - *before).norm();
            let (entered, stayed) = if is_first || now_in | was_in == 0 {
                (0, 0)
            } else {
                (now_in & !was_in, within(*at) & within(*before))
            };
            (*inside, *before) = (now_in, *at);
            steps.push(Step {
                entered,
                stayed,
                moved_m,
            });
        }
        self.now_ms = now_ms;
        (apart_ms, steps)
    }
}

/// Where a count may be off.
#[derive(Clone, Copy, Debug, Default)]
struct Edges {
    /// How often it was begun.
    begun: u32,
    /// How many were near the outline when it was begun or ended, and at the last look.
    near: u32,
    near_now: u32,
    /// How many of them were as near as the UAV was off, or nearer.
    within: u32,
    within_now: u32,
}

impl Edges {
    fn add(&mut self, more: &Self) {
        self.begun += more.begun;
        self.near += more.near;
        self.near_now += more.near_now;
        self.within += more.within;
        self.within_now += more.within_now;
    }

    /// By how much it may be off.
    fn slack(&self) -> f64 {
        let near = f64::from(self.near + self.near_now).sqrt();
        let within = f64::from(self.within + self.within_now);
        near.max(within)
            .max(OFF_BEGUN * f64::from(self.begun).sqrt())
    }
}

/// One UAV at one site, in one life.
#[derive(Clone, Debug, Default)]
struct Watch {
    counts: bool,
    own: Count,
    truth: Driven,
    edges: Edges,
    told: bool,
}

/// One UAV.
#[derive(Clone, Debug, Default)]
struct Watcher {
    beside: Beside,
    watches: Vec<Watch>,
}

/// One look of a UAV.
#[derive(Clone, Copy)]
pub struct CountLook<'a> {
    /// Whose.
    pub uav: u16,
    /// What it sees.
    pub picture: Picture,
    /// Whether its computer is late: what it says is of where it was.
    pub is_late: bool,
    /// Whether nothing stands between its camera and a place.
    pub sees: &'a dyn Fn(Point) -> bool,
    /// How far off it takes itself to be, metres.
    pub displaced_m: f64,
    /// Site by site whether it says that it counts, and what it counted.
    pub counted: &'a [(bool, Count)],
}

/// Who stood at a site when one looked at it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Stood {
    there: u16,
    /// Who was there for whoever looked, at least and at most.
    least: u16,
    most: u16,
}

/// The counts of one run.
#[derive(Clone, Debug, Default)]
pub struct CountCheck {
    of: u32,
    sites: Vec<Site>,
    /// Whether the mission tells what hides sites.
    has_buildings: bool,
    begun_ms: Option<u64>,
    all: Beside,
    driven: Vec<Driven>,
    /// When each site was well in somebody's picture last, and for how long it was.
    pictured: Vec<(u64, u64)>,
    watchers: BTreeMap<u16, Watcher>,
    /// What was counted in lives that are over, and what truly drove meanwhile.
    former: Vec<(u32, u64, Driven)>,
    /// Who stood at a site when one looked at it.
    stood: BTreeMap<(usize, u16, u64), Stood>,
    /// How fast each vehicle is, m/s, and from when and where on that is measured.
    speeds: Vec<f64>,
    paced: (u64, Vec<Point>),
    /// Who flies the newest mission.
    able: BTreeSet<u16>,
    idle_told: bool,
}

impl CountCheck {
    /// The operator has a mission.
    pub fn on_mission(&mut self, mission: &Mission) {
        let of = mission.sites_hash();
        self.has_buildings = mission.buildings.is_some();
        if mission.counts.is_empty() || (of == self.of && !self.sites.is_empty()) {
            if mission.counts.is_empty() {
                *self = Self::default();
            }
            return;
        }
        let site = |s: &CountSite| {
            Some(Site {
                outline: s.outline()?,
                middle: s.middle(),
                radius_m: s.radius_m(),
                site: s.clone(),
            })
        };
        let sites: Vec<Site> = mission.counts.iter().filter_map(site).collect();
        *self = Self {
            of,
            driven: vec![Driven::default(); sites.len()],
            pictured: vec![(0, 0); sites.len()],
            former: vec![(0, 0, Driven::default()); sites.len()],
            sites,
            has_buildings: self.has_buildings,
            ..Self::default()
        };
    }

    /// Whether nothing is counted.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.sites.is_empty()
    }

    /// Who flies the newest mission and is not through with it.
    pub fn on_able(&mut self, able: BTreeSet<u16>) {
        self.able = able;
    }

    /// One look of a UAV, beside where vehicles are.
    pub fn on_look(
        &mut self,
        now_ms: u64,
        truth: &[Point],
        look: CountLook<'_>,
        found: &mut Findings,
    ) {
        self.note_all(now_ms, truth);
        self.note_picture(now_ms, look);
        let n = self.sites.len();
        let watcher = self.watchers.entry(look.uav).or_default();
        watcher.watches.resize_with(n, Watch::default);
        let (apart_ms, steps) = watcher.beside.step(now_ms, truth, &self.sites);
        if look.counted.len() != n {
            return;
        }
        for (i, site) in self.sites.iter().enumerate() {
            let (counts, own) = look.counted[i];
            let watch = &mut watcher.watches[i];
            // A later life, or another sortie, counts from nothing.
            if own.watched_ms < watch.own.watched_ms || own.sites != watch.own.sites {
                let over = core::mem::take(watch);
                let former = &mut self.former[i];
                former.0 += over.own.passed;
                former.1 += over.own.watched_ms;
                former.2.add(&over.truth);
            }
            if watch.counts && counts && apart_ms <= GAP_MS {
                watch.truth.take(&steps, i, apart_ms);
            }
            if own.seen_ms > watch.own.seen_ms {
                let stood = site.stood(truth, &self.speeds, look.displaced_m);
                self.stood.insert((i, look.uav, own.seen_ms), stood);
            }
            let was = watch.counts;
            let (near, within) = if counts || was {
                site.near(truth, look.displaced_m)
            } else {
                (0, 0)
            };
            let edges = &mut watch.edges;
            if counts == was {
                (edges.near_now, edges.within_now) = (near, within);
            } else {
                edges.near += near;
                edges.within += within;
                (edges.near_now, edges.within_now) = (0, 0);
                edges.begun += u32::from(counts);
            }
            (watch.counts, watch.own) = (counts, own);
            let at = (now_ms, look.uav);
            if counts
                && !look.is_late
                && !site.is_pictured(look, 1.0)
                && !core::mem::replace(&mut watch.told, true)
            {
                found.broken("count-sight", at.0, Some(at.1), || {
                    format!(
                        "says that it counts at {}, and not all of that is in its picture",
                        site.site.name
                    )
                });
            }
            check_count(site, watch, at, found);
            if was && !counts {
                let stood = self.stood.get(&(i, look.uav, own.seen_ms));
                check_occupancy(site, watch, stood, at, found);
            }
        }
    }

    /// What all vehicles do, whoever looks.
    fn note_all(&mut self, now_ms: u64, truth: &[Point]) {
        self.begun_ms.get_or_insert(now_ms);
        if now_ms == self.all.now_ms && !self.all.places.is_empty() {
            return;
        }
        let (apart_ms, steps) = self.all.step(now_ms, truth, &self.sites);
        self.pace(now_ms, truth);
        for (i, driven) in self.driven.iter_mut().enumerate() {
            driven.take(&steps, i, apart_ms);
        }
    }

    /// How fast vehicles are, over half a second: the world moves them in steps.
    fn pace(&mut self, now_ms: u64, truth: &[Point]) {
        let (since_ms, places) = &mut self.paced;
        let apart_ms = now_ms.saturating_sub(*since_ms);
        if apart_ms < PACE_MS && places.len() == truth.len() {
            return;
        }
        self.speeds.resize(truth.len(), 0.0);
        for ((at, before), mps) in truth.iter().zip(places.iter()).zip(&mut self.speeds) {
            *mps = (*at - *before).norm() / secs(apart_ms.max(1));
        }
        (*since_ms, *places) = (now_ms, truth.to_vec());
    }

    /// For how long sites are well in the picture of somebody who could count.
    fn note_picture(&mut self, now_ms: u64, look: CountLook<'_>) {
        if !self.able.contains(&look.uav) || look.counted.len() != self.sites.len() {
            return;
        }
        let has_buildings = self.has_buildings;
        for (site, (last_ms, for_ms)) in self.sites.iter().zip(&mut self.pictured) {
            let is_open = || site.outline.vertices().iter().all(|p| (look.sees)(*p));
            if site.is_pictured(look, WELL) && (!has_buildings || is_open()) {
                let apart_ms = now_ms.saturating_sub(*last_ms);
                *for_ms += if apart_ms <= 250 { apart_ms } else { 0 };
                *last_ms = now_ms;
            }
        }
    }

    /// The run is over.
    pub fn on_end(&mut self, now_ms: u64, found: &mut Findings) {
        for (i, site) in self.sites.iter().enumerate() {
            let (counted, _) = self.of_all(i);
            let (_, pictured_ms) = self.pictured[i];
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                clippy::cast_precision_loss,
                reason = "runs last less than 2^52 ms"
            )]
            let least_ms = (WATCHED_SHARE * pictured_ms as f64) as u64;
            if site.site.what == Counted::Passing
                && counted.1 + WATCHED_LESS_MS < least_ms
                && !core::mem::replace(&mut self.idle_told, true)
            {
                found.broken("count-idle", now_ms, None, || {
                    format!(
                        "{} was well in pictures for {pictured_ms} ms, and counted at for {} ms",
                        site.site.name, counted.1
                    )
                });
            }
        }
        self.check_speeds(now_ms, found);
        self.check_sums(now_ms, found);
    }

    /// What one UAV counted at all sites that vehicles pass: errors of edges even out, others do
    /// not.
    fn check_sums(&self, now_ms: u64, found: &mut Findings) {
        for (uav, watcher) in &self.watchers {
            let all = self.sites.iter().zip(&watcher.watches);
            let passed = all.filter(|(site, _)| site.site.what == Counted::Passing);
            let all: Vec<&Watch> = passed.map(|(_, watch)| watch).collect();
            let says = all.iter().map(|w| w.own.passed).sum();
            let is = all.iter().map(|w| w.truth.passed).sum();
            let mut edges = Edges::default();
            all.iter().for_each(|w| edges.add(&w.edges));
            if is_off(says, is, &edges) {
                found.broken("count", now_ms, Some(*uav), || {
                    format!("counted {says} vehicles at all sites, and {is} drove in meanwhile")
                });
            }
        }
    }

    fn check_speeds(&self, now_ms: u64, found: &mut Findings) {
        for (uav, watcher) in &self.watchers {
            for (site, watch) in self.sites.iter().zip(&watcher.watches) {
                let mut told = SiteCount::default();
                told.add(*uav, &watch.own);
                let (Some(says), Some(is)) = (told.speed_mps(), watch.truth.speed_mps()) else {
                    continue;
                };
                let off_mps = (says - is).abs();
                if watch.truth.spent_ms >= SPEED_FROM_MS
                    && off_mps > SPEED_OFF_MPS + SPEED_OFF_SHARE * is
                {
                    found.broken("count", now_ms, Some(*uav), || {
                        format!(
                            "told {says:.2} m/s for the mean speed at {}, and it was {is:.2} m/s",
                            site.site.name
                        )
                    });
                }
            }
        }
    }

    /// What all counted at one site in all their lives, and what truly drove there meanwhile.
    fn of_all(&self, i: usize) -> ((u32, u64), Driven) {
        let (mut passed, mut watched_ms, mut truth) = self.former[i];
        for watch in self.watchers.values().filter_map(|w| w.watches.get(i)) {
            passed += watch.own.passed;
            watched_ms += watch.own.watched_ms;
            truth.add(&watch.truth);
        }
        ((passed, watched_ms), truth)
    }

    /// Estimates beside truth; `known` is what the ground station knows.
    #[must_use]
    pub fn reports(&self, now_ms: u64, known: &[SiteCount]) -> Vec<CountReport> {
        let over_ms = self.begun_ms.map_or(0, |ms| now_ms.saturating_sub(ms));
        let one = |(i, s): (usize, &Site)| {
            let known = known.get(i).copied().unwrap_or_default();
            let (counted, truth) = self.of_all(i);
            let seen = known.standing;
            CountReport {
                name: s.site.name.clone(),
                is_lot: s.site.what == Counted::Standing,
                capacity: s.site.capacity,
                known,
                counted,
                passed_in_pictures: truth.passed,
                speed_in_pictures_mps: truth.speed_mps(),
                passed: (self.driven[i].passed, over_ms),
                speed_mps: self.driven[i].speed_mps(),
                pictured_ms: self.pictured[i].1,
                stood_then: seen
                    .and_then(|s| self.stood.get(&(i, s.by, s.seen_ms)))
                    .map(|stood| stood.there),
                stands: s.stood(&self.all.places, &self.speeds, 0.0).there,
            }
        };
        self.sites.iter().enumerate().map(one).collect()
    }
}

impl Site {
    /// How many vehicles are near its outline, and how many of them no farther from it than a UAV
    /// is off, metres.
    fn near(&self, truth: &[Point], off_m: f64) -> (u32, u32) {
        let (mut near, mut within) = (0, 0);
        for at in truth {
            if (*at - self.middle).norm() > self.radius_m + NEAR_M {
                continue;
            }
            let apart_m = self.outline.outline_distance_m(*at);
            near += u32::from(apart_m <= NEAR_M);
            within += u32::from(off_m > 0.0 && apart_m <= off_m.min(NEAR_M));
        }
        (near, within)
    }

    /// Whether all of it is in so much of a picture, each way.
    fn is_pictured(&self, look: CountLook<'_>, share: f64) -> bool {
        let mut corners = self.outline.vertices().iter();
        corners.all(|p| look.picture.shows(*p, share))
    }
}

/// Whether a count is farther from the truth than it may be.
fn is_off(says: u32, is: u32, edges: &Edges) -> bool {
    let bound = OFF + OFF_SHARE * f64::from(is) + edges.slack();
    f64::from(says.abs_diff(is)) > bound
}

fn check_count(site: &Site, watch: &mut Watch, at: (u64, u16), found: &mut Findings) {
    let (says, is) = (watch.own.passed, watch.truth.passed);
    let off = is_off(says, is, &watch.edges);
    if off && site.site.what == Counted::Passing && !core::mem::replace(&mut watch.told, true) {
        found.broken("count", at.0, Some(at.1), || {
            format!(
                "counted {says} vehicles at {}, and {is} drove in meanwhile",
                site.site.name
            )
        });
    }
}

fn check_occupancy(
    site: &Site,
    watch: &mut Watch,
    stood: Option<&Stood>,
    at: (u64, u16),
    found: &mut Findings,
) {
    let Some(stood) = stood else {
        return;
    };
    let [is, least, most] = [stood.there, stood.least, stood.most].map(f64::from);
    let says = f64::from(watch.own.standing);
    let slack = OCCUPANCY_OFF + OCCUPANCY_OFF_SHARE * is;
    let off = says < least - slack || says > most + slack;
    if off && site.site.what == Counted::Standing && !core::mem::replace(&mut watch.told, true) {
        found.broken("occupancy", at.0, Some(at.1), || {
            format!(
                "says that {says} vehicles stand at {}, and {is} do",
                site.site.name
            )
        });
    }
}

#[cfg(test)]
mod tests;
