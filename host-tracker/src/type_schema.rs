//! The schema of a type, as what describes a request or a topic names it.

use schemars::{JsonSchema, Schema, SchemaGenerator};

/// Makes the schema of a type.
pub type Make = fn(&mut SchemaGenerator) -> Schema;

/// That of `T`, by reference if it has a name.
pub fn of<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    generator.subschema_for::<T>()
}
