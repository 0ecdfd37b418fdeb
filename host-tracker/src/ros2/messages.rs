//! The messages that are published, field by field as ROS 2 has them: their layout and their hash come from the same words.
//!
//! ```text
//!   People ── Person            MarkerArray ── Marker         TFMessage ── TransformStamped
//!   DiagnosticArray ── DiagnosticStatus ── KeyValue           LaserScan
//! ```
//!
//! Metres, radians, seconds; x, y on the floor, z up.
//!
//! Source: `people_msgs` (wg-perception/people, branch ros2), `visualization_msgs`, `sensor_msgs`, `geometry_msgs`, `std_msgs`,
//! `diagnostic_msgs` (ros2/common_interfaces, jazzy), `tf2_msgs` (ros2/geometry2), `builtin_interfaces`.

use serde::{Serialize, Serializer};

use super::describe::{Base, Described, Kind, Message, Type};

const NS_PER_S: u64 = 1_000_000_000;

macro_rules! messages {
    ($($name:ident = $ros:literal { $($field:ident: $kind:ty),* $(,)? })*) => {$(
        #[derive(Clone, Debug, Default, PartialEq, Serialize)]
        pub struct $name {
            $(pub $field: $kind),*
        }

        impl Message for $name {
            const TYPE: Type =
                Type { name: $ros, fields: &[$((stringify!($field), <$kind as Described>::KIND)),*] };
        }

        impl Described for $name {
            const KIND: Kind = Kind::one(Base::Nested(&Self::TYPE));
        }
    )*};
}

messages! {
    Time = "builtin_interfaces/msg/Time" { sec: i32, nanosec: u32 }
    Duration = "builtin_interfaces/msg/Duration" { sec: i32, nanosec: u32 }
    Header = "std_msgs/msg/Header" { stamp: Time, frame_id: String }
    ColorRgba = "std_msgs/msg/ColorRGBA" { r: f32, g: f32, b: f32, a: f32 }
    Point = "geometry_msgs/msg/Point" { x: f64, y: f64, z: f64 }
    Vector3 = "geometry_msgs/msg/Vector3" { x: f64, y: f64, z: f64 }
    Quaternion = "geometry_msgs/msg/Quaternion" { x: f64, y: f64, z: f64, w: f64 }
    Pose = "geometry_msgs/msg/Pose" { position: Point, orientation: Quaternion }
    Transform = "geometry_msgs/msg/Transform" { translation: Vector3, rotation: Quaternion }
    TransformStamped = "geometry_msgs/msg/TransformStamped" {
        header: Header, child_frame_id: String, transform: Transform,
    }
    TfMessage = "tf2_msgs/msg/TFMessage" { transforms: Vec<TransformStamped> }
    Person = "people_msgs/msg/Person" {
        name: String, position: Point, velocity: Point, reliability: f64, tagnames: Vec<String>, tags: Vec<String>,
    }
    People = "people_msgs/msg/People" { header: Header, people: Vec<Person> }
    CompressedImage = "sensor_msgs/msg/CompressedImage" { header: Header, format: String, data: Vec<u8> }
    UvCoordinate = "visualization_msgs/msg/UVCoordinate" { u: f32, v: f32 }
    MeshFile = "visualization_msgs/msg/MeshFile" { filename: String, data: Vec<u8> }
    Marker = "visualization_msgs/msg/Marker" {
        header: Header, ns: String, id: i32, r#type: Shape, action: Action, pose: Pose, scale: Vector3,
        color: ColorRgba, lifetime: Duration, frame_locked: bool, points: Vec<Point>, colors: Vec<ColorRgba>,
        texture_resource: String, texture: CompressedImage, uv_coordinates: Vec<UvCoordinate>, text: String,
        mesh_resource: String, mesh_file: MeshFile, mesh_use_embedded_materials: bool,
    }
    MarkerArray = "visualization_msgs/msg/MarkerArray" { markers: Vec<Marker> }
    LaserScan = "sensor_msgs/msg/LaserScan" {
        header: Header, angle_min: f32, angle_max: f32, angle_increment: f32, time_increment: f32, scan_time: f32,
        range_min: f32, range_max: f32, ranges: Vec<f32>, intensities: Vec<f32>,
    }
    KeyValue = "diagnostic_msgs/msg/KeyValue" { key: String, value: String }
    DiagnosticStatus = "diagnostic_msgs/msg/DiagnosticStatus" {
        level: Level, name: String, message: String, hardware_id: String, values: Vec<KeyValue>,
    }
    DiagnosticArray = "diagnostic_msgs/msg/DiagnosticArray" { header: Header, status: Vec<DiagnosticStatus> }
}

