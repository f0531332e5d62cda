//! Targets to follow as one peer has them (D2.7 §3.7): after whom its UAV flies, whether it sees
//! it, and what is said of that.
//!
//! | what is known of the target | what is flown | what is said |
//! |---|---|---|
//! | nothing | the circle round the task's place, and from there where most chance of it is soonest looked at | nothing |
//! | where it may be, and that is not near | a circle round that | nothing |
//! | where it may be, and that is near | after it, or where most chance of it is soonest looked at | once it had seen it: it searches |
//! | it is seen | after it | it follows; the first time the task is begun |
//! | it is beyond the reach of the mission | at the edge of that | as above |
//!
//! Several tasks of one author with one place are of one target: as many UAVs stay with it, and
//! all that is known and said of it goes by the first of these tasks.

use super::Tasking;
use crate::input::Time;
use crate::mission::{Mission, mm, point_m};
use crate::mission_state::MissionState;
use crate::output::TaskNews;
use crate::targets::{Followed, Sought};
use crate::wire::tasks::{Task, TaskId, TaskKind, TaskPlace};
use serde::{Deserialize, Serialize};
use skein_behaviors::Percept;
use skein_behaviors::executive::pursuit::Quarry;
use skein_flight::airframe::Airframe;
use skein_flight::tracking::follower::TargetMotion;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::seconds;

/// Own sightings this recent are sight, milliseconds: ten looks.
const SEEN_MS: u64 = 2_000;

/// Who has not seen it for so long says that it searches, milliseconds.
const SEARCHES_MS: u64 = 5_000;

/// Nearer than this to where the target may be it is flown after, metres; from farther away a
/// way round the zones is planned.
const NEAR_M: f64 = 250.0;

/// Nobody searches farther outside of the box of the area than this, metres: as far as a car
/// is that turns round at its edge.
const AROUND_M: f64 = 100.0;

/// The stand-off, as a share of how far the camera sees to either side: what is asked for if
/// nothing is, and the most.
const STAND_OFF: f64 = 0.5;
const STAND_OFF_MOST: f64 = 0.75;

/// A UAV says that it follows a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Follows {
    /// For which task.
    pub task: TaskId,
    /// In which revision.
    pub revision: u32,
    /// Where it takes the target to be, mm from the origin.
    pub at_mm: (i32, i32),
    /// Whether it says that it sees it; else it searches.
    pub sees: bool,
    /// How far from it it means to stay, mm.
    pub stand_off_mm: u32,
}

/// What was said of sight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Sight {
    /// By which task its target goes.
    pub of: Option<Sought>,
    /// Whether it was said that it follows, and not since that it searches.
    pub follows: bool,
}

impl Task {
    /// How far from its target a UAV is to stay, metres, which sees so far to either side.
    #[must_use]
    pub(crate) fn stand_off_m(&self, airframe: &Airframe) -> f64 {
        let across_m = airframe.footprint_across_m;
        let asked_m = match self.radius_mm {
            0 => STAND_OFF * across_m,
            mm => f64::from(mm) / 1000.0,
        };
        asked_m.min(STAND_OFF_MOST * across_m)
    }

    fn place(&self) -> Option<Point> {
        let place = self.places.first()?;
        Some(point_m((place.east_mm, place.north_mm)))
    }
}

/// The target as it may be followed: no farther from the base than anybody may fly.
fn within_reach(motion: TargetMotion, mission: &Mission) -> TargetMotion {
    let (base, reach_m) = (mission.base_m(), mission.reach_m());
    let out = motion.position - base;
    if out.norm() <= reach_m {
        return motion;
    }
    TargetMotion {
        position: base + out * (reach_m / out.norm()),
        velocity_mps: Vector::zeros(),
        acceleration_mps2: Vector::zeros(),
    }
}

/// The box that is searched: that of the area, and a little around it.
fn searched(mission: &Mission) -> (Point, Point) {
    let corners = mission.area_m();
    let first = corners.first().copied().unwrap_or_else(|| mission.base_m());
    let (low, high) = corners.iter().fold((first, first), |(low, high), p| {
        (
            Point::new(low.x.min(p.x), low.y.min(p.y)),
            Point::new(high.x.max(p.x), high.y.max(p.y)),
        )
    });
    let around = Vector::new(AROUND_M, AROUND_M);
    (low - around, high + around)
}

impl Tasking {
    /// The target that is flown after, if it is one: the task in its revision.
    pub(super) fn sought(&self) -> Option<Sought> {
        let flown = self.flown.as_ref()?;
        let task = &self.known.get(&flown.id)?.task;
        let tracks = task.kind == TaskKind::Track;
        tracks.then(|| self.first_of((flown.id, flown.revision), task))
    }

    /// Tasks of one author to follow what is at one place are of one target: it goes by the
    /// first of them that is open.
    fn first_of(&self, own: Sought, task: &Task) -> Sought {
        let author = own.0.author;
        let from = TaskId { author, number: 0 };
        let mut before = self.known.range(from..own.0).filter(|(_, k)| {
            k.is_open() && k.task.kind == TaskKind::Track && k.task.places == task.places
        });
        before.next().map_or(own, |(id, k)| (*id, k.task.revision))
    }

    /// Whether somebody is to be followed.
    fn is_tracking(&self) -> bool {
        let mut open = self.known.values().filter(|k| k.is_open());
        open.any(|k| k.task.kind == TaskKind::Track)
    }

