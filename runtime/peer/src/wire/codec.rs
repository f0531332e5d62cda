//! Bytes of records and bodies: CBOR arrays, bounded, checked, one encoding a value.
//!
//! The formats of docs/protocol.md §7. Numbers are in their shortest form,
//! lengths are stated, and an array has exactly the elements of its version: what
//! decodes encodes to the same bytes again, so that hashes and signatures over bytes
//! and over values agree. **Unknown trailing elements are refused**, not skipped: a
//! value that one peer reads and another does not would let the two decide
//! differently from the same record. Another layout is another version in the key.
//!
//! Nothing here recurses with the input, allocates more than a few times its length,
//! or panics. The primitives are in `cbor.rs`, schemas in [`super::schema`].

use super::cbor::{In, Listed, Out, Wire, array_of, number_of};
use super::kinds::{Kind, RECORD_MAX_BYTES};
use super::limits::{
    self, COMMITS_MAX, FRESH_MAX_BYTES, GOSSIP_MAX, MEMBERS_MAX, PLAN_MAX, at_most, in_range,
};
use super::message::{
    Activity, Beacon, Bid, CellRun, Claim, Cover, Epoch, Finished, Fresh, Gossip, Heartbeat,
    ListedRun, Member, MissionChunk, MissionStatus, OffLoop, Order, Record, Round, Stamp, State,
};
use super::signature::{SIGNATURE_MAX_BYTES, Signer, Verifier};
use crate::varint;

/// Largest envelope around a body: heads and numbers at their longest, 23 bytes, and
/// a signature with its head.
pub const ENVELOPE_MAX_BYTES: usize = 23 + 2 + SIGNATURE_MAX_BYTES;
/// Why bytes were refused. Nothing was decoded and nothing changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// More bytes than allowed; they were not looked at.
    #[error("{bytes} bytes where {cap} are allowed; refused unread")]
    Oversize {
        /// Bytes received.
        bytes: usize,
        /// Bytes allowed.
        cap: usize,
    },
    /// Not CBOR of the expected shape in its shortest form.
    #[error("{field} is malformed; the record is refused")]
    Malformed {
        /// Which field.
        field: &'static str,
    },
    /// Well-formed, but beyond what the field may hold.
    #[error("{field} is out of range; the record is refused")]
    Range {
        /// Which field.
        field: &'static str,
    },
    /// Bytes after the end.
    #[error("{bytes} bytes after the end; the record is refused")]
    Trailing {
        /// How many.
        bytes: usize,
    },
    /// A kind that does not exist or is reserved.
    #[error("kind {number} is not spoken here; the record is refused")]
    Kind {
        /// Its number.
        number: u8,
    },
    /// The signature does not belong to the author and the bytes.
    #[error("the signature does not match author and bytes; the record is refused")]
    Signature,
}

/// The body of a record.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(
    missing_docs,
    reason = "each variant is documented at the type it holds"
)]
pub enum Body {
    Beacon(Beacon),
    State(State),
    Bid(Bid),
    Claim(Claim),
    Cover(Cover),
    Mission(MissionChunk),
    Operator(Order),
    Finished(Finished),
    Heartbeat(Heartbeat),
}

impl Body {
    /// Its kind.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Self::Beacon(_) => Kind::Beacon,
            Self::State(_) => Kind::State,
            Self::Bid(_) => Kind::Bid,
            Self::Claim(_) => Kind::Claim,
            Self::Cover(_) => Kind::Cover,
            Self::Mission(_) => Kind::Mission,
            Self::Operator(_) => Kind::Operator,
            Self::Finished(_) => Kind::Finished,
            Self::Heartbeat(_) => Kind::Heartbeat,
        }
    }

    /// Whether others will accept it. What a peer writes must pass; a body that does
    /// would be refused by everybody.
    ///
    /// # Errors
    /// [`WireError::Range`] with the first field that is out of range.
    pub fn check(&self) -> Result<(), WireError> {
        limits::check(self)
    }
}

