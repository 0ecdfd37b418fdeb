//! The types of the TypeScript client: an interface for each record, a union for each closed list.

use serde_json::Value;

use super::openapi::openapi;
use super::shape::{Field, Shape, about};
use super::{VERSION, WIDTH};

/// The file.
#[must_use]
pub fn typescript() -> String {
    let mut text = format!(
        "// What kehai-tracker sends and takes, version {VERSION}: made by `kehai-tracker schema typescript`.\n"
    );
    let document = openapi();
    for (name, schema) in document["components"]["schemas"].as_object().into_iter().flatten() {
        text += "\n";
        text += &comment("", &about(schema));
        text += &match Shape::of(schema) {
            Shape::Record(fields) if fields.is_empty() => {
                format!("export type {name} = Record<string, never>;\n")
            }
            Shape::Record(fields) => {
                let field = |field: &Field| {
                    let Field { about, shape, is_needed, .. } = field;
                    format!(
                        "{}  {}{}: {};\n",
                        comment("  ", about),
                        key(&field.name),
                        if *is_needed { "" } else { "?" },
                        shown(shape)
                    )
                };
                format!("export interface {name} {{\n{}}}\n", fields.iter().map(field).collect::<String>())
            }
            shape => alias(name, &shape),
        };
    }
    text
}

fn alias(name: &str, shape: &Shape) -> String {
    let short = format!("export type {name} = {};\n", shown(shape));
    match shape {
        Shape::Either(parts) if short.len() > WIDTH => {
            let parts: Vec<String> = parts.iter().map(|part| format!("  | {}", shown(part))).collect();
            format!("export type {name} =\n{};\n", parts.join("\n"))
        }
        _ => short,
    }
}

fn comment(indent: &str, about: &str) -> String {
    if about.is_empty() { String::new() } else { format!("{indent}/** {about} */\n") }
}

fn shown(shape: &Shape) -> String {
    let all = |parts: &[Shape], between| parts.iter().map(shown).collect::<Vec<_>>().join(between);
    match shape {
        Shape::Any => "unknown".to_owned(),
        Shape::Null => "null".to_owned(),
        Shape::Boolean => "boolean".to_owned(),
        Shape::Integer | Shape::Number => "number".to_owned(),
        Shape::Text => "string".to_owned(),
        Shape::Constant(value) => constant(value),
        Shape::Named(name) => name.clone(),
        Shape::List(item) if matches!(**item, Shape::Either(_)) => format!("({})[]", shown(item)),
        Shape::List(item) => format!("{}[]", shown(item)),
        Shape::Tuple(parts) => format!("[{}]", all(parts, ", ")),
        Shape::Map(values) => format!("Record<string, {}>", shown(values)),
        Shape::Either(parts) => all(parts, " | "),
        Shape::Record(fields) => {
            let field = |field: &Field| {
                format!(
                    "{}{}: {}",
                    key(&field.name),
                    if field.is_needed { "" } else { "?" },
                    shown(&field.shape)
                )
            };
            format!("{{ {} }}", fields.iter().map(field).collect::<Vec<_>>().join("; "))
        }
    }
}

fn constant(value: &Value) -> String {
    value.to_string()
}

/// A name as it stands before a colon.
fn key(name: &str) -> String {
    let is_plain = name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_');
    if is_plain { name.to_owned() } else { format!("\"{name}\"") }
}
