//! When rounds are opened: a loss opens one at once (`prompt`); one that rebalances only a peer
//! that has been able for 10 T opens one, 20 T after it last adopted a division
//! (`patience`); a round that ran out of time is followed by one that waits twice as long
//! (`waiting`).

use super::{Clocks, Findings, Handicaps, Snapshot};
use skein_peer::output::Status;
use skein_peer::protocol::rounds::{RoundOrder, order_of};
use skein_peer::protocol::runs::cells_of;
use skein_peer::wire::limits::MEMBERS_MAX;
use skein_peer::wire::message::{Bid, Claim, Member};
use skein_peer::{Beliefs, Incarnation, PeerId};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// After a decision losses are given so many of the longest intervals to be heard of: they open
/// no round at once.
const SETTLED_INTERVALS: u64 = 5;

/// A peer looks four times in a period at who is there. Whom it took for alive between two looks
/// only, as when halves meet of which one is about to give somebody up, it never counted.
const LOOKS_A_PERIOD: u64 = 4;

/// A peer is able for so long before it opens a rebalancing.
const STEADY_PERIODS: u64 = 10;

/// Rebalancings are so far apart.
const CALM_PERIODS: u64 = 20;

/// After so long no peer waits for the bids of an earlier round: four times its first
/// waiting time at the largest diameter, 16.
const FORGOTTEN_PERIODS: u64 = 4 * (2 * 16 + 3);

/// Beliefs are copied once a period, so what changed in the last one is not known: this
/// many cells are orphans whatever was covered meanwhile (a cell takes more than a second).
const SURELY_ORPHANED: usize = 4;

/// A round that a peer bid in.
#[derive(Clone, Debug)]
struct Joined {
    at_ms: u64,
    order: RoundOrder,
    wait_ms: u32,
    members: Vec<Member>,
    repair: bool,
    /// Whether one of its members was gone since, or too many UAVs were there to open another.
    apart: bool,
}

impl Joined {
    /// Whether a peer that believes this would try the round again.
    fn holds(&self, me: u16, view: &Beliefs, uavs: &BTreeSet<u16>) -> bool {
        let lives = |id: u16| {
            let believed = view.peers.get(&PeerId(id));
            id == me || believed.is_some_and(|(_, s)| *s != Status::Down)
        };
        are_few(view, uavs) && self.members.iter().all(|m| lives(m.id))
    }
}

/// Whether a peer that believes this takes no more UAVs to be there than may share a round, itself
/// and whoever was launched and is not heard of yet included. Among more, orphans are taken without
/// one.
fn are_few(view: &Beliefs, uavs: &BTreeSet<u16>) -> bool {
    are_few_with(view, uavs, &BTreeSet::new())
}

/// The same of a peer that takes some for alive besides.
fn are_few_with(view: &Beliefs, uavs: &BTreeSet<u16>, besides: &BTreeSet<u16>) -> bool {
    let lives = |id: &u16| {
        let believed = view.peers.get(&PeerId(*id));
        besides.contains(id) || believed.is_some_and(|(_, s)| *s != Status::Down)
    };
    let known = view.peers.keys().map(|id| id.0);
    let all: BTreeSet<u16> = known.chain(besides.iter().copied()).collect();
    let others = all.iter().filter(|id| uavs.contains(id) && lives(id));
    1 + others.count() + view.unheard <= MEMBERS_MAX
}

/// One peer's part.
#[derive(Clone, Debug, Default)]
struct Part {
    able_since_ms: Option<u64>,
    /// Whether it stood still before a snapshot showed it able.
    stood_still: bool,
    adoptions: u32,
    adopted_ms: Option<u64>,
    joined: Option<Joined>,
    /// The round that names it in which it heard a bid and has made none, and when: if a
    /// member of that is gone, or its time is over, it opens the next one.
    heard: Option<(RoundOrder, u64)>,
    /// Whether the round joined last ended in an adoption of this peer.
    decided: bool,
    /// The least diameter it reckoned with lately: at this snapshot, with a bid since, and at the
    /// snapshot before.
    diameters: [u32; 2],
    view: Option<Beliefs>,
    /// The cells for which it owes a round.
    orphans: BTreeSet<u16>,
}

