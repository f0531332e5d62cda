//! Counts of one peer and of several, on looks made by hand.

use super::*;
use crate::buildings::{Building, Buildings};
use crate::mission::mm;
use crate::testing::mission;
use skein_flight::tracking::estimate::Detection;
use skein_flight::tracking::tracks::{Kind, Sighting};
use skein_geometry::frame::Vector;

const CAR: Kind = Kind(1);

/// A UAV that stands in the air over a place, and sees what drives below without errors.
struct Scene {
    counting: Counting,
    tracks: Tracks,
    mission: Mission,
    at: Point,
    now_ms: u64,
}

fn site(what: Counted) -> CountSite {
    CountSite {
        name: "north".to_owned(),
        what,
        ring: vec![
            (-15_000, -15_000),
            (15_000, -15_000),
            (15_000, 15_000),
            (-15_000, 15_000),
        ],
        capacity: 4 * u16::from(what == Counted::Standing),
    }
}

fn airframe() -> Airframe {
    crate::testing::airframe()
}

impl Scene {
    fn new(what: Counted) -> Self {
        let mut mission = mission(1, 4, 4);
        mission.counts = vec![site(what)];
        let mut counting = Counting::new(7);
        counting.begin_life(1);
        Self {
            counting,
            tracks: Tracks::new(7, 5.0),
            mission,
            at: Point::origin(),
            now_ms: 1_000,
        }
    }

    /// Looks for some seconds; vehicles are where they are at each second.
    fn look(&mut self, for_s: f64, vehicles: &dyn Fn(f64) -> Vec<Point>) {
        let looks = (for_s * 5.0).round() as u32;
        for _ in 0..looks {
            self.now_ms += 200;
            let in_view = |p: Point| (p - self.at).norm() < 40.0;
            let seen = vehicles(seconds(self.now_ms))
                .into_iter()
                .filter(|p| in_view(*p));
            let seen = seen.map(|p| Sighting {
                detection: Detection::round(p, 1.0),
                kind: CAR,
            });
            let seen: Vec<Sighting> = seen.collect();
            self.tracks.look(self.now_ms, &seen, &in_view);
            let sighted = seen.iter().map(|s| Sighted {
                east_mm: mm(s.detection.at.x),
                north_mm: mm(s.detection.at.y),
                spread_mm: 1_000,
                kind: CAR.0,
            });
            let percept = Percept {
                time_ms: self.now_ms,
                pose: Pose::new(self.at, 0.0),
                height_m: 60.0,
                airspeed_mps: 13.0,
                wind_east_mps: 0.0,
                wind_north_mps: 0.0,
                wind_unknown: false,
                contour: skein_behaviors::contour::ContourLook::default(),
                crowd: skein_behaviors::crowd::CrowdLook::default(),
                attitude: None,
                endurance_s: 3_000.0,
                takes_off_in_ms: 0,
                launch_ready: false,
                failsafe: false,
                circles_per_m: None,
                circles_in_ms: 0,
                traffic: skein_behaviors::traffic::Traffic::default(),
                obstacles: skein_behaviors::obstacle::Obstacles::default(),
                sightings: skein_behaviors::sightings::Sightings::new(sighted),
            };
            let town = self.mission.town();
            let of = (&self.mission, town.as_deref(), true);
            self.counting.look(&percept, &airframe(), &self.tracks, of);
        }
    }

    fn own(&self) -> Count {
        self.counting.own(self.now_ms).next().unwrap().1
    }
}

/// Drives along a street through the site at 8 m/s from 40 m before it, from a second on.
fn drives(from_s: f64) -> impl Fn(f64) -> Point {
    move |s| Point::new(-40.0 + 8.0 * (s - from_s), 2.0)
}

#[test]
fn who_drives_in_passes_once_with_its_speed_and_who_was_there_does_not() {
    let mut scene = Scene::new(Counted::Passing);
    let (first, second) = (drives(1.0), drives(5.0));
    let parked = Point::new(8.0, -9.0);
    scene.look(14.0, &|s| vec![first(s), second(s), parked]);
    let own = scene.own();
    assert_eq!(own.passed, 2, "{own:?}");
    assert!((13_000..=14_000).contains(&own.watched_ms), "{own:?}");
    // Each of both takes 30 m at 8 m/s; the third stands there all the time.
    let mut sum = SiteCount::default();
    sum.add(7, &own);
    assert!((48..75).contains(&(own.driven_dm / 10)), "{own:?}");
    let driven_s = seconds(own.spent_ms) - 13.0;
    assert!((6.0..9.0).contains(&driven_s), "{own:?}");
    assert!((sum.volume_per_h().unwrap() - 522.0).abs() < 0.5);
    let (low, high) = sum.volume_range_per_h().unwrap();
    assert!(low < 150.0 && high > 1_500.0, "{low} {high}");
}

