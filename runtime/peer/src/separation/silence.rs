//! Who is near and answers nothing: believed down, or not heard for long, and sensed all the same
//! (D2.7 §1.3).
//!
//! Its computer may be dead; then its airframe flies what it had promised and circles for ever.
//! Or a partition is between the two, and it flies on by agreement with others, and takes this
//! UAV for one that is down. What it does tells: who lives and has something to do leaves its
//! circle.
//!
//! | what is sensed of it | what it counts as |
//! |---|---|
//! | it flies elsewhere than it promised, or is on its way still | one who lives and has not answered: nothing near it is agreed |
//! | it circles at the end of what it promised for a while | one who flies that for ever |
//! | it stays where a circle has room for more than a round, elsewhere than it promised | one who circles there, whichever way |
//!
//! # Guarantees
//! Of two who live, near each other and without a word, one stays on its circle as long as the
//! other flies: who circles leaves the circle only when it has seen the other circle since both
//! do, and the one with the higher number waits longer. Who flies already sees the other circle.

use crate::PeerId;
use crate::protocol::conflict::{Conflicts, Silent, Stay};
use skein_behaviors::traffic::Sighting;
use skein_flight::separation::Motion;
use skein_geometry::frame::Point;
use std::collections::{BTreeMap, VecDeque};

/// Who has circled for so long at the end of what it promised has nothing to do, or no computer,
/// milliseconds: who has, agrees on more before it ends.
const CIRCLES_MS: u64 = 5_000;

/// The same elsewhere than it promised, milliseconds: more than a round of the slowest.
const STAYS_MS: u64 = 15_000;

/// The one with the higher number waits longer by this, milliseconds: what the other has agreed
/// begins meanwhile, nine seconds later where its last offers were not answered, and is seen.
const AFTER_MS: u64 = 12_000;

/// Who was not sensed for so long is looked at anew, milliseconds.
const LOST_MS: u64 = 1_000;

/// What was sensed of one UAV.
#[derive(Clone, Debug, Default)]
struct Watched {
    /// Where it was, as long as it matters.
    places: VecDeque<(u64, Point)>,
    /// Since when it has been where it promised, milliseconds.
    fits_since_ms: Option<u64>,
}

/// All who are near.
#[derive(Clone, Debug, Default)]
pub(super) struct Silence {
    watched: BTreeMap<u16, Watched>,
}

impl Silence {
    /// Takes note of where others are, at a time; how far one who follows what it promised may
    /// be beside it, metres.
    pub fn sense(&mut self, seen: &[Sighting], known: &Conflicts, stray_m: f64, now_ms: u64) {
        for s in seen {
            let watched = self.watched.entry(s.id).or_default();
            let last_ms = watched.places.back().map_or(now_ms, |(ms, _)| *ms);
            if now_ms.saturating_sub(last_ms) > LOST_MS {
                *watched = Watched::default();
            }
            watched.places.push_back((now_ms, s.at()));
            let is_old = |ms: u64| now_ms.saturating_sub(ms) > STAYS_MS + 2 * AFTER_MS;
            while watched.places.front().is_some_and(|(ms, _)| is_old(*ms)) {
                watched.places.pop_front();
            }
            let flown = known.flown_by(PeerId(s.id));
            let off_m = flown.map(|m| (m.pose_at(now_ms).position() - s.at()).norm());
            watched.fits_since_ms = match off_m {
                Some(off_m) if off_m <= stray_m => Some(watched.fits_since_ms.unwrap_or(now_ms)),
                _ => None,
            };
        }
        let is_near = |w: &Watched| {
            let last = w.places.back();
            last.is_some_and(|(ms, _)| now_ms.saturating_sub(*ms) <= LOST_MS)
        };
        self.watched.retain(|_, w| is_near(w));
    }

    /// Whether one of them is where it promised to be.
    pub fn follows(&self, id: u16) -> bool {
        let watched = self.watched.get(&id);
        watched.is_some_and(|w| w.fits_since_ms.is_some())
    }

