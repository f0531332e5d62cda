//! Lanes of a cell, and passes for the pockets that lanes do not look into (D2.7 §3.6.1,
//! the zig-zag motions).
//!
//! A cell is cut into strips no wider than the lane spacing, with a lane in the middle of
//! each. Over open borders a lane runs on until its strip is seen wholly; at a zone it
//! must end, and where the zone's border slants away steeply, a pocket beside the lane's
//! end is not seen. A pass along the deepest line of the pocket sees all of it, as it is
//! at most half a spacing wide and the sweep line meets the cell in one piece.

use super::cells::{Cell, Slice};
use super::frame::{Axes, Edge, SAME_M};
use super::{Measures, Pass};
use skein_geometry::frame::{Point, Vector};

/// Share of the spacing that a strip may be wider, or an end may be short: less than the
/// coverage is measured with.
pub(super) const SLACK: f64 = 1e-4;

/// What a lane's end may leave unseen along the lane, in spacings, before a pass is flown
/// for it.
pub(super) const UNSEEN_END: f64 = 0.002;

/// Lines in one pocket at most; more than one only where a strip slants across its width.
const MOST_RUNGS: usize = 16;

/// Rounding of the measures of a point on a footprint's border, metres.
const ROUNDING_M: f64 = 1e-6;

/// Passes in pockets keep this much off borders, so that no rounding puts them inside,
/// metres.
pub(super) const OFF_BORDER_M: f64 = 1e-4;

/// The borders of zones in one turned frame.
pub(super) struct FreeSpace<'a> {
    pub(super) zones: &'a [Edge],
}

impl FreeSpace<'_> {
    /// The line at `x` inside zones, from below.
    fn blocked(&self, x: f64) -> Vec<(f64, f64)> {
        let mut crossings: Vec<(f64, i32)> = self
            .zones
            .iter()
            .filter(|e| e.left.x < x && x <= e.right.x)
            .map(|e| (e.y_at(x), e.step))
            .collect();
        // Where one zone ends and another begins at the same height, nothing is free.
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        let mut blocked = Vec::new();
        let (mut inside, mut entry) = (0, 0.0);
        for (y, step) in crossings {
            if inside <= 0 && inside + step > 0 {
                entry = y;
            } else if inside > 0 && inside + step <= 0 {
                blocked.push((entry, y));
            }
            inside += step;
        }
        blocked
    }

    /// The line at `x` outside of zones, from below.
    pub(super) fn free(&self, x: f64) -> Vec<(f64, f64)> {
        let mut free = Vec::new();
        let mut low = f64::NEG_INFINITY;
        for (a, b) in self.blocked(x) {
            free.push((low, a));
            low = b;
        }
        free.push((low, f64::INFINITY));
        free
    }

    /// How far the line at `x` may be followed from `from` towards `to` before a zone: not at
    /// all from inside of one, where rounding puts a place on a steep border.
    fn run(&self, x: f64, from: f64, to: f64) -> f64 {
        let up = to >= from;
        let mut reach = to;
        for (a, b) in self.blocked(x) {
            if up && b > from + SAME_M {
                reach = reach.min(a);
            }
            if !up && a < from - SAME_M {
                reach = reach.max(b);
            }
        }
        if up { reach.max(from) } else { reach.min(from) }
    }
}

/// A part of a strip that its lane does not see.
#[derive(Clone, Debug)]
pub(super) struct Leftover {
    /// A pass that sees it.
    pub(super) pass: Pass,
    /// Points that must be seen for the pass to be needless.
    pub(super) samples: Vec<Point>,
}

