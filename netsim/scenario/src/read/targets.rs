//! What a scenario asks to see: an area, points or lines, in the plane (D2.7 §3.2, §3.4,
//! §3.5). Leaves areas, zones and buildings themselves to `terrain`.

use super::shared::{Notices, position, targets_of};
use crate::files::Files;
use crate::request::AreaPlanner;
use skein_flight::coverage::stations::targets::{LineTarget, PointTarget, Targets};
use skein_geometry::Polygon;
use skein_geometry::frame::{MAX_MISSION_RADIUS_M, Origin, Point, Vector};
use skein_interop::json::{Error, Fields, Node};
use skein_interop::place::{LatLon, to_plane};

/// What is to be seen, in metres.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Asked {
    /// The whole area.
    Area(AreaPlanner),
    /// Points or lines within it.
    Targets(Targets),
}

/// Most pieces that a mission for points or lines may ask for; more would not fit
/// into what a mission may be spoken in.
const MAX_TARGETS: usize = 4096;

/// Widest corridor and largest radius, metres.
const WIDEST_M: f64 = 5000.0;

/// Room around targets when the file states no area, metres.
const MARGIN_M: f64 = 50.0;

/// What the file asks to see besides an area, cut off at the area's border where one is
/// given; an area by default.
pub(crate) fn read(
    f: &Fields<'_>,
    files: &Files<'_>,
    origin: Origin,
    area: Option<&Polygon>,
    notices: &mut Notices,
) -> Result<Asked, Error> {
    let reader = Reader { origin, files };
    if let (Some(node), Some(_)) = (f.get("planner"), f.get("points").or(f.get("lines"))) {
        return Err(
            node.wrong("points and lines have one planner each; leave this out, or cover an area")
        );
    }
    match (f.get("points"), f.get("lines")) {
        (None, None) => Ok(area_task(f)?),
        (Some(_), Some(lines)) => Err(lines.wrong(
            "a mission has points or lines, not both; plan two missions, or give a point as a short line",
        )),
        (Some(node), None) => reader.points(node, area, notices),
        (None, Some(node)) => reader.lines(node, area, notices),
    }
}

/// The planner of an area, by its name; lanes by default.
fn area_task(f: &Fields<'_>) -> Result<Asked, Error> {
    let Some(node) = f.get("planner") else {
        return Ok(Asked::Area(AreaPlanner::Lanes));
    };
    let name = node.text()?;
    match AreaPlanner::ALL.into_iter().find(|p| p.name() == name) {
        Some(planner) => Ok(Asked::Area(planner)),
        None => Err(node.wrong(format!(
            "{name} is no planner of the swarm; expected \"lanes\" (spanning-tree loop over a lane grid) or \"exact\" (straight passes over the cells of a boustrophedon decomposition)"
        ))),
    }
}

/// The rectangle around all targets, with room.
pub(crate) fn extent(asked: &Asked, node: &Node<'_>) -> Result<Polygon, Error> {
    let all: Vec<Point> = match asked {
        Asked::Area(_) => Vec::new(),
        Asked::Targets(Targets::Points(points)) => points.iter().map(|p| p.at).collect(),
        Asked::Targets(Targets::Lines(lines)) => {
            lines.iter().flat_map(|l| l.way.iter().copied()).collect()
        }
    };
    let far = |pick: fn(f64, f64) -> f64, axis: usize, start: f64| {
        all.iter().map(|p| p[axis]).fold(start, pick)
    };
    let (w, s) = (far(f64::min, 0, f64::MAX), far(f64::min, 1, f64::MAX));
    let (e, n) = (far(f64::max, 0, f64::MIN), far(f64::max, 1, f64::MIN));
    let corner = |x: f64, y: f64| Point::new(x, y);
    Polygon::new(vec![
        corner(w - MARGIN_M, s - MARGIN_M),
        corner(e + MARGIN_M, s - MARGIN_M),
        corner(e + MARGIN_M, n + MARGIN_M),
        corner(w - MARGIN_M, n + MARGIN_M),
    ])
    .map_err(|e| node.wrong(e.to_string()))
}

struct Reader<'f> {
    origin: Origin,
    files: &'f Files<'f>,
}

