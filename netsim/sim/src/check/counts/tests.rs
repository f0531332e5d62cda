//! What is counted beside what is true, on scenes made by hand.

use super::*;
use skein_geometry::frame::Pose;

fn mission(what: Counted) -> Mission {
    let mut mission = (*crate::world::fixture::square(1).mission).clone();
    mission.counts = vec![CountSite {
        name: "north".to_owned(),
        what,
        ring: vec![
            (-10_000, -10_000),
            (10_000, -10_000),
            (10_000, 10_000),
            (-10_000, 10_000),
        ],
        capacity: 0,
    }];
    mission
}

/// A UAV that flies over a site from one place to another at 10 m/s, and what it says.
struct Scene {
    check: CountCheck,
    found: Findings,
    sites: u32,
    is_late: bool,
    displaced_m: f64,
    is_open: bool,
}

impl Scene {
    fn new(what: Counted) -> Self {
        let mission = mission(what);
        let mut check = CountCheck::default();
        check.on_mission(&mission);
        check.on_able([1].into());
        Self {
            check,
            found: Findings::new(0),
            sites: mission.sites_hash(),
            is_late: false,
            displaced_m: 0.0,
            is_open: true,
        }
    }

    /// Looks five times a second from one second to another; cars pass the site each four seconds,
    /// and the UAV tells `passed` of them after so many seconds.
    fn look(&mut self, (from_s, to_s): (u32, u32), at: Point, says: &dyn Fn(f64) -> (bool, Count)) {
        for look in 5 * from_s..5 * to_s {
            let s = f64::from(look) / 5.0;
            // Each drives 40 m to the north at 10 m/s and begins anew in the south.
            let car = Point::new(0.0, -20.0 + 10.0 * (s % 4.0));
            let parked = Point::new(5.0, 5.0);
            let (counts, count) = says(s);
            let counted = [(
                counts,
                Count {
                    sites: self.sites,
                    ..count
                },
            )];
            let look = CountLook {
                is_late: self.is_late,
                uav: 1,
                picture: Picture::level(Pose::new(at, 0.0), (40.0, 30.0)),
                sees: &|_| self.is_open,
                displaced_m: self.displaced_m,
                counted: &counted,
            };
            let now_ms = (s * 1000.0).round() as u64;
            self.check
                .on_look(now_ms, &[car, parked], look, &mut self.found);
        }
    }

    fn broken(&self) -> Vec<&'static str> {
        self.found.counts.keys().copied().collect()
    }
}

/// A count that is right but for a share.
fn counting(share: f64) -> impl Fn(f64) -> (bool, Count) {
    move |s| {
        let passed = (s / 4.0 * share).round() as u32;
        let count = Count {
            watched_ms: (s * 1000.0) as u64,
            passed,
            ..Count::default()
        };
        (true, count)
    }
}

#[test]
fn a_right_count_passes_and_one_that_is_half_or_twice_of_it_does_not() {
    for (share, broken) in [(1.0, vec![]), (0.5, vec!["count"]), (2.0, vec!["count"])] {
        let mut scene = Scene::new(Counted::Passing);
        scene.look((0, 80), Point::origin(), &counting(share));
        scene.check.on_end(80_000, &mut scene.found);
        assert_eq!(scene.broken(), broken, "{share}");
    }
    let mut scene = Scene::new(Counted::Passing);
    scene.look((0, 80), Point::origin(), &counting(1.0));
    let known = [SiteCount {
        watched_ms: 80_000,
        passed: 20,
        ..SiteCount::default()
    }];
    let report = &scene.check.reports(80_000, &known)[0];
    assert_eq!(report.passed_in_pictures, 20, "{report:?}");
    assert_eq!((report.passed.0, report.counted.0), (20, 20));
    assert_eq!(report.holds(), Some(true));
    assert!(report.line().contains("truly 20 while it was counted"));
}

/// Of who drives into a lot nothing is told.
#[test]
fn what_passes_where_who_stands_is_counted_is_no_count() {
    for (what, broken) in [
        (Counted::Standing, vec![]),
        (Counted::Passing, vec!["count"]),
    ] {
        let mut scene = Scene::new(what);
        scene.look((0, 80), Point::origin(), &counting(0.0));
        scene.check.on_end(80_000, &mut scene.found);
        assert_eq!(scene.broken(), broken, "{what:?}");
    }
}

