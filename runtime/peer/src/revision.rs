//! What the number of a mission's revision counts: the operator's changes, what was found on no
//! map, and the laps of a patrol (docs/protocol.md §5, §6).
//!
//! | the mission | bits 16 to 31 | bits 10 to 15 | bits 0 to 9 |
//! |---|---|---|---|
//! | is flown once | the operator's changes, from bit 0 on | | |
//! | is a patrol | the operator's changes | laps, from bit 0 on | |
//! | counts what is found | the operator's changes | what was found since | laps |

use crate::mission::Mission;

/// Where missions count what is found: obstacles are counted in the upper six bits of the low half
/// of the revision's number, laps in the lower ten.
pub(crate) const FOUND_SHIFT: u32 = 10;

/// Laps of a patrol that counts what is found, at most.
pub const FOUND_LAPS_MAX: u16 = 1_000;

impl Mission {
    /// How often an operator changed a patrol; 0 for what is flown once.
    pub(crate) fn edit(&self) -> u16 {
        let high = u16::try_from(self.revision >> 16).unwrap_or(u16::MAX);
        if self.is_patrol() { high } else { 0 }
    }

    /// Which bits of the number of a revision count laps.
    fn laps_mask(&self) -> u32 {
        if self.finds_obstacles {
            (1 << FOUND_SHIFT) - 1
        } else {
            u32::from(u16::MAX)
        }
    }

    /// How many more obstacles the number of the revision has room for; none where it counts none.
    pub(crate) fn room_for_found(&self) -> Option<u32> {
        let low = self.revision & u32::from(u16::MAX);
        let room = (u32::from(u16::MAX) - low) >> FOUND_SHIFT;
        self.finds_obstacles.then_some(room)
    }

    /// Whether a revision is this one or another lap of the same patrol, as far as its number
    /// tells.
    #[must_use]
    pub fn has_lap_of(&self, revision: u32) -> bool {
        let counted = self.revision & !self.laps_mask();
        let first = if self.is_patrol() && counted > 0 {
            counted
        } else {
            self.revision.saturating_sub(u32::from(self.lap))
        };
        let last = self.revision.saturating_add(u32::from(self.further_laps));
        (first..=last).contains(&revision)
    }

    /// The mission of the next lap, the same for whoever derives it; none after
    /// the last.
    #[must_use]
    pub fn next_lap(&self) -> Option<Self> {
        self.later_lap(self.revision.checked_add(1)?)
    }

    /// The mission of a later lap, by its revision; none where no lap of this mission has it.
    #[must_use]
    pub fn later_lap(&self, revision: u32) -> Option<Self> {
        let laps = revision.checked_sub(self.revision).filter(|n| *n > 0)?;
        if self.finds_obstacles && (revision ^ self.revision) > self.laps_mask() {
            return None;
        }
        let laps = u16::try_from(laps).ok()?;
        Some(Self {
            revision,
            lap: self.lap.checked_add(laps)?,
            further_laps: self.further_laps.checked_sub(laps)?,
            ..self.clone()
        })
    }

    /// The revision that the operator counts after the newest one, while this mission is held.
    /// Laps count revisions, too, and so does what is found, also where nobody hears the operator:
    /// where there are any the low half of the number is theirs, and the operator counts the high
    /// half.
    #[must_use]
    pub fn revision_after(&self, newest: u32) -> u32 {
        let others = if self.is_patrol() || self.finds_obstacles {
            u32::from(u16::MAX)
        } else {
            0
        };
        (newest | others).saturating_add(1)
    }
}
