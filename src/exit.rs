//! Exit codes of every verb, the same throughout.

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

/// Prints what a verb found out, or on stderr the place that is wrong.
pub fn print(answer: anyhow::Result<String>) -> std::process::ExitCode {
    match answer {
        Ok(text) => {
            println!("{text}");
            std::process::ExitCode::from(OK)
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            std::process::ExitCode::from(CONFIG_INVALID)
        }
    }
}
