//! The terminal, taken and given back: at the end, on an error, in a panic of any thread.

use crossterm::{cursor, execute, terminal};
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use std::io::{self, BufWriter, IsTerminal, Stderr, stderr};
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the terminal is taken at present.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Whether a map can be drawn in place: keys come from a terminal, and the picture goes to one
/// that can move its cursor.
#[must_use]
pub fn is_one() -> bool {
    let term = std::env::var("TERM").unwrap_or_default();
    io::stdin().is_terminal() && stderr().is_terminal() && !term.is_empty() && term != "dumb"
}

/// Whether the map stands on the terminal at present: who writes on stderr waits.
#[must_use]
pub fn is_taken() -> bool {
    TAKEN.load(Ordering::SeqCst)
}

/// The terminal while it is taken. Dropped, it is as it was.
#[derive(Debug)]
pub struct Screen {
    /// Where pictures are drawn: stderr, so that stdout stays for the report.
    pub terminal: Terminal<CrosstermBackend<BufWriter<Stderr>>>,
}

impl Screen {
    /// Takes the terminal.
    ///
    /// # Errors
    /// When it is none, or does not obey.
    pub fn take() -> io::Result<Self> {
        static HOOK: Once = Once::new();
        HOOK.call_once(|| {
            let before = std::panic::take_hook();
            std::panic::set_hook(Box::new(move |info| {
                give_back();
                before(info);
            }));
        });
        TAKEN.store(true, Ordering::SeqCst);
        let taken = terminal::enable_raw_mode()
            .and_then(|()| execute!(stderr(), terminal::EnterAlternateScreen, cursor::Hide))
            .and_then(|()| Terminal::new(CrosstermBackend::new(BufWriter::new(stderr()))));
        taken
            .map(|terminal| Self { terminal })
            .inspect_err(|_| give_back())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        give_back();
    }
}

/// Makes the terminal what it was; does nothing where it was not taken.
fn give_back() {
    if TAKEN.load(Ordering::SeqCst) {
        // Nothing better can be done where the terminal is gone.
        let _ = execute!(stderr(), terminal::LeaveAlternateScreen, cursor::Show);
        let _ = terminal::disable_raw_mode();
        TAKEN.store(false, Ordering::SeqCst);
    }
}
