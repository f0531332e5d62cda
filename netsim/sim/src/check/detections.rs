//! Objects that a mission looks for, against the vehicles of the world: what one had in its
//! picture for long enough and fits is told (`detect-missed`), what is told is there
//! (`detect-false`), no two follow one vehicle for two tasks for long (`detect-twice`), and nobody
//! for long what services on the ground have reached (`detect-served`).
//!
//! Not seen: whether an object that may be taken for one that was told before should have been
//! told as well; and whether a word of looks is right where the world lets cameras confuse them.

use super::tracks::Look;
use super::{Clocks, Findings, Graph, Handicaps, Stability};
use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;
use skein_geometry::math::seconds;
use skein_peer::Mission;
use skein_peer::criteria::{Criterion, STILL_MMPS, Then, looks_name};
use skein_peer::mission::mm;
use skein_peer::wire::detection::{Detection, OF_LIFE_MAX, Stands};
use skein_peer::wire::tasks::TaskId;
use std::collections::{BTreeMap, BTreeSet};

/// Who is in the picture of one UAV for so long is to be told, milliseconds: a peer wants three
/// seconds of hits, and is judged once a second.
const LONG_MS: u64 = 6_000;

/// Where cameras confuse what they see hits are fewer.
const LONG_CONFUSED_MS: u64 = 12_000;

/// And within so long from then on.
const WITHIN_MS: u64 = 5_000;

/// A speed that is nearer to what is asked for than this may be taken for the other, mm/s.
const UNSURE_MMPS: u32 = 1_000;

/// What is told of longer ago is not looked at: the world has no past, milliseconds.
const LATE_MS: u64 = 3_000;

/// Two may follow one vehicle, or one what is served, for so long until one of them knows,
/// milliseconds.
const KNOWN_MS: u64 = 60_000;

/// A vehicle is the one that is meant if it is no farther from where it is said to be, metres.
const MEANT_M: f64 = 40.0;

/// Whoever drives may have gone so much faster than it did, and a place is off by so much: who is
/// within that of what was told may be taken for it. As the protocol has it, and a little more.
const FASTER: f64 = 1.6;
const NEAR_M: f64 = 45.0;

/// The error that is told is four standard deviations: one of 3,000 is farther off. So much more,
/// six of them, one of 60 million is.
const NEVER: f64 = 1.5;

/// What so many UAVs of one run tell may be between the two. Most of the error is how far off a UAV
/// takes itself to be, which is the same for all that it tells.
const FAR_MAX: usize = 1;

/// A vehicle as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Where.
    pub at: Point,
    /// What it looks like.
    pub kind: u8,
    /// Whether cameras may take it for another kind.
    pub is_confused: bool,
}

/// What came of one detection, as the world knows.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DetectionReport {
    /// Who saw it.
    pub by: u16,
    /// In which of its registers it was told.
    pub number: u16,
    /// What it was said to look like.
    pub looks: String,
    /// When it was told, ms.
    pub told_ms: u64,
    /// Which vehicle it is, by its place in the scenario; none where there is none.
    pub vehicle: Option<usize>,
    /// How far that was from where it was told to be, mm.
    pub off_mm: u64,
    /// Since when that vehicle had been in pictures, ms.
    pub seen_ms: Option<u64>,
    /// Whether it was withdrawn: it was told before.
    pub withdrawn: bool,
    /// Whether it was to be followed.
    pub to_follow: bool,
    /// From when on somebody who followed it for this had it in its picture, ms.
    pub followed_ms: Option<u64>,
    /// For how long, ms.
    pub sight_ms: u64,
    /// When services on the ground had reached it, ms.
    #[serde(default)]
    pub served_ms: Option<u64>,
}

impl DetectionReport {
    /// One line for a person.
    #[must_use]
    pub fn line(&self) -> String {
        let s = crate::account::secs;
        let mut line = format!(
            "{} told by uav{} at {:.1} s",
            self.looks,
            self.by,
            s(self.told_ms)
        );
        line += &match (self.vehicle, self.seen_ms) {
            (Some(v), Some(seen_ms)) => format!(
                ", vehicle {v}, {:.1} m off, {:.1} s after it was first in sight",
                s(self.off_mm),
                s(self.told_ms.saturating_sub(seen_ms))
            ),
            (Some(v), None) => format!(", vehicle {v}, {:.1} m off", s(self.off_mm)),
            (None, _) => ", which is not there".to_owned(),
        };
        if self.withdrawn {
            line += ", withdrawn";
        } else if let Some(from_ms) = self.followed_ms {
            line += &format!(
                ", followed from {:.1} s on, in sight for {:.0} s",
                s(from_ms),
                s(self.sight_ms)
            );
        } else if self.to_follow {
            line += ", not followed";
        }
        if let Some(at_ms) = self.served_ms {
            line += &format!(", services there at {:.1} s", s(at_ms));
        }
        line
    }
}

