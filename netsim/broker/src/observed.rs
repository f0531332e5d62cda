//! What a trial tells those who look at it: a thread of its own gives it to their sinks, so that
//! none of them holds the world up.

use skein_netsim::Prepared;
use skein_netsim::fault::Fault;
use skein_netsim::spec::Spec;
use skein_netsim::world::{Fact, Loss};
use skein_peer::Report;
use skein_peer::offload::MissionGeometry;
use skein_recording::failure_free::Beside;
use skein_recording::model::scene::Driver;
use skein_recording::simulated::FRAME_MS;
use skein_recording::sink::Tee;
use skein_recording::{Observer, Record, Sink};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use crate::live_world::LiveWorld;

/// Words that may wait for the sinks. Eight UAVs say some ten a second of scenario time, a
/// hundred some hundred: this is a minute of theirs at least.
const MAX_WAITING: usize = 8192;

/// A trial of so many UAVs is compared with a simulated run without failures, which takes some
/// seconds of one core beside it; of more that would slow its peers down.
const MAX_COMPARED: usize = 32;

/// The observer of one trial, and the thread of its sinks.
#[derive(Debug)]
pub(crate) struct Observed {
    observer: Observer,
    /// None where nobody looks, or the sinks were too slow.
    words: Option<SyncSender<Record>>,
    thread: Option<JoinHandle<()>>,
    /// The run without failures, until it was told.
    beside: Option<Beside>,
    frame_due_ms: u64,
}

impl Observed {
    /// Of a trial that has not begun.
    pub(crate) fn new(
        spec: &Spec,
        geometry: &Arc<MissionGeometry>,
        seed: u64,
        sinks: Vec<Box<dyn Sink>>,
    ) -> std::io::Result<Self> {
        let (mut words, mut thread) = (None, None);
        if !sinks.is_empty() {
            let (sender, receiver) = sync_channel(MAX_WAITING);
            let tee = Tee::new(sinks);
            let builder = std::thread::Builder::new().name("observed".to_owned());
            thread = Some(builder.spawn(move || give(&receiver, tee))?);
            words = Some(sender);
        }
        let mut observed = Self {
            observer: Observer::new(spec, Some(geometry), seed, Driver::Live),
            words,
            thread,
            beside: None,
            frame_due_ms: 0,
        };
        observed.flush();
        if observed.words.is_some() && spec.uavs.len() <= MAX_COMPARED {
            let (spec, geometry) = (spec.clone(), Arc::clone(geometry));
            let prepare = move || Prepared::with_geometry(spec, geometry);
            observed.beside = Some(Beside::begin(prepare, seed)?);
        }
        Ok(observed)
    }

    /// Tells the observer something.
    pub(crate) fn tell(&mut self, what: impl FnOnce(&mut Observer)) {
        if self.words.is_some() {
            what(&mut self.observer);
            self.flush();
        }
    }

    /// A peer reported something.
    pub(crate) fn reported(&mut self, now_ms: u64, peer: u16, report: &Report) {
        self.tell(|o| o.reported(now_ms, peer, report));
    }

    /// A fault was carried out.
    pub(crate) fn fault(&mut self, now_ms: u64, fault: &Fault) {
        self.tell(|o| o.fault(now_ms, fault));
    }

    /// The world recorded something.
    pub(crate) fn fact(&mut self, now_ms: u64, fact: &Fact) {
        self.tell(|o| match *fact {
            Fact::ZoneEntry { uav, zone, .. } => o.zone_entered(now_ms, uav, zone),
            Fact::Lost { uav, cause, .. } if cause != Loss::Killed => o.lost(now_ms, uav),
            Fact::TookOff { uav, .. } => o.took_off(now_ms, uav),
            Fact::Failsafe { uav, on, .. } => o.failsafe(now_ms, uav, on),
            Fact::Lost { .. }
            | Fact::Seen { .. }
            | Fact::TooClose(_)
            | Fact::Intruded(_)
            | Fact::Collided(_) => {}
        });
    }

    /// The world made a step.
    pub(crate) fn stepped(&mut self, now_ms: u64, world: &LiveWorld, runs: &dyn Fn(u16) -> bool) {
        if self.words.is_none() || now_ms < self.frame_due_ms {
            return;
        }
        self.frame_due_ms = now_ms + FRAME_MS;
        if let Some(flown) = self.beside.as_ref().and_then(Beside::poll) {
            self.beside = None;
            self.send(Record::FailureFree(flown));
        }
        let frame = self.observer.frame(world.world(), world.links(), runs);
        self.send(Record::Frame(frame));
    }

    /// Waits until the sinks have taken everything. Whoever is on the runtime's threads says so
    /// to the runtime.
    pub(crate) fn close(mut self) {
        drop(self.words.take());
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("a sink of the trial panicked");
        }
    }

    fn flush(&mut self) {
        for record in self.observer.take() {
            self.send(record);
        }
    }

    fn send(&mut self, record: Record) {
        if let Some(words) = &self.words
            && words.try_send(record).is_err()
        {
            tracing::warn!("whoever looks at the trial is too slow, and is told no more");
            self.words = None;
        }
    }
}

/// Gives words to sinks until there are no more of either.
fn give(words: &Receiver<Record>, mut sinks: Tee) {
    for record in words {
        for why in sinks.give(&record) {
            tracing::warn!(%why, "a sink of the trial takes no more");
        }
        if sinks.is_empty() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_netsim::geometry_of;
    use skein_netsim::world::fixture::square;
    use std::io;
    use std::sync::Mutex;

    /// Counts what it is given, until it may not.
    #[derive(Debug, Clone)]
    struct Counting(Arc<Mutex<(usize, usize)>>);

    impl Counting {
        fn count(&self) -> io::Result<()> {
            let mut counts = self.0.lock().unwrap();
            counts.0 += 1;
            if counts.0 <= counts.1 {
                Ok(())
            } else {
                Err(io::ErrorKind::BrokenPipe.into())
            }
        }
    }

    impl Sink for Counting {
        fn take(&mut self, record: &Record) -> io::Result<()> {
            // It comes when it comes.
            if matches!(record, Record::FailureFree(_)) {
                return Ok(());
            }
            self.count()
        }
    }

    fn told(limit: usize) -> usize {
        let spec = square(2);
        let geometry = geometry_of(&spec.mission).unwrap();
        let counts = Arc::new(Mutex::new((0, limit)));
        let sinks: Vec<Box<dyn Sink>> = vec![Box::new(Counting(Arc::clone(&counts)))];
        let mut observed = Observed::new(&spec, &geometry, 1, sinks).unwrap();
        let mut world = LiveWorld::new(&spec, &geometry, 1);
        for now_ms in (50..=2_000).step_by(50) {
            world.advance(now_ms);
            observed.stepped(now_ms, &world, &|_| true);
        }
        observed.fault(2_000, &Fault::Kill { peer: 1 });
        observed.close();
        counts.lock().unwrap().0
    }

    #[test]
    fn a_sink_is_given_the_scene_frames_and_events_in_a_thread() {
        // A scene, frames at 50, 550, 1050 and 1550 ms, a fault and what it ended.
        assert_eq!(told(usize::MAX), 1 + 4 + 2);
        // One that fails is given no more.
        assert_eq!(told(2), 3);
    }
}
