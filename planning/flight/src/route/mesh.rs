//! Free space as convex cells that meet edge to edge (D2.7 §2.3.3).
//!
//! Both engines of the mesh stand on this structure: the two-point search
//! ([`super::two_point`]) and the shortest path map (in `skein-lab`).
//! It is made from ready cells, checked one by one, or by triangulating an area
//! with holes. Union and offset of the zones happen before, in
//! [`skein_geometry`].

mod blocks;
mod build;
mod lines;
mod locate;
mod repair;
mod triangles;

use robust::{Coord, orient2d};
use skein_geometry::frame::Point;
use skein_geometry::hash::Fingerprint;
use thiserror::Error;

use blocks::Blocks;
pub use build::delaunay;
use locate::Buckets;

/// No vertex, no half-edge, no cell.
pub const NONE: u32 = u32::MAX;

/// The largest coordinate a mesh may have, metres: a planet, with room to square it.
pub const MAX_MESH_COORDINATE_M: f64 = 1.0e8;

/// One side of a cell, in the direction that has the cell on its left.
#[derive(Clone, Copy, Debug)]
pub struct HalfEdge {
    /// Where it starts.
    pub origin: Point,
    /// The vertex there.
    pub vertex: u32,
    /// The same side seen from the cell beyond; [`NONE`] at a wall.
    pub twin: u32,
    /// The cell on the left.
    pub cell: u32,
    /// The block that this crossing belongs to; [`NONE`] at a wall.
    pub block: u32,
}

/// A vertex with one fan of free cells round it.
///
/// Where zones touch in a point, that point is several vertices, one for each
/// fan: nothing flies through a gap without width.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where it is.
    pub at: Point,
    /// The end of the wall that bounds the fan on its right.
    pub right_wall: Point,
    /// The end of the wall that bounds the fan on its left.
    pub left_wall: Point,
    /// The first half-edge out of the vertex, from right to left.
    pub first: u32,
    /// The last half-edge out of the vertex.
    pub last: u32,
    /// Whether the free angle is above 180°, so that a shortest path may bend here.
    pub corner: bool,
}

/// Convex cells of free space, their neighbours, and where to find a point.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// The first vertices are all places; those behind them stand where an earlier one
    /// does, and this is which.
    twice: Vec<u32>,
    /// The half-edges, cell by cell.
    pub edges: Vec<HalfEdge>,
    /// Where each cell's half-edges begin; one entry more than cells.
    pub starts: Vec<u32>,
    pub(crate) blocks: Blocks,
    buckets: Buckets,
}

/// Why there is no mesh; every variant names the place.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshError {
    /// Not a single cell.
    #[error("the mesh has no cell")]
    Empty,
    /// More cells or vertices than an index holds.
    #[error("the mesh has {0} sides, more than {1}")]
    TooLarge(usize, u32),
    /// A coordinate is not finite, or larger than any map.
    #[error("vertex {0} is no number or lies more than {MAX_MESH_COORDINATE_M} m from the origin")]
    BadCoordinate(usize),
    /// A cell with fewer than three vertices.
    #[error("cell {0} has {1} vertices, at least 3 are needed")]
    TooFewVertices(usize, usize),
    /// A cell names a vertex that does not exist.
    #[error("cell {0} names vertex {1}, the mesh has {2}")]
    NoSuchVertex(usize, u32, usize),
    /// A cell turns right somewhere, runs back over itself, or has no area.
    #[error("cell {0} is not convex and counter-clockwise at its vertex {1}")]
    NotConvex(usize, usize),
    /// A cell winds round more than once.
    #[error("cell {0} winds round more than once")]
    Winding(usize),
    /// Two cells lie on the same side of one edge.
    #[error("cells {0} and {1} lie on the same side of their edge from vertex {2} to {3}")]
    SharedSide(usize, usize, u32, u32),
    /// Two ring lines cross.
    #[error("the line from {0} to {1} crosses another line")]
    Crossing(Point, Point),
    /// Cells overlap round a vertex.
    #[error("the cells round vertex {0} overlap")]
    Overlap(usize),
}