/// The lanes of a cell, from left to right; what they do not see goes to `leftovers`.
pub(super) fn lanes(cell: &Cell, sheet: &Sheet<'_>, leftovers: &mut Vec<Leftover>) -> Vec<Pass> {
    let (left, right) = (cell.left(), cell.right());
    let n = ((right - left) / sheet.measures.lane_spacing_m - SLACK).ceil();
    let mut lanes = Vec::new();
    let mut i = 0.0;
    while i < n {
        let at = |i: f64| left + (right - left) * i / n;
        let strip = Strip::of(cell, at(i), at(i + 1.0));
        i += 1.0;
        let (x, low, high) = strip.lane(sheet.free_space, sheet.measures.look_ahead_m);
        strip.pockets(x, (low, high), sheet, leftovers);
        lanes.push(sheet.pass(x, low, high));
    }
    lanes
}

/// A piece of a cell as wide as a lane.
pub(super) struct Strip<'a> {
    pub(super) from: f64,
    pub(super) to: f64,
    slices: &'a [Slice],
}

impl<'a> Strip<'a> {
    /// The part of a cell between two places.
    pub(super) fn of(cell: &'a Cell, from: f64, to: f64) -> Self {
        let first = cell.slices.partition_point(|s| s.right <= from);
        let last = cell.slices.partition_point(|s| s.left < to);
        Self {
            from,
            to,
            slices: &cell.slices[first.min(last)..last],
        }
    }

    /// The lowest floor and the highest ceiling.
    pub(super) fn extent(&self) -> (f64, f64) {
        let mut extent = (f64::INFINITY, f64::NEG_INFINITY);
        for (s, a, b) in self.pieces() {
            for at in [a, b] {
                extent.0 = extent.0.min(s.floor.y_at(at));
                extent.1 = extent.1.max(s.ceiling.y_at(at));
            }
        }
        extent
    }

    /// Floor and ceiling at `x`: at a step between slices those of the slice to the left.
    pub(super) fn core(&self, x: f64) -> (f64, f64) {
        let at = |s: &Slice| (s.floor.y_at(x), s.ceiling.y_at(x));
        let slice = self.slices.iter().find(|s| s.left <= x && x <= s.right);
        slice.or(self.slices.first()).map_or((0.0, 0.0), at)
    }

    /// Whether the point is inside, the border included.
    pub(super) fn holds(&self, x: f64, y: f64) -> bool {
        let holds = |s: &Slice| {
            s.left <= x && x <= s.right && s.floor.y_at(x) <= y && y <= s.ceiling.y_at(x)
        };
        self.slices.iter().any(holds)
    }

    /// The slices of the strip, each with its extent in it.
    fn pieces(&self) -> impl Iterator<Item = (&Slice, f64, f64)> {
        let within = |s: &&Slice| s.right > self.from && s.left < self.to;
        self.slices
            .iter()
            .filter(within)
            .map(|s| (s, s.left.max(self.from), s.right.min(self.to)))
    }

    /// Place, low and high end of the lane that sees the strip as far as zones let it.
    fn lane(&self, free_space: &FreeSpace<'_>, look_ahead_m: f64) -> (f64, f64, f64) {
        let x = self.from.midpoint(self.to);
        let (low, high) = trimmed(self.extent(), look_ahead_m);
        let (floor, ceiling) = self.core(x);
        let floor = free_space.run(x, floor, low.min(floor));
        let ceiling = free_space.run(x, ceiling, high.max(ceiling));
        let low = low.max(floor).min(ceiling);
        (x, low, high.min(ceiling).max(low))
    }

    /// What a pass at `x` from `low` to `high` leaves unseen to its left and right, beyond
    /// its ends: each pocket with the passes that see it.
    pub(super) fn pockets(
        &self,
        x: f64,
        (low, high): (f64, f64),
        sheet: &Sheet<'_>,
        into: &mut Vec<Leftover>,
    ) {
        let measures = sheet.measures;
        let reach = measures.look_ahead_m + UNSEEN_END * measures.lane_spacing_m;
        for (from, to) in [(self.from, x), (x, self.to)] {
            for (limit, up) in [(low - reach, false), (high + reach, true)] {
                let side = Side {
                    strip: self,
                    from,
                    to,
                    sign: if up { -1.0 } else { 1.0 },
                };
                let rungs = side.rungs(side.sign * limit, measures.look_ahead_m);
                if rungs.is_empty() {
                    continue;
                }
                let samples = self.samples((from, to), limit, up, measures);
                let samples: Vec<Point> = samples.into_iter().map(|p| sheet.axes.back(p)).collect();
                into.extend(rungs.into_iter().map(|(x, a, b)| Leftover {
                    pass: sheet.pass(x, a.min(b), a.max(b)),
                    samples: samples.clone(),
                }));
            }
        }
    }

