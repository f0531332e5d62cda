//! What a peer takes without a round: its first section, orphans among many, and a part of
//! what a slower one has left (D2.7 §3.6.5).
//!
//! A round asks every member for a bid, and a bid crosses the whole component; among many
//! that takes longer than the work that it would save. What is here asks nobody: a peer
//! computes from beacons and claims what it is to take, and a claim tells it. Views differ, so
//! two may take the same cells: of two listings the lower stamp yields
//! ([`super::sections`]). So what is computed here need not be the same everywhere, only
//! nearly; nothing but the time of flight depends on it.

use crate::cells::CellSet;
use crate::wire::message::CellRun;
use skein_flight::coverage::ring::{CoverageLoop, Direction, LoopCell};
use skein_geometry::frame::Point;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A part of a plan is taken over only if the work of the two then ends this much sooner: at
/// most this many percent of the time that the owner alone needs.
const RELIEF_PERCENT: u64 = 90;

/// Whoever has something to fly takes orphans that it will have flown by this much of the time in
/// which all would be done if everything left were shared evenly, percent: at 100 hardly anybody
/// takes any before it is idle and the way is far, without an end one UAV takes what is flown
/// when all others are done. Of 100, 150, 200, 250 and no end, 150 was best with 20 UAVs.
const EVEN_PERCENT: u64 = 150;

/// A run that is taken goes on over so many covered cells: to pass over them takes no longer than
/// to turn to another run, and what is in one run is one listing of a claim, which has room for
/// few.
const BRIDGED_MAX: u16 = 4;

/// Where a peer that has no section yet would come onto the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Site {
    /// The boundary.
    pub anchor: u16,
    /// Who.
    pub id: u16,
}

/// The section with which a peer begins: an even share of the loop's length near its site, in
/// the order of all sites along the loop. Where sites are closer to each other than a share
/// they are spread as little as possible: the squares of the shifts are least. `lengths_mm` are
/// those of the cells, `swarm` is how many are known to be there, `sites` where some of them
/// are, this peer included.
///
/// Those who know the same sites compute disjoint sections, but perhaps where the loop is cut;
/// those who know the sites of all, sections that cover the loop.
#[must_use]
pub fn first_section(
    mut sites: Vec<Site>,
    swarm: usize,
    lengths_mm: &[u32],
    me: u16,
) -> Option<CellRun> {
    sites.sort_unstable();
    let count = sites.len();
    let swarm = i64::try_from(swarm.max(count)).ok()?;
    let mut n = 0;
    let begins = lengths_mm.iter().map(|mm| {
        n += i64::from(*mm);
        n - i64::from(*mm)
    });
    let begins: Vec<i64> = begins.collect();
    let place = |site: &Site| begins.get(usize::from(site.anchor)).copied();
    let places: Vec<i64> = sites.iter().map(place).collect::<Option<_>>()?;
    let (first, last) = (*places.first()?, *places.last()?);
    let gaps = places.windows(2).map(|w| w[1] - w[0]);
    // The loop is cut where the widest gap ends.
    let widest = gaps.chain([n + first - last]).enumerate();
    let cut = (widest.max_by_key(|(_, gap)| *gap)?.0 + 1) % count;
    sites.rotate_left(cut);
    let origin = *places.get(cut)?;
    // In so many parts of a millimetre as there are peers: a share is `n` of them.
    let shifted = (0i64..).zip(&sites).map(|(i, site)| {
        let along = (place(site).unwrap_or(origin) - origin).rem_euclid(n.max(1));
        along * swarm - i * n
    });
    let shifted: Vec<i64> = shifted.collect();
    let all_known = i64::try_from(count).is_ok_and(|k| k == swarm);
    let spread = pooled(&shifted, all_known);
    let mine = sites.iter().position(|s| s.id == me)?;
    let start = spread.get(mine)? + i64::try_from(mine).ok()? * n;
    let cell_at = |part: i64| {
        let at = (origin + part.div_euclid(swarm)).rem_euclid(n.max(1));
        begins.partition_point(|b| *b < at) % begins.len().max(1)
    };
    let (from, to) = (cell_at(start), cell_at(start + n));
    let many = if swarm == 1 {
        begins.len()
    } else {
        (to + begins.len() - from) % begins.len().max(1)
    };
    let run = CellRun {
        first: u16::try_from(from).ok()?,
        count: u16::try_from(many).ok()?,
    };
    (run.count > 0).then_some(run)
}

