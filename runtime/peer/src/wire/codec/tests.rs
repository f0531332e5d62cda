//! Bytes of all kinds: typical, largest, refused, cut short, changed.

use super::super::aircraft::SensedAircraft;
use super::super::count::Count;
use super::super::crowd::{CrowdTile, Sure};
use super::super::detection::Detection;
use super::super::limits::*;
use super::super::obstacle::Found;
use super::super::samples::{fresh, golden, gossip, largest, listing};
use super::super::signature::Off;
use super::super::target::Target;
use super::super::tasks::{Progress, TaskKind};
use super::super::trail::Trail;
use super::super::usage::{TurnUse, Usage};
use super::*;
use crate::PeerId;
use proptest::collection::vec;
use proptest::prelude::*;
use skein_flight::separation::Stretch;

fn record_of(body: &Body) -> Record {
    Record {
        author: u16::MAX,
        incarnation: u32::MAX,
        seq: u32::MAX,
        kind: body.kind().number(),
        subject: 0,
        body: encode_body(body),
        signature: Vec::new(),
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[test]
fn bytes_of_version_one_stay_as_they_are() {
    for (body, bytes) in golden() {
        let encoded = encode_body(&body);
        assert_eq!(hex(&encoded), bytes, "{:?}", body.kind());
        assert_eq!(decode_body(body.kind(), &encoded), Ok(body));
    }
    let record = Record {
        author: 3,
        incarnation: 2,
        seq: 500,
        kind: 7,
        subject: 0,
        body: vec![0x81, 3],
        signature: Vec::new(),
    };
    assert_eq!(
        hex(&encode_record(&record)),
        "8703021901f40700428103".to_owned() + "40"
    );
}

#[test]
fn heartbeats_in_one_byte_string_have_one_encoding_and_ascend() {
    let read = |bytes: &[u8]| {
        let mut out = Out::new();
        bytes.to_vec().put(&mut out);
        <Vec<Fresh> as Wire>::get(&mut In::new(&out.into_bytes()))
    };
    let good = [6, 0xac, 2, 15, 0x51, 3];
    assert_eq!(read(&good), Ok(vec![fresh(6)]));
    assert_eq!(read(&[]), Ok(Vec::new()));
    let long = [0x86, 0, 0xac, 2, 15, 0x51, 3];
    let over = [6, 0xff, 0xff, 0xff, 0xff, 0x1f, 15, 0x51, 3];
    let endless = [0xff; 12];
    let far_id = [0x80, 0x80, 4, 0xac, 2, 15, 0x51, 3];
    for bad in [&long[..], &over, &endless, &far_id, &good[..5], &good[..1]] {
        assert_eq!(
            read(bad),
            Err(WireError::Malformed { field: "fresh" }),
            "{bad:?}"
        );
    }
    let too_many = [0u8; FRESH_MAX_BYTES + 1];
    assert_eq!(read(&too_many), Err(WireError::Range { field: "fresh" }));
    let said = |fresh| {
        Body::Beacon(Beacon {
            fresh,
            ..super::super::samples::beacon(1)
        })
    };
    assert_eq!(said(vec![fresh(6), fresh(7)]).check(), Ok(()));
    for wrong in [
        vec![fresh(7), fresh(6)],
        vec![fresh(6), fresh(6)],
        vec![Fresh {
            hops: 17,
            ..fresh(6)
        }],
        vec![Fresh {
            interval: 3,
            ..fresh(6)
        }],
        vec![Fresh {
            interval: 65,
            ..fresh(6)
        }],
    ] {
        assert!(said(wrong).check().is_err());
    }
}

#[test]
fn the_largest_valid_body_fits_its_cap() {
    for body in largest() {
        assert_eq!(body.check(), Ok(()), "{:?}", body.kind());
        let bytes = encode_body(&body);
        assert!(
            bytes.len() <= body.kind().cap_bytes(),
            "{:?}: {}",
            body.kind(),
            bytes.len()
        );
        assert_eq!(decode_body(body.kind(), &bytes), Ok(body.clone()));
        let mut record = record_of(&body);
        let bytes = seal(&mut record, &Off);
        let envelope = bytes.len() - record.body.len() + SIGNATURE_MAX_BYTES + 1;
        assert!(envelope <= ENVELOPE_MAX_BYTES, "{envelope}");
        assert_eq!(open(&bytes, &Off), Ok((record, body)));
    }
}

#[test]
fn values_out_of_range_are_named() {
    let Body::Beacon(beacon) = largest().remove(0) else {
        panic!("a beacon comes first")
    };
    let refused = |body: Body, field| {
        let bytes = encode_body(&body);
        assert_eq!(body.check(), Err(WireError::Range { field }));
        assert_eq!(
            decode_body(body.kind(), &bytes),
            Err(WireError::Range { field })
        );
    };
    refused(
        Body::Beacon(Beacon {
            gossip: vec![],
            east_mm: i32::MIN,
            ..beacon.clone()
        }),
        "east_mm",
    );
    refused(
        Body::Beacon(Beacon {
            gossip: vec![],
            eccentricity: 17,
            ..beacon.clone()
        }),
        "eccentricity",
    );
    let mut far = beacon.clone();
    far.gossip.truncate(1);
    far.gossip[0].hops = 17;
    refused(Body::Beacon(far), "hops");
    let chunk = MissionChunk {
        revision: 1,
        content_hash: 0,
        chunks: 0,
        bytes: vec![],
    };
    refused(Body::Mission(chunk), "chunks");
    let Body::Claim(claim) = golden().remove(3).0 else {
        panic!("a claim comes fourth")
    };
    let mut empty = claim.clone();
    empty.plan[0].run.count = 0;
    refused(Body::Claim(empty), "plan");
    refused(
        Body::Claim(Claim {
            held: vec![listing(1); HELD_MAX + 1],
            ..claim
        }),
        "held",
    );
    let Body::Bid(mut bid) = golden().remove(2).0 else {
        panic!("a bid comes third")
    };
    bid.round.members.reverse();
    refused(Body::Bid(bid), "members");
    // The list is refused before it is read.
    let more = Body::Beacon(Beacon {
        gossip: vec![gossip(1); GOSSIP_MAX + 1],
        ..beacon
    });
    let bytes = encode_body(&more);
    assert_eq!(
        decode_body(Kind::Beacon, &bytes),
        Err(WireError::Range { field: "gossip" })
    );
}

/// One more than what the largest valid body of a kind holds is refused, and so is one less
/// than the least.
#[test]
fn every_limit_is_sharp() {
    let refused = |body: &Body, field| {
        assert_eq!(body.check(), Err(WireError::Range { field }), "{body:?}");
    };
    let mut kinds = 0;
    for body in largest() {
        assert_eq!(body.check(), Ok(()), "{body:?}");
        match body {
            Body::Beacon(b) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Beacon), field| {
                    let mut b = b.clone();
                    change(&mut b);
                    refused(&Body::Beacon(b), field);
                };
                with(&|b| b.east_mm -= 1, "east_mm");
                with(&|b| b.east_mm = 1 - b.east_mm, "east_mm");
                with(&|b| b.north_mm -= 1, "north_mm");
                with(&|b| b.heading_e4 -= 1, "heading_e4");
                with(&|b| b.eccentricity += 1, "eccentricity");
                with(&|b| b.interval += 1, "interval");
                with(&|b| b.interval = INTERVAL_LEAST - 1, "interval");
                with(&|b| b.sharers += 1, "sharers");
                with(&|b| b.gossip.push(gossip(1)), "gossip");
                with(&|b| b.gossip[3].hops += 1, "hops");
                with(&|b| b.gossip[3].interval += 1, "interval");
            }
            Body::Heartbeat(h) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Heartbeat), field| {
                    let mut h = h.clone();
                    change(&mut h);
                    refused(&Body::Heartbeat(h), field);
                };
                with(&|h| h.interval = INTERVAL_MOST + 1, "interval");
                with(&|h| h.interval = INTERVAL_LEAST - 1, "interval");
                with(&|h| h.sharers = 258, "sharers");
                with(&|h| h.east_dm = 200_001, "east_dm");
                with(&|h| h.north_dm = -200_001, "north_dm");
            }
            Body::State(s) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut State), field| {
                    let mut s = s.clone();
                    change(&mut s);
                    refused(&Body::State(s), field);
                };
                with(&|s| s.east_mm -= 1, "east_mm");
                with(&|s| s.height_mm -= 1, "height_mm");
                with(&|s| s.airspeed_mmps += 1, "airspeed_mmps");
                with(&|s| s.endurance_s += 1, "endurance_s");
                with(&|s| s.cells -= 1, "covered");
            }
            Body::Bid(s) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Bid), field| {
                    let mut s = s.clone();
                    change(&mut s);
                    refused(&Body::Bid(s), field);
                };
                with(&|s| s.round.wait_ms += 1, "wait_ms");
                with(
                    &|s| s.round.members[1].id = s.round.members[0].id,
                    "members",
                );
                with(&|s| s.release_ms += 1, "release_ms");
                with(&|s| s.turn_ms += 1, "turn_ms");
                with(&|s| s.endurance_ms += 1, "endurance_ms");
                with(&|s| s.eta_ms += 1, "eta_ms");
                with(&|s| s.speed_mmps += 1, "speed_mmps");
                with(&|s| s.covered.push(0), "covered");
                with(&|s| s.commits.push(s.commits[0]), "commits");
                with(&|s| s.commits[0].count = 0, "commits");
                with(&|s| s.off_loop.push(s.off_loop[0]), "off_loop");
                with(&|s| s.off_loop[0].ready_ms += 1, "ready_ms");
                with(&|s| s.off_loop[0].north_mm = i32::MAX, "north_mm");
            }
            Body::Claim(r) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Claim), field| {
                    let mut r = r.clone();
                    change(&mut r);
                    refused(&Body::Claim(r), field);
                };
                with(&|r| r.plan.push(listing(1)), "plan");
                with(&|r| r.plan[2].run.count = 0, "plan");
                with(&|r| r.held.push(listing(1)), "held");
                with(&|r| r.held[2].run.count = 0, "held");
                with(&|r| r.eta_ms += 1, "eta_ms");
            }
            Body::Cover(mut c) => {
                kinds += 1;
                c.covered.push(0);
                refused(&Body::Cover(c), "covered");
            }
            Body::Mission(m) => {
                kinds += 1;
                let mut long = m.clone();
                long.bytes.push(0);
                refused(&Body::Mission(long), "bytes");
                let chunks = CHUNKS_MAX + 1;
                refused(&Body::Mission(MissionChunk { chunks, ..m }), "chunks");
            }
            Body::Lacking(l) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Lacking), field| {
                    let mut l = l.clone();
                    change(&mut l);
                    refused(&Body::Lacking(l), field);
                };
                with(&|l| l.holders += 1, "holders");
                with(&|l| l.pieces.push(1), "pieces");
                with(&|l| l.pieces[31] = 0, "pieces");
            }
            Body::Intent(i) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Intent), field| {
                    let mut i = i.clone();
                    change(&mut i);
                    refused(&Body::Intent(i), field);
                };
                with(&|i| i.endurance_s += 1, "endurance_s");
                with(&|i| i.in_force.plan.east_mm -= 1, "east_mm");
                with(&|i| i.in_force.plan.heading_e7 -= 1, "heading_e7");
                let first = |i: &mut Intent, change: &dyn Fn(&mut Stretch)| {
                    i.proposal
                        .iter_mut()
                        .for_each(|p| change(&mut p.plan.stretches[0]));
                };
                with(&|i| first(i, &|s| s.airspeed_mmps += 1), "airspeed_mmps");
                with(&|i| first(i, &|s| s.length_mm += 1), "stretches");
                with(&|i| first(i, &|s| s.radius_mm = 999), "stretches");
                let longer = |i: &mut Intent| {
                    let again = i.in_force.plan.stretches[0];
                    i.in_force.plan.stretches.push(again);
                };
                with(&longer, "stretches");
                with(&|i| i.accepts.push((PeerId(7), 1)), "accepts");
                with(&|i| i.accepts[1] = i.accepts[0], "accepts");
            }
            Body::Conflict(mut b) => {
                kinds += 1;
                b.accepts.push((PeerId(7), 1));
                refused(&Body::Conflict(b.clone()), "accepts");
                b.accepts.clear();
                b.in_force = 0;
                refused(&Body::Conflict(b), "in_force");
            }
            Body::Task(t) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Task), field| {
                    let mut t = t.clone();
                    change(&mut t);
                    refused(&Body::Task(t), field);
                };
                with(&|t| t.places.truncate(1), "places");
                with(&|t| t.places.push(t.places[0]), "places");
                with(&|t| t.places[1] = t.places[0], "places");
                with(&|t| t.places[0].north_mm -= 1, "places");
                with(&|t| t.kind = TaskKind::Relay, "places");
                with(&|t| t.sensor += 1, "sensor");
                with(&|t| t.worth += 1, "worth");
                with(&|t| t.worth = 0, "worth");
                with(&|t| t.stay_ms += 1, "stay_ms");
                with(&|t| t.radius_mm += 1, "radius_mm");
                with(&|t| t.within_ms += 1, "within_ms");
                with(&|t| t.over_after_ms += 1, "over_after_ms");
                with(&|t| t.name.push(b'x'), "name");
                with(&|t| t.name[0] = b' ', "name");
                with(&|t| t.name[0] = 0xff, "name");
            }
            Body::Bundle(b) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Bundle), field| {
                    let mut b = b.clone();
                    change(&mut b);
                    refused(&Body::Bundle(b), field);
                };
                with(&|b| b.offer.east_mm -= 1, "east_mm");
                with(&|b| b.offer.north_mm -= 1, "north_mm");
                with(&|b| b.offer.course_e4 -= 1, "course_e4");
                with(&|b| b.offer.speed_mmps += 1, "speed_mmps");
                with(&|b| b.offer.radius_mm += 1, "radius_mm");
                with(&|b| b.offer.radius_mm = 0, "radius_mm");
                with(&|b| b.offer.endurance_ms += 1, "endurance_ms");
                with(&|b| b.offer.section_ms += 1, "section_ms");
                with(&|b| b.offer.takes += 1, "takes");
                with(&|b| b.kept += 1, "kept");
                with(&|b| b.begun += 1, "begun");
                with(&|b| b.tasks[1] = b.tasks[0], "tasks");
                with(&|b| b.tasks[3].progress = Progress::Tentative, "kept");
                with(&|b| b.done.swap(0, 1), "done");
                with(&|b| b.done[1] = b.done[0], "done");
            }
            Body::Target(t) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Target), field| {
                    let mut t = t;
                    change(&mut t);
                    refused(&Body::Target(t), field);
                };
                with(&|t| t.seen_ms += 1, "seen_ms");
                with(&|t| t.east_mm -= 1, "east_mm");
                with(&|t| t.north_mm -= 1, "north_mm");
                with(&|t| t.east_mmps -= 1, "east_mmps");
                with(&|t| t.north_mmps -= 1, "north_mmps");
                with(&|t| t.place_e3 += 1, "place_e3");
                with(&|t| t.place_e3 = 0, "place_e3");
                with(&|t| t.speed_e3 += 1, "speed_e3");
                with(&|t| t.both_e3 -= 1, "both_e3");
                with(&|t| t.task_by = 0, "task");
            }
            Body::Trail(t) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Trail), field| {
                    let mut t = t.clone();
                    change(&mut t);
                    refused(&Body::Trail(t), field);
                };
                with(&|t| t.seen_ms += 1, "seen_ms");
                with(&|t| t.places.push(t.places[0]), "places");
                with(&|t| t.places[0].east_dm -= 1, "east_dm");
                with(&|t| t.places[0].north_dm -= 1, "north_dm");
                with(&|t| t.places[0].after_ds += 1, "after_ds");
            }
            Body::Obstacles(o) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Found), field| {
                    let mut o = o.clone();
                    change(&mut o.found[0]);
                    refused(&Body::Obstacles(o), field);
                };
                with(&|f| f.again += 1, "again");
                with(&|f| f.east_dm -= 1, "east_dm");
                with(&|f| f.north_dm -= 1, "north_dm");
                with(&|f| f.radius_dm += 1, "radius_dm");
                with(&|f| f.radius_dm = 0, "radius_dm");
                let mut more = o.clone();
                more.found.push(o.found[0]);
                refused(&Body::Obstacles(more), "found");
            }
            Body::Aircraft(a) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut SensedAircraft), field| {
                    let mut a = a.clone();
                    change(&mut a);
                    refused(&Body::Aircraft(a), field);
                };
                with(&|a| a.at_ms += 1, "at_ms");
                with(&|a| a.seen.push(a.seen[0]), "seen");
                with(&|a| a.seen[0].east_dm -= 1, "east_dm");
                with(&|a| a.seen[0].north_dm -= 1, "north_dm");
                with(&|a| a.seen[0].height_dm -= 1, "height_dm");
            }
            Body::Detection(d) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Detection), field| {
                    let mut d = d;
                    change(&mut d);
                    refused(&Body::Detection(d), field);
                };
                with(&|d| d.criterion += 1, "criterion");
                with(&|d| d.seen_ms += 1, "seen_ms");
                with(&|d| d.east_mm -= 1, "east_mm");
                with(&|d| d.north_mm -= 1, "north_mm");
                with(&|d| d.error_mm += 1, "error_mm");
                with(&|d| d.east_mmps -= 1, "east_mmps");
                with(&|d| d.north_mmps -= 1, "north_mmps");
            }
            Body::Usage(u) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Usage), field| {
                    let mut u = u.clone();
                    change(&mut u);
                    refused(&Body::Usage(u), field);
                };
                if u.stretches.is_empty() {
                    with(&|u| u.turns[31].turn += 1, "turn");
                    with(&|u| u.turns[1].turn = u.turns[0].turn, "turns");
                    with(&|u| u.turns.push(TurnUse::default()), "turns");
                } else {
                    with(&|u| u.stretches[15].stretch += 1, "stretch");
                    with(&|u| u.stretches.swap(0, 1), "stretches");
                    with(&|u| u.stretches[0].watched_m_s += 1, "watched_m_s");
                    with(&|u| u.stretches[0].spent_ds += 1, "spent_ds");
                    with(&|u| u.stretches[0].spent_ds -= 1, "stood_ds");
                    with(&|u| u.stretches[0].driven_m += 1, "driven_m");
                    with(&|u| u.turns.push(TurnUse::default()), "turns");
                }
            }
            Body::Crowd(t) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut CrowdTile), field| {
                    let mut t = t.clone();
                    change(&mut t);
                    refused(&Body::Crowd(t), field);
                };
                with(&|t| t.rows.push(t.rows[15]), "rows");
                with(&|t| t.dense.push(t.dense[15]), "dense");
                with(&|t| t.time_s += 1, "time_s");
                with(&|t| t.time_s = 5, "age_s");
                with(&|t| t.rows[15].sector += 1, "sector");
                with(&|t| t.rows[1].sector = 0, "rows");
                with(&|t| t.rows[1].people -= 1, "low");
                with(&|t| t.rows[1].high -= 1, "high");
                with(&|t| t.rows[1].age_s += 1, "age_s");
                with(&|t| t.rows[1].came -= 1, "came");
                with(&|t| t.rows[1].sure = Sure::None, "sure_before_s");
                with(&|t| t.rows[1].sure_before_s += 1, "sure_before_s");
                with(&|t| t.rows[1].sure = Sure::Eased, "dense");
                with(&|t| t.dense[1].sector = 0, "dense");
                with(&|t| t.dense[1].dense_s += 1, "dense_s");
            }
            Body::Count(c) => {
                kinds += 1;
                let with = |change: &dyn Fn(&mut Count), field| {
                    let mut c = c;
                    change(&mut c);
                    refused(&Body::Count(c), field);
                };
                with(&|c| c.watched_ms += 1, "watched_ms");
                with(&|c| c.passed += 1, "passed");
                with(&|c| c.spent_ms += 1, "spent_ms");
                with(&|c| c.driven_dm += 1, "driven_dm");
                with(&|c| c.seen_ms += 1, "seen_ms");
                with(&|c| c.seen_ms = 0, "standing");
            }
            Body::Operator(orders) => {
                kinds += 1;
                let mut same = orders.clone();
                same.singles.insert(7, orders.all);
                refused(&Body::Operator(same), "singles");
                let mut many = orders;
                let other = Order::Hold;
                many.singles.extend((0..=32).map(|uav| (uav, other)));
                refused(&Body::Operator(many), "singles");
            }
            Body::Finished(_) => {}
        }
    }
    assert_eq!(kinds, 22);
}

