//! The circle that is flown as a relay position (D2.7 §3.2, §2.3.1): around the place that was
//! asked for, or as near to it as zones leave room, and nowhere farther from it than was asked.
//!
//! The circle above a place that is watched (D2.7 §3.1) is that from which the UAV's own camera holds
//! the place for most of the round, of those as near and as wide. A camera that looks out of the
//! belly looks outwards in a turn: then the place is not in the middle.
//!
//! # Guarantees
//! The circle keeps the clearance of the mission, and a UAV that strays from it by the tracking
//! error is still within the distance.
//!
//! # Complexity
//! At most some hundred circles are measured against the zones.

use crate::mission::{Mission, point_m};
use crate::wire::tasks::{Task, TaskKind};
use core::f64::consts::FRAC_1_SQRT_2;
use skein_behaviors::executive::circle::halves;
use skein_behaviors::view::View;
use skein_flight::airframe::Airframe;
use skein_flight::coverage::ring::patch::Corners;
use skein_flight::route::Router;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{FRAC_PI_2, TAU, cos, sin};
use skein_geometry::{NoFlyZones, Segment};

/// Circles are flown with so many times the turn radius where there is room, so that following
/// them has authority on both sides in a wind.
const RADII: [f64; 2] = [1.2, 1.0];

/// And with so many times that where the camera sees more of the place from there.
const WATCH_RADII: [f64; 5] = [1.2, 1.0, 1.5, 2.0, 3.0];

/// The picture is looked at so often in a round.
const SHOTS: u32 = 24;

/// Who is to follow a target that it does not see yet circles no farther than this from where it
/// may be, metres.
const AWAIT_M: f64 = 250.0;

/// Centres away from the place are tried at so many distances.
const DISTANCES: u32 = 16;

/// And in so many directions.
const DIRECTIONS: u32 = 24;

/// A circle, counter-clockwise from its easternmost place.
pub(crate) fn circle_round(centre: Point, radius_m: f64) -> Segment {
    Segment {
        start: Pose::new(centre + Vector::new(radius_m, 0.0), FRAC_PI_2),
        curvature_per_m: 1.0 / radius_m,
        length_m: TAU * radius_m,
    }
}

/// The camera that is to stay above a place, and how high.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// Whose camera it is.
    pub airframe: Airframe,
    /// How high it flies, metres.
    pub height_m: f64,
    /// The side of the square that is watched, metres.
    pub side_m: f64,
}

impl Eye {
    /// For which share of a round on a circle, flown calm, the picture holds all of a square about
    /// a place.
    #[must_use]
    pub fn share(&self, circle: &Segment, place: Point) -> f64 {
        let half_m = self.side_m / 2.0;
        let corner = |(x, y): (f64, f64)| place + Vector::new(x, y) * half_m;
        let square: Corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner);
        let holds = |k: &u32| {
            let flown_m = circle.length_m * f64::from(*k) / f64::from(SHOTS);
            let view = View::turning(
                circle.pose_at(flown_m),
                &self.airframe,
                self.height_m,
                circle.curvature_per_m,
            );
            view.holds(&square, 0.0, 0.0)
        };
        let held = u32::try_from((0..SHOTS).filter(holds).count()).unwrap_or(0);
        f64::from(held) / f64::from(SHOTS)
    }
}

impl Mission {
    /// The circles within a distance of a place, nearest first for each radius.
    fn circles_near(
        &self,
        (place, within_m): (Point, f64),
        factors: &'static [f64],
    ) -> impl Iterator<Item = Segment> {
        let (turn_m, stray_m) = (self.turn_radius_m(), self.tracking_error_m());
        let around = move |factor: &f64| {
            let radius_m = factor * turn_m;
            let room_m = within_m - radius_m - stray_m;
            let rings = (0..=DISTANCES).filter(move |_| room_m >= 0.0);
            let centres = rings.flat_map(move |ring| {
                let away_m = room_m * f64::from(ring) / f64::from(DISTANCES);
                let directions = if ring == 0 { 1 } else { DIRECTIONS };
                (0..directions).map(move |k| {
                    let course = TAU * f64::from(k) / f64::from(DIRECTIONS);
                    place + Vector::new(cos(course), sin(course)) * away_m
                })
            });
            centres.map(move |centre| circle_round(centre, radius_m))
        };
        factors.iter().flat_map(around)
    }

