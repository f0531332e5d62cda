//! Counts of vehicles at the sites of a mission as one peer has them (D2.7 §3.1): what it counts
//! in its own pictures, by its own tracks, and what others tell of theirs.
//!
//! | event | what follows |
//! |---|---|
//! | a look, all of a site is in the inner part of the picture, no building that the mission tells before a corner of it, and nobody of a lower number has it in its own | the site is watched |
//! | a vehicle that was outside of a site is inside, while that is watched | it passes, once it is known to drive |
//! | a vehicle is seen that was not for a second | on which side of an outline it is is known anew: whatever is taken for one that was lost, a false alarm too, drove in nowhere |
//! | a vehicle is inside of a watched site | the time that it takes and the way that it drives are counted |
//! | a site is watched for three seconds, from not too high up, and no more than one is seen in it besides who stands | who stands in it is counted anew |
//! | a site is watched no more, or was for ten intervals since it was told | what was counted there is told |
//! | a count of another | kept, of each author and life the newest |
//! | another life begins, other sites or another sortie | its own counts begin at nothing |
//!
//! A vehicle that was inside already when a site came into the picture does not count, so what
//! passes over the time watched is an unbiased volume, however often it was looked at; where two
//! are above a site at once, the higher number pauses its count and its clock together.
//!
//! # Guarantees
//! Of each site, author and life the larger count stands, and all are added: registers merge in
//! any order. Bounded. Without sites nothing is kept and nothing said.

use crate::Incarnation;
use crate::carried::carried;
use crate::count_site::{CountSite, Counted};
use crate::effect::{Effect, Effects};
use crate::input::Time;
use crate::mission::Mission;
use crate::registers::{Grows, Registers};
use crate::sight::Sight;
use crate::wire::codec::Body;
use crate::wire::count::Count;
use serde::{Deserialize, Serialize};
use skein_behaviors::Percept;
use skein_behaviors::sightings::Sighted;
use skein_flight::airframe::Airframe;
use skein_flight::tracking::buildings::Town;
use skein_flight::tracking::tracks::{TargetName, Track, Tracks};
use skein_geometry::Polygon;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::hash::{Fnv, folded};
use skein_geometry::math::seconds;
use std::collections::BTreeMap;

/// Looks that are farther apart than this are none of one watch, milliseconds.
pub(crate) const GAP_MS: u64 = 1_000;

/// A vehicle left a site when it is so far outside, metres: who stands on the outline passes once.
const LEFT_M: f64 = 3.0;

/// Who drives in is no farther inside when it is seen there first, metres: two looks at 15 m/s. Who
/// is was taken for another that was inside already.
const DEPTH_M: f64 = 6.0;

/// Who was seen so often is no false alarm.
const HITS: u32 = 4;

/// Slower than this over the last looks is as good as still, m/s: three times what errors of two
/// places come to in a second.
const STILL_MPS: f64 = 2.5;

/// And so is who the filter takes for slower than this, m/s: it forgets sooner that one was taken
/// for its neighbour, and takes who stands for one that moves at two.
const SLOW_MPS: f64 = 2.0;

/// So many looks are the last ones, and they take so long at least, milliseconds.
const LAST: usize = 6;
const LAST_MS: u64 = 600;

/// A track of fewer looks may be on the wrong side of an outline.
const SIDE_HITS: u32 = 3;

/// Who stands in a site is known after so long, milliseconds: while many come into a picture at
/// once, neighbours are taken for each other, and who was stands again in the looks of a second.
const SURE_MS: u64 = 2_000;

/// What is watched on and on is told once in so many intervals.
const TOLD_INTERVALS: u64 = 10;

/// Who stand beside each other are told apart where places are told with no larger standard
/// deviation, in the mean, mm: from high up they are not, and such a UAV leaves the count to others.
const SHARP_MM: u64 = 1_100;

/// Who stands there is the most that one of so many looks tells: one is missed for a look more
/// often than there is one too many.
const LOTS: usize = 5;

/// In a look so many are seen in a site, in the mean, besides who stands there: one that drives
/// through. Where more are, who stands is taken for one that drives, as its neighbours are for it.
const BESIDES: u32 = 1;

/// Counts that are said at a time.
const SAID: usize = 2;

/// Whoever was heard so many intervals ago is where it flew straight on to.
const HEARD_INTERVALS: u64 = 3;

/// Most counts of others that are kept: sixteen sites of a hundred UAVs, and lives of some.
pub const KNOWN_MAX: usize = 2_048;

