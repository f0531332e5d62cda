//! Every verb and every flag; the help is written as prose.

use crate::bench::BenchArgs;
use crate::chaos::ChaosArgs;
use crate::check::CheckArgs;
use crate::console::OrderArgs;
use crate::export::ExportArgs;
use crate::hint::{self, HintArgs};
use crate::mission::MissionArgs;
use crate::nfz::NfzArgs;
use crate::observe::ObserveArgs;
use crate::peer::PeerArgs;
use crate::plan::PlanArgs;
use crate::replay::ReplayArgs;
use crate::report::ReportArgs;
use crate::schema::SchemaArgs;
use crate::shell::{CompletionsArgs, ManArgs};
use crate::sim::SimArgs;
use crate::task::TaskArgs;
use crate::trial::TrialArgs;
use crate::watch::WatchArgs;
use crate::why::WhyArgs;
use crate::{
    bench, chaos, check, console, exit, export, log, mission, nfz, observe, peer, plan, replay,
    report, schema, shell, sim, task, trial, watch, why,
};
use clap::{Parser, Subcommand};
use std::ffi::OsString;
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

/// A word of the command line: a place in the south or the west begins with a hyphen and is
/// no flag, so a space goes before it, which readers of places skip.
pub fn south_or_west(word: OsString) -> OsString {
    let is_place = word.to_str().is_some_and(|w| {
        let begins = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        w.strip_prefix('-').is_some_and(begins) && w.contains(',')
    });
    if !is_place {
        return word;
    }
    let mut shifted = OsString::from(" ");
    shifted.push(word);
    shifted
}

/// The words of a command line, as the program takes them.
#[cfg(test)]
pub fn typed(text: &str) -> impl Iterator<Item = OsString> {
    let words = text.split_whitespace();
    words.map(|word| south_or_west(word.into()))
}

/// A group of UAVs that plans and flies a mission together, without a leader.
///
/// Exit codes: 0 all well, 1 the mission failed, 2 wrong usage, 3 a scenario or
/// configuration is wrong, 4 nobody was there or not in time, 5 a defect.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
pub struct Cli {
    /// What to log on stderr, for example `info` or `skein_node=debug,zenoh=warn`.
    #[arg(
        long,
        global = true,
        value_name = "FILTER",
        default_value = "warn,zenoh=error"
    )]
    pub log: String,

    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Flies a scenario with real processes over Zenoh on this machine, and judges it.
    Trial(TrialArgs),
    /// Flies a scenario in virtual time, once or a thousand times.
    Sim(SimArgs),
    /// Runs one peer: the computer of a UAV, or a ground station.
    Peer(PeerArgs),
    /// Makes something go wrong in a running trial, or puts it right.
    Chaos(ChaosArgs),
    /// The same as `mission hold`, `resume` and `rtb`.
    Order(OrderArgs),
    /// Gives, shows, changes and ends the mission, at a ground station's console.
    Mission(MissionArgs),
    /// Adds and removes no-fly zones in flight, at a ground station's console.
    Nfz(NfzArgs),
    /// Asks for tasks in flight, cancels them and says what was done on the ground, at a ground
    /// station's console.
    Task(TaskArgs),
    /// The quickest way along the mission's streets, at a ground station's console.
    Hint(HintArgs),
    /// What a peer does and why, at its console.
    Why(WhyArgs),
    /// Draws a map of a running swarm, from what it says on the air.
    Watch(WatchArgs),
    /// Plays a recorded run on this terminal or on a page.
    Replay(ReplayArgs),
    /// Shows what the swarm publishes.
    Observe(ObserveArgs),
    /// What the records of the swarm look like, as JSON Schemas.
    Schema(SchemaArgs),
    /// Checks a scenario before it is flown.
    Check(CheckArgs),
    /// Plans for a person, from files as other programs write them.
    Plan(PlanArgs),
    /// Measures what the algorithms reach, on cases drawn from seeds.
    Bench(BenchArgs),
    /// The report of a run, or of a batch of runs, as one HTML file.
    Report(ReportArgs),
    /// A recorded run as CSV, lines of JSON, GeoJSON or KML.
    Export(ExportArgs),
    /// Completions for a shell.
    Completions(CompletionsArgs),
    /// Man pages.
    Man(ManArgs),
    /// Outlives a trial and ends what it leaves behind.
    #[command(name = skein_broker::process::GUARD_COMMAND, hide = true)]
    Guard,
}

/// Runs the verb.
///
/// # Errors
/// When the program itself fails; everything else is an exit code.
pub fn run(cli: &Cli) -> anyhow::Result<ExitCode> {
    let Ok(filter) = EnvFilter::try_new(&cli.log) else {
        eprintln!(
            "error: --log {:?} is no filter; try info, or skein_node=debug,zenoh=warn",
            cli.log
        );
        return Ok(ExitCode::from(exit::USAGE));
    };
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(|| log::Log)
        .init();
    match &cli.verb {
        Verb::Trial(args) => trial::run(args),
        Verb::Sim(args) => sim::run(args),
        Verb::Peer(args) => peer::run(args),
        Verb::Chaos(args) => chaos::run(args),
        Verb::Order(args) => console::order(args),
        Verb::Mission(args) => mission::run(args),
        Verb::Nfz(args) => nfz::run(args),
        Verb::Task(args) => task::run(args),
        Verb::Hint(args) => hint::run(args),
        Verb::Why(args) => why::run(args),
        Verb::Watch(args) => watch::run(args),
        Verb::Replay(args) => replay::run(args),
        Verb::Observe(args) => observe::run(args),
        Verb::Schema(args) => schema::run(args),
        Verb::Check(args) => check::run(args),
        Verb::Plan(args) => Ok(plan::run(args)?),
        Verb::Bench(args) => bench::run(args),
        Verb::Report(args) => report::run(args),
        Verb::Export(args) => export::run(args),
        Verb::Completions(args) => shell::completions(args),
        Verb::Man(args) => shell::man(args),
        Verb::Guard => {
            skein_broker::process::guard();
            Ok(ExitCode::from(exit::OK))
        }
    }
}

/// A runtime with one worker: Zenoh refuses the single-threaded kind.
///
/// # Errors
/// When the system gives no thread.
pub fn runtime() -> std::io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
}

/// Ends when the process is asked to: by an interrupt, or by its supervisor.
pub async fn asked_to_stop() {
    use tokio::signal::unix::{SignalKind, signal};
    let (Ok(mut interrupt), Ok(mut terminate)) = (
        signal(SignalKind::interrupt()),
        signal(SignalKind::terminate()),
    ) else {
        // Without handlers the signals end the process by themselves.
        return std::future::pending().await;
    };
    tokio::select! {
        _ = interrupt.recv() => {}
        _ = terminate.recv() => {}
    }
}
