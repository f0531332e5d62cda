//! The bus: the only file that knows Zenoh (D2.7 §1.5.1: messages between
//! neighbours, one hop at a time).
//!
//! A session in mode `peer` with links only where it was told to; scouting and
//! automatic connections are off, because peers relay records themselves and every
//! other path would bypass the radio. [`refuse_non_loopback`] looks at the effective
//! configuration before anything is opened. Which messages the air lets through is
//! the radio's business, what they mean the peer's.

use crate::radio::Hop;
use crate::transport::{Event, Transport};
use skein_link::medium::key_hash;
use skein_peer::Priority;
use skein_peer::wire::key::VERSION;
use skein_peer::wire::schema;
use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::Notify;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::key_expr::KeyExpr;
use zenoh::qos::CongestionControl;
use zenoh::sample::{Locality, Sample, SampleKind};

/// Messages that wait for the peer's loop. At 64 kbit/s a second of the whole
/// channel is some 200 messages; a loop that is further behind is better off with
/// the newest.
const INBOX: usize = 512;

/// How long closing a session may take before the process just ends.
const CLOSE_TIMEOUT: Duration = Duration::from_millis(500);

/// How long an observer's first connection may take: "no peer" must be told within 2 s.
const OBSERVER_CONNECT_MS: u64 = 1_500;

/// The key prefix of Zenoh identifiers: peer 3 is `5ce10003`, so that logs of the
/// transport can be read.
const ZID_PREFIX: u32 = 0x5ce1;

/// What the bus needs to know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusConfig {
    /// The peer's number.
    pub id: u16,
    /// First part of every key.
    pub fleet: String,
    /// Where to listen, as `tcp/127.0.0.1:PORT`; port 0 lets the system choose.
    pub listen: String,
    /// Where to connect to, as `tcp/127.0.0.1:PORT` each, again and again until it works.
    pub links: Vec<String>,
    /// A neighbour silent for this long is believed gone by the transport, milliseconds.
    pub lease_ms: u32,
}

/// Why there is no bus.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The configuration would let packets leave this machine.
    #[error(
        "{0}: refused, nothing may listen or connect beyond 127.0.0.1; write tcp/127.0.0.1:PORT"
    )]
    NotLoopback(String),
    /// Zenoh does not understand its configuration.
    #[error("transport configuration {key}: {cause}")]
    Configuration {
        /// The part that is wrong.
        key: String,
        /// Why.
        cause: String,
    },
    /// The session cannot be opened.
    #[error("the transport cannot be opened on {listen}: {cause}")]
    Open {
        /// Where it was to listen.
        listen: String,
        /// Why.
        cause: String,
    },
    /// Another process listens there.
    #[error("{0} is in use by another process; take another port, or 0 for any")]
    InUse(String),
    /// Nobody answers where an observer is to connect.
    #[error("no peer answers at {endpoint}: {cause}")]
    NoPeer {
        /// Where.
        endpoint: String,
        /// Why.
        cause: String,
    },
}

/// A queue that drops the oldest when it is full, and counts.
#[derive(Debug, Default)]
struct Inbox {
    state: Mutex<(VecDeque<Event>, u64)>,
    filled: Notify,
}

impl Inbox {
    fn push(&self, event: Event) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.0.len() >= INBOX {
            state.0.pop_front();
            state.1 += 1;
        }
        state.0.push_back(event);
        drop(state);
        self.filled.notify_one();
    }

    fn pop(&self) -> Option<Event> {
        self.state
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .0
            .pop_front()
    }

    fn overrun(&self) -> u64 {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).1
    }
}

/// One peer's single-hop links.
#[derive(Debug)]
pub struct Bus {
    session: zenoh::Session,
    locator: String,
    inbox: Arc<Inbox>,
}

