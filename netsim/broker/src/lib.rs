//! The simulated world and radio around live peers.
//!
//! A trial launches one process a peer, runs the same world as the simulator in real
//! time times a factor, and lets peers reach each other only through loopback
//! proxies. What it comes to is told by the simulator's own
//! [account](skein_netsim::account).
//!
//! | module | what it does |
//! |---|---|
//! | [`trial`] | prepares, steps the world, ends |
//! | `peers` | starts and ends all peers, takes in what they say |
//! | `live_peer` | one peer: process, files, the line to it |
//! | [`config`] | the configuration that each peer's process reads |
//! | `transports` | the proxies of all pairs, dark while their links are down |
//! | `faults` | which faults are to come, what each does and what should follow |
//! | [`live_world`] | the world and its radio links, as a trial uses them |
//! | `observed` | what a trial tells those who look at it |
//! | [`stream`] | percepts and setpoints, one loopback stream a peer |
//! | [`proxy`] | one transport, which can go dark |
//! | [`encounters`], [`auctions`], [`pursuits`] | many encounters, task auctions or pursuits at once, without a trial; `seeds` runs them on all threads |
//! | [`process`] | processes, and the guard that leaves none behind |
//! | [`control`], [`registry`] | how other commands find a trial and talk to it |
//! | [`pacer`] | scenario time against wall time |
//! | [`batch`] | many simulated runs at the same time |

pub mod auctions;
pub mod batch;
pub mod config;
pub mod control;
pub mod encounters;
mod error;
mod faults;
mod live_peer;
pub mod live_world;
mod looked_for;
mod observed;
pub mod pacer;
mod peers;
pub mod process;
pub mod proxy;
pub mod pursuits;
pub mod registry;
mod seeds;
pub mod stream;
mod transports;
pub mod trial;

pub use error::TrialError;
pub use trial::{Event, Options, Progress, run};
