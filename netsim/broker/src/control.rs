//! The control port: one request and one answer a connection, a line of JSON each.

use crate::registry::Entry;
use serde::{Deserialize, Serialize};
use skein_behaviors::Order;
use skein_netsim::fault::{Fault, TimedFault};
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{mpsc, oneshot};

/// The longest request or answer, bytes: a partition of 1,000 peers, written out.
const MAX_LINE_BYTES: u64 = 64 * 1024;

/// How long either side waits for the other. A fault takes effect within one step of
/// the world; a restart waits for a process to be gone.
const TIMEOUT: Duration = Duration::from_secs(10);

/// Requests that wait for the trial; people do not type faster.
const INBOX: usize = 16;

/// What a command may want of a trial.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Request {
    /// Something is to go wrong, or to be put right.
    Fault(Fault),
    /// The same, later: times count from now.
    Later(Vec<TimedFault>),
    /// The operator wants something.
    Order(Order),
}

/// What a trial answers: lines for a person, or why it did nothing.
pub type Answer = Result<Vec<String>, String>;

#[derive(Debug, Serialize, Deserialize)]
struct Envelope {
    token: String,
    request: Request,
}

/// A request and where its answer goes.
#[derive(Debug)]
pub struct Asked {
    /// What is wanted.
    pub request: Request,
    /// Where the answer goes.
    pub answer: oneshot::Sender<Answer>,
}

/// The control port of a trial.
#[derive(Debug)]
pub struct Control {
    address: SocketAddr,
    inbox: mpsc::Receiver<Asked>,
    task: tokio::task::JoinHandle<()>,
}

impl Control {
    /// Listens; requests must carry `token`.
    ///
    /// # Errors
    /// When no port can be had.
    pub async fn listen(token: String) -> std::io::Result<Self> {
        let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
        let address = listener.local_addr()?;
        let (asked, inbox) = mpsc::channel(INBOX);
        let task = tokio::spawn(async move {
            loop {
                match listener.accept().await {
                    Ok((stream, _)) => {
                        let served = serve(stream, token.clone(), asked.clone());
                        drop(tokio::spawn(tokio::time::timeout(TIMEOUT, served)));
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

    /// Where commands find it.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The next request. Cancel-safe.
    pub async fn next(&mut self) -> Option<Asked> {
        self.inbox.recv().await
    }
}

impl Drop for Control {
    fn drop(&mut self) {
        self.task.abort();
    }
}

async fn serve(mut stream: TcpStream, token: String, asked: mpsc::Sender<Asked>) {
    let (reader, mut writer) = stream.split();
    let Some(line) = read_line(reader).await else {
        return;
    };
    let answer = match serde_json::from_str::<Envelope>(&line) {
        Err(cause) => Err(format!("the request cannot be read: {cause}")),
        Ok(envelope) if envelope.token != token => Err("the token is not this trial's".to_owned()),
        Ok(envelope) => {
            let (answer, answered) = oneshot::channel();
            let sent = asked
                .send(Asked {
                    request: envelope.request,
                    answer,
                })
                .await
                .is_ok();
            let gone = || Err("the trial is ending".to_owned());
            if sent {
                answered.await.unwrap_or_else(|_| gone())
            } else {
                gone()
            }
        }
    };
    if let Ok(mut json) = serde_json::to_string(&answer) {
        json.push('\n');
        let _ = writer.write_all(json.as_bytes()).await;
    }
}

async fn read_line(reader: impl tokio::io::AsyncRead + Unpin) -> Option<String> {
    let mut line = String::new();
    let read = BufReader::new(reader.take(MAX_LINE_BYTES))
        .read_line(&mut line)
        .await
        .ok()?;
    (read > 0 && line.ends_with('\n')).then_some(line)
}

/// Why a trial could not be asked.
#[derive(Debug, thiserror::Error)]
pub enum AskError {
    /// It does not answer.
    #[error("trial {0} does not answer: {1}")]
    NoAnswer(String, String),
    /// It refused; nothing was done.
    #[error("trial {0} refused: {1}")]
    Refused(String, String),
}

/// Asks a running trial for something.
///
/// # Errors
/// When it does not answer, or refuses.
pub async fn ask(trial: &Entry, request: Request) -> Result<Vec<String>, AskError> {
    let silent = |why: String| AskError::NoAnswer(trial.id.clone(), why);
    let envelope = Envelope {
        token: trial.token.clone(),
        request,
    };
    let mut json = serde_json::to_string(&envelope).map_err(|e| silent(e.to_string()))?;
    json.push('\n');
    let talk = async {
        let mut stream = TcpStream::connect(trial.control)
            .await
            .map_err(|e| e.to_string())?;
        stream
            .write_all(json.as_bytes())
            .await
            .map_err(|e| e.to_string())?;
        read_line(&mut stream)
            .await
            .ok_or_else(|| "it closed the connection".to_owned())
    };
    let line = match tokio::time::timeout(TIMEOUT, talk).await {
        Ok(said) => said.map_err(silent)?,
        Err(_) => return Err(silent("no answer in time".to_owned())),
    };
    serde_json::from_str::<Answer>(&line)
        .map_err(|e| silent(e.to_string()))?
        .map_err(|why| AskError::Refused(trial.id.clone(), why))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(control: SocketAddr, token: &str) -> Entry {
        Entry {
            id: "t".to_owned(),
            pid: 1,
            control,
            token: token.to_owned(),
            run_dir: std::path::PathBuf::new(),
            observe: None,
            fleet: "f".to_owned(),
        }
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn who_knows_the_token_is_answered() {
        let mut control = Control::listen("secret".to_owned()).await.unwrap();
        let address = control.address();
        tokio::spawn(async move {
            while let Some(asked) = control.next().await {
                let answer = match asked.request {
                    Request::Fault(Fault::Kill { peer }) => Ok(vec![format!("uav{peer} is gone")]),
                    _ => Err("no".to_owned()),
                };
                asked.answer.send(answer).unwrap();
            }
        });
        let kill = Request::Fault(Fault::Kill { peer: 3 });
        assert_eq!(
            ask(&entry(address, "secret"), kill.clone()).await.unwrap(),
            ["uav3 is gone"]
        );
        let stranger = ask(&entry(address, "guess"), kill).await.unwrap_err();
        assert!(matches!(stranger, AskError::Refused(..)));
        let refused = ask(&entry(address, "secret"), Request::Order(Order::Hold))
            .await
            .unwrap_err();
        assert_eq!(refused.to_string(), "trial t refused: no");
    }
}
