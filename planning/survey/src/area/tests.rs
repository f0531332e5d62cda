//! Stories of teams over areas: unlike swaths, sensors, objectives and heights.

use super::*;
use crate::flight::Leg;
use crate::objective::lacks;
use crate::team::Sensor;
use core::f64::consts::PI;
use proptest::prelude::*;

fn polygon(corners: &[(f64, f64)]) -> Polygon {
    let points = corners.iter().map(|&(x, y)| Point::new(x, y));
    Polygon::new(points.collect()).unwrap()
}

/// A rectangle of this size, its corner where all start.
fn rectangle(w_m: f64, h_m: f64) -> Polygon {
    polygon(&[(0.0, 0.0), (w_m, 0.0), (w_m, h_m), (0.0, h_m)])
}

fn swath(width_m: f64) -> Sensor {
    Sensor::Swath { width_m }
}

fn uav(name: &str, camera: Sensor) -> Uav {
    Uav::new(name, Point::origin(), 15.0, 30.0, camera)
}

fn request(area: Polygon, team: &[Uav], planner: Planner) -> AreaRequest {
    AreaRequest {
        planners: Planners::Only(planner),
        steps: 200,
        ..AreaRequest::new(area, team.to_vec(), 10.0, 60.0)
    }
}

/// A field with a hole and a zone in it.
fn field(team: &[Uav], planner: Planner) -> AreaRequest {
    let zone = polygon(&[(450.0, 550.0), (600.0, 550.0), (525.0, 770.0)]);
    AreaRequest {
        holes: vec![polygon(&[(150.0, 220.0), (300.0, 220.0), (300.0, 440.0)])],
        zones: Arc::new(NoFlyZones::new(vec![zone])),
        ..request(rectangle(750.0, 1100.0), team, planner)
    }
}

fn planned(request: &AreaRequest) -> AreaPlan {
    let plan = plan(request).unwrap();
    assert_eq!(plan.uavs.len(), request.team.len());
    for (flight, uav) in plan.uavs.iter().zip(&request.team) {
        assert!((flight.path[0] - uav.start).norm() < 1e-6, "{}", uav.name);
        assert_eq!(flight.flies(), flight.path.len() > 1);
        let endurance_s = uav.endurance_s.unwrap_or(f64::INFINITY);
        assert!(flight.time_s <= endurance_s + 1e-6, "{}", uav.name);
    }
    plan
}

const PLANNERS: [Planner; 2] = [Planner::Exact, Planner::Approximate];

/// Straight pieces before and after what is seen, in order of flight, metres.
fn run_outs_m(plan: &AreaPlan) -> Vec<f64> {
    let legs = plan.uavs.iter().flat_map(|uav| uav.legs.windows(2));
    let ends = legs.filter(|pair| pair[0].sees != pair[1].sees);
    let out = ends.map(|pair| if pair[0].sees { &pair[1] } else { &pair[0] });
    let straight_m = |leg: &Leg| match leg.curve.segments() {
        [s] if s.curvature_per_m.abs() <= 0.0 => s.length_m,
        _ => 0.0,
    };
    out.map(straight_m).collect()
}

#[test]
fn passes_run_out_as_far_as_is_clear() {
    let team = [uav("a", swath(100.0))];
    for planner in PLANNERS {
        let asked = |run_out_m| AreaRequest {
            run_out_m,
            heading_rad: (planner == Planner::Exact).then_some(0.0),
            steps: 200,
            ..field(&team, planner)
        };
        let (plain, out) = (planned(&asked(0.0)), planned(&asked(40.0)));
        assert!(out.figures.makespan_s > plain.figures.makespan_s);
        assert!(out.figures.covered_share >= plain.figures.covered_share - 0.002);
        let outs = run_outs_m(&out);
        let whole = outs.iter().filter(|m| (**m - 40.0).abs() < 1e-6).count();
        // A zone stands in the way of some.
        assert!(whole * 10 > outs.len() * 6, "{planner:?}: {outs:?}");
        assert!(outs.iter().all(|m| *m < 41.0), "{outs:?}");
    }
}

