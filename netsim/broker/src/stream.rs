//! The world's end of the vehicle streams.
//!
//! One connection a peer. What the world says is merged while a peer does not read
//! (it may be paused), so that nothing piles up and nobody waits for it; what peers
//! say comes to the trial through one bounded queue.

use skein_behaviors::Percept;
use skein_link::LinkNews;
use skein_link::frame::{Decoder, Frame, ToPeer, ToWorld, encode};
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Notify, mpsc};

/// Frames of peers that wait for the trial: some twenty a peer and step of the world,
/// for 64 peers. A peer that finds it full waits.
const INBOX: usize = 2048;

/// How long a connection may take to say who it is.
const HELLO_TIMEOUT: Duration = Duration::from_secs(5);

/// Something that peers said.
#[derive(Debug)]
pub enum Heard {
    /// A peer's process is up.
    Hello {
        /// Its number.
        id: u16,
        /// Its process.
        pid: u32,
        /// Where its transport listens.
        locator: String,
        /// Where it listens for an operator, if it does.
        console: Option<String>,
        /// What is said to it goes here.
        line: Line,
    },
    /// A frame of a peer.
    Frame {
        /// Its number.
        id: u16,
        /// Its process.
        pid: u32,
        /// What it said.
        frame: ToWorld,
    },
    /// A peer's stream ended.
    Gone {
        /// Its number.
        id: u16,
        /// Its process.
        pid: u32,
    },
}

/// The world's end of all streams.
#[derive(Debug)]
pub struct Streams {
    address: SocketAddr,
    inbox: mpsc::Receiver<Heard>,
    task: tokio::task::JoinHandle<()>,
}

impl Streams {
    /// Listens; peers must know `token`.
    ///
    /// # Errors
    /// When no port can be had.
    pub async fn listen(token: String) -> std::io::Result<Self> {
        let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
        let address = listener.local_addr()?;
        let (heard, inbox) = mpsc::channel(INBOX);
        let task = tokio::spawn(async move {
            loop {
                match listener.accept().await {
                    Ok((stream, _)) => {
                        drop(tokio::spawn(serve(stream, token.clone(), heard.clone())))
                    }
                    Err(_) => tokio::time::sleep(Duration::from_millis(100)).await,
                }
            }
        });
        Ok(Self {
            address,
            inbox,
            task,
        })
    }

    /// Where peers find it.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The next thing that a peer said. Cancel-safe.
    pub async fn next(&mut self) -> Option<Heard> {
        self.inbox.recv().await
    }
}

impl Drop for Streams {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// The way to one peer.
#[derive(Clone, Debug)]
pub struct Line {
    waiting: Arc<Waiting>,
}

#[derive(Debug, Default)]
struct Waiting {
    state: Mutex<Unsaid>,
    filled: Notify,
}

/// What has not been said yet, the newest of each.
#[derive(Debug, Default)]
struct Unsaid {
    welcome: Option<ToPeer>,
    tick: Option<(u64, f64)>,
    percept: Option<Percept>,
    links: Option<LinkNews>,
    end: bool,
}

impl Unsaid {
    fn pop(&mut self) -> Option<ToPeer> {
        if let Some(welcome) = self.welcome.take() {
            return Some(welcome);
        }
        if let Some((time_ms, scale)) = self.tick.take() {
            let (percept, links) = (self.percept.take(), self.links.take());
            return Some(ToPeer::Tick {
                time_ms,
                scale,
                percept,
                links,
            });
        }
        std::mem::take(&mut self.end).then_some(ToPeer::End)
    }
}

impl Line {
    fn change(&self, change: impl FnOnce(&mut Unsaid)) {
        change(
            &mut self
                .waiting
                .state
                .lock()
                .unwrap_or_else(PoisonError::into_inner),
        );
        self.waiting.filled.notify_one();
    }

    /// Welcomes the peer; nothing goes out before.
    pub fn welcome(&self, seed: u64, time_ms: u64, scale: f64) {
        self.change(|u| {
            u.welcome = Some(ToPeer::Welcome {
                seed,
                time_ms,
                scale,
            })
        });
    }

    /// Time went on.
    pub fn tick(
        &self,
        time_ms: u64,
        scale: f64,
        percept: Option<Percept>,
        links: Option<LinkNews>,
    ) {
        self.change(|u| {
            u.tick = Some((time_ms, scale));
            u.percept = percept.or(u.percept);
            if links.is_some() {
                u.links = links;
            }
        });
    }

