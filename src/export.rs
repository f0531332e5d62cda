//! `skein export`: a recorded run in the formats of other programs.

use crate::exit;
use anyhow::Context;
use clap::Args;
use skein_recording::sink::Collected;
use skein_recording::{export, run_dir};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Writes a recorded run in the format of another program: a table of UAVs over time, a line
/// for each word of the recording, or a map with tracks and cells.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The directory of a run (`skein sim --run-dir`, or that of a trial), or its run.mcap.
    #[arg(value_name = "RUN")]
    pub run: PathBuf,
    /// Which format.
    #[command(flatten)]
    pub format: FormatArgs,
    /// Where to; without it to stdout.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// One of four formats.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
#[allow(clippy::struct_excessive_bools, reason = "flags of a command line")]
pub struct FormatArgs {
    /// A row for each UAV and frame.
    #[arg(long)]
    pub csv: bool,
    /// A JSON object a line: scenes, events and frames in the order of their times, the end.
    #[arg(long)]
    pub jsonl: bool,
    /// Area, zones, cells, tracks and losses.
    #[arg(long)]
    pub geojson: bool,
    /// Area, zones and tracks, for Google Earth and others.
    #[arg(long)]
    pub kml: bool,
}

impl FormatArgs {
    fn write(&self, run: &Collected, out: &mut dyn Write) -> io::Result<()> {
        if self.csv {
            export::csv(run, out)
        } else if self.jsonl {
            export::jsonl(run, out)
        } else if self.geojson {
            writeln!(out, "{}", export::geojson(run))
        } else {
            out.write_all(export::kml(run).as_bytes())
        }
    }
}

/// Runs the verb.
///
/// # Errors
/// When the output cannot be written.
pub fn run(args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let kept = match run_dir::open(&args.run) {
        Ok(kept) => kept,
        Err(why) => {
            eprintln!("error: {why}");
            return Ok(ExitCode::from(exit::CONFIG_INVALID));
        }
    };
    if let Some(why) = &kept.recorded.cut {
        eprintln!("warning: the recording is not complete ({why}): what is there is written");
    }
    let run = &kept.recorded.run;
    match &args.output {
        Some(path) => {
            let cannot = || format!("cannot write {}", path.display());
            let mut out = BufWriter::new(File::create(path).with_context(cannot)?);
            let written = args.format.write(run, &mut out);
            written.and_then(|()| out.flush()).with_context(cannot)?;
        }
        None => {
            let mut text = Vec::new();
            args.format.write(run, &mut text)?;
            exit::print(String::from_utf8_lossy(&text))?;
        }
    }
    Ok(ExitCode::from(exit::OK))
}
