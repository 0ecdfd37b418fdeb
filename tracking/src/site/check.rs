//! What a site must be to be used: names that differ, numbers, parts that fit together.

use super::door::{Door, OFF_ZONE_M};
use super::part::{Kind, Part};
use super::wrong::{Wrong, Wrongs, number};
use super::{Site, Zone, floor, limits, line, reader, shape};
use crate::slug::slug;

/// Height of a module's plane above the floor, m. Lower, a plane that is half a degree off level meets the floor within 6 m; higher
/// than a depth camera may be, it is a slip.
const HEIGHT_M: std::ops::RangeInclusive<f64> = 0.05..=10.0;

/// How long a zone stays occupied, s: longer than an hour is no pause in which a person is hidden.
const HOLD_S: std::ops::RangeInclusive<f64> = 0.0..=3600.0;

/// A full turn either way, degrees: more says nothing more.
const TURN_DEG: f64 = 360.0;

impl Site {
    /// What is wrong with the site, as one sentence that names the part and what to do.
    ///
    /// # Errors
    /// The first contradiction found.
    pub fn check(&self) -> Result<(), String> {
        self.wrong().into_iter().next().map_or(Ok(()), |wrong| Err(wrong.text))
    }

    /// Polygons and walls with too many corners: such a site is compared with nothing, as each corner would be with each other.
    #[must_use]
    pub fn too_many_corners(&self) -> Vec<Wrong> {
        let mut said = Wrongs::default();
        limits::check_corners(self, &mut said);
        said.0
    }

    /// All that is wrong with it; of a polygon or a wall with too many corners, that alone.
    #[must_use]
    pub fn wrong(&self) -> Vec<Wrong> {
        let too_many = self.too_many_corners();
        if !too_many.is_empty() {
            return too_many;
        }
        let mut said = Wrongs::default();
        self.check_names(&mut said);
        for (index, module) in self.modules.iter().enumerate() {
            let numbers = [module.x, module.y, module.yaw_deg, module.height_m];
            if numbers.iter().any(|value| !value.is_finite()) {
                said.part(index, module, None, "x, y, yaw_deg and height_m must be numbers");
                continue;
            }
            if !HEIGHT_M.contains(&module.height_m) {
                let (low, high, is) = (HEIGHT_M.start(), HEIGHT_M.end(), number(module.height_m));
                let what = format!("height_m: must be from {low} to {high}, is {is}");
                said.part(index, module, "height_m", &what);
            }
            check_turn(index, module, module.yaw_deg, &mut said);
            let is_place = |[bearing_deg, range_m]: &[f64; 2]| {
                bearing_deg.abs() <= TURN_DEG && (0.0..=limits::BESIDE_M).contains(range_m)
            };
            if !module.furniture.iter().all(is_place) {
                said.part(index, module, "furniture", "furniture: must be bearings, degrees, and ranges, m");
            }
        }
        for (index, wall) in self.walls.iter().enumerate() {
            if wall.points.len() < 2 {
                said.part(index, wall, "points", "points needs at least two");
            }
        }
        for (index, zone) in self.zones.iter().enumerate() {
            check_area(index, zone, &zone.polygon, &mut said);
            if let Some(hold_s) = zone.hold_s.filter(|hold_s| !HOLD_S.contains(hold_s)) {
                let (low, high) = (HOLD_S.start(), HOLD_S.end());
                let what = format!("hold_s: must be from {low} to {high}, is {}", number(hold_s));
                said.part(index, zone, "hold_s", &what);
            }
        }
        for (index, entry) in self.entries.iter().enumerate() {
            if entry.line[0] == entry.line[1] {
                said.part(index, entry, "line", "line: both ends are at one place");
            }
            let Some(zone) = &entry.zone else { continue };
            if !self.zones.iter().any(|known| &known.name == zone) {
                said.part(index, entry, "zone", &format!("there is no zone \"{zone}\""));
            }
        }
        for (index, mover) in self.movers.iter().enumerate() {
            check_area(index, mover, &mover.polygon, &mut said);
        }
        for (index, exclude) in self.excludes.iter().enumerate() {
            check_area(index, exclude, &exclude.polygon, &mut said);
            // A person who stands there would go in beyond the number that was entered.
            let guarded = self.zones.iter().find(|zone| {
                self.doors.iter().any(|door| door.zone == zone.name)
                    && shape::meet(&zone.polygon, &exclude.polygon)
            });
            if let Some(Zone { name, .. }) = guarded {
                let what = format!("lies in zone \"{name}\" of a door, where everybody counts: move it out");
                said.part(index, exclude, "polygon", &what);
            }
        }
        for (index, door) in self.doors.iter().enumerate() {
            if let Err((key, what)) = check_door(door, &self.zones) {
                said.part(index, door, key, &what);
            }
        }
        reader::check(&self.readers, &mut said);
        floor::check(self, &mut said);
        for (index, floor) in self.floors.iter().enumerate() {
            check_turn(index, floor, floor.yaw_deg, &mut said);
        }
        line::check(self, &mut said);
        limits::check(self, &mut said);
        said.0
    }

