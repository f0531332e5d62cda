//! Every command of the tutorials is run, as they are written, from an empty directory; what
//! other documents name is at least understood.

use crate::commands::{is_a_pattern, named, script, words};
use crate::support::{alone, root};
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The pages, by name.
fn pages() -> Vec<PathBuf> {
    let all = fs::read_dir(root().join("docs/tutorial")).unwrap();
    let mut pages: Vec<PathBuf> = all.map(|entry| entry.unwrap().path()).collect();
    pages.sort();
    pages
}

#[test]
fn every_command_of_the_tutorials_does_what_it_says() {
    let _alone = alone();
    let mut run = 0;
    for page in pages() {
        let (blocks, script) = script(&fs::read_to_string(&page).unwrap());
        let script = format!("set -eu\nskein() {{ \"$SKEIN\" \"$@\"; }}\n{script}");
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

#[test]
fn every_command_that_documents_name_is_understood() {
    let folder = fs::read_dir(root().join("docs")).unwrap();
    let mut files: Vec<PathBuf> = folder.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "md"));
    files.push(root().join("README.md"));
    let mut understood = 0;
    for file in files {
        for command in named(&fs::read_to_string(&file).unwrap()) {
            if is_a_pattern(&command) {
                continue;
            }
            let mut words = words(&command);
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
