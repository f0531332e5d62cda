//! Point location: square buckets, each with the cells that reach into it.

use super::Mesh;
use skein_geometry::frame::Point;

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

    /// Gathers which cells reach into which rows, counts, then places.
    fn fill(&mut self, mesh: &Mesh) {
        let mut spans = Vec::with_capacity(2 * mesh.n_cells());
        for cell in 0..mesh.n_cells() as u32 {
            self.spans(mesh, cell, &mut spans);
        }
        let mut starts = vec![0u32; self.n[0] * self.n[1] + 1];
        for span in &spans {
            for bucket in span.from..=span.to {
                starts[bucket as usize + 1] += 1;
            }
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut cells = vec![0u32; starts[starts.len() - 1] as usize];
        // Each start moves to its bucket's end, which is where the next one starts.
        for span in &spans {
            for bucket in span.from..=span.to {
                let at = &mut starts[bucket as usize];
                cells[*at as usize] = span.cell;
                *at += 1;
            }
        }
        starts.rotate_right(1);
        starts[0] = 0;
        self.starts = starts;
        self.cells = cells;
    }

    /// The buckets of each row that a cell reaches into.
    fn spans(&self, mesh: &Mesh, cell: u32, into: &mut Vec<Span>) {
        // Rounding moves a border by far less than this share of a bucket.
        const SLACK: f64 = 1e-6;
        let clamped = |x: f64, k: usize| x.clamp(0.0, self.n[k] as f64 - 1.0) as usize;
        let scaled = |p: Point| [0, 1].map(|k| (p[k] - self.low[k]) * self.per_m[k]);
        let (first, last) = (mesh.starts[cell as usize], mesh.starts[cell as usize + 1]);
        let edges = &mesh.edges[first as usize..last as usize];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for e in edges {
            let p = scaled(e.origin);
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let rows = clamped(low[1] - SLACK, 1)..=clamped(high[1] + SLACK, 1);
        let mut add = |row: usize, from: f64, to: f64| {
            let bucket = |x: f64| (row * self.n[0] + clamped(x, 0)) as u32;
            let (from, to) = (bucket(from - SLACK), bucket(to + SLACK));
            into.push(Span { from, to, cell });
        };
        // Low or narrow cells fill their box well enough.
        if rows.end() - rows.start() < 2 || high[0] - low[0] < 1.0 {
            rows.for_each(|row| add(row, low[0], high[0]));
            return;
        }
        for row in rows {
            let (y0, y1) = (row as f64 - SLACK, row as f64 + 1.0 + SLACK);
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut a = scaled(edges[edges.len() - 1].origin);
            for e in edges {
                let b = scaled(e.origin);
                // The part of this side between the row's lower and upper line.
                let (lo, hi) = if a[1] <= b[1] { (a, b) } else { (b, a) };
                if hi[1] >= y0 && lo[1] <= y1 {
                    let height = hi[1] - lo[1];
                    let x_at =
                        |y: f64| lo[0] + (hi[0] - lo[0]) * ((y - lo[1]) / height).clamp(0.0, 1.0);
                    let ends = if height > 0.0 {
                        [x_at(y0), x_at(y1)]
                    } else {
                        [lo[0], hi[0]]
                    };
                    from = from.min(ends[0]).min(ends[1]);
                    to = to.max(ends[0]).max(ends[1]);
                }
                a = b;
            }
            if from <= to {
                add(row, from, to);
            }
        }
    }
}

/// Neighbouring buckets of a row that a cell reaches into.
struct Span {
    from: u32,
    to: u32,
    cell: u32,
}
