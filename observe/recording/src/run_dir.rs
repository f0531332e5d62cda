//! The directory of a run: `manifest.json`, `run.mcap`, `report.json`.

use crate::model::MODEL_VERSION;
use crate::model::scene::Driver;
use crate::reader::{self, ReadError, Recorded};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use skein_netsim::account::RunReport;
use std::io;
use std::path::{Path, PathBuf};

/// The file of the recording.
pub const RECORDING: &str = "run.mcap";
/// The file of the report.
pub const REPORT: &str = "report.json";
/// The file that says what the others are of.
pub const MANIFEST: &str = "manifest.json";

/// What a run directory is of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Manifest {
    /// [`MODEL_VERSION`] of the program that wrote it.
    pub model_version: u32,
    /// Version of that program.
    pub program_version: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Its text, as it was read; empty where it could not be read again.
    pub scenario_text: String,
    /// Seed of the run.
    pub seed: u64,
    /// What moved the run on.
    pub driver: Driver,
    /// The command that flies it again; live runs come to much the same, simulated ones to the
    /// same.
    pub command: String,
    /// Whether the run came to its end: else what follows says nothing.
    pub ended: bool,
    /// Whether it is as it must be.
    pub passed: bool,
    /// Hash of the history of a simulated run, hexadecimal.
    pub history_hash: Option<String>,
    /// When it ended, milliseconds of scenario time.
    pub end_ms: u64,
    /// Size of the recording, bytes.
    pub recording_bytes: u64,
    /// Size of the report, bytes.
    pub report_bytes: u64,
    /// Whether it may go when newer ones come: it was kept without being asked for.
    pub disposable: bool,
}

impl Manifest {
    /// Of a run that has not ended.
    #[must_use]
    pub fn new(scenario: &str, seed: u64, driver: Driver) -> Self {
        Self {
            model_version: MODEL_VERSION,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            scenario: scenario.to_owned(),
            seed,
            driver,
            ..Self::default()
        }
    }

    /// Writes it into its directory.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, dir: &Path) -> io::Result<()> {
        std::fs::write(dir.join(MANIFEST), serde_json::to_vec_pretty(self)?)
    }

    /// Of a directory, if it has one that can be read.
    #[must_use]
    pub fn read(dir: &Path) -> Option<Self> {
        let text = std::fs::read(dir.join(MANIFEST)).ok()?;
        serde_json::from_slice(&text).ok()
    }

    /// Puts in what the run came to, and writes manifest and report.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn conclude(mut self, dir: &Path, report: &RunReport) -> io::Result<()> {
        let json = serde_json::to_vec_pretty(report)?;
        std::fs::write(dir.join(REPORT), &json)?;
        self.ended = true;
        self.passed = report.passed;
        self.history_hash = report.simulated.as_ref().map(|s| s.history_hash.clone());
        self.end_ms = report.end_ms;
        self.report_bytes = json.len() as u64;
        self.recording_bytes = std::fs::metadata(dir.join(RECORDING)).map_or(0, |m| m.len());
        self.write(dir)
    }
}

/// A run that was kept.
#[derive(Clone, Debug)]
pub struct Kept {
    /// The recording.
    pub path: PathBuf,
    /// What it is of, where a directory was given.
    pub manifest: Option<Manifest>,
    /// What it holds.
    pub recorded: Recorded,
}

/// Opens a run by its directory or by its recording.
///
/// # Errors
/// When there is none, or it cannot be read.
pub fn open(path: &Path) -> Result<Kept, ReadError> {
    let (file, dir) = if path.is_dir() {
        (path.join(RECORDING), Some(path))
    } else {
        (path.to_owned(), path.parent())
    };
    if !file.exists() {
        let problem = if path.is_dir() {
            format!(
                "holds no {RECORDING}; expected the directory of `skein sim --run-dir` or of a trial"
            )
        } else {
            "no such file; expected the directory of a run, or its run.mcap".to_owned()
        };
        return Err(ReadError {
            path: path.to_owned(),
            problem,
        });
    }
    Ok(Kept {
        recorded: reader::read(&file)?,
        manifest: dir.and_then(Manifest::read),
        path: file,
    })
}

/// Removes the oldest run directories below `parent` that may go, but for so many.
pub fn prune(parent: &Path, keep: usize) {
    let dirs = std::fs::read_dir(parent).into_iter().flatten().flatten();
    let mut kept: Vec<_> = dirs
        .filter(|entry| Manifest::read(&entry.path()).is_some_and(|m| m.disposable && m.ended))
        .filter_map(|entry| {
            let written = entry
                .path()
                .join(MANIFEST)
                .metadata()
                .ok()?
                .modified()
                .ok()?;
            Some((written, entry.path()))
        })
        .collect();
    kept.sort();
    let n_over = kept.len().saturating_sub(keep);
    for (_, dir) in kept.into_iter().take(n_over) {
        let _ = std::fs::remove_dir_all(dir);
    }
}

