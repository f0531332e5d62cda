//! Streets as a follower knows them, and where on them a target is that is out of sight
//! (D2.7 §3.7).
//!
//! Streets are cut into pieces that are driven one way. A target that is seen drives on along
//! its street, and at a crossing into each street alike but back: those are the ways that an
//! orbit is chosen for ([`Streets::ways`]). One that is out of sight is somewhere on them by
//! chances ([`StreetChances`]): they move from piece to piece at its speed, stop and set off,
//! and what was looked at and not seen becomes less likely. After Skoglar, Orguner, Törnqvist
//! and Gustafsson, "Road target search and tracking with gimballed vision sensor on an unmanned
//! aerial vehicle", Remote Sensing 4 (2012): a target that keeps to roads is known better and
//! found sooner by a density on the roads than by one over the ground.
//!
//! # Guarantees
//! Without noise and clock: the same calls give the same chances. Their sum is one.
//!
//! # Complexity
//! [`MOST_PIECES`] pieces at most. A step and a look go once through all of them.

use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::exp;
use std::collections::BTreeMap;

/// Streets are cut into pieces of at most this, metres: what a car is within.
pub const PIECE_M: f64 = 12.0;

/// No more pieces are kept: the streets of five square kilometres of a city.
pub const MOST_PIECES: usize = 16_384;

/// And no piece counts as shorter than this, metres.
const LEAST_M: f64 = 0.1;

/// Ends nearer than this are one crossing, metres.
const JOINED_M: f64 = 0.5;

/// A target farther beside all streets than this is on none, metres.
const BESIDE_M: f64 = 25.0;

/// Slower than this it has no heading, m/s.
const STANDS_MPS: f64 = 1.5;

/// Of those that had a heading so much drives the other way: headings of slow ones err.
const AGAINST: f64 = 0.03;

/// Chances move in steps of this, milliseconds: within one hardly any piece is passed.
const STEP_MS: u64 = 200;

/// So many steps at most are made up for at once.
const MOST_STEPS: u64 = 1_500;

/// Who drives stops once in so many seconds, and who stands sets off once in so many.
const STOPS_S: f64 = 50.0;
const SETS_OFF_S: f64 = 12.0;

/// Who is out of sight drives at least this fast, or else stands, and no faster than that, m/s.
const LEAST_MPS: f64 = 3.0;
const MOST_MPS: f64 = 30.0;

/// Of who stood when it was seen last so much stands still.
const STANDING: f64 = 0.8;

/// Chances below this are none: they cost a look.
const NOTHING: f64 = 1e-6;

/// The most ways that are told of a target that drives on.
pub const MOST_WAYS: usize = 3;

/// A piece of a street, driven one way.
#[derive(Clone, Debug, PartialEq)]
struct Piece {
    from: Point,
    to: Point,
    length_m: f64,
    /// Pieces that one drives on to; the same piece the other way in a dead end.
    next: Vec<u32>,
}

impl Piece {
    fn middle(&self) -> Point {
        self.from + (self.to - self.from) * 0.5
    }

    fn direction(&self) -> Vector {
        (self.to - self.from) / self.length_m
    }

    /// How far along it the nearest place to a point is, metres, and how far that is beside it.
    fn nearest(&self, to: Point) -> (f64, f64) {
        let on_m = (to - self.from)
            .dot(&self.direction())
            .clamp(0.0, self.length_m);
        let off_m = (to - (self.from + self.direction() * on_m)).norm();
        (on_m, off_m)
    }
}

/// A map of streets. Piece 2n and piece 2n + 1 are the same ground, driven either way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Streets {
    pieces: Vec<Piece>,
}

