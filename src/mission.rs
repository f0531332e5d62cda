//! `skein mission`: what an operator makes of the mission at the console of a ground station.

use crate::console::{AtArgs, look, say};
use crate::exit;
use crate::scenario_args::PlannerArgs;
use clap::{Args, Subcommand, ValueEnum};
use skein_behaviors::Order;
use skein_console::Command;
use skein_peer::mission::mm;
use skein_peer::{Mission, Overview};
use skein_scenario::diagram::{self, Format};
use skein_scenario::{Overrides, Severity};
use std::process::ExitCode;
use std::sync::Arc;

/// Gives, shows, changes and ends the mission of a swarm in flight.
///
/// The ground station speaks each change by radio as the next revision, and every peer passes
/// it on. What cannot be flown is refused: by the place in the file, or by the ground station,
/// which also refuses what does not fit the UAVs in the air. Without flags the ground station
/// of the only running trial is meant. (`skein mission SCENARIO` and `skein mission --base` are
/// older words for `revise` and `base`.)
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct MissionArgs {
    /// What happens.
    #[command(subcommand)]
    pub what: Option<What>,
    /// The same as `revise SCENARIO`.
    #[arg(hide = true, required_unless_present = "base")]
    pub scenario: Option<String>,
    /// The same as `base EAST,NORTH`.
    #[arg(long, hide = true, value_name = "EAST,NORTH", value_parser = base, conflicts_with = "scenario", allow_hyphen_values = true)]
    pub base: Option<(i32, i32)>,
    /// Who plans an area.
    #[command(flatten)]
    pub planner: PlannerArgs,
    /// Which ground station.
    #[command(flatten)]
    pub at: AtArgs,
}

/// What happens to the mission.
#[derive(Debug, Subcommand)]
pub enum What {
    /// Begins the mission of a scenario anew: nothing of it is covered yet. No-fly zones that
    /// were added in flight stay.
    Submit(GivenArgs),
    /// What is flown, who follows which revision of it, and how far it is.
    Show {
        /// As one line of JSON.
        #[arg(long)]
        json: bool,
    },
    /// Changes the mission to that of a scenario: what was covered of the same places stays
    /// covered, and so do no-fly zones that were added in flight.
    Revise(GivenArgs),
    /// Moves the base of the mission that is flown.
    Base {
        /// Metres east and north of the mission's origin.
        #[arg(value_name = "EAST,NORTH", value_parser = base, allow_hyphen_values = true)]
        place: (i32, i32),
    },
    /// Draws the diagram by which a mission is flown: what a UAV does in it, and what follows on
    /// which event. Needs no ground station.
    Diagram {
        /// A built-in diagram, a file that holds one, or a scenario whose mission is flown by it.
        #[arg(value_name = "NAME|FILE")]
        diagram: String,
        /// As a picture, or as text from which other programs draw one.
        #[arg(long, value_enum, default_value_t = Drawn::Svg)]
        format: Drawn,
    },
    /// Ends the mission: all fly home and wait there, until another one is submitted.
    Cancel,
    /// All loiter where they are, until `resume`.
    Hold(ToArgs),
    /// All carry on with the mission.
    Resume(ToArgs),
    /// All come home and loiter there, until `resume`. Who returns lets go first of what it was
    /// to fly: those who are not told to return fly it.
    Rtb(ToArgs),
}

/// How a diagram is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Drawn {
    /// A picture for a browser.
    Svg,
    /// Text for Graphviz.
    Dot,
    /// Text for Mermaid.
    Mermaid,
}

impl Drawn {
    fn format(self) -> Format {
        match self {
            Self::Svg => Format::Svg,
            Self::Dot => Format::Dot,
            Self::Mermaid => Format::Mermaid,
        }
    }
}

/// To whom an order is given.
#[derive(Clone, Copy, Debug, Args)]
pub struct ToArgs {
    /// To this UAV alone, until it or all are told something else; without it to all.
    #[arg(long, value_name = "ID")]
    pub uav: Option<u16>,
}

