//! A site: where the modules are, and what is around them. Its own file, or the `[site]` part of a scene.
//!
//! ```toml
//! [[module]]          # yaw: where the front step points, counter-clockwise
//! name = "left"
//! x = -1.0
//! y = 0.0
//! yaw_deg = 0.0
//! height_m = 0.6
//! upside_down = false # whether it hangs head down
//!
//! [[wall]]
//! points = [[-1.0, -1.0], [-1.0, 1.0]]
//! blocks = ["people", "beams"]      # default both; glass blocks people only
//!
//! [[zone]]
//! name = "area"
//! polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
//!
//! [[entry]]
//! name = "street"
//! line = [[-1, -1], [1, -1]]
//! zone = "area"
//!
//! [[line]]            # counts who walks across it: `site::line`
//! name = "front"
//! from = [-1, -1]
//! to = [1, -1]
//!
//! [[mover]]           # the area a door leaf or a curtain sweeps
//! polygon = [[0.4, 1.0], [1.2, 1.0], [0.4, 1.8]]
//!
//! [[exclude]]         # no person is counted there
//! name = "shelf"
//! polygon = [[0.6, -1.0], [1.0, -1.0], [1.0, -0.6]]
//!
//! [[door]]            # lets in as many people as it was told: `site::door`
//! name = "front"
//! zone = "area"
//! line = [[-0.45, 1.0], [0.45, 1.0]]
//! fail = "secure"
//!
//! [[reader]]          # of cards or tags: `site::reader`
//! name = "hall"
//! x = 1.0
//! y = 0.2
//! reach_m = 0.8
//!
//! [[floor]]           # of pressure panels: `site::floor`
//! name = "mat"
//! x = -1.0
//! y = 0.0
//! columns = 24
//! rows = 24
//! ```
//!
//! Metres and degrees, counter-clockwise.

pub mod change;
mod check;
pub mod door;
mod enclosure;
pub mod floor;
mod kinds;
mod limits;
pub mod line;
pub mod merge;
pub mod pairs;
pub mod part;
pub mod reader;
mod shape;
pub mod wrong;

use self::door::Door;
use self::floor::Floor;
pub(crate) use self::limits::{BESIDE_M, FARTHEST_M, beside_m};
use self::line::CountingLine;
use self::reader::Reader;
use crate::cells::Areas;
use crate::geometry::{Point, Pose};
use kehai::address::host_name;
use kehai::wire::ModuleId;
use schemars::JsonSchema;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

/// Modules with their poses, walls, zones, entries, lines, movers, doors, readers and floors.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// The modules.
    #[serde(default, rename = "module")]
    pub modules: Vec<Module>,
    /// What stops people, beams or both.
    #[serde(default, rename = "wall")]
    pub walls: Vec<Wall>,
    /// Areas with a meaning.
    #[serde(default, rename = "zone")]
    pub zones: Vec<Zone>,
    /// Lines across which people come and go.
    #[serde(default, rename = "entry")]
    pub entries: Vec<Entry>,
    /// Lines across which people are counted.
    #[serde(default, rename = "line", skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<CountingLine>,
    /// Areas in which things move that are not people.
    #[serde(default, rename = "mover")]
    pub movers: Vec<Mover>,
    /// Areas in which no person is counted.
    #[serde(default, rename = "exclude", skip_serializing_if = "Vec::is_empty")]
    pub excludes: Vec<Exclude>,
    /// Doors that let in as many people as were entered.
    #[serde(default, rename = "door", skip_serializing_if = "Vec::is_empty")]
    pub doors: Vec<Door>,
    /// Readers of cards and tags.
    #[serde(default, rename = "reader", skip_serializing_if = "Vec::is_empty")]
    pub readers: Vec<Reader>,
    /// Floors of pressure panels.
    #[serde(default, rename = "floor", skip_serializing_if = "Vec::is_empty")]
    pub floors: Vec<Floor>,
}

/// A device's place in a site.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Place {
    /// The module of this number.
    Module(usize),
    /// The floor of this number.
    Floor(usize),
}

/// A module and where it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Module {
    /// Its name, MAC or instance name.
    pub name: String,
    /// Its place.
    pub x: f64,
    /// Its place.
    pub y: f64,
    /// Where its front step points.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Height of its plane above the floor.
    #[serde(default = "default_height_m")]
    pub height_m: f64,
    /// Whether it hangs head down: what it has on its left is on its right.
    #[serde(default, skip_serializing_if = "is_false")]
    pub upside_down: bool,
    /// Whether its place is known. One that is not placed is asked and calibrated, and nothing that it sees is used.
    #[serde(default = "placed", skip_serializing_if = "is_placed")]
    pub placed: bool,
    /// What in its background has the shape of a person and is none: bearing from its front to its left, degrees, and range, m.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub furniture: Vec<[f64; 2]>,
}

