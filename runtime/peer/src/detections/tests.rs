use super::*;
use crate::criteria::STILL_MMPS;

const CAR: u8 = 1;

fn seen(number: u32, seen_ms: u64, at: (f64, f64), velocity: (f64, f64)) -> Seen {
    Seen {
        name: TargetName { author: 3, number },
        looks: CAR,
        seen_ms,
        at: Point::new(at.0, at.1),
        velocity_mps: Vector::new(velocity.0, velocity.1),
        error_m: 8.0,
    }
}

fn nobody(_: TaskId) -> Option<Place> {
    None
}

#[test]
fn what_was_told_is_not_told_again() {
    let mut all = Detections::default();
    let first = seen(1, 10_000, (0.0, 0.0), (0.0, 0.0));
    all.tell(3, (0, 0), &first).unwrap();
    let told = |s: &Seen| all.is_told(0, s, &nobody);
    // Under its name; at its place; not elsewhere, not of other looks, not of another sortie.
    assert!(told(&seen(1, 90_000, (400.0, 0.0), (0.0, 0.0))));
    assert!(told(&seen(2, 90_000, (25.0, 0.0), (0.0, 0.0))));
    assert!(!told(&seen(2, 90_000, (60.0, 0.0), (0.0, 0.0))));
    let lorry = Seen {
        looks: 2,
        ..seen(2, 11_000, (0.0, 0.0), (0.0, 0.0))
    };
    assert!(!told(&lorry));
    assert!(!all.is_told(1, &first, &nobody));
}

#[test]
fn who_drives_may_have_come_here_since_and_who_is_followed_is_where_that_is_told() {
    let mut all = Detections::default();
    let (id, _) = all
        .tell(3, (0, 0), &seen(1, 10_000, (0.0, 0.0), (6.0, 0.0)))
        .unwrap();
    let here = |s: u64, x: f64| seen(2, 1_000 * s, (x, 0.0), (6.0, 0.0));
    assert!(all.is_told(0, &here(30, 200.0), &nobody));
    assert!(!all.is_told(0, &here(30, 230.0), &nobody));
    let followed = |d: TaskId| {
        (d == id).then_some(Place {
            at: Point::new(120.0, 0.0),
            unseen_s: 0.4,
        })
    };
    assert!(all.is_told(0, &here(30, 130.0), &followed));
    assert!(!all.is_told(0, &here(30, 200.0), &followed));
    // Who follows it lost it: it may be anywhere that it can have reached.
    let lost = |d: TaskId| followed(d).map(|p| Place { unseen_s: 9.0, ..p });
    assert!(all.is_told(0, &here(30, 200.0), &lost));
}

#[test]
fn of_two_of_one_object_the_later_is_withdrawn_by_whose_it_is() {
    let at_once = |number, ms| seen(number, ms, (3.0, 2.0), (6.0, 0.0));
    let mut mine = Detections::default();
    let mut theirs = Detections::default();
    let (a, told_a) = mine.tell(3, (0, 0), &at_once(1, 10_000)).unwrap();
    let (b, told_b) = theirs.tell(5, (0, 0), &at_once(2, 11_000)).unwrap();
    assert!(mine.hear(b, told_b, 0) && theirs.hear(a, told_a, 0));
    assert!(!mine.hear(b, told_b, 0), "it is no news twice");
    assert!(mine.withdraw(3, &nobody).is_empty());
    let withdrawn = theirs.withdraw(5, &nobody);
    assert_eq!(withdrawn.len(), 1);
    assert_eq!(withdrawn[0].0, b);
    assert!(theirs.withdraw(5, &nobody).is_empty());
    assert!(mine.hear(b, withdrawn[0].1, 0));
    assert_eq!(mine.standing(0).count(), 1);
    assert!(mine.goes_before(a, b) && !mine.goes_before(b, a));
    // Minutes apart two who drive may be two.
    let mut later = Detections::default();
    let (c, told_c) = later.tell(7, (0, 0), &at_once(3, 200_000)).unwrap();
    assert!(later.hear(a, told_a, 0) && later.withdraw(7, &nobody).is_empty());
    // As long as nobody sees both at one place.
    let there = Place {
        at: Point::new(50.0, 0.0),
        unseen_s: 0.2,
    };
    let both = |id: TaskId| [a, c].contains(&id).then_some(there);
    assert_eq!(later.withdraw(7, &both).len(), 1);
    let _ = told_c;
}

#[test]
fn a_life_tells_of_eight_and_the_next_uses_other_registers() {
    let mut all = Detections::default();
    all.begin_life(2);
    let far = |n: u32| seen(n, 1_000, (f64::from(n) * 500.0, 0.0), (0.0, 0.0));
    let told: Vec<u16> = (0..12)
        .filter_map(|n| all.tell(3, (0, 0), &far(n)))
        .map(|(id, _)| id.number)
        .collect();
    assert_eq!(told, (16..24).collect::<Vec<u16>>());
    assert_eq!(all.count(0, 0), 8);
    all.begin_life(9);
    assert_eq!(all.tell(3, (0, 0), &far(20)).unwrap().0.number, 8);
}

