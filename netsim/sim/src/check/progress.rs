//! Limits and progress: no zone entered (S2), every queue within its cap (S9), restarted
//! peers productive again (L6), adoptions bounded (L7).

use super::membership::Membership;
use super::{Clocks, Findings, PeerSnapshot, Snapshot};
use crate::world::Approach;
use crate::world::fact::{Collision, Intrusion};
use skein_peer::wire::message::Order;
use std::collections::BTreeMap;

/// What progress found out in one run.
#[derive(Clone, Debug, Default)]
pub struct ProgressCheck {
    restarted: BTreeMap<u16, Restarted>,
    over: Clocks<(u16, &'static str)>,
    losses: u64,
}

#[derive(Clone, Copy, Debug)]
struct Restarted {
    boot_ms: u64,
    /// When an operator last wanted something else of it.
    told_ms: u64,
    productive: bool,
    told: bool,
}

impl ProgressCheck {
    /// A peer was started again.
    pub fn on_restart(&mut self, now_ms: u64, id: u16) {
        self.restarted.insert(
            id,
            Restarted {
                boot_ms: now_ms,
                told_ms: 0,
                productive: false,
                told: false,
            },
        );
    }

    /// A peer ended.
    pub fn on_silent(&mut self, id: u16) {
        self.restarted.remove(&id);
        self.over.retain(|(p, _)| *p != id);
    }

    /// A peer saw cells that nobody had covered.
    pub fn on_covered(&mut self, id: u16) {
        if let Some(r) = self.restarted.get_mut(&id) {
            r.productive = true;
        }
    }

    /// Something happened that allows everybody one more adoption: a member lost or
    /// new, or a cell orphaned.
    pub fn on_loss(&mut self) {
        self.losses += 1;
    }

    /// Two UAVs that keep apart by agreement came too close.
    pub fn on_too_close(approach: &Approach, found: &mut Findings) {
        let Approach {
            at_ms,
            a,
            b,
            distance_m,
        } = *approach;
        found.broken("S1", at_ms, Some(a), || {
            format!("came within {distance_m:.1} m of uav{b}")
        });
    }

    /// An aircraft that is no member came too near.
    pub fn on_intrusion(intrusion: &Intrusion, found: &mut Findings) {
        let i = *intrusion;
        found.broken("S13", i.at_ms, Some(i.uav), || {
            format!("kept {:.1} m from intruder {}", i.across_m, i.intruder)
        });
    }

    /// A UAV flew into an obstacle that is on no map.
    pub fn on_collision(collision: &Collision, found: &mut Findings) {
        let c = *collision;
        found.broken("S14", c.at_ms, Some(c.uav), || {
            format!("flew into obstacle {}", c.obstacle)
        });
    }

    /// A UAV flew into a zone.
    pub fn on_zone_entry(now_ms: u64, id: u16, zone: usize, found: &mut Findings) {
        found.broken("S2", now_ms, Some(id), || format!("flew into zone {zone}"));
    }

    /// Looks at everybody's loads and plans.
    pub fn on_snapshot(
        &mut self,
        snapshot: &Snapshot<'_>,
        members: &Membership,
        stands_by: impl Fn(&PeerSnapshot) -> bool,
        found: &mut Findings,
    ) {
        for m in snapshot.peers {
            self.check_limits(snapshot, m, found);
            self.check_adoptions(snapshot, m, found);
        }
        self.check_restarted(snapshot, members, stands_by, found);
    }

    fn check_limits(&mut self, snapshot: &Snapshot<'_>, m: &PeerSnapshot, found: &mut Findings) {
        let now_ms = snapshot.now_ms;
        for (name, used, cap) in &m.view.loads {
            if self.exceeds((m.id, name), *used > *cap, now_ms) {
                found.broken("S9", now_ms, Some(m.id), || {
                    format!("{name}: {used} of at most {cap}")
                });
            }
        }
    }

