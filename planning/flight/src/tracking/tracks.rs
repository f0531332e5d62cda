//! The targets that one UAV sees: which detection is whose, what is a false alarm, what is
//! lost and found again (D2.7 §3.7).
//!
//! | state | event | next |
//! |---|---|---|
//! | – | a detection near no track | tentative |
//! | tentative | seen in [`CONFIRMED_HITS`] of [`LOOKS`] looks | confirmed |
//! | tentative | not seen in [`MISSED`] looks in which it should be | dropped |
//! | confirmed | out of sight, hidden, not recognised | confirmed, less and less sure |
//! | confirmed | seen in the grown gate | confirmed: found again, under its name; if it may have been farther away than [`AFRESH_M`], as if it was seen for the first time |
//! | confirmed | not seen in [`GONE`] looks in which it should be | dropped; a younger track near to where it may be is it, and gets its name |
//! | confirmed | less sure than [`LOST_M`] | dropped |
//!
//! At most [`MOST_TRACKS`] are kept; tentative ones make room, then that which was out of sight for
//! longest.

use super::estimate::{Detection, Estimate};
use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;

/// Looks by which a track is confirmed or dropped.
pub const LOOKS: u32 = 5;

/// So many hits among them make a track.
pub const CONFIRMED_HITS: u32 = 3;

/// So many misses among them end a tentative one.
pub const MISSED: u32 = 3;

/// So many misses in a row end a confirmed one: it is not where it is thought to be.
pub const GONE: u32 = 8;

/// Standard deviation of its place beyond which a target is lost, metres: what a camera at
/// 120 m sees to either side.
pub const LOST_M: f64 = 150.0;

/// Standard deviation of its place beyond which where a target is found tells nothing of how it got
/// there, metres: it may as well be another one, that came into view where the lost one could be.
pub const AFRESH_M: f64 = 15.0;

/// How fast a target may have gone where it was not expected, m/s.
const STRAYS_MPS: f64 = 40.0;

/// And how far at once, metres.
const STRAYS_M: f64 = 15.0;

/// Who was out of sight for so long makes room for who is seen, milliseconds.
const UNSEEN_MS: u64 = 2_000;

/// The most tracks of a UAV.
pub const MOST_TRACKS: usize = 48;

/// 99.9 % of detections of a target are no more surprising (chi-square of two).
const GATE: f64 = 13.82;

/// The name of a target: who saw it first, and its how-manieth that was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TargetName {
    /// The UAV that named it.
    pub author: u16,
    /// Its count.
    pub number: u32,
}

/// The last looks among those that are remembered.
const RECENT: u8 = (1 << LOOKS) - 1;

/// What a target looks like: a class of vehicle, as the detector tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Kind(pub u8);

/// A detection and what it looked like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sighting {
    /// Where.
    pub detection: Detection,
    /// What.
    pub kind: Kind,
}

/// A target, or what may be one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Track {
    /// Its name.
    pub name: TargetName,
    /// What it looks like.
    pub kind: Kind,
    /// Where it is, as its observer sees it.
    pub estimate: Estimate,
    /// When it was seen last, milliseconds.
    pub seen_ms: u64,
    /// When it was seen first, milliseconds.
    begun_ms: u64,
    /// Looks at where it should be, the latest in the lowest bit: 1 where it was seen.
    hits: u8,
    looks: u8,
    /// Whether it is more than a guess.
    pub confirmed: bool,
}

/// The tracks of one UAV.
#[derive(Clone, Debug)]
pub struct Tracks {
    author: u16,
    density_m2ps3: f64,
    next: u32,
    tracks: Vec<Track>,
}

impl Tracks {
    /// Those of a UAV that has seen nothing. Targets accelerate by white noise of a density of
    /// `density_m2ps3`, m²/s³.
    #[must_use]
    pub fn new(author: u16, density_m2ps3: f64) -> Self {
        Self {
            author,
            density_m2ps3,
            next: 1,
            tracks: Vec::new(),
        }
    }

