//! What a point sees of a mesh, cell by cell: the step that both engines share.
//!
//! A sight is bounded by two rays from its root. Carried into a cell it meets
//! vertices, at which a path may bend, and sides, through which it goes on,
//! narrower. A corner that a path bends round sees what lies between its wall
//! and the straight way on. All decisions are exact orientation tests.

use super::mesh::{Mesh, NONE, turn};
use skein_geometry::frame::Point;

/// The start of the paths, as the root of a sight.
pub const SOURCE: u32 = NONE - 2;

/// A straight line through two points, for exact side tests.
#[derive(Clone, Copy, Debug)]
pub struct Ray(pub Point, pub Point);

impl Ray {
    /// Above zero if `p` lies left of the line.
    #[inline]
    #[must_use]
    pub fn side(self, p: Point) -> f64 {
        turn(self.0, self.1, p)
    }

    /// Where the line meets the line through `a` and `b`, kept between them.
    /// Rounded: good for lengths, not for decisions.
    #[must_use]
    pub fn crossing(self, a: Point, b: Point) -> Point {
        let d = self.1 - self.0;
        let to_a = d.perp(&(a - self.0));
        let to_b = d.perp(&(b - self.0));
        let span = to_a - to_b;
        if span.abs() > 0.0 {
            a + (b - a) * (to_a / span).clamp(0.0, 1.0)
        } else {
            a
        }
    }
}

/// A sight on its way into a cell.
#[derive(Clone, Copy, Debug)]
pub struct View<B> {
    /// The vertex that sees, or [`SOURCE`].
    pub root: u32,
    /// The side that is looked through, seen from the cell beyond.
    pub edge: u32,
    /// The ray on the left.
    pub left: B,
    /// The ray on the right.
    pub right: B,
}

/// Who follows sights, and what it does with what they meet.
pub trait Watcher {
    /// How it remembers the ray that bounds a sight.
    type Bound: Copy;

    /// The ray through a vertex.
    fn through(&self, vertex: u32) -> Self::Bound;
    /// The straight continuation of the way to the root.
    fn straight_on(&self) -> Self::Bound;
    /// The vertex a bound goes through, if it goes through one.
    fn vertex_of(&self, bound: Self::Bound) -> u32;
    /// The line of a bound.
    fn ray(&self, root: u32, bound: Self::Bound) -> Ray;
    /// Where a root is.
    fn at(&self, root: u32) -> Point;
    /// Whether a cell is worth looking into.
    fn is_open(&self, cell: u32) -> bool;
    /// The root sees all of this cell from a corner of it, as far as paths go there.
    fn see_cell(&mut self, root: u32, cell: u32);
    /// The root sees this vertex.
    fn see_vertex(&mut self, root: u32, vertex: u32);
    /// The root sees through this side of a cell, seen from within.
    fn see_side(&mut self, root: u32, edge: u32, left: Self::Bound, right: Self::Bound);
}

/// Everything the start sees in a cell that contains it.
pub fn look_from_start<W: Watcher>(watcher: &mut W, mesh: &Mesh, cell: u32) {
    let from = watcher.at(SOURCE);
    for j in mesh.starts[cell as usize]..mesh.starts[cell as usize + 1] {
        let a = mesh.edges[j as usize];
        let b = mesh.edges[mesh.next(j) as usize];
        watcher.see_vertex(SOURCE, a.vertex);
        if turn(from, a.origin, b.origin) > 0.0 {
            let (left, right) = (watcher.through(b.vertex), watcher.through(a.vertex));
            watcher.see_side(SOURCE, j, left, right);
        }
    }
}

/// Carries a sight through a cell to its other sides.
#[inline]
pub fn look_through<W: Watcher>(watcher: &mut W, mesh: &Mesh, view: View<W::Bound>) {
    let root = view.root;
    let right = watcher.ray(root, view.right);
    let left = watcher.ray(root, view.left);
    let mut j = mesh.next(view.edge);
    let mut a = &mesh.edges[j as usize];
    let mut a_right = if a.vertex == watcher.vertex_of(view.right) {
        0.0
    } else {
        right.side(a.origin)
    };
    // Several vertices may lie on the left ray; all are seen, nothing beyond them.
    let mut at_left = false;
    loop {
        let k = mesh.next(j);
        if k == view.edge && at_left {
            return;
        }
        let b = &mesh.edges[k as usize];
        let b_right = right.side(b.origin);
        if b_right >= 0.0 {
            let b_left = left.side(b.origin);
            if b_left <= 0.0 && k != view.edge {
                watcher.see_vertex(root, b.vertex);
            }
            if b_right > 0.0 {
                if !at_left {
                    let r = if a_right >= 0.0 {
                        watcher.through(a.vertex)
                    } else {
                        view.right
                    };
                    let l = if b_left <= 0.0 {
                        watcher.through(b.vertex)
                    } else {
                        view.left
                    };
                    watcher.see_side(root, j, l, r);
                }
                if b_left > 0.0 {
                    return;
                }
                at_left = b_left >= 0.0;
            }
        }
        if k == view.edge {
            return;
        }
        (j, a, a_right) = (k, b, b_right);
    }
}

