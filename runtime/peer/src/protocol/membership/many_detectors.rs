//! Many failure detectors against each other: random loss, hops, deaths, merges.

use crate::input::Time;
use crate::output::Status;
use crate::protocol::membership::{Change, Membership};
use crate::wire::limits::INTERVAL_LEAST;
use crate::wire::message::Beacon;
use crate::wire::samples;
use proptest::prelude::*;
use skein_geometry::random::SplitMix64;

const T_MS: u64 = 1000;
const STEP_MS: u64 = 25;
const TICK_MS: u64 = 250;

/// Draws of a test, which chooses the seed.
pub(crate) struct Dice(SplitMix64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    pub(crate) fn below(&mut self, n: u64) -> u64 {
        self.0.bits() % n
    }
}

/// Graphs of a hop diameter of at most 4: which pairs hear each other.
pub(crate) fn linked(shape: usize, n: usize, a: usize, b: usize) -> bool {
    let width = match shape {
        0 => n,             // all hear all
        1 => n.div_ceil(2), // a thick band, diameter 2
        _ => n.div_ceil(4), // a thin band, diameter 3 to 4
    };
    a != b && a.abs_diff(b) <= width.max(1)
}

struct Node {
    membership: Membership,
    incarnation: u32,
    heartbeat: u32,
    alive: bool,
    next_beacon: u64,
    next_heartbeat: u64,
    next_tick: u64,
}

struct Net {
    nodes: Vec<Node>,
    dice: Dice,
    loss_percent: u64,
    now: u64,
    /// Changes seen: when, by whom, what.
    seen: Vec<(u64, usize, Change)>,
}

fn beacon(heartbeat: u32, eccentricity: u8) -> Beacon {
    Beacon {
        eccentricity,
        ..samples::beacon(heartbeat)
    }
}

impl Net {
    fn new(n: usize, seed: u64, loss_percent: u64) -> Self {
        let mut dice = Dice::new(seed);
        let period = u32::try_from(T_MS).unwrap();
        let nodes = (0..n)
            .map(|i| Node {
                membership: Membership::new(u16::try_from(i).unwrap(), period),
                incarnation: 1,
                heartbeat: 0,
                alive: true,
                next_beacon: dice.below(T_MS),
                next_heartbeat: u64::MAX,
                next_tick: dice.below(TICK_MS),
            })
            .collect();
        Self {
            nodes,
            dice,
            loss_percent,
            now: 0,
            seen: Vec::new(),
        }
    }

    fn run(&mut self, until: u64, links: impl Fn(usize, usize) -> bool) {
        while self.now < until {
            self.now += STEP_MS;
            for i in 0..self.nodes.len() {
                if self.nodes[i].alive && self.now >= self.nodes[i].next_beacon {
                    self.speak(i, &links);
                }
                if self.nodes[i].alive && self.now >= self.nodes[i].next_heartbeat {
                    self.beat(i, &links);
                }
                let node = &mut self.nodes[i];
                if node.alive && self.now >= node.next_tick {
                    node.next_tick += TICK_MS;
                    let changes = node.membership.tick(Time(self.now));
                    self.seen
                        .extend(changes.into_iter().map(|c| (self.now, i, c)));
                }
            }
        }
    }

    fn speak(&mut self, i: usize, links: &impl Fn(usize, usize) -> bool) {
        let now = Time(self.now);
        let node = &mut self.nodes[i];
        node.next_beacon = self.now + T_MS - T_MS / 10 + self.dice.below(T_MS / 5);
        node.next_heartbeat = u64::midpoint(self.now, node.next_beacon);
        node.heartbeat += 1;
        let mut said = beacon(node.heartbeat, node.membership.eccentricity(now));
        said.gossip = node.membership.gossip(now, 20);
        let incarnation = node.incarnation;
        let author = u16::try_from(i).unwrap();
        for j in 0..self.nodes.len() {
            let lost = self.dice.below(100) < self.loss_percent;
            if links(i, j) && self.nodes[j].alive && !lost {
                let changes = self.nodes[j]
                    .membership
                    .on_beacon(now, author, incarnation, &said);
                self.seen
                    .extend(changes.into_iter().map(|c| (self.now, j, c)));
            }
        }
    }

    /// Half-way between two beacons.
    fn beat(&mut self, i: usize, links: &impl Fn(usize, usize) -> bool) {
        let (now, author) = (Time(self.now), u16::try_from(i).unwrap());
        let node = &mut self.nodes[i];
        node.next_heartbeat = u64::MAX;
        node.heartbeat += 1;
        let (incarnation, heartbeat) = (node.incarnation, (node.heartbeat, INTERVAL_LEAST));
        for j in 0..self.nodes.len() {
            let lost = self.dice.below(100) < self.loss_percent;
            if links(i, j) && self.nodes[j].alive && !lost {
                let membership = &mut self.nodes[j].membership;
                let changes = membership.on_heartbeat(now, author, incarnation, heartbeat);
                self.seen
                    .extend(changes.into_iter().map(|c| (self.now, j, c)));
            }
        }
    }

    fn status(&self, i: usize, of: usize) -> Option<Status> {
        let of = u16::try_from(of).unwrap();
        self.nodes[i]
            .membership
            .all()
            .find(|(id, ..)| *id == of)
            .map(|(.., s)| s)
    }

    /// Raised to life or taken for down, by anybody, after `since`.
    fn events(&self, since: u64, status: Status) -> Vec<(u64, usize, u16)> {
        let of = |(t, i, c): &(u64, usize, Change)| (*t, *i, c.peer);
        self.seen
            .iter()
            .filter(|(t, _, c)| *t > since && c.status == status)
            .map(of)
            .collect()
    }
}

