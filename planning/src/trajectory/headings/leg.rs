//! Lower bounds of one leg over an interval of headings at either end.
//!
//! A waypoint's incoming and outgoing leg each choose a heading within the same
//! interval, not the same heading; what that relaxation gives away is taken back
//! to first order by a slope: the incoming leg pays `−λ(θ−c)`, the outgoing one
//! `+λ(θ−c)`, which cancel wherever both agree.
//!
//! A word with a straight is, for any fixed direction, at least its share in that
//! direction plus its turns: a sum of one function a heading whose second derivative
//! is the sine of the turn. Its tangent plane at the middle is a bound wherever the
//! turns are below a half circle, and falls short by no more than the sines allow
//! elsewhere. Turns are continued through zero: a word that would need a full circle
//! there is only longer. Where it does, the word ends: a clip, one linear condition
//! that must hold for the plane to count, takes away what the plane gives too much
//! beyond. Words without a straight have tangent planes and clips, too.

use super::interval;
use crate::frame::Vector;
use crate::math::kernels::{angle_tau, near_pi};
use crate::math::{FRAC_PI_2, PI, TAU};
use crate::trajectory::dubins::length::Goal;

/// A heading interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    /// Middle, radians.
    pub mid_rad: f64,
    /// Half the width, radians.
    pub half_rad: f64,
    pub sin: f64,
    pub cos: f64,
    /// Which interval of the round before it is a part of.
    pub parent: usize,
}

impl Arc {
    pub fn new(mid_rad: f64, half_rad: f64, parent: usize) -> Self {
        let (sin, cos) = crate::math::kernels::sin_cos(mid_rad);
        Self {
            mid_rad,
            half_rad,
            sin,
            cos,
            parent,
        }
    }
}

/// A bound linear in the headings: a word is nowhere shorter than
/// `low + first·δ₁ + last·δ₂`, nor exists unless `clip` is met, or else costs a
/// full circle more.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    low: f64,
    first: f64,
    last: f64,
    clip: Clip,
    /// What a full circle costs.
    circle: f64,
}

/// What must hold for a turn not to have passed through zero:
/// `room + first·δ₁ + last·δ₂ ≥ 0`.
#[derive(Clone, Copy, Debug)]
struct Clip {
    room: f64,
    first: f64,
    last: f64,
}

/// Holds everywhere.
const FREE: Clip = Clip {
    room: f64::INFINITY,
    first: 0.0,
    last: 0.0,
};

const NOWHERE: Plane = flat(f64::INFINITY);

/// A bound that no heading changes.
const fn flat(low: f64) -> Plane {
    Plane {
        low,
        first: 0.0,
        last: 0.0,
        clip: FREE,
        circle: TAU,
    }
}

impl Clip {
    /// How far below zero it goes in the box; negative when it always holds.
    fn depth(&self, r: &Reach) -> f64 {
        self.first.abs() * r.first + self.last.abs() * r.last - self.room
    }

    /// Whether it holds nowhere in the box.
    fn never(&self, r: &Reach) -> bool {
        self.room + self.first.abs() * r.first + self.last.abs() * r.last < 0.0
    }

    /// The one of two that cuts away more of the box, if any cuts it.
    fn tighter(self, other: Self, r: &Reach) -> Self {
        let share = |c: &Self| {
            let depth = c.depth(r);
            if depth > 0.0 {
                depth / (c.room + depth).max(1e-300)
            } else {
                0.0
            }
        };
        let (one, two) = (share(&self), share(&other));
        if one.max(two) <= 0.0 {
            FREE
        } else if one >= two {
            self
        } else {
            other
        }
    }
}

impl Plane {
    /// What a bound of the length at a moment says of the time, when the straight's
    /// direction meets the wind with the share `along`: the goal drifts the other way.
    fn in_time(self, along: f64, r: &Reach) -> Self {
        let pace = 1.0 / (1.0 + along);
        Self {
            low: r.moment + (self.low - r.moment) * pace,
            first: self.first * pace,
            last: self.last * pace,
            circle: self.circle * pace,
            ..self
        }
    }

