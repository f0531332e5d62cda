//! Multi-robot forest coverage (D2.7 §3.6.4): the rooted min-max tree cover of Even et al.
//! over 2×2 blocks with unit edges, and each UAV's closed loop round its tree.
//!
//! Trees share blocks, and what they share is flown more than once: the default planner
//! is shorter. This one has a proven factor, and proves a bound of its own.
//!
//! Even, Garg, Könemann, Ravi and Sinha, "Min-max tree covers of graphs", 2004,
//! <https://doi.org/10.1016/j.orl.2003.11.010>; for robots Zheng, Jain, Koenig and Kempe,
//! "Multi-robot forest coverage", IROS 2005.
//!
//! Left to others: weighted graphs ([`crate::tree_cover`]), where the same cover serves
//! points.

use skein_survey::regions::map::{Cell, UNREACHED};
use skein_survey::regions::partition::cut;
use skein_survey::regions::plan::{Plan, Task};
use skein_survey::regions::spanning::{Tree, best_offset, region_loops};

/// Trees that cover all blocks, one at each UAV's root.
#[derive(Clone, Debug)]
pub struct Cover {
    /// By UAV: the cells of its blocks.
    pub cells: Vec<Vec<Cell>>,
    /// By UAV: edges of its tree at most.
    pub edges: Vec<u32>,
    /// The guess at which the cover was found: no tree has more than four times as many
    /// edges.
    pub guess: u32,
}

/// Covers the task's blocks by trees.
///
/// # Guarantees
/// Each block is in a tree, and no tree has more than 4 × `guess` edges; the cover fails
/// at `guess − 1`, which proves that every rooted cover has a tree of at least `guess`
/// edges. So the largest tree is at most 4 times the least possible.
///
/// # Complexity
/// O(k N) for each of O(log N) guesses.
#[must_use]
pub fn cover(task: &Task) -> Cover {
    let graph = Blocks::new(task);
    let (mut low, mut high) = (0, u32::try_from(graph.cells.len()).unwrap_or(u32::MAX));
    let mut best = graph.cover(high);
    while low + 1 < high {
        let middle = low.midpoint(high);
        match graph.cover(middle) {
            Some(found) => (high, best) = (middle, Some(found)),
            None => low = middle,
        }
    }
    // All blocks are at most as far from a root as there are blocks: the first guess
    // holds, with all that a root reaches left at the root.
    best.unwrap_or(Cover {
        cells: vec![Vec::new(); task.n_uavs()],
        edges: vec![0; task.n_uavs()],
        guess: high,
    })
}

/// Each UAV flies the loop round its tree.
#[must_use]
pub fn plan(task: &Task) -> Plan {
    let offset = best_offset(&task.map);
    let cover = cover(task);
    let mut owner = vec![UNREACHED; task.map.table_len()];
    let mut orders = Vec::with_capacity(task.n_uavs());
    for (root, cells) in task.roots.iter().zip(&cover.cells) {
        for cell in cells {
            owner[*cell as usize] = 0;
        }
        let loops = region_loops(&task.map, &owner, offset, Tree::DepthFirst, &[*root]);
        orders.push(loops.from(*root));
        for cell in cells {
            owner[*cell as usize] = UNREACHED;
        }
    }
    task.fly(&orders)
}

/// Blocks as a graph, with a breadth-first forest from the roots: all edges weigh the
/// same, so that any forest is a minimum one.
struct Blocks {
    cells: Vec<Vec<Cell>>,
    near: Vec<Vec<u32>>,
    /// By UAV: its block.
    roots: Vec<u32>,
    /// Blocks from the roots outwards, and the one before each.
    order: Vec<u32>,
    parent: Vec<u32>,
}

