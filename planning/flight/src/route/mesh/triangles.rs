//! A Delaunay triangulation by insertion along a space-filling curve.
//!
//! Points are taken in the order of a Hilbert curve, so that each is found a step or
//! two from the one before and everything it touches is still in the cache. Positions
//! are decided exactly. A side is flipped only if that is certain to be better, so
//! rounding can leave a triangle that is Delaunay but for the last bits, never one
//! that is no triangle. Lines that must be sides are the business of [`super::lines`].

use super::{NONE, turn};
use skein_geometry::frame::Point;

/// Corners of the frame round all points; they come first.
pub(super) const FRAME: u32 = 4;

/// Cells a side of the Hilbert curve: 2¹⁶ tell apart whatever is worth it.
const HILBERT_BITS: u32 = 16;

/// A side that no flip may take away.
pub(super) const FIXED: u8 = 1;

/// A side at which free space begins or ends.
pub(super) const WALL: u8 = 2;

/// Triangles as three half-edges each: side `e` belongs to triangle `e / 3`, which is
/// on its left.
pub(super) struct Triangles {
    /// Distinct points in the order of the curve, behind the corners of the frame.
    pub points: Vec<Point>,
    /// Where each half-edge starts.
    pub origin: Vec<u32>,
    /// The same side seen from the other triangle; [`NONE`] on the frame.
    pub twin: Vec<u32>,
    /// [`FIXED`] and [`WALL`].
    pub marks: Vec<u8>,
    /// A half-edge out of each point, once all are in.
    pub around: Vec<u32>,
    /// Sides that may have to be flipped.
    pub doubtful: Vec<u32>,
}

/// The next half-edge round a triangle.
#[inline]
pub(super) fn next(e: u32) -> u32 {
    if e % 3 == 2 { e - 2 } else { e + 1 }
}

/// The half-edge before, round a triangle.
#[inline]
pub(super) fn previous(e: u32) -> u32 {
    if e.is_multiple_of(3) { e + 2 } else { e - 1 }
}

/// Where a point lies.
enum Place {
    Inside(u32),
    On(u32),
    At(u32),
}

impl Triangles {
    /// The triangulation of some points, with the number that each of them got;
    /// points in the same place share one.
    pub fn of(all: &[Point]) -> (Self, Vec<u32>) {
        let (low, high) = bounds(all);
        let mut mesh = Self::framed(low, high, all.len());
        let mut ids = vec![NONE; all.len()];
        let mut near = 0;
        for i in along_curve(all, low, high) {
            let p = all[i as usize];
            let id = match mesh.locate(p, near) {
                Place::At(e) => mesh.origin[e as usize],
                Place::Inside(e) => mesh.put(p, |mesh, v| mesh.split_triangle(e, v)),
                Place::On(e) => mesh.put(p, |mesh, v| mesh.split_side(e, v)),
            };
            ids[i as usize] = id;
            near = mesh.around[id as usize];
        }
        for e in 0..mesh.origin.len() as u32 {
            let v = mesh.origin[e as usize];
            mesh.around[v as usize] = e;
        }
        mesh.marks = vec![0; mesh.origin.len()];
        (mesh, ids)
    }

    /// Two triangles well outside of everything.
    fn framed(low: Point, high: Point, n: usize) -> Self {
        let size = high - low;
        let margin = size.x.max(size.y).max(1.0);
        let (l, h) = (low.map(|c| c - margin), high.map(|c| c + margin));
        let mut points = Vec::with_capacity(n + FRAME as usize);
        points.extend([l, Point::new(h.x, l.y), h, Point::new(l.x, h.y)]);
        let mut origin = Vec::with_capacity(6 * (n + 1));
        origin.extend([0, 1, 2, 2, 3, 0]);
        let mut twin = Vec::with_capacity(6 * (n + 1));
        twin.extend([NONE, NONE, 3 + 2, NONE, NONE, 2]);
        let mut around = Vec::with_capacity(n + FRAME as usize);
        around.extend([0, 1, 2, 4]);
        Self {
            points,
            origin,
            twin,
            marks: Vec::new(),
            around,
            doubtful: Vec::new(),
        }
    }

