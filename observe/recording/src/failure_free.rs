//! The run of the same scenario and seed without failures, with which a run is compared. The
//! simulator flies it beside the run, on the observers' side: no peer knows of it.

use crate::model::{FailureFree, Record, rounded};
use crate::simulated::FRAME_MS;
use crate::sink::Sink;
use skein_netsim::Prepared;
use skein_netsim::swarm::Swarm;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;

/// Points of a curve that are kept: more than a chart is wide.
const MAX_POINTS: usize = 1024;

/// Flies it: what the operator wants happens as in the run, and nothing breaks. None where it
/// was given up.
#[must_use]
pub fn fly(prepared: &Prepared, seed: u64, give_up: &AtomicBool) -> Option<FailureFree> {
    let asked = prepared.spec.faults.iter();
    let orders = asked.filter(|f| f.fault.is_spoken()).cloned().collect();
    let mut swarm = Swarm::new(prepared, seed, orders, false);
    let longest_ms = u64::from(prepared.spec.max_time_s) * 1000 + FRAME_MS;
    let (mut coverage, mut until_ms): (Vec<(u64, f64)>, u64) = (vec![(0, 0.0)], 0);
    loop {
        if give_up.load(Ordering::Relaxed) {
            return None;
        }
        until_ms += FRAME_MS;
        let goes_on = swarm.run_until(until_ms);
        let share = rounded(swarm.world().judge().covered_share(), 1e6);
        // Of a stretch at one height both ends are kept.
        let same = |(_, height): &(u64, f64)| height.total_cmp(&share).is_eq();
        if coverage.len() >= 2 && coverage.iter().rev().take(2).all(same) {
            coverage.pop();
        }
        // A step may lie between two looks; the newer look counts.
        if coverage.last().is_some_and(|(at, _)| *at == swarm.now_ms()) {
            coverage.pop();
        }
        coverage.push((swarm.now_ms(), share));
        // It always ends by then.
        if !goes_on || until_ms > longest_ms {
            break;
        }
    }
    let end_ms = swarm.now_ms();
    // It stands at its end: what is left to do is to sum it up.
    let makespan_ms = swarm.run().report.makespan_ms;
    Some(FailureFree {
        seed,
        end_ms,
        makespan_ms,
        coverage: thinned(coverage),
    })
}

/// Every so manieth point and the last.
fn thinned(points: Vec<(u64, f64)>) -> Vec<(u64, f64)> {
    let step = points.len().div_ceil(MAX_POINTS).max(1);
    let last = points.len().saturating_sub(1);
    let kept = points.into_iter().enumerate();
    let kept = kept.filter(|(i, _)| i % step == 0 || *i == last);
    kept.map(|(_, point)| point).collect()
}

/// A run without failures that is flown in a thread of its own; it is given up when this is
/// dropped.
#[derive(Debug)]
pub struct Beside {
    flown: Arc<OnceLock<FailureFree>>,
    give_up: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Beside {
    /// Begins it, with what the thread itself prepares.
    ///
    /// # Errors
    /// When there is no thread.
    pub fn begin(
        prepare: impl FnOnce() -> Prepared + Send + 'static,
        seed: u64,
    ) -> io::Result<Self> {
        let (flown, give_up) = (Arc::default(), Arc::new(AtomicBool::new(false)));
        let (tell, asked): (Arc<OnceLock<FailureFree>>, _) =
            (Arc::clone(&flown), Arc::clone(&give_up));
        let named = std::thread::Builder::new().name("failure-free".to_owned());
        let thread = named.spawn(move || {
            if let Some(run) = fly(&prepare(), seed, &asked) {
                // Nobody else says it.
                let _ = tell.set(run);
            }
        })?;
        Ok(Self {
            flown,
            give_up,
            thread: Some(thread),
        })
    }

    /// What it came to, if it is over by now.
    #[must_use]
    pub fn poll(&self) -> Option<FailureFree> {
        self.flown.get().cloned()
    }

    fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for what it came to.
    fn wait(mut self) -> Option<FailureFree> {
        if let Some(thread) = self.thread.take() {
            // One that panicked has said nothing.
            let _ = thread.join();
        }
        self.poll()
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        self.give_up.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // What went wrong in it concerns nobody else.
            let _ = thread.join();
        }
    }
}