impl Blocks {
    fn new(task: &Task) -> Self {
        let (block_of, pieces) = cut(&task.map, best_offset(&task.map));
        let cells: Vec<Vec<Cell>> = pieces.iter().map(|p| p.cells().to_vec()).collect();
        let mut near = Vec::with_capacity(cells.len());
        for (block, members) in (0u32..).zip(&cells) {
            let mut all: Vec<u32> = members
                .iter()
                .flat_map(|c| task.map.neighbours(*c))
                .map(|c| block_of[c as usize])
                .filter(|b| *b != block)
                .collect();
            all.sort_unstable();
            all.dedup();
            near.push(all);
        }
        let roots: Vec<u32> = task.roots.iter().map(|r| block_of[*r as usize]).collect();
        let mut parent = vec![UNREACHED; cells.len()];
        let mut order = Vec::with_capacity(cells.len());
        for root in &roots {
            if parent[*root as usize] == UNREACHED {
                parent[*root as usize] = *root;
                order.push(*root);
            }
        }
        let mut done = 0;
        while let Some(&at) = order.get(done) {
            done += 1;
            for to in &near[at as usize] {
                if parent[*to as usize] == UNREACHED {
                    parent[*to as usize] = at;
                    order.push(*to);
                }
            }
        }
        Self {
            cells,
            near,
            roots,
            order,
            parent,
        }
    }

    /// A cover at a guess, or `None`, which proves that there is none with trees of at
    /// most `guess` edges.
    fn cover(&self, guess: u32) -> Option<Cover> {
        let (left, parts) = self.split(guess);
        if parts.len() > self.roots.len() {
            return None;
        }
        let ways: Vec<Vec<Option<Vec<u32>>>> =
            parts.iter().map(|part| self.ways(part, guess)).collect();
        let mut part_of: Vec<Option<usize>> = vec![None; self.roots.len()];
        for part in 0..parts.len() {
            let mut tried = vec![false; self.roots.len()];
            if !assign(part, &ways, &mut part_of, &mut tried) {
                return None;
            }
        }
        let mut blocks: Vec<Vec<u32>> = vec![Vec::new(); self.roots.len()];
        // What is left at a root goes to the first UAV that begins there.
        for (block, root) in (0u32..).zip(&left) {
            if let Some(uav) = self.roots.iter().position(|r| r == root) {
                blocks[uav].push(block);
            }
        }
        let mut edges: Vec<u32> = blocks
            .iter()
            .map(|b| count(b.len()).saturating_sub(1))
            .collect();
        for (uav, part) in part_of.iter().enumerate() {
            blocks[uav].push(self.roots[uav]);
            if let Some(part) = part
                && let Some(way) = &ways[*part][uav]
            {
                blocks[uav].extend(way.iter().chain(&parts[*part]));
                edges[uav] += count(way.len() + parts[*part].len()).saturating_sub(2);
            }
            blocks[uav].sort_unstable();
            blocks[uav].dedup();
        }
        let cells = |blocks: &Vec<u32>| {
            blocks
                .iter()
                .flat_map(|b| &self.cells[*b as usize])
                .copied()
                .collect()
        };
        Some(Cover {
            cells: blocks.iter().map(cells).collect(),
            edges,
            guess,
        })
    }

    /// Splits the forest into parts of at least `guess` and below twice as many edges,
    /// and what is left at the roots: by block, the root it is left at.
    fn split(&self, guess: u32) -> (Vec<u32>, Vec<Vec<u32>>) {
        let n = self.cells.len();
        let guess = guess.max(1);
        // By block: edges of what hangs on it so far, and the children that do.
        let mut weight = vec![0u32; n];
        let mut hanging: Vec<Vec<u32>> = vec![Vec::new(); n];
        let mut parts = Vec::new();
        for &block in self.order.iter().rev() {
            let up = self.parent[block as usize];
            if up == block {
                continue;
            }
            weight[up as usize] += weight[block as usize] + 1;
            hanging[up as usize].push(block);
            if weight[up as usize] >= guess {
                let mut part = vec![up];
                let mut open = core::mem::take(&mut hanging[up as usize]);
                while let Some(at) = open.pop() {
                    part.push(at);
                    open.append(&mut hanging[at as usize]);
                }
                weight[up as usize] = 0;
                parts.push(part);
            }
        }
        let mut left = vec![UNREACHED; n];
        for root in &self.roots {
            let mut open = vec![*root];
            while let Some(at) = open.pop() {
                left[at as usize] = *root;
                open.extend(core::mem::take(&mut hanging[at as usize]));
            }
        }
        (left, parts)
    }

