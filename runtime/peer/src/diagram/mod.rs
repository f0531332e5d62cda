//! Missions as transition diagrams (D2.7 §1.2.2, §1.2.3): states, each with a behaviour and the
//! goal that it stands for, and transitions by named events. A peer obeys the diagram of its
//! mission, and a picture is drawn from the same data. Which events hold now is the
//! cooperation manager's; whether a diagram may be flown is [`check`]'s.
//!
//! | the diagram | a look at the events that hold |
//! |---|---|
//! | a transition from this state or from any, its event holds, and none of those before it by priority does | its state; the same state where it leads there |
//! | none of them holds | nothing changes |
//!
//! # Guarantees
//! A look takes one transition at most, and equal events give equal states. In a diagram that
//! was checked, fuel that is due and an operator who says return lead home from each state, by
//! one look.
//!
//! # Example
//! ```
//! use skein_peer::diagram::{Diagram, Machine, MissionEvent};
//!
//! let machine = Machine::new(&Diagram::coverage()).unwrap();
//! let (at, by) = machine.look(machine.start(), &|on, _| on == MissionEvent::LowFuel).unwrap();
//! assert_eq!((machine.state(at).name.as_str(), by), ("home", MissionEvent::LowFuel));
//! ```

pub mod check;
mod coverage;

pub use check::DiagramError;

use crate::mission::is_default;
use serde::{Deserialize, Serialize};
use skein_geometry::hash::Fnv;

/// Most states of a diagram: a person takes in no more in one picture.
pub const STATES_MAX: usize = 16;

/// Most transitions of a diagram: four a state.
pub const TRANSITIONS_MAX: usize = 64;

/// Longest name of a diagram or a state, bytes.
pub const NAME_MAX_BYTES: usize = 24;

/// Longest time that an event may count, seconds: a day.
pub const AFTER_MAX_S: u32 = 86_400;

/// The strongest wind that an event may be of, tenths of a metre a second.
pub const WIND_MAX_DMPS: u32 = 500;

/// What leads from one state to another. Each of them holds or does not, at any moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MissionEvent {
    /// The operator said hold.
    OperatorHold,
    /// The operator said return to base.
    OperatorReturn,
    /// The operator ended the mission.
    MissionCancelled,
    /// Everything is seen, and no task is open that somebody can do.
    MissionComplete,
    /// Its fuel is due.
    LowFuel,
    /// Another process speaks under its id.
    TwinSpeaks,
    /// So long ago it began this mission.
    Timer,
    /// So long it has been in this state.
    Stayed,
    /// It believes a peer of its fleet to be down.
    PeerLost,
    /// A peer that it believed to be down since it came to this state is there again.
    PeerBack,
    /// The wind is so strong.
    WindAbove,
    /// Cells are beyond everybody's fuel.
    PlanInfeasible,
    /// Something that its mission looks for was told, by itself or by another.
    ObjectDetected,
    /// Somewhere the event that its mission watches is too dense.
    CrowdDense,
    /// It lost the target that it follows, and searches for it.
    TargetLost,
    /// It was given a target to follow, and where that may be is near.
    TargetGiven,
    /// It was given a relay position, and its circle is planned.
    RelayGiven,
    /// It was given a task, and its flight is planned.
    TaskGiven,
    /// Its plan has cells.
    CellsGiven,
    /// Everything is seen, whatever tasks are open.
    AllSeen,
    /// It knew many, and hears nobody, or for long nobody who has cells to fly.
    NobodyHeard,
    /// Always.
    Otherwise,
}

impl MissionEvent {
    /// All, in the order of the default diagram.
    pub const ALL: [Self; 22] = [
        Self::OperatorHold,
        Self::OperatorReturn,
        Self::MissionCancelled,
        Self::MissionComplete,
        Self::LowFuel,
        Self::TwinSpeaks,
        Self::Timer,
        Self::Stayed,
        Self::PeerLost,
        Self::PeerBack,
        Self::WindAbove,
        Self::PlanInfeasible,
        Self::ObjectDetected,
        Self::CrowdDense,
        Self::TargetLost,
        Self::TargetGiven,
        Self::RelayGiven,
        Self::TaskGiven,
        Self::CellsGiven,
        Self::AllSeen,
        Self::NobodyHeard,
        Self::Otherwise,
    ];