/// The share of half a picture in which a site has to be, all of it.
pub const INNER: f64 = 0.85;

/// What all authors together counted at one site.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SiteCount {
    /// For how long it was watched, milliseconds; where two watched at once, once.
    pub watched_ms: u64,
    /// Vehicles that drove in meanwhile.
    pub passed: u32,
    /// How long vehicles were there meanwhile, milliseconds.
    pub spent_ms: u64,
    /// How far they drove there, decimetres.
    pub driven_dm: u64,
    /// Vehicles that stood there when it was seen last; none where it never was.
    pub standing: Option<Standing>,
}

/// Who stood at a site when it was seen last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Standing {
    /// When that was, milliseconds of the clock of percepts.
    pub seen_ms: u64,
    /// By whom.
    pub by: u16,
    /// How many.
    pub vehicles: u16,
}

impl SiteCount {
    /// Adds what one author counted in one life.
    pub fn add(&mut self, author: u16, count: &Count) {
        self.watched_ms += count.watched_ms;
        self.passed += count.passed;
        self.spent_ms += count.spent_ms;
        self.driven_dm += count.driven_dm;
        if count.seen_ms > 0 {
            let seen = Standing {
                seen_ms: count.seen_ms,
                by: author,
                vehicles: count.standing,
            };
            self.standing = self.standing.max(Some(seen));
        }
    }

    /// Traffic volume, vehicles an hour; none where the site was not watched.
    #[must_use]
    pub fn volume_per_h(&self) -> Option<f64> {
        self.per_h(f64::from(self.passed))
    }

    /// Where the volume is, in nineteen cases of twenty, vehicles an hour, if vehicles come
    /// independently of each other.
    #[must_use]
    pub fn volume_range_per_h(&self) -> Option<(f64, f64)> {
        let (low, high) = poisson_range(self.passed);
        Some((self.per_h(low)?, self.per_h(high)?))
    }

    fn per_h(&self, vehicles: f64) -> Option<f64> {
        (self.watched_ms > 0).then(|| vehicles * 3_600.0 / seconds(self.watched_ms))
    }

    /// Space-mean speed, m/s: all ways over all times (Edie 1963); none where nobody was there.
    #[must_use]
    pub fn speed_mps(&self) -> Option<f64> {
        #[allow(clippy::cast_precision_loss, reason = "no way is as long as 2^52 dm")]
        let driven_m = self.driven_dm as f64 / 10.0;
        (self.spent_ms > 0).then(|| driven_m / seconds(self.spent_ms))
    }

    /// What was counted at a site, for a person.
    #[must_use]
    pub fn sentence(&self, site: &CountSite) -> String {
        match site.what {
            Counted::Passing => self.passing(&site.name),
            Counted::Standing => self.occupancy(site),
        }
    }

    fn passing(&self, name: &str) -> String {
        let watched_s = seconds(self.watched_ms);
        let (Some(volume), Some((low, high))) = (self.volume_per_h(), self.volume_range_per_h())
        else {
            return format!("{name}: not watched yet");
        };
        let speed = self
            .speed_mps()
            .map_or_else(String::new, |v| format!(", {v:.1} m/s"));
        let passed = self.passed;
        format!(
            "{name}: {passed} vehicles in {watched_s:.0} s watched: {volume:.0} an hour ({low:.0} to {high:.0}){speed}"
        )
    }

    fn occupancy(&self, site: &CountSite) -> String {
        let name = &site.name;
        let Some(seen) = self.standing else {
            return format!("{name}: not looked at yet");
        };
        let of = if site.capacity > 0 {
            let share = 100.0 * f64::from(seen.vehicles) / f64::from(site.capacity);
            format!(" of {} ({share:.0} %)", site.capacity)
        } else {
            String::new()
        };
        format!(
            "{name}: {}{of} stood there at {:.1} s of the clock of percepts, seen by uav{}",
            seen.vehicles,
            seconds(seen.seen_ms),
            seen.by
        )
    }
}

/// One of the own tracks beside the sites: a bit each.
#[derive(Clone, Copy, Debug)]
struct Along {
    begun_ms: u64,
    /// Where it was when it was seen last, the latest last.
    last: [(u64, Point); LAST],
    hits: u32,
    /// Where it is known to be inside or outside; where inside; where it drove in and is not
    /// counted yet.
    known: u16,
    inside: u16,
    entered: u16,
}

