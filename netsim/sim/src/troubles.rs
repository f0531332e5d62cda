//! The kinds of trouble that storms draw beside loss, kills, restarts, partitions and
//! moved bases, and how each is drawn. A run draws how many kinds it meets, then which:
//! few at once, so that what goes wrong can be told from its cause, and each in many runs
//! of a batch.

use crate::fault::{Fault, TimedFault};
use crate::spec::Spec;
use crate::swarm::stream::Stream;

/// Shortest time for which something is wrong, milliseconds: two beacon periods.
const SHORTEST_MS: u64 = 2_000;

/// Of so many writes one fails, at the most and at the least, where not all do.
const ONE_WRITE_IN: (u64, u64) = (2, 20);

/// The least that a late disk or computer is late by, milliseconds: less is what a
/// healthy one may be.
const LEAST_DELAY_MS: u64 = 50;

/// A kind of trouble.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Its name in reports.
    pub name: &'static str,
    /// Whether this scenario can meet it.
    pub can: fn(&Spec) -> bool,
    /// Draws it.
    draw: fn(&mut Draw<'_>),
}

/// All of them.
pub const KINDS: &[Kind] = &[
    Kind {
        name: "failing-stores",
        can: |_| true,
        draw: failing_stores,
    },
    Kind {
        name: "slow-stores",
        can: |spec| spec.storm.troubles.max_store_delay_ms > 0,
        draw: slow_stores,
    },
    Kind {
        name: "pause",
        can: |spec| spec.storm.troubles.max_pause_s > 0,
        draw: pause,
    },
    Kind {
        name: "slow-computer",
        can: |spec| spec.storm.troubles.max_computer_delay_ms > 0,
        draw: slow_computer,
    },
    Kind {
        name: "clock-drift",
        can: |spec| spec.storm.troubles.max_clock_drift_ppm > 0,
        draw: clock_drift,
    },
    Kind {
        name: "clock-jump",
        can: |spec| spec.storm.troubles.max_clock_jump_ms > 0,
        draw: clock_jump,
    },
];

/// A kind that a run drew, and when it strikes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Struck {
    /// Its name.
    pub name: &'static str,
    /// Scenario time, milliseconds.
    pub at_ms: u64,
}

/// What one run draws from.
struct Draw<'a> {
    s: &'a mut Stream,
    spec: &'a Spec,
    /// All peers, in the order of their numbers.
    peers: &'a [u16],
    end_ms: u64,
    out: Vec<TimedFault>,
}

/// Draws the kinds of trouble of one run and their faults, until `end_ms`.
pub fn draw(
    s: &mut Stream,
    spec: &Spec,
    peers: &[u16],
    end_ms: u64,
) -> (Vec<Struck>, Vec<TimedFault>) {
    let able: Vec<u16> = (0..)
        .zip(KINDS)
        .filter(|(_, kind)| (kind.can)(spec))
        .map(|(i, _)| i)
        .collect();
    let most = usize::from(spec.storm.troubles.max_kinds).min(able.len());
    let n_kinds = usize::try_from(s.between(0, most as u64)).unwrap_or(0);
    let (mut struck, mut faults) = (Vec::new(), Vec::new());
    for i in s.shuffled(&able).into_iter().take(n_kinds) {
        let kind = &KINDS[usize::from(i)];
        let mut draw = Draw {
            s,
            spec,
            peers,
            end_ms,
            out: Vec::new(),
        };
        (kind.draw)(&mut draw);
        let first_ms = draw.out.iter().map(|f| f.at_ms).min();
        struck.extend(first_ms.map(|at_ms| Struck {
            name: kind.name,
            at_ms,
        }));
        faults.append(&mut draw.out);
    }
    (struck, faults)
}

impl Draw<'_> {
    /// One peer, or now and then two.
    fn some_peers(&mut self) -> Vec<u16> {
        let n = if self.s.one_in(3) { 2 } else { 1 };
        self.s.shuffled(self.peers).into_iter().take(n).collect()
    }

    /// When something begins and ends; one in four begins with the run.
    fn span_ms(&mut self, longest_s: u32) -> (u64, u64) {
        let begins_ms = match self.s.one_in(4) {
            true => 0,
            false => self.s.between(0, self.end_ms),
        };
        let longest_ms = (u64::from(longest_s) * 1000).max(SHORTEST_MS);
        (
            begins_ms,
            begins_ms + self.s.between(SHORTEST_MS, longest_ms),
        )
    }

    fn push(&mut self, at_ms: u64, fault: Fault) {
        self.out.push(TimedFault { at_ms, fault });
    }

    fn delay_ms(&mut self, most_ms: u32) -> u32 {
        let most_ms = u64::from(most_ms).max(LEAST_DELAY_MS);
        u32::try_from(self.s.between(LEAST_DELAY_MS, most_ms)).unwrap_or(u32::MAX)
    }
}

/// A disk takes no writes for a while, or loses one in so many.
fn failing_stores(d: &mut Draw<'_>) {
    for peer in d.some_peers() {
        let (from_ms, to_ms) = d.span_ms(d.spec.storm.troubles.max_s);
        let one_in = match d.s.one_in(2) {
            true => 1,
            false => d.s.between(ONE_WRITE_IN.0, ONE_WRITE_IN.1),
        };
        let one_in = u32::try_from(one_in).unwrap_or(1);
        d.push(from_ms, Fault::FailStores { peer, one_in });
        d.push(to_ms, Fault::HealStores { peer });
    }
}

