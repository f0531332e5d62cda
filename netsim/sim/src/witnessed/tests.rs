//! A UAV that flies past a site, and what it says of that some steps of the world later.

use super::*;
use crate::world::fixture::{square, straight};
use skein_geometry::frame::Vector;
use skein_peer::count_site::{CountSite, Counted};
use skein_peer::mission::mm;
use skein_peer::wire::count::Count;
use skein_peer::wire::tasks::{Task, TaskPlace};

const STEP_MS: u64 = 50;
const PERCEPT_MS: u64 = 200;

struct Scene {
    world: World,
    witnessed: Witnessed,
    corners: Vec<Point>,
    sites: u32,
    now_ms: u64,
    said: BTreeMap<u64, Looked>,
    /// Looks with the site in the picture, and all.
    looks: (u32, u32),
}

impl Scene {
    fn new() -> Self {
        let mut spec = square(1);
        let launch = &spec.uavs[0].launch;
        let at = launch.position() + launch.direction() * 30.0;
        let off = [(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)];
        let corners: Vec<Point> = off.map(|(e, n)| at + Vector::new(e, n)).into();
        let mut mission = (*spec.mission).clone();
        mission.counts = vec![CountSite {
            name: "gate".to_owned(),
            what: Counted::Passing,
            ring: corners.iter().map(|p| (mm(p.x), mm(p.y))).collect(),
            capacity: 0,
        }];
        let sites = mission.sites_hash();
        spec.mission = Arc::new(mission);
        Self {
            world: World::new(&spec, 1),
            witnessed: Witnessed::new(&spec, &spec.mission),
            corners,
            sites,
            now_ms: 0,
            said: BTreeMap::new(),
            looks: (0, 0),
        }
    }

    /// Flies straight on to a time; each percept is answered so much later, if at all, with what
    /// `says` makes of whether the site was in its picture.
    fn fly(&mut self, to_ms: u64, late_ms: u64, says: &dyn Fn(u64, bool) -> Option<bool>) {
        while self.now_ms < to_ms {
            if self.now_ms.is_multiple_of(PERCEPT_MS) {
                let picture = self.world.body(1).unwrap().picture();
                let shown = picture.holds(&self.corners);
                self.looks.0 += u32::from(shown);
                self.looks.1 += 1;
                self.witnessed.sensed(self.now_ms, 1, &self.world);
                if let Some(counts) = says(self.now_ms, shown) {
                    self.say(late_ms, counts);
                }
                assert!(self.world.apply(1, straight(self.now_ms)));
            }
            let due = self.said.range(..=self.now_ms).map(|(at, _)| *at);
            for at in due.collect::<Vec<u64>>() {
                let said = self.said.remove(&at).unwrap();
                self.witnessed.looked(1, said);
            }
            self.witnessed.stepped(self.now_ms, &self.world);
            self.now_ms += STEP_MS;
            self.world.advance(self.now_ms);
        }
    }

    fn say(&mut self, late_ms: u64, counts: bool) {
        let own = Count {
            sites: self.sites,
            ..Count::default()
        };
        let looked = Looked {
            seen_ms: self.now_ms,
            life: Some(1),
            revision: 1,
            counted: vec![(counts, own)],
            ..Looked::default()
        };
        self.said.insert(self.now_ms + late_ms, looked);
    }
}

#[test]
fn who_answers_late_is_judged_by_what_was_in_its_picture_then() {
    let mut scene = Scene::new();
    scene.fly(10_000, 700, &|_, shown| Some(shown));
    assert!(
        scene.looks.0 > 5 && scene.looks.0 < scene.looks.1,
        "{:?}",
        scene.looks
    );
    scene.witnessed.end(10_000, &scene.world);
    assert_eq!(scene.witnessed.broken(), Vec::<String>::new());
    let counts = scene.witnessed.counts(10_000);
    assert_eq!((counts.len(), &counts[0].name[..]), (1, "gate"));
    let least_ms = u64::from(scene.looks.0) * PERCEPT_MS / 4;
    assert!(counts[0].pictured_ms >= least_ms, "{counts:?}");
}

#[test]
fn who_says_that_it_counts_what_it_does_not_see_is_told_so_once() {
    let mut scene = Scene::new();
    scene.fly(10_000, 100, &|_, _| Some(true));
    let broken = scene.witnessed.broken();
    assert!(
        broken.len() == 1 && broken[0].starts_with("count-sight at"),
        "{broken:?}"
    );
    assert!(scene.witnessed.broken().is_empty());
}

#[test]
fn an_answer_that_does_not_come_holds_the_others_up_for_a_while_alone() {
    let mut scene = Scene::new();
    // It lies from the second half on, after it said nothing for a while.
    scene.fly(10_000, 100, &|ms, shown| match ms {
        ..4_000 => Some(shown),
        4_000..5_000 => None,
        _ => Some(true),
    });
    assert_eq!(scene.witnessed.broken().len(), 1);
    assert!(scene.witnessed.waiting.len() < 15);
}

/// A trial hears every two seconds what is asked for: that may be done by then.
#[test]
fn a_task_that_was_done_before_anybody_told_of_it_is_to_have_been_seen() {
    let spec = square(1);
    let place = TaskPlace {
        east_mm: 100_000,
        north_mm: 100_000,
    };
    let of = |revision, state| {
        let task = Task {
            revision,
            state,
            places: vec![place],
            ..Task::default()
        };
        let asked = AskedTask {
            number: 3,
            task,
            age_ms: 0,
        };
        let look = AskedLook::of(&spec, &spec.mission, &asked)?;
        Some((look.task, look.pieces.len(), look.carriers.len()))
    };
    assert_eq!(of(1, TaskState::Open), Some(((3, 1), 1, 1)));
    assert_eq!(of(2, TaskState::Done), Some(((3, 1), 1, 1)));
    assert_eq!(of(2, TaskState::Cancelled), None);
    assert_eq!(of(2, TaskState::Expired), None);
}
