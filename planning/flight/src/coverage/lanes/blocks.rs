//! The closed part of the coverage loop: 2×2 blocks, a spanning tree over them,
//! and the way round the tree (D2.7 §3.6.2, algorithm 5).
//!
//! Left to others: cells that no block holds ([`super::excursion`]).

use crate::coverage::ring::{CellId, Grid, LoopProblem, Tree};
use petgraph::algo::min_spanning_tree;
use petgraph::data::FromElements;
use petgraph::graph::UnGraph;
use petgraph::unionfind::UnionFind;
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{FRAC_PI_2, PI};
use std::collections::{BTreeMap, BTreeSet};

/// The sides of a square, counter-clockwise from east.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    East,
    North,
    West,
    South,
}

use Side::{East, North, South, West};

impl Side {
    fn opposite(self) -> Self {
        match self {
            East => West,
            North => South,
            West => East,
            South => North,
        }
    }

    fn step(self) -> (i32, i32) {
        match self {
            East => (1, 0),
            North => (0, 1),
            West => (-1, 0),
            South => (0, -1),
        }
    }

    /// Heading of a UAV that leaves through this side.
    fn heading_rad(self) -> f64 {
        match self {
            East => 0.0,
            North => FRAC_PI_2,
            West => PI,
            South => -FRAC_PI_2,
        }
    }
}

/// A 2×2 block: column and row in block widths. Wider than a cell's numbers, so
/// that a neighbour of the outermost one still has a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Block {
    col: i32,
    row: i32,
}

impl Block {
    fn of(cell: CellId) -> Self {
        Self {
            col: i32::from(cell.col).div_euclid(2),
            row: i32::from(cell.row).div_euclid(2),
        }
    }

    fn next(self, side: Side) -> Self {
        let (dc, dr) = side.step();
        Self {
            col: self.col + dc,
            row: self.row + dr,
        }
    }

    /// South-west, south-east, north-east, north-west; `None` at the edge of the numbers.
    fn cells(self) -> Option<[CellId; 4]> {
        let col = i16::try_from(2 * self.col).ok()?;
        let row = i16::try_from(2 * self.row).ok()?;
        let (east, north) = (col.checked_add(1)?, row.checked_add(1)?);
        Some([
            CellId { col, row },
            CellId { col: east, row },
            CellId {
                col: east,
                row: north,
            },
            CellId { col, row: north },
        ])
    }
}

/// A closed loop through all cells of each component of blocks: each cell with its curve,
/// in order of flight, counter-clockwise round the tree. The component with the most needed
/// cells comes first; none, if no block is free.
pub(super) fn closed_loops(
    problem: &LoopProblem,
    grid: Grid,
    needed: &BTreeSet<CellId>,
) -> Vec<Vec<(CellId, Curve)>> {
    let blocks: Vec<Block> = needed
        .iter()
        .map(|&c| Block::of(c))
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    let free: Vec<Block> = blocks
        .into_iter()
        .filter(|&b| is_free(problem, grid, b))
        .collect();
    let laid = |component: BTreeSet<Block>| {
        let links = spanning_tree(&component, problem.tree);
        circumnavigate(&component, &links, grid)
    };
    components(&free, needed).into_iter().map(laid).collect()
}

/// Whether every piece that any tree could lay through the block keeps clear.
fn is_free(problem: &LoopProblem, grid: Grid, block: Block) -> bool {
    let Some(cells) = block.cells() else {
        return false;
    };
    let d = grid.lane_spacing_m;
    let middle = grid.corners(cells[0])[2];
    // Nothing of the block, nor a loiter beside it, is farther from its middle.
    let reach = 1.5 * d + 2.0 * problem.turn_radius_m + problem.clearance_m;
    if problem.zones.distance_m(middle) >= reach {
        return true;
    }
    cells.iter().enumerate().all(|(quadrant, &cell)| {
        pieces_of(quadrant).into_iter().all(|(entry, exit)| {
            let curve = crossing(grid, cell, entry, exit);
            problem.flyable(&curve)
        })
    })
}

/// The inner neighbours of a cell in its block: where the way round comes from
/// and where it goes to when the block has no links at this corner, and the
/// sides through which links come in and go out.
fn corner(quadrant: usize) -> [Side; 4] {
    // [from inside, to inside, link in, link out]
    match quadrant {
        0 => [North, East, West, South],
        1 => [West, North, South, East],
        2 => [South, West, East, North],
        _ => [East, South, North, West],
    }
}

/// The four ways (entry side, exit side) through a cell of a block.
fn pieces_of(quadrant: usize) -> [(Side, Side); 4] {
    let [from, to, link_in, link_out] = corner(quadrant);
    [
        (from, to),
        (from, link_out),
        (link_in, to),
        (link_in, link_out),
    ]
}

/// The curve through a cell from the middle of one side to the middle of another.
fn crossing(grid: Grid, cell: CellId, entry: Side, exit: Side) -> Curve {
    let d = grid.lane_spacing_m;
    let start = gate(grid, cell, entry.opposite(), entry);
    if exit == entry.opposite() {
        return Curve::from_pieces(start, &[(0.0, d)]);
    }
    // Left if the exit follows the entry's opposite counter-clockwise.
    let left = matches!(
        (entry.opposite(), exit),
        (East, North) | (North, West) | (West, South) | (South, East)
    );
    let curvature = if left { 2.0 / d } else { -2.0 / d };
    Curve::from_pieces(start, &[(curvature, d / 2.0 * FRAC_PI_2)])
}

/// The middle of a side of a cell, looking the given way.
fn gate(grid: Grid, cell: CellId, towards: Side, side: Side) -> Pose {
    let half = grid.lane_spacing_m / 2.0;
    let c = grid.centre(cell);
    let (dx, dy) = side.step();
    Pose::new(
        Point::new(c.x + half * f64::from(dx), c.y + half * f64::from(dy)),
        towards.heading_rad(),
    )
}

