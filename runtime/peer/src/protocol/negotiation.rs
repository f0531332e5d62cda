//! When the rules of [`super::sections`] and [`super::rounds`] are used: the only
//! part of the negotiation that knows time.
//!
//! | what is seen | for how long | what follows |
//! |---|---|---|
//! | a member is lost and cells are orphaned | at once | a repair |
//! | orphans | 2 T (5 T after a decision) | a repair |
//! | an open round with a member that is gone, or left for another loop | at once | the next round |
//! | an open round without all bids | W, doubling to 4 W0 | the next round |
//! | a rebalancing whose time was over while this peer could not fly | once it can | nothing |
//! | a complete round without its division | 2 W | the next round |
//! | nothing divided yet | 1.5 T of listening, with a roster at once | a first section is taken |
//! | only first sections, among few | 2 T | a repair |
//! | orphans, and no round helped | 2 T + W0 + rank T/2 | the nearest are taken |
//! | orphans, among many | 2 T each; 2 T for each who would be there sooner (W0 at most), and no less than the first of them would be there sooner | the nearest are taken |
//! | orphans, among many, that nobody took who is idle | 2 T + W0; 2 T for each at work who would be there sooner (W0/2 at most) | a share is taken, of as many runs as it takes, the nearest first |
//! | less than 2 T to fly, among many | twice a T | the far part of a slower one's plan is taken |
//! | idle, and a gain was computed from what is held | 10 T steady, 20 T calm | a rebalancing |
//! | idle, an owner makes no progress | its bound | the far half is taken |
//! | idle, cells were beyond everybody | 10 T + rank T/2 | what the fuel allows of one run is taken |
//! | cells held | 2 W | they expire |

mod orphaned;
mod takes;

use super::division;
use super::rounds::{HeardBid, OpenRound, Rounds};
use super::runs::{PlannedCell, unpack};
use super::sections::{LivePeers, Sections};
use crate::Time;
use crate::cells::CellSet;
use crate::wire::limits::{HOPS_MAX, MEMBERS_MAX};
use crate::wire::message::{Bid, Epoch, Member};
use orphaned::OrphanedAt;
use skein_flight::coverage::ring::CoverageLoop;
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use std::collections::{BTreeMap, BTreeSet};

/// Time in which an owner at work covers two cells, milliseconds: at the slowest ground
/// speed that missions are flown at, 8 m/s, two cells of 48 m take 12 s. An owner that
/// covers none for thrice what the bound makes of it, and comes no nearer, has stalled.
const TWO_CELLS_MS: u64 = 12_000;

/// The shortest wait, in intervals: for members that stay the same before the first division,
/// for orphans, for an empty plan. Two, so that one lost beacon or claim changes nothing.
const SHORT_INTERVALS: u64 = 2;

/// After a decision cells count as orphans only after so many intervals: the new owner's
/// claim takes one to be stored, two to be spoken and passed on, and two more if it is
/// lost once.
pub const SETTLE_INTERVALS: u64 = 5;

/// A return, a join or an idle peer waits for so many intervals: shorter absences are the
/// rule on a lossy channel.
const PATIENT_INTERVALS: u64 = 10;

/// Rebalancings are at least so many intervals apart.
const CALM_INTERVALS: u64 = 20;

/// Who has nothing to fly and heard of no division for so many intervals waits for no calm any
/// more: where links come and go with the circles that all of them fly there is none.
const UNDIVIDED_INTERVALS: u64 = 3 * PATIENT_INTERVALS;

/// What a living owner lists no more is covered, or listed by somebody else whose claim may be on
/// the way: for half an interval at each hop beyond the first it is no orphan.
fn claims_on_the_way_ms(ctx: &Context<'_>) -> u64 {
    u64::from(ctx.diameter.saturating_sub(1)) * ctx.interval_ms / 2
}

/// The waiting time of a round doubles with each retry, up to this many doublings: a bid
/// that four waiting times do not bring is not on its way.
const MAX_DOUBLINGS: u32 = 2;

/// Peers begin rounds one after the other by rank, this part of an interval apart: the
/// first one's bid is heard before the third would begin.
const ROUND_STAGGER: u64 = 8;

