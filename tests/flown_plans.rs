//! Plans take the time that they claim: each is flown by the reactive layer in an airframe
//! of the simulated world, in calm air and in the wind, and compared.

use skein_behaviors::Setpoint;
use skein_behaviors::reactive::air::{self, Air};
use skein_behaviors::reactive::envelope::Envelope;
use skein_behaviors::reactive::follow::{HORIZON_S, Track};
use skein_behaviors::setpoint::Side;
use skein_flight::airframe::{Airframe, GRAVITY_MPS2};
use skein_flight::trajectory::wind::{Course, Wind};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::{Curve, NoFlyZones, Polygon};
use skein_netsim::world::fixture;
use skein_netsim::world::motion::Kinematic;
use skein_survey::area::{self, AreaRequest, Planner, Planners};
use skein_survey::flight::UavFlight;
use skein_survey::patrol::{self, Over, PatrolFlight, PatrolRequest, Pattern};
use skein_survey::team::{Sensor, Uav};
use skein_survey::tours::{self, LineTarget, PointTarget, Targets, TourRequest};
use skein_verify::generate::Site;
use std::sync::Arc;

/// Time between two percepts, milliseconds.
const PERCEPT_MS: u64 = 200;

/// How far a UAV may stray from its plan, metres: the missions' own default.
const STRAYED_M: f64 = skein_behaviors::executive::DEFAULT_TRACKING_ERROR_M;

/// The steepest bank of plans; that of the airframe leaves room for corrections.
const MOST_BANK_RAD: f64 = 0.6;

/// Radius of the tightest turns that are flown, as a share of those of plans.
const RADIUS_SHARE: f64 = 0.9;

/// Claimed times are off by at most this share: five times sharper than what is promised.
const TIME_SHARE: f64 = 0.002;

/// Generated sites that are flown.
const SITES: core::ops::Range<u64> = 40..52;

/// What came of a flight.
#[derive(Debug)]
struct Flight {
    time_s: f64,
    strayed_m: f64,
    /// The least distance from a zone, metres.
    clear_m: f64,
}

fn airframe(uav: &UavFlight) -> Airframe {
    let v = uav.speed_mps;
    Airframe {
        stall_mps: 0.5 * v,
        cruise_mps: v,
        max_mps: v,
        max_bank_rad: (v * v / (GRAVITY_MPS2 * uav.turn_radius_m * RADIUS_SHARE)).atan(),
        endurance_s: 1e6,
        reserve_s: 0.0,
        ..fixture::airframe()
    }
}

/// Flies what a plan says from its first pose on.
fn flown(uav: &UavFlight, zones: &Arc<NoFlyZones>, clearance_m: f64, wind_mps: Vector) -> Flight {
    let mut curve = Curve::empty();
    for leg in &uav.legs {
        curve.extend(&leg.curve);
    }
    let (airframe, wind) = (airframe(uav), Wind::new(wind_mps.x, wind_mps.y));
    let air = Air {
        wind,
        airspeed_mps: uav.speed_mps,
    };
    let start = curve.start().unwrap();
    let nose = wind.heading_for_course(Course(start.heading_rad), uav.speed_mps);
    let launch = Pose::new(start.position(), nose.unwrap().0);
    let mut body = Kinematic::new(airframe, launch, uav.altitude_m, 0).in_wind(wind);
    let mut envelope = Envelope::new(airframe, Arc::clone(zones), clearance_m - STRAYED_M);
    let mut track = Track::new(&curve);
    let (mut strayed_m, mut clear_m) = (0.0_f64, f64::INFINITY);
    let fastest_m = (uav.speed_mps + wind.speed_mps()) * 0.2 + 5.0;
    for tick in 1..200_000 {
        let percept = body.percept().unwrap();
        let pose = air.over_ground(percept.pose);
        let offset = track.advance(&pose, fastest_m).unwrap();
        strayed_m = strayed_m.max(offset.cross_m.abs());
        clear_m = clear_m.min(zones.distance_m(pose.position()));
        let ground_mps = wind.ground_speed_mps(Course(pose.heading_rad), uav.speed_mps);
        let left_s = track.left_m() / ground_mps.unwrap();
        if left_s < 0.2 {
            #[allow(clippy::cast_precision_loss, reason = "hours in milliseconds")]
            let time_s = percept.time_ms as f64 / 1000.0 + left_s;
            return Flight {
                time_s,
                strayed_m,
                clear_m,
            };
        }
        let limit_radps = airframe.max_turn_rate_radps(uav.speed_mps);
        let wanted = Setpoint {
            from_ms: percept.time_ms,
            airspeed_mps: uav.speed_mps,
            height_m: uav.altitude_m,
            steps: air::steps(&track, offset, &air, limit_radps),
            loiter: Side::Left,
        };
        // Where a plan ends is where the UAV lands: the envelope looks beyond it.
        let setpoint = if left_s > HORIZON_S {
            envelope.check(&percept, wanted)
        } else {
            wanted
        };
        assert!(body.apply(setpoint, percept.time_ms));
        body.advance(tick * PERCEPT_MS, &mut Vec::new());
    }
    panic!("{} never arrives", uav.name);
}

