//! What an operator changes of a mission in flight: no-fly zones by name, a mission that is
//! begun anew or ended. Each change is a new revision of the whole mission, so it travels,
//! lasts and is agreed upon like any other.

use crate::found_obstacles::FOUND_PREFIX;
use crate::mission::{GeometryError, Mission, PointMm};
use skein_geometry::hash::Fnv;
use skein_geometry::{NoFlyZones, Polygon};
use std::sync::Arc;

/// The longest name of a zone, bytes.
pub const ZONE_NAME_MAX_BYTES: usize = 32;

/// Most zones that an operator may have added at one time: people keep track of fewer.
pub const ADDED_ZONES_MAX: usize = 64;

/// Why a mission is not changed; it stays as it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// A name that could not be typed or told.
    #[error(
        "{0:?} is no name of a zone; expected 1 to {ZONE_NAME_MAX_BYTES} letters, digits, '-', '_' or '.'"
    )]
    Name(String),
    /// A zone has this name already.
    #[error("a zone {0:?} is there already; remove it first, or choose another name")]
    Taken(String),
    /// No zone that an operator added has this name.
    #[error("no added zone is named {0:?}; there are: {1}")]
    Unknown(String, String),
    /// Only zones round what UAVs found are called so.
    #[error(
        "zones round what UAVs found begin with {FOUND_PREFIX:?}, not {0:?}; choose another name"
    )]
    Found(String),
    /// One more is too many.
    #[error("{ADDED_ZONES_MAX} added zones are the most; remove one first")]
    TooMany,
    /// One more is too many.
    #[error(
        "{DISMISSED_MAX} zones round what UAVs found were removed already; begin the mission anew"
    )]
    TooManyDismissed,
    /// It is no simple polygon.
    #[error("the zone is {0}")]
    Ring(skein_geometry::PolygonError),
    /// The mission was ended before.
    #[error("the mission is cancelled; submit another one")]
    Cancelled,
}

/// Whether people can type it and a terminal shows it.
#[must_use]
pub fn is_zone_name(name: &str) -> bool {
    let fits = |b: u8| b.is_ascii_alphanumeric() || b"-_.".contains(&b);
    (1..=ZONE_NAME_MAX_BYTES).contains(&name.len()) && name.bytes().all(fits)
}

/// Zones round what was found that may have been taken out.
pub const DISMISSED_MAX: usize = 32;

/// Whether UAVs added it.
#[must_use]
pub fn is_found(zone: &str) -> bool {
    zone.starts_with(FOUND_PREFIX)
}

impl Mission {
    /// The same with one more no-fly zone.
    ///
    /// # Errors
    /// When the name or the ring will not do.
    pub fn with_zone(&self, name: &str, ring: &[PointMm]) -> Result<Self, EditError> {
        if !is_zone_name(name) {
            return Err(EditError::Name(name.to_owned()));
        }
        if is_found(name) {
            return Err(EditError::Found(name.to_owned()));
        }
        if self.added_zones.contains_key(name) {
            return Err(EditError::Taken(name.to_owned()));
        }
        let added = self.added_zones.keys().filter(|name| !is_found(name));
        if added.count() >= ADDED_ZONES_MAX {
            return Err(EditError::TooMany);
        }
        let points = ring.iter().copied().map(crate::mission::point_m).collect();
        Polygon::new(points).map_err(EditError::Ring)?;
        let mut changed = self.clone();
        changed.added_zones.insert(name.to_owned(), ring.to_vec());
        Ok(changed)
    }

    /// The same without a no-fly zone that was added. One round what UAVs found comes again if one
    /// of them still senses it.
    ///
    /// # Errors
    /// When there is none of that name.
    pub fn without_zone(&self, name: &str) -> Result<Self, EditError> {
        let mut changed = self.clone();
        match changed.added_zones.remove(name) {
            Some(_) => {
                if is_found(name) {
                    if changed.dismissed.len() >= DISMISSED_MAX {
                        return Err(EditError::TooManyDismissed);
                    }
                    changed.dismissed.insert(name.to_owned());
                }
                Ok(changed)
            }
            None => {
                let names: Vec<&str> = self.added_zones.keys().map(String::as_str).collect();
                let known = if names.is_empty() {
                    "none".to_owned()
                } else {
                    names.join(", ")
                };
                Err(EditError::Unknown(name.to_owned(), known))
            }
        }
    }

