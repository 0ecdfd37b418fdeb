//! A schema as the types of a programming language see it.
//!
//! ```text
//!   {"type": ["integer", "null"]}              ─▶ Either [Integer, Null]
//!   {"type": "array", "items": X, "minItems": 2, "maxItems": 2} ─▶ Tuple [X, X]
//!   {"oneOf": [{"const": "known"}, …]}         ─▶ Either [Constant "known", …]
//!   {"properties": …, "required": …}           ─▶ Record
//! ```
//!
//! Only what `schemars` makes of serde types is understood: what is not is [`Shape::Any`].

use serde_json::{Map, Value};

/// A longer array of one kind is a list, whatever its length.
const TUPLE_MAX: u64 = 9;

/// What values are.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    Any,
    Null,
    Boolean,
    Integer,
    Number,
    Text,
    Constant(Value),
    Named(String),
    List(Box<Shape>),
    Tuple(Vec<Shape>),
    /// By any names.
    Map(Box<Shape>),
    Either(Vec<Shape>),
    Record(Vec<Field>),
}

/// A field of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    pub name: String,
    pub about: String,
    pub shape: Shape,
    pub is_needed: bool,
}

impl Shape {
    /// That of a schema.
    pub fn of(schema: &Value) -> Self {
        let Value::Object(schema) = schema else { return Self::Any };
        if let Some(Value::String(reference)) = schema.get("$ref") {
            return Self::Named(reference.rsplit('/').next().unwrap_or_default().to_owned());
        }
        if let Some(constant) = schema.get("const") {
            return Self::Constant(constant.clone());
        }
        if let Some(Value::Array(values)) = schema.get("enum") {
            return Self::either(values.iter().cloned().map(Self::Constant).collect());
        }
        for key in ["oneOf", "anyOf", "allOf"] {
            if let Some(Value::Array(parts)) = schema.get(key) {
                let either = Self::either(parts.iter().map(Self::of).collect());
                return match Self::of_object(schema) {
                    Self::Record(own) if !own.is_empty() => either.beside(own),
                    _ => either,
                };
            }
        }
        match schema.get("type") {
            Some(Value::String(kind)) => Self::of_kind(kind, schema),
            Some(Value::Array(kinds)) => {
                let kinds = kinds.iter().filter_map(Value::as_str);
                Self::either(kinds.map(|kind| Self::of_kind(kind, schema)).collect())
            }
            _ => Self::Any,
        }
    }

    fn either(mut parts: Vec<Self>) -> Self {
        if parts.len() == 1 { parts.remove(0) } else { Self::Either(parts) }
    }

    /// With more fields.
    fn beside(self, own: Vec<Field>) -> Self {
        let parts = if let Self::Either(parts) = self { parts } else { vec![self] };
        let mut fields = merged(parts.into_iter().filter(|part| matches!(part, Self::Record(_))));
        fields.iter_mut().for_each(|field| field.is_needed = false);
        Self::Record(own.into_iter().chain(fields).collect())
    }

    fn of_kind(kind: &str, schema: &Map<String, Value>) -> Self {
        match kind {
            "null" => Self::Null,
            "boolean" => Self::Boolean,
            "integer" => Self::Integer,
            "number" => Self::Number,
            "string" => Self::Text,
            "array" => Self::of_array(schema),
            "object" => Self::of_object(schema),
            _ => Self::Any,
        }
    }

    fn of_array(schema: &Map<String, Value>) -> Self {
        if let Some(Value::Array(parts)) = schema.get("prefixItems") {
            return Self::Tuple(parts.iter().map(Self::of).collect());
        }
        let item = schema.get("items").map_or(Self::Any, Self::of);
        let (least, most) = (schema.get("minItems"), schema.get("maxItems"));
        match most
            .and_then(Value::as_u64)
            .filter(|most| *most <= TUPLE_MAX && least == Some(&Value::from(*most)))
        {
            Some(many) => Self::Tuple((0..many).map(|_| item.clone()).collect()),
            None => Self::List(Box::new(item)),
        }
    }