impl Mesh {
    /// Checks cells (counter-clockwise rings of indices into `vertices`) and links
    /// those that share an edge. A vertex in the middle of another cell's edge
    /// joins nothing: that edge is a wall.
    ///
    /// # Complexity
    /// O(n) in the number of sides, beside the point location's buckets.
    ///
    /// # Errors
    /// [`MeshError`] with the cell and vertex by index. That two cells without a
    /// common edge overlap is not looked for.
    pub fn from_cells(vertices: &[Point], cells: &[Vec<u32>]) -> Result<Self, MeshError> {
        check_vertices(vertices)?;
        check_cells(vertices, cells)?;
        let n_sides = cells.iter().map(Vec::len).sum();
        if n_sides >= NONE as usize / 2 {
            return Err(MeshError::TooLarge(n_sides, NONE / 2));
        }
        let mut starts = Vec::with_capacity(cells.len() + 1);
        let mut edges = Vec::with_capacity(n_sides);
        for (c, ring) in cells.iter().enumerate() {
            starts.push(edges.len() as u32);
            edges.extend(ring.iter().map(|&v| HalfEdge {
                origin: vertices[v as usize],
                vertex: v,
                twin: NONE,
                cell: c as u32,
                block: NONE,
            }));
        }
        starts.push(edges.len() as u32);
        let (from, out) = edges_by_origin(&edges, vertices.len());
        find_twins(&mut edges, &starts, &from, &out)?;
        Self::finish(vertices, edges, starts)
    }

    /// Derives vertices, blocks and point location from linked half-edges.
    fn finish(points: &[Point], edges: Vec<HalfEdge>, starts: Vec<u32>) -> Result<Self, MeshError> {
        let mut mesh = Self {
            vertices: Vec::new(),
            twice: Vec::new(),
            edges,
            starts,
            blocks: Blocks::default(),
            buckets: Buckets::default(),
        };
        mesh.split_fans(points)?;
        mesh.blocks = Blocks::of(&mut mesh.edges, &mesh.starts);
        mesh.buckets = Buckets::of(&mesh);
        Ok(mesh)
    }

    /// The same number for the same cells, on every machine: processes that built
    /// their own mesh compare it.
    #[must_use]
    pub fn content_hash(&self) -> u64 {
        let start = Fingerprint::of("mesh").with_indices(self.starts.iter().copied());
        let add = |c: Fingerprint, e: &HalfEdge| {
            let links = (u64::from(e.vertex) << 32) | u64::from(e.twin);
            c.with_point(e.origin).with(links)
        };
        self.edges.iter().fold(start, add).hash()
    }

    /// Number of convex cells.
    #[must_use]
    pub fn n_cells(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of vertices; a point where zones touch counts once for each side.
    #[must_use]
    pub fn n_vertices(&self) -> usize {
        self.vertices.len()
    }

    /// Number of vertices at which a shortest path may bend.
    #[must_use]
    pub fn n_corners(&self) -> usize {
        self.vertices.iter().filter(|v| v.corner).count()
    }

    /// The corners of a cell, counter-clockwise.
    pub fn cell(&self, cell: usize) -> impl Iterator<Item = Point> + '_ {
        self.edges[self.starts[cell] as usize..self.starts[cell + 1] as usize]
            .iter()
            .map(|e| e.origin)
    }

    /// Whether `p` is in free space, its border included.
    #[must_use]
    pub fn contains(&self, p: Point) -> bool {
        self.locate(p).is_some()
    }

    /// The first cell that contains `p`, borders included.
    #[must_use]
    pub fn locate(&self, p: Point) -> Option<usize> {
        self.buckets
            .at(p)
            .iter()
            .find(|&&c| self.cell_contains(c, p))
            .map(|&c| c as usize)
    }

    /// All cells that contain `p`: several, if it lies on an edge or a vertex.
    pub fn cells_at(&self, p: Point, into: &mut Vec<u32>) {
        into.clear();
        into.extend(
            self.buckets
                .at(p)
                .iter()
                .filter(|&&c| self.cell_contains(c, p)),
        );
    }

    /// A point inside the part of the mesh that has the most cells.
    #[must_use]
    pub fn middle_of_largest_part(&self) -> Point {
        self.middle_of(self.blocks.largest_part())
    }

    /// Whether two cells are joined by free space.
    #[must_use]
    pub fn joined(&self, a: u32, b: u32) -> bool {
        self.blocks.joined(a, b)
    }

    /// A point inside a cell.
    #[must_use]
    pub fn middle_of(&self, cell: u32) -> Point {
        let ring = self.cell(cell as usize).collect::<Vec<_>>();
        let sum = ring
            .iter()
            .fold(nalgebra::Vector2::zeros(), |s, p| s + p.coords);
        Point::from(sum / ring.len() as f64)
    }