    /// Its name in a file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::OperatorHold => "operator_hold",
            Self::OperatorReturn => "operator_return",
            Self::MissionCancelled => "mission_cancelled",
            Self::MissionComplete => "mission_complete",
            Self::LowFuel => "low_fuel",
            Self::TwinSpeaks => "twin_speaks",
            Self::Timer => "timer",
            Self::Stayed => "stayed",
            Self::PeerLost => "peer_lost",
            Self::PeerBack => "peer_back",
            Self::WindAbove => "wind_above",
            Self::PlanInfeasible => "plan_infeasible",
            Self::ObjectDetected => "object_detected",
            Self::CrowdDense => "crowd_dense",
            Self::TargetLost => "target_lost",
            Self::TargetGiven => "target_given",
            Self::RelayGiven => "relay_given",
            Self::TaskGiven => "task_given",
            Self::CellsGiven => "cells_given",
            Self::AllSeen => "all_seen",
            Self::NobodyHeard => "nobody_heard",
            Self::Otherwise => "otherwise",
        }
    }

    /// Whether it is of a wind, of which its transition says how strong it is.
    #[must_use]
    pub fn is_of_wind(self) -> bool {
        self == Self::WindAbove
    }

    /// Whether it counts seconds, which its transition says.
    #[must_use]
    pub fn is_timed(self) -> bool {
        matches!(self, Self::Timer | Self::Stayed)
    }
}

/// What a behaviour is for (D2.7 §1.2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// Points or a way are visited, once, as soon as possible.
    Traveling,
    /// Points or a closed way are visited again and again, so that all are seen often.
    Watching,
    /// A point is kept or followed, for as long as the state lasts.
    Tracking,
}

impl Purpose {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Traveling, Self::Watching, Self::Tracking];

    /// Its name in a file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Traveling => "traveling",
            Self::Watching => "watching",
            Self::Tracking => "tracking",
        }
    }
}

/// Of what a behaviour is made (D2.7 §1.2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// Flying from one place to another.
    Displacing,
    /// Circling at a place.
    Loitering,
}

impl Action {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Displacing, Self::Loitering];

    /// Its name in a file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacing => "displacing",
            Self::Loitering => "loitering",
        }
    }
}

/// A behaviour as data.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Behaviour {
    /// What it is for.
    pub purpose: Purpose,
    /// Dimension of what is flown: 0 a point or points, 1 a line, 2 an area, 3 a volume; that of
    /// what the mission asks to see where none is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dimension: Option<u8>,
    /// Whether it ends where it began.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub closed: bool,
    /// Whether it goes on for as long as its state lasts; else it is done once.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub endless: bool,
    /// Of what it is made, in this order.
    pub actions: Vec<Action>,
}

/// The goal that a state stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StateGoal {
    /// Loiter where it is.
    Hold,
    /// Fly the cells of its plan, then loiter.
    Section,
    /// Fly round the loop again and again, evenly spaced among those who do.
    Round,
    /// Fly along a contour that is seen, evenly spaced among those who do; round the loop until
    /// it is.
    Trace,
    /// Fly to its relay position and circle there.
    Relay,
    /// Follow its target, or search for it.
    Follow,
    /// Fly its task, then the cells of its plan.
    Task,
    /// Fly to the base and loiter there.
    Home,
}

