//! Headings at a sequence of waypoints for the shortest chain of Dubins curves,
//! or the fastest chain of flights in wind, with a certified gap (D2.7 §2.4.3).
//!
//! Each waypoint's headings are cut into intervals. A shortest path over them,
//! with a lower bound for every pair of neighbouring intervals (`leg`), bounds
//! every choice of headings from below; a shortest path over the intervals'
//! middles, polished one waypoint at a time, is a choice and bounds from above.
//! Intervals through which even the bound is no better than what is asked for are
//! put aside with it, the others halved, until the two bounds meet.
//!
//! D2.7 proposes gradient descent, which can tell neither. In wind
//! (`air`) the same is done in time. Which order to visit the waypoints in is for
//! others.

mod air;
mod chain;
mod interval;
mod leg;
mod plane;
mod polish;
mod words;

use air::Air;
use chain::{Ends, Known, Layers, middles};
use leg::Arc;
use polish::Polish;
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{TAU, wrap_tau};

/// Intervals of the whole circle in the first round: the bound of a leg is of
/// second order below a fifth of a radian half width.
const FIRST_INTERVALS: u32 = 16;

/// Rounds at most: not every round halves every interval, and after 20 halvings
/// one is a millionth of a radian, so that only equal answers are left to tell apart.
const MAX_ROUNDS: usize = 40;

/// Pairs of intervals in one round at most, for the memory that they take; with more the
/// gap reached so far is the answer.
const MAX_PAIRS: usize = 40_000_000;

/// The same for each leg: where a few waypoints lie within a turn of each other, many choices
/// of headings are as good, and each leg may take a hundred times as many as usual.
const MAX_PAIRS_A_LEG: usize = 1_000_000;

/// Pairs of intervals a leg in all rounds together, unless more are asked for: in wind,
/// where a pair takes ten times as long, 20 waypoints are answered within a second.
pub const PAIRS_A_LEG_IN_WIND: usize = 8_000;

/// A waypoint's intervals are fine enough when they loosen the bound by this share
/// of what the gap allows on the average: the rest is left to the others.
const FINE_SHARE: f64 = 0.3;

/// Intervals whose bound exceeds the least by more than this times their half
/// width wait: halving the others moves the least by no more than slopes of 2 at
/// both ends do, unless a full circle is lost, and then their turn comes.
const NEAR_SLOPE: f64 = 6.0;

/// Relative rounding of a sum of legs: the lower bound stays below it.
const ROUNDING: f64 = 1e-12;

/// Whether the chain of waypoints is a loop, and which headings are given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Chain {
    /// From the first waypoint to the last; a heading that is given is kept, radians.
    Open {
        /// Heading at the first waypoint.
        first_rad: Option<f64>,
        /// Heading at the last waypoint.
        last_rad: Option<f64>,
    },
    /// And back to the first, smoothly.
    Closed,
}

/// What was asked for.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// Waypoints in order, metres.
    pub waypoints: &'a [Point],
    /// Ends of the chain.
    pub chain: Chain,
    /// Turn radius, metres.
    pub radius_m: f64,
    /// The share of the length the answer may be above the optimum.
    pub gap: f64,
    /// Pairs of intervals looked at for each leg, after which what is reached is the
    /// answer; without it [`PAIRS_A_LEG_IN_WIND`] in wind, and no limit in calm air.
    pub pairs_a_leg: Option<usize>,
}

/// Both bounds after a round, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// No choice of headings is shorter.
    pub lower_m: f64,
    /// The best choice found so far.
    pub upper_m: f64,
}

/// The answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Headings {
    /// One heading a waypoint, radians in [0, 2π).
    pub headings_rad: Vec<f64>,
    /// Length of the chain of shortest Dubins curves with these headings, metres.
    pub length_m: f64,
    /// No choice of headings is shorter, metres.
    pub lower_bound_m: f64,
    /// Whether the gap asked for is certified; if not, the steps ran out before.
    pub certified: bool,
    /// Both bounds round by round.
    pub rounds: Vec<Bounds>,
}