    /// Points between two places beyond the height `limit`.
    fn samples(
        &self,
        (from, to): (f64, f64),
        limit: f64,
        up: bool,
        measures: &Measures,
    ) -> Vec<Point> {
        let mut samples = Vec::new();
        for (s, a, b) in self.pieces() {
            let (a, b) = (a.max(from), b.min(to));
            if b - a <= SAME_M {
                continue;
            }
            for t in [0.02, 0.3, 0.7, 0.98] {
                let x = a + (b - a) * t;
                let y = if up {
                    s.ceiling.y_at(x)
                } else {
                    s.floor.y_at(x)
                };
                if (y > limit) == up {
                    let shares = shares((limit - y).abs(), measures);
                    samples.extend(shares.map(|u| Point::new(x, y + (limit - y) * u)));
                }
            }
        }
        samples
    }
}

/// One side of a strip, looked at from its floor; turned over for its ceiling.
struct Side<'a> {
    strip: &'a Strip<'a>,
    from: f64,
    to: f64,
    sign: f64,
}

impl Side<'_> {
    /// The slices of the side with their extents, a little inside.
    fn pieces(&self) -> impl Iterator<Item = (&Slice, f64, f64)> {
        self.strip.pieces().filter_map(|(s, a, b)| {
            let (a, b) = (a.max(self.from), b.min(self.to));
            let off = OFF_BORDER_M.min((b - a) / 4.0);
            (b - a > SAME_M).then_some((s, a + off, b - off))
        })
    }

    /// Floor and ceiling at `x`, as seen from below.
    fn gap(&self, s: &Slice, x: f64) -> (f64, f64) {
        if self.sign > 0.0 {
            (s.floor.y_at(x), s.ceiling.y_at(x))
        } else {
            (-s.ceiling.y_at(x), -s.floor.y_at(x))
        }
    }

    /// Lines that together see everything of this side below `limit`: each with its place
    /// and its ends, from below. One line will do, unless the side slants so much that no
    /// line runs from its deepest point to the limit.
    fn rungs(&self, limit: f64, look_ahead_m: f64) -> Vec<(f64, f64, f64)> {
        let mut rungs = Vec::new();
        let lowest = self
            .pieces()
            .flat_map(|(s, a, b)| [self.gap(s, a).0, self.gap(s, b).0])
            .fold(f64::INFINITY, f64::min);
        let mut seen = lowest;
        while seen < limit - SAME_M && rungs.len() < MOST_RUNGS {
            // Of the lines that begin where the last one looks to, the highest.
            let mut best: Option<(f64, f64, f64)> = None;
            for (s, a, b) in self.pieces() {
                for x in [a, b, self.place_of(s, a, b, seen)] {
                    let (floor, ceiling) = self.gap(s, x);
                    let end = ceiling.min(limit);
                    if floor <= seen + SAME_M && best.as_ref().is_none_or(|r| end > r.2) {
                        best = Some((x, floor.max(seen).min(end), end));
                    }
                }
            }
            match best {
                Some((x, low, high)) if high > seen - look_ahead_m => {
                    // What is seen beyond the ends need not be flown.
                    let whole = high >= limit - SAME_M && rungs.is_empty();
                    let (a, b) = if whole {
                        trimmed((low, high), look_ahead_m)
                    } else {
                        (low, high)
                    };
                    rungs.push((x, self.sign * a, self.sign * b));
                    if high + look_ahead_m <= seen + SAME_M {
                        break;
                    }
                    seen = high + look_ahead_m;
                }
                _ => break,
            }
        }
        rungs
    }

    /// Where the floor of a slice is at this height, or the nearer end.
    fn place_of(&self, s: &Slice, a: f64, b: f64, height: f64) -> f64 {
        let (at_a, at_b) = (self.gap(s, a).0, self.gap(s, b).0);
        if (at_b - at_a).abs() <= SAME_M {
            return a;
        }
        a + (b - a) * ((height - at_a) / (at_b - at_a)).clamp(0.0, 1.0)
    }
}

