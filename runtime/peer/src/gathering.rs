//! The people of a mass event as one peer knows of them (D2.7 §3.1): what it sees in its own
//! pictures, and what others tell of theirs.
//!
//! | event | what follows |
//! |---|---|
//! | a look, and all of a sector is in it for certain | how many people it holds, with a range; the look before is out of date |
//! | by that look it is certainly too dense, or has certainly eased | so it is from then on; what is neither is what it was |
//! | a sector became too dense, or eased, in the own pictures | told at once |
//! | its looks are newer than those that anybody told by the mission's interval, or differ from them for certain | told a few seconds later, with all that is known of the tile |
//! | nobody told as much as is known here of a tile for four intervals, or two beacon intervals since this peer told that it became too dense | told again |
//! | a tile of another, or the own one as it is told | of each sector the newest look is kept, and the newest one that was sure |
//! | a sector is too dense by that, and was not, or the other way round | told to people here |
//! | another life begins, another event or another sortie | its own looks begin at nothing |
//!
//! A sector is counted in one picture, so whoever walks from one into the next is in one of them.
//! That a later look goes before is a join: whoever heard the same knows the same, in whatever
//! order it came. Nobody repairs what is lost: whoever knows more says so in its turn.
//!
//! # Guarantees
//! Bounded: 1,024 sectors, and as many of another event until it is known which one counts. Nothing
//! is drawn. Without an event nothing is kept and nothing said.

use crate::Incarnation;
use crate::crowd::CrowdWatch;
use crate::effect::{Effect, Effects};
use crate::input::Time;
use crate::mission::Mission;
use crate::output::Report;
use crate::wire::codec::Body;
use crate::wire::crowd::{
    AGO_MAX_S, CAME_MAX, CrowdDense, CrowdRow, CrowdTile, SECTORS_EACH, SECTORS_MAX, Sure,
};
use skein_behaviors::Percept;
use skein_behaviors::view::View;
use skein_flight::airframe::Airframe;
use skein_flight::mount::DIRECTION_OFF_RAD;
use std::collections::BTreeMap;
use std::sync::Arc;

mod estimate;
mod known;
use estimate::{Picture, estimate};
pub use known::{Crowd, CrowdAlert, Look, People, Sector, Verdict};

/// Most sectors that are kept.
pub const KNOWN_MAX: usize = 2 * SECTORS_MAX as usize;

/// Looks that are farther apart than this are none of one pass, milliseconds.
const PASS_MS: u64 = 10_000;

/// What is told of a pass waits for so long, so that all of the tile is told together,
/// milliseconds.
const GATHERED_MS: u64 = 4_000;

/// All together tell one tile in so many beacon intervals, what is urgent apart: that and its
/// copies take a tenth of the air of 64 kbit/s.
const TURN_INTERVALS: u64 = 2;

/// What nobody told for so many of the mission's intervals is told again.
const AGAIN: u64 = 4;

/// And so many beacon intervals later by who has the next higher number: it is told by one.
const RANK_INTERVALS: u64 = 4;

/// That a sector became too dense, or eased, is told so often, so many beacon intervals apart.
const URGENT_TIMES: u8 = 3;
const URGENT_INTERVALS: u64 = 2;

/// At the end everything is told that is so much newer than what is known, milliseconds.
const LAST_MS: u64 = 1_000;

/// Where nobody is for certain, and nobody was, that is told so many times less often.
const EMPTY: u64 = 4;

/// Looks so far apart are as good as one, milliseconds: of those the narrower range is kept, unless
/// the later one is nearly as narrow.
const AT_ONCE_MS: u64 = 5_000;
const NARROWER: u32 = 2;

/// A sector as its own UAV saw it in this life.
#[derive(Clone, Copy, Debug, Default)]
struct Own {
    sector: Sector,
    /// The newest look of the pass before, by anybody.
    before: Option<Look>,
}

/// The event of the mission that is followed.
#[derive(Clone, Debug)]
struct Followed {
    of: u32,
    watch: Arc<CrowdWatch>,
}

