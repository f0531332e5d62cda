//! The camera of a mission's UAV as it truly is (D2.7 §1.2.1, §2.2): how the airframe is tilted,
//! how a gimbal is turned, and what is in the picture.
//!
//! The flown path turns at once; the wings follow it at the airframe's roll rate, and a gimbal
//! what it is told at its own. Both move in steps of `STEP_MS`, whoever asks how often.
//! The picture is that of a pinhole by the world's own geometry: axes of the camera, and places
//! along them. A level camera has none of this: its picture is a rectangle straight below.

use super::motion::Piece;
use crate::pursuit::camera::pitch_rad;
use nalgebra::Vector3;
use skein_behaviors::attitude::Attitude;
use skein_behaviors::setpoint::{GimbalStep, Setpoint};
use skein_flight::airframe::{Airframe, GRAVITY_MPS2, ROLL_RATE_RADPS};
use skein_flight::mount::{Gimbal, Mount, RESOLVED, TOLD_RAD};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{atan2, seconds, sin_cos};
use skein_geometry::random::{SplitMix64, mix};

/// Wings and gimbals move in steps of this, milliseconds: half a degree of a roll.
const STEP_MS: u64 = 10;

/// How a camera is turned, and was since the airframe was moved last.
#[derive(Clone, Debug)]
pub struct Camera {
    now: Attitude,
    /// What the gimbal is told, from a time on, and where it was then.
    told: Vec<GimbalStep>,
    told_from: (u64, Attitude),
    /// From when on it was how, the first before the airframe was moved last.
    film: Vec<(u64, Attitude)>,
}

impl Camera {
    /// Of an airframe that flies level.
    #[must_use]
    pub fn new(airframe: &Airframe) -> Self {
        let now = Attitude {
            pitch_rad: pitch_rad(airframe, airframe.cruise_mps, 0.0),
            ..Attitude::default()
        };
        Self {
            now,
            told: Vec::new(),
            told_from: (0, now),
            film: vec![(0, now)],
        }
    }

    /// How it is turned now.
    #[must_use]
    pub fn attitude(&self) -> Attitude {
        self.now
    }

    /// The gimbal is told something else.
    pub fn take(&mut self, setpoint: &Setpoint) {
        self.told.clone_from(&setpoint.gimbal);
        self.told_from = (setpoint.from_ms, self.now);
    }

    /// The airframe is to be moved: what was filmed is not asked for any more.
    pub fn begin(&mut self) {
        if let Some(last) = self.film.pop() {
            self.film.clear();
            self.film.push(last);
        }
    }

    /// The airframe flew a piece.
    pub fn follow(&mut self, airframe: &Airframe, piece: &Piece) {
        if airframe.mount.is_level() {
            return;
        }
        let wanted_rad = atan2(piece.speed_mps * piece.turn_rate_radps, GRAVITY_MPS2);
        let mut at_ms = (piece.from_ms / STEP_MS + 1) * STEP_MS;
        while at_ms <= piece.to_ms {
            let step_s = seconds(STEP_MS);
            let a = &mut self.now;
            a.bank_rad = moved(a.bank_rad, wanted_rad, ROLL_RATE_RADPS * step_s);
            a.pitch_rad = pitch_rad(airframe, piece.speed_mps, a.bank_rad);
            if let Mount::Gimbal(gimbal) = airframe.mount {
                self.turn(&gimbal, at_ms);
            }
            self.film.push((at_ms, self.now));
            at_ms += STEP_MS;
        }
    }

    fn turn(&mut self, gimbal: &Gimbal, at_ms: u64) {
        let (from_ms, from) = self.told_from;
        let mut before = (from_ms, from.gimbal_roll_rad, from.gimbal_pitch_rad);
        let mut wanted = (self.now.gimbal_roll_rad, self.now.gimbal_pitch_rad);
        for step in &self.told {
            let end_ms = before.0 + u64::from(step.duration_ms);
            wanted = (step.roll_rad, step.pitch_rad);
            if at_ms < end_ms {
                let share = seconds(at_ms.saturating_sub(before.0)) / seconds(end_ms - before.0);
                wanted.0 = before.1 + (wanted.0 - before.1) * share;
                wanted.1 = before.2 + (wanted.1 - before.2) * share;
                break;
            }
            before = (end_ms, wanted.0, wanted.1);
        }
        let most = gimbal.rate_radps * seconds(STEP_MS);
        let within = |wanted: f64, limit: f64| wanted.clamp(-limit, limit);
        let a = &mut self.now;
        a.gimbal_roll_rad = moved(a.gimbal_roll_rad, within(wanted.0, gimbal.roll_rad), most);
        a.gimbal_pitch_rad = moved(a.gimbal_pitch_rad, within(wanted.1, gimbal.pitch_rad), most);
    }

