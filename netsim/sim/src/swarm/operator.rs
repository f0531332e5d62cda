//! The operator of a simulated swarm: the mission and the order given last, and the tasks
//! that are asked for.

use skein_behaviors::{Order, Orders};
use skein_peer::input::{AskedTask, OperatorsTasks, TaskEdit};
use skein_peer::mission_edit::is_found;
use skein_peer::{Incarnation, Mission};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// So long it takes to carry an order to where no radio brings it, milliseconds.
const COURIER_MS: u64 = 60_000;

/// In which life a ground station speaks, and the how-manieth run of its process that is: without
/// its disk, and where nobody remembers it, it counts its lives anew.
pub(super) type Voice = (u32, Incarnation);

/// What the operator wants, and what the ground station said of it.
#[derive(Debug)]
pub(super) struct Operator {
    mission: Arc<Mission>,
    /// Missions that peers made of it by what they found, by their contents.
    found: BTreeMap<u64, Arc<Mission>>,
    /// The standing orders, and in which life the ground station spoke them.
    orders: Option<(Orders, Option<Voice>)>,
    /// The record in which it spoke last.
    spoken: Vec<u8>,
    /// What was not said of tasks yet.
    edits: VecDeque<TaskEdit>,
    /// What was said of tasks as the ground station held it last, when that was, milliseconds,
    /// and in which life it was told of it.
    tasks: OperatorsTasks,
    tasks_at_ms: u64,
    tasks_in: Option<Voice>,
    /// Since when somebody waits who cannot be told to go on, milliseconds.
    stranded_ms: Option<u64>,
}

impl Operator {
    pub(super) fn new(mission: Arc<Mission>) -> Self {
        Self {
            mission,
            found: BTreeMap::new(),
            orders: None,
            spoken: Vec::new(),
            edits: VecDeque::new(),
            tasks: OperatorsTasks::default(),
            tasks_at_ms: 0,
            tasks_in: None,
            stranded_ms: None,
        }
    }

    /// The newest mission.
    pub(super) fn mission(&self) -> &Arc<Mission> {
        &self.mission
    }

    /// What a mission would be as the next revision, a patrol in the lap that the ground station
    /// holds: that with this revision.
    pub(super) fn next(&self, mission: Mission, held: Option<u32>) -> Arc<Mission> {
        let revision = self.mission.revision_after(self.mission.revision);
        let flown = held.and_then(|held| self.mission.later_lap(held));
        let of_laps = flown.as_ref().unwrap_or(&mission);
        let (lap, further_laps) = (of_laps.lap, of_laps.further_laps);
        Arc::new(Mission {
            revision,
            lap,
            further_laps,
            ..mission
        })
    }

    /// A peer follows this one, by what was found; whether it is news, and no mere lap.
    pub(super) fn hears_of(&mut self, found: &Arc<Mission>) -> bool {
        let is_lap = self.mission.later_lap(found.revision).as_ref() == Some(&**found);
        let known = self.found.insert(found.content_hash(), Arc::clone(found));
        !is_lap && known.is_none()
    }

    /// Others with the number of the newest, which somebody else found at the same time.
    pub(super) fn found_beside(&self) -> impl Iterator<Item = &Arc<Mission>> {
        let newest = self.mission.revision;
        self.found.values().filter(move |m| m.revision == newest)
    }

    /// The newest mission with zones round all that any peer has found; none where it has them.
    pub(super) fn round_all_found(&self) -> Option<Mission> {
        let mut round = (*self.mission).clone();
        for (name, ring) in self.found.values().flat_map(|m| &m.added_zones) {
            if is_found(name) && !round.dismissed.contains(name) {
                round.added_zones.insert(name.clone(), ring.clone());
            }
        }
        (round.added_zones != self.mission.added_zones).then_some(round)
    }

    /// Gives the next revision.
    pub(super) fn give(&mut self, next: Arc<Mission>) {
        self.mission = next;
    }

    /// Gives an order to one UAV, or to all. One that no record has room for is not given.
    pub(super) fn order(&mut self, uav: Option<u16>, order: Order) {
        let standing = self.orders.as_ref().map(|(orders, _)| orders.clone());
        if let Some(next) = standing.unwrap_or_default().told(uav, order) {
            self.orders = Some((next, None));
        }
    }

