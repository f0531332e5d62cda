//! The port: listening, and asking.

use crate::token::{MAX_TOKEN_CHARS, Token};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::tcp::{ReadHalf, WriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc, oneshot};

/// The longest line, bytes: the largest mission that can be spoken is 64 KiB of CBOR,
/// and its JSON is about twice as long.
pub const MAX_LINE_BYTES: usize = 256 * 1024;

/// How long a client may take to say a line, and to take its answer.
const LINE_TIMEOUT: Duration = Duration::from_secs(10);

/// How long an answer may take: a mission is judged before it is spoken, which takes a
/// busy machine some seconds.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(60);

/// Connections served at once; others wait for their turn. People do not type faster.
const MAX_CONNECTIONS: usize = 8;

/// Requests that wait for the program.
const INBOX: usize = 16;

/// What a program answers: lines for a person, or why it did nothing.
pub type Answer = Result<Vec<String>, String>;

/// A request and where its answer goes.
#[derive(Debug)]
pub struct Asked<R> {
    /// What is wanted.
    pub request: R,
    /// Where the answer goes.
    pub answer: oneshot::Sender<Answer>,
}

/// The open port of a running program.
#[derive(Debug)]
pub struct Port<R> {
    address: SocketAddr,
    inbox: mpsc::Receiver<Asked<R>>,
    task: tokio::task::JoinHandle<()>,
}

impl<R: DeserializeOwned + Send + 'static> Port<R> {
    /// Listens on 127.0.0.1 at the given number, 0 for any that is free; requests must
    /// carry `token`.
    ///
    /// # Errors
    /// When the port cannot be had.
    pub async fn listen(number: u16, token: Token) -> std::io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, number)).await?;
        let address = listener.local_addr()?;
        let (asked, inbox) = mpsc::channel(INBOX);
        let task = tokio::spawn(accept(listener, token, asked));
        Ok(Self {
            address,
            inbox,
            task,
        })
    }

    /// Where clients find it.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The next request; none only after a defect of the listening task. Cancel-safe.
    pub async fn next(&mut self) -> Option<Asked<R>> {
        self.inbox.recv().await
    }
}

impl<R> Drop for Port<R> {
    fn drop(&mut self) {
        self.task.abort();
    }
}

async fn accept<R: DeserializeOwned + Send + 'static>(
    listener: TcpListener,
    token: Token,
    asked: mpsc::Sender<Asked<R>>,
) {
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    // The semaphore is never closed.
    while let Ok(place) = Arc::clone(&places).acquire_owned().await {
        match listener.accept().await {
            Ok((stream, _)) => {
                let (token, asked) = (token.clone(), asked.clone());
                tokio::spawn(async move {
                    serve(stream, &token, &asked).await;
                    drop(place);
                });
            }
            Err(_) => tokio::time::sleep(Duration::from_millis(100)).await,
        }
    }
}

/// Why a line was not read to its end.
const CLOSED: &str = "the connection was closed";

async fn serve<R: DeserializeOwned>(
    mut stream: TcpStream,
    token: &Token,
    asked: &mpsc::Sender<Asked<R>>,
) {
    let (reader, mut writer) = stream.split();
    let mut reader = BufReader::new(reader);
    let said = read_line(&mut reader, MAX_TOKEN_CHARS).await;
    if said.as_ref().is_err_and(|why| why == CLOSED) {
        // Who only looks whether anybody listens says nothing.
        return;
    }
    if !said.as_ref().is_ok_and(|said| token.is(said)) {
        tracing::warn!("a command with a wrong token was refused");
        let why = "the token is wrong; nothing was read or done".to_owned();
        return say(&mut writer, &Err(why)).await;
    }
    say(&mut writer, &Ok(Vec::new())).await;
    let answer = match read_line(&mut reader, MAX_LINE_BYTES).await {
        Err(why) => Err(why),
        Ok(line) => match serde_json::from_str(&line) {
            Err(cause) => Err(format!("the request cannot be read: {cause}")),
            Ok(request) => answered(request, asked).await,
        },
    };
    say(&mut writer, &answer).await;
}

