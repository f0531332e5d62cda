//! What a camera sees (D2.7 §1.5.2): fixed to the airframe, so that its picture tilts with
//! bank and pitch, or on a gimbal with a limit and a rate; buildings hide what is behind.

use crate::world::obstacles::{Obstacles, Place};
use nalgebra::{Unit, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use skein_flight::airframe::{Airframe, GRAVITY_MPS2};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{acos, atan2, cos, sin_cos, tan};

/// A vehicle is seen by its middle, metres above the ground.
const MIDDLE_M: f64 = 1.0;

/// The wing stalls at this angle of attack, radians.
const STALL_RAD: f64 = 0.21;

/// The wing is set to the fuselage at this angle, radians.
const INCIDENCE_RAD: f64 = 0.06;

/// How far the nose is up in level flight, from what the wing carries at a bank, radians.
#[must_use]
pub fn pitch_rad(airframe: &Airframe, airspeed_mps: f64, bank_rad: f64) -> f64 {
    let share = airframe.stall_mps / airspeed_mps.max(1.0);
    STALL_RAD * share * share / cos(bank_rad) - INCIDENCE_RAD
}

/// How a camera is held.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Mount {
    /// It looks out of the belly, turned to the left by an angle, radians.
    Fixed {
        /// To the left, radians; negative to the right.
        left_rad: f64,
    },
    /// It is turned towards what it is told.
    Gimbal {
        /// How fast, rad/s.
        rate_radps: f64,
        /// How far from straight out of the belly at most, radians.
        most_rad: f64,
    },
}

/// A camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Optics {
    /// How it is held.
    pub mount: Mount,
    /// Half its field of view, radians.
    pub half_rad: f64,
    /// Vehicles farther away are not recognised, metres.
    pub reach_m: f64,
}

impl Optics {
    /// A small ball turret: 40° of view, 250 m for a car.
    #[must_use]
    pub fn gimballed() -> Self {
        Self {
            mount: Mount::Gimbal {
                rate_radps: 60.0_f64.to_radians(),
                most_rad: 100.0_f64.to_radians(),
            },
            half_rad: 20.0_f64.to_radians(),
            reach_m: 250.0,
        }
    }
}

/// Where an airframe points: the camera needs all three angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Attitude {
    forward: Vector3<f64>,
    left: Vector3<f64>,
    belly: Vector3<f64>,
}

impl Attitude {
    /// Of a coordinated turn: bank follows from it, pitch from what the wing carries.
    pub(super) fn of(
        airframe: &Airframe,
        heading_rad: f64,
        airspeed_mps: f64,
        turn_rate_radps: f64,
    ) -> Self {
        let bank_rad = atan2(airspeed_mps * turn_rate_radps, GRAVITY_MPS2);
        let pitch_rad = pitch_rad(airframe, airspeed_mps, bank_rad);
        let (s, c) = sin_cos(heading_rad);
        let (ahead, side, up) = (
            Vector3::new(c, s, 0.0),
            Vector3::new(-s, c, 0.0),
            Vector3::z(),
        );
        // First the nose goes up, then the left wing down.
        let (sp, cp) = sin_cos(pitch_rad);
        let forward = ahead * cp + up * sp;
        let over = up * cp - ahead * sp;
        let (sb, cb) = sin_cos(bank_rad);
        Self {
            forward,
            left: side * cb - over * sb,
            belly: -(over * cb + side * sb),
        }
    }
}

/// A camera in flight.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    optics: Optics,
    /// Where it looks, of length 1.
    axis: Vector3<f64>,
    at: Place,
}

impl Camera {
    pub(super) fn new(optics: Optics) -> Self {
        Self {
            optics,
            axis: -Vector3::z(),
            at: Place {
                at: Point::origin(),
                height_m: 0.0,
            },
        }
    }

