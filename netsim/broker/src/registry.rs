//! Run directories, and how other commands find a running trial.
//!
//! Each trial has an entry in a directory that all trials of one user share. An entry
//! whose control port does not answer belongs to a trial that is gone.

use serde::{Deserialize, Serialize};
use skein_console::replace_private_file;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long a control port may take to accept; it is on the same machine.
const PROBE_TIMEOUT: Duration = Duration::from_millis(500);

/// What other commands need to know of a trial.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Its name, for `--trial`.
    pub id: String,
    /// Its process.
    pub pid: u32,
    /// Its control port.
    pub control: SocketAddr,
    /// Opens the control port.
    pub token: String,
    /// Its run directory.
    pub run_dir: PathBuf,
    /// The peer that observers attach to, as `tcp/127.0.0.1:PORT`, once it is up.
    pub observe: Option<String>,
    /// The console of the ground station, once it is up.
    pub console: Option<ConsoleEntry>,
    /// The consoles of all peers that are up, by their numbers.
    #[serde(default)]
    pub consoles: BTreeMap<u16, ConsoleEntry>,
    /// First part of every key.
    pub fleet: String,
}

/// How the console of a peer is reached.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConsoleEntry {
    /// Where it listens.
    pub at: SocketAddr,
    /// The file with its token, which only this user can read.
    pub token_file: PathBuf,
}

/// Why no trial was found, or none can be entered.
#[derive(Debug, thiserror::Error)]
pub enum RegistryError {
    /// The directory cannot be used.
    #[error("{path}: {cause}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// None runs.
    #[error("no trial is running; start one with `skein trial`")]
    None,
    /// Not the one that was asked for.
    #[error("no trial {0} is running; running: {1}")]
    NoSuch(String, String),
    /// Several run.
    #[error("several trials are running, choose one with --trial: {0}")]
    Several(String),
}

/// The directory that all trials of this user share.
///
/// # Errors
/// When it cannot be made.
pub fn shared_dir() -> Result<PathBuf, RegistryError> {
    let path = std::env::temp_dir().join(format!("skein-{}", nix::unistd::getuid()));
    private_dir(&path)?;
    Ok(path)
}

/// Makes a directory that only this user can read.
///
/// # Errors
/// When it cannot be made.
pub fn private_dir(path: &Path) -> Result<(), RegistryError> {
    let made = std::fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(path);
    made.map_err(|cause| RegistryError::Io {
        path: path.to_owned(),
        cause,
    })
}

/// Writes a file that only this user can read.
///
/// # Errors
/// When it cannot be written.
pub fn private_file(path: &Path, bytes: &[u8]) -> Result<(), RegistryError> {
    let io = |cause| RegistryError::Io {
        path: path.to_owned(),
        cause,
    };
    let mut file = std::fs::OpenOptions::new()
        .write(true)
        .create(true)
        .truncate(true)
        .mode(0o600)
        .open(path)
        .map_err(io)?;
    std::io::Write::write_all(&mut file, bytes).map_err(io)
}

/// A trial's entry; taken out again when dropped.
#[derive(Debug)]
pub struct Registered {
    entry: Entry,
    path: PathBuf,
}

impl Registered {
    /// Enters a trial.
    ///
    /// # Errors
    /// When the entry cannot be written.
    pub fn enter(entry: Entry) -> Result<Self, RegistryError> {
        let path = shared_dir()?.join(format!("{}.json", entry.id));
        let registered = Self { entry, path };
        registered.write()?;
        Ok(registered)
    }

    /// Says where observers may attach.
    ///
    /// # Errors
    /// When the entry cannot be written.
    pub fn observe_at(&mut self, endpoint: String) -> Result<(), RegistryError> {
        self.entry.observe = Some(endpoint);
        self.write()
    }

    /// The ground station's console, once it is up.
    #[must_use]
    pub fn console(&self) -> Option<&ConsoleEntry> {
        self.entry.console.as_ref()
    }

