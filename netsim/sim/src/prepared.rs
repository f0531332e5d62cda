//! What all runs of one scenario share, prepared once: the surveyed site and the
//! geometry of its mission.

use crate::account::Setting;
use crate::fault::{Fault, TimedFault};
use crate::geometry_cache::GeometryCache;
use crate::spec::{Spec, UavSpec};
use crate::world::Site;
use skein_peer::offload::MissionGeometry;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A scenario, ready to run with any seed and any faults. Cheap to clone and to share.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The scenario.
    pub spec: Arc<Spec>,
    /// Its buildings and cells.
    pub site: Arc<Site>,
    /// The loop and the router of its mission.
    pub geometry_cache: GeometryCache,
    setting: Setting,
}

impl Prepared {
    /// Surveys the site and derives the loop.
    #[must_use]
    pub fn new(spec: Spec) -> Self {
        Self::on(spec, GeometryCache::default())
    }

    /// Surveys the site; the geometry of the mission has been derived before.
    #[must_use]
    pub fn with_geometry(spec: Spec, geometry: Arc<MissionGeometry>) -> Self {
        let geometry_cache = GeometryCache::holding(&spec.mission, geometry);
        Self::on(spec, geometry_cache)
    }

    fn on(spec: Spec, mut geometry_cache: GeometryCache) -> Self {
        // A mission without a loop is found out by every run; here it is only remembered.
        let geometry = geometry_cache.of(&spec.mission).ok();
        let site = Arc::new(Site::new(&spec, geometry.as_deref()));
        let spec = Arc::new(spec);
        Self {
            setting: Setting::new(&spec, geometry.as_ref(), spec.seed),
            spec,
            site,
            geometry_cache,
        }
    }

    /// The same with other UAVs.
    #[must_use]
    pub fn with_uavs(&self, uavs: Vec<UavSpec>) -> Self {
        if uavs == self.spec.uavs {
            return self.clone();
        }
        let spec = Spec {
            uavs,
            ..(*self.spec).clone()
        };
        let geometry = self.geometry_cache.clone().of(&spec.mission).ok();
        Self {
            setting: Setting::new(&spec, geometry.as_ref(), spec.seed),
            spec: Arc::new(spec),
            ..self.clone()
        }
    }

    /// The same with a number that is free for each twin that these faults switch on, and with
    /// a body like that of the UAV as which it was configured, unless it is aboard of that one.
    #[must_use]
    pub fn with_twins(&self, faults: &[TimedFault]) -> Self {
        let mut uavs = self.spec.uavs.clone();
        let mut taken: BTreeSet<u16> = uavs.iter().map(|u| u.id).collect();
        taken.extend(self.spec.ground.iter().map(|g| g.id));
        for fault in faults {
            let Fault::Twin { peer, aboard } = fault.fault else {
                continue;
            };
            let like = uavs.iter().find(|u| u.id == peer && u.twin_of.is_none());
            let free = (1..=u16::MAX).find(|id| !taken.contains(id));
            if let (Some(like), Some(id)) = (like.cloned(), free) {
                taken.insert(id);
                uavs.push(UavSpec {
                    id,
                    twin_of: Some(peer),
                    aboard,
                    takeoff_ms: 0,
                    ..like
                });
            }
        }
        uavs.sort_by_key(|u| u.id);
        self.with_uavs(uavs)
    }

    /// What the account of a run with this seed must know.
    #[must_use]
    pub fn setting(&self, seed: u64) -> Setting {
        Setting {
            seed,
            ..self.setting.clone()
        }
    }
}
