//! What one UAV uploads: take-off, passes with the camera on, turns, and the end
//! (D2.7 §3.4–3.6).
//!
//! An autopilot flies from waypoint to waypoint. A turn becomes waypoints on its circle, so
//! close that no chord leaves it by more than a thirtieth of its radius, or closer, or on lines
//! that touch it, where chords would come too near to a zone ([`corners`](super::corners)).

use super::corners::waypoints;
use super::landing::{self, Down};
use super::output::Printed;
use super::site::Site;
use clap::{Args, ValueEnum};
use skein_geometry::Segment;
use skein_geometry::frame::{Origin, Point};
use skein_interop::mission::{Item, Mission};
use skein_interop::place::{LatLon, from_plane, to_plane};
use skein_survey::flown::Airspace;

/// Points nearer to each other than this are one, metres.
const COINCIDENT_M: f64 = 1e-3;

/// A first waypoint nearer to home than this is left out: a take-off leads somewhere, metres.
const OVER_HOME_M: f64 = 2.0;

/// A waypoint counts as reached from this part of the tightest turn: half of the way to the
/// next one on its circle.
const ACCEPTED_SHARE: f64 = 0.25;

/// Limits of the distance from which a waypoint counts as reached, metres: a receiver's
/// error, and what no pass begins late by.
const ACCEPTED_M: (f64, f64) = (2.0, 20.0);

/// Starts nearer to home than this are home, metres.
const SAME_PLACE_M: f64 = 100.0;

/// The same where nobody turns, and the radius of a loiter there, metres.
const ACCEPTED_WITHOUT_TURNS_M: f64 = 10.0;
const LOITER_RADIUS_M: f64 = 60.0;

/// What is written into `.plan` files beside the flights.
#[derive(Clone, Debug, Default, Args)]
pub struct UploadArgs {
    /// In `.plan` files: altitude of home above the sea, metres; by default that of the
    /// file's home position, else 0.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub home_altitude_m: Option<f64>,
    /// In `.plan` files: distance between two pictures, metres; by default what the file's
    /// survey says, else half of what a picture sees along the track.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub trigger_m: Option<f64>,
    /// In `.plan` files: what a UAV does when it is back; by default it lands by the file's
    /// landing pattern, and returns to launch where there is none.
    #[arg(long, value_enum)]
    pub end: Option<End>,
}

impl UploadArgs {
    /// What a UAV does when it is back.
    fn end(&self, site: &Site) -> End {
        self.end.unwrap_or(if site.landing.is_some() {
            End::Land
        } else {
            End::Rtl
        })
    }
}

/// What a UAV does when it is back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum End {
    /// What the autopilot does on return to launch.
    Rtl,
    /// Lands: by the file's landing pattern where that is clear, else from a circle and by a
    /// glide to its start that are planned.
    Land,
    /// Circles over its start until told otherwise.
    Loiter,
}

/// The mission of a flight.
pub(super) fn mission(
    flight: &Printed,
    origin: Origin,
    site: &Site,
    asked: &UploadArgs,
) -> Mission {
    let to = |p: Point| from_plane(origin, p);
    let start = flight.track.first().copied().unwrap_or(Point::origin());
    let home = to(start);
    let height_m = flight.altitude_m;
    let radius_m = tightest_m(flight);
    let accepted = radius_m.map(|r| (r * ACCEPTED_SHARE).clamp(ACCEPTED_M.0, ACCEPTED_M.1));
    let mut way = Way {
        items: vec![Item::Airspeed {
            mps: flight.speed_mps,
        }],
        last: start,
        height_m,
        acceptance_m: accepted.unwrap_or(ACCEPTED_WITHOUT_TURNS_M),
        air: airspace_of(flight, origin, site),
        to,
    };
    if flight.legs.is_empty() {
        for p in &flight.track {
            way.fly(*p);
        }
    } else {
        way.legs(
            flight,
            asked.trigger_m.or(site.trigger_m).or(flight.trigger_m),
            site.pictures_in_turns,
        );
    }
    let (acceptance_m, air) = (way.acceptance_m, way.air);
    let mut items = way.items;
    // A fixed wing climbs towards the place of its take-off, and has no way to where it is.
    let first = items.iter().find_map(|item| match item {
        Item::Waypoint { at, .. } => Some(*at),
        _ => None,
    });
    let at = first.unwrap_or(home);
    items.insert(0, Item::Takeoff { at, height_m });
    match asked.end(site) {
        End::Rtl => items.push(Item::ReturnToLaunch),
        End::Land => items.extend(match landing::of(flight, origin, site) {
            Down::Upright => vec![Item::Land { at: home }],
            Down::Glides(down) => down.items(to, (height_m, acceptance_m), air.as_ref()),
            Down::Not(_) => vec![Item::ReturnToLaunch],
        }),
        End::Loiter => items.push(Item::Loiter {
            at: home,
            height_m,
            radius_m: radius_m.unwrap_or(LOITER_RADIUS_M),
        }),
    }
    Mission {
        home,
        home_altitude_m: asked
            .home_altitude_m
            .or(site.home_altitude_m)
            .unwrap_or(0.0),
        cruise_mps: flight.speed_mps,
        vehicle: site.vehicle,
        items,
        fence: site.fence.clone(),
        rally: site.rally.clone(),
    }
}