/// All that one peer knows of the people of an event.
#[derive(Debug, Default)]
pub(crate) struct Gathering {
    me: u16,
    life: Incarnation,
    followed: Option<Followed>,
    own: BTreeMap<u16, Own>,
    /// What anybody told, this peer too; by event and sector.
    known: BTreeMap<(u32, u16), Sector>,
    /// When each own tile was told last.
    told: BTreeMap<u16, Time>,
    /// Since when each own tile has news.
    news: BTreeMap<u16, Time>,
    /// When somebody told all that is known here of a tile.
    heard: BTreeMap<u16, Time>,
    /// How often a tile is told again soon.
    again: BTreeMap<u16, u8>,
    said_at: Time,
    last_ms: u64,
}

/// What of a tile is to be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum News {
    None,
    Again,
    Some,
    Urgent,
}

impl Gathering {
    /// Nothing is known.
    pub fn new(me: u16) -> Self {
        Self {
            me,
            ..Self::default()
        }
    }

    /// A life begins.
    pub fn begin_life(&mut self, life: Incarnation) {
        self.life = life;
        self.clear_own();
    }

    fn clear_own(&mut self) {
        self.own.clear();
        self.told.clear();
        self.news.clear();
        self.again.clear();
    }

    /// The event of the mission.
    pub fn follow(&mut self, mission: &Mission) {
        let Some(watch) = &mission.crowd else {
            if self.followed.take().is_some() {
                self.clear_own();
            }
            return;
        };
        // A later lap shares the event of the one before.
        if matches!(&self.followed, Some(f) if Arc::ptr_eq(&f.watch, watch)) {
            return;
        }
        let of = mission.crowd_hash();
        if self.followed.as_ref().is_none_or(|f| f.of != of) {
            self.clear_own();
        }
        self.followed = Some(Followed {
            of,
            watch: Arc::clone(watch),
        });
    }

    /// What is known of a sector, told or not: by whom it was seen last decides.
    fn newest(&self, of: u32, sector: u16) -> Sector {
        let known = self.known.get(&(of, sector)).copied().unwrap_or_default();
        let own = self.own.get(&sector).map(|o| o.sector).unwrap_or_default();
        known.joined(own)
    }

    /// One look of the own camera; `looks` where this peer is to look at all.
    pub fn look(&mut self, percept: &Percept, airframe: &Airframe, looks: bool) {
        let Some(Followed { of, watch }) = self.followed.clone() else {
            return;
        };
        if !looks || percept.crowd.is_absent() || percept.takes_off_in_ms > 0 {
            return;
        }
        // Times are told in whole seconds.
        let now_ms = percept.time_ms / 1_000 * 1_000;
        self.last_ms = now_ms;
        let view = View::of(percept, airframe);
        let squares = percept.crowd.seen().iter();
        let certain = squares.filter(|s| view.holds(&s.corners(), 0.0, DIRECTION_OFF_RAD));
        let picture = Picture::new(certain);
        let Some((low, high)) = picture.bounds() else {
            return;
        };
        for sector in watch.within(low, high) {
            let Some(held) = watch.squares(sector).and_then(|s| picture.held(s)) else {
                continue;
            };
            let seen = estimate(&held);
            self.take(&watch, of, (sector, now_ms), seen);
        }
    }

    /// A sector was counted: so many people, at least and at most.
    fn take(
        &mut self,
        watch: &CrowdWatch,
        of: u32,
        (sector, now_ms): (u16, u64),
        (people, low, high): (u16, u16, u16),
    ) {
        let newest = self.newest(of, sector);
        let own = self.own.entry(sector).or_default();
        if let Some(last) = newest.look
            && last.seen_ms + PASS_MS <= now_ms
        {
            own.before = Some(last);
        }
        let came = own.before.map_or(0, |b| certainly_came((low, high), &b));
        let look = Look {
            seen_ms: now_ms,
            by: self.me,
            people,
            low,
            high,
            came,
        };
        let dense = f64::from(low) > watch.dense_people();
        let eased = f64::from(high) < watch.eased_people();
        let goes_on = newest.verdict.and_then(|v| v.dense);
        let verdict = (dense || eased).then(|| Verdict {
            at_ms: now_ms,
            dense: dense.then(|| goes_on.unwrap_or((now_ms, self.me))),
        });
        let is_better = own.sector.look.is_none_or(|held| {
            let width = |l: &Look| u32::from(l.high - l.low);
            let is_late = look.seen_ms >= held.seen_ms + AT_ONCE_MS;
            is_late || NARROWER * width(&look) <= (NARROWER + 1) * width(&held).max(4)
        });
        if !is_better {
            return;
        }
        own.sector.look = own.sector.look.max(Some(look));
        own.sector.verdict = own.sector.verdict.max(verdict);
    }