/// A place that is off puts those on the wrong side who drive over the outline just then.
#[test]
fn whoever_was_near_the_outline_at_an_edge_of_a_watch_may_be_counted_or_not() {
    let edges = |begun, near, near_now| Edges {
        begun,
        near,
        near_now,
        ..Edges::default()
    };
    // Where one that is far off looks at those who wait near the outline all may be miscounted.
    let queue = |within, within_now| Edges {
        within,
        within_now,
        ..edges(2, 4, 1)
    };
    for (says, edges, off) in [
        (5, edges(2, 1, 0), true),
        (5, edges(2, 4, 1), false),
        (7, edges(2, 4, 1), true),
        (7, queue(3, 1), false),
        (8, queue(3, 1), true),
        (5, queue(1, 0), false),
        (5, edges(3, 0, 0), false),
    ] {
        assert_eq!(is_off(says, 1, &edges), off, "{says} {edges:?}");
    }
    for (displaced_m, within) in [(0.0, 0), (4.5, 0), (5.5, 2)] {
        let mut scene = Scene::new(Counted::Passing);
        scene.displaced_m = displaced_m;
        scene.look((0, 8), Point::origin(), &|s| {
            (s < 4.0, counting(1.0)(s.min(4.0)).1)
        });
        let edges = scene.check.watchers[&1].watches[0].edges;
        // The parked one stands five metres from it, the other one begins ten metres outside.
        assert_eq!((edges.begun, edges.near, edges.near_now), (1, 2, 0));
        assert_eq!(edges.within, within, "{displaced_m} m");
    }
}

#[test]
fn who_counts_at_what_is_not_in_its_picture_is_found_and_who_counts_at_nothing_too() {
    let mut scene = Scene::new(Counted::Passing);
    scene.look((0, 8), Point::new(25.0, 0.0), &counting(1.0));
    assert_eq!(scene.broken(), ["count-sight"]);
    // Of a late computer it is of where its UAV was.
    let mut scene = Scene::new(Counted::Passing);
    scene.is_late = true;
    scene.look((0, 8), Point::new(25.0, 0.0), &counting(1.0));
    assert!(scene.broken().is_empty());
    let mut scene = Scene::new(Counted::Passing);
    scene.look((0, 40), Point::origin(), &|_| (false, Count::default()));
    scene.check.on_end(40_000, &mut scene.found);
    assert_eq!(scene.broken(), ["count-idle"]);
    // What buildings hide that the mission tells nobody can count.
    for is_told in [true, false] {
        let mut scene = Scene::new(Counted::Passing);
        scene.is_open = false;
        let mut mission = mission(Counted::Passing);
        mission.buildings = is_told.then(std::sync::Arc::default);
        scene.check.on_mission(&mission);
        scene.look((0, 40), Point::origin(), &|_| (false, Count::default()));
        scene.check.on_end(40_000, &mut scene.found);
        assert_eq!(scene.broken().is_empty(), is_told);
    }
    // Of whom it is not asked it is not: it is on its way home, say.
    let mut scene = Scene::new(Counted::Passing);
    scene.check.on_able(BTreeSet::new());
    scene.look((0, 40), Point::origin(), &|_| (false, Count::default()));
    scene.check.on_end(40_000, &mut scene.found);
    assert!(scene.broken().is_empty());
}

#[test]
fn another_life_counts_from_nothing_and_what_the_first_counted_is_kept() {
    let mut scene = Scene::new(Counted::Passing);
    scene.look((0, 20), Point::origin(), &counting(1.0));
    let anew = |s: f64| counting(1.0)(s - 20.0);
    scene.look((20, 40), Point::origin(), &anew);
    assert!(scene.broken().is_empty(), "{:?}", scene.found);
    let report = &scene.check.reports(40_000, &[])[0];
    assert_eq!(report.counted.0, 10, "{report:?}");
}

#[test]
fn who_stands_is_compared_once_the_look_is_over() {
    for (standing, broken) in [(1, vec![]), (0, vec![]), (3, vec!["occupancy"])] {
        let mut scene = Scene::new(Counted::Standing);
        let says = |s: f64| {
            let count = Count {
                watched_ms: (s * 1000.0) as u64,
                standing,
                seen_ms: 1 + (s.min(10.0) * 1000.0) as u64,
                ..Count::default()
            };
            (s <= 10.0, count)
        };
        scene.look((0, 12), Point::origin(), &says);
        assert_eq!(scene.broken(), broken, "{standing}");
        let report = &scene.check.reports(12_000, &[])[0];
        assert_eq!(report.stands, 1);
    }
}

/// `parking` 922012: a UAV that took itself to be ten metres off counted 13 of 17, of whom most stood
/// at the outline.
#[test]
fn who_stands_at_the_outline_may_be_on_either_side_of_it_for_one_who_errs_by_much() {
    let scene = Scene::new(Counted::Standing);
    let site = &scene.check.sites[0];
    let out_m = site.radius_m;
    // In the middle, near the outline outside of it, and far away; the last one drives through.
    let places = [0.0, out_m + 1.0, 10.0 * out_m, 0.0].map(|x| Point::new(x, 0.0));
    let speeds = [0.0, 0.0, 0.0, 5.0];
    let stood = |displaced_m| {
        let s = site.stood(&places, &speeds, displaced_m);
        (s.there, s.least, s.most)
    };
    assert_eq!(stood(0.0), (1, 1, 1));
    assert_eq!(stood(DISPLACED_M), (1, 1, 1), "no more than usual");
    assert_eq!(stood(out_m), (1, 0, 2));
    let slow = site.stood(&places, &[1.0; 4], 0.0);
    assert_eq!(
        (slow.there, slow.least, slow.most),
        (0, 0, 2),
        "it may stand"
    );
}