/// The nearest sequence that never falls, by least squares; or, if all are to be one pool,
/// their mean. (Pool adjacent violators: Ayer and others 1955.)
fn pooled(values: &[i64], all: bool) -> Vec<i64> {
    let mut pools: Vec<(i64, i64)> = Vec::new();
    for value in values {
        let mut pool = (*value, 1);
        while let Some((sum, many)) = pools.last().copied()
            && (all || sum.div_euclid(many) >= pool.0.div_euclid(pool.1))
        {
            pool = (pool.0 + sum, pool.1 + many);
            pools.pop();
        }
        pools.push(pool);
    }
    let level = |(sum, many): (i64, i64)| (0..many).map(move |_| sum.div_euclid(many));
    pools.into_iter().flat_map(level).collect()
}

/// A peer at work, as far as its claim tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Owner {
    /// Who.
    pub id: u16,
    /// What it has left to fly, in order, but for what others took of it since.
    pub plan: Vec<(u16, Direction)>,
    /// When it will be done with that, milliseconds from now.
    pub left_ms: u64,
}

/// A peer that will soon have nothing to fly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// Who.
    pub id: u16,
    /// Where it will be then.
    pub at: Point,
    /// When, milliseconds from now.
    pub free_ms: u64,
}

/// How this peer flies; it takes others to fly alike.
#[derive(Clone, Copy, Debug)]
pub struct Pace<'a> {
    /// The loop.
    pub coverage_loop: &'a CoverageLoop,
    /// Speed along the loop, mm/s.
    pub speed_mmps: u32,
    /// Time to turn round, milliseconds.
    pub turn_ms: u32,
}

