//! Every file in `configs/` is usable, and every wrong scenario is refused with the
//! place and the field, never with a panic.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use proptest::prelude::*;
use skein_flight::coverage::ring::patch::Patches;
use skein_geometry::frame::{Point, Vector};
use skein_netsim::Prepared;
use skein_netsim::runs::{Wanted, run};
use skein_peer::CoverageTask;
use skein_scenario::{
    Overrides, Severity, builtin_files, builtin_text, load_builtin, load_with, parse, parse_with,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

fn files_in(folder: &str, ending: &str) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(configs().join(folder))
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.to_string_lossy().ends_with(ending))
        .collect();
    found.sort();
    assert!(!found.is_empty(), "no {ending} in {folder}");
    found
}

fn helsinki() -> &'static str {
    builtin_text("helsinki").unwrap()
}

#[test]
fn all_trials_are_feasible() {
    for path in files_in("trials", ".json5") {
        let scenario = load_with(&path, &Overrides::default()).unwrap_or_else(|e| panic!("{e}"));
        let warnings: Vec<String> = scenario
            .findings
            .iter()
            .filter(|f| f.severity > Severity::Note)
            .map(ToString::to_string)
            .collect();
        assert!(warnings.is_empty(), "{}: {warnings:#?}", path.display());
    }
}

#[test]
fn a_wind_comes_from_where_it_is_said_to_and_must_leave_the_turns_flyable() {
    let windy = |speed: &str| {
        let text = helsinki().replacen(
            "  // wind: { from_deg: 225, speed_mps: 2 },",
            &format!("wind: {{ from_deg: 225, speed_mps: {speed} }},"),
            1,
        );
        assert_ne!(text, helsinki());
        // The wind leaves one cell more without a pass.
        let text = text.replacen("min_coverable: 0.97", "min_coverable: 0.96", 1);
        parse_with("x", &text, &builtin_files(), &Overrides::default())
    };
    let wind = windy("2").unwrap().spec.wind.first;
    assert!(
        (wind.east_mps - 2f64.sqrt()).abs() < 1e-9 && (wind.north_mps - 2f64.sqrt()).abs() < 1e-9
    );
    let refused = windy("6").unwrap_err().to_string();
    assert!(
        refused.contains("wind.speed_mps") && refused.contains("wider lanes"),
        "{refused}"
    );
}

#[test]
fn what_the_judge_of_a_run_would_not_accept_is_refused_before_it() {
    // The loop reaches 97.3 % of this area, the judge counts fewer.
    let ring = "[[0, 0], [700, 0], [700, 420], [1400, 470], [700, 520], [700, 900], [0, 900]]";
    let text = helsinki().replacen(
        "area: { west_m: 0, south_m: 0, east_m: 1056, north_m: 960 },",
        &format!("area: {{ ring_m: {ring} }},"),
        1,
    );
    let read = |text: &str| parse_with("x", text, &builtin_files(), &Overrides::default());
    let refused = read(&text).unwrap_err().to_string();
    assert!(
        refused.contains("checks.min_coverable: only 96.9 %"),
        "{refused}"
    );
    let asked_less = text.replacen("min_coverable: 0.97", "min_coverable: 0.96", 1);
    assert!(read(&asked_less).is_ok());
}

#[test]
fn all_chaos_plans_can_be_read() {
    for path in files_in("chaos", ".json5") {
        let faults = skein_scenario::load_chaos_plan(&path, None).unwrap_or_else(|e| panic!("{e}"));
        assert!(!faults.is_empty());
    }
}

#[test]
fn what_is_built_in_is_what_lies_in_configs() {
    let file = load_with(
        &configs().join("trials/helsinki.json5"),
        &Overrides::default(),
    )
    .unwrap();
    let built_in = load_builtin("helsinki", &Overrides::default()).unwrap();
    assert_eq!(file.spec.mission, built_in.spec.mission);
    assert_eq!(
        file.spec.mission.content_hash(),
        built_in.spec.mission.content_hash()
    );
}

