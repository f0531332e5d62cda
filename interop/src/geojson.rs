//! GeoJSON (RFC 7946): areas, and buildings with heights; written back as areas.
//! Coordinates are longitude first. Leaves everything in the plane to the caller.

use crate::json::{Document, Error, Node};
use crate::place::{LatLon, orient};
use crate::{Notice, height};
use serde_json::{Map, Value, json};

/// A polygon of the file with its properties.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// JSON pointer of the feature.
    pub pointer: String,
    /// The outer ring, counter-clockwise, the first point not repeated.
    pub ring: Vec<LatLon>,
    /// Number of holes, which the ring does not show.
    pub holes: usize,
    /// The rings of those of its holes that have at least three different points,
    /// counter-clockwise, the first point not repeated.
    pub hole_rings: Vec<Vec<LatLon>>,
    /// Its properties.
    pub properties: Map<String, Value>,
}

/// A property that is neither true nor false. The polygon means nothing then.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "at {pointer}/properties/no_fly: {found} is neither true nor false; expected true, \"yes\" or 1 for a zone, false, \"no\", 0 or nothing for none"
)]
pub struct NoTruth {
    /// JSON pointer of the feature.
    pub pointer: String,
    /// What stands there.
    pub found: Value,
}

impl Feature {
    /// Whether its property `no_fly` says that it is a zone, in the words of any GIS: these
    /// export truth values as numbers and texts too.
    ///
    /// # Errors
    /// [`NoTruth`] when the property is neither true nor false.
    pub fn is_no_fly(&self) -> Result<bool, NoTruth> {
        let Some(found) = self.properties.get("no_fly") else {
            return Ok(false);
        };
        truth(found).ok_or_else(|| NoTruth {
            pointer: self.pointer.clone(),
            found: found.clone(),
        })
    }
}

/// What a property says, if it is true or false.
fn truth(value: &Value) -> Option<bool> {
    match value {
        Value::Null => Some(false),
        Value::Bool(flag) => Some(*flag),
        Value::Number(n) => {
            let n = n.as_f64()?;
            let is = |whole: f64| (n - whole).abs() < f64::EPSILON;
            (is(0.0) || is(1.0)).then_some(is(1.0))
        }
        Value::String(text) => match text.trim().to_lowercase().as_str() {
            "true" | "t" | "yes" | "y" | "1" => Some(true),
            "false" | "f" | "no" | "n" | "0" | "" => Some(false),
            _ => None,
        },
        _ => None,
    }
}

/// What a file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// Its polygons; a multi-polygon gives one for each part.
    pub polygons: Vec<Feature>,
    /// What was left out.
    pub notices: Vec<Notice>,
}

/// How a building without a height gets one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightRules {
    /// Height of a storey, metres.
    pub storey_m: f64,
    /// Storeys of a building that states neither height nor levels.
    pub default_storeys: f64,
}

impl Default for HeightRules {
    fn default() -> Self {
        Self {
            storey_m: 3.0,
            default_storeys: 3.0,
        }
    }
}

/// A building.
#[derive(Clone, Debug, PartialEq)]
pub struct Building {
    /// JSON pointer of its feature.
    pub pointer: String,
    /// Its footprint, counter-clockwise, the first point not repeated.
    pub ring: Vec<LatLon>,
    /// Height of its roof above the ground, metres.
    pub height_m: f64,
}

/// Buildings of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Buildings {
    /// In the order of the file.
    pub buildings: Vec<Building>,
    /// What was left out or assumed beyond the rules.
    pub notices: Vec<Notice>,
}

/// `[longitude, latitude, ...]`.
pub(crate) fn position(at: &Node<'_>) -> Result<LatLon, Error> {
    let items = at.items()?;
    if items.len() < 2 {
        return Err(at.wrong("a position is [longitude, latitude]"));
    }
    Ok(LatLon {
        lon_deg: items[0].number(-180.0, 180.0, "a longitude in degrees")?,
        lat_deg: items[1].number(-90.0, 90.0, "a latitude in degrees")?,
    })
}

/// The outer ring, the number of holes, and the rings of the holes that have an area.
type Rings = (Vec<LatLon>, usize, Vec<Vec<LatLon>>);

fn polygon(at: &Node<'_>) -> Result<Rings, Error> {
    let rings = at.items()?;
    let outer = rings
        .first()
        .ok_or_else(|| at.wrong("a polygon has at least one ring"))?;
    let read = |ring: &Node<'_>| {
        let points = ring.items()?;
        let points = points.iter().map(position).collect::<Result<Vec<_>, _>>()?;
        let points = orient(points);
        if points.len() < 3 {
            return Err(ring.wrong(format!(
                "a ring has at least 3 different points, found {}",
                points.len()
            )));
        }
        Ok(points)
    };
    // Whoever takes the outer ring for solid does not mind what is wrong in a hole.
    let holes = rings.iter().skip(1).filter_map(|r| read(r).ok()).collect();
    Ok((read(outer)?, rings.len() - 1, holes))
}

