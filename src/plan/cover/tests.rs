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
    let three = [
        "--exact", "--k", "3", "--steps", "500", "--format", "geojson",
    ];
    let map: Value = serde_json::from_str(&told(&dir, FIELD, &three).unwrap()).unwrap();
    assert!(map["features"].as_array().unwrap().len() > 6);
    assert!(map["makespan_s"].as_f64() < alone["makespan_s"].as_f64());
    let out = dir.join("plans").display().to_string();
    let split = [
        "--exact", "--k", "2", "--steps", "500", "--format", "plan", "--out", &out,
    ];
    assert!(told(&dir, FIELD, &split).unwrap().contains("uav-2.plan"));
    let text = std::fs::read_to_string(dir.join("plans/uav-1.plan")).unwrap();
    assert!(skein_interop::plan::read(&text).unwrap().waypoints.len() > 4);
    let survey = r#"{"type":"FeatureCollection","features":[]}"#;
    for (text, more, says) in [
        (FIELD, &["--k", "0"][..], "--k must be"),
        (
            FIELD,
            &["--swath-m", "0"],
            "--swath-m must be between 0.1 and 10000 m, found 0",
        ),
        (FIELD, &["--clearance-m", "-3"], "clearance"),
        (FIELD, &["--speed-mps", "0"], "--speed-mps must be"),
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
    let flags = ["--k", "3", "--turn-radius-m", "25", "--steps", "500"];
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
        let turn = [
            "--turn-radius-m",
            "15",
            "--lanes",
            "common",
            "--steps",
            "500",
        ];
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
        (FIELD, &["--clearance-m", "NaN"], "--clearance-m must be"),
    ] {
        let error = format!("{:#}", planned(text, more).unwrap_err());
        assert!(error.contains(says), "{error}");
    }
    let sections = ["--exact", "--lanes", "sections", "--format", "geojson"];
    let map = planned(FIELD, &sections).unwrap();
    assert!(map.contains("\"section\":2") && map.contains("\"lanes\":\"sections\""));
    std::fs::remove_dir_all(&dir).unwrap();
}

/// A survey as QGroundControl writes it, with a circle to keep out of and a fence round it.
const SURVEY: &str = r#"{"fileType":"Plan","version":1,"groundStation":"QGroundControl",
    "geoFence":{"version":2,"polygons":[{"inclusion":true,"version":1,
        "polygon":[[47.395,8.535],[47.395,8.56],[47.415,8.56],[47.415,8.535]]}],
        "circles":[{"inclusion":false,"version":1,"circle":{"center":[47.405,8.545],"radius":40}}]},
    "rallyPoints":{"version":2,"points":[[47.399,8.539,30]]},
    "mission":{"version":2,"firmwareType":3,"vehicleType":1,"cruiseSpeed":15,"hoverSpeed":5,
        "plannedHomePosition":[47.399,8.545,431],"items":[
        {"type":"ComplexItem","complexItemType":"survey","version":5,"angle":90,
         "polygon":[[47.40,8.54],[47.40,8.55],[47.41,8.55],[47.41,8.54]],
         "TransectStyleComplexItem":{"version":2,"TurnAroundDistance":30,"CameraCalc":{"version":2,
         "AdjustedFootprintSide":70,"AdjustedFootprintFrontal":50,"DistanceToSurface":80,
         "DistanceMode":1,"CameraName":"Manual (no camera specs)"}}}]}}"#;

/// A folder of its own, gone at the end.
struct Dir(std::path::PathBuf);

impl Dir {
    fn new(name: &str) -> Self {
        let name = format!("skein-cover-{name}-{}", std::process::id());
        let dir = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&dir).unwrap();
        Self(dir)
    }

    fn file(&self, name: &str, text: &str) -> String {
        let file = self.0.join(name);
        std::fs::write(&file, text).unwrap();
        file.display().to_string()
    }

    fn plan(&self, text: &str, more: &[&str]) -> Result<Value> {
        let file = self.file("survey.plan", text);
        let all = ["cover", &file, "--steps", "200"];
        let all = all.into_iter().chain(more.iter().copied());
        Ok(serde_json::from_str(&run(&Cli::try_parse_from(all)
            .unwrap()
            .args)?)?)
    }
}

