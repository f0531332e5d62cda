//! A simulated vehicle in a simulated world, at the other end of one loopback stream:
//! the only file that knows the simulator's frames.
//!
//! Frames are read as fast as they come and merged: after a pause of the process
//! only the newest state of everything waits, never a backlog of old percepts. A
//! percept is given to nobody before the time at which it was sensed.

use crate::vehicle::Vehicle;
use crate::world::{News, Tick, World};
use serde::Serialize;
use skein_behaviors::{Percept, Setpoint};
use skein_link::RadioCounters;
use skein_link::frame::{Decoder, FrameError, ToPeer, ToWorld, encode};
use skein_peer::Report;
use skein_peer::witness::Witness;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::Notify;

/// Where a simulated world takes peers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SimulatorConfig {
    /// Where it listens.
    pub address: SocketAddr,
    /// Proves that this peer belongs to it.
    pub token: String,
}

/// What a peer says of itself when it joins a world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hello {
    /// Its number.
    pub id: u16,
    /// Where its transport listens.
    pub locator: String,
    /// Where it listens for an operator, if it does.
    pub console: Option<SocketAddr>,
}

/// How long the world may take to welcome a peer. It is on the same machine, but
/// may be starting dozens of processes on two cores.
const WELCOME_TIMEOUT: Duration = Duration::from_secs(10);

/// Why there is no stream.
#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    /// Nobody listens there, or the connection broke.
    #[error("the world at {address} cannot be reached: {cause}")]
    Unreachable {
        /// Where.
        address: SocketAddr,
        /// Why.
        cause: std::io::Error,
    },
    /// It did not answer as a world does.
    #[error("the world at {address} did not welcome this peer: {cause}")]
    Unwelcome {
        /// Where.
        address: SocketAddr,
        /// Why.
        cause: String,
    },
}

/// What the world said first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Welcome {
    /// Seed of the radio's draws.
    pub seed: u64,
    /// Scenario time, milliseconds.
    pub time_ms: u64,
    /// Scenario seconds per second of wall time.
    pub scale: f64,
}

/// What joining a world gives.
#[derive(Debug)]
pub struct Joined {
    /// The vehicle in it.
    pub vehicle: SimulatedVehicle,
    /// The world itself.
    pub world: SimulatedWorld,
    /// What it said first.
    pub welcome: Welcome,
}

/// A vehicle in a simulated world.
#[derive(Debug)]
pub struct SimulatedVehicle {
    shared: Arc<Shared>,
}

/// The world around it.
#[derive(Debug)]
pub struct SimulatedWorld {
    shared: Arc<Shared>,
}

/// Both ends of the stream, as vehicle and world use them.
#[derive(Debug)]
struct Shared {
    state: Mutex<Merged>,
    ticked: Notify,
    sensed: Notify,
    writer: tokio::sync::Mutex<OwnedWriteHalf>,
}

/// What was read and not taken yet.
#[derive(Debug, Default)]
struct Merged {
    tick: Option<Tick>,
    percept: Option<Percept>,
    ended: bool,
}

