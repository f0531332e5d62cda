//! What a peer knows of a contour that no map shows, by its own looks and by what others tell
//! (D2.7 §3.1): a road, or the edge of a fire.
//!
//! | event | what follows |
//! |---|---|
//! | its UAV has left a part of the contour behind | kept, simplified, in the register that grows |
//! | that holds all that it can | said at once; the next register begins, the oldest is written over |
//! | so many intervals pass, and its UAV flies along the contour | that register is said, if it grew, and of its older ones the next in turn: nobody else brings them to who lacks them |
//! | a trail of another | kept: of each register the newest counts |
//! | some seconds pass, and something is new | one outline is made of all, the newest look first; the executive is told it, and who flies along it before and behind |
//! | the outline has changed by much | told to people |
//!
//! # Guarantees
//! Bounded: 16 stretches of 16 places of each author, [`KNOWN_MAX`] in all. Registers merge in
//! any order. A mission whose UAVs see no contour says nothing.

use crate::Incarnation;
use crate::cooperation::Situation;
use crate::effect::{Effect, Effects};
use crate::input::Time;
use crate::mission_state::MissionState;
use crate::output::Report;
use crate::wire::codec::Body;
use crate::wire::trail::{TRAIL_PLACES_MAX, TRAILS_MAX, Trail};
use skein_behaviors::Goal;
use skein_behaviors::executive::tracing::{Told, gaps_along};
use skein_flight::tracing::outline::{Outline, Stretch, outline, simplified};
use skein_flight::tracing::thread::Mark;
use skein_geometry::frame::{Point, Pose};
use std::collections::BTreeMap;

/// What is told may be off what was seen by this beside all errors, metres.
const TOLERANCE_M: f64 = 3.0;

/// The register that grows is said each so many intervals.
const SAID_INTERVALS: u64 = 8;

/// An outline is made no more often than this, milliseconds.
const OUTLINED_MS: u64 = 4_000;

/// People are told of it no more often than this, milliseconds, and when its length has changed
/// by so much of itself.
const TOLD_MS: u64 = 20_000;
const TOLD_SHARE: f64 = 0.1;

/// Most registers that are kept.
pub const KNOWN_MAX: usize = 512;

/// Each life begins so many registers on from the one before.
const LIFE_STEP: u32 = 5;

/// A contour as one peer knows it.
#[derive(Debug, Default)]
pub(crate) struct Trails {
    known: BTreeMap<(u16, u16), Trail>,
    /// What was seen since the register began that grows.
    open: Vec<Mark>,
    number: u16,
    sided: bool,
    grew: bool,
    said_at: Time,
    is_news: bool,
    outlined_at: Time,
    outline: Outline,
    told_at: Time,
    told_m: f64,
    told_closed: bool,
    /// Registers that are full and not said yet.
    full: Vec<(u16, Trail)>,
    /// Which of its own registers was said again last.
    again: u16,
}

impl Trails {
    /// A life begins: what its author told before stays, and is written over last.
    pub fn begin_life(&mut self, life: Incarnation) {
        let first = life.wrapping_mul(LIFE_STEP) % u32::from(TRAILS_MAX);
        self.number = u16::try_from(first).unwrap_or(0);
        self.open.clear();
        self.full.clear();
        self.grew = false;
    }

    /// Its own UAV has left these places behind.
    pub fn note(&mut self, me: u16, (marks, sided): (Vec<Mark>, bool)) {
        if marks.is_empty() {
            return;
        }
        if sided != self.sided && !self.open.is_empty() {
            self.close(me);
        }
        self.sided = sided;
        for mark in marks {
            self.open.push(mark);
            if simplified(&self.open, TOLERANCE_M).len() > TRAIL_PLACES_MAX {
                self.open.pop();
                self.close(me);
                self.open.push(mark);
            }
        }
        self.grew = true;
        self.keep_own(me);
    }

    fn own(&self) -> Trail {
        Trail::of(&simplified(&self.open, TOLERANCE_M), self.sided)
    }

    fn keep_own(&mut self, me: u16) {
        let own = self.own();
        self.known.insert((me, self.number), own);
        self.is_news = true;
    }

    /// The register that grew is full: the next begins where it ends.
    fn close(&mut self, me: u16) {
        let own = self.own();
        self.known.insert((me, self.number), own.clone());
        self.full.push((self.number, own));
        self.number = (self.number + 1) % TRAILS_MAX;
        let last = self.open.last().copied();
        self.open.clear();
        self.open.extend(last.map(|m| Mark { begins: true, ..m }));
    }

    /// What another tells.
    pub fn hear(&mut self, author: u16, subject: u16, trail: &Trail) {
        let key = (author, subject);
        let room = self.known.len() < KNOWN_MAX || self.known.contains_key(&key);
        if room && self.known.get(&key) != Some(trail) {
            self.known.insert(key, trail.clone());
            self.is_news = true;
        }
    }

    /// All registers, by author and number.
    pub fn known(&self) -> impl Iterator<Item = ((u16, u16), &Trail)> {
        self.known.iter().map(|(key, trail)| (*key, trail))
    }

    /// What is known of the contour, in a sentence; none where nothing is.
    pub fn sentence(&self) -> Option<String> {
        report(&self.outline).map(|r| sentence(&r))
    }

