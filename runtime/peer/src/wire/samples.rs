//! Bodies that tests share: typical ones with their bytes, and the largest valid ones.

use super::codec::Body;
use super::limits::*;
use super::message::*;
use crate::PeerId;
use crate::protocol::conflict::{Intent, PromisedPlan};
use crate::protocol::promises::Brief;
use skein_behaviors::order::SINGLES_MAX;
use skein_flight::separation::motion::STRETCHES_MAX;
use skein_flight::separation::{End, MotionPlan, Stretch};

/// What is known of a peer, typically.
pub fn gossip(id: u16) -> Gossip {
    Gossip {
        id,
        incarnation: 2,
        heartbeat: 300,
        age_ds: 15,
        hops: 2,
        interval: 4,
        suspected_ds: Some(4),
        able: true,
        max_seq: 70_000,
        digest: 0xbeef,
    }
}

/// A heartbeat of a peer, typically.
pub fn fresh(id: u16) -> Fresh {
    Fresh {
        id,
        life: 2,
        heartbeat: 300,
        age_ds: 15,
        hops: 2,
        interval: 4,
        able: true,
        suspected_ds: None,
    }
}

/// A beacon of an able UAV on loop 1 of revision 1, which gossips about nobody.
pub fn beacon(heartbeat: u32) -> Beacon {
    Beacon {
        heartbeat,
        east_mm: 0,
        north_mm: 0,
        heading_e4: 0,
        able: true,
        ground_station: false,
        finished: false,
        nonce: 1,
        counter: 0,
        eccentricity: 1,
        interval: 4,
        sharers: 2,
        revision: 1,
        loop_hash: 1,
        cover_digest: 0,
        gossip: Vec::new(),
        fresh: Vec::new(),
    }
}

/// A bid of a UAV with nothing to fly, at the begin of the loop.
pub fn bid(round: Round) -> Bid {
    Bid {
        round,
        anchor: 0,
        backward: false,
        release_ms: 0,
        speed_mmps: 13_000,
        turn_ms: 8000,
        endurance_ms: 3_000_000,
        covered: Vec::new(),
        commits: Vec::new(),
        off_loop: Vec::new(),
        eta_ms: 0,
        calm: true,
        progressed: false,
    }
}

/// A run of twelve cells, listed typically.
pub fn listing(first: u16) -> ListedRun {
    ListedRun {
        run: CellRun { first, count: 12 },
        backward: true,
        stamp: Stamp {
            epoch: Epoch {
                counter: 7,
                hash: 0xdead_beef,
            },
            take: 1,
            id: 3,
        },
    }
}

/// A typical body of each kind and its bytes: who changes them changes the format, which
/// from the first release on is another version.
pub fn golden() -> Vec<(Body, &'static str)> {
    let mut all = golden_of_cells();
    all.extend(super::tasks::samples::golden());
    all.push((
        Body::Target(super::target::samples::target()),
        "8f0302011a00013df818c81a0001d682397ab619170c39018f1911f819015e1904b018640001",
    ));
    all.push((
        Body::Detection(super::detection::samples::detection()),
        "8c00000003191002011a00013df81a0001d682397ab619213419170c39018f",
    ));
    all.push((
        Body::Trail(super::trail::samples::trail()),
        "83f51a00013df883841904b439013900f5841905dc39012116f4841906f43877182ef4",
    ));
    all.push((
        Body::Count(super::count::samples::count()),
        "871a123456781a00013df80e19ee481910d60000",
    ));
    all.push((
        Body::Usage(super::usage::samples::usage()),
        "831a1234567882861119072618d60018a30486131907260000000080",
    ));
    all.push((
        Body::Crowd(super::crowd::samples::tile()),
        "841a1234567818518289021906681905c81906fe00021901360200890300000201000001008183021503",
    ));
    all.push((
        Body::Obstacles(super::obstacle::samples::obstacles()),
        "81828400190c8439052118aa840119157c1908f2183c",
    ));
    all.push((
        Body::Aircraft(super::aircraft::samples::aircraft()),
        "821a00013df881851904b43901391902bc19015e33",
    ));
    all
}

