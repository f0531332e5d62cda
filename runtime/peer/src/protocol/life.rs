//! A life begins: incarnation, probation, and what a peer does when it hears of
//! another life of its own.
//!
//! | state | event | next state | output |
//! |---|---|---|---|
//! | born | start | promised | the journal's incarnation plus one is stored |
//! | promised | stored | listening | probation of 3 T runs from the start |
//! | listening | its own id at this or a higher life | promised | that plus one is stored |
//! | listening | 3 T are over | speaking | beacons |
//! | speaking | its own id at a higher life, or a heartbeat it never sent | promised | that plus one |
//!
//! Without the last row a peer that lost its disk would be a zombie nobody believes.

use crate::cells::CellSet;
use crate::input::Time;
use crate::journal::{Durable, Entry};
use crate::output::Report;
use crate::peer::{Peer, Promise};
use crate::wire::message::Member;
use crate::{Incarnation, cooperation, outbound};

/// A new life only listens for this many beacon periods: long enough to hear a
/// neighbour's gossip about an earlier life at 30 % loss with 97 % certainty, and
/// what it missed is caught by the rule that works at any time.
pub const PROBATION_PERIODS: u64 = 3;

/// Where a life stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Life {
    /// The life that is durable; 0 before the first.
    pub incarnation: Incarnation,
    /// The life that is being made durable.
    pub promised: Option<Incarnation>,
    /// Probation ends then.
    pub listens_until: Time,
    /// Tells two peers under one id apart.
    pub nonce: u32,
}

impl Life {
    /// Whether the peer may speak.
    #[must_use]
    pub fn speaks(&self, now: Time) -> bool {
        self.incarnation > 0 && self.promised.is_none() && now >= self.listens_until
    }
}

pub(crate) fn start(peer: &mut Peer, persisted: &[Vec<u8>], nonce: u32) {
    let (durable, unread) = Durable::replay(persisted);
    peer.durable = durable;
    if unread > 0 {
        peer.alarm(&format!(
            "{unread} journal records of a later version were skipped"
        ));
    }
    peer.life.nonce = nonce;
    peer.life.listens_until = peer.now.plus_ms(PROBATION_PERIODS * peer.period_ms());
    outbound::first_beacon(peer);
    promise(peer, peer.durable.incarnation.saturating_add(1));
    cooperation::consider_mission(peer);
}

fn promise(peer: &mut Peer, incarnation: Incarnation) {
    if peer.life.promised.is_some_and(|p| p >= incarnation) {
        return;
    }
    if peer.store(Promise::Life(incarnation), Entry::Life(incarnation)) {
        peer.life.promised = Some(incarnation);
    }
}

/// The life is durable and may be spoken of.
pub(crate) fn lives(peer: &mut Peer, incarnation: Incarnation) {
    if peer.life.promised != Some(incarnation) {
        return;
    }
    peer.life.promised = None;
    peer.life.incarnation = incarnation;
    peer.membership.set_self(incarnation);
    peer.relay.new_life();
    outbound::new_life(peer);
    let me = Member {
        id: peer.config.id.0,
        incarnation,
    };
    if let Some(mission_state) = &mut peer.mission_state {
        mission_state.new_life(me);
    }
    peer.report(Report::Booted { incarnation });
}

/// Somebody speaks of this peer's own id in the given life, with a heartbeat.
pub(crate) fn heard_of_myself(peer: &mut Peer, incarnation: Incarnation, heartbeat: u32) {
    let mine = peer.life.promised.unwrap_or(0).max(peer.life.incarnation);
    let never_sent = incarnation == peer.life.incarnation && heartbeat > peer.outbound.heartbeat;
    if incarnation > mine
        || (incarnation == mine && never_sent)
        || (peer.life.incarnation == 0 && incarnation >= mine)
    {
        promise(peer, incarnation.saturating_add(1));
    }
}

/// A store of the life that failed is tried again.
pub(crate) fn tick(peer: &mut Peer) {
    if peer.life.incarnation == 0 && peer.life.promised.is_none() {
        promise(peer, peer.durable.incarnation.saturating_add(1));
    }
}

/// Covered cells the journal held, if they are counted on this loop.
pub(crate) fn remembered(durable: &Durable, loop_hash: u64, cells: u16) -> Option<CellSet> {
    if durable.loop_hash == loop_hash && durable.cells == cells {
        CellSet::decode_rle(cells, &durable.covered).ok()
    } else {
        None
    }
}
