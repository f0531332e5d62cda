//! `--web`: a page beside a verb that flies, watches or replays.

use crate::cli;
use clap::Args;
use skein_broker::control::{Request, command};
use skein_broker::registry;
use skein_netsim::fault::Fault;
use skein_recording::Sink;
use skein_recording::model::Knowledge;
pub use skein_web::ServerError;
use skein_web::server::Answer;
use skein_web::{Faults, Feed, Hello, Mode, Server};
use std::sync::{Arc, OnceLock};
use tokio::runtime::Runtime;

/// Whether there is a page.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct WebArgs {
    /// Shows a map on a page of 127.0.0.1, at this port or at any that is free, and says
    /// where. It stays until an interrupt.
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "0", value_parser = port)]
    pub web: Option<u16>,
}

impl WebArgs {
    /// Serves the page, if one is wanted.
    ///
    /// # Errors
    /// As [`Page::open`].
    pub fn open(self, hello: &Hello) -> Result<Option<Page>, ServerError> {
        self.web.map(|port| Page::open(port, hello)).transpose()
    }
}

fn port(text: &str) -> Result<u16, String> {
    let wrong = "write a port from 1 to 65535 behind --web, or nothing; a scenario goes before it";
    text.parse().map_err(|_| wrong.to_owned())
}

/// A page that is served.
#[derive(Debug)]
pub struct Page {
    runtime: Runtime,
    server: Server,
    feed: Arc<Feed>,
    trial: TrialName,
}

/// The name of the trial that the page's buttons reach, once it has one.
pub type TrialName = Arc<OnceLock<String>>;

impl Page {
    /// Serves a page, and says where on stderr.
    ///
    /// # Errors
    /// When there is no runtime, or the port cannot be had.
    pub fn open(port: u16, hello: &Hello) -> Result<Self, ServerError> {
        let failed = |cause| ServerError::Port { port, cause };
        let runtime = cli::runtime().map_err(failed)?;
        let feed = Feed::new(hello);
        let trial = TrialName::default();
        let flies = matches!(hello.mode, Mode::Trial | Mode::Watch);
        let faults = flies.then(|| {
            let trial = Arc::clone(&trial);
            Arc::new(OfTrial(trial)) as Arc<dyn Faults>
        });
        let server = runtime.block_on(Server::start(port, Arc::clone(&feed), faults))?;
        eprintln!("page: {}", server.url());
        Ok(Self {
            runtime,
            server,
            feed,
            trial,
        })
    }

    /// What the run is given to.
    #[must_use]
    pub fn sink(&self) -> Box<dyn Sink> {
        Box::new(self.feed.sink())
    }

    /// Where the name of the trial is put.
    #[must_use]
    pub fn trial(&self) -> TrialName {
        Arc::clone(&self.trial)
    }

    /// Goes on until the program is asked to stop.
    pub fn stay(self) {
        // Polled first, it listens before anybody is told.
        self.runtime.block_on(async {
            tokio::join!(
                biased;
                cli::asked_to_stop(),
                async { eprintln!("the page stays until Ctrl-C: {}", self.server.url()) },
            )
        });
    }
}

/// What a page of a run is told first.
#[must_use]
pub fn hello(mode: Mode, title: String, command: String) -> Hello {
    let knowledge = match mode {
        Mode::Watch => Knowledge::Swarm,
        _ => Knowledge::World,
    };
    Hello {
        mode,
        knowledge,
        title,
        command,
    }
}

/// The control port of a trial, opened by its token, which never leaves this process.
#[derive(Debug)]
struct OfTrial(TrialName);

impl Faults for OfTrial {
    fn inject(&self, fault: Fault) -> Answer {
        inject(&self.0, fault)
    }
}

/// Injects a fault into a trial.
#[must_use]
pub fn inject(trial: &TrialName, fault: Fault) -> Answer {
    let name = trial.get().cloned();
    Box::pin(async move {
        let name = name.ok_or("the trial has not begun yet; try again")?;
        let found = tokio::task::spawn_blocking(move || registry::find(Some(&name))).await;
        let entry = found.map_err(|e| e.to_string())?;
        let entry = entry.map_err(|e| e.to_string())?;
        let lines = command(&entry, &Request::Fault(fault)).await;
        lines.map_err(|e| e.why.to_string())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_is_a_port_and_a_scenario_is_none() {
        assert_eq!(port("8080"), Ok(8080));
        for wrong in ["helsinki", "70000", "-1", ""] {
            assert!(port(wrong).unwrap_err().contains("--web"), "{wrong}");
        }
    }

    #[test]
    fn only_what_is_heard_is_belief() {
        let of = |mode| hello(mode, String::new(), String::new()).knowledge;
        assert_eq!(of(Mode::Watch), Knowledge::Swarm);
        assert_eq!(of(Mode::Trial), Knowledge::World);
    }
}