#[test]
fn courses_that_are_planned_at_once_give_the_same_plan_again() {
    let team = [uav("a", swath(100.0)), uav("b", swath(100.0))];
    let request = field(&team, Planner::Exact);
    let (one, two) = (planned(&request), planned(&request));
    assert_eq!(one.figures, two.figures);
    for (a, b) in one.uavs.iter().zip(&two.uavs) {
        assert_eq!(a.path, b.path);
    }
}

#[test]
fn both_planners_are_told_side_by_side() {
    let mut slow = uav("slow", swath(80.0));
    let mut fast = uav("fast", swath(120.0));
    (slow.speed_mps, fast.speed_mps) = (10.0, 20.0);
    (slow.turn_radius_m, fast.turn_radius_m) = (15.0, 15.0);
    fast.endurance_s = Some(400.0);
    fast.start = Point::new(750.0, 0.0);
    let mut asked = field(&[slow, fast], Planner::Exact);
    (asked.planners, asked.lanes, asked.steps) = (Planners::Both, Lanes::Common, 300);
    let both = planned(&asked);
    let planners: Vec<Planner> = both.compared.iter().map(|f| f.planner).collect();
    assert_eq!(planners, PLANNERS);
    assert!(both.compared.contains(&both.figures) && both.notices.is_empty());
    for figures in &both.compared {
        assert!((0.9..=1.0).contains(&figures.covered_share), "{figures:?}");
        assert!(figures.energy_s > figures.makespan_s && figures.energy_wh.is_none());
        asked.planners = Planners::Only(figures.planner);
        let only = planned(&asked);
        assert_eq!(&only.figures, figures);
        assert!(only.compared.is_empty());
    }
}

#[test]
fn what_has_no_meaning_is_refused_by_name() {
    let team = [uav("red", swath(60.0))];
    let refused = |change: fn(&mut AreaRequest)| {
        let mut asked = field(&team, Planner::Approximate);
        change(&mut asked);
        plan(&asked).unwrap_err()
    };
    let clearance = refused(|r| r.clearance_m = -3.0);
    assert!(matches!(
        clearance,
        AreaError::Zones(DetourError::Clearance(_))
    ));
    let size = refused(|r| r.team.clear());
    assert_eq!(size, AreaError::Team(TeamError::Size(0)));
    let step = refused(|r| r.separation.layer_step_m = -1.0);
    assert_eq!(step, AreaError::Separation(NoSeparation::LayerStep(-1.0)));
    let still = refused(|r| r.team[0].speed_mps = 0.0);
    assert_eq!(still.to_string(), "red: the speed must be above 0, found 0");
    let nowhere = refused(|r| r.team[0].start.x = f64::NAN);
    assert_eq!(
        nowhere,
        AreaError::Team(TeamError::Nowhere("red".to_owned()))
    );
    let inside = refused(|r| r.team[0].start = Point::new(525.0, 600.0));
    let name = "red".to_owned();
    assert_eq!(inside, AreaError::NoPlan(PlannerError::LaunchInZone(name)));
    let blocked = refused(|r| r.clearance_m = 900.0);
    assert!(matches!(blocked, AreaError::NoPlan(_)), "{blocked}");
}

#[test]
fn one_planner_that_refuses_leaves_a_notice() {
    let team = [uav("red", swath(60.0))];
    let mut asked = field(&team, Planner::Exact);
    (asked.planners, asked.look_ahead_m, asked.steps) = (Planners::Both, Some(f64::NAN), 500);
    let plan = planned(&asked);
    assert_eq!(plan.figures.planner, Planner::Approximate);
    assert!(plan.notices[0].contains("look ahead"), "{:?}", plan.notices);
}

