//! One failure detector, step by step.

use super::*;
use crate::wire::samples;

mod at_once;

impl Membership {
    /// Whole entries of others: at most `max`.
    pub(super) fn gossip(&mut self, now: Time, max: usize) -> Vec<Gossip> {
        let moment = self.moment(now);
        self.telling
            .whole(&mut self.known, moment, max, &BTreeSet::new())
    }

    fn measured(&self, now: Time) -> Extent {
        Extent::measured(self.living(), self.interval, self.period_ms, now)
    }
}

fn beacon(heartbeat: u32, gossip: Vec<Gossip>) -> Beacon {
    Beacon {
        gossip,
        ..samples::beacon(heartbeat)
    }
}

#[test]
fn silence_leads_to_suspicion_and_then_to_a_verdict() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
    let mut seen = Vec::new();
    for t in 0..80 {
        for c in m.tick(Time(t * 250)) {
            seen.push((t * 250, c.status));
        }
        m.gossip(Time(t * 250), 1);
    }
    assert_eq!(seen, [(4250, Status::Suspect), (8750, Status::Down)]);
    assert!(8750 <= m.patience(Time(20_000)).bound_ms);
}

#[test]
fn of_whom_a_record_alone_was_heard_others_are_told_as_of_the_dead() {
    let mut m = Membership::new(1, 1000);
    m.on_record(Time(0), (2, 5), 3);
    m.on_record(Time(0), (3, 5), 3);
    m.on_record(Time(0), (1, 5), 0);
    let bound_ms = m.patience(Time(0)).bound_ms;
    let told_of = |m: &mut Membership, t: u64| {
        let told = m.gossip(Time(t), 4);
        let told: BTreeSet<_> = told.iter().map(|g| (g.id, g.incarnation)).collect();
        told
    };
    assert_eq!(m.tick(Time(bound_ms)), []);
    assert!(told_of(&mut m, bound_ms).is_empty());
    // The one of them speaks in time.
    m.on_heartbeat(Time(bound_ms), 3, 5, (1, 4));
    assert_eq!(m.tick(Time(bound_ms + 250)), []);
    let both = BTreeSet::from([(2, 5), (3, 5)]);
    assert_eq!(told_of(&mut m, bound_ms + 250), both);
    assert_eq!(m.live().map(|(id, _)| id).collect::<Vec<_>>(), [3]);
    // Neighbours take it for dead, and the one itself is heard all the same.
    let mut other = Membership::new(4, 1000);
    let told = m.gossip(Time(bound_ms + 250), 4);
    other.on_beacon(Time(bound_ms + 250), 1, 1, &beacon(1, told.clone()));
    assert_eq!(other.all().filter(|(id, ..)| *id == 2).count(), 1);
    assert!(other.live().all(|(id, _)| id != 2));
    // So does who waits for longer than the one that tells of it.
    let mut patient = Membership::new(5, 16_000);
    assert!(patient.patience(Time(0)).bound_ms > 2 * bound_ms);
    patient.on_beacon(Time(bound_ms + 250), 1, 1, &beacon(1, told));
    assert_eq!(patient.all().filter(|(id, ..)| *id == 2).count(), 1);
    assert!(patient.live().all(|(id, _)| id != 2));
    m.on_heartbeat(Time(bound_ms + 500), 2, 5, (1, 4));
    assert!(m.live().any(|(id, _)| id == 2));
}

#[test]
fn a_link_that_is_gone_halves_the_patience_and_passes_no_verdict() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
    m.link(2, false);
    m.link(77, false);
    let mut seen = Vec::new();
    for t in 0..40 {
        for c in m.tick(Time(t * 250)) {
            seen.push((t * 250, c.status));
        }
        if t == 12 {
            m.on_beacon(Time(t * 250), 2, 1, &beacon(2, Vec::new()));
            m.link(2, true);
        }
    }
    assert_eq!(seen, [(2250, Status::Suspect), (7250, Status::Suspect)]);
}

#[test]
fn an_old_heartbeat_does_not_raise_the_dead() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 1, &beacon(5, Vec::new()));
    for t in 0..80 {
        m.tick(Time(t * 250));
    }
    assert_eq!(m.live().count(), 0);
    let old = Gossip {
        id: 2,
        incarnation: 1,
        heartbeat: 6,
        age_ds: 190,
        hops: 1,
        interval: 4,
        suspected_ds: None,
        able: true,
        max_seq: 0,
        digest: 0,
    };
    let changes = m.on_beacon(Time(20_000), 3, 1, &beacon(9, vec![old]));
    assert!(changes.iter().all(|c| c.peer == 3));
    let fresh = Gossip { age_ds: 5, ..old };
    let changes = m.on_beacon(Time(20_100), 3, 1, &beacon(10, vec![fresh]));
    assert!(changes.contains(&Change {
        peer: 2,
        incarnation: 1,
        status: Status::Alive
    }));
}

#[test]
fn one_s_own_lateness_is_nobody_s_silence_but_the_age_that_is_told_is_true() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
    m.tick(Time(1_000));
    let mut now = Time(3_601_000);
    m.was_late(now, 3_600_000, 3_600_000);
    assert_eq!(m.tick(now), []);
    assert_eq!(m.gossip(now, 1)[0].age_ds, 36_010);
    // From then on it is silent, and known to be down within what is left of the bound;
    // more lateness puts that off.
    m.was_late(now.plus_ms(60_000), 60_000, 60_000);
    now = now.plus_ms(60_000);
    let woke = now;
    while m.status(2) != Some((1, Status::Down)) {
        now = now.plus_ms(250);
        m.tick(now);
        m.gossip(now, 1);
        assert!(now.since_ms(woke) <= 20_000, "the excuse ends");
    }
    let silent_ms = 1_000 + now.since_ms(woke);
    assert!((8_750..=9_000).contains(&silent_ms), "{silent_ms}");
}

/// A neighbour that flew out of sight lives on by what others tell of it: who heard its
/// freshest heartbeat answers for it, not who heard an earlier one.
#[test]
fn only_who_heard_the_freshest_heartbeat_itself_suspects() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
    let told = vec![entry(2, 3, 1, None)];
    m.on_beacon(Time(1_000), 3, 1, &beacon(1, told));
    let mut seen = Vec::new();
    for t in 4..80 {
        let changes = m.tick(Time(t * 250)).into_iter();
        seen.extend(changes.filter(|c| c.peer == 2).map(|c| (t * 250, c.status)));
    }
    // k1, k2 and D are 4.5, 5 and 2 there, then 4.25, 4.5 and 1: no suspicion, the bound.
    assert_eq!(seen, [(12_750, Status::Down)]);
    // Heard itself again, it is answered for again.
    m.on_beacon(Time(21_000), 2, 1, &beacon(9, Vec::new()));
    for t in 84..120 {
        m.tick(Time(t * 250));
        if m.status(2) == Some((1, Status::Suspect)) {
            return assert_eq!(t * 250, 25_250);
        }
    }
    panic!("it is suspected");
}

