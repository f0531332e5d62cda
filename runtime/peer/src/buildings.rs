//! The buildings of a mission (D2.7 §3.7.1): a part of its record, so that who follows a target
//! knows what hides it. What is done with them is [`skein_flight::tracking::vantage`]'s.
//!
//! Outlines are in decimetres, each corner as what it is off the one before: four bytes or so.

use crate::mission::{Mission, point_m};
use crate::wire::limits::POSITION_MAX_MM;
use serde::{Deserialize, Serialize};
use skein_flight::tracking::buildings::{self, Town};
use skein_flight::tracking::streets::Streets;
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_geometry::hash::Fnv;
use std::sync::Arc;

/// Most buildings of a mission: those of a square kilometre of a city.
pub const BUILDINGS_MAX: usize = 512;

/// Most corners of one building, and of all together.
pub const CORNERS_MAX: usize = 512;
/// See [`CORNERS_MAX`].
pub const ALL_CORNERS_MAX: usize = 6_144;

/// Most bytes of all: half of what a mission may have.
pub const BYTES_MAX: usize = 32 * 1_024;

/// The lowest and the highest roof above the ground, dm.
pub const ROOF_DM: (u16, u16) = (1, 10_000);

/// A place in decimetres east and north of the mission's origin.
pub type PointDm = (i32, i32);

/// The farthest place from the origin, each way, dm.
const FARTHEST_DM: u32 = POSITION_MAX_MM.unsigned_abs() / 100;

/// A building. Whole numbers alone, as all of a mission.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Told", into = "Told")]
pub struct Building {
    /// How high its roof is above the ground, dm.
    pub roof_dm: u16,
    /// The corners of its outline, dm.
    pub ring: Vec<PointDm>,
}

/// A building on the wire: its roof, its first corner, and of each other one what it is off the
/// one before.
#[derive(Serialize, Deserialize)]
struct Told(u16, Vec<i32>);

impl From<Building> for Told {
    fn from(building: Building) -> Self {
        let mut before = (0, 0);
        let mut steps = Vec::with_capacity(2 * building.ring.len());
        for at in building.ring {
            // Wraps as it is unwrapped: of numbers that are near nothing is lost.
            steps.push(at.0.wrapping_sub(before.0));
            steps.push(at.1.wrapping_sub(before.1));
            before = at;
        }
        Self(building.roof_dm, steps)
    }
}

impl TryFrom<Told> for Building {
    type Error = &'static str;

    fn try_from(Told(roof_dm, steps): Told) -> Result<Self, Self::Error> {
        let pairs = steps.chunks_exact(2);
        if !pairs.remainder().is_empty() {
            return Err("a corner of a building has one number");
        }
        let mut at = (0_i32, 0_i32);
        let step = |step: &[i32]| {
            at = (at.0.wrapping_add(step[0]), at.1.wrapping_add(step[1]));
            at
        };
        Ok(Self {
            roof_dm,
            ring: pairs.map(step).collect(),
        })
    }
}

impl Building {
    /// Its outline, metres; none where that is no simple ring.
    #[must_use]
    pub fn footprint(&self) -> Option<Polygon> {
        let at = |p: &PointDm| Point::new(f64::from(p.0) / 10.0, f64::from(p.1) / 10.0);
        Polygon::new(self.ring.iter().map(at).collect::<Vec<_>>()).ok()
    }

    /// How high its roof is above the ground, metres.
    #[must_use]
    pub fn roof_m(&self) -> f64 {
        f64::from(self.roof_dm) / 10.0
    }

    /// What is wrong with it, if anything.
    fn check(&self) -> Result<(), String> {
        let (low, high) = ROOF_DM;
        if !(low..=high).contains(&self.roof_dm) {
            return Err(format!(
                "has a roof at {} m; expected {} to {} m",
                self.roof_m(),
                f64::from(low) / 10.0,
                f64::from(high) / 10.0
            ));
        }
        let is_near = |dm: i32| dm.unsigned_abs() <= FARTHEST_DM;
        if !self.ring.iter().all(|p| is_near(p.0) && is_near(p.1)) {
            return Err("stands farther than 20 km from the origin".to_owned());
        }
        if self.ring.len() > CORNERS_MAX || self.footprint().is_none() {
            let corners = self.ring.len();
            return Err(format!(
                "has {corners} corners that make no outline; expected a simple ring of 3 to {CORNERS_MAX} corners"
            ));
        }
        Ok(())
    }
}

/// The buildings of a mission.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Buildings {
    /// All of them.
    pub all: Vec<Building>,
}

impl Buildings {
    /// How many corners they have together.
    #[must_use]
    pub fn corners(&self) -> usize {
        self.all.iter().map(|b| b.ring.len()).sum()
    }

    /// How many bytes of a mission they take.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let bytes = cbor4ii::serde::to_vec(Vec::new(), self);
        // Nothing but a want of memory keeps integers from being encoded.
        bytes.map_or(usize::MAX, |b| b.len())
    }

    /// What is wrong with them, if anything.
    ///
    /// # Errors
    /// A sentence that names the building where it is of one.
    pub fn check(&self) -> Result<(), String> {
        let too_many = |what: &str, n: usize, most: usize| {
            Err(format!(
                "{n} {what} are too many: {most} fit; take a smaller area, or buildings with fewer corners"
            ))
        };
        if self.all.len() > BUILDINGS_MAX {
            return too_many("buildings", self.all.len(), BUILDINGS_MAX);
        }
        if self.corners() > ALL_CORNERS_MAX {
            return too_many("corners of buildings", self.corners(), ALL_CORNERS_MAX);
        }
        for (i, building) in self.all.iter().enumerate() {
            building.check().map_err(|why| format!("[{i}] {why}"))?;
        }
        if self.bytes() > BYTES_MAX {
            return too_many("bytes of buildings", self.bytes(), BYTES_MAX);
        }
        Ok(())
    }

    /// Folds them into the hash of a mission.
    pub(crate) fn hash(&self, h: &mut Fnv) {
        let number = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
        h.write_i64(number(self.all.len()));
        for building in &self.all {
            h.write_i64(i64::from(building.roof_dm));
            h.write_i64(number(building.ring.len()));
            for (east_dm, north_dm) in &building.ring {
                h.write_i64(i64::from(*east_dm));
                h.write_i64(i64::from(*north_dm));
            }
        }
    }
}

