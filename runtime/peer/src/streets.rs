//! The streets of a mission (D2.7 §3.1): a part of its record, so that all have the same network,
//! with the same numbers. Who sees what drives there is [`crate::usage`]'s, and which way is
//! quickest [`crate::hint`]'s.

use crate::mission::{Mission, PointMm, is_default, point_m};
use crate::wire::limits::POSITION_MAX_MM;
use crate::wire::usage::{INTERVALS_MAX, STRETCHES_MAX, TURNS_MAX};
use serde::{Deserialize, Serialize};
use skein_flight::streets::Network;
use skein_geometry::frame::Point;
use skein_geometry::hash::Fnv;
use std::sync::Arc;

/// Most lines of a mission: each crossing of a stretch may cut one.
pub const WAYS_MAX: usize = 256;

/// Most places of all lines: 22 KiB of a mission's 64.
pub const PLACES_MAX: usize = 2_048;

/// Most names of streets.
pub const NAMES_MAX: usize = 128;

/// The longest name of a street, or of a way that is asked for, bytes.
pub const NAME_MAX_BYTES: usize = 40;

/// Most ways that a mission asks for.
pub const HINTS_MAX: usize = 8;

/// The shortest and the longest interval of the day, seconds.
pub const INTERVAL_S: (u32, u32) = (30, 86_400);

/// The slowest and the fastest speed that may be taken for usual, dm/s.
pub const USUAL_DMPS: (u16, u16) = (10, 400);

/// A line of a street.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Way {
    /// Which street: the number of its name.
    pub street: u16,
    /// Its middle line, mm.
    pub places: Vec<PointMm>,
}

/// A way that the operator asks for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AskedWay {
    /// What people call it.
    pub name: String,
    /// From where, mm.
    pub from: PointMm,
    /// To where, mm.
    pub to: PointMm,
}

/// The streets of a mission. Whole numbers alone, as all of a mission.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Streets {
    /// What streets are called, by number.
    pub names: Vec<String>,
    /// Their lines, which hang together where they share a place.
    pub ways: Vec<Way>,
    /// How long an interval of the day is, seconds; the last of [`INTERVALS_MAX`] has no end.
    pub interval_s: u32,
    /// How fast vehicles drive where nothing was measured, dm/s.
    pub usual_dmps: u16,
    /// Ways that are asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub asked: Vec<AskedWay>,
    /// Where emergency vehicles set out for what is detected, mm.
    #[serde(default, skip_serializing_if = "is_default")]
    pub station: Option<PointMm>,
    /// Where these are: nobody measures how they are used. Who follows a vehicle goes by them.
    #[serde(default, skip_serializing_if = "is_default")]
    pub unmeasured: bool,
}

impl Mission {
    /// The streets whose use is measured.
    #[must_use]
    pub fn measured_streets(&self) -> Option<&Arc<Streets>> {
        self.streets.as_ref().filter(|s| !s.unmeasured)
    }
}

impl Streets {
    /// The network that all derive from it.
    #[must_use]
    pub fn network(&self) -> Network {
        let line = |w: &Way| {
            let places: Vec<Point> = w.places.iter().copied().map(point_m).collect();
            (w.street, places)
        };
        Network::of(&self.ways.iter().map(line).collect::<Vec<_>>())
    }

    /// How fast vehicles drive where nothing was measured, m/s.
    #[must_use]
    pub fn usual_mps(&self) -> f64 {
        f64::from(self.usual_dmps) / 10.0
    }

    /// In which interval of the day a time of the clock of percepts is.
    #[must_use]
    pub fn interval_at(&self, time_ms: u64) -> u16 {
        let each_ms = 1_000 * u64::from(self.interval_s.max(1));
        let nth = u16::try_from(time_ms / each_ms).unwrap_or(u16::MAX);
        nth.min(INTERVALS_MAX - 1)
    }

