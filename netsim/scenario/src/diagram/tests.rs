use super::*;
use skein_peer::diagram::{Machine, MissionEvent, StateGoal};

fn text(name: &str) -> &'static str {
    let found = DIAGRAMS.iter().find(|(n, _, _)| *n == name);
    found.map(|(_, _, text)| *text).expect("a built-in diagram")
}

#[test]
fn the_default_diagram_is_the_one_that_peers_obey() {
    assert_eq!(builtin("coverage"), Some(Diagram::coverage()));
}

#[test]
fn every_built_in_diagram_is_sound_and_called_as_it_is_named() {
    for (name, file, text) in DIAGRAMS {
        let diagram = parse(file, text).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(diagram.name, *name);
        assert!(Machine::new(&diagram).is_ok());
    }
}

#[test]
fn a_scenario_is_opened_by_its_diagram() {
    assert_eq!(open("helsinki").unwrap(), Diagram::coverage());
    assert_eq!(open("coverage").unwrap(), Diagram::coverage());
    let wrong = open("coverge").unwrap_err().to_string();
    assert!(wrong.contains("coverage"), "{wrong}");
}

/// Each line of the text is replaced, and the error has its place and says what would help.
#[test]
fn what_is_wrong_is_told_with_its_place_and_a_remedy() {
    let low_fuel = "{ priority: 5, on: \"low_fuel\", from: \"any\", to: \"home\" },";
    for (old, new, place, remedy) in [
        (
            "on: \"low_fuel\"",
            "on: \"low_feul\"",
            "transitions[4].on",
            "did you mean",
        ),
        (
            "on: \"low_fuel\"",
            "on: \"wind_above\"",
            "transitions[4]: ",
            "expected above_mps",
        ),
        (
            "on: \"low_fuel\"",
            "on: \"timer\"",
            "transitions[4]: ",
            "expected after_s",
        ),
        (low_fuel, "", "states[0]", "counts before \"low_fuel\""),
        (
            "priority: 5,",
            "priority: 4,",
            "transitions[4].priority",
            "expected another number",
        ),
        (
            "priority: 5,",
            "priority: 10,",
            "transitions[9].priority",
            "expected another number",
        ),
        (
            "from: \"any\", to: \"section\"",
            "from: \"any\", to: \"sections\"",
            "transitions[9].to",
            "no state is called \"sections\"",
        ),
        (
            "from: \"any\", to: \"section\"",
            "from: \"nobody\", to: \"section\"",
            "transitions[9].from",
            "no state is called \"nobody\"",
        ),
        (
            "from: \"any\", to: \"section\"",
            "from: \"any\", to: \"wait\"",
            "transitions",
            "expected \"cells_given\"",
        ),
        (
            "{ priority: 2, on: \"operator_return\", from: \"any\", to: \"recalled\" },",
            "",
            "states[0]",
            "expected a transition on \"operator_return\"",
        ),
        (
            "{ priority: 1, on: \"operator_hold\"",
            "{ priority: 13, on: \"operator_hold\"",
            "states[0]",
            "does not obey the operator first",
        ),
        (
            "priority: 3,",
            "priority: 20,",
            "states[0]",
            "counts before \"mission_cancelled\"",
        ),
        (
            "priority: 11, on: \"nobody_heard\"",
            "priority: 200, on: \"nobody_heard\"",
            "transitions",
            "comes after \"otherwise\"",
        ),
        (
            "on: \"operator_return\", from: \"any\", to: \"recalled\"",
            "on: \"operator_return\", from: \"any\", to: \"home\"",
            "states[6]",
            "never reached",
        ),
        (
            "purpose: \"traveling\", actions: [\"displacing\"]",
            "purpose: \"tracking\", actions: [\"displacing\"]",
            "states[1].behaviour.purpose",
            "which is for traveling or watching",
        ),
        (
            "purpose: \"traveling\", actions: [\"displacing\"]",
            "purpose: \"watching\", actions: [\"displacing\"]",
            "states[1].behaviour",
            "endless: true",
        ),
        (
            "dimension: 1, actions: [\"displacing\"]",
            "dimension: 2, actions: [\"displacing\"]",
            "states[2].behaviour.dimension",
            "of dimension 1",
        ),
        (
            "name: \"task\", goal: \"task\"",
            "name: \"task\", goal: \"follow\"",
            "states[2].behaviour.purpose",
            "is for tracking",
        ),
        (
            "name: \"task\"",
            "name: \"home\"",
            "states[7].name",
            "rename one",
        ),
        (
            "name: \"task\"",
            "name: \"a task\"",
            "states[2].name",
            "is no name",
        ),
        (
            "goal: \"hold\", part: \"keeps\"",
            "goal: \"hold\", part: \"ends\"",
            "states[0]",
            "does not obey the operator first",
        ),
    ] {
        let whole = text("coverage");
        assert!(whole.contains(old), "{old}");
        let said = parse("d.json5", &whole.replacen(old, new, 1)).map(drop);
        let said = said.expect_err(new).to_string();
        assert!(said.contains(place), "{new}: {said}");
        assert!(said.contains(remedy), "{new}: {said}");
        assert!(said.contains("d.json5:"), "{new}: {said}");
    }
}

#[test]
fn pictures_name_every_state_and_every_event_and_are_the_same_twice() {
    for name in names() {
        let diagram = builtin(name).unwrap();
        for format in Format::ALL {
            let drawn = picture(&diagram, format);
            assert_eq!(drawn, picture(&diagram, format), "{name}");
            for state in &diagram.states {
                assert!(drawn.contains(&state.name), "{name}: {}", state.name);
            }
            for t in &diagram.transitions {
                assert!(drawn.contains(t.on.name()), "{name}: {:?}", t.on);
            }
        }
    }
    let dot = picture(&Diagram::coverage(), Format::Dot);
    assert!(
        dot.contains("\"any state\" -> \"home\" [label=\"3 mission_cancelled\\n4 mission_complete")
    );
}

/// What the inspection does that coverage does not.
#[test]
fn an_inspection_stays_over_the_last_place_and_comes_home() {
    let machine = Machine::new(&builtin("inspection").unwrap()).unwrap();
    let called = |name: &str| {
        machine
            .states()
            .iter()
            .position(|s| s.name == name)
            .unwrap()
    };
    let complete = |on, _| matches!(on, MissionEvent::MissionComplete | MissionEvent::Otherwise);
    let stays = machine.look(called("visit"), &complete);
    assert_eq!(stays, Some((called("stay"), MissionEvent::MissionComplete)));
    let later = |on, s| complete(on, s) || on == MissionEvent::Stayed;
    let (home, by) = machine.look(called("stay"), &later).unwrap();
    assert_eq!(
        (machine.state(home).goal, by),
        (StateGoal::Home, MissionEvent::Stayed)
    );
    assert_eq!(machine.look(home, &complete).unwrap().0, home);
}
