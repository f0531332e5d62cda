//! The people of a mass event as UAVs tell of them, beside where people truly are (`crowd-sight`,
//! `crowd-idle`, `crowd-norm`, `crowd-late`, `crowd-false`, `crowd-range`, `crowd-people`,
//! `crowd-agree`; D2.7 §3.1). Who stays above what is too dense is `circles.rs`'s.
//!
//! | what | beside |
//! |---|---|
//! | that a UAV saw a sector | whether all of it is in its picture |
//! | how many people that sector had, as all are told | those who truly were there in that second |
//! | that it is too dense, or has eased | whether it is clearly so, or not near to it |
//! | what one member of a component was told | what the others know |
//!
//! # Where the bounds come from
//! A recogniser finds 80 to 90 % of those who are there, so of a sector with 1.13 times the norm or
//! more somebody who sees exactly could be sure. Places are off by 2 m, a standard deviation, for a
//! whole flight: *clearly* too dense is a sector that has 1.5 times the norm wherever within 6 m it
//! is taken to be, and clearly eased one with half of what counts as eased. What nobody can take for
//! too dense has less than 0.8 times the norm wherever within 8 m it is taken to be: by chance it is
//! four standard deviations away. A range holds in nineteen cases of twenty; errors of one flight
//! are alike, so of sixty and more that are told 0.85 are asked for.

use super::flight::{FlightCheck, Flyer};
use super::spread::{light_limit_ms, record_limit};
use super::{Clocks, Findings, PeerSnapshot, Snapshot};
use crate::world::camera::Picture;
use crate::world::crowd::Crowd as People;
use skein_geometry::frame::Point;
use skein_peer::Mission;
use skein_peer::crowd::CrowdWatch;
use skein_peer::gathering::{Crowd, CrowdAlert, Sector};
use skein_peer::wire::crowd::SECTORS_EACH;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

mod circles;
mod report;
mod truth;
use circles::CircleCheck;
pub use circles::Watched;
pub use report::{CrowdAlertReport, CrowdReport};
use truth::Truth;

/// Of the ranges that are told so many hold what truly was there at least, where so many were told.
const HOLD_SHARE: f64 = 0.85;
const HOLD_FROM: u32 = 60;

/// How often the number of all people is looked at, milliseconds, and how many of so many times it
/// is in the range that is told at least. The range is for nineteen of twenty, but one UAV has seen
/// all anew only after ten of these times, and what was wrong once is so for all of them.
const PEOPLE_MS: u64 = 30_000;
const PEOPLE_SHARE: f64 = 0.6;

/// And so many times as far from what is told as the range goes it never is.
const PEOPLE_OFF: f64 = 2.0;

/// What is well in a picture is in so much of half of it, each way.
const WELL: f64 = 0.8;

/// Who may look is asked once a period: so many looks that nothing came of prove it.
const LOOKS: u64 = 3;

/// Of looks at one time a UAV may keep an earlier one that tells more exactly, milliseconds.
const KEPT_MS: u64 = 6_000;

/// What is told again may be lost again.
const AGAIN_FACTOR: u64 = 2;

/// Who knows that a sector became too dense tells so within so many of its intervals: one tile at
/// a time, four of them in a picture, when what was said before has gone out.
const TOLD_INTERVALS: u64 = 12;
const TOLD_MS: u64 = 5_000;

/// One look of a UAV.
#[derive(Clone, Copy)]
pub struct CrowdGlance<'a> {
    /// Whose, and in which life.
    pub uav: (u16, u32),
    /// What it sees.
    pub picture: Picture,
    /// Whether its computer is late: what it says is of where it was.
    pub is_late: bool,
    /// Whether its recogniser looked in this percept.
    pub looks: bool,
    /// Whether nothing stands between its camera and a place.
    pub sees: &'a dyn Fn(Point) -> bool,
    /// What it saw itself, told or not, by sector.
    pub own: &'a [(u16, Sector)],
    /// What it was told.
    pub known: &'a Crowd,
}

/// A UAV in a life.
#[derive(Clone, Debug, Default)]
struct Watcher {
    /// By sector, how often it looked and nothing came of it.
    missed: BTreeMap<u16, u64>,
    wrong: BTreeMap<u16, u64>,
    sight_told: bool,
}

