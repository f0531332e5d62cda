//! `skein watch`: a map of a running swarm, from nothing but what it says on the air.

use crate::onlookers::{Map, Onlookers, Shows, asked_to_stop};
use crate::page::{Page, TrialName, WebArgs, hello};
use crate::{cli, exit};
use clap::Args;
use skein_broker::registry::{self, Entry};
use skein_node::bus::{Observed, Observer};
use skein_peer::Mission;
use skein_recording::Sink;
use skein_recording::model::Knowledge;
use skein_terminal::{Pace, screen};
use skein_view::Belief;
use skein_web::Mode;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{Instant, MissedTickBehavior};

/// Whoever is there is heard within this time: peers beacon once a second or more often.
const FIRST_WORD: Duration = Duration::from_millis(2_000);

/// Without anything heard for so long the swarm is gone.
const SILENCE: Duration = Duration::from_secs(15);

/// How often the map is told how all stands.
const LOOK: Duration = Duration::from_millis(250);

/// Draws a map of a running swarm from what it says on the air: what it believes, as old as
/// the radio makes it, and not what is true.
///
/// An ordinary Zenoh client of the ground station of a running trial, or of the peer given by
/// --endpoint. Draws on this terminal, or with --web on a page.
#[derive(Debug, Args)]
pub struct WatchArgs {
    /// The trial, as it named itself when it began; without it the only one.
    #[arg(conflicts_with = "endpoint")]
    pub trial: Option<String>,
    /// The peer to attach to, as tcp/127.0.0.1:PORT.
    #[arg(long, value_name = "ENDPOINT")]
    pub endpoint: Option<String>,
    /// Where it is shown besides.
    #[command(flatten)]
    pub web: WebArgs,
}

/// Whom to listen to.
struct Swarm {
    endpoint: String,
    trial: Option<Entry>,
}

impl Swarm {
    fn find(args: &WatchArgs) -> Result<Self, String> {
        if let Some(endpoint) = &args.endpoint {
            let endpoint = endpoint.clone();
            return Ok(Self {
                endpoint,
                trial: None,
            });
        }
        let trial = registry::find(args.trial.as_deref()).map_err(|e| e.to_string())?;
        let endpoint = trial.observe.clone().ok_or_else(|| {
            format!(
                "trial {} has not launched its peers yet; try again",
                trial.id
            )
        })?;
        Ok(Self {
            endpoint,
            trial: Some(trial),
        })
    }

    /// The mission that the trial began with: peers that all hold it say it no more.
    fn mission(&self) -> Option<Arc<Mission>> {
        let file = self.trial.as_ref()?.run_dir.join("mission.json");
        let bytes = std::fs::read(file).ok()?;
        serde_json::from_slice(&bytes).ok().map(Arc::new)
    }

    fn title(&self) -> String {
        self.trial
            .as_ref()
            .map_or_else(|| self.endpoint.clone(), |t| t.id.clone())
    }
}

/// Runs the verb.
///
/// # Errors
/// When there is no runtime, no page or no thread.
pub fn run(args: &WatchArgs) -> anyhow::Result<ExitCode> {
    let on_terminal = screen::is_one();
    if !on_terminal && args.web.web.is_none() {
        eprintln!(
            "error: a map needs a terminal, and here is none; --web shows it on a page, `skein observe` prints lines"
        );
        return Ok(ExitCode::from(exit::USAGE));
    }
    let nobody = |why: &str| {
        eprintln!("error: nobody to watch: {why}");
        Ok(ExitCode::from(exit::NO_PEERS))
    };
    let swarm = match Swarm::find(args) {
        Ok(swarm) => swarm,
        Err(why) => return nobody(&why),
    };
    let runtime = cli::runtime()?;
    let (observer, first) = match runtime.block_on(attach(&swarm.endpoint)) {
        Ok(attached) => attached,
        Err(why) => return nobody(&why),
    };
    let title = swarm.title();
    let command = format!("skein watch {title} --web");
    let hello = hello(Mode::Watch, title.clone(), command);
    let page = args.web.open(&hello)?;
    let name = page.as_ref().map(Page::trial).unwrap_or_default();
    if let Some(trial) = &swarm.trial {
        // Nobody else has named it.
        let _ = name.set(trial.id.clone());
    }
    let mut sinks: Vec<Box<dyn Sink>> = page.iter().map(Page::sink).collect();
    let mut map = None;
    if on_terminal && page.is_none() {
        let kills = swarm.trial.is_some().then(|| TrialName::clone(&name));
        let (opened, sink) = Map::open(Shows {
            title,
            pace: Pace::Live,
            knowledge: Knowledge::Swarm,
            trial: kills,
        })?;
        sinks.push(sink);
        map = Some(opened);
    }
    let stop = asked_to_stop(map.as_mut());
    let mut sinks = Onlookers::new(sinks);
    let gone = runtime.block_on(listen(&swarm, observer, first, &mut sinks, stop));
    drop(sinks);
    if let Some(map) = map {
        map.stop().store(true, std::sync::atomic::Ordering::SeqCst);
        map.join()?;
    }
    if gone {
        eprintln!(
            "nothing was heard for {} s: the swarm is gone",
            SILENCE.as_secs()
        );
        if let Some(page) = page {
            page.stay();
        }
    }
    Ok(ExitCode::from(exit::OK))
}

/// A client of a peer, and the first thing that it hears.
async fn attach(endpoint: &str) -> Result<(Observer, Observed), String> {
    let deadline = Instant::now() + FIRST_WORD;
    let next = "is the trial still running? `skein trial` starts one";
    let mut observer = Observer::open(endpoint, "**")
        .await
        .map_err(|e| format!("{e} (as a Zenoh client of {endpoint}); {next}"))?;
    match tokio::time::timeout_at(deadline, observer.next()).await {
        Ok(Some(first)) => Ok((observer, first)),
        Ok(None) | Err(_) => {
            observer.close().await;
            Err(format!(
                "the peer at {endpoint} hears and says nothing; {next}"
            ))
        }
    }
}

/// Listens until it is asked to stop, or the swarm is gone; tells which.
async fn listen(
    swarm: &Swarm,
    mut observer: Observer,
    first: Observed,
    sinks: &mut Onlookers,
    stop: impl Future<Output = ()>,
) -> bool {
    let began = Instant::now();
    let mut belief = Belief::new(swarm.trial.as_ref().map(|t| t.fleet.as_str()));
    belief.heard(0, &first.key, &first.bytes);
    if let Some(mission) = swarm.mission() {
        belief.mission(0, &mission);
    }
    let mut looks = tokio::time::interval(LOOK);
    looks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut heard = Instant::now();
    tokio::pin!(stop);
    let gone = loop {
        let now_ms = u64::try_from(began.elapsed().as_millis()).unwrap_or(u64::MAX);
        tokio::select! {
            () = &mut stop => break false,
            seen = observer.next() => {
                let Some(seen) = seen else { break true };
                heard = Instant::now();
                belief.heard(now_ms, &seen.key, &seen.bytes);
            }
            _ = looks.tick() => {
                if heard.elapsed() > SILENCE {
                    break true;
                }
                belief.look(now_ms);
                for record in belief.take() {
                    // Onlookers never fail: one that has left is told no more.
                    let _ = sinks.take(&record);
                }
            }
        }
    };
    observer.close().await;
    gone
}
