//! When the rules of [`super::sections`] and [`super::rounds`] are used: the only
//! part of the negotiation that knows time.
//!
//! | what is seen | for how long | what follows |
//! |---|---|---|
//! | a member is lost and cells are orphaned | at once | a round with loss |
//! | orphans | 2 T (5 T after a decision) | a round with loss |
//! | an open round with a member that is gone | at once | the next round |
//! | an open round without all bids | W, doubling to 4 W0 | the next round |
//! | orphans, and no round helped | 2 T + W0 + rank T/2 | the nearest are taken |
//! | idle, others have much left | 10 T steady, 20 T calm | a round without loss |
//! | idle, an owner makes no progress | its bound | the far half is taken |
//! | cells held | 2 W | they expire |

use super::division::{self, CALM_PERIODS};
use super::rounds::{HeardBid, Rounds};
use super::runs::PlannedCell;
use super::sections::{LivePeers, Sections};
use crate::Time;
use crate::cells::CellSet;
use crate::wire::message::{Bid, Epoch, Member};
use skein_flight::coverage::ring::CoverageLoop;
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use std::collections::BTreeMap;

/// What the rest of the peer knows that the negotiation needs.
#[derive(Clone, Debug)]
pub struct Context<'a> {
    /// The peer's time.
    pub now: Time,
    /// Beacon period T, milliseconds.
    pub period_ms: u64,
    /// Peers not believed dead.
    pub live: &'a LivePeers,
    /// Planning members, this peer included if it is able; ascending.
    pub members: &'a [Member],
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
}

