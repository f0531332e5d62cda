//! Of two processes under one id in one component one is silent, and only then: it says
//! and plans nothing, and goes home (`twins`, `home`). In one airframe the one that speaks
//! flies it, and the other gives it no setpoints (`twins`).

use super::{Clocks, Findings, PeerSnapshot, Snapshot};
use crate::twins::Twins;
use skein_peer::{Incarnation, Report};
use std::collections::{BTreeMap, BTreeSet};

/// A peer looks four times a period, and the check once.
const LOOK_PERIODS: u64 = 2;

/// Who is as near as this to its twin may be in one airframe with it and flies nothing,
/// metres: 60 m, and two seconds of flight between what the twin told and now.
const ONE_PLACE_M: f64 = 100.0;

/// A peer that flies gives a setpoint at each percept: none for so long is none, milliseconds.
const NO_SETPOINT_MS: u64 = 2_000;

/// What the twins of one run were found to do.
#[derive(Clone, Debug, Default)]
pub struct TwinCheck {
    twins: Twins,
    silent: BTreeSet<u16>,
    /// By id and life who spoke in it first, and whether another one did, too.
    lives: BTreeMap<(u16, Incarnation), (u16, bool)>,
    both: Clocks<(u16, u16)>,
    neither: Clocks<u16>,
    told: Clocks<u16>,
    /// When each last gave its airframe a setpoint, and one that it took, milliseconds.
    setpoints_ms: BTreeMap<u16, (u64, u64)>,
    /// Who gives setpoints to an airframe that another one flies, or speaks and does not fly.
    wrong: Clocks<u16>,
}

impl TwinCheck {
    /// Of these twins.
    #[must_use]
    pub fn new(twins: Twins) -> Self {
        Self {
            twins,
            ..Self::default()
        }
    }

    /// The numbers of all others with the id of this one.
    #[must_use]
    pub fn others(&self, number: u16) -> Vec<u16> {
        self.twins.others(number)
    }

    /// A peer says something in a life.
    pub fn on_said(&mut self, number: u16, life: Incarnation) {
        let key = (self.twins.id_of(number), life);
        if self.twins.is_shared(key.0) {
            let spoke = self.lives.entry(key).or_insert((number, false));
            spoke.1 |= spoke.0 != number;
        }
    }

    /// Whether this is a belief about a life in which two spoke: their heartbeats cannot be
    /// told apart, and the one with fewer is heard and not believed until it takes another.
    #[must_use]
    pub fn is_shared(&self, report: &Report) -> bool {
        let Report::Membership {
            peer, incarnation, ..
        } = report
        else {
            return false;
        };
        let spoke = self.lives.get(&(self.twins.id_of(peer.0), *incarnation));
        spoke.is_some_and(|(_, shared)| *shared)
    }

    /// A peer falls silent.
    pub fn on_silenced(&mut self, number: u16) {
        self.silent.insert(number);
    }

    /// A peer begins a life, or ends.
    pub fn on_voice(&mut self, number: u16) {
        self.silent.remove(&number);
        self.neither.stop(number);
        self.told.stop(number);
        self.wrong.stop(number);
    }

    /// A peer gives its airframe a setpoint, which that takes or not.
    pub fn on_setpoint(&mut self, now_ms: u64, number: u16, taken: bool) {
        if self.twins.is_shared(self.twins.id_of(number)) {
            let last = self.setpoints_ms.entry(number).or_default();
            last.0 = now_ms;
            last.1 = if taken { now_ms } else { last.1 };
        }
    }

    /// Whether a peer is silent.
    #[must_use]
    pub fn is_silent(&self, number: u16) -> bool {
        self.silent.contains(&number)
    }

    /// A peer puts something on the air.
    pub fn on_transmission(&mut self, now_ms: u64, number: u16, found: &mut Findings) {
        if self.is_silent(number) {
            found.broken("twins", now_ms, Some(number), || {
                "is silent since another process has its id, and speaks".to_owned()
            });
        }
    }