impl Pace<'_> {
    /// The straight way from somewhere to a cell, and a turn, milliseconds.
    #[must_use]
    pub fn way_ms(&self, from: Point, cell: u16) -> u64 {
        let to = self.coverage_loop.boundary(usize::from(cell)).position();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a distance on the plane is small and positive"
        )]
        let way_mm = ((to - from).norm() * 1000.0) as u64;
        way_mm * 1000 / u64::from(self.speed_mmps.max(1)) + u64::from(self.turn_ms)
    }

    /// How many of some others would be at a cell before this peer, and how much later than the
    /// first of them it would be there itself, milliseconds. Whose place is not known may be
    /// there now.
    #[must_use]
    pub fn how_many_sooner(
        &self,
        me: &Hand,
        (others, elsewhere): (&[Hand], usize),
        cell: u16,
    ) -> (usize, u64) {
        let there = |hand: &Hand| (hand.free_ms + self.way_ms(hand.at, cell), hand.id);
        let mine = there(me);
        let sooner = others.iter().map(there).filter(|other| *other < mine);
        let first_ms = sooner.clone().map(|(ms, _)| ms).min();
        let later_ms = first_ms.map_or(0, |ms| mine.0 - ms);
        let unknown_ms = if elsewhere > 0 { mine.0 / 2 } else { 0 };
        (sooner.count(), later_ms.max(unknown_ms))
    }

    /// By when orphans are to be flown that somebody takes who has something to fly, milliseconds
    /// from now: half as long again as all would need if what each owner and this peer have left,
    /// and the orphans, were shared evenly among so many.
    #[must_use]
    pub fn in_time_ms(
        &self,
        owners: &[Owner],
        mine_ms: u64,
        orphans: &CellSet,
        among: usize,
    ) -> u64 {
        let listed_ms: u64 = owners.iter().map(|o| o.left_ms).sum();
        let orphaned_ms: u64 = orphans.iter().map(|c| self.cell_ms(c)).sum();
        let all_ms = listed_ms + mine_ms + orphaned_ms;
        all_ms * EVEN_PERCENT / 100 / (among as u64).max(1)
    }

    /// How long the last cells of an owner's plan take, for one, two, … of them, milliseconds.
    /// What is left to the owner has to last until it has heard of it.
    fn tails_ms(&self, owner: &Owner, least_ms: u64) -> Vec<u64> {
        let mut tail_ms = 0;
        let mut after: Option<u16> = None;
        let tails = owner.plan.iter().rev().map_while(|(cell, _)| {
            tail_ms += self.cell_ms(*cell) + after.map_or(0, |a| self.gap_ms(*cell, a));
            after = Some(*cell);
            (owner.left_ms.saturating_sub(tail_ms) >= least_ms).then_some(tail_ms)
        });
        tails.collect()
    }

    /// How many of the last cells of an owner's plan a hand takes over so that both are done
    /// soonest, and when that is; `None` where it gains too little. What the owner has left may
    /// be mostly the way to a few cells, which a hand beside them takes over whole.
    fn relieved(&self, owner: &Owner, tails_ms: &[u64], hand: &Hand) -> Option<(usize, u64)> {
        // Nobody is done before the hand begins: most hands are too late or too far, and of those
        // nothing more is asked.
        let worth_it = |done_ms: u64| done_ms * 100 <= owner.left_ms * RELIEF_PERCENT;
        let last = owner.plan.last().filter(|_| worth_it(hand.free_ms))?;
        let begins_ms = hand.free_ms + self.way_ms(hand.at, last.0);
        if !worth_it(begins_ms) {
            return None;
        }
        let before_ms = |tail_ms: u64| owner.left_ms.saturating_sub(tail_ms);
        // The more is taken the sooner the owner is done and the later the hand is.
        let is_owner_last = |tail_ms: u64| begins_ms + tail_ms < before_ms(tail_ms);
        let crossing = tails_ms.partition_point(|tail| is_owner_last(*tail));
        let (sooner, later) = tails_ms.split_at(crossing);
        let owner_last = sooner.last().map(|tail| before_ms(*tail));
        let owner_last = owner_last.map(|done_ms| {
            let taken = sooner.partition_point(|tail| before_ms(*tail) > done_ms) + 1;
            (done_ms, taken)
        });
        let hand_last = later.first().map(|tail| (begins_ms + tail, crossing + 1));
        // Without anything left to it the owner is done.
        let whole = tails_ms
            .last()
            .filter(|_| tails_ms.len() == owner.plan.len());
        let whole = whole.map(|tail| (begins_ms + tail, owner.plan.len()));
        let (done_ms, taken) = [owner_last, hand_last, whole].into_iter().flatten().min()?;
        worth_it(done_ms).then_some((taken, done_ms))
    }

    /// This peer once it has flown these cells as well, which it begins so soon.
    fn after(&self, me: &Hand, begins_ms: u64, cells: &[(u16, Direction)]) -> Hand {
        let end = cells.last().map(|(cell, _)| usize::from(*cell));
        let end = end.map(|cell| self.coverage_loop.boundary(cell).position());
        let flown_ms: u64 = cells.iter().map(|(cell, _)| self.cell_ms(*cell)).sum();
        Hand {
            id: me.id,
            at: end.unwrap_or(me.at),
            free_ms: begins_ms + flown_ms,
        }
    }

    /// How long a cell is flown, milliseconds.
    fn cell_ms(&self, cell: u16) -> u64 {
        let cells = self.coverage_loop.cells();
        let mm = cells.get(usize::from(cell)).map_or(0, LoopCell::flown_mm);
        u64::from(mm) * 1000 / u64::from(self.speed_mmps.max(1))
    }

    /// How long the way between two cells of a plan is, milliseconds: none between neighbours.
    fn gap_ms(&self, from: u16, to: u16) -> u64 {
        if from.abs_diff(to) <= 1 {
            return 0;
        }
        let from = self.coverage_loop.boundary(usize::from(from));
        self.way_ms(from.position(), to)
    }
}

