//! What is published against what is held: a beacon says at once what its author
//! believes, a claim lists soon what its author flies, and whoever holds the mission for
//! finished says so (`spoken`). What is published as covered was seen (S6).

use super::snapshot::is_alone;
use super::{Clocks, Findings, PeerSnapshot, Snapshot};
use skein_peer::cells::CellSet;
use skein_peer::wire::codec::Body;
use skein_peer::wire::message::{Beacon, Claim};
use skein_peer::{Beliefs, Incarnation};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What is changed by a rule is spoken within T, up to T/4 later so as not to be in step
/// with others; the peer looks four times a period; the share of the air lets a claim go
/// within T; snapshots come once a T.
const CLAIM_PERIODS: u64 = 4;

/// And where half of the share is less than a beacon in a period: a large claim has to wait
/// for its share.
const CROWDED_CLAIM_PERIODS: u64 = 6;

/// "Finished" is the least urgent record of few bytes: it waits behind a bid, a claim and
/// a state for a share of the air that lets one of them go in a period.
const FINISHED_PERIODS: u64 = 10;

/// A claim as it was put on the air.
#[derive(Clone, Debug)]
struct Published {
    incarnation: Incarnation,
    claim: Arc<Claim>,
}

/// What a peer has to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Owed {
    /// That it plans this cell, or no more.
    Cell(u16),
    /// Whether it hears anybody.
    Alone,
    /// That the mission is finished, in this revision.
    Finished(u32),
}

/// What the records of one run were found to say.
#[derive(Clone, Debug, Default)]
pub struct SpokenCheck {
    claims: BTreeMap<u16, Published>,
    finished: BTreeSet<(u16, Incarnation, u32)>,
    unspoken: Clocks<(u16, Owed)>,
    /// Cells published as covered that the world had not seen yet: when, by whom, of which
    /// loop. A frame may be judged a moment after its peer has looked at it.
    unseen: Vec<(u64, u16, u64, u16)>,
}

impl SpokenCheck {
    /// A process ends: what it said is no promise of the next one. Or it stands still and
    /// can say nothing (`death` is false).
    pub fn on_silent(&mut self, id: u16, death: bool) {
        if death {
            self.claims.remove(&id);
        }
        self.unspoken.retain(|(p, _)| *p != id);
    }

    /// A peer puts its own beacon on the air while it believes `view`: they agree.
    pub fn on_beacon(
        &mut self,
        now_ms: u64,
        (id, incarnation): (u16, Incarnation),
        beacon: &Beacon,
        view: &Beliefs,
        found: &mut Findings,
    ) {
        let digest = view.covered.digest();
        let says = [
            (
                "its life",
                u64::from(incarnation),
                u64::from(view.incarnation),
            ),
            ("able", beacon.able.into(), view.able.into()),
            ("finished", beacon.finished.into(), view.finished.into()),
            ("its revision", beacon.revision.into(), view.revision.into()),
            ("its loop", beacon.loop_hash, view.loop_hash),
        ];
        for (what, said, held) in says {
            if said != held {
                found.broken("spoken", now_ms, Some(id), || {
                    format!("its beacon says {said} of {what}, it believes {held}")
                });
            }
        }
        if view.loop_hash != 0 && beacon.cover_digest != digest {
            found.broken("spoken", now_ms, Some(id), || {
                "its beacon has another digest of what is covered than its own".to_owned()
            });
        }
        if beacon.counter < view.counter {
            found.broken("spoken", now_ms, Some(id), || {
                format!(
                    "its beacon says round {}, it promised {}",
                    beacon.counter, view.counter
                )
            });
        }
    }

