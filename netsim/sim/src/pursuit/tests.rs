//! Pursuits as short stories.

use super::roads::tests::grid;
use super::totals::{Tally, Totals};
use super::*;
use skein_geometry::Polygon;
use std::sync::Arc;

fn settings() -> Settings {
    let roads = Roads::of(&grid(8, 180.0)).unwrap();
    Settings {
        wind_mps: 4.0,
        lasts_s: 240.0,
        ..Settings::on(roads)
    }
}

fn fly(settings: &Settings, seeds: std::ops::Range<u64>) -> Totals {
    let mut tally = Tally::default();
    for seed in seeds {
        tally.add(seed, run(settings, seed));
    }
    tally.totals()
}

#[test]
fn without_noise_an_orbit_that_can_be_flown_is_kept_to_half_a_metre() {
    for field in [Field::HOPF, Field::Lyapunov] {
        let t = fly(
            &Settings {
                field,
                ..settings()
            },
            0..4,
        );
        assert!(t.flyable_share > 0.2, "{t:?}");
        assert!(t.rms_standoff_m.unwrap() < 0.5, "{field:?}: {t:?}");
        assert!(t.in_footprint_share.unwrap() >= 0.99, "{t:?}");
        assert_eq!(t.chatter, 0, "{t:?}");
    }
}

#[test]
fn with_noise_targets_stay_in_sight_and_estimates_know_their_errors() {
    let noisy = Settings {
        noise: Some(Noise::usual()),
        ..settings()
    };
    let t = fly(&noisy, 10..14);
    assert!(t.in_footprint_share.unwrap() > 0.98, "{t:?}");
    assert!(t.position_rms_m.unwrap() < 8.0, "{t:?}");
    // Cars are not white noise; the filter may be somewhat too cautious, and no surer.
    let (nees, fused) = (t.nees.unwrap(), t.nees_fused.unwrap());
    assert!((1.0..5.5).contains(&nees) && fused < 5.5, "{t:?}");
}

#[test]
fn who_is_taken_away_is_relieved() {
    let s = Settings {
        noise: Some(Noise::usual()),
        kill: true,
        uavs: 3,
        targets: 2,
        ..settings()
    };
    let t = fly(&s, 20..24);
    assert_eq!(t.trackers_lost, 4);
    assert!(t.reacquired_worst_s.is_some(), "{t:?}");
}

fn block(x: f64, y: f64) -> Polygon {
    let corners = [(x, y), (x + 80.0, y), (x + 80.0, y + 80.0), (x, y + 80.0)];
    Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap()
}

/// A house in each square of the streets.
fn houses(height_m: f64) -> Vec<Building> {
    let all = (0..8).flat_map(|i| (0..8).map(move |k| (f64::from(i), f64::from(k))));
    all.map(|(i, k)| Building {
        footprint: block(i * 180.0 + 50.0, k * 180.0 + 50.0),
        height_m,
    })
    .collect()
}

#[test]
fn who_knows_houses_and_streets_sees_more_and_most_who_is_told() {
    let nothing = Knows {
        buildings: false,
        streets: false,
        searches: false,
        targets: false,
    };
    let told = Knows {
        targets: true,
        ..Knows::default()
    };
    let seen = |knows| {
        let s = Settings {
            buildings: Some(Arc::new(obstacles(&houses(70.0)))),
            noise: Some(Noise::usual()),
            uavs: 1,
            knows,
            ..settings()
        };
        fly(&s, 50..56).in_footprint_share_all.unwrap()
    };
    let (blind, knows, told) = (seen(nothing), seen(Knows::default()), seen(told));
    assert!(knows > blind + 0.03, "{blind} {knows} {told}");
    assert!(told > knows - 0.01, "{blind} {knows} {told}");
}

#[test]
fn who_searches_finds_without_a_map_too() {
    let seen = |searches| {
        let knows = Knows {
            streets: false,
            searches,
            ..Knows::default()
        };
        let s = Settings {
            noise: Some(Noise::usual()),
            target_mps: 20.0,
            uavs: 1,
            knows,
            ..settings()
        };
        fly(&s, 60..66).in_footprint_share_all.unwrap()
    };
    let (glances, searches) = (seen(false), seen(true));
    assert!(searches > glances + 0.02, "{glances} {searches}");
}

#[test]
fn buildings_hide_and_zones_are_kept_clear_of() {
    let houses = houses(60.0);
    let hidden = Settings {
        buildings: Some(Arc::new(obstacles(&houses))),
        ..settings()
    };
    let blind = Settings {
        knows: Knows {
            buildings: false,
            ..Knows::default()
        },
        ..hidden.clone()
    };
    let (t, b) = (fly(&hidden, 30..32), fly(&blind, 30..32));
    assert!(b.hidden_share > 0.02, "{b:?}");
    // Who knows of them flies where they do not.
    assert!(t.hidden_share < b.hidden_share / 2.0, "{t:?} {b:?}");
    let zone = NoFlyZones::new(vec![block(500.0, 500.0), block(900.0, 300.0)]);
    let zoned = Settings {
        zones: Some((zone, 10.0)),
        uavs: 1,
        ..settings()
    };
    let t = fly(&zoned, 40..43);
    assert!(t.in_zone_s < 1.0, "{t:?}");
}

#[test]
fn a_seed_always_ends_alike_and_nobody_to_follow_is_nothing() {
    let s = Settings {
        noise: Some(Noise::usual()),
        lasts_s: 60.0,
        ..settings()
    };
    assert_eq!(run(&s, 7), run(&s, 7));
    let nobody = fly(
        &Settings {
            targets: 0,
            ..s.clone()
        },
        0..1,
    );
    assert_eq!(
        (nobody.rms_standoff_m, nobody.in_footprint_share),
        (None, None)
    );
    let no_uavs = fly(&Settings { uavs: 0, ..s }, 0..1);
    assert_eq!(no_uavs.runs, 1);
}
