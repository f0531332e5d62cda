//! Plans as files have them: Skein's JSON with its trajectories, QGroundControl `.plan`
//! with straight legs from waypoint to waypoint, and lines of GeoJSON.
//!
//! Whose plan it is shows in its text, not in the name of the file.

use crate::VerifyError;
use crate::ground_file::too_far;
use crate::path::{LONGEST_M, Piece, RADII_M};
use crate::plan::{Flight, FlightClaims, Plan, PlanClaims, Wind};
use crate::plane::{Plane, Point, REACH_M};
use libm::{cos, sin};
use skein_interop::json::{Document, Error, Node};
use skein_interop::place::LatLon;

/// The most pieces or corners of all flights of a file.
pub const MOST_PIECES: usize = 300_000;

/// MAVLink: the last command that names a place to fly to.
const NAV_LAST: u32 = 95;

/// MAVLink: the command among those whose place is only looked at.
const NAV_ROI: u32 = 80;

/// MAVLink: take a picture after each so many metres, or none if that is 0.
const DO_TRIGGER: u32 = 206;

/// MAVLink: fly back to where it began.
const NAV_RETURN: u32 = 20;

/// Where a plan says that its plane touches: only Skein's JSON does.
///
/// # Errors
/// When it is no JSON, or the origin is none.
pub fn origin(file: &str, text: &str) -> Result<Option<LatLon>, VerifyError> {
    let document = Document::parse("the plan", file, text)?;
    let root = document.root();
    match root.get("flights")? {
        Some(_) => Ok(Some(place(&root.need("origin")?)?)),
        None => Ok(None),
    }
}

/// Some place of a plan that has no origin: its first corner.
///
/// # Errors
/// When it is no plan.
pub fn somewhere(file: &str, text: &str) -> Result<Option<LatLon>, VerifyError> {
    let document = Document::parse("the plan", file, text)?;
    let tracks = tracks(&document.root(), file, &mut Vec::new())?;
    let mut all = tracks.iter().flat_map(|t| t.corners.iter());
    Ok(all.next().map(|c| c.at))
}

/// Reads a plan into a plane, which is that of its origin where it has one.
///
/// # Errors
/// [`VerifyError`] names the place.
pub fn read(file: &str, text: &str, plane: Plane) -> Result<Plan, VerifyError> {
    let document = Document::parse("the plan", file, text)?;
    let root = document.root();
    if root.get("flights")?.is_some() {
        return Ok(plan_of_skein(&root, plane)?);
    }
    let mut plan = Plan::new(plane);
    for track in tracks(&root, file, &mut plan.notices)? {
        let corners = track.corners.iter().map(|c| c.in_plane(plane));
        let corners = corners.collect::<Result<Vec<_>, _>>()?;
        let mut flight = Flight::straight(track.name, &[]);
        flight.speed_mps = track.speed_mps;
        for (leg, from) in corners.windows(2).zip(&track.corners) {
            if leg[0].distance(leg[1]) > 1e-6 {
                let sees = from.camera || !track.triggered;
                flight.pieces.push(Piece::between(leg[0], leg[1], sees));
            }
        }
        plan.flights.push(flight);
    }
    Ok(plan)
}

/// A place in degrees.
fn place(at: &Node<'_>) -> Result<LatLon, Error> {
    Ok(LatLon {
        lat_deg: latitude(&at.need("lat_deg")?)?,
        lon_deg: longitude(&at.need("lon_deg")?)?,
    })
}

fn latitude(at: &Node<'_>) -> Result<f64, Error> {
    at.number(-90.0, 90.0, "a latitude in degrees")
}

fn longitude(at: &Node<'_>) -> Result<f64, Error> {
    at.number(-180.0, 180.0, "a longitude in degrees")
}

fn figure(at: &Node<'_>, name: &str, most: f64, unit: &str) -> Result<Option<f64>, Error> {
    let value = at.get(name)?;
    value.map(|v| v.number(0.0, most, unit)).transpose()
}

/// A figure that is divided by.
fn positive(at: &Node<'_>, name: &str, unit: &str) -> Result<Option<f64>, Error> {
    let value = at.get(name)?;
    value.map(|v| v.number(1e-3, LONGEST_M, unit)).transpose()
}