/// What one of the hands takes over of whom: the last cells of a plan, from its end on, and
/// by when they have to be done for a gain, milliseconds from now. Each
/// pair of an owner and a hand is judged by how much sooner the two are done together; the
/// best pair goes first, and nobody is in two.
#[must_use]
pub fn relief(
    owners: &[Owner],
    hands: &[Hand],
    me: u16,
    pace: Pace<'_>,
    least_ms: u64,
) -> Option<(Vec<(u16, Direction)>, u64)> {
    let mut pairs = Vec::new();
    for owner in owners {
        let tails_ms = pace.tails_ms(owner, least_ms);
        for hand in hands {
            if let Some((taken, done_ms)) = pace.relieved(owner, &tails_ms, hand) {
                let gain_ms = owner.left_ms - done_ms;
                pairs.push((gain_ms, Reverse((owner.id, hand.id)), taken));
            }
        }
    }
    // Few are looked at until this peer's is there.
    let mut pairs = BinaryHeap::from(pairs);
    let mut met: Vec<(u16, u16)> = Vec::new();
    while let Some((_, Reverse((owner, hand)), taken)) = pairs.pop() {
        if met.iter().any(|(o, h)| *o == owner || *h == hand) {
            continue;
        }
        if hand == me {
            let owner = owners.iter().find(|o| o.id == owner)?;
            let taken = owner.plan.iter().rev().take(taken);
            let taken = taken.map(|(cell, way)| (*cell, way.opposite())).collect();
            return Some((taken, owner.left_ms * RELIEF_PERCENT / 100));
        }
        met.push((owner, hand));
    }
    None
}

/// Of some orphaned cells the run that this peer reaches soonest from where it will be free, of
/// those that it is to begin with, at most `most` cells from its nearer end on, and when it would
/// begin, milliseconds from now. A run goes on over a few cells that are covered.
#[must_use]
pub fn nearest_orphans(
    (orphans, covered): (&CellSet, &CellSet),
    hand: &Hand,
    most: u16,
    pace: Pace<'_>,
    is_my_turn: impl Fn(&Hand, u16) -> bool,
) -> Option<Taken> {
    let both_ways = |ahead: Vec<u16>| {
        let back = ahead.iter().rev().copied().collect();
        [(Direction::Forward, ahead), (Direction::Backward, back)]
    };
    let with_way = |(direction, flown): (Direction, Vec<u16>)| {
        let first = *flown.first()?;
        let way_ms = hand.free_ms + pace.way_ms(hand.at, first);
        Some((way_ms, first, direction, flown))
    };
    let runs = bridged_runs(orphans, covered).into_iter();
    let ways = runs.flat_map(both_ways).filter_map(with_way);
    let mine = ways.filter(|(_, first, ..)| is_my_turn(hand, *first));
    let (way_ms, _, direction, flown) = mine.min_by_key(|(ms, first, d, _)| (*ms, *first, *d))?;
    let taken = flown.into_iter().take(usize::from(most.max(1)));
    Some((way_ms, taken.map(|cell| (cell, direction)).collect()))
}

/// Runs of cells, each going on over at most [`BRIDGED_MAX`] covered ones.
fn bridged_runs(cells: &CellSet, covered: &CellSet) -> Vec<Vec<u16>> {
    let is_bridged = |from: u16, to: u16| {
        to - from <= BRIDGED_MAX + 1 && (from + 1..to).all(|cell| covered.contains(cell))
    };
    let mut runs: Vec<Vec<u16>> = Vec::new();
    for cell in cells.iter() {
        match runs.last_mut() {
            Some(run) if run.last().is_some_and(|last| is_bridged(*last, cell)) => run.push(cell),
            _ => runs.push(vec![cell]),
        }
    }
    runs
}

/// A run that is taken, in the order in which it is flown, and when that begins, milliseconds from
/// now.
pub type Taken = (u64, Vec<(u16, Direction)>);

