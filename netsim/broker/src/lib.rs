//! The simulated world and radio around live peers.
//!
//! A trial launches one process a peer, runs the same world as the simulator in real
//! time times a factor, and lets peers reach each other only through loopback
//! proxies.
//!
//! | module | what it does |
//! |---|---|
//! | [`trial`] | prepares, steps the world, ends |
//! | `lifecycle` | starts and ends the peers |
//! | `from_peers` | takes in what peers say |
//! | `judge` | draws the verdict |
//! | `faults` | carries out faults and says what should follow |
//! | [`live_world`] | the world and its radio links, as a trial uses them |
//! | [`stream`] | percepts and setpoints, one loopback stream a peer |
//! | [`proxy`] | the transports between each two peers, which can go dark |
//! | [`process`] | processes, and the guard that leaves none behind |
//! | [`control`], [`registry`] | how other commands find a trial and talk to it |
//! | [`ledger`], [`verdict`] | what was seen, and what it adds up to |
//! | [`pacer`] | scenario time against wall time |

pub mod control;
mod faults;
mod from_peers;
mod judge;
pub mod ledger;
mod lifecycle;
pub mod live_world;
pub mod member;
pub mod pacer;
pub mod process;
pub mod proxy;
pub mod registry;
pub mod stream;
pub mod trial;
pub mod verdict;

pub use trial::{Event, Options, Progress, TrialError, run};
pub use verdict::Verdict;
