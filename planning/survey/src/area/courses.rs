//! The course of straight passes, searched by what they take when they are flown.
//!
//! Lengths of passes and a guess for each turn say little of a plan where turns are wide,
//! zones stand close or several UAVs share the work. So every course is flown quickly, those
//! that promise most with more steps and with their lanes moved aside, and the best of these
//! as thoroughly as any plan. Where that is not too much work, all of them are planned as
//! thoroughly at once. Leaves to [`super::planners`] the flights on a course.

use super::planners::Part;
use super::{DEFAULT_STEPS, PlannerError};
use crate::objective::{Objective, SAME_SHARE, Worth};
use skein_flight::coverage::passes::{Directions, SHIFTS};
use skein_geometry::Polygon;
use skein_geometry::math::{PI, atan2};
use std::panic::resume_unwind;
use std::thread;

/// Courses over half a turn: every 5°.
const COURSES: u32 = 36;

/// Courses are tried in steps of so many, which meet them all: the first ones lie far apart.
const STRIDE: u32 = 11;

/// Courses nearer to each other than this are one, radians.
const SAME_RAD: f64 = 1e-3;

/// Courses along edges of the area at most, the longest edges first.
const MOST_EDGES: usize = 8;

/// Courses that are flown with more steps, as long as there is work left.
const LONGER: usize = 16;

/// Courses of these whose lanes are moved aside.
const ASIDE: usize = 2;

/// The same where every course is planned in full.
const ASIDE_IN_FULL: usize = 3;

/// Plans that are made in full beside the guessed one, as long as there is work left.
const IN_FULL: usize = 8;

/// What a search may take, in the unit of [`Part::work`]: as much as so many plans, but at
/// least and at most this, which is 2 to 9 seconds of two processors; in proportion to the steps
/// of improvement.
const WORK_PLANS: u64 = 24;
const WORK: (u64, u64) = (150_000_000, 600_000_000);

/// What planning every course in full may take unless it is asked for, in the same unit and
/// proportion: some 40 seconds of two processors, which few areas need.
const EVERY_WORK: u64 = 2_400_000_000;

/// Plans that are made at once.
const BATCH: usize = 4;

/// While plans are only compared: what sees a percent of the area less counts as if it took so
/// many percent longer.
const SHARE_WORTH: f64 = 8.0;

/// How thoroughly a course is flown.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// The steps of improvement are divided by this.
    pub steps_part: usize,
    /// Times that passes are ordered.
    pub rounds: usize,
}

impl Effort {
    /// A plan to be flown.
    pub(super) const FULL: Self = Self {
        steps_part: 1,
        rounds: 3,
    };
    const QUICK: Self = Self {
        steps_part: 20,
        rounds: 1,
    };
    const LONGER: Self = Self {
        steps_part: 5,
        rounds: 2,
    };

    /// Whether this is a plan to be flown.
    pub(super) fn is_full(self) -> bool {
        self.steps_part == 1
    }
}

/// A course and what came of it.
struct Tried {
    directions: Directions,
    part: Part,
    worth: Worth,
}

/// What plans on courses are made by.
struct Search<F, W> {
    objective: Objective,
    fly: F,
    worth: W,
    /// What may still be done.
    left: u64,
    /// Courses that were planned in full.
    in_full: Vec<Directions>,
}

