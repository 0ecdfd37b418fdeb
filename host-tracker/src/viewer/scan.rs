//! How far each beam of a module saw nothing, as a laser scan: the free space.
//!
//! ```text
//!   beams, right to left   ·  ·  ·  ·  ·  ·  ·
//!   empty range, m        4.1 4.1 1.8 1.8  ?  4.0      ?: nothing is known
//!   ranges                4.1 4.1 1.8 1.8 NaN 4.0      of them there is no point
//! ```
//!
//! Protobuf, and not JSON as the others: JSON has no NaN, the JSON schema of a scan no null, and viewers draw a null as 0,
//! a point at the module. Fields: <https://docs.foxglove.dev/docs/sdk/schemas/laser-scan>.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet, Timestamp};

use super::module_frame;
use crate::scans::Scan;

pub const SCHEMA: &str = "foxglove.LaserScan";

const NS_PER_S: u64 = 1_000_000_000;

/// Its message, in a recording whose clock stood at 0 at `begun_ns`, since 1970.
pub fn scan(scan: &Scan, begun_ns: u64) -> Vec<u8> {
    let geometry = &scan.view.geometry;
    let at_ns = begun_ns.saturating_add((scan.start_s * 1e9) as u64);
    let timestamp = Timestamp { seconds: (at_ns / NS_PER_S) as i64, nanos: (at_ns % NS_PER_S) as i32 };
    let range_m = |&mm: &u16| if mm == 0 { f64::NAN } else { f64::from(mm) * 0.001 };
    LaserScan {
        timestamp: Some(timestamp),
        frame_id: module_frame(&scan.module),
        pose: Some(Pose {
            position: Some(Vector3::default()),
            orientation: Some(Quaternion { w: 1.0, ..Quaternion::default() }),
        }),
        start_angle: geometry.bearing_rad(0).into(),
        end_angle: geometry.bearing_rad(geometry.beams().saturating_sub(1)).into(),
        ranges: scan.empty_mm.iter().map(range_m).collect(),
        intensities: Vec::new(),
    }
    .encode_to_vec()
}

#[derive(Clone, PartialEq, Message)]
struct Vector3 {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
}

#[derive(Clone, PartialEq, Message)]
struct Quaternion {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
    #[prost(double, tag = "4")]
    w: f64,
}

#[derive(Clone, PartialEq, Message)]
struct Pose {
    #[prost(message, optional, tag = "1")]
    position: Option<Vector3>,
    #[prost(message, optional, tag = "2")]
    orientation: Option<Quaternion>,
}

#[derive(Clone, PartialEq, Message)]
struct LaserScan {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    frame_id: String,
    #[prost(message, optional, tag = "3")]
    pose: Option<Pose>,
    #[prost(double, tag = "4")]
    start_angle: f64,
    #[prost(double, tag = "5")]
    end_angle: f64,
    #[prost(double, repeated, tag = "6")]
    ranges: Vec<f64>,
    #[prost(double, repeated, tag = "7")]
    intensities: Vec<f64>,
}

/// The same as a `FileDescriptorSet`, in bytes: what MCAP has as a schema of protobuf.
pub fn descriptor() -> Vec<u8> {
    const TIMESTAMP: &str = "google/protobuf/timestamp.proto";
    let file = |name: &str, package: &str, needs: &[&str], messages| FileDescriptorProto {
        name: Some(name.to_owned()),
        package: Some(package.to_owned()),
        dependency: needs.iter().map(|&name| name.to_owned()).collect(),
        message_type: messages,
        syntax: Some("proto3".to_owned()),
        ..FileDescriptorProto::default()
    };
    let time = file(
        TIMESTAMP,
        "google.protobuf",
        &[],
        vec![message("Timestamp", vec![one("seconds", Type::Int64), one("nanos", Type::Int32)])],
    );
    let scan = file(
        "foxglove/LaserScan.proto",
        "foxglove",
        &[TIMESTAMP],
        vec![
            message("Vector3", ["x", "y", "z"].map(|name| one(name, Type::Double)).into()),
            message("Quaternion", ["x", "y", "z", "w"].map(|name| one(name, Type::Double)).into()),
            message(
                "Pose",
                vec![of("position", "foxglove.Vector3"), of("orientation", "foxglove.Quaternion")],
            ),
            message(
                "LaserScan",
                vec![
                    of("timestamp", "google.protobuf.Timestamp"),
                    one("frame_id", Type::String),
                    of("pose", "foxglove.Pose"),
                    one("start_angle", Type::Double),
                    one("end_angle", Type::Double),
                    many("ranges", Type::Double),
                    many("intensities", Type::Double),
                ],
            ),
        ],
    );
    FileDescriptorSet { file: vec![time, scan] }.encode_to_vec()
}

/// Fields are numbered as they stand, from 1.
fn message(name: &str, mut fields: Vec<FieldDescriptorProto>) -> DescriptorProto {
    for (number, field) in (1..).zip(&mut fields) {
        field.number = Some(number);
    }
    DescriptorProto { name: Some(name.to_owned()), field: fields, ..DescriptorProto::default() }
}

fn one(name: &str, kind: Type) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.to_owned()),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        ..FieldDescriptorProto::default()
    }
}

fn many(name: &str, kind: Type) -> FieldDescriptorProto {
    FieldDescriptorProto { label: Some(Label::Repeated.into()), ..one(name, kind) }
}

fn of(name: &str, message: &str) -> FieldDescriptorProto {
    FieldDescriptorProto { type_name: Some(format!(".{message}")), ..one(name, Type::Message) }
}