    /// The first tile from this one on of which anything is known.
    fn tile_from(&self, of: u32, tile: u16) -> Option<u16> {
        let first = tile.checked_mul(SECTORS_EACH)?;
        let known = self.known.range((of, first)..=(of, u16::MAX)).next();
        let known = known.map(|((_, sector), _)| *sector);
        let own = self.own.range(first..).next().map(|(sector, _)| *sector);
        let next = known.into_iter().chain(own).min()?;
        Some(next / SECTORS_EACH)
    }

    /// What of an own tile is news beside what anybody told.
    fn news_of(&self, tile: u16, (of, interval_ms): (u32, u64)) -> News {
        let first = SECTORS_EACH * tile;
        let own = self.own.range(first..first + SECTORS_EACH);
        let news = own.map(|(sector, own)| {
            let known = self.known.get(&(of, *sector)).copied().unwrap_or_default();
            let (Some(look), sector) = (own.sector.look, own.sector) else {
                return News::None;
            };
            let is_dense = |s: &Sector| s.dense().is_some();
            let is_sure = sector.verdict > known.verdict;
            if is_sure && is_dense(&sector) != is_dense(&known) {
                return News::Urgent;
            }
            let is_news = known.look.is_none_or(|told| {
                let later_ms = look.seen_ms.saturating_sub(told.seen_ms);
                let differs = look.low > told.high || look.high < told.low;
                let is_empty = look.low == 0 && told.low == 0;
                let interval_ms = if is_empty {
                    EMPTY * interval_ms
                } else {
                    interval_ms
                };
                later_ms >= interval_ms || differs && later_ms >= interval_ms / 2
            });
            if is_news { News::Some } else { News::None }
        });
        news.max().unwrap_or(News::None)
    }

    /// What is to be told now: one tile at a time, where a sector became too dense or eased first.
    /// So many UAVs share the air, of whom so many have lower numbers.
    pub fn tell(
        &mut self,
        now: Time,
        (beacon_ms, uavs, rank): (u64, u64, u64),
        looks: bool,
    ) -> Effects {
        let Some(Followed { of, watch }) = self.followed.clone() else {
            return Effects::new();
        };
        if now.since_ms(self.said_at) < beacon_ms {
            return Effects::new();
        }
        let interval_ms = 1_000 * u64::from(watch.interval_s);
        let newer_ms = if looks { interval_ms } else { LAST_MS };
        let again_ms = AGAIN * interval_ms + RANK_INTERVALS * beacon_ms * rank;
        let is_turn = now.since_ms(self.said_at) >= TURN_INTERVALS * beacon_ms * uavs;
        let mut due: Option<((bool, u64), u16, bool)> = None;
        let mut from = 0;
        while let Some(tile) = self.tile_from(of, from) {
            from = tile + 1;
            let (mut news, mut since_ms) = (self.news_of(tile, (of, newer_ms)), 0);
            let is_new = news == News::Urgent;
            if news == News::None {
                self.news.remove(&tile);
                let heard_ms = now.since_ms(*self.heard.entry(tile).or_insert(now));
                let is_soon =
                    self.again.contains_key(&tile) && heard_ms >= URGENT_INTERVALS * beacon_ms;
                if is_soon || heard_ms >= again_ms {
                    (news, since_ms) = (News::Again, heard_ms.saturating_sub(again_ms));
                }
                if is_soon {
                    news = News::Urgent;
                }
            } else {
                since_ms = now.since_ms(*self.news.entry(tile).or_insert(now));
            }
            let told_ms = self.told.get(&tile).map_or(u64::MAX, |t| now.since_ms(*t));
            let is_gathered = since_ms >= GATHERED_MS && told_ms >= interval_ms / 2;
            let is_due = match news {
                News::None => false,
                News::Again => is_turn,
                News::Some => is_turn && (is_gathered || !looks),
                News::Urgent => true,
            };
            // What waits longest goes first, or nothing would be told again while there is news.
            let order = (news == News::Urgent, since_ms);
            if is_due && due.is_none_or(|d| order > d.0) {
                due = Some((order, tile, is_new));
            }
        }
        let Some((_, tile, is_new)) = due else {
            return Effects::new();
        };
        self.note_urgent(tile, is_new);
        self.news.remove(&tile);
        self.told.insert(tile, now);
        self.said_at = now;
        let told = self.register(tile, of);
        let mut effects = self.learn(now, tile, &told);
        self.heard.insert(tile, now);
        effects.push(Effect::Speak(tile, Body::Crowd(told)));
        effects
    }

