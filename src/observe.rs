//! `skein observe`: what the swarm publishes, as one of its peers hears it.

use crate::{cli, exit};
use clap::{Args, ValueEnum};
use skein_broker::registry;
use skein_node::bus::{Observed, Observer};
use skein_peer::wire::message::Record;
use std::collections::BTreeMap;
use std::io::Write;
use std::process::ExitCode;
use std::time::Duration;

/// Without anything heard for this long, say why that may be.
const SILENCE: Duration = Duration::from_millis(1_500);

/// Shows what the swarm publishes: states, claims, coverage, rounds of all UAVs.
///
/// Attaches to the ground station's peer of the only running trial, or to the peer
/// given by `--endpoint`, and prints each record once, whoever passed it on.
#[derive(Debug, Args)]
pub struct ObserveArgs {
    /// Which keys, for example `*/v1/state/**`; without it all.
    pub keyexpr: Option<String>,
    /// Ends after this many seconds; without it by an interrupt.
    #[arg(long, value_name = "SECONDS")]
    pub timeout: Option<f64>,
    /// How records are printed.
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// The trial, as it named itself when it began.
    #[arg(long, value_name = "ID", conflicts_with = "endpoint")]
    pub trial: Option<String>,
    /// The peer to attach to, as tcp/127.0.0.1:PORT.
    #[arg(long, value_name = "ENDPOINT")]
    pub endpoint: Option<String>,
}

/// Forms of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// A line for people.
    Text,
    /// A JSON object a line.
    Jsonl,
}

/// Runs the verb.
///
/// # Errors
/// When there is no runtime or stdout cannot be written.
pub fn run(args: &ObserveArgs) -> anyhow::Result<ExitCode> {
    if args.timeout.is_some_and(|t| !(t.is_finite() && t > 0.0)) {
        eprintln!("error: --timeout must be a number of seconds above 0");
        return Ok(ExitCode::from(exit::USAGE));
    }
    let endpoint = match endpoint(args) {
        Ok(endpoint) => endpoint,
        Err(why) => {
            eprintln!("error: 0 peers: {why}");
            return Ok(ExitCode::from(exit::NO_PEERS));
        }
    };
    cli::runtime()?.block_on(watch(args, &endpoint))
}

fn endpoint(args: &ObserveArgs) -> Result<String, String> {
    if let Some(endpoint) = &args.endpoint {
        return Ok(endpoint.clone());
    }
    let trial = registry::find(args.trial.as_deref()).map_err(|e| e.to_string())?;
    trial.observe.ok_or_else(|| {
        format!(
            "trial {} has not launched its peers yet; try again",
            trial.id
        )
    })
}

async fn watch(args: &ObserveArgs, endpoint: &str) -> anyhow::Result<ExitCode> {
    let keys = args.keyexpr.as_deref().unwrap_or("**");
    let mut observer = match Observer::open(endpoint, keys).await {
        Ok(observer) => observer,
        Err(error) => {
            eprintln!(
                "error: 0 peers: {error} (as a Zenoh client of {endpoint}; is the trial still running?)"
            );
            return Ok(ExitCode::from(exit::NO_PEERS));
        }
    };
    let end = tokio::time::sleep(args.timeout.map_or(Duration::MAX, Duration::from_secs_f64));
    let stop = cli::asked_to_stop();
    let silence = tokio::time::sleep(SILENCE);
    tokio::pin!(end, stop, silence);
    let mut newest = Newest::default();
    let (mut shown, mut heard, mut warned) = (0u64, 0u64, false);
    loop {
        tokio::select! {
            () = &mut end => break,
            () = &mut stop => break,
            () = &mut silence, if heard == 0 && !warned => {
                warned = true;
                let linked = if observer.linked().await { "linked" } else { "not linked" };
                eprintln!("0 peers heard so far: {linked} to {endpoint} as a client, waiting for {keys:?}");
            }
            seen = observer.next() => {
                let Some(seen) = seen else { break };
                heard += 1;
                if newest.is_new(&seen) {
                    shown += 1;
                    if show(args.format, &seen).is_err() {
                        // Whoever read this has closed the pipe.
                        break;
                    }
                }
            }
        }
    }
    observer.close().await;
    if shown == 0 {
        eprintln!("error: 0 peers: nothing was heard on {keys:?} from {endpoint}");
        return Ok(ExitCode::from(exit::NO_PEERS));
    }
    Ok(ExitCode::from(exit::OK))
}

/// The newest sequence number of each key and life: a record that was passed on by
/// several peers is shown once, and an older one not at all.
#[derive(Debug, Default)]
struct Newest(BTreeMap<String, (u32, u32)>);

impl Newest {
    fn is_new(&mut self, seen: &Observed) -> bool {
        let Some(record) = record(&seen.bytes) else {
            return true;
        };
        let version = (record.incarnation, record.seq);
        match self.0.get(&seen.key) {
            Some(newest) if *newest >= version => false,
            _ => {
                self.0.insert(seen.key.clone(), version);
                true
            }
        }
    }
}

fn record(bytes: &[u8]) -> Option<Record> {
    cbor4ii::serde::from_slice(bytes).ok()
}

fn show(format: Format, seen: &Observed) -> std::io::Result<()> {
    let record = record(&seen.bytes);
    let body = record.as_ref().map_or_else(
        || "unreadable".to_owned(),
        |r| format!("{} bytes", r.body.len()),
    );
    let mut out = std::io::stdout().lock();
    match format {
        Format::Text => match &record {
            Some(r) => writeln!(
                out,
                "{}  uav{} life {} #{}  {body}",
                seen.key, r.author, r.incarnation, r.seq
            ),
            None => writeln!(out, "{}  {body}", seen.key),
        },
        Format::Jsonl => {
            let json = serde_json::json!({
                "key": seen.key,
                "author": record.as_ref().map(|r| r.author),
                "incarnation": record.as_ref().map(|r| r.incarnation),
                "seq": record.as_ref().map(|r| r.seq),
                "hops": seen.hop.map(|h| h.hops),
                "body": body,
            });
            writeln!(out, "{json}")
        }
    }
}
