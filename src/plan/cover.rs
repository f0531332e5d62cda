//! `plan cover`: an area covered by a team (D2.7 §3.6), exactly by straight passes, or
//! approximately by lane cells, or the better of both.

use super::choice::choose;
use super::fleet::{self, Member};
use super::flights::Flights;
use super::flyers::{Defaults, Flyer, depends_on_height, flyers};
use super::heights::LayerArgs;
use super::lanes::{Desk, Lanes};
use super::objective::{Objective, in_watt_hours};
use super::output::{OutputArgs, Printed, Sheet};
use super::planners::{Ground, Planner};
use super::site::{self, Site};
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde_json::{Map, json};
use std::path::PathBuf;

/// Times that swaths are taken from the heights that a plan led to.
const HEIGHT_ROUNDS: usize = 3;

/// A lane may be wider than a swath by this, metres: rounding.
const ROUNDING_M: f64 = 1e-9;

/// An area covered by a team: one closed flight a UAV, the longest as short as can be
/// found, or what `--objective` asks for.
///
/// Without `--exact` or `--approximate` both planners are asked, both are told, and the
/// flights are those of the one that sees more, or as much sooner.
///
/// The survey of a QGroundControl `.plan` with its exclusion fences, or a GeoJSON polygon
/// with its holes, and zones with the property "no_fly": true. The property "sensor" of
/// the polygon names the sensor to see it with. Times are without wind. Flights that come
/// near to each other get heights of their own.
#[derive(Debug, Args)]
pub struct CoverArgs {
    /// A QGroundControl `.plan` or GeoJSON.
    pub file: PathBuf,
    /// Exact coverage: cells of the area as it is drawn, in straight passes.
    #[arg(long, conflicts_with = "approximate")]
    pub exact: bool,
    /// Approximate coverage: lane cells as wide as the swath, a region of them each.
    #[arg(long)]
    pub approximate: bool,
    /// How many UAVs.
    #[arg(long, default_value_t = 1, value_name = "K")]
    pub k: usize,
    /// The UAVs, one by one, instead of `--k`: JSON5, a list of `{name, speed_mps,
    /// endurance_s?, start?: [lat, lon], swath_m? or fov_across_deg?, turn_radius_m?,
    /// sensors?: {rgb: {swath_m or fov_across_deg}, ...}, cruise_power_w?}`.
    #[arg(long, value_name = "FILE")]
    pub fleet: Option<PathBuf>,
    /// Where all UAVs start and end, degrees; by default the file's home position, or the
    /// area's first corner.
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true)]
    pub launch: Option<String>,
    /// Width of the ground that a pass sees, metres.
    #[arg(long, default_value_t = 60.0, value_name = "M")]
    pub swath_m: f64,
    /// How far the camera sees before and behind, metres; half the swath by default.
    #[arg(long, value_name = "M")]
    pub look_ahead_m: Option<f64>,
    /// Turn radius, metres.
    #[arg(long, default_value_t = 30.0, value_name = "M")]
    pub turn_radius_m: f64,
    /// Distance kept from every zone, metres.
    #[arg(
        long,
        default_value_t = 10.0,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub clearance_m: f64,
    /// Ground speed, m/s.
    #[arg(long, default_value_t = 15.0, value_name = "V")]
    pub speed_mps: f64,
    /// The longest time that a UAV flies, seconds; passes beyond that are left out and
    /// listed.
    #[arg(long, value_name = "S")]
    pub endurance_s: Option<f64>,
    /// Course of all lanes, degrees clockwise from north; by default the shortest found.
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    pub course_deg: Option<f64>,
    /// The sensor to see the area with: UAVs without it stay, and its swath counts.
    #[arg(long, value_name = "NAME")]
    pub sensor: Option<String>,
    /// What is to be least. Distance and energy choose which UAVs fly at all.
    #[arg(long, value_enum, default_value_t = Objective::Time)]
    pub objective: Objective,
    /// Lanes for UAVs of unlike swath.
    #[arg(long, value_enum, default_value_t = Lanes::Best)]
    pub lanes: Lanes,
    /// How flights are kept apart.
    #[command(flatten)]
    pub layers: LayerArgs,
    /// Steps of improvement; the same steps give the same plan everywhere.
    #[arg(long, default_value_t = 20_000, value_name = "N")]
    pub steps: usize,
    /// The form of the result.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// Plans, and returns the text to print.
