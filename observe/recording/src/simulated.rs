//! A simulated run that is observed.

use crate::model::Record;
use crate::model::scene::Driver;
use crate::observer::Observer;
use crate::sink::Sink;
use skein_netsim::Prepared;
use skein_netsim::history::What;
use skein_netsim::runs::{self, Wanted, Watch};
use skein_netsim::swarm::{Outcome, Swarm};
use std::io;

/// How often a run is looked at, milliseconds of scenario time: a UAV flies some 10 m meanwhile.
pub const FRAME_MS: u64 = 500;

/// Runs a seed with the scenario's own faults, or with those of its storm where the makespan
/// without faults is given, and tells of it. The run is the same as one that nobody looks at.
///
/// # Errors
/// Of the sink; the run goes on to its end without it, and is lost.
pub fn fly(
    prepared: &Prepared,
    seed: u64,
    failure_free_ms: Option<u64>,
    wanted: Wanted,
    sink: &mut dyn Sink,
) -> io::Result<Outcome> {
    let (prepared, faults) = runs::faults_of(prepared, seed, failure_free_ms);
    let mut view = View::new(sink);
    let wanted = Wanted {
        events: true,
        ..wanted
    };
    let mut look = |swarm: &Swarm| view.look(swarm);
    let mut watch = Watch {
        every_ms: FRAME_MS,
        look: &mut look,
    };
    let outcome = runs::watched(&prepared, seed, faults, wanted, Some(&mut watch));
    view.end(&outcome)?;
    Ok(outcome)
}

/// Looks at a swarm, and tells a sink what is new.
pub struct View<'a> {
    sink: &'a mut dyn Sink,
    observer: Option<Observer>,
    /// Entries of the history that were told.
    n_told: usize,
    framed_ms: Option<u64>,
    failed: Option<io::Error>,
}

impl<'a> View<'a> {
    /// Nothing was seen yet.
    #[must_use]
    pub fn new(sink: &'a mut dyn Sink) -> Self {
        Self {
            sink,
            observer: None,
            n_told: 0,
            framed_ms: None,
            failed: None,
        }
    }

    /// Tells what happened since the last look, and how everything stands. The swarm must keep
    /// its events.
    pub fn look(&mut self, swarm: &Swarm) {
        if self.failed.is_none()
            && let Err(why) = self.tell(swarm)
        {
            self.failed = Some(why);
        }
    }

    /// Tells what the run came to.
    ///
    /// # Errors
    /// The first one of the sink.
    pub fn end(mut self, outcome: &Outcome) -> io::Result<()> {
        if let Some(why) = self.failed {
            return Err(why);
        }
        if let Some(observer) = &mut self.observer {
            observer.end(&outcome.report);
            give(observer, self.sink)?;
        }
        Ok(())
    }

    fn tell(&mut self, swarm: &Swarm) -> io::Result<()> {
        let observer = self.observer.get_or_insert_with(|| {
            let seed = swarm.world().seed();
            Observer::new(swarm.spec(), swarm.geometry(), seed, Driver::Sim)
        });
        if let Some(geometry) = swarm.geometry() {
            observer.given(geometry);
        }
        for entry in &swarm.history().entries()[self.n_told..] {
            let time_ms = entry.time_ms;
            match &entry.what {
                What::Fault(fault) => observer.fault(time_ms, fault),
                What::Report { peer, report } => observer.reported(time_ms, *peer, report),
                What::Components(parts) => observer.connected(time_ms, parts),
                What::Covered => observer.all_covered(time_ms),
                What::Violation { check, peer, text } => {
                    observer.violated(time_ms, check, *peer, text);
                }
                What::ZoneEntry { peer, zone } => observer.zone_entered(time_ms, *peer, *zone),
                What::Lost { peer } => observer.lost(time_ms, *peer),
                What::TookOff { peer } => observer.took_off(time_ms, *peer),
                What::Failsafe { peer, on } => observer.failsafe(time_ms, *peer, *on),
            }
        }
        self.n_told = swarm.history().entries().len();
        give(observer, self.sink)?;
        let frame = observer.frame(swarm.world(), swarm.links(), &|id| swarm.runs(id));
        if self.framed_ms.replace(frame.time_ms) != Some(frame.time_ms) {
            self.sink.take(&Record::Frame(frame))?;
        }
        Ok(())
    }
}

