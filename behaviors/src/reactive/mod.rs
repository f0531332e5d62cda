//! The reactive layer: [`follow`] tracks a curve, [`promise`] a motion that was promised,
//! [`sensed_traffic`] keeps apart from what is only sensed, [`envelope`] has the last word.

pub mod air;
pub mod envelope;
pub mod follow;
pub mod promise;
pub mod sensed_traffic;
