//! A JSON Schema per kind, so that a subscriber in any language needs no source of ours.
//!
//! The formats of docs/protocol.md §7. A body is a CBOR array; the schemas
//! describe its data model and name the places of the array. What no schema can say
//! (members ascend, positions are those of a mission) is in the descriptions.

use super::kinds::Kind;
use super::limits::{
    ACCEPTS_MAX, BID_COVERED_MAX_BYTES, CHUNK_MAX_BYTES, CHUNKS_MAX, COMMITS_MAX,
    COVERED_MAX_BYTES, DURATION_MAX_MS, FRESH_MAX_BYTES, GOSSIP_MAX, HEADING_MAX_E4, HELD_MAX,
    HOPS_MAX, INTERVAL_LEAST, INTERVAL_MOST, LACKING_MAX_BYTES, MEMBERS_MAX, PEERS_MAX, PLAN_MAX,
    POSITION_MAX_MM, SPEED_MAX_MMPS,
};
use core::fmt::Write as _;
use skein_behaviors::order::SINGLES_MAX;
use skein_flight::separation::motion::{HEADING_MOST_E7, STRETCHES_MAX};

/// What a place of an array may hold.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// A number from the first to the second.
    Number(i128, i128),
    /// True or false.
    Flag,
    /// A byte string of at most so many bytes.
    Bytes(usize),
    /// A number that stands for one of these.
    Choice(&'static [&'static str]),
    /// A number up to this, or null.
    Maybe(i128),
    /// At most so many arrays of these places.
    Rows(&'static [Place], usize),
    /// One array of these places.
    Row(&'static [Place]),
}

/// A place of an array.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Its name.
    pub name: &'static str,
    /// What it means, with its unit.
    pub what: &'static str,
    /// What it may hold.
    pub shape: Shape,
}

pub(super) const fn at(name: &'static str, what: &'static str, shape: Shape) -> Place {
    Place { name, what, shape }
}

pub(super) const U8: Shape = Shape::Number(0, u8::MAX as i128);
pub(super) const U16: Shape = Shape::Number(0, u16::MAX as i128);
const COUNT: Shape = Shape::Number(1, u16::MAX as i128);
pub(super) const U32: Shape = Shape::Number(0, u32::MAX as i128);
const I32: Shape = Shape::Number(i32::MIN as i128, i32::MAX as i128);
const U64: Shape = Shape::Number(0, u64::MAX as i128);
const INTERVAL: Shape = Shape::Number(INTERVAL_LEAST as i128, INTERVAL_MOST as i128);
const HOPS: Shape = Shape::Number(0, HOPS_MAX as i128);
pub(super) const MM: Shape = Shape::Number(-(POSITION_MAX_MM as i128), POSITION_MAX_MM as i128);
const E4: Shape = Shape::Number(-(HEADING_MAX_E4 as i128), HEADING_MAX_E4 as i128);
const SPEED: Shape = Shape::Number(0, SPEED_MAX_MMPS as i128);
pub(super) const MMPS: Shape = Shape::Number(-(SPEED_MAX_MMPS as i128), SPEED_MAX_MMPS as i128);
pub(super) const MS: Shape = Shape::Number(0, DURATION_MAX_MS as i128);

const REVISION: Place = at("revision", "mission revision", U32);
const LOOP_HASH: Place = at("loop_hash", "identifies the loop; 0 for none", U64);
const EAST: Place = at("east_mm", "mm east of the mission's origin", MM);
const NORTH: Place = at("north_mm", "mm north of the mission's origin", MM);
const HEADING: Place = at("heading_e4", "1e-4 rad counter-clockwise from east", E4);
const ETA: Place = at("eta_ms", "expected end of the plan, ms from writing", MS);

const SHARERS: Place = at(
    "sharers",
    "how many it counts in its earshot, itself included",
    Shape::Number(0, PEERS_MAX as i128 + 1),
);

