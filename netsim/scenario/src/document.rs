//! A JSON5 text with its positions: every value knows its line, column and path.
//!
//! A typed cursor over the syntax tree instead of serde, because an error of meaning
//! (a speed below the stall speed, a zone that swallows the area) has a place too.

use crate::error::{Place, ScenarioError};
use jsonc_parser::ast::Value;
use jsonc_parser::common::Ranged;
use jsonc_parser::errors::{ParseError, ParseErrorKind};
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};

/// A text and what is needed to name places in it.
#[derive(Debug)]
pub(crate) struct Document<'a> {
    file: &'a str,
    text: &'a str,
}

impl<'a> Document<'a> {
    pub(crate) fn new(file: &'a str, text: &'a str) -> Self {
        Self { file, text }
    }

    /// Line and column of a byte offset.
    fn place(&self, offset: usize) -> Place {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        Place {
            file: self.file.to_owned(),
            line,
            column,
        }
    }

    /// Parses the text: JSON5 as people write it, but commas may not be missing.
    pub(crate) fn parse(&self) -> Result<Value<'a>, ScenarioError> {
        let options = ParseOptions {
            allow_missing_commas: false,
            ..ParseOptions::default()
        };
        let parsed = parse_to_ast(self.text, &CollectOptions::default(), &options)
            .map_err(|e| self.syntax(&e))?;
        parsed.value.ok_or_else(|| ScenarioError::Invalid {
            place: self.place(0),
            field: "scenario".to_owned(),
            problem: "the file is empty; a scenario is an object: { name: \"...\", ... }"
                .to_owned(),
        })
    }

    fn syntax(&self, e: &ParseError) -> ScenarioError {
        let hint = match e.kind() {
            ParseErrorKind::UnexpectedWord => "; texts stand in quotes",
            ParseErrorKind::UnterminatedObject => "; a } is missing",
            ParseErrorKind::UnterminatedArray => "; a ] is missing",
            ParseErrorKind::ExpectedDigitFollowingNegativeSign => "; a number goes on with digits",
            _ => "",
        };
        ScenarioError::Invalid {
            place: self.place(e.range().start),
            field: "syntax".to_owned(),
            problem: format!("{}{hint}", e.kind()),
        }
    }
}

/// A value, its document and its path.
#[derive(Clone, Debug)]
pub(crate) struct Node<'a> {
    document: &'a Document<'a>,
    value: &'a Value<'a>,
    path: String,
}

/// The members of an object whose names were all known.
#[derive(Debug)]
pub(crate) struct Fields<'a> {
    node: Node<'a>,
    members: Vec<(&'a str, Node<'a>)>,
}

fn kind(value: &Value<'_>) -> String {
    match value {
        Value::StringLit(s) => format!(
            "the text \"{}\"",
            s.value.chars().take(40).collect::<String>()
        ),
        Value::NumberLit(n) => format!("the number {}", n.value),
        Value::BooleanLit(b) => format!("{}", b.value),
        Value::Object(_) => "an object".to_owned(),
        Value::Array(_) => "a list".to_owned(),
        Value::NullKeyword(_) => "null".to_owned(),
    }
}

/// A number as JSON5 writes it.
fn number(text: &str) -> Option<f64> {
    let (sign, digits) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    if let Some(hex) = digits
        .strip_prefix("0x")
        .or_else(|| digits.strip_prefix("0X"))
    {
        return u32::from_str_radix(hex, 16)
            .ok()
            .map(|n| sign * f64::from(n));
    }
    digits.parse::<f64>().ok().map(|n| sign * n)
}

impl<'a> Node<'a> {
    pub(crate) fn root(document: &'a Document<'a>, value: &'a Value<'a>) -> Self {
        Self {
            document,
            value,
            path: String::new(),
        }
    }

    /// The path of the value; the whole file is `scenario`.
    pub(crate) fn path(&self) -> &str {
        if self.path.is_empty() {
            "scenario"
        } else {
            &self.path
        }
    }

    pub(crate) fn place(&self) -> Place {
        self.document.place(self.value.start())
    }

    pub(crate) fn wrong(&self, problem: impl Into<String>) -> ScenarioError {
        ScenarioError::Invalid {
            place: self.place(),
            field: self.path().to_owned(),
            problem: problem.into(),
        }
    }

    fn expected(&self, what: &str) -> ScenarioError {
        self.wrong(format!("expected {what}, found {}", kind(self.value)))
    }

    fn member_path(&self, name: &str) -> String {
        if self.path.is_empty() {
            name.to_owned()
        } else {
            format!("{}.{name}", self.path)
        }
    }

