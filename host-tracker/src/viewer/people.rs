//! A line of tracks as it is drawn: a cylinder for each track, with its number above.

use kehai_tracking::jsonl::{TrackLine, TracksLine};
use kehai_tracking::tracker::LifeCycle;

use super::SITE_FRAME;
use super::message::{Color, Cylinder, Entity, KeyValue, Pose, SceneUpdate, Text, Time, Vector3};

/// A body, m.
const WIDTH_M: f64 = 0.45;
const HEIGHT_M: f64 = 1.7;

/// How long it stays without another line, ns: three lines.
const LIFETIME_NS: u64 = 300_000_000;

const GREY: Color = Color { r: 0.5, g: 0.5, b: 0.5, a: 1.0 };

/// The tracks of a line that was given at `at_ns`, since 1970.
pub fn people(line: &TracksLine, at_ns: u64) -> SceneUpdate {
    let at = Time::of_ns(at_ns);
    let entities = line.tracks.iter().map(|track| person(track, at)).collect();
    SceneUpdate { deletions: Vec::new(), entities }
}

fn person(track: &TrackLine, at: Time) -> Entity {
    let (state, a) = match track.state {
        LifeCycle::Tentative => ("tentative", 0.2),
        LifeCycle::Confirmed => ("confirmed", 0.9),
        LifeCycle::Occluded => ("occluded", 0.4),
    };
    let known = |key: &str, value: &str| KeyValue { key: key.to_owned(), value: value.to_owned() };
    let mut entity = Entity::new(SITE_FRAME, track.id.to_string(), at, LIFETIME_NS);
    entity.metadata = vec![known("state", state), known("reason", &track.reason)];
    entity.cylinders = vec![Cylinder {
        pose: Pose::at(track.x, track.y, 0.5 * HEIGHT_M),
        size: Vector3 { x: WIDTH_M, y: WIDTH_M, z: HEIGHT_M },
        bottom_scale: 1.0,
        top_scale: 0.6,
        color: Color { r: 0.1, g: 0.5, b: 0.9, a },
    }];
    entity.texts = vec![Text::new(track.id.to_string(), [track.x, track.y], HEIGHT_M + 0.2, GREY)];
    entity
}
