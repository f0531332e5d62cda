//! Area coverage by a swarm: sections negotiated in rounds, taken over from the
//! fallen, finished by whoever is left (D2.7 §3.6.5).
//!
//! [`section`] holds the rules by which cells change hands, [`runs`] how they are
//! written into a register, [`rounds`] the exchange of bids, [`negotiation`] when each
//! is used, [`division`] what a complete round decides.

pub mod division;
pub mod negotiation;
pub mod rounds;
pub mod runs;
pub mod section;

pub use negotiation::Negotiation;
pub use section::{Live, Section};