/// What resolving derived is what is flown: nothing derives it a second time.
#[test]
fn the_loop_is_derived_once_and_handed_on() {
    for name in skein_scenario::builtin_names() {
        let scenario = load_builtin(name, &Overrides::default()).unwrap();
        assert!(Arc::ptr_eq(
            &scenario.spec.mission,
            &scenario.geometry.mission
        ));
        let geometry = Arc::clone(&scenario.geometry);
        let mut prepared = Prepared::with_geometry(scenario.spec, geometry);
        let flown = prepared.geometry_cache.of(&prepared.spec.mission).unwrap();
        assert!(Arc::ptr_eq(&flown, &scenario.geometry), "{name}");
    }
}

#[test]
fn helsinki_is_what_it_says() {
    let scenario = load_builtin("helsinki", &Overrides::default()).unwrap();
    let spec = &scenario.spec;
    assert_eq!(spec.uavs.len(), 8);
    assert_eq!(spec.buildings.len(), 385);
    let mut roofs: Vec<f64> = spec
        .buildings
        .iter()
        .map(|b| b.height_m)
        .filter(|h| *h >= 35.0)
        .collect();
    roofs.sort_by(f64::total_cmp);
    assert_eq!(format!("{roofs:?}"), "[38.0, 39.0, 70.0]");
    assert_eq!(spec.zones.len(), 3);
    let total = skein_scenario::summary(spec, &scenario.geometry);
    assert!((total.area_m2 - 1_013_760.0).abs() < 1.0);
    assert!(
        total.coverable_share >= 0.97,
        "{:.4}: {}",
        total.coverable_share,
        total.reasons()
    );
    assert!(total.unassigned_cells.is_empty());
    for u in &spec.uavs {
        let flown_m = (u.airframe.endurance_s - u.airframe.reserve_s) * u.airframe.cruise_mps;
        assert!(flown_m >= 2.5 * total.loop_m, "UAV {}", u.id);
        assert!(u.airframe.min_turn_radius_m() <= 24.0);
    }
}

/// The world and the planner share no code; what the one says can be seen, the other
/// must plan for, else no run could ever succeed.
#[test]
fn the_planner_misses_no_cell_that_the_world_calls_coverable() {
    for name in skein_scenario::builtin_names() {
        let scenario = load_builtin(name, &Overrides::default()).unwrap();
        let survey = skein_netsim::world::Survey::new(&scenario.spec);
        assert!(
            survey.coverable_share() >= scenario.spec.min_coverable,
            "{name}: {}",
            survey.coverable_share()
        );
        // What an operator's next mission asks for is judged by what the planner leaves out.
        assert_eq!(survey.left_out(&scenario.geometry), [], "{name}");
        let open = survey.cells().iter().filter(|c| c.uncoverable.is_none());
        let the_loop = &scenario.geometry.coverage_loop;
        // The middles of the judge's own squares lie in the pieces of the passes, and its
        // pieces of lines in the stations.
        let planned = |c: &&skein_netsim::world::Cell| match the_loop.patches() {
            Patches::Listed(list)
                if matches!(scenario.spec.mission.task, CoverageTask::Lines(_)) =>
            {
                let piece = survey.pieces().unwrap().rings()[usize::from(c.id.number().unwrap())];
                let holds = |station: &[Point; 4]| piece.iter().all(|p| within(station, *p, 0.01));
                list.corners().iter().any(holds)
            }
            Patches::Listed(list) if scenario.spec.mission.task == CoverageTask::Exact => {
                let side_m = survey.lane_m();
                let at = Point::new(
                    (f64::from(c.id.col) + 0.5) * side_m,
                    (f64::from(c.id.row) + 0.5) * side_m,
                );
                list.corners().iter().any(|p| within(p, at, 0.01))
            }
            _ => the_loop.index_of(c.id).is_some(),
        };
        let missed: Vec<_> = open.filter(|c| !planned(c)).map(|c| c.id).collect();
        assert!(missed.is_empty(), "{name}: {missed:?}");
    }
}

/// Whether a point lies in a rectangle, or no farther than `slack_m` from its sides.
fn within(p: &[Point; 4], at: Point, slack_m: f64) -> bool {
    let (u, v) = (p[1] - p[0], p[3] - p[0]);
    let w = at - p[0];
    let inside = |axis: Vector| {
        let along = w.dot(&axis) / axis.norm();
        (-slack_m..=axis.norm() + slack_m).contains(&along)
    };
    inside(u) && inside(v)
}

