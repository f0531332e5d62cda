//! One module a promise.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests may unwrap, as tests may"
)]

mod architecture;
mod configs;
mod d27;
mod model;
mod seeds;
