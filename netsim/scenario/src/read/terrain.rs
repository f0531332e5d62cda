//! Origin, area, no-fly zones and buildings of a scenario file, in the plane
//! (D2.7 §2.2, §2.3). Leaves lanes and fleet to its neighbours.

use super::shared::{MAX_HEIGHT_M, Notices, position};
use super::targets::{self, Asked};
use crate::files::Files;
use skein_geometry::frame::{MAX_MISSION_RADIUS_M, Origin, Point};
use skein_geometry::{Polygon, PolygonError};
use skein_interop::geojson::{self, HeightRules};
use skein_interop::json::{Error, Fields, Node};
use skein_interop::place::{LatLon, Shape, Side, circle_ring, to_plane};
use skein_interop::plan;
use skein_netsim::spec::Building;
use std::collections::BTreeMap;

/// What stands and lies on the ground.
#[derive(Clone, Debug)]
pub(crate) struct Terrain {
    pub(crate) origin: Origin,
    pub(crate) level_m: f64,
    pub(crate) area: Polygon,
    pub(crate) zones: Vec<Polygon>,
    pub(crate) buildings: Vec<Building>,
}

/// What stands and lies on the ground, and what is to be seen of it.
pub(crate) fn read(
    f: &Fields<'_>,
    files: &Files<'_>,
    notices: &mut Notices,
) -> Result<(Terrain, Asked), Error> {
    let origin = origin(f.need("origin", "{ lat_deg: 60.1655, lon_deg: 24.9355 }")?)?;
    let level_m = f
        .need("level_m", "45")?
        .number(1.0, MAX_HEIGHT_M, "metres")?;
    let margin_m = f.number_or("vertical_margin_m", 10.0, 0.0, MAX_HEIGHT_M, "metres")?;
    let mut reader = Reader::new(origin, files);
    let (area, asked) = reader.asked(f, notices)?;
    let mut zones = Vec::new();
    if let Some(list) = f.get("no_fly") {
        for entry in list.items()? {
            for zone in reader.zones(&entry, notices)? {
                if swallows(&zone, &area) {
                    return Err(entry.wrong("this no-fly zone swallows the whole area: nothing is left to cover; make it smaller"));
                }
                zones.push(zone);
            }
        }
    }
    let mut buildings = Vec::new();
    if let Some(node) = f.get("buildings") {
        buildings = reader.buildings(node, notices)?;
        // A roof that comes closer to the lowest flight level than the margin is a wall.
        for b in buildings
            .iter()
            .filter(|b| b.height_m >= level_m - margin_m)
        {
            if swallows(&b.footprint, &area) {
                return Err(node.wrong(format!(
                    "a building of {:.1} m reaches the flight level and covers the whole area; fly above {:.1} m",
                    b.height_m,
                    b.height_m + margin_m
                )));
            }
            zones.push(b.footprint.clone());
        }
    }
    let terrain = Terrain {
        origin,
        level_m,
        area,
        zones,
        buildings,
    };
    Ok((terrain, asked))
}

/// The no-fly zones of one entry, whose files count from the scenario's place.
pub(super) fn zone(
    node: &Node<'_>,
    origin: Origin,
    files: &Files<'_>,
    notices: &mut Notices,
) -> Result<Vec<Polygon>, Error> {
    Reader::new(origin, files).zones(node, notices)
}

/// The buildings of a node that says from which file, which counts from the scenario's place.
pub(super) fn buildings(
    node: &Node<'_>,
    origin: Origin,
    files: &Files<'_>,
    notices: &mut Notices,
) -> Result<Vec<Building>, Error> {
    Reader::new(origin, files).buildings(node, notices)
}

/// Whether nothing of the area sticks out of the zone.
fn swallows(zone: &Polygon, area: &Polygon) -> bool {
    area.vertices().iter().all(|p| zone.contains(*p))
        && !zone.vertices().iter().any(|p| area.contains(*p))
}

