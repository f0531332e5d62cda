//! What a run shows, for people and programs that look at it: live, or afterwards from its
//! recording.
//!
//! Peers know nothing of this. A driver, simulated or live, tells an [`Observer`] what it
//! hears of them and what its world knows; the observer says the same in the words of the
//! [`model`], and gives it to a [`Sink`]: a recording, a terminal, a page.
//!
//! | module | what it holds |
//! |---|---|
//! | [`model`] | the words: scene, frame, event, end, each versioned and with its units |
//! | [`sink`] | who takes them |
//! | [`observer`] | from a driver's values to the model |
//! | [`simulated`] | a simulated run that is observed |
//! | [`cells`] | who has which cell, folded from scenes and events |
//! | [`writer`], [`reader`] | a run as an MCAP file; [`channels`] are its channels, [`foxglove`] and [`space`] its messages for Foxglove, [`viewers`] the schemas that it takes |
//! | [`failure_free`] | the run without failures with which one is compared |
//! | [`run_dir`] | the directory of a run: manifest, recording, report |
//! | [`export`] | a run as CSV, lines of JSON, GeoJSON, KML |
//! | [`tracks`] | where each UAV flew, life by life |
//!
//! ```
//! use skein_netsim::{Prepared, runs::Wanted, world::fixture::square};
//! use skein_recording::{sink::Collected, simulated};
//!
//! let mut run = Collected::default();
//! let prepared = Prepared::new(square(2));
//! simulated::fly(&prepared, 1, None, Wanted::default(), &mut run).unwrap();
//! assert_eq!(run.scenes[0].uavs.len(), 2);
//! assert!(run.frames.len() > 10 && run.end.is_some());
//! ```

pub mod cells;
pub mod channels;
pub mod export;
pub mod failure_free;
pub mod foxglove;
pub mod model;
pub mod observer;
pub mod reader;
pub mod run_dir;
pub mod simulated;
pub mod sink;
pub mod space;
mod stage;
pub mod tracks;
pub mod viewers;
pub mod writer;

pub use model::{End, Event, FailureFree, Frame, Record, Scene};
pub use observer::Observer;
pub use sink::Sink;
pub use stage::{compass_deg, of_mission};
