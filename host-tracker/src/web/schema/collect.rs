//! The schemas of many types beside each other in one document: of what is sent, and of what is taken.
//!
//! ```text
//!   sends(of::<T>) ─▶ {"$ref": "#/components/schemas/Track"}
//!   takes(of::<T>) ─▶ {"$ref": "#/components/read/Site"} ─ finish ─▶ …/schemas/Site, if it is read as it is written
//!                                                                    …/schemas/SiteRead, else
//! ```
//!
//! A field that may be left out where it is read is always written, so that a type may have two schemas.

use std::collections::BTreeSet;

use schemars::Schema;
use schemars::generate::{SchemaGenerator, SchemaSettings};
use schemars::transform::RecursiveTransform;
use serde_json::{Map, Value};

use crate::type_schema::Make;

const SENT: &str = "/components/schemas";
const TAKEN: &str = "/components/read";

/// What is appended to the name of a type that is read otherwise than it is written.
const READ: &str = "Read";

/// Schemas for the part `components.schemas` of a document.
pub struct Collected {
    sent: SchemaGenerator,
    taken: SchemaGenerator,
}

impl Collected {
    /// None yet.
    pub fn new(settings: SchemaSettings) -> Self {
        let at = |path: &'static str| {
            let settings = settings.clone().with_transform(RecursiveTransform(plain));
            settings.with(|settings| settings.definitions_path = path.into())
        };
        Self {
            sent: at(SENT).for_serialize().into_generator(),
            taken: at(TAKEN).for_deserialize().into_generator(),
        }
    }

    /// The schema of what is sent.
    pub fn sends(&mut self, make: Make) -> Value {
        made(&mut self.sent, make)
    }

    /// The schema of what is taken.
    pub fn takes(&mut self, make: impl FnOnce(&mut SchemaGenerator) -> Schema) -> Value {
        made(&mut self.taken, make)
    }

    /// Every type that has a name. References in `document` lead to them then.
    pub fn finish(mut self, document: &mut Value) -> Map<String, Value> {
        let mut all = self.sent.take_definitions(true);
        let mut taken = self.taken.take_definitions(true);
        let others = others(&all, &taken);
        each_reference(document, &mut |reference| lead(reference, &others));
        for (name, mut schema) in std::mem::take(&mut taken) {
            each_reference(&mut schema, &mut |reference| lead(reference, &others));
            let name = if others.contains(&name) { format!("{name}{READ}") } else { name };
            all.insert(name, schema);
        }
        all
    }
}

fn made(generator: &mut SchemaGenerator, make: impl FnOnce(&mut SchemaGenerator) -> Schema) -> Value {
    let mut schema = make(generator);
    for transform in generator.transforms_mut() {
        transform.transform(&mut schema);
    }
    schema.to_value()
}

/// The names of types that are read otherwise than they are written: they, or what is in them.
fn others(sent: &Map<String, Value>, taken: &Map<String, Value>) -> BTreeSet<String> {
    let mut others = BTreeSet::new();
    loop {
        let differs = |name: &str, schema: &Value| {
            let mut schema = schema.clone();
            each_reference(&mut schema, &mut |reference| lead(reference, &others));
            sent.get(name).is_some_and(|sent| *sent != schema)
        };
        let found: BTreeSet<String> = taken
            .iter()
            .filter(|(name, schema)| differs(name, schema))
            .map(|(name, _)| name.clone())
            .collect();
        if found == others {
            return others;
        }
        others = found;
    }
}

fn lead(reference: &mut String, others: &BTreeSet<String>) {
    let Some(name) = reference.strip_prefix('#').and_then(|path| path.strip_prefix(TAKEN)) else { return };
    let read = if others.contains(name.trim_start_matches('/')) { READ } else { "" };
    *reference = format!("#{SENT}{name}{read}");
}

fn each_reference(value: &mut Value, change: &mut impl FnMut(&mut String)) {
    match value {
        Value::Object(fields) => {
            for (key, field) in fields {
                match field {
                    Value::String(reference) if key == "$ref" => change(reference),
                    field => each_reference(field, change),
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| each_reference(item, change)),
        _ => {}
    }
}

/// Descriptions come from the code's own documentation: its links lead nowhere here, and its lines are broken for the code.
pub(super) fn plain(schema: &mut Schema) {
    let Some(Value::String(text)) = schema.get_mut("description") else { return };
    let broken = text.replace('\n', " ");
    let mut parts = broken.split("](");
    let mut said = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        if let Some(begin) = said.rfind('[') {
            said.remove(begin);
        }
        said += part.split_once(')').map_or(part, |(_, rest)| rest);
    }
    *text = said.replace("[`", "`").replace("`]", "`").replace('`', "");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::type_schema::of;
    use schemars::JsonSchema;
    use serde::{Deserialize, Serialize};
    use serde_json::json;

    /// As [`long`](crate::web::schema) as
    /// [this], see [`Outer`].
    #[derive(Serialize, Deserialize, JsonSchema)]
    struct Inner {
        #[serde(default)]
        a: u8,
    }

    #[derive(Serialize, Deserialize, JsonSchema)]
    struct Outer {
        inner: Inner,
        same: Same,
    }

    #[derive(Serialize, Deserialize, JsonSchema)]
    struct Same {
        b: String,
    }

    #[test]
    fn a_type_has_two_schemas_if_it_or_what_is_in_it_is_read_otherwise_than_it_is_written() {
        let mut collected = Collected::new(SchemaSettings::draft2020_12());
        let mut document = json!([collected.sends(of::<Outer>), collected.takes(of::<Outer>)]);
        let all = collected.finish(&mut document);
        let of = |name: &str| json!({ "$ref": format!("#/components/schemas/{name}") });
        assert_eq!(document, json!([of("Outer"), of("OuterRead")]));
        assert_eq!(all.keys().collect::<Vec<_>>(), ["Inner", "InnerRead", "Outer", "OuterRead", "Same"]);
        assert_eq!(all["OuterRead"]["properties"]["inner"], of("InnerRead"));
        assert_eq!((&all["Inner"]["required"], &all["InnerRead"]["required"]), (&json!(["a"]), &Value::Null));
        assert_eq!(all["Inner"]["description"], "As long as [this], see Outer.");
    }
}
