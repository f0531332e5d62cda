//! How the flights of a plan come down, in the words of files for upload (D2.7 §2.3); the
//! landings are [`skein_survey::landing`]'s.

use super::corners::waypoints;
use super::output::Printed;
use super::site::Site;
use super::upload::tightest_m;
use skein_geometry::frame::{Origin, Point};
use skein_geometry::math::PI;
use skein_geometry::{NoFlyZones, Polygon};
use skein_interop::landing::LandingPattern;
use skein_interop::mission::Item;
use skein_interop::place::{LatLon, Side, to_plane};
use skein_survey::flown::Airspace;
use skein_survey::landing::{Landing, Pattern, glide_m, made};

/// Height above home from which a glide that is made begins, metres: usual for small fixed
/// wings. A flight that is lower begins it there.
const APPROACH_M: f64 = 40.0;

/// Angle of a glide that is made, radians: 6°, usual for small fixed wings.
const GLIDE_RAD: f64 = 6.0 * PI / 180.0;

/// How a UAV comes down.
pub(super) enum Down {
    /// Where it is, on its rotors.
    Upright,
    /// From a circle and by a glide.
    Glides(Glides),
    /// Not at all: this is why.
    Not(String),
}

/// A landing with its heights.
pub(super) struct Glides {
    landing: Landing,
    approach_height_m: f64,
    land_height_m: f64,
    /// Why it is not the one of the file.
    instead: Option<String>,
}

impl Glides {
    /// The items of it: the way to the circle, the circle, the landing.
    pub(super) fn items(
        &self,
        to: impl Fn(Point) -> LatLon,
        (height_m, acceptance_m): (f64, f64),
        air: Option<&Airspace>,
    ) -> Vec<Item> {
        let pieces = self.landing.way.segments().iter();
        let points = pieces.flat_map(|piece| waypoints(piece, air).0);
        let way = points.map(|p| Item::Waypoint {
            at: to(p),
            height_m,
            acceptance_m,
        });
        let Pattern {
            land,
            centre,
            radius_m,
            clockwise,
        } = self.landing.pattern;
        let down = [
            Item::LandStart,
            Item::LoiterTo {
                at: to(centre),
                height_m: self.approach_height_m,
                radius_m: if clockwise { radius_m } else { -radius_m },
            },
            Item::Touchdown {
                at: to(land),
                height_m: self.land_height_m,
            },
        ];
        way.chain(down).collect()
    }
}

/// How the UAV of a flight comes down.
pub(super) fn of(flight: &Printed, origin: Origin, site: &Site) -> Down {
    if !site.vehicle.is_fixed_wing() {
        return Down::Upright;
    }
    glide(flight, origin, site).map_or_else(Down::Not, Down::Glides)
}

/// What is worth saying of it.
pub(super) fn notice(flight: &Printed, origin: Origin, site: &Site) -> Option<String> {
    let name = &flight.name;
    match of(flight, origin, site) {
        Down::Upright => None,
        Down::Not(why) => Some(format!(
            "{name} does not land, it returns to launch: {why}; draw a landing before the flight"
        )),
        Down::Glides(Glides {
            instead: Some(why), ..
        }) => Some(format!(
            "{name} lands at its start, not as the file says: {why}"
        )),
        Down::Glides(_) if site.landing.is_some() => None,
        Down::Glides(_) => Some(format!(
            "{name} lands at its start, by a glide of 6°: look at it before the flight"
        )),
    }
}

/// The landing of the file, or one that is made; or why there is none.
fn glide(flight: &Printed, origin: Origin, site: &Site) -> Result<Glides, String> {
    let end = flight.legs.last().and_then(|leg| leg.curve.end());
    let (Some(end), Some(radius_m)) = (end, tightest_m(flight)) else {
        return Err("its turns are not known".to_owned());
    };
    let home = flight.track.first().copied().unwrap_or(Point::origin());
    let router = airspace(origin, site, [end.position(), home])?.router(radius_m);
    let drawn: Option<Result<_, String>> = site.landing.as_ref().map(|drawn| {
        let (pattern, heights_m) = drawn_pattern(drawn, origin, site)?;
        let landing = pattern.landing(&router, end).map_err(|e| e.to_string())?;
        Ok((landing, heights_m))
    });
    let instead = match drawn {
        Some(Ok((landing, (approach_height_m, land_height_m)))) => {
            return Ok(Glides {
                landing,
                approach_height_m,
                land_height_m,
                instead: None,
            });
        }
        Some(Err(why)) => Some(why),
        None => None,
    };
    let approach_height_m = flight.altitude_m.min(APPROACH_M);
    let glide_m = glide_m(approach_height_m, GLIDE_RAD);
    let Some(landing) = made(&router, end, home, glide_m, site.wind_mps) else {
        let none = format!("no glide of {glide_m:.0} m to its start with a circle is clear");
        return Err(match instead {
            Some(why) => format!("the file's landing: {why}; {none}"),
            None => none,
        });
    };
    Ok(Glides {
        landing,
        approach_height_m,
        land_height_m: 0.0,
        instead,
    })
}

/// Zones and fences of a site.
pub(super) fn airspace(
    origin: Origin,
    site: &Site,
    places: impl IntoIterator<Item = Point>,
) -> Result<Airspace, String> {
    let (mut zones, mut fences) = (Vec::new(), Vec::new());
    for (inclusion, shape) in &site.shapes {
        let side = if *inclusion {
            Side::Inside
        } else {
            Side::Outside
        };
        let ring = shape.to_plane(origin, side).map_err(|e| e.to_string())?;
        let polygon = Polygon::new(ring).map_err(|e| e.to_string())?;
        if *inclusion {
            fences.push(polygon);
        } else {
            zones.push(polygon);
        }
    }
    let zones = NoFlyZones::new(zones);
    let air = Airspace::new(&zones, &fences, places.into_iter(), site.clearance_m);
    air.map_err(|e| e.to_string())
}

/// A pattern of a file with its heights above home, of the circle and of the landing.
fn drawn_pattern(
    drawn: &LandingPattern,
    origin: Origin,
    site: &Site,
) -> Result<(Pattern, (f64, f64)), String> {
    let Some(radius_m) = drawn.radius_m else {
        return Err("it has no circle to come down on".to_owned());
    };
    let home_m = match (drawn.above_home, site.home_altitude_m) {
        (true, _) => 0.0,
        (false, Some(altitude_m)) => altitude_m,
        (false, None) => {
            return Err(
                "its altitudes are above the sea, and that of home is not known".to_owned(),
            );
        }
    };
    let place = |at: LatLon| to_plane(origin, at).map_err(|e| e.to_string());
    let pattern = Pattern {
        land: place(drawn.land)?,
        centre: place(drawn.approach)?,
        radius_m,
        clockwise: drawn.clockwise,
    };
    let approach_m = drawn.approach_altitude_m - home_m;
    let land_m = drawn.land_altitude_m - home_m;
    if approach_m <= land_m {
        return Err("its circle is no higher than where it lands".to_owned());
    }
    Ok((pattern, (approach_m, land_m)))
}
