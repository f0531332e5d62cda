//! By which mission a simulated swarm is judged: the operator's, with zones round what UAVs found
//! on no map, and of several that were found at one time that which is begun last.

use super::Swarm;
use crate::geometry_cache::GeometryCache;
use crate::world::Survey;
use skein_peer::Mission;
use skein_peer::offload::MissionGeometry;
use std::sync::Arc;

impl Swarm {
    /// A peer begins a mission, or a lap of one.
    pub(super) fn mission_begun(&mut self, revision: u32, loop_hash: u64) {
        let finds = self.operator.mission().finds_obstacles;
        let is_beside = finds && !self.is_judged_by(revision, loop_hash);
        if is_beside {
            let cache = &mut self.geometry_cache;
            // What others found at the same time has the same number.
            let is_flown = |m: &&Arc<Mission>| is_loop_of(cache, m, revision, loop_hash);
            let other = self.operator.found_beside().find(is_flown).cloned();
            let Some(other) = other else {
                return;
            };
            self.judge_by_found(&other);
            if !self.is_judged_by(revision, loop_hash) {
                return;
            }
        }
        let given = self.operator.mission();
        let (cache, air) = (&mut self.geometry_cache, &self.air);
        let given = (given, is_beside);
        if self.judged.begin(given, revision, loop_hash, (cache, air)) {
            self.checker.on_new_loop(loop_hash);
        }
    }

    fn is_judged_by(&mut self, revision: u32, loop_hash: u64) -> bool {
        let given = self.operator.mission();
        is_loop_of(&mut self.geometry_cache, given, revision, loop_hash)
    }

    /// A peer knows of obstacles that are on no map: the mission with zones round them is judged by,
    /// and it is what the operator changes next, unless somebody knows of a newer one.
    pub(super) fn obstacles_found(&mut self, mission: &Arc<Mission>) {
        if !self.operator.hears_of(mission) {
            return;
        }
        if mission.revision > self.operator.mission().revision {
            self.judge_by_found(mission);
        } else if let Some((survey, geometry)) = self.surveyed(mission) {
            self.air.follow_beside(survey, &geometry);
            self.ask_for_what_is_left();
        }
    }

    /// Of the operator's newest mission nobody is asked for what obstacles hide that somebody has
    /// found, who may never hear of that mission.
    pub(super) fn ask_for_what_is_left(&mut self) {
        let Some(round_all) = self.operator.round_all_found() else {
            return;
        };
        let newest = Arc::clone(self.operator.mission());
        let left = self.surveyed(&Arc::new(round_all));
        let geometry = self.geometry_cache.of(&newest);
        if let (Some((survey, _)), Ok(geometry)) = (left, geometry) {
            self.air.revise(survey, &geometry);
        }
    }

    /// From now on this is the mission, with zones round what peers found.
    fn judge_by_found(&mut self, mission: &Arc<Mission>) {
        let Some((survey, geometry)) = self.surveyed(mission) else {
            return;
        };
        self.air.revise(survey, &geometry);
        self.account.revised();
        self.operator.give(Arc::clone(mission));
        self.checker.rules.on_mission(mission);
    }

    fn surveyed(&mut self, mission: &Arc<Mission>) -> Option<(Arc<Survey>, Arc<MissionGeometry>)> {
        let survey = Survey::of_mission(&self.spec, mission).ok()?;
        let geometry = self.geometry_cache.of(mission).ok()?;
        Some((Arc::new(survey.as_planned(&geometry)), geometry))
    }
}

/// Whether somebody who follows this mission, or a later lap of it, flies that loop.
fn is_loop_of(
    cache: &mut GeometryCache,
    mission: &Arc<Mission>,
    revision: u32,
    loop_hash: u64,
) -> bool {
    let later = mission.later_lap(revision);
    let lap = later.as_ref().map_or(mission.lap, |m| m.lap);
    let geometry = cache.of(mission).ok();
    (revision == mission.revision || later.is_some())
        && geometry.is_some_and(|g| g.coverage_loop.hash_in_lap(mission.lap, lap) == loop_hash)
}
