//! What a UAV tells of how streets of its mission are used: type, bytes and limits of the kind
//! `usage` (docs/protocol.md §12, D2.7 §3.1).
//!
//! Registers of one author in one of its lives, made of its own pictures alone, as counts are
//! ([`super::count`]): numbers that grow, so the newest says all that the older ones said, and
//! registers of all authors and lives are added. Each is of sixteen stretches in one interval of
//! the day, or of 32 turns; what is nothing is left out.
//!
//! | subject | what it is of |
//! |---|---|
//! | 6 i + b | stretches 16 b .. 16 b + 16 in the interval i |
//! | 48 + b | turns 32 b .. 32 b + 32, all the time |

use super::cbor::{Listed, array_of};
use super::codec::WireError;
use super::limits::{at_most, in_range};
use super::schema::{Place, Shape, U16, U32, at};
use serde::{Deserialize, Serialize};

/// Most stretches of a mission: six registers an interval.
pub const STRETCHES_MAX: u16 = 96;

/// Most intervals of the day; the last one has no end.
pub const INTERVALS_MAX: u16 = 8;

/// Most turns at all crossings of a mission.
pub const TURNS_MAX: u16 = 512;

/// Stretches of a register.
pub const STRETCHES_EACH: u16 = 16;

/// Turns of a register.
pub const TURNS_EACH: u16 = 32;

/// Registers of an interval.
const BLOCKS: u16 = STRETCHES_MAX / STRETCHES_EACH;

/// The first register of turns.
const TURNS_FROM: u16 = BLOCKS * INTERVALS_MAX;

/// Registers of an author.
pub const USAGES_MAX: u16 = TURNS_FROM + TURNS_MAX / TURNS_EACH;

/// The largest of the numbers that grow.
pub const MOST: u32 = 1 << 30;

/// What was seen of one stretch in one interval.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct StretchUse {
    /// Which stretch.
    pub stretch: u16,
    /// How much of it was watched for how long, metres times seconds.
    pub watched_m_s: u32,
    /// How long vehicles were there meanwhile, all together, 100 ms.
    pub spent_ds: u32,
    /// And stood, 100 ms.
    pub stood_ds: u32,
    /// How far they drove there, all together, metres.
    pub driven_m: u32,
    /// How often one came into view there.
    pub vehicles: u16,
}

/// How many took a turn.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct TurnUse {
    /// Which turn.
    pub turn: u16,
    /// How many took it.
    pub vehicles: u16,
}

/// What was seen of some stretches, or at some turns, by one author in one life.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Usage {
    /// Of which streets of which sortie: `Mission::streets_hash`.
    pub streets: u32,
    /// Stretches, ascending.
    pub stretches: Vec<StretchUse>,
    /// Turns, ascending; none where there are stretches.
    pub turns: Vec<TurnUse>,
}

array_of!(StretchUse {
    stretch,
    watched_m_s,
    spent_ds,
    stood_ds,
    driven_m,
    vehicles
});
array_of!(TurnUse { turn, vehicles });
array_of!(Usage {
    streets,
    stretches,
    turns
});

impl Listed for StretchUse {
    const MAX: usize = STRETCHES_EACH as usize;
}

impl Listed for TurnUse {
    const MAX: usize = TURNS_EACH as usize;
}

/// The subject of the register of a stretch in an interval.
#[must_use]
pub fn subject_of_stretch(interval: u16, stretch: u16) -> u16 {
    BLOCKS * interval.min(INTERVALS_MAX - 1) + (stretch / STRETCHES_EACH).min(BLOCKS - 1)
}

/// The subject of the register of a turn.
#[must_use]
pub fn subject_of_turn(turn: u16) -> u16 {
    TURNS_FROM + turn.min(TURNS_MAX - 1) / TURNS_EACH
}

/// The interval that a register is of; none of turns.
#[must_use]
pub fn interval_of(subject: u16) -> Option<u16> {
    (subject < TURNS_FROM).then_some(subject / BLOCKS)
}

impl Usage {
    /// How much it says: registers grow, so the one that says more is the newer one.
    #[must_use]
    pub fn amount(&self) -> u64 {
        let watched = self.stretches.iter().map(|s| u64::from(s.watched_m_s));
        let turned = self.turns.iter().map(|t| u64::from(t.vehicles));
        watched.chain(turned).sum()
    }
}