impl Drop for Dir {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_survey_is_flown_as_it_asks_and_its_files_keep_what_it_holds() {
    let dir = Dir::new("survey");
    let told = dir.plan(SURVEY, &["--turn-radius-m", "20"]).unwrap();
    assert_eq!(told["flights"][0]["altitude_m"], 80.0);
    assert_eq!(told["flights"][0]["lane_m"], 70.0);
    assert_eq!(told["planner"], "exact", "a course asks for passes");
    let notices = told["notices"].to_string();
    assert!(notices.contains("AdjustedFootprintSide 70 m"), "{notices}");
    assert!(notices.contains("TurnAroundDistance 30 m"), "{notices}");
    assert!(!notices.contains("inclusion fence"), "{notices}");
    let flags = ["--swath-m", "90", "--altitude-m", "100", "--approximate"];
    let told = dir.plan(SURVEY, &flags).unwrap();
    assert_eq!(told["flights"][0]["altitude_m"], 100.0);
    assert_eq!(told["flights"][0]["lane_m"], 90.0);
    assert!(
        told["notices"]
            .to_string()
            .contains("--swath-m 90 m instead of the survey's 70 m")
    );

    let time_s = |told: &Value| told["makespan_s"].as_f64().unwrap();
    let asked = dir.plan(SURVEY, &["--exact"]).unwrap();
    let best = dir.plan(SURVEY, &["--exact", "--every-course"]).unwrap();
    assert!(time_s(&best) <= time_s(&asked), "{asked} {best}");
    let notices = best["notices"].to_string();
    assert!(
        notices.contains("angle is not used") && !notices.contains("--course-deg"),
        "{notices}"
    );

