//! A small scenario for tests: a rectangle of 10 by 8 lanes, one no-fly zone, two
//! buildings (D2.7 §2.2). Every field is public, so a test starts from it and changes
//! what it is about. Scenario files are read elsewhere.

use crate::fault::{Fault, TimedFault};
use crate::spec::{Building, GroundStationSpec, RadioSpec, Spec, StormSpec, TroubleSpec, UavSpec};
use skein_behaviors::setpoint::Launch;
use skein_behaviors::{Setpoint, Side, Steer};
use skein_flight::airframe::{Airframe, CLIMB_MPS};
use skein_flight::mount::Mount;
use skein_geometry::Polygon;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{FRAC_PI_2, PI};
use skein_peer::Mission;
use skein_peer::mission::PointMm;
use std::sync::Arc;

/// Width of the area, metres: ten lanes.
pub const WIDTH_M: f64 = 480.0;
/// Height of the area, metres: eight lanes.
pub const HEIGHT_M: f64 = 384.0;
/// Side of a cell, metres.
pub const LANE_M: f64 = 48.0;
/// Number of the ground station.
pub const GROUND_ID: u16 = 100;

/// The airframe of every UAV of the fixture.
#[must_use]
pub fn airframe() -> Airframe {
    Airframe {
        stall_mps: 9.0,
        cruise_mps: 13.0,
        max_mps: 16.0,
        max_bank_rad: PI / 4.0,
        endurance_s: 3600.0,
        reserve_s: 60.0,
        footprint_across_m: 46.0,
        footprint_along_m: 36.0,
        mount: Mount::Level,
        climb_mps: CLIMB_MPS,
    }
}

/// The radio of the fixture: everything is in range, nothing is lost.
#[must_use]
pub fn radio() -> RadioSpec {
    RadioSpec {
        range_m: 700.0,
        rate_bps: 64_000,
        loss_permille: 0,
        delay_ms: 5,
        queue_age_ms: 2000,
    }
}

/// Storms on the fixture: as hard as the product's promise.
#[must_use]
pub fn storm(n_uavs: u16) -> StormSpec {
    StormSpec {
        max_kills: n_uavs.saturating_sub(1),
        until: 0.5,
        max_loss_permille: 300,
        max_partitions: 2,
        max_partition_s: 60,
        max_restarts: 2,
        max_revisions: 1,
        troubles: TroubleSpec::USUAL,
    }
}

/// A rectangle of 480 by 384 m with 80 cells, a no-fly zone of 30 by 30 m in the
/// middle of four of them, a tower on that zone that blocks radio up to 70 m and a
/// low house that hides only the ground station. `n_uavs` UAVs, numbered from 1,
/// start evenly spread on the middle of the outermost lane, counter-clockwise, each
/// in its own height slot from 45 m in steps of 5 m; the ground station has number
/// [`GROUND_ID`].
///
/// # Panics
/// Never: the rings are constants and valid.
#[must_use]
pub fn square(n_uavs: u16) -> Spec {
    let tower = vec![
        (225_000, 225_000),
        (255_000, 225_000),
        (255_000, 255_000),
        (225_000, 255_000),
    ];
    let house = vec![
        (96_000, 96_000),
        (132_000, 96_000),
        (132_000, 120_000),
        (96_000, 120_000),
    ];
    let uavs: Vec<UavSpec> = (0..n_uavs)
        .map(|i| UavSpec {
            id: i + 1,
            airframe: airframe(),
            launch: ring_pose(f64::from(i) / f64::from(n_uavs.max(1))),
            takeoff_ms: 0,
            in_air: true,
            height_m: 45.0 + 5.0 * f64::from(i),
            sensors: skein_peer::wire::tasks::CAMERA_ALONE,
            twin_of: None,
            aboard: false,
        })
        .collect();
    let launch = uavs
        .first()
        .map_or(Point::new(24.0, 24.0), |u| u.launch.position());
    Spec {
        name: "square".to_owned(),
        fleet: "test".to_owned(),
        mission: Arc::new(mission(launch, tower.clone())),
        buildings: vec![
            Building {
                footprint: polygon(&tower),
                height_m: 70.0,
            },
            Building {
                footprint: polygon(&house),
                height_m: 30.0,
            },
        ],
        zones: vec![polygon(&tower)],
        uavs,
        ground: Some(GroundStationSpec {
            id: GROUND_ID,
            position: Point::new(240.0, -30.0),
            height_m: 2.0,
        }),
        wind: skein_flight::trajectory::wind::Wind::CALM.into(),
        objective: skein_flight::trajectory::timed::Objective::Time,
        radio: radio(),
        beacon_period_ms: 1000,
        percept_period_ms: 500,
        time_scale: 10.0,
        max_time_s: 1800,
        min_coverable: 0.97,
        min_separation_m: 4.0,
        max_visit_s: None,
        traffic_range_m: 0.0,
        vehicles: Vec::new(),
        services: Vec::new(),
        intruders: Vec::new(),
        obstacles: Vec::new(),
        obstacle_range_m: 0.0,
        contour: None,
        crowd: None,
        faults: Vec::new(),
        storm: storm(n_uavs),
        seed: 1,
    }
}