/// A sink that is told of the run without failures too: as soon as it is known, and before the
/// end of the run at the latest.
#[derive(Debug)]
pub struct Compared<S> {
    sink: S,
    beside: Option<Beside>,
}

impl<S: Sink> Compared<S> {
    /// Begins the run without failures.
    ///
    /// # Errors
    /// When there is no thread.
    pub fn begin(sink: S, prepared: &Prepared, seed: u64) -> io::Result<Self> {
        let prepared = prepared.clone();
        Ok(Self {
            sink,
            beside: Some(Beside::begin(move || prepared, seed)?),
        })
    }
}

impl<S: Sink> Sink for Compared<S> {
    fn take(&mut self, record: &Record) -> io::Result<()> {
        // A run begins with its scene.
        let may_wait = !matches!(record, Record::Scene(_));
        let is_last = matches!(record, Record::End(_));
        let is_due = |beside: &mut Beside| may_wait && (is_last || beside.is_over());
        if let Some(flown) = self.beside.take_if(is_due).and_then(Beside::wait) {
            self.sink.take(&Record::FailureFree(flown))?;
        }
        self.sink.take(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated;
    use crate::sink::Collected;
    use skein_netsim::runs::{self, Wanted};
    use skein_netsim::world::fixture::square_losing;

    fn prepared() -> Prepared {
        Prepared::new(square_losing(3, 2, 30_000))
    }

    #[test]
    fn it_is_the_run_that_the_simulator_flies_without_faults() {
        let prepared = prepared();
        let flown = fly(&prepared, 4, &AtomicBool::new(false)).unwrap();
        let alone = runs::run(&prepared, 4, Vec::new(), Wanted::default()).report;
        assert!(alone.completed);
        assert_eq!(flown.makespan_ms, alone.makespan_ms);
        let (first, last) = (flown.coverage[0], *flown.coverage.last().unwrap());
        assert_eq!(first, (0, 0.0));
        assert_eq!(last, (flown.end_ms, 1.0));
        assert!(flown.coverage.is_sorted_by(|a, b| a.0 < b.0 && a.1 <= b.1));
        // It passes half of the area when a run without faults that is watched does.
        let mut watched = Collected::default();
        let mut spec = (*prepared.spec).clone();
        spec.faults.clear();
        let without = Prepared::new(spec);
        simulated::fly(&without, 4, None, Wanted::default(), &mut watched).unwrap();
        let half = watched.frames.iter().find(|f| f.covered_share >= 0.5);
        let by_curve = flown.coverage.iter().find(|(_, s)| *s >= 0.5).unwrap().0;
        assert!(by_curve.abs_diff(half.unwrap().time_ms) <= 2 * FRAME_MS);
    }

    #[test]
    fn a_run_is_told_of_it_once_and_before_its_end() {
        let prepared = prepared();
        let mut sink = Compared::begin(Collected::default(), &prepared, 4).unwrap();
        simulated::fly(&prepared, 4, None, Wanted::default(), &mut sink).unwrap();
        let run = sink.sink;
        let flown = run.failure_free.unwrap();
        assert!(run.end.is_some());
        // Without a UAV that is killed it is done sooner.
        let report = run.end.unwrap().report;
        assert!(flown.makespan_ms.unwrap() < report.makespan_ms.unwrap());
    }

    #[test]
    fn one_that_nobody_waits_for_is_given_up() {
        let given_up = AtomicBool::new(true);
        assert_eq!(fly(&prepared(), 4, &given_up), None);
        drop(Beside::begin(prepared, 4).unwrap());
    }

    #[test]
    fn a_curve_keeps_its_ends_and_no_more_points_than_are_drawn() {
        let points: Vec<(u64, f64)> = (0..5_000_u32).map(|i| (i.into(), f64::from(i))).collect();
        let kept = thinned(points);
        assert!(kept.len() <= MAX_POINTS + 1);
        assert_eq!((kept[0].0, kept.last().unwrap().0), (0, 4_999));
        assert!(thinned(Vec::new()).is_empty());
    }
}