/// Removes everything of a run directory but what tells of the run.
pub fn strip(dir: &Path) {
    let told = [RECORDING, REPORT, MANIFEST];
    for entry in std::fs::read_dir(dir).into_iter().flatten().flatten() {
        let path = entry.path();
        if told.iter().any(|name| path.ends_with(name)) {
            continue;
        }
        let is_dir = entry.file_type().is_ok_and(|t| t.is_dir());
        let _ = if is_dir {
            std::fs::remove_dir_all(&path)
        } else {
            std::fs::remove_file(&path)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated;
    use crate::sink::Collected;
    use crate::writer::Writer;
    use skein_netsim::Prepared;
    use skein_netsim::runs::Wanted;
    use skein_netsim::world::fixture::square_losing;

    fn recorded(dir: &Path) -> Collected {
        let prepared = Prepared::new(square_losing(2, 2, 20_000));
        let mut writer = Writer::create(&dir.join(RECORDING)).unwrap();
        let wanted = Wanted::default();
        let outcome = simulated::fly(&prepared, 3, None, wanted, &mut writer).unwrap();
        writer.finish().unwrap();
        let manifest = Manifest::new("square", 3, Driver::Sim);
        manifest.conclude(dir, &outcome.report).unwrap();
        let mut run = Collected::default();
        simulated::fly(&prepared, 3, None, wanted, &mut run).unwrap();
        run
    }

    #[test]
    fn a_recording_reads_back_as_the_run_that_it_is_of() {
        let dir = tempfile::tempdir().unwrap();
        let run = recorded(dir.path());
        let kept = open(dir.path()).unwrap();
        assert_eq!(kept.recorded.run, run);
        assert_eq!(kept.recorded.cut, None);
        let manifest = kept.manifest.unwrap();
        let hash = run.end.unwrap().report.simulated.unwrap().history_hash;
        assert_eq!(manifest.history_hash, Some(hash));
        assert!(manifest.ended && manifest.recording_bytes > 1000);
        // Its file alone will do.
        let alone = open(&dir.path().join(RECORDING)).unwrap();
        assert_eq!(alone.recorded.run.frames, kept.recorded.run.frames);
    }

    #[test]
    fn a_file_that_breaks_off_is_read_as_far_as_it_goes() {
        let dir = tempfile::tempdir().unwrap();
        let run = recorded(dir.path());
        let file = dir.path().join(RECORDING);
        let whole = std::fs::read(&file).unwrap();
        let mut most = 0;
        for tenths in 1..10 {
            std::fs::write(&file, &whole[..whole.len() * tenths / 10]).unwrap();
            let Ok(cut) = reader::read(&file) else {
                assert!(tenths < 3, "the scene is at the front");
                continue;
            };
            let n = cut.run.frames.len();
            assert!(n >= most);
            assert_eq!(cut.cut.is_some(), cut.run.end.is_none());
            assert_eq!(cut.run.frames, run.frames[..n]);
            most = n;
        }
        assert!(most > run.frames.len() / 2, "{most}");
    }

    #[test]
    fn what_is_no_recording_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let text = |path: &Path| open(path).unwrap_err().to_string();
        assert!(text(dir.path()).contains("holds no run.mcap"));
        let file = dir.path().join("x.mcap");
        assert!(text(&file).contains("no such file"));
        std::fs::write(&file, "hello").unwrap();
        assert!(text(&file).contains("is no MCAP file"));
        std::fs::write(&file, [mcap::MAGIC, &[7; 100]].concat()).unwrap();
        assert!(text(&file).contains("holds no scene"), "{}", text(&file));
    }

    #[test]
    fn only_what_nobody_asked_for_is_pruned_the_oldest_first() {
        let parent = tempfile::tempdir().unwrap();
        let make = |name: &str, disposable: bool| {
            let dir = parent.path().join(name);
            std::fs::create_dir(&dir).unwrap();
            std::fs::write(dir.join("peer1.log"), "x").unwrap();
            let manifest = Manifest {
                disposable,
                ended: true,
                ..Manifest::default()
            };
            manifest.write(&dir).unwrap();
        };
        for (name, disposable) in [("a", true), ("b", false), ("c", true), ("d", true)] {
            make(name, disposable);
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        prune(parent.path(), 2);
        let there = |name: &str| parent.path().join(name).exists();
        assert_eq!(["a", "b", "c", "d"].map(there), [false, true, true, true]);
        strip(&parent.path().join("d"));
        let left = std::fs::read_dir(parent.path().join("d")).unwrap();
        assert_eq!(left.count(), 1);
    }
}
