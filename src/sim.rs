//! `skein sim`: a scenario in virtual time, once with a timeline or many times with a
//! summary.

use crate::check::Format;
use crate::exit;
use crate::planner::PlannerArgs;
use anyhow::Context;
use clap::Args;
use skein_netsim::Prepared;
use skein_netsim::fault::Fault;
use skein_netsim::history::{Entry, What};
use skein_netsim::summary::{self, Summary};
use skein_netsim::swarm::Outcome;
use skein_peer::Report;
use skein_peer::output::Status;
use skein_scenario::Overrides;
use std::fmt::Write as _;
use std::io::{BufWriter, Write as _};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// The makespan of a run is compared with the reference where at most this many UAVs
/// were killed for good: that is what the product promises a figure for.
const COMPARED_KILLS: u32 = 3;

/// Flies a scenario in virtual time, in this process: the same peers, world and radio
/// as a trial, without Zenoh.
///
/// With one seed the scenario's own faults happen, and a timeline is printed; with
/// --storm the faults are drawn from the scenario's storm. With --seeds many runs are
/// summed up. The same seed gives the same history on every machine, for any --jobs.
/// Exit code 1 if a run did not complete or broke a rule.
#[derive(Debug, Args)]
pub struct SimArgs {
    /// A scenario file or the name of a built-in scenario; without it the default one.
    pub scenario: Option<String>,
    /// Flies with this many UAVs instead of the scenario's number.
    #[arg(long, value_name = "N")]
    pub peers: Option<u16>,
    /// Who plans an area.
    #[command(flatten)]
    pub planner: PlannerArgs,
    /// The seed of one run; without it the scenario's.
    #[arg(long, value_name = "S", conflicts_with = "seeds")]
    pub seed: Option<u64>,
    /// The seeds of many runs: from A up to but not including B.
    #[arg(long, value_name = "A..B", value_parser = seeds)]
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
    /// How the result is printed.
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// A range of seeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// The first.
    pub from: u64,
    /// The one after the last.
    pub to: u64,
}

fn seeds(text: &str) -> Result<Seeds, String> {
    let (from, to) = text
        .split_once("..")
        .ok_or("expected two numbers with two dots between, for example 0..1000")?;
    let number = |s: &str| s.trim().parse::<u64>().map_err(|e| format!("{s:?}: {e}"));
    let seeds = Seeds {
        from: number(from)?,
        to: number(to)?,
    };
    if seeds.from >= seeds.to {
        return Err(format!(
            "{text} holds no seed; the second number is not included"
        ));
    }
    Ok(seeds)
}

/// Runs the verb: the result on stdout, progress on stderr.
///
/// # Errors
/// When stdout or the history cannot be written.
pub fn run(args: &SimArgs) -> anyhow::Result<ExitCode> {
    let over = Overrides {
        peers: args.peers,
        seed: args.seed,
        planner: args.planner.chosen(),
        ..Overrides::default()
    };
    let scenario = match skein_scenario::open(args.scenario.as_deref(), &over) {
        Ok(s) => s,
        Err(e) => {
            eprintln!("error: {e}");
            return Ok(ExitCode::from(exit::CONFIG_INVALID));
        }
    };
    fly(args, &Prepared::new(scenario.spec))
}

fn fly(args: &SimArgs, prepared: &Prepared) -> anyhow::Result<ExitCode> {
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
    let started = Instant::now();
    let outcome = if args.storm {
        prepared.storm(
            seed,
            prepared.failure_free_makespan_ms(),
            COMPARED_KILLS,
            true,
        )
    } else {
        prepared.planned(seed, COMPARED_KILLS, true)
    };
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
    let timeline = timeline(&outcome.entries);
    let failed = summary::failed(&outcome);
    let total = summary::summarise(vec![outcome.clone()], started.elapsed().as_secs_f64());
    match args.format {
        Format::Json => println!("{}", serde_json::to_string(&total)?),
        Format::Text => print!("{timeline}{}", verdict(&outcome, &total)),
    }
    if failed {
        eprintln!("replay: {}", replay(args, seed));
    }
    Ok(!failed)
}

fn many(args: &SimArgs, prepared: &Prepared, seeds: Seeds) -> anyhow::Result<bool> {
    let free_ms = if args.storm {
        prepared.failure_free_makespan_ms()
    } else {
        0
    };
    let jobs = args
        .jobs
        .or_else(|| std::thread::available_parallelism().ok())
        .map_or(1, NonZeroUsize::get);
    let started = Instant::now();
    let next = AtomicU64::new(seeds.from);
    let runs = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= seeds.to {
                        return;
                    }
                    let outcome = if args.storm {
                        prepared.storm(seed, free_ms, COMPARED_KILLS, false)
                    } else {
                        prepared.planned(seed, COMPARED_KILLS, false)
                    };
                    if summary::failed(&outcome) {
                        eprintln!("seed {seed} failed: {}", why(&outcome));
                        eprintln!("replay: {}", replay(args, seed));
                    }
                    // A thread that panicked would have ended the scope; the data is whole.
                    runs.lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner)
                        .push(outcome);
                }
            });
        }
    });
    let runs = runs
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let total = summary::summarise(runs, started.elapsed().as_secs_f64());
    match args.format {
        Format::Json => println!("{}", serde_json::to_string(&total)?),
        Format::Text => print!("{}", table(&total)),
    }
    Ok(total.failed_seeds.is_empty() && total.violations.is_empty())
}

