//! Edits of the site, as a user makes them on the map: one at random.

use kehai_tracking::site::{Exclude, Site, Wall, Zone};

use super::world::{Random, SITE};

fn zone(name: String, [x, y]: [f64; 2], size_m: f64, count: bool) -> Zone {
    let polygon = vec![[x, y], [x + size_m, y], [x + size_m, y + size_m], [x, y + size_m]];
    Zone { count, ..Zone::counted(name, polygon) }
}

/// Changes the site, and says how.
pub fn edit(site: &mut Site, random: &mut Random) -> &'static str {
    let first: Site = toml::from_str(SITE).unwrap();
    let number = random.below(100);
    let pick = |random: &mut Random, count: usize| random.below(count.max(1) as u64) as usize;
    match random.below(14) {
        0 => {
            let index = pick(random, site.modules.len());
            if let Some(module) = site.modules.get_mut(index) {
                module.height_m = random.within(0.3, 1.1);
            }
            "another height"
        }
        1 => {
            let index = pick(random, site.modules.len());
            if let Some(module) = site.modules.get_mut(index) {
                module.y += random.within(-0.3, 0.3);
            }
            "a module was moved"
        }
        2 => {
            if site.walls.pop().is_none() {
                site.walls.push(Wall::of(vec![[-0.9, 0.4], [0.9, 0.4]]));
            }
            "a wall through the hall"
        }
        3 => {
            if let Some(wall) = site.walls.first_mut() {
                wall.points.iter_mut().for_each(|point| point[1] -= 0.3);
            }
            "a wall was moved"
        }
        4 | 5 => {
            let name = format!("zone-{number}");
            if site.zones.iter().all(|zone| zone.name != name) {
                let at = [random.within(-1.2, 1.0), random.within(-1.2, 1.0)];
                site.zones.push(zone(name, at, random.within(0.5, 1.5), number.is_multiple_of(2)));
            }
            "a new zone"
        }
        6 => {
            let (index, name) = (pick(random, site.zones.len()), format!("named-{number}"));
            if site.zones.iter().all(|zone| zone.name != name)
                && let Some(zone) = site.zones.get_mut(index)
            {
                zone.name = name;
            }
            "another name of a zone"
        }
        7 => {
            if site.zones.len() > 1 {
                site.zones.remove(pick(random, site.zones.len()));
            }
            "a zone less"
        }
        8 => {
            let index = pick(random, site.zones.len());
            if let Some(zone) = site.zones.get_mut(index) {
                zone.count = !zone.count;
            }
            "what makes the total"
        }
        9 => {
            if site.modules.len() > 1 {
                site.modules.remove(pick(random, site.modules.len()));
            }
            "a module less"
        }
        10 => {
            for module in first.modules {
                if site.modules.iter().all(|known| known.name != module.name) {
                    site.modules.push(module);
                }
            }
            "all modules again"
        }
        11 => {
            let line = site.lines.first_mut().unwrap();
            line.from[0] += random.within(-0.2, 0.2);
            "a line was moved"
        }
        12 => {
            if site.excludes.pop().is_none() {
                let polygon = vec![[-0.6, -0.6], [0.3, -0.6], [0.3, 0.3], [-0.6, 0.3]];
                site.excludes.push(Exclude { name: "mirror".into(), polygon });
            }
            "an excluded area"
        }
        _ => {
            if site.zones.is_empty() {
                site.zones = first.zones;
                "zones again"
            } else {
                site.zones.clear();
                "no zones"
            }
        }
    }
}
