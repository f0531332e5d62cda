//! QGroundControl `.plan` files: geofence, survey polygons, simple waypoints.
//! Leaves to the caller what a fence or a survey means for a mission.

use crate::Notice;
use crate::json::{Document, Error, Node};
use crate::place::{LatLon, Shape, orient};
use serde_json::{Value, json};

/// The largest radius of a fence circle that is believed, metres: twice the
/// radius of the largest mission.
const MAX_CIRCLE_M: f64 = 40_000.0;

/// MAVLink command of a waypoint.
pub(crate) const NAV_WAYPOINT: i64 = 16;

/// MAVLink frame of an altitude above home.
const FRAME_RELATIVE_ALT: i64 = 3;

/// A simple mission item that has a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// MAVLink command number (16 is a waypoint, 22 a take-off).
    pub command: i64,
    /// Where.
    pub at: LatLon,
    /// Altitude as the item states it (its frame decides above what), metres.
    pub altitude_m: f64,
}

/// What a plan holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanFile {
    /// Fences that must not be left.
    pub keep_in: Vec<Shape>,
    /// Fences that must not be entered.
    pub keep_out: Vec<Shape>,
    /// Polygons of survey items, counter-clockwise.
    pub surveys: Vec<Vec<LatLon>>,
    /// Simple items that have a place.
    pub waypoints: Vec<Waypoint>,
    /// Where the vehicle starts, as planned.
    pub home: Option<LatLon>,
    /// Cruise airspeed as planned, m/s.
    pub cruise_mps: Option<f64>,
    /// What was left out.
    pub notices: Vec<Notice>,
}

/// `[latitude, longitude, ...]`.
pub(crate) fn lat_lon(at: &Node<'_>) -> Result<LatLon, Error> {
    let items = at.items()?;
    if items.len() < 2 {
        return Err(at.wrong("a position is [latitude, longitude]"));
    }
    Ok(LatLon {
        lat_deg: items[0].number(-90.0, 90.0, "a latitude in degrees")?,
        lon_deg: items[1].number(-180.0, 180.0, "a longitude in degrees")?,
    })
}

fn ring(at: &Node<'_>) -> Result<Vec<LatLon>, Error> {
    let points = at
        .items()?
        .iter()
        .map(lat_lon)
        .collect::<Result<Vec<_>, _>>()?;
    let ring = orient(points);
    if ring.len() < 3 {
        return Err(at.wrong(format!(
            "a polygon has at least 3 different points, found {}",
            ring.len()
        )));
    }
    Ok(ring)
}

fn fence(at: &Node<'_>, out: &mut PlanFile) -> Result<(), Error> {
    let mut shapes = Vec::new();
    if let Some(polygons) = at.get("polygons")? {
        for p in polygons.items()? {
            shapes.push((
                p.need("inclusion")?.flag()?,
                Shape::Ring(ring(&p.need("polygon")?)?),
            ));
        }
    }
    if let Some(circles) = at.get("circles")? {
        for c in circles.items()? {
            let circle = c.need("circle")?;
            let radius = circle.need("radius")?;
            let radius_m = radius.number(0.0, MAX_CIRCLE_M, "a radius in metres")?;
            if radius_m <= 0.0 {
                return Err(radius.wrong("a radius must be above 0"));
            }
            let centre = lat_lon(&circle.need("center")?)?;
            shapes.push((
                c.need("inclusion")?.flag()?,
                Shape::Circle { centre, radius_m },
            ));
        }
    }
    // Version 1 of the fence had one nameless polygon.
    if let Some(old) = at.get("polygon")? {
        if old.items()?.is_empty() {
            out.notices.push(Notice {
                pointer: old.pointer(),
                text: "an empty fence polygon: ignored".to_owned(),
            });
        } else {
            shapes.push((true, Shape::Ring(ring(&old)?)));
        }
    }
    for (inclusion, shape) in shapes {
        if inclusion {
            out.keep_in.push(shape)
        } else {
            out.keep_out.push(shape)
        }
    }
    if let Some(p) = at.get("breachReturn")? {
        out.notices.push(Notice {
            pointer: p.pointer(),
            text: "the breach return point is ignored".to_owned(),
        });
    }
    Ok(())
}

