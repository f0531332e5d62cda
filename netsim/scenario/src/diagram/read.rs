//! The text of a transition diagram, with the place of what is wrong with it. Whether it can be
//! flown is the peer's own check.

use skein_interop::json::{Error, Node, suggestion};
use skein_peer::diagram::{
    AFTER_MAX_S, Action, Behaviour, Diagram, Machine, MissionEvent, Part, Purpose, State,
    StateGoal, Transition, WIND_MAX_DMPS,
};

/// Reads a diagram, and checks it.
pub(super) fn diagram(node: &Node<'_>) -> Result<Diagram, Error> {
    let f = node.fields(&["name", "states", "transitions"])?;
    let states = f.need(
        "states",
        "[{ name: \"home\", goal: \"home\", behaviour: { purpose: \"traveling\", actions: [\"displacing\", \"loitering\"] } }]",
    )?;
    let transitions = f.need(
        "transitions",
        "[{ priority: 1, on: \"operator_hold\", from: \"any\", to: \"hold\" }]",
    )?;
    let mut all = Vec::new();
    // Of each transition of the diagram the number of the one in the text.
    let mut lines = Vec::new();
    for (line, item) in transitions.items()?.iter().enumerate() {
        let of_line = self::transitions(item)?;
        lines.extend(of_line.iter().map(|_| line));
        all.extend(of_line);
    }
    let diagram = Diagram {
        name: f.need("name", "\"patrol\"")?.text()?.to_owned(),
        states: states
            .items()?
            .iter()
            .map(state)
            .collect::<Result<_, _>>()?,
        transitions: all,
    };
    match Machine::new(&diagram) {
        Ok(_) => Ok(diagram),
        Err(e) => Err(placed(node, &e.place, &lines).wrong(e.problem)),
    }
}

/// The node at a path of the diagram: of a transition that one in the text which it is of, and
/// as near as there is one where the path names what the text leaves out.
fn placed<'a>(node: &Node<'a>, path: &str, lines: &[usize]) -> Node<'a> {
    let mut at = node.clone();
    for part in path.split(['.', '[']) {
        let next = match part.strip_suffix(']').map(str::parse::<usize>) {
            Some(Ok(i)) => {
                let is_line = path.starts_with("transitions");
                let i = if is_line {
                    lines.get(i).copied().unwrap_or(i)
                } else {
                    i
                };
                at.items().ok().and_then(|items| items.into_iter().nth(i))
            }
            _ => at.get(part).ok().flatten(),
        };
        match next {
            Some(next) => at = next,
            None => break,
        }
    }
    at
}

fn state(node: &Node<'_>) -> Result<State, Error> {
    let f = node.fields(&["name", "goal", "part", "behaviour"])?;
    let goals = StateGoal::ALL.map(|g| (g.name(), g));
    let goal = f.need("goal", "\"home\"")?;
    let parts = Part::ALL.map(|p| (p.name(), p));
    let example = "{ purpose: \"traveling\", actions: [\"displacing\"] }";
    Ok(State {
        name: f.need("name", "\"home\"")?.text()?.to_owned(),
        behaviour: behaviour(f.need("behaviour", example)?)?,
        goal: goal.one_of(&goals)?,
        part: f
            .get("part")
            .map_or(Ok(Part::default()), |p| p.one_of(&parts))?,
    })
}

fn behaviour(node: &Node<'_>) -> Result<Behaviour, Error> {
    let f = node.fields(&["purpose", "dimension", "closed", "endless", "actions"])?;
    let purposes = Purpose::ALL.map(|p| (p.name(), p));
    let actions = Action::ALL.map(|a| (a.name(), a));
    let dimension = f.get("dimension").map(|d| {
        let dimension = d.small(0, 3, "dimensions")?;
        Ok(u8::try_from(dimension).unwrap_or(u8::MAX))
    });
    Ok(Behaviour {
        purpose: f.need("purpose", "\"traveling\"")?.one_of(&purposes)?,
        dimension: dimension.transpose()?,
        closed: f.get("closed").map_or(Ok(false), Node::flag)?,
        endless: f.get("endless").map_or(Ok(false), Node::flag)?,
        actions: f
            .need("actions", "[\"displacing\", \"loitering\"]")?
            .items()?
            .iter()
            .map(|a| a.one_of(&actions))
            .collect::<Result<_, _>>()?,
    })
}

/// One of each state that it leaves.
fn transitions(node: &Node<'_>) -> Result<Vec<Transition>, Error> {
    let f = node.fields(&["priority", "on", "after_s", "above_mps", "from", "to"])?;
    let on = event(f.need("on", "\"mission_complete\"")?)?;
    let after_s = f
        .get("after_s")
        .map_or(Ok(0), |n| n.whole(1, AFTER_MAX_S, "seconds"))?;
    let most_mps = f64::from(WIND_MAX_DMPS) / 10.0;
    let above_mps = f
        .get("above_mps")
        .map_or(Ok(0.0), |n| n.number(0.1, most_mps, "m/s"))?;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked to be some tenths"
    )]
    let above_dmps = (above_mps * 10.0).round() as u32;
    let priority = f.need("priority", "1")?.small(1, 255, "the priority")?;
    let from = f.need("from", "\"any\", a state or a list of states")?;
    let names = if from.is_list() {
        let all = from.items()?;
        let names: Result<Vec<_>, _> = all.iter().map(|n| Ok(Some(n.text()?.to_owned()))).collect();
        names?
    } else {
        let name = from.text()?;
        vec![(name != "any").then(|| name.to_owned())]
    };
    let to = f.need("to", "\"home\"")?.text()?;
    let one = |from| Transition {
        from,
        on,
        after_s,
        above_dmps,
        to: to.to_owned(),
        priority: u8::try_from(priority).unwrap_or(u8::MAX),
    };
    Ok(names.into_iter().map(one).collect())
}

fn event(node: &Node<'_>) -> Result<MissionEvent, Error> {
    let name = node.text()?;
    let found = MissionEvent::ALL.into_iter().find(|e| e.name() == name);
    found.ok_or_else(|| {
        let known = MissionEvent::ALL.map(MissionEvent::name);
        let known = suggestion(name, &known);
        node.wrong(format!("no event is called \"{name}\"; {known}"))
    })
}
