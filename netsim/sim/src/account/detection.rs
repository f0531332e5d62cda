//! From a death to its detection: what each peer reports of the others.

use super::is_down;
use skein_peer::output::Status;
use std::collections::BTreeMap;

/// One death, and who found out.
#[derive(Clone, Debug)]
struct Death {
    peer: u16,
    at_ms: u64,
    /// The life that ended.
    incarnation: u32,
    /// Whether the peer has been started again since.
    over: bool,
    /// When each live peer first held it for down, milliseconds.
    detected: BTreeMap<u16, u64>,
}

/// What peers believe of each other, as far as they report it.
#[derive(Clone, Debug, Default)]
pub struct Detection {
    lives: BTreeMap<u16, u32>,
    beliefs: BTreeMap<(u16, u16), (u32, Status)>,
    deaths: Vec<Death>,
}

impl Detection {
    /// The present or last life of a peer, if it ever reported one.
    #[must_use]
    pub fn life(&self, peer: u16) -> Option<u32> {
        self.lives.get(&peer).copied()
    }

    /// A peer runs under an incarnation.
    pub fn lives(&mut self, peer: u16, incarnation: u32) {
        self.lives.insert(peer, incarnation);
    }

    /// A process starts, and believes nothing.
    pub fn started(&mut self, peer: u16) {
        self.beliefs.retain(|(observer, _), _| *observer != peer);
        for d in self.deaths.iter_mut().filter(|d| d.peer == peer) {
            d.over = true;
        }
    }

    /// A process ends.
    pub fn ended(&mut self, now_ms: u64, peer: u16) {
        self.deaths.push(Death {
            peer,
            at_ms: now_ms,
            incarnation: self.life(peer).unwrap_or(0),
            over: false,
            detected: BTreeMap::new(),
        });
    }

    /// A belief changed. A death is detected by whoever held that very life for alive or
    /// suspect before: a peer that never heard of it has nothing to find out.
    pub fn believed(&mut self, now_ms: u64, observer: u16, subject: u16, belief: (u32, Status)) {
        let before = self.beliefs.insert((observer, subject), belief);
        let found_out = is_down(belief.1) && before.is_some_and(|(_, status)| !is_down(status));
        if !found_out {
            return;
        }
        let open = self.deaths.iter_mut().rfind(|d| d.peer == subject);
        if let Some(d) = open.filter(|d| !d.over && d.incarnation == belief.0) {
            d.detected.entry(observer).or_insert(now_ms);
        }
    }

    /// How long after it each live peer detected that death, milliseconds.
    #[must_use]
    pub fn delays_ms(&self, peer: u16, died_ms: u64) -> BTreeMap<u16, u64> {
        self.deaths
            .iter()
            .find(|d| d.peer == peer && d.at_ms == died_ms)
            .map(|d| {
                let after = |(by, at): (&u16, &u64)| (*by, at.saturating_sub(d.at_ms));
                d.detected.iter().map(after).collect()
            })
            .unwrap_or_default()
    }
}
