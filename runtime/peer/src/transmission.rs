//! A transmission as it is heard: its bytes, and what they say to anybody.

use crate::wire::codec::{self, Body, WireError};
use crate::wire::kinds::Kind;
use crate::wire::message::Record;
use crate::wire::signature::{Off, Verifier};

/// Bytes that were received, read once. Reading them depends on nothing else, so a driver of
/// several peers shares one among all who hear them.
#[derive(Clone, Debug)]
pub struct Transmission {
    bytes: Vec<u8>,
    said: Result<(Kind, Record, Body), String>,
}

impl Transmission {
    /// Reads what was received.
    #[must_use]
    pub fn read(bytes: Vec<u8>) -> Self {
        let said = said(&bytes);
        Self { bytes, said }
    }

    /// The record, as sent.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// What it says, or why nobody takes it.
    pub(crate) fn said(&self) -> Result<(Kind, &Record, &Body), &str> {
        match &self.said {
            Ok((kind, record, body)) => Ok((*kind, record, body)),
            Err(why) => Err(why),
        }
    }
}

fn said(bytes: &[u8]) -> Result<(Kind, Record, Body), String> {
    let record = codec::decode_record(bytes).map_err(|why| why.to_string())?;
    if !Off.verify(record.author, record.incarnation, bytes, &record.signature) {
        return Err(WireError::Signature.to_string());
    }
    let kind = Kind::of_number(record.kind).ok_or("a kind of a later version")?;
    let body = codec::decode_body(kind, &record.body).map_err(|why| why.to_string())?;
    Ok((kind, record, body))
}
