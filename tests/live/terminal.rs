//! Commands on a terminal, as somebody sits at one.

use crate::support::ended;
use nix::pty::{Winsize, openpty};
use std::fs::File;
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

/// A command on a terminal of 100 columns and 30 rows.
pub struct OnTerminal {
    child: Child,
    keys: File,
    screen: thread::JoinHandle<String>,
}

impl OnTerminal {
    /// Starts it.
    pub fn start(mut command: Command) -> Self {
        let size = Winsize {
            ws_row: 30,
            ws_col: 100,
            ws_xpixel: 0,
            ws_ypixel: 0,
        };
        let pty = openpty(Some(&size), None).unwrap();
        let end = || Stdio::from(pty.slave.try_clone().unwrap());
        let child = command
            .env("TERM", "xterm-256color")
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .unwrap();
        let (keys, mut screen) = (
            File::from(pty.master.try_clone().unwrap()),
            File::from(pty.master),
        );
        let screen = thread::spawn(move || {
            let (mut all, mut part) = (Vec::new(), [0; 4096]);
            // The end of a terminal whose processes are gone is an error.
            while let Ok(n @ 1..) = screen.read(&mut part) {
                all.extend_from_slice(&part[..n]);
            }
            String::from_utf8_lossy(&all).into_owned()
        });
        Self {
            child,
            keys,
            screen,
        }
    }

    /// Types.
    pub fn press(&mut self, key: &str) {
        self.keys.write_all(key.as_bytes()).unwrap();
    }

    /// Waits for its end: the exit code, and all that was drawn.
    pub fn end(mut self, limit: Duration) -> (Option<i32>, String) {
        let code = ended(&mut self.child, limit);
        (code, self.screen.join().unwrap())
    }
}
