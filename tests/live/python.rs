//! The Python example sees the swarm, with the Python that `SKEIN_PYTHON` names.
//!
//! `.ci/python` makes one with the packages that the example needs; `.ci/run` uses it.
//! Without one this says that nothing was tested.

#![allow(
    clippy::unwrap_used,
    reason = "a test may panic; the lint's own exception knows no test without a harness"
)]

#[allow(dead_code, reason = "this test needs not all that others do")]
mod support;

use std::time::Duration;
use support::{Place, Trial};

fn main() {
    let filters: Vec<String> = std::env::args().skip(1).collect();
    let mut named = filters.iter().filter(|f| !f.starts_with('-'));
    if named.clone().count() > 0 && !named.any(|f| "python".contains(f.as_str())) {
        println!("python: filtered out");
        return;
    }
    let Ok(python) = std::env::var("SKEIN_PYTHON") else {
        println!(
            "python: SKIPPED, nothing was tested: SKEIN_PYTHON names no Python (.ci/python makes one)"
        );
        return;
    };
    let place = Place::new();
    let mut trial = Trial::start(&place, "python", &["--time-scale", "4"]);
    trial.wait_for_time(6.0, Duration::from_secs(120));
    let script = |file: &str, args: &[&str]| {
        let out = std::process::Command::new(&python)
            .arg(support::root().join(file))
            .args(args)
            .env("TMPDIR", place.path(""))
            .env("SKEIN", env!("CARGO_BIN_EXE_skein"))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&out.stdout) + String::from_utf8_lossy(&out.stderr);
        (out.status.code(), said.into_owned())
    };
    // Without arguments it finds the trial, and tells degrees.
    let (_, said) = script("examples/observe.py", &[]);
    for expected in [
        "live/v4/state/",
        "live/v4/beacon/",
        "live/v4/cover/",
        "peer 1 life",
        "'lat_deg': 60.1",
        "'activity': 'covering'",
    ] {
        let begin: String = said.chars().take(1000).collect();
        assert!(said.contains(expected), "no {expected:?} in: {begin}");
    }
    let entry = place.entry();
    let endpoint = entry["observe"].as_str().unwrap();
    let (code, named) = script("examples/observe.py", &[endpoint, "2"]);
    assert!(
        code == Some(0) && named.contains("'lon_deg': 24.9"),
        "{named}"
    );
    trial.interrupt();
    trial.wait(Duration::from_secs(20));
    let (code, none) = script("examples/observe.py", &[]);
    assert!(
        code == Some(1) && none.contains("start one with `skein trial`"),
        "{none}"
    );
    assert!(!none.contains("Traceback"), "{none}");
    // A simulated run, recorded, reads back.
    let run_dir = place.path("run");
    let (code, told) = place.skein(&["sim", "field", "--run-dir", &run_dir]);
    assert!(code == 0 && told.contains("recorded in"), "{told}");
    let (code, recording) = script("tests/live/recording.py", &[&run_dir]);
    assert!(
        code == Some(0) && recording.contains("recording: ok"),
        "{recording}"
    );
    // Curves of three rates of failure; without failures all of it is seen.
    let picture = place.path("coverage.png");
    let (code, told) = script("examples/coverage.py", &["field", "1", &picture]);
    assert!(
        code == Some(0)
            && told.contains(
                "0 losses per UAV and hour: 0.0 UAVs lost a run, all seen in 1 of 1 runs"
            ),
        "{told}"
    );
    let drawn = std::fs::read(&picture).unwrap();
    assert!(drawn.starts_with(b"\x89PNG"), "{} bytes", drawn.len());
    let (code, told) = script("examples/coverage.py", &["feild", "1", &picture]);
    assert!(
        code == Some(1) && told.contains("did you mean field?"),
        "{told}"
    );
    assert!(!told.contains("Traceback"), "{told}");
    println!("python: ok, {} records seen", said.lines().count());
}