/// Three neighbours suspect or have given up what this peer heard since: it says so first,
/// and as long as they go on.
#[test]
fn who_is_suspected_elsewhere_and_heard_here_is_told_of_first() {
    let mut m = Membership::new(1, 1000);
    for id in 2..=20 {
        m.on_beacon(Time(0), id, 1, &beacon(5, Vec::new()));
    }
    no_news(&mut m);
    m.take_refuted();
    let first = |m: &mut Membership, now_ms| m.gossip(Time(now_ms), 4)[0].id;
    assert_ne!(first(&mut m, 3_000), 15);
    m.on_beacon(Time(3_100), 3, 1, &beacon(6, vec![entry(15, 4, 50, None)]));
    assert!(!m.take_refuted(), "it is old there, not suspected");
    let disputed = vec![entry(15, 4, 50, Some(3))];
    m.on_beacon(Time(3_200), 3, 1, &beacon(7, disputed.clone()));
    assert!(m.take_refuted());
    assert_eq!([first(&mut m, 3_300), first(&mut m, 4_300)], [15, 15]);
    assert_ne!(first(&mut m, 5_300), 15, "nobody says it any more");
    m.on_beacon(Time(5_400), 3, 1, &beacon(8, disputed));
    assert_eq!(first(&mut m, 5_500), 15);
    // What is suspected here as well is none to speak up for.
    m.take_refuted();
    m.on_beacon(
        Time(5_600),
        4,
        1,
        &beacon(6, vec![entry(16, 5, 56, Some(1))]),
    );
    m.on_beacon(
        Time(5_700),
        3,
        1,
        &beacon(9, vec![entry(16, 4, 60, Some(9))]),
    );
    assert!(!m.take_refuted());
}

fn entry(id: u16, heartbeat: u32, age_ds: u16, suspected_ds: Option<u16>) -> Gossip {
    Gossip {
        id,
        incarnation: 1,
        heartbeat,
        age_ds,
        hops: 1,
        interval: 4,
        suspected_ds,
        able: true,
        max_seq: 0,
        digest: 0,
    }
}

#[test]
fn on_which_loop_somebody_works_its_own_word_tells_before_that_of_others() {
    let on = |loop_hash, heartbeat, gossip| Beacon {
        loop_hash,
        ..beacon(heartbeat, gossip)
    };
    let mut m = Membership::new(1, 1000);
    let tells_of_four = |heartbeat| on(7, heartbeat, vec![entry(4, 20 + heartbeat, 1, None)]);
    let loop_of = |m: &Membership, id| m.info(id).map(|i| i.loop_hash);
    // Who never spoke itself is on the loop of whoever tells that it is able.
    m.on_claim(Time(0), (4, 1), (3, 8));
    m.on_beacon(Time(0), 9, 1, &tells_of_four(1));
    assert_eq!(loop_of(&m, 4), Some(7));
    // Its claim comes over several hops; what others tell says nothing any more.
    let before = m.changes();
    m.on_claim(Time(100), (4, 1), (3, 8));
    assert!(m.changes() > before);
    m.on_beacon(Time(1000), 9, 1, &tells_of_four(2));
    assert_eq!(loop_of(&m, 4), Some(8));
    // Of two words the one that was heard last counts.
    m.on_beacon(Time(1500), 4, 1, &on(7, 30, Vec::new()));
    assert_eq!(loop_of(&m, 4), Some(7));
    m.on_claim(Time(1600), (4, 1), (3, 8));
    assert_eq!(loop_of(&m, 4), Some(8));
    // Claims of another life than the one that is known are none of its.
    m.on_claim(Time(1700), (4, 2), (3, 9));
    m.on_claim(Time(1700), (5, 1), (3, 9));
    assert_eq!((loop_of(&m, 4), loop_of(&m, 5)), (Some(8), None));
}

#[test]
fn who_began_a_life_anew_is_reminded_through_those_who_never_met_the_first() {
    let mut m = Membership::new(6, 1000);
    // The new beginning is heard directly, the old end of the same life from afar.
    m.on_beacon(Time(0), 4, 1, &beacon(3, Vec::new()));
    let from_afar = |heartbeat| beacon(heartbeat, vec![entry(4, 51, 500, None)]);
    m.on_beacon(Time(100), 9, 1, &from_afar(1));
    assert_eq!(m.status(4), Some((1, Status::Alive)));
    let of_four = |m: &mut Membership, max| -> Vec<u32> {
        let told = m.gossip(Time(200), max);
        assert!(told.len() <= max);
        let of_four = told.iter().filter(|g| g.id == 4);
        of_four.map(|g| g.heartbeat).collect()
    };
    assert_eq!(of_four(&mut m, 20), [51, 3]);
    assert!(of_four(&mut m, 0).is_empty(), "bare beacons carry none");
    // A life of its own ends the reminder, as does a heart that has counted so far.
    m.on_beacon(Time(1000), 4, 2, &beacon(1, Vec::new()));
    assert_eq!(of_four(&mut m, 20), [1]);
    m.on_beacon(Time(1100), 9, 1, &from_afar(2));
    assert_eq!(of_four(&mut m, 20), [1]);
}

/// Peer 4 lost its disk and begins its life again, which is known with a higher count.
#[test]
fn who_says_a_lower_count_itself_is_told_of_the_higher_one_and_not_for_ever() {
    for is_down in [true, false] {
        let mut m = Membership::new(6, 1000);
        m.on_beacon(Time(0), 4, 1, &beacon(51, Vec::new()));
        for id in 10..=30 {
            m.on_beacon(Time(100), id, 1, &beacon(9, Vec::new()));
        }
        let mut now = Time(2_500);
        if is_down {
            now = Time(20_000);
            m.tick(now);
            m.tick(now.plus_ms(20_000));
            now = now.plus_ms(20_000);
        }
        let status = m.status(4).map(|(_, s)| s);
        assert_eq!(status == Some(Status::Down), is_down);
        no_news(&mut m);
        let counts = |m: &mut Membership, now: Time| -> Vec<u32> {
            let told = m.tell(now, 4, &BTreeSet::new()).0;
            let of_four = told.iter().filter(|g| g.id == 4);
            of_four.map(|g| g.heartbeat).collect()
        };
        // A heartbeat that waited on its way is of before.
        m.on_heartbeat(Time(1_900), 4, 1, (49, 4));
        assert!(m.known[&4].reminder(now, (1_000, 1_000)).is_none());
        m.on_heartbeat(now, 4, 1, (2, 4));
        // In the smallest room there is one whole entry.
        assert_eq!(counts(&mut m, now), [51]);
        // It did not hear that; but others are to hear of others, too.
        let at = |ms| now.plus_ms(ms);
        m.on_heartbeat(at(1_000), 4, 1, (4, 4));
        assert_ne!(counts(&mut m, at(1_000)), [51]);
        m.on_heartbeat(at(2_000), 4, 1, (6, 4));
        assert_eq!(counts(&mut m, at(2_000)), [51]);
        // It is heard no more, or it has taken a life of its own.
        let mut later = m.clone();
        later.on_heartbeat(at(3_000), 4, 2, (1, 4));
        assert!(
            later.known[&4]
                .reminder(at(4_000), (1_000, 1_000))
                .is_none()
        );
        assert!(m.known[&4].reminder(at(4_000), (1_000, 1_000)).is_some());
        assert!(m.known[&4].reminder(at(12_000), (1_000, 1_000)).is_none());
    }
}

#[test]
fn a_suspicion_is_taken_over_and_refuted() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 3, 1, &beacon(1, vec![entry(2, 7, 40, None)]));
    assert_eq!(m.status(2), Some((1, Status::Alive)));
    // An older suspicion concerns a heartbeat that is refuted already.
    m.on_beacon(Time(1000), 3, 1, &beacon(2, vec![entry(2, 6, 60, Some(9))]));
    assert_eq!(m.status(2), Some((1, Status::Alive)));
    m.on_beacon(
        Time(2000),
        3,
        1,
        &beacon(3, vec![entry(2, 7, 60, Some(20))]),
    );
    assert_eq!(m.status(2), Some((1, Status::Suspect)));
    assert_eq!(
        m.gossip(Time(2000), 20)[0].suspected_ds,
        Some(20),
        "news go first, with their age"
    );
    m.on_beacon(Time(3000), 3, 1, &beacon(4, vec![entry(2, 8, 10, None)]));
    assert_eq!(m.status(2), Some((1, Status::Alive)));
    m.on_beacon(Time(3500), 3, 1, &beacon(5, vec![entry(2, 8, 15, Some(0))]));
    let down: Vec<_> = (14..40)
        .flat_map(|i| m.tick(Time(i * 250)).into_iter().map(move |c| (i * 250, c)))
        .filter(|(_, c)| c.peer == 2 && c.status == Status::Down)
        .collect();
    // D is 2 here: told at 3.5 s, k2 is 5 periods, and half of one is for the second hop.
    assert_eq!(
        down,
        [(
            9000,
            Change {
                peer: 2,
                incarnation: 1,
                status: Status::Down
            }
        )]
    );
}