#[test]
fn targets_are_what_their_files_say() {
    let load = |name: &str| load_builtin(name, &Overrides::default()).unwrap();
    let points = load("points");
    assert_eq!(points.spec.mission.pieces().unwrap().len(), 48);
    assert_eq!(points.geometry.coverage_loop.len(), 48);
    let roads = load("roads");
    let total = skein_scenario::summary(&roads.spec, &roads.geometry);
    // Some 13.5 km of road, with the ways between and the turns of a fixed wing.
    assert!(
        total.loop_m > 14_000.0 && total.loop_m < 19_000.0,
        "{}",
        total.loop_m
    );
    assert!(total.coverable_share >= 0.97, "{}", total.reasons());
}

#[test]
fn a_field_is_covered_but_for_what_lies_at_its_zones() {
    let field = load_builtin("field", &Overrides::default()).unwrap();
    let survey = skein_netsim::world::Survey::new(&field.spec);
    let why: std::collections::BTreeSet<String> = survey
        .cells()
        .iter()
        .filter_map(|c| c.uncoverable.map(|u| u.to_string()))
        .collect();
    let near = "nearer to a no-fly zone than the clearance".to_owned();
    assert_eq!(why, [near].into());
    let total = skein_scenario::summary(&field.spec, &field.geometry);
    assert!(total.uncoverable.is_empty(), "{}", total.reasons());
    // One lane width for each metre, and the turns between.
    let bound_m = survey.coverable_share() * total.area_m2 / 48.0;
    assert!(
        total.loop_m < 1.45 * bound_m,
        "{} of {bound_m}",
        total.loop_m
    );
}

#[test]
fn a_patrol_goes_round_as_often_as_it_says() {
    let patrol = load_builtin("patrol", &Overrides::default()).unwrap();
    assert_eq!(patrol.spec.mission.further_laps, 4);
    let text = builtin_text("patrol").unwrap();
    for (to, what) in [
        ("laps: 0,", "laps: 0 is out of range"),
        (
            "laps: 2, planner: \"exact\",",
            "exact passes are flown once",
        ),
    ] {
        let text = text.replacen("laps: 5,", to, 1);
        let said = parse_with("p", &text, &builtin_files(), &Overrides::default())
            .unwrap_err()
            .to_string();
        assert!(said.contains(what), "{said}");
    }
}

/// Each to its verdict: an open line and a closed one watched for a time, places that are stayed
/// over, a road and a fire that nobody knows.
#[test]
fn missions_by_diagrams_of_their_own_pass_with_one_uav_and_with_eight() {
    for name in ["border", "fire", "inspection", "highway", "wildfire"] {
        for peers in [1, 8] {
            let over = Overrides {
                peers: Some(peers),
                ..Overrides::default()
            };
            let spec = load_builtin(name, &over).unwrap().spec;
            let prepared = Prepared::new(spec);
            let faults = prepared.spec.faults.clone();
            let report = run(&prepared, 1, faults, Wanted::default()).report;
            assert!(report.passed, "{name} {peers}: {:?}", report.reasons);
        }
    }
}

#[test]
fn wrong_missions_are_refused_where_they_stand() {
    let text = builtin_text("border").unwrap();
    let from = "mission: { diagram: \"patrol\", for_s: 900 },";
    assert!(text.contains(from));
    for (to, problem) in [
        ("mission: { diagram: \"patrl\" },", "did you mean patrol?"),
        (
            "mission: { diagram: \"inspection\" }, laps: 3,",
            "is flown once, and the mission has laps",
        ),
        (
            "mission: { diagram: \"coverage\", for_s: 9 },",
            "has no timer that ends it",
        ),
        (
            "mission: { diagram: \"patrol\", for_s: 900 }, laps: 3,",
            "leave the laps out",
        ),
        ("mission: { diagram: \"patrol\", for_s: 0 },", "for_s"),
        (
            "mission: { diagram: { name: \"own\" } },",
            "mission.diagram.states is missing",
        ),
        ("mission: { },", "mission.diagram is missing"),
    ] {
        let text = text.replacen(from, to, 1);
        let said = parse("border.json5", &text, &builtin_files()).map(drop);
        let said = said.unwrap_err().to_string();
        assert!(said.contains(problem), "{to}: {said}");
    }
}

