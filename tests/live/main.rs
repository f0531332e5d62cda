//! Real processes over real Zenoh on 127.0.0.1: launch, kill and takeover, cut and
//! heal, restart, an operator, observation, and nothing left behind; and all commands that the
//! tutorials and the README name. Observation from Python is a test of its own, `python`.
//!
//! Each test has a deadline. Trials run one after the other, because each wants the
//! whole machine; where two are to run side by side, one test starts both.

#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod commands;
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod mistakes;
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod operator;
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod readme;
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod support;
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod terminal;
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tutorials;
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod watched;

use serde_json::Value;
use std::time::Duration;
use support::{Place, Trial, alone};

/// A trial of the small scenario takes some ten seconds; a slow machine slows it down.
const DEADLINE: Duration = Duration::from_secs(120);

#[test]
fn a_killed_uav_is_taken_over_and_observers_see_the_swarm() {
    let _alone = alone();
    let place = Place::new();
    let mut trial = Trial::start(&place, "square", &["--time-scale", "4"]);
    trial.wait_for_time(6.0, DEADLINE);
    trial.assert_loopback_only();
    let (code, said) = place.skein(&["chaos", "kill", "uav2"]);
    assert_eq!(code, 0, "{said}");
    assert!(
        said.contains("uav2 is gone") && said.contains("expect: uav2 suspected within"),
        "{said}"
    );
    let (code, said) = place.skein(&["chaos", "kill", "9"]);
    assert_eq!(code, 4, "{said}");
    assert!(said.contains("there is no peer 9"), "{said}");
    observe(&place);

    let verdict = trial.verdict(DEADLINE);
    assert_eq!(verdict["passed"], true, "{verdict:#}");
    let kill = &verdict["kills"][0];
    assert_eq!(kill["peer"], 2);
    assert_eq!(kill["left"], 0, "{kill:#}");
    assert!(kill["cells_held"].as_u64().unwrap() > 0, "{kill:#}");
    assert!(kill["detection_ms"].as_u64().unwrap() > 0, "{kill:#}");
    assert!(
        !kill["taken_over_by"].as_array().unwrap().is_empty(),
        "{kill:#}"
    );
    assert_eq!(
        verdict["coverage"]["covered_cells"],
        verdict["coverage"]["coverable_cells"]
    );
    assert_eq!(verdict["finished"].as_array().unwrap().len(), 3);
    assert_eq!(place.processes(), Vec::<u32>::new());
}

/// `skein observe` hears every live UAV, and explains itself when nobody is there.
fn observe(place: &Place) {
    let (code, said) = place.skein(&[
        "observe",
        "live/v4/state/**",
        "--timeout",
        "4",
        "--format",
        "jsonl",
    ]);
    assert_eq!(code, 0, "{said}");
    let lines: Vec<Value> = said
        .lines()
        .filter_map(|l| serde_json::from_str(l).ok())
        .collect();
    for id in [1, 3, 4] {
        assert!(
            lines
                .iter()
                .any(|l| l["author"] == id && l["kind"] == "state"),
            "uav{id} is not seen: {said}"
        );
    }
    let (code, said) = place.skein(&["observe", "--endpoint", "tcp/127.0.0.1:9", "--timeout", "1"]);
    assert_eq!(code, 4);
    assert!(said.contains("0 peers"), "{said}");
}

#[test]
fn a_partition_heals_and_restarts_bring_peers_back_in_two_trials_side_by_side() {
    let _alone = alone();
    let place = Place::new();
    let mut cut = Trial::start(&place, "cut", &["--time-scale", "5"]);
    let mut restart = Trial::start(&place, "restart", &["--time-scale", "5"]);
    cut.wait_for_time(8.0, DEADLINE);
    restart.wait_for_time(8.0, DEADLINE);
    let (code, said) = place.skein(&["chaos", "heal"]);
    assert_eq!(code, 4);
    assert!(said.contains("several trials are running"), "{said}");
    let done = |trial: &Trial, args: &[&str]| {
        let args = [&["chaos", "--trial", trial.id()], args].concat();
        let (code, said) = place.skein(&args);
        assert_eq!(code, 0, "{said}");
        assert!(said.contains("expect:"), "{said}");
    };
    done(&cut, &["partition", "1,2", "3,4,100", "--for", "30"]);
    done(&restart, &["restart", "2"]);
    done(&restart, &["kill", "3"]);
    done(&restart, &["restart", "3", "--fresh-disk"]);

    let verdict = cut.verdict(DEADLINE);
    assert_eq!(verdict["passed"], true, "{verdict:#}");
    assert!(
        verdict["swarm"]["splits"].as_u64().unwrap() >= 1
            && verdict["swarm"]["merges"].as_u64().unwrap() >= 1,
        "{verdict:#}"
    );
    assert!(
        verdict["radio"]["link_cuts"]["fault"].as_u64().unwrap() >= 6,
        "{verdict:#}"
    );

    let verdict = restart.verdict(DEADLINE);
    assert_eq!(verdict["passed"], true, "{verdict:#}");
    for (row, fresh_disk) in [(0, false), (1, true)] {
        let r = &verdict["restarts"][row];
        assert_eq!(r["fresh_disk"], fresh_disk);
        assert!(
            r["incarnation_after"].as_u64().unwrap() > r["incarnation_before"].as_u64().unwrap(),
            "{r:#}"
        );
        assert!(r["productive_ms"].as_u64().is_some(), "{r:#}");
    }
    assert_eq!(place.processes(), Vec::<u32>::new());
}

