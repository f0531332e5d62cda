//! What is to be looked at, as points and lines: GeoJSON points and lines, QGroundControl
//! waypoints and corridor scans. Leaves areas to [`crate::geojson`] and [`crate::plan`].

use crate::geojson::position;
use crate::json::{Document, Error, Node};
use crate::place::LatLon;
use crate::{Notice, plan};

/// A point to look at.
#[derive(Clone, Debug, PartialEq)]
pub struct PointTarget {
    /// JSON pointer of the item.
    pub pointer: String,
    /// Where.
    pub at: LatLon,
    /// Radius around it that must be seen, metres; 0 for the point alone.
    pub radius_m: f64,
    /// The sensor that it is to be seen with, if the file says so.
    pub sensor: Option<String>,
}

/// A line to look along.
#[derive(Clone, Debug, PartialEq)]
pub struct LineTarget {
    /// JSON pointer of the item.
    pub pointer: String,
    /// At least two points.
    pub way: Vec<LatLon>,
    /// What it is called, if the file says so.
    pub name: Option<String>,
    /// Width of the strip around it that must be seen, metres; 0 for the line alone.
    pub width_m: f64,
    /// The sensor that it is to be seen with, if the file says so.
    pub sensor: Option<String>,
}

/// What a file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Targets {
    /// In the order of the file.
    pub points: Vec<PointTarget>,
    /// In the order of the file.
    pub lines: Vec<LineTarget>,
    /// Where the vehicles start, if the file says so.
    pub home: Option<LatLon>,
    /// What was left out.
    pub notices: Vec<Notice>,
}

/// The largest radius and width that are believed, metres.
const WIDEST_M: f64 = 40_000.0;

/// Reads the points and lines of a QGroundControl plan or of GeoJSON.
///
/// In a plan, waypoints are points and corridor scans are lines of their width. In
/// GeoJSON the properties `radius_m` of a point, `width_m` and `name` of a line and `sensor` of both
/// are read.
///
/// # Errors
/// [`Error`] names the value that is wrong.
pub fn read(text: &str) -> Result<Targets, Error> {
    let document = Document::parse("targets", "", text)?;
    let root = document.root();
    if root.get("fileType")?.is_some() {
        return of_plan(&root);
    }
    let mut out = Targets::default();
    let kind = root.need("type")?;
    match kind.text()? {
        "FeatureCollection" => {
            for f in root.need("features")?.items()? {
                feature(&f, &mut out)?;
            }
        }
        "Feature" => feature(&root, &mut out)?,
        _ => geometry(&root, "/", &Asked::default(), &mut out)?,
    }
    Ok(out)
}

fn of_plan(root: &Node<'_>) -> Result<Targets, Error> {
    let file = plan::of(root)?;
    let mut out = Targets {
        home: file.home,
        ..Targets::default()
    };
    let waypoints = file.waypoints.iter().enumerate();
    out.points = waypoints
        .filter(|(_, w)| w.command == plan::NAV_WAYPOINT)
        .map(|(i, w)| PointTarget {
            pointer: format!("waypoint {}", i + 1),
            at: w.at,
            radius_m: 0.0,
            sensor: None,
        })
        .collect();
    // The plan's reader knows no corridors and says that it ignored them.
    let corridor = |n: &Notice| n.text.contains("CorridorScan");
    out.notices = file.notices.into_iter().filter(|n| !corridor(n)).collect();
    let Some(mission) = root.get("mission")? else {
        return Ok(out);
    };
    let Some(items) = mission.get("items")? else {
        return Ok(out);
    };
    for item in items.items()? {
        let Some(kind) = item.get("complexItemType")? else {
            continue;
        };
        if kind.text()? != "CorridorScan" {
            continue;
        }
        plan::version(&item, plan::CORRIDOR, "a corridor scan")?;
        let width = item.need("CorridorWidth")?;
        let line = item.need("polyline")?;
        let points = line.items()?;
        let way = points.iter().map(plan::lat_lon).collect::<Result<_, _>>()?;
        let asked = Asked {
            width_m: width.number(0.0, WIDEST_M, "a width in metres")?,
            ..Asked::default()
        };
        push_line(&line, &item.pointer(), way, &asked, &mut out)?;
    }
    Ok(out)
}

