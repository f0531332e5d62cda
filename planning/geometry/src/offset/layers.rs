//! Zones between two altitudes, reduced to the plane at a flight level (D2.7 §2.3.1).

use super::Zone;

/// A no-fly zone from a floor to a ceiling.
#[derive(Clone, Debug, PartialEq)]
pub struct LayeredZone {
    /// Its outline.
    pub zone: Zone,
    /// Where it begins, metres above the mission's datum.
    pub floor_m: f64,
    /// Where it ends, metres above the mission's datum; infinite for no ceiling.
    pub ceiling_m: f64,
}

impl LayeredZone {
    /// A zone from the ground up.
    #[must_use]
    pub fn unlimited(zone: Zone) -> Self {
        Self {
            zone,
            floor_m: f64::NEG_INFINITY,
            ceiling_m: f64::INFINITY,
        }
    }

    /// Whether a UAV at `level_m` that keeps `vertical_margin_m` must go around.
    ///
    /// A limit that is no number limits nothing; floor and ceiling may be swapped.
    #[must_use]
    pub fn is_active(&self, level_m: f64, vertical_margin_m: f64) -> bool {
        let low = self.floor_m.min(self.ceiling_m);
        let high = self.floor_m.max(self.ceiling_m);
        let unlimited = self.floor_m.is_nan() || self.ceiling_m.is_nan();
        // Only what is certainly above or below is passed; doubt keeps the zone.
        let below = level_m + vertical_margin_m < low;
        let above = level_m - vertical_margin_m > high;
        unlimited || !(below || above)
    }
}

/// The zones that matter at a level, each with its index in `zones`.
#[must_use]
pub fn at_level(
    zones: &[LayeredZone],
    level_m: f64,
    vertical_margin_m: f64,
) -> Vec<(usize, &Zone)> {
    zones
        .iter()
        .enumerate()
        .filter(|(_, z)| z.is_active(level_m, vertical_margin_m))
        .map(|(i, z)| (i, &z.zone))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zone_counts_from_its_floor_to_its_ceiling_and_the_margin_beyond() {
        let layer = |floor_m, ceiling_m| LayeredZone {
            zone: Zone::default(),
            floor_m,
            ceiling_m,
        };
        let cases = [
            (100.0, 200.0, 89.9, false),
            (100.0, 200.0, 90.0, true),
            (100.0, 200.0, 150.0, true),
            (100.0, 200.0, 210.0, true),
            (100.0, 200.0, 210.1, false),
            (200.0, 100.0, 150.0, true),
            (f64::NEG_INFINITY, 200.0, 0.0, true),
            (f64::NAN, 200.0, 500.0, true),
            (100.0, f64::INFINITY, 1e4, true),
            (100.0, 200.0, f64::NAN, true),
        ];
        for (floor_m, ceiling_m, level_m, want) in cases {
            let z = layer(floor_m, ceiling_m);
            assert_eq!(z.is_active(level_m, 10.0), want, "{z:?} at {level_m}");
        }
        let all = [layer(0.0, 50.0), layer(40.0, 90.0), layer(100.0, 120.0)];
        let indices: Vec<usize> = at_level(&all, 80.0, 5.0).iter().map(|(i, _)| *i).collect();
        assert_eq!(indices, [1]);
        assert!(LayeredZone::unlimited(Zone::default()).is_active(1e5, 0.0));
    }
}