/// The command that replays a seed.
fn replay(args: &SimArgs, seed: u64) -> String {
    let mut s = "skein sim".to_owned();
    if let Some(scenario) = &args.scenario {
        let _ = write!(s, " {scenario}");
    }
    if let Some(n) = args.peers {
        let _ = write!(s, " --peers {n}");
    }
    let _ = write!(s, " --seed {seed}");
    if args.storm {
        s.push_str(" --storm");
    }
    s
}

fn why(o: &Outcome) -> String {
    let mut s = String::new();
    for v in o.violations.iter().take(3) {
        let at = v.time_ms / 1000;
        let _ = write!(s, "[{} at {at} s{}] {} ", v.check, by(v.peer), v.text);
    }
    if s.is_empty() {
        format!("completed {}, infeasible {}", o.completed, o.infeasible)
    } else {
        s.trim_end().to_owned()
    }
}

fn by(peer: Option<u16>) -> String {
    peer.map_or_else(String::new, |p| format!(", peer {p}"))
}

/// The main events, one a line; what many peers report is told when the first one does.
fn timeline(entries: &[Entry]) -> String {
    let mut out = String::new();
    let mut told = std::collections::BTreeSet::new();
    for e in entries {
        let Some(line) = line(&e.what, &mut told) else {
            continue;
        };
        #[allow(clippy::cast_precision_loss, reason = "scenario times are small")]
        let s = e.time_ms as f64 / 1000.0;
        let _ = writeln!(out, "{s:8.1} s  {line}");
    }
    out
}

fn line(what: &What, told: &mut std::collections::BTreeSet<String>) -> Option<String> {
    Some(match what {
        What::Fault(f) => format!("! {}", fault(f)),
        What::Components(parts) => {
            let parts: Vec<String> = parts.iter().map(|p| format!("{p:?}")).collect();
            format!("radio components {}", parts.join(" "))
        }
        What::Covered => "every coverable cell is covered".to_owned(),
        What::Violation { check, peer, text } => format!("VIOLATION {check}{}: {text}", by(*peer)),
        What::Report { peer, report } => return reported(*peer, report, told),
    })
}

fn reported(
    peer: u16,
    report: &Report,
    told: &mut std::collections::BTreeSet<String>,
) -> Option<String> {
    let line = match report {
        Report::Booted { incarnation } => {
            return Some(format!("peer {peer} runs, life {incarnation}"));
        }
        Report::Ready { cells, .. } => {
            return told
                .insert("ready".to_owned())
                .then(|| format!("peer {peer} has derived a loop of {cells} cells"));
        }
        Report::Membership {
            peer: of,
            incarnation,
            status,
        } if *status != Status::Alive => {
            let status = if *status == Status::Down {
                "down"
            } else {
                "suspect"
            };
            format!(
                "peer {peer} holds peer {} (life {incarnation}) for {status}",
                of.0
            )
        }
        Report::Round { counter, members } => {
            let members: Vec<String> = members.iter().map(|m| m.0.to_string()).collect();
            let line = format!("round {counter} among {}", members.join(", "));
            return told.insert(line.clone()).then_some(line);
        }
        Report::Claim {
            counter,
            take,
            legs,
            held,
            eta_ms,
            ..
        } => {
            let cells: u32 = legs.iter().map(|l| u32::from(l.count)).sum();
            let key = format!("claim {peer} {counter} {take}");
            return told.insert(key).then(|| {
                let held = if held.is_empty() {
                    String::new()
                } else {
                    format!(", holds {} more", held.len())
                };
                let how = if *take > 0 {
                    " (taken without a round)"
                } else {
                    ""
                };
                format!(
                    "peer {peer} will fly {cells} cells of round {counter}{how}, {} s{held}",
                    eta_ms / 1000
                )
            });
        }
        Report::Finished { .. } => format!("peer {peer} knows that the mission is finished"),
        Report::Alarm { text } => format!("peer {peer} alarm: {text}"),
        Report::Refused { reason } => format!("peer {peer} refused bytes: {reason}"),
        Report::Membership { .. } | Report::Covered { .. } => return None,
    };
    Some(line)
}

fn fault(f: &Fault) -> String {
    match f {
        Fault::Kill { peer } => format!("peer {peer} is killed"),
        Fault::KillComputer { peer } => format!("the computer of peer {peer} is killed"),
        Fault::Terminate { peer } => format!("peer {peer} is asked to end"),
        Fault::Pause { peer } => format!("peer {peer} stands still"),
        Fault::Resume { peer } => format!("peer {peer} goes on"),
        Fault::Restart { peer, fresh_disk } => {
            format!(
                "peer {peer} is restarted {} its disk",
                if *fresh_disk { "without" } else { "with" }
            )
        }
        Fault::Cut { a, b, one_way } => format!(
            "link {a} {} {b} is cut",
            if *one_way { "to" } else { "and" }
        ),
        Fault::Partition { groups } => format!("partition {groups:?}"),
        Fault::Heal => "all links heal".to_owned(),
        Fault::Rebase { .. } => "the operator moves the base".to_owned(),
        Fault::Loss { permille } => format!(
            "{:.1} % of transmissions are lost",
            f64::from(*permille) / 10.0
        ),
    }
}