    fn mirrored(self) -> Self {
        Self {
            first: -self.first,
            last: -self.last,
            clip: Clip {
                first: -self.clip.first,
                last: -self.clip.last,
                ..self.clip
            },
            ..self
        }
    }

    /// Least value over the half widths `h` with the slopes paid, and the share of
    /// the clip in it.
    ///
    /// By duality: every positive share of the clip may be taken off the plane, and
    /// the best one makes one of the slopes vanish.
    fn least(&self, h: (f64, f64), paid: (f64, f64)) -> (f64, f64) {
        let (x, y) = (self.first + paid.0, self.last - paid.1);
        let plain = self.low - x.abs() * h.0 - y.abs() * h.1;
        let c = &self.clip;
        if c.room >= c.first.abs() * h.0 + c.last.abs() * h.1 {
            return (plain, 0.0);
        }
        let next = plain + self.circle;
        if c.room + c.first.abs() * h.0 + c.last.abs() * h.1 < 0.0 {
            return (next, 0.0);
        }
        let mut best = (plain, 0.0);
        for share in [x / c.first, y / c.last] {
            if share > 0.0 && share < f64::INFINITY {
                let value = self.low
                    - share * c.room
                    - (x - share * c.first).abs() * h.0
                    - (y - share * c.last).abs() * h.1;
                if value > best.0 {
                    best = (value, share);
                }
            }
        }
        (best.0.min(next), best.1)
    }
}

/// A bound further below the length at the middle than this slope times the half
/// widths is doubtful: no word with a straight is steeper than 2.
const DOUBTFUL: f64 = 2.0;

/// A clip may make any slope of a word's plane; beyond this, that of a word with a
/// straight, it fits no other leg.
const STEEPEST: f64 = 2.0;

/// Beyond this distance of the centres the middle turn of LRL is too steep for a
/// tangent plane; where they part, at 4, it is infinitely so.
const STEEP_APART: f64 = 3.95;

/// Angles and places are rounded by less, radians and turn radii.
const SLACK: f64 = 1e-9;

/// One leg between two intervals, in turn radii.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    planes: [Plane; 8],
    /// Length of the shortest curve between the middles.
    pub length: f64,
    /// What is known without planes, when the air drifts.
    pub slice: Option<Slice>,
}

/// Times between which planes hold.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice {
    /// No pair of headings arrives before.
    pub from: f64,
    /// What arrives later is not bounded by a plane.
    pub until: f64,
}

/// The air's drift while a leg is flown; one turn radius and one radian's time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drift {
    /// The air's velocity in airspeeds.
    pub wind: Vector,
    /// Where the goal is looked at, and how much earlier or later it may be met.
    pub moment: f64,
    pub spread: f64,
}

/// Half widths of both ends, and the distance of the two waypoints.
#[derive(Clone, Copy)]
struct Reach {
    first: f64,
    last: f64,
    distance: f64,
    moment: f64,
    /// How far the goal may drift from where it is looked at.
    drift: f64,
    /// The wind as seen from the start.
    wind: (f64, f64),
    /// Words that are shorter come too early: their next circle is looked at.
    from: f64,
}

impl Reach {
    /// How far the centres move at most.
    fn moved(&self) -> f64 {
        self.first + self.last + self.drift
    }

    /// The same reach in a mirror.
    fn mirrored(&self) -> Self {
        Self {
            wind: (self.wind.0, -self.wind.1),
            ..*self
        }
    }

    /// No curve is shorter.
    fn nearest(&self) -> f64 {
        self.distance - self.drift
    }

    /// Full circles that a word must be longer by, if its length is at most `most`, in
    /// order not to come too early.
    fn waits(&self, most: f64) -> f64 {
        if most < self.from - SLACK {
            TAU * ((self.from - SLACK - most) / TAU).ceil()
        } else {
            0.0
        }
    }

