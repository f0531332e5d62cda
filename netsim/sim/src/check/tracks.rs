//! Targets that are followed: who says that it follows one has it in its camera's picture
//! (`track-sight`); and for how long somebody had, how far from it, and how long it took
//! others after one that followed was lost.

use super::Findings;
use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;
use skein_peer::Follows;
use skein_peer::input::AskedTask;
use skein_peer::wire::tasks::{Task, TaskKind, TaskPlace};
use std::collections::BTreeMap;

/// So many looks of one who says that it follows are judged together: half a minute and more,
/// within which it may lose its target once and not have said so yet.
const WINDOW: u32 = 30;

/// Of them the target has to be in the picture in so many at least: half.
const PICTURED: u32 = WINDOW / 2;

/// A vehicle is the one that is meant if it is no farther from where it is said to be, metres:
/// twice what a car of 20 m/s drives in a second.
const MEANT_M: f64 = 40.0;

/// Who looks, and what it says.
#[derive(Clone, Debug)]
pub struct Look {
    /// Which UAV.
    pub uav: u16,
    /// Where it is, if it flies.
    pub at: Option<Point>,
    /// When its process last started or went on, milliseconds.
    pub since_ms: u64,
    /// Whom it says that it follows.
    pub says: Option<Follows>,
    /// Which vehicles are in its picture, by index.
    pub pictured: Vec<usize>,
}

/// What came of a target that was to be followed, as the world knows.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tracked {
    /// When it was first in the picture of who followed it, ms.
    pub first_ms: Option<u64>,
    /// How long it was wanted from then on, ms.
    pub wanted_ms: u64,
    /// Of that, how long it was in the picture of one that followed it, ms.
    pub sight_ms: u64,
    /// Of that, how long it was in the pictures of two or more at once, ms.
    #[serde(default)]
    pub twice_ms: u64,
    /// Of that, the longest time for which no one had it there, ms.
    #[serde(default)]
    pub gap_ms: u64,
    /// The root mean square of how far who saw it was off its stand-off, mm.
    pub stand_off_rms_mm: u64,
    /// The root mean square of how far the target was from where it was said to be, mm.
    pub place_rms_mm: u64,
    /// After each loss of one that followed, how long until another had it in its picture, ms.
    pub retaken_ms: Vec<u64>,
}

impl Tracked {
    /// For a line.
    pub(crate) fn words(&self) -> String {
        #[allow(clippy::cast_precision_loss, reason = "far less than 2^53")]
        let share = 100.0 * self.sight_ms as f64 / self.wanted_ms.max(1) as f64;
        let metres = |mm: u64| mm / 1000;
        let mut words = format!(
            ", in sight {share:.1} % of {} s, {} m off its stand-off",
            self.wanted_ms / 1000,
            metres(self.stand_off_rms_mm)
        );
        if self.twice_ms > 0 {
            words += &format!(", by two for {} s", self.twice_ms / 1000);
        }
        if self.gap_ms > 0 {
            words += &format!(", out of sight for {} s at most", self.gap_ms / 1000);
        }
        for ms in &self.retaken_ms {
            words += &format!(", had again {} s after a loss", ms / 1000);
        }
        words
    }
}

/// One task.
#[derive(Clone, Debug, Default)]
struct Watched {
    told: Tracked,
    open: bool,
    places: Vec<TaskPlace>,
    /// Looks with it in the picture, and the sums of the squares of both errors, mm².
    looks: u64,
    stand_off_mm2: f64,
    place_mm2: f64,
    /// Who had it in its picture last, and when.
    last: Option<(u16, u64)>,
    /// When one that followed was lost, and nobody had it since.
    lost_ms: Option<u64>,
    /// For how long nobody has had it in its picture, ms.
    unseen_ms: u64,
}

/// One look at a target: the first UAV that follows it and has it in its picture, its errors,
/// and how many do.
#[derive(Clone, Copy, Debug)]
struct Seen {
    uav: u16,
    stand_off_m: f64,
    place_m: f64,
    by: u32,
}