#[allow(clippy::cast_precision_loss, reason = "scenario times are small")]
fn verdict(o: &Outcome, s: &Summary) -> String {
    let mut out = String::new();
    let secs = |ms: u64| ms as f64 / 1000.0;
    let _ = writeln!(
        out,
        "\nseed {}: {}",
        o.seed,
        if summary::failed(o) {
            "FAILED"
        } else {
            "mission accomplished"
        }
    );
    let _ = writeln!(out, "  covered        {:.1} %", o.coverage * 100.0);
    if let Some(ms) = o.makespan_ms {
        let ratio = o
            .makespan_ratio
            .map_or_else(String::new, |r| format!(", {r:.2} times the reference"));
        let _ = writeln!(out, "  makespan       {:.1} s{ratio}", secs(ms));
    }
    for t in &o.takeovers {
        let detected = t.detected_ms.map_or_else(
            || "never".to_owned(),
            |d| format!("after {:.1} s", secs(d.saturating_sub(t.died_ms))),
        );
        let taken = t.taken_ms.map_or_else(
            || "never".to_owned(),
            |d| format!("after {:.1} s", secs(d.saturating_sub(t.died_ms))),
        );
        let by: Vec<String> =
            t.by.iter()
                .map(|(p, n)| format!("{n} by peer {p}"))
                .collect();
        let _ = writeln!(
            out,
            "  peer {} ended at {:.1} s with {} cells: detected {detected}, all taken over {taken} ({})",
            t.dead,
            secs(t.died_ms),
            t.cells,
            by.join(", ")
        );
    }
    let _ = writeln!(
        out,
        "  bytes          {:.0} a second and peer",
        s.bytes_per_peer_s
    );
    let _ = writeln!(out, "  false downs    {}", o.false_downs.len());
    for (ms, by, of) in &o.false_downs {
        let _ = writeln!(out, "    {:8.1} s  peer {by} of peer {of}", secs(*ms));
    }
    if let Some(m) = o.separation_m {
        let _ = writeln!(out, "  separation     {m:.1} m at least");
    }
    if let Some(ms) = o.revisit_ms {
        let _ = writeln!(out, "  revisit        {:.1} s at most", secs(ms));
    }
    for (check, n) in &o.violation_counts {
        let _ = writeln!(out, "  violations     {check}: {n}");
    }
    let _ = writeln!(
        out,
        "  history hash   {:016x} over {} events",
        o.history_hash, o.events
    );
    let _ = writeln!(
        out,
        "  speed          {:.0} simulated seconds a second",
        s.real_time_factor
    );
    out
}

fn table(s: &Summary) -> String {
    let mut out = String::new();
    let spread = |v: &summary::Spread| {
        format!(
            "p50 {:.2}  p95 {:.2}  max {:.2}  (n = {})",
            v.p50, v.p95, v.max, v.n
        )
    };
    let _ = writeln!(
        out,
        "runs {}, completed {}, infeasible {}",
        s.runs, s.completed, s.infeasible
    );
    let _ = writeln!(out, "violations            {:?}", s.violations);
    let _ = writeln!(out, "coverage min          {:.3} %", s.coverage_min * 100.0);
    let _ = writeln!(out, "makespan / reference  {}", spread(&s.makespan_ratio));
    let _ = writeln!(out, "detection, s          {}", spread(&s.detect_s));
    let _ = writeln!(out, "takeover, s           {}", spread(&s.takeover_s));
    let _ = writeln!(
        out,
        "false downs           {:.4} a peer-hour at light loss, {:.4} at any",
        s.false_downs_per_peer_hour, s.false_downs_per_peer_hour_at_any_loss
    );
    let _ = writeln!(
        out,
        "bytes                 {:.0} a second and peer",
        s.bytes_per_peer_s
    );
    let _ = writeln!(out, "killed for good       {:?}", s.dead);
    let _ = writeln!(out, "hard places           {:?}", s.reached);
    for (check, v) in &s.liveness_share {
        let _ = writeln!(out, "{check} / bound            {}", spread(v));
    }
    let _ = writeln!(out, "real-time factor      {:.0}", s.real_time_factor);
    let _ = writeln!(out, "history hash          {}", s.history_hash);
    if !s.failed_seeds.is_empty() {
        let _ = writeln!(out, "failed seeds          {:?}", s.failed_seeds);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_seeds_are_read_or_refused_with_a_reason() {
        assert_eq!(seeds("0..1000"), Ok(Seeds { from: 0, to: 1000 }));
        for wrong in ["7", "5..5", "9..2", "a..b", "-1..4"] {
            assert!(seeds(wrong).is_err(), "{wrong}");
        }
    }
}