    /// What a street is called.
    #[must_use]
    pub fn name(&self, street: u16) -> &str {
        let name = self.names.get(usize::from(street));
        name.map_or("a street", String::as_str)
    }

    /// What is wrong with it, if anything.
    ///
    /// # Errors
    /// The place in it, and what was expected there.
    pub fn check(&self) -> Result<(), (String, String)> {
        let wrong = |place: String, text: String| Err((place, text));
        let is_name = |name: &str| !name.is_empty() && name.len() <= NAME_MAX_BYTES;
        let is_near = |p: &PointMm| {
            let near = |mm: i32| mm.unsigned_abs() <= POSITION_MAX_MM.unsigned_abs();
            near(p.0) && near(p.1)
        };
        for (what, n, most) in [
            ("names", self.names.len(), NAMES_MAX),
            ("ways", self.ways.len(), WAYS_MAX),
            ("asked", self.asked.len(), HINTS_MAX),
        ] {
            if n > most {
                return wrong(what.into(), format!("are {n}; expected {most} at most"));
            }
        }
        if let Some(i) = self.names.iter().position(|n| !is_name(n)) {
            let text = format!("expected a name of 1 to {NAME_MAX_BYTES} bytes");
            return wrong(format!("names[{i}]"), text);
        }
        let places: usize = self.ways.iter().map(|w| w.places.len()).sum();
        if places > PLACES_MAX {
            let text = format!("have {places} places; expected {PLACES_MAX} at most");
            return wrong("ways".into(), text);
        }
        for (i, way) in self.ways.iter().enumerate() {
            let place = format!("ways[{i}]");
            if usize::from(way.street) >= self.names.len() {
                return wrong(place, "is of a street without a name".into());
            }
            if way.places.windows(2).all(|w| w[0] == w[1]) {
                return wrong(place, "expected two places or more".into());
            }
            if !way.places.iter().all(is_near) {
                return wrong(place, "leads farther than 20 km from the origin".into());
            }
        }
        let (least, most) = INTERVAL_S;
        if !(least..=most).contains(&self.interval_s) {
            let text = format!("expected {least} to {most} s");
            return wrong("interval_s".into(), text);
        }
        let (least, most) = USUAL_DMPS;
        if !(least..=most).contains(&self.usual_dmps) {
            let text = format!("expected {} to {} m/s", least / 10, most / 10);
            return wrong("usual_mps".into(), text);
        }
        self.check_network()
    }

    /// What is wrong with what follows from its lines.
    fn check_network(&self) -> Result<(), (String, String)> {
        let network = self.network();
        let (n, turns) = (network.edges().len(), network.turns().len());
        if n == 0 {
            let text = "are no streets: none is 25 m long".to_owned();
            return Err(("ways".into(), text));
        }
        if n > usize::from(STRETCHES_MAX) || turns > usize::from(TURNS_MAX) {
            let text = format!(
                "have {n} stretches between crossings and {turns} turns; expected {STRETCHES_MAX} and {TURNS_MAX} at most; take a smaller part, or its main streets alone"
            );
            return Err(("ways".into(), text));
        }
        let far = |p: &PointMm| network.nearest(point_m(*p)).is_none();
        let text = || "is farther than 150 m from all streets".to_owned();
        for (i, asked) in self.asked.iter().enumerate() {
            if asked.name.is_empty() || asked.name.len() > NAME_MAX_BYTES {
                let text = format!("expected a name of 1 to {NAME_MAX_BYTES} bytes");
                return Err((format!("asked[{i}].name"), text));
            }
            for (end, at) in [("from", &asked.from), ("to", &asked.to)] {
                if far(at) {
                    return Err((format!("asked[{i}].{end}"), text()));
                }
            }
        }
        if self.station.as_ref().is_some_and(far) {
            return Err(("station".into(), text()));
        }
        let hinted = [
            ("asked", !self.asked.is_empty()),
            ("station", self.station.is_some()),
        ];
        match hinted.iter().find(|(_, told)| *told && self.unmeasured) {
            Some((what, _)) => Err((
                (*what).into(),
                "leads by measured speeds; expected none where the use of streets is not measured"
                    .into(),
            )),
            None => Ok(()),
        }
    }