impl StateGoal {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Hold,
        Self::Section,
        Self::Round,
        Self::Trace,
        Self::Relay,
        Self::Follow,
        Self::Task,
        Self::Home,
    ];

    /// Whether it is flown on and on once everything is seen.
    #[must_use]
    pub fn goes_on(self) -> bool {
        matches!(self, Self::Round | Self::Trace)
    }

    /// Its name in a file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Section => "section",
            Self::Round => "round",
            Self::Trace => "trace",
            Self::Relay => "relay",
            Self::Follow => "follow",
            Self::Task => "task",
            Self::Home => "home",
        }
    }

    /// What a UAV does, for a person.
    #[must_use]
    pub fn sentence(self) -> &'static str {
        match self {
            Self::Hold => "loiters where it is",
            Self::Section => "flies its section",
            Self::Round => "flies round, evenly spaced among those who do",
            Self::Trace => "flies along the contour that it sees, or looks for one",
            Self::Relay => "holds a relay position that it was given, or flies to it",
            Self::Follow => "follows a target that it was given, or searches for it",
            Self::Task => "flies to a task that it was given, between two cells of its section",
            Self::Home => "flies home",
        }
    }
}

/// What becomes of the work of a UAV that is in a state, beside what orders and fuel leave it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// It takes part in planning.
    #[default]
    Takes,
    /// It takes no part, and its plan stays listed.
    Keeps,
    /// It takes no part, and lets its plan go: others fly it.
    Releases,
    /// The same, and the mission is over for it.
    Ends,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Takes, Self::Keeps, Self::Releases, Self::Ends];

    /// Its name in a file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Takes => "takes",
            Self::Keeps => "keeps",
            Self::Releases => "releases",
            Self::Ends => "ends",
        }
    }

    /// Whether the plan is let go.
    #[must_use]
    pub fn lets_go(self) -> bool {
        matches!(self, Self::Releases | Self::Ends)
    }
}

/// A state of a mission.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct State {
    /// What it is called.
    pub name: String,
    /// What is done in it.
    pub behaviour: Behaviour,
    /// By which goal.
    pub goal: StateGoal,
    /// What becomes of its work.
    #[serde(default, skip_serializing_if = "is_default")]
    pub part: Part,
}

/// A way from one state to another.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Transition {
    /// From which state; from any where none is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// When this holds.
    pub on: MissionEvent,
    /// After so many seconds, of an event that counts them; 0 of all others.
    #[serde(default, skip_serializing_if = "is_default")]
    pub after_s: u32,
    /// Above so many tenths of a metre a second, of an event that is of a wind; 0 of all others.
    #[serde(default, skip_serializing_if = "is_default")]
    pub above_dmps: u32,
    /// To which state.
    pub to: String,
    /// Of several events that hold, the one of the lowest number counts.
    pub priority: u8,
}

impl Transition {
    /// What its event is measured by: seconds of one that counts them, tenths of a metre a second
    /// of a wind, and 0 of all others.
    #[must_use]
    pub fn amount(&self) -> u32 {
        if self.on.is_of_wind() {
            self.above_dmps
        } else {
            self.after_s
        }
    }
}

/// A mission as a transition diagram. It begins in its first state.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagram {
    /// What it is called.
    pub name: String,
    /// Its states, at most [`STATES_MAX`].
    pub states: Vec<State>,
    /// Its transitions, at most [`TRANSITIONS_MAX`].
    pub transitions: Vec<Transition>,
}

impl Diagram {
    /// The diagram of a mission that brings none.
    #[must_use]
    pub fn coverage() -> Self {
        coverage::diagram()
    }

    /// Folds it into the hash of a mission.
    pub(crate) fn hash(&self, h: &mut Fnv) {
        let text = |h: &mut Fnv, text: &str| {
            h.write_i64(i64::try_from(text.len()).unwrap_or(i64::MAX));
            text.bytes().for_each(|b| h.write_i64(i64::from(b)));
        };
        let count = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
        text(h, &self.name);
        h.write_i64(count(self.states.len()));
        for state in &self.states {
            let Behaviour {
                purpose,
                dimension,
                closed,
                endless,
                actions,
            } = &state.behaviour;
            text(h, &state.name);
            text(h, purpose.name());
            h.write_i64(dimension.map_or(-1, i64::from));
            h.write_i64(i64::from(*closed));
            h.write_i64(i64::from(*endless));
            h.write_i64(count(actions.len()));
            actions.iter().for_each(|a| text(h, a.name()));
            text(h, state.goal.name());
            text(h, state.part.name());
        }
        h.write_i64(count(self.transitions.len()));
        for t in &self.transitions {
            text(h, t.from.as_deref().unwrap_or_default());
            text(h, t.on.name());
            h.write_i64(i64::from(t.amount()));
            text(h, &t.to);
            h.write_i64(i64::from(t.priority));
        }
    }
}

