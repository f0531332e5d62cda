//! Missions by diagrams of their own: what follows when all is seen, when the time is over, when
//! a peer is lost.

use super::crowds::{self, SECTOR};
use super::{add, covered, point, record, with_operator};
use crate::diagram::{
    Action, Behaviour, Diagram, MissionEvent, Part, Purpose, State, StateGoal, Transition,
};
use crate::input::{Command, NewTask};
use crate::mission::Mission;
use crate::output::{Status, TaskNews};
use crate::testing::{GROUND_STATION, Harness, mission};
use crate::why::{Reason, Work};
use crate::wire::codec::Body;
use crate::wire::message::Finished;
use crate::{Input, Report};
use std::sync::Arc;

/// The default diagram with one more state, reached from any on this event, which counts next
/// after a mission that was cancelled.
fn with(name: &str, goal: StateGoal, part: Part, (on, after_s): (MissionEvent, u32)) -> Diagram {
    let mut diagram = Diagram::coverage();
    let (purpose, actions) = match goal {
        StateGoal::Home => (
            Purpose::Traveling,
            vec![Action::Displacing, Action::Loitering],
        ),
        _ => (Purpose::Tracking, vec![Action::Loitering]),
    };
    let keeps = purpose == Purpose::Tracking;
    diagram.states.push(State {
        name: name.into(),
        behaviour: Behaviour {
            purpose,
            dimension: Some(if keeps { 0 } else { 1 }),
            closed: keeps,
            endless: keeps,
            actions,
        },
        goal,
        part,
    });
    for t in &mut diagram.transitions {
        t.priority *= 10;
    }
    diagram.transitions.push(Transition {
        from: None,
        on,
        after_s,
        above_dmps: 0,
        to: name.into(),
        // Before all is seen, and where it leads elsewhere than home after the fuel.
        priority: if keeps { 65 } else { 35 },
    });
    diagram
}

/// The same, watching: for a mission of several laps.
fn watching(mut diagram: Diagram) -> Diagram {
    for state in &mut diagram.states {
        if state.goal == StateGoal::Section {
            state.behaviour.purpose = Purpose::Watching;
            (state.behaviour.closed, state.behaviour.endless) = (true, true);
        }
    }
    diagram
}

/// The default diagram of a mission that goes round once everything is seen, until a timer.
pub(super) fn rounds(after_s: u32) -> Diagram {
    let over = (MissionEvent::Timer, after_s);
    let mut diagram = with("over", StateGoal::Home, Part::Ends, over);
    diagram
        .transitions
        .retain(|t| t.on != MissionEvent::MissionComplete);
    diagram.states.push(State {
        name: "watch".into(),
        behaviour: Behaviour {
            purpose: Purpose::Watching,
            dimension: None,
            closed: true,
            endless: true,
            actions: vec![Action::Displacing],
        },
        goal: StateGoal::Round,
        part: Part::Takes,
    });
    diagram.transitions.push(Transition {
        from: None,
        on: MissionEvent::AllSeen,
        after_s: 0,
        above_dmps: 0,
        to: "watch".into(),
        priority: 105,
    });
    diagram
}

fn flown_by(diagram: Diagram, laps: u16) -> Mission {
    Mission {
        further_laps: laps - 1,
        diagram: Some(Arc::new(diagram)),
        ..mission(1, 6, 4)
    }
}

fn patrol(after_s: u32) -> Mission {
    let over = (MissionEvent::Timer, after_s);
    let over = with("over", StateGoal::Home, Part::Ends, over);
    flown_by(watching(over), 100)
}

/// What a peer says whose mission is finished.
fn says_finished() -> Vec<u8> {
    record(9, 1, 1, 0, &Body::Finished(Finished { revision: 1 }))
}

fn work(h: &Harness, id: u16) -> Work {
    h.why(id).work.unwrap()
}

