//! People, zones and walls of a snapshot, as `visualization_msgs/msg/MarkerArray`: for eyes, in RViz and Foxglove.
//!
//! ```text
//!   ns        id        what
//!   people    of track  a cylinder; pale while occluded
//!   names     of track  its number, above
//!   velocity  of track  an arrow to where it will be in a second, if it walks
//!   zones     in site   a strip around; grey: not known, amber: a part of it
//!   counts    in site   "hall: 2", "hall: ?"
//!   walls     in site   a strip
//! ```
//!
//! Each stays for half a second: what is not said again goes by itself, and so do all when the tracker has ended.

use kehai_tracking::jsonl::{TrackLine, ZoneLine};
use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::site::{Site, Zone};
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::tracker::LifeCycle;

use super::messages::{
    ColorRgba, Duration, Header, Marker, MarkerArray, Point, Pose, Quaternion, Shape, Vector3,
};
use super::names::MAP;
use super::people::followed;

/// A body, m: as a recording draws it.
const WIDTH_M: f64 = 0.45;
const HEIGHT_M: f64 = 1.7;

/// Letters, m, and how far above a body they stand.
const LETTERS_M: f64 = 0.25;

/// An arrow's shaft and head, m.
const ARROW: Vector3 = Vector3 { x: 0.06, y: 0.14, z: 0.14 };

/// How wide strips are, m: walls as a plan has them, what is painted on the floor as a tape.
const WALL_M: f64 = 0.08;
const TAPE_M: f64 = 0.03;

/// Slower than this a person stands, m/s: people who stand sway that much.
const WALKS_M_S: f64 = 0.2;

/// Five snapshots.
const LIFETIME: Duration = Duration { sec: 0, nanosec: 500_000_000 };

const PERSON: ColorRgba = rgb(0.1, 0.5, 0.9);
const TEXT: ColorRgba = rgb(0.5, 0.5, 0.5);
const WALL: ColorRgba = rgb(0.35, 0.35, 0.4);

const fn rgb(r: f32, g: f32, b: f32) -> ColorRgba {
    ColorRgba { r, g, b, a: 1.0 }
}

/// Everything that is drawn.
pub fn markers(snapshot: &Snapshot, site: &Site) -> MarkerArray {
    let header = Header::new(MAP, snapshot.stamp_ns());
    let mut markers = Vec::new();
    for (number, wall) in (0..).zip(&site.walls) {
        markers.push(strip(&header, "walls", number, &wall.points, (WALL_M, WALL)));
    }
    for (number, zone) in (0..).zip(&site.zones) {
        markers.extend(of_zone(&header, number, zone, snapshot.line.zones.get(&zone.name)));
    }
    for track in followed(snapshot, site) {
        markers.extend(of_person(&header, track));
    }
    MarkerArray { markers }
}

fn of_person(header: &Header, track: &TrackLine) -> Vec<Marker> {
    // A number that is too large for a marker begins anew: 2³¹ tracks later the one before is gone.
    let id = (track.id & 0x7fff_ffff) as i32;
    let a = if track.state == LifeCycle::Occluded { 0.4 } else { 0.9 };
    let color = ColorRgba { a, ..PERSON };
    let at = |z| Pose { position: Point { x: track.x, y: track.y, z }, orientation: Quaternion::yaw(0.0) };
    let body = Marker {
        r#type: Shape::Cylinder,
        pose: at(0.5 * HEIGHT_M),
        scale: Vector3 { x: WIDTH_M, y: WIDTH_M, z: HEIGHT_M },
        color: color.clone(),
        ..marker(header, "people", id)
    };
    let above = Marker { pose: at(HEIGHT_M + LETTERS_M), ..text(header, "names", id, track.id.to_string()) };
    let mut markers = vec![body, above];
    if track.vx.hypot(track.vy) > WALKS_M_S {
        let from = Point { x: track.x, y: track.y, z: 0.5 * HEIGHT_M };
        let to = Point { x: track.x + track.vx, y: track.y + track.vy, z: 0.5 * HEIGHT_M };
        let arrow = marker(header, "velocity", id);
        markers.push(Marker { scale: ARROW, color, points: vec![from, to], ..arrow });
    }
    markers
}

fn of_zone(header: &Header, number: i32, zone: &Zone, line: Option<&ZoneLine>) -> [Marker; 2] {
    let color = match line.map_or(ZoneKnown::Unknown, ZoneLine::state) {
        ZoneKnown::Known => rgb(0.2, 0.6, 0.3),
        ZoneKnown::Partly => rgb(0.9, 0.6, 0.1),
        ZoneKnown::Unknown => rgb(0.6, 0.6, 0.6),
    };
    let mut corners = zone.polygon.clone();
    corners.extend(zone.polygon.first());
    let count = line.and_then(ZoneLine::count).map_or("?".to_owned(), |count| count.to_string());
    let share = 1.0 / zone.polygon.len().max(1) as f64;
    let middle =
        zone.polygon.iter().fold([0.0; 2], |[x, y], corner| [x + share * corner[0], y + share * corner[1]]);
    let [x, y] = middle;
    let pose = Pose { position: Point { x, y, z: LETTERS_M }, orientation: Quaternion::yaw(0.0) };
    let words = Marker { pose, ..text(header, "counts", number, format!("{}: {count}", zone.name)) };
    [strip(header, "zones", number, &corners, (TAPE_M, color)), words]
}

