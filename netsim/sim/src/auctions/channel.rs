//! A channel of rounds: in each everybody says one thing, and whoever is near hears it or
//! does not.

use super::Setup;
use super::scene::Instance;
use skein_geometry::random::SplitMix64;
use skein_peer::PeerId;
use std::collections::BTreeSet;

/// One that takes part, whatever its algorithm.
pub(super) trait Agent: Sized {
    /// What is said in a round.
    type Said;

    /// All of an instance, each knowing the tasks and nobody else's offer.
    fn all(instance: &Instance, hops: u16) -> Vec<Self>;

    /// Who is believed to live.
    fn believe(&mut self, live: &BTreeSet<PeerId>);

    /// What is said now, and its bytes.
    fn say(&mut self) -> (Self::Said, usize);

    /// Something is heard.
    fn hear(&mut self, from: PeerId, said: &Self::Said);

    /// What follows from all that was heard in a round.
    fn think(&mut self);

    /// The UAV starts with its first task, if the algorithm knows such a thing.
    fn act(&mut self);

    /// What it would fly, in order.
    fn order(&self) -> Vec<skein_peer::wire::tasks::TaskId>;

    /// Whether these know the same and nothing would change any more.
    fn agree(agents: &[&Self]) -> bool;
}

/// Who hears whom, and what was said.
pub(super) struct Channel {
    ids: Vec<PeerId>,
    /// Bands from west to east; one hears its own and those beside it.
    band: Vec<usize>,
    /// Bands from here on do not hear those before.
    cut: Option<usize>,
    loss: f64,
    random: SplitMix64,
    pub(super) messages: u64,
    pub(super) bytes: u64,
}

impl Channel {
    pub(super) fn new(setup: Setup, instance: &Instance, seed: u64) -> Self {
        let n = instance.uavs.len();
        // A band for each hop and one more: as many as there are UAVs for.
        let bands = (usize::from(setup.hops) + 1).min(n.max(1));
        Self {
            ids: instance.uavs.iter().map(|(id, _)| *id).collect(),
            band: (0..n).map(|k| k * bands / n).collect(),
            cut: setup.partition.then(|| bands.div_ceil(2)),
            loss: setup.loss,
            random: SplitMix64::new(seed ^ 0x0000_C0DE),
            messages: 0,
            bytes: 0,
        }
    }

    fn side(&self, k: usize) -> bool {
        self.cut.is_some_and(|cut| self.band[k] >= cut)
    }

    fn hears(&self, a: usize, b: usize) -> bool {
        a != b && self.band[a].abs_diff(self.band[b]) <= 1 && self.side(a) == self.side(b)
    }

    fn live(&self, of: usize) -> BTreeSet<PeerId> {
        let same = (0..self.ids.len()).filter(|k| self.side(*k) == self.side(of));
        same.map(|k| self.ids[k]).collect()
    }

    fn begin<A: Agent>(&self, agents: &mut [A]) {
        for (k, agent) in agents.iter_mut().enumerate() {
            agent.believe(&self.live(k));
            agent.think();
        }
    }

    /// The halves hear each other again.
    pub(super) fn heal<A: Agent>(&mut self, agents: &mut [A]) {
        self.cut = None;
        self.begin(agents);
    }

    fn is_agreed<A: Agent>(&self, agents: &[A]) -> bool {
        [false, true].into_iter().all(|side| {
            let all = agents.iter().enumerate();
            let all = all.filter(|(k, _)| self.side(*k) == side);
            A::agree(&all.map(|(_, a)| a).collect::<Vec<_>>())
        })
    }

    /// Goes on until all agree; says after how many rounds the last list of tasks changed.
    pub(super) fn until_agreed<A: Agent>(&mut self, agents: &mut [A], give_up: u32) -> Option<u32> {
        self.begin(agents);
        let mut last_change = 0;
        for round in 1..=give_up {
            if self.is_agreed(agents) {
                return Some(last_change);
            }
            if self.round(agents) {
                last_change = round;
            }
        }
        None
    }

    pub(super) fn for_rounds<A: Agent>(&mut self, agents: &mut [A], rounds: u32) {
        for _ in 0..rounds {
            self.round(agents);
        }
    }

    /// One round; says whether somebody's list of tasks changed.
    fn round<A: Agent>(&mut self, agents: &mut [A]) -> bool {
        let orders = |agents: &[A]| agents.iter().map(A::order).collect::<Vec<_>>();
        let before = orders(agents);
        let said: Vec<(A::Said, usize)> = agents.iter_mut().map(A::say).collect();
        for (from, (words, bytes)) in said.iter().enumerate() {
            self.messages += 1;
            self.bytes += *bytes as u64;
            for (to, listener) in agents.iter_mut().enumerate() {
                if self.hears(from, to) && self.random.unit() >= self.loss {
                    listener.hear(self.ids[from], words);
                }
            }
        }
        agents.iter_mut().for_each(A::think);
        orders(agents) != before
    }
}
