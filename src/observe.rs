//! `skein observe`: what the swarm publishes, as one of its peers hears it.

use crate::{cli, exit};
use clap::{Args, ValueEnum};
use skein_broker::registry;
use skein_node::bus::{Observed, Observer};
use skein_peer::PeerId;
use skein_peer::wire::codec::{Body, open};
use skein_peer::wire::message::{ListedRun, Record};
use skein_peer::wire::obstacle::Found;
use skein_peer::wire::signature::Off;
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
    /// Which keys, for example `*/v4/state/**`; without it all.
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
                // On an error, whoever read this has closed the pipe.
                let Ok(new) = show(args.format, &mut newest, &seen) else { break };
                shown += u64::from(new);
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
    fn is_new(&mut self, key: &str, record: &Record) -> bool {
        let version = (record.incarnation, record.seq);
        match self.0.get(key) {
            Some(newest) if *newest >= version => false,
            _ => {
                self.0.insert(key.to_owned(), version);
                true
            }
        }
    }
}

/// Shows a record unless it was shown before; tells whether it did.
fn show(format: Format, newest: &mut Newest, seen: &Observed) -> std::io::Result<bool> {
    let mut out = std::io::stdout().lock();
    let (record, body) = match open(&seen.bytes, &Off) {
        Ok(opened) => opened,
        Err(error) => {
            match format {
                Format::Text => writeln!(out, "{}  refused: {error}", seen.key)?,
                Format::Jsonl => {
                    writeln!(
                        out,
                        "{}",
                        serde_json::json!({ "key": seen.key, "refused": error.to_string() })
                    )?;
                }
            }
            return Ok(true);
        }
    };
    if !newest.is_new(&seen.key, &record) {
        return Ok(false);
    }
    match format {
        Format::Text => {
            let (author, life, seq) = (record.author, record.incarnation, record.seq);
            writeln!(
                out,
                "{}  peer {author} life {life} #{seq}  {}",
                seen.key,
                words(author, &body)
            )?;
        }
        Format::Jsonl => writeln!(out, "{}", json(seen, &record, &body))?,
    }
    Ok(true)
}

fn json(seen: &Observed, record: &Record, body: &Body) -> serde_json::Value {
    let value = match body {
        Body::Beacon(b) => serde_json::to_value(b),
        Body::State(b) => serde_json::to_value(b),
        Body::Bid(b) => serde_json::to_value(b),
        Body::Claim(b) => serde_json::to_value(b),
        Body::Cover(b) => serde_json::to_value(b),
        Body::Mission(b) => serde_json::to_value(b),
        Body::Operator(b) => serde_json::to_value(b),
        Body::Finished(b) => serde_json::to_value(b),
        Body::Heartbeat(b) => serde_json::to_value(b),
        Body::Lacking(b) => serde_json::to_value(b),
        Body::Intent(b) => serde_json::to_value(b),
        Body::Conflict(b) => serde_json::to_value(b),
        Body::Task(b) => serde_json::to_value(b),
        Body::Bundle(b) => serde_json::to_value(b),
        Body::Target(b) => serde_json::to_value(b),
        Body::Detection(b) => serde_json::to_value(b),
        Body::Trail(b) => serde_json::to_value(b),
        Body::Count(b) => serde_json::to_value(b),
        Body::Usage(b) => serde_json::to_value(b),
        Body::Crowd(b) => serde_json::to_value(b),
        Body::Obstacles(b) => serde_json::to_value(b),
        Body::Aircraft(b) => serde_json::to_value(b),
    };
    serde_json::json!({
        "key": seen.key,
        "kind": body.kind().name(),
        "author": record.author,
        "incarnation": record.incarnation,
        "seq": record.seq,
        "transmitter": seen.hop.map(|h| h.transmitter),
        "hops": seen.hop.map(|h| h.hops),
        "body": value.unwrap_or_default(),
    })
}

