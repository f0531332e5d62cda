//! Statements on their way: each listener loses and waits by draws of its own.

use super::Air;
use skein_geometry::random::SplitMix64;
use skein_peer::PeerId;
use skein_peer::protocol::conflict::Intent;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Whom a statement reaches: listener by index, author, statement.
pub(super) type Arrival = (usize, PeerId, Rc<Intent>);

pub(super) struct Channel {
    air: Air,
    random: SplitMix64,
    due: BTreeMap<u64, Vec<Arrival>>,
}

impl Channel {
    pub(super) fn new(air: Air, seed: u64) -> Self {
        Self {
            air,
            random: SplitMix64::new(seed ^ 0x00C4_A77E),
            due: BTreeMap::new(),
        }
    }

    /// Sends to all but the sender.
    pub(super) fn send(
        &mut self,
        sender: usize,
        author: PeerId,
        intent: &Intent,
        now_ms: u64,
        listeners: usize,
    ) {
        let intent = Rc::new(intent.clone());
        for to in (0..listeners).filter(|to| *to != sender) {
            if self.random.unit() < self.air.loss {
                continue;
            }
            let delay_ms = f64::from(self.air.delay_ms) * (1.0 + 0.2 * self.random.unit());
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "delays are some seconds at most"
            )]
            let at_ms = now_ms + 1 + delay_ms as u64;
            let there = self.due.entry(at_ms).or_default();
            there.push((to, author, Rc::clone(&intent)));
        }
    }

    /// Whatever has arrived by now, in order.
    pub(super) fn due(&mut self, now_ms: u64) -> Vec<Arrival> {
        let later = self.due.split_off(&(now_ms + 1));
        std::mem::replace(&mut self.due, later)
            .into_values()
            .flatten()
            .collect()
    }
}
