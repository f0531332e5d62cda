//! An event as it is told beside what is true, on scenes made by hand in which somebody lies.

use super::*;
use crate::check::testing::{Story, speaking};
use crate::spec::{CrowdSpec, Field, GroupSpec};
use skein_geometry::frame::Pose;
use skein_peer::crowd::ThenWatch;
use skein_peer::gathering::{Look, Verdict};

/// Of the four by four sectors of 20 m the one about (50, 50) m.
const SECTOR: u16 = 10;

pub(super) fn watch() -> CrowdWatch {
    CrowdWatch {
        west_m: 0,
        south_m: 0,
        sector_m: 20,
        cols: 4,
        rows: 4,
        interval_s: 20,
        dense_e2: 200,
        eased_e2: 160,
        then: ThenWatch::Notify,
        look_every_s: 60,
        worth: 100,
        circles_max: 1,
    }
}

/// So many people in a square of 40 m about the sector, and a UAV over it that says what it likes.
struct Scene {
    check: CrowdCheck,
    found: Findings,
    people: People,
    second: u64,
    is_late: bool,
}

impl Scene {
    fn new(people: u32) -> Self {
        let mut mission = (*crate::world::fixture::square(1).mission).clone();
        mission.crowd = Some(Arc::new(watch()));
        let mut check = CrowdCheck::default();
        check.on_mission(&mission);
        check.able = [(1, 1_000)].into();
        let group = GroupSpec {
            people,
            at: Field {
                low: (30.0, 30.0),
                high: (70.0, 70.0),
            },
            moves: Vec::new(),
        };
        let spec = CrowdSpec {
            groups: vec![group],
            ..CrowdSpec::default()
        };
        Self {
            check,
            found: Findings::new(0),
            people: People::new(&spec, 200, 1),
            second: 0,
            is_late: false,
        }
    }

    /// How many truly are in the sector.
    fn truly(&self) -> u16 {
        u16::try_from(self.people.within(Point::new(40.0, 40.0), 20.0)).unwrap()
    }

    /// A second later the UAV looks from there, and tells this of the sector, by a look of then
    /// where it has one; whatever it tells, it has told.
    fn look(&mut self, from: Point, says: Option<Sector>) {
        self.look_untold(from, says, true);
    }

    fn look_untold(&mut self, from: Point, says: Option<Sector>, is_told: bool) {
        self.second += 1;
        self.people.advance(1_000 * self.second);
        self.check.on_people(&self.people);
        let own: Vec<(u16, Sector)> = says.map(|s| (SECTOR, s)).into_iter().collect();
        let known = own.iter().copied().filter(|_| is_told).collect();
        let known = Crowd::new(Arc::new(watch()), known);
        let look = CrowdGlance {
            uav: (1, 1),
            picture: Picture::level(Pose::new(from, 0.0), (25.0, 25.0)),
            is_late: self.is_late,
            looks: true,
            sees: &|_| true,
            own: &own,
            known: &known,
        };
        self.check
            .on_look(1_000 * self.second, look, &mut self.found);
    }

    /// What an honest UAV says of so many by a look of the next second.
    fn sector(&self, people: u16, is_dense: bool) -> Sector {
        let at_ms = 1_000 * (self.second + 1);
        Sector {
            look: Some(Look {
                seen_ms: at_ms,
                by: 1,
                people,
                low: people - people / 10,
                high: people + people / 10 + 2,
                came: 0,
            }),
            verdict: Some(Verdict {
                at_ms,
                dense: is_dense.then_some((at_ms, 1)),
            }),
        }
    }

    /// One of two was told this of the sector by now, and the other that.
    fn snapshot(&mut self, story: &mut Story, second: u64, one: Sector, other: Option<Sector>) {
        let knows = |told: Option<Sector>| skein_peer::Beliefs {
            crowd: told.map(|s| (SECTOR, s)).into_iter().collect(),
            ..speaking()
        };
        let views = [(1, knows(Some(one))), (2, knows(other))];
        story.snapshot(1_000 * second, &views, |snapshot| {
            let flight = FlightCheck::new(BTreeMap::new(), Vec::new(), 10.0);
            let flyers = (&BTreeMap::new(), &flight);
            self.check.on_snapshot(snapshot, flyers, &mut self.found);
        });
    }

