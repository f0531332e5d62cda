//! Who knows of whose death, and how soon: detection at any loss, false downs, and
//! agreement on the members of a component (L1).

use super::{Bounds, Clocks, Findings, Grade, Handicaps, PeerSnapshot, Snapshot};
use skein_peer::output::Status;
use std::collections::BTreeMap;

/// Whoever is so many hops away at most is heard of in time at light loss: by the neighbour of
/// a neighbour.
const NEAR: u32 = 2;

/// A peer that cannot be heard because its process does not run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Silence {
    /// Since when, milliseconds.
    pub since_ms: u64,
    /// Its last life.
    pub incarnation: u32,
    /// Whether its process ended; otherwise it stands still.
    pub death: bool,
    /// The largest diameter that mattered since.
    diameter: u64,
    /// And the longest interval.
    interval_ms: u64,
}

/// What membership found out in one run.
#[derive(Clone, Debug, Default)]
pub struct Membership {
    silences: BTreeMap<u16, Silence>,
    lives: BTreeMap<u16, (u32, u64)>,
    speaks_since: BTreeMap<u16, u64>,
    beliefs: BTreeMap<(u16, u16), (u32, Status)>,
    detected: BTreeMap<u16, u64>,
    late: Clocks<(u16, u16)>,
    disagreements: Clocks<(u16, u16)>,
    misjudged: Clocks<u16>,
    judged_downs: usize,
    /// Living peers declared Down although a path to them had existed for a whole bound:
    /// when, by whom, whom.
    pub false_downs: Vec<(u64, u16, u16)>,
}

impl Membership {
    /// A peer runs under an incarnation: at boot, or after it learned of a higher one.
    pub fn on_life(&mut self, now_ms: u64, id: u16, incarnation: u32) {
        self.lives.insert(id, (incarnation, now_ms));
        self.speaks_since.remove(&id);
    }

    /// A process starts, or goes on after standing still. A starting one believes nothing.
    pub fn on_running(&mut self, id: u16, boot: bool) {
        self.silences.remove(&id);
        self.detected.remove(&id);
        self.late.retain(|(o, x)| *o != id && *x != id);
        if boot {
            self.beliefs.retain(|(o, _), _| *o != id);
            self.speaks_since.remove(&id);
        }
    }

    /// A process ended or stands still.
    pub fn on_silent(&mut self, now_ms: u64, id: u16, death: bool, bounds: &Bounds) {
        let incarnation = self.lives.get(&id).map_or(0, |l| l.0);
        self.silences.insert(
            id,
            Silence {
                since_ms: now_ms,
                incarnation,
                death,
                diameter: bounds.diameter,
                interval_ms: bounds.interval_ms,
            },
        );
        self.detected.remove(&id);
        self.late.retain(|(o, _)| *o != id);
    }

    /// What others believe of this life of one peer they believe of another one.
    pub fn on_heir(&mut self, of: u16, heir: u16, life: u32) {
        let about = |(key, belief): (&(u16, u16), &(u32, Status))| {
            (key.1 == of && belief.0 == life).then_some((key.0, *belief))
        };
        let beliefs: Vec<_> = self.beliefs.iter().filter_map(about).collect();
        for (observer, belief) in beliefs {
            self.beliefs.remove(&(observer, of));
            self.beliefs.entry((observer, heir)).or_insert(belief);
        }
    }

    /// One peer means another one by the id of this one: for it this one is gone.
    pub fn on_another_meant(&mut self, now_ms: u64, observer: u16, subject: u16) {
        let known = self.beliefs.remove(&(observer, subject)).is_some();
        self.late.stop((observer, subject));
        if known && self.silences.contains_key(&subject) {
            self.detected.entry(subject).or_insert(now_ms);
        }
    }

    /// The present incarnation of a peer, 0 before its first boot.
    #[must_use]
    pub fn life(&self, id: u16) -> u32 {
        self.lives.get(&id).map_or(0, |l| l.0)
    }

    /// The silence of a peer, if it is silent.
    #[must_use]
    pub fn silence(&self, id: u16) -> Option<Silence> {
        self.silences.get(&id).copied()
    }

