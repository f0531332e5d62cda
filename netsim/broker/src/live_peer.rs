//! One peer of a trial, as the trial sees it: process, files, the line to it.

use crate::process::{Process, Processes, Used};
use crate::stream::Line;
use nix::sys::signal::Signal;
use skein_link::{LinkNews, RadioCounters};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// What has become of a peer's computer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Computer {
    /// Its process runs.
    Runs,
    /// Its process stands still.
    Paused,
    /// Its process was ended on purpose.
    Off,
    /// Its process ended by itself.
    Crashed,
}

/// The percepts that a peer was told and has not answered. A percept that was told before
/// the first answer of a life counts for nothing: who starts is not ready to fly yet.
#[derive(Clone, Debug, Default)]
struct Owed {
    answers: bool,
    /// When they were told, ascending, milliseconds of scenario time.
    told_ms: VecDeque<u64>,
}

/// Percepts remembered: more than any time in which an answer is waited for has.
const MAX_OWED: usize = 64;

impl Owed {
    fn told(&mut self, at_ms: u64) {
        if self.answers && self.told_ms.len() < MAX_OWED {
            self.told_ms.push_back(at_ms);
        }
    }

    fn answered(&mut self, from_ms: u64) {
        self.answers = true;
        while self.told_ms.front().is_some_and(|t| *t <= from_ms) {
            self.told_ms.pop_front();
        }
    }

    fn owed_ms(&self, now_ms: u64) -> u64 {
        self.told_ms
            .front()
            .map_or(0, |t| now_ms.saturating_sub(*t))
    }
}

/// One peer.
#[derive(Debug)]
pub(crate) struct LivePeer {
    id: u16,
    flies: bool,
    /// Whether its airframe is still there.
    airborne: bool,
    computer: Computer,
    process: Option<Process>,
    /// The way to it, once it said hello.
    line: Option<Line>,
    /// The links it was told last.
    told: Option<LinkNews>,
    /// What its radio did in this life.
    radio: RadioCounters,
    /// The percepts that it was told and has not answered.
    owed: Owed,
    /// Whether it was asked to leave or said goodbye.
    left: bool,
    files: Files,
}

#[derive(Clone, Debug)]
struct Files {
    config: PathBuf,
    journal: PathBuf,
    log: PathBuf,
    console_token: PathBuf,
}

impl LivePeer {
    /// A peer that has not been started, with its files in `dir`.
    #[must_use]
    pub(crate) fn new(dir: &Path, id: u16, flies: bool) -> Self {
        let file = |what: &str| dir.join(format!("uav{id}.{what}"));
        Self {
            id,
            flies,
            airborne: flies,
            computer: Computer::Off,
            process: None,
            line: None,
            told: None,
            radio: RadioCounters::default(),
            owed: Owed::default(),
            left: false,
            files: Files {
                config: file("json5"),
                journal: file("journal"),
                log: file("log"),
                console_token: file("token"),
            },
        }
    }

    /// What people call it.
    pub(crate) fn name(&self) -> String {
        if self.flies {
            format!("uav{}", self.id)
        } else {
            "the ground station".to_owned()
        }
    }

    /// Whether it is a UAV.
    pub(crate) fn flies(&self) -> bool {
        self.flies
    }

    /// Whether its airframe is there.
    pub(crate) fn airborne(&self) -> bool {
        self.airborne
    }

    /// Whether its radio works at present.
    pub(crate) fn on_air(&self) -> bool {
        self.runs() && self.line.is_some()
    }

    /// Whether its process runs.
    pub(crate) fn runs(&self) -> bool {
        self.computer == Computer::Runs
    }

    /// Whether there is a process, standing still perhaps.
    pub(crate) fn has_process(&self) -> bool {
        matches!(self.computer, Computer::Runs | Computer::Paused)
    }

    /// Whether its process has said hello.
    pub(crate) fn is_connected(&self) -> bool {
        self.line.is_some()
    }

    /// The file with its configuration.
    pub(crate) fn config(&self) -> &Path {
        &self.files.config
    }

    /// The file with the token of its console, if it has one.
    pub(crate) fn console_token(&self) -> &Path {
        &self.files.console_token
    }

    /// The way to it, while it is connected.
    pub(crate) fn line(&self) -> Option<&Line> {
        self.line.as_ref()
    }

    /// Whether that process is the present one.
    pub(crate) fn is_process(&self, pid: u32) -> bool {
        self.process.as_ref().is_some_and(|p| p.pid() == pid)
    }

    /// Whether its process has not ended.
    pub(crate) fn is_there(&mut self) -> bool {
        self.process.as_mut().is_some_and(Process::is_there)
    }

    /// The last line of its log, for errors.
    pub(crate) fn last_words(&self) -> String {
        let text = std::fs::read_to_string(&self.files.log).unwrap_or_default();
        let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
        // A panic says where in one line and why in the next.
        let panic = lines.iter().rposition(|l| l.contains("panicked at"));
        let last = match panic {
            Some(at) => lines[at..]
                .iter()
                .take(2)
                .copied()
                .collect::<Vec<_>>()
                .join(" "),
            None => lines
                .last()
                .copied()
                .unwrap_or("it left no message")
                .to_owned(),
        };
        format!("{last} (see {})", self.files.log.display())
    }

