//! Tests of `plan cover` from files to text.

use super::*;
use clap::Parser;
use proptest::prelude::*;
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
    assert_eq!(alone["tours"].as_array().unwrap().len(), 1);
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
        let fast = &told["tours"][1];
        assert_eq!(fast["name"], "fast");
        assert!(fast["time_s"].as_f64().unwrap() <= 400.0 + 1e-6, "{fast}");
        assert!((fast["points"][0]["lon_deg"].as_f64().unwrap() - 8.55).abs() < 1e-9);
        assert!(told.get("compared").is_none());
    }
    std::fs::remove_dir_all(&dir).unwrap();
}

/// A rectangle of this size as GeoJSON, its corner where all start.
fn rectangle(w_m: f64, h_m: f64) -> String {
    let east = 8.54 + w_m / (111_320.0 * 47.4_f64.to_radians().cos());
    let north = 47.4 + h_m / 111_195.0;
    format!(
        r#"{{"type":"Polygon","coordinates":[[[8.54,47.4],[{east},47.4],[{east},{north}],[8.54,{north}],[8.54,47.4]]]}}"#
    )
}

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("skein-plan-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        Self(dir)
    }

    fn fleet(&self, text: &str) -> String {
        let path = self.0.join("fleet.json5");
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    }

    fn json(&self, area: &str, fleet: &str, more: &[&str]) -> Value {
        let fleet = self.fleet(fleet);
        let flags: Vec<&str> = ["--fleet", &fleet].iter().chain(more).copied().collect();
        serde_json::from_str(&told(&self.0, area, &flags).unwrap()).unwrap()
    }

    fn patrolled(&self, area: &str) -> (Site, Flights) {
        let file = self.0.join("area.geojson");
        std::fs::write(&file, area).unwrap();
        let file = file.display().to_string();
        planned(&Cli::try_parse_from(["cover", &file]).unwrap().args).unwrap()
    }

    fn error(&self, area: &str, fleet: &str, more: &[&str]) -> String {
        let fleet = self.fleet(fleet);
        let flags: Vec<&str> = ["--fleet", &fleet].iter().chain(more).copied().collect();
        format!("{:#}", told(&self.0, area, &flags).unwrap_err())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).unwrap();
    }
}

fn number(told: &Value, key: &str) -> f64 {
    told[key].as_f64().unwrap()
}

fn names(list: &Value) -> Vec<&str> {
    let all = list.as_array().unwrap().iter();
    all.map(|x| x["name"].as_str().unwrap()).collect()
}

#[test]
fn unlike_swaths_get_sections_with_lanes_of_their_own() {
    let dir = Folder::new("sections");
    let fleet = "[{name: 'wide', speed_mps: 15, swath_m: 80, turn_radius_m: 25},
        {name: 'narrow', speed_mps: 15, swath_m: 30, turn_radius_m: 15}]";
    let area = rectangle(1500.0, 1100.0);
    for planner in ["--exact", "--approximate"] {
        let told = dir.json(&area, fleet, &[planner]);
        assert_eq!(told["lanes"], "sections", "{planner}");
        assert!((number(&told["tours"][0], "lane_m") - 80.0).abs() < 1e-9);
        assert!((number(&told["tours"][1], "lane_m") - 30.0).abs() < 1e-9);
        let common = &told["compared"][0];
        assert_eq!(common["lanes"], "common");
        assert!(number(common, "makespan_s") > 1.05 * number(&told, "makespan_s"));
        // What is told of the other lanes is the best that they come to.
        let only = dir.json(&area, fleet, &[planner, "--lanes", "common"]);
        let gap_s = number(&only, "makespan_s") - number(common, "makespan_s");
        assert!(gap_s.abs() < 1e-6, "{gap_s}");
        assert!(only["lanes"] == "common" && only.get("compared").is_none());
    }
    // Sections are drawn.
    let map = dir.json(FIELD, fleet, &["--exact", "--format", "geojson"]);
    let sections = map["features"].as_array().unwrap().iter();
    let sections = sections.filter(|f| !f["properties"]["section"].is_null());
    assert_eq!(sections.count(), 2);
    // Like swaths are planned as one team, whatever is asked.
    let like = fleet.replace("30", "80");
    let (sections, common) = (
        dir.json(FIELD, &like, &["--exact", "--lanes", "sections"]),
        dir.json(FIELD, &like, &["--exact", "--lanes", "common"]),
    );
    assert_eq!(sections, common);
}