fn origin(node: &Node<'_>) -> Result<Origin, Error> {
    let f = node.fields(&["lat_deg", "lon_deg"])?;
    Ok(Origin {
        lat_deg: f
            .need("lat_deg", "60.1655")?
            .number(-89.0, 89.0, "degrees north")?,
        lon_deg: f
            .need("lon_deg", "24.9355")?
            .number(-180.0, 180.0, "degrees east")?,
    })
}

/// A polygon of typed points; what is wrong is named at the vertex.
fn typed_polygon(
    node: &Node<'_>,
    items: &[Node<'_>],
    points: Vec<Point>,
) -> Result<Polygon, Error> {
    Polygon::new(points).map_err(|e| {
        let at = match e {
            PolygonError::SelfCrossing(i, j) => items.get(i.max(j)).unwrap_or(node),
            PolygonError::NotFinite(i) => items.get(i).unwrap_or(node),
            _ => node,
        };
        at.wrong(format!(
            "{e}; vertices go once round the border, in either direction"
        ))
    })
}

/// Shapes of a file: of an area, and of no-fly zones.
#[derive(Clone)]
struct FileShapes {
    area: Vec<Shape>,
    no_fly: Vec<Shape>,
}

struct Reader<'f> {
    origin: Origin,
    files: &'f Files<'f>,
    /// Files that were read, by name: area and zones may come from one.
    shapes: BTreeMap<String, FileShapes>,
}

impl<'f> Reader<'f> {
    fn new(origin: Origin, files: &'f Files<'f>) -> Self {
        Self {
            origin,
            files,
            shapes: BTreeMap::new(),
        }
    }

    /// The area, and what is to be seen in it. Targets need no area of their own.
    fn asked(&mut self, f: &Fields<'_>, notices: &mut Notices) -> Result<(Polygon, Asked), Error> {
        let listed = f.get("points").or(f.get("lines"));
        let area = match (f.get("area"), listed) {
            (None, Some(_)) => None,
            _ => {
                let example = "{ west_m: 0, south_m: 0, east_m: 960, north_m: 960 }";
                Some(self.area(f.need("area", example)?, notices)?)
            }
        };
        let asked = targets::read(f, self.files, self.origin, area.as_ref(), notices)?;
        let area = match (area, listed) {
            (Some(area), _) => area,
            (None, node) => targets::extent(&asked, node.unwrap_or(f.node()))?,
        };
        Ok((area, asked))
    }

    fn ring_m(&self, node: &Node<'_>) -> Result<Polygon, Error> {
        let items = node.items()?;
        let mut points = Vec::with_capacity(items.len());
        for item in &items {
            let (e, n) = item.pair(
                -MAX_MISSION_RADIUS_M,
                MAX_MISSION_RADIUS_M,
                "metres east and north of the origin",
            )?;
            points.push(Point::new(e, n));
        }
        typed_polygon(node, &items, points)
    }

    fn ring_deg(&self, node: &Node<'_>) -> Result<Polygon, Error> {
        let items = node.items()?;
        let mut points = Vec::with_capacity(items.len());
        for item in &items {
            let (lat_deg, lon_deg) = item.pair(-180.0, 180.0, "degrees, latitude first")?;
            let at = LatLon { lat_deg, lon_deg };
            points.push(to_plane(self.origin, at).map_err(|e| item.wrong(e.to_string()))?);
        }
        typed_polygon(node, &items, points)
    }

    fn circle(&self, node: &Node<'_>) -> Result<Polygon, Error> {
        let f = node.fields(&["east_m", "north_m", "radius_m"])?;
        let radius_m = f
            .need("radius_m", "50")?
            .number(0.1, MAX_MISSION_RADIUS_M, "metres")?;
        let ring = circle_ring(position(&f)?, radius_m, Side::Outside);
        Polygon::new(ring).map_err(|e| node.wrong(e.to_string()))
    }

    /// The shapes of a file, which is read once; what it tells besides is noted then.
    fn file_shapes(&mut self, node: &Node<'_>, notices: &mut Notices) -> Result<FileShapes, Error> {
        let name = node.text()?;
        if let Some(known) = self.shapes.get(name) {
            return Ok(known.clone());
        }
        let shapes = shapes_of(node, &self.files.read(node)?, notices)?;
        self.shapes.insert(name.to_owned(), shapes.clone());
        Ok(shapes)
    }

