//! Each rule holds on a plan that keeps it, and is broken by the least change that breaks it.

#![allow(
    clippy::unwrap_used,
    reason = "a test may; the lint's own exception does not reach helpers"
)]

use serde_json::{Value, json};
use skein_verify::VerifyError;
use skein_verify::load::{File, load};
use skein_verify::path::Piece;
use skein_verify::plane::{Plane, Point};
use skein_verify::recount::{Report, Rule, Settings, recount};
use skein_verify::report;
use std::f64::consts::{FRAC_PI_2, PI};
use std::time::Instant;

const PLANE: Plane = Plane {
    lat_deg: 47.0,
    lon_deg: 8.0,
};

fn file(name: &str, text: impl ToString) -> File {
    File {
        name: name.to_owned(),
        text: text.to_string(),
    }
}

fn lon_lat(x: f64, y: f64) -> Value {
    let at = PLANE.place(Point::new(x, y));
    json!([at.lon_deg, at.lat_deg])
}

fn ring(points: &[(f64, f64)]) -> Value {
    points.iter().map(|(x, y)| lon_lat(*x, *y)).collect()
}

fn rectangle(x: f64, y: f64, wide: f64, high: f64) -> Vec<(f64, f64)> {
    vec![(x, y), (x + wide, y), (x + wide, y + high), (x, y + high)]
}

fn polygon(rings: &[Vec<(f64, f64)>], properties: Value) -> Value {
    let rings: Vec<Value> = rings.iter().map(|r| ring(r)).collect();
    json!({"type": "Feature", "properties": properties,
        "geometry": {"type": "Polygon", "coordinates": rings}})
}

fn features(all: &[Value]) -> Value {
    json!({"type": "FeatureCollection", "features": all})
}

fn piece(p: &Piece) -> Value {
    let at = PLANE.place(p.start);
    json!({
        "lat_deg": at.lat_deg, "lon_deg": at.lon_deg,
        "course_deg": (90.0 - p.heading_rad.to_degrees()).rem_euclid(360.0),
        "length_m": p.length_m, "radius_m": p.radius_m, "sees": p.sees,
    })
}

/// Pieces one after the other: length and radius, positive to the right.
fn chain(x: f64, y: f64, heading_rad: f64, pieces: &[(f64, Option<f64>, bool)]) -> Vec<Piece> {
    let (mut start, mut heading_rad) = (Point::new(x, y), heading_rad);
    let mut out = Vec::new();
    for (length_m, radius_m, sees) in pieces {
        let piece = Piece {
            start,
            heading_rad,
            length_m: *length_m,
            radius_m: *radius_m,
            sees: *sees,
        };
        (start, heading_rad) = (piece.end(), piece.end_heading_rad());
        out.push(piece);
    }
    out
}

/// Two lanes of 300 m, 60 m apart, with half turns at both ends: a closed flight round
/// the origin.
fn racetrack() -> Vec<Piece> {
    let turn = (30.0 * PI, Some(-30.0), false);
    let lane = (300.0, None, true);
    chain(-150.0, -30.0, 0.0, &[lane, turn, lane, turn])
}

/// The area that it sees: two lanes of 60 m.
fn area() -> Value {
    polygon(&[rectangle(-150.0, -60.0, 300.0, 120.0)], json!({}))
}

fn plan_of(pieces: &[Piece]) -> Value {
    let length_m: f64 = pieces.iter().map(|p| p.length_m).sum();
    let begin = PLANE.place(pieces[0].start);
    let begin = json!({"lat_deg": begin.lat_deg, "lon_deg": begin.lon_deg});
    json!({
        "origin": {"lat_deg": PLANE.lat_deg, "lon_deg": PLANE.lon_deg},
        "covered_share": 1.0, "makespan_s": length_m / 15.0, "total_m": length_m,
        "clearance_m": 10.0, "look_ahead_m": 30.0, "swath_m": 60.0,
        "flights": [{
            "name": "uav-1", "uav": 1, "time_s": length_m / 15.0, "length_m": length_m,
            "lane_m": 600.0, "altitude_m": 60.0, "turn_radius_m": 30.0, "speed_mps": 15.0,
            "points": [begin.clone(), begin],
            "trajectory": pieces.iter().map(piece).collect::<Vec<_>>(),
        }],
    })
}

