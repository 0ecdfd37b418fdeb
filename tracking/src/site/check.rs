//! What a site must be to be used: names that differ, numbers, parts that fit together.

use super::door::Door;
use super::{Site, Zone, floor, limits, reader};

impl Site {
    /// What is wrong with the site, as one sentence that names the part and what to do.
    ///
    /// # Errors
    /// The first contradiction found.
    pub fn check(&self) -> Result<(), String> {
        for (index, module) in self.modules.iter().enumerate() {
            if self.modules.iter().take(index).any(|other| other.name == module.name) {
                return Err(format!("two modules are named \"{}\": rename one", module.name));
            }
            let numbers = [module.x, module.y, module.yaw_deg, module.height_m];
            if numbers.iter().any(|number| !number.is_finite()) {
                return Err(format!(
                    "module \"{}\": x, y, yaw_deg and height_m must be numbers",
                    module.name
                ));
            }
        }
        for (index, wall) in self.walls.iter().enumerate() {
            if wall.points.len() < 2 {
                return Err(format!("wall {}: points needs at least two", index + 1));
            }
        }
        for zone in &self.zones {
            if zone.polygon.len() < 3 {
                return Err(format!("zone \"{}\": polygon needs at least three corners", zone.name));
            }
        }
        for entry in &self.entries {
            let Some(zone) = &entry.zone else { continue };
            if !self.zones.iter().any(|known| &known.name == zone) {
                return Err(format!("entry \"{}\": there is no zone \"{zone}\"", entry.name));
            }
        }
        if let Some(mover) = self.movers.iter().find(|mover| mover.polygon.len() < 3) {
            return Err(format!("mover \"{}\": polygon needs at least three corners", mover.name));
        }
        check_doors(self)?;
        reader::check(&self.readers)?;
        floor::check(self)?;
        limits::check(self)
    }
}

/// What is wrong with the doors of a site, as one sentence that names the door, the key and what to do.
///
/// # Errors
/// The first found.
fn check_doors(site: &Site) -> Result<(), String> {
    for (index, door) in site.doors.iter().enumerate() {
        if door.name.trim().is_empty() {
            return Err(format!("door {}: has no name", index + 1));
        }
        if site.doors.iter().take(index).any(|other| other.name == door.name) {
            return Err(format!("two doors are named \"{}\": rename one", door.name));
        }
        check_door(door, &site.zones).map_err(|what| format!("door \"{}\": {what}", door.name))?;
    }
    Ok(())
}

/// What is wrong with it, as one sentence without its name.
fn check_door(door: &Door, zones: &[Zone]) -> Result<(), String> {
    match zones.iter().find(|zone| zone.name == door.zone) {
        None => return Err(format!("zone: there is no zone \"{}\"", door.zone)),
        Some(zone) if !zone.secure => {
            let name = &door.zone;
            return Err(format!(
                "zone: \"{name}\" must have secure = true: who was not seen to come in counts, too"
            ));
        }
        Some(_) => {}
    }
    let (from, to) = door.ends();
    let length_m = (to - from).length();
    if !(0.3..=20.0).contains(&length_m) {
        return Err(format!("line: must be 0.3 to 20 m long, is {length_m:.2} m"));
    }
    if !(1..=16).contains(&door.people_max) {
        return Err(format!("people_max: must be from 1 to 16, is {}", door.people_max));
    }
    if !(1..=10).contains(&door.tries_max) {
        return Err(format!("tries_max: must be from 1 to 10, is {}", door.tries_max));
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
            return Err(format!("{key}: must be from {low} to {high}, is {seconds}"));
        }
    }
    Ok(())
}
