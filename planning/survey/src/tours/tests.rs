//! Stories of teams on tours: sensors, objectives, heights, zones, wind and networks.

use super::*;
use crate::flight::Stays;
use crate::team::Sensor;
use proptest::prelude::*;

fn swath(width_m: f64) -> Sensor {
    Sensor::Swath { width_m }
}

fn uav(name: &str, sensors: &[(&str, f64)]) -> Uav {
    let own = sensors.iter().map(|(n, w)| ((*n).to_owned(), swath(*w)));
    Uav {
        sensors: own.collect(),
        ..Uav::new(name, Point::origin(), 15.0, 30.0, swath(60.0))
    }
}

/// Points some hundred metres apart (thousandths of a degree at 47° north), each with its
/// sensor; names are their numbers.
fn points(all: &[(f64, f64, Option<&str>)]) -> Targets {
    let point = |(i, &(x, y, sensor)): (usize, &(f64, f64, Option<&str>))| PointTarget {
        name: i.to_string(),
        at: Point::new(76.0 * x, 111.0 * y),
        radius_m: 0.0,
        sensor: sensor.map(str::to_owned),
    };
    Targets::Points(all.iter().enumerate().map(point).collect())
}

fn line(name: &str, way: &[(f64, f64)], width_m: f64) -> LineTarget {
    LineTarget {
        name: name.to_owned(),
        way: way.iter().map(|&(x, y)| Point::new(x, y)).collect(),
        width_m,
        sensor: None,
    }
}

fn asked(targets: Targets, team: &[Uav]) -> TourRequest {
    TourRequest {
        steps: 2_000,
        ..TourRequest::new(targets, team.to_vec(), 60.0)
    }
}

fn planned(request: &TourRequest) -> TourPlan {
    let plan = plan(request).unwrap();
    assert_eq!(plan.uavs.len(), request.team.len());
    for (tour, uav) in plan.uavs.iter().zip(&request.team) {
        let endurance_s = uav.endurance_s.unwrap_or(f64::INFINITY);
        assert!(tour.flight.time_s <= endurance_s + 1e-6, "{}", uav.name);
        assert_eq!(tour.flight.flies(), !tour.visits.is_empty());
    }
    plan
}

/// Who sees which targets, by UAV.
fn seen(plan: &TourPlan) -> Vec<Vec<&str>> {
    plan.uavs
        .iter()
        .map(|t| t.visits.iter().map(|v| v.target.as_str()).collect())
        .collect()
}

fn team() -> Vec<Uav> {
    vec![
        uav("both", &[("rgb", 60.0), ("thermal", 30.0)]),
        uav("red", &[("rgb", 60.0)]),
        uav("bare", &[]),
    ]
}

#[test]
fn targets_are_flown_by_who_can_see_them() {
    let targets = points(&[
        (5.0, 0.0, Some("thermal")),
        (0.0, 5.0, Some("rgb")),
        (9.0, 1.0, Some("thermal")),
        (-5.0, 0.0, None),
    ]);
    let mut request = asked(targets, &team());
    let plan = planned(&request);
    let by = seen(&plan);
    assert_eq!(by[0].len(), 2);
    assert_eq!((&by[1], &by[2]), (&vec!["1"], &vec!["3"]));
    // Where the request names a sensor, the target without a wish of its own needs it too.
    request.sensor = Some("thermal".to_owned());
    let plan = planned(&request);
    assert_eq!(plan.uavs[2].flight.stays, Some(Stays::NoSensor));
    assert_eq!(seen(&plan)[0].len(), 3);
    let lidar = points(&[(5.0, 0.0, None), (0.0, 5.0, Some("lidar"))]);
    let error = super::plan(&asked(lidar, &team())).unwrap_err().to_string();
    assert!(
        error.contains("1 asks for the sensor \"lidar\"") && error.contains("rgb, thermal"),
        "{error}"
    );
}

#[test]
fn an_objective_has_its_own_figure_least() {
    let with = |name: &str, speed_mps: f64, power_w: f64| Uav {
        speed_mps,
        cruise_power_w: Some(power_w),
        ..uav(name, &[])
    };
    let mut team = vec![
        with("dear", 20.0, 800.0),
        with("cheap", 15.0, 100.0),
        with("far", 15.0, 150.0),
    ];
    team[2].start = Point::new(760.0, 1112.0);
    let lines = (0..6).map(|i| {
        let y = 222.0 * f64::from(i);
        line(&i.to_string(), &[(0.0, y), (760.0, y)], 0.0)
    });
    let lines = Targets::Lines(lines.collect());
    let by_objective = |team: &[Uav]| {
        [Objective::Time, Objective::Distance, Objective::Energy].map(|objective| {
            planned(&TourRequest {
                objective,
                ..asked(lines.clone(), team)
            })
        })
    };
    let all = by_objective(&team);
    assert_eq!(all[0].uavs_flying(), 3);
    assert_eq!(all[2].uavs[0].flight.stays, Some(Stays::NotNeeded));
    let figures: [fn(&TourPlan) -> f64; 3] =
        [|p| p.makespan_s, |p| p.total_m, |p| p.energy_wh.unwrap()];
    for (own, figure) in all.iter().zip(figures) {
        for other in &all {
            assert!(figure(own) <= figure(other) + 1e-6);
            assert!(other.unserved.is_empty());
        }
    }
    // Little endurance: most is flown whatever is to be least.
    for uav in &mut team {
        uav.endurance_s = Some(125.0);
    }
    let left = by_objective(&team).map(|plan| plan.unserved.len());
    assert!(
        left[0] > 0 && left[1] <= left[0] && left[2] <= left[0],
        "{left:?}"
    );
}

