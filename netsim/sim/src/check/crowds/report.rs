//! What is told of an event beside what is true, for a person.

use super::circles::Watched;
use super::truth::Episode;
use crate::account::secs;
use serde::{Deserialize, Serialize};
use skein_peer::gathering::{CrowdAlert, People};

/// That a sector became too dense, as all came to know of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CrowdAlertReport {
    /// What was told first.
    pub told: CrowdAlert,
    /// Since when it truly was too dense by then, ms; none where it was near to it alone.
    pub truly_since_ms: Option<u64>,
    /// When the first peer told people.
    pub first_ms: u64,
    /// When the ground station did.
    pub ground_ms: Option<u64>,
    /// By a look at which time it had eased, and when the ground station told that, ms.
    pub eased_ms: Option<(u64, u64)>,
}

impl CrowdAlertReport {
    /// What was told and when, beside what was true.
    #[must_use]
    pub fn line(&self) -> String {
        let since = self.truly_since_ms.map_or_else(
            || "; truly near to it".to_owned(),
            |ms| format!("; truly from {:.0} s", secs(ms)),
        );
        let ground = self.ground_ms.map_or_else(
            || "; the ground station was not told".to_owned(),
            |ms| format!("; known on the ground at {:.1} s", secs(ms)),
        );
        let eased = self.eased_ms.map_or_else(
            || ", not eased".to_owned(),
            |(ms, _)| format!(", eased by {:.1} s", secs(ms)),
        );
        format!("{}{since}{ground}{eased}", self.told.sentence())
    }
}

/// What came of watching an event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CrowdReport {
    /// Its sectors.
    pub sectors: usize,
    /// How many people the ground station knew of last, or who was asked where there is none.
    pub people: People,
    /// How many there truly were, each sector when it was looked at.
    pub truly_then: f64,
    /// And how many there truly are in those sectors at the end.
    pub truly_now: f64,
    /// How old the oldest look is at the end, ms.
    pub age_ms: u64,
    /// Of the ranges of sectors that were told so many hold what was true then, of so many.
    pub ranges: (u32, u32),
    /// Of the ranges of all people, each half a minute: so many hold who was there at the looks.
    pub people_then: (u32, u32),
    /// And so many, wider by who walked, who was there at that moment.
    pub people_now: (u32, u32),
    /// What became too dense, as it was told.
    pub alerts: Vec<CrowdAlertReport>,
    /// Of the times at which a sector truly was too dense for longer than 20 s, so many were told;
    /// of the others so many were looked at while it was clear.
    pub episodes: (usize, Episodes),
    /// How long what was too dense was in a picture, and how soon somebody circled above.
    #[serde(default)]
    pub watched: Watched,
}

/// Times at which a sector was too dense, and nobody told so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Episodes {
    /// All of them.
    pub untold: usize,
    /// Those at which somebody looked while it was clearly so.
    pub looked: usize,
}

impl CrowdReport {
    /// What was told beside what was true, for a person.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let p = &self.people;
        let mut lines = vec![
            format!(
                "{:.0} people told ({:.0} to {:.0}) in {} of {} sectors, truly {:.0} when they were looked at and {:.0} at the end; the oldest look is {:.0} s old",
                p.people,
                p.low,
                p.high,
                p.looked,
                self.sectors,
                self.truly_then,
                self.truly_now,
                secs(self.age_ms)
            ),
            format!(
                "ranges hold: {} of {} sectors; all people {} of {} times, {} of {} as they walk on",
                self.ranges.0,
                self.ranges.1,
                self.people_then.0,
                self.people_then.1,
                self.people_now.0,
                self.people_now.1
            ),
            format!(
                "too dense: {} times told; truly {} times for longer than 20 s of which {} were not told, {} of them looked at while that was clear",
                self.alerts.len(),
                self.episodes.0 + self.episodes.1.untold,
                self.episodes.1.untold,
                self.episodes.1.looked
            ),
        ];
        let w = &self.watched;
        if w.circled_ms > 0 {
            let after: Vec<String> = w
                .after_ms
                .iter()
                .map(|ms| format!("{:.0}", secs(*ms)))
                .collect();
            lines.push(format!(
                "circled above for {:.0} s, {} s after something was too dense; sectors that were had somebody's picture for {:.0} of {:.0} s",
                secs(w.circled_ms),
                after.join(", "),
                secs(w.pictured_ms),
                secs(w.dense_ms)
            ));
        }
        lines.extend(self.alerts.iter().map(CrowdAlertReport::line));
        lines
    }
}

/// A peer told people.
pub fn note(
    alerts: &mut Vec<CrowdAlertReport>,
    (now_ms, _, is_ground): (u64, u16, bool),
    told: &CrowdAlert,
    truly_since_ms: Option<u64>,
) {
    let last = alerts
        .iter_mut()
        .rev()
        .find(|a| a.told.sector == told.sector);
    if !told.is_dense {
        if let Some(last) = last
            && (is_ground || last.eased_ms.is_none())
        {
            last.eased_ms = Some((told.since_ms, now_ms));
        }
        return;
    }
    // Two who see it at once without hearing each other say other times.
    let same = last.filter(|a| a.eased_ms.is_none_or(|(ms, _)| ms > told.since_ms));
    let ground_ms = is_ground.then_some(now_ms);
    match same {
        Some(known) => {
            known.ground_ms = known.ground_ms.or(ground_ms);
        }
        None => alerts.push(CrowdAlertReport {
            told: *told,
            truly_since_ms,
            first_ms: now_ms,
            ground_ms,
            eased_ms: None,
        }),
    }
}

/// How many episodes were told, and what of the others.
pub fn told(episodes: &[Episode], alerts: &[CrowdAlertReport]) -> (usize, Episodes) {
    let is_told = |e: &&Episode| {
        alerts.iter().any(|a| {
            let over = a.eased_ms.map_or(u64::MAX, |(ms, _)| ms);
            a.told.sector == e.sector
                && a.told.since_ms <= 1_000 * (e.to_s + 1)
                && over >= 1_000 * e.from_s
        })
    };
    let told = episodes.iter().filter(is_told).count();
    let looked = episodes
        .iter()
        .filter(|e| !is_told(e) && e.looked_ms.is_some());
    let rest = Episodes {
        untold: episodes.len() - told,
        looked: looked.count(),
    };
    (told, rest)
}
