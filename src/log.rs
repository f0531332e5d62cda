//! Where lines of the log go: to stderr, but not into a map that stands there.

use skein_terminal::screen;
use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};

/// Bytes that wait for the end of a map, at most.
const HELD_BYTES: usize = 64 << 10;

static HELD: Mutex<Vec<u8>> = Mutex::new(Vec::new());

/// Stderr, with patience.
#[derive(Clone, Copy, Debug)]
pub struct Log;

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if screen::is_taken() {
            let mut held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
            let room = HELD_BYTES.saturating_sub(held.len());
            held.extend(&bytes[..bytes.len().min(room)]);
            return Ok(bytes.len());
        }
        release();
        io::stderr().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes what waited.
pub fn release() {
    let held = std::mem::take(&mut *HELD.lock().unwrap_or_else(PoisonError::into_inner));
    // Where stderr is gone nobody reads it.
    let _ = io::stderr().write_all(&held);
}
