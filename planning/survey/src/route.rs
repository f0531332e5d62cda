//! The shortest way over places round zones with clearance (D2.7 §2.3).
//!
//! Zones are grown by the clearance, the path is the shortest among what they become,
//! and its distance from the zones as drawn is measured again before it is given away.
//! Turns are left to the UAV: D2.7 §2.4 is the business of trajectories.

use crate::flight::Leg;
use crate::flown::{Airspace, AirspaceError, Stop, fly_to};
use crate::measure::to_piece_m;
use crate::via_points::{NoLeg, shortest_through};
use crate::visibility::VisibilityGraph;
use crate::zones::{Fence, FlightZones, Level, NamedZone, flight_zones, square};
use skein_flight::route::mesh::{Mesh, MeshError};
use skein_flight::route::two_point::Search;
use skein_geometry::frame::Point;
use skein_geometry::offset::{Grown, Growth, OffsetError, Region, RepairKind, Zone, grow};
use thiserror::Error;

/// A path is refused if it comes this much nearer to a zone than the clearance, metres:
/// outlines keep the clearance to the nanometre, so only a defect can cause that.
const SLACK_M: f64 = 1e-6;

/// How far beyond everything the plane of a route ends besides the clearance, metres: room
/// to pass.
const OUTSKIRTS_M: f64 = 1_000.0;

/// A place of a route.
#[derive(Clone, Debug, PartialEq)]
pub struct RoutePlace {
    /// What it is called in errors.
    pub name: String,
    /// Where it is.
    pub at: Point,
}

/// Where a route leads, and what it keeps away from.
#[derive(Clone, Debug)]
pub struct RouteRequest {
    /// The beginning, what is flown over in this order, and the end.
    pub places: Vec<RoutePlace>,
    /// What must be kept out of.
    pub keep_out: Vec<NamedZone>,
    /// What must be stayed within, all of it at once.
    pub keep_in: Vec<Fence>,
    /// Distance kept from every zone and fence, metres.
    pub clearance_m: f64,
    /// Zones that end below a flight level are flown over; `None` for none.
    pub level: Option<Level>,
    /// Which engine looks for the path.
    pub engine: Engine,
    /// The tightest turn of who flies it, metres; `None` where nobody is to.
    pub turn_radius_m: Option<f64>,
}

/// The engines; both find the shortest path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// The search over a mesh of free space.
    Mesh,
    /// The visibility graph.
    Graph,
}

/// A route.
#[derive(Clone, Debug, PartialEq)]
pub struct RoutePlan {
    /// Its corners, the places included.
    pub path: Vec<Point>,
    /// Its distance from the zones as drawn, metres; infinite without zones.
    pub least_distance_m: f64,
    /// The number by which the structure it was found on is compared.
    pub structure_hash: u64,
    /// How many zones and fences matter at its level.
    pub n_zones: usize,
    /// What they become, grown by the clearance.
    pub regions: Vec<Region>,
    /// What was put right in the zones.
    pub repairs: Vec<NamedRepair>,
    /// What is worth saying: zones that are flown over.
    pub notices: Vec<String>,
    /// What is flown over the places in order, with turns; empty where nobody is to.
    pub legs: Vec<Leg>,
}

impl RoutePlan {
    /// Its length, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        crate::flight::length_m(&self.path)
    }
}

/// What was put right in a zone.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedRepair {
    /// What the zone is called.
    pub zone: String,
    /// Which of its vertices, from 0.
    pub vertex: usize,
    /// What.
    pub kind: RepairKind,
}