#[test]
fn who_is_already_condemned_is_not_met_as_alive() {
    let mut m = Membership::new(1, 1000);
    let told = vec![
        entry(2, 7, 100, Some(60)),
        entry(4, 7, 500, None),
        entry(5, 7, 3, None),
    ];
    let changes = m.on_beacon(Time(0), 3, 1, &beacon(1, told));
    assert_eq!(changes.iter().map(|c| c.peer).collect::<Vec<_>>(), [3, 5]);
    assert_eq!(m.live().map(|(id, _)| id).collect::<Vec<_>>(), [3, 5]);
    assert_eq!(m.all().count(), 4, "the dead are asked after");
    let later = Gossip {
        incarnation: 2,
        ..entry(4, 1, 600, None)
    };
    assert!(
        m.on_beacon(Time(900), 3, 1, &beacon(2, vec![later]))
            .is_empty()
    );
    assert_eq!(m.status(4), Some((2, Status::Down)));
    let over = Gossip {
        incarnation: 2,
        ..entry(5, 1, 600, None)
    };
    let changes = m.on_beacon(Time(1900), 3, 1, &beacon(3, vec![over]));
    assert_eq!(
        changes,
        [Change {
            peer: 5,
            incarnation: 2,
            status: Status::Down
        }]
    );
}

/// Whoever tells of a heartbeat with a clock that jumped meanwhile makes it too old.
#[test]
fn a_later_heartbeat_is_no_older_than_an_earlier_one() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(10_000), 2, 1, &beacon(5, Vec::new()));
    m.on_beacon(Time(10_000), 3, 1, &beacon(5, Vec::new()));
    let told = beacon(6, vec![entry(2, 6, 105, None)]);
    let changes = m.on_beacon(Time(12_000), 3, 1, &told);
    assert!(changes.is_empty(), "{changes:?}");
    assert!(m.tick(Time(12_100)).is_empty());
    assert_eq!(m.status(2), Some((1, Status::Alive)));
    // It is as young as is known for sure: two seconds.
    let entries = m.gossip(Time(12_100), 9);
    let of_2 = entries.iter().find(|g| g.id == 2).unwrap();
    assert_eq!((of_2.heartbeat, of_2.age_ds), (6, 21));
}

#[test]
fn a_later_life_counts_as_a_restart() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 1, &beacon(900, Vec::new()));
    let changes = m.on_beacon(Time(5000), 2, 3, &beacon(1, Vec::new()));
    assert_eq!(
        changes,
        [Change {
            peer: 2,
            incarnation: 3,
            status: Status::Alive
        }]
    );
    assert!(
        m.on_beacon(Time(5100), 2, 1, &beacon(901, Vec::new()))
            .is_empty()
    );
    assert_eq!(m.status(2), Some((3, Status::Alive)));
}

#[test]
fn every_peer_comes_round_in_gossip() {
    let mut m = Membership::new(1, 1000);
    for id in 2..50 {
        m.on_beacon(Time(0), id, 1, &beacon(1, Vec::new()));
    }
    let later = Time(3000);
    let mut told = std::collections::BTreeSet::new();
    for _ in 0..3 {
        let said = m.gossip(later, 20);
        assert_eq!(said.len(), 20);
        assert!(said.iter().all(|g| g.age_ds == 30));
        told.extend(said.iter().map(|g| g.id));
    }
    assert_eq!(told.len(), 48);
}

/// Of whom neighbours have newer records it tells next what it holds, so that they say them; the
/// others come round all the same.
#[test]
fn whose_records_neighbours_have_newer_is_told_of_soon() {
    let mut m = Membership::new(1, 1000);
    for id in 2..=26 {
        m.on_beacon(Time(0), id, 1, &beacon(5, Vec::new()));
    }
    no_news(&mut m);
    let mut told = Vec::new();
    for t in 0..60 {
        // Of 17 and 20 a neighbour shows it again and again that it has more.
        let behind = if t < 2 { vec![] } else { vec![17, 20] };
        let now = Time(3_000 + t * 1_000);
        let (whole, _) = m.tell(now, 4, &behind.into_iter().collect());
        assert_eq!(whole.len(), 1, "a quarter of the room");
        told.push(whole[0].id);
    }
    let first = told.iter().position(|id| *id == 17).unwrap();
    assert!(first <= 3, "{told:?}");
    let all: BTreeSet<u16> = told.iter().copied().collect();
    assert_eq!(all, (2..=26).collect(), "nobody is left out");
}

/// Many differ in their states alone, a ground station in what others wait for.
#[test]
fn of_those_whose_records_neighbours_have_newer_ground_stations_go_first() {
    let mut m = Membership::new(1, 1000);
    for id in 2..=26 {
        let said = Beacon {
            ground_station: id == 26,
            ..beacon(5, Vec::new())
        };
        m.on_beacon(Time(0), id, 1, &said);
    }
    no_news(&mut m);
    let mut told = Vec::new();
    for t in 0..60 {
        let now = Time(3_000 + t * 1_000);
        let (whole, _) = m.tell(now, 4, &(2..=26).collect());
        told.push(whole[0].id);
    }
    let of_it = told.iter().filter(|id| **id == 26).count();
    assert!((30..=33).contains(&of_it), "{told:?}");
    let all: BTreeSet<u16> = told.iter().copied().collect();
    assert_eq!(all, (2..=26).collect(), "nobody is left out");
}

/// Five others are neighbours; of two of them somebody else knows by more hops.
#[test]
fn those_whom_a_neighbour_is_farther_from_are_told_of_first() {
    let mut m = Membership::new(1, 1000);
    for id in 2..=20 {
        m.on_beacon(Time(0), id, 1, &beacon(5, Vec::new()));
    }
    let far = |id: u16| Gossip {
        hops: 2,
        ..entry(id, 5, 10, None)
    };
    let near = (8..=20).map(|id| entry(id, 5, 10, None));
    let entries = near.chain([far(6), far(7)]).collect();
    m.on_beacon(Time(1_000), 3, 1, &beacon(6, entries));
    no_news(&mut m);
    let mut told: Vec<Vec<u16>> = Vec::new();
    for t in 0..4 {
        let entries = m.gossip(Time(3_000 + t * 1_000), 4);
        told.push(entries.iter().map(|g| g.id).collect());
    }
    // Both of them in each, and two of all in turn.
    for (ids, others) in told.iter().zip([[2, 3], [4, 5], [8, 9], [10, 11]]) {
        assert_eq!(ids[..2], [6, 7]);
        assert_eq!(ids[2..], others);
    }
    // After ten intervals nobody is known to depend on it any more.
    let later = m.gossip(Time(11_000), 4);
    let ids: Vec<u16> = later.iter().map(|g| g.id).collect();
    assert_eq!(ids, [12, 13, 14, 15]);
}

/// Peers 2 to 20 are neighbours, heard at 0 s and with later heartbeats at 2.5 s.
fn among_nineteen() -> Membership {
    let mut m = Membership::new(1, 1000);
    for (now, count) in [(Time(0), 5), (Time(2_500), 10)] {
        for id in 2..=20 {
            m.on_beacon(now, id, 1, &beacon(count, Vec::new()));
        }
    }
    no_news(&mut m);
    m
}

