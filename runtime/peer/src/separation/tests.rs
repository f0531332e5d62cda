//! What one UAV says to others that it flies.

use super::*;
use crate::testing::airframe;
use skein_flight::separation::{End, Stretch};
use skein_geometry::frame::Pose;

fn straight_on(from_ms: u64) -> MotionPlan {
    MotionPlan {
        start_ms: from_ms,
        east_mm: 0,
        north_mm: 0,
        heading_e7: 0,
        stretches: vec![Stretch {
            radius_mm: 0,
            length_mm: 300_000,
            airspeed_mmps: 15_000,
        }],
        end: End::Loiter {
            radius_mm: 60_000,
            airspeed_mmps: 15_000,
        },
    }
}

fn conflicts(id: u16, flown: MotionPlan) -> Conflicts {
    let airframe = airframe();
    let apart = Apart {
        detours: Detours {
            airframe,
            separation_m: 30.0,
        },
        tubes_m: 4.0,
        circle_radius_m: 60.0,
        reach: None,
    };
    Conflicts::new(PeerId(id), 0, apart, Motion::new(flown).unwrap())
}

/// One that flies this, and has just said so.
fn flies(flown: MotionPlan) -> Separation {
    let rules = Rules {
        separation_m: 30.0,
        tubes_m: 4.0,
        fastest_mps: 15.0,
        turn_radius_m: 50.0,
    };
    let me = Member {
        id: 1,
        incarnation: 1,
    };
    let mut separation = Separation::new(me, rules, airframe());
    separation.conflicts = Some(conflicts(1, flown));
    separation.clocks = (Time(0), 10_000);
    let _ = separation.speak(10_000);
    assert!(separation.speak(10_400).is_empty(), "nothing is new");
    separation
}

/// What it says once it heard that another offers a flight: whether with all that it flies.
fn says_whole(separation: &mut Separation, other: &Conflicts) -> Option<bool> {
    let record = Record {
        author: 2,
        incarnation: 1,
        seq: 1,
        kind: 10,
        subject: 0,
        body: Vec::new(),
        signature: Vec::new(),
    };
    separation.hear(Time(500), (&record, 0), &other.intent());
    match &separation.speak(10_600)[..] {
        [] => None,
        [Effect::SayNow(Body::Intent(_))] => Some(true),
        [Effect::SayNow(Body::Conflict(_))] => Some(false),
        other => panic!("{other:?}"),
    }
}

#[test]
fn who_asks_to_take_off_is_told_all_that_is_flown_there() {
    let far = |from_ms| MotionPlan {
        north_mm: 900_000,
        ..straight_on(from_ms)
    };
    let at_ms = 13_000;
    let ground = MotionPlan::on_ground(10_000, Pose::new(Default::default(), 0.0));
    let mut stands = conflicts(2, ground.clone());
    assert_eq!(stands.offer(10_400, [(&far(at_ms), 12_600)], None), Some(0));
    assert_eq!(
        says_whole(&mut flies(straight_on(9_000)), &stands),
        Some(true)
    );
    // Another one on the ground is in nobody's way.
    assert_ne!(says_whole(&mut flies(ground), &stands), Some(true));
    // Who flies hears every five seconds what others do.
    let mut in_air = conflicts(2, far(9_000));
    assert_eq!(
        in_air.offer(10_400, [(&far(10_400), 12_600)], None),
        Some(0)
    );
    assert_eq!(
        says_whole(&mut flies(straight_on(9_000)), &in_air),
        Some(false)
    );
}

/// The shortest lead leaves time for one repetition and its answer.
#[test]
fn what_is_not_answered_is_said_again_before_it_would_turn_off() {
    let mut separation = flies(straight_on(9_000));
    let far = MotionPlan {
        north_mm: 900_000,
        ..straight_on(10_600)
    };
    let Some(known) = &mut separation.conflicts else {
        panic!("it flies");
    };
    let turns_off_ms = 10_600 + known.clone().answered_soon().lead_ms();
    assert_eq!(known.offer(10_600, [(&far, turns_off_ms)], None), Some(0));
    let percepts = (10_600..turns_off_ms).step_by(200);
    let said: Vec<u64> = percepts
        .filter(|now_ms| !separation.speak(*now_ms).is_empty())
        .collect();
    assert_eq!(said, [10_600, 11_200]);
    assert!(turns_off_ms >= said[1] + 400, "two percepts for the answer");
}
