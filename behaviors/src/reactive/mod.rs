//! The reactive layer: [`follow`] tracks a curve, [`promise`] a motion that was promised, [`gaze`]
//! holds the planned footprint, [`sensed_traffic`] keeps apart from what is only sensed,
//! [`well_clear`] from aircraft that are no members, [`pass_over`] above them, [`envelope`] has the
//! last word.

pub mod air;
pub mod climb;
pub mod envelope;
pub mod follow;
pub mod gaze;
pub mod pass_over;
pub mod promise;
pub mod sensed_traffic;
pub mod well_clear;
