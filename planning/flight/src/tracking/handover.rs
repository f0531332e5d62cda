//! Who follows which target: a rule that all compute alike from what all have told (D2.7 §3.7).
//!
//! Bids are not sent. Each UAV tells where it is, what it follows and whether it sees it
//! ([`Watch`]); from that its bid for each target is the time that it would take to get there,
//! in whole milliseconds, and everybody knows everybody's. Pairs are made by the least bid,
//! one UAV for each target first, then a second for each, and so on; what a UAV already follows
//! counts as nearer by [`STAYS_MS`], so that two that are about as near do not change places.
//!
//! Hand-over is make before break: a UAV that sees its target goes on following it until
//! another one that was given the target says that it sees it. Who is not heard of is left out
//! by the caller, and so whatever it followed is given to others in the same moment.
//!
//! # Guarantees
//! The answer is a function of what was told. With as many UAVs as targets every target has
//! one that was given it. A target that somebody sees and follows is not let go of before
//! somebody else who was given it sees it.

use super::tracks::TargetName;
use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;
use std::collections::{BTreeMap, BTreeSet};

/// What a UAV follows counts as nearer by this, milliseconds.
pub const STAYS_MS: u64 = 8_000;

/// What a UAV says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Watch {
    /// Where it is.
    pub at: Point,
    /// How fast it can go there, m/s.
    pub airspeed_mps: f64,
    /// What it follows.
    pub follows: Option<TargetName>,
    /// Whether it sees that.
    pub sees: bool,
    /// Whether it is about to fly home: it is given nothing new.
    pub leaving: bool,
}

/// A target and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// Which.
    pub name: TargetName,
    /// Where.
    pub at: Point,
}

/// What each UAV follows now, and what it was given.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Assignment {
    /// What each follows now: what it was given, or what it has to keep until it is relieved.
    pub follows: BTreeMap<u16, TargetName>,
    /// What each was given.
    pub given: BTreeMap<u16, TargetName>,
}

/// Computes who follows what.
#[must_use]
pub fn assign(watches: &BTreeMap<u16, Watch>, targets: &[Wanted]) -> Assignment {
    let given = give(watches, targets);
    let wanted: BTreeSet<TargetName> = targets.iter().map(|t| t.name).collect();
    let relieved = |name: TargetName, but: u16| {
        given.iter().any(|(id, of)| {
            let sees = watches
                .get(id)
                .is_some_and(|w| w.sees && w.follows == Some(name));
            *id != but && *of == name && sees
        })
    };
    let mut follows = given.clone();
    for (id, w) in watches {
        let Some(name) = w.follows else { continue };
        let keeps = w.sees && wanted.contains(&name) && given.get(id) != Some(&name);
        if keeps && !relieved(name, *id) {
            follows.insert(*id, name);
        }
    }
    Assignment { follows, given }
}

/// Pairs by the least bid, a round of one UAV for each target after another.
fn give(watches: &BTreeMap<u16, Watch>, targets: &[Wanted]) -> BTreeMap<u16, TargetName> {
    let mut bids: Vec<(u64, TargetName, u16)> = Vec::new();
    for (id, w) in watches.iter().filter(|(_, w)| !w.leaving) {
        bids.extend(targets.iter().map(|t| (bid_ms(w, t), t.name, *id)));
    }
    bids.sort_unstable();
    let mut given = BTreeMap::new();
    let free = watches.values().filter(|w| !w.leaving).count();
    while given.len() < free && !targets.is_empty() {
        let mut served = BTreeSet::new();
        for (_, name, id) in &bids {
            if !given.contains_key(id) && served.insert(*name) {
                given.insert(*id, *name);
            }
        }
        if served.is_empty() {
            break;
        }
    }
    given
}