/// When the rounds of one run were opened.
#[derive(Clone, Debug)]
pub struct PatienceCheck {
    period_ms: u64,
    parts: BTreeMap<u16, Part>,
    spoken: BTreeSet<RoundOrder>,
    owed: Clocks<u16>,
    /// Who ever flew.
    uavs: BTreeSet<u16>,
    /// Since when who takes whom for alive.
    believed: Clocks<(u16, u16)>,
    /// In which life one peer took another for alive since the last snapshot.
    lives: BTreeMap<(u16, u16), Incarnation>,
    /// The longest interval that counted at the last snapshot.
    interval_ms: u64,
}

impl PatienceCheck {
    /// The checks at beacon period T.
    #[must_use]
    pub fn new(period_ms: u64) -> Self {
        Self {
            period_ms,
            parts: BTreeMap::new(),
            spoken: BTreeSet::new(),
            owed: Clocks::default(),
            uavs: BTreeSet::new(),
            believed: Clocks::default(),
            lives: BTreeMap::new(),
            interval_ms: period_ms,
        }
    }

    /// A process starts, ends, or works on another loop.
    pub fn on_anew(&mut self, id: u16) {
        self.parts.remove(&id);
        self.owed.stop(id);
        self.believed.retain(|(observer, _)| *observer != id);
        self.lives.retain(|(observer, _), _| *observer != id);
    }

    /// A process ends or stands still: it owes nothing meanwhile, and what it believed may be
    /// long outdated when it wakes.
    pub fn on_silent(&mut self, id: u16) {
        self.owed.stop(id);
        if let Some(part) = self.parts.get_mut(&id) {
            part.view = None;
            part.stood_still |= part.able_since_ms.is_none();
        }
    }

    /// A belief about another peer changed, not to being down.
    pub fn on_believed(&mut self, now_ms: u64, about: (u16, u16), life: Incarnation) {
        self.believed.start(about, now_ms);
        self.lives.insert(about, life);
    }

    /// A peer tells what it will fly, having adopted so many divisions, the last one in
    /// the round with this counter.
    pub fn on_told(&mut self, now_ms: u64, id: u16, (adoptions, counter): (u32, u32)) {
        let part = self.parts.entry(id).or_default();
        if part.adoptions != adoptions {
            part.adoptions = adoptions;
            part.adopted_ms = Some(now_ms);
            // What was decided before may become durable after the next round is open.
            part.decided = part.joined.as_ref().is_none_or(|j| counter >= j.order.0);
        }
    }

    /// A peer makes a bid durable: the round of a loss is open.
    pub fn on_bid(
        &mut self,
        now_ms: u64,
        id: u16,
        (bid, diameter): (&Bid, u32),
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        self.owed.stop(id);
        let order = order_of(&bid.round);
        let part = self.parts.entry(id).or_default();
        part.diameters[0] = part.diameters[0].min(diameter);
        if self.spoken.insert(order) {
            let ago_ms = |t| handicaps.shown_ms(id, t, now_ms);
            judge_patience(self.period_ms, now_ms, (id, part), bid, ago_ms, found);
            // A decision that the disk did not take is one that nobody can see.
            let joined = part.joined.as_ref();
            let fails = |j: &Joined| handicaps.write_ms(id, j.at_ms, now_ms).is_none();
            if !joined.is_some_and(fails) {
                judge_waiting(self.period_ms, now_ms, (id, part), bid, ago_ms, found);
            }
        }
        part.heard = part.heard.filter(|(heard, _)| *heard > order);
        part.joined = Some(Joined {
            at_ms: now_ms,
            order,
            wait_ms: bid.round.wait_ms,
            members: bid.round.members.clone(),
            repair: bid.round.repair,
            apart: false,
        });
        part.decided = false;
    }

