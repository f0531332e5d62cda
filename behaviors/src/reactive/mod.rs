//! The reactive layer: [`follow`] tracks a curve, [`envelope`] has the last word.

pub mod air;
pub mod envelope;
pub mod follow;
pub mod promise;
