//! What a peer takes without a round: when, and what of it the claims that it heard decide.
//! What is worth taking is [`crate::protocol::sharing`]'s and
//! [`crate::mission_state::MissionState`]'s.

use super::{Context, Negotiation, PATIENT_INTERVALS, SHORT_INTERVALS, TWO_CELLS_MS};
use crate::Time;
use crate::cells::CellSet;
use crate::protocol::runs::PlannedCell;
use crate::protocol::sharing::Owner;
use crate::wire::message::Epoch;
use skein_flight::coverage::ring::{CoverageLoop, Direction};

/// Spreads peers without a plan over the loop, so that not all of them take the same
/// orphans first: a prime above the cells of any loop flown yet, whose multiples by
/// small ids lie far apart.
const SPREAD: u64 = 7919;

/// A peer takes its first section after so many quarters of an interval of listening: who began
/// with it has said twice by then where it is.
const FIRST_SECTION_QUARTERS: u64 = 6;

/// How near the begin of a first section is counts in its stamps as takes: from this many,
/// one less for each four seconds of flight, in which a UAV passes a cell.
const NEARNESS_MAX: u64 = 60;

const NEARNESS_STEP_MS: u64 = 4000;

/// Among many a peer looks this often in an interval for what it could take.
const LOOKS_AN_INTERVAL: u64 = 2;

/// Among many a peer waits so many intervals for each who would be at an orphan sooner: a claim
/// is stored, waits for its turn on the air, and is heard.
const SOONER_INTERVALS: u64 = 2;

/// Peers take orphans one after the other by rank, this part of an interval apart: a take has
/// to be durable before others can hear of it.
const TAKE_STAGGER: u64 = 2;

impl Negotiation {
    /// Whether this peer is to take a first section: it listened for a while, unless it knows who
    /// begins where, and as far as it knows nothing was divided yet. Asked once.
    pub fn take_begin(&mut self, ctx: &Context<'_>, knows_where: bool) -> bool {
        let quarters = if knows_where {
            0
        } else {
            FIRST_SECTION_QUARTERS
        };
        let listened_ms = quarters * ctx.interval_ms / 4;
        let listened = ctx
            .able_since
            .is_some_and(|t| ctx.now.since_ms(t) >= listened_ms);
        if self.began || !listened {
            return false;
        }
        self.began = true;
        let untouched = self.rounds.counter() == 0
            && self.sections.epoch() == Epoch::default()
            && self.sections.plan().is_empty();
        self.provisional = untouched && ctx.uavs() > 1;
        self.provisional
    }

    /// Whether this peer, among many, is to look for what it could take: half an interval
    /// after it looked last.
    pub fn take_look(&mut self, ctx: &Context<'_>) -> bool {
        let rested = |t| ctx.now.since_ms(t) >= ctx.interval_ms / LOOKS_AN_INTERVAL;
        let looks = ctx.is_many()
            && ctx.able_since.is_some()
            && !self.sections.complete()
            && !self.take_pending
            && self.rounds.open().is_none()
            && self.looked_at.is_none_or(rested);
        if looks {
            self.looked_at = Some(ctx.now);
        }
        looks
    }

    /// Orphans that others had the time to claim.
    #[must_use]
    pub fn ripe_orphans(&self, ctx: &Context<'_>) -> CellSet {
        self.orphans_older_than(ctx, SHORT_INTERVALS * ctx.interval_ms)
    }

    /// Orphans that everybody had the time to take who had nothing to fly: it was the turn of
    /// each of them, so none of them can fly these.
    #[must_use]
    pub fn overdue_orphans(&self, ctx: &Context<'_>) -> CellSet {
        self.orphans_older_than(ctx, overdue_ms(ctx))
    }

    fn orphans_older_than(&self, ctx: &Context<'_>, ms: u64) -> CellSet {
        self.orphaned_at.older_than(ctx.now, ms)
    }

    /// Whether an orphan has waited for long enough for so many who would be there sooner, the
    /// first of them by so much.
    #[must_use]
    pub fn is_my_turn(
        &self,
        ctx: &Context<'_>,
        orphan: u16,
        (sooner, later_ms): (usize, u64),
    ) -> bool {
        let for_others_ms = for_sooner_ms(ctx, sooner, ctx.first_wait_ms()).max(later_ms);
        let patience_ms = SHORT_INTERVALS * ctx.interval_ms + for_others_ms;
        self.is_orphan_for(ctx, orphan, patience_ms)
    }

