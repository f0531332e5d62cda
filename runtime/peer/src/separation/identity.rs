//! Who is who of those that are sensed (D2.7 §1.3): by what they fly, before by the number that
//! their airframes show.
//!
//! A configuration that was copied to another UAV has that one speak under a number that its
//! airframe does not show, and the one that shows it says nothing. By the number alone whoever
//! senses the first waits for the word of somebody who never says any, and takes the word of the
//! first for that of the second, which circles somewhere else.
//!
//! | what is sensed | whom it counts as |
//! |---|---|
//! | one that flies what its number promised, or what nobody did | its number |
//! | one that flies what another number promised, which is sensed nowhere that it promised to be | that other number, until one of the two is seen to be who it shows |
//! | one that flies for a while what its number did not promise, though that promised something | one who said nothing, until it flies what its number promised |

use crate::PeerId;
use crate::protocol::conflict::Conflicts;
use skein_behaviors::traffic::{Sighting, Traffic};
use std::collections::BTreeMap;

/// Who flies for so long what its number did not promise, as far as is known, is somebody else,
/// milliseconds: all say every five seconds what they fly.
const ELSEWHERE_MS: u64 = 6_000;

/// Most numbers of whom it is known that another one shows them: as many as are sensed at once,
/// and more.
const KNOWN_MAX: usize = 32;

/// What is known of who shows whose number.
#[derive(Clone, Debug, Default)]
pub(super) struct Identity {
    /// By the number shown the one under which that UAV speaks.
    speaks_as: BTreeMap<u16, u16>,
    /// Since when a UAV does not fly what its number promised, milliseconds.
    elsewhere_since_ms: BTreeMap<u16, u64>,
    /// By the number shown one that nobody has, of who does not speak under the number shown.
    strangers: BTreeMap<u16, u16>,
}

impl Identity {
    /// Those who are sensed at a time, each under the number under which it speaks. One who flies
    /// what it promised is no farther from that than `stray_m`, metres.
    pub fn of(
        &mut self,
        traffic: &Traffic,
        known: &Conflicts,
        (stray_m, now_ms): (f64, u64),
    ) -> Vec<Sighting> {
        let flies = |id: u16, s: &Sighting| {
            let off_m = |pose: skein_geometry::frame::Pose| (pose.position() - s.at()).norm();
            known
                .may_fly(PeerId(id))
                .any(|m| off_m(m.pose_at(now_ms)) <= stray_m)
        };
        let mut seen: Vec<Sighting> = traffic.seen().copied().collect();
        let is_seen = |id: u16| seen.iter().any(|s| s.id == id);
        self.elsewhere_since_ms.retain(|id, _| is_seen(*id));
        self.strangers.retain(|id, _| is_seen(*id));
        let is_itself: Vec<bool> = seen.iter().map(|s| flies(s.id, s)).collect();
        for (s, is_itself) in seen.iter().zip(&is_itself) {
            if *is_itself {
                self.elsewhere_since_ms.remove(&s.id);
                self.speaks_as
                    .retain(|shows, speaks| *shows != s.id && *speaks != s.id);
            } else if known.knows(PeerId(s.id)) {
                self.elsewhere_since_ms.entry(s.id).or_insert(now_ms);
            }
        }
        let is_found = |id: u16| seen.iter().zip(&is_itself).any(|(s, is)| *is && s.id == id);
        for (s, _) in seen.iter().zip(&is_itself).filter(|(_, is)| !**is) {
            let is_other = |id: &PeerId| id.0 != s.id && flies(id.0, s) && !is_found(id.0);
            if self.speaks_as.len() < KNOWN_MAX
                && let Some(id) = known.speakers().find(is_other)
            {
                self.speaks_as.insert(s.id, id.0);
            }
        }
        let numbers: Vec<u16> = seen
            .iter()
            .map(|s| self.number(s.id, &seen, known, now_ms))
            .collect();
        for (s, number) in seen.iter_mut().zip(numbers) {
            s.id = number;
        }
        seen
    }

    /// Under which number one counts that shows this one.
    fn number(&mut self, shows: u16, seen: &[Sighting], known: &Conflicts, now_ms: u64) -> u16 {
        if let Some(speaks) = self.speaks_as.get(&shows) {
            return *speaks;
        }
        let elsewhere = self.elsewhere_since_ms.get(&shows);
        let for_long = elsewhere.is_some_and(|t| now_ms.saturating_sub(*t) >= ELSEWHERE_MS);
        if !for_long && self.speaks_as.values().all(|id| *id != shows) {
            self.strangers.remove(&shows);
            return shows;
        }
        let has_it =
            |number: u16| known.knows(PeerId(number)) || seen.iter().any(|s| s.id == number);
        let before = self.strangers.get(&shows).copied().filter(|n| !has_it(*n));
        let others = || {
            self.strangers
                .iter()
                .filter(|(id, _)| **id != shows)
                .map(|(_, n)| *n)
        };
        let free = || {
            (0..=u16::MAX)
                .rev()
                .find(|n| !has_it(*n) && others().all(|o| o != *n))
        };
        let number = before.or_else(free).unwrap_or(shows);
        self.strangers.insert(shows, number);
        number
    }

