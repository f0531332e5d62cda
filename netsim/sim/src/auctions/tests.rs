//! Auctions as short stories.

use super::scene::Instance;
use super::totals::{Tally, Totals};
use super::{Setup, run};

const SMALL: Setup = Setup {
    n: 3,
    tasks: 6,
    hops: 2,
    loss: 0.0,
    partition: false,
};

fn settle(setup: Setup, seeds: std::ops::Range<u64>) -> Totals {
    let mut tally = Tally::default();
    for seed in seeds {
        tally.add(seed, setup.partition, &run(setup, seed));
    }
    tally.totals()
}

/// No conflict, nothing left, never less than sequential greedy, and within so many rounds.
fn check(setup: Setup, seeds: std::ops::Range<u64>, rounds: u32) -> Totals {
    let totals = settle(setup, seeds);
    let t = &totals.registers;
    assert_eq!(totals.failed_seeds, Vec::<u64>::new(), "{setup:?}: {t:?}");
    assert_eq!((t.conflicts, t.unassigned, t.disagreed), (0, 0, 0));
    assert!(t.rounds_p99.unwrap() <= rounds, "{setup:?}: {t:?}");
    totals
}

#[test]
fn few_uavs_come_near_the_optimum() {
    let t = check(SMALL, 0..60, 3 * 2).registers;
    assert!(t.value_ratio_optimum_min.unwrap() >= 0.95, "{t:?}");
    assert!(t.value_ratio_optimum.unwrap() <= 1.0, "{t:?}");
    assert!(t.value_ratio_greedy.unwrap() > 1.0, "{t:?}");
}

#[test]
fn whatever_is_lost_all_agree_in_the_end() {
    for n in [1, 2, 8] {
        let setup = Setup {
            n,
            tasks: 12,
            hops: 3,
            loss: 0.3,
            ..SMALL
        };
        check(setup, 0..6, 8 * 3);
    }
}

#[test]
fn halves_that_both_committed_agree_when_they_meet() {
    let setup = Setup {
        n: 6,
        tasks: 10,
        hops: 3,
        loss: 0.1,
        partition: true,
    };
    check(setup, 0..10, 8 * 3);
}

#[test]
fn no_tasks_or_more_than_fit_are_no_trouble() {
    let none = settle(Setup { tasks: 0, ..SMALL }, 0..2).registers;
    assert_eq!((none.disagreed, none.unassigned), (0, 0));
    let one = Setup {
        n: 1,
        tasks: 60,
        hops: 1,
        ..SMALL
    };
    // One bundle holds forty: the rest waits until some are done.
    let doable = Instance::draw(1, 60, 0).doable() as u64;
    assert_eq!(settle(one, 0..1).registers.unassigned, doable - 40);
}

#[test]
fn the_published_algorithm_agrees_where_nothing_is_lost() {
    let t = settle(SMALL, 0..40).cbba;
    assert_eq!((t.conflicts, t.disagreed), (0, 0), "{t:?}");
    assert!(t.value_ratio_greedy.unwrap() > 0.9, "{t:?}");
}

#[test]
fn a_seed_always_ends_alike() {
    assert_eq!(run(SMALL, 5), run(SMALL, 5));
}