    /// Judges who speaks, and who is silent.
    pub fn on_snapshot(
        &mut self,
        snapshot: &Snapshot<'_>,
        silent: &[PeerSnapshot],
        found: &mut Findings,
    ) {
        if self.twins.is_empty() {
            return;
        }
        self.look_for_both(snapshot, found);
        self.look_for_commanders(snapshot, silent, found);
        for m in silent {
            self.look_for_neither(snapshot, m, found);
            if m.view.able || !m.view.plan.is_empty() || !m.view.held.is_empty() {
                self.told.start(m.id, snapshot.now_ms);
                if self.told.tell_once(m.id) {
                    found.broken("twins", snapshot.now_ms, Some(m.id), || {
                        "is silent since another process has its id, and plans".to_owned()
                    });
                }
            }
        }
    }

    /// In a component others tell each of the other, as soon as they find out who is there.
    fn look_for_both(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let bound_ms = snapshot.bounds.detection_ms();
        let speak: Vec<&PeerSnapshot> = snapshot.peers.iter().filter(|m| m.view.speaks).collect();
        for (number, id) in self.twins.iter() {
            for of in speak.iter().filter(|m| m.speaks_as == id) {
                let key = (of.id, number);
                let both = of.id != number && speak.iter().any(|m| m.id == number);
                if !both || !snapshot.graph.joined(of.id, number) {
                    self.both.stop(key);
                    continue;
                }
                let began_ms = self.both.start(key, snapshot.now_ms);
                let stable_ms = snapshot.stability.component_since_ms(number);
                let from_ms = began_ms.max(stable_ms.unwrap_or(snapshot.now_ms));
                let took_ms = snapshot.now_ms - from_ms;
                let grown_ms = snapshot.grown_ms(bound_ms, from_ms);
                let limit_ms = snapshot.grade().limit_ms(grown_ms);
                if limit_ms.is_some_and(|l| took_ms > l) && self.both.tell_once(key) {
                    found.broken("twins", snapshot.now_ms, Some(number), || {
                        format!(
                            "speaks as peer {id}, as another process in its component does, for {took_ms} ms (bound {bound_ms} ms)"
                        )
                    });
                }
            }
        }
    }

    /// Of two who are in one airframe one flies it, the one that speaks, as soon as the other
    /// has heard that it does.
    fn look_for_commanders(
        &mut self,
        snapshot: &Snapshot<'_>,
        silent: &[PeerSnapshot],
        found: &mut Findings,
    ) {
        let twins: Vec<(u16, u16)> = self.twins.iter().collect();
        for (number, id) in twins {
            if self.twins.airframe_of(number) != id {
                continue;
            }
            let of = |peers: &[PeerSnapshot], speaks: bool| {
                let is_one = |m: &&PeerSnapshot| [number, id].contains(&m.id);
                let so = |m: &&PeerSnapshot| m.view.speaks == speaks;
                peers.iter().filter(is_one).find(so).cloned()
            };
            let (Some(speaker), Some(other)) = (of(snapshot.peers, true), of(silent, false)) else {
                self.wrong.stop(number);
                self.wrong.stop(id);
                continue;
            };
            let (gave_ms, _) = self
                .setpoints_ms
                .get(&other.id)
                .copied()
                .unwrap_or_default();
            let (_, flew_ms) = self
                .setpoints_ms
                .get(&speaker.id)
                .copied()
                .unwrap_or_default();
            let recent = |t: u64, m: &PeerSnapshot| {
                t + NO_SETPOINT_MS + snapshot.late_ms(m.id, t) > snapshot.now_ms
            };
            let holds = speaker.view.loop_hash == 0 || recent(flew_ms, &speaker);
            for (m, is_wrong, what) in [
                (
                    &other,
                    gave_ms > 0 && recent(gave_ms, &other),
                    "is silent, and steers",
                ),
                (&speaker, !holds, "speaks, and does not fly"),
            ] {
                if !is_wrong {
                    self.wrong.stop(m.id);
                    continue;
                }
                let from_ms = self.wrong.start(m.id, snapshot.now_ms);
                let from_ms = from_ms.max(speaker.since_ms).max(other.since_ms);
                let took_ms = snapshot.now_ms - from_ms;
                let bound_ms = snapshot.grown_ms(snapshot.bounds.detection_ms(), from_ms);
                let limit_ms = snapshot.grade().limit_ms(bound_ms);
                if limit_ms.is_some_and(|l| took_ms > l) && self.wrong.tell_once(m.id) {
                    found.broken("twins", snapshot.now_ms, Some(m.id), || {
                        format!("{what} the airframe of peer {id}, in which another program is, for {took_ms} ms (bound {bound_ms} ms)")
                    });
                }
            }
        }
    }