    let out = dir.0.join("plans").display().to_string();
    let zone = square(8.5425, 47.4025, 8.5435, 47.4035);
    let zone = dir.file("zone.geojson", &zone);
    let flags = [
        "--k", "2", "--format", "plan", "--out", &out, "--zones", &zone,
    ];
    dir.plan(SURVEY, &flags).unwrap();
    let text = std::fs::read_to_string(dir.0.join("plans/uav-1.plan")).unwrap();
    let plan: Value = serde_json::from_str(&text).unwrap();
    let before: Value = serde_json::from_str(SURVEY).unwrap();
    assert_eq!(plan["rallyPoints"], before["rallyPoints"]);
    assert_eq!(plan["geoFence"]["circles"], before["geoFence"]["circles"]);
    let polygons = plan["geoFence"]["polygons"].as_array().unwrap();
    assert_eq!(polygons[0], before["geoFence"]["polygons"][0]);
    assert_eq!(
        (polygons.len(), &polygons[1]["inclusion"]),
        (2, &json!(false))
    );
    let mission = &plan["mission"];
    assert_eq!(mission["firmwareType"], 3);
    assert_eq!(mission["plannedHomePosition"][2], 431.0);
    let items = mission["items"].as_array().unwrap();
    let commands: Vec<i64> = items
        .iter()
        .map(|i| i["command"].as_i64().unwrap())
        .collect();
    assert_eq!(commands[..2], [22, 178]);
    assert_eq!(commands.last(), Some(&20));
    let triggers = items.iter().filter(|i| i["command"] == 206);
    let triggers: Vec<f64> = triggers.map(|i| i["params"][0].as_f64().unwrap()).collect();
    assert!(triggers.len() >= 4, "passes are seen");
    for both in triggers.chunks(2) {
        assert_eq!(both, [50.0, 0.0], "{triggers:?}");
    }
}

/// A square of GeoJSON.
fn square(west: f64, south: f64, east: f64, north: f64) -> String {
    format!(
        r#"{{"type":"Polygon","coordinates":[[[{west},{south}],[{east},{south}],[{east},{north}],[{west},{north}],[{west},{south}]]]}}"#
    )
}

#[test]
fn launches_that_are_misplaced_name_the_fence() {
    let dir = Dir::new("launch");
    for (launch, says) in [
        (
            "47.405,8.545",
            "lies inside exclusion fence 1: choose another with --launch",
        ),
        (
            "47.39,8.545",
            "47.3900000,8.5450000, lies outside inclusion fence 1",
        ),
    ] {
        let error = dir.plan(SURVEY, &["--launch", launch]).unwrap_err();
        let error = format!("{error:#}");
        assert!(error.contains(says), "{error}");
        assert!(error.contains("the launch point of uav-1"), "{error}");
    }
}

#[test]
fn holes_are_no_fly_unless_they_may_be_crossed() {
    let dir = std::env::temp_dir().join(format!("skein-plan-holes-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let plan = |more: &[&str]| -> Value {
        let flags = [&["--exact", "--clearance-m", "20"], more].concat();
        serde_json::from_str(&told(&dir, FIELD, &flags).unwrap()).unwrap()
    };
    let round = plan(&[]);
    let said = "1 hole(s) of the area are no-fly: --cross-holes flies over them";
    assert!(round["notices"].to_string().contains(said), "{round}");
    let over = plan(&["--cross-holes"]);
    assert!(over["notices"].to_string().contains("may be flown over"));
    let area = |told: &Value| told["area_m2"].as_f64().unwrap();
    assert!(
        area(&round) < area(&over),
        "the clearance round the hole is not seen"
    );
    // No corner of the first lies in the hole, whose corners are those of FIELD.
    let in_hole = |told: &Value| {
        let points = told["flights"][0]["points"].as_array().unwrap().clone();
        let hole = [[8.542, 47.402], [8.544, 47.402], [8.544, 47.404]];
        let hole = hole.map(|[x, y]| skein_geometry::frame::Point::new(x, y));
        let hole = skein_geometry::Polygon::new(hole.to_vec()).unwrap();
        let at = |p: &Value| {
            let (x, y) = (p["lon_deg"].as_f64(), p["lat_deg"].as_f64());
            skein_geometry::frame::Point::new(x.unwrap(), y.unwrap())
        };
        let track: Vec<_> = points.iter().map(at).collect();
        let along = (0..=20).map(|i| f64::from(i) / 20.0);
        let on = |w: &[skein_geometry::frame::Point]| {
            along
                .clone()
                .any(|s| hole.contains(w[0] + (w[1] - w[0]) * s))
        };
        track.windows(2).any(on)
    };
    assert!(!in_hole(&round));
    assert!(in_hole(&over));
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn what_cannot_be_meant_is_refused_with_the_place_and_what_helps() {
    let dir = std::env::temp_dir().join(format!("skein-plan-meant-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let with_ring = |ring: &str, properties: &str| {
        format!(
            r#"{{"type":"FeatureCollection","features":[
            {{"type":"Feature","properties":null,"geometry":{}}},
            {{"type":"Feature","properties":{properties},"geometry":{{"type":"Polygon","coordinates":[{ring}]}}}}]}}"#,
            square(8.54, 47.40, 8.55, 47.41)
        )
    };
    let bow_tie = "[[8.542,47.402],[8.544,47.404],[8.544,47.402],[8.542,47.404],[8.542,47.402]]";
    let small = "[[8.542,47.402],[8.544,47.402],[8.544,47.404],[8.542,47.402]]";
    let crossed = with_ring(bow_tie, r#"{"no_fly":"yes"}"#);
    let maybe = with_ring(small, r#"{"no_fly":"maybe"}"#);
    let alone = format!(r#"{{"type":"Polygon","coordinates":[{bow_tie}]}}"#);
    let touching = r#"{"type":"Polygon","coordinates":[[[8.54,47.40],[8.55,47.40],[8.545,47.40],[8.545,47.41],[8.54,47.40]]]}"#;
    let no_hole = FIELD.replacen(
        "[[8.542,47.402],[8.544,47.402],",
        "[[8.542,47.402],[8.544,147.402],",
        1,
    );
    for (text, more, says) in [
        (
            no_hole.as_str(),
            &[][..],
            "at /features/0: 1 of its 1 holes is no ring",
        ),
        (
            crossed.as_str(),
            &[][..],
            "/features/1: the ring crosses itself near 47.4030000, 8.5430000",
        ),
        (
            &alone,
            &[],
            "the ring crosses itself near 47.4030000, 8.5430000",
        ),
        (touching, &[], "the ring touches itself: its edge from 47.4"),
        (
            &maybe,
            &[],
            "at /features/1/properties/no_fly: \"maybe\" is neither true nor false",
        ),
        (
            FIELD,
            &["--course-deg", "400"],
            "--course-deg must be from -180 up to 360 degrees, found 400",
        ),
        (FIELD, &["--course-deg", "-181"], "--course-deg must be"),
        (FIELD, &["--course-deg", "NaN"], "--course-deg must be"),
        (
            FIELD,
            &["--speed-mps", "-5"],
            "--speed-mps must be between 1 and 150 m/s, found -5",
        ),
        (
            FIELD,
            &["--turn-radius-m", "inf"],
            "--turn-radius-m must be",
        ),
        (FIELD, &["--endurance-s", "-1"], "--endurance-s must be"),
        (FIELD, &["--look-ahead-m", "NaN"], "--look-ahead-m must be"),
        (
            FIELD,
            &["--max-height-m", "50"],
            "the lowest flight would be at 60 m, above --max-height-m 50",
        ),
        (FIELD, &["--altitude-m", "130"], "above --max-height-m 120"),
        (FIELD, &["--swath-m", "0.2"], "a swath of "),
    ] {
        let error = format!("{:#}", told(&dir, text, more).unwrap_err());
        assert!(error.contains(says), "{error}");
        assert!(
            error.contains("area.geojson") || error.starts_with("--") || error.contains("--"),
            "{error}"
        );
    }
    // As QGIS writes it.
    let qgis = with_ring(small, r#"{"no_fly":"True"}"#);
    assert!(told(&dir, &qgis, &["--exact"]).is_ok());
    assert!(told(&dir, FIELD, &["--exact", "--course-deg", "-90"]).is_ok());
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn who_stays_is_told_for_want_of_endurance_or_of_work() {
    let dir = std::env::temp_dir().join(format!("skein-plan-stay-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let plan = |fleet: &str, more: &[&str]| -> Value {
        let file = dir.join("fleet.json5");
        std::fs::write(&file, fleet).unwrap();
        let fleet = file.display().to_string();
        let flags = [&["--exact", "--steps", "200", "--fleet", &fleet], more].concat();
        serde_json::from_str(&told(&dir, FIELD, &flags).unwrap()).unwrap()
    };
    let far = "[{name: 'a', speed_mps: 15}, {name: 'far', speed_mps: 15, endurance_s: 60, start: [47.42, 8.55]}]";
    let why = plan(far, &[])["at_home"][0]["why"].to_string();
    assert!(
        why.contains("has not the endurance: the way there and back takes"),
        "{why}"
    );
    let two = "[{name: 'a', speed_mps: 15}, {name: 'b', speed_mps: 15}]";
    let why = plan(two, &["--objective", "distance"])["at_home"][0]["why"].to_string();
    assert!(why.contains("is not needed"), "{why}");
    let weak = "[{name: 'a', speed_mps: 15, endurance_s: 2}]";
    let file = dir.join("weak.json5");
    std::fs::write(&file, weak).unwrap();
    let fleet = file.display().to_string();
    let error = told(&dir, FIELD, &["--exact", "--fleet", &fleet]).unwrap_err();
    let error = format!("{error:#}");
    assert!(
        error.starts_with("nobody can fly: a has not the endurance: 2 s are too few"),
        "{error}"
    );
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn an_area_is_covered_in_the_wind() {
    let dir = std::env::temp_dir().join(format!("skein-plan-wind-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let plan = |wind: &str| -> Value {
        let flags = ["--exact", "--steps", "200", "--wind-mps", wind];
        serde_json::from_str(&told(&dir, FIELD, &flags).unwrap()).unwrap()
    };
    let (calm, windy) = (plan("0"), plan("7"));
    let of = |plan: &Value, key: &str| plan[key].as_f64().unwrap();
    assert!((of(&windy, "wind_mps") - 7.0).abs() < 1e-9);
    assert!(of(&windy, "makespan_s") > 1.1 * of(&calm, "makespan_s"));
    // Lengths stay those over the ground, where turns are wider.
    let flight = &windy["flights"][0];
    assert!(of(flight, "time_s") > of(flight, "length_m") / of(flight, "speed_mps"));
    assert!((of(&windy, "total_m") - of(flight, "length_m")).abs() < 1e-6);
    let least_m = |plan: &Value| {
        let pieces = plan["flights"][0]["trajectory"].as_array().unwrap();
        let radii = pieces.iter().filter_map(|p| p["radius_m"].as_f64());
        radii.map(f64::abs).fold(f64::INFINITY, f64::min)
    };
    let wider = (1.0 + 7.0 / 15.0_f64).powi(2);
    assert!((least_m(&windy) / least_m(&calm) - wider).abs() < 1e-6);
    let error = told(&dir, FIELD, &["--wind-mps", "15"]).unwrap_err();
    assert!(format!("{error:#}").contains("--wind-mps"), "{error:#}");
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn a_survey_that_is_to_be_flown_twice_is() {
    let dir = Dir::new("refly");
    let refly = SURVEY.replace(
        "\"TurnAroundDistance\":30",
        "\"TurnAroundDistance\":30,\"Refly90Degrees\":true",
    );
    let passes = |told: &Value| told["passes"].as_u64().unwrap();
    let once = dir.plan(SURVEY, &[]).unwrap();
    let twice = dir.plan(&refly, &[]).unwrap();
    assert!(passes(&twice) > passes(&once) + 2, "{twice}");
    assert!(twice["makespan_s"].as_f64().unwrap() > 1.5 * once["makespan_s"].as_f64().unwrap());
    let told = twice["notices"].to_string();
    assert!(told.contains("Refly90Degrees of the survey is honoured"));
    let not = dir.plan(&refly, &["--refly=false"]).unwrap();
    assert_eq!(passes(&not), passes(&once));
    let asked = dir.plan(SURVEY, &["--refly"]).unwrap();
    assert_eq!(passes(&asked), passes(&twice));
    let cells = dir.plan(&refly, &["--approximate"]).unwrap();
    assert!(cells["notices"].to_string().contains("is ignored"));
    let error = dir.plan(SURVEY, &["--approximate", "--refly"]);
    assert!(error.unwrap_err().to_string().starts_with("--refly"));
}

#[test]
fn what_is_no_area_or_too_near_to_a_pole_is_refused() {
    let dir = Dir::new("degenerate");
    let of = |corners: &str| {
        let area = format!(
            r#"{{"type":"FeatureCollection","features":[{{"type":"Feature","properties":{{}},"geometry":{{"type":"Polygon","coordinates":[{corners}]}}}}]}}"#
        );
        format!("{:#}", told(&dir.0, &area, &[]).unwrap_err())
    };
    let line = of("[[8.54,47.4],[8.55,47.4],[8.56,47.4],[8.54,47.4]]");
    assert!(line.contains("no area to be covered"), "{line}");
    let dot = of("[[8.54,47.4],[8.5400001,47.4],[8.54,47.4000001],[8.54,47.4]]");
    assert!(dot.contains("no area to be covered"), "{dot}");
    let pole = of("[[0,89.99],[90,89.99],[180,89.99],[-90,89.99],[0,89.99]]");
    assert!(pole.contains("too near to a pole"), "{pole}");
}