/// The time that a UAV takes to a target, milliseconds; one that is nowhere bids the most.
fn bid_ms(w: &Watch, t: &Wanted) -> u64 {
    let s = (t.at - w.at).norm() / w.airspeed_mps.max(1.0);
    if !s.is_finite() {
        return u64::MAX;
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "float to integer casts saturate"
    )]
    let ms = (s * 1e3).round() as u64;
    // Who follows and does not see may be anywhere; who sees has the target.
    let stays = w.follows == Some(t.name);
    if stays {
        ms.saturating_sub(STAYS_MS)
    } else {
        ms
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn name(number: u32) -> TargetName {
        TargetName { author: 1, number }
    }

    fn watch(x: f64, follows: Option<u32>, sees: bool) -> Watch {
        Watch {
            at: Point::new(x, 0.0),
            airspeed_mps: 20.0,
            follows: follows.map(name),
            sees,
            leaving: false,
        }
    }

    fn wanted(number: u32, x: f64) -> Wanted {
        Wanted {
            name: name(number),
            at: Point::new(x, 0.0),
        }
    }

    #[test]
    fn whoever_is_relieved_keeps_its_target_until_then() {
        let targets = [wanted(1, 0.0)];
        let home = Watch {
            leaving: true,
            ..watch(0.0, Some(1), true)
        };
        let mut watches = BTreeMap::from([(1, home), (2, watch(900.0, None, false))]);
        let a = assign(&watches, &targets);
        assert_eq!(a.given, BTreeMap::from([(2, name(1))]));
        assert_eq!(a.follows, BTreeMap::from([(1, name(1)), (2, name(1))]));
        // It is on its way, and then it sees it.
        watches.insert(2, watch(300.0, Some(1), false));
        assert_eq!(assign(&watches, &targets).follows.len(), 2);
        watches.insert(2, watch(100.0, Some(1), true));
        let after = assign(&watches, &targets);
        assert_eq!(after.follows, BTreeMap::from([(2, name(1))]));
    }

    #[test]
    fn what_a_dead_uav_followed_is_taken_over_at_once() {
        let targets = [wanted(1, 0.0), wanted(2, 500.0)];
        let mut watches = BTreeMap::from([
            (1, watch(10.0, Some(1), true)),
            (2, watch(510.0, Some(2), true)),
            (3, watch(480.0, Some(2), true)),
        ]);
        let before = assign(&watches, &targets);
        assert_eq!(before.follows[&1], name(1));
        watches.remove(&1);
        let after = assign(&watches, &targets);
        let with_first = after.follows.values().filter(|n| **n == name(1)).count();
        assert_eq!((with_first, after.follows.len()), (1, 2));
    }

    #[test]
    fn two_about_as_near_do_not_change_places() {
        let targets = [wanted(1, 0.0), wanted(2, 100.0)];
        let watches = BTreeMap::from([
            (1, watch(60.0, Some(1), true)),
            (2, watch(40.0, Some(2), true)),
        ]);
        let a = assign(&watches, &targets);
        assert_eq!(a.follows, BTreeMap::from([(1, name(1)), (2, name(2))]));
    }

    #[test]
    fn nobody_and_nothing() {
        assert_eq!(
            assign(&BTreeMap::new(), &[wanted(1, 0.0)]),
            Assignment::default()
        );
        let one = BTreeMap::from([(1, watch(0.0, Some(4), true))]);
        assert_eq!(assign(&one, &[]), Assignment::default());
        let lost = BTreeMap::from([(1, watch(f64::NAN, None, false))]);
        assert_eq!(assign(&lost, &[wanted(1, 0.0)]).follows.len(), 1);
    }

    fn any_watch() -> impl Strategy<Value = Watch> {
        (
            -3e3..3e3_f64,
            prop::option::of(0_u32..5),
            any::<bool>(),
            0_u8..6,
        )
            .prop_map(|(x, follows, sees, leaving)| Watch {
                leaving: leaving == 0,
                ..watch(x, follows, sees && follows.is_some())
            })
    }

    proptest! {
        #[test]
        fn everybody_has_a_target_and_every_target_somebody(
            list in prop::collection::vec(any_watch(), 0..21), xs in prop::collection::vec(-3e3..3e3_f64, 0..6),
        ) {
            let watches: BTreeMap<u16, Watch> = (1..).zip(list).collect();
            let targets: Vec<Wanted> = (0..).zip(&xs).map(|(n, x)| wanted(n, *x)).collect();
            let a = assign(&watches, &targets);
            let free: Vec<u16> = watches.iter().filter(|(_, w)| !w.leaving).map(|(id, _)| *id).collect();
            let mut count = BTreeMap::new();
            for name in a.given.values() {
                *count.entry(*name).or_insert(0_usize) += 1;
            }
            if targets.is_empty() {
                prop_assert!(a.given.is_empty());
            } else {
                prop_assert_eq!(a.given.keys().copied().collect::<Vec<_>>(), free.clone());
                // Shares differ by one at most.
                for t in &targets {
                    let n = count.get(&t.name).copied().unwrap_or(0);
                    prop_assert!(n >= free.len() / targets.len());
                    prop_assert!(n <= free.len().div_ceil(targets.len()));
                }
            }
            // Nobody lets go of what it sees before another one that was given it sees it.
            for (id, w) in &watches {
                let Some(held) = w.follows.filter(|n| w.sees && targets.iter().any(|t| t.name == *n)) else {
                    continue;
                };
                let lets_go = a.follows.get(id) != Some(&held);
                let others = watches.iter().any(|(o, v)| {
                    o != id && v.sees && v.follows == Some(held) && a.given.get(o) == Some(&held)
                });
                prop_assert!(!lets_go || others);
            }
        }

        /// Decisions that all carry out come to rest.
        #[test]
        fn decisions_stand(
            list in prop::collection::vec(any_watch(), 1..12), xs in prop::collection::vec(-3e3..3e3_f64, 1..6),
        ) {
            let mut watches: BTreeMap<u16, Watch> = (1..).zip(list).collect();
            watches.values_mut().for_each(|w| w.leaving = false);
            let targets: Vec<Wanted> = (0..).zip(&xs).map(|(n, x)| wanted(n, *x)).collect();
            let mut decided = assign(&watches, &targets);
            let mut changes = 0;
            // Two that would have to swap what they see both keep it: that is at rest too.
            for _ in 0..10 {
                for (id, w) in &mut watches {
                    w.follows = decided.follows.get(id).copied();
                    w.sees = true;
                }
                let again = assign(&watches, &targets);
                changes += u32::from(again.follows != decided.follows);
                decided = again;
            }
            prop_assert!(changes <= 4, "{changes} changes");
            prop_assert_eq!(&assign(&watches, &targets).follows, &decided.follows);
        }
    }
}