    /// The same of an overdue one, for so many who have something to fly and would be there
    /// sooner. No longer than that: nobody else is left.
    #[must_use]
    pub fn is_my_turn_at_last(&self, ctx: &Context<'_>, orphan: u16, sooner: usize) -> bool {
        let for_others_ms = for_sooner_ms(ctx, sooner, ctx.first_wait_ms() / 2);
        self.is_orphan_for(ctx, orphan, overdue_ms(ctx) + for_others_ms)
    }

    fn is_orphan_for(&self, ctx: &Context<'_>, orphan: u16, ms: u64) -> bool {
        let since = self.orphaned_at.since(orphan);
        since.is_some_and(|t| ctx.now.since_ms(t) >= ms)
    }

    /// Whether this peer will have nothing to fly before others have heard what it takes.
    #[must_use]
    pub fn may_relieve(&self, ctx: &Context<'_>, free_ms: u64) -> bool {
        free_ms <= SHORT_INTERVALS * ctx.interval_ms
    }

    /// Where the last plan of another peer that had any cells ended, covered since or not.
    #[must_use]
    pub fn end_of(&self, id: u16) -> Option<u16> {
        self.ends_at.get(&id).copied()
    }

    /// The live owners with what they have left, but for what others took of it since.
    #[must_use]
    pub fn owners(&self, ctx: &Context<'_>) -> Vec<Owner> {
        let contested = self.sections.contested(ctx.live);
        let above = |c: &PlannedCell| contested.get(&c.cell);
        let is_taken = |c: &PlannedCell| above(c).is_some_and(|s| *s > c.stamp);
        let at_work = self
            .progress
            .iter()
            .filter(|(id, _)| ctx.live.contains_key(id));
        at_work
            .filter_map(|(id, p)| {
                let listed = self.sections.plan_of(*id);
                if listed.is_empty() {
                    return None;
                }
                let mut plan = Vec::with_capacity(listed.len());
                let left = listed.iter().filter(|c| !is_taken(c));
                plan.extend(left.map(|c| (c.cell, c.direction)));
                let left_ms = p.end.since_ms(ctx.now) * plan.len() as u64 / listed.len() as u64;
                Some(Owner {
                    id: *id,
                    plan,
                    left_ms,
                })
            })
            .collect()
    }

    /// The takes are durable.
    pub fn append_take(&mut self, taken: &[PlannedCell]) {
        self.take_pending = false;
        self.sections.append(taken);
    }

    /// The takes were not made durable: they may be tried again.
    pub fn cancel_take(&mut self) {
        self.take_pending = false;
    }

    /// Inheritance: what to take without a round, if anything.
    pub(super) fn inherit(
        &self,
        ctx: &Context<'_>,
        orphans: &CellSet,
        lp: &CoverageLoop,
    ) -> Option<Vec<(u16, Direction)>> {
        if self.take_pending {
            return None;
        }
        let stagger = self.rank(ctx) * ctx.interval_ms / TAKE_STAGGER;
        if let Some(since) = self.orphan_since {
            if ctx.is_many() {
                return None;
            }
            let waited = ctx.first_wait_ms() + stagger;
            let patience = SHORT_INTERVALS * ctx.interval_ms + waited;
            let overdue = self.overdue_ms(ctx).is_some_and(|ms| ms >= waited);
            return (overdue || ctx.now.since_ms(since) >= patience)
                .then(|| self.nearest_run(orphans, lp))
                .flatten();
        }
        let idle_ms = self.idle_since.map(|t| ctx.now.since_ms(t))?;
        if idle_ms < PATIENT_INTERVALS * ctx.interval_ms + stagger || self.rounds.open().is_some() {
            return None;
        }
        let stalled_ms = TWO_CELLS_MS
            + (PATIENT_INTERVALS + 2 * u64::from(ctx.diameter)) * ctx.interval_ms
            + stagger;
        let (owner, _) = self.progress.iter().find(|(id, p)| {
            p.left > 0
                && ctx.live.contains_key(id)
                && (ctx.now.since_ms(p.since) >= 3 * stalled_ms || ctx.now >= p.bound)
        })?;
        Some(far_half(&self.sections.plan_of(*owner)))
    }

    /// Cells to be taken: nothing more is until they are durable or cannot be.
    pub fn begin_take(&mut self, cells: &[(u16, Direction)]) -> Option<Vec<PlannedCell>> {
        let taken = self.sections.taken(cells);
        self.take_pending = !taken.is_empty();
        self.take_pending.then_some(taken)
    }