/// What the rest of the peer knows that the negotiation needs.
#[derive(Clone, Debug)]
pub struct Context<'a> {
    /// The peer's time.
    pub now: Time,
    /// The swarm's interval T', milliseconds: the longest that anybody alive announced. Every
    /// wait below counts in it.
    pub interval_ms: u64,
    /// The others whose claims count.
    pub live: &'a LivePeers,
    /// Whether they may be others than at the last tick.
    pub live_changed: bool,
    /// Planning members, this peer included if it is able; ascending.
    pub members: &'a [Member],
    /// How many more are taken for live because they were to be launched, and not heard of.
    pub unheard: usize,
    /// Who of the live said that it works on another loop, and since when that is known.
    pub elsewhere: &'a BTreeMap<u16, Time>,
    /// Hop diameter of the component.
    pub diameter: u32,
    /// Since when this peer is able without a break.
    pub able_since: Option<Time>,
    /// Mission revision.
    pub revision: u32,
    /// The loop.
    pub loop_hash: u64,
    /// Whether the cells held ran out of time just now.
    pub held_expired: bool,
    /// Whether a division of what claims list would end the work sooner; asked for by
    /// [`Negotiation::take_foresight`].
    pub gain_in_sight: bool,
}

impl Context<'_> {
    /// W0 = (2D + 3) T', milliseconds: a bid crosses the component, the answer
    /// comes back, and three intervals for what is lost on the way.
    #[must_use]
    pub fn first_wait_ms(&self) -> u64 {
        wait_ms(self.diameter, self.interval_ms)
    }

    /// How many UAVs share the work: the members, and who was launched and is not heard yet.
    #[must_use]
    pub fn uavs(&self) -> usize {
        self.members.len() + self.unheard
    }

    /// Whether they are too many for rounds.
    #[must_use]
    pub fn is_many(&self) -> bool {
        are_many(self.uavs())
    }
}

fn wait_ms(diameter: u32, interval_ms: u64) -> u64 {
    (2 * u64::from(diameter) + 3) * interval_ms
}

/// What the negotiation wants done.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Make a bid for the open round, make it durable, then call
    /// [`Negotiation::on_bid_durable`].
    Bid,
    /// Divide this, then call [`Negotiation::divided`].
    Divide {
        /// The round's epoch, which names the answer.
        epoch: Epoch,
        /// The loop's cells.
        ring: Vec<RingCell>,
        /// The members.
        uavs: Vec<Uav>,
    },
    /// Make these takes durable, then call [`Negotiation::append_take`], or if they cannot be
    /// [`Negotiation::cancel_take`].
    Take(Vec<PlannedCell>),
    /// The own claim changed: publish it and fly by it.
    Changed,
}

/// A division that this peer is to make durable and then adopt.
#[derive(Clone, Debug, PartialEq)]
pub struct Adoption {
    /// The round.
    pub epoch: Epoch,
    /// Committed cells, then the new section, in order of flight.
    pub plan: Vec<PlannedCell>,
    /// Cells nobody has the endurance for.
    pub unassigned: Vec<u16>,
    /// Waiting time of the round, milliseconds.
    pub wait_ms: u32,
}

#[derive(Clone, Debug)]
struct Dividing {
    epoch: Epoch,
    ring: Vec<RingCell>,
}

/// How another peer gets on with its plan, as far as heard.
#[derive(Clone, Copy, Debug)]
struct Progress {
    left: usize,
    /// When a cell was covered, or the owner was seen to come nearer, and what it had left to
    /// fly then.
    since: Time,
    eta_ms: u64,
    bound: Time,
    epoch: Epoch,
    /// The claim heard last, and when its author expects to be done.
    seq: u32,
    end: Time,
}