    /// A running peer receives a bid.
    pub fn on_bid_heard(&mut self, now_ms: u64, (by, speaks_as): (u16, u16), bid: &Bid) {
        let order = order_of(&bid.round);
        let part = self.parts.entry(by).or_default();
        let named = bid.round.members.iter().any(|m| m.id == speaks_as);
        if named && part.joined.as_ref().is_none_or(|j| j.order < order) {
            part.heard = Some((order, now_ms));
        }
    }

    /// A peer gives another up. `heard` are the newest claims it has heard, by author and loop,
    /// with the life in which they were said.
    pub fn on_down<'a>(
        &mut self,
        now_ms: u64,
        (observer, subject): (u16, u16),
        incarnation: Incarnation,
        heard: impl Fn(u16, u64) -> Option<(&'a Arc<Claim>, Incarnation)>,
        handicaps: &Handicaps,
    ) {
        self.lives.remove(&(observer, subject));
        let believed_ms = self.believed.stop((observer, subject));
        let look_ms = self.period_ms / LOOKS_A_PERIOD;
        let was_counted = believed_ms.is_none_or(|t| now_ms > t + look_ms);
        let Some(part) = self.parts.get_mut(&observer) else {
            return;
        };
        if let Some(joined) = &mut part.joined {
            joined.apart |= joined.members.iter().any(|m| m.id == subject);
        }
        let Some(view) = part.view.as_ref().filter(|_| was_counted) else {
            return;
        };
        let settled_ms = SETTLED_INTERVALS * self.interval_ms;
        let settled = part
            .adopted_ms
            .is_some_and(|t| handicaps.lived_ms(observer, t, now_ms) > settled_ms);
        let believed = view.peers.get(&PeerId(subject));
        let was_alive = believed.is_some_and(|(i, s)| *i == incarnation && *s != Status::Down);
        // Halves that have met since the last snapshot may be many.
        let since = self.lives.range((observer, 0)..=(observer, u16::MAX));
        let since = since.map(|((_, other), _)| *other).collect();
        let few = are_few_with(view, &self.uavs, &since);
        if !view.able || !settled || !part.decided || !was_alive || !few {
            return;
        }
        let n = view.covered.capacity();
        let heard = |author| heard(author, view.loop_hash);
        let Some((claim, _)) = heard(subject).filter(|(_, life)| *life == incarnation) else {
            return;
        };
        let mut orphans: BTreeSet<u16> = listed(claim, n)
            .filter(|c| !view.covered.contains(*c))
            .collect();
        let mine = [&view.plan, &view.held, &view.unassigned];
        for c in mine.into_iter().flatten() {
            orphans.remove(c);
        }
        let mut lives: BTreeMap<u16, Incarnation> = view
            .peers
            .iter()
            .map(|(o, (life, _))| (o.0, *life))
            .collect();
        let since = self.lives.range((observer, 0)..=(observer, u16::MAX));
        lives.extend(since.map(|((_, other), life)| (*other, *life)));
        for (other, life) in lives.into_iter().filter(|(o, _)| *o != subject) {
            if let Some((claim, said_in)) = heard(other)
                && said_in == life
            {
                listed(claim, n).for_each(|c| {
                    orphans.remove(&c);
                });
            }
        }
        if orphans.len() >= SURELY_ORPHANED {
            self.owed.start(observer, now_ms);
            if let Some(part) = self.parts.get_mut(&observer) {
                part.orphans = orphans;
            }
        }
    }

