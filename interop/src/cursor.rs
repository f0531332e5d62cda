//! A JSON value and its pointer, so that every complaint names its place.
//! Leaves all meaning to the readers of the formats.

use crate::FormatError;
use serde_json::{Map, Value};

/// A value of the text together with where it stands.
#[derive(Clone, Debug)]
pub(crate) struct Cursor<'a> {
    value: &'a Value,
    pointer: String,
}

/// Parses JSON; the parser itself limits the nesting.
pub(crate) fn parse(text: &str) -> Result<Value, FormatError> {
    serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| FormatError::Syntax {
        line: e.line(),
        column: e.column(),
        problem: e.to_string(),
    })
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

impl<'a> Cursor<'a> {
    pub(crate) fn root(value: &'a Value) -> Self {
        Self {
            value,
            pointer: String::new(),
        }
    }

    pub(crate) fn value(&self) -> &'a Value {
        self.value
    }

    pub(crate) fn pointer(&self) -> String {
        if self.pointer.is_empty() {
            "/".to_owned()
        } else {
            self.pointer.clone()
        }
    }

    pub(crate) fn wrong(&self, problem: impl Into<String>) -> FormatError {
        FormatError::Value {
            pointer: self.pointer(),
            problem: problem.into(),
        }
    }

    fn expected(&self, what: &str) -> FormatError {
        self.wrong(format!("expected {what}, found {}", kind(self.value)))
    }

    fn child(&self, key: &str, value: &'a Value) -> Self {
        let key = key.replace('~', "~0").replace('/', "~1");
        Self {
            value,
            pointer: format!("{}/{key}", self.pointer),
        }
    }

    pub(crate) fn object(&self) -> Result<&'a Map<String, Value>, FormatError> {
        self.value
            .as_object()
            .ok_or_else(|| self.expected("an object"))
    }

    /// A member of an object; absent and `null` are the same.
    pub(crate) fn get(&self, key: &str) -> Result<Option<Self>, FormatError> {
        let found = self.object()?.get(key).filter(|v| !v.is_null());
        Ok(found.map(|v| self.child(key, v)))
    }

    pub(crate) fn need(&self, key: &str) -> Result<Self, FormatError> {
        self.get(key)?
            .ok_or_else(|| self.wrong(format!("the member \"{key}\" is missing")))
    }

    pub(crate) fn items(&self) -> Result<Vec<Self>, FormatError> {
        let list = self
            .value
            .as_array()
            .ok_or_else(|| self.expected("a list"))?;
        Ok(list
            .iter()
            .enumerate()
            .map(|(i, v)| self.child(&i.to_string(), v))
            .collect())
    }

    pub(crate) fn text(&self) -> Result<&'a str, FormatError> {
        self.value.as_str().ok_or_else(|| self.expected("a string"))
    }

    pub(crate) fn flag(&self) -> Result<bool, FormatError> {
        self.value
            .as_bool()
            .ok_or_else(|| self.expected("true or false"))
    }

    /// A finite number.
    pub(crate) fn number(&self) -> Result<f64, FormatError> {
        let n = self
            .value
            .as_f64()
            .ok_or_else(|| self.expected("a number"))?;
        if n.is_finite() {
            Ok(n)
        } else {
            Err(self.wrong("expected a finite number"))
        }
    }

    pub(crate) fn within(&self, low: f64, high: f64, what: &str) -> Result<f64, FormatError> {
        let n = self.number()?;
        if (low..=high).contains(&n) {
            Ok(n)
        } else {
            Err(self.wrong(format!(
                "{what} must be between {low} and {high}, found {n}"
            )))
        }
    }
}
