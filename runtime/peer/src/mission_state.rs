//! What a peer has once it holds a mission and its geometry, and what of it is kept when
//! another mission arrives.
//!
//! | the new mission has | kept |
//! |---|---|
//! | the same loop | sections, rounds, claims being written, since when it is able |
//! | and the same zones, turn radius and clearance | the flight itself, with its goal |
//! | another loop, the same lap | covered cells of the same places |
//! | another lap | nothing is covered |
//! | any | the highest round counter; what the journal knows of that loop |
//!
//! What is done with a mission is the cooperation manager's.

use crate::Incarnation;
use crate::cells::CellSet;
use crate::config::{Launch, PeerConfig};
use crate::input::Time;
use crate::journal::Durable;
use crate::mission::{PointMm, ring_mm};
use crate::offload::MissionGeometry;
use crate::protocol::Negotiation;
use crate::protocol::negotiation::are_many;
use crate::protocol::sections::{FIRST_LIFE, LivePeers};
use crate::timers::{Timer, Timers};
use crate::wire::limits::MEMBERS_MAX;
use crate::wire::message::{Activity, Claim, Member, MissionStatus};
use skein_behaviors::{Executive, Goal, Percept};
use skein_flight::coverage::ring::patch::Patches;
use skein_flight::coverage::ring::{CellId, CoverageLoop};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Claims on their way to the journal, numbered in the order in which it gets them. Only
/// the last of them may be installed, for it is the one that the journal ends with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ClaimsWritten {
    written: u64,
    answered: u64,
}

impl ClaimsWritten {
    /// All that was written so far is void: none of it is the last.
    fn void(self) -> Self {
        let written = self.written + 1;
        Self {
            written,
            answered: written,
        }
    }

    /// The number of one more.
    pub fn next(&mut self) -> u64 {
        self.written += 1;
        self.written
    }

    /// The answer to one of them came. Returns whether it is the last.
    pub fn answer(&mut self, number: u64) -> bool {
        self.answered = self.answered.max(number);
        assert!(self.answered <= self.written, "an answer to nothing");
        number >= self.written
    }

    /// Whether one of them is still on its way.
    pub fn under_way(self) -> bool {
        self.answered < self.written
    }
}

/// Who is there to share the work, and what this was computed from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Company {
    /// The others whose claims count.
    pub live: LivePeers,
    /// Of them those that can plan on this loop, this peer included if it can.
    pub members: Vec<Member>,
    /// How many of them were never heard of.
    pub unheard: usize,
    /// As it was numbered by the membership, for this peer, able or not; none where it is to
    /// be looked up again.
    pub of: Option<(u64, Member, bool)>,
    /// The lives in which peers said that they are alone.
    pub alone: BTreeMap<u16, Incarnation>,
    /// When somebody is not expected any more.
    pub until: Time,
}

/// What a peer has once it holds a mission and its geometry.
#[derive(Debug)]
pub(crate) struct MissionState {
    pub geometry: Arc<MissionGeometry>,
    pub executive: Option<Executive>,
    pub negotiation: Negotiation,
    pub goal: Option<Goal>,
    /// Whether the goal is to be given to the executive again.
    pub replan: bool,
    /// Since when this peer can plan without a break.
    pub able_since: Option<crate::Time>,
    /// Who shared the work at the last tick.
    pub company: Arc<Company>,
    /// Whether all others were believed down at the last tick.
    pub alone: bool,
    pub finished: bool,
    /// Whether it heard of many and hears nobody now.
    pub astray: bool,
    /// Whether another process under its id has silenced this peer.
    pub silent: bool,
    /// Whether its fuel is due: it flies home until some is back.
    pub exhausted: bool,
    /// When its plan was last compared with what the fuel allows.
    pub fuel_looked_at: Option<crate::Time>,
    /// Cells covered by itself since the last entry of the journal.
    pub unsaved_cells: u16,
    pub claims: ClaimsWritten,
    /// The roster: who begins where.
    pub launches: Arc<[Launch]>,
    /// Who of it was not heard of yet, and until when it is taken to be there.
    pub expected: BTreeMap<u16, Time>,
}