#[test]
fn longer_forms_nesting_and_trailing_bytes_are_refused() {
    let finished = |bytes: &[u8]| decode_body(Kind::Finished, bytes);
    assert!(finished(&[0x81, 0x03]).is_ok());
    let malformed = Err(WireError::Malformed { field: "revision" });
    assert_eq!(finished(&[0x81, 0x18, 0x03]), malformed);
    assert_eq!(finished(&[0x81, 0x19, 0x00, 0x03]), malformed);
    assert_eq!(
        finished(&[0x81, 0x03, 0x00]),
        Err(WireError::Trailing { bytes: 1 })
    );
    assert_eq!(
        finished(&[0x82, 0x03, 0x00]),
        Err(WireError::Malformed { field: "Finished" })
    );
    assert_eq!(
        finished(&[0x9f, 0x03, 0xff]),
        Err(WireError::Malformed { field: "Finished" })
    );
    assert_eq!(
        finished(&[0x98, 0x01, 0x03]),
        Err(WireError::Malformed { field: "Finished" })
    );
    assert_eq!(finished(&[0x81, 0x1b, 1, 0, 0, 0]), malformed);
    assert_eq!(finished(&[0x81; 8]), malformed);
    assert_eq!(
        finished(&[0x81; 9]),
        Err(WireError::Oversize { bytes: 9, cap: 8 })
    );
    for nest in [0x81_u8, 0x9f, 0xa1, 0xc1, 0xd8] {
        assert!(decode_record(&vec![nest; RECORD_MAX_BYTES]).is_err());
        for kind in Kind::ALL {
            assert!(decode_body(kind, &vec![nest; kind.cap_bytes()]).is_err());
        }
    }
    let oversize = vec![0x87; RECORD_MAX_BYTES + 1];
    let refused = WireError::Oversize {
        bytes: RECORD_MAX_BYTES + 1,
        cap: RECORD_MAX_BYTES,
    };
    assert_eq!(decode_record(&oversize), Err(refused));
}

