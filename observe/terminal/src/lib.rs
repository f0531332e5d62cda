//! A map of a run in a terminal, in place: what it shows comes as words of `skein_recording`
//! over a line, while a trial flies or a simulation runs ahead.
//!
//! | module | what it holds |
//! |---|---|
//! | [`show`](mod@show) | the loop: words in, keys in, pictures out |
//! | [`screen`] | the terminal, taken and given back whatever happens |
//! | [`look`] | colours and characters, as far as the terminal has them |
//! | `keys` | what keys mean |
//! | `player` | which words are due |
//! | `view`, `raster` | which part of the plane is shown, and which cell lies at which character |
//! | [`picture`] | map, roster, events |

mod keys;
pub mod look;
pub mod picture;
mod player;
mod raster;
pub mod screen;
pub mod show;
mod view;

pub use look::Look;
pub use player::Pace;
pub use show::{Left, Options, show};