impl<F, W> Search<F, W>
where
    F: Fn(Directions, Effort) -> Result<Part, PlannerError> + Sync,
    W: Fn(&Part, Effort) -> Worth + Sync,
{
    /// Plans on courses, as many at once as a batch has, while more than `reserve` is left to
    /// do; how many processors there are changes nothing.
    fn tried(&mut self, courses: &[Directions], effort: Effort, reserve: u64) -> Vec<Tried> {
        let mut all = Vec::new();
        for batch in courses.chunks(BATCH) {
            if self.left <= reserve {
                break;
            }
            let flown = thread::scope(|scope| {
                let plan = |d: &Directions| {
                    let directions = *d;
                    let (fly, worth) = (&self.fly, &self.worth);
                    scope.spawn(move || {
                        let part = fly(directions, effort).ok()?;
                        let worth = worth(&part, effort);
                        Some(Tried {
                            directions,
                            part,
                            worth,
                        })
                    })
                };
                let begun: Vec<_> = batch.iter().map(plan).collect();
                let done = begun
                    .into_iter()
                    .map(|t| t.join().unwrap_or_else(|p| resume_unwind(p)));
                done.flatten().collect::<Vec<Tried>>()
            });
            let work: u64 = flown.iter().map(|t| t.part.work).sum();
            self.left = self.left.saturating_sub(work);
            if effort.is_full() {
                self.in_full.extend_from_slice(batch);
            }
            all.extend(flown);
        }
        all
    }

    /// Plans in full on every course, and on the best of them with lanes moved aside.
    fn all_in_full(&mut self, courses: &[Directions]) -> Vec<Tried> {
        let found = self.tried(courses, Effort::FULL, 0);
        let mut found = self.best_first(found);
        let best = found.iter().take(ASIDE_IN_FULL);
        let moved: Vec<Directions> = best.flat_map(|t| aside(t.directions)).collect();
        found.extend(self.tried(&moved, Effort::FULL, 0));
        found
    }

    /// Plans in full on the courses that promise most.
    fn best_in_full(&mut self, courses: &[Directions]) -> Vec<Tried> {
        // What is left for the better ones, and of that for full plans.
        let (longer_left, full_left) = (self.left / 2, self.left / 3);
        let quick = self.tried(courses, Effort::QUICK, longer_left);
        let quick = self.promising_first(quick);
        let longer = self.tried(&promising(&quick), Effort::LONGER, full_left);
        let promising = match self.promising_first(longer) {
            none if none.is_empty() => quick,
            longer => longer,
        };
        let in_full: Vec<Directions> = promising.iter().map(|t| t.directions).collect();
        self.tried(&in_full[..in_full.len().min(IN_FULL)], Effort::FULL, 0)
    }

    /// Those that see as much as any first, the best of them before others; then those that
    /// see less. What is known already is left out.
    fn best_first(&self, all: Vec<Tried>) -> Vec<Tried> {
        self.sorted(
            all,
            |lacks| if lacks > SAME_SHARE { lacks } else { 0.0 },
            |_| 1.0,
        )
    }

    /// Those that promise most first: what a quick plan sees is told by few samples, and a
    /// thorough one sees more.
    fn promising_first(&self, all: Vec<Tried>) -> Vec<Tried> {
        self.sorted(all, |_| 0.0, |lacks| 1.0 + SHARE_WORTH * lacks)
    }

    fn sorted(
        &self,
        mut all: Vec<Tried>,
        rank: impl Fn(f64) -> f64,
        dearer: impl Fn(f64) -> f64,
    ) -> Vec<Tried> {
        let most = all.iter().map(|t| t.worth.share).fold(0.0, f64::max);
        let figure = |t: &Tried| {
            let lacks = (most - t.worth.share).max(0.0);
            let own = t.worth.figure(self.objective) * dearer(lacks);
            (rank(lacks), own, t.worth.makespan_s)
        };
        all.sort_by(|a, b| {
            let (a, b) = (figure(a), figure(b));
            let by_share = a.0.total_cmp(&b.0);
            by_share.then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2))
        });
        all.dedup_by(|a, b| a.worth == b.worth);
        all
    }
}

/// What is asked of the search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    /// What is to be least.
    pub objective: Objective,
    /// Steps of improvement.
    pub steps: usize,
    /// Whether every course is planned in full, whatever it takes.
    pub every: bool,
}