fn told(plan: &Value, ground: &Value, settings: &Settings) -> Result<Report, VerifyError> {
    let plans = [file("plan.json", plan)];
    let (plan, ground) = load(&plans, Some(&file("area.geojson", ground)), &[])?;
    recount(&plan, &ground, settings)
}

fn broken(plan: &Value, ground: &Value) -> Vec<Rule> {
    let report = told(plan, ground, &Settings::default()).unwrap();
    report.violations.iter().map(|v| v.rule).collect()
}

fn said(plan: &Value, ground: &Value) -> String {
    let report = told(plan, ground, &Settings::default()).unwrap();
    report::text(&report)
}

#[test]
fn a_plan_that_keeps_all_rules_holds() {
    let zone = polygon(
        &[rectangle(-50.0, 70.01, 100.0, 50.0)],
        json!({"no_fly": true}),
    );
    let ground = features(&[area(), zone]);
    let report = told(&plan_of(&racetrack()), &ground, &Settings::default()).unwrap();
    assert!(report.holds(), "{}", report::text(&report));
    assert!((report.covered_share.unwrap() - 1.0).abs() < 1e-6);
    assert!((report.flights[0].to_zone.unwrap() - 40.01).abs() < 1e-6);
    assert!((report.flights[0].tightest_m.unwrap() - 30.0).abs() < 1e-9);
    assert!((report.area_m2.unwrap() - 36_000.0).abs() < 5.0);
    let json = report::json(&report);
    assert_eq!(json["holds"], true);
}

#[test]
fn gaps_and_bends_are_found() {
    for (off_m, broken_rules) in [(0.009, vec![]), (0.02, vec![Rule::Gap])] {
        let mut pieces = racetrack();
        pieces[2].start.y += off_m;
        assert_eq!(broken(&plan_of(&pieces), &area()), broken_rules, "{off_m}");
    }
    for (off_deg, broken_rules) in [(0.001_f64, vec![]), (0.02, vec![Rule::Bend])] {
        let mut pieces = racetrack();
        pieces[2].heading_rad += off_deg.to_radians();
        // The lane is short enough that its end is less than a centimetre off.
        let mut plan = plan_of(&pieces);
        if off_deg > 0.01 {
            pieces[2].length_m = 20.0;
            plan = plan_of(&pieces[..3]);
            plan["flights"][0]["points"] = json!([]);
            plan["covered_share"] = json!(null);
        }
        assert_eq!(broken(&plan, &area()), broken_rules, "{off_deg}");
    }
}

#[test]
fn many_small_gaps_are_one_large_one() {
    let mut pieces = Vec::new();
    for i in 0..40 {
        let x = f64::from(i) * 10.005;
        let next = Point::new(x + 10.0, 0.0);
        pieces.push(Piece::between(Point::new(x, 0.0), next, true));
    }
    let mut plan = plan_of(&pieces);
    plan["flights"][0]["points"] = json!([]);
    plan["covered_share"] = json!(null);
    assert_eq!(broken(&plan, &area()), [Rule::Gap]);
    assert!(
        said(&plan, &area()).contains("add up to 0.195 m"),
        "{}",
        said(&plan, &area())
    );
}

#[test]
fn a_flight_ends_where_it_says() {
    let pieces = racetrack();
    let mut plan = plan_of(&pieces[..3]);
    plan["covered_share"] = json!(null);
    assert_eq!(broken(&plan, &area()), [Rule::Ends]);
    assert!(said(&plan, &area()).contains("the trajectory ends 60.000 m from"));
}

#[test]
fn arcs_are_as_wide_as_the_uav_turns() {
    for (radius_m, broken_rules) in [(29.9995, vec![]), (29.99, vec![Rule::Radius])] {
        let turn = (radius_m * PI, Some(-radius_m), false);
        let lane = (300.0, None, true);
        let pieces = chain(-150.0, -30.0, 0.0, &[lane, turn, lane, turn]);
        assert_eq!(
            broken(&plan_of(&pieces), &area()),
            broken_rules,
            "{radius_m}"
        );
    }
}

