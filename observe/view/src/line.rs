//! The way from a driver to a thread that draws: bounded, so that a simulation runs no further
//! ahead of who looks at it than this, and a trial, which may not be held up, loses frames
//! where nobody takes them.

use skein_recording::{Record, Sink};
use std::io;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

/// Words on their way: some minutes of eight UAVs, some ten seconds of a hundred.
const WORDS: usize = 4096;

/// What happens where the line is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Full {
    /// The driver waits.
    Wait,
    /// A frame is left out; the next one says the same more lately.
    SkipFrames,
}

/// The driver's end.
#[derive(Debug)]
pub struct Line {
    words: SyncSender<Record>,
    full: Full,
}

/// A line, and where its words come out.
#[must_use]
pub fn line(full: Full) -> (Line, Receiver<Record>) {
    let (words, out) = sync_channel(WORDS);
    (Line { words, full }, out)
}

impl Sink for Line {
    fn take(&mut self, record: &Record) -> io::Result<()> {
        let gone = || io::Error::from(io::ErrorKind::BrokenPipe);
        if self.full == Full::SkipFrames && matches!(record, Record::Frame(_)) {
            return match self.words.try_send(record.clone()) {
                Ok(()) | Err(TrySendError::Full(_)) => Ok(()),
                Err(TrySendError::Disconnected(_)) => Err(gone()),
            };
        }
        self.words.send(record.clone()).map_err(|_| gone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_recording::Frame;

    #[test]
    fn frames_are_left_out_where_nobody_takes_them_and_nothing_else() {
        let (mut sink, out) = line(Full::SkipFrames);
        sink.take(&Record::Scene(Box::default())).unwrap();
        for time_ms in 0..=WORDS as u64 {
            let frame = Frame {
                time_ms,
                ..Frame::default()
            };
            sink.take(&Record::Frame(frame)).unwrap();
        }
        let came: Vec<Record> = out.try_iter().collect();
        assert_eq!(came.len(), WORDS);
        assert!(matches!(came[0], Record::Scene(_)));
        drop(out);
        assert!(sink.take(&Record::Frame(Frame::default())).is_err());
        assert!(sink.take(&Record::Scene(Box::default())).is_err());
    }
}