    /// Calls `visit` with every cell that contains `p`.
    #[inline]
    pub fn for_cells_at(&self, p: Point, mut visit: impl FnMut(u32)) {
        for &cell in self.buckets.at(p) {
            if self.cell_contains(cell, p) {
                visit(cell);
            }
        }
    }

    /// The first vertex at the place of a vertex.
    fn place_of(&self, vertex: u32) -> u32 {
        let n_places = self.vertices.len() - self.twice.len();
        let extra = (vertex as usize).checked_sub(n_places);
        extra.map_or(vertex, |i| self.twice[i])
    }

    fn cell_contains(&self, cell: u32, p: Point) -> bool {
        let first = self.starts[cell as usize] as usize;
        let last = self.starts[cell as usize + 1] as usize;
        let mut a = self.edges[last - 1].origin;
        for e in &self.edges[first..last] {
            if turn(a, e.origin, p) < 0.0 {
                return false;
            }
            a = e.origin;
        }
        true
    }

    /// The next half-edge round the same cell.
    #[must_use]
    #[inline]
    pub fn next(&self, edge: u32) -> u32 {
        let cell = self.edges[edge as usize].cell as usize;
        if edge + 1 == self.starts[cell + 1] {
            self.starts[cell]
        } else {
            edge + 1
        }
    }

    /// The half-edge before, round the same cell.
    #[must_use]
    #[inline]
    pub fn previous(&self, edge: u32) -> u32 {
        let cell = self.edges[edge as usize].cell as usize;
        if edge == self.starts[cell] {
            self.starts[cell + 1] - 1
        } else {
            edge - 1
        }
    }

    /// Gives every fan of cells round a point its own vertex.
    fn split_fans(&mut self, points: &[Point]) -> Result<(), MeshError> {
        let (from, out) = edges_by_origin(&self.edges, points.len());
        self.vertices = points.iter().map(|&p| Vertex::lonely(p)).collect();
        for (v, &at) in points.iter().enumerate() {
            let outgoing = &out[from[v] as usize..from[v + 1] as usize];
            let mut n_fans = 0;
            let mut n_seen = 0;
            for &e in outgoing {
                if self.edges[e as usize].twin == NONE {
                    let vertex = if n_fans == 0 { v } else { self.vertices.len() };
                    let (fan, n) = self.bounded_fan(at, e, vertex as u32);
                    if n_fans == 0 {
                        self.vertices[v] = fan;
                    } else {
                        self.vertices.push(fan);
                        self.twice.push(v as u32);
                    }
                    n_fans += 1;
                    n_seen += n;
                }
            }
            if n_fans == 0 && !outgoing.is_empty() {
                let first = outgoing[0];
                self.vertices[v].first = first;
                self.vertices[v].last = first;
                n_seen = self.round_trip(first);
            }
            // A second circle round the same point can only lie over the first.
            if n_seen != outgoing.len() {
                return Err(MeshError::Overlap(v));
            }
        }
        Ok(())
    }

    /// Walks the fan that begins at the wall `first`; returns its number of cells.
    fn bounded_fan(&mut self, at: Point, first: u32, vertex: u32) -> (Vertex, usize) {
        let mut last = first;
        let mut n = 1;
        self.edges[first as usize].vertex = vertex;
        let left = loop {
            let before = self.previous(last);
            let across = self.edges[before as usize].twin;
            if across == NONE {
                break self.edges[before as usize].origin;
            }
            last = across;
            self.edges[last as usize].vertex = vertex;
            n += 1;
        };
        let right = self.edges[self.next(first) as usize].origin;
        let bend = turn(at, right, left);
        let slit = bend.abs() <= 0.0 && (right - at).dot(&(left - at)) > 0.0;
        let fan = Vertex {
            at,
            right_wall: right,
            left_wall: left,
            first,
            last,
            corner: bend < 0.0 || slit,
        };
        (fan, n)
    }

    /// How many cells a full circle round a vertex has.
    fn round_trip(&self, first: u32) -> usize {
        let mut n = 0;
        let mut e = first;
        loop {
            n += 1;
            e = self.edges[self.previous(e) as usize].twin;
            if e == first || e == NONE || n > self.edges.len() {
                return n;
            }
        }
    }
}

impl Vertex {
    fn lonely(at: Point) -> Self {
        Self {
            at,
            right_wall: at,
            left_wall: at,
            first: NONE,
            last: NONE,
            corner: false,
        }
    }
}

