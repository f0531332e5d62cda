//! The vehicle under the peer: percepts up, setpoints down (D2.7 §1.1).
//!
//! A vehicle is a simulator's stream today; an autopilot would be another file here.

use skein_behaviors::Percept;
use skein_link::LinkState;
use skein_link::frame::{Order, ToWorld};
use std::future::Future;

/// Something the vehicle, or the world around it, tells.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// Time went on; what the vehicle senses and hears changed.
    Tick(Tick),
    /// The operator, at this ground station's console, wants something.
    Command(Order),
    /// It is over: flush and leave.
    End,
}

/// The newest of everything that waited.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tick {
    /// Scenario time, milliseconds.
    pub time_ms: u64,
    /// Scenario seconds per second of wall time.
    pub scale: f64,
    /// What the vehicle senses.
    pub percept: Option<Percept>,
    /// Links into this peer.
    pub links: Option<Vec<(u16, LinkState)>>,
}

/// What the driver needs of a vehicle.
pub trait Vehicle: Send {
    /// The next news. Cancel-safe. A vehicle that is gone says [`News::End`].
    fn next(&mut self) -> impl Future<Output = News> + Send;

    /// Tells the vehicle, or the world around it, something. What cannot be
    /// delivered is dropped: [`Vehicle::next`] will say why.
    fn tell(&mut self, what: ToWorld) -> impl Future<Output = ()> + Send;
}

/// No vehicle and no world: a ground station on its own.
#[derive(Debug)]
pub struct NoVehicle;

impl Vehicle for NoVehicle {
    async fn next(&mut self) -> News {
        std::future::pending().await
    }

    async fn tell(&mut self, _what: ToWorld) {}
}