    /// A peer publishes something else of its own; `seen` tells what cameras saw of the
    /// loop with this hash.
    pub fn on_said(
        &mut self,
        now_ms: u64,
        (id, incarnation): (u16, Incarnation),
        body: &Body,
        (loop_hash, seen): (u64, &CellSet),
        found: &mut Findings,
    ) {
        let marks = match body {
            Body::Claim(_) | Body::Beacon(_) => None,
            Body::Finished(f) => {
                self.finished.insert((id, incarnation, f.revision));
                None
            }
            Body::Cover(c) => Some((c.loop_hash, &c.covered)),
            Body::Bid(b) => Some((b.round.loop_hash, &b.covered)),
            _ => None,
        };
        let Some((_, runs)) = marks.filter(|(hash, _)| *hash == loop_hash && loop_hash != 0) else {
            return;
        };
        let unseen = CellSet::decode_rle(seen.capacity(), runs).map(|mut set| {
            set.subtract(seen);
            set.iter().next()
        });
        match unseen {
            Ok(None) => {}
            Ok(Some(cell)) => self.unseen.push((now_ms, id, loop_hash, cell)),
            Err(e) => found.broken("S8", now_ms, Some(id), || {
                format!("publishes covered cells that do not fit its loop: {e}")
            }),
        }
    }

    /// A peer publishes its claim.
    pub fn on_claim(&mut self, id: u16, incarnation: Incarnation, claim: Arc<Claim>) {
        self.claims.insert(id, Published { incarnation, claim });
    }