fn plan_of_skein(root: &Node<'_>, plane: Plane) -> Result<Plan, Error> {
    let mut plan = Plan::new(plane);
    plan.clearance_m = figure(root, "clearance_m", LONGEST_M, "metres")?;
    plan.look_ahead_m = figure(root, "look_ahead_m", LONGEST_M, "metres")?;
    plan.swath_m = positive(root, "swath_m", "metres")?;
    let wind = wind(root)?;
    plan.claims = PlanClaims {
        makespan_s: figure(root, "makespan_s", 1e12, "seconds")?,
        total_m: figure(root, "total_m", 1e12, "metres")?,
        covered_share: figure(root, "covered_share", 1.0 + 1e-6, "a share")?,
    };
    let mut left = MOST_PIECES;
    for (i, at) in root.need("flights")?.items()?.iter().enumerate() {
        let flight = Flight {
            wind,
            ..flight_of_skein(at, i, plane, &mut left)?
        };
        if !flight.exact && !flight.pieces.is_empty() {
            plan.notices.push(format!(
                "{}: no trajectory: its corners are taken for what it flies, its turns and its camera are not known",
                flight.name
            ));
        }
        plan.flights.push(flight);
    }
    Ok(plan)
}

fn wind(root: &Node<'_>) -> Result<Wind, Error> {
    let speed_mps = figure(root, "wind_mps", 1e3, "m/s")?.unwrap_or(0.0);
    if speed_mps <= 0.0 {
        return Ok(Wind::Calm);
    }
    let Some(from) = root.get("wind_from_deg")? else {
        return Ok(Wind::Unknown);
    };
    let from_rad = from
        .number(-360.0, 360.0, "degrees clockwise from north")?
        .to_radians();
    Ok(Wind::To(
        -speed_mps * sin(from_rad),
        -speed_mps * cos(from_rad),
    ))
}

fn flight_of_skein(
    at: &Node<'_>,
    number: usize,
    plane: Plane,
    left: &mut usize,
) -> Result<Flight, Error> {
    let name = match at.get("name")? {
        Some(name) => name.text()?.to_owned(),
        None => format!("flight {}", number + 1),
    };
    let corners = match at.get("points")? {
        Some(points) => {
            let points = points.items()?;
            counted(at, points.len(), left)?;
            let place = |p: &Node<'_>| Corner::new(p, place(p)?).in_plane(plane);
            points.iter().map(place).collect::<Result<Vec<_>, _>>()?
        }
        None => Vec::new(),
    };
    let mut flight = match at.get("trajectory")? {
        Some(list) => {
            let items = list.items()?;
            counted(at, items.len(), left)?;
            let pieces = items.iter().map(|p| piece(p, plane));
            Flight::new(name, pieces.collect::<Result<_, _>>()?)
        }
        None => Flight::straight(name, &corners),
    };
    flight.speed_mps = positive(at, "speed_mps", "m/s")?;
    flight.turn_radius_m = positive(at, "turn_radius_m", "metres")?;
    flight.swath_m = positive(at, "swath_m", "metres")?;
    flight.look_ahead_m = figure(at, "look_ahead_m", LONGEST_M, "metres")?;
    flight.claims = FlightClaims {
        length_m: figure(at, "length_m", 1e12, "metres")?,
        time_s: figure(at, "time_s", 1e12, "seconds")?,
        from: corners.first().copied(),
        to: corners.last().copied(),
    };
    Ok(flight)
}

fn counted(at: &Node<'_>, n: usize, left: &mut usize) -> Result<(), Error> {
    *left = left
        .checked_sub(n)
        .ok_or_else(|| at.wrong(format!("more than {MOST_PIECES} pieces and corners")))?;
    Ok(())
}