fn geometry(
    at: &Node<'_>,
    pointer: &str,
    properties: &Map<String, Value>,
    out: &mut Features,
) -> Result<(), Error> {
    let kind = at.need("type")?;
    let mut push = |(ring, holes, hole_rings): Rings| {
        if holes > 0 {
            let text = format!("{holes} hole(s) ignored: the outer ring counts as solid");
            out.notices.push(Notice {
                pointer: pointer.to_owned(),
                text,
            });
        }
        let properties = properties.clone();
        out.polygons.push(Feature {
            pointer: pointer.to_owned(),
            ring,
            holes,
            hole_rings,
            properties,
        });
    };
    match kind.text()? {
        "Polygon" => push(polygon(&at.need("coordinates")?)?),
        "MultiPolygon" => {
            for part in at.need("coordinates")?.items()? {
                push(polygon(&part)?);
            }
        }
        "GeometryCollection" => {
            for part in at.need("geometries")?.items()? {
                geometry(&part, pointer, properties, out)?;
            }
        }
        other @ ("Point" | "MultiPoint" | "LineString" | "MultiLineString") => {
            let text = format!("a {other} is no area: ignored");
            out.notices.push(Notice {
                pointer: pointer.to_owned(),
                text,
            });
        }
        other => {
            return Err(kind.wrong(format!(
                "\"{other}\" is no GeoJSON geometry; expected Polygon or MultiPolygon"
            )));
        }
    }
    Ok(())
}

fn properties(at: &Node<'_>) -> Result<Map<String, Value>, Error> {
    at.members()?;
    match at.to_json() {
        Value::Object(map) => Ok(map),
        _ => Ok(Map::new()),
    }
}

fn feature(at: &Node<'_>, out: &mut Features) -> Result<(), Error> {
    let kind = at.need("type")?;
    if kind.text()? != "Feature" {
        return Err(kind.wrong("expected \"Feature\""));
    }
    let properties = match at.get("properties")? {
        Some(p) => properties(&p)?,
        None => Map::new(),
    };
    match at.get("geometry")? {
        Some(g) => geometry(&g, &at.pointer(), &properties, out),
        None => {
            out.notices.push(Notice {
                pointer: at.pointer(),
                text: "no geometry: ignored".to_owned(),
            });
            Ok(())
        }
    }
}

/// Reads all polygons of a GeoJSON text.
///
/// # Errors
/// [`Error`] names the value that is wrong.
pub fn read(text: &str) -> Result<Features, Error> {
    let document = Document::parse("GeoJSON", "", text)?;
    let root = document.root();
    let kind = root.need("type")?;
    let mut out = Features::default();
    match kind.text()? {
        "FeatureCollection" => {
            for f in root.need("features")?.items()? {
                feature(&f, &mut out)?;
            }
        }
        "Feature" => feature(&root, &mut out)?,
        _ => geometry(&root, "/", &Map::new(), &mut out)?,
    }
    Ok(out)
}

/// A property that is a string or a number, as text.
fn tag(properties: &Map<String, Value>, key: &str) -> Option<String> {
    match properties.get(key)? {
        Value::String(s) => Some(s.clone()),
        Value::Number(n) => Some(n.to_string()),
        _ => None,
    }
}

fn building_height(f: &Feature, rules: &HeightRules, notices: &mut Vec<Notice>) -> f64 {
    for (key, scale) in [("height", 1.0), ("building:levels", rules.storey_m)] {
        let Some(text) = tag(&f.properties, key) else {
            continue;
        };
        let parsed = if key == "height" {
            height::metres(&text)
        } else {
            height::levels(&text)
        };
        match parsed {
            Some(n) => return n * scale,
            None => notices.push(Notice {
                pointer: f.pointer.clone(),
                text: format!(
                    "{key} \"{text}\" is not understood: expected a number such as 12.5; ignored"
                ),
            }),
        }
    }
    rules.default_storeys * rules.storey_m
}

