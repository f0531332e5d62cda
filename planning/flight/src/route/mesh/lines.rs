//! Lines that must be sides of triangles: rings of an area, set into a triangulation.
//!
//! Most lines are sides already. For each other one the triangles that it crosses are
//! taken out, and what is left on its two sides is triangulated again, ear by ear: all
//! of it sees the line, so an ear is wherever the chain turns towards it. Then sides
//! are flipped back to Delaunay. Filling is linear in what is crossed.

use super::triangles::{FIXED, Triangles, WALL, next, previous};
use super::{MeshError, NONE, turn};

/// What lies ahead of a point.
enum Ahead {
    /// A side in this direction.
    Side(u32),
    /// The side on the right of the triangle that the line enters.
    Triangle(u32),
}

/// A side of what a line has cut open.
#[derive(Clone, Copy)]
struct Link {
    /// Where it starts.
    from: u32,
    /// The half-edge it was; [`NONE`] for a side made meanwhile.
    was: u32,
    /// The half-edge on its other side.
    beyond: u32,
    marks: u8,
}

/// What a line has cut open: its triangles, whose numbers are used again.
#[derive(Default)]
struct Gap {
    triangles: Vec<u32>,
    /// How many triangles are in use again.
    filled: usize,
    /// Sides with the gap on both sides of them: what they were and are, and beyond.
    slits: Vec<[u32; 3]>,
}

impl Triangles {
    /// Makes a line between two points a chain of sides. Every time that a side is
    /// set it changes from wall to no wall, or back.
    pub fn set_line(&mut self, from: u32, to: u32) -> Result<(), MeshError> {
        let mut at = from;
        while at != to {
            match self.towards(at, to) {
                Ahead::Side(e) => {
                    self.mark(e, FIXED, WALL);
                    at = self.end(e);
                }
                Ahead::Triangle(e) => {
                    if !self.cut(at, to, e) {
                        let place = |v: u32| self.points[v as usize];
                        return Err(MeshError::Crossing(place(from), place(to)));
                    }
                }
            }
        }
        Ok(())
    }

    /// Sets and toggles marks on both half-edges of a side.
    fn mark(&mut self, e: u32, set: u8, toggle: u8) {
        for e in [e, self.twin[e as usize]] {
            if e != NONE {
                let marks = &mut self.marks[e as usize];
                *marks = (*marks ^ toggle) | set;
            }
        }
    }

    /// What lies ahead of one point in the direction of another.
    fn towards(&self, at: u32, to: u32) -> Ahead {
        let first = self.around[at as usize];
        let mut e = first;
        loop {
            if self.end(e) == to {
                return Ahead::Side(e);
            }
            // Points of the area are inside the frame: the way round them is closed.
            e = self.twin[previous(e) as usize];
            if e == first || e == NONE {
                break;
            }
        }
        let (p, goal) = (self.points[at as usize], self.points[to as usize]);
        loop {
            let right = self.at(next(e));
            let side = turn(p, right, goal);
            if side >= 0.0 {
                if side <= 0.0 && (right - p).dot(&(goal - p)) > 0.0 {
                    return Ahead::Side(e);
                }
                if side > 0.0 && turn(p, self.at(previous(e)), goal) < 0.0 {
                    return Ahead::Triangle(e);
                }
            }
            e = self.twin[previous(e) as usize];
            if e == first || e == NONE {
                return Ahead::Triangle(first);
            }
        }
    }

    fn link_of(&self, e: u32) -> Link {
        Link {
            from: self.origin[e as usize],
            was: e,
            beyond: self.twin[e as usize],
            marks: self.marks[e as usize],
        }
    }

