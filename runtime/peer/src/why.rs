//! What a peer does and why, for a person who asks (D2.7 §1.2.3): the state of its mission's
//! diagram, the goal and the event that led to it, its claim, the last round, whom it believes what, and what happened last. Asking
//! changes nothing: all of it is a copy.

use crate::Incarnation;
use crate::cells::CellSet;
use crate::diagram::MissionEvent;
use crate::diagram::StateGoal;
use crate::input::Time;
use crate::layers::Layer;
use crate::mission::mm;
use crate::mission_state::MissionState;
use crate::output::Status;
use crate::separation::Separation;
use crate::task_desk::TaskView;
use crate::wire::message::{Bid, Epoch, ListedRun, Order, Orders};
use core::fmt;
use serde::{Deserialize, Serialize};
use skein_behaviors::executive::circuit::Gaps;
use skein_behaviors::{Executive, Percept};
use std::fmt::Write as _;

/// Next cells that are told.
const NEXT_CELLS: usize = 8;

/// By which event of its mission's diagram a UAV does what it does (`docs/protocol.md` §6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// The operator said hold.
    ToldToHold,
    /// The operator said return to base.
    ToldToReturn,
    /// The operator ended the mission.
    Cancelled,
    /// Everything is covered.
    Finished,
    /// Its fuel is due.
    FuelIsDue,
    /// Another process speaks under its id.
    Twin,
    /// It was given a relay position to hold.
    Relay,
    /// It was given a target to follow, and knows where it may be.
    Track,
    /// It was given a task to do.
    Task,
    /// It has cells to fly.
    Plan,
    /// Everything is seen, and the mission goes on.
    AllSeen,
    /// It knew many, has nothing to fly and hears nobody, or nobody who has.
    Astray,
    /// It has nothing to fly, and others are at work.
    OthersAtWork,
    /// The time of its mission is over.
    TimeIsOver,
    /// It stayed where it was for as long as it was to.
    Stayed,
    /// It believes a peer of its fleet to be down.
    PeerLost,
    /// A peer that it believed to be down is there again.
    PeerBack,
    /// The wind is too strong for its mission.
    Windy,
    /// A part of its mission cannot be flown.
    Infeasible,
    /// What its mission looks for was told.
    Detected,
    /// The event that its mission watches is too dense somewhere.
    CrowdDense,
    /// It lost the target that it follows.
    TargetLost,
}

impl Reason {
    /// What an event of the mission's diagram is for a person.
    pub(crate) fn of(event: MissionEvent) -> Self {
        match event {
            MissionEvent::OperatorHold => Self::ToldToHold,
            MissionEvent::OperatorReturn => Self::ToldToReturn,
            MissionEvent::MissionCancelled => Self::Cancelled,
            MissionEvent::MissionComplete => Self::Finished,
            MissionEvent::LowFuel => Self::FuelIsDue,
            MissionEvent::TwinSpeaks => Self::Twin,
            MissionEvent::Timer => Self::TimeIsOver,
            MissionEvent::Stayed => Self::Stayed,
            MissionEvent::PeerLost => Self::PeerLost,
            MissionEvent::PeerBack => Self::PeerBack,
            MissionEvent::WindAbove => Self::Windy,
            MissionEvent::PlanInfeasible => Self::Infeasible,
            MissionEvent::ObjectDetected => Self::Detected,
            MissionEvent::CrowdDense => Self::CrowdDense,
            MissionEvent::TargetLost => Self::TargetLost,
            MissionEvent::TargetGiven => Self::Track,
            MissionEvent::RelayGiven => Self::Relay,
            MissionEvent::TaskGiven => Self::Task,
            MissionEvent::CellsGiven => Self::Plan,
            MissionEvent::AllSeen => Self::AllSeen,
            MissionEvent::NobodyHeard => Self::Astray,
            MissionEvent::Otherwise => Self::OthersAtWork,
        }
    }