    fn file_polygons(
        &self,
        node: &Node<'_>,
        shapes: &[Shape],
        side: Side,
    ) -> Result<Vec<Polygon>, Error> {
        let name = node.text()?;
        let one = |(i, shape): (usize, &Shape)| {
            let ring = shape
                .to_plane(self.origin, side)
                .map_err(|e| node.wrong(format!("{name}: shape {i}: {e}")))?;
            Polygon::new(ring).map_err(|e| node.wrong(format!("{name}: shape {i}: {e}")))
        };
        shapes.iter().enumerate().map(one).collect()
    }

    fn area(&mut self, node: &Node<'_>, notices: &mut Notices) -> Result<Polygon, Error> {
        let f = node.fields(&[
            "west_m", "south_m", "east_m", "north_m", "ring_m", "ring_deg", "file",
        ])?;
        if let Some(ring) = f.get("ring_m") {
            return self.ring_m(ring);
        }
        if let Some(ring) = f.get("ring_deg") {
            return self.ring_deg(ring);
        }
        if let Some(file) = f.get("file") {
            let shapes = self.file_shapes(file, notices)?.area;
            let mut found = self.file_polygons(file, &shapes, Side::Inside)?;
            return match (found.pop(), found.len()) {
                (Some(one), 0) => Ok(one),
                (last, n) => Err(file.wrong(format!(
                    "{} holds {} areas; expected exactly one survey, inclusion fence or polygon",
                    file.text()?,
                    n + usize::from(last.is_some())
                ))),
            };
        }
        let edge = |name| {
            f.need(name, "0")?.number(
                -MAX_MISSION_RADIUS_M,
                MAX_MISSION_RADIUS_M,
                "metres from the origin",
            )
        };
        let (w, s, e, n) = (
            edge("west_m")?,
            edge("south_m")?,
            edge("east_m")?,
            edge("north_m")?,
        );
        if w >= e || s >= n {
            return Err(node.wrong(format!(
                "the rectangle has no area: west {w} < east {e} and south {s} < north {n} must hold"
            )));
        }
        let ring = vec![
            Point::new(w, s),
            Point::new(e, s),
            Point::new(e, n),
            Point::new(w, n),
        ];
        Polygon::new(ring).map_err(|e| node.wrong(e.to_string()))
    }

    fn zones(&mut self, node: &Node<'_>, notices: &mut Notices) -> Result<Vec<Polygon>, Error> {
        let f = node.fields(&["ring_m", "ring_deg", "circle", "file"])?;
        if let Some(ring) = f.get("ring_m") {
            return Ok(vec![self.ring_m(ring)?]);
        }
        if let Some(ring) = f.get("ring_deg") {
            return Ok(vec![self.ring_deg(ring)?]);
        }
        if let Some(circle) = f.get("circle") {
            return Ok(vec![self.circle(circle)?]);
        }
        if let Some(file) = f.get("file") {
            let shapes = self.file_shapes(file, notices)?.no_fly;
            return self.file_polygons(file, &shapes, Side::Outside);
        }
        Err(node.wrong("a no-fly zone is one of { ring_m: [...] }, { ring_deg: [...] }, { circle: {...} }, { file: \"...\" }"))
    }

