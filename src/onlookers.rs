//! Who looks at a run: a page, a terminal. One of them that leaves ends neither the run nor the
//! others.

use crate::page::TrialName;
use crate::{cli, log, page};
use skein_netsim::fault::Fault;
use skein_recording::model::Knowledge;
use skein_recording::sink::Tee;
use skein_recording::{Record, Sink};
use skein_terminal::show::Kill;
use skein_terminal::{Left, Look, Options, Pace, show};
use skein_view::line::{Full, line};
use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::thread::JoinHandle;
use tokio::sync::oneshot;

/// All of them as one sink, which never fails.
#[derive(Debug)]
pub struct Onlookers(Tee);

impl Onlookers {
    /// These.
    #[must_use]
    pub fn new(sinks: Vec<Box<dyn Sink>>) -> Self {
        Self(Tee::new(sinks))
    }
}

impl Sink for Onlookers {
    fn take(&mut self, record: &Record) -> io::Result<()> {
        for why in self.0.give(record) {
            if why.kind() != io::ErrorKind::BrokenPipe {
                tracing::warn!(%why, "one who looks at the run takes no more");
            }
        }
        Ok(())
    }
}

/// A map was asked for where there is no terminal.
#[derive(Clone, Copy, Debug)]
pub struct NoTerminal;

impl fmt::Display for NoTerminal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a map is drawn on a terminal, and here is none; --web shows it on a page")
    }
}

impl std::error::Error for NoTerminal {}

/// A map on this terminal, in a thread of its own.
#[derive(Debug)]
pub struct Map {
    thread: JoinHandle<io::Result<Left>>,
    stop: Arc<AtomicBool>,
    left: Option<oneshot::Receiver<()>>,
}

/// What the map shows.
#[derive(Debug)]
pub struct Shows {
    /// What it is.
    pub title: String,
    /// How the run goes by.
    pub pace: Pace,
    /// Who knows what frames say.
    pub knowledge: Knowledge,
    /// Of which trial UAVs can be killed.
    pub trial: Option<TrialName>,
}

impl Map {
    /// Takes the terminal; gives what the run is given to.
    ///
    /// # Errors
    /// When there is no thread.
    pub fn open(shows: Shows) -> io::Result<(Self, Box<dyn Sink>)> {
        let full = match shows.pace {
            Pace::Live => Full::SkipFrames,
            Pace::Play(_) => Full::Wait,
        };
        let (sink, words) = line(full);
        let stop = Arc::new(AtomicBool::new(false));
        let options = Options {
            title: shows.title,
            knowledge: shows.knowledge,
            pace: shows.pace,
            look: Look::of_environment(),
            kill: shows.trial.map(killer),
            stop: Arc::clone(&stop),
            stays: shows.pace != Pace::Live,
        };
        let (gone, left) = oneshot::channel();
        let named = std::thread::Builder::new().name("map".to_owned());
        let thread = named.spawn(move || {
            let shown = show(words, options);
            if matches!(shown, Ok(Left::Asked)) {
                // Who waited for it may be gone first.
                let _ = gone.send(());
            }
            shown
        })?;
        let map = Self {
            thread,
            stop,
            left: Some(left),
        };
        Ok((map, Box::new(sink)))
    }

    /// Ends when a person has left the map; never where it could not be drawn.
    pub fn left(&mut self) -> impl Future<Output = ()> + use<> {
        let left = self.left.take();
        async move {
            let left = match left {
                Some(left) => left.await.is_ok(),
                None => false,
            };
            if !left {
                std::future::pending::<()>().await;
            }
        }
    }

    /// Whether the map is gone already.
    #[must_use]
    pub fn is_left(&self) -> bool {
        self.thread.is_finished()
    }

    /// The program was asked to stop: the map leaves.
    #[must_use]
    pub fn stop(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stop)
    }

    /// Waits until the terminal is given back.
    ///
    /// # Errors
    /// When the terminal could not be taken or written.
    pub fn join(self) -> io::Result<Left> {
        let shown = self.thread.join();
        log::release();
        shown.unwrap_or_else(|_| Err(io::Error::other("the map panicked")))
    }
}

/// Ends when the program is asked to stop, or the map was left.
pub fn asked_to_stop(map: Option<&mut Map>) -> impl Future<Output = ()> + use<> {
    let left = map.map(Map::left);
    async move {
        match left {
            Some(left) => tokio::select! {
                () = left => {}
                () = cli::asked_to_stop() => {}
            },
            None => cli::asked_to_stop().await,
        }
    }
}

/// Leaves the map when the program is asked to stop, and ends it when it is asked again.
///
/// # Errors
/// When there is no thread.
pub fn stop_when_asked(stop: Arc<AtomicBool>) -> io::Result<()> {
    let runtime = cli::runtime()?;
    let named = std::thread::Builder::new().name("signals".to_owned());
    named.spawn(move || {
        runtime.block_on(cli::asked_to_stop());
        stop.store(true, Ordering::SeqCst);
        runtime.block_on(cli::asked_to_stop());
        std::process::exit(i32::from(crate::exit::NO_PEERS));
    })?;
    Ok(())
}

/// Kills UAVs of a trial by its control port, in a thread of its own.
fn killer(trial: TrialName) -> Kill {
    Box::new(move |peer: u16, answer: Sender<String>| {
        let asked = page::inject(&trial, Fault::Kill { peer });
        let ask = move || {
            let said = match cli::runtime() {
                Ok(runtime) => runtime.block_on(asked),
                Err(why) => Err(why.to_string()),
            };
            let text = match said {
                Ok(lines) => lines.join("; "),
                Err(why) => format!("refused: {why}"),
            };
            // The map may be left meanwhile.
            let _ = answer.send(text);
        };
        drop(std::thread::Builder::new().spawn(ask));
    })
}