    fn broken(&self) -> Vec<&'static str> {
        self.found.counts.keys().copied().collect()
    }
}

fn over() -> Point {
    Point::new(50.0, 50.0)
}

#[test]
fn who_tells_the_truth_breaks_no_rule() {
    for (people, is_dense) in [(6_400, true), (100, false)] {
        let mut scene = Scene::new(people);
        for _ in 0..80 {
            let says = scene.sector(scene.truly(), is_dense);
            scene.look(over(), Some(says));
            scene.check.judge_look(SECTOR, &says);
        }
        scene.check.on_end(90_000, &mut scene.found);
        assert_eq!(scene.broken(), [""; 0], "{:?}", scene.found.violations);
        assert_eq!(scene.check.report().unwrap().ranges, (80, 80));
    }
}

#[test]
fn who_says_that_it_saw_what_is_not_in_its_picture_is_found() {
    let mut scene = Scene::new(100);
    let says = scene.sector(scene.truly(), false);
    scene.look(Point::new(90.0, 50.0), Some(says));
    assert_eq!(scene.broken(), ["crowd-sight"]);
    let mut late = Scene::new(100);
    late.is_late = true;
    let says = late.sector(late.truly(), false);
    late.look(Point::new(90.0, 50.0), Some(says));
    assert_eq!(late.broken(), [""; 0]);
}

#[test]
fn who_looks_and_counts_nobody_is_found() {
    let mut scene = Scene::new(100);
    for _ in 0..5 {
        scene.look(over(), None);
    }
    assert_eq!(scene.broken(), ["crowd-idle"]);
    // Nobody asks that of who does not fly the mission.
    let mut scene = Scene::new(100);
    scene.check.able.clear();
    for _ in 0..5 {
        scene.look(over(), None);
    }
    assert_eq!(scene.broken(), [""; 0]);
}

#[test]
fn who_does_not_know_what_it_sees_to_be_too_dense_is_found() {
    for (people, says_dense) in [(6_400, false), (100, true)] {
        let mut scene = Scene::new(people);
        for _ in 0..5 {
            let says = scene.sector(scene.truly(), says_dense);
            scene.look(over(), Some(says));
        }
        assert_eq!(scene.broken(), ["crowd-norm"]);
    }
    // What is near to the norm may be either.
    for says_dense in [false, true] {
        let mut scene = Scene::new(3_200);
        for _ in 0..5 {
            let says = scene.sector(scene.truly(), says_dense);
            scene.look(over(), Some(says));
        }
        assert_eq!(scene.broken(), [""; 0]);
    }
}

#[test]
fn who_keeps_to_itself_that_it_is_too_dense_is_found() {
    let mut scene = Scene::new(6_400);
    for _ in 0..16 {
        let says = scene.sector(scene.truly(), true);
        scene.look_untold(over(), Some(says), false);
    }
    assert_eq!(scene.broken(), [""; 0]);
    for _ in 0..4 {
        let says = scene.sector(scene.truly(), true);
        scene.look_untold(over(), Some(says), false);
    }
    assert_eq!(scene.broken(), ["crowd-late"]);
}

#[test]
fn an_alarm_where_nothing_is_near_to_it_is_found_and_so_is_an_end_that_is_none() {
    let told = |is_dense| CrowdAlert {
        sector: SECTOR,
        is_dense,
        since_ms: 1_000,
        by: 1,
        sector_m: 20,
        ..CrowdAlert::default()
    };
    for (people, is_dense, wrong) in [
        (100, true, true),
        (100, false, false),
        (6_400, true, false),
        (6_400, false, true),
    ] {
        let mut scene = Scene::new(people);
        scene.look(over(), None);
        let at = (1_500, 1, false);
        scene.check.on_told(at, &told(is_dense), &mut scene.found);
        assert_eq!(
            scene.broken() == ["crowd-false"],
            wrong,
            "{people} {is_dense}"
        );
    }
}