    fn check_names(&self, said: &mut Wrongs) {
        check_names(&self.modules, true, said);
        check_names(&self.floors, true, said);
        check_names(&self.zones, true, said);
        check_names(&self.lines, true, said);
        check_names(&self.doors, true, said);
        self.check_topics(said);
        check_names(&self.readers, true, said);
        check_names(&self.entries, false, said);
        check_names(&self.movers, false, said);
        check_names(&self.excludes, false, said);
        let is_shared = |name: &str| self.modules.iter().any(|module| module.name == name);
        for (index, floor) in self.floors.iter().enumerate().filter(|(_, floor)| is_shared(&floor.name)) {
            let text = format!("a floor and a module are named \"{}\": rename one", floor.name);
            said.say(Kind::Floor, index, "name", text);
        }
    }

    /// Of two doors whose topics are alike one would get the other's, and its orders that lock, when the other is taken out.
    fn check_topics(&self, said: &mut Wrongs) {
        let slugs: Vec<String> = self.doors.iter().map(|door| slug(&door.name)).collect();
        for (index, door) in self.doors.iter().enumerate() {
            let mut before = self.doors.iter().zip(&slugs).take(index);
            let alike = before.find(|(other, known)| {
                other.name != door.name && slugs.get(index).is_some_and(|own| own == *known)
            });
            if let Some((other, topic)) = alike {
                // The earlier one keeps its topic, so its devices need no change.
                let what = format!(
                    "name: has the topic {topic:?}, as door \"{}\": rename door \"{}\", and use its new topic in its devices",
                    other.name, door.name
                );
                said.part(index, door, "name", &what);
            }
        }
    }
}

/// Names of one kind: they are written in a line, and `unique` ones differ and are not empty.
fn check_names<P: Part>(parts: &[P], unique: bool, said: &mut Wrongs) {
    for (index, part) in parts.iter().enumerate() {
        let name = part.name();
        if unique && name.trim().is_empty() {
            said.say(P::KIND, index, "name", format!("{} {}: has no name", P::KIND, index + 1));
        } else if name.contains(breaks_a_line) {
            let text =
                format!("{} {name:?}: name: has a line break or a control character: take it out", P::KIND);
            said.say(P::KIND, index, "name", text);
        }
        let twin = parts.iter().take(index).position(|other| other.name() == name);
        if let Some(twin) = twin.filter(|_| unique && !name.trim().is_empty()) {
            for index in [twin, index] {
                said.say(
                    P::KIND,
                    index,
                    "name",
                    format!("two {}s are named \"{name}\": rename one", P::KIND),
                );
            }
        }
    }
}

