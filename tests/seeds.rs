//! Replays the seeds that once failed (`tests/seeds/*.txt`: scenario, seed, `storm` if its
//! faults are drawn, where the UAVs begin, `own` for where the scenario says, one a line). Each must complete and break no rule, and the first must give the same history
//! twice.

use skein_netsim::Prepared;
use skein_netsim::runs::{self, Wanted};
use skein_netsim::spec::Spec;
use skein_netsim::world::fixture;
use skein_scenario::{Launch, Overrides, builtin_files, builtin_text, open, parse_with};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// UAVs of the small scenarios.
const N_UAVS: u16 = 8;

fn prepared(scenario: &str, launch: Option<Launch>) -> Prepared {
    Prepared::new(match scenario {
        "square" => fixture::square(N_UAVS),
        "open" => {
            let mut spec = fixture::square(N_UAVS);
            spec.zones.clear();
            let mut mission = (*spec.mission).clone();
            mission.zones.clear();
            spec.mission = Arc::new(mission);
            spec
        }
        "walls" => walls(),
        name => {
            let over = Overrides {
                launch,
                ..Overrides::default()
            };
            open(Some(name), &over).expect("a built-in scenario").spec
        }
    })
}

/// Helsinki with a room of three walls around the base, and a round zone.
fn walls() -> Spec {
    let room = "{ ring_m: [[300, 300], [760, 300], [760, 340], [340, 340], \
                [340, 620], [760, 620], [760, 660], [300, 660]] }";
    let round = "{ circle: { east_m: 900, north_m: 150, radius_m: 70 } }";
    let text = builtin_text("helsinki").expect("a built-in scenario");
    let text = text
        .replacen("no_fly: []", &format!("no_fly: [{room}, {round}]"), 1)
        .replacen("min_coverable: 0.97", "min_coverable: 0.85", 1);
    let scenario = parse_with("walls", &text, &builtin_files(), &Overrides::default());
    scenario.expect("it can be flown").spec
}

#[test]
fn seeds_that_once_failed_hold() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|f| f.unwrap().path())
        .collect();
    files.sort();
    let mut prepared_by_name: BTreeMap<String, (Prepared, u64)> = BTreeMap::new();
    let (mut replayed, mut failed) = (0, Vec::new());
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        for line in text
            .lines()
            .map(str::trim)
            .filter(|l| !l.is_empty() && !l.starts_with('#'))
        {
            let words: Vec<&str> = line.split_whitespace().collect();
            let [scenario, seed, storm @ .., launch] = words.as_slice() else {
                panic!(
                    "{}: {line:?} needs a scenario, a seed and a launch",
                    file.display()
                );
            };
            let launch: Option<Launch> = (*launch != "own").then(|| launch.parse().unwrap());
            let seed: u64 = seed.parse().unwrap();
            let (prepared, free_ms) = prepared_by_name
                .entry(format!("{scenario} {launch:?}"))
                .or_insert_with(|| {
                    let prepared = prepared(scenario, launch);
                    let free_ms = runs::failure_free_makespan_ms(&prepared);
                    (prepared, free_ms)
                });
            let run = || match storm {
                ["storm"] => runs::storm(prepared, seed, *free_ms, Wanted::default()),
                [] => runs::planned(prepared, seed, Wanted::default()),
                other => panic!("{}: unknown flags {other:?}", file.display()),
            };
            let first = run();
            let report = &first.report;
            if !report.passed {
                failed.push(format!(
                    "{line}: {:?} {:#?}",
                    report.reasons,
                    first.violations().iter().take(3).collect::<Vec<_>>()
                ));
            }
            // Once is enough to see that a run repeats itself; a run costs about a second.
            if replayed == 0 {
                assert_eq!(first.history_hash, run().history_hash, "{line}");
            }
            replayed += 1;
        }
    }
    assert!(replayed > 0, "no seed was replayed");
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