#[test]
fn wrong_targets_are_refused_where_they_stand() {
    let refused = |from: &str, to: &str| {
        let text = builtin_text("roads").unwrap().replacen(from, to, 1);
        assert!(text != builtin_text("roads").unwrap(), "{from}");
        parse_with(
            "roads.json5",
            &text,
            &builtin_files(),
            &Overrides::default(),
        )
        .unwrap_err()
        .to_string()
    };
    let lines = "lines: { file: \"../data/helsinki_roads.geojson\", width_m: 8 },";
    for (to, what) in [
        ("lines: { ways_m: [[[0, 0]]] },", "at least 2 points"),
        ("lines: { ways_m: [] },", "no line is given"),
        (
            "lines: { ways_m: [[[5000, 0], [5100, 0]]] },",
            "lies within the area",
        ),
        (
            "lines: { file: \"../data/nothing.geojson\" },",
            "nothing.geojson",
        ),
        (
            "points: [], lines: { ways_m: [[[0, 0], [9, 9]]] },",
            "not both",
        ),
        ("points: [{ east_m: 3 }],", "points[0].north_m"),
        (
            "points: { file: \"../data/helsinki_roads.geojson\" },",
            "no point is given",
        ),
        (
            "lines: { ways_m: [[[0, 0], [90, 90]]], width_m: -1 },",
            "width_m",
        ),
    ] {
        let said = refused(lines, to);
        assert!(
            said.contains(what) && said.contains("roads.json5:2"),
            "{to}: {said}"
        );
    }
}

#[test]
fn another_number_of_uavs_leaves_out_what_it_cannot_do() {
    for peers in [1, 2, 4, 16] {
        let over = Overrides {
            peers: Some(peers),
            ..Overrides::default()
        };
        let scenario = load_builtin("geofence", &over).unwrap_or_else(|e| panic!("{peers}: {e}"));
        assert_eq!(scenario.spec.uavs.len(), usize::from(peers));
    }
}

/// Replaces a piece of the Helsinki scenario; returns the complaint, if there is one,
/// and the line of the change.
fn complaint(from: &str, to: &str) -> (String, usize) {
    let text = helsinki();
    let at = text
        .find(from)
        .unwrap_or_else(|| panic!("the scenario does not contain {from}"));
    let line = text[..at].matches('\n').count() + 1;
    let said = parse(
        "helsinki.json5",
        &text.replacen(from, to, 1),
        &builtin_files(),
    );
    (
        said.map_or_else(|e| e.to_string(), |_| "accepted".to_owned()),
        line,
    )
}

/// Line and column that a complaint begins with.
fn place(complaint: &str) -> Option<(usize, usize)> {
    let mut numbers = complaint
        .strip_prefix("helsinki.json5:")?
        .split(':')
        .map(str::parse::<usize>);
    Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
}

