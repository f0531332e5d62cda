//! Reading JSON5 objects field by field, with the place of every mistake.
//!
//! Every field that is read is taken out; what is left in the end was unknown, and
//! is an error as much as a wrong value is.

use jsonc_parser::ast::{Object, ObjectProp, Value};
use jsonc_parser::common::Ranged;
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use std::path::{Path, PathBuf};

/// A mistake in a file, with its place; the peer does not start.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}:{line}:{column}: {what}", path.display())]
pub struct FieldError {
    /// Which file.
    pub path: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in characters.
    pub column: usize,
    /// What is wrong, and what would be right.
    pub what: String,
}

/// A text and where it came from.
#[derive(Clone, Copy, Debug)]
pub struct Text<'a> {
    /// The file, for errors.
    pub path: &'a Path,
    /// Its content.
    pub text: &'a str,
}

impl<'a> Text<'a> {
    /// The object that the text holds.
    ///
    /// # Errors
    /// When the text is no JSON5, or no object.
    pub fn object(self) -> Result<Fields<'a>, FieldError> {
        let parsed = parse_to_ast(
            self.text,
            &CollectOptions::default(),
            &ParseOptions::default(),
        )
        .map_err(|e| self.error(e.range().start, e.kind().to_string()))?;
        match parsed.value {
            Some(Value::Object(object)) => Ok(Fields { text: self, object }),
            Some(other) => Err(self.error(other.start(), "expected an object { … }".to_owned())),
            None => Err(self.error(0, "the file is empty; expected an object { … }".to_owned())),
        }
    }

    fn error(self, at: usize, what: String) -> FieldError {
        let before = self.text.get(..at).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        FieldError {
            path: self.path.to_owned(),
            line,
            column,
            what,
        }
    }
}

/// The fields of an object that have not been read yet.
#[derive(Debug)]
pub struct Fields<'a> {
    text: Text<'a>,
    object: Object<'a>,
}

impl<'a> Fields<'a> {
    /// An error at the object itself.
    #[must_use]
    pub fn error(&self, what: impl Into<String>) -> FieldError {
        self.text.error(self.object.range.start, what.into())
    }

    /// The value of `name`; absent and `null` are the same.
    fn take(&mut self, name: &str) -> Option<Value<'a>> {
        match self.object.take(name)?.value {
            Value::NullKeyword(_) => None,
            value => Some(value),
        }
    }

    fn need(&mut self, name: &str) -> Result<Value<'a>, FieldError> {
        self.take(name)
            .ok_or_else(|| self.error(format!("the field {name} is missing")))
    }

    /// A number within `[least, most]`.
    ///
    /// # Errors
    /// When it is missing, no number, not finite or out of bounds.
    pub fn number(&mut self, name: &str, least: f64, most: f64) -> Result<f64, FieldError> {
        let value = self.need(name)?;
        let wrong = |got: &str| {
            let what = format!("{name} is {got}; expected a number from {least} to {most}");
            self.text.error(value.start(), what)
        };
        let Value::NumberLit(literal) = &value else {
            return Err(wrong("no number"));
        };
        let number: f64 = literal.value.parse().map_err(|_| wrong(literal.value))?;
        if number >= least && number <= most {
            Ok(number)
        } else {
            Err(wrong(literal.value))
        }
    }

    /// A whole number within `[least, most]`.
    ///
    /// # Errors
    /// When it is missing, no whole number or out of bounds.
    pub fn integer(&mut self, name: &str, least: u64, most: u64) -> Result<u64, FieldError> {
        let value = self.need(name)?;
        let wrong = |got: &str| {
            let what = format!("{name} is {got}; expected a whole number from {least} to {most}");
            self.text.error(value.start(), what)
        };
        let Value::NumberLit(literal) = &value else {
            return Err(wrong("no number"));
        };
        let number: u64 = literal.value.parse().map_err(|_| wrong(literal.value))?;
        if (least..=most).contains(&number) {
            Ok(number)
        } else {
            Err(wrong(literal.value))
        }
    }

    /// A text and an error for it, in case it turns out wrong.
    ///
    /// # Errors
    /// When it is missing or no text.
    pub fn string(&mut self, name: &str) -> Result<(String, FieldError), FieldError> {
        let value = self.need(name)?;
        self.as_string(name, &value)
    }

    /// A text that may be missing.
    ///
    /// # Errors
    /// When it is there and no text.
    pub fn optional_string(
        &mut self,
        name: &str,
    ) -> Result<Option<(String, FieldError)>, FieldError> {
        match self.take(name) {
            Some(value) => self.as_string(name, &value).map(Some),
            None => Ok(None),
        }
    }

    fn as_string(&self, name: &str, value: &Value<'a>) -> Result<(String, FieldError), FieldError> {
        let at = value.start();
        match value {
            Value::StringLit(s) => {
                let text = s.value.clone().into_owned();
                let error = self.text.error(at, format!("{name} is \"{text}\""));
                Ok((text, error))
            }
            _ => Err(self
                .text
                .error(at, format!("{name} must be a text in quotes"))),
        }
    }

    /// A list of texts, each with an error for it.
    ///
    /// # Errors
    /// When it is missing, no list, or holds something else.
    pub fn strings(&mut self, name: &str) -> Result<Vec<(String, FieldError)>, FieldError> {
        match self.need(name)? {
            Value::Array(array) => array
                .elements
                .iter()
                .map(|e| self.as_string(name, e))
                .collect(),
            other => Err(self
                .text
                .error(other.start(), format!("{name} must be a list [ … ]"))),
        }
    }

    /// An object that may be missing.
    ///
    /// # Errors
    /// When it is there and no object.
    pub fn optional_object(&mut self, name: &str) -> Result<Option<Self>, FieldError> {
        match self.take(name) {
            Some(Value::Object(object)) => Ok(Some(Self {
                text: self.text,
                object,
            })),
            Some(other) => Err(self.text.error(
                other.start(),
                format!("{name} must be an object {{ … }} or null"),
            )),
            None => Ok(None),
        }
    }

    /// Ends the reading.
    ///
    /// # Errors
    /// When a field is left that nobody asked for.
    pub fn done(self) -> Result<(), FieldError> {
        match self.object.properties.first() {
            Some(left) => Err(self.text.error(left.range.start, unknown(left))),
            None => Ok(()),
        }
    }
}

fn unknown(field: &ObjectProp<'_>) -> String {
    format!(
        "unknown field {}, or a field given twice",
        field.name.as_str()
    )
}
