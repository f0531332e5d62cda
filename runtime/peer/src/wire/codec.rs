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

use super::aircraft::SensedAircraft;
use super::cbor::{In, Listed, Out, Wire, array_of, in_field, number_of};
use super::count::Count;
use super::crowd::CrowdTile;
use super::detection::Detection;
use super::kinds::{Kind, RECORD_MAX_BYTES};
use super::limits::{
    self, COMMITS_MAX, FRESH_MAX_BYTES, GOSSIP_MAX, MEMBERS_MAX, PLAN_MAX, at_most, in_range,
};
use super::message::{
    Activity, Beacon, Bid, CellRun, Claim, Cover, Epoch, Finished, Fresh, Gossip, Heartbeat,
    Lacking, ListedRun, Member, MissionChunk, MissionStatus, OffLoop, Order, Orders, Record, Round,
    Stamp, State,
};
use super::obstacle::FoundObstacles;
use super::signature::{SIGNATURE_MAX_BYTES, Signer, Verifier};
use super::target::Target;
use super::tasks::{Bundle, Task};
use super::trail::Trail;
use super::usage::Usage;
use crate::protocol::conflict::Intent;
use crate::protocol::promises::Brief;
use crate::varint;
use skein_behaviors::order::SINGLES_MAX;

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
    Operator(Orders),
    Finished(Finished),
    Heartbeat(Heartbeat),
    Lacking(Lacking),
    Intent(Intent),
    Conflict(Brief),
    Task(Task),
    Bundle(Bundle),
    Target(Target),
    Detection(Detection),
    Trail(Trail),
    Count(Count),
    Usage(Usage),
    Crowd(CrowdTile),
    Obstacles(FoundObstacles),
    Aircraft(SensedAircraft),
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
            Self::Lacking(_) => Kind::Lacking,
            Self::Intent(_) => Kind::Intent,
            Self::Conflict(_) => Kind::Conflict,
            Self::Task(_) => Kind::Task,
            Self::Bundle(_) => Kind::Bundle,
            Self::Target(_) => Kind::Target,
            Self::Detection(_) => Kind::Detection,
            Self::Trail(_) => Kind::Trail,
            Self::Count(_) => Kind::Count,
            Self::Usage(_) => Kind::Usage,
            Self::Crowd(_) => Kind::Crowd,
            Self::Obstacles(_) => Kind::Obstacle,
            Self::Aircraft(_) => Kind::Aircraft,
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
        Body::Operator(b) => b.put(&mut out),
        Body::Finished(b) => b.put(&mut out),
        Body::Heartbeat(b) => b.put(&mut out),
        Body::Lacking(b) => b.put(&mut out),
        Body::Intent(b) => b.put(&mut out),
        Body::Conflict(b) => b.put(&mut out),
        Body::Task(b) => b.put(&mut out),
        Body::Bundle(b) => b.put(&mut out),
        Body::Target(b) => b.put(&mut out),
        Body::Detection(b) => b.put(&mut out),
        Body::Trail(b) => b.put(&mut out),
        Body::Count(b) => b.put(&mut out),
        Body::Usage(b) => b.put(&mut out),
        Body::Crowd(b) => b.put(&mut out),
        Body::Obstacles(b) => b.put(&mut out),
        Body::Aircraft(b) => b.put(&mut out),
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
        Kind::Operator => Body::Operator(Wire::get(&mut input)?),
        Kind::Finished => Body::Finished(Wire::get(&mut input)?),
        Kind::Heartbeat => Body::Heartbeat(Wire::get(&mut input)?),
        Kind::Lacking => Body::Lacking(Wire::get(&mut input)?),
        Kind::Intent => Body::Intent(Wire::get(&mut input)?),
        Kind::Conflict => Body::Conflict(Wire::get(&mut input)?),
        Kind::Task => Body::Task(Wire::get(&mut input)?),
        Kind::Bundle => Body::Bundle(Wire::get(&mut input)?),
        Kind::Target => Body::Target(Wire::get(&mut input)?),
        Kind::Detection => Body::Detection(Wire::get(&mut input)?),
        Kind::Trail => Body::Trail(Wire::get(&mut input)?),
        Kind::Count => Body::Count(Wire::get(&mut input)?),
        Kind::Usage => Body::Usage(Wire::get(&mut input)?),
        Kind::Crowd => Body::Crowd(Wire::get(&mut input)?),
        Kind::Obstacle => Body::Obstacles(Wire::get(&mut input)?),
        Kind::Aircraft => Body::Aircraft(Wire::get(&mut input)?),
        Kind::Event => {
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
array_of!(Lacking {
    revision,
    content_hash,
    holders,
    pieces
});
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

/// An order to one UAV.
struct Single {
    uav: u16,
    order: Order,
}
array_of!(Single { uav, order });
impl Listed for Single {
    const MAX: usize = SINGLES_MAX;
}

impl Wire for Orders {
    fn put(&self, out: &mut Out) {
        out.array(2);
        self.all.put(out);
        let singles = self.singles.iter();
        let singles: Vec<Single> = singles
            .map(|(uav, order)| Single {
                uav: *uav,
                order: *order,
            })
            .collect();
        singles.put(out);
    }

    fn get(input: &mut In<'_>) -> Result<Self, WireError> {
        input.array("Orders", 2)?;
        let all = Wire::get(input).map_err(|e| in_field(e, "order"))?;
        let listed: Vec<Single> = Wire::get(input).map_err(|e| in_field(e, "singles"))?;
        if listed.windows(2).any(|pair| pair[0].uav >= pair[1].uav) {
            return Err(WireError::Range { field: "singles" });
        }
        let singles = listed.into_iter().map(|s| (s.uav, s.order)).collect();
        Ok(Self { all, singles })
    }
}

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
        let number = |rest: &mut &[u8]| {
            let (value, used) = varint::read(rest).ok_or(malformed)?;
            *rest = &rest[used..];
            Ok::<u32, WireError>(value)
        };
        let mut rest = bytes.as_slice();
        let mut list = Self::new();
        while !rest.is_empty() {
            let (id, heartbeat, age) = (number(&mut rest)?, number(&mut rest)?, number(&mut rest)?);
            let [high, low, ..] = *rest else {
                return Err(malformed);
            };
            rest = &rest[2..];
            let mark = u16::from_be_bytes([high, low]);
            let is_suspected = low >> 6 & 1 == 1;
            let suspected = is_suspected.then(|| number(&mut rest)).transpose()?;
            list.push(Fresh {
                id: u16::try_from(id).map_err(|_| malformed)?,
                life: high >> 5,
                heartbeat,
                age_ds: u16::try_from(age).map_err(|_| malformed)?,
                hops: (mark >> 7 & 31) as u8,
                interval: (low & 63) + 1,
                able: high >> 4 & 1 == 1,
                suspected_ds: suspected
                    .map(u16::try_from)
                    .transpose()
                    .map_err(|_| malformed)?,
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
        let suspected = u16::from(f.suspected_ds.is_some()) << 6;
        let interval = u16::from(f.interval.wrapping_sub(1) & 63);
        let mark = life_able | u16::from(f.hops & 31) << 7 | suspected | interval;
        bytes.extend(mark.to_be_bytes());
        if let Some(age_ds) = f.suspected_ds {
            varint::write(&mut bytes, u32::from(age_ds));
        }
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
mod tests;
