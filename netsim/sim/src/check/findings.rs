//! What the checks find: broken rules, how long graded things took, and since when
//! something has been going on.

use super::Grade;
use crate::account::secs;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

/// A rule that was broken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Violation {
    /// Which rule: its name in the protocol, `S3` to `L7`, or `detect`.
    pub check: Cow<'static, str>,
    /// Seed of the run.
    pub seed: u64,
    /// When, milliseconds of scenario time.
    pub time_ms: u64,
    /// By or at which peer, where it is one peer's.
    pub peer: Option<u16>,
    /// How.
    pub text: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at_s = secs(self.time_ms);
        let peer = self.peer.map_or_else(String::new, |p| format!(", uav{p}"));
        write!(f, "{} at {at_s:.1} s{peer}: {}", self.check, self.text)
    }
}

/// The most violations of one rule that a run keeps: the first ones tell the story,
/// the others only count.
const KEPT_PER_CHECK: usize = 5;

/// Where the checks put what they find.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    seed: u64,
    /// The first violations of each rule.
    pub violations: Vec<Violation>,
    /// Violations by rule, all of them.
    pub counts: BTreeMap<&'static str, u64>,
    /// How long graded things took, as a share of their bound, by rule; only where
    /// some loss made the bound a percentile.
    pub ratios: BTreeMap<&'static str, Vec<f64>>,
    fresh: usize,
}

impl Findings {
    /// Nothing found yet.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            ..Self::default()
        }
    }

    /// What was found so far; from now on nothing has been.
    #[must_use]
    pub fn take(&mut self) -> Self {
        let fresh = Self::new(self.seed);
        std::mem::replace(self, fresh)
    }

    /// A rule was broken.
    pub fn broken(
        &mut self,
        check: &'static str,
        time_ms: u64,
        peer: Option<u16>,
        text: impl FnOnce() -> String,
    ) {
        let n = self.counts.entry(check).or_default();
        *n += 1;
        if *n <= KEPT_PER_CHECK as u64 {
            self.violations.push(Violation {
                check: Cow::Borrowed(check),
                seed: self.seed,
                time_ms,
                peer,
                text: text(),
            });
        }
    }

    /// A graded thing ended after `took_ms` under `bound_ms`.
    pub fn took(&mut self, check: &'static str, grade: Grade, took_ms: u64, bound_ms: u64) {
        if grade == Grade::Light {
            #[allow(clippy::cast_precision_loss, reason = "runs last less than 2^52 ms")]
            let share = took_ms as f64 / bound_ms.max(1) as f64;
            self.ratios.entry(check).or_default().push(share);
        }
    }

    /// Violations found since the last call.
    pub fn drain_fresh(&mut self) -> Vec<Violation> {
        let out = self.violations[self.fresh..].to_vec();
        self.fresh = self.violations.len();
        out
    }
}

/// Things that go on for longer than they may are told once: remembers since when.
#[derive(Clone, Debug)]
pub struct Clocks<K: Ord + Copy> {
    running: BTreeMap<K, (u64, bool)>,
}

impl<K: Ord + Copy> Default for Clocks<K> {
    fn default() -> Self {
        Self {
            running: BTreeMap::new(),
        }
    }
}

impl<K: Ord + Copy> Clocks<K> {
    /// The thing goes on; returns since when.
    pub fn start(&mut self, key: K, now_ms: u64) -> u64 {
        self.running.entry(key).or_insert((now_ms, false)).0
    }

    /// Since when the thing has been going on, if it does.
    #[must_use]
    pub fn since(&self, key: K) -> Option<u64> {
        self.running.get(&key).map(|(since, _)| *since)
    }

    /// The thing ended; returns since when it had been going on.
    pub fn stop(&mut self, key: K) -> Option<u64> {
        self.running.remove(&key).map(|(since, _)| since)
    }

    /// True the first time it is called for a thing that goes on.
    pub fn tell_once(&mut self, key: K) -> bool {
        match self.running.get_mut(&key) {
            Some((_, told)) => !std::mem::replace(told, true),
            None => false,
        }
    }

    /// Ends everything that `keep` refuses.
    pub fn retain(&mut self, mut keep: impl FnMut(&K) -> bool) {
        self.running.retain(|k, _| keep(k));
    }
}
