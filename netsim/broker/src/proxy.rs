//! Loopback proxies between the transports of each pair of peers: a cut is silence, and so is
//! the end of a process.
//!
//! A proxy only carries or withholds bytes. What single messages suffer is decided
//! in the nodes' radio shims; a proxy goes dark when a link has been down for so
//! long that a transport must notice, and closes its connections afterwards if it
//! swallowed anything, because a stream with a hole cannot be healed. Where one end is gone
//! the other is left in the silence until its transport notices: over a radio no kernel says
//! goodbye for a computer that fell from the sky.

use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinHandle;

/// A connection that finds the link dark is held this long: a dialler gives up after
/// 1 s and tries again, so a longer hold would only collect dead sockets.
const HOLD: Duration = Duration::from_secs(2);

/// What a proxy does at present.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct State {
    target: Option<SocketAddr>,
    dark: bool,
}

/// The way from the peer with the lower number to the one with the higher.
#[derive(Debug)]
pub struct Proxy {
    address: SocketAddr,
    state: watch::Sender<State>,
    task: JoinHandle<()>,
}

impl Proxy {
    /// Listens on a port that the system chooses; carries nothing before it has a target.
    ///
    /// # Errors
    /// When no port can be had.
    pub async fn bind() -> std::io::Result<Self> {
        let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
        let address = listener.local_addr()?;
        let (state, seen) = watch::channel(State::default());
        let task = tokio::spawn(accept_all(listener, seen));
        Ok(Self {
            address,
            state,
            task,
        })
    }

    /// Where the dialling peer finds it.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sets where the other peer listens.
    pub fn lead_to(&self, target: SocketAddr) {
        self.state
            .send_if_modified(|s| s.target.replace(target) != Some(target));
    }

    /// Whether it is dark.
    #[must_use]
    pub fn is_dark(&self) -> bool {
        self.state.borrow().dark
    }

    /// Goes dark, or carries again.
    pub fn set_dark(&self, dark: bool) {
        self.state
            .send_if_modified(|s| std::mem::replace(&mut s.dark, dark) != dark);
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.task.abort();
    }
}

async fn accept_all(listener: TcpListener, state: watch::Receiver<State>) {
    let mut carried = tokio::task::JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, _)) => drop(carried.spawn(carry(stream, state.clone()))),
                Err(cause) => {
                    // Out of descriptors, most likely; others may free some.
                    tracing::warn!(%cause, "a proxy could not accept");
                    tokio::time::sleep(Duration::from_millis(100)).await;
                }
            },
            Some(_) = carried.join_next() => {}
        }
    }
}

async fn carry(dialler: TcpStream, mut state: watch::Receiver<State>) {
    let lit = state.wait_for(|s| !s.dark && s.target.is_some());
    let Ok(Ok(now)) = tokio::time::timeout(HOLD, lit).await.map(|r| r.map(|s| *s)) else {
        return;
    };
    let Some(target) = now.target else { return };
    let Ok(listener) = TcpStream::connect(target).await else {
        return;
    };
    if dialler.set_nodelay(true).is_err() || listener.set_nodelay(true).is_err() {
        return;
    }
    let (mut from_dialler, mut to_dialler) = dialler.into_split();
    let (mut from_listener, mut to_listener) = listener.into_split();
    let end = tokio::select! {
        end = pump(&mut from_dialler, &mut to_listener, state.clone()) => end,
        end = pump(&mut from_listener, &mut to_dialler, state) => end.back(),
    };
    match end {
        End::Hole => {}
        End::From => swallow(&mut from_listener).await,
        End::To => swallow(&mut from_dialler).await,
    }
}

/// Why a direction carries no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// Something was swallowed.
    Hole,
    /// Where it comes from is gone.
    From,
    /// Where it leads is gone.
    To,
}

impl End {
    /// The same, seen from the other direction.
    fn back(self) -> Self {
        match self {
            Self::Hole => Self::Hole,
            Self::From => Self::To,
            Self::To => Self::From,
        }
    }
}

