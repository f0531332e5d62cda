//! Single-hop links to neighbours, whatever carries them.
//!
//! [`crate::bus`] has them over Zenoh. Which messages the air lets through is the
//! radio's business, what they mean the peer's.

use crate::radio::Hop;
use skein_peer::Priority;
use std::future::Future;

/// Something that a transport brings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A transmission of a neighbour.
    Heard {
        /// What travels beside the record; `None` where it cannot be read.
        hop: Option<Hop>,
        /// The hash of its key ([`skein_link::medium::key_hash`]).
        key: u64,
        /// The record.
        bytes: Vec<u8>,
    },
    /// The transport to a neighbour came or went.
    Link {
        /// The neighbour.
        neighbour: u16,
        /// Whether it came.
        up: bool,
    },
}

/// What the driver needs of a transport.
pub trait Transport: Send {
    /// The next event. Cancel-safe.
    fn next(&mut self) -> impl Future<Output = Event> + Send;

    /// Transmits to all linked neighbours, or to none of them: nothing is confirmed.
    fn publish(
        &mut self,
        key: &str,
        bytes: Vec<u8>,
        hop: Hop,
        priority: Priority,
    ) -> impl Future<Output = ()> + Send;

    /// Messages dropped because the driver was behind.
    fn overrun(&self) -> u64;

    /// Says goodbye to the neighbours.
    fn close(self) -> impl Future<Output = ()> + Send;
}
