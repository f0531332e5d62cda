//! Effects: what a part of the peer wants done.
//!
//! A part takes an event and returns effects. [`crate::Peer`] alone carries them out,
//! in order, each with all that follows from it before the next: so no part touches
//! another one, an output, the journal or the relay.

use crate::Incarnation;
use crate::cells::CellSet;
use crate::journal::Entry;
use crate::mission::Mission;
use crate::offload::Job;
use crate::output::Report;
use crate::protocol::negotiation::Adoption;
use crate::protocol::runs::PlannedCell;
use crate::wire::codec::Body;
use crate::wire::message::{Bid, Epoch, Record};
use crate::wire::tasks::TaskId;
use skein_behaviors::Setpoint;
use std::sync::Arc;

/// What follows from an event, in order.
pub(crate) type Effects = Vec<Effect>;

/// One thing that a part wants done.
#[derive(Clone, Debug)]
pub(crate) enum Effect {
    /// Speak a record of this peer's own, under a subject.
    Speak(u16, Body),
    /// Say what nobody passes on, at once.
    SayNow(Body),
    /// Pass on, at once, what another peer said and the relay does not.
    PassOn(Record),
    /// Make an entry durable; the promise is kept once it is.
    Store(Promise, Entry),
    /// Have a job computed, unless it is under way.
    Compute(PendingJob, Job),
    /// Fly this.
    Fly(Setpoint),
    /// Tell this to people and judges.
    Report(Report),
    /// Tell people that something is wrong.
    Alarm(String),
    /// A life of this peer is durable: all parts begin it.
    Live(Incarnation),
    /// A twin speaks: what this peer lists is void, and it plans no more.
    Silent,
    /// What was heard may change the negotiation: look at it now.
    Negotiate,
    /// The own claim changed: it is spoken soon.
    ClaimChanged,
    /// The own claim is spoken now.
    ClaimNow,
    /// Covered cells are news: they are spoken soon.
    CoverageChanged,
    /// A neighbour said that these cells of the loop are covered.
    CoverageHeard(u64, CellSet),
    /// A neighbour knows of other covered cells: they are spoken sooner.
    CoverageWanted,
    /// All is covered: that is spoken.
    MissionFinished,
    /// A new mission of this peer's own making is on offer.
    Offer(Arc<Mission>),
    /// Claims and bids held from before are looked at again.
    HearAgain,
}

/// What waits for a store to become durable.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Promise {
    /// A life.
    Life(Incarnation),
    /// A bid.
    Bid(Box<Bid>),
    /// An adoption, and which of the claims written it is.
    Adopt(u64, Box<Adoption>),
    /// Cells taken without a round, likewise.
    Take(u64, Vec<PlannedCell>),
    /// Coverage, with so many cells that the journal does not hold yet; nothing waits for it.
    Covered(u16),
}

/// What waits for the result of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PendingJob {
    /// The geometry of the mission with this hash.
    Geometry(u64),
    /// A division of this epoch.
    Division(Epoch),
    /// The flight that does a task, in which revision, for which try.
    Errand(TaskId, u32, u8),
}
