//! The report of a run, or of many, as one page: HTML with its drawings inside, no script, and
//! nothing from elsewhere.
//!
//! | module | what it draws |
//! |---|---|
//! | `run` | the page of one run |
//! | `batch` | the page of many |
//! | `plots` | coverage, sections and radio over time |
//! | `map` | area, cells and tracks |
//! | `chart` | axes and scales of all plots |
//! | `page` | the frame of a page, its tables, its style |
//!
//! Every text that comes from a file is escaped.

mod batch;
mod chart;
mod links;
mod map;
mod page;
mod plots;
mod run;

use skein_netsim::summary::Summary;
use skein_recording::run_dir::Kept;
use skein_recording::sink::Collected;

/// The page of one run.
#[must_use]
pub fn run(kept: &Kept) -> String {
    run::page(kept)
}

/// A drawing of a run: area, cells, tracks, losses, as SVG.
#[must_use]
pub fn picture(run: &Collected) -> String {
    let empty = skein_recording::Scene::default();
    let drawn = plots::Run::of(run, &empty);
    map::picture(&drawn, &skein_recording::export::cells_at_end(run))
}

/// The page of a batch of runs, from the JSON of `skein sim --seeds A..B --format json`.
///
/// # Errors
/// What is wrong with the text.
pub fn batch(json: &str) -> Result<String, String> {
    let summary: Summary = serde_json::from_str(json)
        .map_err(|e| format!("{e}; expected what `skein sim --seeds A..B --format json` prints"))?;
    Ok(batch::page(&summary))
}