    fn exceeds(&mut self, key: (u16, &'static str), over: bool, now_ms: u64) -> bool {
        if !over {
            self.over.stop(key);
            return false;
        }
        self.over.start(key, now_ms);
        self.over.tell_once(key)
    }

    /// L7: adoptions are bounded by cells and losses.
    fn check_adoptions(&mut self, snapshot: &Snapshot<'_>, m: &PeerSnapshot, found: &mut Findings) {
        let cap = u64::from(snapshot.covered.capacity()) + self.losses + 1;
        if self.exceeds(
            (m.id, "adoptions"),
            m.view.loop_hash != 0 && u64::from(m.view.adoptions) > cap,
            snapshot.now_ms,
        ) {
            found.broken("L7", snapshot.now_ms, Some(m.id), || {
                format!("adopted {} divisions, {cap} are allowed", m.view.adoptions)
            });
        }
    }

    /// L6: a restarted peer covers, plans, relays, is done, or is not needed: everything open is
    /// listed by others, near whose seam it waits.
    fn check_restarted(
        &mut self,
        snapshot: &Snapshot<'_>,
        members: &Membership,
        stands_by: impl Fn(&PeerSnapshot) -> bool,
        found: &mut Findings,
    ) {
        let bounds = snapshot.bounds;
        for (id, r) in &mut self.restarted {
            let Some(m) = snapshot.peer(*id).filter(|m| m.uav && !r.productive) else {
                continue;
            };
            if m.view.order != Order::Resume || stands_by(m) {
                r.told_ms = snapshot.now_ms;
                continue;
            }
            let waits = m.view.able && all_listed(snapshot);
            // Whose fuel is due is to fly home.
            let is_spent = m.view.spendable_ms == 0 || m.view.is_fuel_due;
            let waits = waits || m.view.loop_hash != 0 && is_spent;
            if m.view.finished || !m.view.plan.is_empty() || m.view.relays || waits {
                r.productive = true;
                continue;
            }
            let stable_ms = snapshot
                .stability
                .component_since_ms(*id)
                .unwrap_or(snapshot.now_ms);
            let writes_ms = snapshot.handicaps.writes_since_ms(*id, snapshot.now_ms);
            let from_ms = (r.boot_ms + bounds.probation_ms())
                .max(stable_ms)
                .max(r.told_ms)
                .max(writes_ms.unwrap_or(snapshot.now_ms));
            let took_ms = snapshot.now_ms.saturating_sub(from_ms);
            // What it is to fly it must be able to write down.
            let bound_ms = snapshot.grown_ms(bounds.productive_ms(), from_ms);
            let bound_ms = snapshot
                .handicaps
                .write_ms(*id, from_ms, snapshot.now_ms)
                .map(|w| bound_ms + 2 * w);
            if bound_ms
                .and_then(|b| snapshot.grade().limit_ms(b))
                .is_some_and(|l| took_ms > l)
                && !r.told
            {
                r.told = true;
                found.broken("L6", snapshot.now_ms, Some(*id), || {
                    format!(
                        "restarted at {} ms (life {}), and {took_ms} ms after its probation neither covers nor plans (able: {})",
                        r.boot_ms,
                        members.life(*id),
                        m.view.able
                    )
                });
            }
        }
    }
}

/// Whether every cell is covered or in somebody's plan.
fn all_listed(snapshot: &Snapshot<'_>) -> bool {
    let mut listed = snapshot.covered.clone();
    for m in snapshot
        .peers
        .iter()
        .filter(|m| m.view.loop_hash == snapshot.loop_hash)
    {
        for c in m
            .view
            .plan
            .iter()
            .chain(&m.view.held)
            .chain(&m.view.unassigned)
        {
            listed.insert(*c);
        }
    }
    listed.is_full()
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, Graph, Handicaps, Stability};
    use super::*;
    use skein_peer::Beliefs;
    use skein_peer::cells::CellSet;

    fn run(view: &Beliefs, seconds: u64, restart: bool) -> BTreeMap<&'static str, u64> {
        run_standing_by(view, seconds, restart, false)
    }

    fn run_standing_by(
        view: &Beliefs,
        seconds: u64,
        restart: bool,
        stands_by: bool,
    ) -> BTreeMap<&'static str, u64> {
        let (mut check, mut found, mut s) = (
            ProgressCheck::default(),
            Findings::new(1),
            Stability::default(),
        );
        if restart {
            check.on_restart(0, 1);
        }
        for t in 0..seconds {
            let peers = [PeerSnapshot {
                id: 1,
                speaks_as: 1,
                uav: true,
                since_ms: 0,
                at: None,
                fuel_ms: None,
                eta_ms: 5000,
                view: view.clone(),
            }];
            let graph = Graph::new(vec![1], |_, _| false);
            s.observe(t * 1000, &graph, |_| 1, 10_000);
            let snapshot = Snapshot {
                now_ms: t * 1000,
                loss_permille: 0,
                bounds: Bounds {
                    period_ms: 1000,
                    interval_ms: 1000,
                    diameter: 1,
                },
                graph: &graph,
                stability: &s,
                handicaps: &Handicaps::default(),
                peers: &peers,
                covered: &CellSet::new(2),
                loop_hash: 3,
            };
            check.on_snapshot(&snapshot, &Membership::default(), |_| stands_by, &mut found);
        }
        found.counts
    }

    #[test]
    fn limits_are_kept_or_told_once() {
        let good = Beliefs {
            loop_hash: 3,
            plan: vec![0],
            spendable_ms: 6000,
            adoptions: 3,
            loads: vec![("queue", 4, 4)],
            ..Beliefs::default()
        };
        assert!(run(&good, 3, false).is_empty());
        let bad = Beliefs {
            adoptions: 4,
            loads: vec![("queue", 5, 4)],
            ..good
        };
        assert_eq!(run(&bad, 2, false), BTreeMap::from([("L7", 1), ("S9", 1)]));
    }

    #[test]
    fn a_restarted_peer_that_stays_idle_beside_open_cells_breaks_l6() {
        let idle = Beliefs {
            loop_hash: 3,
            able: true,
            spendable_ms: 6000,
            ..Beliefs::default()
        };
        let out_of_fuel = Beliefs {
            able: false,
            spendable_ms: 0,
            ..idle.clone()
        };
        assert!(run(&out_of_fuel, 60, true).is_empty());
        assert!(run(&idle, 23, true).is_empty());
        assert_eq!(run(&idle, 26, true), BTreeMap::from([("L6", 1)]));
        let told = Beliefs {
            order: Order::ReturnToBase,
            able: false,
            ..idle.clone()
        };
        assert!(run(&told, 60, true).is_empty());
        // Its mission has it wait.
        assert!(run_standing_by(&idle, 60, true, true).is_empty());
        let busy = Beliefs {
            plan: vec![1],
            ..idle.clone()
        };
        assert!(run(&busy, 60, true).is_empty());
        assert!(run(&idle, 60, false).is_empty());
    }
}
