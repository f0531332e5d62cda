//! Where a target that is out of sight may be, and where to look for it (D2.7 §3.7).
//!
//! A map of chances over squares and headings, after Bourgault, Furukawa and Durrant-Whyte,
//! "Coordinated decentralized search for a lost target in a Bayesian world" (2003). It begins
//! where the target was seen last. Of one that drove all of it drives on at the target's speed, and
//! turns off now and then; of one that stood most stays, and the rest sets off in any direction, mostly at right angles, as on streets that nobody told of; where
//! vehicles were seen to drive is likelier than elsewhere. What was
//! looked at and not seen becomes less likely. Who searches flies to where most chance can be
//! looked at soonest.
//!
//! # Guarantees
//! Without noise and clock: the same calls give the same map. The sum of all chances is one.
//! What would leave the map turns back at its edge. No place is flown to for ever.
//!
//! # Complexity
//! [`SIDE`]² squares with [`HEADINGS`] headings each, and standing: 37,000 numbers, gone through once for
//! each [`STEP_S`] and each look, and once for each choice of where to fly.

use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{TAU, sin_cos, wrap_pi};

/// Squares along each side: 1.6 km.
pub const SIDE: usize = 64;

/// Side of a square, metres: a camera of 60 m to either side sees several at once.
pub const SQUARE_M: f64 = 25.0;

/// Headings that are told apart.
pub const HEADINGS: usize = 8;

/// The map goes on in steps of this, seconds: within one nothing crosses a square.
pub const STEP_S: f64 = 1.0;

/// Steps at most that are made up for at once: by then the map is as good as even.
const MOST_STEPS: u32 = 400;

/// A target turns off after about so many metres: a city block.
const BLOCK_M: f64 = 120.0;

/// Of those that turn off, so many take a right angle to each side; the others half of one.
const SQUARE_TURNS: f64 = 0.4;

/// Who sets off, or of whom no speed is known, moves on at this, m/s.
const LEAST_MPS: f64 = 4.0;

/// Slower than this it has no heading, m/s.
const STANDS_MPS: f64 = 1.0;

/// Of who stands so much still does when nobody saw it any more; of who drives slower than
/// [`LEAST_MPS`] so much may stand after all, for a speed of some looks is off by a walk's.
const STANDING: f64 = 0.8;
const MAY_STAND: f64 = 0.4;

/// Who stands sets off once in so many seconds.
const SETS_OFF_S: f64 = 600.0;

/// Chances of a square: those of each heading, and that it stands.
const STATES: usize = HEADINGS + 1;

/// The last of them.
const STANDS: usize = HEADINGS;

/// What a second leaves of the chance that it drives where nobody was seen to drive, beside
/// that it keeps to a known way: after half a minute it is a tenth.
const OFF_WAYS: f64 = 0.93;

/// Faster than this nothing drives that is followed, m/s.
const MOST_MPS: f64 = 20.0;

/// What a look leaves of the chance that it is there after all: nine in ten are recognised,
/// and looks that follow each other have the same houses in their way.
const LEFT: f64 = 0.3;

/// Time that a look costs however near it is, seconds: to turn there.
const TURN_S: f64 = 5.0;

/// Who flies to a place goes on as long as that is worth so much of the best one.
const KEPT: f64 = 0.7;

/// Squares to each side of a place that are looked at together.
const AROUND: usize = 2;

/// Who has not had a place in view after so many times the time of flight there, and so many
/// seconds, never will: a zone is in the way.
const PATIENCE: f64 = 1.5;
const PATIENCE_S: f64 = 15.0;

/// A chance below this is none.
const NOTHING: f64 = 1e-6;

/// Where a target may be.
#[derive(Clone, Debug, PartialEq)]
pub struct ChanceMap {
    /// The south-western corner.
    corner: Point,
    speed_mps: f64,
    /// Time of the map, milliseconds.
    time_ms: u64,
    /// What a step leaves of the chances in a square, beside a way that vehicles are known to
    /// drive on; empty where none is known.
    kept: Vec<f64>,
    /// Chances by row from the south, column from the west, and heading from the east on
    /// counter-clockwise; after these that it stands there.
    chances: Vec<f64>,
    /// Where is flown to, as a square, and until when, milliseconds.
    aim: Option<(usize, u64)>,
}

fn at_index(column: usize, row: usize) -> usize {
    row * SIDE + column
}

