//! A vehicle in a simulated world, at the other end of a loopback stream.
//!
//! Frames are read as fast as they come and merged: after a pause of the process
//! only the newest state of everything waits, never a backlog of old percepts.

use crate::vehicle::{News, Tick, Vehicle};
use skein_link::frame::{Decoder, FrameError, Order, ToPeer, ToWorld, encode};
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::Notify;

/// How long the world may take to welcome a peer. It is on the same machine, but
/// may be starting dozens of processes on two cores.
const WELCOME_TIMEOUT: Duration = Duration::from_secs(10);

/// Orders that wait for the peer's loop; an operator does not type faster.
const MAX_ORDERS: usize = 16;

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

/// A vehicle in a simulated world.
#[derive(Debug)]
pub struct Simulated {
    waiting: Arc<Waiting>,
    writer: OwnedWriteHalf,
}

#[derive(Debug, Default)]
struct Waiting {
    state: Mutex<Merged>,
    filled: Notify,
}

#[derive(Debug, Default)]
struct Merged {
    tick: Option<Tick>,
    orders: VecDeque<Order>,
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
                let tick = self.tick.get_or_insert_default();
                tick.time_ms = time_ms;
                tick.scale = scale;
                tick.percept = percept.or(tick.percept);
                tick.links = links.or(tick.links.take());
            }
            ToPeer::Command(order) => {
                if self.orders.len() >= MAX_ORDERS {
                    self.orders.pop_front();
                }
                self.orders.push_back(order);
            }
            ToPeer::End => self.ended = true,
            ToPeer::Welcome { .. } => {}
        }
    }

    fn pop(&mut self) -> Option<News> {
        if let Some(order) = self.orders.pop_front() {
            return Some(News::Command(order));
        }
        // The end waits for nothing that was sensed before it.
        if self.ended {
            return Some(News::End);
        }
        self.tick.take().map(News::Tick)
    }
}

impl Simulated {
    /// Connects, says hello and waits for the welcome.
    ///
    /// # Errors
    /// When nobody is there, or answers otherwise.
    pub async fn join(address: SocketAddr, hello: ToWorld) -> Result<(Self, Welcome), StreamError> {
        let unreachable = |cause| StreamError::Unreachable { address, cause };
        let unwelcome = |cause: String| StreamError::Unwelcome { address, cause };
        let stream = TcpStream::connect(address).await.map_err(unreachable)?;
        stream.set_nodelay(true).map_err(unreachable)?;
        let (reader, mut writer) = stream.into_split();
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
        let waiting = Arc::new(Waiting::default());
        tokio::spawn(read_all(reader, decoder, Arc::clone(&waiting)));
        Ok((
            Self { waiting, writer },
            Welcome {
                seed,
                time_ms,
                scale,
            },
        ))
    }
}

impl Vehicle for Simulated {
    async fn next(&mut self) -> News {
        loop {
            let news = self
                .waiting
                .state
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .pop();
            if let Some(news) = news {
                return news;
            }
            self.waiting.filled.notified().await;
        }
    }

    async fn tell(&mut self, what: ToWorld) {
        match encode(&what) {
            // A broken stream ends the reader too, which then says so.
            Ok(bytes) => drop(self.writer.write_all(&bytes).await),
            Err(cause) => tracing::error!(%cause, "a frame for the world was not sent"),
        }
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

/// Reads until the stream ends, merging what the loop has not taken yet.
async fn read_all(reader: OwnedReadHalf, mut decoder: Decoder, waiting: Arc<Waiting>) {
    loop {
        let open = fill(&reader, &mut decoder).await;
        let mut state = waiting.state.lock().unwrap_or_else(PoisonError::into_inner);
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
        waiting.filled.notify_one();
        if ended {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::AsyncReadExt;
    use tokio::net::TcpListener;

    fn tick(time_ms: u64, links: Option<Vec<(u16, skein_link::LinkState)>>) -> ToPeer {
        ToPeer::Tick {
            time_ms,
            scale: 2.0,
            percept: None,
            links,
        }
    }

    fn hello() -> ToWorld {
        ToWorld::Hello {
            id: 1,
            pid: 2,
            token: "t".to_owned(),
            locator: "l".to_owned(),
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
                tick(100, Some(vec![])),
                tick(200, None),
                tick(300, None),
                ToPeer::Command(Order::Hold),
            ] {
                bytes.extend(encode(&frame).unwrap());
            }
            stream.write_all(&bytes).await.unwrap();
            let mut answer = [0; 4];
            stream.read_exact(&mut answer).await.unwrap();
            stream
        });
        let (mut vehicle, welcome) = Simulated::join(address, hello()).await.unwrap();
        assert_eq!(
            welcome,
            Welcome {
                seed: 5,
                time_ms: 0,
                scale: 2.0
            }
        );
        let stream = world.await.unwrap();
        let mut times = Vec::new();
        let mut links = None;
        let mut ordered = false;
        while times.last() != Some(&300) || !ordered {
            match vehicle.next().await {
                News::Tick(t) => {
                    times.push(t.time_ms);
                    links = t.links.or(links);
                }
                News::Command(order) => ordered = order == Order::Hold,
                News::End => panic!("too early"),
            }
        }
        assert_eq!(links, Some(vec![]), "merging kept the only table");
        drop(stream);
        assert_eq!(vehicle.next().await, News::End);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn nobody_there_is_an_error_that_names_the_place() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        drop(listener);
        let error = Simulated::join(address, hello()).await.unwrap_err();
        assert!(error.to_string().contains(&address.to_string()), "{error}");
    }
}
