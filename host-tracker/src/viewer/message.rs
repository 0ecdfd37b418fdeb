//! Messages of Foxglove that are written as JSON, with the fields that its schemas ask for.
//!
//! ```text
//!   FrameTransforms ── FrameTransform
//!   SceneUpdate ─┬─ Deletion
//!                └─ Entity ── Line, Cylinder, Text      what else an entity may have is empty
//!   Log
//! ```
//!
//! Metres and radians. Source: <https://docs.foxglove.dev/docs/sdk/schemas>, judged against npm `@foxglove/schemas` (MIT).

use schemars::JsonSchema;
use serde::Serialize;

const NS_PER_S: u64 = 1_000_000_000;

/// A time since 1970, or a duration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Time {
    sec: u64,
    nsec: u32,
}

impl Time {
    pub const fn of_ns(ns: u64) -> Self {
        Self { sec: ns / NS_PER_S, nsec: (ns % NS_PER_S) as u32 }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Vector3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Quaternion {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub w: f64,
}

impl Quaternion {
    /// A turn about z, counter-clockwise.
    pub fn yaw(yaw_rad: f64) -> Self {
        let (z, w) = (0.5 * yaw_rad).sin_cos();
        Self { x: 0.0, y: 0.0, z, w }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Pose {
    pub position: Vector3,
    pub orientation: Quaternion,
}

impl Pose {
    /// Upright.
    pub fn at(x: f64, y: f64, z: f64) -> Self {
        Self { position: Vector3 { x, y, z }, orientation: Quaternion::yaw(0.0) }
    }
}

/// Shares of 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Color {
    pub r: f64,
    pub g: f64,
    pub b: f64,
    pub a: f64,
}

#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FrameTransform {
    pub timestamp: Time,
    pub parent_frame_id: String,
    pub child_frame_id: String,
    pub translation: Vector3,
    pub rotation: Quaternion,
}

#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FrameTransforms {
    pub transforms: Vec<FrameTransform>,
}

/// What an entity of ours never has.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Unused {}

#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct KeyValue {
    pub key: String,
    pub value: String,
}

/// How the points of a line are joined.
#[derive(Clone, Copy, Debug)]
pub enum Joined {
    Strip,
    Loop,
}

#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Line {
    #[serde(rename = "type")]
    joined: u8,
    pose: Pose,
    thickness: f64,
    scale_invariant: bool,
    points: Vec<Vector3>,
    color: Color,
    colors: Vec<Color>,
    indices: Vec<u32>,
}

impl Line {
    /// On the floor, so wide.
    pub fn new(joined: Joined, points: &[[f64; 2]], color: Color, thickness: f64) -> Self {
        let joined = match joined {
            Joined::Strip => 0,
            Joined::Loop => 1,
        };
        let points = points.iter().map(|&[x, y]| Vector3 { x, y, z: 0.0 }).collect();
        let (pose, scale_invariant) = (Pose::at(0.0, 0.0, 0.0), false);
        Self {
            joined,
            pose,
            thickness,
            scale_invariant,
            points,
            color,
            colors: Vec::new(),
            indices: Vec::new(),
        }
    }
}

#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Cylinder {
    pub pose: Pose,
    pub size: Vector3,
    pub bottom_scale: f64,
    pub top_scale: f64,
    pub color: Color,
}

#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Text {
    pose: Pose,
    billboard: bool,
    font_size: f64,
    scale_invariant: bool,
    color: Color,
    text: String,
}

impl Text {
    /// A quarter of a metre high, turned to the viewer.
    pub fn new(text: String, [x, y]: [f64; 2], z: f64, color: Color) -> Self {
        Self {
            pose: Pose::at(x, y, z),
            billboard: true,
            font_size: 0.25,
            scale_invariant: false,
            color,
            text,
        }
    }
}

#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Entity {
    timestamp: Time,
    frame_id: String,
    id: String,
    lifetime: Time,
    frame_locked: bool,
    pub metadata: Vec<KeyValue>,
    arrows: Vec<Unused>,
    cubes: Vec<Unused>,
    spheres: Vec<Unused>,
    pub cylinders: Vec<Cylinder>,
    pub lines: Vec<Line>,
    triangles: Vec<Unused>,
    pub texts: Vec<Text>,
    models: Vec<Unused>,
}

impl Entity {
    /// One with nothing in it, that goes after `lifetime_ns`; 0: it stays.
    pub fn new(frame: &str, id: String, at: Time, lifetime_ns: u64) -> Self {
        Self {
            timestamp: at,
            frame_id: frame.to_owned(),
            id,
            lifetime: Time::of_ns(lifetime_ns),
            frame_locked: true,
            metadata: Vec::new(),
            arrows: Vec::new(),
            cubes: Vec::new(),
            spheres: Vec::new(),
            cylinders: Vec::new(),
            lines: Vec::new(),
            triangles: Vec::new(),
            texts: Vec::new(),
            models: Vec::new(),
        }
    }
}

/// Entities that are there no more.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Deletion {
    timestamp: Time,
    #[serde(rename = "type")]
    which: u8,
    id: String,
}

impl Deletion {
    /// All of the topic.
    pub const fn all(at: Time) -> Self {
        Self { timestamp: at, which: 1, id: String::new() }
    }
}

#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SceneUpdate {
    pub deletions: Vec<Deletion>,
    pub entities: Vec<Entity>,
}

/// How bad what a log says is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Info,
    Warning,
    Error,
}

#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Log {
    timestamp: Time,
    level: u8,
    message: String,
    name: String,
    file: String,
    line: u32,
}

impl Log {
    /// What `name` says. There is no file and no line of it.
    pub fn new(at: Time, level: Level, name: String, message: String) -> Self {
        let level = match level {
            Level::Info => 2,
            Level::Warning => 3,
            Level::Error => 4,
        };
        Self { timestamp: at, level, message, name, file: String::new(), line: 0 }
    }
}