/// A site, and this peer's own count of it.
#[derive(Clone, Debug)]
struct Site {
    what: Counted,
    outline: Polygon,
    own: Count,
    driven_m: f64,
    /// How many stood there in the last looks of this watch, and how many were seen there.
    stood: [Option<(u16, u32)>; LOTS],
    /// Since when it is watched in one go, by the clock of percepts.
    since_ms: Option<u64>,
    told: Count,
    told_at: Time,
}

/// All that one peer knows of them.
#[derive(Debug, Default)]
pub(crate) struct Counting {
    me: u16,
    life: Incarnation,
    /// What the sites below are of.
    of: u32,
    sites: Vec<Site>,
    tracks: BTreeMap<TargetName, Along>,
    last_ms: u64,
    /// Where others of lower numbers are.
    others: Vec<Pose>,
    known: Registers<Count, KNOWN_MAX>,
}

impl Mission {
    /// Which sites of which sortie: counts of others are none of these.
    #[must_use]
    pub fn sites_hash(&self) -> u32 {
        let mut h = Fnv::new();
        h.write_i64(i64::from(self.sortie));
        self.counts.iter().for_each(|s| s.hash(&mut h));
        folded(h.finish())
    }
}

impl Along {
    fn begun(t: &Track) -> Self {
        Self {
            begun_ms: t.begun_ms(),
            last: [(t.seen_ms, t.estimate.position()); LAST],
            hits: 0,
            known: 0,
            inside: 0,
            entered: 0,
        }
    }

    fn seen(&mut self, now_ms: u64, at: Point) {
        self.last.rotate_left(1);
        self.last[LAST - 1] = (now_ms, at);
        self.hits = self.hits.saturating_add(1);
    }

    fn last_ms(&self) -> u64 {
        self.last[LAST - 1].0
    }

    /// Whether it drives, or stands; none where that is not known yet. Over the last looks alone:
    /// who was taken for its neighbour once stands soon again.
    fn drives(&self) -> Option<bool> {
        let ((from_ms, from), (to_ms, to)) = (self.last[0], self.last[LAST - 1]);
        let over_ms = to_ms.saturating_sub(from_ms);
        (over_ms >= LAST_MS).then(|| (to - from).norm() > STILL_MPS * seconds(over_ms))
    }
}

impl Grows for Count {
    fn of(&self) -> u32 {
        self.sites
    }

    fn amount(&self) -> u64 {
        self.watched_ms
    }
}

impl Counting {
    /// Nothing is known.
    pub fn new(me: u16) -> Self {
        Self {
            me,
            ..Self::default()
        }
    }

    /// A life begins.
    pub fn begin_life(&mut self, life: Incarnation) {
        self.life = life;
        self.of = 0;
        self.sites.clear();
        self.tracks.clear();
    }

    /// The sites of the mission, with what it has counted there itself.
    fn follow(&mut self, mission: &Mission) {
        let of = mission.sites_hash();
        if of == self.of && self.sites.len() == mission.counts.len() {
            return;
        }
        self.of = of;
        self.tracks.clear();
        let site = |s: &CountSite| {
            let own = Count {
                sites: of,
                ..Count::default()
            };
            Some(Site {
                what: s.what,
                outline: s.outline()?,
                own,
                driven_m: 0.0,
                stood: [None; LOTS],
                since_ms: None,
                told: own,
                told_at: Time(0),
            })
        };
        self.sites = mission.counts.iter().filter_map(site).collect();
    }

    /// One look of the own camera: what its tracks do at the sites; `counts` where this peer is
    /// to count at all.
    pub fn look(
        &mut self,
        percept: &Percept,
        airframe: &Airframe,
        tracks: &Tracks,
        (mission, town, counts): (&Mission, Option<&Town>, bool),
    ) {
        self.follow(mission);
        let now_ms = percept.time_ms;
        let apart_ms = now_ms.saturating_sub(self.last_ms);
        let apart_ms = if apart_ms > GAP_MS { 0 } else { apart_ms };
        self.last_ms = now_ms;
        let counts = counts && percept.takes_off_in_ms == 0;
        let mut watched = 0_u16;
        let sight = Sight::of(percept, airframe, town);
        for (i, site) in self.sites.iter_mut().enumerate() {
            let corners = site.outline.vertices();
            let shows = |sight: Sight<'_>| corners.iter().all(|p| sight.shows(*p, INNER));
            let of_another = || self.others.iter().any(|o| shows(sight.of_other(*o)));
            let is_watched = counts && shows(sight) && !of_another();
            let was = site.since_ms.filter(|_| apart_ms > 0);
            if is_watched && was.is_some() {
                watched |= 1 << i;
                site.own.watched_ms += apart_ms;
            }
            site.since_ms = is_watched.then(|| was.unwrap_or(now_ms));
        }
        self.go_along(now_ms, tracks, watched);
        self.count_standing(percept, tracks);
    }