    /// How it was turned at a time since the airframe was moved last.
    fn attitude_at(&self, at_ms: u64) -> Attitude {
        let begun = self.film.partition_point(|(from_ms, _)| *from_ms <= at_ms);
        self.film[begun.saturating_sub(1)].1
    }
}

fn moved(from: f64, to: f64, most: f64) -> f64 {
    from + (to - from).clamp(-most, most)
}

/// How a UAV is told to be turned: each angle is off by its own error, drawn evenly.
#[must_use]
pub fn sensed(truth: Attitude, seed: u64, uav: u16, now_ms: u64) -> Attitude {
    let mut random = SplitMix64::new(mix(mix(seed ^ 0x0AAA << 40 ^ u64::from(uav)) ^ now_ms));
    let mut off = |rad: f64| rad + TOLD_RAD * (2.0 * random.unit() - 1.0);
    Attitude {
        bank_rad: off(truth.bank_rad),
        pitch_rad: off(truth.pitch_rad),
        gimbal_roll_rad: off(truth.gimbal_roll_rad),
        gimbal_pitch_rad: off(truth.gimbal_pitch_rad),
    }
}

/// What looks from an airframe: half of its picture from straight above, and how it is turned.
#[derive(Clone, Copy, Debug)]
pub struct Eye<'a> {
    /// Across, metres.
    pub across_m: f64,
    /// Along, metres.
    pub along_m: f64,
    /// What turns, and from how high above the ground, metres; none where it is level.
    turned: Option<(&'a Camera, f64)>,
    /// How high it truly is, metres above the origin.
    pub height_m: f64,
}

/// An airframe alone has a level camera.
impl From<&Airframe> for Eye<'_> {
    fn from(airframe: &Airframe) -> Self {
        Self {
            across_m: airframe.footprint_across_m,
            along_m: airframe.footprint_along_m,
            turned: None,
            height_m: 0.0,
        }
    }
}

impl<'a> Eye<'a> {
    /// The camera of an airframe in flight, this high above the ground.
    #[must_use]
    pub fn new(airframe: &Airframe, camera: &'a Camera, height_m: f64) -> Self {
        let turned = (!airframe.mount.is_level()).then_some((camera, height_m));
        Self {
            turned,
            height_m,
            ..Self::from(airframe)
        }
    }

    /// Whether its picture is a rectangle straight below.
    #[must_use]
    pub fn is_level(&self) -> bool {
        self.turned.is_none()
    }

    /// How far from straight below something in its picture can be, metres.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        let (a, b) = (self.across_m, self.along_m);
        match self.turned {
            None => (a * a + b * b).sqrt(),
            Some((_, h)) => RESOLVED * (a * a + b * b + h * h).sqrt(),
        }
    }

    /// The picture from a pose that its airframe was at then.
    #[must_use]
    pub fn picture(&self, pose: Pose, at_ms: u64) -> Picture {
        self.picture_of(pose, |camera| camera.attitude_at(at_ms))
    }

    /// The picture from where its airframe is now.
    #[must_use]
    pub fn picture_now(&self, pose: Pose) -> Picture {
        self.picture_of(pose, Camera::attitude)
    }

    fn picture_of(&self, pose: Pose, attitude: impl Fn(&Camera) -> Attitude) -> Picture {
        let forward = pose.direction();
        Picture {
            pose,
            forward,
            half_m: (self.across_m, self.along_m),
            axes: self
                .turned
                .map(|(camera, height_m)| (Axes::of(forward, &attitude(camera)), height_m)),
        }
    }
}

/// Where a turned camera looks: all of length 1, east, north and up.
#[derive(Clone, Copy, Debug)]
struct Axes {
    forward: Vector3<f64>,
    left: Vector3<f64>,
    down: Vector3<f64>,
}

impl Axes {
    fn of(ahead: Vector, a: &Attitude) -> Self {
        let level = Self {
            forward: Vector3::new(ahead.x, ahead.y, 0.0),
            left: Vector3::new(-ahead.y, ahead.x, 0.0),
            down: -Vector3::z(),
        };
        level
            .lifted(a.pitch_rad)
            .rolled(a.bank_rad + a.gimbal_roll_rad)
            .lifted(a.gimbal_pitch_rad)
    }