fn golden_of_cells() -> Vec<(Body, &'static str)> {
    let round = Round {
        counter: 7,
        members: vec![
            Member {
                id: 1,
                incarnation: 1,
            },
            Member {
                id: 3,
                incarnation: 2,
            },
        ],
        revision: 1,
        loop_hash: 0x0123_4567_89ab_cdef,
        repair: true,
        wait_ms: 5000,
    };
    vec![
        (
            Body::Beacon(Beacon {
                heartbeat: 42,
                east_mm: -1_234_567,
                north_mm: 890_123,
                heading_e4: 15_708,
                able: true,
                ground_station: false,
                finished: false,
                nonce: 0xcafe_f00d,
                counter: 7,
                eccentricity: 2,
                interval: 4,
                sharers: 3,
                revision: 1,
                loop_hash: 0x0123_4567_89ab_cdef,
                cover_digest: 99,
                gossip: vec![
                    gossip(4),
                    Gossip {
                        suspected_ds: None,
                        ..gossip(5)
                    },
                ],
                fresh: vec![fresh(6)],
            }),
            "91182a3a0012d6861a000d950b193d5cf5f4f41acafef00d07020403011b0123456789abcdef1863828a040219012c0f020404f51a0001117019beef8a050219012c0f0204f6f51a0001117019beef4606ac020f5103",
        ),
        (
            Body::State(State {
                east_mm: 1,
                north_mm: -1,
                height_mm: 120_000,
                heading_e4: -31_416,
                airspeed_mmps: 18_000,
                endurance_s: 2400,
                activity: Activity::Covering,
                mission: MissionStatus::Active,
                covered: 100,
                cells: 480,
            }),
            "8a01201a0001d4c0397ab7194650190960010018641901e0",
        ),
        (
            Body::Bid(Bid {
                round,
                anchor: 17,
                backward: false,
                release_ms: 4000,
                speed_mmps: 18_000,
                turn_ms: 9000,
                endurance_ms: 1_200_000,
                covered: vec![0, 12, 3, 4],
                commits: vec![CellRun {
                    first: 16,
                    count: 2,
                }],
                off_loop: vec![OffLoop {
                    east_mm: 120_000,
                    north_mm: -31_415,
                    course_e4: 15_708,
                    ready_ms: 2_000,
                }],
                eta_ms: 600_000,
                calm: true,
                progressed: false,
            }),
            "8d8607828301010183030102011b0123456789abcdeff519138811f4190fa01946501923281a00124f8044000c03048182100281841a0001d4c0397ab6193d5c1907d01a000927c0f5f4",
        ),
        (
            Body::Claim(Claim {
                revision: 1,
                loop_hash: 0x0123_4567_89ab_cdef,
                epoch: Epoch {
                    counter: 7,
                    hash: 0xdead_beef,
                },
                plan: vec![listing(20), listing(40)],
                held: vec![listing(60)],
                eta_ms: 600_000,
                alone: true,
            }),
            "87011b0123456789abcdef82071adeadbeef8287140cf5071adeadbeef01038718280cf5071adeadbeef01038187183c0cf5071adeadbeef01031a000927c0f5",
        ),
        (
            Body::Cover(Cover {
                revision: 1,
                loop_hash: 5,
                covered: vec![0, 12],
            }),
            "83010542000c",
        ),
        (
            Body::Mission(MissionChunk {
                revision: 1,
                content_hash: 6,
                chunks: 2,
                bytes: vec![1, 2, 3],
            }),
            "8401060243010203",
        ),
        (
            Body::Operator(Orders {
                all: Order::Resume,
                singles: [(3, Order::ReturnToBase)].into(),
            }),
            "820081820302",
        ),
        (Body::Finished(Finished { revision: 3 }), "8103"),
        (
            Body::Heartbeat(Heartbeat {
                interval: 4,
                sharers: 3,
                east_dm: -12_346,
                north_dm: 8_901,
                fresh: vec![fresh(6)],
            }),
            "8504033930391922c54606ac020f5103",
        ),
        (
            Body::Lacking(Lacking {
                revision: 2,
                content_hash: 6,
                holders: 1,
                pieces: vec![0b1000_0001, 2],
            }),
            "84020601428102",
        ),
        (
            Body::Intent(Intent {
                number: 9,
                endurance_s: 5_400,
                in_force: promise(4, 1),
                proposal: Some(promise(5, 2)),
                accepts: vec![(PeerId(3), 17)],
            }),
            "850919151888041a0001d588195dc01a000514c83a00efaf3a8183395dbf1993431938a41967201938a48188051a0001d588195dc01a000514c83a00efaf3a8283395dbf1993431938a483395dbf1993431938a41967201938a481820311",
        ),
        (
            Body::Conflict(Brief {
                number: 10,
                in_force: 5,
                proposal: None,
                accepts: vec![(PeerId(3), 17)],
            }),
            "840a050081820311",
        ),
    ]
}