    /// Why it does something, in half a sentence; nothing where what it does says so.
    #[must_use]
    pub fn cause(self) -> &'static str {
        match self {
            Self::ToldToHold => "the operator said hold",
            Self::ToldToReturn => "the operator said return-to-base",
            Self::Cancelled => "the operator cancelled the mission",
            Self::Finished => "everything is covered",
            Self::FuelIsDue => "its fuel is due",
            Self::Twin => "another process speaks under its id",
            Self::Relay | Self::Track | Self::Task | Self::Plan | Self::AllSeen => "",
            Self::Astray => "it has nothing to fly and hears nobody, or nobody who has",
            Self::OthersAtWork => "it has nothing to fly, others are at work",
            Self::TimeIsOver => "the time of its mission is over",
            Self::Stayed => "it stayed for as long as it was to",
            Self::PeerLost => "it believes a peer of its fleet to be down",
            Self::PeerBack => "a peer of its fleet is there again",
            Self::Windy => "the wind is stronger than its mission takes",
            Self::Infeasible => "a part of its mission cannot be flown",
            Self::Detected => "what its mission looks for was found",
            Self::CrowdDense => "the event that its mission watches is too dense somewhere",
            Self::TargetLost => "it lost the target that it follows",
        }
    }
}

/// Where a UAV is and what it has left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Flight {
    /// East of the mission's origin, metres.
    pub east_m: f64,
    /// North of it, metres.
    pub north_m: f64,
    /// Height above it, metres.
    pub height_m: f64,
    /// Heading, radians counter-clockwise from east.
    pub heading_rad: f64,
    /// Airspeed, m/s.
    pub airspeed_mps: f64,
    /// Wind towards the east, m/s.
    pub wind_east_mps: f64,
    /// Wind towards the north, m/s.
    pub wind_north_mps: f64,
    /// Flight time left, seconds.
    pub endurance_s: f64,
    /// Of that what it keeps in reserve, seconds.
    pub reserve_s: f64,
    /// Of that what the way home from here may take, and is kept because it may be noticed
    /// late that the fuel is due, seconds.
    pub return_s: f64,
    /// Of that what is left before it must turn home, seconds.
    pub spendable_s: f64,
}

/// A round of which this peer knows bids.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastRound {
    /// Its counter.
    pub counter: u32,
    /// Who is in it.
    pub members: Vec<u16>,
    /// Whether it answers a loss; any other rebalances.
    pub repair: bool,
    /// How long it waits for bids, milliseconds.
    pub wait_ms: u32,
    /// How long ago the first of the bids was known here, milliseconds.
    pub first_bid_ms_ago: u64,
    /// Whose bids are known here.
    pub bids: Vec<BidHeard>,
}

impl BidHeard {
    /// The same of a bid of somebody.
    #[must_use]
    pub fn of(by: u16, bid: &Bid) -> Self {
        Self {
            by,
            anchor: bid.anchor,
            release_ms: bid.release_ms,
            endurance_ms: bid.endurance_ms,
            eta_ms: bid.eta_ms,
        }
    }
}

/// A bid, as far as people want to know it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BidHeard {
    /// Whose.
    pub by: u16,
    /// Boundary of the loop where it will be.
    pub anchor: u16,
    /// When, milliseconds after the bid.
    pub release_ms: u32,
    /// What it may fly after that, milliseconds.
    pub endurance_ms: u32,
    /// Expected end of the plan that it had, milliseconds after the bid.
    pub eta_ms: u32,
}

/// What is believed of somebody else.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Other {
    /// Who.
    pub id: u16,
    /// In which life.
    pub incarnation: Incarnation,
    /// What it is believed to be.
    pub status: Status,
    /// Since when, milliseconds ago; none where that is forgotten.
    pub since_ms: Option<u64>,
    /// When its own beacon was heard last, milliseconds ago; none where it never was.
    pub heard_ms_ago: Option<u64>,
    /// Which revision it follows, as far as is known; 0 where it is not.
    pub revision: u32,
    /// How many of its cells are open, as its claim says.
    pub open_cells: usize,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PastEvent {
    /// How long ago, milliseconds.
    pub ms_ago: u64,
    /// What.
    pub text: String,
}

/// A layer of a mission, as one UAV flies it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LayerFlown {
    /// Which it is.
    pub layer: Layer,
    /// On the way there, to which height it flies now: where it may stay until others leave it
    /// the room; mm above the origin.
    pub next_mm: Option<i32>,
}

