//! Plans of generated sites hold: `--example generated` asks the same of thousands.

#[path = "../examples/generated/planned.rs"]
mod planned;

use planned::{Outcome, outcome};
use skein_survey::area::{self, Planners};
use skein_verify::generate::Site;

/// Sites: a debug build plans each in about a second.
const SITES: u64 = 16;

#[test]
fn plans_of_generated_sites_hold() {
    let (mut planned, mut told) = (0, Vec::new());
    for seed in 0..SITES {
        match outcome(&Site::of(seed), Planners::Both, false) {
            Outcome::Recounted(report) => {
                planned += 1;
                told.extend(report.violations.iter().map(|v| (seed, v.text.clone())));
            }
            Outcome::NoTrajectory => told.push((seed, "no trajectory".to_owned())),
            Outcome::Refused(why) => assert_eq!(why, "NoPlan(Passes(Launch))", "{seed}"),
        }
    }
    assert!(told.is_empty(), "{told:?}");
    assert!(planned >= SITES / 2, "{planned}");
}

/// On this site six share what sees most worse than four do, unless two of them stay at home.
#[test]
fn more_uavs_are_not_slower() {
    let makespan_s = |uavs| {
        let mut site = Site::of(140_010);
        site.manner.n_uavs = uavs;
        let request = planned::request(&site, Planners::Both, false).unwrap();
        area::plan(&request).unwrap().figures.makespan_s
    };
    let (four_s, six_s) = (makespan_s(4), makespan_s(6));
    assert!(six_s <= four_s, "{six_s} {four_s}");
}