    /// Whether a UAV is to go on, as far as it is up to the operator.
    pub(super) fn wants_to_fly(&self, uav: u16) -> bool {
        let orders = self.orders.as_ref();
        orders.is_none_or(|(orders, _)| orders.of(uav) == Order::Resume)
    }

    /// Something about tasks is to be said.
    pub(super) fn wants(&mut self, edit: TaskEdit) {
        self.edits.push_back(edit);
    }

    /// What the ground station is to be told of tasks in the life in which it speaks: those of
    /// an earlier one once, and what is new.
    pub(super) fn task_edits(&mut self, now_ms: u64, voice: Option<Voice>) -> Vec<TaskEdit> {
        if voice.is_none() {
            return Vec::new();
        }
        let anew = self.tasks_in != voice && !self.tasks.is_empty();
        self.tasks_in = voice;
        let again = anew.then(|| {
            let older = |t: &AskedTask| AskedTask {
                age_ms: t.age_ms + now_ms.saturating_sub(self.tasks_at_ms),
                ..t.clone()
            };
            TaskEdit::Again(OperatorsTasks {
                asked: self.tasks.asked.iter().map(older).collect(),
                done: self.tasks.done.clone(),
            })
        });
        again.into_iter().chain(self.edits.drain(..)).collect()
    }

    /// The tasks as the ground station holds them now.
    pub(super) fn note_tasks(&mut self, now_ms: u64, tasks: OperatorsTasks) {
        if !tasks.is_empty() {
            (self.tasks, self.tasks_at_ms) = (tasks, now_ms);
        }
    }

    /// The tasks as the ground station held them last.
    pub(super) fn tasks(&self) -> &[AskedTask] {
        &self.tasks.asked
    }

    /// The orders that the ground station is to say in the life in which it speaks, once.
    pub(super) fn speaks(&mut self, voice: Option<Voice>) -> Option<Orders> {
        let (orders, said_in) = self.orders.as_mut()?;
        let news = voice.is_some() && *said_in != voice;
        news.then(|| {
            *said_in = voice;
            orders.clone()
        })
    }

    /// The ground station spoke in a record of these bytes.
    pub(super) fn was_spoken(&mut self, bytes: &[u8]) {
        self.spoken = bytes.to_vec();
    }

    /// The record to hand to whoever waits out of reach for an order that was spoken, once a
    /// courier has had time to go there.
    pub(super) fn courier(&mut self, now_ms: u64, is_stranded: bool) -> Option<Vec<u8>> {
        let is_said = matches!(self.orders, Some((_, Some(_))));
        if !is_stranded || !is_said {
            self.stranded_ms = None;
            return None;
        }
        let since_ms = *self.stranded_ms.get_or_insert(now_ms);
        (now_ms >= since_ms + COURIER_MS).then(|| {
            self.stranded_ms = None;
            self.spoken.clone()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::fixture;

    #[test]
    fn an_order_is_said_once_in_each_life_and_carried_to_who_waits_out_of_reach_for_a_minute() {
        let mut operator = Operator::new(fixture::square(1).mission);
        assert_eq!(operator.speaks(Some((1, 1))), None);
        operator.order(None, Order::Hold);
        assert_eq!(operator.speaks(None), None);
        assert_eq!(operator.speaks(Some((1, 1))), Some(Order::Hold.into()));
        assert_eq!(operator.speaks(Some((1, 1))), None);
        assert_eq!(operator.speaks(Some((1, 2))), Some(Order::Hold.into()));
        // Without its disk it is in that life once more.
        assert_eq!(operator.speaks(Some((2, 2))), Some(Order::Hold.into()));
        operator.was_spoken(&[7]);
        assert_eq!(operator.courier(0, false), None);
        assert_eq!(operator.courier(COURIER_MS, false), None, "nobody goes on");
        operator.order(Some(2), Order::Resume);
        assert!(operator.wants_to_fly(2) && !operator.wants_to_fly(1));
        operator.order(None, Order::Resume);
        assert_eq!(operator.courier(COURIER_MS, true), None, "nobody said it");
        operator.speaks(Some((2, 2)));
        assert_eq!(operator.courier(10, true), None);
        assert_eq!(operator.courier(20, false), None);
        assert_eq!(operator.courier(30, true), None);
        assert_eq!(operator.courier(COURIER_MS + 29, true), None);
        assert_eq!(operator.courier(COURIER_MS + 30, true), Some(vec![7]));
    }
}
