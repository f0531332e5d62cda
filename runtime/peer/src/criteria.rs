//! What a mission looks for besides what it is to see, and what follows when that is seen
//! (D2.7 §1.2.3, §3.7): a part of its record, so that all obey the same.
//!
//! | a vehicle on the ground | what follows |
//! |---|---|
//! | of no criterion | nothing |
//! | of one, not told yet | it is told, once: what, where, when, by whom |
//! | and the criterion says follow | a task to follow it is asked for, which the auction gives out |
//! | of one that so many were told of | nothing more |
//!
//! The first criterion that fits counts. Who tells what is [`crate::detections`]'s.

use crate::mission::is_default;
use crate::wire::limits::DURATION_MAX_MS;
use serde::{Deserialize, Serialize};
use skein_geometry::hash::Fnv;

/// Most criteria of a mission.
pub const CRITERIA_MAX: usize = 8;

/// Most objects that one criterion tells of.
pub const AT_MOST_MAX: u16 = 64;

/// How many one tells of unless it says so.
pub const AT_MOST: u16 = 16;

/// What vehicles look like, by the number that a detector tells: its remainder by
/// [`COLOURED`].
pub const LOOKS: [&str; 4] = ["bicycle", "car", "lorry", "bus"];

/// What a detector tells is the kind of a vehicle and so many times its colour; colour 0 is none
/// that it could tell.
pub const COLOURED: u8 = 8;

/// The largest number of a colour.
pub const COLOUR_MAX: u8 = u8::MAX / COLOURED;

/// The colours of vehicles, from colour 1 on.
pub const COLOURS: [&str; 7] = ["white", "black", "grey", "red", "blue", "green", "yellow"];

/// What a detector tells of a vehicle of this kind and colour.
#[must_use]
pub fn coloured(kind: u8, colour: u8) -> u8 {
    kind % COLOURED + COLOURED * colour.min(COLOUR_MAX)
}

/// The kind of what looks so.
#[must_use]
pub fn kind_of(looks: u8) -> u8 {
    looks % COLOURED
}

/// The colour of what looks so; 0 for none that could be told.
#[must_use]
pub fn colour_of(looks: u8) -> u8 {
    looks / COLOURED
}

/// Slower than this is as good as still, mm/s: twice what the mean over a watch is off by.
pub const STILL_MMPS: u32 = 1_500;

/// What is worth being followed unless a criterion says so.
pub const WORTH: u16 = 100;

/// What an object looks like, for a person.
#[must_use]
pub fn looks_name(looks: u8) -> String {
    let kind = kind_of(looks);
    let known = LOOKS.get(usize::from(kind));
    let what = known.map_or_else(|| format!("vehicle of kind {kind}"), |s| (*s).to_owned());
    match usize::from(colour_of(looks)) {
        0 => what,
        n => match COLOURS.get(n - 1) {
            Some(colour) => format!("{colour} {what}"),
            None => format!("{what} of colour {n}"),
        },
    }
}

/// What follows when an object is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Then {
    /// It is told, and all go on.
    #[default]
    Notify,
    /// It is told, and one UAV follows it for some time: until services on the ground are there.
    Follow,
}

impl Then {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Notify, Self::Follow];

    /// Its name in a file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Notify => "notify",
            Self::Follow => "follow",
        }
    }
}

/// What is looked for. Whole numbers alone, as all of a mission.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Criterion {
    /// Of which kind it is; any where none is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub looks: Option<u8>,
    /// Its colour, from 1 on; any where none is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<u8>,
    /// Whether it moves; either where it is not said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moving: Option<bool>,
    /// At least so fast, mm/s; 0 for any.
    #[serde(default, skip_serializing_if = "is_default")]
    pub faster_mmps: u32,
    /// What follows.
    pub then: Then,
    /// For how long it is followed, milliseconds; 0 where it is not.
    #[serde(default, skip_serializing_if = "is_default")]
    pub for_ms: u32,
    /// How far from it a UAV stays that follows it, mm; 0 for half of what its camera sees.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stand_off_mm: u32,
    /// What it is worth to follow it, 1 to 1000.
    pub worth: u16,
    /// Of so many it tells.
    pub at_most: u16,
}

impl Default for Criterion {
    fn default() -> Self {
        Self {
            looks: None,
            colour: None,
            moving: None,
            faster_mmps: 0,
            then: Then::Notify,
            for_ms: 0,
            stand_off_mm: 0,
            worth: WORTH,
            at_most: AT_MOST,
        }
    }
}

impl Criterion {
    /// Whether something that looks so and is so fast, mm/s, is what is looked for.
    #[must_use]
    pub fn fits(&self, looks: u8, speed_mmps: u32) -> bool {
        let is_moving = speed_mmps >= STILL_MMPS;
        self.looks.is_none_or(|kind| kind == kind_of(looks))
            && self.colour.is_none_or(|colour| colour == colour_of(looks))
            && self.moving.is_none_or(|m| m == is_moving)
            && speed_mmps >= self.faster_mmps
    }