///
/// # Errors
/// When the file or a flag is wrong; the error names the place.
pub fn run(args: &CoverArgs) -> Result<String> {
    let team = team(args)?;
    let site = site::read(&args.file, args.launch.as_deref())?;
    let job = Job::new(args, &site, &team)?;
    let chosen = job.planned()?;
    args.output.print(&job.sheet(&chosen)?)
}

/// The site, and its best plan, whatever sensor the file asks for: what a patrol flies
/// round, all on one tour.
pub(super) fn planned(args: &CoverArgs) -> Result<(Site, Flights)> {
    let team = team(args)?;
    let mut site = site::read(&args.file, args.launch.as_deref())?;
    if let Some(sensor) = site.sensor.take() {
        let text = format!("sensor {sensor:?} of the area ignored: all fly the same tour");
        site.notices.push(text);
    }
    let mut chosen = Job::new(args, &site, &team)?.planned()?;
    site.notices.append(&mut chosen.refused);
    let best = chosen.plans.into_iter().next();
    Ok((site, best.context("no planner was asked")?))
}

/// The team; refuses flags without a meaning.
fn team(args: &CoverArgs) -> Result<Vec<Member>> {
    let team = fleet::team(
        args.fleet.as_deref(),
        args.k,
        args.speed_mps,
        args.endurance_s,
    )?;
    args.output.check(team.len())?;
    args.layers.check()?;
    for (flag, value) in [
        ("--speed-mps: the speed", args.speed_mps),
        ("--turn-radius-m: the turn radius", args.turn_radius_m),
        ("--swath-m: the swath", args.swath_m),
    ] {
        ensure!(
            value.is_finite() && value > 0.0,
            "{flag} must be above 0, found {value}"
        );
    }
    Ok(team)
}

/// The sensor that is asked for by the file or the flag.
fn sensor<'a>(args: &'a CoverArgs, site: &'a Site) -> Result<Option<&'a str>> {
    match (&args.sensor, &site.sensor) {
        (Some(flag), Some(own)) if flag != own => {
            bail!("--sensor {flag}: the area asks for {own:?}")
        }
        (flag, own) => Ok(flag.as_deref().or(own.as_deref())),
    }
}

/// What is asked.
struct Job<'a> {
    args: &'a CoverArgs,
    site: &'a Site,
    team: &'a [Member],
    sensor: Option<&'a str>,
    in_watt_hours: bool,
}

/// The plans that were found.
struct Chosen {
    /// The best of each planner and kind of lanes; the one to fly first.
    plans: Vec<Flights>,
    /// By UAV: its height above home, metres.
    heights_m: Vec<f64>,
    /// Why a planner has none.
    refused: Vec<String>,
}

impl<'a> Job<'a> {
    fn new(args: &'a CoverArgs, site: &'a Site, team: &'a [Member]) -> Result<Self> {
        Ok(Self {
            sensor: sensor(args, site)?,
            in_watt_hours: in_watt_hours(team, args.objective)?,
            args,
            site,
            team,
        })
    }

    fn flyers(&self, heights_m: &[f64]) -> Result<Vec<Flyer>> {
        let defaults = Defaults {
            swath_m: self.args.swath_m,
            turn_radius_m: self.args.turn_radius_m,
            sensor: self.sensor,
        };
        flyers(self.team, self.site.origin, defaults, heights_m)
    }

    /// The plan, and heights at which no swath is narrower than its lanes.
    ///
    /// Swaths are those of the lowest height first: higher up they are wider, so that the
    /// plan fits. Then they are those of the heights that it leads to, as long as a
    /// better plan fits the heights that it leads to itself.
    fn planned(&self) -> Result<Chosen> {
        let lowest_m = self.args.output.altitude_m;
        let mut best = self.at_heights(&vec![lowest_m; self.team.len()])?;
        let high = |(uav, m): (usize, &Member)| {
            best.heights_m[uav] > lowest_m + ROUNDING_M && depends_on_height(m)
        };
        if !self.team.iter().enumerate().any(high) {
            return Ok(best);
        }
        for _ in 0..HEIGHT_ROUNDS {
            let next = self.at_heights(&best.heights_m)?;
            let (Some(a), Some(b)) = (next.plans.first(), best.plans.first()) else {
                break;
            };
            let worth = |f: &Flights| f.worth(self.in_watt_hours);
            let fits = self.fits(a, &next.heights_m)?;
            if !fits || !worth(a).beats(&worth(b), self.args.objective) {
                break;
            }
            best = next;
        }
        Ok(best)
    }

