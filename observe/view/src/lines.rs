//! A run as text: one word of the model a line, as a JSON object with the kind of the word as its
//! one field.

use skein_recording::{Record, Sink};
use std::fmt::Debug;
use std::io::{self, BufRead, Read as _, Write};

/// The longest line that is read, bytes: a scene of 65,000 cells takes half of it.
const LINE_BYTES: u64 = 64 << 20;

/// Writes lines.
#[derive(Debug)]
pub struct Lines<W>(pub W);

impl<W: Write + Debug + Send> Sink for Lines<W> {
    fn take(&mut self, record: &Record) -> io::Result<()> {
        serde_json::to_writer(&mut self.0, record)?;
        self.0.write_all(b"\n")?;
        match record {
            Record::End(_) => self.0.flush(),
            _ => Ok(()),
        }
    }
}

/// Why a recording cannot be read on.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be read.
    #[error("line {line}: {cause}")]
    Io {
        /// Counted from 1.
        line: usize,
        /// Why.
        cause: io::Error,
    },
    /// It is no word of a run.
    #[error("line {line} is no word of a run: {cause}")]
    Word {
        /// Counted from 1.
        line: usize,
        /// Why.
        cause: serde_json::Error,
    },
    /// It is longer than any word of a run.
    #[error("line {line} is longer than {} MiB: this is no recording", LINE_BYTES >> 20)]
    Long {
        /// Counted from 1.
        line: usize,
    },
}

/// The words of a recording, whatever its form; the last one where it ends or cannot be read on.
pub type Words = Box<dyn Iterator<Item = Result<Record, ReadError>> + Send>;

/// The words of lines.
#[must_use]
pub fn read(file: impl BufRead + Send + 'static) -> Words {
    let mut file = file;
    let (mut line, mut over) = (0, false);
    Box::new(std::iter::from_fn(move || {
        if over {
            return None;
        }
        line += 1;
        let word = next(&mut file, line);
        over = matches!(word, Some(Err(_)));
        word
    }))
}

fn next(file: &mut impl BufRead, line: usize) -> Option<Result<Record, ReadError>> {
    let mut bytes = Vec::new();
    match file.by_ref().take(LINE_BYTES).read_until(b'\n', &mut bytes) {
        Err(cause) => return Some(Err(ReadError::Io { line, cause })),
        Ok(0) => return None,
        Ok(n) if n as u64 == LINE_BYTES && !bytes.ends_with(b"\n") => {
            return Some(Err(ReadError::Long { line }));
        }
        Ok(_) => {}
    }
    let word = serde_json::from_slice(&bytes);
    Some(word.map_err(|cause| ReadError::Word { line, cause }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_netsim::Prepared;
    use skein_netsim::runs::Wanted;
    use skein_netsim::world::fixture::square;
    use skein_recording::sink::Collected;

    fn written() -> Vec<u8> {
        let mut lines = Lines(Vec::new());
        let prepared = Prepared::new(square(2));
        skein_recording::simulated::fly(&prepared, 3, None, Wanted::default(), &mut lines).unwrap();
        lines.0
    }

    #[test]
    fn a_run_reads_back_from_its_lines() {
        let mut run = Collected::default();
        let prepared = Prepared::new(square(2));
        skein_recording::simulated::fly(&prepared, 3, None, Wanted::default(), &mut run).unwrap();
        let mut read_back = Collected::default();
        for word in read(io::Cursor::new(written())) {
            read_back.take(&word.unwrap()).unwrap();
        }
        assert_eq!(read_back.scenes, run.scenes);
        assert_eq!(read_back.events, run.events);
        assert_eq!(read_back.frames, run.frames);
        // Numbers of the report are not rounded, and the last bit of one may be read otherwise.
        let (read_back, run) = (read_back.end.unwrap(), run.end.unwrap());
        assert_eq!(read_back.time_ms, run.time_ms);
        assert_eq!(read_back.report.coverage, run.report.coverage);
    }

    #[test]
    fn a_run_that_was_cut_off_or_is_none_says_where() {
        let mut bytes = written();
        bytes.truncate(bytes.len() - 40);
        let n = bytes.split(|b| *b == b'\n').count();
        let words: Vec<_> = read(io::Cursor::new(bytes)).collect();
        assert_eq!(words.len(), n);
        let why = words.last().unwrap().as_ref().unwrap_err().to_string();
        assert!(
            why.starts_with(&format!("line {n} is no word of a run")),
            "{why}"
        );
        for text in [
            "{}",
            "\n",
            "{\"scene\":{}}",
            "[1]",
            "{\"frame\":{\"time_ms\":-1}}",
        ] {
            let words: Vec<_> = read(io::Cursor::new(text.as_bytes())).collect();
            assert_eq!(words.len(), 1, "{text}");
            assert!(words[0].is_err(), "{text}");
        }
        assert_eq!(read(io::Cursor::new("")).count(), 0);
    }
}
