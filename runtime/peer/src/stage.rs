//! Where in the diagram of its mission a peer is (D2.7 §1.2.3): the events that hold now lead to
//! a state, and the state says what becomes of its work and by which goal it flies. The diagram
//! is [`crate::diagram`]'s.
//!
//! | event | holds while |
//! |---|---|
//! | operator_hold, operator_return | that is the standing order to it |
//! | mission_cancelled | the operator ended the mission |
//! | mission_complete | all is seen, and no task is open that somebody can do; none at all where a timer ends the mission |
//! | low_fuel | its fuel is due (`fuel.rs`) |
//! | twin_speaks | another process has silenced it |
//! | timer | it follows this sortie for so long in this life, or of a timer that ends the mission: another peer of it said finished |
//! | stayed | it is in this state for so long |
//! | peer_lost | it believes a peer to be down |
//! | peer_back | a peer that it believed to be down since it came to this state is there again |
//! | wind_above | it takes the wind for stronger; once it came to a state by that, until it is 1 m/s below |
//! | plan_infeasible | cells are beyond everybody's fuel |
//! | object_detected | something that its mission looks for was told in this sortie, and not withdrawn |
//! | crowd_dense | a sector of the event that its mission watches was told to be too dense, and not to have eased |
//! | target_lost | it had its target in sight, lost it, and said that it searches |
//! | target_given | it holds a target to follow, and where that may be is near |
//! | relay_given | it holds a relay position whose circle is planned |
//! | task_given | it holds a task whose flight is planned |
//! | cells_given | its plan has cells |
//! | all_seen | everything is seen, whatever tasks are open |
//! | nobody_heard | it knew many, and hears nobody, or has heard of nobody with cells to fly for 20 T' and has none itself |
//! | otherwise | always |

use crate::diagram::{Machine, MissionEvent, Part, State, StateGoal};
use crate::input::Time;
use crate::mission::Mission;
use crate::mission_state::MissionState;
use crate::protocol::runs::legs_of;
use crate::wire::message::Order;
use crate::wire::tasks::{ERRANDS, RELAYS, TRACKS};
use skein_behaviors::Goal;
use std::sync::Arc;

/// A wind for which a UAV came to a state has to be so much weaker before it does not hold any
/// more, m/s.
pub const WIND_CALMER_MPS: f64 = 1.0;

/// In which state a peer is, and since when.
#[derive(Clone, Debug)]
pub(crate) struct Stage {
    machine: Arc<Machine>,
    at: usize,
    by: MissionEvent,
    /// When it came there; none before it looked.
    since: Option<Time>,
    /// When it began this sortie; none before it looked.
    began: Option<Time>,
    /// The most peers that it believed to be down in this state.
    most_lost: usize,
    /// Whether a state was reached that ends the mission.
    ended: bool,
    /// Whether somebody said that the time of this mission is over.
    told_over: bool,
}

impl Stage {
    /// The first state of a mission; or the present one, where the mission before was the same
    /// sortie by the same diagram, as laps are.
    ///
    /// # Panics
    /// Where the diagram cannot be flown: then the mission has no geometry.
    pub fn begun(mission: &Mission, old: Option<(&Mission, &Self)>) -> Self {
        let same =
            old.filter(|(m, _)| (m.sortie, &m.diagram) == (mission.sortie, &mission.diagram));
        if let Some((before, stage)) = same {
            let is_edited = mission.edit() != before.edit();
            return Self {
                // What was said of a patrol before it was changed says nothing of it now.
                told_over: stage.told_over && !is_edited,
                ended: stage.ended && !is_edited,
                ..stage.clone()
            };
        }
        let machine = mission.machine();
        let machine = machine.expect("a mission whose diagram cannot be flown has no geometry");
        let sortie = old.filter(|(m, _)| m.sortie == mission.sortie);
        Self {
            at: machine.start(),
            machine: Arc::new(machine),
            by: MissionEvent::Otherwise,
            since: None,
            began: sortie.and_then(|(_, stage)| stage.began),
            most_lost: 0,
            ended: false,
            told_over: false,
        }
    }

    pub fn state(&self) -> &State {
        self.machine.state(self.at)
    }

    /// The number of its state.
    pub fn at(&self) -> usize {
        self.at
    }

    /// The event that led to it.
    pub fn by(&self) -> MissionEvent {
        self.by
    }

    /// For how long it has been in it, milliseconds.
    pub fn state_ms(&self, now: Time) -> u64 {
        self.since.map_or(0, |t| now.since_ms(t))
    }

    /// Whether it takes part in planning, as far as its state says.
    pub fn takes_part(&self) -> bool {
        self.state().part == Part::Takes && !self.ended
    }

    /// Whether its plan is let go.
    pub fn lets_go(&self) -> bool {
        self.state().part.lets_go() || self.ended
    }

    /// Whether a state was reached that ends the mission.
    pub fn ended(&self) -> bool {
        self.ended
    }

    /// Whether a peer is there again that it believed to be down in this state, where so many are
    /// believed to be now.
    pub fn missed(&self, lost: usize) -> bool {
        lost < self.most_lost
    }

    /// Whether what is seen does not end the mission.
    pub fn goes_on(&self) -> bool {
        self.machine.goes_on()
    }

    /// Somebody who follows this mission says that it is finished: where its time ends it, that
    /// is over for all.
    pub fn hear_finished(&mut self) {
        self.told_over |= self.ends_by_time();
    }

    /// Whether a timer ends the mission.
    pub fn ends_by_time(&self) -> bool {
        self.machine.ends_after_s().is_some()
    }
}