/// The best plan that was found on any course, with so many steps of improvement; `fly` plans
/// on one.
///
/// # Guarantees
/// Where no courses are left in the plan, none sees more, or as much for less.
///
/// # Errors
/// When there is no plan on the course that is guessed to be the shortest.
pub(super) fn best(
    area: &Polygon,
    asked: Asked,
    fly: impl Fn(Directions, Effort) -> Result<Part, PlannerError> + Sync,
    worth: impl Fn(&Part, Effort) -> Worth + Sync,
) -> Result<Part, PlannerError> {
    let guessed = fly(Directions::Best, Effort::FULL)?;
    if guessed.work == 0 {
        return Ok(guessed);
    }
    let all = courses(area);
    let by_steps = |work: u64| work.saturating_mul(asked.steps as u64) / DEFAULT_STEPS as u64;
    let every_work = if asked.every {
        u64::MAX
    } else {
        by_steps(EVERY_WORK)
    };
    let all_fit = guessed.work.saturating_mul(all.len() as u64) <= every_work;
    let left = if all_fit {
        every_work
    } else {
        let most = guessed.work.saturating_mul(WORK_PLANS);
        by_steps(most.clamp(WORK.0, WORK.1)).saturating_sub(guessed.work)
    };
    let first = Tried {
        directions: Directions::Best,
        worth: worth(&guessed, Effort::FULL),
        part: guessed,
    };
    let mut search = Search {
        objective: asked.objective,
        fly,
        worth,
        left,
        in_full: Vec::new(),
    };
    let mut found = if all_fit {
        search.all_in_full(&all)
    } else {
        search.best_in_full(&all)
    };
    found.push(first);
    let left = all.iter().filter(|d| !search.in_full.contains(d));
    let courses_left = left.count();
    let best = search.best_first(found).into_iter().next();
    let mut part = best.map(|t| t.part).unwrap_or_default();
    part.courses_left = courses_left;
    Ok(part)
}

/// The courses that are flown with more steps, and those of them with lanes moved aside.
fn promising(quick: &[Tried]) -> Vec<Directions> {
    let mut all = Vec::new();
    for (i, t) in quick.iter().take(LONGER).enumerate() {
        all.push(t.directions);
        if i < ASIDE {
            all.extend(aside(t.directions));
        }
    }
    all
}

/// A course with its lanes moved aside; nothing where every cell has its own.
fn aside(directions: Directions) -> Vec<Directions> {
    let Directions::Fixed(heading_rad) = directions else {
        return Vec::new();
    };
    let shifted = |shift| Directions::Shifted { heading_rad, shift };
    SHIFTS.into_iter().map(shifted).collect()
}

/// The angle between two courses that may be flown either way, radians.
pub(super) fn apart_rad(a_rad: f64, b_rad: f64) -> f64 {
    let apart = (a_rad - b_rad).rem_euclid(PI);
    apart.min(PI - apart)
}

/// What is tried: lanes cell by cell, courses along edges of the area, and courses all round.
fn courses(area: &Polygon) -> Vec<Directions> {
    let mut edges: Vec<_> = area.edges().map(|(a, b)| b - a).collect();
    edges.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    let along = edges.iter().map(|d| atan2(d.y, d.x).rem_euclid(PI));
    let mut headings: Vec<f64> = Vec::new();
    let is_new = |headings: &[f64], course_rad: f64| {
        let same = |h: &f64| apart_rad(course_rad, *h) < SAME_RAD;
        !headings.iter().any(same)
    };
    for course_rad in along {
        if headings.len() < MOST_EDGES && is_new(&headings, course_rad) {
            headings.push(course_rad);
        }
    }
    for i in 0..COURSES {
        let course_rad = PI * f64::from(i * STRIDE % COURSES) / f64::from(COURSES);
        if is_new(&headings, course_rad) {
            headings.push(course_rad);
        }
    }
    let fixed = headings.into_iter().map(Directions::Fixed);
    [Directions::PerCell].into_iter().chain(fixed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::frame::Point;

    #[test]
    fn courses_lie_along_edges_and_all_round() {
        let corners = [(0.0, 0.0), (400.0, 30.0), (380.0, 200.0), (0.0, 200.0)];
        let corners = corners.map(|(x, y)| Point::new(x, y)).to_vec();
        let all = courses(&Polygon::new(corners).unwrap());
        let has = |course_rad: f64| {
            let is = |d: &Directions| matches!(d, Directions::Fixed(h) if (h - course_rad).abs() < SAME_RAD);
            all.iter().any(is)
        };
        assert!(has(atan2(30.0, 400.0)) && all.contains(&Directions::PerCell));
        for i in 0..COURSES {
            assert!(has(PI * f64::from(i) / f64::from(COURSES)), "{i}");
        }
    }
}
