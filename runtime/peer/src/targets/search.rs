//! The search for a target that nobody has seen for a while (D2.7 §3.7): where it may be by
//! chances, on the streets that the mission tells or else on a map, which of that was looked at,
//! and where vehicles were seen to drive.
//!
//! | event | what follows |
//! |---|---|
//! | a vehicle is seen to drive, by whomever | there is a way |
//! | whom it follows is lost | chances begin where it was seen last: on the streets, where it was on one that is known; where none are, on the lines that the mission asks for, where it was on one |
//! | it was looked for on lines for twice as long as a flight along all of them takes, or for five minutes | chances begin anew, anywhere: a line need be no road |
//! | nobody has seen it yet | likewise, about the task's place since it was asked for |
//! | a second passes | chance drives on; what is in view is less likely; where to look next is chosen |
//! | where it flies to stays out of view for longer than the way there takes | that is given up |
//! | it is seen again, or seen by another later | the chances are dropped |

use super::{Fused, INNER, Sought, Targets, standing};
use crate::sight::Sight;
use crate::task::CoverageTask;
use skein_behaviors::Percept;
use skein_flight::coverage::stations::targets::Targets as Asked;
use skein_flight::tracking::chance::ChanceMap;
use skein_flight::tracking::follower::TargetMotion;
use skein_flight::tracking::lookout::{Looker, fly_to};
use skein_flight::tracking::streets::{LastSeen, StreetChances, Streets};
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

/// Who was seen to stand drives so fast once it drives, m/s: in a town.
const USUAL_MPS: f64 = 8.0;

/// What a look leaves of the chance that it is on a street that it showed after all: nine in ten
/// are recognised, and looks that follow each other miss the same.
const LEFT: f64 = 0.3;

/// Who has not had the streets about a place in view after so many times the time of flight
/// there, and so many seconds, never will; they reach so far around it, metres.
const PATIENCE: f64 = 1.5;
const PATIENCE_S: f64 = 15.0;
const GIVEN_UP_M: f64 = 40.0;

/// On the lines of a mission a target is looked for no longer than for so many flights along all of
/// them and so many seconds more, and no longer than that, seconds.
const FLIGHTS: f64 = 2.0;
const FLIGHTS_S: f64 = 60.0;
const ON_LINES_S: f64 = 300.0;

/// A search for a target that is out of sight.
#[derive(Clone, Debug)]
pub(super) struct Search {
    /// For which task, and when the target was seen last.
    of: (Sought, u64),
    chances: Chances,
    /// The lines of the mission, where it is looked for on these, and until when, milliseconds.
    lines: Option<(Streets, u64)>,
    looked_ms: u64,
    /// Where to fly.
    aim: Option<Point>,
}

/// Where a target may be.
#[derive(Clone, Debug)]
enum Chances {
    /// On streets; and until when its search flies to its aim, milliseconds.
    Streets(StreetChances, u64),
    /// Anywhere on the ground.
    Ground(Box<ChanceMap>),
}

/// One who searches, at a time, milliseconds.
struct Searcher<'a> {
    now_ms: u64,
    looker: Looker,
    /// Whether a vehicle at a place would be seen, past all buildings.
    shows: &'a dyn Fn(Point) -> bool,
    /// Whether a place is in the picture, whatever hides it.
    pictures: &'a dyn Fn(Point) -> bool,
    may_fly: &'a dyn Fn(Point) -> bool,
}

impl Chances {
    /// A second passes: chance drives on, what is in view is less likely, and where to fly next
    /// follows.
    fn go_on(
        &mut self,
        streets: Option<&Streets>,
        by: &Searcher<'_>,
        aim: Option<Point>,
    ) -> Option<Point> {
        match (self, streets) {
            (Self::Ground(map), _) => {
                map.go_on(by.now_ms);
                // Squares behind houses would keep their chance, and who searched stay with them
                // for good: courts and back streets are most of a town, and who drives is in view
                // sooner elsewhere.
                map.look(by.pictures);
                map.look_next(by.looker.at, by.looker.airspeed_mps, by.may_fly)
            }
            (Self::Streets(chances, until_ms), Some(streets)) => {
                chances.go_on(streets, by.now_ms);
                chances.look(streets, LEFT, by.shows);
                if let Some(at) = aim.filter(|_| *until_ms < by.now_ms) {
                    let near = |p: Point| (p - at).norm() <= GIVEN_UP_M;
                    chances.look(streets, LEFT, &near);
                }
                let mut places = chances.places(streets);
                places.retain(|(at, _)| (by.may_fly)(*at));
                let next = fly_to(&places, &by.looker, aim, &[]);
                if next != aim {
                    *until_ms = by.now_ms + next.map_or(0, |at| by.patience_ms(at));
                }
                next
            }
            (Self::Streets(..), None) => None,
        }
    }
}