fn strip(header: &Header, ns: &str, id: i32, points: &[[f64; 2]], style: (f64, ColorRgba)) -> Marker {
    let (x, color) = style;
    let points = points.iter().map(|&[x, y]| Point { x, y, z: 0.0 }).collect();
    let scale = Vector3 { x, ..Vector3::default() };
    Marker { r#type: Shape::LineStrip, scale, color, points, ..marker(header, ns, id) }
}

fn text(header: &Header, ns: &str, id: i32, text: String) -> Marker {
    let scale = Vector3 { z: LETTERS_M, ..Vector3::default() };
    Marker { r#type: Shape::Text, scale, color: TEXT, text, ..marker(header, ns, id) }
}

fn marker(header: &Header, ns: &str, id: i32) -> Marker {
    let pose = Pose { orientation: Quaternion::yaw(0.0), ..Pose::default() };
    Marker { header: header.clone(), ns: ns.to_owned(), id, pose, lifetime: LIFETIME, ..Marker::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::jsonl::TracksLine;
    use kehai_tracking::occupancy::Found;
    use serde_json::json;

    const SITE: &str = "
        [[wall]]
        points = [[0, 0], [4, 0]]
        [[zone]]
        name = \"hall\"
        polygon = [[0, 0], [4, 0], [4, 4], [0, 4]]
        [[zone]]
        name = \"yard\"
        polygon = [[9, 0], [10, 0], [10, 1]]";

    fn drawn() -> Vec<Marker> {
        let track = |id: u64, vx: f64, state: &str| {
            let track = json!({ "id": id, "x": 1.0, "y": 2.0, "vx": vx, "vy": 0.0, "state": state });
            serde_json::from_value(track).unwrap()
        };
        let tracks =
            vec![track(3, 1.0, "confirmed"), track(1 << 31 | 4, 0.1, "occluded"), track(5, 1.0, "tentative")];
        let hall = ZoneLine::new(Found::inside(2, vec![0.0, 0.0, 1.0]), 1.0, ZoneKnown::Known);
        let line = TracksLine { t: 1.0, tracks, zones: [("hall".to_owned(), hall)].into() };
        markers(&Snapshot::of(1_700_000_000_000, line), &toml::from_str(SITE).unwrap()).markers
    }

    #[track_caller]
    fn one<'a>(markers: &'a [Marker], ns: &str, id: i32) -> &'a Marker {
        let mut found = markers.iter().filter(|marker| marker.ns == ns && marker.id == id);
        let one = found.next().unwrap_or_else(|| panic!("{ns} {id}"));
        assert_eq!(found.next(), None, "{ns} {id} stands there twice");
        one
    }

    #[test]
    fn a_person_is_a_cylinder_with_a_number_and_an_arrow_if_it_walks() {
        let markers = drawn();
        let body = one(&markers, "people", 3);
        assert_eq!((body.r#type, body.header.frame_id.as_str()), (Shape::Cylinder, "map"));
        assert_eq!(body.pose.position, Point { x: 1.0, y: 2.0, z: 0.85 });
        assert_eq!(one(&markers, "names", 3).text, "3");
        let arrow = one(&markers, "velocity", 3);
        assert_eq!(arrow.r#type, Shape::Arrow);
        assert_eq!(arrow.points[1], Point { x: 2.0, y: 2.0, z: 0.85 });
        // Hidden, hardly moving, and of a number beyond a marker's.
        assert!(one(&markers, "people", 4).color.a < body.color.a);
        assert!(!markers.iter().any(|marker| marker.ns == "velocity" && marker.id == 4));
        assert!(markers.iter().all(|marker| marker.id != 5 && marker.lifetime == LIFETIME));
    }

    #[test]
    fn a_zone_that_is_not_known_looks_so() {
        let markers = drawn();
        assert_eq!(one(&markers, "counts", 0).text, "hall: 2");
        assert_eq!(one(&markers, "counts", 1).text, "yard: ?");
        let (hall, yard) = (one(&markers, "zones", 0), one(&markers, "zones", 1));
        assert_ne!(hall.color, yard.color);
        assert_eq!((hall.points.len(), &hall.points[0]), (5, &hall.points[4]));
        assert_eq!(one(&markers, "walls", 0).points.len(), 2);
    }
}