    /// Judges what is overdue, and remembers what everybody believes now.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let now_ms = snapshot.now_ms;
        self.interval_ms = snapshot.bounds.interval_ms;
        self.lives.clear();
        for m in snapshot.peers.iter().filter(|m| m.uav) {
            self.uavs.insert(m.id);
            let part = self.parts.entry(m.id).or_default();
            if m.view.able {
                part.able_since_ms.get_or_insert(now_ms);
            } else {
                part.able_since_ms = None;
                part.stood_still = false;
                self.owed.stop(m.id);
            }
            if let Some(joined) = &mut part.joined {
                joined.apart |= !joined.holds(m.speaks_as, &m.view, &self.uavs);
            }
            part.diameters = [m.view.diameter, part.diameters[0]];
            part.view = Some(m.view.clone());
            // Who stood still hears all at once, when it wakes, what was covered meanwhile.
            part.orphans.retain(|c| !m.view.covered.contains(*c));
            if part.orphans.len() < SURELY_ORPHANED {
                self.owed.stop(m.id);
            }
            // It asks for a bid in the instant in which it gives the other one up.
            let late = self.owed.since(m.id).is_some_and(|t| {
                snapshot.lived_ms(m.id, t) > self.period_ms / 4 + snapshot.late_ms(m.id, t)
            });
            if late && self.owed.tell_once(m.id) {
                found.broken("prompt", now_ms, Some(m.id), || {
                    "gave up a peer whose cells nobody lists and opened no round within T/4"
                        .to_owned()
                });
            }
        }
    }
}

/// A rebalancing, opened by the first who bids in it, unless it may follow one
/// that ran out of time.
fn judge_patience(
    period_ms: u64,
    now_ms: u64,
    (id, part): (u16, &Part),
    bid: &Bid,
    ago_ms: impl Fn(u64) -> u64,
    found: &mut Findings,
) {
    let joined = part.joined.as_ref().filter(|_| !part.decided);
    let before = joined.map(|j| j.at_ms).max(part.heard.map(|(_, t)| t));
    let follows = before.is_some_and(|t| now_ms < t + FORGOTTEN_PERIODS * period_ms);
    if bid.round.repair || follows {
        return;
    }
    // Since the snapshot in which it was able first; it may have been so for T before, and for
    // as long again if it stood still in between.
    let unseen_ms = period_ms * (1 + u64::from(part.stood_still));
    // By its own clock, which may be the faster one.
    let before = |since_ms: u64| ago_ms(since_ms.saturating_sub(unseen_ms));
    let able_ms = part
        .able_since_ms
        .map_or(unseen_ms, |t| before(t).max(ago_ms(t) + unseen_ms));
    let calm_ms = part.adopted_ms.map(&ago_ms);
    let hasty = able_ms < STEADY_PERIODS * period_ms;
    let restless = calm_ms.is_some_and(|c| c < CALM_PERIODS * period_ms);
    if hasty || restless {
        found.broken("patience", now_ms, Some(id), || {
            format!(
                "opens a rebalancing, able for {able_ms} ms, {calm_ms:?} ms after its last adoption"
            )
        });
    }
}

/// A round that ran out of time, with all its members there and no more UAVs than may share one
/// all the while, is followed by one that waits at least twice the first waiting time. What was
/// given up since a member was gone, or among too many, is no first try.
fn judge_waiting(
    period_ms: u64,
    now_ms: u64,
    (id, part): (u16, &Part),
    bid: &Bid,
    ago_ms: impl Fn(u64) -> u64,
    found: &mut Findings,
) {
    let Some(before) = part.joined.as_ref().filter(|j| {
        let later = bid.round.counter == j.order.0 + 1;
        let out_of_time = ago_ms(j.at_ms) > u64::from(j.wait_ms);
        // A rebalancing may be decided not to be adopted, which nobody can see.
        let goes_on = !j.apart && !part.decided && j.members == bid.round.members;
        later && out_of_time && j.repair && goes_on
    }) else {
        return;
    };
    // It may reckon with a hop less than at either snapshot.
    let least_diameter = part.diameters[0].min(part.diameters[1]);
    let diameter = least_diameter.saturating_sub(1).max(1);
    let least_ms = 2 * (2 * u64::from(diameter) + 3) * period_ms;
    if u64::from(bid.round.wait_ms) < least_ms {
        found.broken("waiting", now_ms, Some(id), || {
            format!(
                "opens round {} that waits {} ms after one that waited {} ms in vain (at least {least_ms} ms)",
                bid.round.counter, bid.round.wait_ms, before.wait_ms
            )
        });
    }
}

