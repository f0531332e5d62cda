//! People of an event as one peer sees them, and as several tell of them, on looks made by hand.

use super::*;
use crate::crowd::tests::event;
use crate::testing::{airframe, mission};
use proptest::prelude::*;
use skein_behaviors::crowd::{CrowdLook, Square};
use skein_flight::mount::Mount;
use skein_geometry::frame::{Point, Pose};

/// The sector about (30, 70) m, in the middle of the picture below.
const SECTOR: u16 = 6;

const AIR: (u64, u64, u64) = (1_000, 1, 0);

/// A UAV that stands in the air over the event, which has 100 m by 60 m.
struct Scene {
    gathering: Gathering,
    mission: Mission,
    now_s: u64,
}

impl Scene {
    fn new(me: u16) -> Self {
        let mut mission = mission(1, 4, 4);
        mission.crowd = Some(Arc::new(event()));
        let mut gathering = Gathering::new(me);
        gathering.begin_life(1);
        gathering.follow(&mission);
        Self {
            gathering,
            mission,
            now_s: 10,
        }
    }

    /// One look, a second after the last one: so many are recognised in each square of the event.
    fn look(&mut self, each: u16) {
        self.look_with(airframe(), each);
    }

    fn look_with(&mut self, flies: Airframe, each: u16) {
        self.now_s += 1;
        let rows = (5..9).flat_map(|row| (0..6).map(move |col| (col, row)));
        let squares = rows.map(|(col, row)| Square {
            col,
            row,
            people: each,
        });
        let percept = Percept {
            crowd: CrowdLook::new(squares),
            ..percept(1_000 * self.now_s)
        };
        self.gathering.look(&percept, &flies, true);
    }

    fn tell(&mut self) -> Vec<(u16, CrowdTile)> {
        let effects = self.gathering.tell(Time(1_000 * self.now_s), AIR, true);
        let told = effects.into_iter().filter_map(|e| match e {
            Effect::Speak(tile, Body::Crowd(told)) => Some((tile, told)),
            _ => None,
        });
        told.collect()
    }

    fn hear(&mut self, tile: u16, told: &CrowdTile) -> Vec<CrowdAlert> {
        let now = Time(1_000 * self.now_s);
        alerts(self.gathering.hear(now, tile, told))
    }

    fn crowd(&self) -> Crowd {
        self.gathering.crowd(&self.mission).unwrap()
    }

    fn is_dense(&self) -> bool {
        let own = self.gathering.own().find(|(n, _)| *n == SECTOR);
        own.unwrap().1.dense().is_some()
    }
}

fn percept(time_ms: u64) -> Percept {
    Percept {
        time_ms,
        pose: Pose::new(Point::new(30.0, 70.0), 0.0),
        height_m: 60.0,
        airspeed_mps: 13.0,
        wind_east_mps: 0.0,
        wind_north_mps: 0.0,
        wind_unknown: false,
        attitude: None,
        contour: skein_behaviors::contour::ContourLook::default(),
        crowd: CrowdLook::default(),
        endurance_s: 3_000.0,
        takes_off_in_ms: 0,
        launch_ready: false,
        failsafe: false,
        circles_per_m: None,
        circles_in_ms: 0,
        traffic: skein_behaviors::traffic::Traffic::default(),
        obstacles: skein_behaviors::obstacle::Obstacles::default(),
        sightings: skein_behaviors::sightings::Sightings::default(),
    }
}

fn alerts(effects: Effects) -> Vec<CrowdAlert> {
    let told = effects.into_iter().filter_map(|e| match e {
        Effect::Report(Report::Crowd { told }) => Some(told),
        _ => None,
    });
    told.collect()
}

#[test]
fn sectors_that_are_all_in_the_picture_are_counted_with_a_range() {
    let mut scene = Scene::new(7);
    scene.look(85);
    let own: Vec<(u16, Sector)> = scene.gathering.own().collect();
    // Columns 0 to 5 and rows 5 to 8 of squares hold three sectors whole.
    let seen: Vec<u16> = own.iter().map(|(n, _)| *n).collect();
    assert_eq!(seen, [5, 6, 7]);
    let look = own
        .iter()
        .find(|(n, _)| *n == SECTOR)
        .unwrap()
        .1
        .look
        .unwrap();
    assert_eq!((look.people, look.by, look.came), (399, 7, 0));
    assert!(look.low < 399 && look.high > 399 && look.low > 330 && look.high < 470);
}

