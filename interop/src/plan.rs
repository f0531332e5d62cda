//! QGroundControl `.plan` files: geofence, surveys with their cameras, simple waypoints.
//! Leaves to the caller what a fence or a survey means for a mission, and writing to
//! [`crate::mission`].

use crate::Notice;
use crate::json::{Document, Error, Node};
use crate::landing::{self, LandingPattern};
use crate::place::{LatLon, Shape, orient};
use serde_json::Value;

/// The largest radius of a fence circle that is believed, metres: twice the
/// radius of the largest mission.
const MAX_CIRCLE_M: f64 = 40_000.0;

/// MAVLink command of a waypoint.
pub(crate) const NAV_WAYPOINT: i64 = 16;

/// Versions that QGroundControl has written, of everything that is read here.
mod versions {
    pub(super) const FILE: &[u32] = &[1];
    pub(super) const MISSION: &[u32] = &[2];
    pub(super) const FENCE: &[u32] = &[1, 2];
    pub(super) const FENCE_SHAPE: &[u32] = &[1];
    pub(super) const RALLY: &[u32] = &[1, 2];
    pub(super) const SURVEY: &[u32] = &[2, 3, 4, 5];
    pub(super) const TRANSECTS: &[u32] = &[1, 2];
    pub(super) const CAMERA: &[u32] = &[1, 2];
    pub(crate) const CORRIDOR: &[u32] = &[2];
}

pub(crate) use versions::CORRIDOR;

/// The first version of a survey whose grid and camera are where they are now.
const SURVEY_WITH_CAMERA: u32 = 4;

/// The largest lengths of a survey's grid and camera that are believed, metres.
const LONGEST_M: f64 = 10_000.0;

/// What QGroundControl calls a camera of which nothing is known but its footprint.
const MANUAL_CAMERA: &str = "Manual (no camera specs)";

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

/// A survey item.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// JSON pointer of the item.
    pub pointer: String,
    /// Its polygon, counter-clockwise.
    pub ring: Vec<LatLon>,
    /// How it is to be flown and seen, as far as the item says so.
    pub grid: SurveyGrid,
}

/// How a survey is to be flown and seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurveyGrid {
    /// Course of its lanes, degrees clockwise from north, from 0 up to 360.
    pub course_deg: Option<f64>,
    /// Height above home, metres: the camera's distance from the surface.
    pub height_m: Option<f64>,
    /// Distance between lanes, metres: the footprint across without what frames share.
    pub lane_m: Option<f64>,
    /// Distance between two frames along a lane, metres: the footprint along without what
    /// frames share. `None` where the camera is not triggered.
    pub trigger_m: Option<f64>,
    /// Share of the footprint across that two lanes share, percent.
    pub side_overlap_percent: Option<f64>,
    /// Share of the footprint along that two frames share, percent.
    pub frontal_overlap_percent: Option<f64>,
    /// How far lanes run out straight beyond the area before a turn, metres.
    pub turn_around_m: Option<f64>,
    /// Whether pictures are taken in turns too.
    pub pictures_in_turns: bool,
    /// Whether the area is flown a second time, with lanes across the first ones.
    pub refly: bool,
    /// What the camera is called.
    pub camera: Option<String>,
    /// Whether the camera's lens is known, so that its footprint grows with the height.
    pub lens_known: bool,
}

/// What a plan holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanFile {
    /// Fences that must not be left.
    pub keep_in: Vec<Shape>,
    /// Fences that must not be entered.
    pub keep_out: Vec<Shape>,
    /// Survey items.
    pub surveys: Vec<Survey>,
    /// How a fixed wing lands; the first of several.
    pub landing: Option<LandingPattern>,
    /// Simple items that have a place.
    pub waypoints: Vec<Waypoint>,
    /// Where the vehicle starts, as planned.
    pub home: Option<LatLon>,
    /// Altitude of that place above the sea, metres.
    pub home_altitude_m: Option<f64>,
    /// Cruise airspeed as planned, m/s.
    pub cruise_mps: Option<f64>,
    /// Speed of a multicopter as planned, m/s.
    pub hover_mps: Option<f64>,
    /// MAVLink number of the autopilot (`MAV_AUTOPILOT`).
    pub firmware_type: Option<u32>,
    /// MAVLink number of the vehicle's kind (`MAV_TYPE`).
    pub vehicle_type: Option<u32>,
    /// The fence as it stands in the file, where it is of a version that is still read.
    pub fence: Option<Value>,
    /// The rally points as they stand in the file.
    pub rally: Option<Value>,
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

