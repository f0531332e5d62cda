//! What a peer takes without a round, computed from what it holds (D2.7 §3.6.5): its first
//! section, orphans or a part of a slower one's plan among many, and what was beyond everybody's
//! endurance. The rules are [`crate::protocol::sharing`]'s; when they are used,
//! [`crate::protocol::negotiation`]'s. These are questions to a [`MissionState`] that need all of
//! it: loop, executive, sections, company.

use crate::cells::CellSet;
use crate::cooperation::Situation;
use crate::mission_state::{MissionState, speed_mmps};
use crate::protocol::airtime::LASTING_INTERVALS;
use crate::protocol::negotiation::{Context, SETTLE_INTERVALS};
use crate::protocol::runs::{PlannedCell, cells_of, legs_of};
use crate::protocol::sharing::{self, Hand, Owner, Pace, Site, Taken};
use crate::wire::message::CellRun;
use skein_behaviors::Percept;
use skein_flight::coverage::ring::backtracking::Leg;
use skein_flight::coverage::ring::{Direction, LoopCell};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A cell is flown in about so long, milliseconds.
const CELL_MS: u64 = 4000;

impl MissionState {
    /// What this peer, among many, takes without a round: orphans, or a part of what a slower
    /// one has left.
    pub(crate) fn taken_without_a_round(
        &mut self,
        s: &Situation<'_>,
        ctx: &Context<'_>,
    ) -> Option<Vec<PlannedCell>> {
        if !self.negotiation.take_look(ctx) {
            return None;
        }
        let me = self.hand(s)?;
        let orphans = self.negotiation.ripe_orphans(ctx);
        let may_relieve = self.negotiation.may_relieve(ctx, me.free_ms);
        if orphans.is_empty() && !may_relieve {
            return None;
        }
        let owners = self.negotiation.owners(ctx);
        let others = self.hands(s, ctx, &owners);
        let pace = self.pace()?;
        let by_ms = if may_relieve {
            u64::MAX
        } else {
            pace.in_time_ms(&owners, me.free_ms, &orphans, ctx.uavs())
        };
        let wanted = self.wanted_orphans((s, ctx), &orphans, (&me, &others), by_ms);
        if let Some((begins_ms, cells)) = wanted {
            return self.negotiation.begin_nearest(&cells, begins_ms);
        }
        if !may_relieve {
            let runs = self.overdue_orphans((s, ctx), (&me, &others))?;
            return self.negotiation.begin_each(&runs);
        }
        let hands = others.into_iter().filter(|h| h.free_ms == 0);
        let hands: Vec<Hand> = hands.chain([me]).collect();
        // A claim is stored, spoken, and heard even if it is lost once.
        let least_ms = SETTLE_INTERVALS * ctx.interval_ms;
        let (cells, by_ms) = sharing::relief(&owners, &hands, me.id, pace, least_ms)?;
        let cells = self.flown_besides(cells, by_ms, s.percept)?;
        self.negotiation.begin_take(&cells)
    }

    /// Orphans that it is this peer's turn to take, and when it would begin with them: the
    /// nearest, and if it can fly none of them with nothing else to fly, of any what it can.
    /// It takes only what it would have flown by a time; those who have less to fly are to take
    /// the rest.
    fn wanted_orphans(
        &self,
        (s, ctx): (&Situation<'_>, &Context<'_>),
        orphans: &CellSet,
        (me, others): (&Hand, &[Hand]),
        by_ms: u64,
    ) -> Option<(u64, Vec<(u16, Direction)>)> {
        let (pace, share) = (self.pace()?, self.share_at_once(ctx));
        let among = (orphans, self.covered());
        let (begins_ms, cells) = sharing::nearest_orphans(among, me, share, pace, |_, _| true)?;
        let first = cells.first()?.0;
        let elsewhere = ctx.members.len().saturating_sub(others.len() + 1);
        let sooner = pace.how_many_sooner(me, (others, elsewhere), first);
        if !self.negotiation.is_my_turn(ctx, first, sooner) {
            return None;
        }
        let idle = self.negotiation.sections.plan().is_empty();
        let any = || self.within_reach(orphans, s.percept).filter(|_| idle);
        let cells = self.flown_besides(cells, by_ms, s.percept).or_else(any)?;
        Some((begins_ms, cells))
    }

