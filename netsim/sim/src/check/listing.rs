//! Which peer lists which cell: orphans (I1, L2), and yielding to a higher stamp (S5).

use super::membership::Membership;
use super::snapshot::is_alone;
use super::{Clocks, Findings, Grade, PeerSnapshot, Snapshot};
use skein_peer::PeerId;
use skein_peer::cells::CellSet;
use skein_peer::output::Status;
use skein_peer::protocol::launches::Planned;
use skein_peer::protocol::runs::cells_of;
use skein_peer::wire::limits::PLAN_MAX;
use skein_peer::wire::message::{Claim, ListedRun, Stamp};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::sync::Arc;

/// An orphan is one no longer than so many bounds of L2, whatever is lost or comes and goes:
/// measured 1.5 in some 700 storms.
const LOST_FACTOR: u64 = 3;

/// Life and number of a record.
pub type Version = (u32, u32);

/// A cell that nobody live lists.
#[derive(Clone, Copy, Debug)]
struct Orphan {
    since_ms: u64,
    owner: Option<u16>,
    /// Who of the dead is taken for its owner by somebody who is to list it.
    claimant: Option<u16>,
    /// When all who are to list it last took it to be planned by one that is out of their reach.
    heeded_ms: u64,
    /// When nobody had room for it last.
    full_ms: u64,
    told: bool,
}

/// Who may spend less is not asked to fly to cells that others left.
const LITTLE_FUEL_MS: u32 = 60_000;

/// What listing found out in one run.
#[derive(Clone, Debug, Default)]
pub struct ListingCheck {
    /// Whom the roster gives which section: until it would be flown that one is taken to be
    /// there by all who never heard of it.
    roster: Vec<Planned>,
    orphans: BTreeMap<u16, Orphan>,
    last_lister: BTreeMap<u16, u16>,
    /// Who of the dead, before anybody knew of its death, was heard to plan it by somebody who is
    /// to list it.
    claimed_by_dead: BTreeMap<u16, u16>,
    able_since_ms: Option<u64>,
    heard: BTreeMap<(u16, u16), (Arc<Claim>, Version)>,
    /// The same of the loop before, of whom the newest section is one of another loop.
    left: BTreeMap<(u16, u16), (Arc<Claim>, Version)>,
    clashes: Clocks<(u16, u16, u16)>,
}

impl ListingCheck {
    /// On the loop of which a roster gives everybody one of these sections.
    #[must_use]
    pub fn with_roster(roster: Vec<Planned>) -> Self {
        Self {
            roster,
            ..Self::default()
        }
    }

    /// Cells are counted on another loop from now on. What was heard stands: each claim names its
    /// loop.
    pub fn on_new_loop(&mut self) {
        *self = Self {
            heard: std::mem::take(&mut self.heard),
            left: std::mem::take(&mut self.left),
            ..Self::default()
        };
    }

    /// A process ended.
    pub fn on_death(&mut self, id: u16) {
        self.heard.retain(|(o, _), _| *o != id);
        self.left.retain(|(o, _), _| *o != id);
    }

    /// A peer was given another's section. What was written earlier than what it has
    /// says nothing new: the medium may deliver in any order.
    pub fn on_heard(&mut self, (by, author): (u16, u16), version: Version, claim: &Arc<Claim>) {
        if by == author {
            return;
        }
        let known = self.heard.get(&(by, author));
        if known.is_some_and(|(_, v)| *v >= version) {
            return;
        }
        let new = (Arc::clone(claim), version);
        if let Some(before) = self.heard.insert((by, author), new)
            && before.0.loop_hash != claim.loop_hash
        {
            self.left.insert((by, author), before);
        }
    }

    /// The newest section of one peer that another heard, and in which life it was said.
    #[must_use]
    pub fn heard(&self, by: u16, author: u16) -> Option<(&Arc<Claim>, u32)> {
        let heard = self.heard.get(&(by, author));
        heard.map(|(claim, version)| (claim, version.0))
    }

    /// The newest section on this loop of one peer that another heard, and in which life it was
    /// said: what somebody listed before it went on to another loop stands for who stays.
    #[must_use]
    pub fn heard_on(&self, by: u16, author: u16, loop_hash: u64) -> Option<(&Arc<Claim>, u32)> {
        let both = [self.heard.get(&(by, author)), self.left.get(&(by, author))];
        let mut both = both.into_iter().flatten();
        let (claim, version) = both.find(|(claim, _)| claim.loop_hash == loop_hash)?;
        Some((claim, version.0))
    }

