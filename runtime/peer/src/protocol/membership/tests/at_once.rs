//! What is asked for and answered at once, from peer to peer.

use super::*;

/// Peers 2 to 20 are neighbours, and 2 tells of 30, which it hears by itself.
fn among_many_far_apart() -> Membership {
    let mut m = among_nineteen();
    let far = entry(30, 5, 0, None);
    m.on_beacon(Time(2_500), 2, 1, &beacon(11, vec![far]));
    assert_eq!(m.diameter(Time(2_500)), 2);
    m
}

fn at_once(m: &mut Membership, now: Time) -> Vec<(u16, u32, bool)> {
    let told = m.tell_at_once(now, 12);
    let short = |f: &Fresh| (f.id, f.heartbeat, f.suspected_ds.is_some());
    told.iter().map(short).collect()
}

/// What a neighbour says at once of 30, suspected for so long.
fn asked(heartbeat: u32, suspected_ds: Option<u16>) -> Vec<Fresh> {
    let fresh = Fresh {
        heartbeat,
        age_ds: 60,
        life: 1,
        suspected_ds,
        ..samples::fresh(30)
    };
    vec![fresh]
}

/// The same of another, which is two hops from here.
fn asked_of(id: u16, suspected_ds: u16) -> Fresh {
    Fresh {
        id,
        hops: 1,
        ..asked(5, Some(suspected_ds))[0]
    }
}

/// Peer 3 asks for a heartbeat of 30 later than one that is older than what is known here.
fn asked_by_3() -> Membership {
    let mut m = among_many_far_apart();
    m.on_others(Time(3_000), 3, &asked(4, Some(20)));
    m
}

#[test]
fn a_suspicion_is_asked_about_at_once_from_a_third_of_its_time_on() {
    let mut m = among_many_far_apart();
    let now = Time(3_000);
    let verdict_ms = m.patience(now).verdict_ms(1_000);
    assert_eq!(verdict_ms, 5_500);
    m.on_others(now, 3, &asked(5, Some(10)));
    assert_eq!(m.status(30), Some((1, Status::Suspect)));
    assert!(!m.take_question(), "gossip has time");
    let mut asked_at = Vec::new();
    for t in 1..24 {
        let now = now.plus_ms(t * 250);
        for id in 2..=20 {
            m.on_heartbeat(now, id, 1, (100 + t as u32, 4));
        }
        m.tick(now);
        if m.take_question() {
            assert_eq!(at_once(&mut m, now), [(30, 5, true)]);
            asked_at.push(t * 250 + 1_000);
        }
    }
    assert_eq!(asked_at, [2_000, 2_750, 3_750, 4_750]);
    assert_eq!(m.status(30), Some((1, Status::Down)));
}

#[test]
fn who_knows_a_later_heartbeat_answers_at_once_and_once_in_two_intervals() {
    let mut m = among_many_far_apart();
    m.on_others(Time(3_000), 3, &asked(4, Some(10)));
    assert!(m.question_at().is_none(), "gossip has time");
    m.on_others(Time(3_000), 3, &asked(4, Some(20)));
    assert!(m.take_question());
    assert_eq!(at_once(&mut m, Time(3_100)), [(30, 5, false)]);
    m.on_others(Time(4_000), 4, &asked(4, Some(30)));
    assert!(!m.take_question() && at_once(&mut m, Time(4_000)).is_empty());
    m.on_others(Time(4_050), 5, &asked(5, None));
    assert!(m.question_at().is_none(), "somebody heard the answer");
    m.on_others(Time(5_100), 4, &asked(4, Some(41)));
    assert!(m.question_at().is_some());
    // Two others say it meanwhile.
    m.on_others(Time(5_150), 5, &asked(5, None));
    assert!(m.question_at().is_some());
    m.on_others(Time(5_200), 6, &asked(5, None));
    assert!(m.question_at().is_none());
}

