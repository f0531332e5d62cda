//! The course of straight passes, searched by what they take when they are flown.
//!
//! Lengths of passes and a guess for each turn say little of a plan where turns are wide,
//! zones stand close or several UAVs share the work. So passes are laid on every course and
//! flown, those that promise most first; a course is left out only where it is proved that no
//! flights over its passes are better than a plan that was found. Where a quick answer is
//! asked for, courses are flown with few steps and the best of these in full. Leaves to
//! [`super::planners`] the flights on a course, and to [`super::promise`] the proofs.

use super::at_once::{BATCH, at_once};
use super::planners::Part;
use super::promise::Promise;
use super::{DEFAULT_STEPS, PlannerError, Progress};
use crate::objective::{Objective, Worth, lacks};
use skein_flight::coverage::passes::{Directions, SHIFTS};
use skein_geometry::Polygon;
use skein_geometry::math::{PI, atan2};

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

/// The same where all courses are planned in full.
const ASIDE_IN_FULL: usize = 3;

/// Plans that are made in full beside the guessed one, as long as there is work left.
const IN_FULL: usize = 8;

/// What a search may take, in the unit of [`Part::work`]: as much as so many plans, but at
/// least and at most this, which is 2 to 9 seconds of two processors; in proportion to the steps
/// of improvement.
const WORK_PLANS: u64 = 24;
const WORK: (u64, u64) = (150_000_000, 600_000_000);

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

/// What is planned on courses.
pub(super) trait Courses: Sync {
    /// Passes on a course.
    type Laid: Send;

    /// Lays passes on a course.
    ///
    /// # Errors
    /// When there are none.
    fn laid(&self, directions: Directions, effort: Effort) -> Result<Self::Laid, PlannerError>;

    /// What flights over passes come to at best.
    fn promise(&self, laid: &Self::Laid) -> Promise;

    /// Flies them.
    ///
    /// # Errors
    /// When there are no flights.
    fn flown(&self, laid: Self::Laid, effort: Effort) -> Result<Part, PlannerError>;

    /// What a plan is worth.
    fn worth(&self, part: &Part, effort: Effort) -> Worth;
}

/// A course and what came of it.
struct Tried {
    directions: Directions,
    part: Part,
    worth: Worth,
}

/// Passes on a course that are not flown yet.
struct Waiting<L> {
    directions: Directions,
    laid: L,
    promise: Promise,
}

/// A search for the best course.
struct Search<'a, C> {
    asked: Asked<'a>,
    courses: &'a C,
    /// What may still be done by a quick search.
    left: u64,
    /// The first reason for which there is no plan on a course.
    refused: Option<PlannerError>,
    /// Courses that a quick search has planned in full.
    in_full: Vec<Directions>,
    /// What all courses promise that were looked at in full.
    promises: Vec<Promise>,
}

impl<C: Courses> Search<'_, C> {
    /// The best plan on any of these courses, and on the best of them with lanes moved aside:
    /// all are planned in full that are not proved to be no better.
    fn all_in_full(&mut self, all: &[Directions]) -> Vec<Tried> {
        let mut found = Vec::new();
        self.fly_all(all, &mut found);
        found = self.best_first(found);
        let best = found.iter().take(ASIDE_IN_FULL);
        let moved: Vec<Directions> = best.flat_map(|t| aside(t.directions)).collect();
        self.fly_all(&moved, &mut found);
        found
    }

    /// Lays passes on all of these courses and flies those that may be better than what was
    /// found, the most promising ones first.
    fn fly_all(&mut self, all: &[Directions], found: &mut Vec<Tried>) {
        let mut waiting: Vec<Waiting<C::Laid>> = Vec::new();
        for batch in all.chunks(BATCH) {
            let courses = self.courses;
            let laid = at_once(batch.to_vec(), |directions| {
                let laid = courses.laid(directions, Effort::FULL)?;
                let promise = courses.promise(&laid);
                Ok(Waiting {
                    directions,
                    laid,
                    promise,
                })
            });
            for laid in laid {
                match laid {
                    Ok(laid) => {
                        self.promises.push(laid.promise.clone());
                        waiting.push(laid);
                    }
                    Err(error) => self.refused = self.refused.take().or(Some(error)),
                }
            }
        }
        self.promising_last(&mut waiting);
        let of = waiting.len();
        while !waiting.is_empty() {
            (self.asked.tell)(Progress {
                courses_done: of - waiting.len(),
                courses: of,
            });
            let mut batch = Vec::new();
            while batch.len() < BATCH
                && let Some(next) = waiting.pop()
            {
                if self.may_win(&next.promise, found) {
                    batch.push(next);
                }
            }
            let courses = self.courses;
            let flown = at_once(batch, |next| {
                let part = courses.flown(next.laid, Effort::FULL)?;
                let worth = courses.worth(&part, Effort::FULL);
                Ok(Tried {
                    directions: next.directions,
                    part,
                    worth,
                })
            });
            for flown in flown {
                match flown {
                    Ok(flown) => found.push(flown),
                    Err(error) => self.refused = self.refused.take().or(Some(error)),
                }
            }
        }
    }

    /// Whether flights over passes may be better than all that was found, and than what is to
    /// be better.
    fn may_win(&self, promise: &Promise, found: &[Tried]) -> bool {
        let known = found.iter().map(|t| &t.worth);
        let mut known = known.chain(&self.asked.better_than);
        known.all(|worth| promise.may_be_better(worth, self.asked.objective))
    }

    /// Sorts so that those are last that may see most, and of those the ones that may take
    /// least.
    fn promising_last(&self, waiting: &mut [Waiting<C::Laid>]) {
        let objective = self.asked.objective;
        let key = |w: &Waiting<C::Laid>| (lacks(w.promise.share()), w.promise.figure(objective));
        waiting.sort_by(|a, b| {
            let (a, b) = (key(a), key(b));
            b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
        });
    }

    /// Plans on courses, as many at once as a batch has, while more than `reserve` is left to
    /// do; how many processors there are changes nothing.
    fn tried(&mut self, all: &[Directions], effort: Effort, reserve: u64) -> Vec<Tried> {
        let mut found = Vec::new();
        for batch in all.chunks(BATCH) {
            if self.left <= reserve {
                break;
            }
            let courses = self.courses;
            let flown = at_once(batch.to_vec(), |directions| {
                let laid = courses.laid(directions, effort).ok()?;
                let part = courses.flown(laid, effort).ok()?;
                let worth = courses.worth(&part, effort);
                Some(Tried {
                    directions,
                    part,
                    worth,
                })
            });
            let flown: Vec<Tried> = flown.into_iter().flatten().collect();
            let work: u64 = flown.iter().map(|t| t.part.work).sum();
            self.left = self.left.saturating_sub(work);
            if effort.is_full() {
                self.in_full.extend_from_slice(batch);
            }
            found.extend(flown);
        }
        found
    }

    /// Plans in full on the courses that promise most when they are flown quickly.
    fn best_in_full(&mut self, all: &[Directions]) -> Vec<Tried> {
        // What is left for the better ones, and of that for full plans.
        let (longer_left, full_left) = (self.left / 2, self.left / 3);
        let quick = self.tried(all, Effort::QUICK, longer_left);
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
        self.sorted(all, |share, _| (lacks(share), 1.0))
    }

    /// Those that promise most first: what a quick plan sees is told by few samples, and a
    /// thorough one sees more.
    fn promising_first(&self, all: Vec<Tried>) -> Vec<Tried> {
        self.sorted(all, |share, most| {
            let lacks = (most - share).max(0.0);
            (0, 1.0 + SHARE_WORTH * lacks)
        })
    }

    /// Sorted by a rank, and by what they take times how much dearer that counts.
    fn sorted(&self, mut all: Vec<Tried>, rank: impl Fn(f64, f64) -> (u32, f64)) -> Vec<Tried> {
        let most = all.iter().map(|t| t.worth.share).fold(0.0, f64::max);
        let key = |t: &Tried| {
            let (rank, dearer) = rank(t.worth.share, most);
            let own = t.worth.figure(self.asked.objective) * dearer;
            (rank, own, t.worth.makespan_s)
        };
        all.sort_by(|a, b| {
            let (a, b) = (key(a), key(b));
            let by_rank = a.0.cmp(&b.0);
            by_rank.then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2))
        });
        all.dedup_by(|a, b| a.worth == b.worth);
        all
    }
}