impl Streets {
    /// Cuts lines of points into pieces. Points that are no numbers are left out; `None` where
    /// nothing is left, or more than [`MOST_PIECES`].
    #[must_use]
    pub fn of(lines: &[Vec<Point>]) -> Option<Self> {
        let mut pieces: Vec<Piece> = Vec::new();
        let mut begins: BTreeMap<(i64, i64), Vec<u32>> = BTreeMap::new();
        let mut known = std::collections::BTreeSet::new();
        for line in lines {
            let sound: Vec<Point> = line
                .iter()
                .copied()
                .filter(|p| p.x.is_finite() && p.y.is_finite())
                .collect();
            for both in sound.windows(2) {
                let ends = (key(both[0]), key(both[1]));
                let is_new = known.insert(ends) && known.insert((ends.1, ends.0));
                if ends.0 != ends.1 && is_new && !cut(both[0], both[1], &mut pieces) {
                    return None;
                }
            }
        }
        for (n, piece) in (0_u32..).zip(&pieces) {
            begins.entry(key(piece.from)).or_default().push(n);
        }
        for (n, piece) in (0_u32..).zip(pieces.iter_mut()) {
            let there = begins.get(&key(piece.to)).map_or(&[][..], Vec::as_slice);
            piece.next = there.iter().copied().filter(|m| *m != n ^ 1).collect();
            if piece.next.is_empty() {
                piece.next.push(n ^ 1);
            }
        }
        (!pieces.is_empty()).then_some(Self { pieces })
    }

    /// Length of all streets, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        // Each piece is there twice, once a way.
        self.pieces.iter().map(|p| p.length_m).sum::<f64>() / 2.0
    }

    /// How many pieces there are, each way counted.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pieces.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// The piece that a target is on, which moves so, m/s, and how far along it it is, metres.
    fn piece_at(&self, at: Point, velocity_mps: Vector) -> Option<(usize, f64)> {
        let mut best: Option<(f64, usize, f64)> = None;
        for (n, piece) in self.pieces.iter().enumerate() {
            // Before the exact distance: nothing nearer than a piece can be.
            if (piece.from - at).norm() > BESIDE_M + PIECE_M {
                continue;
            }
            let (on_m, off_m) = piece.nearest(at);
            // A street across is as good as one half its width farther away.
            let against = velocity_mps.norm() - velocity_mps.dot(&piece.direction());
            let cost = off_m + against.min(2.0 * MOST_MPS);
            if off_m <= BESIDE_M && best.is_none_or(|(least, _, _)| cost < least) {
                best = Some((cost, n, on_m));
            }
        }
        best.map(|(_, n, on_m)| (n, on_m))
    }

    /// Where a target is after each of so many steps of `step_s` seconds if it drives on, by
    /// each of at most [`MOST_WAYS`] ways that are told apart by crossings, the straightest
    /// first; nothing where it is on no street. What leads on is what the target has ahead
    /// within its speed: it neither stops nor turns back.
    #[must_use]
    pub fn ways(
        &self,
        at: Point,
        velocity_mps: Vector,
        step_s: f64,
        steps: usize,
    ) -> Vec<Vec<Point>> {
        let Some((piece, on_m)) = self.piece_at(at, velocity_mps) else {
            return Vec::new();
        };
        let each_m = velocity_mps.norm().min(MOST_MPS) * step_s;
        let first = Way {
            piece,
            on_m,
            places: Vec::new(),
        };
        let mut open = vec![first];
        for _ in 0..steps {
            let mut after = Vec::with_capacity(MOST_WAYS);
            let mut left = open.len();
            for way in open {
                // Ways part as long as there is room beside those that there are.
                let room = MOST_WAYS.saturating_sub(after.len() + left);
                left -= 1;
                self.drive(way, each_m, room, &mut after);
            }
            open = after;
        }
        open.into_iter().map(|w| w.places).collect()
    }

    /// Drives a way on by so much; at the first crossing it parts, as far as there is room.
    fn drive(&self, way: Way, each_m: f64, mut room: usize, after: &mut Vec<Way>) {
        let mut open = vec![(way, each_m)];
        while let Some((mut way, mut left_m)) = open.pop() {
            while way.on_m + left_m > self.pieces[way.piece].length_m {
                let here = &self.pieces[way.piece];
                left_m -= here.length_m - way.on_m;
                way.on_m = 0.0;
                let straight =
                    |n: &&u32| here.direction().dot(&self.pieces[**n as usize].direction());
                let best = here
                    .next
                    .iter()
                    .max_by(|a, b| straight(a).total_cmp(&straight(b)));
                let Some(best) = best else { break };
                for other in here.next.iter().filter(|n| *n != best) {
                    if room > 0 {
                        room -= 1;
                        let parted = Way {
                            piece: *other as usize,
                            ..way.clone()
                        };
                        open.push((parted, left_m));
                    }
                }
                way.piece = *best as usize;
            }
            way.on_m += left_m;
            let piece = &self.pieces[way.piece];
            way.places.push(piece.from + piece.direction() * way.on_m);
            after.push(way);
        }
    }
}

