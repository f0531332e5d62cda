//! Tests of sensors, objectives and heights of `plan visit` and `plan line`, from files to
//! text.

use super::partitions;
use crate::plan::{PlanArgs, run};
use anyhow::Result;
use clap::Parser;
use proptest::prelude::*;
use serde_json::{Value, json};
use std::path::PathBuf;

#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    plan: PlanArgs,
}

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("skein-errands-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        Self(dir)
    }

    fn told(&self, verb: &str, targets: &Value, fleet: &str, more: &[&str]) -> Result<Value> {
        let (file, team) = (self.0.join("targets.geojson"), self.0.join("fleet.json5"));
        std::fs::write(&file, targets.to_string())?;
        std::fs::write(&team, fleet)?;
        let (file, team) = (file.display().to_string(), team.display().to_string());
        let all = [&["plan", verb, &file, "--fleet", &team], more].concat();
        Ok(serde_json::from_str(
            &run(&Cli::try_parse_from(all)?.plan)?,
        )?)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).unwrap();
    }
}

/// Points some hundred metres apart, each with its sensor.
fn points(all: &[(f64, f64, Option<&str>)]) -> Value {
    let feature = |&(x, y, sensor): &(f64, f64, Option<&str>)| {
        json!({"type": "Feature", "properties": {"sensor": sensor},
            "geometry": {"type": "Point", "coordinates": [8.5 + x / 1000.0, 47.0 + y / 1000.0]}})
    };
    let features: Vec<Value> = all.iter().map(feature).collect();
    json!({"type": "FeatureCollection", "features": features})
}

fn number(told: &Value, key: &str) -> f64 {
    told[key].as_f64().unwrap()
}

/// Who flies which targets, by UAV.
fn flown(told: &Value) -> Vec<Vec<String>> {
    let tours = told["tours"].as_array().unwrap().iter();
    let target = |p: &Value| p["target"].as_str().unwrap().to_owned();
    tours
        .map(|t| t["passes"].as_array().unwrap().iter().map(target).collect())
        .collect()
}

const FLEET: &str =
    "[{name: 'both', speed_mps: 15, sensors: {rgb: {swath_m: 60}, thermal: {swath_m: 30}}},
    {name: 'red', speed_mps: 15, sensors: {rgb: {swath_m: 60}}}, {name: 'bare', speed_mps: 15}]";

#[test]
fn things_are_grouped_in_all_ways() {
    assert_eq!(partitions(1), [[0]]);
    assert_eq!(partitions(3).len(), 5);
    assert_eq!(partitions(5).len(), 52);
    assert_eq!(partitions(3)[0], [0, 0, 0]);
}

#[test]
fn targets_are_flown_by_who_can_see_them() {
    let dir = Folder::new("sensors");
    let targets = points(&[
        (5.0, 0.0, Some("thermal")),
        (0.0, 5.0, Some("rgb")),
        (9.0, 1.0, Some("thermal")),
        (-5.0, 0.0, None),
    ]);
    let told = dir
        .told("visit", &targets, FLEET, &["--depot", "47.0,8.5"])
        .unwrap();
    let by = flown(&told);
    assert_eq!(by[0].len(), 2);
    assert_eq!(by[1], ["/features/1"]);
    assert_eq!(by[2], ["/features/3"]);
    // With the flag the target without a wish of its own needs it too.
    let told = dir
        .told("visit", &targets, FLEET, &["--sensor", "thermal"])
        .unwrap();
    assert_eq!(told["at_home"][0]["name"], "bare");
    assert!(told["at_home"].to_string().contains("none of the sensors"));
    assert_eq!(flown(&told)[0].len(), 3);
    let alone = points(&[(5.0, 0.0, Some("thermal")), (0.0, 5.0, Some("rgb"))]);
    let told = dir.told(
        "visit",
        &alone,
        &FLEET
            .replace("red", "rot")
            .replacen("{rgb: {swath_m: 60}}", "{x: {swath_m: 9}}", 1),
        &[],
    );
    assert_eq!(flown(&told.unwrap())[0].len(), 2);
    let error = |targets: &Value, fleet: &str, more: &[&str]| {
        format!("{:#}", dir.told("visit", targets, fleet, more).unwrap_err())
    };
    let lidar = points(&[(5.0, 0.0, None), (0.0, 5.0, Some("lidar"))]);
    let text = error(&lidar, FLEET, &[]);
    assert!(
        text.contains("/features/1 asks for the sensor \"lidar\"") && text.contains("rgb, thermal"),
        "{text}"
    );
    let number = json!({"type": "Feature", "properties": {"sensor": 3}, "geometry": {"type": "Point", "coordinates": [8.5, 47.0]}});
    assert!(error(&number, FLEET, &[]).contains("properties.sensor: expected a text"));
    let plain = "[{name: 'a', speed_mps: 15}]";
    assert!(error(&alone, plain, &[]).contains("no UAV of the team lists `sensors`"));
    assert!(error(&alone, FLEET, &["--layer-step-m", "-1"]).contains("--layer-step-m"));
}