impl Merged {
    fn take(&mut self, frame: ToPeer) {
        match frame {
            ToPeer::Tick {
                time_ms,
                scale,
                percept,
                links,
            } => {
                let untold = self.tick.take().and_then(|t| t.links);
                let links = links.or(untold);
                self.tick = Some(Tick {
                    time_ms,
                    scale,
                    links,
                });
                self.percept = percept.or(self.percept);
            }
            ToPeer::End => self.ended = true,
            ToPeer::Welcome { .. } => {}
        }
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, Merged> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    async fn tell(&self, what: &ToWorld) {
        match encode(what) {
            // A broken stream ends the reader too, which then says so.
            Ok(bytes) => drop(self.writer.lock().await.write_all(&bytes).await),
            Err(cause) => tracing::error!(%cause, "a frame for the world was not sent"),
        }
    }

    /// Tells something of the peer's own crate, in a frame of its own.
    async fn say<T: Serialize>(&self, what: &T, frame: fn(Vec<u8>) -> ToWorld) {
        match cbor4ii::serde::to_vec(Vec::new(), what) {
            Ok(bytes) => self.tell(&frame(bytes)).await,
            Err(cause) => tracing::error!(%cause, "what the peer says was not sent"),
        }
    }
}

/// Connects, says hello and waits for the welcome.
///
/// # Errors
/// When nobody is there, or answers otherwise.
pub async fn join(config: &SimulatorConfig, hello: Hello) -> Result<Joined, StreamError> {
    let address = config.address;
    let unreachable = |cause| StreamError::Unreachable { address, cause };
    let unwelcome = |cause: String| StreamError::Unwelcome { address, cause };
    let stream = TcpStream::connect(address).await.map_err(unreachable)?;
    stream.set_nodelay(true).map_err(unreachable)?;
    let (reader, mut writer) = stream.into_split();
    let hello = ToWorld::Hello {
        id: hello.id,
        pid: std::process::id(),
        token: config.token.clone(),
        locator: hello.locator,
        console: hello.console.map(|at| at.to_string()),
    };
    let bytes = encode(&hello).map_err(|e| unwelcome(e.to_string()))?;
    writer.write_all(&bytes).await.map_err(unreachable)?;
    let mut decoder = Decoder::default();
    let first = tokio::time::timeout(WELCOME_TIMEOUT, first_frame(&reader, &mut decoder))
        .await
        .map_err(|_| unwelcome("no answer in time".to_owned()))?
        .map_err(unwelcome)?;
    let ToPeer::Welcome {
        seed,
        time_ms,
        scale,
    } = first
    else {
        return Err(unwelcome("its first frame is no welcome".to_owned()));
    };
    let shared = Arc::new(Shared {
        state: Mutex::default(),
        ticked: Notify::new(),
        sensed: Notify::new(),
        writer: tokio::sync::Mutex::new(writer),
    });
    tokio::spawn(read_all(reader, decoder, Arc::clone(&shared)));
    Ok(Joined {
        vehicle: SimulatedVehicle {
            shared: Arc::clone(&shared),
        },
        world: SimulatedWorld { shared },
        welcome: Welcome {
            seed,
            time_ms,
            scale,
        },
    })
}

impl Vehicle for SimulatedVehicle {
    async fn sense(&mut self) -> Percept {
        loop {
            {
                let mut state = self.shared.state();
                if state.tick.is_none()
                    && let Some(percept) = state.percept.take()
                {
                    return percept;
                }
            }
            self.shared.sensed.notified().await;
        }
    }

    async fn fly(&mut self, setpoint: Setpoint) {
        self.shared.tell(&ToWorld::Setpoint(setpoint)).await;
    }
}

impl World for SimulatedWorld {
    async fn next(&mut self) -> News {
        loop {
            {
                let mut state = self.shared.state();
                // The end waits for nothing that was sensed before it.
                if state.ended {
                    return News::End;
                }
                if let Some(tick) = state.tick.take() {
                    self.shared.sensed.notify_one();
                    return News::Tick(tick);
                }
            }
            self.shared.ticked.notified().await;
        }
    }

    async fn report(&mut self, report: &Report) {
        self.shared.say(report, ToWorld::Report).await;
    }

    fn judges(&self) -> bool {
        true
    }

    async fn witness(&mut self, witness: &Witness) {
        self.shared.say(witness, ToWorld::Witness).await;
    }

    async fn count(&mut self, counters: RadioCounters) {
        self.shared.tell(&ToWorld::Radio(counters)).await;
    }