    /// Who is silent comes back when nobody speaks under its id for as long as it takes all
    /// to find out; it must be able to write its life down.
    fn look_for_neither(
        &mut self,
        snapshot: &Snapshot<'_>,
        m: &PeerSnapshot,
        found: &mut Findings,
    ) {
        let speaks = |o: &&PeerSnapshot| o.speaks_as == m.speaks_as && o.view.speaks;
        if snapshot.peers.iter().any(|o| speaks(&o)) {
            self.neither.stop(m.id);
            return;
        }
        let since_ms = self.neither.start(m.id, snapshot.now_ms).max(m.since_ms);
        let took_ms = snapshot.lived_ms(m.id, since_ms);
        let bounds = super::Bounds {
            diameter: snapshot.bounds.diameter.max(u64::from(m.view.diameter)),
            ..snapshot.bounds
        };
        let bound_ms = snapshot.grown_ms(bounds.detection_ms(), since_ms)
            + LOOK_PERIODS * bounds.period_ms
            + snapshot.late_ms(m.id, since_ms);
        let write_ms = snapshot.handicaps.write_ms(m.id, since_ms, snapshot.now_ms);
        if write_ms.is_some_and(|w| took_ms > bound_ms + w) && self.neither.tell_once(m.id) {
            found.broken("twins", snapshot.now_ms, Some(m.id), || {
                format!(
                    "is silent although nobody speaks as peer {}, for {took_ms} ms (bound {bound_ms} ms)",
                    m.speaks_as
                )
            });
        }
    }