    /// Makes the line a side, from its start up to the first point on it; false if a
    /// fixed side is in the way.
    fn cut(&mut self, at: u32, to: u32, first: u32) -> bool {
        let (p, goal) = (self.points[at as usize], self.points[to as usize]);
        let mut gap = Gap::default();
        gap.triangles.push(first / 3);
        // Chains with the gap on their left: to the far end on the right of the line,
        // and (gathered backwards) from there on its left.
        let mut right = vec![self.link_of(first)];
        let mut left = vec![self.link_of(previous(first))];
        let mut crossed = next(first);
        let end = loop {
            let beyond = self.twin[crossed as usize];
            if beyond == NONE || self.marks[crossed as usize] & FIXED != 0 {
                return false;
            }
            gap.triangles.push(beyond / 3);
            let (to_apex, from_apex) = (next(beyond), previous(beyond));
            let apex = self.origin[from_apex as usize];
            let side = turn(p, goal, self.points[apex as usize]);
            if side <= 0.0 {
                right.push(self.link_of(to_apex));
                crossed = from_apex;
            }
            if side >= 0.0 {
                left.push(self.link_of(from_apex));
                crossed = to_apex;
            }
            if side.abs() <= 0.0 {
                break apex;
            }
        };
        gap.triangles.sort_unstable();
        let back = self.fill(&mut gap, right.into_iter(), end);
        let along = self.fill(&mut gap, left.into_iter().rev(), at);
        self.link(along, back);
        self.close(&gap);
        self.mark(along, FIXED, 0);
        self.settle(&gap);
        true
    }

    /// Triangulates between a chain and the line from its end `last` to its start;
    /// returns the half-edge along the line.
    fn fill(&mut self, gap: &mut Gap, chain: impl Iterator<Item = Link>, last: u32) -> u32 {
        let mut chain = chain.peekable();
        let mut open: Vec<Link> = Vec::new();
        while let Some(link) = chain.next() {
            let end = chain.peek().map_or(last, |l| l.from);
            open.push(link);
            while let [.., a, b] = open[..] {
                let corners = [a.from, b.from, end];
                let [p, q, r] = corners.map(|v| self.points[v as usize]);
                if turn(p, q, r) <= 0.0 {
                    break;
                }
                open.truncate(open.len() - 2);
                open.push(self.ear(gap, a, b, end));
            }
        }
        open.first().map_or(NONE, |link| link.beyond)
    }

    /// Puts a triangle between two links and the third side, which is returned.
    fn ear(&mut self, gap: &mut Gap, a: Link, b: Link, end: u32) -> Link {
        let e = 3 * gap.triangles[gap.filled];
        gap.filled += 1;
        for (slot, from) in (e..).zip([a.from, b.from, end]) {
            self.origin[slot as usize] = from;
            self.around[from as usize] = slot;
        }
        for (slot, link) in [(e, a), (e + 1, b)] {
            self.marks[slot as usize] = link.marks;
            let in_gap =
                || link.beyond != NONE && gap.triangles.binary_search(&(link.beyond / 3)).is_ok();
            if link.was != NONE && in_gap() {
                gap.slits.push([link.was, slot, link.beyond]);
            } else {
                self.link(slot, link.beyond);
            }
        }
        self.marks[e as usize + 2] = 0;
        Link {
            from: a.from,
            was: NONE,
            beyond: e + 2,
            marks: 0,
        }
    }

    /// Joins sides that had the gap on both sides of them.
    fn close(&mut self, gap: &Gap) {
        for &[_, slot, beyond] in &gap.slits {
            if let Some(&[_, other, _]) = gap.slits.iter().find(|s| s[0] == beyond) {
                self.link(slot, other);
            }
        }
    }

