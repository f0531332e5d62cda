//! The plane of every Dubins word between two intervals of headings, and its length
//! between their middles, in turn radii.
//!
//! Each word's own reason why it is nowhere shorter than its plane stands with it; all
//! are left-first, the others are seen in a mirror (`leg`).

use super::plane::{Clip, FREE, NOWHERE, Plane, flat};
use skein_flight::trajectory::dubins::length::Goal;
use skein_geometry::math::kernels::angle_tau;
use skein_geometry::math::{FRAC_PI_2, PI, TAU};

/// Beyond this distance of the centres the middle turn of LRL is too steep for a
/// tangent plane; where they part, at 4, it is infinitely so.
const STEEP_APART: f64 = 3.95;

/// Angles and places are rounded by less, radians and turn radii.
const SLACK: f64 = 1e-9;

/// Half widths of both ends, and the distance of the two waypoints.
#[derive(Clone, Copy)]
pub(super) struct Reach {
    pub first: f64,
    pub last: f64,
    pub distance: f64,
    pub moment: f64,
    /// How far the goal may drift from where it is looked at.
    pub drift: f64,
    /// The wind as seen from the start.
    pub wind: (f64, f64),
    /// Words that are shorter come too early: their next circle is looked at.
    pub from: f64,
}

impl Reach {
    /// How far the centres move at most.
    pub fn moved(&self) -> f64 {
        self.first + self.last + self.drift
    }

    /// The same reach in a mirror.
    pub fn mirrored(&self) -> Self {
        Self {
            wind: (self.wind.0, -self.wind.1),
            ..*self
        }
    }

    /// No curve is shorter.
    pub fn nearest(&self) -> f64 {
        self.distance - self.drift
    }

    /// Full circles that a word must be longer by, if its length is at most `most`, in
    /// order not to come too early.
    pub fn waits(&self, most: f64) -> f64 {
        if most < self.from - SLACK {
            TAU * ((self.from - SLACK - most) / TAU).ceil()
        } else {
            0.0
        }
    }

    /// How much a clip bends at either end: the goal and a unit vector turn; and how
    /// much the drift may move it.
    pub fn bends(&self) -> (f64, f64) {
        let both = self.moved() * self.moved();
        let bend = |h: f64| 0.5 * (self.distance * h * h + both) + self.drift * (1.0 + h) + SLACK;
        (bend(self.first), bend(self.last))
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
pub(super) fn same(goal: &Goal, r: Reach) -> (Plane, f64) {
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
pub(super) fn cross(goal: &Goal, r: Reach) -> (Plane, f64) {
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
pub(super) fn three(goal: &Goal, r: Reach, other: f64) -> (Plane, f64) {
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
pub(super) fn three_short(goal: &Goal, r: Reach) -> Plane {
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
