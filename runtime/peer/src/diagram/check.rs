//! Whether a diagram may be flown: its names, what each state leads to, and that behaviours say
//! what their goals do. What is refused is told with its place and with what would help.

use super::{
    AFTER_MAX_S, Action, Behaviour, Diagram, Machine, MissionEvent, NAME_MAX_BYTES, Part, Purpose,
    STATES_MAX, State, StateGoal, TRANSITIONS_MAX, WIND_MAX_DMPS, Way,
};
use std::collections::BTreeSet;

/// Why a diagram cannot be flown. Nothing of it is.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct DiagramError {
    /// The path of what is wrong within the diagram, such as `transitions[3].to`.
    pub place: String,
    /// What is wrong, and what would help.
    pub problem: String,
}

fn wrong(place: impl Into<String>, problem: impl Into<String>) -> DiagramError {
    DiagramError {
        place: place.into(),
        problem: problem.into(),
    }
}

/// Whether this can name a diagram or a state: letters, digits, `_` and `-`.
#[must_use]
pub fn is_name(text: &str) -> bool {
    let known = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    (1..=NAME_MAX_BYTES).contains(&text.len()) && text.chars().all(known)
}

fn check_names(diagram: &Diagram) -> Result<(), DiagramError> {
    let no_name = |place: String, name: &str| {
        wrong(
            place,
            format!(
                "{name:?} is no name; expected 1 to {NAME_MAX_BYTES} letters, digits, '_' or '-'"
            ),
        )
    };
    if !is_name(&diagram.name) {
        return Err(no_name("name".into(), &diagram.name));
    }
    if !(1..=STATES_MAX).contains(&diagram.states.len()) {
        let n = diagram.states.len();
        let text = format!("a diagram has {n} states; expected 1 to {STATES_MAX}");
        return Err(wrong("states", text));
    }
    if diagram.transitions.len() > TRANSITIONS_MAX {
        let n = diagram.transitions.len();
        let text = format!("a diagram has {n} transitions; expected at most {TRANSITIONS_MAX}");
        return Err(wrong("transitions", text));
    }
    let mut names = BTreeSet::new();
    for (i, state) in diagram.states.iter().enumerate() {
        let place = format!("states[{i}].name");
        if !is_name(&state.name) {
            return Err(no_name(place, &state.name));
        }
        if !names.insert(&state.name) {
            let text = format!("two states are called \"{}\"; rename one", state.name);
            return Err(wrong(place, text));
        }
    }
    Ok(())
}

/// What leads out of each state, by priority.
pub(super) fn ways(diagram: &Diagram) -> Result<Vec<Vec<Way>>, DiagramError> {
    check_names(diagram)?;
    for (i, state) in diagram.states.iter().enumerate() {
        check_behaviour(state).map_err(|(field, text)| {
            let place = format!("states[{i}].{field}");
            wrong(place, format!("the state \"{}\" {text}", state.name))
        })?;
    }
    let index = |place: String, name: &str| {
        let found = diagram.states.iter().position(|s| s.name == name);
        found.ok_or_else(|| {
            let known: Vec<&str> = diagram.states.iter().map(|s| s.name.as_str()).collect();
            let known = known.join(", ");
            wrong(
                place,
                format!("no state is called \"{name}\"; expected one of {known}"),
            )
        })
    };
    // Of each state: the number of the transition, and where it leads.
    let mut all: Vec<Vec<(usize, Way)>> = vec![Vec::new(); diagram.states.len()];
    for (k, t) in diagram.transitions.iter().enumerate() {
        let place = |field: &str| format!("transitions[{k}].{field}");
        let to = index(place("to"), &t.to)?;
        let from = t.from.as_deref().map(|name| index(place("from"), name));
        let from = from.transpose()?;
        if t.on.is_timed() && !(1..=AFTER_MAX_S).contains(&t.after_s) {
            let on = t.on.name();
            let text = format!("\"{on}\" counts seconds; expected after_s of 1 to {AFTER_MAX_S}");
            return Err(wrong(place("after_s"), text));
        }
        if !t.on.is_timed() && t.after_s != 0 {
            let text = format!("\"{}\" counts no seconds; leave after_s out", t.on.name());
            return Err(wrong(place("after_s"), text));
        }
        if t.on.is_of_wind() && !(1..=WIND_MAX_DMPS).contains(&t.above_dmps) {
            let most_mps = WIND_MAX_DMPS / 10;
            let on = t.on.name();
            let text = format!("\"{on}\" is of a wind; expected above_mps of 0.1 to {most_mps}");
            return Err(wrong(place("above_mps"), text));
        }
        if !t.on.is_of_wind() && t.above_dmps != 0 {
            let text = format!("\"{}\" is of no wind; leave above_mps out", t.on.name());
            return Err(wrong(place("above_mps"), text));
        }
        let way = Way {
            on: t.on,
            amount: t.amount(),
            to,
            priority: t.priority,
        };
        let leaves = |i: &usize| from.is_none_or(|f| f == *i);
        for i in (0..all.len()).filter(leaves) {
            check_beside(diagram, (i, k), &all[i], way)?;
            all[i].push((k, way));
        }
    }
    for ways in &mut all {
        ways.sort_by_key(|(_, w)| w.priority);
    }
    let ways = all.into_iter();
    Ok(ways
        .map(|w| w.into_iter().map(|(_, way)| way).collect())
        .collect())
}

