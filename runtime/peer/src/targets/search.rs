//! The search for a target that nobody has seen for a while (D2.7 §3.7): where it may be by a
//! map of chances, which of that was looked at, and where vehicles were seen to drive.
//!
//! | event | what follows |
//! |---|---|
//! | a vehicle is seen to drive, by whomever | there is a way |
//! | whom it follows is lost | a map of chances begins where it was seen last |
//! | nobody has seen it yet | likewise, about the task's place since it was asked for |
//! | a second passes | chance drives on; what is in view is less likely; where to look next is chosen |
//! | it is seen again, or seen by another later | the map is dropped |

use super::{Fused, INNER, Sought, Targets, standing};
use skein_behaviors::Percept;
use skein_behaviors::view::View;
use skein_flight::tracking::chance::ChanceMap;
use skein_flight::tracking::follower::TargetMotion;
use skein_geometry::frame::{Point, Vector};

/// Ways that were driven on are known in squares of this side, metres, and so many of them: all
/// streets of two square kilometres of a city.
const WAY_M: f64 = 25.0;
pub(super) const WAYS_MAX: usize = 2_048;

/// Who is told to move so fast drives, m/s: errors of speed are less.
const DRIVES_MPS: f64 = 3.0;

/// Who searches takes note of what it looked at, and chooses where to look next, so often,
/// milliseconds.
const LOOK_MS: u64 = 1_000;

/// A target that nobody has seen yet is about the task's place to this, a standard deviation in
/// metres.
const ABOUT_M: f64 = 75.0;

/// A search for a target that is out of sight.
#[derive(Clone, Debug)]
pub(super) struct Search {
    /// For which task, and when the target was seen last.
    of: (Sought, u64),
    map: ChanceMap,
    looked_ms: u64,
    /// Where to fly.
    aim: Option<Point>,
}

impl Targets {
    /// Where vehicles drive is where ways are.
    pub(super) fn learn_ways(&mut self) {
        for r in self.board.registers() {
            let drives = r.estimate.velocity_mps().norm() >= DRIVES_MPS;
            if drives && self.ways.len() < WAYS_MAX {
                self.ways.insert(way_square(r.estimate.position()));
            }
        }
    }

    /// Where to fly to have in view again whom nobody has seen for a while: what was known of it
    /// last, or the place that was asked for, drives on, less where this UAV looked since.
    pub fn look_for(
        &mut self,
        (sought, place, asked_s): (Sought, Point, f64),
        percept: &Percept,
        may_fly: &dyn Fn(Point) -> bool,
    ) -> Option<TargetMotion> {
        let airframe = self.flies?;
        let last = self.bound.get(&sought).map(|b| b.last);
        let since_ms = last.map_or(0, |l| l.seen_ms);
        let ways = &self.ways;
        // A way is as wide as a square, and what is known of it ends between two looks.
        let is_driven = |p: Point| {
            let (east, north) = way_square(p);
            let near = |n: i16| n.saturating_sub(1)..=n.saturating_add(1);
            near(east).any(|e| near(north).any(|n| ways.contains(&(e, n))))
        };
        let goes_on = self.search.take().filter(|s| s.of == (sought, since_ms));
        let mut search = goes_on.unwrap_or_else(|| Search {
            of: (sought, since_ms),
            map: match first_map(last, place, self.now_ms, asked_s) {
                map if ways.is_empty() => map,
                map => map.on_ways(&is_driven),
            },
            looked_ms: 0,
            aim: None,
        });
        if search.looked_ms + LOOK_MS <= self.now_ms {
            search.looked_ms = self.now_ms;
            let from = percept.pose;
            search.map.go_on(self.now_ms);
            let view = View::of(percept, &airframe);
            search.map.look(&|p| view.shows(p, INNER));
            let speed_mps = airframe.cruise_mps;
            let next = search.map.look_next(from.position(), speed_mps, may_fly);
            search.aim = next;
        }
        let aim = search.aim;
        self.search = Some(search);
        aim.map(standing)
    }

    /// Whom it looked for is seen, or it looks for nobody.
    pub fn end_search(&mut self) {
        self.search = None;
    }
}

/// The square of a way at a place.
fn way_square(p: Point) -> (i16, i16) {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a cast of a float saturates"
    )]
    let nth = |m: f64| (m / WAY_M).floor() as i16;
    (nth(p.x), nth(p.y))
}

/// Where a target may be that was seen so last, or was to be about a place when it was asked
/// for.
fn first_map(last: Option<Fused>, place: Point, now_ms: u64, asked_s: f64) -> ChanceMap {
    if let Some(f) = last {
        let e = f.estimate;
        return ChanceMap::new(e.time_ms, e.position(), e.spread_m(), e.velocity_mps());
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cast of a float saturates"
    )]
    let asked_ms = (asked_s * 1000.0) as u64;
    let begun_ms = now_ms.saturating_sub(asked_ms);
    ChanceMap::new(begun_ms, place, ABOUT_M, Vector::zeros())
}
