//! What `bench exact --baseline trees` compares a team with: D2.7's own planner of §3.6.3.
//!
//! Cells are the nodes of a graph, distances between centroids its edges. The rooted tree
//! cover gives each UAV a tree of whole cells; it flies them in preorder, each cell's
//! lanes to and fro. Ways are Dubins curves that heed no zone, which favours it.

use skein_flight::coverage::passes::{Pass, PassesPlan, PassesProblem};
use skein_flight::trajectory::dubins;
use skein_geometry::frame::Point;
use skein_lab::graph::Graph;
use skein_lab::tree_cover;

/// The longest of the tours of `k` UAVs over whole cells, metres; `None` without cells.
pub(super) fn makespan_m(problem: &PassesProblem, plan: &PassesPlan, k: usize) -> Option<f64> {
    let mut places: Vec<Point> = plan.cells.iter().map(|c| centroid(&c.ring)).collect();
    let cells = places.len();
    places.resize(cells + k, problem.launch);
    let far = |a: usize, b: usize| (places[a] - places[b]).norm();
    let mut edges = Vec::new();
    for a in 0..cells + k {
        // Roots are joined to cells, not to each other: each UAV has a tree of its own.
        edges.extend((0..a.min(cells)).map(|b| (a, b, far(a, b))));
    }
    let roots: Vec<usize> = (cells..cells + k).collect();
    let cover = tree_cover::rooted(&Graph::new(cells + k, &edges), &roots)?;
    let mut lanes = lanes_of_cells(plan, &places[..cells]);
    let mut longest_m = 0.0f64;
    for (tree, root) in cover.trees.iter().zip(roots) {
        let root = tree.root.map_or(root, |r| cells + r);
        let order = tree_cover::around_tree(tree, root, &far).order;
        let mut flight: Vec<Pass> = Vec::new();
        for cell in order.into_iter().filter(|&v| v < cells) {
            let at = flight.last().map_or(problem.launch, |p| p.to);
            // Trees may share cells; the first to come flies them.
            flight.extend(to_and_fro(std::mem::take(&mut lanes[cell]), at));
        }
        longest_m = longest_m.max(length_m(&flight, problem));
    }
    Some(longest_m)
}

fn centroid(ring: &[Point]) -> Point {
    let (mut twice, mut x, mut y) = (0.0, 0.0, 0.0);
    for (i, a) in ring.iter().enumerate() {
        let b = ring[(i + 1) % ring.len()];
        let part = a.x * b.y - a.y * b.x;
        twice += part;
        x += (a.x + b.x) * part;
        y += (a.y + b.y) * part;
    }
    Point::new(x / (3.0 * twice), y / (3.0 * twice))
}

/// Each pass to the cell that holds its middle, or to the nearest centroid.
fn lanes_of_cells(plan: &PassesPlan, centres: &[Point]) -> Vec<Vec<Pass>> {
    let mut lanes = vec![Vec::new(); centres.len()];
    for pass in &plan.passes {
        let middle = pass.from + (pass.to - pass.from) * 0.5;
        let holds = |c: &usize| super::measure::is_inside(middle, &plan.cells[*c].ring);
        let near = |a: &usize, b: &usize| {
            let to = |c: usize| (centres[c] - middle).norm();
            to(*a).total_cmp(&to(*b))
        };
        let cell = (0..centres.len()).find(holds);
        if let Some(cell) = cell.or_else(|| (0..centres.len()).min_by(near)) {
            lanes[cell].push(*pass);
        }
    }
    lanes
}

/// The lanes of a cell from side to side, beginning at the end nearest to `at`.
fn to_and_fro(mut lanes: Vec<Pass>, at: Point) -> Vec<Pass> {
    let Some(first) = lanes.first() else {
        return lanes;
    };
    let along = (first.to - first.from).normalize();
    let across = |p: &Pass| along.perp(&(p.from - at));
    lanes.sort_by(|a, b| across(a).total_cmp(&across(b)));
    let nearest = |p: &Pass| (p.from - at).norm().min((p.to - at).norm());
    if let [one, .., last] = lanes[..]
        && nearest(&last) < nearest(&one)
    {
        lanes.reverse();
    }
    let mut at = at;
    for lane in &mut lanes {
        if (lane.to - at).norm() < (lane.from - at).norm() {
            *lane = lane.reversed();
        }
        at = lane.to;
    }
    lanes
}

/// A flight over passes from the launch point and back, with turns, metres.
fn length_m(flight: &[Pass], problem: &PassesProblem) -> f64 {
    let (Some(first), Some(last)) = (flight.first(), flight.last()) else {
        return 0.0;
    };
    let turns = flight
        .windows(2)
        .map(|w| dubins::length_m(w[0].end(), w[1].start(), problem.turn_radius_m));
    let passes: f64 = flight.iter().map(Pass::length_m).sum();
    let out_m = (first.from - problem.launch).norm();
    passes + turns.sum::<f64>() + out_m + (last.to - problem.launch).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_flight::coverage::passes::{Directions, plan};
    use skein_geometry::Polygon;

    #[test]
    fn one_cell_is_flown_by_one_uav_however_many_there_are() {
        let corners = [(0.0, 0.0), (400.0, 0.0), (400.0, 200.0), (0.0, 200.0)];
        let area = Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap();
        let problem = PassesProblem {
            directions: Directions::Huang,
            ..PassesProblem::new(area, 50.0, 20.0, Point::new(0.0, 0.0))
        };
        let found = plan(&problem).unwrap();
        let alone_m = makespan_m(&problem, &found, 1).unwrap();
        let three_m = makespan_m(&problem, &found, 3).unwrap();
        assert!((alone_m - three_m).abs() < 1e-6, "{alone_m} {three_m}");
        assert!(alone_m >= found.length_m - 1e-6 && alone_m < 1.3 * found.length_m);
    }
}
