//! Lanes of a cell, and passes along steep borders where lanes end too early
//! (D2.7 §3.6.1, the zig-zag motions).
//!
//! A cell is cut into strips no wider than the lane spacing, with a lane in the middle of
//! each. Over open borders a lane runs on until its strip is seen wholly; at a zone it
//! must end, and where the zone's border slants away the strip beyond is not seen. There
//! a pass along that border sees it: what is missing is nearer to it than half a spacing.

use super::cells::{Cell, Slice};
use super::frame::{Axes, Edge, SAME_M};
use super::{Measures, Pass};
use crate::frame::Point;

/// Share of the spacing that a strip may be wider, or an end may be short: less than the
/// coverage is measured with.
const SLACK: f64 = 1e-4;

/// What a lane's end may leave unseen along the lane, in spacings, before a pass is flown
/// for it.
const UNSEEN_END: f64 = 0.02;

/// Passes along borders keep this much off them, so that no rounding puts them inside,
/// metres.
const OFF_BORDER_M: f64 = 1e-4;

/// The borders of zones in one turned frame.
pub(super) struct Ground<'a> {
    pub(super) zones: &'a [Edge],
}

impl Ground<'_> {
    /// How far the line at `x` may be followed from `from` towards `to` before a zone.
    fn run(&self, x: f64, from: f64, to: f64) -> f64 {
        let mut crossings: Vec<(f64, i32)> = self
            .zones
            .iter()
            .filter(|e| e.left.x < x && x <= e.right.x)
            .map(|e| (e.y_at(x), e.step))
            .collect();
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        let up = to >= from;
        let mut inside = 0;
        let mut reach = to;
        let mut entry = f64::NEG_INFINITY;
        for (y, step) in crossings {
            if inside <= 0 && inside + step > 0 {
                entry = y;
            }
            if inside > 0 && inside + step <= 0 {
                if up && entry >= from - SAME_M {
                    reach = reach.min(entry);
                }
                if !up && y <= from + SAME_M {
                    reach = reach.max(y);
                }
            }
            inside += step;
        }
        if up { reach.max(from) } else { reach.min(from) }
    }
}

/// A part of a strip that its lane does not see, at a border that can be followed.
#[derive(Clone, Debug)]
pub(super) struct Leftover {
    /// A pass along the border.
    pub(super) pass: Pass,
    /// Points that must be seen for the pass to be needless.
    pub(super) samples: Vec<Point>,
}

/// The lanes of a cell, from left to right; what they do not see goes to `leftovers`.
pub(super) fn lanes(
    cell: &Cell,
    axes: Axes,
    ground: &Ground<'_>,
    measures: &Measures,
    leftovers: &mut Vec<Leftover>,
) -> Vec<Pass> {
    let (left, right) = (cell.left(), cell.right());
    let n = ((right - left) / measures.lane_spacing_m - SLACK).ceil();
    let mut lanes = Vec::new();
    let mut i = 0.0;
    while i < n {
        let strip = Strip {
            from: left + (right - left) * i / n,
            to: left + (right - left) * (i + 1.0) / n,
            slices: &cell.slices,
        };
        i += 1.0;
        let (x, low, high) = strip.lane(ground);
        strip.leftovers((low, high), axes, measures, leftovers);
        let (low, high) = ground.stretched(x, low, high, measures.shortest_pass_m);
        lanes.push(Pass {
            from: axes.back(Point::new(x, low)),
            to: axes.back(Point::new(x, high)),
        });
    }
    lanes
}

/// A piece of a cell as wide as a lane.
struct Strip<'a> {
    from: f64,
    to: f64,
    slices: &'a [Slice],
}