    /// A name that no added zone has: `zone-1` and so on.
    #[must_use]
    pub fn free_zone_name(&self) -> String {
        let taken = |name: &String| self.added_zones.contains_key(name);
        let mut names = (1..).map(|n: u32| format!("zone-{n}"));
        names.find(|name| !taken(name)).unwrap_or_default()
    }

    /// What this mission is when it replaces `old` and is a change of it: what was covered of
    /// the same places stays covered, and zones that were added stay. A patrol goes on with the
    /// lap that is flown, or with its last one if it has fewer now.
    ///
    /// # Errors
    /// [`EditError::Cancelled`] when the old one was ended.
    pub fn revising(self, old: &Self) -> Result<Self, EditError> {
        if old.cancelled {
            return Err(EditError::Cancelled);
        }
        let last = self.lap.saturating_add(self.further_laps);
        let lap = self.lap.max(old.lap.min(last));
        Ok(Self {
            lap,
            further_laps: last - lap,
            added_zones: old.added_zones.clone(),
            dismissed: old.dismissed.clone(),
            sortie: old.sortie,
            cancelled: false,
            ..self
        })
    }

    /// What this mission is when it begins anew after `old`: nothing is covered; zones that
    /// were added stay.
    #[must_use]
    pub fn submitted_after(self, old: &Self) -> Self {
        Self {
            added_zones: old.added_zones.clone(),
            dismissed: old.dismissed.clone(),
            sortie: old.sortie.wrapping_add(1),
            cancelled: false,
            ..self
        }
    }

    /// The end of this mission: nothing is to be seen any more, and all fly home.
    ///
    /// # Errors
    /// [`EditError::Cancelled`] when it was ended before.
    pub fn cancelled(&self) -> Result<Self, EditError> {
        if self.cancelled {
            return Err(EditError::Cancelled);
        }
        Ok(Self {
            sortie: self.sortie.wrapping_add(1),
            further_laps: 0,
            cancelled: true,
            ..self.clone()
        })
    }

    /// Everything to be kept clear of.
    ///
    /// # Errors
    /// Which zone is no simple polygon.
    pub fn no_fly_zones(&self) -> Result<Arc<NoFlyZones>, GeometryError> {
        if self.added_zones.keys().any(|name| !is_zone_name(name)) {
            return Err(GeometryError::ZoneName);
        }
        let names = self.added_zones.keys();
        let mut zones = Vec::with_capacity(self.zones.len() + self.added_zones.len());
        for (i, zone) in self.zones_m().enumerate() {
            let name = i.checked_sub(self.zones.len());
            let name = name.and_then(|n| names.clone().nth(n));
            zones.push(Polygon::new(zone).map_err(|e| match name {
                Some(name) => GeometryError::AddedZone(name.clone(), e),
                None => GeometryError::Zone(i, e),
            })?);
        }
        Ok(Arc::new(NoFlyZones::new(zones)))
    }

