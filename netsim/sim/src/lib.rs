//! The world and the radio around a swarm, in virtual time.
//!
//! | module | what it holds |
//! |---|---|
//! | [`spec`] | a scenario with nothing left to resolve |
//! | [`world`] | airframes, buildings, the judge |
//! | [`radio`] | links, the graph they form, the shared channel |
//! | [`chaos`] | one enum of faults, for simulated and live swarms |

pub mod chaos;
pub mod radio;
pub mod spec;
pub mod world;
