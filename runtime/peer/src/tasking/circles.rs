//! Who stays above what became too dense (D2.7 §3.1): circles that follow from what all know, and
//! who flies each, by the auction and as relay positions are held.
//!
//! | what holds | what follows |
//! |---|---|
//! | its mission says circle, and a sector is too dense by what was told | a task to circle where most that is too dense around the sector which is so longest is in the picture all the way round |
//! | somebody who lives is to fly a circle, and something in its picture is too dense | that circle stays, and goes before others |
//! | so many circles as the mission says are asked for | what none of them holds is looked at, by [`super::crowds`] |
//! | nothing that a circle holds is too dense any more, the mission is over or cancelled | the circle is withdrawn; who flew it goes on with its own |
//! | no circle keeps clear of the zones there | likewise looked at |
//!
//! A circle is a task that nobody says: its number is the sector above which it is flown, so whoever
//! knows the same asks for the same. Its worth, its place and how it changes hands are those of a
//! relay position, and as for these at least one UAV is left for the patrol.
//!
//! # Guarantees
//! At most so many are asked for as the mission says. What is withdrawn is forgotten.

use super::brought::{CIRCLES_FROM, MISSION};
use super::crowds::looks_at;
use super::{Tasking, map_of, report};
use crate::Mission;
use crate::cooperation::Situation;
use crate::crowd::{CrowdWatch, ThenWatch};
use crate::effect::Effects;
use crate::mission_state::MissionState;
use crate::output::TaskNews;
use crate::relay_circle::Eye;
use crate::wire::tasks::{BundleTask, Progress, Task, TaskId, TaskKind, TaskPlace, TaskState};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// What of circles is kept.
#[derive(Debug, Default)]
pub(super) struct Circles {
    /// Circles that the auction is to forget.
    pub withdrawn: BTreeSet<TaskId>,
    /// Whether there is room for a circle above a sector, of this event between these zones.
    room: BTreeMap<u16, bool>,
    of: (u32, u32),
    /// How high the own UAV is, metres.
    pub height_m: f64,
}

/// The sectors that a circle above one of them holds.
struct Reach<'a> {
    watch: &'a CrowdWatch,
    reach_m: f64,
}

impl Reach<'_> {
    fn of<'a>(watch: &'a CrowdWatch, mission: &Mission) -> Reach<'a> {
        let reach_m = mission.circled_reach_m(f64::from(watch.sector_m));
        // The sector itself is in the picture where the UAV passes it, whatever it flies.
        Reach {
            watch,
            reach_m: reach_m.max(0.0),
        }
    }

    /// How far apart two sectors are, in squares of their sides, if a circle above one holds the
    /// other.
    fn apart(&self, a: u16, b: u16) -> Option<u32> {
        let (a, b) = (self.watch.place(a)?, self.watch.place(b)?);
        let (cols, rows) = (a.0.abs_diff(b.0), a.1.abs_diff(b.1));
        let apart = u32::from(cols).pow(2) + u32::from(rows).pow(2);
        let side_m = f64::from(self.watch.sector_m);
        (f64::from(apart) * side_m * side_m <= self.reach_m * self.reach_m).then_some(apart)
    }
}

/// Whether a mission has UAVs stay above what is too dense.
pub(super) fn flies_circles(mission: &Mission) -> bool {
    let watch = mission.crowd.as_ref();
    watch.is_some_and(|w| w.then == ThenWatch::Circle)
}

/// Above which sectors circles are flown: of sectors that are too dense it is known since when, of
/// circles that somebody is to fly how far it is with that.
fn wanted(
    reach: &Reach<'_>,
    dense: &BTreeMap<u16, u64>,
    claimed: &BTreeMap<u16, Progress>,
    has_room: &mut dyn FnMut(u16) -> bool,
) -> BTreeSet<u16> {
    let most = usize::from(reach.watch.circles_max);
    let mut free = dense.clone();
    let mut circles = BTreeSet::new();
    let mut flown: Vec<(u16, Progress)> = claimed.iter().map(|(n, p)| (*n, *p)).collect();
    flown.sort_by_key(|(n, progress)| (Reverse(*progress), *n));
    for (above, _) in flown {
        let holds = |n: &u16| reach.apart(above, *n).is_some();
        if circles.len() < most && free.keys().any(holds) {
            circles.insert(above);
            free.retain(|n, _| !holds(n));
        }
    }
    while circles.len() < most {
        let longest = free.iter().min_by_key(|(n, since)| (**since, **n));
        let Some(seed) = longest.map(|(n, _)| *n) else {
            break;
        };
        let held = |above: u16| {
            free.keys()
                .filter(move |n| reach.apart(above, **n).is_some())
        };
        let near = reach.watch.sectors();
        let near = near.filter_map(|n| Some((n, reach.apart(n, seed)?)));
        let mut near: Vec<(Reverse<usize>, u32, u16)> = near
            .map(|(n, apart)| (Reverse(held(n).count()), apart, n))
            .collect();
        near.sort_unstable();
        let best = near.into_iter().map(|(.., n)| n).find(|n| has_room(*n));
        match best {
            Some(above) => {
                circles.insert(above);
                free.retain(|n, _| reach.apart(above, *n).is_none());
            }
            None => {
                free.remove(&seed);
            }
        }
    }
    circles
}

