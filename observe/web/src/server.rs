//! The routes of the page, and who may use them.

use crate::feed::{Feed, Word};
use crate::page::PAGE;
use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use futures_util::stream;
use skein_console::Token;
use skein_netsim::fault::Fault;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::fmt::Debug;
use std::future::Future;
use std::net::{Ipv4Addr, SocketAddr};
use std::pin::Pin;
use std::sync::Arc;
use tokio::net::TcpListener;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::task::JoinHandle;

/// Pages that may be open at once: one person has a few.
const MAX_STREAMS: usize = 16;

/// A fault takes some hundred bytes; a partition of 256 peers a thousand and a half.
const MAX_FAULT_BYTES: usize = 4096;

/// The header with the token.
const TOKEN_HEADER: &str = "x-skein-token";

/// What the document may do: run what stands in itself, and ask this server.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; \
    connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What became of a fault: lines for a person, or why not.
pub type Answer = Pin<Box<dyn Future<Output = Result<Vec<String>, String>> + Send>>;

/// Carries out what the buttons of a page ask for.
pub trait Faults: Debug + Send + Sync {
    /// Makes something go wrong, or puts it right.
    fn inject(&self, fault: Fault) -> Answer;
}

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// The port cannot be had.
    #[error(
        "no page: port {port} of 127.0.0.1 cannot be used ({cause}); choose another one with --web PORT, or none to take any that is free"
    )]
    Port {
        /// Which.
        port: u16,
        /// Why.
        cause: std::io::Error,
    },
    /// There is no token.
    #[error("no page: {0}")]
    Token(#[from] skein_console::TokenError),
}

#[derive(Clone, Debug)]
struct Shared {
    feed: Arc<Feed>,
    faults: Option<Arc<dyn Faults>>,
    token: Token,
    address: SocketAddr,
    streams: Arc<Semaphore>,
}

/// Serves a page until it is dropped.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    token: Option<Token>,
    task: JoinHandle<()>,
}

impl Server {
    /// Listens on a port of 127.0.0.1, or on any that is free where it is 0. Without `faults`
    /// the page has no buttons for them.
    ///
    /// # Errors
    /// When the port cannot be had, or there is no randomness for a token.
    pub async fn start(
        port: u16,
        feed: Arc<Feed>,
        faults: Option<Arc<dyn Faults>>,
    ) -> Result<Self, ServerError> {
        let failed = |cause| ServerError::Port { port, cause };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await;
        let listener = listener.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let token = Token::draw()?;
        let shown = faults.is_some().then(|| token.clone());
        let routes = routes(Shared {
            feed,
            faults,
            token,
            address,
            streams: Arc::new(Semaphore::new(MAX_STREAMS)),
        });
        let task = tokio::spawn(async move {
            if let Err(why) = axum::serve(listener, routes).await {
                tracing::error!(%why, "the page is served no more");
            }
        });
        Ok(Self {
            address,
            token: shown,
            task,
        })
    }

    /// What a person opens. The part behind `#` lets the page inject faults; browsers keep it
    /// to themselves.
    #[must_use]
    pub fn url(&self) -> String {
        match &self.token {
            Some(token) => format!("http://{}/#{}", self.address, token.secret()),
            None => format!("http://{}/", self.address),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.task.abort();
    }
}

fn routes(shared: Shared) -> Router {
    Router::new()
        .route("/", get(document))
        .route("/stream", get(words))
        .route("/fault", post(fault))
        .layer(DefaultBodyLimit::max(MAX_FAULT_BYTES))
        .layer(middleware::from_fn_with_state(shared.clone(), guard))
        .with_state(shared)
}

/// Whether a name is that of this server: `127.0.0.1:PORT` or `localhost:PORT`.
fn is_here(name: &str, address: SocketAddr) -> bool {
    let port = name.strip_prefix("127.0.0.1:");
    let port = port.or_else(|| name.strip_prefix("localhost:"));
    port == Some(&address.port().to_string())
}

fn text<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    headers.get(name).and_then(|v| v.to_str().ok())
}

/// Refuses whoever came here by another host's name, as a page does that had its own name point
/// to this machine.
async fn guard(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    let host = text(request.headers(), header::HOST.as_str());
    if !host.is_some_and(|name| is_here(name, shared.address)) {
        let why = "this page answers to 127.0.0.1 and localhost only\n";
        return (StatusCode::MISDIRECTED_REQUEST, why).into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
    ] {
        headers.insert(name, header::HeaderValue::from_static(value));
    }
    response
}

async fn document() -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], PAGE)
}

/// What one reader was sent.
struct Reader {
    feed: Arc<Feed>,
    follow: watch::Receiver<u64>,
    waiting: VecDeque<Word>,
    sent: u64,
    _place: OwnedSemaphorePermit,
}