/// Square beside a square in the direction of a heading; none beyond the edge.
fn beside(square: usize, heading: usize) -> Option<usize> {
    const EAST: [isize; HEADINGS] = [1, 1, 0, -1, -1, -1, 0, 1];
    const NORTH: [isize; HEADINGS] = [0, 1, 1, 1, 0, -1, -1, -1];
    let column = (square % SIDE).checked_add_signed(EAST[heading])?;
    let row = (square / SIDE).checked_add_signed(NORTH[heading])?;
    (column < SIDE && row < SIDE).then(|| at_index(column, row))
}

fn turned(heading: usize, by: usize) -> usize {
    (heading + by) % HEADINGS
}

impl ChanceMap {
    /// It was seen at a time, milliseconds, about a place with this spread, metres, and moved
    /// so, m/s; who stands may set off in any direction.
    #[must_use]
    pub fn new(time_ms: u64, at: Point, spread_m: f64, velocity_mps: Vector) -> Self {
        #[allow(clippy::cast_precision_loss, reason = "64")]
        let half_m = SIDE as f64 * SQUARE_M / 2.0;
        let mut map = Self {
            corner: at - Vector::new(half_m, half_m),
            speed_mps: velocity_mps.norm().clamp(LEAST_MPS, MOST_MPS),
            time_ms,
            kept: Vec::new(),
            chances: vec![0.0; SIDE * SIDE * STATES],
            aim: None,
        };
        let headings = if velocity_mps.norm() < STANDS_MPS {
            [1.0; HEADINGS]
        } else {
            along(velocity_mps)
        };
        let stands = match velocity_mps.norm() {
            mps if mps < STANDS_MPS => STANDING,
            mps if mps < LEAST_MPS => MAY_STAND,
            _ => 0.0,
        };
        let whole: f64 = headings.iter().sum();
        let spread_m = spread_m.clamp(SQUARE_M / 2.0, half_m);
        for square in 0..SIDE * SIDE {
            let off = (map.middle(square) - at).norm() / spread_m;
            let here = skein_geometry::math::exp(-off * off / 2.0);
            for (heading, share) in headings.iter().enumerate() {
                map.chances[square * STATES + heading] = here * share * (1.0 - stands);
            }
            map.chances[square * STATES + STANDS] = here * whole * stands;
        }
        map.normalise();
        map
    }

    /// Vehicles were seen to drive where this holds: elsewhere it is less likely, and the less
    /// the longer ago it was seen.
    #[must_use]
    pub fn on_ways(mut self, is_driven: &dyn Fn(Point) -> bool) -> Self {
        let kept = |square| {
            if is_driven(self.middle(square)) {
                1.0
            } else {
                OFF_WAYS
            }
        };
        self.kept = (0..SIDE * SIDE).map(kept).collect();
        self
    }

    /// The middle of a square.
    fn middle(&self, square: usize) -> Point {
        #[allow(clippy::cast_precision_loss, reason = "64 at most")]
        let metres = |n: usize| (n as f64 + 0.5) * SQUARE_M;
        self.corner + Vector::new(metres(square % SIDE), metres(square / SIDE))
    }

    /// Sum of the chances of a square.
    fn of_square(&self, square: usize) -> f64 {
        let first = square * STATES;
        self.chances[first..first + STATES].iter().sum()
    }

    fn normalise(&mut self) {
        let whole: f64 = self.chances.iter().sum();
        if whole > 0.0 {
            self.chances.iter_mut().for_each(|c| *c /= whole);
        } else {
            // It is nowhere, so it is anywhere.
            #[allow(clippy::cast_precision_loss, reason = "37,000")]
            let even = 1.0 / self.chances.len() as f64;
            self.chances.fill(even);
        }
    }

