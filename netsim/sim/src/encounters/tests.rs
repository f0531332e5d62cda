//! Encounters as short stories: in each everybody arrives, and nobody comes near anybody.

use super::scene::Scene;
use super::totals::{Tally, Totals};
use super::{Air, Radio, SEPARATION_M, run};

const BAD: Radio = Radio::Works(Air {
    loss: 0.3,
    delay_ms: 500,
});
const JAMMED: Radio = Radio::Jammed { range_m: 500.0 };

fn fly(scene: Scene, radio: Radio, seeds: std::ops::Range<u64>) -> Totals {
    let mut tally = Tally::default();
    for seed in seeds {
        tally.add(seed, &run(scene, radio, seed));
    }
    tally.totals()
}

/// Nobody too near, all there; the mean time ratio is at most this.
fn check(scene: Scene, radio: Radio, seeds: std::ops::Range<u64>, ratio: f64) -> Totals {
    let t = fly(scene, radio, seeds);
    assert!(t.runs > 0, "{t:?}");
    assert_eq!(t.losses_of_separation, 0, "{scene:?} {radio:?}: {t:?}");
    assert_eq!(t.failed_seeds, Vec::<u64>::new(), "{scene:?}: {t:?}");
    assert!(t.min_separation_m.unwrap() >= SEPARATION_M, "{t:?}");
    assert!(t.time_ratio_mean.unwrap() <= ratio, "{scene:?}: {t:?}");
    t
}

#[test]
fn two_to_sixteen_cross_a_circle_though_messages_are_lost_and_late() {
    for (n, ratio) in [(2, 1.02), (3, 1.02), (8, 1.10), (16, 1.20)] {
        let t = check(Scene::Circle(n), BAD, 0..2, ratio);
        assert!(t.strayed_max_m < 2.0, "{t:?}");
    }
}

#[test]
fn pairs_from_any_side_keep_apart() {
    let t = check(Scene::Pair, BAD, 0..30, 1.05);
    assert!(t.messages_p99.unwrap() > 4, "they had to negotiate: {t:?}");
}

#[test]
fn pairs_without_a_radio_keep_apart() {
    check(Scene::Pair, JAMMED, 0..60, 1.15);
}

#[test]
fn eight_to_thirty_two_without_a_radio_cross_a_circle() {
    for (n, ratio) in [(8, 1.10), (16, 1.20), (32, 1.45)] {
        check(Scene::Circle(n), JAMMED, 0..3, ratio);
    }
}

#[test]
fn who_flies_straight_on_without_a_rule_comes_near_others() {
    // What is measured can fail: with a sensor that sees nobody, two fly through each other.
    let blind = Radio::Jammed { range_m: 0.0 };
    let t = fly(Scene::Circle(8), blind, 0..2);
    assert!(t.losses_of_separation > 0, "{t:?}");
    assert!(!t.failed_seeds.is_empty());
}

#[test]
fn with_every_message_lost_the_agreed_loiters_stand() {
    let dead = Radio::Works(Air {
        loss: 1.0,
        delay_ms: 0,
    });
    let t = fly(Scene::Circle(4), dead, 0..1);
    assert_eq!(t.losses_of_separation, 0, "{t:?}");
    assert!(t.arrived.abs() < f64::EPSILON, "nobody may leave: {t:?}");
}

#[test]
fn a_seed_always_ends_alike() {
    let once = run(Scene::Circle(5), BAD, 7);
    assert_eq!(once, run(Scene::Circle(5), BAD, 7));
}