    /// Takes in what each track did since the last look.
    fn go_along(&mut self, now_ms: u64, tracks: &Tracks, watched: u16) {
        let mut before = core::mem::take(&mut self.tracks);
        for t in tracks.all() {
            let known = carried(&mut before, |a: &Along| a.begun_ms, tracks, t);
            let mut along = known.unwrap_or_else(|| Along::begun(t));
            if t.seen_ms == now_ms {
                self.step(&mut along, t, now_ms, watched);
            }
            self.tracks.insert(t.name, along);
        }
    }

    fn step(&mut self, along: &mut Along, t: &Track, now_ms: u64, watched: u16) {
        let at = t.estimate.position();
        let since_ms = now_ms.saturating_sub(along.last_ms());
        if since_ms > GAP_MS {
            *along = Along::begun(t);
        }
        along.seen(now_ms, at);
        let is_sure = t.confirmed && along.hits >= HITS;
        let drives = along.drives() == Some(true);
        if along.hits < SIDE_HITS {
            return;
        }
        for (i, site) in self.sites.iter_mut().enumerate() {
            let bit = 1_u16 << i;
            if site.what != Counted::Passing {
                continue;
            }
            let is_inside = site.outline.contains(at);
            let was_inside = along.inside & bit > 0;
            let was_known = along.known & bit > 0;
            along.known |= bit;
            if is_inside {
                along.inside |= bit;
                let drove_in = was_known && !was_inside && watched & bit > 0;
                if drove_in && site.outline.outline_distance_m(at) <= DEPTH_M {
                    along.entered |= bit;
                }
            } else if was_inside && site.outline.outline_distance_m(at) > LEFT_M {
                along.inside &= !bit;
            }
            if along.entered & bit > 0 && is_sure && drives {
                along.entered &= !bit;
                site.own.passed += 1;
            }
            if is_inside && was_inside && watched & bit > 0 && t.confirmed && since_ms <= GAP_MS {
                site.own.spent_ms += since_ms;
                site.driven_m += t.estimate.velocity_mps().norm() * seconds(since_ms);
                site.own.driven_dm = whole_dm(site.driven_m);
            }
        }
    }

    /// Who stands at the sites that were watched for long enough.
    fn count_standing(&mut self, percept: &Percept, tracks: &Tracks) {
        let now_ms = percept.time_ms;
        let alongs = &self.tracks;
        let stands = |t: &&Track| {
            let along = alongs.get(&t.name);
            along.is_some_and(|a| {
                let is_fresh = now_ms.saturating_sub(a.last_ms()) <= GAP_MS;
                let is_slow = t.estimate.velocity_mps().norm() < SLOW_MPS;
                is_fresh && a.hits >= HITS && (is_slow || a.drives() == Some(false))
            })
        };
        for site in &mut self.sites {
            let is_sure = site
                .since_ms
                .is_some_and(|since_ms| now_ms.saturating_sub(since_ms) >= SURE_MS);
            if site.what != Counted::Standing || !is_sure || !is_sharp(percept, &site.outline) {
                site.stood = [None; LOTS];
                continue;
            }
            let standing = tracks.confirmed().filter(stands);
            let standing = standing.filter(|t| site.outline.contains(t.estimate.position()));
            let standing = u16::try_from(standing.count()).unwrap_or(u16::MAX);
            let seen = inside(percept, &site.outline).map(|_| 1_u32).sum();
            site.stood.rotate_left(1);
            site.stood[LOTS - 1] = Some((standing, seen));
            if let Some(most) = surely_standing(&site.stood) {
                (site.own.standing, site.own.seen_ms) = (most, now_ms);
            }
        }
    }

    /// Where others of lower numbers are now: what one of them has in its picture, that one
    /// counts. They are taken to have the own airframe, and to fly level.
    pub fn heed(&mut self, others: Vec<Pose>) {
        self.others = others;
    }