    /// The number that is shown by one that counts under this one, for a person.
    pub fn shown(&self, number: u16) -> u16 {
        let stranger = self.strangers.iter().find(|(_, n)| **n == number);
        stranger.map_or(number, |(shows, _)| *shows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::separation::silence::tests::{knows, motion};

    const STRAY_M: f64 = 6.0;

    fn sighting(id: u16, east_m: f64, north_m: f64) -> Sighting {
        #[allow(clippy::cast_possible_truncation, reason = "some metres")]
        let dm = |m: f64| (m * 10.0) as i32;
        Sighting {
            id,
            east_dm: dm(east_m),
            north_dm: dm(north_m),
            height_dm: 0,
        }
    }

    /// Who is found to be whom at a time, of those that show these numbers there, where 3 promised
    /// to fly the first 600 m to the east, 12 m a second.
    fn found(identity: &mut Identity, at_ms: u64, seen: &[(u16, f64, f64)]) -> Vec<u16> {
        let known = knows(3, &motion(0.0, 600));
        let seen = seen.iter().map(|(id, e, n)| sighting(*id, *e, *n));
        let traffic = Traffic::new(3_000.0, seen);
        let found = identity.of(&traffic, &known, (STRAY_M, at_ms));
        found.iter().map(|s| s.id).collect()
    }

    #[test]
    fn who_speaks_under_a_number_is_known_by_where_it_is() {
        let once = |seen: &[_]| found(&mut Identity::default(), 10_000, seen);
        assert_eq!(once(&[(3, 120.0, 0.0), (6, 400.0, 90.0)]), [3, 6]);
        // It shows another number than it speaks under.
        assert_eq!(once(&[(6, 121.0, 2.0), (7, 400.0, 90.0)]), [3, 7]);
        // And the one that shows its number is silent somewhere else.
        let stranger = u16::MAX;
        assert_eq!(once(&[(3, 400.0, 90.0), (6, 120.0, 0.0)]), [stranger, 3]);
        assert_eq!(once(&[(6, 120.0, 0.0), (3, 400.0, 90.0)]), [3, stranger]);
        // Nobody is where it promised to be.
        assert_eq!(once(&[(3, 400.0, 90.0), (6, 300.0, 0.0)]), [3, 6]);
    }

    #[test]
    fn what_was_found_stays_until_one_is_seen_to_be_who_it_shows() {
        let mut identity = Identity::default();
        let both = [(6, 120.0, 0.0), (3, 400.0, 90.0)];
        let stranger = u16::MAX;
        assert_eq!(found(&mut identity, 10_000, &both), [3, stranger]);
        assert_eq!((identity.shown(stranger), identity.shown(3)), (3, 3));
        let taken = [(6, 120.0, 0.0), (3, 400.0, 90.0), (u16::MAX, 900.0, 0.0)];
        let other = u16::MAX - 1;
        assert_eq!(found(&mut identity, 11_000, &taken), [3, other, u16::MAX]);
        // What it flies now was not heard. The number given stays.
        let later = [(6, 150.0, 40.0), (3, 400.0, 90.0)];
        assert_eq!(found(&mut identity, 15_000, &later), [3, other]);
        assert_eq!(found(&mut identity, 16_000, &later[1..]), [other]);
        // Now the one that shows the number is where that promised to be.
        let itself = [(6, 150.0, 40.0), (3, 240.0, 0.0)];
        assert_eq!(found(&mut identity, 20_000, &itself), [6, 3]);
    }

    #[test]
    fn who_is_elsewhere_than_its_number_promised_for_long_says_nothing() {
        let mut identity = Identity::default();
        let elsewhere = [(3, 400.0, 90.0), (8, 10.0, 10.0)];
        assert_eq!(found(&mut identity, 10_000, &elsewhere), [3, 8]);
        assert_eq!(found(&mut identity, 15_900, &elsewhere), [3, 8]);
        assert_eq!(found(&mut identity, 16_000, &elsewhere), [u16::MAX, 8]);
        assert_eq!(found(&mut identity, 20_000, &[(3, 240.0, 0.0)]), [3]);
        // Of who was out of sight nothing is known.
        assert_eq!(found(&mut identity, 30_000, &[]), [0; 0]);
        assert_eq!(found(&mut identity, 40_000, &elsewhere), [3, 8]);
    }
}