    /// Whether every UAV sees as wide as the lanes that it flies.
    fn fits(&self, flights: &Flights, heights_m: &[f64]) -> Result<bool> {
        let flyers = self.flyers(heights_m)?;
        let narrow = |f: &Flyer| {
            let own = flights.flights.iter().find(|own| own.uav == f.uav);
            own.is_some_and(|own| own.flies() && own.lane_m > f.swath_m + ROUNDING_M)
        };
        Ok(!flyers.iter().any(narrow))
    }

    /// Plans with the swaths of these heights; tells the heights that the plan needs.
    fn at_heights(&self, heights_m: &[f64]) -> Result<Chosen> {
        let args = self.args;
        let flyers = self.flyers(heights_m)?;
        let ground = Ground::new(
            self.site,
            args.clearance_m,
            args.look_ahead_m,
            args.course_deg,
            flyers.iter().map(|f| f.start),
        )?;
        let mut plans: Vec<Flights> = Vec::new();
        let mut errors = Vec::new();
        for (planner, other) in [
            (Planner::Exact, args.approximate),
            (Planner::Approximate, args.exact),
        ] {
            if other {
                continue;
            }
            let desk = Desk {
                ground: &ground,
                planner,
                lanes: args.lanes,
                objective: args.objective,
                in_watt_hours: self.in_watt_hours,
            };
            match choose(&desk, &flyers, args.steps) {
                Ok(found) => {
                    let ahead = plans.first().is_none_or(|b| desk.beats(&found[0], b));
                    let at = if ahead { 0 } else { plans.len() };
                    plans.splice(at..at, found);
                }
                Err(error) => errors.push(error),
            }
        }
        let Some(best) = plans.first() else {
            let error = errors.swap_remove(0);
            return Err(error.context(args.file.display().to_string()));
        };
        let separation_m =
            args.layers
                .separation_m(self.team, args.turn_radius_m, args.clearance_m);
        let mut tracks = vec![Vec::new(); self.team.len()];
        for flight in &best.flights {
            tracks[flight.uav].clone_from(&flight.track);
        }
        Ok(Chosen {
            heights_m: args
                .layers
                .heights_m(&tracks, separation_m, args.output.altitude_m),
            // One planner's refusal is worth a notice when the other one has a plan.
            refused: errors.iter().map(|e| format!("{e:#}")).collect(),
            plans,
        })
    }

    fn sheet(&self, chosen: &Chosen) -> Result<Sheet> {
        let best = chosen.plans.first().context("no planner was asked")?;
        let flies = |uav: usize| best.flights.iter().any(|f| f.uav == uav && f.flies());
        let takes_part = self.flyers(&chosen.heights_m)?;
        let at_home = self.team.iter().enumerate().filter(|(uav, _)| !flies(*uav));
        let at_home = at_home.map(|(uav, member)| {
            let lacks = !takes_part.iter().any(|f| f.uav == uav);
            let why = match self.sensor {
                Some(sensor) if lacks => format!("has no sensor {sensor:?}"),
                _ => super::NOT_NEEDED.to_owned(),
            };
            json!({"name": member.name, "why": why})
        });
        let mut summary = best.compared();
        for (key, value) in &best.more {
            summary[key] = value.clone();
        }
        if chosen.plans.len() > 1 {
            let mut plans: Vec<&Flights> = chosen.plans.iter().collect();
            plans.sort_by_key(|p| (p.planner != Planner::Exact.name(), p.laid));
            summary["compared"] = plans.into_iter().map(Flights::compared).collect();
        }
        summary["objective"] = json!(self.args.objective);
        summary["sensor"] = json!(self.sensor);
        summary["at_home"] = at_home.collect();
        summary["notices"] = json!([&self.site.notices[..], &chosen.refused].concat());
        let printed = self.team.iter().enumerate().map(|(uav, member)| {
            let altitude_m = chosen.heights_m[uav];
            match best.flights.iter().find(|f| f.uav == uav) {
                Some(flight) => Ok(flight.printed(altitude_m)),
                None => self.stays(member, altitude_m),
            }
        });
        Ok(Sheet {
            origin: self.site.origin,
            flights: printed.collect::<Result<_>>()?,
            summary,
            shapes: best.shapes.clone(),
        })
    }

    /// A UAV that was not planned for.
    fn stays(&self, member: &Member, altitude_m: f64) -> Result<Printed> {
        let nothing = ["time_s", "length_m", "energy_s"].map(|k| (k.to_owned(), json!(0.0)));
        Ok(Printed {
            name: member.name.clone(),
            track: vec![member.start_in(self.site.origin)?],
            altitude_m,
            speed_mps: member.speed_mps,
            told: Map::from_iter(nothing),
            details: Map::new(),
        })
    }
}

#[cfg(test)]
mod tests;
