//! What peers of a live trial say of what they see, beside what was true when they saw it: the
//! rules of a simulated run on counts, streets, events, contours and targets, for peers into which
//! nobody can look (D2.7 §3.1).
//!
//! A peer answers a percept some steps of the world after it was sensed, so what was true then is
//! kept until its answer is here, or does not come any more; looks are judged in the order of
//! their times.

use crate::check::Findings;
use crate::check::Handicaps;
use crate::check::contours::{ContourCheck, ContourReport, Tracer};
use crate::check::counts::{CountCheck, CountLook, CountReport};
use crate::check::crowds::{CrowdCheck, CrowdGlance, CrowdReport};
use crate::check::flight::Flyer;
use crate::check::rules::flyer;
use crate::check::streets::{StreetCheck, StreetLook, StreetsReport};
use crate::check::tracks::{Look, TrackCheck, Tracked};
use crate::spec::Spec;
use crate::world::World;
use crate::world::camera::Picture;
use crate::world::obstacles::Place;
use skein_flight::coverage::ring::patch::Corners;
use skein_flight::tracing::outline::Stretch;
use skein_geometry::frame::Point;
use skein_peer::Mission;
use skein_peer::gathering::CrowdAlert;
use skein_peer::input::AskedTask;
use skein_peer::wire::tasks::TaskState;
use skein_peer::wire::trail::Trail;
use skein_peer::witness::{Known, Looked};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// An answer that has not come for so long does not come any more, milliseconds.
const ANSWERED_MS: u64 = 2_000;

/// Who has said nothing for so long says nothing, milliseconds.
const SILENT_MS: u64 = 2_000;

/// Targets and contours are looked at so often, milliseconds, as in a simulated run.
const LOOKED_MS: u64 = 1_000;

/// What was true when a UAV sensed.
#[derive(Clone, Debug)]
struct Moment {
    picture: Picture,
    eye: Place,
    vehicles: Arc<Vec<Point>>,
    /// Whether a recogniser of people looked.
    looks: bool,
}

/// Something that waits until all before it is judged.
#[derive(Clone, Debug)]
enum Waiting {
    Look(Moment, Option<Box<Looked>>),
    Known(Box<Known>),
}

/// What peers of one trial say of what they see.
#[derive(Clone, Debug)]
pub struct Witnessed {
    revision: u32,
    watches: bool,
    counts: CountCheck,
    streets: StreetCheck,
    crowds: CrowdCheck,
    contours: ContourCheck,
    tracks: TrackCheck,
    flyers: BTreeMap<u16, Flyer>,
    found: Findings,
    /// By time, by UAV, looks before what is known.
    waiting: BTreeMap<(u64, u16, bool), Waiting>,
    latest: BTreeMap<u16, Looked>,
    known: BTreeMap<u16, Known>,
    vehicles: (u64, Arc<Vec<Point>>),
    looked_ms: u64,
}

impl Witnessed {
    /// Nothing was said of this mission.
    #[must_use]
    pub fn new(spec: &Spec, mission: &Mission) -> Self {
        let mut new = Self {
            revision: 0,
            watches: false,
            counts: CountCheck::default(),
            streets: StreetCheck::default(),
            crowds: CrowdCheck::default(),
            contours: ContourCheck::default(),
            tracks: TrackCheck::default(),
            flyers: spec.uavs.iter().map(|u| (u.id, flyer(u, spec))).collect(),
            found: Findings::new(0),
            waiting: BTreeMap::new(),
            latest: BTreeMap::new(),
            known: BTreeMap::new(),
            vehicles: (0, Arc::default()),
            looked_ms: 0,
        };
        new.given(mission);
        new
    }

    /// The operator has a mission.
    pub fn given(&mut self, mission: &Mission) {
        self.revision = mission.revision;
        self.watches = mission.watches();
        self.counts.on_mission(mission);
        self.streets.on_mission(mission);
        self.crowds.on_mission(mission);
    }

