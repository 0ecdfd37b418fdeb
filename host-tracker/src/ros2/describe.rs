//! What a type of ROS is made of, and the hash by which two programs know that they mean the same type.
//!
//! ```text
//!   Type: name, fields ─▶ JSON, with every type in it, by name ─ SHA-256 ─▶ RIHS01_ + 64 hexadecimal digits
//!   {"type_description": {"type_name": "…", "fields": [{"name": "x", "type": {"type_id": 11, "capacity": 0,
//!    "string_capacity": 0, "nested_type_name": ""}}]}, "referenced_type_descriptions": []}
//! ```
//!
//! Source: REP-2016; rosidl, `rosidl_generator_type_description`; the numbers: `type_description_interfaces/msg/FieldType.msg`.

use std::collections::BTreeMap;
use std::fmt::Write;

use data_encoding::HEXLOWER;
use serde::Serialize;
use sha2::{Digest, Sha256};

/// A message: how it is written, and what it is called.
pub trait Message: Serialize {
    const TYPE: Type;
}

/// What may be a field of a message.
pub trait Described {
    const KIND: Kind;
}

/// A message's name, as `geometry_msgs/msg/Point`, and its fields in their order.
#[derive(Debug)]
pub struct Type {
    pub name: &'static str,
    pub fields: &'static [(&'static str, Kind)],
}

/// What a field is: one value, or a sequence without a bound.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    pub base: Base,
    pub is_many: bool,
}

impl Kind {
    pub const fn one(base: Base) -> Self {
        Self { base, is_many: false }
    }
}

#[derive(Clone, Copy, Debug)]
pub enum Base {
    Nested(&'static Type),
    Uint8,
    Int32,
    Uint32,
    Float32,
    Float64,
    Boolean,
    Byte,
    Text,
}

impl Base {
    const fn id(self) -> u8 {
        match self {
            Self::Nested(_) => 1,
            Self::Uint8 => 3,
            Self::Int32 => 6,
            Self::Uint32 => 7,
            Self::Float32 => 10,
            Self::Float64 => 11,
            Self::Boolean => 15,
            Self::Byte => 16,
            Self::Text => 17,
        }
    }
}

/// What is added to a number for a sequence without a bound.
const UNBOUNDED: u8 = 144;

impl Described for u8 {
    const KIND: Kind = Kind::one(Base::Uint8);
}

impl Described for i32 {
    const KIND: Kind = Kind::one(Base::Int32);
}

impl Described for u32 {
    const KIND: Kind = Kind::one(Base::Uint32);
}

impl Described for f32 {
    const KIND: Kind = Kind::one(Base::Float32);
}

impl Described for f64 {
    const KIND: Kind = Kind::one(Base::Float64);
}

impl Described for bool {
    const KIND: Kind = Kind::one(Base::Boolean);
}

impl Described for String {
    const KIND: Kind = Kind::one(Base::Text);
}

impl<T: Described> Described for Vec<T> {
    const KIND: Kind = Kind { base: T::KIND.base, is_many: true };
}

impl Type {
    /// Its hash, as it stands in keys.
    pub fn hash(&self) -> String {
        format!("RIHS01_{}", HEXLOWER.encode(&Sha256::digest(self.json())))
    }

    /// Its description, to the byte as ROS writes it.
    fn json(&self) -> String {
        let mut others = BTreeMap::new();
        self.gather(&mut others);
        let others: Vec<String> = others.values().map(|other| other.own_json()).collect();
        format!(
            r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
            self.own_json(),
            others.join(", ")
        )
    }

    /// Every type in it, by name.
    fn gather(&self, others: &mut BTreeMap<&'static str, &'static Self>) {
        for (_, kind) in self.fields {
            if let Base::Nested(other) = kind.base
                && others.insert(other.name, other).is_none()
            {
                other.gather(others);
            }
        }
    }

    fn own_json(&self) -> String {
        let mut fields = String::new();
        for (number, (name, kind)) in self.fields.iter().enumerate() {
            let between = if number == 0 { "" } else { ", " };
            let id = kind.base.id() + if kind.is_many { UNBOUNDED } else { 0 };
            let nested = if let Base::Nested(other) = kind.base { other.name } else { "" };
            // A word of Rust's own has this mark as the name of a field.
            let name = name.trim_start_matches("r#");
            // Writing to a text does not fail.
            let _ = write!(
                fields,
                r#"{between}{{"name": "{name}", "type": {{"type_id": {id}, "capacity": 0, "string_capacity": 0, "nested_type_name": "{nested}"}}}}"#
            );
        }
        format!(r#"{{"type_name": "{}", "fields": [{fields}]}}"#, self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: Type =
        Type { name: "builtin_interfaces/msg/Time", fields: &[("sec", i32::KIND), ("nanosec", u32::KIND)] };

    #[test]
    fn a_type_is_described_with_all_that_is_in_it() {
        const HEADER: Type = Type {
            name: "std_msgs/msg/Header",
            fields: &[("stamp", Kind::one(Base::Nested(&TIME))), ("frame_id", String::KIND)],
        };
        let type_of = |id: u8, nested: &str| {
            format!(
                r#"{{"type_id": {id}, "capacity": 0, "string_capacity": 0, "nested_type_name": "{nested}"}}"#
            )
        };
        let time = format!(
            r#"{{"type_name": "builtin_interfaces/msg/Time", "fields": [{{"name": "sec", "type": {}}}, {{"name": "nanosec", "type": {}}}]}}"#,
            type_of(6, ""),
            type_of(7, "")
        );
        let header = format!(
            r#"{{"type_name": "std_msgs/msg/Header", "fields": [{{"name": "stamp", "type": {}}}, {{"name": "frame_id", "type": {}}}]}}"#,
            type_of(1, "builtin_interfaces/msg/Time"),
            type_of(17, "")
        );
        assert_eq!(
            HEADER.json(),
            format!(r#"{{"type_description": {header}, "referenced_type_descriptions": [{time}]}}"#)
        );
        assert_eq!(
            TIME.json(),
            format!(r#"{{"type_description": {time}, "referenced_type_descriptions": []}}"#)
        );
    }

    #[test]
    fn a_sequence_is_another_kind_and_a_mark_of_rust_is_no_part_of_a_name() {
        const LIST: Type = Type {
            name: "a/msg/B",
            fields: &[("r#type", <Vec<f32>>::KIND), ("level", Kind::one(Base::Byte))],
        };
        let json = LIST.own_json();
        assert!(json.contains(r#"{"name": "type", "type": {"type_id": 154,"#), "{json}");
        assert!(json.contains(r#"{"name": "level", "type": {"type_id": 16,"#), "{json}");
    }
}