    /// What is urgent is told more than once: as often as ever where more of the tile became so
    /// before that was done.
    fn note_urgent(&mut self, tile: u16, is_new: bool) {
        let left = if is_new {
            URGENT_TIMES - 1
        } else {
            self.again.get(&tile).map_or(0, |left| left - 1)
        };
        if left > 0 {
            self.again.insert(tile, left);
        } else {
            self.again.remove(&tile);
        }
    }

    /// All that is known of a tile, told or not.
    fn register(&self, tile: u16, of: u32) -> CrowdTile {
        let first = SECTORS_EACH * tile;
        let all = (first..first + SECTORS_EACH).filter_map(|n| {
            let sector = self.newest(of, n);
            Some((n, sector.look?, sector.verdict))
        });
        let all: Vec<(u16, Look, Option<Verdict>)> = all.collect();
        let time_ms = all.iter().map(|(_, l, _)| l.seen_ms).max().unwrap_or(0);
        let mut tile = CrowdTile {
            crowd: of,
            time_s: time_ms / 1_000,
            ..CrowdTile::default()
        };
        for (sector, look, verdict) in all {
            if let Some((row, dense)) = row_of((sector, time_ms), &look, verdict.as_ref()) {
                tile.rows.push(row);
                tile.dense.extend(dense);
            }
        }
        tile
    }

    /// What another tells.
    pub fn hear(&mut self, now: Time, tile: u16, told: &CrowdTile) -> Effects {
        self.learn(now, tile, told)
    }

    fn learn(&mut self, now: Time, tile: u16, told: &CrowdTile) -> Effects {
        let followed = self.followed.clone().filter(|f| f.of == told.crowd);
        let of = self.followed.as_ref().map(|f| f.of);
        let mut effects = Effects::new();
        for row in &told.rows {
            let sector = SECTORS_EACH * tile + u16::from(row.sector);
            let key = (told.crowd, sector);
            if self.known.len() >= KNOWN_MAX && !self.known.contains_key(&key) {
                self.known.retain(|(event, _), _| Some(*event) == of);
                if self.known.len() >= KNOWN_MAX {
                    return effects;
                }
            }
            let held = self.known.entry(key).or_default();
            let before = *held;
            let dense = told.dense.iter().find(|d| d.sector == row.sector);
            *held = before.joined(Sector::of((row, dense), told.time_s));
            let after = *held;
            if let Some(f) = &followed
                && before.dense().is_some() != after.dense().is_some()
                && let Some(told) = after.alert(&f.watch, sector)
            {
                effects.push(Effect::Report(Report::Crowd { told }));
            }
        }
        if followed.is_some() && self.is_all(tile, told) {
            self.heard.insert(tile, now);
        }
        effects
    }

