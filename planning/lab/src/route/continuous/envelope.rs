//! Two waves on one side of a cell: which of them is first, and where.

/// The distance from a root to the points of a line, over the root's own length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wave {
    /// Length from the source to the root, metres.
    pub root_m: f64,
    /// The root's place along the line, metres from the line's first end.
    pub along_m: f64,
    /// The root's distance from the line, metres.
    pub height_m: f64,
}

impl Wave {
    /// Length from the source to the point at `t`, metres.
    #[inline]
    pub fn at_m(&self, t: f64) -> f64 {
        let d = t - self.along_m;
        self.root_m + (d * d + self.height_m * self.height_m).sqrt()
    }

    /// The least length to a point of a run, metres.
    pub fn least_m(&self, run: Run) -> f64 {
        self.at_m(self.along_m.clamp(run.from, run.to))
    }
}

/// A stretch of a side, metres from the side's first end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub from: f64,
    pub to: f64,
}

impl Run {
    pub fn new(from: f64, to: f64) -> Self {
        Self { from, to }
    }

    /// What two runs share.
    pub fn with(self, other: Self) -> Self {
        Self::new(self.from.max(other.from), self.to.min(other.to))
    }

    /// Whether nothing, or only a point, is left.
    pub fn is_empty(self) -> bool {
        self.from >= self.to
    }
}

/// What a new and an old window keep of a side; memory that is used again.
#[derive(Debug, Default)]
pub(super) struct Runs {
    /// The parts that the new window keeps.
    pub new: Vec<Run>,
    /// The parts that the old window keeps.
    pub old: Vec<Run>,
}

impl Runs {
    /// Adds a run, joined to the last one if it begins where that ends.
    pub fn add(runs: &mut Vec<Run>, from: f64, to: f64) {
        match runs.last_mut() {
            Some(last) if last.to >= from => last.to = to,
            _ => runs.push(Run::new(from, to)),
        }
    }

    /// Divides what two windows share; the parts of the new one are added to
    /// those it has. Tells whether the old one lost anything.
    pub fn divide(&mut self, new: &Wave, old: &Wave, old_run: Run, shared: Run) -> bool {
        let first = first_between(new, old, shared);
        if first.iter().all(|part| !part.new_is_first) {
            return false;
        }
        self.old.clear();
        if old_run.from < shared.from {
            Self::add(&mut self.old, old_run.from, shared.from);
        }
        let mut at = shared.from;
        for part in first {
            if part.to > at {
                let runs = if part.new_is_first {
                    &mut self.new
                } else {
                    &mut self.old
                };
                Self::add(runs, at, part.to);
                at = part.to;
            }
        }
        if shared.to < old_run.to {
            Self::add(&mut self.old, shared.to, old_run.to);
        }
        true
    }
}

/// Who is first up to a point.
#[derive(Clone, Copy, Debug)]
struct Part {
    to: f64,
    new_is_first: bool,
}

/// Two branches of hyperbolas meet in at most two points: at most three parts.
fn first_between(new: &Wave, old: &Wave, shared: Run) -> [Part; 3] {
    let lead_m = |t: f64| old.at_m(t) - new.at_m(t);
    let (from, to) = (lead_m(shared.from), lead_m(shared.to));
    let part = |to: f64, new_is_first: bool| Part { to, new_is_first };
    // Rounding of the lengths; a lead below it is none.
    let noise_m = 4.0 * f64::EPSILON * old.at_m(shared.to);
    let sign = |lead: f64| {
        if lead > noise_m {
            1
        } else if lead < -noise_m {
            -1
        } else {
            0
        }
    };
    let (s, e) = (sign(from), sign(to));
    if s * e < 0 {
        let cut = root_of(&lead_m, shared.from, shared.to, from);
        return [
            part(cut, s > 0),
            part(shared.to, e > 0),
            part(shared.to, false),
        ];
    }
    let outer = s > 0 || e > 0;
    if let Some(turn) = turning_point(new, old, shared) {
        let inner = sign(lead_m(turn));
        if inner > 0 && !outer || inner < 0 && outer {
            let first = root_of(&lead_m, shared.from, turn, from);
            let second = root_of(&lead_m, turn, shared.to, lead_m(turn));
            return [
                part(first, outer),
                part(second, inner > 0),
                part(shared.to, outer),
            ];
        }
    }
    [part(shared.to, outer); 3]
}

/// Where the lead of one wave over the other stops growing, if inside.
fn turning_point(a: &Wave, b: &Wave, shared: Run) -> Option<f64> {
    let t = (a.along_m * b.height_m - b.along_m * a.height_m) / (b.height_m - a.height_m);
    (t > shared.from && t < shared.to).then_some(t)
}

/// A zero between two ends of unlike sign, by regula falsi (Illinois) with halving.
fn root_of(f: &impl Fn(f64) -> f64, mut a: f64, mut b: f64, mut f_a: f64) -> f64 {
    /// Halving alone reaches the last bit in this many steps.
    const STEPS: usize = 60;
    let mut f_b = f(b);
    let (from, to) = (a, b);
    for step in 0..STEPS {
        let falsi = b - f_b * (b - a) / (f_b - f_a);
        let middle = 0.5 * (a + b);
        let t = if step % 4 < 3 && falsi > a.min(b) && falsi < a.max(b) {
            falsi
        } else {
            middle
        };
        let f_t = f(t);
        if f_t.abs() <= 0.0 {
            return t;
        }
        if (f_t > 0.0) == (f_b > 0.0) {
            f_a *= 0.5;
        } else {
            (a, f_a) = (b, f_b);
        }
        (b, f_b) = (t, f_t);
        if (b - a).abs() <= 1e-14 * (to - from) {
            break;
        }
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn wave() -> impl Strategy<Value = Wave> {
        (0.0f64..10.0, -20.0f64..30.0, 0.0f64..20.0).prop_map(|(root_m, along_m, height_m)| Wave {
            root_m,
            along_m,
            height_m,
        })
    }

    proptest! {
        #[test]
        fn each_part_goes_to_the_wave_that_is_first(new in wave(), old in wave()) {
            let mut runs = Runs::default();
            let shared = Run::new(0.0, 10.0);
            let lost = runs.divide(&new, &old, Run::new(-1.0, 11.0), shared);
            for i in 1..1000 {
                let t = f64::from(i) / 100.0;
                let lead_m = old.at_m(t) - new.at_m(t);
                let in_new = runs.new.iter().any(|r| r.from <= t && t <= r.to);
                let in_old = !lost || runs.old.iter().any(|r| r.from <= t && t <= r.to);
                prop_assert!(in_new || in_old);
                prop_assert!(lead_m <= 1e-9 || in_new, "{lead_m} at {t}");
                prop_assert!(lead_m >= -1e-9 || in_old, "{lead_m} at {t}");
            }
        }
    }
}
