//! What the operator may ask of a ground station.

use serde::{Deserialize, Serialize};
use skein_behaviors::Order;
use skein_peer::Mission;
use skein_peer::mission::PointMm;
use std::sync::Arc;

/// A request at the console of a ground station.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Command {
    /// Every UAV is to do this until another order comes.
    Order(Order),
    /// Every UAV is to fly this mission from now on. Its revision is given by the
    /// ground station: the next one.
    Mission(Arc<Mission>),
    /// The mission goes on, with the base elsewhere: millimetres east and north of the
    /// mission's origin.
    Base(PointMm),
}
