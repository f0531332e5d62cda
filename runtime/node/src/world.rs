//! A world around the peer, which rules its clock and its radio and watches it. In
//! flight there is none: the clock is the machine's, the air does what it does.

use skein_link::{LinkNews, RadioCounters};
use skein_peer::Report;
use skein_peer::witness::Witness;
use std::future::Future;

/// Something the world tells.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// Time went on.
    Tick(Tick),
    /// It is over: flush and leave.
    End,
}

/// The newest of everything that waited.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Scenario time, milliseconds.
    pub time_ms: u64,
    /// Scenario seconds per second of wall time.
    pub scale: f64,
    /// The links, when they changed.
    pub links: Option<LinkNews>,
}

/// What the driver needs of a world. What cannot be told to it is dropped:
/// [`World::next`] will say why.
pub trait World: Send {
    /// The next news; what the vehicle senses at that time comes after it. A world
    /// that is gone says [`News::End`]. Cancel-safe.
    fn next(&mut self) -> impl Future<Output = News> + Send;

    /// What the peer reports, for displays and judges.
    fn report(&mut self, report: &Report) -> impl Future<Output = ()> + Send;

    /// Whether anybody wants to be told what the peer sees and knows.
    fn judges(&self) -> bool;

    /// What the peer says of what it sees and knows, for judges.
    fn witness(&mut self, witness: &Witness) -> impl Future<Output = ()> + Send;

    /// What the radio did so far.
    fn count(&mut self, counters: RadioCounters) -> impl Future<Output = ()> + Send;

    /// The peer has flushed everything and leaves.
    fn leave(&mut self) -> impl Future<Output = ()> + Send;
}

/// Perhaps no world.
impl<W: World> World for Option<W> {
    async fn next(&mut self) -> News {
        match self {
            Some(world) => world.next().await,
            None => std::future::pending().await,
        }
    }

    async fn report(&mut self, report: &Report) {
        if let Some(world) = self {
            world.report(report).await;
        }
    }

    fn judges(&self) -> bool {
        self.as_ref().is_some_and(World::judges)
    }

    async fn witness(&mut self, witness: &Witness) {
        if let Some(world) = self {
            world.witness(witness).await;
        }
    }

    async fn count(&mut self, counters: RadioCounters) {
        if let Some(world) = self {
            world.count(counters).await;
        }
    }

    async fn leave(&mut self) {
        if let Some(world) = self {
            world.leave().await;
        }
    }
}