/// Paper A's height of the plane: the waist.
const fn default_height_m() -> f64 {
    0.6
}

const fn placed() -> bool {
    true
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
const fn is_placed(placed: &bool) -> bool {
    *placed
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
const fn is_false(value: &bool) -> bool {
    !*value
}

impl Module {
    /// One whose place is not known yet.
    #[must_use]
    pub const fn unplaced(name: String) -> Self {
        Self {
            name,
            x: 0.0,
            y: 0.0,
            yaw_deg: 0.0,
            height_m: default_height_m(),
            upside_down: false,
            placed: false,
            furniture: Vec::new(),
        }
    }

    /// Its place and direction.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose { at: Point::new(self.x, self.y), yaw_rad: self.yaw_deg.to_radians() }
    }
}

/// What a wall stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Blocks {
    /// No person walks through.
    People,
    /// No beam passes.
    Beams,
}

/// A wall: a line of straight pieces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "WallText")]
pub struct Wall {
    /// Its corners, at least two.
    pub points: Vec<[f64; 2]>,
    /// What it stops.
    pub blocks: Vec<Blocks>,
    /// Beams do not end at it but go on as its image shows.
    pub mirror: bool,
}

/// A wall as a file has it.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct WallText {
    /// Its corners, at least two.
    #[schemars(length(max = limits::CORNERS_MAX))]
    points: Vec<[f64; 2]>,
    /// What it stops.
    #[serde(default = "everything")]
    blocks: Vec<Blocks>,
    /// Beams do not end at it but go on as its image shows.
    #[serde(default)]
    mirror: bool,
    /// Site files that earlier maps saved have it; a scene has its own, `wall_reflectance`.
    #[serde(default, rename = "reflectance")]
    #[schemars(with = "serde_json::Value", extend("deprecated" = true))]
    _reflectance: IgnoredAny,
}

impl From<WallText> for Wall {
    fn from(WallText { points, blocks, mirror, _reflectance }: WallText) -> Self {
        Self { points, blocks, mirror }
    }
}

impl Wall {
    /// One that stops people and beams.
    #[must_use]
    pub fn of(points: Vec<[f64; 2]>) -> Self {
        Self { points, blocks: everything(), mirror: false }
    }

    /// Whether it stops people, or beams.
    #[must_use]
    pub fn stops(&self, what: Blocks) -> bool {
        self.blocks.contains(&what)
    }

    /// Its straight pieces.
    pub fn sides(&self) -> impl Iterator<Item = (Point, Point)> {
        self.points.windows(2).map(|ends| (Point::from(ends[0]), Point::from(ends[1])))
    }
}

fn everything() -> Vec<Blocks> {
    vec![Blocks::People, Blocks::Beams]
}

/// An area with a meaning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Zone {
    /// Its name.
    pub name: String,
    /// Its corners, at least three.
    #[schemars(length(max = limits::CORNERS_MAX))]
    pub polygon: Vec<[f64; 2]>,
    /// People in it are counted.
    #[serde(default)]
    pub count: bool,
    /// Unexplained tracks count, too.
    #[serde(default)]
    pub secure: bool,
    /// Walls and entries surround it. Where they are drawn all around it need not be said.
    #[serde(default)]
    pub enclosed: bool,
    /// More people in it than this raise an alarm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub people_max: Option<u32>,
    /// For how long it stays occupied for automations after the last person, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hold_s: Option<f64>,
}

impl Zone {
    /// One in which people are counted, with nothing else said of it.
    #[must_use]
    pub const fn counted(name: String, polygon: Vec<[f64; 2]>) -> Self {
        Self { name, polygon, count: true, secure: false, enclosed: false, people_max: None, hold_s: None }
    }

    /// Its polygon.
    #[must_use]
    pub fn corners(&self) -> Vec<Point> {
        corners(&self.polygon)
    }

    /// How far a segment is from it, m; 0 if any of it lies in it.
    pub(crate) fn apart_m(&self, segment: (Point, Point)) -> f64 {
        shape::apart_m(segment, &self.polygon)
    }
}

fn corners(polygon: &[[f64; 2]]) -> Vec<Point> {
    polygon.iter().map(|&corner| corner.into()).collect()
}

/// A line across which people come and go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Its name.
    pub name: String,
    /// Its ends, in either direction.
    pub line: [[f64; 2]; 2],
    /// The zone it leads to; by default the only one that counts.
    pub zone: Option<String>,
}

impl Entry {
    /// Its ends.
    #[must_use]
    pub fn ends(&self) -> (Point, Point) {
        (self.line[0].into(), self.line[1].into())
    }
}