async fn answered<R>(request: R, asked: &mpsc::Sender<Asked<R>>) -> Answer {
    let (answer, answered) = oneshot::channel();
    let ending = || "it is ending; nothing was done".to_owned();
    asked
        .send(Asked { request, answer })
        .await
        .map_err(|_| ending())?;
    match tokio::time::timeout(ANSWER_TIMEOUT, answered).await {
        Ok(answer) => answer.unwrap_or_else(|_| Err(ending())),
        Err(_) => Err(format!(
            "no answer within {} s; it may still be carried out",
            ANSWER_TIMEOUT.as_secs()
        )),
    }
}

/// Writes a line; a client that does not take it has gone away.
async fn say(writer: &mut WriteHalf<'_>, answer: &Answer) {
    if let Ok(mut json) = serde_json::to_string(answer) {
        json.push('\n');
        let _ = tokio::time::timeout(LINE_TIMEOUT, writer.write_all(json.as_bytes())).await;
    }
}

/// Reads one line of at most `longest` bytes, without its end.
async fn read_line(reader: &mut BufReader<ReadHalf<'_>>, longest: usize) -> Result<String, String> {
    let mut line = Vec::new();
    let limit = u64::try_from(longest).unwrap_or(u64::MAX).saturating_add(1);
    let mut limited = reader.take(limit);
    let read = limited.read_until(b'\n', &mut line);
    match tokio::time::timeout(LINE_TIMEOUT, read).await {
        Err(_) => return Err("no whole line in time".to_owned()),
        Ok(Err(cause)) => return Err(cause.to_string()),
        Ok(Ok(_)) => {}
    }
    if line.pop() != Some(b'\n') {
        return Err(if line.len() >= longest {
            format!("a line of more than {longest} bytes")
        } else {
            CLOSED.to_owned()
        });
    }
    String::from_utf8(line).map_err(|_| "a line that is no text".to_owned())
}

/// Why a running program could not be asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AskError {
    /// It does not answer; whether anything was done is not known.
    #[error("no answer at {address}: {why}")]
    NoAnswer {
        /// Where.
        address: SocketAddr,
        /// Why.
        why: String,
    },
    /// It refused; nothing was done.
    #[error("refused: {0}")]
    Refused(String),
}

/// Asks the program that listens at `address` for something.
///
/// # Errors
/// When it does not answer, or refuses.
pub async fn ask<R: Serialize>(
    address: SocketAddr,
    token: &Token,
    request: &R,
) -> Result<Vec<String>, AskError> {
    let silent = |why: String| AskError::NoAnswer { address, why };
    if address.ip() != IpAddr::V4(Ipv4Addr::LOCALHOST) {
        let why = "commands and tokens stay on this machine; expected 127.0.0.1:PORT";
        return Err(AskError::Refused(why.to_owned()));
    }
    let json = serde_json::to_string(request).map_err(|e| silent(e.to_string()))?;
    if json.len() > MAX_LINE_BYTES {
        return Err(AskError::Refused(format!(
            "{} bytes, where a request may have {MAX_LINE_BYTES}",
            json.len()
        )));
    }
    let talk = async {
        let mut stream = TcpStream::connect(address)
            .await
            .map_err(|e| e.to_string())?;
        let (reader, mut writer) = stream.split();
        let mut reader = BufReader::new(reader);
        let greeting = exchange(&mut reader, &mut writer, token.secret()).await?;
        if greeting.is_err() {
            return Ok(greeting);
        }
        exchange(&mut reader, &mut writer, &json).await
    };
    match tokio::time::timeout(ANSWER_TIMEOUT + LINE_TIMEOUT, talk).await {
        Ok(said) => said.map_err(silent)?.map_err(AskError::Refused),
        Err(_) => Err(silent("not in time".to_owned())),
    }
}

