//! What a peer says of what it sees, and what it knows of what its mission watches: for whoever
//! judges both beside what is true. No radio carries it; a live trial is told over the stream of
//! the vehicle. A simulated run looks into its peers instead.

use crate::counting::SiteCount;
use crate::gathering::Sector;
use crate::hint::Hint;
use crate::input::AskedTask;
use crate::mission::Mission;
use crate::tasking::{Call, Follows};
use crate::usage::StretchSum;
use crate::wire::count::Count;
use crate::wire::trail::Trail;
use crate::{Incarnation, Peer};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Something that a peer says to who judges it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Witness {
    /// Of its last percept.
    Looked(Box<Looked>),
    /// Of what it knows.
    Known(Box<Known>),
}

/// What a UAV says of its last percept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Looked {
    /// Of when that is, milliseconds of scenario time.
    pub seen_ms: u64,
    /// The life in which it speaks; none while it only listens.
    pub life: Option<Incarnation>,
    /// The life that it is in, whether it speaks or not.
    pub lives_in: Option<Incarnation>,
    /// The revision that it follows.
    pub revision: u32,
    /// How often it speaks, milliseconds.
    pub interval_ms: u64,
    /// Whether it believes the mission to be finished.
    pub is_finished: bool,
    /// Site by site whether it counts there, and what it counted.
    pub counted: Vec<(bool, Count)>,
    /// The places of streets that it watches, by number; none without streets.
    pub streets: Option<BTreeSet<usize>>,
    /// What it saw of an event itself, told or not, by sector.
    pub own_crowd: Vec<(u16, Sector)>,
    /// What it was told of that.
    pub crowd: Vec<(u16, Sector)>,
    /// Whether it flies along a contour that it sees.
    pub traces: bool,
    /// Whom it follows.
    pub follows: Option<Follows>,
}

/// How streets are used, as somebody saw or was told.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StreetsSeen {
    /// By interval and stretch.
    pub stretches: Vec<(u16, u16, StretchSum)>,
    /// How often each turn was taken, by its number.
    pub turns: Vec<(u16, u32)>,
}

/// What a peer knows of what its mission watches.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// When, milliseconds of scenario time.
    pub at_ms: u64,
    /// The life in which it speaks; none while it only listens.
    pub life: Option<Incarnation>,
    /// Whether it is a ground station.
    pub is_ground: bool,
    /// What all together counted at each site.
    pub counts: Vec<SiteCount>,
    /// What it saw itself of streets.
    pub own_streets: Option<StreetsSeen>,
    /// What all together saw of them.
    pub streets: Option<StreetsSeen>,
    /// The ways that its mission asks for.
    pub hints: Vec<Hint>,
    /// What it knows of a contour.
    pub trails: Vec<Trail>,
    /// What it was told of an event, by sector.
    pub crowd: Vec<(u16, Sector)>,
    /// The tasks of its operator.
    pub tasks: Vec<AskedTask>,
    /// What it knows services on the ground to be wanted for.
    pub calls: Vec<Call>,
}

impl Mission {
    /// Whether somebody is to tell what it sees of something: counts, streets, an event, a contour.
    #[must_use]
    pub fn watches(&self) -> bool {
        !self.counts.is_empty() || self.streets.is_some() || self.crowd.is_some() || self.traces()
    }
}

impl Peer {
    /// What it says of its last percept; none where its mission watches nothing and it follows
    /// nobody.
    #[must_use]
    pub fn looked(&self) -> Option<Witness> {
        let looked = self.last_look()?;
        Some(Witness::Looked(Box::new(looked)))
    }

    /// What it knows of what its mission watches, of the tasks of its operator, and of what
    /// services on the ground are wanted for; none where there is none of these.
    #[must_use]
    pub fn known(&self, at_ms: u64) -> Option<Witness> {
        let known = self.all_known(at_ms)?;
        Some(Witness::Known(Box::new(known)))
    }

    fn last_look(&self) -> Option<Looked> {
        let follows = self.follows();
        if !self.followed()?.watches() && follows.is_none() {
            return None;
        }
        let beliefs = self.beliefs();
        Some(Looked {
            seen_ms: self.sensed_ms()?,
            life: self.speaks_in(),
            lives_in: self.lives_in(),
            revision: beliefs.revision,
            interval_ms: beliefs.interval_ms,
            is_finished: beliefs.finished,
            counted: self.counted().collect(),
            streets: self.watched_streets().cloned(),
            own_crowd: self.own_crowd().collect(),
            crowd: beliefs.crowd,
            traces: beliefs.traces,
            follows,
        })
    }

    fn all_known(&self, at_ms: u64) -> Option<Known> {
        let tasks = self.operators_tasks().asked;
        let is_ground = self.is_ground_station();
        let mission = self.followed();
        let looks_out = is_ground && mission.is_some_and(|m| !m.detections.is_empty());
        let calls = if looks_out { self.calls() } else { Vec::new() };
        let watches = mission.is_some_and(Mission::watches);
        if !watches && !looks_out && tasks.is_empty() {
            return None;
        }
        let mut known = Known {
            at_ms,
            life: self.speaks_in(),
            is_ground,
            tasks,
            calls,
            ..Known::default()
        };
        if watches {
            let beliefs = self.beliefs();
            known.counts = beliefs.counts;
            known.trails = beliefs.trails.into_iter().map(|(_, t)| t).collect();
            known.crowd = beliefs.crowd;
            known.own_streets = self.own_usages().map(|u| u.seen());
            known.streets = self.usages().map(|u| u.seen());
            known.hints = self.hints();
        }
        Some(known)
    }
}
