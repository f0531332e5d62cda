//! Streets as one peer sees them used, and as several tell of it, on looks made by hand.

use super::*;
use crate::buildings::{Building, Buildings};
use crate::streets::tests::block;
use crate::testing::{airframe, mission};
use skein_flight::tracking::estimate::Detection;
use skein_flight::tracking::tracks::{Kind, Sighting};
use skein_geometry::random::SplitMix64;

/// A UAV that stands in the air over a place, and sees what drives below, without errors at first.
struct Scene {
    off_m: f64,
    random: SplitMix64,
    using: Using,
    tracks: Tracks,
    mission: Mission,
    at: Point,
    now_ms: u64,
}

impl Scene {
    fn new(at: Point) -> Self {
        let mut mission = mission(1, 4, 4);
        mission.streets = Some(Arc::new(block()));
        let mut using = Using::new(7);
        using.begin_life(1);
        Self {
            off_m: 0.0,
            random: SplitMix64::new(31),
            using,
            tracks: Tracks::new(7, 5.0),
            mission,
            at,
            now_ms: 1_000,
        }
    }

    /// Looks for some seconds; vehicles are where they are at each second.
    fn look(&mut self, for_s: f64, vehicles: &dyn Fn(f64) -> Vec<Point>) {
        let looks = (for_s * 5.0).round() as u32;
        for _ in 0..looks {
            self.now_ms += 200;
            let (at, flies) = (self.at, airframe());
            let in_view = move |p: Point| {
                let off = p - at;
                off.x.abs() < flies.footprint_along_m && off.y.abs() < flies.footprint_across_m
            };
            let seen = vehicles(seconds(self.now_ms)).into_iter();
            let (off_m, random) = (self.off_m, &mut self.random);
            let seen = seen.filter(|p| in_view(*p)).map(|p| {
                let off = Vector::new(random.normal(), random.normal()) * off_m;
                Sighting {
                    detection: Detection::round(p + off, off_m.max(1.0)),
                    kind: Kind(1),
                }
            });
            let seen: Vec<Sighting> = seen.collect();
            self.tracks.look(self.now_ms, &seen, &in_view);
            let percept = percept(self.now_ms, self.at);
            let town = self.mission.town();
            let counts = (&self.mission, town.as_deref(), true);
            self.using.look(&percept, &airframe(), &self.tracks, counts);
        }
    }

    fn own(&self) -> Usages {
        self.using.own().unwrap()
    }
}

fn percept(time_ms: u64, at: Point) -> Percept {
    Percept {
        time_ms,
        pose: Pose::new(at, 0.0),
        height_m: 60.0,
        airspeed_mps: 13.0,
        wind_east_mps: 0.0,
        wind_north_mps: 0.0,
        wind_unknown: false,
        attitude: None,
        contour: skein_behaviors::contour::ContourLook::default(),
        crowd: skein_behaviors::crowd::CrowdLook::default(),
        endurance_s: 3_000.0,
        takes_off_in_ms: 0,
        launch_ready: false,
        failsafe: false,
        circles_per_m: None,
        circles_in_ms: 0,
        traffic: skein_behaviors::traffic::Traffic::default(),
        obstacles: skein_behaviors::obstacle::Obstacles::default(),
        sightings: skein_behaviors::sightings::Sightings::new([]),
    }
}

/// The stretch through the middle of the block.
fn middle(usages: &Usages) -> u16 {
    let edges = usages.network().edges();
    let found = edges.iter().position(|e| e.length_m < 250.0);
    u16::try_from(found.unwrap()).unwrap()
}

/// One that drives along the middle of the block at 8 m/s, over and over.
fn drives(s: f64) -> Vec<Point> {
    vec![Point::new(8.0 * (s % 25.0), 101.0)]
}