#[test]
fn an_arc_that_grazes_a_corner_is_measured_exactly() {
    // The eastern turn reaches x = 180 at y = 0; a needle points at it.
    for (gap_m, broken_rules) in [(9.9995, vec![]), (9.998, vec![Rule::Zone])] {
        let tip = 180.0 + gap_m;
        let needle = vec![(tip, 0.0), (tip + 80.0, -1.0), (tip + 80.0, 1.0)];
        let ground = features(&[area(), polygon(&[needle], json!({"no_fly": "yes"}))]);
        assert_eq!(
            broken(&plan_of(&racetrack()), &ground),
            broken_rules,
            "{gap_m}"
        );
    }
}

#[test]
fn what_flies_through_a_zone_is_told_with_its_place() {
    let zone = polygon(&[rectangle(-50.0, 25.0, 100.0, 50.0)], json!({"no_fly": 1}));
    let ground = features(&[area(), zone]);
    let text = said(&plan_of(&racetrack()), &ground);
    // 300 m, a turn, and then 100 m of the second lane to the zone's eastern side.
    let at = 300.0 + 30.0 * PI + 100.0;
    let says = format!("uav-1: 100.0 m of the flight inside zone /features/1, first at {at:.1} m");
    assert!(text.contains(&says), "{text}");
    assert!(
        text.contains("deepest 5.0 m") && text.contains("VIOLATED"),
        "{text}"
    );
}

#[test]
fn a_flight_fits_through_a_gap_as_wide_as_twice_the_clearance() {
    for (gap_m, broken_rules) in [(20.0, vec![]), (19.98, vec![Rule::Zone, Rule::Zone])] {
        let side = |y: f64| polygon(&[rectangle(-20.0, y, 40.0, 20.0)], json!({"no_fly": "1"}));
        let half = gap_m / 2.0;
        let ground = features(&[area(), side(30.0 + half), side(30.0 - half - 20.0)]);
        let mut plan = plan_of(&racetrack());
        plan["covered_share"] = json!(null);
        assert_eq!(broken(&plan, &ground), broken_rules, "{gap_m}");
    }
}

#[test]
fn a_flight_inside_a_ring_of_zones_is_as_good_as_outside() {
    // Four walls that overlap at their ends, 15 m from the flight.
    let (w, h) = (195.0, 45.0);
    let walls = [
        rectangle(-w - 20.0, -h - 20.0, 2.0 * w + 40.0, 20.0),
        rectangle(-w - 20.0, h, 2.0 * w + 40.0, 20.0),
        rectangle(-w - 20.0, -h - 20.0, 20.0, 2.0 * h + 40.0),
        rectangle(w, -h - 20.0, 20.0, 2.0 * h + 40.0),
    ];
    let walls = walls.map(|r| polygon(&[r], json!({"no_fly": true})));
    let ground = features(&[&[area()][..], &walls].concat());
    let report = told(&plan_of(&racetrack()), &ground, &Settings::default()).unwrap();
    let to_zone = report.flights[0].to_zone.unwrap();
    assert!((to_zone - 15.0).abs() < 1e-6, "{to_zone}");
    // What of the area lies under the walls need not be seen.
    assert!(report.holds(), "{}", report::text(&report));
}

#[test]
fn holes_are_kept_out_of() {
    for (high_m, rules) in [(39.9, vec![]), (41.0, vec![Rule::Hole])] {
        let hole = rectangle(-20.0, -high_m / 2.0, 40.0, high_m);
        let ground = polygon(&[rectangle(-150.0, -60.0, 300.0, 120.0), hole], json!({}));
        assert_eq!(broken(&plan_of(&racetrack()), &ground), rules, "{high_m}");
        let settings = Settings {
            cross_holes: true,
            ..Settings::default()
        };
        let report = told(&plan_of(&racetrack()), &ground, &settings).unwrap();
        assert!(report.holds(), "{}", report::text(&report));
    }
}