    /// Orphans that nobody took who has nothing to fly, though it was the turn of each: for
    /// want of fuel, mostly. Whoever has something to fly takes them then, the one that would be
    /// there soonest first, however much that is: or they would wait for one that never comes.
    /// What was seen in passing leaves short runs, and few may be left who can fly any: so one
    /// takes of as many runs as make a share, each with when it would begin there.
    fn overdue_orphans(
        &self,
        (s, ctx): (&Situation<'_>, &Context<'_>),
        (me, others): (&Hand, &[Hand]),
    ) -> Option<Vec<Taken>> {
        let overdue = self.negotiation.overdue_orphans(ctx);
        let (pace, share) = (self.pace()?, self.share_at_once(ctx));
        let at_work = others.iter().copied().filter(|h| h.free_ms > 0);
        let at_work: Vec<Hand> = at_work.collect();
        let is_my_turn = |me: &Hand, first: u16| {
            let (sooner, _) = pace.how_many_sooner(me, (&at_work, 0), first);
            self.negotiation.is_my_turn_at_last(ctx, first, sooner)
        };
        let overdue = (overdue, self.covered());
        let mut taken = sharing::share_of_orphans(overdue, me, share, pace, is_my_turn);
        let all = taken.iter().flat_map(|(_, cells)| cells).copied().collect();
        let flown = self.flown_besides(all, u64::MAX, s.percept)?;
        for (_, cells) in &mut taken {
            cells.retain(|cell| flown.contains(cell));
        }
        taken.retain(|(_, cells)| !cells.is_empty());
        Some(taken)
    }

    /// The other members, where and when each has nothing to fly any more, as far as is known:
    /// at the end of its plan, or where it was last heard, or at the end of the last plan that it
    /// is known to have had.
    fn hands(&self, s: &Situation<'_>, ctx: &Context<'_>, owners: &[Owner]) -> Vec<Hand> {
        let others = ctx.members.iter().map(|m| m.id).filter(|id| *id != s.me.id);
        let end = |cell: u16| {
            let boundary = self.geometry.coverage_loop.boundary(usize::from(cell));
            boundary.position()
        };
        let hand = |id: u16| {
            let owner = owners.iter().find(|o| o.id == id && o.left_ms > 0);
            let last = owner.and_then(|o| Some((o.plan.last()?.0, o.left_ms)));
            if let Some((cell, free_ms)) = last {
                let at = end(cell);
                return Some(Hand { id, at, free_ms });
            }
            let info = s.membership.info(id)?;
            let lately = |t| s.now.since_ms(t) < LASTING_INTERVALS * ctx.interval_ms;
            let place = info.place.filter(|_| info.heard.is_some_and(lately));
            let place = place.map(|p| p.pose().position());
            let at = place.or_else(|| self.negotiation.end_of(id).map(end))?;
            Some(Hand { id, at, free_ms: 0 })
        };
        others.filter_map(hand).collect()
    }

    /// The section that the roster gives to this peer, where there is one; and until their own
    /// claims are heard the others are taken to have theirs.
    fn launched(&mut self, s: &Situation<'_>) -> Option<Vec<PlannedCell>> {
        let geometry = Arc::clone(&self.geometry);
        let (mut mine, mut expected) = (Vec::new(), BTreeMap::new());
        for p in geometry.first_division(self.company.launches()).iter() {
            if p.id == s.me.id {
                let flown = cells_of(p.run, self.negotiation.sections.cells());
                mine = flown.map(|c| (c, p.direction)).collect();
                if p.direction == Direction::Backward {
                    mine.reverse();
                }
                continue;
            }
            let eta_ms = u32::try_from(p.end_ms).unwrap_or(u32::MAX);
            expected.insert(p.id, s.now.plus_ms(p.end_ms));
            let sections = &mut self.negotiation.sections;
            sections.presume(p.id, p.run, p.direction, eta_ms);
        }
        self.company.expect(expected);
        let mine = self.flown_besides(mine, u64::MAX, s.percept)?;
        self.negotiation.begin_take(&mine)
    }

    /// An even share of the loop near this peer, judged from where its neighbours are. Whoever
    /// is there counts: at its first beacon nobody is able yet.
    pub(crate) fn first_section(
        &mut self,
        s: &Situation<'_>,
        ctx: &Context<'_>,
    ) -> Option<Vec<PlannedCell>> {
        let is_launched = self.company.launches().iter().any(|l| l.id == s.me.id);
        if !self.negotiation.take_begin(ctx, is_launched) {
            return None;
        }
        if is_launched {
            return self.launched(s);
        }
        let executive = self.executive.as_ref()?;
        let info = |id: &u16| s.membership.info(*id).filter(|i| !i.ground_station);
        let others = ctx.live.keys().copied();
        let others: Vec<u16> = others.filter(|id| info(id).is_some()).collect();
        let site = |id, pose| {
            let anchor = executive.anchor_from(pose)?;
            Some(Site { anchor, id })
        };
        let sites = others.iter().filter_map(|id| {
            let heard = info(id).filter(|i| i.loop_hash == self.loop_hash())?;
            site(*id, heard.place?.pose())
        });
        let sites = sites.chain(site(s.me.id, s.percept?.pose)).collect();
        let sections = &self.negotiation.sections;
        let n = sections.cells();
        let cells = self.geometry.coverage_loop.cells().iter();
        let lengths_mm: Vec<u32> = cells.map(LoopCell::flown_mm).collect();
        let run = sharing::first_section(sites, others.len() + 1, &lengths_mm, s.me.id)?;
        let orphans = sections.orphans(ctx.live);
        let mine = cells_of(run, n).filter(|c| orphans.contains(*c));
        let mine: Vec<_> = mine.map(|c| (c, Direction::Forward)).collect();
        let way_ms = self.pace()?.way_ms(self.hand(s)?.at, run.first);
        let mine = self.flown_besides(mine, u64::MAX, s.percept)?;
        self.negotiation.begin_nearest(&mine, way_ms)
    }