    /// Judges everybody's plans.
    pub fn on_snapshot(
        &mut self,
        snapshot: &Snapshot<'_>,
        members: &Membership,
        found: &mut Findings,
    ) {
        self.look_for_orphans(snapshot, members, found);
        self.look_for_clashes(snapshot, members, found);
    }

    fn look_for_orphans(
        &mut self,
        snapshot: &Snapshot<'_>,
        members: &Membership,
        found: &mut Findings,
    ) {
        let n = usize::from(snapshot.covered.capacity());
        // Whose disk takes no writes can promise nothing, so it lists nothing new.
        let since_ms = |m: &PeerSnapshot| {
            let writes_ms = snapshot.handicaps.writes_since_ms(m.id, snapshot.now_ms)?;
            let component_ms = snapshot.stability.component_since_ms(m.id)?;
            Some(writes_ms.max(component_ms))
        };
        // Who believes all others down lists nothing for them.
        let in_company = snapshot.able().any(|o| !is_alone(&o.view));
        let lists = |m: &PeerSnapshot| !(in_company && is_alone(&m.view));
        // An orphan is to be listed in every other component with an able peer, so the one
        // that has been stable for longest is the one that counts.
        let listers = snapshot.able().filter(|m| lists(m));
        let stable_ms = listers.filter_map(since_ms).min();
        let Some(stable_ms) = stable_ms.filter(|_| n > 0) else {
            self.able_since_ms = None;
            return;
        };
        let able_since_ms = *self.able_since_ms.get_or_insert(snapshot.now_ms);
        let mut lister: Vec<Option<u16>> = vec![None; n];
        let mut settled = snapshot.covered.clone();
        for m in snapshot
            .peers
            .iter()
            .filter(|m| m.view.loop_hash == snapshot.loop_hash)
        {
            settled.union_with(&m.view.covered);
            for c in &m.view.unassigned {
                settled.insert(*c);
            }
            if !lists(m) {
                continue;
            }
            for c in m.view.held.iter().chain(&m.view.plan) {
                if let Some(l) = lister.get_mut(usize::from(*c)) {
                    *l = Some(m.id);
                }
            }
        }
        let counts_from_ms = stable_ms.max(able_since_ms);
        let expected = self.expected(snapshot, able_since_ms, lists);
        self.note_claims_of_the_dead(snapshot, members, lists);
        let heeded = self.claimed_by_who_left(snapshot, lists);
        let is_full = OnceCell::new();
        for (cell, lister) in (0..).zip(lister) {
            if lister.is_none() && expected.contains(cell) {
                self.orphans.remove(&cell);
            } else if settled.contains(cell) || lister.is_some() {
                self.settle(snapshot, cell, lister, members, counts_from_ms, found);
            } else {
                let is_full = *is_full.get_or_init(|| self.nobody_has_room(snapshot, lists));
                let at = (cell, heeded.contains(cell), is_full);
                self.orphaned(snapshot, at, members, counts_from_ms, found);
            }
        }
    }

    /// Whether of those who are to list cells some have said as many runs as a claim has room for,
    /// and list the others as these are flown, and the rest have no fuel to speak of.
    fn nobody_has_room(
        &self,
        snapshot: &Snapshot<'_>,
        lists: impl Fn(&PeerSnapshot) -> bool,
    ) -> bool {
        let mut newest: BTreeMap<u16, (Version, bool)> = BTreeMap::new();
        for ((_, author), (claim, version)) in &self.heard {
            let is_full = claim.loop_hash == snapshot.loop_hash && claim.plan.len() >= PLAN_MAX;
            let known = newest.entry(*author).or_insert((*version, is_full));
            if *version > known.0 {
                *known = (*version, is_full);
            }
        }
        let is_full = |m: &&PeerSnapshot| newest.get(&m.speaks_as).is_some_and(|n| n.1);
        let able = || snapshot.able().filter(|m| lists(m));
        // What it plans takes fuel as well.
        let spare_ms = |m: &PeerSnapshot| m.view.spendable_ms.saturating_sub(m.eta_ms);
        able().any(|m| is_full(&m)) && able().all(|m| is_full(&m) || spare_ms(m) < LITTLE_FUEL_MS)
    }