    /// When a live peer first found out that this silent one is down.
    #[must_use]
    pub fn detected_ms(&self, id: u16) -> Option<u64> {
        self.detected.get(&id).copied()
    }

    /// What one peer last reported of another.
    #[must_use]
    pub fn belief(&self, observer: u16, subject: u16) -> Option<(u32, Status)> {
        self.beliefs.get(&(observer, subject)).copied()
    }

    /// A belief changed. `joined_since_ms` tells since when a path has joined the two.
    pub fn on_belief(
        &mut self,
        now_ms: u64,
        (observer, subject): (u16, u16),
        (incarnation, status): (u32, Status),
        (bounds, handicaps): (&Bounds, &Handicaps),
        joined_since_ms: Option<u64>,
    ) {
        self.beliefs
            .insert((observer, subject), (incarnation, status));
        if status != Status::Down {
            return;
        }
        if self.silences.contains_key(&subject) {
            self.detected.entry(subject).or_insert(now_ms);
            return;
        }
        let Some(&(life, began_ms)) = self.lives.get(&subject) else {
            return;
        };
        let bound_ms = bounds.detection_ms();
        let bound_ms = handicaps.grown_ms(bound_ms, now_ms.saturating_sub(bound_ms), now_ms);
        let heard_ms = began_ms + bounds.probation_ms() + bound_ms;
        let joined = joined_since_ms.is_some_and(|t| t + bound_ms <= now_ms);
        if life == incarnation && joined && heard_ms <= now_ms {
            self.false_downs.push((now_ms, observer, subject));
        }
    }