/// Reads buildings: heights from `height`, else `building:levels`, else the rules.
///
/// # Errors
/// [`Error`] names the value that is wrong.
pub fn buildings(text: &str, rules: &HeightRules) -> Result<Buildings, Error> {
    let features = read(text)?;
    let mut out = Buildings {
        buildings: Vec::with_capacity(features.polygons.len()),
        notices: features.notices,
    };
    for f in features.polygons {
        let height_m = building_height(&f, rules, &mut out.notices);
        out.buildings.push(Building {
            pointer: f.pointer,
            ring: f.ring,
            height_m,
        });
    }
    Ok(out)
}

/// Writes rings with their properties as a feature collection.
#[must_use]
pub fn write(polygons: &[(Vec<LatLon>, Map<String, Value>)]) -> String {
    let features: Vec<Value> = polygons
        .iter()
        .map(|(ring, properties)| {
            let mut ring = orient(ring.clone());
            ring.extend(ring.first().copied());
            let points: Vec<Value> = ring.iter().map(|p| json!([p.lon_deg, p.lat_deg])).collect();
            json!({"type": "Feature", "properties": properties, "geometry": {"type": "Polygon", "coordinates": [points]}})
        })
        .collect();
    json!({"type": "FeatureCollection", "features": features}).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn errors_name_the_place() {
        assert!(error("{").contains("line 1, column"));
        assert!(error("[]").contains("GeoJSON: expected an object { ... }, found a list"));
        assert!(error(r#"{"type":"FeatureCollection"}"#).contains("the field features is missing"));
        let bad = r#"{"type":"Polygon","coordinates":[[[24.9,60.1],[24.9,"x"],[25,60]]]}"#;
        assert!(
            error(bad).contains("line 1, column 53: coordinates[0][1][1]: expected a number"),
            "{}",
            error(bad)
        );
        let far = r#"{"type":"Polygon","coordinates":[[[24.9,160.1],[24.9,60],[25,60]]]}"#;
        assert!(
            error(far).contains("coordinates[0][0][1]: 160.1 is out of range; expected a latitude"),
            "{}",
            error(far)
        );
        assert!(error(r#"{"type":"Blob"}"#).contains("type: \"Blob\""));
    }

    #[test]
    fn nothing_is_dropped_silently() {
        let text = r#"{"type":"FeatureCollection","features":[
            {"type":"Feature","properties":null,"geometry":{"type":"Point","coordinates":[1,2]}},
            {"type":"Feature","properties":{},"geometry":null},
            {"type":"Feature","properties":{"height":"tall","building:levels":2},"geometry":
              {"type":"MultiPolygon","coordinates":[[[[0,0],[0,1],[1,1],[0,0]],[[0.1,0.1],[0.2,0.1],[0.2,0.2]]]]}}]}"#;
        let read = buildings(text, &HeightRules::default()).unwrap();
        assert_eq!(read.notices.len(), 4, "{:?}", read.notices);
        assert_eq!(read.buildings.len(), 1);
        assert!((read.buildings[0].height_m - 6.0).abs() < 1e-9);
    }

    #[test]
    fn zones_are_told_in_the_words_of_any_gis() {
        let says = |value: &str| {
            let text = format!(
                r#"{{"type":"Feature","properties":{{"no_fly":{value}}},"geometry":{{"type":"Polygon","coordinates":[[[0,0],[0,1],[1,1],[0,0]]]}}}}"#
            );
            read(&text).unwrap().polygons[0].is_no_fly()
        };
        for yes in [
            "true",
            "1",
            "1.0",
            "\"true\"",
            "\"True\"",
            "\"TRUE\"",
            "\"yes\"",
            "\"Y\"",
            "\"t\"",
            "\"1\"",
            "\" true \"",
        ] {
            assert_eq!(says(yes), Ok(true), "{yes}");
        }
        for no in [
            "false",
            "0",
            "null",
            "\"false\"",
            "\"False\"",
            "\"no\"",
            "\"N\"",
            "\"f\"",
            "\"0\"",
            "\"\"",
        ] {
            assert_eq!(says(no), Ok(false), "{no}");
        }
        for other in ["2", "-1", "0.5", "\"maybe\"", "[]", "{}"] {
            let error = says(other).unwrap_err().to_string();
            assert!(error.starts_with("at //properties/no_fly: "), "{error}");
            assert!(error.contains("neither true nor false"), "{error}");
        }
    }

    #[test]
    fn what_is_written_can_be_read() {
        let ring = vec![
            LatLon {
                lat_deg: 60.0,
                lon_deg: 24.0,
            },
            LatLon {
                lat_deg: 60.5,
                lon_deg: 24.5,
            },
            LatLon {
                lat_deg: 60.5,
                lon_deg: 24.0,
            },
        ];
        let text = write(&[(ring.clone(), Map::new())]);
        assert_eq!(read(&text).unwrap().polygons[0].ring, orient(ring));
    }
}
