//! All deterministic tests of the workspace in one binary: each module holds one thing
//! that the repository promises.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests may unwrap, as tests may"
)]

mod architecture;
mod auction;
mod configs;
mod d27;
mod documents;
mod drawn;
mod flown_plans;
mod fuel;
mod many;
mod model;
mod names_of_checks;
mod pace;
mod promises;
mod seeds;