    /// Who of those who say nothing circles, seen by `me`, who has circled itself since a time if
    /// it does; circles are so wide, metres.
    pub fn silent(
        &self,
        (me, known): (u16, &Conflicts),
        says_nothing: impl Fn(u16) -> bool,
        (circles_since_ms, across_m): (Option<u64>, f64),
        now_ms: u64,
    ) -> Silent {
        let mut silent = Silent::default();
        for (id, watched) in self.watched.iter().filter(|(id, _)| says_nothing(**id)) {
            let both_ms =
                |since_ms: u64| now_ms.saturating_sub(since_ms.max(circles_since_ms.unwrap_or(0)));
            let waits_ms = match circles_since_ms {
                Some(_) if *id < me => AFTER_MS,
                _ => 0,
            };
            let peer = PeerId(*id);
            let promised = watched.fits_since_ms.zip(known.flown_by(peer));
            let promised = promised.filter(|(_, m)| m.loiter_per_m().is_some());
            if let Some((fits_ms, motion)) = promised {
                let since_ms = fits_ms.max(ends_ms(motion));
                if both_ms(since_ms) >= CIRCLES_MS + waits_ms {
                    silent.all.insert(peer);
                }
            } else if let Some((since_ms, stay)) = watched.stays(across_m)
                && both_ms(since_ms) >= STAYS_MS + waits_ms
            {
                silent.all.insert(peer);
                silent.elsewhere.insert(peer, stay);
            }
        }
        silent
    }
}

/// When the circle at the end of a motion begins, milliseconds.
pub(super) fn ends_ms(motion: &Motion) -> u64 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "far below 2^53 milliseconds"
    )]
    let ends_ms = (motion.ends_at_s() * 1e3).ceil() as u64;
    ends_ms
}

