//! What peers of a live trial say of what they see: judged beside what is true, and reported.

use crate::support::{Place, alone, root};
use serde_json::Value;
use std::fs;

/// A trial that is built in, with some of its text put otherwise, as a file of its own.
fn changed(place: &Place, trial: &str, changes: &[(&str, &str)]) -> String {
    let text = fs::read_to_string(root().join("configs/trials").join(trial)).unwrap();
    let changed = changes.iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    place.file(trial, &changed)
}

/// What a trial reports, which passes.
fn passed(place: &Place, file: &str) -> Value {
    let (code, said) = place.skein(&["trial", file, "--format", "json"]);
    // The report, and then what the trial told on its way.
    let mut said = serde_json::Deserializer::from_str(&said).into_iter::<Value>();
    let report = said.next().unwrap().unwrap();
    assert!(code == 0 && report["passed"] == true, "{report:#}");
    report
}

/// Two minutes above the four crossings, by three UAVs that all stay; a street is measured
/// besides.
fn crossings(place: &Place) -> String {
    let streets = "streets: { ways_m: [[[150, 150], [550, 150]], [[150, 350], [550, 350]], \
                   [[350, 150], [350, 350]]] },";
    let shorter = format!("for_s: 120, {streets}");
    let changes = [
        ("for_s: 900,", shorter.as_str()),
        ("count: 4, airframes", "count: 3, airframes"),
        ("{ at_s: 400, kind: \"kill\", peer: 3 },", ""),
        ("max_kills: 3", "max_kills: 2"),
    ];
    changed(place, "crossings.json5", &changes)
}

#[test]
fn what_uavs_say_of_what_they_see_is_judged_beside_what_is_true() {
    let _alone = alone();
    let place = Place::new();
    let report = passed(&place, &crossings(&place));
    let counts = report["counts"].as_array().unwrap();
    assert_eq!(counts.len(), 4, "{counts:#?}");
    let sum = |of: &dyn Fn(&Value) -> u64| counts.iter().map(of).sum::<u64>();
    // Somebody counted, the ground station knows of it, and vehicles truly passed meanwhile.
    assert!(
        sum(&|c| c["counted"][1].as_u64().unwrap()) > 20_000,
        "{counts:#?}"
    );
    assert!(
        sum(&|c| c["known"]["watched_ms"].as_u64().unwrap()) > 10_000,
        "{counts:#?}"
    );
    assert!(
        sum(&|c| c["passed_in_pictures"].as_u64().unwrap()) > 0,
        "{counts:#?}"
    );
    let streets = &report["streets"];
    assert!(streets["watched"][1].as_f64().unwrap() > 5.0, "{streets:#}");
}

/// A search whose bus stands near the base, and services that come from there.
fn served(place: &Place) -> String {
    let changes = [
        (
            "[[560, 520], [700, 560], [740, 640]]",
            "[[400, 120], [540, 160], [580, 240]]",
        ),
        ("speed_mps: 1.5", "speed_mps: 5"),
    ];
    changed(place, "search.json5", &changes)
}

/// Services drive to where the ground station knows what was found to be, and its operator says
/// at its console that they are there: so it is over long before the time of the watch.
#[test]
fn what_was_found_is_watched_until_services_on_the_ground_are_there() {
    let _alone = alone();
    let place = Place::new();
    let report = passed(&place, &served(&place));
    let bus = &report["detections"][0];
    let (told_ms, served_ms) = (bus["told_ms"].as_u64(), bus["served_ms"].as_u64());
    let (told_ms, served_ms) = (told_ms.unwrap(), served_ms.unwrap());
    assert!(
        told_ms < served_ms && served_ms < told_ms + 200_000,
        "{bus:#}"
    );
    let end_ms = report["end_ms"].as_u64().unwrap();
    assert!(end_ms < served_ms + 60_000, "{end_ms} {bus:#}");
}
