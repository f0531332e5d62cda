//! What may be asked of a running peer: of a ground station by its operator, of any by who
//! wants to know.

use serde::{Deserialize, Serialize};
use skein_behaviors::Order;
use skein_peer::Mission;
use skein_peer::input::TaskEdit;
use skein_peer::mission::PointMm;
use std::sync::Arc;

/// A request at the console of a peer. All but [`Command::Why`] are for a ground station.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Command {
    /// Every UAV is to do this until another order comes.
    Order(Order),
    /// One UAV is to do this until another order comes to it or to all.
    OrderOne(u16, Order),
    /// Every UAV is to fly this mission from now on: a change of the one that is flown. What
    /// was covered of the same places stays covered. Its revision is given by the ground
    /// station: the next one.
    Mission(Arc<Mission>),
    /// Every UAV is to fly this mission from now on, with nothing covered yet.
    Submit(Arc<Mission>),
    /// The mission ends: all fly home.
    Cancel,
    /// The mission goes on, with the base elsewhere: millimetres east and north of the
    /// mission's origin.
    Base(PointMm),
    /// The mission goes on with more no-fly zones.
    AddZones(Vec<NewZone>),
    /// The mission goes on without a no-fly zone that was added.
    RemoveZone(String),
    /// Something about tasks other than coverage: one more, one less.
    Task(TaskEdit),
    /// What the ground station knows of the mission: one line of JSON, an
    /// [`Overview`](skein_peer::Overview).
    Show,
    /// The quickest way along the mission's streets between two places, millimetres from its
    /// origin, by what the ground station knows now: one line of JSON, a
    /// [`WayHint`](skein_peer::hint::WayHint).
    Hint(PointMm, PointMm),
    /// What this peer does and why: one line of JSON, a [`Why`](skein_peer::Why).
    Why,
}

impl Command {
    /// An order to one UAV, or to all.
    #[must_use]
    pub const fn order(uav: Option<u16>, order: Order) -> Self {
        match uav {
            Some(uav) => Self::OrderOne(uav, order),
            None => Self::Order(order),
        }
    }
}

/// A no-fly zone that is to be added.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NewZone {
    /// What it is called; without a name it is given one that is free.
    pub name: Option<String>,
    /// Its corners, millimetres east and north of the mission's origin.
    pub ring: Vec<PointMm>,
}