/// All were told of what changed.
fn no_news(m: &mut Membership) {
    for known in m.known.values_mut() {
        known.news_told = u8::MAX;
    }
}

/// Peer 3 hears 6 and 7 by others, and has not heard of 6 for long.
#[test]
fn of_whom_it_gains_most_to_tell_is_told_first() {
    let mut m = among_nineteen();
    let far = |id, heartbeat, age_ds| Gossip {
        hops: 2,
        ..entry(id, heartbeat, age_ds, None)
    };
    let entries = vec![far(6, 5, 60), far(7, 9, 5)];
    m.on_beacon(Time(3_000), 3, 1, &beacon(11, entries));
    let mut first = |now_ms| m.gossip(Time(now_ms), 2)[0].id;
    assert_eq!(first(5_000), 6);
    // It was told just now; but as likely as not that was lost.
    assert_eq!(first(5_100), 7);
    assert_eq!(first(6_000), 6);
    let heard = vec![far(6, 10, 10), far(7, 5, 70)];
    m.on_beacon(Time(6_100), 3, 1, &beacon(12, heard));
    assert_eq!(m.gossip(Time(7_000), 2)[0].id, 7);
}

/// What another neighbour tells arrives where it is wanted one time in two, too: it is wanted
/// less of this peer, and not no more, since who wants it may hear this peer alone.
#[test]
fn what_another_tells_is_wanted_half_as_much() {
    let mut m = among_nineteen();
    let far = |id, heartbeat, age_ds| Gossip {
        hops: 2,
        ..entry(id, heartbeat, age_ds, None)
    };
    let lags = vec![far(6, 5, 60), far(7, 5, 18)];
    m.on_beacon(Time(3_000), 3, 1, &beacon(11, lags));
    let want = |m: &Membership, id: u16| m.known[&id].want(Time(5_000)).0;
    assert_eq!((want(&m, 6), want(&m, 7)), (2_500, 1_300));
    for (now, left_ms) in [(Time(4_000), 1_250), (Time(4_500), 625)] {
        let age_ds = u16::try_from((now.0 - 2_500) / 100).unwrap();
        m.on_beacon(now, 4, 1, &beacon(11, vec![entry(6, 10, age_ds, None)]));
        assert_eq!(want(&m, 6), left_ms);
    }
}

/// Peer 3 hears this peer alone: whatever others tell of 6, a quarter of the gain is left to
/// this peer, and it grows with what 3 does not hear.
#[test]
fn what_others_tell_leaves_a_quarter_to_who_may_be_the_only_one_that_is_heard() {
    let mut m = among_nineteen();
    let far = Gossip {
        hops: 2,
        ..entry(6, 5, 60, None)
    };
    m.on_beacon(Time(3_000), 3, 1, &beacon(11, vec![far]));
    for t in 1..=18 {
        let now = Time(3_000 + 500 * t);
        let count = 10 + u32::try_from(t).unwrap();
        m.on_heartbeat(now, 6, 1, (count, 4));
        m.on_beacon(now, 4, 1, &beacon(count, vec![entry(6, count, 0, None)]));
    }
    // Peer 3 knows a heartbeat that was sent 3 s before the beginning.
    assert_eq!(m.known[&6].want(Time(12_000)).0, 12_000 / 4);
    m.gossip(Time(12_000), 2);
    assert_eq!(m.known[&6].want(Time(12_000)).0, 12_000 / 8);
}

#[test]
fn who_does_not_hear_a_neighbour_any_more_is_told_of_it_though_it_was_as_near() {
    let mut m = among_nineteen();
    let stale = beacon(11, vec![entry(9, 6, 25, None), entry(10, 7, 20, None)]);
    m.on_beacon(Time(3_000), 3, 1, &stale);
    let ids: Vec<u16> = m.gossip(Time(5_000), 3).iter().map(|g| g.id).collect();
    assert_eq!(ids, [9, 2, 3], "10 is less than two intervals behind");
}

/// Peers 2 to 13 hear each other. Peer 20 was away for a minute, and knows of the others what it
/// knew when it went; so do 21 and 22, who come back with it.
#[test]
fn who_comes_back_is_told_of_those_who_stayed() {
    let mut m = Membership::new(1, 1000);
    for id in (2..=13).chain(20..=22) {
        m.on_beacon(Time(0), id, 1, &beacon(5, Vec::new()));
    }
    let mut now = Time(0);
    for t in 1..=60 {
        now = Time(1_000 * t);
        for id in 2..=13 {
            let count = 5 + 2 * u32::try_from(t).unwrap();
            m.on_beacon(now, id, 1, &beacon(count, Vec::new()));
        }
        m.tick(now);
        m.tell(now, 4, &BTreeSet::new());
    }
    let down = |m: &Membership| m.all().filter(|(.., s)| *s == Status::Down).count();
    assert_eq!(down(&m), 3);
    let wants = |m: &Membership, id: u16| m.known[&id].is_wanted(now);
    // It is heard of by others first: whoever hears it itself tells it.
    m.on_beacon(now, 5, 1, &beacon(200, vec![entry(20, 90, 3, None)]));
    assert!((2..=13).all(|id| !wants(&m, id)));
    m.on_heartbeat(now, 20, 1, (91, 4));
    assert!((2..=13).all(|id| wants(&m, id)));
    assert!((20..=22).all(|id| !wants(&m, id)));
    // As much is gained as it was away.
    assert_eq!(m.known[&7].want(now).0, 60_000);
    // Of whom it tells as if it had heard of them it needs not hear.
    m.on_beacon(now, 20, 1, &beacon(92, vec![entry(7, 125, 1, None)]));
    assert!(!wants(&m, 7) && wants(&m, 8));
    // The others are told of: two heartbeats in a beacon and two half-way are most that fit.
    let mut told = BTreeSet::new();
    for t in 1..=4 {
        let (whole, fresh) = m.tell(now.plus_ms(1_000 * t), 4, &BTreeSet::new());
        let between = m.tell_between(now.plus_ms(1_000 * t + 500));
        told.extend(whole.iter().map(|g| g.id));
        told.extend(fresh.iter().chain(&between).map(|f| f.id));
    }
    assert!((8..=13).all(|id| told.contains(&id)), "{told:?}");
    // Those who come back with it know of each other, and it is met once.
    m.on_heartbeat(now.plus_ms(5_000), 21, 1, (92, 4));
    assert!((20..=22).all(|id| !m.known[&id].is_wanted(now.plus_ms(5_000))));
    let lag = m.known[&8].want(now.plus_ms(5_000));
    m.on_heartbeat(now.plus_ms(5_000), 20, 1, (95, 4));
    assert_eq!(m.known[&8].want(now.plus_ms(5_000)), lag);
}

/// Peers 20 to 22 were away for a minute. 20 comes back by itself, 21 and 22 eight seconds later:
/// whoever hears them tells them of 20 as of those who stayed, and not of each other.
#[test]
fn who_came_back_before_is_told_of_to_who_comes_back_now() {
    let mut m = Membership::new(1, 1000);
    for id in [2, 20, 21, 22] {
        m.on_beacon(Time(0), id, 1, &beacon(5, Vec::new()));
    }
    let mut at = Time(0);
    for t in 1..=68 {
        at = Time(1_000 * t);
        let count = 5 + 2 * u32::try_from(t).unwrap();
        m.on_beacon(at, 2, 1, &beacon(count, Vec::new()));
        if t >= 60 {
            m.on_beacon(at, 20, 1, &beacon(count, Vec::new()));
        }
        m.tick(at);
    }
    m.on_heartbeat(at, 21, 1, (91, 4));
    m.on_heartbeat(at, 22, 1, (91, 4));
    assert!([2, 20].iter().all(|id| m.known[id].is_wanted(at)));
    assert!([21, 22].iter().all(|id| !m.known[id].is_wanted(at)));
}

