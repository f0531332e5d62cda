//! From the fields of a scenario file to values with units, one subject a file. Leaves what
//! the values mean together (mission, loop, feasibility) to the modules that follow.

pub(crate) mod faults;
pub(crate) mod fleet;
pub(crate) mod targets;
pub(crate) mod terrain;
