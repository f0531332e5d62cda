//! Flies at one height with others: asks them for what the executive wants next, and has it
//! flown once all who may meet this UAV have accepted it (D2.7 §1.3).
//!
//! What is agreed and what not is [`conflict`](crate::protocol::conflict)'s; what could be
//! flown, the executive's.
//!
//! | event | what follows |
//! |---|---|
//! | a percept of a UAV that is not where it was to be | a circle from there is imposed, and said |
//! | it stands ready to be launched | nothing is in force; its first flight is asked for, where none is clear for long by pleading |
//! | another asks for its first flight from its launcher | what this UAV flies is said whole: while it waited the other took note of nobody |
//! | what was offered is agreed | it is flown |
//! | the goal does not lead where the offer does | the offer is withdrawn |
//! | what is in force is nearly flown, or is not wanted any more | the first extension that keeps clear is offered; where none does, that is looked at again after half a second, and where none does for long, and who is in the way circles, one is offered to show it |
//! | one who goes before is held up by this UAV, which gets no further itself, or anybody by one with nothing to do | a way aside is offered that lets them pass |
//! | another UAV is believed down, for so long that it would have circled, and not sensed where it promised to be | what it promised is in nobody's way |
//! | one who says nothing is sensed, and does not circle | nothing near it is agreed (`silence`) |
//! | another mission, other zones | what is in force stays; what is on offer is withdrawn |

mod held_up;
mod identity;
mod passing;
mod silence;
#[cfg(test)]
mod tests;

use crate::effect::{Effect, Effects};
use crate::input::Time;
use crate::protocol::conflict::{Apart, Conflicts, InTheWay, Intent, Reach};
use crate::protocol::promises::Brief;
use crate::why::Agreed;
use crate::wire::codec::Body;
use crate::wire::message::{Member, Record};
use crate::{Incarnation, PeerId};
use held_up::{Found, HeldUp};
use identity::Identity;
use passing::{Gist, Passing};
use silence::{Silence, ends_ms};
use skein_behaviors::executive::promised::{CIRCLE_RADII, Extension, PROMISED_MOST_S};
use skein_behaviors::{Executive, Percept};
use skein_flight::airframe::Airframe;
use skein_flight::separation::{Detours, Motion, MotionPlan};
use std::collections::BTreeMap;

/// An extension has to be agreed so long before it turns off, milliseconds: two percepts,
/// by the first of which it is known and by the second flown.
const GUARD_MS: u64 = 400;

/// After a search that found nothing the next one waits for so long, milliseconds.
const SEARCH_AGAIN_MS: u64 = 500;

/// The same of who stands on a launcher, milliseconds. Others wait behind it; and it asks for a
/// take-off half as far ahead as for a turn in flight: what comes of no answer in time is another
/// second on the ground, not a circle.
const STANDING_AGAIN_MS: u64 = 400;

/// Who has circled for so long has nothing to do, most likely, milliseconds: others find a way
/// sooner.
const NOTHING_TO_DO_MS: u64 = 10_000;

/// What waits for an answer is said again after so long, milliseconds: what was lost, or its
/// answer, comes again before even what is offered soonest would turn off.
const SAY_AGAIN_MS: u64 = 600;

/// What asks for nothing is said again with its motions after so long, milliseconds: who
/// comes into earshot learns of it before the two can meet.
const SAY_MS: u64 = 5_000;

/// Two statements are at least so far apart, milliseconds.
const SAY_LEAST_MS: u64 = 200;

/// Of whom nothing was heard for so long nothing will be for a while, milliseconds: it says all
/// that it flies every [`SAY_MS`].
const UNHEARD_MS: u64 = 12_000;

/// Versions of a life begin above those of the lives before it: more than any makes.
const VERSIONS_OF_A_LIFE: u32 = 1 << 20;

/// How UAVs of a mission are kept apart at one height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rules {
    /// What any two keep, metres.
    pub separation_m: f64,
    /// How far any two stray together from what they promised, metres.
    pub tubes_m: f64,
    /// The fastest cruise of the mission, m/s.
    pub fastest_mps: f64,
    /// The turn radius that all fly, metres: also of those who circle without a computer.
    pub turn_radius_m: f64,
}

