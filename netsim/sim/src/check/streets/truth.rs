//! Where vehicles truly are on a network, by geometry of the judge's own.

use crate::account::secs;
use skein_flight::streets::{Network, Turn};
use skein_geometry::frame::{Point, Vector};
use std::collections::BTreeMap;

/// Farther from a middle line nobody is on its street, metres.
const ASIDE_M: f64 = 12.0;

/// So far beside its place all is taken to be by one UAV in twenty, for a whole flight, metres.
const DISPLACED_M: f64 = 5.0;

/// Who is seen so far beside its place may be taken to be on another stretch that is no farther than
/// this beyond the nearest one, metres; by a UAV that takes itself to be farther off by twice as
/// much more, up to the second.
const MAY_M: f64 = 10.0;
const MOST_MAY_M: f64 = 20.0;

/// Who is within a crossing, farther from all stretches than this, may as well be taken to be on
/// none, metres; less by what a UAV is farther off.
const SURE_M: f64 = 7.0;

/// Of stretches that are about as near that counts along which a vehicle drives, metres.
const ALIKE_M: f64 = 5.0;

/// Who is so far from both ends of a stretch is well on it, metres.
const WELL_ON_M: f64 = 15.0;

/// What truly drove on a stretch.
#[derive(Clone, Copy, Debug, Default)]
pub struct Driven {
    spent_ms: u64,
    driven_m: f64,
    /// How long were those who may be taken to be on it, and those who can be taken to be nowhere
    /// else.
    pub may_ms: u64,
    pub sure_ms: u64,
}

impl Driven {
    pub fn add(&mut self, ms: u64, mps: f64) {
        self.spent_ms += ms;
        self.driven_m += mps * secs(ms);
    }

    pub fn merge(&mut self, more: &Self) {
        self.spent_ms += more.spent_ms;
        self.driven_m += more.driven_m;
    }

    pub fn spent_s(&self) -> f64 {
        secs(self.spent_ms)
    }

    /// Space-mean speed, m/s.
    pub fn speed_mps(&self) -> Option<f64> {
        (self.spent_ms > 0).then(|| self.driven_m / secs(self.spent_ms))
    }
}

/// What truly was at the places that one UAV watched.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    pub watched_m_s: f64,
    pub stretches: BTreeMap<u16, Driven>,
}

/// So many stretches are near a place at most.
const MAY: usize = 6;

/// Of each stretch the box beyond which nobody is taken to be on it: two corners, metres.
#[derive(Clone, Debug, Default)]
pub struct Reaches(Vec<(Point, Point)>);

impl Reaches {
    pub fn of(network: &Network) -> Self {
        let reach = Vector::new(1.0, 1.0) * (ASIDE_M + MOST_MAY_M);
        let around = |way: &Vec<Point>| {
            let far = Point::new(f64::INFINITY, f64::INFINITY);
            let low = way.iter().fold(far, |low, p| low.inf(p));
            let high = way.iter().fold(-far, |high, p| high.sup(p));
            (low - reach, high + reach)
        };
        Self(network.edges().iter().map(|e| around(&e.way)).collect())
    }

    fn holds(&self, nth: usize, at: Point) -> bool {
        let holds = |(low, high): &(Point, Point)| {
            (low.x..=high.x).contains(&at.x) && (low.y..=high.y).contains(&at.y)
        };
        self.0.get(nth).is_some_and(holds)
    }
}

/// A stretch near a vehicle, the place of it, and how much farther that is than the nearest.
#[derive(Clone, Copy, Debug)]
struct Near {
    stretch: u16,
    place: usize,
    beyond_m: f64,
}

/// Where one vehicle is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Located {
    /// On which stretch, at which of its places.
    pub on: Option<(u16, usize)>,
    /// Where it may be taken to be, the nearest first.
    near: [Option<Near>; MAY],
    least_m: f64,
    /// How fast, m/s.
    pub speed_mps: f64,
    well: Option<u16>,
}