/// The claims of one UAV in its present window.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    said: u32,
    pictured: u32,
    from_ms: u64,
}

/// What came of targets in one run.
#[derive(Clone, Debug, Default)]
pub struct TrackCheck {
    asked: BTreeMap<(u16, u32), Watched>,
    windows: BTreeMap<u16, Window>,
    last_ms: u64,
}

impl TrackCheck {
    /// The ground station holds a task of its operator.
    pub fn on_asked(&mut self, asked: &AskedTask) {
        let task: &Task = &asked.task;
        if task.kind != TaskKind::Track {
            return;
        }
        let key = (asked.number, task.revision_as_asked());
        // Who is asked for beside another one, at the same place, is one more for its target.
        let is_first = |(number, _): &(u16, u32), w: &Watched| {
            *number < key.0 && w.open && w.places == task.places
        };
        if self.asked.iter().any(|(key, w)| is_first(key, w)) {
            return;
        }
        if task.is_open() {
            let watched = self.asked.entry(key).or_default();
            watched.open = true;
            watched.places.clone_from(&task.places);
        } else {
            // What is over is told in a revision of its own.
            for (_, w) in self.asked.range_mut((asked.number, 0)..=key) {
                w.open = false;
            }
        }
    }

    /// What came of each, by number and revision.
    pub fn tracked(&self) -> impl Iterator<Item = ((u16, u32), &Tracked)> {
        self.asked.iter().map(|(key, w)| (*key, &w.told))
    }

    /// Looks at all UAVs, beside where the vehicles are.
    pub fn on_looks(
        &mut self,
        now_ms: u64,
        vehicles: &[Point],
        looks: &[Look],
        found: &mut Findings,
    ) {
        let passed_ms = now_ms.saturating_sub(self.last_ms);
        self.last_ms = now_ms;
        self.windows
            .retain(|id, _| looks.iter().any(|l| l.uav == *id));
        let mut seen: BTreeMap<(u16, u32), Seen> = BTreeMap::new();
        for look in looks {
            let Some(says) = look.says.filter(|s| s.sees) else {
                self.windows.remove(&look.uav);
                continue;
            };
            let told = skein_peer::mission::point_m(says.at_mm);
            let off_m = |n: usize| vehicles.get(n).map_or(f64::INFINITY, |v| (v - told).norm());
            let nearest = look.pictured.iter().copied();
            let nearest = nearest.min_by(|a, b| off_m(*a).total_cmp(&off_m(*b)));
            let meant = nearest.filter(|n| off_m(*n) <= MEANT_M);
            self.judge(now_ms, look, &says, meant.is_some(), found);
            if let (Some(n), Some(at)) = (meant, look.at) {
                let away_m = (vehicles[n] - at).norm();
                let stand_off_m = f64::from(says.stand_off_mm) / 1000.0;
                let key = (says.task.number, says.revision);
                let first = seen.entry(key).or_insert(Seen {
                    uav: look.uav,
                    stand_off_m: away_m - stand_off_m,
                    place_m: off_m(n),
                    by: 0,
                });
                first.by += 1;
            }
        }
        let lives = |uav: u16| looks.iter().any(|l| l.uav == uav && l.at.is_some());
        for (key, w) in self.asked.iter_mut().filter(|(_, w)| w.open) {
            w.look(now_ms, passed_ms, seen.get(key).copied(), &lives);
        }
    }