    fn of_object(schema: &Map<String, Value>) -> Self {
        let Some(Value::Object(properties)) = schema.get("properties") else {
            return match schema.get("additionalProperties") {
                Some(values @ Value::Object(_)) => Self::Map(Box::new(Self::of(values))),
                Some(Value::Bool(true)) => Self::Map(Box::new(Self::Any)),
                _ => Self::Record(Vec::new()),
            };
        };
        let needed = schema.get("required").and_then(Value::as_array);
        let field = |(name, schema): (&String, &Value)| Field {
            name: name.clone(),
            about: about(schema),
            shape: Self::of(schema),
            is_needed: needed.is_some_and(|needed| needed.iter().any(|known| known == name)),
        };
        Self::Record(properties.iter().map(field).collect())
    }
}

/// The fields that any of several records has; needed are those that all have.
pub fn merged(records: impl Iterator<Item = Shape>) -> Vec<Field> {
    let records: Vec<Vec<Field>> = records
        .filter_map(|record| if let Shape::Record(fields) = record { Some(fields) } else { None })
        .collect();
    let mut all: Vec<Field> = Vec::new();
    for field in records.iter().flatten() {
        match all.iter_mut().find(|known| known.name == field.name) {
            None => all.push(field.clone()),
            Some(known) if known.shape != field.shape => {
                let mut shapes = match &known.shape {
                    Shape::Either(shapes) => shapes.clone(),
                    other => vec![other.clone()],
                };
                if !shapes.contains(&field.shape) {
                    shapes.push(field.shape.clone());
                }
                known.shape = Shape::Either(shapes);
            }
            Some(_) => {}
        }
    }
    let in_all = |name: &str| {
        records.iter().all(|fields| fields.iter().any(|field| field.name == name && field.is_needed))
    };
    all.iter_mut().for_each(|field| field.is_needed = in_all(&field.name));
    all
}

/// What a schema says of itself.
pub fn about(schema: &Value) -> String {
    schema["description"].as_str().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn each_form_is_understood() {
        let of = |schema: Value| Shape::of(&schema);
        assert_eq!(
            of(json!({ "type": ["integer", "null"] })),
            Shape::Either(vec![Shape::Integer, Shape::Null])
        );
        let pair = json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 });
        assert_eq!(of(pair), Shape::Tuple(vec![Shape::Number, Shape::Number]));
        let many = json!({ "type": "array", "items": { "type": "number" }, "minItems": 16, "maxItems": 16 });
        assert_eq!(of(many), Shape::List(Box::new(Shape::Number)));
        let words =
            json!({ "oneOf": [{ "const": "in", "type": "string" }, { "enum": ["out"], "type": "string" }] });
        assert_eq!(
            of(words),
            Shape::Either(vec![Shape::Constant(json!("in")), Shape::Constant(json!("out"))])
        );
        let map =
            json!({ "type": "object", "additionalProperties": { "$ref": "#/components/schemas/Track" } });
        assert_eq!(of(map), Shape::Map(Box::new(Shape::Named("Track".into()))));
        let tagged = |tag: &str, more: &str| json!({ "type": "object", "properties": { "is": { "const": tag }, more: { "type": "number" } }, "required": ["is", more] });
        let Shape::Either(parts) = of(json!({ "oneOf": [tagged("seen", "x"), tagged("gone", "y")] })) else {
            panic!("either")
        };
        let fields = merged(parts.into_iter());
        let needed: Vec<_> = fields.iter().map(|field| (field.name.as_str(), field.is_needed)).collect();
        assert_eq!(needed, [("is", true), ("x", false), ("y", false)]);
        let beside = json!({ "properties": { "words": { "type": "string" } }, "required": ["words"], "anyOf": [tagged("seen", "x"), { "type": "null" }] });
        let Shape::Record(fields) = of(beside) else { panic!("a record") };
        assert_eq!(fields.iter().filter(|field| field.is_needed).count(), 1);
        let record = json!({ "type": "object", "properties": { "a": { "type": "string" }, "b": true }, "required": ["a"] });
        let Shape::Record(fields) = of(record) else { panic!("a record") };
        assert_eq!(fields.iter().map(|field| field.is_needed).collect::<Vec<_>>(), [true, false]);
    }
}