#[test]
fn envelopes_beyond_the_table_are_refused() {
    let body = Body::Finished(Finished { revision: 3 });
    let of = |change: fn(&mut Record)| {
        let mut record = record_of(&body);
        change(&mut record);
        decode_record(&encode_record(&record))
    };
    assert!(of(|_| ()).is_ok());
    assert_eq!(of(|r| r.kind = 8), Err(WireError::Kind { number: 8 }));
    assert_eq!(of(|r| r.kind = 23), Err(WireError::Kind { number: 23 }));
    assert_eq!(
        of(|r| r.subject = 1),
        Err(WireError::Range { field: "subject" })
    );
    assert_eq!(
        of(|r| r.body = vec![0; 9]),
        Err(WireError::Oversize { bytes: 9, cap: 8 })
    );
    assert_eq!(
        of(|r| r.signature = vec![0; 65]),
        Err(WireError::Range { field: "signature" })
    );
}

/// Signs with a sum over the bytes: enough to see which bytes are signed.
struct Sum;

impl Signer for Sum {
    fn sign(&self, signed: &[u8]) -> Vec<u8> {
        let sum: u32 = signed
            .iter()
            .zip(1_u32..)
            .map(|(b, i)| u32::from(*b) * i)
            .sum();
        sum.to_be_bytes().repeat(10)
    }
}