/// An answer that meets many questions is lost; what is told of a later heartbeat meanwhile, by
/// those who know it anyway, does not say that it was heard.
#[test]
fn an_answer_that_nobody_passes_on_is_said_twice_more() {
    let mut m = asked_by_3();
    assert_eq!(at_once(&mut m, Time(3_100)), [(30, 5, false)]);
    assert_eq!(m.question_at(), Some(Time(4_100)));
    assert!(at_once(&mut m, Time(4_099)).is_empty());
    assert_eq!(at_once(&mut m, Time(4_100)), [(30, 5, false)]);
    m.on_others(Time(4_500), 5, &asked(7, None));
    assert_eq!(m.question_at(), Some(Time(5_100)));
    assert_eq!(at_once(&mut m, Time(5_100)), [(30, 7, false)]);
    assert_eq!(m.question_at(), None);
}

/// Of several who pass an answer on, none says it again.
#[test]
fn an_answer_heard_once_before_it_is_said_is_not_said_again() {
    let mut m = asked_by_3();
    m.on_others(Time(3_050), 5, &asked(5, None));
    assert_eq!(at_once(&mut m, Time(3_100)), [(30, 5, false)]);
    assert_eq!(m.question_at(), None);
}

/// A question goes towards the one asked for, and an answer away from there: who says the same on
/// the other side is not heard by those who wait for this peer's word.
#[test]
fn what_is_said_by_those_who_are_elsewhere_is_said_all_the_same() {
    // 30 is two hops from here.
    let told = |heartbeat, suspected_ds, hops| {
        let fresh = asked(heartbeat, suspected_ds)[0];
        vec![Fresh { hops, ..fresh }]
    };
    for (hops, waits) in [(1, false), (2, false), (3, true)] {
        let mut m = among_many_far_apart();
        m.on_others(Time(3_000), 3, &asked(5, Some(20)));
        assert!(m.take_question());
        m.on_others(Time(3_050), 5, &told(5, Some(20), hops));
        m.on_others(Time(3_060), 6, &told(5, Some(20), hops));
        assert_eq!(m.question_at().is_some(), waits, "asked by {hops} hops");
    }
    for (hops, waits) in [(1, true), (2, false), (3, false)] {
        let mut m = asked_by_3();
        m.on_others(Time(3_050), 5, &told(5, None, hops));
        m.on_others(Time(3_060), 6, &told(5, None, hops));
        assert_eq!(m.question_at().is_some(), waits, "answered by {hops} hops");
        let mut m = asked_by_3();
        assert_eq!(at_once(&mut m, Time(3_100)), [(30, 5, false)]);
        m.on_others(Time(3_200), 5, &told(5, None, hops));
        assert_eq!(
            m.question_at().is_some(),
            waits,
            "said again by {hops} hops"
        );
    }
}

/// Each transmission that arrives brings all that is waited for; none is sent for that alone.
#[test]
fn with_what_is_said_at_once_goes_what_was_said_and_is_waited_for() {
    let mut m = asked_by_3();
    assert_eq!(at_once(&mut m, Time(3_100)), [(30, 5, false)]);
    // Of 31 a later heartbeat is asked for; 30 was answered for, and nobody passed that on.
    m.on_others(Time(3_200), 3, &[asked_of(31, 20)]);
    assert_eq!(
        at_once(&mut m, Time(3_300)),
        [(30, 5, false), (31, 5, true)]
    );
    // The answer is due all the same when it was to be said again, and what was asked goes along.
    assert!(at_once(&mut m, Time(4_099)).is_empty());
    assert_eq!(
        at_once(&mut m, Time(4_100)),
        [(30, 5, false), (31, 5, true)]
    );
}

