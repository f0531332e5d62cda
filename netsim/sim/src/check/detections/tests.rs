use super::*;
use crate::world::fixture;
use skein_geometry::frame::Vector;
use skein_peer::Follows;

const CAR: u8 = 1;

fn mission(criteria: Vec<Criterion>) -> Mission {
    Mission {
        detections: criteria,
        ..(*fixture::square(1).mission).clone()
    }
}

fn cars() -> Vec<Criterion> {
    vec![Criterion {
        looks: Some(CAR),
        ..Criterion::default()
    }]
}

fn car(x: f64) -> Truth {
    Truth {
        at: Point::new(x, 0.0),
        kind: CAR,
        is_confused: false,
    }
}

fn look(uav: u16, pictured: &[usize]) -> Look {
    Look {
        uav,
        at: Some(Point::new(30.0, 0.0)),
        since_ms: 0,
        says: None,
        pictured: pictured.to_vec(),
    }
}

fn following(uav: u16, author: u16, pictured: &[usize]) -> Look {
    Look {
        says: Some(Follows {
            task: TaskId { author, number: 8 },
            revision: 1,
            at_mm: (0, 0),
            sees: true,
            stand_off_mm: 25_000,
        }),
        ..look(uav, pictured)
    }
}

fn told(seen_ms: u64, x: f64) -> Detection {
    Detection {
        looks: CAR,
        seen_ms,
        east_mm: mm(x),
        error_mm: 8_000,
        ..Detection::default()
    }
}

struct Story {
    check: DetectionCheck,
    found: Findings,
    stability: Stability,
    handicaps: Handicaps,
}

impl Story {
    fn new(criteria: Vec<Criterion>) -> Self {
        let mut check = DetectionCheck::default();
        check.on_mission(&mission(criteria));
        Self {
            check,
            found: Findings::new(1),
            stability: Stability::default(),
            handicaps: Handicaps::default(),
        }
    }

    fn looks(&mut self, s: u64, truth: &[Truth], looks: &[Look]) {
        let ids: Vec<u16> = looks.iter().map(|l| l.uav).collect();
        let graph = Graph::new(ids, |_, _| true);
        self.stability.observe(s * 1000, &graph, |_| 1, 10_000);
        let around = Around {
            graph: &graph,
            stability: &self.stability,
            handicaps: &self.handicaps,
        };
        let found = &mut self.found;
        self.check.on_looks(s * 1000, (truth, looks), around, found);
    }

    fn tell(&mut self, s: u64, by: u16, told: &Detection, truth: &[Truth]) {
        let id = TaskId {
            author: by,
            number: 8,
        };
        let at = (s * 1000, by);
        self.check.on_told(at, (id, told), truth, &mut self.found);
    }

    fn broke(&self, rule: &str) -> bool {
        self.found.counts.contains_key(rule)
    }
}

#[test]
fn what_one_had_in_its_picture_for_long_and_nobody_told_is_found() {
    let missed = |criteria: Vec<Criterion>, seconds: u64, told_s: Option<u64>| {
        let mut story = Story::new(criteria);
        for s in 1..=30 {
            let pictured: &[usize] = if s <= seconds { &[0] } else { &[] };
            story.looks(s, &[car(0.0)], &[look(1, pictured)]);
            if told_s == Some(s) {
                story.tell(s, 1, &told(s * 1000, 3.0), &[car(0.0)]);
            }
        }
        story.broke("detect-missed")
    };
    assert!(missed(cars(), 12, None));
    assert!(!missed(cars(), 12, Some(6)) && !missed(cars(), 12, Some(11)));
    assert!(missed(cars(), 12, Some(20)), "too late");
    // Not for long enough; not of that kind; nothing is looked for.
    assert!(!missed(cars(), 5, None));
    let lorries = vec![Criterion {
        looks: Some(2),
        ..Criterion::default()
    }];
    assert!(!missed(lorries, 12, None));
    assert!(!missed(Vec::new(), 12, None));
    // Who stands is not who drives.
    let driving = vec![Criterion {
        moving: Some(true),
        ..Criterion::default()
    }];
    assert!(!missed(driving, 12, None));
}

#[test]
fn who_saw_it_and_dies_owes_nothing_and_one_that_was_told_elsewhere_says_nothing_of_this() {
    let mut story = Story::new(cars());
    for s in 1..=30 {
        let all = [look(1, &[0])];
        story.looks(s, &[car(0.0)], if s < 10 { &all } else { &[] });
    }
    assert!(!story.broke("detect-missed"));
    let both = [car(0.0), car(400.0)];
    let mut story = Story::new(cars());
    story.tell(1, 1, &told(1_000, 400.0), &both);
    for s in 1..=30 {
        story.looks(s, &both, &[look(1, &[0])]);
    }
    assert!(story.broke("detect-missed"));
}