#[test]
fn unlike_swaths_get_sections_with_lanes_of_their_own() {
    let mut team = [uav("wide", swath(80.0)), uav("narrow", swath(30.0))];
    team[0].turn_radius_m = 25.0;
    team[1].turn_radius_m = 15.0;
    for planner in PLANNERS {
        let mut asked = request(rectangle(750.0, 550.0), &team, planner);
        let plan = planned(&asked);
        assert_eq!(plan.figures.laid, Laid::Sections, "{planner:?}");
        let lanes: Vec<f64> = plan.uavs.iter().map(|u| u.lane_m.unwrap()).collect();
        assert!((lanes[0] - 80.0).abs() < 1e-9 && (lanes[1] - 30.0).abs() < 1e-9);
        let common = &plan.compared[0];
        assert_eq!(common.laid, Laid::Common);
        assert!(common.makespan_s > 1.05 * plan.figures.makespan_s);
        // What is told of the other lanes is the best that they come to.
        asked.lanes = Lanes::Common;
        let only = planned(&asked);
        assert!((only.figures.makespan_s - common.makespan_s).abs() < 1e-6);
        assert!(only.figures.laid == Laid::Common && only.compared.is_empty());
    }
    // Sections are drawn.
    let section = |s: &&Shape| matches!(s.kind, ShapeKind::Section { .. });
    let drawn = planned(&field(&team, Planner::Exact));
    assert_eq!(drawn.shapes.iter().filter(section).count(), 2);
    // Like swaths are planned as one team, whatever is asked.
    team[1].camera = Some(swath(80.0));
    let plans = [Lanes::Sections, Lanes::Common].map(|lanes| {
        planned(&AreaRequest {
            lanes,
            ..field(&team, Planner::Exact)
        })
    });
    assert_eq!(plans[0], plans[1]);
}

#[test]
fn only_who_carries_the_sensor_takes_part() {
    let with = |mut uav: Uav, sensors: &[(&str, f64)]| {
        let own = sensors.iter().map(|(n, w)| ((*n).to_owned(), swath(*w)));
        uav.sensors = own.collect();
        uav
    };
    let team = [
        with(uav("a", swath(60.0)), &[("rgb", 60.0), ("thermal", 30.0)]),
        with(uav("b", swath(60.0)), &[("rgb", 60.0)]),
        uav("c", swath(70.0)),
    ];
    let asked = |sensor: &str| AreaRequest {
        sensor: Some(sensor.to_owned()),
        ..request(rectangle(800.0, 500.0), &team, Planner::Exact)
    };
    let stays = |plan: &AreaPlan| plan.uavs.iter().map(|u| u.stays).collect::<Vec<_>>();
    let thermal = planned(&asked("thermal"));
    let lacks = Some(Stays::NoSensor);
    assert_eq!(stays(&thermal), [None, lacks, lacks]);
    assert!((thermal.uavs[0].lane_m.unwrap() - 30.0).abs() < 1e-9);
    assert_eq!(stays(&planned(&asked("rgb"))), [None, None, lacks]);
    let error = plan(&asked("lidar")).unwrap_err().to_string();
    assert!(error.ends_with("the team has rgb, thermal"), "{error}");
}

/// Figures of the same area for each objective.
fn by_objective(team: &[Uav]) -> [AreaPlan; 3] {
    [Objective::Time, Objective::Distance, Objective::Energy].map(|objective| {
        planned(&AreaRequest {
            objective,
            ..request(rectangle(900.0, 600.0), team, Planner::Exact)
        })
    })
}

#[test]
fn distance_and_energy_leave_the_dear_at_home() {
    let with = |name: &str, speed_mps: f64, power_w: f64| Uav {
        speed_mps,
        turn_radius_m: 15.0,
        cruise_power_w: Some(power_w),
        ..uav(name, swath(60.0))
    };
    let mut team = vec![
        with("dear", 15.0, 900.0),
        with("cheap", 12.0, 150.0),
        with("far", 15.0, 200.0),
    ];
    team[2].start = Point::new(0.0, 1112.0);
    let all = by_objective(&team);
    let flying = |plan: &AreaPlan| plan.uavs.iter().map(UavFlight::flies).collect::<Vec<_>>();
    assert_eq!(flying(&all[0]), [true, true, true]);
    assert_eq!(flying(&all[2]), [false, true, false]);
    assert!(!all[1].uavs[2].flies());
    let figures: [fn(&Figures) -> f64; 3] =
        [|f| f.makespan_s, |f| f.total_m, |f| f.energy_wh.unwrap()];
    for (own, figure) in all.iter().zip(figures) {
        for other in &all {
            assert!(figure(&own.figures) <= figure(&other.figures) + 1e-6);
            assert!((other.figures.covered_share - 1.0).abs() < 0.002);
        }
    }
    // With too little endurance all fly, under every objective, and the rest is told.
    let mut tired = team.clone();
    for uav in &mut tired {
        uav.endurance_s = Some(200.0);
    }
    for plan in by_objective(&tired) {
        assert_eq!(plan.figures.uavs_flying, 3);
        let left = |f| matches!(f, Facts::Passes { unserved_passes, .. } if unserved_passes > 0);
        assert!(plan.facts.is_some_and(left) && plan.figures.makespan_s <= 200.0 + 1e-6);
    }
    // Who costs less flies as long as it can, and the dear one flies the rest.
    let mut short = [with("dear", 15.0, 900.0), with("cheap", 15.0, 100.0)];
    short[1].endurance_s = Some(600.0);
    let [even, _, cheap] = by_objective(&short);
    for plan in [&even, &cheap] {
        assert!((plan.figures.covered_share - 1.0).abs() < 0.002);
    }
    let energy_wh = |plan: &AreaPlan| plan.figures.energy_wh.unwrap();
    assert!(energy_wh(&cheap) < 0.8 * energy_wh(&even));
    team[0].cruise_power_w = None;
    let error = plan(&AreaRequest {
        objective: Objective::Energy,
        ..request(rectangle(900.0, 600.0), &team, Planner::Exact)
    });
    let error = error.unwrap_err().to_string();
    assert!(error.contains("dear has no cruise_power_w"), "{error}");
}