    /// The map at a later time, milliseconds.
    pub fn go_on(&mut self, to_ms: u64) {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a constant"
        )]
        let step_ms = (STEP_S * 1000.0) as u64;
        let mut left = MOST_STEPS;
        while self.time_ms + step_ms <= to_ms {
            self.time_ms += step_ms;
            if left > 0 {
                left -= 1;
                self.step();
            }
        }
        self.normalise();
    }

    /// One step: a part of each chance comes into the next square, a part turns off.
    fn step(&mut self) {
        let turns = (STEP_S * self.speed_mps / BLOCK_M).min(0.5);
        let mut next = vec![0.0; self.chances.len()];
        for square in 0..SIDE * SIDE {
            let stands = self.chances[square * STATES + STANDS];
            if stands > 0.0 {
                let sets_off = stands * STEP_S / SETS_OFF_S;
                next[square * STATES + STANDS] += stands - sets_off;
                #[allow(clippy::cast_precision_loss, reason = "8")]
                let each = sets_off / HEADINGS as f64;
                for heading in 0..HEADINGS {
                    next[square * STATES + heading] += each;
                }
            }
            for heading in 0..HEADINGS {
                let chance = self.chances[square * STATES + heading];
                if chance <= 0.0 {
                    continue;
                }
                let is_slanting = heading % 2 == 1;
                let length_m = if is_slanting {
                    SQUARE_M * core::f64::consts::SQRT_2
                } else {
                    SQUARE_M
                };
                let moves = (STEP_S * self.speed_mps / length_m).min(1.0);
                let (to, course) = match beside(square, heading) {
                    Some(to) => (to, heading),
                    None => (square, turned(heading, HEADINGS / 2)),
                };
                let mut put = |square: usize, heading: usize, chance: f64| {
                    next[square * STATES + heading] += chance;
                };
                for (place, course, part) in [(square, heading, 1.0 - moves), (to, course, moves)] {
                    let part = chance * part;
                    put(place, course, part * (1.0 - turns));
                    for (by, share) in [
                        (2, SQUARE_TURNS),
                        (HEADINGS - 2, SQUARE_TURNS),
                        (1, 0.5 - SQUARE_TURNS),
                        (HEADINGS - 1, 0.5 - SQUARE_TURNS),
                    ] {
                        put(place, turned(course, by), part * turns * share);
                    }
                }
            }
        }
        for (here, kept) in next.chunks_mut(STATES).zip(&self.kept) {
            // Who stands may stand in a yard.
            here[..HEADINGS].iter_mut().for_each(|c| *c *= kept);
        }
        self.chances = next;
    }

    /// Squares for whose middle `in_view` holds were looked at, and it was not seen there.
    pub fn look(&mut self, in_view: &dyn Fn(Point) -> bool) {
        let mut seen = false;
        for square in 0..SIDE * SIDE {
            if in_view(self.middle(square)) {
                seen = true;
                self.scale(square, LEFT);
            }
        }
        if seen {
            self.normalise();
        }
    }

    /// Where a UAV that is here and flies so fast, m/s, looks next: most chance in the least
    /// time. It stays with a place as long as that is nearly as good as the best. Places that
    /// `may_fly` refuses are left out.
    pub fn look_next(
        &mut self,
        from: Point,
        airspeed_mps: f64,
        may_fly: &dyn Fn(Point) -> bool,
    ) -> Option<Point> {
        if let Some((aim, until_ms)) = self.aim
            && self.time_ms > until_ms
        {
            let near = |square: &usize| {
                let apart = |n: usize, m: usize| n.abs_diff(m) <= AROUND;
                apart(square % SIDE, aim % SIDE) && apart(square / SIDE, aim / SIDE)
            };
            let given_up: Vec<usize> = (0..SIDE * SIDE).filter(near).collect();
            given_up
                .into_iter()
                .for_each(|s| self.scale(s, LEFT * LEFT));
            self.normalise();
            self.aim = None;
        }
        let sums = self.sums();
        let worth = |square: usize| {
            let away_m = (self.middle(square) - from).norm();
            around(&sums, square) / (away_m / airspeed_mps.max(1.0) + TURN_S)
        };
        let mut best: Option<(usize, f64)> = None;
        for square in 0..SIDE * SIDE {
            let worth = worth(square);
            if best.is_none_or(|(_, most)| worth > most) && may_fly(self.middle(square)) {
                best = Some((square, worth));
            }
        }
        let (found, most) = best?;
        let kept = self.aim.filter(|(aim, _)| worth(*aim) >= KEPT * most);
        let (aim, until_ms) = kept.unwrap_or_else(|| {
            let away_s = (self.middle(found) - from).norm() / airspeed_mps.max(1.0);
            let patience_ms = (PATIENCE * away_s + PATIENCE_S) * 1000.0;
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "an hour at most: no map is wider"
            )]
            let until_ms = self.time_ms + patience_ms as u64;
            (found, until_ms)
        });
        self.aim = Some((aim, until_ms));
        Some(self.middle(aim))
    }

    fn scale(&mut self, square: usize, by: f64) {
        let first = square * STATES;
        let here = &mut self.chances[first..first + STATES];
        here.iter_mut().for_each(|c| *c *= by);
    }

    /// The chance within so many metres of a place.
    #[must_use]
    pub fn within(&self, at: Point, radius_m: f64) -> f64 {
        let squares = 0..SIDE * SIDE;
        let near = squares.filter(|s| (self.middle(*s) - at).norm() <= radius_m);
        near.map(|s| self.of_square(s)).sum()
    }

    /// All places where it may be, with their chances: the middles of squares.
    #[must_use]
    pub fn places(&self) -> Vec<(Point, f64)> {
        let all = (0..SIDE * SIDE).map(|s| (self.middle(s), self.of_square(s)));
        all.filter(|(_, chance)| *chance > NOTHING).collect()
    }

    /// Sums of all squares south and west of each corner.
    fn sums(&self) -> Vec<f64> {
        let mut sums = vec![0.0; (SIDE + 1) * (SIDE + 1)];
        for row in 0..SIDE {
            let mut of_row = 0.0;
            for column in 0..SIDE {
                of_row += self.of_square(at_index(column, row));
                sums[(row + 1) * (SIDE + 1) + column + 1] =
                    sums[row * (SIDE + 1) + column + 1] + of_row;
            }
        }
        sums
    }
}