/// One transition of a state, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way {
    /// When this holds.
    pub on: MissionEvent,
    /// Of it so much ([`Transition::amount`]).
    pub amount: u32,
    /// To the state of this number.
    pub to: usize,
    /// Lower numbers come first.
    pub priority: u8,
}

/// A diagram that was checked, ready to be obeyed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    states: Vec<State>,
    /// Of each state what leads out of it, by priority.
    ways: Vec<Vec<Way>>,
}

impl Machine {
    /// # Errors
    /// [`DiagramError`] says what of the diagram cannot be flown, where, and what would help.
    pub fn new(diagram: &Diagram) -> Result<Self, DiagramError> {
        let ways = check::ways(diagram)?;
        let machine = Self {
            states: diagram.states.clone(),
            ways,
        };
        check::flown(&machine)?;
        Ok(machine)
    }

    /// The state in which a mission begins.
    #[must_use]
    pub fn start(&self) -> usize {
        0
    }

    /// All states, by number.
    #[must_use]
    pub fn states(&self) -> &[State] {
        &self.states
    }

    /// A state by its number.
    ///
    /// # Panics
    /// Where there is none of this number.
    #[must_use]
    pub fn state(&self, at: usize) -> &State {
        &self.states[at]
    }

    /// What leads out of a state, by priority.
    ///
    /// # Panics
    /// Where there is none of this number.
    #[must_use]
    pub fn ways(&self, at: usize) -> &[Way] {
        &self.ways[at]
    }

    /// After how many seconds the mission ends, whatever was seen; none where it ends by what was
    /// seen alone.
    #[must_use]
    pub fn ends_after_s(&self) -> Option<u32> {
        let ends = |to: usize| self.state(to).part == Part::Ends;
        let all = self.ways.iter().flatten();
        let timers = all.filter(|w| w.on == MissionEvent::Timer && ends(w.to));
        timers.map(|w| w.amount).min()
    }

    /// Whether the loop is flown round and round once everything is seen.
    #[must_use]
    pub fn goes_round(&self) -> bool {
        self.states().iter().any(|s| s.goal == StateGoal::Round)
    }

    /// Whether a contour is flown along once everything is seen.
    #[must_use]
    pub fn traces(&self) -> bool {
        self.states().iter().any(|s| s.goal == StateGoal::Trace)
    }

    /// Whether some state holds a relay position.
    #[must_use]
    pub fn relays(&self) -> bool {
        self.states().iter().any(|s| s.goal == StateGoal::Relay)
    }

    /// Whether it goes on once everything is seen, until something else ends it.
    #[must_use]
    pub fn goes_on(&self) -> bool {
        self.states().iter().any(|s| s.goal.goes_on())
    }

    /// Whether the mission ends when something that it looks for was told.
    #[must_use]
    pub fn ends_when_found(&self) -> bool {
        let mut all = self.ways.iter().flatten();
        all.any(|w| w.on == MissionEvent::ObjectDetected && self.state(w.to).part == Part::Ends)
    }

    /// Which state follows, and by which event; none where no event holds that leads anywhere.
    /// `holds` says of an event, with the seconds that it counts, whether it holds.
    #[must_use]
    pub fn look(
        &self,
        at: usize,
        holds: &dyn Fn(MissionEvent, u32) -> bool,
    ) -> Option<(usize, MissionEvent)> {
        let taken = self.ways(at).iter().find(|w| holds(w.on, w.amount));
        taken.map(|w| (w.to, w.on))
    }
}