    /// It is over.
    pub fn end(&self) {
        self.change(|u| u.end = true);
    }
}

async fn serve(stream: TcpStream, token: String, heard: mpsc::Sender<Heard>) {
    if stream.set_nodelay(true).is_err() {
        return;
    }
    let (mut reader, writer) = stream.into_split();
    let mut decoder = Decoder::default();
    let hello = tokio::time::timeout(HELLO_TIMEOUT, next_frame(&mut reader, &mut decoder)).await;
    let Ok(Some(ToWorld::Hello {
        id,
        pid,
        token: said,
        locator,
        console,
    })) = hello
    else {
        tracing::warn!("a connection did not say hello");
        return;
    };
    if said != token {
        tracing::warn!(id, "a connection belongs to another trial");
        return;
    }
    let line = Line {
        waiting: Arc::new(Waiting::default()),
    };
    let says = tokio::spawn(say_all(writer, Arc::clone(&line.waiting)));
    if heard
        .send(Heard::Hello {
            id,
            pid,
            locator,
            console,
            line,
        })
        .await
        .is_ok()
    {
        while let Some(frame) = next_frame(&mut reader, &mut decoder).await {
            if heard.send(Heard::Frame { id, pid, frame }).await.is_err() {
                break;
            }
        }
    }
    says.abort();
    let _ = heard.send(Heard::Gone { id, pid }).await;
}

async fn next_frame<T: Frame>(reader: &mut OwnedReadHalf, decoder: &mut Decoder) -> Option<T> {
    let mut buffer = vec![0; 16 * 1024];
    loop {
        match decoder.pop() {
            Ok(Some(frame)) => return Some(frame),
            Ok(None) => {}
            Err(cause) => {
                tracing::warn!(%cause, "a peer's stream cannot be read on");
                return None;
            }
        }
        match reader.read(&mut buffer).await {
            Ok(0) | Err(_) => return None,
            Ok(n) => decoder.push(&buffer[..n]),
        }
    }
}

async fn say_all(mut writer: OwnedWriteHalf, waiting: Arc<Waiting>) {
    loop {
        let frame = waiting
            .state
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        let Some(frame) = frame else {
            waiting.filled.notified().await;
            continue;
        };
        match encode(&frame) {
            Ok(bytes) => {
                if writer.write_all(&bytes).await.is_err() {
                    return;
                }
            }
            Err(cause) => tracing::error!(%cause, "a frame for a peer was not sent"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hello(token: &str) -> ToWorld {
        ToWorld::Hello {
            id: 4,
            pid: 99,
            token: token.to_owned(),
            locator: "tcp/127.0.0.1:1".to_owned(),
            console: None,
        }
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_peer_that_does_not_read_gets_the_newest_of_all() {
        let unsaid = &mut Unsaid::default();
        let line = Line {
            waiting: Arc::new(Waiting::default()),
        };
        line.tick(100, 1.0, None, Some(LinkNews::default()));
        line.tick(200, 1.0, None, None);
        line.end();
        line.welcome(1, 0, 1.0);
        std::mem::swap(unsaid, &mut line.waiting.state.lock().unwrap());
        assert!(matches!(unsaid.pop(), Some(ToPeer::Welcome { .. })));
        let Some(ToPeer::Tick {
            time_ms: 200,
            links: Some(links),
            ..
        }) = unsaid.pop()
        else {
            panic!()
        };
        assert_eq!(links, LinkNews::default());
        assert_eq!(unsaid.pop(), Some(ToPeer::End));
        assert_eq!(unsaid.pop(), None);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_stranger_is_not_served() {
        let mut streams = Streams::listen("right".to_owned()).await.unwrap();
        let mut stranger = TcpStream::connect(streams.address()).await.unwrap();
        stranger
            .write_all(&encode(&hello("wrong")).unwrap())
            .await
            .unwrap();
        assert_eq!(stranger.read(&mut [0; 8]).await.unwrap_or(0), 0, "closed");
        let mut peer = TcpStream::connect(streams.address()).await.unwrap();
        peer.write_all(&encode(&hello("right")).unwrap())
            .await
            .unwrap();
        assert!(matches!(
            streams.next().await,
            Some(Heard::Hello { id: 4, pid: 99, .. })
        ));
        drop(peer);
        assert!(matches!(
            streams.next().await,
            Some(Heard::Gone { id: 4, pid: 99 })
        ));
    }
}