#[test]
fn a_mission_ends_by_its_timer_whatever_is_seen() {
    let mut h = with_operator(2, patrol(70));
    h.run_s(65);
    assert_eq!(work(&h, 1).state, "section");
    assert!(!h.beliefs(1).finished && !h.beliefs(1).plan.is_empty());
    assert!(h.run_until(25, |h| h.beliefs(1).finished && h.beliefs(2).finished));
    h.run_s(2);
    for id in [1, 2] {
        let (view, work) = (h.beliefs(id), work(&h, id));
        assert!(view.plan.is_empty() && !view.able, "{view:?}");
        assert_eq!(
            (work.state.as_str(), work.reason),
            ("over", Reason::TimeIsOver)
        );
        let finished = h.seat(id).reports.iter();
        let finished = finished.filter(|(_, r)| matches!(r, Report::Finished { .. }));
        assert_eq!(finished.count(), 1);
    }
    let told = h.why(1).to_string();
    assert!(
        told.contains("flies home: the time of its mission is over"),
        "{told}"
    );
    assert!(
        told.contains("state     over of the diagram coverage, for"),
        "{told}"
    );
    let away = |h: &Harness| {
        let at = h.pose(1);
        (at.east_m + 60.0).hypot(at.north_m + 60.0)
    };
    assert!(h.run_until(120, |h| away(h) < 60.0), "{}", away(&h));
}

/// Storm `downtown` 922003: four who were recalled and cut off knew nobody who could follow the
/// lorry, took the mission for done, and once they were heard again it was over for all, after 67
/// of 600 s.
#[test]
fn what_nobody_can_do_ends_no_mission_before_its_time() {
    let over = (MissionEvent::Timer, 250);
    let mission = flown_by(with("over", StateGoal::Home, Part::Ends, over), 1);
    let mut h = with_operator(2, mission);
    let heat = NewTask {
        sensor: 2,
        ..point("heat", 100.0, 100.0)
    };
    h.run_s(15);
    add(&mut h, heat);
    let is_covered = |h: &Harness| [1, 2].iter().all(|id| covered(h, *id) == 24);
    assert!(h.run_until(200, is_covered));
    h.run_s(20);
    let finished = |h: &Harness, id: u16| h.beliefs(id).finished;
    assert!(!finished(&h, 1) && !finished(&h, 2) && h.now_ms() < 245_000);
    assert!(h.run_until(250, |h| finished(h, 1) && finished(h, 2)));
    assert_eq!(work(&h, 1).reason, Reason::TimeIsOver);
}

#[test]
fn what_the_mission_leads_nobody_to_is_let_go_and_that_is_said() {
    let mut h = with_operator(1, patrol(40));
    h.run_s(34);
    add(&mut h, point("gate", 2_000.0, 2_000.0));
    assert!(h.run_until(5, |h| work(h, 1).reason == Reason::Task));
    // The time of the mission is over before it is there.
    assert!(h.run_until(30, |h| work(h, 1).reason == Reason::TimeIsOver));
    h.run_s(3);
    assert_eq!(h.beliefs(1).tasks, []);
    assert!(h.beliefs(1).finished);
    let led_off = |(_, r): &(u64, Report)| matches!(r, Report::Task { news: TaskNews::NobodyCan(why), .. } if why.contains("leads no UAV"));
    let said = h.seat(1).reports.iter().filter(|r| led_off(r)).count();
    assert_eq!(said, 1);
}