impl Mission {
    /// What who follows a target knows of what hides it, and of where it drives; nothing where
    /// the mission tells neither.
    #[must_use]
    pub fn town(&self) -> Option<Arc<Town>> {
        if self.buildings.is_none() && self.streets.is_none() {
            return None;
        }
        let building = |b: &Building| {
            Some(buildings::Building {
                footprint: b.footprint()?,
                roof_m: b.roof_m(),
            })
        };
        let told = self.buildings.iter().flat_map(|b| &b.all);
        let buildings = buildings::Buildings::of(told.filter_map(building));
        let streets = self.streets.as_ref().and_then(|streets| {
            let ways = streets.ways.iter();
            let line = |places: &[(i32, i32)]| places.iter().copied().map(point_m).collect();
            let lines: Vec<Vec<Point>> = ways.map(|w| line(&w.places)).collect();
            Streets::of(&lines)
        });
        Some(Arc::new(Town { buildings, streets }))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A house of 20 m by 12 m with a roof at 30 m, west of the origin.
    pub(crate) fn house() -> Building {
        Building {
            roof_dm: 300,
            ring: vec![(-300, 0), (-100, 0), (-100, 120), (-300, 120)],
        }
    }

    pub(crate) fn houses(count: usize) -> Buildings {
        Buildings {
            all: vec![house(); count],
        }
    }

    fn round_trip(buildings: &Buildings) -> Buildings {
        let bytes = cbor4ii::serde::to_vec(Vec::new(), buildings).unwrap();
        assert_eq!(bytes.len(), buildings.bytes());
        cbor4ii::serde::from_slice(&bytes).unwrap()
    }

    #[test]
    fn houses_are_told_in_few_bytes_and_understood() {
        let town = houses(100);
        assert_eq!(round_trip(&town), town);
        // Four corners of about four bytes each, a roof, and what frames them.
        assert!(town.bytes() <= 100 * 24 + 3, "{}", town.bytes());
        assert_eq!(town.check(), Ok(()));
        assert!((house().footprint().unwrap().area_m2() - 240.0).abs() < 1e-9);
        assert!((house().roof_m() - 30.0).abs() < 1e-9);
    }

    #[test]
    fn what_does_not_fit_or_makes_no_outline_is_refused_and_named() {
        type Change = fn(&mut Buildings);
        let star = |corners: i32| -> Vec<PointDm> {
            // A zigzag along two lines: simple, and of as many corners as is asked for.
            let out = (0..corners).map(|i| (1_000 * i, if i % 2 == 0 { 0 } else { 70_000 }));
            out.chain([(1_000 * corners, -90_000), (0, -90_000)])
                .collect()
        };
        assert_eq!(
            Buildings {
                all: vec![Building {
                    roof_dm: 1,
                    ring: star(100)
                }]
            }
            .check(),
            Ok(())
        );
        let cases: [(Change, &str); 9] = [
            (|b| b.all[1].roof_dm = 0, "[1] has a roof"),
            (|b| b.all[2].roof_dm = 10_001, "[2] has a roof"),
            (|b| b.all[0].ring.truncate(2), "[0] has 2 corners"),
            (|b| b.all[0].ring.swap(0, 1), "[0] has 4 corners"),
            (|b| b.all[0].ring[2].0 = 200_001, "[0] stands farther"),
            (|b| b.all[0].ring[2].1 = i32::MIN, "[0] stands farther"),
            (|b| b.all = vec![house(); 513], "513 buildings are too many"),
            (|b| b.all[0].ring = vec![(0, 0); 600], "[0] has 600 corners"),
            (
                |b| {
                    for i in 0..30 {
                        let ring = (0..206).map(|k| (k, i)).collect();
                        b.all.push(Building { roof_dm: 5, ring });
                    }
                },
                "corners of buildings are too many",
            ),
        ];
        for (change, why) in cases {
            let mut town = houses(3);
            change(&mut town);
            let said = town.check().unwrap_err();
            assert!(said.contains(why), "{said}");
        }
        let wide = Building {
            roof_dm: 300,
            ring: star(190),
        };
        let town = Buildings {
            all: vec![wide; 32],
        };
        let said = town.check().unwrap_err();
        assert!(said.contains("bytes of buildings are too many"), "{said}");
    }

    #[test]
    fn half_a_corner_is_none() {
        let told = (300_u16, vec![0_i32, 0, 5]);
        let bytes = cbor4ii::serde::to_vec(Vec::new(), &told).unwrap();
        assert!(cbor4ii::serde::from_slice::<Building>(&bytes).is_err());
    }

    proptest! {
        #[test]
        fn any_numbers_come_back(
            roof_dm in any::<u16>(),
            ring in prop::collection::vec((any::<i32>(), any::<i32>()), 0..9),
        ) {
            let town = Buildings { all: vec![Building { roof_dm, ring }] };
            prop_assert_eq!(round_trip(&town), town.clone());
            let _ = town.check();
        }
    }
}