    /// Compares what is held with what was published last.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        for (at_ms, id, loop_hash, cell) in std::mem::take(&mut self.unseen) {
            if loop_hash == snapshot.loop_hash && !snapshot.covered.contains(cell) {
                found.broken("S6", at_ms, Some(id), || {
                    format!("publishes cell {cell} as covered, no camera has seen it")
                });
            }
        }
        let owed = snapshot.peers.iter().map(|m| (m.id, self.owed(m)));
        let owed: BTreeMap<u16, BTreeSet<Owed>> = owed.collect();
        self.unspoken
            .retain(|(p, what)| owed.get(p).is_none_or(|owed| owed.contains(what)));
        for m in snapshot.peers {
            for what in owed.get(&m.id).into_iter().flatten() {
                self.judge(snapshot, (m.id, *what), found);
            }
        }
    }

    /// What a peer has to say that it did not say yet.
    fn owed(&self, m: &PeerSnapshot) -> BTreeSet<Owed> {
        if !m.view.speaks || !m.uav || m.view.loop_hash == 0 {
            return BTreeSet::new();
        }
        let mut owed = self.claim_owed(m.id, &m.view);
        let key = (m.id, m.view.incarnation, m.view.revision);
        if m.view.finished && !self.finished.contains(&key) {
            owed.insert(Owed::Finished(m.view.revision));
        }
        owed
    }

    fn judge(&mut self, snapshot: &Snapshot<'_>, key: (u16, Owed), found: &mut Findings) {
        let crowded = snapshot.bounds.interval_ms > snapshot.bounds.period_ms;
        let claimed = if crowded {
            CROWDED_CLAIM_PERIODS
        } else {
            CLAIM_PERIODS
        };
        let periods = match key.1 {
            Owed::Cell(_) | Owed::Alone => claimed,
            Owed::Finished(_) => FINISHED_PERIODS,
        };
        let since_ms = self.unspoken.start(key, snapshot.now_ms);
        let took_ms = snapshot.lived_ms(key.0, since_ms);
        let bound_ms = periods * snapshot.bounds.interval_ms + snapshot.late_ms(key.0, since_ms);
        if took_ms > bound_ms && self.unspoken.tell_once(key) {
            found.broken("spoken", snapshot.now_ms, Some(key.0), || {
                let text = match key.1 {
                    Owed::Cell(c) => format!("its claim and its plan differ in cell {c}"),
                    Owed::Alone => {
                        "its claim and its belief differ in whether it hears anybody".to_owned()
                    }
                    Owed::Finished(_) => "has not said that the mission is finished".to_owned(),
                };
                format!("{text}, for {took_ms} ms (bound {bound_ms} ms)")
            });
        }
    }

    /// In what the claim published last differs from what is held: open cells of the plan,
    /// and whether its author hears anybody.
    fn claim_owed(&self, id: u16, view: &Beliefs) -> BTreeSet<Owed> {
        let n = view.covered.capacity();
        let held = CellSet::of(n, view.plan.iter().copied());
        let published = self
            .claims
            .get(&id)
            .filter(|p| p.incarnation == view.incarnation && p.claim.loop_hash == view.loop_hash);
        let runs = published.map_or(&[][..], |p| &p.claim.plan);
        let said = CellSet::of_runs(n, runs.iter().map(|l| l.run));
        let mut unsaid = held.clone();
        unsaid.subtract(&said);
        let mut differing = said;
        differing.subtract(&held);
        differing.union_with(&unsaid);
        differing.subtract(&view.covered);
        let mut owed: BTreeSet<Owed> = differing.iter().map(Owed::Cell).collect();
        // Who lists nothing need not say that it is alone, and may have said so before.
        let lists = !view.plan.is_empty() || !view.held.is_empty();
        let owes = |says: bool| {
            if says {
                !is_alone(view)
            } else {
                lists && is_alone(view)
            }
        };
        if published.is_some_and(|p| owes(p.claim.alone)) {
            owed.insert(Owed::Alone);
        }
        owed
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{LOOP, Story, speaking};
    use super::*;
    use skein_peer::PeerId;
    use skein_peer::output::Status;
    use skein_peer::wire::message::{CellRun, Cover, Finished, ListedRun, Stamp};

    fn beacon_of(view: &Beliefs) -> Beacon {
        Beacon {
            heartbeat: 3,
            east_mm: 0,
            north_mm: 0,
            heading_e4: 0,
            able: view.able,
            ground_station: false,
            finished: view.finished,
            nonce: 7,
            counter: view.counter,
            eccentricity: 1,
            interval: 4,
            sharers: 2,
            revision: view.revision,
            loop_hash: view.loop_hash,
            cover_digest: view.covered.digest(),
            gossip: Vec::new(),
            fresh: Vec::new(),
        }
    }

    fn claim_of(first: u16, count: u16) -> Arc<Claim> {
        Arc::new(Claim {
            loop_hash: LOOP,
            plan: vec![ListedRun {
                run: CellRun { first, count },
                backward: false,
                stamp: Stamp::default(),
            }],
            // Peers that know nobody hear nobody.
            alone: true,
            ..Claim::default()
        })
    }

    #[test]
    fn a_beacon_that_says_anything_but_its_authors_beliefs_is_found() {
        let mut view = speaking();
        view.counter = 4;
        let lies: [fn(&mut Beacon); 6] = [
            |b| b.able = !b.able,
            |b| b.finished = !b.finished,
            |b| b.revision += 1,
            |b| b.loop_hash += 1,
            |b| b.cover_digest += 1,
            |b| b.counter -= 1,
        ];
        let (mut check, mut found) = (SpokenCheck::default(), Findings::new(1));
        check.on_beacon(9, (1, 1), &beacon_of(&view), &view, &mut found);
        assert!(found.counts.is_empty(), "{:?}", found.violations);
        for (n, lie) in lies.iter().enumerate() {
            let mut beacon = beacon_of(&view);
            lie(&mut beacon);
            check.on_beacon(9, (1, 1), &beacon, &view, &mut found);
            assert_eq!(found.counts.get("spoken"), Some(&(n as u64 + 1)));
        }
    }

    #[test]
    fn a_secret_plan_a_vain_claim_and_one_of_an_earlier_life_are_found() {
        let planned = |plan: &[u16], incarnation| Beliefs {
            plan: plan.to_vec(),
            incarnation,
            ..speaking()
        };
        let hears = |mut view: Beliefs| {
            view.peers.insert(PeerId(2), (1, Status::Alive));
            view
        };
        for (view, broken) in [
            (planned(&[0, 1], 1), false),
            (planned(&[0, 1, 2], 1), true),
            (planned(&[0], 1), true),
            (planned(&[0, 1], 2), true),
            (hears(planned(&[0, 1], 1)), true),
        ] {
            let (mut check, mut found) = (SpokenCheck::default(), Findings::new(1));
            let mut story = Story::new(300);
            check.on_claim(1, 1, claim_of(0, 2));
            for t in 0..7 {
                let views = [(1, view.clone())];
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(found.counts.contains_key("spoken"), broken, "{view:?}");
        }
    }

    #[test]
    fn whoever_stands_still_owes_nothing_meanwhile() {
        let view = Beliefs {
            plan: vec![0, 1, 2],
            ..speaking()
        };
        for (stood_still, broken) in [(false, true), (true, false)] {
            let (mut check, mut found) = (SpokenCheck::default(), Findings::new(1));
            let mut story = Story::new(300);
            check.on_claim(1, 1, claim_of(0, 2));
            for t in [0, 1, 20] {
                if stood_still && t == 20 {
                    check.on_silent(1, false);
                }
                let views = [(1, view.clone())];
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(found.counts.contains_key("spoken"), broken);
        }
    }

    #[test]
    fn being_alone_is_said_with_what_is_listed_and_taken_back_also_without() {
        let company = BTreeMap::from([(PeerId(2), (1, Status::Alive))]);
        for (says, hears, lists, broken) in [
            (true, false, true, false),
            (true, false, false, false),
            (true, true, true, true),
            (true, true, false, true),
            (false, false, true, true),
            (false, false, false, false),
            (false, true, true, false),
        ] {
            let (mut check, mut found) = (SpokenCheck::default(), Findings::new(1));
            let claim = Claim {
                alone: says,
                ..(*claim_of(0, 1)).clone()
            };
            check.on_claim(1, 1, Arc::new(claim));
            let view = Beliefs {
                plan: if lists { vec![0] } else { Vec::new() },
                covered: CellSet::of(4, (!lists).then_some(0)),
                peers: if hears {
                    company.clone()
                } else {
                    BTreeMap::new()
                },
                ..speaking()
            };
            let mut story = Story::new(0);
            for t in 0..7 {
                let views = [(1, view.clone())];
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            let case = (says, hears, lists);
            assert_eq!(found.counts.contains_key("spoken"), broken, "{case:?}");
        }
    }

    #[test]
    fn an_end_that_is_kept_back_is_found() {
        for says in [true, false] {
            let (mut check, mut found) = (SpokenCheck::default(), Findings::new(1));
            let mut story = Story::new(0);
            let body = Body::Finished(Finished { revision: 1 });
            if says {
                check.on_said(1, (1, 1), &body, (LOOP, &CellSet::new(4)), &mut found);
            }
            let view = Beliefs {
                finished: true,
                ..speaking()
            };
            for t in 0..13 {
                let views = [(1, view.clone())];
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(found.counts.contains_key("spoken"), !says);
        }
    }

    #[test]
    fn an_end_is_owed_anew_in_each_revision() {
        for changes in [true, false] {
            let (mut check, mut found) = (SpokenCheck::default(), Findings::new(1));
            let mut story = Story::new(0);
            for t in 0..16 {
                let view = Beliefs {
                    finished: true,
                    revision: if changes && t >= 8 { 2 } else { 1 },
                    ..speaking()
                };
                story.snapshot(t * 1000, &[(1, view)], |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(found.counts.contains_key("spoken"), !changes);
        }
    }

    #[test]
    fn coverage_that_is_published_and_was_not_seen_is_found() {
        let mut set = CellSet::new(4);
        set.insert(2);
        let cover = Body::Cover(Cover {
            revision: 1,
            loop_hash: LOOP,
            covered: set.encode_rle(None),
        });
        for (seen, broken) in [
            (&[2][..], false),
            (&[0, 1, 2, 3], false),
            (&[0, 1, 3], true),
        ] {
            let seen = CellSet::of(4, seen.iter().copied());
            let (mut check, mut found) = (SpokenCheck::default(), Findings::new(1));
            check.on_said(9, (1, 1), &cover, (LOOP, &seen), &mut found);
            let mut story = Story::new(0);
            story.snapshot(1000, &[], |s| check.on_snapshot(s, &mut found));
            assert_eq!(found.counts.contains_key("S6"), broken, "{seen:?}");
        }
    }
}
