//! `skein order` and `skein mission`: what an operator says at the console of a ground
//! station, in a trial or in the field.

use crate::scenario_args::PlannerArgs;
use crate::{cli, exit};
use clap::Args;
use skein_behaviors::Order;
use skein_broker::registry;
use skein_console::{AskError, Command, Token, ask};
use skein_peer::mission::mm;
use skein_scenario::{Overrides, Severity};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

/// Tells all UAVs to hold, to go on or to come home.
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

/// Gives all UAVs a new mission.
///
/// Takes the mission of a scenario, or moves the base of the one that is flown. What
/// cannot be flown is refused: by the place in the file, or by the ground station, which
/// also refuses what does not fit the UAVs in the air. The ground station speaks it as
/// the next revision; what was covered of the same area stays covered. Zones, area and
/// lanes come from the file, its fleet and radio play no part.
#[derive(Debug, Args)]
pub struct MissionArgs {
    /// A scenario file or the name of a built-in scenario.
    #[arg(required_unless_present = "base")]
    pub scenario: Option<String>,
    /// Moves the base of the mission that is flown: metres east and north of its origin.
    #[arg(long, value_name = "EAST,NORTH", value_parser = base, conflicts_with = "scenario", allow_hyphen_values = true)]
    pub base: Option<(i32, i32)>,
    /// Who plans an area.
    #[command(flatten)]
    pub planner: PlannerArgs,
    /// Which ground station.
    #[command(flatten)]
    pub at: AtArgs,
}

/// The console of a ground station.
#[derive(Debug, Args)]
pub struct AtArgs {
    /// Where the ground station listens, as its configuration says (`console.listen`).
    #[arg(long, value_name = "127.0.0.1:PORT", requires = "token_file")]
    pub at: Option<SocketAddr>,
    /// The file that it wrote its token to (`console.token_file`).
    #[arg(long, value_name = "FILE", requires = "at")]
    pub token_file: Option<PathBuf>,
    /// The trial whose ground station is meant, as it named itself when it began.
    #[arg(long, value_name = "ID", conflicts_with = "at")]
    pub trial: Option<String>,
}

fn order_named(text: &str) -> Result<Order, String> {
    let found = Order::ALL.into_iter().find(|o| o.name() == text);
    found.ok_or_else(|| format!("expected {}", Order::ALL.map(Order::name).join(", ")))
}

fn base(text: &str) -> Result<(i32, i32), String> {
    /// Missions end at 20 km.
    const FARTHEST_M: f64 = 20_000.0;
    let metres = |part: &str| {
        part.trim()
            .parse()
            .ok()
            .filter(|m: &f64| m.abs() <= FARTHEST_M)
    };
    text.split_once(',')
        .and_then(|(east, north)| Some((mm(metres(east)?), mm(metres(north)?))))
        .ok_or_else(|| "write metres east and north of the origin, for example 120,-40".to_owned())
}

/// Runs `skein order`.
///
/// # Errors
/// When there is no runtime.
pub fn order(args: &OrderArgs) -> anyhow::Result<ExitCode> {
    say(&args.at, &Command::Order(args.order))
}

/// Runs `skein mission`.
///
/// # Errors
/// When there is no runtime.
pub fn mission(args: &MissionArgs) -> anyhow::Result<ExitCode> {
    if let Some(base) = args.base {
        return say(&args.at, &Command::Base(base));
    }
    let over = Overrides {
        planner: args.planner.chosen(),
        ..Overrides::default()
    };
    let scenario = match skein_scenario::open(args.scenario.as_deref(), &over) {
        Ok(scenario) => scenario,
        Err(error) => {
            eprintln!("error: {error}");
            return Ok(ExitCode::from(exit::CONFIG_INVALID));
        }
    };
    let warnings = scenario.findings.iter();
    for finding in warnings.filter(|f| f.severity == Severity::Warning) {
        eprintln!("{finding}");
    }
    say(&args.at, &Command::Mission(scenario.spec.mission))
}

/// Says something at the console, and prints what the ground station answers.
fn say(at: &AtArgs, command: &Command) -> anyhow::Result<ExitCode> {
    let (address, token) = match found(at) {
        Ok(found) => found,
        Err(why) => {
            eprintln!("error: {why}");
            return Ok(ExitCode::from(exit::NO_PEERS));
        }
    };
    Ok(
        match cli::runtime()?.block_on(ask(address, &token, command)) {
            Ok(lines) => {
                lines.iter().try_for_each(exit::print)?;
                ExitCode::from(exit::OK)
            }
            Err(error) => {
                eprintln!("error: {error}");
                ExitCode::from(match error {
                    AskError::NoAnswer { .. } => exit::NO_PEERS,
                    AskError::Refused(_) => exit::CONFIG_INVALID,
                })
            }
        },
    )
}

fn found(at: &AtArgs) -> Result<(SocketAddr, Token), String> {
    let (address, file) = match (&at.at, &at.token_file) {
        (Some(address), Some(file)) => (*address, file.clone()),
        _ => {
            let trial = registry::find(at.trial.as_deref()).map_err(|e| e.to_string())?;
            let console = trial.console.ok_or_else(|| {
                let id = trial.id;
                format!("trial {id} has no ground station, or has not launched it yet")
            })?;
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
    fn orders_and_places_are_read_as_people_write_them() {
        assert_eq!(order_named("return-to-base"), Ok(Order::ReturnToBase));
        assert!(order_named("land").is_err_and(|e| e.contains("resume, hold, return-to-base")));
        assert_eq!(base("12.5, -40"), Ok((12_500, -40_000)));
        for wrong in ["", "1", "1,x", "NaN,0", "1,20001", "1,2,3"] {
            assert!(base(wrong).is_err(), "{wrong}");
        }
    }
}