#[test]
fn only_who_carries_the_sensor_takes_part() {
    let dir = Folder::new("sensor");
    let fleet = "[{name: 'a', speed_mps: 15, sensors: {rgb: {swath_m: 60}, thermal: {swath_m: 30}}},
        {name: 'b', speed_mps: 15, sensors: {rgb: {swath_m: 60}}}, {name: 'c', speed_mps: 15, swath_m: 70}]";
    let area = rectangle(800.0, 500.0);
    let told = dir.json(&area, fleet, &["--exact", "--sensor", "thermal"]);
    assert_eq!(names(&told["at_home"]), ["b", "c"]);
    assert!(
        told["at_home"][0]["why"]
            .as_str()
            .unwrap()
            .contains("thermal")
    );
    assert!((number(&told["tours"][0], "lane_m") - 30.0).abs() < 1e-9);
    assert_eq!(told["tours"][1]["points"].as_array().unwrap().len(), 1);
    let feature =
        format!(r#"{{"type":"Feature","properties":{{"sensor":"rgb"}},"geometry":{area}}}"#);
    let told = dir.json(&feature, fleet, &["--exact"]);
    assert!(told["sensor"] == "rgb" && names(&told["at_home"]) == ["c"]);
    let error = |area: &str, more: &[&str]| dir.error(area, fleet, more);
    assert!(error(&feature, &["--sensor", "thermal"]).contains("the area asks for \"rgb\""));
    assert!(error(&area, &["--sensor", "lidar"]).contains("the team has rgb, thermal"));
    // A patrol's one tour is planned whatever the file asks for.
    let (site, flights) = dir.patrolled(&feature);
    assert!(site.notices.iter().any(|n| n.contains("\"rgb\"")) && flights.covered_share > 0.999);
    let wrong = feature.replace("\"rgb\"", "7");
    assert!(error(&wrong, &[]).contains("/properties/sensor"));
}

#[test]
fn distance_and_energy_leave_the_dear_at_home() {
    let dir = Folder::new("who");
    let fleet = "[{name: 'dear', speed_mps: 15, cruise_power_w: 900}, {name: 'cheap', speed_mps: 12, cruise_power_w: 150},
        {name: 'far', speed_mps: 15, cruise_power_w: 200, start: [47.41, 8.54]}]";
    let area = rectangle(900.0, 600.0);
    let planned = |objective: &str| {
        dir.json(
            &area,
            fleet,
            &["--exact", "--turn-radius-m", "15", "--objective", objective],
        )
    };
    let all = ["time", "distance", "energy"].map(planned);
    assert!(names(&all[0]["at_home"]).is_empty());
    assert_eq!(names(&all[2]["at_home"]), ["dear", "far"]);
    assert!(names(&all[1]["at_home"]).contains(&"far"));
    for (own, figure) in all.iter().zip(["makespan_s", "total_m", "energy_wh"]) {
        for other in &all {
            assert!(
                number(own, figure) <= number(other, figure) + 1e-6,
                "{figure}"
            );
            assert!((number(other, "covered_share") - 1.0).abs() < 0.002);
        }
    }
    // With too little endurance all fly, under every objective, and the rest is told.
    let tired = fleet.replace("speed_mps", "endurance_s: 200, speed_mps");
    for objective in ["time", "distance", "energy"] {
        let told = dir.json(&area, &tired, &["--exact", "--objective", objective]);
        assert_eq!(told["uavs_flying"], 3, "{objective}");
        assert!(
            number(&told, "unserved_passes") > 0.0 && number(&told, "makespan_s") <= 200.0 + 1e-6
        );
    }
    // Who costs less flies as long as it can, and the dear one flies the rest.
    let short = "[{name: 'dear', speed_mps: 15, cruise_power_w: 900}, {name: 'cheap', speed_mps: 15, cruise_power_w: 100, endurance_s: 600}]";
    let [even, cheap] = ["time", "energy"].map(|objective| {
        let told = dir.json(&area, short, &["--exact", "--objective", objective]);
        assert!((number(&told, "covered_share") - 1.0).abs() < 0.002);
        told
    });
    assert!(number(&cheap, "energy_wh") < 0.8 * number(&even, "energy_wh"));
    assert!(number(&cheap["tours"][1], "time_s") <= 600.0 + 1e-6);
    let some = fleet.replacen(", cruise_power_w: 900", "", 1);
    let error = dir.error(&area, &some, &["--objective", "energy"]);
    assert!(error.contains("dear has no cruise_power_w"), "{error}");
}