#[test]
fn where_not_all_fit_most_of_the_room_is_for_heartbeats_alone() {
    let mut m = among_nineteen();
    let far = |id| Gossip {
        hops: 2,
        ..entry(id, 9, 10, None)
    };
    m.on_beacon(Time(3_000), 3, 1, &beacon(11, (4..14).map(far).collect()));
    let ids = |fresh: &[Fresh]| -> Vec<u16> { fresh.iter().map(|f| f.id).collect() };
    let (told, fresh) = m.tell(Time(5_000), 4, &BTreeSet::new());
    assert_eq!(told.iter().map(|g| g.id).collect::<Vec<_>>(), [2]);
    assert_eq!(ids(&fresh), [4, 5, 6]);
    assert_eq!(ids(&m.tell_between(Time(5_500))), [7, 8, 9, 10]);
    assert_eq!(m.tell_between(Time(5_600)).len(), 0, "once a beacon");
    let (told, fresh) = m.tell(Time(6_000), 4, &BTreeSet::new());
    assert_eq!(told.iter().map(|g| g.id).collect::<Vec<_>>(), [3]);
    assert_eq!(ids(&fresh), [11, 12, 13]);
    assert_eq!(ids(&m.tell_between(Time(6_500))), [4, 5, 6, 7]);
    let (told, fresh) = m.tell(Time(7_000), 8, &BTreeSet::new());
    assert_eq!((told.len(), fresh.len()), (2, 7));
    assert_eq!(m.tell_between(Time(7_500)).len(), 7);
    m.tell(Time(8_000), 8, &BTreeSet::new());
    let (told, fresh) = m.tell(Time(9_000), 19, &BTreeSet::new());
    assert_eq!((told.len(), fresh.len()), (19, 0));
    assert_eq!(m.tell_between(Time(9_500)).len(), 0);
}

/// Of news there may be many at once, when two parts of a swarm meet: a quarter of the room.
#[test]
fn news_take_a_quarter_of_the_room_and_leave_whole_entries_to_others() {
    let mut m = among_nineteen();
    for id in 21..40 {
        m.on_beacon(Time(4_900), id, 1, &beacon(1, Vec::new()));
    }
    let (told, _) = m.tell(Time(5_000), 8, &BTreeSet::new());
    let news = told.iter().filter(|g| g.id > 20).count();
    assert_eq!((told.len(), news), (4, 2));
}

#[test]
fn a_heartbeat_alone_counts_for_the_life_that_is_known_or_the_least_it_can_be() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 9, &beacon(5, Vec::new()));
    let fresh = Fresh {
        id: 2,
        life: 1,
        heartbeat: 40,
        age_ds: 10,
        hops: 1,
        interval: 8,
        able: false,
        suspected_ds: None,
    };
    let say = |fresh| Beacon {
        fresh: vec![fresh, Fresh { id: 7, ..fresh }],
        ..samples::beacon(6)
    };
    m.on_beacon(Time(10_000), 3, 1, &say(Fresh { life: 0, ..fresh }));
    let of_2 = |m: &mut Membership| {
        *m.gossip(Time(10_000), 9)
            .iter()
            .find(|g| g.id == 2)
            .unwrap()
    };
    assert_eq!(of_2(&mut m).heartbeat, 5);
    assert_eq!(m.status(7), None, "no life has these bits alone");
    m.on_beacon(Time(10_000), 3, 1, &say(fresh));
    let told = of_2(&mut m);
    assert_eq!((told.incarnation, told.heartbeat, told.age_ds), (9, 40, 10));
    assert_eq!((told.hops, told.interval, told.able), (2, 8, false));
    assert_eq!(m.status(7), Some((1, Status::Alive)), "the least such life");
}

/// Peer 2 is known in life 9, by a heartbeat that was sent 10 s ago, and was held for down.
#[test]
fn a_heartbeat_alone_tells_of_one_of_the_next_lives_if_it_was_sent_later() {
    let mut known = Membership::new(1, 1000);
    known.on_beacon(Time(0), 2, 9, &beacon(500, Vec::new()));
    for t in 1..=60 {
        known.tick(Time(1_000 * t));
    }
    assert_eq!(known.status(2), Some((9, Status::Down)));
    let now = Time(60_000);
    let heard = |life: u8, age_ds: u16| {
        let mut m = known.clone();
        let told = Fresh {
            id: 2,
            life,
            heartbeat: 3,
            age_ds,
            hops: 1,
            interval: 8,
            able: true,
            suspected_ds: None,
        };
        let changes = m.on_others(now, 3, &[told]);
        assert_eq!(changes.is_empty(), m.status(2) == known.status(2));
        m.status(2)
    };
    // Of 9 the bits are 1; 10 to 12 are the next.
    for (bits, life) in [(2, 10), (3, 11), (4, 12)] {
        assert_eq!(heard(bits, 20), Some((life, Status::Alive)));
        // Whoever was sent before is of an earlier life, of which there is one with these bits.
        assert_eq!(heard(bits, 601), Some((9, Status::Down)));
    }
    for bits in [0, 5, 6, 7] {
        assert_eq!(heard(bits, 20), Some((9, Status::Down)), "{bits}");
    }
    // A lower count of the life that is known is none of it.
    assert_eq!(heard(1, 20), Some((9, Status::Down)));
}

#[test]
fn made_up_ids_do_not_displace_the_living() {
    let mut m = Membership::new(1, 1000);
    for id in 2..500 {
        m.on_beacon(Time(0), id, 1, &beacon(1, Vec::new()));
    }
    assert_eq!(m.all().count(), MAX_KNOWN);
    assert!(m.status(2).is_some() && m.status(499).is_none());
    for i in 0..80 {
        m.tick(Time(i * 250));
    }
    m.on_beacon(Time(20_000), 499, 1, &beacon(1, Vec::new()));
    assert_eq!((m.all().count(), m.live().count()), (MAX_KNOWN, 1));
}

/// A heartbeat of peer 2 that peer 3 has suspected for so long, tenths of a second.
fn told_suspicion(suspected_ds: u16) -> Gossip {
    Gossip {
        id: 2,
        incarnation: 1,
        heartbeat: 1,
        age_ds: 50,
        hops: 1,
        interval: 4,
        suspected_ds: Some(suspected_ds),
        able: true,
        max_seq: 0,
        digest: 0,
    }
}

#[test]
fn of_two_suspicions_of_a_heartbeat_the_older_one_counts() {
    // Its own suspicion begins at 4.25 s; k2 is 4.5 s.
    for (told_ds, down_at_ms) in [(30, 6_500), (1, 8_750)] {
        let mut m = Membership::new(1, 1000);
        m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
        let mut down = None;
        for t in 0..60 {
            let now = Time(t * 250);
            if t == 20 {
                m.on_beacon(now, 3, 1, &beacon(1, vec![told_suspicion(told_ds)]));
            }
            let changes = m.tick(now);
            if changes
                .iter()
                .any(|c| (c.peer, c.status) == (2, Status::Down))
            {
                down = down.or(Some(now.0));
            }
        }
        assert_eq!(down, Some(down_at_ms), "told {told_ds} tenths");
    }
}

