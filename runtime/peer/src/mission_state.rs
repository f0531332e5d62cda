//! A mission arrives: its common ground is asked for, and what the peer has worked out
//! on the last one is kept as far as it holds on the new one.
//!
//! What is done with it then is the cooperation manager's.

use crate::cells::CellSet;
use crate::mission::GeometryError;
use crate::offload::{Job, MissionGeometry};
use crate::output::Report;
use crate::peer::{Peer, PendingJob};
use crate::protocol::Negotiation;
use crate::protocol::life;
use crate::protocol::sections::LivePeers;
use crate::wire::message::{Behaviour, Claim, Member, MissionStatus};
use skein_behaviors::{Executive, Goal, Percept};
use skein_flight::coverage::ring::CoverageLoop;
use std::sync::Arc;

/// What a peer has once it holds a mission and its common ground.
#[derive(Debug)]
pub(crate) struct MissionState {
    pub geometry: Arc<MissionGeometry>,
    pub executive: Option<Executive>,
    pub negotiation: Negotiation,
    pub goal: Option<Goal>,
    pub replan: bool,
    pub able_since: Option<crate::Time>,
    pub live: LivePeers,
    pub finished: bool,
    /// Since when all is covered and another time round is to come.
    pub over_since: Option<crate::Time>,
    pub exhausted: bool,
    pub unsaved_cells: u16,
    /// Counts the sections handed to the journal; only the last of them may be
    /// installed, for it is the one that the journal ends with.
    pub written: u64,
    /// The last of them whose answer came.
    pub answered: u64,
}

impl MissionState {
    pub fn new_life(&mut self, me: Member) {
        self.negotiation.new_life(me);
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

    pub fn behaviour(&self) -> Behaviour {
        match &self.goal {
            Some(Goal::Legs(_)) => Behaviour::Covering,
            Some(Goal::Point(_) | Goal::Hold) => Behaviour::Loitering,
            None => Behaviour::Waiting,
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
        self.negotiation
            .sections
            .claim(self.revision(), self.loop_hash(), self.eta_ms())
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
}

/// Asks for the common ground of the newest whole mission, unless it is held.
pub(crate) fn consider_mission(peer: &mut Peer) {
    let Some(mission) = peer.library.newest() else {
        return;
    };
    if peer
        .mission_state
        .as_ref()
        .is_some_and(|c| c.geometry.mission.revision >= mission.revision)
    {
        return;
    }
    let hash = mission.content_hash();
    peer.ask(PendingJob::Geometry(hash), Job::Geometry(mission));
}

/// The common ground arrived: from now on this is the mission.
pub(crate) fn geometry_arrived(
    peer: &mut Peer,
    hash: u64,
    geometry: Result<Arc<MissionGeometry>, GeometryError>,
) {
    let geometry = match geometry {
        Ok(g) if g.mission.content_hash() == hash => g,
        Ok(_) => return,
        Err(why) => {
            peer.alarm(&format!("the mission cannot be flown: {why}"));
            return;
        }
    };
    let coverage_loop = Arc::clone(&geometry.coverage_loop);
    let Ok(n) = u16::try_from(coverage_loop.len()) else {
        return;
    };
    let executive = peer.config.airframe.map(|airframe| {
        let router = Arc::clone(&geometry.router);
        Executive::new(
            airframe,
            peer.config.height_m,
            Arc::clone(&coverage_loop),
            router,
        )
        .with_tracking_error_m(geometry.mission.tracking_error_m())
        .with_objective(peer.config.objective)
        .with_home(geometry.mission.base_m())
    });
    let old = peer.mission_state.take();
    // What is still being written was promised for the old ground: it is not installed.
    let written = old.as_ref().map_or(0, |c| c.written + 1);
    let mut mission_state = MissionState {
        negotiation: begun(peer, old.as_ref(), &geometry, n),
        geometry: Arc::clone(&geometry),
        executive,
        goal: None,
        replan: true,
        able_since: None,
        live: LivePeers::new(),
        finished: false,
        over_since: None,
        exhausted: old.as_ref().is_some_and(|c| c.exhausted),
        unsaved_cells: 0,
        written,
        answered: written,
    };
    if let Some(old) = old {
        keep_on(&mut mission_state, old);
    }
    peer.mission_state = Some(mission_state);
    peer.report(Report::Ready {
        revision: geometry.mission.revision,
        loop_hash: coverage_loop.hash(),
        cells: n,
    });
    crate::inbound::hear_again(peer);
}

/// On the same loop sections and rounds stay what they are, so that a revision which
/// arrives at one peer after the other parts nobody; between the same zones a UAV stays
/// on its curve, too.
fn keep_on(mission_state: &mut MissionState, old: MissionState) {
    if old.loop_hash() != mission_state.loop_hash() {
        return;
    }
    mission_state.negotiation = old.negotiation;
    mission_state.able_since = old.able_since;
    mission_state.live = old.live;
    (mission_state.written, mission_state.answered) = (old.written, old.answered);
    mission_state.unsaved_cells = old.unsaved_cells;
    let (new, before) = (&mission_state.geometry.mission, &old.geometry.mission);
    let flown_alike = new.zones == before.zones
        && new.turn_radius_mm == before.turn_radius_mm
        && new.clearance_mm == before.clearance_mm;
    if flown_alike {
        let base = new.base_m();
        mission_state.executive = old.executive.map(|e| e.with_home(base));
        mission_state.goal = old.goal;
        mission_state.replan = old.replan;
    }
}

/// A negotiation on a new loop, with all that is known to be covered.
fn begun(
    peer: &Peer,
    old: Option<&MissionState>,
    geometry: &MissionGeometry,
    n: u16,
) -> Negotiation {
    let coverage_loop = &geometry.coverage_loop;
    let mut base = CellSet::new(n);
    for (i, c) in coverage_loop.cells().iter().enumerate() {
        if !c.needed {
            base.insert(u16::try_from(i).unwrap_or(u16::MAX));
        }
    }
    let me = Member {
        id: peer.config.id.0,
        incarnation: peer.life.incarnation,
    };
    let counter = peer
        .durable
        .counter
        .max(old.as_ref().map_or(0, |c| c.negotiation.rounds.counter()));
    let mut negotiation = Negotiation::new(me, base, counter);
    // Every time round begins with nothing covered.
    let same_lap = |old: &&MissionState| old.geometry.mission.lap == geometry.mission.lap;
    if let Some(old) = old.filter(same_lap) {
        negotiation.sections.cover(&carried_over(
            &old.geometry.coverage_loop,
            old.covered(),
            coverage_loop,
        ));
    }
    if let Some(covered) = life::remembered(&peer.durable, coverage_loop.hash(), n) {
        negotiation.sections.cover(&covered);
    }
    if let Some(claim) = peer
        .durable
        .claim
        .as_ref()
        .filter(|r| r.loop_hash == coverage_loop.hash())
    {
        negotiation.sections.restore_epoch(claim.epoch);
    }
    negotiation
}

/// Covered cells of one loop, found again by name on another.
fn carried_over(old: &CoverageLoop, covered: &CellSet, new: &CoverageLoop) -> CellSet {
    let mut out = CellSet::new(u16::try_from(new.len()).unwrap_or(u16::MAX));
    for c in covered.iter() {
        if let Some(i) = old
            .cells()
            .get(usize::from(c))
            .filter(|c| c.needed)
            .and_then(|c| new.index_of(c.id))
        {
            out.insert(i);
        }
    }
    out
}
