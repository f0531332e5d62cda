//! Deterministic tests of the whole swarm; see `swarm.rs`.