    /// The airframe moved; a gimbal turns towards `aim` for `over_s` seconds.
    pub(super) fn advance(
        &mut self,
        pose: &Pose,
        height_m: f64,
        attitude: &Attitude,
        aim: Option<Point>,
        over_s: f64,
    ) {
        self.at = Place {
            at: pose.position(),
            height_m,
        };
        match self.optics.mount {
            Mount::Fixed { left_rad } => {
                let (s, c) = sin_cos(left_rad);
                self.axis = attitude.belly * c + attitude.left * s;
            }
            Mount::Gimbal {
                rate_radps,
                most_rad,
            } => {
                let wanted = aim.map_or(-Vector3::z(), |p| self.towards(p).0);
                let turned = turn(self.axis, wanted, rate_radps * over_s, attitude.forward);
                let off_rad = angle(turned, attitude.belly);
                // What the airframe covers it cannot look at.
                let back_rad = (off_rad - most_rad).max(0.0);
                self.axis = turn(turned, attitude.belly, back_rad, attitude.forward);
            }
        }
    }

    /// As its UAV tells of it, which takes itself to be beside where it is, metres.
    pub(super) fn told(&self, displaced: Vector) -> Self {
        let mut told = self.clone();
        told.at.at += displaced;
        told
    }

    /// Where it is over the ground.
    pub(super) fn at(&self) -> Point {
        self.at.at
    }

    /// How far over the ground it recognises a vehicle, metres.
    pub(super) fn reach_m(&self) -> f64 {
        let (reach, height) = (self.optics.reach_m, self.at.height_m - MIDDLE_M);
        (reach * reach - height * height).max(0.0).sqrt()
    }

    /// How far round a place it shows the ground if it is pointed there, metres; across its line
    /// of sight, where it shows least.
    pub(super) fn shows_m(&self, at: Point) -> f64 {
        self.towards(at).1 * tan(self.optics.half_rad)
    }

    /// Whether from a place in its height a vehicle at another one is seen past the buildings.
    pub(super) fn would_see(&self, from: Point, target: Point, obstacles: &Obstacles) -> bool {
        let from = Place {
            at: from,
            height_m: self.at.height_m,
        };
        let to = Place {
            at: target,
            height_m: MIDDLE_M,
        };
        obstacles.sees(from, to)
    }

    /// Whether a vehicle at a place is in the picture, large enough and not hidden.
    pub(super) fn sees(&self, target: Point, obstacles: Option<&Obstacles>) -> bool {
        self.frames(target) && !self.is_hidden(target, obstacles)
    }

    /// Whether a place is in the picture and near enough.
    pub(super) fn frames(&self, target: Point) -> bool {
        let (direction, range_m) = self.towards(target);
        range_m <= self.optics.reach_m && angle(direction, self.axis) <= self.optics.half_rad
    }

    /// Whether a building stands in between.
    pub(super) fn is_hidden(&self, target: Point, obstacles: Option<&Obstacles>) -> bool {
        let place = Place {
            at: target,
            height_m: MIDDLE_M,
        };
        obstacles.is_some_and(|o| !o.sees(self.at, place))
    }

    /// The middle of the picture on the ground, if it shows the ground within its reach.
    pub(super) fn middle(&self) -> Option<Point> {
        let down = -self.axis.z;
        let range_m = self.at.height_m / down;
        let within = down > 0.0 && range_m <= self.optics.reach_m;
        within.then(|| self.at.at + self.axis.xy() * range_m)
    }

    /// Direction and range of a vehicle.
    fn towards(&self, target: Point) -> (Vector3<f64>, f64) {
        let flat = target - self.at.at;
        let to = Vector3::new(flat.x, flat.y, MIDDLE_M - self.at.height_m);
        let range_m = to.norm();
        if range_m > 0.0 {
            (to / range_m, range_m)
        } else {
            (-Vector3::z(), 0.0)
        }
    }
}

fn angle(a: Vector3<f64>, b: Vector3<f64>) -> f64 {
    acos(a.dot(&b))
}