    #[inline]
    pub fn at(&self, e: u32) -> Point {
        self.points[self.origin[e as usize] as usize]
    }

    /// Where a half-edge ends.
    #[inline]
    pub fn end(&self, e: u32) -> u32 {
        self.origin[next(e) as usize]
    }

    /// Walks towards `p` from the triangle of a half-edge.
    fn locate(&self, p: Point, near: u32) -> Place {
        let mut e = near;
        // Turning at random where two ways lead on: a walk cannot go round for ever.
        let mut random = 1u32;
        let mut came = NONE;
        loop {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            if random >> 31 == 1 {
                e = next(e);
            }
            let mut on = NONE;
            let mut out = NONE;
            for _ in 0..3 {
                if e != came {
                    let side = turn(self.at(e), self.at(next(e)), p);
                    if side < 0.0 {
                        out = e;
                        break;
                    }
                    if side <= 0.0 {
                        on = e;
                    }
                }
                e = next(e);
            }
            if out != NONE && self.twin[out as usize] != NONE {
                e = self.twin[out as usize];
                came = e;
                continue;
            }
            if on == NONE {
                return Place::Inside(e);
            }
            let same = |&e: &u32| (self.at(e) - p).amax() <= 0.0;
            let corner = [e, next(e), previous(e)].into_iter().find(same);
            return corner.map_or(Place::On(on), Place::At);
        }
    }

    fn put(&mut self, p: Point, split: impl FnOnce(&mut Self, u32)) -> u32 {
        let v = self.points.len() as u32;
        self.points.push(p);
        self.around.push(NONE);
        split(self, v);
        while let Some(e) = self.doubtful.pop() {
            let f = self.twin[e as usize];
            if f != NONE && self.is_better_flipped(e, f) {
                self.flip(e, f);
                self.doubtful.extend([e, previous(f)]);
            }
        }
        v
    }

    #[inline]
    pub fn link(&mut self, e: u32, f: u32) {
        self.twin[e as usize] = f;
        if f != NONE {
            self.twin[f as usize] = e;
        }
    }

    /// A new triangle without neighbours; its first half-edge.
    fn add(&mut self, corners: [u32; 3]) -> u32 {
        let e = self.origin.len() as u32;
        self.origin.extend(corners);
        self.twin.extend([NONE; 3]);
        e
    }

    /// Three triangles where one was.
    fn split_triangle(&mut self, e: u32, v: u32) {
        let (e, f, g) = (e, next(e), previous(e));
        let (a, b, c) = (
            self.origin[e as usize],
            self.origin[f as usize],
            self.origin[g as usize],
        );
        let (beyond_f, beyond_g) = (self.twin[f as usize], self.twin[g as usize]);
        // The old one becomes a → b → v.
        self.origin[g as usize] = v;
        let t = self.add([b, c, v]);
        let u = self.add([c, a, v]);
        self.link(t, beyond_f);
        self.link(u, beyond_g);
        self.link(f, t + 2);
        self.link(t + 1, u + 2);
        self.link(u + 1, g);
        self.around[v as usize] = g;
        self.doubtful.extend([e, t, u]);
    }

    /// Four triangles where two were. The frame's sides are far from all points.
    fn split_side(&mut self, e: u32, v: u32) {
        let f = self.twin[e as usize];
        if f == NONE {
            return;
        }
        // e: a → b in a b c, f: b → a in b a d.
        let (e1, e2, f1, f2) = (next(e), previous(e), next(f), previous(f));
        let (a, b) = (self.origin[e as usize], self.origin[f as usize]);
        let (c, d) = (self.origin[e2 as usize], self.origin[f2 as usize]);
        let (beyond_e1, beyond_f1) = (self.twin[e1 as usize], self.twin[f1 as usize]);
        // The old ones become a v c and b v d.
        self.origin[e1 as usize] = v;
        self.origin[f1 as usize] = v;
        let t = self.add([v, b, c]);
        let u = self.add([v, a, d]);
        self.link(t + 1, beyond_e1);
        self.link(u + 1, beyond_f1);
        self.link(t + 2, e1);
        self.link(u + 2, f1);
        self.link(e, u);
        self.link(f, t);
        self.around[v as usize] = e1;
        self.doubtful.extend([e2, t + 1, f2, u + 1]);
    }

