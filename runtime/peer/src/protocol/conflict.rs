//! Approach conflicts: which motion a UAV asks for, and until when (D2.7 §1.3).
//!
//! A UAV that wants to go somewhere looks for the cheapest way that keeps apart from all
//! that stands, and proposes to turn off onto it a little ahead of where it is. What then
//! happens to the proposal is [`promises`](super::promises)'s, whose rules keep UAVs apart
//! whatever this part does; this one sees to it that they get anywhere.
//!
//! | state | event | next state | what follows |
//! |---|---|---|---|
//! | idle | a wish, and a way that is clear | proposing | the proposal is said |
//! | idle | a wish, and no such way | idle | the search is repeated after a second |
//! | proposing | agreed before the branch | on its way | the way is flown |
//! | proposing | agreed with others | on its way | the next branch is put off twice as far as that took, 1 s at least and 2 s at most |
//! | proposing | the branch is passed | idle | the next branch is put off half as far again, unless it pleaded |
//! | proposing | gave way | idle | another way is looked for at once |
//! | on its way | every 5 s: a way that costs a second less | proposing | the proposal is said |
//!
//! # Complexity
//! A proposal costs the candidates of [`Detours`] until one is clear, each held against
//! all others.

use super::promises::{Brief, Promise, Promises, Rank, Settled, Statement};
use crate::PeerId;
use crate::wire::limits::ACCEPTS_MAX;
use serde::{Deserialize, Serialize};
use skein_flight::separation::{Detour, Detours, End, Motion, MotionPlan, first_loss_s};
use skein_geometry::frame::Point;
use skein_geometry::math::seconds;
use std::collections::{BTreeMap, BTreeSet};

/// How far ahead of now a proposal turns off at first, and at most once one was agreed,
/// milliseconds: what one exchange takes when each of its messages is half a second late and one
/// of them has to be repeated.
const LEAD_FIRST_MS: u64 = 2_000;

/// And at least, milliseconds: where nothing is late or lost an exchange takes a third of that.
const LEAD_LEAST_MS: u64 = 1_000;

/// The farthest it is put off when answers do not come, milliseconds: with a third of all
/// messages lost, thirty others have answered within that time nearly always.
const LEAD_MOST_MS: u64 = 9_000;

/// A flight from the ground is asked for at most so long before it begins, milliseconds: the
/// longest lead, what is kept for two percepts, and a clock that is fast.
const AHEAD_MOST_MS: u64 = LEAD_MOST_MS + 2_000;

/// After a search without a way the next one waits for so long, milliseconds: by then
/// others have moved by half their separation.
const SEARCH_AGAIN_MS: u64 = 1_000;

/// A shorter way is looked for this often, milliseconds: evasions free what they went round
/// in some seconds.
const IMPROVE_MS: u64 = 5_000;

/// And proposed if it costs this much less than the flying time that is left, seconds: less
/// is not worth the messages.
const WORTH_S: f64 = 1.0;

/// A promise as it is sent.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct PromisedPlan {
    /// Its number among the promises of its author.
    pub version: u32,
    /// What is promised.
    pub plan: MotionPlan,
}

/// A [`Statement`] as it is sent: motions as their plans.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Intent {
    /// Number of the statement: the newest counts.
    pub number: u32,
    /// Endurance when the mission began, seconds: who has less goes before.
    pub endurance_s: u32,
    /// What is flown.
    pub in_force: PromisedPlan,
    /// What would rather be flown.
    pub proposal: Option<PromisedPlan>,
    /// Which version of whom is accepted, while that is on offer, ascending by peer.
    pub accepts: Vec<(PeerId, u32)>,
}

impl Intent {
    /// Whether its author is on the ground, and asks for a flight from there.
    #[must_use]
    pub fn asks_to_take_off(&self) -> bool {
        let flown = &self.in_force.plan;
        let stands = flown.stretches.is_empty() && flown.end == End::Leaves;
        self.proposal.is_some() && stands
    }
}

/// Where a UAV wants to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    /// The place.
    pub goal: Point,
    /// What it does there.
    pub then: End,
}

/// How this UAV is kept apart from others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// Ways that its airframe can fly; and the separation.
    pub detours: Detours,
    /// How far any two may stray from their promises together, metres: kept on top.
    pub tubes_m: f64,
    /// The radius on which UAVs circle that answer nothing, metres.
    pub circle_radius_m: f64,
    /// Without it all who are known are asked.
    pub reach: Option<Reach>,
}

/// How far UAVs get before they are heard again: who is farther off need not be asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// How far anybody gets on what it has in force, its circle included, metres.
    pub promised_m: f64,
    /// The fastest airspeed of all, m/s.
    pub fastest_mps: f64,
}