/// Whether a path from `from` over this vertex may bend there, right and left:
/// its wall must lie all on that side, or the bend could be pulled straight.
#[inline]
#[must_use]
pub fn bends(mesh: &Mesh, from: Point, vertex: u32) -> (bool, bool) {
    let v = &mesh.vertices[vertex as usize];
    if !v.corner {
        return (false, false);
    }
    let right = turn(from, v.at, v.right_wall);
    let left = turn(from, v.at, v.left_wall);
    (right <= 0.0 && left <= 0.0, right >= 0.0 && left >= 0.0)
}

/// Opens a corner: what it sees between its wall and the straight way on.
pub fn look_round<W: Watcher>(watcher: &mut W, mesh: &Mesh, root: u32) {
    let on = watcher.ray(root, watcher.straight_on());
    let (right, left) = bends(mesh, on.0, root);
    let v = &mesh.vertices[root as usize];
    if right {
        look_right(watcher, mesh, root, on, v.first);
    }
    if left {
        look_left(watcher, mesh, root, on, v.last);
    }
}

/// Bends right: from the wall on the right up to the straight way on.
fn look_right<W: Watcher>(watcher: &mut W, mesh: &Mesh, root: u32, on: Ray, first: u32) {
    let origin = on.1;
    let mut h = first;
    loop {
        let cell = mesh.edges[h as usize].cell;
        let open = watcher.is_open(cell);
        if open {
            watcher.see_cell(root, cell);
        }
        let end = mesh.previous(h);
        let mut j = mesh.next(h);
        let mut a = &mesh.edges[j as usize];
        let mut a_on = on.side(a.origin);
        if open {
            watcher.see_vertex(root, a.vertex);
        }
        while j != end {
            let k = mesh.next(j);
            let b = &mesh.edges[k as usize];
            let b_on = on.side(b.origin);
            if open {
                if b_on <= 0.0 {
                    watcher.see_vertex(root, b.vertex);
                }
                if a_on < 0.0 && turn(origin, a.origin, b.origin) > 0.0 {
                    let l = if b_on <= 0.0 {
                        watcher.through(b.vertex)
                    } else {
                        watcher.straight_on()
                    };
                    watcher.see_side(root, j, l, watcher.through(a.vertex));
                }
            }
            if b_on > 0.0 {
                return;
            }
            (j, a, a_on) = (k, b, b_on);
        }
        if a_on >= 0.0 {
            return;
        }
        h = mesh.edges[end as usize].twin;
        if h == NONE {
            return;
        }
    }
}

/// Bends left: from the wall on the left down to the straight way on.
fn look_left<W: Watcher>(watcher: &mut W, mesh: &Mesh, root: u32, on: Ray, last: u32) {
    let origin = on.1;
    let mut h = last;
    loop {
        let cell = mesh.edges[h as usize].cell;
        let open = watcher.is_open(cell);
        if open {
            watcher.see_cell(root, cell);
        }
        let end = mesh.next(h);
        let mut k = mesh.previous(h);
        let mut b = &mesh.edges[k as usize];
        let mut b_on = on.side(b.origin);
        if open {
            watcher.see_vertex(root, b.vertex);
        }
        while k != end {
            let j = mesh.previous(k);
            let a = &mesh.edges[j as usize];
            let a_on = on.side(a.origin);
            if open {
                if a_on >= 0.0 {
                    watcher.see_vertex(root, a.vertex);
                }
                if b_on > 0.0 && turn(origin, a.origin, b.origin) > 0.0 {
                    let r = if a_on >= 0.0 {
                        watcher.through(a.vertex)
                    } else {
                        watcher.straight_on()
                    };
                    watcher.see_side(root, j, watcher.through(b.vertex), r);
                }
            }
            if a_on < 0.0 {
                return;
            }
            (k, b, b_on) = (j, a, a_on);
        }
        if b_on <= 0.0 {
            return;
        }
        let twin = mesh.edges[h as usize].twin;
        if twin == NONE {
            return;
        }
        h = mesh.next(twin);
    }
}