/// One peer's part in all negotiations of one mission.
#[derive(Clone, Debug)]
pub struct Negotiation {
    /// Who has which cells.
    pub sections: Sections,
    /// Bids.
    pub rounds: Rounds,
    me: u16,
    needless: CellSet,
    opened_at: Time,
    retries: u32,
    bid_wanted: bool,
    dividing: Option<Dividing>,
    /// Cells that nobody lists, as of the last tick.
    orphans: CellSet,
    orphan_since: Option<Time>,
    /// Since when this peer has nothing to fly, and nothing was divided on this loop, as far as
    /// it knows.
    undivided_since: Option<Time>,
    /// Among many, since when each of them is one.
    orphaned_at: OrphanedAt,
    somebody_gone: bool,
    decided_at: Option<Time>,
    adopted_at: Option<Time>,
    /// Whether this peer covered any cell since.
    progressed: bool,
    take_pending: bool,
    idle_since: Option<Time>,
    progress: BTreeMap<u16, Progress>,
    /// The last cell that each of them listed: where it stays when it has nothing to fly.
    ends_at: BTreeMap<u16, u16>,
    members: Vec<Member>,
    members_since: Time,
    foreseen_at: Option<Time>,
    /// Whether this peer looked for a first section.
    began: bool,
    /// Whether what it lists is one that no round has divided yet.
    provisional: bool,
    /// When it last looked for what to take without a round.
    looked_at: Option<Time>,
    /// When cells that were beyond everybody were last looked at.
    left_over_at: Option<Time>,
    /// When the period began in which counters rise by a step.
    period_since: Option<Time>,
    /// Divisions adopted in this life.
    pub adoptions: u32,
}

impl Negotiation {
    /// Nothing negotiated yet. `needless` holds the cells that need no service, the
    /// same at every peer.
    #[must_use]
    pub fn new(me: Member, needless: CellSet, counter: u32) -> Self {
        let cells = needless.capacity();
        Self {
            sections: Sections::new(me.id, cells, needless.clone()),
            rounds: Rounds::new(me, counter),
            me: me.id,
            needless,
            opened_at: Time(0),
            retries: 0,
            bid_wanted: false,
            dividing: None,
            orphans: CellSet::new(cells),
            orphan_since: None,
            undivided_since: None,
            orphaned_at: OrphanedAt::new(cells),
            somebody_gone: false,
            decided_at: None,
            adopted_at: None,
            progressed: false,
            take_pending: false,
            idle_since: None,
            progress: BTreeMap::new(),
            ends_at: BTreeMap::new(),
            members: Vec::new(),
            members_since: Time(0),
            foreseen_at: None,
            began: false,
            provisional: false,
            looked_at: None,
            left_over_at: None,
            period_since: None,
            adoptions: 0,
        }
    }

    /// Somebody is not live any more, or in another life: a UAV or the ground station.
    pub fn note_gone(&mut self) {
        self.somebody_gone = true;
    }

    /// For so long this peer did not listen: bids, claims and progress that it did not hear
    /// meanwhile may have been said.
    pub fn was_late(&mut self, late_ms: u64) {
        let waits = [
            &mut self.orphan_since,
            &mut self.idle_since,
            &mut self.undivided_since,
        ];
        for since in waits.into_iter().flatten() {
            *since = since.plus_ms(late_ms);
        }
        self.opened_at = self.opened_at.plus_ms(late_ms);
        self.orphaned_at.delay(late_ms);
        for progress in self.progress.values_mut() {
            progress.since = progress.since.plus_ms(late_ms);
            progress.bound = progress.bound.plus_ms(late_ms);
        }
    }

    /// This peer itself covered cells.
    pub fn note_covered(&mut self) {
        self.progressed = true;
    }

    /// Whether the last adoption is so long ago that a rebalancing may follow.
    #[must_use]
    pub fn is_calm(&self, now: Time, interval_ms: u64) -> bool {
        let calm_ms = CALM_INTERVALS * interval_ms;
        self.adopted_at.is_none_or(|t| now.since_ms(t) >= calm_ms)
    }

    /// Whether this peer covered any cell since the last adoption.
    #[must_use]
    pub fn progressed(&self) -> bool {
        self.progressed
    }

