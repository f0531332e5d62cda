//! No-fly zones, who is bound by them and who enters them (D2.7 §2.3.1).

use super::fact::Fact;
use super::flat::{Bounds, circle_ring_m, point_ring_m, segment_ring_m};
use super::motion::Piece;
use super::motion::kinematic::FAILSAFE_MS;
use super::survey::Zone;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::sin_cos;
use skein_peer::Mission;
use skein_peer::mission::ring_mm;
use std::collections::{BTreeMap, BTreeSet};

/// Arcs are tested as chords no farther than this from them, metres; distances to
/// zones are exact to this much.
const SAGITTA_M: f64 = 0.01;

/// What a UAV that hears of a new zone flies meanwhile as it was told before, milliseconds: a
/// percept and its answer, and if its computer ends just then what its failsafe waits.
const REACTION_MS: u64 = FAILSAFE_MS + 200;

/// A turn away from a zone takes so many looks at what is flown before it begins.
const REACTION_LOOKS: u8 = 6;

/// What turning away from a new zone takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnAway {
    /// Radius of the tightest circle over the ground that every UAV can fly, metres.
    pub radius_m: f64,
    /// How far a UAV may stray from its curve, metres.
    pub stray_m: f64,
}

impl TurnAway {
    /// What it takes the UAVs of a mission.
    #[must_use]
    pub fn of(mission: &Mission) -> Self {
        Self {
            radius_m: mission.turn_radius_m(),
            stray_m: mission.tracking_error_m(),
        }
    }

    /// Whether a UAV that flies this piece can still keep out of a zone: if it goes on like
    /// that for [`REACTION_MS`] and then flies the tightest circle, to the left or to the
    /// right, it does not enter.
    fn is_possible(&self, piece: &Piece, zone: &Zone) -> bool {
        #[allow(clippy::cast_precision_loss, reason = "about a second")]
        let reaction_s = REACTION_MS as f64 / 1000.0;
        let speed_mps = piece.speed_mps + piece.wind.speed_mps();
        let here = piece.start.position();
        let reach_m = speed_mps * reaction_s + 2.0 * self.radius_m + self.stray_m;
        if point_ring_m(here, &zone.ring) > reach_m {
            return true;
        }
        let at = |k: u8| piece.pose_after(reaction_s * f64::from(k) / f64::from(REACTION_LOOKS));
        let stray_m = self.stray_m;
        let keeps_out = |k: u8| {
            let (from, to) = (at(k).position(), at(k + 1).position());
            segment_ring_m(from, to, &zone.ring) > stray_m
        };
        if !(0..REACTION_LOOKS).all(keeps_out) {
            return false;
        }
        let then = at(REACTION_LOOKS);
        let (sin, cos) = sin_cos(then.heading_rad);
        let over_ground = Vector::new(cos, sin) * piece.speed_mps + piece.wind.velocity();
        let along = over_ground / over_ground.norm().max(1e-9);
        let circle_m = |side: f64| {
            let out = Vector::new(-along.y, along.x) * (side * self.radius_m);
            let centre: Point = then.position() + out;
            circle_ring_m(centre, self.radius_m, &zone.ring)
        };
        circle_m(1.0) > stray_m || circle_m(-1.0) > stray_m
    }
}

/// A no-fly zone that a revision added.
#[derive(Clone, Debug)]
struct Added {
    revision: u32,
    zone: Zone,
    /// Who has been told of it and could turn away since.
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
    /// What turning away takes; nothing is new before the first revision.
    turn: Option<TurnAway>,
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
            turn: None,
            entries: 0,
            inside: BTreeMap::new(),
        }
    }

    /// From now on these are to be kept clear of. One that is new binds a UAV from the first
    /// moment in which it follows the revision and can still turn away.
    pub(super) fn revise(&mut self, zones: &[Zone], revision: u32, turn: TurnAway) {
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
        self.turn = Some(turn);
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
        let not_bound = |a: &&mut Added| a.revision <= told && !a.binds.contains(&uav);
        for added in self.added.iter_mut().filter(not_bound) {
            if self.turn.is_none_or(|t| t.is_possible(piece, &added.zone)) {
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
