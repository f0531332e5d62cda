//! How the streets of a mission are used, as a peer is asked for it (D2.7 §3.1). What it sees of
//! that is [`crate::usage`]'s, and when it looks [`super::counts`]'.

use super::Tasking;
use crate::Mission;
use crate::hint::Hint;
use crate::mission::point_m;
use crate::usage::Usages;
use skein_geometry::frame::Point;
use std::collections::BTreeSet;

impl Tasking {
    /// What all together saw of the streets of a mission, as far as is known here; none without
    /// streets.
    pub fn usages(&self, mission: &Mission) -> Option<Usages> {
        self.using.sums(mission)
    }

    /// What this UAV saw itself of the streets that it follows.
    pub fn own_usages(&self) -> Option<Usages> {
        self.using.own()
    }

    /// The places of the streets that it watches in the percept of this time.
    pub fn watched(&self, percept_ms: u64) -> Option<&BTreeSet<usize>> {
        self.using.watched(percept_ms)
    }

    /// The quickest ways that a mission asks for, and from its station to all that was detected.
    pub fn hints(&self, mission: &Mission) -> Vec<Hint> {
        let Some(usages) = self.usages(mission) else {
            return Vec::new();
        };
        let streets = usages.streets();
        let asked = streets.asked.iter().filter_map(|asked| {
            let (from, to) = (point_m(asked.from), point_m(asked.to));
            usages.hint(&asked.name, from, to)
        });
        let seen = self.detections.known().filter_map(|(id, seen)| {
            let to: Point = seen.at();
            let name = format!("to the object {}.{}", id.author, id.number);
            usages.hint(&name, point_m(streets.station?), to)
        });
        asked.chain(seen).collect()
    }
}
