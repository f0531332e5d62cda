//! The part of a JSON schema that viewers of recordings understand.
//!
//! Foxglove and its kin make tables of fields out of a schema, and drop a channel whose schema
//! has anything else in its fields: no type or several (as what may be null has), arrays of
//! arrays, alternatives that are no numbers. What they take is told first, and all of it behind
//! `allOf`, which they skip and validators heed.

use serde_json::{Map, Value, json};

/// Types of which a field, or each item of a list, may be.
const PLAIN: [&str; 4] = ["boolean", "string", "number", "integer"];

/// A schema for both.
#[must_use]
pub fn schema_for_both(title: &str, whole: Value) -> Value {
    let mut told = fields(&whole);
    told["title"] = title.into();
    if let Some(required) = whole.get("required") {
        told["required"] = required.clone();
    }
    told["allOf"] = json!([whole]);
    told
}

/// An object with those of its fields that can be told.
fn fields(schema: &Value) -> Value {
    let all = schema["properties"].as_object();
    let told = all.into_iter().flatten();
    let told: Map<String, Value> = told
        .filter_map(|(name, of)| Some((name.clone(), field(of)?)))
        .collect();
    json!({ "type": "object", "properties": told })
}

/// What can be told of a field; nothing of what is of no one type.
fn field(schema: &Value) -> Option<Value> {
    let mut told = match only_type(schema)? {
        "array" => json!({ "type": "array", "items": single(&schema["items"])? }),
        _ => single(schema)?,
    };
    if let Some(text) = schema.get("description") {
        told["description"] = text.clone();
    }
    Some(told)
}

/// What can be told of what is no list.
fn single(schema: &Value) -> Option<Value> {
    match only_type(schema)? {
        "object" => Some(fields(schema)),
        plain => PLAIN.contains(&plain).then(|| json!({ "type": plain })),
    }
}

/// The type, where there is one; of alternatives that are all words, a string. What may be
/// `null` has two: validators would refuse it where only the other one is told.
fn only_type(schema: &Value) -> Option<&str> {
    if let Some(one) = schema["type"].as_str() {
        return Some(one);
    }
    let words = schema["oneOf"].as_array()?;
    let is_word = |one: &Value| one["const"].is_string() || one["enum"].is_array();
    words.iter().all(is_word).then_some("string")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_viewers_drop_is_told_to_validators_alone() {
        let whole = json!({
            "type": "object",
            "required": ["a"],
            "properties": {
                "a": { "type": "integer", "description": "A number" },
                "b": { "type": "array", "items": { "type": "array" } },
                "c": { "oneOf": [{ "const": "x" }, { "const": "y" }] },
                "d": { "type": "array", "items": { "type": "object", "properties": {
                    "e": { "type": ["string", "null"] }, "f": { "type": "boolean" } } } },
                "g": { "anyOf": [{ "type": "object" }, { "type": "null" }] },
            },
        });
        let told = schema_for_both("T", whole.clone());
        assert_eq!(told["title"], "T");
        assert_eq!(
            (&told["allOf"][0], &told["required"]),
            (&whole, &json!(["a"]))
        );
        assert_eq!(
            told["properties"],
            json!({
                "a": { "type": "integer", "description": "A number" },
                "c": { "type": "string" },
                "d": { "type": "array", "items": { "type": "object", "properties": {
                    "f": { "type": "boolean" } } } },
            })
        );
    }
}