/// Zones and fences of a site, round all of a flight.
fn airspace_of(flight: &Printed, origin: Origin, site: &Site) -> Option<Airspace> {
    let ends = flight.legs.iter().filter_map(|leg| leg.curve.end());
    let places = ends.map(|end| end.position()).chain(flight.track.clone());
    landing::airspace(origin, site, places).ok()
}

/// What is worth saying about the files of some flights.
pub(super) fn notices(
    flights: &[Printed],
    origin: Origin,
    site: &Site,
    asked: &UploadArgs,
) -> Vec<String> {
    let flying = || flights.iter().filter(|flight| flight.flies());
    let mut notices = Vec::new();
    if asked.home_altitude_m.is_none() {
        let elsewhere = flying().find(|flight| {
            let start = flight.track.first().copied().unwrap_or(Point::origin());
            let home = site.home.and_then(|home| to_plane(origin, home).ok());
            home.is_none_or(|home| (home - start).norm() > SAME_PLACE_M)
        });
        match (site.home_altitude_m, elsewhere) {
            (None, _) => notices.push(
                "the altitude of home is not known: 0 is written; see --home-altitude-m".to_owned(),
            ),
            (Some(altitude_m), Some(flight)) => notices.push(format!(
                "{} does not start at the file's home, whose altitude of {altitude_m} m is written; see --home-altitude-m",
                flight.name
            )),
            _ => {}
        }
    }
    if !(site.vehicle.is_fixed_wing() || site.vehicle.is_vtol()) {
        notices.push(format!(
            "vehicleType {} of the file is kept, though it is no fixed wing",
            site.vehicle.vehicle_type
        ));
    }
    let blind: Vec<&str> = flying()
        .filter(|flight| !flight.legs.iter().any(|leg| leg.sees))
        .map(|flight| flight.name.as_str())
        .collect();
    if !blind.is_empty() {
        notices.push(format!(
            "no camera commands for {}: which parts of its way see is not known",
            blind.join(", ")
        ));
    }
    for flight in flying() {
        let air = airspace_of(flight, origin, site);
        let pieces = flight.legs.iter().flat_map(|leg| leg.curve.segments());
        let is_near = |piece: &&Segment| !waypoints(piece, air.as_ref()).1;
        if let n @ 1.. = pieces.filter(is_near).count() {
            notices.push(format!(
                "{}: {n} pieces cannot be written as straight legs with the clearance",
                flight.name
            ));
        }
    }
    if asked.end(site) == End::Land {
        for flight in flying() {
            notices.extend(landing::notice(flight, origin, site));
        }
        if flying().count() > 1 && site.vehicle.is_fixed_wing() {
            notices.push("all land in one place: one after the other".to_owned());
        }
    }
    notices
}

/// Radius of the tightest turn, metres.
pub(super) fn tightest_m(flight: &Printed) -> Option<f64> {
    let curved = flight
        .legs
        .iter()
        .map(|leg| leg.curve.max_curvature_per_m());
    let most = curved.fold(0.0, f64::max);
    (most > 0.0).then(|| 1.0 / most)
}