/// The bytes of a body.
#[must_use]
pub fn encode_body(body: &Body) -> Vec<u8> {
    let mut out = Out::new();
    match body {
        Body::Beacon(b) => b.put(&mut out),
        Body::State(b) => b.put(&mut out),
        Body::Bid(b) => b.put(&mut out),
        Body::Claim(b) => b.put(&mut out),
        Body::Cover(b) => b.put(&mut out),
        Body::Mission(b) => b.put(&mut out),
        Body::Operator(b) => {
            out.array(1);
            b.put(&mut out);
        }
        Body::Finished(b) => b.put(&mut out),
        Body::Heartbeat(b) => b.put(&mut out),
    }
    out.into_bytes()
}

/// Reads a body of a kind.
///
/// # Errors
/// [`WireError`] where the bytes are not exactly one valid body.
pub fn decode_body(kind: Kind, bytes: &[u8]) -> Result<Body, WireError> {
    if bytes.len() > kind.cap_bytes() {
        return Err(WireError::Oversize {
            bytes: bytes.len(),
            cap: kind.cap_bytes(),
        });
    }
    let mut input = In::new(bytes);
    let body = match kind {
        Kind::Beacon => Body::Beacon(Wire::get(&mut input)?),
        Kind::State => Body::State(Wire::get(&mut input)?),
        Kind::Bid => Body::Bid(Wire::get(&mut input)?),
        Kind::Claim => Body::Claim(Wire::get(&mut input)?),
        Kind::Cover => Body::Cover(Wire::get(&mut input)?),
        Kind::Mission => Body::Mission(Wire::get(&mut input)?),
        Kind::Operator => {
            input.array("order", 1)?;
            Body::Operator(Wire::get(&mut input)?)
        }
        Kind::Finished => Body::Finished(Wire::get(&mut input)?),
        Kind::Heartbeat => Body::Heartbeat(Wire::get(&mut input)?),
        Kind::Event | Kind::Task | Kind::Intent | Kind::Conflict => {
            return Err(WireError::Kind {
                number: kind.number(),
            });
        }
    };
    input.end()?;
    body.check()?;
    Ok(body)
}

/// The bytes of a record, with the signature it holds.
#[must_use]
pub fn encode_record(record: &Record) -> Vec<u8> {
    let mut out = Out::new();
    record.put(&mut out);
    out.into_bytes()
}

/// Signs a record and returns its bytes. What its `signature` held is replaced.
#[must_use]
pub fn seal(record: &mut Record, signer: &dyn Signer) -> Vec<u8> {
    record.signature.clear();
    let unsigned = encode_record(record);
    record.signature = signer.sign(signed_part(&unsigned, 0));
    encode_record(record)
}

/// Reads a record: envelope, kind, caps. Looks neither at the body nor at the signature.
///
/// # Errors
/// [`WireError`] where the bytes are not exactly one record of a kind spoken here.
pub fn decode_record(bytes: &[u8]) -> Result<Record, WireError> {
    if bytes.len() > RECORD_MAX_BYTES {
        return Err(WireError::Oversize {
            bytes: bytes.len(),
            cap: RECORD_MAX_BYTES,
        });
    }
    let mut input = In::new(bytes);
    let record = Record::get(&mut input)?;
    input.end()?;
    let row = Kind::of_number(record.kind)
        .map(Kind::row)
        .filter(|row| row.spoken)
        .ok_or(WireError::Kind {
            number: record.kind,
        })?;
    if record.body.len() > row.cap_bytes {
        return Err(WireError::Oversize {
            bytes: record.body.len(),
            cap: row.cap_bytes,
        });
    }
    in_range("subject", record.subject < row.subjects)?;
    at_most("signature", record.signature.len(), SIGNATURE_MAX_BYTES)?;
    Ok(record)
}

/// Reads a record, judges its signature over the bytes as received, and reads its body.
///
/// # Errors
/// [`WireError`] where any of the three fails.
pub fn open(bytes: &[u8], verifier: &dyn Verifier) -> Result<(Record, Body), WireError> {
    let record = decode_record(bytes)?;
    let signed = signed_part(bytes, record.signature.len());
    if !verifier.verify(record.author, record.incarnation, signed, &record.signature) {
        return Err(WireError::Signature);
    }
    let kind = Kind::of_number(record.kind).ok_or(WireError::Kind {
        number: record.kind,
    })?;
    let body = decode_body(kind, &record.body)?;
    Ok((record, body))
}

