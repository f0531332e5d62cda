//! How far the middle of each picture lies from where the plan has it, while something is to be
//! seen (`footprint`; D2.7 §1.2.1).
//!
//! A gimbal holds the planned footprint against bank, pitch and an error of the path. The rule
//! looks at the means of many looks: a turn begins faster than a gimbal follows, and a gust ends
//! the best of plans.

use super::Findings;
use crate::world::camera::Picture;
use serde::{Deserialize, Serialize};
use skein_peer::footprint::{Footprint, Passes};
use std::collections::BTreeMap;

/// Errors are told apart by this, metres.
const BIN_M: f64 = 0.1;

/// And up to this; larger ones count as this, metres.
const MOST_M: f64 = 200.0;

/// The mean of the errors of a UAV with a gimbal is no larger over so many looks, metres: half a
/// degree of what it is told wrongly of itself from 100 m, and a metre of lag.
const HELD_M: f64 = 3.0;
const LOOKS: u32 = 100;

/// From higher up the same angle is more, metres for a metre of height.
const HELD_M_PER_M: f64 = 0.02;
const LEVEL_M: f64 = 100.0;

/// How far pictures were from where they were planned, in one run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FootprintErrors {
    /// The mean, metres.
    pub mean_m: f64,
    /// What 99 of 100 looks do not exceed, metres.
    pub p99_m: f64,
    /// The largest, metres.
    pub max_m: f64,
    /// How many looks it is over.
    pub looks: u64,
    /// Cells that UAVs saw.
    pub seen: u32,
    /// Cells that were flown for the first time, and not seen then.
    pub missed: u32,
}

/// What pictures of one run were found to be.
#[derive(Clone, Debug, Default)]
pub struct FootprintCheck {
    bins: Vec<u32>,
    sum_m: f64,
    errors: FootprintErrors,
    /// By UAV: what its passes were at the last look.
    passes: BTreeMap<u16, Passes>,
    /// The sum of the errors of each over the last looks, and how many those are.
    held: BTreeMap<u16, (f64, u32)>,
}

impl FootprintCheck {
    /// A UAV looked from this height; `is_held` says whether a gimbal holds its picture.
    pub fn on_look(
        &mut self,
        (now_ms, uav): (u64, u16),
        footprint: Footprint,
        (picture, height_m): (&Picture, f64),
        is_held: bool,
        found: &mut Findings,
    ) {
        let is = footprint.passes;
        let was = self.passes.insert(uav, is).unwrap_or_default();
        // A mission that began anew counts from nothing.
        let was = if is.seen < was.seen || is.missed < was.missed {
            Passes::default()
        } else {
            was
        };
        self.errors.seen += is.seen - was.seen;
        self.errors.missed += is.missed - was.missed;
        let Some(planned) = footprint.planned else {
            return;
        };
        let off_m = (picture.place(0.0, 0.0) - planned).norm().min(MOST_M);
        self.note(off_m);
        if !is_held {
            return;
        }
        let (sum_m, looks) = self.held.entry(uav).or_default();
        *sum_m += off_m;
        *looks += 1;
        if *looks < LOOKS {
            return;
        }
        let mean_m = *sum_m / f64::from(*looks);
        (*sum_m, *looks) = (0.0, 0);
        let higher_m = (height_m - LEVEL_M).max(0.0);
        if mean_m > HELD_M + HELD_M_PER_M * higher_m {
            found.broken("footprint", now_ms, Some(uav), || {
                format!("its pictures are {mean_m:.1} m from where they are planned, on the mean of {LOOKS}")
            });
        }
    }

    fn note(&mut self, off_m: f64) {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most MOST_M / BIN_M"
        )]
        let bin = (off_m / BIN_M) as usize;
        if self.bins.len() <= bin {
            self.bins.resize(bin + 1, 0);
        }
        self.bins[bin] += 1;
        self.sum_m += off_m;
        self.errors.looks += 1;
        self.errors.max_m = self.errors.max_m.max(off_m);
    }

    /// What it came to so far.
    #[must_use]
    #[allow(clippy::cast_precision_loss, reason = "looks of one run")]
    pub fn errors(&self) -> FootprintErrors {
        let looks = self.errors.looks.max(1) as f64;
        let mut below = 0.0;
        let p99 = self.bins.iter().position(|n| {
            below += f64::from(*n);
            below >= 0.99 * looks
        });
        FootprintErrors {
            mean_m: self.sum_m / looks,
            p99_m: p99.map_or(0.0, |bin| (bin + 1) as f64 * BIN_M),
            ..self.errors
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::frame::{Point, Pose};

    #[test]
    fn a_picture_that_is_not_held_is_told_once_its_mean_is_known() {
        let broken = |off_m: f64, from_m: f64, is_held: bool| {
            let (mut check, mut found) = (FootprintCheck::default(), Findings::new(1));
            for look in 0..150_u32 {
                let at = Point::new(f64::from(look), 0.0);
                let picture = Picture::level(Pose::new(at, 0.0), (40.0, 30.0));
                let footprint = Footprint {
                    planned: Some(Point::new(at.x, off_m)),
                    passes: Passes {
                        seen: look / 10,
                        missed: look / 50,
                    },
                };
                let when = (200 * u64::from(look), 1);
                check.on_look(when, footprint, (&picture, from_m), is_held, &mut found);
            }
            let at_ms: Vec<u64> = found.violations.iter().map(|v| v.time_ms).collect();
            (at_ms, check.errors())
        };
        let (at_ms, errors) = broken(3.5, 100.0, true);
        assert_eq!(at_ms, [99 * 200]);
        assert_eq!((errors.seen, errors.missed, errors.looks), (14, 2, 150));
        assert!((errors.mean_m - 3.5).abs() < 1e-9 && (errors.p99_m - 3.6).abs() < 0.11);
        assert!(broken(2.5, 60.0, true).0.is_empty() && broken(9.0, 100.0, false).0.is_empty());
        assert!(broken(4.9, 200.0, true).0.is_empty() && broken(5.1, 200.0, true).0.len() == 1);
    }
}
