//! Which way an emergency vehicle is to take (D2.7 §3.1: path hints), by what is known of how
//! streets are used. Pure: who knows the same says the same.
//!
//! The seconds that a metre of a stretch takes are those that vehicles were seen to take, those of
//! the last interval with full weight and each earlier one with half of the next one's, beside
//! `PRIOR_S` of one vehicle at the usual speed. Where vehicles are seen to stand, on and on, a
//! stretch is blocked: it is driven only where there is no other way.

use crate::mission::{PointMm, mm};
use crate::usage::{StretchSum, Usages};
use serde::{Deserialize, Serialize};
use skein_flight::streets::quickest::{Leg, REACH_M};
use skein_geometry::frame::Point;
use std::fmt;
use thiserror::Error;

/// The usual speed counts as one vehicle that was watched for so long, seconds.
const PRIOR_S: f64 = 10.0;

/// So much of what an interval said still holds in the next one.
const STILL_HOLDS: f64 = 0.5;

/// A stretch is blocked where so many vehicles stand at a time, in the mean, and so many for each
/// hundred metres: fewer may be parked.
const BLOCKING: f64 = 2.0;
const BLOCKING_PER_M: f64 = 0.02;

/// And where it was watched for so long, seconds, and who is there drives slower than so, m/s.
const BLOCKED_FROM_S: f64 = 3.0;
const BLOCKED_MPS: f64 = 2.0;

/// Who has to drive a blocked stretch takes so many seconds a metre.
const BLOCKED_S_PER_M: f64 = 5.0;

/// How unlike the times of two drives along one stretch are, a standard deviation as a share; and
/// how wrong the usual speed may be where nothing was seen.
const UNLIKE: f64 = 0.25;
const UNKNOWN: f64 = 0.4;

/// What is known of how a stretch is driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Seconds a metre.
    pub s_per_m: f64,
    /// How wrong that may be, a standard deviation as a share.
    pub off: f64,
    /// Whether vehicles stand in it.
    pub is_blocked: bool,
    /// Whether it was watched.
    pub is_known: bool,
}

/// A way along the streets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hint {
    /// What people call it.
    pub name: String,
    /// Stretches in order: which, and from where to where along it, metres.
    pub legs: Vec<(u16, f64, f64)>,
    /// How long it is, metres.
    pub length_m: f64,
    /// How long it takes, seconds, and where that is in nineteen cases of twenty.
    pub time_s: f64,
    /// The range of that.
    pub range_s: (f64, f64),
    /// Which part of it was watched.
    pub known_share: f64,
    /// The streets that it goes along, in order.
    pub streets: Vec<String>,
    /// Streets that are blocked somewhere, and the hint does not drive there.
    pub avoided: Vec<String>,
    /// Whether it drives through what is blocked, for want of another way.
    pub is_blocked: bool,
}

/// A way that somebody asks for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WayHint {
    /// The way, by what is known now.
    pub hint: Hint,
    /// Its line, millimetres from the mission's origin: from where on the streets it begins to
    /// where it ends.
    pub line: Vec<PointMm>,
    /// How far from these the places are that it was asked for between, metres.
    pub off_m: (f64, f64),
}

/// Why there is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum NoWay {
    /// No mission is held, or nothing followed from it yet.
    #[error("no mission is held here yet")]
    Mission,
    /// Nobody was told of streets.
    #[error("the mission brings no streets, or none whose use is measured (mission.streets)")]
    Streets,
    /// A place is far from all of them.
    #[error("it would {0} more than {REACH_M} m from the mission's streets")]
    Far(End),
    /// There is none.
    #[error("the mission's streets do not lead from there to there")]
    Apart,
}

/// An end of a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Where it begins.
    First,
    /// Where it ends.
    Last,
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::First => "begin",
            Self::Last => "end",
        })
    }
}

impl Usages {
    /// The quickest way from a place to a place, metres, with its line.
    ///
    /// # Errors
    /// When a place is far from the streets, or they do not lead there.
    pub fn way(&self, from: Point, to: Point) -> Result<WayHint, NoWay> {
        for (place, end) in [(from, End::First), (to, End::Last)] {
            self.network().nearest(place).ok_or(NoWay::Far(end))?;
        }
        let hint = self.hint("asked for", from, to).ok_or(NoWay::Apart)?;
        let leg = |&(edge, from_m, to_m): &(u16, f64, f64)| Leg { edge, from_m, to_m };
        let legs: Vec<Leg> = hint.legs.iter().map(leg).collect();
        let line = self.network().line(&legs);
        let off_m = |place: Point, on: Option<&Point>| on.map_or(0.0, |on| (place - on).norm());
        Ok(WayHint {
            off_m: (off_m(from, line.first()), off_m(to, line.last())),
            line: line.iter().map(|p| (mm(p.x), mm(p.y))).collect(),
            hint,
        })
    }