impl Located {
    /// It moved; says whether it took a turn.
    pub fn step(
        &mut self,
        (network, reaches): (&Network, &Reaches),
        (before, at): (Point, Point),
        (_, apart_ms): (u64, u64),
    ) -> Option<Turn> {
        let moved = at - before;
        self.speed_mps = moved.norm() / secs(apart_ms.max(1));
        let (found, near, least_m) = locate((network, reaches), at, moved);
        let place = |(stretch, along_m): (u16, f64)| {
            Some((stretch, network.place_along(stretch, along_m)?))
        };
        self.on = found.and_then(place);
        self.near = near.map(|n| {
            let (stretch, along_m, beyond_m) = n?;
            let (stretch, place) = place((stretch, along_m))?;
            Some(Near {
                stretch,
                place,
                beyond_m,
            })
        });
        self.least_m = least_m;
        let (stretch, along_m) = found?;
        let length_m = network.edges().get(usize::from(stretch))?.length_m;
        if along_m.min(length_m - along_m) < WELL_ON_M.min(length_m / 4.0) {
            return None;
        }
        let was = self.well.replace(stretch).filter(|s| *s != stretch)?;
        let over = network.between((was, stretch), at)?;
        let turn = Turn {
            from: was,
            over,
            to: stretch,
        };
        network.turn(turn).map(|_| turn)
    }

    /// On which stretches, at which of their places, a UAV may take it to be that takes itself to
    /// be so far beside its place, metres.
    pub fn may_be(&self, displaced_m: f64) -> impl Iterator<Item = (u16, usize)> {
        let reach_m = MAY_M + 2.0 * (displaced_m - DISPLACED_M).max(0.0);
        let near = self.near.iter().flatten();
        let near = near.filter(move |n| n.beyond_m <= reach_m);
        near.map(|n| (n.stretch, n.place))
    }

    /// Whether such a UAV can take it to be nowhere else.
    pub fn is_sure(&self, displaced_m: f64) -> bool {
        let most_m = SURE_M - (displaced_m - DISPLACED_M).max(0.0);
        self.least_m <= most_m && self.may_be(displaced_m).count() == 1
    }
}

/// A stretch, and how far along it, metres.
type On = Option<(u16, f64)>;

/// A stretch that is near, how far along it, and how much farther that is than the nearest, metres.
type Beside = Option<(u16, f64, f64)>;

/// On which stretch a vehicle is that moved so, which ones are near, and how far the nearest is,
/// metres.
fn locate(
    (network, reaches): (&Network, &Reaches),
    at: Point,
    moved: Vector,
) -> (On, [Beside; MAY], f64) {
    // The nearest place of each stretch that is near enough.
    let mut near: Vec<(f64, f64, u16, f64)> = Vec::new();
    let edges = (0_u16..).zip(network.edges());
    for (n, edge) in edges.filter(|(n, _)| reaches.holds(usize::from(*n), at)) {
        let mut best: Option<(f64, f64, u16, f64)> = None;
        let mut before_m = 0.0;
        for w in edge.way.windows(2) {
            let (line, to) = (w[1] - w[0], at - w[0]);
            let length_m = line.norm();
            let along_m = (line.dot(&to) / length_m).clamp(0.0, length_m);
            let aside_m = (to - line * (along_m / length_m)).norm();
            if aside_m <= ASIDE_M + MOST_MAY_M && best.is_none_or(|b| aside_m < b.0) {
                let speed = moved.norm();
                let across = if speed > 0.0 {
                    (line.perp(&moved) / (length_m * speed)).abs()
                } else {
                    0.0
                };
                best = Some((aside_m, across, n, before_m + along_m));
            }
            before_m += length_m;
        }
        near.extend(best);
    }
    let least_m = near.iter().map(|n| n.0).fold(f64::INFINITY, f64::min);
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut may = [None; MAY];
    let all = near.iter().filter(|n| n.0 <= least_m + MOST_MAY_M);
    for (slot, (aside_m, _, stretch, along_m)) in may.iter_mut().zip(all) {
        *slot = Some((*stretch, *along_m, aside_m - least_m));
    }
    near.retain(|n| n.0 <= ASIDE_M && n.0 <= least_m + ALIKE_M);
    let of = near
        .iter()
        .min_by(|a, b| (a.0 + 12.0 * a.1).total_cmp(&(b.0 + 12.0 * b.1)));
    let on = of.map(|(_, _, stretch, along_m)| (*stretch, *along_m));
    (on, may, least_m)
}