    /// As [`Negotiation::begin_take`], of cells that nobody is known to list, the first of which
    /// is flown so soon: of two who take the same, the one that begins sooner outranks the other.
    pub fn begin_nearest(
        &mut self,
        cells: &[(u16, Direction)],
        begins_ms: u64,
    ) -> Option<Vec<PlannedCell>> {
        self.begin_each(&[(begins_ms, cells.to_vec())])
    }

    /// The same of several runs, each begun so soon.
    pub fn begin_each(
        &mut self,
        runs: &[(u64, Vec<(u16, Direction)>)],
    ) -> Option<Vec<PlannedCell>> {
        let cells: Vec<_> = runs.iter().flat_map(|(_, cells)| cells).copied().collect();
        let mut taken = self.begin_take(&cells)?;
        for (begins_ms, cells) in runs {
            let away = (begins_ms / NEARNESS_STEP_MS).min(NEARNESS_MAX);
            let nearness = u16::try_from(NEARNESS_MAX - away).unwrap_or(0);
            let of_this = |p: &&mut PlannedCell| cells.iter().any(|(cell, _)| *cell == p.cell);
            for p in taken.iter_mut().filter(of_this) {
                p.stamp.take = p.stamp.take.saturating_add(nearness);
            }
        }
        Some(taken)
    }

    /// What an idle peer may try to fly although no division could give it to anybody: fuel
    /// that others were to need may be left, or be back. Looked at once in ten intervals.
    pub fn take_left_over(&mut self, ctx: &Context<'_>) -> Option<CellSet> {
        let stagger = self.rank(ctx) * ctx.interval_ms / TAKE_STAGGER;
        let patience = PATIENT_INTERVALS * ctx.interval_ms;
        let for_long = |since: Option<Time>, ms| since.is_some_and(|t| ctx.now.since_ms(t) >= ms);
        let idle = ctx.able_since.is_some() && for_long(self.idle_since, patience + stagger);
        let busy = self.take_pending || self.orphan_since.is_some() || self.rounds.open().is_some();
        let rested = self.left_over_at.is_none() || for_long(self.left_over_at, patience);
        if !idle || busy || !rested {
            return None;
        }
        self.left_over_at = Some(ctx.now);
        Some(self.sections.left_over(ctx.live))
    }

    /// The run of orphans nearest along the loop to where this peer works.
    pub(super) fn nearest_run(
        &self,
        orphans: &CellSet,
        lp: &CoverageLoop,
    ) -> Option<Vec<(u16, Direction)>> {
        let n = i32::from(self.sections.cells());
        let here = self.sections.plan().last().map(|p| i32::from(p.cell));
        let here = here.unwrap_or_else(|| {
            let n_cells = lp.len() as u64;
            i32::try_from(u64::from(self.me) * SPREAD % n_cells.max(1)).unwrap_or(0)
        });
        let away = |c: u16| {
            let d = (i32::from(c) - here).rem_euclid(n);
            d.min(n - d)
        };
        // No run crosses the seam.
        let ends = orphans.runs().into_iter();
        let ends = ends.map(|r| (r.first, r.first + (r.count - 1)));
        let (first, last) =
            ends.min_by_key(|(first, last)| (away(*first).min(away(*last)), *first))?;
        if away(last) < away(first) {
            let cells = (first..=last).rev();
            Some(cells.map(|c| (c, Direction::Backward)).collect())
        } else {
            Some((first..=last).map(|c| (c, Direction::Forward)).collect())
        }
    }
}

/// After so long it was everybody's turn to take an orphan who had nothing to fly.
fn overdue_ms(ctx: &Context<'_>) -> u64 {
    SHORT_INTERVALS * ctx.interval_ms + ctx.first_wait_ms()
}

/// How long an orphan is left to so many who would be there sooner.
fn for_sooner_ms(ctx: &Context<'_>, sooner: usize, most_ms: u64) -> u64 {
    (sooner as u64 * SOONER_INTERVALS * ctx.interval_ms).min(most_ms)
}

/// The second half of an owner's plan, from its far end.
fn far_half(plan: &[PlannedCell]) -> Vec<(u16, Direction)> {
    plan.iter()
        .skip(plan.len() / 2)
        .rev()
        .map(|p| (p.cell, p.direction.opposite()))
        .collect()
}
