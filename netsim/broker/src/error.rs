//! Why a trial has no report.

use crate::registry::RegistryError;
use skein_console::TokenError;

/// Why a trial has no report.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// A file or a socket failed.
    #[error("{what}: {cause}")]
    Io {
        /// Doing what.
        what: String,
        /// Why.
        cause: std::io::Error,
    },
    /// The directory shared with other commands failed.
    #[error(transparent)]
    Registry(#[from] RegistryError),
    /// There is no token for its ports.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A peer did not come up.
    #[error("peer {peer} did not start: {why}")]
    Launch {
        /// Which.
        peer: u16,
        /// Its last words.
        why: String,
    },
    /// The person at the keyboard had enough.
    #[error("interrupted; all peers are gone")]
    Interrupted,
}

pub(crate) fn io(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> TrialError {
    let what = what.into();
    move |cause| TrialError::Io { what, cause }
}
