//! What all UAVs know of the targets together (D2.7 §3.7).
//!
//! Each UAV tells its *own* estimates, made of its own detections alone, in registers: one a
//! target, of which the newest counts. So registers of all authors merge in any order, however
//! often they arrive, and nothing is counted twice by way of an estimate that already holds
//! another one.
//!
//! Estimates of several authors still have something in common: the target that swerved for
//! all of them. They are combined by covariance intersection (Julier and Uhlmann, "A
//! non-divergent estimation algorithm in the presence of unknown correlations", 1997), which
//! is consistent whatever they share; its weights are in closed form (Niehsen, "Information
//! fusion based on fast covariance intersection filtering", 2002), so that all compute alike.

use super::estimate::Estimate;
use super::follower::TargetMotion;
use super::tracks::{Kind, TargetName};
use nalgebra::{Matrix4, Vector4};
use serde::{Deserialize, Serialize};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{exp, seconds};
use std::collections::BTreeMap;

/// The most targets that one author tells of.
pub const MOST_OF_AUTHOR: usize = 8;

/// The most registers that are kept.
pub const MOST_REGISTERS: usize = 256;

/// Estimates of two authors that differ by less are of one target: 99 % of those that are
/// do (chi-square of four).
const SAME: f64 = 13.28;

/// Estimates under one name that differ by more than this are of two targets.
const ANOTHER: f64 = 4.0 * SAME;

/// The least spread of a place, m²: no estimate counts as if it were exact.
const LEAST_M2: f64 = 1e-4;

/// What one UAV says of one target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Register {
    /// Who says so.
    pub author: u16,
    /// Of which target.
    pub name: TargetName,
    /// What it looks like.
    pub kind: Kind,
    /// When it was seen last, milliseconds.
    pub seen_ms: u64,
    /// Where it is, with the observer's own error.
    pub estimate: Estimate,
}

/// The registers of all authors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Board {
    registers: BTreeMap<(TargetName, u16), Register>,
}

/// What all know of a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fused {
    /// Its name.
    pub name: TargetName,
    /// What it looks like, as the author of the least number says.
    pub kind: Kind,
    /// Where it is.
    pub estimate: Estimate,
    /// When anybody saw it last, milliseconds.
    pub seen_ms: u64,
    /// How many tell of it.
    pub authors: u32,
}

/// Who is out of sight goes on as it was for about so long, seconds: then it has turned off.
const ON_S: f64 = 8.0;

impl Fused {
    /// For how long nobody has seen it, seconds.
    #[must_use]
    pub fn unseen_s(&self, now_ms: u64) -> f64 {
        seconds(now_ms.saturating_sub(self.seen_ms))
    }

    /// Where it probably is: on its way, and less far on it the longer nobody saw it.
    #[must_use]
    pub fn expected(&self, now_ms: u64, density_m2ps3: f64) -> Point {
        let aged = self.estimate.at(now_ms, density_m2ps3);
        let unseen_s = self.unseen_s(now_ms);
        let on_s = ON_S * (1.0 - exp(-unseen_s / ON_S));
        aged.position() - aged.velocity_mps() * (unseen_s - on_s)
    }

    /// How it probably moves there: slower the longer nobody saw it.
    #[must_use]
    pub fn motion(&self, now_ms: u64, density_m2ps3: f64) -> TargetMotion {
        TargetMotion {
            position: self.expected(now_ms, density_m2ps3),
            velocity_mps: self.estimate.velocity_mps() * exp(-self.unseen_s(now_ms) / ON_S),
            acceleration_mps2: Vector::zeros(),
        }
    }
}

impl Board {
    /// Takes in a register, if it is newer than that of the same author and target; says
    /// whether it was. One that holds no numbers, or for which there is no room, is left out.
    pub fn put(&mut self, register: Register) -> bool {
        if !register.estimate.is_sound() {
            return false;
        }
        let key = (register.name, register.author);
        if let Some(old) = self.registers.get_mut(&key) {
            let newer = register.estimate.time_ms > old.estimate.time_ms;
            if newer {
                *old = register;
            }
            return newer;
        }
        let of_author = self.registers.keys().filter(|k| k.1 == register.author);
        if of_author.count() >= MOST_OF_AUTHOR || self.registers.len() >= MOST_REGISTERS {
            return false;
        }
        self.registers.insert(key, register);
        true
    }

    /// Takes in all that another board holds.
    pub fn merge(&mut self, other: &Self) {
        for r in other.registers.values() {
            self.put(*r);
        }
    }

    /// Forgets what was told before `since_ms`.
    pub fn forget(&mut self, since_ms: u64) {
        self.registers.retain(|_, r| r.estimate.time_ms >= since_ms);
    }

    /// All registers, by name and author.
    pub fn registers(&self) -> impl Iterator<Item = &Register> {
        self.registers.values()
    }

