//! How long the way is from one place to another off the loop, as a division reckons it
//! (D2.7 §2.3, §3.6.5).
//!
//! Lengths are whole millimetres, so that what is decided by them is decided alike
//! everywhere. Leaves what is flown to the executive, which finds the way anew.

use super::backtracking::{RingCell, Uav};
use super::coverage_loop::Direction;
use super::division::RouteNetwork;
use crate::route::{RouteError, Router};
use crate::trajectory::dubins::length_m;
use core::cell::Cell;
use skein_geometry::frame::Pose;
use std::collections::BTreeMap;

/// Getting out of a zone's clearance takes at most so much more, millimetres.
const ESCAPE_MM: u64 = 150_000;

/// A place: a boundary that looks one way, or where a UAV is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place(u32);

/// Ways between the places of one division.
///
/// # Guarantees
/// A way that was proved is the router's, or along the loop where that is shorter; any
/// other is the shortest curve without zones, which is never longer.
#[derive(Clone, Debug)]
pub(super) struct Transfers<'a> {
    router: &'a Router,
    poses: Vec<Pose>,
    /// Millimetres flown along the loop before each boundary, nothing served.
    travel_mm: Vec<u64>,
    /// Where on the loop each UAV can get to, and how far that is, millimetres.
    anchors: Vec<(Place, u64)>,
    proved: BTreeMap<(Place, Place), u64>,
    /// Lengths asked for so far.
    asked: Cell<u64>,
}

impl<'a> Transfers<'a> {
    /// The places of a loop and of UAVs.
    pub fn new(network: RouteNetwork<'a>, ring: &[RingCell], uavs: &[Uav]) -> Self {
        let coverage_loop = network.coverage_loop;
        let ways = [Direction::Forward, Direction::Backward];
        let boundaries = 0..ring.len();
        let mut poses: Vec<Pose> = boundaries
            .flat_map(|b| ways.map(|d| coverage_loop.boundary_towards(b, d)))
            .collect();
        let at = |uav: &Uav| match uav.off_loop {
            Some(off) => off.pose(),
            None => coverage_loop.boundary_towards(usize::from(uav.anchor), uav.heading),
        };
        poses.extend(uavs.iter().map(at));
        let mut travel_mm = vec![0];
        for cell in ring {
            let before = travel_mm.last().copied().unwrap_or(0);
            travel_mm.push(before + u64::from(cell.travel_mm));
        }
        let mut transfers = Self {
            router: network.router,
            poses,
            travel_mm,
            anchors: Vec::new(),
            proved: BTreeMap::new(),
            asked: Cell::new(0),
        };
        let anchor = |uav: &Uav| {
            let ready_ms = uav.off_loop.map_or(uav.release_ms, |off| off.ready_ms);
            let way_ms = u64::from(uav.release_ms.saturating_sub(ready_ms));
            let place = transfers.boundary(usize::from(uav.anchor), uav.heading);
            (place, way_ms * u64::from(uav.speed_mmps) / 1000)
        };
        transfers.anchors = uavs.iter().map(anchor).collect();
        transfers
    }

    fn cells(&self) -> usize {
        self.travel_mm.len() - 1
    }

    /// The place at a boundary, taken modulo the loop's length.
    pub fn boundary(&self, boundary: usize, direction: Direction) -> Place {
        let b = boundary % self.cells().max(1);
        let way = usize::from(direction == Direction::Backward);
        Place(u32::try_from(2 * b + way).unwrap_or(u32::MAX))
    }

    /// Where the UAV of this index begins.
    pub fn start(&self, uav: usize) -> Place {
        Place(u32::try_from(2 * self.cells() + uav).unwrap_or(u32::MAX))
    }

    fn pose(&self, place: Place) -> Pose {
        self.poses[place.0 as usize]
    }

    /// How many lengths were asked for so far.
    pub fn asked(&self) -> u64 {
        self.asked.get()
    }

    /// The length of the way, millimetres.
    pub fn mm(&self, from: Place, to: Place) -> u64 {
        self.asked.set(self.asked.get().saturating_add(1));
        let proved = self.proved.get(&(from, to)).copied();
        proved.unwrap_or_else(|| self.dubins_mm(from, to))
    }

    fn dubins_mm(&self, from: Place, to: Place) -> u64 {
        let radius_m = self.router.limits().turn_radius_m;
        whole_mm(length_m(self.pose(from), self.pose(to), radius_m))
    }

    /// Finds out the length of a way round the zones. Returns whether it is longer than
    /// what was reckoned with.
    pub fn prove(&mut self, from: Place, to: Place) -> bool {
        if self.proved.contains_key(&(from, to)) {
            return false;
        }
        let reckoned_mm = self.dubins_mm(from, to);
        let along_mm = self.along_mm(from, to);
        let proved_mm = match self.router.route(self.pose(from), self.pose(to)) {
            Ok(curve) => whole_mm(curve.length_m()).min(along_mm.unwrap_or(u64::MAX)),
            Err(RouteError::StartInZone) => reckoned_mm + ESCAPE_MM,
            Err(_) => along_mm
                .or_else(|| self.by_anchor_mm(from, to))
                // Onto the loop near by and along it, which is never more than once round.
                .unwrap_or_else(|| reckoned_mm + self.travel_mm[self.cells()] / 2),
        };
        self.proved.insert((from, to), proved_mm);
        proved_mm > reckoned_mm
    }

    /// From a UAV over where it told that it will be on the loop, and from there the shorter of
    /// along it and the router's way.
    fn by_anchor_mm(&self, from: Place, to: Place) -> Option<u64> {
        let uav = (from.0 as usize).checked_sub(2 * self.cells())?;
        let (anchor, to_anchor_mm) = *self.anchors.get(uav)?;
        let way = self.router.route(self.pose(anchor), self.pose(to)).ok();
        let way_mm = way.map(|curve| whole_mm(curve.length_m()));
        let on_mm = self.along_mm(anchor, to).into_iter().chain(way_mm).min()?;
        Some(to_anchor_mm.saturating_add(on_mm))
    }

    /// Along the loop without turning round, if both places look the same way on it.
    fn along_mm(&self, from: Place, to: Place) -> Option<u64> {
        let n = self.cells();
        let (a, b) = (from.0 as usize, to.0 as usize);
        if a >= 2 * n || b >= 2 * n || a % 2 != b % 2 {
            return None;
        }
        let (from, to) = if a % 2 == 0 {
            (a / 2, b / 2)
        } else {
            (b / 2, a / 2)
        };
        let (start_mm, end_mm) = (self.travel_mm[from], self.travel_mm[to]);
        Some(if to >= from {
            end_mm - start_mm
        } else {
            self.travel_mm[n] - start_mm + end_mm
        })
    }
}

fn whole_mm(m: f64) -> u64 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cast of a float saturates"
    )]
    let mm = (m * 1000.0).round() as u64;
    mm
}