const FRESH: Place = at(
    "fresh",
    "heartbeats of others, ascending by id; of each: id, count and age (100 ms), seven bits a byte, the lowest first; then in two bytes three bits of the life, one whether it can plan, five of the hops, one whether it is suspected, six of the interval less one; then the age of the suspicion, likewise, if there is one",
    Shape::Bytes(FRESH_MAX_BYTES),
);

const ENVELOPE: &[Place] = &[
    at("author", "who wrote it", U16),
    at("incarnation", "in which life", U32),
    at(
        "seq",
        "counts what the author wrote in this life; beacons and heartbeats count for themselves",
        U32,
    ),
    at("kind", "number of the kind", U8),
    at(
        "subject",
        "which of the author's registers of that kind",
        U16,
    ),
    at("body", "the encoded body", Shape::Bytes(4096)),
    at(
        "signature",
        "over all bytes before it; empty where signing is off",
        Shape::Bytes(64),
    ),
];

const GOSSIP: &[Place] = &[
    at("id", "whom it concerns", U16),
    at("incarnation", "the latest life known", U32),
    at("heartbeat", "the freshest heartbeat known", U32),
    at("age_ds", "its age, sum of holding times, 100 ms", U16),
    at("hops", "fewest hops to its author of late", HOPS),
    at(
        "interval",
        "what its author announced, quarters of T",
        INTERVAL,
    ),
    at(
        "suspected_ds",
        "age of a suspicion against it, 100 ms, or null",
        Shape::Maybe(u16::MAX as i128),
    ),
    at("able", "whether it said it can plan", Shape::Flag),
    at("max_seq", "highest seq held of that author and life", U32),
    at("digest", "of the versions held of that author", U16),
];

const BEACON: &[Place] = &[
    at("heartbeat", "counts the beacons of this life", U32),
    EAST,
    NORTH,
    HEADING,
    at("able", "whether it can take part in planning", Shape::Flag),
    at(
        "ground_station",
        "whether it is a ground station",
        Shape::Flag,
    ),
    at(
        "finished",
        "whether it holds that the mission is finished",
        Shape::Flag,
    ),
    at("nonce", "boot nonce", U32),
    at("counter", "the highest round counter it knows", U32),
    at(
        "eccentricity",
        "fewest hops to its farthest live author",
        HOPS,
    ),
    at("interval", "until its next beacon, quarters of T", INTERVAL),
    SHARERS,
    REVISION,
    LOOP_HASH,
    at("cover_digest", "digest of its union of covered cells", U32),
    at(
        "gossip",
        "what it knows of others",
        Shape::Rows(GOSSIP, GOSSIP_MAX),
    ),
    FRESH,
];

const DM: Shape = Shape::Number(
    -(POSITION_MAX_MM as i128) / 100,
    POSITION_MAX_MM as i128 / 100,
);

const HEARTBEAT: &[Place] = &[
    at(
        "interval",
        "until its next beacon from the last one, quarters of T",
        INTERVAL,
    ),
    SHARERS,
    at("east_dm", "dm east of the mission's origin", DM),
    at("north_dm", "dm north of the mission's origin", DM),
    FRESH,
];

const STATE: &[Place] = &[
    EAST,
    NORTH,
    at("height_mm", "mm above the mission's origin", MM),
    HEADING,
    at("airspeed_mmps", "mm/s", SPEED),
    at(
        "endurance_s",
        "flight time left, s",
        Shape::Number(0, DURATION_MAX_MS as i128 / 1000),
    ),
    at(
        "activity",
        "what it does",
        Shape::Choice(&[
            "waiting",
            "covering",
            "holding",
            "returning",
            "ground station",
        ]),
    ),
    at(
        "mission",
        "how the mission stands",
        Shape::Choice(&["active", "accomplished", "failed"]),
    ),
    at(
        "covered",
        "cells it knows to be covered, at most `cells`",
        U16,
    ),
    at("cells", "cells of the loop", U16),
];

const RUN: &[Place] = &[
    at("first", "first cell", U16),
    at("count", "how many, cyclic", COUNT),
];

