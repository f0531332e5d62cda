//! The people of a mass event in a mission's world, and what cameras see of them (D2.7 §3.1).
//!
//! Everybody stands at a place of its own, and sets off once at a time of its own for the next one,
//! along the way of its group. Nobody steps aside for another: where a group's ways end in a field
//! that is too small for it, people stand as close as the script has them.
//!
//! # Guarantees
//! Truth stays here: percepts hold estimates by squares, drawn from the seed, the UAV and the time
//! alone. Where people are is a function of seed and time; they are moved on once a second. Nobody
//! appears and nobody vanishes. Without a crowd there is no recogniser, and nothing is drawn.

use super::detector::{Look, Sight};
use super::motion::Kinematic;
use super::obstacles::{Obstacles, Place};
use crate::spec::{CrowdSpec, Field, GroupSpec};
use skein_behaviors::crowd::{CrowdLook, FALSE_EACH, RECOGNISED, SQUARE_M, SQUARES_MAX, Square};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::seconds;
use skein_geometry::random::{SplitMix64, mix};

/// The side of a cell by which people are kept, metres: places are told as exactly as that.
pub const CELL_M: f64 = 2.0;

/// A cell a side of a square.
const CELLS: i32 = 5;

/// So much slower and faster than the mean the slowest and the fastest walk.
const PACE: f64 = 0.2;

/// People walk beside the places of a way, this far at most, metres.
const ASIDE_M: f64 = 4.0;

/// Most squares that are not whole in a picture beside those that are: each way.
const MARGIN: i16 = 1;

/// Where one is from a time on.
#[derive(Clone, Copy, Debug)]
struct Step {
    at_ms: u64,
    at: Point,
}

/// All people, and where they are now.
#[derive(Clone, Debug)]
pub struct Crowd {
    seed: u64,
    /// Of each person, place after place.
    ways: Vec<Vec<Step>>,
    /// South-west corner of the cells, counted in cells from the origin, and how many.
    low: (i32, i32),
    size: (i32, i32),
    /// How many are south-west of each corner of the cells, row after row: one more a row than
    /// cells, and one row more.
    south_west: Vec<u32>,
    second: u64,
    /// A recogniser looks at one picture in this time, milliseconds: that of the first percept of
    /// each second.
    percept_ms: u64,
}

fn cell_of(p: Point) -> (i32, i32) {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "missions end at 20 km: 10,000 cells"
    )]
    let of = |m: f64| (m / CELL_M).floor() as i32;
    (of(p.x), of(p.y))
}

/// A place in a field, drawn.
fn spot(field: &Field, random: &mut SplitMix64) -> Point {
    let along = |low: f64, high: f64, share: f64| low + (high - low) * share;
    let (east, north) = (random.unit(), random.unit());
    Point::new(
        along(field.low.0, field.high.0, east),
        along(field.low.1, field.high.1, north),
    )
}

/// Milliseconds after so many metres.
fn walked_ms(m: f64, mps: f64) -> u64 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "20 km at a tenth of a metre a second are two days"
    )]
    let ms = (1e3 * m / mps.max(0.1)).round() as u64;
    ms
}

fn way_of(group: &GroupSpec, late_ms: i64, random: &mut SplitMix64) -> Vec<Step> {
    let mut at = spot(&group.at, random);
    let mut way = vec![Step { at_ms: 0, at }];
    let mut free_ms = 0;
    for going in &group.moves {
        let pace = 1.0 + PACE * (2.0 * random.unit() - 1.0);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a scenario lasts less than 2^52 ms"
        )]
        let drawn_ms = (going.over_ms as f64 * random.unit()) as u64;
        let planned_ms = (going.from_ms + drawn_ms).saturating_add_signed(late_ms);
        let aside = Vector::new(random.unit() - 0.5, random.unit() - 0.5) * (2.0 * ASIDE_M);
        // Who is still on its way sets off once it is there.
        let mut now_ms = planned_ms.max(free_ms);
        way.push(Step { at_ms: now_ms, at });
        let end = spot(&going.to, random);
        let past = going.way.iter().map(|p| p + aside).chain([end]);
        for next in past {
            now_ms += walked_ms((next - at).norm(), pace * going.speed_mps);
            at = next;
            way.push(Step { at_ms: now_ms, at });
        }
        free_ms = now_ms;
    }
    way
}

