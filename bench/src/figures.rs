//! Wall times of many calls, summed up the way every benchmark prints them.

use serde::Serialize;
use std::time::Instant;

/// Times per call, microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Times {
    /// Mean.
    pub mean_us: f64,
    /// Median.
    pub p50_us: f64,
    /// 99th percentile.
    pub p99_us: f64,
    /// Longest.
    pub max_us: f64,
}

impl Times {
    /// Sums up the times of single calls, microseconds; zeros for none.
    #[must_use]
    pub fn of(mut each_us: Vec<f64>) -> Self {
        each_us.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * each_us.len() as f64) as usize;
            let last = each_us.len().saturating_sub(1);
            each_us.get(rank.min(last)).copied().unwrap_or(0.0)
        };
        Self {
            mean_us: each_us.iter().sum::<f64>() / each_us.len().max(1) as f64,
            p50_us: at(0.5),
            p99_us: at(0.99),
            max_us: at(1.0),
        }
    }
}

/// Runs something once and tells how long it took, microseconds.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let value = work();
    (value, start.elapsed().as_secs_f64() * 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_come_from_the_sorted_times() {
        let t = Times::of((0..100).rev().map(f64::from).collect());
        assert_eq!((t.p50_us, t.p99_us, t.max_us), (50.0, 99.0, 99.0));
        assert!((t.mean_us - 49.5).abs() < 1e-12);
    }

    #[test]
    fn no_calls_are_no_times() {
        assert!(Times::of(Vec::new()).max_us.abs() < 1e-12);
    }
}
