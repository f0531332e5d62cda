//! Heights of flights that come near to each other: a layer for all that stay apart
//! (D2.7 §3.6).
//!
//! Leaves the colouring to [`crate::fleet::layers`].

use crate::fleet::layers::layers;
use crate::team::Uav;
use skein_geometry::frame::Point;
use thiserror::Error;

/// Height between two layers unless said otherwise, metres: twice what a barometer errs.
pub const LAYER_STEP_M: f64 = 20.0;

/// Heights nearer to each other than this are one layer, metres.
const SAME_HEIGHT_M: f64 = 1e-6;

/// The most above home that a flight is planned at unless said otherwise, metres: what the
/// open category allows in Europe.
pub const MOST_HEIGHT_M: f64 = 120.0;

/// How flights are kept apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Separation {
    /// Distance below which two flights get different heights, metres; `None` for twice
    /// the widest turn or twice the clearance, whichever is more. Within two such
    /// distances of a common start it does not count; 0 leaves all at one height.
    pub distance_m: Option<f64>,
    /// Height between two layers, metres; 0 leaves all at one height.
    pub layer_step_m: f64,
}

/// A separation is no distance. Nothing was planned.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum NoSeparation {
    /// `distance_m`.
    #[error("the separation must be 0 or more, found {0}")]
    Distance(f64),
    /// `layer_step_m`.
    #[error("the step between layers must be 0 or more, found {0}")]
    LayerStep(f64),
}

/// A flight is higher than it may be. Nothing of the plan is to be flown.
#[derive(Clone, Debug, PartialEq, Error)]
#[error(
    "{name} would fly at {height_m} m, above the {most_m} m that are allowed: flights that come near to each other need {layers} layers from {lowest_m} m up, and layers of at most {} m fit",
    self.fitting_step_m()
)]
pub struct TooHigh {
    /// What the UAV that flies highest is called.
    pub name: String,
    /// Its height above home, metres.
    pub height_m: f64,
    /// The most that is allowed, metres.
    pub most_m: f64,
    /// The height of the lowest flight, metres.
    pub lowest_m: f64,
    /// How many heights there are.
    pub layers: usize,
}

impl TooHigh {
    /// The height between two layers with which all of them would fit, whole metres; 0
    /// where none would.
    #[must_use]
    pub fn fitting_step_m(&self) -> f64 {
        let steps = self.layers.saturating_sub(1).max(1) as f64;
        ((self.most_m - self.lowest_m) / steps).floor().max(0.0)
    }
}

/// Refuses flights, each with its name and its height, of which one is too high.
///
/// # Errors
/// [`TooHigh`] names the highest.
pub fn check_heights(flights: &[(&str, f64)], most_m: f64) -> Result<(), TooHigh> {
    let highest = flights.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let Some(&(name, height_m)) = highest.filter(|f| f.1 > most_m) else {
        return Ok(());
    };
    let mut heights: Vec<f64> = flights.iter().map(|f| f.1).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|a, b| (*a - *b).abs() < SAME_HEIGHT_M);
    Err(TooHigh {
        name: name.to_owned(),
        height_m,
        most_m,
        lowest_m: heights.first().copied().unwrap_or(height_m),
        layers: heights.len(),
    })
}

impl Separation {
    /// What turns and clearance ask for, in layers of [`LAYER_STEP_M`].
    pub const BY_TURNS: Self = Self {
        distance_m: None,
        layer_step_m: LAYER_STEP_M,
    };

    /// All at one height.
    pub const FLAT: Self = Self {
        distance_m: None,
        layer_step_m: 0.0,
    };

    pub(crate) fn check(&self) -> Result<(), NoSeparation> {
        let distance = |x: f64| x.is_finite() && x >= 0.0;
        match self.distance_m {
            Some(x) if !distance(x) => return Err(NoSeparation::Distance(x)),
            _ => {}
        }
        if !distance(self.layer_step_m) {
            return Err(NoSeparation::LayerStep(self.layer_step_m));
        }
        Ok(())
    }

    fn distance_m(&self, team: &[Uav], clearance_m: f64) -> f64 {
        let turns = team.iter().map(|u| u.turn_radius_m);
        let widest_m = turns.fold(clearance_m, f64::max);
        self.distance_m.unwrap_or(2.0 * widest_m)
    }

    /// By UAV: its height above home, metres; `lowest_m` for the lowest layer.
    pub(crate) fn heights_m(
        &self,
        team: &[Uav],
        clearance_m: f64,
        tracks: &[Vec<Point>],
        lowest_m: f64,
    ) -> Vec<f64> {
        if self.layer_step_m <= 0.0 {
            return vec![lowest_m; tracks.len()];
        }
        let layers = layers(tracks, self.distance_m(team, clearance_m));
        let height = |layer: &usize| lowest_m + self.layer_step_m * *layer as f64;
        layers.iter().map(height).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::team::Sensor;

    #[test]
    fn the_highest_flight_is_named_with_the_layers_below_it() {
        let flights = [("a", 60.0), ("b", 140.0), ("c", 100.0), ("d", 60.0)];
        assert_eq!(check_heights(&flights, 140.0), Ok(()));
        assert_eq!(check_heights(&[], 0.0), Ok(()));
        let error = check_heights(&flights, 120.0).unwrap_err();
        assert_eq!((error.name.as_str(), error.layers), ("b", 3));
        let error = error.to_string();
        let says = "b would fly at 140 m, above the 120 m that are allowed: flights that come near to each other need 3 layers from 60 m up, and layers of at most 30 m fit";
        assert_eq!(error, says);
    }

    #[test]
    fn flights_that_cross_have_heights_of_their_own() {
        let by_turns = Separation {
            distance_m: None,
            layer_step_m: 25.0,
        };
        by_turns.check().unwrap();
        let camera = Sensor::Swath { width_m: 50.0 };
        let mut team = vec![Uav::new("a", Point::origin(), 15.0, 30.0, camera); 3];
        assert!((by_turns.distance_m(&team, 10.0) - 60.0).abs() < 1e-9);
        assert!((by_turns.distance_m(&team, 40.0) - 80.0).abs() < 1e-9);
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
        let heights = by_turns.heights_m(&team, 10.0, &tracks, 100.0);
        close(&heights, [100.0, 125.0, 100.0]);
        let flat = Separation::FLAT.heights_m(&team, 10.0, &tracks, 100.0);
        close(&flat, [100.0; 3]);
        team[1].turn_radius_m = 50.0;
        assert!((by_turns.distance_m(&team, 10.0) - 100.0).abs() < 1e-9);
        for (distance_m, layer_step_m) in [(Some(-1.0), 20.0), (None, f64::NAN)] {
            let wrong = Separation {
                distance_m,
                layer_step_m,
            };
            assert!(wrong.check().is_err());
        }
    }
}