    /// How far from the middle of a square of this side whoever watches it may be, metres: on the
    /// farthest circle the planned picture still holds it where the UAV passes it.
    #[must_use]
    pub fn watched_within_m(&self, side_m: f64) -> f64 {
        let reach_m = self.level_reach_m(side_m).max(0.0);
        2.0 * RADII[0] * self.turn_radius_m() + reach_m + self.tracking_error_m()
    }

    /// How far from the middle of a circle that is flown level squares of this side lie that the
    /// planned picture holds all the way round, metres; below 0 where there are none.
    #[must_use]
    pub fn circled_reach_m(&self, side_m: f64) -> f64 {
        let radius_m = RADII[0] * self.turn_radius_m();
        let across_m = f64::from(self.footprint_across_mm) / 1000.0;
        let along_m = f64::from(self.footprint_along_mm) / 1000.0;
        let held_m = (across_m - radius_m).min(along_m);
        held_m - side_m * FRAC_1_SQRT_2 - self.tracking_error_m()
    }

    /// The same from one place, whichever way the picture lies.
    fn level_reach_m(&self, side_m: f64) -> f64 {
        let half_mm = self.footprint_across_mm.min(self.footprint_along_mm);
        f64::from(half_mm) / 1000.0 - side_m * FRAC_1_SQRT_2
    }

    /// The circle from which a camera watches a place.
    ///
    /// # Errors
    /// A sentence that says why there is none.
    pub fn watch_circle(
        &self,
        task: &Task,
        zones: &NoFlyZones,
        eye: &Eye,
    ) -> Result<Segment, String> {
        let place = task.places.first().ok_or("it has no place")?;
        let place = point_m((place.east_mm, place.north_mm));
        self.is_near_enough(place)?;
        let within_m = f64::from(task.radius_mm) / 1000.0;
        let clearance_m = self.clearance_m();
        let mut best: Option<(Segment, f64)> = None;
        for circle in self.circles_near((place, within_m), &WATCH_RADII) {
            if best.is_some_and(|b| b.1 >= 1.0) {
                break;
            }
            let share = eye.share(&circle, place);
            let is_better = share > best.map_or(0.0, |b| b.1);
            if is_better && zones.is_clear(&halves(&circle), clearance_m) {
                best = Some((circle, share));
            }
        }
        best.map(|b| b.0).ok_or_else(|| {
            format!(
                "no circle within {within_m:.1} m of the place keeps {clearance_m:.1} m from the no-fly zones and has it in the camera"
            )
        })
    }

    /// The circle of a relay position in this mission; of a target to follow that on which a UAV
    /// looks for it first.
    ///
    /// # Errors
    /// A sentence that says why there is none.
    pub fn relay_circle(&self, task: &Task, zones: &NoFlyZones) -> Result<Segment, String> {
        let place = task.places.first().ok_or("it has no place")?;
        let place = point_m((place.east_mm, place.north_mm));
        let within_m = match task.kind {
            TaskKind::Track => AWAIT_M,
            _ => f64::from(task.radius_mm) / 1000.0,
        };
        let (turn_m, stray_m) = (self.turn_radius_m(), self.tracking_error_m());
        let least_m = turn_m + stray_m;
        if within_m < least_m {
            return Err(format!(
                "the circle flown there takes {least_m:.1} m with what a UAV may stray, more than the {within_m:.1} m that it may be away; expected a radius of at least {least_m:.1} m"
            ));
        }
        self.is_near_enough(place)?;
        let clearance_m = self.clearance_m();
        let mut all = self.circles_near((place, within_m), &RADII);
        all.find(|c| zones.is_clear(&halves(c), clearance_m))
            .ok_or_else(|| {
                format!(
                    "no circle of {turn_m:.1} m within {within_m:.1} m of the place keeps {clearance_m:.1} m from the no-fly zones; expected another place or a larger radius"
                )
            })
    }