const MEMBERS: &[Place] = &[
    at("first", "the first of them, ascending", U16),
    at("count", "how many ids in a row", COUNT),
    at("incarnation", "in which life", U32),
];

const ROUND: &[Place] = &[
    at(
        "counter",
        "one more than any counter the starter had seen",
        U32,
    ),
    at(
        "members",
        "who takes part, in runs of ids in the same life",
        Shape::Rows(MEMBERS, MEMBERS_MAX),
    ),
    REVISION,
    LOOP_HASH,
    at(
        "repair",
        "whether the starter saw cells that nobody lists",
        Shape::Flag,
    ),
    at("wait_ms", "how long to wait for all bids, ms", MS),
];

const OFF_LOOP: &[Place] = &[
    at("east_mm", "east, mm", MM),
    at("north_mm", "north, mm", MM),
    at("course_e4", "course over the ground, 1e-4 rad", E4),
    at("ready_ms", "when it can leave, ms from writing", MS),
];

const BID: &[Place] = &[
    at("round", "the round it belongs to", Shape::Row(ROUND)),
    at("anchor", "boundary of the loop where it will be", U16),
    at(
        "backward",
        "whether it looks against the order of the loop there",
        Shape::Flag,
    ),
    at("release_ms", "when, ms from writing", MS),
    at("speed_mmps", "ground speed, mm/s", SPEED),
    at("turn_ms", "time to turn round, ms", MS),
    at(
        "endurance_ms",
        "flight time it may spend after its release, ms",
        MS,
    ),
    at(
        "covered",
        "covered cells, run lengths",
        Shape::Bytes(BID_COVERED_MAX_BYTES),
    ),
    at(
        "commits",
        "cells it will finish whatever is decided",
        Shape::Rows(RUN, COMMITS_MAX),
    ),
    at(
        "off_loop",
        "where it is, if it can leave for anywhere",
        Shape::Rows(OFF_LOOP, 1),
    ),
    ETA,
    at(
        "calm",
        "whether it adopted its last division long ago",
        Shape::Flag,
    ),
    at("progressed", "whether it covered a cell since", Shape::Flag),
];

const EPOCH: &[Place] = &[
    at("counter", "counter of the round", U32),
    at("hash", "hash of the round's bids", U32),
];

const LISTING: &[Place] = &[
    at("first", "first cell", U16),
    at("count", "how many, cyclic", COUNT),
    at(
        "backward",
        "whether they are flown against the order of the loop",
        Shape::Flag,
    ),
    at("counter", "stamp: counter of the round", U32),
    at("hash", "stamp: hash of the round's bids", U32),
    at("take", "stamp: takes without a round since", U16),
    at("id", "stamp: who lists it", U16),
];

const CLAIM: &[Place] = &[
    REVISION,
    LOOP_HASH,
    at("epoch", "the latest division adopted", Shape::Row(EPOCH)),
    at(
        "plan",
        "what it will fly, in order",
        Shape::Rows(LISTING, PLAN_MAX),
    ),
    at(
        "held",
        "what it gave away and nobody has taken over yet",
        Shape::Rows(LISTING, HELD_MAX),
    ),
    ETA,
    at("alone", "whether its author hears nobody", Shape::Flag),
];

const COVER: &[Place] = &[
    REVISION,
    LOOP_HASH,
    at(
        "covered",
        "covered cells, run lengths",
        Shape::Bytes(COVERED_MAX_BYTES),
    ),
];

const MISSION: &[Place] = &[
    REVISION,
    at("content_hash", "hash of the content", U64),
    at(
        "chunks",
        "pieces; the subject is this piece's number",
        Shape::Number(1, CHUNKS_MAX as i128),
    ),
    at("bytes", "the piece", Shape::Bytes(CHUNK_MAX_BYTES)),
];

const ORDER: Shape = Shape::Choice(&["resume", "hold", "return to base"]);

const SINGLE: &[Place] = &[
    at("uav", "number of the UAV", U16),
    at("order", "what it is to do, another thing than all", ORDER),
];

