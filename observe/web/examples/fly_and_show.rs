//! A page with a built-in scenario, flown as fast as it goes:
//! `cargo run -p skein-web --example fly_and_show -- helsinki 4711 [UAVS]`.

use skein_netsim::Prepared;
use skein_netsim::runs::Wanted;
use skein_recording::model::Knowledge;
use skein_recording::simulated;
use skein_scenario::{Overrides, open};
use skein_web::{Feed, Hello, Mode, Server};
use std::error::Error;

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let over = Overrides {
        peers: args.get(2).and_then(|n| n.parse().ok()),
        ..Overrides::default()
    };
    let scenario = open(args.first().map(String::as_str), &over)?;
    let port = args.get(1).and_then(|p| p.parse().ok()).unwrap_or(0);
    let title = format!("{}, seed {}", scenario.spec.name, scenario.spec.seed);
    let feed = Feed::new(&Hello {
        mode: Mode::Sim,
        knowledge: Knowledge::World,
        title,
        command: "skein sim --web".to_owned(),
    });
    let server = Server::start(port, feed.clone(), None).await?;
    println!("{}", server.url());
    let seed = scenario.spec.seed;
    let prepared = Prepared::with_geometry(scenario.spec, scenario.geometry);
    let flown = tokio::task::spawn_blocking(move || {
        simulated::fly(&prepared, seed, None, Wanted::default(), &mut feed.sink())
    });
    println!("{}", flown.await??.report);
    std::future::pending().await
}