impl fmt::Display for LayerFlown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Layer { nth, of, height_mm } = self.layer;
        let m = |mm: f64| mm / 1000.0;
        write!(
            f,
            "{} of {of}, from {:.0} m up",
            nth + 1,
            m(height_mm.into())
        )?;
        match self.next_mm {
            Some(mm) => write!(
                f,
                "; on the way there, at most to {:.1} m until others leave it the room",
                m(mm.into())
            ),
            None => Ok(()),
        }
    }
}

/// What a UAV promised others that it flies, and asks them for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Agreed {
    /// For how long the way leads on that was agreed, milliseconds; 0 on the circle at its end.
    pub way_ms: u64,
    /// For how long it has flown that circle, milliseconds.
    pub circles_ms: u64,
    /// Whether it asks others for what is to follow.
    pub offers: bool,
    /// Whose word that waits for.
    pub waits_for: Vec<u16>,
    /// Who is near and answers nothing: they are kept clear of, and nobody waits for them.
    pub silent: Vec<u16>,
    /// For how long it has found no way that keeps clear of what others fly, milliseconds.
    pub held_up_ms: Option<u64>,
}

impl fmt::Display for Agreed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ids = |ids: &[u16]| -> String {
            let ids: Vec<String> = ids.iter().map(ToString::to_string).collect();
            ids.join(" ")
        };
        if self.way_ms > 0 {
            write!(f, "a way for {:.1} s more, then a circle", s(self.way_ms))?;
        } else {
            write!(f, "a circle, for {:.1} s", s(self.circles_ms))?;
        }
        match (self.offers, &self.waits_for[..]) {
            (false, _) => {}
            (true, []) => write!(f, "; asks for more, which all accepted")?,
            (true, some) => write!(f, "; asks for more, waits for {}", ids(some))?,
        }
        if let Some(ms) = self.held_up_ms {
            write!(f, "; no way was clear for {:.1} s", s(ms))?;
        }
        if !self.silent.is_empty() {
            write!(f, "; silent: {}", ids(&self.silent))?;
        }
        Ok(())
    }
}

/// The mission as one peer follows it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Its revision.
    pub revision: u32,
    /// Identifies the loop.
    pub loop_hash: u64,
    /// Cells that are to be seen.
    pub cells: usize,
    /// Of them those that it knows to be covered.
    pub covered: usize,
    /// Cells that nobody has the endurance for.
    pub unassigned: usize,
    /// By which event it does what it does.
    pub reason: Reason,
    /// The diagram that it obeys.
    #[serde(default)]
    pub diagram: String,
    /// In which state of it.
    #[serde(default)]
    pub state: String,
    /// For how long it has been in it, milliseconds.
    #[serde(default)]
    pub state_ms: u64,
    /// What is done in that state, for a person.
    #[serde(default)]
    pub does: String,
    /// In which layer it flies, where its mission has some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer: Option<LayerFlown>,
    /// Whether it makes way for an aircraft that is no member.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub evades: bool,
    /// What it promised others, where UAVs keep apart by agreement.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub agreed: Option<Agreed>,
    /// Whether it takes part in planning.
    pub able: bool,
    /// Its open cells that come next, in order of flight.
    pub next_cells: Vec<u16>,
    /// How many open cells it lists.
    pub open_cells: usize,
    /// When it expects to have flown them, milliseconds from now.
    pub eta_ms: u32,
    /// The division that it adopted last.
    pub epoch: Epoch,
    /// What it lists, in order of flight, each run with its stamp.
    pub plan: Vec<ListedRun>,
    /// What it gave away and still answers for.
    pub held: Vec<ListedRun>,
}

