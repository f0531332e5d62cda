//! Rounds judged from the bids alone (`decision`): whoever divides, divides what the bids
//! of one complete round say and nothing else; an adopted division is the one of its
//! epoch; nobody takes what another has committed; of a rebalancing only a gain is adopted.
//! And the bids themselves against what their authors did (`bid`).

use super::{Findings, Handicaps, Snapshot};
use crate::account::secs;
use crate::twins::Twins;
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use skein_flight::coverage::ring::division::{RouteNetwork, Rule};
use skein_flight::coverage::ring::{CoverageLoop, Direction, shares};
use skein_geometry::frame::Point;
use skein_peer::cells::CellSet;
use skein_peer::offload::MissionGeometry;
use skein_peer::protocol::airtime::ms_of;
use skein_peer::protocol::rounds::{OpenRound, RoundOrder, epoch_of, order_of};
use skein_peer::protocol::runs::cells_of;
use skein_peer::wire::message::{Bid, Claim, Epoch, Round};
use skein_peer::{Beliefs, PeerId};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::sync::Arc;

/// For a rebalancing the new makespan is at most this many percent of the present one.
const GAIN_PERCENT: u64 = 90;

/// Rebalancings are at least so many of the longest interval apart.
const CALM_INTERVALS: u64 = 20;

/// A bid may put its author nearer than it can fly by this much, metres: a frame sees a
/// cell from short of its boundary.
const REACH_SLACK_M: f64 = 100.0;

/// Where a bidder is and how fast it can get over the ground.
#[derive(Clone, Copy, Debug)]
pub struct Mover {
    /// Where.
    pub at: Point,
    /// How fast at most, the wind behind it, m/s.
    pub fastest_mps: f64,
    /// How long it may offer to fly at most from now on, milliseconds; nothing of a mission that
    /// the judge does not know.
    pub may_offer_ms: Option<u64>,
}

/// What the rounds of one run were found to be.
#[derive(Clone, Debug, Default)]
pub struct DecisionCheck {
    period_ms: u64,
    /// The longest interval that was announced lately.
    longest_ms: u64,
    twins: Twins,
    grounds: BTreeMap<u64, Arc<MissionGeometry>>,
    rounds: BTreeMap<RoundOrder, OpenRound>,
    divisions: BTreeMap<Epoch, Option<Divided>>,
    judged: BTreeMap<u16, Epoch>,
    adopted: BTreeMap<u16, Adopted>,
}

/// The problem of a round, and what comes out.
#[derive(Clone, Debug)]
struct Divided {
    ring: Vec<RingCell>,
    uavs: Vec<Uav>,
    division: Division,
    /// Who was given too much, once somebody asked.
    unfair: OnceCell<Option<String>>,
}

impl Divided {
    fn new(ring: Vec<RingCell>, uavs: Vec<Uav>, division: Division) -> Self {
        Self {
            ring,
            uavs,
            division,
            unfair: OnceCell::new(),
        }
    }
}

/// What a peer did since it last adopted a division.
#[derive(Clone, Copy, Debug, Default)]
struct Adopted {
    /// Divisions adopted in this life.
    count: u32,
    /// When the last one was.
    at_ms: u64,
    /// Whether it covered a cell since.
    progressed: bool,
}

impl DecisionCheck {
    /// The checks at beacon period T; of a run with these twins.
    #[must_use]
    pub fn new(period_ms: u64, twins: Twins) -> Self {
        Self {
            period_ms,
            twins,
            ..Self::default()
        }
    }

