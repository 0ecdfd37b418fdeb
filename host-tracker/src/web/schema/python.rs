//! The types of the Python client: a `TypedDict` for each record, a `Literal` for each closed list.

use serde_json::Value;

use super::openapi::openapi;
use super::shape::{Field, Shape, about, merged};
use super::{VERSION, WIDTH};

const KEYWORDS: [&str; 5] = ["in", "from", "is", "class", "import"];

/// The file.
#[must_use]
pub fn python() -> String {
    let mut text = format!(
        "\"\"\"What kehai-tracker sends and takes, version {VERSION}: made by `kehai-tracker schema python`.\"\"\"\n\n\
         from __future__ import annotations\n\n\
         from typing import Any, Literal, NotRequired, TypedDict\n"
    );
    let document = openapi();
    let schemas = document["components"]["schemas"].as_object().into_iter().flatten();
    // What is one of several types stands behind them: it is made when the file is read.
    let (late, early): (Vec<_>, Vec<_>) = schemas.partition(|(_, schema)| is_choice(&Shape::of(schema)));
    let mut follows_class = false;
    for (name, schema) in early.into_iter().chain(late) {
        let definition = definition(name, schema);
        let is_class = definition.starts_with("class ");
        text += if is_class || follows_class { "\n\n" } else { "\n" };
        text += &definition;
        follows_class = is_class;
    }
    text
}

fn is_choice(shape: &Shape) -> bool {
    matches!(shape, Shape::Either(parts) if words(parts).is_none() && !are_records(parts))
}

/// Records all, as of a key each, or with a tag.
fn are_records(parts: &[Shape]) -> bool {
    parts.iter().all(|part| matches!(part, Shape::Record(fields) if !fields.is_empty()))
}

fn definition(name: &str, schema: &Value) -> String {
    let about = about(schema);
    match Shape::of(schema) {
        Shape::Record(fields) => record(name, &about, &fields),
        // Python has no record without a name: one with all that any of them has.
        Shape::Either(parts) if are_records(&parts) => record(name, &about, &merged(parts.into_iter())),
        shape => format!("{}{name} = {}\n", comment("", &about), alias(name, &shape)),
    }
}

fn record(name: &str, about: &str, fields: &[Field]) -> String {
    if fields.iter().any(|field| KEYWORDS.contains(&field.name.as_str())) {
        let field = |field: &Field| {
            format!(
                "{}        \"{}\": \"{}\",\n",
                comment("        ", &field.about),
                field.name,
                needed(field).replace('"', "'")
            )
        };
        let fields: String = fields.iter().map(field).collect();
        return format!(
            "{}{name} = TypedDict(\n    \"{name}\",\n    {{\n{fields}    }},\n)\n",
            comment("", about)
        );
    }
    let field =
        |field: &Field| format!("{}    {}: {}\n", comment("    ", &field.about), field.name, needed(field));
    let fields: String = fields.iter().map(field).collect();
    let space = if fields.is_empty() { "" } else { "\n" };
    format!("class {name}(TypedDict):\n    \"\"\"{about}\"\"\"\n{space}{fields}")
}

fn comment(indent: &str, about: &str) -> String {
    if about.is_empty() { String::new() } else { format!("{indent}# {about}\n") }
}

fn needed(field: &Field) -> String {
    let shown = shown(&field.shape);
    if field.is_needed { shown } else { format!("NotRequired[{shown}]") }
}

/// What stands behind `NAME =`.
fn alias(name: &str, shape: &Shape) -> String {
    let short = shown(shape);
    match shape {
        Shape::Either(parts) if name.len() + 3 + short.len() > WIDTH && words(parts).is_some() => {
            let words = words(parts).unwrap_or_default();
            let words: String = words.iter().map(|word| format!("    {word},\n")).collect();
            format!("Literal[\n{words}]")
        }
        _ => short,
    }
}

/// Of a closed list.
fn words(parts: &[Shape]) -> Option<Vec<String>> {
    parts
        .iter()
        .map(|part| if let Shape::Constant(value) = part { Some(constant(value)) } else { None })
        .collect()
}

fn constant(value: &Value) -> String {
    match value {
        Value::Bool(true) => "True".to_owned(),
        Value::Bool(false) => "False".to_owned(),
        value => value.to_string(),
    }
}

fn shown(shape: &Shape) -> String {
    match shape {
        Shape::Any => "Any".to_owned(),
        Shape::Null => "None".to_owned(),
        Shape::Boolean => "bool".to_owned(),
        Shape::Integer => "int".to_owned(),
        Shape::Number => "float".to_owned(),
        Shape::Text => "str".to_owned(),
        Shape::Constant(value) => format!("Literal[{}]", constant(value)),
        Shape::Named(name) => name.clone(),
        Shape::List(item) => format!("list[{}]", shown(item)),
        // JSON has lists alone.
        Shape::Tuple(parts) => {
            let mut kinds: Vec<String> = parts.iter().map(shown).collect();
            kinds.dedup();
            format!("list[{}]", kinds.join(" | "))
        }
        Shape::Map(values) => format!("dict[str, {}]", shown(values)),
        Shape::Either(parts) => {
            let (constants, others): (Vec<Shape>, Vec<Shape>) =
                parts.iter().cloned().partition(|part| matches!(part, Shape::Constant(_)));
            let words = words(&constants).filter(|words| !words.is_empty());
            let literal = words.map(|words| format!("Literal[{}]", words.join(", ")));
            literal.into_iter().chain(others.iter().map(shown)).collect::<Vec<_>>().join(" | ")
        }
        Shape::Record(fields) => match &fields[..] {
            [field] => format!("dict[str, {}]", shown(&field.shape)),
            _ => "dict[str, Any]".to_owned(),
        },
    }
}