fn simple_item(at: &Node<'_>, out: &mut PlanFile) -> Result<(), Error> {
    let number = at.need("command")?;
    #[allow(
        clippy::cast_possible_truncation,
        reason = "checked to be a 16-bit command"
    )]
    let command = number.number(0.0, 65_535.0, "a MAVLink command")? as i64;
    let params = at.need("params")?;
    let items = params.items()?;
    let placed =
        items.len() == 7 && items[4].as_number().is_some() && items[5].as_number().is_some();
    let zero = |c: &Node<'_>| c.as_number().is_some_and(|n| n.abs() < 1e-12);
    if !placed || (zero(&items[4]) && zero(&items[5])) {
        let text = format!("command {command} has no place: ignored");
        out.notices.push(Notice {
            pointer: at.pointer(),
            text,
        });
        return Ok(());
    }
    out.waypoints.push(Waypoint {
        command,
        at: LatLon {
            lat_deg: items[4].number(-90.0, 90.0, "a latitude in degrees")?,
            lon_deg: items[5].number(-180.0, 180.0, "a longitude in degrees")?,
        },
        altitude_m: if items[6].is_null() {
            0.0
        } else {
            items[6].finite()?
        },
    });
    Ok(())
}

fn mission(at: &Node<'_>, out: &mut PlanFile) -> Result<(), Error> {
    if let Some(home) = at.get("plannedHomePosition")? {
        out.home = Some(lat_lon(&home)?);
    }
    if let Some(speed) = at.get("cruiseSpeed")? {
        out.cruise_mps = Some(speed.finite()?);
    }
    let Some(items) = at.get("items")? else {
        return Ok(());
    };
    for item in items.items()? {
        let kind = item.need("type")?;
        match kind.text()? {
            "SimpleItem" => simple_item(&item, out)?,
            "ComplexItem" => {
                let complex = item.need("complexItemType")?.text()?;
                if complex == "survey" {
                    out.surveys.push(ring(&item.need("polygon")?)?);
                    let text =
                        "the survey's polygon is used; its transects and camera are planned anew"
                            .to_owned();
                    out.notices.push(Notice {
                        pointer: item.pointer(),
                        text,
                    });
                } else {
                    out.notices.push(Notice {
                        pointer: item.pointer(),
                        text: format!("a {complex} item is ignored"),
                    });
                }
            }
            other => {
                return Err(kind.wrong(format!(
                    "\"{other}\" is no mission item; expected SimpleItem or ComplexItem"
                )));
            }
        }
    }
    Ok(())
}

/// Reads a plan.
///
/// # Errors
/// [`Error`] names the value that is wrong.
pub fn read(text: &str) -> Result<PlanFile, Error> {
    of(&Document::parse("plan", "", text)?.root())
}

/// The same of a text that was parsed already.
pub(crate) fn of(root: &Node<'_>) -> Result<PlanFile, Error> {
    let kind = root.need("fileType")?;
    if kind.text()? != "Plan" {
        return Err(kind.wrong("expected \"Plan\""));
    }
    let mut out = PlanFile::default();
    if let Some(f) = root.get("geoFence")? {
        fence(&f, &mut out)?;
    }
    if let Some(m) = root.get("mission")? {
        mission(&m, &mut out)?;
    }
    if let Some(rally) = root.get("rallyPoints")? {
        let points = rally
            .get("points")?
            .map(|p| p.items())
            .transpose()?
            .map_or(0, |p| p.len());
        if points > 0 {
            out.notices.push(Notice {
                pointer: rally.pointer(),
                text: format!("{points} rally point(s) ignored"),
            });
        }
    }
    Ok(out)
}

fn pair(p: LatLon) -> Value {
    json!([p.lat_deg, p.lon_deg])
}

