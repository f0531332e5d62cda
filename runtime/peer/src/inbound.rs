//! What a transmission turns out to be. Malformed bytes change nothing.
//!
//! | bytes | what follows |
//! |---|---|
//! | too many, malformed, out of range, an unknown kind | a report; nothing else |
//! | a signature, where nobody signs | likewise: it would be passed on for nothing |
//! | a beacon under this peer's own id, in this life or a later one, with another boot nonce | a double: `life` |
//! | anything else under its own id | an echo: `relay`; or news of another life: `life` |
//! | a heartbeat | `membership`, `relay` |
//! | a beacon | `membership`, `relay`, `cooperation` |
//! | a relayed record that is held already, or older than what is held | nothing |
//! | any other record | `cooperation` |

use crate::Incarnation;
use crate::protocol::life::Life;
use crate::wire::codec::{self, Body, WireError};
use crate::wire::kinds::Kind;
use crate::wire::message::{Beacon, Heartbeat, Record};
use crate::wire::signature::{Off, Verifier};

/// What was heard.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Heard {
    /// Bytes that are refused, and why.
    Refused(String),
    /// Another process under this peer's id, in this life or a later one, with its boot nonce.
    Double(u32, Incarnation),
    /// This peer's own id, in a life, with a heartbeat.
    Myself(Incarnation, u32),
    /// What was said under this peer's own id is passed on.
    Echo(Record),
    /// A neighbour's beacon.
    Beacon(Record, Beacon),
    /// A neighbour's heartbeat.
    Heartbeat(Record, Heartbeat),
    /// A record of another peer.
    Record(Kind, Record, Body),
}

/// Reads one transmission as the peer `me` in its present life.
pub(crate) fn read(bytes: &[u8], me: u16, life: &Life) -> Heard {
    let record = match codec::decode_record(bytes) {
        Ok(record) => record,
        Err(why) => return Heard::Refused(why.to_string()),
    };
    if !Off.verify(record.author, record.incarnation, bytes, &record.signature) {
        return Heard::Refused(WireError::Signature.to_string());
    }
    let Some(kind) = Kind::of_number(record.kind) else {
        return Heard::Refused("a kind of a later version".into());
    };
    let body = match codec::decode_body(kind, &record.body) {
        Ok(body) => body,
        Err(why) => return Heard::Refused(why.to_string()),
    };
    match body {
        Body::Beacon(b) if record.author == me => {
            // Beacons are passed on by nobody, so whoever says one is there.
            if record.incarnation >= life.incarnation() && b.nonce != life.nonce() {
                Heard::Double(b.nonce, record.incarnation)
            } else {
                Heard::Myself(record.incarnation, b.heartbeat)
            }
        }
        // Of a double its next beacon tells, with a nonce.
        Body::Heartbeat(_) if record.author == me => Heard::Myself(record.incarnation, 0),
        _ if record.author == me => Heard::Echo(record),
        Body::Beacon(beacon) => Heard::Beacon(record, beacon),
        Body::Heartbeat(heartbeat) => Heard::Heartbeat(record, heartbeat),
        body => Heard::Record(kind, record, body),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::message::Finished;
    use crate::wire::signature::SIGNATURE_MAX_BYTES;

    #[test]
    fn a_record_that_carries_a_signature_is_refused_where_nobody_signs() {
        let record = Record {
            author: 2,
            incarnation: 1,
            seq: 1,
            kind: Kind::Finished.number(),
            subject: 0,
            body: codec::encode_body(&Body::Finished(Finished { revision: 1 })),
            signature: Vec::new(),
        };
        let heard = |record: &Record| read(&codec::encode_record(record), 1, &Life::default());
        assert!(matches!(heard(&record), Heard::Record(..)));
        for n_bytes in [1, SIGNATURE_MAX_BYTES] {
            let signed = Record {
                signature: vec![7; n_bytes],
                ..record.clone()
            };
            let Heard::Refused(why) = heard(&signed) else {
                panic!("{n_bytes} bytes of signature are accepted")
            };
            assert!(why.contains("signature"), "{why}");
        }
    }
}
