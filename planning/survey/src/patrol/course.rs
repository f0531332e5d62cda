//! Where a UAV of a patrol is, and when it sees a place.

/// The motion of one UAV: periodic from some moment on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// It has no part in the patrol.
    Rest,
    /// Round and round, forward.
    Round {
        /// Where it is at the moment.
        from: f64,
        /// The moment, seconds.
        since_s: f64,
        /// Units a second.
        speed: f64,
    },
    /// To and fro on an arc.
    ToAndFro {
        /// Where the arc begins.
        from: f64,
        /// The arc's length.
        len: f64,
        /// What turning round at an end takes, units.
        turn: f64,
        /// How far it has flown at the moment: on the way forth below `len`, then a turn,
        /// the way back, and a turn.
        at: f64,
        /// The moment, seconds.
        since_s: f64,
        /// Units a second.
        speed: f64,
    },
}

/// `x` modulo `n`, not below zero.
fn wrap(x: f64, n: f64) -> f64 {
    let y = x - (x / n).floor() * n;
    // Rounding may leave the whole.
    if y >= n { 0.0 } else { y }
}

impl Course {
    /// The moment from which it flies so, seconds.
    #[must_use]
    pub fn since_s(&self) -> Option<f64> {
        match *self {
            Self::Rest => None,
            Self::Round { since_s, .. } | Self::ToAndFro { since_s, .. } => Some(since_s),
        }
    }

    /// Where on a tour of length `n` it is, and whether it flies forward, `t_s` seconds;
    /// as if it had always flown so. `None` for one that rests.
    #[must_use]
    pub fn place(&self, n: f64, t_s: f64) -> Option<(f64, bool)> {
        match *self {
            Self::Rest => None,
            Self::Round {
                from,
                since_s,
                speed,
            } => Some((wrap(from + (t_s - since_s) * speed, n), true)),
            Self::ToAndFro {
                from,
                len,
                turn,
                at,
                since_s,
                speed,
            } => {
                let flown = wrap(at + (t_s - since_s) * speed, 2.0 * (len + turn));
                let back = 2.0 * len + turn - flown;
                let forth = flown < len || back < 0.0;
                let offset = if flown < len { flown } else { back };
                Some((wrap(from + offset.clamp(0.0, len), n), forth))
            }
        }
    }

    /// The time since it last saw place `x`, at `t_s`, as if it had always flown so.
    pub(super) fn age_s(&self, n: f64, x: f64, t_s: f64) -> Option<f64> {
        match *self {
            Self::Rest => None,
            Self::Round { speed, .. } => {
                let (at, _) = self.place(n, t_s)?;
                Some(wrap(at - x, n) / speed)
            }
            Self::ToAndFro {
                from,
                len,
                turn,
                at,
                since_s,
                speed,
            } => {
                let y = wrap(x - from, n);
                if y > len {
                    return None;
                }
                let flown = at + (t_s - since_s) * speed;
                let both = 2.0 * (len + turn);
                let forth = wrap(flown - y, both);
                let back = wrap(flown - (2.0 * len + turn - y), both);
                Some(forth.min(back) / speed)
            }
        }
    }

    /// When it first sees place `x`, and how often after that at the latest, seconds.
    pub(super) fn first_s(&self, n: f64, x: f64) -> Option<(f64, f64)> {
        match *self {
            Self::Rest => None,
            Self::Round {
                from,
                since_s,
                speed,
            } => Some((since_s + wrap(x - from, n) / speed, n / speed)),
            Self::ToAndFro {
                from,
                len,
                turn,
                at,
                since_s,
                speed,
            } => {
                let y = wrap(x - from, n);
                if y > len {
                    return None;
                }
                let both = 2.0 * (len + turn);
                let forth = wrap(y - at, both);
                let back = wrap(2.0 * len + turn - y - at, both);
                let period_s = both / speed;
                Some((since_s + forth.min(back) / speed, period_s))
            }
        }
    }

    /// Places where what this motion promises bends, at `t_s`.
    pub(super) fn bends(&self, n: f64, t_s: f64) -> Vec<f64> {
        let mut bends: Vec<f64> = self.place(n, t_s).map(|p| p.0).into_iter().collect();
        if let Self::ToAndFro { from, len, .. } = *self {
            bends.extend([wrap(from, n), wrap(from + len, n)]);
        }
        bends
    }
}