/// Control characters, separators of lines, and marks that turn the direction of what is written around them.
fn breaks_a_line(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

fn check_turn<P: Part>(index: usize, part: &P, yaw_deg: f64, said: &mut Wrongs) {
    if yaw_deg.is_finite() && yaw_deg.abs() > TURN_DEG {
        let is = number(yaw_deg);
        let what = format!("yaw_deg: must be from -{TURN_DEG} to {TURN_DEG}, is {is}");
        said.part(index, part, "yaw_deg", &what);
    }
}

fn check_area<P: Part>(index: usize, part: &P, polygon: &[[f64; 2]], said: &mut Wrongs) {
    if let Some(what) = shape::fault(polygon) {
        said.part(index, part, "polygon", &what);
    }
}

/// What is wrong with a door: the key, and a sentence without its name.
fn check_door(door: &Door, zones: &[Zone]) -> Result<(), (&'static str, String)> {
    let zone = match zones.iter().find(|zone| zone.name == door.zone) {
        None => return Err(("zone", format!("zone: there is no zone \"{}\"", door.zone))),
        Some(zone) if !zone.secure => {
            let name = &door.zone;
            return Err((
                "zone",
                format!("zone: \"{name}\" must have secure = true: who was not seen to come in counts, too"),
            ));
        }
        Some(zone) => zone,
    };
    let (from, to) = door.ends();
    let length_m = (to - from).length();
    // Of what is no place that alone is said.
    let is_place = limits::no_place(&door.line).is_none();
    if is_place && !(0.3..=20.0).contains(&length_m) {
        return Err(("line", format!("line: must be 0.3 to 20 m long, is {length_m:.2} m")));
    }
    let far_m = zone.apart_m((from, to));
    if is_place && far_m.is_finite() && far_m > OFF_ZONE_M {
        let what = format!(
            "line: is {far_m:.1} m from zone \"{}\": it must be in its edge, at most {OFF_ZONE_M} m off",
            door.zone
        );
        return Err(("line", what));
    }
    if let Some(what) = door.reader.and_then(|place| limits::no_place(&[place])) {
        return Err(("reader", format!("reader: {what}")));
    }
    if !(1..=16).contains(&door.people_max) {
        return Err(("people_max", format!("people_max: must be from 1 to 16, is {}", door.people_max)));
    }
    if !(1..=10).contains(&door.tries_max) {
        return Err(("tries_max", format!("tries_max: must be from 1 to 10, is {}", door.tries_max)));
    }
    for (key, seconds, low, high) in [
        ("ask_s", door.ask_s, 1.0, 600.0),
        ("check_s", door.check_s, 1.0, 60.0),
        ("pass_s", door.pass_s, 1.0, 120.0),
        ("next_s", door.next_s, 0.0, 60.0),
        ("close_s", door.close_s, 0.5, 120.0),
        ("passback_s", door.passback_s, 0.0, 86_400.0),
        ("exit_s", door.exit_s, 1.0, 120.0),
    ] {
        if !(low..=high).contains(&seconds) {
            return Err((key, format!("{key}: must be from {low} to {high}, is {}", number(seconds))));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SITE: &str = "[[module]]\nname = \"left\"\nx = 0\ny = 0\nyaw_deg = 90\nheight_m = 0.6\n
        [[zone]]\nname = \"hall\"\npolygon = [[0, 0], [4, 0], [4, 4], [0, 4]]\ncount = true\n
        [[zone]]\nname = \"study\"\npolygon = [[5, 0], [9, 0], [9, 4]]\n
        [[mover]]\npolygon = [[0, 0], [1, 0], [1, 1]]\n
        [[entry]]\nname = \"street\"\nline = [[0, 0], [1, 0]]\n";

    fn wrong(from: &str, to: &str) -> Vec<(Kind, usize, Option<&'static str>, String)> {
        let site: Site = toml::from_str(&SITE.replace(from, to)).unwrap();
        let all = site.wrong().into_iter();
        all.map(|Wrong { kind, index, key, text }| (kind, index, key, text)).collect()
    }

    #[test]
    fn nonsense_is_said_with_its_part_and_its_key() {
        assert_eq!(wrong("", ""), []);
        let height = |metres: &str| wrong("height_m = 0.6", &format!("height_m = {metres}"));
        let text = "module \"left\": height_m: must be from 0.05 to 10, is 1000000000".to_owned();
        assert_eq!(height("1e9"), [(Kind::Module, 0, Some("height_m"), text)]);
        assert_eq!([height("-5").len(), height("0.04").len(), height("0.05").len()], [1, 1, 0]);
        let text = "module \"left\": yaw_deg: must be from -360 to 360, is 1000000".to_owned();
        assert_eq!(wrong("yaw_deg = 90", "yaw_deg = 1e6"), [(Kind::Module, 0, Some("yaw_deg"), text)]);
        assert_eq!(wrong("yaw_deg = 90", "yaw_deg = -360"), []);
        let bow = wrong("[4, 0], [4, 4], [0, 4]", "[4, 4], [4, 0], [0, 4]");
        assert_eq!((bow.len(), bow[0].0, bow[0].1, bow[0].2), (1, Kind::Zone, 0, Some("polygon")));
        assert!(bow[0].3.starts_with("zone \"hall\": polygon crosses itself"), "{bow:?}");
        let line = wrong("[1, 0], [1, 1]", "[1, 0], [2, 0]");
        assert!(line[0].3.starts_with("mover 1: polygon has an area of 0.000 m²"), "{line:?}");
        let text = "entry \"street\": line: both ends are at one place".to_owned();
        assert_eq!(
            wrong("line = [[0, 0], [1, 0]]", "line = [[1, 0], [1, 0]]"),
            [(Kind::Entry, 0, Some("line"), text)]
        );
    }

    #[test]
    fn names_are_one_line_and_of_two_alike_both_are_named() {
        for (character, shown) in [("\\n", "\\n"), ("\\u0007", "\\u{7}"), ("\\u202e", "\\u{202e}")] {
            let [(kind, index, key, text)] = &wrong("\"study\"", &format!("\"a{character}b\""))[..] else {
                panic!("{character}")
            };
            assert_eq!((kind, index, key), (&Kind::Zone, &1, &Some("name")));
            assert_eq!(
                text,
                &format!("zone \"a{shown}b\": name: has a line break or a control character: take it out")
            );
        }
        assert_eq!(wrong("\"street\"", "\"a\\tb\"")[0].0, Kind::Entry);
        let twins = wrong("study", "hall");
        let text = "two zones are named \"hall\": rename one".to_owned();
        assert_eq!(twins, [0, 1].map(|index| (Kind::Zone, index, Some("name"), text.clone())));
    }

    #[test]
    fn all_that_is_wrong_is_said_and_the_first_is_why_it_is_refused() {
        let site: Site = toml::from_str(&SITE.replace("0.6", "-1").replace("90", "999")).unwrap();
        assert_eq!(site.wrong().len(), 2);
        assert_eq!(site.check(), Err("module \"left\": height_m: must be from 0.05 to 10, is -1".into()));
    }
}