/// What a peer does and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Why {
    /// Who.
    pub id: u16,
    /// In which life; 0 before the first.
    pub incarnation: Incarnation,
    /// Its clock, milliseconds.
    pub time_ms: u64,
    /// Whether it is a ground station.
    pub ground_station: bool,
    /// Whether it speaks.
    pub speaks: bool,
    /// The standing order, as far as it heard.
    pub order: Order,
    /// All that the operator ordered, as far as it heard.
    #[serde(default)]
    pub orders: Orders,
    /// Its flight; none of a ground station, and before the first percept.
    pub flight: Option<Flight>,
    /// The mission; none before it has derived the loop of one.
    pub work: Option<Work>,
    /// The last round of which it knows bids.
    pub round: Option<LastRound>,
    /// Tasks other than coverage that it knows.
    #[serde(default)]
    pub tasks: Vec<TaskView>,
    /// Objects that its mission looks for, as it was told of them, a sentence each.
    #[serde(default)]
    pub detections: Vec<String>,
    /// What is known of a contour, in a sentence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contour: Option<String>,
    /// What was counted at the sites of its mission, a sentence each.
    #[serde(default)]
    pub counts: Vec<String>,
    /// What it believes of others, by their numbers.
    pub others: Vec<Other>,
    /// What happened last, the oldest first.
    pub events: Vec<PastEvent>,
}

pub(crate) fn flight(state: Option<&MissionState>, percept: &Percept, reserve_s: f64) -> Flight {
    let seconds = |ms: u32| f64::from(ms) / 1000.0;
    Flight {
        east_m: percept.pose.east_m,
        north_m: percept.pose.north_m,
        height_m: percept.height_m,
        heading_rad: percept.pose.heading_rad,
        airspeed_mps: percept.airspeed_mps,
        wind_east_mps: percept.wind_east_mps,
        wind_north_mps: percept.wind_north_mps,
        endurance_s: percept.endurance_s,
        reserve_s,
        return_s: state
            .and_then(|s| s.executive.as_ref())
            .map_or(0.0, |e| seconds(e.kept_ms())),
        spendable_s: state.map_or(0.0, |s| seconds(s.spendable_ms(Some(percept)))),
    }
}

/// What is done, and why, in a sentence.
fn does(goal: StateGoal, reason: Reason) -> String {
    let (goal, cause) = (goal.sentence(), reason.cause());
    if cause.is_empty() {
        goal.to_owned()
    } else {
        format!("{goal}: {cause}")
    }
}

/// Who is ahead of it and behind, where it flies round and hears others who do.
fn spacing(gaps: Gaps) -> String {
    let Gaps { ahead_m, behind_m } = gaps;
    format!("the next one is {ahead_m:.0} m ahead and the last one {behind_m:.0} m behind")
}

fn layer(state: &MissionState) -> Option<LayerFlown> {
    let layer = state.geometry.mission.layer()?;
    let changes = state.executive.as_ref().filter(|e| e.changes_layer());
    Some(LayerFlown {
        layer,
        next_mm: changes.map(|e| mm(e.height_m())),
    })
}

pub(crate) fn work(state: &MissionState, now: Time) -> Work {
    let sections = &state.negotiation.sections;
    let coverage_loop = &state.geometry.coverage_loop;
    // Of a mission that was cancelled nothing is to be seen.
    let asked = !state.geometry.mission.cancelled;
    let needed = (0_u16..)
        .zip(coverage_loop.cells())
        .filter(|(_, c)| c.needed && asked);
    let (claim, covered) = (state.claim(), sections.covered());
    let (at, reason) = (state.stage.state(), Reason::of(state.stage.by()));
    let open: Vec<u16> = sections
        .plan()
        .iter()
        .map(|p| p.cell)
        .filter(|c| !covered.contains(*c))
        .collect();
    let gaps = state.executive.as_ref().and_then(Executive::gaps);
    let does = match gaps.filter(|_| at.goal.goes_on()) {
        Some(gaps) => format!("{}; {}", does(at.goal, reason), spacing(gaps)),
        None => does(at.goal, reason),
    };
    Work {
        revision: state.revision(),
        loop_hash: state.loop_hash(),
        cells: needed.clone().count(),
        covered: needed.filter(|(i, _)| covered.contains(*i)).count(),
        unassigned: usize::from(CellSet::count(sections.unassigned())),
        reason,
        diagram: state.geometry.mission.flown_by().name.clone(),
        state: at.name.clone(),
        state_ms: state.stage.state_ms(now),
        does,
        layer: layer(state),
        evades: state
            .executive
            .as_ref()
            .is_some_and(|e| e.evades() || e.passes_over()),
        agreed: state.separation.as_ref().and_then(Separation::agreed),
        able: state.able(),
        next_cells: open.iter().copied().take(NEXT_CELLS).collect(),
        open_cells: open.len(),
        eta_ms: state.eta_ms(),
        epoch: claim.epoch,
        plan: claim.plan,
        held: claim.held,
    }
}