    /// The members in the order of the file; a name given twice is an error.
    pub(crate) fn members(&self) -> Result<Vec<(&'a str, Self)>, ScenarioError> {
        let Value::Object(object) = self.value else {
            return Err(self.expected("an object { ... }"));
        };
        let mut members: Vec<(&'a str, Self)> = Vec::with_capacity(object.properties.len());
        for p in &object.properties {
            let name = p.name.as_str();
            let path = self.member_path(name);
            if members.iter().any(|(n, _)| *n == name) {
                let place = self.document.place(p.name.start());
                return Err(ScenarioError::Invalid {
                    place,
                    field: path,
                    problem: "given twice; keep one".to_owned(),
                });
            }
            members.push((
                name,
                Self {
                    document: self.document,
                    value: &p.value,
                    path,
                },
            ));
        }
        Ok(members)
    }

    /// The members of an object that may have only these names.
    pub(crate) fn fields(&self, known: &[&str]) -> Result<Fields<'a>, ScenarioError> {
        let members = self.members()?;
        let Value::Object(object) = self.value else {
            return Err(self.expected("an object { ... }"));
        };
        for (p, (name, node)) in object.properties.iter().zip(&members) {
            if !known.contains(name) {
                return Err(ScenarioError::Invalid {
                    place: self.document.place(p.name.start()),
                    field: node.path().to_owned(),
                    problem: format!("unknown field; {}", suggestion(name, known)),
                });
            }
        }
        Ok(Fields {
            node: self.clone(),
            members,
        })
    }

    pub(crate) fn items(&self) -> Result<Vec<Self>, ScenarioError> {
        let Value::Array(array) = self.value else {
            return Err(self.expected("a list [ ... ]"));
        };
        let item = |(i, value)| Self {
            document: self.document,
            value,
            path: format!("{}[{i}]", self.path()),
        };
        Ok(array.elements.iter().enumerate().map(item).collect())
    }

    pub(crate) fn text(&self) -> Result<&'a str, ScenarioError> {
        match self.value {
            Value::StringLit(s) => Ok(s.value.as_ref()),
            _ => Err(self.expected("a text in quotes")),
        }
    }

    pub(crate) fn flag(&self) -> Result<bool, ScenarioError> {
        match self.value {
            Value::BooleanLit(b) => Ok(b.value),
            _ => Err(self.expected("true or false")),
        }
    }

    /// A finite number in a closed range; `unit` is what it counts.
    pub(crate) fn number(&self, low: f64, high: f64, unit: &str) -> Result<f64, ScenarioError> {
        let Value::NumberLit(literal) = self.value else {
            return Err(self.expected(&format!("a number ({unit}) between {low} and {high}")));
        };
        let n = number(literal.value).filter(|n| n.is_finite());
        let n = n.ok_or_else(|| {
            self.wrong(format!(
                "{} is not a finite number; expected {unit} between {low} and {high}",
                literal.value
            ))
        })?;
        if (low..=high).contains(&n) {
            Ok(n)
        } else {
            Err(self.wrong(format!(
                "{n} is out of range; expected {unit} between {low} and {high}"
            )))
        }
    }

    /// A whole number in a closed range.
    pub(crate) fn whole(&self, low: u32, high: u32, unit: &str) -> Result<u32, ScenarioError> {
        let n = self.number(f64::from(low), f64::from(high), unit)?;
        if n.fract().abs() > 0.0 {
            return Err(self.wrong(format!(
                "{n} is not a whole number; expected {unit} between {low} and {high}"
            )));
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "low <= n <= high, both u32"
        )]
        Ok(n as u32)
    }

    /// A whole number of 16 bits, such as a peer's number.
    pub(crate) fn small(&self, low: u16, high: u16, unit: &str) -> Result<u16, ScenarioError> {
        let n = self.whole(u32::from(low), u32::from(high), unit)?;
        u16::try_from(n).map_err(|_| self.wrong("too large"))
    }

    /// Two numbers in a list.
    pub(crate) fn pair(
        &self,
        low: f64,
        high: f64,
        unit: &str,
    ) -> Result<(f64, f64), ScenarioError> {
        match self.items()?.as_slice() {
            [a, b] => Ok((a.number(low, high, unit)?, b.number(low, high, unit)?)),
            other => Err(self.wrong(format!(
                "expected two numbers ({unit}), found {}",
                other.len()
            ))),
        }
    }

    /// The place of a field by its path, or of the nearest thing that contains it.
    pub(crate) fn locate(&self, path: &str) -> Place {
        let mut best = self.clone();
        let mut todo = vec![self.clone()];
        while let Some(node) = todo.pop() {
            let inside = node.path.is_empty()
                || (path.starts_with(&node.path)
                    && path[node.path.len()..]
                        .chars()
                        .next()
                        .is_none_or(|c| c == '.' || c == '['));
            if !inside {
                continue;
            }
            if node.path.len() >= best.path.len() {
                best = node.clone();
            }
            todo.extend(
                node.members()
                    .unwrap_or_default()
                    .into_iter()
                    .map(|(_, n)| n),
            );
            todo.extend(node.items().unwrap_or_default());
        }
        best.place()
    }
}