/// Items that follow on each other.
struct Way<F> {
    items: Vec<Item>,
    last: Point,
    height_m: f64,
    acceptance_m: f64,
    /// What is kept clear of; none where it is not known.
    air: Option<Airspace>,
    to: F,
}

impl<F: Fn(Point) -> LatLon> Way<F> {
    /// Flies to a point, unless it is there.
    fn fly(&mut self, p: Point) {
        let of_way = |item: &Item| matches!(item, Item::Waypoint { .. });
        let there_m = if self.items.iter().any(of_way) {
            COINCIDENT_M
        } else {
            OVER_HOME_M
        };
        if (p - self.last).norm() < there_m {
            return;
        }
        self.last = p;
        self.items.push(Item::Waypoint {
            at: (self.to)(p),
            height_m: self.height_m,
            acceptance_m: self.acceptance_m,
        });
    }

    /// Flies all legs, with pictures along those that see, or from the first to the last of them.
    fn legs(&mut self, flight: &Printed, trigger_m: Option<f64>, in_turns: bool) {
        let mut seeing = false;
        let flown = || flight.legs.iter().filter(|leg| !leg.curve.is_empty());
        let mut left = flown().filter(|leg| leg.sees).count();
        for leg in flown() {
            let goes_on = in_turns && seeing && left > 0;
            left -= usize::from(leg.sees);
            if let Some(start) = leg.curve.start() {
                self.fly(start.position());
            }
            let sees = leg.sees || goes_on;
            if sees != seeing {
                self.trigger(trigger_m, sees);
                seeing = sees;
            }
            for piece in leg.curve.segments() {
                let (way, _) = waypoints(piece, self.air.as_ref());
                way.into_iter().for_each(|p| self.fly(p));
            }
        }
        if seeing {
            self.trigger(trigger_m, false);
        }
    }

