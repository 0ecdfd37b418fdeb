//! What a site may be at most: values beyond any real site, and values that would take all memory, are refused.
//!
//! A zone is divided into cells of 0.2 m, 24 bytes each; a place is at most ten kilometres from the origin.

use crate::geometry::{Point, bounds};
use crate::site::Site;
use crate::site::reader::Reads;

/// Farthest place from the origin along each axis, m.
pub(crate) const FARTHEST_M: f64 = 10_000.0;

/// Area of all zones' bounding boxes together, m²: 5 million cells, 120 MB.
const ZONES_M2: f64 = 200_000.0;

/// What is read farther than this from everything in the site is read elsewhere, m: three times as far as any device sees, and less
/// than the smallest room in millimetres.
pub(crate) const BESIDE_M: f64 = 100.0;

/// How far a place is from the upright rectangle around everything in the site, m; 0 within it, and in a site without anything.
pub(crate) fn beside_m(site: &Site, at: Point) -> f64 {
    let modules = site.modules.iter().map(|module| [module.x, module.y]);
    let walls = site.walls.iter().flat_map(|wall| &wall.points).copied();
    let zones = site.zones.iter().flat_map(|zone| &zone.polygon).copied();
    let entries = site.entries.iter().flat_map(|entry| &entry.line).copied();
    let points = modules.chain(walls).chain(zones).chain(entries).map(|[x, y]| Point::new(x, y));
    let readers = site.readers.iter().filter_map(|reader| match reader.reads {
        Reads::Near { at, .. } => Some(at),
        Reads::Pixels { .. } => None,
    });
    let floors = site.floors.iter().flat_map(|floor| {
        let across = Point::new(f64::from(floor.columns), f64::from(floor.rows)) * floor.pitch_m;
        [Point::default(), across].map(|corner| floor.corner().to_site(corner))
    });
    let Some((low, high)) = bounds(points.chain(readers).chain(floors)) else { return 0.0 };
    let beyond = |at: f64, low: f64, high: f64| (low - at).max(at - high).max(0.0);
    Point::new(beyond(at.x, low.x, high.x), beyond(at.y, low.y, high.y)).length()
}

/// What is too much or no place at all, as one sentence that names the part and what to do.
///
/// # Errors
/// The first found.
pub fn check(site: &Site) -> Result<(), String> {
    for module in &site.modules {
        if module.name.trim().is_empty() {
            return Err("a module has no name: give it its name or identity".to_owned());
        }
        places(&format!("module \"{}\"", module.name), &[[module.x, module.y]])?;
    }
    for (index, wall) in site.walls.iter().enumerate() {
        places(&format!("wall {}", index + 1), &wall.points)?;
    }
    let mut area_m2 = 0.0;
    for (index, zone) in site.zones.iter().enumerate() {
        if zone.name.trim().is_empty() {
            return Err(format!("zone {}: has no name", index + 1));
        }
        if site.zones.iter().take(index).any(|other| other.name == zone.name) {
            return Err(format!("two zones are named \"{}\": rename one", zone.name));
        }
        places(&format!("zone \"{}\"", zone.name), &zone.polygon)?;
        area_m2 += extent_m(&zone.polygon, 0) * extent_m(&zone.polygon, 1);
        if area_m2 > ZONES_M2 {
            return Err(format!(
                "zone \"{}\": all zones together are larger than {ZONES_M2} m²: make them smaller",
                zone.name
            ));
        }
    }
    for entry in &site.entries {
        places(&format!("entry \"{}\"", entry.name), &entry.line)?;
    }
    for mover in &site.movers {
        places(&format!("mover \"{}\"", mover.name), &mover.polygon)?;
    }
    for reader in &site.readers {
        if let Reads::Near { at, .. } = reader.reads {
            places(&format!("reader \"{}\"", reader.name), &[[at.x, at.y]])?;
        }
    }
    Ok(())
}

fn places(what: &str, places: &[[f64; 2]]) -> Result<(), String> {
    match places.iter().flatten().find(|metres| metres.is_nan() || metres.abs() > FARTHEST_M) {
        None => Ok(()),
        Some(metres) => {
            Err(format!("{what}: {metres} is no place: metres, at most {FARTHEST_M} from the origin"))
        }
    }
}

fn extent_m(polygon: &[[f64; 2]], axis: usize) -> f64 {
    let along = polygon.iter().filter_map(|corner| corner.get(axis).copied());
    let (low, high) =
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
    (high - low).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str) -> String {
        check(&toml::from_str(text).unwrap()).unwrap_err()
    }

    #[test]
    fn a_place_is_within_everything_or_so_far_beside_it() {
        let text = "[[module]]\nname = \"m\"\nx = -1\ny = 0\n[[floor]]\nname = \"mat\"\nx = 0\ny = 0\ncolumns = 25\nrows = 25\n
            [[reader]]\nname = \"gate\"\nx = 5\ny = 8\nreach_m = 1\n";
        let site: Site = toml::from_str(text).unwrap();
        let off_m = |x, y| beside_m(&site, Point::new(x, y));
        assert_eq!([off_m(-1.0, 0.0), off_m(4.0, 7.0), off_m(8.0, 12.0)], [0.0, 0.0, 5.0]);
        assert_eq!(beside_m(&Site::default(), Point::new(1e9, 0.0)), 0.0);
    }

    #[test]
    fn what_is_no_place_or_too_large_is_named() {
        assert!(said("[[wall]]\npoints = [[0, 0], [nan, 1]]").starts_with("wall 1: NaN is no place"));
        assert!(
            said("[[entry]]\nname = \"street\"\nline = [[0, 0], [inf, 1]]")
                .starts_with("entry \"street\": inf")
        );
        let large = "[[zone]]\nname = \"park\"\npolygon = [[0, 0], [1000, 0], [1000, 1000]]";
        assert!(said(large).starts_with("zone \"park\": all zones together are larger"));
        let zone = "[[zone]]\nname = \"a\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";
        assert_eq!(said(&format!("{zone}{zone}")), "two zones are named \"a\": rename one");
    }
}
