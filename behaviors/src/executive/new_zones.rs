//! No-fly zones that come while the UAV flies (D2.7 §2.3.1): kept clear of by the envelope at
//! once, before there are a loop and routes round them.
//!
//! Deriving a loop takes a moment, on a slow computer seconds. Until it is there the track
//! that was committed to may lead into a new zone: then the envelope turns away from it.

use super::Executive;
use skein_geometry::frame::Point;
use skein_geometry::{NoFlyZones, Segment};
use std::sync::Arc;

/// How finely a track is looked at for where it enters a zone, metres.
const LOOK_M: f64 = 1.0;

/// How a zone that is new lies to a UAV.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NewZone {
    /// It lies round the UAV.
    Around,
    /// The track that the UAV is committed to enters it after so many metres.
    Ahead(f64),
}

impl Executive {
    /// Keeps clear of these zones besides those that its routes lead round, until an executive
    /// with routes round them takes over.
    pub fn heed(&mut self, zones: &NoFlyZones) {
        let known = self.transit.router.zones().zones();
        let all = known.iter().chain(zones.zones()).cloned();
        self.envelope
            .set_zones(Arc::new(NoFlyZones::new(all.collect())));
    }

    /// Keeps clear of nothing but what its routes lead round.
    #[must_use]
    pub fn without_heeded(mut self) -> Self {
        self.envelope
            .set_zones(Arc::clone(self.transit.router.zones()));
        self
    }

    /// Where the UAV was at the last percept; nothing before it takes off.
    #[must_use]
    pub fn place(&self) -> Option<Point> {
        let played = self.played.as_ref();
        let in_air = played.filter(|p| p.percept.takes_off_in_ms == 0);
        in_air.map(|p| p.percept.pose.position())
    }

    /// How zones lie to the UAV at a place: round it, or on the track it is committed to.
    #[must_use]
    pub fn meets(&self, zones: &NoFlyZones, at: Point) -> Option<NewZone> {
        let is_inside = |p: Point| zones.distance_m(p) <= 0.0;
        if is_inside(at) {
            return Some(NewZone::Around);
        }
        let ahead = self.track.ahead(self.track.left_m());
        let mut flown_m = 0.0;
        for piece in ahead.segments() {
            if zones.segment_distance_m(piece) <= 0.0 {
                return Some(NewZone::Ahead(flown_m + entry_m(piece, is_inside)));
            }
            flown_m += piece.length_m;
        }
        None
    }
}

/// Where on a piece it is inside first, metres from its beginning, to [`LOOK_M`].
fn entry_m(piece: &Segment, is_inside: impl Fn(Point) -> bool) -> f64 {
    let mut along_m = 0.0;
    while along_m < piece.length_m && !is_inside(piece.pose_at(along_m).position()) {
        along_m += LOOK_M;
    }
    along_m.min(piece.length_m)
}
