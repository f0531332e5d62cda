//! The cooperation manager (D2.7 §1.2.3): mission, goal, and the peer's part in the
//! negotiations.
//!
//! | what holds | goal |
//! |---|---|
//! | the operator said hold | loiter here |
//! | the operator said return, or all is covered, or the fuel is due | loiter at base |
//! | the plan has cells | fly them |
//! | nothing to fly, others at work | loiter here, at the seam |

mod arrival;

pub(crate) use arrival::{consider_mission, grounded};

use crate::cells::CellSet;
use crate::config::Role;
use crate::coverage::negotiation::{Adoption, Context, Want};
use crate::coverage::runs::PlanCell;
use crate::coverage::section::Live;
use crate::coverage::{Negotiation, division};
use crate::journal::Entry;
use crate::mission::point_m;
use crate::output::Report;
use crate::peer::{Asked, Peer, Promise};
use crate::plan::{Ground, Problem};
use crate::view::View;
use crate::voice;
use crate::wire::message::{Behaviour, Epoch, Member, MissionStatus, Order, Register, Snapshot};
use skein_behaviors::{Event, Executive, Goal, Percept};
use skein_planning::coverage::area::Direction;
use skein_planning::coverage::area::backtracking::{Division, Leg};
use std::sync::Arc;

/// Most bytes of the union in a bid: a bid must stay short on the air, and a
/// forgotten run only means that somebody looks twice.
pub const MAX_BID_UNION_BYTES: usize = 256;

/// Own coverage is made durable every so many cells: a crash costs at most these.
pub const CELLS_PER_UNION_RECORD: u16 = 5;

/// What a peer has once it holds a mission and its common ground.
#[derive(Debug)]
pub(crate) struct Crew {
    pub ground: Arc<Ground>,
    pub executive: Option<Executive>,
    pub negotiation: Negotiation,
    goal: Option<Goal>,
    replan: bool,
    able_since: Option<crate::Time>,
    live: Live,
    finished: bool,
    /// Since when all is covered and another time round is to come.
    over_since: Option<crate::Time>,
    exhausted: bool,
    unsaved_cells: u16,
    /// Counts the sections handed to the journal; only the last of them may be
    /// installed, for it is the one that the journal ends with.
    written: u64,
    /// The last of them whose answer came.
    answered: u64,
}

impl Crew {
    pub fn new_life(&mut self, me: Member) {
        self.negotiation.new_life(me);
        self.able_since = None;
        self.replan = true;
    }

    pub fn revision(&self) -> u32 {
        self.ground.mission.revision
    }

    pub fn loop_hash(&self) -> u64 {
        self.ground.coverage_loop.hash()
    }

    pub fn able(&self) -> bool {
        self.able_since.is_some()
    }

    pub fn finished(&self) -> bool {
        self.finished
    }

    pub fn union(&self) -> &CellSet {
        self.negotiation.section.union()
    }

    pub fn behaviour(&self) -> Behaviour {
        match &self.goal {
            Some(Goal::Legs(_)) => Behaviour::Covering,
            Some(Goal::Point(_) | Goal::Hold) => Behaviour::Loitering,
            None => Behaviour::Waiting,
        }
    }

    pub fn status(&self) -> MissionStatus {
        let section = &self.negotiation.section;
        if self.finished {
            MissionStatus::Accomplished
        } else if section.unassigned().count() > 0 && section.plan().is_empty() {
            MissionStatus::Failed
        } else {
            MissionStatus::Active
        }
    }

    /// The own register, with the expected end of the plan.
    pub fn register(&self) -> Register {
        self.negotiation
            .section
            .register(self.revision(), self.loop_hash(), self.eta_ms())
    }

    pub fn eta_ms(&self) -> u32 {
        let section = &self.negotiation.section;
        match &self.executive {
            Some(e) if !section.plan().is_empty() => e.finish_ms(&|c| !section.union().contains(c)),
            _ => 0,
        }
    }