    /// The ground station holds a task, or the mission brings it.
    pub fn asked(&mut self, asked: &AskedTask) {
        self.tracks.on_asked(asked);
    }

    /// A UAV is given a percept: what it sees then is kept.
    pub fn sensed(&mut self, now_ms: u64, uav: u16, world: &World) {
        let (Some(body), Some(eye)) = (world.body(uav), world.eye_of(uav)) else {
            return;
        };
        if !self.watches {
            return;
        }
        if self.vehicles.0 != now_ms {
            self.vehicles = (now_ms, Arc::new(world.vehicles().places().collect()));
        }
        let is_up = body.takes_off_in_ms(now_ms) == 0;
        let moment = Moment {
            picture: body.picture(),
            eye,
            vehicles: Arc::clone(&self.vehicles.1),
            looks: is_up && world.crowd().is_some_and(|c| c.looks_at(now_ms)),
        };
        let waits = Waiting::Look(moment, None);
        self.waiting.insert((now_ms, uav, false), waits);
    }

    /// A UAV says what it saw.
    pub fn looked(&mut self, uav: u16, said: Looked) {
        let key = (said.seen_ms, uav, false);
        if let Some(Waiting::Look(_, answer)) = self.waiting.get_mut(&key) {
            *answer = Some(Box::new(said.clone()));
        }
        let newer = self.latest.get(&uav);
        if newer.is_none_or(|before| before.seen_ms <= said.seen_ms) {
            self.latest.insert(uav, said);
        }
    }

    /// A peer says what it knows.
    pub fn knows(&mut self, peer: u16, known: Known) {
        let key = (known.at_ms, peer, true);
        self.waiting.insert(key, Waiting::Known(Box::new(known)));
    }

    /// A peer tells people that a sector became too dense, or has eased.
    pub fn alerted(&mut self, at: (u64, u16, bool), told: &CrowdAlert) {
        self.crowds.on_told(at, told, &mut self.found);
    }

    /// The world made a step.
    pub fn stepped(&mut self, now_ms: u64, world: &World) {
        if let Some(people) = world.crowd() {
            self.crowds.on_people(people);
        }
        self.judge_waiting(now_ms, false, world);
        if now_ms >= self.looked_ms + LOOKED_MS {
            self.looked_ms = now_ms;
            self.look_at_targets(now_ms, world);
            self.look_at_contour(now_ms, world);
        }
    }

    /// Judges in the order of their times what was answered, and what is not answered any more.
    fn judge_waiting(&mut self, now_ms: u64, is_over: bool, world: &World) {
        while let Some(first) = self.waiting.first_entry() {
            let (at_ms, peer, _) = *first.key();
            let is_open = matches!(first.get(), Waiting::Look(_, None));
            if is_open && !is_over && now_ms < at_ms + ANSWERED_MS {
                return;
            }
            match first.remove() {
                Waiting::Look(moment, Some(said)) => {
                    self.judge((at_ms, peer), &moment, &said, world)
                }
                Waiting::Look(_, None) => {}
                Waiting::Known(known) => self.judge_known(peer, *known),
            }
        }
    }