/// A `.plan` with one inclusion fence round the racetrack, and its survey.
fn fenced(fence: &[(f64, f64)], circle: Option<(f64, f64, f64, bool)>) -> Value {
    let pair = |(x, y): &(f64, f64)| {
        let at = PLANE.place(Point::new(*x, *y));
        json!([at.lat_deg, at.lon_deg])
    };
    let ring = |r: &[(f64, f64)]| r.iter().map(pair).collect::<Vec<_>>();
    let circles: Vec<Value> = circle
        .iter()
        .map(|(x, y, r, inclusion)| {
            json!({"inclusion": inclusion, "circle": {"center": pair(&(*x, *y)), "radius": r}})
        })
        .collect();
    json!({
        "fileType": "Plan",
        "geoFence": {"polygons": [{"inclusion": true, "polygon": ring(fence)}], "circles": circles},
        "mission": {"items": [{"type": "ComplexItem", "complexItemType": "survey",
            "polygon": ring(&rectangle(-150.0, -60.0, 300.0, 120.0))}]},
    })
}

#[test]
fn fences_are_stayed_within_by_the_clearance() {
    for (side_m, rules) in [
        (190.0, vec![]),
        (189.9, vec![Rule::Fence]),
        (170.0, vec![Rule::Fence]),
    ] {
        let fence = rectangle(-side_m, -200.0, 2.0 * side_m, 400.0);
        let ground = fenced(&fence, None);
        assert_eq!(broken(&plan_of(&racetrack()), &ground), rules, "{side_m}");
    }
    let fence = rectangle(-170.0, -200.0, 340.0, 400.0);
    let text = said(&plan_of(&racetrack()), &fenced(&fence, None));
    assert!(
        text.contains("outside inclusion fence 1, first at"),
        "{text}"
    );
    assert!(text.contains("farthest 10.0 m"), "{text}");
    // A U round the flight whose tongue reaches between the lanes is left by both turns.
    let u = [
        (-200.0, -70.0),
        (200.0, -70.0),
        (200.0, 70.0),
        (-200.0, 70.0),
        (-200.0, 5.0),
        (100.0, 5.0),
        (100.0, -5.0),
        (-200.0, -5.0),
    ];
    assert_eq!(
        broken(&plan_of(&racetrack()), &fenced(&u, None)),
        [Rule::Fence]
    );
}

#[test]
fn circles_are_zones_and_fences() {
    let wide = rectangle(-900.0, -900.0, 1800.0, 1800.0);
    // The flight's farthest places from the middle are on the turns' outer sides.
    for (radius_m, rules) in [(190.1, vec![]), (189.0, vec![Rule::Fence])] {
        let ground = fenced(&wide, Some((0.0, 0.0, radius_m, true)));
        assert_eq!(broken(&plan_of(&racetrack()), &ground), rules, "{radius_m}");
    }
    for (radius_m, rules) in [(19.9, vec![]), (20.1, vec![Rule::Zone])] {
        let ground = fenced(&wide, Some((0.0, 60.0, radius_m, false)));
        let mut plan = plan_of(&racetrack());
        plan["covered_share"] = json!(null);
        assert_eq!(broken(&plan, &ground), rules, "{radius_m}");
    }
}

#[test]
fn claims_are_compared() {
    let ground = area();
    let change = |at: &str, by: f64| {
        let mut plan = plan_of(&racetrack());
        let value = plan.pointer_mut(at).unwrap();
        *value = json!(value.as_f64().unwrap() * by);
        broken(&plan, &ground)
    };
    assert_eq!(change("/flights/0/length_m", 1.005), []);
    assert_eq!(change("/flights/0/length_m", 1.02), [Rule::Length]);
    assert_eq!(change("/flights/0/time_s", 0.97), [Rule::Time]);
    assert_eq!(change("/makespan_s", 0.97), [Rule::Makespan]);
    assert_eq!(change("/total_m", 1.02), [Rule::Length]);
    assert_eq!(change("/covered_share", 0.996), []);
    assert_eq!(change("/covered_share", 0.99), [Rule::Share]);
    // A camera that was off sees nothing.
    let mut pieces = racetrack();
    pieces[2].sees = false;
    assert_eq!(broken(&plan_of(&pieces), &ground), [Rule::Share]);
    let settings = Settings {
        min_share: Some(0.6),
        ..Settings::default()
    };
    let report = told(&plan_of(&pieces), &ground, &settings).unwrap();
    assert_eq!(report.violations[1].rule, Rule::LeastShare);
    assert!((report.covered_share.unwrap() - 0.5).abs() < 1e-3);
}

