use super::*;
use skein_netsim::world::fixture::square;
use skein_peer::wire::codec::{encode_body, seal};
use skein_peer::wire::message::{
    Activity, Beacon, Epoch, Gossip, Member, MissionStatus, Record as Said, Round, Stamp, State,
};
use skein_recording::model::frame::State as Told;

/// A swarm that speaks as it is told.
struct Air {
    belief: Belief,
    seq: u32,
    heartbeat: u32,
    n: u16,
    loop_hash: u64,
}

impl Air {
    fn new() -> Self {
        let mission = square(3).mission;
        let geometry = mission.geometry().unwrap();
        let mut belief = Belief::new(Some("f"));
        belief.mission(0, &mission);
        Self {
            belief,
            seq: 0,
            heartbeat: 0,
            n: u16::try_from(geometry.coverage_loop.cells().len()).unwrap(),
            loop_hash: geometry.coverage_loop.hash(),
        }
    }

    fn say(&mut self, now_ms: u64, author: u16, body: &Body) {
        self.seq += 1;
        let kind = body.kind();
        let mut record = Said {
            author,
            incarnation: 1,
            seq: self.seq,
            kind: kind.number(),
            subject: 0,
            body: encode_body(body),
            signature: Vec::new(),
        };
        let bytes = seal(&mut record, &Off);
        let key = key::key("f", kind, 0, author);
        self.belief.heard(now_ms, &key, &bytes);
        // Whoever passes it on says nothing new.
        self.belief.heard(now_ms, &key, &bytes);
    }

    /// A beacon that tells of one other peer.
    fn beacon(&mut self, now_ms: u64, author: u16, of: u16, suspected: bool) {
        self.heartbeat += 1;
        let gossip = Gossip {
            id: of,
            incarnation: 1,
            heartbeat: 1,
            age_ds: 5,
            hops: 1,
            interval: 4,
            suspected_ds: suspected.then_some(3),
            able: true,
            max_seq: 1,
            digest: 0,
        };
        let beacon = Beacon {
            heartbeat: self.heartbeat,
            east_mm: i32::from(author) * 100_000,
            north_mm: 50_000,
            heading_e4: 0,
            able: true,
            ground_station: false,
            finished: false,
            nonce: 7,
            counter: 1,
            eccentricity: 1,
            interval: 4,
            sharers: 2,
            revision: 1,
            loop_hash: self.loop_hash,
            cover_digest: 0,
            gossip: vec![gossip],
            fresh: Vec::new(),
        };
        self.say(now_ms, author, &Body::Beacon(beacon));
    }

    fn claim(&mut self, now_ms: u64, author: u16, first: u16, count: u16, backward: bool) {
        let listed = ListedRun {
            run: CellRun { first, count },
            backward,
            stamp: Stamp {
                epoch: Epoch::default(),
                take: 1,
                id: author,
            },
        };
        let claim = Claim {
            revision: 1,
            loop_hash: self.loop_hash,
            epoch: Epoch::default(),
            plan: vec![listed],
            held: Vec::new(),
            eta_ms: 9_000,
            alone: false,
        };
        self.say(now_ms, author, &Body::Claim(claim));
    }

    fn look(&mut self, now_ms: u64) -> (Vec<Event>, Frame) {
        self.belief.look(now_ms);
        let (mut events, mut frame) = (Vec::new(), None);
        for record in self.belief.take() {
            match record {
                Record::Event(event) => events.push(event),
                Record::Frame(last) => frame = Some(last),
                Record::Scene(_) | Record::FailureFree(_) | Record::End(_) => {}
            }
        }
        (events, frame.unwrap())
    }
}

fn kinds(events: &[Event]) -> Vec<&'static str> {
    events.iter().map(|e| e.what.kind()).collect()
}