    /// Once a period.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>) {
        self.longest_ms = snapshot.bounds.interval_ms;
    }

    /// A peer announces an interval, which counts at once for who hears it.
    pub fn on_interval(&mut self, interval: u8) {
        self.longest_ms = self.longest_ms.max(ms_of(interval, self.period_ms));
    }

    /// A loop was derived.
    pub fn on_loop(&mut self, geometry: &Arc<MissionGeometry>) {
        self.grounds
            .entry(geometry.coverage_loop.hash())
            .or_insert_with(|| Arc::clone(geometry));
    }

    fn loop_of(&self, round: &Round) -> Option<&CoverageLoop> {
        let ground = self.grounds.get(&round.loop_hash);
        ground.map(|g| g.coverage_loop.as_ref())
    }

    /// A process starts, or begins to work on another loop: it has adopted nothing yet.
    pub fn on_anew(&mut self, id: u16) {
        self.adopted.remove(&id);
        self.judged.remove(&id);
    }

    /// A peer's camera saw so many cells that it did not know to be covered.
    pub fn on_covered(&mut self, id: u16, count: usize) {
        self.adopted.entry(id).or_default().progressed |= count > 0;
    }

    /// A peer tells what it will fly, having adopted so many divisions.
    pub fn on_told(&mut self, now_ms: u64, id: u16, adoptions: u32) {
        let adopted = self.adopted.entry(id).or_default();
        if adopted.count != adoptions {
            *adopted = Adopted {
                count: adoptions,
                at_ms: now_ms,
                progressed: false,
            };
        }
    }

    /// A peer makes a bid durable while it believes `view`; `mover` says where it is.
    pub fn on_bid(
        &mut self,
        now_ms: u64,
        id: u16,
        bid: &Bid,
        (view, mover): (&Beliefs, Option<Mover>),
        handicaps: &Handicaps,
        found: &mut Findings,
    ) {
        for text in self.lies(now_ms, id, bid, (view, mover), handicaps) {
            found.broken("bid", now_ms, Some(id), || text);
        }
        let (order, member) = (order_of(&bid.round), self.twins.id_of(id));
        let open = self.rounds.entry(order).or_insert_with(|| OpenRound {
            round: bid.round.clone(),
            bids: BTreeMap::new(),
        });
        open.bids.insert(member, bid.clone());
    }

    /// How a bid differs from what its author did and is.
    fn lies(
        &self,
        now_ms: u64,
        id: u16,
        bid: &Bid,
        (view, mover): (&Beliefs, Option<Mover>),
        handicaps: &Handicaps,
    ) -> Vec<String> {
        let mut lies = Vec::new();
        let adopted = self.adopted.get(&id).copied().unwrap_or_default();
        let told = adopted.count == view.adoptions;
        if told && bid.progressed != adopted.progressed {
            lies.push(format!(
                "says that it covered a cell since its last adoption: {}",
                bid.progressed
            ));
        }
        if view.plan.is_empty() && bid.eta_ms > 0 {
            lies.push(format!("ends nothing in {} ms", bid.eta_ms));
        }
        let budget_ms = u64::from(bid.release_ms) + u64::from(bid.endurance_ms);
        // A bid that cannot be flown at all offers nothing, whenever it is released.
        let may_offer_ms = mover.and_then(|m| m.may_offer_ms).unwrap_or(u64::MAX);
        if bid.endurance_ms > 0 && budget_ms > may_offer_ms.saturating_add(1_000) {
            lies.push(format!(
                "offers {} ms of flight from {} ms on, {may_offer_ms} ms are above its reserve and the way home from the farthest open cell",
                bid.endurance_ms, bid.release_ms
            ));
        }
        if told {
            let shown_ms = || handicaps.shown_ms(id, adopted.at_ms, now_ms);
            let ago_ms = if adopted.count > 0 {
                shown_ms()
            } else {
                u64::MAX
            };
            let least_ms = CALM_INTERVALS * view.interval_ms;
            let most_ms = CALM_INTERVALS * self.longest_ms.max(view.interval_ms);
            let (early, late) = (
                ago_ms.saturating_add(self.period_ms) < least_ms,
                ago_ms > most_ms + self.period_ms,
            );
            if (bid.calm && early) || (!bid.calm && late) {
                lies.push(format!(
                    "says that it is calm: {}, and adopted {ago_ms} ms ago",
                    bid.calm
                ));
            }
        }
        if let (Some(mover), Some(lp)) = (mover, self.loop_of(&bid.round)) {
            let anchor = lp.boundary(usize::from(bid.anchor)).position();
            let away_m = (anchor - mover.at).norm();
            // A late computer knows only where it was.
            let late_m = mover.fastest_mps * secs(handicaps.late_ms(id, now_ms, now_ms));
            let slack_m = REACH_SLACK_M + late_m;
            let reach_m = mover.fastest_mps * f64::from(bid.release_ms) / 1000.0 + slack_m;
            let strayed = bid.off_loop.iter().any(|off| {
                let off_m = (off.pose().position() - mover.at).norm();
                // Who is on the way of a task leaves from its end.
                off_m > slack_m + mover.fastest_mps * f64::from(off.ready_ms) / 1000.0
            });
            if strayed {
                lies.push("says that it is where it is not".to_owned());
            }
            if away_m > reach_m {
                lies.push(format!(
                    "says that it will be at boundary {} in {} ms, which is {away_m:.0} m away",
                    bid.anchor, bid.release_ms
                ));
            }
        }
        lies
    }

    /// A peer asks for a division, and gets it: some complete round's bids say exactly this.
    pub fn on_divide(
        &mut self,
        now_ms: u64,
        id: u16,
        (ring, uavs, division): (&[RingCell], &[Uav], &Division),
        found: &mut Findings,
    ) {
        let same_members = |o: &OpenRound| {
            o.bids.len() == uavs.len() && o.bids.keys().eq(uavs.iter().map(|r| &r.id))
        };
        let rounds = self.rounds.values().rev().filter(|o| is_complete(o));
        let says = rounds.filter(|o| same_members(o)).find(|o| {
            self.problem_of(o)
                .is_some_and(|p| p.0 == ring && p.1 == uavs)
        });
        if let Some(epoch) = says.map(epoch_of) {
            self.divisions.entry(epoch).or_insert_with(|| {
                Some(Divided::new(ring.to_vec(), uavs.to_vec(), division.clone()))
            });
        } else {
            let members: Vec<PeerId> = uavs.iter().map(|r| PeerId(r.id)).collect();
            found.broken("decision", now_ms, Some(id), || {
                format!("divides among {members:?} what no complete round's bids say")
            });
        }
    }

    /// What the bids of a round ask for: cells that no bid knows to be covered and no bid
    /// commits to are open.
    fn problem_of(&self, open: &OpenRound) -> Option<(Vec<RingCell>, Vec<Uav>)> {
        let lp = self.loop_of(&open.round)?;
        let n = u16::try_from(lp.len()).unwrap_or(u16::MAX);
        let mut done = vec![false; lp.len()];
        for (cell, flag) in lp.cells().iter().zip(&mut done) {
            *flag = !cell.needed;
        }
        for bid in open.bids.values() {
            let known = CellSet::decode_rle(n, &bid.covered).ok();
            let known = known.iter().flat_map(CellSet::iter);
            let commits = bid.commits.iter().flat_map(|run| cells_of(*run, n));
            known
                .chain(commits)
                .for_each(|c| done[usize::from(c)] = true);
        }
        let ring = lp.cells().iter().zip(&done).map(|(cell, done)| RingCell {
            service_mm: cell.service_mm,
            travel_mm: cell.travel_mm,
            open: !done,
        });
        let uavs = open.bids.iter().map(|(id, bid)| Uav {
            anchor: bid.anchor % n.max(1),
            id: *id,
            heading: if bid.backward {
                Direction::Backward
            } else {
                Direction::Forward
            },
            release_ms: bid.release_ms,
            speed_mmps: bid.speed_mmps.max(1),
            turn_ms: bid.turn_ms,
            endurance_ms: bid.endurance_ms,
            off_loop: bid.off_loop.first().copied(),
        });
        Some((ring.collect(), uavs.collect()))
    }

    /// A peer publishes its claim; `seen` tells what cameras saw of the first loop.
    pub fn on_claim(
        &mut self,
        now_ms: u64,
        id: u16,
        claim: &Claim,
        seen: Option<&CellSet>,
        found: &mut Findings,
    ) {
        let epoch = claim.epoch;
        if epoch == Epoch::default() || self.judged.get(&id).is_some_and(|e| *e >= epoch) {
            return;
        }
        self.judged.insert(id, epoch);
        let Some(open) = self.round_of(epoch) else {
            found.broken("decision", now_ms, Some(id), || {
                format!("adopted {epoch:?}, which is no round in which all members bid")
            });
            return;
        };
        let open = open.clone();
        let id = self.twins.id_of(id);
        self.judge_section(now_ms, id, (claim, &open), seen, found);
        self.judge_gain(now_ms, id, &open, epoch, found);
        self.judge_shares(now_ms, id, &open, epoch, found);
    }

    /// Nobody is given more than twice an even share of the remaining time, unless nobody
    /// else could serve its last cell sooner.
    fn judge_shares(
        &mut self,
        now_ms: u64,
        id: u16,
        open: &OpenRound,
        epoch: Epoch,
        found: &mut Findings,
    ) {
        let Some(ground) = self.grounds.get(&open.round.loop_hash).cloned() else {
            return;
        };
        let Some(d) = self.division_of(epoch, open) else {
            return;
        };
        if ground.mission.division != Rule::Best {
            return;
        }
        let unfair = d.unfair.get_or_init(|| overburdened(&ground, d));
        if let Some(text) = unfair {
            found.broken("decision", now_ms, Some(id), || text.clone());
        }
    }

    fn round_of(&self, epoch: Epoch) -> Option<&OpenRound> {
        let of_counter = (epoch.counter, 0, 0)..=(epoch.counter, usize::MAX, u32::MAX);
        self.rounds
            .range(of_counter)
            .map(|(_, o)| o)
            .find(|o| is_complete(o) && epoch_of(o) == epoch)
    }

    /// The division of a round; solved here only where nobody asked for it.
    fn division_of(&mut self, epoch: Epoch, open: &OpenRound) -> Option<&Divided> {
        if !self.divisions.contains_key(&epoch) {
            let ground = self.grounds.get(&open.round.loop_hash);
            let problem = self.problem_of(open);
            let divided = problem.zip(ground).map(|((ring, uavs), ground)| {
                let division = ground.divide(&ring, &uavs);
                Divided::new(ring, uavs, division)
            });
            self.divisions.insert(epoch, divided);
        }
        self.divisions.get(&epoch).and_then(Option::as_ref)
    }

    /// What is newly listed by this round is in the author's section of it, and no other
    /// member has committed to it.
    fn judge_section(
        &mut self,
        now_ms: u64,
        id: u16,
        (claim, open): (&Claim, &OpenRound),
        seen: Option<&CellSet>,
        found: &mut Findings,
    ) {
        let Some(Divided { ring, division, .. }) = self.division_of(claim.epoch, open) else {
            return;
        };
        let n = u16::try_from(ring.len()).unwrap_or(u16::MAX);
        let mut mine = vec![false; ring.len()];
        let section = division.sections.iter().find(|s| s.id == id);
        for leg in section.iter().flat_map(|s| &s.legs) {
            leg.cells(ring.len())
                .for_each(|c| mine[usize::from(c)] = true);
        }
        let commits = |of: u16| {
            let bid = open.bids.get(&of);
            let runs = bid.into_iter().flat_map(|b| b.commits.iter());
            runs.flat_map(|run| cells_of(*run, n)).collect::<Vec<u16>>()
        };
        let own = commits(id);
        let others = open.bids.keys().filter(|o| **o != id);
        let others: Vec<u16> = others.flat_map(|o| commits(*o)).collect();
        let listed = claim
            .plan
            .iter()
            .filter(|l| l.stamp.epoch == claim.epoch && l.stamp.take == 0 && l.stamp.id == id);
        for cell in listed.flat_map(|l| cells_of(l.run, n)) {
            let c = usize::from(cell);
            // Runs bridge what is covered; cells already committed are the author's own.
            let is_open = |seen: &CellSet| cell < seen.capacity() && !seen.contains(cell);
            if !seen.is_some_and(is_open) || own.contains(&cell) {
                continue;
            }
            if others.contains(&cell) {
                found.broken("decision", now_ms, Some(id), || {
                    format!("lists cell {cell}, to which another member of the round committed")
                });
            } else if ring[c].open && !mine[c] {
                found.broken("decision", now_ms, Some(id), || {
                    format!("lists cell {cell}, which is in another's section of its epoch")
                });
            }
        }
    }

    /// A rebalancing: a gain of a tenth, calm for 20 T, something covered since.
    fn judge_gain(
        &mut self,
        now_ms: u64,
        id: u16,
        open: &OpenRound,
        epoch: Epoch,
        found: &mut Findings,
    ) {
        if open.round.repair {
            return;
        }
        let Some(Divided { division, .. }) = self.division_of(epoch, open) else {
            return;
        };
        let all = || open.bids.values();
        let present_ms = all().map(|b| u64::from(b.eta_ms)).max().unwrap_or(0);
        let new_ms = u64::from(division.makespan_ms);
        let calm = all().all(|b| b.calm);
        let progress = all().any(|b| b.progressed);
        if new_ms * 100 > present_ms * GAIN_PERCENT || !calm || !progress {
            found.broken("decision", now_ms, Some(id), || {
                format!("adopted a rebalancing that takes {new_ms} ms instead of {present_ms} ms (calm {calm}, progress {progress})")
            });
        }
    }
}

