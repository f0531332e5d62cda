//! Task auctions measured by themselves: UAVs that share tasks over a channel of rounds,
//! several hops wide and lossy (D2.7 §1.2.3, §3.2).
//!
//! The same machine that a peer has ([`skein_peer::protocol::auction`]) and, beside it, the
//! published consensus-based bundle algorithm on the same instances, the same channel and the
//! same value of tasks.
//!
//! | module | what it holds |
//! |---|---|
//! | [`scene`] | who is where, and what is to be done |
//! | `channel` | who hears whom, and how a run goes on until all agree |
//! | `registers` | the auction of a peer, and what it passes on |
//! | `cbba` | the published algorithm |
//! | `optimum` | the best value there is, by trying all orders |
//! | [`totals`] | what many runs come to |

mod cbba;
mod channel;
mod optimum;
mod registers;
pub mod scene;
#[cfg(test)]
mod tests;
pub mod totals;

use cbba::Cbba;
use channel::{Agent, Channel};
use registers::Registers;
use scene::Instance;
use serde::{Deserialize, Serialize};
use skein_peer::protocol::auction::flown::FlownTime;
use skein_peer::protocol::auction::settlement::{settle_greedily, value_of};
use skein_peer::wire::tasks::TaskId;
use std::collections::BTreeMap;

/// Rounds for which a partition lasts before its halves meet again.
const PARTITION_ROUNDS: u32 = 57;

/// Rounds after which agreement is waited for no more, for each hop: twelve times what a
/// third of all messages lost may take.
const GIVE_UP_ROUNDS_PER_HOP: u32 = 100;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// UAVs.
    pub n: u16,
    /// Tasks.
    pub tasks: u16,
    /// The diameter of the graph of who hears whom, hops.
    pub hops: u16,
    /// The share of messages that is lost, drawn for each listener by itself.
    pub loss: f64,
    /// Begins in two halves that do not hear each other, commit to their first tasks, and
    /// meet after `PARTITION_ROUNDS`.
    pub partition: bool,
}

/// What one algorithm came to in one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Rounds until nobody's list of tasks changed any more, after a partition from its end
    /// on; nothing where they never agreed.
    pub rounds: Option<u32>,
    /// Tasks that two UAVs list at the end.
    pub conflicts: u32,
    /// Tasks that somebody could do and nobody lists at the end.
    pub unassigned: u32,
    /// The value of all orders at the end, in millionths of worth.
    pub value: u64,
    /// Transmissions until then.
    pub messages: u64,
    /// Their bytes.
    pub bytes: u64,
}

/// One instance, settled by both.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// By registers.
    pub registers: Outcome,
    /// By the published algorithm.
    pub cbba: Outcome,
    /// The value of sequential greedy by one who knows everything.
    pub greedy_value: u64,
    /// The most there is; nothing where too many orders would have to be tried.
    pub optimum_value: Option<u64>,
}

/// Settles one instance.
#[must_use]
pub fn run(setup: Setup, seed: u64) -> Run {
    let instance = Instance::draw(setup.n, setup.tasks, seed);
    let greedy = settle_greedily(&instance.problem(), &instance.tasks, &FlownTime);
    Run {
        registers: settle::<Registers>(setup, &instance, seed),
        cbba: settle::<Cbba>(setup, &instance, seed),
        greedy_value: greedy.value,
        optimum_value: optimum::value(&instance),
    }
}

fn settle<A: Agent>(setup: Setup, instance: &Instance, seed: u64) -> Outcome {
    let mut agents = A::all(instance, setup.hops);
    let mut channel = Channel::new(setup, instance, seed);
    let give_up = GIVE_UP_ROUNDS_PER_HOP * u32::from(setup.hops.max(1));
    let mut rounds = channel.until_agreed(&mut agents, give_up);
    if setup.partition {
        channel.for_rounds(&mut agents, PARTITION_ROUNDS);
        agents.iter_mut().for_each(A::act);
        channel.for_rounds(&mut agents, 1);
        channel.heal(&mut agents);
        rounds = channel.until_agreed(&mut agents, give_up);
    }
    let mut listed: BTreeMap<TaskId, u32> = BTreeMap::new();
    let mut value = 0;
    for (agent, (id, offer)) in agents.iter().zip(&instance.uavs) {
        let order = agent.order();
        for task in &order {
            *listed.entry(*task).or_default() += 1;
        }
        let tasks = (&instance.tasks, &FlownTime);
        value += value_of((*id, offer), &order, tasks).unwrap_or(0);
    }
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    Outcome {
        rounds,
        conflicts: count(listed.values().filter(|n| **n > 1).count()),
        unassigned: count(instance.doable() - listed.len()),
        value,
        messages: channel.messages,
        bytes: channel.bytes,
    }
}