impl Bus {
    /// Opens the session and listens; links are made and remade in the background.
    ///
    /// # Errors
    /// When the configuration reaches beyond this machine or cannot be opened.
    pub async fn open(config: &BusConfig) -> Result<Self, BusError> {
        let effective = effective_config(config)?;
        refuse_non_loopback(&effective)?;
        refuse_used_port(&config.listen)?;
        let open = |cause: zenoh::Error| BusError::Open {
            listen: config.listen.clone(),
            cause: cause.to_string(),
        };
        let session = zenoh::open(effective).await.map_err(open)?;
        let inbox = Arc::new(Inbox::default());
        let heard = Arc::clone(&inbox);
        session
            .declare_subscriber(format!("{}/**", config.fleet))
            .callback(move |sample| heard.push(event_of(&sample)))
            .allowed_origin(Locality::Remote)
            .background()
            .await
            .map_err(open)?;
        let linked = Arc::clone(&inbox);
        session
            .info()
            .transport_events_listener()
            .history(true)
            .callback(move |event| {
                if let Some(neighbour) = peer_of(&event.transport().zid().to_string()) {
                    linked.push(Event::Link {
                        neighbour,
                        up: event.kind() == SampleKind::Put,
                    });
                }
            })
            .background()
            .await
            .map_err(open)?;
        let locators = session.info().locators().await;
        let locator = locators
            .first()
            .map(ToString::to_string)
            .ok_or_else(|| BusError::Open {
                listen: config.listen.clone(),
                cause: "it listens nowhere".to_owned(),
            })?;
        Ok(Self {
            session,
            locator,
            inbox,
        })
    }

    /// Answers queries for `FLEET/v4/schema/KIND` with the JSON Schema of the bodies of that
    /// kind, and for `FLEET/v4/schema/record` with that of the array around them, so that an
    /// observer in any language needs no source of ours.
    ///
    /// # Errors
    /// When Zenoh refuses the keys.
    pub async fn serve_schemas(&self, fleet: &str) -> Result<(), BusError> {
        let prefix = format!("{fleet}/{VERSION}/schema");
        let answers: Vec<(KeyExpr<'static>, String)> = schema::all()
            .filter_map(|(name, text)| {
                let key = KeyExpr::try_from(format!("{prefix}/{name}")).ok()?;
                Some((key, text))
            })
            .collect();
        let refused = |cause: zenoh::Error| BusError::Configuration {
            key: prefix.clone(),
            cause: cause.to_string(),
        };
        self.session
            .declare_queryable(format!("{prefix}/*"))
            .callback(move |query| {
                for (key, text) in &answers {
                    if !query.key_expr().intersects(key) {
                        continue;
                    }
                    let reply = query
                        .reply(key, text.as_str())
                        .encoding(Encoding::APPLICATION_JSON);
                    if let Err(cause) = reply.wait() {
                        tracing::debug!(%key, %cause, "a schema was not sent");
                    }
                }
            })
            .background()
            .await
            .map_err(refused)
    }

    /// Where it listens, with the port that the system chose.
    #[must_use]
    pub fn locator(&self) -> &str {
        &self.locator
    }
}

impl Transport for Bus {
    /// A message that finds a full queue is dropped there: what is late on the air is
    /// worth nothing.
    async fn publish(&mut self, key: &str, bytes: Vec<u8>, hop: Hop, priority: Priority) {
        let put = self
            .session
            .put(key, bytes)
            .encoding(Encoding::APPLICATION_CBOR)
            .attachment(attachment(hop))
            .congestion_control(CongestionControl::Drop)
            .priority(zenoh_priority(priority))
            .await;
        if let Err(cause) = put {
            tracing::warn!(key, %cause, "a transmission failed; the record stays with the relay");
        }
    }

    async fn next(&mut self) -> Event {
        loop {
            if let Some(event) = self.inbox.pop() {
                return event;
            }
            self.inbox.filled.notified().await;
        }
    }

    fn overrun(&self) -> u64 {
        self.inbox.overrun()
    }

    async fn close(self) {
        if tokio::time::timeout(CLOSE_TIMEOUT, self.session.close())
            .await
            .is_err()
        {
            tracing::debug!("the session did not close in time");
        }
    }
}

/// What an observer sees of one transmission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Observed {
    /// The natural key.
    pub key: String,
    /// The record.
    pub bytes: Vec<u8>,
    /// How it came.
    pub hop: Option<Hop>,
}

/// A client of one peer, which sees what that peer hears and says.
#[derive(Debug)]
pub struct Observer {
    session: zenoh::Session,
    seen: tokio::sync::mpsc::Receiver<Observed>,
}

