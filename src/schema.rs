//! `skein schema`: what the records of the swarm look like, for a reader in any language.

use crate::exit;
use clap::Args;
use skein_interop::json::suggestion;
use skein_peer::wire::kinds::Kind;
use skein_peer::wire::schema::{self, ENVELOPE_NAME};
use std::fmt::Write as _;
use std::process::ExitCode;

/// The JSON Schema of the records of a kind.
///
/// A record is a CBOR array, whose place `body` holds the bytes of another one: `skein schema
/// record` describes the outer one, `skein schema claim` the body of a claim. The ground station
/// of a trial answers the same to Zenoh queries for FLEET/v4/schema/KIND.
#[derive(Debug, Args)]
pub struct SchemaArgs {
    /// A kind, or `record` for what is around every body; without it all are listed.
    pub kind: Option<String>,
}

/// Runs the verb.
///
/// # Errors
/// When stdout cannot be written.
pub fn run(args: &SchemaArgs) -> anyhow::Result<ExitCode> {
    let Some(name) = args.kind.as_deref() else {
        exit::print(list())?;
        return Ok(ExitCode::from(exit::OK));
    };
    let Some((_, found)) = schema::all().find(|(known, _)| *known == name) else {
        let names: Vec<&str> = schema::all().map(|(name, _)| name).collect();
        eprintln!(
            "error: no kind is called {name:?}; {}",
            suggestion(name, &names)
        );
        return Ok(ExitCode::from(exit::USAGE));
    };
    exit::print(found)?;
    Ok(ExitCode::from(exit::OK))
}

/// All kinds, one a line.
fn list() -> String {
    let mut out = format!("{ENVELOPE_NAME:<10} what is around every body");
    for kind in Kind::ALL.into_iter().filter(|kind| kind.row().spoken) {
        let (name, row) = (kind.name(), kind.row());
        let passed_on = if row.relayed { ", passed on" } else { "" };
        // Writing to a string cannot fail.
        let _ = write!(
            out,
            "\n{name:<10} at most {} bytes{passed_on}",
            row.cap_bytes
        );
    }
    out
}
