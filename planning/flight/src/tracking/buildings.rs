//! Buildings as a follower knows them: whether one of them stands before a vehicle (D2.7 §3.7.1).
//!
//! A building is a footprint with a flat roof over level ground. A line of sight from above comes
//! below a roof only near to its lower end, so only what stands within that stretch can hide:
//! squares over the ground tell which buildings that may be, and their outlines are asked.
//!
//! # Guarantees
//! The same calls give the same answers. Numbers that are none hide nothing.
//!
//! # Complexity
//! A line of sight costs the squares of [`SQUARE_M`] below the highest roof, a few, and the edges
//! of the buildings in them whose box it meets.

use super::streets::Streets;
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_geometry::polygon::segments_meet;
use std::collections::BTreeMap;

/// A vehicle is seen by its middle, so high above the ground, metres.
pub const MIDDLE_M: f64 = 1.0;

/// Buildings are found by squares of this side, metres: that of a block's court.
pub const SQUARE_M: f64 = 32.0;

/// What is larger than so many squares is not put into them, nor looked up by them: so nothing
/// that is told or asked makes them many.
const MOST_SQUARES: i64 = 1_024;

/// A building.
#[derive(Clone, Debug, PartialEq)]
pub struct Building {
    /// Its outline on the ground.
    pub footprint: Polygon,
    /// How high its roof is above the ground, metres.
    pub roof_m: f64,
}

/// All buildings that are known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Buildings {
    all: Vec<Building>,
    squares: BTreeMap<(i32, i32), Vec<u32>>,
    /// Those that are too large for squares.
    wide: Vec<u32>,
    highest_m: f64,
}

/// What is known of a town: what hides, and where one drives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Town {
    /// Its buildings.
    pub buildings: Buildings,
    /// Its streets, where they are known.
    pub streets: Option<Streets>,
}

impl Buildings {
    /// Puts buildings into squares; those that hide no vehicle are left out.
    #[must_use]
    pub fn of(all: impl IntoIterator<Item = Building>) -> Self {
        let mut own = Self::default();
        for building in all.into_iter().filter(|b| b.roof_m > MIDDLE_M) {
            let Ok(n) = u32::try_from(own.all.len()) else {
                break;
            };
            own.highest_m = own.highest_m.max(building.roof_m);
            let (low, high) = building.footprint.bounds();
            let (from, to) = (square(low), square(high));
            if count(from, to) > MOST_SQUARES {
                own.wide.push(n);
            } else {
                for at in squares(from, to) {
                    own.squares.entry(at).or_default().push(n);
                }
            }
            own.all.push(building);
        }
        own
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Whether from a place, so many metres above the ground, one of them hides a vehicle that is
    /// at another place.
    #[must_use]
    pub fn hide(&self, from: Point, height_m: f64, at: Point) -> bool {
        let Some(end) = below(from, height_m, at, self.highest_m) else {
            return false;
        };
        let (low, high) = bounds(at, end);
        let (first, last) = (square(low), square(high));
        let hides = |building: &Building| {
            below(from, height_m, at, building.roof_m)
                .is_some_and(|end| building.is_met_by(at, end))
        };
        if count(first, last) > MOST_SQUARES {
            return self.all.iter().any(hides);
        }
        let none = Vec::new();
        let near = squares(first, last);
        let near = near.flat_map(|at| self.squares.get(&at).unwrap_or(&none));
        let mut near = near.chain(&self.wide);
        near.any(|n| hides(&self.all[*n as usize]))
    }
}

impl Building {
    /// Whether a stretch over the ground touches its footprint.
    fn is_met_by(&self, a: Point, b: Point) -> bool {
        let ((low, high), (min, max)) = (self.footprint.bounds(), bounds(a, b));
        let apart = max.x < low.x || high.x < min.x || max.y < low.y || high.y < min.y;
        if apart {
            return false;
        }
        let mut edges = self.footprint.edges();
        self.footprint.contains(a) || edges.any(|(c, d)| segments_meet(a, b, c, d))
    }
}

/// Where over the ground the line of sight from above to a vehicle rises through a height; the
/// place of who looks, if that is lower still. None where all of the line is higher, or nothing
/// about it is a number.
fn below(from: Point, height_m: f64, at: Point, roof_m: f64) -> Option<Point> {
    let is_sound = from.coords.norm().is_finite() && at.coords.norm().is_finite();
    if !is_sound || !height_m.is_finite() || roof_m <= MIDDLE_M {
        return None;
    }
    if height_m <= roof_m {
        return Some(from);
    }
    Some(at + (from - at) * ((roof_m - MIDDLE_M) / (height_m - MIDDLE_M)))
}

fn bounds(a: Point, b: Point) -> (Point, Point) {
    (
        Point::new(a.x.min(b.x), a.y.min(b.y)),
        Point::new(a.x.max(b.x), a.y.max(b.y)),
    )
}

/// The square that a point lies in.
fn square(p: Point) -> (i32, i32) {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a cast of a float saturates"
    )]
    let nth = |m: f64| (m / SQUARE_M).floor() as i32;
    (nth(p.x), nth(p.y))
}

