//! The commands that documents name.

/// How a block begins and ends.
const FENCE: &str = "```";

/// A block of commands for a shell.
pub struct Block {
    /// Its first line in the page, from 1.
    pub line: usize,
    pub text: String,
}

/// The shell blocks of a page.
///
/// # Panics
/// When one of them has no end.
pub fn shell_blocks(page: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut fence = None;
    for (line, text) in (1..).zip(page.lines()) {
        match fence {
            None if text.starts_with(FENCE) => {
                let shell = text == "```sh";
                fence = Some(shell);
                if shell {
                    let (line, text) = (line + 1, String::new());
                    blocks.push(Block { line, text });
                }
            }
            Some(_) if text == FENCE => fence = None,
            Some(true) => {
                let block = blocks.last_mut().expect("one has begun");
                block.text += text;
                block.text.push('\n');
            }
            _ => {}
        }
    }
    assert_eq!(fence, None, "a block has no end");
    blocks
}

/// The commands of a page: `skein` and its words, as they stand in shell blocks, on indented
/// lines and between backticks, without what a shell does with their output.
pub fn named(page: &str) -> Vec<String> {
    let shown = shell_blocks(page).into_iter().map(|block| block.text);
    let mut parts: Vec<String> = shown
        .flat_map(|text| text.lines().map(str::to_owned).collect::<Vec<_>>())
        .collect();
    let mut fenced = false;
    for line in page.lines() {
        let indented = line.strip_prefix("    ").unwrap_or_default();
        if line.starts_with(FENCE) {
            fenced = !fenced;
        } else if fenced {
            // A shell's block is taken above, and others are no commands.
        } else if indented.starts_with("skein ") {
            parts.push(indented.to_owned());
        } else {
            parts.extend(line.split('`').skip(1).step_by(2).map(str::to_owned));
        }
    }
    let command = |part: String| {
        // In a table a bar between words has a backslash before it.
        let part = part.replace("\\|", "|");
        let ends = [" #", "; ", " >", " |", " &"].into_iter();
        let end = ends.filter_map(|mark| part.find(mark)).min();
        let part = part[..end.unwrap_or(part.len())].trim();
        part.starts_with("skein ").then(|| part.to_owned())
    };
    parts.into_iter().filter_map(command).collect()
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
