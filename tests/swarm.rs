//! One module a promise.
#![allow(clippy::unwrap_used, reason = "all of this is tests, helpers included")]

mod architecture;
mod configs;
mod model;
mod seeds;
