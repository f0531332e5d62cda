//! What the camera of a UAV shows, as far as the UAV knows (D2.7 §1.2.1).
//!
//! A level camera shows a rectangle. A tilted one shows what a pinhole does: a place is in the
//! picture where its direction, turned into the camera, is within the angles of view.
//!
//! # Guarantees
//! A UAV whose mount tilts and whose percept tells no attitude knows of nothing in its picture.

use crate::attitude::Attitude;
use crate::percept::Percept;
use skein_flight::airframe::{Airframe, GRAVITY_MPS2};
use skein_flight::coverage::ring::patch::{Corners, frame_holds};
use skein_flight::mount::RESOLVED;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{atan2, sin_cos};

/// A picture of the ground.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pose: Pose,
    across_m: f64,
    along_m: f64,
    tilt: Option<Tilt>,
}

/// How a picture that tilts does so.
#[derive(Clone, Copy, Debug)]
struct Tilt {
    height_m: f64,
    /// None where the percept does not tell.
    attitude: Option<Attitude>,
}

impl View {
    /// What a UAV has in its picture at a percept.
    #[must_use]
    pub fn of(percept: &Percept, airframe: &Airframe) -> Self {
        let tilt = (!airframe.mount.is_level()).then_some(Tilt {
            height_m: percept.height_m,
            attitude: percept.attitude,
        });
        Self {
            tilt,
            ..Self::level(percept.pose, airframe)
        }
    }

    /// What a UAV that flies level has in its picture at a pose.
    #[must_use]
    pub fn level(pose: Pose, airframe: &Airframe) -> Self {
        Self {
            pose,
            across_m: airframe.footprint_across_m,
            along_m: airframe.footprint_along_m,
            tilt: None,
        }
    }

    /// What a UAV has in its picture at a pose, so high, in a steady turn at its cruise, to the
    /// right where the curvature is negative: a gimbal takes away of the bank what it can.
    #[must_use]
    pub fn turning(pose: Pose, airframe: &Airframe, height_m: f64, curvature_per_m: f64) -> Self {
        let pull = airframe.cruise_mps * airframe.cruise_mps * curvature_per_m;
        let bank_rad = atan2(pull, GRAVITY_MPS2);
        let rolls_rad = airframe.mount.gimbal().map_or(0.0, |g| g.roll_rad);
        let attitude = Attitude {
            bank_rad,
            gimbal_roll_rad: (-bank_rad).clamp(-rolls_rad, rolls_rad),
            ..Attitude::default()
        };
        let tilt = (!airframe.mount.is_level()).then_some(Tilt {
            height_m,
            attitude: Some(attitude),
        });
        Self {
            tilt,
            ..Self::level(pose, airframe)
        }
    }

    /// The same from another pose, tilted otherwise.
    #[must_use]
    pub fn moved(&self, pose: Pose, attitude: Option<Attitude>) -> Self {
        let tilt = self.tilt.map(|t| Tilt { attitude, ..t });
        Self {
            pose,
            tilt,
            ..*self
        }
    }

    /// Where the camera is.
    #[must_use]
    pub fn from(&self) -> Point {
        self.pose.position()
    }

    /// Whether a place is in the inner `share` of the picture, each way.
    #[must_use]
    pub fn shows(&self, p: Point, share: f64) -> bool {
        let (across_m, along_m) = (share * self.across_m, share * self.along_m);
        match &self.tilt {
            None => {
                let (forward, to) = (self.pose.direction(), p - self.pose.position());
                forward.dot(&to).abs() <= along_m && forward.perp(&to).abs() <= across_m
            }
            Some(tilt) => self.tilted(tilt, p, (across_m, along_m), (0.0, 0.0)),
        }
    }

    /// Whether all of a patch is in the picture, though places are off by `off_m` metres and
    /// angles by `off_rad`.
    #[must_use]
    pub fn holds(&self, patch: &Corners, off_m: f64, off_rad: f64) -> bool {
        match &self.tilt {
            None => frame_holds(
                patch,
                self.pose,
                self.across_m - off_m,
                self.along_m - off_m,
            ),
            Some(tilt) => {
                let half_m = (self.across_m, self.along_m);
                let mut corners = patch.iter();
                corners.all(|c| self.tilted(tilt, *c, half_m, (off_m, off_rad)))
            }
        }
    }

    /// How far across and along patches may lie of which the picture holds all, less `off_m`,
    /// metres.
    #[must_use]
    pub fn reach_m(&self, off_m: f64) -> (f64, f64) {
        match &self.tilt {
            None => (self.across_m - off_m, self.along_m - off_m),
            Some(tilt) => {
                let far_m = RESOLVED * self.corner_m(tilt.height_m);
                (far_m, far_m)
            }
        }
    }

    /// From the camera to the corner of a picture from straight above, metres.
    fn corner_m(&self, height_m: f64) -> f64 {
        let (a, b) = (self.across_m, self.along_m);
        (a * a + b * b + height_m * height_m).sqrt()
    }

