//! No-fly zones, who is bound by them and who enters them (D2.7 §2.3.1).

use super::fact::Fact;
use super::flat::{Bounds, point_ring_m, segment_ring_m};
use super::motion::Piece;
use super::survey::Zone;
use skein_peer::mission::ring_mm;
use std::collections::{BTreeMap, BTreeSet};

/// Arcs are tested as chords no farther than this from them, metres; distances to
/// zones are exact to this much.
const SAGITTA_M: f64 = 0.01;

/// A no-fly zone that a revision added.
#[derive(Clone, Debug)]
struct Added {
    revision: u32,
    zone: Zone,
    /// Who has been told of it and was clear of it since.
    binds: BTreeSet<u16>,
}

/// All zones of a run so far.
#[derive(Clone, Debug)]
pub(super) struct Zones {
    /// Those of the first mission.
    first: Vec<Zone>,
    /// By zone of the first mission: whether a revision lifted it.
    lifted: Vec<bool>,
    added: Vec<Added>,
    /// Which revision each UAV follows.
    told: BTreeMap<u16, u32>,
    /// Farther from a new zone than this a UAV has room to stay clear of it, metres.
    room_m: f64,
    entries: usize,
    /// By UAV: for every zone whether the UAV was inside it at the end of its last piece.
    inside: BTreeMap<u16, Vec<bool>>,
}

impl Zones {
    pub(super) fn new(first: &[Zone]) -> Self {
        Self {
            first: first.to_vec(),
            lifted: vec![false; first.len()],
            added: Vec::new(),
            told: BTreeMap::new(),
            room_m: 0.0,
            entries: 0,
            inside: BTreeMap::new(),
        }
    }

    /// From now on these are to be kept clear of. One that is new binds a UAV once it follows
    /// the revision and has been farther than `room_m` from it.
    pub(super) fn revise(&mut self, zones: &[Zone], revision: u32, room_m: f64) {
        let same = |a: &Zone, b: &Zone| ring_mm(&a.ring) == ring_mm(&b.ring);
        let is_wanted = |old: &Zone| zones.iter().any(|new| same(old, new));
        // A zone that was lifted and comes back is new to whoever flew without it.
        for (old, lifted) in self.first.iter().zip(&mut self.lifted) {
            *lifted |= !is_wanted(old);
        }
        self.added.retain(|a| is_wanted(&a.zone));
        for zone in zones {
            let surveyed = self.first.iter().zip(&self.lifted);
            let known = surveyed
                .filter(|(_, lifted)| !**lifted)
                .any(|(old, _)| same(old, zone));
            if !known && !self.added.iter().any(|a| same(&a.zone, zone)) {
                self.added.push(Added {
                    revision,
                    zone: zone.clone(),
                    binds: BTreeSet::new(),
                });
            }
        }
        self.inside.clear();
        self.room_m = room_m;
    }

    /// A UAV follows this revision of the mission.
    pub(super) fn follows(&mut self, uav: u16, revision: u32) {
        self.told.insert(uav, revision);
        for added in self.added.iter_mut().filter(|a| a.revision > revision) {
            added.binds.remove(&uav);
        }
    }

    /// How often a UAV entered one.
    pub(super) fn entries(&self) -> usize {
        self.entries
    }

    /// Distances to the zones, and entries. A zone farther away than the least distance
    /// so far cannot change anything and costs one comparison of boxes.
    pub(super) fn watch(&mut self, uav: u16, piece: &Piece, facts: &mut Vec<Fact>) {
        let n_zones = self.first.len() + self.added.len();
        if n_zones == 0 {
            return;
        }
        let told = self.told.get(&uav).copied().unwrap_or(0);
        let room_m = self.room_m + piece.length_m();
        for added in self.added.iter_mut().filter(|a| a.revision <= told) {
            if point_ring_m(piece.start.position(), &added.zone.ring) > room_m {
                added.binds.insert(uav);
            }
        }
        let surveyed = self.first.iter().zip(&self.lifted);
        let surveyed = surveyed.map(|(zone, lifted)| (zone, !lifted));
        let added = self.added.iter().map(|a| (&a.zone, a.binds.contains(&uav)));
        let inside = self
            .inside
            .entry(uav)
            .or_insert_with(|| vec![false; n_zones]);
        let reach = Bounds {
            min: piece.start.position(),
            max: piece.start.position(),
        }
        .grown(piece.length_m());
        let zones = surveyed.chain(added).enumerate();
        for (i, (zone, _)) in zones.filter(|(_, (_, binds))| *binds) {
            if zone.bounds.distance_m(&reach) > 0.0 {
                inside[i] = false;
                continue;
            }
            let n = piece.chords(SAGITTA_M);
            let mut from = piece.start.position();
            for k in 1..=n {
                #[allow(clippy::cast_precision_loss, reason = "milliseconds of one step")]
                let span_s = (piece.to_ms - piece.from_ms) as f64 / 1000.0;
                let to = piece
                    .pose_after(span_s * f64::from(k) / f64::from(n))
                    .position();
                let entered = segment_ring_m(from, to, &zone.ring) <= 0.0;
                if entered && !inside[i] {
                    self.entries += 1;
                    let at_ms = piece.from_ms
                        + (piece.to_ms - piece.from_ms) * u64::from(k - 1) / u64::from(n);
                    facts.push(Fact::ZoneEntry {
                        at_ms,
                        uav,
                        zone: i,
                        place: from,
                    });
                }
                // A chord may cut a corner and end outside again.
                inside[i] = entered && point_ring_m(to, &zone.ring) <= 0.0;
                from = to;
            }
        }
    }

    /// A new airframe under an old number begins outside of all.
    pub(super) fn forget_position(&mut self, uav: u16) {
        self.inside.remove(&uav);
    }
}