    /// By UAV: the blocks of a shortest way from its root to a part, both ends with it,
    /// if it has at most `most` edges.
    fn ways(&self, part: &[u32], most: u32) -> Vec<Option<Vec<u32>>> {
        let mut from = vec![UNREACHED; self.cells.len()];
        let mut open: Vec<(u32, u32)> = Vec::new();
        for block in part {
            from[*block as usize] = *block;
            open.push((*block, 0));
        }
        let mut done = 0;
        while let Some(&(at, depth)) = open.get(done) {
            done += 1;
            if depth == most {
                break;
            }
            for to in &self.near[at as usize] {
                if from[*to as usize] == UNREACHED {
                    from[*to as usize] = at;
                    open.push((*to, depth + 1));
                }
            }
        }
        let way = |root: &u32| {
            let mut at = *root;
            let mut way = vec![at];
            while from[at as usize] != UNREACHED && from[at as usize] != at {
                at = from[at as usize];
                way.push(at);
            }
            (from[*root as usize] != UNREACHED).then_some(way)
        };
        self.roots.iter().map(way).collect()
    }
}

fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// Finds a part its root, moving others to theirs if need be (an augmenting path).
fn assign(
    part: usize,
    ways: &[Vec<Option<Vec<u32>>>],
    part_of: &mut [Option<usize>],
    tried: &mut [bool],
) -> bool {
    for uav in 0..part_of.len() {
        if ways[part][uav].is_none() || tried[uav] {
            continue;
        }
        tried[uav] = true;
        let free = match part_of[uav] {
            None => true,
            Some(other) => assign(other, ways, part_of, tried),
        };
        if free {
            part_of[uav] = Some(part);
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_survey::regions::bounds;
    use skein_survey::regions::map::LaneMap;

    proptest! {
        #[test]
        fn trees_cover_all_and_keep_the_factor(
            free in prop::collection::vec(prop::bool::weighted(0.85), 14 * 14),
            picks in prop::collection::vec(any::<prop::sample::Index>(), 1..5),
            closed in any::<bool>(),
        ) {
            let map = LaneMap::new(14, 14, |r, c| free[(r * 14 + c) as usize]).unwrap();
            let cells: Vec<Cell> = map.cells().collect();
            let roots: Vec<Cell> = picks.iter().map(|p| cells[p.index(cells.len())]).collect();
            let task = Task::new(&map, &roots, closed).unwrap();
            let cover = cover(&task);
            prop_assert!(cover.edges.iter().all(|e| *e <= 4 * cover.guess), "{:?}", cover.edges);
            let plan = plan(&task);
            prop_assert_eq!(plan.n_covered(&task), task.map.n_free());
            prop_assert!(plan.makespan_moves() >= bounds::reach_moves(&task));
            for (path, root) in plan.paths.iter().zip(&roots) {
                prop_assert_eq!(path[0], *root);
                prop_assert!(path.windows(2).all(|w| map.adjacent(w[0], w[1]) && map.is_free(w[1])));
            }
        }
    }

    #[test]
    fn an_open_field_is_shared() {
        let map = LaneMap::new(40, 40, |_, _| true).unwrap();
        let corners = [(0, 0), (0, 39), (39, 0), (39, 39)].map(|(r, c)| map.cell(r, c).unwrap());
        let task = Task::new(&map, &corners, true).unwrap();
        let makespan = plan(&task).makespan_moves();
        // 400 cells each at best; the proven factor is 4 of the tree, 8 of the tour.
        assert!((400..=1600).contains(&makespan), "{makespan}");
    }
}