#[test]
fn in_a_wind_times_and_turns_are_those_through_the_air() {
    let ground = area();
    let mut plan = plan_of(&racetrack());
    plan["wind_mps"] = json!(5.0);
    assert_eq!(broken(&plan, &ground), []);
    assert!(said(&plan, &ground).contains("not told where the wind comes from"));
    // One lane with it, one against; a turn of 30 m with 20 m/s is one of 30 (15 / 20)².
    plan["wind_from_deg"] = json!(270.0);
    let report = told(&plan, &ground, &Settings::default()).unwrap();
    let rules: Vec<Rule> = report.violations.iter().map(|v| v.rule).collect();
    assert_eq!(rules, [Rule::Radius, Rule::Time, Rule::Makespan]);
    let time_s = report.makespan_s.unwrap();
    assert!((55.0..66.0).contains(&time_s), "{time_s}");
    plan["flights"][0]["turn_radius_m"] = json!(30.0 * 0.75 * 0.75);
    plan["flights"][0]["time_s"] = json!(time_s);
    plan["makespan_s"] = json!(time_s);
    assert_eq!(broken(&plan, &ground), []);
    plan["wind_mps"] = json!(15.0);
    assert!(said(&plan, &ground).contains("as fast as a UAV"));
}

#[test]
fn flags_say_what_the_plan_does_not() {
    let mut plan = plan_of(&racetrack());
    for name in ["clearance_m", "look_ahead_m", "swath_m"] {
        plan[name] = json!(null);
    }
    for name in ["turn_radius_m", "speed_mps"] {
        plan["flights"][0][name] = json!(null);
    }
    let zone = polygon(
        &[rectangle(-50.0, 65.0, 100.0, 50.0)],
        json!({"no_fly": true}),
    );
    let ground = features(&[area(), zone]);
    let report = told(&plan, &ground, &Settings::default()).unwrap();
    assert!(report.holds() && report.covered_share.is_none() && report.makespan_s.is_none());
    assert_eq!(report.notices.len(), 4, "{:?}", report.notices);
    let settings = Settings {
        clearance_m: Some(36.0),
        turn_radius_m: Some(31.0),
        swath_m: Some(30.0),
        look_ahead_m: Some(0.0),
        speed_mps: Some(10.0),
        min_share: None,
        ..Settings::default()
    };
    let report = told(&plan, &ground, &settings).unwrap();
    let rules: Vec<Rule> = report.violations.iter().map(|v| v.rule).collect();
    let all = [
        Rule::Radius,
        Rule::Time,
        Rule::Zone,
        Rule::Makespan,
        Rule::Share,
    ];
    assert_eq!(rules, all, "{}", report::text(&report));
}

#[test]
fn plans_of_other_programs_are_straight_legs() {
    let pair = |x: f64, y: f64| {
        let at = PLANE.place(Point::new(x, y));
        (at.lat_deg, at.lon_deg)
    };
    let item = |command: i64, x: f64, y: f64| {
        let (lat, lon) = pair(x, y);
        json!({"type": "SimpleItem", "command": command, "params": [0, 0, 0, null, lat, lon, 60]})
    };
    let (lat, lon) = pair(-200.0, -30.0);
    // Pictures from the first corner of the survey to the last.
    let trigger =
        |m: f64| json!({"type": "SimpleItem", "command": 206, "params": [m, 0, 1, 0, 0, 0, 0]});
    let transects = [
        trigger(20.0),
        item(16, 150.0, -30.0),
        item(16, 150.0, 30.0),
        item(16, -150.0, 30.0),
        trigger(0.0),
    ];
    let plan = json!({"fileType": "Plan", "mission": {
        "cruiseSpeed": 10, "plannedHomePosition": [lat, lon, 0],
        "items": [item(22, -150.0, -30.0), item(201, 5000.0, 0.0),
            {"type": "ComplexItem", "complexItemType": "survey",
             "TransectStyleComplexItem": {"Items": transects}},
            {"type": "SimpleItem", "command": 20, "params": [0, 0, 0, 0, 0, 0, 0]}],
    }});
    let zone = polygon(
        &[rectangle(160.0, -10.0, 50.0, 20.0)],
        json!({"no_fly": true}),
    );
    let settings = Settings {
        clearance_m: Some(10.0),
        turn_radius_m: Some(40.0),
        swath_m: Some(60.0),
        ..Settings::default()
    };
    let report = told(&plan, &features(&[area(), zone.clone()]), &settings).unwrap();
    assert!(report.holds(), "{}", report::text(&report));
    let way_m = 50.0 + 300.0 + 60.0 + 300.0 + 60.0_f64.hypot(50.0);
    assert!((report.total_m - way_m).abs() < 1e-3, "{}", report.total_m);
    assert!((report.makespan_s.unwrap() - way_m / 10.0).abs() < 1e-3);
    assert!((report.flights[0].to_zone.unwrap() - 10.0).abs() < 1e-3);
    assert!((report.covered_share.unwrap() - 1.0).abs() < 1e-6);
    let seeing_m = report.flights[0].seeing_m;
    assert!((seeing_m - 660.0).abs() < 1e-3, "{seeing_m}");
    // Of legs it is told that their corners cannot be rounded, and no more.
    assert!(
        report
            .notices
            .iter()
            .any(|n| n.contains("too short to round"))
    );
    // The same as a line.
    let line = json!({"type": "LineString", "coordinates": ring(&[(-150.0, -30.0), (151.0, -30.0), (151.0, 30.0)])});
    let report = told(&line, &features(&[area(), zone]), &settings).unwrap();
    assert_eq!(report.violations.len(), 1);
    assert!((report.violations[0].found - 9.0).abs() < 1e-3);
}