/// Why there is no route. Nothing was planned.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RouteError {
    /// The turn radius is no length.
    #[error("a turn radius is a number of metres above 0, found {0}")]
    Radius(f64),
    /// A zone is no polygon, or a fence cannot be stayed within.
    #[error(transparent)]
    Fences(#[from] AirspaceError),
    /// There is a way, and nobody can fly it.
    #[error("no flight with turns of {turn_radius_m} m keeps clear of zones and fences")]
    NoFlight {
        /// The tightest turn, metres.
        turn_radius_m: f64,
    },
    /// The clearance is no length.
    #[error("the clearance")]
    Clearance(#[source] OffsetError),
    /// The level or its margin is no height.
    #[error("a level is a number of metres with a margin from 0, found {level_m} and {margin_m}")]
    Level {
        /// The level, metres.
        level_m: f64,
        /// The margin, metres.
        margin_m: f64,
    },
    /// A zone cannot be grown.
    #[error("{zone}: {cause}")]
    Zone {
        /// What it is called.
        zone: String,
        /// Why not.
        cause: OffsetError,
    },
    /// The zones cannot be grown.
    #[error(transparent)]
    Zones(OffsetError),
    /// A place lies in a zone.
    #[error("{place} lies in a zone: {zone}")]
    InZone {
        /// What the place is called.
        place: String,
        /// What the zone is called.
        zone: String,
    },
    /// A place lies nearer to a zone than the clearance.
    #[error(
        "{place} lies {distance_m:.1} m from {zone}, nearer than the clearance of {clearance_m} m (outlines are up to half a percent wider)"
    )]
    TooNear {
        /// What the place is called.
        place: String,
        /// What the zone is called.
        zone: String,
        /// How far it is, metres.
        distance_m: f64,
        /// The clearance, metres.
        clearance_m: f64,
    },
    /// What the zones leave free cannot be cut into a mesh.
    #[error("the grown zones have no mesh")]
    Mesh(#[source] MeshError),
    /// Zones lie all round a place.
    #[error("there is no way from {from} to {to} that keeps {clearance_m} m from every zone")]
    NoWay {
        /// Which leg, from 0.
        leg: usize,
        /// What the place where it begins is called.
        from: String,
        /// What the place where it ends is called.
        to: String,
        /// The clearance, metres.
        clearance_m: f64,
    },
    /// The path does not keep the clearance: a defect of the engine.
    #[error("the route found comes within {0} m of a zone: refused")]
    Refused(f64),
}

/// Plans.
///
/// # Guarantees
/// No path over these places among the grown zones is shorter. Its distance from the zones
/// as drawn is measured by code that shares nothing with the engines.
///
/// # Errors
/// [`RouteError`] names the zone or the place.
pub fn plan(request: &RouteRequest) -> Result<RoutePlan, RouteError> {
    let clearance_m = request.clearance_m;
    let growth = Growth::new(clearance_m).map_err(RouteError::Clearance)?;
    if let Some(Level { level_m, margin_m }) = request.level
        && !(level_m.is_finite() && margin_m.is_finite() && margin_m >= 0.0)
    {
        return Err(RouteError::Level { level_m, margin_m });
    }
    let places: Vec<Point> = request.places.iter().map(|p| p.at).collect();
    let zones = flight_zones(&request.keep_out, &request.keep_in, &places, request.level);
    let grown = grow(&zones.zones, &growth).map_err(|e| named(e, &zones))?;
    for place in &request.places {
        check_place(place, &grown, &zones, clearance_m)?;
    }
    let border = square(zones.reach_m + 2.0 * (clearance_m + OUTSKIRTS_M));
    let (path, structure_hash) = shortest(request.engine, &places, &grown, &border)?;
    let name = |i: usize| request.places.get(i).map_or("?", |p| p.name.as_str());
    let path = path.map_err(|NoLeg { leg }| RouteError::NoWay {
        leg,
        from: name(leg).to_owned(),
        to: name(leg + 1).to_owned(),
        clearance_m,
    })?;
    let least_distance_m = least_distance_m(&path, &zones.zones);
    // Written so that a distance that is no number fails too.
    let keeps = least_distance_m >= clearance_m - SLACK_M;
    if !keeps {
        return Err(RouteError::Refused(least_distance_m));
    }
    let repairs = grown.repairs.iter().map(|r| NamedRepair {
        zone: zones.names.get(r.place.zone).map_or("?", |n| n).to_owned(),
        vertex: r.place.vertex,
        kind: r.kind,
    });
    let legs = match request.turn_radius_m {
        Some(turn_radius_m) => flown(&places, &zones.zones, clearance_m, turn_radius_m)?,
        None => Vec::new(),
    };
    let mut notices = Vec::new();
    if zones.flown_over > 0 {
        let over = zones.flown_over;
        notices.push(format!("{over} zone(s) end below the level: flown over"));
    }
    Ok(RoutePlan {
        path,
        least_distance_m,
        structure_hash,
        n_zones: zones.zones.len(),
        repairs: repairs.collect(),
        regions: grown.regions,
        notices,
        legs,
    })
}

