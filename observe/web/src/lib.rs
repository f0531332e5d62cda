//! A page on 127.0.0.1 that shows a run: while it goes on, or afterwards.
//!
//! A run flows into a [`Feed`], in the words of `skein_recording`; a [`Server`] sends each
//! browser all of it from the start, and then what comes. The page is one document: it asks for
//! nothing but its own stream, keeps all that it was sent, and draws any moment of it.
//!
//! | module | what it holds |
//! |---|---|
//! | [`feed`] | what was said so far, bounded, for any number of readers |
//! | `words` | the model in few bytes: what a page draws of it |
//! | [`server`] | the routes, and who may use them |
//! | `page` | the document |
//!
//! # Who may do what
//! Only programs of this machine reach the port. Names of other hosts and pages of other origins
//! are refused; faults need the token that the printed address carries behind its `#`, which
//! browsers send to nobody.

pub mod feed;
mod page;
pub mod server;
mod words;

pub use feed::{Feed, FeedSink};
pub use server::{Faults, Server, ServerError};
pub use words::{Hello, Mode};
