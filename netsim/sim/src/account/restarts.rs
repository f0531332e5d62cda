//! Peers that were started again, and when they were of use again.

use super::report::RestartReport;

/// The restarts of one run, in the order of their times.
#[derive(Clone, Debug, Default)]
pub struct Restarts {
    all: Vec<RestartReport>,
}

impl Restarts {
    /// A peer was started again; `before` was its life until then.
    pub fn restarted(&mut self, now_ms: u64, peer: u16, fresh_disk: bool, before: Option<u32>) {
        self.all.push(RestartReport {
            peer,
            at_ms: now_ms,
            fresh_disk,
            incarnation_before: before,
            incarnation_after: None,
            productive_ms: None,
        });
    }

    /// A peer runs under an incarnation. A life without its disk begins low and rises when
    /// the peer hears of itself.
    pub fn booted(&mut self, peer: u16, incarnation: u32) {
        if let Some(r) = self.all.iter_mut().rfind(|r| r.peer == peer) {
            r.incarnation_after = Some(incarnation);
        }
    }

    /// A peer listed or saw a cell, or held the mission finished: of use in its new life.
    pub fn productive(&mut self, now_ms: u64, peer: u16) {
        let last = self.all.iter_mut().rfind(|r| r.peer == peer);
        if let Some(r) = last.filter(|r| r.incarnation_after.is_some()) {
            let after_ms = now_ms.saturating_sub(r.at_ms);
            r.productive_ms.get_or_insert(after_ms);
        }
    }

    /// For the report.
    #[must_use]
    pub fn reports(&self) -> Vec<RestartReport> {
        self.all.clone()
    }
}