#[test]
fn a_swarm_that_is_heard_is_drawn_as_it_says() {
    let mut air = Air::new();
    let half = air.n / 2;
    for second in 1..=3 {
        air.beacon(second * 1000, 1, 2, false);
        air.beacon(second * 1000 + 300, 2, 1, false);
    }
    air.claim(3_400, 1, 0, half, false);
    air.claim(3_500, 2, half, air.n - half, true);
    let state = State {
        east_mm: 1,
        north_mm: 2,
        height_mm: 60_000,
        heading_e4: 0,
        airspeed_mmps: 15_000,
        endurance_s: 700,
        activity: Activity::Covering,
        mission: MissionStatus::Active,
        covered: 0,
        cells: air.n,
    };
    air.say(3_600, 1, &Body::State(state));
    let covered = CellSet::of(air.n, [0, half]);
    let cover = Cover {
        revision: 1,
        loop_hash: air.loop_hash,
        covered: covered.encode_rle(None),
    };
    air.say(3_700, 1, &Body::Cover(cover));
    let (events, frame) = air.look(4_000);
    // Whoever listed a cell is taken to have seen it.
    let saw: Vec<(Option<u16>, Vec<u16>)> = (events.iter())
        .filter_map(|e| match &e.what {
            What::Covered { new, .. } => Some((e.uav, new.clone())),
            _ => None,
        })
        .collect();
    assert_eq!(saw, [(Some(1), vec![0]), (Some(2), vec![half])]);
    assert!(events.iter().all(|e| e.origin == Origin::Peer));
    assert_eq!(frame.links, [[1, 2]]);
    assert_eq!(frame.components, [vec![1, 2]]);
    let [one, two] = &frame.uavs[..] else {
        panic!("{frame:?}");
    };
    assert_eq!(
        (one.state, one.cells_left),
        (Told::Working, usize::from(half) - 1)
    );
    assert_eq!(one.fuel_left_s, Some(700.0));
    assert!((one.pose.unwrap().place.east_m - 100.0).abs() < 1e-3);
    assert!((one.pose.unwrap().heading_deg - 90.0).abs() < 1e-3);
    assert_eq!(two.state, Told::Starting, "it has not said what it does");
    assert_eq!(frame.covered_cells, 2);
}

#[test]
fn a_round_is_told_as_its_bids_are_heard() {
    let mut air = Air::new();
    let member = |id| Member { id, incarnation: 1 };
    for author in [1, 2] {
        let bid = Bid {
            round: Round {
                counter: 3,
                members: vec![member(1), member(2)],
                revision: 1,
                loop_hash: air.loop_hash,
                repair: true,
                wait_ms: 5_000,
            },
            anchor: author,
            backward: false,
            release_ms: 10,
            speed_mmps: 15_000,
            turn_ms: 4_000,
            endurance_ms: 600_000,
            covered: CellSet::new(air.n).encode_rle(None),
            commits: Vec::new(),
            off_loop: Vec::new(),
            eta_ms: 20,
            calm: true,
            progressed: true,
        };
        air.say(1_000, author, &Body::Bid(bid));
    }
    let (events, _) = air.look(1_100);
    assert_eq!(kinds(&events)[..3], ["round", "bids", "bids"]);
    assert!(matches!(
        events[0].what,
        What::Round {
            repair: Some(true),
            ..
        }
    ));
    assert!(matches!(&events[2].what, What::Bids { counter: 3, bids } if bids.len() == 2));
}

#[test]
fn who_falls_silent_is_held_to_be_gone_and_taken_over() {
    let mut air = Air::new();
    let half = air.n / 2;
    air.claim(500, 1, 0, half, false);
    air.claim(600, 2, half, air.n - half, false);
    for second in 1..=5 {
        air.beacon(second * 1000, 1, 2, false);
        air.beacon(second * 1000, 2, 1, false);
    }
    let (events, _) = air.look(5_500);
    assert!(!kinds(&events).contains(&"ended"));
    for second in 6..=12 {
        air.beacon(second * 1000, 1, 2, second > 8);
    }
    let (events, frame) = air.look(12_100);
    let ended = events.iter().find(|e| e.what.kind() == "ended").unwrap();
    assert_eq!(ended.uav, Some(2));
    let What::Ended { orphans, .. } = &ended.what else {
        panic!("{ended:?}");
    };
    assert_eq!(orphans.len(), usize::from(air.n - half));
    assert_eq!(frame.uavs[1].state, Told::Lost);
    assert_eq!(frame.uavs[1].held_down_by, [1]);
    assert_eq!(frame.uavs[1].pose, None);
    air.claim(12_500, 1, 0, air.n, false);
    let (events, _) = air.look(12_600);
    let took = |e: &Event| match &e.what {
        What::Takeover { from: 2, cells, .. } => Some(cells.len()),
        _ => None,
    };
    assert_eq!(
        events.iter().find_map(took),
        Some(usize::from(air.n - half))
    );
    // It was only out of reach.
    air.beacon(13_000, 2, 1, false);
    let (events, frame) = air.look(13_100);
    assert!(events.iter().any(|e| e.text == "uav2 is heard again"));
    assert!(frame.uavs[1].pose.is_some());
}

#[test]
fn what_is_no_record_of_this_swarm_changes_nothing() {
    let mut air = Air::new();
    let _ = air.look(100);
    for (key, bytes) in [
        ("f/v4/beacon/0/1", &b"\xff\x00"[..]),
        ("other/v4/beacon/0/1", b""),
        ("no key", b"1"),
    ] {
        air.belief.heard(200, key, bytes);
    }
    assert!(!air.belief.has_heard());
    let (events, frame) = air.look(300);
    assert!(events.is_empty() && frame.uavs.is_empty());
}
