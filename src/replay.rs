//! `skein replay`: a recorded run, played on this terminal or on a page.

use crate::exit;
use crate::onlookers::{Map, Onlookers, Shows, stop_when_asked};
use crate::page::{Page, WebArgs, hello};
use clap::Args;
use skein_recording::export::in_order;
use skein_recording::model::Knowledge;
use skein_recording::model::Record;
use skein_recording::{Sink, run_dir};
use skein_terminal::{Pace, screen};
use skein_view::lines;
use skein_web::Mode;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Plays a recorded run: as a map on this terminal, or with --web on a page.
///
/// Reads the directory of a trial or of `skein sim SCENARIO --run-dir DIR`, its `run.mcap`, or
/// what `skein sim SCENARIO --lines FILE` wrote. A recording that was cut off is played up to
/// there.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The directory of a run, or a recording.
    pub file: PathBuf,
    /// Scenario seconds per second on this terminal.
    #[arg(long, value_name = "X", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=256))]
    pub speed: u32,
    /// Where it is shown instead.
    #[command(flatten)]
    pub web: WebArgs,
}

/// Runs the verb.
///
/// # Errors
/// When there is no page, no terminal or no thread.
pub fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    if args.web.web.is_none() && !screen::is_one() {
        eprintln!("error: a map needs a terminal, and here is none; --web plays it on a page");
        return Ok(ExitCode::from(exit::USAGE));
    }
    let mut words = match words(&args.file) {
        Ok(words) => words,
        Err(why) => {
            eprintln!("error: {}: {why}", args.file.display());
            return Ok(ExitCode::from(exit::CONFIG_INVALID));
        }
    };
    // What is no recording at all is told before anything is opened.
    let first = match words.next() {
        Some(Ok(first)) => first,
        Some(Err(why)) => return Ok(wrong(args, &why)),
        None => return Ok(wrong(args, "it is empty")),
    };
    let title = args.file.display().to_string();
    let command = format!("skein replay {title} --web");
    let hello = hello(Mode::Replay, title.clone(), command);
    let page = args.web.open(&hello)?;
    let mut sinks: Vec<Box<dyn Sink>> = page.iter().map(Page::sink).collect();
    let mut map = None;
    if page.is_none() {
        let (opened, sink) = Map::open(Shows {
            title,
            pace: Pace::Play(args.speed),
            knowledge: Knowledge::World,
            trial: None,
        })?;
        stop_when_asked(opened.stop())?;
        sinks.push(sink);
        map = Some(opened);
    }
    let mut cut = None;
    let mut sinks = Onlookers::new(sinks);
    let _ = sinks.take(&first);
    for word in words {
        match word {
            // Onlookers never fail: one that has left is told no more.
            Ok(word) => drop(sinks.take(&word)),
            Err(why) => cut = Some(why),
        }
        if map.as_ref().is_some_and(Map::is_left) {
            break;
        }
    }
    drop(sinks);
    map.map(Map::join).transpose()?;
    if let Some(why) = cut {
        eprintln!("warning: {}: cut off: {why}", args.file.display());
    }
    if let Some(page) = page {
        page.stay();
    }
    Ok(ExitCode::from(exit::OK))
}

fn wrong(args: &ReplayArgs, why: &str) -> ExitCode {
    eprintln!(
        "error: {}: {why}; `skein sim SCENARIO --run-dir DIR` writes a recording, and each trial does",
        args.file.display()
    );
    ExitCode::from(exit::CONFIG_INVALID)
}

/// The words of a recording, one by one; the last one says why it ends too early, if it does.
type Words = Box<dyn Iterator<Item = Result<Record, String>>>;

/// Of a run's directory or MCAP file, or of lines.
fn words(path: &Path) -> Result<Words, String> {
    let is_run = path.is_dir() || path.extension().is_some_and(|e| e == "mcap");
    if !is_run {
        let file = File::open(path).map_err(|why| why.to_string())?;
        let words = lines::read(BufReader::new(file));
        return Ok(Box::new(
            words.map(|word| word.map_err(|why| why.to_string())),
        ));
    }
    let recorded = run_dir::open(path).map_err(|why| why.problem)?.recorded;
    let words = in_order(&recorded.run).into_iter().map(Ok);
    Ok(Box::new(words.chain(recorded.cut.map(Err))))
}
