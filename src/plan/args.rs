//! What several verbs of `plan` ask in the same words, and their errors in the words of
//! the flags.

use anyhow::{Error, Result, anyhow, ensure};
use clap::{Args, ValueEnum};
use skein_survey::area::{self, AreaError};
use skein_survey::detours::DetourError;
use skein_survey::heights::{LAYER_STEP_M, NoSeparation, Separation};
use skein_survey::objective;
use skein_survey::team::TeamError;
use skein_survey::tours::ToursError;
use std::path::Path;

/// How flights are kept apart.
#[derive(Clone, Copy, Debug, Args)]
pub struct LayerArgs {
    /// Distance below which two flights get different heights, metres; by default twice
    /// the widest turn or twice the clearance, whichever is more. Within two such
    /// distances of a common start it does not count; 0 leaves all at one height.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub separation_m: Option<f64>,
    /// Height between two layers, metres; 0 leaves all at one height.
    #[arg(
        long,
        default_value_t = LAYER_STEP_M,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub layer_step_m: f64,
}

impl LayerArgs {
    /// The same for the planner.
    #[must_use]
    pub fn separation(&self) -> Separation {
        Separation {
            distance_m: self.separation_m,
            layer_step_m: self.layer_step_m,
        }
    }
}

/// What is to be least.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Objective {
    /// The time until the last UAV is back.
    Time,
    /// The length of all flights together: one UAV may fly alone.
    Distance,
    /// The energy of all flights together: watt-hours where the fleet states
    /// `cruise_power_w`, else seconds of cruise.
    Energy,
}

impl Objective {
    /// The same for the planner.
    #[must_use]
    pub fn asked(self) -> objective::Objective {
        match self {
            Self::Time => objective::Objective::Time,
            Self::Distance => objective::Objective::Distance,
            Self::Energy => objective::Objective::Energy,
        }
    }

    /// Its name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Distance => "distance",
            Self::Energy => "energy",
        }
    }
}

/// Which lanes are planned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Lanes {
    /// One width for all: that of the narrowest swath, with the widest turn.
    Common,
    /// A section of the area for the UAVs of like swath, with lanes of their own.
    Sections,
    /// Both, and the better one is flown.
    Best,
}

impl Lanes {
    /// The same for the planner.
    #[must_use]
    pub fn asked(self) -> area::Lanes {
        match self {
            Self::Common => area::Lanes::Common,
            Self::Sections => area::Lanes::Sections,
            Self::Best => area::Lanes::Best,
        }
    }
}

/// The planners that `--exact` and `--approximate` ask for.
#[must_use]
pub fn planners(exact: bool, approximate: bool) -> area::Planners {
    match (exact, approximate) {
        (true, false) => area::Planners::Only(area::Planner::Exact),
        (false, true) => area::Planners::Only(area::Planner::Approximate),
        _ => area::Planners::Both,
    }
}

/// Refuses figures that nothing flies by.
///
/// # Errors
/// Names the flag.
pub fn positive(speed_mps: f64, turn_radius_m: f64, swath_m: f64) -> Result<()> {
    for (flag, value) in [
        ("--speed-mps: the speed", speed_mps),
        ("--turn-radius-m: the turn radius", turn_radius_m),
        ("--swath-m: the swath", swath_m),
    ] {
        ensure!(
            value.is_finite() && value > 0.0,
            "{flag} must be above 0, found {value}"
        );
    }
    Ok(())
}

fn team_error(error: TeamError) -> Error {
    match &error {
        TeamError::NoCarrier { carried, .. } if carried.is_empty() => {
            anyhow!("{error} (see --fleet)")
        }
        TeamError::Power { .. } => Error::new(error).context("--objective energy"),
        _ => error.into(),
    }
}

fn separation_error(error: NoSeparation) -> Error {
    match error {
        NoSeparation::Distance(x) => anyhow!("--separation-m must be 0 or more, found {x}"),
        NoSeparation::LayerStep(x) => anyhow!("--layer-step-m must be 0 or more, found {x}"),
    }
}

/// An error of zones.
#[must_use]
pub fn detour_error(error: DetourError) -> Error {
    match error {
        DetourError::Clearance(cause) => Error::new(cause).context("--clearance-m"),
        other => other.into(),
    }
}

/// An error of an area of this file.
#[must_use]
pub fn area_error(error: AreaError, file: &Path) -> Error {
    match error {
        AreaError::Team(error) => team_error(error),
        AreaError::Separation(error) => separation_error(error),
        AreaError::Zones(error) => detour_error(error),
        AreaError::NoPlan(error) => Error::new(error).context(file.display().to_string()),
    }
}

/// An error of tours.
#[must_use]
pub fn tours_error(error: ToursError) -> Error {
    match &error {
        ToursError::Team(error) => team_error(error.clone()),
        ToursError::Separation(error) => separation_error(*error),
        ToursError::Zones(error) => detour_error(error.clone()),
        ToursError::NoCarrier { carried, .. } if carried.is_empty() => {
            anyhow!("{error} (see --fleet)")
        }
        ToursError::NoSweep {
            target,
            radius_m,
            swath_m,
        } => anyhow!("{target}: no sweep of radius {radius_m} m with --swath-m {swath_m}"),
        ToursError::NoLanes {
            target,
            width_m,
            swath_m,
        } => anyhow!("{target}: a strip {width_m} m wide has no lanes of --swath-m {swath_m}"),
        ToursError::UnlikeInWind | ToursError::TooWindy(_) => {
            Error::new(error).context("--wind-mps")
        }
        _ => error.into(),
    }
}
