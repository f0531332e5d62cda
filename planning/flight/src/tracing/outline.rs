//! What many tell of a contour, as one: the newest look first (D2.7 §3.1).
//!
//! Everybody tells stretches: places in the order in which they were flown along, each with the
//! time at which it was seen. A place beside which a newer stretch runs the same way is out of
//! date; what is left is strung together where one stretch ends near the begin of another.
//!
//! # Guarantees
//! Stretches merge in any order: equal sets give equal outlines. No place is told that nobody saw.
//!
//! # Complexity
//! Places times the pieces of stretches that lie as far east as they do.

use super::thread::Mark;
use core::cmp::Ordering;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::seconds;

/// Newer by so much is newer, milliseconds: no two looks at a place in passing are so far apart.
const NEWER_MS: u64 = 15_000;

/// A stretch runs beside a place that is no farther from it than this, metres: errors of two
/// UAVs, and what simplifying leaves out.
const BESIDE_M: f64 = 20.0;

/// The edge of a fire moves on meanwhile: so fast at most, m/s, and so far, metres.
const GROWS_MPS: f64 = 1.5;
const GROWN_MOST_M: f64 = 120.0;

/// Of two that run the same way directions differ by no more than this, as a cosine.
const ALIKE: f64 = 0.3;

/// A piece whose ends are that near closes where it is so many times as long.
const ROUND: f64 = 4.0;

/// What ends no farther from where another begins goes on there, metres.
const JOIN_M: f64 = 120.0;

/// No two places of a stretch that was simplified are farther apart, metres.
const LONGEST_M: f64 = 60.0;

/// What one UAV tells in one piece.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stretch {
    /// Places in the order of flight.
    pub marks: Vec<Mark>,
    /// Whether what the contour encloses is on their left, and may grow.
    pub sided: bool,
}

/// What is known of a contour.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// Pieces, the longest first; of a contour that was flown round one, whose end is near its
    /// begin.
    pub pieces: Vec<Vec<Mark>>,
    /// Whether the first piece closes.
    pub closed: bool,
}

impl Outline {
    /// The length of all pieces, metres, with what closes the first.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        let gap_m = self.gap().map_or(0.0, |(a, b)| (b - a).norm());
        self.pieces.iter().map(|p| length_m(p)).sum::<f64>() + gap_m
    }

    /// The area inside of the first piece, m²; none where it does not close.
    #[must_use]
    pub fn area_m2(&self) -> Option<f64> {
        self.gap()?;
        let ring: Vec<Point> = self.pieces[0].iter().map(|m| m.at).collect();
        let next = ring.iter().skip(1).chain(ring.first());
        let twice: f64 = ring
            .iter()
            .zip(next)
            .map(|(a, b)| a.coords.perp(&b.coords))
            .sum();
        Some(0.5 * twice.abs())
    }

    /// End and begin of the first piece, where it closes.
    fn gap(&self) -> Option<(Point, Point)> {
        let first = self.pieces.first().filter(|_| self.closed)?;
        Some((first.last()?.at, first.first()?.at))
    }
}

/// Fewer places that tell the same to within a tolerance, metres; the first and the last stay.
#[must_use]
pub fn simplified(marks: &[Mark], tolerance_m: f64) -> Vec<Mark> {
    let mut kept = Vec::new();
    let mut from = 0;
    let Some(first) = marks.first() else {
        return kept;
    };
    kept.push(*first);
    while from + 1 < marks.len() {
        let is_told = |to: usize| {
            let (a, b) = (marks[from].at, marks[to].at);
            let between = marks[from + 1..to].iter();
            (b - a).norm() <= LONGEST_M
                && between
                    .into_iter()
                    .all(|m| off_m(a, b, m.at) <= tolerance_m)
        };
        let mut to = from + 1;
        while to + 1 < marks.len() && is_told(to + 1) && !marks[to + 1].begins {
            to += 1;
        }
        kept.push(marks[to]);
        from = to;
    }
    kept
}