/// A promise of some stretches, typically.
fn promise(version: u32, stretches: usize) -> PromisedPlan {
    let stretch = Stretch {
        radius_mm: -24_000,
        length_mm: 37_699,
        airspeed_mmps: 14_500,
    };
    PromisedPlan {
        version,
        plan: MotionPlan {
            start_ms: 120_200,
            east_mm: 24_000,
            north_mm: 333_000,
            heading_e7: -15_707_963,
            stretches: vec![stretch; stretches],
            end: End::Loiter {
                radius_mm: 26_400,
                airspeed_mmps: 14_500,
            },
        },
    }
}

fn longest_promise() -> PromisedPlan {
    let stretch = Stretch {
        radius_mm: i32::MIN,
        length_mm: 40_000_000,
        airspeed_mmps: SPEED_MAX_MMPS,
    };
    PromisedPlan {
        version: u32::MAX,
        plan: MotionPlan {
            start_ms: u64::MAX,
            east_mm: -POSITION_MAX_MM,
            north_mm: -POSITION_MAX_MM,
            heading_e7: -31_415_927,
            stretches: vec![stretch; STRETCHES_MAX],
            end: End::Loiter {
                radius_mm: i32::MIN,
                airspeed_mmps: SPEED_MAX_MMPS,
            },
        },
    }
}

/// The largest valid body of each kind.
pub fn largest() -> Vec<Body> {
    let mut all = largest_of_cells();
    all.extend(super::tasks::samples::largest());
    all.extend(super::target::samples::largest());
    all.extend(super::detection::samples::largest());
    all.extend(super::trail::samples::largest());
    all.extend(super::count::samples::largest());
    all.extend(super::usage::samples::largest());
    all.extend(super::crowd::samples::largest());
    all.extend(super::obstacle::samples::largest());
    all.extend(super::aircraft::samples::largest());
    all
}