    /// What all know at a time, by name; targets accelerate by white noise of
    /// `density_m2ps3`, m²/s³.
    #[must_use]
    pub fn fused(&self, now_ms: u64, density_m2ps3: f64) -> Vec<Fused> {
        let mut all: Vec<Fused> = Vec::new();
        let mut group: Vec<&Register> = Vec::new();
        let mut registers = self.registers.values().peekable();
        while let Some(r) = registers.next() {
            group.push(r);
            if registers.peek().is_none_or(|next| next.name != r.name) {
                all.extend(fuse(&group, now_ms, density_m2ps3));
                group.clear();
            }
        }
        all
    }

    /// The name by which a UAV should call a target of its own, if others gave it one: the
    /// least of those whose estimates are its own's and of its kind.
    #[must_use]
    pub fn name_of(&self, own: &Register, density_m2ps3: f64) -> TargetName {
        let others = self.registers.values().filter(|r| r.author != own.author);
        let same =
            others.filter(|r| r.kind == own.kind && unlikeness(r, own, density_m2ps3) <= SAME);
        same.map(|r| r.name).fold(own.name, TargetName::min)
    }

    /// Whether an author of a lesser number tells of another place under a UAV's name for a
    /// target: two that met were taken for one. The UAV should name its own anew.
    #[must_use]
    pub fn is_contradicted(&self, own: &Register, density_m2ps3: f64) -> bool {
        let namesakes = self.registers.values().filter(|r| r.name == own.name);
        let mut lesser = namesakes.filter(|r| r.author < own.author);
        lesser.any(|r| unlikeness(r, own, density_m2ps3) > ANOTHER)
    }
}

/// How unlike two registers are, a square in standard deviations (chi-square of four).
fn unlikeness(a: &Register, b: &Register, density_m2ps3: f64) -> f64 {
    let now_ms = a.estimate.time_ms.max(b.estimate.time_ms);
    let (a, b) = (
        a.estimate.at(now_ms, density_m2ps3),
        b.estimate.at(now_ms, density_m2ps3),
    );
    let off = a.state - b.state;
    let inverse = (a.covariance + b.covariance).try_inverse();
    inverse.map_or(f64::INFINITY, |i| (off.transpose() * i * off)[0])
}

/// Covariance intersection of what several tell of one target.
fn fuse(group: &[&Register], now_ms: u64, density_m2ps3: f64) -> Option<Fused> {
    let first = group.first()?;
    let at_now: Vec<Estimate> = group
        .iter()
        .map(|r| r.estimate.at(now_ms, density_m2ps3))
        .collect();
    let sureness = |e: &Estimate| 1.0 / (e.covariance[(0, 0)] + e.covariance[(1, 1)]).max(LEAST_M2);
    let whole: f64 = at_now.iter().map(sureness).sum();
    let (mut information, mut weighted) = (Matrix4::zeros(), Vector4::zeros());
    for e in &at_now {
        let share = e.covariance.try_inverse()? * (sureness(e) / whole);
        information += share;
        weighted += share * e.state;
    }
    let covariance = information.try_inverse()?;
    Some(Fused {
        name: first.name,
        kind: first.kind,
        estimate: Estimate {
            time_ms: now_ms,
            state: covariance * weighted,
            covariance: (covariance + covariance.transpose()) / 2.0,
        },
        seen_ms: group.iter().map(|r| r.seen_ms).max()?,
        authors: u32::try_from(group.len()).unwrap_or(u32::MAX),
    })
}

#[cfg(test)]
mod tests {
    use super::super::estimate::tests::{DENSITY, seen, wandered};
    use super::*;
    use nalgebra::Matrix2;
    use proptest::prelude::*;
    use skein_geometry::frame::{Point, Vector};
    use skein_geometry::random::SplitMix64;

    const NAME: TargetName = TargetName {
        author: 1,
        number: 1,
    };

    fn register(author: u16, estimate: Estimate) -> Register {
        Register {
            author,
            name: NAME,
            kind: Kind(1),
            seen_ms: estimate.time_ms,
            estimate,
        }
    }

