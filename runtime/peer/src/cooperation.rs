//! The cooperation manager (D2.7 §1.2.3): mission, goal, and the peer's part in the
//! negotiations.
//!
//! | what holds | goal |
//! |---|---|
//! | the operator said hold | loiter here |
//! | the operator said return, or all is covered, or the fuel is due | loiter at base |
//! | the plan has cells | fly them |
//! | nothing to fly, others at work | loiter here, at the seam |

pub(crate) use crate::mission_state::{consider_mission, geometry_arrived};

use crate::beliefs::Beliefs;
use crate::cells::CellSet;
use crate::config::Role;
use crate::journal::Entry;
use crate::mission_state::MissionState;
use crate::offload::Job;
use crate::outbound;
use crate::output::Report;
use crate::peer::{Peer, PendingJob, Promise};
use crate::protocol::division;
use crate::protocol::negotiation::{Action, Adoption, Context};
use crate::protocol::runs::PlannedCell;
use crate::protocol::sections::LivePeers;
use crate::wire::message::{Bid, Epoch, Member, Order};
use skein_behaviors::{Event, Goal, Percept};
use skein_flight::coverage::ring::Direction;
use skein_flight::coverage::ring::backtracking::{Division, Leg};
use std::sync::Arc;

/// Most bytes of the union in a bid: a bid must stay short on the air, and a
/// forgotten run only means that somebody looks twice.
pub const BID_COVERED_MAX_BYTES: usize = 256;

/// Own coverage is made durable every so many cells: a crash costs at most these.
pub const CELLS_PER_COVERED_RECORD: u16 = 5;

/// A percept: fly, and note what the camera saw.
pub(crate) fn fly(peer: &mut Peer, percept: &Percept) {
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    let sections = &mission_state.negotiation.sections;
    let Some(executive) = &mut mission_state.executive else {
        return;
    };
    let (setpoint, events) = executive.step(percept, &|c| !sections.covered().contains(c));
    peer.outputs.push_back(crate::Output::Setpoint(setpoint));
    for event in events {
        on_event(peer, event);
    }
}

fn on_event(peer: &mut Peer, event: Event) {
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    match event {
        Event::Seen(ids) => {
            let n = mission_state.covered().capacity();
            let mut seen = CellSet::new(n);
            for id in ids {
                if let Some(i) = mission_state.geometry.coverage_loop.index_of(id) {
                    seen.insert(i);
                }
            }
            seen.subtract(mission_state.covered());
            if seen.count() == 0 {
                return;
            }
            mission_state.negotiation.sections.cover(&seen);
            mission_state.negotiation.covered_myself(seen.count());
            mission_state.unsaved_cells = mission_state.unsaved_cells.saturating_add(seen.count());
            peer.report(Report::Covered {
                cells: seen.iter().collect(),
            });
            peer.outbound.cover_changed = true;
            save_covered(peer, false);
        }
        Event::PlanDone => {
            mission_state.replan |= !mission_state.negotiation.sections.plan().is_empty()
        }
        Event::Arrived => {}
        Event::Refused { cells } => {
            mission_state.negotiation.sections.give_up(&cells);
            mission_state.replan = true;
            peer.outbound.claim_changed = true;
            peer.alarm("a cell could not be reached clear of the zones; it was given up");
        }
    }
}

fn save_covered(peer: &mut Peer, now: bool) {
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    if mission_state.unsaved_cells >= CELLS_PER_COVERED_RECORD
        || (now && mission_state.unsaved_cells > 0)
    {
        mission_state.unsaved_cells = 0;
        let entry = Entry::Covered {
            loop_hash: mission_state.loop_hash(),
            cells: mission_state.covered().capacity(),
            covered: mission_state.covered().encode_rle(None),
        };
        peer.store(Promise::Covered, entry);
    }
}

/// Looks at everything that depends on time.
pub(crate) fn tick(peer: &mut Peer) {
    consider_mission(peer);
    let able = can_plan(peer);
    let live: LivePeers = peer.membership.live().collect();
    let members = members(peer, able);
    let diameter = peer.membership.diameter(peer.now);
    let (now, period_ms) = (peer.now, peer.period_ms());
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    mission_state.able_since = if able {
        mission_state.able_since.or(Some(now))
    } else {
        None
    };
    let lost = mission_state
        .live
        .iter()
        .any(|(id, inc)| live.get(id) != Some(inc));
    mission_state.live.clone_from(&live);
    if lost {
        mission_state.negotiation.note_loss();
    }
    let ctx = Context {
        now,
        period_ms,
        live: &live,
        members: &members,
        diameter,
        able_since: mission_state.able_since,
        revision: mission_state.revision(),
        loop_hash: mission_state.loop_hash(),
    };
    let coverage_loop = Arc::clone(&mission_state.geometry.coverage_loop);
    let actions = mission_state.negotiation.tick(&ctx, &coverage_loop);
    for action in actions {
        on_action(peer, action);
    }
    finish(peer);
    steer(peer);
}