/// Gives a sink what an observer has to say.
fn give(observer: &mut Observer, sink: &mut dyn Sink) -> io::Result<()> {
    let said: Vec<Record> = observer.take();
    said.iter().try_for_each(|record| sink.take(record))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::{Cell, Cells};
    use crate::model::Frame;
    use crate::model::event::{Event, What as Said};
    use crate::model::frame::State;
    use crate::sink::Collected;
    use skein_netsim::fault::{Fault, TimedFault};
    use skein_netsim::world::fixture::{square, square_losing};

    /// Three UAVs, one of which is killed.
    fn prepared() -> Prepared {
        Prepared::new(square_losing(3, 2, 30_000))
    }

    fn flown(prepared: &Prepared) -> (Outcome, Collected) {
        let mut run = Collected::default();
        let outcome = fly(prepared, 4, None, Wanted::default(), &mut run).unwrap();
        (outcome, run)
    }

    #[test]
    fn a_run_that_is_looked_at_is_the_same_run() {
        let prepared = prepared();
        let (watched, run) = flown(&prepared);
        let alone = runs::planned(&prepared, 4, Wanted::default());
        assert_eq!(watched.report, alone.report);
        assert_eq!(*run.end.unwrap().report, alone.report);
    }

    #[test]
    fn the_model_tells_the_run_as_its_report_does() {
        let (outcome, run) = flown(&prepared());
        let report = &outcome.report;
        assert!(report.completed, "{report}");
        let times: Vec<u64> = run.frames.iter().map(|f| f.time_ms).collect();
        assert!(times.is_sorted_by(|a, b| a < b));
        let gaps = times.windows(2).map(|t| t[1] - t[0]);
        assert!(gaps.max().unwrap() <= FRAME_MS + 200);
        let last = run.frames.last().unwrap();
        assert_eq!(last.covered_cells, report.coverage.covered_cells);
        let lost = last.uavs.iter().find(|u| u.id == 2).unwrap();
        assert_eq!((lost.state, lost.pose), (State::Lost, None));
        assert_eq!(lost.held_down_by.first(), Some(&1));
        // Whoever draws a map from scene and events ends with every needed cell covered, and
        // takeovers are those of the account.
        let mut cells = Cells::of(&run.scenes[0]);
        run.events.iter().for_each(|e| cells.happen(e));
        let needed = run.scenes[0].cells.iter().zip(cells.all());
        let left = needed.filter(|(c, is)| c.needed && !matches!(is, Cell::Covered(_)));
        assert_eq!(left.count(), 0);
        let taken: usize = (run.events.iter())
            .filter_map(|e| match &e.what {
                Said::Takeover { from: 2, cells, .. } => Some(cells.len()),
                _ => None,
            })
            .sum();
        let by_account: usize = report.kills[0].taken_over_by.iter().map(|t| t.cells).sum();
        assert!(taken > 0);
        assert_eq!(taken, by_account);
        let bids = |e: &Event| matches!(&e.what, Said::Bids { bids, .. } if bids.len() == 2);
        assert!(run.events.iter().any(bids));
    }

    #[test]
    fn what_is_told_reads_back_from_its_json() {
        let (_, run) = flown(&prepared());
        let event = &run.events[3];
        let json = serde_json::to_value(event).unwrap();
        assert_eq!(json["kind"], event.what.kind());
        for event in &run.events {
            let json = serde_json::to_string(event).unwrap();
            assert_eq!(&serde_json::from_str::<Event>(&json).unwrap(), event);
        }
        let json = serde_json::to_string(&run.scenes[0]).unwrap();
        let scene: crate::model::Scene = serde_json::from_str(&json).unwrap();
        assert_eq!(scene, run.scenes[0]);
        let end = run.end.unwrap();
        let json = serde_json::to_string(&end).unwrap();
        assert_eq!(
            serde_json::from_str::<crate::model::End>(&json).unwrap(),
            end
        );
        for frame in &run.frames {
            let json = serde_json::to_string(frame).unwrap();
            assert_eq!(&serde_json::from_str::<Frame>(&json).unwrap(), frame);
        }
    }

    #[test]
    fn a_sink_that_fails_ends_nothing_but_itself() {
        #[derive(Debug)]
        struct Full;
        impl Sink for Full {
            fn take(&mut self, record: &Record) -> io::Result<()> {
                match record {
                    Record::Frame(_) => Err(io::ErrorKind::StorageFull.into()),
                    _ => Ok(()),
                }
            }
        }
        let why = fly(&prepared(), 4, None, Wanted::default(), &mut Full).unwrap_err();
        assert_eq!(why.kind(), io::ErrorKind::StorageFull);
    }

    #[test]
    fn another_mission_begins_another_scene() {
        let mut spec = square(2);
        let zone = vec![(400_000, 400_000), (430_000, 400_000), (430_000, 430_000)];
        spec.faults = vec![TimedFault {
            at_ms: 20_000,
            fault: Fault::AddZone {
                name: "fire".to_owned(),
                ring: zone,
            },
        }];
        let (_, run) = flown(&Prepared::new(spec));
        assert_eq!(run.scenes.len(), 2);
        let [first, second] = &run.scenes[..] else {
            panic!("two scenes");
        };
        assert_eq!((first.revision, second.revision), (1, 2));
        assert_eq!(second.zones.last().unwrap().name, "fire");
        assert!(second.time_ms > 20_000 && second.zones.len() == first.zones.len() + 1);
    }
}
