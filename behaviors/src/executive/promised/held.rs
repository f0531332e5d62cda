//! Goes on with what was promised where something else has changed (D2.7 §1.3): others hold it
//! against all that they fly, whatever becomes of the mission or of the computer.
//!
//! | what happens | what is flown |
//! |---|---|
//! | its computer stood still, and the airframe flew on as was promised | what is left of that |
//! | the same, before the first percept | nothing; it is foretold from where it is by now |
//! | the same, and the airframe is elsewhere | a circle from here, imposed |
//! | a computer begins anew in an airframe that is on its promised way | nothing: it goes on by itself |
//! | a computer begins anew in an airframe that flies the promised circle | that circle, imposed |
//! | another loop or other zones | what is in force; everything after what cannot be changed any more is asked for anew |
//! | another airspeed by the new mission | a circle from here, imposed |

use super::super::transit::Place;
use super::super::{Executive, Kind, Stretch, WINDOW_M};
use super::Contingency;
use crate::percept::Percept;
use crate::reactive::follow::{HORIZON_S, Offset};

/// Airspeeds that differ by less are the same, m/s: rounding.
const SAME_MPS: f64 = 1e-6;

/// Who had no percept for so long stood still, milliseconds.
const STILL_MS: u64 = 2_000;

impl Executive {
    /// Whether it is so far from where it was to be that it does not follow any more.
    pub(super) fn is_off(&self, offset: Option<Offset>, at_ms: u64) -> bool {
        let late_m = self.scheduled_m(at_ms) - self.track.at_m();
        self.is_lost(offset) || late_m.abs() > super::super::LOST_M
    }

    /// Takes up what was promised where it is by now, if the UAV is there; else the track is of
    /// no use any more.
    pub(super) fn goes_on(&mut self, percept: &Percept) -> Option<Offset> {
        self.contingency.as_ref()?.schedule?;
        let here_m = self.scheduled_m(percept.time_ms);
        let ahead_m = self.transit.airframe.max_mps * HORIZON_S;
        while self.track.end_m() < here_m + ahead_m {
            let end = self.stretches.back()?.end;
            self.push_circle(end);
        }
        self.track.skip_to(here_m);
        let offset = self.track.advance(&percept.pose, WINDOW_M);
        offset.filter(|_| !self.is_off(offset, percept.time_ms))
    }

    /// This executive as it would be had it not stood still since its last percept: where its
    /// airframe has flown as was promised by now, milliseconds. `None` if it has not stood still.
    #[must_use]
    pub fn flown_on(&self, at_ms: u64) -> Option<Self> {
        let last = self.played.as_ref()?.percept;
        if self.contingency.is_none() || at_ms < last.time_ms + STILL_MS {
            return None;
        }
        let mut on = self.clone();
        let pose = self.on_track(self.scheduled_m(at_ms))?;
        let here = Percept {
            time_ms: at_ms,
            pose,
            ..last
        };
        let _ = on.goes_on(&here)?;
        while on
            .stretches
            .front()
            .is_some_and(|s| s.end_m <= on.track.at_m())
        {
            on.stretches.pop_front();
        }
        on.played.as_mut()?.percept = here;
        Some(on)
    }

    /// Goes on with what was promised in the mission before, on other cells or between other
    /// zones. Returns whether it can: it has to fly as fast.
    pub fn take_over(&mut self, before: &Self) -> bool {
        let promised = before.contingency.as_ref();
        let Some(c) = promised.filter(|c| c.schedule.is_some()) else {
            return false;
        };
        let differs_mps = (self.speed_mps() - before.speed_mps()).abs();
        if self.contingency.is_none() || differs_mps > SAME_MPS {
            return false;
        }
        self.track = before.track.clone();
        let anywhere = |s: &Stretch| Stretch {
            kind: match s.kind {
                Kind::Loiter(circle) => Kind::Loiter(circle),
                _ => Kind::Route,
            },
            end: Place {
                boundary: None,
                ..s.end
            },
            ..*s
        };
        self.stretches = before.stretches.iter().map(anywhere).collect();
        self.contingency = Some(Contingency {
            schedule: c.schedule,
            bend_per_m: c.bend_per_m,
            wanted_m: self.track.at_m(),
            goals: c.goals + 1,
            ..Contingency::new()
        });
        self.played.clone_from(&before.played);
        self.replan = false;
        true
    }
}