#[test]
fn who_drove_in_before_the_site_was_watched_or_while_another_counts_does_not_count() {
    let mut scene = Scene::new(Counted::Passing);
    let car = drives(1.0);
    // The picture does not hold all of the site until the car is in it.
    scene.at = Point::new(-30.0, 0.0);
    scene.look(4.2, &|s| vec![car(s)]);
    scene.at = Point::origin();
    scene.look(6.0, &|s| vec![car(s)]);
    assert_eq!(scene.own().passed, 0);
    assert!(scene.own().watched_ms >= 5_000);

    let mut scene = Scene::new(Counted::Passing);
    let near = [(Pose::new(Point::new(8.0, 0.0), 0.0), 200)];
    scene.look(0.2, &|_| Vec::new());
    let others = flown_on(&near, 1_000, &airframe());
    scene.counting.heed(others);
    scene.look(8.0, &|s| vec![car(s)]);
    assert_eq!(
        scene.own(),
        Count {
            sites: scene.own().sites,
            ..Count::default()
        }
    );
    // A house stands between that one and a corner, so that one counts nothing either.
    let house = Building {
        roof_dm: 500,
        ring: vec![(110, 70), (140, 70), (140, 80), (110, 80)],
    };
    let told = Buildings { all: vec![house] };
    scene.mission.buildings = Some(std::sync::Arc::new(told));
    let beside = drives(9.2);
    scene.look(8.0, &|s| vec![beside(s)]);
    assert_eq!(scene.own().passed, 1);
    scene.mission.buildings = None;
    // Of whom nothing was heard any more that one counts no longer.
    let others = flown_on(&[(near[0].0, 3_100)], 1_000, &airframe());
    scene.counting.heed(others);
    let car = drives(17.2);
    scene.look(8.0, &|s| vec![car(s)]);
    assert_eq!(scene.own().passed, 2);
}

#[test]
fn who_stands_is_counted_at_the_last_look_and_who_drives_by_is_not() {
    let mut scene = Scene::new(Counted::Standing);
    let lot = |n: u32| (0..n).map(|i| Point::new(-9.0 + 6.0 * f64::from(i), 4.0));
    let car = drives(1.0);
    scene.look(7.0, &|s| lot(3).chain([car(s)]).collect());
    let own = scene.own();
    assert_eq!((own.standing, own.passed), (3, 0), "{own:?}");
    assert_eq!(own.seen_ms, scene.now_ms);
    scene.at = Point::new(80.0, 0.0);
    scene.look(30.0, &|_| lot(1).collect());
    assert_eq!(scene.own().standing, 3);
    scene.at = Point::origin();
    scene.look(5.0, &|_| lot(1).collect());
    assert_eq!(scene.own().standing, 1);
    let told = scene.counting.tell(Time(900_000), 1_000);
    assert_eq!(told.len(), 1);
    let sum = scene.counting.sums(&scene.mission)[0];
    let text = sum.sentence(&scene.mission.counts[0]);
    assert!(
        text.starts_with("north: 1 of 4 (25 %) stood there"),
        "{text}"
    );
}

/// In a dense lot those who stand are taken for each other, and then for ones that drive.
/// Eight seconds after a vehicle was lost some forty metres away it may be anywhere in the picture,
/// and whatever is seen there is taken for it.
#[test]
fn who_was_lost_outside_and_is_taken_to_be_inside_did_not_drive_in() {
    let mut scene = Scene::new(Counted::Passing);
    let parked = Point::new(38.0, 0.0);
    scene.look(3.0, &|_| vec![parked]);
    scene.at = Point::new(-6.0, 0.0);
    scene.look(8.0, &|_| vec![parked]);
    let name = scene.tracks.confirmed().next().unwrap().name;
    let false_alarm = Point::new(12.0, 0.0);
    scene.look(0.2, &|_| vec![false_alarm]);
    let taken = scene.tracks.confirmed().next().unwrap();
    assert_eq!((taken.name, taken.seen_ms), (name, scene.now_ms));
    assert_eq!(scene.own().passed, 0);
    // Neither did one that stands there, however long it is looked at.
    scene.look(3.0, &|_| vec![false_alarm]);
    let own = scene.own();
    assert_eq!(own.passed, 0);
    assert!(own.watched_ms >= 11_000 && own.spent_ms > 0, "{own:?}");
}