fn off_m(a: Point, b: Point, p: Point) -> f64 {
    let way = b - a;
    let square = way.norm_squared();
    let share = if square > 0.0 {
        ((p - a).dot(&way) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p - (a + way * share)).norm()
}

/// Two places between which something was seen.
struct Piece {
    from: Point,
    way: Vector,
    seen_ms: u64,
    sided: bool,
}

impl Piece {
    /// How far west and east of it a place may be beside which it runs.
    fn span_m(&self) -> (f64, f64) {
        let grown_m = if self.sided { GROWN_MOST_M } else { 0.0 };
        let reach_m = 2.0 * BESIDE_M + grown_m;
        let (a, b) = (self.from.x, self.from.x + self.way.x);
        (a.min(b) - reach_m, a.max(b) + reach_m)
    }
}

/// Pieces from west to east, in which those beside a place are found.
struct Pieces {
    by_west: Vec<(f64, Piece)>,
    /// The widest span of all, metres.
    widest_m: f64,
}

impl Pieces {
    fn of(stretches: &[Stretch]) -> Self {
        let (mut by_west, mut widest_m) = (Vec::new(), 0.0_f64);
        for piece in stretches.iter().flat_map(pieces_of) {
            let (west_m, east_m) = piece.span_m();
            widest_m = widest_m.max(east_m - west_m);
            by_west.push((west_m, piece));
        }
        by_west.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { by_west, widest_m }
    }

    /// All that may run beside a place, and others.
    fn near(&self, at: Point) -> impl Iterator<Item = &Piece> {
        let least_m = at.x - self.widest_m;
        let from = self
            .by_west
            .partition_point(|(west_m, _)| *west_m < least_m);
        let spanning = self.by_west.iter().skip(from);
        let spanning = spanning.take_while(move |(west_m, _)| *west_m <= at.x);
        spanning.map(|(_, piece)| piece)
    }
}

/// What all stretches tell together.
#[must_use]
pub fn outline(stretches: &[Stretch]) -> Outline {
    let pieces = Pieces::of(stretches);
    let mut runs: Vec<(Vec<Mark>, bool)> = Vec::new();
    for stretch in stretches {
        let mut run: Vec<Mark> = Vec::new();
        for (i, mark) in stretch.marks.iter().enumerate() {
            let way = way_at(&stretch.marks, i);
            let is_old = is_old(mark, way, stretch.sided, &pieces);
            if (mark.begins || is_old) && !run.is_empty() {
                runs.push((std::mem::take(&mut run), stretch.sided));
            }
            if !is_old {
                run.push(*mark);
            }
        }
        if !run.is_empty() {
            runs.push((run, stretch.sided));
        }
    }
    runs.sort_by(|a, b| order(&b.0, &a.0));
    strung(runs)
}

/// The order of two runs that are not empty: by their lengths, then by when and where they begin.
fn order(a: &[Mark], b: &[Mark]) -> Ordering {
    let (first, other) = (&a[0], &b[0]);
    length_m(a)
        .total_cmp(&length_m(b))
        .then(first.seen_ms.cmp(&other.seen_ms))
        .then(first.at.x.total_cmp(&other.at.x))
        .then(first.at.y.total_cmp(&other.at.y))
}

fn length_m(marks: &[Mark]) -> f64 {
    marks.windows(2).map(|b| (b[1].at - b[0].at).norm()).sum()
}

fn pieces_of(stretch: &Stretch) -> impl Iterator<Item = Piece> + '_ {
    let both = stretch.marks.windows(2).filter(|b| !b[1].begins);
    both.map(|b| Piece {
        from: b[0].at,
        way: b[1].at - b[0].at,
        seen_ms: b[0].seen_ms.max(b[1].seen_ms),
        sided: stretch.sided,
    })
}

/// Which way a stretch runs at one of its places.
fn way_at(marks: &[Mark], i: usize) -> Vector {
    let before = marks[i.saturating_sub(1)].at;
    let after = marks[(i + 1).min(marks.len() - 1)].at;
    after - before
}

