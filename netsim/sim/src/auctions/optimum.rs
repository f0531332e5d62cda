//! The most that an instance is worth: all orders of all sets of tasks for each UAV, then
//! all ways to share the tasks out.

use super::scene::Instance;
use skein_peer::PeerId;
use skein_peer::protocol::auction::flown::FlownTime;
use skein_peer::protocol::auction::settlement::{Flying, Tasks};
use skein_peer::wire::tasks::{Offer, TaskId};

/// Tasks beyond which it is not looked for: the orders of eight are 109,601 for each UAV.
const TASKS_MOST: usize = 8;

/// The optimum; nothing where there are too many tasks.
pub(super) fn value(instance: &Instance) -> Option<u64> {
    let names: Vec<TaskId> = instance.tasks.keys().copied().collect();
    if names.len() > TASKS_MOST {
        return None;
    }
    let sets = 1 << names.len();
    // best[set]: the most that the UAVs so far gain by exactly these tasks.
    let mut best = vec![None; sets];
    best[0] = Some(0);
    for (id, offer) in &instance.uavs {
        let alone = by_set(&names, &instance.tasks, *id, offer);
        let mut next = best.clone();
        for (set, next) in next.iter_mut().enumerate() {
            let mut part = set;
            while part > 0 {
                let both = best[set & !part].zip(alone[part]).map(|(a, b)| a + b);
                *next = (*next).max(both);
                part = (part - 1) & set;
            }
        }
        best = next;
    }
    best.into_iter().flatten().max()
}

/// The most that one UAV gains by each set of tasks, in the best order.
fn by_set(names: &[TaskId], tasks: &Tasks, id: PeerId, offer: &Offer) -> Vec<Option<u64>> {
    let mut best = vec![None; 1 << names.len()];
    let mut open = vec![(FlownTime.begin(id, offer), 0_usize, 0_u64)];
    while let Some((at, set, value)) = open.pop() {
        best[set] = best[set].max(Some(value));
        for (k, name) in names.iter().enumerate() {
            let then = (set >> k & 1 == 0)
                .then(|| FlownTime.then(&at, *name, &tasks[name]))
                .flatten();
            if let Some((next, adds)) = then {
                open.push((next, set | 1 << k, value + u64::from(adds)));
            }
        }
    }
    best
}
