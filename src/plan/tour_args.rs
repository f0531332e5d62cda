//! What `plan line` and `plan visit` share: flags, the way from a file to a request, and
//! what is told of the tours. Planned by [`skein_survey::tours`].

use super::args::{LayerArgs, Objective, WindArgs, flyable, tours_error, within};
use super::output::{OutputArgs, Printed, Sheet};
use super::target_input::{Kind, TargetInput};
use super::view::USUAL_SWATH_M;
use super::{team_input, why_home};
use anyhow::Result;
use clap::Args;
use serde_json::{Value, json};
use skein_interop::fleet::SWATH_M;
use skein_survey::flight::Stays;
use skein_survey::tours::{self, TourPlan, TourRequest, UavTour, Visit};
use std::path::{Path, PathBuf};

/// The team, the wind and the form of the result.
#[derive(Clone, Debug, Args)]
pub struct TourArgs {
    /// How many UAVs.
    #[arg(long, visible_alias = "uavs", default_value_t = 1, value_name = "N")]
    pub k: usize,
    /// The UAVs, one by one, instead of `--k`: JSON5, a list of `{name, speed_mps,
    /// endurance_s?, start?: [lat, lon], swath_m? or fov_across_deg?, turn_radius_m?,
    /// sensors?: {rgb: {swath_m or fov_across_deg}, ...}, cruise_power_w?}`.
    #[arg(long, value_name = "FILE")]
    pub fleet: Option<PathBuf>,
    /// Zones to fly round on the way, besides those of the file itself: fences of a
    /// `.plan`, or polygons of GeoJSON.
    #[arg(long, value_name = "FILE")]
    pub zones: Option<PathBuf>,
    /// Distance kept from every zone, metres.
    #[arg(
        long,
        default_value_t = 10.0,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub clearance_m: f64,
    /// Where all UAVs start and end, degrees; by default the file's home position, or
    /// its first target.
    #[arg(
        long,
        visible_alias = "launch",
        value_name = "LAT,LON",
        allow_hyphen_values = true
    )]
    pub depot: Option<String>,
    /// Airspeed, m/s.
    #[arg(
        long,
        default_value_t = 15.0,
        value_name = "V",
        allow_hyphen_values = true
    )]
    pub speed_mps: f64,
    /// The wind.
    #[command(flatten)]
    pub wind: WindArgs,
    /// The longest time that a UAV flies, seconds; lines beyond that are left out and named.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub endurance_s: Option<f64>,
    /// Width of the ground that a UAV sees, metres: what is wider is flown in lanes; 60 by
    /// default, and over an area what the file's survey says.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub swath_m: Option<f64>,
    /// Steps of improvement; the same steps give the same plan everywhere.
    #[arg(long, default_value_t = tours::DEFAULT_STEPS, value_name = "N")]
    pub steps: usize,
    /// The form of the result.
    #[command(flatten)]
    pub output: OutputArgs,
}

impl TourArgs {
    /// The width that a UAV sees where no file says one, metres.
    #[must_use]
    pub fn swath_m(&self) -> f64 {
        self.swath_m.unwrap_or(USUAL_SWATH_M)
    }

    /// Refuses numbers without a meaning, before anything is read.
    ///
    /// # Errors
    /// Names the flag.
    pub fn check(&self) -> Result<()> {
        flyable(self.speed_mps, None, self.clearance_m, self.endurance_s)?;
        within("--swath-m", self.swath_m(), SWATH_M, "m")?;
        self.wind.check()
    }
}

/// What is asked beside the team.
#[derive(Clone, Debug, Args)]
pub struct Wishes {
    /// The sensor for targets that do not ask for one themselves: UAVs without it fly
    /// none of these, and its swath counts.
    #[arg(long, value_name = "NAME")]
    pub sensor: Option<String>,
    /// What is to be least. Distance and energy choose which UAVs fly at all.
    #[arg(long, value_enum, default_value_t = Objective::Time)]
    pub objective: Objective,
    /// How flights are kept apart.
    #[command(flatten)]
    pub layers: LayerArgs,
}

/// Plans tours over what a file holds, and returns the text to print.
///
/// # Errors
/// When the file or a flag is wrong; the error names the place.
pub fn run(kind: Kind, file: &Path, args: &TourArgs, wishes: &Wishes) -> Result<String> {
    args.check()?;
    args.output.check_altitude(args.output.altitude_m())?;
    wishes.layers.check()?;
    let input = TargetInput::read(kind, file, args, team_input::TURN_RADIUS_M)?;
    let request = TourRequest {
        targets: input.targets,
        zones: input.zones,
        clearance_m: args.clearance_m,
        team: input.team,
        wind_mps: args.wind.velocity(),
        sensor: wishes.sensor.clone(),
        objective: wishes.objective.asked(),
        separation: wishes.layers.separation(),
        altitude_m: args.output.altitude_m(),
        steps: args.steps,
    };
    let plan = tours::plan(&request).map_err(tours_error)?;
    let mut site = input.site;
    // Half of what a picture sees along, if it sees as far along as across.
    site.trigger_m = site.trigger_m.or(Some(args.swath_m() / 2.0));
    site.clearance_m = args.clearance_m;
    site.wind_mps = args.wind.velocity();
    args.output.print(&Sheet {
        origin: input.origin,
        site,
        summary: summary(&request, &plan, args, wishes, &input.notices),
        flights: plan.uavs.iter().map(printed).collect(),
        shapes: Vec::new(),
    })
}

fn printed(tour: &UavTour) -> Printed {
    let mut printed = Printed::new(&tour.flight);
    let targets = json!(tour.visits.len());
    printed.told.insert("targets".to_owned(), targets);
    let pass = |v: &Visit| json!({"target": v.target, "backward": v.backward});
    let passes = tour.visits.iter().map(pass).collect();
    printed.details.insert("passes".to_owned(), passes);
    printed
}

fn summary(
    request: &TourRequest,
    plan: &TourPlan,
    args: &TourArgs,
    wishes: &Wishes,
    notices: &[String],
) -> Value {
    let at_home = plan
        .uavs
        .iter()
        .zip(&request.team)
        .filter_map(|(uav, asked)| {
            let why = match uav.flight.stays? {
                Stays::NoSensor => "has none of the sensors that are asked for".to_owned(),
                Stays::NotNeeded => why_home(asked.endurance_s, 0.0, !plan.unserved.is_empty()),
            };
            Some(json!({"name": uav.flight.name, "why": why}))
        });
    let at_home: Vec<Value> = at_home.collect();
    json!({
        "makespan_s": plan.makespan_s, "lower_bound_s": plan.lower_bound_s,
        "total_s": plan.total_s, "total_m": plan.total_m,
        "energy_s": plan.energy_s, "energy_wh": plan.energy_wh,
        "wind_mps": args.wind.wind_mps, "wind_from_deg": args.wind.wind_from_deg,
        "clearance_m": request.clearance_m,
        "objective": wishes.objective.name(), "sensor": wishes.sensor,
        "uavs_flying": plan.uavs_flying(), "at_home": at_home,
        "targets": plan.targets, "unserved": plan.unserved,
        "notices": ([notices, &plan.notices].concat()),
    })
}