/// Writes the fences and the waypoints as a plan that QGroundControl opens.
#[must_use]
pub fn write(plan: &PlanFile) -> String {
    let (mut polygons, mut circles) = (Vec::new(), Vec::new());
    let shapes = plan
        .keep_in
        .iter()
        .map(|s| (true, s))
        .chain(plan.keep_out.iter().map(|s| (false, s)));
    for (inclusion, shape) in shapes {
        match shape {
            Shape::Ring(r) => {
                let ring: Vec<Value> = r.iter().copied().map(pair).collect();
                polygons.push(json!({"inclusion": inclusion, "polygon": ring, "version": 1}));
            }
            Shape::Circle { centre, radius_m } => circles.push(
                json!({"circle": {"center": pair(*centre), "radius": radius_m}, "inclusion": inclusion, "version": 1}),
            ),
        }
    }
    let items: Vec<Value> = plan
        .waypoints
        .iter()
        .enumerate()
        .map(|(i, w)| {
            json!({
                "AMSLAltAboveTerrain": null, "Altitude": w.altitude_m, "AltitudeMode": 1,
                "autoContinue": true, "command": w.command, "doJumpId": i + 1,
                "frame": FRAME_RELATIVE_ALT, "type": "SimpleItem",
                "params": [0, 0, 0, null, w.at.lat_deg, w.at.lon_deg, w.altitude_m],
            })
        })
        .collect();
    let home = plan.home.or(plan.waypoints.first().map(|w| w.at));
    let home = home.map_or(json!([0, 0, 0]), |h| json!([h.lat_deg, h.lon_deg, 0]));
    json!({
        "fileType": "Plan", "version": 1, "groundStation": "skein",
        "geoFence": {"circles": circles, "polygons": polygons, "version": 2},
        "mission": {
            "cruiseSpeed": plan.cruise_mps.unwrap_or(15.0), "hoverSpeed": 5, "firmwareType": 12,
            "vehicleType": 1, "globalPlanAltitudeMode": 1, "version": 2,
            "plannedHomePosition": home, "items": items,
        },
        "rallyPoints": {"points": [], "version": 2},
    })
    .to_string()
}

impl Waypoint {
    /// A plain waypoint.
    #[must_use]
    pub fn new(at: LatLon, altitude_m: f64) -> Self {
        Self {
            command: NAV_WAYPOINT,
            at,
            altitude_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AVOID: &str =
        include_str!("../../configs/data/px4_multicopter_mission_geofence_avoid.plan");

    #[test]
    fn a_real_plan_with_fences() {
        let plan = read(AVOID).unwrap();
        assert_eq!((plan.keep_in.len(), plan.keep_out.len()), (1, 2));
        assert_eq!(plan.waypoints.len(), 4);
        assert_eq!(plan.notices.len(), 1, "{:?}", plan.notices);
        assert!(plan.notices[0].pointer.ends_with("/mission/items/4"));
        assert!(plan.home.is_some());
    }

    #[test]
    fn what_is_written_can_be_read() {
        let mut plan = read(AVOID).unwrap();
        plan.waypoints.push(Waypoint::new(
            LatLon {
                lat_deg: 47.1,
                lon_deg: 8.5,
            },
            30.0,
        ));
        let mut again = read(&write(&plan)).unwrap();
        // The landing item without a place is all that is lost, and it was noticed.
        again.notices = plan.notices.clone();
        assert_eq!(again, plan);
    }

    #[test]
    fn errors_name_the_place() {
        let says =
            |from: &str, to: &str| read(&AVOID.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(
            says("\"radius\":111.05361447891983", "\"radius\":-1")
                .contains("geoFence.circles[0].circle.radius: -1 is out of range")
        );
        assert!(
            says("47.3991036", "\"x\"")
                .contains("geoFence.polygons[0].polygon[0][0]: expected a number")
        );
        assert!(says("\"Plan\"", "\"Map\"").contains(": fileType: expected"));
        assert!(says("{\"UUID\"", "\"UUID\"").contains("line 1"));
        assert!(says("\"SimpleItem\"", "\"OddItem\"").contains("mission.items[0].type: "));
    }

    #[test]
    fn a_survey_gives_its_polygon() {
        let text = r#"{"fileType":"Plan","mission":{"items":[
            {"type":"ComplexItem","complexItemType":"survey","polygon":[[47,8],[47,8.1],[47.1,8.1]]},
            {"type":"ComplexItem","complexItemType":"StructureScan"}]},"geoFence":{"polygon":[],"version":1}}"#;
        let plan = read(text).unwrap();
        assert_eq!(plan.surveys.len(), 1);
        assert_eq!(plan.notices.len(), 3, "{:?}", plan.notices);
    }

    #[test]
    fn truncated_plans_never_panic() {
        for end in 0..AVOID.len() {
            if AVOID.is_char_boundary(end) {
                assert!(read(&AVOID[..end]).is_err() || end >= AVOID.trim_end().len());
            }
        }
    }
}