fn piece(at: &Node<'_>, plane: Plane) -> Result<Piece, Error> {
    let course_deg =
        at.need("course_deg")?
            .number(-360.0, 360.0, "degrees clockwise from north")?;
    let length = at.need("length_m")?;
    let length_m = length.number(0.0, LONGEST_M, "metres")?;
    let radius_m = at.get("radius_m")?;
    let radius_m = radius_m.map(|r| r.number(-RADII_M.1, RADII_M.1, "metres"));
    let radius_m = radius_m.transpose()?;
    let piece = Piece {
        start: Corner::new(at, place(at)?).in_plane(plane)?,
        heading_rad: (90.0 - course_deg).to_radians(),
        length_m,
        radius_m,
        sees: at.need("sees")?.flag()?,
    };
    if let Some(problem) = piece.problem() {
        return Err(at.wrong(problem));
    }
    if piece.end().norm() > REACH_M {
        return Err(length.wrong(too_far(plane.place(piece.end()))));
    }
    Ok(piece)
}

/// A corner of a track, and where it stands.
struct Corner<'a> {
    node: Node<'a>,
    at: LatLon,
    /// Whether pictures are taken from here on.
    camera: bool,
}

impl<'a> Corner<'a> {
    fn new(node: &Node<'a>, at: LatLon) -> Self {
        Self {
            node: node.clone(),
            at,
            camera: false,
        }
    }

    fn in_plane(&self, plane: Plane) -> Result<Point, Error> {
        let near = plane.near(self.at);
        near.ok_or_else(|| self.node.wrong(too_far(self.at)))
    }
}

/// Corners with straight legs between them.
struct Track<'a> {
    name: String,
    corners: Vec<Corner<'a>>,
    /// Whether pictures are taken where it says so, and not all the way.
    triggered: bool,
    speed_mps: Option<f64>,
}

impl<'a> Track<'a> {
    /// Goes on to a corner; the camera stays as it is.
    fn add(&mut self, mut corner: Corner<'a>) {
        corner.camera = self.corners.last().is_some_and(|c| c.camera);
        self.corners.push(corner);
    }
}

fn tracks<'a>(
    root: &Node<'a>,
    file: &str,
    notices: &mut Vec<String>,
) -> Result<Vec<Track<'a>>, Error> {
    if root.get("fileType")?.is_some() {
        return Ok(vec![of_plan(root, file, notices)?]);
    }
    if root.get("type")?.is_none() {
        return Err(root.wrong(
            "this is no plan: expected \"flights\" of skein plan, \"fileType\" of QGroundControl, or \"type\" of GeoJSON",
        ));
    }
    let mut out = Vec::new();
    let mut left = MOST_PIECES;
    of_geojson(root, file, &mut left, &mut out)?;
    if out.is_empty() {
        return Err(root.wrong("no LineString: there is no flight in here"));
    }
    Ok(out)
}

/// A file's name without its folder and its ending.
fn stem(file: &str) -> String {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    if stem.is_empty() { "flight" } else { stem }.to_owned()
}

fn of_plan<'a>(root: &Node<'a>, file: &str, notices: &mut Vec<String>) -> Result<Track<'a>, Error> {
    let mission = root.need("mission")?;
    let mut track = Track {
        name: stem(file),
        corners: Vec::new(),
        triggered: false,
        speed_mps: positive(&mission, "cruiseSpeed", "m/s")?,
    };
    if let Some(home) = mission.get("plannedHomePosition")? {
        let at = pair(&home, false)?;
        // A plan without a home says 0, 0.
        if at.lat_deg.abs() + at.lon_deg.abs() > 1e-12 {
            track.add(Corner::new(&home, at));
        }
    }
    let mut left = MOST_PIECES;
    if let Some(items) = mission.get("items")? {
        items_of_plan(&items, &mut track, &mut left, notices, true)?;
    }
    Ok(track)
}

fn items_of_plan<'a>(
    items: &Node<'a>,
    track: &mut Track<'a>,
    left: &mut usize,
    notices: &mut Vec<String>,
    outer: bool,
) -> Result<(), Error> {
    let all = items.items()?;
    counted(items, all.len(), left)?;
    for item in all {
        let kind = item.need("type")?;
        match kind.text()? {
            "SimpleItem" => simple_item(&item, track)?,
            "ComplexItem" if outer => {
                let transects = item.get("TransectStyleComplexItem")?;
                let inner = match &transects {
                    Some(t) => t.get("Items")?,
                    None => None,
                };
                let points = match &transects {
                    Some(t) => t.get("VisualTransectPoints")?,
                    None => None,
                };
                match (inner, points) {
                    (Some(inner), _) if !inner.items()?.is_empty() => {
                        items_of_plan(&inner, track, left, notices, false)?;
                    }
                    (_, Some(points)) => {
                        for p in points.items()? {
                            track.add(Corner::new(&p, pair(&p, false)?));
                        }
                    }
                    _ => notices.push(format!(
                        "{}: at {}: what is flown here is not in the file: left out",
                        track.name,
                        item.pointer()
                    )),
                }
            }
            other => return Err(kind.wrong(format!("\"{other}\" is no mission item here"))),
        }
    }
    Ok(())
}

