//! What becomes of one transmission at one receiver.

use serde::{Deserialize, Serialize};
pub use skein_geometry::random::mix;

/// The state of the radio link from one transmitter to one receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkState {
    /// Whether the receiver is within radio range.
    pub in_range: bool,
    /// Whether terrain and buildings leave the line of sight free.
    pub in_sight: bool,
    /// Whether a fault cuts the link.
    pub cut: bool,
    /// Share of transmissions lost, in thousandths.
    pub loss_permille: u16,
    /// Time from the end of a transmission to its reception, milliseconds.
    pub delay_ms: u16,
}

impl LinkState {
    /// Nothing gets through.
    pub const DOWN: Self = Self {
        in_range: false,
        in_sight: false,
        cut: false,
        loss_permille: 0,
        delay_ms: 0,
    };

    /// Whether anything can get through at all.
    #[must_use]
    pub fn is_up(&self) -> bool {
        self.in_range && self.in_sight && !self.cut
    }
}

/// Why a transmission did not arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Reason {
    /// Out of range.
    Range,
    /// Line of sight blocked.
    Sight,
    /// A fault cuts the link.
    Cut,
    /// Lost by chance.
    Loss,
    /// Too old before the channel was free.
    QueueAge,
    /// Two transmissions met at the receiver.
    Collision,
}

/// What becomes of a transmission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It arrives after the link's delay.
    Delivered {
        /// Milliseconds after its end.
        delay_ms: u16,
    },
    /// It is lost.
    Lost(Reason),
}

/// Decides the fate of transmission `number` of `tx` at `rx`.
///
/// Stable: a draw depends on nothing but its arguments, so that adding a peer or a
/// message elsewhere changes no other fate.
#[must_use]
pub fn fate(seed: u64, tx: u16, rx: u16, number: u64, link: &LinkState) -> Fate {
    if link.cut {
        return Fate::Lost(Reason::Cut);
    }
    if !link.in_range {
        return Fate::Lost(Reason::Range);
    }
    if !link.in_sight {
        return Fate::Lost(Reason::Sight);
    }
    let ends = (u64::from(tx) << 32) | u64::from(rx);
    let draw = mix(mix(mix(seed) ^ ends) ^ number) % 1000;
    if draw < u64::from(link.loss_permille) {
        return Fate::Lost(Reason::Loss);
    }
    Fate::Delivered {
        delay_ms: link.delay_ms,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: LinkState = LinkState {
        in_range: true,
        in_sight: true,
        cut: false,
        loss_permille: 300,
        delay_ms: 2,
    };

    #[test]
    fn loss_is_as_frequent_as_stated() {
        let lost = (0..100_000u64)
            .filter(|n| fate(7, 1, 2, *n, &UP) == Fate::Lost(Reason::Loss))
            .count();
        assert!((29_000..31_000).contains(&lost), "{lost}");
    }

    #[test]
    fn a_blocked_link_says_why() {
        let cut = LinkState { cut: true, ..UP };
        let far = LinkState {
            in_range: false,
            ..UP
        };
        let hidden = LinkState {
            in_sight: false,
            ..UP
        };
        assert_eq!(fate(1, 1, 2, 3, &cut), Fate::Lost(Reason::Cut));
        assert_eq!(fate(1, 1, 2, 3, &far), Fate::Lost(Reason::Range));
        assert_eq!(fate(1, 1, 2, 3, &hidden), Fate::Lost(Reason::Sight));
    }
}
