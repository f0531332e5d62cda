//! Streets as they are told beside what is true, on scenes made by hand.

use super::*;
use skein_geometry::frame::Pose;
use skein_peer::streets::{AskedWay, Way};
use skein_peer::wire::usage::{StretchUse, TurnUse, Usage};
use std::collections::BTreeSet;

/// A block, 200 m by 200 m, with a street through it.
fn streets() -> Streets {
    let way = |street, places: &[(i32, i32)]| Way {
        street,
        places: places.to_vec(),
    };
    Streets {
        names: ["South", "Middle", "North"].map(str::to_owned).to_vec(),
        ways: vec![
            way(0, &[(0, 100_000), (0, 0), (200_000, 0), (200_000, 100_000)]),
            way(1, &[(0, 100_000), (200_000, 100_000)]),
            way(
                2,
                &[
                    (0, 100_000),
                    (0, 200_000),
                    (200_000, 200_000),
                    (200_000, 100_000),
                ],
            ),
        ],
        interval_s: 60,
        usual_dmps: 80,
        asked: vec![AskedWay {
            name: "across".into(),
            from: (0, 100_000),
            to: (200_000, 100_000),
        }],
        station: None,
        unmeasured: false,
    }
}

/// A UAV that stands over the middle, and what it says after a while of a car that drives there.
struct Scene {
    check: StreetCheck,
    found: Findings,
    network: Network,
    middle: u16,
    is_late: bool,
    displaced_m: f64,
    /// Whether a house hides the eastern half, of which the mission tells.
    hidden: bool,
}

impl Scene {
    fn new() -> Self {
        let mut mission = (*crate::world::fixture::square(1).mission).clone();
        mission.streets = Some(Arc::new(streets()));
        let mut check = StreetCheck::default();
        check.on_mission(&mission);
        check.on_able([1].into());
        let network = streets().network();
        let middle = network.edges().iter().position(|e| e.length_m < 250.0);
        Self {
            check,
            found: Findings::new(0),
            middle: u16::try_from(middle.unwrap()).unwrap(),
            network,
            is_late: false,
            displaced_m: 0.0,
            hidden: false,
        }
    }

    /// The places of the middle street that a UAV there has in its picture.
    fn in_picture(&self) -> BTreeSet<usize> {
        let all = self.network.places().iter().enumerate();
        let near = all.filter(|(_, p)| (p.at - Point::new(100.0, 100.0)).norm() < 40.0);
        near.map(|(i, _)| i).collect()
    }

    /// Looks five times a second; a car drives along the middle at 10 m/s, to and fro.
    fn look(&mut self, for_s: u32, watched: &BTreeSet<usize>) {
        for look in 0..5 * for_s {
            let s = f64::from(look) / 5.0;
            // To and fro.
            let car = Point::new(200.0 - 10.0 * (s % 40.0 - 20.0).abs(), 100.0);
            let look = StreetLook {
                uav: (1, 1),
                picture: Picture::level(Pose::new(Point::new(100.0, 100.0), 0.0), (50.0, 50.0)),
                displaced_m: self.displaced_m,
                is_late: self.is_late,
                sees: &|at: Point| !self.hidden || at.x < 100.0,
                watched,
            };
            let now_ms = 1_000 + (s * 1000.0).round() as u64;
            self.check.on_look(now_ms, &[car], look, &mut self.found);
        }
    }

    /// What a UAV tells that watched 80 m for a minute and a half, and saw the car there for so
    /// much of the truth, at so many m/s.
    fn tells(&self, share: f64, mps: f64, turns: u16) -> Usages {
        let spent_s = 90.0 * 0.4 * share;
        let mut usages = Usages::new(Arc::new(streets()), Arc::new(self.network.clone()));
        let stretches = vec![StretchUse {
            stretch: self.middle,
            watched_m_s: 90 * 80,
            spent_ds: (10.0 * spent_s) as u32,
            stood_ds: 0,
            driven_m: (mps * spent_s) as u32,
            vehicles: 5,
        }];
        let turn = TurnUse {
            turn: 0,
            vehicles: turns,
        };
        usages.with(&Usage {
            streets: 0,
            stretches,
            turns: vec![turn],
        });
        usages
    }

    fn ended(mut self, told: Usages) -> (Vec<&'static str>, Option<StreetsReport>) {
        let hints: Vec<Hint> = told
            .hint("across", Point::new(0.0, 100.0), Point::new(200.0, 100.0))
            .into_iter()
            .collect();
        self.check.on_own((1, 1), told.clone());
        self.check.on_known(91_000, told, &hints, &mut self.found);
        self.check.on_end(91_000, &mut self.found);
        let report = self.check.report();
        (self.found.counts.keys().copied().collect(), report)
    }
}

#[test]
fn what_is_told_rightly_passes_and_what_is_not_does_not() {
    for (share, mps, turns, broken) in [
        (1.0, 10.0, 0, vec![]),
        (0.4, 10.0, 0, vec!["usage"]),
        (1.8, 10.0, 0, vec!["usage"]),
        (1.0, 6.0, 0, vec!["usage"]),
        (1.0, 10.0, 9, vec!["usage-turns"]),
    ] {
        let mut scene = Scene::new();
        let watched = scene.in_picture();
        scene.look(90, &watched);
        let told = scene.tells(share, mps, turns);
        let (found, report) = scene.ended(told);
        assert_eq!(found, broken, "{share} {mps} {turns}");
        if broken.is_empty() {
            let report = report.unwrap();
            assert_eq!((report.density_holds, report.hints.len()), ((1, 1), 1));
            let hint = &report.hints[0];
            assert!(hint.is_way && (hint.true_s - 20.0).abs() < 0.5, "{hint:?}");
            assert!(hint.line().contains("the best way 20 s"), "{}", hint.line());
        }
    }
}