fn s(ms: u64) -> f64 {
    #[allow(clippy::cast_precision_loss, reason = "for people")]
    let seconds = ms as f64 / 1000.0;
    seconds
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = if self.ground_station {
            format!("the ground station {}", self.id)
        } else {
            format!("uav{}", self.id)
        };
        let voice = if self.speaks {
            ""
        } else {
            ", and only listens"
        };
        writeln!(
            f,
            "{name} at {:.1} s of its clock, life {}{voice}",
            s(self.time_ms),
            self.incarnation
        )?;
        let alone = self.orders.singles.contains_key(&self.id);
        if self.ground_station {
            writeln!(f, "  order     {}", self.orders)?;
        } else if alone {
            let (own, all) = (self.order.name(), self.orders.all.name());
            writeln!(f, "  order     {own}, to it alone; {all} to all")?;
        } else {
            writeln!(f, "  order     {}", self.order.name())?;
        }
        match &self.work {
            None => writeln!(f, "  mission   none yet")?,
            Some(work) => self.write_work(work, f)?,
        }
        if let Some(flight) = &self.flight {
            write_flight(flight, f)?;
        }
        if let Some(round) = &self.round {
            write_round(round, f)?;
        }
        for task in &self.tasks {
            write_task(task, f)?;
        }
        for told in self.detections.iter().chain(&self.counts) {
            writeln!(f, "  {told}")?;
        }
        if let Some(told) = &self.contour {
            writeln!(f, "  contour   {told}")?;
        }
        for other in &self.others {
            write_other(other, f)?;
        }
        for event in &self.events {
            writeln!(f, "  {:>7.1} s ago  {}", s(event.ms_ago), event.text)?;
        }
        Ok(())
    }
}

impl Why {
    fn write_work(&self, work: &Work, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  mission   revision {}, loop {:016x}, {} of {} cells covered, {} beyond everybody's fuel",
            work.revision, work.loop_hash, work.covered, work.cells, work.unassigned
        )?;
        if self.ground_station {
            return Ok(());
        }
        let able = if work.able {
            ""
        } else {
            "; takes no part in planning"
        };
        writeln!(f, "  does      {}{able}", work.does)?;
        if !work.state.is_empty() {
            let (state, diagram, ms) = (&work.state, &work.diagram, work.state_ms);
            let since_s = s(ms);
            writeln!(
                f,
                "  state     {state} of the diagram {diagram}, for {since_s:.1} s"
            )?;
        }
        if let Some(layer) = &work.layer {
            writeln!(f, "  layer     {layer}")?;
        }
        if let Some(agreed) = &work.agreed {
            writeln!(f, "  promised  {agreed}")?;
        }
        if work.evades {
            writeln!(
                f,
                "  evades    an aircraft that is no member, from what it senses"
            )?;
        }
        let (counter, hash) = (work.epoch.counter, work.epoch.hash);
        writeln!(f, "  epoch     {counter}.{hash:08x}")?;
        let next: Vec<String> = work.next_cells.iter().map(ToString::to_string).collect();
        writeln!(
            f,
            "  plan      {} open cells until {:.1} s from now, next {}",
            work.open_cells,
            s(work.eta_ms.into()),
            if next.is_empty() {
                "none".to_owned()
            } else {
                next.join(" ")
            }
        )?;
        for (what, runs) in [("claims", &work.plan), ("holds", &work.held)] {
            for listed in runs {
                write_run(what, listed, f)?;
            }
        }
        Ok(())
    }
}

fn write_run(what: &str, listed: &ListedRun, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let (run, stamp) = (listed.run, listed.stamp);
    let way = if listed.backward { ", backward" } else { "" };
    writeln!(
        f,
        "  {what:<9} {} cells from {}{way}, stamp {}.{:08x} take {} by {}",
        run.count, run.first, stamp.epoch.counter, stamp.epoch.hash, stamp.take, stamp.id
    )
}

