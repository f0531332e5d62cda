//! The share of an area that a camera sees: exact along scan lines, sampled across them.
//!
//! The camera sees a rectangle: half a swath to each side, the look-ahead before and
//! behind. Along each scan line the parts of the area, of what is forbidden and of what is
//! seen are intervals with exact ends. Scan lines run at an odd angle, so that they are
//! parallel to no lanes and no border.

use crate::boxes::Bounds;
use crate::ground::Ground;
use crate::outline::Outline;
use crate::path::Piece;
use crate::plane::Point;
use libm::{ceil, floor, sincos, sqrt};

/// Direction of the scan lines, radians counter-clockwise from east.
const SCAN_RAD: f64 = 0.321_751_7;

/// Scan lines over an area, and how few there may be where it has very many edges.
const LINES: (f64, f64) = (4000.0, 64.0);

/// Interval ends of all scan lines together.
const MOST_ENDS: f64 = 8e6;

/// How far the direction changes from one footprint of an arc to the next, radians.
const ARC_STEP_RAD: f64 = 0.035;

/// A piece with the camera that looks down from it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    pub(crate) piece: Piece,
    pub(crate) swath_m: f64,
    pub(crate) look_ahead_m: f64,
}

/// What the end of an interval begins or closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layer {
    Area,
    Forbidden,
    Seen,
}

/// An edge between two points of the turned plane: what is east of it is within, if it runs
/// down.
struct Edge {
    a: Point,
    b: Point,
    layer: Layer,
}

struct Circle {
    middle: Point,
    radius_m: f64,
    layer: Layer,
}

/// What is seen of an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// The area without zones and holes, square metres.
    pub(crate) area_m2: f64,
    /// What of it is seen, square metres.
    pub(crate) seen_m2: f64,
}

impl Seen {
    /// The share; all of nothing.
    pub(crate) fn share(&self) -> f64 {
        if self.area_m2 > 0.0 {
            self.seen_m2 / self.area_m2
        } else {
            1.0
        }
    }
}

struct Turned {
    c: f64,
    s: f64,
}

impl Turned {
    fn of(&self, p: Point) -> Point {
        Point::new(self.c * p.x + self.s * p.y, self.c * p.y - self.s * p.x)
    }
}

/// What is seen of the areas of a ground, less its holes and zones.
pub(crate) fn seen(ground: &Ground, looks: &[Look]) -> Seen {
    let (s, c) = sincos(SCAN_RAD);
    let turned = Turned { c, s };
    let (mut edges, mut circles) = (Vec::new(), Vec::new());
    let layers = [
        (&ground.areas, Layer::Area),
        (&ground.holes, Layer::Forbidden),
        (&ground.zones, Layer::Forbidden),
    ];
    let mut bounds = Bounds::EMPTY;
    for (outlines, layer) in layers {
        for named in outlines {
            match &named.outline {
                Outline::Ring(ring) => {
                    let corners: Vec<Point> =
                        ring.corners().iter().map(|p| turned.of(*p)).collect();
                    if layer == Layer::Area {
                        bounds = bounds.join(&Bounds::of(&corners));
                    }
                    add_ring(&mut edges, &corners, layer);
                }
                Outline::Circle { middle, radius_m } => {
                    let circle = Circle {
                        middle: turned.of(*middle),
                        radius_m: *radius_m,
                        layer,
                    };
                    if layer == Layer::Area {
                        let reach = Point::new(*radius_m, *radius_m);
                        bounds.add(circle.middle.plus(reach, 1.0));
                        bounds.add(circle.middle.plus(reach, -1.0));
                    }
                    circles.push(circle);
                }
            }
        }
    }
    for look in looks {
        footprints(look, |corners| {
            add_ring(&mut edges, &corners.map(|p| turned.of(p)), Layer::Seen);
        });
    }
    scan(&bounds, &edges, &circles)
}

fn add_ring(edges: &mut Vec<Edge>, corners: &[Point], layer: Layer) {
    let n = corners.len();
    edges.extend((0..n).map(|i| Edge {
        a: corners[i],
        b: corners[(i + 1) % n],
        layer,
    }));
}

/// Rectangles, counter-clockwise, that a piece sees.
fn footprints(look: &Look, mut each: impl FnMut([Point; 4])) {
    let piece = &look.piece;
    let n = ceil(piece.turned_rad().abs() / ARC_STEP_RAD).max(1.0);
    let step_m = piece.length_m / n;
    let mut k = 0.0;
    while k < n {
        let (a, b) = (piece.at(k * step_m), piece.at((k + 1.0) * step_m));
        let length_m = a.distance(b);
        let course = piece.heading_rad + piece.turned_rad() * (k + 0.5) / n;
        let (s, c) = sincos(course);
        let (along, left) = (Point::new(c, s), Point::new(-s, c));
        let half_m = look.swath_m / 2.0;
        // On the outer side footprints of an arc would leave wedges between them.
        let wedge_m = half_m * piece.turned_rad().abs() / n / 2.0;
        let more_m = |joined: bool| look.look_ahead_m.max(if joined { wedge_m } else { 0.0 });
        let back = -more_m(k > 0.5);
        let front = length_m + more_m(k + 1.5 < n);
        let corner = |ahead: f64, side: f64| a.plus(along, ahead).plus(left, side);
        each([
            corner(back, -half_m),
            corner(front, -half_m),
            corner(front, half_m),
            corner(back, half_m),
        ]);
        k += 1.0;
    }
}