    fn trigger(&mut self, trigger_m: Option<f64>, on: bool) {
        if let Some(distance_m) = trigger_m {
            let distance_m = if on { distance_m } else { 0.0 };
            self.items.push(Item::Trigger { distance_m });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Map;
    use skein_geometry::Curve;
    use skein_geometry::frame::Pose;
    use skein_geometry::math::PI;
    use skein_survey::flight::Leg;

    const ORIGIN: Origin = Origin {
        lat_deg: 47.0,
        lon_deg: 8.0,
    };

    /// A way out, a pass, a half circle, a pass back, and home.
    fn flight() -> Printed {
        let start = Pose::new(Point::origin(), 0.0);
        let mut at = start;
        let mut leg = |pieces: &[(f64, f64)], sees: bool| {
            let curve = Curve::from_pieces(at, pieces);
            at = curve.end().unwrap();
            Leg { curve, sees }
        };
        let half_m = PI * 40.0;
        let legs = vec![
            leg(&[(0.0, 100.0)], false),
            leg(&[(0.0, 300.0)], true),
            leg(&[(1.0 / 40.0, half_m)], false),
            leg(&[(0.0, 300.0)], true),
            leg(&[(0.0, 100.0), (1.0 / 40.0, half_m)], false),
        ];
        Printed {
            name: "a".to_owned(),
            track: vec![Point::origin(), Point::new(400.0, 0.0), Point::origin()],
            altitude_m: 60.0,
            speed_mps: 15.0,
            trigger_m: Some(25.0),
            legs,
            told: Map::new(),
            details: Map::new(),
        }
    }

    #[test]
    fn the_camera_works_along_passes_and_turns_keep_to_their_circle() {
        let mission = mission(&flight(), ORIGIN, &Site::default(), &UploadArgs::default());
        let mut said = String::new();
        let mut on_circle = 0;
        for item in &mission.items {
            said.push(match item {
                Item::Takeoff { at, .. } => {
                    let towards = ORIGIN.to_enu(at.lat_deg, at.lon_deg);
                    assert!((towards - Point::new(100.0, 0.0)).norm() < 1e-3);
                    'T'
                }
                Item::Airspeed { .. } => 'v',
                Item::Waypoint {
                    at, acceptance_m, ..
                } => {
                    assert!((acceptance_m - 10.0).abs() < 1e-9);
                    let (x, y) = {
                        let p = ORIGIN.to_enu(at.lat_deg, at.lon_deg);
                        (p.x, p.y)
                    };
                    let from_centre = |cx: f64| ((x - cx).hypot(y - 40.0) - 40.0).abs();
                    on_circle += usize::from(from_centre(400.0).min(from_centre(0.0)) < 1e-3);
                    'w'
                }
                Item::Trigger { distance_m } if *distance_m > 0.0 => '(',
                Item::Trigger { .. } => ')',
                Item::ReturnToLaunch => 'R',
                Item::Land { .. } | Item::LandStart | Item::Touchdown { .. } => 'L',
                Item::LoiterTo { .. } => 'O',
                Item::Loiter { .. } => 'o',
            });
        }
        // Out; a pass; six steps round; a pass; to above the start and six steps round.
        assert_eq!(said, "Tvw(w)wwwwww(w)wwwwwwwR");
        assert!(on_circle >= 12, "{on_circle}");
    }

    #[test]
    fn the_end_and_the_trigger_are_those_that_are_asked_for() {
        let trigger = |site: &Site, asked: &UploadArgs| {
            let items = mission(&flight(), ORIGIN, site, asked).items;
            let first = items.iter().find_map(|item| match item {
                Item::Trigger { distance_m } => Some(*distance_m),
                _ => None,
            });
            (first.unwrap(), *items.last().unwrap())
        };
        let mut site = Site::default();
        let mut asked = UploadArgs::default();
        assert_eq!(trigger(&site, &asked), (25.0, Item::ReturnToLaunch));
        site.trigger_m = Some(18.0);
        asked.end = Some(End::Loiter);
        let (distance_m, end) = trigger(&site, &asked);
        assert!((distance_m - 18.0).abs() < 1e-9);
        assert!(matches!(end, Item::Loiter { radius_m, .. } if (radius_m - 40.0).abs() < 1e-9));
        asked.trigger_m = Some(9.0);
        asked.end = Some(End::Land);
        let (distance_m, end) = trigger(&site, &asked);
        assert!((distance_m - 9.0).abs() < 1e-9);
        assert!(matches!(end, Item::Touchdown { .. }));
        site.vehicle.vehicle_type = 22;
        assert!(matches!(trigger(&site, &asked).1, Item::Land { .. }));
    }

    #[test]
    fn pictures_go_on_in_turns_where_a_survey_asks_for_it() {
        let triggers = |pictures_in_turns: bool| {
            let site = Site {
                pictures_in_turns,
                ..Site::default()
            };
            let items = mission(&flight(), ORIGIN, &site, &UploadArgs::default()).items;
            let of = |item: &Item| matches!(item, Item::Trigger { .. });
            let first = items.iter().position(of).unwrap();
            let last = items.iter().rposition(of).unwrap();
            (items.iter().filter(|i| of(i)).count(), last - first)
        };
        let (apart, together) = (triggers(false), triggers(true));
        assert_eq!((apart.0, together.0), (4, 2));
        // The camera goes on and off at the same places, and only there.
        assert_eq!(together.1, apart.1 - 2);
    }

    #[test]
    fn a_take_off_leads_away_from_home() {
        let mut near = flight();
        let start = Pose::new(Point::origin(), 0.0);
        let (first, rest) = (
            Curve::from_pieces(start, &[(0.0, 0.5)]),
            near.legs.remove(0),
        );
        let then = Curve::from_pieces(first.end().unwrap(), &[(0.0, 99.5)]);
        let leg = |curve| Leg { curve, sees: false };
        near.legs.splice(0..0, [leg(first), leg(then)]);
        let items = |flight: &Printed| {
            mission(flight, ORIGIN, &Site::default(), &UploadArgs::default()).items
        };
        assert_eq!(items(&near).len(), items(&flight()).len(), "{rest:?}");
        let Item::Takeoff { at, .. } = items(&near)[0] else {
            panic!("no take-off");
        };
        assert!((at.lon_deg - ORIGIN.lon_deg).abs() > 1e-4, "{at:?}");
    }

    #[test]
    fn without_legs_the_corners_are_flown() {
        let mut flight = flight();
        flight.legs.clear();
        let items = mission(&flight, ORIGIN, &Site::default(), &UploadArgs::default()).items;
        assert_eq!(items.len(), 5, "{items:?}");
    }
}