    fn spendable_ms(&self, percept: Option<&Percept>) -> u32 {
        match (&self.executive, percept) {
            (Some(e), Some(p)) => e.spendable_ms(p),
            _ => 0,
        }
    }
}

/// A percept: fly, and note what the camera saw.
pub(crate) fn fly(peer: &mut Peer, percept: &Percept) {
    let Some(crew) = &mut peer.crew else {
        return;
    };
    let section = &crew.negotiation.section;
    let Some(executive) = &mut crew.executive else {
        return;
    };
    let (setpoint, events) = executive.step(percept, &|c| !section.union().contains(c));
    peer.outputs.push_back(crate::Output::Setpoint(setpoint));
    for event in events {
        on_event(peer, event);
    }
}

fn on_event(peer: &mut Peer, event: Event) {
    let Some(crew) = &mut peer.crew else {
        return;
    };
    match event {
        Event::Seen(ids) => {
            let n = crew.union().len();
            let mut seen = CellSet::new(n);
            for id in ids {
                if let Some(i) = crew.ground.coverage_loop.index_of(id) {
                    seen.insert(i);
                }
            }
            seen.subtract(crew.union());
            if seen.count() == 0 {
                return;
            }
            crew.negotiation.section.cover(&seen);
            crew.negotiation.covered_myself(seen.count());
            crew.unsaved_cells = crew.unsaved_cells.saturating_add(seen.count());
            peer.report(Report::Covered {
                cells: seen.iter().collect(),
            });
            peer.voice.cover_changed = true;
            save_union(peer, false);
        }
        Event::PlanDone => crew.replan |= !crew.negotiation.section.plan().is_empty(),
        Event::Arrived => {}
        Event::Refused { cells } => {
            crew.negotiation.section.give_up(&cells);
            crew.replan = true;
            peer.voice.claim_changed = true;
            peer.alarm("a cell could not be reached clear of the zones; it was given up");
        }
    }
}

fn save_union(peer: &mut Peer, now: bool) {
    let Some(crew) = &mut peer.crew else {
        return;
    };
    if crew.unsaved_cells >= CELLS_PER_UNION_RECORD || (now && crew.unsaved_cells > 0) {
        crew.unsaved_cells = 0;
        let entry = Entry::Union {
            loop_hash: crew.loop_hash(),
            cells: crew.union().len(),
            union: crew.union().encode_rle(None),
        };
        peer.store(Promise::Union, entry);
    }
}

/// Looks at everything that depends on time.
pub(crate) fn look(peer: &mut Peer) {
    consider_mission(peer);
    let able = can_plan(peer);
    let live: Live = peer.membership.live().collect();
    let members = members(peer, able);
    let diameter = peer.membership.diameter(peer.now);
    let (now, period_ms) = (peer.now, peer.period_ms());
    let Some(crew) = &mut peer.crew else {
        return;
    };
    crew.able_since = if able {
        crew.able_since.or(Some(now))
    } else {
        None
    };
    let lost = crew.live.iter().any(|(id, inc)| live.get(id) != Some(inc));
    crew.live.clone_from(&live);
    if lost {
        crew.negotiation.note_loss();
    }
    let ctx = Context {
        now,
        period_ms,
        live: &live,
        members: &members,
        diameter,
        able_since: crew.able_since,
        revision: crew.revision(),
        loop_hash: crew.loop_hash(),
    };
    let coverage_loop = Arc::clone(&crew.ground.coverage_loop);
    let wants = crew.negotiation.tick(&ctx, &coverage_loop);
    for want in wants {
        on_want(peer, want);
    }
    finish(peer);
    steer(peer);
}

