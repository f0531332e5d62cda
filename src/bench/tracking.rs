//! `skein bench tracking`: vehicles on real streets, and UAVs that follow them.

use crate::exit;
use clap::{Args, ValueEnum};
use skein_broker::pursuits;
use skein_flight::tracking::field::Field;
use skein_flight::tracking::mode::Airspeeds;
use skein_netsim::pursuit::camera::{Mount, Optics};
use skein_netsim::pursuit::roads::Roads;
use skein_netsim::pursuit::sensor::Noise;
use skein_netsim::pursuit::totals::Totals;
use skein_netsim::pursuit::vehicle::Behaviour;
use skein_netsim::pursuit::{Knows, Settings, airframe, obstacles};
use skein_scenario::{Seeds, town};
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::sync::Arc;

/// Stand-off errors below this are met where the circle can be flown, metres.
const MET_M: f64 = 0.5;

/// UAVs that follow vehicles on the streets of a square kilometre of Helsinki
/// (docs/tracking.md).
///
/// They cruise at 20 m/s with 30 degrees of bank at most, 120 m and more above the ground,
/// with a camera on a gimbal. With two and more one that follows is taken away on the way.
/// Exit code 1 if a mode chattered or, without --noise, the stand-off was missed by more than
/// 0.5 m where it could be flown.
#[allow(clippy::struct_excessive_bools, reason = "flags of a command line")]
#[derive(Debug, Args)]
pub struct TrackingArgs {
    /// The seeds: from A up to but not including B.
    #[arg(long, value_name = "A..B")]
    pub seeds: Seeds,
    /// The wind, m/s; each seed draws its direction.
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = speed)]
    pub wind: f64,
    /// The usual speed of the vehicles on straight streets, m/s; corners are taken slower.
    #[arg(long, value_name = "MPS", default_value_t = 8.0, value_parser = speed)]
    pub target_mps: f64,
    /// What the vehicles do; drawn for each where it is left open.
    #[arg(long, value_name = "WHAT")]
    pub behaviour: Option<What>,
    /// The vector field that the orbits follow.
    #[arg(long, value_name = "FIELD", default_value = "hopf")]
    pub guidance: Guidance,
    /// Sensors err, miss and raise false alarms, UAVs mistake their own place, and messages are
    /// lost.
    #[arg(long)]
    pub noise: bool,
    /// UAVs.
    #[arg(long, value_name = "N", default_value_t = 2,
          value_parser = clap::value_parser!(u16).range(1..=64))]
    pub uavs: u16,
    /// Vehicles to be followed.
    #[arg(long, value_name = "M", default_value_t = 1,
          value_parser = clap::value_parser!(u16).range(1..=8))]
    pub targets: u16,
    /// Buildings hide what is behind them.
    #[arg(long)]
    pub buildings: bool,
    /// UAVs know neither buildings nor streets, and who lost its target looks round about where it
    /// should be.
    #[arg(long)]
    pub blind: bool,
    /// UAVs are told where the targets are whether they see them or not: the most that sight can
    /// come to.
    #[arg(long)]
    pub told: bool,
    /// The stand-off, metres.
    #[arg(long, value_name = "M", default_value_t = 150.0, value_parser = stand_off)]
    pub stand_off_m: f64,
    /// One airspeed for all, as D2.7 has it; without it UAVs choose theirs from 13.2 to 26 m/s.
    #[arg(long, value_name = "MPS", value_parser = airspeed)]
    pub airspeed_mps: Option<f64>,
    /// A camera fixed to the airframe that looks to the left by so many degrees instead of one
    /// on a gimbal.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = angle)]
    pub fixed_camera_deg: Option<f64>,
    /// How long each run lasts, seconds.
    #[arg(long, value_name = "S", default_value_t = 300,
          value_parser = clap::value_parser!(u32).range(10..=7_200))]
    pub seconds: u32,
    /// Prints one JSON object.
    #[arg(long)]
    pub json: bool,
    /// Runs at the same time; without it one a processor.
    #[arg(long, value_name = "J")]
    pub jobs: Option<NonZeroUsize>,
}

/// What vehicles do.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum What {
    /// They stand.
    Parked,
    /// They drive on.
    Drives,
    /// They stop now and then.
    Stops,
    /// They hurry and turn off away from UAVs.
    Evades,
}

/// The vector field that orbits follow.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Guidance {
    /// That of D2.7.
    Hopf,
    /// That of Lawrence and Frew.
    Lyapunov,
}

fn number(text: &str, least: f64, most: f64, unit: &str) -> Result<f64, String> {
    let n: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    if (least..=most).contains(&n) {
        Ok(n)
    } else {
        Err(format!("expected {least} to {most} {unit}"))
    }
}

