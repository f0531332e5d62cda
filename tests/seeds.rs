//! Replays the seeds that once failed (`tests/seeds/*.txt`: scenario or `drawn:NUMBER`, seed,
//! `storm` if its faults are drawn, where the UAVs begin, `own` for where the scenario says, and
//! `uavs=2` for another number of them, one a line). Each must complete and break no rule, and the
//! first must give the same history twice.

use skein_netsim::Prepared;
use skein_netsim::runs::{self, Wanted};
use skein_netsim::spec::Spec;
use skein_netsim::swarm::Outcome;
use skein_netsim::world::fixture;
use skein_scenario::drawn::drawn;
use skein_scenario::{Launch, Overrides, builtin_files, builtin_text, open, parse_with};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{available_parallelism, scope};

/// UAVs of the small scenarios.
const N_UAVS: u16 = 8;

fn prepared(scenario: &str, launch: Option<Launch>, uavs: Option<u16>) -> Prepared {
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
        name if name.starts_with("drawn:") => {
            let number = name
                .trim_start_matches("drawn:")
                .parse()
                .expect("drawn:NUMBER");
            drawn(number).expect("it can be flown").scenario.spec
        }
        name => {
            let over = Overrides {
                launch,
                peers: uavs,
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

/// What flies, and how long it takes without faults, milliseconds.
type Flown = (Prepared, u64);

/// One kept line.
struct Kept {
    line: String,
    scenario: String,
    seed: u64,
    is_storm: bool,
    launch: Option<Launch>,
    uavs: Option<u16>,
}

impl Kept {
    /// # Panics
    /// If a line cannot be read: it names the file.
    fn read(file: &Path, line: &str) -> Self {
        let mut words: Vec<&str> = line.split_whitespace().collect();
        let uavs = words.last().and_then(|word| word.strip_prefix("uavs="));
        let uavs: Option<u16> = uavs.map(|n| n.parse().unwrap());
        if uavs.is_some() {
            words.pop();
        }
        let (scenario, seed, is_storm, launch) = match words.as_slice() {
            [scenario, seed, launch] => (scenario, seed, false, launch),
            [scenario, seed, "storm", launch] => (scenario, seed, true, launch),
            _ => panic!(
                "{}: {line:?} needs a scenario, a seed, perhaps the word storm, a launch, and perhaps uavs=N",
                file.display()
            ),
        };
        Self {
            line: line.to_owned(),
            scenario: (*scenario).to_owned(),
            seed: seed.parse().unwrap(),
            is_storm,
            launch: (*launch != "own").then(|| launch.parse().unwrap()),
            uavs,
        }
    }

    /// Of one scenario, launch and number of UAVs all is prepared once.
    fn place(&self) -> String {
        format!("{} {:?} {:?}", self.scenario, self.launch, self.uavs)
    }

    fn fly(&self, (prepared, free_ms): &Flown) -> Outcome {
        if self.is_storm {
            runs::storm(prepared, self.seed, *free_ms, Wanted::default())
        } else {
            runs::planned(prepared, self.seed, Wanted::default())
        }
    }

    /// What it broke, if anything.
    fn failure(&self, outcome: &Outcome) -> Option<String> {
        let (report, broken) = (&outcome.report, outcome.violations());
        let first: Vec<_> = broken.iter().take(3).collect();
        (!report.passed).then(|| format!("{}: {:?} {first:#?}", self.line, report.reasons))
    }
}

/// All kept lines, by file.
fn kept() -> Vec<Kept> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds");
    let files = std::fs::read_dir(folder).unwrap();
    let mut files: Vec<_> = files.map(|f| f.unwrap().path()).collect();
    files.sort();
    let of_file = |file: PathBuf| {
        let text = std::fs::read_to_string(&file).unwrap();
        let lines = text.lines().map(str::trim);
        let lines = lines.filter(|l| !l.is_empty() && !l.starts_with('#'));
        lines
            .map(|line| Kept::read(&file, line))
            .collect::<Vec<_>>()
    };
    files.into_iter().flat_map(of_file).collect()
}

/// What comes of each, by all processors, in no certain order.
fn by_all_processors<T: Sync, R: Send>(all: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let workers = available_parallelism().map_or(1, usize::from);
    scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some(one) = all.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let of_one = work(one);
                    done.lock().unwrap().push(of_one);
                }
            });
        }
    });
    done.into_inner().unwrap()
}

/// Flown by all processors: it is the last test of its binary, and the longest.
#[test]
fn seeds_that_once_failed_hold() {
    let kept = kept();
    assert!(!kept.is_empty(), "no seed is kept");
    // All places first: lines of one stand beside each other, and would wait for each other.
    let unprepared: BTreeMap<String, &Kept> = kept.iter().map(|k| (k.place(), k)).collect();
    let unprepared: Vec<(String, &Kept)> = unprepared.into_iter().collect();
    let places = by_all_processors(&unprepared, |(place, kept)| {
        let prepared = prepared(&kept.scenario, kept.launch, kept.uavs);
        let free_ms = runs::failure_free_makespan_ms(&prepared);
        (place.clone(), (prepared, free_ms))
    });
    let places: BTreeMap<String, Flown> = places.into_iter().collect();
    let broken = by_all_processors(&kept, |k| k.failure(&k.fly(&places[&k.place()])));
    let mut failed: Vec<String> = broken.into_iter().flatten().collect();
    failed.sort();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    // Once is enough to see that a run repeats itself.
    let first = &kept[0];
    let again = [(); 2].map(|()| first.fly(&places[&first.place()]));
    assert_eq!(
        again[0].history_hash, again[1].history_hash,
        "{}",
        first.line
    );
}
