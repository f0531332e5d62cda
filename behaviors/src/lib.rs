//! The reactive and executive layers (D2.7 §1.2.3): percept and plan in, setpoint
//! and event out.
//!
//! | module | what it holds |
//! |---|---|
//! | [`percept`] | what a UAV senses |
//! | [`wind_estimate`] | the wind, where nobody tells it |
//! | [`traffic`] | what it senses of other UAVs |
//! | [`sightings`] | what its camera sees of vehicles |
//! | [`contour`] | what its camera sees of a road, or of the edge of a fire |
//! | [`attitude`] | how it is tilted, and how its camera is turned in it |
//! | [`view`] | what its camera shows, tilted or not |
//! | [`setpoint`] | what it is told to fly |
//! | [`order`] | what the operator wants of all and of single UAVs |
//! | [`event`] | what the executive layer reports upwards |
//! | [`executive`] | a plan on the coverage loop, flown leg by leg, or a flight given whole |
//! | [`reactive`] | path following, and the envelope that has the last word |

pub mod attitude;
pub mod contour;
pub mod crowd;
pub mod event;
pub mod executive;
pub mod obstacle;
pub mod order;
pub mod percept;
pub mod reactive;
pub mod setpoint;
pub mod sightings;
#[cfg(test)]
mod testing;
pub mod traffic;
pub mod view;
pub mod wind_estimate;

pub use event::{Event, Unflyable};
pub use executive::{Executive, Forecast, GivenFlight, Goal};
pub use order::{Order, Orders};
pub use percept::Percept;
pub use setpoint::{Launch, Setpoint, Side, Steer};