/// Those who answer nothing, circle, and need not be asked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Silent {
    /// All of them.
    pub all: BTreeSet<PeerId>,
    /// Those of them who circle elsewhere than they promised.
    pub elsewhere: BTreeMap<PeerId, Stay>,
}

/// Where somebody stays who circles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stay {
    /// Where it is.
    pub at: Point,
    /// The middle of all places at which it was meanwhile.
    pub centre: Point,
    /// How far they lie from there at most, metres.
    pub radius_m: f64,
}

/// Whom a UAV lets pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InTheWay {
    /// Those who go before it.
    OfThoseBefore,
    /// All: it has nothing to do.
    OfAnybody,
}

/// Where another UAV was seen last.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sighting {
    at: Point,
    at_ms: u64,
}

impl Apart {
    /// A test whether two motions keep apart from a moment on.
    fn since(self, now_ms: u64) -> impl Fn(&Motion, &Motion) -> bool {
        let least_m = self.detours.separation_m + self.tubes_m;
        move |a, b| {
            let begun_ms = now_ms.max(a.plan().start_ms).max(b.plan().start_ms);
            first_loss_s(a, b, begun_ms, least_m).is_none()
        }
    }
}

/// Approach conflicts of one UAV.
#[derive(Clone, Debug)]
pub struct Conflicts {
    promises: Promises<Motion>,
    apart: Apart,
    wish: Option<Wish>,
    /// Whether the motion in force leads to the wish.
    on_way: bool,
    /// When the proposal leaves the motion in force; of no meaning without one.
    branch_ms: u64,
    /// When it was put on offer.
    offered_ms: u64,
    lead_ms: u64,
    search_from_ms: u64,
    /// Where the others were seen last, whether or not they said what they fly.
    seen: BTreeMap<PeerId, Sighting>,
    /// Who is near and answers nothing.
    silent: Silent,
}

impl Conflicts {
    /// A UAV that flies `in_force` and wants nothing else.
    #[must_use]
    pub fn new(id: PeerId, endurance_s: u32, apart: Apart, in_force: Motion) -> Self {
        Self {
            promises: Promises::new((endurance_s, id), in_force),
            apart,
            wish: None,
            on_way: false,
            branch_ms: 0,
            offered_ms: 0,
            lead_ms: LEAD_FIRST_MS,
            search_from_ms: 0,
            seen: BTreeMap::new(),
            silent: Silent::default(),
        }
    }

    /// The same in a later life: what it promises is numbered above `before`.
    #[must_use]
    pub fn after(mut self, before: u32) -> Self {
        let (rank, flown) = (self.promises.rank(), self.promises.in_force().clone());
        self.promises = Promises::after(before, rank, flown);
        self
    }

    /// The same that takes others for near at first: a proposal that comes to nothing costs it
    /// less than a later turn.
    #[must_use]
    pub fn answered_soon(mut self) -> Self {
        self.lead_ms = LEAD_LEAST_MS;
        self
    }

    /// The same by other rules from now on. What is on offer was looked for by those before.
    #[must_use]
    pub fn under(mut self, apart: Apart) -> Self {
        let _ = self.promises.withdraw();
        self.apart = apart;
        self
    }

    /// What is to be flown.
    #[must_use]
    pub fn in_force(&self) -> &Motion {
        self.promises.in_force()
    }

    /// All that is to be said now; said again until something newer is.
    #[must_use]
    pub fn intent(&self) -> Intent {
        let s = self.promises.statement();
        Intent {
            number: s.number,
            endurance_s: s.endurance_s,
            in_force: sent(&s.in_force),
            proposal: s.proposal.as_ref().map(sent),
            accepts: s.accepts.into_iter().take(ACCEPTS_MAX).collect(),
        }
    }

    /// The same without motions, for those who know them.
    #[must_use]
    pub fn brief(&self) -> Brief {
        let mut brief = self.promises.brief();
        brief.accepts.truncate(ACCEPTS_MAX);
        brief
    }

    /// A statement without motions. Returns whether there is something new to say.
    pub fn hear_brief(&mut self, author: PeerId, said: &Brief, now_ms: u64) -> bool {
        let _ = self.promises.hear_brief(author, said);
        let flown = self.promises.flown_by(author);
        if let Some(motion) = flown.filter(|m| !m.has_left(now_ms)) {
            let at = motion.pose_at(now_ms).position();
            self.saw(author, at, now_ms);
        }
        self.settle(now_ms).news
    }

