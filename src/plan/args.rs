//! What several verbs of `plan` ask in the same words, and their errors in the words of
//! the flags.

use anyhow::{Error, Result, anyhow, ensure};
use clap::{Args, ValueEnum};
use skein_geometry::frame::Vector;
use skein_geometry::math::sin_cos;
use skein_interop::airframe::{ENDURANCE_S, SPEED_MPS};
use skein_interop::fleet::TURN_RADIUS_M;
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
    /// Refuses distances without a meaning, before anything is planned.
    ///
    /// # Errors
    /// Names the flag.
    pub fn check(&self) -> Result<()> {
        if let Some(separation_m) = self.separation_m {
            within("--separation-m", separation_m, DISTANCE_M, "m")?;
        }
        within("--layer-step-m", self.layer_step_m, DISTANCE_M, "m")?;
        Ok(())
    }

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

/// Lengths that are accepted where 0 has no meaning, metres: up to the radius of a mission.
pub const LENGTH_M: (f64, f64) = (0.1, 20_000.0);

/// Distances that are accepted, metres.
pub const DISTANCE_M: (f64, f64) = (0.0, 20_000.0);

/// The number of a flag, if it lies in a closed range.
///
/// # Errors
/// Names the flag, the range and the number; what is no number lies in no range.
pub fn within(flag: &str, value: f64, (low, high): (f64, f64), unit: &str) -> Result<f64> {
    ensure!(
        (low..=high).contains(&value),
        "{flag} must be between {low} and {high} {unit}, found {value}"
    );
    Ok(value)
}

/// A course of a flag, degrees: from 0 up to 360, or negative down to a half turn.
///
/// # Errors
/// Names the flag.
pub fn course(flag: &str, deg: f64) -> Result<f64> {
    ensure!(
        (-180.0..360.0).contains(&deg),
        "{flag} must be from -180 up to 360 degrees, found {deg}"
    );
    Ok(deg)
}

/// Refuses figures of flags that nothing flies by; the turn radius where there is a flag.
///
/// # Errors
/// Names the flag.
pub fn flyable(
    speed_mps: f64,
    turn_radius_m: Option<f64>,
    clearance_m: f64,
    endurance_s: Option<f64>,
) -> Result<()> {
    within("--speed-mps", speed_mps, SPEED_MPS, "m/s")?;
    if let Some(radius_m) = turn_radius_m {
        within("--turn-radius-m", radius_m, TURN_RADIUS_M, "m")?;
    }
    within("--clearance-m", clearance_m, DISTANCE_M, "m")?;
    if let Some(endurance_s) = endurance_s {
        within("--endurance-s", endurance_s, ENDURANCE_S, "s")?;
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

/// The wind.
#[derive(Clone, Copy, Debug, Args)]
pub struct WindArgs {
    /// Wind speed, m/s.
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "W",
        allow_hyphen_values = true
    )]
    pub wind_mps: f64,
    /// Where the wind comes from, degrees clockwise from north.
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "DEG",
        allow_hyphen_values = true
    )]
    pub wind_from_deg: f64,
}

impl WindArgs {
    /// Refuses numbers without a meaning.
    ///
    /// # Errors
    /// Names the flag.
    pub fn check(&self) -> Result<()> {
        within("--wind-mps", self.wind_mps, (0.0, SPEED_MPS.1), "m/s")?;
        course("--wind-from-deg", self.wind_from_deg)?;
        Ok(())
    }

    /// Where it blows to, m/s.
    #[must_use]
    pub fn velocity(&self) -> Vector {
        let (s, c) = sin_cos(self.wind_from_deg.to_radians());
        Vector::new(-s, -c) * self.wind_mps
    }
}

/// An error of an area of this file.
#[must_use]
pub fn area_error(error: AreaError, file: &Path) -> Error {
    match error {
        AreaError::Team(error) => team_error(error),
        AreaError::Separation(error) => separation_error(error),
        AreaError::Zones(error) => detour_error(error),
        AreaError::Fences(error) => Error::new(error).context(file.display().to_string()),
        AreaError::TooWindy(error) => Error::new(error).context("--wind-mps"),
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
