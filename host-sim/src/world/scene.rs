//! A scene: a site, the people in it, and the sensors that measure them, as a TOML file.
//!
//! ```toml
//! about = "one person walks to and fro"
//! duration_s = 60
//! seed = 1
//! base = "door-area"              # another scene, of which this one changes something
//! avoid = true                    # people avoid each other
//! wall_reflectance = 0.53         # share of the light that all walls give back: painted plaster
//!
//! [[site.module]]                 # and site.wall, site.zone, …: exactly a site file
//! name = "left"
//! x = 0.0
//! y = 0.0
//!
//! [[sensor]]                      # only where it differs from a URG-04LX with real noise
//! module = "left"
//! model = "ust-10lx"
//! noise = "none"
//!
//! [[furniture]]
//! name = "table"
//! polygon = [[1, 1], [2, 1], [2, 1.6], [1, 1.6]]     # or disc = [x, y, radius_m]
//!
//! [[person]]
//! name = "anna"
//! route = [[2, -1], [2, 1, 3.0]]  # x, y and perhaps how many seconds to wait there
//! speed_m_s = 1.1
//! repeat = "back-and-forth"       # stay, leave, loop, back-and-forth
//!
//! [gathering]                     # people enter, wait before a door, and leave
//! condition = "dense"             # spread, dense, pairs
//! people = 5
//! bodies = "arms"                 # plain, arms, coats
//! black_share = 0.1               # of them wear black
//! avoidance = "velocity-obstacles" # or social-force
//! waiting = "milling"             # or as-they-stand
//! in_clumps = true                # two to four come at one time
//!
//! [[recorded]]                    # people on recorded trajectories
//! file = "corridor.txt"           # beside this file
//!
//! [[door]]
//! line = [[-0.45, 1], [0.45, 1]]
//! slide = [0.9, 0]
//! ```

pub use super::built_in::BUILT_IN;
pub use super::person_spec::PersonSpec;

use super::arrangement::Arrangement;
use super::built_in::on_its_base;
use super::door::Door;
use super::gathering::{GatheringSpec, MOST_PEOPLE};
use super::moving::{Curtain, Fan};
use super::noise::NoiseLevel;
use super::optics::SensorModel;
use super::placed::PlacedSpec;
use super::prop::Carried;
use super::site::Site;
use super::told::Told;
use super::trajectory::Recorded;
use serde::Deserialize;
use std::fmt;
use std::path::Path;

/// A scene, as in its file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Description, for people.
    #[serde(default)]
    pub about: String,
    /// The built-in scene that this one changes: its tables are merged, everything else is replaced.
    #[serde(default)]
    pub base: Option<String>,
    /// Duration; scripted walkers go on after that.
    #[serde(default = "one_minute")]
    pub duration_s: f64,
    /// The seed if none is asked for.
    #[serde(default)]
    pub seed: u64,
    /// People with routes avoid each other, within `duration_s`; else they walk exactly as
    /// written, without end.
    #[serde(default)]
    pub avoid: bool,
    /// Sensors that face each other now and then read each other's light.
    #[serde(default)]
    pub cross_talk: bool,
    /// Modules, walls, zones.
    pub site: Site,
    /// Share of the light that the walls give back.
    #[serde(default = "plaster")]
    pub wall_reflectance: f64,
    /// Sensors that are not the default.
    #[serde(default, rename = "sensor")]
    pub sensors: Vec<SensorSpec>,
    /// Things people walk around and beams meet.
    #[serde(default)]
    pub furniture: Vec<Furniture>,
    /// Scripted people.
    #[serde(default, rename = "person")]
    pub people: Vec<PersonSpec>,
    /// People that enter, wait before a door, and leave.
    pub gathering: Option<GatheringSpec>,
    /// People on recorded trajectories.
    #[serde(default)]
    pub recorded: Vec<Recorded>,
    /// Doors that open and shut.
    #[serde(default, rename = "door")]
    pub doors: Vec<Door>,
    /// What devices beside the guarded doors of the site say in a demonstration.
    #[serde(default)]
    pub told: Vec<Told>,
    /// Curtains that sway.
    #[serde(default, rename = "curtain")]
    pub curtains: Vec<Curtain>,
    /// Fans that turn to and fro.
    #[serde(default, rename = "fan")]
    pub fans: Vec<Fan>,
    /// What people of the script carry, push, pull or put down; not with `avoid`.
    #[serde(default)]
    pub carried: Vec<Carried>,
    /// Things that people of the script move from place to place; not with `avoid`.
    #[serde(default)]
    pub placed: Vec<PlacedSpec>,
    /// Other modules that can take the place of the site's.
    #[serde(default, rename = "arrangement")]
    pub arrangements: Vec<Arrangement>,
}