    /// How much a clip bends at either end: the goal and a unit vector turn; and how
    /// much the drift may move it.
    fn bends(&self) -> (f64, f64) {
        let both = self.moved() * self.moved();
        let bend = |h: f64| 0.5 * (self.distance * h * h + both) + self.drift * (1.0 + h) + SLACK;
        (bend(self.first), bend(self.last))
    }
}

impl Leg {
    /// A leg that no heading flies.
    pub fn nowhere() -> Self {
        Self {
            planes: [NOWHERE; 8],
            length: f64::INFINITY,
            slice: None,
        }
    }

    /// The leg that goes by `v` turn radii from `a` to `b`.
    pub fn new(v: Vector, a: &Arc, b: &Arc) -> Self {
        Self::drifting(v, a, b, &Drift::default())
    }

    /// The leg to a goal that lies by `v` at the drift's moment.
    pub fn drifting(v: Vector, a: &Arc, b: &Arc, drift: &Drift) -> Self {
        let turn = near_pi(b.mid_rad - a.mid_rad);
        let seen = |v: Vector| (v.x * a.cos + v.y * a.sin, v.y * a.cos - v.x * a.sin);
        let (x, y) = seen(v);
        let goal = Goal {
            x,
            y,
            turn: if turn < 0.0 { turn + TAU } else { turn },
            sin: b.sin * a.cos - b.cos * a.sin,
            cos: b.cos * a.cos + b.sin * a.sin,
            tol: 1e-12,
        };
        let mirror = goal.mirrored();
        let reach = Reach {
            first: a.half_rad,
            last: b.half_rad,
            distance: (v.x * v.x + v.y * v.y).sqrt(),
            moment: drift.moment,
            drift: drift.spread * drift.wind.norm(),
            wind: seen(drift.wind),
            from: drift.moment - drift.spread,
        };
        let back = reach.mirrored();
        let flip = |(p, l): (Plane, f64)| (p.mirrored(), l);
        let words = [
            same(&goal, reach),
            flip(same(&mirror, back)),
            cross(&goal, reach),
            flip(cross(&mirror, back)),
        ];
        let mut planes = [NOWHERE; 8];
        let mut length = f64::INFINITY;
        for (plane, word) in planes.iter_mut().zip(words) {
            *plane = word.0;
            length = length.min(word.1);
        }
        // Beyond 4 radii the shortest has a straight.
        if reach.nearest() <= 4.0 {
            let other = if drift.spread > 0.0 {
                f64::INFINITY
            } else {
                length
            };
            for (plane, word) in planes[4..].iter_mut().zip([
                three(&goal, reach, other),
                flip(three(&mirror, back, other)),
            ]) {
                *plane = word.0;
                length = length.min(word.1);
            }
        }
        if drift.spread > 0.0 {
            planes[6] = three_short(&goal, reach);
            planes[7] = three_short(&mirror, back).mirrored();
        }
        Self {
            planes,
            length,
            slice: None,
        }
    }

    /// The planes there are: middle turns below a half circle are in drifting air only.
    fn known(&self) -> &[Plane] {
        &self.planes[..if self.slice.is_some() { 8 } else { 6 }]
    }

    /// The least over all planes, no slopes paid.
    pub fn least(&self, a: &Arc, b: &Arc) -> f64 {
        let h = (a.half_rad, b.half_rad);
        self.known()
            .iter()
            .fold(f64::INFINITY, |l, p| l.min(p.least(h, (0.0, 0.0)).0))
    }

    /// The bound with only the first slope paid, and the last slope that would
    /// take nothing away from it.
    pub fn open_bound(&self, a: &Arc, slope_a: f64) -> (f64, f64) {
        let h = (a.half_rad, 0.0);
        self.known().iter().fold((f64::INFINITY, 0.0), |least, p| {
            let (low, share) = p.least(h, (slope_a, p.last));
            if low < least.0 {
                let slope = p.last - share * p.clip.last;
                let bent = slope.clamp(-STEEPEST, STEEPEST);
                (low, if share > 0.0 { bent } else { slope })
            } else {
                least
            }
        })
    }

