//! What checks may look at: a copy of what one peer believes.

use crate::cells::CellSet;
use crate::counting::SiteCount;
use crate::diagram::MissionEvent;
use crate::gathering::Sector;
use crate::output::Status;
use crate::tasking::Follows;
use crate::wire::detection::Detection;
use crate::wire::message::{Epoch, Order, Orders, Stamp};
use crate::wire::tasks::{Progress, TaskId};
use crate::wire::trail::Trail;
use crate::{Incarnation, PeerId};
use std::collections::BTreeMap;

/// A peer's beliefs at one moment. For checks and displays; nothing depends on it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beliefs {
    /// Its life.
    pub incarnation: Incarnation,
    /// Whether it speaks: its probation is over and no twin has silenced it.
    pub speaks: bool,
    /// Whether a twin has silenced it.
    pub is_silent: bool,
    /// Whether it can take part in planning.
    pub able: bool,
    /// Identifies its loop; 0 before it has one.
    pub loop_hash: u64,
    /// Mission revision it follows; 0 before it has one.
    pub revision: u32,
    /// Covered cells of the loop that it knows of.
    pub covered: CellSet,
    /// Cells it lists as its own future, in order of flight, uncovered or not.
    pub plan: Vec<u16>,
    /// By what right it lists each of them.
    pub stamps: Vec<Stamp>,
    /// Cells it gave away and still answers for.
    pub held: Vec<u16>,
    /// Cells alarmed as beyond anybody's endurance.
    pub unassigned: Vec<u16>,
    /// The latest division adopted.
    pub epoch: Epoch,
    /// The highest round counter it has promised: a durable one.
    pub counter: u32,
    /// Divisions adopted in this life.
    pub adoptions: u32,
    /// What it believes of others.
    pub peers: BTreeMap<PeerId, (Incarnation, Status)>,
    /// How many more share the work in its eyes, who were to be launched and were never heard of.
    pub unheard: usize,
    /// The diameter it reckons with.
    pub diameter: u32,
    /// The interval that its beacons announce, milliseconds.
    pub interval_ms: u64,
    /// Whether it believes that the mission is finished.
    pub finished: bool,
    /// The operator's standing order, as far as it has heard.
    pub order: Order,
    /// All that the operator ordered, as far as it was heard.
    pub orders: Orders,
    /// Flight time before it must turn home from where it is, milliseconds (endurance less
    /// reserve and way home); 0 where there is no way home.
    pub spendable_ms: u32,
    /// What it takes the wind for, m/s towards east and north; `None` before it flies.
    pub wind_mps: Option<(f64, f64)>,
    /// Whether its fuel is due: it flies home.
    pub is_fuel_due: bool,
    /// Whether it makes way for an aircraft that is no member.
    pub evades: bool,
    /// What it holds of tasks: which, in which revision, how far it is.
    pub tasks: Vec<(TaskId, u32, Progress)>,
    /// Whether it gave its section up to hold a relay position.
    pub relays: bool,
    /// In which state of its mission's diagram it is, by number, and the event that led there.
    pub stage: Option<(usize, MissionEvent)>,
    /// Whether cells of its mission are beyond everybody's fuel.
    pub cannot_fly_all: bool,
    /// Whether a peer that it believed to be down since it came to its state is there again.
    pub missed: bool,
    /// Whether it knew many and hears nobody, or for long nobody who has cells to fly.
    pub astray: bool,
    /// Whom it says that it follows, once it had seen it.
    pub follows: Option<Follows>,
    /// Tasks that it knows to be open, and in its eyes somebody can do.
    pub open_tasks: Vec<(TaskId, u32)>,
    /// Objects that its mission looks for, as it knows them.
    pub detections: Vec<(TaskId, Detection)>,
    /// Sectors of the event that its mission watches, as it was told of them.
    pub crowd: Vec<(u16, Sector)>,
    /// What it knows of a contour: of each author and register what was told last.
    pub trails: Vec<((u16, u16), Trail)>,
    /// Whether its UAV flies along a contour that it sees.
    pub traces: bool,
    /// What all together counted at the sites of its mission, as it knows.
    pub counts: Vec<SiteCount>,
    /// Records held, bytes waiting to be sent, open stores: each with its cap.
    pub loads: Vec<(&'static str, usize, usize)>,
}