    /// Whether all that is known of a tile was told so.
    fn is_all(&self, tile: u16, told: &CrowdTile) -> bool {
        let first = SECTORS_EACH * tile;
        let known = self
            .known
            .range((told.crowd, first)..(told.crowd, first + SECTORS_EACH));
        let said = |n: u16| {
            let within = |sector: u8| first + u16::from(sector) == n;
            let row = told.rows.iter().find(|r| within(r.sector))?;
            let dense = told.dense.iter().find(|d| within(d.sector));
            Some(Sector::of((row, dense), told.time_s))
        };
        let mut all = known.map(|((_, n), s)| (*n, *s));
        all.all(|(n, s)| said(n) == Some(s))
    }

    /// What all together saw, as far as is known here; none without an event.
    pub fn crowd(&self, mission: &Mission) -> Option<Crowd> {
        let watch = mission.crowd.as_ref()?;
        let of = mission.crowd_hash();
        let known = self.known.range((of, 0)..=(of, u16::MAX));
        let known = known.map(|((_, sector), s)| (*sector, *s)).collect();
        Some(Crowd::new(Arc::clone(watch), known))
    }

    /// What this UAV saw itself in this life, told or not, by sector.
    pub fn own(&self) -> impl Iterator<Item = (u16, Sector)> {
        self.own.iter().map(|(n, own)| (*n, own.sector))
    }

    /// The sectors of the event that is followed, as they were told.
    pub fn followed(&self) -> impl Iterator<Item = (u16, Sector)> {
        let of = self.followed.as_ref().map(|f| f.of);
        let of = of.map(|of| self.known.range((of, 0)..=(of, u16::MAX)));
        let all = of.into_iter().flatten();
        all.map(|((_, n), s)| (*n, *s))
    }

    /// When a sector of the event that is followed was seen last, told or not.
    pub fn seen_last(&self, sector: u16) -> Option<Look> {
        let of = self.followed.as_ref()?.of;
        self.newest(of, sector).look
    }

    /// Those that are too dense.
    pub fn dense(&self) -> impl Iterator<Item = (u16, Sector)> {
        self.followed().filter(|(_, s)| s.dense().is_some())
    }

    /// When its camera looked last, milliseconds of the clock of percepts.
    pub fn last_ms(&self) -> u64 {
        self.last_ms
    }

    /// How many sectors are kept.
    pub fn len(&self) -> usize {
        self.known.len()
    }
}

/// How many more people there certainly are than in the look before; fewer below 0.
fn certainly_came((low, high): (u16, u16), before: &Look) -> i32 {
    let of = |n: u16| i32::from(n);
    let more = of(low) - of(before.high);
    let fewer = of(high) - of(before.low);
    if more > 0 {
        more.min(CAME_MAX)
    } else {
        fewer.min(0)
    }
}

/// A sector as it is told; none where it was seen longer ago than can be said.
fn row_of(
    (sector, time_ms): (u16, u64),
    look: &Look,
    verdict: Option<&Verdict>,
) -> Option<(CrowdRow, Option<CrowdDense>)> {
    let before = |ms: u64, of_ms: u64| {
        let ago_s = u32::try_from(of_ms.saturating_sub(ms) / 1_000).ok()?;
        (ago_s <= AGO_MAX_S).then_some(ago_s)
    };
    let sector = u8::try_from(sector % SECTORS_EACH).ok()?;
    let mut row = CrowdRow {
        sector,
        people: look.people,
        low: look.low,
        high: look.high,
        age_s: before(look.seen_ms, time_ms)?,
        seen_by: look.by,
        came: look.came,
        ..CrowdRow::default()
    };
    let Some(v) = verdict else {
        return Some((row, None));
    };
    row.sure_before_s = before(v.at_ms, look.seen_ms)?;
    row.sure = Sure::Eased;
    let Some((since_ms, by)) = v.dense else {
        return Some((row, None));
    };
    row.sure = Sure::Dense;
    let dense = CrowdDense {
        sector,
        dense_s: before(since_ms, v.at_ms)?,
        by,
    };
    Some((row, Some(dense)))
}

#[cfg(test)]
mod tests;
