//! Heights of flights that come near to each other: a layer for all that stay apart
//! (D2.7 §3.6).
//!
//! Leaves the colouring to [`layers`] of the planning library.

use super::fleet::Member;
use anyhow::{Result, ensure};
use clap::Args;
use skein_geometry::frame::Point;
use skein_survey::fleet::layers::layers;

/// Height between two layers unless said otherwise, metres: twice what a barometer errs.
const LAYER_STEP_M: f64 = 20.0;

/// How flights are kept apart.
#[derive(Clone, Copy, Debug, Args)]
pub struct LayerArgs {
    /// Distance below which two flights get different heights, metres; by default twice
    /// the widest turn or twice the clearance, whichever is more. Within two such
    /// distances of a common start it does not count; 0 leaves all at one height.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub separation_m: Option<f64>,
    /// Height between two layers, metres; 0 leaves all at one height.
    #[arg(
        long,
        default_value_t = LAYER_STEP_M,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub layer_step_m: f64,
}

impl Default for LayerArgs {
    fn default() -> Self {
        Self {
            separation_m: None,
            layer_step_m: LAYER_STEP_M,
        }
    }
}

impl LayerArgs {
    /// All at one height.
    pub const FLAT: Self = Self {
        separation_m: None,
        layer_step_m: 0.0,
    };

    /// Refuses what is no distance.
    ///
    /// # Errors
    /// Names the flag.
    pub fn check(&self) -> Result<()> {
        let all = [
            ("--separation-m", self.separation_m.unwrap_or_default()),
            ("--layer-step-m", self.layer_step_m),
        ];
        for (flag, x) in all {
            ensure!(
                x.is_finite() && x >= 0.0,
                "{flag} must be 0 or more, found {x}"
            );
        }
        Ok(())
    }

    /// The separation, metres.
    #[must_use]
    pub fn separation_m(&self, team: &[Member], turn_radius_m: f64, clearance_m: f64) -> f64 {
        let turns = team
            .iter()
            .map(|m| m.turn_radius_m.unwrap_or(turn_radius_m));
        let widest_m = turns.fold(clearance_m, f64::max);
        self.separation_m.unwrap_or(2.0 * widest_m)
    }

    /// By UAV: its height above home, metres; `lowest_m` for the lowest layer.
    #[must_use]
    pub fn heights_m(&self, tracks: &[Vec<Point>], separation_m: f64, lowest_m: f64) -> Vec<f64> {
        if self.layer_step_m <= 0.0 {
            return vec![lowest_m; tracks.len()];
        }
        let layers = layers(tracks, separation_m);
        let height = |layer: &usize| lowest_m + self.layer_step_m * *layer as f64;
        layers.iter().map(height).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flights_that_cross_have_heights_of_their_own() {
        let args = LayerArgs {
            separation_m: None,
            layer_step_m: 25.0,
        };
        args.check().unwrap();
        let mut team = vec![Member::plain(0, 15.0, None); 2];
        assert!((args.separation_m(&team, 30.0, 10.0) - 60.0).abs() < 1e-9);
        assert!((args.separation_m(&team, 30.0, 40.0) - 80.0).abs() < 1e-9);
        team[1].turn_radius_m = Some(50.0);
        assert!((args.separation_m(&team, 30.0, 10.0) - 100.0).abs() < 1e-9);
        let track =
            |from: (f64, f64), to: (f64, f64)| [from, to].map(|(x, y)| Point::new(x, y)).to_vec();
        let tracks = [
            track((0.0, -500.0), (0.0, 500.0)),
            track((-500.0, 0.0), (500.0, 0.0)),
            track((0.0, 900.0), (500.0, 900.0)),
        ];
        let close = |heights: &[f64], expected: [f64; 3]| {
            let near = |(a, b): (&f64, f64)| (a - b).abs() < 1e-9;
            assert!(heights.iter().zip(expected).all(near), "{heights:?}");
        };
        close(&args.heights_m(&tracks, 60.0, 100.0), [100.0, 125.0, 100.0]);
        let flat = LayerArgs {
            layer_step_m: 0.0,
            ..args
        };
        close(&flat.heights_m(&tracks, 60.0, 100.0), [100.0; 3]);
        for (separation_m, layer_step_m) in [(Some(-1.0), 20.0), (None, f64::NAN)] {
            let wrong = LayerArgs {
                separation_m,
                layer_step_m,
            };
            assert!(wrong.check().is_err());
        }
    }
}