/// The forms of a marker that are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    #[default]
    Arrow,
    Cylinder,
    LineStrip,
    /// A text that is turned to the viewer.
    Text,
}

impl Serialize for Shape {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_i32(match self {
            Self::Arrow => 0,
            Self::Cylinder => 3,
            Self::LineStrip => 4,
            Self::Text => 9,
        })
    }
}

impl Described for Shape {
    const KIND: Kind = i32::KIND;
}

/// What becomes of a marker: those of ours only come, and go when their time is over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Action {
    #[default]
    Add,
}

impl Serialize for Action {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_i32(match self {
            Self::Add => 0,
        })
    }
}

impl Described for Action {
    const KIND: Kind = i32::KIND;
}

/// How well something is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    #[default]
    Ok,
    Warn,
    Error,
    /// Nothing is known of it.
    Stale,
}

impl Serialize for Level {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_u8(match self {
            Self::Ok => 0,
            Self::Warn => 1,
            Self::Error => 2,
            Self::Stale => 3,
        })
    }
}

impl Described for Level {
    const KIND: Kind = Kind::one(Base::Byte);
}

impl Header {
    /// Of what is true at `stamp_ns` since 1970, in a frame.
    pub fn new(frame_id: &str, stamp_ns: u64) -> Self {
        Self { stamp: Time::of_ns(stamp_ns), frame_id: frame_id.to_owned() }
    }
}

impl Time {
    /// Since 1970. After 2038 it stays at its end.
    pub fn of_ns(ns: u64) -> Self {
        let (sec, nanosec) = (ns / NS_PER_S, (ns % NS_PER_S) as u32);
        Self { sec: i32::try_from(sec).unwrap_or(i32::MAX), nanosec }
    }
}

impl Quaternion {
    /// A turn about z, counter-clockwise.
    pub fn yaw(yaw_rad: f64) -> Self {
        let (z, w) = (0.5 * yaw_rad).sin_cos();
        Self { x: 0.0, y: 0.0, z, w }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By `rosbags` 0.11.9, from the definitions of Jazzy, and of `people_msgs` as its repository has them.
    #[test]
    fn types_are_those_of_jazzy() {
        let known = [
            (People::TYPE, "9ea98a5e58f833a9532957bca23a6b8006a12885d5a16c8ca41dd901d10c33b6"),
            (MarkerArray::TYPE, "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"),
            (TfMessage::TYPE, "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"),
            (LaserScan::TYPE, "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"),
            (DiagnosticArray::TYPE, "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"),
        ];
        for (kind, hash) in known {
            assert_eq!(kind.hash(), format!("RIHS01_{hash}"), "{}", kind.name);
        }
    }

    #[test]
    fn a_time_is_cut_into_seconds_and_nanoseconds() {
        assert_eq!(Time::of_ns(1_700_000_000_123_456_789), Time { sec: 1_700_000_000, nanosec: 123_456_789 });
        assert_eq!(Time::of_ns(u64::MAX).sec, i32::MAX);
    }

    #[test]
    fn a_quarter_turn_is_to_the_left() {
        let turned = Quaternion::yaw(std::f64::consts::FRAC_PI_2);
        assert!((turned.z - 0.5_f64.sqrt()).abs() < 1e-12 && (turned.w - 0.5_f64.sqrt()).abs() < 1e-12);
    }
}