    /// Whether the other diagonal is certain to be the Delaunay one. Then the two
    /// triangles together are strictly convex.
    #[inline]
    pub fn is_better_flipped(&self, e: u32, f: u32) -> bool {
        is_inside_circle(
            self.at(e),
            self.at(f),
            self.at(previous(e)),
            self.at(previous(f)),
        )
    }

    /// Exchanges the side between two triangles for their other diagonal. Then the
    /// outer sides are `e`, `previous(e)`, `f` and `previous(f)`.
    #[inline]
    pub fn flip(&mut self, e: u32, f: u32) {
        let (e1, f1) = (next(e), next(f));
        let (beyond_e, beyond_f) = (self.twin[f1 as usize], self.twin[e1 as usize]);
        self.origin[e1 as usize] = self.origin[previous(f) as usize];
        self.origin[f1 as usize] = self.origin[previous(e) as usize];
        self.link(e, beyond_e);
        self.link(f, beyond_f);
        self.link(e1, f1);
    }
}

/// Whether `d` is certainly inside the circle through `a`, `b`, `c` (to the left).
#[inline]
fn is_inside_circle(a: Point, b: Point, c: Point, d: Point) -> bool {
    // The error bound of this expression (Shewchuk 1997).
    const BOUND: f64 = 1.110_223_024_625_157_5e-15;
    let (a, b, c) = (a - d, b - d, c - d);
    let (bc, cb) = (b.x * c.y, c.x * b.y);
    let (ca, ac) = (c.x * a.y, a.x * c.y);
    let (ab, ba) = (a.x * b.y, b.x * a.y);
    let (la, lb, lc) = (a.norm_squared(), b.norm_squared(), c.norm_squared());
    let det = la * (bc - cb) + lb * (ca - ac) + lc * (ab - ba);
    let size = la * (bc.abs() + cb.abs()) + lb * (ca.abs() + ac.abs()) + lc * (ab.abs() + ba.abs());
    det > BOUND * size
}

fn bounds(all: &[Point]) -> (Point, Point) {
    let (mut low, mut high) = (all[0], all[0]);
    for p in all {
        low = low.inf(p);
        high = high.sup(p);
    }
    (low, high)
}

/// Indices of the points in the order of a Hilbert curve over their bounding square.
fn along_curve(all: &[Point], low: Point, high: Point) -> impl Iterator<Item = u32> {
    let size = (high - low).amax().max(f64::MIN_POSITIVE);
    let scale = f64::from((1u32 << HILBERT_BITS) - 1) / size;
    let mut keys: Vec<u64> = all
        .iter()
        .zip(0u64..)
        .map(|(p, i)| {
            let d = (p - low) * scale;
            (u64::from(hilbert(d.x as u32, d.y as u32)) << 32) | i
        })
        .collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| key as u32)
}