    /// No pair of headings in the two intervals has a shorter curve, slopes paid.
    ///
    /// Far below the middle's length, where a word may begin or end within the
    /// intervals, the exact optimum without slopes may say more.
    pub fn bound(&self, v: Vector, a: &Arc, slope_a: f64, b: &Arc, slope_b: f64) -> f64 {
        let h = (a.half_rad, b.half_rad);
        let planes = self.known().iter().fold(f64::INFINITY, |least, p| {
            least.min(p.least(h, (slope_a, slope_b)).0)
        });
        let paid = slope_a.abs() * a.half_rad + slope_b.abs() * b.half_rad;
        if let Some(slice) = &self.slice {
            return planes.min(slice.until - paid).max(slice.from - paid);
        }
        if planes > self.length - DOUBTFUL * (a.half_rad + b.half_rad) {
            return planes;
        }
        planes.max(interval::shortest(v, a, b) - paid)
    }

    /// How much of the bound's looseness narrower intervals at either end would
    /// take away: all that is known of it is where the slopes do not fit.
    pub fn looseness(&self, bound: f64, a: (&Arc, f64), b: (&Arc, f64)) -> (f64, f64) {
        let wide = (a.0.half_rad, b.0.half_rad);
        if bound < self.length - 2.0 * DOUBTFUL * (wide.0 + wide.1) {
            return (
                if wide.0 > 0.0 { f64::INFINITY } else { 0.0 },
                if wide.1 > 0.0 { f64::INFINITY } else { 0.0 },
            );
        }
        let mut least = (f64::INFINITY, (0.0, 0.0));
        for p in self.known() {
            let (low, share) = p.least(wide, (a.1, b.1));
            if low < least.0 {
                let loss = (
                    (p.first + a.1 - share * p.clip.first).abs() * wide.0,
                    (p.last - b.1 - share * p.clip.last).abs() * wide.1,
                );
                least = (low, loss);
            }
        }
        if least.0 < bound {
            return (a.1.abs() * wide.0, b.1.abs() * wide.1);
        }
        least.1
    }
}

/// The turn nearest to `turn` that stays below a full circle when `reach` is added.
fn continued(turn: f64, reach: f64) -> f64 {
    if turn > TAU - reach { turn - TAU } else { turn }
}

/// How far a sum of two ends falls below its tangents: each bends by the sine of its
/// turn, which changes by no more than the half width.
fn dips(r: &Reach, sines: (f64, f64)) -> f64 {
    let dip = |h: f64, sin: f64| 0.5 * h * h * (h - sin).clamp(0.0, 1.0);
    dip(r.first, sines.0) + dip(r.last, sines.1)
}

/// An angle of at most two circles, in [0, 2π).
fn wrapped(a_rad: f64) -> f64 {
    if a_rad < 0.0 { a_rad + TAU } else { a_rad }
}

/// LSL.
///
/// The straight is at least as long as its share in any one direction u, so with v
/// from centre to centre the word is at least u·v and both turns, the headings'
/// difference. That is a function of each heading alone.
fn same(goal: &Goal, r: Reach) -> (Plane, f64) {
    let v = goal.left_left();
    let p = (v.0 * v.0 + v.1 * v.1).sqrt();
    let u = if p > goal.tol {
        (v.0 / p, v.1 / p)
    } else {
        (1.0, 0.0)
    };
    let end = (
        u.0 * goal.cos + u.1 * goal.sin,
        u.0 * goal.sin - u.1 * goal.cos,
    );
    let (turn, clip) = both_turns(goal, v, p, r);
    let wait = r.waits(p + turn + 2.0 * r.moved());
    let (turn, clip) = (turn + wait, if wait > 0.0 { FREE } else { clip });
    let plane = Plane {
        low: p + turn - dips(&r, (u.1, end.1)),
        first: u.0 - 1.0,
        last: 1.0 - end.0,
        clip,
        circle: TAU,
    };
    let along = u.0 * r.wind.0 + u.1 * r.wind.1;
    (plane.in_time(along, &r), goal.same())
}

