//! Relay positions: who says that it holds one is where it was asked to be (`relay-place`), who
//! gave up its section for one gets there (`relay-way`); and for how long somebody was there.

use super::flight::{FlightCheck, Flyer};
use super::{Clocks, Findings, PeerSnapshot, Snapshot};
use skein_geometry::frame::Point;
use skein_peer::input::AskedTask;
use skein_peer::mission::point_m;
use skein_peer::wire::message::Order;
use skein_peer::wire::tasks::{Progress, TaskId, TaskKind};
use std::collections::{BTreeMap, BTreeSet};

/// For so long a holder may be away: its process stood still meanwhile, or a zone came and it
/// flies to another circle, milliseconds.
const AWAY_MS: u64 = 30_000;

/// From when a UAV is given a position to when it flies there: it ends its cell, and the circle
/// is planned, milliseconds. It may be given another one on its way, or its circle be moved.
const SET_OUT_MS: u64 = 60_000;

/// Places are told in whole millimetres, metres.
const ROUNDING_M: f64 = 0.01;

/// A relay position: where, and how far from there a holder may be, metres.
#[derive(Clone, Copy, Debug)]
struct Position {
    at: Point,
    within_m: f64,
}

/// What came of relay positions in one run.
#[derive(Clone, Debug, Default)]
pub struct RelayCheck {
    asked: BTreeMap<(u16, u32), Position>,
    away: Clocks<(u16, TaskId, u32)>,
    /// Who is under way to one, until when at most, milliseconds, and whether that was told.
    under_way: BTreeMap<u16, (u64, u64, bool)>,
    /// For how long each was held, as the world knows, milliseconds, by number and revision.
    pub held_ms: BTreeMap<(u16, u32), u64>,
}

impl RelayCheck {
    /// The ground station holds a task of its operator.
    pub fn on_asked(&mut self, asked: &AskedTask) {
        let task = &asked.task;
        // A target to follow is no place: it has a rule of its own.
        let is_relay = task.is_held() && task.kind == TaskKind::Relay;
        if let (true, Some(place)) = (is_relay, task.places.first()) {
            let at = point_m((place.east_mm, place.north_mm));
            let within_m = f64::from(task.radius_mm) / 1000.0;
            let key = (asked.number, task.revision_as_asked());
            self.asked.entry(key).or_insert(Position { at, within_m });
        }
    }

    /// Looks at all who hold one.
    pub fn on_snapshot(
        &mut self,
        snapshot: &Snapshot<'_>,
        flyers: (&BTreeMap<u16, Flyer>, &FlightCheck),
        found: &mut Findings,
    ) {
        let mut seen = BTreeSet::new();
        let mut held = BTreeSet::new();
        for m in snapshot.peers.iter().filter(|m| m.uav && m.view.speaks) {
            let Some(at) = m.at else { continue };
            self.check_way(snapshot, (m, at), flyers, found);
            for (id, revision, progress) in &m.view.tasks {
                // What UAVs ask for has numbers of its own.
                let is_seen = m.view.detections.iter().any(|(d, _)| d == id);
                let holds = matches!(progress, Progress::Begun | Progress::Leaving) && !is_seen;
                let asked = self.asked.get(&(id.number, *revision));
                let Some(position) = asked.filter(|_| holds) else {
                    continue;
                };
                let away_m = (at - position.at).norm();
                if away_m <= position.within_m + ROUNDING_M {
                    held.insert((id.number, *revision));
                    continue;
                }
                // Who asked to be relieved may have been unable to stay.
                if *progress == Progress::Leaving {
                    continue;
                }
                let key = (m.id, *id, *revision);
                seen.insert(key);
                let since_ms = self.away.start(key, snapshot.now_ms).max(m.since_ms);
                let took_ms = snapshot.now_ms.saturating_sub(since_ms);
                let bound_ms = snapshot.grown_ms(AWAY_MS, since_ms);
                if took_ms > bound_ms && self.away.tell_once(key) {
                    let within_m = position.within_m;
                    found.broken("relay-place", snapshot.now_ms, Some(m.id), || {
                        format!(
                            "says that it holds the relay position {}.{} and is {away_m:.0} m from it (at most {within_m:.0} m), for {took_ms} ms (bound {bound_ms} ms)",
                            id.author, id.number
                        )
                    });
                }
            }
        }
        self.away.retain(|k| seen.contains(k));
        for key in held {
            *self.held_ms.entry(key).or_default() += snapshot.bounds.period_ms;
        }
    }