/// How far along the curve a cell lies.
fn hilbert(x: u32, y: u32) -> u32 {
    // On the way down to ever smaller squares the curve is mirrored in a diagonal and
    // turned about: without branches, which no processor would foresee.
    let (mut swapped, mut turned) = (0, 0);
    let mut along = 0;
    for k in (0..HILBERT_BITS).rev() {
        let (x, y) = ((x >> k) & 1, (y >> k) & 1);
        let exchange = ((x ^ y) & swapped) ^ turned;
        let (right, up) = (x ^ exchange, y ^ exchange);
        along = (along << 2) | ((3 * right) ^ up);
        turned ^= right & (up ^ 1);
        swapped ^= up ^ 1;
    }
    along
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Every side has its twin, every triangle turns left, and together they fill the
    /// frame.
    pub fn check(mesh: &Triangles) -> Result<(), TestCaseError> {
        let mut area = 0.0;
        for e in 0..mesh.origin.len() as u32 {
            let f = mesh.twin[e as usize];
            if f != NONE {
                prop_assert_eq!(mesh.twin[f as usize], e);
                prop_assert_eq!(mesh.origin[f as usize], mesh.end(e));
            }
            if e % 3 == 0 {
                let t = turn(mesh.at(e), mesh.at(next(e)), mesh.at(previous(e)));
                prop_assert!(t > 0.0);
                area += t / 2.0;
            }
        }
        for (v, &e) in mesh.around.iter().enumerate() {
            prop_assert_eq!(mesh.origin[e as usize] as usize, v);
        }
        let frame = mesh.points[2] - mesh.points[0];
        prop_assert!((area / (frame.x * frame.y) - 1.0).abs() < 1e-9);
        Ok(())
    }

    #[test]
    fn the_curve_goes_from_cell_to_cell() {
        let n = 32;
        let mut cells: Vec<(u32, u32, u32)> = (0..n * n)
            .map(|i| (hilbert(i % n, i / n), i % n, i / n))
            .collect();
        cells.sort_unstable();
        for w in cells.windows(2) {
            assert_eq!(w[1].0, w[0].0 + 1);
            assert_eq!(w[0].1.abs_diff(w[1].1) + w[0].2.abs_diff(w[1].2), 1);
        }
    }

    /// All sides, by the places of their ends.
    fn sides(ends: impl Iterator<Item = [Point; 2]>) -> Vec<[(u64, u64); 2]> {
        let key = |p: Point| (p.x.to_bits(), p.y.to_bits());
        let mut all: Vec<_> = ends
            .map(|[a, b]| [key(a).min(key(b)), key(a).max(key(b))])
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    proptest! {
        #[test]
        fn among_points_in_general_position_the_triangles_are_those_of_spade(
            points in prop::collection::vec((0.0f64..9.0, 0.0f64..9.0), 1..120),
        ) {
            use spade::{DelaunayTriangulation, Point2, Triangulation};
            let all: Vec<Point> = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
            let (ours, _) = Triangles::of(&all);
            let theirs: DelaunayTriangulation<Point2<f64>> = DelaunayTriangulation::bulk_load(
                ours.points.iter().map(|p| Point2::new(p.x, p.y)).collect(),
            )
            .unwrap();
            let place = |p: Point2<f64>| Point::new(p.x, p.y);
            let theirs = theirs
                .undirected_edges()
                .map(|e| e.vertices().map(|v| place(v.position())));
            let ours = (0..ours.origin.len() as u32)
                .map(|e| [ours.at(e), ours.at(next(e))]);
            prop_assert_eq!(sides(ours), sides(theirs));
        }

        #[test]
        fn points_on_a_coarse_grid_or_anywhere_are_triangulated(
            coarse in prop::collection::vec((0u8..9, 0u8..9), 1..60),
            fine in prop::collection::vec((0.0f64..9.0, 0.0f64..9.0), 0..60),
            offset in prop::sample::select(vec![0.0, 1e6]),
        ) {
            let all: Vec<Point> = coarse
                .iter()
                .map(|&(x, y)| Point::new(f64::from(x), f64::from(y)))
                .chain(fine.iter().map(|&(x, y)| Point::new(x, y)))
                .map(|p| p.map(|c| c + offset))
                .collect();
            let (mesh, ids) = Triangles::of(&all);
            check(&mesh)?;
            for (p, &id) in all.iter().zip(&ids) {
                prop_assert!((mesh.points[id as usize] - p).amax() <= 0.0);
            }
            let mut distinct: Vec<(u64, u64)> =
                all.iter().map(|p| (p.x.to_bits(), p.y.to_bits())).collect();
            distinct.sort_unstable();
            distinct.dedup();
            prop_assert_eq!(mesh.points.len(), distinct.len() + FRAME as usize);
            for (e, &f) in (0u32..).zip(&mesh.twin) {
                prop_assert!(f == NONE || !mesh.is_better_flipped(e, f));
            }
        }
    }
}