/// Flies every flight of a plan; says how many there were.
fn fly_all<'a>(
    what: &str,
    uavs: impl Iterator<Item = &'a UavFlight>,
    zones: &Arc<NoFlyZones>,
    clearance_m: f64,
    wind_mps: Vector,
) -> usize {
    let mut n_flown = 0;
    for uav in uavs.filter(|u| u.flies()) {
        let flight = flown(uav, zones, clearance_m, wind_mps);
        let name = &uav.name;
        let off = (flight.time_s / uav.time_s - 1.0).abs();
        assert!(
            off < TIME_SHARE,
            "{what}, {name}: {flight:?}, told {}",
            uav.time_s
        );
        assert!(flight.strayed_m < STRAYED_M, "{what}, {name}: {flight:?}");
        let kept_m = clearance_m - STRAYED_M;
        assert!(flight.clear_m > kept_m, "{what}, {name}: {flight:?}");
        n_flown += 1;
    }
    n_flown
}

fn polygon(ring: &[skein_verify::plane::Point]) -> Polygon {
    Polygon::new(ring.iter().map(|p| Point::new(p.x, p.y)).collect()).unwrap()
}

/// The speed of a site's UAVs, no faster than its turns allow at [`MOST_BANK_RAD`], m/s.
fn speed_mps(site: &Site) -> f64 {
    let most = GRAVITY_MPS2 * site.manner.turn_radius_m * MOST_BANK_RAD.tan();
    site.manner.speed_mps.min(most.sqrt())
}

fn team(site: &Site) -> Vec<Uav> {
    let manner = &site.manner;
    let camera = Sensor::Swath {
        width_m: manner.swath_m,
    };
    let start = Point::new(site.launch.x, site.launch.y);
    let uav = |i| {
        let name = format!("uav-{}", i + 1);
        Uav::new(name, start, speed_mps(site), manner.turn_radius_m, camera)
    };
    (0..manner.n_uavs).map(uav).collect()
}

fn zones(site: &Site) -> Vec<Polygon> {
    let rings = site.zones.iter().chain(&site.holes);
    rings.map(|ring| polygon(ring)).collect()
}

#[test]
fn areas_take_the_time_that_is_claimed_in_the_wind_too() {
    let mut n_flown = 0;
    for site in SITES.map(Site::of) {
        let no_fly = Arc::new(NoFlyZones::new(zones(&site)));
        for (planner, share) in [
            (Planner::Exact, 0.0),
            (Planner::Exact, 0.35),
            (Planner::Approximate, 0.0),
            (Planner::Approximate, 0.35),
        ] {
            let wind_mps = Vector::new(-0.6, 0.8) * (share * speed_mps(&site));
            let request = AreaRequest {
                wind_mps,
                zones: Arc::clone(&no_fly),
                fences: site.fences.iter().map(|f| polygon(f)).collect(),
                planners: Planners::Only(planner),
                steps: 200,
                ..AreaRequest::new(
                    polygon(&site.area),
                    team(&site),
                    site.manner.clearance_m,
                    60.0,
                )
            };
            // A launch within a zone is refused.
            let Ok(plan) = area::plan(&request) else {
                continue;
            };
            let what = format!("seed {}, {planner:?}, wind {share}", site.seed);
            let clearance_m = site.manner.clearance_m;
            n_flown += fly_all(&what, plan.uavs.iter(), &no_fly, clearance_m, wind_mps);
        }
    }
    assert!(n_flown > 20, "{n_flown}");
}

/// The corners of the area, or every other of its sides.
fn targets(site: &Site, lines: bool) -> Targets {
    let corners: Vec<Point> = site.area.iter().map(|p| Point::new(p.x, p.y)).collect();
    if lines {
        let line = |(i, pair): (usize, &[Point])| LineTarget {
            name: format!("line {i}"),
            way: pair.to_vec(),
            width_m: 0.0,
            sensor: None,
        };
        return Targets::Lines(corners.chunks(2).enumerate().map(line).collect());
    }
    let point = |(i, at): (usize, &Point)| PointTarget {
        name: format!("point {i}"),
        at: *at,
        radius_m: 0.0,
        sensor: None,
    };
    Targets::Points(corners.iter().enumerate().map(point).collect())
}

