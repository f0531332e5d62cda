//! The peers' processes, and the guard that outlives the trial.
//!
//! The guard is the same program, started with [`GUARD_COMMAND`]. It leads a process
//! group that all peers join, and holds one end of a pipe from the trial. When the
//! pipe ends, however the trial ended, the guard kills the whole group, paused
//! members and itself included. Nothing needs to be cleaned up by hand.

use nix::sys::signal::{Signal, kill, killpg};
use nix::unistd::Pid;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;
use tokio::process::{Child, Command};

/// The hidden verb under which the program is its own guard.
pub const GUARD_COMMAND: &str = "__guard";

/// Zenoh's tasks of one peer on two threads: eight processes on two cores have better uses for
/// 64 threads. Links are made and ended on one of them, so that messages on the other do not
/// wait for it: in a swarm of fifty that quarters the messages that come late while transports
/// are cut.
const ZENOH_RUNTIME: &str = "(rx:(handover:app),tx:(handover:app),acc:(handover:net),net:(worker_threads:1),app:(worker_threads:1))";

/// What peers write to their logs: their reports, and what others complain about.
const PEER_LOG: &str = "warn,skein_node=info";

/// How long a peer may take to leave by itself before it is killed.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(2);

/// Waits until the trial is gone, then ends the process group that this process
/// leads. Does not return unless it leads none.
pub fn guard() {
    let mut byte = [0];
    // Nothing is ever written; the read ends when the last writer is gone.
    while matches!(std::io::stdin().read(&mut byte), Ok(n) if n > 0) {}
    let group = nix::unistd::getpgrp();
    if group == nix::unistd::getpid() {
        let _ = killpg(group, Signal::SIGCONT);
        let _ = killpg(group, Signal::SIGKILL);
    }
}

/// Ticks of the clock in which Linux counts the time of processors, a second.
const TICKS_PS: f64 = 100.0;

/// What a process has used so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Used {
    /// Time of processors, seconds.
    pub cpu_s: f64,
    /// The most memory that it held at once, MB.
    pub peak_mb: f64,
}

impl Used {
    /// Of a process, where the system tells it.
    #[must_use]
    pub fn of(pid: u32) -> Option<Self> {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
        // The name before it may hold spaces and brackets. Of the fields after it, counted
        // from 0, 11 and 12 are the times in the program and in the system.
        let fields: Vec<&str> = stat.rsplit(") ").next()?.split_whitespace().collect();
        let ticks: f64 =
            fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
        let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
        let kb: f64 = peak.split_whitespace().next()?.parse().ok()?;
        Some(Self {
            cpu_s: ticks / TICKS_PS,
            peak_mb: kb / 1000.0,
        })
    }
}

/// All processes of a trial.
#[derive(Debug)]
pub struct Processes {
    program: PathBuf,
    guard: Child,
    group: i32,
}

impl Processes {
    /// Starts the guard; `program` is this program's own file.
    ///
    /// # Errors
    /// When it cannot be started.
    pub fn start(program: &Path) -> std::io::Result<Self> {
        let guard = Command::new(program)
            .arg(GUARD_COMMAND)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .process_group(0)
            .spawn()?;
        let group = id_of(&guard)?;
        Ok(Self {
            program: program.to_owned(),
            guard,
            group,
        })
    }

    /// Starts the peer that `config` describes, with its log appended to `log`.
    ///
    /// # Errors
    /// When it cannot be started.
    pub fn launch(&self, config: &Path, log: &Path) -> std::io::Result<Process> {
        let log = File::options().create(true).append(true).open(log)?;
        let child = Command::new(&self.program)
            .args(["--log", PEER_LOG, "peer"])
            .arg("--config")
            .arg(config)
            .env(
                "ZENOH_RUNTIME",
                std::env::var("ZRT").unwrap_or_else(|_| ZENOH_RUNTIME.to_owned()),
            )
            // A dial into the dark is an error, and it is no news; a panic still tells where.
            .env("RUST_LIB_BACKTRACE", "0")
            .stdin(Stdio::null())
            .stdout(log.try_clone()?)
            .stderr(log)
            .process_group(self.group)
            .kill_on_drop(true)
            .spawn()?;
        let pid = id_of(&child)?;
        Ok(Process { child, pid })
    }

    /// Ends the guard, and with it whatever is left of the group.
    pub async fn end(mut self) {
        drop(self.guard.stdin.take());
        if tokio::time::timeout(LEAVE_TIMEOUT, self.guard.wait())
            .await
            .is_err()
        {
            let _ = killpg(Pid::from_raw(self.group), Signal::SIGKILL);
            let _ = self.guard.wait().await;
        }
    }
}

fn id_of(child: &Child) -> std::io::Result<i32> {
    child
        .id()
        .and_then(|id| i32::try_from(id).ok())
        .ok_or_else(|| std::io::Error::other("a process ended as soon as it was started"))
}

/// One peer's process.
#[derive(Debug)]
pub struct Process {
    child: Child,
    pid: i32,
}

impl Process {
    /// Whether it still runs, or stands still.
    pub fn is_there(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Sends it a signal, unless it has ended.
    pub fn signal(&mut self, signal: Signal) {
        // Asking first reaps it, so that the number cannot belong to somebody else.
        if self.is_there() {
            let _ = kill(Pid::from_raw(self.pid), signal);
        }
    }

    /// Ends it at once and waits until it is gone.
    pub async fn kill(&mut self) {
        self.signal(Signal::SIGKILL);
        let _ = self.child.wait().await;
    }

    /// Its number.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.pid.unsigned_abs()
    }

    /// Waits until it leaves by itself; kills it if it does not.
    pub async fn wait_or_kill(&mut self) {
        if tokio::time::timeout(LEAVE_TIMEOUT, self.child.wait())
            .await
            .is_err()
        {
            self.kill().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_this_process_used_is_told_and_of_no_process_nothing() {
        let used = Used::of(std::process::id()).unwrap();
        assert!(
            used.cpu_s >= 0.0 && used.peak_mb > 1.0 && used.peak_mb < 1e5,
            "{used:?}"
        );
        assert_eq!(Used::of(u32::MAX), None);
    }
}