impl MissionState {
    /// What it owned is void.
    pub fn void_ownership(&mut self, me: Member, timers: &mut Timers) {
        timers.stop(Timer::HeldCells);
        self.negotiation.void_ownership(me);
        if me.incarnation > FIRST_LIFE {
            self.launches = Arc::from([]);
            self.expected.clear();
        }
        self.able_since = None;
        self.replan = true;
    }

    pub fn revision(&self) -> u32 {
        self.geometry.mission.revision
    }

    pub fn loop_hash(&self) -> u64 {
        self.geometry.coverage_loop.hash()
    }

    pub fn able(&self) -> bool {
        self.able_since.is_some()
    }

    pub fn finished(&self) -> bool {
        self.finished
    }

    pub fn covered(&self) -> &CellSet {
        self.negotiation.sections.covered()
    }

    pub fn activity(&self) -> Activity {
        match &self.goal {
            Some(Goal::Legs(_)) => Activity::Covering,
            Some(Goal::Hold) => Activity::Holding,
            Some(Goal::Point(_)) => Activity::Returning,
            None => Activity::Waiting,
        }
    }

    pub fn status(&self) -> MissionStatus {
        let sections = &self.negotiation.sections;
        if self.finished {
            MissionStatus::Accomplished
        } else if sections.unassigned().count() > 0 && sections.plan().is_empty() {
            MissionStatus::Failed
        } else {
            MissionStatus::Active
        }
    }

    /// The own claim, with the expected end of the plan.
    pub fn claim(&self) -> Claim {
        let sections = &self.negotiation.sections;
        Claim {
            // Who lists nothing takes nothing from anybody, and may be asked for a bid.
            alone: self.alone && self.lists(),
            ..sections.claim(self.revision(), self.loop_hash(), self.eta_ms())
        }
    }

    /// Whether its claim lists any cell.
    pub fn lists(&self) -> bool {
        let sections = &self.negotiation.sections;
        !sections.plan().is_empty() || !sections.held().is_empty()
    }

    /// How many times eight peers are heard of and live, at least one.
    pub fn eights(&self) -> u64 {
        let heard_of = self.company.live.len();
        let heard_of = heard_of.saturating_sub(self.expected.len());
        (heard_of / MEMBERS_MAX).max(1) as u64
    }

    pub fn eta_ms(&self) -> u32 {
        let sections = &self.negotiation.sections;
        match &self.executive {
            Some(e) if !sections.plan().is_empty() => {
                e.finish_ms(&|c| !sections.covered().contains(c))
            }
            _ => 0,
        }
    }

    pub fn spendable_ms(&self, percept: Option<&Percept>) -> u32 {
        match (&self.executive, percept) {
            (Some(e), Some(p)) => e.spendable_ms(p),
            _ => 0,
        }
    }

    /// The state of a mission whose geometry has arrived, with what is kept of the last
    /// one.
    pub fn begun(
        geometry: Arc<MissionGeometry>,
        old: Option<Self>,
        me: Member,
        config: &PeerConfig,
        durable: &Durable,
        timers: &mut Timers,
    ) -> Self {
        // A loop of more cells is no geometry: `LoopError::TooManyCells`.
        let cells = u16::try_from(geometry.coverage_loop.len()).unwrap_or(u16::MAX);
        timers.stop(Timer::NextLap);
        let launches = roster(old.as_ref(), me, config, durable);
        let others = launches.iter().map(|l| l.id).filter(|id| *id != me.id);
        let mut new = Self {
            expected: others.map(|id| (id, Time(u64::MAX))).collect(),
            launches,
            negotiation: negotiation_begun(&geometry, old.as_ref(), me, durable, cells),
            executive: executive_for(&geometry, config),
            goal: None,
            replan: true,
            able_since: None,
            company: Arc::default(),
            alone: false,
            finished: false,
            astray: false,
            silent: false,
            exhausted: old.as_ref().is_some_and(|m| m.exhausted),
            fuel_looked_at: None,
            unsaved_cells: 0,
            // What is still being written was promised for the old loop.
            claims: old
                .as_ref()
                .map_or_else(Default::default, |m| m.claims.void()),
            geometry,
        };
        match old {
            Some(old) if old.loop_hash() == new.loop_hash() => new.keep_on(old),
            _ => timers.stop(Timer::HeldCells),
        }
        new
    }