/// What is asked of the search.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    /// What is to be least.
    pub objective: Objective,
    /// Steps of improvement.
    pub steps: usize,
    /// Whether only those courses are planned in full that promise most when they are
    /// planned quickly.
    pub quick: bool,
    /// Plans are wanted only that may be better than this.
    pub better_than: Option<Worth>,
    /// Told how far the search is.
    pub tell: &'a (dyn Fn(Progress) + Sync),
}

/// The best plan that was found on any course; none where no plan can be better than what is
/// to be beaten.
///
/// # Guarantees
/// Unless a quick search is asked for, no plan in full on one of the courses sees more, or as
/// much for less.
///
/// # Errors
/// When there is no plan on any course.
pub(super) fn best(
    area: &Polygon,
    asked: Asked<'_>,
    courses: &impl Courses,
) -> Result<Option<Part>, PlannerError> {
    let all = all_round(area);
    let mut search = Search {
        asked,
        courses,
        left: 0,
        refused: None,
        in_full: Vec::new(),
        promises: Vec::new(),
    };
    let found = if asked.quick {
        search.quickly(&all)?
    } else {
        let guessed = [Directions::Best].into_iter().chain(all.iter().copied());
        let all: Vec<Directions> = guessed.collect();
        search.all_in_full(&all)
    };
    let left = all.iter().filter(|d| !search.in_full.contains(d));
    let courses_left = if asked.quick { left.count() } else { 0 };
    let best = search.best_first(found).into_iter().next();
    let promises = search.promises;
    match (best, search.refused) {
        (Some(best), _) => {
            let mut part = best.part;
            (part.courses_left, part.promises) = (courses_left, promises);
            Ok(Some(part))
        }
        (None, Some(error)) if asked.better_than.is_none() => Err(error),
        (None, _) => Ok(None),
    }
}

impl<C: Courses> Search<'_, C> {
    /// The plan on the guessed course and those on the courses that promise most.
    fn quickly(&mut self, all: &[Directions]) -> Result<Vec<Tried>, PlannerError> {
        let laid = self.courses.laid(Directions::Best, Effort::FULL)?;
        if !self.may_win(&self.courses.promise(&laid), &[]) {
            return Ok(Vec::new());
        }
        let guessed = self.courses.flown(laid, Effort::FULL)?;
        let most = guessed
            .work
            .saturating_mul(WORK_PLANS)
            .clamp(WORK.0, WORK.1);
        let by_steps = most.saturating_mul(self.asked.steps as u64) / DEFAULT_STEPS as u64;
        self.left = by_steps.saturating_sub(guessed.work);
        let mut found = self.best_in_full(all);
        found.push(Tried {
            directions: Directions::Best,
            worth: self.courses.worth(&guessed, Effort::FULL),
            part: guessed,
        });
        Ok(found)
    }
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
fn all_round(area: &Polygon) -> Vec<Directions> {
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
        let all = all_round(&Polygon::new(corners).unwrap());
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
