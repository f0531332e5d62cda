//! A no-fly zone that comes while the UAV flies is obeyed by what is being flown already
//! (D2.7 §2.3.1): from the moment in which the newer mission is held whole, before its loop
//! and its routes are derived.
//!
//! | the new zones | what follows at once | what is told |
//! |---|---|---|
//! | lie round the UAV | the shortest flyable way out, once routes are there | an alarm |
//! | lie on the track it is committed to | the envelope turns away before them | an alarm with the distance |
//! | lie elsewhere | nothing, until the plan changes with the loop | nothing |

use crate::effect::Effect;
use crate::found_obstacles::zone_round;
use crate::mission::{Mission, point_m};
use crate::mission_state::MissionState;
use crate::wire::obstacle::Found;
use skein_behaviors::executive::new_zones::NewZone;
use skein_behaviors::obstacle::Obstacle;
use skein_geometry::{NoFlyZones, Polygon};

impl MissionState {
    /// A newer mission is held whole: its zones are kept clear of from now on.
    pub fn heed(&mut self, newest: &Mission) -> Option<Effect> {
        let known: Vec<_> = self.geometry.mission.zones_m().collect();
        let new = newest.zones_m().filter(|zone| !known.contains(zone));
        // One that is no polygon makes a mission that nobody flies.
        let new: Vec<Polygon> = new.filter_map(|zone| Polygon::new(zone).ok()).collect();
        if new.is_empty() {
            return None;
        }
        self.heed_zones(new)
    }

    /// What is sensed and is in no zone of the newest mission is kept clear of from now on.
    pub fn heed_obstacles(&mut self, newest: &Mission, sensed: &[Obstacle]) -> Option<Effect> {
        let round = sensed.iter().filter_map(|o| {
            let ring = zone_round(&Found::of(o)).into_iter().map(point_m);
            Polygon::new(ring.collect()).ok()
        });
        let zones = newest.zones_m().filter_map(|zone| Polygon::new(zone).ok());
        let all = zones.chain(round).collect();
        self.heed_zones(all)
    }

    fn heed_zones(&mut self, new: Vec<Polygon>) -> Option<Effect> {
        let executive = self.executive.as_mut()?;
        let new = NoFlyZones::new(new);
        executive.heed(&new);
        let at = executive.place()?;
        Some(Effect::Alarm(match executive.meets(&new, at)? {
            NewZone::Around => "a new no-fly zone lies round this UAV: leaving it".to_owned(),
            NewZone::Ahead(m) => {
                format!("a new no-fly zone lies {m:.0} m ahead on the track: turning away")
            }
        }))
    }
}