/// A way that a target may drive.
#[derive(Clone, Debug)]
struct Way {
    piece: usize,
    on_m: f64,
    places: Vec<Point>,
}

/// Cuts a street into pieces, there and back; says whether there was room.
fn cut(from: Point, to: Point, pieces: &mut Vec<Piece>) -> bool {
    let count = ((to - from).norm() / PIECE_M).ceil().max(1.0);
    if count > 1e6 {
        return false;
    }
    let mut k = 0.0;
    while k < count {
        // The last one ends where the next street begins, to the last digit.
        let at = |k: f64| {
            if k < count {
                from + (to - from) * (k / count)
            } else {
                to
            }
        };
        let (a, b) = (at(k), at(k + 1.0));
        if pieces.len() + 2 > MOST_PIECES {
            return false;
        }
        for (from, to) in [(a, b), (b, a)] {
            pieces.push(Piece {
                from,
                to,
                length_m: (to - from).norm().max(LEAST_M),
                next: Vec::new(),
            });
        }
        k += 1.0;
    }
    true
}

/// The square that a point lies in.
fn key(p: Point) -> (i64, i64) {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "float to integer casts saturate"
    )]
    let square = |m: f64| (m / JOINED_M).round() as i64;
    (square(p.x), square(p.y))
}

/// What was known of a target when it was seen last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LastSeen {
    /// When, milliseconds.
    pub at_ms: u64,
    /// Where.
    pub at: Point,
    /// To what, a standard deviation in metres.
    pub spread_m: f64,
    /// How it moved, m/s.
    pub velocity_mps: Vector,
    /// How fast it drives where it drives, m/s.
    pub usual_mps: f64,
}

/// Chances of where on the streets a target is.
#[derive(Clone, Debug, PartialEq)]
pub struct StreetChances {
    time_ms: u64,
    speed_mps: f64,
    /// Of each piece: that it drives there, and that it stands there.
    drives: Vec<f64>,
    stands: Vec<f64>,
}

impl StreetChances {
    /// Begins where it was seen last; nothing where that is on no street.
    #[must_use]
    pub fn new(streets: &Streets, last: &LastSeen) -> Option<Self> {
        streets.piece_at(last.at, last.velocity_mps)?;
        let spread_m = last.spread_m.max(PIECE_M);
        let mps = last.velocity_mps.norm();
        let standing = if mps < STANDS_MPS { STANDING } else { 0.0 };
        let here = streets.pieces.iter().map(|p| {
            let off = (p.middle() - last.at).norm() / spread_m;
            let along = if mps < STANDS_MPS {
                1.0
            } else {
                let ahead = (p.direction().dot(&last.velocity_mps) / mps).max(0.0);
                ahead * ahead + AGAINST
            };
            exp(-off * off / 2.0) * p.length_m * along
        });
        let here: Vec<f64> = here.collect();
        let mut chances = Self {
            time_ms: last.at_ms,
            speed_mps: last.usual_mps.max(mps).clamp(LEAST_MPS, MOST_MPS),
            drives: here.iter().map(|c| c * (1.0 - standing)).collect(),
            stands: here.iter().map(|c| c * standing).collect(),
        };
        chances.normalise();
        Some(chances)
    }

    fn normalise(&mut self) {
        let whole: f64 = self.drives.iter().chain(&self.stands).sum();
        // If it is nowhere it is anywhere.
        #[allow(clippy::cast_precision_loss, reason = "some thousands")]
        let even = 0.5 / self.drives.len().max(1) as f64;
        let is_somewhere = whole > f64::MIN_POSITIVE;
        for c in self.drives.iter_mut().chain(&mut self.stands) {
            *c = if is_somewhere { *c / whole } else { even };
        }
    }

    /// The chances at a later time, milliseconds.
    pub fn go_on(&mut self, streets: &Streets, to_ms: u64) {
        let steps = to_ms.saturating_sub(self.time_ms) / STEP_MS;
        self.time_ms += steps * STEP_MS;
        for _ in 0..steps.min(MOST_STEPS) {
            self.step(streets);
        }
        self.normalise();
    }

