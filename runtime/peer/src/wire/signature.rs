//! The place of the signature.
//!
//! The protection of docs/protocol.md §7. A record ends with its signature,
//! and what is signed is every byte before it *as received*, never a re-encoding: so
//! relays pass records on that they could not have written, and no two readings of
//! the same content can disagree about its signature.
//!
//! Signing is off: [`Off`] writes no signature and accepts none. Keys and an
//! algorithm are left to an implementation of the two traits.

use crate::Incarnation;

/// Longest signature, bytes: two 256-bit numbers.
pub const SIGNATURE_MAX_BYTES: usize = 64;

/// Signs what this peer writes.
pub trait Signer {
    /// The signature over the bytes; at most [`SIGNATURE_MAX_BYTES`].
    fn sign(&self, signed: &[u8]) -> Vec<u8>;
}

/// Judges what others wrote.
pub trait Verifier {
    /// Whether the author, in that life, signed these bytes.
    fn verify(
        &self,
        author: u16,
        incarnation: Incarnation,
        signed: &[u8],
        signature: &[u8],
    ) -> bool;
}

/// No signatures: writes none and refuses records that carry one, which would only
/// cost airtime.
#[derive(Clone, Copy, Debug, Default)]
pub struct Off;

impl Signer for Off {
    fn sign(&self, _signed: &[u8]) -> Vec<u8> {
        Vec::new()
    }
}

impl Verifier for Off {
    fn verify(
        &self,
        _author: u16,
        _incarnation: Incarnation,
        _signed: &[u8],
        signature: &[u8],
    ) -> bool {
        signature.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn off_writes_nothing_and_accepts_nothing_else() {
        assert!(Off.sign(b"record").is_empty());
        assert!(Off.verify(1, 1, b"record", &[]));
        assert!(!Off.verify(1, 1, b"record", &[0]));
    }
}