    fn judge(&mut self, (at_ms, uav): (u64, u16), m: &Moment, said: &Looked, world: &World) {
        let flies = |l: &&Looked| {
            let is_newest = l.revision >= self.revision;
            is_of_late(l, at_ms) && l.life.is_some() && is_newest && !l.is_finished
        };
        let able = || self.latest.iter().filter(|(_, l)| flies(l));
        let ids: BTreeSet<u16> = able().map(|(id, _)| *id).collect();
        let intervals = able().map(|(id, l)| (*id, l.interval_ms)).collect();
        if !self.counts.is_idle() {
            self.counts.on_able(ids.clone());
            let look = CountLook {
                uav,
                picture: m.picture,
                is_late: false,
                sees: &|at: Point| world.is_open_from(m.eye, at),
                displaced_m: world.vehicles().displaced_m(uav),
                counted: &said.counted,
            };
            let found = &mut self.found;
            self.counts.on_look(at_ms, &m.vehicles, look, found);
        }
        if let (Some(watched), Some(life)) = (&said.streets, said.lives_in) {
            self.streets.on_able(ids);
            let look = StreetLook {
                uav: (uav, life),
                picture: m.picture,
                displaced_m: world.vehicles().displaced_m(uav),
                is_late: false,
                sees: &|at: Point| world.is_open_from(m.eye, at),
                watched,
            };
            let found = &mut self.found;
            self.streets.on_look(at_ms, &m.vehicles, look, found);
        }
        if let (Some(known), Some(life)) = (self.crowds.crowd_of(&said.crowd), said.life) {
            self.crowds.on_able(intervals);
            self.crowds.on_known(&said.crowd);
            if world.crowd().is_some_and(|c| c.looks_at(at_ms)) {
                let look = CrowdGlance {
                    uav: (uav, life),
                    picture: m.picture,
                    is_late: false,
                    looks: m.looks,
                    sees: &|at: Point| world.is_open_from(m.eye, at),
                    own: &said.own_crowd,
                    known: &known,
                };
                self.crowds.on_look(at_ms, look, &mut self.found);
            }
        }
    }

    fn judge_known(&mut self, peer: u16, known: Known) {
        let own = known.own_streets.as_ref();
        if let (Some(own), Some(life)) = (own.and_then(|s| self.streets.usages_of(s)), known.life) {
            self.streets.on_own((peer, life), own);
        }
        self.crowds.on_known(&known.crowd);
        if known.is_ground {
            self.crowds.on_ground(known.at_ms, &known.crowd);
        }
        self.known.insert(peer, known);
    }

    /// Who said something of late.
    fn says(&self, uav: u16, now_ms: u64) -> Option<&Looked> {
        let said = self.latest.get(&uav);
        said.filter(|l| is_of_late(l, now_ms))
    }

    /// Who says that it follows somebody is looked at beside where vehicles are.
    fn look_at_targets(&mut self, now_ms: u64, world: &World) {
        if world.vehicles().is_empty() {
            return;
        }
        let look = |uav: u16| Look {
            uav,
            at: world.eye_of(uav).map(|eye| eye.at),
            since_ms: 0,
            says: self.says(uav, now_ms).and_then(|l| l.follows),
            pictured: world.pictured(uav).collect(),
        };
        let looks: Vec<Look> = self.flyers.keys().map(|id| look(*id)).collect();
        let truth: Vec<Point> = world.vehicles().places().collect();
        let found = &mut self.found;
        self.tracks.on_looks(now_ms, &truth, &looks, found);
    }

    /// Who says that it flies along a contour is looked at beside where that is.
    fn look_at_contour(&mut self, now_ms: u64, world: &World) {
        let Some(contour) = world.contour().filter(|_| self.watches) else {
            return;
        };
        let tracer = |uav: u16| {
            let says = self.says(uav, now_ms);
            let traces = says.is_some_and(|l| l.life.is_some() && l.traces);
            Tracer {
                uav,
                is_to: traces,
                says: traces,
                pictured: world.contour_pictured(uav),
            }
        };
        let all: Vec<Tracer> = self.flyers.keys().map(|id| tracer(*id)).collect();
        let around = (&self.flyers, &Handicaps::default());
        let found = &mut self.found;
        self.contours.on_looks(now_ms, contour, &all, around, found);
        if !self.contours.is_due(now_ms) {
            return;
        }
        let known = self.best_known(|_| 0);
        let told = known.map(|(peer, k)| (*peer, k.trails.iter().map(Trail::stretch).collect()));
        if let Some((peer, all)) = told {
            let all: Vec<Stretch> = all;
            let found = &mut self.found;
            self.contours.on_told(now_ms, contour, (peer, &all), found);
        }
    }

