//! The world, as a trial uses it.

use crate::verdict::CoverageVerdict;
use skein_behaviors::{Percept, Setpoint};
use skein_link::LinkState;
use skein_netsim::spec::Spec;

/// The world of one trial.
#[derive(Debug)]
pub struct Arena {}

impl Arena {
    /// The world of a scenario.
    ///
    /// # Errors
    /// When it cannot be flown.
    pub fn new(_spec: &Spec, _seed: u64) -> Result<Self, String> {
        Ok(Self {})
    }
    /// x
    pub fn apply(&mut self, _id: u16, _s: Setpoint, _now_ms: u64) {}
    /// x
    pub fn advance(&mut self, _to_ms: u64) {}
    /// x
    pub fn percept(&self, _id: u16) -> Option<Percept> {
        None
    }
    /// x
    pub fn link(&self, _tx: u16, _rx: u16) -> LinkState {
        LinkState {
            in_range: true,
            in_sight: true,
            cut: false,
            loss_permille: 0,
            delay_ms: 5,
        }
    }
    /// x
    pub fn remove(&mut self, _id: u16, _now_ms: u64) {}
    /// x
    pub fn relaunch(&mut self, _id: u16, _now_ms: u64) {}
    /// x
    pub fn covered_share(&self) -> f64 {
        0.0
    }
    /// x
    pub fn is_covered(&self) -> bool {
        false
    }
    /// x
    pub fn zone_entries(&self) -> usize {
        0
    }
    /// x
    pub fn separation_m(&self) -> Option<f64> {
        None
    }
    /// x
    pub fn coverage(&self, needed_share: f64) -> CoverageVerdict {
        CoverageVerdict {
            needed_share,
            ..CoverageVerdict::default()
        }
    }
}