    /// On the same loop sections and rounds stay what they are, so that a revision which
    /// arrives at one peer after the other parts nobody; between the same zones a UAV
    /// stays on its curve, too.
    fn keep_on(&mut self, old: Self) {
        self.negotiation = old.negotiation;
        self.able_since = old.able_since;
        self.company = old.company;
        self.alone = old.alone;
        self.claims = old.claims;
        self.unsaved_cells = old.unsaved_cells;
        self.launches = old.launches;
        self.expected = old.expected;
        let (new, before) = (&self.geometry.mission, &old.geometry.mission);
        let flown_alike = new.zones == before.zones
            && new.turn_radius_mm == before.turn_radius_mm
            && new.clearance_mm == before.clearance_mm;
        if flown_alike {
            let base = new.base_m();
            self.executive = old.executive.map(|e| e.with_home(base));
            self.goal = old.goal;
            self.replan = old.replan;
        }
    }
}

/// The roster, where it says how things are: of a large fleet, at its first mission and in the
/// first life.
fn roster(
    old: Option<&MissionState>,
    me: Member,
    config: &PeerConfig,
    durable: &Durable,
) -> Arc<[Launch]> {
    let first = old.is_none() && me.incarnation.max(durable.incarnation) <= FIRST_LIFE;
    let many = are_many(config.launches.len());
    if first && many && config.launches.iter().any(|l| l.id == me.id) {
        Arc::clone(&config.launches)
    } else {
        Arc::from([])
    }
}

fn executive_for(geometry: &MissionGeometry, config: &PeerConfig) -> Option<Executive> {
    let (mission, airframe) = (&geometry.mission, config.airframe?);
    let (coverage_loop, router) = (&geometry.coverage_loop, &geometry.router);
    let executive = Executive::new(
        airframe,
        config.height_m,
        Arc::clone(coverage_loop),
        Arc::clone(router),
    );
    Some(
        executive
            .with_tracking_error_m(mission.tracking_error_m())
            .with_objective(config.objective)
            .with_home(mission.base_m()),
    )
}

/// A negotiation on a new loop, with all that is known to be covered.
fn negotiation_begun(
    geometry: &MissionGeometry,
    old: Option<&MissionState>,
    me: Member,
    durable: &Durable,
    cells: u16,
) -> Negotiation {
    let coverage_loop = &geometry.coverage_loop;
    let without_need = (0u16..)
        .zip(coverage_loop.cells())
        .filter(|(_, c)| !c.needed);
    let needless = CellSet::of(cells, without_need.map(|(i, _)| i));
    let counter = old.map_or(0, |m| m.negotiation.rounds.counter());
    let mut negotiation = Negotiation::new(me, needless, counter.max(durable.counter));
    // Every lap begins with nothing covered.
    let same_lap = |old: &&MissionState| old.geometry.mission.lap == geometry.mission.lap;
    if let Some(old) = old.filter(same_lap) {
        let before = &old.geometry.coverage_loop;
        let covered = carried_over(before, old.covered(), coverage_loop);
        negotiation.sections.cover(&covered);
    }
    if let Some(covered) = remembered(durable, coverage_loop.hash(), cells) {
        negotiation.sections.cover(&covered);
    }
    let of_this_loop = |claim: &&Claim| claim.loop_hash == coverage_loop.hash();
    if let Some(claim) = durable.claim.as_ref().filter(of_this_loop) {
        negotiation.sections.restore_epoch(claim.epoch);
    }
    negotiation
}

/// Covered cells the journal held, if they are counted on this loop.
fn remembered(durable: &Durable, loop_hash: u64, cells: u16) -> Option<CellSet> {
    if durable.loop_hash == loop_hash && durable.cells == cells {
        CellSet::decode_rle(cells, &durable.covered).ok()
    } else {
        None
    }
}

