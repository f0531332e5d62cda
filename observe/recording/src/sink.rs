//! Who takes the words of a run.

use crate::model::{End, Event, FailureFree, Frame, Record, Scene};
use std::fmt::Debug;
use std::io;

/// Takes what a run shows, in the order of its times: a scene first, another one wherever the
/// mission changes, and the end last.
///
/// A sink is called by the driver itself and holds it up: whoever may wait for a disk, a socket
/// or a screen hands the words to a thread of its own.
pub trait Sink: Debug + Send {
    /// One word.
    ///
    /// # Errors
    /// When it cannot be taken; the driver tells so once and gives no more.
    fn take(&mut self, record: &Record) -> io::Result<()>;
}

/// A whole run in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Collected {
    /// One, and one more for each time the mission changed.
    pub scenes: Vec<Scene>,
    /// In the order of time.
    pub frames: Vec<Frame>,
    /// In the order of time.
    pub events: Vec<Event>,
    /// None where it is not known.
    pub failure_free: Option<FailureFree>,
    /// None where the run was cut off.
    pub end: Option<End>,
}

impl Sink for Collected {
    fn take(&mut self, record: &Record) -> io::Result<()> {
        match record {
            Record::Scene(scene) => self.scenes.push(Scene::clone(scene)),
            Record::Frame(frame) => self.frames.push(frame.clone()),
            Record::Event(event) => self.events.push(event.clone()),
            Record::FailureFree(run) => self.failure_free = Some(run.clone()),
            Record::End(end) => self.end = Some(end.clone()),
        }
        Ok(())
    }
}

/// Several sinks at once: one that fails gets no more, the others go on.
#[derive(Debug, Default)]
pub struct Tee {
    sinks: Vec<Box<dyn Sink>>,
}

impl Tee {
    /// These.
    #[must_use]
    pub fn new(sinks: Vec<Box<dyn Sink>>) -> Self {
        Self { sinks }
    }

    /// Whether nobody takes anything any more.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sinks.is_empty()
    }

    /// Gives a word to each; says which failed, and why.
    pub fn give(&mut self, record: &Record) -> Vec<io::Error> {
        let mut failed = Vec::new();
        self.sinks.retain_mut(|sink| match sink.take(record) {
            Ok(()) => true,
            Err(why) => {
                failed.push(why);
                false
            }
        });
        failed
    }
}