/// Whether this peer can take part in planning now.
fn can_plan(peer: &mut Peer) -> bool {
    let speaks = peer.boot.speaks(peer.now);
    let resume = peer.order.order == Order::Resume;
    let Some(crew) = &mut peer.crew else {
        return false;
    };
    if peer.percept.is_some() && !crew.exhausted && crew.spendable_ms(peer.percept.as_ref()) == 0 {
        crew.exhausted = true;
        crew.negotiation.section.keep(0);
        crew.replan = true;
        peer.voice.claim_changed = true;
        if crew.executive.is_some() {
            peer.alarm("the fuel is due: returning to base");
        }
    }
    peer.crew.as_ref().is_some_and(|c| {
        peer.config.role == Role::Uav
            && c.executive.is_some()
            && peer.percept.is_some()
            && !c.exhausted
    }) && speaks
        && resume
}

/// Live UAVs on our ground whose beacon says able, this peer included.
fn members(peer: &Peer, able: bool) -> Vec<Member> {
    let Some(crew) = &peer.crew else {
        return Vec::new();
    };
    let mut members: Vec<Member> = peer
        .membership
        .live()
        .filter(|(id, _)| {
            peer.membership
                .info(*id)
                .is_some_and(|i| i.able && !i.ground && i.loop_hash == crew.loop_hash())
        })
        .map(|(id, incarnation)| Member { id, incarnation })
        .collect();
    if able {
        members.push(Member {
            id: peer.config.id.0,
            incarnation: peer.boot.incarnation,
        });
    }
    members.sort_unstable();
    members
}

fn on_want(peer: &mut Peer, want: Want) {
    match want {
        Want::Bid => {
            if let Some(snapshot) = bid(peer) {
                let members = snapshot
                    .round
                    .members
                    .iter()
                    .map(|m| crate::PeerId(m.id))
                    .collect();
                peer.report(Report::Round {
                    counter: snapshot.round.counter,
                    members,
                });
                let entry = Entry::Bid(snapshot.clone());
                peer.store(Promise::Bid(Box::new(snapshot)), entry);
            }
        }
        Want::Divide {
            epoch,
            ring,
            robots,
        } => {
            peer.ask(Asked::Division(epoch), Problem::Divide { ring, robots });
        }
        Want::Take(mut taken) => {
            let Some(crew) = &mut peer.crew else {
                return;
            };
            if crew.answered < crew.written {
                crew.negotiation.take(&[]);
                return;
            }
            let section = &crew.negotiation.section;
            let mut plan: Vec<PlanCell> = section.plan().iter().chain(&taken).copied().collect();
            plan.truncate(section.fitting(&plan));
            taken.truncate(plan.len().saturating_sub(section.plan().len()));
            if taken.is_empty() {
                crew.negotiation.take(&[]);
                return;
            }
            let register =
                section.register_with(section.epoch(), &plan, crew.revision(), crew.loop_hash());
            crew.written += 1;
            let promise = Promise::Take(crew.written, taken);
            if !peer.store(promise.clone(), Entry::Section(register)) {
                broken(peer, &promise);
            }
        }
        Want::Changed => changed(peer),
    }
}

/// The own register changed by a rule: speak of it, and fly by it.
fn changed(peer: &mut Peer) {
    peer.voice.claim_changed = true;
    if let Some(crew) = &mut peer.crew {
        crew.replan = true;
    }
}

/// This peer's bid in the open round.
fn bid(peer: &Peer) -> Option<Snapshot> {
    let crew = peer.crew.as_ref()?;
    let open = crew.negotiation.rounds.open()?;
    let executive = crew.executive.as_ref()?;
    let section = &crew.negotiation.section;
    let is_open = |c: u16| !section.union().contains(c);
    let forecast = executive.forecast(open.round.wait_ms, &is_open);
    let planned: Vec<u16> = forecast
        .cells
        .iter()
        .copied()
        .filter(|c| section.plan().iter().any(|p| p.cell == *c))
        .collect();
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an airspeed is a small positive number"
    )]
    let speed_mmps = (executive.loop_speed_mps() * 1000.0) as u32;
    let spendable = crew.spendable_ms(peer.percept.as_ref());
    Some(Snapshot {
        round: open.round.clone(),
        anchor: forecast.anchor,
        backward: forecast.heading == Direction::Backward,
        release_ms: forecast.release_ms,
        speed_mmps,
        turn_ms: executive.turn_ms(),
        endurance_ms: spendable.saturating_sub(forecast.release_ms),
        union: section.union().encode_rle(Some(MAX_BID_UNION_BYTES)),
        commits: division::runs_of(&planned, section.cells()),
        eta_ms: if section.plan().is_empty() {
            0
        } else {
            forecast.finish_ms
        },
        adopted_ago_ms: crew.negotiation.adopted_ago_ms(peer.now),
        cells_since: crew.negotiation.cells_since(),
        idle: section.plan().is_empty(),
    })
}