/// A scenario whose area, zones and lanes are taken; its fleet and radio play no part.
#[derive(Debug, Args)]
pub struct GivenArgs {
    /// A scenario file or the name of a built-in scenario.
    pub scenario: String,
    /// Who plans an area.
    #[command(flatten)]
    pub planner: PlannerArgs,
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

/// Runs the verb.
///
/// # Errors
/// When there is no runtime or stdout cannot be written.
pub fn run(args: &MissionArgs) -> anyhow::Result<ExitCode> {
    let order = |to: &ToArgs, order| say(&args.at, &Command::order(to.uav, order));
    match &args.what {
        Some(What::Submit(given)) => {
            give(&args.at, &given.scenario, given.planner, Command::Submit)
        }
        Some(What::Revise(given)) => {
            give(&args.at, &given.scenario, given.planner, Command::Mission)
        }
        Some(What::Show { json }) => show(&args.at, *json),
        Some(What::Base { place }) => say(&args.at, &Command::Base(*place)),
        Some(What::Diagram { diagram, format }) => draw(diagram, *format),
        Some(What::Cancel) => say(&args.at, &Command::Cancel),
        Some(What::Hold(to)) => order(to, Order::Hold),
        Some(What::Resume(to)) => order(to, Order::Resume),
        Some(What::Rtb(to)) => order(to, Order::ReturnToBase),
        None => match (args.base, &args.scenario) {
            (Some(base), _) => say(&args.at, &Command::Base(base)),
            (None, scenario) => give(
                &args.at,
                scenario.as_deref().unwrap_or_default(),
                args.planner,
                Command::Mission,
            ),
        },
    }
}

fn give(
    at: &AtArgs,
    scenario: &str,
    planner: PlannerArgs,
    command: fn(Arc<Mission>) -> Command,
) -> anyhow::Result<ExitCode> {
    let over = Overrides {
        planner: planner.chosen(),
        ..Overrides::default()
    };
    let scenario = match skein_scenario::open(Some(scenario), &over) {
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
    say(at, &command(scenario.spec.mission))
}

fn draw(target: &str, format: Drawn) -> anyhow::Result<ExitCode> {
    match diagram::open(target) {
        Ok(diagram) => {
            exit::print(diagram::picture(&diagram, format.format()))?;
            Ok(ExitCode::from(exit::OK))
        }
        Err(error) => {
            eprintln!("error: {error}");
            Ok(ExitCode::from(exit::CONFIG_INVALID))
        }
    }
}

fn show(at: &AtArgs, json: bool) -> anyhow::Result<ExitCode> {
    let (overview, line) = match look::<Overview>(at, None, &Command::Show)? {
        Ok(found) => found,
        Err(refusal) => return Ok(refusal.told()),
    };
    if json {
        exit::print(line)?;
    } else {
        exit::print(overview)?;
    }
    Ok(ExitCode::from(exit::OK))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        mission: MissionArgs,
    }

    #[test]
    fn places_are_read_as_people_write_them() {
        assert_eq!(base("12.5, -40"), Ok((12_500, -40_000)));
        for wrong in ["", "1", "1,x", "NaN,0", "1,20001", "1,2,3"] {
            assert!(base(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn old_words_and_new_ones_are_understood() {
        let parse = |text: &str| Cli::try_parse_from(text.split_whitespace());
        for new in [
            "mission submit helsinki --exact",
            "mission show --json",
            "mission diagram patrol",
            "mission diagram watch.json5 --format mermaid",
            "mission revise field --at 127.0.0.1:4 --token-file f",
            "mission base -4,3.5",
            "mission cancel --trial x",
            "mission hold",
            "mission resume",
            "mission rtb",
            "mission rtb --uav 3",
            "mission resume --uav 3 --trial x",
        ] {
            assert!(parse(new).is_ok_and(|c| c.mission.what.is_some()), "{new}");
        }
        let old = parse("mission helsinki --at 127.0.0.1:4 --token-file f")
            .unwrap()
            .mission;
        assert_eq!(old.scenario.as_deref(), Some("helsinki"));
        assert!(old.what.is_none() && old.at.at.is_some());
        assert_eq!(
            parse("mission --base 1,-2").unwrap().mission.base,
            Some((1_000, -2_000))
        );
        for wrong in [
            "mission",
            "mission submit",
            "mission show --at 127.0.0.1:4",
            "mission hold 3",
            "mission rtb --uav",
            "mission cancel --uav 3",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
