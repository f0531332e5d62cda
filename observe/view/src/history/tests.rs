use super::*;
use skein_netsim::Prepared;
use skein_netsim::runs::Wanted;
use skein_netsim::world::fixture::square_losing;
use skein_recording::model::event::Origin;
use skein_recording::sink::Collected;

fn event(time_ms: u64, uav: u16, what: What) -> Record {
    Record::Event(Event {
        time_ms,
        origin: Origin::Peer,
        uav: Some(uav),
        text: format!("uav{uav} says so"),
        what,
    })
}

fn opened(counter: u32, members: &[u16]) -> What {
    What::Round {
        counter,
        members: members.to_vec(),
        repair: Some(true),
    }
}

fn bids(counter: u32, by: &[u16]) -> What {
    let bid = |by: &u16| Bid {
        by: *by,
        anchor: *by,
        release_ms: 1,
        endurance_ms: 2,
        eta_ms: 3,
    };
    What::Bids {
        counter,
        bids: by.iter().map(bid).collect(),
    }
}

fn claim(counter: u32, cells: &[u16]) -> What {
    What::Claim {
        counter,
        take: 0,
        cells: cells.to_vec(),
        held: Vec::new(),
        eta_ms: 0,
    }
}

fn task(news: &str, by: Option<u16>, ppm: &[(u16, u32)]) -> What {
    What::Task {
        name: "gate".to_owned(),
        news: news.to_owned(),
        author: Some(100),
        number: Some(0),
        revision: Some(1),
        by,
        held_by: (ppm.iter())
            .map(|(by, bid_ppm)| TaskBid {
                by: *by,
                bid_ppm: *bid_ppm,
            })
            .collect(),
    }
}

#[test]
fn a_round_has_who_opened_it_its_bids_and_what_each_got_with_their_times() {
    let mut history = History::default();
    for (time_ms, uav, what) in [
        (10, 2, opened(5, &[1, 2])),
        (10, 2, bids(5, &[2])),
        (20, 1, opened(5, &[1, 2])),
        (20, 1, bids(5, &[2, 1])),
        // An older claim is none of this round.
        (25, 1, claim(4, &[9])),
        (30, 1, claim(5, &[3, 4, 5, 9, 8])),
        (40, 1, claim(5, &[4, 5])),
    ] {
        history.hear(&event(time_ms, uav, what));
    }
    let all: Vec<&Round> = history.rounds().collect();
    let [round] = all[..] else {
        panic!("{all:?}");
    };
    assert_eq!((round.by, round.repair), (Some(2), Some(true)));
    let bids: Vec<(u64, u16)> = round.bids.iter().map(|b| (b.time_ms, b.what.by)).collect();
    assert_eq!(bids, [(10, 2), (20, 1)]);
    let [got] = &round.got[..] else {
        panic!("{round:?}");
    };
    assert_eq!((got.uav, got.time_ms, got.n_cells), (1, 30, 5));
    assert_eq!(got.stretches, [[3, 5], [9, 8]]);
}

#[test]
fn parts_of_a_divided_swarm_have_rounds_of_one_counter_and_each_its_own() {
    let mut history = History::default();
    history.hear(&event(1, 1, opened(5, &[1, 2])));
    history.hear(&event(2, 3, opened(5, &[3, 4])));
    history.hear(&event(3, 3, bids(5, &[3])));
    history.hear(&event(4, 2, bids(5, &[2])));
    history.hear(&event(5, 4, claim(5, &[1])));
    let told: Vec<(usize, usize)> = history
        .rounds()
        .map(|r| (r.bids.len(), r.got.len()))
        .collect();
    assert_eq!(told, [(1, 0), (1, 1)]);
}