    /// Whether who says that it follows has had it in its picture for long enough.
    fn judge(
        &mut self,
        now_ms: u64,
        look: &Look,
        says: &Follows,
        is_pictured: bool,
        found: &mut Findings,
    ) {
        let window = self.windows.entry(look.uav).or_insert(Window {
            from_ms: now_ms,
            ..Window::default()
        });
        // While its process stood still nothing was said.
        if look.since_ms > window.from_ms {
            *window = Window {
                from_ms: now_ms,
                ..Window::default()
            };
        }
        window.said += 1;
        window.pictured += u32::from(is_pictured);
        if window.said < WINDOW {
            return;
        }
        let Window {
            pictured, from_ms, ..
        } = *window;
        self.windows.remove(&look.uav);
        if pictured < PICTURED {
            let (east_mm, north_mm) = says.at_mm;
            found.broken("track-sight", now_ms, Some(look.uav), || {
                format!(
                    "says since {from_ms} ms that it follows the target of the task {}.{}, now at ({:.0}, {:.0}) m, and had a vehicle there in its picture in {pictured} of {WINDOW} looks (at least {PICTURED})",
                    says.task.author,
                    says.task.number,
                    f64::from(east_mm) / 1000.0,
                    f64::from(north_mm) / 1000.0,
                )
            });
        }
    }
}