/// Painted plaster in infrared: a URG-04LX loses it beyond 5.7 m.
const fn plaster() -> f64 {
    0.53
}

const fn one_minute() -> f64 {
    60.0
}

/// A site file may have it from before; in a scene it would be ignored without a word.
fn has_wall_with_reflectance(scene: &toml::Table) -> bool {
    let walls = scene.get("site").and_then(|site| site.get("wall")).and_then(toml::Value::as_array);
    walls.into_iter().flatten().any(|wall| wall.get("reflectance").is_some())
}

/// The sensor of a module.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorSpec {
    /// The module it is plugged into.
    pub module: String,
    /// Its model.
    #[serde(default)]
    pub model: SensorModel,
    /// Real or perfect.
    #[serde(default)]
    pub noise: NoiseLevel,
}

/// A piece of furniture.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Furniture {
    /// Its name.
    #[serde(default)]
    pub name: String,
    /// Its corners, if it has corners.
    #[serde(default)]
    pub polygon: Vec<[f64; 2]>,
    /// x, y and radius, if it is round.
    pub disc: Option<[f64; 3]>,
    /// Reflectance.
    #[serde(default = "wood")]
    pub reflectance: f64,
    /// Height of its lower edge above the floor.
    #[serde(default)]
    pub low_m: f64,
    /// Height of its upper edge above the floor.
    #[serde(default = "man_high")]
    pub high_m: f64,
}

const fn wood() -> f64 {
    0.5
}

const fn man_high() -> f64 {
    2.0
}

/// Why a scene cannot be used: one line with the file, the place in it, and what to do.
#[derive(Debug)]
pub struct SceneError(String);