    async fn leave(&mut self) {
        self.shared.tell(&ToWorld::Bye).await;
    }
}

async fn first_frame(reader: &OwnedReadHalf, decoder: &mut Decoder) -> Result<ToPeer, String> {
    loop {
        if let Some(frame) = decoder.pop().map_err(|e: FrameError| e.to_string())? {
            return Ok(frame);
        }
        if !fill(reader, decoder).await {
            return Err("it closed the stream".to_owned());
        }
    }
}

/// Waits for bytes and takes all there are; false at the end of the stream.
async fn fill(reader: &OwnedReadHalf, decoder: &mut Decoder) -> bool {
    if reader.readable().await.is_err() {
        return false;
    }
    let mut buffer = vec![0; 64 * 1024];
    loop {
        match reader.try_read(&mut buffer) {
            Ok(0) => return false,
            Ok(n) => {
                decoder.push(&buffer[..n]);
                if n < buffer.len() {
                    return true;
                }
            }
            Err(e) if e.kind() == std::io::ErrorKind::WouldBlock => return true,
            Err(_) => return false,
        }
    }
}

/// Reads until the stream ends, merging what was not taken yet.
async fn read_all(reader: OwnedReadHalf, mut decoder: Decoder, shared: Arc<Shared>) {
    loop {
        let open = fill(&reader, &mut decoder).await;
        let mut state = shared.state();
        loop {
            match decoder.pop() {
                Ok(Some(frame)) => state.take(frame),
                Ok(None) => break,
                Err(cause) => {
                    tracing::error!(%cause, "the world's stream cannot be read on");
                    state.ended = true;
                    break;
                }
            }
        }
        state.ended |= !open;
        let ended = state.ended;
        drop(state);
        shared.ticked.notify_one();
        if ended {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::percept;
    use skein_link::LinkNews;
    use tokio::io::AsyncReadExt;
    use tokio::net::TcpListener;

    fn tick(time_ms: u64, sensed: bool, links: Option<LinkNews>) -> ToPeer {
        ToPeer::Tick {
            time_ms,
            scale: 2.0,
            percept: sensed.then(|| percept(time_ms)),
            links,
        }
    }

    fn hello() -> Hello {
        Hello {
            id: 1,
            locator: "l".to_owned(),
            console: None,
        }
    }

    fn config(address: SocketAddr) -> SimulatorConfig {
        SimulatorConfig {
            address,
            token: "t".to_owned(),
        }
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_backlog_is_merged_and_the_end_is_seen() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let world = tokio::spawn(async move {
            let (mut stream, _) = listener.accept().await.unwrap();
            let welcome = ToPeer::Welcome {
                seed: 5,
                time_ms: 0,
                scale: 2.0,
            };
            let mut bytes = encode(&welcome).unwrap();
            for frame in [
                tick(100, true, Some(LinkNews::default())),
                tick(200, true, None),
                tick(300, false, None),
            ] {
                bytes.extend(encode(&frame).unwrap());
            }
            stream.write_all(&bytes).await.unwrap();
            let mut answer = [0; 4];
            stream.read_exact(&mut answer).await.unwrap();
            stream
        });
        let mut joined = join(&config(address), hello()).await.unwrap();
        let welcome = Welcome {
            seed: 5,
            time_ms: 0,
            scale: 2.0,
        };
        assert_eq!(joined.welcome, welcome);
        let stream = world.await.unwrap();
        let (mut times, mut links, mut sensed) = (Vec::new(), None, Vec::new());
        while times.last() != Some(&300) || sensed.is_empty() {
            tokio::select! {
                biased;
                sense = joined.vehicle.sense() => sensed.push((times.last().copied(), sense)),
                news = joined.world.next() => match news {
                    News::Tick(t) => {
                        times.push(t.time_ms);
                        links = t.links.or(links);
                    }
                    News::End => panic!("too early"),
                },
            }
        }
        assert_eq!(
            links,
            Some(LinkNews::default()),
            "merging kept the only table"
        );
        for (told, sense) in sensed {
            let at_ms = sense.time_ms;
            assert!(told.is_some_and(|t| t >= at_ms), "{told:?} before {at_ms}");
        }
        drop(stream);
        assert_eq!(joined.world.next().await, News::End);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn nobody_there_is_an_error_that_names_the_place() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        drop(listener);
        let error = join(&config(address), hello()).await.unwrap_err();
        assert!(error.to_string().contains(&address.to_string()), "{error}");
    }
}