/// No two that leave one state are of the same priority, and no two of one state, or from any,
/// ask for the same event.
fn check_beside(
    diagram: &Diagram,
    (state, k): (usize, usize),
    others: &[(usize, Way)],
    way: Way,
) -> Result<(), DiagramError> {
    let name = &diagram.states[state].name;
    for (j, other) in others {
        if other.priority == way.priority {
            let text = format!(
                "transitions[{j}] leaves \"{name}\" with the priority {}, too; expected another number",
                way.priority
            );
            return Err(wrong(format!("transitions[{k}].priority"), text));
        }
        let same_from = diagram.transitions[*j].from == diagram.transitions[k].from;
        if same_from && (other.on, other.amount) == (way.on, way.amount) {
            let text = format!(
                "transitions[{j}] leaves \"{name}\" on \"{}\", too; leave one out",
                way.on.name()
            );
            return Err(wrong(format!("transitions[{k}].on"), text));
        }
    }
    Ok(())
}

/// Behaviours say what their goals do.
fn check_behaviour(state: &State) -> Result<(), (&'static str, String)> {
    use Action::{Displacing, Loitering};
    let Behaviour {
        purpose,
        dimension,
        closed,
        endless,
        actions,
    } = &state.behaviour;
    let goal = state.goal;
    let purposes: &[Purpose] = match goal {
        StateGoal::Hold | StateGoal::Relay | StateGoal::Follow => &[Purpose::Tracking],
        StateGoal::Section => &[Purpose::Traveling, Purpose::Watching],
        StateGoal::Round => &[Purpose::Watching],
        StateGoal::Trace => &[Purpose::Watching, Purpose::Tracking],
        StateGoal::Task | StateGoal::Home => &[Purpose::Traveling],
    };
    if !purposes.contains(purpose) {
        let names: Vec<&str> = purposes.iter().map(|p| p.name()).collect();
        let text = format!(
            "has the goal \"{}\", which is for {}",
            goal.name(),
            names.join(" or ")
        );
        return Err(("behaviour.purpose", text));
    }
    let keeps = *purpose != Purpose::Traveling;
    if *endless != keeps {
        let text = if keeps {
            format!("is for {}, which goes on: endless: true", purpose.name())
        } else {
            "is for traveling, which is done once; leave endless out".to_owned()
        };
        return Err(("behaviour.endless", text));
    }
    if *purpose == Purpose::Watching && !closed {
        let text = "is for watching, which ends where it began: closed: true".to_owned();
        return Err(("behaviour.closed", text));
    }
    let dimensions: &[Option<u8>] = match goal {
        StateGoal::Hold | StateGoal::Relay | StateGoal::Follow => &[Some(0)],
        StateGoal::Task | StateGoal::Home => &[Some(1), None],
        StateGoal::Trace => &[Some(1)],
        StateGoal::Section | StateGoal::Round => &[None, Some(0), Some(1), Some(2), Some(3)],
    };
    if !dimensions.contains(dimension) {
        let known: Vec<String> = dimensions.iter().flatten().map(u8::to_string).collect();
        let text = format!(
            "has the goal \"{}\", of dimension {}",
            goal.name(),
            known.join(", ")
        );
        return Err(("behaviour.dimension", text));
    }
    let made_of: &[&[Action]] = match goal {
        StateGoal::Hold => &[&[Loitering]],
        StateGoal::Section | StateGoal::Task => &[&[Displacing], &[Displacing, Loitering]],
        StateGoal::Round | StateGoal::Trace => &[&[Displacing]],
        StateGoal::Relay | StateGoal::Follow | StateGoal::Home => &[&[Displacing, Loitering]],
    };
    if !made_of.contains(&actions.as_slice()) {
        let each = made_of.iter().map(|all| {
            let names: Vec<&str> = all.iter().map(|a| a.name()).collect();
            names.join(" then ")
        });
        let known: Vec<String> = each.collect();
        let text = format!(
            "has the goal \"{}\", which is made of {}",
            goal.name(),
            known.join(" or of ")
        );
        return Err(("behaviour.actions", text));
    }
    Ok(())
}

