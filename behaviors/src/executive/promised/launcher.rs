//! Takes off at one height with others: at a time and on a way that was agreed (D2.7 §1.3).
//!
//! Who stands on a launcher is in nobody's way and promises nothing. It asks for its first
//! flight as it would for any other, beginning on the ground at a time to come; once that is
//! agreed it tells its airframe the time.
//!
//! | state | percept | what the airframe is told |
//! |---|---|---|
//! | waits in line | not ready | nothing |
//! | stands | ready, with cells to see, or to be given some soon | that it wants to take off |
//! | stands | ready, with nothing to do, or no way is clear | that another may go before it |
//! | agreed | before its time | when it takes off |
//! | agreed | its time is past, it is on the ground still | as in the line: it asks anew |

use super::super::{Aim, Executive};
use super::Contingency;
use crate::percept::Percept;
use crate::setpoint::Launch;
use skein_geometry::frame::Pose;

impl Executive {
    /// Whether it stands ready to be launched and no flight from there is agreed.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.standing_at().is_some()
    }

    /// Says whether cells will be given to it soon. On a launcher it takes off before that, and
    /// waits near by: the place is clear for the next one sooner.
    pub fn expect_cells(&mut self, expects: bool) {
        self.expects_cells = expects;
    }

    /// Whether it stands, and wants to be off for whatever it will be given.
    pub(super) fn clears_launcher(&self) -> bool {
        self.expects_cells && self.aim == Aim::Hold && self.stands()
    }

    /// Where.
    pub(super) fn standing_at(&self) -> Option<Pose> {
        self.contingency.as_ref()?.stands
    }

    /// How soon it may take off, milliseconds from the last percept, if it stands.
    pub(super) fn launches_in_ms(&self) -> Option<u64> {
        self.standing_at()?;
        Some(u64::from(self.played.as_ref()?.percept.takes_off_in_ms))
    }

    /// Says whether nothing that it could fly from its launcher keeps clear of others.
    pub fn is_held_up(&mut self, held_up: bool) {
        if let Some(c) = &mut self.contingency {
            c.held_up = held_up;
        }
    }

    /// What its airframe is told on the ground, if it flies by promises and has a say in it.
    pub(in crate::executive) fn on_launcher(&mut self, percept: &Percept) -> Option<Launch> {
        let c = self.contingency.as_ref()?;
        let due_ms = c.schedule.map(|(_, at_ms)| at_ms);
        match due_ms.filter(|due_ms| *due_ms > percept.time_ms) {
            Some(due_ms) => Some(Launch::At(due_ms)),
            None if percept.launch_ready => Some(self.stand(percept)),
            None => {
                self.contingency = Some(Contingency {
                    goals: c.goals + 1,
                    ..Contingency::new()
                });
                None
            }
        }
    }

    /// Nothing is agreed, or it was not flown in time.
    fn stand(&mut self, percept: &Percept) -> Launch {
        if self.standing_at() != Some(percept.pose) {
            self.requeue();
            self.track.clear();
            let goals = self.contingency.as_ref().map_or(0, |c| c.goals + 1);
            self.contingency = Some(Contingency {
                stands: Some(percept.pose),
                goals,
                ..Contingency::new()
            });
        }
        self.replan = false;
        let held_up = self.contingency.as_ref().is_some_and(|c| c.held_up);
        if self.wants_more(percept.time_ms) && !held_up {
            Launch::Wish
        } else {
            Launch::Stay
        }
    }

    /// What was agreed begins on the ground, at this time in milliseconds.
    pub(super) fn leave_launcher(&mut self, at_ms: u64) {
        let begins_m = self.track.end_m();
        if let Some(c) = &mut self.contingency
            && c.stands.take().is_some()
        {
            c.schedule = Some((begins_m, at_ms));
        }
    }
}
