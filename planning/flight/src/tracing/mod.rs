//! Following a contour by what is seen of it: a road that is on no map, or the edge of a fire
//! (D2.7 §3.1).
//!
//! | module | what it holds |
//! |---|---|
//! | [`thread`] | looks at a contour, strung together in the order of flight |
//! | [`lead`] | turns along what was seen, and on where it was not |
//! | [`outline`] | what many tell of a contour, the newest look first |
//!
//! All of it is pure: the state that it needs from percept to percept is a value that the
//! caller keeps.

pub mod lead;
pub mod outline;
pub mod thread;