/// Where others speak less often, a suspicion of who speaks often has as long to be refuted as
/// one of them: what is heard on the way from far is theirs.
#[test]
fn who_speaks_often_is_suspected_soon_and_given_up_as_late_as_the_slowest() {
    for (slowest, down_at_ms) in [(4, 8_750), (8, 17_500)] {
        let mut m = Membership::new(1, 1000);
        m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
        let mut seen = Vec::new();
        for t in 0u32..120 {
            let now = Time(u64::from(t) * 250);
            let slow = Beacon {
                interval: slowest,
                ..beacon(t + 1, Vec::new())
            };
            m.on_beacon(now, 3, 1, &slow);
            m.gossip(now, 2);
            let of_2 = m.tick(now).into_iter().filter(|c| c.peer == 2);
            seen.extend(of_2.map(|c| (now.0, c.status)));
        }
        let expected = [(4_250, Status::Suspect), (down_at_ms, Status::Down)];
        assert_eq!(seen, expected, "the slowest speaks every {slowest} T/4");
        // Whoever hears of it from others waits as long.
        let told = |suspected_ds| {
            let mut m = Membership::new(4, 1000);
            let slow = Beacon {
                interval: slowest,
                ..beacon(1, vec![told_suspicion(suspected_ds)])
            };
            m.on_beacon(Time(0), 3, 1, &slow);
            m.on_beacon(Time(1), 3, 1, &slow);
            m.status(2).map(|(_, status)| status)
        };
        let verdict_ds = u16::try_from((down_at_ms - 4_250) / 100).unwrap();
        assert_eq!(told(verdict_ds - 6), Some(Status::Suspect));
        assert_eq!(told(verdict_ds + 3), Some(Status::Down));
    }
}

/// A heartbeat came round by five hops and again by two: its author is two hops away for some
/// intervals, also by fresher ones that come round.
#[test]
fn a_peer_is_as_far_as_the_shortest_way_of_late_whatever_way_the_freshest_heartbeat_took() {
    let mut m = Membership::new(1, 1000);
    let over = |heartbeat, hops| Gossip {
        hops,
        ..entry(9, heartbeat, 10, None)
    };
    m.on_beacon(Time(0), 2, 1, &beacon(1, vec![over(7, 4)]));
    let told = |m: &mut Membership, now_ms| {
        let told = m.gossip(Time(now_ms), 5);
        let of_9 = told.iter().find(|g| g.id == 9).unwrap();
        (of_9.heartbeat, of_9.hops)
    };
    assert_eq!(told(&mut m, 100), (7, 5));
    m.on_beacon(Time(1_000), 3, 1, &beacon(1, vec![over(7, 1)]));
    assert_eq!(told(&mut m, 1_000), (7, 2));
    assert_eq!(m.eccentricity(Time(1_000)), 2);
    // What is older changes nothing; what is fresher counts when the shorter way is old.
    m.on_beacon(Time(2_500), 3, 1, &beacon(2, vec![over(6, 0)]));
    m.on_beacon(Time(4_500), 2, 1, &beacon(2, vec![over(8, 4)]));
    assert_eq!(told(&mut m, 4_900), (8, 2));
    assert_eq!(told(&mut m, 5_100), (8, 5));
}

#[test]
fn a_loop_that_ran_late_doubts_its_verdicts_for_a_period() {
    for (late, suspects_at_ms) in [(false, 4_250), (true, 6_500)] {
        let mut m = Membership::new(1, 1000);
        m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
        let mut suspected = None;
        for t in 0..40 {
            // The loop stands still for two and a half seconds.
            if late && (9..18).contains(&t) {
                continue;
            }
            let now = Time(t * 250);
            if late && t == 18 {
                m.was_late(now, 2_250, 2_500);
            }
            if m.tick(now).iter().any(|c| c.status == Status::Suspect) {
                suspected = suspected.or(Some(now.0));
            }
        }
        assert_eq!(suspected, Some(suspects_at_ms), "late {late}");
    }
}

#[test]
fn the_diameter_is_the_largest_eccentricity_heard_of_in_ten_intervals() {
    let mut m = Membership::new(1, 1000);
    assert_eq!((m.diameter(Time(0)), m.eccentricity(Time(0))), (1, 0));
    let far = |eccentricity| Beacon {
        eccentricity,
        ..beacon(1, Vec::new())
    };
    m.on_beacon(Time(0), 2, 1, &far(3));
    assert_eq!(
        (m.diameter(Time(9_999)), m.eccentricity(Time(9_999))),
        (3, 1)
    );
    assert_eq!(
        (m.diameter(Time(10_000)), m.eccentricity(Time(10_000))),
        (1, 0)
    );
    // Its own counts, too: by way of peer 3 it hears of 4 over six hops.
    let told = Gossip {
        hops: 5,
        ..entry(4, 7, 10, None)
    };
    m.on_beacon(Time(20_000), 3, 1, &beacon(1, vec![told]));
    let extent = |m: &Membership, at_ms| (m.diameter(Time(at_ms)), m.eccentricity(Time(at_ms)));
    assert_eq!(extent(&m, 20_000), (2, 2), "heard once, by whatever way");
    let later = Gossip {
        heartbeat: 9,
        ..told
    };
    m.on_beacon(Time(22_000), 3, 1, &beacon(3, vec![later]));
    assert_eq!(extent(&m, 22_000), (6, 6));
    // Both patiences grow with it: k1 = 4 + 6/4, k2 = 4 + 6/2 of the longest interval.
    let patience = m.patience(Time(22_000));
    assert_eq!(patience.k1_ms(1_000), 5_500);
    assert_eq!(patience.bound_ms, 5_500 + 7_000 + 8_000);
    assert_eq!(patience.verdict_ms(1_000), 7_000 + 5 * 500);
    // Where the air is full, what is on the way has four hops more to be lost on.
    let full = Patience::new(2_000, 1_000, 5, false);
    assert_eq!(full.verdict_ms(2_000), 2_000 * 13 / 2 + 4 * 2_000);
    assert_eq!(
        full.bound_ms,
        2_000 * 21 / 4 + 2_000 * 13 / 2 + 2_000 * (5 + 2)
    );
    assert!(full.k1_ms(2_000) + full.verdict_ms(2_000) < full.bound_ms);
    let near = Patience::new(2_000, 1_000, 1, false);
    assert_eq!(near.verdict_ms(2_000), 9_000);
}

#[test]
fn the_longest_interval_that_anybody_alive_announced_counts() {
    let mut m = Membership::new(1, 1000);
    assert_eq!(m.interval_ms(), 1_000);
    let slow = Beacon {
        interval: 16,
        ..beacon(1, Vec::new())
    };
    m.on_beacon(Time(0), 2, 1, &slow);
    assert_eq!(m.interval_ms(), 4_000);
    m.announce(20);
    assert_eq!(m.interval_ms(), 5_000);
    m.announce(4);
    // Of the dead none does.
    for t in 0..200 {
        m.tick(Time(t * 250));
    }
    assert_eq!(
        (m.status(2), m.interval_ms()),
        (Some((1, Status::Down)), 1_000)
    );
}

#[test]
fn who_hears_nobody_for_k1_suspects_itself_until_it_believes_all_others_down() {
    let mut m = Membership::new(1, 1000);
    assert!(!m.is_deaf(Time(60_000)), "it never heard anybody");
    m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
    assert!(!m.is_deaf(Time(4_249)) && m.is_deaf(Time(4_250)));
    m.note_heard(Time(4_300));
    assert!(!m.is_deaf(Time(8_549)) && m.is_deaf(Time(8_550)));
    for t in 0..80 {
        m.tick(Time(t * 250));
    }
    assert!(!m.is_deaf(Time(20_000)), "there is nobody left");
}

/// The last UAV, at the edge of the ground station's reach: it can plan all the time.
#[test]
fn who_hears_no_ground_station_and_knows_no_other_uav_is_not_deaf() {
    let mut m = Membership::new(1, 1000);
    let station = Beacon {
        ground_station: true,
        ..beacon(1, Vec::new())
    };
    m.on_beacon(Time(0), 100, 1, &station);
    assert!(m.hears_nobody(Time(5_000)) && !m.is_deaf(Time(5_000)));
    m.on_beacon(Time(5_000), 2, 1, &beacon(1, Vec::new()));
    assert!(m.is_deaf(Time(9_250)));
}