impl Observer {
    /// Connects to the peer at `endpoint` and subscribes to `key_expression`.
    ///
    /// # Errors
    /// Within 2 s, when nobody answers there or the expression is malformed.
    pub async fn open(endpoint: &str, key_expression: &str) -> Result<Self, BusError> {
        loopback_address(endpoint)?;
        let effective = observer_config(endpoint)?;
        refuse_non_loopback(&effective)?;
        let failed = |cause: String| BusError::NoPeer {
            endpoint: endpoint.to_owned(),
            cause: without_source(&cause),
        };
        let limit = Duration::from_millis(OBSERVER_CONNECT_MS);
        let session = match tokio::time::timeout(limit, zenoh::open(effective)).await {
            Ok(Ok(session)) => session,
            Ok(Err(cause)) => return Err(failed(cause.to_string())),
            Err(_) => return Err(failed("no answer in time".to_owned())),
        };
        let (sender, seen) = tokio::sync::mpsc::channel(INBOX);
        session
            .declare_subscriber(key_expression.to_owned())
            .callback(move |sample| {
                let observed = Observed {
                    key: sample.key_expr().to_string(),
                    bytes: sample.payload().to_bytes().into_owned(),
                    hop: hop_of(&sample),
                };
                // An observer that cannot keep up misses some; the swarm must not wait.
                let _ = sender.try_send(observed);
            })
            .background()
            .await
            .map_err(|cause| BusError::Configuration {
                key: key_expression.to_owned(),
                cause: cause.to_string(),
            })?;
        Ok(Self { session, seen })
    }

    /// The next transmission; `None` when the session has ended.
    pub async fn next(&mut self) -> Option<Observed> {
        self.seen.recv().await
    }

    /// Whether the session is linked to a peer at present.
    pub async fn linked(&self) -> bool {
        self.session.info().transports().await.next().is_some()
    }

    /// What answers a query within so long, by key.
    ///
    /// # Errors
    /// When the expression is malformed.
    pub async fn ask(
        &self,
        key_expression: &str,
        within: Duration,
    ) -> Result<Vec<(String, Vec<u8>)>, BusError> {
        let replies = self.session.get(key_expression).timeout(within).await;
        let replies = replies.map_err(|cause| BusError::Configuration {
            key: key_expression.to_owned(),
            cause: cause.to_string(),
        })?;
        let mut all = Vec::new();
        while let Ok(reply) = replies.recv_async().await {
            if let Ok(sample) = reply.result() {
                let bytes = sample.payload().to_bytes().into_owned();
                all.push((sample.key_expr().to_string(), bytes));
            }
        }
        Ok(all)
    }

    /// Leaves.
    pub async fn close(self) {
        let _ = tokio::time::timeout(CLOSE_TIMEOUT, self.session.close()).await;
    }
}

/// The whole configuration of a peer's session.
///
/// # Errors
/// When Zenoh refuses a value.
pub fn effective_config(config: &BusConfig) -> Result<zenoh::Config, BusError> {
    let quoted = |s: &String| format!("\"{}\"", s.escape_default());
    let links: Vec<String> = config.links.iter().map(quoted).collect();
    let lease_ms = config.lease_ms.max(1);
    build(&[
        ("mode", "\"peer\"".to_owned()),
        ("id", format!("\"{}\"", zid(config.id))),
        ("listen/endpoints", format!("[{}]", quoted(&config.listen))),
        ("listen/exit_on_failure", "true".to_owned()),
        ("connect/endpoints", format!("[{}]", links.join(","))),
        ("connect/exit_on_failure", "false".to_owned()),
        (
            "connect/retry",
            // Whoever is patient with a link that is there is patient with one that is not.
            format!(
                "{{period_init_ms: 100, period_max_ms: {lease_ms}, period_increase_factor: 1.5}}"
            ),
        ),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "true".to_owned()),
        ("scouting/gossip/multihop", "false".to_owned()),
        ("scouting/gossip/autoconnect", "[]".to_owned()),
        // Nobody needs to be there when a peer starts.
        ("open/return_conditions/connect_scouted", "false".to_owned()),
        ("open/return_conditions/declares", "false".to_owned()),
        ("timestamping/enabled", "true".to_owned()),
        ("transport/unicast/open_timeout", "1000".to_owned()),
        ("transport/unicast/accept_timeout", "1000".to_owned()),
        ("transport/link/tx/lease", lease_ms.to_string()),
        ("transport/link/tx/keep_alive", "4".to_owned()),
        ("adminspace/enabled", "false".to_owned()),
    ])
}