fn mission(launch: Point, zone: Vec<PointMm>) -> Mission {
    let mm = |m: f64| {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "the fixture is smaller than a kilometre"
        )]
        let v = (m * 1000.0).round() as i32;
        v
    };
    Mission {
        revision: 1,
        origin_lat_e7: 601_655_000,
        origin_lon_e7: 249_355_000,
        area: vec![(0, 0), (480_000, 0), (480_000, 384_000), (0, 384_000)],
        zones: vec![zone],
        lane_spacing_mm: 48_000,
        turn_radius_mm: 23_000,
        clearance_mm: 8_000,
        footprint_across_mm: 46_000,
        footprint_along_mm: 36_000,
        tracking_error_mm: 2_000,
        launch: (mm(launch.x), mm(launch.y)),
        base: (96_000, 60_000),
        task: skein_peer::CoverageTask::Area,
        lap: 0,
        further_laps: 0,
        added_zones: std::collections::BTreeMap::new(),
        dismissed: Default::default(),
        finds_obstacles: false,
        sortie: 0,
        cancelled: false,
        diagram: None,
        detections: Vec::new(),
        tasks: Vec::new(),
        counts: Vec::new(),
        streets: None,
        buildings: None,
        layers: None,
        crowd: None,
        tree: skein_flight::coverage::ring::Tree::default(),
        division: Default::default(),
        separation_mm: 0,
        fastest_mmps: 0,
    }
}

/// [`square`] with one UAV killed at a time, milliseconds of scenario time.
#[must_use]
pub fn square_losing(n_uavs: u16, peer: u16, at_ms: u64) -> Spec {
    let fault = Fault::Kill { peer };
    Spec {
        faults: vec![TimedFault { at_ms, fault }],
        ..square(n_uavs)
    }
}

/// A valid ring as a polygon, in metres.
///
/// # Panics
/// When the ring is not a simple polygon: tests want to know at once.
#[must_use]
pub fn polygon(ring: &[PointMm]) -> Polygon {
    let points = ring
        .iter()
        .copied()
        .map(skein_peer::mission::point_m)
        .collect();
    Polygon::new(points).expect("a fixture ring is a simple polygon")
}

/// The pose at a share (0 to 1) of the way round the middle of the outermost lane,
/// counter-clockwise from the south-west corner cell.
fn ring_pose(share: f64) -> Pose {
    let (w, h) = (WIDTH_M - LANE_M, HEIGHT_M - LANE_M);
    let m = LANE_M / 2.0;
    let s = share * 2.0 * (w + h);
    if s < w {
        Pose::new(Point::new(m + s, m), 0.0)
    } else if s < w + h {
        Pose::new(Point::new(m + w, m + s - w), FRAC_PI_2)
    } else if s < 2.0 * w + h {
        Pose::new(Point::new(m + 2.0 * w + h - s, m + h), PI)
    } else {
        Pose::new(Point::new(m, m + 2.0 * (w + h) - s), -FRAC_PI_2)
    }
}

/// Straight on for a second at 13 m/s, 45 m high.
#[must_use]
pub fn straight(from_ms: u64) -> Setpoint {
    Setpoint {
        from_ms,
        airspeed_mps: 13.0,
        height_m: 45.0,
        steps: vec![Steer {
            turn_rate_radps: 0.0,
            duration_ms: 1000,
        }],
        loiter: Side::Left,
        gimbal: Vec::new(),
        launch: Launch::Stay,
        promised: None,
    }
}