    /// What two UAVs of which each is displaced know together: mean NEES over runs.
    fn mean_nees(runs: u32, tells_errors: bool) -> f64 {
        let mut sum = 0.0;
        for run in 0..runs {
            let mut random = SplitMix64::new(u64::from(run) + 991);
            let mut truth = Vector4::new(0.0, 0.0, 9.0, -3.0);
            let bias = [0, 1, 2].map(|_| Vector::new(3.0 * random.normal(), 3.0 * random.normal()));
            let mut own: [Option<Estimate>; 3] = [None; 3];
            for k in 0..30_u64 {
                for (e, bias) in own.iter_mut().zip(bias) {
                    let at = Point::new(truth[0], truth[1]);
                    let mut d = seen(at, Matrix2::new(16.0, 3.0, 3.0, 8.0), &mut random);
                    d.at += bias;
                    *e = match e {
                        None => Some(Estimate::first(k * 500, &d)),
                        Some(e) => e.at(k * 500, DENSITY).with(&d),
                    };
                }
                if k < 29 {
                    truth = wandered(truth, 0.5, &mut random);
                }
            }
            let mut board = Board::default();
            for (author, e) in (1..).zip(own) {
                let told_m = if tells_errors { 3.0 } else { 0.0 };
                assert!(board.put(register(author, e.unwrap().told(told_m))));
            }
            let fused = board.fused(29 * 500, DENSITY);
            assert_eq!((fused.len(), fused[0].authors), (1, 3));
            let (p, v) = (
                Point::new(truth[0], truth[1]),
                Vector::new(truth[2], truth[3]),
            );
            sum += fused[0].estimate.normalised_error(p, v);
        }
        sum / f64::from(runs)
    }

    #[test]
    fn together_they_are_no_surer_than_they_may_be() {
        // The upper bound of chi-square(4), 99.9 % of means of 400; below it means cautious.
        let nees = mean_nees(400, true);
        assert!(nees < 4.0 + 3.3 * 0.1414 && nees > 1.0, "{nees}");
        assert!(mean_nees(60, false) > nees);
    }

    fn any_register() -> impl Strategy<Value = Register> {
        (1_u16..5, 1_u32..4, 0_u64..20, -50.0..50.0_f64).prop_map(|(author, number, time, x)| {
            let d = seen(
                Point::new(x, 0.0),
                Matrix2::identity(),
                &mut SplitMix64::new(time),
            );
            Register {
                name: TargetName { author: 1, number },
                ..register(author, Estimate::first(time, &d))
            }
        })
    }

    proptest! {
        /// Any order and any repetition of the same registers ends alike: per author and
        /// target the newest.
        #[test]
        fn boards_merge(all in prop::collection::vec(any_register(), 0..20), seed in any::<u64>()) {
            // What an author says at one time is one thing.
            let mut said: BTreeMap<(u16, u32, u64), Register> = BTreeMap::new();
            for r in all {
                said.entry((r.author, r.name.number, r.estimate.time_ms)).or_insert(r);
            }
            let mut list: Vec<Register> = said.into_values().collect();
            let (mut a, mut b) = (Board::default(), Board::default());
            for r in &list {
                a.put(*r);
            }
            SplitMix64::new(seed).shuffle(&mut list);
            let (left, right) = list.split_at(list.len() / 2);
            let mut half = Board::default();
            for r in right {
                half.put(*r);
            }
            for r in left.iter().chain(left) {
                b.put(*r);
            }
            b.merge(&half);
            b.merge(&half);
            prop_assert_eq!(&a, &b);
            prop_assert_eq!(a.fused(30, 1.0), b.fused(30, 1.0));
        }
    }

    #[test]
    fn who_tells_too_much_or_no_numbers_is_not_listened_to() {
        let d = seen(
            Point::new(0.0, 0.0),
            Matrix2::identity(),
            &mut SplitMix64::new(1),
        );
        let good = register(3, Estimate::first(5, &d));
        let mut board = Board::default();
        for number in 0..20 {
            let name = TargetName { author: 3, number };
            board.put(Register { name, ..good });
        }
        assert_eq!(board.registers().count(), MOST_OF_AUTHOR);
        let mut bad = register(4, Estimate::first(5, &d));
        bad.estimate.covariance[(0, 0)] = f64::NAN;
        assert!(!board.put(bad));
        bad.estimate.covariance[(0, 0)] = -1.0;
        assert!(!board.put(bad));
        board.forget(6);
        assert_eq!(board.registers().count(), 0);
    }

    #[test]
    fn of_two_names_of_one_target_the_least_wins() {
        let d = seen(
            Point::new(0.0, 0.0),
            Matrix2::identity(),
            &mut SplitMix64::new(1),
        );
        let theirs = register(1, Estimate::first(5, &d));
        let mut board = Board::default();
        board.put(theirs);
        let own = Register {
            name: TargetName {
                author: 9,
                number: 1,
            },
            ..register(9, Estimate::first(7, &d))
        };
        assert_eq!(board.name_of(&own, DENSITY), NAME);
        let mut far = own;
        far.estimate.state[0] = 500.0;
        assert_eq!(board.name_of(&far, DENSITY), far.name);
        // Under one name in two places: the greater number yields.
        let same_name = Register { name: NAME, ..far };
        assert!(board.is_contradicted(&same_name, DENSITY));
        assert!(!board.is_contradicted(&Register { name: NAME, ..own }, DENSITY));
        let lorry = Register {
            kind: Kind(2),
            ..own
        };
        assert_eq!(board.name_of(&lorry, DENSITY), lorry.name);
    }
}
