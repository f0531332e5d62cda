//! One module a promise.

mod architecture;
mod configs;
mod d27;
mod model;
mod seeds;