/// Says a line and takes the answer to it.
async fn exchange(
    reader: &mut BufReader<ReadHalf<'_>>,
    writer: &mut WriteHalf<'_>,
    line: &str,
) -> Result<Answer, String> {
    let line = format!("{line}\n");
    writer
        .write_all(line.as_bytes())
        .await
        .map_err(|e| e.to_string())?;
    let mut said = Vec::new();
    let limit = u64::try_from(MAX_LINE_BYTES).unwrap_or(u64::MAX);
    reader
        .take(limit)
        .read_until(b'\n', &mut said)
        .await
        .map_err(|e| e.to_string())?;
    if said.is_empty() {
        return Err("it closed the connection".to_owned());
    }
    serde_json::from_slice(&said).map_err(|e| format!("it does not speak as expected: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Command;
    use skein_behaviors::Order;

    /// A port that carries out everything, but no hold.
    async fn port() -> (SocketAddr, Token) {
        let token = Token::draw().unwrap();
        let mut port = Port::<Command>::listen(0, token.clone()).await.unwrap();
        let address = port.address();
        tokio::spawn(async move {
            while let Some(asked) = port.next().await {
                let answer = match asked.request {
                    Command::Order(Order::Hold) => Err("no".to_owned()),
                    other => Ok(vec![format!("{other:?}")]),
                };
                let _ = asked.answer.send(answer);
            }
        });
        (address, token)
    }

    /// What the port says to these bytes, all of it.
    async fn said_to(address: SocketAddr, bytes: &[u8]) -> String {
        let mut stream = TcpStream::connect(address).await.unwrap();
        // The port may close before it has read all of them.
        let _ = stream.write_all(bytes).await;
        let _ = stream.shutdown().await;
        let mut said = Vec::new();
        let _ = stream.read_to_end(&mut said).await;
        String::from_utf8(said).unwrap()
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn who_knows_the_token_is_answered() {
        let (address, token) = port().await;
        let base = Command::Base((3, -4));
        let lines = ask(address, &token, &base).await.unwrap();
        assert_eq!(lines, ["Base((3, -4))"]);
        let hold = Command::Order(Order::Hold);
        let refused = ask(address, &token, &hold).await.unwrap_err();
        assert_eq!(refused, AskError::Refused("no".to_owned()));
        let guess = ask(address, &Token::draw().unwrap(), &base).await;
        assert!(matches!(&guess, Err(AskError::Refused(why)) if why.contains("token")));
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn garbage_is_answered_with_a_refusal_and_harms_nobody() {
        let (address, token) = port().await;
        let right = format!("{}\n", token.secret());
        let after = |bytes: &[u8]| [right.as_bytes(), bytes].concat();
        for wrong in [
            b"\n".to_vec(),
            b"GET / HTTP/1.1\r\n\r\n".to_vec(),
            vec![0xff; 4096],
            token.secret().as_bytes()[1..].to_vec(),
        ] {
            let said = said_to(address, &wrong).await;
            assert!(said.is_empty() || said.contains("Err"), "{said}");
        }
        let deep = [b"[".repeat(100_000), b"\n".to_vec()].concat();
        for wrong in [
            after(b"{\n"),
            after(b"null\n"),
            after(b"{\"order\":\"fly\"}\n"),
            after(b"{\"mission\":{\"revision\":-1}}\n"),
            after(b"\xff\xfe\n"),
            after(b"{\"order\":\"resume\"}"),
            after(&deep),
            after(&vec![b' '; MAX_LINE_BYTES + 2]),
        ] {
            let said = said_to(address, &wrong).await;
            assert!(said.lines().count() < 2 || said.contains("Err"), "{said}");
            assert!(!said.contains("Resume"), "{said}");
        }
        let order = Command::Order(Order::Resume);
        let lines = ask(address, &token, &order).await.unwrap();
        assert_eq!(lines, ["Order(Resume)"]);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn many_silent_connections_keep_nobody_out_for_good() {
        let (address, token) = port().await;
        let mut silent = Vec::new();
        for _ in 0..2 * MAX_CONNECTIONS {
            silent.push(TcpStream::connect(address).await.unwrap());
        }
        let order = Command::Order(Order::Resume);
        let asked = tokio::spawn(async move { ask(address, &token, &order).await });
        silent.clear();
        assert!(asked.await.unwrap().is_ok());
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn nothing_is_said_beyond_this_machine() {
        let far: SocketAddr = "192.0.2.1:80".parse().unwrap();
        let said = ask(far, &Token::draw().unwrap(), &1).await;
        assert!(matches!(said, Err(AskError::Refused(_))), "{said:?}");
    }
}
