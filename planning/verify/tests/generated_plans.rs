//! Plans of generated sites hold: `--example generated` asks the same of thousands.

#[path = "../examples/generated/planned.rs"]
mod planned;

use planned::{Outcome, outcome};
use skein_survey::area::Planners;
use skein_verify::generate::Site;

/// Sites: a debug build plans each in about a second.
const SITES: u64 = 16;

#[test]
fn plans_of_generated_sites_hold() {
    let (mut planned, mut told) = (0, Vec::new());
    for seed in 0..SITES {
        match outcome(&Site::of(seed), Planners::Both) {
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