    /// The same, with names that count from a number on: a UAV that has lived before named
    /// others.
    #[must_use]
    pub fn named_from(mut self, number: u32) -> Self {
        self.next = number;
        self
    }

    /// All tracks, tentative ones too.
    #[must_use]
    pub fn all(&self) -> &[Track] {
        &self.tracks
    }

    /// Those that are more than guesses.
    pub fn confirmed(&self) -> impl Iterator<Item = &Track> {
        self.tracks.iter().filter(|t| t.confirmed)
    }

    /// Calls a target by the name that another UAV gave it before, unless another of this
    /// UAV's is called so; says whether it is.
    pub fn rename(&mut self, from: TargetName, to: TargetName) -> bool {
        if self.tracks.iter().any(|t| t.name == to) {
            return false;
        }
        let found = self.tracks.iter_mut().find(|t| t.name == from);
        let is_found = found.is_some();
        if let Some(t) = found {
            t.name = to;
        }
        is_found
    }

    /// Gives a target a name that nobody has used: it was taken for another one.
    pub fn name_anew(&mut self, from: TargetName) -> TargetName {
        let name = self.fresh();
        if let Some(t) = self.tracks.iter_mut().find(|t| t.name == from) {
            t.name = name;
        }
        name
    }

    fn fresh(&mut self) -> TargetName {
        let name = TargetName {
            author: self.author,
            number: self.next,
        };
        self.next = self.next.wrapping_add(1);
        name
    }

    /// Takes in one look. `in_view` says of a place whether a target there would be seen.
    pub fn look(&mut self, now_ms: u64, sightings: &[Sighting], in_view: &dyn Fn(Point) -> bool) {
        for t in &mut self.tracks {
            t.estimate = t.estimate.at(now_ms, self.density_m2ps3);
        }
        let pairs = self.pairs(sightings);
        let mut hit = vec![false; self.tracks.len()];
        for (nth, of) in pairs.iter().enumerate() {
            let (Some(of), Some(sighting)) = (*of, sightings.get(nth)) else {
                continue;
            };
            let track = &mut self.tracks[of];
            if let Some(better) = track.seen(now_ms, &sighting.detection) {
                track.estimate = better;
                track.seen_ms = now_ms;
                hit[of] = true;
            }
        }
        for (t, was_hit) in self.tracks.iter_mut().zip(hit) {
            t.count(was_hit, in_view(t.estimate.position()));
        }
        self.bequeath();
        self.tracks.retain(Track::is_kept);
        for (sighting, of) in sightings.iter().zip(pairs) {
            if of.is_none() {
                self.begin(now_ms, sighting);
            }
        }
    }

    /// A confirmed track that ends gives its name to the nearest one that was begun since it was
    /// last seen, and may be what became of it.
    fn bequeath(&mut self) {
        let gone: Vec<usize> = (0..self.tracks.len())
            .filter(|i| self.tracks[*i].confirmed && self.tracks[*i].is_gone())
            .collect();
        for i in gone {
            let old = self.tracks[i];
            let apart_m = |t: &Track| (t.estimate.position() - old.estimate.position()).norm();
            let may_be = |t: &&mut Track| {
                let away_s = f64::from(t.age_ms(old.seen_ms)) / 1e3;
                t.kind == old.kind
                    && t.begun_ms > old.seen_ms
                    && t.name.author == self.author
                    && apart_m(t) <= STRAYS_M + STRAYS_MPS * away_s
            };
            let heirs = self.tracks.iter_mut().filter(may_be);
            if let Some(heir) = heirs.min_by(|a, b| apart_m(a).total_cmp(&apart_m(b))) {
                heir.name = old.name;
                heir.confirmed = true;
            }
        }
    }