/// An area in which a door leaf, a curtain or a fan moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mover {
    /// Its name.
    #[serde(default)]
    pub name: String,
    /// Its corners, at least three.
    #[schemars(length(max = limits::CORNERS_MAX))]
    pub polygon: Vec<[f64; 2]>,
}

impl Mover {
    /// Its polygon.
    #[must_use]
    pub fn corners(&self) -> Vec<Point> {
        corners(&self.polygon)
    }
}

/// An area in which no person is counted and no track begins: of shelves, machines, a neighbour's ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Exclude {
    /// Its name.
    #[serde(default)]
    pub name: String,
    /// Its corners, at least three.
    #[schemars(length(max = limits::CORNERS_MAX))]
    pub polygon: Vec<[f64; 2]>,
}

impl Exclude {
    /// Its polygon.
    #[must_use]
    pub fn corners(&self) -> Vec<Point> {
        corners(&self.polygon)
    }
}

/// Why a site's text cannot be used: its name, the line and what is wrong.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{0}")]
pub struct SiteError(String);

/// The number of the line that has the byte at `offset`, from 1.
#[must_use]
pub fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|byte| *byte == b'\n').count()
}

impl Site {
    /// Reads a site from text; `name` is what errors call it.
    ///
    /// # Errors
    /// One line: it is not TOML, has unknown or missing keys, or contradicts itself.
    pub fn parse(name: &str, text: &str) -> Result<Self, SiteError> {
        let site: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(0, |span| line_of(text, span.start));
            SiteError(format!("{name}:{line}: {}", error.message().replace('\n', " ")))
        })?;
        site.check().map_err(|error| SiteError(format!("{name}: {error}")))?;
        Ok(site)
    }

    /// The zones that make the total: those that count, or all, if none does.
    pub fn counted(&self) -> impl Iterator<Item = &Zone> {
        let none = !self.zones.iter().any(|zone| zone.count);
        self.zones.iter().filter(move |zone| none || zone.count)
    }

    /// Areas in which no person is counted.
    #[must_use]
    pub fn excluded(&self) -> Areas {
        Areas::of(self.excludes.iter().map(Exclude::corners).collect())
    }

    /// The site's module that has the name `name` (empty: not reported) and this identity.
    #[must_use]
    pub fn place_of(&self, name: &str, id: ModuleId) -> Option<usize> {
        position(self.modules.iter().map(|module| module.name.as_str()), name, id)
    }

    /// The place of the device that has this name and identity, as [`place_of`](Self::place_of) finds it.
    #[must_use]
    pub fn place_of_device(&self, name: &str, id: ModuleId) -> Option<Place> {
        let floor = || position(self.floors.iter().map(|floor| floor.name.as_str()), name, id);
        self.place_of(name, id).map(Place::Module).or_else(|| floor().map(Place::Floor))
    }

    /// Whether it is known where the module of this number is.
    #[must_use]
    pub fn is_placed(&self, module: usize) -> bool {
        self.modules.get(module).is_some_and(|module| module.placed)
    }

    /// The names of its devices whose place is known: placed modules, then floors.
    pub(crate) fn placed(&self) -> impl Iterator<Item = &str> {
        let modules = self.modules.iter().filter(|module| module.placed).map(|module| module.name.as_str());
        modules.chain(self.floors.iter().map(|floor| floor.name.as_str()))
    }

    /// All places for devices with their names: modules, then floors.
    pub fn places(&self) -> impl Iterator<Item = (Place, &str)> {
        let modules = self.modules.iter().enumerate();
        let floors = self.floors.iter().enumerate();
        let modules = modules.map(|(number, module)| (Place::Module(number), module.name.as_str()));
        modules.chain(floors.map(|(number, floor)| (Place::Floor(number), floor.name.as_str())))
    }
}

/// Which of the names in a site is this device's: its name, or its identity.
fn position<'a>(mut known: impl Iterator<Item = &'a str>, name: &str, id: ModuleId) -> Option<usize> {
    let (hex, instance) = (id.to_string(), host_name(id.0));
    known.position(|known| {
        (known == name && !name.is_empty())
            || (id != ModuleId::ANY && (known.eq_ignore_ascii_case(&hex) || known == instance.as_str()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_that_an_earlier_map_saved_is_read_and_saved_without_its_reflectance() {
        let text = "[[wall]]\npoints = [[0, 0], [1, 0]]\nreflectance = 0.53\nmirror = true\n";
        let site = Site::parse("home.toml", text).unwrap();
        assert_eq!((site.walls[0].blocks.len(), site.walls[0].mirror), (2, true));
        assert!(!toml::to_string(&site).unwrap().contains("reflectance"));
        let unknown =
            Site::parse("home.toml", &text.replace("reflectance", "colour")).unwrap_err().to_string();
        assert!(unknown.contains("unknown field `colour`"), "{unknown}");
    }
}