    fn tilted(
        &self,
        tilt: &Tilt,
        p: Point,
        (across_m, along_m): (f64, f64),
        (off_m, off_rad): (f64, f64),
    ) -> bool {
        let (Some(a), true) = (tilt.attitude, tilt.height_m > 0.0) else {
            return false;
        };
        let (forward, to) = (self.pose.direction(), p - self.pose.position());
        let (x, y, z) = (forward.dot(&to), forward.perp(&to), tilt.height_m);
        let far_m = RESOLVED * self.corner_m(z) - off_m;
        if x * x + y * y + z * z > far_m * far_m {
            return false;
        }
        // Turned back by each angle in turn: x forward, y left, z down.
        let lifted = |(x, y, z): (f64, f64, f64), rad: f64| {
            let (s, c) = sin_cos(rad);
            (x * c - z * s, y, z * c + x * s)
        };
        let rolled = |(x, y, z): (f64, f64, f64), rad: f64| {
            let (s, c) = sin_cos(rad);
            (x, y * c + z * s, z * c - y * s)
        };
        let to = lifted((x, y, z), a.pitch_rad);
        let to = rolled(to, a.bank_rad + a.gimbal_roll_rad);
        let (x, y, depth_m) = lifted(to, a.gimbal_pitch_rad);
        if depth_m <= 0.0 {
            return false;
        }
        let (across, along) = (across_m / z, along_m / z);
        // A place in the picture moves by so much with places and angles that are off.
        let corner = 1.0 + across * across + along * along;
        let off = off_m * corner.sqrt() / depth_m + off_rad * corner;
        x.abs() <= (along - off) * depth_m && y.abs() <= (across - off) * depth_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{airframe, percept_at};
    use skein_flight::mount::Mount;

    #[test]
    fn a_picture_tilts_only_where_the_mount_does_and_the_percept_tells() {
        let pose = Pose::new(Point::new(0.0, 0.0), 0.0);
        let mut percept = percept_at(pose, 0);
        let fixed = Airframe {
            mount: Mount::Fixed,
            ..airframe()
        };
        // 46 m of half a picture from 90 m above; 0.3 rad of bank put its middle 28 m aside.
        let (left, right) = (Point::new(0.0, 40.0), Point::new(0.0, -65.0));
        assert!(View::of(&percept, &airframe()).shows(left, 1.0));
        assert!(
            !View::of(&percept, &fixed).shows(left, 1.0),
            "nothing is told"
        );
        percept.attitude = Some(Attitude {
            bank_rad: 0.3,
            ..Attitude::default()
        });
        assert!(View::of(&percept, &airframe()).shows(left, 1.0));
        let view = View::of(&percept, &fixed);
        assert!(!view.shows(left, 1.0) && view.shows(right, 1.0));
        // A gimbal takes the bank away.
        percept.attitude = Some(Attitude {
            bank_rad: 0.3,
            gimbal_roll_rad: -0.3,
            ..Attitude::default()
        });
        let view = View::of(&percept, &fixed);
        assert!(view.shows(left, 1.0) && !view.shows(right, 1.0));
        // What may be off is taken from the sides: 3 m and 0.02 rad, 3.0 m in a corner.
        let patch = |y: f64| {
            [(0.0, y), (4.0, y), (4.0, y - 4.0), (0.0, y - 4.0)].map(|(x, y)| Point::new(x, y))
        };
        let (holds, not) = (view.holds(&patch(38.0), 3.0, 0.02), patch(42.0));
        assert!(holds && view.holds(&not, 0.0, 0.0) && !view.holds(&not, 3.0, 0.02));
    }

    #[test]
    fn a_turn_looks_outwards_unless_a_gimbal_levels_it() {
        use skein_flight::mount::Gimbal;
        let pose = Pose::new(Point::new(0.0, 0.0), 0.0);
        let (left, right) = (Point::new(0.0, 40.0), Point::new(0.0, -40.0));
        let gimbal = Gimbal {
            roll_rad: 1.0,
            pitch_rad: 1.0,
            rate_radps: 1.0,
        };
        for (mount, curvature_per_m, shows) in [
            (Mount::Level, 0.02, (true, true)),
            (Mount::Gimbal(gimbal), 0.02, (true, true)),
            (Mount::Fixed, 0.0, (true, true)),
            (Mount::Fixed, 0.02, (false, true)),
            (Mount::Fixed, -0.02, (true, false)),
        ] {
            let airframe = Airframe {
                mount,
                ..airframe()
            };
            let view = View::turning(pose, &airframe, 90.0, curvature_per_m);
            assert_eq!((view.shows(left, 1.0), view.shows(right, 1.0)), shows);
        }
    }

    /// A bank of 60° shows the ground to the horizon: what is far is too small.
    #[test]
    fn what_is_far_is_not_recognised() {
        let mut percept = percept_at(Pose::new(Point::new(0.0, 0.0), 0.0), 0);
        percept.attitude = Some(Attitude {
            bank_rad: 1.0,
            ..Attitude::default()
        });
        let fixed = Airframe {
            mount: Mount::Fixed,
            ..airframe()
        };
        let view = View::of(&percept, &fixed);
        assert!(view.shows(Point::new(0.0, -70.0), 1.0));
        assert!(!view.shows(Point::new(0.0, -140.0), 1.0));
    }
}
