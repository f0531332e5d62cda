//! When the rules of [`super::sections`] and [`super::rounds`] are used: the only
//! part of the negotiation that knows time.
//!
//! | what is seen | for how long | what follows |
//! |---|---|---|
//! | a member is lost and cells are orphaned | at once | a round with loss |
//! | orphans | 2 T (5 T after a decision) | a round with loss |
//! | an open round with a member that is gone | at once | the next round |
//! | an open round without all bids | W, doubling to 4 W0 | the next round |
//! | a complete round without its division | 2 W | the next round |
//! | nothing divided yet | 1.5 T of listening, with a roster at once | a first section is taken |
//! | only first sections, among few | 2 T | a round with loss |
//! | orphans, and no round helped | 2 T + W0 + rank T/2 | the nearest are taken |
//! | orphans, among many | 2 T each; 2 T for each who would be there sooner (W0 at most), and no less than the first of them would be there sooner | the nearest are taken |
//! | less than 2 T to fly, among many | twice a T | the far part of a slower one's plan is taken |
//! | idle, and a gain was computed from what is held | 10 T steady, 20 T calm | a round without loss |
//! | idle, an owner makes no progress | its bound | the far half is taken |
//! | idle, cells were beyond everybody | 10 T + rank T/2 | what the fuel allows of one run is taken |
//! | cells held | 2 W | they expire |

mod takes;

use super::division::{self, CALM_PERIODS};
use super::rounds::{HeardBid, OpenRound, Rounds};
use super::runs::PlannedCell;
use super::sections::{LivePeers, Sections};
use crate::Time;
use crate::cells::CellSet;
use crate::wire::limits::{HOPS_MAX, MEMBERS_MAX};
use crate::wire::message::{Bid, Epoch, Member};
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use skein_flight::coverage::ring::{CoverageLoop, Direction};
use std::collections::{BTreeMap, BTreeSet};

/// Time in which an owner at work covers two cells, milliseconds: at the slowest ground
/// speed that missions are flown at, 8 m/s, two cells of 48 m take 12 s. An owner that
/// covers none for thrice what the bound makes of it, and comes no nearer, has stalled.
const TWO_CELLS_MS: u64 = 12_000;

/// Three waits, in periods: for members that stay the same before the first division, for
/// orphans before a round that answers a loss, for an empty plan before one that does
/// not. Two, so that one lost beacon or claim changes nothing.
const STEADY_PERIODS: u64 = 2;

/// After a decision cells count as orphans only after so many periods: the new owner's
/// claim takes one to be stored, two to be spoken and passed on, and two more if it is
/// lost once.
pub const SETTLE_PERIODS: u64 = 5;

/// A return, a join or an idle peer waits for so many periods: shorter absences are the
/// rule on a lossy channel.
const PATIENT_PERIODS: u64 = 10;

/// The waiting time of a round doubles with each retry, up to this many doublings: a bid
/// that four waiting times do not bring is not on its way.
const MAX_DOUBLINGS: u32 = 2;

/// Peers begin rounds one after the other by rank, this part of a period apart: the
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
    /// Who is not believed dead and can be reached: without peers that say they are alone, and
    /// with those that were to be launched and were not heard of yet.
    pub live: &'a LivePeers,
    /// Whether they may be others than at the last tick.
    pub live_changed: bool,
    /// Planning members, this peer included if it is able; ascending.
    pub members: &'a [Member],
    /// How many more are taken for live because they were to be launched, and not heard of.
    pub unheard: usize,
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
    /// [`Negotiation::wants_foresight`].
    pub gain_in_sight: bool,
}

impl Context<'_> {
    /// W0 = (2D + 3) T', milliseconds: a bid crosses the component, the answer
    /// comes back, and three periods for what is lost on the way.
    #[must_use]
    pub fn base_wait_ms(&self) -> u64 {
        wait_ms(self.diameter, self.interval_ms)
    }
}

fn wait_ms(diameter: u32, interval_ms: u64) -> u64 {
    (2 * u64::from(diameter) + 3) * interval_ms
}