/// What a member of a component lacks of what another was told.
#[derive(Clone, Copy, Debug)]
struct Lack {
    wanted: Sector,
    since_ms: u64,
    /// Since when that is whether it is too dense.
    urgent_ms: Option<u64>,
    told: bool,
}

/// The event of one run.
#[derive(Clone, Debug, Default)]
pub struct CrowdCheck {
    of: u32,
    revision: u32,
    watch: Option<Arc<CrowdWatch>>,
    truth: Truth,
    watchers: BTreeMap<(u16, u32), Watcher>,
    /// Who flies the newest mission and is not through with it, and how often it speaks.
    able: BTreeMap<u16, u64>,
    untold: Clocks<(u16, u16)>,
    /// The last look at each sector that was told.
    judged: BTreeMap<u16, (u64, u16)>,
    /// Ranges that hold, of so many.
    ranges: (u32, u32),
    lacks: BTreeMap<(u16, u16), Lack>,
    people_at_ms: u64,
    /// How often the number of people was in its range: at the looks, and now.
    people_then: (u32, u32),
    /// How far beside what was told that was at most, in parts of what the range says.
    people_off: f64,
    people_now: (u32, u32),
    alerts: Vec<CrowdAlertReport>,
    wrong_told: BTreeSet<(u16, u64, bool)>,
    report: CrowdReport,
    circles: CircleCheck,
}

impl CrowdCheck {
    /// The operator has a mission.
    pub fn on_mission(&mut self, mission: &Mission) {
        self.revision = mission.revision;
        self.circles.on_mission(mission);
        let of = mission.crowd_hash();
        let Some(watch) = &mission.crowd else {
            *self = Self::default();
            return;
        };
        if self.watch.is_some() && of == self.of {
            return;
        }
        *self = Self {
            of,
            revision: mission.revision,
            truth: Truth::new(watch),
            watch: Some(Arc::clone(watch)),
            circles: core::mem::take(&mut self.circles),
            ..Self::default()
        };
    }