    fn step(&mut self, streets: &Streets) {
        let step_s = skein_geometry::math::seconds(STEP_MS);
        let (stops, sets_off) = (step_s / STOPS_S, step_s / SETS_OFF_S);
        let mut next = vec![0.0; self.drives.len()];
        for (n, piece) in streets.pieces.iter().enumerate() {
            let (drives, stands) = (self.drives[n], self.stands[n]);
            if drives + stands <= 0.0 {
                continue;
            }
            self.stands[n] = stands * (1.0 - sets_off) + drives * stops;
            // Who sets off may turn round where it stands.
            let starts = stands * sets_off;
            next[n] += starts * 0.7;
            next[n ^ 1] += starts * 0.3;
            let goes = drives * (1.0 - stops);
            let leaves = (self.speed_mps * step_s / piece.length_m).min(1.0);
            next[n] += goes * (1.0 - leaves);
            #[allow(clippy::cast_precision_loss, reason = "a few streets")]
            let each = goes * leaves / piece.next.len() as f64;
            for to in &piece.next {
                next[*to as usize] += each;
            }
        }
        self.drives = next;
    }

    /// Pieces for whose ends and middle `shows` holds were looked at, and it was not seen there; a
    /// look leaves the share `left` of what was there.
    pub fn look(&mut self, streets: &Streets, left: f64, shows: &dyn Fn(Point) -> bool) {
        let mut seen = false;
        for n in (0..self.drives.len()).step_by(2) {
            let here = self.of_ground(n);
            let piece = &streets.pieces[n];
            let is_shown = || shows(piece.middle()) && shows(piece.from) && shows(piece.to);
            if here > NOTHING && is_shown() {
                seen = true;
                for m in [n, n + 1] {
                    self.drives[m] *= left;
                    self.stands[m] *= left;
                }
            }
        }
        if seen {
            self.normalise();
        }
    }

    /// The chance of a piece and of the same ground the other way.
    fn of_ground(&self, n: usize) -> f64 {
        self.drives[n] + self.stands[n] + self.drives[n + 1] + self.stands[n + 1]
    }