    /// For each sighting the track whose it is: the least surprising pairs first.
    fn pairs(&self, sightings: &[Sighting]) -> Vec<Option<usize>> {
        let mut near: Vec<(f64, usize, usize)> = Vec::new();
        for (nth, s) in sightings.iter().enumerate() {
            for (of, t) in self.tracks.iter().enumerate() {
                let surprise = t.estimate.surprise(&s.detection);
                if t.kind == s.kind && surprise <= GATE {
                    // Among those that are equally near the surer one has the better claim.
                    near.push((surprise + 2.0 * t.sureness(), nth, of));
                }
            }
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut pairs = vec![None; sightings.len()];
        for (_, nth, of) in near {
            if pairs[nth].is_none() && !pairs.contains(&Some(of)) {
                pairs[nth] = Some(of);
            }
        }
        pairs
    }

    /// Which track makes room: the oldest guess, or else that which was out of sight for longest.
    fn least(&self, now_ms: u64) -> Option<usize> {
        let guess = self.tracks.iter().position(|t| !t.confirmed);
        let unseen = || {
            let all = self.tracks.iter().enumerate();
            let gone = all.filter(|(_, t)| t.seen_ms + UNSEEN_MS <= now_ms);
            gone.min_by_key(|(_, t)| t.seen_ms).map(|(i, _)| i)
        };
        guess.or_else(unseen)
    }

    /// Begins a track, if there is room or somebody makes it.
    fn begin(&mut self, now_ms: u64, sighting: &Sighting) {
        let estimate = Estimate::first(now_ms, &sighting.detection);
        if !estimate.is_sound() {
            return;
        }
        if self.tracks.len() >= MOST_TRACKS {
            let Some(least) = self.least(now_ms) else {
                return;
            };
            self.tracks.remove(least);
        }
        let name = self.fresh();
        self.tracks.push(Track {
            name,
            kind: sighting.kind,
            estimate,
            seen_ms: now_ms,
            begun_ms: now_ms,
            hits: 1,
            looks: 1,
            confirmed: false,
        });
    }
}

impl Track {
    /// When it was seen first, milliseconds.
    #[must_use]
    pub fn begun_ms(&self) -> u64 {
        self.begun_ms
    }

    /// From when it was seen first until it was seen last, milliseconds: false alarms seldom
    /// come to much.
    #[must_use]
    pub fn watched_ms(&self) -> u64 {
        self.seen_ms.saturating_sub(self.begun_ms)
    }

    /// Where it is with one more detection. How fast it must have been to come here from where it
    /// was seen last is no measurement of its speed where that is long ago.
    fn seen(&self, now_ms: u64, detection: &Detection) -> Option<Estimate> {
        if self.estimate.spread_m() > AFRESH_M {
            return Some(Estimate::first(now_ms, detection)).filter(Estimate::is_sound);
        }
        self.estimate.with(detection)
    }

    /// The logarithm of how large its spread is: the less the surer.
    fn sureness(&self) -> f64 {
        skein_geometry::math::ln(self.estimate.spread_m().max(f64::MIN_POSITIVE))
    }

    /// A look went by.
    fn count(&mut self, hit: bool, in_view: bool) {
        // Where it could not be seen, not to see it says nothing.
        if !hit && !in_view {
            return;
        }
        self.hits = self.hits << 1 | u8::from(hit);
        self.looks = self.looks << 1 | 1;
        self.confirmed |= (self.hits & RECENT).count_ones() >= CONFIRMED_HITS;
    }

    /// Whether it is not where it should be.
    fn is_gone(&self) -> bool {
        self.hits == 0 && self.looks.count_ones() >= GONE
    }

    fn age_ms(&self, since_ms: u64) -> u32 {
        u32::try_from(self.seen_ms.saturating_sub(since_ms)).unwrap_or(u32::MAX)
    }

    fn is_kept(&self) -> bool {
        if self.confirmed {
            return !self.is_gone() && self.estimate.spread_m() <= LOST_M;
        }
        let (hits, looks) = (self.hits & RECENT, self.looks & RECENT);
        let missed = looks.count_ones() - hits.count_ones();
        missed < MISSED && self.estimate.spread_m() <= LOST_M
    }
}

#[cfg(test)]
mod tests {
    use super::super::estimate::tests::{DENSITY, seen, wandered};
    use super::*;
    use nalgebra::{Matrix2, Vector4};
    use skein_geometry::frame::Vector;
    use skein_geometry::random::SplitMix64;

