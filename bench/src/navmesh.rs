//! Public instances of shortest-path problems: `.mesh` files, version 2, of the
//! Polyanya programs, and lists of queries with the reference length of each.

use skein_flight::route::mesh::{Mesh, MeshError};
use skein_geometry::frame::Point;
use std::str::FromStr;
use thiserror::Error;

/// The most vertices, cells or sides that a file may announce before it has shown them.
const MAX_COUNT: usize = 50_000_000;

/// Why a file is no mesh or no list of queries; every variant names the place.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum InstanceError {
    /// The file ends too early.
    #[error("line {0}: the file ends where {1} should stand")]
    Ends(usize, &'static str),
    /// Something else stands there.
    #[error("line {0}: {2:?} stands where {1} should stand")]
    Unexpected(usize, &'static str, String),
    /// Something follows the last polygon.
    #[error("line {0}: {1:?} follows the last polygon")]
    Trailing(usize, String),
    /// A line of queries without five numbers.
    #[error("line {0}: a query is five numbers: from x y, to x y, length")]
    NotAQuery(usize),
    /// The mesh is malformed; cells are named by the line they stand in.
    #[error("line {0}: {1}")]
    Mesh(usize, MeshError),
    /// The mesh is malformed as a whole.
    #[error(transparent)]
    Whole(#[from] MeshError),
}

/// A query and the length of its shortest path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// Where the path begins.
    pub from: Point,
    /// Where it ends.
    pub to: Point,
    /// Its reference length, metres.
    pub length_m: f64,
}

/// Words with their lines.
struct Words<'a> {
    text: std::str::SplitWhitespace<'a>,
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    line: usize,
}

impl<'a> Words<'a> {
    fn of(text: &'a str) -> Self {
        Self {
            text: "".split_whitespace(),
            lines: text.lines().enumerate(),
            line: 0,
        }
    }

    fn word(&mut self) -> Option<&'a str> {
        loop {
            if let Some(word) = self.text.next() {
                return Some(word);
            }
            let (i, line) = self.lines.next()?;
            self.line = i + 1;
            self.text = line.split_whitespace();
        }
    }

    fn next<T: FromStr>(&mut self, what: &'static str) -> Result<T, InstanceError> {
        let word = self.word().ok_or(InstanceError::Ends(self.line, what))?;
        word.parse()
            .map_err(|_| InstanceError::Unexpected(self.line, what, word.to_string()))
    }

    fn count(&mut self, what: &'static str) -> Result<usize, InstanceError> {
        let n: usize = self.next(what)?;
        if n > MAX_COUNT {
            return Err(InstanceError::Unexpected(self.line, what, n.to_string()));
        }
        Ok(n)
    }

    fn expect(&mut self, what: &'static str, text: &str) -> Result<(), InstanceError> {
        let word: String = self.next(what)?;
        if word == text {
            Ok(())
        } else {
            Err(InstanceError::Unexpected(self.line, what, word))
        }
    }
}

/// Vertices and cells of a `.mesh` file, with the line of each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// Where the vertices are.
    pub vertices: Vec<Point>,
    /// The line of each vertex.
    pub vertex_lines: Vec<usize>,
    /// Counter-clockwise indices of vertices.
    pub cells: Vec<Vec<u32>>,
    /// The line of each cell.
    pub cell_lines: Vec<usize>,
}

/// Reads a `.mesh` file. The neighbours it lists are read over: who shares an edge
/// follows from the vertices, and need not be trusted.
///
/// # Errors
/// [`InstanceError`] with the line.
pub fn read_cells(text: &str) -> Result<Cells, InstanceError> {
    let mut words = Words::of(text);
    words.expect("the word `mesh`", "mesh")?;
    words.expect("the version, 2,", "2")?;
    let n_vertices = words.count("the number of vertices")?;
    let n_cells = words.count("the number of polygons")?;
    let mut read = Cells::default();
    for _ in 0..n_vertices {
        let x = words.next("the x of a vertex")?;
        read.vertex_lines.push(words.line);
        let y = words.next("the y of a vertex")?;
        read.vertices.push(Point::new(x, y));
        for _ in 0..words.count("the number of neighbours")? {
            words.next::<i64>("a neighbouring polygon")?;
        }
    }
    for _ in 0..n_cells {
        let n = words.count("the number of corners")?;
        read.cell_lines.push(words.line);
        let mut ring = Vec::new();
        for _ in 0..n {
            ring.push(words.next("a vertex of a polygon")?);
        }
        for _ in 0..n {
            words.next::<i64>("a neighbouring polygon")?;
        }
        read.cells.push(ring);
    }
    match words.word() {
        Some(word) => Err(InstanceError::Trailing(words.line, word.to_string())),
        None => Ok(read),
    }
}