/// What one UAV does to be kept apart from the others.
#[derive(Debug)]
pub(crate) struct Separation {
    me: Member,
    rules: Rules,
    airframe: Airframe,
    conflicts: Option<Conflicts>,
    /// What is on offer.
    offered: Option<Extension>,
    /// The promise that the executive flies.
    flown: u32,
    search_from_ms: u64,
    is_news: bool,
    /// What is in force nobody has been told yet.
    is_imposed: bool,
    /// Somebody asks to take off, who knows of nobody what it flies.
    is_asked: bool,
    said_ms: u64,
    /// When its motions were said last, and which proposal that was.
    said_whole: (u64, Option<u32>),
    /// The peer's own time and the common clock at the last percept.
    clocks: (Time, u64),
    lives: BTreeMap<u16, Incarnation>,
    /// Since when others are believed down.
    down_since: BTreeMap<u16, Time>,
    passing: Passing,
    held_up: HeldUp,
    identity: Identity,
    silence: Silence,
    /// When others were heard last, milliseconds of the common clock.
    heard_ms: BTreeMap<u16, u64>,
}

impl Separation {
    /// Nothing is flown yet.
    pub fn new(me: Member, rules: Rules, airframe: Airframe) -> Self {
        Self {
            me,
            rules,
            airframe,
            conflicts: None,
            offered: None,
            flown: 0,
            search_from_ms: 0,
            is_news: false,
            is_imposed: false,
            is_asked: false,
            said_ms: 0,
            said_whole: (0, None),
            clocks: (Time(0), 0),
            lives: BTreeMap::new(),
            down_since: BTreeMap::new(),
            passing: Passing::default(),
            held_up: HeldUp::default(),
            identity: Identity::default(),
            silence: Silence::default(),
            heard_ms: BTreeMap::new(),
        }
    }

    /// The same for a mission that goes before, with all that was promised and heard in it.
    pub fn after(self, before: Self, executive: &Executive) -> Self {
        let apart = self.apart(executive);
        Self {
            me: self.me,
            rules: self.rules,
            airframe: self.airframe,
            conflicts: before.conflicts.map(|known| known.under(apart)),
            offered: None,
            is_news: true,
            search_from_ms: 0,
            ..before
        }
    }

    /// What others were promised that this UAV flies, at a time.
    pub fn promised(&self, now_ms: u64) -> Option<MotionPlan> {
        let flown = self.conflicts.as_ref()?.in_force();
        (!flown.has_left(now_ms)).then(|| flown.plan().clone())
    }

    /// What it promised and asks for, for a person; nothing before the first percept in the air.
    pub fn agreed(&self) -> Option<Agreed> {
        let conflicts = self.conflicts.as_ref()?;
        let (_, now_ms) = self.clocks;
        let flown = conflicts.in_force();
        if flown.has_left(now_ms) {
            return None;
        }
        let ends_ms = ends_ms(flown);
        let shown = |id: PeerId| self.identity.shown(id.0);
        Some(Agreed {
            way_ms: ends_ms.saturating_sub(now_ms),
            circles_ms: now_ms.saturating_sub(ends_ms),
            offers: conflicts.is_proposing(),
            waits_for: conflicts.waits_for(now_ms).map(shown).collect(),
            silent: conflicts.silent().map(shown).collect(),
            held_up_ms: self.held_up.since_ms(now_ms),
        })
    }

    /// A life of this peer begins.
    pub fn begin_life(&mut self, me: Member) {
        self.me = me;
        self.is_imposed = true;
    }