impl Verifier for Sum {
    fn verify(&self, _: u16, _: u32, signed: &[u8], signature: &[u8]) -> bool {
        self.sign(signed) == signature
    }
}

#[test]
fn a_signature_covers_every_byte_before_it() {
    let (body, _) = golden().remove(3);
    let mut record = record_of(&body);
    let bytes = seal(&mut record, &Sum);
    assert_eq!(open(&bytes, &Sum), Ok((record, body)));
    assert_eq!(open(&bytes, &Off), Err(WireError::Signature));
    for at in 0..bytes.len() {
        let mut changed = bytes.clone();
        changed[at] ^= 1;
        assert!(open(&changed, &Sum).is_err(), "byte {at} is not covered");
    }
}

proptest! {
    #[test]
    fn random_bytes_never_panic(kind in 0_usize..Kind::ALL.len(), bytes in vec(any::<u8>(), 0..200)) {
        let kind = Kind::ALL[kind];
        if let Ok(body) = decode_body(kind, &bytes) {
            prop_assert_eq!(encode_body(&body), bytes.clone());
        }
        if let Ok(record) = decode_record(&bytes) {
            prop_assert_eq!(encode_record(&record), bytes);
        }
    }

    #[test]
    fn mutated_bytes_are_refused_or_have_one_encoding(
        which in 0_usize..12,
        big: bool,
        edits in vec((any::<prop::sample::Index>(), any::<u8>(), 0_u8..3), 1..6),
    ) {
        let body = if big { largest().remove(which) } else { golden().remove(which).0 };
        let mut bytes = encode_record(&record_of(&body));
        for (at, byte, how) in edits {
            let at = at.index(bytes.len());
            match how {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ => drop(bytes.remove(at)),
            }
        }
        if let Ok((record, body)) = open(&bytes, &Off) {
            prop_assert_eq!(encode_body(&body), record.body.clone());
            prop_assert_eq!(encode_record(&record), bytes);
        }
    }

    #[test]
    fn bytes_cut_short_are_refused(which in 0_usize..12, at in any::<prop::sample::Index>()) {
        let bytes = encode_record(&record_of(&golden().remove(which).0));
        prop_assert!(decode_record(&bytes[..at.index(bytes.len())]).is_err());
    }
}

#[test]
fn a_round_that_asks_to_wait_for_longer_than_a_day_is_refused() {
    for (wait_ms, refused) in [(DURATION_MAX_MS, false), (DURATION_MAX_MS + 1, true)] {
        let bid = largest().into_iter().find_map(|body| match body {
            Body::Bid(bid) => Some(bid),
            _ => None,
        });
        let mut bid = bid.unwrap();
        bid.round.wait_ms = wait_ms;
        let read = decode_body(Kind::Bid, &encode_body(&Body::Bid(bid)));
        assert_eq!(read.is_err(), refused, "{wait_ms} ms");
    }
}
