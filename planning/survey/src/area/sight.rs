//! Which of many points straight passes see.
//!
//! Points are kept in square boxes, so that a pass looks only at those of the boxes that its
//! footprint touches and not at all of them. Leaves to others which points there are.

use skein_flight::coverage::passes::Pass;
use skein_geometry::frame::{Point, Vector};

/// Points in a box on average: fewer boxes are looked at for nothing, and fewer points are.
const POINTS_A_BOX: f64 = 4.0;

/// Boxes along either side at most.
const MOST_BOXES: usize = 512;

/// Points in square boxes.
pub(super) struct Points {
    points: Vec<Point>,
    low: Point,
    box_m: f64,
    columns: usize,
    rows: usize,
    /// By box, row by row: where its points begin in `order`; one more than there are boxes.
    first: Vec<usize>,
    /// Numbers of points, box by box.
    order: Vec<usize>,
}

/// How far a camera sees from a pass, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    /// To either side.
    pub across_m: f64,
    /// Before and behind.
    pub along_m: f64,
}

impl Points {
    pub(super) fn new(points: Vec<Point>) -> Self {
        let mut low = points.first().copied().unwrap_or(Point::origin());
        let mut high = low;
        for p in &points {
            low = Point::new(low.x.min(p.x), low.y.min(p.y));
            high = Point::new(high.x.max(p.x), high.y.max(p.y));
        }
        let size = high - low;
        let even_m = (size.x * size.y * POINTS_A_BOX / points.len().max(1) as f64).sqrt();
        let least_m = size.amax() / (MOST_BOXES - 1) as f64;
        let box_m = even_m.max(least_m).max(f64::MIN_POSITIVE);
        let mut all = Self {
            columns: whole(size.x / box_m, MOST_BOXES - 1) + 1,
            rows: whole(size.y / box_m, MOST_BOXES - 1) + 1,
            low,
            box_m,
            first: Vec::new(),
            order: Vec::new(),
            points,
        };
        let boxes: Vec<usize> = all.points.iter().map(|p| all.box_of(*p)).collect();
        let mut first = vec![0; all.columns * all.rows + 1];
        for b in &boxes {
            first[b + 1] += 1;
        }
        for b in 1..first.len() {
            first[b] += first[b - 1];
        }
        let mut next = first.clone();
        let mut order = vec![0; boxes.len()];
        for (i, b) in boxes.iter().enumerate() {
            order[next[*b]] = i;
            next[*b] += 1;
        }
        (all.first, all.order) = (first, order);
        all
    }

    /// The points, as they were given.
    pub(super) fn all(&self) -> &[Point] {
        &self.points
    }

    /// By point: how many of the passes see it.
    pub(super) fn seen<'a>(
        &self,
        passes: impl Iterator<Item = &'a Pass>,
        footprint: Footprint,
    ) -> Vec<u32> {
        let mut seen = vec![0; self.points.len()];
        for pass in passes {
            self.each_seen(pass, footprint, |i| seen[i] += 1);
        }
        seen
    }

    /// Calls for each point that a pass sees.
    pub(super) fn each_seen(&self, pass: &Pass, footprint: Footprint, mut f: impl FnMut(usize)) {
        let Footprint { across_m, along_m } = footprint;
        let corners = corners(pass, footprint);
        let heights = corners.map(|c| (c.y - self.low.y) / self.box_m);
        let rows = (least(&heights), greatest(&heights));
        if !(rows.1 >= 0.0 && rows.0 <= self.rows as f64) {
            return;
        }
        for row in whole(rows.0, self.rows - 1)..=whole(rows.1, self.rows - 1) {
            let slab_m = (row as f64 * self.box_m, (row + 1) as f64 * self.box_m);
            let slab_m = (slab_m.0 + self.low.y, slab_m.1 + self.low.y);
            // Points on the outermost borders belong to the outermost boxes.
            let reach = span_in(&corners, slab_m, row + 1 == self.rows);
            let (from, to) = (reach.0 - self.low.x, reach.1 - self.low.x);
            let columns = (from / self.box_m, to / self.box_m);
            if !(columns.1 >= 0.0 && columns.0 <= self.columns as f64) {
                continue;
            }
            let (a, b) = (
                whole(columns.0, self.columns - 1),
                whole(columns.1, self.columns - 1),
            );
            let boxes = row * self.columns + a..=row * self.columns + b;
            for i in &self.order[self.first[*boxes.start()]..self.first[*boxes.end() + 1]] {
                if pass.sees(self.points[*i], across_m, along_m) {
                    f(*i);
                }
            }
        }
    }

    fn box_of(&self, p: Point) -> usize {
        let v = (p - self.low) / self.box_m;
        whole(v.y, self.rows - 1) * self.columns + whole(v.x, self.columns - 1)
    }
}

