//! Tests of `plan cover` from files to text.

use super::*;
use clap::Parser;
use serde_json::Value;

#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    args: CoverArgs,
}

fn told(dir: &std::path::Path, text: &str, more: &[&str]) -> Result<String> {
    let file = dir.join("area.geojson");
    std::fs::write(&file, text).unwrap();
    let file = file.display().to_string();
    let all = ["cover", &file].into_iter().chain(more.iter().copied());
    run(&Cli::try_parse_from(all).unwrap().args)
}

const FIELD: &str = r#"{"type":"FeatureCollection","features":[
    {"type":"Feature","geometry":{"type":"Polygon","coordinates":[
        [[8.54,47.40],[8.55,47.40],[8.55,47.41],[8.54,47.41],[8.54,47.40]],
        [[8.542,47.402],[8.544,47.402],[8.544,47.404],[8.542,47.402]]]}},
    {"type":"Feature","properties":{"no_fly":true},"geometry":{"type":"Polygon","coordinates":[
        [[8.546,47.405],[8.548,47.405],[8.547,47.407],[8.546,47.405]]]}}]}"#;

#[test]
fn a_field_with_a_hole_and_a_zone_is_planned_in_every_form() {
    let dir = std::env::temp_dir().join(format!("skein-plan-cover-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let alone: Value = serde_json::from_str(&told(&dir, FIELD, &["--exact"]).unwrap()).unwrap();
    assert_eq!(alone["flights"].as_array().unwrap().len(), 1);
    assert!(alone["cells"].as_u64().unwrap() >= 4);
    let three = ["--exact", "--k", "3", "--format", "geojson"];
    let map: Value = serde_json::from_str(&told(&dir, FIELD, &three).unwrap()).unwrap();
    assert!(map["features"].as_array().unwrap().len() > 6);
    assert!(map["makespan_s"].as_f64() < alone["makespan_s"].as_f64());
    let out = dir.join("plans").display().to_string();
    let split = ["--exact", "--k", "2", "--format", "plan", "--out", &out];
    assert!(told(&dir, FIELD, &split).unwrap().contains("uav-2.plan"));
    let text = std::fs::read_to_string(dir.join("plans/uav-1.plan")).unwrap();
    assert!(skein_interop::plan::read(&text).unwrap().waypoints.len() > 4);
    let survey = r#"{"type":"FeatureCollection","features":[]}"#;
    for (text, more, says) in [
        (FIELD, &["--k", "0"][..], "--k must be"),
        (
            FIELD,
            &["--swath-m", "0"],
            "--swath-m: the swath must be above 0",
        ),
        (FIELD, &["--clearance-m", "-3"], "clearance"),
        (FIELD, &["--speed-mps", "0"], "speed must be"),
        (FIELD, &["--launch", "x"], "--launch"),
        (FIELD, &["--launch", "47.4055,8.547"], "launch point"),
        (FIELD, &["--k", "2", "--format", "plan"], "--out DIR"),
        (survey, &[], "found 0"),
        ("{", &[], "line 1, column 1: syntax: "),
    ] {
        for planner in [&["--exact"][..], &["--approximate"], &[]] {
            let flags: Vec<&str> = planner.iter().chain(more).copied().collect();
            let error = format!("{:#}", told(&dir, text, &flags).unwrap_err());
            assert!(error.contains(says), "{error}");
        }
    }
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn both_planners_are_told_side_by_side() {
    let dir = std::env::temp_dir().join(format!("skein-plan-both-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let flags = ["--k", "3", "--turn-radius-m", "25"];
    let both: Value = serde_json::from_str(&told(&dir, FIELD, &flags).unwrap()).unwrap();
    let compared = both["compared"].as_array().unwrap();
    assert_eq!(compared.len(), 2);
    for plan in compared {
        let share = plan["covered_share"].as_f64().unwrap();
        assert!((0.9..=1.0).contains(&share), "{plan}");
        assert!(plan["energy_s"].as_f64() > plan["makespan_s"].as_f64());
    }
    let fleet = dir.join("fleet.json5");
    let text = "[{name: 'slow', speed_mps: 10, swath_m: 40}, {name: 'fast', speed_mps: 20, endurance_s: 400, start: [47.40, 8.55]}]";
    std::fs::write(&fleet, text).unwrap();
    let fleet = fleet.display().to_string();
    for planner in ["--exact", "--approximate"] {
        let turn = ["--turn-radius-m", "15", "--lanes", "common"];
        let flags = [&[planner, "--fleet", &fleet][..], &turn].concat();
        let told: Value = serde_json::from_str(&told(&dir, FIELD, &flags).unwrap()).unwrap();
        let fast = &told["flights"][1];
        assert_eq!(fast["name"], "fast");
        assert!(fast["time_s"].as_f64().unwrap() <= 400.0 + 1e-6, "{fast}");
        assert!((fast["points"][0]["lon_deg"].as_f64().unwrap() - 8.55).abs() < 1e-9);
        assert!(told.get("compared").is_none());
    }
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn what_a_file_asks_for_is_told() {
    let dir = std::env::temp_dir().join(format!("skein-plan-asks-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let fleet = dir.join("fleet.json5");
    let text = "[{name: 'a', speed_mps: 15, sensors: {rgb: {swath_m: 60}, thermal: {swath_m: 30}}}, {name: 'c', speed_mps: 15, swath_m: 70}]";
    std::fs::write(&fleet, text).unwrap();
    let fleet = fleet.display().to_string();
    let planned = |text: &str, more: &[&str]| {
        let flags = [&["--fleet", &fleet, "--steps", "500"], more].concat();
        told(&dir, text, &flags)
    };
    let rgb = FIELD.replacen(
        r#""Feature","geometry""#,
        r#""Feature","properties":{"sensor":"rgb"},"geometry""#,
        1,
    );
    let answer: Value = serde_json::from_str(&planned(&rgb, &["--exact"]).unwrap()).unwrap();
    assert_eq!(answer["sensor"], "rgb");
    assert_eq!(answer["at_home"][0]["why"], "has no sensor \"rgb\"");
    for (text, more, says) in [
        (
            rgb.as_str(),
            &["--sensor", "thermal"][..],
            "the area asks for \"rgb\"",
        ),
        (FIELD, &["--sensor", "lidar"], "the team has rgb, thermal"),
        (&rgb.replace("\"rgb\"", "7"), &[], "/properties/sensor"),
        (FIELD, &["--layer-step-m", "-1"], "--layer-step-m must be"),
        (FIELD, &["--separation-m", "NaN"], "--separation-m must be"),
        (FIELD, &["--clearance-m", "NaN"], "--clearance-m: "),
    ] {
        let error = format!("{:#}", planned(text, more).unwrap_err());
        assert!(error.contains(says), "{error}");
    }
    let map = planned(FIELD, &["--exact", "--format", "geojson"]).unwrap();
    assert!(map.contains("\"section\":2") && map.contains("\"lanes\":\"sections\""));
    std::fs::remove_dir_all(&dir).unwrap();
}
