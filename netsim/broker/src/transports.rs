//! The loopback transports between each two peers: a proxy a pair, dark while their link
//! is down.

use crate::live_world::LiveWorld;
use crate::proxy::Proxy;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::time::Instant;

/// A link that has been down for so many leases goes dark for the transports too, so that a
/// transport that loses a neighbour truly lost it.
const DARK_LEASES: u32 = 2;

/// The proxy of a pair and the state of its link.
#[derive(Debug)]
struct Pair {
    proxy: Proxy,
    down_since: Option<Instant>,
}

/// The proxies of all pairs, by the lower and the higher number.
#[derive(Debug)]
pub(crate) struct Transports {
    pairs: BTreeMap<(u16, u16), Pair>,
    dark_after: Duration,
}

impl Transports {
    /// A proxy for each two of `ids`, whose transports have this lease.
    ///
    /// # Errors
    /// When no port can be had.
    pub(crate) async fn bind(ids: &[u16], lease_ms: u32) -> std::io::Result<Self> {
        let mut pairs = BTreeMap::new();
        for low in ids {
            for high in ids.iter().filter(|high| *high > low) {
                let pair = Pair {
                    proxy: Proxy::bind().await?,
                    down_since: None,
                };
                pairs.insert((*low, *high), pair);
            }
        }
        Ok(Self {
            pairs,
            dark_after: DARK_LEASES * Duration::from_millis(u64::from(lease_ms)),
        })
    }

    /// The proxies that lead from `id` to peers of higher numbers.
    pub(crate) fn from(&self, id: u16) -> Vec<SocketAddr> {
        let own = self.pairs.iter().filter(|((low, _), _)| *low == id);
        own.map(|(_, p)| p.proxy.address()).collect()
    }

    /// `id` listens at `address` now.
    pub(crate) fn lead_to(&self, id: u16, address: SocketAddr) {
        for (_, pair) in self.pairs.iter().filter(|((_, high), _)| *high == id) {
            pair.proxy.lead_to(address);
        }
    }

    /// Follows the true links: darkens the proxies of what stays down.
    pub(crate) fn follow(&mut self, world: &LiveWorld) {
        let now = Instant::now();
        for ((low, high), pair) in &mut self.pairs {
            let (there, back) = (world.link(*low, *high), world.link(*high, *low));
            // One way up keeps the transport, which can only carry both.
            if there.is_up() || back.is_up() {
                pair.down_since = None;
                pair.proxy.set_dark(false);
            } else {
                let since = *pair.down_since.get_or_insert(now);
                pair.proxy
                    .set_dark(now.duration_since(since) > self.dark_after);
            }
        }
    }
}