fn write_flight(flight: &Flight, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    writeln!(
        f,
        "  flies     at {:.0} m east, {:.0} m north, {:.0} m high, {:.1} m/s, heading {:.2} rad, wind {:.1} {:.1} m/s",
        flight.east_m,
        flight.north_m,
        flight.height_m,
        flight.airspeed_mps,
        flight.heading_rad,
        flight.wind_east_mps,
        flight.wind_north_mps
    )?;
    writeln!(
        f,
        "  fuel      {:.0} s left: {:.0} s reserve, {:.0} s to return, {:.0} s for work",
        flight.endurance_s, flight.reserve_s, flight.return_s, flight.spendable_s
    )
}

fn write_round(round: &LastRound, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let kind = if round.repair {
        "repair"
    } else {
        "rebalancing"
    };
    let missing = round.members.iter();
    let missing = missing.filter(|m| round.bids.iter().all(|b| b.by != **m));
    let mut lacks = String::new();
    for m in missing {
        write!(lacks, " {m}")?;
    }
    writeln!(
        f,
        "  round     {}, a {kind} of {} members {:.1} s ago, waits {:.1} s; bids lacking of:{}",
        round.counter,
        round.members.len(),
        s(round.first_bid_ms_ago),
        s(round.wait_ms.into()),
        if lacks.is_empty() { " nobody" } else { &lacks }
    )?;
    for bid in &round.bids {
        writeln!(
            f,
            "    bid of {}: at boundary {} in {:.1} s, {:.0} s of fuel after it, its plan then ended in {:.1} s",
            bid.by,
            bid.anchor,
            s(bid.release_ms.into()),
            s(bid.endurance_ms.into()),
            s(bid.eta_ms.into())
        )?;
    }
    Ok(())
}

fn write_task(task: &TaskView, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let state = format!("{:?}", task.state).to_lowercase();
    write!(f, "  task      {} {state}, needs {}", task.name, task.needs)?;
    if let Some(by) = task.done_by {
        write!(f, ", by uav{by}")?;
    }
    for holder in &task.held_by {
        let progress = format!("{:?}", holder.progress).to_lowercase();
        let bid = f64::from(holder.bid) / 1e6;
        write!(f, ", uav{} {progress} (bid {bid:.1})", holder.uav)?;
    }
    if let Some(why) = &task.nobody_can {
        write!(f, ", nobody can: {why}")?;
    }
    writeln!(f)
}

fn write_other(other: &Other, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let status = match other.status {
        Status::Alive => "alive",
        Status::Suspect => "suspect",
        Status::Down => "down",
    };
    write!(f, "  peer {:<4} {status}", other.id)?;
    if let Some(ms) = other.since_ms {
        write!(f, " for {:.1} s", s(ms))?;
    }
    write!(f, ", life {}", other.incarnation)?;
    match other.heard_ms_ago {
        Some(ms) => write!(f, ", heard itself {:.1} s ago", s(ms))?,
        None => write!(f, ", never heard itself")?,
    }
    if other.revision > 0 {
        write!(f, ", revision {}", other.revision)?;
    }
    if other.open_cells > 0 {
        write!(f, ", {} open cells", other.open_cells)?;
    }
    writeln!(f)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_promised_is_told_in_a_sentence() {
        let on_its_way = Agreed {
            way_ms: 4_200,
            circles_ms: 0,
            offers: false,
            waits_for: Vec::new(),
            silent: Vec::new(),
            held_up_ms: None,
        };
        let told = on_its_way.to_string();
        assert_eq!(told, "a way for 4.2 s more, then a circle");
        let asks = Agreed {
            offers: true,
            ..on_its_way.clone()
        };
        assert!(
            asks.to_string()
                .ends_with("asks for more, which all accepted")
        );
        let waits = Agreed {
            way_ms: 0,
            circles_ms: 12_000,
            waits_for: vec![2, 5],
            ..asks
        };
        let told = waits.to_string();
        assert_eq!(told, "a circle, for 12.0 s; asks for more, waits for 2 5");
        let held_up = Agreed {
            offers: false,
            silent: vec![7],
            held_up_ms: Some(3_000),
            ..waits
        };
        let told = held_up.to_string();
        assert!(
            told.ends_with("; no way was clear for 3.0 s; silent: 7"),
            "{told}"
        );
    }
}