/// Of some orphaned cells as many runs as make a share, at most `share` cells: each the nearest
/// from where the one before ends, of those that it is this peer's turn to take, as it will be
/// then.
#[must_use]
pub fn share_of_orphans(
    (mut orphans, covered): (CellSet, &CellSet),
    hand: &Hand,
    share: u16,
    pace: Pace<'_>,
    is_my_turn: impl Fn(&Hand, u16) -> bool,
) -> Vec<Taken> {
    let (mut hand, mut left, mut taken) = (*hand, share, Vec::new());
    while left > 0
        && let Some((begins_ms, cells)) =
            nearest_orphans((&orphans, covered), &hand, left, pace, &is_my_turn)
    {
        for (cell, _) in &cells {
            orphans.remove(*cell);
        }
        left = left.saturating_sub(u16::try_from(cells.len()).unwrap_or(u16::MAX));
        hand = pace.after(&hand, begins_ms, &cells);
        taken.push((begins_ms, cells));
    }
    taken
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mission;
    use std::sync::Arc;

    fn sites(anchors: &[u16]) -> Vec<Site> {
        let site = |(anchor, id): (&u16, u16)| Site {
            anchor: *anchor,
            id,
        };
        anchors.iter().zip(1..).map(site).collect()
    }

    fn sections(anchors: &[u16], swarm: usize, cells: u16) -> Vec<(u16, u16)> {
        let ids = 1..=u16::try_from(anchors.len()).unwrap();
        let lengths = vec![48_000; usize::from(cells)];
        let run = |id| first_section(sites(anchors), swarm, &lengths, id);
        ids.map(|id| run(id).map_or((0, 0), |r| (r.first, r.count)))
            .collect()
    }

    #[test]
    fn whoever_knows_all_sites_takes_an_even_part_of_the_loop() {
        for anchors in [
            vec![0, 25, 50, 75],
            vec![3, 20, 61, 77],
            vec![90, 91, 91, 92],
            vec![7, 7, 7, 7, 7, 7, 7],
            vec![99, 0, 1],
            vec![42],
        ] {
            let mut times = vec![0; 100];
            for (first, count) in sections(&anchors, anchors.len(), 100) {
                let even = 100 / u16::try_from(anchors.len()).unwrap();
                assert!(count == even || count == even + 1, "{anchors:?} {count}");
                (0..count).for_each(|k| times[usize::from((first + k) % 100)] += 1);
            }
            assert!(times.iter().all(|t| *t == 1), "{anchors:?} {times:?}");
        }
    }

    #[test]
    fn sections_begin_near_where_their_owners_are() {
        assert_eq!(
            sections(&[10, 36, 60, 84], 4, 100),
            [(10, 25), (35, 25), (60, 25), (85, 25)]
        );
        // Two bunches of a larger swarm: each spreads round its own place.
        assert_eq!(
            sections(&[20, 20, 70, 70], 10, 100),
            [(15, 10), (25, 10), (65, 10), (75, 10)]
        );
        // And apart from others nobody is moved.
        assert_eq!(
            sections(&[5, 40, 90], 10, 100),
            [(5, 10), (40, 10), (90, 10)]
        );
    }

    #[test]
    fn shares_are_even_by_length() {
        let mut lengths = vec![30_000; 40];
        lengths.extend([60_000; 20]);
        let run = |id| first_section(sites(&[0, 40]), 2, &lengths, id).unwrap();
        assert_eq!((run(1).count, run(2).count), (40, 20));
    }

    #[test]
    fn sections_of_known_sites_are_disjoint() {
        for swarm in 3..9 {
            let mut times = [0; 60];
            for (first, count) in sections(&[50, 51, 3], swarm, 60) {
                (0..count).for_each(|k| times[usize::from((first + k) % 60)] += 1);
            }
            assert!(times.iter().all(|t| *t <= 1), "{swarm} {times:?}");
        }
    }

    fn with_loop(check: impl Fn(Pace<'_>)) {
        let geometry = Arc::new(mission(1, 6, 4)).geometry().unwrap();
        check(Pace {
            coverage_loop: &geometry.coverage_loop,
            speed_mmps: 12_000,
            turn_ms: 8000,
        });
    }

    fn hand(pace: Pace<'_>, id: u16, cell: usize) -> Hand {
        let at = pace.coverage_loop.boundary(cell).position();
        Hand { id, at, free_ms: 0 }
    }

    fn forward(cells: core::ops::Range<u16>) -> Vec<(u16, Direction)> {
        cells.map(|c| (c, Direction::Forward)).collect()
    }

    #[test]
    fn a_hand_takes_what_makes_both_end_at_once() {
        with_loop(|pace| {
            let owner = |left_ms| Owner {
                id: 2,
                plan: forward(0..20),
                left_ms,
            };
            let me = hand(pace, 1, 19);
            // 20 cells of 4 s and a way of 20 s, 8 s until the hand begins: 56 and 52 s.
            let (taken, by_ms) = relief(&[owner(100_000)], &[me], 1, pace, 5000).unwrap();
            assert_eq!(by_ms, 90_000);
            let wanted = (8..20).rev().map(|c| (c, Direction::Backward));
            assert_eq!(taken, wanted.collect::<Vec<_>>());
            // The owner would be done with its part before it has heard of it.
            assert_eq!(relief(&[owner(100_000)], &[me], 1, pace, 97_000), None);
            // Of a few cells far away from their owner a hand beside them takes all.
            let far = Owner {
                plan: forward(17..20),
                ..owner(100_000)
            };
            let (taken, _) = relief(&[far], &[me], 1, pace, 5000).unwrap();
            assert_eq!(taken.len(), 3);
            // Nothing is gained where the way is as long as the work.
            assert_eq!(relief(&[owner(9000)], &[me], 1, pace, 0), None);
        });
    }

    #[test]
    fn each_hand_relieves_another_owner_the_best_pair_first() {
        with_loop(|pace| {
            let owner = |id, cells: core::ops::Range<u16>, left_ms| Owner {
                id,
                plan: forward(cells),
                left_ms,
            };
            let owners = [owner(3, 0..10, 100_000), owner(4, 10..20, 80_000)];
            let (near, far) = (hand(pace, 1, 9), hand(pace, 2, 20));
            let of = |me| relief(&owners, &[near, far], me, pace, 0).unwrap().0;
            assert!(of(1).iter().all(|(c, _)| (0..10).contains(c)));
            assert!(of(2).iter().all(|(c, _)| (10..20).contains(c)));
            assert_eq!(relief(&owners, &[near, far], 7, pace, 0), None);
            // Whatever their numbers: of two owners the one who gains more is relieved.
            let owners = [owner(3, 10..20, 60_000), owner(4, 0..10, 100_000)];
            let (taken, _) = relief(&owners, &[hand(pace, 1, 9)], 1, pace, 0).unwrap();
            assert!(taken.iter().all(|(c, _)| (0..10).contains(c)));
        });
    }

    #[test]
    fn who_is_nearer_or_free_sooner_is_there_sooner_and_who_is_elsewhere_may_be() {
        with_loop(|pace| {
            let me = hand(pace, 5, 12);
            let near = hand(pace, 6, 20);
            let busy = Hand {
                free_ms: 60_000,
                ..near
            };
            let way_ms = pace.way_ms(me.at, 20) - pace.way_ms(near.at, 20);
            assert_eq!(pace.how_many_sooner(&me, (&[], 0), 20), (0, 0));
            assert_eq!(
                pace.how_many_sooner(&me, (&[near, busy], 0), 20),
                (1, way_ms)
            );
            // Of equals the lower number.
            let (twin, lower) = (Hand { id: 9, ..me }, Hand { id: 4, ..me });
            assert_eq!(pace.how_many_sooner(&me, (&[twin], 0), 20), (0, 0));
            assert_eq!(pace.how_many_sooner(&me, (&[lower], 0), 20), (1, 0));
            // Half of the way for those of whom nobody knows where they are.
            let half_ms = pace.way_ms(me.at, 20) / 2;
            assert_eq!(pace.how_many_sooner(&me, (&[], 3), 20), (0, half_ms));
        });
    }

    #[test]
    fn orphans_are_in_time_within_half_as_long_again_as_all_would_take_if_shared_evenly() {
        with_loop(|pace| {
            let owner = |id, left_ms| Owner {
                id,
                plan: forward(0..4),
                left_ms,
            };
            let owners = [owner(2, 100_000), owner(3, 60_000)];
            // The fourth has nothing to fly, and five cells nobody lists.
            let orphans = CellSet::of(24, 10..15);
            let five_ms: u64 = (10..15).map(|c| pace.cell_ms(c)).sum();
            assert!(five_ms > 15_000);
            let in_time = |mine, orphans, n| pace.in_time_ms(&owners, mine, orphans, n);
            let nothing = CellSet::new(24);
            assert_eq!(in_time(20_000, &nothing, 4), 67_500);
            let later_ms = in_time(20_000, &orphans, 4) - 67_500;
            assert_eq!(later_ms, five_ms * 3 / 8);
            assert_eq!(in_time(0, &nothing, 0), 240_000);
        });
    }

    #[test]
    fn orphans_are_taken_from_their_nearer_end() {
        with_loop(|pace| {
            let nothing = CellSet::new(24);
            let orphans = CellSet::of(24, [4, 5, 6, 7, 8, 20, 21, 22, 23]);
            let nearest = |at, most, covered: &CellSet| {
                nearest_orphans(
                    (&orphans, covered),
                    &hand(pace, 1, at),
                    most,
                    pace,
                    |_, _| true,
                )
            };
            let backward = |cells: &[u16]| -> Vec<(u16, Direction)> {
                let flown = cells.iter().map(|cell| (*cell, Direction::Backward));
                flown.collect()
            };
            let taken = nearest(8, 3, &nothing);
            assert_eq!(taken, Some((8000, backward(&[8, 7, 6]))));
            let (_, cells) = nearest(20, 9, &nothing).unwrap();
            assert_eq!(cells, [20, 21, 22, 23].map(|c| (c, Direction::Forward)));
            let none = (&nothing, &nothing);
            let me = hand(pace, 1, 8);
            assert_eq!(nearest_orphans(none, &me, 9, pace, |_, _| true), None);
            // Only what it is to begin with.
            let far = |_: &Hand, first: u16| first >= 20;
            let (_, cells) = nearest_orphans((&orphans, &nothing), &me, 9, pace, far).unwrap();
            assert!(cells.iter().all(|(cell, _)| *cell >= 20));
        });
    }

    #[test]
    fn a_run_of_orphans_goes_on_over_a_few_covered_cells() {
        with_loop(|pace| {
            let orphans = CellSet::of(24, [2, 3, 5, 10, 16]);
            let covered = CellSet::of(24, [4, 6, 7, 8, 9, 11, 12, 13, 14, 15]);
            let runs = |covered: &CellSet| bridged_runs(&orphans, covered);
            assert_eq!(runs(&covered), [vec![2, 3, 5, 10], vec![16]]);
            let nothing = CellSet::new(24);
            assert_eq!(runs(&nothing), [vec![2, 3], vec![5], vec![10], vec![16]]);
            // Between them is one that somebody else lists.
            let but_one = CellSet::of(24, [4, 6, 7, 9]);
            assert_eq!(runs(&but_one), [vec![2, 3, 5], vec![10], vec![16]]);
            let me = hand(pace, 1, 2);
            let taken = nearest_orphans((&orphans, &covered), &me, 3, pace, |_, _| true);
            assert_eq!(taken.unwrap().1, [2, 3, 5].map(|c| (c, Direction::Forward)));
        });
    }

    #[test]
    fn as_many_runs_are_taken_at_once_as_make_a_share() {
        with_loop(|pace| {
            let orphans = CellSet::of(24, [4, 5, 8, 12, 13, 14, 20]);
            let nothing = CellSet::new(24);
            let me = hand(pace, 1, 8);
            let share = |most, is_my_turn: &dyn Fn(&Hand, u16) -> bool| {
                let orphans = (orphans.clone(), &nothing);
                share_of_orphans(orphans, &me, most, pace, is_my_turn)
            };
            let cells = |taken: &[Taken]| -> Vec<u16> {
                let all = taken.iter().flat_map(|(_, run)| run);
                all.map(|(cell, _)| *cell).collect()
            };
            let all = share(24, &|_, _| true);
            assert_eq!(all.len(), 4);
            let mut once = cells(&all);
            once.sort_unstable();
            assert_eq!(once, [4, 5, 8, 12, 13, 14, 20]);
            assert!(all.is_sorted_by_key(|(begins_ms, _)| *begins_ms));
            // One that begins later is nobody's sooner than it is.
            assert!(all[1].0 >= all[0].0 + pace.cell_ms(8));
            assert_eq!(cells(&share(3, &|_, _| true)), cells(&all)[..3]);
            // What is another's turn is left to that one, and what is farther is taken.
            let second: Vec<u16> = all[1].1.iter().map(|(cell, _)| *cell).collect();
            let others = cells(&share(24, &|_, first| !second.contains(&first)));
            assert_eq!(others.len() + second.len(), 7);
            assert!(others.iter().all(|cell| !second.contains(cell)));
            assert!(share(0, &|_, _| true).is_empty());
        });
    }
}