impl Strip<'_> {
    /// The slices of the strip, each with its extent in it.
    fn pieces(&self) -> impl Iterator<Item = (&Slice, f64, f64)> {
        let within = |s: &&Slice| s.right > self.from && s.left < self.to;
        self.slices
            .iter()
            .filter(within)
            .map(|s| (s, s.left.max(self.from), s.right.min(self.to)))
    }

    /// Place, low and high end of the lane that sees the strip as far as zones let it.
    fn lane(&self, ground: &Ground<'_>) -> (f64, f64, f64) {
        let x = self.from.midpoint(self.to);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut floor, mut ceiling) = (f64::INFINITY, f64::NEG_INFINITY);
        for (s, a, b) in self.pieces() {
            for at in [a, b] {
                low = low.min(s.floor.y_at(at));
                high = high.max(s.ceiling.y_at(at));
            }
            if s.left <= x && x <= s.right {
                floor = floor.min(s.floor.y_at(x));
                ceiling = ceiling.max(s.ceiling.y_at(x));
            }
        }
        // Between two slices of a cell there is always one at the middle of a strip.
        (x, ground.run(x, floor, low), ground.run(x, ceiling, high))
    }

    /// What a lane from `low` to `high` leaves unseen, border by border.
    fn leftovers(
        &self,
        (low, high): (f64, f64),
        axes: Axes,
        measures: &Measures,
        into: &mut Vec<Leftover>,
    ) {
        let reach = measures.look_ahead_m + UNSEEN_END * measures.lane_spacing_m;
        for (edge, limit, up) in self.borders(low - reach, high + reach) {
            // Where the border is beyond the limit.
            let beyond = |p: Point| if up { p.y - limit } else { limit - p.y };
            let (a, b) = edge;
            let (da, db) = (beyond(a), beyond(b));
            if da.max(db) <= SAME_M {
                continue;
            }
            let cut = a + (b - a) * (da / (da - db)).clamp(0.0, 1.0);
            let (a, b) = match (da > 0.0, db > 0.0) {
                (true, true) => (a, b),
                (true, false) => (a, cut),
                _ => (cut, b),
            };
            let inward = if up { -OFF_BORDER_M } else { OFF_BORDER_M };
            let off = |p: Point| Point::new(p.x, p.y + inward);
            let samples = samples(a, b, limit).map(|p| axes.back(p)).collect();
            into.push(Leftover {
                pass: Pass {
                    from: axes.back(off(a)),
                    to: axes.back(off(b)),
                },
                samples,
            });
        }
    }

    /// Floors and ceilings in the strip, with the steps between slices: each a line, the
    /// limit that belongs to it, and whether it is a ceiling.
    fn borders(&self, low: f64, high: f64) -> Vec<((Point, Point), f64, bool)> {
        let mut borders = Vec::new();
        let mut last: Option<(f64, f64)> = None;
        for (s, a, b) in self.pieces() {
            let at = |e: &Edge, x: f64| Point::new(x, e.y_at(x));
            if let Some((floor, ceiling)) = last {
                let before = (Point::new(a, floor), Point::new(a, ceiling));
                borders.push(((before.0, at(&s.floor, a)), low, false));
                borders.push(((before.1, at(&s.ceiling, a)), high, true));
            }
            borders.push(((at(&s.floor, a), at(&s.floor, b)), low, false));
            borders.push(((at(&s.ceiling, a), at(&s.ceiling, b)), high, true));
            last = Some((s.floor.y_at(b), s.ceiling.y_at(b)));
        }
        borders
    }
}

/// Points between the border from `a` to `b` and the height `limit`.
fn samples(a: Point, b: Point, limit: f64) -> impl Iterator<Item = Point> {
    const SHARES: [f64; 3] = [0.15, 0.5, 0.85];
    SHARES.into_iter().flat_map(move |t| {
        let p = a + (b - a) * t;
        SHARES
            .into_iter()
            .map(move |u| Point::new(p.x, p.y + (limit - p.y) * u))
    })
}

impl Ground<'_> {
    /// The lane prolonged to `shortest_m`, both ends alike where zones let it.
    pub(super) fn stretched(&self, x: f64, low: f64, high: f64, shortest_m: f64) -> (f64, f64) {
        let want = shortest_m - (high - low);
        if want <= 0.0 {
            return (low, high);
        }
        let below = low - self.run(x, low, low - want);
        let above = self.run(x, high, high + want) - high;
        let down = (want / 2.0).max(want - above).min(below);
        (low - down, high + (want - down).min(above))
    }
}

/// The passes along borders that are needed beside `passes`: each leftover that no pass
/// sees, the longest first.
pub(super) fn chosen(
    mut leftovers: Vec<Leftover>,
    passes: &[Pass],
    measures: &Measures,
) -> Vec<Pass> {
    leftovers.sort_by(|a, b| {
        let (a, b) = (a.pass, b.pass);
        (b.length_m().total_cmp(&a.length_m()))
            .then(a.from.x.total_cmp(&b.from.x))
            .then(a.from.y.total_cmp(&b.from.y))
    });
    let mut more: Vec<Pass> = Vec::new();
    for leftover in leftovers {
        let seen = |p: &Point| {
            more.iter()
                .chain(passes)
                .any(|pass| pass.sees(*p, measures.lane_spacing_m / 2.0, measures.look_ahead_m))
        };
        if !leftover.samples.iter().all(seen) {
            more.push(leftover.pass);
        }
    }
    more
}