/// The cells that a claim lists, given away or not.
fn listed(claim: &Claim, n: u16) -> impl Iterator<Item = u16> {
    let runs = claim.plan.iter().chain(&claim.held);
    runs.flat_map(move |l| cells_of(l.run, n))
}

#[cfg(test)]
mod tests {
    use super::super::testing::{LOOP, Story, speaking};
    use super::*;
    use crate::fault::Fault;
    use skein_peer::wire::message::{CellRun, ListedRun, Round, Stamp};

    fn bid(counter: u32, repair: bool, wait_ms: u32) -> Bid {
        Bid {
            round: Round {
                counter,
                members: vec![Member {
                    id: 1,
                    incarnation: 1,
                }],
                revision: 1,
                loop_hash: LOOP,
                repair,
                wait_ms,
            },
            anchor: 0,
            backward: false,
            release_ms: 0,
            speed_mmps: 1,
            turn_ms: 0,
            endurance_ms: 0,
            covered: Vec::new(),
            commits: Vec::new(),
            off_loop: Vec::new(),
            eta_ms: 0,
            calm: false,
            progressed: false,
        }
    }

    /// Peer 1 able from second 0 to second `until`.
    fn able_until(check: &mut PatienceCheck, until_s: u64, found: &mut Findings) {
        let mut story = Story::new(300);
        let mut view = speaking();
        view.peers.insert(PeerId(2), (1, Status::Alive));
        for t in 0..=until_s {
            let views = [(1, view.clone())];
            story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, found));
        }
    }

    #[test]
    fn a_rebalancing_too_soon_is_found() {
        for (adopted_s, able_s, repair, broken) in [
            (None, 3, false, true),
            (None, 12, false, false),
            (None, 3, true, false),
            (Some(20), 30, false, true),
            (Some(5), 30, false, false),
        ] {
            let (mut check, mut found) = (PatienceCheck::new(1000), Findings::new(1));
            if let Some(t) = adopted_s {
                check.on_told(t * 1000, 1, (1, 1));
            }
            able_until(&mut check, able_s, &mut found);
            check.on_bid(
                able_s * 1000,
                1,
                (&bid(4, repair, 5000), 9),
                &Handicaps::default(),
                &mut found,
            );
            assert_eq!(
                found.counts.contains_key("patience"),
                broken,
                "{adopted_s:?} {able_s} {repair}"
            );
        }
    }

    #[test]
    fn a_waiting_time_that_is_not_doubled_is_found() {
        for (wait_ms, after_ms, disk_fails, broken) in [
            (5000, 5100, false, true),
            (10_000, 5100, false, false),
            (5000, 900, false, false),
            (5000, 5100, true, false),
        ] {
            let (mut check, mut found) = (PatienceCheck::new(1000), Findings::new(1));
            let mut handicaps = Handicaps::default();
            if disk_fails {
                let fault = Fault::FailStores { peer: 1, one_in: 5 };
                handicaps.on_fault(29_000, &fault);
            }
            able_until(&mut check, 30, &mut found);
            check.on_bid(
                30_000,
                1,
                (&bid(4, true, 5000), 9),
                &Handicaps::default(),
                &mut found,
            );
            check.on_bid(
                30_000 + after_ms,
                1,
                (&bid(5, true, wait_ms), 9),
                &handicaps,
                &mut found,
            );
            assert_eq!(
                found.counts.contains_key("waiting"),
                broken,
                "{wait_ms} {after_ms}"
            );
        }
    }

    #[test]
    fn a_round_that_others_ended_is_no_first_try() {
        for (others, status, broken) in [
            (1, Status::Alive, true),
            (7, Status::Alive, true),
            (8, Status::Alive, false),
            (1, Status::Down, false),
        ] {
            let (mut check, mut found) = (PatienceCheck::new(1000), Findings::new(1));
            let mut story = Story::new(0);
            let mut view = speaking();
            let members = [1, 2].map(|id| Member { id, incarnation: 1 });
            view.peers = (0..others).map(|i| (PeerId(2 + i), (1, status))).collect();
            let all = (0..=others).map(|i| (1 + i, view.clone()));
            let views: Vec<_> = all.collect();
            story.snapshot(29_000, &views, |s| check.on_snapshot(s, &mut found));
            for (at_ms, counter) in [(30_000, 4), (35_100, 5)] {
                let mut bid = bid(counter, true, 5000);
                bid.round.members = members.to_vec();
                check.on_bid(at_ms, 1, (&bid, 9), &Handicaps::default(), &mut found);
                story.snapshot(at_ms + 500, &views, |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(
                found.counts.contains_key("waiting"),
                broken,
                "{others} {status:?}"
            );
        }
    }

    #[test]
    fn who_stood_still_before_it_was_seen_able_may_have_been_so_for_longer() {
        for (stood_still, broken) in [(false, true), (true, false)] {
            let (mut check, mut found) = (PatienceCheck::new(1000), Findings::new(1));
            check.parts.entry(1).or_default();
            if stood_still {
                check.on_silent(1);
            }
            able_until(&mut check, 8, &mut found);
            let bid = bid(4, false, 5000);
            check.on_bid(8_400, 1, (&bid, 9), &Handicaps::default(), &mut found);
            assert_eq!(
                found.counts.contains_key("patience"),
                broken,
                "{stood_still}"
            );
        }
    }

    #[test]
    fn who_reckons_with_a_narrower_swarm_waits_for_less() {
        for (diameter, broken) in [(6, true), (4, false)] {
            let (mut check, mut found) = (PatienceCheck::new(1000), Findings::new(1));
            able_until(&mut check, 30, &mut found);
            check.parts.entry(1).or_default().diameters = [6, 6];
            for (at_ms, counter, wait_ms) in [(30_000, 4, 9_000), (39_100, 5, 18_000)] {
                let bid = bid(counter, true, wait_ms);
                let handicaps = Handicaps::default();
                check.on_bid(at_ms, 1, (&bid, diameter), &handicaps, &mut found);
            }
            assert_eq!(found.counts.contains_key("waiting"), broken, "{diameter}");
        }
    }

    #[test]
    fn a_slow_clock_settles_and_a_fast_one_is_steady_by_its_own_time() {
        let drift = |ppm| {
            let mut handicaps = Handicaps::default();
            handicaps.on_fault(0, &Fault::ClockDrift { peer: 1, ppm });
            handicaps
        };
        let claim = Arc::new(Claim {
            loop_hash: LOOP,
            plan: vec![ListedRun {
                run: CellRun { first: 0, count: 4 },
                backward: false,
                stamp: Stamp::default(),
            }],
            ..Claim::default()
        });
        for (ppm, broken) in [(0, true), (-20_000, false)] {
            let (mut check, mut found) = (PatienceCheck::new(1000), Findings::new(1));
            check.on_told(25_050, 1, (1, 1));
            able_until(&mut check, 30, &mut found);
            let heard = |id, on| (id == 2 && on == LOOP).then_some((&claim, 1));
            check.on_down(30_100, (1, 2), 1, heard, &drift(ppm));
            Story::new(300).snapshot(31_000, &[(1, speaking())], |s| {
                check.on_snapshot(s, &mut found);
            });
            assert_eq!(found.counts.contains_key("prompt"), broken, "{ppm}");
        }
        // Able from just after the snapshot before the first in which it is seen to be.
        for (ppm, broken) in [(0, true), (9_200, false)] {
            let (mut check, mut found) = (PatienceCheck::new(1000), Findings::new(1));
            able_until(&mut check, 8, &mut found);
            check.parts.entry(1).or_default().able_since_ms = Some(1_000);
            let rebalancing = bid(7, false, 5000);
            check.on_bid(9_916, 1, (&rebalancing, 9), &drift(ppm), &mut found);
            assert_eq!(found.counts.contains_key("patience"), broken, "{ppm}");
        }
    }

    /// Peer 1 takes so many for alive whom it never heard of.
    fn expects(check: &mut PatienceCheck, unheard: usize) {
        check.uavs.insert(2);
        let view = check.parts.get_mut(&1).and_then(|part| part.view.as_mut());
        view.expect("a snapshot was judged").unheard = unheard;
    }

    /// Peer 1 takes so many others for alive since the last snapshot.
    fn meets(check: &mut PatienceCheck, others: u16) {
        for id in 3..3 + others {
            check.uavs.insert(id);
            check.on_believed(29_900, (1, id), 1);
        }
    }

    #[test]
    fn a_loss_that_opens_no_round_at_once_is_found() {
        let claim = |count| {
            Arc::new(Claim {
                loop_hash: LOOP,
                plan: vec![ListedRun {
                    run: CellRun { first: 0, count },
                    backward: false,
                    stamp: Stamp::default(),
                }],
                ..Claim::default()
            })
        };
        let nothing: fn(&mut PatienceCheck) = |_| ();
        for (cells, opens, adopted_s, besides, broken) in [
            (4, false, 2, nothing, true),
            (4, true, 2, nothing, false),
            (0, false, 2, nothing, false),
            (4, false, 28, nothing, false),
            // The other one was taken for alive since then: between two looks, or for longer.
            (
                4,
                false,
                2,
                |check| check.on_believed(29_900, (1, 2), 1),
                false,
            ),
            (
                4,
                false,
                2,
                |check| check.on_believed(29_800, (1, 2), 1),
                true,
            ),
            (4, false, 2, |check| check.on_silent(1), false),
            // Too many were met since the last snapshot.
            (4, false, 2, |check| meets(check, 8), false),
            (4, false, 2, |check| meets(check, 7), true),
            // Another one, in a life that began since the last snapshot, lists them.
            (
                4,
                false,
                2,
                |check| check.on_believed(29_900, (1, 3), 2),
                false,
            ),
            // Five of the longest intervals after a decision.
            (4, false, 2, |check| check.interval_ms = 6000, false),
            // With six others who were launched and not heard of yet they are eight, with seven
            // too many.
            (4, false, 2, |check| expects(check, 6), true),
            (4, false, 2, |check| expects(check, 7), false),
        ] {
            let (mut check, mut found) = (PatienceCheck::new(1000), Findings::new(1));
            check.on_told(adopted_s * 1000, 1, (1, 1));
            able_until(&mut check, 30, &mut found);
            besides(&mut check);
            let dead = claim(cells);
            let heard = |id, on| match id {
                2 if on == LOOP => Some((&dead, 1)),
                3 if on == LOOP => Some((&dead, 2)),
                _ => None,
            };
            check.on_down(30_100, (1, 2), 1, heard, &Handicaps::default());
            if opens {
                check.on_bid(
                    30_300,
                    1,
                    (&bid(7, true, 5000), 9),
                    &Handicaps::default(),
                    &mut found,
                );
            }
            let mut story = Story::new(300);
            story.snapshot(31_000, &[(1, speaking())], |s| {
                check.on_snapshot(s, &mut found);
            });
            assert_eq!(
                found.counts.contains_key("prompt"),
                broken,
                "{cells} {opens} {adopted_s} {:?}",
                check.believed
            );
        }
    }
}
