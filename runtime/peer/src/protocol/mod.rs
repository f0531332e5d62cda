//! Area coverage by a swarm: sections negotiated in rounds, taken over from the
//! fallen, finished by whoever is left (D2.7 §3.6.5).
//!
//! [`sections`] holds the rules by which cells change hands, [`runs`] how they are
//! written into a claim, [`rounds`] the exchange of bids, `negotiation` when each
//! is used, [`division`] what a complete round decides, `sharing` what is taken without
//! one, [`launches`] what everybody begins with. [`promises`] holds the rule by which committed
//! motions change, [`conflict`] which one is asked for. Tasks other than coverage are [`auction`]'s. What travels is `relay`'s, and how much of it [`airtime`]'s.

pub mod airtime;
pub mod auction;
pub mod conflict;
pub mod division;
pub mod launches;
pub(crate) mod life;
pub(crate) mod membership;
pub(crate) mod negotiation;
pub mod promises;
pub(crate) mod relay;
pub mod rounds;
pub mod runs;
pub mod sections;
pub(crate) mod sharing;

pub(crate) use negotiation::Negotiation;
pub use sections::{LivePeers, Sections};
