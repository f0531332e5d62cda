//! The documents say what is there: paths and links lead somewhere, terms and tables are
//! those of the code, decisions have one form and are listed.

#![allow(
    clippy::unwrap_used,
    reason = "a test may; the lint's own exception does not reach helpers"
)]

use skein_peer::wire::kinds;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The folder of the workspace.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_path_buf()
}

/// Files below the given folders whose names end like this, in order.
fn files(folders: &[&str], extension: &str) -> Vec<PathBuf> {
    let mut open: Vec<PathBuf> = folders.iter().map(|f| root().join(f)).collect();
    let mut out = Vec::new();
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(path).unwrap().map(|e| e.unwrap().path()));
        } else if path.extension().is_some_and(|e| e == extension) {
            out.push(path);
        }
    }
    out.sort();
    out
}

/// Rust files below the given folders.
pub(crate) fn sources(folders: &[&str]) -> Vec<PathBuf> {
    files(folders, "rs")
}

/// What stands in backticks.
pub(crate) fn ticked(text: &str) -> Vec<String> {
    let inner = text.split('`').skip(1).step_by(2);
    inner.map(str::to_owned).collect()
}

/// The cells of one row of a table.
fn cells(line: &str) -> Vec<String> {
    let inner = line
        .trim()
        .strip_prefix('|')
        .and_then(|l| l.strip_suffix('|'));
    let inner = inner.unwrap_or_else(|| panic!("{line} is no row"));
    inner.split('|').map(|c| c.trim().to_owned()).collect()
}

/// The rows of the tables under a heading, up to the next of its level, without their heads.
pub(crate) fn rows_under(text: &str, heading: &str) -> Vec<Vec<String>> {
    let level = heading.split(' ').next().unwrap();
    let lines: Vec<&str> = text
        .lines()
        .skip_while(|l| *l != heading)
        .skip(1)
        .take_while(|l| !l.starts_with(&format!("{level} ")))
        .collect();
    let is_rule = |l: &str| l.starts_with("|---");
    let mut rows = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let is_head = lines.get(i + 1).is_some_and(|next| is_rule(next));
        if line.starts_with('|') && !is_rule(line) && !is_head {
            rows.push(cells(line));
        }
    }
    assert!(!rows.is_empty(), "no table under {heading}");
    rows
}

/// All documents: those at the root, `docs`, and the notes beside data.
fn documents() -> Vec<PathBuf> {
    let mut all = files(&["docs", "configs", "bench/data"], "md");
    for name in ["README.md", "ARCHITECTURE.md", "CHANGELOG.md"] {
        all.push(root().join(name));
    }
    all
}

/// The text without blocks of code.
fn prose(text: &str) -> String {
    text.split("```").step_by(2).collect()
}

/// Folders at the root: what begins like one of them is a path of ours.
fn folders() -> BTreeSet<String> {
    let entries = std::fs::read_dir(root()).unwrap().map(|e| e.unwrap());
    entries
        .filter(|e| e.path().is_dir())
        .map(|e| e.file_name().into_string().unwrap())
        .filter(|name| name != "target")
        .collect()
}

#[test]
fn paths_that_documents_name_exist() {
    let folders = folders();
    let mut named = 0;
    for document in documents() {
        // What was decided may speak of files that have moved since.
        if document.parent().unwrap().ends_with("decisions") {
            continue;
        }
        let text = prose(&std::fs::read_to_string(&document).unwrap());
        for path in ticked(&text) {
            let first = path.split('/').next().unwrap();
            let is_path = path.contains('/')
                && folders.contains(first)
                && !path.contains([' ', '<', '>', '{', '*', ':']);
            if is_path {
                named += 1;
                assert!(
                    root().join(&path).exists(),
                    "{}: there is no {path}",
                    document.display()
                );
            }
        }
    }
    assert!(named >= 60, "only {named} paths were found");
}

#[test]
fn links_between_documents_lead_somewhere() {
    let mut followed = 0;
    for document in documents() {
        let text = prose(&std::fs::read_to_string(&document).unwrap());
        for link in text.split("](").skip(1) {
            let target = link.split(')').next().unwrap();
            let target = target.split('#').next().unwrap();
            if target.is_empty() || target.contains("://") {
                continue;
            }
            followed += 1;
            assert!(
                document.parent().unwrap().join(target).exists(),
                "{} links to {target}, which is not there",
                document.display()
            );
        }
    }
    assert!(followed >= 40, "only {followed} links were found");
}

/// The first table in the module documentation of a file.
fn table_of_module(file: &str) -> String {
    let text = std::fs::read_to_string(root().join(file)).unwrap();
    let lines: Vec<&str> = text
        .lines()
        .map_while(|l| l.strip_prefix("//!").map(str::trim))
        .skip_while(|l| !l.starts_with('|'))
        .take_while(|l| l.starts_with('|'))
        .collect();
    assert!(lines.len() > 2, "{file} has no table");
    lines.join("\n")
}