    const CAR: Kind = Kind(1);

    fn sighting(at: Point, random: &mut SplitMix64) -> Sighting {
        Sighting {
            detection: seen(at, Matrix2::identity() * 9.0, random),
            kind: CAR,
        }
    }

    fn everywhere(_: Point) -> bool {
        true
    }

    #[test]
    fn who_is_out_of_sight_makes_room_for_who_is_seen() {
        let mut random = SplitMix64::new(7);
        let mut tracks = Tracks::new(1, DENSITY);
        let most = u32::try_from(MOST_TRACKS).unwrap();
        let far = |i: u32| Point::new(100.0 * f64::from(i), 0.0);
        for look in 1..=5_u64 {
            let all: Vec<Sighting> = (0..most).map(|i| sighting(far(i), &mut random)).collect();
            tracks.look(200 * look, &all, &everywhere);
        }
        assert_eq!(tracks.confirmed().count(), MOST_TRACKS);
        let (next, nowhere) = (far(most), |_: Point| false);
        let sees = |tracks: &Tracks| {
            tracks
                .all()
                .iter()
                .any(|t| (t.estimate.position() - next).norm() < 20.0)
        };
        let new = [sighting(next, &mut random)];
        tracks.look(2_000, &new, &nowhere);
        assert!(!sees(&tracks), "all were seen a second ago");
        tracks.look(3_200, &new, &nowhere);
        assert!(sees(&tracks) && tracks.all().len() == MOST_TRACKS);
    }

    /// One after the other leaves the picture at one end, and others come in at the other one: each
    /// new one is where a lost one could be, and would seem to have come from there.
    #[test]
    fn who_comes_into_view_has_not_the_speed_at_which_a_lost_one_could_be_there() {
        let mut random = SplitMix64::new(11);
        let mut tracks = Tracks::new(1, DENSITY);
        let sees = |p: Point| p.x.abs() < 60.0;
        let mut highest_mps: f64 = 0.0;
        for look in 1..=600_u32 {
            let at_s = 0.2 * f64::from(look);
            let cars = (0..60).map(|i| Point::new(10.0 * at_s - 40.0 * f64::from(i), 0.0));
            let seen: Vec<Sighting> = cars
                .filter(|p| sees(*p))
                .map(|p| sighting(p, &mut random))
                .collect();
            tracks.look(200 * u64::from(look), &seen, &sees);
            let is_sure = |t: &&Track| {
                let c = t.estimate.covariance;
                t.seen_ms == 200 * u64::from(look) && c[(2, 2)] + c[(3, 3)] < 25.0
            };
            for t in tracks.confirmed().filter(is_sure) {
                let v = t.estimate.velocity_mps();
                highest_mps = highest_mps.max((v - Vector::new(10.0, 0.0)).norm());
            }
        }
        assert!(highest_mps < 11.0, "{highest_mps}");
    }

    #[test]
    fn two_cars_among_false_alarms_are_two_tracks() {
        let mut random = SplitMix64::new(3);
        let mut tracks = Tracks::new(7, DENSITY);
        let mut cars = [
            Vector4::new(0.0, 0.0, 10.0, 0.0),
            Vector4::new(200.0, 80.0, -8.0, 0.0),
        ];
        let mut most = 0;
        for k in 0..200_u64 {
            let mut seen = Vec::new();
            for car in &mut cars {
                *car = wandered(*car, 0.2, &mut random);
                if random.unit() < 0.9 {
                    seen.push(sighting(Point::new(car[0], car[1]), &mut random));
                }
            }
            if random.unit() < 0.2 {
                let at = Point::new(600.0 * random.unit(), 600.0 * random.unit());
                seen.push(sighting(at, &mut random));
            }
            tracks.look(k * 200, &seen, &everywhere);
            most = most.max(tracks.confirmed().count());
        }
        assert_eq!(most, 2);
        for car in cars {
            let at = Point::new(car[0], car[1]);
            let near = tracks
                .confirmed()
                .filter(|t| (t.estimate.position() - at).norm() < 10.0);
            assert_eq!(near.count(), 1);
        }
    }