/// A record in words.
fn words(author: u16, body: &Body) -> String {
    let metres = |mm: i32| f64::from(mm) / 1000.0;
    match body {
        Body::Beacon(b) => format!(
            "at ({:.0}, {:.0}) m, heartbeat {}, knows {} others{}",
            metres(b.east_mm),
            metres(b.north_mm),
            b.heartbeat,
            b.gossip.len(),
            if b.finished { ", finished" } else { "" }
        ),
        Body::State(s) => format!(
            "{:?} at ({:.0}, {:.0}, {:.0}) m, {:.1} m/s, {} s of fuel, mission {:?}, {} of {} cells",
            s.activity,
            metres(s.east_mm),
            metres(s.north_mm),
            metres(s.height_mm),
            f64::from(s.airspeed_mmps) / 1000.0,
            s.endurance_s,
            s.mission,
            s.covered,
            s.cells
        ),
        Body::Bid(s) => format!(
            "bids in round {} of {}, from cell {}",
            s.round.counter,
            s.round
                .members
                .iter()
                .map(|m| format!("uav{}", m.id))
                .collect::<Vec<_>>()
                .join(" "),
            s.anchor
        ),
        Body::Claim(r) => format!(
            "round {}: flies {}; answers for {}; done in {:.0} s",
            r.epoch.counter,
            listings(&r.plan),
            listings(&r.held),
            f64::from(r.eta_ms) / 1000.0
        ),
        Body::Cover(c) => format!(
            "coverage of revision {}, {} bytes",
            c.revision,
            c.covered.len()
        ),
        Body::Mission(m) => format!("mission revision {} of {} pieces", m.revision, m.chunks),
        Body::Operator(orders) => orders.to_string(),
        Body::Finished(f) => format!("revision {} is finished", f.revision),
        Body::Heartbeat(h) => format!(
            "at ({:.0}, {:.0}) m",
            f64::from(h.east_dm) / 10.0,
            f64::from(h.north_dm) / 10.0
        ),
        Body::Lacking(l) => format!(
            "lacks {} pieces of mission revision {}",
            l.pieces.iter().map(|b| b.count_ones()).sum::<u32>(),
            l.revision
        ),
        Body::Intent(i) => promises(
            i.in_force.version,
            i.proposal.as_ref().map(|p| p.version),
            &i.accepts,
        ),
        Body::Conflict(b) => promises(b.in_force, b.proposal, &b.accepts),
        Body::Task(t) => format!(
            "asks for a {:?} {:?}, revision {}, {:?}, worth {}",
            t.kind,
            t.name(),
            t.revision,
            t.state,
            t.worth
        ),
        Body::Bundle(b) => format!(
            "holds {} tasks, {} of them since before its offer; {} done before",
            b.tasks.len(),
            b.kept,
            b.done.len()
        ),
        Body::Target(t) => format!(
            "saw target {}.{} at {:.1} m east, {:.1} m north, at {} ms of the clock of percepts",
            t.by,
            t.number,
            f64::from(t.east_mm) / 1000.0,
            f64::from(t.north_mm) / 1000.0,
            t.seen_ms
        ),
        Body::Detection(d) => d.sentence(author),
        Body::Count(c) => format!(
            "counted {} passing in {:.0} s; {} stood there when it was seen last",
            c.passed,
            c.watched_ms as f64 / 1000.0,
            c.standing
        ),
        Body::Usage(u) => format!(
            "saw {} stretches of streets used for {} vehicle-seconds, and {} turns",
            u.stretches.len(),
            u.stretches.iter().map(|s| s.spent_ds / 10).sum::<u32>(),
            u.turns.iter().map(|t| u32::from(t.vehicles)).sum::<u32>()
        ),
        Body::Crowd(t) => format!(
            "knows of {} people in {} sectors of an event, {} of them too dense, by {} s of the clock of percepts",
            t.rows.iter().map(|r| u32::from(r.people)).sum::<u32>(),
            t.rows.len(),
            t.dense.len(),
            t.time_s
        ),
        Body::Obstacles(o) => {
            let one = |f: &Found| {
                let o = f.obstacle();
                format!("({:.1}, {:.1}) m", o.at().x, o.at().y)
            };
            let places: Vec<String> = o.found.iter().map(one).collect();
            format!(
                "knows of {} obstacles that are on no map: {}",
                o.found.len(),
                places.join(", ")
            )
        }
        Body::Aircraft(s) => format!(
            "senses {} aircraft that are no members, at {} ms of the clock of percepts",
            s.seen.len(),
            s.at_ms
        ),
        Body::Trail(t) => format!(
            "tells {} places of a contour, the first seen at {} ms of the clock of percepts",
            t.places.len(),
            t.seen_ms
        ),
    }
}

/// What is flown, offered and accepted, by versions.
fn promises(in_force: u32, proposal: Option<u32>, accepts: &[(PeerId, u32)]) -> String {
    let offers = proposal.map_or_else(String::new, |version| format!(", offers {version}"));
    let accepts = accepts.iter();
    let accepts = accepts.map(|(id, version)| format!(", accepts {version} of uav{}", id.0));
    format!(
        "flies promise {in_force}{offers}{}",
        accepts.collect::<String>()
    )
}

fn listings(all: &[ListedRun]) -> String {
    if all.is_empty() {
        return "nothing".to_owned();
    }
    let one = |l: &ListedRun| {
        let way = if l.backward { "<" } else { ">" };
        format!("{}+{}{way}", l.run.first, l.run.count)
    };
    all.iter().map(one).collect::<Vec<_>>().join(" ")
}
