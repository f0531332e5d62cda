//! What is known of the people of an event, whoever saw them: joins, sums, and what of it people
//! are told.

use crate::crowd::CrowdWatch;
use crate::mission::mm;
use crate::targets::PLACE_M;
use crate::wire::crowd::{CrowdDense, CrowdRow, Sure};
use serde::{Deserialize, Serialize};
use skein_behaviors::crowd::RECOGNISED;
use skein_geometry::math::seconds;
use std::collections::BTreeMap;
use std::sync::Arc;

/// So many standard deviations of a UAV's own place are told as the error of a place.
const ERRORS: f64 = 4.0;

/// A sector as it was seen in one picture. Of two the later one goes before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Look {
    /// When, milliseconds of the clock of percepts.
    pub seen_ms: u64,
    /// By whom.
    pub by: u16,
    /// How many people there were.
    pub people: u16,
    /// At least.
    pub low: u16,
    /// And at most, in nineteen cases of twenty.
    pub high: u16,
    /// How many more there certainly were than when it was seen before; fewer below 0.
    pub came: i32,
}

/// That a sector is certainly too dense, or certainly not. Of two the later one goes before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Verdict {
    /// By a look at that time, milliseconds of the clock of percepts.
    pub at_ms: u64,
    /// Where it is too dense, since when, and by whom that was seen first.
    pub dense: Option<(u64, u16)>,
}

/// What is known of a sector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Sector {
    /// The newest look.
    pub look: Option<Look>,
    /// The newest one that was sure whether it is too dense.
    pub verdict: Option<Verdict>,
}

impl Sector {
    /// As it is told.
    pub(super) fn of((row, dense): (&CrowdRow, Option<&CrowdDense>), time_s: u64) -> Self {
        let before = |of_ms: u64, s: u32| of_ms.saturating_sub(1_000 * u64::from(s));
        let look = Look {
            seen_ms: before(1_000 * time_s, row.age_s),
            by: row.seen_by,
            people: row.people,
            low: row.low,
            high: row.high,
            came: row.came,
        };
        let at_ms = before(look.seen_ms, row.sure_before_s);
        let verdict = |dense| Verdict { at_ms, dense };
        Self {
            look: Some(look),
            verdict: match (row.sure, dense) {
                (Sure::None, _) => None,
                (Sure::Dense, Some(d)) => Some(verdict(Some((before(at_ms, d.dense_s), d.by)))),
                _ => Some(verdict(None)),
            },
        }
    }

    /// What two know together.
    #[must_use]
    pub fn joined(self, other: Self) -> Self {
        Self {
            look: self.look.max(other.look),
            verdict: self.verdict.max(other.verdict),
        }
    }

    /// Where it is too dense, since when, and who saw that first.
    #[must_use]
    pub fn dense(&self) -> Option<(u64, u16)> {
        self.verdict?.dense
    }

    /// What people are told of it.
    pub(super) fn alert(&self, watch: &CrowdWatch, sector: u16) -> Option<CrowdAlert> {
        let (look, verdict) = (self.look?, self.verdict?);
        let middle = watch.middle(sector)?;
        let (since_ms, by) = verdict.dense.unwrap_or((verdict.at_ms, look.by));
        let error_m = f64::from(watch.sector_m) / 2.0 + ERRORS * PLACE_M;
        Some(CrowdAlert {
            sector,
            east_mm: mm(middle.x),
            north_mm: mm(middle.y),
            error_mm: mm(error_m).unsigned_abs(),
            is_dense: verdict.dense.is_some(),
            since_ms,
            by,
            sector_m: watch.sector_m,
            look,
        })
    }
}

/// That a sector became too dense, or has eased.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CrowdAlert {
    /// Which sector.
    pub sector: u16,
    /// Its middle, mm east of the origin.
    pub east_mm: i32,
    /// And north of it.
    pub north_mm: i32,
    /// No farther from there than this, each way, mm.
    pub error_mm: u32,
    /// Whether it is too dense; else it has eased.
    pub is_dense: bool,
    /// Since when, milliseconds of the clock of percepts.
    pub since_ms: u64,
    /// Who saw that first.
    pub by: u16,
    /// The side of the sector, metres.
    pub sector_m: u16,
    /// The newest look at it.
    pub look: Look,
}

impl CrowdAlert {
    /// People to a square metre: how many, at least and at most.
    #[must_use]
    pub fn per_m2(&self) -> (f64, f64, f64) {
        let m2 = f64::from(self.sector_m) * f64::from(self.sector_m);
        let of = |n: u16| f64::from(n) / m2.max(1.0);
        (of(self.look.people), of(self.look.low), of(self.look.high))
    }