    /// Who covers nothing since it is to hold a position gets to one.
    fn check_way(
        &mut self,
        snapshot: &Snapshot<'_>,
        (m, at): (&PeerSnapshot, Point),
        (flyers, flight): (&BTreeMap<u16, Flyer>, &FlightCheck),
        found: &mut Findings,
    ) {
        let now_ms = snapshot.now_ms;
        let is_there =
            |progress: &Progress| matches!(progress, Progress::Begun | Progress::Leaving);
        let positions = || {
            let claimed = m.view.tasks.iter();
            let claimed = claimed.filter(|t| t.2 == Progress::Committed);
            claimed.filter_map(|(id, revision, _)| self.asked.get(&(id.number, *revision)))
        };
        let holds = m.view.tasks.iter().any(|(id, revision, progress)| {
            is_there(progress) && self.asked.contains_key(&(id.number, *revision))
        });
        // Who follows a target gave its section up too.
        let is_sent = m.view.relays && positions().next().is_some();
        if !is_sent || holds || m.view.order != Order::Resume {
            self.under_way.remove(&m.id);
            return;
        }
        let longest_ms = || {
            let flyer = flyers.get(&m.id)?;
            let each = positions().map(|p| flight.longest_home_ms(at, p.at, *flyer));
            each.max()
        };
        let begun = (now_ms, SET_OUT_MS + longest_ms().unwrap_or(0), false);
        let (since_ms, bound_ms, told) = self.under_way.entry(m.id).or_insert(begun);
        let since_ms = (*since_ms).max(m.since_ms);
        let took_ms = now_ms.saturating_sub(since_ms);
        let bound_ms = snapshot.grown_ms(*bound_ms, since_ms);
        if took_ms > bound_ms && !*told {
            *told = true;
            found.broken("relay-way", now_ms, Some(m.id), || {
                format!("is to hold a relay position and has been on its way for {took_ms} ms (bound {bound_ms} ms)")
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use skein_peer::Beliefs;
    use skein_peer::wire::tasks::{Task, TaskPlace};

    const TASK: TaskId = TaskId {
        author: 100,
        number: 3,
    };

    fn asked() -> RelayCheck {
        let mut check = RelayCheck::default();
        check.on_asked(&AskedTask {
            number: 3,
            task: Task {
                revision: 1,
                kind: TaskKind::Relay,
                places: vec![TaskPlace {
                    east_mm: 50_000,
                    north_mm: 0,
                }],
                radius_mm: 100_000,
                ..Task::default()
            },
            age_ms: 0,
        });
        check
    }

    fn flyers() -> BTreeMap<u16, Flyer> {
        let flyer = Flyer {
            turn_radius_m: 30.0,
            fastest_mps: 15.0,
            waits_within_m: 150.0,
            slowest_mps: 12.0,
        };
        BTreeMap::from([(1, flyer)])
    }

    fn flight() -> FlightCheck {
        FlightCheck::new(flyers(), Vec::new(), 10.0)
    }

    /// What is broken when peer 1 says this for so long, so far from the place.
    fn after(seconds: u64, progress: Progress, away_m: f64) -> (bool, u64) {
        let (mut story, mut found) = (Story::new(300), Findings::new(1));
        let mut check = asked();
        story.place(1, Point::new(50.0, away_m));
        let view = Beliefs {
            tasks: vec![(TASK, 1, progress)],
            ..speaking()
        };
        for t in 0..seconds {
            story.snapshot(t * 1000, &[(1, view.clone())], |s| {
                check.on_snapshot(s, (&flyers(), &flight()), &mut found);
            });
        }
        let held_ms = check.held_ms.values().sum();
        (found.counts.contains_key("relay-place"), held_ms)
    }

    /// Whether a rule is broken by who is on its way for so long, ordered this.
    fn is_late(seconds: u64, progress: Progress, order: Order) -> bool {
        let (mut story, mut found) = (Story::new(300), Findings::new(1));
        let mut check = asked();
        story.place(1, Point::new(50.0, 300.0));
        let view = Beliefs {
            tasks: vec![(TASK, 1, progress)],
            relays: true,
            order,
            ..speaking()
        };
        for t in 0..seconds {
            story.snapshot(t * 1000, &[(1, view.clone())], |s| {
                check.on_snapshot(s, (&flyers(), &flight()), &mut found);
            });
        }
        found.counts.contains_key("relay-way")
    }

    #[test]
    fn who_never_gets_to_its_position_is_found() {
        assert!(is_late(300, Progress::Committed, Order::Resume));
        assert!(!is_late(60, Progress::Committed, Order::Resume));
        assert!(!is_late(300, Progress::Leaving, Order::Resume));
        assert!(!is_late(300, Progress::Committed, Order::Hold));
    }

    #[test]
    fn who_says_that_it_holds_a_position_and_is_elsewhere_is_found() {
        assert_eq!(after(60, Progress::Begun, 120.0), (true, 0));
        assert_eq!(after(25, Progress::Begun, 120.0), (false, 0));
        assert_eq!(after(60, Progress::Begun, 99.0), (false, 60_000));
        assert_eq!(after(60, Progress::Leaving, 99.0), (false, 60_000));
        for under_way in [Progress::Tentative, Progress::Committed, Progress::Leaving] {
            assert_eq!(after(60, under_way, 120.0), (false, 0));
        }
    }
}
