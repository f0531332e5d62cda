//! What many pursuits come to.

use serde::{Deserialize, Serialize};

/// What one came to. Times are of all UAVs, or of all targets, together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pursuit {
    /// Time for which UAVs flew, seconds.
    pub flown_s: f64,
    /// Of it, with a turn that was harder than the airframe's, seconds.
    pub saturated_s: f64,
    /// Of it, on the circle that was asked for where that could be flown, seconds.
    pub flyable_s: f64,
    /// The square of the stand-off's error over that time, m² s.
    pub squares_m2s: f64,
    /// Its largest error then, metres.
    pub worst_standoff_m: f64,
    /// Time from a target's first sight on, seconds.
    pub whole_s: f64,
    /// Of it, with a UAV that sees it, seconds.
    pub seen_s: f64,
    /// Of it, in the picture but behind a building, seconds.
    pub hidden_s: f64,
    /// Of it, below a roof, where nobody could see it, seconds.
    pub covered_s: f64,
    /// Of it, while it could be kept up with, seconds.
    pub kept_s: f64,
    /// Of that, with a UAV that sees it, seconds.
    pub kept_seen_s: f64,
    /// The longest time that nobody saw a target, seconds.
    pub longest_gap_s: f64,
    /// Changes between loiter and weave.
    pub mode_switches: u32,
    /// Those that took back one before, though the target had hardly changed its speed.
    pub chatter: u32,
    /// Normalised squared errors of each author's estimates.
    pub nees: Vec<f64>,
    /// Of estimates of several authors together.
    pub nees_fused: Vec<f64>,
    /// Squared errors of place of each author's estimates, m².
    pub position_m2: Vec<f64>,
    /// UAVs that were taken away from their target.
    pub trackers_lost: u32,
    /// After how long another one had it, seconds.
    pub reacquired_after_s: Vec<f64>,
    /// How often within ten seconds.
    pub reacquired_in_time: u32,
    /// Time inside a zone or nearer than the clearance, seconds.
    pub in_zone_s: f64,
}

/// Sums over the runs of a bench, with the fields that it prints.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// Runs that were flown.
    pub runs: u64,
    /// Root mean square of the stand-off's error where the circle could be flown, metres.
    pub rms_standoff_m: Option<f64>,
    /// Its largest error then, metres.
    pub worst_standoff_m: f64,
    /// The share of the flying time that this was measured in.
    pub flyable_share: f64,
    /// The share of time with a target in the picture of a UAV, while it was slower through
    /// the air than the fastest airspeed by a tenth.
    pub in_footprint_share: Option<f64>,
    /// The same over all the time since it was seen first.
    pub in_footprint_share_all: Option<f64>,
    /// The share of time with a target in the picture but behind a building.
    pub hidden_share: f64,
    /// The share of time that a target is below a roof, where nobody could see it.
    pub covered_share: f64,
    /// The longest time that nobody saw a target, seconds.
    pub longest_gap_s: f64,
    /// Changes between loiter and weave.
    pub mode_switches: u64,
    /// Those that took back one before, though the target had hardly changed its speed.
    pub chatter: u64,
    /// The share of time with a turn harder than the airframe's.
    pub saturated_share: f64,
    /// Mean normalised squared error of estimates of one author; 4 is consistent.
    pub nees: Option<f64>,
    /// Of estimates of several authors together: at most 4 is consistent.
    pub nees_fused: Option<f64>,
    /// Root mean square error of place of one author's estimates, metres.
    pub position_rms_m: Option<f64>,
    /// UAVs taken away from their target.
    pub trackers_lost: u64,
    /// The share of them whose target another one had within ten seconds.
    pub reacquired_within_10s: Option<f64>,
    /// The longest time until then, seconds; those that never were are not in it.
    pub reacquired_worst_s: Option<f64>,
    /// Time inside a zone or nearer than the clearance, seconds.
    pub in_zone_s: f64,
}

/// Collects runs in any order: what comes of it does not depend on it.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    runs: Vec<(u64, Pursuit)>,
}

impl Tally {
    /// Adds a run.
    pub fn add(&mut self, seed: u64, run: Pursuit) {
        self.runs.push((seed, run));
    }

    /// What all of them come to.
    #[must_use]
    pub fn totals(mut self) -> Totals {
        // Sums are in the order of the seeds, so that the order of the runs does not show.
        self.runs.sort_by_key(|(seed, _)| *seed);
        let sum = |of: &dyn Fn(&Pursuit) -> f64| self.runs.iter().map(|(_, r)| of(r)).sum::<f64>();
        let most = |of: &dyn Fn(&Pursuit) -> f64| {
            let all = self.runs.iter().map(|(_, r)| of(r));
            all.fold(0.0_f64, f64::max)
        };
        let count = |of: &dyn Fn(&Pursuit) -> u32| {
            let all = self.runs.iter().map(|(_, r)| u64::from(of(r)));
            all.sum::<u64>()
        };
        let mean = |of: &dyn Fn(&Pursuit) -> &[f64]| {
            let all = self.runs.iter().flat_map(|(_, r)| of(r).iter().copied());
            let (n, sum) = all.fold((0.0, 0.0), |(n, s), x| (n + 1.0, s + x));
            ratio(sum, n)
        };
        let (flown_s, flyable_s) = (sum(&|r| r.flown_s), sum(&|r| r.flyable_s));
        let whole_s = sum(&|r| r.whole_s);
        let lost = count(&|r| r.trackers_lost);
        let slowest = most(&|r| r.reacquired_after_s.iter().copied().fold(0.0, f64::max));
        #[allow(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
        let reacquired = (
            count(&|r| r.reacquired_in_time) as f64,
            lost as f64,
            count(&|r| u32::try_from(r.reacquired_after_s.len()).unwrap_or(u32::MAX)),
        );
        Totals {
            runs: self.runs.len() as u64,
            rms_standoff_m: ratio(sum(&|r| r.squares_m2s), flyable_s).map(f64::sqrt),
            worst_standoff_m: most(&|r| r.worst_standoff_m),
            flyable_share: ratio(flyable_s, flown_s).unwrap_or(0.0),
            in_footprint_share: ratio(sum(&|r| r.kept_seen_s), sum(&|r| r.kept_s)),
            in_footprint_share_all: ratio(sum(&|r| r.seen_s), whole_s),
            hidden_share: ratio(sum(&|r| r.hidden_s), whole_s).unwrap_or(0.0),
            covered_share: ratio(sum(&|r| r.covered_s), whole_s).unwrap_or(0.0),
            longest_gap_s: most(&|r| r.longest_gap_s),
            mode_switches: count(&|r| r.mode_switches),
            chatter: count(&|r| r.chatter),
            saturated_share: ratio(sum(&|r| r.saturated_s), flown_s).unwrap_or(0.0),
            nees: mean(&|r| &r.nees),
            nees_fused: mean(&|r| &r.nees_fused),
            position_rms_m: mean(&|r| &r.position_m2).map(f64::sqrt),
            trackers_lost: lost,
            reacquired_within_10s: ratio(reacquired.0, reacquired.1),
            reacquired_worst_s: (reacquired.2 > 0).then_some(slowest),
            in_zone_s: sum(&|r| r.in_zone_s),
        }
    }
}

fn ratio(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}
