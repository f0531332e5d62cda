//! Measurements: of the planners, one planner, one set of instances, one JSON object with
//! errors and times; and of whole swarms.
//!
//! Rival libraries run in the same process under the feature `rivals`. Uses every other
//! crate; nothing uses it.
//!
//! | module | what is measured |
//! |---|---|
//! | [`cover`], [`cover_loop`] | regions and loops of lane cells |
//! | [`cover_exact`] | straight passes over areas with zones |
//! | [`dubins`], [`wind`], [`headings`] | curves, flights in wind, chains of waypoints |
//! | [`offset`] | zones grown by a radius |
//! | [`route`], [`route_polygons`], [`route_clearance`], [`route_graph`], [`route_maps`] | shortest paths and routes |
//! | [`mod@line`] | tours along roads |
//! | [`navmesh`] | public instances of shortest-path problems |
//! | [`sim`], [`live`], [`alike`] | swarms in virtual time, swarms of processes, the two compared |
//! | [`measure`] | distances measured again, for checks |
//! | [`figures`] | times and errors |
//!
//! ```
//! use skein_bench::measure::to_piece_m;
//! use skein_geometry::frame::Point;
//! let at = |x, y| Point::new(x, y);
//! assert!((to_piece_m(at(5.0, 3.0), at(0.0, 0.0), at(10.0, 0.0)) - 3.0).abs() < 1e-12);
//! ```

pub mod alike;
pub mod cover;
mod cover_drawn;
pub mod cover_exact;
pub mod cover_loop;
mod cover_trees;
pub mod dubins;
pub mod figures;
pub mod headings;
pub mod line;
pub mod live;
pub mod measure;
pub mod navmesh;
pub mod offset;
pub mod route;
pub mod route_clearance;
pub mod route_graph;
pub mod route_maps;
pub mod route_polygons;
pub mod sim;
pub mod wind;

use clap::{Args, Subcommand};

/// What to measure.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// The planner or driver to measure.
    #[command(subcommand)]
    pub subject: Subject,
}

/// Planners, and drivers of swarms.
#[derive(Debug, Subcommand)]
pub enum Subject {
    /// Coverage plans for a team on public grid maps.
    Cover(cover::CoverArgs),
    /// Exact coverage of areas with no-fly zones by straight passes.
    Exact(cover_exact::ExactArgs),
    /// The loop over all cells of a large map, and its exact division.
    CoverLoop(cover_loop::CoverLoopArgs),
    /// Shortest Dubins curves to random goals.
    Dubins(dubins::DubinsArgs),
    /// Headings at random waypoints, with a certified gap.
    Headings(headings::HeadingsArgs),
    /// Fastest flights in a constant wind.
    Wind(wind::WindArgs),
    /// No-fly zones grown by a radius.
    Offset(offset::OffsetArgs),
    /// Routes that keep some distance against the route of most distance.
    Clearance(route_clearance::ClearanceArgs),
    /// Shortest paths on a mesh or among polygons, against reference lengths.
    Route(route::RouteArgs),
    /// Tours of a team along all roads of a network.
    Line(line::LineArgs),
    /// A swarm in virtual time: how fast, and what keeps the computer busy.
    Sim(sim::SimArgs),
    /// A swarm of processes on this machine: the pace held, and what a process needs.
    Live(live::LiveArgs),
    /// Trials of processes against simulated runs of the same seeds: can they be told apart?
    Alike(alike::AlikeArgs),
}

/// Measures, and returns the JSON text to print.
///
/// # Errors
/// When a file is missing or malformed; the error names the place.
pub fn run(args: &BenchArgs) -> anyhow::Result<String> {
    match &args.subject {
        Subject::Cover(args) => cover::run(args),
        Subject::Exact(args) => cover_exact::run(args),
        Subject::CoverLoop(args) => cover_loop::run(args),
        Subject::Dubins(args) => dubins::run(args),
        Subject::Headings(args) => headings::run(args),
        Subject::Wind(args) => wind::run(args),
        Subject::Offset(args) => offset::run(args),
        Subject::Clearance(args) => route_clearance::run(args),
        Subject::Route(args) => route::run(args),
        Subject::Line(args) => line::run(args),
        Subject::Sim(args) => sim::run(args),
        Subject::Live(args) => live::run(args),
        Subject::Alike(args) => alike::run(args),
    }
}