    /// Folds what is counted by into a hash: which ways are asked for changes nothing of that.
    pub(crate) fn hash_ways(&self, h: &mut Fnv) {
        let number = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
        h.write_i64(number(self.names.len()));
        for name in &self.names {
            hash_text(h, name);
        }
        h.write_i64(number(self.ways.len()));
        for way in &self.ways {
            h.write_i64(i64::from(way.street));
            h.write_i64(number(way.places.len()));
            way.places.iter().for_each(|p| hash_place(h, *p));
        }
        h.write_i64(i64::from(self.interval_s));
    }

    /// Folds it into the hash of a mission.
    pub(crate) fn hash(&self, h: &mut Fnv) {
        self.hash_ways(h);
        h.write_i64(i64::from(self.usual_dmps));
        for asked in &self.asked {
            hash_text(h, &asked.name);
            hash_place(h, asked.from);
            hash_place(h, asked.to);
        }
        if let Some(station) = self.station {
            h.write_i64(-1);
            hash_place(h, station);
        }
        if self.unmeasured {
            h.write_i64(-2);
        }
    }
}

fn hash_text(h: &mut Fnv, text: &str) {
    h.write_i64(i64::try_from(text.len()).unwrap_or(i64::MAX));
    text.bytes().for_each(|b| h.write_i64(i64::from(b)));
}

fn hash_place(h: &mut Fnv, (east_mm, north_mm): PointMm) {
    h.write_i64(i64::from(east_mm));
    h.write_i64(i64::from(north_mm));
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A block with a street through it, 200 m by 200 m.
    pub(crate) fn block() -> Streets {
        let way = |street, places: &[PointMm]| Way {
            street,
            places: places.to_vec(),
        };
        Streets {
            names: ["South", "Middle", "North", "West", "East"]
                .map(str::to_owned)
                .to_vec(),
            ways: vec![
                way(0, &[(0, 0), (200_000, 0)]),
                way(1, &[(0, 100_000), (200_000, 100_000)]),
                way(2, &[(0, 200_000), (200_000, 200_000)]),
                way(3, &[(0, 0), (0, 100_000), (0, 200_000)]),
                way(4, &[(200_000, 0), (200_000, 100_000), (200_000, 200_000)]),
            ],
            interval_s: 60,
            usual_dmps: 80,
            asked: vec![AskedWay {
                name: "across".into(),
                from: (0, 100_000),
                to: (200_000, 100_000),
            }],
            station: None,
            unmeasured: false,
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        assert_eq!(block().check(), Ok(()));
        assert_eq!(block().network().edges().len(), 3);
        type Change = fn(&mut Streets);
        let cases: [(Change, &str); 9] = [
            (|s| s.names[1].clear(), "names[1]"),
            (|s| s.ways[2].street = 5, "ways[2]"),
            (|s| s.ways[3].places.truncate(1), "ways[3]"),
            (|s| s.ways[0].places[0].0 = 30_000_000, "ways[0]"),
            (|s| s.ways.clear(), "ways"),
            (|s| s.interval_s = 5, "interval_s"),
            (|s| s.usual_dmps = 0, "usual_mps"),
            (|s| s.asked[0].to = (900_000, 0), "asked[0].to"),
            (|s| s.station = Some((0, 900_000)), "station"),
        ];
        for (change, place) in cases {
            let mut streets = block();
            change(&mut streets);
            assert_eq!(streets.check().unwrap_err().0, place);
        }
    }

    #[test]
    fn the_last_interval_has_no_end() {
        let streets = block();
        let at = |s: u64| streets.interval_at(1_000 * s);
        assert_eq!((at(0), at(59), at(60)), (0, 0, 1));
        assert_eq!(at(86_400), INTERVALS_MAX - 1);
    }
}
