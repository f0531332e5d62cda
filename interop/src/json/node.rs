//! A value of a document: what it is, where it stands, and typed ways to read it.

use super::fields::{Fields, suggestion};
use super::{Document, Error, Place};
use jsonc_parser::ast::{ObjectProp, Value};
use jsonc_parser::common::Ranged;
use std::collections::BTreeSet;
use std::rc::Rc;

/// One step of the path from the whole to a value.
#[derive(Debug)]
struct Step<'a> {
    before: Option<Rc<Step<'a>>>,
    key: Key<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Key<'a> {
    Name(&'a str),
    Index(usize),
}

/// A value, its document and its path. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Node<'a> {
    document: &'a Document<'a>,
    value: &'a Value<'a>,
    step: Option<Rc<Step<'a>>>,
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

/// Sign and digits of a number as JSON5 writes it, and their base.
fn digits(text: &str) -> (bool, &str, u32) {
    let (minus, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let hex = digits
        .strip_prefix("0x")
        .or_else(|| digits.strip_prefix("0X"));
    hex.map_or((minus, digits, 10), |hex| (minus, hex, 16))
}

/// A number as JSON5 writes it.
fn float(text: &str) -> Option<f64> {
    let (minus, digits, base) = digits(text);
    let n = if base == 16 {
        u32::from_str_radix(digits, 16).ok().map(f64::from)
    } else {
        digits.parse::<f64>().ok()
    };
    n.map(|n| if minus { -n } else { n })
}

/// A whole number that is not negative, as JSON5 writes it.
fn natural(text: &str) -> Option<u64> {
    let (minus, digits, base) = digits(text);
    if let Ok(n) = u64::from_str_radix(digits, base) {
        return (!minus || n == 0).then_some(n);
    }
    let n = float(text)?;
    // Floats count exactly up to here; larger ones are written in full.
    let exact = n.fract().abs() <= 0.0 && (0.0..=9_007_199_254_740_992.0).contains(&n);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number that fits"
    )]
    exact.then_some(n as u64)
}

impl<'a> Node<'a> {
    pub(super) fn root(document: &'a Document<'a>, value: &'a Value<'a>) -> Self {
        Self {
            document,
            value,
            step: None,
        }
    }

    fn child(&self, key: Key<'a>, value: &'a Value<'a>) -> Self {
        let before = self.step.clone();
        Self {
            document: self.document,
            value,
            step: Some(Rc::new(Step { before, key })),
        }
    }

