//! One module a promise.
mod configs;
