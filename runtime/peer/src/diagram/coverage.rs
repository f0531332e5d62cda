//! The diagram of a mission that brings none: everything is seen once, or in as many laps as the
//! mission says, and all come home. The same stands in `configs/diagrams/coverage.json5`.

use super::{
    Action, Behaviour, Diagram, MissionEvent, Part, Purpose, State, StateGoal, Transition,
};

const KEPT: &[Action] = &[Action::Displacing, Action::Loitering];

fn state(name: &str, purpose: Purpose, dimension: Option<u8>, goal: StateGoal) -> State {
    let endless = purpose != Purpose::Traveling;
    let actions = match goal {
        StateGoal::Hold => &[Action::Loitering][..],
        StateGoal::Section | StateGoal::Round | StateGoal::Trace | StateGoal::Task => {
            &[Action::Displacing]
        }
        StateGoal::Relay | StateGoal::Follow | StateGoal::Home => KEPT,
    };
    State {
        name: name.to_owned(),
        behaviour: Behaviour {
            purpose,
            dimension,
            closed: endless,
            endless,
            actions: actions.to_vec(),
        },
        goal,
        part: Part::Takes,
    }
}

/// What leads where, from any state, the first first.
const ORDER: &[(MissionEvent, &str)] = &[
    (MissionEvent::OperatorHold, "hold"),
    (MissionEvent::OperatorReturn, "recalled"),
    (MissionEvent::MissionCancelled, "home"),
    (MissionEvent::MissionComplete, "home"),
    (MissionEvent::LowFuel, "home"),
    (MissionEvent::TwinSpeaks, "home"),
    (MissionEvent::TargetGiven, "follow"),
    (MissionEvent::RelayGiven, "relay"),
    (MissionEvent::TaskGiven, "task"),
    (MissionEvent::CellsGiven, "section"),
    (MissionEvent::NobodyHeard, "home"),
    (MissionEvent::Otherwise, "wait"),
];

pub(super) fn diagram() -> Diagram {
    use Purpose::{Tracking, Traveling};
    let states = vec![
        state("wait", Tracking, Some(0), StateGoal::Hold),
        state("section", Traveling, None, StateGoal::Section),
        state("task", Traveling, Some(1), StateGoal::Task),
        State {
            part: Part::Releases,
            ..state("relay", Tracking, Some(0), StateGoal::Relay)
        },
        State {
            part: Part::Releases,
            ..state("follow", Tracking, Some(0), StateGoal::Follow)
        },
        State {
            part: Part::Keeps,
            ..state("hold", Tracking, Some(0), StateGoal::Hold)
        },
        State {
            part: Part::Releases,
            ..state("recalled", Traveling, Some(1), StateGoal::Home)
        },
        state("home", Traveling, Some(1), StateGoal::Home),
    ];
    let transitions = (1..).zip(ORDER).map(|(priority, (on, to))| Transition {
        from: None,
        on: *on,
        after_s: 0,
        above_dmps: 0,
        to: (*to).to_owned(),
        priority,
    });
    Diagram {
        name: "coverage".to_owned(),
        states,
        transitions: transitions.collect(),
    }
}