    /// From now on it wants to go there.
    pub fn wish(&mut self, wish: Option<Wish>) {
        self.wish = wish;
        self.on_way = false;
        self.search_from_ms = 0;
    }

    /// Another UAV was somewhere. Until it is heard again it may be as far from there as it
    /// flies meanwhile, and gets on what it has in force.
    pub fn saw(&mut self, id: PeerId, at: Point, at_ms: u64) {
        let sighting = Sighting { at, at_ms };
        let known = self.seen.entry(id).or_insert(sighting);
        if known.at_ms <= at_ms {
            *known = sighting;
        }
    }

    /// All UAVs near by are where they are sensed; nobody else is near enough to be asked.
    pub fn sensed(&mut self, others: impl Iterator<Item = (PeerId, Point)>, at_ms: u64) {
        self.seen = others
            .map(|(id, at)| (id, Sighting { at, at_ms }))
            .collect();
    }

    /// These answer nothing, and circle.
    pub fn are_silent(&mut self, others: Silent) {
        self.silent = others;
    }

    /// Another UAV begins anew: what it said before is void.
    pub fn begins_anew(&mut self, id: PeerId) {
        self.promises.forget_one(id);
    }

    /// What another UAV said is of no meaning any more; it may be near all the same.
    pub fn forget(&mut self, id: PeerId) {
        self.promises.forget_one(id);
    }

    /// Another UAV is in nobody's way any more.
    pub fn is_gone(&mut self, id: PeerId) {
        self.promises.forget_one(id);
        self.seen.remove(&id);
    }

    /// What another UAV flies, as far as is known.
    #[must_use]
    pub fn flown_by(&self, id: PeerId) -> Option<&Motion> {
        self.promises.flown_by(id)
    }

    /// Those of whom it is known.
    pub fn speakers(&self) -> impl Iterator<Item = PeerId> {
        self.promises.speakers()
    }

    /// Whether it is known of one.
    #[must_use]
    pub fn knows(&self, id: PeerId) -> bool {
        self.promises.knows(id)
    }

    /// All that one may fly: what is in force as far as was heard, and what was accepted here.
    pub fn may_fly(&self, id: PeerId) -> impl Iterator<Item = &Motion> {
        self.promises.may_fly(id)
    }

    /// The UAV is not where it was to be: from now on it flies this, whatever others say.
    pub fn impose(&mut self, motion: Motion) {
        self.promises.impose(motion);
    }

    /// The number of the promise that is flown.
    #[must_use]
    pub fn version(&self) -> u32 {
        self.promises.version()
    }

    /// Whether something is on offer.
    #[must_use]
    pub fn is_proposing(&self) -> bool {
        self.promises.proposal().is_some()
    }

    /// Withdraws what is on offer. Returns whether there was anything.
    pub fn withdraw(&mut self) -> bool {
        self.promises.withdraw()
    }

    /// How long before it turns off a motion has to be offered, milliseconds.
    #[must_use]
    pub fn lead_ms(&self) -> u64 {
        self.lead_ms
    }

    /// Offers the first of some motions that keeps clear, each with the time until which it
    /// has to be agreed; of ways aside, the first that also lets pass whoever is held up.
    /// Returns which.
    pub fn offer<'a>(
        &mut self,
        now_ms: u64,
        motions: impl IntoIterator<Item = (&'a MotionPlan, u64)>,
        aside: Option<InTheWay>,
    ) -> Option<usize> {
        let apart = self.apart.since(now_ms);
        let suits = |motion: &Motion| {
            let passes = |others| self.held_up(now_ms, others).all(|m| apart(motion, &m));
            self.keeps_off_silent(motion, now_ms)
                && self.promises.is_clear(motion, &apart)
                && aside.is_none_or(passes)
        };
        let (nth, until_ms, motion) =
            motions
                .into_iter()
                .enumerate()
                .find_map(|(nth, (plan, until_ms))| {
                    let motion = Motion::new(plan.clone()).ok()?;
                    suits(&motion).then_some((nth, until_ms, motion))
                })?;
        self.note_offer(now_ms, until_ms);
        self.promises.propose(motion);
        Some(nth)
    }

    /// Offers the first of some motions though it does not keep clear, so that whoever is in
    /// its way and has nothing to do makes room.
    pub fn plead<'a>(
        &mut self,
        now_ms: u64,
        motions: impl IntoIterator<Item = (&'a MotionPlan, u64)>,
    ) -> Option<usize> {
        let possible = |(nth, (plan, until_ms)): (usize, (&MotionPlan, u64))| {
            let motion = Motion::new(plan.clone()).ok()?;
            let off = self.keeps_off_silent(&motion, now_ms);
            off.then_some((nth, until_ms, motion))
        };
        let (nth, until_ms, motion) = motions.into_iter().enumerate().find_map(possible)?;
        self.note_offer(now_ms, until_ms);
        self.promises.plead(motion);
        Some(nth)
    }

