//! Origin, area, no-fly zones and buildings of a scenario file, in the plane
//! (D2.7 §2.2, §2.3). Leaves lanes and fleet to its neighbours.

use crate::document::{Fields, Node};
use crate::error::ScenarioError;
use crate::files::Files;
use crate::read::targets;
use skein_geometry::frame::{MAX_MISSION_RADIUS_M, Origin, Point};
use skein_geometry::{Polygon, PolygonError};
use skein_interop::geojson::{self, HeightRules};
use skein_interop::place::{LatLon, Shape, Side, circle_ring, to_plane};
use skein_interop::plan;
use skein_netsim::spec::Building;
use skein_peer::CoverageTask;

/// Highest flight level and roof that are accepted, metres: the service ceiling of
/// small fixed wings with room to spare.
pub(crate) const MAX_HEIGHT_M: f64 = 5000.0;

/// What stands and lies on the ground.
#[derive(Debug)]
pub(crate) struct Terrain {
    pub(crate) origin: Origin,
    pub(crate) level_m: f64,
    pub(crate) area: Polygon,
    pub(crate) zones: Vec<Polygon>,
    pub(crate) buildings: Vec<Building>,
    pub(crate) task: CoverageTask,
}

/// What a file told besides what was asked.
pub(crate) type Notices = Vec<(String, String)>;

pub(crate) fn read(
    f: &Fields<'_>,
    files: &Files<'_>,
    notices: &mut Notices,
) -> Result<Terrain, ScenarioError> {
    let origin = origin(f.need("origin", "{ lat_deg: 60.1655, lon_deg: 24.9355 }")?)?;
    let level_m = f
        .need("level_m", "45")?
        .number(1.0, MAX_HEIGHT_M, "metres")?;
    let margin_m = f.number_or("vertical_margin_m", 10.0, 0.0, MAX_HEIGHT_M, "metres")?;
    let reader = Reader { origin, files };
    let (area, task) = reader.asked(f, notices)?;
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
    Ok(Terrain {
        origin,
        level_m,
        area,
        zones,
        buildings,
        task,
    })
}

/// Whether nothing of the area sticks out of the zone.
fn swallows(zone: &Polygon, area: &Polygon) -> bool {
    area.vertices().iter().all(|p| zone.contains(*p))
        && !zone.vertices().iter().any(|p| area.contains(*p))
}

