//! What a shell and `man` want to know of the command.

use crate::cli::Cli;
use crate::exit;
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use std::path::PathBuf;
use std::process::ExitCode;

/// Completions for a shell, on stdout.
///
/// For example `skein completions bash > ~/.local/share/bash-completion/completions/skein`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Which shell.
    #[arg(value_enum)]
    pub shell: Shell,
}

/// Man pages: that of the command on stdout, or those of all verbs as files.
///
/// For example `skein man ~/.local/share/man/man1`, then `man skein-trial`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// A directory for one page a verb; it is made if it is not there.
    pub dir: Option<PathBuf>,
}

/// Prints the completions.
///
/// # Errors
/// When stdout cannot be written.
pub fn completions(args: &CompletionsArgs) -> anyhow::Result<ExitCode> {
    let mut out = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "skein", &mut out);
    exit::print(String::from_utf8_lossy(&out).trim_end())?;
    Ok(ExitCode::from(exit::OK))
}

/// Prints or writes the man pages.
///
/// # Errors
/// When stdout cannot be written.
pub fn man(args: &ManArgs) -> anyhow::Result<ExitCode> {
    let Some(dir) = &args.dir else {
        let mut page = Vec::new();
        clap_mangen::Man::new(Cli::command()).render(&mut page)?;
        exit::print(String::from_utf8_lossy(&page).trim_end())?;
        return Ok(ExitCode::from(exit::OK));
    };
    let written =
        std::fs::create_dir_all(dir).and_then(|()| clap_mangen::generate_to(Cli::command(), dir));
    if let Err(cause) = written {
        eprintln!(
            "error: man pages cannot be written to {}: {cause}",
            dir.display()
        );
        return Ok(ExitCode::from(exit::USAGE));
    }
    Ok(ExitCode::from(exit::OK))
}