#[test]
fn a_life_far_ahead_of_the_one_that_is_known_is_none() {
    let mut m = Membership::new(1, 1000);
    assert!(m.may_live_in(2, 10_000) && !m.may_live_in(2, 10_001));
    m.on_beacon(Time(0), 2, 5, &beacon(1, Vec::new()));
    assert!(m.may_live_in(2, 10_005) && !m.may_live_in(2, 10_006));
    assert!(
        m.on_beacon(Time(1), 2, 10_006, &beacon(1, Vec::new()))
            .is_empty()
    );
    assert_eq!(m.status(2), Some((5, Status::Alive)));
}

#[test]
fn what_made_more_hops_than_the_largest_diameter_is_not_heard() {
    for (hops, heard) in [(HOPS_MAX - 1, true), (HOPS_MAX, false)] {
        let mut m = Membership::new(1, 1000);
        let told = Gossip {
            hops,
            ..entry(4, 7, 10, None)
        };
        m.on_beacon(Time(0), 3, 1, &beacon(1, vec![told]));
        assert_eq!(m.status(4).is_some(), heard, "{hops}");
    }
}

#[test]
fn nobody_is_told_of_himself_and_nobody_hears_of_himself() {
    let mut m = Membership::new(1, 1000);
    assert!(
        m.on_beacon(Time(0), 1, 1, &beacon(1, Vec::new()))
            .is_empty()
    );
    let told = vec![entry(1, 7, 10, None), entry(3, 9, 10, None)];
    m.on_beacon(Time(0), 3, 1, &beacon(1, told));
    assert_eq!(m.all().collect::<Vec<_>>(), [(3, 1, Status::Alive)]);
    assert_eq!(m.gossip(Time(10), 4)[0].heartbeat, 1, "by its own word");
}

#[test]
fn how_many_are_known_is_told_with_the_cap() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 1, &beacon(1, vec![entry(4, 7, 10, None)]));
    assert_eq!(m.loads(), [("peers known", 2, 255)]);
}

/// Peers 2 to 20 are heard each second, 14 falls silent in its interval of a period and is
/// suspected.
fn who_suspects_fourteen() -> (Membership, Time) {
    let mut m = Membership::new(1, 1000);
    m.announce(16);
    for id in 2..=20 {
        m.on_beacon(Time(0), id, 1, &beacon(1, Vec::new()));
    }
    for t in 1..=20 {
        let now = Time(t * 1_000);
        for id in (2..=20).filter(|id| *id != 14) {
            let count = u32::try_from(t).unwrap() + 1;
            m.on_heartbeat(now, id, 1, (count, 4));
        }
        let changes = m.tick(now);
        if changes.iter().any(|c| c.peer == 14) {
            no_news(&mut m);
            m.known.get_mut(&14).unwrap().news_told = 0;
            return (m, now);
        }
    }
    panic!("it is suspected");
}

/// A beacon of four entries has room for one of news, whole, the first time; then the heartbeat
/// alone tells it as well, before those of whom more is gained.
#[test]
fn news_is_told_a_second_time_by_the_heartbeat_alone() {
    let mut m = among_nineteen();
    let far = Gossip {
        hops: 2,
        ..entry(40, 5, 0, None)
    };
    m.on_beacon(Time(4_900), 3, 1, &beacon(11, vec![far]));
    let (told, _) = m.tell(Time(5_000), 4, &BTreeSet::new());
    assert!(told.iter().any(|g| g.id == 40), "{told:?}");
    for id in 2..=20 {
        m.on_heartbeat(Time(5_400), id, 1, (90, 4));
    }
    let (told, fresh) = m.tell(Time(6_000), 4, &BTreeSet::new());
    assert!(told.iter().all(|g| g.id != 40), "{told:?}");
    assert!(fresh.iter().any(|f| f.id == 40), "{fresh:?}");
    let (told, fresh) = m.tell(Time(7_000), 4, &BTreeSet::new());
    assert!(told.iter().all(|g| g.id != 40) && fresh.iter().all(|f| f.id != 40));
}

#[test]
fn news_of_somebody_goes_first_in_two_beacons() {
    let (mut m, now) = who_suspects_fourteen();
    for (after_ms, goes_first) in [(1_000, true), (5_000, true), (9_000, false)] {
        let told = m.gossip(now.plus_ms(after_ms), 4);
        assert_eq!(told[0].id == 14, goes_first, "after {after_ms} ms");
    }
    // What was not told for so long is no news any more.
    let (mut m, now) = who_suspects_fourteen();
    m.known.get_mut(&14).unwrap().is_untold_suspicion = false;
    assert_ne!(m.gossip(now.plus_ms(24_000), 4)[0].id, 14);
}

/// Nobody can refute what nobody was told: a suspicion that found no room for seven periods
/// counts as if it had been told within the interval of four.
#[test]
fn a_suspicion_that_nobody_was_told_of_is_no_verdict() {
    let (told, began) = who_suspects_fourteen();
    let verdict = |mut m: Membership, told_after_ms: u64| {
        (1..200_u32).find_map(|t| {
            let now = began.plus_ms(u64::from(t) * 250);
            for id in (2..=20).filter(|id| *id != 14) {
                m.on_heartbeat(now, id, 1, (100 + t, 4));
            }
            if u64::from(t) * 250 == told_after_ms {
                assert_eq!(m.gossip(now, 2)[0].id, 14, "it goes first");
            }
            let changes = m.tick(now);
            let down = |c: &Change| c.peer == 14 && c.status == Status::Down;
            changes.iter().any(down).then_some(u64::from(t) * 250)
        })
    };
    // 18 s, and as much more as it was suspected before the slowest would be.
    let k2_ms = told.patience(began).verdict_ms(1_000);
    assert!(k2_ms >= 30_750);
    let soon = verdict(told.clone(), 1_000).unwrap();
    assert!((k2_ms - 250..=k2_ms).contains(&soon), "{soon}");
    assert_eq!(verdict(told.clone(), 7_000), Some(7_000 + k2_ms - 4_000));
    // Never told, it is given up when its heartbeat is too old for anybody that lives.
    let bound_ms = told.bound_ms(began);
    let at_last = verdict(told, 0).unwrap() + began.0;
    assert!(at_last > bound_ms, "{at_last}");
}

/// Of somebody far often one heartbeat alone came of late, and by a long way: it is as far as
/// that and the one before it say, but not once it was held for down in between.
#[test]
fn one_heartbeat_that_came_by_a_long_way_makes_nobody_far() {
    let mut m = Membership::new(1, 1000);
    let told = |heartbeat, hops| {
        vec![Gossip {
            heartbeat,
            hops,
            ..entry(4, 1, 0, None)
        }]
    };
    let mut hear = |at_ms: u64, hops| {
        let count = u32::try_from(at_ms / 1_000).unwrap();
        m.on_beacon(Time(at_ms), 3, 1, &beacon(count, told(count, hops)));
        for t in at_ms / 1_000..=(at_ms + 9_000) / 1_000 {
            m.on_heartbeat(Time(t * 1_000), 3, 1, (u32::try_from(t).unwrap(), 4));
        }
        m.diameter(Time(at_ms + 9_000))
    };
    assert_eq!(hear(10_000, 2), 2);
    assert_eq!(hear(25_000, 3), 3);
    assert_eq!(hear(40_000, 12), 4, "three and one, as the one before");
    assert_eq!(hear(55_000, 12), 13);
    m.tick(Time(110_000));
    assert_eq!(m.status(4).map(|(_, s)| s), Some(Status::Down));
    let mut hear_again = |at_ms: u64| {
        let count = u32::try_from(at_ms / 1_000).unwrap();
        m.on_beacon(Time(at_ms), 3, 1, &beacon(count, told(count, 7)));
        m.diameter(Time(at_ms))
    };
    assert_eq!((hear_again(111_000), hear_again(112_500)), (2, 8));
}