/// Whether this peer can take part in planning now.
fn can_plan(peer: &mut Peer) -> bool {
    let speaks = peer.life.speaks(peer.now);
    let resume = peer.order.order == Order::Resume;
    let Some(mission_state) = &mut peer.mission_state else {
        return false;
    };
    if peer.percept.is_some()
        && !mission_state.exhausted
        && mission_state.spendable_ms(peer.percept.as_ref()) == 0
    {
        mission_state.exhausted = true;
        mission_state.negotiation.sections.keep(0);
        mission_state.replan = true;
        peer.outbound.claim_changed = true;
        if mission_state.executive.is_some() {
            peer.alarm("the fuel is due: returning to base");
        }
    }
    peer.mission_state.as_ref().is_some_and(|c| {
        peer.config.role == Role::Uav
            && c.executive.is_some()
            && peer.percept.is_some()
            && !c.exhausted
    }) && speaks
        && resume
}

/// Live UAVs on our ground whose beacon says able, this peer included.
fn members(peer: &Peer, able: bool) -> Vec<Member> {
    let Some(mission_state) = &peer.mission_state else {
        return Vec::new();
    };
    let mut members: Vec<Member> = peer
        .membership
        .live()
        .filter(|(id, _)| {
            peer.membership.info(*id).is_some_and(|i| {
                i.able && !i.ground_station && i.loop_hash == mission_state.loop_hash()
            })
        })
        .map(|(id, incarnation)| Member { id, incarnation })
        .collect();
    if able {
        members.push(Member {
            id: peer.config.id.0,
            incarnation: peer.life.incarnation,
        });
    }
    members.sort_unstable();
    members
}

fn on_action(peer: &mut Peer, action: Action) {
    match action {
        Action::Bid => {
            if let Some(bid) = bid(peer) {
                let members = bid
                    .round
                    .members
                    .iter()
                    .map(|m| crate::PeerId(m.id))
                    .collect();
                peer.report(Report::Round {
                    counter: bid.round.counter,
                    members,
                });
                let entry = Entry::Bid(bid.clone());
                peer.store(Promise::Bid(Box::new(bid)), entry);
            }
        }
        Action::Divide {
            epoch,
            ring,
            robots,
        } => {
            peer.ask(PendingJob::Division(epoch), Job::Divide { ring, robots });
        }
        Action::Take(mut taken) => {
            let Some(mission_state) = &mut peer.mission_state else {
                return;
            };
            if mission_state.answered < mission_state.written {
                mission_state.negotiation.take(&[]);
                return;
            }
            let sections = &mission_state.negotiation.sections;
            let mut plan: Vec<PlannedCell> =
                sections.plan().iter().chain(&taken).copied().collect();
            plan.truncate(sections.fitting(&plan));
            taken.truncate(plan.len().saturating_sub(sections.plan().len()));
            if taken.is_empty() {
                mission_state.negotiation.take(&[]);
                return;
            }
            let claim = sections.claim_with(
                sections.epoch(),
                &plan,
                mission_state.revision(),
                mission_state.loop_hash(),
            );
            mission_state.written += 1;
            let promise = Promise::Take(mission_state.written, taken);
            if !peer.store(promise.clone(), Entry::Claim(claim)) {
                broken(peer, &promise);
            }
        }
        Action::Changed => changed(peer),
    }
}

/// The own claim changed by a rule: speak of it, and fly by it.
fn changed(peer: &mut Peer) {
    peer.outbound.claim_changed = true;
    if let Some(mission_state) = &mut peer.mission_state {
        mission_state.replan = true;
    }
}