    /// The front goes up.
    fn lifted(self, rad: f64) -> Self {
        let (s, c) = sin_cos(rad);
        Self {
            forward: self.forward * c - self.down * s,
            down: self.down * c + self.forward * s,
            ..self
        }
    }

    /// The left goes down.
    fn rolled(self, rad: f64) -> Self {
        let (s, c) = sin_cos(rad);
        Self {
            left: self.left * c + self.down * s,
            down: self.down * c - self.left * s,
            ..self
        }
    }
}

/// One picture.
#[derive(Clone, Copy, Debug)]
pub struct Picture {
    pose: Pose,
    /// Where it heads, of length 1.
    forward: Vector,
    /// Half of it from straight above, across and along, metres.
    half_m: (f64, f64),
    /// How it is turned, and from how high it looks; none where it is level.
    axes: Option<(Axes, f64)>,
}

impl Picture {
    /// A picture from straight above.
    #[must_use]
    pub fn level(pose: Pose, half_m: (f64, f64)) -> Self {
        Self {
            pose,
            forward: pose.direction(),
            half_m,
            axes: None,
        }
    }

    /// Straight below the camera.
    #[must_use]
    pub fn from(&self) -> Point {
        self.pose.position()
    }

    /// Whether a place on the ground is in so much of half of it, each way.
    #[must_use]
    pub fn shows(&self, at: Point, share: f64) -> bool {
        let (across_m, along_m) = (share * self.half_m.0, share * self.half_m.1);
        let to = at - self.pose.position();
        let Some((axes, height_m)) = &self.axes else {
            let (along, across) = (self.forward.dot(&to), self.forward.perp(&to));
            return along.abs() <= along_m && across.abs() <= across_m;
        };
        let (a, b) = self.half_m;
        let far_m = RESOLVED * (a * a + b * b + height_m * height_m).sqrt();
        let to = Vector3::new(to.x, to.y, -height_m);
        // From so far along the middle of the picture it is as large as from straight above.
        let depth = axes.down.dot(&to) / height_m;
        to.norm() <= far_m
            && depth > 0.0
            && axes.forward.dot(&to).abs() <= along_m * depth
            && axes.left.dot(&to).abs() <= across_m * depth
    }

    /// Whether all of these places are in it.
    #[must_use]
    pub fn holds(&self, places: &[Point]) -> bool {
        places.iter().all(|p| self.shows(*p, 1.0))
    }