/// What everybody relies on, whatever a mission does else: on these events a UAV flies home.
const HOMEWARD: [MissionEvent; 4] = [
    MissionEvent::OperatorReturn,
    MissionEvent::MissionCancelled,
    MissionEvent::LowFuel,
    MissionEvent::TwinSpeaks,
];

/// Events that hand a UAV something, and the goal that takes it up.
const GIVEN: [(MissionEvent, StateGoal); 4] = [
    (MissionEvent::TargetGiven, StateGoal::Follow),
    (MissionEvent::RelayGiven, StateGoal::Relay),
    (MissionEvent::TaskGiven, StateGoal::Task),
    (MissionEvent::CellsGiven, StateGoal::Section),
];

/// What a state needs to be reached, beside what a UAV is given: round it flies when everything
/// is seen.
const REACHED_BY: [(MissionEvent, StateGoal); 2] = [
    (MissionEvent::AllSeen, StateGoal::Round),
    (MissionEvent::AllSeen, StateGoal::Trace),
];

/// What a diagram leads to.
pub(super) fn flown(machine: &Machine) -> Result<(), DiagramError> {
    let states = || machine.states().iter().enumerate();
    for (i, state) in states() {
        let place = || format!("states[{i}]");
        let first = machine.ways(i).first();
        let holds = first.is_some_and(|w| {
            let to = machine.state(w.to);
            w.on == MissionEvent::OperatorHold
                && (to.goal, to.part) == (StateGoal::Hold, Part::Keeps)
        });
        if !holds {
            let text = format!(
                "the state \"{}\" does not obey the operator first: expected a transition from any on \"operator_hold\" of the lowest priority, to a state with the goal \"hold\" and the part \"keeps\"",
                state.name
            );
            return Err(wrong(place(), text));
        }
        for event in HOMEWARD {
            leads_home(machine, i, event).map_err(|text| wrong(place(), text))?;
        }
        for way in machine.ways(i) {
            let goal = machine.state(way.to).goal;
            let taken_up = GIVEN.into_iter().find(|(on, _)| *on == way.on);
            let needs = GIVEN
                .into_iter()
                .chain(REACHED_BY)
                .find(|(_, g)| *g == goal);
            // Of a section nothing need be left to be flown.
            let needs = needs.filter(|(_, g)| *g != StateGoal::Section);
            // Who lost whom it follows follows it still.
            let seeks = (way.on, goal) == (MissionEvent::TargetLost, StateGoal::Follow)
                && machine.state(i).goal == StateGoal::Follow;
            let amiss = taken_up
                .or(needs)
                .filter(|g| *g != (way.on, goal) && !seeks);
            if let Some((on, wanted)) = amiss {
                let text = format!(
                    "from the state \"{}\" \"{}\" leads to \"{}\": expected \"{}\" and a state with the goal \"{}\" together",
                    state.name,
                    way.on.name(),
                    machine.state(way.to).name,
                    on.name(),
                    wanted.name()
                );
                return Err(wrong("transitions", text));
            }
        }
        if state.part == Part::Ends && state.goal != StateGoal::Home {
            let text = format!(
                "the state \"{}\" ends the mission: expected the goal \"home\"",
                state.name
            );
            return Err(wrong(format!("{}.part", place()), text));
        }
    }
    for (on, goal) in GIVEN {
        let all = states().flat_map(|(i, _)| machine.ways(i));
        if !all.into_iter().any(|w| w.on == on) {
            let text = format!(
                "nothing leads out on \"{}\": expected a transition from any to a state with the goal \"{}\"",
                on.name(),
                goal.name()
            );
            return Err(wrong("transitions", text));
        }
    }
    all_reached(machine)
}