    /// Whether a motion is in the way of somebody who has circled since a time: most likely it
    /// has nothing to do.
    #[must_use]
    pub fn meets_who_circles(&self, plan: &MotionPlan, now_ms: u64, since_ms: u64) -> bool {
        let Ok(motion) = Motion::new(plan.clone()) else {
            return false;
        };
        let apart = self.apart.since(now_ms);
        self.seen.keys().any(|id| {
            let flown = self.promises.flown_by(*id);
            let circles = flown.filter(|m| m.ends_at_s() <= seconds(since_ms));
            circles.is_some_and(|m| !apart(&motion, m))
        })
    }

    /// Whether what others propose is held up by what is flown here, and by nothing else
    /// that this UAV says.
    #[must_use]
    pub fn is_in_the_way(&self, now_ms: u64, of: InTheWay) -> bool {
        self.held_up(now_ms, of).next().is_some()
    }

    /// Whether a motion keeps off the circles of those who answer nothing: of any that leads
    /// through where one is, and for who circles too near to such a one already of that in which
    /// it was seen.
    fn keeps_off_silent(&self, motion: &Motion, now_ms: u64) -> bool {
        let least_m = self.apart.detours.separation_m + self.apart.tubes_m;
        let any_m = least_m + 2.0 * self.apart.circle_radius_m;
        let flown = self.in_force();
        let off = |stay: &Stay| {
            if flown.nearest_to_m(stay.at, now_ms) >= any_m {
                motion.nearest_to_m(stay.at, now_ms) >= any_m
            } else {
                motion.nearest_to_m(stay.centre, now_ms) >= least_m + stay.radius_m
            }
        };
        self.silent.elsewhere.values().all(off)
    }

    fn held_up(&self, now_ms: u64, of: InTheWay) -> impl Iterator<Item = Motion> {
        let apart = self.apart.since(now_ms);
        let mine: Rank = self.promises.rank();
        let all: Vec<Motion> = self
            .promises
            .held_up(&apart)
            .filter(|(rank, _)| of == InTheWay::OfAnybody || *rank < mine)
            .map(|(_, theirs)| theirs.clone())
            .collect();
        all.into_iter()
    }

    /// A statement of another UAV. Returns whether there is something new to say. One that
    /// promises what no fixed wing flies, or begins later than who waits for its launch says,
    /// changes nothing.
    pub fn hear(&mut self, author: PeerId, said: &Intent, now_ms: u64) -> bool {
        let Some(statement) = received(said, now_ms) else {
            return false;
        };
        let flown = &statement.in_force.motion;
        let at = flown.pose_at(now_ms).position();
        let is_up = !flown.has_left(now_ms);
        let is_newer = self.promises.hear(author, &statement);
        if is_newer && is_up {
            self.saw(author, at, now_ms);
        }
        // Who asks again has not heard the answer.
        let again = !is_newer && said.proposal.is_some() && self.promises.has_accepted(author);
        self.settle(now_ms).news || again
    }

    /// Time goes on. Returns whether there is something new to say.
    pub fn tick(&mut self, now_ms: u64) -> bool {
        self.promises.forget(|m| m.has_left(now_ms));
        let mut news = self.settle(now_ms).news;
        let pleaded = self.promises.pleads();
        if now_ms > self.branch_ms && self.promises.withdraw() {
            if !pleaded {
                self.lead_ms = (self.lead_ms * 3 / 2).min(LEAD_MOST_MS);
            }
            self.search_from_ms = now_ms;
            news = true;
        }
        if self.promises.proposal().is_none() && now_ms >= self.search_from_ms {
            news |= self.propose(now_ms);
        }
        news
    }

