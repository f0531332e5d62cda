//! Flies a scenario in virtual time and draws what happened as an SVG on stdout: the
//! area, its no-fly zones, each cell in the colour of the UAV that saw it first, the
//! tracks, and where UAVs were lost.
//!
//! ```sh
//! cargo run --release -p skein-report --example picture -- helsinki > picture.svg
//! ```
//!
//! After the scenario's name or file, a seed may follow.

use skein_netsim::Prepared;
use skein_netsim::runs::Wanted;
use skein_recording::simulated;
use skein_recording::sink::Collected;
use skein_scenario::Overrides;
use std::process::ExitCode;

fn main() -> ExitCode {
    match drawn() {
        Ok(svg) => {
            print!("{svg}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::FAILURE
        }
    }
}

fn drawn() -> Result<String, String> {
    let mut words = std::env::args().skip(1);
    let name = words.next();
    let seed = words.next().map(|s| s.parse::<u64>()).transpose();
    let over = Overrides {
        seed: seed.map_err(|e| format!("the seed: {e}"))?,
        ..Overrides::default()
    };
    let scenario = skein_scenario::open(name.as_deref(), &over).map_err(|e| e.to_string())?;
    let seed = scenario.spec.seed;
    let prepared = Prepared::with_geometry(scenario.spec, scenario.geometry);
    let mut run = Collected::default();
    simulated::fly(&prepared, seed, None, Wanted::default(), &mut run)
        .map_err(|e| e.to_string())?;
    Ok(skein_report::picture(&run))
}
