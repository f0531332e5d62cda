//! The first period of a patrol of lane cells (D2.7 §3.6.6): how long it takes until all
//! has been seen once.
//!
//! Left to others: patterns, failures, any other tour ([`skein_survey::patrol`]).

use super::mstc::{closed_walk, places};
use skein_survey::patrol::{Pattern, patrol, proportional};
use skein_survey::regions::plan::{Plan, Task};
use skein_survey::regions::spanning::Tree;

/// The first period of a patrol of a task: each UAV flies straight to its place on the
/// loop over all cells and then on to where the next one began.
#[must_use]
pub fn first_period(task: &Task) -> Plan {
    let walk = closed_walk(task, Tree::DepthFirst);
    let n = walk.len();
    let at = places(task, &walk);
    let mut orders = vec![Vec::new(); task.n_uavs()];
    let all = u32::try_from(n).unwrap_or(u32::MAX);
    let Some(patrol) = patrol(all, &task.speeds) else {
        return task.fly(&orders);
    };
    let arcs: Vec<(usize, u32, u32)> = match patrol.pattern {
        Pattern::Round { mut uavs, .. } => {
            // Slots go round in the order in which the UAVs stand at the loop.
            uavs.sort_by_key(|u| (at[*u], *u));
            let arcs = proportional(all, &vec![1; uavs.len()]);
            uavs.into_iter()
                .zip(arcs)
                .map(|(u, a)| (u, a.0, a.1))
                .collect()
        }
        Pattern::Arcs { arcs, .. } => (0..).zip(arcs).map(|(u, a)| (u, a.0, a.1)).collect(),
    };
    let first = arcs.first().map_or(0, |a| at[a.0]);
    for (uav, from, len) in arcs {
        let cells = (0..len as usize).map(|i| walk[(first + from as usize + i) % n]);
        orders[uav] = cells.collect();
    }
    task.fly(&orders)
}