#[test]
fn flights_that_cross_get_heights_of_their_own() {
    let cross = points(&[
        (0.0, 0.0, None),
        (9.0, 9.0, None),
        (9.0, 0.0, None),
        (0.0, 9.0, None),
    ]);
    let mut team = vec![uav("a", &[]), uav("b", &[])];
    team[0].start = Point::new(760.0, 500.0);
    team[1].start = Point::new(-38.0, 500.0);
    let apart_m = |distance_m: f64| {
        let plan = planned(&TourRequest {
            separation: Separation {
                distance_m: Some(distance_m),
                layer_step_m: 30.0,
            },
            ..asked(cross.clone(), &team)
        });
        let heights: Vec<f64> = plan.uavs.iter().map(|u| u.flight.altitude_m).collect();
        (heights[0] - heights[1]).abs()
    };
    assert!(apart_m(750.0) > 29.0 && apart_m(0.0) < 1e-9);
}

#[test]
fn roads_that_cross_are_cut_and_wide_strips_become_lanes() {
    let lines = Targets::Lines(vec![
        line("east", &[(0.0, 0.0), (500.0, 0.0), (1000.0, 0.0)], 0.0),
        line(
            "north",
            &[(500.0, -500.0), (500.0, 0.0), (500.0, 500.0)],
            0.0,
        ),
        line("strip", &[(0.0, 900.0), (1000.0, 900.0)], 150.0),
    ]);
    let camera = |width_m: f64| Uav::new("a", Point::origin(), 15.0, 30.0, swath(width_m));
    let mut request = asked(lines, &[camera(50.0)]);
    let plan = planned(&request);
    // Four arms of the cross and three lanes.
    assert_eq!((plan.targets, plan.uavs[0].visits.len()), (7, 7));
    assert!(plan.makespan_s >= plan.lower_bound_s.unwrap() - 1e-6);
    request.wind_mps = Vector::new(5.0, 0.0);
    assert!(planned(&request).makespan_s > plan.makespan_s);
    request.wind_mps = Vector::new(20.0, 0.0);
    let windy = super::plan(&request).unwrap_err();
    assert!(matches!(windy, ToursError::TooWindy(_)));
    request.wind_mps = Vector::zeros();
    request.team = vec![camera(0.0)];
    let narrow = super::plan(&request).unwrap_err();
    assert!(matches!(narrow, ToursError::NoLanes { .. }), "{narrow}");
}

#[test]
fn zones_make_ways_longer_and_leave_out_what_they_hold() {
    let zone = |x: f64, y: f64, half_x: f64, half_y: f64| Zone {
        outer: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(dx, dy)| Point::new(x + dx * half_x, y + dy * half_y))
            .to_vec(),
        holes: Vec::new(),
    };
    let targets = points(&[(10.0, 0.0, None), (0.0, 10.0, None)]);
    let mut request = asked(targets, &[uav("a", &[])]);
    let free = planned(&request);
    request.clearance_m = 10.0;
    request.zones = vec![zone(400.0, 0.0, 50.0, 300.0)];
    let round = planned(&request);
    assert!(round.makespan_s > free.makespan_s && round.targets == 2);
    let flight = &round.uavs[0].flight;
    assert!((flight.length_m / 15.0 - flight.time_s).abs() < 1e-6);
    request.zones = vec![zone(760.0, 0.0, 20.0, 20.0)];
    let less = planned(&request);
    assert_eq!(less.targets, 1);
    assert_eq!(less.notices, ["0: left out, a zone is in the way"]);
    request.zones = vec![zone(0.0, 0.0, 20.0, 20.0)];
    let inside = super::plan(&request).unwrap_err();
    assert_eq!(inside, ToursError::StartInZone("a".to_owned()));
    request.zones.clear();
    request.targets = points(&[(f64::NAN, 0.0, None)]);
    let nowhere = super::plan(&request).unwrap_err();
    assert_eq!(nowhere, ToursError::Nowhere("0".to_owned()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn each_target_is_seen_once_by_a_uav_with_its_sensor(
        targets in prop::collection::vec((-9.0..9.0f64, -9.0..9.0f64, 0..4usize), 1..14),
        carried in prop::collection::vec(0..8u8, 1..6),
    ) {
        let names = ["a", "b", "c"];
        // The first UAV carries all, so that every target can be seen.
        let one = |(i, mask): (usize, u8)| {
            let own = (0..3).filter(|bit| mask >> bit & 1 == 1).map(|bit| (names[bit], 50.0));
            uav(&format!("u{i}"), &own.collect::<Vec<_>>())
        };
        let team: Vec<Uav> = std::iter::once(7).chain(carried).enumerate().map(one).collect();
        let all: Vec<(f64, f64, Option<&str>)> =
            targets.iter().map(|&(x, y, s)| (x, y, names.get(s).copied())).collect();
        let plan = planned(&TourRequest { steps: 500, ..asked(points(&all), &team) });
        let mut times = vec![0; all.len()];
        for (by, own) in seen(&plan).iter().zip(&team) {
            for target in by {
                let i: usize = target.parse().unwrap();
                times[i] += 1;
                prop_assert!(all[i].2.is_none_or(|s| own.sensors.contains_key(s)), "{target} by {}", own.name);
            }
        }
        prop_assert!(times.iter().all(|n| *n == 1), "{times:?}");
    }
}