    /// What is known of how a stretch is driven.
    #[must_use]
    pub fn pace(&self, stretch: u16) -> Pace {
        let usual_mps = self.streets().usual_mps();
        let edges = self.network().edges();
        let length_m = edges.get(usize::from(stretch)).map_or(1.0, |e| e.length_m);
        let of = self.stretches().filter(|((_, s), _)| *s == stretch);
        let seen: Vec<(u16, &StretchSum)> = of.map(|((i, _), sum)| (i, sum)).collect();
        let last = self.stretches().map(|((i, _), _)| i).max().unwrap_or(0);
        let (mut spent_s, mut driven_m, mut n) = (PRIOR_S, PRIOR_S * usual_mps, 0.0);
        for (interval, sum) in &seen {
            let weight = STILL_HOLDS.powi(i32::from(last - interval));
            spent_s += weight * sum.spent_s();
            driven_m += weight * sum.speed_mps().unwrap_or(0.0) * sum.spent_s();
            n += weight * f64::from(sum.vehicles);
        }
        let newest = seen
            .iter()
            .rev()
            .find(|(_, s)| s.watched_s(length_m) >= BLOCKED_FROM_S);
        let is_blocked = newest.is_some_and(|(_, sum)| {
            let stand = sum.standing(length_m).unwrap_or(0.0);
            let is_slow = sum.speed_mps().is_some_and(|v| v < BLOCKED_MPS);
            is_slow && stand >= BLOCKING && stand >= BLOCKING_PER_M * length_m
        });
        let s_per_m = spent_s / driven_m.max(0.1);
        Pace {
            s_per_m: if is_blocked {
                s_per_m.max(BLOCKED_S_PER_M)
            } else {
                s_per_m
            },
            off: UNLIKE + UNKNOWN / (n + 1.0).sqrt(),
            is_blocked,
            is_known: newest.is_some(),
        }
    }

    /// The quickest way from a place to a place, metres, by what is known; none where the streets
    /// do not lead there.
    #[must_use]
    pub fn hint(&self, name: &str, from: Point, to: Point) -> Option<Hint> {
        let edges = self.network().edges();
        let paces: Vec<Pace> = (0_u16..).zip(edges).map(|(n, _)| self.pace(n)).collect();
        let pace = |stretch: u16| paces.get(usize::from(stretch));
        let s_per_m = |stretch: u16| pace(stretch).map_or(f64::INFINITY, |p| p.s_per_m);
        let legs = self.network().quickest(from, to, &s_per_m)?;
        let length_m: f64 = legs.iter().map(Leg::length_m).sum();
        let (mut time_s, mut variance, mut known_m) = (0.0, 0.0, 0.0);
        let mut streets: Vec<String> = Vec::new();
        for leg in &legs {
            let Some(p) = pace(leg.edge) else {
                continue;
            };
            let takes_s = leg.length_m() * p.s_per_m;
            time_s += takes_s;
            variance += (takes_s * p.off) * (takes_s * p.off);
            known_m += if p.is_known { leg.length_m() } else { 0.0 };
            let street = self.streets().name(edges[usize::from(leg.edge)].street);
            if streets.last().is_none_or(|last| last != street) {
                streets.push(street.to_owned());
            }
        }
        let driven = |stretch: u16| legs.iter().any(|l| l.edge == stretch);
        let blocked = (0_u16..).zip(&paces).filter(|(_, p)| p.is_blocked);
        let mut avoided: Vec<String> = Vec::new();
        let mut is_blocked = false;
        for (n, _) in blocked {
            is_blocked |= driven(n);
            let street = self.streets().name(edges[usize::from(n)].street);
            if !driven(n) && !avoided.iter().any(|a| a == street) {
                avoided.push(street.to_owned());
            }
        }
        let off_s = 1.96 * variance.sqrt();
        Some(Hint {
            name: name.to_owned(),
            legs: legs.iter().map(|l| (l.edge, l.from_m, l.to_m)).collect(),
            length_m,
            time_s,
            range_s: ((time_s - off_s).max(0.0), time_s + off_s),
            known_share: known_m / length_m.max(1e-9),
            streets,
            avoided,
            is_blocked,
        })
    }
}