#[test]
fn the_tables_of_the_protocol_are_those_of_the_code() {
    let text = std::fs::read_to_string(root().join("docs/protocol.md")).unwrap();
    let mut tables = 0;
    for part in text.split("<!-- table: ").skip(1) {
        let (file, rest) = part.split_once(" -->\n").unwrap();
        let table: Vec<&str> = rest.lines().take_while(|l| l.starts_with('|')).collect();
        assert_eq!(
            table.join("\n"),
            table_of_module(file),
            "docs/protocol.md has another table than {file}"
        );
        tables += 1;
    }
    assert_eq!(tables, 41);
    assert!(
        text.contains(&kinds::docs_table()),
        "docs/protocol.md §7 wants this table:\n{}",
        kinds::docs_table()
    );
}

#[test]
fn every_term_of_the_glossary_is_in_the_code() {
    let text = std::fs::read_to_string(root().join("docs/glossary.md")).unwrap();
    let mut terms = BTreeSet::new();
    let headings: Vec<&str> = text.lines().filter(|l| l.starts_with("## ")).collect();
    for heading in headings {
        for row in rows_under(&text, heading) {
            assert_eq!(row.len(), 4, "{row:?}");
            let (term, code) = (&row[0], ticked(&row[3]));
            assert!(terms.insert(term.clone()), "{term} stands there twice");
            let [name, file] = code.as_slice() else {
                panic!("{term}: `name` in `file` is wanted");
            };
            let source = std::fs::read_to_string(root().join(file))
                .unwrap_or_else(|e| panic!("{term}: {file}: {e}"));
            assert!(
                defines(&source, name),
                "{term}: {file} does not define {name}"
            );
        }
    }
    assert!(terms.len() >= 60, "only {} terms", terms.len());
}

#[test]
fn what_the_map_names_in_a_file_is_defined_there() {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let mut found = 0;
    for part in text.split("` in `").collect::<Vec<_>>().windows(2) {
        let name = part[0].rsplit('`').next().unwrap();
        let name = name.rsplit("::").next().unwrap();
        let file = part[1].split('`').next().unwrap();
        let source = std::fs::read_to_string(root().join(file))
            .unwrap_or_else(|e| panic!("{name} in {file}: {e}"));
        assert!(defines(&source, name), "{file} does not define {name}");
        found += 1;
    }
    assert!(found >= 8, "only {found} names");
}

/// Whether source defines a type, a function, a constant, a field or a variant.
fn defines(source: &str, name: &str) -> bool {
    let code = source
        .lines()
        .map(str::trim_start)
        .filter(|l| !l.starts_with("//"));
    code.into_iter().any(|line| {
        let line = ["pub(crate) ", "pub(super) ", "pub ", "const ", "async "]
            .iter()
            .fold(line, |l, word| l.strip_prefix(word).unwrap_or(l));
        let defined = ["struct ", "enum ", "trait ", "fn ", "type ", "static "]
            .iter()
            .find_map(|word| line.strip_prefix(word))
            .unwrap_or(line);
        let rest = defined.strip_prefix(name);
        rest.is_some_and(|r| r.is_empty() || r.starts_with([':', '(', ',', ' ', '<', '{', ';']))
    })
}

#[test]
fn decisions_have_one_form_and_are_listed() {
    let folder = root().join("docs/decisions");
    let index = std::fs::read_to_string(folder.join("README.md")).unwrap();
    let mut listed = 0;
    for file in files(&["docs/decisions"], "md") {
        let name = file.file_name().unwrap().to_str().unwrap().to_owned();
        let Ok(number) = name[..4].parse::<u16>() else {
            continue;
        };
        let text = std::fs::read_to_string(&file).unwrap();
        let mut lines = text.lines();
        let title = lines.next().unwrap().strip_prefix(&format!("# {number}. "));
        let title = title.unwrap_or_else(|| panic!("{name} has another heading"));
        let status = lines.nth(1).unwrap().strip_prefix("**Status.** ");
        let status = status.unwrap_or_else(|| panic!("{name} has no status"));
        let known = ["Accepted", "Amended", "Superseded"];
        assert!(
            known.iter().any(|k| status.starts_with(k)),
            "{name}: {status}"
        );
        assert!(text.lines().count() <= 40, "{name} is longer than 40 lines");
        let row = format!("| [{number:04}]({name}) | {title} | ");
        assert!(index.contains(&row), "the index has no row for {name}");
        listed += 1;
    }
    assert!(listed >= 24, "only {listed} decisions");
}

/// The lines that a patch expects to find one after the other, and the file that it names.
fn expected(patch: &str) -> (&str, String) {
    let file = patch.lines().find_map(|l| l.strip_prefix("+++ b/"));
    let hunk = patch.lines().skip_while(|l| !l.starts_with("@@")).skip(1);
    let kept = hunk.filter(|l| !l.starts_with('+'));
    let before = kept.map(|l| format!("{}\n", l.get(1..).unwrap_or_default()));
    (file.unwrap(), before.collect())
}

#[test]
fn mistakes_apply_to_the_code_as_it_is() {
    let all = files(&["tests/mutants"], "patch");
    assert!(!all.is_empty());
    for path in all {
        let patch = std::fs::read_to_string(&path).unwrap();
        let (file, before) = expected(&patch);
        assert_eq!(patch.matches("\n@@").count(), 1, "{}", path.display());
        let code = std::fs::read_to_string(root().join(file)).unwrap();
        assert_eq!(
            code.matches(&before).count(),
            1,
            "{} in {file}",
            path.display()
        );
    }
}