fn at(way: &[Step], now_ms: u64) -> Point {
    let next = way.partition_point(|s| s.at_ms <= now_ms);
    let before = way[next.saturating_sub(1)];
    let Some(after) = way.get(next) else {
        return before.at;
    };
    let over_s = seconds(after.at_ms.saturating_sub(before.at_ms)).max(1e-3);
    let share = seconds(now_ms.saturating_sub(before.at_ms)) / over_s;
    before.at + (after.at - before.at) * share
}

impl Crowd {
    /// As it is drawn from a seed; `percept_ms` is the time between two percepts of a UAV.
    #[must_use]
    pub fn new(spec: &CrowdSpec, percept_ms: u32, seed: u64) -> Self {
        let seed = mix(seed ^ 0xC4_0D00);
        let mut random = SplitMix64::new(seed);
        let mut ways = Vec::new();
        for group in &spec.groups {
            let mut vary = |most: f64| most * (2.0 * random.unit() - 1.0);
            let share = 1.0 + vary(f64::from(spec.vary_permille) / 1e3);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "some ten thousand people, and minutes"
            )]
            let (people, late_ms) = (
                (f64::from(group.people) * share).round() as u32,
                vary(f64::from(spec.vary_ms)) as i64,
            );
            ways.extend((0..people).map(|_| way_of(group, late_ms, &mut random)));
        }
        let all = || ways.iter().flatten().map(|s| cell_of(s.at));
        let low = (
            all().map(|c| c.0).min().unwrap_or(0),
            all().map(|c| c.1).min().unwrap_or(0),
        );
        let high = (
            all().map(|c| c.0).max().unwrap_or(0),
            all().map(|c| c.1).max().unwrap_or(0),
        );
        let size = (high.0 - low.0 + 1, high.1 - low.1 + 1);
        let corners = (i64::from(size.0) + 1) * (i64::from(size.1) + 1);
        let mut crowd = Self {
            seed,
            ways,
            low,
            size,
            south_west: vec![0; usize::try_from(corners).unwrap_or(0)],
            second: u64::MAX,
            percept_ms: u64::from(percept_ms.max(1)),
        };
        crowd.advance(0);
        crowd
    }

    /// Everybody walks on until then.
    pub fn advance(&mut self, now_ms: u64) {
        let second = now_ms / 1_000;
        if second == self.second {
            return;
        }
        self.second = second;
        self.south_west.fill(0);
        for way in &self.ways {
            let (col, row) = cell_of(at(way, 1_000 * second));
            let north_east = self.corner((col + 1, row + 1));
            self.south_west[north_east] += 1;
        }
        let row_len = self.corner((self.low.0, self.low.1 + 1));
        let mut west = 0;
        for i in row_len..self.south_west.len() {
            west = if i % row_len == 0 {
                0
            } else {
                west + self.south_west[i]
            };
            self.south_west[i] = west + self.south_west[i - row_len];
        }
    }

    /// The second of which it knows where people are.
    #[must_use]
    pub fn second(&self) -> u64 {
        self.second
    }

    /// Whether recognisers look in a percept of this time.
    #[must_use]
    pub fn looks_at(&self, now_ms: u64) -> bool {
        now_ms % 1_000 < self.percept_ms
    }

    /// How many there are.
    #[must_use]
    pub fn people(&self) -> usize {
        self.ways.len()
    }

    /// Which corner of the cells one is, or the nearest of them: nobody is farther out.
    fn corner(&self, (col, row): (i32, i32)) -> usize {
        let within = |n: i32, size: i32| usize::try_from(n.clamp(0, size)).unwrap_or(0);
        let row_len = within(self.size.0, self.size.0) + 1;
        within(row - self.low.1, self.size.1) * row_len + within(col - self.low.0, self.size.0)
    }

    fn in_cells(&self, low: (i32, i32), side: (i32, i32)) -> u32 {
        let high = (low.0 + side.0, low.1 + side.1);
        let up_to = |corner: (i32, i32)| self.south_west[self.corner(corner)];
        up_to(high) + up_to(low) - up_to((low.0, high.1)) - up_to((high.0, low.1))
    }

    /// How many are in a rectangle, whose corners are those of cells, now.
    #[must_use]
    pub fn within(&self, low: Point, side_m: f64) -> u32 {
        let half = Vector::new(0.5, 0.5) * CELL_M;
        let (from, to) = (
            cell_of(low + half),
            cell_of(low + Vector::new(side_m, side_m) + half),
        );
        self.in_cells(from, (to.0 - from.0, to.1 - from.1))
    }

    /// One look of the recogniser of a UAV; none but in the first percept of a second.
    pub(super) fn look(
        &self,
        body: &Kinematic,
        uav: u16,
        now_ms: u64,
        obstacles: &Obstacles,
    ) -> CrowdLook {
        if !self.looks_at(now_ms) {
            return CrowdLook::default();
        }
        if body.takes_off_in_ms(now_ms) > 0 {
            return CrowdLook::new([]);
        }
        let mut look = Look::new(self.seed, uav, now_ms);
        let of_uav = mix(self.seed ^ u64::from(uav) << 40);
        let share = SplitMix64::new(of_uav).unit();
        let recognised = RECOGNISED.0 + (RECOGNISED.1 - RECOGNISED.0) * share;
        // By how many cells places are off is the same for a whole flight.
        let off = look.displaced();
        let off = cell_of(Point::origin() + off + Vector::new(0.5, 0.5) * CELL_M);
        let reach_m = body.eye().reach_m();
        let reach = Vector::new(reach_m, reach_m);
        let (low, high) = (
            Square::at(body.position() - reach),
            Square::at(body.position() + reach),
        );
        let picture = body.picture();
        let mut seen = Vec::new();
        for row in low.row - MARGIN..=high.row + MARGIN {
            for col in low.col - MARGIN..=high.col + MARGIN {
                let square = Square {
                    col,
                    row,
                    people: 0,
                };
                let corners = square.corners();
                if !picture.holds(&corners) || !is_open(body, &corners, obstacles) {
                    continue;
                }
                let first = (
                    i32::from(col) * CELLS - off.0,
                    i32::from(row) * CELLS - off.1,
                );
                let truly = self.in_cells(first, (CELLS, CELLS));
                let people = drawn(truly, recognised, &mut look.random);
                seen.push(Square {
                    people: u16::try_from(people).unwrap_or(u16::MAX),
                    ..square
                });
            }
        }
        // Of more squares than are told the nearest to the middle of the picture.
        if seen.len() > SQUARES_MAX {
            let middle = picture.place(0.0, 0.0);
            let away = |s: &Square| {
                let half = Vector::new(0.5, 0.5) * SQUARE_M;
                (s.corners()[0] + half - middle).norm()
            };
            seen.sort_by(|a, b| away(a).total_cmp(&away(b)));
        }
        CrowdLook::new(seen)
    }
}