fn hops(n: usize, links: impl Fn(usize, usize) -> bool) -> u64 {
    let far = u64::MAX / 4;
    let mut d = vec![vec![far; n]; n];
    for (a, row) in d.iter_mut().enumerate() {
        for (b, cell) in row.iter_mut().enumerate() {
            *cell = if a == b {
                0
            } else if links(a, b) {
                1
            } else {
                far
            };
        }
    }
    for k in 0..n {
        for a in 0..n {
            for b in 0..n {
                d[a][b] = d[a][b].min(d[a][k] + d[k][b]);
            }
        }
    }
    d.into_iter()
        .flatten()
        .filter(|x| *x < far)
        .max()
        .unwrap_or(0)
}

/// (k1 + k2 + D + 2) T in milliseconds.
fn bound_ms(diameter: u64) -> u64 {
    let d = diameter.max(1);
    T_MS * (16 + d) / 4 + T_MS * (8 + d) / 2 + (d + 2) * T_MS
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, max_shrink_iters: 24, ..ProptestConfig::default() })]

    #[test]
    fn a_death_is_known_to_all_within_the_bound(
        n in 3_usize..13, shape in 0_usize..3, seed: u64, loss in 0_u64..31, dead in any::<prop::sample::Index>(),
    ) {
        let mut net = Net::new(n, seed, loss);
        let links = |a: usize, b: usize| linked(shape, n, a, b);
        net.run(40 * T_MS, links);
        let dead = dead.index(n);
        net.nodes[dead].alive = false;
        let died = net.now;
        // The checker reckons with the true diameter before the death: after it the
        // component may have fallen apart, and its parts owe the verdict all the same.
        let bound = bound_ms(hops(n, links));
        net.run(died + bound + TICK_MS + STEP_MS, links);
        for i in (0..n).filter(|i| *i != dead) {
            prop_assert!(
                matches!(net.status(i, dead), None | Some(Status::Down)),
                "{i} still believes in {dead} {} ms after its death: {:?}", bound, net.status(i, dead)
            );
        }
        net.run(net.now + 60 * T_MS, links);
        for i in (0..n).filter(|i| *i != dead) {
            prop_assert!(matches!(net.status(i, dead), None | Some(Status::Down)), "{i} raised {dead}");
        }
    }

    #[test]
    fn a_merging_component_does_not_raise_the_dead(
        n in 4_usize..11, seed: u64, loss in 0_u64..31, apart in 0_u64..60,
    ) {
        // Two halves part; one of the left half dies at a time that only the left
        // half can know; the halves meet again.
        let mut net = Net::new(n, seed, loss);
        let half = n / 2;
        net.run(30 * T_MS, |a, b| a != b);
        let split = |a: usize, b: usize| a != b && (a < half) == (b < half);
        net.run(net.now + apart * T_MS / 2, split);
        net.nodes[0].alive = false;
        let died = net.now;
        net.run(net.now + apart * T_MS / 2 + bound_ms(1) + TICK_MS + STEP_MS, split);
        for i in 1..half {
            prop_assert!(matches!(net.status(i, 0), None | Some(Status::Down)));
        }
        let met = net.now;
        net.run(met + 60 * T_MS, |a, b| a != b);
        let raised: Vec<_> = net.events(met, Status::Alive).into_iter().filter(|e| e.2 == 0).collect();
        prop_assert!(raised.is_empty(), "died {died}, met {met}, raised {raised:?}");
        for i in 1..n {
            for j in (1..n).filter(|j| *j != i) {
                prop_assert_eq!(net.status(i, j), Some(Status::Alive), "{} of {}", i, j);
            }
        }
    }

    #[test]
    fn a_new_life_replaces_the_old_one(n in 3_usize..9, shape in 0_usize..3, seed: u64, loss in 0_u64..31, down in 1_u64..40) {
        let mut net = Net::new(n, seed, loss);
        let links = |a: usize, b: usize| linked(shape, n, a, b);
        net.run(40 * T_MS, links);
        net.nodes[1].alive = false;
        net.run(net.now + down * T_MS, links);
        let period = u32::try_from(T_MS).unwrap();
        net.nodes[1] = Node {
            membership: Membership::new(1, period), incarnation: 2, heartbeat: 0, alive: true,
            next_beacon: net.now, next_heartbeat: u64::MAX, next_tick: net.now,
        };
        net.run(net.now + 30 * T_MS, links);
        for i in (0..n).filter(|i| *i != 1) {
            let held = net.nodes[i].membership.all().find(|(id, ..)| *id == 1);
            prop_assert_eq!(held.map(|(_, life, _)| life), Some(2), "{}", i);
            prop_assert_ne!(held.map(|(.., s)| s), Some(Status::Down), "{}", i);
        }
    }
}

#[test]
fn nobody_alive_is_taken_for_down_at_a_tenth_lost() {
    for (n, shape, seed) in [(12, 2, 1), (8, 1, 2), (6, 0, 3), (5, 2, 4), (24, 2, 5)] {
        let mut net = Net::new(n, seed, 10);
        net.run(240 * T_MS, |a, b| linked(shape, n, a, b));
        let down = net.events(0, Status::Down);
        assert!(
            down.is_empty(),
            "{n} peers, shape {shape}: {} false, first {:?}",
            down.len(),
            down.first()
        );
    }
}