#[test]
fn flights_that_meet_have_heights_and_see_as_wide_as_their_lanes() {
    let fov = |across_deg: f64| Sensor::FieldOfView { across_deg };
    let cameras = [fov(60.0), fov(60.0), fov(40.0)];
    let named = ["a", "b", "c"].iter().zip(cameras);
    let team: Vec<Uav> = named.map(|(name, camera)| uav(name, camera)).collect();
    let mut asked = request(rectangle(600.0, 600.0), &team, Planner::Exact);
    asked.altitude_m = 80.0;
    let layered = planned(&asked);
    let highest = |plan: &AreaPlan| plan.uavs.iter().map(|u| u.altitude_m).fold(0.0, f64::max);
    assert!(highest(&layered) >= 100.0);
    for (flight, camera) in layered.uavs.iter().zip(cameras) {
        let sees_m = camera.across_m(flight.altitude_m);
        assert!(flight.altitude_m >= 80.0 && flight.lane_m.unwrap() <= sees_m + 1e-6);
    }
    asked.separation = Separation::FLAT;
    let flat = planned(&asked);
    assert!((highest(&flat) - 80.0).abs() < 1e-9);
    assert!(flat.figures.makespan_s >= layered.figures.makespan_s - 1e-6);
    asked.altitude_m = -5.0;
    let error = plan(&asked).unwrap_err().to_string();
    assert!(error.starts_with("a: a field of view"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3))]

    #[test]
    fn sections_see_all_and_the_best_is_never_later(
        size in (300.0..900.0f64, 300.0..900.0f64),
        uavs in prop::collection::vec((10.0..20.0f64, 35.0..100.0f64), 2..5),
        turn in 10.0..40.0f64,
    ) {
        let one = |(i, &(speed_mps, width_m)): (usize, &(f64, f64))| Uav {
            speed_mps,
            turn_radius_m: turn,
            ..uav(&format!("u{i}"), swath(width_m))
        };
        let team: Vec<Uav> = uavs.iter().enumerate().map(one).collect();
        for planner in PLANNERS {
            let plans = [Lanes::Common, Lanes::Sections, Lanes::Best].map(|lanes| {
                let area = rectangle(size.0, size.1);
                planned(&AreaRequest { lanes, steps: 40, ..request(area, &team, planner) })
            });
            let [common, sections, best] = plans.map(|plan| plan.figures);
            for figures in [&common, &sections, &best] {
                prop_assert!(figures.covered_share > 0.999, "{planner:?}");
            }
            let least_s = common.makespan_s.min(sections.makespan_s);
            prop_assert!(best.makespan_s <= least_s + 1e-6, "{planner:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3))]

    /// Few lanes for many: who shares them is in the way of others.
    #[test]
    fn more_uavs_are_never_slower(
        size in (150.0..500.0f64, 120.0..300.0f64),
        start in (-300.0..0.0f64, -100.0..300.0f64),
        course in prop::option::of(0.0..PI),
        needle in any::<bool>(),
        narrow in any::<bool>(),
    ) {
        let zone = polygon(&[(60.0, 50.0), (90.0, 55.0), (75.0, 95.0)]);
        let one = |i: usize| {
            let width_m = if narrow && i == 1 { 40.0 } else { 60.0 };
            Uav { start: Point::new(start.0, start.1), ..uav(&format!("u{i}"), swath(width_m)) }
        };
        let all: Vec<Uav> = (0..5).map(one).collect();
        for planner in PLANNERS {
            let mut before: Vec<Figures> = Vec::new();
            for k in 1..=all.len() {
                let asked = AreaRequest {
                    zones: Arc::new(NoFlyZones::new(vec![zone.clone(); usize::from(needle)])),
                    heading_rad: course.filter(|_| planner == Planner::Exact),
                    steps: 60,
                    ..request(rectangle(size.0, size.1), &all[..k], planner)
                };
                let own = planned(&asked).figures;
                for (i, fewer) in before.iter().enumerate() {
                    let as_much = fewer.covered_share >= own.covered_share;
                    prop_assert!(
                        !as_much || own.makespan_s <= fewer.makespan_s * (1.0 + 1e-9),
                        "{planner:?}, {k} UAVs: {own:?} after {} with {fewer:?}", i + 1
                    );
                }
                before.push(own);
            }
        }
    }
}

#[test]
fn no_course_that_is_asked_for_is_flown_sooner() {
    let area = polygon(&[(0.0, 0.0), (420.0, 60.0), (380.0, 260.0), (-40.0, 200.0)]);
    let team = ["a", "b", "c"].map(|name| uav(name, swath(45.0)));
    let free = AreaRequest {
        steps: 3_000,
        ..request(area, &team, Planner::Exact)
    };
    let found = planned(&free).figures;
    for i in 0..36 {
        let asked = AreaRequest {
            heading_rad: Some((5.0 * f64::from(i)).to_radians()),
            ..free.clone()
        };
        let own = planned(&asked).figures;
        let sees_as_much = own.covered_share >= found.covered_share;
        assert!(
            !sees_as_much || found.makespan_s <= 1.005 * own.makespan_s,
            "{i}: {own:?} {found:?}"
        );
    }
}

#[test]
fn among_needles_no_course_is_better() {
    let area = polygon(&[(0.0, 0.0), (420.0, 60.0), (380.0, 260.0), (-40.0, 200.0)]);
    let needle = |x: f64| polygon(&[(x, 60.0), (x + 4.0, 60.0), (x + 30.0, 170.0)]);
    let team = ["a", "b"].map(|name| uav(name, swath(45.0)));
    let free = AreaRequest {
        zones: Arc::new(NoFlyZones::new(vec![needle(120.0), needle(230.0)])),
        steps: 200,
        ..request(area, &team, Planner::Exact)
    };
    let found = planned(&free).figures;
    for i in 0..36 {
        let asked = AreaRequest {
            heading_rad: Some(PI * f64::from(i) / 36.0),
            ..free.clone()
        };
        let own = planned(&asked).figures;
        assert!(
            own.covered_share < found.covered_share || own.makespan_s >= found.makespan_s,
            "{i}: {own:?} {found:?}"
        );
    }
}

#[test]
fn a_quick_plan_says_what_it_left() {
    let team = [uav("a", swath(30.0))];
    let needle = |x: f64| polygon(&[(x, 160.0), (x + 4.0, 160.0), (x + 30.0, 270.0)]);
    let asked = |quick| AreaRequest {
        zones: Arc::new(NoFlyZones::new(vec![needle(120.0), needle(430.0)])),
        quick,
        ..request(rectangle(900.0, 700.0), &team, Planner::Exact)
    };
    let said = |plan: &AreaPlan| plan.notices.iter().any(|n| n.contains("a quick plan"));
    let (quick, full) = (planned(&asked(true)), planned(&asked(false)));
    assert!(said(&quick) && !said(&full), "{:?}", quick.notices);
    assert!(!quick.figures.beats(&full.figures), "{quick:?} {full:?}");
}

impl Figures {
    /// Whether it sees more, or as much sooner.
    fn beats(&self, other: &Self) -> bool {
        let (own, others) = (lacks(self.covered_share), lacks(other.covered_share));
        own < others || (own == others && self.makespan_s < other.makespan_s - 1e-6)
    }
}