/// The answer tells a heartbeat that is old itself, so that a later one is asked for.
#[test]
fn who_is_answered_for_and_asked_for_is_told_of_once() {
    let mut m = among_many_far_apart();
    for t in 3..=11 {
        let said = Beacon {
            eccentricity: 2,
            ..beacon(100 + t as u32, Vec::new())
        };
        for id in 2..=20 {
            m.on_beacon(Time(t * 1_000), id, 1, &said);
        }
    }
    m.tick(Time(11_000));
    assert_eq!(
        at_once(&mut m, Time(11_050)),
        [(30, 5, false)],
        "is asked for"
    );
    m.on_others(Time(11_100), 3, &asked(4, Some(20)));
    assert_eq!(
        at_once(&mut m, Time(11_150)),
        [(30, 5, false)],
        "is answered for"
    );
    m.on_others(Time(11_200), 3, &[asked_of(31, 20)]);
    let told = at_once(&mut m, Time(11_250));
    assert_eq!(told, [(30, 5, false), (31, 5, true)]);
}

#[test]
fn of_those_who_are_asked_for_the_eight_most_urgent_go_with_what_is_said_at_once() {
    let ids = |m: &mut Membership, now| -> Vec<u16> {
        at_once(m, now).iter().map(|said| said.0).collect()
    };
    let mut m = among_many_far_apart();
    let suspected = (31..).zip([45, 20, 22, 28, 34, 40, 44, 30, 36, 43, 27]);
    let others: Vec<Fresh> = suspected.map(|(id, ds)| asked_of(id, ds)).collect();
    m.on_others(Time(3_000), 3, &others);
    assert_eq!(ids(&mut m, Time(3_050)), (31..=41).collect::<Vec<u16>>());
    m.on_others(Time(3_100), 3, &[asked_of(42, 20)]);
    assert_eq!(
        ids(&mut m, Time(3_150)),
        [31, 34, 35, 36, 37, 38, 39, 40, 42]
    );
}

/// Peer 3 lost sight of 30 and of 31, and tells old heartbeats of both.
#[test]
fn with_an_answer_go_later_heartbeats_than_a_neighbour_knows() {
    let mut m = among_many_far_apart();
    let of_31 = |count, age_ds| Fresh {
        id: 31,
        heartbeat: count,
        age_ds,
        ..asked(0, None)[0]
    };
    m.on_others(Time(2_600), 4, &[of_31(9, 1)]);
    m.on_others(Time(3_000), 3, &[of_31(2, 40)]);
    assert!(m.question_at().is_none(), "nothing is sent for that alone");
    m.on_others(Time(3_000), 3, &asked(4, Some(20)));
    assert_eq!(
        at_once(&mut m, Time(3_100)),
        [(30, 5, false), (31, 9, false)]
    );
}

/// Whoever is nearer to the one asked for asks, and tells the others.
#[test]
fn who_is_farther_asks_later() {
    for (hops, later_ms) in [(0, 0), (1, 0), (2, 250), (3, 500), (4, 750), (9, 750)] {
        let mut m = among_many_far_apart();
        let told = Fresh {
            hops,
            ..asked_of(31, 20)
        };
        m.on_others(Time(3_000), 3, &[told]);
        assert!(m.take_question());
        assert_eq!(m.question_at(), Some(Time(3_000 + later_ms)), "{hops} hops");
        if later_ms > 0 {
            assert!(at_once(&mut m, Time(2_999 + later_ms)).is_empty());
        }
        assert_eq!(
            at_once(&mut m, Time(3_000 + later_ms)),
            [(31, 5, true)],
            "{hops} hops"
        );
    }
}

/// Its answer reaches those who are farther first of all.
#[test]
fn a_question_of_one_who_is_nearer_is_heard_once() {
    for (hops, waits) in [(0, false), (1, false), (2, true)] {
        let mut m = among_many_far_apart();
        let told = |hops| {
            let fresh = asked(5, Some(20))[0];
            [Fresh { hops, ..fresh }]
        };
        m.on_others(Time(3_000), 3, &told(4));
        assert!(m.take_question());
        m.on_others(Time(3_050), 5, &told(hops));
        assert_eq!(m.question_at().is_some(), waits, "asked by {hops} hops");
    }
}

