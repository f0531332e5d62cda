//! The commands that documents name.

use std::fmt::Write as _;

/// How a block begins and ends.
const FENCE: &str = "```";

/// Where a line of a page stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stands {
    Outside,
    /// The fence of a block of commands for a shell.
    BeforeShell,
    InShell,
    InOther,
}

/// The lines of a page without the fences that end blocks, each with its number from 1.
fn lines(page: &str) -> Vec<(usize, Stands, &str)> {
    let mut lines = Vec::new();
    let mut inside = None;
    for (number, text) in (1..).zip(page.lines()) {
        match inside {
            None if text.starts_with(FENCE) => {
                inside = Some(if text == "```sh" {
                    lines.push((number, Stands::BeforeShell, text));
                    Stands::InShell
                } else {
                    Stands::InOther
                });
            }
            None => lines.push((number, Stands::Outside, text)),
            Some(_) if text == FENCE => inside = None,
            Some(stands) => lines.push((number, stands, text)),
        }
    }
    assert!(inside.is_none(), "a block has no end");
    lines
}

/// The shell blocks of a page as one script, which says which block it is in, and how many
/// there are.
pub fn script(page: &str) -> (usize, String) {
    let (mut blocks, mut script) = (0, String::new());
    for (number, stands, text) in lines(page) {
        match stands {
            Stands::BeforeShell => {
                blocks += 1;
                writeln!(script, "echo \"== line {}\"", number + 1).unwrap();
            }
            Stands::InShell => writeln!(script, "{text}").unwrap(),
            Stands::Outside | Stands::InOther => {}
        }
    }
    (blocks, script)
}

/// The commands of a page: `skein` and its words, as they stand in shell blocks, on indented
/// lines and between backticks, without what a shell does with their output.
pub fn named(page: &str) -> Vec<String> {
    let parts = |(_, stands, text): (usize, Stands, &str)| -> Vec<String> {
        let indented = text.strip_prefix("    ").unwrap_or_default();
        match stands {
            Stands::InShell => vec![text.to_owned()],
            Stands::Outside if indented.starts_with("skein ") => vec![indented.to_owned()],
            Stands::Outside => text
                .split('`')
                .skip(1)
                .step_by(2)
                .map(str::to_owned)
                .collect(),
            Stands::BeforeShell | Stands::InOther => Vec::new(),
        }
    };
    let command = |part: String| {
        // In a table a bar between words has a backslash before it.
        let part = part.replace("\\|", "|");
        let ends = [" #", "; ", " >", " |", " &"].into_iter();
        let end = ends.filter_map(|mark| part.find(mark)).min();
        let part = part[..end.unwrap_or(part.len())].trim();
        part.starts_with("skein ").then(|| part.to_owned())
    };
    lines(page)
        .into_iter()
        .flat_map(parts)
        .filter_map(command)
        .collect()
}

/// The words of a command behind `skein`, as a shell would split them.
pub fn words(command: &str) -> Vec<String> {
    let words = command.split_whitespace().skip(1);
    words.map(|w| w.trim_matches('\'').to_owned()).collect()
}

/// Whether some of its words stand for something else, such as `SCENARIO`, `[--k K]`, `A..B`,
/// `submit|revise` or `...`.
pub fn is_a_pattern(command: &str) -> bool {
    words(command).iter().any(|w| {
        // Such as N, FILE, A..B and UAV@SECONDS.
        let letters = |part: &str| {
            !part.is_empty() && part.chars().all(|c| c.is_ascii_uppercase() || c == '_')
        };
        let named = w.split(['.', '@']).any(letters);
        named || w.contains(['[', '…', '|', '\\', '$', '{']) || w.contains("...")
    })
}
