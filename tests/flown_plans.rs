//! Plans take the time that they claim: each is given to the executive whole, which flies
//! it in an airframe of the simulated world, in calm air and in the wind, and what the world
//! saw is compared.

use skein_behaviors::executive::DEFAULT_TRACKING_ERROR_M;
use skein_behaviors::reactive::air::Air;
use skein_behaviors::reactive::follow::Track;
use skein_behaviors::{Event, Executive, GivenFlight, Goal};
use skein_flight::airframe::{Airframe, GRAVITY_MPS2};
use skein_flight::coverage::ring::CoverageLoop;
use skein_flight::trajectory::wind::{Course, Wind};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::{Curve, NoFlyZones, Polygon};
use skein_netsim::world::fixture;
use skein_netsim::world::motion::{Kinematic, Piece};
use skein_survey::area::{self, AreaRequest, Planner, Planners};
use skein_survey::flight::UavFlight;
use skein_survey::flown::{self, Airspace};
use skein_survey::patrol::{self, Over, PatrolFlight, PatrolRequest, Pattern};
use skein_survey::team::{Sensor, Uav};
use skein_survey::tours::{self, LineTarget, PointTarget, Targets, TourRequest};
use skein_verify::generate::Site;
use std::sync::Arc;

/// Time between two percepts, milliseconds.
const PERCEPT_MS: u64 = 200;

/// What was flown is looked at so often, milliseconds: each 30 cm at 15 m/s.
const LOOK_MS: usize = 20;

/// The steepest bank of plans; that of the airframe leaves room for corrections.
const MOST_BANK_RAD: f64 = 0.6;

/// Radius of the tightest turns that are flown, as a share of those of plans.
const RADIUS_SHARE: f64 = 0.9;

/// Claimed times are off by at most this share: five times sharper than what is promised.
const TIME_SHARE: f64 = 0.002;

/// No flight strays so far from its plan, metres.
const STRAYED_M: f64 = 0.3;

/// No flight is given up later than so many times its claimed time.
const MOST_TIMES: f64 = 1.5;

/// Generated sites that are flown unless `SKEIN_FLOWN_SITES=FROM..TO` says otherwise.
const SITES: core::ops::Range<u64> = 40..52;

/// Whoever keeps less from zones is not flown, metres: the envelope measures a flight in the
/// wind a few centimetres nearer than it is.
const LEAST_CLEARANCE_M: f64 = 1.0;

/// Where plans are flown, and how.
struct Sky {
    zones: NoFlyZones,
    fences: Vec<Polygon>,
    clearance_m: f64,
    wind_mps: Vector,
}

impl Sky {
    fn air(&self, uav: &UavFlight) -> flown::Air {
        flown::Air {
            airspeed_mps: uav.speed_mps,
            wind_mps: self.wind_mps,
        }
    }

    /// What the executive takes as the most that it may stray, metres: the missions' own
    /// default, and less where plans come nearer to zones.
    fn tracking_error_m(&self) -> f64 {
        DEFAULT_TRACKING_ERROR_M.min(self.clearance_m / 2.0)
    }

    /// Zones, and what lies outside of fences, round a flight.
    fn airspace(&self, curve: &Curve) -> Airspace {
        let pieces = curve.segments().iter();
        let places = pieces.map(|s| s.start.position());
        Airspace::new(&self.zones, &self.fences, places, self.clearance_m).unwrap()
    }

    /// The executive of a UAV that is given its flight.
    fn executive(&self, uav: &UavFlight, curve: &Curve) -> Executive {
        let radius_m = self.air(uav).ground_radius_m(uav.turn_radius_m);
        let airspace = self.airspace(curve);
        let router = Arc::new(airspace.router(radius_m));
        let none = Arc::new(CoverageLoop::none());
        let mut executive = Executive::new(airframe(uav), uav.altitude_m, none, router)
            .with_tracking_error_m(self.tracking_error_m());
        let flight = GivenFlight {
            curve: curve.clone(),
            airspeed_mps: uav.speed_mps,
            lands: true,
        };
        executive.set_goal(Goal::Given(flight), &|_| false);
        executive
    }
}

