//! One module a promise.

mod architecture;
mod configs;
mod seeds;