    fn settle(&mut self, now_ms: u64) -> Settled {
        let far = |id: &&PeerId| !self.is_asked(**id, now_ms);
        let far: BTreeSet<PeerId> = self.seen.keys().filter(far).copied().collect();
        // Who is seen and has not said what it flies cannot be asked yet.
        let is_silent = |id: &PeerId| self.silent.all.contains(id);
        let strangers = self
            .seen
            .keys()
            .any(|id| !far.contains(id) && !is_silent(id) && !self.promises.knows(*id));
        // Who fell silent since it was offered has not accepted it.
        let keeps_off = |own| self.keeps_off_silent(own, now_ms);
        let keeps_off = self.promises.proposal().is_none_or(keeps_off);
        let may_adopt = now_ms <= self.branch_ms && !strangers && keeps_off;
        let by_distance = self.apart.reach.is_some();
        let near = |id: PeerId| !by_distance || self.seen.contains_key(&id);
        let is_asked = |id: PeerId| near(id) && !far.contains(&id) && !is_silent(&id);
        let apart = self.apart.since(now_ms);
        let settled = self.promises.settle(may_adopt, &is_asked, &apart);
        if settled.gave_way {
            self.search_from_ms = now_ms;
        }
        if settled.adopted {
            self.on_way = true;
            let took_ms = now_ms.saturating_sub(self.offered_ms);
            // Where nobody was asked nothing is known of how late answers are.
            let least_ms = if took_ms > 0 {
                2 * took_ms
            } else {
                self.lead_ms
            };
            self.lead_ms = least_ms.clamp(LEAD_LEAST_MS, LEAD_FIRST_MS);
            self.search_from_ms = now_ms + IMPROVE_MS;
        }
        settled
    }

    /// Who is near and answers nothing: nobody waits for their word.
    pub fn silent(&self) -> impl Iterator<Item = PeerId> {
        self.silent.all.iter().copied()
    }

    /// Whose word what is on offer waits for: who may be met and has not accepted it, or has not
    /// said what it flies.
    pub fn waits_for(&self, now_ms: u64) -> impl Iterator<Item = PeerId> {
        let may_be_met = move |id: &PeerId| {
            self.is_asked(*id, now_ms) && !self.silent.all.contains(id) && self.promises.lacks(*id)
        };
        self.seen.keys().copied().filter(may_be_met)
    }

    /// Whether another UAV may come near on what this one proposes, before either hears of
    /// the other's next promise.
    fn is_asked(&self, id: PeerId, now_ms: u64) -> bool {
        let (Some(reach), Some(seen)) = (self.apart.reach, self.seen.get(&id)) else {
            return true;
        };
        let Some(proposal) = self.promises.proposal() else {
            return true;
        };
        let (mine, own_m) = proposal.extent_from(now_ms);
        let flown_m = reach.fastest_mps * seconds(now_ms.saturating_sub(seen.at_ms));
        let least_m = self.apart.detours.separation_m + self.apart.tubes_m;
        (mine - seen.at).norm() < own_m + flown_m + reach.promised_m + least_m
    }

    /// Something is put on offer now, that has to be agreed until a time.
    fn note_offer(&mut self, now_ms: u64, until_ms: u64) {
        self.offered_ms = now_ms;
        self.branch_ms = until_ms;
    }

    /// Looks for a way to what is wanted, and proposes it.
    fn propose(&mut self, now_ms: u64) -> bool {
        let Some(wish) = self.wish else {
            return false;
        };
        let again_ms = if self.on_way {
            IMPROVE_MS
        } else {
            SEARCH_AGAIN_MS
        };
        self.search_from_ms = now_ms + again_ms;
        let branch_ms = now_ms + self.lead_ms;
        if self.in_force().has_left(branch_ms) {
            return false;
        }
        let Some(motion) = self.search(wish, now_ms, branch_ms) else {
            return false;
        };
        self.note_offer(now_ms, branch_ms);
        self.promises.propose(motion);
        // Where nobody has to be asked it is agreed already.
        let _ = self.settle(now_ms);
        true
    }

    /// The cheapest way that is clear; for who is on its way, only one that is worth it.
    fn search(&self, wish: Wish, now_ms: u64, branch_ms: u64) -> Option<Motion> {
        let flown = self.in_force();
        let from = flown.pose_at(branch_ms);
        let left_s = flown.ends_at_s() - seconds(branch_ms);
        let most_s = if self.on_way {
            left_s - WORTH_S
        } else {
            f64::INFINITY
        };
        let apart = self.apart.since(now_ms);
        let clear = |way: &Detour| {
            let plan = flown.branched(now_ms, branch_ms, &way.stretches, wish.then);
            let motion = Motion::new(plan).ok()?;
            self.promises.is_clear(&motion, &apart).then_some(motion)
        };
        let detours = self.apart.detours;
        if detours.least_cost_s(from, wish.goal) > most_s {
            return None;
        }
        let mut ways = detours.ways(from, wish.goal, most_s);
        ways.find_map(|way| clear(&way))
    }
}

fn sent(promise: &Promise<Motion>) -> PromisedPlan {
    PromisedPlan {
        version: promise.version,
        plan: promise.motion.plan().clone(),
    }
}