    /// A percept: what the camera saw, and where whom it follows is. Whether its goal changed.
    pub fn look(&mut self, now: Time, percept: &Percept, state: &mut MissionState) -> bool {
        self.targets.knows(state.geometry.town.as_ref());
        self.targets.on_percept(percept);
        if !state.geometry.mission.detections.is_empty() && !percept.sightings.is_absent() {
            let (tracks, now_ms) = self.targets.tracks();
            self.detections.watch(now_ms, tracks);
        }
        self.count(percept, state);
        self.gather(percept, state);
        let (Some(sought), Some(airframe)) = (self.sought(), self.flies) else {
            return false;
        };
        if let Some(held) = self.flown.as_mut().and_then(|f| f.held.as_mut()) {
            // The first task of its target was heard of since, or is over.
            let before = held.sight.of.replace(sought).filter(|b| *b != sought);
            if let Some(before) = before {
                self.targets.goes_by(before, sought);
            }
        }
        let Some(known) = self.known.get(&sought.0) else {
            return false;
        };
        let stand_off_m = known.task.stand_off_m(&airframe);
        let (Some(place), asked_s) = (known.task.place(), seconds(now.since_ms(known.since)))
        else {
            return false;
        };
        let followed = self.targets.follow(sought, place, asked_s);
        let sees = self
            .targets
            .unseen_ms(sought)
            .is_some_and(|ms| ms <= SEEN_MS);
        let (Some(executive), Some(relay)) = (&mut state.executive, &mut state.relay) else {
            return false;
        };
        if self.flown.as_ref().is_none_or(|f| f.held.is_none()) {
            return false;
        }
        let mission = &state.geometry.mission;
        let followed = followed.unwrap_or_else(|| Followed::nowhere(place));
        let motion = if followed.is_lost() {
            let (base, reach_m) = (mission.base_m(), mission.reach_m());
            let (low, high) = searched(mission);
            let may_fly = |p: Point| {
                let near = (p - followed.motion.position).norm() <= NEAR_M;
                let inside = low.x <= p.x && p.x <= high.x && low.y <= p.y && p.y <= high.y;
                (near || inside) && (p - base).norm() <= reach_m
            };
            let looked_for = (sought, place, asked_s);
            let next = self
                .targets
                .look_for(looked_for, percept, &mission.task, &may_fly);
            next.unwrap_or(followed.motion)
        } else {
            self.targets.end_search();
            followed.motion
        };
        let motion = within_reach(motion, mission);
        let away_m = (motion.position - percept.pose.position()).norm();
        let is_near = relay.follow.is_some() || away_m <= NEAR_M || executive.is_on_circle();
        let follow = (sees || is_near).then_some(stand_off_m);
        executive.pursue_at(Some(Quarry {
            at_ms: percept.time_ms,
            motion,
        }));
        let changed = relay.follow != follow;
        relay.follow = follow;
        changed
    }

    /// What is to be said of sight, and whether the task is begun by it.
    pub(super) fn watch_sight(&mut self) -> (Option<TaskNews>, bool) {
        let Some(sought) = self.sought() else {
            return (None, false);
        };
        let unseen_ms = self.targets.unseen_ms(sought);
        let Some(held) = self.flown.as_mut().and_then(|f| f.held.as_mut()) else {
            return (None, false);
        };
        let sees = unseen_ms.is_some_and(|ms| ms <= SEEN_MS);
        let has_lost = unseen_ms.is_none_or(|ms| ms > SEARCHES_MS);
        if sees && !held.sight.follows {
            held.sight.follows = true;
            return (Some(TaskNews::Follows), true);
        }
        if has_lost && held.sight.follows {
            held.sight.follows = false;
            return (Some(TaskNews::Searches), false);
        }
        (None, false)
    }

    /// Whether it had its target in sight, and said that it searches for it.
    pub(super) fn has_lost(&self) -> bool {
        let held = self.flown.as_ref().and_then(|f| f.held.as_ref());
        self.sought().is_some() && held.is_some_and(|h| h.has_begun && !h.sight.follows)
    }

    /// What it says of whom it follows, once it had seen it.
    pub(crate) fn follows(&self) -> Option<Follows> {
        let sought = self.sought()?;
        let held = self.flown.as_ref()?.held.as_ref()?;
        let known: Followed = self.targets.known(sought).filter(|_| held.has_begun)?;
        let task = &self.known.get(&sought.0)?.task;
        let stand_off_m = task.stand_off_m(&self.flies?);
        Some(Follows {
            task: sought.0,
            revision: sought.1,
            at_mm: (mm(known.motion.position.x), mm(known.motion.position.y)),
            sees: held.sight.follows,
            stand_off_mm: mm(stand_off_m).unsigned_abs(),
        })
    }

    /// What is said of targets, while somebody is to be followed.
    pub(super) fn tell_of_targets(
        &mut self,
        s: &crate::cooperation::Situation<'_>,
    ) -> crate::effect::Effects {
        if !s.speaks || !self.is_tracking() {
            return Vec::new();
        }
        let serves = self.sought();
        self.targets.tell(s.now, s.membership.interval_ms(), serves)
    }

    /// The task as it is flown to: a target at the place where it is by now, as far as is known.
    pub(super) fn as_flown(&self, sought: Sought, task: &Task, mission: &Mission) -> Task {
        if task.kind != TaskKind::Track {
            return task.clone();
        }
        let Some(known) = self.targets.known(self.first_of(sought, task)) else {
            return task.clone();
        };
        let at = within_reach(known.motion, mission).position;
        Task {
            places: vec![TaskPlace {
                east_mm: mm(at.x),
                north_mm: mm(at.y),
            }],
            ..task.clone()
        }
    }
}
