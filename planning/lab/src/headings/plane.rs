//! Linear bounds of one word over a box of headings, and where a word ends.

use super::words::Reach;
use skein_geometry::math::TAU;

/// A bound linear in the headings: a word is nowhere shorter than
/// `low + first·δ₁ + last·δ₂`, nor exists unless `clip` is met, or else costs a
/// full circle more.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub low: f64,
    pub first: f64,
    pub last: f64,
    pub clip: Clip,
    /// What a full circle costs.
    pub circle: f64,
}

/// What must hold for a turn not to have passed through zero:
/// `room + first·δ₁ + last·δ₂ ≥ 0`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clip {
    pub room: f64,
    pub first: f64,
    pub last: f64,
}

/// Holds everywhere.
pub(super) const FREE: Clip = Clip {
    room: f64::INFINITY,
    first: 0.0,
    last: 0.0,
};

pub(super) const NOWHERE: Plane = flat(f64::INFINITY);

/// A bound that no heading changes.
pub(super) const fn flat(low: f64) -> Plane {
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
    pub fn depth(&self, r: &Reach) -> f64 {
        self.first.abs() * r.first + self.last.abs() * r.last - self.room
    }

    /// Whether it holds nowhere in the box.
    pub fn never(&self, r: &Reach) -> bool {
        self.room + self.first.abs() * r.first + self.last.abs() * r.last < 0.0
    }

    /// The one of two that cuts away more of the box, if any cuts it.
    pub fn tighter(self, other: Self, r: &Reach) -> Self {
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
    pub fn in_time(self, along: f64, r: &Reach) -> Self {
        let pace = 1.0 / (1.0 + along);
        Self {
            low: r.moment + (self.low - r.moment) * pace,
            first: self.first * pace,
            last: self.last * pace,
            circle: self.circle * pace,
            ..self
        }
    }

    pub fn mirrored(self) -> Self {
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
    pub fn least(&self, h: (f64, f64), paid: (f64, f64)) -> (f64, f64) {
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