impl Searcher<'_> {
    /// For how long it may take to have a place in view, milliseconds.
    fn patience_ms(&self, at: Point) -> u64 {
        let flight_s = (at - self.looker.at).norm() / self.looker.airspeed_mps.max(1.0);
        whole_ms(PATIENCE * flight_s + PATIENCE_S)
    }
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
        asks_for: &CoverageTask,
        may_fly: &dyn Fn(Point) -> bool,
    ) -> Option<TargetMotion> {
        let airframe = self.flies?;
        let last = self.bound.get(&sought).map(|b| b.last);
        let since_ms = last.map_or(0, |l| l.seen_ms);
        let (ways, town) = (&self.ways, self.town.as_deref());
        // A way is as wide as a square, and what is known of it ends between two looks.
        let is_driven = |p: Point| {
            let (east, north) = way_square(p);
            let near = |n: i16| n.saturating_sub(1)..=n.saturating_add(1);
            near(east).any(|e| near(north).any(|n| ways.contains(&(e, n))))
        };
        let streets = town.and_then(|t| t.streets.as_ref());
        let goes_on = self.search.take().filter(|s| s.of == (sought, since_ms));
        let seen = last_seen(last, place, self.now_ms, asked_s);
        let on_ground = || {
            Chances::Ground(Box::new(match first_map(&seen) {
                map if ways.is_empty() => map,
                map => map.on_ways(&is_driven),
            }))
        };
        let mut search = goes_on.unwrap_or_else(|| {
            let lines = streets.is_none().then(|| streets_of(asks_for)).flatten();
            let on = streets.or(lines.as_ref());
            let chances = on.and_then(|streets| StreetChances::new(streets, &seen));
            let lines = lines.filter(|_| chances.is_some()).map(|lines| {
                let flight_s = lines.length_m() / airframe.cruise_mps.max(1.0);
                let lasts_s = (FLIGHTS * flight_s + FLIGHTS_S).min(ON_LINES_S);
                (lines, self.now_ms + whole_ms(lasts_s))
            });
            let on_streets = |chances| Chances::Streets(chances, u64::MAX);
            Search {
                of: (sought, since_ms),
                chances: chances.map_or_else(on_ground, on_streets),
                lines,
                looked_ms: 0,
                aim: None,
            }
        });
        if search
            .lines
            .as_ref()
            .is_some_and(|(_, until_ms)| *until_ms <= self.now_ms)
        {
            (search.lines, search.chances) = (None, on_ground());
        }
        if search.looked_ms + LOOK_MS <= self.now_ms {
            search.looked_ms = self.now_ms;
            let sight = Sight::of(percept, &airframe, town);
            let by = Searcher {
                now_ms: self.now_ms,
                looker: Looker {
                    at: percept.pose.position(),
                    airspeed_mps: airframe.cruise_mps,
                    reach_m: airframe.footprint_across_m.min(airframe.footprint_along_m),
                },
                shows: &|p| sight.shows(p, INNER),
                pictures: &|p| sight.view.shows(p, INNER),
                may_fly,
            };
            let lines = search.lines.as_ref().map(|(lines, _)| lines);
            search.aim = search.chances.go_on(streets.or(lines), &by, search.aim);
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

/// The lines of a mission as streets; none where it asks for none.
fn streets_of(asks_for: &CoverageTask) -> Option<Streets> {
    let Some(Asked::Lines(lines)) = asks_for.targets() else {
        return None;
    };
    let ways: Vec<Vec<Point>> = lines.into_iter().map(|line| line.way).collect();
    Streets::of(&ways)
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

/// What was known of a target when it was seen last, or that it was to be about a place when it
/// was asked for.
fn last_seen(last: Option<Fused>, place: Point, now_ms: u64, asked_s: f64) -> LastSeen {
    if let Some(f) = last {
        let e = f.estimate;
        let mps = e.velocity_mps().norm();
        return LastSeen {
            at_ms: e.time_ms,
            at: e.position(),
            spread_m: e.spread_m(),
            velocity_mps: e.velocity_mps(),
            usual_mps: if mps >= DRIVES_MPS { mps } else { USUAL_MPS },
        };
    }
    LastSeen {
        at_ms: now_ms.saturating_sub(whole_ms(asked_s)),
        at: place,
        spread_m: ABOUT_M,
        velocity_mps: Vector::zeros(),
        usual_mps: USUAL_MPS,
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn whole_ms(seconds: f64) -> u64 {
    (seconds * 1000.0) as u64
}

/// The map of chances that begins there.
fn first_map(seen: &LastSeen) -> ChanceMap {
    ChanceMap::new(seen.at_ms, seen.at, seen.spread_m, seen.velocity_mps)
}