#[test]
fn a_task_is_followed_from_who_asked_to_who_did_it() {
    let mut history = History::default();
    history.hear(&event(1, 100, task("asked", None, &[])));
    assert!(
        history
            .hear(&event(2, 3, task("asked", None, &[])))
            .is_empty()
    );
    history.hear(&event(5, 3, task("flies", None, &[(3, 700_000)])));
    let end = What::Ended {
        airframe: true,
        cells: Vec::new(),
        orphans: Vec::new(),
    };
    history.hear(&event(9, 3, end.clone()));
    history.hear(&event(12, 4, task("flies", None, &[(4, 500_000)])));
    history.hear(&event(20, 4, task("seen", None, &[])));
    assert!(
        history
            .hear(&event(21, 1, task("done-by", Some(4), &[])))
            .is_empty()
    );
    history.hear(&event(22, 100, task("over", None, &[])));
    // It was done before this UAV ended.
    assert!(history.hear(&event(30, 4, end)).is_empty());
    let task = history.tasks().next().unwrap();
    let steps: Vec<(u64, &str, Option<u16>)> = (task.steps.iter())
        .map(|s| (s.time_ms, s.news.as_str(), s.from))
        .collect();
    assert_eq!(
        steps,
        [
            (1, "asked", None),
            (5, "flies", None),
            (9, "lost", None),
            (12, "flies", Some(3)),
            (20, "seen", None),
            (22, "over", None),
        ]
    );
    assert_eq!(task.steps[3].bids[0].bid_ppm, 500_000);
}

#[test]
fn what_is_kept_is_bounded() {
    let mut history = History::default();
    let many: Vec<u16> = (0..1_000).collect();
    for counter in 0..2_000 {
        history.hear(&event(u64::from(counter), 1, opened(counter, &many)));
        history.hear(&event(u64::from(counter), 1, bids(counter, &many)));
        let zigzag: Vec<u16> = (0..1_000).map(|i| i * 7 % 1_000).collect();
        history.hear(&event(u64::from(counter), 1, claim(counter, &zigzag)));
        let word = ["flies", "left"][usize::from(counter % 2 == 1)];
        history.hear(&event(u64::from(counter), 1, task(word, None, &[])));
    }
    assert_eq!(history.rounds().count(), ROUNDS);
    let newest = history.rounds().next_back().unwrap();
    assert_eq!(newest.id, 1_999);
    assert_eq!(
        (newest.bids.len(), newest.members.len()),
        (MEMBERS, MEMBERS)
    );
    assert_eq!(newest.got[0].stretches.len(), STRETCHES);
    assert_eq!(history.tasks().next().unwrap().steps.len(), STEPS);
}

#[test]
fn a_kill_opens_a_repair_in_which_those_who_live_bid_and_get_all_that_is_left() {
    let spec = square_losing(3, 2, 30_000);
    let mut run = Collected::default();
    let prepared = Prepared::new(spec);
    skein_recording::simulated::fly(&prepared, 4, None, Wanted::default(), &mut run).unwrap();
    let mut history = History::default();
    for event in &run.events {
        history.hear(&Record::Event(event.clone()));
    }
    let is_answer = |r: &&Round| r.opened_ms > 30_000 && r.members == [1, 3] && r.got.len() == 2;
    let round = history.rounds().find(is_answer).unwrap();
    assert_eq!(round.repair, Some(true));
    assert!(round.members.contains(&round.by.unwrap()));
    let mut by: Vec<u16> = round.bids.iter().map(|b| b.what.by).collect();
    by.sort_unstable();
    assert_eq!(by, [1, 3]);
    for got in &round.got {
        assert!(got.n_cells > 0 && got.time_ms >= round.opened_ms, "{got:?}");
    }
}

#[test]
fn stretches_go_up_and_down_and_stand_alone() {
    for (cells, told) in [
        (&[][..], &[][..]),
        (&[4][..], &[[4, 4]][..]),
        (&[1, 2, 3, 2][..], &[[1, 3], [2, 2]][..]),
        (&[9, 8, 7, 20, 21][..], &[[9, 7], [20, 21]][..]),
    ] {
        assert_eq!(stretches(cells), told, "{cells:?}");
    }
}