/// What is looked at from above a square.
fn around(sums: &[f64], square: usize) -> f64 {
    let (column, row) = (square % SIDE, square / SIDE);
    let (west, south) = (column.saturating_sub(AROUND), row.saturating_sub(AROUND));
    let (east, north) = (
        (column + AROUND + 1).min(SIDE),
        (row + AROUND + 1).min(SIDE),
    );
    let sum = |column: usize, row: usize| sums[row * (SIDE + 1) + column];
    sum(east, north) - sum(west, north) - sum(east, south) + sum(west, south)
}

/// Shares of the two headings beside a velocity.
fn along(velocity_mps: Vector) -> [f64; HEADINGS] {
    #[allow(clippy::cast_precision_loss, reason = "8")]
    let between = TAU / HEADINGS as f64;
    let mut shares = [0.0; HEADINGS];
    for (heading, share) in shares.iter_mut().enumerate() {
        #[allow(clippy::cast_precision_loss, reason = "8")]
        let (sin, cos) = sin_cos(heading as f64 * between);
        let across = Vector::new(cos, sin).perp(&velocity_mps);
        let ahead = Vector::new(cos, sin).dot(&velocity_mps);
        let off = wrap_pi(skein_geometry::math::atan2(across, ahead)).abs();
        *share = (1.0 - off / between).max(0.0);
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sum(map: &ChanceMap) -> f64 {
        map.chances.iter().sum()
    }

    #[test]
    fn it_drives_on_and_turns_off() {
        let mut map = ChanceMap::new(0, Point::new(100.0, 50.0), 5.0, Vector::new(6.0, 0.0));
        assert!(map.within(Point::new(100.0, 50.0), 40.0) > 0.9);
        map.go_on(15_500);
        // Most went on, some turned off, none came back.
        let ahead = map.within(Point::new(190.0, 50.0), 60.0);
        let left = map.within(Point::new(140.0, 110.0), 60.0);
        let behind = map.within(Point::new(10.0, 50.0), 60.0);
        assert!(
            ahead > 0.3 && left > 0.05 && behind < 0.02,
            "{ahead} {left} {behind}"
        );
        assert!((sum(&map) - 1.0).abs() < 1e-9);
        assert_eq!(map.time_ms, 15_000);
    }

    #[test]
    fn it_keeps_to_ways_that_are_known() {
        let mut map = ChanceMap::new(0, Point::origin(), 5.0, Vector::new(6.0, 0.0));
        map = map.on_ways(&|p| p.y.abs() < 30.0 || (p.x - 150.0).abs() < 30.0);
        map.go_on(50_000);
        let way = |p: Point| map.within(p, 40.0);
        let on = way(Point::new(300.0, 0.0)) + way(Point::new(150.0, 150.0));
        let off = way(Point::new(220.0, 150.0)) + way(Point::new(80.0, 150.0));
        assert!(on > 4.0 * off, "{on} {off}");
        assert!((sum(&map) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_was_looked_at_is_left_for_what_was_not() {
        let mut map = ChanceMap::new(0, Point::origin(), 5.0, Vector::new(6.0, 0.0));
        map.go_on(40_000);
        let from = Point::new(0.0, -200.0);
        let first = map.look_next(from, 14.0, &|_| true).unwrap();
        let seen = map.within(first, 60.0);
        for _ in 0..10 {
            map.look(&|p| (p - first).norm() <= 60.0);
        }
        assert!(map.within(first, 55.0) < seen / 20.0);
        let next = map.look_next(from, 14.0, &|_| true).unwrap();
        assert!((next - first).norm() > 60.0);
        let north = map.look_next(from, 14.0, &|p| p.y > 100.0).unwrap();
        // It stays with a place that is as good, whatever else may be flown to.
        assert_eq!(north, next);
        map.aim = None;
        assert!(map.look_next(from, 14.0, &|p| p.y > 100.0).unwrap().y > 100.0);
        assert_eq!(map.look_next(from, 14.0, &|_| false), None);
    }

    /// What is to be rescued mostly stays where it is.
    #[test]
    fn who_stood_is_looked_for_where_it_stood_also_after_minutes() {
        let at = Point::new(40.0, 10.0);
        for (mps, least) in [(0.0, 0.6), (0.9, 0.6), (1.2, 0.25)] {
            let mut map = ChanceMap::new(0, at, 5.0, Vector::new(mps, 0.0));
            map.go_on(120_000);
            let here = map.within(at, 60.0);
            assert!(here > least, "{mps} {here}");
            let first = map.look_next(Point::new(-300.0, 0.0), 14.0, &|_| true);
            assert!((first.unwrap() - at).norm() < 60.0, "{mps} {first:?}");
        }
        let mut drives = ChanceMap::new(0, at, 5.0, Vector::new(6.0, 0.0));
        drives.go_on(120_000);
        assert!(drives.within(at, 60.0) < 0.1);
    }

    #[test]
    fn a_place_that_cannot_be_looked_at_is_given_up() {
        let mut map = ChanceMap::new(0, Point::origin(), 5.0, Vector::zeros());
        let from = Point::new(-100.0, 0.0);
        let first = map.look_next(from, 14.0, &|_| true).unwrap();
        map.go_on(20_000);
        assert_eq!(map.look_next(from, 14.0, &|_| true), Some(first));
        map.go_on(60_000);
        assert_ne!(map.look_next(from, 14.0, &|_| true), Some(first));
    }

    /// How long a search takes for a target that drives on and turns off wherever it likes, by
    /// one who comes late and is three times as fast at most; none in ten minutes.
    fn searched(seed: u64, late_s: u64) -> Option<u64> {
        let mut random = skein_geometry::random::SplitMix64::new(seed);
        let mut at = Point::new(random.unit() * 90.0, 0.0);
        let mut course = Vector::new(6.0, 0.0);
        let mut map = ChanceMap::new(0, at, 5.0, course);
        let mut uav = at - Vector::new(150.0, 150.0);
        for k in 0..600_u64 {
            if k % 15 == 14 && random.unit() < 0.5 {
                let left = Vector::new(-course.y, course.x);
                course = if random.unit() < 0.5 { left } else { -left };
            }
            at += course;
            map.go_on((k + 1) * 1000);
            if k < late_s {
                continue;
            }
            if (uav - at).norm() <= 50.0 {
                return Some(k);
            }
            map.look(&|p| (p - uav).norm() <= 50.0);
            let aim = map.look_next(uav, 14.0, &|_| true)?;
            let to = aim - uav;
            uav += to * (14.0 / to.norm().max(14.0));
        }
        None
    }

    #[test]
    fn who_comes_at_once_finds_most_and_who_comes_late_finds_some() {
        let within = |late_s: u64, s: u64| {
            let found = (0..24).map(|seed| searched(seed, late_s));
            found.filter(|f| f.is_some_and(|k| k <= s)).count()
        };
        // Three quarters on the way there; some turned off just before.
        let (soon, later) = (within(0, 30), within(0, 90));
        assert!(soon >= 16 && later >= 20, "{soon} {later}");
        // It may be two kilometres away by the end: most of those are never found.
        let found = within(15, 599);
        assert!(found >= 5, "{found}");
    }

    proptest! {
        /// Chances stay chances, whatever is looked at.
        #[test]
        fn all_of_it_is_somewhere(x in -700.0..700.0_f64, vx in -30.0..30.0_f64, steps in 0..60_u64) {
            let mut map = ChanceMap::new(7, Point::new(x, 3.0), 40.0, Vector::new(vx, 1.0));
            map.go_on(steps * 500);
            map.look(&|p| p.x > x);
            map.go_on(steps * 1000);
            prop_assert!((sum(&map) - 1.0).abs() < 1e-9);
            prop_assert!(map.chances.iter().all(|c| *c >= 0.0));
        }
    }
}
