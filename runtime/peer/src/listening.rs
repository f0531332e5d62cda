//! Where a UAV with nothing to do circles until it hears a ground station again: houses stand
//! between many a base and the station beside it, and the next mission comes from there.
//!
//! | event | what follows |
//! |---|---|
//! | it waits at its base, and for forty periods believes no ground station alive that it knew | the next circle about the base that zones leave room for |
//! | it believes one alive | it stays on that circle |
//! | it does something else, is told to return or to hold, or its fuel is due | nothing; the base itself is next again |
//!
//! # Guarantees
//! It stays within four turn radii of its base, and the clearance from zones.

use crate::input::Time;
use crate::relay_circle::circle_round;
use skein_behaviors::executive::circle::halves;
use skein_flight::route::Router;
use skein_geometry::Segment;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{cos, sin};

/// So many periods a circle is flown on which no ground station is heard: twice round, and the
/// time after which one that is heard no more is given up.
const LISTEN_PERIODS: u64 = 40;

/// So many circles are tried, one after the other, each with its middle in another direction.
const CIRCLES: u32 = 24;

/// Their middles are so far from the base, turn radii; the last are the farthest.
const RINGS: u32 = 3;

/// From one direction to the next, radians: the golden angle, which fills a disc evenly.
const GOLDEN_RAD: f64 = 2.399_963_229_728_653;

/// Where it waits.
#[derive(Clone, Debug, Default)]
pub(crate) struct Listening {
    /// Since when it hears no station where it is.
    since: Option<Time>,
    /// How many circles it tried.
    tried: u32,
    circle: Option<Segment>,
}

impl Listening {
    /// Looks whether it is to try another circle; `hears` says whether it believes a ground
    /// station alive, or never knew one.
    pub fn look(
        &mut self,
        now: Time,
        hears: bool,
        period_ms: u64,
        (base, router): (Point, &Router),
    ) {
        if hears {
            self.since = None;
            return;
        }
        let since = *self.since.get_or_insert(now);
        if now.since_ms(since) < LISTEN_PERIODS * period_ms {
            return;
        }
        self.since = Some(now);
        for _ in 0..CIRCLES {
            let circle = circle_about(base, self.tried, router.limits().turn_radius_m);
            self.tried = (self.tried + 1) % CIRCLES;
            let clearance_m = router.limits().clearance_m;
            if router.zones().is_clear(&halves(&circle), clearance_m) {
                self.circle = Some(circle);
                return;
            }
        }
    }

    /// The circle that it flies; none as long as it waits where everybody does.
    pub fn circle(&self) -> Option<Segment> {
        self.circle
    }
}

/// One of the circles about a base.
fn circle_about(base: Point, nth: u32, turn_radius_m: f64) -> Segment {
    let course = GOLDEN_RAD * f64::from(nth);
    let away = f64::from(1 + nth * RINGS / CIRCLES);
    let middle = base + Vector::new(cos(course), sin(course)) * (away * turn_radius_m);
    circle_round(middle, turn_radius_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::Mission;
    use crate::testing::mission;
    use std::sync::Arc;

    fn router(m: &Mission) -> Router {
        (*Arc::new(m.clone()).geometry().unwrap().router).clone()
    }

    /// Where it circles after so many periods without a station.
    fn after(periods: u64, m: &Mission) -> Vec<Segment> {
        let mut listening = Listening::default();
        let router = router(m);
        let mut flown = Vec::new();
        for period in 0..=periods {
            let now = Time(5_000 + 1_000 * period);
            listening.look(now, false, 1_000, (m.base_m(), &router));
            flown.extend(listening.circle().filter(|c| flown.last() != Some(c)));
        }
        flown
    }

    #[test]
    fn every_forty_periods_another_circle_is_tried_and_all_are_about_the_base() {
        let m = mission(1, 8, 6);
        assert!(after(39, &m).is_empty());
        let all = after(40 * 24, &m);
        assert_eq!(all.len(), 24);
        let turn_m = m.turn_radius_m();
        // Of the places within three radii of the base hardly any is far from all circles.
        let middle = |c: &Segment| c.start.position() - Vector::new(turn_m, 0.0);
        let farthest_m = all.iter().map(|c| (middle(c) - m.base_m()).norm() + turn_m);
        assert!(farthest_m.fold(0.0, f64::max) <= 4.0 * turn_m + 1e-9);
        let far_from_all = |p: &Point| {
            let off_m = |c: &Segment| ((middle(c) - p).norm() - turn_m).abs();
            all.iter().all(|c| off_m(c) > turn_m / 3.0)
        };
        let grid = (-12..=12).flat_map(|x| (-12..=12).map(move |y| (f64::from(x), f64::from(y))));
        let places = grid.map(|(x, y)| m.base_m() + Vector::new(x, y) * (turn_m / 4.0));
        let within = places.filter(|p| (p - m.base_m()).norm() <= 3.0 * turn_m);
        let within: Vec<Point> = within.collect();
        let far = within.iter().filter(|p| far_from_all(p)).count();
        assert!(far * 50 < within.len(), "{far} of {}", within.len());
    }

    #[test]
    fn circles_keep_the_clearance_and_where_one_is_heard_it_stays() {
        let mut m = mission(1, 8, 6);
        // A zone south of the base.
        m.zones = vec![vec![
            (-200_000, -140_000),
            (80_000, -140_000),
            (80_000, -100_000),
            (-200_000, -100_000),
        ]];
        let all = after(40 * 24, &m);
        let again = all.iter().skip(1).position(|c| *c == all[0]).unwrap();
        assert!((4..20).contains(&again), "{again} circles have room");
        let router = router(&m);
        let clear = |c: &Segment| router.zones().is_clear(&halves(c), m.clearance_m());
        assert!(all.iter().all(clear));

        let mut listening = Listening::default();
        let mut look = |s: u64, hears| {
            listening.look(Time(1_000 * s), hears, 1_000, (m.base_m(), &router));
            listening.circle()
        };
        let looks = (1..=41).map(|s| look(s, false));
        let first = looks.last().flatten().unwrap();
        // Nor does it go on at once when it hears it no more.
        assert!((42..=300).all(|s| look(s, true) == Some(first)));
        assert!((301..=340).all(|s| look(s, false) == Some(first)));
        assert_ne!(look(341, false), Some(first));
    }
}
