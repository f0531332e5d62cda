//! Boxes and a tree of them, so that what is far apart is not measured.

use crate::plane::Point;
use libm::hypot;

/// Boxes of a leaf.
const LEAF: usize = 6;

/// An axis-parallel box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) low: Point,
    pub(crate) high: Point,
}

impl Bounds {
    pub(crate) const EMPTY: Self = Self {
        low: Point::new(f64::INFINITY, f64::INFINITY),
        high: Point::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    pub(crate) fn of(points: &[Point]) -> Self {
        let mut out = Self::EMPTY;
        for p in points {
            out.add(*p);
        }
        out
    }

    pub(crate) fn add(&mut self, p: Point) {
        self.low = Point::new(self.low.x.min(p.x), self.low.y.min(p.y));
        self.high = Point::new(self.high.x.max(p.x), self.high.y.max(p.y));
    }

    pub(crate) fn join(&self, with: &Self) -> Self {
        let mut out = *self;
        out.add(with.low);
        out.add(with.high);
        out
    }

    pub(crate) fn distance(&self, to: &Self) -> f64 {
        let gap = |low: f64, high: f64| low.max(high).max(0.0);
        hypot(
            gap(to.low.x - self.high.x, self.low.x - to.high.x),
            gap(to.low.y - self.high.y, self.low.y - to.high.y),
        )
    }

    pub(crate) fn corners(&self) -> [Point; 4] {
        [
            self.low,
            Point::new(self.high.x, self.low.y),
            self.high,
            Point::new(self.low.x, self.high.y),
        ]
    }

    fn middle(&self) -> Point {
        Point::new(
            f64::midpoint(self.low.x, self.high.x),
            f64::midpoint(self.low.y, self.high.y),
        )
    }
}

#[derive(Clone, Debug)]
struct Node {
    bounds: Bounds,
    /// Items of a leaf, or the second child of a branch, whose first is the next node.
    items: Option<(usize, usize)>,
    second: usize,
}

/// A tree of boxes.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    order: Vec<usize>,
}

impl Tree {
    pub(crate) fn new(boxes: &[Bounds]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            order: (0..boxes.len()).collect(),
        };
        if !boxes.is_empty() {
            tree.split(boxes, 0, boxes.len());
        }
        tree
    }

    /// Halves at the median, so the depth is the logarithm of the number.
    fn split(&mut self, boxes: &[Bounds], from: usize, to: usize) {
        let items = &mut self.order[from..to];
        let bounds = items
            .iter()
            .fold(Bounds::EMPTY, |all, i| all.join(&boxes[*i]));
        let here = self.nodes.len();
        let leaf = items.len() <= LEAF;
        if !leaf {
            let wide = bounds.high.x - bounds.low.x > bounds.high.y - bounds.low.y;
            let key = |i: &usize| {
                let at = boxes[*i].middle();
                if wide { at.x } else { at.y }
            };
            let half = items.len() / 2;
            items.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        }
        self.nodes.push(Node {
            bounds,
            items: leaf.then_some((from, to)),
            second: 0,
        });
        if !leaf {
            let half = from + (to - from) / 2;
            self.split(boxes, from, half);
            self.nodes[here].second = self.nodes.len();
            self.split(boxes, half, to);
        }
    }

    /// Shows the items of all boxes that are wanted, until one of them says that it is
    /// enough.
    pub(crate) fn visit(
        &self,
        wanted: impl Fn(&Bounds) -> bool,
        mut each: impl FnMut(usize) -> bool,
    ) {
        let mut open = vec![0];
        while let Some(i) = open.pop() {
            let Some(node) = self.nodes.get(i) else {
                return;
            };
            if !wanted(&node.bounds) {
                continue;
            }
            match node.items {
                Some((from, to)) => {
                    for item in &self.order[from..to] {
                        if !each(*item) {
                            return;
                        }
                    }
                }
                None => open.extend([node.second, i + 1]),
            }
        }
    }

    /// Shows items that may be nearer than the limit, near ones first; each answers with
    /// the limit from there on.
    pub(crate) fn nearest(
        &self,
        mut limit_m: f64,
        at_least: impl Fn(&Bounds) -> f64,
        mut each: impl FnMut(usize, f64) -> f64,
    ) {
        let Some(root) = self.nodes.first() else {
            return;
        };
        let mut open = vec![(at_least(&root.bounds), 0)];
        while let Some((least_m, i)) = open.pop() {
            if least_m > limit_m {
                continue;
            }
            let node = &self.nodes[i];
            match node.items {
                Some((from, to)) => {
                    for item in &self.order[from..to] {
                        limit_m = each(*item, limit_m);
                    }
                }
                None => {
                    let mut both =
                        [i + 1, node.second].map(|c| (at_least(&self.nodes[c].bounds), c));
                    if both[0].0 < both[1].0 {
                        both.reverse();
                    }
                    open.extend(both);
                }
            }
        }
    }
}
