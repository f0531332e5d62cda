//! How much of the ground between buildings was in sight (D2.7 §1.2.1, §2.2).
//!
//! A cell is covered when one picture holds it, whatever stands in it: behind a house and in a
//! court ground stays hidden all the same. So the judge takes samples of the open ground, what has
//! no roof above it, in coverable cells of the area, and notes which of them some camera had in its
//! picture with nothing in between. That is a figure beside the verdict and no part of it.
//!
//! | event | what follows |
//! |---|---|
//! | a second passes | what a UAV in the air has in sight was seen, once and for all |
//! | another revision of the mission is to be flown | samples of its area; what was seen stays seen |
//!
//! # Complexity
//! Laying samples asks once per sample whether there is a roof above it. A look goes through the
//! samples within reach of a camera, some hundreds, and asks only for those that nobody has seen.

use super::detector::Sight;
use super::flat::{Bounds, in_ring};
use super::motion::Kinematic;
use super::obstacles::{Obstacles, Place};
use super::survey::Survey;
use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;
use skein_peer::Mission;

/// Samples are so far apart, east and north, metres: of a square kilometre ten thousand, which
/// tell a share to half a percent.
const APART_M: f64 = 10.0;

/// Cameras are looked through so often, milliseconds: a UAV flies a part of its picture meanwhile.
pub const LOOK_MS: u64 = 1_000;

/// More samples are not laid, of areas of twenty kilometres squared.
const SAMPLES_MAX: f64 = 4e6;

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sample {
    /// It has a roof above it, or is not in what is to be seen.
    None,
    /// Nobody has seen it.
    Hidden,
    /// Somebody has.
    Seen,
}

/// How much of the open ground was in sight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GroundSeen {
    /// Samples of open ground in coverable cells, each of 100 m².
    pub samples: usize,
    /// Those that some camera had in sight, with no building in between.
    pub seen: usize,
    /// `seen` over `samples`, 0 to 1.
    pub share: f64,
}

/// The samples of an area, row by row from the south-west.
#[derive(Clone, Debug)]
pub struct Ground {
    /// Column and row of the first: samples lie half a step beside multiples of [`APART_M`].
    first: (i32, i32),
    columns: usize,
    samples: Vec<Sample>,
}

impl Ground {
    /// Samples of what a survey of an area can see; none without buildings, where all is in sight
    /// that is in a picture, and of missions for places and lines.
    #[must_use]
    pub fn of(survey: &Survey, mission: &Mission, obstacles: &Obstacles) -> Option<Self> {
        if obstacles.is_empty() || survey.pieces().is_some() || survey.n_coverable() == 0 {
            return None;
        }
        let area = mission.area_m();
        let bounds = Bounds::around(&area);
        let first = (number(bounds.min.x), number(bounds.min.y));
        let last = (number(bounds.max.x), number(bounds.max.y));
        let along = |from: i32, to: i32| usize::try_from(to - from + 1).unwrap_or(0);
        let (columns, rows) = (along(first.0, last.0), along(first.1, last.1));
        #[allow(clippy::cast_precision_loss, reason = "compared with a bound")]
        if columns as f64 * rows as f64 > SAMPLES_MAX {
            return None;
        }
        let sample = |i: usize| {
            let at = place(first, columns, i);
            let cell = (at / survey.lane_m()).map(|c| c.floor() as i32);
            let cell = survey.at(cell.x, cell.y).map(|n| &survey.cells()[n]);
            let is_asked = cell.is_some_and(|c| c.uncoverable.is_none()) && in_ring(at, &area);
            if is_asked && obstacles.sees(Place::on_ground(at), Place::in_the_sky(at)) {
                Sample::Hidden
            } else {
                Sample::None
            }
        };
        Some(Self {
            first,
            columns,
            samples: (0..columns * rows).map(sample).collect(),
        })
    }

    /// What was seen of another's samples was seen.
    pub fn remember(&mut self, other: &Self) {
        for i in 0..other.samples.len() {
            if other.samples[i] == Sample::Seen
                && let Some(own) = self.at(other.number_of(i))
                && self.samples[own] == Sample::Hidden
            {
                self.samples[own] = Sample::Seen;
            }
        }
    }

    /// The camera of a UAV is looked through.
    pub fn look(&mut self, body: &Kinematic, obstacles: &Obstacles) {
        let (sight, from) = (Sight::of(body), body.position());
        let reach_m = body.eye().reach_m();
        let columns = number(from.x - reach_m)..=number(from.x + reach_m);
        for row in number(from.y - reach_m)..=number(from.y + reach_m) {
            for column in columns.clone() {
                if let Some(i) = self.at((column, row))
                    && self.samples[i] == Sample::Hidden
                    && sight.sees(Place::on_ground(self.place(i)), obstacles)
                {
                    self.samples[i] = Sample::Seen;
                }
            }
        }
    }

    /// How much was in sight so far.
    #[must_use]
    pub fn seen(&self) -> GroundSeen {
        let count = |of: Sample| self.samples.iter().filter(|s| **s == of).count();
        let (seen, hidden) = (count(Sample::Seen), count(Sample::Hidden));
        #[allow(clippy::cast_precision_loss, reason = "millions")]
        let share = seen as f64 / (seen + hidden).max(1) as f64;
        GroundSeen {
            samples: seen + hidden,
            seen,
            share,
        }
    }