#[test]
fn an_objective_has_its_own_figure_least_and_meeting_flights_their_heights() {
    let dir = Folder::new("objective");
    let fleet = "[{name: 'dear', speed_mps: 20, cruise_power_w: 800}, {name: 'cheap', speed_mps: 15, cruise_power_w: 100},
        {name: 'far', speed_mps: 15, cruise_power_w: 150, start: [47.01, 8.51]}]";
    let lines: Vec<Value> = (0..6)
        .map(|i| {
            let y = 47.0 + f64::from(i) / 500.0;
            json!([[8.5, y], [8.51, y]])
        })
        .collect();
    let lines = json!({"type": "MultiLineString", "coordinates": lines});
    let planned = |objective: &str| {
        dir.told("line", &lines, fleet, &["--objective", objective])
            .unwrap()
    };
    let all = ["time", "distance", "energy"].map(planned);
    assert_eq!(all[0]["uavs_flying"], 3);
    assert!(all[2]["at_home"].to_string().contains("dear"));
    for (own, figure) in all.iter().zip(["makespan_s", "total_m", "energy_wh"]) {
        for other in &all {
            assert!(
                number(own, figure) <= number(other, figure) + 1e-6,
                "{figure}"
            );
            assert!(other["unserved"].as_array().unwrap().is_empty());
        }
    }
    // Little endurance: most is flown whatever is to be least.
    let tired = fleet.replace("speed_mps", "endurance_s: 125, speed_mps");
    let left = ["time", "distance", "energy"].map(|objective| {
        let told = dir
            .told("line", &lines, &tired, &["--objective", objective])
            .unwrap();
        assert!(number(&told, "makespan_s") <= 125.0 + 1e-6);
        told["unserved"].as_array().unwrap().len()
    });
    assert!(
        left[0] > 0 && left[1] <= left[0] && left[2] <= left[0],
        "{left:?}"
    );
    // Two that share a road to their targets cross on the way.
    let cross = points(&[
        (0.0, 0.0, None),
        (9.0, 9.0, None),
        (9.0, 0.0, None),
        (0.0, 9.0, None),
    ]);
    let fleet = "[{name: 'a', speed_mps: 15, start: [47.0045, 8.51]}, {name: 'b', speed_mps: 15, start: [47.0045, 8.4995]}]";
    let heights = |more: &[&str]| -> Vec<f64> {
        let told = dir.told("visit", &cross, fleet, more).unwrap();
        let tours = told["tours"].as_array().unwrap();
        tours.iter().map(|t| number(t, "altitude_m")).collect()
    };
    let apart = heights(&["--separation-m", "750", "--layer-step-m", "30"]);
    assert!((apart[0] - apart[1]).abs() > 29.0, "{apart:?}");
    let same = heights(&["--separation-m", "0"]);
    assert!((same[0] - same[1]).abs() < 1e-9, "{same:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn each_target_is_seen_once_by_a_uav_with_its_sensor(
        targets in prop::collection::vec((-9.0..9.0f64, -9.0..9.0f64, 0..4usize), 1..14),
        carried in prop::collection::vec(0..8u8, 1..6),
    ) {
        let names = ["a", "b", "c"];
        let dir = Folder::new("property");
        // The first UAV carries all, so that every target can be seen.
        let sensors = |mask: u8| -> Vec<&str> { (0..3).filter(|i| mask >> i & 1 == 1).map(|i| names[i]).collect() };
        let uavs: Vec<Vec<&str>> = std::iter::once(7).chain(carried).map(sensors).collect();
        let uav = |(i, own): (usize, &Vec<&str>)| {
            let own: Vec<String> = own.iter().map(|s| format!("{s}: {{swath_m: 50}}")).collect();
            format!("{{name: 'u{i}', speed_mps: 15, sensors: {{{}}}}}", own.join(","))
        };
        let fleet: Vec<String> = uavs.iter().enumerate().map(uav).collect();
        let asked: Vec<(f64, f64, Option<&str>)> =
            targets.iter().map(|&(x, y, s)| (x, y, names.get(s).copied())).collect();
        let told = dir.told("visit", &points(&asked), &format!("[{}]", fleet.join(",")), &["--steps", "500"]).unwrap();
        let mut seen = vec![0; asked.len()];
        for (by, own) in flown(&told).iter().zip(&uavs) {
            for target in by {
                let i: usize = target.strip_prefix("/features/").unwrap().parse().unwrap();
                seen[i] += 1;
                prop_assert!(asked[i].2.is_none_or(|s| own.contains(&s)), "{target} by {own:?}");
            }
        }
        prop_assert!(seen.iter().all(|n| *n == 1), "{seen:?}");
    }
}
