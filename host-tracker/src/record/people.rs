//! A line of tracks as Foxglove draws it: a cylinder for each track, with a number above.

use serde_json::{Value, json};

use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::tracker::LifeCycle;

pub const TOPIC: &str = "/people";
pub const SCHEMA: &str = "foxglove.SceneUpdate";

/// A body, m.
const WIDTH_M: f64 = 0.45;
const HEIGHT_M: f64 = 1.7;

/// How long it stays without another line, ns: three lines.
const LIFETIME_NS: u64 = 300_000_000;

pub fn scene(line: &TracksLine, at_ns: u64) -> Value {
    let entities: Vec<Value> = line
        .tracks
        .iter()
        .map(|track| {
            let alpha = match track.state {
                LifeCycle::Tentative => 0.2,
                LifeCycle::Confirmed => 0.9,
                LifeCycle::Occluded => 0.4,
            };
            let pose = |z: f64| {
                json!({ "position": { "x": track.x, "y": track.y, "z": z },
                        "orientation": { "x": 0, "y": 0, "z": 0, "w": 1 } })
            };
            json!({
                "timestamp": time(at_ns),
                "frame_id": "site",
                "id": track.id.to_string(),
                "lifetime": time(LIFETIME_NS),
                "frame_locked": false,
                "metadata": [{ "key": "reason", "value": track.reason }],
                "arrows": [], "cubes": [], "spheres": [], "lines": [], "triangles": [], "models": [],
                "cylinders": [{
                    "pose": pose(0.5 * HEIGHT_M),
                    "size": { "x": WIDTH_M, "y": WIDTH_M, "z": HEIGHT_M },
                    "bottom_scale": 1, "top_scale": 0.6,
                    "color": { "r": 0.1, "g": 0.5, "b": 0.9, "a": alpha },
                }],
                "texts": [{
                    "pose": pose(HEIGHT_M + 0.2), "billboard": true, "font_size": 0.25, "scale_invariant": false,
                    "color": { "r": 0.5, "g": 0.5, "b": 0.5, "a": 1 }, "text": track.id.to_string(),
                }],
            })
        })
        .collect();
    json!({ "deletions": [], "entities": entities })
}

fn time(ns: u64) -> Value {
    json!({ "sec": ns / 1_000_000_000, "nsec": ns % 1_000_000_000 })
}