#[test]
fn a_sector_is_too_dense_for_certain_and_eases_for_certain() {
    let mut scene = Scene::new(7);
    // 3.5 to 1 m² are 1,400: by 1,190 recognised it may be or not.
    scene.look(297);
    assert!(!scene.is_dense());
    scene.look(400);
    assert!(scene.is_dense());
    let begun = scene.gathering.own().find(|(n, _)| *n == SECTOR).unwrap();
    // Between the norms it is what it was, also without a look that says so.
    scene.look(270);
    assert!(scene.is_dense());
    let after = scene.gathering.own().find(|(n, _)| *n == SECTOR).unwrap();
    assert_eq!(begun.1.dense(), after.1.dense());
    scene.look(150);
    assert!(!scene.is_dense());
}

#[test]
fn what_became_too_dense_is_told_at_once_and_people_are_told_once() {
    let mut scene = Scene::new(7);
    let mut other = Scene::new(8);
    scene.look(400);
    let told = scene.tell();
    assert_eq!(told.len(), 1, "at once");
    let heard = other.hear(told[0].0, &told[0].1);
    assert!(!heard.is_empty() && heard.iter().all(|a| a.is_dense && a.by == 7));
    assert!(heard[0].sentence().contains("is too dense"));
    // Heard again, and seen again, it is no news.
    assert_eq!(other.hear(told[0].0, &told[0].1), []);
    other.now_s = scene.now_s;
    other.look(400);
    let again = other.tell().into_iter().all(|(tile, told)| {
        let (now, mut third) = (Time(0), Scene::new(9));
        third.gathering.hear(now, tile, &told);
        third.crowd().alerts().all(|a| a.by == 7 || a.by == 8)
    });
    assert!(again);
    scene.look(100);
    scene.now_s += 20;
    let eased = scene.tell();
    let heard = other.hear(eased[0].0, &eased[0].1);
    assert!(!heard.is_empty() && heard.iter().all(|a| !a.is_dense));
}

/// When a tile is told that becomes too dense, and eases after so many seconds if it does: seconds
/// since.
fn told_s(eases_s: Option<u64>) -> Vec<u64> {
    let mut scene = Scene::new(7);
    scene.look(400);
    let since_s = scene.now_s;
    let mut told_s = Vec::new();
    for _ in 0..30 {
        told_s.extend(scene.tell().iter().map(|_| scene.now_s - since_s));
        if eases_s == Some(scene.now_s - since_s + 1) {
            scene.look(10);
        } else {
            scene.now_s += 1;
        }
    }
    told_s
}

/// Nobody repairs what is lost, so what is urgent is said three times.
#[test]
fn what_became_too_dense_is_told_three_times_two_intervals_apart() {
    assert_eq!(told_s(None), [0, 2, 4]);
}

/// What became urgent while something else of the tile was being told again is told as often.
#[test]
fn what_is_urgent_beside_what_is_told_again_is_told_three_times_too() {
    assert_eq!(told_s(Some(3)), [0, 2, 3, 5, 7]);
}

#[test]
fn what_is_no_news_waits_and_is_told_again_by_whoever_knows_it() {
    let mut scene = Scene::new(7);
    scene.look(20);
    assert_eq!(scene.tell(), [], "gathered first");
    for _ in 0..8 {
        scene.look(20);
    }
    let mut told = scene.tell();
    scene.now_s += 3;
    told.extend(scene.tell());
    assert!(!told.is_empty());
    let mut other = Scene::new(8);
    other.now_s = scene.now_s;
    for (tile, told) in &told {
        other.hear(*tile, told);
    }
    assert_eq!(scene.crowd().people(), other.crowd().people());
    // Who saw it is lost: the other one says it again, and its looks stay those of the first.
    other.now_s += 4 * 20 - 2;
    assert_eq!(other.tell(), []);
    other.now_s += 3;
    let again = other.tell();
    assert!(again[0].1.rows.iter().all(|r| r.seen_by == 7));
    // Whoever hears that as much was told keeps silent.
    let mut third = Scene::new(9);
    third.now_s = other.now_s;
    for (tile, told) in &told {
        third.hear(*tile, told);
    }
    third.now_s += 30;
    third.hear(again[0].0, &again[0].1);
    third.now_s += 60;
    assert!(third.tell().iter().all(|(tile, _)| *tile != again[0].0));
}

#[test]
fn nobody_is_counted_in_two_looks_and_who_walked_widens_the_range() {
    let mut scene = Scene::new(7);
    scene.look(100);
    scene.gathering.tell(Time(1_000 * scene.now_s), AIR, false);
    let of = |s: &Scene| {
        let own: Vec<Look> = s.gathering.own().filter_map(|(_, s)| s.look).collect();
        (
            own.iter().map(|l| u32::from(l.people)).sum::<u32>(),
            own.iter().map(|l| l.came).sum::<i32>(),
        )
    };
    let before = of(&scene);
    scene.look(100);
    assert_eq!(
        of(&scene),
        before,
        "a later look takes the place of the one before"
    );
    scene.now_s += 30;
    scene.look(20);
    let (people, came) = of(&scene);
    assert!(people < before.0 / 3 && came < 0, "{people} {came}");
}