/// All bytes before the signature, which comes last with a head of its own.
fn signed_part(bytes: &[u8], signature_len: usize) -> &[u8] {
    let head = if signature_len < 24 { 1 } else { 2 };
    &bytes[..bytes.len().saturating_sub(head + signature_len)]
}

array_of!(Record {
    author,
    incarnation,
    seq,
    kind,
    subject,
    body,
    signature
});
array_of!(Beacon {
    heartbeat,
    east_mm,
    north_mm,
    heading_e4,
    able,
    ground_station,
    finished,
    nonce,
    counter,
    eccentricity,
    interval,
    sharers,
    revision,
    loop_hash,
    cover_digest,
    gossip,
    fresh
});
array_of!(Heartbeat {
    interval,
    sharers,
    east_dm,
    north_dm,
    fresh
});
array_of!(Gossip {
    id,
    incarnation,
    heartbeat,
    age_ds,
    hops,
    interval,
    suspected_ds,
    able,
    max_seq,
    digest
});
array_of!(State {
    east_mm,
    north_mm,
    height_mm,
    heading_e4,
    airspeed_mmps,
    endurance_s,
    activity,
    mission,
    covered,
    cells
});
array_of!(Epoch { counter, hash });
array_of!(CellRun { first, count });
array_of!(MemberRun {
    first,
    count,
    incarnation
});
array_of!(Round {
    counter,
    members,
    revision,
    loop_hash,
    repair,
    wait_ms
});
array_of!(OffLoop {
    east_mm,
    north_mm,
    course_e4,
    ready_ms
});
array_of!(Bid {
    round,
    anchor,
    backward,
    release_ms,
    speed_mmps,
    turn_ms,
    endurance_ms,
    covered,
    commits,
    off_loop,
    eta_ms,
    calm,
    progressed
});
array_of!(Claim {
    revision,
    loop_hash,
    epoch,
    plan,
    held,
    eta_ms,
    alone
});
array_of!(Cover {
    revision,
    loop_hash,
    covered
});
array_of!(MissionChunk {
    revision,
    content_hash,
    chunks,
    bytes
});
array_of!(Finished { revision });
number_of!(Activity {
    Waiting,
    Covering,
    Holding,
    Returning,
    GroundStation
});
number_of!(MissionStatus {
    Active,
    Accomplished,
    Failed
});
number_of!(Order {
    Resume,
    Hold,
    ReturnToBase
});

impl Listed for Gossip {
    const MAX: usize = GOSSIP_MAX;
}
impl Listed for OffLoop {
    const MAX: usize = 1;
}
impl Listed for MemberRun {
    const MAX: usize = MEMBERS_MAX;
}

/// Heartbeats as one byte string: id, count and age by seven bits a byte, the lowest first,
/// then in two bytes three bits of the life, one of `able`, five of hops, seven of the
/// interval. An array each would take twice as much.
impl Wire for Vec<Fresh> {
    fn put(&self, out: &mut Out) {
        fresh_bytes(self).put(out);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        let bytes = <Vec<u8> as Wire>::get(input)?;
        at_most("fresh", bytes.len(), FRESH_MAX_BYTES)?;
        let malformed = WireError::Malformed { field: "fresh" };
        let mut rest = bytes.as_slice();
        let mut list = Self::new();
        while !rest.is_empty() {
            let mut number = || {
                let (value, used) = varint::read(rest).ok_or(malformed)?;
                rest = &rest[used..];
                Ok::<u32, WireError>(value)
            };
            let (id, heartbeat, age) = (number()?, number()?, number()?);
            let [high, low, ..] = *rest else {
                return Err(malformed);
            };
            rest = &rest[2..];
            let mark = u16::from_be_bytes([high, low]);
            list.push(Fresh {
                id: u16::try_from(id).map_err(|_| malformed)?,
                life: high >> 5,
                heartbeat,
                age_ds: u16::try_from(age).map_err(|_| malformed)?,
                hops: (mark >> 7 & 31) as u8,
                interval: low & 127,
                able: high >> 4 & 1 == 1,
            });
        }
        Ok(list)
    }
}