/// What the properties of a feature ask for.
#[derive(Default)]
struct Asked {
    radius_m: f64,
    width_m: f64,
    name: Option<String>,
    sensor: Option<String>,
}

fn push_line(
    at: &Node<'_>,
    pointer: &str,
    way: Vec<LatLon>,
    asked: &Asked,
    out: &mut Targets,
) -> Result<(), Error> {
    if way.len() < 2 {
        return Err(at.wrong(format!("a line has at least 2 points, found {}", way.len())));
    }
    if way.iter().all(|p| *p == way[0]) {
        out.notices.push(Notice {
            pointer: pointer.to_owned(),
            text: "all points of the line are the same: ignored".to_owned(),
        });
        return Ok(());
    }
    out.lines.push(LineTarget {
        pointer: pointer.to_owned(),
        way,
        name: asked.name.clone(),
        width_m: asked.width_m,
        sensor: asked.sensor.clone(),
    });
    Ok(())
}

fn feature(at: &Node<'_>, out: &mut Targets) -> Result<(), Error> {
    let kind = at.need("type")?;
    if kind.text()? != "Feature" {
        return Err(kind.wrong("expected \"Feature\""));
    }
    let property = |key: &str| match at.get("properties")? {
        Some(p) => p.get(key),
        None => Ok(None),
    };
    let size = |key: &str| match property(key)? {
        Some(n) => n.number(0.0, WIDEST_M, "a size in metres"),
        None => Ok(0.0),
    };
    let asked = Asked {
        radius_m: size("radius_m")?,
        width_m: size("width_m")?,
        name: match property("name")? {
            // Maps write null, or a number, where a street has no name.
            Some(name) => name.text().ok().map(str::to_owned),
            None => None,
        },
        sensor: match property("sensor")? {
            Some(name) => Some(name.text()?.to_owned()),
            None => None,
        },
    };
    match at.get("geometry")? {
        Some(g) => geometry(&g, &at.pointer(), &asked, out),
        None => {
            out.notices.push(Notice {
                pointer: at.pointer(),
                text: "no geometry: ignored".to_owned(),
            });
            Ok(())
        }
    }
}

