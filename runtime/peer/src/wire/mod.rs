//! Keys, kinds, messages, their bytes and their signatures.

pub mod aircraft;
pub(crate) mod cbor;
pub mod codec;
pub mod count;
pub mod crowd;
pub mod detection;
mod intent;
pub mod key;
pub mod kinds;
pub mod limits;
pub mod message;
pub mod obstacle;
#[cfg(test)]
pub(crate) mod samples;
pub mod schema;
pub mod signature;
pub mod target;
pub mod tasks;
pub mod trail;
pub mod usage;