/// The least that both turns of LSL can be together, and where they are so.
///
/// Turned by the headings' difference the straight's course lies between the two:
/// left of the first (e₁ × v ≥ 0) and right of the last (v × e₂ ≥ 0), or, if the
/// difference is above a half circle, either of the two.
fn both_turns(goal: &Goal, v: (f64, f64), p: f64, r: Reach) -> (f64, Clip) {
    let (along, across) = (
        v.0 * goal.cos + v.1 * goal.sin,
        v.0 * goal.sin - v.1 * goal.cos,
    );
    let bends = r.bends();
    let after = Clip {
        room: v.1 + bends.0,
        first: -v.0,
        last: -goal.sin,
    };
    let before = Clip {
        room: across + bends.1,
        first: goal.sin,
        last: along,
    };
    let moved = r.moved();
    let turn = continued(goal.turn, moved + SLACK);
    if turn + moved <= PI {
        // Between headings so alike backward is between, too.
        let ahead = v.0 + along + 2.0 * moved + p * moved + SLACK;
        if after.never(&r) || before.never(&r) || ahead < 0.0 {
            return (turn + TAU, FREE);
        }
        return (turn, after.tighter(before, &r));
    }
    let (no_after, no_before) = (after.never(&r), before.never(&r));
    if no_after && no_before {
        return (turn + TAU, FREE);
    }
    let (after_counts, before_counts) = if turn - moved < PI {
        // A course ahead of a heading has turned by less than a quarter there.
        (
            v.0 > moved + p * r.first + SLACK,
            along > moved + p * r.last + SLACK,
        )
    } else {
        (no_before, no_after)
    };
    let clip = |counts: bool, clip: Clip| if counts { clip } else { FREE };
    let both = clip(after_counts, after).tighter(clip(before_counts, before), &r);
    (turn, both)
}

/// LSR.
///
/// Let v lead from centre to centre and u be the straight's direction θ. Of all θ
/// that are less than a quarter circle to the left of v the word's own makes
/// u·v + 2θ the most, so any of them bounds it from below, and again as a function
/// of each heading alone.
fn cross(goal: &Goal, r: Reach) -> (Plane, f64) {
    let v = goal.left_right();
    let square = v.0 * v.0 + v.1 * v.1;
    let moved = r.moved();
    let apart = square.sqrt();
    if apart + moved < 2.0 - SLACK {
        return (NOWHERE, f64::INFINITY);
    }
    let straight = (square - 4.0).max(0.0).sqrt();
    let own = (v.0 * straight - 2.0 * v.1, 2.0 * v.0 + v.1 * straight);
    let own_turn = angle_tau(own.1, own.0);
    let length = if square >= 4.0 {
        straight + own_turn + wrapped(own_turn - goal.turn)
    } else {
        f64::INFINITY
    };
    if apart * 0.9 <= moved {
        return (flat(r.nearest()), length);
    }
    // Where circles may touch, v may come to lie across the own direction; one
    // that is turned back towards v stays on its right side.
    let (u, along, turn) = if straight >= moved && square > 4.0 {
        ((own.0 / square, own.1 / square), straight, own_turn)
    } else {
        let cos = moved / apart;
        let sin = (1.0 - cos * cos).sqrt();
        let w = (v.0 / apart, v.1 / apart);
        let u = (w.0 * cos - w.1 * sin, w.1 * cos + w.0 * sin);
        (u, moved, angle_tau(u.1, u.0))
    };
    let swing = swing(apart, moved);
    let t = continued(turn, r.first + swing);
    let q = continued(wrapped(turn - goal.turn), r.last + swing);
    let end = (
        u.0 * goal.cos + u.1 * goal.sin,
        u.1 * goal.cos - u.0 * goal.sin,
    );
    let farthest = apart + moved;
    let longest = (farthest * farthest - 4.0).max(0.0).sqrt();
    let wait = r.waits(longest + t + q + 2.0 * swing + moved);
    let plane = Plane {
        low: along + t + q + wait - dips(&r, (u.1, end.1)),
        first: u.0 - 1.0,
        last: end.0 - 1.0,
        clip: if wait > 0.0 {
            FREE
        } else {
            cross_clip(goal, v, r, (t + swing, q + swing))
        },
        circle: TAU,
    };
    let along = u.0 * r.wind.0 + u.1 * r.wind.1;
    (plane.in_time(along, &r), length)
}