    /// Whether no event is watched.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.watch.is_none()
    }

    /// Where people are now.
    pub fn on_people(&mut self, people: &People) {
        if let Some(watch) = &self.watch {
            self.truth.note(people, watch);
        }
    }

    /// One look of a UAV, beside where people are.
    pub fn on_look(&mut self, now_ms: u64, look: CrowdGlance<'_>, found: &mut Findings) {
        let Some(watch) = self.watch.clone() else {
            return;
        };
        let side_m = f64::from(watch.sector_m);
        let able = self.able.get(&look.uav.0).copied();
        self.note_untold(now_ms, &look, able, found);
        if look.is_late || !look.looks {
            return;
        }
        let dense = look.known.sectors().filter(|(_, s)| s.dense().is_some());
        let dense: Vec<u16> = dense.map(|(n, _)| n).collect();
        self.circles
            .on_look(now_ms, look.uav.0, &look.picture, &dense);
        let watcher = self.watchers.entry(look.uav).or_default();
        let second_ms = now_ms / 1_000 * 1_000;
        let since = |s: &Sector, ms: u64| s.look.is_some_and(|l| l.seen_ms + ms >= second_ms);
        let own: BTreeMap<u16, Sector> = look.own.iter().copied().collect();
        for sector in watch.sectors() {
            let Some(low) = watch.low(sector) else {
                continue;
            };
            let corners = truth::corners(low, side_m);
            let seen = own.get(&sector).filter(|s| since(s, 0));
            let in_picture = |share: f64| corners.iter().all(|p| look.picture.shows(*p, share));
            // Both reckon with the same numbers, and not in the same order.
            if seen.is_some()
                && !in_picture(1.0 + 1e-6)
                && !core::mem::replace(&mut watcher.sight_told, true)
            {
                found.broken("crowd-sight", now_ms, Some(look.uav.0), || {
                    format!(
                        "says that it saw sector {sector}, and not all of that is in its picture"
                    )
                });
            }
            let is_well = able.is_some()
                && in_picture(WELL)
                && truth::middles(low, side_m).into_iter().all(look.sees);
            if !is_well {
                watcher.missed.remove(&sector);
                watcher.wrong.remove(&sector);
                continue;
            }
            let missed = watcher.missed.entry(sector).or_default();
            let is_seen = own.get(&sector).is_some_and(|s| since(s, KEPT_MS));
            *missed = if is_seen { 0 } else { *missed + 1 };
            if *missed == LOOKS {
                found.broken("crowd-idle", now_ms, Some(look.uav.0), || {
                    format!("has sector {sector} in its picture, and counts nobody there")
                });
            }
            let clear = self.truth.clear(now_ms / 1_000, sector, &watch);
            let known = look.known.sector(sector).unwrap_or_default();
            let says = own.get(&sector).map(|s| known.joined(*s).dense().is_some());
            let wrong = watcher.wrong.entry(sector).or_default();
            let is_wrong = clear.is_some() && says.is_some() && says != clear;
            *wrong = if is_wrong { *wrong + 1 } else { 0 };
            if *wrong == LOOKS {
                let people = self.truth.people(now_ms / 1_000, sector);
                found.broken("crowd-norm", now_ms, Some(look.uav.0), || {
                    let people = people.unwrap_or(0);
                    if clear == Some(true) {
                        format!("looks at sector {sector} with {people} people, and does not know that it is too dense")
                    } else {
                        format!("looks at sector {sector} with {people} people, and holds it to be too dense")
                    }
                });
            }
            if clear == Some(true) {
                self.truth.looked(sector, now_ms);
            }
        }
    }

    /// Who knows that a sector became too dense tells so.
    fn note_untold(
        &mut self,
        now_ms: u64,
        look: &CrowdGlance<'_>,
        able: Option<u64>,
        found: &mut Findings,
    ) {
        let uav = look.uav.0;
        for (sector, own) in look.own {
            let key = (uav, *sector);
            let known = look.known.sector(*sector).unwrap_or_default();
            let is_untold =
                own.dense().is_some() && known.dense().is_none() && own.verdict > known.verdict;
            let Some(interval_ms) = able.filter(|_| is_untold && !look.is_late) else {
                self.untold.stop(key);
                continue;
            };
            let since_ms = self.untold.start(key, now_ms);
            let bound_ms = TOLD_INTERVALS * interval_ms + TOLD_MS;
            if now_ms > since_ms + bound_ms && self.untold.tell_once(key) {
                found.broken("crowd-late", now_ms, Some(uav), || {
                    format!("knows that sector {sector} is too dense, and has not told so for {bound_ms} ms")
                });
            }
        }
    }

    /// A peer tells people that a sector became too dense, or has eased.
    pub fn on_told(
        &mut self,
        (now_ms, id, is_ground): (u64, u16, bool),
        told: &CrowdAlert,
        found: &mut Findings,
    ) {
        let Some(watch) = self.watch.clone() else {
            return;
        };
        let key = (told.sector, told.since_ms, told.is_dense);
        let second = told.since_ms / 1_000;
        if self.wrong_told.insert(key)
            && let Some(why) = self.truth.why_wrong(second, told, &watch)
        {
            found.broken("crowd-false", now_ms, Some(told.by), || why);
        }
        let begun_ms = self.truth.dense_since_ms(told.sector, second, &watch);
        report::note(&mut self.alerts, (now_ms, id, is_ground), told, begun_ms);
    }

    /// What all are told, beside what was true, and whether they are told the same.
    pub fn on_snapshot(
        &mut self,
        snapshot: &Snapshot<'_>,
        flyers: (&BTreeMap<u16, Flyer>, &FlightCheck),
        found: &mut Findings,
    ) {
        if self.watch.is_none() {
            return;
        }
        self.circles.on_snapshot(snapshot, flyers, found);
        let follows = |m: &&PeerSnapshot| m.view.revision >= self.revision;
        let peers: Vec<&PeerSnapshot> = snapshot.peers.iter().filter(follows).collect();
        let able = peers
            .iter()
            .filter(|m| m.uav && m.view.speaks && !m.view.finished);
        self.on_able(able.map(|m| (m.id, m.view.interval_ms)).collect());
        for m in &peers {
            self.on_known(&m.view.crowd);
        }
        self.look_for_lacks(snapshot, &peers, found);
        let ground = peers.iter().find(|m| !m.uav).or(peers.first());
        if let Some(m) = ground {
            self.on_ground(snapshot.now_ms, &m.view.crowd);
        }
    }

    /// Who flies the newest mission and is not through with it, each with how often it speaks,
    /// milliseconds.
    pub fn on_able(&mut self, able: BTreeMap<u16, u64>) {
        self.able = able;
    }

    /// What a peer was told, by sector.
    pub fn on_known(&mut self, crowd: &[(u16, Sector)]) {
        for (sector, s) in crowd {
            self.judge_look(*sector, s);
        }
    }

    /// What the ground station was told, or who is asked in its place.
    pub fn on_ground(&mut self, now_ms: u64, crowd: &[(u16, Sector)]) {
        if let Some(known) = self.crowd_of(crowd) {
            self.judge_people(now_ms, &known);
        }
    }

    /// It as one peer was told of it; none without an event.
    #[must_use]
    pub fn crowd_of(&self, crowd: &[(u16, Sector)]) -> Option<Crowd> {
        let known = crowd.iter().map(|(n, s)| (*n, *s)).collect();
        Some(Crowd::new(self.watch.clone()?, known))
    }

    /// A look that was told.
    fn judge_look(&mut self, sector: u16, s: &Sector) {
        let Some(look) = s.look else { return };
        let key = (look.seen_ms, look.by);
        let before = self.judged.get(&sector).copied().unwrap_or_default();
        if before >= key {
            return;
        }
        self.judged.insert(sector, key);
        if let Some(people) = self.truth.people(look.seen_ms / 1_000, sector) {
            let holds = (u32::from(look.low)..=u32::from(look.high)).contains(&people);
            self.ranges.0 += u32::from(holds);
            self.ranges.1 += 1;
        }
    }

    /// The number of all people.
    fn judge_people(&mut self, now_ms: u64, known: &Crowd) {
        let told = known.people();
        let (mut then, mut now) = (0, 0);
        for (sector, s) in known.sectors() {
            let Some(look) = s.look else { continue };
            let people = |ms: u64| self.truth.people(ms / 1_000, sector).unwrap_or(0);
            then += people(look.seen_ms);
            now += people(now_ms);
        }
        let (then, now) = (f64::from(then), f64::from(now));
        let all = known.watch().len();
        if told.looked == all && now_ms >= self.people_at_ms + PEOPLE_MS {
            self.people_at_ms = now_ms;
            let count = |counted: &mut (u32, u32), holds: bool| {
                counted.0 += u32::from(holds);
                counted.1 += 1;
            };
            count(
                &mut self.people_then,
                (told.low..=told.high).contains(&then),
            );
            let reach = if then < told.people {
                told.people - told.low
            } else {
                told.high - told.people
            };
            let off = (then - told.people).abs() / reach.max(1.0);
            self.people_off = self.people_off.max(off);
            let (low, high) = (told.low - told.twice, told.high + told.missed);
            count(&mut self.people_now, (low..=high).contains(&now));
        }
        self.report = CrowdReport {
            sectors: all,
            people: told,
            truly_then: then,
            truly_now: now,
            age_ms: now_ms.saturating_sub(told.oldest_ms),
            ..CrowdReport::default()
        };
    }

    /// Who lacks what another member of its component was told.
    fn look_for_lacks(
        &mut self,
        snapshot: &Snapshot<'_>,
        peers: &[&PeerSnapshot],
        found: &mut Findings,
    ) {
        let mut lacking = BTreeSet::new();
        for members in snapshot.graph.components() {
            let here: Vec<&&PeerSnapshot> = peers
                .iter()
                .filter(|m| members.contains(&m.id) && m.view.speaks)
                .collect();
            let Some(first) = here.first().filter(|_| here.len() > 1) else {
                continue;
            };
            let Some(whole_ms) = snapshot.stability.component_since_ms(first.id) else {
                continue;
            };
            let mut all: BTreeMap<u16, Sector> = BTreeMap::new();
            for (sector, s) in here.iter().flat_map(|m| &m.view.crowd) {
                let joined = all.entry(*sector).or_default();
                *joined = joined.joined(*s);
            }
            let again_ms = self.again_ms(snapshot, here.len());
            for m in &here {
                let held: BTreeMap<u16, Sector> = m.view.crowd.iter().copied().collect();
                for (sector, wanted) in &all {
                    let held = held.get(sector).copied().unwrap_or_default();
                    if held.joined(*wanted) == held {
                        continue;
                    }
                    let key = (m.id, *sector);
                    lacking.insert(key);
                    let fresh = Lack {
                        wanted: *wanted,
                        since_ms: snapshot.now_ms,
                        urgent_ms: None,
                        told: false,
                    };
                    let lack = self.lacks.entry(key).or_insert(fresh);
                    if held.joined(lack.wanted) == held {
                        *lack = fresh;
                    }
                    let is_urgent = held.dense().is_some() != wanted.dense().is_some();
                    let urgent_ms = lack.urgent_ms.unwrap_or(snapshot.now_ms);
                    lack.urgent_ms = is_urgent.then_some(urgent_ms);
                    let (record_ms, factor) = record_limit(&snapshot.bounds, here.len());
                    let slow = (Some(lack.since_ms), record_ms + again_ms, AGAIN_FACTOR);
                    for (since_ms, bound_ms, factor) in [slow, (lack.urgent_ms, record_ms, factor)]
                    {
                        let Some(since_ms) = since_ms else { continue };
                        let from_ms = since_ms.max(whole_ms).max(m.since_ms);
                        let took_ms = snapshot.now_ms - from_ms;
                        let limit_ms = light_limit_ms(snapshot, bound_ms, factor, from_ms);
                        let is_late = limit_ms.is_some_and(|l| took_ms > l);
                        if is_late && !core::mem::replace(&mut lack.told, true) {
                            found.broken("crowd-agree", snapshot.now_ms, Some(m.id), || {
                                format!("knows less of sector {sector} than its component was told {took_ms} ms ago (bound {bound_ms} ms)")
                            });
                        }
                    }
                }
            }
        }
        self.lacks.retain(|k, _| lacking.contains(k));
    }

    /// Within how long what somebody knows is told again: nobody told it for four of the mission's
    /// intervals, and then all tiles in turn.
    fn again_ms(&self, snapshot: &Snapshot<'_>, uavs: usize) -> u64 {
        let Some(watch) = &self.watch else { return 0 };
        let tiles = 1 + u64::from(watch.sectors().last().unwrap_or(0) / SECTORS_EACH);
        let rank = u64::try_from(uavs).unwrap_or(0);
        4_000 * u64::from(watch.interval_s) + (2 * tiles + 4 * rank) * snapshot.bounds.interval_ms
    }

    /// The run is over.
    pub fn on_end(&mut self, now_ms: u64, found: &mut Findings) {
        let (hold, of) = self.ranges;
        if of >= HOLD_FROM && f64::from(hold) < HOLD_SHARE * f64::from(of) {
            found.broken("crowd-range", now_ms, None, || {
                format!("what truly was there is in {hold} of {of} ranges that are told")
            });
        }
        let ((hold, of), off) = (self.people_then, self.people_off);
        if f64::from(hold) < PEOPLE_SHARE * f64::from(of) - 1.0 || off > PEOPLE_OFF {
            found.broken("crowd-people", now_ms, None, || {
                format!("how many people there were is in {hold} of {of} ranges that are told, and once {off:.1} times as far off as they go")
            });
        }
    }

    /// What is told, beside what is true; none without an event.
    #[must_use]
    pub fn report(&self) -> Option<CrowdReport> {
        let watch = self.watch.as_ref()?;
        let episodes = self.truth.episodes(watch);
        let (told, missed) = report::told(&episodes, &self.alerts);
        Some(CrowdReport {
            sectors: watch.len(),
            ranges: self.ranges,
            people_then: self.people_then,
            people_now: self.people_now,
            alerts: self.alerts.clone(),
            episodes: (told, missed),
            watched: self.circles.watched(),
            ..self.report.clone()
        })
    }
}

#[cfg(test)]
mod tests;
