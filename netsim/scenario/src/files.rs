//! Files that a scenario names: on disk beside it, or built in.

use skein_interop::json::{Error, Node};
use std::path::PathBuf;

/// The largest file that is read, bytes: a city of a hundred thousand buildings.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// Where the files named in a scenario are looked up.
pub enum Files<'a> {
    /// Relative to a directory.
    Directory(PathBuf),
    /// By a function of the name as it stands in the scenario; an error says why not.
    With(&'a dyn Fn(&str) -> Result<String, String>),
}

impl Files<'_> {
    pub(crate) fn read(&self, node: &Node<'_>) -> Result<String, Error> {
        let name = node.text()?;
        match self {
            Self::Directory(base) => {
                let path = base.join(name);
                read_text(&path).map_err(|e| {
                    node.wrong(format!(
                        "cannot read {}: {e}; names are relative to the scenario's directory",
                        path.display()
                    ))
                })
            }
            Self::With(f) => f(name).map_err(|e| node.wrong(format!("cannot read {name}: {e}"))),
        }
    }
}

/// Reads a text file of bounded size.
pub(crate) fn read_text(path: &std::path::Path) -> Result<String, String> {
    let meta = std::fs::metadata(path).map_err(|e| e.to_string())?;
    if !meta.is_file() {
        return Err("not a file".to_owned());
    }
    if meta.len() > MAX_FILE_BYTES {
        return Err(format!(
            "{} bytes are too many; at most {MAX_FILE_BYTES}",
            meta.len()
        ));
    }
    let bytes = std::fs::read(path).map_err(|e| e.to_string())?;
    let text = String::from_utf8(bytes)
        .map_err(|e| format!("not UTF-8 at byte {}", e.utf8_error().valid_up_to()))?;
    Ok(text.trim_start_matches('\u{feff}').to_owned())
}