/// The bid is durable: it may be spoken.
pub(crate) fn bid_is_durable(peer: &mut Peer, snapshot: Snapshot) {
    let Some(crew) = &mut peer.crew else {
        return;
    };
    if crew.negotiation.bid_is_durable(snapshot.clone()) {
        voice::speak_bid(peer, &snapshot);
        look(peer);
    }
}

/// The planner divided the loop.
pub(crate) fn divided(peer: &mut Peer, epoch: Epoch, division: &Division) {
    let (now, period_ms) = (peer.now, peer.period_ms());
    let Some(crew) = &mut peer.crew else {
        return;
    };
    let Some(adoption) = crew.negotiation.divided(now, period_ms, epoch, division) else {
        return;
    };
    let section = &crew.negotiation.section;
    let register = section.register_with(
        adoption.epoch,
        &adoption.plan,
        crew.revision(),
        crew.loop_hash(),
    );
    crew.written += 1;
    let promise = Promise::Adopt(crew.written, Box::new(adoption));
    if !peer.store(promise.clone(), Entry::Section(register)) {
        broken(peer, &promise);
    }
}

/// The division is durable: it is flown from now on.
pub(crate) fn adopt(peer: &mut Peer, written: u64, adoption: &Adoption) {
    let now = peer.now;
    let percept = peer.percept;
    let Some(crew) = &mut peer.crew else {
        return;
    };
    crew.answered = crew.answered.max(written);
    if written < crew.written {
        return;
    }
    crew.negotiation.adopt(now, adoption);
    keep_within_endurance(crew, percept.as_ref());
    if !adoption.unassigned.is_empty() {
        let count = adoption.unassigned.len();
        peer.alarm(&format!("{count} cells are beyond the endurance of all"));
    }
    changed(peer);
    save_union(peer, true);
    steer(peer);
    voice::speak_claim(peer);
}

/// Cells taken without a round are durable: they are flown from now on.
pub(crate) fn take(peer: &mut Peer, written: u64, taken: &[PlanCell]) {
    let percept = peer.percept;
    let Some(crew) = &mut peer.crew else {
        return;
    };
    crew.answered = crew.answered.max(written);
    if written < crew.written {
        crew.negotiation.take(&[]);
        return;
    }
    crew.negotiation.take(taken);
    keep_within_endurance(crew, percept.as_ref());
    changed(peer);
    steer(peer);
    voice::speak_claim(peer);
}

/// A promise could not be made durable, so what it was for does not happen.
pub(crate) fn broken(peer: &mut Peer, promise: &Promise) {
    match (&mut peer.crew, promise) {
        (Some(crew), Promise::Take(written, _)) => {
            crew.answered = crew.answered.max(*written);
            crew.negotiation.take(&[]);
        }
        (Some(crew), Promise::Adopt(written, _)) => crew.answered = crew.answered.max(*written),
        _ => {}
    }
}

/// Lists only what can be flown (S10): the rest is orphaned, and that is a loss.
fn keep_within_endurance(crew: &mut Crew, percept: Option<&Percept>) {
    let spendable = crew.spendable_ms(percept);
    let section = &mut crew.negotiation.section;
    let Some(executive) = &crew.executive else {
        return;
    };
    let union = section.union().clone();
    let is_open = |c: u16| !union.contains(c);
    let fits = |count: usize| {
        executive.leg_time_ms(&legs_of(&section.plan()[..count], union.len()), &is_open)
            <= spendable
    };
    let total = section.plan().len();
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
    section.keep(good);
}