/// Turns a direction towards another by at most an angle; to its very opposite by way of
/// `past`.
fn turn(from: Vector3<f64>, to: Vector3<f64>, most_rad: f64, past: Vector3<f64>) -> Vector3<f64> {
    let whole_rad = angle(from, to);
    if whole_rad <= most_rad {
        return to;
    }
    let axis = from.cross(&to);
    let axis = if axis.norm() > 1e-9 {
        axis
    } else {
        from.cross(&past)
    };
    // Half the angle by this core's own sine: every machine rounds it alike.
    let unit = Unit::try_new(axis, 1e-12).unwrap_or_else(Vector3::z_axis);
    let (s, c) = sin_cos(most_rad / 2.0);
    let v = unit.into_inner() * s;
    let spin = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(c, v.x, v.y, v.z));
    (spin * from).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::Building;
    use skein_geometry::Polygon;

    fn airframe() -> Airframe {
        super::super::airframe()
    }

    fn level(turn_rate_radps: f64) -> Attitude {
        Attitude::of(&airframe(), 0.0, 20.0, turn_rate_radps)
    }

    fn fixed(left_rad: f64) -> Camera {
        Camera::new(Optics {
            mount: Mount::Fixed { left_rad },
            ..Optics::gimballed()
        })
    }

    fn at_origin() -> Pose {
        Pose::new(Point::origin(), 0.0)
    }

    #[test]
    fn the_picture_of_a_fixed_camera_goes_out_of_the_turn_and_forward_with_the_nose() {
        let mut camera = fixed(0.0);
        camera.advance(&at_origin(), 100.0, &level(0.0), None, 0.2);
        let straight = camera.middle().unwrap();
        // The nose is up by 0.0156 rad: the picture lies so much ahead.
        assert!(straight.y.abs() < 1e-9 && (1.0..3.0).contains(&straight.x));
        // 30° of bank to the left look 58 m to the right.
        let rate = GRAVITY_MPS2 * 30.0_f64.to_radians().tan() / 20.0;
        camera.advance(&at_origin(), 100.0, &level(rate), None, 0.2);
        let banked = camera.middle().unwrap();
        assert!((banked.y + 57.7).abs() < 1.0, "{banked}");
        assert!(!camera.frames(Point::new(0.0, 20.0)));
        // Turned by 30° to the left it looks straight down again.
        let mut camera = fixed(30.0_f64.to_radians());
        camera.advance(&at_origin(), 100.0, &level(rate), None, 0.2);
        assert!(camera.middle().unwrap().y.abs() < 1.0);
    }

    #[test]
    fn a_gimbal_turns_at_its_rate_and_up_to_its_limit() {
        let mut camera = Camera::new(Optics::gimballed());
        let aim = Point::new(0.0, 150.0);
        let mut looks = 0;
        while !camera.frames(aim) {
            camera.advance(&at_origin(), 100.0, &level(0.0), Some(aim), 0.1);
            looks += 1;
            assert!(looks < 20);
        }
        // 56° less half of the view, at 60° a second.
        assert!((5..=8).contains(&looks), "{looks}");
        let mut narrow = Camera::new(Optics {
            mount: Mount::Gimbal {
                rate_radps: 1.0,
                most_rad: 0.3,
            },
            ..Optics::gimballed()
        });
        for _ in 0..50 {
            narrow.advance(&at_origin(), 100.0, &level(0.0), Some(aim), 0.1);
        }
        assert!((angle(narrow.axis, level(0.0).belly) - 0.3).abs() < 1e-6);
        assert!(!narrow.frames(aim));
    }

    #[test]
    fn what_is_far_or_behind_a_house_is_not_seen() {
        let corners = [(20.0, -10.0), (30.0, -10.0), (30.0, 10.0), (20.0, 10.0)];
        let house = Building {
            footprint: Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap(),
            height_m: 30.0,
        };
        let town = Obstacles::new(&[house]);
        let mut camera = Camera::new(Optics::gimballed());
        let behind = Point::new(32.0, 0.0);
        for _ in 0..20 {
            camera.advance(
                &Pose::new(Point::new(-60.0, 0.0), 0.0),
                80.0,
                &level(0.0),
                Some(behind),
                0.2,
            );
        }
        assert!(camera.frames(behind) && !camera.sees(behind, Some(&town)));
        assert!(camera.sees(behind, None));
        assert!(camera.sees(Point::new(18.0, 0.0), Some(&town)));
        assert!(!camera.frames(Point::new(400.0, 0.0)), "out of reach");
    }
}