    /// Judges everybody's beliefs.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        for m in snapshot.peers {
            if m.view.speaks {
                self.speaks_since.entry(m.id).or_insert(snapshot.now_ms);
            } else {
                self.speaks_since.remove(&m.id);
            }
        }
        self.look_for_false_downs(snapshot, found);
        self.look_for_wrong_diameters(snapshot, found);
        self.look_for_late_detection(snapshot, found);
        self.look_for_disagreement(snapshot, found);
    }

    /// Nobody in reach is believed dead while it lives: without a loss, and at light loss where
    /// nobody was far away. (Elsewhere a batch of runs is judged by the rate.)
    fn look_for_false_downs(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let is_near = snapshot.stability.lasting_diameter() <= NEAR;
        let is_judged = match snapshot.grade() {
            Grade::Hard => true,
            Grade::Light => is_near,
            Grade::Heavy | Grade::Reported => false,
        };
        for (at_ms, by, of) in &self.false_downs[self.judged_downs..] {
            if is_judged {
                found.broken("false-down", *at_ms, Some(*by), || {
                    format!("holds peer {of} for down, which lives and is in reach")
                });
            }
        }
        self.judged_downs = self.false_downs.len();
    }

    /// Nobody reckons with a larger diameter than there was lately: bounds that peers keep
    /// would grow with it.
    fn look_for_wrong_diameters(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let most = true_diameter(snapshot);
        for m in snapshot.peers {
            if u64::from(m.view.diameter) <= most {
                self.misjudged.stop(m.id);
                continue;
            }
            let since_ms = self.misjudged.start(m.id, snapshot.now_ms);
            if snapshot.now_ms > since_ms && self.misjudged.tell_once(m.id) {
                found.broken("diameter", snapshot.now_ms, Some(m.id), || {
                    format!(
                        "reckons with a diameter of {}, it was at most {most}",
                        m.view.diameter
                    )
                });
            }
        }
    }

    /// Everybody who runs since before a death knows of it within the bound, at any loss:
    /// the rule on the age of a heartbeat needs no message.
    fn look_for_late_detection(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        for (&subject, silence) in &mut self.silences {
            silence.diameter = silence.diameter.max(true_diameter(snapshot));
            silence.interval_ms = silence.interval_ms.max(snapshot.bounds.interval_ms);
            let bounds = Bounds {
                diameter: silence.diameter,
                interval_ms: silence.interval_ms,
                ..snapshot.bounds
            };
            let bound_ms = snapshot.grown_ms(bounds.detection_ms(), silence.since_ms);
            let silent_ms = |id| snapshot.lived_ms(id, silence.since_ms);
            let knew = |m: &&PeerSnapshot| m.since_ms < silence.since_ms && m.id != subject;
            let overdue = |m: &&PeerSnapshot| silent_ms(m.id) > bound_ms;
            // What is believed of a life that another process took over is believed of that one.
            let twins = snapshot.peers.iter().filter(|p| p.id != subject);
            let twins = twins.filter(|p| p.speaks_as == subject);
            let goes_on = |life: u32| {
                let mut lives = twins.clone().filter_map(|p| self.lives.get(&p.id));
                lives.any(|(of, _)| *of == life)
            };
            for m in snapshot.peers.iter().filter(knew).filter(overdue) {
                let Some((life, status)) = self.beliefs.get(&(m.id, subject)) else {
                    continue;
                };
                let key = (m.id, subject);
                if *status == Status::Down || goes_on(*life) {
                    self.late.stop(key);
                    continue;
                }
                self.late.start(key, snapshot.now_ms);
                if self.late.tell_once(key) {
                    found.broken("detect", snapshot.now_ms, Some(m.id), || {
                        format!(
                            "still holds peer {subject} for {status:?}, {} ms after it fell silent (bound {bound_ms} ms, D = {})",
                            silent_ms(m.id),
                            silence.diameter
                        )
                    });
                }
            }
        }
    }

    /// L1: the members of a component believe each other alive, in their present lives.
    fn look_for_disagreement(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let bound_ms = snapshot.bounds.detection_ms();
        // Who stands still disagrees with nobody, however long it does.
        let is_there = |id: u16| snapshot.peer(id).is_some();
        self.disagreements
            .retain(|(m, x)| is_there(*m) && is_there(*x));
        for m in snapshot.peers {
            for x in snapshot.peers.iter().filter(|x| x.speaks_as != m.speaks_as) {
                let key = (m.id, x.id);
                let believed = m.view.peers.get(&skein_peer::PeerId(x.id));
                let is_right = believed.is_some_and(|(life, status)| {
                    *status != Status::Down && *life == self.life(x.id)
                });
                // Most are: only of the others it matters whether they count.
                let since_ms = if is_right {
                    None
                } else {
                    self.countable_since_ms(snapshot, m.id, x.id)
                };
                if since_ms.is_none() {
                    if let Some(t) = self.disagreements.stop(key) {
                        found.took("L1", snapshot.grade(), snapshot.now_ms - t, bound_ms);
                    }
                    continue;
                }
                let since_ms = since_ms
                    .unwrap_or(snapshot.now_ms)
                    .max(self.disagreements.start(key, snapshot.now_ms));
                let took_ms = snapshot.now_ms.saturating_sub(since_ms);
                if snapshot
                    .grade()
                    .limit_ms(snapshot.grown_ms(bound_ms, since_ms))
                    .is_some_and(|l| took_ms > l)
                    && self.disagreements.tell_once(key)
                {
                    found.broken("L1", snapshot.now_ms, Some(m.id), || {
                        let held = m.view.peers.get(&skein_peer::PeerId(x.id));
                        format!(
                            "holds {held:?} of peer {} (life {}) in its own component, for {took_ms} ms (bound {bound_ms} ms)",
                            x.id,
                            self.life(x.id)
                        )
                    });
                }
            }
        }
    }

    /// Since when two peers have been in one unchanged component, both speaking.
    fn countable_since_ms(&self, snapshot: &Snapshot<'_>, a: u16, b: u16) -> Option<u64> {
        if !snapshot.graph.joined(a, b) {
            return None;
        }
        let spoke_ms = (*self.speaks_since.get(&a)?).max(*self.speaks_since.get(&b)?);
        Some(snapshot.stability.component_since_ms(a)?.max(spoke_ms))
    }
}