/// Covered cells of one loop, found again at the same places of another: by name on one grid;
/// pieces, whose names are mere numbers, by their corners.
fn carried_over(old: &CoverageLoop, covered: &CellSet, new: &CoverageLoop) -> CellSet {
    let before = |c: u16| old.cells().get(usize::from(c)).filter(|c| c.needed);
    let seen = covered.iter().filter_map(before).map(|c| c.id);
    let found: Vec<CellId> = match (old.patches(), new.patches()) {
        (Patches::Grid(a), Patches::Grid(b)) if a == b => seen.collect(),
        (Patches::Listed(a), Patches::Listed(b)) => {
            let place = |n: u16| a.corners().get(usize::from(n)).map(|c| ring_mm(c));
            let places: BTreeSet<Vec<PointMm>> =
                seen.filter_map(|id| place(id.number()?)).collect();
            let pieces = (0_u16..).zip(b.corners());
            let same = pieces.filter(|(_, c)| places.contains(&ring_mm(&c[..])));
            same.map(|(n, _)| CellId::numbered(n)).collect()
        }
        _ => Vec::new(),
    };
    let found = found.into_iter().filter_map(|id| new.index_of(id));
    CellSet::of(u16::try_from(new.len()).unwrap_or(u16::MAX), found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CoverageTask, Mission, PointTask};

    #[test]
    fn only_the_last_claim_written_is_installed() {
        let mut claims = ClaimsWritten::default();
        let (first, second) = (claims.next(), claims.next());
        assert!(!claims.answer(first) && claims.under_way());
        assert!(claims.answer(second) && !claims.under_way());
        let third = claims.next();
        let mut on_a_new_loop = claims.void();
        assert!(!on_a_new_loop.under_way());
        assert!(
            !on_a_new_loop.answer(third),
            "it was written for the old loop"
        );
    }

    #[test]
    fn covered_cells_are_carried_to_another_loop_by_name() {
        let of = |cols| {
            Arc::new(crate::testing::mission(1, cols, 4))
                .geometry()
                .unwrap()
        };
        let (before, after) = (of(6), of(8));
        let (old, new) = (&before.coverage_loop, &after.coverage_loop);
        let mut renumbered = 0;
        for (i, cell) in (0u16..).zip(old.cells()) {
            let n = u16::try_from(old.len()).unwrap();
            let carried = carried_over(old, &CellSet::of(n, [i]), new);
            let found: Vec<u16> = carried.iter().collect();
            let wanted = new.index_of(cell.id).filter(|_| cell.needed);
            assert_eq!(found, wanted.into_iter().collect::<Vec<_>>());
            renumbered += u32::from(wanted.is_some_and(|w| w != i));
        }
        assert!(renumbered > 0, "no cell has another number");
    }

    /// Of other targets the third is what the second was: not the number counts.
    #[test]
    fn covered_points_are_carried_to_another_loop_by_their_places() {
        let points = |at: &[PointMm]| {
            let point = |at: &PointMm| PointTask {
                at: *at,
                radius_mm: 1_000,
            };
            let task = CoverageTask::Points(at.iter().map(point).collect());
            let mission = Mission {
                task,
                ..crate::testing::mission(1, 6, 4)
            };
            Arc::new(mission).geometry().unwrap()
        };
        let (a, b, c) = ((20_000, 30_000), (150_000, 40_000), (80_000, 120_000));
        let (before, after) = (points(&[a, b]), points(&[c, a, b]));
        let (old, new) = (&before.coverage_loop, &after.coverage_loop);
        for n in 0..2 {
            let seen = old.index_of(CellId::numbered(n)).unwrap();
            let carried = carried_over(old, &CellSet::of(2, [seen]), new);
            let wanted = new.index_of(CellId::numbered(n + 1));
            assert_eq!(carried.iter().next(), wanted);
            assert_eq!(carried.count(), 1);
        }
        // A lane's name says nothing of a point, nor a point's number of a lane.
        let lanes = Arc::new(crate::testing::mission(1, 6, 4))
            .geometry()
            .unwrap();
        let (old, new) = (&lanes.coverage_loop, &after.coverage_loop);
        let all = |l: &CoverageLoop| CellSet::full(u16::try_from(l.len()).unwrap());
        assert!(carried_over(old, &all(old), new).is_empty());
        assert!(carried_over(new, &all(new), old).is_empty());
    }
}
