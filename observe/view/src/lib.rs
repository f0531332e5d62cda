//! What a terminal and a page share: a run at one moment, its way from a driver to whoever
//! draws it, and what a swarm says of itself.
//!
//! | module | what it holds |
//! |---|---|
//! | [`standing`] | how all stands, folded from the words of a run |
//! | [`history`] | its rounds and tasks: bids, and who got what |
//! | [`line`](mod@line) | the way from a driver to a thread that draws |
//! | [`lines`] | a run as text, written and read |
//! | [`belief`] | a run from nothing but what a swarm says on the air; `believed` holds one peer, `believed_tasks` what is done besides coverage |

pub mod belief;
mod believed;
mod believed_tasks;
pub mod history;
pub mod line;
pub mod lines;
pub mod standing;

pub use belief::Belief;
pub use history::History;
pub use line::{Line, line};
pub use standing::Standing;