#[test]
fn ranges_that_do_not_hold_are_found_and_so_are_wrong_sums() {
    let mut scene = Scene::new(100);
    for k in 0..80 {
        let people = if k % 4 == 0 { 90 } else { scene.truly() };
        let says = scene.sector(people, false);
        scene.look(over(), Some(says));
        scene.check.judge_look(SECTOR, &says);
        let all = watch().sectors().map(|n| (n, says)).collect();
        let known = Crowd::new(Arc::new(watch()), all);
        scene.check.judge_people(30_000 * (k + 1), &known);
    }
    scene.check.on_end(90_000, &mut scene.found);
    assert_eq!(scene.broken(), ["crowd-people", "crowd-range"]);
}

#[test]
fn some_sums_of_all_people_may_be_wrong_and_none_by_far() {
    for (wrong, far, broken) in [(2, false, false), (8, false, true), (1, true, true)] {
        let mut scene = Scene::new(100);
        for k in 0..10 {
            scene.look(over(), None);
            let watch = watch();
            let says = |n: u16| {
                let truly = scene.people.within(watch.middle(n).unwrap(), 20.0);
                let truly = u16::try_from(truly).unwrap();
                let people = match k < wrong {
                    true if far => 3 * truly,
                    true => truly + truly / 6,
                    false => truly,
                };
                let mut says = scene.sector(people, false);
                if let Some(look) = &mut says.look {
                    look.seen_ms = 1_000 * scene.second;
                }
                (n, says)
            };
            let known = Crowd::new(Arc::new(watch.clone()), watch.sectors().map(says).collect());
            scene.check.judge_people(30_000 * (k + 1), &known);
        }
        scene.check.on_end(400_000, &mut scene.found);
        let (hold, off) = (scene.check.people_then, scene.check.people_off);
        let is_found = scene.broken().contains(&"crowd-people");
        assert_eq!(is_found, broken, "{wrong} {far} {hold:?} {off}");
        assert_eq!(hold, (10 - u32::try_from(wrong).unwrap(), 10));
    }
}

#[test]
fn who_lacks_for_long_what_its_component_was_told_is_found() {
    let mut scene = Scene::new(100);
    let says = scene.sector(30, false);
    let mut story = Story::new(0);
    scene.check.revision = 1;
    let run = |scene: &mut Scene, story: &mut Story, from_s: u64, to_s: u64, second: bool| {
        for s in from_s..to_s {
            scene.snapshot(story, s, says, second.then_some(says));
        }
    };
    run(&mut scene, &mut story, 0, 150, false);
    assert_eq!(scene.broken(), [""; 0]);
    run(&mut scene, &mut story, 150, 300, false);
    assert_eq!(scene.broken(), ["crowd-agree"]);
    let mut scene = Scene::new(100);
    scene.check.revision = 1;
    run(&mut scene, &mut Story::new(0), 0, 300, true);
    assert_eq!(scene.broken(), [""; 0]);
}

/// That a sector became too dense reaches all sooner than how many there are; and what was lacked
/// before it became so says nothing of that.
#[test]
fn whether_a_sector_is_too_dense_has_a_clock_of_its_own() {
    let limit_s = |dense_from_s: u64| {
        let mut scene = Scene::new(100);
        scene.check.revision = 1;
        let (says, dense) = (scene.sector(30, false), scene.sector(100, true));
        let mut story = Story::new(0);
        (0..400).find(|s| {
            let told = if *s < dense_from_s { says } else { dense };
            scene.snapshot(&mut story, *s, told, None);
            !scene.broken().is_empty()
        })
    };
    let (at_once_s, never_s) = (limit_s(0).unwrap(), limit_s(1_000).unwrap());
    assert!(2 * at_once_s < never_s, "{at_once_s} s for {never_s} s");
    assert_eq!(limit_s(60), Some(60 + at_once_s));
}