fn origin(node: &Node<'_>) -> Result<Origin, ScenarioError> {
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

/// A position typed as metres `east_m`, `north_m`.
pub(crate) fn position(f: &Fields<'_>) -> Result<Point, ScenarioError> {
    let coordinate = |name| {
        f.need(name, "250")?.number(
            -MAX_MISSION_RADIUS_M,
            MAX_MISSION_RADIUS_M,
            "metres from the origin",
        )
    };
    Ok(Point::new(coordinate("east_m")?, coordinate("north_m")?))
}

/// A polygon of typed points; what is wrong is named at the vertex.
fn typed_polygon(
    node: &Node<'_>,
    items: &[Node<'_>],
    points: Vec<Point>,
) -> Result<Polygon, ScenarioError> {
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

struct Reader<'f> {
    origin: Origin,
    files: &'f Files<'f>,
}

impl Reader<'_> {
    /// The area, and what is to be seen in it. Targets need no area of their own.
    fn asked(
        &self,
        f: &Fields<'_>,
        notices: &mut Notices,
    ) -> Result<(Polygon, CoverageTask), ScenarioError> {
        let targets = f.get("points").or(f.get("lines"));
        let area = match (f.get("area"), targets) {
            (None, Some(_)) => None,
            _ => {
                let example = "{ west_m: 0, south_m: 0, east_m: 960, north_m: 960 }";
                Some(self.area(f.need("area", example)?, notices)?)
            }
        };
        let task = targets::read(f, self.files, self.origin, area.as_ref(), notices)?;
        let area = match (area, targets) {
            (Some(area), _) => area,
            (None, node) => targets::extent(&task, node.unwrap_or(f.node()))?,
        };
        Ok((area, task))
    }

    fn ring_m(&self, node: &Node<'_>) -> Result<Polygon, ScenarioError> {
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

    fn ring_deg(&self, node: &Node<'_>) -> Result<Polygon, ScenarioError> {
        let items = node.items()?;
        let mut points = Vec::with_capacity(items.len());
        for item in &items {
            let (lat_deg, lon_deg) = item.pair(-180.0, 180.0, "degrees, latitude first")?;
            let at = LatLon { lat_deg, lon_deg };
            points.push(to_plane(self.origin, at).map_err(|e| item.wrong(e.to_string()))?);
        }
        typed_polygon(node, &items, points)
    }

    fn circle(&self, node: &Node<'_>) -> Result<Polygon, ScenarioError> {
        let f = node.fields(&["east_m", "north_m", "radius_m"])?;
        let radius_m = f
            .need("radius_m", "50")?
            .number(0.1, MAX_MISSION_RADIUS_M, "metres")?;
        let ring = circle_ring(position(&f)?, radius_m, Side::Outside);
        Polygon::new(ring).map_err(|e| node.wrong(e.to_string()))
    }

    /// Shapes of a file in the plane: `(area shapes, no-fly shapes)`.
    fn file_shapes(
        &self,
        node: &Node<'_>,
        notices: &mut Notices,
    ) -> Result<(Vec<Shape>, Vec<Shape>), ScenarioError> {
        let name = node.text()?;
        let text = self.files.read(node)?;
        let told = |pointer: &str, text: &str| {
            (
                node.path().to_owned(),
                format!("{name}: at {pointer}: {text}"),
            )
        };
        if name.ends_with(".plan") {
            let p = plan::read(&text).map_err(|e| node.wrong(format!("{name}: {e}")))?;
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
                p.surveys.into_iter().map(Shape::Ring).collect()
            };
            return Ok((area, p.keep_out));
        }
        if name.ends_with(".geojson") || name.ends_with(".json") {
            let g = geojson::read(&text).map_err(|e| node.wrong(format!("{name}: {e}")))?;
            notices.extend(g.notices.iter().map(|n| told(&n.pointer, &n.text)));
            let shapes: Vec<Shape> = g
                .polygons
                .into_iter()
                .map(|f| Shape::Ring(f.ring))
                .collect();
            return Ok((shapes.clone(), shapes));
        }
        Err(node.wrong(format!(
            "{name} is of no known format; expected a name that ends in .plan or .geojson"
        )))
    }

    fn file_polygons(
        &self,
        node: &Node<'_>,
        shapes: &[Shape],
        side: Side,
    ) -> Result<Vec<Polygon>, ScenarioError> {
        let name = node.text()?;
        let one = |(i, shape): (usize, &Shape)| {
            let ring = shape
                .to_plane(self.origin, side)
                .map_err(|e| node.wrong(format!("{name}: shape {i}: {e}")))?;
            Polygon::new(ring).map_err(|e| node.wrong(format!("{name}: shape {i}: {e}")))
        };
        shapes.iter().enumerate().map(one).collect()
    }

    fn area(&self, node: &Node<'_>, notices: &mut Notices) -> Result<Polygon, ScenarioError> {
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
            let (shapes, _) = self.file_shapes(file, notices)?;
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

    fn zones(&self, node: &Node<'_>, notices: &mut Notices) -> Result<Vec<Polygon>, ScenarioError> {
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
            // What the file says besides was already told where the area came from it.
            let mut again = Notices::new();
            let (_, shapes) = self.file_shapes(file, &mut again)?;
            if !notices
                .iter()
                .any(|(_, said)| again.iter().any(|(_, a)| a == said))
            {
                notices.append(&mut again);
            }
            return self.file_polygons(file, &shapes, Side::Outside);
        }
        Err(node.wrong("a no-fly zone is one of { ring_m: [...] }, { ring_deg: [...] }, { circle: {...} }, { file: \"...\" }"))
    }

    fn buildings(
        &self,
        node: &Node<'_>,
        notices: &mut Notices,
    ) -> Result<Vec<Building>, ScenarioError> {
        let f = node.fields(&["file", "storey_m", "default_storeys"])?;
        let rules = HeightRules {
            storey_m: f.number_or("storey_m", 3.0, 1.0, 10.0, "metres")?,
            default_storeys: f.number_or("default_storeys", 3.0, 0.0, 100.0, "storeys")?,
        };
        let file = f.need("file", "\"buildings.geojson\"")?;
        let name = file.text()?;
        let read = geojson::buildings(&self.files.read(file)?, &rules)
            .map_err(|e| file.wrong(format!("{name}: {e}")))?;
        let mut tell = |pointer: &str, text: &str| {
            notices.push((
                file.path().to_owned(),
                format!("{name}: at {pointer}: {text}"),
            ));
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

/// Convex hull by Andrew's monotone chain, counter-clockwise, in O(n log n).
fn hull(mut points: Vec<Point>) -> Vec<Point> {
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
