//! How a person's commands reach a running program on the same machine: a [`Port`] on
//! 127.0.0.1, guarded by a [`Token`].
//!
//! A connection is one request:
//!
//! | who | says, one line each |
//! |---|---|
//! | client | the token |
//! | port | `{"Ok":[]}`, or `{"Err":"why"}` and it is over |
//! | client | the request, as JSON |
//! | port | `{"Ok":["lines","for a person"]}` or `{"Err":"why nothing was done"}` |
//!
//! Nothing of a request is read before its token is known to be right. Lines have a
//! longest length, connections a number and a time. A trial's control port speaks it,
//! and the console of a ground station; what that may be asked for is [`Command`].
//! Tokens, and what else only this user may read, are written by [`replace_private_file`].

mod command;
mod port;
mod private_file;
mod token;

pub use command::{Command, NewZone};
pub use port::{Answer, AskError, Asked, MAX_LINE_BYTES, Port, ask};
pub use private_file::replace_private_file;
pub use token::{Token, TokenError};