#[test]
fn a_trial_that_is_killed_with_a_paused_peer_leaves_no_process() {
    let _alone = alone();
    let place = Place::new();
    let mut trial = Trial::start(&place, "killed", &[]);
    trial.wait_for_time(2.0, DEADLINE);
    assert!(
        place.processes().len() >= 6,
        "a trial, a guard, five peers: {:?}",
        place.processes()
    );
    let (code, said) = place.skein(&["chaos", "pause", "1"]);
    assert_eq!(code, 0, "{said}");
    trial.kill();
    support::wait_until(Duration::from_secs(10), "all processes are gone", || {
        place.processes().is_empty()
    });
    let (code, said) = place.skein(&["watch", "--web"]);
    assert_eq!(code, 4, "{said}");
    assert!(said.contains("start one with `skein trial`"), "{said}");
    let (code, said) = place.skein(&["observe"]);
    assert_eq!(code, 4);
    assert!(said.contains("no trial is running"), "{said}");
}

#[test]
fn an_interrupted_trial_ends_its_peers_even_a_paused_one() {
    let _alone = alone();
    let place = Place::new();
    let mut trial = Trial::start(&place, "interrupted", &[]);
    trial.wait_for_time(2.0, DEADLINE);
    let (code, said) = place.skein(&["chaos", "pause", "3"]);
    assert_eq!(code, 0, "{said}");
    trial.interrupt();
    assert_eq!(trial.wait(Duration::from_secs(15)), Some(4));
    assert_eq!(place.processes(), Vec::<u32>::new());
}

/// Many more processes than this machine has processors, at a pace that it cannot hold:
/// time runs slower, hardly anybody loiters for want of a setpoint, all is seen and all say
/// so.
#[test]
fn a_starved_swarm_flies_slower_and_ends_its_mission() {
    let _alone = alone();
    let place = Place::new();
    let mut trial = Trial::start(&place, "starved", &["--peers", "20", "--time-scale", "10"]);
    let report = trial.verdict(2 * DEADLINE);
    let live = &report["live"];
    assert_eq!(report["completed"], true, "{report:#}");
    assert_eq!(report["finished"].as_array().unwrap().len(), 20);
    let number = |v: &Value| v.as_f64().unwrap();
    assert!(number(&live["mean_time_scale"]) <= 10.1, "{live:#}");
    assert!(number(&live["starved"]) <= 10.0, "{live:#}");
    // Percepts come five times a second, and hardly one of a UAV goes without an answer.
    let hz = number(&live["setpoints"]) / number(&report["peer_ms"]) * 1000.0 * 21.0 / 20.0;
    assert!((4.5..=5.1).contains(&hz), "{hz}: {live:#}");
    assert!(number(&live["processes"]["peak_mb_max"]) > 1.0, "{live:#}");
    assert_eq!(place.processes(), Vec::<u32>::new());
}

#[test]
fn whoever_stops_reading_is_no_error() {
    let place = Place::new();
    let square = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/live/square.json5");
    for args in [["check", square], ["sim", square]] {
        assert_eq!(place.unread(&args), (0, String::new()), "{args:?}");
    }
}

#[test]
fn wrong_configurations_are_named_with_their_place() {
    let place = Place::new();
    let example = std::fs::read_to_string(support::root().join("configs/peer.json5")).unwrap();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp/{}", taken.local_addr().unwrap());
    let cases = [
        ("lease_ms: 500", "lease: 500", "peer.json5:"),
        (
            "tcp/127.0.0.1:0",
            "tcp/0.0.0.0:0",
            "nothing listens or connects beyond 127.0.0.1",
        ),
        ("tcp/127.0.0.1:0", &port, "in use"),
    ];
    for (right, wrong, message) in cases {
        let file = place.file("peer.json5", &example.replace(right, wrong));
        let (code, said) = place.skein(&["peer", "--config", &file]);
        assert_eq!(code, 3, "{said}");
        assert!(said.contains(message), "{said}");
    }
    let (code, said) = place.skein(&["peer", "--config", "/nowhere.json5"]);
    assert!(code == 3 && said.contains("/nowhere.json5"), "{said}");
    // A valid file whose world is not there: nobody to fly for.
    let file = place.file(
        "peer.json5",
        &example.replace("127.0.0.1:4000", "127.0.0.1:9"),
    );
    let (code, said) = place.skein(&["peer", "--config", &file]);
    assert!(code == 4 && said.contains("cannot be reached"), "{said}");
}