/// What is flown over places in order: lines and arcs that keep the clearance all along.
fn flown(
    places: &[Point],
    zones: &[Zone],
    clearance_m: f64,
    turn_radius_m: f64,
) -> Result<Vec<Leg>, RouteError> {
    if !(turn_radius_m > 0.0 && turn_radius_m.is_finite()) {
        return Err(RouteError::Radius(turn_radius_m));
    }
    let [start, via @ .., end] = places else {
        return Ok(Vec::new());
    };
    let airspace = Airspace::of_zones(zones, places.iter().copied(), clearance_m)?;
    let stops: Vec<Stop> = via.iter().map(|p| Stop::over(*p)).collect();
    let flown = fly_to(&airspace.router(turn_radius_m), (*start, *end), &stops);
    let in_order = flown.order.iter().map(|(stop, _)| *stop).eq(0..stops.len());
    if !in_order || flown.legs.is_empty() && start != end {
        return Err(RouteError::NoFlight { turn_radius_m });
    }
    Ok(flown.legs)
}

/// The error with the name that the zone has.
fn named(cause: OffsetError, zones: &FlightZones) -> RouteError {
    let zone = match cause {
        OffsetError::NotFinite(p) | OffsetError::TooFar(p) | OffsetError::Unproven(p) => p.zone,
        OffsetError::TooFewVertices { zone, .. } => zone,
        OffsetError::Radius(_) | OffsetError::Overshoot(_) => usize::MAX,
    };
    match zones.names.get(zone) {
        Some(name) => RouteError::Zone {
            zone: name.clone(),
            cause,
        },
        None => RouteError::Zones(cause),
    }
}

fn check_place(
    place: &RoutePlace,
    grown: &Grown,
    zones: &FlightZones,
    clearance_m: f64,
) -> Result<(), RouteError> {
    if !grown.contains(place.at) {
        return Ok(());
    }
    let nearest = zones
        .zones
        .iter()
        .zip(&zones.names)
        .map(|(z, name)| (distance_m(place.at, z), name))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let place = place.name.clone();
    Err(match nearest {
        Some((distance_m, name)) if distance_m > 0.0 => RouteError::TooNear {
            place,
            zone: name.clone(),
            distance_m,
            clearance_m,
        },
        nearest => RouteError::InZone {
            place,
            zone: nearest.map_or_else(|| "?".to_owned(), |(_, name)| name.clone()),
        },
    })
}

/// A path, or the first leg without one.
type Shortest = Result<Vec<Point>, NoLeg>;

/// The path, and the number by which the structure it was found on is compared.
fn shortest(
    engine: Engine,
    places: &[Point],
    grown: &Grown,
    border: &[Point],
) -> Result<(Shortest, u64), RouteError> {
    match engine {
        Engine::Mesh => {
            let rings = grown.regions.iter().flat_map(Region::rings);
            let all: Vec<&[Point]> = std::iter::once(border).chain(rings).collect();
            let mesh = Mesh::from_rings(&all).map_err(RouteError::Mesh)?;
            let path = shortest_through(&mut Search::new(&mesh), places);
            Ok((path, mesh.content_hash()))
        }
        Engine::Graph => {
            let graph = VisibilityGraph::round(&grown.regions);
            Ok((graph.shortest_through(places), graph.content_hash()))
        }
    }
}

fn rings(zone: &Zone) -> impl Iterator<Item = &Vec<Point>> {
    std::iter::once(&zone.outer).chain(&zone.holes)
}

fn edges(zone: &Zone) -> impl Iterator<Item = (Point, Point)> + '_ {
    rings(zone).flat_map(|r| (0..r.len()).map(move |i| (r[i], r[(i + 1) % r.len()])))
}