    /// The ground station, or who knows most where there is none.
    fn best_known(&self, of: impl Fn(&Known) -> u64) -> Option<(&u16, &Known)> {
        let most = |(_, k): &(&u16, &Known)| (k.is_ground, of(k));
        self.known.iter().max_by_key(most)
    }

    /// The run is over.
    pub fn end(&mut self, now_ms: u64, world: &World) {
        self.judge_waiting(now_ms, true, world);
        self.counts.on_end(now_ms, &mut self.found);
        let watched_m_s = |k: &Known| {
            let all = k.streets.iter().flat_map(|s| &s.stretches);
            all.map(|(_, _, sum)| sum.watched_m_s).sum()
        };
        let best = self.best_known(watched_m_s).map(|(_, k)| k);
        let seen = best.and_then(|k| Some((k.streets.as_ref()?, k.hints.clone())));
        let known = seen.and_then(|(s, hints)| Some((self.streets.usages_of(s)?, hints)));
        if let Some((usages, hints)) = known {
            let found = &mut self.found;
            self.streets.on_known(now_ms, usages, &hints, found);
        }
        self.streets.on_end(now_ms, &mut self.found);
        self.crowds.on_end(now_ms, &mut self.found);
    }

    /// Rules that were broken since this was asked last, each in a sentence.
    pub fn broken(&mut self) -> Vec<String> {
        let fresh = self.found.drain_fresh();
        fresh.iter().map(ToString::to_string).collect()
    }

    /// What is known of counts, beside what is true.
    #[must_use]
    pub fn counts(&self, now_ms: u64) -> Vec<CountReport> {
        let watched_ms = |k: &Known| k.counts.iter().map(|c| c.watched_ms).sum();
        let best = self.best_known(watched_ms);
        let known = best.map_or(&[][..], |(_, k)| &k.counts[..]);
        self.counts.reports(now_ms, known)
    }

    /// How streets are used, beside what is true.
    #[must_use]
    pub fn streets(&self) -> Option<StreetsReport> {
        self.streets.report()
    }

    /// What was told of an event, beside what is true.
    #[must_use]
    pub fn crowd(&self) -> Option<CrowdReport> {
        self.crowds.report()
    }

    /// What was told of a contour, beside where it is.
    #[must_use]
    pub fn contour(&self) -> Option<ContourReport> {
        self.contours.report()
    }

    /// What came of targets, by number and revision.
    pub fn tracked(&self) -> impl Iterator<Item = ((u16, u32), &Tracked)> {
        self.tracks.tracked()
    }
}

fn is_of_late(said: &Looked, now_ms: u64) -> bool {
    said.seen_ms + SILENT_MS >= now_ms
}

/// What the judge of a world is told of a task.
#[derive(Clone, Debug, PartialEq)]
pub struct AskedLook {
    /// Its number and revision.
    pub task: (u16, u32),
    /// What is to be seen.
    pub pieces: Vec<Corners>,
    /// Who can.
    pub carriers: BTreeSet<u16>,
}

impl AskedLook {
    /// Of a task that somebody asks for, or that was done before anybody told of it; none of one
    /// that is over without.
    #[must_use]
    pub fn of(spec: &Spec, mission: &Mission, asked: &AskedTask) -> Option<Self> {
        let is_wanted = matches!(asked.task.state, TaskState::Open | TaskState::Done);
        is_wanted.then(|| {
            let needed = asked.task.sensor;
            let carriers = spec.uavs.iter().filter(|u| u.carries(needed));
            Self {
                task: (asked.number, asked.task.revision_as_asked()),
                pieces: mission.pieces_of(&asked.task).unwrap_or_default(),
                carriers: carriers.map(|u| u.id).collect(),
            }
        })
    }
}

#[cfg(test)]
mod tests;
