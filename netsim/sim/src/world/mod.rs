//! The world around the peers: airframes, buildings, and the judge (D2.7 §2.2).

pub mod fixture;