/// This peer's bid in the open round.
fn bid(peer: &Peer) -> Option<Bid> {
    let mission_state = peer.mission_state.as_ref()?;
    let open = mission_state.negotiation.rounds.open()?;
    let executive = mission_state.executive.as_ref()?;
    let sections = &mission_state.negotiation.sections;
    let is_open = |c: u16| !sections.covered().contains(c);
    let forecast = executive.forecast(open.round.wait_ms, &is_open);
    let planned: Vec<u16> = forecast
        .cells
        .iter()
        .copied()
        .filter(|c| sections.plan().iter().any(|p| p.cell == *c))
        .collect();
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an airspeed is a small positive number"
    )]
    let speed_mmps = (executive.loop_speed_mps() * 1000.0) as u32;
    let spendable = mission_state.spendable_ms(peer.percept.as_ref());
    Some(Bid {
        round: open.round.clone(),
        anchor: forecast.anchor,
        backward: forecast.heading == Direction::Backward,
        release_ms: forecast.release_ms,
        speed_mmps,
        turn_ms: executive.turn_ms(),
        endurance_ms: spendable.saturating_sub(forecast.release_ms),
        covered: sections.covered().encode_rle(Some(BID_COVERED_MAX_BYTES)),
        commits: division::runs_of(&planned, sections.cells()),
        eta_ms: if sections.plan().is_empty() {
            0
        } else {
            forecast.finish_ms
        },
        adopted_ago_ms: mission_state.negotiation.adopted_ago_ms(peer.now),
        cells_since: mission_state.negotiation.cells_since(),
        idle: sections.plan().is_empty(),
    })
}

/// The bid is durable: it may be spoken.
pub(crate) fn bid_is_durable(peer: &mut Peer, bid: Bid) {
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    if mission_state.negotiation.bid_is_durable(bid.clone()) {
        outbound::speak_bid(peer, &bid);
        tick(peer);
    }
}

/// The planner divided the loop.
pub(crate) fn divided(peer: &mut Peer, epoch: Epoch, division: &Division) {
    let (now, period_ms) = (peer.now, peer.period_ms());
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    let Some(adoption) = mission_state
        .negotiation
        .divided(now, period_ms, epoch, division)
    else {
        return;
    };
    let sections = &mission_state.negotiation.sections;
    let claim = sections.claim_with(
        adoption.epoch,
        &adoption.plan,
        mission_state.revision(),
        mission_state.loop_hash(),
    );
    mission_state.written += 1;
    let promise = Promise::Adopt(mission_state.written, Box::new(adoption));
    if !peer.store(promise.clone(), Entry::Claim(claim)) {
        broken(peer, &promise);
    }
}

/// The division is durable: it is flown from now on.
pub(crate) fn adopt(peer: &mut Peer, written: u64, adoption: &Adoption) {
    let now = peer.now;
    let percept = peer.percept;
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    mission_state.answered = mission_state.answered.max(written);
    if written < mission_state.written {
        return;
    }
    mission_state.negotiation.adopt(now, adoption);
    keep_within_endurance(mission_state, percept.as_ref());
    if !adoption.unassigned.is_empty() {
        let count = adoption.unassigned.len();
        peer.alarm(&format!("{count} cells are beyond the endurance of all"));
    }
    changed(peer);
    save_covered(peer, true);
    steer(peer);
    outbound::speak_claim(peer);
}

/// Cells taken without a round are durable: they are flown from now on.
pub(crate) fn take(peer: &mut Peer, written: u64, taken: &[PlannedCell]) {
    let percept = peer.percept;
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    mission_state.answered = mission_state.answered.max(written);
    if written < mission_state.written {
        mission_state.negotiation.take(&[]);
        return;
    }
    mission_state.negotiation.take(taken);
    keep_within_endurance(mission_state, percept.as_ref());
    changed(peer);
    steer(peer);
    outbound::speak_claim(peer);
}

/// A promise could not be made durable, so what it was for does not happen.
pub(crate) fn broken(peer: &mut Peer, promise: &Promise) {
    match (&mut peer.mission_state, promise) {
        (Some(mission_state), Promise::Take(written, _)) => {
            mission_state.answered = mission_state.answered.max(*written);
            mission_state.negotiation.take(&[]);
        }
        (Some(mission_state), Promise::Adopt(written, _)) => {
            mission_state.answered = mission_state.answered.max(*written)
        }
        _ => {}
    }
}

/// Lists only what can be flown (S10): the rest is orphaned, and that is a loss.
fn keep_within_endurance(mission_state: &mut MissionState, percept: Option<&Percept>) {
    let spendable = mission_state.spendable_ms(percept);
    let sections = &mut mission_state.negotiation.sections;
    let Some(executive) = &mission_state.executive else {
        return;
    };
    let covered = sections.covered().clone();
    let is_open = |c: u16| !covered.contains(c);
    let fits = |count: usize| {
        executive.leg_time_ms(
            &legs_of(&sections.plan()[..count], covered.capacity()),
            &is_open,
        ) <= spendable
    };
    let total = sections.plan().len();
    if total == 0 || fits(total) {
        return;
    }
    let (mut good, mut bad) = (0, total);
    while bad - good > 1 {
        let middle = good.midpoint(bad);
        if fits(middle) {
            good = middle
        } else {
            bad = middle
        }
    }
    sections.keep(good);
}