/// Whether something newer runs the same way beside a place.
fn is_old(mark: &Mark, way: Vector, sided: bool, pieces: &Pieces) -> bool {
    pieces.near(mark.at).any(|p| {
        if p.seen_ms < mark.seen_ms + NEWER_MS || p.sided != sided {
            return false;
        }
        let grown_m = if sided {
            (GROWS_MPS * seconds(p.seen_ms - mark.seen_ms)).min(GROWN_MOST_M)
        } else {
            0.0
        };
        if !runs_beside(p, mark.at, grown_m) {
            return false;
        }
        let alike = way.dot(&p.way);
        let least = ALIKE * way.norm() * p.way.norm();
        if sided {
            alike >= least
        } else {
            alike.abs() >= least
        }
    })
}

/// Whether a place is beside a piece, and not before it: who is at its end has not seen what is
/// ahead.
fn runs_beside(p: &Piece, at: Point, grown_m: f64) -> bool {
    let length_m = p.way.norm();
    if length_m <= 0.0 {
        return false;
    }
    let to = at - p.from;
    let along_m = to.dot(&p.way) / length_m;
    let across_m = p.way.perp(&to).abs() / length_m;
    let overhang_m = (-along_m).max(along_m - length_m);
    overhang_m <= BESIDE_M && across_m <= BESIDE_M + grown_m
}

/// Whether a piece leads round: its ends are near each other, and it is far longer than that.
fn is_round(piece: &[Mark]) -> bool {
    let (Some(first), Some(last)) = (piece.first(), piece.last()) else {
        return false;
    };
    let gap_m = (first.at - last.at).norm();
    gap_m <= JOIN_M && length_m(piece) > ROUND * gap_m && piece.len() > 4
}