    /// A bid of this loop was heard.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn hear_bid(&mut self, now: Time, author: Member, bid: &Bid) -> Result<(), &'static str> {
        match self.rounds.hear(author, bid) {
            HeardBid::Refused(why) => return Err(why),
            HeardBid::BidWanted => self.opened(now),
            HeardBid::Added | HeardBid::Nothing => {}
        }
        Ok(())
    }

    fn opened(&mut self, now: Time) {
        self.opened_at = now;
        self.bid_wanted = true;
        self.dividing = None;
    }

    /// The bid is durable. Returns whether it may still be spoken.
    pub fn on_bid_durable(&mut self, bid: Bid) -> bool {
        self.rounds.bid(bid)
    }

    /// Looks at the time and at what is known, and says what is to be done.
    pub fn tick(&mut self, ctx: &Context<'_>, coverage_loop: &CoverageLoop) -> Vec<Action> {
        self.watch_period(ctx);
        let mut actions = Vec::new();
        let heard = self.sections.take_owners();
        let settled = if self.sections.take_gained() || ctx.live_changed {
            self.sections.settle(ctx.live)
        } else {
            self.sections.settle_with(&heard, ctx.live)
        };
        if settled {
            actions.push(Action::Changed);
        }
        if ctx.held_expired && !self.sections.held().is_empty() {
            self.sections.expire_held();
            actions.push(Action::Changed);
        }
        let orphans = self.find_orphans(ctx, &heard);
        self.watch_orphans(ctx, &orphans);
        self.watch_progress(ctx, &heard);
        if ctx.able_since.is_some() && !self.sections.complete() {
            self.run_rounds(ctx, &orphans);
            if let Some(take) = self.inherit(ctx, &orphans, coverage_loop)
                && let Some(taken) = self.begin_take(&take)
            {
                actions.push(Action::Take(taken));
            }
        }
        self.orphans = orphans;
        // Who suspects itself of being deaf acts on a loss once it does no more.
        self.somebody_gone &= ctx.able_since.is_none();
        if core::mem::take(&mut self.bid_wanted) && ctx.able_since.is_some() {
            actions.push(Action::Bid);
        }
        if let Some(divide) = self.divide(coverage_loop) {
            actions.push(divide);
        }
        actions
    }

    /// Cells that nobody lists. Most news takes some away and adds none: then the others are
    /// those that were found before.
    fn find_orphans(&mut self, ctx: &Context<'_>, heard: &BTreeSet<u16>) -> CellSet {
        let mut orphans = core::mem::take(&mut self.orphans);
        let mut gone = orphans.clone();
        if self.sections.take_listing() || ctx.live_changed {
            orphans = self.sections.orphans(ctx.live);
        } else {
            self.sections.still_orphans(&mut orphans, heard, ctx.live);
            debug_assert_eq!(orphans, self.sections.orphans(ctx.live));
        }
        gone.subtract(&orphans);
        for cell in gone.iter() {
            self.orphaned_at.forget(cell);
        }
        orphans
    }

    fn watch_period(&mut self, ctx: &Context<'_>) {
        let since = self.period_since;
        if since.is_none_or(|t| ctx.now.since_ms(t) >= ctx.interval_ms) {
            self.period_since = Some(ctx.now);
            let wait_ms = wait_ms(u32::from(HOPS_MAX), ctx.interval_ms) << MAX_DOUBLINGS;
            let wait_ms = u32::try_from(wait_ms).unwrap_or(u32::MAX);
            self.rounds.new_period(wait_ms);
        }
    }

    fn watch_orphans(&mut self, ctx: &Context<'_>, orphans: &CellSet) {
        if orphans.is_empty() || ctx.able_since.is_none() {
            // Who is not able takes no note of orphans: it may not have heard the claims that
            // list them.
            self.orphan_since = None;
        } else {
            // Cells given to others look orphaned until their claims arrive, so the time
            // counts from the decision.
            self.orphan_since = self.orphan_since.or(Some(ctx.now)).max(self.decided_at);
        }
        // Asked at each look: what was let go earlier and orphaned by a death since has no claim
        // on its way.
        let let_go = self.sections.take_let_go();
        let noted = self.orphaned_at.cells() == orphans;
        if !noted && ctx.is_many() && ctx.able_since.is_some() {
            let found_at = ctx.now.plus_ms(claims_on_the_way_ms(ctx));
            for cell in orphans.iter() {
                let is_listed_elsewhere = let_go.as_ref().is_some_and(|l| l.contains(cell));
                let since = if is_listed_elsewhere {
                    found_at
                } else {
                    ctx.now
                };
                self.orphaned_at.note(cell, since);
            }
        }
        if self.members != ctx.members {
            self.members = ctx.members.to_vec();
            self.members_since = ctx.now;
        }
        let idle = self.sections.plan().is_empty();
        let undivided = idle && self.decided_at.is_none() && !self.sections.complete();
        self.undivided_since = self.undivided_since.or(Some(ctx.now)).filter(|_| undivided);
        self.idle_since = if idle {
            self.idle_since.or(Some(ctx.now))
        } else {
            None
        };
    }

    /// Whether nothing was divided yet, and it has nothing to fly before that.
    pub fn is_undivided(&self) -> bool {
        self.undivided_since.is_some()
    }

    fn rank(&self, ctx: &Context<'_>) -> u64 {
        ctx.members.iter().take_while(|m| m.id != self.me).count() as u64
    }

    /// Opens, retries and abandons rounds.
    fn run_rounds(&mut self, ctx: &Context<'_>, orphans: &CellSet) {
        let orphaned_ms = self.orphan_since.map(|t| ctx.now.since_ms(t));
        if let Some(open) = self.rounds.open() {
            // Who left for another loop since this round was opened answers none on this one.
            let left = |id| ctx.elsewhere.get(&id).is_some_and(|t| *t > self.opened_at);
            let is_gone = |m: &Member| ctx.live.get(&m.id) != Some(&m.incarnation) || left(m.id);
            let others = open.round.members.iter().filter(|m| m.id != self.me);
            let gone = others.clone().any(is_gone);
            let waited = ctx.now.since_ms(self.opened_at);
            let repair = open.round.repair || !orphans.is_empty();
            let patience_ms = self.patience_ms(open);
            let back_ms = ctx.able_since.map_or(0, |t| t.since_ms(self.opened_at));
            if !repair && back_ms > patience_ms {
                // What it wished for then, or others did, is long decided without it.
                self.rounds.give_up();
            } else if gone {
                self.rounds.give_up();
                self.start(ctx, repair, 0);
            } else if waited > patience_ms {
                self.rounds.give_up();
                self.start(ctx, repair, self.retries + 1);
            }
            return;
        }
        // What everybody took at first was divided by nobody.
        let begun_ms = ctx.able_since.filter(|_| self.provisional);
        let begun_ms = begun_ms.map(|t| ctx.now.since_ms(t));
        let Some(orphaned_ms) = orphaned_ms.or(begun_ms) else {
            if ctx.gain_in_sight && self.may_gain(ctx) {
                self.start(ctx, false, 0);
            }
            return;
        };
        // Before its first division a peer waits until nobody new was heard for a while:
        // a swarm that starts together begins with one round, not with many. Whoever knows
        // only itself may not have been heard yet.
        let company = ctx.members.len() > 1;
        let steady =
            company && ctx.now.since_ms(self.members_since) >= SHORT_INTERVALS * ctx.interval_ms;
        let waits = orphaned_ms < PATIENT_INTERVALS * ctx.interval_ms;
        let overdue = self.overdue_ms(ctx).is_some();
        if self.decided_at.is_none() && !steady && waits && !overdue {
            return;
        }
        let settled = self
            .decided_at
            .is_none_or(|t| ctx.now.since_ms(t) >= SETTLE_INTERVALS * ctx.interval_ms);
        let patience = if settled {
            SHORT_INTERVALS
        } else {
            SETTLE_INTERVALS
        } * ctx.interval_ms;
        let stagger = self.rank(ctx) * ctx.interval_ms / ROUND_STAGGER;
        if (self.somebody_gone && settled) || orphaned_ms >= patience + stagger {
            self.start(ctx, true, 0);
        }
    }

    /// For how long, beyond all patience, nothing was divided; none as long as there is patience,
    /// and in a peer that has not listened for a while.
    fn overdue_ms(&self, ctx: &Context<'_>) -> Option<u64> {
        let able_ms = ctx.now.since_ms(ctx.able_since?);
        let undivided_ms = ctx.now.since_ms(self.undivided_since?);
        (able_ms >= SHORT_INTERVALS * ctx.interval_ms)
            .then(|| undivided_ms.checked_sub(UNDIVIDED_INTERVALS * ctx.interval_ms))
            .flatten()
    }

    /// How long an open round is waited for, milliseconds: for its bids, and if they are
    /// all there as long again for the division.
    fn patience_ms(&self, open: &OpenRound) -> u64 {
        let wait_ms = u64::from(open.round.wait_ms);
        if self.rounds.complete().is_some() {
            2 * wait_ms
        } else {
            wait_ms
        }
    }

    fn start(&mut self, ctx: &Context<'_>, repair: bool, retries: u32) {
        if !ctx.members.iter().any(|m| m.id == self.me) || ctx.is_many() {
            return;
        }
        self.retries = retries;
        let first = ctx.first_wait_ms();
        let wait = first << retries.min(MAX_DOUBLINGS);
        let wait = u32::try_from(wait).unwrap_or(u32::MAX);
        self.rounds.start(
            ctx.members.to_vec(),
            ctx.revision,
            ctx.loop_hash,
            repair,
            wait,
        );
        self.opened(ctx.now);
    }

    /// Whether it is worth to compute if a rebalancing would gain anything: idle,
    /// calm, and not computed lately.
    pub fn take_foresight(&mut self, ctx: &Context<'_>) -> bool {
        let patient = PATIENT_INTERVALS * ctx.interval_ms;
        let rested = |t| ctx.now.since_ms(t) >= patient;
        let wants = self.rounds.open().is_none()
            && !ctx.is_many()
            && self.orphan_since.is_none()
            && self.foreseen_at.is_none_or(rested)
            && self.may_gain(ctx);
        if wants {
            self.foreseen_at = Some(ctx.now);
        }
        wants
    }

    /// When the last of the live owners expects to be done, milliseconds from now.
    #[must_use]
    pub fn present_end_ms(&self, ctx: &Context<'_>) -> u64 {
        let at_work = |id: &u16| ctx.live.contains_key(id) && self.sections.n_left(*id) > 0;
        let owners = self.progress.iter().filter(|(id, _)| at_work(id));
        owners
            .map(|(_, p)| p.end.since_ms(ctx.now))
            .max()
            .unwrap_or(0)
    }

    /// Idle while others have something left, and it is long since anything was decided.
    fn may_gain(&self, ctx: &Context<'_>) -> bool {
        let steady = ctx
            .able_since
            .is_some_and(|t| ctx.now.since_ms(t) >= PATIENT_INTERVALS * ctx.interval_ms);
        let idle = self
            .idle_since
            .is_some_and(|t| ctx.now.since_ms(t) >= SHORT_INTERVALS * ctx.interval_ms);
        let calm = CALM_INTERVALS * ctx.interval_ms;
        let stagger = self.rank(ctx) * ctx.interval_ms / ROUND_STAGGER;
        let last = self.decided_at.max(self.adopted_at);
        let rested = last.is_none_or(|t| ctx.now.since_ms(t) >= calm + stagger);
        let mut owners = ctx.live.keys();
        steady && idle && rested && owners.any(|id| self.sections.n_left(*id) > 0)
    }

    /// Asks for the division of a complete round, once.
    fn divide(&mut self, coverage_loop: &CoverageLoop) -> Option<Action> {
        let (epoch, open) = self.rounds.complete()?;
        if self.dividing.as_ref().is_some_and(|d| d.epoch == epoch) {
            return None;
        }
        let (ring, uavs) = division::problem(open, coverage_loop, &self.needless);
        self.dividing = Some(Dividing {
            epoch,
            ring: ring.clone(),
        });
        Some(Action::Divide { epoch, ring, uavs })
    }

    /// The answer to [`Action::Divide`]. Returns what is to be made durable and then
    /// given to [`Negotiation::adopt`], unless the round was abandoned meanwhile or
    /// its division is not worth the change.
    pub fn divided(&mut self, now: Time, epoch: Epoch, division: &Division) -> Option<Adoption> {
        let dividing = self.dividing.take_if(|d| d.epoch == epoch)?;
        let (now_epoch, open) = self.rounds.complete()?;
        if now_epoch != epoch {
            return None;
        }
        let worthwhile = division::worthwhile(open, division);
        let bid = open.bids.get(&self.me)?;
        let section = division::section_of(division, &dividing.ring, self.me);
        let adoption = Adoption {
            epoch,
            plan: division::adopted(&self.sections, epoch, bid, &section),
            unassigned: division.unassigned.clone(),
            wait_ms: open.round.wait_ms,
        };
        self.rounds.close();
        self.retries = 0;
        self.provisional = false;
        self.decided_at = Some(now);
        worthwhile.then_some(adoption)
    }

    /// The adoption is durable: it is the plan from now on, but for what others plan at a higher
    /// stamp by now, and what was given away is held for twice the round's waiting time. Returns
    /// false where a later one is known.
    pub fn adopt(&mut self, now: Time, adoption: &Adoption, live: &LivePeers) -> bool {
        if !self.sections.install(adoption.epoch, &adoption.plan) {
            return false;
        }
        self.sections.settle(live);
        self.sections.set_unassigned(&adoption.unassigned);
        self.adopted_at = Some(now);
        self.decided_at = Some(now);
        self.progressed = false;
        self.adoptions = self.adoptions.saturating_add(1);
        true
    }

    /// What it owned is void, coverage stays.
    pub fn void_ownership(&mut self, me: Member) {
        self.rounds.set_me(me);
        self.sections.reset_ownership();
        self.sections.forget_presumed();
        self.dividing = None;
        self.bid_wanted = false;
        self.take_pending = false;
        self.provisional = false;
    }

    /// Notes how other owners get on; the first ETA heard in an epoch bounds them. A cell far
    /// from all others is long in coming: an owner whose ETA falls at half the pace of the
    /// clock at least is on its way.
    fn watch_progress(&mut self, ctx: &Context<'_>, changed: &BTreeSet<u16>) {
        let cell_bound = TWO_CELLS_MS + 2 * u64::from(ctx.diameter) * ctx.interval_ms;
        for id in changed.iter().copied() {
            let Some(heard) = self.sections.heard().get(&id) else {
                continue;
            };
            let (epoch, eta_ms, seq) = (heard.claim.epoch, heard.claim.eta_ms, heard.seq);
            let is_new = self.progress.get(&id).is_none_or(|p| p.seq != seq);
            let plan = heard.claim.plan.last().filter(|_| is_new);
            let plan = plan.map_or(Vec::new(), |l| unpack(&[*l], self.sections.cells()));
            if let Some(last) = plan.last() {
                self.ends_at.insert(id, last.cell);
            }
            let left = self.sections.n_left(id);
            let eta_ms = u64::from(eta_ms);
            let slack = eta_ms / 4 + PATIENT_INTERVALS * ctx.interval_ms + cell_bound;
            let fresh = Progress {
                left,
                since: ctx.now,
                eta_ms,
                bound: ctx.now.plus_ms(eta_ms + slack),
                epoch,
                seq,
                end: ctx.now.plus_ms(eta_ms),
            };
            let p = self.progress.entry(id).or_insert(fresh);
            let mut comes_nearer = false;
            if p.seq != seq {
                p.seq = seq;
                p.end = fresh.end;
                comes_nearer = eta_ms + ctx.now.since_ms(p.since) / 2 <= p.eta_ms;
            }
            if p.epoch != epoch || left > p.left {
                *p = fresh;
            } else if left < p.left || comes_nearer {
                p.left = left;
                p.since = ctx.now;
                p.eta_ms = eta_ms;
            }
        }
    }
}

/// Whether so many UAVs, this one included, are too many for rounds.
#[must_use]
pub fn are_many(uavs: usize) -> bool {
    uavs > MEMBERS_MAX
}

#[cfg(test)]
mod tests;
