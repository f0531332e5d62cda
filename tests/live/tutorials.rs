//! Every command of the tutorials is run, as they are written, from an empty directory.

#![allow(
    clippy::unwrap_used,
    reason = "a test may panic; the lint's own exception knows no test without a harness"
)]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// How the commands of a shell block begin and end.
const FENCE: &str = "```";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The pages, by name.
fn pages() -> Vec<PathBuf> {
    let all = fs::read_dir(root().join("docs/tutorial")).unwrap();
    let mut pages: Vec<PathBuf> = all.map(|entry| entry.unwrap().path()).collect();
    pages.sort();
    pages
}

/// The shell blocks of a page as one script, which says which block it is in.
fn script(page: &Path) -> (usize, String) {
    let text = fs::read_to_string(page).unwrap();
    let mut script = String::from("set -eu\nskein() { \"$SKEIN\" \"$@\"; }\n");
    let (mut blocks, mut inside) = (0, false);
    for (number, line) in text.lines().enumerate() {
        if inside && line == FENCE {
            inside = false;
        } else if inside {
            script.push_str(line);
            script.push('\n');
        } else if line == "```sh" {
            (blocks, inside) = (blocks + 1, true);
            writeln!(script, "echo \"== line {}\"", number + 2).unwrap();
        }
    }
    assert!(!inside, "{}: a block has no end", page.display());
    (blocks, script)
}

#[test]
fn every_command_of_the_tutorials_does_what_it_says() {
    let mut run = 0;
    for page in pages() {
        let (blocks, script) = script(&page);
        run += blocks;
        if blocks == 0 {
            continue;
        }
        let (place, tmp) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let out = Command::new("bash")
            .args(["-c", &script])
            .current_dir(place.path())
            .env("SKEIN", env!("CARGO_BIN_EXE_skein"))
            .env("TMPDIR", tmp.path())
            .stdin(Stdio::null())
            .output()
            .unwrap();
        assert!(
            out.status.success(),
            "{}: {}\n{}{}",
            page.display(),
            out.status,
            String::from_utf8_lossy(&out.stdout),
            String::from_utf8_lossy(&out.stderr)
        );
    }
    assert!(run >= 15, "{run} blocks were found");
}