    fn keys(&self) -> Vec<Key<'a>> {
        let mut keys = Vec::new();
        let mut at = self.step.as_ref();
        while let Some(step) = at {
            keys.push(step.key);
            at = step.before.as_ref();
        }
        keys.reverse();
        keys
    }

    /// The path of the value, such as `fleet.uavs[2].launch`; the whole has the name that
    /// the document was given.
    #[must_use]
    pub fn path(&self) -> String {
        let mut out = String::new();
        for key in self.keys() {
            match key {
                Key::Name(name) if out.is_empty() => out.push_str(name),
                Key::Name(name) => out.extend([".", name]),
                Key::Index(i) => {
                    if out.is_empty() {
                        out.push_str(self.document.what);
                    }
                    out.push_str(&format!("[{i}]"));
                }
            }
        }
        if out.is_empty() {
            self.document.what.to_owned()
        } else {
            out
        }
    }

    /// The path as a JSON pointer (RFC 6901), as other programs name values; `/` stands
    /// for the whole.
    #[must_use]
    pub fn pointer(&self) -> String {
        let mut out = String::new();
        for key in self.keys() {
            out.push('/');
            match key {
                Key::Name(name) => out.push_str(&name.replace('~', "~0").replace('/', "~1")),
                Key::Index(i) => out.push_str(&i.to_string()),
            }
        }
        if out.is_empty() { "/".to_owned() } else { out }
    }

    pub(super) fn offset(&self) -> usize {
        self.value.start()
    }

    /// Where the value stands.
    #[must_use]
    pub fn place(&self) -> Place {
        self.document.place(self.offset())
    }

    /// An error of this value.
    #[must_use]
    pub fn wrong(&self, problem: impl Into<String>) -> Error {
        Error {
            place: self.place(),
            field: self.path(),
            problem: problem.into(),
        }
    }

    fn expected(&self, what: &str) -> Error {
        self.wrong(format!("expected {what}, found {}", kind(self.value)))
    }

    /// An error of a member of this object, at its name.
    fn wrong_member(&self, p: &'a ObjectProp<'a>, problem: impl Into<String>) -> Error {
        Error {
            place: self.document.place(p.name.start()),
            field: self.child(Key::Name(p.name.as_str()), &p.value).path(),
            problem: problem.into(),
        }
    }

    fn properties(&self) -> Result<&'a [ObjectProp<'a>], Error> {
        match self.value {
            Value::Object(object) => Ok(&object.properties),
            _ => Err(self.expected("an object { ... }")),
        }
    }

    /// The members of an object in the order of the file.
    ///
    /// # Errors
    /// When it is no object, or a name is given twice.
    pub fn members(&self) -> Result<Vec<(&'a str, Self)>, Error> {
        let properties = self.properties()?;
        let mut members: Vec<(&'a str, Self)> = Vec::with_capacity(properties.len());
        let mut names = BTreeSet::new();
        for p in properties {
            let name = p.name.as_str();
            if !names.insert(name) {
                return Err(self.wrong_member(p, "given twice; keep one"));
            }
            members.push((name, self.child(Key::Name(name), &p.value)));
        }
        Ok(members)
    }

    /// The members of an object that may have only these names.
    ///
    /// # Errors
    /// When it is no object, or has another name or one twice.
    pub fn fields(&self, known: &[&str]) -> Result<Fields<'a>, Error> {
        let members = self.members()?;
        let unknown = self
            .properties()?
            .iter()
            .find(|p| !known.contains(&p.name.as_str()));
        match unknown {
            Some(p) => Err(self.wrong_member(
                p,
                format!("unknown field; {}", suggestion(p.name.as_str(), known)),
            )),
            None => Ok(Fields::new(self.clone(), members)),
        }
    }

    /// A member of an object that may have any others; absent and `null` are the same.
    ///
    /// # Errors
    /// When it is no object, or the name is given twice.
    pub fn get(&self, name: &str) -> Result<Option<Self>, Error> {
        let mut found = self
            .properties()?
            .iter()
            .filter(|p| p.name.as_str() == name);
        let Some(first) = found.next() else {
            return Ok(None);
        };
        if let Some(second) = found.next() {
            return Err(self.wrong_member(second, "given twice; keep one"));
        }
        let child = self.child(Key::Name(first.name.as_str()), &first.value);
        Ok((!child.is_null()).then_some(child))
    }

    /// A member of an object that must be there and may have any others.
    ///
    /// # Errors
    /// When it is missing or given twice.
    pub fn need(&self, name: &str) -> Result<Self, Error> {
        self.get(name)?
            .ok_or_else(|| self.wrong(format!("the field {} is missing", self.member_path(name))))
    }

    pub(super) fn member_path(&self, name: &str) -> String {
        if self.step.is_none() {
            name.to_owned()
        } else {
            format!("{}.{name}", self.path())
        }
    }

    /// The items of a list.
    ///
    /// # Errors
    /// When it is no list.
    pub fn items(&self) -> Result<Vec<Self>, Error> {
        let Value::Array(array) = self.value else {
            return Err(self.expected("a list [ ... ]"));
        };
        let items = array.elements.iter().enumerate();
        Ok(items
            .map(|(i, value)| self.child(Key::Index(i), value))
            .collect())
    }

    /// Members and items, whatever it is.
    pub(super) fn children(&self) -> Vec<Self> {
        match self.value {
            Value::Object(object) => {
                let child = |p: &'a ObjectProp<'a>| (p.name.as_str(), &p.value);
                let all = object.properties.iter().map(child);
                all.map(|(name, value)| self.child(Key::Name(name), value))
                    .collect()
            }
            _ => self.items().unwrap_or_default(),
        }
    }

    /// Whether it is `null`.
    #[must_use]
    pub fn is_null(&self) -> bool {
        matches!(self.value, Value::NullKeyword(_))
    }

    /// Whether it is a list.
    #[must_use]
    pub fn is_list(&self) -> bool {
        matches!(self.value, Value::Array(_))
    }

    /// The number that it is, if it is a finite one.
    #[must_use]
    pub fn as_number(&self) -> Option<f64> {
        match self.value {
            Value::NumberLit(n) => float(n.value).filter(|n| n.is_finite()),
            _ => None,
        }
    }

    /// A text.
    ///
    /// # Errors
    /// When it is none.
    pub fn text(&self) -> Result<&'a str, Error> {
        match self.value {
            Value::StringLit(s) => Ok(s.value.as_ref()),
            _ => Err(self.expected("a text in quotes")),
        }
    }

    /// One of these texts, and what it stands for.
    ///
    /// # Errors
    /// When it is none of them; names them all.
    pub fn one_of<T: Copy>(&self, all: &[(&str, T)]) -> Result<T, Error> {
        let text = self.text()?;
        let found = all.iter().find(|(name, _)| *name == text);
        found.map(|(_, value)| *value).ok_or_else(|| {
            let names: Vec<String> = all.iter().map(|(n, _)| format!("\"{n}\"")).collect();
            let names = match names.as_slice() {
                [first @ .., last] if !first.is_empty() => {
                    format!("{} or {last}", first.join(", "))
                }
                _ => names.join(", "),
            };
            self.wrong(format!("is \"{text}\"; expected {names}"))
        })
    }

    /// A name that may stand in a key: letters, digits, - and _.
    ///
    /// # Errors
    /// When it is none.
    pub fn word(&self) -> Result<String, Error> {
        let text = self.text()?;
        let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if text.is_empty() || text.len() > 32 || !text.chars().all(fits) {
            return Err(self.wrong("expected 1 to 32 letters, digits, - or _"));
        }
        Ok(text.to_owned())
    }

    /// True or false.
    ///
    /// # Errors
    /// When it is neither.
    pub fn flag(&self) -> Result<bool, Error> {
        match self.value {
            Value::BooleanLit(b) => Ok(b.value),
            _ => Err(self.expected("true or false")),
        }
    }

    /// A finite number.
    ///
    /// # Errors
    /// When it is none.
    pub fn finite(&self) -> Result<f64, Error> {
        self.as_number()
            .ok_or_else(|| self.expected("a finite number"))
    }

    /// A finite number in a closed range; `unit` is what it counts.
    ///
    /// # Errors
    /// When it is none or out of range.
    pub fn number(&self, low: f64, high: f64, unit: &str) -> Result<f64, Error> {
        let Value::NumberLit(literal) = self.value else {
            return Err(self.expected(&format!("a number ({unit}) between {low} and {high}")));
        };
        let n = self.as_number().ok_or_else(|| {
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
    ///
    /// # Errors
    /// When it is none or out of range.
    pub fn whole(&self, low: u32, high: u32, unit: &str) -> Result<u32, Error> {
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
    ///
    /// # Errors
    /// When it is none or out of range.
    pub fn small(&self, low: u16, high: u16, unit: &str) -> Result<u16, Error> {
        let n = self.whole(u32::from(low), u32::from(high), unit)?;
        u16::try_from(n).map_err(|_| self.wrong("too large"))
    }

    /// A whole number of up to 64 bits, such as a seed.
    ///
    /// # Errors
    /// When it is none or out of range.
    pub fn count(&self, low: u64, high: u64, unit: &str) -> Result<u64, Error> {
        let Value::NumberLit(literal) = self.value else {
            return Err(self.expected(&format!("a whole number ({unit}) between {low} and {high}")));
        };
        let n = natural(literal.value).filter(|n| (low..=high).contains(n));
        n.ok_or_else(|| {
            self.wrong(format!(
                "{} is no whole number in range; expected {unit} between {low} and {high}",
                literal.value
            ))
        })
    }

    /// Two numbers in a list.
    ///
    /// # Errors
    /// When it is no list of two, or one of them is out of range.
    pub fn pair(&self, low: f64, high: f64, unit: &str) -> Result<(f64, f64), Error> {
        match self.items()?.as_slice() {
            [a, b] => Ok((a.number(low, high, unit)?, b.number(low, high, unit)?)),
            other => Err(self.wrong(format!(
                "expected two numbers ({unit}), found {}",
                other.len()
            ))),
        }
    }

    /// The value without its place.
    #[must_use]
    pub fn to_json(&self) -> serde_json::Value {
        self.value.clone().into()
    }
}