/// Whether so many seconds have gone by since then.
fn is_past(since: Option<Time>, after_s: u32, now: Time) -> bool {
    since.is_some_and(|t| now.since_ms(t) >= 1000 * u64::from(after_s))
}

impl MissionState {
    /// Looks at the events that hold: one transition at most is taken.
    pub fn look(&mut self, now: Time, order: Order) {
        self.stage.began.get_or_insert(now);
        self.stage.since.get_or_insert(now);
        self.stage.most_lost = self.stage.most_lost.max(self.lost);
        let holds = |on, amount| self.holds(on, amount, order, now);
        let Some((to, by)) = self.stage.machine.look(self.stage.at, &holds) else {
            return;
        };
        let stage = &mut self.stage;
        if stage.at != to {
            stage.since = Some(now);
            stage.most_lost = self.lost;
        }
        (stage.at, stage.by) = (to, by);
        stage.ended |= stage.state().part == Part::Ends;
    }

    /// How its mission, as it stands, would fly tasks if they were given to it: a bit for each
    /// way, as [`crate::wire::tasks::Offer::takes`] has them. What the operator orders meanwhile
    /// does not count.
    pub fn takes(&self, now: Time) -> u8 {
        use MissionEvent::{MissionComplete, RelayGiven, TargetGiven, TargetLost, TaskGiven};
        let machine = &self.stage.machine;
        let leads_to = |event, goal| {
            let holds = |on, amount| match on {
                // A task that is open leaves no mission complete.
                TaskGiven | RelayGiven | TargetGiven | TargetLost | MissionComplete => on == event,
                _ => self.holds(on, amount, Order::Resume, now),
            };
            let to = machine.look(self.stage.at, &holds);
            machine.state(to.map_or(self.stage.at, |(to, _)| to)).goal == goal
        };
        let ways = [
            (ERRANDS, TaskGiven, StateGoal::Task),
            (RELAYS, RelayGiven, StateGoal::Relay),
            (TRACKS, TargetGiven, StateGoal::Follow),
        ];
        let led = ways
            .iter()
            .filter(|(_, event, goal)| leads_to(*event, *goal));
        led.map(|(bit, _, _)| bit).sum()
    }

    fn holds(&self, on: MissionEvent, amount: u32, order: Order, now: Time) -> bool {
        let stage = &self.stage;
        match on {
            MissionEvent::OperatorHold => order == Order::Hold,
            MissionEvent::OperatorReturn => order == Order::ReturnToBase,
            MissionEvent::MissionCancelled => self.geometry.mission.cancelled,
            MissionEvent::MissionComplete => self.complete,
            MissionEvent::LowFuel => self.fuel.is_due(),
            MissionEvent::TwinSpeaks => self.silent,
            MissionEvent::Timer => {
                let ends_after_s = stage.machine.ends_after_s();
                let told = stage.told_over && ends_after_s >= Some(amount);
                told || is_past(stage.began, amount, now)
            }
            MissionEvent::Stayed => is_past(stage.since, amount, now),
            MissionEvent::PeerLost => self.lost > 0,
            MissionEvent::PeerBack => stage.missed(self.lost),
            MissionEvent::WindAbove => {
                // What it came for holds on, or it would go to and fro by every gust.
                let calmer_mps = if stage.by == on { WIND_CALMER_MPS } else { 0.0 };
                self.wind_mps + calmer_mps > f64::from(amount) / 10.0
            }
            MissionEvent::PlanInfeasible => self.cannot_fly_all(),
            MissionEvent::ObjectDetected => self.detected,
            MissionEvent::CrowdDense => self.too_dense,
            MissionEvent::TargetLost => self.target_lost && self.followed_at_m().is_some(),
            MissionEvent::TargetGiven => self.followed_at_m().is_some(),
            MissionEvent::RelayGiven => self.relay_circle().is_some(),
            MissionEvent::TaskGiven => self.errand.is_some(),
            MissionEvent::CellsGiven => !self.negotiation.sections.plan().is_empty(),
            MissionEvent::AllSeen => self.negotiation.sections.complete(),
            // Where the ground station is and whoever is finished, somebody is heard.
            MissionEvent::NobodyHeard => self.astray,
            MissionEvent::Otherwise => true,
        }
    }

    /// Whether something of its mission can be flown by nobody.
    pub fn cannot_fly_all(&self) -> bool {
        !self.negotiation.sections.unassigned().is_empty()
    }

    /// Whether it waits for the first division, in which it takes part.
    pub fn expects_cells(&self) -> bool {
        let state = self.stage.state();
        let takes_part = (state.goal, state.part) == (StateGoal::Hold, Part::Takes);
        takes_part && self.negotiation.is_undivided()
    }

    /// Where the peer flies in its state.
    pub fn goal_of_state(&self) -> Goal {
        let sections = &self.negotiation.sections;
        let legs = || legs_of(sections.plan(), sections.cells());
        match self.stage.state().goal {
            StateGoal::Hold => Goal::Hold,
            StateGoal::Section => Goal::Legs(legs()),
            StateGoal::Round => Goal::Round,
            StateGoal::Trace => Goal::Trace,
            StateGoal::Follow => self.followed_at_m().map_or(Goal::Hold, Goal::Follow),
            StateGoal::Relay => self.relay_circle().map_or(Goal::Hold, Goal::Circle),
            StateGoal::Task => match &self.errand {
                Some(flight) => Goal::Detour(flight.clone(), legs()),
                None => Goal::Legs(legs()),
            },
            StateGoal::Home => match self.listening.circle() {
                Some(circle) => Goal::Circle(circle),
                None => Goal::Point(self.geometry.mission.base_m()),
            },
        }
    }
}