    /// Of these who are silent those who can know that they have an airframe of their own.
    #[must_use]
    pub fn steered(&self, peers: &[PeerSnapshot], silent: &[PeerSnapshot]) -> Vec<PeerSnapshot> {
        let near = |m: &PeerSnapshot, o: &PeerSnapshot| {
            let both = m.at.zip(o.at);
            o.id != m.id
                && o.speaks_as == m.speaks_as
                && both.is_some_and(|(a, b)| (a - b).norm() < ONE_PLACE_M)
        };
        let apart = |m: &&PeerSnapshot| !peers.iter().chain(silent).any(|o| near(m, o));
        // Who shares an airframe with another program waits until it knows that to be gone.
        let airframe = |number| self.twins.airframe_of(number);
        let own = |m: &&PeerSnapshot| {
            let others = self.twins.others(m.id);
            others.iter().all(|o| airframe(*o) != airframe(m.id))
        };
        silent.iter().filter(apart).filter(own).cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use skein_geometry::frame::Point;
    use skein_peer::Beliefs;

    fn silenced() -> Beliefs {
        Beliefs {
            speaks: false,
            is_silent: true,
            able: false,
            ..speaking()
        }
    }

    /// Some peers as a snapshot shows them.
    fn seen(now_ms: u64, twins: &Twins, views: &[(u16, Beliefs)]) -> Vec<PeerSnapshot> {
        let mut peers = Vec::new();
        let mut story = Story::new(0);
        story.twins = twins.clone();
        story.snapshot(now_ms, views, |s| peers = s.peers.to_vec());
        peers
    }

    /// Peer 1 and its twin 9 for a minute: whether each speaks, or else is silent.
    fn minute(loss_permille: u16, speak: [bool; 2], change: impl Fn(&mut Beliefs)) -> u64 {
        let twins = Twins::from_iter([(9, 1)]);
        let (mut check, mut found) = (TwinCheck::new(twins.clone()), Findings::new(1));
        let mut story = Story::new(loss_permille);
        story.twins = twins;
        for t in 1..=60 {
            let mut silent = silenced();
            change(&mut silent);
            let of = |speaks: bool| {
                [(1, speak[0]), (9, speak[1])]
                    .into_iter()
                    .filter(|(_, s)| *s == speaks)
                    .map(|(id, s)| (id, if s { speaking() } else { silent.clone() }))
                    .collect::<Vec<_>>()
            };
            let mute = seen(t * 1000, &story.twins, &of(false));
            story.snapshot(t * 1000, &of(true), |s| {
                check.on_snapshot(s, &mute, &mut found);
            });
        }
        found.counts.get("twins").copied().unwrap_or(0)
    }

    #[test]
    fn of_twins_in_one_component_just_one_speaks() {
        assert_eq!(minute(0, [true, false], |_| {}), 0);
        assert_eq!(minute(0, [false, true], |_| {}), 0);
        assert_eq!(minute(0, [true, true], |_| {}), 1);
        assert_eq!(minute(300, [true, true], |_| {}), 1);
        assert_eq!(minute(400, [true, true], |_| {}), 0, "reported only");
        // Two who are both silent, each for the other's sake.
        assert_eq!(minute(0, [false, false], |_| {}), 2);
        assert_eq!(minute(300, [false, false], |_| {}), 2);
    }

    #[test]
    fn who_is_silent_neither_plans_nor_speaks() {
        assert_eq!(minute(300, [true, false], |b| b.able = true), 1);
        assert_eq!(minute(300, [true, false], |b| b.plan = vec![2]), 1);
        let (mut check, mut found) = (TwinCheck::new(Twins::from_iter([(9, 1)])), Findings::new(1));
        check.on_transmission(1_000, 9, &mut found);
        check.on_silenced(9);
        check.on_transmission(2_000, 1, &mut found);
        assert!(found.counts.is_empty());
        check.on_transmission(2_000, 9, &mut found);
        assert_eq!(found.counts.get("twins"), Some(&1));
        check.on_voice(9);
        check.on_transmission(2_000, 9, &mut found);
        assert_eq!(found.counts.get("twins"), Some(&1));
    }

    /// Peer 1 speaks and 9 is silent, in one airframe, for a minute: which of them give
    /// setpoints, and from when on which one's are taken.
    fn flown(loss_permille: u16, gives: [bool; 2], taken: u16) -> u64 {
        let twins = Twins::from_iter([(9, 1)]).with_aboard([9]);
        let (mut check, mut found) = (TwinCheck::new(twins.clone()), Findings::new(1));
        let mut story = Story::new(loss_permille);
        story.twins = twins;
        for t in 1..=60 {
            for (number, gives) in [(1, gives[0]), (9, gives[1])] {
                if gives {
                    check.on_setpoint(t * 1000 - 200, number, taken == number);
                }
            }
            let mute = seen(t * 1000, &story.twins, &[(9, silenced())]);
            story.snapshot(t * 1000, &[(1, speaking())], |s| {
                check.on_snapshot(s, &mute, &mut found);
            });
        }
        found.counts.get("twins").copied().unwrap_or(0)
    }

    #[test]
    fn of_two_programs_in_one_airframe_the_one_that_speaks_flies_it_and_the_other_does_not() {
        assert_eq!(flown(0, [true, false], 1), 0);
        assert_eq!(flown(0, [true, true], 1), 1, "the silent one steers, too");
        assert_eq!(flown(0, [true, true], 9), 2, "and flies it");
        assert_eq!(flown(0, [false, false], 1), 1, "nobody flies");
        assert_eq!(flown(400, [true, true], 9), 0, "reported only");
    }

    #[test]
    fn who_may_sit_in_one_airframe_with_its_twin_need_not_fly_home() {
        for (away_m, steered) in [(99.0, 0), (101.0, 1)] {
            let mut story = Story::new(0);
            story.twins = Twins::from_iter([(9, 1)]);
            story.place(1, Point::new(0.0, 0.0));
            story.place(2, Point::new(away_m, 0.0));
            story.place(9, Point::new(away_m, 0.0));
            let check = TwinCheck::new(story.twins.clone());
            let views = [1, 2, 9].map(|id| (id, speaking()));
            story.snapshot(1_000, &views, |s| {
                let (peers, silent) = s.peers.split_at(2);
                assert_eq!(check.steered(peers, silent).len(), steered);
                // Who has no airframe of its own waits, also where the other one is gone.
                let aboard = TwinCheck::new(Twins::from_iter([(9, 1)]).with_aboard([9]));
                assert!(aboard.steered(&[], silent).is_empty());
            });
        }
    }
}