impl Watched {
    /// Since when it has been no farther from where it is than a circle is wide, and where.
    fn stays(&self, across_m: f64) -> Option<(u64, Stay)> {
        let (_, at) = *self.places.back()?;
        let near = self.places.iter().rev();
        let near = near.take_while(|(_, p)| (*p - at).norm() <= across_m);
        let (mut since_ms, mut low, mut high) = (0, at, at);
        for (ms, p) in near.clone() {
            since_ms = *ms;
            low = Point::new(low.x.min(p.x), low.y.min(p.y));
            high = Point::new(high.x.max(p.x), high.y.max(p.y));
        }
        let centre = low + 0.5 * (high - low);
        let radius_m = near.map(|(_, p)| (*p - centre).norm()).fold(0.0, f64::max);
        let stay = Stay {
            at,
            centre,
            radius_m,
        };
        Some((since_ms, stay))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::protocol::conflict::{Apart, Intent, PromisedPlan};
    use skein_flight::separation::{Detours, End, MotionPlan, Stretch};
    use skein_geometry::frame::Pose;

    const ACROSS_M: f64 = 60.0;
    const STRAY_M: f64 = 6.0;

    /// A straight way of some metres and a circle, from a place on.
    pub fn motion(north_m: f64, length_m: u32) -> Motion {
        let airspeed_mmps = 12_000;
        let way = Stretch {
            radius_mm: 0,
            length_mm: length_m * 1_000,
            airspeed_mmps,
        };
        let end = End::Loiter {
            radius_mm: 25_000,
            airspeed_mmps,
        };
        let plan = MotionPlan::on_ground(0, Pose::new(Point::new(0.0, north_m), 0.0));
        let stretches = vec![way];
        Motion::new(MotionPlan {
            stretches,
            end,
            ..plan
        })
        .unwrap()
    }

    pub fn knows(id: u16, said: &Motion) -> Conflicts {
        let airframe = crate::testing::airframe();
        let apart = Apart {
            detours: Detours {
                airframe,
                separation_m: 30.0,
            },
            tubes_m: STRAY_M,
            circle_radius_m: 25.0,
            reach: None,
        };
        let mut known = Conflicts::new(PeerId(5), 3_000, apart, motion(900.0, 10));
        let intent = Intent {
            number: 1,
            endurance_s: 3_000,
            in_force: PromisedPlan {
                version: 1,
                plan: said.plan().clone(),
            },
            proposal: None,
            accepts: Vec::new(),
        };
        let _ = known.hear(PeerId(id), &intent, 0);
        known
    }

    /// From when on a silent UAV of a number, which flies like this and said `said`, counts as
    /// one who circles, seen by the UAV 5, and whether where it promised.
    fn counts_from(
        id: u16,
        said: &Motion,
        flown: &Motion,
        mine_ms: Option<u64>,
    ) -> Option<(u64, bool)> {
        let known = knows(id, said);
        let mut silence = Silence::default();
        for now_ms in (0..60_000).step_by(200) {
            let at = flown.pose_at(now_ms).position();
            #[allow(clippy::cast_possible_truncation)]
            let dm = |m: f64| (m * 10.0).round() as i32;
            let seen = Sighting {
                id,
                east_dm: dm(at.x),
                north_dm: dm(at.y),
                height_dm: 450,
            };
            silence.sense(&[seen], &known, STRAY_M, now_ms);
            let mine_ms = mine_ms.filter(|ms| *ms <= now_ms);
            let silent = silence.silent((5, &known), |_| true, (mine_ms, ACROSS_M), now_ms);
            if silent.all.contains(&PeerId(id)) {
                return Some((now_ms, silent.elsewhere.is_empty()));
            }
        }
        None
    }

    #[test]
    fn who_circles_at_the_end_of_what_it_promised_flies_that_for_ever() {
        // It gets there after ten seconds.
        let said = motion(0.0, 120);
        assert_eq!(counts_from(9, &said, &said, Some(0)), Some((15_000, true)));
        assert_eq!(counts_from(2, &said, &said, Some(0)), Some((27_000, true)));
        // Who flies sees the other circle; who began to circle later waits from then on.
        assert_eq!(counts_from(2, &said, &said, None), Some((15_000, true)));
        assert_eq!(
            counts_from(2, &said, &said, Some(13_000)),
            Some((30_000, true))
        );
    }

    #[test]
    fn who_flies_on_elsewhere_lives() {
        let (said, flown) = (motion(0.0, 120), motion(0.0, 900));
        assert_eq!(counts_from(9, &said, &flown, Some(0)), None);
    }

    #[test]
    fn who_stays_elsewhere_than_it_promised_circles_there() {
        let (said, flown) = (motion(400.0, 10), motion(0.0, 10));
        let (at_ms, as_promised) = counts_from(9, &said, &flown, Some(0)).unwrap();
        assert!((15_000..17_000).contains(&at_ms) && !as_promised, "{at_ms}");
        let (later_ms, _) = counts_from(2, &said, &flown, Some(0)).unwrap();
        assert_eq!(later_ms, at_ms + AFTER_MS);
    }

    #[test]
    fn in_which_circle_it_was_seen_is_told_by_where_it_was() {
        let mut watched = Watched::default();
        let at = |deg: f64| {
            let (sin, cos) = deg.to_radians().sin_cos();
            Point::new(300.0 + 25.0 * cos, 25.0 * sin)
        };
        // It came from the west, and that is long ago.
        watched.places.push_back((0, Point::new(0.0, 0.0)));
        for (ms, deg) in (1_000..20_000).step_by(200).zip((0..).step_by(5)) {
            watched.places.push_back((ms, at(f64::from(deg))));
        }
        let (since_ms, stay) = watched.stays(ACROSS_M).unwrap();
        assert_eq!(since_ms, 1_000);
        assert!(
            (stay.centre - Point::new(300.0, 0.0)).norm() < 0.1,
            "{stay:?}"
        );
        assert!((stay.radius_m - 25.0).abs() < 0.1, "{stay:?}");
    }
}
