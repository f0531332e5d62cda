//! Orders completed: cells that no UAV visits are put in after a neighbour that one does
//! (D2.7 §3.6.3).

use super::map::{Cell, NOWHERE};
use super::plan::Task;

/// Inserts each cell that is in no order after a neighbour that is.
pub(super) fn insert_missing(task: &Task, mut orders: Vec<Vec<Cell>>) -> Vec<Vec<Cell>> {
    let map = &task.map;
    let mut next = vec![NOWHERE; map.table_len()];
    let mut there = vec![false; map.table_len()];
    let mut open = Vec::new();
    // A part of the map where nobody has any work has at least an idle UAV's root.
    let mut rooted: Vec<Cell> = orders.iter().flatten().copied().collect();
    rooted.sort_unstable();
    for (order, root) in orders.iter_mut().zip(&task.roots) {
        if order.is_empty()
            && let Err(i) = rooted.binary_search(root)
        {
            rooted.insert(i, *root);
            order.push(*root);
        }
    }
    for order in &mut orders {
        order.retain(|cell| !core::mem::replace(&mut there[*cell as usize], true));
        for pair in order.windows(2) {
            next[pair[0] as usize] = pair[1];
        }
        open.extend(order.iter().copied());
    }
    let mut done = 0;
    while let Some(&at) = open.get(done) {
        done += 1;
        for near in map.around(at) {
            if map.is_free(near) && !there[near as usize] {
                there[near as usize] = true;
                next[near as usize] = next[at as usize];
                next[at as usize] = near;
                open.push(near);
            }
        }
    }
    let follow = |order: Vec<Cell>| {
        let mut at = order.first().copied().unwrap_or(NOWHERE);
        let mut full = Vec::new();
        while at != NOWHERE {
            full.push(at);
            at = next[at as usize];
        }
        full
    };
    orders.into_iter().map(follow).collect()
}