/// The whole part of a number between 0 and `most`.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn whole(x: f64, most: usize) -> usize {
    (x.max(0.0) as usize).min(most)
}

fn least(of: &[f64]) -> f64 {
    of.iter().copied().fold(f64::INFINITY, f64::min)
}

fn greatest(of: &[f64]) -> f64 {
    of.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// The corners of what a pass sees, and a little more for rounding.
fn corners(pass: &Pass, footprint: Footprint) -> [Point; 4] {
    /// More than `Pass::sees` allows for.
    const ROUNDING_M: f64 = 1e-5;
    let d = pass.to - pass.from;
    let length_m = d.norm();
    let ahead = if length_m > 0.0 {
        d / length_m
    } else {
        Vector::x()
    };
    let out = Vector::new(-ahead.y, ahead.x) * (footprint.across_m + ROUNDING_M);
    let on = ahead * (footprint.along_m + ROUNDING_M);
    [
        pass.from - on - out,
        pass.to + on - out,
        pass.to + on + out,
        pass.from - on + out,
    ]
}

/// From where to where the part of a convex ring in a level slab lies; above the slab too
/// where that is the last one.
fn span_in(ring: &[Point; 4], (low_m, high_m): (f64, f64), is_last: bool) -> (f64, f64) {
    let high_m = if is_last { f64::INFINITY } else { high_m };
    let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut take = |x: f64| (from, to) = (from.min(x), to.max(x));
    for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
        if (low_m..=high_m).contains(&a.y) {
            take(a.x);
        }
        for level_m in [low_m, high_m] {
            if (a.y < level_m) != (b.y < level_m) && level_m.is_finite() {
                take(a.x + (b.x - a.x) * ((level_m - a.y) / (b.y - a.y)));
            }
        }
    }
    (from, to)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn as_many_see_each_point_as_when_all_are_asked(
            points in prop::collection::vec((-100.0..100.0f64, -60.0..60.0f64), 0..300),
            passes in prop::collection::vec(
                (-130.0..130.0f64, -90.0..90.0f64, -130.0..130.0f64, -90.0..90.0f64), 0..8),
            across_m in 0.1..40.0f64,
            along_m in 0.0..40.0f64,
            level in any::<bool>(),
        ) {
            let points: Vec<Point> = points.iter().map(|p| Point::new(p.0, p.1)).collect();
            let pass = |p: &(f64, f64, f64, f64)| Pass {
                from: Point::new(p.0, p.1),
                to: Point::new(p.2, if level { p.1 } else { p.3 }),
            };
            let passes: Vec<Pass> = passes.iter().map(pass).collect();
            let all = Points::new(points.clone());
            let seen = all.seen(passes.iter(), Footprint { across_m, along_m });
            for (p, n) in points.iter().zip(seen) {
                let who = passes.iter().filter(|pass| pass.sees(*p, across_m, along_m));
                prop_assert_eq!(who.count(), n as usize, "{}", p);
            }
        }
    }

    #[test]
    fn points_in_one_place_are_seen_too() {
        let all = Points::new(vec![Point::new(3.0, 4.0); 5]);
        let pass = Pass {
            from: Point::new(0.0, 4.0),
            to: Point::new(9.0, 4.0),
        };
        let footprint = Footprint {
            across_m: 1.0,
            along_m: 0.0,
        };
        assert_eq!(all.seen([pass].iter(), footprint), vec![1; 5]);
        assert!(
            Points::new(Vec::new())
                .seen([pass].iter(), footprint)
                .is_empty()
        );
    }
}