/// Carries one direction until it ends or has a hole.
async fn pump(
    from: &mut OwnedReadHalf,
    to: &mut OwnedWriteHalf,
    mut state: watch::Receiver<State>,
) -> End {
    let mut buffer = vec![0; 16 * 1024];
    let mut swallowed = false;
    loop {
        tokio::select! {
            biased;
            changed = state.changed() => {
                if changed.is_err() || (swallowed && !state.borrow().dark) {
                    return End::Hole;
                }
            }
            read = from.read(&mut buffer) => match read {
                Ok(0) | Err(_) => return End::From,
                Ok(_) if state.borrow().dark => swallowed = true,
                Ok(n) => if to.write_all(&buffer[..n]).await.is_err() {
                    return End::To;
                },
            },
        }
    }
}

/// Hears somebody out to whom nobody answers any more.
async fn swallow(from: &mut OwnedReadHalf) {
    let mut buffer = vec![0; 16 * 1024];
    while matches!(from.read(&mut buffer).await, Ok(n) if n > 0) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An echo server, and a proxy that leads to it.
    async fn echo() -> (Proxy, JoinHandle<()>) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let proxy = Proxy::bind().await.unwrap();
        proxy.lead_to(listener.local_addr().unwrap());
        let server = tokio::spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                tokio::spawn(async move {
                    let (mut r, mut w) = stream.into_split();
                    let _ = tokio::io::copy(&mut r, &mut w).await;
                });
            }
        });
        (proxy, server)
    }

    async fn ask(stream: &mut TcpStream, byte: u8) -> Option<u8> {
        stream.write_all(&[byte]).await.ok()?;
        let mut answer = [0];
        let read = tokio::time::timeout(Duration::from_millis(300), stream.read_exact(&mut answer));
        read.await.ok()?.ok()?;
        Some(answer[0])
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn darkness_is_silence_and_a_hole_closes_the_stream() {
        let (proxy, server) = echo().await;
        let mut stream = TcpStream::connect(proxy.address()).await.unwrap();
        assert_eq!(ask(&mut stream, 7).await, Some(7));
        proxy.set_dark(true);
        assert_eq!(ask(&mut stream, 8).await, None);
        proxy.set_dark(false);
        let mut rest = Vec::new();
        let end = tokio::time::timeout(Duration::from_secs(5), stream.read_to_end(&mut rest)).await;
        assert!(
            end.is_ok() && rest.is_empty(),
            "closed, and nothing came late"
        );
        let mut again = TcpStream::connect(proxy.address()).await.unwrap();
        assert_eq!(ask(&mut again, 9).await, Some(9));
        server.abort();
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_dark_spell_in_which_nothing_was_said_closes_nothing() {
        let (proxy, server) = echo().await;
        let mut stream = TcpStream::connect(proxy.address()).await.unwrap();
        assert_eq!(ask(&mut stream, 1).await, Some(1));
        proxy.set_dark(true);
        proxy.set_dark(false);
        assert_eq!(ask(&mut stream, 2).await, Some(2));
        server.abort();
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_dial_into_the_dark_gets_through_when_it_ends() {
        let (proxy, server) = echo().await;
        proxy.set_dark(true);
        let mut stream = TcpStream::connect(proxy.address()).await.unwrap();
        assert_eq!(ask(&mut stream, 3).await, None);
        proxy.set_dark(false);
        let mut answer = [0];
        stream.read_exact(&mut answer).await.unwrap();
        assert_eq!(answer, [3]);
        server.abort();
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn who_is_gone_is_silent() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let proxy = Proxy::bind().await.unwrap();
        proxy.lead_to(listener.local_addr().unwrap());
        for dialler_is_gone in [true, false] {
            let mut one = TcpStream::connect(proxy.address()).await.unwrap();
            let (mut other, _) = listener.accept().await.unwrap();
            one.write_all(&[5]).await.unwrap();
            assert_eq!(other.read_u8().await.unwrap(), 5);
            if dialler_is_gone {
                std::mem::swap(&mut one, &mut other);
            }
            drop(other);
            // Neither an end nor an error, as long as it waits and whatever it says.
            for _ in 0..3 {
                assert_eq!(ask(&mut one, 6).await, None);
            }
            let waits = tokio::time::timeout(Duration::from_millis(50), one.read_u8()).await;
            assert!(waits.is_err(), "{waits:?}");
        }
    }
}