/// How far the straight of LSR may be from the direction taken, radians.
fn swing(apart: f64, moved: f64) -> f64 {
    let nearest = apart - moved;
    let least = nearest * nearest - 4.0;
    let steady = if nearest > 2.0 {
        moved / least.max(1e-300).sqrt()
    } else {
        f64::INFINITY
    };
    // The arc sine of x is at most πx/2.
    let veer = FRAC_PI_2 * moved / apart;
    let farthest = apart + moved;
    let lean = 0.5 * (farthest * farthest - 4.0).max(0.0).sqrt();
    steady.min(veer + lean.max(veer))
}

/// Where the circles of LSR do not overlap and neither turn, at most `turns`, has
/// passed through zero: then the goal's circle is left of the first heading's
/// tangent, and the start's of the last.
fn cross_clip(goal: &Goal, v: (f64, f64), r: Reach, turns: (f64, f64)) -> Clip {
    let bends = r.bends();
    let small = |turn: f64, h: f64, clip: Clip| if turn + h < PI { clip } else { FREE };
    let first = Clip {
        room: v.1 + 2.0 + bends.0,
        first: -v.0,
        last: goal.sin,
    };
    let last = Clip {
        room: goal.cos * v.1 - goal.sin * v.0 + 2.0 + bends.1,
        first: -goal.sin,
        last: -(goal.cos * v.0 + goal.sin * v.1),
    };
    let apart = (v.0 * v.0 + v.1 * v.1).sqrt();
    let moved = r.moved();
    let squares = r.first * r.first + r.last * r.last;
    let exists = Clip {
        room: apart - 2.0 + 0.5 * (squares + moved * moved / (apart - moved)) + r.drift + SLACK,
        first: v.0 / apart,
        last: (v.0 * goal.cos + v.1 * goal.sin) / apart,
    };
    small(turns.0, r.first, first)
        .tighter(small(turns.1, r.last, last), &r)
        .tighter(exists, &r)
}

