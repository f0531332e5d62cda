//! What people get wrong at the command line: each mistake is answered with its cause and with
//! what to do instead, and no answer is a panic.

use crate::support::{Place, Trial, alone};
use std::time::Duration;

/// Makes a mistake; each of `wanted` is part of the answer, and the exit code says that it failed.
fn mistaken(place: &Place, words: &[&str], wanted: &[&str]) {
    let (code, said) = place.skein(words);
    assert!(code != 0, "{words:?} went well: {said}");
    assert!(!said.contains("panicked"), "{words:?}: {said}");
    for part in wanted {
        assert!(said.contains(part), "{words:?}: no {part:?} in: {said}");
    }
}

#[test]
fn mistakes_without_a_trial_are_answered_with_what_to_do() {
    let place = Place::new();
    let no_trial = ["no trial is running", "`skein trial`"];
    mistaken(&place, &["chaos", "kill", "1"], &no_trial);
    mistaken(&place, &["observe"], &no_trial);
    mistaken(&place, &["why", "3"], &no_trial);
    mistaken(&place, &["mission", "rtb"], &no_trial);
    mistaken(
        &place,
        &["sim", "helsinky"],
        &["no such file", "did you mean helsinki?"],
    );
    let typo = place.file("typo.json5", "{ name: \"x\", sede: 1 }");
    let found = ["typo.json5:1:14: sede: unknown field", "did you mean seed?"];
    mistaken(&place, &["sim", &typo], &found);
    let torn = place.file("torn.json5", "{ name: \"x\",\n  seed: ");
    mistaken(&place, &["check", &torn], &["torn.json5:2:"]);
    let one = ["expected two numbers", "0..1000"];
    mistaken(&place, &["sim", "helsinki", "--seeds", "5"], &one);
    let many = ["0 UAVs", "1 to 256"];
    mistaken(&place, &["sim", "helsinki", "--peers", "0"], &many);
    mistaken(&place, &["chaos", "kil", "2"], &["'kil'", "'kill'"]);
    let fast = ["--time-scale", "at most 10"];
    mistaken(&place, &["trial", "--time-scale", "99"], &fast);
    mistaken(
        &place,
        &["schema", "stat"],
        &["\"stat\"", "did you mean state?"],
    );
    let empty = place.path("");
    for verb in [vec!["report", &empty], vec!["export", &empty, "--csv"]] {
        mistaken(&place, &verb, &["holds no run.mcap", "skein sim --run-dir"]);
    }
    // Flags may follow places, and places lie in the south and in the west.
    let south = [
        "task",
        "add",
        "line",
        "-33.9,151.2",
        "-33.8,-70.6",
        "--needs",
        "infrared",
    ];
    mistaken(&place, &south, &no_trial);
    let west = [
        "nfz",
        "add",
        "--polygon",
        "-1.5,-70",
        "-1.6,-70",
        "-1.6,-70.1",
        "--id",
        "fire",
    ];
    mistaken(&place, &west, &no_trial);
    let lost = place.path("nowhere.plan");
    mistaken(
        &place,
        &["plan", "cover", &lost],
        &["nowhere.plan", "No such file"],
    );
}

#[test]
fn a_wrong_endpoint_is_answered_with_the_form_of_a_right_one() {
    let place = Place::new();
    let form = "write tcp/127.0.0.1:PORT";
    for wrong in ["10.0.0.1:7447", "tcp/10.0.0.1:7447", "7447", "localhost"] {
        mistaken(&place, &["observe", "--endpoint", wrong], &[wrong, form]);
    }
    let port = crate::support::free_port();
    let nobody = format!("tcp/127.0.0.1:{port}");
    let told = ["no peer answers at", &nobody, "is the trial still running?"];
    mistaken(&place, &["observe", "--endpoint", &nobody], &told);
    let (_, said) = place.skein(&["observe", "--endpoint", &nobody]);
    assert!(
        !said.contains(".rs:"),
        "lines of a library's source: {said}"
    );
}

#[test]
fn mistakes_at_a_running_trial_are_answered_with_what_to_do() {
    let _alone = alone();
    let place = Place::new();
    let mut first = Trial::start(&place, "first", &["--time-scale", "2"]);
    first.wait_for_time(4.0, Duration::from_secs(120));
    let (code, said) = place.skein(&["chaos", "kill", "2"]);
    assert_eq!(code, 0, "{said}");
    let dead = ["uav2 does not run: it ended at", "skein chaos restart 2"];
    mistaken(&place, &["chaos", "kill", "2"], &dead);
    mistaken(&place, &["chaos", "kill", "9"], &["9", "uav1"]);
    let second = Trial::start(&place, "second", &["--time-scale", "2"]);
    let both = ["several trials", "--trial", first.id(), second.id()];
    mistaken(&place, &["chaos", "kill", "1"], &both);
    mistaken(
        &place,
        &["chaos", "--trial", "third", "kill", "1"],
        &["no trial", "third"],
    );
}
