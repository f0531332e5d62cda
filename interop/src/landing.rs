//! The landing pattern of a fixed wing in a QGroundControl plan: a circle on which it comes
//! down, and the glide from there to where it lands. Leaves to the caller whether it is clear.

use crate::json::{Error, Node};
use crate::place::LatLon;
use crate::plan::{lat_lon, version};

/// What QGroundControl calls the item.
pub(crate) const KIND: &str = "fwLandingPattern";

/// Versions that QGroundControl has written.
const VERSIONS: &[u32] = &[1, 2];

/// Radii of circles that are believed, metres.
const RADIUS_M: (f64, f64) = (1.0, 10_000.0);

/// Where and how a fixed wing lands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandingPattern {
    /// Where it touches down.
    pub land: LatLon,
    /// Altitude there, metres.
    pub land_altitude_m: f64,
    /// Middle of the circle on which it comes down; where it does not circle, where the
    /// glide begins.
    pub approach: LatLon,
    /// Altitude to which it comes down there, metres.
    pub approach_altitude_m: f64,
    /// Radius of the circle, metres; none where it does not circle.
    pub radius_m: Option<f64>,
    /// Whether it circles clockwise.
    pub clockwise: bool,
    /// Whether altitudes are above home, and not above the sea.
    pub above_home: bool,
}

/// A place with its altitude.
fn place(at: &Node<'_>) -> Result<(LatLon, f64), Error> {
    let items = at.items()?;
    let Some(altitude) = items.get(2) else {
        return Err(at.wrong("a place of a landing is [latitude, longitude, altitude]"));
    };
    Ok((lat_lon(at)?, altitude.finite()?))
}

/// Reads the item.
pub(crate) fn read(item: &Node<'_>) -> Result<LandingPattern, Error> {
    let old = version(item, VERSIONS, "a landing pattern")? == Some(1);
    let (land, land_altitude_m) = place(&item.need("landCoordinate")?)?;
    // Older versions call the middle of the circle so.
    let approach = match item.get("landingApproachCoordinate")? {
        Some(approach) => approach,
        None => item.need("loiterCoordinate")?,
    };
    let (approach, approach_altitude_m) = place(&approach)?;
    let circles = item.get("useLoiterToAlt")?.map(|n| n.flag()).transpose()?;
    let radius_m = item
        .need("loiterRadius")?
        .number(RADIUS_M.0, RADIUS_M.1, "metres")?;
    let above_home = if old {
        // QGroundControl takes two that differ as above home.
        let loiter = item.need("loiterAltitudeRelative")?.flag()?;
        let land = item.need("landingAltitudeRelative")?.flag()?;
        loiter || land
    } else {
        item.need("altitudesAreRelative")?.flag()?
    };
    Ok(LandingPattern {
        land,
        land_altitude_m,
        approach,
        approach_altitude_m,
        radius_m: circles.unwrap_or(true).then_some(radius_m),
        clockwise: item.need("loiterClockwise")?.flag()?,
        above_home,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAN: &str = r#"{"fileType":"Plan","mission":{"items":[
        {"type":"ComplexItem","complexItemType":"fwLandingPattern","version":2,
         "altitudesAreRelative":true,"landCoordinate":[47,8,0],"landingApproachCoordinate":[47.004,8,40],
         "loiterClockwise":false,"loiterRadius":75,"stopTakingPhotos":true,"stopVideoPhotos":true,
         "useLoiterToAlt":true,"valueSetIsDistance":false}]}}"#;

    fn landing(from: &str, to: &str) -> Result<LandingPattern, String> {
        let text = PLAN.replacen(from, to, 1);
        let plan = crate::plan::read(&text).map_err(|e| e.to_string())?;
        Ok(plan.landing.unwrap())
    }

    #[test]
    fn a_landing_pattern_is_read_in_both_versions() {
        let new = landing("", "").unwrap();
        assert_eq!((new.radius_m, new.clockwise), (Some(75.0), false));
        assert!(new.above_home && (new.approach_altitude_m - 40.0).abs() < 1e-9);
        let straight = landing("Alt\":true", "Alt\":false").unwrap();
        assert_eq!(straight.radius_m, None);
        let sea = landing("Relative\":true", "Relative\":false").unwrap();
        assert!(!sea.above_home);
        let old = PLAN
            .replacen("version\":2", "version\":1", 1)
            .replacen("landingApproachCoordinate", "loiterCoordinate", 1)
            .replacen(
                "altitudesAreRelative\":true",
                "loiterAltitudeRelative\":true,\"landingAltitudeRelative\":true",
                1,
            );
        let old = crate::plan::read(&old).unwrap().landing.unwrap();
        assert_eq!(old, new);
    }

    #[test]
    fn a_wrong_landing_pattern_is_named() {
        for (from, to, says) in [
            (
                "version\":2",
                "version\":3",
                "items[0].version: 3 is no known version of a landing pattern",
            ),
            (
                "[47,8,0]",
                "[47,8]",
                "items[0].landCoordinate: a place of a landing",
            ),
            (
                "[47,8,0]",
                "[47,8,null]",
                "items[0].landCoordinate[2]: expected a finite number",
            ),
            ("75", "-75", "items[0].loiterRadius: -75 is out of range"),
            ("75", "0", "items[0].loiterRadius: 0 is out of range"),
            ("landingApproachCoordinate", "x", "loiterCoordinate"),
            (
                "loiterClockwise\":false",
                "loiterClockwise\":0",
                "loiterClockwise: expected true or false",
            ),
        ] {
            let error = landing(from, to).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
    }
}