    /// The sections of whom the roster names and nobody able who lists for others has heard of, for
    /// as long as each would take.
    fn expected(
        &self,
        snapshot: &Snapshot<'_>,
        begin_ms: u64,
        lists: impl Fn(&PeerSnapshot) -> bool,
    ) -> CellSet {
        let mut expected = CellSet::new(snapshot.covered.capacity());
        for p in &self.roster {
            let end_ms = begin_ms + snapshot.grown_ms(p.end_ms, begin_ms);
            let mut able = snapshot.able().filter(|m| lists(m));
            let id = PeerId(p.id);
            if snapshot.now_ms < end_ms
                && !able.any(|m| m.speaks_as == p.id || m.view.peers.contains_key(&id))
            {
                for c in cells_of(p.run, expected.capacity()) {
                    expected.insert(c);
                }
            }
        }
        expected
    }

    /// What a dead one claimed is no orphan, until its death is found out, for whoever of those
    /// that are to list it heard that claim: not only where that one itself was seen to list it
    /// last. Somebody else may have been that, of whom nobody in reach knows.
    fn note_claims_of_the_dead(
        &mut self,
        snapshot: &Snapshot<'_>,
        members: &Membership,
        lists: impl Fn(&PeerSnapshot) -> bool,
    ) {
        let n = snapshot.covered.capacity();
        for m in snapshot.able().filter(|m| lists(m)) {
            for ((_, author), (claim, (life, _))) in self.heard.range((m.id, 0)..=(m.id, u16::MAX))
            {
                let silence = members.silence(*author);
                let is_its_last = silence.is_some_and(|s| s.incarnation == *life);
                let unknown = is_its_last && members.detected_ms(*author).is_none();
                if !unknown || claim.alone || claim.loop_hash != snapshot.loop_hash {
                    continue;
                }
                for cell in planned(claim, n) {
                    self.claimed_by_dead.insert(cell, *author);
                }
            }
        }
    }

    /// What one that lives and believes all others down is still taken to plan by all who are to
    /// list it: they heard it claim that, believe that it lives, and did not hear that it is alone.
    fn claimed_by_who_left(
        &self,
        snapshot: &Snapshot<'_>,
        lists: impl Fn(&PeerSnapshot) -> bool,
    ) -> CellSet {
        let n = snapshot.covered.capacity();
        let left: Vec<u16> = snapshot
            .peers
            .iter()
            .filter(|m| is_alone(&m.view))
            .map(|m| m.speaks_as)
            .collect();
        let mut all: Option<CellSet> = None;
        for m in snapshot.able().filter(|m| lists(m)) {
            let claims = left.iter().filter_map(|author| {
                let (_, status) = m.view.peers.get(&PeerId(*author))?;
                let (claim, _) = self.heard(m.id, *author)?;
                let is_heeded = !claim.alone && claim.loop_hash == snapshot.loop_hash;
                (is_heeded && *status != Status::Down).then_some(claim)
            });
            let claimed = CellSet::of(n, claims.flat_map(|claim| planned(claim, n)));
            match &mut all {
                Some(all) => all.intersect_with(&claimed),
                None => all = Some(claimed),
            }
        }
        all.unwrap_or_else(|| CellSet::new(n))
    }

    fn settle(
        &mut self,
        snapshot: &Snapshot<'_>,
        cell: u16,
        lister: Option<u16>,
        members: &Membership,
        counts_from_ms: u64,
        found: &mut Findings,
    ) {
        if let Some(o) = self.orphans.remove(&cell) {
            let from_ms = counted_from(&o, members)
                .unwrap_or(snapshot.now_ms)
                .max(counts_from_ms)
                .max(o.heeded_ms)
                .max(o.full_ms);
            found.took(
                "L2",
                snapshot.grade(),
                snapshot.now_ms.saturating_sub(from_ms),
                snapshot.takeover_ms(from_ms),
            );
        }
        self.claimed_by_dead.remove(&cell);
        if let Some(by) = lister {
            self.last_lister.insert(cell, by);
        }
    }

