//! Relay positions as one peer has them (D2.7 §3.2): whether its UAV is there, and when others
//! are to relieve it.

use super::Tasking;
use super::tracking::Sight;
use crate::cooperation::Situation;
use crate::effect::Effects;
use crate::mission_state::MissionState;
use crate::output::TaskNews;
use crate::protocol::auction::Event;

/// Why a relay position is nobody's while all others hold one, or there is one UAV alone.
pub(crate) const KEPT_FOR_COVER: &str =
    "nobody would be left to cover; it is taken when another UAV is there or everything is covered";

/// How far a UAV is with a relay position.
#[derive(Clone, Debug, Default)]
pub(super) struct Held {
    /// Whether it was there, and said so.
    pub has_begun: bool,
    /// Whether it asked others to relieve it.
    pub is_leaving: bool,
    /// Of a target to follow, what was said of sight.
    pub sight: Sight,
}

impl Tasking {
    /// A relay position is reached, or its holder is to be relieved of it: its fuel will be due.
    pub(super) fn hold(&mut self, s: &Situation<'_>, state: &mut MissionState) -> Effects {
        let tracks = self.sought().is_some();
        let (sight, sees) = self.watch_sight();
        let (Some(executive), Some(flown)) = (&state.executive, &mut self.flown) else {
            return Effects::new();
        };
        let (id, Some(held)) = (flown.id, &mut flown.held) else {
            return Effects::new();
        };
        // Who sees whom it is to follow follows it, planned or not.
        if !flown.is_planned && !tracks {
            return Effects::new();
        }
        let mut events = Vec::new();
        let mut news: Vec<TaskNews> = sight.into_iter().collect();
        let is_there = if tracks {
            sees
        } else {
            executive.is_on_circle()
        };
        if !held.has_begun && is_there {
            held.has_begun = true;
            events.push(Event::Begun(id));
            if !tracks {
                news.push(TaskNews::Holds);
            }
        }
        let diameter = s.membership.diameter(s.now);
        let settled_ms = relieved_ms(diameter, s.membership.interval_ms(), executive.home_ms());
        let left_ms = u64::from(state.spendable_ms(s.percept));
        if held.has_begun && !held.is_leaving && left_ms <= settled_ms {
            held.is_leaving = true;
            events.push(Event::Relieve(id));
            news.push(TaskNews::Leaving);
        }
        let told = news.into_iter().filter_map(|news| self.told(id, news));
        let mut effects: Effects = told.collect();
        if !events.is_empty() {
            effects.extend(self.handle(events, state));
        }
        effects
    }

    /// There is no way to what it is to hold.
    pub fn no_way(&mut self, state: &mut MissionState) -> Effects {
        self.relieve("no way leads to it that keeps clear of the zones", state)
    }
}

/// How long before its fuel is due who holds a relay position asks to be relieved, milliseconds:
/// all offer anew and settle, twice the patience of the auction, and whoever comes flies no
/// longer than from anywhere home.
fn relieved_ms(diameter: u32, interval_ms: u64, home_ms: u32) -> u64 {
    2 * (2 * u64::from(diameter) + 3) * interval_ms + u64::from(home_ms)
}