#[test]
fn several_files_are_one_team() {
    let line =
        |y: f64| json!({"type": "LineString", "coordinates": ring(&[(-150.0, y), (150.0, y)])});
    let plans = [
        file("a.geojson", line(-30.0)),
        file("b.geojson", line(30.0)),
    ];
    let area_file = file("area.geojson", area());
    let (plan, ground) = load(&plans, Some(&area_file), &[]).unwrap();
    let settings = Settings {
        swath_m: Some(60.0),
        min_share: Some(0.999),
        ..Settings::default()
    };
    let report = recount(&plan, &ground, &settings).unwrap();
    assert!(report.holds(), "{}", report::text(&report));
    assert_eq!(report.flights.len(), 2);
    // Zones of another file, whatever their properties say.
    let more = file(
        "more.geojson",
        polygon(&[rectangle(0.0, 20.0, 20.0, 20.0)], json!({})),
    );
    let (plan, ground) = load(&plans, Some(&area_file), &[more]).unwrap();
    assert!(!recount(&plan, &ground, &settings).unwrap().holds());
    // Plans of two planes are not one plan.
    let mut moved = plan_of(&racetrack());
    moved["origin"]["lat_deg"] = json!(47.01);
    let two = [file("a.json", plan_of(&racetrack())), file("b.json", moved)];
    assert!(matches!(
        load(&two, Some(&area_file), &[]),
        Err(VerifyError::Together(_))
    ));
}