    /// Says where the console of a peer is, and whether that is the ground station.
    ///
    /// # Errors
    /// When the entry cannot be written.
    pub fn console_at(
        &mut self,
        id: u16,
        is_ground_station: bool,
        console: ConsoleEntry,
    ) -> Result<(), RegistryError> {
        if is_ground_station {
            self.entry.console = Some(console.clone());
        }
        self.entry.consoles.insert(id, console);
        self.write()
    }

    fn write(&self) -> Result<(), RegistryError> {
        let io = |cause| RegistryError::Io {
            path: self.path.clone(),
            cause,
        };
        let json = serde_json::to_vec_pretty(&self.entry).map_err(|e| io(e.into()))?;
        replace_private_file(&self.path, &json).map_err(io)
    }
}

impl Drop for Registered {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// The trial of that name, or the only one that runs.
///
/// # Errors
/// When there is none, or more than one to choose from.
pub fn find(name: Option<&str>) -> Result<Entry, RegistryError> {
    choose(running()?, name)
}

fn choose(mut entries: Vec<Entry>, name: Option<&str>) -> Result<Entry, RegistryError> {
    let all = entries
        .iter()
        .map(|e| e.id.clone())
        .collect::<Vec<_>>()
        .join(", ");
    if let Some(name) = name {
        let found = entries.into_iter().find(|e| e.id == name);
        return match found {
            Some(entry) => Ok(entry),
            None if all.is_empty() => Err(RegistryError::None),
            None => Err(RegistryError::NoSuch(name.to_owned(), all)),
        };
    }
    match (entries.pop(), entries.is_empty()) {
        (Some(entry), true) => Ok(entry),
        (Some(_), false) => Err(RegistryError::Several(all)),
        (None, _) => Err(RegistryError::None),
    }
}

/// All trials that run, by name; entries of those that are gone are removed.
fn running() -> Result<Vec<Entry>, RegistryError> {
    let dir = shared_dir()?;
    let io = |cause| RegistryError::Io {
        path: dir.clone(),
        cause,
    };
    let mut entries = Vec::new();
    for file in std::fs::read_dir(&dir).map_err(io)? {
        let path = file.map_err(io)?.path();
        if path.extension().is_none_or(|e| e != "json") {
            continue;
        }
        let Ok(bytes) = std::fs::read(&path) else {
            continue;
        };
        let Ok(entry) = serde_json::from_slice::<Entry>(&bytes) else {
            continue;
        };
        if std::net::TcpStream::connect_timeout(&entry.control, PROBE_TIMEOUT).is_ok() {
            entries.push(entry);
        } else {
            let _ = std::fs::remove_file(&path);
        }
    }
    entries.sort_by(|a, b| a.id.cmp(&b.id));
    Ok(entries)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(id: &str) -> Entry {
        Entry {
            id: id.to_owned(),
            pid: 1,
            control: ([127, 0, 0, 1], 1).into(),
            token: String::new(),
            run_dir: PathBuf::new(),
            observe: None,
            console: None,
            consoles: BTreeMap::new(),
            fleet: "f".to_owned(),
        }
    }

    #[test]
    fn the_only_trial_needs_no_name_and_two_do() {
        assert_eq!(choose(vec![entry("a")], None).unwrap().id, "a");
        assert!(matches!(choose(vec![], None), Err(RegistryError::None)));
        assert!(matches!(
            choose(vec![], Some("a")),
            Err(RegistryError::None)
        ));
        let two = || vec![entry("a"), entry("b")];
        assert_eq!(
            choose(two(), None)
                .unwrap_err()
                .to_string()
                .matches("a, b")
                .count(),
            1
        );
        assert_eq!(choose(two(), Some("b")).unwrap().id, "b");
        assert!(matches!(
            choose(two(), Some("c")),
            Err(RegistryError::NoSuch(..))
        ));
    }
}
