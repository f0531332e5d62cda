//! Exit codes of every verb, the same throughout, and how a verb prints.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write as _};
use std::process::ExitCode;

/// Done, and everything that was asked for holds.
pub const OK: u8 = 0;
/// The mission was flown and did not succeed.
pub const MISSION_FAILED: u8 = 1;
/// The command line is wrong.
pub const USAGE: u8 = 2;
/// A scenario or configuration is wrong; the place was named.
pub const CONFIG_INVALID: u8 = 3;
/// Nobody was there, or not in time.
pub const NO_PEERS: u8 = 4;
/// A defect of the program itself.
pub const INTERNAL: u8 = 5;

/// Writes a line, or a text that ends with its last line, on stdout. Whoever stopped reading
/// (`skein sim | head`) wants no more of it: that is no error.
///
/// # Errors
/// When stdout cannot be written for another reason.
pub fn print(text: impl Display) -> io::Result<()> {
    let text = text.to_string();
    let mut out = io::stdout().lock();
    let end = if text.ends_with('\n') { "" } else { "\n" };
    let written = write!(out, "{text}{end}").and_then(|()| out.flush());
    written.or_else(|error| match error.kind() {
        ErrorKind::BrokenPipe => Ok(()),
        _ => Err(error),
    })
}

/// Prints what a verb found out, or on stderr the place that is wrong.
///
/// # Errors
/// When stdout cannot be written.
pub fn answer(answer: anyhow::Result<String>) -> io::Result<ExitCode> {
    match answer {
        Ok(text) => {
            print(text)?;
            Ok(ExitCode::from(OK))
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            Ok(ExitCode::from(CONFIG_INVALID))
        }
    }
}