fn scan(bounds: &Bounds, edges: &[Edge], circles: &[Circle]) -> Seen {
    let mut out = Seen {
        area_m2: 0.0,
        seen_m2: 0.0,
    };
    let height_m = bounds.high.y - bounds.low.y;
    if height_m <= 0.0 || !height_m.is_finite() {
        return out;
    }
    // Shares of the height that all edges span together: ends on each line.
    let span =
        |low: f64, high: f64| (high.min(bounds.high.y) - low.max(bounds.low.y)).max(0.0) / height_m;
    let per_line: f64 = edges
        .iter()
        .map(|e| span(e.a.y.min(e.b.y), e.a.y.max(e.b.y)))
        .chain(
            circles
                .iter()
                .map(|c| 2.0 * span(c.middle.y - c.radius_m, c.middle.y + c.radius_m)),
        )
        .sum();
    let n = floor(MOST_ENDS / per_line.max(1.0)).clamp(LINES.1, LINES.0);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 64 and 4000"
    )]
    let mut lines: Vec<Vec<(f64, Layer, i32)>> = vec![Vec::new(); n as usize];
    let step_m = height_m / n;
    let first_y = bounds.low.y + step_m / 2.0;
    // The lines from a height up to another one.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and the number of lines"
    )]
    let between = |low: f64, high: f64| {
        let index = |y: f64| ceil((y - first_y) / step_m).clamp(0.0, n) as usize;
        index(low)..index(high)
    };
    let height = |i: usize| first_y + step_m * f64::from(u32::try_from(i).unwrap_or(u32::MAX));
    for e in edges {
        let (low, high, way) = if e.a.y < e.b.y {
            (e.a, e.b, -1)
        } else {
            (e.b, e.a, 1)
        };
        for i in between(low.y, high.y) {
            let share = (height(i) - low.y) / (high.y - low.y);
            lines[i].push((low.x + (high.x - low.x) * share, e.layer, way));
        }
    }
    for c in circles {
        for i in between(c.middle.y - c.radius_m, c.middle.y + c.radius_m) {
            let up = height(i) - c.middle.y;
            let half_m = sqrt(((c.radius_m - up) * (c.radius_m + up)).max(0.0));
            lines[i].push((c.middle.x - half_m, c.layer, 1));
            lines[i].push((c.middle.x + half_m, c.layer, -1));
        }
    }
    for line in &mut lines {
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut area, mut forbidden, mut seen) = (0, 0, 0);
        let mut before = 0.0;
        for (x, layer, way) in line.iter() {
            if area > 0 && forbidden == 0 {
                out.area_m2 += (x - before) * step_m;
                if seen > 0 {
                    out.seen_m2 += (x - before) * step_m;
                }
            }
            before = *x;
            match layer {
                Layer::Area => area += way,
                Layer::Forbidden => forbidden += way,
                Layer::Seen => seen += way,
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::Named;
    use crate::outline::Ring;

    fn rectangle(x: f64, y: f64, wide: f64, high: f64) -> Named {
        let corners = [(x, y), (x + wide, y), (x + wide, y + high), (x, y + high)];
        let points = corners.map(|(x, y)| Point::new(x, y)).to_vec();
        Named {
            name: "r".to_owned(),
            outline: Outline::Ring(Ring::new(points).unwrap()),
        }
    }

    fn look(piece: Piece) -> Look {
        Look {
            piece,
            swath_m: 40.0,
            look_ahead_m: 10.0,
        }
    }

    fn pass(a: (f64, f64), b: (f64, f64)) -> Look {
        look(Piece::between(
            Point::new(a.0, a.1),
            Point::new(b.0, b.1),
            true,
        ))
    }

    #[test]
    fn a_pass_sees_its_rectangle() {
        let mut ground = Ground {
            areas: vec![rectangle(0.0, 0.0, 400.0, 200.0)],
            ..Ground::default()
        };
        // 40 m wide, from 90 to 310 m.
        let one = seen(&ground, &[pass((100.0, 100.0), (300.0, 100.0))]);
        assert!((one.area_m2 - 80_000.0).abs() < 5.0, "{one:?}");
        assert!((one.seen_m2 - 8_800.0).abs() < 5.0, "{one:?}");
        // Twice over is seen once.
        let passes = [
            pass((100.0, 100.0), (300.0, 100.0)),
            pass((300.0, 110.0), (100.0, 110.0)),
        ];
        assert!((seen(&ground, &passes).seen_m2 - 11_000.0).abs() < 5.0);
        ground.holes = vec![rectangle(90.0, 80.0, 110.0, 40.0)];
        ground.zones = vec![Named {
            name: "z".to_owned(),
            outline: Outline::Circle {
                middle: Point::new(350.0, 50.0),
                radius_m: 20.0,
            },
        }];
        let less = seen(&ground, &passes[..1]);
        assert!(
            (less.area_m2 - (80_000.0 - 4_400.0 - 1256.637)).abs() < 5.0,
            "{less:?}"
        );
        assert!((less.seen_m2 - 4_400.0).abs() < 5.0, "{less:?}");
    }

    #[test]
    fn a_turn_with_the_camera_on_sees_a_ring() {
        let ground = Ground {
            areas: vec![rectangle(-300.0, -300.0, 600.0, 600.0)],
            ..Ground::default()
        };
        let round = Piece {
            start: Point::new(100.0, 0.0),
            heading_rad: core::f64::consts::FRAC_PI_2,
            length_m: 200.0 * core::f64::consts::PI,
            radius_m: Some(-100.0),
            sees: true,
        };
        let mut look = look(round);
        look.look_ahead_m = 0.0;
        let ring_m2 = core::f64::consts::PI * (120.0 * 120.0 - 80.0 * 80.0);
        let share = seen(&ground, &[look]).seen_m2 / ring_m2;
        assert!((share - 1.0).abs() < 2e-3, "{share}");
    }

    #[test]
    fn a_needle_is_measured_as_well_as_a_square() {
        // 3 km long and 2 m wide, aslant.
        let (s, c) = sincos(0.9);
        let corners = [(0.0, 0.0), (3000.0, 0.0), (3000.0, 2.0), (0.0, 2.0)];
        let points = corners.map(|(x, y)| Point::new(c * x - s * y, s * x + c * y));
        let ground = Ground {
            areas: vec![Named {
                name: "needle".to_owned(),
                outline: Outline::Ring(Ring::new(points.to_vec()).unwrap()),
            }],
            ..Ground::default()
        };
        let pass = pass((0.0, 0.0), (1490.0 * c, 1490.0 * s));
        let share = seen(&ground, &[pass]).share();
        assert!((share - 0.5).abs() < 1e-3, "{share}");
    }

    #[test]
    fn shares_are_those_of_dense_samples() {
        for seed in 0..60_u32 {
            let site = crate::generate::Site::of(u64::from(seed));
            let ground = site.ground().unwrap();
            let bounds = ground.areas[0].outline.bounds();
            let (low, high) = (bounds.low, bounds.high);
            // A zigzag over the box, with a bend at each end and the camera on.
            let swath_m = (high.y - low.y) / 7.0;
            let mut looks = Vec::new();
            for i in 0..4 {
                let y = low.y + swath_m * (0.7 + 1.4 * f64::from(i));
                let slope = swath_m * (f64::from(seed % 7) - 3.4) / 5.0;
                let (a, b) = (Point::new(low.x, y), Point::new(high.x, y + slope));
                looks.push(Look {
                    piece: Piece::between(a, b, true),
                    swath_m,
                    look_ahead_m: 0.1 * swath_m,
                });
            }
            let sees = |p: Point| {
                looks.iter().any(|l| {
                    let way = l.piece.end().minus(l.piece.start);
                    let along = way.dot(p.minus(l.piece.start)) / way.norm();
                    let aside = way.cross(p.minus(l.piece.start)) / way.norm();
                    (-l.look_ahead_m..=way.norm() + l.look_ahead_m).contains(&along)
                        && aside.abs() <= l.swath_m / 2.0
                })
            };
            let forbidden = |p: Point| {
                let mut out = ground.zones.iter().chain(&ground.holes);
                out.any(|z| z.outline.contains(p))
            };
            // A sequence that no border is aligned with (Roberts, "The unreasonable
            // effectiveness of quasirandom sequences", 2018).
            let n = 200_000;
            let (mut all, mut some) = (0_u32, 0_u32);
            for i in 0..n {
                let share = |step: f64| (f64::from(i) * step).fract();
                let p = Point::new(
                    low.x + (high.x - low.x) * share(0.754_877_666_246_692_8),
                    low.y + (high.y - low.y) * share(0.569_840_290_998_053_3),
                );
                if ground.areas[0].outline.contains(p) && !forbidden(p) {
                    all += 1;
                    some += u32::from(sees(p));
                }
            }
            let seen = seen(&ground, &looks);
            let box_m2 = (high.x - low.x) * (high.y - low.y);
            let sampled_m2 = f64::from(all) / f64::from(n) * box_m2;
            let slack = 1e-3 * box_m2;
            assert!(
                (seen.area_m2 - sampled_m2).abs() < slack,
                "{seed}: {seen:?} {sampled_m2}"
            );
            let sampled_m2 = f64::from(some) / f64::from(n) * box_m2;
            assert!(
                (seen.seen_m2 - sampled_m2).abs() < slack,
                "{seed}: {seen:?} {sampled_m2}"
            );
            let share = f64::from(some) / f64::from(all.max(1));
            if all > 20_000 {
                assert!(
                    (seen.share() - share).abs() < 3e-3,
                    "{seed}: {} {share}",
                    seen.share()
                );
            }
        }
    }
}