impl Reader<'_> {
    fn plane(&self, at: LatLon, name: &str, node: &Node<'_>) -> Result<Point, Error> {
        to_plane(self.origin, at).map_err(|e| node.wrong(format!("{name}: {e}")))
    }

    fn points(
        &self,
        node: &Node<'_>,
        area: Option<&Polygon>,
        notices: &mut Notices,
    ) -> Result<Asked, Error> {
        let mut points: Vec<(Point, f64)> = Vec::new();
        if node.is_list() {
            for item in node.items()? {
                let f = item.fields(&["east_m", "north_m", "radius_m"])?;
                let radius_m = f.number_or("radius_m", 0.0, 0.0, WIDEST_M, "metres")?;
                points.push((position(&f)?, radius_m));
            }
        } else {
            let f = node.fields(&["file", "radius_m"])?;
            let radius_m = f.number_or("radius_m", 0.0, 0.0, WIDEST_M, "metres")?;
            let file = f.need("file", "\"points.geojson\"")?;
            for p in targets_of(file, self.files, notices)?.points {
                let at = self.plane(p.at, &p.pointer, file)?;
                points.push((at, p.radius_m.max(radius_m)));
            }
        }
        let found = points.len();
        if let Some(area) = area {
            points.retain(|(p, _)| area.contains(*p));
        }
        limited(node, found, points.len(), "point")?;
        let target = |(at, radius_m)| PointTarget { at, radius_m };
        let points = points.into_iter().map(target).collect();
        Ok(Asked::Targets(Targets::Points(points)))
    }

    fn lines(
        &self,
        node: &Node<'_>,
        area: Option<&Polygon>,
        notices: &mut Notices,
    ) -> Result<Asked, Error> {
        let f = node.fields(&["file", "ways_m", "width_m"])?;
        let width_m = f.number_or("width_m", 0.0, 0.0, WIDEST_M, "metres")?;
        let mut ways: Vec<(Vec<Point>, f64)> = Vec::new();
        if let Some(list) = f.get("ways_m") {
            for way in list.items()? {
                ways.push((typed_way(&way)?, width_m));
            }
        } else {
            let file = f.need("file", "\"roads.geojson\"")?;
            for l in targets_of(file, self.files, notices)?.lines {
                let at = |p: &LatLon| self.plane(*p, &l.pointer, file);
                let way = l.way.iter().map(at).collect::<Result<Vec<_>, _>>()?;
                ways.push((way, l.width_m.max(width_m)));
            }
        }
        let found = ways.len();
        if let Some(area) = area {
            ways = ways
                .into_iter()
                .flat_map(|(way, width_m)| {
                    within(&way, area).into_iter().map(move |w| (w, width_m))
                })
                .collect();
        }
        let vertices: usize = ways.iter().map(|(w, _)| w.len()).sum();
        limited(node, found, ways.len().min(vertices), "line")?;
        let target = |(way, width_m)| LineTarget { way, width_m };
        let lines = ways.into_iter().map(target).collect();
        Ok(Asked::Targets(Targets::Lines(lines)))
    }
}

fn limited(node: &Node<'_>, found: usize, kept: usize, what: &str) -> Result<(), Error> {
    if kept == 0 {
        return Err(node.wrong(if found == 0 {
            format!("no {what} is given")
        } else {
            format!("none of the {found} {what}s lies within the area")
        }));
    }
    if kept > MAX_TARGETS {
        return Err(node.wrong(format!(
            "{kept} {what}s are too many; a mission may have {MAX_TARGETS}"
        )));
    }
    Ok(())
}

fn typed_way(node: &Node<'_>) -> Result<Vec<Point>, Error> {
    let items = node.items()?;
    if items.len() < 2 {
        return Err(node.wrong(format!(
            "a line has at least 2 points, found {}",
            items.len()
        )));
    }
    let point = |item: &Node<'_>| {
        let (e, n) = item.pair(
            -MAX_MISSION_RADIUS_M,
            MAX_MISSION_RADIUS_M,
            "metres east and north of the origin",
        )?;
        Ok(Point::new(e, n))
    };
    items.iter().map(point).collect()
}

/// The parts of a way that lie within the area, cut at its border.
pub(super) fn within(way: &[Point], area: &Polygon) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut part: Vec<Point> = Vec::new();
    for w in way.windows(2) {
        let (a, v) = (w[0], w[1] - w[0]);
        let mut cuts = vec![0.0, 1.0];
        cuts.extend(crossings(a, v, area));
        cuts.sort_by(f64::total_cmp);
        for c in cuts.windows(2) {
            let inside = c[1] > c[0] && area.contains(a + v * f64::midpoint(c[0], c[1]));
            if inside {
                if part.is_empty() {
                    part.push(a + v * c[0]);
                }
                part.push(a + v * c[1]);
            } else if c[1] > c[0] && part.len() > 1 {
                parts.push(std::mem::take(&mut part));
            }
        }
    }
    if part.len() > 1 {
        parts.push(part);
    }
    parts
}

/// Where along `a + t v` the border of the area is crossed, 0 < t < 1.
fn crossings(a: Point, v: Vector, area: &Polygon) -> impl Iterator<Item = f64> + '_ {
    let ring = area.vertices();
    (0..ring.len()).filter_map(move |i| {
        let (p, q) = (ring[i], ring[(i + 1) % ring.len()]);
        let edge = q - p;
        let across = v.perp(&edge);
        if across.abs() < 1e-12 {
            return None;
        }
        let t = (p - a).perp(&edge) / across;
        let u = (p - a).perp(&v) / across;
        (t > 0.0 && t < 1.0 && (0.0..=1.0).contains(&u)).then_some(t)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_cut_at_the_border_and_parts_stay_apart() {
        let p = |x: f64, y: f64| Point::new(x, y);
        let square = Polygon::new(vec![p(0.0, 0.0), p(10.0, 0.0), p(10.0, 10.0), p(0.0, 10.0)]);
        let area = square.unwrap();
        let way = [
            p(-5.0, 5.0),
            p(5.0, 5.0),
            p(5.0, 15.0),
            p(8.0, 15.0),
            p(8.0, 5.0),
        ];
        let parts = within(&way, &area);
        let want = [
            vec![p(0.0, 5.0), p(5.0, 5.0), p(5.0, 10.0)],
            vec![p(8.0, 10.0), p(8.0, 5.0)],
        ];
        assert_eq!(parts.len(), 2);
        for (got, want) in parts.iter().zip(&want) {
            assert_eq!(got.len(), want.len());
            let off = |(a, b): (&Point, &Point)| (a - b).norm();
            assert!(got.iter().zip(want).map(off).fold(0.0, f64::max) < 1e-9);
        }
        assert!(within(&[p(20.0, 0.0), p(30.0, 0.0)], &area).is_empty());
    }
}