#[test]
fn tours_take_the_time_that_is_claimed_in_the_wind_too() {
    let mut n_flown = 0;
    for site in SITES.map(Site::of) {
        let no_fly = zones(&site);
        for (lines, share) in [(false, 0.0), (false, 0.4), (true, 0.0), (true, 0.4)] {
            let wind_mps = Vector::new(0.6, -0.8) * (share * speed_mps(&site));
            let request = TourRequest {
                zones: no_fly.iter().map(Into::into).collect(),
                clearance_m: site.manner.clearance_m,
                wind_mps,
                steps: 200,
                ..TourRequest::new(targets(&site, lines), team(&site), 60.0)
            };
            let Ok(plan) = tours::plan(&request) else {
                continue;
            };
            let what = format!("seed {}, lines {lines}, wind {share}", site.seed);
            let no_fly = Arc::new(NoFlyZones::new(no_fly.clone()));
            let flights = plan.uavs.iter().map(|tour| &tour.flight);
            let clearance_m = site.manner.clearance_m;
            n_flown += fly_all(&what, flights, &no_fly, clearance_m, wind_mps);
        }
    }
    assert!(n_flown > 20, "{n_flown}");
}

/// What a UAV of a patrol flies at first.
fn first_period(flight: &PatrolFlight) -> UavFlight {
    UavFlight {
        name: flight.name.clone(),
        path: flight.path.clone(),
        lap: Vec::new(),
        altitude_m: flight.altitude_m,
        speed_mps: flight.speed_mps,
        turn_radius_m: flight.turn_radius_m,
        length_m: flight.length_m,
        time_s: flight.station.map_or(0.0, |station| station.time_s),
        energy_s: 0.0,
        energy_wh: None,
        lane_m: None,
        passes: None,
        legs: flight.legs.clone(),
        stays: None,
    }
}

/// A patrol of a site, over its area or over its corners.
fn patrol_of(site: &Site, no_fly: &[Polygon], area: bool, wind_mps: Vector) -> PatrolRequest {
    let over = if area {
        Over::Area {
            area: polygon(&site.area),
            holes: Vec::new(),
            zones: Arc::new(NoFlyZones::new(no_fly.to_vec())),
            fences: site.fences.iter().map(|f| polygon(f)).collect(),
            planners: Planners::Only(Planner::Exact),
        }
    } else {
        Over::Targets {
            targets: targets(site, false),
            zones: no_fly.iter().map(Into::into).collect(),
        }
    };
    PatrolRequest {
        over,
        team: team(site),
        clearance_m: site.manner.clearance_m,
        wind_mps,
        altitude_m: 60.0,
        steps: 200,
        losses: None,
    }
}

#[test]
fn patrols_take_the_time_that_is_claimed_round_and_to_and_fro() {
    let (mut n_flown, mut arcs) = (0, 0);
    for site in SITES.map(Site::of) {
        let no_fly = zones(&site);
        let shared = Arc::new(NoFlyZones::new(no_fly.clone()));
        for (area, share, tired) in [
            (true, 0.0, false),
            (true, 0.3, false),
            (false, 0.0, false),
            (false, 0.3, false),
            (false, 0.0, true),
        ] {
            let wind_mps = Vector::new(0.8, 0.6) * (share * speed_mps(&site));
            let mut request = patrol_of(&site, &no_fly, area, wind_mps);
            let Ok(mut plan) = patrol::plan(&request) else {
                continue;
            };
            if tired {
                // Once round takes a little too long for each.
                let station = plan.uavs[0].station.unwrap();
                for uav in &mut request.team {
                    uav.endurance_s = Some(station.time_s * 0.97);
                }
                let Ok(other) = patrol::plan(&request) else {
                    continue;
                };
                plan = other;
            }
            arcs += usize::from(matches!(plan.pattern, Pattern::Arcs { .. }));
            let flying = plan.uavs.iter().filter(|uav| uav.station.is_some());
            let flights: Vec<UavFlight> = flying.map(first_period).collect();
            let what = format!("seed {}, area {area}, wind {share}, {tired}", site.seed);
            let clearance_m = request.clearance_m;
            n_flown += fly_all(&what, flights.iter(), &shared, clearance_m, wind_mps);
        }
    }
    assert!(n_flown > 20 && arcs > 0, "{n_flown}, {arcs} on arcs");
}
