//! How many people a sector holds by one picture of it, and between which numbers (D2.7 §3.1).
//!
//! A recogniser finds [`RECOGNISED`] of those who are there, nobody knows which share of that
//! exactly, and each of them or not as if by chance; now and then somebody who is not there. Places
//! are off by the error of the UAV's own place, so at a border of the sector some are counted on
//! the wrong side: as many as the border has more people on one side than the other, by so much of
//! a square. The range is that share's, and two standard deviations of the rest beyond it.

use crate::targets::PLACE_M;
use skein_behaviors::crowd::{FALSE_EACH, RECOGNISED, SQUARE_M, Square};
use std::collections::BTreeMap;

/// So many standard deviations a range reaches beyond what the recogniser is specified by: nineteen
/// cases of twenty.
const DEVIATIONS: f64 = 2.0;

/// What is neither known nor sure of a border has so many people as this beside it, as a share of
/// those within.
const UNSEEN: [f64; 2] = [0.0, 1.0];

/// The squares of one picture.
#[derive(Debug)]
pub(super) struct Picture {
    squares: BTreeMap<(i16, i16), u16>,
}

/// What one picture holds of a sector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Held {
    /// People who were recognised.
    pub people: f64,
    /// Squares.
    pub squares: f64,
    /// By how many people it would be off if places were off by a square to the east or the west.
    pub east: f64,
    /// And to the north or the south.
    pub north: f64,
}

impl Picture {
    pub fn new<'a>(squares: impl Iterator<Item = &'a Square>) -> Self {
        Self {
            squares: squares.map(|s| ((s.col, s.row), s.people)).collect(),
        }
    }

    /// The south-west and the north-east corner of a box around all squares.
    pub fn bounds(&self) -> Option<(Square, Square)> {
        let cols = || self.squares.keys().map(|s| s.0);
        let rows = || self.squares.keys().map(|s| s.1);
        let corner = |col, row| Square {
            col,
            row,
            people: 0,
        };
        let low = corner(cols().min()?, rows().min()?);
        Some((low, corner(cols().max()?, rows().max()?)))
    }

    /// People in some squares; none where not all of them are known.
    fn sum(&self, squares: impl Iterator<Item = (i16, i16)>) -> Option<f64> {
        let each = squares.map(|s| self.squares.get(&s).map(|n| f64::from(*n)));
        each.sum()
    }

    /// What it holds of a sector, from its south-west square on; none where that is not all in it.
    pub fn held(&self, (low, side): (Square, i16)) -> Option<Held> {
        let span = 0..side;
        let (col, row) = (low.col, low.row);
        let column = |c: i16| self.sum(span.clone().map(|k| (c, row + k)));
        let line = |r: i16| self.sum(span.clone().map(|k| (col + k, r)));
        let mut people = 0.0;
        for c in span.clone() {
            people += column(col + c)?;
        }
        let east = off_by(
            (column(col)?, column(col + side - 1)?),
            (column(col - 1), column(col + side)),
        );
        let north = off_by(
            (line(row)?, line(row + side - 1)?),
            (line(row - 1), line(row + side)),
        );
        Some(Held {
            people,
            squares: f64::from(side) * f64::from(side),
            east,
            north,
        })
    }
}

/// By how many people a sector would be off, had it been moved by a square either way: what comes
/// in over one border, less what goes out over the other.
fn off_by((low, high): (f64, f64), (below, above): (Option<f64>, Option<f64>)) -> f64 {
    let beside = |known: Option<f64>, within: f64| match known {
        Some(n) => [n, n],
        None => UNSEEN.map(|share| share * within),
    };
    let up = beside(below, low).map(|n| (n - high).abs());
    let down = beside(above, high).map(|n| (n - low).abs());
    up.into_iter().chain(down).fold(0.0, f64::max)
}

/// People in a sector, at least and at most.
pub(super) fn estimate(held: &Held) -> (u16, u16, u16) {
    let false_ones = FALSE_EACH * held.squares;
    let seen = (held.people - false_ones).max(0.0);
    let share = (RECOGNISED.0 + RECOGNISED.1) / 2.0;
    let by_chance = (1.0 - share) * held.people + FALSE_EACH * (1.0 - FALSE_EACH) * held.squares;
    let place = PLACE_M / SQUARE_M;
    let by_place = (place * held.east).powi(2) + (place * held.north).powi(2);
    let off = DEVIATIONS * (by_chance + by_place).sqrt();
    let people = whole((seen / share).round());
    let low = whole(((seen - off) / RECOGNISED.1).floor());
    let high = whole(((seen + off) / RECOGNISED.0).ceil());
    (people, low.min(people), high.max(people))
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn whole(v: f64) -> u16 {
    v.max(0.0) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(people: impl Fn(i16, i16) -> u16) -> Picture {
        let all = (0..6).flat_map(|row| (0..6).map(move |col| (col, row)));
        let squares: Vec<Square> = all
            .map(|(col, row)| Square {
                col,
                row,
                people: people(col, row),
            })
            .collect();
        Picture::new(squares.iter())
    }

    fn at(col: i16, row: i16) -> (Square, i16) {
        let square = Square {
            col,
            row,
            people: 0,
        };
        (square, 2)
    }

    #[test]
    fn a_sector_is_counted_where_all_of_it_is_in_the_picture() {
        let picture = picture(|col, _| if col < 4 { 100 } else { 0 });
        assert_eq!(picture.held(at(5, 0)), None);
        let inside = picture.held(at(1, 1)).unwrap();
        assert_eq!(
            (inside.people, inside.east, inside.north),
            (400.0, 0.0, 0.0)
        );
        let border = picture.held(at(2, 2)).unwrap();
        assert_eq!(
            (border.people, border.east, border.north),
            (400.0, 200.0, 0.0)
        );
    }

    #[test]
    fn an_estimate_lies_in_its_range_which_grows_at_borders() {
        let held = |people: f64, east: f64| Held {
            people,
            squares: 4.0,
            east,
            north: 0.0,
        };
        let (people, low, high) = estimate(&held(850.8, 0.0));
        assert_eq!(people, 1_000);
        assert!(
            low > 900 && low < 940 && high < 1_100 && high > 1_060,
            "{low} {high}"
        );
        let (_, lower, higher) = estimate(&held(850.8, 400.0));
        assert!(lower + 100 < low && higher > high + 100);
        assert_eq!(estimate(&held(0.0, 0.0)), (0, 0, 2));
    }
}