impl Hint {
    /// It, for a person.
    #[must_use]
    pub fn sentence(&self) -> String {
        let (low, high) = self.range_s;
        let mut text = format!(
            "way {}: {:.0} m in {:.0} s ({low:.0} to {high:.0}) by {}; {:.0} % of it was watched",
            self.name,
            self.length_m,
            self.time_s,
            self.streets.join(", "),
            100.0 * self.known_share
        );
        if !self.avoided.is_empty() {
            text += &format!("; {} is blocked, and left out", self.avoided.join(", "));
        }
        if self.is_blocked {
            text += "; it leads through what is blocked: there is no other way";
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::point_m;
    use crate::streets::tests::block;
    use crate::wire::usage::{StretchUse, Usage, subject_of_stretch};
    use std::sync::Arc;

    /// The block of which the street through the middle was seen so.
    fn seen(stood_ds: u32, driven_m: u32) -> (Usages, Option<Hint>) {
        let streets = Arc::new(block());
        let network = Arc::new(streets.network());
        let middle = network.edges().iter().position(|e| e.length_m < 250.0);
        let stretch = u16::try_from(middle.unwrap()).unwrap();
        let mut usages = Usages::new(Arc::clone(&streets), network);
        let usage = Usage {
            streets: 1,
            stretches: vec![StretchUse {
                stretch,
                watched_m_s: 4_000,
                spent_ds: 1_000,
                stood_ds,
                driven_m,
                vehicles: 9,
            }],
            turns: Vec::new(),
        };
        usages.add(subject_of_stretch(1, stretch), &usage);
        let asked = &streets.asked[0];
        let hint = usages.hint(&asked.name, point_m(asked.from), point_m(asked.to));
        (usages, hint)
    }

    #[test]
    fn a_hint_goes_round_where_vehicles_stand_and_straight_on_where_they_drive() {
        let (_, hint) = seen(0, 900);
        let straight = hint.unwrap();
        assert!((straight.length_m - 200.0).abs() < 1e-6);
        assert_eq!(straight.streets, ["Middle"]);
        // As fast as they were seen to drive, and a little as usual.
        let mean_s = 200.0 * (100.0 + 10.0) / (900.0 + 80.0);
        assert!((straight.time_s - mean_s).abs() < 1e-6);
        let (low, high) = straight.range_s;
        assert!(low < mean_s && mean_s < high && straight.known_share > 0.99);
        let (_, hint) = seen(1_000, 20);
        let round = hint.unwrap();
        assert!((round.length_m - 400.0).abs() < 1e-6);
        assert_eq!(round.avoided, ["Middle"]);
        assert!(round.sentence().contains("Middle is blocked"));
        assert!(round.known_share.abs() < 1e-9 && !round.is_blocked);
    }

    #[test]
    fn a_blocked_street_is_driven_where_there_is_no_other_way() {
        let (usages, _) = seen(1_000, 20);
        let (from, to) = (Point::new(60.0, 100.0), Point::new(120.0, 100.0));
        let hint = usages.hint("inside", from, to).unwrap();
        assert!(hint.is_blocked && hint.sentence().contains("no other way"));
        assert!((hint.length_m - 60.0).abs() < 1e-6);
        let far = Point::new(5_000.0, 0.0);
        assert!(usages.hint("far", from, far).is_none());
        assert_eq!(usages.way(from, far), Err(NoWay::Far(End::Last)));
        let why = usages.way(far, to).unwrap_err().to_string();
        assert_eq!(
            why,
            "it would begin more than 150 m from the mission's streets"
        );
    }

    #[test]
    fn a_way_that_is_asked_for_has_its_line_and_how_far_off_it_begins() {
        let (usages, _) = seen(0, 900);
        let (from, to) = (Point::new(60.0, 103.0), Point::new(120.0, 100.0));
        let way = usages.way(from, to).unwrap();
        assert_eq!(way.line, [(60_000, 100_000), (120_000, 100_000)]);
        assert!((way.off_m.0 - 3.0).abs() < 1e-9 && way.off_m.1 < 1e-9);
        assert!((way.hint.length_m - 60.0).abs() < 1e-6);
    }
}