    /// Says what is new, makes an outline of it, and tells the executive.
    pub fn tick(&mut self, s: &Situation<'_>, state: &mut MissionState) -> Effects {
        let mut effects = Effects::new();
        if self.known.is_empty() {
            return effects;
        }
        if s.speaks {
            let full = std::mem::take(&mut self.full).into_iter();
            effects.extend(full.map(|(n, trail)| Effect::Speak(n, Body::Trail(trail))));
            let pause_ms = SAID_INTERVALS * s.membership.interval_ms();
            let traces = state.flown_goal() == Some(&Goal::Trace);
            if traces && s.now.since_ms(self.said_at) >= pause_ms {
                self.said_at = s.now;
                if std::mem::take(&mut self.grew) {
                    effects.push(Effect::Speak(self.number, Body::Trail(self.own())));
                }
                effects.extend(self.say_again(s.me.id));
            }
        }
        if self.is_news && s.now.since_ms(self.outlined_at) >= OUTLINED_MS {
            self.is_news = false;
            self.outlined_at = s.now;
            let all: Vec<Stretch> = self.known.values().map(Trail::stretch).collect();
            self.outline = outline(&all);
            effects.extend(self.tell_people(s.now));
        }
        self.lead(s, state);
        effects
    }

    /// The next of its older registers.
    fn say_again(&mut self, me: u16) -> Option<Effect> {
        let own = self.known.range((me, 0)..=(me, u16::MAX));
        let older = own.map(|((_, n), _)| *n).filter(|n| *n != self.number);
        let after = |n: &u16| (*n <= self.again, *n);
        let next = older.min_by_key(after)?;
        self.again = next;
        let trail = self.known.get(&(me, next))?.clone();
        Some(Effect::Speak(next, Body::Trail(trail)))
    }

    fn tell_people(&mut self, now: Time) -> Option<Effect> {
        let length_m = self.outline.length_m();
        let changed_m = (length_m - self.told_m).abs();
        let is_other = changed_m > TOLD_SHARE * self.told_m.max(1.0)
            || self.outline.closed != self.told_closed;
        let is_due = self.told_m <= 0.0 || now.since_ms(self.told_at) >= TOLD_MS;
        if !is_other || !is_due {
            return None;
        }
        self.told_at = now;
        self.told_m = length_m;
        self.told_closed = self.outline.closed;
        report(&self.outline).map(Effect::Report)
    }

    /// Tells the executive what is known, and who flies before and behind it.
    fn lead(&self, s: &Situation<'_>, state: &mut MissionState) {
        let mine = s.percept.map(|p| p.pose);
        let (Some(mine), Some(Goal::Trace)) = (mine, state.flown_goal()) else {
            return;
        };
        let points = |piece: &Vec<Mark>| piece.iter().map(|m| m.at).collect();
        let pieces: Vec<Vec<Point>> = self.outline.pieces.iter().map(points).collect();
        let fellows = state.fellows(s);
        let Some(executive) = &mut state.executive else {
            return;
        };
        let speed_mps = executive.loop_speed_mps();
        let others: Vec<(Pose, f64)> = fellows
            .iter()
            .map(|f| (f.pose, speed_mps * f64::from(f.age_ms) / 1000.0))
            .collect();
        let ring = pieces.first().filter(|_| self.outline.closed);
        let gaps = ring.and_then(|ring| gaps_along(ring, mine, &others));
        executive.keep_even_along(gaps);
        executive.tell_contour(Told {
            pieces,
            backward: s.me.id.is_multiple_of(2),
        });
    }
}

fn report(outline: &Outline) -> Option<Report> {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "lengths and areas within a mission"
    )]
    let whole = |v: f64| v.max(0.0) as u64;
    let places = outline.pieces.iter().map(Vec::len).sum::<usize>();
    (places > 1).then(|| Report::Traced {
        length_m: whole(outline.length_m()),
        area_m2: outline.area_m2().map(whole),
        places: u32::try_from(places).unwrap_or(u32::MAX),
    })
}

/// What was told of a contour, for a person.
pub(crate) fn sentence(report: &Report) -> String {
    let Report::Traced {
        length_m,
        area_m2,
        places,
    } = report
    else {
        return String::new();
    };
    match area_m2 {
        Some(m2) => format!(
            "knows the edge of a fire: {length_m} m around {} ha, by {places} places",
            hectares(*m2)
        ),
        None => format!("knows {length_m} m of a contour, by {places} places"),
    }
}

fn hectares(m2: u64) -> String {
    format!("{}.{}", m2 / 10_000, m2 % 10_000 / 1_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark(k: u32) -> Mark {
        let rad = f64::from(k) / 20.0;
        Mark {
            at: Point::new(
                200.0 * skein_geometry::math::cos(rad),
                200.0 * skein_geometry::math::sin(rad),
            ),
            seen_ms: 700 * u64::from(k),
            begins: k == 0,
        }
    }

    #[test]
    fn what_is_left_behind_fills_registers_round_and_round() {
        let mut trails = Trails::default();
        trails.begin_life(0);
        for k in 0..250 {
            trails.note(3, (vec![mark(k)], true));
        }
        assert!(trails.known.len() > 2 && trails.full.len() == trails.known.len() - 1);
        for (_, trail) in trails.known() {
            assert!(trail.places.len() <= TRAIL_PLACES_MAX && trail.sided);
        }
        let all: Vec<Stretch> = trails.known.values().map(Trail::stretch).collect();
        let whole = outline(&all);
        assert!(whole.closed, "{whole:?}");
        for k in 250..4_000 {
            trails.note(3, (vec![mark(k)], true));
        }
        assert_eq!(trails.known.len(), usize::from(TRAILS_MAX));
        // Another peer that hears them in any order knows the same.
        let mut other = Trails::default();
        for ((author, n), trail) in trails.known.iter().rev() {
            other.hear(*author, *n, trail);
        }
        assert_eq!(other.known, trails.known);
    }

    #[test]
    fn no_more_than_so_many_are_kept() {
        let mut trails = Trails::default();
        for author in 0..600 {
            trails.hear(author, 0, &Trail::default());
        }
        assert_eq!(trails.known.len(), KNOWN_MAX);
    }
}