/// A vehicle in the picture of one UAV.
#[derive(Clone, Copy, Debug)]
struct Pictured {
    from: Point,
    from_ms: u64,
    /// From when on it should be told.
    due_ms: Option<u64>,
    is_told: bool,
}

/// A detection that was told.
#[derive(Clone, Debug)]
struct Told {
    detection: Detection,
    report: DetectionReport,
}

/// A task and the revision in which it was asked for.
type Asked = (TaskId, u32);

/// What came of all in one run.
#[derive(Clone, Debug, Default)]
pub struct DetectionCheck {
    criteria: Vec<Criterion>,
    sortie: u16,
    told: BTreeMap<(u16, u16, u64), Told>,
    /// Which vehicles were told in this sortie.
    known: BTreeSet<usize>,
    /// Who told of what was farther from there than the error that was told.
    far: BTreeSet<u16>,
    pictured: BTreeMap<(u16, usize), Pictured>,
    first_ms: BTreeMap<usize, u64>,
    twice: Clocks<(u16, u16, usize)>,
    /// What services have reached, by the task in its revision: since when, and by whose word.
    served: BTreeMap<Asked, (u64, u16)>,
    kept: Clocks<(u16, Asked)>,
    last_ms: u64,
}

/// What a judge knows of the radio and of slow computers.
#[derive(Clone, Copy, Debug)]
pub struct Around<'a> {
    /// Who reaches whom.
    pub graph: &'a Graph,
    /// Since when.
    pub stability: &'a Stability,
    /// Who is late.
    pub handicaps: &'a Handicaps,
}

impl Around<'_> {
    /// Whether something goes on for longer than it takes a UAV to know, since some time and since
    /// its component is what it is; it is told once.
    fn has_gone_on<K: Copy + Ord>(
        &self,
        clocks: &mut Clocks<K>,
        key: K,
        uav: u16,
        (now_ms, since_ms): (u64, u64),
    ) -> bool {
        let joined_ms = self.stability.component_since_ms(uav).unwrap_or(now_ms);
        let from_ms = clocks.start(key, now_ms).max(joined_ms).max(since_ms);
        let bound_ms = self.handicaps.grown_ms(KNOWN_MS, from_ms, now_ms);
        now_ms.saturating_sub(from_ms) > bound_ms && clocks.tell_once(key)
    }
}

impl DetectionCheck {
    /// The operator has a mission.
    pub fn on_mission(&mut self, mission: &Mission) {
        if mission.sortie != self.sortie {
            self.known.clear();
            self.sortie = mission.sortie;
        }
        self.criteria = if mission.cancelled {
            Vec::new()
        } else {
            mission.detections.clone()
        };
        self.pictured.clear();
    }