/// Peers 30 and 31 were gone for longer than the bound, and 3 tells that 30 is there.
fn one_came_back() -> (Membership, Time) {
    let mut m = among_many_far_apart();
    m.on_others(Time(2_600), 3, &[asked_of(31, 0)]);
    let (mut now, bound_ms) = (Time(2_600), m.bound_ms(Time(2_600)));
    for t in 1..=bound_ms.div_ceil(250) + 10 {
        now = Time(2_600 + t * 250);
        for id in 2..=20 {
            m.on_heartbeat(now, id, 1, (100 + t as u32, 4));
        }
        m.tick(now);
        let _ = (m.take_question(), at_once(&mut m, now));
    }
    for id in [30, 31] {
        assert_eq!(m.status(id), Some((1, Status::Down)));
    }
    m.tick(now);
    assert!(!m.take_question(), "of the dead nobody asks");
    m.on_others(now, 3, &asked(90, None));
    assert_eq!(m.status(30), Some((1, Status::Alive)));
    (m, now)
}

/// Whoever was out of reach comes back with those around it.
#[test]
fn who_is_down_is_asked_for_when_another_comes_back_and_no_verdict_is_told() {
    let (mut m, back) = one_came_back();
    let bound_ms = m.bound_ms(back);
    let mut asked_at = Vec::new();
    for t in 1..(bound_ms + 3_000) / 250 {
        let now = back.plus_ms(t * 250);
        for id in 2..=20 {
            m.on_heartbeat(now, id, 1, (900 + t as u32, 4));
        }
        m.on_others(now, 3, &asked(90 + t as u32, None));
        m.tick(now);
        if m.take_question() {
            assert_eq!(at_once(&mut m, now), [(31, 5, false)]);
            asked_at.push(t * 250);
        }
    }
    assert!(asked_at.len() > 3 && asked_at[0] == 250, "{asked_at:?}");
    assert!(asked_at.windows(2).all(|two| two[1] - two[0] == 3_000));
    assert!(asked_at.iter().all(|ms| *ms < bound_ms), "{asked_at:?}");
}

#[test]
fn who_was_asked_for_and_is_there_is_told_of_at_once() {
    let later = Fresh {
        heartbeat: 80,
        age_ds: 5,
        suspected_ds: None,
        ..asked_of(31, 0)
    };
    let (mut m, back) = one_came_back();
    m.tick(back.plus_ms(250));
    assert!(m.take_question());
    m.on_others(back.plus_ms(300), 3, &[later]);
    assert_eq!(m.status(31), Some((1, Status::Alive)));
    assert!(m.take_question());
    assert_eq!(at_once(&mut m, back.plus_ms(400)), [(31, 80, false)]);
    m.tick(back.plus_ms(500));
    assert!(!m.take_question());
}

/// Where all hear each other nobody asks, but who was away for longer than the bound may ask.
#[test]
fn who_holds_one_for_down_that_is_heard_here_is_answered_at_once_though_all_are_near() {
    for (age_ds, answers) in [(100, false), (400, true)] {
        let mut m = among_nineteen();
        let now = Time(2_500);
        assert!(!m.is_far(now) && (10_001..40_000).contains(&m.bound_ms(now)));
        let held = Fresh {
            id: 4,
            age_ds,
            ..asked(3, None)[0]
        };
        m.on_others(now, 3, &[held]);
        assert_eq!(m.question_at().is_some(), answers, "{age_ds}");
    }
}

#[test]
fn an_answer_is_passed_on_by_who_asked_and_tells_nothing_of_how_far_somebody_is() {
    let mut m = among_many_far_apart();
    m.on_others(Time(3_000), 3, &asked(5, Some(20)));
    assert!(m.take_question());
    let answer = Fresh {
        hops: 7,
        ..asked(9, None)[0]
    };
    m.on_others(Time(3_100), 4, &[answer]);
    assert_eq!(m.status(30), Some((1, Status::Alive)));
    assert_eq!(m.diameter(Time(3_100)), 2);
    assert_eq!(at_once(&mut m, Time(3_200)), [(30, 9, false)]);
    m.on_others(Time(3_250), 5, &asked(9, None));
    // Who did not ask passes nothing on: gossip does.
    m.on_others(Time(3_300), 4, &asked(12, None));
    assert!(m.question_at().is_none());
}