impl Watched {
    fn look(
        &mut self,
        now_ms: u64,
        passed_ms: u64,
        seen: Option<Seen>,
        lives: &dyn Fn(u16) -> bool,
    ) {
        if self.told.first_ms.is_some() {
            self.told.wanted_ms += passed_ms;
            self.unseen_ms += passed_ms;
            if seen.is_some() {
                self.unseen_ms = 0;
            }
            self.told.gap_ms = self.told.gap_ms.max(self.unseen_ms);
        }
        let Some(Seen {
            uav,
            stand_off_m,
            place_m,
            by,
        }) = seen
        else {
            if let Some((last, at_ms)) = self.last.filter(|(last, _)| !lives(*last)) {
                self.lost_ms.get_or_insert(at_ms);
                self.last = Some((last, at_ms));
            }
            return;
        };
        if self.told.first_ms.is_none() {
            self.told.first_ms = Some(now_ms);
        } else {
            self.told.sight_ms += passed_ms;
            self.told.twice_ms += if by > 1 { passed_ms } else { 0 };
        }
        let gone = self.last.filter(|(last, _)| *last != uav && !lives(*last));
        if let Some(from_ms) = self.lost_ms.take().or(gone.map(|(_, at_ms)| at_ms)) {
            self.told.retaken_ms.push(now_ms.saturating_sub(from_ms));
        }
        self.last = Some((uav, now_ms));
        self.looks += 1;
        self.stand_off_mm2 += (stand_off_m * 1e3) * (stand_off_m * 1e3);
        self.place_mm2 += (place_m * 1e3) * (place_m * 1e3);
        #[allow(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive, and far less than 2^53"
        )]
        let rms = |sum: f64| (sum / self.looks as f64).sqrt() as u64;
        self.told.stand_off_rms_mm = rms(self.stand_off_mm2);
        self.told.place_rms_mm = rms(self.place_mm2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_peer::wire::tasks::{TaskId, TaskState};

    fn asked(revision: u32, state: TaskState) -> AskedTask {
        AskedTask {
            number: 3,
            task: Task {
                revision,
                state,
                kind: TaskKind::Track,
                ..Task::default()
            },
            age_ms: 0,
        }
    }

    fn look(uav: u16, told_m: i32, sees: bool, pictured: &[usize]) -> Look {
        Look {
            uav,
            at: Some(Point::new(30.0, 0.0)),
            since_ms: 0,
            says: Some(Follows {
                task: TaskId {
                    author: 100,
                    number: 3,
                },
                revision: 1,
                at_mm: (told_m * 1000, 0),
                sees,
                stand_off_mm: 25_000,
            }),
            pictured: pictured.to_vec(),
        }
    }

    /// Whether something is broken after so many seconds of this.
    fn after(seconds: u64, of: &dyn Fn(u64) -> Look) -> (bool, Tracked) {
        let (mut check, mut found) = (TrackCheck::default(), Findings::new(1));
        check.on_asked(&asked(1, TaskState::Open));
        for t in 1..=seconds {
            check.on_looks(t * 1000, &[Point::origin()], &[of(t)], &mut found);
        }
        let told = check.tracked().next().unwrap().1.clone();
        (found.counts.contains_key("track-sight"), told)
    }

    #[test]
    fn who_says_that_it_follows_and_does_not_see_it_is_found() {
        let (broken, told) = after(60, &|_| look(1, 5, true, &[0]));
        assert!(!broken);
        assert_eq!((told.wanted_ms, told.sight_ms), (59_000, 59_000));
        assert_eq!(told.gap_ms, 0);
        assert_eq!((told.stand_off_rms_mm, told.place_rms_mm), (5_000, 5_000));
        // Nothing in its picture; another place; too seldom.
        assert!(after(60, &|_| look(1, 5, true, &[])).0);
        assert!(after(60, &|_| look(1, 90, true, &[0])).0);
        assert!(
            after(60, &|t| look(
                1,
                5,
                true,
                if t % 3 == 0 { &[0] } else { &[] }
            ))
            .0
        );
        let seldom = after(60, &|t| {
            look(1, 5, true, if t % 3 > 0 { &[0] } else { &[] })
        });
        assert!(!seldom.0 && seldom.1.sight_ms < 45_000);
        assert_eq!(seldom.1.gap_ms, 1_000);
        // Who says that it searches may.
        assert!(!after(60, &|_| look(1, 5, false, &[])).0);
        // Nor is anything found in less than a window.
        assert!(!after(25, &|_| look(1, 5, true, &[])).0);
    }

    #[test]
    fn after_a_loss_it_is_told_how_long_it_took_others() {
        let (mut check, mut found) = (TrackCheck::default(), Findings::new(1));
        check.on_asked(&asked(1, TaskState::Open));
        for t in 1..=60 {
            let looks = match t {
                1..=20 => vec![look(1, 0, true, &[0])],
                21..=44 => vec![look(2, 0, false, &[])],
                _ => vec![look(2, 0, true, &[0])],
            };
            if t == 51 {
                check.on_asked(&asked(2, TaskState::Cancelled));
            }
            check.on_looks(t * 1000, &[Point::origin()], &looks, &mut found);
        }
        let told = check.tracked().next().unwrap().1.clone();
        assert_eq!(told.retaken_ms, [25_000]);
        assert_eq!((told.wanted_ms, told.sight_ms), (49_000, 25_000));
        assert!(told.words().contains("had again 25 s after a loss"));
        assert_eq!(told.gap_ms, 24_000);
        assert!(told.words().contains("out of sight for 24 s at most"));
    }

    #[test]
    fn who_is_asked_for_beside_another_counts_for_the_same_target() {
        let (mut check, mut found) = (TrackCheck::default(), Findings::new(1));
        let beside = AskedTask {
            number: 4,
            ..asked(1, TaskState::Open)
        };
        for t in 1..=30 {
            check.on_asked(&asked(1, TaskState::Open));
            check.on_asked(&beside);
            // The first dies after twenty seconds.
            let looks: Vec<Look> = [1, 2]
                .into_iter()
                .filter(|uav| *uav == 2 || t <= 20)
                .map(|uav| look(uav, 0, true, &[0]))
                .collect();
            check.on_looks(t * 1000, &[Point::origin()], &looks, &mut found);
        }
        let told: Vec<Tracked> = check.tracked().map(|(_, t)| t.clone()).collect();
        assert_eq!(told.len(), 1);
        assert_eq!((told[0].sight_ms, told[0].twice_ms), (29_000, 19_000));
        assert_eq!(told[0].retaken_ms, [1_000]);
        assert!(told[0].words().contains("by two for 19 s"));
        // At another place it is another target.
        let mut other = beside.clone();
        other.task.places = vec![TaskPlace {
            east_mm: 9,
            north_mm: 9,
        }];
        check.on_asked(&other);
        assert_eq!(check.tracked().count(), 2);
    }
}
