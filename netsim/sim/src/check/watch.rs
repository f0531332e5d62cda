//! Places that are flown over again and again, where missions go round once everything is seen
//! (`watch`): by where the UAVs are, and by nothing that they say beside the state that they are
//! in.
//!
//! | who flies round | no place of the loop waits longer than |
//! |---|---|
//! | somebody | one of them takes for the whole loop, slowed down, and [`JOIN_MS`] |
//! | the same ones for so long that they may have spread, and all hear each other | that at cruise, shared evenly among them, times [`UNEVEN`], and [`LATE_MS`] |
//!
//! Where one of them makes way for an aircraft that is no member all begins anew: it may come back
//! to the loop elsewhere, and they have to spread again. So it does where one of them flies another
//! loop than the one that is judged, since no word of it came to it.

use super::flight::{Flyer, milliseconds};
use super::{Findings, PeerSnapshot, Snapshot};
use skein_geometry::frame::Point;
use skein_peer::offload::MissionGeometry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Who spaces itself flies at least at this share of its cruise: airframes keep a quarter above
/// their stall.
const SLOWED: f64 = 0.75;

/// The way onto the loop, and a look of the judge each second, milliseconds.
const JOIN_MS: u64 = 60_000;

/// What is shared evenly is so to within this.
const UNEVEN: f64 = 1.5;

/// How late somebody may be beside that, milliseconds: a circle flown to let another get away,
/// and turns in a wind.
const LATE_MS: u64 = 30_000;

/// So many times round the loop they have to spread.
const SPREAD_LAPS: u64 = 2;

/// Nearer to the middle of a piece of the loop than this beside half of it somebody flies over
/// it, metres: what is flown in a second, and some.
const NEAR_M: f64 = 25.0;

/// A loop as far as it is watched.
#[derive(Clone, Debug)]
struct Watched {
    /// The middle of each piece that is to be seen, and how far its ends are from it.
    pieces: Vec<(Point, f64)>,
    length_m: f64,
}

impl Watched {
    fn of(geometry: &MissionGeometry) -> Self {
        let coverage_loop = &geometry.coverage_loop;
        let forward = skein_flight::coverage::ring::Direction::Forward;
        let (mut pieces, mut length_m) = (Vec::new(), 0.0);
        for (i, cell) in coverage_loop.cells().iter().enumerate() {
            let curve = coverage_loop.curve(i, forward);
            length_m += curve.length_m();
            if !cell.needed {
                continue;
            }
            let ends = [curve.start(), curve.end()];
            if let Some(middle) = curve.pose_at(0.5 * curve.length_m()) {
                let at = middle.position();
                let away_m = |end: &skein_geometry::frame::Pose| (end.position() - at).norm();
                let far_m = ends.iter().flatten().map(away_m).fold(0.0, f64::max);
                pieces.push((at, far_m));
            }
        }
        Self { pieces, length_m }
    }
}

/// What the patrols of one run were found to be.
#[derive(Clone, Debug, Default)]
pub struct WatchCheck {
    loops: BTreeMap<u64, Arc<Watched>>,
    /// Who flies round which loop, since when the same ones, and since when they all hear each
    /// other besides.
    rounders: BTreeSet<u16>,
    loop_hash: u64,
    since_ms: u64,
    linked_ms: u64,
    /// When each piece was flown over last.
    seen_ms: Vec<u64>,
    told: bool,
}

impl WatchCheck {
    /// A loop was derived.
    pub fn on_loop(&mut self, geometry: &Arc<MissionGeometry>) {
        if geometry.mission.goes_round() {
            let hash = geometry.coverage_loop.hash();
            let watched = || Arc::new(Watched::of(geometry));
            self.loops.entry(hash).or_insert_with(watched);
        }
    }

    /// Looks at where those are who fly round, as their states say.
    pub fn on_snapshot(
        &mut self,
        snapshot: &Snapshot<'_>,
        flies_round: impl Fn(&PeerSnapshot) -> bool,
        flyers: &BTreeMap<u16, Flyer>,
        found: &mut Findings,
    ) {
        let Some(watched) = self.loops.get(&snapshot.loop_hash).map(Arc::clone) else {
            return;
        };
        let uavs = snapshot.peers.iter().filter(|m| m.uav);
        let all: Vec<&PeerSnapshot> = uavs.filter(|m| flies_round(m)).collect();
        let rounders: BTreeSet<u16> = all.iter().map(|m| m.id).collect();
        let now_ms = snapshot.now_ms;
        let makes_way = all.iter().any(|m| m.view.evades);
        let flies_another = all.iter().any(|m| m.view.loop_hash != snapshot.loop_hash);
        if makes_way
            || flies_another
            || (&rounders, snapshot.loop_hash) != (&self.rounders, self.loop_hash)
        {
            self.rounders.clone_from(&rounders);
            self.loop_hash = snapshot.loop_hash;
            (self.since_ms, self.linked_ms) = (now_ms, now_ms);
            self.seen_ms = vec![now_ms; watched.pieces.len()];
        }
        let linked = |a: u16| {
            let others = rounders.iter().filter(|b| **b != a);
            others.into_iter().all(|b| snapshot.graph.linked(a, *b))
        };
        if !rounders.iter().all(|a| linked(*a)) {
            self.linked_ms = now_ms;
        }
        for at in all.iter().filter_map(|m| m.at) {
            for ((middle, far_m), seen_ms) in watched.pieces.iter().zip(&mut self.seen_ms) {
                if (at - *middle).norm() <= far_m + NEAR_M {
                    *seen_ms = now_ms;
                }
            }
        }
        let Some((bound_ms, how)) = self.bound_ms(snapshot, &watched, flyers) else {
            return;
        };
        let oldest = self.seen_ms.iter().zip(0..).min();
        let waits_ms = oldest.map_or(0, |(ms, _)| now_ms.saturating_sub(*ms));
        if waits_ms > bound_ms && !core::mem::replace(&mut self.told, true) {
            found.broken("watch", now_ms, None, || {
                let n = self.rounders.len();
                format!(
                    "{n} UAVs fly round {how}, and a place of the loop was not flown over for {waits_ms} ms (bound {bound_ms} ms)"
                )
            });
        }
    }