    /// All places where it may be, with their chances.
    #[must_use]
    pub fn places(&self, streets: &Streets) -> Vec<(Point, f64)> {
        let all = (0..self.drives.len()).step_by(2);
        all.map(|n| (streets.pieces[n].middle(), self.of_ground(n)))
            .filter(|(_, chance)| *chance > NOTHING)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn line(points: &[(f64, f64)]) -> Vec<Point> {
        points.iter().map(|(x, y)| Point::new(*x, *y)).collect()
    }

    /// A street from west to east that another one crosses at the origin.
    fn crossing() -> Streets {
        let along = line(&[(-300.0, 0.0), (0.0, 0.0), (300.0, 0.0)]);
        let across = line(&[(0.0, -300.0), (0.0, 0.0), (0.0, 300.0)]);
        Streets::of(&[along, across]).unwrap()
    }

    fn last(velocity_mps: Vector) -> LastSeen {
        LastSeen {
            at_ms: 0,
            at: Point::new(-100.0, 1.0),
            spread_m: 5.0,
            velocity_mps,
            usual_mps: 8.0,
        }
    }

    fn near(chances: &StreetChances, streets: &Streets, at: Point, radius_m: f64) -> f64 {
        let places = chances.places(streets);
        let near = places.iter().filter(|(p, _)| (p - at).norm() <= radius_m);
        near.map(|(_, chance)| chance).sum()
    }

    #[test]
    fn a_target_drives_on_along_its_street_and_parts_at_a_crossing() {
        let streets = crossing();
        assert_eq!(streets.len(), 4 * 2 * 25);
        let ways = streets.ways(Point::new(-100.0, 1.0), Vector::new(10.0, 0.0), 2.0, 12);
        assert_eq!(ways.len(), 3);
        assert!(ways.iter().all(|w| w.len() == 12));
        // All are one until the crossing; the first is the straight one.
        assert!(
            ways.iter()
                .all(|w| (w[3] - Point::new(-20.0, 0.0)).norm() < 1e-6)
        );
        assert!(
            (ways[0][11] - Point::new(140.0, 0.0)).norm() < 1e-6,
            "{ways:?}"
        );
        let ends: Vec<f64> = ways[1..].iter().map(|w| w[11].y).collect();
        assert!((ends[0] + ends[1]).abs() < 1e-6 && (ends[0].abs() - 140.0).abs() < 1e-6);
        // Who is on no street has none, and who stands stays.
        assert!(
            streets
                .ways(Point::new(100.0, 100.0), Vector::zeros(), 2.0, 3)
                .is_empty()
        );
        let stays = streets.ways(Point::new(-100.0, 1.0), Vector::zeros(), 2.0, 3);
        assert!((stays[0][2] - Point::new(-100.0, 0.0)).norm() < 1e-6);
    }

    #[test]
    fn in_a_dead_end_it_turns_round() {
        let streets = Streets::of(&[line(&[(0.0, 0.0), (60.0, 0.0)])]).unwrap();
        let ways = streets.ways(Point::new(50.0, 0.0), Vector::new(10.0, 0.0), 1.0, 3);
        assert!(
            (ways[0][2] - Point::new(40.0, 0.0)).norm() < 1e-6,
            "{ways:?}"
        );
    }

    #[test]
    fn chances_drive_on_and_what_was_looked_at_is_elsewhere() {
        let streets = crossing();
        let mut chances = StreetChances::new(&streets, &last(Vector::new(8.0, 0.0))).unwrap();
        assert!(near(&chances, &streets, Point::new(-100.0, 0.0), 25.0) > 0.95);
        chances.go_on(&streets, 20_000);
        // 160 m on it is behind the crossing, in three streets.
        let arms = [(60.0, 0.0), (0.0, 60.0), (0.0, -60.0)];
        for (x, y) in arms {
            let here = near(&chances, &streets, Point::new(x, y), 59.0);
            assert!((0.15..0.4).contains(&here), "{x} {y}: {here}");
        }
        for _ in 0..20 {
            chances.look(&streets, 0.5, &|p| p.x > 1.0);
        }
        let east = near(&chances, &streets, Point::new(150.0, 0.0), 130.0);
        let north = near(&chances, &streets, Point::new(0.0, 60.0), 59.0);
        assert!(east < 0.01 && north > 0.3, "{east} {north}");
    }

    /// A house hides one end of a piece: it was not looked at.
    #[test]
    fn a_piece_that_is_shown_in_part_was_not_looked_at() {
        let streets = crossing();
        let at = Point::new(-100.0, 0.0);
        let begun = StreetChances::new(&streets, &last(Vector::zeros())).unwrap();
        let mut looked = begun.clone();
        looked.look(&streets, 0.5, &|p| (p - at).norm() <= 4.0);
        assert_eq!(looked, begun);
    }

    #[test]
    fn lines_that_are_no_streets_are_refused() {
        assert_eq!(Streets::of(&[]), None);
        assert_eq!(Streets::of(&[vec![Point::new(f64::NAN, 0.0); 3]]), None);
        assert_eq!(Streets::of(&[line(&[(0.0, 0.0), (1e9, 0.0)])]), None);
        assert_eq!(
            StreetChances::new(
                &crossing(),
                &LastSeen {
                    at: Point::new(100.0, 100.0),
                    ..last(Vector::zeros())
                }
            ),
            None
        );
    }

    proptest! {
        #[test]
        fn all_of_it_is_somewhere(
            vx in -20.0..20.0_f64, vy in -20.0..20.0_f64, s in 0_u64..90, x in -300.0..300.0_f64,
        ) {
            let streets = crossing();
            let mut chances = StreetChances::new(&streets, &last(Vector::new(vx, vy))).unwrap();
            chances.go_on(&streets, s * 1000);
            chances.look(&streets, 0.5, &|p| p.x > x);
            chances.go_on(&streets, s * 1500);
            let all: f64 = chances.drives.iter().chain(&chances.stands).sum();
            prop_assert!((all - 1.0).abs() < 1e-9);
            prop_assert!(chances.drives.iter().chain(&chances.stands).all(|c| *c >= 0.0));
        }
    }
}