/// The first field that is out of range.
pub(super) fn check(u: &Usage) -> Result<(), WireError> {
    at_most("stretches", u.stretches.len(), usize::from(STRETCHES_EACH))?;
    at_most("turns", u.turns.len(), usize::from(TURNS_EACH))?;
    let all = |holds: fn(&StretchUse) -> bool| u.stretches.iter().all(holds);
    in_range("stretch", all(|s| s.stretch < STRETCHES_MAX))?;
    let ascends = u.stretches.windows(2).all(|w| w[0].stretch < w[1].stretch);
    in_range("stretches", ascends)?;
    in_range("watched_m_s", all(|s| s.watched_m_s <= MOST))?;
    in_range("spent_ds", all(|s| s.spent_ds <= MOST))?;
    in_range("stood_ds", all(|s| s.stood_ds <= s.spent_ds))?;
    in_range("driven_m", all(|s| s.driven_m <= MOST))?;
    in_range("turn", u.turns.iter().all(|t| t.turn < TURNS_MAX))?;
    let ascends = u.turns.windows(2).all(|w| w[0].turn < w[1].turn);
    in_range(
        "turns",
        ascends && (u.turns.is_empty() || u.stretches.is_empty()),
    )
}

const NUMBER: Shape = Shape::Number(0, MOST as i128);

const STRETCH_USE: &[Place] = &[
    at(
        "stretch",
        "which stretch",
        Shape::Number(0, STRETCHES_MAX as i128 - 1),
    ),
    at(
        "watched_m_s",
        "how much of it was watched for how long, m s",
        NUMBER,
    ),
    at(
        "spent_ds",
        "how long vehicles were there meanwhile, all together, 100 ms",
        NUMBER,
    ),
    at("stood_ds", "and stood, 100 ms", NUMBER),
    at(
        "driven_m",
        "how far they drove there, all together, m",
        NUMBER,
    ),
    at("vehicles", "how often one came into view there", U16),
];

const TURN_USE: &[Place] = &[
    at(
        "turn",
        "which turn",
        Shape::Number(0, TURNS_MAX as i128 - 1),
    ),
    at("vehicles", "how many took it", U16),
];

/// The places of a usage's body.
pub(super) const USAGE: &[Place] = &[
    at("streets", "of which streets of which sortie: a hash", U32),
    at(
        "stretches",
        "what was seen of stretches, ascending",
        Shape::Rows(STRETCH_USE, STRETCHES_EACH as usize),
    ),
    at(
        "turns",
        "how many took turns, ascending; none where there are stretches",
        Shape::Rows(TURN_USE, TURNS_EACH as usize),
    ),
];

#[cfg(test)]
pub(crate) mod samples {
    use super::super::codec::Body;
    use super::*;

    /// Two stretches, typically.
    pub(crate) fn usage() -> Usage {
        let stretch = |stretch, spent_ds, driven_m, vehicles| StretchUse {
            stretch,
            watched_m_s: 1_830,
            spent_ds,
            stood_ds: 0,
            driven_m,
            vehicles,
        };
        Usage {
            streets: 0x1234_5678,
            stretches: vec![stretch(17, 214, 163, 4), stretch(19, 0, 0, 0)],
            turns: Vec::new(),
        }
    }

    /// The largest valid ones.
    pub(crate) fn largest() -> Vec<Body> {
        let stretch = |stretch| StretchUse {
            stretch,
            watched_m_s: MOST,
            spent_ds: MOST,
            stood_ds: MOST,
            driven_m: MOST,
            vehicles: u16::MAX,
        };
        let turn = |turn| TurnUse {
            turn,
            vehicles: u16::MAX,
        };
        let last = STRETCHES_MAX - STRETCHES_EACH;
        let last_turn = TURNS_MAX - TURNS_EACH;
        vec![
            Body::Usage(Usage {
                streets: u32::MAX,
                stretches: (last..STRETCHES_MAX).map(stretch).collect(),
                turns: Vec::new(),
            }),
            Body::Usage(Usage {
                streets: u32::MAX,
                stretches: Vec::new(),
                turns: (last_turn..TURNS_MAX).map(turn).collect(),
            }),
        ]
    }
}
