//! Point location: square buckets, each with the cells that reach into it.

use super::Mesh;
use crate::frame::Point;

/// Buckets a cell on average: most buckets then hold one to three cells.
const BUCKETS_PER_CELL: f64 = 2.0;

/// The most buckets a side; 4096² indices are 64 MB.
const MAX_PER_SIDE: f64 = 4096.0;

/// A grid over the mesh's bounding box.
#[derive(Clone, Debug, Default)]
pub(crate) struct Buckets {
    low: [f64; 2],
    per_m: [f64; 2],
    n: [usize; 2],
    starts: Vec<u32>,
    cells: Vec<u32>,
}

impl Buckets {
    pub fn of(mesh: &Mesh) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for e in &mesh.edges {
            for k in 0..2 {
                low[k] = low[k].min(e.origin[k]);
                high[k] = high[k].max(e.origin[k]);
            }
        }
        let size = [high[0] - low[0], high[1] - low[1]];
        let area = (size[0] * size[1]).max(f64::MIN_POSITIVE);
        let per_m = (mesh.n_cells() as f64 * BUCKETS_PER_CELL / area).sqrt();
        let side = |k: usize| (size[k] * per_m).ceil().clamp(1.0, MAX_PER_SIDE);
        let n = [side(0), side(1)];
        let mut grid = Self {
            low,
            per_m: [n[0] / size[0], n[1] / size[1]],
            n: [n[0] as usize, n[1] as usize],
            starts: Vec::new(),
            cells: Vec::new(),
        };
        grid.fill(mesh);
        grid
    }

    /// The cells that may contain `p`.
    #[inline]
    pub fn at(&self, p: Point) -> &[u32] {
        let mut index = [0; 2];
        for k in 0..2 {
            let i = ((p[k] - self.low[k]) * self.per_m[k]).floor();
            // One bucket of slack for rounding; a NaN fails both comparisons.
            if !(i >= -1.0 && i <= self.n[k] as f64) {
                return &[];
            }
            index[k] = (i.max(0.0) as usize).min(self.n[k] - 1);
        }
        let bucket = index[1] * self.n[0] + index[0];
        &self.cells[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }

    /// Two passes over all cells: count, then place.
    fn fill(&mut self, mesh: &Mesh) {
        let mut counts = vec![0u32; self.n[0] * self.n[1] + 1];
        let mut spans = Vec::new();
        for cell in 0..mesh.n_cells() {
            self.spans(mesh, cell, &mut spans);
            for &(row, from, to) in &spans {
                for bucket in row * self.n[0] + from..=row * self.n[0] + to {
                    counts[bucket + 1] += 1;
                }
            }
        }
        for i in 1..counts.len() {
            counts[i] += counts[i - 1];
        }
        let mut fill = counts.clone();
        let mut cells = vec![0u32; counts[counts.len() - 1] as usize];
        for cell in 0..mesh.n_cells() {
            self.spans(mesh, cell, &mut spans);
            for &(row, from, to) in &spans {
                for bucket in row * self.n[0] + from..=row * self.n[0] + to {
                    cells[fill[bucket] as usize] = cell as u32;
                    fill[bucket] += 1;
                }
            }
        }
        self.starts = counts;
        self.cells = cells;
    }

    /// The row and the first and last column of buckets that a cell reaches into.
    fn spans(&self, mesh: &Mesh, cell: usize, into: &mut Vec<(usize, usize, usize)>) {
        // Rounding moves a border by far less than this share of a bucket.
        const SLACK: f64 = 1e-6;
        into.clear();
        let column = |x: f64| x.clamp(0.0, self.n[0] as f64 - 1.0) as usize;
        let row = |y: f64| y.clamp(0.0, self.n[1] as f64 - 1.0) as usize;
        let scaled = |p: Point| {
            let at = |k: usize| (p[k] - self.low[k]) * self.per_m[k];
            (at(0), at(1))
        };
        let edges = &mesh.edges[mesh.starts[cell] as usize..mesh.starts[cell + 1] as usize];
        let (mut bottom, mut top) = (f64::INFINITY, f64::NEG_INFINITY);
        for e in edges {
            let (_, y) = scaled(e.origin);
            bottom = bottom.min(y);
            top = top.max(y);
        }
        for r in row(bottom - SLACK)..=row(top + SLACK) {
            let (y0, y1) = (r as f64 - SLACK, r as f64 + 1.0 + SLACK);
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut a = scaled(edges[edges.len() - 1].origin);
            for e in edges {
                let b = scaled(e.origin);
                // The part of this side between the row's lower and upper line.
                let (lo, hi) = if a.1 <= b.1 { (a, b) } else { (b, a) };
                if hi.1 >= y0 && lo.1 <= y1 {
                    let height = hi.1 - lo.1;
                    let x_at = |y: f64| {
                        if height > 0.0 {
                            lo.0 + (hi.0 - lo.0) * ((y - lo.1) / height).clamp(0.0, 1.0)
                        } else {
                            lo.0
                        }
                    };
                    for x in [
                        x_at(y0),
                        x_at(y1),
                        if height > 0.0 { x_at(y0) } else { hi.0 },
                    ] {
                        from = from.min(x);
                        to = to.max(x);
                    }
                }
                a = b;
            }
            if from <= to {
                into.push((r, column(from - SLACK), column(to + SLACK)));
            }
        }
    }
}