#[test]
fn once_all_is_seen_they_fly_round_evenly_spaced_until_the_time_is_over() {
    let mut h = with_operator(2, flown_by(rounds(600), 1));
    h.run_s(10);
    let watches = |h: &Harness, id| work(h, id).state == "watch";
    assert!(h.run_until(300, |h| watches(h, 1) && watches(h, 2)));
    h.run_s(5);
    let full = |h: &Harness, id| h.beliefs(id).covered.is_full();
    assert!(full(&h, 1) && full(&h, 2));
    for id in [1, 2] {
        let (view, work) = (h.beliefs(id), work(&h, id));
        assert!(
            !view.finished && view.able && view.plan.is_empty(),
            "{view:?}"
        );
        assert_eq!(work.reason, Reason::AllSeen);
        assert!(
            work.does.starts_with("flies round, evenly spaced"),
            "{}",
            work.does
        );
        assert!(
            work.does.contains("m ahead and the last one"),
            "{}",
            work.does
        );
    }
    let at = h.pose(1);
    let away = |h: &Harness| (h.pose(1).east_m - at.east_m).hypot(h.pose(1).north_m - at.north_m);
    assert!(h.run_until(60, |h| away(h) > 100.0), "{}", away(&h));
    assert!(h.run_until(600, |h| h.beliefs(1).finished && h.beliefs(2).finished));
    assert_eq!(work(&h, 1).state, "over");
}

#[test]
fn a_mission_that_goes_round_is_checked() {
    let laps = flown_by(rounds(600), 3).machine().unwrap_err();
    assert!(laps.problem.contains("leave the laps out"), "{laps}");
    let apart = Mission {
        separation_mm: 50_000,
        ..flown_by(rounds(600), 1)
    };
    let apart = apart.machine().unwrap_err();
    assert!(
        apart.problem.contains("leave the separation out"),
        "{apart}"
    );
    let mut elsewhere = rounds(600);
    let t = elsewhere.transitions.last_mut().unwrap();
    t.on = MissionEvent::PeerLost;
    let elsewhere = flown_by(elsewhere, 1).machine().unwrap_err();
    assert!(elsewhere.problem.contains("\"all_seen\""), "{elsewhere}");
    assert!(flown_by(rounds(600), 1).goes_round() && !mission(1, 6, 4).goes_round());
}

#[test]
fn who_comes_back_hears_that_the_time_is_over() {
    let mut h = with_operator(2, patrol(70));
    h.run_s(85);
    assert!(h.beliefs(1).finished);
    h.stop(2);
    h.run_s(2);
    h.start(2);
    assert!(
        h.run_until(30, |h| h.beliefs(2).finished),
        "its own timer is at 0"
    );
    assert_eq!(work(&h, 2).state, "over");
}

/// Without a timer that ends the mission, who says finished says what it saw.
#[test]
fn without_a_timer_nobody_ends_a_mission_for_another() {
    let mut h = with_operator(1, mission(1, 6, 4));
    h.run_s(20);
    h.inject(1, says_finished());
    h.run_s(5);
    assert!(!h.beliefs(1).finished);
    let mut h = with_operator(1, patrol(700));
    h.run_s(20);
    h.inject(1, says_finished());
    assert!(h.run_until(5, |h| h.beliefs(1).finished));
}

#[test]
fn all_stay_where_they_are_when_all_is_seen_if_the_mission_says_so() {
    let mut diagram = with(
        "stay",
        StateGoal::Hold,
        Part::Takes,
        (MissionEvent::MissionComplete, 0),
    );
    diagram
        .transitions
        .retain(|t| t.on != MissionEvent::MissionComplete || t.to == "stay");
    let mut h = with_operator(1, flown_by(diagram, 1));
    assert!(h.run_until(300, |h| h.beliefs(1).finished));
    h.run_s(10);
    let at = h.pose(1);
    h.run_s(60);
    let moved_m = (h.pose(1).east_m - at.east_m).hypot(h.pose(1).north_m - at.north_m);
    assert!(moved_m < 60.0, "{moved_m} m");
    assert_eq!(
        work(&h, 1).does,
        "loiters where it is: everything is covered"
    );
    // The fuel leads home all the same.
    h.seat(1).fuel_s = 70.0;
    assert!(h.run_until(5, |h| work(h, 1).reason == Reason::FuelIsDue));
    assert_eq!(work(&h, 1).state, "home");
}