/// What is old is told, so that whoever knows a later one tells that.
#[test]
fn an_old_heartbeat_is_told_so_that_a_later_one_is_heard() {
    let mut m = among_nineteen();
    let far = Gossip {
        hops: 2,
        ..entry(30, 5, 0, None)
    };
    m.on_beacon(Time(2_500), 3, 1, &beacon(11, vec![far]));
    let mut asked = Vec::new();
    for t in 3..=12 {
        let now = Time(t * 1_000);
        for id in 2..=20 {
            let count = 20 + u32::try_from(t).unwrap();
            m.on_heartbeat(now, id, 1, (count, 4));
        }
        let (told, fresh) = m.tell(now, 4, &BTreeSet::new());
        let asks = fresh.iter().any(|f| f.id == 30);
        if asks && told.iter().all(|g| g.id != 30) {
            asked.push(t);
        }
    }
    // It is told a second time as news. A quarter of the bound of 13.5 s is over at 5.9 s, and
    // it asks after more than two intervals each.
    assert_eq!(asked, [4, 7, 10]);
}

/// A peer that stood still when another had been silent for four periods: what arrived meanwhile
/// is heard within one, so it raises no suspicion before.
#[test]
fn who_was_late_raises_no_suspicion_for_a_period() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
    assert!((0..=16).all(|t| m.tick(Time(t * 250)).is_empty()));
    m.was_late(Time(7_000), 3_000, 3_000);
    let mut ticks = (28..60).map(|t| (t * 250, m.tick(Time(t * 250))));
    let suspected = ticks.find(|(_, changes)| !changes.is_empty()).unwrap();
    // Four and a quarter periods of silence would be over at 7.25 s.
    assert_eq!(suspected.0, 8_000);
}

/// The clocks of two jump one after the other: what the one tells of a third after that is too old,
/// and the other, which doubts its verdicts for a period, took that for silence once it was over.
#[test]
fn a_later_heartbeat_told_too_old_is_no_silence_either() {
    let mut m = Membership::new(1, 1000);
    m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
    m.on_beacon(Time(900), 3, 1, &beacon(1, Vec::new()));
    m.tick(Time(1_000));
    m.was_late(Time(22_000), 20_750, 21_000);
    // Beyond the bound, and less than it is while this peer doubts.
    let told = entry(3, 2, 180, None);
    m.on_beacon(Time(22_600), 2, 1, &beacon(9, vec![told]));
    assert!((91..120).all(|t| m.tick(Time(t * 250)).iter().all(|c| c.peer != 3)));
    assert_eq!(m.status(3), Some((1, Status::Alive)));
    // It ran all the time, and 3 is silent: that is found out.
    let gave_up = (120..200).find(|t| {
        m.tick(Time(t * 250));
        m.status(3) == Some((1, Status::Down))
    });
    assert!(gave_up.is_some());
}

/// What waited while a peer stood still may be as old as that: it tells so, and nobody else
/// takes it for fresh; for its own verdicts it is no silence.
#[test]
fn what_waited_for_who_stood_still_is_as_old_as_that() {
    let mut m = Membership::new(1, 1000);
    let met = vec![entry(3, 1, 1, None)];
    m.on_beacon(Time(0), 2, 1, &beacon(1, met));
    m.tick(Time(1_000));
    // It stands still for 39 s. Three beacons waited, and a heartbeat of one not met before.
    let woke = Time(40_000);
    m.was_late(woke, 38_750, 39_000);
    m.on_beacon(woke, 2, 1, &beacon(9, vec![entry(3, 9, 1, None)]));
    m.on_heartbeat(woke.plus_ms(249), 4, 1, (1, INTERVAL_LEAST));
    assert_eq!(m.tick(woke), []);
    let mut ages = m.gossip(woke.plus_ms(249), 4);
    ages.sort_by_key(|g| g.id);
    let ages: Vec<_> = ages.iter().map(|g| (g.id, g.heartbeat, g.age_ds)).collect();
    assert_eq!(ages, [(2, 9, 393), (3, 9, 394), (4, 1, 390)]);
    let alive = |m: &Membership, id| m.status(id) == Some((1, Status::Alive));
    assert!([2, 3, 4].into_iter().all(|id| alive(&m, id)));
    // Whoever hears that knows that the heartbeats are old.
    let mut other = Membership::new(5, 1000);
    let told = m.gossip(woke.plus_ms(249), 4);
    other.on_beacon(woke.plus_ms(249), 1, 1, &beacon(1, told));
    assert_eq!(other.status(4), Some((1, Status::Down)));
    // What is heard after the next look at the time did not wait, and a neighbour that
    // says nothing any more is missed as if it had been heard when this peer woke.
    m.on_heartbeat(woke.plus_ms(250), 4, 1, (2, INTERVAL_LEAST));
    let told = m.gossip(woke.plus_ms(250), 4);
    assert!(told.iter().any(|g| (g.id, g.age_ds) == (4, 0)));
    let mut ticks = (0..60).map(|t| woke.plus_ms(t * 250));
    let missed = ticks.find(|t| {
        let changes = m.tick(*t);
        changes
            .iter()
            .any(|c| (c.peer, c.status) == (2, Status::Suspect))
    });
    // Over two hops k1 is four and a half.
    assert_eq!(missed, Some(woke.plus_ms(4_500)));
}

#[test]
fn the_extent_that_is_kept_is_the_one_that_is_measured() {
    let mut kept = 0;
    for seed in 0..400 {
        let mut dice = many_detectors::Dice::new(seed);
        let mut m = Membership::new(1, 1000);
        let mut now = Time(0);
        let mut counts = [0; 9];
        for _ in 0..1_500 {
            now = now.plus_ms([1, 40, 400, 3_000][dice.below(4) as usize]);
            let author = 2 + dice.below(6) as u16;
            let mut heard = |id: u16| {
                counts[usize::from(id)] += dice.below(3) as u32;
                Gossip {
                    heartbeat: 1 + counts[usize::from(id)],
                    hops: 1 + dice.below(5) as u8,
                    interval: 4 << (dice.below(20) / 9),
                    age_ds: dice.below(100) as u16,
                    suspected_ds: (dice.below(9) == 0).then_some(0),
                    ..entry(id, 1, 0, None)
                }
            };
            let (own, other) = (heard(author), heard(2 + (author + 1) % 7));
            let incarnation = 1 + (now.0 / 200_000) as u32;
            match dice.below(4) {
                0 => {
                    let said = Beacon {
                        eccentricity: dice.below(5) as u8,
                        interval: own.interval,
                        ..beacon(own.heartbeat, vec![other])
                    };
                    m.on_beacon(now, author, incarnation, &said);
                }
                1 => {
                    let heartbeat = (own.heartbeat, own.interval);
                    m.on_heartbeat(now, author, incarnation, heartbeat);
                }
                2 => drop(m.tick(now)),
                _ => m.announce(4 << dice.below(2)),
            }
            let before = m.extent.get().filter(|e| now < e.until);
            kept += u32::from(before.is_some());
            let (kept, measured) = (m.extent(now), m.measured(now));
            assert_eq!(
                (kept.interval, kept.hops),
                (measured.interval, measured.hops),
                "seed {seed} at {now:?}"
            );
            assert_eq!(m.interval_ms(), ms_of(measured.interval, 1000));
        }
    }
    assert!((50_000..550_000).contains(&kept), "{kept}");
}