/// The task to circle above a sector.
fn circle_above(mission: &Mission, watch: &CrowdWatch, sector: u16) -> Option<Task> {
    let (east_mm, north_mm) = watch.middle_mm(sector)?;
    let within_m = mission.watched_within_m(f64::from(watch.sector_m));
    Some(Task {
        revision: mission.crowd_hash().max(1),
        kind: TaskKind::Relay,
        places: vec![TaskPlace { east_mm, north_mm }],
        worth: watch.worth,
        radius_mm: crate::mission::mm(within_m).unsigned_abs(),
        name: format!("crowd-{sector}").into_bytes(),
        ..Task::default()
    })
}

/// The task of the circle above a sector.
fn id_of(sector: u16) -> TaskId {
    TaskId {
        author: MISSION,
        number: CIRCLES_FROM.saturating_add(sector),
    }
}

/// Above which sector a task is a circle, if it is one.
#[must_use]
pub fn circled_sector(id: TaskId) -> Option<u16> {
    let sector = id.number.checked_sub(CIRCLES_FROM);
    sector.filter(|_| id.author == MISSION)
}

impl Tasking {
    /// Asks for the circles that follow from what all know, and for no others.
    pub(super) fn derive_circles(&mut self, s: &Situation<'_>, state: &MissionState) -> Effects {
        let mission = &state.geometry.mission;
        let mut circles = BTreeMap::new();
        if let Some(watch) = &mission.crowd
            && flies_circles(mission)
            && looks_at(state)
        {
            let of = (mission.crowd_hash(), map_of(state));
            if self.circles.of != of {
                self.circles.of = of;
                self.circles.room.clear();
            }
            let dense = self.gathering.dense();
            let dense = dense.filter_map(|(n, sector)| Some((n, sector.dense()?.0)));
            let dense: BTreeMap<u16, u64> = dense.collect();
            let claimed = self.circles_claimed(s, mission);
            let room = &mut self.circles.room;
            let mut has_room = |n: u16| {
                *room.entry(n).or_insert_with(|| {
                    let task = circle_above(mission, watch, n);
                    task.is_some_and(|t| mission.can_do(&t).is_ok())
                })
            };
            let reach = Reach::of(watch, mission);
            let above = wanted(&reach, &dense, &claimed, &mut has_room);
            let tasks = above.iter();
            let tasks = tasks.filter_map(|n| Some((id_of(*n), circle_above(mission, watch, *n)?)));
            circles.extend(tasks);
        }
        let stays = |id: &TaskId, task: &Task| circles.get(id) == Some(task);
        let known = self
            .known
            .iter()
            .filter(|(id, _)| circled_sector(**id).is_some());
        let over = known.filter(|(id, k)| !stays(id, &k.task));
        let over: Vec<TaskId> = over.map(|(id, _)| *id).collect();
        let mut effects = Effects::new();
        for id in over {
            if let Some(known) = self.known.remove(&id) {
                let news = TaskNews::Over(TaskState::Cancelled);
                effects.push(report(id, &known.task, news));
            }
            self.news.remove(&id);
            self.circles.withdrawn.insert(id);
        }
        for (id, task) in circles {
            if !self.known.contains_key(&id) {
                effects.extend(self.learn(s.now, id, task));
            }
        }
        effects
    }

    /// Which circles somebody who lives is to fly, and how far it is with them.
    fn circles_claimed(&self, s: &Situation<'_>, mission: &Mission) -> BTreeMap<u16, Progress> {
        let revision = mission.crowd_hash().max(1);
        let mut claimed: BTreeMap<u16, Progress> = BTreeMap::new();
        for held in self.claims(s).filter(|held| held.revision == revision) {
            let is_claim = !matches!(held.progress, Progress::Tentative | Progress::Done);
            if let Some(sector) = circled_sector(held.task).filter(|_| is_claim) {
                let most = claimed.entry(sector).or_insert(held.progress);
                *most = (*most).max(held.progress);
            }
        }
        claimed
    }

