//! The world and the radio around a swarm, in virtual time.
//!
//! | module | what it holds |
//! |---|---|
//! | [`spec`] | a scenario with nothing left to resolve |
//! | [`world`] | airframes, buildings, the judge |
//! | [`radio`] | links, the graph they form, the shared channel |
//! | [`chaos`] | one enum of faults, for simulated and live swarms |
//! | [`storm`] | random faults for one run |
//! | [`disk`] | virtual disks |
//! | [`stage`] | what all runs of a scenario share |
//! | [`swarm`] | peers, world and radio under one virtual clock |
//! | [`check`] | what must hold, judged while a run goes on |
//! | [`history`] | what happened, hashed and replayable |
//! | [`reference`](mod@reference) | how long it takes when everybody knows everything |
//! | [`summary`] | what many runs come to |

pub mod chaos;
pub mod check;
pub mod disk;
pub mod history;
pub mod radio;
pub mod reference;
pub mod spec;
pub mod stage;
pub mod storm;
pub mod summary;
pub mod swarm;
pub mod world;

pub use stage::Stage;
