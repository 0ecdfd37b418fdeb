//! The site as it is drawn: where its modules are, and what is around them.
//!
//! ```text
//!   site ─▶ transforms: site ─▶ module/NAME, for each that is placed
//!        ─▶ map: an entity for each wall, zone, entry, line, mover, exclude, door, reader, floor and module
//! ```

use kehai_tracking::site::floor::Floor;
use kehai_tracking::site::reader::Reads;
use kehai_tracking::site::{Module, Site};

use super::message::{
    Color, Cylinder, Deletion, Entity, FrameTransform, FrameTransforms, Joined, Line, Pose, Quaternion,
    SceneUpdate, Text, Time, Vector3,
};
use super::{SITE_FRAME, module_frame};

/// How wide lines are drawn, m: walls as a plan has them, what is painted on the floor as a tape.
const WALL_M: f64 = 0.08;
const TAPE_M: f64 = 0.03;

/// A module's box, m.
const BOX_M: f64 = 0.1;

const WALL: Color = rgb(0.35, 0.35, 0.4);
const ZONE: Color = rgb(0.2, 0.6, 0.3);
const ENTRY: Color = rgb(0.9, 0.6, 0.1);
const LINE: Color = rgb(0.6, 0.3, 0.8);
const LEFT_OUT: Color = rgb(0.6, 0.6, 0.6);
const DOOR: Color = rgb(0.85, 0.2, 0.2);
const DEVICE: Color = rgb(0.1, 0.4, 0.7);

const fn rgb(r: f64, g: f64, b: f64) -> Color {
    Color { r, g, b, a: 1.0 }
}

/// Where the modules are from `at_ns` on, since 1970. One that is not placed is nowhere.
pub fn transforms(site: &Site, at_ns: u64) -> FrameTransforms {
    let transform = |module: &Module| FrameTransform {
        timestamp: Time::of_ns(at_ns),
        parent_frame_id: SITE_FRAME.to_owned(),
        child_frame_id: module_frame(&module.name),
        translation: Vector3 { x: module.x, y: module.y, z: module.height_m },
        rotation: Quaternion::yaw(module.pose().yaw_rad),
    };
    FrameTransforms {
        transforms: site.modules.iter().filter(|module| module.placed).map(transform).collect(),
    }
}

/// What is around the modules from `at_ns` on, since 1970; what was there before is gone.
pub fn map(site: &Site, at_ns: u64) -> SceneUpdate {
    let mut map = Map { at: Time::of_ns(at_ns), entities: Vec::new() };
    for wall in &site.walls {
        map.paint("wall", "", Joined::Strip, &wall.points, (WALL, WALL_M));
    }
    for zone in &site.zones {
        map.paint("zone", &zone.name, Joined::Loop, &zone.polygon, (ZONE, TAPE_M));
    }
    for entry in &site.entries {
        map.paint("entry", &entry.name, Joined::Strip, &entry.line, (ENTRY, TAPE_M));
    }
    for line in &site.lines {
        map.paint("line", &line.name, Joined::Strip, &[line.from, line.to], (LINE, TAPE_M));
    }
    for mover in &site.movers {
        map.paint("mover", &mover.name, Joined::Loop, &mover.polygon, (LEFT_OUT, TAPE_M));
    }
    for exclude in &site.excludes {
        map.paint("exclude", &exclude.name, Joined::Loop, &exclude.polygon, (LEFT_OUT, TAPE_M));
    }
    for floor in &site.floors {
        map.paint("floor", &floor.name, Joined::Loop, &corners(floor), (DEVICE, TAPE_M));
    }
    for door in &site.doors {
        map.paint("door", &door.name, Joined::Strip, &door.line, (DOOR, WALL_M));
    }
    for reader in &site.readers {
        // Where a camera stands, its file does not say.
        if let Reads::Near { at, .. } = reader.reads {
            map.stand("reader", &reader.name, [at.x, at.y, 0.0]);
        }
    }
    for module in site.modules.iter().filter(|module| module.placed) {
        map.stand("module", &module.name, [module.x, module.y, module.height_m]);
    }
    SceneUpdate { deletions: vec![Deletion::all(map.at)], entities: map.entities }
}

fn corners(floor: &Floor) -> [[f64; 2]; 4] {
    let (columns_m, rows_m) =
        (f64::from(floor.columns) * floor.pitch_m, f64::from(floor.rows) * floor.pitch_m);
    [[0.0, 0.0], [columns_m, 0.0], [columns_m, rows_m], [0.0, rows_m]].map(|corner| {
        let corner = floor.corner().to_site(corner.into());
        [corner.x, corner.y]
    })
}

struct Map {
    at: Time,
    entities: Vec<Entity>,
}

impl Map {
    /// An empty entity. Parts may have no name, or share one; entities may not.
    fn entity(&self, kind: &str, name: &str) -> Entity {
        let id = format!("{}/{kind}/{name}", self.entities.len());
        Entity::new(SITE_FRAME, id, self.at, 0)
    }

    /// Something that is drawn on the floor, so wide, and its name in the middle of its corners.
    fn paint(&mut self, kind: &str, name: &str, joined: Joined, points: &[[f64; 2]], style: (Color, f64)) {
        let (color, thickness) = style;
        let mut entity = self.entity(kind, name);
        entity.lines = vec![Line::new(joined, points, color, thickness)];
        let share = 1.0 / points.len().max(1) as f64;
        let middle =
            points.iter().fold([0.0; 2], |[x, y], point| [x + share * point[0], y + share * point[1]]);
        if !name.is_empty() {
            entity.texts = vec![Text::new(name.to_owned(), middle, TAPE_M, color)];
        }
        self.entities.push(entity);
    }

    /// A device, and its name above.
    fn stand(&mut self, kind: &str, name: &str, [x, y, z]: [f64; 3]) {
        let mut entity = self.entity(kind, name);
        entity.cylinders = vec![Cylinder {
            pose: Pose::at(x, y, z),
            size: Vector3 { x: BOX_M, y: BOX_M, z: BOX_M },
            bottom_scale: 1.0,
            top_scale: 1.0,
            color: DEVICE,
        }];
        entity.texts = vec![Text::new(name.to_owned(), [x, y], z + 2.0 * BOX_M, DEVICE)];
        self.entities.push(entity);
    }
}