fn fresh_bytes(list: &[Fresh]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(8 * list.len());
    for f in list {
        for number in [u32::from(f.id), f.heartbeat, u32::from(f.age_ds)] {
            varint::write(&mut bytes, number);
        }
        let life_able = u16::from(f.life & 7) << 13 | u16::from(f.able) << 12;
        let mark = life_able | u16::from(f.hops & 31) << 7 | u16::from(f.interval & 127);
        bytes.extend(mark.to_be_bytes());
    }
    bytes
}

/// Members by runs of ids in the same life: a whole swarm in its first life is one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct MemberRun {
    first: u16,
    count: u16,
    incarnation: u32,
}

impl Wire for Vec<Member> {
    fn put(&self, out: &mut Out) {
        member_runs(self).put(out);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        let runs: Vec<MemberRun> = Wire::get(input)?;
        let range = WireError::Range { field: "members" };
        let many = runs.iter().map(|r| usize::from(r.count)).sum::<usize>();
        if many > MEMBERS_MAX {
            return Err(range);
        }
        let mut members = Self::with_capacity(many);
        for run in &runs {
            let last = run
                .count
                .checked_sub(1)
                .and_then(|n| run.first.checked_add(n));
            let last = last.ok_or(range)?;
            members.extend((run.first..=last).map(|id| Member {
                id,
                incarnation: run.incarnation,
            }));
        }
        // One encoding a value: runs are as long as they can be.
        if member_runs(&members) == runs {
            Ok(members)
        } else {
            Err(range)
        }
    }
}

fn member_runs(members: &[Member]) -> Vec<MemberRun> {
    let mut runs: Vec<MemberRun> = Vec::new();
    for m in members {
        match runs.last_mut() {
            Some(run)
                if run.incarnation == m.incarnation
                    && run.first.checked_add(run.count) == Some(m.id) =>
            {
                run.count += 1;
            }
            _ => runs.push(MemberRun {
                first: m.id,
                count: 1,
                incarnation: m.incarnation,
            }),
        }
    }
    runs
}
impl Listed for CellRun {
    const MAX: usize = COMMITS_MAX;
}
impl Listed for ListedRun {
    const MAX: usize = PLAN_MAX;
}

/// A listing is flat on the wire: nested arrays would cost three bytes each time.
impl Wire for ListedRun {
    fn put(&self, out: &mut Out) {
        out.array(7);
        self.run.first.put(out);
        self.run.count.put(out);
        self.backward.put(out);
        self.stamp.epoch.counter.put(out);
        self.stamp.epoch.hash.put(out);
        self.stamp.take.put(out);
        self.stamp.id.put(out);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        input.array("listing", 7)?;
        let run = CellRun {
            first: Wire::get(input)?,
            count: Wire::get(input)?,
        };
        let backward = Wire::get(input)?;
        let epoch = Epoch {
            counter: Wire::get(input)?,
            hash: Wire::get(input)?,
        };
        let stamp = Stamp {
            epoch,
            take: Wire::get(input)?,
            id: Wire::get(input)?,
        };
        Ok(Self {
            run,
            backward,
            stamp,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::limits::*;
    use super::super::samples::{fresh, golden, gossip, largest, listing};
    use super::super::signature::Off;
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

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
        let good = [6, 0xac, 2, 15, 0x51, 4];
        assert_eq!(read(&good), Ok(vec![fresh(6)]));
        assert_eq!(read(&[]), Ok(Vec::new()));
        let long = [0x86, 0, 0xac, 2, 15, 0x51, 4];
        let over = [6, 0xff, 0xff, 0xff, 0xff, 0x1f, 15, 0x51, 4];
        let endless = [0xff; 12];
        let far_id = [0x80, 0x80, 4, 0xac, 2, 15, 0x51, 4];
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
                Body::Operator(_) | Body::Finished(_) => {}
            }
        }
        assert_eq!(kinds, 7);
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
        assert_eq!(of(|r| r.kind = 9), Err(WireError::Kind { number: 9 }));
        assert_eq!(of(|r| r.kind = 13), Err(WireError::Kind { number: 13 }));
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
        fn random_bytes_never_panic(kind in 0_usize..12, bytes in vec(any::<u8>(), 0..200)) {
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
            which in 0_usize..8,
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
        fn bytes_cut_short_are_refused(which in 0_usize..8, at in any::<prop::sample::Index>()) {
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
}
