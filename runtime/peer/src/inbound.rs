//! What a transmission turns out to be. Malformed bytes change nothing.
//!
//! | bytes | what follows |
//! |---|---|
//! | too many, malformed, out of range, an unknown kind | a report; nothing else |
//! | a signature, where nobody signs | likewise: it would be passed on for nothing |
//! | a beacon or a heartbeat under this peer's own id, a beacon with another boot nonce | a twin: `life` |
//! | anything else under its own id | an echo: `relay`; or news of another life: `life` |
//! | a heartbeat | `membership`, `relay` |
//! | a beacon | `membership`, `relay`, `cooperation` |
//! | what a neighbour lacks of a mission | `relay` |
//! | a relayed record that is held already, or older than what is held | nothing |
//! | any other record | `cooperation` |

use crate::mission::point_m;
use crate::protocol::life::{Life, Twin};
use crate::transmission::Transmission;
use crate::wire::codec::Body;
use crate::wire::kinds::Kind;
use crate::wire::message::{Beacon, Heartbeat, Record};
use skein_geometry::frame::Point;

/// What was heard.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Heard<'a> {
    /// Bytes that are refused, and why.
    Refused(&'a str),
    /// Another process under this peer's id, and where it is.
    Twin(Twin, Point),
    /// This peer's own beacon.
    Myself,
    /// What was said under this peer's own id is passed on.
    Echo(&'a Record),
    /// A neighbour's beacon.
    Beacon(&'a Record, &'a Beacon),
    /// A neighbour's heartbeat.
    Heartbeat(&'a Record, &'a Heartbeat),
    /// A record of another peer.
    Record(Kind, &'a Record, &'a Body),
}

/// What one transmission is to the peer `me` in its present life.
pub(crate) fn sort<'a>(heard: &'a Transmission, me: u16, life: &Life) -> Heard<'a> {
    let (kind, record, body) = match heard.said() {
        Ok(said) => said,
        Err(why) => return Heard::Refused(why),
    };
    match body {
        // Beacons and heartbeats are passed on by nobody, so whoever says one is there.
        Body::Beacon(b) if record.author == me => {
            let twin = Twin {
                incarnation: record.incarnation,
                heartbeat: b.heartbeat,
                nonce: Some(b.nonce),
            };
            if b.nonce == life.nonce() {
                Heard::Myself
            } else {
                Heard::Twin(twin, point_m((b.east_mm, b.north_mm)))
            }
        }
        Body::Heartbeat(h) if record.author == me => {
            let twin = Twin {
                incarnation: record.incarnation,
                heartbeat: record.seq,
                nonce: None,
            };
            let at = Point::new(f64::from(h.east_dm) / 10.0, f64::from(h.north_dm) / 10.0);
            Heard::Twin(twin, at)
        }
        _ if record.author == me => Heard::Echo(record),
        Body::Beacon(beacon) => Heard::Beacon(record, beacon),
        Body::Heartbeat(heartbeat) => Heard::Heartbeat(record, heartbeat),
        body => Heard::Record(kind, record, body),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::codec;
    use crate::wire::message::Finished;
    use crate::wire::signature::SIGNATURE_MAX_BYTES;

    #[test]
    fn a_heartbeat_under_the_own_id_is_that_of_a_twin_and_what_others_pass_on_is_an_echo() {
        let said = |body: &Body| {
            let record = Record {
                author: 1,
                incarnation: 3,
                seq: 9,
                kind: body.kind().number(),
                subject: 0,
                body: codec::encode_body(body),
                signature: Vec::new(),
            };
            Transmission::read(codec::encode_record(&record))
        };
        let heartbeat = Heartbeat {
            interval: 4,
            sharers: 2,
            east_dm: 120,
            north_dm: -35,
            fresh: Vec::new(),
        };
        let life = Life::default();
        let heartbeat = said(&Body::Heartbeat(heartbeat));
        let Heard::Twin(twin, at) = sort(&heartbeat, 1, &life) else {
            panic!("it is taken for something else")
        };
        let wanted = Twin {
            incarnation: 3,
            heartbeat: 9,
            nonce: None,
        };
        assert_eq!((twin, at), (wanted, Point::new(12.0, -3.5)));
        let finished = said(&Body::Finished(Finished { revision: 1 }));
        assert!(matches!(sort(&finished, 1, &life), Heard::Echo(_)));
    }

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
        let heard = |record: &Record| Transmission::read(codec::encode_record(record));
        let life = Life::default();
        assert!(matches!(sort(&heard(&record), 1, &life), Heard::Record(..)));
        for n_bytes in [1, SIGNATURE_MAX_BYTES] {
            let signed = Record {
                signature: vec![7; n_bytes],
                ..record.clone()
            };
            let heard = heard(&signed);
            let Heard::Refused(why) = sort(&heard, 1, &life) else {
                panic!("{n_bytes} bytes of signature are accepted")
            };
            assert!(why.contains("signature"), "{why}");
        }
    }
}