/// Each case: what stood there, what is put there, what the complaint must contain.
/// All of them must name the line of the change and a column.
const WRONG: &[(&str, &str, &str)] = &[
    (
        "seed: 1,",
        "sede: 1,",
        "sede: unknown field; did you mean seed?",
    ),
    (
        "reserve_s: 300,\n      // A nadir",
        "reserve: 300,\n      // A nadir",
        "airframes.swift.reserve: unknown field; did you mean reserve_s?",
    ),
    (
        "spacing_m: 48,",
        "spacing_ft: 48,",
        "lanes.spacing_ft: unknown field; did you mean spacing_m?",
    ),
    (
        "spacing_m: 48,",
        "spacing_m: 40,",
        "lanes.spacing_m: lanes of 40 m are too narrow for a turn radius of 21.4 m",
    ),
    (
        "spacing_m: 48,",
        "spacing_m: NaN,",
        "lanes.spacing_m: NaN is not a finite number",
    ),
    (
        "spacing_m: 48,",
        "spacing_m: -Infinity,",
        "lanes.spacing_m: -Infinity is not a finite number",
    ),
    (
        "spacing_m: 48,",
        "spacing_m: \"48 m\",",
        "lanes.spacing_m: expected a number (metres)",
    ),
    (
        "spacing_m: 48,",
        "spacing_m: 1e999,",
        "lanes.spacing_m: 1e999 is not a finite number",
    ),
    ("spacing_m: 48,", "spacing_m: 48 48,", "syntax: "),
    (
        "time_scale: 8,",
        "time_scale: 11,",
        "time_scale: 11 is out of range",
    ),
    (
        "time_scale: 8,",
        "time_scale: 8, time_scale: 8,",
        "time_scale: given twice",
    ),
    (
        "beacon_period_s: 1,",
        "beacon_period_s: 0.5,",
        "beacon_period_s: 0.5 s at time scale 8",
    ),
    (
        "max_time_s: 6000,",
        "max_time_s: 180,",
        "max_time_s: covering takes about",
    ),
    (
        "name: \"helsinki\",",
        "name: \"hel sinki\",",
        "name: expected 1 to 32",
    ),
    (
        "lat_deg: 60.1655,",
        "lat_deg: 160.1655,",
        "origin.lat_deg: 160.1655 is out of range",
    ),
    (
        "west_m: 0, south_m: 0, east_m: 1056,",
        "west_m: 0, south_m: 0, east_m: -1056,",
        "area: the rectangle has no area",
    ),
    (
        "area: { west_m: 0, south_m: 0, east_m: 1056, north_m: 960 },",
        "area: { ring_m: [[0, 0], [900, 900], [900, 0], [0, 600]] },",
        "area.ring_m[2]: edge 0 crosses or touches edge 2",
    ),
    (
        "area: { west_m: 0, south_m: 0, east_m: 1056, north_m: 960 },",
        "area: { ring_deg: [[60.17, 24.94], [61.17, 24.94], [60.17, 24.95]] },",
        "area.ring_deg[1]: 61.1700000, 24.9400000 lies",
    ),
    (
        "area: { west_m: 0, south_m: 0, east_m: 1056, north_m: 960 },",
        "area: { file: \"../data/nowhere.plan\" },",
        "area.file: cannot read ../data/nowhere.plan",
    ),
    (
        "area: { west_m: 0, south_m: 0, east_m: 1056, north_m: 960 },",
        "area: { west_m: -19000, south_m: -19000, east_m: 19000, north_m: 19000 },",
        "lanes.spacing_m: an area of 38000 x 38000 m has too many cells",
    ),
    (
        "no_fly: [],",
        "no_fly: [{ ring_m: [[-100, -100], [2000, -100], [2000, 2000], [-100, 2000]] }],",
        "no_fly[0]: this no-fly zone swallows the whole area",
    ),
    (
        "no_fly: [],",
        "no_fly: [{ circle: { east_m: 528, north_m: 480, radius_m: 10 } }],",
        "base: the base, where",
    ),
    (
        "no_fly: [],",
        "no_fly: [{ circle: { east_m: 5, north_m: 4, radius_m: -1 } }],",
        "no_fly[0].circle.radius_m: -1 is out of range",
    ),
    (
        "no_fly: [],",
        "no_fly: [{}],",
        "no_fly[0]: a no-fly zone is one of",
    ),
    (
        "helsinki_buildings.geojson\", storey_m",
        "helsinki_building.geojson\", storey_m",
        "buildings.file: cannot read",
    ),
    (
        "cruise_mps: 14.5,",
        "cruise_mps: 9,",
        "airframes.swift.cruise_mps: 9 m/s is not above the stall speed",
    ),
    (
        "endurance_s: 5400,",
        "endurance_s: 0,",
        "airframes.swift.endurance_s: 0 is out of range",
    ),
    (
        "reserve_s: 300,\n      // A nadir",
        "reserve_s: 9000,\n      // A nadir",
        "airframes.swift.reserve_s: a reserve of 9000 s leaves nothing",
    ),
    (
        "fov_across_deg: 106, fov_along_deg: 90 },\n    },\n    scout",
        "fov_across_deg: 20, fov_along_deg: 20 },\n    },\n    scout",
        "airframes: the camera footprint is too small",
    ),
    ("count: 8,", "count: 0,", "fleet.count: 0 is out of range"),
    (
        "slot_step_m: 5,",
        "separation_m: 30, slot_step_m: 5,",
        "fleet.slot_step_m: UAVs with a separation_m fly at one height",
    ),
    (
        "slot_step_m: 5,",
        "slot_step_m: 5, traffic_range_m: 900,",
        "fleet.traffic_range_m: only UAVs that fly at one height sense each other",
    ),
    (
        "count: 8,",
        "count: 257,",
        "fleet.count: 257 is out of range; expected the number of UAVs, of which one peer knows at most 256, between 1 and 256",
    ),
    (
        "bank_deg: 45,",
        "bank_deg: 81,",
        "airframes.swift.bank_deg: 81 is out of range",
    ),
    (
        "fov_across_deg: 106, fov_along_deg: 90 },\n    },\n    scout",
        "fov_across_deg: 0.5, fov_along_deg: 90 },\n    },\n    scout",
        "airframes.swift.camera.fov_across_deg: 0.5 is out of range",
    ),
    (
        "count: 8,",
        "count: 2.5,",
        "fleet.count: 2.5 is not a whole number",
    ),
    (
        "airframes: [\"swift\", \"scout\"],",
        "airframes: [\"swift\", \"scot\"],",
        "fleet.airframes[1]: no airframe is named \"scot\"; did you mean scout?",
    ),
    (
        "    launch: \"base\",",
        "    launch: \"here\",",
        "fleet.launch: expected \"spread\"",
    ),
    (
        "    launch: \"base\",",
        "    launch: [],",
        "fleet.launch: the list is empty; name at least one place",
    ),
    (
        "    launch: \"base\",",
        "    launch: [{ east_m: 1, north: 2 }],",
        "fleet.launch[0].north: unknown field; did you mean north_m?",
    ),
    (
        "    launch: \"base\",",
        "    launch: [{ east_m: 528, north_m: 480 }, { east_m: 360, north_m: 300 }],",
        "fleet.launch[1]: this launch point",
    ),
    (
        "    count: 8,\n    airframes: [\"swift\", \"scout\"],\n    launch: \"base\",",
        "    count: 1, airframes: [\"swift\"], launch: [{ east_m: 528, north_m: 480 }, { east_m: 528, north_m: 580 }],",
        "fleet.launch: 1 UAVs cannot take off at 2 places",
    ),
    (
        "east_m: 480, north_m: 420, height_m: 2.5 },",
        "east_m: 480, height_m: 2.5 },",
        "ground: the field ground.north_m is missing",
    ),
    (
        "range_m: 650,",
        "range_m: true,",
        "radio.range_m: expected a number (metres)",
    ),
    (
        "loss_percent: 2,",
        "loss_percent: 102,",
        "radio.loss_percent: 102 is out of range",
    ),
    (
        "kind: \"kill\", peer: 2 },",
        "kind: \"kill\", peer: 20 },",
        "faults[1].peer: no peer has the number 20",
    ),
    (
        "at_s: 70,",
        "at_s: 7000,",
        "faults[1].at_s: 7000 is out of range",
    ),
    (
        "groups: [[1, 3], [4, 6, 8, 100]]",
        "groups: [[1, 3], [4, 3]]",
        "faults[4].groups[1][1]: peer 3 is named twice",
    ),
    (
        "max_kills: 7,",
        "max_kills: 8,",
        "storm.max_kills: at most 7 of 8 UAVs",
    ),
    (
        "min_coverable: 0.97,",
        "min_coverable: 1,",
        "checks.min_coverable: only ",
    ),
    (
        "ground: { id: 100,",
        "ground: { id: 100, colour: null,",
        "ground.colour: unknown field",
    ),
];