#[test]
fn flights_that_meet_have_heights_and_see_as_wide_as_their_lanes() {
    let dir = Folder::new("heights");
    let fleet = "[{name: 'a', speed_mps: 15, fov_across_deg: 60}, {name: 'b', speed_mps: 15, fov_across_deg: 60},
        {name: 'c', speed_mps: 15, fov_across_deg: 40}]";
    let area = rectangle(900.0, 900.0);
    let heights = |told: &Value| -> Vec<f64> {
        let tours = told["tours"].as_array().unwrap();
        tours.iter().map(|t| number(t, "altitude_m")).collect()
    };
    let told = dir.json(&area, fleet, &["--exact", "--altitude-m", "80"]);
    let high = heights(&told);
    assert!(
        high.iter().all(|h| *h >= 80.0) && high.iter().any(|h| *h >= 100.0),
        "{high:?}"
    );
    for (tour, (height, fov)) in told["tours"]
        .as_array()
        .unwrap()
        .iter()
        .zip(high.iter().zip([60.0_f64, 60.0, 40.0]))
    {
        let sees_m = 2.0 * height * (fov.to_radians() / 2.0).tan();
        assert!(number(tour, "lane_m") <= sees_m + 1e-6, "{tour}");
    }
    let flat = dir.json(
        &area,
        fleet,
        &["--exact", "--layer-step-m", "0", "--altitude-m", "80"],
    );
    assert!(heights(&flat).iter().all(|h| (h - 80.0).abs() < 1e-9));
    assert!(number(&flat, "makespan_s") >= number(&told, "makespan_s") - 1e-6);
    assert!(
        dir.error(&area, fleet, &["--layer-step-m", "-1"])
            .contains("--layer-step-m must be")
    );
    assert!(
        dir.error(&area, fleet, &["--separation-m", "NaN"])
            .contains("--separation-m must be")
    );
    assert!(
        dir.error(&area, fleet, &["--altitude-m", "-5"])
            .contains("a: a field of view")
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn sections_see_all_and_the_best_is_never_later(
        size in (400.0..1500.0f64, 400.0..1500.0f64),
        uavs in prop::collection::vec((10.0..20.0f64, 25.0..90.0f64), 2..5),
        turn in 10.0..40.0f64,
    ) {
        let dir = Folder::new("property");
        let uav = |(i, (v, swath)): (usize, &(f64, f64))| {
            format!("{{name: 'u{i}', speed_mps: {v}, swath_m: {swath}, turn_radius_m: {turn}}}")
        };
        let uavs: Vec<String> = uavs.iter().enumerate().map(uav).collect();
        let fleet = format!("[{}]", uavs.join(","));
        let area = rectangle(size.0, size.1);
        for planner in ["--exact", "--approximate"] {
            let lanes = |lanes: &str| dir.json(&area, &fleet, &[planner, "--lanes", lanes, "--steps", "2000"]);
            let [common, sections, best] = ["common", "sections", "best"].map(lanes);
            for told in [&common, &sections, &best] {
                prop_assert!(number(told, "covered_share") > 0.999, "{planner}");
            }
            let least = number(&common, "makespan_s").min(number(&sections, "makespan_s"));
            prop_assert!(number(&best, "makespan_s") <= least + 1e-6, "{planner}");
        }
    }
}
