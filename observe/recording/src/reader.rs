//! Reads recordings, complete ones and those that were cut off.

use crate::channels;
use crate::model::MODEL_VERSION;
use crate::sink::Collected;
use mcap::MessageStream;
use mcap::read::Options;
use serde::de::DeserializeOwned;
use std::fmt;
use std::path::{Path, PathBuf};

/// The largest file that is read: a hundred UAVs for an hour make a tenth of it.
pub const MAX_BYTES: u64 = 2 << 30;

/// Why a recording cannot be read.
#[derive(Debug)]
pub struct ReadError {
    /// Which file.
    pub path: PathBuf,
    /// Why, and what would be right.
    pub problem: String,
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.problem)
    }
}

impl std::error::Error for ReadError {}

/// A run as its recording has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recorded {
    /// Its words.
    pub run: Collected,
    /// Why the file ends before the run did, if it does: what was on the disk was read.
    pub cut: Option<String>,
}

/// Reads a file. One that breaks off is read as far as it goes.
///
/// # Errors
/// When it is no recording of a run, or of a newer program.
pub fn read(path: &Path) -> Result<Recorded, ReadError> {
    let wrong = |problem: String| ReadError {
        path: path.to_owned(),
        problem,
    };
    let size = std::fs::metadata(path).map_err(|e| wrong(e.to_string()))?;
    if size.len() > MAX_BYTES {
        let most = MAX_BYTES >> 20;
        return Err(wrong(format!("is larger than {most} MiB")));
    }
    let bytes = std::fs::read(path).map_err(|e| wrong(e.to_string()))?;
    if !bytes.starts_with(mcap::MAGIC) {
        let text = "is no MCAP file; expected the run.mcap of `skein sim --run-dir` or a trial";
        return Err(wrong(text.to_owned()));
    }
    let recorded = of_bytes(&bytes).map_err(wrong)?;
    if recorded.run.scenes.is_empty() {
        let why = recorded.cut.map_or(String::new(), |why| format!(": {why}"));
        return Err(wrong(format!("holds no scene of a run{why}")));
    }
    Ok(recorded)
}

fn of_bytes(bytes: &[u8]) -> Result<Recorded, String> {
    let mut out = Recorded::default();
    let stream = MessageStream::new_with_options(bytes, Options::IgnoreEndMagic.into());
    for message in stream.map_err(|e| e.to_string())? {
        let message = match message {
            Ok(message) => message,
            Err(why) => {
                out.cut = Some(why.to_string());
                break;
            }
        };
        let (topic, data) = (&*message.channel.topic, &*message.data);
        let at_s = message.log_time / 1_000_000_000;
        let place = |why: String| format!("{topic} at {at_s} s: {why}");
        let run = &mut out.run;
        if topic == channels::SCENE.topic {
            // Its version says how to read the rest.
            let version: Version = parsed(data).map_err(place)?;
            if version.model_version > MODEL_VERSION {
                return Err(format!(
                    "is of a newer program: its model is {}, this program reads up to {MODEL_VERSION}",
                    version.model_version
                ));
            }
            run.scenes.push(parsed(data).map_err(place)?);
        } else if topic == channels::FRAME.topic {
            run.frames.push(parsed(data).map_err(place)?);
        } else if topic == channels::EVENT.topic {
            run.events.push(parsed(data).map_err(place)?);
        } else if topic == channels::FAILURE_FREE.topic {
            run.failure_free = Some(parsed(data).map_err(place)?);
        } else if topic == channels::END.topic {
            run.end = Some(parsed(data).map_err(place)?);
        }
    }
    if out.run.end.is_some() {
        // What follows it is an index, which nobody here needs.
        out.cut = None;
    } else if out.cut.is_none() {
        out.cut = Some("the run was stopped before its end".to_owned());
    }
    Ok(out)
}

#[derive(serde::Deserialize)]
struct Version {
    model_version: u32,
}

fn parsed<T: DeserializeOwned>(data: &[u8]) -> Result<T, String> {
    serde_json::from_slice(data).map_err(|e| e.to_string())
}