#[test]
fn wrong_input_is_named_by_line_column_and_field() {
    let mut wrong = Vec::new();
    for (from, to, want) in WRONG {
        let (said, line) = complaint(from, to);
        // What does not fit together may be blamed on the other side.
        let elsewhere = ["airframes: the", "base: the", "lanes.spacing_m: an area"]
            .iter()
            .any(|w| want.starts_with(w));
        let placed = place(&said).is_some_and(|(l, column)| column > 0 && (l == line || elsewhere));
        if !placed || !said.contains(want) {
            wrong.push(format!(
                "line {line}: {from} -> {to}\n  says     {said}\n  expected {want}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The Helsinki scenario with a fleet that lists its UAVs, without faults and storm.
fn listed(uavs: &str) -> String {
    let text = helsinki();
    let find = |piece: &str| text.find(piece).unwrap();
    let (before, after) = (
        &text[..find("count: 8,")],
        &text[find("slot_step_m: 5")..find("  faults: [")],
    );
    format!(
        "{before}uavs: [{uavs}],\n{after}{}",
        &text[find("  checks: {")..]
    )
}

#[test]
fn listed_uavs_are_checked_one_by_one() {
    let good = "{ id: 1, airframe: 'swift', launch: { east_m: 24, north_m: 0, heading_deg: 0 } }";
    let parsed =
        parse("l.json5", &listed(good), &builtin_files()).unwrap_or_else(|e| panic!("{e}"));
    assert!((parsed.uavs[0].launch.heading_rad - core::f64::consts::FRAC_PI_2).abs() < 1e-12);
    let cases = [
        (
            format!("{good}, {good}"),
            "fleet.uavs[1].id: the number 1 is already taken",
        ),
        (
            good.replace("id: 1", "id: 100"),
            "fleet.uavs[0].id: the number 100 is already taken",
        ),
        (
            good.replace("east_m: 24, north_m: 0", "east_m: 360, north_m: 300"),
            "fleet.uavs[0].launch: this launch point lies inside a no-fly zone",
        ),
        (
            good.replace("east_m: 24, north_m: 0", "east_m: 300, north_m: 300"),
            "fleet.uavs[0].launch: this launch point is",
        ),
        (
            good.replace("heading_deg: 0", "heading_rad: 0"),
            "fleet.uavs[0].launch.heading_rad: unknown field; did you mean heading_deg?",
        ),
        (
            good.replace("id: 1,", "id: 1, height_m: 20,"),
            "fleet.uavs[0].height_m: 20 is out of range",
        ),
        (String::new(), "fleet.uavs: there is no UAV"),
    ];
    for (uavs, want) in cases {
        let e = parse("l.json5", &listed(&uavs), &builtin_files())
            .unwrap_err()
            .to_string();
        assert!(
            e.contains(want),
            "{uavs}\n  says     {e}\n  expected {want}"
        );
    }
}

/// Each place has an even part of the fleet, which takes off there one after the other.
#[test]
fn a_fleet_takes_off_at_several_places() {
    let places = [(528.0, 480.0), (24.0, 24.0), (528.0, 900.0)];
    let list = places.map(|(e, n)| format!("{{ east_m: {e}, north_m: {n} }}"));
    let text = helsinki().replacen(
        "    launch: \"base\",",
        &format!("    launch: [{}], takeoff_interval_s: 4,", list.join(", ")),
        1,
    );
    let over = |launch| Overrides {
        launch,
        ..Overrides::default()
    };
    let parsed = |launch| {
        let over = over(launch);
        parse_with("l.json5", &text, &builtin_files(), &over).unwrap_or_else(|e| panic!("{e}"))
    };
    let begins: Vec<(f64, f64, u32)> = parsed(None)
        .spec
        .uavs
        .iter()
        .map(|u| (u.launch.east_m, u.launch.north_m, u.takeoff_ms))
        .collect();
    let (a, b, c) = (places[0], places[1], places[2]);
    let expected = [
        (a, 0),
        (a, 4_000),
        (a, 8_000),
        (b, 0),
        (b, 4_000),
        (b, 8_000),
        (c, 0),
        (c, 4_000),
    ];
    assert_eq!(begins, expected.map(|((e, n), t)| (e, n, t)));
    // The command line may ask for another way.
    let at_base = parsed(Some(skein_scenario::Launch::Base)).spec.uavs;
    assert_eq!(
        (at_base[7].takeoff_ms, at_base[7].launch.north_m),
        (28_000, 480.0)
    );
}

#[test]
fn swarm_20_is_what_it_says() {
    let scenario = load_builtin("swarm_20", &Overrides::default()).unwrap();
    let spec = &scenario.spec;
    assert_eq!((spec.uavs.len(), spec.radio.rate_bps), (20, 64_000));
    assert_eq!(skein_netsim::fault_generator::kills(&spec.faults), 5);
    let total = skein_scenario::summary(spec, &scenario.geometry);
    assert!(total.area_m2 > 1.7e6, "{}", total.area_m2);
    let at = |place: usize| spec.uavs.iter().skip(10 * place).take(10);
    for (place, north_m) in [(0, -120.0), (1, 1440.0)] {
        assert!(at(place).all(|u| (u.launch.north_m - north_m).abs() < 1e-9));
        assert_eq!(at(place).map(|u| u.takeoff_ms).max(), Some(27_000));
    }
}

#[test]
fn swarm_100_is_what_it_says() {
    let scenario = load_builtin("swarm_100", &Overrides::default()).unwrap();
    let spec = &scenario.spec;
    assert_eq!((spec.uavs.len(), spec.radio.rate_bps), (100, 64_000));
    assert_eq!(skein_netsim::fault_generator::kills(&spec.faults), 20);
    let total = skein_scenario::summary(spec, &scenario.geometry);
    assert!(total.area_m2 > 8e6, "{}", total.area_m2);
    let place = |u: &skein_netsim::spec::UavSpec| format!("{:?}", u.launch.position());
    let places: std::collections::BTreeSet<String> = spec.uavs.iter().map(place).collect();
    assert_eq!(places.len(), 4);
    let last_ms = spec.uavs.iter().map(|u| u.takeoff_ms).max();
    assert_eq!(last_ms, Some(72_000), "25 at each place, every 3 s");
}

#[test]
fn a_missing_scenario_is_named() {
    let e = skein_scenario::open(Some("nowhere.json5"), &Overrides::default())
        .unwrap_err()
        .to_string();
    assert!(
        e.contains("nowhere.json5: no such file") && e.contains("helsinki"),
        "{e}"
    );
}

#[test]
fn truncated_scenarios_are_refused() {
    let text = helsinki();
    let last = text.rfind('}').unwrap();
    for end in (0..=last).filter(|i| text.is_char_boundary(*i)) {
        assert!(
            parse("t.json5", &text[..end], &builtin_files()).is_err(),
            "cut at {end}"
        );
    }
}

/// Deep nesting is refused, not followed.
#[test]
fn deep_nesting_is_refused() {
    let deep = format!("{{ name: {}", "[".repeat(100_000));
    assert!(parse("d.json5", &deep, &builtin_files()).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    /// Whatever is done to a scenario's text, reading it ends in a scenario or in an
    /// error with a place.
    #[test]
    fn mutated_scenarios_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..4)) {
        const TOKENS: [&str; 16] =
            ["0", "-1", "1e9", "NaN", "null", "\"x\"", "[]", "{}", "9", ".", ",", "}", "]", ":", "true", "0.001"];
        let mut text = without_buildings();
        for (at, token) in edits {
            let mut i = at.index(text.len());
            while !text.is_char_boundary(i) {
                i -= 1;
            }
            let end = text[i..].find([' ', ',', '\n', '}', ']']).map_or(text.len(), |n| i + n);
            text.replace_range(i..end, TOKENS[token.index(TOKENS.len())]);
        }
        if let Err(e) = parse("m.json5", &text, &builtin_files()) {
            prop_assert!(e.to_string().starts_with("m.json5:"), "{e}");
        }
    }
}

/// The Helsinki scenario without comments and buildings: every edit meets a value, and
/// reading takes little time.
fn without_buildings() -> String {
    let lines = helsinki()
        .lines()
        .filter(|l| !l.trim_start().starts_with("//") && !l.contains("buildings:"));
    lines.collect::<Vec<_>>().join("\n")
}
