//! What is to be seen, and where nobody may fly, in the plane.

use crate::outline::Outline;

/// An outline with its name.
#[derive(Clone, Debug)]
pub struct Named {
    /// What it is called in reports.
    pub name: String,
    /// Where it is.
    pub outline: Outline,
}

/// The ground of a plan.
#[derive(Clone, Debug, Default)]
pub struct Ground {
    /// What is to be seen.
    pub areas: Vec<Named>,
    /// Parts of it that need not be seen, and must be kept out of.
    pub holes: Vec<Named>,
    /// What must be kept out of.
    pub zones: Vec<Named>,
    /// What must be stayed within: inside each of them.
    pub fences: Vec<Named>,
    /// What of the files was left out.
    pub notices: Vec<String>,
}