/// The largest diameter that anybody may reckon with: a true one, and four hops more:
/// collisions and losses send heartbeats the longer way for a whole window now and then, and
/// beacons have room for some of the others only.
fn true_diameter(snapshot: &Snapshot<'_>) -> u64 {
    u64::from(snapshot.stability.lasting_diameter()) + 4
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::super::{Graph, Stability};
    use super::*;
    use crate::twins::Twins;
    use skein_peer::cells::CellSet;
    use skein_peer::{Beliefs, PeerId};

    /// A peer and what it believes of others.
    type Believes<'a> = (u16, &'a [(u16, u32, Status)]);

    const BOUNDS: Bounds = Bounds {
        period_ms: 1000,
        interval_ms: 1000,
        diameter: 1,
    };

    fn look_at(
        m: &mut Membership,
        found: &mut Findings,
        now_ms: u64,
        loss_permille: u16,
        views: &[Believes<'_>],
        stability: &mut Stability,
    ) {
        let peers: Vec<PeerSnapshot> = views
            .iter()
            .map(|(id, believes)| PeerSnapshot {
                id: *id,
                speaks_as: *id,
                uav: true,
                since_ms: 0,
                at: None,
                fuel_ms: None,
                eta_ms: 0,
                view: Beliefs {
                    speaks: true,
                    peers: believes
                        .iter()
                        .map(|(p, i, s)| (PeerId(*p), (*i, *s)))
                        .collect(),
                    ..Beliefs::default()
                },
            })
            .collect();
        let graph = Graph::new(peers.iter().map(|m| m.id).collect(), |_, _| true);
        stability.observe(now_ms, &graph, |_| 1, 10_000);
        let snapshot = Snapshot {
            now_ms,
            loss_permille,
            bounds: BOUNDS,
            graph: &graph,
            stability,
            handicaps: &Handicaps::default(),
            peers: &peers,
            covered: &CellSet::default(),
            loop_hash: 0,
        };
        m.on_snapshot(&snapshot, found);
    }

    /// Peers 1 and 2 in their first lives, and nothing found.
    fn two() -> (Membership, Findings, Stability) {
        let mut m = Membership::default();
        m.on_life(0, 1, 1);
        m.on_life(0, 2, 1);
        (m, Findings::new(1), Stability::default())
    }

    #[test]
    fn a_death_found_in_time_is_no_violation_and_one_missed_is() {
        for found_out in [true, false] {
            let (mut m, mut found, mut s) = two();
            m.on_belief(
                3000,
                (1, 2),
                (1, Status::Alive),
                (&BOUNDS, &Handicaps::default()),
                Some(0),
            );
            m.on_silent(50_000, 2, true, &BOUNDS);
            if found_out {
                m.on_belief(
                    59_000,
                    (1, 2),
                    (1, Status::Down),
                    (&BOUNDS, &Handicaps::default()),
                    None,
                );
                assert_eq!(m.detected_ms(2), Some(59_000));
            }
            look_at(&mut m, &mut found, 69_000, 300, &[(1, &[])], &mut s);
            assert!(found.counts.is_empty());
            look_at(&mut m, &mut found, 70_000, 300, &[(1, &[])], &mut s);
            look_at(&mut m, &mut found, 71_000, 300, &[(1, &[])], &mut s);
            assert_eq!(
                found.counts.get("detect").copied().unwrap_or(0),
                u64::from(!found_out)
            );
        }
    }

    /// A process under the number of one that died goes on with its life, and is heard for it.
    #[test]
    fn a_death_is_not_missed_by_who_hears_another_process_in_that_life() {
        for (twins_life, broken) in [(1, 0), (2, 1)] {
            let (mut m, mut found, _) = two();
            m.on_life(0, 9, twins_life);
            let belief = (1, Status::Alive);
            let judge = (&BOUNDS, &Handicaps::default());
            m.on_belief(3_000, (1, 2), belief, judge, Some(0));
            m.on_silent(50_000, 2, true, &BOUNDS);
            let mut story = Story::new(300);
            story.twins = Twins::from_iter([(9, 2)]);
            let views = [(1, speaking()), (9, speaking())];
            for at_ms in [70_000, 71_000] {
                story.snapshot(at_ms, &views, |s| m.on_snapshot(s, &mut found));
            }
            let missed = found.counts.get("detect").copied().unwrap_or(0);
            assert_eq!(missed, broken, "a twin in life {twins_life}");
        }
    }

    #[test]
    fn a_living_peer_in_reach_declared_down_is_a_false_down() {
        let mut m = Membership::default();
        m.on_life(0, 1, 1);
        m.on_life(0, 2, 1);
        m.on_belief(
            60_000,
            (1, 2),
            (1, Status::Down),
            (&BOUNDS, &Handicaps::default()),
            Some(55_000),
        );
        assert!(m.false_downs.is_empty());
        m.on_belief(
            60_000,
            (1, 2),
            (1, Status::Down),
            (&BOUNDS, &Handicaps::default()),
            Some(10_000),
        );
        assert_eq!(m.false_downs, [(60_000, 1, 2)]);
    }

    #[test]
    fn a_false_down_is_a_violation_where_little_is_lost_and_nobody_is_far() {
        for (loss, broken) in [(0, true), (100, true), (101, false), (300, false)] {
            let (mut m, mut found) = (Membership::default(), Findings::new(1));
            m.on_life(0, 2, 1);
            m.on_belief(
                60_000,
                (1, 2),
                (1, Status::Down),
                (&BOUNDS, &Handicaps::default()),
                Some(10_000),
            );
            let mut s = Stability::default();
            look_at(&mut m, &mut found, 61_000, loss, &[(1, &[])], &mut s);
            look_at(&mut m, &mut found, 62_000, loss, &[(1, &[])], &mut s);
            let counted = found.counts.get("false-down").copied().unwrap_or(0);
            assert_eq!(counted, u64::from(broken), "loss {loss}");
        }
    }

    #[test]
    fn a_peer_that_reckons_with_too_large_a_diameter_is_found() {
        for (diameter, loss, broken) in [
            (5, 0, false),
            (5, 300, false),
            (6, 0, true),
            (16, 300, true),
        ] {
            let (mut m, mut found) = (Membership::default(), Findings::new(1));
            let view = Beliefs {
                diameter,
                ..speaking()
            };
            let mut story = Story::new(loss);
            let views = [(1, view.clone()), (2, view)];
            for t in 1..3 {
                story.snapshot(t * 1000, &views, |s| m.on_snapshot(s, &mut found));
            }
            assert_eq!(
                found.counts.contains_key("diameter"),
                broken,
                "{diameter} {loss}"
            );
        }
    }

    #[test]
    fn disagreement_longer_than_the_bound_breaks_l1_only_without_loss() {
        for (loss, broken) in [(0, true), (50, false), (300, false)] {
            let (mut m, mut found, mut s) = two();
            let views: [Believes<'_>; 2] =
                [(1, &[(2, 1, Status::Down)]), (2, &[(1, 1, Status::Alive)])];
            for t in 0..20 {
                look_at(&mut m, &mut found, t * 1000, loss, &views, &mut s);
            }
            assert_eq!(found.counts.contains_key("L1"), broken, "loss {loss}");
        }
    }

    /// It disagreed before, and as soon as it goes on it agrees: in between nobody disagrees.
    #[test]
    fn who_stands_still_meanwhile_does_not_disagree_all_the_while() {
        let (mut m, mut found, mut s) = two();
        let down: [Believes<'_>; 2] = [(1, &[(2, 1, Status::Down)]), (2, &[(1, 1, Status::Alive)])];
        let alone: [Believes<'_>; 1] = [(1, &[(2, 1, Status::Down)])];
        let alive: [Believes<'_>; 2] =
            [(1, &[(2, 1, Status::Alive)]), (2, &[(1, 1, Status::Alive)])];
        for t in 0..90 {
            let views: &[Believes<'_>] = match t {
                0..4 => &down,
                4..60 => &alone,
                60..62 => &down,
                _ => &alive,
            };
            look_at(&mut m, &mut found, t * 1000, 50, views, &mut s);
        }
        let longest = found.ratios["L1"].iter().copied().fold(0.0, f64::max);
        assert!(longest > 0.0 && longest < 0.5, "{longest}");
    }
}