/// Twice the area of a → b → c with its exact sign: above zero for a left turn.
#[must_use]
#[inline]
pub fn turn(a: Point, b: Point, c: Point) -> f64 {
    // The error bound of the plain expression (Shewchuk 1997); most calls end here.
    const BOUND: f64 = 3.330_669_073_875_471_6e-16;
    let left = (a.x - c.x) * (b.y - c.y);
    let right = (a.y - c.y) * (b.x - c.x);
    let det = left - right;
    if det.abs() > BOUND * (left.abs() + right.abs()) {
        return det;
    }
    exact_turn(a, b, c)
}

#[cold]
fn exact_turn(a: Point, b: Point, c: Point) -> f64 {
    let coord = |p: Point| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// Half-edges sorted by where they start: offsets a vertex, and the list.
fn edges_by_origin(edges: &[HalfEdge], n: usize) -> (Vec<u32>, Vec<u32>) {
    let mut from = vec![0u32; n + 1];
    for e in edges {
        from[e.vertex as usize + 1] += 1;
    }
    for v in 0..n {
        from[v + 1] += from[v];
    }
    let mut fill = from.clone();
    let mut out = vec![0u32; edges.len()];
    for (i, e) in edges.iter().enumerate() {
        let slot = &mut fill[e.vertex as usize];
        out[*slot as usize] = i as u32;
        *slot += 1;
    }
    (from, out)
}

/// Joins half-edges that run against each other.
fn find_twins(
    edges: &mut [HalfEdge],
    starts: &[u32],
    from: &[u32],
    out: &[u32],
) -> Result<(), MeshError> {
    let outgoing = |v: u32| &out[from[v as usize] as usize..from[v as usize + 1] as usize];
    let mut ends = vec![0u32; edges.len()];
    for ring in starts.windows(2) {
        let (first, last) = (ring[0] as usize, ring[1] as usize - 1);
        for i in first..last {
            ends[i] = edges[i + 1].vertex;
        }
        ends[last] = edges[first].vertex;
    }
    for i in 0..edges.len() as u32 {
        let (a, b) = (edges[i as usize].vertex, ends[i as usize]);
        let same = outgoing(a)
            .iter()
            .find(|&&j| j > i && ends[j as usize] == b);
        if let Some(&j) = same {
            let cell = |e: u32| edges[e as usize].cell as usize;
            return Err(MeshError::SharedSide(cell(i), cell(j), a, b));
        }
        let back = outgoing(b).iter().find(|&&j| ends[j as usize] == a);
        edges[i as usize].twin = back.copied().unwrap_or(NONE);
    }
    Ok(())
}

fn check_vertices(vertices: &[Point]) -> Result<(), MeshError> {
    let bad = |c: f64| !c.is_finite() || c.abs() > MAX_MESH_COORDINATE_M;
    match vertices.iter().position(|p| bad(p.x) || bad(p.y)) {
        Some(v) => Err(MeshError::BadCoordinate(v)),
        None if vertices.len() >= NONE as usize => Err(MeshError::TooLarge(vertices.len(), NONE)),
        None => Ok(()),
    }
}

/// Convex, counter-clockwise, once round; vertices along a straight side are fine.
fn check_cells(vertices: &[Point], cells: &[Vec<u32>]) -> Result<(), MeshError> {
    if cells.is_empty() {
        return Err(MeshError::Empty);
    }
    for (c, ring) in cells.iter().enumerate() {
        let n = ring.len();
        if n < 3 {
            return Err(MeshError::TooFewVertices(c, n));
        }
        if let Some(&v) = ring.iter().find(|&&v| v as usize >= vertices.len()) {
            return Err(MeshError::NoSuchVertex(c, v, vertices.len()));
        }
        let at = |i: usize| vertices[ring[i % n] as usize];
        let mut bends = 0;
        let mut wraps = 0;
        for i in 0..n {
            let (a, b, d) = (at(i), at(i + 1), at(i + 2));
            let bend = turn(a, b, d);
            let back = (b - a).dot(&(d - b)) <= 0.0;
            if bend < 0.0 || (bend <= 0.0 && back) {
                return Err(MeshError::NotConvex(c, (i + 1) % n));
            }
            bends += usize::from(bend > 0.0);
            // A convex ring goes once from rightward to leftward edges.
            let rightward = |p: Point, q: Point| (q.x, q.y) > (p.x, p.y);
            wraps += usize::from(rightward(a, b) && !rightward(b, d));
        }
        if bends < 3 {
            return Err(MeshError::NotConvex(c, 0));
        }
        if wraps != 1 {
            return Err(MeshError::Winding(c));
        }
    }
    Ok(())
}