    /// Flips sides until all are Delaunay again, as far as is certain.
    fn settle(&mut self, gap: &Gap) {
        self.doubtful
            .extend(gap.triangles.iter().flat_map(|t| 3 * t..3 * t + 3));
        while let Some(e) = self.doubtful.pop() {
            let f = self.twin[e as usize];
            let may_go = f != NONE && self.marks[e as usize] & FIXED == 0;
            if may_go && self.is_better_flipped(e, f) {
                let (e1, f1) = (next(e), next(f));
                self.marks[e as usize] = self.marks[f1 as usize];
                self.marks[f as usize] = self.marks[e1 as usize];
                self.marks[e1 as usize] = 0;
                self.marks[f1 as usize] = 0;
                self.flip(e, f);
                for e in [e, e1, f, f1] {
                    self.around[self.origin[e as usize] as usize] = e;
                }
                self.doubtful.extend([e, previous(e), f, previous(f)]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::triangles::tests::check;
    use super::*;
    use proptest::prelude::*;
    use skein_geometry::frame::Point;

    #[test]
    fn a_line_across_everything_becomes_a_side() {
        let mut all = vec![Point::new(0.0, 0.0), Point::new(100.0, 0.0)];
        for i in 0..200u32 {
            let (x, y) = (
                f64::from(i) / 2.0 + 0.1,
                f64::from(i * 37 % 101) / 50.0 - 1.01,
            );
            all.push(Point::new(x, y));
        }
        let (mut mesh, ids) = Triangles::of(&all);
        mesh.set_line(ids[0], ids[1]).unwrap();
        check(&mesh).unwrap();
        assert!(matches!(mesh.towards(ids[0], ids[1]), Ahead::Side(e) if mesh.end(e) == ids[1]));
        let walls = mesh.marks.iter().filter(|&&m| m & WALL != 0).count();
        assert_eq!(walls, 2);
        // Set again it is a wall no more, and a line across it is refused.
        mesh.set_line(ids[1], ids[0]).unwrap();
        assert!(mesh.marks.iter().all(|&m| m & WALL == 0));
        let above = all.iter().position(|p| p.y > 0.5).unwrap();
        let below = all.iter().rposition(|p| p.y < -0.5).unwrap();
        assert!(matches!(
            mesh.set_line(ids[above], ids[below]),
            Err(MeshError::Crossing(_, _))
        ));
    }

    proptest! {
        #[test]
        fn lines_that_do_not_cross_are_all_set(
            dots in prop::collection::vec((0u8..24, 0u8..24), 2..80),
            fine in prop::collection::vec((0.0f64..24.0, 0.0f64..24.0), 0..40),
        ) {
            let all: Vec<Point> = dots
                .iter()
                .map(|&(x, y)| Point::new(f64::from(x), f64::from(y)))
                .chain(fine.iter().map(|&(x, y)| Point::new(x, y)))
                .collect();
            let (mut mesh, ids) = Triangles::of(&all);
            let mut set: Vec<[u32; 2]> = Vec::new();
            for pair in ids.chunks_exact(2) {
                let crosses = |a: u32, b: u32| {
                    let at = |v: u32| mesh.points[v as usize];
                    let apart = |p: u32, q: u32, r: u32, s: u32| {
                        let (x, y) = (turn(at(p), at(q), at(r)), turn(at(p), at(q), at(s)));
                        x > 0.0 && y < 0.0 || x < 0.0 && y > 0.0
                    };
                    set.iter().any(|&[c, d]| apart(a, b, c, d) && apart(c, d, a, b))
                };
                let (a, b) = (pair[0], pair[1]);
                let refused = crosses(a, b);
                let result = mesh.set_line(a, b);
                // Lines that cross in one of the points are two chains of sides.
                prop_assert!(result.is_ok() || refused);
                check(&mesh)?;
                if result.is_err() {
                    break;
                }
                set.push([a, b]);
            }
            for &[a, b] in &set {
                let mut at = a;
                while at != b {
                    let Ahead::Side(e) = mesh.towards(at, b) else {
                        return Err(TestCaseError::fail("a line was lost"));
                    };
                    prop_assert!(mesh.marks[e as usize] & FIXED != 0);
                    at = mesh.end(e);
                }
            }
            for (e, &f) in (0u32..).zip(&mesh.twin) {
                let fixed = mesh.marks[e as usize] & FIXED != 0;
                prop_assert!(f == NONE || fixed || !mesh.is_better_flipped(e, f));
            }
        }
    }
}
