//! `skein sim`: a scenario in virtual time, once with a timeline or many times with a
//! summary.

use crate::check::Format;
use crate::onlookers::{Map, NoTerminal, Onlookers, Shows, stop_when_asked};
use crate::page::{Page, WebArgs, hello};
use crate::scenario_args::ScenarioArgs;
use crate::{chaos, exit, report};
use anyhow::Context;
use clap::Args;
use skein_broker::batch::{self, Batch};
use skein_netsim::Prepared;
use skein_netsim::runs::{self, Wanted};
use skein_netsim::swarm::Outcome;
use skein_netsim::timeline::timeline;
use skein_recording::failure_free::Compared;
use skein_recording::model::Knowledge;
use skein_recording::model::scene::Driver;
use skein_recording::run_dir::{Manifest, RECORDING};
use skein_recording::writer::Writer;
use skein_recording::{Sink, simulated};
use skein_scenario::Seeds;
use skein_terminal::{Pace, screen};
use skein_view::lines::Lines;
use skein_web::Mode;
use std::io::{BufWriter, Write as _};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;

/// Flies a scenario in virtual time, in this process: the same peers, world and radio
/// as a trial, without Zenoh.
///
/// With one seed the scenario's own faults happen, and a timeline is printed; with
/// --storm the faults are drawn from the scenario's storm. With --seeds many runs are
/// summed up. The same seed gives the same history on every machine, for any --jobs.
/// A single run ends with the same report as a trial. Exit code 1 if a run did not
/// complete or broke a rule; docs/protocol.md §8 says what each rule means.
#[derive(Debug, Args)]
pub struct SimArgs {
    /// What is flown.
    #[command(flatten)]
    pub scenario: ScenarioArgs,
    /// The seed of one run; without it the scenario's.
    #[arg(long, value_name = "S", conflicts_with = "seeds")]
    pub seed: Option<u64>,
    /// The seeds of many runs: from A up to but not including B.
    #[arg(long, value_name = "A..B")]
    pub seeds: Option<Seeds>,
    /// Draws the faults of each run from the scenario's storm.
    #[arg(long)]
    pub storm: bool,
    /// Runs at the same time; without it one a processor.
    #[arg(long, value_name = "J")]
    pub jobs: Option<NonZeroUsize>,
    /// Writes the main events of a single run into this file, one JSON object a line.
    #[arg(long, value_name = "FILE", conflicts_with = "seeds")]
    pub history: Option<PathBuf>,
    /// Keeps the recording of a single run in this directory, with its manifest and its report:
    /// for `skein report`, `skein export`, Foxglove and Python.
    #[arg(long, value_name = "DIR", conflicts_with = "seeds")]
    pub run_dir: Option<PathBuf>,
    /// Flies only until some time, and tells what a peer does then and why: `3@120` is UAV 3
    /// at 120 s.
    #[arg(long, value_name = "UAV@SECONDS", value_parser = moment, conflicts_with_all = ["seeds", "history", "run_dir"])]
    pub why: Option<(u16, u64)>,
    /// How the result is printed.
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Writes all that a single run shows into this file, for `skein replay`: one JSON object a
    /// line.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["seeds", "why"])]
    pub lines: Option<PathBuf>,
    /// Shows a single run as a map on this terminal, at so many scenario seconds per second.
    #[arg(long, value_name = "X", num_args = 0..=1, default_missing_value = "8",
        value_parser = clap::value_parser!(u32).range(1..=256), conflicts_with_all = ["seeds", "why"])]
    pub watch: Option<u32>,
    /// Where a single run is shown.
    #[command(flatten)]
    pub web: WebArgs,
}

/// Runs the verb: the result on stdout, progress on stderr.
///
/// # Errors
/// When stdout or the history cannot be written.
pub fn run(args: &SimArgs) -> anyhow::Result<ExitCode> {
    let scenario = match args.scenario.open(args.seed, None) {
        Ok(s) => s,
        Err(e) => {
            eprintln!("error: {e}");
            return Ok(ExitCode::from(exit::CONFIG_INVALID));
        }
    };
    fly(
        args,
        &Prepared::with_geometry(scenario.spec, scenario.geometry),
    )
}

