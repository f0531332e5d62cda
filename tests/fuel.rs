//! A fleet with little fuel sees more where each UAV keeps no more for its way home than that
//! takes from where it is, and everybody comes home with its reserve (decision 98).

use skein_netsim::Prepared;
use skein_netsim::runs::{self, Wanted};
use skein_scenario::{Overrides, builtin_files, builtin_text, parse_with};

/// Helsinki with the base beyond a corner, eight UAVs whose batteries are nearly too small for
/// it, and no faults.
fn short_of_fuel() -> Prepared {
    let mut text = builtin_text("helsinki")
        .expect("a built-in scenario")
        .to_owned();
    for (from, to) in [
        ("endurance_s: 5400", "endurance_s: 560"),
        ("endurance_s: 6600", "endurance_s: 560"),
        ("reserve_s: 300", "reserve_s: 120"),
        (
            "base: { east_m: 528, north_m: 480 }",
            "base: { east_m: -60, north_m: -60 }",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let scenario = parse_with("short", &text, &builtin_files(), &Overrides::default());
    Prepared::new(scenario.expect("it can be flown").spec)
}

#[test]
fn with_little_fuel_everything_is_seen_and_all_come_home_with_their_reserve() {
    let prepared = short_of_fuel();
    for seed in 1..4 {
        let o = runs::run(&prepared, seed, Vec::new(), Wanted::default());
        let found = o.report.violations.as_ref().unwrap();
        assert!(found.counts.is_empty(), "{seed}: {:?}", o.violations());
        // With one figure for the whole loop it was 424, 428 and 423 of 430.
        let seen = o.report.coverage.covered_cells;
        assert_eq!((seen, o.report.completed), (430, true), "seed {seed}");
    }
}
