//! Plans a field with a building for three UAVs of unlike cameras, and prints what each
//! flies: `cargo run -p skein-survey --example plan_cover`.

use skein_geometry::frame::Point;
use skein_geometry::{NoFlyZones, Polygon};
use skein_survey::area::{self, AreaRequest};
use skein_survey::team::{Sensor, Uav};
use std::error::Error;
use std::sync::Arc;

/// Distance kept from the building, metres.
const CLEARANCE_M: f64 = 15.0;

/// Height of the lowest flight, metres.
const ALTITUDE_M: f64 = 80.0;

fn polygon(corners: &[(f64, f64)]) -> Result<Polygon, Box<dyn Error>> {
    let points = corners.iter().map(|&(x, y)| Point::new(x, y));
    Ok(Polygon::new(points.collect())?)
}

fn main() -> Result<(), Box<dyn Error>> {
    // Metres east and north of the launch point.
    let field = polygon(&[(0.0, 0.0), (1200.0, 0.0), (1200.0, 700.0), (300.0, 900.0)])?;
    let building = polygon(&[
        (500.0, 300.0),
        (620.0, 300.0),
        (620.0, 380.0),
        (500.0, 380.0),
    ])?;
    let wide = Sensor::FieldOfView { across_deg: 53.0 };
    let narrow = Sensor::Swath { width_m: 40.0 };
    let launch = Point::origin();
    let team = vec![
        Uav::new("red", launch, 15.0, 30.0, wide),
        Uav::new("green", launch, 15.0, 30.0, wide),
        Uav {
            endurance_s: Some(1_500.0),
            ..Uav::new("blue", launch, 20.0, 18.0, narrow)
        },
    ];
    let request = AreaRequest {
        zones: Arc::new(NoFlyZones::new(vec![building])),
        steps: 2_000,
        ..AreaRequest::new(field, team, CLEARANCE_M, ALTITUDE_M)
    };
    let plan = area::plan(&request)?;
    println!(
        "{:.1} % seen in {:.0} s",
        100.0 * plan.figures.covered_share,
        plan.figures.makespan_s
    );
    for uav in &plan.uavs {
        println!(
            "{}: {:.0} m in {:.0} s at {:.0} m, {} corners",
            uav.name,
            uav.length_m,
            uav.time_s,
            uav.altitude_m,
            uav.path.len()
        );
    }
    Ok(())
}