    /// The executive has answered a percept: what is next.
    pub fn on_percept(
        &mut self,
        now: Time,
        percept: &Percept,
        executive: &mut Executive,
        is_open: &dyn Fn(u16) -> bool,
    ) -> Effects {
        self.clocks = (now, percept.time_ms);
        let now_ms = percept.time_ms;
        self.take_up(executive);
        if executive.stands() {
            self.stand(percept, executive);
        }
        self.sense(percept);
        if executive.take_imposed() {
            self.impose(now_ms, percept, executive);
        }
        let Some(conflicts) = &mut self.conflicts else {
            return Effects::new();
        };
        self.is_news |= conflicts.tick(now_ms);
        self.take_up(executive);
        self.withdraw_unwanted(executive);
        let proposes = self.conflicts.as_ref().is_some_and(Conflicts::is_proposing);
        if !proposes && !percept.traffic.is_full() && now_ms >= self.search_from_ms {
            self.search(now_ms, executive, is_open);
            if let Some(conflicts) = &mut self.conflicts {
                // Where nobody has to be asked it is agreed already.
                self.is_news |= conflicts.tick(now_ms);
            }
            self.take_up(executive);
        }
        let mut effects = self.speak(now_ms);
        let passed = self.passing.due(now_ms, u64::from(self.me.id));
        effects.extend(passed.into_iter().map(Effect::PassOn));
        effects
    }

    /// Who is near, and who of them answers nothing.
    fn sense(&mut self, percept: &Percept) {
        let traffic = &percept.traffic;
        let Some(conflicts) = self.conflicts.as_mut().filter(|_| traffic.is_sensed()) else {
            return;
        };
        let (now_ms, tubes_m) = (percept.time_ms, self.rules.tubes_m);
        let seen = self.identity.of(traffic, conflicts, (tubes_m, now_ms));
        let near = seen.iter().map(|s| (PeerId(s.id), s.at()));
        conflicts.sensed(near, now_ms);
        self.silence.sense(&seen, conflicts, tubes_m, now_ms);
        let flown = conflicts.in_force();
        let circles_since_ms = Some(ends_ms(flown)).filter(|ms| *ms <= now_ms);
        let across_m = 2.0 * CIRCLE_RADII * self.rules.turn_radius_m + self.rules.tubes_m;
        for s in &seen {
            self.heard_ms.entry(s.id).or_insert(now_ms);
        }
        let heard_ms = |id: u16| self.heard_ms.get(&id).copied().unwrap_or(now_ms);
        let is_unheard = |id: u16| now_ms.saturating_sub(heard_ms(id)) >= UNHEARD_MS;
        let silent = self.silence.silent(
            (self.me.id, conflicts),
            |id| self.down_since.contains_key(&id) || is_unheard(id),
            (circles_since_ms, across_m),
            now_ms,
        );
        conflicts.are_silent(silent);
    }

    /// It is on the ground, and in nobody's way.
    fn stand(&mut self, percept: &Percept, executive: &Executive) {
        let Ok(nothing) = Motion::new(MotionPlan::on_ground(percept.time_ms, percept.pose)) else {
            return;
        };
        match &mut self.conflicts {
            Some(known) if known.in_force().has_left(percept.time_ms) => return,
            Some(known) => {
                known.impose(nothing);
                self.offered = None;
                self.is_imposed = true;
            }
            None => self.conflicts = Some(self.begun(percept, executive, nothing)),
        }
        self.flown = self.conflicts.as_ref().map_or(0, Conflicts::version);
    }

    fn impose(&mut self, now_ms: u64, percept: &Percept, executive: &Executive) {
        let plan = executive.in_force(now_ms);
        let Some(motion) = plan.and_then(|p| Motion::new(p).ok()) else {
            return;
        };
        self.offered = None;
        self.is_news = true;
        self.is_imposed = true;
        let conflicts = match self.conflicts.take() {
            Some(mut known) => {
                known.impose(motion);
                known
            }
            None => self.begun(percept, executive, motion),
        };
        self.flown = conflicts.version();
        self.conflicts = Some(conflicts);
    }

    /// How it is kept apart from others.
    fn apart(&self, executive: &Executive) -> Apart {
        let reach = Reach {
            promised_m: executive.reach_m(self.rules.fastest_mps),
            fastest_mps: self.rules.fastest_mps,
        };
        Apart {
            detours: Detours {
                airframe: self.airframe,
                separation_m: self.rules.separation_m,
            },
            tubes_m: self.rules.tubes_m,
            circle_radius_m: CIRCLE_RADII * self.rules.turn_radius_m,
            reach: Some(reach),
        }
    }

