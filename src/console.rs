//! The consoles of running peers, and `skein order`: what an operator says at that of a ground
//! station, in a trial or in the field.

use crate::{cli, exit};
use clap::Args;
use serde::de::DeserializeOwned;
use skein_behaviors::Order;
use skein_broker::registry;
use skein_console::{AskError, Command, Token, ask};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

/// Tells all UAVs to hold, to go on or to come home: `skein mission hold`, `resume`, `rtb`.
///
/// The ground station speaks the order by radio and every peer passes it on; it holds
/// until the next one, also for peers that restart. Without flags it goes to the ground
/// station of the only running trial.
#[derive(Debug, Args)]
pub struct OrderArgs {
    /// `hold`: loiter where you are. `resume`: carry on with the mission.
    /// `return-to-base`: come home and loiter there.
    #[arg(value_parser = order_named)]
    pub order: Order,
    /// Which ground station.
    #[command(flatten)]
    pub at: AtArgs,
}

/// The console of a ground station.
#[derive(Clone, Debug, Args)]
pub struct AtArgs {
    /// Where it listens, as its configuration says (`console.listen`).
    #[arg(
        long,
        global = true,
        value_name = "127.0.0.1:PORT",
        requires = "token_file"
    )]
    pub at: Option<SocketAddr>,
    /// The file that it wrote its token to (`console.token_file`).
    #[arg(long, global = true, value_name = "FILE", requires = "at")]
    pub token_file: Option<PathBuf>,
    /// The trial that is meant, as it named itself when it began.
    #[arg(long, global = true, value_name = "ID", conflicts_with = "at")]
    pub trial: Option<String>,
}

/// Why a console did nothing, and the exit code that says so.
#[derive(Debug)]
pub struct Refusal {
    why: String,
    code: u8,
}

impl Refusal {
    /// Something in what was asked is wrong.
    pub fn of_input(why: impl ToString) -> Self {
        Self {
            why: why.to_string(),
            code: exit::CONFIG_INVALID,
        }
    }

    fn nobody(why: impl ToString) -> Self {
        Self {
            why: why.to_string(),
            code: exit::NO_PEERS,
        }
    }

    /// Says so on stderr.
    pub fn told(&self) -> ExitCode {
        eprintln!("error: {}", self.why);
        ExitCode::from(self.code)
    }
}

fn order_named(text: &str) -> Result<Order, String> {
    let found = Order::ALL.into_iter().find(|o| o.name() == text);
    found.ok_or_else(|| format!("expected {}", Order::ALL.map(Order::name).join(", ")))
}

/// Runs `skein order`.
///
/// # Errors
/// When there is no runtime.
pub fn order(args: &OrderArgs) -> anyhow::Result<ExitCode> {
    say(&args.at, &Command::Order(args.order))
}

/// Says something at the console of the ground station, and prints what it answers.
///
/// # Errors
/// When there is no runtime or stdout cannot be written.
pub fn say(at: &AtArgs, command: &Command) -> anyhow::Result<ExitCode> {
    Ok(match asked(at, None, command)? {
        Ok(lines) => {
            lines.iter().try_for_each(exit::print)?;
            ExitCode::from(exit::OK)
        }
        Err(refusal) => refusal.told(),
    })
}

/// Asks for something that is answered by one line of JSON; gives the line, too.
///
/// # Errors
/// When there is no runtime.
pub fn look<T: DeserializeOwned>(
    at: &AtArgs,
    peer: Option<u16>,
    command: &Command,
) -> anyhow::Result<Result<(T, String), Refusal>> {
    let lines = match asked(at, peer, command)? {
        Ok(lines) => lines,
        Err(refusal) => return Ok(Err(refusal)),
    };
    let line = lines.concat();
    let read = serde_json::from_str(&line);
    let strange = |cause| Refusal::nobody(format!("the answer cannot be read: {cause}"));
    Ok(read.map(|t| (t, line)).map_err(strange))
}

fn asked(
    at: &AtArgs,
    peer: Option<u16>,
    command: &Command,
) -> anyhow::Result<Result<Vec<String>, Refusal>> {
    let (address, token) = match found(at, peer) {
        Ok(found) => found,
        Err(why) => return Ok(Err(Refusal::nobody(why))),
    };
    let answer = cli::runtime()?.block_on(ask(address, &token, command));
    Ok(answer.map_err(|error| match error {
        AskError::NoAnswer { .. } => Refusal::nobody(error),
        AskError::Refused(_) => Refusal::of_input(error),
    }))
}

/// The console that is meant: of that peer of a trial, or of its ground station.
fn found(at: &AtArgs, peer: Option<u16>) -> Result<(SocketAddr, Token), String> {
    let (address, file) = match (&at.at, &at.token_file) {
        (Some(address), Some(file)) => (*address, file.clone()),
        _ => {
            let trial = registry::find(at.trial.as_deref()).map_err(|e| e.to_string())?;
            let id = &trial.id;
            let console = match peer {
                Some(peer) => trial.consoles.get(&peer).cloned().ok_or_else(|| {
                    format!("trial {id} has no peer {peer}, or has not launched it yet")
                })?,
                None => trial.console.ok_or_else(|| {
                    format!("trial {id} has no ground station, or has not launched it yet")
                })?,
            };
            (console.at, console.token_file)
        }
    };
    let token = Token::read(&file).map_err(|e| e.to_string())?;
    Ok((address, token))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_read_as_people_write_them() {
        assert_eq!(order_named("return-to-base"), Ok(Order::ReturnToBase));
        assert!(order_named("land").is_err_and(|e| e.contains("resume, hold, return-to-base")));
    }
}