/// What lanes of one heading are laid on.
#[derive(Clone, Copy)]
pub(super) struct Sheet<'a> {
    pub(super) axes: Axes,
    pub(super) free_space: &'a FreeSpace<'a>,
    pub(super) measures: &'a Measures,
}

impl Sheet<'_> {
    /// The pass along the line at `x`, prolonged to the shortest length where it can be.
    pub(super) fn pass(&self, x: f64, low: f64, high: f64) -> Pass {
        let shortest_m = self.measures.shortest_pass_m;
        let (low, high) = self.free_space.stretched(x, low, high, shortest_m);
        Pass {
            from: self.axes.back(Point::new(x, low)),
            to: self.axes.back(Point::new(x, high)),
        }
    }
}

/// Where on a line of this length something must be seen, as shares: near both ends, and
/// so densely between them that no pass that sees two neighbours misses much between.
pub(super) fn shares(length_m: f64, measures: &Measures) -> impl Iterator<Item = f64> {
    let n = (length_m / measures.lane_spacing_m * 4.0)
        .ceil()
        .clamp(2.0, 40.0);
    let mut i = -1.0;
    core::iter::from_fn(move || {
        i += 1.0;
        (i <= n).then(|| 0.02 + 0.96 * i / n)
    })
}

/// An interval without what is seen ahead of its ends and behind them; its middle where
/// nothing is left.
pub(super) fn trimmed((low, high): (f64, f64), look_ahead_m: f64) -> (f64, f64) {
    let trim = look_ahead_m.min((high - low) / 2.0);
    (low + trim, high - trim)
}

impl FreeSpace<'_> {
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

/// A pass with what tells quickly whether it sees a point.
struct Eye {
    from: Point,
    along: Vector,
    length_m: f64,
}

impl Eye {
    fn new(pass: &Pass) -> Self {
        let length_m = pass.length_m();
        Self {
            from: pass.from,
            along: (pass.to - pass.from) / length_m.max(f64::MIN_POSITIVE),
            length_m,
        }
    }

    fn sees(&self, p: Point, measures: &Measures) -> bool {
        let v = p - self.from;
        let along = v.dot(&self.along);
        self.along.perp(&v).abs() <= measures.lane_spacing_m / 2.0 + ROUNDING_M
            && along >= -measures.look_ahead_m - ROUNDING_M
            && along <= self.length_m + measures.look_ahead_m + ROUNDING_M
    }
}

/// The passes of `leftovers` that are needed beside `passes` and are added to them: of
/// each leftover of which something is not seen yet, the longest first.
pub(super) fn choose(leftovers: &[Leftover], passes: &mut Vec<Pass>, measures: &Measures) {
    let mut eyes: Vec<Eye> = passes.iter().map(Eye::new).collect();
    let unseen = |l: &&Leftover, eyes: &[Eye]| {
        let seen = |p: &Point| eyes.iter().any(|e| e.sees(*p, measures));
        !l.samples.iter().all(seen)
    };
    let mut left: Vec<&Leftover> = leftovers.iter().filter(|l| unseen(l, &eyes)).collect();
    left.sort_by(|a, b| {
        let (a, b) = (a.pass, b.pass);
        (b.length_m().total_cmp(&a.length_m()))
            .then(a.from.x.total_cmp(&b.from.x))
            .then(a.from.y.total_cmp(&b.from.y))
    });
    for leftover in left {
        if unseen(&leftover, &eyes) {
            eyes.push(Eye::new(&leftover.pass));
            passes.push(leftover.pass);
        }
    }
}