impl Headings {
    /// How far above the optimum the length may be, as a share of the length.
    #[must_use]
    pub fn gap(&self) -> f64 {
        if self.length_m > 0.0 {
            1.0 - self.lower_bound_m / self.length_m
        } else {
            0.0
        }
    }
}

/// Why there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HeadingsError {
    /// One waypoint is no chain.
    #[error("{0} waypoints make no chain: two are needed")]
    TooFew(usize),
    /// A coordinate or a given heading is infinite or no number.
    #[error("waypoint {0} or its heading is not a finite number")]
    NotFinite(usize),
    /// The turn radius is not positive.
    #[error("a turn radius must be positive and finite")]
    Radius,
    /// The gap is negative or no number.
    #[error("a gap is a share of the length, zero or more")]
    Gap,
    /// The airspeed is not positive, or the wind is no slower.
    #[error(
        "the wind must be finite and slower than the airspeed, so that every heading is reached"
    )]
    Wind,
}

/// The answer in wind.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedHeadings {
    /// One heading of the nose a waypoint, radians in [0, 2π).
    pub headings_rad: Vec<f64>,
    /// Duration of the chain of fastest flights with these headings, seconds.
    pub time_s: f64,
    /// No choice of headings is faster, seconds.
    pub lower_bound_s: f64,
    /// Whether the gap asked for is certified; if not, the steps ran out before.
    pub certified: bool,
    /// Both bounds round by round, seconds: no choice is faster than the first, and
    /// one that lasts the second is found.
    pub rounds_s: Vec<(f64, f64)>,
}

impl TimedHeadings {
    /// How far above the optimum the duration may be, as a share of it.
    #[must_use]
    pub fn gap(&self) -> f64 {
        if self.time_s > 0.0 {
            1.0 - self.lower_bound_s / self.time_s
        } else {
            0.0
        }
    }
}

/// Chooses the headings.
///
/// # Guarantees
/// `lower_bound_m` ≤ the optimum ≤ `length_m`, and [`Headings::gap`] is at most
/// the gap asked for if the answer is `certified`; otherwise the rounds ran out (hundreds
/// of waypoints much nearer than a turn radius) and it is what was reached. Bounds never get worse from
/// round to round. The same bits on every machine.
///
/// # Errors
/// When the request is malformed.
pub fn choose(request: &Request) -> Result<Headings, HeadingsError> {
    check(request)?;
    let found = solve(request, Air::default());
    let r = request.radius_m;
    Ok(Headings {
        headings_rad: found.headings_rad,
        length_m: found.upper * r,
        lower_bound_m: found.lower * r,
        certified: found.certified,
        rounds: found
            .rounds
            .iter()
            .map(|b| Bounds {
                lower_m: b.0 * r,
                upper_m: b.1 * r,
            })
            .collect(),
    })
}

/// Chooses the headings of the nose in a constant wind, for the shortest time at
/// `airspeed_mps` through the air.
///
/// # Guarantees
/// As [`choose`], in seconds; pairs run out sooner, so that among waypoints nearer than
/// two turn radii the gap may be wider than asked for, unless more are allowed. Flights are those of [`skein_flight::trajectory::wind`]: three
/// pieces, no turn longer than a circle.
///
/// # Errors
/// When the request is malformed, or the wind no slower than the UAV.
pub fn choose_in_wind(
    request: &Request,
    airspeed_mps: f64,
    wind: Wind,
) -> Result<TimedHeadings, HeadingsError> {
    check(request)?;
    let share = wind.velocity() / airspeed_mps;
    if !(airspeed_mps > 0.0 && airspeed_mps.is_finite() && share.norm() < 1.0) {
        return Err(HeadingsError::Wind);
    }
    let air = Air {
        wind: (share.norm() > 0.0).then_some(share),
    };
    let found = solve(request, air);
    let unit_s = request.radius_m / airspeed_mps;
    Ok(TimedHeadings {
        headings_rad: found.headings_rad,
        time_s: found.upper * unit_s,
        lower_bound_s: found.lower * unit_s,
        certified: found.certified,
        rounds_s: found
            .rounds
            .iter()
            .map(|b| (b.0 * unit_s, b.1 * unit_s))
            .collect(),
    })
}

