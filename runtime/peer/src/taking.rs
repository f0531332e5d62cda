//! What a peer takes without a round, computed from what it holds (D2.7 §3.6.5): its first
//! section, orphans or a part of a slower one's plan among many, and what was beyond everybody's
//! endurance. The rules are [`crate::protocol::sharing`]'s; when they are used,
//! [`crate::protocol::negotiation`]'s.

use crate::cells::CellSet;
use crate::cooperation::{Situation, speed_mmps};
use crate::mission_state::MissionState;
use crate::protocol::negotiation::{Context, SETTLE_PERIODS};
use crate::protocol::runs::{PlannedCell, cells_of, legs_of};
use crate::protocol::sharing::{self, Hand, Pace, Site};
use crate::wire::message::CellRun;
use skein_behaviors::Percept;
use skein_flight::coverage::ring::backtracking::Leg;
use skein_flight::coverage::ring::{Direction, LoopCell};

impl MissionState {
    /// What this peer, among many, takes without a round: orphans, or a part of what a slower
    /// one has left.
    pub(crate) fn wanted_without_a_round(
        &mut self,
        s: &Situation<'_>,
        ctx: &Context<'_>,
    ) -> Option<Vec<(u16, Direction)>> {
        if !self.negotiation.looks_around(ctx) {
            return None;
        }
        let me = self.hand(s)?;
        let spendable_ms = u64::from(self.spendable_ms(s.percept));
        if let Some(orphaned_ms) = self.negotiation.orphaned_ms(ctx) {
            let share = self.even_share(ctx);
            let orphans = self.negotiation.sections.orphans(ctx.live);
            let nearest = sharing::nearest_orphans(&orphans.runs(), &me, share, self.pace()?);
            return nearest
                .filter(|(way_ms, _)| self.negotiation.is_my_turn(ctx, orphaned_ms, *way_ms))
                .and_then(|(_, cells)| self.flown_besides(cells, spendable_ms));
        }
        if !self.negotiation.may_relieve(ctx, me.free_ms) {
            return None;
        }
        let owners = self.negotiation.owners(ctx);
        let is_owner = |id: u16| owners.iter().any(|o| o.id == id && o.left_ms > 0);
        let idle = ctx.members.iter().map(|m| m.id);
        let idle = idle.filter(|id| *id != me.id && !is_owner(*id));
        let others = idle.filter_map(|id| {
            let at = s.membership.info(id)?.place?.pose().position();
            Some(Hand { id, at, free_ms: 0 })
        });
        let hands: Vec<Hand> = others.chain([me]).collect();
        // A claim is stored, spoken, and heard even if it is lost once.
        let least_ms = SETTLE_PERIODS * ctx.period_ms;
        let (cells, by_ms) = sharing::relief(&owners, &hands, me.id, self.pace()?, least_ms)?;
        self.flown_besides(cells, by_ms.min(spendable_ms))
    }

    /// An even share of the loop near this peer, judged from where its neighbours are. Whoever
    /// is there counts: at its first beacon nobody is able yet.
    pub(crate) fn first_section(
        &mut self,
        s: &Situation<'_>,
        ctx: &Context<'_>,
    ) -> Option<Vec<PlannedCell>> {
        if !self.negotiation.begins(ctx) {
            return None;
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
        let mine = self.flown_besides(mine, u64::from(self.spendable_ms(s.percept)))?;
        self.negotiation.begin_first(&mine, way_ms)
    }

    /// Of cells that are to be flown after the plan those that are flown by then, if any are.
    fn flown_besides(
        &self,
        mut cells: Vec<(u16, Direction)>,
        by_ms: u64,
    ) -> Option<Vec<(u16, Direction)>> {
        let sections = &self.negotiation.sections;
        let mut plan = sections.plan().to_vec();
        plan.extend(sections.taken(&cells));
        let legs = legs_of(&plan, sections.cells());
        let is_open = |c: u16| !sections.covered().contains(c);
        let times = self.executive.as_ref()?.schedule(&legs, &is_open);
        let in_time = times.iter().take_while(|(_, ms)| u64::from(*ms) <= by_ms);
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

    /// How many cells each has to fly yet, if all have as many.
    fn even_share(&self, ctx: &Context<'_>) -> u16 {
        let covered = self.covered();
        let open = covered.capacity().saturating_sub(covered.count());
        let members = u16::try_from(ctx.members.len()).unwrap_or(u16::MAX);
        open.div_ceil(members.max(1))
    }

    /// Of the runs of some cells the part that can be flown with the fuel that is left, from
    /// one end on: the longest.
    pub(crate) fn within_reach(
        &self,
        cells: &CellSet,
        percept: Option<&Percept>,
    ) -> Option<Vec<(u16, Direction)>> {
        let executive = self.executive.as_ref()?;
        let spendable = self.spendable_ms(percept);
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
            let times = executive.schedule(&[leg], &|c| cells.contains(c));
            let within = times.into_iter().take_while(|(_, ms)| *ms <= spendable);
            within.map(|(cell, _)| (cell, leg.direction)).collect()
        };
        let reach = cells.runs().into_iter().flat_map(both_ways).map(flown);
        reach.max_by_key(Vec::len).filter(|run| !run.is_empty())
    }
}