/// A disk takes long for each write.
fn slow_stores(d: &mut Draw<'_>) {
    for peer in d.some_peers() {
        let (from_ms, to_ms) = d.span_ms(d.spec.storm.troubles.max_s);
        let delay_ms = d.delay_ms(d.spec.storm.troubles.max_store_delay_ms);
        d.push(from_ms, Fault::SlowStores { peer, delay_ms });
        d.push(to_ms, Fault::HealStores { peer });
    }
}

/// A process stands still and goes on.
fn pause(d: &mut Draw<'_>) {
    for peer in d.some_peers() {
        let (from_ms, to_ms) = d.span_ms(d.spec.storm.troubles.max_pause_s);
        d.push(from_ms, Fault::Pause { peer });
        d.push(to_ms, Fault::Resume { peer });
    }
}

/// A computer gets round to everything late.
fn slow_computer(d: &mut Draw<'_>) {
    for peer in d.some_peers() {
        let (from_ms, to_ms) = d.span_ms(d.spec.storm.troubles.max_s);
        let delay_ms = d.delay_ms(d.spec.storm.troubles.max_computer_delay_ms);
        d.push(from_ms, Fault::SlowComputer { peer, delay_ms });
        d.push(to_ms, Fault::SlowComputer { peer, delay_ms: 0 });
    }
}

/// Clocks go too fast or too slowly, all of them by another rate, to the end.
fn clock_drift(d: &mut Draw<'_>) {
    let most_ppm = i64::from(d.spec.storm.troubles.max_clock_drift_ppm);
    for &peer in d.peers {
        let drawn = d.s.between(0, 2 * most_ppm.unsigned_abs());
        let ppm = i64::try_from(drawn).unwrap_or(0) - most_ppm;
        let ppm = i32::try_from(ppm).unwrap_or(0);
        let at_ms = d.s.between(0, d.end_ms);
        d.push(at_ms, Fault::ClockDrift { peer, ppm });
    }
}

/// A clock is set ahead, once or twice.
fn clock_jump(d: &mut Draw<'_>) {
    for peer in d.some_peers() {
        let at_ms = d.s.between(0, d.end_ms);
        let ahead_ms = d.delay_ms(d.spec.storm.troubles.max_clock_jump_ms);
        d.push(at_ms, Fault::ClockJump { peer, ahead_ms });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::stream::Concern;
    use crate::world::fixture;
    use std::collections::BTreeMap;

    /// The fixture with every kind.
    fn spec() -> Spec {
        let mut spec = fixture::square(8);
        spec.storm.troubles.max_clock_jump_ms = 60_000;
        spec
    }

    #[test]
    fn every_number_of_kinds_and_every_kind_is_drawn_as_often() {
        let spec = spec();
        let (mut numbers, mut kinds) = (BTreeMap::new(), BTreeMap::new());
        for seed in 0..2000 {
            let mut s = Stream::new(seed, Concern::Troubles);
            let (struck, faults) = draw(&mut s, &spec, &[1, 2, 3, 100], 300_000);
            *numbers.entry(struck.len()).or_insert(0) += 1;
            for kind in &struck {
                *kinds.entry(kind.name).or_insert(0) += 1;
                assert!(faults.iter().any(|f| f.at_ms == kind.at_ms));
            }
        }
        assert_eq!(numbers.len(), 4);
        assert!(
            numbers.values().all(|n| (430..570).contains(n)),
            "{numbers:?}"
        );
        assert_eq!(kinds.len(), KINDS.len());
        let each = 2000 * 3 / 2 / KINDS.len();
        let about = |n: &usize| n.abs_diff(each) < each / 4;
        assert!(kinds.values().all(about), "{kinds:?} {each}");
    }

    #[test]
    fn what_begins_also_ends_and_limits_are_kept() {
        let spec = spec();
        let limits = spec.storm.troubles;
        for kind in KINDS {
            let mut seen = 0;
            for seed in 0..200 {
                let mut s = Stream::new(seed, Concern::Troubles);
                let mut d = Draw {
                    s: &mut s,
                    spec: &spec,
                    peers: &[1, 2, 100],
                    end_ms: 300_000,
                    out: Vec::new(),
                };
                (kind.draw)(&mut d);
                let mut open: BTreeMap<(&str, u16), i32> = BTreeMap::new();
                let mut count = |what, peer, n| *open.entry((what, peer)).or_default() += n;
                for f in &d.out {
                    match f.fault {
                        Fault::FailStores { peer, .. } => count("disk", peer, 1),
                        Fault::SlowStores { peer, delay_ms } => {
                            assert!(delay_ms <= limits.max_store_delay_ms);
                            count("disk", peer, 1);
                        }
                        Fault::HealStores { peer } => count("disk", peer, -1),
                        Fault::Pause { peer } => count("pause", peer, 1),
                        Fault::Resume { peer } => count("pause", peer, -1),
                        Fault::SlowComputer { peer, delay_ms } => {
                            assert!(delay_ms <= limits.max_computer_delay_ms);
                            count("slow", peer, if delay_ms > 0 { 1 } else { -1 });
                        }
                        Fault::ClockDrift { ppm, .. } => {
                            assert!(ppm.unsigned_abs() <= limits.max_clock_drift_ppm);
                        }
                        Fault::ClockJump { ahead_ms, .. } => {
                            assert!(ahead_ms <= limits.max_clock_jump_ms);
                        }
                        ref other => panic!("{other:?} is no such trouble"),
                    }
                }
                assert!(open.values().all(|n| *n == 0), "{}: {open:?}", kind.name);
                seen += d.out.len();
            }
            assert!(seen >= 200, "{}", kind.name);
        }
    }
}
