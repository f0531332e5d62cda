//! docs/d27.md names files that are there, and tests that are `#[test]` functions where
//! the table says they stand.

#![allow(
    clippy::unwrap_used,
    reason = "a test may; the lint's own exception does not reach helpers"
)]

use crate::documents::{root, rows_under, ticked};
use std::path::PathBuf;

/// Where the tests of a file stand: in itself, and in the folder of its module.
fn module_of(file: &str) -> Vec<PathBuf> {
    let path = root().join(file);
    let folder = if path
        .file_name()
        .is_some_and(|n| n == "mod.rs" || n == "lib.rs")
    {
        path.parent().unwrap().to_path_buf()
    } else {
        path.with_extension("")
    };
    let mut open = vec![folder];
    let mut files = vec![path];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(path).unwrap().map(|e| e.unwrap().path()));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

/// Whether source has a function of this name that is run as a test: `#[test]`, or another
/// attribute that ends so, stands above it, with only attributes between.
fn tests(source: &str, name: &str) -> bool {
    let head = format!("fn {name}(");
    let lines: Vec<&str> = source.lines().map(str::trim).collect();
    let at = lines.iter().position(|l| {
        let rest = l.strip_prefix("async ").unwrap_or(l);
        rest.starts_with(&head)
    });
    let Some(at) = at else {
        return false;
    };
    let above = lines[..at].iter().rev();
    above
        .take_while(|l| !l.is_empty() && !l.ends_with(['}', '{']))
        .any(|l| l.starts_with("#[test]") || l.starts_with("#[tokio::test"))
}

#[test]
fn every_statement_names_a_file_and_a_test_that_notices() {
    let table = std::fs::read_to_string(root().join("docs/d27.md")).unwrap();
    let mut built = 0;
    let rows = rows_under(&table, "# D2.7, statement by statement");
    for row in &rows {
        let [section, statement, file, test, state] = row.as_slice() else {
            panic!("{row:?} has not five cells");
        };
        let place = format!("{section} ({statement})");
        if file == "–" {
            assert_eq!(test, "–", "{place}");
            assert!(state.starts_with("not built"), "{place}");
            continue;
        }
        built += 1;
        let files = ticked(file);
        assert!(root().join(&files[0]).exists(), "{place}: no file {file}");
        let test = ticked(test);
        let places = match test.as_slice() {
            [_] => module_of(&files[0]),
            [_, other] => vec![root().join(other)],
            _ => panic!("{place}: `test` or `test` in `file` is wanted"),
        };
        let found = places
            .iter()
            .filter_map(|p| std::fs::read_to_string(p).ok())
            .any(|source| tests(&source, &test[0]));
        assert!(found, "{place}: no test {} in {places:?}", test[0]);
    }
    assert!(built >= 70, "only {built} statements are built");
}

#[test]
fn a_test_is_told_from_a_function_of_its_name() {
    let source = "#[test]\nfn a() {}\n\n/// Not one.\nfn b() {}\n    #[test]\n    fn c(\n        x: u8,\n    ) {}";
    let found = ["a", "b", "c", "d"].map(|name| tests(source, name));
    assert_eq!(found, [true, false, true, false]);
}