/// The whole configuration of an observer's session.
fn observer_config(endpoint: &str) -> Result<zenoh::Config, BusError> {
    build(&[
        ("mode", "\"client\"".to_owned()),
        ("listen/endpoints", "[]".to_owned()),
        (
            "connect/endpoints",
            format!("[\"{}\"]", endpoint.escape_default()),
        ),
        ("connect/timeout_ms", OBSERVER_CONNECT_MS.to_string()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        ("transport/unicast/open_timeout", "1000".to_owned()),
    ])
}

fn build(values: &[(&str, String)]) -> Result<zenoh::Config, BusError> {
    let mut config = zenoh::Config::default();
    for (key, value) in values {
        config
            .insert_json5(key, value)
            .map_err(|cause| BusError::Configuration {
                key: format!("{key} = {value}"),
                cause: cause.to_string(),
            })?;
    }
    Ok(config)
}

/// Refuses a configuration that scouts, connects by itself, or names an address
/// other than 127.0.0.1.
///
/// # Errors
/// [`BusError::NotLoopback`] with the part that reaches out.
pub fn refuse_non_loopback(config: &zenoh::Config) -> Result<(), BusError> {
    let read = |key: &str| {
        config
            .get_json(key)
            .map_err(|cause| BusError::Configuration {
                key: key.to_owned(),
                cause: cause.to_string(),
            })
    };
    let mode: String = parse("mode", &read("mode")?)?;
    if read("scouting/multicast/enabled")? != "false" {
        return Err(BusError::NotLoopback("multicast scouting".to_owned()));
    }
    if mode != "client" {
        let autoconnect: serde_json::Value =
            parse("autoconnect", &read("scouting/gossip/autoconnect")?)?;
        if autoconnect != serde_json::json!([]) {
            return Err(BusError::NotLoopback(
                "connecting to whom gossip names".to_owned(),
            ));
        }
    }
    for key in ["listen/endpoints", "connect/endpoints"] {
        let json = read(key)?;
        let endpoints: Vec<String> = serde_json::from_str(&json)
            .map_err(|_| BusError::NotLoopback(format!("{key} = {json}")))?;
        // Without any, a session that is no client listens on every interface.
        if endpoints.is_empty() && key == "listen/endpoints" && mode != "client" {
            return Err(BusError::NotLoopback(
                "listening on the default interfaces".to_owned(),
            ));
        }
        for endpoint in &endpoints {
            loopback_address(endpoint)?;
        }
    }
    Ok(())
}

/// What the transport says, without the lines of its own source that it names.
fn without_source(cause: &str) -> String {
    let plain = cause.split(" at /").next().unwrap_or(cause);
    plain.trim_end_matches('.').to_owned()
}

/// The address of an endpoint, which must be `tcp/127.0.0.1:PORT` and nothing more.
///
/// # Errors
/// When it is anything else.
pub fn loopback_address(endpoint: &str) -> Result<SocketAddr, BusError> {
    let address = endpoint
        .strip_prefix("tcp/")
        .and_then(|a| a.parse::<SocketAddr>().ok());
    match address {
        Some(a) if a.ip() == IpAddr::from([127, 0, 0, 1]) => Ok(a),
        _ => Err(BusError::NotLoopback(format!("endpoint {endpoint}"))),
    }
}

/// A fixed port that is taken is a fault of the configuration; say so in its words.
fn refuse_used_port(listen: &str) -> Result<(), BusError> {
    let address = loopback_address(listen)?;
    if address.port() != 0 && std::net::TcpListener::bind(address).is_err() {
        return Err(BusError::InUse(listen.to_owned()));
    }
    Ok(())
}

fn parse<T: serde::de::DeserializeOwned>(key: &str, json: &str) -> Result<T, BusError> {
    serde_json::from_str(json).map_err(|cause| BusError::Configuration {
        key: key.to_owned(),
        cause: cause.to_string(),
    })
}

fn zid(id: u16) -> String {
    format!("{ZID_PREFIX:x}{id:04x}")
}

fn peer_of(zid: &str) -> Option<u16> {
    let rest = zid.strip_prefix(&format!("{ZID_PREFIX:x}"))?;
    if rest.len() == 4 {
        u16::from_str_radix(rest, 16).ok()
    } else {
        None
    }
}

fn zenoh_priority(priority: Priority) -> zenoh::qos::Priority {
    match priority {
        Priority::Conflict => zenoh::qos::Priority::RealTime,
        Priority::Claim => zenoh::qos::Priority::InteractiveHigh,
        Priority::Beacon => zenoh::qos::Priority::DataHigh,
        Priority::Telemetry => zenoh::qos::Priority::DataLow,
    }
}

/// What the attachment holds, as a CBOR array: transmitter, transmission number, hops,
/// time of handing over in milliseconds, priority, lifetime in milliseconds.
type Attached = (u16, u64, u8, u64, u8, u32);

fn attachment(hop: Hop) -> Vec<u8> {
    let parts: Attached = (
        hop.transmitter,
        hop.number,
        hop.hops,
        hop.at_ms,
        hop.priority,
        hop.lifetime_ms,
    );
    // Writing integers to memory cannot fail; an empty attachment is refused by all.
    cbor4ii::serde::to_vec(Vec::with_capacity(32), &parts).unwrap_or_default()
}

fn hop_of(sample: &Sample) -> Option<Hop> {
    let bytes = sample.attachment()?.to_bytes();
    let (transmitter, number, hops, at_ms, priority, lifetime_ms) =
        cbor4ii::serde::from_slice::<Attached>(&bytes).ok()?;
    Some(Hop {
        transmitter,
        number,
        hops,
        at_ms,
        priority,
        lifetime_ms,
    })
}

fn event_of(sample: &Sample) -> Event {
    Event::Heard {
        hop: hop_of(sample),
        key: key_hash(sample.key_expr().as_str()),
        bytes: sample.payload().to_bytes().into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_peer::wire::kinds::Kind;
    use skein_peer::wire::schema::{envelope_schema, schema};

    fn config(id: u16, links: Vec<String>) -> BusConfig {
        BusConfig {
            id,
            fleet: "bus-test".to_owned(),
            listen: "tcp/127.0.0.1:0".to_owned(),
            links,
            lease_ms: 500,
        }
    }

    #[test]
    fn the_effective_configuration_stays_on_this_machine() {
        let effective =
            effective_config(&config(3, vec!["tcp/127.0.0.1:4000".to_owned()])).unwrap();
        refuse_non_loopback(&effective).unwrap();
        assert_eq!(
            effective.get_json("scouting/multicast/enabled").unwrap(),
            "false"
        );
        assert_eq!(
            effective.get_json("scouting/gossip/autoconnect").unwrap(),
            "[]"
        );
        assert_eq!(
            effective.get_json("listen/endpoints").unwrap(),
            "[\"tcp/127.0.0.1:0\"]"
        );
        assert_eq!(
            effective.get_json("connect/endpoints").unwrap(),
            "[\"tcp/127.0.0.1:4000\"]"
        );
        refuse_non_loopback(&observer_config("tcp/127.0.0.1:4000").unwrap()).unwrap();
    }

    #[test]
    fn whatever_reaches_out_is_refused() {
        assert!(refuse_non_loopback(&zenoh::Config::default()).is_err());
        for endpoint in [
            "tcp/0.0.0.0:0",
            "tcp/[::]:0",
            "tcp/10.0.0.1:1",
            "udp/127.0.0.1:1",
            "tcp/127.0.0.1:1#iface=eth0",
        ] {
            let listen = BusConfig {
                listen: endpoint.to_owned(),
                ..config(1, vec![])
            };
            assert!(
                refuse_non_loopback(&effective_config(&listen).unwrap()).is_err(),
                "{endpoint}"
            );
            let connect = effective_config(&config(1, vec![endpoint.to_owned()])).unwrap();
            assert!(refuse_non_loopback(&connect).is_err(), "{endpoint}");
        }
        for (key, value) in [
            ("scouting/multicast/enabled", "true"),
            ("scouting/gossip/autoconnect", "[\"peer\"]"),
            ("listen/endpoints", "[]"),
        ] {
            let mut open = effective_config(&config(1, vec![])).unwrap();
            open.insert_json5(key, value).unwrap();
            assert!(refuse_non_loopback(&open).is_err(), "{key}");
        }
    }

    #[test]
    fn identifiers_name_the_peer() {
        for id in [0, 1, 0x0a00, u16::MAX] {
            assert_eq!(peer_of(&zid(id)), Some(id));
        }
        assert_eq!(peer_of("5ce1"), None);
        assert_eq!(peer_of("c0ffee"), None);
    }

    #[test]
    fn a_full_inbox_drops_the_oldest_and_counts() {
        let inbox = Inbox::default();
        for n in 0..=u16::try_from(INBOX).unwrap() {
            inbox.push(Event::Link {
                neighbour: n,
                up: true,
            });
        }
        assert_eq!(inbox.overrun(), 1);
        assert_eq!(
            inbox.pop(),
            Some(Event::Link {
                neighbour: 1,
                up: true
            })
        );
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_fixed_port_in_use_is_named() {
        let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let listen = format!("tcp/{}", taken.local_addr().unwrap());
        let error = Bus::open(&BusConfig {
            listen: listen.clone(),
            ..config(1, vec![])
        })
        .await
        .unwrap_err();
        assert!(
            matches!(&error, BusError::InUse(l) if *l == listen),
            "{error}"
        );
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn neighbours_hear_each_other_and_nobody_hears_himself() {
        let deadline = Duration::from_secs(20);
        let mut b = Bus::open(&config(2, vec![])).await.unwrap();
        let mut a = Bus::open(&config(1, vec![b.locator().to_owned()]))
            .await
            .unwrap();
        let mut observer = Observer::open(b.locator(), "bus-test/**").await.unwrap();
        assert!(observer.linked().await);
        let hop = Hop {
            transmitter: 1,
            number: 77,
            hops: 3,
            at_ms: 1_234,
            priority: 2,
            lifetime_ms: 500,
        };
        let speak = async {
            loop {
                a.publish("bus-test/v4/state/0/1", vec![9, 9], hop, Priority::Beacon)
                    .await;
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
        };
        let hear = async {
            loop {
                if let Event::Heard { hop, bytes, .. } = b.next().await {
                    return (hop, bytes);
                }
            }
        };
        let heard = tokio::time::timeout(deadline, async {
            tokio::select! { heard = hear => heard, () = speak => unreachable!() }
        });
        assert_eq!(heard.await.unwrap(), (Some(hop), vec![9, 9]));
        let seen = tokio::time::timeout(deadline, async {
            let speak = async {
                loop {
                    b.publish("bus-test/v4/state/0/2", vec![4], hop, Priority::Claim)
                        .await;
                    tokio::time::sleep(Duration::from_millis(50)).await;
                }
            };
            tokio::select! { seen = observer.next() => seen, () = speak => unreachable!() }
        });
        assert_eq!(seen.await.unwrap().unwrap().hop, Some(hop));
        // Whatever `a` heard came from `b`, never from itself.
        while let Some(event) = a.inbox.pop() {
            assert!(!matches!(event, Event::Heard { bytes, .. } if bytes == [9, 9]));
        }
        observer.close().await;
        a.close().await;
        b.close().await;
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn an_observer_is_told_what_records_look_like() {
        let bus = Bus::open(&config(9, vec![])).await.unwrap();
        bus.serve_schemas("t").await.unwrap();
        let observer = Observer::open(bus.locator(), "t/**").await.unwrap();
        let within = Duration::from_secs(5);
        let all = observer.ask("t/v4/schema/*", within).await.unwrap();
        for kind in Kind::ALL {
            let key = format!("t/v4/schema/{}", kind.name());
            let told = all.iter().find(|(k, _)| *k == key);
            let told = told.map(|(_, text)| String::from_utf8(text.clone()).unwrap());
            assert_eq!(told, schema(kind), "{key}");
        }
        let one = observer.ask("t/v4/schema/record", within).await.unwrap();
        let record = (
            "t/v4/schema/record".to_owned(),
            envelope_schema().into_bytes(),
        );
        assert_eq!(one, [record]);
        let none = observer.ask("t/v4/schema/rumour", within).await.unwrap();
        assert!(none.is_empty(), "{none:?}");
        observer.close().await;
        bus.close().await;
    }
}