    /// What this peer and those who live hold.
    fn claims(&self, s: &Situation<'_>) -> impl Iterator<Item = &BundleTask> {
        let live: BTreeSet<u16> = s.membership.live().map(|(id, _)| id).collect();
        let others = self.bundles.iter();
        let others = others.filter(move |(id, _)| live.contains(&id.0));
        let others = others.flat_map(|(_, (_, bundle))| &bundle.tasks);
        self.auction.held().iter().chain(others)
    }

    /// Sectors that a circle holds which somebody is on.
    pub(super) fn circled(&self, s: &Situation<'_>, mission: &Mission) -> BTreeSet<u16> {
        let Some(watch) = mission.crowd.as_ref().filter(|_| flies_circles(mission)) else {
            return BTreeSet::new();
        };
        let begun = self.circles_claimed(s, mission).into_iter();
        let begun = begun.filter(|(_, p)| matches!(p, Progress::Begun | Progress::Leaving));
        let begun: Vec<u16> = begun.map(|(n, _)| n).collect();
        let reach = Reach::of(watch, mission);
        let holds = |n: &u16| begun.iter().any(|above| reach.apart(*above, *n).is_some());
        self.gathering
            .dense()
            .map(|(n, _)| n)
            .filter(holds)
            .collect()
    }

    /// By which camera a task is watched; none where nothing is.
    pub(super) fn eye(&self, id: TaskId, mission: &Mission) -> Option<Eye> {
        circled_sector(id)?;
        Some(Eye {
            airframe: self.flies?,
            height_m: self.circles.height_m,
            side_m: f64::from(mission.crowd.as_ref()?.sector_m),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crowd::tests::event;

    /// Sectors too dense since when, and circles that somebody is to fly: above which others are.
    fn above(
        circles_max: u16,
        dense: &[(u16, u64)],
        claimed: &[(u16, Progress)],
        no_room: &[u16],
    ) -> Vec<u16> {
        let watch = CrowdWatch {
            cols: 12,
            rows: 4,
            then: ThenWatch::Circle,
            circles_max,
            ..event()
        };
        let reach = Reach {
            watch: &watch,
            reach_m: 29.0,
        };
        let (dense, claimed) = (dense.iter().copied(), claimed.iter().copied());
        let mut room = |n: u16| !no_room.contains(&n);
        let all = wanted(&reach, &dense.collect(), &claimed.collect(), &mut room);
        all.into_iter().collect()
    }

    /// Numbers are those of tiles of four by four: 0 to 3 lie beside each other, 4 is above 0.
    #[test]
    fn one_circle_holds_what_is_together_and_others_wait_for_their_turn() {
        assert_eq!(above(1, &[], &[], &[]), [0; 0]);
        assert_eq!(above(1, &[(5, 10)], &[], &[]), [5]);
        // Around 5 lie all of these; around 0, which is so longest, but three.
        let all = [(0, 10), (1, 20), (4, 20), (6, 20), (10, 20)];
        assert_eq!(above(1, &all, &[], &[]), [5]);
        // What is far away has a circle of its own where the mission says two, the longest first.
        let two = [(0, 10), (1, 20), (34, 5)];
        assert_eq!(above(1, &two, &[], &[]), [34]);
        assert_eq!(above(2, &two, &[], &[]), [0, 34]);
        assert_eq!(above(8, &two, &[], &[]), [0, 34]);
    }

    #[test]
    fn what_somebody_is_to_circle_stays_until_all_of_it_has_eased() {
        use Progress::{Begun, Committed};
        let two = [(1, 20), (34, 5)];
        assert_eq!(above(1, &two, &[(0, Begun)], &[]), [0]);
        assert_eq!(above(1, &[(34, 5)], &[(0, Begun)], &[]), [34]);
        assert_eq!(above(1, &[], &[(0, Begun)], &[]), [0; 0]);
        // Of two who came together the one that is there stays.
        let both = [(0, Committed), (5, Begun)];
        assert_eq!(above(2, &[(1, 20)], &both, &[]), [5]);
    }

    #[test]
    fn where_no_circle_has_room_another_is_taken_or_none() {
        assert_eq!(above(1, &[(5, 10)], &[], &[5]), [1]);
        let around = [0, 1, 2, 4, 5, 6, 8, 9, 10];
        assert_eq!(above(1, &[(5, 10), (34, 20)], &[], &around), [34]);
    }
}