    /// Starts its process; a UAV flies again.
    ///
    /// # Errors
    /// When it cannot be started.
    pub(crate) fn start(&mut self, processes: &Processes) -> std::io::Result<()> {
        self.line = None;
        self.told = None;
        self.owed = Owed::default();
        self.left = false;
        self.airborne = self.flies;
        self.process = Some(processes.launch(&self.files.config, &self.files.log)?);
        self.computer = Computer::Runs;
        Ok(())
    }

    /// Its process said hello.
    pub(crate) fn connect(&mut self, line: Line) {
        self.line = Some(line);
    }

    /// Its stream ended. Gives what its radio did, and whether the process ended by
    /// itself.
    pub(crate) fn disconnect(&mut self) -> (RadioCounters, bool) {
        self.line = None;
        let crashed = self.runs() && !self.left;
        if crashed {
            self.computer = Computer::Crashed;
        }
        (std::mem::take(&mut self.radio), crashed)
    }

    /// What its radio has done so far in this life; gives how many transmissions arrived
    /// since the last time, and how many of them late.
    pub(crate) fn counted(&mut self, radio: RadioCounters) -> (u64, u64) {
        let before = std::mem::replace(&mut self.radio, radio);
        (
            self.radio.arrived.saturating_sub(before.arrived),
            self.radio.late.saturating_sub(before.late),
        )
    }

    /// It is told a percept.
    pub(crate) fn told_percept(&mut self, now_ms: u64) {
        self.owed.told(now_ms);
    }

    /// It answers the percept of `from_ms`, and with it all earlier ones.
    pub(crate) fn answers(&mut self, from_ms: u64) {
        self.owed.answered(from_ms);
    }

    /// How long it has owed an answer to a percept, milliseconds of scenario time; nothing
    /// where no answer can come.
    pub(crate) fn owed_ms(&self, now_ms: u64) -> u64 {
        if self.on_air() && self.airborne {
            self.owed.owed_ms(now_ms)
        } else {
            0
        }
    }

    /// It is waited for no longer, until it answers again; says whether it owed anything.
    pub(crate) fn excuse(&mut self) -> bool {
        let owed = !self.owed.told_ms.is_empty();
        self.owed = Owed::default();
        owed
    }

    /// What its process has used so far.
    pub(crate) fn used(&self) -> Option<Used> {
        let process = self.process.as_ref().filter(|_| self.has_process())?;
        Used::of(process.pid())
    }

    /// Takes what its radio did.
    pub(crate) fn take_radio(&mut self) -> RadioCounters {
        std::mem::take(&mut self.radio)
    }

    /// It leaves because it was told to.
    pub(crate) fn leaves(&mut self) {
        self.left = true;
    }

    /// Ends its process at once.
    pub(crate) async fn kill(&mut self) {
        self.computer = Computer::Off;
        if let Some(process) = &mut self.process {
            process.kill().await;
        }
    }

    /// Its airframe is gone; the process ends at once.
    pub(crate) fn lose_airframe(&mut self) {
        self.airborne = false;
        self.computer = Computer::Off;
        self.signal(Signal::SIGKILL);
    }

    /// Asks its process to end.
    pub(crate) fn terminate(&mut self) {
        self.computer = Computer::Off;
        self.left = true;
        self.signal(Signal::SIGTERM);
    }

    /// Its process stands still.
    pub(crate) fn pause(&mut self) {
        self.computer = Computer::Paused;
        self.signal(Signal::SIGSTOP);
    }

    /// Its process goes on; false when it did not stand still.
    pub(crate) fn resume(&mut self) -> bool {
        let paused = self.computer == Computer::Paused;
        if paused {
            // What it was told meanwhile it answers when it gets round to it.
            self.owed = Owed::default();
            self.computer = Computer::Runs;
            self.signal(Signal::SIGCONT);
        }
        paused
    }

    /// Tells it that the trial is over, or asks its process to end where nobody listens.
    pub(crate) fn dismiss(&mut self) {
        if self.computer == Computer::Paused {
            self.signal(Signal::SIGCONT);
        }
        match &self.line {
            Some(line) => line.end(),
            None => self.signal(Signal::SIGTERM),
        }
    }

    /// Waits until its process has left; kills it if it does not.
    pub(crate) async fn wait_or_kill(&mut self) {
        if let Some(process) = &mut self.process {
            process.wait_or_kill().await;
        }
    }

    /// The links, if they are not those it was told last.
    pub(crate) fn news_of_links(&mut self, links: LinkNews) -> Option<LinkNews> {
        if self.told.as_ref() == Some(&links) {
            return None;
        }
        self.told = Some(links.clone());
        Some(links)
    }

    /// Takes its journal away, and what its operator said.
    pub(crate) fn wipe(&self) {
        let _ = std::fs::remove_file(&self.files.journal);
        let _ = std::fs::remove_file(self.files.journal.with_extension("journal.operator"));
    }

    fn signal(&mut self, signal: Signal) {
        if let Some(process) = &mut self.process {
            process.signal(signal);
        }
    }

    /// Its number.
    pub(crate) fn id(&self) -> u16 {
        self.id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_settles_all_earlier_percepts() {
        let mut owed = Owed::default();
        owed.told(100);
        assert_eq!(owed.owed_ms(900), 0, "it has not begun to answer");
        owed.answered(100);
        for t in [600, 1_100, 1_600] {
            owed.told(t);
        }
        assert_eq!(owed.owed_ms(1_700), 1_100);
        owed.answered(1_100);
        assert_eq!(owed.owed_ms(1_700), 100);
        owed.answered(1_600);
        assert_eq!(owed.owed_ms(9_000), 0);
    }
}