/// LRL with the middle turn above a half circle.
///
/// Its length is the headings' difference and twice the middle turn, which
/// depends on the distance of the centres alone. Not looked into where the middle
/// turn alone is longer than `other`.
fn three(goal: &Goal, r: Reach, other: f64) -> (Plane, f64) {
    let v = goal.left_left();
    let apart = (v.0 * v.0 + v.1 * v.1).sqrt();
    let moved = r.moved();
    let (least, most) = (apart - moved, apart + moved);
    if least > 4.0 {
        return (NOWHERE, f64::INFINITY);
    }
    let flat = |low: f64| flat(low.max(r.nearest()));
    // The arc cosine lies above its chord.
    let middle = PI + PI * (1.0 - most / 4.0).max(0.0);
    if other <= middle {
        return (flat(middle), f64::INFINITY);
    }
    if apart * 0.9 <= moved {
        return (flat(middle), goal.three());
    }
    // The middle turn shrinks as the centres part.
    let lean = |d: f64| {
        let cos = d.clamp(0.0, 4.0) / 4.0;
        angle_tau((1.0 - cos * cos).sqrt(), cos)
    };
    let (low, mid, high) = (lean(most), lean(apart), lean(least));
    // Continued through zero, both outer turns follow the headings and the middle.
    let swing = 1.3 * moved / apart + (high - mid).max(mid - low);
    let out = angle_tau(v.1, v.0) + mid + FRAC_PI_2;
    let out = if out >= TAU { out - TAU } else { out };
    let middle = PI + 2.0 * mid;
    let back = goal.turn - out + middle;
    let back = wrapped(if back >= TAU { back - TAU } else { back });
    let (t, q) = (
        continued(out, r.first + swing),
        continued(back, r.last + swing),
    );
    let wait = r.waits(t + middle + q + 2.0 * swing + moved + 2.0 * (high - mid));
    let length = t + middle + q + wait;
    let whole = if apart <= 4.0 {
        out + middle + back
    } else {
        f64::INFINITY
    };
    if most > STEEP_APART {
        return (flat(length - moved - 4.0 * (mid - low)), whole);
    }
    // The middle turn's first and second derivative in the distance, at its steepest.
    let root = |d: f64| (16.0 - d * d).sqrt();
    let steep = 2.0 / root(most);
    let bent = 2.0 * most / (root(most) * root(most) * root(most));
    let squares = r.first * r.first + r.last * r.last;
    let bend = bent * moved * moved + steep * (squares + moved * moved / least);
    let shrink = -4.0 / (root(apart) * apart);
    let along = v.0 * goal.cos + v.1 * goal.sin;
    let plane = Plane {
        low: length - bend + shrink * apart * r.drift,
        first: shrink * v.0 - 1.0,
        last: 1.0 - shrink * along,
        clip: FREE,
        circle: TAU,
    };
    // A quarter of it for half the middle turn, the rest for the centres' bearing.
    let bends = 0.25 * bend
        + 0.5 * (moved * moved / (least * least) + squares / least)
        + r.drift * (1.0 / least + 0.5 * steep)
        + SLACK;
    let bearing = {
        let square = apart * apart;
        (-v.1 / square, (v.1 * goal.cos - v.0 * goal.sin) / square)
    };
    let lean = (0.25 * shrink * v.0, -0.25 * shrink * along);
    let first = Clip {
        room: t + bends,
        first: bearing.0 + lean.0 - 1.0,
        last: bearing.1 + lean.1,
    };
    let last = Clip {
        room: q + bends,
        first: lean.0 - bearing.0,
        last: 1.0 + lean.1 - bearing.1,
    };
    let clip = if wait > 0.0 {
        FREE
    } else {
        first.tighter(last, &r)
    };
    (Plane { clip, ..plane }, whole)
}

