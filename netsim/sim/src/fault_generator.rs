//! Random faults for one run, drawn from a scenario's storm: kills, loss, partitions
//! that heal, restarts with and without disk, moved bases, and a few of the other
//! kinds of trouble, which are drawn on their own.
//!
//! The number of kills is drawn first and evenly from none to the most allowed, so
//! that a batch of seeds meets each of them equally often; all else fits round it.

use crate::fault::{Fault, TimedFault};
use crate::spec::{Spec, UavSpec};
use crate::swarm::stream::{Concern, Stream};
use crate::troubles::{self, Struck};
use skein_peer::mission::mm;

/// No fault happens before this time: peers listen for three beacon periods, then
/// negotiate their first round, milliseconds.
const QUIET_START_MS: u64 = 5_000;
/// Shortest partition, milliseconds: shorter ones end before anybody is suspected.
const MIN_PARTITION_MS: u64 = 5_000;
/// Shortest and longest time a computer stays down before it is restarted, milliseconds.
const DOWN_MS: (u64, u64) = (2_000, 60_000);
/// Loss that still counts as light, thousandths: the bounds are graded there.
const LIGHT_LOSS_PERMILLE: u64 = 100;

/// The faults of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Storm {
    /// The faults, ascending by time.
    pub faults: Vec<TimedFault>,
    /// The kinds of trouble among them.
    pub struck: Vec<Struck>,
    /// The fleet: the scenario's, or another size of it.
    pub uavs: Vec<UavSpec>,
}

/// Draws the storm of the run with this seed.
///
/// `makespan_ms` is how long the mission takes without faults.
#[must_use]
pub fn draw(spec: &Spec, seed: u64, makespan_ms: u64) -> Storm {
    let mut t = Stream::new(seed, Concern::Troubles);
    let mut kinds = troubles::choose(&mut t, spec);
    kinds.extend(troubles::choose_rare(seed, spec));
    let (spec, makespan_ms) = &troubles::prepare(&mut t, &kinds, spec, makespan_ms);
    let mut s = Stream::new(seed, Concern::Storm);
    let ids: Vec<u16> = spec.uavs.iter().map(|u| u.id).collect();
    let end_ms = until_ms(spec, *makespan_ms);
    let mut faults = vec![TimedFault {
        at_ms: 0,
        fault: Fault::Loss {
            permille: loss(&mut s, spec),
        },
    }];
    let order = s.shuffled(&ids);
    let most = usize::from(spec.storm.max_kills).min(ids.len().saturating_sub(1));
    let n_kills = usize::try_from(s.between(0, most as u64)).unwrap_or(0);
    let (killed, others) = order.split_at(n_kills.min(order.len()));
    for &peer in killed {
        faults.push(at(s.between(QUIET_START_MS, end_ms), Fault::Kill { peer }));
    }
    restarts(&mut s, spec, others, end_ms, &mut faults);
    partitions(&mut s, spec, &ids, end_ms, &mut faults);
    revisions(&mut s, spec, end_ms, &mut faults);
    let mut peers: Vec<u16> = ids
        .iter()
        .copied()
        .chain(spec.ground.iter().map(|g| g.id))
        .collect();
    peers.sort_unstable();
    let end_ms = (*makespan_ms).max(QUIET_START_MS + 1);
    let (struck, troubles) =
        troubles::draw(&mut t, &kinds, spec, (&peers, &order[n_kills..]), end_ms);
    faults.extend(troubles);
    faults.sort_by_key(|f| f.at_ms);
    let uavs = spec.uavs.clone();
    Storm {
        faults,
        struck,
        uavs,
    }
}

/// How many UAVs these faults kill and do not restart.
#[must_use]
pub fn kills(faults: &[TimedFault]) -> u32 {
    let mut gone = std::collections::BTreeSet::new();
    for f in faults {
        match f.fault {
            Fault::Kill { peer } => {
                gone.insert(peer);
            }
            Fault::Restart { peer, .. } => {
                gone.remove(&peer);
            }
            _ => {}
        }
    }
    u32::try_from(gone.len()).unwrap_or(u32::MAX)
}

fn at(at_ms: u64, fault: Fault) -> TimedFault {
    TimedFault { at_ms, fault }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a mission lasts less than 2^32 ms, and the share is clamped to 0..1"
)]
fn until_ms(spec: &Spec, makespan_ms: u64) -> u64 {
    let share = spec.storm.until.clamp(0.0, 1.0);
    ((makespan_ms as f64 * share) as u64).max(QUIET_START_MS + 1)
}

/// A quarter of the runs loses nothing, a quarter little, the rest anything up to the most.
fn loss(s: &mut Stream, spec: &Spec) -> u16 {
    let most = u64::from(spec.storm.max_loss_permille);
    let drawn = match s.between(0, 3) {
        0 => 0,
        1 => s.between(0, most.min(LIGHT_LOSS_PERMILLE)),
        _ => s.between(0, most),
    };
    u16::try_from(drawn).unwrap_or(u16::MAX)
}

/// Each restart concerns another peer that is not killed for good: its computer
/// alone, or, while another one is there to carry on, the whole UAV.
fn restarts(s: &mut Stream, spec: &Spec, peers: &[u16], end_ms: u64, out: &mut Vec<TimedFault>) {
    let n = usize::try_from(s.between(0, u64::from(spec.storm.max_restarts))).unwrap_or(0);
    for &peer in peers.iter().take(n) {
        let down_ms = s.between(QUIET_START_MS, end_ms);
        let up_ms = down_ms + s.between(DOWN_MS.0, DOWN_MS.1);
        let whole = s.one_in(2) && peers.len() > 1;
        let down = if whole {
            Fault::Kill { peer }
        } else {
            Fault::KillComputer { peer }
        };
        out.push(at(down_ms, down));
        out.push(at(
            up_ms,
            Fault::Restart {
                peer,
                fresh_disk: s.one_in(2),
            },
        ));
    }
}

