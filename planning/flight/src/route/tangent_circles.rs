//! The circles on which routes bend round the zones, and the lines between them
//! (D2.7 §2.3.1 and §2.3.2 with true arcs).
//!
//! A shortest curve that keeps a clearance from polygons is made of lines and of
//! arcs of that radius round convex corners. Where the clearance is no smaller than
//! the turn radius a UAV flies exactly these; where it is smaller, it flies arcs of
//! the turn radius that come as near to a corner, and wider ones round it. The lines
//! between two such circles are tangent to both, so every join is smooth, and a
//! route needs no smoothing that could cut a corner. Whether a line or an arc keeps
//! clear of the zones is measured, not assumed.

use super::RouteLimits;
use skein_geometry::NoFlyZones;
use skein_geometry::Segment;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{PI, atan2, hypot, wrap_tau};
use skein_geometry::polygon::side;
use std::sync::OnceLock;

/// Leniency for "on this side of a direction", a sine.
const ASIDE: f64 = 1e-9;

/// Lines shorter than this do not part two arcs, metres.
const NO_LINE_M: f64 = 1e-6;

/// How far beyond its corner's own directions an arc of the turn radius may reach,
/// radians: one such circle can go round all of a zone that is small against it.
const BEYOND_RAD: f64 = PI / 2.0;

/// A directed circle: `side` 1 is flown counter-clockwise, −1 clockwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Circle {
    pub centre: Point,
    pub radius_m: f64,
    pub side: f64,
}

impl Circle {
    /// The circle that a UAV at `pose` flies if it turns to `side`.
    pub fn beside(pose: Pose, radius_m: f64, side: f64) -> Self {
        let d = pose.direction();
        let centre = pose.position() + Vector::new(-d.y, d.x) * (side * radius_m);
        Self {
            centre,
            radius_m,
            side,
        }
    }

    /// The line that leaves this circle and joins `next` tangentially.
    pub fn line_to(&self, next: &Self) -> Option<Line> {
        let d = next.centre - self.centre;
        let across = next.side * next.radius_m - self.side * self.radius_m;
        let square = d.norm_squared();
        let along = square - across * across;
        if along < NO_LINE_M * NO_LINE_M {
            return None;
        }
        let length_m = along.sqrt();
        let direction = (d * length_m - Vector::new(-d.y, d.x) * across) / square;
        let normal = Vector::new(-direction.y, direction.x);
        Some(Line {
            start: self.centre - normal * (self.side * self.radius_m),
            direction,
            length_m,
        })
    }

    /// The direction from the centre to where a curve flown in `direction` touches.
    fn touch(&self, direction: Vector) -> Vector {
        Vector::new(direction.y, -direction.x) * self.side
    }
}

/// A straight piece between two circles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub start: Point,
    /// A unit vector.
    pub direction: Vector,
    pub length_m: f64,
}

impl Line {
    pub fn end(&self) -> Point {
        self.start + self.direction * self.length_m
    }

    pub fn heading_rad(&self) -> f64 {
        atan2(self.direction.y, self.direction.x)
    }

    pub fn segment(&self) -> Segment {
        Segment {
            start: Pose::new(self.start, self.heading_rad()),
            curvature_per_m: 0.0,
            length_m: self.length_m,
        }
    }
}

/// A circle beside a corner, and the part of it that bends round that corner.
#[derive(Clone, Debug)]
struct Wheel {
    centre: Point,
    radius_m: f64,
    /// The part runs counter-clockwise between these unit vectors.
    from: Vector,
    to: Vector,
    reach_rad: f64,
}

impl Wheel {
    /// A circle that bends from one normal to the other, and as far beyond each.
    fn new(centre: Point, radius_m: f64, normals: [Vector; 2], beyond_rad: [f64; 2]) -> Self {
        let turned = |v: Vector, by_rad: f64| {
            let (s, c) = skein_geometry::math::sin_cos(by_rad);
            Vector::new(c * v.x - s * v.y, s * v.x + c * v.y)
        };
        let between = atan2(normals[0].perp(&normals[1]), normals[0].dot(&normals[1]));
        Self {
            centre,
            radius_m,
            from: turned(normals[0], -beyond_rad[0]),
            to: turned(normals[1], beyond_rad[1]),
            reach_rad: wrap_tau(between) + beyond_rad[0] + beyond_rad[1],
        }
    }

    fn holds(&self, touch: Vector) -> bool {
        let after = self.from.perp(&touch) >= -ASIDE;
        let before = touch.perp(&self.to) >= -ASIDE;
        if self.reach_rad < PI {
            after && before
        } else {
            after || before
        }
    }
}

/// A line from one directed wheel to another; tangent at both.
#[derive(Clone, Debug)]
pub(super) struct Tangent {
    /// The directed wheel where it ends.
    pub to: u32,
    pub line: Line,
    pub heading_rad: f64,
    /// Whether it keeps clear, once somebody has asked.
    clear: OnceLock<bool>,
}

