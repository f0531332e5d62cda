//! Places at which a mission counts vehicles (D2.7 §3.1): a part of its record, so that all count
//! alike.
//!
//! | what | what is counted at it |
//! |---|---|
//! | passing | vehicles that drive in, while all of it is in a picture; the time for which it was, the way that they drive in it and the time that they take |
//! | standing | vehicles that stand in it, when all of it was in a picture last |
//!
//! Who counts is [`crate::counting`]'s.

use crate::mission::{PointMm, is_default, point_m};
use serde::{Deserialize, Serialize};
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_geometry::hash::Fnv;

/// Most sites of a mission.
pub const SITES_MAX: usize = crate::wire::count::COUNTS_MAX as usize;

/// Most corners of a site.
pub const CORNERS_MAX: usize = 24;

/// The longest name of a site, bytes.
pub const NAME_MAX_BYTES: usize = 24;

/// What is counted at a site.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Counted {
    /// Vehicles that drive through: traffic volume and space-mean speed.
    Passing,
    /// Vehicles that stand: occupancy.
    Standing,
}

impl Counted {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Passing, Self::Standing];

    /// Its name in a file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Passing => "passing",
            Self::Standing => "standing",
        }
    }
}

/// A place at which vehicles are counted. Whole numbers alone, as all of a mission.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CountSite {
    /// What people call it.
    pub name: String,
    /// What is counted there.
    pub what: Counted,
    /// The corners of its outline, mm.
    pub ring: Vec<PointMm>,
    /// How many vehicles there is room for; 0 where that is not said.
    #[serde(default, skip_serializing_if = "is_default")]
    pub capacity: u16,
}

impl CountSite {
    /// Its outline; none where that is no simple ring.
    #[must_use]
    pub fn outline(&self) -> Option<Polygon> {
        Polygon::new(self.ring.iter().copied().map(point_m).collect::<Vec<_>>()).ok()
    }

    /// The middle of its corners, metres.
    #[must_use]
    pub fn middle(&self) -> Point {
        let corners = self.ring.iter().copied().map(point_m);
        let sum = corners.fold(Point::origin(), |sum, p| sum + p.coords);
        #[allow(clippy::cast_precision_loss, reason = "at most 24")]
        let n = self.ring.len().max(1) as f64;
        sum / n
    }

    /// How far the farthest corner is from the middle, metres.
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        let middle = self.middle();
        let away = self.ring.iter().map(|p| (point_m(*p) - middle).norm());
        away.fold(0.0, f64::max)
    }

    /// What is wrong with it, if anything; all of it has to fit into a picture whose inner part
    /// reaches so far from its middle, metres.
    ///
    /// # Errors
    /// The field and what was expected of it.
    pub fn check(&self, reach_m: f64) -> Result<(), (&'static str, String)> {
        if self.name.is_empty() || self.name.len() > NAME_MAX_BYTES {
            let text = format!("expected a name of 1 to {NAME_MAX_BYTES} bytes");
            return Err(("name", text));
        }
        if self.ring.len() > CORNERS_MAX || self.outline().is_none() {
            let text = format!("expected a simple ring of 3 to {CORNERS_MAX} corners");
            return Err(("ring_m", text));
        }
        let radius_m = self.radius_m();
        if radius_m > reach_m {
            let text = format!(
                "reaches {radius_m:.1} m from its middle, and a picture holds {reach_m:.1} m beyond doubt; divide it, or fly higher"
            );
            return Err(("ring_m", text));
        }
        if self.what == Counted::Passing && self.capacity > 0 {
            let text = "nobody stands where vehicles pass; leave it out".to_owned();
            return Err(("capacity", text));
        }
        Ok(())
    }

    /// Folds it into the hash of a mission.
    pub(crate) fn hash(&self, h: &mut Fnv) {
        let number = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
        h.write_i64(number(self.name.len()));
        self.name.bytes().for_each(|b| h.write_i64(i64::from(b)));
        h.write_i64(i64::from(self.what == Counted::Standing));
        h.write_i64(number(self.ring.len()));
        for (east_mm, north_mm) in &self.ring {
            h.write_i64(i64::from(*east_mm));
            h.write_i64(i64::from(*north_mm));
        }
        h.write_i64(i64::from(self.capacity));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossing() -> CountSite {
        CountSite {
            name: "north".to_owned(),
            what: Counted::Passing,
            ring: vec![(0, 0), (20_000, 0), (20_000, 20_000), (0, 20_000)],
            capacity: 0,
        }
    }

    #[test]
    fn what_cannot_be_counted_at_is_named() {
        let wrong = |change: fn(&mut CountSite)| {
            let mut site = crossing();
            change(&mut site);
            site.check(30.0).unwrap_err().0
        };
        assert!(crossing().check(30.0).is_ok());
        assert_eq!(crossing().check(14.0).unwrap_err().0, "ring_m");
        assert_eq!(wrong(|s| s.name.clear()), "name");
        assert_eq!(wrong(|s| s.ring.truncate(2)), "ring_m");
        assert_eq!(wrong(|s| s.ring.swap(1, 2)), "ring_m");
        assert_eq!(wrong(|s| s.capacity = 3), "capacity");
    }
}