#[test]
fn time_and_way_on_what_is_watched_give_density_speed_and_flow() {
    let mut scene = Scene::new(Point::new(100.0, 100.0));
    scene.look(100.0, &drives);
    let own = scene.own();
    let sum = own.of_stretch(middle(&own));
    let speed = sum.speed_mps().unwrap();
    assert!((speed - 8.0).abs() < 0.8, "{sum:?}");
    // One vehicle on 200 m all the time: 5 a kilometre, 144 an hour.
    let density = sum.density_per_km().unwrap();
    assert!((density - 5.0).abs() < 1.2, "{density}");
    let (low, high) = sum.density_range_per_km(200.0, 8.0).unwrap();
    assert!(low < 5.0 && 5.0 < high);
    assert!((sum.flow_per_h().unwrap() - 144.0).abs() < 30.0);
    assert_eq!(sum.stood_ds, 0);
    // In two intervals of a minute, and of nobody elsewhere.
    let intervals: BTreeSet<u16> = own.stretches().map(|((i, _), _)| i).collect();
    assert_eq!(intervals, BTreeSet::from([0, 1]));
    let told = own.sentences();
    assert!(told[0].starts_with("Middle: from 0 s on"), "{told:?}");
}

/// A UAV flies against those who drive, so each is in the picture for a short time, and places are
/// off: velocities of tracks that have just begun are lengthened by that.
#[test]
fn tracks_that_have_just_begun_tell_no_higher_speed() {
    for drive_mps in [3.0, 6.0, 9.0] {
        let all = |s: f64| {
            let from_m = (0..6).map(|i| 40.0 * f64::from(i));
            let at = from_m.map(|m| Point::new((m + drive_mps * s) % 240.0 - 20.0, 101.0));
            at.collect()
        };
        let told_mps = (0..4).map(|seed| {
            let mut scene = Scene::new(Point::new(200.0, 100.0));
            scene.random = SplitMix64::new(seed);
            scene.off_m = 2.5;
            for look in 0..1_500_u32 {
                scene.at.x = 200.0 - (2.6 * f64::from(look)) % 200.0;
                scene.look(0.2, &all);
            }
            let own = scene.own();
            own.of_stretch(middle(&own)).speed_mps().unwrap()
        });
        let mean_mps = told_mps.sum::<f64>() / 4.0;
        let off_mps = mean_mps - drive_mps;
        // All tracks alike would tell 0.36 m/s more at 3 m/s.
        assert!(off_mps.abs() < 0.04 * drive_mps + 0.1, "{off_mps}");
    }
}

#[test]
fn who_stands_is_told_apart_and_blocks_a_street() {
    let mut scene = Scene::new(Point::new(100.0, 100.0));
    let jam = |_: f64| {
        (0..5)
            .map(|i| Point::new(80.0 + 9.0 * f64::from(i), 100.0))
            .collect()
    };
    scene.look(30.0, &jam);
    let own = scene.own();
    let stretch = middle(&own);
    let sum = own.of_stretch(stretch);
    assert!(sum.stood_ds * 10 >= sum.spent_ds * 8, "{sum:?}");
    assert!(own.pace(stretch).is_blocked, "{sum:?}");
}

#[test]
fn a_turn_is_counted_where_its_crossing_is_in_the_picture() {
    // From the middle over its western end to the south.
    let turns = |s: f64| {
        let m = 8.0 * (s - 1.0);
        vec![if m < 60.0 {
            Point::new(60.0 - m, 100.0)
        } else {
            Point::new(0.0, 160.0 - m)
        }]
    };
    let mut scene = Scene::new(Point::new(10.0, 90.0));
    scene.look(14.0, &turns);
    let own = scene.own();
    let taken: Vec<(Turn, u32)> = own.turns().collect();
    assert_eq!(taken.len(), 1, "{taken:?}");
    let (turn, n) = taken[0];
    assert_eq!((turn.from, n), (middle(&own), 1));
    let over = own.network().crossings()[usize::from(turn.over)];
    assert!((over - Point::new(0.0, 100.0)).norm() < 1e-9);
    assert!(own.sentences().iter().any(|s| s.contains("over crossing")));
}

#[test]
fn of_two_above_a_street_one_counts() {
    let mut scene = Scene::new(Point::new(100.0, 100.0));
    scene
        .using
        .heed(vec![Pose::new(Point::new(102.0, 100.0), 0.0)]);
    scene.look(20.0, &drives);
    let own = scene.own();
    assert!(own.of_stretch(middle(&own)).watched_m_s < 200, "{own:?}");
}