/// Partitions follow each other, because healing ends all of them.
fn partitions(s: &mut Stream, spec: &Spec, ids: &[u16], end_ms: u64, out: &mut Vec<TimedFault>) {
    let n = s.between(0, u64::from(spec.storm.max_partitions));
    if ids.len() < 2 || n == 0 {
        return;
    }
    let longest_ms = (u64::from(spec.storm.max_partition_s) * 1000).max(MIN_PARTITION_MS);
    let slot_ms = (end_ms - QUIET_START_MS) / n;
    for i in 0..n {
        let begin_ms = QUIET_START_MS + i * slot_ms + s.between(0, slot_ms / 2);
        let room_ms = if i + 1 < n { slot_ms / 2 } else { longest_ms };
        let lasts_ms = s.between(MIN_PARTITION_MS, longest_ms).min(room_ms.max(1));
        let order = s.shuffled(ids);
        let cut = usize::try_from(s.between(1, order.len() as u64 - 1)).unwrap_or(1);
        let (a, b) = order.split_at(cut);
        let (mut a, mut b) = (a.to_vec(), b.to_vec());
        if let Some(g) = &spec.ground {
            if s.one_in(2) {
                a.push(g.id)
            } else {
                b.push(g.id)
            }
        }
        a.sort_unstable();
        b.sort_unstable();
        out.push(at(begin_ms, Fault::Partition { groups: vec![a, b] }));
        out.push(at(begin_ms + lasts_ms, Fault::Heal));
    }
}

/// Each revision moves the base to where some UAV was launched: clear of the zones.
fn revisions(s: &mut Stream, spec: &Spec, end_ms: u64, out: &mut Vec<TimedFault>) {
    let n = s.between(0, u64::from(spec.storm.max_revisions));
    if spec.ground.is_none() || spec.uavs.is_empty() {
        return;
    }
    for _ in 0..n {
        let which = usize::try_from(s.between(0, spec.uavs.len() as u64 - 1)).unwrap_or(0);
        let launch = spec.uavs[which].launch;
        let fault = Fault::Rebase {
            east_mm: mm(launch.east_m),
            north_mm: mm(launch.north_m),
        };
        out.push(at(s.between(QUIET_START_MS, end_ms), fault));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::TroubleSpec;
    use crate::world::fixture;
    use std::collections::BTreeMap;

    /// What may be said of any storm.
    fn check(spec: &Spec, storm: &Storm) -> usize {
        let Storm {
            faults,
            struck,
            uavs,
        } = storm;
        let most = usize::from(spec.storm.troubles.max_kinds) + troubles::RARE.len();
        assert!(struck.len() <= most);
        let mut dead = std::collections::BTreeSet::new();
        let mut split = false;
        for f in faults {
            match &f.fault {
                Fault::Kill { peer } | Fault::KillComputer { peer } => {
                    assert!(dead.insert(*peer), "killed twice");
                }
                Fault::Restart { peer, .. } => assert!(dead.remove(peer), "restarted alive"),
                Fault::Partition { groups } => {
                    assert!(!split && groups.len() == 2 && groups.iter().all(|g| !g.is_empty()));
                    split = true;
                }
                Fault::Heal => split = false,
                Fault::Loss { permille } => assert!(*permille <= spec.storm.max_loss_permille),
                Fault::Rebase { .. } => assert!(spec.ground.is_some()),
                // Those of troubles, which have tests of their own.
                _ => {}
            }
        }
        assert!(!split, "a partition never healed");
        assert!(dead.len() < uavs.len(), "nobody lives");
        assert_eq!(usize::try_from(kills(faults)).unwrap(), dead.len());
        assert!(faults.windows(2).all(|w| w[0].at_ms <= w[1].at_ms));
        dead.len()
    }

    #[test]
    fn storms_keep_their_limits_and_kill_every_number_of_peers() {
        let mut spec = square_spec();
        spec.storm.troubles = TroubleSpec::NONE;
        let mut kills: BTreeMap<usize, u32> = BTreeMap::new();
        for seed in 0..2000 {
            let faults = draw(&spec, seed, 300_000);
            *kills.entry(check(&spec, &faults)).or_default() += 1;
        }
        assert_eq!(kills.len(), 8, "{kills:?}");
        assert!(kills.values().all(|n| (180..=330).contains(n)), "{kills:?}");
    }

    #[test]
    fn the_same_seed_draws_the_same_storm() {
        let spec = square_spec();
        assert_eq!(draw(&spec, 5, 300_000), draw(&spec, 5, 300_000));
        assert_ne!(draw(&spec, 5, 300_000), draw(&spec, 6, 300_000));
    }

    #[test]
    fn a_storm_without_time_or_company_still_keeps_its_limits() {
        let mut spec = square_spec();
        spec.uavs.truncate(1);
        spec.storm.max_kills = 9;
        spec.storm.troubles.max_uavs = 0;
        for seed in 0..50 {
            assert_eq!(check(&spec, &draw(&spec, seed, 0)), 0);
        }
    }

    fn square_spec() -> Spec {
        fixture::square(8)
    }
}
