//! Trials as processes, and looking at what they leave.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The repository's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Waits for the machine to be free of other trials.
pub fn alone() -> MutexGuard<'static, ()> {
    static MACHINE: Mutex<()> = Mutex::new(());
    MACHINE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Looks again and again until `done`, or panics at the deadline.
pub fn wait_until(limit: Duration, what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + limit;
    while !done() {
        assert!(Instant::now() < deadline, "not in time: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Waits for its end: the exit code, none where a signal ended it.
pub fn ended(child: &mut Child, limit: Duration) -> Option<i32> {
    let mut status = None;
    wait_until(limit, "it ends", || {
        status = child.try_wait().unwrap();
        status.is_some()
    });
    status.and_then(|s| s.code())
}

/// Asks it to stop, as Ctrl-C does.
pub fn interrupt(child: &Child) {
    let pid = child.id().to_string();
    let kill = Command::new("kill").args(["-INT", &pid]).status();
    assert!(kill.unwrap().success());
}

/// What somebody says, as it comes.
pub fn lines_of(stderr: ChildStderr) -> Arc<Mutex<Vec<String>>> {
    let lines = Arc::new(Mutex::new(Vec::new()));
    let said = Arc::clone(&lines);
    std::thread::spawn(move || {
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            said.lock().unwrap().push(line);
        }
    });
    lines
}

/// A directory of its own, which also keeps trials of other tests out of sight.
pub struct Place {
    dir: tempfile::TempDir,
}

impl Place {
    pub fn new() -> Self {
        Self {
            dir: tempfile::tempdir().unwrap(),
        }
    }

    /// The command with these words, out of sight of other trials.
    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_skein"));
        command
            .args(args)
            .env("TMPDIR", self.dir.path())
            .stdin(Stdio::null());
        command
    }

    /// Runs a verb to its end: exit code, stdout and stderr together.
    pub fn skein(&self, args: &[&str]) -> (i32, String) {
        let out = self.command(args).output().unwrap();
        let text = String::from_utf8_lossy(&out.stdout).into_owned()
            + &String::from_utf8_lossy(&out.stderr);
        (out.status.code().unwrap_or(-1), text)
    }

    /// Runs a verb whose reader has gone before it prints: exit code and stderr.
    pub fn unread(&self, args: &[&str]) -> (i32, String) {
        let mut command = self.command(args);
        let piped = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = piped.spawn().unwrap();
        drop(child.stdout.take());
        let out = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        (out.status.code().unwrap_or(-1), said)
    }

    pub fn path(&self, name: &str) -> String {
        self.dir.path().join(name).to_str().unwrap().to_owned()
    }

    pub fn file(&self, name: &str, text: &str) -> String {
        let path = self.dir.path().join(name);
        fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    }

    /// All processes whose environment names this place, the zombies left out.
    pub fn processes(&self) -> Vec<u32> {
        let mark = format!("TMPDIR={}", self.dir.path().display());
        let mut pids = Vec::new();
        for entry in fs::read_dir("/proc").unwrap().flatten() {
            let Ok(pid) = entry.file_name().to_string_lossy().parse::<u32>() else {
                continue;
            };
            let environment = fs::read(entry.path().join("environ")).unwrap_or_default();
            if environment.split(|b| *b == 0).any(|v| v == mark.as_bytes()) {
                pids.push(pid);
            }
        }
        pids
    }

    /// What other commands are told of the only trial.
    pub fn entry(&self) -> Value {
        let files = |dir: &Path| fs::read_dir(dir).unwrap().flatten().map(|e| e.path());
        let shared = files(self.dir.path()).find(|p| p.is_dir()).unwrap();
        let entry = files(&shared).find(|p| p.extension().is_some_and(|x| x == "json"));
        serde_json::from_slice(&fs::read(entry.unwrap()).unwrap()).unwrap()
    }

    /// Observes again and again, each time for some seconds, until what was heard last
    /// of each author is as wanted.
    pub fn observe_until(
        &self,
        args: &[&str],
        limit: Duration,
        mut wanted: impl FnMut(&BTreeMap<u64, Value>) -> bool,
    ) {
        let deadline = Instant::now() + limit;
        let mut newest = BTreeMap::new();
        loop {
            let observe = ["observe", "--timeout", "3", "--format", "jsonl"];
            let (_, said) = self.skein(&[&observe, args].concat());
            for line in said.lines() {
                if let Ok(record) = serde_json::from_str::<Value>(line)
                    && let Some(author) = record["author"].as_u64()
                {
                    newest.insert(author, record["body"].clone());
                }
            }
            if wanted(&newest) {
                return;
            }
            assert!(Instant::now() < deadline, "not in time: {newest:#?}");
        }
    }

    /// Observes all that is heard at a peer, as soon as it is there.
    pub fn watch(&self, endpoint: &str) -> Watching {
        wait_until(Duration::from_secs(30), "the peer is there", || {
            let (code, _) = self.skein(&["observe", "--endpoint", endpoint, "--timeout", "2"]);
            code == 0
        });
        let args = ["observe", "--endpoint", endpoint, "--format", "jsonl"];
        let mut child = self.command(&args).stdout(Stdio::piped()).spawn().unwrap();
        let records = Arc::new(Mutex::new(Vec::new()));
        let (stdout, seen) = (child.stdout.take().unwrap(), Arc::clone(&records));
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                let record = serde_json::from_str(&line).unwrap_or(Value::Null);
                seen.lock().unwrap().push(record);
            }
        });
        Watching { child, records }
    }

    /// Starts a peer of its own, without a trial.
    pub fn peer(&self, name: &str, config: &Value) -> Peer {
        let file = self.file(name, &config.to_string());
        let mut command = self.command(&["peer", "--config", &file]);
        Peer(command.spawn().unwrap())
    }
}

