//! The one reader of JSON and JSON5: every value knows its line, column and path, so that
//! an error of meaning (a speed below the stall speed, a zone that swallows the area) names
//! its place as well as an error of syntax does.
//!
//! A typed cursor over the syntax tree instead of serde, which forgets places. Scenarios,
//! configurations of peers, fleet files, QGroundControl plans and GeoJSON are read through
//! it. Leaves all meaning to the readers of the formats, and files to their callers.
//!
//! | type | what it is |
//! |---|---|
//! | [`Document`] | a parsed text |
//! | [`Node`] | a value of it, with its place and path |
//! | [`Fields`] | the members of an object whose names were all known |
//! | [`Places`] | where each value stands, kept when the text is gone |
//!
//! ```
//! use skein_interop::json::Document;
//! let document = Document::parse("peer", "peer.json5", "{\n  id: 70000 }").unwrap();
//! let fields = document.root().fields(&["id"]).unwrap();
//! let error = fields.need("id", "1").unwrap().small(0, 65_535, "a peer's number");
//! assert_eq!(
//!     error.unwrap_err().to_string(),
//!     "peer.json5:2:7: id: 70000 is out of range; expected a peer's number between 0 and 65535"
//! );
//! ```

mod fields;
mod node;

pub use fields::{Fields, suggestion};
pub use node::Node;

use core::fmt;
use jsonc_parser::ast::Value;
use jsonc_parser::errors::{ParseError, ParseErrorKind};
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use std::collections::BTreeMap;

/// A place in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file, as it was named; empty when the text has no name.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.file.is_empty() {
            write!(f, "line {}, column {}", self.line, self.column)
        } else {
            write!(f, "{}:{}:{}", self.file, self.line, self.column)
        }
    }
}

/// Why a text was refused. Nothing of it was used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {field}: {problem}")]
pub struct Error {
    /// Where the value stands.
    pub place: Place,
    /// Its path, such as `fleet.uavs[2].launch`; `syntax` where the text is no JSON5.
    pub field: String,
    /// What is wrong and what would be right.
    pub problem: String,
}

impl Error {
    /// The same error of a text without a name, which is this file.
    #[must_use]
    pub fn in_file(mut self, file: &str) -> Self {
        file.clone_into(&mut self.place.file);
        self
    }
}

/// A parsed text and what is needed to name places in it.
#[derive(Debug)]
pub struct Document<'a> {
    what: &'a str,
    file: &'a str,
    text: &'a str,
    value: Value<'a>,
}

impl<'a> Document<'a> {
    /// Parses JSON5 as people write it, but commas may not be missing. `what` names the
    /// whole in errors, `file` its place; nesting is limited.
    ///
    /// # Errors
    /// [`Error`] names the place where the text stops being JSON5.
    pub fn parse(what: &'a str, file: &'a str, text: &'a str) -> Result<Self, Error> {
        let text = text.trim_start_matches('\u{feff}');
        let options = ParseOptions {
            allow_missing_commas: false,
            ..ParseOptions::default()
        };
        let parsed = parse_to_ast(text, &CollectOptions::default(), &options)
            .map_err(|e| syntax(file, text, &e))?;
        let value = parsed.value.ok_or_else(|| Error {
            place: place(file, text, 0),
            field: what.to_owned(),
            problem: "the file is empty".to_owned(),
        })?;
        Ok(Self {
            what,
            file,
            text,
            value,
        })
    }

    /// The whole.
    #[must_use]
    pub fn root(&'a self) -> Node<'a> {
        Node::root(self, &self.value)
    }

    /// Where every value stands.
    #[must_use]
    pub fn places(&'a self) -> Places {
        let mut offsets = BTreeMap::new();
        let mut todo = vec![self.root()];
        while let Some(node) = todo.pop() {
            offsets.entry(node.path()).or_insert(node.offset());
            todo.extend(node.children());
        }
        Places {
            what: self.what.to_owned(),
            file: self.file.to_owned(),
            text: self.text.to_owned(),
            offsets,
        }
    }

    fn place(&self, offset: usize) -> Place {
        place(self.file, self.text, offset)
    }
}

/// Line and column of a byte offset.
fn place(file: &str, text: &str, offset: usize) -> Place {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    Place {
        file: file.to_owned(),
        line: before.matches('\n').count() + 1,
        column: before[line_start..].chars().count() + 1,
    }
}

fn syntax(file: &str, text: &str, e: &ParseError) -> Error {
    let hint = match e.kind() {
        ParseErrorKind::UnexpectedWord => "; texts stand in quotes",
        ParseErrorKind::UnterminatedObject => "; a } is missing",
        ParseErrorKind::UnterminatedArray => "; a ] is missing",
        ParseErrorKind::ExpectedDigitFollowingNegativeSign => "; a number goes on with digits",
        _ => "",
    };
    Error {
        place: place(file, text, e.range().start),
        field: "syntax".to_owned(),
        problem: format!("{}{hint}", e.kind()),
    }
}

/// Where each value of a text stands, by its path: for errors of meaning that are found
/// after the text was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Places {
    what: String,
    file: String,
    text: String,
    offsets: BTreeMap<String, usize>,
}

