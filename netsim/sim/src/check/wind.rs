//! What UAVs take the wind for, where they estimate it, beside the wind that blows (`wind`).

use super::{Findings, PeerSnapshot, Snapshot};
use crate::weather::Weather;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// An estimate is known to be right so long after the wind changed, or after its UAV flies,
/// milliseconds.
const KNOWN_MS: u64 = 15_000;

/// It is wrong by no more than this, m/s: an airspeed that is wrong by a twentieth cannot be told
/// from a wind on one course, and the wind that is told follows the estimate in steps.
const WRONG_MPS: f64 = 1.2;

/// How wrong the winds were by which UAVs flew, from [`KNOWN_MS`] after a change on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WindErrors {
    /// Root of the mean square, m/s.
    pub rms_mps: f64,
    /// The largest, m/s.
    pub max_mps: f64,
    /// How many looks it is over.
    pub looks: u64,
}

/// What the estimates of one run were found to be.
#[derive(Clone, Debug)]
pub struct WindCheck {
    weather: Weather,
    /// Since when each UAV has flown, and whether its estimate was told to be wrong.
    flies: BTreeMap<u16, (u64, bool)>,
    squares: f64,
    errors: WindErrors,
}

impl WindCheck {
    /// The check of a run in this wind.
    #[must_use]
    pub fn new(weather: &Weather) -> Self {
        Self {
            weather: weather.clone(),
            flies: BTreeMap::new(),
            squares: 0.0,
            errors: WindErrors::default(),
        }
    }

    /// How wrong the estimates were; `None` where nobody estimates.
    #[must_use]
    pub fn errors(&self) -> Option<WindErrors> {
        self.weather.estimated.map(|_| self.errors)
    }

    /// A process ends or stands still.
    pub fn on_silent(&mut self, id: u16) {
        self.flies.remove(&id);
    }

    /// Looks at what everybody takes the wind for.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        if self.weather.estimated.is_none() {
            return;
        }
        for m in snapshot.peers.iter().filter(|m| m.uav) {
            self.look_at(snapshot, m, found);
        }
    }

    fn look_at(&mut self, snapshot: &Snapshot<'_>, m: &PeerSnapshot, found: &mut Findings) {
        let now_ms = snapshot.now_ms;
        let Some((east_mps, north_mps)) = m.view.wind_mps.filter(|_| m.at.is_some()) else {
            self.flies.remove(&m.id);
            return;
        };
        let (flies_ms, told) = self.flies.entry(m.id).or_insert((now_ms, false));
        let since_ms = self.weather.since_ms(now_ms).max(*flies_ms);
        let known_ms = since_ms + KNOWN_MS + snapshot.late_ms(m.id, since_ms);
        if now_ms < known_ms {
            *told = false;
            return;
        }
        let wind = self.weather.at(now_ms);
        let off_mps = (wind.east_mps - east_mps).hypot(wind.north_mps - north_mps);
        self.squares += off_mps * off_mps;
        self.errors.looks += 1;
        self.errors.rms_mps = (self.squares / self.errors.looks as f64).sqrt();
        self.errors.max_mps = self.errors.max_mps.max(off_mps);
        if off_mps > WRONG_MPS && !*told {
            *told = true;
            found.broken("wind", now_ms, Some(m.id), || {
                format!(
                    "takes the wind for ({east_mps:.1}, {north_mps:.1}) m/s, which is ({:.1}, {:.1})",
                    wind.east_mps, wind.north_mps
                )
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use crate::weather::{AirspeedErrors, Change};
    use skein_flight::trajectory::wind::Wind;
    use skein_geometry::frame::Point;
    use skein_peer::Beliefs;

    #[test]
    fn a_wind_that_is_held_for_another_is_told_once_it_could_be_known() {
        let weather = Weather {
            first: Wind::CALM,
            changes: vec![Change {
                at_ms: 60_000,
                wind: Wind::new(6.0, 0.0),
            }],
            estimated: Some(AirspeedErrors {
                scale: 0.03,
                noise_mps: 0.3,
            }),
        };
        let broken = |sees_it: bool| {
            let (mut check, mut found) = (WindCheck::new(&weather), Findings::new(1));
            let mut story = Story::new(0);
            story.place(1, Point::new(0.0, 0.0));
            for t in 0..120 {
                let east_mps = if t >= 64 && sees_it { 5.6 } else { 0.1 };
                let view = Beliefs {
                    wind_mps: Some((east_mps, 0.0)),
                    ..speaking()
                };
                story.snapshot(1000 * t, &[(1, view)], |s| check.on_snapshot(s, &mut found));
            }
            let at_ms: Vec<u64> = found.violations.iter().map(|v| v.time_ms).collect();
            (at_ms, check.errors().unwrap())
        };
        let (at_ms, errors) = broken(true);
        assert!(at_ms.is_empty(), "{at_ms:?}");
        assert!(
            (errors.max_mps - 0.4).abs() < 1e-9 && errors.rms_mps < 0.4,
            "{errors:?}"
        );
        assert_eq!(broken(false).0, [75_000]);
    }
}