#[test]
fn a_heartbeat_older_than_six_tenths_of_the_bound_is_asked_for_at_once() {
    let mut m = among_many_far_apart();
    let bound_ms = m.bound_ms(Time(2_500));
    let mut asked_at = Vec::new();
    for t in 1..bound_ms / 250 {
        let now = Time(2_500 + t * 250);
        for id in 2..=20 {
            let said = Beacon {
                eccentricity: 2,
                ..beacon(100 + t as u32, Vec::new())
            };
            m.on_beacon(now, id, 1, &said);
        }
        m.tick(now);
        if m.take_question() {
            assert_eq!(at_once(&mut m, now), [(30, 5, false)]);
            asked_at.push(t * 250);
        }
    }
    let parts = asked_at.iter().map(|ms| ms * 10 / bound_ms);
    assert_eq!(parts.collect::<Vec<_>>(), [6, 7, 8, 9]);
}

/// A beacon has room for all of a few, and where a link is about to end it is lost for seconds,
/// when a heartbeat that is half as long gets through.
#[test]
fn among_few_it_is_asked_at_once_too_and_where_all_hear_all_it_is_not() {
    let mut few = Membership::new(1, 1000);
    few.on_beacon(Time(0), 2, 1, &beacon(1, vec![entry(30, 5, 0, None)]));
    let mut near = among_nineteen();
    near.on_beacon(Time(2_500), 30, 1, &beacon(5, Vec::new()));
    for (m, asks) in [(&mut few, true), (&mut near, false)] {
        m.on_others(Time(3_000), 2, &asked(5, Some(20)));
        assert_eq!(m.status(30), Some((1, Status::Suspect)));
        assert_eq!(m.question_at().is_some(), asks);
    }
}

/// Of the diameter is known after ten intervals alone that somebody flew out of earshot.
#[test]
fn who_suspects_one_that_others_hear_is_answered_at_once_though_all_were_near() {
    let of_4 = |heartbeat| Fresh {
        id: 4,
        heartbeat,
        ..asked(0, Some(30))[0]
    };
    for (counts, is_far) in [((12, 11), true), ((12, 12), false)] {
        let (known, told) = counts;
        let mut m = among_nineteen();
        m.on_heartbeat(Time(3_000), 4, 1, (known, 4));
        m.on_others(Time(3_500), 3, &[of_4(told)]);
        assert_eq!(m.diameter(Time(3_500)), 1);
        assert_eq!(m.is_far(Time(3_500)), is_far, "{counts:?}");
        if is_far {
            assert_eq!(at_once(&mut m, Time(3_600)), [(4, 12, false)]);
            // So it is for six intervals.
            assert!(m.is_far(Time(9_499)) && !m.is_far(Time(9_500)));
        }
    }
}

#[test]
fn whose_own_suspicion_others_refute_is_far_from_somebody() {
    let of_4 = Fresh {
        id: 4,
        suspected_ds: None,
        ..asked(40, None)[0]
    };
    for (silent, is_far) in [(true, true), (false, false)] {
        let mut m = among_nineteen();
        let mut now = Time(2_500);
        for t in 1..24 {
            now = Time(2_500 + t * 250);
            for id in (2..=20).filter(|id| !silent || *id != 4) {
                m.on_heartbeat(now, id, 1, (10 + t as u32, 4));
            }
            m.tick(now);
        }
        assert_eq!(m.status(4).map(|s| s.1 == Status::Suspect), Some(silent));
        m.on_others(now, 3, &[of_4]);
        assert_eq!(m.status(4), Some((1, Status::Alive)));
        assert_eq!(m.is_far(now), is_far);
        assert_eq!(
            m.tell(now, 4, &BTreeSet::new()).1.len() > 1,
            is_far,
            "heartbeats of others"
        );
    }
}