impl Tangent {
    /// Whether the line keeps clear; measured when first asked.
    pub fn is_clear(&self, zones: &NoFlyZones, clearance_m: f64) -> bool {
        *self
            .clear
            .get_or_init(|| zones.is_segment_clear(&self.line.segment(), clearance_m))
    }

    /// Whether it is known not to keep clear.
    pub fn is_known_blocked(&self) -> bool {
        self.clear.get() == Some(&false)
    }
}

/// All circles of a clearance class, and the lines between them, found when first
/// needed and kept. Directed wheel `2 i` is wheel `i` counter-clockwise, `2 i + 1`
/// clockwise.
#[derive(Clone, Debug)]
pub(super) struct Wheels {
    wheels: Vec<Wheel>,
    lines: Vec<OnceLock<Vec<Tangent>>>,
}

impl Wheels {
    /// One wheel for each convex corner. Where the clearance is smaller than the turn
    /// radius, one that is sunk into the corner, and at short edges a wider one too.
    pub fn new(zones: &NoFlyZones, limits: &RouteLimits) -> Self {
        let (turn_m, keep_m) = (limits.turn_radius_m, limits.clearance_m);
        let mut wheels = Vec::new();
        for zone in zones.zones() {
            let v = zone.vertices();
            let n = v.len();
            for i in 0..n {
                let (u, at, x) = (v[(i + n - 1) % n], v[i], v[(i + 1) % n]);
                if side(u, at, x) <= 0 {
                    continue;
                }
                let normals = [outward(u, at), outward(at, x)];
                if keep_m >= turn_m {
                    wheels.push(Wheel::new(at, keep_m, normals, [0.0; 2]));
                    continue;
                }
                let middle = normals[0] + normals[1];
                let size = hypot(middle.x, middle.y);
                // At a needle's point the normals cancel: its direction is as good.
                let middle = if size > ASIDE {
                    middle / size
                } else {
                    Vector::new(-normals[0].y, normals[0].x)
                };
                let depth_m = turn_m - keep_m;
                // Along an edge longer than this, sunk circles stand in the order of
                // their corners; along a shorter one they may have changed places.
                let is_short = |a: Point, b: Point| (b - a).norm() < 2.0 * depth_m;
                let short = [is_short(u, at), is_short(at, x)];
                let beyond_rad = short.map(|s| if s { BEYOND_RAD } else { 0.0 });
                let sunk = at - middle * depth_m;
                wheels.push(Wheel::new(sunk, turn_m, normals, beyond_rad));
                if short[0] || short[1] {
                    wheels.push(Wheel::new(at, turn_m, normals, [0.0; 2]));
                }
            }
        }
        let lines = vec![OnceLock::new(); 2 * wheels.len()];
        Self { wheels, lines }
    }

    /// How many directed wheels there are.
    pub fn len(&self) -> u32 {
        u32::try_from(self.lines.len()).unwrap_or(u32::MAX)
    }

    /// The circle of a directed wheel.
    pub fn circle(&self, node: u32) -> Circle {
        let wheel = self.wheel(node);
        Circle {
            centre: wheel.centre,
            radius_m: wheel.radius_m,
            side: if node.is_multiple_of(2) { 1.0 } else { -1.0 },
        }
    }

    fn wheel(&self, node: u32) -> &Wheel {
        &self.wheels[node as usize / 2]
    }

    /// How far a route may turn on a wheel at most, radians.
    pub fn reach_rad(&self, node: u32) -> f64 {
        self.wheel(node).reach_rad
    }

    /// Whether a line flown in `direction` touches the wheel where it bends round
    /// its corner.
    pub fn touches(&self, node: u32, direction: Vector) -> bool {
        self.wheel(node).holds(self.circle(node).touch(direction))
    }

    /// The lines that leave a directed wheel, in a fixed order.
    pub fn lines(&self, node: u32) -> &[Tangent] {
        self.lines[node as usize].get_or_init(|| {
            let from = self.circle(node);
            let tangent = |to: u32| {
                let line = from.line_to(&self.circle(to))?;
                let touches =
                    self.touches(node, line.direction) && self.touches(to, line.direction);
                touches.then(|| Tangent {
                    to,
                    line,
                    heading_rad: line.heading_rad(),
                    clear: OnceLock::new(),
                })
            };
            (0..self.len())
                .filter(|to| to / 2 != node / 2)
                .filter_map(tangent)
                .collect()
        })
    }
}

/// The unit normal of an edge, away from the zone on its left.
fn outward(a: Point, b: Point) -> Vector {
    let d = b - a;
    Vector::new(d.y, -d.x) / hypot(d.x, d.y)
}
