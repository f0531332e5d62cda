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

/// The commands of the README and of the documents beside it: `skein` and its words, as they
/// stand in shell blocks and between backticks.
fn named_commands(text: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut fenced = false;
    for line in text.lines() {
        if line.starts_with(FENCE) {
            fenced = line == "```sh" && !fenced;
            continue;
        }
        let indented = line.strip_prefix("    ").unwrap_or_default();
        let parts: Vec<&str> = if fenced {
            vec![line]
        } else if indented.starts_with("skein ") {
            vec![indented]
        } else {
            line.split('`').skip(1).step_by(2).collect()
        };
        for part in parts {
            let part = part.split(" #").next().unwrap_or_default();
            let part = part.split([';', '>', '|', '&']).next().unwrap_or_default();
            let Some(words) = part.trim().strip_prefix("skein ") else {
                continue;
            };
            let words = words.split_whitespace();
            found.push(words.map(|w| w.trim_matches('\'').to_owned()).collect());
        }
    }
    found
}

/// Words that stand for something else, such as `SCENARIO`, `[--k K]`, `A..B` or `...`.
fn is_a_pattern(words: &[String]) -> bool {
    words.iter().any(|w| {
        // Such as N, FILE, A..B and UAV@SECONDS.
        let letters = |part: &str| {
            !part.is_empty() && part.chars().all(|c| c.is_ascii_uppercase() || c == '_')
        };
        let named = w.split(['.', '@']).any(letters);
        named || w.contains(['[', '…', '|', '\\', '$', '{']) || w.contains("...")
    })
}

#[test]
fn every_command_that_documents_name_is_understood() {
    let folder = fs::read_dir(root().join("docs")).unwrap();
    let mut files: Vec<PathBuf> = folder.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "md"));
    files.push(root().join("README.md"));
    let mut understood = 0;
    for file in files {
        for mut words in named_commands(&fs::read_to_string(&file).unwrap()) {
            if is_a_pattern(&words) {
                continue;
            }
            // All that stands before it is parsed, and nothing is done.
            words.push("--help".to_owned());
            let out = Command::new(env!("CARGO_BIN_EXE_skein"))
                .args(&words)
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&out.stderr);
            let named = file.display();
            assert!(
                out.status.success(),
                "{named}: skein {}: {said}",
                words.join(" ")
            );
            understood += 1;
        }
    }
    assert!(understood > 40, "{understood} commands were found");
}