/// Who of a division is given too much.
fn overburdened(ground: &MissionGeometry, divided: &Divided) -> Option<String> {
    let network = RouteNetwork {
        coverage_loop: &ground.coverage_loop,
        router: &ground.router,
    };
    let Divided {
        ring,
        uavs,
        division,
        ..
    } = divided;
    let who = shares::overburdened(ring, uavs, network, division)?;
    Some(format!(
        "gives uav{} {} ms of flight, an even share being {} ms, though uav{} could serve its cell {} sooner",
        who.id, who.given_ms, who.even_ms, who.helper, who.cell
    ))
}

fn is_complete(open: &OpenRound) -> bool {
    let members = open.round.members.iter();
    members.len() == open.bids.len() && members.zip(open.bids.keys()).all(|(m, id)| m.id == *id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry_cache::GeometryCache;
    use crate::world::fixture;
    use skein_geometry::frame::Point;
    use skein_peer::wire::message::{CellRun, ListedRun, Member, Stamp};

    /// Two members on the fixture's loop, with their bids.
    struct Case {
        check: DecisionCheck,
        found: Findings,
        lp: Arc<CoverageLoop>,
        bids: [Bid; 2],
    }

    fn view() -> Beliefs {
        Beliefs {
            spendable_ms: 2_000_000,
            ..Beliefs::default()
        }
    }

    impl Case {
        fn new(repair: bool) -> Self {
            let spec = fixture::square(2);
            let geometry = GeometryCache::default().of(&spec.mission).unwrap();
            let lp = Arc::clone(&geometry.coverage_loop);
            let round = Round {
                counter: 1,
                members: [1, 2].map(|id| Member { id, incarnation: 1 }).to_vec(),
                revision: 1,
                loop_hash: lp.hash(),
                repair,
                wait_ms: 5000,
            };
            let bid = |anchor: usize| Bid {
                round: round.clone(),
                anchor: u16::try_from(anchor).unwrap(),
                backward: false,
                release_ms: 0,
                speed_mmps: 12_000,
                turn_ms: 10_000,
                endurance_ms: 1_000_000,
                covered: Vec::new(),
                commits: Vec::new(),
                off_loop: Vec::new(),
                eta_ms: 0,
                calm: true,
                progressed: false,
            };
            let mut check = DecisionCheck::new(1000, Twins::default());
            check.on_loop(&geometry);
            Self {
                check,
                found: Findings::new(1),
                bids: [bid(0), bid(lp.len() / 2)],
                lp,
            }
        }

        fn bid(&mut self) {
            for (id, bid) in [(1, self.bids[0].clone()), (2, self.bids[1].clone())] {
                let view = Beliefs {
                    plan: if bid.eta_ms == 0 { Vec::new() } else { vec![0] },
                    ..view()
                };
                self.check.on_bid(
                    9,
                    id,
                    &bid,
                    (&view, None),
                    &Handicaps::default(),
                    &mut self.found,
                );
            }
        }

        fn problem(&self) -> (Vec<RingCell>, Vec<Uav>) {
            let open = self.check.rounds.values().next().unwrap();
            self.check.problem_of(open).unwrap()
        }

        fn epoch(&self) -> Epoch {
            epoch_of(self.check.rounds.values().next().unwrap())
        }

        /// Peer 1 claims these cells in the epoch of the round.
        fn claims(&mut self, epoch: Epoch, first: u16, count: u16) {
            let claim = Claim {
                loop_hash: self.lp.hash(),
                epoch,
                plan: vec![ListedRun {
                    run: CellRun { first, count },
                    backward: false,
                    stamp: Stamp {
                        epoch,
                        take: 0,
                        id: 1,
                    },
                }],
                ..Claim::default()
            };
            let seen = CellSet::new(u16::try_from(self.lp.len()).unwrap());
            self.check
                .on_claim(9, 1, &claim, Some(&seen), &mut self.found);
        }

        fn broken(&self, name: &str) -> bool {
            self.found.counts.contains_key(name)
        }
    }

    #[test]
    fn dividing_anything_but_what_all_bids_say_is_found() {
        let mut c = Case::new(true);
        c.bid();
        let (ring, uavs) = c.problem();
        let ground = Arc::clone(&c.check.grounds[&c.lp.hash()]);
        let division = ground.divide(&ring, &uavs);
        let asked = (&ring[..], &uavs[..], &division);
        c.check.on_divide(9, 1, asked, &mut c.found);
        assert!(!c.broken("decision"), "{:?}", c.found.violations);
        let mut own_view = ring.clone();
        let open = own_view.iter().position(|r| r.open).unwrap();
        own_view[open].open = false;
        let mut alone = uavs.clone();
        alone.pop();
        let mut faster = uavs.clone();
        faster[1].speed_mmps += 1;
        for (n, (ring, uavs)) in [(&own_view, &uavs), (&ring, &alone), (&ring, &faster)]
            .into_iter()
            .enumerate()
        {
            let asked = (&ring[..], &uavs[..], &division);
            c.check.on_divide(9, 1, asked, &mut c.found);
            assert_eq!(c.found.counts.get("decision"), Some(&(n as u64 + 1)));
        }
    }

    #[test]
    fn adopting_before_all_have_bid_is_found() {
        let mut c = Case::new(true);
        c.bid();
        let epoch = c.epoch();
        let mut early = Case::new(true);
        let bid = early.bids[0].clone();
        let view = view();
        early.check.on_bid(
            9,
            1,
            &bid,
            (&view, None),
            &Handicaps::default(),
            &mut early.found,
        );
        early.claims(epoch, 0, 1);
        assert!(early.broken("decision"));
    }

    #[test]
    fn listing_what_is_anothers_or_committed_is_found() {
        let mut c = Case::new(true);
        c.bid();
        let (ring, uavs) = c.problem();
        let division = c.check.grounds[&c.lp.hash()].divide(&ring, &uavs);
        let of = |id: u16| {
            let section = division.sections.iter().find(|s| s.id == id).unwrap();
            let mut cells = section.legs.iter().flat_map(|l| l.cells(ring.len()));
            cells.find(|c| ring[usize::from(*c)].open).unwrap()
        };
        for (cell, broken) in [(of(1), false), (of(2), true)] {
            let mut c = Case::new(true);
            c.bid();
            let epoch = c.epoch();
            c.claims(epoch, cell, 1);
            assert_eq!(c.broken("decision"), broken, "{:?}", c.found.violations);
        }
        let mut c = Case::new(true);
        c.bids[1].commits = vec![CellRun {
            first: of(1),
            count: 1,
        }];
        c.bid();
        let epoch = c.epoch();
        c.claims(epoch, of(1), 1);
        assert!(c.broken("decision"));
    }

    #[test]
    fn who_is_given_what_others_could_do_sooner_is_found() {
        let mut c = Case::new(true);
        c.bid();
        let (ring, uavs) = c.problem();
        let ground = Arc::clone(&c.check.grounds[&c.lp.hash()]);
        let fair = ground.divide(&ring, &uavs);
        let judged = |division: &Division| {
            let divided = Divided::new(ring.clone(), uavs.clone(), division.clone());
            overburdened(&ground, &divided)
        };
        assert_eq!(judged(&fair), None);
        // All of it for the first, nothing for the second.
        let mut unfair = fair.clone();
        let first = &mut unfair.sections[0];
        first.legs = vec![skein_flight::coverage::ring::backtracking::Leg {
            first: 0,
            count: u16::try_from(ring.len()).unwrap(),
            direction: Direction::Forward,
        }];
        first.finish_ms *= 3;
        unfair.sections[1].legs.clear();
        unfair.sections[1].finish_ms = 0;
        let told = judged(&unfair).unwrap();
        assert!(
            told.contains("gives uav1") && told.contains("uav2 could"),
            "{told}"
        );
    }

    #[test]
    fn a_rebalancing_needs_gain_calm_and_progress() {
        for (eta_ms, calm, progressed, broken) in [
            (900_000_000, true, true, false),
            (1_000, true, true, true),
            (900_000_000, false, true, true),
            (900_000_000, true, false, true),
        ] {
            let mut c = Case::new(false);
            for bid in &mut c.bids {
                (bid.eta_ms, bid.calm, bid.progressed) = (eta_ms, calm, progressed);
            }
            c.bid();
            let epoch = c.epoch();
            c.claims(epoch, 0, 0);
            assert_eq!(
                c.broken("decision"),
                broken,
                "{eta_ms} {calm} {progressed}: {:?}",
                c.found.violations
            );
        }
    }

    #[test]
    fn a_bid_that_differs_from_what_its_author_did_is_found() {
        let mover = |east_m| Mover {
            at: Point::new(east_m, 0.0),
            fastest_mps: 20.0,
            may_offer_ms: Some(2_000_000),
        };
        type Lie = fn(&mut Bid);
        let lies: [(Lie, u64, f64, u8, bool); 9] = [
            (|_| {}, 40, 0.0, 4, false),
            (|b| b.progressed = false, 40, 0.0, 4, true),
            (|b| b.calm = false, 40, 0.0, 4, true),
            (|_| {}, 10, 0.0, 4, true),
            // Somebody just announced an interval of two periods.
            (|b| b.calm = false, 40, 0.0, 8, false),
            (|b| b.calm = false, 10, 0.0, 4, false),
            (|b| b.eta_ms = 1, 40, 0.0, 4, true),
            (|b| b.endurance_ms = 3_000_000, 40, 0.0, 4, true),
            (|_| {}, 40, 5_000.0, 4, true),
        ];
        for (n, (lie, at_s, east_m, announced, broken)) in lies.into_iter().enumerate() {
            let mut c = Case::new(true);
            c.check.on_told(0, 1, 1);
            c.check.on_covered(1, 3);
            c.check.on_interval(announced);
            let mut bid = c.bids[0].clone();
            (bid.calm, bid.progressed) = (true, true);
            lie(&mut bid);
            let view = Beliefs {
                adoptions: 1,
                interval_ms: 1000,
                ..view()
            };
            let at = Some(mover(east_m));
            c.check.on_bid(
                at_s * 1000,
                1,
                &bid,
                (&view, at),
                &Handicaps::default(),
                &mut c.found,
            );
            assert_eq!(c.broken("bid"), broken, "{n}: {:?}", c.found.violations);
        }
    }
}
