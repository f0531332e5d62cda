//! The configuration of each peer, as its process reads it.

use skein_netsim::spec::{GroundStationSpec, Spec, UavSpec};
use skein_peer::wire::tasks::SENSORS;
use std::net::SocketAddr;

/// After so many beacon periods of scenario time without a byte a transport gives its
/// neighbour up: about when its silence counts without a hint of the transport (k1 in
/// `docs/protocol.md` §2), so that a trial finds out about deaths as soon as a simulated run,
/// which gives no hints.
const LEASE_PERIODS: f64 = 4.0;

/// The least that it is in time of the machine, milliseconds: starved processes on two cores
/// would lose their links.
const LEAST_LEASE_MS: u32 = 500;

/// The same for each peer of a large swarm, milliseconds: each two of them have a link that
/// is kept alive four times in a lease. Fifty peers on leases of half a second spend a
/// processor on it, and lose their links when they are late.
const LEASE_MS_PER_PEER: u32 = 50;

/// The lease of each link in a trial, milliseconds of the machine.
#[must_use]
pub fn lease_ms(spec: &Spec) -> u32 {
    let n = spec.uavs.len() + usize::from(spec.ground.is_some());
    let n = u32::try_from(n).unwrap_or(u32::MAX);
    let least_ms = LEASE_MS_PER_PEER.saturating_mul(n).max(LEAST_LEASE_MS);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the scale is positive; the cast saturates"
    )]
    let scaled_ms = (LEASE_PERIODS * f64::from(spec.beacon_period_ms) / spec.time_scale) as u32;
    scaled_ms.max(least_ms)
}

/// What a peer's configuration needs besides the scenario.
#[derive(Debug)]
pub struct Surroundings<'a> {
    /// The scenario.
    pub spec: &'a Spec,
    /// Seed of the run.
    pub seed: u64,
    /// Where the world listens.
    pub world: SocketAddr,
    /// Proves that the peer belongs to it.
    pub token: &'a str,
    /// The proxies that lead to peers of higher numbers.
    pub links: Vec<SocketAddr>,
}

/// The same with a console at any free port.
fn with_console(mut config: serde_json::Value, id: u16) -> serde_json::Value {
    config["console"] = serde_json::json!({
        "listen": "127.0.0.1:0",
        "token_file": format!("uav{id}.token"),
    });
    config
}

impl Surroundings<'_> {
    /// The configuration of a UAV.
    #[must_use]
    pub fn uav(&self, uav: &UavSpec) -> serde_json::Value {
        let airframe = skein_interop::airframe::to_json(&uav.airframe);
        let mut config = self.config(uav.id, "uav", uav.height_m, airframe);
        let carried = (1..).zip(SENSORS).filter(|(n, _)| uav.carries(*n));
        let carried: Vec<&str> = carried.map(|(_, name)| name).collect();
        config["sensors"] = carried.into();
        with_console(config, uav.id)
    }

    /// The configuration of the ground station.
    #[must_use]
    pub fn ground(&self, ground: &GroundStationSpec) -> serde_json::Value {
        let airframe = serde_json::Value::Null;
        let config = self.config(ground.id, "ground", ground.height_m, airframe);
        with_console(config, ground.id)
    }

    fn config(
        &self,
        id: u16,
        role: &str,
        height_m: f64,
        airframe: serde_json::Value,
    ) -> serde_json::Value {
        let links: Vec<String> = self.links.iter().map(|a| format!("tcp/{a}")).collect();
        serde_json::json!({
            "id": id,
            "role": role,
            "fleet": self.spec.fleet,
            "beacon_period_ms": self.spec.beacon_period_ms,
            "rate_bps": self.spec.radio.rate_bps,
            "queue_age_ms": self.spec.radio.queue_age_ms,
            "height_m": height_m,
            "airframe": airframe,
            "objective": self.spec.objective,
            "mission": "mission.json",
            "launches": &self.spec.launches()[..],
            "seed": skein_link::fate::mix(self.seed ^ (u64::from(id) << 40)),
            "journal": format!("uav{id}.journal"),
            "listen": "tcp/127.0.0.1:0",
            "links": links,
            "lease_ms": lease_ms(self.spec),
            "vehicle": { "simulator": self.world.to_string(), "token": self.token },
        })
    }
}
