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

/// Between two transports that a peer loses there is this much time, of the machine: closing
/// one keeps the only thread of its transports busy, and a swarm that begins beyond the reach
/// of half of its members would close hundreds in one instant, with messages behind them.
const CUTS_APART: Duration = Duration::from_millis(250);

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
    /// When a transport of each peer was last cut.
    cut_at: BTreeMap<u16, Instant>,
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
            cut_at: BTreeMap::new(),
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
        // One way up keeps the transport, which can only carry both.
        self.follow_links(now, |low, high| {
            world.link(low, high).is_up() || world.link(high, low).is_up()
        });
    }

    fn follow_links(&mut self, now: Instant, up: impl Fn(u16, u16) -> bool) {
        for ((low, high), pair) in &mut self.pairs {
            if up(*low, *high) {
                pair.down_since = None;
                pair.proxy.set_dark(false);
                continue;
            }
            let since = *pair.down_since.get_or_insert(now);
            let due = now.duration_since(since) > self.dark_after;
            let ends = [*low, *high];
            let busy = |id| self.cut_at.get(id).is_some_and(|at| now < *at + CUTS_APART);
            if due && !pair.proxy.is_dark() && !ends.iter().any(busy) {
                pair.proxy.set_dark(true);
                self.cut_at.extend(ends.map(|id| (id, now)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn what_stays_down_goes_dark_one_transport_of_a_peer_after_the_other() {
        let mut transports = Transports::bind(&[1, 2, 3, 4], 500).await.unwrap();
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let dark = |t: &Transports| {
            let pairs = t.pairs.iter().filter(|(_, pair)| pair.proxy.is_dark());
            pairs.map(|(ends, _)| *ends).collect::<Vec<_>>()
        };
        let none = |_, _| false;
        for ms in [0, 1_000] {
            transports.follow_links(at(ms), none);
            assert_eq!(dark(&transports), [], "{ms}");
        }
        transports.follow_links(at(1_001), none);
        assert_eq!(dark(&transports), [(1, 2), (3, 4)]);
        transports.follow_links(at(1_250), none);
        assert_eq!(dark(&transports).len(), 2);
        transports.follow_links(at(1_251), none);
        assert_eq!(dark(&transports), [(1, 2), (1, 3), (2, 4), (3, 4)]);
        transports.follow_links(at(1_501), |low, _| low == 1);
        assert_eq!(dark(&transports), [(2, 3), (2, 4), (3, 4)]);
    }
}
