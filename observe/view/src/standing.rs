//! How all stands at one moment, folded from the words of a run.

use skein_geometry::frame::Point;
use skein_recording::cells::Cells;
use skein_recording::model::event::{Belief, What};
use skein_recording::model::frame::UavState;
use skein_recording::{End, Event, Frame, Record, Scene};
use std::collections::{BTreeMap, VecDeque};

/// Events that are kept: more than any screen shows.
const EVENTS: usize = 200;

/// Places of a trail: half a minute of flight at two a second.
const TRAIL: usize = 60;

/// A run at one moment.
#[derive(Debug, Default)]
pub struct Standing {
    /// The scene in force.
    pub scene: Option<Box<Scene>>,
    /// The newest frame.
    pub frame: Option<Frame>,
    /// Who has which cell.
    pub cells: Cells,
    /// What happened lately that is worth a line, the newest last.
    pub events: VecDeque<Event>,
    /// The last word, once it was said.
    pub end: Option<End>,
    /// Of each UAV that took cells over: how many of whom.
    pub took: BTreeMap<u16, BTreeMap<u16, usize>>,
    /// The least distance of each UAV to another so far, metres.
    pub nearest_m: BTreeMap<u16, f64>,
    /// Where each UAV was lately, the newest last; of a lost one, up to there.
    pub trails: BTreeMap<u16, VecDeque<Point>>,
    /// When each peer was heard last, milliseconds of scenario time.
    pub heard_ms: BTreeMap<u16, u64>,
}

impl Standing {
    /// Takes the next word.
    pub fn hear(&mut self, record: Record) {
        self.cells.hear(&record);
        match record {
            Record::Scene(scene) => self.scene = Some(scene),
            Record::Frame(frame) => self.stand(frame),
            Record::Event(event) => self.happen(event),
            Record::FailureFree(_) => {}
            Record::End(end) => self.end = Some(end),
        }
    }

    /// When it is, milliseconds of scenario time.
    #[must_use]
    pub fn time_ms(&self) -> u64 {
        self.frame.as_ref().map_or(0, |f| f.time_ms)
    }

    /// The UAVs of the newest frame, ascending.
    #[must_use]
    pub fn uavs(&self) -> &[UavState] {
        self.frame.as_ref().map_or(&[], |f| &f.uavs)
    }

    /// What people call a peer.
    #[must_use]
    pub fn name(&self, id: u16) -> String {
        let scene = self.scene.as_ref();
        let uav = scene.and_then(|s| s.uavs.iter().find(|u| u.id == id));
        uav.map_or_else(|| format!("uav{id}"), |u| u.name.clone())
    }

    fn stand(&mut self, frame: Frame) {
        for uav in &frame.uavs {
            if let Some(near_m) = uav.nearest_other_m {
                let least_m = self.nearest_m.entry(uav.id).or_insert(near_m);
                *least_m = least_m.min(near_m);
            }
            if let Some(pose) = &uav.pose {
                let trail = self.trails.entry(uav.id).or_default();
                trail.push_back(pose.place.point());
                if trail.len() > TRAIL {
                    trail.pop_front();
                }
            }
        }
        self.frame = Some(frame);
    }

    fn happen(&mut self, event: Event) {
        if let Some(id) = event.uav {
            self.heard_ms.insert(id, event.time_ms);
            if let What::Takeover { from, cells, .. } = &event.what {
                *self.took.entry(id).or_default().entry(*from).or_default() += cells.len();
            }
        }
        if worth_a_line(&event.what) {
            self.events.push_back(event);
            if self.events.len() > EVENTS {
                self.events.pop_front();
            }
        }
    }
}

/// Whether people read it each time that it happens.
#[must_use]
pub fn worth_a_line(what: &What) -> bool {
    match what {
        What::Covered { .. }
        | What::Claim { .. }
        | What::Bids { .. }
        | What::Round { .. }
        | What::Ready { .. }
        | What::Finished { .. } => false,
        What::Membership { belief, .. } => *belief == Belief::Down,
        What::Booted { incarnation } => *incarnation > 1,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_netsim::Prepared;
    use skein_netsim::runs::Wanted;
    use skein_netsim::world::fixture::square_losing;
    use skein_recording::sink::Collected;

    #[test]
    fn a_run_stands_in_the_end_as_its_report_says() {
        let spec = square_losing(3, 2, 30_000);
        let mut run = Collected::default();
        let prepared = Prepared::new(spec);
        skein_recording::simulated::fly(&prepared, 4, None, Wanted::default(), &mut run).unwrap();
        let mut standing = Standing::default();
        standing.hear(Record::Scene(Box::new(run.scenes[0].clone())));
        run.events
            .into_iter()
            .for_each(|e| standing.hear(Record::Event(e)));
        run.frames
            .into_iter()
            .for_each(|f| standing.hear(Record::Frame(f)));
        standing.hear(Record::End(run.end.clone().unwrap()));
        let report = run.end.unwrap().report;
        let taken: usize = standing.took.values().filter_map(|of| of.get(&2)).sum();
        let by_account: usize = report.kills[0].taken_over_by.iter().map(|t| t.cells).sum();
        assert_eq!(taken, by_account);
        assert!(taken > 0 && standing.nearest_m.len() == 3);
        assert_eq!(standing.trails[&1].len(), TRAIL);
        let kinds: Vec<&str> = standing.events.iter().map(|e| e.what.kind()).collect();
        assert!(kinds.contains(&"takeover") && !kinds.contains(&"covered"));
        assert_eq!(standing.name(1), "uav1");
    }
}