impl Reader {
    /// The next word, as soon as there is one; none when the run's feed is gone.
    async fn next(&mut self) -> Option<Word> {
        loop {
            if let Some(word) = self.waiting.pop_front() {
                self.sent = word.number;
                return Some(word);
            }
            // What comes after this look wakes the wait below.
            self.follow.borrow_and_update();
            self.waiting = self.feed.after(self.sent).into();
            if self.waiting.is_empty() {
                self.follow.changed().await.ok()?;
            }
        }
    }
}

/// All words from the first one, or behind the last one that a browser has got before its
/// connection broke, and then whatever comes.
async fn words(State(shared): State<Shared>, headers: HeaderMap) -> Response {
    let Ok(place) = Arc::clone(&shared.streams).try_acquire_owned() else {
        let why = "too many pages are open; close one\n";
        return (StatusCode::SERVICE_UNAVAILABLE, why).into_response();
    };
    let follow = shared.feed.follow();
    let last = text(&headers, "last-event-id").and_then(|id| id.parse().ok());
    // A browser may still be open from another run at the same port.
    let known = last.filter(|last: &u64| *last <= *follow.borrow());
    let reader = Reader {
        follow,
        feed: shared.feed,
        waiting: VecDeque::new(),
        sent: known.unwrap_or(0),
        _place: place,
    };
    let words = stream::unfold(reader, |mut reader| async move {
        let word = reader.next().await?;
        let event = Event::default().id(word.number.to_string());
        let event = event.data(&*word.json);
        Some((Ok::<_, Infallible>(event), reader))
    });
    Sse::new(words)
        .keep_alive(KeepAlive::default())
        .into_response()
}