/// A peer and a time in milliseconds.
fn moment(text: &str) -> Result<(u16, u64), String> {
    let wrong = || format!("{text:?} is no peer and time; write 3@120 or uav3@120");
    let (id, at_s) = text.split_once('@').ok_or_else(wrong)?;
    let at_s: f64 = at_s.parse().map_err(|_| wrong())?;
    if !(0.0..=1e7).contains(&at_s) {
        return Err(wrong());
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and 1e10"
    )]
    Ok((chaos::peer(id)?, (at_s * 1000.0).round() as u64))
}

/// What a peer does at some time of a run, and why.
fn why(args: &SimArgs, prepared: &Prepared, (id, at_ms): (u16, u64)) -> anyhow::Result<ExitCode> {
    let seed = args.seed.unwrap_or(prepared.spec.seed);
    let storm = args.storm.then(|| runs::failure_free_makespan_ms(prepared));
    let swarm = runs::until(prepared, seed, storm, at_ms);
    let Some(why) = swarm.why(id) else {
        eprintln!("error: no peer {id} runs at that time");
        return Ok(ExitCode::from(exit::NO_PEERS));
    };
    match args.format {
        Format::Json => exit::print(serde_json::to_string_pretty(&why)?)?,
        Format::Text => exit::print(&why)?,
    }
    Ok(ExitCode::from(exit::OK))
}

fn fly(args: &SimArgs, prepared: &Prepared) -> anyhow::Result<ExitCode> {
    if let Some(moment) = args.why {
        return why(args, prepared, moment);
    }
    let ok = match args.seeds {
        Some(seeds) => many(args, prepared, seeds)?,
        None => one(args, prepared)?,
    };
    Ok(ExitCode::from(if ok {
        exit::OK
    } else {
        exit::MISSION_FAILED
    }))
}

fn one(args: &SimArgs, prepared: &Prepared) -> anyhow::Result<bool> {
    let seed = args.seed.unwrap_or(prepared.spec.seed);
    let wanted = Wanted {
        events: true,
        baseline: true,
    };
    let page = page(args, prepared, seed)?;
    let map = map(args, prepared, seed)?;
    let storm = args.storm.then(|| runs::failure_free_makespan_ms(prepared));
    let kept = kept(args, prepared, seed)?;
    let mut sinks: Vec<Box<dyn Sink>> = page.iter().map(Page::sink).collect();
    sinks.extend(lines(args)?);
    let (map, sink) = map.unzip();
    sinks.extend(sink);
    let manifest = kept.map(|(manifest, writer)| {
        sinks.push(Box::new(writer));
        manifest
    });
    let outcome = if sinks.is_empty() {
        unseen(prepared, seed, storm, wanted)
    } else {
        // Whoever looks sees what it would have been without failures, too.
        let mut sink = Compared::begin(Onlookers::new(sinks), prepared, seed)?;
        simulated::fly(prepared, seed, storm, wanted, &mut sink)?
    };
    map.map(Map::join).transpose().context("the map")?;
    if let (Some(manifest), Some(dir)) = (manifest, &args.run_dir) {
        manifest
            .conclude(dir, &outcome.report)
            .with_context(|| format!("cannot write into {}", dir.display()))?;
        report::tell_recorded(dir);
    }
    if let Some(path) = &args.history {
        let file = std::fs::File::create(path)
            .with_context(|| format!("cannot create {}", path.display()))?;
        let mut out = BufWriter::new(file);
        for entry in &outcome.entries {
            serde_json::to_writer(&mut out, entry)?;
            out.write_all(b"\n")?;
        }
        out.flush()?;
    }
    let report = &outcome.report;
    match args.format {
        Format::Json => exit::print(serde_json::to_string_pretty(report)?)?,
        Format::Text => exit::print(format!("{}\n{report}", timeline(&outcome.entries)))?,
    }
    if !report.passed {
        eprintln!("replay: {}", replay(args, seed));
    }
    if let Some(page) = page {
        page.stay();
    }
    Ok(report.passed)
}

