//! Maps and teams drawn by a seed, for `bench cover --drawn`: sparse obstacles, bars, rooms
//! with doors, some a cell wide, with 100 to 500 cells a UAV, from one base or scattered.

use skein_geometry::random::SplitMix64;
use skein_survey::regions::{Cell, LaneMap, MapError};

/// Sides of maps, cells.
const SIDES: [usize; 6] = [32, 48, 64, 96, 128, 160];

/// Cells a UAV, least and most.
const SHARE: (usize, usize) = (100, 500);

/// A map and where the UAVs begin.
pub(super) struct Drawn {
    /// `sparse-SEED`, `boxes-SEED`, `bars-SEED` or `rooms-SEED`.
    pub(super) name: String,
    pub(super) map: LaneMap,
    pub(super) roots: Vec<Cell>,
    /// `base`: side by side; `scattered`.
    pub(super) mode: &'static str,
}

/// Obstacles of a map while it is drawn.
struct Sketch {
    rows: usize,
    cols: usize,
    blocked: Vec<bool>,
}

impl Sketch {
    /// Blocks a rectangle, as far as it lies on the map.
    fn block(&mut self, (row, col): (usize, usize), rows: usize, cols: usize) {
        for r in row..(row + rows).min(self.rows) {
            for c in col..(col + cols).min(self.cols) {
                self.blocked[r * self.cols + c] = true;
            }
        }
    }

    /// Rectangles of sizes that `size` draws, until a share of the map is blocked.
    fn scatter(
        &mut self,
        random: &mut SplitMix64,
        share: f64,
        size: impl Fn(&mut SplitMix64) -> (usize, usize),
    ) {
        let enough = (share * self.blocked.len() as f64) as usize;
        while self.blocked.iter().filter(|b| **b).count() < enough {
            let corner = (random.below(self.rows), random.below(self.cols));
            let (rows, cols) = size(random);
            self.block(corner, rows, cols);
        }
    }

    /// Walls every so many cells, with doors in most of them.
    fn rooms(&mut self, random: &mut SplitMix64) {
        let side = [4, 6, 8, 12, 16][random.below(5)];
        let door = 1 + random.below(3) / 2;
        let (rows, cols) = (self.rows, self.cols);
        for row in (side..rows).step_by(side + 1) {
            self.block((row, 0), 1, cols);
        }
        for col in (side..cols).step_by(side + 1) {
            self.block((0, col), rows, 1);
        }
        for top in (0..rows).step_by(side + 1) {
            for left in (0..cols).step_by(side + 1) {
                let along = random.below(side - door + 1);
                if random.unit() < 0.85 {
                    self.open((top + side, left + along), (1, door));
                }
                if random.unit() < 0.85 {
                    self.open((top + along, left + side), (door, 1));
                }
            }
        }
    }

    fn open(&mut self, (row, col): (usize, usize), (rows, cols): (usize, usize)) {
        for r in row..(row + rows).min(self.rows) {
            for c in col..(col + cols).min(self.cols) {
                self.blocked[r * self.cols + c] = false;
            }
        }
    }
}

/// The instance of a seed; a quarter of the seeds are rooms.
///
/// # Errors
/// None in practice: sides are within the limits of a map.
pub(super) fn draw(seed: u64) -> Result<Drawn, MapError> {
    let mut random = SplitMix64::new(seed);
    let mut side = || SIDES[random.below(SIDES.len())];
    let (rows, cols) = (side(), side());
    let mut sketch = Sketch {
        rows,
        cols,
        blocked: vec![false; rows * cols],
    };
    let share = 0.05 + 0.2 * random.unit();
    let grain = [1, 2, 2, 3, 4, 8][random.below(6)];
    let kind = match seed % 4 {
        0 => {
            sketch.scatter(&mut random, share, |_| (grain, grain));
            "sparse"
        }
        1 => {
            let side = |random: &mut SplitMix64| grain * (1 + random.below(2));
            sketch.scatter(&mut random, share, |random| (side(random), side(random)));
            "boxes"
        }
        2 => {
            sketch.scatter(&mut random, share / 2.0, |random| {
                let length = 4 + random.below(26);
                [(1, length), (length, 1)][random.below(2)]
            });
            "bars"
        }
        _ => {
            sketch.rooms(&mut random);
            "rooms"
        }
    };
    let map = LaneMap::new(
        u32::try_from(rows).unwrap_or(0),
        u32::try_from(cols).unwrap_or(0),
        |r, c| !sketch.blocked[r as usize * cols + c as usize],
    )?;
    let reached = largest_component(&map);
    let n_uavs = (reached.len() / (SHARE.0 + random.below(SHARE.1 - SHARE.0))).max(1);
    let (roots, mode) = if random.below(2) == 0 {
        let base = reached[random.below(reached.len())];
        let around = flood(&map, base, &mut vec![false; map.table_len()]);
        (around.into_iter().take(n_uavs).collect(), "base")
    } else {
        let any = |_| reached[random.below(reached.len())];
        ((0..n_uavs).map(any).collect(), "scattered")
    };
    Ok(Drawn {
        name: format!("{kind}-{seed}"),
        map,
        roots,
        mode,
    })
}

/// The cells of the largest connected part.
fn largest_component(map: &LaneMap) -> Vec<Cell> {
    let mut seen = vec![false; map.table_len()];
    let mut largest = Vec::new();
    for cell in map.cells() {
        if !seen[cell as usize] {
            let part = flood(map, cell, &mut seen);
            if part.len() > largest.len() {
                largest = part;
            }
        }
    }
    largest
}

/// What is connected with a cell, nearest first.
fn flood(map: &LaneMap, start: Cell, seen: &mut [bool]) -> Vec<Cell> {
    seen[start as usize] = true;
    let mut reached = vec![start];
    let mut done = 0;
    while let Some(&at) = reached.get(done) {
        done += 1;
        for near in map.neighbours(at) {
            if !std::mem::replace(&mut seen[near as usize], true) {
                reached.push(near);
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_drawn_the_same_again_with_so_many_cells_a_uav() {
        for seed in 0..40 {
            let (one, two) = (draw(seed).unwrap(), draw(seed).unwrap());
            assert_eq!((&one.name, &one.roots), (&two.name, &two.roots));
            let n_cells = largest_component(&one.map).len();
            assert!(one.roots.len() * SHARE.0 <= n_cells.max(SHARE.0), "{seed}");
            assert!(n_cells < (one.roots.len() + 1) * SHARE.1, "{seed}");
        }
    }
}