/// What was found, in turn radii or the time of a radian's turn.
struct Solved {
    headings_rad: Vec<f64>,
    upper: f64,
    lower: f64,
    certified: bool,
    rounds: Vec<(f64, f64)>,
}

fn solve(request: &Request, air: Air) -> Solved {
    let r = request.radius_m;
    let points = request.waypoints;
    let closed = request.chain == Chain::Closed;
    let count = points.len();
    let legs: Vec<Vector> = (0..count - usize::from(!closed))
        .map(|i| (points[(i + 1) % count] - points[i]) / r)
        .collect();
    let mut layers = first_layers(request);
    let mut best = (f64::INFINITY, Vec::new());
    // What bounds the choices put aside, and what is known so far.
    let (mut aside, mut lower) = (f64::INFINITY, 0.0f64);
    let mut rounds = Vec::new();
    let mut slopes = vec![0.0; layers[0].len()];
    let fixed = given(request);
    let polish = Polish {
        air,
        legs: &legs,
        fixed: &fixed,
        closed,
    };
    let mut known = Known::default();
    let a_leg = match air.wind {
        Some(_) => Some(request.pairs_a_leg.unwrap_or(PAIRS_A_LEG_IN_WIND)),
        None => request.pairs_a_leg,
    };
    // What may still be looked at.
    let mut left = a_leg.map_or(usize::MAX, |n| n.saturating_mul(legs.len()));
    let most_pairs = MAX_PAIRS.min(MAX_PAIRS_A_LEG * legs.len());
    let mut step = TAU / f64::from(2 * FIRST_INTERVALS);
    for _ in 0..MAX_ROUNDS {
        let ends = if closed { Ends::Closed } else { Ends::Open };
        let solved = Layers::solve(&air, &legs, &layers, ends, &slopes, &known);
        let start = solved
            .ways
            .iter()
            .filter(|way| !way.is_empty())
            .map(|way| middles(way, &layers))
            .map(|headings| (polish.length(&headings), headings))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, mut headings)) = start {
            let length = polish.run(&mut headings, step);
            if length < best.0 {
                best = (length, headings);
            }
        }
        step *= 0.5;
        lower = lower
            .max(solved.least.min(aside) * (1.0 - ROUNDING))
            .min(best.0);
        rounds.push((lower, best.0));
        if near_enough(lower, best.0, request.gap) {
            break;
        }
        let wanted = best.0 * (1.0 - 0.99 * request.gap);
        aside = aside.min(wanted);
        let fine = best.0 * request.gap * FINE_SHARE / count as f64;
        let kept = halved(&layers, &solved, wanted, fine);
        (layers, slopes) = kept;
        known = Known {
            pairs: solved.pairs,
            wanted,
        };
        if layers.iter().any(Vec::is_empty) {
            // Every choice passes an interval that was put aside.
            lower = lower.max(aside * (1.0 - ROUNDING)).min(best.0);
            break;
        }
        let (all, open) = pairs(&layers, closed, &known);
        if all > most_pairs || open > left {
            break;
        }
        left -= open;
    }
    Solved {
        headings_rad: best.1.into_iter().map(wrap_tau).collect(),
        upper: best.0,
        lower,
        certified: near_enough(lower, best.0, request.gap),
        rounds,
    }
}

/// Whether the bounds are as near as was asked for.
fn near_enough(lower: f64, upper: f64, gap: f64) -> bool {
    lower >= upper * (1.0 - gap)
}