    /// Of cells that are to be flown after the plan those that a claim has room for and that are
    /// flown by then, with enough left for the way home, if any are.
    fn flown_besides(
        &self,
        mut cells: Vec<(u16, Direction)>,
        by_ms: u64,
        percept: Option<&Percept>,
    ) -> Option<Vec<(u16, Direction)>> {
        let sections = &self.negotiation.sections;
        let mut plan = sections.plan().to_vec();
        plan.extend(sections.taken(&cells));
        plan.truncate(sections.fitting(&plan));
        let legs = legs_of(&plan, sections.cells());
        let is_open = |c: u16| !sections.covered().contains(c);
        let executive = self.executive.as_ref()?;
        let within = executive.within_endurance(&legs, &is_open, percept?);
        let in_time = within
            .cells
            .iter()
            .take_while(|(_, ms)| u64::from(*ms) <= by_ms);
        let in_time = CellSet::of(sections.cells(), in_time.map(|(c, _)| *c));
        cells.retain(|(c, _)| in_time.contains(*c));
        (!cells.is_empty()).then_some(cells)
    }

    /// This peer as one that will have nothing to fly, where its plan ends.
    fn hand(&self, s: &Situation<'_>) -> Option<Hand> {
        let plan = self.negotiation.sections.plan();
        let end = |cell: u16| self.geometry.coverage_loop.boundary(usize::from(cell));
        let here = || s.percept.map(|p| p.pose);
        Some(Hand {
            id: s.me.id,
            at: plan
                .last()
                .map_or_else(here, |p| Some(end(p.cell)))?
                .position(),
            free_ms: u64::from(self.eta_ms()),
        })
    }

    fn pace(&self) -> Option<Pace<'_>> {
        let executive = self.executive.as_ref()?;
        Some(Pace {
            coverage_loop: &self.geometry.coverage_loop,
            speed_mmps: speed_mmps(executive),
            turn_ms: executive.turn_ms(),
        })
    }

    /// How many orphans are taken at once: as many as each has to fly yet if all have as many,
    /// and no fewer than are flown until others have heard of it.
    fn share_at_once(&self, ctx: &Context<'_>) -> u16 {
        let covered = self.covered();
        let open = covered.capacity().saturating_sub(covered.count());
        let members = u16::try_from(ctx.members.len()).unwrap_or(u16::MAX);
        let heard_ms = SETTLE_INTERVALS * ctx.interval_ms;
        let meanwhile = u16::try_from(heard_ms / CELL_MS).unwrap_or(u16::MAX);
        open.div_ceil(members.max(1)).max(meanwhile)
    }

    /// Of the runs of some cells the part that can be flown with the fuel that is left, with the
    /// way home from where it ends, from one end on: the longest.
    pub(crate) fn within_reach(
        &self,
        cells: &CellSet,
        percept: Option<&Percept>,
    ) -> Option<Vec<(u16, Direction)>> {
        let (executive, percept) = (self.executive.as_ref()?, percept?);
        let both_ways = |run: CellRun| {
            let leg = |first: u16, direction: Direction| Leg {
                first,
                count: run.count,
                direction,
            };
            let last = run.first + (run.count - 1);
            [
                leg(run.first, Direction::Forward),
                leg(last, Direction::Backward),
            ]
        };
        let flown = |leg: Leg| -> Vec<(u16, Direction)> {
            let is_open = |c| cells.contains(c);
            let within = executive.within_endurance(&[leg], &is_open, percept);
            let cells = within.cells.into_iter();
            cells.map(|(cell, _)| (cell, leg.direction)).collect()
        };
        let reach = cells.runs().into_iter().flat_map(both_ways).map(flown);
        reach.max_by_key(Vec::len).filter(|run| !run.is_empty())
    }
}