/// The manifest and the recording of a run that is kept.
fn kept(
    args: &SimArgs,
    prepared: &Prepared,
    seed: u64,
) -> anyhow::Result<Option<(Manifest, Writer)>> {
    let Some(dir) = &args.run_dir else {
        return Ok(None);
    };
    std::fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
    let writes = || format!("cannot write into {}", dir.display());
    let manifest = Manifest {
        scenario_text: args.scenario.text(),
        command: replay(args, seed),
        ..Manifest::new(&prepared.spec.name, seed, Driver::Sim)
    };
    manifest.write(dir).with_context(writes)?;
    let writer = Writer::create(&dir.join(RECORDING)).with_context(writes)?;
    Ok(Some((manifest, writer)))
}

/// A run that nobody looks at.
fn unseen(prepared: &Prepared, seed: u64, storm: Option<u64>, wanted: Wanted) -> Outcome {
    match storm {
        Some(free_ms) => runs::storm(prepared, seed, free_ms, wanted),
        None => runs::planned(prepared, seed, wanted),
    }
}

/// The file of a single run, if one is wanted.
fn lines(args: &SimArgs) -> anyhow::Result<Option<Box<dyn Sink>>> {
    let Some(path) = &args.lines else {
        return Ok(None);
    };
    let file =
        std::fs::File::create(path).with_context(|| format!("cannot create {}", path.display()))?;
    Ok(Some(Box::new(Lines(BufWriter::new(file)))))
}

/// The map of a single run on this terminal, if one is wanted.
fn map(
    args: &SimArgs,
    prepared: &Prepared,
    seed: u64,
) -> anyhow::Result<Option<(Map, Box<dyn Sink>)>> {
    let Some(speed) = args.watch else {
        return Ok(None);
    };
    if !screen::is_one() {
        return Err(NoTerminal.into());
    }
    let opened = Map::open(Shows {
        title: format!("{}, seed {seed}", prepared.spec.name),
        pace: Pace::Play(speed),
        knowledge: Knowledge::World,
        trial: None,
    })?;
    stop_when_asked(opened.0.stop())?;
    Ok(Some(opened))
}

/// The page of a single run, if one is wanted.
fn page(args: &SimArgs, prepared: &Prepared, seed: u64) -> anyhow::Result<Option<Page>> {
    let title = format!("{}, seed {seed}", prepared.spec.name);
    let hello = hello(Mode::Sim, title, format!("{} --web", replay(args, seed)));
    Ok(args.web.open(&hello)?)
}

fn many(args: &SimArgs, prepared: &Prepared, seeds: Seeds) -> anyhow::Result<bool> {
    let batch = Batch {
        seeds: seeds.from..seeds.to,
        storm: args.storm,
        jobs: args.jobs,
    };
    let mut total = batch::run(prepared, &batch, &|outcome| {
        let report = &outcome.report;
        eprintln!("seed {} failed: {}", report.seed, report.reasons.join("; "));
        for v in outcome.violations().iter().take(3) {
            eprintln!("  {v}");
        }
        eprintln!("replay: {}", replay(args, report.seed));
    });
    total.replay = replay_without_seed(args);
    match args.format {
        Format::Json => exit::print(serde_json::to_string(&total)?)?,
        Format::Text => exit::print(&total)?,
    }
    Ok(total.failed_seeds.is_empty() && total.violations.is_empty())
}

/// The command that replays a seed.
fn replay(args: &SimArgs, seed: u64) -> String {
    format!("{} {seed}", replay_without_seed(args))
}

/// The same, but for the number at its end.
fn replay_without_seed(args: &SimArgs) -> String {
    let storm = if args.storm { " --storm" } else { "" };
    format!("skein sim{}{storm} --seed", args.scenario.as_typed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_that_replays_a_seed_names_all_that_made_the_run() {
        #[derive(clap::Parser)]
        struct Cli {
            #[command(flatten)]
            sim: SimArgs,
        }
        for flags in [
            "--exact",
            "--approximate",
            "--peers 4 --storm",
            "--launch spread",
            "",
        ] {
            let command = format!("skein helsinki --seeds 0..9 {flags}");
            let args = <Cli as clap::Parser>::parse_from(command.split_whitespace()).sim;
            let again = replay(&args, 7);
            for word in flags.split_whitespace() {
                assert!(again.contains(word), "{again}");
            }
            assert!(again.starts_with("skein sim helsinki") && again.contains("--seed 7"));
        }
    }
}
