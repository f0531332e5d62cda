//! Maps made up for `bench route`: a field of octagons, and a hard case for windows.

use crate::navmesh::Query;
use skein_geometry::frame::Point;
use skein_geometry::random::SplitMix64;

fn rectangle(low: Point, high: Point) -> Vec<Point> {
    vec![
        low,
        Point::new(high.x, low.y),
        high,
        Point::new(low.x, high.y),
    ]
}

/// `n` by `n` octagons, shifted and turned at random, none touching another; the
/// border is the first ring.
#[must_use]
pub fn octagons(n: usize) -> Vec<Vec<Point>> {
    const PITCH_M: f64 = 10.0;
    let mut random = SplitMix64::new(1);
    let size = n as f64 * PITCH_M;
    let mut rings = vec![rectangle(Point::origin(), Point::new(size, size))];
    for i in 0..n * n {
        let radius = 2.0 + random.unit();
        let room = PITCH_M / 2.0 - radius - 0.5;
        let mut shift = || (2.0 * random.unit() - 1.0) * room;
        let x = ((i % n) as f64 + 0.5) * PITCH_M + shift();
        let y = ((i / n) as f64 + 0.5) * PITCH_M + shift();
        let turn = random.unit();
        rings.push(
            (0..8)
                .map(|k| {
                    let a = core::f64::consts::TAU * (f64::from(k) + turn) / 8.0;
                    Point::new(x + radius * a.cos(), y + radius * a.sin())
                })
                .collect(),
        );
    }
    rings
}

/// Random ends in the field of octagons; those inside an octagon have no path.
#[must_use]
pub fn octagon_queries(n: usize, count: usize) -> Vec<Query> {
    let mut random = SplitMix64::new(2);
    let size = n as f64 * 10.0;
    let mut point = || Point::new(size * random.unit(), size * random.unit());
    (0..count)
        .map(|_| Query {
            from: point(),
            to: point(),
            length_m: f64::NAN,
        })
        .collect()
}

/// A row of `n` diamonds below a shaft with `n` teeth on either side: every side
/// of a cell in the shaft runs from wall to wall, and is crossed by the light
/// and the shadow of every diamond.
#[must_use]
pub fn comb(n: usize) -> Vec<Vec<Point>> {
    let (width, height) = (2.0 * n as f64, n as f64);
    let mut border = vec![Point::new(0.0, -height), Point::new(width, -height)];
    for k in 0..n {
        border.push(Point::new(width, 2.0 + k as f64));
        border.push(Point::new(width + 0.4, 2.5 + k as f64));
    }
    border.push(Point::new(width, 2.0 + height));
    border.push(Point::new(0.0, 2.0 + height));
    for k in (0..n).rev() {
        border.push(Point::new(-0.4, 2.5 + k as f64));
        border.push(Point::new(0.0, 2.0 + k as f64));
    }
    let mut rings = vec![border];
    for i in 0..n {
        let x = 2.0 * i as f64 + 1.0;
        rings.push(vec![
            Point::new(x, -0.3),
            Point::new(x + 0.3, 0.0),
            Point::new(x, 0.3),
            Point::new(x - 0.3, 0.0),
        ]);
    }
    rings
}

/// From below the row of diamonds to places in the shaft.
#[must_use]
pub fn comb_queries(n: usize, count: usize) -> Vec<Query> {
    let mut random = SplitMix64::new(3);
    let from = Point::new(n as f64, 1.0 - n as f64);
    (0..count)
        .map(|_| Query {
            from,
            to: Point::new(
                2.0 * n as f64 * random.unit(),
                2.0 + n as f64 * random.unit(),
            ),
            length_m: f64::NAN,
        })
        .collect()
}
