//! The control port of a trial: what other commands may want of it.

use crate::registry::Entry;
use serde::{Deserialize, Serialize};
use skein_console::{AskError, Port, Token, ask};
use skein_netsim::fault::{Fault, TimedFault};

/// What a command may want of a trial.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Request {
    /// Something is to go wrong, or to be put right.
    Fault(Fault),
    /// The same, later: times count from now.
    Later(Vec<TimedFault>),
}

/// The control port.
pub type Control = Port<Request>;

/// Why a trial did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
#[error("trial {trial}: {why}")]
pub struct ControlError {
    /// Which.
    pub trial: String,
    /// Why.
    pub why: AskError,
}

/// Asks a running trial for something.
///
/// # Errors
/// When it does not answer, or refuses.
pub async fn command(trial: &Entry, request: &Request) -> Result<Vec<String>, ControlError> {
    let failed = |why| ControlError {
        trial: trial.id.clone(),
        why,
    };
    let Some(token) = Token::told(&trial.token) else {
        return Err(failed(AskError::Refused(
            "its entry holds no token".to_owned(),
        )));
    };
    ask(trial.control, &token, request).await.map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(control: std::net::SocketAddr, token: &str) -> Entry {
        Entry {
            id: "t".to_owned(),
            pid: 1,
            control,
            token: token.to_owned(),
            run_dir: std::path::PathBuf::new(),
            observe: None,
            console: None,
            consoles: std::collections::BTreeMap::new(),
            fleet: "f".to_owned(),
        }
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn who_knows_the_token_is_answered() {
        let token = Token::told("secret").unwrap();
        let mut control = Control::listen(0, token).await.unwrap();
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
            command(&entry(address, "secret"), &kill).await.unwrap(),
            ["uav3 is gone"]
        );
        let stranger = command(&entry(address, "guess"), &kill).await.unwrap_err();
        assert!(matches!(stranger.why, AskError::Refused(_)));
        let refused = command(&entry(address, "secret"), &Request::Later(vec![])).await;
        assert_eq!(refused.unwrap_err().to_string(), "trial t: refused: no");
    }
}
