//! Every rule that a check can name has a row in docs/protocol.md §8, and every row that
//! is built names files that speak of the rule.

#![allow(
    clippy::unwrap_used,
    reason = "a test may; the lint's own exception does not reach helpers"
)]

use crate::documents::{root, rows_under, sources, ticked};
use std::collections::{BTreeMap, BTreeSet};

/// `S3`, `I1`, `L7`: a letter of the protocol and a number.
fn is_rule(text: &str) -> bool {
    let mut letters = text.chars();
    matches!(letters.next(), Some('S' | 'I' | 'L'))
        && (2..=3).contains(&text.len())
        && letters.all(|c| c.is_ascii_digit())
}

/// The names under which Rust source breaks rules: all literals of a rule's form, and
/// whatever literal is handed to `broken(`.
fn named(text: &str) -> BTreeSet<String> {
    let literals = text.split('"').skip(1).step_by(2).filter(|l| is_rule(l));
    let broken = text.split("broken(").skip(1).filter_map(|rest| {
        let rest = rest.trim_start().strip_prefix('"')?;
        rest.split('"').next()
    });
    literals.chain(broken).map(str::to_owned).collect()
}

struct Row {
    files: Vec<String>,
    hardness: String,
}

fn rows() -> BTreeMap<String, Row> {
    let text = std::fs::read_to_string(root().join("docs/protocol.md")).unwrap();
    let mut rows = BTreeMap::new();
    for cells in rows_under(&text, "## 8. What must hold") {
        assert_eq!(cells.len(), 6, "{cells:?}");
        let row = Row {
            files: ticked(&cells[4]),
            hardness: cells[3].clone(),
        };
        let twice = rows.insert(cells[0].clone(), row);
        assert!(twice.is_none(), "{} has two rows", cells[0]);
    }
    rows
}

#[test]
fn every_name_of_a_check_has_a_row_in_the_protocol() {
    let rows = rows();
    let mut names = BTreeSet::new();
    for file in sources(&["netsim/sim/src"]) {
        for name in named(&std::fs::read_to_string(&file).unwrap()) {
            assert!(
                rows.contains_key(&name),
                "{} breaks {name}, which has no row in docs/protocol.md §8",
                file.display()
            );
            names.insert(name);
        }
    }
    assert!(names.len() >= 18, "only {names:?} were found");
}

#[test]
fn every_row_of_a_built_check_names_files_that_speak_of_it() {
    for (name, row) in rows() {
        if row.hardness == "not built" {
            assert!(row.files.is_empty(), "{name} is not built");
            continue;
        }
        assert!(!row.files.is_empty(), "{name} names no file");
        for file in &row.files {
            let text = std::fs::read_to_string(root().join(file))
                .unwrap_or_else(|e| panic!("{name}: {file}: {e}"));
            let speaks = if row.hardness.starts_with("recorded") {
                text.contains(&name)
            } else {
                named(&text).contains(&name)
            };
            assert!(speaks, "{file} does not speak of {name}");
        }
    }
}