    /// The place on the ground that lies so much of half of it ahead of its middle and to the
    /// left; where it shows the sky, straight below.
    #[must_use]
    pub fn place(&self, along: f64, across: f64) -> Point {
        let (across_m, along_m) = (across * self.half_m.0, along * self.half_m.1);
        let from = self.pose.position();
        let forward = self.pose.direction();
        let left = Vector::new(-forward.y, forward.x);
        let Some((axes, height_m)) = &self.axes else {
            return from + forward * along_m + left * across_m;
        };
        let ray = axes.down * *height_m + axes.forward * along_m + axes.left * across_m;
        if ray.z >= 0.0 {
            return from;
        }
        from + ray.xy() * (height_m / -ray.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::fixture::airframe;
    use skein_behaviors::Side;
    use skein_behaviors::view::View;
    use skein_flight::trajectory::wind::Wind;

    fn fixed() -> Airframe {
        Airframe {
            mount: Mount::Fixed,
            ..airframe()
        }
    }

    fn flown(turn_rate_radps: f64, from_ms: u64, to_ms: u64) -> Piece {
        Piece {
            from_ms,
            to_ms,
            start: Pose::new(Point::new(0.0, 0.0), 0.3),
            speed_mps: 13.0,
            turn_rate_radps,
            wind: Wind::CALM,
        }
    }

    #[test]
    fn wings_roll_at_their_rate_and_the_picture_goes_out_of_the_turn() {
        let a = fixed();
        let mut camera = Camera::new(&a);
        camera.follow(&a, &flown(0.5, 0, 300));
        assert!((camera.now.bank_rad - 0.3 * ROLL_RATE_RADPS).abs() < 1e-9);
        camera.follow(&a, &flown(0.5, 300, 2000));
        let bank = (13.0 * 0.5 / GRAVITY_MPS2).atan();
        assert!((camera.now.bank_rad - bank).abs() < 1e-9);
        let pose = Pose::new(Point::new(0.0, 0.0), 0.0);
        let picture = Eye::new(&a, &camera, 50.0).picture_now(pose);
        let middle = picture.place(0.0, 0.0);
        assert!((middle.y + 50.0 * bank.tan()).abs() < 1.5, "{middle}");
        assert!(picture.shows(middle, 0.01) && !picture.shows(Point::new(0.0, 20.0), 1.0));
        // What was filmed is the way there.
        let first = Eye::new(&a, &camera, 50.0).picture(pose, 150);
        assert!((first.place(0.0, 0.0).y + 50.0 * (0.15 * ROLL_RATE_RADPS).tan()).abs() < 0.5);
    }

    #[test]
    fn how_often_a_camera_is_moved_changes_nothing() {
        let a = Airframe {
            mount: Mount::Gimbal(Gimbal {
                roll_rad: 0.7,
                pitch_rad: 0.4,
                rate_radps: 1.0,
            }),
            ..airframe()
        };
        let told = Setpoint {
            from_ms: 0,
            airspeed_mps: 13.0,
            height_m: 45.0,
            launch: skein_behaviors::Launch::Stay,
            promised: None,
            steps: Vec::new(),
            loiter: Side::Left,
            gimbal: vec![
                GimbalStep {
                    duration_ms: 400,
                    roll_rad: -0.3,
                    pitch_rad: 0.1,
                },
                GimbalStep {
                    duration_ms: 100,
                    roll_rad: 0.9,
                    pitch_rad: 0.1,
                },
            ],
        };
        let fly = |ends: &[u64]| {
            let mut camera = Camera::new(&a);
            camera.take(&told);
            let mut from_ms = 0;
            for &to_ms in ends {
                camera.begin();
                camera.follow(&a, &flown(0.2, from_ms, to_ms));
                from_ms = to_ms;
            }
            camera.now
        };
        let once = fly(&[1500]);
        assert_eq!(once, fly(&[7, 133, 134, 800, 1500]));
        // The second angle is beyond its limit, and a second away.
        assert!((once.gimbal_roll_rad - 0.7).abs() < 1e-9);
        assert!((fly(&[400]).gimbal_roll_rad + 0.3).abs() < 1e-9);
        assert!((fly(&[900]).gimbal_roll_rad - 0.2).abs() < 1e-9);
    }

    /// Two geometries that share no line agree on what is in a picture.
    #[test]
    fn what_a_uav_knows_of_its_picture_is_what_the_world_has_in_it() {
        let mut random = SplitMix64::new(5);
        let (mut seen, mut all) = (0, 0);
        for _ in 0..300 {
            let mut angle = |most: f64| most * (2.0 * random.unit() - 1.0);
            let attitude = Attitude {
                bank_rad: angle(0.9),
                pitch_rad: angle(0.3),
                gimbal_roll_rad: angle(0.5),
                gimbal_pitch_rad: angle(0.5),
            };
            let pose = Pose::new(Point::new(angle(50.0), angle(50.0)), angle(3.0));
            let a = fixed();
            let camera = Camera {
                now: attitude,
                ..Camera::new(&a)
            };
            let picture = Eye::new(&a, &camera, 45.0).picture_now(pose);
            let mut percept = crate::world::motion::Kinematic::new(a, pose, 45.0, 0)
                .percept()
                .unwrap();
            percept.attitude = Some(attitude);
            let view = View::of(&percept, &a);
            for _ in 0..60 {
                let p = Point::new(angle(150.0), angle(150.0));
                let (truth, known) = (picture.shows(p, 1.0), view.shows(p, 1.0));
                assert_eq!(truth, known, "{attitude:?} {p}");
                // What is known for sure is there with angles that are off.
                let told = sensed(attitude, 3, 1, all);
                percept.attitude = Some(told);
                let patch = [p, p + Vector::new(3.0, 0.0), p + Vector::new(3.0, 3.0), p];
                let off_rad = skein_flight::mount::DIRECTION_OFF_RAD;
                if View::of(&percept, &a).holds(&patch, 0.0, off_rad) {
                    assert!(picture.holds(&patch), "{attitude:?} {told:?} {p}");
                    seen += 1;
                }
                all += 1;
            }
        }
        assert!(seen > 1000, "{seen}");
    }
}