/// LRL with the middle turn below a half circle: never the shortest, but in drifting
/// air the shortest may come too early.
fn three_short(goal: &Goal, r: Reach) -> Plane {
    let v = goal.left_left();
    let apart = (v.0 * v.0 + v.1 * v.1).sqrt();
    let moved = r.moved();
    if apart - moved > 4.0 {
        return NOWHERE;
    }
    let lean = |d: f64| {
        let cos = d.clamp(0.0, 4.0) / 4.0;
        angle_tau((1.0 - cos * cos).sqrt(), cos)
    };
    if apart * 0.9 <= moved {
        // Nearly a single turn: the headings' difference and twice the middle turn.
        let most = PI - 2.0 * lean(apart + moved);
        let turn = continued(goal.turn, moved + most);
        return Plane {
            low: turn + r.waits(turn + 2.0 * most + moved),
            first: -1.0,
            last: 1.0,
            ..flat(0.0)
        };
    }
    let (low, mid, high) = (lean(apart + moved), lean(apart), lean(apart - moved));
    let swing = 1.3 * moved / apart + (high - mid).max(mid - low);
    let out = wrapped(angle_tau(v.1, v.0) - mid + FRAC_PI_2);
    let out = if out >= TAU { out - TAU } else { out };
    let middle = PI - 2.0 * mid;
    let back = wrapped(goal.turn - out + middle);
    let back = if back >= TAU { back - TAU } else { back };
    let (t, q) = (
        continued(out, r.first + swing),
        continued(back, r.last + swing),
    );
    let length = t + middle + q;
    let wait = r.waits(length + moved + 4.0 * (mid - low));
    Plane {
        low: length + wait - 4.0 * (high - mid),
        first: -1.0,
        last: 1.0,
        ..flat(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Point, Pose};
    use crate::trajectory::dubins::length_m;
    use crate::trajectory::headings::air::Air;
    use proptest::prelude::*;

    /// The least length over a grid of headings with slopes paid.
    fn brute(v: Vector, a: &Arc, sa: f64, b: &Arc, sb: f64) -> f64 {
        const STEPS: i32 = 16;
        let mut least = f64::INFINITY;
        for i in -STEPS..=STEPS {
            for j in -STEPS..=STEPS {
                let x = a.half_rad * f64::from(i) / f64::from(STEPS);
                let y = b.half_rad * f64::from(j) / f64::from(STEPS);
                let from = Pose::new(Point::new(0.0, 0.0), a.mid_rad + x);
                let to = Pose::new(Point::new(v.x, v.y), b.mid_rad + y);
                least = least.min(length_m(from, to, 1.0) + sa * x - sb * y);
            }
        }
        least
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3_000))]
        #[test]
        fn no_heading_in_the_intervals_beats_the_bound(
            x in -6.0f64..6.0, y in -6.0f64..6.0, near in 0usize..2, a in 0.0f64..6.3, b in 0.0f64..6.3,
            width in 0.0f64..0.25, ratio in 0.0f64..1.5, slopes in prop::array::uniform2(-2.0f64..2.0),
        ) {
            let scale = [1.0, 0.35][near];
            let v = Vector::new(scale * x, scale * y);
            let (a, b) = (Arc::new(a, width, 0), Arc::new(b, width * ratio, 0));
            let leg = Leg::new(v, &a, &b);
            let to = Pose::new(Point::new(v.x, v.y), b.mid_rad);
            let middle = length_m(Pose::new(Point::new(0.0, 0.0), a.mid_rad), to, 1.0);
            prop_assert!((leg.length - middle).abs() < 1e-7, "{} {middle}", leg.length);
            let least = brute(v, &a, slopes[0], &b, slopes[1]);
            let bound = leg.bound(v, &a, slopes[0], &b, slopes[1]);
            prop_assert!(bound <= least + 1e-9, "{bound} {least}");
        }

        #[test]
        fn no_flight_in_wind_beats_the_bound(
            x in -6.0f64..6.0, y in -6.0f64..6.0, near in 0usize..2, a in 0.0f64..6.3, b in 0.0f64..6.3,
            width in 0.0f64..0.25, ratio in 0.0f64..1.5, slopes in prop::array::uniform2(-2.0f64..2.0),
            share in 0.0f64..0.6, course in 0.0f64..6.3,
        ) {
            const STEPS: i32 = 8;
            let v = Vector::new(x, y) * [1.0, 0.35][near];
            let air = Air { wind: Some(Vector::new(crate::math::cos(course), crate::math::sin(course)) * share) };
            let (a, b) = (Arc::new(a, width, 0), Arc::new(b, width * ratio, 0));
            let mut least = f64::INFINITY;
            for i in -STEPS..=STEPS {
                for j in -STEPS..=STEPS {
                    let x = a.half_rad * f64::from(i) / f64::from(STEPS);
                    let y = b.half_rad * f64::from(j) / f64::from(STEPS);
                    least = least.min(air.cost(v, a.mid_rad + x, b.mid_rad + y) + slopes[0] * x - slopes[1] * y);
                }
            }
            let bound = air.leg(v, &a, &b).bound(v, &a, slopes[0], &b, slopes[1]);
            prop_assert!(bound <= least + 1e-7, "{bound} {least}");
        }

        #[test]
        fn the_bound_of_a_long_leg_is_of_second_order(
            course in 0.0f64..6.3, a in 0.0f64..6.3, b in 0.0f64..6.3, width in 0.001f64..0.02,
        ) {
            let v = Vector::new(9.0 * crate::math::cos(course), 9.0 * crate::math::sin(course));
            let (p, q) = (Arc::new(a, width, 0), Arc::new(b, width, 0));
            let leg = Leg::new(v, &p, &q);
            let sharp = leg.planes.iter().find(|w| (w.low - leg.length).abs() < 1e-3);
            prop_assume!(sharp.is_some());
            let (first, last) = sharp.map_or((0.0, 0.0), |w| (w.first, w.last));
            let loss = brute(v, &p, -first, &q, last) - leg.bound(v, &p, -first, &q, last);
            prop_assert!(loss <= 8.0 * width * width + 1e-9, "{loss}");
        }
    }
}