#[test]
fn a_tilted_camera_counts_what_is_certainly_in_its_picture() {
    let mut scene = Scene::new(7);
    let fixed = Airframe {
        mount: Mount::Fixed,
        ..airframe()
    };
    scene.look_with(fixed, 100);
    assert_eq!(
        scene.gathering.own().count(),
        0,
        "nothing is told of its attitude"
    );
    scene.look(100);
    assert!(scene.gathering.own().count() > 0);
}

#[test]
fn another_life_begins_at_nothing_and_another_event_has_other_numbers() {
    let mut scene = Scene::new(7);
    scene.look(400);
    let told = scene.tell();
    scene.gathering.begin_life(2);
    assert_eq!(scene.gathering.own().count(), 0);
    assert!(scene.crowd().alerts().count() > 0);
    let mut other = Scene::new(8);
    let mut elsewhere = told[0].1.clone();
    elsewhere.crowd ^= 1;
    assert_eq!(other.hear(told[0].0, &elsewhere), []);
    assert_eq!(other.crowd().people().looked, 0);
    assert_eq!(other.gathering.len(), elsewhere.rows.len());
    scene.mission.sortie += 1;
    scene.gathering.follow(&scene.mission);
    assert_eq!(scene.crowd().people().looked, 0);
}

fn row() -> impl Strategy<Value = (CrowdRow, u32, u16)> {
    let counts = (0_u8..16, 0_u16..300, 0_u16..200, 0_u16..200);
    let looks = (0_u32..40, 0_u16..4, -50..50_i32, 0_u8..3, 0_u32..20);
    (counts, looks, (0_u32..30, 0_u16..4)).prop_map(|(counts, looks, dense)| {
        let (sector, people, less, more) = counts;
        let (age_s, seen_by, came, sure, sure_before_s) = looks;
        let sure = [Sure::None, Sure::Eased, Sure::Dense][usize::from(sure)];
        let row = CrowdRow {
            sector,
            people,
            low: people.saturating_sub(less),
            high: people + more,
            age_s,
            seen_by,
            came,
            sure,
            sure_before_s: if sure == Sure::None { 0 } else { sure_before_s },
        };
        (row, dense.0, dense.1)
    })
}

fn tile() -> impl Strategy<Value = (u16, CrowdTile)> {
    let rows = proptest::collection::vec(row(), 1..6);
    (0_u16..2, 100_u64..140, rows).prop_map(|(tile, time_s, mut rows)| {
        rows.sort_by_key(|(r, ..)| r.sector);
        rows.dedup_by_key(|(r, ..)| r.sector);
        let dense = rows.iter().filter(|(r, ..)| r.sure == Sure::Dense);
        let dense = dense.map(|(r, dense_s, by)| CrowdDense {
            sector: r.sector,
            dense_s: *dense_s,
            by: *by,
        });
        let told = CrowdTile {
            crowd: 5,
            time_s,
            dense: dense.collect(),
            rows: rows.into_iter().map(|(r, ..)| r).collect(),
        };
        (tile, told)
    })
}

proptest! {
    /// A join: in whatever order, however often, in whatever company.
    #[test]
    fn tiles_merge_in_any_order_and_any_number(
        tiles in proptest::collection::vec(tile(), 1..8),
        order in proptest::collection::vec(0_usize..64, 16),
    ) {
        for (_, told) in &tiles {
            prop_assert_eq!(Body::Crowd(told.clone()).check(), Ok(()));
        }
        let known = |heard: &[&(u16, CrowdTile)]| {
            let mut gathering = Gathering::new(1);
            for (tile, told) in heard {
                gathering.hear(Time(0), *tile, told);
            }
            gathering
        };
        let all = known(&tiles.iter().collect::<Vec<_>>());
        let shuffled = order.iter().map(|n| &tiles[n % tiles.len()]);
        let shuffled: Vec<_> = shuffled.chain(tiles.iter().rev()).collect();
        prop_assert_eq!(&known(&shuffled).known, &all.known);
        // What is known is told so that whoever hears it knows as much.
        let mut other = Gathering::new(2);
        for tile in 0..2 {
            let told = all.register(tile, 5);
            prop_assert_eq!(Body::Crowd(told.clone()).check(), Ok(()));
            other.hear(Time(0), tile, &told);
        }
        prop_assert_eq!(&other.known, &all.known);
    }
}