    /// What of its content an operator changed in flight.
    pub(crate) fn hash_operated(&self, h: &mut Fnv) {
        // Each has a mark of its own, so that no two of them look alike.
        if self.edit() > 0 {
            h.write_i64(-4);
            h.write_i64(i64::from(self.edit()));
        }
        if !self.added_zones.is_empty() {
            h.write_i64(-1);
            for (name, ring) in &self.added_zones {
                h.write_i64(i64::try_from(name.len()).unwrap_or(i64::MAX));
                name.bytes().for_each(|b| h.write_i64(i64::from(b)));
                h.write_i64(i64::try_from(ring.len()).unwrap_or(i64::MAX));
                for p in ring {
                    h.write_i64(i64::from(p.0));
                    h.write_i64(i64::from(p.1));
                }
            }
        }
        if !self.dismissed.is_empty() {
            h.write_i64(-15);
            for name in &self.dismissed {
                h.write_i64(i64::try_from(name.len()).unwrap_or(i64::MAX));
                name.bytes().for_each(|b| h.write_i64(i64::from(b)));
            }
        }
        if self.sortie > 0 {
            h.write_i64(-2);
            h.write_i64(i64::from(self.sortie));
        }
        if self.cancelled {
            h.write_i64(-3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mission;

    const RING: [PointMm; 3] = [(900_000, 0), (950_000, 0), (900_000, 50_000)];

    #[test]
    fn zones_come_and_go_by_name() {
        let first = mission(1, 6, 4);
        assert_eq!(first.free_zone_name(), "zone-1");
        let zoned = first.with_zone("zone-1", &RING).unwrap();
        assert_eq!(
            (zoned.free_zone_name(), zoned.zones_m().count()),
            ("zone-2".into(), 1)
        );
        assert_eq!(zoned.no_fly_zones().unwrap().zones().len(), 1);
        assert_eq!(
            zoned.with_zone("zone-1", &RING),
            Err(EditError::Taken("zone-1".into()))
        );
        assert_eq!(zoned.without_zone("zone-1"), Ok(first.clone()));
        let unknown = zoned.without_zone("z").unwrap_err().to_string();
        assert!(unknown.ends_with("there are: zone-1"), "{unknown}");
        for name in ["", "a b", "\u{1b}[2J", &"x".repeat(33)] {
            assert!(matches!(
                first.with_zone(name, &RING),
                Err(EditError::Name(_))
            ));
        }
        for ring in [&RING[..2], &[], &[(0, 0), (10, 10), (10, 0), (0, 10)]] {
            assert!(matches!(
                first.with_zone("z", ring),
                Err(EditError::Ring(_))
            ));
        }
        let many =
            (0..ADDED_ZONES_MAX).fold(first, |m, i| m.with_zone(&format!("z{i}"), &RING).unwrap());
        assert_eq!(many.with_zone("one-more", &RING), Err(EditError::TooMany));
    }

    #[test]
    fn an_added_zone_that_is_no_polygon_is_named() {
        let mut crossed = mission(1, 6, 4);
        crossed.added_zones.insert(
            "bow".into(),
            vec![(0, 0), (9_000, 9_000), (9_000, 0), (0, 9_000)],
        );
        let why = crossed.no_fly_zones().unwrap_err().to_string();
        assert!(why.starts_with("zone \"bow\": "), "{why}");
        let mut unnamed = mission(1, 6, 4);
        unnamed
            .added_zones
            .insert("\u{1b}[2J".into(), RING.to_vec());
        assert_eq!(
            unnamed.no_fly_zones().map(drop),
            Err(GeometryError::ZoneName)
        );
        assert!(
            crate::Overview::of(
                &unnamed,
                &crate::wire::message::Order::Hold.into(),
                None,
                (vec![], vec![])
            )
            .added_zones
            .is_empty()
        );
    }

    #[test]
    fn a_revised_patrol_goes_on_with_the_lap_that_is_flown() {
        let patrol = |revision, further_laps| Mission {
            further_laps,
            ..mission(revision, 6, 4)
        };
        let old = patrol(1, 4).later_lap(4).unwrap();
        let laps = |all: u16| {
            let revised = patrol(65_536, all - 1).revising(&old).unwrap();
            (revised.lap, revised.further_laps)
        };
        assert_eq!((laps(6), laps(5), laps(4)), ((3, 2), (3, 1), (3, 0)));
        assert_eq!((laps(2), laps(1)), ((1, 0), (0, 0)));
    }

    #[test]
    fn a_mission_that_begins_anew_or_ends_keeps_the_added_zones_and_has_another_loop() {
        let old = mission(1, 6, 4).with_zone("z", &RING).unwrap();
        let revised = mission(2, 6, 4).revising(&old).unwrap();
        let anew = mission(2, 6, 4).submitted_after(&old);
        let ended = old.cancelled().unwrap();
        for m in [&revised, &anew, &ended] {
            assert_eq!(m.added_zones, old.added_zones);
        }
        let hash = |m: &Mission| Arc::new(m.clone()).geometry().unwrap().coverage_loop.hash();
        assert_eq!(hash(&revised), hash(&old));
        assert_ne!(hash(&anew), hash(&old));
        assert_ne!(hash(&ended), hash(&old));
        assert_eq!(ended.cancelled(), Err(EditError::Cancelled));
        assert_eq!(mission(3, 6, 4).revising(&ended), Err(EditError::Cancelled));
        let again = mission(3, 6, 4).submitted_after(&ended);
        assert!(
            !again.cancelled && ![hash(&anew), hash(&ended), hash(&old)].contains(&hash(&again))
        );
    }
}
