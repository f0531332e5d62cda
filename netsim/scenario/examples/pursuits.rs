//! Pursuits on the streets of a square kilometre of Helsinki, as `skein bench tracking` flies
//! them, without a transport:
//! `cargo run --release -p skein-scenario --example pursuits -- 710000..710012 noise buildings`.
//!
//! The first argument are the seeds; words after it change the pursuit: `noise`, `buildings`,
//! `uavs=2`, `targets=1`, `wind=0`, `mps=8`, `stand-off=150`, `seconds=300`, `evades`, `drives`,
//! `stops`; what UAVs do not know or do, `blind` (buildings), `no-map` (streets), `glances` (they
//! do not search), or know more, `told` (where the targets are); and `each` for a line a run. Prints the totals.

use skein_netsim::pursuit::roads::Roads;
use skein_netsim::pursuit::sensor::Noise;
use skein_netsim::pursuit::totals::Tally;
use skein_netsim::pursuit::vehicle::Behaviour;
use skein_netsim::pursuit::{Settings, obstacles, run};
use skein_scenario::{Seeds, town};
use std::process::ExitCode;
use std::sync::Arc;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let both = args.first().map_or("0..2", String::as_str).parse::<Seeds>();
    let (seeds, settings) = match (both, settings(&args)) {
        (Ok(seeds), Ok(settings)) => (seeds, settings),
        (Err(problem), _) => return refuse(&problem),
        (_, Err(problem)) => return refuse(&problem),
    };
    let mut tally = Tally::default();
    for seed in seeds.from..seeds.to {
        let one = run(&settings, seed);
        if args.iter().any(|a| a == "each") {
            println!(
                "{seed}: in sight {:.1} of {:.1} s, hidden {:.1} s, longest gap {:.1} s",
                one.seen_s, one.whole_s, one.hidden_s, one.longest_gap_s
            );
        }
        tally.add(seed, one);
    }
    println!("{:#?}", tally.totals());
    ExitCode::SUCCESS
}

fn refuse(problem: &dyn core::fmt::Display) -> ExitCode {
    eprintln!("{problem}");
    ExitCode::from(2)
}

/// The pursuit that the words ask for.
fn settings(args: &[String]) -> Result<Settings, String> {
    let town = town::helsinki().map_err(|e| e.to_string())?;
    let roads = Roads::of(&town.roads).ok_or("the town has no streets")?;
    let mut s = Settings::on(roads);
    for word in args.iter().skip(1) {
        let (name, value) = word.split_once('=').unwrap_or((word, ""));
        let number = || {
            value
                .parse::<f64>()
                .map_err(|_| format!("{word}: {value:?} is no number"))
        };
        let count = || {
            value
                .parse::<u16>()
                .map_err(|_| format!("{word}: {value:?} is no number"))
        };
        match name {
            "noise" => s.noise = Some(Noise::usual()),
            "buildings" => s.buildings = Some(Arc::new(obstacles(&town.buildings))),
            "uavs" => s.uavs = count()?,
            "targets" => s.targets = count()?,
            "wind" => s.wind_mps = number()?,
            "mps" => s.target_mps = number()?,
            "stand-off" => s.stand_off_m = number()?,
            "seconds" => s.lasts_s = number()?,
            "drives" => s.behaviour = Some(Behaviour::Drives),
            "stops" => s.behaviour = Some(Behaviour::StopsAndGoes),
            "evades" => s.behaviour = Some(Behaviour::Evades),
            "blind" => s.knows.buildings = false,
            "no-map" => s.knows.streets = false,
            "glances" => s.knows.searches = false,
            "told" => s.knows.targets = true,
            "each" => {}
            _ => return Err(format!("{word}: no word of this example")),
        }
    }
    s.kill = s.uavs > 1;
    Ok(s)
}