    fn buildings(&self, node: &Node<'_>, notices: &mut Notices) -> Result<Vec<Building>, Error> {
        let f = node.fields(&["file", "storey_m", "default_storeys"])?;
        let rules = HeightRules {
            storey_m: f.number_or("storey_m", 3.0, 1.0, 10.0, "metres")?,
            default_storeys: f.number_or("default_storeys", 3.0, 0.0, 100.0, "storeys")?,
        };
        let file = f.need("file", "\"buildings.geojson\"")?;
        let name = file.text()?;
        let read = geojson::buildings(&self.files.read(file)?, &rules)
            .map_err(|e| file.wrong(e.in_file(name).to_string()))?;
        let mut tell = |pointer: &str, text: &str| {
            notices.push((file.path(), format!("{name}: at {pointer}: {text}")));
        };
        for n in &read.notices {
            tell(&n.pointer, &n.text);
        }
        let mut buildings = Vec::with_capacity(read.buildings.len());
        for b in read.buildings {
            let ring = Shape::Ring(b.ring).to_plane(self.origin, Side::Outside);
            let ring = ring.map_err(|e| file.wrong(format!("{name}: at {}: {e}", b.pointer)))?;
            let footprint = match Polygon::new(ring.clone()) {
                Ok(p) => p,
                Err(e) => {
                    tell(&b.pointer, &format!("{e}: its convex hull is used"));
                    match Polygon::new(hull(ring)) {
                        Ok(p) => p,
                        Err(e) => {
                            tell(&b.pointer, &format!("{e}: left out"));
                            continue;
                        }
                    }
                }
            };
            buildings.push(Building {
                footprint,
                height_m: b.height_m,
            });
        }
        Ok(buildings)
    }
}

/// Shapes of a file's text.
fn shapes_of(node: &Node<'_>, text: &str, notices: &mut Notices) -> Result<FileShapes, Error> {
    let name = node.text()?;
    let told = |pointer: &str, text: &str| (node.path(), format!("{name}: at {pointer}: {text}"));
    if name.ends_with(".plan") {
        let p = plan::read(text).map_err(|e| node.wrong(e.in_file(name).to_string()))?;
        notices.extend(p.notices.iter().map(|n| told(&n.pointer, &n.text)));
        if !p.waypoints.is_empty() {
            let said = format!(
                "{} waypoint(s) are not flown: the area is covered instead",
                p.waypoints.len()
            );
            notices.push(told("/mission/items", &said));
        }
        if p.surveys.is_empty() && !p.keep_in.is_empty() {
            let said = "the inclusion fence is the area to cover; UAVs turn outside of it";
            notices.push(told("/geoFence", said));
        }
        // A survey says what to see; without one the fence that must not be left does.
        let area = if p.surveys.is_empty() {
            p.keep_in
        } else {
            p.surveys.into_iter().map(|s| Shape::Ring(s.ring)).collect()
        };
        return Ok(FileShapes {
            area,
            no_fly: p.keep_out,
        });
    }
    if name.ends_with(".geojson") || name.ends_with(".json") {
        let g = geojson::read(text).map_err(|e| node.wrong(e.in_file(name).to_string()))?;
        notices.extend(g.notices.iter().map(|n| told(&n.pointer, &n.text)));
        let shapes: Vec<Shape> = g
            .polygons
            .into_iter()
            .map(|f| Shape::Ring(f.ring))
            .collect();
        return Ok(FileShapes {
            area: shapes.clone(),
            no_fly: shapes,
        });
    }
    Err(node.wrong(format!(
        "{name} is of no known format; expected a name that ends in .plan or .geojson"
    )))
}

/// Convex hull by Andrew's monotone chain, counter-clockwise, in O(n log n).
pub(super) fn hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let turn =
        |a: &Point, b: &Point, c: &Point| (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    let chain = |points: &mut dyn Iterator<Item = Point>| {
        let mut out: Vec<Point> = Vec::new();
        for p in points {
            while out.len() >= 2 && turn(&out[out.len() - 2], &out[out.len() - 1], &p) <= 0.0 {
                out.pop();
            }
            out.push(p);
        }
        out.pop();
        out
    };
    let mut ring = chain(&mut points.iter().copied());
    ring.extend(chain(&mut points.iter().rev().copied()));
    ring
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_bow_tie_is_its_square() {
        let p = |x: f64, y: f64| Point::new(x, y);
        let ring = hull(vec![
            p(0.0, 0.0),
            p(1.0, 1.0),
            p(1.0, 0.0),
            p(0.0, 1.0),
            p(0.5, 0.5),
        ]);
        assert_eq!(
            ring,
            vec![p(0.0, 0.0), p(1.0, 0.0), p(1.0, 1.0), p(0.0, 1.0)]
        );
    }
}