    fn begun(&self, percept: &Percept, executive: &Executive, motion: Motion) -> Conflicts {
        let apart = self.apart(executive);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "some hours"
        )]
        let endurance_s = percept.endurance_s.max(0.0) as u32;
        let before = self.me.incarnation.saturating_mul(VERSIONS_OF_A_LIFE);
        let begun = Conflicts::new(PeerId(self.me.id), endurance_s, apart, motion);
        begun.after(before).answered_soon()
    }

    /// Has the executive fly what was agreed.
    fn take_up(&mut self, executive: &mut Executive) {
        let Some(conflicts) = &self.conflicts else {
            return;
        };
        if conflicts.version() != self.flown {
            self.flown = conflicts.version();
            if let Some(extension) = self.offered.take() {
                executive.agree(extension);
            }
        }
        if !conflicts.is_proposing() {
            self.offered = None;
        }
    }

    fn withdraw_unwanted(&mut self, executive: &Executive) {
        let unwanted = self.offered.as_ref().is_some_and(|e| !executive.suits(e));
        if unwanted && let Some(conflicts) = &mut self.conflicts {
            self.is_news |= conflicts.withdraw();
            self.offered = None;
        }
    }

    /// Looks for what to fly next, and offers it.
    fn search(&mut self, now_ms: u64, executive: &mut Executive, is_open: &dyn Fn(u16) -> bool) {
        let Some(conflicts) = &mut self.conflicts else {
            return;
        };
        let (lead_ms, again_ms) = if executive.stands() {
            (conflicts.lead_ms() / 2, STANDING_AGAIN_MS)
        } else {
            (conflicts.lead_ms() + GUARD_MS, SEARCH_AGAIN_MS)
        };
        let until = |e: &Extension| e.branch_ms.saturating_sub(GUARD_MS);
        let wants = executive.wants_more(now_ms);
        if wants {
            let mut ways = executive.extensions(now_ms, lead_ms, is_open);
            let offers = || ways.iter().map(|e| (&e.plan, until(e)));
            let clear = conflicts.offer(now_ms, offers(), None);
            let since_ms = now_ms.saturating_sub(NOTHING_TO_DO_MS);
            let meets = |e: &Extension| conflicts.meets_who_circles(&e.plan, now_ms, since_ms);
            let pleads = clear.is_none()
                && self.held_up.is_due(now_ms)
                && (executive.stands() || ways.first().is_some_and(meets));
            let nth = if pleads {
                conflicts.plead(now_ms, offers())
            } else {
                clear
            };
            let gets_there = |nth: usize| ways.get(nth).is_some_and(Extension::gets_there);
            let found = match (clear, nth) {
                (Some(nth), _) if gets_there(nth) => Found::There,
                (Some(_), _) => Found::Way,
                (None, Some(_)) => Found::Pleaded,
                (None, None) => Found::Nothing,
            };
            self.held_up.looked(now_ms, found);
            if executive.stands() {
                executive.is_held_up(nth.is_none());
            }
            if let Some(nth) = nth {
                self.offered = Some(ways.swap_remove(nth));
                self.is_news = true;
                return;
            }
        } else if executive.is_under_way() {
            self.held_up.looked(now_ms, Found::Way);
        } else {
            self.held_up = HeldUp::default();
        }
        self.search_from_ms = now_ms + again_ms;
        let of = if wants {
            InTheWay::OfThoseBefore
        } else {
            InTheWay::OfAnybody
        };
        if executive.circles(now_ms) && conflicts.is_in_the_way(now_ms, of) {
            let mut ways = executive.ways_aside(now_ms, lead_ms);
            let offers = ways.iter().map(|e| (&e.plan, until(e)));
            if let Some(nth) = conflicts.offer(now_ms, offers, Some(of)) {
                self.offered = Some(ways.swap_remove(nth));
                self.is_news = true;
            }
        }
    }

    /// What is to be said now.
    fn speak(&mut self, now_ms: u64) -> Effects {
        let Some(conflicts) = &self.conflicts else {
            return Effects::new();
        };
        let brief = conflicts.brief();
        let asks = brief.proposal.is_some() || self.is_imposed;
        if !asks && conflicts.in_force().has_left(now_ms) {
            // Nobody asks who is on the ground.
            return Effects::new();
        }
        let whole_ms = now_ms.saturating_sub(self.said_whole.0);
        let again_ms = if brief.proposal.is_some() {
            SAY_AGAIN_MS
        } else {
            SAY_MS
        };
        let offers_anew = brief.proposal.is_some() && brief.proposal != self.said_whole.1;
        let is_told = !self.is_imposed && !self.is_asked;
        let is_whole = offers_anew || !is_told || whole_ms >= again_ms;
        let since_ms = now_ms.saturating_sub(self.said_ms);
        if since_ms < SAY_LEAST_MS || !(self.is_news || is_whole) {
            return Effects::new();
        }
        self.is_news = false;
        self.said_ms = now_ms;
        if !is_whole {
            return vec![Effect::SayNow(Body::Conflict(brief))];
        }
        self.is_imposed = false;
        self.is_asked = false;
        self.said_whole = (now_ms, brief.proposal);
        vec![Effect::SayNow(Body::Intent(conflicts.intent()))]
    }

    /// What another UAV flies and asks for.
    pub fn hear(&mut self, now: Time, (record, hops): (&Record, u8), intent: &Intent) {
        let now_ms = self.common_ms(now);
        let author = record.said_by();
        let gist = Gist {
            is_whole: true,
            offers: intent.proposal.as_ref().map(|p| p.version),
            accepts: &intent.accepts,
        };
        self.passing.hear(now_ms, record, gist, hops);
        let conflicts = self.of_present_life(now, author);
        let news = conflicts.is_some_and(|c| c.hear(PeerId(author.id), intent, now_ms));
        self.is_news |= news;
        self.is_asked |= intent.asks_to_take_off() && self.promised(now_ms).is_some();
    }

    /// The same in brief.
    pub fn hear_brief(&mut self, now: Time, (record, hops): (&Record, u8), brief: &Brief) {
        let now_ms = self.common_ms(now);
        let author = record.said_by();
        let gist = Gist {
            is_whole: false,
            offers: brief.proposal,
            accepts: &brief.accepts,
        };
        self.passing.hear(now_ms, record, gist, hops);
        let conflicts = self.of_present_life(now, author);
        let news = conflicts.is_some_and(|c| c.hear_brief(PeerId(author.id), brief, now_ms));
        self.is_news |= news;
    }

    /// What is settled with others, if the author speaks in the last life known of it; what
    /// it said in an earlier one is void.
    fn of_present_life(&mut self, now: Time, author: Member) -> Option<&mut Conflicts> {
        let conflicts = self.conflicts.as_mut()?;
        let known = self.lives.entry(author.id).or_insert(author.incarnation);
        if author.incarnation < *known {
            return None;
        }
        if author.incarnation > *known {
            *known = author.incarnation;
            conflicts.begins_anew(PeerId(author.id));
            self.passing.forget(author.id);
        }
        self.down_since.remove(&author.id);
        let (then, at_ms) = self.clocks;
        self.heard_ms.insert(author.id, at_ms + now.since_ms(then));
        Some(conflicts)
    }

    /// Who is believed down, at a time.
    pub fn believe_down(&mut self, now: Time, down: impl Iterator<Item = u16>) {
        let Some(conflicts) = &mut self.conflicts else {
            return;
        };
        let before = core::mem::take(&mut self.down_since);
        for id in down {
            let since = before.get(&id).copied().unwrap_or(now);
            self.down_since.insert(id, since);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a constant of some seconds"
            )]
            let circled_ms = (PROMISED_MOST_S * 1e3) as u64;
            if now.since_ms(since) >= circled_ms && !self.silence.follows(id) {
                conflicts.forget(PeerId(id));
            }
        }
    }

    /// The clock that all share, from the last percept on.
    pub fn common_ms(&self, now: Time) -> u64 {
        let (then, at_ms) = self.clocks;
        at_ms + now.since_ms(then)
    }
}
