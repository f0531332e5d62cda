//! Bytes of records: CBOR, bounded, checked.