/// What the negotiation wants done.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Make a bid for the open round, make it durable, then call
    /// [`Negotiation::bid_is_durable`].
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
    /// Make these takes durable, then call [`Negotiation::take`], or if they cannot be
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
    base: CellSet,
    opened_at: Time,
    retries: u32,
    bid_wanted: bool,
    dividing: Option<Dividing>,
    /// Cells that nobody lists, as of the last tick.
    orphans: CellSet,
    orphan_since: Option<Time>,
    /// Among many, since when each of them is one.
    orphaned_at: BTreeMap<u16, Time>,
    loss_seen: bool,
    decided_at: Option<Time>,
    adopted_at: Option<Time>,
    cells_since: u16,
    take_pending: bool,
    idle_since: Option<Time>,
    progress: BTreeMap<u16, Progress>,
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
    /// Nothing negotiated yet. `base` holds the cells that need no service.
    #[must_use]
    pub fn new(me: Member, base: CellSet, counter: u32) -> Self {
        let cells = base.capacity();
        Self {
            sections: Sections::new(me.id, cells, base.clone()),
            rounds: Rounds::new(me, counter),
            me: me.id,
            base,
            opened_at: Time(0),
            retries: 0,
            bid_wanted: false,
            dividing: None,
            orphans: CellSet::new(cells),
            orphan_since: None,
            orphaned_at: BTreeMap::new(),
            loss_seen: false,
            decided_at: None,
            adopted_at: None,
            cells_since: 0,
            take_pending: false,
            idle_since: None,
            progress: BTreeMap::new(),
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

    /// A member was lost, or came back in a new life.
    pub fn note_loss(&mut self) {
        self.loss_seen = true;
    }

    /// For so long this peer did not listen: bids, claims and progress that it did not hear
    /// meanwhile may have been said.
    pub fn was_late(&mut self, late_ms: u64) {
        let waits = [&mut self.orphan_since, &mut self.idle_since];
        for since in waits.into_iter().flatten() {
            *since = since.plus_ms(late_ms);
        }
        self.opened_at = self.opened_at.plus_ms(late_ms);
        for since in self.orphaned_at.values_mut() {
            *since = since.plus_ms(late_ms);
        }
        for progress in self.progress.values_mut() {
            progress.since = progress.since.plus_ms(late_ms);
            progress.bound = progress.bound.plus_ms(late_ms);
        }
    }

    /// Cells newly covered by this peer itself.
    pub fn covered_myself(&mut self, count: u16) {
        self.cells_since = self.cells_since.saturating_add(count);
    }

    /// Milliseconds since the last adoption; very long if there was none.
    #[must_use]
    pub fn adopted_ago_ms(&self, now: Time) -> u32 {
        self.adopted_at.map_or(u32::MAX, |t| {
            u32::try_from(now.since_ms(t)).unwrap_or(u32::MAX)
        })
    }

    /// Cells covered since the last adoption.
    #[must_use]
    pub fn cells_since(&self) -> u16 {
        self.cells_since
    }

    /// A bid was heard.
    pub fn hear_bid(&mut self, now: Time, author: Member, bid: &Bid) {
        if self.rounds.hear(author, bid) == HeardBid::BidWanted {
            self.opened(now);
        }
    }

    fn opened(&mut self, now: Time) {
        self.opened_at = now;
        self.bid_wanted = true;
        self.dividing = None;
    }

    /// The bid is durable. Returns whether it may still be spoken.
    pub fn bid_is_durable(&mut self, bid: Bid) -> bool {
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
        if self.sections.take_listing() || ctx.live_changed {
            self.orphans = self.sections.orphans(ctx.live);
            let orphans = &self.orphans;
            self.orphaned_at.retain(|c, _| orphans.contains(*c));
        }
        let orphans = core::mem::take(&mut self.orphans);
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
        self.loss_seen &= ctx.able_since.is_none();
        if core::mem::take(&mut self.bid_wanted) && ctx.able_since.is_some() {
            actions.push(Action::Bid);
        }
        if let Some(divide) = self.divide(coverage_loop) {
            actions.push(divide);
        }
        actions
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
        if orphans.count() == 0 || ctx.able_since.is_none() {
            // Who is not able takes no note of orphans: it may not have heard the claims that
            // list them.
            self.orphan_since = None;
        } else {
            // Cells given to others look orphaned until their claims arrive, so the time
            // counts from the decision.
            self.orphan_since = self.orphan_since.or(Some(ctx.now)).max(self.decided_at);
        }
        let noted = self.orphaned_at.len() == usize::from(orphans.count());
        if !noted && is_many(ctx) && ctx.able_since.is_some() {
            for cell in orphans.iter() {
                self.orphaned_at.entry(cell).or_insert(ctx.now);
            }
        }
        if self.members != ctx.members {
            self.members = ctx.members.to_vec();
            self.members_since = ctx.now;
        }
        let idle = self.sections.plan().is_empty();
        self.idle_since = if idle {
            self.idle_since.or(Some(ctx.now))
        } else {
            None
        };
    }

    fn rank(&self, ctx: &Context<'_>) -> u64 {
        ctx.members.iter().take_while(|m| m.id != self.me).count() as u64
    }

    /// Opens, retries and abandons rounds.
    fn run_rounds(&mut self, ctx: &Context<'_>, orphans: &CellSet) {
        let orphaned_ms = self.orphan_since.map(|t| ctx.now.since_ms(t));
        if let Some(open) = self.rounds.open() {
            let gone = open
                .round
                .members
                .iter()
                .any(|m| m.id != self.me && (ctx.live.get(&m.id) != Some(&m.incarnation)));
            let waited = ctx.now.since_ms(self.opened_at);
            let loss = open.round.loss || orphans.count() > 0;
            if gone {
                self.rounds.give_up();
                self.start(ctx, loss, 0);
            } else if waited > self.patience_ms(open) {
                self.rounds.give_up();
                self.start(ctx, loss, self.retries + 1);
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
            company && ctx.now.since_ms(self.members_since) >= STEADY_PERIODS * ctx.interval_ms;
        if self.decided_at.is_none() && !steady && orphaned_ms < PATIENT_PERIODS * ctx.interval_ms {
            return;
        }
        let settled = self
            .decided_at
            .is_none_or(|t| ctx.now.since_ms(t) >= SETTLE_PERIODS * ctx.interval_ms);
        let patience = if settled {
            STEADY_PERIODS
        } else {
            SETTLE_PERIODS
        } * ctx.interval_ms;
        let stagger = self.rank(ctx) * ctx.interval_ms / ROUND_STAGGER;
        if (self.loss_seen && settled) || orphaned_ms >= patience + stagger {
            self.start(ctx, true, 0);
        }
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

    fn start(&mut self, ctx: &Context<'_>, loss: bool, retries: u32) {
        if !ctx.members.iter().any(|m| m.id == self.me) || is_many(ctx) {
            return;
        }
        self.retries = retries;
        let base = ctx.base_wait_ms();
        let wait = base << retries.min(MAX_DOUBLINGS);
        let wait = u32::try_from(wait).unwrap_or(u32::MAX);
        self.rounds.start(
            ctx.members.to_vec(),
            ctx.revision,
            ctx.loop_hash,
            loss,
            wait,
        );
        self.opened(ctx.now);
    }

    /// Whether it is worth to compute if a round without a loss would gain anything: idle,
    /// calm, and not computed lately.
    pub fn wants_foresight(&mut self, ctx: &Context<'_>) -> bool {
        let patient = PATIENT_PERIODS * ctx.interval_ms;
        let rested = |t| ctx.now.since_ms(t) >= patient;
        let wants = self.rounds.open().is_none()
            && !is_many(ctx)
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
            .is_some_and(|t| ctx.now.since_ms(t) >= PATIENT_PERIODS * ctx.interval_ms);
        let idle = self
            .idle_since
            .is_some_and(|t| ctx.now.since_ms(t) >= STEADY_PERIODS * ctx.interval_ms);
        let calm = CALM_PERIODS * ctx.interval_ms;
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
        let (ring, uavs) = division::problem(open, coverage_loop, &self.base);
        self.dividing = Some(Dividing {
            epoch,
            ring: ring.clone(),
        });
        Some(Action::Divide { epoch, ring, uavs })
    }

    /// The answer to [`Action::Divide`]. Returns what is to be made durable and then
    /// given to [`Negotiation::adopt`], unless the round was abandoned meanwhile or
    /// its division is not worth the change.
    pub fn divided(
        &mut self,
        now: Time,
        period_ms: u64,
        epoch: Epoch,
        division: &Division,
    ) -> Option<Adoption> {
        let dividing = self.dividing.take_if(|d| d.epoch == epoch)?;
        let (now_epoch, open) = self.rounds.complete()?;
        if now_epoch != epoch {
            return None;
        }
        let worthwhile = division::worthwhile(open, division, period_ms);
        let mine = open.bids.get(&self.me)?;
        let committed = division::commits_of(mine, self.sections.cells());
        let commits = self
            .sections
            .plan()
            .iter()
            .filter(|p| committed.contains(p.cell));
        let commits: Vec<(u16, Direction)> = commits.map(|p| (p.cell, p.direction)).collect();
        let section = division::section_of(division, &dividing.ring, self.me);
        let adoption = Adoption {
            epoch,
            plan: self.sections.adopted(epoch, &commits, &section),
            unassigned: division.unassigned.clone(),
            wait_ms: open.round.wait_ms,
        };
        self.rounds.close();
        self.retries = 0;
        self.provisional = false;
        self.decided_at = Some(now);
        worthwhile.then_some(adoption)
    }

    /// The adoption is durable: it is the plan from now on, and what was given away is
    /// held for twice the round's waiting time. Returns false where a later one is known.
    pub fn adopt(&mut self, now: Time, adoption: &Adoption) -> bool {
        if !self.sections.install(adoption.epoch, &adoption.plan) {
            return false;
        }
        self.sections.set_unassigned(&adoption.unassigned);
        self.adopted_at = Some(now);
        self.decided_at = Some(now);
        self.cells_since = 0;
        self.adoptions = self.adoptions.saturating_add(1);
        true
    }

    /// A new life: ownership of the old one is void, coverage stays.
    pub fn new_life(&mut self, me: Member) {
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
            let left = self.sections.n_left(id);
            let eta_ms = u64::from(eta_ms);
            let slack = eta_ms / 4 + PATIENT_PERIODS * ctx.interval_ms + cell_bound;
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

/// Whether there are too many for rounds.
fn is_many(ctx: &Context<'_>) -> bool {
    ctx.members.len() + ctx.unheard > MEMBERS_MAX
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mission;
    use crate::wire::message::{CellRun, Claim, Firmness, ListedRun, Round, Stamp};
    use crate::wire::samples;
    use std::sync::Arc;

    const T: u64 = 1000;

    /// One peer's negotiation over 24 cells, with what it is told of the others.
    struct Desk {
        negotiation: Negotiation,
        coverage_loop: Arc<CoverageLoop>,
        now: Time,
        live: LivePeers,
        able_since: Option<Time>,
        held_expired: bool,
        gain_in_sight: bool,
    }

    fn member(id: u16) -> Member {
        Member { id, incarnation: 1 }
    }

    impl Desk {
        /// Peer 1 among `others`, able and steady since long ago.
        fn new(others: &[u16]) -> Self {
            let geometry = Arc::new(mission(1, 6, 4)).geometry().unwrap();
            let cells = u16::try_from(geometry.coverage_loop.len()).unwrap();
            let mut desk = Self {
                negotiation: Negotiation::new(member(1), CellSet::new(cells), 0),
                coverage_loop: Arc::clone(&geometry.coverage_loop),
                now: Time(100 * T),
                live: others.iter().map(|id| (*id, 1)).collect(),
                able_since: Some(Time(0)),
                held_expired: false,
                gain_in_sight: true,
            };
            assert_eq!(desk.cells(), 24);
            assert!(desk.tick().is_empty());
            desk
        }

        fn cells(&self) -> u16 {
            self.negotiation.sections.cells()
        }

        fn tick(&mut self) -> Vec<Action> {
            let coverage_loop = Arc::clone(&self.coverage_loop);
            self.ask(|negotiation, ctx| negotiation.tick(ctx, &coverage_loop))
        }

        /// Asks the negotiation something, now.
        fn ask<R>(&mut self, what: impl FnOnce(&mut Negotiation, &Context<'_>) -> R) -> R {
            let mut members: Vec<Member> = self.live.keys().map(|id| member(*id)).collect();
            members.extend(self.able_since.map(|_| member(1)));
            members.sort_unstable();
            let ctx = Context {
                now: self.now,
                interval_ms: T,
                live: &self.live,
                live_changed: true,
                members: &members,
                unheard: 0,
                diameter: 1,
                able_since: self.able_since,
                revision: 1,
                loop_hash: 7,
                held_expired: core::mem::take(&mut self.held_expired),
                gain_in_sight: self.gain_in_sight,
            };
            what(&mut self.negotiation, &ctx)
        }

        /// After how long, in steps of a quarter period with a tick each, something holds.
        fn until(
            &mut self,
            most_ms: u64,
            holds: impl Fn(&mut Negotiation, &Context<'_>) -> bool,
        ) -> Option<u64> {
            let from = self.now;
            while self.now.since_ms(from) <= most_ms {
                self.tick();
                if self.ask(&holds) {
                    return Some(self.now.since_ms(from));
                }
                self.now = self.now.plus_ms(T / 4);
            }
            None
        }

        /// After how long cells are to be taken, and which.
        fn take(&mut self, most_ms: u64) -> Option<(u64, Vec<(u16, Direction)>)> {
            let from = self.now;
            while self.now.since_ms(from) <= most_ms {
                let taken = self.tick().into_iter().find_map(|a| match a {
                    Action::Take(cells) => Some(cells),
                    _ => None,
                });
                if let Some(taken) = taken {
                    let cells = taken.iter().map(|p| (p.cell, p.direction));
                    return Some((self.now.since_ms(from), cells.collect()));
                }
                self.now = self.now.plus_ms(T / 4);
            }
            None
        }

        /// Ticks every quarter period; returns after how long an action came, and it.
        fn wait(&mut self, most_ms: u64) -> Option<(u64, Action)> {
            let from = self.now;
            while self.now.since_ms(from) <= most_ms {
                if let Some(action) = self.tick().into_iter().next() {
                    return Some((self.now.since_ms(from), action));
                }
                self.now = self.now.plus_ms(T / 4);
            }
            None
        }

        fn bid_from(&self, anchor: u16) -> Bid {
            Bid {
                anchor,
                ..samples::bid(self.round().clone())
            }
        }

        /// Another peer's claim of some cells.
        fn claim(&mut self, id: u16, seq: u32, first: u16, count: u16, eta_ms: u32) {
            let epoch = Epoch {
                counter: 1,
                hash: 0,
            };
            let listed = ListedRun {
                run: CellRun { first, count },
                backward: false,
                firmness: Firmness::Tentative,
                stamp: Stamp { epoch, take: 0, id },
            };
            let claim = Claim {
                epoch,
                plan: vec![listed],
                eta_ms,
                ..Claim::default()
            };
            assert!(self.negotiation.sections.hear(id, 1, seq, claim));
        }

        /// Everything but some cells is covered.
        fn leave_open(&mut self, open: core::ops::Range<u16>) {
            let cells = self.cells();
            let done = (0..cells).filter(|c| !open.contains(c));
            self.negotiation.sections.cover(&CellSet::of(cells, done));
        }

        fn round(&self) -> &Round {
            &self.negotiation.rounds.open().unwrap().round
        }

        /// A division was adopted just now: this peer has cells `0..count`.
        fn adopt(&mut self, count: u16) {
            let epoch = Epoch {
                counter: 1,
                hash: 1,
            };
            let section: Vec<_> = (0..count).map(|c| (c, Direction::Forward)).collect();
            let plan = self.negotiation.sections.adopted(epoch, &[], &section);
            let adoption = Adoption {
                epoch,
                plan,
                unassigned: Vec::new(),
                wait_ms: 5000,
            };
            assert!(self.negotiation.adopt(self.now, &adoption));
        }
    }

    #[test]
    fn orphans_of_two_periods_open_a_round_with_loss() {
        let mut desk = Desk::new(&[2]);
        let (after_ms, action) = desk.wait(10 * T).unwrap();
        assert_eq!((after_ms, action), (2 * T, Action::Bid));
        assert!(desk.round().loss && desk.round().counter == 1);
        assert_eq!(desk.round().members, [member(1), member(2)]);
        assert_eq!(desk.round().wait_ms, 5 * 1000);
    }

    #[test]
    fn a_peer_of_higher_rank_begins_later() {
        let mut desk = Desk::new(&[]);
        desk.live = LivePeers::from([(0, 1)]);
        desk.now = desk.now.plus_ms(T);
        let (after_ms, _) = desk.wait(10 * T).unwrap();
        assert!((2 * T..3 * T).contains(&after_ms), "{after_ms}");
        assert_eq!(desk.round().members, [member(0), member(1)]);
    }

    #[test]
    fn who_cannot_plan_opens_nothing_and_takes_nothing() {
        let mut desk = Desk::new(&[2]);
        desk.able_since = None;
        assert_eq!(desk.wait(60 * T), None);
    }

    #[test]
    fn after_a_decision_orphans_are_believed_later() {
        let mut desk = Desk::new(&[2]);
        desk.adopt(4);
        let (after_ms, action) = desk.wait(20 * T).unwrap();
        assert_eq!((after_ms, action), (5 * T, Action::Bid));
    }

    #[test]
    fn a_lost_member_opens_a_round_at_once() {
        let mut desk = Desk::new(&[2]);
        desk.adopt(4);
        desk.claim(2, 1, 4, 20, 60_000);
        assert_eq!(desk.wait(8 * T), None, "nothing is orphaned");
        desk.live.clear();
        desk.negotiation.note_loss();
        assert_eq!(desk.wait(T), Some((0, Action::Bid)));
        assert!(desk.round().loss);
        assert_eq!(desk.round().members, [member(1)]);
    }

    #[test]
    fn a_round_whose_member_is_gone_is_followed_by_the_next_at_once() {
        let mut desk = Desk::new(&[2, 3]);
        desk.wait(5 * T).unwrap();
        desk.live.remove(&3);
        assert_eq!(desk.wait(T), Some((0, Action::Bid)));
        assert_eq!(desk.round().counter, 2);
        assert_eq!(desk.round().members, [member(1), member(2)]);
    }

    #[test]
    fn a_round_without_all_bids_waits_longer_each_time_and_leaves_out_the_silent() {
        let mut desk = Desk::new(&[2]);
        desk.wait(5 * T).unwrap();
        let own = desk.bid_from(0);
        assert!(desk.negotiation.bid_is_durable(own));
        let mut waits = Vec::new();
        for _ in 0..2 {
            // Takes are made meanwhile; they are none of this test's business.
            let counter = desk.round().counter;
            let from = desk.now;
            while desk.round().counter == counter {
                desk.now = desk.now.plus_ms(T / 4);
                desk.tick();
            }
            waits.push((desk.now.since_ms(from), desk.round().wait_ms));
        }
        assert!((5 * T..6 * T).contains(&waits[0].0) && waits[0].1 == 10_000);
        assert!((10 * T..11 * T).contains(&waits[1].0) && waits[1].1 == 20_000);
        assert_eq!(desk.round().members, [member(1)], "2 was silent twice");
    }

    #[test]
    fn a_complete_round_is_divided_once_and_given_up_without_an_answer() {
        let mut desk = Desk::new(&[2]);
        desk.wait(5 * T).unwrap();
        let (own, other) = (desk.bid_from(0), desk.bid_from(12));
        assert!(desk.negotiation.bid_is_durable(own));
        desk.negotiation.hear_bid(desk.now, member(2), &other);
        let divides = desk.tick();
        assert!(
            matches!(&divides[..], [Action::Divide { uavs, .. }] if uavs.len() == 2),
            "{divides:?}"
        );
        assert!(desk.tick().is_empty());
        let counter = desk.round().counter;
        let from = desk.now;
        while desk.round().counter == counter {
            desk.now = desk.now.plus_ms(T / 4);
            desk.tick();
        }
        let waited_ms = desk.now.since_ms(from);
        assert!((10 * T..11 * T).contains(&waited_ms), "{waited_ms}");
    }

    #[test]
    fn a_division_gives_each_member_its_part_and_all_compute_the_same() {
        let mut desk = Desk::new(&[2]);
        desk.wait(5 * T).unwrap();
        let (own, other) = (desk.bid_from(0), desk.bid_from(12));
        desk.negotiation.bid_is_durable(own);
        desk.negotiation.hear_bid(desk.now, member(2), &other);
        let divides = desk.tick();
        let [Action::Divide { epoch, ring, uavs }] = &divides[..] else {
            panic!("{divides:?}")
        };
        let division = skein_flight::coverage::ring::backtracking::divide(ring, uavs);
        let adoption = desk
            .negotiation
            .divided(desk.now, T, *epoch, &division)
            .unwrap();
        let mine = adoption.plan.len();
        assert!((10..=14).contains(&mine), "{mine} of 24");
        assert!(desk.negotiation.adopt(desk.now, &adoption));
        assert!(!desk.negotiation.adopt(desk.now, &adoption), "once");
        assert_eq!(desk.negotiation.adoptions, 1);
    }

    #[test]
    fn orphans_that_no_round_helps_are_taken_the_nearest_run_first() {
        let mut desk = Desk::new(&[2]);
        desk.adopt(4);
        desk.claim(2, 1, 10, 10, 600_000);
        let from = desk.now;
        let mut taken = None;
        while taken.is_none() && desk.now.since_ms(from) < 60 * T {
            desk.now = desk.now.plus_ms(T / 4);
            taken = desk.tick().into_iter().find_map(|a| match a {
                Action::Take(cells) => Some(cells),
                _ => None,
            });
        }
        let cells: Vec<u16> = taken.unwrap().iter().map(|p| p.cell).collect();
        assert_eq!(cells, [4, 5, 6, 7, 8, 9], "beside its own plan, in order");
        // 2 T and W0 after the decision.
        let after_ms = desk.now.since_ms(from);
        assert!((7 * T..=8 * T).contains(&after_ms), "{after_ms}");
        // Until that is durable or broken nothing more is taken.
        desk.now = desk.now.plus_ms(20 * T);
        let more = |actions: Vec<Action>| actions.iter().any(|a| matches!(a, Action::Take(_)));
        assert!(!more(desk.tick()));
        desk.negotiation.cancel_take();
        assert!(more(desk.tick()));
    }

    #[test]
    fn an_idle_peer_asks_for_a_share_of_what_others_have_left() {
        let mut desk = Desk::new(&[2]);
        desk.claim(2, 1, 0, 24, 600_000);
        let (after_ms, action) = desk.wait(60 * T).unwrap();
        assert_eq!(action, Action::Bid);
        assert!(!desk.round().loss);
        assert!(after_ms >= 2 * T, "{after_ms}");
        // But not where nothing would be gained.
        let mut desk = Desk::new(&[2]);
        desk.gain_in_sight = false;
        desk.claim(2, 1, 0, 24, 600_000);
        assert_eq!(desk.wait(20 * T), None);
    }

    #[test]
    fn a_return_waits_until_it_is_steady() {
        let mut desk = Desk::new(&[2]);
        desk.claim(2, 1, 0, 24, 600_000);
        desk.able_since = Some(desk.now);
        let (after_ms, action) = desk.wait(60 * T).unwrap();
        assert_eq!(action, Action::Bid);
        assert!((10 * T..11 * T).contains(&after_ms), "{after_ms}");
    }

    #[test]
    fn the_far_half_of_a_stalled_owner_is_taken_from_its_end() {
        let mut desk = Desk::new(&[2]);
        // So few cells that no round is worth it.
        desk.gain_in_sight = false;
        desk.leave_open(4..6);
        desk.claim(2, 1, 4, 2, 10_000);
        let (after_ms, action) = desk.wait(400 * T).unwrap();
        let Action::Take(cells) = action else {
            panic!("{action:?}")
        };
        let taken: Vec<_> = cells.iter().map(|p| (p.cell, p.direction)).collect();
        assert_eq!(taken, [(5, Direction::Backward)]);
        // Its ETA, a quarter more, ten periods, and two cells with 2 D T.
        let bound_ms = 10_000 + 2_500 + 10 * T + TWO_CELLS_MS + 2 * T;
        assert!((bound_ms..bound_ms + T).contains(&after_ms), "{after_ms}");
    }

    #[test]
    fn who_stood_still_waits_as_long_again_as_if_it_had_not() {
        let mut desk = Desk::new(&[2]);
        desk.wait(5 * T).unwrap();
        let counter = desk.round().counter;
        desk.now = desk.now.plus_ms(T + 600 * T);
        desk.negotiation.was_late(600 * T);
        assert_eq!(desk.wait(3 * T), None, "neither a round nor a take");
        assert_eq!(desk.round().counter, counter);
        assert!(desk.wait(10 * T).is_some());
    }

    #[test]
    fn cells_that_nobody_took_over_in_time_are_orphans() {
        let mut desk = Desk::new(&[2]);
        desk.adopt(4);
        desk.claim(2, 1, 4, 20, 600_000);
        let epoch = Epoch {
            counter: 2,
            hash: 0,
        };
        assert!(desk.negotiation.sections.adopt(epoch, &[], &[]));
        assert_eq!(desk.negotiation.sections.held().len(), 4);
        desk.held_expired = true;
        assert_eq!(desk.tick(), [Action::Changed]);
        assert!(desk.negotiation.sections.held().is_empty());
        let live = desk.live.clone();
        assert_eq!(desk.negotiation.sections.orphans(&live).count(), 4);
    }

    #[test]
    fn a_new_life_owns_nothing_and_keeps_what_is_covered() {
        let mut desk = Desk::new(&[2]);
        desk.adopt(4);
        desk.leave_open(2..24);
        desk.negotiation.new_life(Member {
            id: 1,
            incarnation: 2,
        });
        assert!(desk.negotiation.sections.plan().is_empty());
        assert_eq!(desk.negotiation.sections.covered().count(), 2);
    }

    #[test]
    fn a_round_may_wait_for_four_times_what_the_largest_diameter_needs_and_no_longer() {
        let mut desk = Desk::new(&[2]);
        let mut refuse = |wait_ms| {
            let round = Round {
                counter: 1,
                members: vec![member(1), member(2)],
                revision: 1,
                loop_hash: 7,
                loss: true,
                wait_ms,
            };
            desk.negotiation.rounds.refuse(&round)
        };
        // (2 · 16 + 3) T, doubled twice.
        assert_eq!(refuse(140_000), None);
        assert!(refuse(140_001).is_some());
    }

    #[test]
    fn in_each_period_what_is_heard_raises_the_counter_anew() {
        let mut desk = Desk::new(&[2]);
        for after_periods in 0..3 {
            desk.negotiation.rounds.hear_counter(u32::MAX);
            assert_eq!(
                desk.negotiation.rounds.counter(),
                1000 * (after_periods + 1)
            );
            desk.now = desk.now.plus_ms(T - 1);
            desk.ask(|n, ctx| n.watch_period(ctx));
            assert!(!desk.negotiation.rounds.hear_counter(u32::MAX));
            desk.now = desk.now.plus_ms(1);
            desk.ask(|n, ctx| n.watch_period(ctx));
        }
    }

    #[test]
    fn before_its_first_division_a_peer_waits_until_the_members_stay_the_same() {
        let opened = |n: &mut Negotiation, _: &Context<'_>| n.rounds.open().is_some();
        let mut desk = Desk::new(&[2]);
        for others in [[3], [4], [5]] {
            assert_eq!(desk.until(3 * T / 2, opened), None);
            desk.live = others.iter().map(|id| (*id, 1)).collect();
        }
        assert_eq!(desk.until(20 * T, opened), Some(2 * T));
        // One that knows only itself waits for ten.
        let mut alone = Desk::new(&[]);
        assert_eq!(alone.until(20 * T, opened), Some(10 * T));
        // As does one whose company never stays the same.
        let mut desk = Desk::new(&[2]);
        let from = desk.now;
        while desk.until(T, opened).is_none() {
            let other = if desk.live.contains_key(&2) { 3 } else { 2 };
            desk.live = LivePeers::from([(other, 1)]);
        }
        assert_eq!(desk.now.since_ms(from), 10 * T);
    }

    #[test]
    fn after_a_division_a_loss_waits_until_the_new_claims_have_come() {
        for (waited, answered) in [(4 * T, false), (5 * T, true)] {
            let mut desk = Desk::new(&[2, 3]);
            desk.adopt(4);
            desk.claim(2, 1, 4, 20, 600_000);
            desk.now = desk.now.plus_ms(waited - T / 4);
            assert!(desk.tick().is_empty());
            desk.now = desk.now.plus_ms(T / 4);
            desk.live.remove(&2);
            desk.negotiation.note_loss();
            assert_eq!(desk.tick() == [Action::Bid], answered, "{waited} ms");
        }
    }

    #[test]
    fn whether_a_round_would_gain_is_computed_once_in_ten_periods() {
        let mut desk = Desk::new(&[2]);
        desk.gain_in_sight = false;
        desk.claim(2, 1, 0, 24, 600_000);
        let wants = |n: &mut Negotiation, ctx: &Context<'_>| n.wants_foresight(ctx);
        assert_eq!(
            desk.until(9 * T, wants),
            Some(2 * T),
            "idle for two periods"
        );
        for _ in 0..3 {
            desk.now = desk.now.plus_ms(T / 4);
            assert_eq!(desk.until(20 * T, wants), Some(10 * T - T / 4));
        }
        // Not while a round is open, nor among many, nor with nothing left to share.
        desk.now = desk.now.plus_ms(20 * T);
        desk.ask(|n, ctx| n.start(ctx, false, 0));
        assert!(!desk.ask(wants));
        desk.negotiation.rounds.give_up();
        assert!(desk.ask(wants));
        desk.now = desk.now.plus_ms(20 * T);
        desk.live.extend((3..=9).map(|id| (id, 1)));
        assert!(!desk.ask(wants), "nine are many");
        desk.live = LivePeers::from([(2, 1)]);
        desk.leave_open(0..0);
        assert!(!desk.ask(wants));
    }

    #[test]
    fn a_round_without_a_loss_comes_twenty_periods_after_the_last_division() {
        for (others, rank) in [([2], 0), ([0], 1)] {
            let mut desk = Desk::new(&[]);
            desk.live = others.iter().map(|id| (*id, 1)).collect();
            desk.adopt(0);
            desk.claim(others[0], 1, 0, 24, 600_000);
            let (after_ms, action) = desk.wait(60 * T).unwrap();
            assert_eq!(action, Action::Bid);
            // An eighth of a period a rank, looked at four times a period.
            assert_eq!(after_ms, 20 * T + rank * T / 4, "rank {rank}");
        }
    }

    #[test]
    fn orphans_are_left_to_those_who_would_be_there_sooner_each_for_two_periods() {
        let mut desk = Desk::new(&[2, 3, 4, 5, 6, 7, 8, 9]);
        desk.claim(2, 1, 0, 20, 600_000);
        desk.tick();
        // Two more are orphaned later: each cell has its own time.
        let turn =
            |desk: &mut Desk, cell, sooner| desk.ask(|n, ctx| n.is_my_turn(ctx, cell, (sooner, 0)));
        let ripe =
            |desk: &mut Desk| desk.ask(|n, ctx| n.ripe_orphans(ctx).iter().collect::<Vec<_>>());
        let from = desk.now;
        desk.now = from.plus_ms(T);
        desk.claim(2, 2, 2, 18, 600_000);
        desk.tick();
        for (after, ripe_now, of_22, of_0) in [
            (2 * T - 1, vec![], [false; 3], [false; 3]),
            (
                2 * T,
                vec![20, 21, 22, 23],
                [true, false, false],
                [false; 3],
            ),
            (
                3 * T,
                vec![0, 1, 20, 21, 22, 23],
                [true, false, false],
                [true, false, false],
            ),
            (
                4 * T,
                vec![0, 1, 20, 21, 22, 23],
                [true, true, false],
                [true, false, false],
            ),
            // W0 at most, which is 5 T here.
            (
                7 * T,
                vec![0, 1, 20, 21, 22, 23],
                [true; 3],
                [true, true, false],
            ),
        ] {
            desk.now = from.plus_ms(after);
            assert_eq!(ripe(&mut desk), ripe_now, "after {after} ms");
            assert_eq!(
                [0, 1, 40].map(|n| turn(&mut desk, 22, n)),
                of_22,
                "after {after} ms"
            );
            assert_eq!(
                [0, 1, 40].map(|n| turn(&mut desk, 0, n)),
                of_0,
                "after {after} ms"
            );
        }
    }

    #[test]
    fn an_orphan_is_left_to_who_is_near_for_as_long_as_the_way_takes_longer() {
        let mut desk = Desk::new(&[2, 3, 4, 5, 6, 7, 8, 9]);
        desk.claim(2, 1, 0, 20, 600_000);
        desk.tick();
        let from = desk.now;
        for (after, turns) in [
            (2 * T, [true, false, false]),
            (7 * T, [true, false, false]),
            (11 * T - 1, [true, false, false]),
            (11 * T, [true, true, false]),
            (92 * T, [true, true, true]),
        ] {
            desk.now = from.plus_ms(after);
            let turn = |later_ms| desk.ask(|n, ctx| n.is_my_turn(ctx, 22, (0, later_ms)));
            assert_eq!([0, 9 * T, 90 * T].map(turn), turns, "after {after} ms");
        }
    }

    #[test]
    fn among_many_who_flies_for_two_more_periods_relieves_nobody() {
        let mut desk = Desk::new(&[2]);
        let mut may = |free_ms| desk.ask(|n, ctx| n.may_relieve(ctx, free_ms));
        assert!(may(0) && may(2 * T) && !may(2 * T + 1));
    }

    #[test]
    fn what_an_owner_has_left_is_less_what_others_took_and_the_time_in_proportion() {
        let mut desk = Desk::new(&[2, 3, 4]);
        desk.claim(2, 1, 0, 20, 100_000);
        // Peer 3 took a quarter of it, at a higher stamp; peer 4 lists nothing.
        desk.claim(3, 1, 15, 5, 40_000);
        desk.claim(4, 1, 0, 0, 40_000);
        desk.tick();
        desk.now = desk.now.plus_ms(20_000);
        let owners = desk.ask(|n, ctx| n.owners(ctx));
        let seen: Vec<_> = owners
            .iter()
            .map(|o| (o.id, o.plan.len(), o.left_ms))
            .collect();
        assert_eq!(seen, [(2, 15, 60_000), (3, 5, 20_000)]);
        assert_eq!(desk.ask(|n, ctx| n.present_end_ms(ctx)), 80_000);
        // Of the dead nothing is known.
        desk.live.remove(&2);
        let owners = desk.ask(|n, ctx| n.owners(ctx));
        assert_eq!(owners.iter().map(|o| o.id).collect::<Vec<_>>(), [3]);
        assert_eq!(desk.ask(|n, ctx| n.present_end_ms(ctx)), 20_000);
    }

    #[test]
    fn an_owner_that_comes_nearer_to_a_far_cell_has_not_stalled() {
        let stalled_ms = 3 * (12_000 + 12 * T + T / 2);
        // It says every ten periods how long its one cell will take yet; for the second time
        // it flies in circles.
        for (falls, its_time_ms) in [(10 * T, 1_000_000 + stalled_ms), (0, stalled_ms)] {
            let mut desk = Desk::new(&[]);
            desk.live = LivePeers::from([(0, 1)]);
            desk.gain_in_sight = false;
            desk.leave_open(7..8);
            let (mut eta_ms, mut waited_ms) = (1_000_000u64, 0);
            let taken_ms = (1..).find_map(|seq| {
                desk.claim(0, seq, 7, 1, u32::try_from(eta_ms).unwrap());
                eta_ms = eta_ms.saturating_sub(falls);
                let taken = desk.wait(10 * T);
                waited_ms += taken.as_ref().map_or(10 * T, |(ms, _)| *ms);
                taken.map(|_| waited_ms)
            });
            let in_time = its_time_ms - 10 * T..=its_time_ms + 20 * T;
            assert!(
                in_time.contains(&taken_ms.unwrap()),
                "{falls}: {taken_ms:?}"
            );
        }
    }

    #[test]
    fn an_owner_that_covers_nothing_has_stalled_after_thrice_its_time() {
        // Of rank 1: the two cells' 12 s, (10 + 2D) T, and half a period for the rank.
        let stalled_ms = 3 * (12_000 + 12 * T + T / 2);
        let mut desk = Desk::new(&[]);
        desk.live = LivePeers::from([(0, 1)]);
        desk.gain_in_sight = false;
        // It expects to be done long after that.
        desk.claim(0, 1, 0, 24, 3_000_000);
        desk.now = desk.now.plus_ms(20_000);
        desk.tick();
        // A cell is covered now: its time begins anew.
        desk.leave_open(1..24);
        desk.tick();
        let (after_ms, cells) = desk.take(200 * T).unwrap();
        assert!(
            (stalled_ms..stalled_ms + T).contains(&after_ms),
            "{after_ms}"
        );
        let far_half: Vec<_> = (12..24).rev().map(|c| (c, Direction::Backward)).collect();
        assert_eq!(cells, far_half);
    }

    #[test]
    fn the_nearest_orphans_are_those_along_the_loop_whichever_way() {
        let nearest = |planned: &[u16], open: &[u16]| -> Vec<(u16, Direction)> {
            let mut desk = Desk::new(&[2]);
            let section: Vec<_> = planned.iter().map(|c| (*c, Direction::Forward)).collect();
            let epoch = Epoch {
                counter: 1,
                hash: 1,
            };
            desk.negotiation.sections.adopt(epoch, &[], &section);
            let orphans = CellSet::of(24, open.iter().copied());
            let coverage_loop = Arc::clone(&desk.coverage_loop);
            desk.ask(|n, _| n.nearest_run(&orphans, &coverage_loop))
                .unwrap()
        };
        let forward =
            |cells: &[u16]| -> Vec<_> { cells.iter().map(|c| (*c, Direction::Forward)).collect() };
        let backward =
            |cells: &[u16]| -> Vec<_> { cells.iter().map(|c| (*c, Direction::Backward)).collect() };
        // Its plan ends at cell 8; of a run the nearer end comes first.
        assert_eq!(nearest(&[7, 8], &[3, 4, 5, 20, 21]), backward(&[5, 4, 3]));
        assert_eq!(nearest(&[7, 8], &[1, 2, 11, 12]), forward(&[11, 12]));
        // Across the seam.
        assert_eq!(nearest(&[1], &[6, 7, 20, 21, 22]), backward(&[22, 21, 20]));
        assert_eq!(nearest(&[22], &[0, 1, 2, 15, 16]), forward(&[0, 1, 2]));
        // A long run whose far end is beside it.
        assert_eq!(
            nearest(&[12], &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 15, 16])[0],
            (10, Direction::Backward)
        );
        // As far both ways: the lower number, flown forward.
        assert_eq!(nearest(&[8], &[4, 12]), forward(&[4]));
    }

    #[test]
    fn who_has_no_plan_looks_for_orphans_from_a_place_of_its_own() {
        // 7919 times its number, on 24 cells: 23 for peer 1, 15 for peer 9.
        for (me, taken) in [(1, 23), (9, 15)] {
            let desk = Desk::new(&[]);
            let alone = Negotiation::new(member(me), CellSet::new(24), 0);
            let orphans = CellSet::of(24, [7, 15, 23]);
            let run = alone.nearest_run(&orphans, &desk.coverage_loop);
            assert_eq!(run, Some(vec![(taken, Direction::Forward)]));
        }
    }

    #[test]
    fn cells_beyond_everybody_are_looked_at_by_the_idle_once_in_ten_periods() {
        for (others, rank) in [([2], 0), ([0], 1)] {
            let mut desk = Desk::new(&[]);
            desk.live = others.iter().map(|id| (*id, 1)).collect();
            desk.gain_in_sight = false;
            desk.negotiation.sections.set_unassigned(&[5, 6, 7]);
            desk.claim(others[0], 1, 8, 20, 3_000_000);
            desk.negotiation.sections.cover(&CellSet::of(24, 0..5));
            let cells = |n: &mut Negotiation, ctx: &Context<'_>| n.left_over(ctx).is_some();
            assert_eq!(desk.until(30 * T, cells), Some(10 * T + rank * T / 2));
            for _ in 0..2 {
                desk.now = desk.now.plus_ms(T / 4);
                assert_eq!(desk.until(30 * T, cells), Some(10 * T - T / 4));
            }
            // Not while a take is under way, with orphans, in a round, or when not able.
            desk.now = desk.now.plus_ms(20 * T);
            assert!(
                desk.negotiation
                    .begin_take(&[(5, Direction::Forward)])
                    .is_some()
            );
            assert!(!desk.ask(cells));
            desk.negotiation.cancel_take();
            desk.ask(|n, ctx| n.start(ctx, false, 0));
            assert!(!desk.ask(cells));
            desk.negotiation.rounds.give_up();
            desk.negotiation.orphan_since = Some(desk.now);
            assert!(!desk.ask(cells));
            desk.negotiation.orphan_since = None;
            let able_since = desk.able_since.take();
            assert!(!desk.ask(cells));
            desk.able_since = able_since;
            assert!(desk.ask(cells));
        }
    }

    #[test]
    fn orphans_are_taken_one_rank_after_the_other() {
        let mut after = Vec::new();
        for others in [[2, 3], [0, 3]] {
            let mut desk = Desk::new(&[]);
            desk.live = others.iter().map(|id| (*id, 1)).collect();
            desk.adopt(4);
            desk.claim(others[0], 1, 10, 10, 600_000);
            after.push(desk.take(60 * T).unwrap().0);
        }
        assert_eq!(after, [7 * T, 7 * T + T / 2]);
    }

    #[test]
    fn a_first_section_is_looked_for_once_and_only_where_nothing_was_divided() {
        let begins = |n: &mut Negotiation, ctx: &Context<'_>| n.begins(ctx, false);
        let mut told = Desk::new(&[2]);
        told.able_since = Some(told.now);
        assert!(told.ask(|n, ctx| n.begins(ctx, true)), "at once");
        let mut desk = Desk::new(&[2]);
        desk.able_since = Some(desk.now);
        assert_eq!(desk.until(10 * T, begins), Some(3 * T / 2));
        assert!(!desk.ask(begins), "once");
        let mut alone = Desk::new(&[]);
        assert!(!alone.ask(begins), "who is alone opens a round with itself");
        let mut heard = Desk::new(&[2]);
        heard.negotiation.rounds.hear_counter(1);
        assert!(!heard.ask(begins), "others have had a round");
        let mut divided = Desk::new(&[2]);
        divided.adopt(0);
        assert!(!divided.ask(begins), "this peer has had one");
        let mut took = Desk::new(&[2]);
        took.negotiation.sections.take(&[(3, Direction::Forward)]);
        assert!(!took.ask(begins), "it has something to fly");
    }

    #[test]
    fn of_two_who_take_what_nobody_lists_the_one_that_is_nearer_outranks_the_other() {
        let takes = |way_ms| {
            let mut desk = Desk::new(&[2]);
            let taken = desk
                .negotiation
                .begin_nearest(&[(3, Direction::Forward)], way_ms);
            taken.unwrap()[0].stamp.take
        };
        assert_eq!([0, 3_999, 4_000, 40_000].map(takes), [61, 61, 60, 51]);
        assert_eq!([240_000, 3_000_000].map(takes), [1, 1]);
    }

    #[test]
    fn among_many_a_peer_looks_twice_a_period_for_what_it_could_take() {
        let looks = |n: &mut Negotiation, ctx: &Context<'_>| n.looks_around(ctx);
        let mut desk = Desk::new(&[2, 3, 4, 5, 6, 7, 8]);
        assert!(!desk.ask(looks), "eight are few");
        desk.live.insert(9, 1);
        assert!(desk.ask(looks));
        desk.now = desk.now.plus_ms(T / 2 - 1);
        assert!(!desk.ask(looks));
        desk.now = desk.now.plus_ms(1);
        assert!(desk.ask(looks));
        desk.now = desk.now.plus_ms(T);
        assert!(
            desk.negotiation
                .begin_take(&[(5, Direction::Forward)])
                .is_some()
        );
        assert!(!desk.ask(looks), "while a take is being written");
        desk.negotiation.cancel_take();
        assert!(desk.ask(looks));
        desk.now = desk.now.plus_ms(T);
        desk.leave_open(0..0);
        assert!(!desk.ask(looks), "with nothing left");
    }

    #[test]
    fn what_is_divided_are_the_bids_whatever_a_member_knows_besides() {
        let mut desk = Desk::new(&[2]);
        desk.wait(5 * T).unwrap();
        let (own, other) = (desk.bid_from(0), desk.bid_from(12));
        assert!(desk.negotiation.bid_is_durable(own));
        desk.negotiation.hear_bid(desk.now, member(2), &other);
        // It hears of covered cells after it bid, and others may not have heard of them.
        desk.leave_open(6..24);
        let divides = desk.tick();
        let ring = divides.iter().find_map(|a| match a {
            Action::Divide { ring, .. } => Some(ring),
            _ => None,
        });
        assert!(ring.unwrap().iter().all(|c| c.open));
    }
}
