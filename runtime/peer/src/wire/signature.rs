//! The place of the signature.
