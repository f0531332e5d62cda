//! From any state the calm swarm comes to the right end: I1 and liveness without time.

use super::Case;
use super::world::{Node, World, hash_ownership};
use skein_flight::coverage::ring::Direction;
use skein_peer::cells::CellSet;
use skein_peer::protocol::sections::LivePeers;
use skein_peer::wire::message::{Claim, Member};
use std::hash::{DefaultHasher, Hash, Hasher};

/// No calm swarm needs more steps to the end: each fixpoint takes an exchange per
/// peer at most, and each lap of the loop covers all that was listed.
const CALM_STEPS: usize = 24;

/// I1 and the end, without time: whatever happened, let the survivors hear each
/// other and believe what is true. Then no cell is listed twice for long, none is
/// forgotten, and all is flown even if all grasp for the same orphans at once.
pub(super) fn calm_leads_to_the_end(case: &Case, w: &World) -> bool {
    let mut h = DefaultHasher::new();
    for n in w.alive() {
        n.me.hash(&mut h);
        hash_ownership(&n.sections, &mut h);
        for (id, heard) in n.sections.heard() {
            (id, heard.incarnation, &heard.claim).hash(&mut h);
        }
    }
    let key = h.finish();
    if let Some(known) = case.calm.lock().unwrap().get(&key) {
        return *known;
    }
    let good = bring_to_the_end(case, w);
    case.calm.lock().unwrap().insert(key, good);
    good
}

fn bring_to_the_end(case: &Case, w: &World) -> bool {
    let mut nodes: Vec<Node> = w.alive().map(|n| Node::clone(n)).collect();
    let alive: LivePeers = nodes.iter().map(|n| (n.me.id, n.me.incarnation)).collect();
    for n in &mut nodes {
        n.live = alive
            .iter()
            .filter(|(id, _)| **id != n.me.id)
            .map(|(id, life)| (*id, *life))
            .collect();
        // Versions of one life only grow; no search gets near this one.
        n.seq = 1_000_000;
    }
    for _ in 0..CALM_STEPS {
        if nodes.iter().all(|n| n.sections.complete()) {
            return true;
        }
        if exchange(&mut nodes) {
            continue;
        }
        for c in 0..case.cells {
            let covered = nodes.iter().any(|n| n.sections.covered().contains(c));
            let plans = nodes.iter().filter(|n| n.plans(c)).count();
            let listed = nodes.iter().any(|n| n.lists(c));
            let orphan = nodes
                .iter()
                .all(|n| n.sections.orphans(&n.live).contains(c));
            if plans > 1 || !(covered || listed || orphan) {
                return false;
            }
        }
        for n in &mut nodes {
            let mut flown = CellSet::new(case.cells);
            for p in n.sections.plan() {
                flown.insert(p.cell);
            }
            n.sections.cover(&flown);
            n.sections.expire_held();
            let orphans: Vec<(u16, Direction)> = n
                .sections
                .orphans(&n.live)
                .iter()
                .map(|c| (c, Direction::Forward))
                .collect();
            n.sections.append(&n.sections.taken(&orphans));
        }
    }
    nodes.is_empty()
}

/// All hear all, once. Returns whether anything changed.
fn exchange(nodes: &mut [Node]) -> bool {
    let said: Vec<(Member, u32, Claim, CellSet)> = nodes
        .iter()
        .map(|n| (n.me, n.seq, n.claim(), n.sections.covered().clone()))
        .collect();
    let mut changed = false;
    for n in nodes {
        for (author, seq, claim, covered) in &said {
            let known = n.sections.heard().get(&author.id).map(|h| &h.claim);
            changed |= author.id != n.me.id && known != Some(claim);
            n.sections
                .hear(author.id, author.incarnation, *seq, claim.clone());
            changed |= n.sections.cover(covered);
        }
        changed |= n.sections.settle(&n.live);
        n.seq += 1;
    }
    changed
}
