//! The world and the radio around a swarm, in virtual time.
//!
//! | module | what it holds |
//! |---|---|
//! | [`spec`] | a scenario with nothing left to resolve |
//! | [`world`] | airframes, buildings, the judge |
//! | [`radio`] | links, the graph they form, the shared channel |
//! | [`fault`] | one enum of faults, for simulated and live swarms |
//! | [`fault_generator`] | random faults for one run |
//! | `troubles` | the kinds of trouble among them |
//! | [`disk`] | virtual disks |
//! | `twins` | which peers speak under the id of another |
//! | [`prepared`] | what all runs of a scenario share |
//! | [`runs`] | runs with the scenario's own faults, with drawn ones, without any |
//! | [`swarm`] | peers, world and radio under one virtual clock |
//! | [`auctions`] | UAVs that share tasks, over a channel of rounds |
//! | [`encounters`] | UAVs at one height that would meet |
//! | [`pursuit`] | UAVs that follow vehicles on roads |
//! | [`account`] | who took over what, when, and the verdict: one judge for simulated and live runs |
//! | `check` | what must hold, judged while a run goes on |
//! | `geometry_cache` | loops and routers, derived once for all peers and runs |
//! | [`history`] | what happened, hashed and replayable |
//! | `omniscient_baseline` | how long it takes when everybody knows everything |
//! | [`timeline`] | the kept events of a run for a person |
//! | [`summary`] | what many runs come to |

pub mod account;
pub mod auctions;
mod check;
pub mod disk;
pub mod encounters;
pub mod fault;
pub mod fault_generator;
mod geometry_cache;
pub mod history;
mod omniscient_baseline;
pub mod prepared;
pub mod pursuit;
pub mod radio;
pub mod runs;
pub mod spec;
pub mod summary;
pub mod swarm;
pub mod timeline;
mod troubles;
mod twins;
pub mod weather;
pub mod witnessed;
pub mod world;

pub use check::Findings;
pub use check::contours::{ContourCheck, ContourReport};
pub use check::counts::CountReport;
pub use check::crowds::{CrowdAlertReport, CrowdReport, Watched};
pub use check::detections::{DetectionCheck, DetectionReport, Truth};
pub use check::footprint::FootprintErrors;
pub use check::streets::{HintReport, StreetsReport};
pub use geometry_cache::geometry_of;
pub use prepared::Prepared;
pub use witnessed::Witnessed;
