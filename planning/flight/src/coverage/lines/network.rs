//! What line coverage is asked: lines, a team, and the answer's shape (D2.7 §3.5).

use crate::coverage::metric::Metric;
use thiserror::Error;

/// A line (road, dike, lane of a strip) that must be flown along once, either way.
///
/// Its two ends are numbered places; what it looks like in between does not matter here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// One end.
    pub a: usize,
    /// The other end; may be the same place.
    pub b: usize,
    /// The cost of flying along it from `a` to `b`, and from `b` to `a`, in the unit of
    /// the metric.
    pub cost: [f64; 2],
}

impl Line {
    /// A line that costs the same both ways.
    #[must_use]
    pub fn new(a: usize, b: usize, cost: f64) -> Self {
        Self {
            a,
            b,
            cost: [cost, cost],
        }
    }
}

/// One line flown along, as a step of a tour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Traversal {
    /// Index of the line.
    pub line: usize,
    /// Whether it is flown from its end `b` to its end `a`.
    pub backward: bool,
}

impl Traversal {
    /// Where the pass begins.
    #[must_use]
    pub fn start(self, lines: &[Line]) -> usize {
        let line = lines[self.line];
        if self.backward { line.b } else { line.a }
    }

    /// Where the pass ends.
    #[must_use]
    pub fn end(self, lines: &[Line]) -> usize {
        let line = lines[self.line];
        if self.backward { line.a } else { line.b }
    }

    /// What the pass costs.
    #[must_use]
    pub fn cost(self, lines: &[Line]) -> f64 {
        lines[self.line].cost[usize::from(self.backward)]
    }
}

/// Passes flown the other way round.
pub(super) fn reversed(passes: &[Traversal]) -> Vec<Traversal> {
    let turned = passes.iter().rev().map(|p| Traversal {
        backward: !p.backward,
        ..*p
    });
    turned.collect()
}

/// One UAV of the team.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uav {
    /// The place where it starts and ends.
    pub depot: usize,
    /// Units of cost per unit of time, above zero: m/s for a metric of metres, 1 for a
    /// metric of seconds.
    pub speed: f64,
    /// The longest time it can fly; infinite if it does not matter.
    pub endurance: f64,
}

impl Uav {
    /// A UAV for which time and cost are the same and endurance does not matter.
    #[must_use]
    pub fn at(depot: usize) -> Self {
        Self {
            depot,
            speed: 1.0,
            endurance: f64::INFINITY,
        }
    }
}

/// A closed tour of one UAV: from its depot through its passes and back.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineTour {
    /// The lines in order of flight.
    pub passes: Vec<Traversal>,
    /// Cost of the passes and of the deadheads between them and the depot.
    pub cost: f64,
}

impl LineTour {
    /// The places in order of flight, from the depot back to the depot, none twice in a row.
    #[must_use]
    pub fn places(&self, lines: &[Line], depot: usize) -> Vec<usize> {
        let mut places = vec![depot];
        for pass in &self.passes {
            places.push(pass.start(lines));
            places.push(pass.end(lines));
        }
        places.push(depot);
        // A line from a place to itself stays visible as two equal places.
        let mut kept: Vec<usize> = Vec::with_capacity(places.len());
        for (i, &p) in places.iter().enumerate() {
            let loop_end = i > 0 && i % 2 == 0 && i + 1 < places.len() && places[i - 1] == p;
            if kept.last() != Some(&p) || loop_end {
                kept.push(p);
            }
        }
        kept
    }
}

/// The cost of a tour from `depot` along `passes` and back.
#[must_use]
pub fn tour_cost(passes: &[Traversal], lines: &[Line], depot: usize, metric: &impl Metric) -> f64 {
    let (mut at, mut cost) = (depot, 0.0);
    for pass in passes {
        cost += metric.cost(at, pass.start(lines)) + pass.cost(lines);
        at = pass.end(lines);
    }
    cost + metric.cost(at, depot)
}

/// A plan for the whole team.
#[derive(Clone, Debug, PartialEq)]
pub struct LinePlan {
    /// One tour a UAV, in the order of the team; without passes for one that stays.
    pub tours: Vec<LineTour>,
    /// Time of the longest tour.
    pub makespan: f64,
    /// No plan that flies along every line is faster than this.
    pub lower_bound: f64,
    /// Lines that nobody has the endurance for, ascending.
    pub unserved: Vec<usize>,
}

/// Why lines could not be planned. Nothing was planned.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum LineError {
    /// Nobody flies.
    #[error("no UAV to fly the lines")]
    NoTeam,
    /// A UAV's figures make no sense.
    #[error(
        "UAV {index}: speed must be above 0 and endurance a number, found {speed} and {endurance}"
    )]
    Uav {
        /// Its index in the team.
        index: usize,
        /// Its speed.
        speed: f64,
        /// Its endurance.
        endurance: f64,
    },
    /// A line's cost makes no sense.
    #[error("line {index} costs {cost}: a cost is a finite number from 0")]
    Cost {
        /// Its index.
        index: usize,
        /// The cost.
        cost: f64,
    },
}

/// Whether the figures of a problem make sense.
pub(super) fn check(lines: &[Line], team: &[Uav]) -> Result<(), LineError> {
    if team.is_empty() {
        return Err(LineError::NoTeam);
    }
    for (index, uav) in team.iter().enumerate() {
        let (speed, endurance) = (uav.speed, uav.endurance);
        // Written so that a value that is no number fails too.
        if !(speed > 0.0 && speed.is_finite() && endurance >= 0.0) {
            return Err(LineError::Uav {
                index,
                speed,
                endurance,
            });
        }
    }
    for (index, line) in lines.iter().enumerate() {
        for cost in line.cost {
            if !(cost >= 0.0 && cost.is_finite()) {
                return Err(LineError::Cost { index, cost });
            }
        }
    }
    Ok(())
}