#[test]
fn registers_are_told_one_at_a_time_and_merge_in_any_order() {
    let mut scene = Scene::new(Point::new(100.0, 100.0));
    scene.look(70.0, &drives);
    let mut told = Vec::new();
    for s in 0..60 {
        let now = Time(71_000 + 1_000 * s);
        let said = scene.using.tell(now, (1_000, 8), true);
        assert!(said.len() <= 1);
        told.extend(said.into_iter().filter_map(|e| match e {
            Effect::Speak(subject, Body::Usage(usage)) => Some((subject, usage)),
            _ => None,
        }));
    }
    // One of each interval; nothing grows any more.
    assert_eq!(told.len(), 2, "{told:?}");
    let of = |order: &mut dyn Iterator<Item = &(u16, Usage)>| {
        let mut other = Using::new(9);
        other.follow(&scene.mission);
        order.for_each(|(subject, usage)| other.hear((7, 1), *subject, usage));
        let sums = other.sums(&scene.mission).unwrap();
        sums.stretches().map(|(k, s)| (k, *s)).collect::<Vec<_>>()
    };
    let mut again: Vec<(u16, Usage)> = told.clone();
    let mut old = told[0].clone();
    old.1.stretches.truncate(0);
    again.push(old);
    let forth = of(&mut told.iter());
    assert_eq!(forth, of(&mut again.iter().rev()));
    assert_eq!(forth, of(&mut again.iter()));
    let own = scene.own();
    let own: Vec<_> = own.stretches().map(|(k, s)| (k, *s)).collect();
    assert_eq!(forth, own);
    // Of other streets nothing counts.
    let mut other = Using::new(9);
    let mut usage = told[0].1.clone();
    usage.streets ^= 1;
    other.hear((7, 1), told[0].0, &usage);
    assert_eq!(other.sums(&scene.mission).unwrap().stretches().count(), 0);
}

#[test]
fn among_many_each_waits_longer_between_two_registers() {
    for (uavs, apart_ms) in [(1, 1_000), (8, 1_000), (9, 2_000), (24, 3_000)] {
        let mut scene = Scene::new(Point::new(100.0, 100.0));
        scene.look(70.0, &drives);
        let said = (0..60u64).filter(|s| {
            let now = Time(371_000 + 1_000 * s);
            !scene.using.tell(now, (1_000, uavs), true).is_empty()
        });
        let at_ms: Vec<u64> = said.map(|s| 1_000 * s).collect();
        assert_eq!(at_ms, [0, apart_ms], "{uavs}");
    }
}

#[test]
fn streets_that_are_known_alone_are_not_measured() {
    let mut scene = Scene::new(Point::new(100.0, 100.0));
    let mut known = block();
    known.unmeasured = true;
    scene.mission.streets = Some(Arc::new(known));
    scene.look(10.0, &drives);
    assert!(scene.using.own().is_none() && scene.using.sums(&scene.mission).is_none());
    assert!(scene.mission.town().is_some_and(|t| t.streets.is_some()));
    // The same streets measured from now on.
    scene.mission.streets = Some(Arc::new(block()));
    scene.look(10.0, &drives);
    assert!(scene.own().watched_m_s() > 0);
}

#[test]
fn what_a_house_hides_is_not_watched() {
    let watched = |roof_dm: Option<u16>| {
        let mut scene = Scene::new(Point::new(100.0, 112.0));
        let told = roof_dm.map(|roof_dm| Buildings {
            all: vec![Building {
                roof_dm,
                // A row of houses between the UAV and a part of the street, 60 m below it.
                ring: vec![(800, 1_010), (1_000, 1_010), (1_000, 1_110), (800, 1_110)],
            }],
        });
        scene.mission.buildings = told.map(Arc::new);
        scene.look(10.0, &drives);
        let own = scene.own();
        own.of_stretch(middle(&own)).watched_m_s
    };
    let (free, behind, low) = (watched(None), watched(Some(500)), watched(Some(20)));
    assert!(
        behind < free * 3 / 4 && behind > 0,
        "{behind} m s of {free}"
    );
    assert_eq!(low, free);
}

#[test]
fn another_sortie_and_another_life_begin_at_nothing() {
    let mut scene = Scene::new(Point::new(100.0, 100.0));
    scene.look(10.0, &drives);
    assert!(scene.own().watched_m_s() > 0);
    scene.mission.sortie += 1;
    scene.mission.streets = Some(Arc::new(block()));
    scene.look(0.2, &drives);
    assert!(scene.own().watched_m_s() < 50);
    scene.look(10.0, &drives);
    scene.using.begin_life(2);
    assert!(scene.using.own().is_none());
}