    /// What, where, how surely, when and by whom, for a person.
    #[must_use]
    pub fn sentence(&self) -> String {
        let metres = |mm: i32| f64::from(mm) / 1000.0;
        let (density, low, high) = self.per_m2();
        let what = if self.is_dense {
            "is too dense"
        } else {
            "has eased"
        };
        format!(
            "the crowd at ({:.0}, {:.0}) m ± {:.0} m {what}: {density:.1} people to 1 m² ({low:.1} to {high:.1}), since {:.1} s of the clock of percepts, seen by uav{}",
            metres(self.east_mm),
            metres(self.north_mm),
            f64::from(self.error_mm) / 1000.0,
            seconds(self.since_ms),
            self.by
        )
    }
}

/// All that is known of an event.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Crowd {
    watch: Arc<CrowdWatch>,
    sectors: BTreeMap<u16, Sector>,
}

/// How many people an event has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct People {
    /// So many.
    pub people: f64,
    /// At least, when each sector was looked at.
    pub low: f64,
    /// And at most.
    pub high: f64,
    /// So many fewer there may be, since who certainly came to a sector may have been counted
    /// where it came from.
    pub twice: f64,
    /// So many more there may be, since who certainly left a sector may not have been counted where
    /// it went.
    pub missed: f64,
    /// Of so many sectors.
    pub looked: usize,
    /// The time of the oldest look, milliseconds.
    pub oldest_ms: u64,
}

impl Crowd {
    /// What is known of some sectors.
    #[must_use]
    pub fn new(watch: Arc<CrowdWatch>, sectors: BTreeMap<u16, Sector>) -> Self {
        Self { watch, sectors }
    }

    /// The event.
    #[must_use]
    pub fn watch(&self) -> &CrowdWatch {
        &self.watch
    }

    /// What is known of each sector.
    pub fn sectors(&self) -> impl Iterator<Item = (u16, &Sector)> {
        self.sectors.iter().map(|(n, s)| (*n, s))
    }

    /// What is known of one.
    #[must_use]
    pub fn sector(&self, sector: u16) -> Option<Sector> {
        self.sectors.get(&sector).copied()
    }

    /// Each sector that is too dense.
    pub fn alerts(&self) -> impl Iterator<Item = CrowdAlert> + '_ {
        let dense = self.sectors().filter(|(_, s)| s.dense().is_some());
        dense.filter_map(|(n, s)| s.alert(&self.watch, n))
    }

    /// How many people it has, each sector by the newest look at it.
    ///
    /// What a recogniser may miss everywhere alike adds up; errors by chance even out.
    #[must_use]
    pub fn people(&self) -> People {
        let share = (RECOGNISED.0 + RECOGNISED.1) / 2.0;
        let (few, many) = (share / RECOGNISED.1, share / RECOGNISED.0);
        let mut sum = People {
            oldest_ms: u64::MAX,
            ..People::default()
        };
        let (mut below, mut above) = (0.0_f64, 0.0_f64);
        for look in self.sectors.values().filter_map(|s| s.look) {
            let people = f64::from(look.people);
            sum.people += people;
            sum.low += few * people;
            sum.high += many * people;
            below += (few * people - f64::from(look.low)).powi(2);
            above += (f64::from(look.high) - many * people).powi(2);
            sum.twice += f64::from(look.came.max(0));
            sum.missed += f64::from((-look.came).max(0));
            sum.looked += 1;
            sum.oldest_ms = sum.oldest_ms.min(look.seen_ms);
        }
        sum.low = (sum.low - below.sqrt()).max(0.0);
        sum.high += above.sqrt();
        if sum.looked == 0 {
            sum.oldest_ms = 0;
        }
        sum
    }

    /// What is known, for a person.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        let People {
            people,
            low,
            high,
            twice,
            missed,
            looked,
            oldest_ms,
        } = self.people();
        let of = self.watch.len();
        if looked == 0 {
            return vec![format!("the event: none of its {of} sectors was seen yet")];
        }
        let densest = self.sectors().max_by_key(|(_, s)| s.look.map(|l| l.people));
        let densest = densest.and_then(|(n, s)| Some((self.watch.middle(n)?, s.look?)));
        let moved = if twice + missed > 0.0 {
            format!(", {twice:.0} of them counted twice or {missed} missed at most as they walked")
        } else {
            String::new()
        };
        let mut told = vec![format!(
            "the event: {people:.0} people ({low:.0} to {high:.0}) in {looked} of {of} sectors, the oldest look at {:.1} s of the clock of percepts{moved}",
            seconds(oldest_ms)
        )];
        if let Some((at, look)) = densest {
            let m2 = self.watch.sector_m2();
            told.push(format!(
                "its densest sector, about ({:.0}, {:.0}) m: {:.1} people to 1 m² ({:.1} to {:.1}), seen by uav{} at {:.1} s",
                at.x,
                at.y,
                f64::from(look.people) / m2,
                f64::from(look.low) / m2,
                f64::from(look.high) / m2,
                look.by,
                seconds(look.seen_ms)
            ));
        }
        told.extend(self.alerts().map(|a| a.sentence()));
        told
    }
}