/// Beacon periods for which the last cells of a time round are told before the next
/// begins: one to speak, two to be passed on. Who misses them looks at those cells
/// again, and hears of the next time round from the ground station.
const LAP_PERIODS: u64 = 3;

/// Everything is covered and is to be covered again: begins the next time round, once
/// the others had the time to hear of the last cells.
fn next_lap(peer: &mut Peer) {
    let (now, pause_ms) = (peer.now, LAP_PERIODS * peer.period_ms());
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    let Some(since) = mission_state.over_since else {
        mission_state.over_since = Some(now);
        peer.outbound.cover_changed = true;
        save_covered(peer, true);
        return;
    };
    if now.since_ms(since) >= pause_ms
        && let Some(next) = mission_state.geometry.mission.next_lap()
    {
        peer.library.offer(Arc::new(next));
    }
}

/// Whether all that can be covered is covered.
fn finish(peer: &mut Peer) {
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    let complete = mission_state.negotiation.sections.complete();
    if complete && mission_state.geometry.mission.further_laps > 0 {
        next_lap(peer);
        return;
    }
    if complete == mission_state.finished {
        return;
    }
    mission_state.finished = complete;
    mission_state.replan = true;
    let revision = mission_state.revision();
    if complete && peer.config.role == Role::Uav {
        peer.report(Report::Finished { revision });
        peer.outbound.finished_due = true;
        peer.outbound.claim_changed = true;
        peer.outbound.cover_changed = true;
        save_covered(peer, true);
    }
}

/// Gives the executive its goal, if that changed.
fn steer(peer: &mut Peer) {
    let order = peer.order.order;
    let Some(mission_state) = &mut peer.mission_state else {
        return;
    };
    let sections = &mission_state.negotiation.sections;
    let base = mission_state.geometry.mission.base_m();
    let goal = if order == Order::Hold {
        Goal::Hold
    } else if order == Order::ReturnToBase || mission_state.finished || mission_state.exhausted {
        Goal::Point(base)
    } else if sections.plan().is_empty() {
        Goal::Hold
    } else {
        Goal::Legs(legs_of(sections.plan(), sections.cells()))
    };
    let same_kind = match (&mission_state.goal, &goal) {
        (Some(Goal::Legs(_)), Goal::Legs(_)) => true,
        (Some(a), b) => a == b,
        (None, _) => false,
    };
    if same_kind && !core::mem::take(&mut mission_state.replan) {
        return;
    }
    mission_state.replan = false;
    if same_kind && !matches!(goal, Goal::Legs(_)) {
        return;
    }
    if let Some(executive) = &mut mission_state.executive {
        executive.set_goal(goal.clone(), &|c| !sections.covered().contains(c));
    }
    mission_state.goal = Some(goal);
}

/// Planned cells as legs: runs of neighbouring cells flown the same way.
#[must_use]
pub fn legs_of(plan: &[PlannedCell], n: u16) -> Vec<Leg> {
    let mut legs: Vec<Leg> = Vec::new();
    let mut last = 0;
    for p in plan {
        let direction = if p.backward {
            Direction::Backward
        } else {
            Direction::Forward
        };
        let next = if p.backward {
            (last + n - 1) % n.max(1)
        } else {
            (last + 1) % n.max(1)
        };
        match legs.last_mut() {
            Some(leg) if leg.direction == direction && next == p.cell => leg.count += 1,
            _ => legs.push(Leg {
                first: p.cell,
                count: 1,
                direction,
            }),
        }
        last = p.cell;
    }
    legs
}

/// Fills the mission's part of a view.
pub(crate) fn view(peer: &Peer, view: &mut Beliefs) {
    let Some(mission_state) = &peer.mission_state else {
        return;
    };
    let sections = &mission_state.negotiation.sections;
    view.able = mission_state.able();
    view.loop_hash = mission_state.loop_hash();
    view.revision = mission_state.revision();
    view.covered = (0..sections.cells())
        .map(|c| sections.covered().contains(c))
        .collect();
    view.plan = sections.plan().iter().map(|p| p.cell).collect();
    view.held = sections.held().keys().copied().collect();
    view.unassigned = sections.unassigned().iter().collect();
    view.epoch = sections.epoch();
    view.counter = peer.durable.counter;
    view.adoptions = mission_state.negotiation.adoptions;
    view.finished = mission_state.finished;
    view.eta_ms = mission_state.eta_ms();
    view.spendable_ms = mission_state.spendable_ms(peer.percept.as_ref());
}
