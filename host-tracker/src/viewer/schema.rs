//! JSON Schemas as viewers read them: one type for each field, and nothing by reference.
//!
//! ```text
//!   a Rust type ─ schemars ─▶ JSON Schema ─ plain ─▶ object, array, string, number, integer, boolean
//!                                                    a field that is none of these, such as one that may be null, is left out
//! ```
//!
//! A schema without a field does not forbid it, so that what is written is as the schema says. Lichtblick refuses a channel
//! whose schema has anything else, or an object without `properties`.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

/// That of `T`, as it is written.
pub fn of<T: JsonSchema>() -> Vec<u8> {
    let settings =
        SchemaSettings::draft07().with(|settings| settings.inline_subschemas = true).for_serialize();
    let schema = settings.into_generator().into_root_schema_for::<T>();
    let mut schema = plain(schema.as_value()).unwrap_or_default();
    schema.insert("title".to_owned(), T::schema_name().into());
    Value::Object(schema).to_string().into_bytes()
}

fn plain(schema: &Value) -> Option<Map<String, Value>> {
    let kind = schema.get("type").and_then(Value::as_str).or_else(|| text(schema))?;
    let mut said = Map::from_iter([("type".to_owned(), json!(kind))]);
    match kind {
        "string" | "number" | "integer" | "boolean" => {}
        "array" => {
            let items = plain(schema.get("items")?)?;
            // Of lists of lists, viewers know nothing.
            if items.get("type").and_then(Value::as_str) == Some("array") {
                return None;
            }
            said.insert("items".to_owned(), items.into());
        }
        "object" => {
            let fields = schema.get("properties").and_then(Value::as_object).into_iter().flatten();
            let known: Map<String, Value> =
                fields.filter_map(|(name, field)| Some((name.clone(), plain(field)?.into()))).collect();
            if let Some(required) = schema.get("required") {
                said.insert("required".to_owned(), required.clone());
            }
            said.insert("properties".to_owned(), known.into());
        }
        _ => return None,
    }
    Some(said)
}

/// The type of a closed set of texts, which schemars lists.
fn text(schema: &Value) -> Option<&'static str> {
    let each = schema.get("oneOf")?.as_array()?;
    each.iter().all(|one| one.get("type").is_some_and(|kind| kind == "string")).then_some("string")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(serde::Serialize, JsonSchema)]
    #[allow(dead_code, reason = "only its schema is used")]
    struct Sample {
        number: f64,
        nothing: Option<f64>,
        map: std::collections::BTreeMap<String, u8>,
        corners: Vec<[f64; 2]>,
        inner: Vec<Inner>,
    }

    #[derive(serde::Serialize, JsonSchema)]
    struct Inner {
        word: String,
    }

    #[test]
    fn what_viewers_cannot_read_is_left_out() {
        let schema: Value = serde_json::from_slice(&of::<Sample>()).unwrap();
        let inner =
            json!({ "type": "object", "properties": { "word": { "type": "string" } }, "required": ["word"] });
        let expected = json!({
            "type": "object", "title": "Sample", "required": schema["required"],
            "properties": {
                "number": { "type": "number" }, "map": { "type": "object", "properties": {} },
                "inner": { "type": "array", "items": inner },
            },
        });
        assert_eq!(schema, expected);
    }
}