/// A running `skein peer`.
pub struct Peer(Child);

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A running `skein observe`.
pub struct Watching {
    child: Child,
    records: Arc<Mutex<Vec<Value>>>,
}

impl Watching {
    /// Waits for a record.
    pub fn until(&self, what: &str, limit: Duration, wanted: impl Fn(&Value) -> bool) {
        wait_until(limit, what, || {
            self.records.lock().unwrap().iter().any(&wanted)
        });
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A port that was free a moment ago.
pub fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port()
}

/// A running `skein trial`.
pub struct Trial {
    child: Child,
    id: String,
    lines: Arc<Mutex<Vec<String>>>,
    stdout: Option<std::process::ChildStdout>,
    pids: Vec<u32>,
}

impl Trial {
    /// Starts the small scenario under `name`, and waits until it has begun.
    pub fn start(place: &Place, name: &str, more: &[&str]) -> Self {
        let text = fs::read_to_string(root().join("tests/live/square.json5")).unwrap();
        let file = place.file(
            &format!("{name}.json5"),
            &text.replace("name: \"square\"", &format!("name: \"{name}\"")),
        );
        let args = [&["trial", &file, "--format", "json"], more].concat();
        let mut child = place
            .command(&args)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = lines_of(child.stderr.take().unwrap());
        let stdout = child.stdout.take();
        let mut trial = Self {
            child,
            id: String::new(),
            lines,
            stdout,
            pids: Vec::new(),
        };
        let begun = |l: &String| {
            l.strip_prefix("trial ")
                .map(|r| r.split(' ').next().unwrap().to_owned())
        };
        wait_until(Duration::from_secs(30), "the trial begins", || {
            let found = trial.lines.lock().unwrap().iter().find_map(begun);
            trial.id = found.unwrap_or_default();
            !trial.id.is_empty()
        });
        trial
    }

    pub fn id(&self) -> &str {
        &self.id
    }