/// While this event holds, a look at it leads home, and none after it leads elsewhere. An
/// operator who says hold has the last word.
fn leads_home(machine: &Machine, state: usize, event: MissionEvent) -> Result<(), String> {
    let from = machine.state(state);
    for way in machine.ways(state) {
        let to = machine.state(way.to);
        if to.goal == StateGoal::Home {
            if way.on == event || way.on == MissionEvent::Otherwise {
                return Ok(());
            }
            continue;
        }
        if way.on == event {
            return Err(format!(
                "in the state \"{}\" \"{}\" leads to \"{}\": expected a state with the goal \"home\"",
                from.name,
                event.name(),
                to.name
            ));
        }
        if way.on != MissionEvent::OperatorHold {
            return Err(format!(
                "in the state \"{}\" \"{}\" counts before \"{}\" and leads to \"{}\": expected a transition on \"{}\" to a state with the goal \"home\", of a lower priority",
                from.name,
                way.on.name(),
                event.name(),
                to.name,
                event.name()
            ));
        }
    }
    if from.goal == StateGoal::Home {
        return Ok(());
    }
    Err(format!(
        "no way home leads from the state \"{}\" on \"{}\": expected a transition from any on it, to a state with the goal \"home\"",
        from.name,
        event.name()
    ))
}

/// Each state is reached, and each transition can be taken.
fn all_reached(machine: &Machine) -> Result<(), DiagramError> {
    let mut reached = BTreeSet::from([machine.start()]);
    let mut open = vec![machine.start()];
    while let Some(i) = open.pop() {
        let ways = machine.ways(i);
        let always = ways.iter().position(|w| w.on == MissionEvent::Otherwise);
        let end = always.map_or(ways.len(), |p| p + 1);
        for way in &ways[..end] {
            if reached.insert(way.to) {
                open.push(way.to);
            }
        }
        if let Some(late) = ways.get(end) {
            let text = format!(
                "in the state \"{}\" \"{}\" comes after \"otherwise\", which always holds: expected a lower priority",
                machine.state(i).name,
                late.on.name()
            );
            return Err(wrong("transitions", text));
        }
    }
    let lost = (0..machine.states().len()).find(|i| !reached.contains(i));
    let Some(i) = lost else {
        return Ok(());
    };
    let (name, start) = (&machine.state(i).name, &machine.state(machine.start()).name);
    let text = format!(
        "the state \"{name}\" is never reached from \"{start}\": expected a transition to it, or leave it out"
    );
    Err(wrong(format!("states[{i}]"), text))
}

/// Whether a diagram fits what a mission asks to see: of this dimension, and several times or
/// once; and how its UAVs are kept apart, by agreement or by heights.
pub(crate) fn fits(
    diagram: &Diagram,
    dimension: u8,
    again: bool,
    apart: bool,
) -> Result<(), DiagramError> {
    let all = diagram.states.iter().enumerate();
    let flown = |s: &State| s.goal == StateGoal::Section || s.goal.goes_on();
    for (i, state) in all.filter(|(_, s)| flown(s)) {
        let behaviour = &state.behaviour;
        let asked = behaviour
            .dimension
            .filter(|_| state.goal != StateGoal::Trace);
        if let Some(d) = asked.filter(|d| *d != dimension) {
            let text = format!(
                "the state \"{}\" flies what has dimension {d}, and the mission asks to see what has dimension {dimension}; leave it out for any",
                state.name
            );
            return Err(wrong(format!("states[{i}].behaviour.dimension"), text));
        }
        if state.goal.goes_on() {
            if again {
                let text = format!(
                    "the state \"{}\" goes on once everything is seen, and the mission has laps; leave the laps out",
                    state.name
                );
                return Err(wrong(format!("states[{i}].goal"), text));
            }
            if apart {
                let text = format!(
                    "the state \"{}\" goes on, and UAVs that are kept apart by agreement fly cells alone; leave the separation out",
                    state.name
                );
                return Err(wrong(format!("states[{i}].goal"), text));
            }
            continue;
        }
        if behaviour.endless != again {
            let text = if again {
                format!(
                    "the state \"{}\" is flown once, and the mission has laps; watch, or leave the laps out",
                    state.name
                )
            } else {
                format!(
                    "the state \"{}\" watches, and the mission has one lap; travel, or ask for laps",
                    state.name
                )
            };
            return Err(wrong(format!("states[{i}].behaviour.endless"), text));
        }
    }
    Ok(())
}