    #[test]
    fn a_car_behind_a_house_is_found_again_under_its_name_and_lost_after_a_while() {
        let mut random = SplitMix64::new(9);
        let mut tracks = Tracks::new(7, DENSITY);
        let mut car = Vector4::new(0.0, 0.0, 6.0, 0.0);
        let mut name = None;
        for k in 0..150_u64 {
            car = wandered(car, 0.2, &mut random);
            let at = Point::new(car[0], car[1]);
            // Hidden for five seconds.
            let hidden = (60..85).contains(&k);
            let seen = if hidden {
                Vec::new()
            } else {
                vec![sighting(at, &mut random)]
            };
            tracks.look(k * 200, &seen, &|_| !hidden);
            if k == 50 {
                name = tracks.confirmed().next().map(|t| t.name);
            }
        }
        let names: Vec<TargetName> = tracks.confirmed().map(|t| t.name).collect();
        assert_eq!(names, vec![name.unwrap()]);
        // Nobody looks any more.
        tracks.look(120_000, &[], &|_| false);
        assert_eq!(tracks.all().len(), 0);
    }

    #[test]
    fn a_car_that_turns_off_keeps_its_name() {
        let mut random = SplitMix64::new(12);
        let mut tracks = Tracks::new(7, DENSITY);
        let mut names = Vec::new();
        for k in 0..80_u64 {
            // At once the other way: no filter of cars expects that.
            let t = 0.2 * f64::from(u32::try_from(k).unwrap());
            let x = if t < 6.0 { 15.0 * t } else { 180.0 - 15.0 * t };
            let seen = sighting(Point::new(x, 0.0), &mut random);
            tracks.look(k * 200, &[seen], &everywhere);
            if k > 70 {
                names.extend(tracks.confirmed().map(|t| t.name.number));
            }
        }
        assert_eq!(names, vec![1; 9]);
    }

    #[test]
    fn false_alarms_alone_make_no_target_and_never_more_than_there_is_room_for() {
        let mut random = SplitMix64::new(4);
        let mut tracks = Tracks::new(7, DENSITY);
        for k in 0..300_u64 {
            let alarms: Vec<Sighting> = (0..50)
                .map(|_| {
                    let at = Point::new(9e4 * random.unit(), 9e4 * random.unit());
                    sighting(at, &mut random)
                })
                .collect();
            tracks.look(k * 200, &alarms, &everywhere);
            assert!(tracks.all().len() <= MOST_TRACKS);
        }
        assert_eq!(tracks.confirmed().count(), 0);
    }

    #[test]
    fn a_lorry_is_no_car() {
        let mut random = SplitMix64::new(8);
        let mut tracks = Tracks::new(7, DENSITY);
        for k in 0..20_u64 {
            let car = sighting(Point::new(0.0, 0.0), &mut random);
            let lorry = Sighting {
                kind: Kind(2),
                ..sighting(Point::new(1.0, 0.0), &mut random)
            };
            tracks.look(k * 200, &[car, lorry], &everywhere);
        }
        assert_eq!(tracks.confirmed().count(), 2);
        let (a, b) = (tracks.all()[0].name, tracks.all()[1].name);
        assert!(!tracks.rename(b, a));
        assert_eq!(tracks.all()[1].name, b, "two targets have two names");
        let other = TargetName {
            author: 1,
            number: 1,
        };
        assert!(tracks.rename(b, other));
        assert_eq!(tracks.all()[1].name, other);
        let anew = tracks.name_anew(other);
        assert!(anew != other && anew != a && tracks.all()[1].name == anew);
    }
}