    fn orphaned(
        &mut self,
        snapshot: &Snapshot<'_>,
        (cell, is_heeded, is_full): (u16, bool, bool),
        members: &Membership,
        counts_from_ms: u64,
        found: &mut Findings,
    ) {
        let mut owner = self.last_lister.get(&cell).copied();
        if !self.orphans.contains_key(&cell) {
            // Whoever listed it may have yielded it to one who is dead by now.
            let n = snapshot.covered.capacity();
            let heard = owner.map(|by| self.heard.range((by, 0)..=(by, u16::MAX)));
            let silent = heard
                .into_iter()
                .flatten()
                .filter(|((_, author), _)| members.silence(*author).is_some());
            let here = silent.filter(|(_, (claim, _))| claim.loop_hash == snapshot.loop_hash);
            let mut yielded = here.filter(|(_, (claim, _))| planned(claim, n).any(|c| c == cell));
            owner = yielded.next().map(|((_, author), _)| *author).or(owner);
        }
        let o = self.orphans.entry(cell).or_insert(Orphan {
            since_ms: snapshot.now_ms,
            owner,
            claimant: None,
            heeded_ms: 0,
            full_ms: 0,
            told: false,
        });
        if is_heeded {
            o.heeded_ms = snapshot.now_ms;
        }
        if is_full {
            o.full_ms = snapshot.now_ms;
        }
        // One after the other may have claimed it and died.
        o.claimant = self.claimed_by_dead.get(&cell).copied().or(o.claimant);
        let Some(from_ms) = counted_from(o, members) else {
            return;
        };
        let from_ms = from_ms.max(o.full_ms);
        let counts_from_ms = from_ms.max(counts_from_ms).max(o.heeded_ms);
        let took_ms = snapshot.now_ms.saturating_sub(counts_from_ms);
        let bound_ms = snapshot.takeover_ms(counts_from_ms);
        // A bid or a section that collides is lost as any other is: one more round.
        let grade = if snapshot.collides() {
            Grade::Light
        } else {
            snapshot.grade()
        };
        let graded = grade.limit_ms(bound_ms).is_some_and(|l| took_ms > l);
        let gone_ms = snapshot
            .now_ms
            .saturating_sub(from_ms.max(self.able_since_ms.unwrap_or(snapshot.now_ms)));
        let lost = gone_ms > bound_ms * LOST_FACTOR;
        if (graded || lost) && !std::mem::replace(&mut o.told, true) {
            let (check, owner) = (if graded { "L2" } else { "I1" }, o.owner);
            found.broken(check, snapshot.now_ms, owner, || {
                format!(
                    "cell {cell} is listed by no live peer, for {gone_ms} ms ({took_ms} ms since the components last changed; bound {bound_ms} ms); its last owner was {owner:?}"
                )
            });
        }
    }

    /// S5: of two listings that know of each other the lower one yields before the next look.
    fn look_for_clashes(
        &mut self,
        snapshot: &Snapshot<'_>,
        members: &Membership,
        found: &mut Findings,
    ) {
        let cells = snapshot.covered.capacity();
        let n = usize::from(cells);
        // It yields when it hears; a snapshot may fall between the two, the next one may not.
        let bound_ms = snapshot.bounds.period_ms / 2;
        let mut seen: Vec<(u16, u16, u16)> = Vec::new();
        for m in snapshot
            .peers
            .iter()
            .filter(|m| m.uav && m.view.loop_hash == snapshot.loop_hash)
        {
            // By the stamps that it goes by: what it takes anew it may not have said yet.
            let mut stamps: Vec<Option<Stamp>> = vec![None; n];
            let (mut first, mut last) = (n, 0);
            for (cell, stamp) in m.view.plan.iter().zip(&m.view.stamps) {
                let c = usize::from(*cell);
                if c < n && !m.view.covered.contains(*cell) {
                    stamps[c] = Some(*stamp);
                    (first, last) = (first.min(c), last.max(c));
                }
            }
            let plans_near = |l: &&ListedRun| {
                let begin = usize::from(l.run.first);
                let end = begin + usize::from(l.run.count);
                end > n || (begin <= last && end > first)
            };
            for (&(_, author), (claim, (life, _))) in self.heard.range((m.id, 0)..=(m.id, u16::MAX))
            {
                // Who believes all others down is no part of their component.
                if claim.alone || claim.loop_hash != snapshot.loop_hash {
                    continue;
                }
                let mut near = claim.plan.iter().filter(plans_near).peekable();
                let alive = || members.belief(m.id, author) == Some((*life, Status::Alive));
                if near.peek().is_none() || !alive() {
                    continue;
                }
                for l in near {
                    let lower = |c: &u16| stamps[usize::from(*c)].is_some_and(|s| s < l.stamp);
                    let clashing = cells_of(l.run, cells).filter(lower);
                    seen.extend(clashing.map(|c| (m.id, author, c)));
                }
            }
        }
        seen.sort_unstable();
        self.clashes.retain(|k| seen.binary_search(k).is_ok());
        for key in seen {
            let since_ms = self.clashes.start(key, snapshot.now_ms);
            let took_ms = snapshot.lived_ms(key.0, since_ms);
            let bound_ms = bound_ms + snapshot.late_ms(key.0, since_ms);
            if took_ms > bound_ms && self.clashes.tell_once(key) {
                let (id, author, cell) = key;
                found.broken("S5", snapshot.now_ms, Some(id), || {
                    format!("still plans cell {cell}, which it heard peer {author} list at a higher stamp {took_ms} ms ago (bound {bound_ms} ms)")
                });
            }
        }
    }

