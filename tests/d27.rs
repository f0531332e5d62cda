//! The table of D2.7 names files and tests that exist.

#![allow(
    clippy::unwrap_used,
    reason = "a test may; the lint's own exception does not reach helpers"
)]

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_path_buf()
}

/// All Rust source of the workspace in one string.
fn all_source() -> String {
    let mut open: Vec<PathBuf> = [
        "planning",
        "behaviors",
        "runtime",
        "netsim",
        "interop",
        "bench",
        "tests",
        "src",
    ]
    .map(|f| root().join(f))
    .to_vec();
    let mut text = String::new();
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(path).unwrap().map(|e| e.unwrap().path()));
        } else if path.extension().is_some_and(|e| e == "rs") {
            text.push_str(&std::fs::read_to_string(path).unwrap());
        }
    }
    text
}

#[test]
fn every_section_names_a_file_and_a_test_that_exist() {
    let table = std::fs::read_to_string(root().join("docs/d27.md")).unwrap();
    let source = all_source();
    let mut sections = 0;
    for line in table
        .lines()
        .filter(|l| l.starts_with("| ") && !l.starts_with("| section"))
    {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        assert_eq!(cells.len(), 5, "{line}");
        sections += 1;
        let (file, test) = (cells[2].trim_matches('`'), cells[3].trim_matches('`'));
        if file == "–" {
            assert_eq!((test, cells[4]), ("–", "later"), "{line}");
            continue;
        }
        assert!(root().join(file).exists(), "{}: no file {file}", cells[0]);
        assert!(
            source.contains(&format!("fn {test}(")),
            "{}: no test {test}",
            cells[0]
        );
    }
    assert!(sections >= 28, "only {sections} sections are traced");
}
