//! What others sense of aircraft that are no members, as far as this UAV does not sense it itself
//! (D2.7 §1.2.3): so way is made for who is beyond the own sensor's range, or by who has none.
//!
//! | event | what follows |
//! |---|---|
//! | its UAV senses aircraft, and four intervals have passed since it told of any | the four nearest are told, to whoever hears it |
//! | others tell of aircraft | for ten seconds they are taken to fly straight on, and to be sensed |
//! | two tell of what is near the same place and height, or it is sensed itself | the one that is sensed itself counts, else the newer |
//!
//! # Guarantees
//! Nobody passes it on, and nothing of it lasts: who tells nonsense keeps nobody away for longer.

use crate::cooperation::Situation;
use crate::effect::Effect;
use crate::input::Time;
use crate::wire::aircraft::{SENSED_MAX, SensedAircraft};
use crate::wire::codec::Body;
use skein_behaviors::Percept;
use skein_behaviors::traffic::Aircraft;
use std::collections::BTreeMap;

/// Told no more often than each so many intervals.
const SAID_INTERVALS: u64 = 4;

/// What is older is forgotten, milliseconds: an aircraft of 50 m/s is half a kilometre on.
const LASTS_MS: u64 = 10_000;

/// Two that are nearer than this and differ less in height are one, metres.
const SAME_M: f64 = 120.0;
const SAME_HEIGHT_M: f64 = 10.0;

/// Whose word is kept, at most.
const AUTHORS_MAX: usize = 64;

/// What others tell.
#[derive(Debug, Default)]
pub(crate) struct ToldAircraft {
    told: BTreeMap<u16, SensedAircraft>,
    said_at: Time,
}

impl ToldAircraft {
    /// Another tells what it senses.
    pub fn hear(&mut self, author: u16, told: &SensedAircraft) {
        let known = self.told.get(&author);
        let is_older = known.is_some_and(|k| k.at_ms > told.at_ms);
        let has_room = known.is_some() || self.told.len() < AUTHORS_MAX;
        if !is_older && has_room {
            self.told.insert(author, told.clone());
        }
    }

    /// The same percept with what others tell.
    pub fn complete(&mut self, percept: &Percept) -> Percept {
        let now_ms = percept.time_ms;
        self.told
            .retain(|_, told| now_ms.abs_diff(told.at_ms) <= LASTS_MS);
        if self.told.is_empty() {
            return *percept;
        }
        let mut all: Vec<Aircraft> = percept.traffic.aircraft().copied().collect();
        let mut newest_first: Vec<&SensedAircraft> = self.told.values().collect();
        newest_first.sort_by_key(|told| core::cmp::Reverse(told.at_ms));
        for told in newest_first {
            for one in &told.seen {
                let here = flown_on(one, told.at_ms, now_ms);
                if !all.iter().any(|known| is_same(known, &here)) {
                    all.push(here);
                }
            }
        }
        let own = percept.pose.position();
        all.sort_by(|a, b| (a.at() - own).norm().total_cmp(&(b.at() - own).norm()));
        Percept {
            traffic: percept.traffic.with_aircraft(all),
            ..*percept
        }
    }

    /// Tells what its UAV senses.
    pub fn tick(&mut self, s: &Situation<'_>) -> Option<Effect> {
        let pause_ms = SAID_INTERVALS * s.membership.interval_ms();
        let percept = s.percept.filter(|_| s.speaks)?;
        if s.now.since_ms(self.said_at) < pause_ms {
            return None;
        }
        let nearest = percept.traffic.aircraft().take(SENSED_MAX);
        let seen: Vec<Aircraft> = nearest.copied().collect();
        if seen.is_empty() {
            return None;
        }
        self.said_at = s.now;
        let at_ms = percept.time_ms;
        Some(Effect::SayNow(Body::Aircraft(SensedAircraft {
            at_ms,
            seen,
        })))
    }
}

/// Where one is that flew straight on since.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "ten seconds at most"
)]
fn flown_on(one: &Aircraft, since_ms: u64, now_ms: u64) -> Aircraft {
    let ms = now_ms as i64 - since_ms as i64;
    let on = |dm: i32, dmps: i16| dm.saturating_add((i64::from(dmps) * ms / 1_000) as i32);
    Aircraft {
        east_dm: on(one.east_dm, one.east_dmps),
        north_dm: on(one.north_dm, one.north_dmps),
        ..*one
    }
}

fn is_same(a: &Aircraft, b: &Aircraft) -> bool {
    (a.at() - b.at()).norm() < SAME_M && (a.height_m() - b.height_m()).abs() < SAME_HEIGHT_M
}