    /// Whether anything is looked for, or was.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.criteria.is_empty() && self.told.is_empty()
    }

    /// Whether something that is there was told in this sortie.
    #[must_use]
    pub fn has_found(&self) -> bool {
        !self.known.is_empty()
    }

    /// Whether something to follow was told so lately that not all may have heard of it.
    #[must_use]
    pub fn has_fresh(&self, now_ms: u64, fresh_ms: u64) -> bool {
        let mut all = self.told.values().map(|t| &t.report);
        all.any(|r| r.to_follow && !r.withdrawn && now_ms < r.told_ms + fresh_ms)
    }

    /// What came of each detection, in the order in which they were told.
    #[must_use]
    pub fn reports(&self) -> Vec<DetectionReport> {
        let mut all: Vec<DetectionReport> = self.told.values().map(|t| t.report.clone()).collect();
        all.sort_by_key(|r| (r.told_ms, r.by, r.number));
        all
    }

    /// A peer tells of an object of its own, or withdraws it.
    pub fn on_told(
        &mut self,
        (now_ms, by): (u64, u16),
        (id, told): (TaskId, &Detection),
        truth: &[Truth],
        found: &mut Findings,
    ) {
        let key = (id.author, id.number, told.seen_ms);
        if told.stands == Stands::Withdrawn {
            if let Some(t) = self.told.get_mut(&key) {
                t.report.withdrawn = true;
            }
            return;
        }
        let late_ms = now_ms.saturating_sub(told.seen_ms);
        let at = told.at() + told.velocity_mps() * seconds(late_ms.min(LATE_MS));
        let error_m = f64::from(told.error_mm) / 1000.0;
        let may_be = |v: &Truth| v.kind == told.looks || v.is_confused;
        let all = truth.iter().enumerate().filter(|(_, v)| may_be(v));
        let off = all.map(|(n, v)| (n, (v.at - at).norm()));
        let nearest = off.min_by(|a, b| a.1.total_cmp(&b.1));
        // One who was late is believed within what its object can have driven meanwhile.
        let more_m = 40.0 * seconds(late_ms.saturating_sub(LATE_MS));
        let there = nearest.filter(|(_, off_m)| *off_m <= NEVER * error_m + more_m);
        let is_far = there.is_some_and(|(_, off_m)| off_m > error_m + more_m);
        self.far.extend(is_far.then_some(by));
        if there.is_none() || is_far && self.far.len() > FAR_MAX {
            let words = told.sentence(id.author);
            found.broken("detect-false", now_ms, Some(by), || match nearest {
                Some((n, off_m)) => {
                    format!("{words}; the nearest that looks so, vehicle {n}, is {off_m:.1} m off")
                }
                None => format!("{words}; there is none that looks so"),
            });
        }
        let then = self.criteria.get(usize::from(told.criterion));
        let vehicle = there.map(|(n, _)| n);
        self.known.extend(vehicle);
        let report = DetectionReport {
            by: id.author,
            number: id.number,
            looks: looks_name(told.looks),
            told_ms: now_ms,
            vehicle,
            off_mm: there.map_or(0, |(_, m)| u64::from(mm(m).unsigned_abs())),
            seen_ms: vehicle.and_then(|n| self.first_ms.get(&n).copied()),
            to_follow: then.is_some_and(|c| c.then == Then::Follow),
            ..DetectionReport::default()
        };
        let told = Told {
            detection: *told,
            report,
        };
        self.told.insert(key, told);
    }

    /// Somebody says that it follows what was told, where nobody looks into the peers.
    pub fn on_follows(&mut self, now_ms: u64, task: TaskId) {
        if let Some(t) = self.latest(task) {
            t.report.followed_ms.get_or_insert(now_ms);
        }
    }

    /// Services on the ground have reached what a task is to follow, by the word of a ground
    /// station.
    pub fn on_served(&mut self, said: (u64, u16), task: Asked) {
        self.served.entry(task).or_insert(said);
        if let Some(t) = self.latest(task.0) {
            t.report.served_ms.get_or_insert(said.0);
        }
    }

    /// What was told in a register; of one that was used again the latest.
    fn latest(&mut self, task: TaskId) -> Option<&mut Told> {
        let (author, number) = (task.author, task.number);
        let all = (author, number, 0)..=(author, number, u64::MAX);
        self.told.range_mut(all).next_back().map(|(_, t)| t)
    }

    /// Looks at all UAVs, beside where the vehicles are.
    pub fn on_looks(
        &mut self,
        now_ms: u64,
        (truth, looks): (&[Truth], &[Look]),
        around: Around<'_>,
        found: &mut Findings,
    ) {
        let passed_ms = now_ms.saturating_sub(self.last_ms);
        self.last_ms = now_ms;
        let meant = |look: &Look| meant(look, truth);
        let followed: BTreeSet<usize> = looks.iter().filter_map(meant).collect();
        let in_sight: BTreeSet<(u16, usize)> = looks
            .iter()
            .flat_map(|l| l.pictured.iter().map(|n| (l.uav, *n)))
            .collect();
        for (_, n) in &in_sight {
            self.first_ms.entry(*n).or_insert(now_ms);
        }
        let lives = |uav: u16| looks.iter().any(|l| l.uav == uav && l.at.is_some());
        // What is due stays due while who saw it lives.
        self.pictured
            .retain(|key, p| in_sight.contains(key) || p.due_ms.is_some() && lives(key.0));
        for look in looks.iter().filter(|l| l.at.is_some()) {
            for n in look.pictured.iter().copied().filter(|n| *n < truth.len()) {
                let anew = Pictured {
                    from: truth[n].at,
                    from_ms: now_ms,
                    due_ms: None,
                    is_told: false,
                };
                let p = self.pictured.entry((look.uav, n)).or_insert(anew);
                if look.since_ms > p.from_ms {
                    *p = anew;
                }
                let mut p = *p;
                self.judge(now_ms, look.uav, (n, truth[n]), &mut p, &followed);
                self.pictured.insert((look.uav, n), p);
            }
        }
        self.find_missed(now_ms, truth, &followed, around, found);
        self.find_twice(now_ms, (truth, looks), around, found);
        self.find_kept(now_ms, looks, around, found);
        self.note_sight((now_ms, passed_ms), truth, looks);
    }

    /// Whether a vehicle that a UAV has had in its picture is due to be told.
    fn judge(
        &self,
        now_ms: u64,
        uav: u16,
        (n, v): (usize, Truth),
        p: &mut Pictured,
        followed: &BTreeSet<usize>,
    ) {
        let long_ms = if v.is_confused {
            LONG_CONFUSED_MS
        } else {
            LONG_MS
        };
        let watched_ms = now_ms.saturating_sub(p.from_ms);
        if p.due_ms.is_some() || watched_ms < long_ms {
            return;
        }
        let mean_mps = (v.at - p.from).norm() / seconds(watched_ms).max(1.0);
        let mmps = mm(mean_mps).unsigned_abs();
        let fits = |c: &&Criterion| {
            c.fits(v.kind, mmps.saturating_sub(UNSURE_MMPS))
                && c.fits(v.kind, mmps + UNSURE_MMPS.min(STILL_MMPS - 1))
        };
        let asked = (0_u8..).zip(&self.criteria).find(|(_, c)| fits(c));
        let Some((nth, criterion)) = asked else {
            return;
        };
        let told = || self.told.values().filter(|t| !t.report.withdrawn);
        let told = || told().filter(|t| t.detection.sortie == self.sortie);
        let of_it = told().filter(|t| t.detection.criterion == nth).count();
        let own = told().filter(|t| t.report.by == uav).count();
        let is_full = of_it >= usize::from(criterion.at_most) || own >= usize::from(OF_LIFE_MAX);
        if !is_full && !self.is_known(now_ms, n, v, mean_mps, followed) {
            p.due_ms = Some(now_ms);
        }
    }

    /// Whether a vehicle was told, is followed, or may be taken for one that was told.
    fn is_known(
        &self,
        now_ms: u64,
        n: usize,
        v: Truth,
        mean_mps: f64,
        followed: &BTreeSet<usize>,
    ) -> bool {
        let may_be = |t: &Told| {
            let d = &t.detection;
            let fastest_mps = d.velocity_mps().norm().max(mean_mps);
            let drives = fastest_mps * 1e3 >= f64::from(STILL_MMPS) - 500.0;
            let reach_m = if drives {
                FASTER * fastest_mps.max(3.0) * seconds(now_ms.abs_diff(d.seen_ms))
            } else {
                0.0
            };
            let is_so = d.looks == v.kind || v.is_confused;
            d.sortie == self.sortie && is_so && (v.at - d.at()).norm() <= NEAR_M + reach_m
        };
        self.known.contains(&n) || followed.contains(&n) || self.told.values().any(may_be)
    }

    fn find_missed(
        &mut self,
        now_ms: u64,
        truth: &[Truth],
        followed: &BTreeSet<usize>,
        around: Around<'_>,
        found: &mut Findings,
    ) {
        let due: Vec<((u16, usize), u64)> = self
            .pictured
            .iter()
            .filter(|(_, p)| !p.is_told)
            .filter_map(|(key, p)| Some((*key, p.due_ms?)))
            .collect();
        for ((uav, n), due_ms) in due {
            if self.is_known(now_ms, n, truth[n], 0.0, followed) {
                self.pictured.remove(&(uav, n));
                continue;
            }
            let late_ms = around.handicaps.late_ms(uav, due_ms, now_ms);
            let bound_ms = around.handicaps.grown_ms(WITHIN_MS, due_ms, now_ms) + late_ms;
            if now_ms.saturating_sub(due_ms) <= bound_ms {
                continue;
            }
            if let Some(p) = self.pictured.get_mut(&(uav, n)) {
                p.is_told = true;
            }
            let looks = looks_name(truth[n].kind);
            found.broken("detect-missed", now_ms, Some(uav), || {
                format!(
                    "had vehicle {n}, a {looks}, in its picture for {} s by {due_ms} ms, which its mission looks for, and nobody told of it",
                    LONG_MS / 1000
                )
            });
        }
    }

    /// Two who follow one vehicle for two tasks.
    fn find_twice(
        &mut self,
        now_ms: u64,
        (truth, looks): (&[Truth], &[Look]),
        around: Around<'_>,
        found: &mut Findings,
    ) {
        let follow = |l: &Look| {
            let task = l.says.filter(|s| s.sees)?.task;
            Some((l.uav, task, meant(l, truth)?))
        };
        let all: Vec<(u16, TaskId, usize)> = looks.iter().filter_map(follow).collect();
        let is_seen = |id: TaskId| {
            self.told
                .keys()
                .any(|k| (k.0, k.1) == (id.author, id.number))
        };
        let mut now = BTreeSet::new();
        let pairs = all.iter().enumerate();
        for (a, b) in pairs.flat_map(|(i, a)| all[i + 1..].iter().map(move |b| (a, b))) {
            let one = a.2 == b.2 && a.1 != b.1 && (is_seen(a.1) || is_seen(b.1));
            if !one || !around.graph.joined(a.0, b.0) {
                continue;
            }
            let key = (a.0, b.0, a.2);
            now.insert(key);
            if around.has_gone_on(&mut self.twice, key, a.0, (now_ms, 0)) {
                found.broken("detect-twice", now_ms, Some(b.0), || {
                    format!(
                        "follows vehicle {} for the task {}.{} as uav{} does for {}.{}",
                        b.2, b.1.author, b.1.number, a.0, a.1.author, a.1.number
                    )
                });
            }
        }
        self.twice.retain(|k| now.contains(k));
    }

    /// Who follows what services on the ground have reached.
    fn find_kept(&mut self, now_ms: u64, looks: &[Look], around: Around<'_>, found: &mut Findings) {
        let mut now = BTreeSet::new();
        for look in looks {
            let Some(task) = look.says.map(|s| (s.task, s.revision)) else {
                continue;
            };
            let said = self.served.get(&task);
            let Some((served_ms, _)) = said.filter(|(_, by)| around.graph.joined(look.uav, *by))
            else {
                continue;
            };
            let key = (look.uav, task);
            now.insert(key);
            if around.has_gone_on(&mut self.kept, key, look.uav, (now_ms, *served_ms)) {
                found.broken("detect-served", now_ms, Some(look.uav), || {
                    format!(
                        "follows for the task {}.{} what services on the ground reached at {served_ms} ms",
                        task.0.author, task.0.number
                    )
                });
            }
        }
        self.kept.retain(|k| now.contains(k));
    }

    /// For how long what was told is followed and in sight.
    fn note_sight(&mut self, (now_ms, passed_ms): (u64, u64), truth: &[Truth], looks: &[Look]) {
        let mut sees: BTreeSet<TaskId> = BTreeSet::new();
        for l in looks {
            if let (Some(says), Some(_)) = (l.says, meant(l, truth)) {
                sees.insert(says.task);
            }
        }
        for task in sees {
            if let Some(t) = self.latest(task) {
                if t.report.followed_ms.is_some() {
                    t.report.sight_ms += passed_ms;
                }
                t.report.followed_ms.get_or_insert(now_ms);
            }
        }
    }
}

/// Which vehicle one means that says that it sees its target.
fn meant(look: &Look, truth: &[Truth]) -> Option<usize> {
    let says = look.says.filter(|s| s.sees)?;
    let told = skein_peer::mission::point_m(says.at_mm);
    let off_m = |n: &usize| {
        truth
            .get(*n)
            .map_or(f64::INFINITY, |v| (v.at - told).norm())
    };
    let seen = look.pictured.iter().copied();
    let nearest = seen.min_by(|a, b| off_m(a).total_cmp(&off_m(b)))?;
    (off_m(&nearest) <= MEANT_M).then_some(nearest)
}

#[cfg(test)]
mod tests;