/// The version of a part of the file, if it states one.
///
/// # Errors
/// When it is none that is known; names them all.
pub(crate) fn version(at: &Node<'_>, known: &[u32], what: &str) -> Result<Option<u32>, Error> {
    let Some(node) = at.get("version")? else {
        return Ok(None);
    };
    let stated = node.as_number().ok_or_else(|| {
        let found = node.to_json();
        node.wrong(format!("{found} is no version of {what}"))
    })?;
    let same = |v: &&u32| (f64::from(**v) - stated).abs() < 1e-9;
    if let Some(found) = known.iter().find(same) {
        return Ok(Some(*found));
    }
    let known: Vec<String> = known.iter().map(ToString::to_string).collect();
    Err(node.wrong(format!(
        "{stated} is no known version of {what}; known is {}: save the plan with a QGroundControl that writes it",
        known.join(" or ")
    )))
}

fn fence(at: &Node<'_>, out: &mut PlanFile) -> Result<(), Error> {
    let old = version(at, versions::FENCE, "a fence")? == Some(1);
    out.fence = (!old).then(|| at.to_json());
    let mut shapes = Vec::new();
    if let Some(polygons) = at.get("polygons")? {
        for p in polygons.items()? {
            version(&p, versions::FENCE_SHAPE, "a fence's polygon")?;
            shapes.push((
                p.need("inclusion")?.flag()?,
                Shape::Ring(ring(&p.need("polygon")?)?),
            ));
        }
    }
    if let Some(circles) = at.get("circles")? {
        for c in circles.items()? {
            version(&c, versions::FENCE_SHAPE, "a fence's circle")?;
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
            text: "the breach return point plays no part in planning".to_owned(),
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

fn survey(item: &Node<'_>, out: &mut PlanFile) -> Result<(), Error> {
    let version = version(item, versions::SURVEY, "a survey")?;
    let mut tell = |text: &str| {
        out.notices.push(Notice {
            pointer: item.pointer(),
            text: text.to_owned(),
        });
    };
    let mut grid = SurveyGrid::default();
    match item.get("TransectStyleComplexItem")? {
        Some(transects) if version.is_none_or(|v| v >= SURVEY_WITH_CAMERA) => {
            grid = survey_grid(item, &transects, &mut tell)?;
            tell("the survey's transects are planned anew");
        }
        _ => {
            tell("the survey's polygon alone is used: it states no camera where one is looked for")
        }
    }
    out.surveys.push(Survey {
        pointer: item.pointer(),
        ring: ring(&item.need("polygon")?)?,
        grid,
    });
    Ok(())
}

/// Course, camera and height of a survey.
fn survey_grid(
    item: &Node<'_>,
    transects: &Node<'_>,
    tell: &mut impl FnMut(&str),
) -> Result<SurveyGrid, Error> {
    version(transects, versions::TRANSECTS, "a TransectStyleComplexItem")?;
    let mut grid = SurveyGrid::default();
    if let Some(angle) = item.get("angle")? {
        let course_deg = angle.number(-360.0, 360.0, "degrees")?.rem_euclid(360.0);
        grid.course_deg = Some(course_deg);
    }
    if let Some(refly) = transects.get("Refly90Degrees")? {
        grid.refly = refly.flag()?;
    }
    if let Some(hover) = transects.get("HoverAndCapture")?
        && hover.flag()?
    {
        tell("HoverAndCapture is ignored: nobody hovers");
    }
    if let Some(in_turns) = transects.get("CameraTriggerInTurnAround")? {
        grid.pictures_in_turns = in_turns.flag()?;
    }
    if let Some(out) = transects.get("TurnAroundDistance")? {
        let out_m = out.number(0.0, LONGEST_M, "metres")?;
        grid.turn_around_m = Some(out_m).filter(|m| *m > 0.0);
    }
    let Some(camera) = transects.get("CameraCalc")? else {
        return Ok(grid);
    };
    version(&camera, versions::CAMERA, "a CameraCalc")?;
    let length = |name: &str| match camera.get(name)? {
        Some(n) => Ok(Some(n.number(0.0, LONGEST_M, "metres")?).filter(|m| *m > 0.0)),
        None => Ok(None),
    };
    let percent = |name: &str| match camera.get(name)? {
        Some(n) => Ok(Some(n.number(-1_000.0, 100.0, "percent")?)),
        None => Ok(None),
    };
    grid.lane_m = length("AdjustedFootprintSide")?;
    grid.trigger_m = length("AdjustedFootprintFrontal")?;
    grid.side_overlap_percent = percent("SideOverlap")?;
    grid.frontal_overlap_percent = percent("FrontalOverlap")?;
    if let Some(name) = camera.get("CameraName")? {
        grid.camera = Some(name.text()?.to_owned());
        grid.lens_known = name.text()? != MANUAL_CAMERA && camera.get("FocalLength")?.is_some();
    }
    let height_m = length("DistanceToSurface")?;
    match above(&camera)? {
        Above::Home => grid.height_m = height_m,
        Above::Terrain => {
            grid.height_m = height_m;
            tell("the survey's height above the terrain is flown above home: no terrain is known");
        }
        Above::Sea => tell("the survey's height is one above the sea: not used; see --altitude-m"),
    }
    Ok(grid)
}

/// What a survey's height is measured from.
enum Above {
    Home,
    Sea,
    Terrain,
}

fn above(camera: &Node<'_>) -> Result<Above, Error> {
    // QGroundControl's AltitudeMode: 1 relative to home, 2 above the sea, the others above
    // the terrain.
    if let Some(mode) = camera.get("DistanceMode")? {
        return Ok(match mode.whole(0, 5, "QGroundControl's AltitudeMode")? {
            0 | 1 | 5 => Above::Home,
            2 => Above::Sea,
            _ => Above::Terrain,
        });
    }
    match camera.get("DistanceToSurfaceRelative")? {
        Some(relative) if !relative.flag()? => Ok(Above::Sea),
        _ => Ok(Above::Home),
    }
}

fn mission(at: &Node<'_>, out: &mut PlanFile) -> Result<(), Error> {
    version(at, versions::MISSION, "a mission")?;
    if let Some(home) = at.get("plannedHomePosition")? {
        out.home = Some(lat_lon(&home)?);
        out.home_altitude_m = match home.items()?.get(2) {
            Some(altitude) if !altitude.is_null() => Some(altitude.finite()?),
            _ => None,
        };
    }
    let speed = |name: &str| match at.get(name)? {
        Some(speed) => Ok(Some(speed.finite()?)),
        None => Ok(None),
    };
    out.cruise_mps = speed("cruiseSpeed")?;
    out.hover_mps = speed("hoverSpeed")?;
    let number = |name: &str| match at.get(name)? {
        Some(kind) => Ok(Some(kind.whole(0, 255, "a MAVLink number")?)),
        None => Ok(None),
    };
    out.firmware_type = number("firmwareType")?;
    out.vehicle_type = number("vehicleType")?;
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
                    survey(&item, out)?;
                } else if complex == landing::KIND && out.landing.is_none() {
                    out.landing = Some(landing::read(&item)?);
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
    version(root, versions::FILE, "a plan")?;
    let mut out = PlanFile::default();
    if let Some(f) = root.get("geoFence")? {
        fence(&f, &mut out)?;
    }
    if let Some(m) = root.get("mission")? {
        mission(&m, &mut out)?;
    }
    if let Some(rally) = root.get("rallyPoints")? {
        version(&rally, versions::RALLY, "rally points")?;
        out.rally = Some(rally.to_json());
        let points = rally
            .get("points")?
            .map(|p| p.items())
            .transpose()?
            .map_or(0, |p| p.len());
        if points > 0 {
            out.notices.push(Notice {
                pointer: rally.pointer(),
                text: format!("{points} rally point(s) play no part in planning"),
            });
        }
    }
    Ok(out)
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
        assert!((plan.home_altitude_m.unwrap() - 489.338).abs() < 1e-9);
        assert_eq!((plan.firmware_type, plan.vehicle_type), (Some(12), Some(2)));
        let file: Value = serde_json::from_str(AVOID).unwrap();
        assert_eq!(plan.fence.as_ref(), Some(&file["geoFence"]));
        assert_eq!(plan.rally.as_ref(), Some(&file["rallyPoints"]));
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
        assert_eq!(plan.surveys[0].grid, SurveyGrid::default());
        assert_eq!(plan.notices.len(), 3, "{:?}", plan.notices);
        assert_eq!(plan.fence, None);
    }

    /// A survey as QGroundControl writes it.
    const SURVEY: &str = r#"{"fileType":"Plan","version":1,"mission":{"version":2,"items":[
        {"type":"ComplexItem","complexItemType":"survey","version":5,"angle":-30,
         "polygon":[[47,8],[47,8.1],[47.1,8.1]],"TransectStyleComplexItem":{"version":2,
         "TurnAroundDistance":10,"CameraTriggerInTurnAround":true,"Refly90Degrees":false,"CameraCalc":{"version":2,
         "AdjustedFootprintSide":40.5,"AdjustedFootprintFrontal":20,"DistanceToSurface":80,
         "DistanceMode":1,"SideOverlap":70,"FrontalOverlap":75,"CameraName":"Sony ILCE-QX1",
         "FocalLength":16}}}]},"geoFence":{"version":2},"rallyPoints":{"points":[],"version":2}}"#;

    #[test]
    fn a_survey_says_how_it_is_flown_and_seen() {
        let plan = read(SURVEY).unwrap();
        let grid = &plan.surveys[0].grid;
        assert_eq!(
            *grid,
            SurveyGrid {
                course_deg: Some(330.0),
                height_m: Some(80.0),
                lane_m: Some(40.5),
                trigger_m: Some(20.0),
                side_overlap_percent: Some(70.0),
                frontal_overlap_percent: Some(75.0),
                turn_around_m: Some(10.0),
                pictures_in_turns: true,
                refly: false,
                camera: Some("Sony ILCE-QX1".to_owned()),
                lens_known: true,
            }
        );
        let of = |from: &str, to: &str| {
            let plan = read(&SURVEY.replacen(from, to, 1)).unwrap();
            (plan.surveys[0].grid.clone(), plan.notices)
        };
        let (grid, _) = of("Sony ILCE-QX1", MANUAL_CAMERA);
        assert!(!grid.lens_known);
        assert_eq!(
            of("\"DistanceMode\":1", "\"DistanceMode\":2").0.height_m,
            None
        );
        let (grid, notices) = of("\"DistanceMode\":1", "\"DistanceMode\":3");
        assert_eq!(grid.height_m, Some(80.0));
        assert!(notices.iter().any(|n| n.text.contains("terrain")));
        let before = "\"DistanceToSurfaceRelative\":false";
        assert_eq!(of("\"DistanceMode\":1", before).0.height_m, None);
        assert!(of("90Degrees\":false", "90Degrees\":true").0.refly);
        assert_eq!(of("Frontal\":20", "Frontal\":0").0.trigger_m, None);
        let (grid, notices) = of("\"version\":5", "\"version\":3");
        assert_eq!(grid, SurveyGrid::default());
        assert!(notices.iter().any(|n| n.text.contains("polygon alone")));
    }

    #[test]
    fn versions_that_nobody_wrote_are_refused() {
        for (from, to, says) in [
            (
                "n\":1,",
                "n\":9,",
                "version: 9 is no known version of a plan; known is 1",
            ),
            (
                "\"version\":5",
                "\"version\":9",
                "mission.items[0].version: 9 is no known version of a survey; known is 2 or 3 or 4 or 5",
            ),
            (
                "\"version\":5",
                "\"version\":\"5\"",
                "items[0].version: \"5\" is no version of a survey",
            ),
            (
                "mission\":{\"version\":2",
                "mission\":{\"version\":1",
                "mission.version: 1 is",
            ),
            (
                "Item\":{\"version\":2",
                "Item\":{\"version\":7",
                "TransectStyleComplexItem.version: 7 is",
            ),
            (
                "Calc\":{\"version\":2",
                "Calc\":{\"version\":3",
                "CameraCalc.version: 3 is",
            ),
            (
                "geoFence\":{\"version\":2",
                "geoFence\":{\"version\":3",
                "geoFence.version: 3 is",
            ),
            (
                "[],\"version\":2",
                "[],\"version\":2.5",
                "rallyPoints.version: 2.5 is",
            ),
            ("-30", "-400", "items[0].angle: -400 is out of range"),
        ] {
            let text = SURVEY.replacen(from, to, 1);
            assert_ne!(text, SURVEY, "{from}");
            let error = read(&text).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
        let shape = AVOID.replacen(
            "\"inclusion\":false,\"version\":1",
            "\"inclusion\":false,\"version\":4",
            1,
        );
        if shape != AVOID {
            let error = read(&shape).unwrap_err().to_string();
            assert!(
                error.contains("geoFence.circles[0].version: 4 is"),
                "{error}"
            );
        }
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