const OPERATOR: &[Place] = &[
    at("order", "what all are to do that are not listed", ORDER),
    at(
        "singles",
        "what single UAVs are to do, ascending by their numbers",
        Shape::Rows(SINGLE, SINGLES_MAX),
    ),
];

const FINISHED: &[Place] = &[REVISION];

const LACKING: &[Place] = &[
    REVISION,
    at("content_hash", "hash of the content", U64),
    at(
        "holders",
        "neighbours that follow that revision or a newer one",
        Shape::Number(0, PEERS_MAX as i128),
    ),
    at(
        "pieces",
        "a bit for each piece that is lacking, the first lowest",
        Shape::Bytes(LACKING_MAX_BYTES),
    ),
];

const AIRSPEED: Place = at("airspeed_mmps", "airspeed, mm/s", SPEED);

const STRETCH: &[Place] = &[
    at(
        "radius_mm",
        "radius of the turn, mm, positive to the left; 0 on a line",
        I32,
    ),
    at("length_mm", "length, mm", U32),
    AIRSPEED,
];

const PROMISE: &[Place] = &[
    at("version", "counts what the author promised", U32),
    at(
        "start_ms",
        "when it begins, ms of the clock that all share",
        U64,
    ),
    EAST,
    NORTH,
    at(
        "heading_e7",
        "1e-7 rad counter-clockwise from east",
        Shape::Number(-(HEADING_MOST_E7 as i128), HEADING_MOST_E7 as i128),
    ),
    at(
        "stretches",
        "what is flown",
        Shape::Rows(STRETCH, STRETCHES_MAX),
    ),
    at(
        "radius_mm",
        "the circle at its end, as for a stretch; 0 where it leaves the airspace",
        I32,
    ),
    AIRSPEED,
];

const ACCEPTED: &[Place] = &[
    at("id", "whose promise", U16),
    at("version", "which one", U32),
];

const INTENT: &[Place] = &[
    at("number", "counts what the author says of its flight", U32),
    at(
        "endurance_s",
        "when the mission began, s: who has less goes before",
        Shape::Number(0, DURATION_MAX_MS as i128 / 1000),
    ),
    at("in_force", "what it flies", Shape::Row(PROMISE)),
    at(
        "proposal",
        "what it would rather fly, or nothing",
        Shape::Rows(PROMISE, 1),
    ),
    at(
        "accepts",
        "what it has accepted of others and is still on offer, ascending by id",
        Shape::Rows(ACCEPTED, ACCEPTS_MAX),
    ),
];

const CONFLICT: &[Place] = &[
    at(
        "number",
        "counts what the author says of its flight, with intents",
        U32,
    ),
    at(
        "in_force",
        "the version of what it flies",
        Shape::Number(1, u32::MAX as i128),
    ),
    at(
        "proposal",
        "the version of what it would rather fly; 0 for none",
        U32,
    ),
    at(
        "accepts",
        "what it has accepted of others and is still on offer, ascending by id",
        Shape::Rows(ACCEPTED, ACCEPTS_MAX),
    ),
];

/// The places of a kind's body; `None` for a reserved kind.
#[must_use]
pub fn places(kind: Kind) -> Option<&'static [Place]> {
    match kind {
        Kind::Beacon => Some(BEACON),
        Kind::State => Some(STATE),
        Kind::Bid => Some(BID),
        Kind::Claim => Some(CLAIM),
        Kind::Cover => Some(COVER),
        Kind::Mission => Some(MISSION),
        Kind::Operator => Some(OPERATOR),
        Kind::Finished => Some(FINISHED),
        Kind::Heartbeat => Some(HEARTBEAT),
        Kind::Lacking => Some(LACKING),
        Kind::Intent => Some(INTENT),
        Kind::Conflict => Some(CONFLICT),
        Kind::Task => Some(super::tasks::TASK),
        Kind::Bundle => Some(super::tasks::BUNDLE),
        Kind::Target => Some(super::target::TARGET),
        Kind::Detection => Some(super::detection::DETECTION),
        Kind::Trail => Some(super::trail::TRAIL),
        Kind::Count => Some(super::count::COUNT),
        Kind::Usage => Some(super::usage::USAGE),
        Kind::Crowd => Some(super::crowd::CROWD),
        Kind::Obstacle => Some(super::obstacle::OBSTACLES),
        Kind::Aircraft => Some(super::aircraft::SENSED),
        Kind::Event => None,
    }
}

