//! A mission arrives: its common ground is asked for, and what the peer has worked out
//! on the last one is kept as far as it holds on the new one.
//!
//! What is done with it then is the cooperation manager's.

use super::Crew;
use crate::boot;
use crate::cells::CellSet;
use crate::coverage::Negotiation;
use crate::coverage::section::Live;
use crate::mission::point_m;
use crate::output::Report;
use crate::peer::{Asked, Peer};
use crate::plan::{Ground, Problem};
use crate::wire::message::Member;
use skein_behaviors::Executive;
use skein_planning::coverage::area::CoverageLoop;
use std::sync::Arc;

/// Asks for the common ground of the newest whole mission, unless it is held.
pub(crate) fn consider_mission(peer: &mut Peer) {
    let Some(mission) = peer.library.newest() else {
        return;
    };
    if peer
        .crew
        .as_ref()
        .is_some_and(|c| c.ground.mission.revision >= mission.revision)
    {
        return;
    }
    let hash = mission.content_hash();
    peer.ask(Asked::Ground(hash), Problem::Ground(mission));
}

/// The common ground arrived: from now on this is the mission.
pub(crate) fn grounded(peer: &mut Peer, hash: u64, ground: Result<Arc<Ground>, String>) {
    let ground = match ground {
        Ok(g) if g.mission.content_hash() == hash => g,
        Ok(_) => return,
        Err(why) => {
            peer.alarm(&format!("the mission cannot be flown: {why}"));
            return;
        }
    };
    let coverage_loop = Arc::clone(&ground.coverage_loop);
    let Ok(n) = u16::try_from(coverage_loop.len()) else {
        return;
    };
    let executive = peer.config.airframe.map(|airframe| {
        let router = Arc::clone(&ground.router);
        Executive::new(
            airframe,
            peer.config.height_m,
            Arc::clone(&coverage_loop),
            router,
        )
        .with_tracking_error_m(f64::from(ground.mission.tracking_error_mm) / 1000.0)
        .with_objective(peer.config.objective)
        .with_home(point_m(ground.mission.base))
    });
    let old = peer.crew.take();
    // What is still being written was promised for the old ground: it is not installed.
    let written = old.as_ref().map_or(0, |c| c.written + 1);
    let mut crew = Crew {
        negotiation: begun(peer, old.as_ref(), &ground, n),
        ground: Arc::clone(&ground),
        executive,
        goal: None,
        replan: true,
        able_since: None,
        live: Live::new(),
        finished: false,
        over_since: None,
        exhausted: old.as_ref().is_some_and(|c| c.exhausted),
        unsaved_cells: 0,
        written,
        answered: written,
    };
    if let Some(old) = old {
        keep_on(&mut crew, old);
    }
    peer.crew = Some(crew);
    peer.report(Report::Ready {
        revision: ground.mission.revision,
        loop_hash: coverage_loop.hash(),
        cells: n,
    });
    crate::ear::hear_again(peer);
}

/// On the same loop sections and rounds stay what they are, so that a revision which
/// arrives at one peer after the other parts nobody; between the same zones a UAV stays
/// on its curve, too.
fn keep_on(crew: &mut Crew, old: Crew) {
    if old.loop_hash() != crew.loop_hash() {
        return;
    }
    crew.negotiation = old.negotiation;
    crew.able_since = old.able_since;
    crew.live = old.live;
    (crew.written, crew.answered) = (old.written, old.answered);
    crew.unsaved_cells = old.unsaved_cells;
    let (new, before) = (&crew.ground.mission, &old.ground.mission);
    let flown_alike = new.zones == before.zones
        && new.turn_radius_mm == before.turn_radius_mm
        && new.clearance_mm == before.clearance_mm;
    if flown_alike {
        let base = point_m(new.base);
        crew.executive = old.executive.map(|e| e.with_home(base));
        crew.goal = old.goal;
        crew.replan = old.replan;
    }
}

/// A negotiation on a new loop, with all that is known to be covered.
fn begun(peer: &Peer, old: Option<&Crew>, ground: &Ground, n: u16) -> Negotiation {
    let coverage_loop = &ground.coverage_loop;
    let mut base = CellSet::new(n);
    for (i, c) in coverage_loop.cells().iter().enumerate() {
        if !c.needed {
            base.insert(u16::try_from(i).unwrap_or(u16::MAX));
        }
    }
    let me = Member {
        id: peer.config.id.0,
        incarnation: peer.boot.incarnation,
    };
    let counter = peer
        .durable
        .counter
        .max(old.as_ref().map_or(0, |c| c.negotiation.rounds.counter()));
    let mut negotiation = Negotiation::new(me, base, counter);
    // Every time round begins with nothing covered.
    let same_lap = |old: &&Crew| old.ground.mission.lap == ground.mission.lap;
    if let Some(old) = old.filter(same_lap) {
        negotiation.section.cover(&carried_over(
            &old.ground.coverage_loop,
            old.union(),
            coverage_loop,
        ));
    }
    if let Some(union) = boot::remembered(&peer.durable, coverage_loop.hash(), n) {
        negotiation.section.cover(&union);
    }
    if let Some(register) = peer
        .durable
        .register
        .as_ref()
        .filter(|r| r.loop_hash == coverage_loop.hash())
    {
        negotiation.section.restore_epoch(register.epoch);
    }
    negotiation
}

/// Covered cells of one loop, found again by name on another.
fn carried_over(old: &CoverageLoop, union: &CellSet, new: &CoverageLoop) -> CellSet {
    let mut out = CellSet::new(u16::try_from(new.len()).unwrap_or(u16::MAX));
    for c in union.iter() {
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