impl Places {
    /// The place of a value by its path, or of the nearest thing that contains it.
    #[must_use]
    pub fn locate(&self, path: &str) -> Place {
        let mut path = path;
        let offset = loop {
            if let Some(offset) = self.offsets.get(path) {
                break *offset;
            }
            match path.rfind(['.', '[']) {
                Some(end) => path = &path[..end],
                None => break self.offsets.get(&self.what).copied().unwrap_or(0),
            }
        };
        place(&self.file, &self.text, offset)
    }

    /// An error of the value at a path.
    #[must_use]
    pub fn wrong(&self, path: &str, problem: impl Into<String>) -> Error {
        Error {
            place: self.locate(path),
            field: path.to_owned(),
            problem: problem.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json5_as_people_write_it() {
        let text = "// a comment\n{ a: +1.5, 'b': 0x10, \"c\": [1, 2,], /* no */ d: .5, }";
        let document = Document::parse("test", "t.json5", text).unwrap();
        let f = document.root().fields(&["a", "b", "c", "d"]).unwrap();
        for (name, want) in [("a", 1.5), ("b", 16.0), ("d", 0.5)] {
            let got = f.need(name, "").unwrap().number(0.0, 100.0, "").unwrap();
            assert!((got - want).abs() < 1e-12, "{name}");
        }
        assert_eq!(
            f.need("c", "").unwrap().pair(0.0, 9.0, "").unwrap(),
            (1.0, 2.0)
        );
    }

    #[test]
    fn errors_have_a_line_a_column_and_a_path() {
        let text = "{\n  a: { b: [1, NaN] },\n  ä: 1, zz: 2 }";
        let document = Document::parse("test", "t.json5", text).unwrap();
        let n = document.root();
        let e = n.fields(&["a", "ä"]).unwrap_err().to_string();
        assert!(e.starts_with("t.json5:3:9: zz: unknown field; "), "{e}");
        let f = n.fields(&["a", "ä", "zz"]).unwrap();
        let b = f.need("a", "").unwrap().fields(&["b"]).unwrap();
        let e = b.need("b", "").unwrap().pair(0.0, 9.0, "m").unwrap_err();
        let e = e.to_string();
        assert!(
            e.starts_with("t.json5:2:15: a.b[1]: NaN is not a finite number"),
            "{e}"
        );
        let places = document.places();
        assert_eq!(places.locate("a.b[1].deeper").column, 15);
        assert_eq!(places.locate("ab").line, 1);
        let e = Document::parse("test", "t.json5", "{ a: 1\n b: 2 }").unwrap_err();
        let e = e.to_string();
        assert!(e.starts_with("t.json5:1:7: syntax: "), "{e}");
        let e = Document::parse("test", "", "").unwrap_err().to_string();
        assert_eq!(e, "line 1, column 1: test: the file is empty");
    }

    #[test]
    fn a_name_given_twice_is_an_error() {
        let document = Document::parse("test", "t", "{ a: 1, a: 2 }").unwrap();
        let said = document.root().members().unwrap_err().to_string();
        assert!(said.contains("1:9: a: given twice"), "{said}");
        assert!(document.root().get("a").is_err());
    }

    #[test]
    fn whole_numbers_keep_all_64_bits() {
        let text = "[18446744073709551615, 18446744073709551616, 1.5, -1, 0x10, 1e3]";
        let document = Document::parse("test", "t", text).unwrap();
        let items = document.root().items().unwrap();
        let read = |i: usize| items[i].count(0, u64::MAX, "any number");
        assert_eq!(read(0).unwrap(), u64::MAX);
        assert_eq!((read(4).unwrap(), read(5).unwrap()), (16, 1000));
        for i in 1..4 {
            assert!(read(i).is_err(), "{i}");
        }
        assert!(items[4].count(17, 20, "").is_err());
    }

    #[test]
    fn null_is_the_same_as_absent_only_where_that_is_asked_for() {
        let document = Document::parse("test", "t", "{ a: null, b: { c: null } }").unwrap();
        let root = document.root();
        assert!(root.get("a").unwrap().is_none() && root.get("z").unwrap().is_none());
        let f = root.fields(&["a", "b"]).unwrap();
        assert!(f.get("a").is_some() && f.given("a").is_none());
        let e = root.need("z").unwrap_err().to_string();
        assert_eq!(e, "t:1:1: test: the field z is missing");
    }
}