    /// Cells that are orphans at this moment.
    #[must_use]
    pub fn orphans(&self) -> usize {
        self.orphans.len()
    }
}

/// From when an orphan counts: from the detection of its owner's death where it has
/// one; `None` while nobody knows, which the check of detection bounds.
fn counted_from(o: &Orphan, members: &Membership) -> Option<u64> {
    let owners = [o.owner, o.claimant].into_iter().flatten();
    let mut dead = owners.filter(|id| members.silence(*id).is_some());
    dead.try_fold(o.since_ms, |from_ms, id| {
        members.detected_ms(id).map(|d| d.max(from_ms))
    })
}

/// The cells that a claim plans to fly yet, on a loop of so many.
fn planned(claim: &Claim, cells: u16) -> impl Iterator<Item = u16> + '_ {
    claim.plan.iter().flat_map(move |l| cells_of(l.run, cells))
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, Graph, Handicaps, Stability};
    use super::*;
    use skein_flight::coverage::ring::Direction;
    use skein_peer::Beliefs;
    use skein_peer::wire::message::{CellRun, Epoch};

    const BOUNDS: Bounds = Bounds {
        period_ms: 1000,
        interval_ms: 1000,
        diameter: 1,
    };

    fn stamp(counter: u32, id: u16) -> Stamp {
        Stamp {
            epoch: Epoch { counter, hash: 0 },
            take: 0,
            id,
        }
    }

    struct Story {
        check: ListingCheck,
        members: Membership,
        found: Findings,
        stability: Stability,
        loss: u16,
        diameter: u32,
        /// Who believes all others down.
        alone: Option<u16>,
        /// What everybody but that one believes of others besides.
        others: Vec<(u16, Status)>,
        /// What each may spend, and what its plan takes.
        fuel_ms: u32,
        eta_ms: u32,
    }

    impl Story {
        fn new(loss: u16) -> Self {
            Self {
                check: ListingCheck::default(),
                members: Membership::default(),
                found: Findings::new(1),
                stability: Stability::default(),
                loss,
                diameter: 1,
                alone: None,
                others: Vec::new(),
                fuel_ms: 0,
                eta_ms: 0,
            }
        }

        fn believed(&self, by: u16) -> BTreeMap<PeerId, (u32, Status)> {
            let is_alone = self.alone == Some(by);
            let status = if is_alone {
                Status::Down
            } else {
                Status::Alive
            };
            let others = self.others.iter().filter(|_| !is_alone);
            let others = others.map(|(id, status)| (PeerId(*id), (1, *status)));
            others.chain([(PeerId(99), (1, status))]).collect()
        }

        /// One snapshot of a ring of four cells: each peer with its plan.
        fn snapshot(&mut self, now_ms: u64, plans: &[(u16, &[u16])]) {
            let peers: Vec<PeerSnapshot> = plans
                .iter()
                .map(|(id, plan)| PeerSnapshot {
                    id: *id,
                    speaks_as: *id,
                    uav: true,
                    since_ms: 0,
                    at: None,
                    fuel_ms: None,
                    eta_ms: self.eta_ms,
                    view: Beliefs {
                        able: true,
                        loop_hash: 9,
                        covered: CellSet::new(4),
                        plan: plan.to_vec(),
                        stamps: vec![stamp(5, *id); plan.len()],
                        peers: self.believed(*id),
                        spendable_ms: self.fuel_ms,
                        ..Beliefs::default()
                    },
                })
                .collect();
            let graph = Graph::new(peers.iter().map(|m| m.id).collect(), |_, _| true);
            self.stability.observe(now_ms, &graph, |_| 1, 10_000);
            let snapshot = Snapshot {
                now_ms,
                loss_permille: self.loss,
                bounds: Bounds {
                    diameter: self.diameter.into(),
                    ..BOUNDS
                },
                graph: &graph,
                stability: &self.stability,
                handicaps: &Handicaps::default(),
                peers: &peers,
                covered: &CellSet::new(4),
                loop_hash: 9,
            };
            self.check
                .on_snapshot(&snapshot, &self.members, &mut self.found);
        }
    }

    /// Within two hops the bound is 16 s, and twice that as bids collide.
    #[test]
    fn over_several_hops_a_cell_is_without_an_owner_for_twice_the_bound_at_most() {
        for (loss, diameter, breaks_s) in [(0, 1, 13), (0, 2, 33), (50, 2, 33)] {
            let mut s = Story::new(loss);
            s.diameter = diameter;
            let breaks = (0..90).find(|t| {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2])]);
                s.found.counts.contains_key("L2")
            });
            assert_eq!(breaks, Some(breaks_s), "loss {loss}, D = {diameter}");
        }
    }

    #[test]
    fn a_cell_without_an_owner_for_longer_than_l2_is_a_violation_unless_much_is_lost() {
        for (loss, at_14, at_90) in [(0, 1, 1), (50, 0, 1), (300, 0, 1)] {
            let mut s = Story::new(loss);
            for t in 0..14 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2])]);
            }
            assert_eq!(s.found.counts.values().sum::<u64>(), at_14, "loss {loss}");
            for t in 14..90 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2])]);
            }
            assert_eq!(s.found.counts.values().sum::<u64>(), at_90, "loss {loss}");
        }
    }

    #[test]
    fn the_section_of_whom_the_roster_names_is_no_orphan_until_it_would_be_flown() {
        let roster = |end_ms| {
            vec![Planned {
                id: 3,
                run: CellRun { first: 3, count: 1 },
                direction: Direction::Forward,
                end_ms,
            }]
        };
        // Who has heard of it: peer 99 is known, 3 is not.
        for (end_ms, broken) in [(0, true), (20_000, false)] {
            let mut s = Story::new(0);
            s.check = ListingCheck::with_roster(roster(end_ms));
            for t in 0..30 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2])]);
            }
            assert_eq!(s.found.counts.contains_key("L2"), broken, "{end_ms}");
            for t in 30..50 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2])]);
            }
            assert!(s.found.counts.contains_key("L2"), "{end_ms}");
        }
        let mut s = Story::new(0);
        let mut known = roster(90_000);
        known[0].id = 99;
        s.check = ListingCheck::with_roster(known);
        for t in 0..30 {
            s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2])]);
        }
        assert!(
            s.found.counts.contains_key("L2"),
            "somebody has heard of it"
        );
        // It flies it, out of reach of all others from the beginning.
        for (heard, broken) in [(false, false), (true, true)] {
            let mut s = Story::new(0);
            s.alone = Some(3);
            s.others = if heard {
                vec![(3, Status::Alive)]
            } else {
                vec![]
            };
            s.check = ListingCheck::with_roster(roster(90_000));
            for t in 0..30 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2]), (3, &[3])]);
            }
            assert_eq!(s.found.counts.contains_key("L2"), broken, "{heard}");
        }
    }

    #[test]
    fn what_no_claim_has_room_for_waits_unless_somebody_else_has_fuel() {
        let run = |first| ListedRun {
            run: CellRun { first, count: 1 },
            backward: false,
            stamp: stamp(5, 1),
        };
        let much = LITTLE_FUEL_MS;
        for (runs, (fuel_ms, eta_ms), broken) in [
            (15, (0, 0), true),
            (16, (0, 0), false),
            (16, (much, 0), true),
            (16, (2 * much, much + 1), false),
        ] {
            let mut s = Story::new(0);
            (s.fuel_ms, s.eta_ms) = (fuel_ms, eta_ms);
            let claim = Claim {
                loop_hash: 9,
                plan: (0..runs).map(run).collect(),
                ..Claim::default()
            };
            s.check.on_heard((2, 1), (1, 1), &Arc::new(claim));
            for t in 0..30 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2])]);
            }
            let found = s.found.counts.contains_key("L2");
            assert_eq!(found, broken, "{runs} runs, {fuel_ms} ms, {eta_ms} ms");
        }
    }

    #[test]
    fn what_only_a_deaf_peer_lists_is_without_an_owner_while_others_can_plan() {
        for (plans, broken) in [
            (&[(1, &[0u16, 1][..]), (2, &[2, 3])][..], true),
            (&[(2, &[0, 1, 2, 3])], false),
        ] {
            let mut s = Story::new(0);
            s.alone = Some(2);
            for t in 0..14 {
                s.snapshot(t * 1000, plans);
            }
            assert_eq!(s.found.counts.contains_key("L2"), broken, "{plans:?}");
        }
    }

    #[test]
    fn an_orphan_of_a_dead_peer_counts_from_the_detection_of_its_death() {
        let mut s = Story::new(0);
        s.members.on_life(0, 2, 1);
        s.snapshot(0, &[(1, &[0, 1]), (2, &[2, 3])]);
        s.members.on_silent(500, 2, true, &BOUNDS);
        s.check.on_death(2);
        for t in 1..40 {
            s.snapshot(t * 1000, &[(1, &[0, 1])]);
        }
        assert!(
            s.found.counts.is_empty(),
            "nobody knows yet: {:?}",
            s.found.violations
        );
        s.members.on_belief(
            40_500,
            (1, 2),
            (1, Status::Down),
            (&BOUNDS, &Handicaps::default()),
            None,
        );
        s.snapshot(41_000, &[(1, &[0, 1])]);
        s.snapshot(42_000, &[(1, &[0, 1, 3, 2])]);
        assert!(s.found.counts.is_empty());
        assert_eq!(s.check.orphans(), 0);
    }

    /// 2 is out of reach and believes all others down, and 1 takes it to live for so long.
    #[test]
    fn what_one_who_left_claimed_counts_from_when_it_is_believed_down() {
        for (heard, says_alone, broken) in [
            (true, false, false),
            (true, true, true),
            (false, false, true),
        ] {
            let mut s = Story::new(0);
            s.alone = Some(2);
            let claim = Claim {
                alone: says_alone,
                ..(*claim_of_two()).clone()
            };
            if heard {
                s.check.on_heard((1, 2), (1, 1), &Arc::new(claim));
            }
            s.others = vec![(2, Status::Alive)];
            for t in 0..20 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2, 3])]);
            }
            assert_eq!(s.found.counts.contains_key("L2"), broken);
            s.others = vec![(2, Status::Down)];
            for t in 20..31 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2, 3])]);
            }
            assert_eq!(s.found.counts.contains_key("L2"), broken);
            for t in 31..35 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (2, &[2, 3])]);
            }
            assert!(s.found.counts.contains_key("L2"));
        }
    }

    /// A claim of cells 2 and 3.
    fn claim_of_two() -> Arc<Claim> {
        let run = ListedRun {
            run: CellRun { first: 2, count: 2 },
            backward: false,
            stamp: Stamp::default(),
        };
        Arc::new(Claim {
            loop_hash: 9,
            plan: vec![run],
            ..Claim::default()
        })
    }

    #[test]
    fn what_was_claimed_before_its_author_went_on_to_another_loop_is_known_of_the_loop_it_left() {
        let mut check = ListingCheck::default();
        let on = |loop_hash| {
            Arc::new(Claim {
                loop_hash,
                ..Claim::default()
            })
        };
        let (mine, theirs) = (claim_of_two(), on(10));
        check.on_heard((1, 2), (1, 3), &mine);
        assert_eq!(check.heard_on(1, 2, 9), Some((&mine, 1)));
        check.on_heard((1, 2), (1, 5), &theirs);
        check.on_heard((1, 2), (1, 4), &on(9));
        check.on_new_loop();
        assert_eq!(check.heard(1, 2), Some((&theirs, 1)));
        assert_eq!(check.heard_on(1, 2, 10), Some((&theirs, 1)));
        assert_eq!(
            check.heard_on(1, 2, 9),
            Some((&mine, 1)),
            "the newest of it"
        );
        assert_eq!(check.heard_on(1, 2, 11), None);
        assert_eq!(check.heard_on(3, 2, 9), None);
        check.on_death(1);
        assert_eq!(check.heard_on(1, 2, 9), None);
    }

    #[test]
    fn what_a_dead_one_claimed_counts_from_its_detection_whoever_was_seen_to_list_it_last() {
        for heard in [true, false] {
            let mut s = Story::new(0);
            for id in [1, 2, 3] {
                s.members.on_life(0, id, 1);
            }
            // 3 is out of reach and believes all others down; it lists all while nobody else does.
            s.alone = Some(3);
            s.members.on_silent(500, 2, true, &BOUNDS);
            s.check.on_death(2);
            s.snapshot(1000, &[(3, &[0, 1, 2, 3])]);
            // 1 comes back, and was told by others of 2 and of what that claims.
            if heard {
                s.check.on_heard((1, 2), (1, 1), &claim_of_two());
            }
            for t in 2..30 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (3, &[0, 1, 2, 3])]);
            }
            assert_eq!(s.found.counts.is_empty(), heard, "{:?}", s.found.violations);
            let down = (1, Status::Down);
            s.members
                .on_belief(30_500, (1, 2), down, (&BOUNDS, &Handicaps::default()), None);
            for t in 31..42 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (3, &[0, 1, 2, 3])]);
            }
            assert_eq!(s.found.counts.is_empty(), heard, "{:?}", s.found.violations);
            for t in 42..46 {
                s.snapshot(t * 1000, &[(1, &[0, 1]), (3, &[0, 1, 2, 3])]);
            }
            assert!(s.found.counts.contains_key("L2"), "its time is over");
        }
    }

    /// 2 and then 3 claimed the same cells and died, before anybody was seen to list them.
    #[test]
    fn what_one_dead_one_after_the_other_claimed_counts_from_the_last_detection() {
        let mut s = Story::new(0);
        for (id, at_ms) in [(2, 500), (3, 4_500)] {
            s.members.on_life(0, id, 1);
            s.check.on_heard((1, id), (1, 1), &claim_of_two());
            s.members.on_silent(at_ms, id, true, &BOUNDS);
            s.check.on_death(id);
            s.snapshot(at_ms + 500, &[(1, &[0, 1])]);
        }
        let healthy = Handicaps::default();
        for (id, at_ms) in [(2, 8_500), (3, 20_500)] {
            let down = (1, Status::Down);
            s.members
                .on_belief(at_ms, (1, id), down, (&BOUNDS, &healthy), None);
            for t in 1..11 {
                s.snapshot(at_ms + 500 + t * 1000, &[(1, &[0, 1])]);
            }
            assert!(s.found.counts.is_empty(), "{:?}", s.found.violations);
        }
        for t in 32..40 {
            s.snapshot(t * 1000, &[(1, &[0, 1])]);
        }
        assert!(s.found.counts.contains_key("L2"));
    }

    #[test]
    fn a_cell_yielded_to_one_who_is_dead_counts_from_the_detection_of_that_death() {
        let mut s = Story::new(0);
        for id in [1, 2] {
            s.members.on_life(0, id, 1);
        }
        s.snapshot(0, &[(1, &[0, 1, 2, 3])]);
        s.members.on_silent(500, 2, true, &BOUNDS);
        s.check.on_death(2);
        // The claim reaches the other after its author's death.
        s.check.on_heard((1, 2), (1, 1), &claim_of_two());
        s.snapshot(1000, &[(1, &[0, 1, 2, 3])]);
        for t in 2..20 {
            s.snapshot(t * 1000, &[(1, &[0, 1])]);
        }
        assert!(s.found.counts.is_empty(), "{:?}", s.found.violations);
        // What nobody has claimed is without an owner at once.
        for t in 20..40 {
            s.snapshot(t * 1000, &[(1, &[0])]);
        }
        assert_eq!(s.found.counts.get("L2"), Some(&1));
    }

    #[test]
    fn a_peer_that_keeps_a_cell_heard_at_a_higher_stamp_breaks_s5() {
        let claim = |counter: u32, id: u16| {
            Arc::new(Claim {
                loop_hash: 9,
                plan: vec![ListedRun {
                    run: CellRun { first: 3, count: 2 },
                    backward: false,
                    stamp: stamp(counter, id),
                }],
                ..Claim::default()
            })
        };
        let deaf = |claim: Arc<Claim>, alone| {
            let mut claim = (*claim).clone();
            claim.alone = alone;
            Arc::new(claim)
        };
        for (other, alone, broken) in [(7, false, true), (7, true, false), (2, false, false)] {
            let mut s = Story::new(300);
            s.members.on_belief(
                0,
                (1, 2),
                (1, Status::Alive),
                (&BOUNDS, &Handicaps::default()),
                None,
            );
            s.check
                .on_heard((1, 2), (1, 8), &deaf(claim(other, 2), alone));
            s.check.on_heard((1, 2), (1, 7), &claim(9, 2));
            for t in 1..6 {
                s.snapshot(t * 1000, &[(1, &[3, 0, 1, 2]), (2, &[])]);
            }
            assert_eq!(s.found.counts.contains_key("S5"), broken);
        }
    }
}