impl<'a> Fields<'a> {
    /// A member that may be absent.
    pub(crate) fn get(&self, name: &str) -> Option<&Node<'a>> {
        self.members
            .iter()
            .find(|(n, _)| *n == name)
            .map(|(_, node)| node)
    }

    /// A member that must be there; `example` shows how it looks.
    pub(crate) fn need(&self, name: &str, example: &str) -> Result<&Node<'a>, ScenarioError> {
        self.get(name).ok_or_else(|| {
            self.node.wrong(format!(
                "the field {} is missing; for example {name}: {example}",
                self.node.member_path(name)
            ))
        })
    }

    /// The object whose members these are.
    pub(crate) fn node(&self) -> &Node<'a> {
        &self.node
    }

    /// A number that may be absent.
    pub(crate) fn number_or(
        &self,
        name: &str,
        default: f64,
        low: f64,
        high: f64,
        unit: &str,
    ) -> Result<f64, ScenarioError> {
        self.get(name)
            .map_or(Ok(default), |n| n.number(low, high, unit))
    }

    /// A whole number that may be absent.
    pub(crate) fn whole_or(
        &self,
        name: &str,
        default: u32,
        low: u32,
        high: u32,
        unit: &str,
    ) -> Result<u32, ScenarioError> {
        self.get(name)
            .map_or(Ok(default), |n| n.whole(low, high, unit))
    }

    /// A 16-bit number that may be absent.
    pub(crate) fn small_or(
        &self,
        name: &str,
        default: u16,
        low: u16,
        high: u16,
        unit: &str,
    ) -> Result<u16, ScenarioError> {
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
pub(crate) fn suggestion(name: &str, known: &[&str]) -> String {
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

    fn with<T>(text: &str, f: impl FnOnce(Node<'_>) -> T) -> T {
        let d = Document::new("t.json5", text);
        let v = d.parse().unwrap();
        f(Node::root(&d, &v))
    }

    #[test]
    fn json5_as_people_write_it() {
        let text = "// a comment\n{ a: +1.5, 'b': 0x10, \"c\": [1, 2,], /* no */ d: .5, }";
        with(text, |n| {
            let f = n.fields(&["a", "b", "c", "d"]).unwrap();
            for (name, want) in [("a", 1.5), ("b", 16.0), ("d", 0.5)] {
                let got = f.need(name, "").unwrap().number(0.0, 100.0, "").unwrap();
                assert!((got - want).abs() < 1e-12, "{name}");
            }
            assert_eq!(
                f.need("c", "").unwrap().pair(0.0, 9.0, "").unwrap(),
                (1.0, 2.0)
            );
        });
    }

    #[test]
    fn errors_have_a_line_a_column_and_a_path() {
        with("{\n  a: { b: [1, NaN] },\n  ä: 1, zz: 2 }", |n| {
            let e = n.fields(&["a", "ä"]).unwrap_err().to_string();
            assert!(e.starts_with("t.json5:3:9: zz: unknown field; "), "{e}");
            let f = n.fields(&["a", "ä", "zz"]).unwrap();
            let b = f.need("a", "").unwrap().fields(&["b"]).unwrap();
            let e = b
                .need("b", "")
                .unwrap()
                .pair(0.0, 9.0, "m")
                .unwrap_err()
                .to_string();
            assert!(
                e.starts_with("t.json5:2:15: a.b[1]: NaN is not a finite number"),
                "{e}"
            );
            assert_eq!(n.locate("a.b[1].deeper").column, 15);
            assert_eq!(n.locate("ab").line, 1);
        });
        let e = Document::new("t.json5", "{ a: 1\n b: 2 }")
            .parse()
            .unwrap_err()
            .to_string();
        assert!(e.starts_with("t.json5:1:7: syntax: "), "{e}");
    }

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

    #[test]
    fn a_name_given_twice_is_an_error() {
        with("{ a: 1, a: 2 }", |n| {
            assert!(
                n.members()
                    .unwrap_err()
                    .to_string()
                    .contains("1:9: a: given twice")
            );
        });
    }
}