fn check(request: &Request) -> Result<(), HeadingsError> {
    let points = request.waypoints;
    if points.len() < 2 {
        return Err(HeadingsError::TooFew(points.len()));
    }
    if !(request.radius_m > 0.0 && request.radius_m.is_finite()) {
        return Err(HeadingsError::Radius);
    }
    if request.gap.is_nan() || request.gap < 0.0 {
        return Err(HeadingsError::Gap);
    }
    let finite = |p: &Point| p.x.is_finite() && p.y.is_finite();
    if let Some(i) = points.iter().position(|p| !finite(p)) {
        return Err(HeadingsError::NotFinite(i));
    }
    if let Chain::Open {
        first_rad,
        last_rad,
    } = request.chain
    {
        for (at, heading) in [(0, first_rad), (points.len() - 1, last_rad)] {
            if heading.is_some_and(|h| !h.is_finite()) {
                return Err(HeadingsError::NotFinite(at));
            }
        }
    }
    Ok(())
}

/// The whole circle at every waypoint, but for headings that are given.
fn first_layers(request: &Request) -> Vec<Vec<Arc>> {
    let half = TAU / 2.0 / f64::from(FIRST_INTERVALS);
    let circle: Vec<Arc> = (0..FIRST_INTERVALS)
        .map(|i| Arc::new(half * f64::from(2 * i + 1), half, 0))
        .collect();
    let mut layers = vec![circle; request.waypoints.len()];
    if let Chain::Open {
        first_rad,
        last_rad,
    } = request.chain
    {
        let last = layers.len() - 1;
        for (at, heading) in [(0, first_rad), (last, last_rad)] {
            if let Some(h) = heading {
                layers[at] = vec![Arc::new(wrap_tau(h), 0.0, 0)];
            }
        }
    }
    layers
}

/// Leaves out intervals whose bound is at least `wanted`, and halves the others
/// where the bound is looser than `fine` and they matter soon; also the slopes of the first waypoint's
/// intervals.
fn halved(
    layers: &[Vec<Arc>],
    solved: &Layers,
    wanted: f64,
    fine: f64,
) -> (Vec<Vec<Arc>>, Vec<f64>) {
    let any_loose = solved.looseness.iter().any(|l| *l > fine);
    let mut slopes = Vec::new();
    let mut kept = Vec::with_capacity(layers.len());
    for (i, (layer, bounds)) in layers.iter().zip(&solved.through).enumerate() {
        let mut next = Vec::with_capacity(2 * layer.len());
        for (j, (arc, bound)) in layer.iter().zip(bounds).enumerate() {
            if *bound >= wanted {
                continue;
            }
            let half = arc.half_rad / 2.0;
            let low = *bound - solved.least <= NEAR_SLOPE * arc.half_rad;
            if half > 0.0 && low && (solved.looseness[i] > fine || !any_loose) {
                next.push(Arc::new(arc.mid_rad - half, half, j));
                next.push(Arc::new(arc.mid_rad + half, half, j));
            } else {
                next.push(Arc { parent: j, ..*arc });
            }
            if i == 0 {
                slopes.resize(next.len(), solved.slopes[j]);
            }
        }
        kept.push(next);
    }
    (kept, slopes)
}

/// Pairs of neighbouring intervals: all, and those that are not put aside.
fn pairs(layers: &[Vec<Arc>], closed: bool, known: &Known) -> (usize, usize) {
    let (mut all, mut open) = (0, 0);
    let n_legs = layers.len() - usize::from(!closed);
    for leg in 0..n_legs {
        let (from, to) = (&layers[leg], &layers[(leg + 1) % layers.len()]);
        all += from.len() * to.len();
        for a in from {
            open += to.iter().filter(|b| !known.aside(leg, a, b)).count();
        }
    }
    (all, open)
}

/// Which headings are given.
fn given(request: &Request) -> Vec<bool> {
    let mut fixed = vec![false; request.waypoints.len()];
    if let Chain::Open {
        first_rad,
        last_rad,
    } = request.chain
    {
        let last = fixed.len() - 1;
        fixed[0] = first_rad.is_some();
        fixed[last] = last_rad.is_some();
    }
    fixed
}
#[cfg(test)]
mod tests;
