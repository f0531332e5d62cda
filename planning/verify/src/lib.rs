//! Recounts plans of flights: what they claim, and whether they can be flown where they lead.
//!
//! A plan is only as good as the proof that goes with it, and a proof by the planner's own
//! geometry shares its mistakes. Nothing here is used by a planner, and nothing of a
//! planner's geometry is used here: the plane, the distances of arcs and lines from rings
//! and circles, and the share that is seen are written anew from their definitions.
//!
//! | module | what it holds |
//! |---|---|
//! | [`plan_file`] | plans: Skein's JSON, QGroundControl `.plan`, lines of GeoJSON |
//! | [`ground_file`] | areas, holes, zones and fences: `.plan` and GeoJSON |
//! | [`load`] | all files of a question, in one plane |
//! | [`plan`], [`ground`] | the same in the plane |
//! | [`recount`] | the rules, and what is recounted |
//! | [`report`] | what is told, as text and as JSON |
//! | [`generate`] | sites for tests of planners, by seed |
//! | [`plane`], [`path`], [`outline`] | the geometry |
//! | [`air`] | times and turns in a wind |
//!
//! Text in, values out: no file is opened here. What is read is not believed: numbers have
//! ranges, lists have limits, and every error names its place.
//!
//! A straight flight past a zone, 8 m from it where 10 m are asked for:
//!
//! ```
//! use skein_verify::ground::{Ground, Named};
//! use skein_verify::outline::{Outline, Ring};
//! use skein_verify::path::Piece;
//! use skein_verify::plan::{Flight, Plan};
//! use skein_verify::plane::{Plane, Point};
//! use skein_verify::recount::{Rule, Settings, recount};
//!
//! let corners = [(100.0, 8.0), (200.0, 8.0), (200.0, 90.0), (100.0, 90.0)];
//! let ring = Ring::new(corners.map(|(x, y)| Point::new(x, y)).to_vec())?;
//! let zone = Named { name: "tower".to_owned(), outline: Outline::Ring(ring) };
//! let ground = Ground { zones: vec![zone], ..Ground::default() };
//! let way = Piece::between(Point::new(0.0, 0.0), Point::new(300.0, 0.0), true);
//! let plan = Plan {
//!     flights: vec![Flight::new("uav-1", vec![way])],
//!     ..Plan::new(Plane { lat_deg: 47.0, lon_deg: 8.0 })
//! };
//! let settings = Settings { clearance_m: Some(10.0), ..Settings::default() };
//! let report = recount(&plan, &ground, &settings)?;
//! assert_eq!(report.violations[0].rule, Rule::Zone);
//! assert!((report.flights[0].to_zone.unwrap() - 8.0).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod air;
mod boxes;
pub mod generate;
pub mod ground;
pub mod ground_file;
pub mod load;
pub mod outline;
pub mod path;
pub mod plan;
pub mod plan_file;
pub mod plane;
pub mod recount;
pub mod report;
mod seen;

use skein_interop::json;
use thiserror::Error;

/// Why something could not be recounted. Nothing is told of the plan.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum VerifyError {
    /// A text is not what it should be; names line, column and value.
    #[error(transparent)]
    Text(#[from] json::Error),
    /// A value of a file means nothing here.
    #[error("{file}: {at}: {problem}")]
    Value {
        /// The file.
        file: String,
        /// Which value.
        at: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Several plans were given that are none together.
    #[error("{0}")]
    Together(String),
    /// A setting means nothing.
    #[error("--{flag}: {problem}")]
    Setting {
        /// The setting.
        flag: &'static str,
        /// What is wrong with it.
        problem: String,
    },
}