impl Context<'_> {
    /// W0 = (2D + 3) T, milliseconds: a bid crosses the component, the answer
    /// comes back, and three periods for what is lost on the way.
    #[must_use]
    pub fn base_wait_ms(&self) -> u64 {
        (2 * u64::from(self.diameter) + 3) * self.period_ms
    }
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
        robots: Vec<Uav>,
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
    since: Time,
    bound: Time,
    epoch: Epoch,
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
    orphan_since: Option<Time>,
    loss_seen: bool,
    decided_at: Option<Time>,
    adopted_at: Option<Time>,
    cells_since: u16,
    take_pending: bool,
    idle_since: Option<Time>,
    progress: BTreeMap<u16, Progress>,
    members: Vec<Member>,
    members_since: Time,
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
            orphan_since: None,
            loss_seen: false,
            decided_at: None,
            adopted_at: None,
            cells_since: 0,
            take_pending: false,
            idle_since: None,
            progress: BTreeMap::new(),
            members: Vec::new(),
            members_since: Time(0),
            adoptions: 0,
        }
    }

    /// A member was lost, or came back in a new life.
    pub fn note_loss(&mut self) {
        self.loss_seen = true;
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
        let mut actions = Vec::new();
        if self.sections.settle(ctx.live) {
            actions.push(Action::Changed);
        }
        if ctx.held_expired && !self.sections.held().is_empty() {
            self.sections.expire_held();
            actions.push(Action::Changed);
        }
        let orphans = self.sections.orphans(ctx.live);
        self.watch_orphans(ctx, &orphans);
        self.watch_progress(ctx);
        if ctx.able_since.is_some() && !self.sections.complete() {
            self.run_rounds(ctx, &orphans);
            if let Some(take) = self.inherit(ctx, &orphans, coverage_loop) {
                let taken = self.sections.taken(&take);
                self.take_pending = !taken.is_empty();
                if self.take_pending {
                    actions.push(Action::Take(taken));
                }
            }
        }
        self.loss_seen = false;
        if core::mem::take(&mut self.bid_wanted) && ctx.able_since.is_some() {
            actions.push(Action::Bid);
        }
        if let Some(divide) = self.divide(coverage_loop) {
            actions.push(divide);
        }
        actions
    }

    fn watch_orphans(&mut self, ctx: &Context<'_>, orphans: &CellSet) {
        if orphans.count() == 0 || ctx.able_since.is_none() {
            // Who cannot plan yet does not count: it would act on what it has not heard.
            self.orphan_since = None;
        } else {
            // What a decision gave to others is an orphan until they speak of it.
            self.orphan_since = self.orphan_since.or(Some(ctx.now)).max(self.decided_at);
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
            } else if waited > u64::from(open.round.wait_ms) && self.rounds.complete().is_none() {
                self.rounds.give_up();
                self.start(ctx, loss, self.retries + 1);
            }
            return;
        }
        let Some(orphaned_ms) = orphaned_ms else {
            if self.gain_in_sight(ctx) {
                self.start(ctx, false, 0);
            }
            return;
        };
        // Before its first division a peer waits until nobody new was heard for a while:
        // a swarm that starts together begins with one round, not with many.
        let steady = ctx.now.since_ms(self.members_since) >= 2 * ctx.period_ms;
        if self.decided_at.is_none() && !steady && orphaned_ms < 10 * ctx.period_ms {
            return;
        }
        let settled = self
            .decided_at
            .is_none_or(|t| ctx.now.since_ms(t) >= 5 * ctx.period_ms);
        let patience = if settled {
            2 * ctx.period_ms
        } else {
            5 * ctx.period_ms
        };
        let stagger = self.rank(ctx) * ctx.period_ms / 8;
        if (self.loss_seen && settled) || orphaned_ms >= patience + stagger {
            self.start(ctx, true, 0);
        }
    }

    fn start(&mut self, ctx: &Context<'_>, loss: bool, retries: u32) {
        if !ctx.members.iter().any(|m| m.id == self.me) {
            return;
        }
        self.retries = retries;
        let base = ctx.base_wait_ms();
        let wait = (base << retries.min(2)).min(4 * base);
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

    /// Idle while others have much left: a new division may end the work sooner.
    fn gain_in_sight(&self, ctx: &Context<'_>) -> bool {
        let steady = ctx
            .able_since
            .is_some_and(|t| ctx.now.since_ms(t) >= 10 * ctx.period_ms);
        let idle = self
            .idle_since
            .is_some_and(|t| ctx.now.since_ms(t) >= 2 * ctx.period_ms);
        let calm = CALM_PERIODS * ctx.period_ms;
        let stagger = self.rank(ctx) * ctx.period_ms / 8;
        let last = self.decided_at.max(self.adopted_at);
        let rested = last.is_none_or(|t| ctx.now.since_ms(t) >= calm + stagger);
        let left: usize = ctx
            .live
            .keys()
            .map(|id| self.sections.plan_of(*id).len())
            .max()
            .unwrap_or(0);
        steady && idle && rested && left > ctx.members.len()
    }

    /// Asks for the division of a complete round, once.
    fn divide(&mut self, coverage_loop: &CoverageLoop) -> Option<Action> {
        let (epoch, open) = self.rounds.complete()?;
        if self.dividing.as_ref().is_some_and(|d| d.epoch == epoch) {
            return None;
        }
        let (ring, robots) = division::problem(open, coverage_loop, &self.base);
        self.dividing = Some(Dividing {
            epoch,
            ring: ring.clone(),
        });
        Some(Action::Divide {
            epoch,
            ring,
            robots,
        })
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
        let commits: Vec<(u16, bool)> = commits.map(|p| (p.cell, p.backward)).collect();
        let section = division::section_of(division, &dividing.ring, self.me);
        let adoption = Adoption {
            epoch,
            plan: self.sections.adopted(epoch, &commits, &section),
            unassigned: division.unassigned.clone(),
            wait_ms: open.round.wait_ms,
        };
        self.rounds.close();
        self.retries = 0;
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

    /// The takes are durable.
    pub fn take(&mut self, taken: &[PlannedCell]) -> usize {
        self.take_pending = false;
        self.sections.append(taken)
    }

    /// The takes were not made durable: they may be tried again.
    pub fn cancel_take(&mut self) {
        self.take_pending = false;
    }

    /// A new life: ownership of the old one is void, coverage stays.
    pub fn new_life(&mut self, me: Member) {
        self.rounds.set_me(me);
        self.sections.reset_ownership();
        self.dividing = None;
        self.bid_wanted = false;
        self.take_pending = false;
    }

    /// Notes how other owners get on; the first ETA heard in an epoch bounds them.
    fn watch_progress(&mut self, ctx: &Context<'_>) {
        let cell_bound = 12_000 + 2 * u64::from(ctx.diameter) * ctx.period_ms;
        let heard: Vec<(u16, Epoch, u32)> = self
            .sections
            .heard()
            .iter()
            .map(|(id, h)| (*id, h.claim.epoch, h.claim.eta_ms))
            .collect();
        for (id, epoch, eta_ms) in heard {
            let left = self.sections.plan_of(id).len();
            let slack = u64::from(eta_ms / 4) + 10 * ctx.period_ms + cell_bound;
            let fresh = Progress {
                left,
                since: ctx.now,
                bound: ctx.now.plus_ms(u64::from(eta_ms) + slack),
                epoch,
            };
            let p = self.progress.entry(id).or_insert(fresh);
            if p.epoch != epoch || left > p.left {
                *p = fresh;
            } else if left < p.left {
                p.left = left;
                p.since = ctx.now;
            }
        }
    }

    /// Inheritance: what to take without a round, if anything.
    fn inherit(
        &self,
        ctx: &Context<'_>,
        orphans: &CellSet,
        lp: &CoverageLoop,
    ) -> Option<Vec<(u16, bool)>> {
        if self.take_pending {
            return None;
        }
        let stagger = self.rank(ctx) * ctx.period_ms / 2;
        if let Some(since) = self.orphan_since {
            let patience = 2 * ctx.period_ms + ctx.base_wait_ms() + stagger;
            return (ctx.now.since_ms(since) >= patience)
                .then(|| self.nearest_run(orphans, lp))
                .flatten();
        }
        let idle_ms = self.idle_since.map(|t| ctx.now.since_ms(t))?;
        if idle_ms < 10 * ctx.period_ms + stagger || self.rounds.open().is_some() {
            return None;
        }
        let stalled_ms = 12_000 + (10 + 2 * u64::from(ctx.diameter)) * ctx.period_ms + stagger;
        let (owner, _) = self.progress.iter().find(|(id, p)| {
            p.left > 0
                && ctx.live.contains_key(id)
                && (ctx.now.since_ms(p.since) >= 3 * stalled_ms || ctx.now >= p.bound)
        })?;
        Some(far_half(&self.sections.plan_of(*owner)))
    }

    /// The run of orphans nearest along the loop to where this peer works.
    fn nearest_run(&self, orphans: &CellSet, lp: &CoverageLoop) -> Option<Vec<(u16, bool)>> {
        let n = i32::from(self.sections.cells());
        let here = self.sections.plan().last().map(|p| i32::from(p.cell));
        let here = here.unwrap_or_else(|| {
            let members = lp.len() as u64;
            i32::try_from(u64::from(self.me) * 7919 % members.max(1)).unwrap_or(0)
        });
        let away = |c: u16| {
            let d = (i32::from(c) - here).rem_euclid(n);
            d.min(n - d)
        };
        let (first, count) = orphans
            .runs()
            .into_iter()
            .map(|r| (r.first, r.count))
            .min_by_key(|(first, count)| {
                let last = u16::try_from((i32::from(*first) + i32::from(*count) - 1).rem_euclid(n))
                    .unwrap_or(0);
                (away(*first).min(away(last)), *first)
            })?;
        let last =
            u16::try_from((i32::from(first) + i32::from(count) - 1).rem_euclid(n)).unwrap_or(0);
        let backward = away(last) < away(first);
        let mut cells: Vec<(u16, bool)> = (first..=last).map(|c| (c, backward)).collect();
        if backward {
            cells.reverse();
        }
        Some(cells)
    }
}

/// The second half of an owner's plan, from its far end.
fn far_half(plan: &[PlannedCell]) -> Vec<(u16, bool)> {
    plan.iter()
        .skip(plan.len() / 2)
        .rev()
        .map(|p| (p.cell, !p.backward))
        .collect()
}