fn received(said: &Intent, now_ms: u64) -> Option<Statement<Motion>> {
    let promise = |p: &PromisedPlan| {
        let begins = p.plan.start_ms <= now_ms + AHEAD_MOST_MS;
        let motion = Motion::new(p.plan.clone()).ok().filter(|_| begins)?;
        Some(Promise {
            version: p.version,
            motion,
        })
    };
    let proposal = match &said.proposal {
        None => None,
        Some(p) => Some(promise(p)?),
    };
    Some(Statement {
        number: said.number,
        endurance_s: said.endurance_s,
        in_force: promise(&said.in_force)?,
        proposal,
        accepts: said.accepts.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_flight::airframe::{Airframe, CLIMB_MPS};
    use skein_flight::mount::Mount;
    use skein_flight::separation::Stretch;

    const LOITER: End = End::Loiter {
        radius_mm: -75_000,
        airspeed_mmps: 20_000,
    };

    /// A UAV that flies straight for ten seconds, then loiters, and wants on to a goal.
    fn uav(id: u16, east_m: i32, heading_e7: i32, goal: Point) -> Conflicts {
        let apart = Apart {
            detours: Detours {
                airframe: Airframe {
                    stall_mps: 13.0,
                    cruise_mps: 20.0,
                    max_mps: 26.0,
                    max_bank_rad: 0.52,
                    endurance_s: 3600.0,
                    reserve_s: 300.0,
                    footprint_across_m: 40.0,
                    footprint_along_m: 30.0,
                    mount: Mount::Level,
                    climb_mps: CLIMB_MPS,
                },
                separation_m: 50.0,
            },
            tubes_m: 4.0,
            circle_radius_m: 75.0,
            reach: None,
        };
        let motion = Motion::new(MotionPlan {
            start_ms: 0,
            east_mm: east_m * 1_000,
            north_mm: 0,
            heading_e7,
            stretches: vec![Stretch {
                radius_mm: 0,
                length_mm: 200_000,
                airspeed_mmps: 20_000,
            }],
            end: LOITER,
        });
        let mut uav = Conflicts::new(PeerId(id), 0, apart, motion.unwrap());
        uav.wish(Some(Wish { goal, then: LOITER }));
        uav
    }

    fn head_on() -> (Conflicts, Conflicts) {
        let mut a = uav(1, -600, 0, Point::new(600.0, 0.0));
        let mut b = uav(2, 600, 31_415_926, Point::new(-600.0, 0.0));
        let _ = a.hear(PeerId(2), &b.intent(), 0);
        let _ = b.hear(PeerId(1), &a.intent(), 0);
        (a, b)
    }

    #[test]
    fn who_is_alone_needs_nobody() {
        let mut a = uav(1, -600, 0, Point::new(600.0, 0.0));
        assert!(a.tick(0));
        assert!(a.in_force().ends_at_s() > 50.0, "on its way at once");
        assert_eq!(a.intent().proposal, None);
    }

    #[test]
    fn two_agree_with_four_statements() {
        let (mut a, mut b) = head_on();
        assert!(a.tick(0) && b.tick(0), "both propose to fly straight on");
        // The second hears the first and gives way, looks anew and accepts.
        assert!(b.hear(PeerId(1), &a.intent(), 100));
        let _ = b.tick(100);
        // The first hears both at once, and flies; then the second does.
        assert!(a.hear(PeerId(2), &b.intent(), 200));
        assert!(a.in_force().ends_at_s() > 50.0);
        assert!(b.hear(PeerId(1), &a.intent(), 300));
        assert!(b.in_force().ends_at_s() > 50.0);
        let nearest = first_loss_s(a.in_force(), b.in_force(), 300, 54.0);
        assert_eq!(nearest, None);
    }

    /// How far ahead the first of two turns off whose answers come after this time, milliseconds.
    fn lead_after_ms(took_ms: u64) -> u64 {
        let (mut a, mut b) = head_on();
        b.wish(None);
        // Far enough ahead that there is time for the answer.
        a.lead_ms = LEAD_MOST_MS;
        assert!(a.tick(0) && b.hear(PeerId(1), &a.intent(), 0));
        assert!(a.hear(PeerId(2), &b.intent(), took_ms));
        assert!(!a.is_proposing() && a.in_force().ends_at_s() > 50.0);
        a.lead_ms()
    }

    #[test]
    fn who_was_answered_soon_turns_off_sooner_next_time() {
        assert_eq!(lead_after_ms(200), LEAD_LEAST_MS);
        assert_eq!(lead_after_ms(700), 1_400);
        assert_eq!(lead_after_ms(3_000), LEAD_FIRST_MS);
        // Where nobody is asked nothing is learnt of answers.
        let mut alone = uav(1, -600, 0, Point::new(600.0, 0.0));
        alone.lead_ms = 1_500;
        assert!(alone.tick(0) && !alone.is_proposing());
        assert_eq!(alone.lead_ms(), 1_500);
        // Without an answer it is put off.
        let (mut a, _) = head_on();
        assert_eq!(a.clone().answered_soon().lead_ms(), LEAD_LEAST_MS);
        assert!(a.tick(0) && !a.tick(LEAD_FIRST_MS));
        assert!(a.tick(LEAD_FIRST_MS + 1));
        assert_eq!(a.lead_ms(), LEAD_FIRST_MS * 3 / 2);
    }

    #[test]
    fn who_asks_to_take_off_is_told_from_who_flies_or_asks_nothing() {
        let (mut g, plan) = on_ground(3, 0, 3_000);
        assert!(!g.intent().asks_to_take_off());
        assert_eq!(g.offer(200, [(&plan, 2_400)], None), Some(0));
        assert!(g.intent().asks_to_take_off());
        let (mut a, _) = head_on();
        assert!(a.tick(0) && a.is_proposing() && !a.intent().asks_to_take_off());
    }

    #[test]
    fn without_an_answer_the_promise_stands() {
        let (mut a, b) = head_on();
        let before = a.in_force().clone();
        for now_ms in (0..60_000).step_by(200) {
            let _ = a.tick(now_ms);
        }
        assert_eq!(a.in_force(), &before);
        // An answer to what was withdrawn long ago changes nothing either.
        let mut late = b.intent();
        late.number = 9;
        late.accepts = vec![(PeerId(1), 2)];
        let _ = a.hear(PeerId(2), &late, 60_000);
        assert_eq!(a.in_force(), &before);
    }

    /// The same on the ground, ready to fly that straight line from a time on.
    fn on_ground(id: u16, east_m: i32, from_ms: u64) -> (Conflicts, MotionPlan) {
        let flies = uav(id, east_m, 0, Point::new(9_000.0, 0.0));
        let mut plan = flies.in_force().plan().clone();
        plan.start_ms = from_ms;
        let stands = MotionPlan::on_ground(0, flies.in_force().pose_at(0));
        let stands = Motion::new(stands).unwrap();
        (Conflicts::new(PeerId(id), 0, flies.apart, stands), plan)
    }

    #[test]
    fn who_stands_is_in_nobodys_way_and_takes_off_when_those_who_fly_agree() {
        let (mut a, _) = head_on();
        let (mut g, plan) = on_ground(3, 0, 3_000);
        // It has said that it stands, nobody asks it.
        assert!(!a.hear(PeerId(3), &g.intent(), 100) || !a.is_proposing());
        assert!(!a.seen.contains_key(&PeerId(3)));
        g.sensed([(PeerId(1), Point::new(-600.0, 0.0))].into_iter(), 200);
        let _ = g.hear(PeerId(1), &a.intent(), 200);
        assert_eq!(g.offer(200, [(&plan, 2_400)], None), Some(0));
        assert!(a.hear(PeerId(3), &g.intent(), 300), "it is accepted");
        let _ = a.tick(400);
        assert!(g.in_force().has_left(400));
        assert!(g.hear(PeerId(1), &a.intent(), 500));
        assert!(!g.in_force().has_left(500), "it takes off then");
        // From now on it is asked like all others.
        let _ = a.hear(PeerId(3), &g.intent(), 600);
        assert!(a.seen.contains_key(&PeerId(3)) && a.flown_by(PeerId(3)).is_some());
    }

    /// One circles, with nothing to do, where another one wants to take off; and the take-off.
    fn in_the_way() -> (Conflicts, Conflicts, MotionPlan) {
        let mut a = uav(1, -100, 0, Point::new(600.0, 0.0));
        a.wish(None);
        let (mut g, plan) = on_ground(3, 0, 12_000);
        g.sensed([(PeerId(1), Point::new(0.0, 0.0))].into_iter(), 9_200);
        let _ = g.hear(PeerId(1), &a.intent(), 9_200);
        (a, g, plan)
    }

    #[test]
    fn who_pleads_is_made_room_for() {
        let (mut a, mut g, plan) = in_the_way();
        assert_eq!(g.offer(9_200, [(&plan, 11_400)], None), None);
        assert!(!a.is_in_the_way(9_200, InTheWay::OfAnybody));
        let ends_ms = (a.in_force().ends_at_s() * 1e3).ceil() as u64;
        assert!(g.meets_who_circles(&plan, 9_200, ends_ms));
        assert!(ends_ms == 0 || !g.meets_who_circles(&plan, 9_200, ends_ms - 1));
        assert_eq!(g.plead(9_200, [(&plan, 11_400)]), Some(0));
        assert!(!g.tick(9_400) && g.is_proposing(), "it stays on offer");
        let _ = a.hear(PeerId(3), &g.intent(), 9_500);
        assert!(a.is_in_the_way(9_500, InTheWay::OfAnybody));
        let _ = g.hear(PeerId(1), &a.intent(), 9_600);
        assert!(g.in_force().has_left(9_600), "and is not agreed");
        let _ = g.tick(11_500);
        assert!(!g.is_proposing());
        assert_eq!(g.lead_ms(), LEAD_FIRST_MS, "answers were not late");
    }

    #[test]
    fn what_pleads_with_who_is_silent_is_not_flown() {
        let (_, mut g, plan) = in_the_way();
        // It circles where it promised to, and nobody asks it.
        g.are_silent(Silent {
            all: [PeerId(1)].into(),
            elsewhere: BTreeMap::new(),
        });
        assert_eq!(g.plead(9_200, [(&plan, 11_400)]), Some(0));
        let _ = g.tick(9_400);
        assert!(g.is_proposing() && g.in_force().has_left(9_400));
    }

    #[test]
    fn by_other_rules_what_is_in_force_stands_and_statements_go_on() {
        let (mut a, _) = head_on();
        assert!(a.tick(0) && a.is_proposing());
        let (before, flown) = (a.intent(), a.in_force().clone());
        let apart = a.apart;
        let a = a.under(apart);
        assert!(!a.is_proposing() && a.in_force() == &flown);
        // Of a lower number it would not be heard.
        assert!(a.intent().number > before.number);
    }

    fn circle_at(there: [(PeerId, Point); 1]) -> Silent {
        let stay = |at| Stay {
            at,
            centre: at,
            radius_m: 0.0,
        };
        Silent {
            all: there.iter().map(|(id, _)| *id).collect(),
            elsewhere: there.map(|(id, at)| (id, stay(at))).into(),
        }
    }

    /// Any circle through where it is would reach to who circles near it: so it would never leave.
    #[test]
    fn who_circles_beside_one_who_is_silent_leaves_by_the_far_side() {
        let (mut a, _) = head_on();
        let flown = a.in_force().clone();
        // A place so far from all that it flies.
        let place = |away_m: f64| {
            let east = (0..1_000).map(|m| Point::new(600.0 - f64::from(m), 0.0));
            let mut near = east.skip_while(|p| flown.nearest_to_m(*p, 0) > away_m);
            near.next().unwrap()
        };
        let least_m = a.apart.detours.separation_m + a.apart.tubes_m;
        let any_m = least_m + 2.0 * a.apart.circle_radius_m;
        let mut off = |away_m: f64| {
            let at = place(away_m);
            let seen = Stay {
                at,
                centre: Point::new(at.x + 20.0, at.y),
                radius_m: 20.0,
            };
            a.are_silent(Silent {
                all: [PeerId(2)].into(),
                elsewhere: [(PeerId(2), seen)].into(),
            });
            a.keeps_off_silent(&flown, 0)
        };
        assert!(off(any_m + 50.0));
        // Nearer than any circle may be, and clear of the one that was seen; and too near to it.
        assert!(off(any_m - 10.0) && !off(least_m - 10.0));
    }

    #[test]
    fn who_fell_silent_since_has_not_accepted() {
        let (mut a, _) = head_on();
        assert!(a.tick(0) && a.is_proposing());
        let before = a.in_force().clone();
        let there = [(PeerId(2), Point::new(0.0, 0.0))];
        a.sensed(there.into_iter(), 200);
        a.are_silent(circle_at(there));
        let _ = a.tick(400);
        assert_eq!(a.in_force(), &before, "it circles where this would fly");
        let aside = [(PeerId(2), Point::new(0.0, 900.0))];
        a.are_silent(circle_at(aside));
        let _ = a.tick(600);
        assert_ne!(a.in_force(), &before);
    }

    #[test]
    fn what_cannot_be_flown_or_has_not_begun_changes_nothing() {
        let (mut a, b) = head_on();
        let before = a.intent();
        let mut said = b.intent();
        said.number = 7;
        said.in_force.plan.stretches[0].airspeed_mmps = 0;
        assert!(!a.hear(PeerId(2), &said, 100));
        let mut said = b.intent();
        said.number = 7;
        said.in_force.plan.start_ms = 12_000;
        assert!(!a.hear(PeerId(2), &said, 100));
        assert_eq!(a.intent(), before);
    }
}
