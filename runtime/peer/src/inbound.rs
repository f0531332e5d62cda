//! What a transmission turns out to be. Malformed bytes change nothing.
//!
//! | bytes | what follows |
//! |---|---|
//! | too many, malformed, out of range, an unknown kind | a report; nothing else |
//! | a beacon under this peer's own id and life with another boot nonce | a double: `life` |
//! | anything else under its own id | an echo, or news of another life: `life` |
//! | a beacon | `membership`, `relay`, `cooperation` |
//! | a relayed record that is held already, or older than what is held | nothing |
//! | any other record | `cooperation` |

use crate::Incarnation;
use crate::protocol::life::Life;
use crate::wire::codec::{self, Body};
use crate::wire::kinds::Kind;
use crate::wire::message::{Beacon, Record};

/// What was heard.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Heard {
    /// Bytes that are refused, and why.
    Refused(String),
    /// Another peer under this peer's id and life, with its boot nonce.
    Double(u32),
    /// This peer's own id, in a life, with a heartbeat.
    Myself(Incarnation, u32),
    /// A neighbour's beacon.
    Beacon(Record, Beacon),
    /// A record of another peer.
    Record(Kind, Record, Body),
}

/// Reads one transmission as the peer `me` in its present life.
pub(crate) fn read(bytes: &[u8], me: u16, life: &Life) -> Heard {
    let record = match codec::decode_record(bytes) {
        Ok(record) => record,
        Err(why) => return Heard::Refused(why.to_string()),
    };
    let Some(kind) = Kind::of_number(record.kind) else {
        return Heard::Refused("a kind of a later version".into());
    };
    let body = match codec::decode_body(kind, &record.body) {
        Ok(body) => body,
        Err(why) => return Heard::Refused(why.to_string()),
    };
    match body {
        Body::Beacon(b) if record.author == me => {
            if record.incarnation == life.incarnation() && b.nonce != life.nonce() {
                Heard::Double(b.nonce)
            } else {
                Heard::Myself(record.incarnation, b.heartbeat)
            }
        }
        _ if record.author == me => Heard::Myself(record.incarnation, 0),
        Body::Beacon(beacon) => Heard::Beacon(record, beacon),
        body => Heard::Record(kind, record, body),
    }
}