#[test]
fn who_loses_a_peer_comes_home_until_it_is_back_if_the_mission_says_so() {
    let lost = (MissionEvent::PeerLost, 0);
    let diagram = with("gather", StateGoal::Home, Part::Releases, lost);
    let mut h = with_operator(3, flown_by(diagram, 1));
    h.run_s(20);
    assert_eq!(work(&h, 1).state, "section");
    h.isolate(3, true);
    assert!(h.run_until(60, |h| work(h, 1).state == "gather"));
    assert_eq!(work(&h, 1).reason, Reason::PeerLost);
    assert!(h.run_until(3, |h| h.beliefs(1).plan.is_empty() && !h.beliefs(1).able));
    h.isolate(3, false);
    assert!(h.run_until(60, |h| work(h, 1).state == "section"));
}

#[test]
fn who_came_home_for_a_wind_goes_on_once_it_is_a_metre_a_second_weaker() {
    let windy = (MissionEvent::WindAbove, 0);
    let mut diagram = with("shelter", StateGoal::Home, Part::Releases, windy);
    let last = diagram.transitions.last_mut().unwrap();
    last.above_dmps = 35;
    // After the fuel, which leads home too.
    last.priority = 65;
    let mut h = with_operator(1, flown_by(diagram, 1));
    h.run_s(20);
    for (wind_mps, state) in [
        (3.4, "section"),
        (3.7, "shelter"),
        (3.4, "shelter"),
        (2.6, "shelter"),
        (2.4, "section"),
        (3.4, "section"),
    ] {
        h.seat(1).wind_mps = (0.6 * wind_mps, -0.8 * wind_mps);
        h.run_s(8);
        assert_eq!(work(&h, 1).state, state, "{wind_mps} m/s");
    }
}

#[test]
fn one_of_those_who_were_lost_is_back() {
    let mut diagram = with(
        "gather",
        StateGoal::Home,
        Part::Releases,
        (MissionEvent::PeerLost, 0),
    );
    let back = Transition {
        from: Some("gather".into()),
        on: MissionEvent::PeerBack,
        after_s: 0,
        above_dmps: 0,
        to: "home".into(),
        priority: 33,
    };
    // Whoever covers gathers, and stays until somebody is back.
    let mut stays = diagram.transitions.pop().unwrap();
    for from in ["section", "gather"] {
        stays.from = Some(from.into());
        diagram.transitions.push(stays.clone());
    }
    diagram.transitions.push(back);
    let large = Mission {
        diagram: Some(Arc::new(diagram)),
        ..mission(1, 14, 8)
    };
    let mut h = with_operator(4, large);
    h.run_s(30);
    h.isolate(3, true);
    h.isolate(4, true);
    assert!(h.run_until(60, |h| work(h, 1).state == "gather"));
    h.run_s(20);
    assert_eq!(work(&h, 1).state, "gather");
    // The other one is still away.
    h.isolate(3, false);
    h.isolate(4, true);
    assert!(h.run_until(60, |h| work(h, 1).state != "gather"));
    let down = |h: &Harness| {
        h.beliefs(1)
            .peers
            .values()
            .filter(|(_, s)| *s == Status::Down)
            .count()
    };
    assert_eq!(down(&h), 1);
}

#[test]
fn a_mission_may_ask_for_what_follows_when_a_part_of_it_is_beyond_everybody() {
    let beyond = (MissionEvent::PlanInfeasible, 0);
    let diagram = with("short", StateGoal::Home, Part::Ends, beyond);
    let mut h = with_operator(1, flown_by(diagram, 1));
    h.seat(1).fuel_s = 130.0;
    h.run_s(3);
    assert!(h.run_until(60, |h| work(h, 1).reason == Reason::Infeasible));
    h.run_s(2);
    assert!(h.beliefs(1).finished && h.beliefs(1).plan.is_empty());
}