    /// What is wrong with it, if anything.
    ///
    /// # Errors
    /// The field and what was expected of it.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let follows = self.then == Then::Follow;
        if follows && !(1_000..=DURATION_MAX_MS).contains(&self.for_ms) {
            let text = "what is followed is followed for some time; expected 1 to 86400 seconds";
            return Err(("for_s", text.to_owned()));
        }
        if !follows && (self.for_ms, self.stand_off_mm) != (0, 0) {
            let text = "what is told alone is not followed; leave for_s and stand_off_m out";
            return Err(("then", text.to_owned()));
        }
        if self.moving == Some(false) && self.faster_mmps > 0 {
            let text = "what is still is no faster than anything; leave one of both out";
            return Err(("faster_than_m_s", text.to_owned()));
        }
        if self.looks.is_some_and(|kind| kind >= COLOURED) {
            return Err(("kind", format!("expected less than {COLOURED}")));
        }
        let colours = 1..=COLOUR_MAX;
        if self.colour.is_some_and(|colour| !colours.contains(&colour)) {
            return Err(("colour", format!("expected 1 to {COLOUR_MAX}")));
        }
        if !(1..=AT_MOST_MAX).contains(&self.at_most) {
            let text = format!("expected 1 to {AT_MOST_MAX}");
            return Err(("at_most", text));
        }
        if !(1..=crate::wire::tasks::WORTH_MAX).contains(&self.worth) {
            return Err(("worth", "expected 1 to 1000".to_owned()));
        }
        Ok(())
    }

    /// Folds it into the hash of a mission.
    pub(crate) fn hash(&self, h: &mut Fnv) {
        h.write_i64(self.looks.map_or(-1, i64::from));
        if let Some(colour) = self.colour {
            h.write_i64(-11);
            h.write_i64(i64::from(colour));
        }
        h.write_i64(self.moving.map_or(-1, i64::from));
        h.write_i64(i64::from(self.faster_mmps));
        h.write_i64(i64::from(self.then == Then::Follow));
        for n in [self.for_ms, self.stand_off_mm] {
            h.write_i64(i64::from(n));
        }
        h.write_i64(i64::from(self.worth));
        h.write_i64(i64::from(self.at_most));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_criterion_asks_for_looks_and_speed() {
        let car = Criterion {
            looks: Some(1),
            moving: Some(true),
            faster_mmps: 5_000,
            ..Criterion::default()
        };
        assert!(car.fits(1, 5_000) && car.fits(1, 9_000));
        assert!(!car.fits(2, 9_000) && !car.fits(1, 4_999));
        let still = Criterion {
            moving: Some(false),
            ..Criterion::default()
        };
        assert!(still.fits(3, 0) && still.fits(0, STILL_MMPS - 1) && !still.fits(0, STILL_MMPS));
        assert!(Criterion::default().fits(3, 40_000));
    }

    #[test]
    fn a_criterion_asks_for_a_colour() {
        let red = Criterion {
            looks: Some(1),
            colour: Some(4),
            ..Criterion::default()
        };
        assert!(red.fits(coloured(1, 4), 0) && red.check().is_ok());
        // A car of another colour, of none that could be told, and what is no car.
        for looks in [coloured(1, 5), coloured(1, 0), coloured(2, 4)] {
            assert!(!red.fits(looks, 0), "{}", looks_name(looks));
        }
        let any = Criterion {
            looks: Some(1),
            ..Criterion::default()
        };
        assert!(any.fits(coloured(1, 4), 0) && any.fits(1, 0));
        assert_eq!(looks_name(coloured(1, 4)), "red car");
        assert_eq!(looks_name(coloured(6, 9)), "vehicle of kind 6 of colour 9");
        let hash = |c: &Criterion| {
            let mut h = Fnv::new();
            c.hash(&mut h);
            h.finish()
        };
        assert_ne!(hash(&red), hash(&any));
    }

    #[test]
    fn what_makes_no_sense_is_named() {
        let wrong = |change: fn(&mut Criterion)| {
            let mut c = Criterion::default();
            change(&mut c);
            c.check().unwrap_err().0
        };
        assert!(Criterion::default().check().is_ok());
        assert_eq!(wrong(|c| c.then = Then::Follow), "for_s");
        assert_eq!(wrong(|c| c.for_ms = 1_000), "then");
        assert_eq!(wrong(|c| c.at_most = 0), "at_most");
        assert_eq!(wrong(|c| c.worth = 0), "worth");
        assert_eq!(wrong(|c| c.colour = Some(0)), "colour");
        assert_eq!(wrong(|c| c.looks = Some(9)), "kind");
        assert_eq!(
            wrong(|c| (c.moving, c.faster_mmps) = (Some(false), 1)),
            "faster_than_m_s"
        );
    }
}