#[test]
fn where_more_are_seen_than_stand_and_one_that_drives_by_nothing_is_counted() {
    let mut scene = Scene::new(Counted::Standing);
    let round = |s: f64, turn: f64| {
        let angle_rad = 0.6 * s + turn;
        Point::new(12.0 * angle_rad.cos(), 12.0 * angle_rad.sin())
    };
    let stands = Point::origin();
    for (for_s, drive, standing) in [(5.0, 1, 1), (9.0, 0, 1), (9.0, 2, 1)] {
        let begun_ms = scene.now_ms;
        scene.look(for_s, &|s| {
            let turns = (0..drive).map(|i| 3.0 * f64::from(i));
            turns.map(|t| round(s, t)).chain([stands]).collect()
        });
        let own = scene.own();
        assert_eq!(own.standing, standing, "{drive} drive: {own:?}");
        let counted_after_ms = own.seen_ms.saturating_sub(begun_ms);
        assert_eq!(
            counted_after_ms > 3_000,
            drive < 2,
            "{drive} drive: {own:?}"
        );
    }
}

#[test]
fn counts_of_all_authors_and_lives_are_added_in_any_order_and_those_of_other_sites_are_not() {
    let scene = Scene::new(Counted::Passing);
    let sites = scene.mission.sites_hash();
    let count = |passed: u32, watched_ms: u64, sites: u32| Count {
        sites,
        passed,
        watched_ms,
        ..Count::default()
    };
    let told = [
        ((3, 1), count(2, 10_000, sites)),
        ((3, 1), count(5, 30_000, sites)),
        ((3, 2), count(1, 5_000, sites)),
        ((4, 1), count(4, 20_000, sites)),
        ((5, 1), count(9, 90_000, sites ^ 1)),
        // An earlier life of this peer's own counts, this life is known here.
        ((7, 0), count(1, 2_000, sites)),
        ((7, 1), count(8, 80_000, sites)),
    ];
    for turn in 0..told.len() {
        let mut counting = Counting::new(7);
        counting.begin_life(1);
        let (early, late) = told.split_at(turn);
        for (by, count) in late.iter().chain(early) {
            counting.hear(*by, 0, count);
        }
        let sum = counting.sums(&scene.mission)[0];
        assert_eq!((sum.passed, sum.watched_ms), (11, 57_000), "{turn}");
    }
}

#[test]
fn a_count_is_told_when_its_site_is_out_of_the_picture_and_every_ten_intervals_before() {
    let mut scene = Scene::new(Counted::Passing);
    scene.look(4.0, &|_| Vec::new());
    assert!(scene.counting.tell(Time(5_000), 1_000).is_empty());
    assert_eq!(scene.counting.tell(Time(10_000), 1_000).len(), 1);
    scene.look(4.0, &|_| Vec::new());
    assert!(scene.counting.tell(Time(14_000), 1_000).is_empty());
    scene.at += Vector::new(200.0, 0.0);
    scene.look(0.2, &|_| Vec::new());
    assert_eq!(scene.counting.tell(Time(15_000), 1_000).len(), 1);
    assert!(scene.counting.tell(Time(60_000), 1_000).is_empty());
}

#[test]
fn the_interval_of_a_volume_is_that_of_a_poisson_number() {
    // Exact (Garwood 1936): 10 events, 4.80 to 18.39; none, 0 to 3.69.
    let of = |passed| SiteCount {
        passed,
        watched_ms: 3_600_000,
        ..SiteCount::default()
    };
    let (low, high) = of(10).volume_range_per_h().unwrap();
    assert!((low - 4.80).abs() < 0.05 && (high - 18.39).abs() < 0.05);
    let (low, high) = of(0).volume_range_per_h().unwrap();
    assert!(low == 0.0 && (3.0..3.8).contains(&high), "{high}");
}