/// The blocks that hang together, those with the most needed cells first (ties: the first
/// block).
fn components(free: &[Block], needed: &BTreeSet<CellId>) -> Vec<BTreeSet<Block>> {
    let place: BTreeMap<Block, usize> = free.iter().enumerate().map(|(i, &b)| (b, i)).collect();
    let mut groups = UnionFind::<usize>::new(free.len());
    for (i, b) in free.iter().enumerate() {
        for side in [East, North] {
            if let Some(&j) = place.get(&b.next(side)) {
                groups.union(i, j);
            }
        }
    }
    let weight = |b: &Block| {
        b.cells()
            .map_or(0, |c| c.iter().filter(|c| needed.contains(c)).count())
    };
    // Group → needed cells, blocks in order.
    let mut found: BTreeMap<usize, (usize, Vec<usize>)> = BTreeMap::new();
    for (i, b) in free.iter().enumerate() {
        let group = found.entry(groups.find(i)).or_default();
        group.0 += weight(b);
        group.1.push(i);
    }
    let mut found: Vec<(usize, Vec<usize>)> = found.into_values().collect();
    found.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    let blocks = |(_, members): (usize, Vec<usize>)| members.iter().map(|i| free[*i]).collect();
    found.into_iter().map(blocks).collect()
}

/// Links of a spanning tree, as (block, side) from both ends.
fn spanning_tree(component: &BTreeSet<Block>, tree: Tree) -> BTreeSet<(Block, usize)> {
    let span = |value: fn(&Block) -> i32| {
        let low = component.iter().map(value).min().unwrap_or(0);
        component.iter().map(value).max().unwrap_or(0) - low
    };
    let edges = match tree {
        Tree::Longer => least(component, span(|b| b.col) >= span(|b| b.row)),
        Tree::East => least(component, true),
        Tree::North => least(component, false),
        Tree::DepthFirst => {
            let places = component.iter().map(|b| (b.col, b.row)).collect();
            let block = |(col, row)| Block { col, row };
            let edges = depth_first(&places).into_iter();
            edges.map(|[a, b]| (block(a), block(b))).collect()
        }
    };
    let mut links = BTreeSet::new();
    for (a, b) in edges {
        for (from, to) in [(a, b), (b, a)] {
            for side in [East, North, West, South] {
                if from.next(side) == to {
                    links.insert((from, side as usize));
                }
            }
        }
    }
    links
}

/// The least spanning tree: long rows in one direction, joined as far to one end as
/// possible: few corners, so few turns. Weights are all different, so that it is the
/// only one.
fn least(component: &BTreeSet<Block>, rows_run_east: bool) -> Vec<(Block, Block)> {
    let mut graph: UnGraph<Block, (bool, i32, i32)> = UnGraph::new_undirected();
    let nodes: BTreeMap<Block, _> = component.iter().map(|&b| (b, graph.add_node(b))).collect();
    for (&b, &i) in &nodes {
        for side in [East, North] {
            if let Some(&j) = nodes.get(&b.next(side)) {
                let across = (side == East) != rows_run_east;
                let key = if rows_run_east {
                    (b.col, b.row)
                } else {
                    (b.row, b.col)
                };
                graph.add_edge(i, j, (across, key.0, key.1));
            }
        }
    }
    let tree: UnGraph<Block, (bool, i32, i32)> = UnGraph::from_elements(min_spanning_tree(&graph));
    let ends = |e: &petgraph::graph::Edge<_>| (tree[e.source()], tree[e.target()]);
    tree.raw_edges().iter().map(ends).collect()
}

/// Walks round the tree, keeping it on the left, through every cell once.
fn circumnavigate(
    component: &BTreeSet<Block>,
    links: &BTreeSet<(Block, usize)>,
    grid: Grid,
) -> Vec<(CellId, Curve)> {
    let Some(&first) = component.iter().next() else {
        return Vec::new();
    };
    let mut out = Vec::with_capacity(4 * component.len());
    let (mut block, mut quadrant) = (first, 0);
    // A tree of n blocks is walked round in exactly 4n steps.
    for _ in 0..4 * component.len() {
        let [from, to, link_in, link_out] = corner(quadrant);
        let entry = if links.contains(&(block, link_in as usize)) {
            link_in
        } else {
            from
        };
        let exit = if links.contains(&(block, link_out as usize)) {
            link_out
        } else {
            to
        };
        if let Some(cells) = block.cells() {
            out.push((
                cells[quadrant],
                crossing(grid, cells[quadrant], entry, exit),
            ));
        }
        if exit == link_out {
            // Beyond a link lies the cell that is a mirror image across the side.
            block = block.next(exit);
            quadrant = (quadrant + 3) % 4;
        } else {
            quadrant = (quadrant + 1) % 4;
        }
    }
    out
}

/// Edges of a depth-first tree over places on a grid, from the least place on, east
/// before north, west and south.
fn depth_first(places: &BTreeSet<(i32, i32)>) -> Vec<[(i32, i32); 2]> {
    let Some(&first) = places.iter().next() else {
        return Vec::new();
    };
    let mut left = places.clone();
    left.remove(&first);
    let mut edges = Vec::with_capacity(left.len());
    let mut way = vec![first];
    while let Some(&(col, row)) = way.last() {
        let near = [
            (col + 1, row),
            (col, row + 1),
            (col - 1, row),
            (col, row - 1),
        ];
        match near.into_iter().find(|p| left.remove(p)) {
            Some(next) => {
                edges.push([(col, row), next]);
                way.push(next);
            }
            None => {
                way.pop();
            }
        }
    }
    edges
}
