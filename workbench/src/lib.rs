//! The verbs that need no swarm: `plan` for a person, `bench` for measurements.
//!
//! A library, so that the `skein` command can carry them, and a small command of its
//! own (`skein-workbench`), so that planners can be measured without building Zenoh.
//! Arguments in, one text out: nothing here prints.

pub mod bench;
pub mod measure;
pub mod navmesh;
pub mod plan;