#[test]
fn a_mission_whose_diagram_cannot_be_flown_leaves_the_old_one_in_force() {
    let mut h = with_operator(1, mission(1, 6, 4));
    h.run_s(10);
    let mut diagram = Diagram::coverage();
    diagram
        .transitions
        .retain(|t| t.on != MissionEvent::LowFuel);
    let wrong = Mission {
        diagram: Some(Arc::new(diagram)),
        ..mission(2, 6, 4)
    };
    h.feed(
        GROUND_STATION,
        Input::Command(Command::Mission(Arc::new(wrong))),
    );
    h.run_s(10);
    assert_eq!(h.beliefs(1).revision, 1);
    let alarms = h.alarms(1);
    assert!(alarms.iter().any(|a| a.contains("low_fuel")), "{alarms:?}");
}

/// Which states a diagram has is part of what a mission is.
#[test]
fn a_diagram_travels_with_its_mission_and_counts_in_its_hash() {
    let plain = mission(1, 6, 4);
    let same = flown_by(Diagram::coverage(), 1);
    assert_ne!(plain.content_hash(), same.content_hash());
    let mut renamed = Diagram::coverage();
    renamed.states[0].part = Part::Keeps;
    assert_ne!(same.content_hash(), flown_by(renamed, 1).content_hash());
    let mut h = with_operator(1, mission(1, 6, 4));
    h.run_s(5);
    let later = Mission {
        revision: 2,
        ..same
    };
    let command = Command::Mission(Arc::new(later.clone()));
    h.feed(GROUND_STATION, Input::Command(command));
    assert!(h.run_until(20, |h| h.beliefs(1).revision == 2));
    assert_eq!(h.newest_mission(1).as_deref(), Some(&later));
}

#[test]
fn a_diagram_that_asks_for_something_else_than_the_mission_is_refused() {
    let once = flown_by(Diagram::coverage(), 3).machine().unwrap_err();
    assert!(once.problem.contains("flown once"), "{once}");
    let watch = flown_by(watching(Diagram::coverage()), 1)
        .machine()
        .unwrap_err();
    assert!(watch.problem.contains("ask for laps"), "{watch}");
    let mut lines = Diagram::coverage();
    lines.states[1].behaviour.dimension = Some(1);
    let lines = flown_by(lines, 1).machine().unwrap_err();
    assert_eq!(lines.place, "states[1].behaviour.dimension");
    assert!(mission(1, 6, 4).machine().is_ok());
}

/// A diagram by which all leave the patrol where the crowd is too dense, and come back to it.
#[test]
fn the_patrol_is_left_while_the_crowd_is_too_dense() {
    let dense = (MissionEvent::CrowdDense, 0);
    let mut diagram = with("clear", StateGoal::Hold, Part::Keeps, dense);
    let round = rounds(900);
    diagram
        .transitions
        .retain(|t| t.on != MissionEvent::MissionComplete);
    let watch = round.states.iter().filter(|s| s.name == "watch");
    diagram.states.extend(watch.cloned());
    let all_seen = round.transitions.iter();
    let all_seen = all_seen.filter(|t| t.on == MissionEvent::AllSeen);
    diagram.transitions.extend(all_seen.cloned());
    diagram.transitions.push(Transition {
        from: None,
        on: MissionEvent::Timer,
        after_s: 900,
        above_dmps: 0,
        to: "home".into(),
        priority: 36,
    });
    let mission = Mission {
        crowd: crowds::watch(crate::crowd::ThenWatch::Notify, 1),
        ..flown_by(diagram, 1)
    };
    let mut h = with_operator(2, mission.clone());
    let is_in = |h: &Harness, state: &str| [1, 2].iter().all(|id| work(h, *id).state == state);
    h.run_s(10);
    assert!(h.run_until(300, |h| is_in(h, "watch")));
    crowds::tell(&mut h, &mission, (SECTOR, true));
    assert!(h.run_until(5, |h| is_in(h, "clear")));
    h.run_s(20);
    assert!(is_in(&h, "clear"), "{}", h.why(1));
    let told = h.why(1).to_string();
    assert!(told.contains("too dense"), "{told}");
    crowds::tell(&mut h, &mission, (SECTOR, false));
    assert!(h.run_until(5, |h| is_in(h, "watch")));
}