#[test]
fn who_watches_what_is_not_in_its_picture_is_found_and_who_watches_nothing_too() {
    let mut scene = Scene::new();
    let everything: BTreeSet<usize> = (0..scene.network.places().len()).collect();
    scene.look(2, &everything);
    assert_eq!(scene.found.counts.keys().next(), Some(&"usage-sight"));
    let mut scene = Scene::new();
    scene.is_late = true;
    scene.look(2, &everything);
    assert!(scene.found.counts.is_empty());
    let mut scene = Scene::new();
    scene.look(600, &BTreeSet::new());
    scene.check.on_end(601_000, &mut scene.found);
    assert_eq!(scene.found.counts.keys().next(), Some(&"usage-idle"));
}

#[test]
fn who_watches_what_houses_hide_is_found_where_the_mission_tells_of_them() {
    for (tells, hidden, is_found) in [
        (true, true, true),
        (true, false, false),
        (false, true, false),
    ] {
        let mut scene = Scene::new();
        let mut mission = (*crate::world::fixture::square(1).mission).clone();
        mission.streets = Some(Arc::new(streets()));
        mission.buildings = tells.then(Arc::default);
        scene.check.on_mission(&mission);
        scene.hidden = hidden;
        let watched = scene.in_picture();
        scene.look(90, &watched);
        scene.check.on_end(91_000, &mut scene.found);
        let broken = scene.found.counts.contains_key("usage-sight");
        assert_eq!(broken, is_found, "{tells} {hidden}");
    }
}

#[test]
fn a_process_that_begins_in_the_same_life_tells_of_itself_alone() {
    for boots in [true, false] {
        let mut scene = Scene::new();
        let watched = scene.in_picture();
        scene.look(90, &watched);
        let told = scene.tells(1.0, 10.0, 0);
        scene.check.on_own((1, 1), told);
        if boots {
            scene.check.on_boot(1);
        }
        let nothing = Usages::new(Arc::new(streets()), Arc::new(scene.network.clone()));
        scene.check.on_own((1, 1), nothing);
        scene.check.on_end(91_000, &mut scene.found);
        assert_eq!(scene.found.counts.contains_key("usage"), !boots);
    }
}

#[test]
fn a_hint_that_is_no_way_or_a_slow_one_breaks_the_rule() {
    let watched = |scene: &Scene| {
        let mut told = Usages::new(Arc::new(streets()), Arc::new(scene.network.clone()));
        let all = (0_u16..).zip(scene.network.edges());
        let stretches = all.map(|(stretch, _)| StretchUse {
            stretch,
            watched_m_s: 20_000,
            ..StretchUse::default()
        });
        told.with(&Usage {
            streets: 0,
            stretches: stretches.collect(),
            turns: Vec::new(),
        });
        told
    };
    let (from, to) = (Point::new(0.0, 100.0), Point::new(200.0, 100.0));
    for (case, broken) in [(0, false), (1, true), (2, true), (3, true)] {
        let mut scene = Scene::new();
        let in_picture = scene.in_picture();
        scene.look(90, &in_picture);
        let told = watched(&scene);
        let mut hint = told.hint("across", from, to).unwrap();
        match case {
            // Round by the north, though nothing is in the way.
            1 => {
                let long = scene
                    .network
                    .edges()
                    .iter()
                    .position(|e| e.length_m > 250.0);
                let long = u16::try_from(long.unwrap()).unwrap();
                hint.legs = vec![(long, 0.0, 400.0)];
            }
            2 => hint.legs.clear(),
            3 => hint.legs[0].2 = 50.0,
            _ => {}
        }
        // By the truth it takes 50 s where 20 s are enough: more than the bound.
        scene
            .check
            .on_known(91_000, told, &[hint], &mut scene.found);
        assert_eq!(!scene.found.counts.is_empty(), broken, "{case}");
    }
}

/// Two streets side by side, fourteen metres apart, and a car on one of them.
#[test]
fn who_sees_all_far_beside_its_place_may_take_a_vehicle_to_be_on_the_next_street() {
    let along = |north_mm| Way {
        street: 0,
        places: vec![(0, north_mm), (400_000, north_mm)],
    };
    let two = Streets {
        ways: vec![along(0), along(14_000)],
        ..streets()
    };
    let network = two.network();
    let reaches = Reaches::of(&network);
    let located = |north_m: f64| {
        let (before, at) = (Point::new(100.0, north_m), Point::new(102.0, north_m));
        let mut located = Located::default();
        let _ = located.step((&network, &reaches), (before, at), (1_000, 200));
        located
    };
    let on = |located: &Located, displaced_m| {
        let streets = located.may_be(displaced_m).map(|(stretch, _)| stretch);
        (streets.collect::<Vec<u16>>(), located.is_sure(displaced_m))
    };
    let beside = located(0.5);
    for displaced_m in [0.0, 5.0, 6.0] {
        assert_eq!(on(&beside, displaced_m), (vec![0], true));
    }
    for displaced_m in [7.0, 30.0] {
        assert_eq!(on(&beside, displaced_m), (vec![0, 1], false));
    }
    // Six metres from the middle of the only street: a UAV that sees it nine metres off may take
    // it to be on none.
    let aside = located(-6.0);
    assert_eq!(on(&aside, 5.0), (vec![0], true));
    assert_eq!(on(&aside, 6.5), (vec![0], false));
}