/// Whether nothing stands between a camera and a square.
fn is_open(body: &Kinematic, corners: &[Point; 4], obstacles: &Obstacles) -> bool {
    let at = Point::from((corners[0].coords + corners[2].coords) / 2.0);
    Sight::of(body).sees(Place::on_ground(at), obstacles)
}

/// How many of so many are recognised, and who is not there besides.
fn drawn(truly: u32, recognised: f64, random: &mut SplitMix64) -> u32 {
    let mean = f64::from(truly) * recognised;
    let off = random.normal() * (mean * (1.0 - recognised)).sqrt();
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between nobody and all"
    )]
    let seen = (mean + off).round().clamp(0.0, f64::from(truly)) as u32;
    seen + u32::from(random.unit() < FALSE_EACH)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::{MoveSpec, Spec};
    use crate::world::{World, fixture};

    fn field(east: f64, north: f64, side: f64) -> Field {
        Field {
            low: (east, north),
            high: (east + side, north + side),
        }
    }

    /// Two thousand about the launch place of the first UAV, half of whom walk away east.
    fn spec() -> Spec {
        let spec = fixture::square(1);
        let at = spec.uavs[0].launch.position();
        let group = |moves| GroupSpec {
            people: 1_000,
            at: field(at.x - 20.0, at.y - 20.0, 40.0),
            moves,
        };
        let going = MoveSpec {
            from_ms: 10_000,
            over_ms: 20_000,
            way: vec![Point::new(at.x + 60.0, at.y)],
            to: field(at.x + 100.0, at.y - 10.0, 20.0),
            speed_mps: 1.2,
        };
        let crowd = CrowdSpec {
            groups: vec![group(Vec::new()), group(vec![going])],
            ..CrowdSpec::default()
        };
        Spec {
            crowd: Some(crowd),
            ..spec
        }
    }

    fn all(crowd: &Crowd) -> u32 {
        crowd.in_cells(crowd.low, crowd.size)
    }

    #[test]
    fn people_walk_and_nobody_is_lost() {
        let spec = spec();
        let at = spec.uavs[0].launch.position();
        let mut crowd = Crowd::new(spec.crowd.as_ref().unwrap(), 200, 4);
        let near = Point::new(
            (at.x / 2.0).round() * 2.0 - 24.0,
            (at.y / 2.0).round() * 2.0 - 24.0,
        );
        assert_eq!((all(&crowd), crowd.people()), (2_000, 2_000));
        assert_eq!(crowd.within(near, 48.0), 2_000);
        crowd.advance(60_000);
        let (under_way, on) = (crowd.within(near, 48.0), all(&crowd));
        assert_eq!(on, 2_000);
        crowd.advance(400_000);
        let left = crowd.within(near, 48.0);
        assert!(left == 1_000 && under_way >= left && under_way < 2_000);
        let again = Crowd::new(spec.crowd.as_ref().unwrap(), 200, 4);
        let mut other = Crowd::new(spec.crowd.as_ref().unwrap(), 200, 5);
        other.advance(0);
        assert!(
            again.south_west != other.south_west,
            "places are drawn from the seed"
        );
    }

    #[test]
    fn a_rectangle_holds_who_is_in_its_cells() {
        let spec = spec();
        let mut crowd = Crowd::new(spec.crowd.as_ref().unwrap(), 200, 4);
        crowd.advance(20_000);
        let mut random = SplitMix64::new(7);
        let mut drawn = |n: i32| i32::try_from(random.below(n.unsigned_abs() as usize)).unwrap();
        for _ in 0..200 {
            let low = (
                crowd.low.0 - 5 + drawn(crowd.size.0 + 10),
                crowd.low.1 - 5 + drawn(crowd.size.1 + 10),
            );
            let side = (1 + drawn(30), 1 + drawn(30));
            let is_in = |way: &&Vec<Step>| {
                let (col, row) = cell_of(at(way, 20_000));
                (low.0..low.0 + side.0).contains(&col) && (low.1..low.1 + side.1).contains(&row)
            };
            let counted = crowd.ways.iter().filter(is_in).count();
            assert_eq!(crowd.in_cells(low, side) as usize, counted);
        }
    }

    #[test]
    fn a_group_is_larger_or_smaller_by_the_seed_within_what_is_said() {
        let crowd = CrowdSpec {
            vary_permille: 100,
            vary_ms: 5_000,
            ..spec().crowd.unwrap()
        };
        let people = |seed| Crowd::new(&crowd, 200, seed).people();
        let all: Vec<usize> = (0..20).map(people).collect();
        assert!(all.iter().all(|n| (1_800..=2_200).contains(n)));
        assert!(all.iter().any(|n| *n < 1_950) && all.iter().any(|n| *n > 2_050));
        assert_eq!(people(3), people(3));
    }

    #[test]
    fn a_look_tells_about_as_many_as_are_there_in_whole_squares_of_its_picture() {
        let spec = spec();
        let uav = spec.uavs[0].id;
        let world = World::new(&spec, 5);
        let told = world.percept(uav).unwrap().crowd;
        assert_eq!(
            told,
            world.percept(uav).unwrap().crowd,
            "drawn from the time alone"
        );
        let picture = world.body(uav).unwrap().picture();
        assert!(told.seen().iter().all(|s| picture.holds(&s.corners())));
        let seen: u32 = told.seen().iter().map(|s| u32::from(s.people)).sum();
        let truly: u32 = told
            .seen()
            .iter()
            .map(|s| world.crowd().unwrap().within(s.corners()[0], SQUARE_M))
            .sum();
        // 80 to 90 % of them, and places are off by some metres.
        let share = f64::from(seen) / f64::from(truly.max(1));
        assert!(
            truly > 500 && (0.65..1.05).contains(&share),
            "{seen} of {truly}"
        );
        let without = World::new(&fixture::square(1), 5);
        assert!(without.percept(uav).unwrap().crowd.is_absent());
    }

    #[test]
    fn a_recogniser_looks_once_a_second() {
        let spec = spec();
        let crowd = Crowd::new(spec.crowd.as_ref().unwrap(), 200, 4);
        let looks = (0..10_u64).map(|k| crowd.looks_at(60 + 200 * k));
        assert_eq!(looks.filter(|l| *l).count(), 2);
    }
}