    /// Waits until the flight has begun and, by the wall clock at the scenario's
    /// scale of at most 10, has gone on for `time_s`.
    pub fn wait_for_time(&mut self, time_s: f64, limit: Duration) {
        let told = |l: &String| {
            l.split_once(" s  ")
                .and_then(|(t, _)| t.trim().parse::<f64>().ok())
        };
        let deadline = Instant::now() + limit;
        let mut began = None;
        loop {
            let newest = self
                .lines
                .lock()
                .unwrap()
                .iter()
                .filter_map(told)
                .fold(None, |m, t| Some(t.max(m.unwrap_or(t))));
            if newest.is_some() && began.is_none() {
                began = Some(Instant::now());
            }
            let at_least = began.map_or(0.0, |b: Instant| b.elapsed().as_secs_f64() * 2.5);
            if newest.is_some_and(|t| t.max(at_least) >= time_s) {
                break;
            }
            assert!(
                self.child.try_wait().unwrap().is_none(),
                "the trial has ended: {:#?}",
                self.lines.lock().unwrap()
            );
            assert!(
                Instant::now() < deadline,
                "not in time: {:#?}",
                self.lines.lock().unwrap()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
        self.pids = children_of_group(self.child.id());
    }

    /// Every socket of the trial and its peers is bound to 127.0.0.1.
    pub fn assert_loopback_only(&self) {
        assert!(self.pids.len() >= 6, "{:?}", self.pids);
        for pid in &self.pids {
            for socket in sockets(*pid) {
                assert!(
                    socket.starts_with("0100007F:"),
                    "process {pid} has a socket at {socket}"
                );
            }
        }
    }

    /// Waits for the end; the exit code.
    pub fn wait(&mut self, limit: Duration) -> Option<i32> {
        ended(&mut self.child, limit)
    }

    /// Waits for the end, and reads the verdict.
    pub fn verdict(&mut self, limit: Duration) -> Value {
        let mut stdout = self.stdout.take().unwrap();
        let reader = std::thread::spawn(move || {
            let mut text = String::new();
            stdout.read_to_string(&mut text).map(|_| text)
        });
        self.wait(limit);
        let text = reader.join().unwrap().unwrap();
        serde_json::from_str(&text)
            .unwrap_or_else(|e| panic!("{e}: {text} {:#?}", self.lines.lock().unwrap()))
    }

    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    pub fn interrupt(&self) {
        interrupt(&self.child);
    }
}

impl Drop for Trial {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A process and all its children.
fn children_of_group(parent: u32) -> Vec<u32> {
    let mut pids = vec![parent];
    for entry in fs::read_dir("/proc").unwrap().flatten() {
        let Ok(pid) = entry.file_name().to_string_lossy().parse::<u32>() else {
            continue;
        };
        let stat = fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
        let after_name = stat.rsplit_once(") ").map_or("", |(_, rest)| rest);
        if after_name.split(' ').nth(1) == Some(&parent.to_string()) {
            pids.push(pid);
        }
    }
    pids
}

/// Local addresses of the internet sockets of a process, as the kernel writes them.
fn sockets(pid: u32) -> Vec<String> {
    let mut inodes = Vec::new();
    for fd in fs::read_dir(format!("/proc/{pid}/fd"))
        .into_iter()
        .flatten()
        .flatten()
    {
        let link = fs::read_link(fd.path()).unwrap_or_default();
        let link = link.to_string_lossy();
        if let Some(inode) = link
            .strip_prefix("socket:[")
            .and_then(|l| l.strip_suffix(']'))
        {
            inodes.push(inode.to_owned());
        }
    }
    let mut found = Vec::new();
    for table in ["tcp", "tcp6", "udp", "udp6"] {
        let text = fs::read_to_string(format!("/proc/{pid}/net/{table}")).unwrap_or_default();
        for line in text.lines().skip(1) {
            let fields: Vec<&str> = line.split_whitespace().collect();
            if fields
                .get(9)
                .is_some_and(|inode| inodes.iter().any(|i| i == inode))
            {
                found.push(fields[1].to_owned());
            }
        }
    }
    found
}