/// How many squares a box has.
fn count(from: (i32, i32), to: (i32, i32)) -> i64 {
    let side = |a: i32, b: i32| i64::from(b) - i64::from(a) + 1;
    side(from.0, to.0).saturating_mul(side(from.1, to.1))
}

/// All squares of a box.
fn squares(from: (i32, i32), to: (i32, i32)) -> impl Iterator<Item = (i32, i32)> {
    (from.0..=to.0).flat_map(move |x| (from.1..=to.1).map(move |y| (x, y)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn block(west_m: f64, south_m: f64, side_m: f64, roof_m: f64) -> Building {
        let corner = |x: f64, y: f64| Point::new(west_m + x * side_m, south_m + y * side_m);
        let ring = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        Building {
            footprint: Polygon::new(ring.map(|(x, y)| corner(x, y)).to_vec()).unwrap(),
            roof_m,
        }
    }

    #[test]
    fn a_house_hides_what_is_behind_it_from_who_is_not_high_enough() {
        let town = Buildings::of([block(10.0, -10.0, 20.0, 21.0)]);
        let hides =
            |x: f64, height_m: f64| town.hide(Point::new(x, 0.0), height_m, Point::new(0.0, 0.0));
        // The near front is 10 m away: from 100 m away, over the roof of 21 m, from 201 m up.
        assert!(hides(100.0, 200.0) && !hides(100.0, 202.0));
        assert!(!hides(-100.0, 30.0), "it stands on the other side");
        assert!(hides(40.0, 10.0) && !hides(9.0, 10.0), "below its roof");
        // What is within it is below its roof, also from straight above.
        let inside = Point::new(20.0, 0.0);
        assert!(town.hide(inside, 100.0, inside));
        for nowhere in [f64::NAN, f64::INFINITY] {
            assert!(!hides(nowhere, 30.0) && !hides(100.0, nowhere));
        }
    }

    #[test]
    fn what_is_no_higher_than_a_vehicle_hides_none_and_what_is_huge_is_one_of_a_list() {
        assert!(Buildings::of([block(0.0, 0.0, 5.0, MIDDLE_M)]).is_empty());
        let town = Buildings::of([block(-15_000.0, -15_000.0, 30_000.0, 9.0)]);
        assert!(town.squares.is_empty());
        assert!(town.hide(Point::origin(), 80.0, Point::new(5.0, 5.0)));
        let none = Buildings::default();
        assert!(!none.hide(Point::origin(), 80.0, Point::new(5.0, 5.0)));
    }

    proptest! {
        /// Marched along step by step a line of sight meets the same houses.
        #[test]
        fn a_line_of_sight_is_marched_along(
            houses in prop::collection::vec(
                (-90.0..90.0_f64, -90.0..90.0_f64, 3.0..60.0_f64, 2.0..40.0_f64), 1..12,
            ),
            from in (-120.0..120.0_f64, -120.0..120.0_f64),
            height_m in 5.0..80.0_f64,
            at in (-90.0..90.0_f64, -90.0..90.0_f64),
        ) {
            let houses: Vec<Building> =
                houses.into_iter().map(|(x, y, side, roof)| block(x, y, side, roof)).collect();
            let (from, at) = (Point::new(from.0, from.1), Point::new(at.0, at.1));
            let meets = |slack_m: f64| (0..=4_000).any(|k| {
                let share = f64::from(k) / 4_000.0;
                let place = at + (from - at) * share;
                let up_m = MIDDLE_M + (height_m - MIDDLE_M) * share;
                houses.iter().any(|h| up_m < h.roof_m - slack_m && {
                    let within = h.footprint.contains(place);
                    within && h.footprint.outline_distance_m(place) > slack_m
                })
            });
            let said = Buildings::of(houses.clone()).hide(from, height_m, at);
            prop_assert!(!meets(0.1) || said, "hidden, and said to be seen");
            // What only a corner hides may be between two steps.
            let near = |h: &Building| {
                let grown = |p: Point| h.footprint.contains(p) || h.footprint.outline_distance_m(p) < 0.2;
                (0..=4_000).any(|k| {
                    let share = f64::from(k) / 4_000.0;
                    let up_m = MIDDLE_M + (height_m - MIDDLE_M) * share;
                    up_m < h.roof_m + 0.2 && grown(at + (from - at) * share)
                })
            };
            prop_assert!(!said || houses.iter().any(near), "seen, and said to be hidden");
        }
    }
}
