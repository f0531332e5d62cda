//! `skein report`: what a run, or a batch of runs, came to, as one page.

use crate::exit;
use anyhow::Context;
use clap::Args;
use skein_recording::run_dir;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Makes one HTML file of a recorded run: the verdict, what was checked, takeovers, margins,
/// plots and a map. It needs nothing from elsewhere, and runs no script.
///
/// Of a file of `skein sim --seeds A..B --format json` it makes a page of all those runs.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// The directory of a run (`skein sim --run-dir`, or that of a trial), its run.mcap, or the
    /// JSON of a batch.
    #[arg(value_name = "RUN")]
    pub run: PathBuf,
    /// Where to.
    #[arg(short, long, value_name = "FILE", default_value = "report.html")]
    pub output: PathBuf,
}

/// Runs the verb.
///
/// # Errors
/// When the page cannot be written.
pub fn run(args: &ReportArgs) -> anyhow::Result<ExitCode> {
    let page = match page(&args.run) {
        Ok(page) => page,
        Err(why) => {
            eprintln!("error: {why}");
            return Ok(ExitCode::from(exit::CONFIG_INVALID));
        }
    };
    std::fs::write(&args.output, page)
        .with_context(|| format!("cannot write {}", args.output.display()))?;
    eprintln!("written: {}", args.output.display());
    Ok(ExitCode::from(exit::OK))
}

fn page(path: &Path) -> Result<String, String> {
    if path.extension().is_some_and(|e| e == "json") {
        let text = std::fs::read_to_string(path);
        let text = text.map_err(|e| format!("{}: {e}", path.display()))?;
        return skein_report::batch(&text).map_err(|e| format!("{}: {e}", path.display()));
    }
    let kept = run_dir::open(path).map_err(|e| e.to_string())?;
    Ok(skein_report::run(&kept))
}

/// Says on stderr where a run was recorded, and what to do with it.
pub fn tell_recorded(dir: &Path) {
    let dir = dir.display();
    eprintln!("recorded in {dir}: skein report {dir} -o report.html");
}
