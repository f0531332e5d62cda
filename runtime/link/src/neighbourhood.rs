//! The links as one node knows them: into it in full, among the others whether they hear
//! each other.

use crate::LinkState;
use crate::medium::Links;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Who hears whom, of all stations.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hearing {
    /// The stations, ascending.
    pub stations: Vec<u16>,
    /// A bit for each two of them, row by row from transmitter to receiver, the lowest
    /// bit of a byte first: 1 where the link is up.
    #[serde(with = "serde_bytes")]
    pub up: Vec<u8>,
}

impl Hearing {
    /// Of some stations, ascending, as `up` says of a transmitter and a receiver.
    #[must_use]
    pub fn of(stations: Vec<u16>, up: impl Fn(u16, u16) -> bool) -> Self {
        let n = stations.len();
        let mut bits = vec![0u8; (n * n).div_ceil(8)];
        for (i, tx) in stations.iter().enumerate() {
            for (j, rx) in stations.iter().enumerate() {
                let place = i * n + j;
                bits[place / 8] |= u8::from(i != j && up(*tx, *rx)) << (place % 8);
            }
        }
        Self { stations, up: bits }
    }

    /// Whether a station hears another; not where one of them is unknown.
    #[must_use]
    pub fn is_up(&self, tx: u16, rx: u16) -> bool {
        let place = |id: u16| self.stations.binary_search(&id).ok();
        let (Some(i), Some(j)) = (place(tx), place(rx)) else {
            return false;
        };
        let bit = i * self.stations.len() + j;
        self.up
            .get(bit / 8)
            .is_some_and(|b| b >> (bit % 8) & 1 == 1)
    }
}

/// What a world tells a node of the links.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkNews {
    /// The links into the node, by transmitter with a working radio.
    pub row: Vec<(u16, LinkState)>,
    /// Who of all hears whom.
    pub hearing: Hearing,
}

/// The links around one node.
#[derive(Clone, Debug)]
pub struct Neighbourhood {
    me: u16,
    row: BTreeMap<u16, LinkState>,
    hearing: Hearing,
}

impl Neighbourhood {
    /// Nobody is known.
    #[must_use]
    pub fn new(me: u16) -> Self {
        Self {
            me,
            row: BTreeMap::new(),
            hearing: Hearing::default(),
        }
    }

    /// Takes the newest.
    pub fn set(&mut self, news: LinkNews) {
        self.row = news.row.into_iter().collect();
        self.hearing = news.hearing;
    }

    /// Whether a transmitter's radio works, as far as this node was told.
    #[must_use]
    pub fn knows(&self, tx: u16) -> bool {
        self.row.contains_key(&tx)
    }
}

impl Links for Neighbourhood {
    fn state(&self, tx: u16, rx: u16) -> LinkState {
        if rx == self.me {
            return self.row.get(&tx).copied().unwrap_or(LinkState::DOWN);
        }
        let up = self.hearing.is_up(tx, rx);
        LinkState {
            in_range: up,
            in_sight: up,
            ..LinkState::DOWN
        }
    }

    /// Only what arrives here counts.
    fn present(&self, station: u16) -> bool {
        station == self.me
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_say_who_hears_whom() {
        let stations: Vec<u16> = (1..=9).map(|i| i * 7).collect();
        let up = |tx: u16, rx: u16| (tx + 2 * rx).is_multiple_of(3);
        let hearing = Hearing::of(stations.clone(), up);
        for tx in &stations {
            for rx in &stations {
                assert_eq!(
                    hearing.is_up(*tx, *rx),
                    tx != rx && up(*tx, *rx),
                    "{tx} {rx}"
                );
            }
        }
        assert!(
            !hearing.is_up(7, 8) && !hearing.is_up(8, 7),
            "unknown stations"
        );
        let cut_short = Hearing {
            up: Vec::new(),
            ..hearing
        };
        assert!(
            !cut_short.is_up(14, 7),
            "a table that is too short is no panic"
        );
    }
}
