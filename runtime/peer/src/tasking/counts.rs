//! When a UAV counts at the sites of its mission and on its streets, and when it tells of that
//! (D2.7 §3.1). What counts is [`crate::counting`]'s and [`crate::usage`]'s.
//!
//! | what holds | it counts |
//! |---|---|
//! | its mission has sites or streets, and is not over for it | in each look |
//! | the mission is over or cancelled, or another process speaks under its id | no more; what it counted it tells |

use super::Tasking;
use crate::Mission;
use crate::cooperation::Situation;
use crate::counting::{SiteCount, flown_on};
use crate::effect::Effects;
use crate::mission_state::MissionState;
use crate::wire::count::Count;
use skein_behaviors::Percept;
use skein_geometry::frame::Pose;

impl Tasking {
    /// A look at the sites.
    pub(super) fn count(&mut self, percept: &Percept, state: &MissionState) {
        let mission = &state.geometry.mission;
        let Some(airframe) = self.flies.filter(|_| !percept.sightings.is_absent()) else {
            return;
        };
        let counts = !mission.cancelled && !state.silent && !state.stage.ended();
        let (tracks, _) = self.targets.tracks();
        let of = (mission.as_ref(), state.geometry.town.as_deref(), counts);
        if !mission.counts.is_empty() {
            self.counting.look(percept, &airframe, tracks, of);
        }
        self.using.look(percept, &airframe, tracks, of);
    }

    /// Heeds who else is above the sites, and tells what is to be told.
    pub(super) fn tell_of_counts(&mut self, s: &Situation<'_>, state: &MissionState) -> Effects {
        let mission = &state.geometry.mission;
        let is_idle = mission.counts.is_empty() && mission.measured_streets().is_none();
        let Some(airframe) = self.flies.filter(|_| !is_idle) else {
            return Effects::new();
        };
        let lower = s.membership.live().filter(|(id, _)| *id < self.me);
        let place = |(id, _)| {
            let info = s.membership.info(id).filter(|i| !i.ground_station)?;
            let age_ms = s.now.since_ms(info.heard?);
            Some((info.place?.pose(), age_ms))
        };
        let others: Vec<(Pose, u64)> = lower.filter_map(place).collect();
        let interval_ms = s.membership.interval_ms();
        let others = flown_on(&others, interval_ms, &airframe);
        self.counting.heed(others.clone());
        self.using.heed(others);
        if !s.speaks {
            return Effects::new();
        }
        let mut effects = self.counting.tell(s.now, interval_ms);
        let counts = !mission.cancelled && !state.stage.ended();
        let air = (interval_ms, 1 + s.membership.live_uavs().count() as u64);
        effects.extend(self.using.tell(s.now, air, counts));
        effects
    }

    /// What all together counted at each site of the mission, as far as is known here.
    pub fn counts(&self, mission: &Mission) -> Vec<SiteCount> {
        if mission.counts.is_empty() {
            return Vec::new();
        }
        self.counting.sums(mission)
    }

    /// What this UAV counted itself, site by site, and whether it does so
    /// in the percept of this time.
    pub fn counted(&self, percept_ms: u64) -> impl Iterator<Item = (bool, Count)> {
        self.counting.own(percept_ms)
    }
}