fn speed(text: &str) -> Result<f64, String> {
    number(text, 0.0, 60.0, "m/s")
}

fn stand_off(text: &str) -> Result<f64, String> {
    number(text, 1.0, 5_000.0, "metres")
}

fn airspeed(text: &str) -> Result<f64, String> {
    let a = airframe();
    number(text, a.least_airspeed_mps(), a.max_mps, "m/s")
}

fn angle(text: &str) -> Result<f64, String> {
    number(text, -90.0, 90.0, "degrees")
}

/// Runs the bench.
///
/// # Errors
/// When the town cannot be read or stdout cannot be written.
pub fn run(args: &TrackingArgs) -> anyhow::Result<ExitCode> {
    let settings = settings(args)?;
    let totals = pursuits::fly(&settings, args.seeds.from..args.seeds.to, args.jobs);
    if args.json {
        exit::print(serde_json::to_string(&totals)?)?;
    } else {
        exit::print(told(&totals))?;
    }
    let missed = totals.rms_standoff_m.is_some_and(|m| m > MET_M);
    let good = totals.runs > 0 && totals.chatter == 0 && (args.noise || !missed);
    Ok(ExitCode::from(if good {
        exit::OK
    } else {
        exit::MISSION_FAILED
    }))
}

fn settings(args: &TrackingArgs) -> anyhow::Result<Settings> {
    let town = town::helsinki()?;
    let roads = Roads::of(&town.roads);
    let roads = roads.ok_or_else(|| anyhow::anyhow!("the town has no streets"))?;
    let mut optics = Optics::gimballed();
    if let Some(left_deg) = args.fixed_camera_deg {
        optics.mount = Mount::Fixed {
            left_rad: left_deg.to_radians(),
        };
    }
    let one_speed = |mps| Airspeeds {
        least_mps: mps,
        most_mps: mps,
    };
    Ok(Settings {
        roads,
        buildings: args.buildings.then(|| Arc::new(obstacles(&town.buildings))),
        zones: None,
        uavs: args.uavs,
        targets: args.targets,
        wind_mps: args.wind,
        target_mps: args.target_mps,
        behaviour: args.behaviour.map(|w| match w {
            What::Parked => Behaviour::Parked,
            What::Drives => Behaviour::Drives,
            What::Stops => Behaviour::StopsAndGoes,
            What::Evades => Behaviour::Evades,
        }),
        field: match args.guidance {
            Guidance::Hopf => Field::HOPF,
            Guidance::Lyapunov => Field::Lyapunov,
        },
        airspeeds: args.airspeed_mps.map(one_speed),
        stand_off_m: args.stand_off_m,
        optics,
        noise: args.noise.then(Noise::usual),
        knows: Knows {
            buildings: !args.blind,
            streets: !args.blind,
            searches: !args.blind,
            targets: args.told,
        },
        kill: args.uavs > 1,
        lasts_s: f64::from(args.seconds),
    })
}

/// The totals as lines for a person.
fn told(t: &Totals) -> String {
    let metres = |m: Option<f64>| m.map_or("–".to_owned(), |m| format!("{m:.2} m"));
    let share = |s: Option<f64>| s.map_or("–".to_owned(), |s| format!("{:.2} %", 100.0 * s));
    let plain = |x: Option<f64>| x.map_or("–".to_owned(), |x| format!("{x:.2}"));
    let lines = [
        ("runs", t.runs.to_string()),
        (
            "stand-off",
            format!(
                "{} RMS, {:.2} m at worst, measured in {} of the time",
                metres(t.rms_standoff_m),
                t.worst_standoff_m,
                share(Some(t.flyable_share))
            ),
        ),
        (
            "in sight",
            format!(
                "{} while it can be kept up with, {} in all; {} behind buildings, below a roof for {}; longest gap {:.1} s",
                share(t.in_footprint_share),
                share(t.in_footprint_share_all),
                share(Some(t.hidden_share)),
                share(Some(t.covered_share)),
                t.longest_gap_s
            ),
        ),
        (
            "modes",
            format!(
                "{} switches, {} taken back at once",
                t.mode_switches, t.chatter
            ),
        ),
        (
            "estimates",
            format!(
                "{} RMS; NEES {} of one UAV, {} of several together (4 is consistent)",
                metres(t.position_rms_m),
                plain(t.nees),
                plain(t.nees_fused)
            ),
        ),
        (
            "taken away",
            format!(
                "{}; {} had again within 10 s, {} s at worst",
                t.trackers_lost,
                share(t.reacquired_within_10s),
                plain(t.reacquired_worst_s)
            ),
        ),
    ];
    let line = |(name, text): &(&str, String)| format!("  {name:<11} {text}");
    lines.iter().map(line).collect::<Vec<_>>().join("\n")
}