#[test]
fn what_is_told_has_to_be_there_and_look_so() {
    let falsely = |d: Detection, truth: Truth| {
        let mut story = Story::new(cars());
        story.tell(10, 1, &d, &[truth]);
        story.broke("detect-false")
    };
    assert!(!falsely(told(10_000, 7.0), car(0.0)));
    assert!(falsely(told(10_000, 12.1), car(0.0)));
    let lorry = Truth {
        kind: 2,
        ..car(0.0)
    };
    assert!(falsely(told(10_000, 0.0), lorry));
    let confused = Truth {
        is_confused: true,
        ..lorry
    };
    assert!(!falsely(told(10_000, 0.0), confused));
    // It drove on since it was seen.
    let drives = Detection {
        east_mmps: 6_000,
        ..told(9_000, -6.0)
    };
    assert!(!falsely(drives, car(0.0)));
    assert!(falsely(
        Detection {
            east_mmps: 0,
            ..told(9_000, -20.0)
        },
        car(0.0)
    ));
}

#[test]
fn of_places_that_are_off_by_more_than_was_told_one_of_a_run_may_be_chance() {
    let mut story = Story::new(cars());
    story.tell(10, 1, &told(10_000, 9.0), &[car(0.0)]);
    assert!(!story.broke("detect-false") && story.check.has_found());
    assert_eq!(story.check.reports()[0].vehicle, Some(0));
    story.tell(11, 2, &told(11_000, 7.0), &[car(0.0)]);
    assert!(!story.broke("detect-false"));
    story.tell(12, 3, &told(12_000, 9.0), &[car(0.0)]);
    assert!(story.broke("detect-false"));
}

#[test]
fn two_who_follow_one_vehicle_for_two_tasks_are_found() {
    let twice = |authors: (u16, u16), seconds: u64| {
        let mut story = Story::new(cars());
        story.tell(1, 1, &told(1_000, 0.0), &[car(0.0)]);
        for s in 1..=seconds {
            let looks = [following(1, authors.0, &[0]), following(2, authors.1, &[0])];
            story.looks(s, &[car(0.0)], &looks);
        }
        story.broke("detect-twice")
    };
    assert!(twice((1, 2), 90));
    assert!(!twice((1, 2), 40));
    // One hands over to the other.
    assert!(!twice((1, 1), 90));
}

#[test]
fn who_goes_on_following_what_services_have_reached_is_found() {
    let kept = |follows_s: u64, served: Option<TaskId>| {
        let mut story = Story::new(cars());
        story.tell(1, 1, &told(1_000, 0.0), &[car(0.0)]);
        for s in 1..=100 {
            if s == 5
                && let Some(task) = served
            {
                story.check.on_served((5_000, 2), (task, 1));
            }
            let follows = if s < follows_s {
                following(1, 1, &[0])
            } else {
                look(1, &[0])
            };
            story.looks(s, &[car(0.0)], &[follows, look(2, &[])]);
        }
        (
            story.broke("detect-served"),
            story.check.reports()[0].served_ms,
        )
    };
    let it = TaskId {
        author: 1,
        number: 8,
    };
    assert_eq!(kept(100, Some(it)), (true, Some(5_000)));
    assert_eq!(kept(40, Some(it)), (false, Some(5_000)));
    assert_eq!(kept(100, None), (false, None));
    let other = TaskId { number: 9, ..it };
    assert_eq!(kept(100, Some(other)), (false, None));
}

#[test]
fn what_came_of_each_is_told() {
    let mut story = Story::new(vec![Criterion {
        then: Then::Follow,
        for_ms: 60_000,
        ..Criterion::default()
    }]);
    let there = car(0.0).at + Vector::new(0.0, 0.0);
    let truth = [Truth {
        at: there,
        ..car(0.0)
    }];
    for s in 1..=20 {
        let now = if s < 10 {
            look(1, &[0])
        } else {
            following(1, 1, &[0])
        };
        story.looks(s, &truth, &[now]);
        if s == 6 {
            story.tell(s, 1, &told(6_000, 2.0), &truth);
        }
    }
    let all = story.check.reports();
    assert_eq!(all.len(), 1);
    let r = &all[0];
    assert_eq!(
        (r.vehicle, r.off_mm, r.seen_ms),
        (Some(0), 2_000, Some(1_000))
    );
    assert_eq!((r.followed_ms, r.sight_ms), (Some(10_000), 10_000));
    assert!(
        r.line().contains("5.0 s after it was first in sight"),
        "{}",
        r.line()
    );
    assert!(
        story.found.counts.is_empty(),
        "{:?}",
        story.found.violations
    );
}

/// `lookout` 922012: a UAV that took itself to be ten metres off told two cars that far off.
#[test]
fn what_a_uav_that_errs_by_more_than_it_tells_says_of_several_is_one_error() {
    let broke = |by: [u16; 2], off_m: f64| {
        let mut story = Story::new(cars());
        for (s, uav) in [10, 20].into_iter().zip(by) {
            story.tell(s, uav, &told(s * 1000, off_m), &[car(0.0)]);
        }
        story.broke("detect-false")
    };
    assert!(!broke([1, 2], 7.9));
    assert!(!broke([1, 1], 10.0) && broke([1, 2], 10.0));
    assert!(broke([1, 1], 12.1), "no error is so large");
}