    /// How long a place may wait, and by which of the two rules.
    fn bound_ms(
        &self,
        snapshot: &Snapshot<'_>,
        watched: &Watched,
        flyers: &BTreeMap<u16, Flyer>,
    ) -> Option<(u64, &'static str)> {
        let speeds = self.rounders.iter().filter_map(|id| flyers.get(id));
        let slowest_mps = speeds.map(|f| f.slowest_mps).fold(f64::INFINITY, f64::min);
        if !slowest_mps.is_finite() || slowest_mps <= 0.0 {
            return None;
        }
        let lap_ms = |mps: f64| milliseconds(watched.length_m / mps);
        let slowed_ms = lap_ms(SLOWED * slowest_mps);
        let late_ms = |since_ms| {
            let each = self
                .rounders
                .iter()
                .map(|id| snapshot.late_ms(*id, since_ms));
            each.max().unwrap_or(0)
        };
        let loose_ms = slowed_ms + JOIN_MS;
        let together_ms = self.since_ms.max(self.linked_ms);
        let spread_ms = snapshot.grown_ms(SPREAD_LAPS * slowed_ms, together_ms);
        let n = u32::try_from(self.rounders.len()).unwrap_or(u32::MAX);
        let loose_ms = loose_ms + late_ms(self.since_ms);
        if snapshot.now_ms.saturating_sub(together_ms) < spread_ms {
            return Some((loose_ms, "together"));
        }
        let even_ms = lap_ms(slowest_mps * f64::from(n) / UNEVEN);
        let even_ms = even_ms + LATE_MS + late_ms(self.since_ms);
        Some((even_ms.min(loose_ms), "evenly"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use crate::geometry_cache::geometry_of;
    use crate::world::fixture;
    use skein_peer::Beliefs;

    /// Where so many are who are so far apart, metres, when each flies at 12 m/s; whether a rule
    /// is broken by then.
    fn broken(apart_m: &[f64], mps: f64, seconds: u64) -> bool {
        let geometry = geometry_of(&fixture::square(1).mission).unwrap();
        let watched = Arc::new(Watched::of(&geometry));
        let mut check = WatchCheck::default();
        check
            .loops
            .insert(super::super::testing::LOOP, Arc::clone(&watched));
        let flyer = Flyer {
            turn_radius_m: 20.0,
            slowest_mps: 12.0,
            fastest_mps: 12.0,
            waits_within_m: 100.0,
        };
        let flyers: BTreeMap<u16, Flyer> = (1..9).map(|id| (id, flyer)).collect();
        let coverage_loop = &geometry.coverage_loop;
        let forward = skein_flight::coverage::ring::Direction::Forward;
        let at = |m: f64| {
            let mut left_m = m.rem_euclid(watched.length_m);
            for i in 0..coverage_loop.len() {
                let curve = coverage_loop.curve(i, forward);
                if left_m <= curve.length_m() {
                    return curve.pose_at(left_m).unwrap().position();
                }
                left_m -= curve.length_m();
            }
            unreachable!("no longer than the loop")
        };
        let (mut story, mut found) = (Story::new(0), Findings::new(1));
        for t in 0..seconds {
            let views: Vec<(u16, Beliefs)> =
                (1..).zip(apart_m).map(|(id, _)| (id, speaking())).collect();
            for (id, m) in (1..).zip(apart_m) {
                #[allow(clippy::cast_precision_loss, reason = "seconds")]
                story.place(id, at(m + mps * t as f64));
            }
            story.snapshot(t * 1000, &views, |s| {
                check.on_snapshot(s, |_| true, &flyers, &mut found);
            });
        }
        found.counts.contains_key("watch")
    }

    #[test]
    fn who_stays_where_it_is_leaves_places_waiting() {
        assert!(!broken(&[0.0], 12.0, 4_000));
        assert!(broken(&[0.0], 0.0, 4_000));
    }

    #[test]
    fn who_flies_close_behind_another_is_not_evenly_spaced() {
        let geometry = geometry_of(&fixture::square(1).mission).unwrap();
        let length_m = Watched::of(&geometry).length_m;
        let even: Vec<f64> = (0..4).map(|k| f64::from(k) * length_m / 4.0).collect();
        assert!(!broken(&even, 12.0, 4_000));
        assert!(broken(&[0.0, 30.0, 60.0, 90.0], 12.0, 4_000));
        assert!(
            !broken(&[0.0, 30.0, 60.0, 90.0], 12.0, 200),
            "they have to spread"
        );
    }
}