/// Beacon periods for which the last cells of a time round are told before the next
/// begins: one to speak, two to be passed on. Who misses them looks at those cells
/// again, and hears of the next time round from the ground station.
const LAP_PERIODS: u64 = 3;

/// Everything is covered and is to be covered again: begins the next time round, once
/// the others had the time to hear of the last cells.
fn next_lap(peer: &mut Peer) {
    let (now, pause_ms) = (peer.now, LAP_PERIODS * peer.period_ms());
    let Some(crew) = &mut peer.crew else {
        return;
    };
    let Some(since) = crew.over_since else {
        crew.over_since = Some(now);
        peer.voice.cover_changed = true;
        save_union(peer, true);
        return;
    };
    if now.since_ms(since) >= pause_ms
        && let Some(next) = crew.ground.mission.next_lap()
    {
        peer.library.offer(Arc::new(next));
    }
}

/// Whether all that can be covered is covered.
fn finish(peer: &mut Peer) {
    let Some(crew) = &mut peer.crew else {
        return;
    };
    let complete = crew.negotiation.section.complete();
    if complete && crew.ground.mission.further_laps > 0 {
        next_lap(peer);
        return;
    }
    if complete == crew.finished {
        return;
    }
    crew.finished = complete;
    crew.replan = true;
    let revision = crew.revision();
    if complete && peer.config.role == Role::Uav {
        peer.report(Report::Finished { revision });
        peer.voice.finished_due = true;
        peer.voice.claim_changed = true;
        peer.voice.cover_changed = true;
        save_union(peer, true);
    }
}

/// Gives the executive its goal, if that changed.
fn steer(peer: &mut Peer) {
    let order = peer.order.order;
    let Some(crew) = &mut peer.crew else {
        return;
    };
    let section = &crew.negotiation.section;
    let base = point_m(crew.ground.mission.base);
    let goal = if order == Order::Hold {
        Goal::Hold
    } else if order == Order::ReturnToBase || crew.finished || crew.exhausted {
        Goal::Point(base)
    } else if section.plan().is_empty() {
        Goal::Hold
    } else {
        Goal::Legs(legs_of(section.plan(), section.cells()))
    };
    let same_kind = match (&crew.goal, &goal) {
        (Some(Goal::Legs(_)), Goal::Legs(_)) => true,
        (Some(a), b) => a == b,
        (None, _) => false,
    };
    if same_kind && !core::mem::take(&mut crew.replan) {
        return;
    }
    crew.replan = false;
    if same_kind && !matches!(goal, Goal::Legs(_)) {
        return;
    }
    if let Some(executive) = &mut crew.executive {
        executive.set_goal(goal.clone(), &|c| !section.union().contains(c));
    }
    crew.goal = Some(goal);
}

/// Planned cells as legs: runs of neighbouring cells flown the same way.
#[must_use]
pub fn legs_of(plan: &[PlanCell], n: u16) -> Vec<Leg> {
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
pub(crate) fn view(peer: &Peer, view: &mut View) {
    let Some(crew) = &peer.crew else {
        return;
    };
    let section = &crew.negotiation.section;
    view.able = crew.able();
    view.loop_hash = crew.loop_hash();
    view.revision = crew.revision();
    view.union = (0..section.cells())
        .map(|c| section.union().contains(c))
        .collect();
    view.plan = section.plan().iter().map(|p| p.cell).collect();
    view.held = section.held().keys().copied().collect();
    view.unassigned = section.unassigned().iter().collect();
    view.epoch = section.epoch();
    view.counter = peer.durable.counter;
    view.adoptions = crew.negotiation.adoptions;
    view.finished = crew.finished;
    view.eta_ms = crew.eta_ms();
    view.spendable_ms = crew.spendable_ms(peer.percept.as_ref());
}