/// Strings runs together where one ends near the begin of another.
fn strung(runs: Vec<(Vec<Mark>, bool)>) -> Outline {
    let mut left: Vec<Option<(Vec<Mark>, bool)>> = runs.into_iter().map(Some).collect();
    let mut all = Outline::default();
    for i in 0..left.len() {
        let Some((mut piece, sided)) = left[i].take() else {
            continue;
        };
        while let (true, Some(end)) = (sided, piece.last().map(|m| m.at)) {
            let away = |slot: &Option<(Vec<Mark>, bool)>| {
                let (run, is_sided) = slot.as_ref()?;
                let away_m = (run.first()?.at - end).norm();
                (*is_sided && away_m <= JOIN_M).then_some(away_m)
            };
            let near = left.iter().enumerate();
            let near = near.filter_map(|(j, slot)| Some((away(slot)?, j)));
            let Some((away_m, j)) = near.min_by(|a, b| a.0.total_cmp(&b.0)) else {
                break;
            };
            let own_m = (piece[0].at - end).norm();
            // It closes rather than go round twice.
            if is_round(&piece) && own_m < away_m {
                break;
            }
            if let Some((run, _)) = left[j].take() {
                piece.extend(run);
            }
        }
        let closes = sided && is_round(&piece);
        all.closed |= closes && all.pieces.is_empty();
        all.pieces.push(piece);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::math::{TAU, cos, sin};
    use skein_geometry::random::SplitMix64;

    /// A part of a circle that grows, as it is flown along, from and to turns.
    fn arc(from: f64, to: f64, begun_ms: u64) -> Stretch {
        let n = 40_u32;
        let marks = (0..=n).map(|k| {
            let turns = from + (to - from) * f64::from(k) / f64::from(n);
            let seen_ms = begun_ms + u64::from(k) * 1_500;
            let radius_m = 200.0 + 0.2 * seconds(seen_ms);
            Mark {
                at: Point::new(radius_m * cos(TAU * turns), radius_m * sin(TAU * turns)),
                seen_ms,
                begins: k == 0,
            }
        });
        Stretch {
            marks: marks.collect(),
            sided: true,
        }
    }

    #[test]
    fn the_newest_look_counts_and_what_many_saw_closes() {
        // Two who are half a turn apart, each flies three quarters: a quarter is seen twice.
        let all = [arc(0.0, 0.75, 0), arc(0.5, 1.25, 0)];
        let told = outline(&all);
        assert!(told.closed, "{told:?}");
        let area_m2 = told.area_m2().unwrap();
        let round_m2 = 0.5 * TAU * 208.0 * 208.0;
        assert!(
            (area_m2 / round_m2 - 1.0).abs() < 0.06,
            "{}",
            area_m2 / round_m2
        );
        let swapped = outline(&[all[1].clone(), all[0].clone()]);
        assert_eq!(told, swapped);
        assert!(!outline(&all[..1]).closed);
        // A short stretch is not taken for a ring because its ends are near each other.
        assert!(!outline(&[arc(0.0, 0.08, 0)]).closed);
        // One who flies round alone twice tells what it saw in its last round.
        let alone = outline(&[arc(0.0, 1.0, 0), arc(1.0, 2.0, 60_000)]);
        assert!(alone.closed);
        assert!(
            (alone.length_m() / (TAU * 218.0) - 1.0).abs() < 0.08,
            "{}",
            alone.length_m()
        );
    }

    /// Pieces of any length, also far longer than others, anywhere.
    #[test]
    fn what_runs_beside_a_place_is_found_as_by_looking_at_all() {
        let mut random = SplitMix64::new(7);
        let mut drawn = |most: f64| random.unit() * most;
        let stretches: Vec<Stretch> = (0..60_u32)
            .map(|k| {
                let most_m = if k % 10 == 0 { 900.0 } else { 40.0 };
                let (mut x, mut y) = (drawn(900.0), drawn(300.0));
                let marks = (0..6).map(|i| {
                    (x, y) = (
                        x + drawn(most_m) - 0.5 * most_m,
                        y + drawn(most_m) - 0.5 * most_m,
                    );
                    Mark {
                        at: Point::new(x, y),
                        seen_ms: u64::from(k) * 9_000,
                        begins: i == 0,
                    }
                });
                Stretch {
                    marks: marks.collect(),
                    sided: k % 2 == 0,
                }
            })
            .collect();
        let pieces = Pieces::of(&stretches);
        let (mut beside, mut looked_at) = (0, 0);
        for _ in 0..300 {
            let at = Point::new(drawn(900.0), drawn(300.0));
            let runs = |p: &&Piece| {
                let grown_m = if p.sided { GROWN_MOST_M } else { 0.0 };
                runs_beside(p, at, grown_m)
            };
            let near = pieces.near(at).filter(runs).count();
            let all = pieces.by_west.iter().map(|(_, p)| p).filter(runs).count();
            assert_eq!(near, all, "{at:?}");
            beside += all;
            looked_at += pieces.near(at).count();
        }
        assert!(beside > 1_000 && looked_at < 300 * pieces.by_west.len());
    }

    #[test]
    fn a_road_that_is_flown_back_is_one_road() {
        let mark = |x: f64, seen_ms| Mark {
            at: Point::new(x, 0.0),
            seen_ms,
            begins: false,
        };
        let there = (0..20_u32).map(|k| mark(20.0 * f64::from(k), u64::from(k) * 1_500));
        let back = (0..20_u32).map(|k| mark(380.0 - 20.0 * f64::from(k), 60_000 + u64::from(k)));
        let road = |marks: Vec<Mark>| Stretch {
            marks,
            sided: false,
        };
        let told = outline(&[road(there.collect()), road(back.collect())]);
        assert_eq!(told.pieces.len(), 1);
        assert!((told.length_m() - 380.0).abs() < 1e-6 && !told.closed);
    }

    #[test]
    fn fewer_places_tell_the_same_to_within_the_tolerance() {
        let all = arc(0.0, 0.5, 0).marks;
        let few = simplified(&all, 3.0);
        assert!(few.len() < all.len(), "{}", few.len());
        assert_eq!((few[0], few[few.len() - 1]), (all[0], all[all.len() - 1]));
        for m in &all {
            let near = few.windows(2).map(|b| off_m(b[0].at, b[1].at, m.at));
            assert!(near.fold(f64::MAX, f64::min) <= 3.0 + 1e-9);
        }
        assert!(simplified(&[], 3.0).is_empty());
    }
}