fn largest_of_cells() -> Vec<Body> {
    let gossip = Gossip {
        id: u16::MAX,
        incarnation: u32::MAX,
        heartbeat: u32::MAX,
        age_ds: u16::MAX,
        hops: HOPS_MAX,
        interval: INTERVAL_MOST,
        suspected_ds: Some(u16::MAX),
        able: true,
        max_seq: u32::MAX,
        digest: u16::MAX,
    };
    let fresh: Vec<Fresh> = (u16::MAX - 15..u16::MAX)
        .map(|id| Fresh {
            id,
            life: 7,
            heartbeat: u32::MAX,
            age_ds: u16::MAX,
            hops: HOPS_MAX,
            interval: INTERVAL_MOST,
            able: true,
            suspected_ds: Some(u16::MAX),
        })
        .collect();
    let epoch = Epoch {
        counter: u32::MAX,
        hash: u32::MAX,
    };
    let run = CellRun {
        first: u16::MAX,
        count: u16::MAX,
    };
    let stamp = Stamp {
        epoch,
        take: u16::MAX,
        id: u16::MAX,
    };
    let listing = ListedRun {
        run,
        backward: true,
        stamp,
    };
    let members = (u16::MAX - 7..=u16::MAX)
        .map(|id| Member {
            id,
            incarnation: u32::MAX - u32::from(id % 2),
        })
        .collect();
    vec![
        Body::Beacon(Beacon {
            heartbeat: u32::MAX,
            east_mm: -POSITION_MAX_MM,
            north_mm: -POSITION_MAX_MM,
            heading_e4: -HEADING_MAX_E4,
            able: true,
            ground_station: true,
            finished: true,
            nonce: u32::MAX,
            counter: u32::MAX,
            eccentricity: HOPS_MAX,
            interval: INTERVAL_MOST,
            sharers: u16::try_from(PEERS_MAX + 1).unwrap_or(u16::MAX),
            revision: u32::MAX,
            loop_hash: u64::MAX,
            cover_digest: u32::MAX,
            gossip: vec![gossip; GOSSIP_MAX],
            fresh: fresh.clone(),
        }),
        Body::State(State {
            east_mm: -POSITION_MAX_MM,
            north_mm: -POSITION_MAX_MM,
            height_mm: -POSITION_MAX_MM,
            heading_e4: -HEADING_MAX_E4,
            airspeed_mmps: SPEED_MAX_MMPS,
            endurance_s: DURATION_MAX_MS / 1000,
            activity: Activity::GroundStation,
            mission: MissionStatus::Failed,
            covered: u16::MAX,
            cells: u16::MAX,
        }),
        Body::Bid(Bid {
            round: Round {
                counter: u32::MAX,
                members,
                revision: u32::MAX,
                loop_hash: u64::MAX,
                repair: true,
                wait_ms: DURATION_MAX_MS,
            },
            anchor: u16::MAX,
            backward: true,
            release_ms: DURATION_MAX_MS,
            speed_mmps: SPEED_MAX_MMPS,
            turn_ms: DURATION_MAX_MS,
            endurance_ms: DURATION_MAX_MS,
            covered: vec![255; BID_COVERED_MAX_BYTES],
            commits: vec![run; COMMITS_MAX],
            off_loop: vec![OffLoop {
                east_mm: -POSITION_MAX_MM,
                north_mm: POSITION_MAX_MM,
                course_e4: -HEADING_MAX_E4,
                ready_ms: DURATION_MAX_MS,
            }],
            eta_ms: DURATION_MAX_MS,
            calm: true,
            progressed: true,
        }),
        Body::Claim(Claim {
            revision: u32::MAX,
            loop_hash: u64::MAX,
            epoch,
            plan: vec![listing; PLAN_MAX],
            held: vec![listing; HELD_MAX],
            eta_ms: DURATION_MAX_MS,
            alone: true,
        }),
        Body::Cover(Cover {
            revision: u32::MAX,
            loop_hash: u64::MAX,
            covered: vec![9; COVERED_MAX_BYTES],
        }),
        Body::Mission(MissionChunk {
            revision: u32::MAX,
            content_hash: u64::MAX,
            chunks: CHUNKS_MAX,
            bytes: vec![9; CHUNK_MAX_BYTES],
        }),
        Body::Operator(Orders {
            all: Order::ReturnToBase,
            singles: (0..u16::try_from(SINGLES_MAX).unwrap_or(u16::MAX))
                .map(|i| (u16::MAX - i, Order::Hold))
                .collect(),
        }),
        Body::Finished(Finished { revision: u32::MAX }),
        Body::Heartbeat(Heartbeat {
            interval: INTERVAL_MOST,
            sharers: u16::try_from(PEERS_MAX + 1).unwrap_or(u16::MAX),
            east_dm: -POSITION_MAX_MM / 100,
            north_dm: -POSITION_MAX_MM / 100,
            fresh,
        }),
        Body::Lacking(Lacking {
            revision: u32::MAX,
            content_hash: u64::MAX,
            holders: u16::try_from(PEERS_MAX).unwrap_or(u16::MAX),
            pieces: vec![255; LACKING_MAX_BYTES],
        }),
        Body::Intent(Intent {
            number: u32::MAX,
            endurance_s: DURATION_MAX_MS / 1000,
            in_force: longest_promise(),
            proposal: Some(longest_promise()),
            accepts: (u16::MAX - 31..=u16::MAX)
                .map(|id| (PeerId(id), u32::MAX))
                .collect(),
        }),
        Body::Conflict(Brief {
            number: u32::MAX,
            in_force: u32::MAX,
            proposal: Some(u32::MAX),
            accepts: (u16::MAX - 31..=u16::MAX)
                .map(|id| (PeerId(id), u32::MAX))
                .collect(),
        }),
    ]
}