fn simple_item<'a>(item: &Node<'a>, track: &mut Track<'a>) -> Result<(), Error> {
    let command = item
        .need("command")?
        .whole(0, 65_535, "a MAVLink command")?;
    if command == NAV_RETURN {
        if let Some(home) = track.corners.first() {
            let back = Corner::new(&home.node, home.at);
            track.add(back);
        }
        return Ok(());
    }
    let params = item.need("params")?;
    let params = params.items()?;
    if command == DO_TRIGGER {
        track.triggered = true;
        let on = params.first().and_then(Node::as_number);
        if let (Some(last), Some(distance_m)) = (track.corners.last_mut(), on) {
            last.camera = distance_m > 0.0;
        }
        return Ok(());
    }
    let [_, _, _, _, lat, lon, ..] = params.as_slice() else {
        return Ok(());
    };
    let zero = |n: &Node<'_>| n.as_number().is_some_and(|n| n.abs() < 1e-12);
    if command > NAV_LAST || command == NAV_ROI || lat.is_null() || (zero(lat) && zero(lon)) {
        return Ok(());
    }
    let at = LatLon {
        lat_deg: latitude(lat)?,
        lon_deg: longitude(lon)?,
    };
    track.add(Corner::new(item, at));
    Ok(())
}

/// Two numbers: longitude first in GeoJSON, latitude first elsewhere.
pub(crate) fn pair(at: &Node<'_>, lon_first: bool) -> Result<LatLon, Error> {
    let items = at.items()?;
    let [a, b, ..] = items.as_slice() else {
        return Err(at.wrong("a position has two numbers"));
    };
    let (lat, lon) = if lon_first { (b, a) } else { (a, b) };
    Ok(LatLon {
        lat_deg: latitude(lat)?,
        lon_deg: longitude(lon)?,
    })
}

fn of_geojson<'a>(
    root: &Node<'a>,
    file: &str,
    left: &mut usize,
    out: &mut Vec<Track<'a>>,
) -> Result<(), Error> {
    let features = match root.need("type")?.text()? {
        "FeatureCollection" => root.need("features")?.items()?,
        "Feature" => vec![root.clone()],
        _ => return lines(root, &stem(file), left, out),
    };
    for (i, f) in features.iter().enumerate() {
        let Some(geometry) = f.get("geometry")? else {
            continue;
        };
        let own = match f.get("properties")? {
            Some(properties) => properties.get("name")?,
            None => None,
        };
        let own = own.and_then(|n| n.text().ok().map(str::to_owned));
        let name = own.unwrap_or_else(|| format!("{} line {}", stem(file), i + 1));
        lines(&geometry, &name, left, out)?;
    }
    Ok(())
}

fn lines<'a>(
    geometry: &Node<'a>,
    name: &str,
    left: &mut usize,
    out: &mut Vec<Track<'a>>,
) -> Result<(), Error> {
    let parts = match geometry.need("type")?.text()? {
        "LineString" => vec![geometry.need("coordinates")?],
        "MultiLineString" => geometry.need("coordinates")?.items()?,
        "GeometryCollection" => {
            for part in geometry.need("geometries")?.items()? {
                lines(&part, name, left, out)?;
            }
            return Ok(());
        }
        _ => return Ok(()),
    };
    for part in parts {
        let items = part.items()?;
        counted(&part, items.len(), left)?;
        let corner = |p: &Node<'a>| Ok(Corner::new(p, pair(p, true)?));
        out.push(Track {
            name: name.to_owned(),
            corners: items.iter().map(corner).collect::<Result<_, Error>>()?,
            triggered: false,
            speed_mps: None,
        });
    }
    Ok(())
}