    fn at(&self, (column, row): (i32, i32)) -> Option<usize> {
        let column = usize::try_from(column - self.first.0).ok()?;
        let row = usize::try_from(row - self.first.1).ok()?;
        let i = row * self.columns + column;
        (column < self.columns && i < self.samples.len()).then_some(i)
    }

    fn number_of(&self, i: usize) -> (i32, i32) {
        let steps = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
        let (column, row) = (steps(i % self.columns), steps(i / self.columns));
        (self.first.0 + column, self.first.1 + row)
    }

    fn place(&self, i: usize) -> Point {
        place(self.first, self.columns, i)
    }
}

/// The column or row in which a coordinate lies.
fn number(m: f64) -> i32 {
    (m / APART_M).floor() as i32
}

#[allow(clippy::cast_precision_loss, reason = "millions")]
fn place(first: (i32, i32), columns: usize, i: usize) -> Point {
    let middle = |first: i32, n: usize| (f64::from(first) + n as f64 + 0.5) * APART_M;
    Point::new(middle(first.0, i % columns), middle(first.1, i / columns))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::{Building, Spec};
    use crate::world::World;
    use crate::world::fixture::{airframe, polygon, square, straight};
    use skein_geometry::frame::Pose;
    use skein_geometry::math::FRAC_PI_2;
    use std::sync::Arc;

    /// The area of the fixture without zones, with a wall from south to north.
    fn walled() -> Spec {
        let mut spec = square(1);
        let (west, east) = (200_000, 210_000);
        spec.buildings = vec![Building {
            footprint: polygon(&[
                (west, 100_000),
                (east, 100_000),
                (east, 300_000),
                (west, 300_000),
            ]),
            height_m: 30.0,
        }];
        spec.zones = Vec::new();
        let mut mission = (*spec.mission).clone();
        mission.zones = Vec::new();
        spec.mission = Arc::new(mission);
        spec
    }

    fn ground_of(spec: &Spec) -> Option<Ground> {
        let obstacles = Obstacles::new(&spec.buildings);
        Ground::of(&Survey::new(spec), &spec.mission, &obstacles)
    }

    /// A flight northwards, 45 m high, east of the origin by so much.
    fn look(ground: &mut Ground, spec: &Spec, east_m: f64) {
        let pose = Pose {
            east_m,
            north_m: 200.0,
            heading_rad: FRAC_PI_2,
        };
        let body = Kinematic::new(airframe(), pose, 45.0, 0);
        ground.look(&body, &Obstacles::new(&spec.buildings));
    }

    fn sample(ground: &Ground, east_m: f64, north_m: f64) -> Sample {
        let i = ground.at((number(east_m), number(north_m)));
        i.map_or(Sample::None, |i| ground.samples[i])
    }

    #[test]
    fn behind_a_wall_ground_is_hidden_until_somebody_looks_from_its_other_side() {
        let spec = walled();
        let mut ground = ground_of(&spec).unwrap();
        // 48 by 38, less the 20 below the roof of the wall.
        assert_eq!(ground.seen().samples, 48 * 38 - 20);
        assert_eq!(sample(&ground, 205.0, 195.0), Sample::None);
        look(&mut ground, &spec, 230.0);
        // 46 m to either side, less the two columns behind the wall and that below its roof; 36 m
        // ahead and astern.
        assert_eq!(sample(&ground, 195.0, 195.0), Sample::Hidden);
        assert_eq!(sample(&ground, 215.0, 195.0), Sample::Seen);
        assert_eq!(ground.seen().seen, 7 * 8);
        look(&mut ground, &spec, 180.0);
        assert_eq!(sample(&ground, 195.0, 195.0), Sample::Seen);
        let seen = ground.seen();
        assert!((seen.share - seen.seen as f64 / seen.samples as f64).abs() < 1e-12);
    }

    #[test]
    fn what_was_seen_counts_for_the_next_revision_where_that_asks_for_it() {
        let spec = walled();
        let mut ground = ground_of(&spec).unwrap();
        look(&mut ground, &spec, 230.0);
        let mut smaller = spec.clone();
        let mut mission = (*spec.mission).clone();
        mission.area = vec![(0, 0), (240_000, 0), (240_000, 384_000), (0, 384_000)];
        smaller.mission = Arc::new(mission);
        let mut next = ground_of(&smaller).unwrap();
        next.remember(&ground);
        assert_eq!(next.seen().seen, 3 * 8);
        assert_eq!(sample(&next, 235.0, 195.0), Sample::Seen);
        assert_eq!(sample(&next, 245.0, 195.0), Sample::None);
    }

    #[test]
    fn ground_is_looked_at_between_buildings_of_an_area_alone() {
        let mut open = walled();
        open.buildings = Vec::new();
        assert!(ground_of(&open).is_none());
        let mut points = walled();
        let mut mission = (*points.mission).clone();
        mission.task = skein_peer::CoverageTask::Points(Vec::new());
        points.mission = Arc::new(mission);
        assert!(ground_of(&points).is_none());
    }

    #[test]
    fn who_flies_sees_ground_and_who_stands_on_it_none() {
        let spec = walled();
        let mut world = World::new(&spec, 1);
        world.apply(1, straight(0));
        world.advance(5_000);
        let seen = world.judge().ground_seen().unwrap();
        assert!(seen.seen > 66 && seen.seen < 400, "{seen:?}");
        let mut spec = spec;
        spec.uavs[0].takeoff_ms = 60_000;
        let mut world = World::new(&spec, 1);
        world.advance(5_000);
        assert_eq!(world.judge().ground_seen().unwrap().seen, 0);
    }
}