/// The JSON Schema of a kind's body; `None` for a reserved kind.
#[must_use]
pub fn schema(kind: Kind) -> Option<String> {
    places(kind).map(|places| document(kind.name(), places))
}

/// The JSON Schema of the envelope around every body.
#[must_use]
pub fn envelope_schema() -> String {
    document(ENVELOPE_NAME, ENVELOPE)
}

/// Under which name the envelope is asked for.
pub const ENVELOPE_NAME: &str = "record";

/// All schemas by the name under which they are asked for: the envelope's, then those of the
/// kinds.
pub fn all() -> impl Iterator<Item = (&'static str, String)> {
    let kinds = Kind::ALL.into_iter();
    let kinds = kinds.filter_map(|kind| Some((kind.name(), schema(kind)?)));
    core::iter::once((ENVELOPE_NAME, envelope_schema())).chain(kinds)
}

fn document(title: &str, places: &[Place]) -> String {
    let mut out = String::from("{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",");
    put(
        &mut out,
        format_args!("\"title\":\"skein {} {title}\",", super::key::VERSION),
    );
    row(&mut out, places);
    out.push('}');
    out
}

fn put(out: &mut String, text: core::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = out.write_fmt(text);
}

/// The members of a schema of one array, without braces.
fn row(out: &mut String, places: &[Place]) {
    out.push_str("\"type\":\"array\",\"prefixItems\":[");
    for (i, place) in places.iter().enumerate() {
        if i > 0 {
            out.push(',');
        }
        // Names and descriptions are ours and hold nothing that needs escaping.
        put(
            out,
            format_args!(
                "{{\"title\":\"{}\",\"description\":\"{}",
                place.name, place.what
            ),
        );
        if let Shape::Choice(names) = place.shape {
            for (n, name) in names.iter().enumerate() {
                put(
                    out,
                    format_args!("{} {n} {name}", if n == 0 { ":" } else { "," }),
                );
            }
        }
        out.push_str("\",");
        shape(out, place.shape);
        out.push('}');
    }
    let n = places.len();
    put(
        out,
        format_args!("],\"items\":false,\"minItems\":{n},\"maxItems\":{n}"),
    );
}

fn shape(out: &mut String, shape: Shape) {
    match shape {
        Shape::Number(min, max) => {
            put(
                out,
                format_args!("\"type\":\"integer\",\"minimum\":{min},\"maximum\":{max}"),
            );
        }
        Shape::Flag => out.push_str("\"type\":\"boolean\""),
        Shape::Bytes(max) => {
            // JSON has no byte strings: as text they are base64, four characters for three bytes.
            let max = max.div_ceil(3) * 4;
            put(
                out,
                format_args!(
                    "\"type\":\"string\",\"contentEncoding\":\"base64\",\"maxLength\":{max}"
                ),
            );
        }
        Shape::Choice(names) => {
            let max = names.len().saturating_sub(1);
            put(
                out,
                format_args!("\"type\":\"integer\",\"minimum\":0,\"maximum\":{max}"),
            );
        }
        Shape::Maybe(max) => {
            put(
                out,
                format_args!("\"type\":[\"integer\",\"null\"],\"minimum\":0,\"maximum\":{max}"),
            );
        }
        Shape::Rows(places, max) => {
            put(
                out,
                format_args!("\"type\":\"array\",\"maxItems\":{max},\"items\":{{"),
            );
            row(out, places);
            out.push('}');
        }
        Shape::Row(places) => row(out, places),
    }
}

#[cfg(test)]
mod tests {
    use super::super::codec::{self, encode_body};
    use super::super::message::Record;
    use super::super::samples::{golden, largest};
    use super::*;
    use cbor4ii::core::Value;
    use cbor4ii::core::dec::Decode;
    use cbor4ii::core::utils::SliceReader;

    fn fits(shape: Shape, value: &Value) -> bool {
        match (shape, value) {
            (Shape::Number(min, max), Value::Integer(v)) => (min..=max).contains(v),
            (Shape::Flag, Value::Bool(_)) | (Shape::Maybe(_), Value::Null) => true,
            (Shape::Bytes(max), Value::Bytes(b)) => b.len() <= max,
            (Shape::Choice(names), Value::Integer(v)) => {
                usize::try_from(*v).is_ok_and(|v| v < names.len())
            }
            (Shape::Maybe(max), Value::Integer(v)) => (0..=max).contains(v),
            (Shape::Rows(places, max), Value::Array(rows)) => {
                rows.len() <= max && rows.iter().all(|r| fits(Shape::Row(places), r))
            }
            (Shape::Row(places), Value::Array(values)) => {
                places.len() == values.len()
                    && places.iter().zip(values).all(|(p, v)| fits(p.shape, v))
            }
            _ => false,
        }
    }

    fn value(bytes: &[u8]) -> Value {
        Value::decode(&mut SliceReader::new(bytes)).unwrap()
    }

    #[test]
    fn schemas_say_what_the_codec_writes() {
        let bodies = golden().into_iter().map(|(body, _)| body).chain(largest());
        for body in bodies {
            let places = places(body.kind()).unwrap();
            let bytes = encode_body(&body);
            assert!(
                fits(Shape::Row(places), &value(&bytes)),
                "{:?}",
                body.kind()
            );
            let mut record = Record {
                author: 1,
                incarnation: 1,
                seq: 1,
                kind: body.kind().number(),
                subject: 0,
                body: bytes,
                signature: Vec::new(),
            };
            let bytes = codec::seal(&mut record, &super::super::signature::Off);
            assert!(fits(Shape::Row(ENVELOPE), &value(&bytes)));
        }
    }

    #[test]
    fn a_body_with_a_place_more_or_beyond_its_limit_does_not_fit() {
        assert!(fits(
            Shape::Row(FINISHED),
            &Value::Array(vec![Value::Integer(3)])
        ));
        assert!(!fits(
            Shape::Row(FINISHED),
            &Value::Array(vec![Value::Integer(3); 2])
        ));
        assert!(!fits(
            Shape::Row(FINISHED),
            &Value::Array(vec![Value::Integer(1 << 32)])
        ));
        assert!(!fits(
            Shape::Row(OPERATOR),
            &Value::Array(vec![Value::Integer(3), Value::Array(vec![])])
        ));
    }

    #[test]
    fn every_spoken_kind_has_a_schema_in_plain_json() {
        for kind in Kind::ALL {
            assert_eq!(schema(kind).is_some(), kind.row().spoken);
        }
        let texts = Kind::ALL
            .into_iter()
            .filter_map(schema)
            .chain([envelope_schema()]);
        for text in texts {
            for (open, close) in [('{', '}'), ('[', ']')] {
                let count = |c| text.chars().filter(|x| *x == c).count();
                assert_eq!(count(open), count(close));
            }
            assert_eq!(text.matches('"').count() % 2, 0);
            assert!(!text.contains('\\') && !text.contains(",}") && !text.contains(",]"));
        }
        assert_eq!(
            schema(Kind::Finished).unwrap(),
            "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\
             \"title\":\"skein v4 finished\",\"type\":\"array\",\"prefixItems\":[\
             {\"title\":\"revision\",\"description\":\"mission revision\",\
             \"type\":\"integer\",\"minimum\":0,\"maximum\":4294967295}],\
             \"items\":false,\"minItems\":1,\"maxItems\":1}"
        );
    }
}