impl SceneError {
    /// An error with one line of text.
    pub(super) fn new(line: &str) -> Self {
        Self(line.to_owned())
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SceneError {}

impl Scene {
    /// Reads a scene file, or one of the [`BUILT_IN`] scenes by its name.
    ///
    /// # Errors
    /// The file does not exist, or is not a valid scene.
    pub fn load(file: &str) -> Result<Self, SceneError> {
        if let Some((name, text)) = BUILT_IN.iter().find(|(name, _)| *name == file) {
            return Self::parse(name, text);
        }
        let text = std::fs::read_to_string(file).map_err(|error| {
            let names: Vec<&str> = BUILT_IN.iter().map(|(name, _)| *name).collect();
            SceneError(format!("{file}: cannot be read ({error}); built-in scenes: {}", names.join(", ")))
        })?;
        Self::parse(file, &text)
    }

    /// Reads a scene from text; `file` is what errors call it.
    ///
    /// # Errors
    /// When the text is not TOML, has unknown or missing keys, or contradicts itself.
    pub fn parse(file: &str, text: &str) -> Result<Self, SceneError> {
        let wrong = |error: toml::de::Error| {
            let before = error.span().and_then(|span| text.get(..span.start));
            let line = before.map(|before| format!("{}:", before.matches('\n').count() + 1));
            let message = error.message().replace('\n', " ");
            SceneError(format!("{file}:{} {message}", line.unwrap_or_default()))
        };
        let own: toml::Table = toml::from_str(text).map_err(wrong)?;
        if has_wall_with_reflectance(&own) {
            let what = "site.wall has no reflectance: wall_reflectance of the scene is that of all walls";
            return Err(SceneError(format!("{file}: {what}")));
        }
        let mut scene: Self = if own.contains_key("base") {
            let whole = on_its_base(own).map_err(|what| SceneError(format!("{file}: {what}")))?;
            whole.try_into().map_err(wrong)?
        } else {
            toml::from_str(text).map_err(wrong)?
        };
        scene.check().map_err(|what| SceneError(format!("{file}: {what}")))?;
        let folder = Path::new(file).parent().unwrap_or(Path::new(""));
        for recorded in &mut scene.recorded {
            recorded.read(folder).map_err(|what| SceneError(format!("{file}: {what}")))?;
        }
        Ok(scene)
    }

    fn check(&self) -> Result<(), String> {
        self.site.check()?;
        if !(0.0..=1.0).contains(&self.wall_reflectance) {
            return Err(format!("wall_reflectance must be between 0 and 1, is {}", self.wall_reflectance));
        }
        if !(self.duration_s > 0.0 && self.duration_s <= 86_400.0) {
            return Err(format!("duration_s must be more than 0 and at most a day, is {}", self.duration_s));
        }
        for (index, sensor) in self.sensors.iter().enumerate() {
            if !self.site.modules.iter().any(|module| module.name == sensor.module) {
                return Err(format!("sensor {}: the site has no module \"{}\"", index + 1, sensor.module));
            }
            if self.sensors.iter().take(index).any(|other| other.module == sensor.module) {
                return Err(format!("module \"{}\" has two sensors: remove one", sensor.module));
            }
        }
        for (index, furniture) in self.furniture.iter().enumerate() {
            let corners = furniture.polygon.len();
            let round = furniture.disc.is_some_and(|[_, _, radius_m]| radius_m > 0.0);
            if (corners >= 3) == round || (corners > 0 && corners < 3) {
                return Err(format!(
                    "furniture {} \"{}\": give it a polygon of at least three corners or a disc [x, y, radius_m]",
                    index + 1,
                    furniture.name
                ));
            }
            if !(0.0..=1.0).contains(&furniture.reflectance) {
                return Err(format!("furniture {}: reflectance must be between 0 and 1", index + 1));
            }
        }
        for (index, door) in self.doors.iter().enumerate() {
            door.check().map_err(|what| format!("door {} \"{}\": {what}", index + 1, door.name))?;
        }
        for (index, told) in self.told.iter().enumerate() {
            told.check().map_err(|what| format!("told {}: {what}", index + 1))?;
            if !self.site.doors.iter().any(|door| door.name == told.door) {
                return Err(format!("told {}: the site has no door \"{}\"", index + 1, told.door));
            }
        }
        for carried in &self.carried {
            carried.check().map_err(|what| format!("carried \"{}\": {what}", carried.name))?;
            let carrier = self.people.iter().find(|person| person.name == carried.by);
            let Some(carrier) = carrier.filter(|_| !self.avoid) else {
                return Err(format!(
                    "carried \"{}\": no person is named \"{}\", or people avoid each other (avoid = true)",
                    carried.name, carried.by
                ));
            };
            if carried.puts_down_at.is_some_and(|index| index >= carrier.route.len()) {
                return Err(format!("carried \"{}\": the route has no such way point", carried.name));
            }
        }
        for placed in &self.placed {
            placed.check().map_err(|what| format!("placed \"{}\": {what}", placed.name))?;
            let mover = self.people.iter().find(|person| person.name == placed.by);
            let last = placed.moved_at.last().copied().unwrap_or(0);
            if self.avoid || mover.is_none_or(|mover| last >= mover.route.len()) {
                return Err(format!(
                    "placed \"{}\": no person is named \"{}\" and has such way points, or people avoid each other",
                    placed.name, placed.by
                ));
            }
        }
        if let Some(gathering) = &self.gathering
            && !((1..=MOST_PEOPLE).contains(&gathering.people) && (0.0..=3600.0).contains(&gathering.from_s))
        {
            return Err(format!("gathering: people must be 1 to {MOST_PEOPLE}, from_s 0 to 3600"));
        }
        if let Some(gathering) = &self.gathering
            && !(0.0..=1.0).contains(&gathering.black_share)
        {
            return Err(String::from("gathering: black_share must be 0 to 1"));
        }
        for (index, person) in self.people.iter().enumerate() {
            person.check().map_err(|what| format!("person {} \"{}\": {what}", index + 1, person.name))?;
            let known = self.people.iter().take(index);
            if !person.name.is_empty() && known.clone().any(|other| other.name == person.name) {
                return Err(format!("two people are named \"{}\": rename one", person.name));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        Scene::parse("x.toml", text).unwrap_err().to_string()
    }

    #[test]
    fn every_built_in_scene_is_sound() {
        for (name, _) in BUILT_IN {
            let scene = Scene::load(name).unwrap_or_else(|error| panic!("{error}"));
            assert!(!scene.site.modules.is_empty() && !scene.about.is_empty(), "{name}");
        }
    }

    #[test]
    fn a_scene_can_change_another_one() {
        let text = "base = \"door-area\"\n[gathering]\npeople = 9\ncondition = \"dense\"";
        let (changed, base) = (Scene::parse("x.toml", text).unwrap(), Scene::load("door-area").unwrap());
        assert_eq!(changed.gathering.unwrap().people, 9);
        assert_eq!((changed.site, changed.doors, changed.about), (base.site, base.doors, base.about));
        assert_eq!(refused("base = \"nowhere\""), "x.toml: base: no scene \"nowhere\"");
    }

    #[test]
    fn mistakes_are_named_in_one_line_with_their_place() {
        let module = "[[site.module]]\nname = \"a\"\nx = 0\ny = 0\n";
        let cases = [
            (
                String::from("[site]\n[[person]]\nroute = [[0, 0]]\nspeed = 1"),
                "x.toml:4: unknown field `speed`",
            ),
            (String::from("[site]\nx = ["), "x.toml:2: "),
            (format!("{module}[[sensor]]\nmodule = \"b\""), "x.toml: sensor 1: the site has no module \"b\""),
            (
                format!("{module}[[person]]\nname = \"eve\"\nroute = []"),
                "x.toml: person 1 \"eve\": route needs",
            ),
            (format!("{module}[[person]]\nroute = [[1]]"), "x.toml: person 1 \"\": route: a point is [x, y]"),
            (
                format!("{module}[[person]]\nroute = [[1, 1]]\nspeed_m_s = 9"),
                "speed_m_s must be between 0.05 and 4",
            ),
            (
                format!("{module}[[furniture]]\nname = \"box\""),
                "x.toml: furniture 1 \"box\": give it a polygon",
            ),
            (format!("{module}{module}"), "x.toml: two modules are named \"a\""),
            (
                format!("{module}[[sensor]]\nmodule = \"a\"\nmodel = \"urg\""),
                "x.toml:7: unknown variant `urg`",
            ),
            (
                format!("{module}[gathering]\ncondition = \"dense\"\npeople = 99"),
                "x.toml: gathering: people must be",
            ),
            (
                format!("{module}[[door]]\nline = [[0, 0], [0, 0]]"),
                "x.toml: door 1 \"\": line must be at least",
            ),
            (format!("{module}[[recorded]]\nfile = \"none.txt\""), "x.toml: none.txt: cannot be read"),
            (
                String::from("base = \"chair-back\"\n[[person]]\nname = \"eve\"\nroute = [[0, 0]]"),
                "x.toml: carried \"chair\": no person is named \"carrier\"",
            ),
            (String::from("duration_s = 0\n[site]"), "x.toml: duration_s must be more than 0"),
            (
                String::from("wall_reflectance = 2\n[site]"),
                "x.toml: wall_reflectance must be between 0 and 1",
            ),
            (
                format!("{module}[[site.wall]]\npoints = [[0, 0], [1, 0]]\nreflectance = 0.3"),
                "x.toml: site.wall has no reflectance: wall_reflectance",
            ),
        ];
        for (text, expected) in cases {
            let message = refused(&text);
            assert!(message.contains(expected), "{message}");
            assert!(!message.contains('\n'), "{message}");
        }
        let missing = Scene::load("nowhere.toml").unwrap_err().to_string();
        assert!(missing.starts_with("nowhere.toml: cannot be read") && missing.contains("demo"), "{missing}");
    }
}