/// Distance from `p` to a zone, 0 inside, metres.
fn distance_m(p: Point, zone: &Zone) -> f64 {
    // Odd crossings in the outer ring or in a hole change sides once each.
    let inside = rings(zone).fold(false, |inside, r| inside ^ crosses_oddly(r, p));
    if inside {
        return 0.0;
    }
    edges(zone)
        .map(|(a, b)| to_piece_m(p, a, b))
        .fold(f64::INFINITY, f64::min)
}

fn crosses_oddly(ring: &[Point], p: Point) -> bool {
    let n = ring.len();
    (0..n).fold(false, |odd, i| {
        let (a, b) = (ring[i], ring[(i + 1) % n]);
        let spans = (a.y <= p.y) != (b.y <= p.y);
        let west = a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
        odd ^ (spans && p.x < west)
    })
}

/// Distance from a path to the edges of zones, 0 when it crosses one, metres.
fn least_distance_m(path: &[Point], zones: &[Zone]) -> f64 {
    let mut least = f64::INFINITY;
    for w in path.windows(2) {
        for (a, b) in zones.iter().flat_map(edges) {
            let left = |p: Point, q: Point, x: Point| (q - p).perp(&(x - p)) > 0.0;
            let crosses =
                left(a, b, w[0]) != left(a, b, w[1]) && left(w[0], w[1], a) != left(w[0], w[1], b);
            least = least
                .min(if crosses { 0.0 } else { f64::INFINITY })
                .min(to_piece_m(w[0], a, b))
                .min(to_piece_m(w[1], a, b))
                .min(to_piece_m(a, w[0], w[1]))
                .min(to_piece_m(b, w[0], w[1]));
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::offset::LayeredZone;
    use skein_geometry::{NoFlyZones, Polygon};

    fn ring(x: f64, y: f64, half: f64) -> Vec<Point> {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(dx, dy)| Point::new(x + dx * half, y + dy * half))
            .to_vec()
    }

    fn house(name: &str, x: f64, half: f64, ceiling_m: f64) -> NamedZone {
        NamedZone {
            name: name.to_owned(),
            zone: LayeredZone {
                zone: Zone {
                    outer: ring(x, 0.0, half),
                    holes: Vec::new(),
                },
                floor_m: f64::NEG_INFINITY,
                ceiling_m,
            },
        }
    }

    fn request(places: &[(f64, f64)]) -> RouteRequest {
        let place = |(i, &(x, y)): (usize, &(f64, f64))| RoutePlace {
            name: format!("place {i}"),
            at: Point::new(x, y),
        };
        RouteRequest {
            places: places.iter().enumerate().map(place).collect(),
            keep_out: vec![
                house("low", 0.0, 50.0, 30.0),
                house("high", 300.0, 40.0, 90.0),
            ],
            keep_in: vec![Fence {
                name: "fence".to_owned(),
                ring: ring(100.0, 0.0, 600.0),
            }],
            clearance_m: 10.0,
            level: None,
            turn_radius_m: None,
            engine: Engine::Mesh,
        }
    }

    #[test]
    fn both_engines_find_the_same_way_and_low_zones_are_flown_over() {
        let mut asked = request(&[(-200.0, 0.0), (500.0, 0.0)]);
        let mesh = plan(&asked).unwrap();
        assert!(mesh.length_m() > 701.0 && mesh.least_distance_m >= 10.0);
        assert_eq!((mesh.n_zones, mesh.notices.len()), (3, 0));
        asked.engine = Engine::Graph;
        let graph = plan(&asked).unwrap();
        assert!((graph.length_m() - mesh.length_m()).abs() < 1e-6);
        let (level_m, margin_m) = (60.0, 10.0);
        asked.level = Some(Level { level_m, margin_m });
        let over = plan(&asked).unwrap();
        assert!(over.length_m() < mesh.length_m() && over.n_zones == 2);
        assert!(over.notices[0].starts_with("1 zone(s) end below"));
        // The way back is as long, and both together lead over all places.
        let there = request(&[(-200.0, 0.0), (500.0, 0.0), (-200.0, 0.0)]);
        let both = plan(&there).unwrap();
        assert!((both.length_m() - 2.0 * mesh.length_m()).abs() < 1e-6);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let refused = |asked: &RouteRequest| plan(asked).unwrap_err();
        let far = (500.0, 0.0);
        let inside = refused(&request(&[(10.0, 0.0), far]));
        assert_eq!(inside.to_string(), "place 0 lies in a zone: low");
        let near = refused(&request(&[far, (55.0, 0.0)])).to_string();
        assert!(near.starts_with("place 1 lies 5.0 m from low"), "{near}");
        let outside = refused(&request(&[far, (2_000.0, 0.0)]));
        assert_eq!(outside.to_string(), "place 1 lies in a zone: fence");
        let mut asked = request(&[(-200.0, 0.0), far]);
        asked.clearance_m = f64::NAN;
        assert!(matches!(refused(&asked), RouteError::Clearance(_)));
        asked.clearance_m = 10.0;
        for (level_m, margin_m) in [(f64::NAN, 0.0), (60.0, -1.0)] {
            asked.level = Some(Level { level_m, margin_m });
            assert!(matches!(refused(&asked), RouteError::Level { .. }));
        }
        asked.level = None;
        asked.keep_out[1].zone.zone.outer[0].x = f64::NAN;
        let wrong = refused(&asked).to_string();
        assert!(wrong.starts_with("high: "), "{wrong}");
        asked.keep_out.clear();
        // A wall from one side of the fence to the other.
        asked.keep_out.push(house("wall", 0.0, 5.0, f64::INFINITY));
        for p in &mut asked.keep_out[0].zone.zone.outer {
            p.y *= 1_000.0;
        }
        let Err(RouteError::NoWay {
            leg: 0, from, to, ..
        }) = plan(&asked)
        else {
            panic!("a way through the wall");
        };
        assert_eq!((from.as_str(), to.as_str()), ("place 0", "place 1"));
    }

    #[test]
    fn a_flown_route_turns_within_the_clearance_or_is_refused() {
        let square = [(100.0, -50.0), (200.0, -50.0), (200.0, 50.0), (100.0, 50.0)];
        let mut asked = request(&[(0.0, 0.0), (150.0, 120.0), (300.0, 0.0)]);
        let zone = Zone {
            outer: square.map(|(x, y)| Point::new(x, y)).to_vec(),
            holes: Vec::new(),
        };
        asked.keep_out = vec![NamedZone {
            name: "square".to_owned(),
            zone: LayeredZone {
                zone: zone.clone(),
                floor_m: f64::NEG_INFINITY,
                ceiling_m: f64::INFINITY,
            },
        }];
        asked.clearance_m = 10.0;
        asked.turn_radius_m = Some(30.0);
        let plan = plan(&asked).unwrap();
        let flown_m: f64 = plan.legs.iter().map(|l| l.curve.length_m()).sum();
        assert!(
            flown_m >= plan.length_m() && flown_m < 1.3 * plan.length_m(),
            "{flown_m}"
        );
        let zones = NoFlyZones::new(vec![Polygon::new(zone.outer).unwrap()]);
        assert!(plan.legs.iter().all(|l| zones.is_clear(&l.curve, 10.0)));
        let ends: Vec<_> = plan.legs.iter().flat_map(|l| l.curve.segments()).collect();
        assert!(ends[0].start.position().coords.norm() < 1e-6);
        let end = ends[ends.len() - 1].end().position();
        assert!((end - Point::new(300.0, 0.0)).norm() < 1e-6);
        // A fence in which nobody turns.
        let corners = [
            (-20.0, -20.0),
            (320.0, -20.0),
            (320.0, 150.0),
            (-20.0, 150.0),
        ];
        asked.keep_in = vec![Fence {
            name: "fence".to_owned(),
            ring: corners.map(|(x, y)| Point::new(x, y)).to_vec(),
        }];
        assert!(super::plan(&asked).is_ok());
        asked.turn_radius_m = Some(500.0);
        let refused = super::plan(&asked).unwrap_err();
        assert!(matches!(refused, RouteError::NoFlight { .. }), "{refused}");
        asked.turn_radius_m = Some(0.0);
        assert_eq!(super::plan(&asked), Err(RouteError::Radius(0.0)));
    }
}