#[test]
fn at_most_so_many_are_kept() {
    let mut all = Detections::default();
    let told = Detection::default();
    let kept = (0..400).filter(|n| {
        let id = TaskId {
            author: 1 + n / 64,
            number: n % 64,
        };
        all.hear(id, told, 0)
    });
    assert_eq!(kept.count(), KNOWN_MAX);
}

#[test]
fn a_false_alarm_is_not_seen_and_a_car_is_after_three_seconds() {
    use skein_flight::tracking::estimate::Detection as Look;
    use skein_flight::tracking::tracks::{Kind, Sighting};
    let mut tracks = Tracks::new(3, 5.0);
    let mut all = Detections::default();
    let mut first_ms = None;
    for k in 0..40_u64 {
        let now_ms = 10_000 + 200 * k;
        let x = 6.0 * 0.2 * f64::from(u32::try_from(k).unwrap());
        let car = Sighting {
            detection: Look::round(Point::new(x, 0.0), 0.6),
            kind: Kind(CAR),
        };
        let mut look = vec![car];
        // Now and then something that is nothing, where it was before.
        if k % 7 == 0 {
            look.push(Sighting {
                detection: Look::round(Point::new(30.0, 40.0), 0.6),
                kind: Kind(2),
            });
        }
        tracks.look(now_ms, &look, &|_| true);
        all.watch(now_ms, &tracks);
        let seen: Vec<Seen> = all.seen(now_ms, &tracks, 2.0).collect();
        assert!(seen.iter().all(|s| s.looks == CAR), "{seen:?}");
        if let Some(s) = seen.first() {
            first_ms.get_or_insert(now_ms);
            assert!((s.velocity_mps.norm() - 6.0).abs() < 1.0, "{s:?}");
            assert!(s.speed_mmps() > STILL_MMPS && s.error_m < 12.0);
        }
    }
    assert!(
        (13_000..14_500).contains(&first_ms.unwrap()),
        "{first_ms:?}"
    );
}

#[test]
fn what_an_earlier_life_told_is_found() {
    let mut all = Detections::default();
    let id = |author| TaskId { author, number: 8 };
    assert!(all.hear(id(3), Detection::default(), 1));
    assert!(all.hear(id(5), Detection::default(), 2));
    let former = |all: &Detections| all.former(&|author| (author < 9).then_some(2));
    assert_eq!(former(&all), [id(3)]);
    all.void(id(3));
    assert!(former(&all).is_empty());
    assert_eq!(all.standing(0).count(), 1);
}

#[test]
fn who_gets_the_name_of_one_that_was_lost_is_as_fast_as_it_is_itself() {
    use skein_flight::tracking::estimate::Detection as Look;
    use skein_flight::tracking::tracks::{Kind, Sighting};
    let lorry = |x: f64, y: f64| Sighting {
        detection: Look::round(Point::new(x, y), 0.6),
        kind: Kind(2),
    };
    let mut tracks = Tracks::new(3, 5.0);
    let mut all = Detections::default();
    let mut speeds = Vec::new();
    for k in 0..40_u64 {
        let now_ms = 10_000 + 200 * k;
        // One drives for two seconds and is seen no more; another, which stands, comes into the
        // picture not far from there before the first is given up.
        let driven_m = 8.0 * 0.2 * f64::from(u32::try_from(k).unwrap());
        let mut look = Vec::new();
        if k < 10 {
            look.push(lorry(driven_m, 0.0));
        } else {
            look.push(lorry(30.0, 12.0));
        }
        tracks.look(now_ms, &look, &|_| true);
        all.watch(now_ms, &tracks);
        let seen = all.seen(now_ms, &tracks, 2.0);
        speeds.extend(seen.map(|s| (s.name.number, s.speed_mmps())));
    }
    let heir = speeds.first().expect("it is seen beyond doubt");
    assert_eq!(heir.0, 1, "it has the name of the first");
    assert!(heir.1 < STILL_MMPS, "{speeds:?}");
}

#[test]
fn who_is_found_again_is_as_fast_as_it_is_from_then_on() {
    use skein_flight::tracking::estimate::Detection as Look;
    use skein_flight::tracking::tracks::{Kind, Sighting};
    let bus = |x: f64, y: f64| Sighting {
        detection: Look::round(Point::new(x, y), 0.6),
        kind: Kind(3),
    };
    let mut tracks = Tracks::new(3, 5.0);
    let mut all = Detections::default();
    let mut speeds = Vec::new();
    for k in 0..100_u64 {
        let now_ms = 10_000 + 200 * k;
        // It drives for two seconds, is behind a house for twelve, has turned round meanwhile and
        // stands.
        let look = match k {
            0..10 => vec![bus(6.0 * 0.2 * f64::from(u32::try_from(k).unwrap()), 0.0)],
            10..70 => Vec::new(),
            _ => vec![bus(-10.0, 40.0)],
        };
        tracks.look(now_ms, &look, &|_| !look.is_empty());
        all.watch(now_ms, &tracks);
        let seen = all.seen(now_ms, &tracks, 2.0);
        speeds.extend(seen.map(|s| (s.name.number, s.speed_mmps())));
    }
    let found = speeds.first().expect("it is seen beyond doubt");
    assert_eq!(found.0, 1, "it has its name");
    assert!(found.1 < STILL_MMPS, "{speeds:?}");
}