#[test]
fn what_is_no_plan_is_refused_with_its_place() {
    let error = |plan: &str, ground: &str| {
        let plans = [file("p.json", plan)];
        let error = load(&plans, Some(&file("g.json", ground)), &[]).unwrap_err();
        error.to_string()
    };
    let good = plan_of(&racetrack()).to_string();
    let ground = area().to_string();
    let change = |at: &str, to: &str| {
        let mut plan = plan_of(&racetrack());
        *plan.pointer_mut(at).unwrap() = json!("HERE");
        error(&plan.to_string().replace("\"HERE\"", to), &ground)
    };
    for (plan, says) in [
        ("", "p.json:1:1: the plan: the file is empty"),
        ("[]", "expected an object"),
        ("{}", "this is no plan"),
        ("{\"flights\": []}", "the field origin is missing"),
        (
            "{\"type\": \"FeatureCollection\", \"features\": []}",
            "no LineString",
        ),
        ("{\"fileType\": \"Plan\"}", "the field mission is missing"),
    ] {
        let error = error(plan, &ground);
        assert!(
            error.contains(says) && error.contains("p.json:1"),
            "{error}"
        );
    }
    let first = "/flights/0/trajectory/0";
    for (at, to, says) in [
        ("lat_deg", "NaN", "NaN is not a finite number"),
        ("lat_deg", "48.0", "from the origin of the plan"),
        ("course_deg", "1e9", "out of range"),
        ("length_m", "-1", "out of range"),
        ("length_m", "1e308", "out of range"),
        ("length_m", "900000", "from the origin of the plan"),
        ("radius_m", "1e-9", "is no radius"),
        ("radius_m", "0.1", "more than 20 turns"),
        ("radius_m", "\"x\"", "expected a number"),
        ("sees", "1", "expected true or false"),
    ] {
        let error = change(&format!("{first}/{at}"), to);
        assert!(
            error.contains(says) && error.contains("p.json:1:"),
            "{at} {to}: {error}"
        );
        assert!(error.contains("flights[0].trajectory[0]"), "{error}");
    }
    let bow = polygon(
        &[vec![(0.0, 0.0), (99.0, 90.0), (99.0, 0.0), (0.0, 99.0)]],
        json!({"no_fly": true}),
    );
    let odd = polygon(
        &[rectangle(0.0, 0.0, 9.0, 9.0)],
        json!({"no_fly": "perhaps"}),
    );
    let far = polygon(
        &[rectangle(30_000.0, 0.0, 9.0, 9.0)],
        json!({"no_fly": true}),
    );
    for (zone, says) in [
        (bow, "g.json: /features/1: the ring crosses itself"),
        (odd, "/features/1/properties/no_fly: perhaps is neither"),
        (far, "g.json: /features/1: 46.99"),
    ] {
        let error = error(&good, &features(&[area(), zone]).to_string());
        assert!(error.contains(says), "{error}");
    }
    for end in 0..good.len().min(700) {
        let plans = [file("p.json", &good[..end])];
        assert!(load(&plans, Some(&file("g.json", &ground)), &[]).is_err());
    }
}

#[test]
fn numbers_that_are_none_break_a_rule() {
    let area_file = file("area.geojson", area());
    let plans = [file("p.json", plan_of(&racetrack()))];
    let (mut plan, ground) = load(&plans, Some(&area_file), &[]).unwrap();
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        plan.flights[0].pieces[1].start.x = bad;
        let report = recount(&plan, &ground, &Settings::default()).unwrap();
        assert_eq!(report.violations[0].rule, Rule::Piece);
    }
}

#[test]
fn a_hundred_thousand_pieces_and_as_many_edges_take_seconds() {
    // A spiral of short straight pieces and a comb of needles below it.
    let n = 100_000_u32;
    let at = |i: u32| {
        let turn = f64::from(i) * 0.01;
        let r = 200.0 + f64::from(i) * 0.05;
        Point::new(r * turn.cos(), r * turn.sin() + 5400.0)
    };
    let corners: Vec<Point> = (0..n).map(at).collect();
    let line: Vec<(f64, f64)> = corners.iter().map(|p| (p.x, p.y)).collect();
    let plan = json!({"type": "LineString", "coordinates": ring(&line)});
    let teeth = 20_000_u32;
    let mut comb: Vec<(f64, f64)> = vec![(-5000.0, -500.0)];
    for i in 0..teeth {
        let x = -5000.0 + f64::from(i) * 0.5;
        comb.extend([(x, -400.0), (x + 0.25, 500.0)]);
    }
    comb.push((5000.0, -500.0));
    comb.reverse();
    let ground = features(&[
        polygon(&[rectangle(-6000.0, 0.0, 12_000.0, 12_000.0)], json!({})),
        polygon(&[comb], json!({"no_fly": true})),
    ]);
    let began = Instant::now();
    let settings = Settings {
        clearance_m: Some(1.0),
        swath_m: Some(40.0),
        ..Settings::default()
    };
    let report = told(&plan, &ground, &settings).unwrap();
    assert!(!report.holds());
    let share = report.covered_share.unwrap();
    assert!((0.3..0.9).contains(&share), "{share}");
    assert!(began.elapsed().as_secs() < 30, "{:?}", began.elapsed());
}

#[test]
fn a_quarter_turn_is_a_quarter_turn() {
    let turn = chain(0.0, 0.0, 0.0, &[(30.0 * FRAC_PI_2, Some(30.0), false)]);
    assert!(turn[0].end().distance(Point::new(30.0, -30.0)) < 1e-9);
}