    /// What is to be told now.
    pub fn tell(&mut self, now: Time, interval_ms: u64) -> Effects {
        let mut effects = Effects::new();
        let (me, life, last_ms) = (self.me, self.life, self.last_ms);
        for (subject, site) in (0_u16..).zip(&mut self.sites) {
            let is_over = site.since_ms.is_none();
            let is_due = now.since_ms(site.told_at) >= TOLD_INTERVALS * interval_ms;
            if site.own == site.told || !(is_over || is_due) || last_ms == 0 {
                continue;
            }
            if effects.len() >= SAID {
                break;
            }
            (site.told, site.told_at) = (site.own, now);
            self.known.told((subject, me, life), site.own);
            effects.push(Effect::Speak(subject, Body::Count(site.own)));
        }
        effects
    }

    /// What another tells.
    pub fn hear(&mut self, (author, life): (u16, Incarnation), subject: u16, count: &Count) {
        let key = (subject, author, life);
        if author == self.me && life == self.life {
            return;
        }
        self.known.hear(key, count, self.of);
    }

    /// What all together counted at each site of a mission.
    pub fn sums(&self, mission: &Mission) -> Vec<SiteCount> {
        let of = mission.sites_hash();
        let mut sums = vec![SiteCount::default(); mission.counts.len()];
        for (site, author, count) in self.known.of(of) {
            if let Some(sum) = sums.get_mut(usize::from(site)) {
                sum.add(author, count);
            }
        }
        sums
    }

    /// Its own counts, and whether each site is watched in the percept of this time.
    pub fn own(&self, percept_ms: u64) -> impl Iterator<Item = (bool, Count)> {
        let looks = self.last_ms == percept_ms;
        let all = self.sites.iter();
        all.map(move |s| (looks && s.since_ms.is_some(), s.own))
    }

    /// How many counts are kept.
    pub fn len(&self) -> usize {
        self.known.len()
    }
}

/// Where the mean of a Poisson number is, in nineteen cases of twenty, by one drawing: Byar's
/// approximation (Breslow and Day 1987).
pub(crate) fn poisson_range(drawn: u32) -> (f64, f64) {
    let z = 1.96;
    let cube = |x: f64| x * x * x;
    let n = f64::from(drawn);
    let low = if drawn == 0 {
        0.0
    } else {
        n * cube(1.0 - 1.0 / (9.0 * n) - z / (3.0 * n.sqrt()))
    };
    let m = n + 1.0;
    let high = m * cube(1.0 - 1.0 / (9.0 * m) + z / (3.0 * m.sqrt()));
    (low.max(0.0), high)
}

/// Where others are now, if they flew straight on since they said where they were; who was not
/// heard lately is left out. They are taken to have the own airframe.
pub(crate) fn flown_on(others: &[(Pose, u64)], interval_ms: u64, airframe: &Airframe) -> Vec<Pose> {
    let fresh = others
        .iter()
        .filter(|(_, age_ms)| *age_ms <= HEARD_INTERVALS * interval_ms);
    let now = |(pose, age_ms): &(Pose, u64)| {
        let on_m = airframe.cruise_mps * seconds(*age_ms);
        Pose::new(pose.position() + pose.direction() * on_m, pose.heading_rad)
    };
    fresh.map(now).collect()
}

/// What is seen inside of an outline in one look, whatever it does.
fn inside<'a>(percept: &'a Percept, outline: &'a Polygon) -> impl Iterator<Item = &'a Sighted> {
    let seen = percept.sightings.seen();
    seen.filter(|s| outline.contains(s.at()))
}

/// Whether who stands at a place is seen sharply enough to be told apart.
fn is_sharp(percept: &Percept, outline: &Polygon) -> bool {
    let (n, sum_mm) = inside(percept, outline).fold((0_u64, 0_u64), |(n, sum), s| {
        (n + 1, sum + u64::from(s.spread_mm))
    });
    sum_mm <= n * SHARP_MM
}

/// How many stand at a site by its last looks; none where these are too few yet, or show more than
/// stand there and drive through.
fn surely_standing(looks: &[Option<(u16, u32)>; LOTS]) -> Option<u16> {
    let all: Option<Vec<(u16, u32)>> = looks.iter().copied().collect();
    let all = all?;
    let most = all.iter().map(|(standing, _)| *standing).max()?;
    let seen: u32 = all.iter().map(|(_, seen)| seen).sum();
    let many: u32 = all.iter().map(|_| u32::from(most) + BESIDES).sum();
    (seen <= many).then_some(most)
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn whole_dm(m: f64) -> u64 {
    (m * 10.0).round() as u64
}

#[cfg(test)]
mod tests;