/// What came of a flight, as the world saw it.
#[derive(Debug)]
struct Flight {
    time_s: f64,
    strayed_m: f64,
    /// The least distance from a zone or a fence, metres.
    clear_m: f64,
    /// What the executive told.
    told: Vec<Event>,
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

/// All that a plan says, from its first pose on.
fn whole(uav: &UavFlight) -> Curve {
    let mut curve = Curve::empty();
    for leg in &uav.legs {
        curve.extend(&leg.curve);
    }
    curve
}

/// Flies what a plan says until the executive tells that it is flown.
fn flown(uav: &UavFlight, sky: &Sky) -> Flight {
    let curve = whole(uav);
    let wind = Wind::new(sky.wind_mps.x, sky.wind_mps.y);
    let air = Air {
        wind,
        airspeed_mps: uav.speed_mps,
    };
    let start = curve.start().unwrap();
    let nose = wind.heading_for_course(Course(start.heading_rad), uav.speed_mps);
    let launch = Pose::new(start.position(), nose.unwrap().0);
    let mut body = Kinematic::new(airframe(uav), launch, uav.altitude_m, 0).in_wind(wind);
    let mut executive = sky.executive(uav, &curve);
    let mut flight = Flight {
        time_s: f64::INFINITY,
        strayed_m: 0.0,
        clear_m: f64::INFINITY,
        told: Vec::new(),
    };
    let mut beside = Track::new(&curve);
    let mut pieces: Vec<Piece> = Vec::new();
    let fastest_m = (uav.speed_mps + wind.speed_mps()) * 0.2 + 5.0;
    let mut now_ms = 0;
    while !flight.told.contains(&Event::PlanDone) {
        let percept = body.percept().unwrap();
        let pose = air.over_ground(percept.pose);
        // Beyond its end nobody is on a flight.
        if let Some(offset) = beside
            .advance(&pose, fastest_m)
            .filter(|_| beside.left_m() > 0.1)
        {
            flight.strayed_m = flight.strayed_m.max(offset.cross_m.abs());
        }
        let (setpoint, events) = executive.step(&percept, &|_| false);
        flight.told.extend(events);
        assert!(body.apply(setpoint, now_ms));
        now_ms += PERCEPT_MS;
        body.advance(now_ms, &mut pieces);
        if seconds(now_ms) > MOST_TIMES * uav.time_s + 60.0 {
            return flight;
        }
    }
    flight.time_s = passed_s(&pieces, curve.end().unwrap());
    let airspace = sky.airspace(&curve);
    let zones = airspace.zones();
    for piece in &pieces {
        let looks = (piece.from_ms..piece.to_ms).step_by(LOOK_MS);
        // After its end it has landed.
        for at_ms in looks.take_while(|ms| seconds(*ms) <= flight.time_s) {
            let clear_m = zones.distance_m(piece.pose_at(at_ms).position());
            flight.clear_m = flight.clear_m.min(clear_m);
        }
    }
    flight
}

#[allow(clippy::cast_precision_loss, reason = "hours in milliseconds")]
fn seconds(ms: u64) -> f64 {
    ms as f64 / 1000.0
}

/// When the line across the end of a flight was passed last, seconds.
fn passed_s(pieces: &[Piece], end: Pose) -> f64 {
    let beyond_m = |piece: &Piece, at_s: f64| {
        let from_end = piece.pose_after(at_s).position() - end.position();
        from_end.dot(&end.direction())
    };
    for piece in pieces.iter().rev() {
        let lasts_s = seconds(piece.to_ms - piece.from_ms);
        let (mut before_s, mut after_s) = (0.0, lasts_s);
        if beyond_m(piece, before_s) > 0.0 || beyond_m(piece, after_s) < 0.0 {
            continue;
        }
        for _ in 0..40 {
            let middle_s = f64::midpoint(before_s, after_s);
            if beyond_m(piece, middle_s) < 0.0 {
                before_s = middle_s;
            } else {
                after_s = middle_s;
            }
        }
        return seconds(piece.from_ms) + after_s;
    }
    f64::INFINITY
}

/// The sites that are flown.
fn sites() -> impl Iterator<Item = Site> {
    let asked = std::env::var("SKEIN_FLOWN_SITES").ok().map(|text| {
        let (from, to) = text.split_once("..").expect("FROM..TO");
        from.parse().unwrap()..to.parse().unwrap()
    });
    let sites = asked.unwrap_or(SITES).map(Site::of);
    sites.filter(|site| site.manner.clearance_m >= LEAST_CLEARANCE_M)
}

/// Flies every flight of a plan; says how many there were.
fn fly_all<'a>(what: &str, uavs: impl Iterator<Item = &'a UavFlight>, sky: &Sky) -> usize {
    let mut n_flown = 0;
    for uav in uavs.filter(|u| u.flies()) {
        let flight = flown(uav, sky);
        let name = &uav.name;
        let off = (flight.time_s / uav.time_s - 1.0).abs();
        assert!(
            off < TIME_SHARE,
            "{what}, {name}: {flight:?}, told {}",
            uav.time_s
        );
        assert!(flight.strayed_m < STRAYED_M, "{what}, {name}: {flight:?}");
        let kept_m = sky.clearance_m - STRAYED_M;
        assert!(flight.clear_m > kept_m, "{what}, {name}: {flight:?}");
        assert_eq!(flight.told, [Event::PlanDone], "{what}, {name}");
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

fn fences(site: &Site) -> Vec<Polygon> {
    site.fences.iter().map(|f| polygon(f)).collect()
}

#[test]
fn areas_take_the_time_that_is_claimed_in_the_wind_too() {
    let mut n_flown = 0;
    for site in sites() {
        let no_fly = Arc::new(NoFlyZones::new(zones(&site)));
        for (planner, share) in [
            (Planner::Exact, 0.0),
            (Planner::Exact, 0.4),
            (Planner::Approximate, 0.0),
            (Planner::Approximate, 0.4),
        ] {
            let wind_mps = Vector::new(-0.6, 0.8) * (share * speed_mps(&site));
            let request = AreaRequest {
                wind_mps,
                zones: Arc::clone(&no_fly),
                fences: fences(&site),
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
            let sky = Sky {
                zones: NoFlyZones::clone(&no_fly),
                fences: request.fences,
                clearance_m: site.manner.clearance_m,
                wind_mps,
            };
            n_flown += fly_all(&what, plan.uavs.iter(), &sky);
        }
    }
    println!("{n_flown} flights");
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
    for site in sites() {
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
            let sky = Sky {
                zones: NoFlyZones::new(no_fly.clone()),
                fences: Vec::new(),
                clearance_m: site.manner.clearance_m,
                wind_mps,
            };
            let flights = plan.uavs.iter().map(|tour| &tour.flight);
            n_flown += fly_all(&what, flights, &sky);
        }
    }
    println!("{n_flown} flights");
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
            fences: fences(site),
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
    for site in sites() {
        let no_fly = zones(&site);
        for (area, share, tired) in [
            (true, 0.0, false),
            (true, 0.3, false),
            (false, 0.0, false),
            (false, 0.4, false),
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
            let sky = Sky {
                zones: NoFlyZones::new(no_fly.clone()),
                fences: if area { fences(&site) } else { Vec::new() },
                clearance_m: request.clearance_m,
                wind_mps,
            };
            n_flown += fly_all(&what, flights.iter(), &sky);
        }
    }
    println!("{n_flown} flights");
    assert!(n_flown > 20 && arcs > 0, "{n_flown}, {arcs} on arcs");
}