fn geometry(at: &Node<'_>, pointer: &str, asked: &Asked, out: &mut Targets) -> Result<(), Error> {
    let kind = at.need("type")?;
    let point = |p: &Node<'_>, out: &mut Targets| -> Result<(), Error> {
        out.points.push(PointTarget {
            pointer: pointer.to_owned(),
            at: position(p)?,
            radius_m: asked.radius_m,
            sensor: asked.sensor.clone(),
        });
        Ok(())
    };
    let line = |l: &Node<'_>, out: &mut Targets| -> Result<(), Error> {
        let way = l.items()?.iter().map(position).collect::<Result<_, _>>()?;
        push_line(l, pointer, way, asked, out)
    };
    match kind.text()? {
        "Point" => point(&at.need("coordinates")?, out)?,
        "MultiPoint" => {
            for p in at.need("coordinates")?.items()? {
                point(&p, out)?;
            }
        }
        "LineString" => line(&at.need("coordinates")?, out)?,
        "MultiLineString" => {
            for l in at.need("coordinates")?.items()? {
                line(&l, out)?;
            }
        }
        "GeometryCollection" => {
            for part in at.need("geometries")?.items()? {
                geometry(&part, pointer, asked, out)?;
            }
        }
        other @ ("Polygon" | "MultiPolygon") => out.notices.push(Notice {
            pointer: pointer.to_owned(),
            text: format!("a {other} is neither point nor line: ignored"),
        }),
        other => return Err(kind.wrong(format!("\"{other}\" is no GeoJSON geometry"))),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const GEOJSON: &str = r#"{"type":"FeatureCollection","features":[
        {"type":"Feature","properties":{"radius_m":25,"sensor":"rgb"},"geometry":{"type":"Point","coordinates":[24.9,60.1]}},
        {"type":"Feature","properties":{"width_m":60},"geometry":{"type":"LineString","coordinates":[[24.9,60.1],[24.91,60.1]]}},
        {"type":"Feature","geometry":{"type":"MultiLineString","coordinates":[[[24.9,60.1],[24.91,60.1]],[[24.9,60.2],[24.91,60.2]]]}},
        {"type":"Feature","geometry":{"type":"Polygon","coordinates":[[[24.9,60.1],[24.91,60.1],[24.91,60.11],[24.9,60.1]]]}}]}"#;

    #[test]
    fn geojson_points_and_lines_with_their_sizes() {
        let t = read(GEOJSON).unwrap();
        assert_eq!((t.points.len(), t.lines.len(), t.notices.len()), (1, 3, 1));
        assert!((t.points[0].radius_m - 25.0).abs() < 1e-9);
        assert!((t.lines[0].width_m - 60.0).abs() < 1e-9 && t.lines[1].width_m.abs() < 1e-9);
        assert_eq!(t.lines[2].pointer, "/features/2");
        assert_eq!(t.points[0].sensor.as_deref(), Some("rgb"));
        assert_eq!(t.lines[0].sensor, None);
        for end in 0..GEOJSON.len() {
            assert!(read(&GEOJSON[..end]).is_err());
        }
        let says = |from: &str, to: &str| {
            let error = read(&GEOJSON.replacen(from, to, 1)).unwrap_err();
            error.to_string()
        };
        assert!(says("25,", "-1,").contains("features[0].properties.radius_m: -1 is"));
        assert!(says("\"rgb\"", "[]").contains("features[0].properties.sensor: "));
        assert!(says(",[24.91,60.1]]}", "]}").contains("at least 2 points"));
    }

    #[test]
    fn a_line_of_no_length_is_left_out_and_told() {
        let text = r#"{"type":"FeatureCollection","features":[{"type":"Feature","properties":{},
            "geometry":{"type":"LineString","coordinates":[[8,47],[8,47],[8,47]]}}]}"#;
        let found = read(text).unwrap();
        assert!(found.lines.is_empty());
        assert!(found.notices[0].text.contains("are the same"));
    }

    #[test]
    fn corridors_and_waypoints_of_a_plan() {
        let text = r#"{"fileType":"Plan","mission":{"plannedHomePosition":[47,8,400],"items":[
            {"type":"SimpleItem","command":22,"params":[0,0,0,null,47,8,30]},
            {"type":"SimpleItem","command":16,"params":[0,0,0,null,47.1,8.1,30]},
            {"type":"ComplexItem","complexItemType":"CorridorScan","CorridorWidth":80,
             "polyline":[[47,8],[47.01,8.02],[47.02,8.02]]},
            {"type":"ComplexItem","complexItemType":"StructureScan"}]}}"#;
        let t = read(text).unwrap();
        assert_eq!((t.points.len(), t.lines.len(), t.notices.len()), (1, 1, 1));
        assert!((t.lines[0].width_m - 80.0).abs() < 1e-9);
        assert_eq!(t.lines[0].way.len(), 3);
        assert!(t.home.is_some());
        let scan = "\"CorridorScan\",";
        let newer = text.replace(scan, &format!("{scan}\"version\":3,"));
        let error = read(&newer).unwrap_err().to_string();
        assert!(error.contains("items[2].version: 3 is no known version of a corridor scan"));
        let wrong = text.replace("80", "\"x\"");
        assert!(
            read(&wrong)
                .unwrap_err()
                .to_string()
                .contains("mission.items[2].CorridorWidth: ")
        );
    }
}
