//! Where to point a camera, and where to fly, to have a lost target in the picture again soonest
//! (D2.7 §3.7).
//!
//! What is known are places and the chances that the target is there
//! ([`StreetChances`](super::streets::StreetChances), [`ChanceMap`](super::chance::ChanceMap)).
//! A camera is pointed at the place about which most chance is in one picture and not hidden; a
//! UAV flies to where most can be looked at in the least time.
//!
//! # Complexity
//! For the camera as many lines of sight as there are places within reach, and [`TRIED`] times
//! their number of comparisons; for the flight the squares of [`SQUARE_M`] that hold a chance,
//! squared at most [`TRIED`] times their number.

use skein_geometry::frame::Point;
use std::collections::BTreeMap;

/// So many of the likeliest places are tried.
pub const TRIED: usize = 24;

/// Chances are added up in squares of this, metres, for the flight.
pub const SQUARE_M: f64 = 60.0;

/// Time that a look costs however near it is, seconds.
const LOOK_S: f64 = 4.0;

/// Who flies to a place goes on as long as that is worth so much of the best one.
const KEPT: f64 = 0.7;

/// What is left of the chance where another UAV is on its way to look, in its reach.
const OTHERS: f64 = 0.25;

/// A place where a target may be, and the chance that it is there.
pub type Place = (Point, f64);

/// The likeliest of places, at most so many, the likeliest first.
fn likeliest(places: &[Place], count: usize) -> Vec<Place> {
    let mut best: Vec<Place> = places.to_vec();
    best.sort_by(|a, b| b.1.total_cmp(&a.1));
    best.truncate(count);
    best
}

/// The place to point the camera at: that with most chance within `radius_m(place)` metres of it;
/// `shown` are those that are in reach and not hidden.
#[must_use]
pub fn point_at(shown: &[Place], radius_m: &dyn Fn(Point) -> f64) -> Option<Point> {
    let mut best: Option<(Point, f64)> = None;
    for (at, _) in likeliest(shown, TRIED) {
        let radius_m = radius_m(at);
        let near = shown.iter().filter(|(p, _)| (p - at).norm() <= radius_m);
        let sum: f64 = near.map(|(_, chance)| chance).sum();
        if best.is_none_or(|(_, most)| sum > most) {
            best = Some((at, sum));
        }
    }
    best.map(|(at, _)| at)
}

/// Who looks: where it is, how fast it flies, m/s, and how far over the ground it sees, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Looker {
    /// Where it is.
    pub at: Point,
    /// Its airspeed, m/s.
    pub airspeed_mps: f64,
    /// How far over the ground its camera reaches, metres.
    pub reach_m: f64,
}

/// The place to fly to: most chance within half of the camera's reach in the least time. It goes
/// on to `before` as long as that is nearly as good; where one of `others` is on its way already
/// there is less to be found.
#[must_use]
pub fn fly_to(
    places: &[Place],
    looker: &Looker,
    before: Option<Point>,
    others: &[Point],
) -> Option<Point> {
    let within_m = looker.reach_m / 2.0;
    let mut squares: BTreeMap<(i64, i64), (f64, f64, f64)> = BTreeMap::new();
    for (at, chance) in places {
        let is_others = others.iter().any(|o| (o - at).norm() <= within_m);
        let chance = chance * if is_others { OTHERS } else { 1.0 };
        let sum = squares.entry(square(*at)).or_insert((0.0, 0.0, 0.0));
        *sum = (sum.0 + chance, sum.1 + chance * at.x, sum.2 + chance * at.y);
    }
    let middles: Vec<Place> = squares
        .values()
        .filter(|(chance, _, _)| *chance > 0.0)
        .map(|(chance, x, y)| (Point::new(x / chance, y / chance), *chance))
        .collect();
    let worth = |at: Point| {
        let near = middles.iter().filter(|(p, _)| (p - at).norm() <= within_m);
        let sum: f64 = near.map(|(_, chance)| chance).sum();
        let way_m = ((at - looker.at).norm() - within_m).max(0.0);
        sum / (way_m / looker.airspeed_mps.max(1.0) + LOOK_S)
    };
    let mut best: Option<(Point, f64)> = None;
    for (at, _) in likeliest(&middles, TRIED) {
        let worth = worth(at);
        if best.is_none_or(|(_, most)| worth > most) {
            best = Some((at, worth));
        }
    }
    let (found, most) = best?;
    Some(before.filter(|b| worth(*b) >= KEPT * most).unwrap_or(found))
}

fn square(p: Point) -> (i64, i64) {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "float to integer casts saturate"
    )]
    let nth = |m: f64| (m / SQUARE_M).floor() as i64;
    (nth(p.x), nth(p.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, chance: f64) -> Place {
        (Point::new(x, 0.0), chance)
    }

    #[test]
    fn the_camera_is_pointed_where_one_picture_shows_most() {
        let places = [at(0.0, 0.3), at(200.0, 0.2), at(210.0, 0.2), at(220.0, 0.1)];
        let found = point_at(&places, &|_| 30.0).unwrap();
        assert!(found.x > 190.0, "{found}");
        assert_eq!(point_at(&places, &|_| 5.0), Some(Point::new(0.0, 0.0)));
        assert_eq!(point_at(&[], &|_| 5.0), None);
    }

    #[test]
    fn the_uav_flies_where_most_is_soonest_stays_with_it_and_leaves_others_theirs() {
        let looker = Looker {
            at: Point::new(0.0, 0.0),
            airspeed_mps: 20.0,
            reach_m: 200.0,
        };
        let places = [at(150.0, 0.4), at(900.0, 0.8)];
        let fly = |before, others: &[Point]| fly_to(&places, &looker, before, others).unwrap().x;
        assert!((fly(None, &[]) - 150.0).abs() < 1e-9);
        // From here the far one is worth less than seven tenths.
        assert!((fly(Some(Point::new(900.0, 0.0)), &[]) - 150.0).abs() < 1e-9);
        assert!((fly(Some(Point::new(170.0, 0.0)), &[]) - 170.0).abs() < 1e-9);
        assert!((fly(None, &[Point::new(140.0, 0.0)]) - 900.0).abs() < 1e-9);
        assert_eq!(fly_to(&[], &looker, None, &[]), None);
    }
}