    /// How far from the base somebody may hold or follow anything, metres: as far as any place
    /// of the area is. From there who relieves it comes in time.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        let away_m = |p: Point| (p - self.base_m()).norm();
        self.area_m().into_iter().map(away_m).fold(0.0, f64::max)
    }

    fn is_near_enough(&self, place: Point) -> Result<(), String> {
        let farthest_m = self.reach_m();
        let there_m = (place - self.base_m()).norm();
        if there_m > farthest_m {
            return Err(format!(
                "the place is {there_m:.0} m from the base, and every place of the area within {farthest_m:.0} m: who relieves its holder might come too late; expected one nearer to the base"
            ));
        }
        Ok(())
    }
}

/// The same, and a way there from a pose is known.
///
/// # Errors
/// A sentence that says why there is none.
pub fn planned(
    mission: &Mission,
    router: &Router,
    (task, eye): (&Task, Option<&Eye>),
    from: Pose,
) -> Result<Segment, String> {
    let circle = match eye {
        Some(eye) => mission.watch_circle(task, router.zones(), eye)?,
        None => mission.relay_circle(task, router.zones())?,
    };
    // Who is nearer to a zone than that, since one came, gets away from it first.
    let is_clear = router.zones().distance_m(from.position()) >= mission.clearance_m();
    let no_way = |_| "no way leads to it that keeps clear of the no-fly zones".to_owned();
    if is_clear {
        router.route(from, circle.start).map_err(no_way)?;
    }
    Ok(circle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{airframe, mission};
    use crate::wire::tasks::TaskPlace;
    use skein_behaviors::executive::circle::centre;
    use skein_flight::mount::{Gimbal, Mount};
    use std::sync::Arc;

    fn zoned() -> Mission {
        let mut m = mission(1, 8, 6);
        m.zones = vec![vec![
            (200_000, 100_000),
            (260_000, 100_000),
            (260_000, 160_000),
            (200_000, 160_000),
        ]];
        m
    }

    fn relay(east_m: i32, north_m: i32, radius_m: u32) -> Task {
        Task {
            revision: 1,
            kind: TaskKind::Relay,
            places: vec![TaskPlace {
                east_mm: east_m * 1000,
                north_mm: north_m * 1000,
            }],
            radius_mm: radius_m * 1000,
            worth: 100,
            ..Task::default()
        }
    }

    fn track(east_m: i32, north_m: i32) -> Task {
        Task {
            kind: TaskKind::Track,
            ..relay(east_m, north_m, 0)
        }
    }

    #[test]
    fn the_circle_is_round_the_place_or_as_near_as_is_clear() {
        let m = zoned();
        let zones = m.no_fly_zones().unwrap();
        for (east_m, north_m, radius_m, off_m) in [
            (100, 200, 100, 0.0..0.1),
            // Beside the zone, in it, and with room for the tightest circle alone.
            (190, 130, 100, 10.0..40.0),
            (230, 130, 120, 60.0..90.0),
            (100, 200, 26, 0.0..0.1),
        ] {
            let circle = m
                .relay_circle(&relay(east_m, north_m, radius_m), &zones)
                .unwrap();
            let place = Point::new(f64::from(east_m), f64::from(north_m));
            let away_m = (centre(&circle) - place).norm();
            assert!(off_m.contains(&away_m), "{east_m}: {away_m} m");
            assert!(zones.is_clear(&halves(&circle), m.clearance_m() - 1e-6));
            let radius = 1.0 / circle.curvature_per_m;
            assert!(radius >= m.turn_radius_m());
            assert!(away_m + radius + m.tracking_error_m() <= f64::from(radius_m) + 1e-6);
        }
    }

    /// A camera as high as half its picture is wide, which sees 60 m to every side.
    fn eye(mount: Mount) -> Eye {
        Eye {
            airframe: Airframe {
                footprint_across_m: 60.0,
                footprint_along_m: 60.0,
                mount,
                ..airframe()
            },
            height_m: 60.0,
            side_m: 20.0,
        }
    }

    #[test]
    fn a_place_is_watched_from_where_the_camera_holds_it_longest() {
        let mut m = zoned();
        (m.footprint_across_mm, m.footprint_along_mm) = (60_000, 60_000);
        let zones = m.no_fly_zones().unwrap();
        let within_m = m.watched_within_m(20.0);
        let watched = |(east_m, north_m): (i32, i32), mount| {
            let mut task = relay(east_m, north_m, 0);
            task.radius_mm = crate::mission::mm(within_m).unsigned_abs();
            let circle = m.watch_circle(&task, &zones, &eye(mount)).unwrap();
            let place = Point::new(f64::from(east_m), f64::from(north_m));
            let share = eye(mount).share(&circle, place);
            assert!(zones.is_clear(&halves(&circle), m.clearance_m() - 1e-6));
            assert!((centre(&circle) - place).norm() + 1.0 / circle.curvature_per_m < within_m);
            ((centre(&circle) - place).norm(), share)
        };
        let gimbal = Mount::Gimbal(Gimbal {
            roll_rad: 0.8,
            pitch_rad: 0.5,
            rate_radps: 1.0,
        });
        for mount in [Mount::Level, gimbal] {
            let (off_m, share) = watched((100, 200), mount);
            assert!(off_m < 0.1 && share >= 1.0, "{off_m} {share}");
        }
        // Out of the belly it looks away from the middle.
        let (off_m, share) = watched((100, 200), Mount::Fixed);
        assert!(
            off_m > 10.0 && (0.25..1.0).contains(&share),
            "{off_m} {share}"
        );
        let place = Point::new(100.0, 200.0);
        let middle = circle_round(place, 1.2 * m.turn_radius_m());
        assert!(eye(Mount::Fixed).share(&middle, place) < share);
        // Beside the zone, and in it.
        let (off_m, share) = watched((190, 130), Mount::Level);
        assert!(off_m > 10.0 && share > 0.6, "{off_m} {share}");
        let (off_m, share) = watched((230, 130), Mount::Level);
        assert!(off_m > 50.0 && share > 0.0, "{off_m} {share}");
    }

    #[test]
    fn what_a_circle_holds_is_in_the_picture_all_the_way_round() {
        let mut m = zoned();
        (m.footprint_across_mm, m.footprint_along_mm) = (80_000, 60_000);
        let reach_m = m.circled_reach_m(20.0);
        assert!((30.0..40.0).contains(&reach_m), "{reach_m}");
        let mut eye = eye(Mount::Level);
        eye.airframe.footprint_across_m = 80.0;
        let middle = circle_round(Point::new(0.0, 0.0), 1.2 * m.turn_radius_m());
        for course in 0..12 {
            let course = TAU * f64::from(course) / 12.0;
            let off = Vector::new(cos(course), sin(course));
            let share = |away_m: f64| eye.share(&middle, Point::new(0.0, 0.0) + off * away_m);
            assert!(share(reach_m) >= 1.0);
            assert!(share(reach_m + 20.0) < 1.0);
        }
    }

    #[test]
    fn a_relay_position_without_room_is_refused_with_place_and_remedy() {
        let m = Arc::new(zoned());
        for (task, why) in [
            (relay(100, 100, 10), "expected a radius of at least"),
            (
                relay(230, 130, 30),
                "expected another place or a larger radius",
            ),
            (relay(90_000, 0, 100), "expected one nearer to the base"),
            (track(90_000, 0), "expected one nearer to the base"),
        ] {
            let said = m.can_do(&task).unwrap_err();
            assert!(said.contains(why), "{said}");
        }
        m.can_do(&relay(100, 200, 100)).unwrap();
        // A target beside a zone, or in one, is looked for from where there is room.
        m.can_do(&track(230, 130)).unwrap();
    }
}
