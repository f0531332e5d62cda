//! The members of an object that may have only known names.

use super::{Error, Node};

/// The members of an object whose names were all known.
#[derive(Debug)]
pub struct Fields<'a> {
    node: Node<'a>,
    members: Vec<(&'a str, Node<'a>)>,
}

impl<'a> Fields<'a> {
    pub(super) fn new(node: Node<'a>, members: Vec<(&'a str, Node<'a>)>) -> Self {
        Self { node, members }
    }

    /// The object whose members these are.
    #[must_use]
    pub fn node(&self) -> &Node<'a> {
        &self.node
    }

    /// A member that may be absent.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Node<'a>> {
        self.members
            .iter()
            .find(|(n, _)| *n == name)
            .map(|(_, node)| node)
    }

    /// A member that may be absent or `null`, which is the same.
    #[must_use]
    pub fn given(&self, name: &str) -> Option<&Node<'a>> {
        self.get(name).filter(|node| !node.is_null())
    }

    /// A member that must be there; `example` shows how it looks.
    ///
    /// # Errors
    /// When it is missing.
    pub fn need(&self, name: &str, example: &str) -> Result<&Node<'a>, Error> {
        self.get(name).ok_or_else(|| {
            self.node.wrong(format!(
                "the field {} is missing; for example {name}: {example}",
                self.node.member_path(name)
            ))
        })
    }

    /// A number that may be absent.
    ///
    /// # Errors
    /// When it is there and no number in the range.
    pub fn number_or(
        &self,
        name: &str,
        default: f64,
        low: f64,
        high: f64,
        unit: &str,
    ) -> Result<f64, Error> {
        self.get(name)
            .map_or(Ok(default), |n| n.number(low, high, unit))
    }

    /// A whole number that may be absent.
    ///
    /// # Errors
    /// When it is there and no whole number in the range.
    pub fn whole_or(
        &self,
        name: &str,
        default: u32,
        low: u32,
        high: u32,
        unit: &str,
    ) -> Result<u32, Error> {
        self.get(name)
            .map_or(Ok(default), |n| n.whole(low, high, unit))
    }

    /// A 16-bit number that may be absent.
    ///
    /// # Errors
    /// When it is there and no whole number in the range.
    pub fn small_or(
        &self,
        name: &str,
        default: u16,
        low: u16,
        high: u16,
        unit: &str,
    ) -> Result<u16, Error> {
        self.get(name)
            .map_or(Ok(default), |n| n.small(low, high, unit))
    }
}

/// Edits that turn one word into the other (Levenshtein), in O(len²).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}

/// "did you mean ..." for a name that is close to a known one, else all known names.
#[must_use]
pub fn suggestion(name: &str, known: &[&str]) -> String {
    /// Longer words are not compared: the table grows with the square.
    const LONGEST: usize = 64;
    let name: String = name
        .chars()
        .take(LONGEST)
        .collect::<String>()
        .to_lowercase();
    let stem = |n: &str| n.split('_').next().unwrap_or(n).to_owned();
    let near = known
        .iter()
        .map(|k| {
            // A right stem with a wrong unit is as near as one wrong letter.
            let d = distance(&name, k).min(if stem(&name) == stem(k) {
                1
            } else {
                usize::MAX
            });
            (d, *k)
        })
        .min();
    match near {
        Some((d, k)) if d <= 1 + name.len() / 4 => format!("did you mean {k}?"),
        _ => format!("expected one of {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_suggested() {
        assert_eq!(
            suggestion("endurance", &["stall_mps", "endurance_s"]),
            "did you mean endurance_s?"
        );
        assert_eq!(
            suggestion("spacing_ft", &["spacing_m", "x"]),
            "did you mean spacing_m?"
        );
        assert_eq!(suggestion("sped", &["seed", "speed"]), "did you mean seed?");
        assert_eq!(suggestion("qqqqq", &["a", "b"]), "expected one of a, b");
    }
}