/// Reads a `.mesh` file and links its cells.
///
/// # Errors
/// [`InstanceError`] with the line.
pub fn read_mesh(text: &str) -> Result<Mesh, InstanceError> {
    let read = read_cells(text)?;
    link(&read)
}

/// Links the cells of a file.
///
/// # Errors
/// [`InstanceError`] with the line.
pub fn link(read: &Cells) -> Result<Mesh, InstanceError> {
    Mesh::from_cells(&read.vertices, &read.cells).map_err(|error| {
        let line = match error {
            MeshError::BadCoordinate(v) | MeshError::Overlap(v) => read.vertex_lines.get(v),
            MeshError::TooFewVertices(c, _)
            | MeshError::NoSuchVertex(c, _, _)
            | MeshError::NotConvex(c, _)
            | MeshError::Winding(c)
            | MeshError::SharedSide(_, c, _, _) => read.cell_lines.get(c),
            _ => None,
        };
        match line {
            Some(&line) => InstanceError::Mesh(line, error),
            None => InstanceError::Whole(error),
        }
    })
}

/// Reads queries, one a line: `from_x from_y to_x to_y length`.
///
/// # Errors
/// [`InstanceError`] with the line.
pub fn read_queries(text: &str) -> Result<Vec<Query>, InstanceError> {
    let mut queries = Vec::new();
    for (i, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        let numbers: Vec<f64> = line
            .split_whitespace()
            .map(f64::from_str)
            .collect::<Result<_, _>>()
            .map_err(|_| InstanceError::NotAQuery(i + 1))?;
        let &[ax, ay, bx, by, length_m] = &numbers[..] else {
            return Err(InstanceError::NotAQuery(i + 1));
        };
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err(InstanceError::NotAQuery(i + 1));
        }
        queries.push(Query {
            from: Point::new(ax, ay),
            to: Point::new(bx, by),
            length_m,
        });
    }
    Ok(queries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_flight::route::two_point::Search;

    const MESH: &str = include_str!("../data/arena/arena-merged.mesh");
    const QUERIES: &str = include_str!("../data/arena/arena.ref.txt");

    #[test]
    fn every_query_of_the_arena_has_its_reference_length() {
        let mesh = read_mesh(MESH).unwrap();
        let mut search = Search::new(&mesh);
        let queries = read_queries(QUERIES).unwrap();
        assert_eq!((mesh.n_cells(), queries.len()), (55, 160));
        for q in queries {
            let there = search.distance_m(q.from, q.to).unwrap();
            let back = search.distance_m(q.to, q.from).unwrap();
            assert!((there - q.length_m).abs() <= 1e-9 * q.length_m.max(1.0));
            assert!((there - back).abs() <= 1e-9 * there.max(1.0));
        }
    }

    #[test]
    fn a_bad_file_names_its_line() {
        let line = |text: &str| read_mesh(text).unwrap_err().to_string();
        assert!(line("").starts_with("line 0: the file ends"));
        assert!(line("mess\n2").starts_with("line 1: \"mess\""));
        assert!(line("mesh\n3\n0 0").starts_with("line 2: \"3\""));
        assert!(line("mesh\n2\n99999999999 1").starts_with("line 3:"));
        let head = "mesh\n2\n3 1\n0 0 0\n1 0 0\n0 1 0\n";
        assert!(line(head).starts_with("line 6: the file ends"));
        assert!(line(&format!("{head}3 0 1 7 -1 -1 -1")).starts_with("line 7: cell 0 names"));
        assert!(line(&format!("{head}3 0 2 1 -1 -1 -1")).starts_with("line 7: cell 0 is not"));
        assert!(line(&format!("{head}3 0 1 2 -1 -1 -1 5")).starts_with("line 7: \"5\""));
        assert!(line("mesh\n2\n1 0\nnan 0 0").starts_with("line 4: vertex 0"));
        assert!(read_mesh(&format!("{head}3 0 1 2 -1 -1 -1")).is_ok());
        assert_eq!(
            read_queries("1 2 3 4 5\n1 2 3 4"),
            Err(InstanceError::NotAQuery(2))
        );
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error_or_a_mesh() {
        for end in 0..MESH.len() {
            let read = read_mesh(&MESH[..end]);
            assert!(read.is_err() || end + 4 > MESH.len());
        }
    }
}