/// Injects a fault for a page of this server that knows the token.
async fn fault(State(shared): State<Shared>, headers: HeaderMap, body: Bytes) -> Response {
    let refused = |code: StatusCode, why: &str| {
        let answer = serde_json::json!({ "error": why });
        (code, answer.to_string()).into_response()
    };
    let origin = text(&headers, header::ORIGIN.as_str());
    let origin = origin.and_then(|o| o.strip_prefix("http://"));
    if !origin.is_some_and(|name| is_here(name, shared.address)) {
        return refused(StatusCode::FORBIDDEN, "only the page itself may ask");
    }
    if !text(&headers, TOKEN_HEADER).is_some_and(|said| shared.token.is(said)) {
        let why = "open the page by the address that was printed, with what stands behind the #";
        return refused(StatusCode::FORBIDDEN, why);
    }
    let Some(faults) = &shared.faults else {
        return refused(StatusCode::CONFLICT, "nothing flies here that could fail");
    };
    let fault: Fault = match serde_json::from_slice(&body) {
        Ok(fault) => fault,
        Err(why) => return refused(StatusCode::BAD_REQUEST, &format!("no fault: {why}")),
    };
    match faults.inject(fault).await {
        Ok(lines) => serde_json::json!({ "lines": lines })
            .to_string()
            .into_response(),
        Err(why) => refused(StatusCode::CONFLICT, &why),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::words::{Hello, Mode};
    use skein_recording::model::Knowledge;
    use std::sync::Mutex;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::TcpStream;

    /// Remembers what it was asked for.
    #[derive(Debug, Default)]
    struct Asked(Mutex<Vec<Fault>>);

    impl Faults for Asked {
        fn inject(&self, fault: Fault) -> Answer {
            let peer = fault.peers().first().copied();
            self.0.lock().unwrap().push(fault);
            Box::pin(async move {
                match peer {
                    Some(9) => Err("there is no peer 9".to_owned()),
                    _ => Ok(vec!["done".to_owned()]),
                }
            })
        }
    }

    struct Served {
        server: Server,
        asked: Arc<Asked>,
        feed: Arc<Feed>,
    }

    async fn served() -> Served {
        let feed = Feed::new(&Hello {
            mode: Mode::Trial,
            knowledge: Knowledge::World,
            title: "a trial".to_owned(),
            command: "skein trial --web".to_owned(),
        });
        let asked = Arc::new(Asked::default());
        let faults: Arc<dyn Faults> = Arc::<Asked>::clone(&asked);
        let server = Server::start(0, Arc::clone(&feed), Some(faults))
            .await
            .unwrap();
        Served {
            server,
            asked,
            feed,
        }
    }

    impl Served {
        /// Sends a request with these lines behind its first one, and reads until `enough`.
        async fn ask(&self, head: &str, body: &str, enough: &str) -> String {
            let mut stream = TcpStream::connect(self.server.address).await.unwrap();
            let length = body.len();
            let text = format!("{head}\r\ncontent-length: {length}\r\n\r\n{body}");
            stream.write_all(text.as_bytes()).await.unwrap();
            let mut answer = String::new();
            let mut bytes = [0; 4096];
            while !(answer.contains("\r\n\r\n") && answer.contains(enough)) {
                let read = tokio::time::timeout(
                    std::time::Duration::from_secs(10),
                    stream.read(&mut bytes),
                );
                let n = read.await.expect("an answer in time").unwrap();
                if n == 0 {
                    break;
                }
                answer.push_str(&String::from_utf8_lossy(&bytes[..n]));
            }
            answer
        }

        async fn post(&self, origin: &str, token: &str, body: &str) -> String {
            let at = self.server.address;
            let head = format!(
                "POST /fault HTTP/1.1\r\nhost: {at}\r\norigin: {origin}\r\nx-skein-token: {token}\r\nconnection: close"
            );
            self.ask(&head, body, "no end but the connection's").await
        }
    }

    #[tokio::test]
    async fn the_page_and_its_stream_are_served_to_this_machine() {
        let served = served().await;
        let at = served.server.address;
        let page = served
            .ask(&format!("GET / HTTP/1.1\r\nhost: {at}"), "", "</html>")
            .await;
        assert!(
            page.starts_with("HTTP/1.1 200") && page.contains("<canvas"),
            "{page}"
        );
        assert!(page.contains("content-security-policy: default-src 'none'"));
        served
            .feed
            .give(&skein_recording::Record::Scene(Box::default()));
        let stream = format!("GET /stream HTTP/1.1\r\nhost: localhost:{}", at.port());
        let words = served.ask(&stream, "", "\"k\":\"scene\"").await;
        assert!(
            words.contains("text/event-stream") && words.contains("id: 1"),
            "{words}"
        );
        // A browser that was cut off gets what it has not got.
        let again = format!("{stream}\r\nlast-event-id: 1");
        let words = served.ask(&again, "", "\"k\":\"scene\"").await;
        assert!(
            !words.contains("hello") && words.contains("id: 2"),
            "{words}"
        );
        // One of another program's run gets all of this one.
        let other = format!("{stream}\r\nlast-event-id: 99");
        let words = served.ask(&other, "", "\"k\":\"scene\"").await;
        assert!(words.contains("hello"), "{words}");
        let stranger = "GET / HTTP/1.1\r\nhost: evil.example\r\nconnection: close";
        let refused = served
            .ask(stranger, "", "no end but the connection's")
            .await;
        assert!(refused.starts_with("HTTP/1.1 421"), "{refused}");
    }

    #[tokio::test]
    async fn faults_need_the_pages_origin_and_its_token() {
        let served = served().await;
        let at = served.server.address;
        let (here, token) = (format!("http://{at}"), served.server.token.clone().unwrap());
        let (token, kill) = (token.secret().to_owned(), "{\"kind\":\"kill\",\"peer\":3}");
        for (origin, token, body, code) in [
            ("http://evil.example", token.as_str(), kill, "403"),
            ("null", token.as_str(), kill, "403"),
            (here.as_str(), "0123", kill, "403"),
            (here.as_str(), token.as_str(), "{\"kind\":\"burn\"}", "400"),
            (
                here.as_str(),
                token.as_str(),
                "{\"kind\":\"kill\",\"peer\":9}",
                "409",
            ),
            (
                here.as_str(),
                token.as_str(),
                &"x".repeat(MAX_FAULT_BYTES + 1),
                "413",
            ),
        ] {
            let answer = served.post(origin, token, body).await;
            assert!(
                answer.starts_with(&format!("HTTP/1.1 {code}")),
                "{origin}: {answer}"
            );
        }
        let get = format!("GET /fault HTTP/1.1\r\nhost: {at}\r\nconnection: close");
        let answer = served.ask(&get, "", "no end but the connection's").await;
        assert!(answer.starts_with("HTTP/1.1 405"), "{answer}");
        let answer = served.post(&here, &token, kill).await;
        assert!(
            answer.starts_with("HTTP/1.1 200") && answer.contains("done"),
            "{answer}"
        );
        let asked = served.asked.0.lock().unwrap();
        assert_eq!(
            asked[..],
            [Fault::Kill { peer: 9 }, Fault::Kill { peer: 3 }]
        );
    }

    #[tokio::test]
    async fn a_port_that_is_taken_is_told_with_a_remedy() {
        let served = served().await;
        let port = served.server.address.port();
        let taken = Server::start(port, Arc::clone(&served.feed), None)
            .await
            .unwrap_err();
        let text = taken.to_string();
        assert!(
            text.contains(&port.to_string()) && text.contains("--web PORT"),
            "{text}"
        );
        assert!(served.server.url().contains("/#"));
        let quiet = Server::start(0, Arc::clone(&served.feed), None)
            .await
            .unwrap();
        assert!(!quiet.url().contains('#'), "nothing flies that could fail");
    }
}
