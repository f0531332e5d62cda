//! Separation of UAVs at one height: motions that are promised, how near two of them
//! come, and ways round each other (D2.7 §1.3: approach conflicts).
//!
//! | module | what it holds |
//! |---|---|
//! | [`motion`] | a timed flight through the air that ends in a loiter for ever |
//! | [`closest`] | whether two motions keep apart, in continuous time and for ever |
//! | [`detour`] | ways to a goal with lateral offsets, airspeeds and waiting, cheapest first |
//!
//! All of it happens in the air mass: a steady wind carries everybody alike and changes
//! no distance between UAVs.

pub mod closest;
pub mod detour;
pub mod motion;

pub use closest::first_loss_s;
pub use detour::{Detour, Detours};
pub use motion::{End, Motion, MotionError, MotionPlan, Stretch};
